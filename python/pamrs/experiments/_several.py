"""Experiments of rigs with several chains: one chain is moved while all others are held, or all are
moved at once, none as another one.

Commands that all chains share tell nothing of which chain it is. Multisines of the chains have no
frequency in common, and holds, stairs and steps come in an order that is another one for each, so
that muscles on two sides of a joint are moved against each other as well as together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.experiments._chains import (
    Chain,
    Range,
    Spans,
    can_shut,
    spans_of,
)
from pamrs.experiments._experiment import (
    FREQUENCY_RATIO,
    MULTISINE_FREQUENCIES,
    Experiment,
    Points,
    in_bar,
    listed,
    nested_triangles,
    other_payload,
    then,
    through,
    waves,
    within,
)
from pamrs.experiments._stand import Stand

__all__ = ["several_library"]

Array = NDArray[np.float64]


def several_library(
    stand: Stand, highest: Mapping[str, float]
) -> dict[str, Callable[[], Experiment | None]]:
    """What makes each experiment of a rig of several chains, by its name.

    Parameters
    ----------
    stand : Stand
        The rig with all of its chains.
    highest : mapping of str to float
        Gauge pressures by chain that are not to be exceeded [Pa].
    """
    make, rig, chains = _Several(stand, highest), stand.rig, stand.chains
    all_shut = all(can_shut(rig, chain) for chain in chains)
    makers: dict[str, Callable[[], Experiment | None]] = {"multisine": make.multisine}
    if all_shut:
        makers["sealed_hold"] = make.sealed
    for c in chains:
        makers[f"slow_triangle.{c.name}"] = partial(make.triangle, c)
    for c in chains:
        if can_shut(rig, c):
            makers[f"step_and_shut.{c.name}"] = partial(make.steps, c, shut=True)
        else:
            makers[f"set_steps.{c.name}"] = partial(make.steps, c, shut=False)
    makers |= {"staircase": make.staircase, "long_hold": make.long_hold}
    for c in chains:
        makers[f"nested_triangles.{c.name}"] = partial(make.nested, c)
    makers["fast_triangle"] = make.fast
    if rig.tables("arm") or rig.tables("load"):
        makers["other_payload"] = make.payload
    return makers


class _Several:
    """Builds the experiments of one rig of several chains."""

    def __init__(self, stand: Stand, highest: Mapping[str, float]) -> None:
        self.stand, self.driven = stand, stand.driven
        self.rig, self.chains, self.dt = stand.rig, stand.chains, stand.sample_time
        self.highest = highest
        self.what = "set pressure" if stand.regulated else "pressure"

    @cached_property
    def spans(self) -> Spans:
        """Between which pressures the chains move; found with the first experiment."""
        if self.stand.frame is not None:
            return self.stand.frame.spans
        return spans_of(self.rig, highest=self.highest)

    def alone(
        self,
        chain: Chain,
        name: str,
        points: Points,
        text: str,
        excitation: dict[str, Any],
        **options: Any,
    ) -> Experiment:
        """An experiment in which one chain goes through points and all others are held."""
        reference = through([(0.0, chain.before(self.rig)), *points[1:]], self.dt)
        time = np.arange(reference.size) * self.dt
        references = {
            c.name: np.interp(time, [0.0, 2.0], [c.before(self.rig), self.spans.held[c.name]])
            for c in self.chains
        } | {chain.name: reference}
        closed = options.pop("closed", None)
        if closed is not None:
            options["shut"] = {
                c.name: within(reference.size, self.dt, closed if c is chain else [])
                for c in self.chains
            }
        others = [c for c in self.chains if c is not chain]
        levels = [f"{in_bar(self.spans.held[c.name]):g} bar" for c in others]
        held = listed(levels if len(set(levels)) > 1 else levels[:1])
        text = f"{text}, and hold {listed([c.name for c in others])} at {held}"
        excitation = {
            "moved": chain.name,
            **excitation,
            "held_bar": {c.name: in_bar(self.spans.held[c.name]) for c in others},
        }
        return self.driven(f"{name}.{chain.name}", text, excitation, references, **options)

    def told(self, chain: Chain) -> str:
        """The pressure of a chain, in words."""
        return f"the {self.what} of {chain.name}"

    def reach(self, chain: Chain) -> Range:
        """Pressures of a chain while all others move as well: of its own range the share that
        leaves the others theirs.
        """
        own, held = self.spans.alone[chain.name], self.spans.held[chain.name]
        half = 0.5 * (own.high - own.low) / len(self.chains) ** 0.5
        middle = float(np.clip(held, own.low + half, own.high - half))
        return Range(middle - half, middle + half)

    def together(
        self,
        name: str,
        points: Mapping[str, Points],
        text: str,
        excitation: dict[str, Any],
        **options: Any,
    ) -> Experiment:
        """An experiment in which every chain goes through points of its own."""
        references = {
            c.name: through([(0.0, c.before(self.rig)), *points[c.name][1:]], self.dt)
            for c in self.chains
        }
        return self.driven(name, text, excitation, references, **options)

    def levels(self) -> tuple[str, dict[str, Any]]:
        """Between which pressures all chains move, in words and numbers."""
        spans = {c.name: self.reach(c) for c in self.chains}
        words = listed(
            [f"{n} between {in_bar(s.low):g} and {in_bar(s.high):g} bar" for n, s in spans.items()]
        )
        return words, {"levels_bar": {n: [in_bar(s.low), in_bar(s.high)] for n, s in spans.items()}}

    def multisine(self) -> Experiment:
        time = np.asarray(np.arange(round(30.0 / self.dt) + 1) * self.dt, dtype=np.float64)
        references, used = {}, {}
        for k, chain in enumerate(self.chains):
            frequencies = np.array(MULTISINE_FREQUENCIES) * FREQUENCY_RATIO ** (
                k / len(self.chains)
            )
            wave = waves(frequencies, time, 2.0 * k)
            span, begin = self.reach(chain), chain.before(self.rig)
            moved = span.at(0.5) + 0.5 * wave / np.abs(wave).max() * (span.high - span.low)
            faded = np.clip(time / 3.0, 0.0, 1.0)
            references[chain.name] = begin + faded * (moved - begin)
            used[chain.name] = [round(float(f), 3) for f in frequencies]
        words, numbers = self.levels()
        text = (
            f"drive every {self.what} as a multisine of its own, with no frequency in common, of "
            f"{MULTISINE_FREQUENCIES[0]:g} to {max(f[-1] for f in used.values()):.2g} Hz: {words}, "
            "for 30 s"
        )
        return self.driven("multisine", text, {"frequencies_hz": used, **numbers}, references)

    def sealed(self, hold: float = 16.0) -> Experiment:
        shares = _rests(len(self.chains))
        points, closed = self._ordered(shares, (1.0, 1.0), hold)
        size = round(points[self.chains[0].name][-1][0] / self.dt) + 1
        shut = within(size, self.dt, closed)
        words, numbers = self._in_order(shares)
        count = "three" if len(shares) == 3 else f"{len(shares)}"
        text = (
            f"fill all chambers to {count} pressures each, in another order for each ({words}), "
            f"shut all valves at each and hold for {hold:g} s"
        )
        every = {c.name: shut for c in self.chains}
        return self.together("sealed_hold", points, text, {**numbers, "hold_s": hold}, shut=every)

    def _ordered(
        self, shares: Sequence[float], way: tuple[float, float], hold: float
    ) -> tuple[dict[str, Points], list[tuple[float, float]]]:
        """Points that take every chain through the same shares of its range, each in another
        order, and the times at which all are held.
        """
        points: dict[str, Points] = {c.name: [(0.0, 0.0)] for c in self.chains}
        closed: list[tuple[float, float]] = []
        for step in range(len(shares)):
            for k, chain in enumerate(self.chains):
                goal = self.reach(chain).at(_turned(shares, k)[step])
                points[chain.name] = then(points[chain.name], (way[0], goal), (way[1], goal))
            begin = points[self.chains[0].name][-1][0]
            closed.append((begin, begin + hold))
            for own in points.values():
                own.append((begin + hold, own[-1][1]))
        return points, closed

    def _in_order(self, shares: Sequence[float]) -> tuple[str, dict[str, Any]]:
        """The pressures of each chain in their order, in words and numbers."""
        levels = {
            c.name: [in_bar(self.reach(c).at(s)) for s in _turned(shares, k)]
            for k, c in enumerate(self.chains)
        }
        words = "; ".join(f"{n}: {', '.join(f'{p:g}' for p in v)} bar" for n, v in levels.items())
        return words, {"levels_bar": levels}

    def triangle(self, chain: Chain) -> Experiment:
        span = self.spans.alone[chain.name]
        low, high = span.at(0.05), span.at(0.95)
        period = self.stand.period(15.0, high - low)
        points: Points = then([(0.0, 0.0)], (2.0, low))
        for _ in range(2):
            points = then(points, (0.5 * period, high), (0.5 * period, low))
        text = (
            f"drive {self.told(chain)} as a triangle between {in_bar(low):g} and "
            f"{in_bar(high):g} bar with a period of {period:g} s, 2 cycles, the first one kept"
        )
        numbers = {"levels_bar": [in_bar(low), in_bar(high)], "period_s": period, "cycles": 2}
        return self.alone(chain, "slow_triangle", points, text, numbers)

    def steps(self, chain: Chain, *, shut: bool) -> Experiment:
        span, watch = self.spans.alone[chain.name], 4.0
        base, small, large = span.at(0.05), span.at(0.3), span.at(0.8)
        points: Points = then([(0.0, 0.0)], (2.0, base), (0.5, base))
        closed = []
        for goal in (small, base, large, base):
            points = then(points, (0.02, goal), (0.35, goal))
            closed.append((points[-1][0], points[-1][0] + watch))
            points = then(points, (watch, goal))
        its = "its valves" if len(chain.valves) > 1 else "its valve"
        what = f", shut {its} 0.35 s after each step and watch for {watch:g} s"
        text = (
            f"step {self.told(chain)} from {in_bar(base):g} bar to {in_bar(small):g} bar and back, "
            f"then to {in_bar(large):g} bar and back (sizes 1:3)"
            + (what if shut else f", and keep each for {watch:g} s")
        )
        numbers = {"levels_bar": [in_bar(base), in_bar(small), in_bar(large)], "watch_s": watch}
        options: dict[str, Any] = {"closed": closed, "bandwidth": 30.0} if shut else {}
        return self.alone(
            chain, "step_and_shut" if shut else "set_steps", points, text, numbers, **options
        )

    def nested(self, chain: Chain) -> Experiment:
        span = self.spans.alone[chain.name]
        quick = self.stand.period(1.2, 0.9 * (span.high - span.low))
        points, text, numbers = nested_triangles(
            span.low, span.high, self.told(chain), periods=(12.0, quick)
        )
        return self.alone(chain, "nested_triangles", points, text, numbers)

    def staircase(self) -> Experiment:
        shares = _stairs(len(self.chains))
        points, _ = self._ordered(shares, (0.5, 0.5), 4.0)
        words, numbers = self._in_order(shares)
        text = (
            f"climb stairs with every {self.what}, each from another step on, and hold each step "
            f"for 4.5 s ({words})"
        )
        return self.together("staircase", points, text, {**numbers, "hold_s": 4.5})

    def long_hold(self) -> Experiment:
        count = len(self.chains)
        shares = (0.95, 0.4) if count == 2 else (0.95, 0.4, 0.7) if count <= 6 else _rests(count)
        points, _ = self._ordered(shares, (0.3, 0.7), 24.0)
        words, numbers = self._in_order(shares)
        text = f"step every {self.what} and keep it for 25 s after each step ({words})"
        return self.together("long_hold", points, text, {**numbers, "hold_s": 25.0})

    def _against(self, period: float, cycles: int) -> dict[str, Points]:
        """Triangles of all chains, one after the other by a share of the period."""
        found: dict[str, Points] = {}
        for k, chain in enumerate(self.chains):
            span, late = self.reach(chain), k / len(self.chains)
            steps = np.arange(20 * cycles + 1) / 20.0
            wave = 1.0 - np.abs(2.0 * ((steps + late) % 1.0) - 1.0)  # from 0 up to 1 and down
            own = [(2.0, span.at(wave[0])), *((period / 20.0, span.at(w)) for w in wave[1:])]
            found[chain.name] = then([(0.0, 0.0)], *own)
        return found

    def fast(self) -> Experiment:
        words, numbers = self.levels()
        rise = max(span.high - span.low for span in map(self.reach, self.chains))
        period = self.stand.period(1.5, rise)
        text = (
            f"drive every {self.what} as a triangle with a period of {period:g} s, one after the "
            f"other by 1/{len(self.chains)} of it: {words}, 10 cycles"
        )
        also = {**numbers, "period_s": period, "cycles": 10}
        return self.together("fast_triangle", self._against(period, 10), text, also)

    def payload(self) -> Experiment | None:
        found = other_payload(self.rig)
        if found is None:
            return None
        name, other, needs = found
        words, numbers = self.levels()
        text = (
            f"change the payload to {other:.3g} kg and drive every {self.what} as a triangle "
            f"with a period of 12 s, one after the other by 1/{len(self.chains)} of it: {words}, "
            "2 cycles"
        )
        also = {"payload_kg": round(other, 3), **numbers, "period_s": 12.0, "cycles": 2}
        points = self._against(12.0, 2)
        return self.together(
            "other_payload", points, text, also, changes={name: other}, extra=90.0, needs=needs
        )


def _rests(count: int) -> tuple[float, ...]:
    """Shares of their ranges at which some chains rest: as many as give each an order of its own,
    two for each share (:func:`_turned`).
    """
    if count <= 6:
        return (0.05, 0.5, 0.95)
    return tuple(np.linspace(0.05, 0.95, (count + 1) // 2).tolist())


def _stairs(count: int) -> tuple[float, ...]:
    """Shares up and down again; mirrored stairs are the same begun half way, so that each step
    gives one order.
    """
    if count <= 6:
        return (0.05, 0.35, 0.65, 0.95, 0.65, 0.35)
    up = np.linspace(0.05, 0.95, (count + 1) // 2 + 1).tolist()
    return (*up, *up[-2:0:-1])


def _turned(shares: Sequence[float], k: int) -> Sequence[float]:
    """Shares in the order of the k-th chain: begun at another one, those of every second chain
    mirrored.
    """
    at = (k // 2) % len(shares)
    turned = [*shares[at:], *shares[:at]]
    return [1.0 - share for share in turned] if k % 2 else turned
