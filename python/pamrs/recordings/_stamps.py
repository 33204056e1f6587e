"""Time stamps as logs have them: unit, counters that overflow, rows out of order, bursts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from pamrs._arrays import Array, Index
from pamrs.recordings._clock import GAP
from pamrs.units import parse_unit

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
_LATE: Final = 20  # rows that may come late, one after the other
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
    spoken = TIME_UNITS.get(_last_word(name), "")
    for unit in (said, spoken):
        if unit and size * parse_unit(unit).scale <= _LONGEST:
            return unit, "" if unit == said else f"the times {name} are taken as {unit} by name"
    unit = _by_size(size, usual)
    apart = usual * parse_unit(unit).scale
    why = f"have no unit in the log: {unit} is taken by their size"
    if said or spoken:
        why = f"reach {size:.4g}, which cannot be {said or spoken}: {unit} is taken"
    return unit, f"the times {name} {why}, samples are then {apart:.4g} s apart"


def _last_word(name: str) -> str:
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", name)
    words = [word for word in re.split(r"[^0-9a-zäöüµ]+", parted.lower()) if word]
    return words[-1] if words else ""


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
        What else stands in the rows, by which rows that were written twice are known.

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
        after = laid[late : late + 1 + _LATE]
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
