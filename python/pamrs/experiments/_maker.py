"""Standard experiments of a rig with chains, built from the rows of ``protocols.toml``.

Of one chain its pressure follows a course; of several one is moved while the others are held, or
all are moved at once, none as another one; on a load frame the length is moved while pressures are
held, held while they are moved, and both at once.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from importlib.resources import files
from typing import Any

import numpy as np

from pamrs._arrays import Array, Mask
from pamrs.channels import dotted
from pamrs.experiments._chains import (
    BANDWIDTH,
    Chain,
    Range,
    Spans,
    can_shut,
    commands_for,
    driving,
    pressure_range,
    spans_of,
)
from pamrs.experiments._experiment import (
    Experiment,
    QuantityFormatter,
    in_bar,
    in_mm,
    limited,
    other_payload,
)
from pamrs.experiments._frame import Frame
from pamrs.rig import Rig
from pamrs.simulation import simulate

# [Hz] of a multisine, lowest first: from slow creep to the band of an arm's joint
MULTISINE_FREQUENCIES = np.array([0.1, 0.23, 0.41, 0.73, 1.13, 1.9, 3.1])
# from one to the next, shared by multisines of several chains: just below their mean, 1.77
_FREQUENCY_RATIO = 1.7
_FADE_TIME = 3.0  # [s] over which a multisine begins
_FILLING_TIME = 3.0  # [s] before a load frame moves: 1 s to fill a muscle, the rest to settle


Row = Mapping[str, Any]
Legs = list[tuple[float, float]]
"""Straight lines: how long each takes [s], and the share of a range that it ends at."""


@cache
def rows(table: str) -> list[Row]:
    """The rows of a table of ``protocols.toml``: ``protocol`` or ``sealed``."""
    text = files("pamrs.experiments").joinpath("protocols.toml").read_text(encoding="utf-8")
    found: list[Row] = tomllib.loads(text)[table]
    return found


def _listed(words: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def _legs(row: Row, periods: Sequence[float]) -> Legs:
    """The legs of a row whose cycles take these periods [s]."""
    legs: Legs = [(seconds, share) for seconds, share in row.get("start", ())]
    legs += [(seconds, share) for share in row.get("levels", ()) for seconds in row["each"]]
    for period, cycles in zip(periods, row.get("cycles", ()), strict=True):
        for part, share, *holds in row["cycle"] * cycles:
            legs += [(part * period, share), *((hold, share) for hold in holds)]
    return legs


def _course(legs: Legs, begin: float, span: Range, sample_time: float) -> Array:
    """Straight lines (n,) from a value through the ends of legs, in the unit of the range."""
    ends = np.cumsum([0.0, *(seconds for seconds, _ in legs)])
    time = np.arange(round(float(ends[-1]) / sample_time) + 1) * sample_time
    return np.asarray(np.interp(time, ends, [begin, *(span.at(share) for _, share in legs)]))


def _shut(row: Row, rows: int, sample_time: float) -> Mask:
    """Samples in which valves are shut: those of the last leg of each level of a row."""
    legs = _legs({**row, "cycles": ()}, ())
    ends = np.cumsum([0.0, *(seconds for seconds, _ in legs)])
    time, each = np.arange(rows) * sample_time, len(row["each"])
    last = range(len(row.get("start", ())) + each - 1, len(legs), each)
    closed = [(time >= ends[k]) & (time < ends[k + 1]) for k in last]
    return np.asarray(np.logical_or.reduce(closed), dtype=bool)


def _wave(frequencies: Array, time: Array, turned: float = 0.0) -> Array:
    """Sum of sines (n,) with peaks at 1 in magnitude, smaller above 0.6 Hz; Schroeder's phases,
    which keep the peaks low, plus an angle [rad].
    """
    count = frequencies.size
    size = 1.0 / np.sqrt(1.0 + (frequencies / 0.6) ** 2)
    phase = -np.pi * np.arange(count) * np.arange(1, count + 1) / count + turned
    each = np.sin(2 * np.pi * frequencies[:, None] * time + phase[:, None])
    wave = (size[:, None] * each).sum(axis=0)
    return np.asarray(wave / np.abs(wave).max())


def _rounded(frequencies: Array) -> list[float]:
    """Frequencies rounded as texts have them [Hz]."""
    return [round(float(f), 3) for f in frequencies]


def _rounded_levels(
    row: Row, span: Range, rounded: Callable[[float], float], formatter: QuantityFormatter
) -> dict[str, Any]:
    """Levels of a row and reaches around them, rounded as texts have them."""
    level = [rounded(span.at(share)) for share in row.get("told", row.get("levels", ()))]
    step = row.get("step", 0.0) * (span.high - span.low) * 1e-5
    return {
        "level": level,
        "middle": level[0] if level else math.nan,
        "words": formatter.each(level, "bar"),
        "reach": [rounded(share * (span.high - span.low)) for share in row.get("reaches", ())],
        "step": step,
        "step_told": round(step, 4),
    }


@dataclass(frozen=True, eq=False)
class Maker:
    """Builds the experiments of one rig.

    Attributes
    ----------
    rig : Rig
        The rig.
    chains : list of Chain
        Its chains.
    dt : float
        Time between samples [s].
    frame : Frame or None
        What its load frame may do; None where it has none.
    highest : float or mapping of str to float or None
        Gauge pressures that are not to be exceeded [Pa], of several chains by their names.
    """

    rig: Rig
    chains: list[Chain]
    dt: float
    frame: Frame | None
    highest: float | Mapping[str, float] | None

    @cached_property
    def formatter(self) -> QuantityFormatter:
        """Formatter of texts in the units of the rig's file."""
        return QuantityFormatter(self.rig)

    @cached_property
    def spans(self) -> Spans:
        """Ranges of the chains' pressures; found with the first experiment."""
        if self.frame is not None:
            return self.frame.spans
        if len(self.chains) > 1:
            return spans_of(self.rig, highest=self.highest)
        return Spans({}, {"": pressure_range(self.rig, highest=self.highest)})

    def makers(self) -> Iterator[tuple[str, Callable[[], Experiment | None]]]:
        """Name of each experiment that the rig can do, with the function that makes it."""
        several = len(self.chains) > 1
        for row in rows("protocol"):
            build = getattr(self, f"_{row['build']}") if "build" in row else self._one
            if several and "each" in row["for"]:
                for chain in self.chains:
                    if self._can(row, [chain]):
                        yield f"{row['name']}.{chain.name}", partial(self._one, row, chain)
            elif self._can(row, self.chains):
                if self.frame is not None and row["for"] == "frame":
                    build = build if "build" in row else self._strokes
                    yield row["name"], partial(self._on_frame, build, row, self.frame)
                elif ("all" if several else "one") in row["for"]:
                    yield row["name"], partial(build, row, self.chains[0])

    def _can(self, row: Row, chains: Sequence[Chain]) -> bool:
        """True where the rig, or some of its chains, meet the conditions ``when`` of a row."""
        rig, (chain, *_) = self.rig, chains
        shut = all(can_shut(rig, one) for one in chains)
        has = {
            "shut": shut,
            "open": not shut,
            "regulated": chain.regulator is not None,
            "degrees": [rig.tables("valve")[v]["spool"] != "switching" for v in chain.valves]
            == [True],
            "weight": bool(rig.tables("arm") or rig.tables("load")),
            "joint": bool(rig.tables("arm")) and len(chain.moves) == 1,
        }
        return all(has[what] for what in row.get("when", ()))

    @property
    def given(self) -> bool:
        """True where pressures are set by a bench that the rig does not describe."""
        return not (self.chains[0].regulator is not None or self.chains[0].valves)

    def _begin(self, chain: Chain) -> float:
        """Pressure of a chain before the first command [Pa]."""
        return chain.before(self.rig) if len(self.chains) > 1 else 0.0

    def _period(self, seconds: float, rise: float) -> float:
        """Period [s] of a triangle over a change of pressure [Pa], longer where the bench is too
        slow.
        """
        if self.frame is None or not self.given:
            return seconds
        return max(seconds, round(2.02 * rise / self.frame.pressure_rate, 1))

    def _reach(self, chain: Chain) -> Range:
        """Range of a chain's pressure while all chains move: its own range, narrowed by the square
        root of their number.
        """
        own, several = self.spans.alone[chain.name], len(self.chains) > 1
        held = self.spans.held[chain.name] if several else own.at(0.5)
        half = 0.5 * (own.high - own.low) / len(self.chains) ** 0.5
        middle = float(np.clip(held, own.low + half, own.high - half))
        return Range(middle - half, middle + half)

    def _facts(self, row: Row, chain: Chain) -> dict[str, Any]:
        """Values that the texts and numbers of any row may use, by name."""
        kind = "set pressure" if chain.regulator is not None else "pressure"
        one = "the muscle pressure" if chain.regulator is None else "the regulator's set pressure"
        many = len(chain.valves) > 1
        return {
            **row,
            "what": f"the {kind} of {chain.name}" if len(self.chains) > 1 else one,
            "kind": kind,
            "valves": "the valves" if many else "the valve",
            "its": "its valves" if many else "its valve",
            "them": "them" if many else "it",
            "chains": len(self.chains),
        }

    def _driven(
        self,
        row: Row,
        facts: Mapping[str, Any],
        references: Mapping[str, Array],
        *,
        length: Array | None = None,
        moved: str = "",
        also: tuple[str, Mapping[str, Any]] = ("", {}),
        initial: dict[str, float] | None = None,
        **options: Any,
    ) -> Experiment | None:
        """The experiment of a row whose pressures [Pa] follow references (n,), by chain.

        ``length`` (n,) is that of the muscle on a load frame [m], held by default, which the text
        then says; ``moved`` the chain that is moved alone, ``also`` what is said of the others;
        ``shut`` and ``dither`` are for the loops that find the commands of valves.
        """
        changes: dict[str, float] = {}
        needs, rig = "", self.rig
        if row.get("payload"):
            found = other_payload(rig)
            if found is None:
                return None
            name, mass, needs = found
            changes, rig = {name: mass}, rig.with_parameters({name: mass})
            facts = {**facts, "payload": mass, "payload_told": round(mass, 3)}
        text = self.formatter.format(row["text"], **facts) + also[0]
        numbers = {k: facts[v] if isinstance(v, str) else v for k, v in row["numbers"].items()}
        numbers |= also[1]
        if self.chains[0].regulator is not None:
            references = {n: np.clip(values, 0.0, None) for n, values in references.items()}
        if self.frame is not None:
            if self.given:
                references, slower = self._reachable(self.frame, references)
                text += slower
            if length is None:
                held = self.frame.held
                text = f"with the length held at {self.formatter.each([in_mm(held)], 'mm')}, {text}"
                numbers["length_mm"] = in_mm(held)
                length = np.full(next(iter(references.values())).size, held)
            else:
                inside = np.clip(length, self.frame.lengths.low, self.frame.lengths.high)
                length = limited(inside, self.frame.rate * self.dt)
        options.setdefault("bandwidth", row.get("bandwidth", BANDWIDTH))
        (channel, command), *more = commands_for(
            rig, references, length=length, sample_time=self.dt, initial=initial, **options
        ).items()
        seconds, name = (command.size - 1) * self.dt, row["name"] + moved
        return Experiment(
            name,
            text,
            {"kind": name, **numbers, "duration_s": round(seconds, 1)},
            command,
            command.size,
            self.dt,
            initial or {},
            changes,
            seconds + row.get("extra", 0.0),
            channel,
            needs,
            dict(more),
        )

    def _reachable(
        self, frame: Frame, references: Mapping[str, Array]
    ) -> tuple[dict[str, Array], str]:
        """References clipped to each chain's range and to the bench's rate, and words on that."""
        found, slower = {}, False
        for name, values in references.items():
            span: Range = frame.spans.alone[name]
            inside = np.clip(values, span.low, span.high)
            found[name] = limited(inside, frame.pressure_rate * self.dt)
            slower |= bool(np.abs(found[name] - inside).max() > 0.01 * (span.high - span.low))
        most = self.formatter.each([frame.pressure_rate * 1e-5], "bar.2g")
        return found, f", the pressure by no more than {most}/s" if slower else ""

    def _one(self, row: Row, chain: Chain, **options: Any) -> Experiment | None:
        """One chain goes through a course, and all others are held."""
        span = self.spans.alone[chain.name]
        periods = [*row.get("periods", ())]
        if periods:  # the last one is the quickest, over this share of the range
            most = max(share for _, share in row["cycle"]) - min(s for _, s in row["cycle"])
            periods[-1] = self._period(periods[-1], most * (span.high - span.low))
        legs = _legs(row, periods)
        facts = {**self._facts(row, chain), **_rounded_levels(row, span, in_bar, self.formatter)}
        facts |= {"periods": periods, "period": periods[-1] if periods else math.nan}
        reference = _course(legs, self._begin(chain), span, self.dt)
        reference = options.pop("reference", reference)
        facts |= options.pop("facts", {})
        if row.get("shut"):
            shut = _shut(row, reference.size, self.dt)
            options["shut"] = {c.name: shut & (c is chain) for c in self.chains}
        if len(self.chains) == 1:
            return self._driven(row, facts, {"": reference}, **options)
        time = np.arange(reference.size) * self.dt
        held, others = self.spans.held, [c for c in self.chains if c is not chain]
        references: dict[str, Array] = {
            c.name: np.interp(time, [0.0, 2.0], [self._begin(c), held[c.name]]) for c in others
        }
        levels = [self.formatter.each([in_bar(held[c.name])], "bar") for c in others]
        same = _listed(levels if len(set(levels)) > 1 else levels[:1])
        return self._driven(
            row,
            facts,
            {c.name: references.get(c.name, reference) for c in self.chains},
            moved=f".{chain.name}",
            also=(
                f", and hold {_listed([c.name for c in others])} at {same}",
                {"moved": chain.name, "held_bar": {c.name: in_bar(held[c.name]) for c in others}},
            ),
            **options,
        )

    def _multisine(self, row: Row, chain: Chain) -> Experiment | None:
        time = np.asarray(np.arange(round(row["seconds"] / self.dt) + 1) * self.dt)
        faded, count = np.clip(time / _FADE_TIME, 0.0, 1.0), len(self.chains)
        references, used = {}, {}
        for k, own in enumerate(self.chains):
            frequencies = MULTISINE_FREQUENCIES * _FREQUENCY_RATIO ** (k / count)
            span, begin = self._reach(own), self._begin(own)
            size = row["reach"] * (span.high - span.low)
            moved = span.at(0.5) + size * _wave(frequencies, time, 2.0 * k)
            references[own.name] = begin + faded * (moved - begin)
            used[own.name] = _rounded(frequencies)
        own_levels = _rounded_levels(row, self._reach(chain), in_bar, self.formatter)
        facts = self._facts(row, chain) | own_levels
        facts |= self._levels() | {
            "frequencies": used if count > 1 else used[chain.name],
            "lowest": MULTISINE_FREQUENCIES[0],
            "highest": max(own[-1] for own in used.values()),
        }
        return self._driven(row, facts, references)

    def _levels(self) -> dict[str, Any]:
        """Ranges of the pressures of all chains, in words and in bar."""
        spans = {c.name: self._reach(c) for c in self.chains}
        levels = {n: [in_bar(s.low), in_bar(s.high)] for n, s in spans.items()}
        words = [f"{n} between {self.formatter.each(ends, 'bar')}" for n, ends in levels.items()]
        return {"words": _listed(words), "levels": levels}

    def _orders(self, row: Row, chain: Chain) -> Experiment | None:
        """Every chain goes through the same shares of its range, each in another order."""
        count = len(self.chains)
        shares = _shares(row, count)
        references, levels = {}, {}
        for k, own in enumerate(self.chains):
            turned, reach = _turned(shares, k), self._reach(own)
            legs = _legs({**row, "levels": turned}, ())
            references[own.name] = _course(legs, self._begin(own), reach, self.dt)
            levels[own.name] = [in_bar(reach.at(share)) for share in turned]
        words = "; ".join(f"{n}: {self.formatter.each(v, 'bar', ', ')}" for n, v in levels.items())
        facts = self._facts(row, chain) | {"levels": levels, "words": words}
        facts["count"] = "three" if len(shares) == 3 else f"{len(shares)}"
        options: dict[str, Any] = {}
        if row.get("shut"):
            size = references[chain.name].size
            shut = _shut({**row, "levels": shares}, size, self.dt)
            options["shut"] = {c.name: shut for c in self.chains}
        return self._driven(row, facts, references, **options)

    def _in_turn(self, row: Row, chain: Chain) -> Experiment | None:
        """Triangles of all chains, one after the other by a share of the period."""
        (period,), (cycles,) = row["periods"], row["cycles"]
        if row.get("stretched"):
            reaches = [self._reach(own) for own in self.chains]
            period = self._period(period, max(span.high - span.low for span in reaches))
        references = {}
        for k, own in enumerate(self.chains):
            late = k / len(self.chains)
            at = (np.arange(20 * cycles + 1) / 20.0 + late) % 1.0
            wave = (1.0 - np.abs(2.0 * at - 1.0)).tolist()  # from 0 up to 1 and down
            legs = [(2.0, wave[0]), *((period / 20.0, share) for share in wave[1:])]
            references[own.name] = _course(legs, self._begin(own), self._reach(own), self.dt)
        facts = self._facts(row, chain) | self._levels() | {"period": period}
        return self._driven(row, facts, references)

    def _null_ramp(self, row: Row, chain: Chain) -> Experiment | None:
        half = self.rig.tables("valve")[chain.valves[0]]["half_range"]
        reach, (rise, hold) = row["dither"]["share"] * half, (leg[0] for leg in row["start"])
        time = np.arange(round((rise + hold) / self.dt) + 1) * self.dt
        phase = np.clip(time - rise, 0.0, None) / row["dither"]["period"] % 1.0
        dither = reach * (1.0 - 4.0 * np.abs(((phase + 0.25) % 1.0) - 0.5)) * (time >= rise)
        facts = {"millivolts": 1e3 * reach, "volts": round(reach, 4)}
        return self._one(row, chain, dither=dither, facts=facts)

    def _both_sides(self, row: Row, chain: Chain) -> Experiment | None:
        """Experiment that holds pressures above and below those where equal leaks balance."""
        ambient, span = self.rig.tables("gas")[""]["ambient_pressure"], self.spans.alone[""]
        (fed,) = {self.rig.ports("valve")[name]["from"] for name in chain.valves}
        kind, _, place = fed.partition(".")
        if kind != "supply":
            return None  # what is in front of the valve would have to be let down as well
        middle = span.at(0.5) + ambient
        # x = psi(x) of ISO 6358: 0.76 to 0.81
        supply = max(middle / 0.8 - ambient, 1.15 * span.at(0.8))
        if supply > self.rig.tables("supply")[place]["initial_pressure"]:
            return None  # more than the supply gives
        facts = {"supply": in_bar(supply), "balance": in_bar(middle - ambient)}
        initial = {dotted("supply_pressure", place): supply}
        return self._one(row, chain, initial=initial, facts=facts)

    def _free_decay(self, row: Row, chain: Chain) -> Experiment | None:
        pressure, (angle,) = self.spans.alone[""].at(0.5), chain.moves
        joint = self.rig.tables("joint")[angle.partition(".")[2]]
        slow = np.interp(np.arange(601) * 0.01, [0.0, 3.0], [0.0, pressure])
        sent = commands_for(self.rig, {"": slow}, sample_time=0.01)
        rest = float(simulate(self.rig, sample_time=0.01, **driving(sent))[angle][-1])
        turned = rest + 0.15 * (joint["max_angle"] - joint["min_angle"])
        turned = min(turned, joint["max_angle"] - 0.05)
        reference = np.full(round(row["start"][-1][0] / self.dt) + 1, pressure)
        return self._one(
            row,
            chain,
            reference=reference,
            facts={"degrees": round(math.degrees(turned - rest), 0)},
            shut={"": np.ones(reference.size, dtype=bool)},
            initial={chain.pressure: pressure, angle: turned},
        )

    def _on_frame(
        self, build: Callable[..., Experiment | None], row: Row, frame: Frame
    ) -> Experiment | None:
        """An experiment that moves the length; None where the muscles pull over no stroke."""
        stroke = frame.stroke(row["at"][0])
        if stroke is None:
            return None
        spans = frame.spans.alone
        levels: Any = {n: [in_bar(span.at(s)) for s in row["at"]] for n, span in spans.items()}
        said = {n: self.formatter.each(own, "bar") for n, own in levels.items()}
        held = _listed([f"{n} at {words}" for n, words in said.items()])
        if len(set(said.values())) == 1:
            held = next(iter(said.values()))
        valves = sum(len(chain.valves) for chain in self.chains)
        facts = {
            **row,
            **_rounded_levels(row, stroke, in_mm, self.formatter),
            "lengths": [in_mm(stroke.high), in_mm(stroke.low)],
            "held": held,
            "held_bar": levels if len(levels) > 1 else next(iter(levels.values())),
            "all_valves": "all valves" if valves > 1 else "the valve",
        }
        quickest = max(2.0, _up(2.0 * (stroke.high - stroke.low) / frame.rate))
        return build(row, frame, stroke, quickest, facts)

    def _pressures(self, legs: Legs, rows: int) -> dict[str, Array]:
        """All pressures through legs, from where each begins by itself, for so many samples."""
        time, ends = np.arange(rows) * self.dt, np.cumsum([0.0, *(leg[0] for leg in legs)])
        found = {}
        for chain in self.chains:
            values = [self.spans.alone[chain.name].at(share) for _, share in legs]
            begin = values[0] if self.given else chain.before(self.rig)
            found[chain.name] = np.interp(time, ends, [begin, *values])
        return found

    def _strokes(
        self, row: Row, frame: Frame, stroke: Range, quickest: float, facts: dict[str, Any]
    ) -> Experiment | None:
        """The length goes through a course at each of some pressures."""
        periods = [max(least, round(k * quickest, 1)) for least, k in row.get("periods", ())]
        if "nested" in row:  # of the widest loop, which goes over nine tenths of the stroke
            (slow, times), (least, share) = row["nested"]
            quick = max(least, _up(share * quickest))
            periods = [max(slow, times * quick), quick]
        speeds = [2.0 * (stroke.high - stroke.low) / period for period in periods]
        own: Legs = [(_FILLING_TIME, 1.0), *_legs(row, periods)]
        legs = [*own * len(row["at"]), *((seconds, share) for seconds, share in row.get("end", ()))]
        seconds = sum(leg[0] for leg in own)
        levels = [leg for share in row["at"] for leg in ((1.0, share), (seconds - 1.0, share))]
        length = _course(legs, stroke.high, stroke, self.dt)
        facts |= {
            "period": periods[-1],
            "periods": [round(period, 2) for period in periods],
            "speeds": f"{self.formatter.each([1e3 * speed for speed in speeds], 'mm.3g')}/s",
        }
        options: dict[str, Any] = {}
        if "shut_from" in row:
            shut = np.arange(length.size) * self.dt >= row["shut_from"]
            options["shut"] = {chain.name: shut for chain in self.chains}
        references = self._pressures(levels, length.size)
        return self._driven(row, facts, references, length=length, **options)

    def _at_lengths(
        self, row: Row, frame: Frame, stroke: Range, quickest: float, facts: dict[str, Any]
    ) -> Experiment | None:
        """The pressures go through triangles at each of some lengths."""
        low, high = row["at"]
        rise = max(s.at(high) - s.at(low) for s in frame.spans.alone.values())
        period = self._period(row["period"], rise)
        lengths: Legs = []
        levels: Legs = []
        for goal in row["goals"]:
            lengths += [(quickest, goal), (1.0 + row["cycles"] * period, goal)]
            levels += [(quickest, low), (1.0, low)]
            levels += [(0.5 * period, high), (0.5 * period, low)] * row["cycles"]
        goals = [in_mm(stroke.at(goal)) for goal in row["goals"]]
        facts |= {"lengths": goals, "goals": self.formatter.each(goals, "mm")}
        facts["period"] = period
        length = _course(lengths, stroke.at(row["goals"][0]), stroke, self.dt)
        return self._driven(row, facts, self._pressures(levels, length.size), length=length)

    def _length_and_pressure(
        self, row: Row, frame: Frame, stroke: Range, quickest: float, facts: dict[str, Any]
    ) -> Experiment | None:
        """Length and pressures follow multisines without a common frequency."""
        low, high = row["at"]
        size = round((row["seconds"] + _FILLING_TIME) / self.dt) + 1
        time = np.asarray(np.arange(size) * self.dt, dtype=np.float64)
        faded, count = np.clip(time / _FILLING_TIME, 0.0, 1.0), len(self.chains) + 1
        each = [MULTISINE_FREQUENCIES * _FREQUENCY_RATIO ** (k / count) for k in range(count)]

        def fastest(frequencies: Array) -> float:
            return float(np.abs(np.diff(_wave(frequencies, time))).max()) / self.dt

        # a machine is slower than a valve: the length has the lower half, down to half of it
        middle, reach = stroke.at(0.5), row["reach"] * (stroke.high - stroke.low)
        each[0] = each[0][: max(1, each[0].size // 2)]
        each[0] = each[0] * min(1.0, max(0.5, 0.9 * frame.rate / (reach * fastest(each[0]))))
        reach = min(reach, 0.9 * frame.rate / fastest(each[0]))
        references = {}
        for k, chain in enumerate(self.chains, 1):
            span, wave = frame.spans.alone[chain.name], _wave(each[k], time, 2.0 * k)
            moved = span.low + (0.5 * (low + high) + 0.5 * (high - low) * wave) * (
                span.high - span.low
            )
            begin = moved[0] if self.given else chain.before(self.rig)
            references[chain.name] = begin + faded * (moved - begin)
        facts |= {
            "lengths": [in_mm(middle + reach), in_mm(middle - reach)],
            "frequencies": [_rounded(own) for own in each],
            "lowest": each[0][0],
            "highest": each[-1][-1],
        }
        length = middle + reach * faded * _wave(each[0], time)
        return self._driven(row, facts, references, length=length)


def _up(seconds: float) -> float:
    """The next longer time that is said with one digit behind the point [s]."""
    return math.ceil(10.0 * seconds) / 10.0


def _shares(row: Row, count: int) -> Sequence[float]:
    """Shares of their ranges at which so many chains rest: enough for an order of its own for each,
    two for each share (:func:`_turned`), or one where the row is mirrored.
    """
    if count <= 6:
        levels: Sequence[float] = row["levels"]
        return row.get("levels_of_two", levels) if count == 2 else levels
    if not row.get("mirrored"):
        return tuple(np.linspace(0.05, 0.95, (count + 1) // 2).tolist())
    up = np.linspace(0.05, 0.95, (count + 1) // 2 + 1).tolist()
    return (*up, *up[-2:0:-1])


def _turned(shares: Sequence[float], k: int) -> Sequence[float]:
    """Shares in the order of the k-th chain: rotated, and mirrored for every second chain."""
    at = (k // 2) % len(shares)
    turned = [*shares[at:], *shares[:at]]
    return [1.0 - share for share in turned] if k % 2 else turned
