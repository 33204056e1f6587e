"""Standard experiments that a rig can do, each as the commands that a person sends, with its
numbers in words.

The levels follow from the rig: the lowest pressure at which its arm leaves the stop and the highest
that keeps it off the other one. Of several chains (valves and their chambers, or regulators) one is
moved while the others are held, or all are moved at once, none as another one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import dotted
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments._chains import (
    BANDWIDTH,
    Range,
    can_shut,
    chains_of,
    is_sealed,
    joined,
    pressure_range,
    trial_of,
)
from pamrs.experiments._experiment import (
    MULTISINE_FREQUENCIES,
    Experiment,
    Points,
    in_bar,
    nested_triangles,
    other_payload,
    then,
    through,
    waves,
    within,
)
from pamrs.experiments._frame import Rates, Seen, frame_of, seen_in
from pamrs.experiments._several import several_library
from pamrs.experiments._stand import Stand
from pamrs.experiments._strokes import stroke_library
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import has_frame, simulate

__all__ = ["experiments_of", "library"]

_SAMPLE_TIME = 0.005  # [s] sample time of an experiment where no recording tells
_LEAST_SAMPLE_TIME = 0.002  # [s] shortest sample time
_SEALED_SAMPLE_TIME = 0.1  # [s] sample time for a chamber without a valve, which changes slowly
_RATE_WINDOW = 0.3  # [s] over which a rate is counted: noise of a length is then a tenth of a mm/s
_MOST_SAMPLE_TIME = 0.01  # [s] longest sample time where recordings tell
_LEAST_SEALED_SAMPLE_TIME = 0.05  # [s] shortest sample time of a sealed chamber
_MOST_SEALED_SAMPLE_TIME = 1.0  # [s] longest sample time of a sealed chamber
# [Pa] gauge reach of what was never recorded above: moves no muscle, far above its noise
_LEAST_HIGHEST = 2e4
# samples of a pressure that blows over, which may take 1 s to 60 s (20 ms at most)
_MOST_BLOWN_SAMPLES = 3000


Array = NDArray[np.float64]

_SHUTTING = ("sealed_hold", "step_and_shut", "null_ramp", "holds_both_sides")
"""Experiments that need a valve which can be shut."""


class _Maker:
    """Builds the experiments of one rig."""

    def __init__(self, stand: Stand, span: Range) -> None:
        self.stand, self.rig, self.dt, self.span = stand, stand.rig, stand.sample_time, span
        self.bandwidth, self.frequencies = BANDWIDTH, MULTISINE_FREQUENCIES
        (self.chain,) = stand.chains
        regulated = stand.regulated
        self.what = "the regulator's set pressure" if regulated else "the muscle pressure"
        self.valves = "the valves" if len(self.chain.valves) > 1 else "the valve"

    def driven(
        self, name: str, text: str, excitation: dict[str, Any], reference: Array, **options: Any
    ) -> Experiment:
        if self.stand.regulated:
            reference = np.clip(reference, None, self.span.high)
        if "shut" in options:
            options["shut"] = {"": options["shut"]}
        return self.stand.driven(name, text, excitation, {"": reference}, **options)

    def levels(self, *shares: float) -> tuple[list[float], str]:
        pressures = [self.span.at(s) for s in shares]
        return pressures, ", ".join(
            f"{in_bar(p):g}" for p in pressures[:-1]
        ) + f" and {in_bar(pressures[-1]):g} bar"

    def triangle(self, name: str, period: float, cycles: int, **options: Any) -> Experiment:
        low, high = self.span.at(0.05), self.span.at(0.95)
        period = self.stand.period(period, high - low)
        points: Points = then([(0.0, 0.0)], (2.0, low))
        for _ in range(cycles):
            points = then(points, (0.5 * period, high), (0.5 * period, low))
        text = options.pop("text", "") + (
            f"drive {self.what} as a triangle between {in_bar(low):g} and {in_bar(high):g} bar "
            f"with a period of {period:g} s, {cycles} cycles, the first one kept"
        )
        excitation = {
            "levels_bar": [in_bar(low), in_bar(high)],
            "period_s": period,
            "cycles": cycles,
            **options.pop("also", {}),
        }
        return self.driven(name, text, excitation, through(points, self.dt), **options)

    def sealed(self, hold: float = 16.0) -> Experiment:
        pressures, words = self.levels(0.15, 0.55, 0.95)
        return self._holds(
            "sealed_hold",
            pressures,
            hold,
            f"fill to {words}, shut {self.valves} at each and hold it for {hold:g} s",
        )

    def both_sides(self, hold: float = 16.0) -> Experiment | None:
        """Holds above and below the pressure at which equal leaks from the supply and to the
        ambient balance.
        """
        ambient = self.rig.tables("gas")[""]["ambient_pressure"]
        (fed,) = {self.rig.ports("valve")[name]["from"] for name in self.chain.valves}
        kind, _, place = fed.partition(".")
        if kind != "supply":
            return None  # what stands in front of the valve would have to be let down as well
        middle = self.span.at(0.5) + ambient
        supply = max(
            middle / 0.8 - ambient, 1.15 * self.span.at(0.8)
        )  # x = psi(x) of ISO 6358: 0.76 to 0.81
        if supply > self.rig.tables("supply")[place]["initial_pressure"]:
            return None  # more than the supply gives
        pressures, words = self.levels(0.1, 0.8)
        text = (
            f"turn the supply down to {in_bar(supply):g} bar, so that leaks through the valve's "
            f"centre would balance near {in_bar(middle - ambient):g} bar; fill to {words}, on both "
            f"sides of it, shut the valve at each and hold it for {hold:g} s"
        )
        also = {"supply_bar": in_bar(supply), "balance_bar": in_bar(middle - ambient)}
        return self._holds(
            "holds_both_sides",
            pressures,
            hold,
            text,
            also,
            {dotted("supply_pressure", place): supply},
            extra=60.0,
        )

    def _holds(
        self,
        name: str,
        pressures: list[float],
        hold: float,
        text: str,
        also: dict[str, Any] | None = None,
        initial: dict[str, float] | None = None,
        extra: float = 0.0,
    ) -> Experiment:
        points: Points = [(0.0, 0.0)]
        closed: list[tuple[float, float]] = []
        for pressure in pressures:
            points = then(points, (1.0, pressure), (1.0, pressure))
            closed.append((points[-1][0], points[-1][0] + hold))
            points = then(points, (hold, pressure))
        reference = through(points, self.dt)
        shut = within(reference.size, self.dt, closed)
        excitation = {"levels_bar": [in_bar(p) for p in pressures], "hold_s": hold, **(also or {})}
        return self.driven(
            name, text, excitation, reference, shut=shut, initial=initial or {}, extra=extra
        )

    def multisine(self) -> Experiment:
        frequencies = list(self.frequencies)
        time = np.asarray(np.arange(round(30.0 / self.dt) + 1) * self.dt, dtype=np.float64)
        wave = waves(np.array(frequencies), time, 0.0)
        wave *= 0.4 / np.abs(wave).max()
        reference = np.clip(time / 3.0, 0.0, 1.0) * (
            self.span.at(0.5) + wave * (self.span.high - self.span.low)
        )
        low, high = self.span.at(0.1), self.span.at(0.9)
        text = (
            f"drive {self.what} as a multisine of {frequencies[0]:g} to "
            f"{frequencies[-1]:g} Hz between {in_bar(low):g} and {in_bar(high):g} bar for 30 s"
        )
        excitation = {"frequencies_hz": frequencies, "levels_bar": [in_bar(low), in_bar(high)]}
        return self.driven("multisine", text, excitation, reference)

    def staircase(self) -> Experiment:
        shares = [0.1, 0.35, 0.6, 0.85, 0.6, 0.35, 0.1]
        points: Points = [(0.0, 0.0)]
        for share in shares:
            points = then(points, (0.5, self.span.at(share)), (4.5, self.span.at(share)))
        _, words = self.levels(*shares[:4])
        text = f"climb to {words} and down again, with {self.what} held for 4.5 s at each step"
        excitation = {"levels_bar": [in_bar(self.span.at(s)) for s in shares], "hold_s": 4.5}
        return self.driven("staircase", text, excitation, through(points, self.dt))

    def long_hold(self) -> Experiment:
        up, back = self.span.at(0.9), self.span.at(0.45)
        points = then(
            [(0.0, 0.0)],
            (2.0, self.span.at(0.05)),
            (0.3, up),
            (25.0, up),
            (0.3, back),
            (25.0, back),
        )
        text = (
            f"step to {in_bar(up):g} bar, then back to {in_bar(back):g} bar, and keep "
            f"{self.what} there for 25 s after each"
        )
        excitation = {"levels_bar": [in_bar(up), in_bar(back)], "hold_s": 25.0}
        return self.driven("long_hold", text, excitation, through(points, self.dt))

    def step_and_shut(self) -> Experiment:
        base, small, large = self.span.at(0.05), self.span.at(0.3), self.span.at(0.8)
        points: Points = then([(0.0, 0.0)], (1.5, base), (0.5, base))
        closed = []
        for goal in (small, base, large, base):
            points = then(points, (0.02, goal), (0.35, goal))
            closed.append((points[-1][0], points[-1][0] + 4.0))
            points = then(points, (4.0, goal))
        reference = through(points, self.dt)
        shut = within(reference.size, self.dt, closed)
        them = "them" if len(self.chain.valves) > 1 else "it"
        text = (
            f"step from {in_bar(base):g} bar to {in_bar(small):g} bar and back, then to "
            f"{in_bar(large):g} bar and back (sizes 1:3), with {self.valves} far open, shut {them} "
            "0.35 s after each step and watch for 4 s"
        )
        excitation = {"levels_bar": [in_bar(base), in_bar(small), in_bar(large)], "watch_s": 4.0}
        return self.driven("step_and_shut", text, excitation, reference, shut=shut, bandwidth=30.0)

    def nested(self) -> Experiment:
        low, high = self.span.low, self.span.high
        quick = self.stand.period(1.2, 0.9 * (high - low))
        points, text, numbers = nested_triangles(low, high, self.what, periods=(12.0, quick))
        return self.driven("nested_triangles", text, numbers, through(points, self.dt))

    def null_ramp(self) -> Experiment:
        middle = self.span.at(0.5)
        half = self.rig.tables("valve")[self.chain.valves[0]]["half_range"]
        reach, period, seconds = 0.03 * half, 2.0, 24.0
        time = np.arange(round((seconds + 2.0) / self.dt) + 1) * self.dt
        phase = np.clip(time - 2.0, 0.0, None) / period % 1.0
        dither = reach * (1.0 - 4.0 * np.abs(((phase + 0.25) % 1.0) - 0.5)) * (time >= 2.0)
        reference = np.clip(time / 2.0, 0.0, 1.0) * middle
        text = (
            f"hold {in_bar(middle):g} bar by slow corrections and ramp the valve command through "
            f"its null by ±{1e3 * reach:.0f} mV in both directions, period {period:g} s, for "
            f"{seconds:g} s"
        )
        excitation = {"level_bar": in_bar(middle), "reach_v": round(reach, 4), "period_s": period}
        return self.driven("null_ramp", text, excitation, reference, dither=dither, bandwidth=1.5)

    def free_decay(self) -> Experiment | None:
        pressure = self.span.at(0.5)
        (angle,) = self.chain.moves
        joint = self.rig.tables("joint")[angle.partition(".")[2]]
        reference = through([(0.0, pressure), (8.0, pressure)], self.dt)
        shut = np.ones(reference.size, dtype=bool)
        slow = through([(0.0, 0.0), (3.0, pressure), (6.0, pressure)], 0.01)
        command = trial_of(self.rig, slow, sample_time=0.01, bandwidth=self.bandwidth)
        rest = simulate(self.rig, command, sample_time=0.01)[angle][-1]
        turned = min(
            float(rest) + 0.15 * (joint["max_angle"] - joint["min_angle"]),
            joint["max_angle"] - 0.05,
        )
        shown = round(math.degrees(turned - float(rest)), 0)
        initial = {self.chain.pressure: pressure, angle: turned}
        text = (
            f"at {in_bar(pressure):g} bar with {self.valves} shut, lift the arm by hand by "
            f"{shown:g} deg, let it go and record 8 s from the release"
        )
        excitation = {"level_bar": in_bar(pressure), "deflection_deg": shown}
        try:
            return self.driven(
                "free_decay", text, excitation, reference, shut=shut, initial=initial, extra=30.0
            )
        except SimulationError:
            return None

    def set_steps(self) -> Experiment:
        base, small, large = self.span.at(0.05), self.span.at(0.3), self.span.at(0.8)
        points: Points = then([(0.0, 0.0)], (1.5, base), (2.0, base))
        for goal in (small, base, large, base):
            points = then(points, (0.0, goal), (5.0, goal))
        text = (
            f"step {self.what} from {in_bar(base):g} bar to {in_bar(small):g} bar and back, then "
            f"to {in_bar(large):g} bar and back (sizes 1:3), and keep each for 5 s"
        )
        excitation = {"levels_bar": [in_bar(base), in_bar(small), in_bar(large)], "hold_s": 5.0}
        return self.driven("set_steps", text, excitation, through(points, self.dt))

    def fine_staircase(self) -> Experiment:
        middle, step = self.span.at(0.5), 0.01 * (self.span.high - self.span.low)
        points: Points = then([(0.0, 0.0)], (2.0, middle), (2.0, middle))
        for k in (*range(1, 7), *range(5, -7, -1), *range(-5, 1)):
            points = then(points, (0.0, middle + k * step), (1.5, middle + k * step))
        text = (
            f"move {self.what} by single steps of {step * 1e-5:.2g} bar, six up from "
            f"{in_bar(middle):g} bar, twelve down and six up again, 1.5 s each"
        )
        excitation = {
            "middle_bar": in_bar(middle),
            "step_bar": round(step * 1e-5, 4),
            "hold_s": 1.5,
        }
        return self.driven("fine_staircase", text, excitation, through(points, self.dt))

    def other_payload(self) -> Experiment | None:
        found = other_payload(self.rig)
        if found is None:
            return None
        name, other, needs = found
        text = f"change the payload to {other:.3g} kg and "
        also = {"payload_kg": round(other, 3)}
        changes = {name: other}
        return self.triangle(
            "other_payload", 12.0, 2, text=text, also=also, changes=changes, extra=90.0, needs=needs
        )


def _sealed_library(rig: Rig, span: Range, sample_time: float) -> list[Experiment]:
    """Fills of all chambers, shut off and left alone; where lines join several chambers, also of
    one, which then blows over into the others.
    """
    chambers, segments = list(rig.tables("chamber")), _segments(rig)
    out = []
    for name, pressure, seconds in (
        ("hold_low", span.low, 600.0),
        ("hold_high", span.high, 600.0),
        ("hold_short", span.high, 120.0),
        ("hold_long", span.high, 1800.0),
    ):
        if segments:
            break  # waves would be followed for minutes
        one = len(chambers) == 1
        filled, it, its = ("the chamber", "it", "its") if one else ("all chambers", "them", "their")
        what = f"open {its} outlet" if _outlets(rig) else f"shut {it} off"
        text = (
            f"fill {filled} to {in_bar(pressure):g} bar, {what} and record {seconds:g} s from "
            "that moment"
        )
        begin = {dotted("muscle_pressure", chamber): pressure for chamber in chambers}
        out.append(_left_alone(name, text, begin, seconds, sample_time))
    for chamber in chambers:
        reached = joined(rig, qualified("chamber", chamber))
        if not reached:
            continue
        begin = {dotted("muscle_pressure", other): span.low for other in chambers}
        begin[dotted("muscle_pressure", chamber)] = span.high
        try:
            seconds = _equalised(rig, begin, [chamber, *reached])
        except SimulationError:
            continue  # the model does not hold there: nothing to propose to anyone
        text = (
            f"fill {chamber} to {in_bar(span.high):g} bar and the rest to {in_bar(span.low):g} "
            f"bar, open what lies between and record {seconds:.2g} s from that moment"
        )
        step = max(_LEAST_SAMPLE_TIME, seconds / _MOST_BLOWN_SAMPLES)
        out.append(_left_alone(f"blow_over.{chamber}", text, begin, seconds, step))
    return out


def _segments(rig: Rig) -> bool:
    """Whether a tube of a rig carries waves."""
    return any(line.get("segments") for line in rig.tables("line").values())


def _outlets(rig: Rig) -> bool:
    """Whether a line lets the air of a sealed rig out."""
    return any(ends["to"] == "ambient" for ends in rig.ports("line").values())


def _equalised(rig: Rig, begin: dict[str, float], joining: Collection[str]) -> float:
    """Three times as long as chambers that lines join take to come within a hundredth of each other
    [s], from 1 s to 60 s.
    """
    found = simulate(rig, sample_time=_SAMPLE_TIME, duration=20.0, initial=begin)
    each = np.array([found[dotted("muscle_pressure", name)] for name in joining])
    apart = each.max(axis=0) - each.min(axis=0)
    late = np.flatnonzero(apart > 0.01 * apart[0])
    return float(np.clip(3.0 * found.time[late[-1]], 1.0, 60.0))


def _left_alone(
    name: str, text: str, begin: dict[str, float], seconds: float, sample_time: float
) -> Experiment:
    """Some pressures to begin with, and nothing that is sent."""
    excitation = {
        "kind": name,
        "levels_bar": sorted({in_bar(pressure) for pressure in begin.values()}),
        "duration_s": round(seconds, 2),
    }
    rows = round(seconds / sample_time) + 1
    return Experiment(name, text, excitation, None, rows, sample_time, begin, {}, seconds)


def library(
    rig: Rig,
    rates: Rates,
    *,
    sample_time: float | None = None,
    highest: float | Mapping[str, float] | None = None,
    seen: Seen | None = None,
    only: Collection[str] | None = None,
) -> list[Experiment]:
    """The standard experiments that a rig can do.

    Parameters
    ----------
    rig : Rig
        A rig with valves or regulators, with or without arms or a load; a load frame that sets the
        pressures itself; or chambers that nobody sends a command to.
    rates : Rates
        How fast a plain testing machine moves, for a rig with a load frame.
    sample_time : float, optional
        Time between samples [s].
    highest : float or mapping of str to float, optional
        Gauge pressure that is not to be exceeded [Pa], of several chains by their names.
    seen : Seen, optional
        What recordings showed a load frame to do; what a plain machine can by default.
    only : collection of str, optional
        Names or kinds of those to make; all by default.

    Returns
    -------
    list of Experiment
        Those that the rig survives in simulation.

    Raises
    ------
    DiagnosisError
        If no experiment is made for such a rig, nothing says how high a pressure may be set, or the
        model of the rig does not hold while its pressures rise.
    ParameterError
        If ``highest`` has a name that is none of a chain.
    """
    chains = chains_of(rig)
    if not chains and (rig.tables("supply") or rig.tables("muscle") or rig.tables("valve")):
        raise DiagnosisError(
            f"rig {rig.name!r} has no valve that a person could command, and no regulator; "
            "experiments need one, or a sealed chamber"
        )
    names = [chain.name for chain in chains] or [""]
    unknown = [n for n in highest if n not in names] if isinstance(highest, Mapping) else []
    if unknown:
        raise ParameterError(
            f"highest has {unknown[0]!r}, which is not allowed: of rig {rig.name!r} one of "
            f"{', '.join(map(repr, names))}"
        )
    usual = _SAMPLE_TIME if chains else _SEALED_SAMPLE_TIME
    step = usual if sample_time is None else sample_time
    if not chains:
        span = pressure_range(rig, highest=highest)
        sealed = _sealed_library(rig, span, step)
        return [e for e in sealed if only is None or e.name in only or e.kind in only]
    frame = frame_of(rig, rates, highest, seen) if has_frame(rig) else None
    stand = Stand(rig, chains, step, BANDWIDTH, frame)
    if len(chains) > 1:
        if not isinstance(highest, Mapping):
            highest = {} if highest is None else {c.name: highest for c in chains}
        makers = several_library(stand, highest)
    elif frame is not None:
        makers = _of_one(_Maker(stand, frame.spans.alone[""]))
    else:
        span = pressure_range(rig, highest=highest)
        makers = _of_one(_Maker(stand, span))
    makers |= stroke_library(stand)
    out = []
    for name, maker in makers.items():
        if only is not None and name not in only and name.partition(".")[0] not in only:
            continue
        try:
            found = maker()
            if found is not None and not _exceeds(found, rig):
                out.append(found)
        except SimulationError:
            continue  # the model does not hold there: nothing to propose to anyone
    return out


def experiments_of(
    rig: Rig,
    records: Sequence[Recording],
    rates: Rates,
    only: Collection[str] | None = None,
) -> list[Experiment]:
    """The experiments of the rig (those of some kinds, if they are given), at the sample time and
    up to the pressures of what was recorded.

    Raises
    ------
    DiagnosisError
        If there are none for such a rig.
    """
    if not records:
        return library(rig, rates, only=only)
    shortest, longest = _LEAST_SAMPLE_TIME, _MOST_SAMPLE_TIME
    if is_sealed(rig):
        shortest, longest = _LEAST_SEALED_SAMPLE_TIME, _MOST_SEALED_SAMPLE_TIME
    step = min(max(min(r.sample_time for r in records), shortest), longest)
    every = tuple(dotted("muscle_pressure", name) for name in rig.tables("chamber"))
    seen = {chain.name: chain.seen for chain in chains_of(rig)} or {"": every}
    limits = {}
    for chain, names in seen.items():
        peaks = [
            float(np.nanmax(r.channels[name]))
            for r in records
            for name in names
            if name in r.channels and np.isfinite(r.channels[name]).any()
        ]
        if peaks:  # of one that nobody filled as well: it is filled no further
            limits[chain] = max(*peaks, _LEAST_HIGHEST)
    if limits:
        # what has no gauge is moved no higher than what has one
        highest = max(limits.values())
        limits = {chain: limits.get(chain, highest) for chain in seen}
    shown = seen_in(rig, records, _RATE_WINDOW) if has_frame(rig) else None
    return library(rig, rates, sample_time=step, highest=limits or None, seen=shown, only=only)


def _of_one(make: _Maker) -> dict[str, Callable[[], Experiment | None]]:
    """What makes each experiment of a rig of one chain, by its name."""
    rig, chain = make.rig, make.chain
    makers: dict[str, Callable[[], Experiment | None]] = {
        "multisine": make.multisine,
        "sealed_hold": make.sealed,
        "slow_triangle": lambda: make.triangle("slow_triangle", 15.0, 2),
        "step_and_shut": make.step_and_shut,
        "staircase": make.staircase,
        "long_hold": make.long_hold,
        "nested_triangles": make.nested,
        "fast_triangle": lambda: make.triangle("fast_triangle", 1.5, 10),
        "null_ramp": make.null_ramp,
        "holds_both_sides": make.both_sides,
    }
    degrees = all(rig.tables("valve")[v]["spool"] != "switching" for v in chain.valves)
    if chain.regulator is not None:
        hold = ("multisine", "slow_triangle", "staircase", "long_hold", "nested_triangles")
        makers = {name: makers[name] for name in (*hold, "fast_triangle")}
        makers |= {"set_steps": make.set_steps, "fine_staircase": make.fine_staircase}
    elif not can_shut(rig, chain):
        makers = {name: m for name, m in makers.items() if name not in _SHUTTING}
        makers |= {"set_steps": make.set_steps}
    if not degrees or len(chain.valves) > 1:
        makers = {n: m for n, m in makers.items() if n not in ("null_ramp", "holds_both_sides")}
    if rig.tables("arm") or rig.tables("load"):
        makers |= {"other_payload": make.other_payload}
    if rig.tables("arm") and len(chain.moves) == 1 and can_shut(rig, chain):
        makers |= {"free_decay": make.free_decay}
    return makers


def _exceeds(experiment: Experiment, rig: Rig) -> bool:
    """Whether an experiment goes beyond the pressure that the rig file says the stand allows: what
    a command is found for is overshot where the valve is far open.
    """
    most = rig.limits.get("max_pressure")
    if most is None:
        return False
    found = experiment.simulate(rig)
    behind = [dotted("muscle_pressure", name) for name in rig.tables("chamber")]
    moved = {chain.pressure for chain in chains_of(rig)} or behind
    return any(bool(found[name].max() > most) for name in moved)
