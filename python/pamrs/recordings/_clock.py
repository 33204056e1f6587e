"""Clocks of logs: dates, units, counters that overflow, rows out of order, bursts; stamps that
jitter or jump, and those with gaps, are put on one uniform grid, never across a hole.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs._files import MOST_ROWS
from pamrs.errors import RecordingError
from pamrs.units import parse_unit

_MOMENT: Final = re.compile(
    r"(?:(?P<days>[-+]?\d+) days? \+?)?"
    r"(?:(?P<a>\d{1,4})(?P<mark>[-./])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})(?:,? +|T))?"
    r"(?:(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}(?:[.,:]\d+)?))?"
    r"|(?P<minutes>\d{1,2}):(?P<seconds>\d{2}[.,]\d+))"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?(?: ?UTC| ?GMT|Z|(?P<zone>[+-]\d{2}:?\d{2}))?"
)
_NAMED: Final = re.compile(
    r"(?:(?P<d>\d{1,2})\.?[- ](?P<m>[^\W\d]{3})[^\W\d]*\.?,?[- ]"
    r"|(?P<n>[^\W\d]{3})[^\W\d]*\.? (?P<e>\d{1,2}),? )(?P<y>\d{4})"
)
_MONTHS: Final = {
    word: number
    for number, words in enumerate(
        ("jan", "feb", "mar mär mrz", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt")
        + ("nov", "dec dez"),
        start=1,
    )
    for word in words.split()
}
_WORLD: Final = re.compile("UTC|GMT|Z$")
_DAY: Final = 86400.0
_HOUR: Final = 3600.0
_SOON: Final = 10.0  # usual steps, within which a clock that was set back went on


def _match(cell: str) -> re.Match[str] | None:
    """Parts of a moment, whose month may have a name: 22-Nov-2022, Nov 22, 2022."""
    if any(letter.isalpha() for letter in cell[:6]):
        named = _NAMED.match(cell)
        month = _MONTHS.get((named["m"] or named["n"]).lower(), 0) if named else 0
        if named and month:
            cell = f"{named['y']}-{month}-{named['d'] or named['e']}{cell[named.end() :]}"
    return _MOMENT.fullmatch(cell)


def is_moment(cell: str) -> bool:
    """True where a text is a time of day, perhaps with a date before it."""
    return _match(cell) is not None


def is_date(cell: str) -> bool:
    """True where a text is a date without a time of day."""
    match = None if is_moment(cell) else _match(f"{cell} 0:00")
    return match is not None and match["a"] is not None


def moments(cells: Sequence[str]) -> tuple[Array, str] | None:
    """Seconds since the first of some dates or times of day.

    Returns
    -------
    seconds : (n,) array
        NaN where a cell is none of these; times of day go on past midnight.
    remark : str
        How dates are read that may be read in two ways; empty where there are none.
    None where fewer than half of the cells are such texts.
    """
    found = [_match(cell) for cell in cells]
    there = [match for match in found if match is not None]
    if 2 * len(there) <= len(cells):
        return None
    month_first, remark = _order({match[0]: match for match in there})
    seconds = np.full(len(cells), math.nan)
    days: dict[tuple[str, str, str], float] = {}
    passed, before, first = 0.0, -math.inf, math.nan
    whole = 3600.0 if there[0]["minutes"] else _DAY
    day = [_seconds_of_day(match) for match in there if match["a"] is None]
    newest_first = np.mean(np.diff(day) < 0.0) > 0.5 if len(day) > 1 else False
    for row, match in list(enumerate(found))[:: -1 if newest_first else 1]:
        if match is None:
            continue
        value = _seconds_of_day(match)
        if match["a"] is None:
            if value + passed < before - 0.5 * whole:
                passed += whole  # a clock of times of day ran past midnight
            seconds[row] = before = value + passed
            continue
        written = (match["a"], match["b"], match["c"])
        if written not in days:
            days[written] = _day(written, month_first)
        first = first if math.isfinite(first) else days[written]
        seconds[row] = (days[written] - first) * _DAY + value  # of few digits: exact to 1e-11 s
    if not any(match["zone"] or _WORLD.search(match[0]) for match in there[:1]):
        seconds, back = _through_the_autumn(seconds)
        if back >= 0:
            said = f"the clock goes back by an hour after {cells[back]!r}, as at the end of summer "
            remark = "; ".join([*filter(None, [remark]), said + "time: counted on from there"])
    good = seconds[np.isfinite(seconds)]
    return (seconds - good[0], remark) if len(good) else None


def _through_the_autumn(seconds: Array) -> tuple[Array, int]:
    """Times with an hour added after the clock was set back, and the row before; -1 for none."""
    rows = np.flatnonzero(np.isfinite(seconds))
    steps = np.diff(seconds[rows])
    back = np.flatnonzero(steps < 0.0)
    if len(back) != 1 or not np.any(steps > 0.0):
        return seconds, -1
    usual = float(np.median(steps[steps > 0.0]))
    if not 0.0 <= steps[back[0]] + _HOUR <= _SOON * usual:
        return seconds, -1
    at = int(rows[back[0]])
    return seconds + _HOUR * (np.arange(len(seconds)) > at), at


def _order(there: dict[str, re.Match[str]]) -> tuple[bool, str]:
    """True where months come before days, and a remark; numbers above 12 decide, then the slash."""
    dates = {
        (m["a"], m["mark"], m["b"], m["c"]) for m in there.values() if m["a"] and len(m["a"]) < 4
    }
    if not dates:
        return False, ""
    first, second = (max(int(each[place]) for each in dates) for place in (0, 2))
    slash = any(each[1] == "/" for each in dates)
    if first > 12 or second > 12:
        return first <= 12, ""
    if len(dates) == 1:
        return slash, ""
    some = min(dates)
    written = f"{some[0]}{some[1]}{some[2]}{some[1]}{some[3]}"
    return slash, f"dates like {written} are read with the {'month' if slash else 'day'} first"


def _day(written: tuple[str, str, str], month_first: bool) -> float:
    """Days since a fixed one; NaN where there is no such date."""
    first, second, third = map(int, written)
    if len(written[0]) == 4:
        year, month, day = first, second, third
    else:
        month, day = (first, second) if month_first else (second, first)
        year = third + (2000 if third < 100 else 0)
    try:
        return float(date(year, month, day).toordinal())
    except ValueError:
        return math.nan


def _seconds_of_day(match: re.Match[str]) -> float:
    """Seconds since midnight, UTC where the text says its zone; of a duration all of it."""
    if match["minutes"]:
        return int(match["minutes"]) * 60.0 + float(match["seconds"].replace(",", "."))
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + (12 if match["half"] in "Pp" else 0)
    seconds = float((match["second"] or "0").replace(",", ".").replace(":", "."))
    value = int(match["days"] or 0) * _DAY + hour * 3600.0 + int(match["minute"]) * 60.0 + seconds
    zone = match["zone"]
    if zone:
        away = int(zone[1:3]) * 3600.0 + int(zone[-2:]) * 60.0
        value -= away if zone[0] == "+" else -away
    return value


Place = int | np.signedinteger

GAP: Final = 1.6  # intervals longer than this many samples are holes
_JUMP_HOLE: Final = 10  # samples left empty where the clock jumped: the true pause is unknown
_ON_SAMPLE: Final = 0.05  # samples: nearer than this, a recorded value stays as it is
_MOST_EVENTS: Final = 20
_LATE_SAMPLES: Final = 2  # samples: a hole of so many is the timer's jitter where there are several
_FARTHEST: Final = 1e12  # samples that a hole is said to have, at most
_FEW_LATE: Final = 2  # such holes that are named one by one


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
    late = missing <= _LATE_SAMPLES
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


Rows = Index

#: Unit of the words by which series of times are called.
TIME_UNITS: Final = {
    word: unit
    for unit, words in {
        "ns": "nanos ns nsec nsecs nanosec nanosecs nanosecond nanoseconds",
        "us": "micros us usec usecs microsec microsecond microseconds",
        "ms": "millis ms msec msecs millisec millisecond milliseconds",
        "s": "s sec secs second seconds sekunden",
    }.items()
    for word in words.split()
}
_CLOCKS: Final = (
    "t time times zeit timestamp timestamps stamp stamps ts seconds sec secs clock when tijd "
    "tiempo temps tempo millis micros nanos ms us ns msec usec nsec nsecs milliseconds "
    "microseconds nanoseconds elapsed epoch uptime datetime datum uhrzeit zeitstempel zeitpunkt "
    "laufzeit date"
)
#: Words that name a series of times.
CLOCK_WORDS: Final = frozenset(_CLOCKS.split())
_FINER: Final = ("s", "ms", "us", "ns")
_EPOCH: Final = (9.4e8, 2.1e9)  # seconds since 1970 of the years 2000 to 2036
_SLOWEST: Final = 60.0  # seconds between samples of a log with such stamps
_DAYS: Final = ((3.6e4, 5.5e4), (7.3e5, 7.5e5))  # of 1998 to 2050 by Excel and by MATLAB
_LONGEST: Final = 1e10  # seconds, 300 years: no clock shows more
_PERIODS: Final = tuple(2.0**bits / scale for scale in (1.0, 1e3, 1e6, 1e9) for bits in (32, 16))
_OVERFLOW: Final = (0.2, 3.0)  # usual steps that a counter goes on by where it overflows
_LONG: Final = 20.0  # usual steps; a shorter period has to show several times that it is one
_OFTEN: Final = 3
_LATE_ROWS: Final = 20  # rows that may come late, one after the other
_MANY: Final = 50  # stamps between pauses from which on a line through their rows is known
_NEWEST_FIRST: Final = 0.02  # steps forward for each one back, of logs with the newest row first
_LEAST_STEP: Final = 0.05  # usual steps; rows that are nearer to each other are as good as at once
_LEAST_READINGS: Final = 8  # after which a sensor is known to be slower than its log
_LEAST_STAY: Final = 2.5  # rows of each of them
_UNEVEN: Final = 0.3  # of the usual stay, by which one may be longer or shorter
_EVENLY: Final = 0.9  # of the stays are no longer or shorter
_SIZES: Final = 3  # different steps, at the least
_SAME: Final = 3.0  # how far beyond the largest step of an angle one over a full turn may be


def unit_of_stamps(values: Array, name: str, said: str = "") -> tuple[str, str]:
    """The unit of time stamps: what the log says where that is possible, else by name and size.

    Parameters
    ----------
    values : (n,) array
        The stamps, NaN where there is none.
    name : str
        What the log calls them.
    said : str
        A unit of time that the log says, or empty.

    Returns
    -------
    unit, remark : str
        The unit, and what is to be said of it; empty where the log says it.
    """
    good = values[np.isfinite(values)]
    steps = np.abs(np.diff(good))
    steps = steps[steps > 0.0]
    usual = float(np.median(steps)) if len(steps) else 0.0
    size = float(np.max(np.abs(good))) if len(good) else 0.0
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", name).lower()
    words = ["", *(word for word in re.split(r"[^0-9a-zäöüµ]+", parted) if word)]
    spoken = TIME_UNITS.get(words[-1], "")
    for unit in (said, spoken):
        if unit and size * parse_unit(unit).scale <= _LONGEST:
            return unit, "" if unit == said else f"the times {name} are taken as {unit} by name"
    unit = _by_size(size, usual)
    apart = usual * parse_unit(unit).scale
    why = f"have no unit in the log: {unit} is taken by their size"
    if said or spoken:
        why = f"reach {size:.4g}, which cannot be {said or spoken}: {unit} is taken"
    return unit, f"the times {name} {why}, samples are then {apart:.4g} s apart"


def _by_size(size: float, usual: float) -> str:
    """A date in one of the units, else the unit in which samples are 10 us to 1 s apart."""
    for unit in _FINER:
        scale = parse_unit(unit).scale
        if _EPOCH[0] <= size * scale <= _EPOCH[1] and usual * scale <= _SLOWEST:
            return unit
    if any(low <= size <= high for low, high in _DAYS) and usual * 86400.0 <= 2.0:
        return "d"
    limits = (0.5, 1e3, 1e6)
    return _FINER[sum(usual >= limit for limit in limits)]


@dataclass(frozen=True, eq=False)
class Ticks:
    """Times at which the rows of a log were taken, in order.

    Attributes
    ----------
    rows : (m,) array of int
        Rows of the log that have a time, in the order of time.
    time : (m,) array
        Their times [s]; several rows may have one, and a clock may start again.
    remarks : tuple of str
        What was done to the clock.
    """

    rows: Rows
    time: Array
    remarks: tuple[str, ...] = ()

    @cached_property
    def spread(self) -> tuple[Array, str]:
        """Times with the rows of one stamp spread over it, and what is to be said of it."""
        return spread(self.time)


def ticks(stamps: Array, others: Sequence[Array] = ()) -> Ticks:
    """Put the rows of a log in the order of their stamps.

    Parameters
    ----------
    stamps : (n,) array
        Seconds, NaN where a row has none.
    others : sequence of (n,) arrays
        What else is in the rows, by which rows that were written twice are known.

    Returns
    -------
    Ticks
        Of a log whose newest row comes first the order is reversed. Counters of 16 and 32 bits go
        on where they overflow, rows that came late are put where they belong, rows that were
        written twice are left out.
    """
    remarks: list[str] = []
    rows: Rows = np.flatnonzero(np.isfinite(stamps))
    if len(rows) < len(stamps):
        remarks.append(f"rows without a time: {len(stamps) - len(rows)} of {len(stamps)}, left out")
    steps = np.diff(stamps[rows])
    if np.sum(steps > 0.0) < _NEWEST_FIRST * np.sum(steps < 0.0):
        rows = rows[::-1].copy()
        remarks.append("the newest row comes first: read from the end")
    time, said = _counted_on(stamps[rows])
    if np.any(np.diff(time) < 0.0):  # more than overflows, whose last rows would seem to be late
        order, late = _in_order(time)
        if late:
            remarks.append(f"rows that come after later ones: {late}, sorted by their times")
        rows = rows[order]
        time, said = _counted_on(stamps[rows])
    remarks += said
    again = np.flatnonzero(np.diff(time) == 0.0) + 1
    if len(again) and others and all(_same(values, rows, again) for values in others):
        remarks.append(f"rows that are there twice: {len(again)}, left out once")
        keep = np.ones(len(rows), dtype=bool)
        keep[again] = False
        rows, time = rows[keep], time[keep]
    return Ticks(rows, time, tuple(remarks))


def _same(values: Array, rows: Rows, again: Rows) -> bool:
    now, before = values[rows[again]], values[rows[again - 1]]
    return bool(np.all((now == before) | (np.isnan(now) & np.isnan(before))))


def _counted_on(stamps: Array) -> tuple[Array, list[str]]:
    """Stamps of a counter that overflows, as if it had more bits."""
    steps = np.diff(stamps)
    back = steps[steps < 0.0]
    forward = steps[steps > 0.0]
    if not len(back) or not len(forward):
        return stamps, []
    usual = float(np.median(forward))
    low, high = (limit * usual for limit in _OVERFLOW)
    for period in _PERIODS:
        gone = back + period
        fits = (gone >= low) & (gone <= high) & (np.ptp(stamps) <= period)
        often = len(back) >= _OFTEN and fits.all()
        if fits.any() and (period >= _LONG * usual or often):
            over = steps < -0.5 * period
            turns = np.concatenate([[0.0], np.cumsum(over)])
            bits = 16 if period in _PERIODS[1::2] else 32
            text = f"overflows of a clock of {bits} bits: {int(over.sum())}, counted on"
            return stamps + period * turns, [text]
    return stamps, []


def _in_order(time: Array) -> tuple[Rows, int]:
    """Order of the rows with late ones in their places, and their number; restarts are kept."""
    order: Rows = np.arange(len(time))
    laid = time.copy()
    start, done, moved = 0, 0, 0
    for at in np.flatnonzero(np.diff(time) < 0.0).tolist():
        late = at + 1
        if late < done:
            continue
        after = laid[late : late + 1 + _LATE_ROWS]
        ahead = np.flatnonzero(after >= laid[at])
        stop = late + int(ahead[0] if len(ahead) else len(after))
        first = start + int(np.searchsorted(laid[start:late], laid[late:stop].min()))
        low, next_ones = max(start, first - 2), laid[stop : stop + 2]
        near = np.append(laid[low:stop], np.sort(next_ones[next_ones >= laid[at]]))
        followed = len(ahead) > 0 or stop == len(laid)
        if followed and _came_late(near, first - low, stop - low):
            local = first + np.argsort(laid[first:stop], kind="stable")
            moved += stop - late
            order[first:stop] = order[local]
            laid[first:stop] = laid[local]
            done = stop
        else:
            start = done = late
    return order, moved


def _came_late(written: Array, first: int, stop: int) -> bool:
    """True where rows up to `stop` belong before those from `first` on, as sorting makes their
    steps more even, which it does not for a clock that started again.
    """
    merged = written.copy()
    merged[first:stop].sort()
    steps = np.diff(merged)
    least = _LEAST_STEP * float(np.median(steps[steps > 0.0]))

    def roughness(time: Array) -> float:
        steps = np.diff(time)
        turns = np.diff(np.log(np.maximum(steps, least)))
        return float(np.sum(turns[(steps[1:] >= 0.0) & (steps[:-1] >= 0.0)] ** 2))

    return roughness(merged) < roughness(written)


def spread(time: Array) -> tuple[Array, str]:
    """Times of rows of which several have one stamp, spread over it by their count.

    Parameters
    ----------
    time : (n,) array
        Seconds, in order; a clock may start again.

    Returns
    -------
    time : (n,) array
        The same where no stamp is there twice.
    remark : str
        What was done; empty where nothing was.
    """
    again = int(np.sum(np.diff(time) == 0.0))
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(time) != 0.0]))
    if not again or len(firsts) < 2:
        return time, ""
    counts = np.diff(np.append(firsts, len(time)))
    lasting = np.diff(time[firsts])
    rising = lasting > 0.0
    if not rising.any():
        return time, ""
    after, before = (lasting / counts[side] for side in (slice(None, -1), slice(1, None)))
    if _uneven(before[rising]) < 0.5 * _uneven(after[rising]):  # packets, stamped as they came
        laid = -_spread_on(-time[::-1])[::-1]
        where = "before it"
    else:
        laid, where = _spread_on(time), "to the next one"
    laid = _evenly(time, laid, firsts)
    return laid, (
        f"{len(time)} rows have {len(firsts)} different times (up to {int(counts.max())} rows of "
        f"one): spread evenly over the time {where}"
    )


def _evenly(time: Array, laid: Array, firsts: Rows) -> Array:
    """Times on a straight line from pause to pause, where it fits coarse stamps within a step."""
    lasting = np.diff(time[firsts])
    usual = float(np.median(lasting[lasting > 0.0]))
    pauses = np.flatnonzero((lasting < 0.0) | (lasting > GAP * usual)) + 1
    bounds = [0, *pauses.tolist(), len(firsts)]
    edges = np.append(firsts, len(time))
    result = laid.copy()
    for first, last in zip(bounds[:-1], bounds[1:], strict=True):
        start, stop = int(edges[first]), int(edges[last])
        if last - first < _MANY:
            continue
        rows = np.arange(stop - start, dtype=np.float64)
        slope, begin = np.polyfit(rows, laid[start:stop], 1)
        line = begin + slope * rows
        away = time[start:stop] - line
        if slope > 0.0 and float(np.ptp(away)) <= GAP * usual:
            result[start:stop] = line
    return result


def _uneven(steps: Array) -> float:
    return float(np.mean(np.abs(steps / np.median(steps) - 1.0)))


def _spread_on(time: Array) -> Array:
    """Rows of one stamp, spread up to the next one; none across a pause."""
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(time) != 0.0]))
    counts = np.diff(np.append(firsts, len(time)))
    at = time[firsts]
    lasting = np.append(np.diff(at), -1.0)
    rising = lasting > 0.0
    each = lasting / counts
    usual = float(np.median(each[rising]))
    step = np.where(rising & (each <= GAP * usual), each, usual)
    if np.median(counts) >= 2.0:  # a log begins within a burst, which ends with the next one
        begins = np.concatenate([[True], ~rising[:-1]])
        part = begins & rising & (each > 1.02 * usual)
        at = np.where(part, at + lasting - counts * usual, at)
        step = np.where(part, usual, step)
    within = np.arange(len(time)) - np.repeat(firsts, counts)
    return np.asarray(np.repeat(at, counts) + within * np.repeat(step, counts))


def filled_rows(values: Array) -> Rows | None:
    """Rows in which a slower channel has its values; None where it has one in nearly every row.

    Parameters
    ----------
    values : (n,) array
        NaN where a cell is empty.

    Returns
    -------
    (m,) array of int or None
    """
    filled = np.flatnonzero(np.isfinite(values))
    if len(filled) < 3 or float(np.median(np.diff(filled))) < 2.0:
        return None
    return filled


def reading_rows(values: Array) -> tuple[Rows, float] | None:
    """Rows at which the readings of a slow sensor begin that a fast log repeats until the next one.

    Readings come evenly and their steps differ; a converter's slow ramp has steps of one size, and
    noise changes from row to row.

    Parameters
    ----------
    values : (n,) array
        NaN where a cell is empty.

    Returns
    -------
    rows : (m,) array of int
        First row of each reading; of several that are equal, each has its own.
    stay : float
        Rows that a reading stays as a rule.
    None where each row has a reading of its own.
    """
    good = np.flatnonzero(np.isfinite(values))
    data = values[good]
    edges = np.flatnonzero(np.diff(data)) + 1
    stays = np.diff(edges)
    if len(stays) < _LEAST_READINGS or (stay := float(np.median(stays))) < _LEAST_STAY:
        return None
    counts = np.maximum(np.rint(stays / stay), 1.0)
    even = np.abs(stays / stay - counts) <= _UNEVEN * np.sqrt(counts)
    sizes = np.abs(data[edges] - data[edges - 1])
    if np.mean(even) < _EVENLY or len(np.unique(np.rint(1e6 * sizes / sizes.max()))) < _SIZES:
        return None
    first, last = (round(edge / stay) for edge in (edges[0], len(data) - edges[-1]))
    before = np.maximum(edges[0] - stay * np.arange(first, 0, -1), 0)
    found = [before, edges[-1] + stay * np.arange(max(last, 1))]
    for start, lasting, count in zip(edges[:-1], stays, counts, strict=True):
        found.append(start + lasting / count * np.arange(count))
    return good[np.unique(np.rint(np.concatenate(found)).astype(int))], stay


def unwound(angle: Array) -> tuple[Array, str]:
    """An angle without the leaps of an encoder that starts again after a full turn.

    Parameters
    ----------
    angle : (n,) array
        Radians, NaN where there is none.

    Returns
    -------
    angle : (n,) array
        On the turn that is nearest to zero for an encoder that counts from 0, else nearest to half
        a turn; the same where nothing leaps.
    remark : str
        What was done; empty where nothing was.
    """
    turn = 2.0 * np.pi
    least = float(np.min(angle, initial=0.0, where=np.isfinite(angle)))
    result, leaps = _unwrapped(angle, turn, 0.0 if least >= -1e-3 * turn else 0.5 * turn)
    return result, f"leaps by a full turn: {leaps}, unwrapped" if leaps else ""


def counted_on(counts: Array) -> tuple[Array, str]:
    """Counts of an encoder without the leaps of a counter that overflows, up or down.

    Parameters
    ----------
    counts : (n,) array
        Numbers of the log, NaN where there is none.

    Returns
    -------
    counts : (n,) array
        Near zero; the same where nothing leaps, or they are no whole numbers.
    remark : str
        What was done; empty where nothing was.
    """
    good = counts[np.isfinite(counts)]
    if not len(good) or np.any(good % 1.0 != 0.0):
        return counts, ""
    for bits in (16, 32):
        result, leaps = _unwrapped(counts, 2.0**bits, 0.0)
        if leaps:
            return result, f"overflows of a counter of {bits} bits: {leaps}, counted on"
    return counts, ""


def _unwrapped(values: Array, turn: float, middle: float) -> tuple[Array, int]:
    """Values without leaps by a turn, on that nearest to `middle`, and the number of leaps."""
    good = np.flatnonzero(np.isfinite(values))
    data = values[good]
    steps = np.diff(data)
    leaps = np.abs(steps) > 0.5 * turn
    if not leaps.any() or leaps.mean() > 0.1 or float(np.ptp(data)) > 1.001 * turn:
        return values, 0
    beyond = np.abs(np.abs(steps[leaps]) - turn)
    if float(beyond.max()) > _SAME * float(np.max(np.abs(steps[~leaps]), initial=0.0)):
        return values, 0
    laid = np.unwrap(data, period=turn)
    laid -= turn * np.round((float(np.median(laid)) - middle) / turn)
    result = values.copy()
    result[good] = laid
    return result, int(leaps.sum())
