"""Puts jittered, gapped or jumping time stamps on one uniform grid, never across a hole."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs._files import MOST_ROWS
from pamrs.errors import RecordingError

Place = int | np.signedinteger

GAP: Final = 1.6  # intervals longer than this many samples are holes
_JUMP_HOLE: Final = 10  # samples left empty where the clock jumped: the true pause is unknown
_ON_SAMPLE: Final = 0.05  # samples: nearer than this, a recorded value stands as it is
_MOST_EVENTS: Final = 20
_LATE: Final = 2  # samples: a hole of so many is the timer's jitter where there are several
_FARTHEST: Final = 1e12  # samples that a hole is said to have, at most
_FEW_LATE: Final = 2  # such holes that are told one by one


class Event(NamedTuple):
    """Irregularity of a clock, from ``start`` to ``stop`` in seconds of the grid."""

    kind: str
    start: float
    stop: float
    text: str


def check_samples(length: float, step: float, source: str) -> None:
    """Refuse a grid that no memory holds.

    Parameters
    ----------
    length, step : float
        Its length and the distance of its samples [s].
    source : str
        The recording, for messages.

    Raises
    ------
    RecordingError
        If it has more samples than a recording may have.
    """
    if not length / step <= MOST_ROWS:
        raise RecordingError(
            f"{source}: {length:.4g} s have about {length / step:.3g} samples of {step:.4g} s, and "
            f"at most {MOST_ROWS} are read: give another sample_time, or cut it into parts (long "
            "pauses part recordings with split = { gap = ... })"
        )


class Grid:
    """A uniform grid over the rows of a recording.

    Attributes
    ----------
    time : (n,) array
        Seconds from 0.
    sample_time : float
        Seconds.
    usual : float
        Usual interval of the stamps [s].
    events : list of Event
        Gaps, jumps, repeats.
    rows : array of int
        The rows that are used, in order (repeated time stamps are left out).
    """

    def __init__(
        self,
        stamps: Array,
        rows: Index,
        step: float,
        usual: float,
        events: list[Event],
        time: Array | None = None,
    ) -> None:
        self.rows = rows
        self.sample_time, self.usual = step, usual
        self.events = events
        self._stamps = stamps
        if time is None:
            count = int(np.floor(stamps[-1] / step + _ON_SAMPLE)) + 1
            time = np.arange(count, dtype=np.float64) * step
        self.time: Array = time
        self._place_samples()

    def _place_samples(self) -> None:
        """Find the stamps around each grid sample, and the samples that lie in no gap."""
        stamps, step, usual = self._stamps, self.sample_time, self.usual
        right = np.clip(np.searchsorted(stamps, self.time, side="left"), 1, len(stamps) - 1)
        self._left, self._right = right - 1, right
        span = stamps[self._right] - stamps[self._left]
        share = (self.time - stamps[self._left]) / span
        near = _ON_SAMPLE * min(step, usual)
        share = np.where(np.abs(self.time - stamps[self._left]) <= near, 0.0, share)
        self._share = np.where(np.abs(stamps[self._right] - self.time) <= near, 1.0, share)
        single = (self._share == 0.0) | (self._share == 1.0)
        self._reachable = single | (
            (span <= GAP * usual) & (self._share > 0.0) & (self._share < 1.0)
        )

    @property
    def interpolates(self) -> bool:
        """True where the grid is more than `GAP` times as fine as the recorded samples."""
        return math.isfinite(self.usual) and self.usual > GAP * self.sample_time

    def lay(self, values: Array, usable: Mask) -> tuple[Array, Mask]:
        """Values of the used rows on the grid; NaN where the mask is False.

        Parameters
        ----------
        values : (r,) array
            One value for each used row.
        usable : (r,) bool array
            Which of them may be used.

        Returns
        -------
        (values, mask) : (n,) arrays
        """
        left, right, share = self._left, self._right, self._share
        mask = self._reachable & (usable[left] | (share == 1.0)) & (usable[right] | (share == 0.0))
        safe = np.where(usable, values, 0.0)
        laid = np.where(share == 1.0, safe[right], safe[left] + share * (safe[right] - safe[left]))
        laid = np.where(share == 0.0, safe[left], laid)
        laid[~mask] = np.nan
        return laid, mask

    def when(self, start: int, stop: int) -> tuple[float, float]:
        """Time of the used rows ``start`` to ``stop`` (exclusive) on the grid, in seconds."""
        return float(self._stamps[start]), float(self._stamps[stop - 1])


def lay_grid(stamps: Array, source: str, sample_time: float | None) -> Grid:
    """Lay a uniform grid under time stamps.

    Parameters
    ----------
    stamps : (n,) array
        Seconds, finite, in the order of the rows; they may repeat and jump.
    source : str
        The file, for messages.
    sample_time : float, optional
        Spacing of the grid; without it the usual interval of the stamps.

    Returns
    -------
    Grid
        The grid, with what the clock did.

    Raises
    ------
    RecordingError
        If there are fewer than two different time stamps, or most of them run backwards.
    """
    intervals = np.diff(stamps)
    forward = intervals[intervals > 0.0]
    back = int(np.sum(intervals < 0.0))
    if back > max(1, len(forward)):
        raise RecordingError(
            f"{source}: column 'time' runs backwards: {back} of its {len(intervals)} steps are "
            f"negative, from {stamps[0]:.6g} s to {stamps[-1]:.6g} s; time that rises from row to "
            "row is needed (sort the rows, or correct the column)"
        )
    if not len(forward):
        raise RecordingError(
            f"{source}: column 'time': two rows at least, at different times, are needed"
        )
    usual = usual_interval(forward, len(stamps))
    step = sample_time if sample_time is not None else usual

    events: list[Event] = []
    repeats = np.flatnonzero(intervals == 0.0)
    rows = np.flatnonzero(np.concatenate([[True], intervals != 0.0]))
    kept = stamps[rows]
    intervals = np.diff(kept)
    recorded = float(np.sum(intervals[(intervals > 0.0) & (intervals < GAP * usual)]))
    jumps = (intervals < 0.0) | (intervals > max(recorded, 1000.0 * usual))
    elapsed = np.where(jumps, (_JUMP_HOLE + 1) * usual, intervals)
    placed = np.concatenate([[0.0], np.cumsum(elapsed)])
    if not jumps.any():  # the stamps themselves, free of the rounding of a running sum
        placed = kept - kept[0]

    if len(repeats):
        at = placed[np.searchsorted(rows, repeats, side="right") - 1]
        text = f"{len(repeats)} rows repeat the time of the row before and are left out"
        events.append(Event("clock_jump", float(at[0]), float(at[-1]), text))
    steps = np.flatnonzero(jumps)
    for index in steps[:_MOST_EVENTS]:
        way = "back" if intervals[index] < 0 else "forward"
        text = (
            f"the clock steps {way} by {abs(float(intervals[index])):.6g} s; what follows is "
            f"placed after {_JUMP_HOLE} empty samples, because the true pause is not known"
            + " (split = 'clock' in case.toml makes it a recording of its own)"
            * (way == "back")
        )
        events.append(_between(placed, index, index, text, "clock_jump"))
    if len(steps) > _MOST_EVENTS:
        text = f"{len(steps) - _MOST_EVENTS} further steps of the clock"
        events.append(_between(placed, steps[_MOST_EVENTS], steps[-1], text, "clock_jump"))
    events += gaps(placed, elapsed, jumps, usual)
    check_samples(float(placed[-1]), step, source)
    return Grid(placed, rows, step, usual, events)


def usual_interval(forward: Array, count: int) -> float:
    """The interval between samples where none is missing.

    Parameters
    ----------
    forward : (m,) array
        Intervals above zero [s], one at least.
    count : int
        Number of samples.

    Returns
    -------
    float
        Seconds.
    """
    usual = float(np.median(forward))
    interval = float(np.mean(forward[forward < GAP * usual]))
    short = float(f"{interval:.4g}")  # unless that shifts the grid visibly over all of it
    if abs(short / interval - 1.0) * count < 0.5 * _ON_SAMPLE:
        return short
    return float(f"{interval:.9g}")


def _between(placed: Array, first: Place, last: Place, text: str, kind: str = "gap") -> Event:
    """Event from the beginning of one interval between stamps to the end of another."""
    return Event(kind, float(placed[first]), float(placed[last + 1]), text)


def gaps(placed: Array, elapsed: Array, jumps: Mask, usual: float) -> list[Event]:
    """Gaps of a clock: one event each, or a single one that sums them up where they are many.

    Parameters
    ----------
    placed : (n,) array
        Times [s].
    elapsed : (n - 1,) array
        Intervals between them [s].
    jumps : (n - 1,) bool array
        Intervals that are no gaps but steps of the clock.
    usual : float
        The interval where none is missing [s].

    Returns
    -------
    list of Event
    """
    holes = np.flatnonzero(~jumps & (elapsed > GAP * usual))
    away = np.minimum(elapsed[holes] / usual, _FARTHEST)
    missing = np.maximum(np.rint(away).astype(int) - 1, 1)
    if len(holes) > _MOST_EVENTS:
        total = int(missing.sum())
        share = 100.0 * total / (total + len(placed))
        text = (
            f"{len(holes)} gaps, about {total} samples ({share:.0f} %) are missing, the longest "
            f"gap {float(elapsed[holes].max()):.6g} s"
        )
        return [_between(placed, holes[0], holes[-1], text)]
    late = missing <= _LATE
    found: list[Event] = []
    if late.sum() > _FEW_LATE:
        first, last, longest = holes[late][0], holes[late][-1], float(elapsed[holes[late]].max())
        text = (
            f"timer jitter: {int(late.sum())} times one or two samples are late or missing, the "
            f"longest interval {longest:.6g} s"
        )
        found = [_between(placed, first, last, text)]
        holes, missing = holes[~late], missing[~late]
    return found + [
        _between(placed, i, i, f"no samples for {elapsed[i]:.6g} s (about {m} missing)")
        for i, m in zip(holes, missing, strict=True)
    ]
