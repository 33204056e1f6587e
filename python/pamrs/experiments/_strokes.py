"""Experiments of a load frame: the length is moved while the pressures are held, held while they
are moved (as of any rig), and both at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.experiments._chains import Range, can_shut
from pamrs.experiments._experiment import (
    FREQUENCY_RATIO,
    MM,
    MULTISINE_FREQUENCIES,
    Experiment,
    Points,
    in_bar,
    in_mm,
    listed,
    nested_triangles,
    then,
    through,
    waves,
    within,
)
from pamrs.experiments._frame import Frame
from pamrs.experiments._stand import Stand

__all__ = ["stroke_library"]

_FILLING_TIME = 3.0  # [s] before a load frame moves: 1 s to fill a muscle, the rest to settle


Array = NDArray[np.float64]


def stroke_library(stand: Stand) -> dict[str, Callable[[], Experiment | None]]:
    """What makes each experiment in which a load frame moves the length, by its name.

    Parameters
    ----------
    stand : Stand
        A rig with a frame.
    """
    if stand.frame is None:
        return {}
    make = _Strokes(stand, stand.frame)
    makers: dict[str, Callable[[], Experiment | None]] = {
        "slow_strokes": make.slow,
        "length_steps": make.steps,
        "strokes_at_speeds": make.speeds,
        "nested_strokes": make.nested,
        "strokes_at_pressures": make.at_pressures,
        "pressures_at_lengths": make.at_lengths,
        "length_and_pressure": make.both,
    }
    if all(can_shut(stand.rig, chain) for chain in stand.chains):
        makers["sealed_strokes"] = make.sealed
    return makers


class _Strokes:
    """Builds them for one rig."""

    def __init__(self, stand: Stand, frame: Frame) -> None:
        self.stand, self.frame = stand, frame
        self.fill = _FILLING_TIME
        self.dt = stand.sample_time

    def quickest(self, stroke: Range) -> float:
        """Period of the quickest triangle over a stroke [s]."""
        return max(2.0, _up(2.0 * (stroke.high - stroke.low) / self.frame.rate))

    def held(self, share: float, rows: int) -> dict[str, Array]:
        """All pressures led to a share of their ranges and held, for so many samples."""
        return self.through_shares([(0.0, 0.0), (1.0, share), (rows * self.dt, share)], rows)

    def through_shares(self, shares: Points, rows: int) -> dict[str, Array]:
        """All pressures through (time, share of their range) points; the first is where each
        begins by itself.
        """
        time = np.arange(rows) * self.dt
        found = {}
        for chain in self.stand.chains:
            span = self.frame.spans.alone[chain.name]
            first = span.at(shares[1][1]) if self.stand.given else chain.before(self.stand.rig)
            values = [first, *(span.at(share) for _, share in shares[1:])]
            found[chain.name] = np.interp(time, [t for t, _ in shares], values)
        return found

    def told(self, *shares: float) -> str:
        """Pressures at shares of the ranges, in words: ``2.1 bar``, ``a at 2 and b at 3 bar``."""
        spans = self.frame.spans.alone
        levels = {n: [f"{in_bar(span.at(s)):g}" for s in shares] for n, span in spans.items()}
        said = {n: listed(words) for n, words in levels.items()}
        if len(set(said.values())) == 1:
            return f"{next(iter(said.values()))} bar"
        return f"{listed([f'{n} at {words}' for n, words in said.items()])} bar"

    def numbers(self, stroke: Range, *shares: float) -> dict[str, Any]:
        """Lengths and pressures for a program."""
        spans = self.frame.spans.alone
        levels: Any = {n: [in_bar(span.at(s)) for s in shares] for n, span in spans.items()}
        if len(levels) == 1:
            (levels,) = levels.values()
        return {"lengths_mm": [in_mm(stroke.high), in_mm(stroke.low)], "held_bar": levels}

    def moved(
        self,
        name: str,
        text: str,
        excitation: dict[str, Any],
        lengths: Points,
        share: float,
        **options: Any,
    ) -> Experiment:
        """The length through points while all pressures are held at a share."""
        length = through(lengths, self.dt)
        references = self.held(share, length.size)
        return self.stand.driven(name, text, excitation, references, length=length, **options)

    def filled(self, stroke: Range) -> Points:
        """Where every stroke begins: the muscle is filled at the longest length."""
        return [(0.0, stroke.high), (self.fill, stroke.high)]

    def triangles(self, points: Points, stroke: Range, period: float, cycles: int) -> Points:
        """Points continued by triangles from the longest length to the shortest and back."""
        for _ in range(cycles):
            points = then(points, (0.5 * period, stroke.low), (0.5 * period, stroke.high))
        return points

    def slow(self, share: float = 0.5) -> Experiment | None:
        stroke = self.frame.stroke(share)
        if stroke is None:
            return None
        period = max(15.0, 2.0 * self.quickest(stroke))
        points = self.triangles(self.filled(stroke), stroke, period, 2)
        text = (
            f"hold {self.told(share)} and move the length as a triangle between "
            f"{in_mm(stroke.high):g} and {in_mm(stroke.low):g} mm with a period of {period:g} s, "
            "2 cycles, the first one kept"
        )
        numbers = {**self.numbers(stroke, share), "period_s": period, "cycles": 2}
        return self.moved("slow_strokes", text, numbers, points, share)

    def speeds(self, share: float = 0.5) -> Experiment | None:
        stroke = self.frame.stroke(share)
        if stroke is None:
            return None
        quick = self.quickest(stroke)
        periods, cycles = [9.0 * quick, 3.0 * quick, quick], [1, 1, 3]
        points = self.filled(stroke)
        for period, count in zip(periods, cycles, strict=True):
            points = self.triangles(points, stroke, period, count)
        speeds = [2.0 * (stroke.high - stroke.low) / period for period in periods]
        text = (
            f"hold {self.told(share)} and move the length as a triangle between "
            f"{in_mm(stroke.high):g} and {in_mm(stroke.low):g} mm at "
            f"{listed([f'{1e3 * speed:.3g}' for speed in speeds])} mm/s (1:3:9), 1, 1 and 3 cycles"
        )
        numbers = {
            **self.numbers(stroke, share),
            "periods_s": [round(p, 2) for p in periods],
            "cycles": cycles,
        }
        return self.moved("strokes_at_speeds", text, numbers, points, share)

    def nested(self, share: float = 0.5) -> Experiment | None:
        stroke = self.frame.stroke(share)
        if stroke is None:
            return None
        # of the widest loop, which goes over nine tenths of the stroke
        quick = max(1.2, _up(0.9 * self.quickest(stroke)))
        points, text, numbers = nested_triangles(
            stroke.low, stroke.high, "the length", MM, (max(12.0, 4.0 * quick), quick)
        )
        begun = [*self.filled(stroke), *((t + self.fill, value) for t, value in points[1:])]
        text = f"hold {self.told(share)} and {text}"
        numbers |= {"held_bar": self.numbers(stroke, share)["held_bar"]}
        return self.moved("nested_strokes", text, numbers, begun, share)

    def steps(self, share: float = 0.5, hold: float = 25.0) -> Experiment | None:
        stroke = self.frame.stroke(share)
        if stroke is None:
            return None
        way, middle = 0.5 * self.quickest(stroke), stroke.at(0.5)
        points = then(
            self.filled(stroke),
            (way, stroke.low),
            (hold, stroke.low),
            (0.5 * way, middle),
            (hold, middle),
        )
        text = (
            f"hold {self.told(share)}, move the length from {in_mm(stroke.high):g} to "
            f"{in_mm(stroke.low):g} mm, then back to {in_mm(middle):g} mm, and keep it there for "
            f"{hold:g} s after each"
        )
        numbers = {**self.numbers(stroke, share), "hold_s": hold}
        return self.moved("length_steps", text, numbers, points, share)

    def at_pressures(self) -> Experiment | None:
        shares = (0.3, 0.6, 0.95)
        stroke = self.frame.stroke(shares[0])
        if stroke is None:
            return None
        period = max(10.0, round(1.5 * self.quickest(stroke), 1))
        lengths: Points = [(0.0, stroke.high)]
        levels: Points = [(0.0, 0.0)]
        for share in shares:
            levels = then(levels, (1.0, share), (self.fill - 1.0 + 2.0 * period, share))
            lengths = self.triangles(then(lengths, (self.fill, stroke.high)), stroke, period, 2)
        text = (
            f"hold {self.told(*shares)} one after the other, and at each move the length as a "
            f"triangle between {in_mm(stroke.high):g} and {in_mm(stroke.low):g} mm with a period "
            f"of {period:g} s, 2 cycles"
        )
        numbers = {**self.numbers(stroke, *shares), "period_s": period, "cycles": 2}
        length = through(lengths, self.dt)
        references = self.through_shares(levels, length.size)
        return self.stand.driven("strokes_at_pressures", text, numbers, references, length=length)

    def at_lengths(self) -> Experiment | None:
        low, high = 0.3, 0.95
        stroke = self.frame.stroke(low)
        if stroke is None:
            return None
        rise = max(s.at(high) - s.at(low) for s in self.frame.spans.alone.values())
        period = self.stand.period(6.0, rise)
        goals, way = [stroke.at(s) for s in (0.95, 0.5, 0.05)], self.quickest(stroke)
        lengths: Points = [(0.0, goals[0])]
        levels: Points = [(0.0, 0.0)]
        for goal in goals:
            lengths = then(lengths, (way, goal), (1.0 + 2.0 * period, goal))
            levels = then(levels, (way, low), (1.0, low))
            for _ in range(2):
                levels = then(levels, (0.5 * period, high), (0.5 * period, low))
        text = (
            f"hold the length at {listed([f'{in_mm(goal):g}' for goal in goals])} mm one after "
            f"the other, and at each drive the pressure as a triangle between "
            f"{self.told(low, high)} with a period of {period:g} s, 2 cycles"
        )
        numbers = {
            "lengths_mm": [in_mm(goal) for goal in goals],
            "levels_bar": self.numbers(stroke, low, high)["held_bar"],
            "period_s": period,
            "cycles": 2,
        }
        length = through(lengths, self.dt)
        references = self.through_shares(levels, length.size)
        return self.stand.driven("pressures_at_lengths", text, numbers, references, length=length)

    def both(self, seconds: float = 45.0) -> Experiment | None:
        low, high = 0.3, 0.9
        stroke = self.frame.stroke(low)
        if stroke is None:
            return None
        rows = round((seconds + self.fill) / self.dt) + 1
        time = np.asarray(np.arange(rows) * self.dt, dtype=np.float64)
        faded = np.clip(time / self.fill, 0.0, 1.0)
        usual = np.array(MULTISINE_FREQUENCIES)
        count = len(self.stand.chains) + 1
        each = [usual * FREQUENCY_RATIO ** (k / count) for k in range(count)]
        # a machine is slower than a valve: the length has the lower half, down to half of it
        middle, reach = stroke.at(0.5), 0.45 * (stroke.high - stroke.low)
        each[0] = each[0][: max(1, each[0].size // 2)]
        speed = reach * self._fastest(each[0], time)
        each[0] = each[0] * min(1.0, max(0.5, 0.9 * self.frame.rate / speed))
        wave = _unit(waves(each[0], time, 0.0))
        reach = min(reach, 0.9 * self.frame.rate / self._fastest(each[0], time))
        length = middle + reach * faded * wave
        references = {}
        for k, chain in enumerate(self.stand.chains, 1):
            span = self.frame.spans.alone[chain.name]
            wave = _unit(waves(each[k], time, 2.0 * k))
            moved = 0.5 * (low + high) + 0.5 * (high - low) * wave
            begin = span.at(moved[0]) if self.stand.given else chain.before(self.stand.rig)
            references[chain.name] = (
                begin + faded * (span.low - begin) + faded * moved * (span.high - span.low)
            )
        text = (
            "drive length and pressure as multisines with no frequency in common, of "
            f"{each[0][0]:.2g} to {each[-1][-1]:.2g} Hz: the length between "
            f"{in_mm(middle + reach):g} and {in_mm(middle - reach):g} mm, the pressure between "
            f"{self.told(low, high)}, for {seconds:g} s"
        )
        numbers = {
            "lengths_mm": [in_mm(middle + reach), in_mm(middle - reach)],
            "levels_bar": self.numbers(stroke, low, high)["held_bar"],
            "frequencies_hz": [[round(float(f), 3) for f in own] for own in each],
        }
        return self.stand.driven("length_and_pressure", text, numbers, references, length=length)

    def _fastest(self, frequencies: Array, time: Array) -> float:
        """Fastest change of a wave between -1 and 1 [1/s]."""
        wave = _unit(waves(frequencies, time, 0.0))
        return float(np.abs(np.diff(wave)).max()) / self.dt

    def sealed(self, share: float = 0.7) -> Experiment | None:
        stroke = self.frame.stroke(share)
        if stroke is None:
            return None
        period = max(12.0, round(1.5 * self.quickest(stroke), 1))
        points = self.triangles(self.filled(stroke), stroke, period, 2)
        points = then(points, (10.0, stroke.high))
        rows = round(points[-1][0] / self.dt) + 1
        closed = within(rows, self.dt, [(2.0, points[-1][0] + 1.0)])
        valves = sum(len(chain.valves) for chain in self.stand.chains)
        text = (
            f"fill to {self.told(share)}, shut {'all valves' if valves > 1 else 'the valve'}, move "
            f"the length as a triangle between {in_mm(stroke.high):g} and {in_mm(stroke.low):g} mm "
            f"with a period of {period:g} s, 2 cycles, and hold it for 10 s"
        )
        numbers = {**self.numbers(stroke, share), "period_s": period, "cycles": 2, "hold_s": 10.0}
        shut = {chain.name: closed for chain in self.stand.chains}
        return self.moved("sealed_strokes", text, numbers, points, share, shut=shut)


def _up(seconds: float) -> float:
    """The next longer time that is said with one digit behind the point [s]."""
    return math.ceil(10.0 * seconds) / 10.0


def _unit(wave: Array) -> Array:
    """A wave between -1 and 1."""
    return np.asarray(wave / np.abs(wave).max())
