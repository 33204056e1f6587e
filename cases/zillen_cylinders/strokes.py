"""Strokes of a friction recording: where the motion turns, friction from pairs of strokes, and the
onset of motion.

With the gas force ``A p`` and a force zero ``z`` the pull is ``z + A p + F`` while the piston moves
against the gas and ``z + A p - F`` while it gives way. Half the difference of the two directions at
the same position is friction, ``F = half_force - A half_pressure``; half the sum is ``z + A p``. A
difference between the frictions of the two directions is not separable from ``A`` and ``z``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cases.zillen_cylinders.record import FrictionRecord
from pamrs.errors import ParameterError, RecordingError

__all__ = [
    "Onset",
    "Stroke",
    "StrokePairs",
    "find_strokes",
    "onset_at_rest",
    "pair_strokes",
    "reversal_onsets",
]

Array = NDArray[np.float64]

_TURN: Final = 0.2  # of the travel: a smaller move back is not a new stroke
_GRID: Final = 80
_FEWEST: Final = 3  # pairs
_ONSET: Final = 0.1  # of the travel: where the onset of a stroke after a reversal is looked for
_BREAKAWAY: Final = 0.03  # of the travel: where the breakaway from rest is looked for
_HOLE: Final = 0.03  # of the travel: farther from a sample nothing is interpolated
_VISIBLE: Final = 1.2  # a peak counts from this many times the stroke's own ripple
_MOVING: Final = 0.5  # of the sliding speed: a record that begins faster does not begin at rest


@dataclass(frozen=True, slots=True)
class Stroke:
    """One stroke: used rows ``start`` to ``stop`` (excluded), ``direction`` +1 while the position
    grows.
    """

    direction: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Onset:
    """How a motion began.

    Attributes
    ----------
    peak : float
        Largest friction [N].
    ratio : float
        The same over the sliding friction of the same pair of strokes.
    ripple : float
        That ratio of equally long stretches in the middle of the stroke: what a mere ripple gives.
    row : int
        Used row of the largest friction.
    travel : float
        Distance moved by then [m].
    status : str
        ``seen`` (no gap of the logger); ``at least`` (a gap, but a peak was sampled: the true one
        may be higher); ``missed`` (a gap, and no peak was sampled); ``in motion`` (the record does
        not begin at rest).
    """

    peak: float
    ratio: float
    ripple: float
    row: int
    travel: float
    status: str


@dataclass(frozen=True, eq=False)
class StrokePairs:
    """Pairs of neighbouring strokes, one to and one fro.

    Attributes
    ----------
    record : FrictionRecord
        What they come from.
    strokes : list of Stroke
        All strokes.
    window : (float, float)
        Positions between which steady sliding is taken [m].
    half_force, half_pressure : (n,) array
        Half of (against the gas minus giving way): force [N], pressure [Pa], averaged over the
        window.
    mid_force, mid_pressure : (n,) array
        Half of the sums.
    speed_against, speed_giving : (n,) array
        Mean speeds in the window [m/s], both positive.
    members : list of (int, int)
        The strokes of each pair.
    sign : int
        +1 if the position grows against the gas, else -1.
    issues : list of str
        Strokes left out, with the reason.
    """

    record: FrictionRecord
    strokes: list[Stroke]
    window: tuple[float, float]
    half_force: Array
    half_pressure: Array
    mid_force: Array
    mid_pressure: Array
    speed_against: Array
    speed_giving: Array
    members: list[tuple[int, int]]
    sign: int
    issues: list[str]

    def __len__(self) -> int:
        return len(self.half_force)

    @property
    def pressure(self) -> float:
        """Mean gauge pressure of the pairs [Pa]."""
        return float(np.mean(self.mid_pressure))

    def friction(self, area: float) -> Array:
        """Friction of each pair [N], (n,), for a piston area [m2]."""
        return self.half_force - area * self.half_pressure


def find_strokes(record: FrictionRecord) -> list[Stroke]:
    """Split a record where the motion turns by more than a fifth of the travel.

    Parameters
    ----------
    record : FrictionRecord
        One run.

    Returns
    -------
    list of Stroke
        In order; the first and last may be cut short.

    Raises
    ------
    RecordingError
        If the piston never turns, or does not move at all.
    """
    position = record.rows()[1]
    travel = float(np.ptp(position))
    if travel <= 0.0:
        raise RecordingError(f"{record.name}: the position does not change: no stroke, no friction")
    threshold = _TURN * travel
    turns, way, extreme, at = [0], 0, float(position[0]), 0
    for row, here in enumerate(position.tolist()):
        if way == 0:
            if abs(here - extreme) > threshold:
                way, extreme, at = (1 if here > extreme else -1), here, row
        elif way * (here - extreme) > 0.0:
            extreme, at = here, row
        elif way * (extreme - here) > threshold:
            turns.append(at)
            way, extreme, at = -way, here, row
    turns.append(at)
    if len(turns) < 3:
        raise RecordingError(
            f"{record.name}: the motion never reverses; friction needs both directions of motion"
        )
    return [
        Stroke(1 if position[stop] > position[start] else -1, start, stop)
        for start, stop in pairwise(turns)
    ]


def pair_strokes(record: FrictionRecord, *, margin: float = 0.25) -> StrokePairs:
    """Friction from pairs of strokes, at the same positions in both directions.

    Parameters
    ----------
    record : FrictionRecord
        One run with at least three strokes to and fro.
    margin : float
        Share of the common travel left out at each end, where the motion starts and stops; 0 to
        0.45.

    Returns
    -------
    StrokePairs

    Raises
    ------
    ParameterError
        If ``margin`` is out of range.
    RecordingError
        If the motion never reverses or fewer than three pairs are complete.
    """
    if not 0.0 <= margin <= 0.45:
        raise ParameterError(f"margin = {margin!r} is not allowed: 0 to 0.45")
    strokes = find_strokes(record)
    time, position, pressure, force = record.rows()
    ends = np.array([sorted((position[s.start], position[s.stop])) for s in strokes])
    spans = ends[:, 1] - ends[:, 0]
    full = spans > 0.8 * float(np.median(spans))
    low, high = float(np.max(ends[full, 0])), float(np.min(ends[full, 1]))
    window = (low + margin * (high - low), high - margin * (high - low))
    grid = np.linspace(*window, _GRID)
    issues = [
        f"{record.name}: stroke {k + 1} is cut short: left out" for k in np.flatnonzero(~full)
    ]
    rows: list[tuple[float, ...]] = []
    members: list[tuple[int, int]] = []
    k = 0
    while k + 1 < len(strokes):
        if not (full[k] and full[k + 1]):
            k += 1
            continue
        laid = [
            _onto(grid, stroke, position, force, pressure, _HOLE * (high - low))
            for stroke in strokes[k : k + 2]
        ]
        both = laid[0][2] & laid[1][2]
        if both.mean() < 0.5:
            issues.append(
                f"{record.name}: strokes {k + 1} and {k + 2} share less than half of the window "
                "with samples: left out"
            )
        else:
            against = 0 if strokes[k].direction > 0 else 1
            (f1, p1, _), (f0, p0, _) = laid[against], laid[1 - against]
            speeds = [_speed(stroke, time, position, window) for stroke in strokes[k : k + 2]]
            means = [float(np.mean(part[both])) for part in (f1 - f0, p1 - p0, f1 + f0, p1 + p0)]
            rows.append((*(0.5 * value for value in means), speeds[against], speeds[1 - against]))
            members.append((k, k + 1))
        k += 2
    if len(rows) < _FEWEST:
        raise RecordingError(
            f"{record.name}: {len(rows)} complete pairs of strokes; {_FEWEST} at least are needed "
            "for a standard error"
        )
    table = np.array(rows)
    sign = 1 if np.median(table[:, 0]) >= 0.0 else -1
    table[:, :2] *= sign
    against_column, giving_column = (4, 5) if sign > 0 else (5, 4)
    return StrokePairs(
        record=record,
        strokes=strokes,
        window=window,
        half_force=table[:, 0],
        half_pressure=table[:, 1],
        mid_force=table[:, 2],
        mid_pressure=table[:, 3],
        speed_against=table[:, against_column],
        speed_giving=table[:, giving_column],
        members=members,
        sign=sign,
        issues=issues,
    )


def onset_at_rest(pairs: StrokePairs, area: float) -> Onset | None:
    """How the first motion of a record began, from rest.

    Parameters
    ----------
    pairs : StrokePairs
        Of the record.
    area : float
        Piston area [m2].

    Returns
    -------
    Onset or None
        None if the first pair of strokes is not complete.
    """
    first = next((m for m in pairs.members if m[0] == 0), None)
    if first is None:
        return None
    stroke = pairs.strokes[0]
    time, position, _, _ = pairs.record.rows()
    middle = _middle(pairs, *first, area)
    ratio, row, ripple = _peak(pairs, stroke, middle, area, onset=_BREAKAWAY)
    peak, moved = ratio * middle[1], abs(float(position[row] - position[stroke.start]))
    travel = float(np.ptp(position))
    away = np.abs(position[stroke.start : stroke.stop] - position[stroke.start])
    begin = stroke.start + int(np.argmax(away > _BREAKAWAY * travel))
    steps = np.diff(time[stroke.start : begin + 1])
    usual = float(np.median(np.diff(time)))
    head = slice(stroke.start, stroke.start + 4)
    if np.all(np.diff(time[head]) < 2.0 * usual):
        early = float(np.ptp(position[head][[0, -1]]) / np.ptp(time[head][[0, -1]]))
        if early > _MOVING * _speed(stroke, time, position, pairs.window):
            return Onset(peak, ratio, ripple, row, moved, "in motion")
    cut = bool(np.max(steps, initial=0.0) > 5.0 * usual)
    status = "seen" if not cut else ("at least" if ratio > _VISIBLE * ripple else "missed")
    return Onset(peak, ratio, ripple, row, moved, status)


def reversal_onsets(pairs: StrokePairs, area: float) -> list[Onset]:
    """How the motion began after each reversal, where the piston hardly rests.

    Parameters
    ----------
    pairs : StrokePairs
        Of one record.
    area : float
        Piston area [m2].

    Returns
    -------
    list of Onset
        One for each stroke of a pair but the record's first.
    """
    found = []
    _, position, _, _ = pairs.record.rows()
    for members in pairs.members:
        middle = _middle(pairs, *members, area)
        for index in members:
            stroke = pairs.strokes[index]
            if index > 0:
                ratio, row, ripple = _peak(pairs, stroke, middle, area, onset=_ONSET)
                moved = abs(float(position[row] - position[stroke.start]))
                found.append(Onset(ratio * middle[1], ratio, ripple, row, moved, "seen"))
    return found


def _onto(
    grid: Array, stroke: Stroke, position: Array, force: Array, pressure: Array, hole: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Force and pressure of a stroke at given positions, and where samples are near enough."""
    rows = slice(stroke.start, stroke.stop + 1)
    order = np.argsort(position[rows], kind="stable")
    x = position[rows][order]
    right = np.clip(np.searchsorted(x, grid), 1, len(x) - 1)
    near = (x[right] - x[right - 1]) <= hole
    return np.interp(grid, x, force[rows][order]), np.interp(grid, x, pressure[rows][order]), near


def _speed(stroke: Stroke, time: Array, position: Array, window: tuple[float, float]) -> float:
    rows = slice(stroke.start, stroke.stop + 1)
    inside = (position[rows] >= window[0]) & (position[rows] <= window[1])
    where = np.flatnonzero(inside)
    t, x = time[rows][where[[0, -1]]], position[rows][where[[0, -1]]]
    return abs(float((x[1] - x[0]) / (t[1] - t[0])))


def _middle(pairs: StrokePairs, first: int, second: int, area: float) -> tuple[Array, float]:
    """Half-sum of ``force - area pressure`` of two strokes as a straight line over the position,
    and half their difference.
    """
    _, position, pressure, force = pairs.record.rows()
    grid = np.linspace(*pairs.window, _GRID)
    net, strokes = force - area * pressure, (pairs.strokes[first], pairs.strokes[second])
    a, b = (_onto(grid, stroke, position, net, pressure, np.inf)[0] for stroke in strokes)
    return np.polyfit(grid, 0.5 * (a + b), 1), 0.5 * abs(float(np.mean(a - b)))


def _peak(
    pairs: StrokePairs, stroke: Stroke, middle: tuple[Array, float], area: float, *, onset: float
) -> tuple[float, int, float]:
    """Largest friction at a stroke's onset over its sliding friction, its row, and the same of
    stretches in the middle.
    """
    _, position, pressure, force = pairs.record.rows()
    rows = np.arange(stroke.start, stroke.stop + 1)
    line, friction = middle
    x = position[rows]
    pull = force[rows] - area * pressure[rows] - np.polyval(line, x)
    excess = pairs.sign * stroke.direction * pull / friction
    moved = np.abs(x - x[0])
    width = onset * float(np.ptp(position))
    early = np.flatnonzero(moved <= width)
    top = int(early[np.argmax(excess[early])])
    inside = (x >= pairs.window[0]) & (x <= pairs.window[1])
    bins = ((moved[inside] - moved[inside].min()) / width).astype(int)
    ripple = float(np.mean([np.max(excess[inside][bins == b]) for b in np.unique(bins)]))
    return float(excess[top]), int(rows[top]), ripple
