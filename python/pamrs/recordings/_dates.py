"""Dates and times of day as texts: German, American, ISO, with fractions, AM and PM."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import date
from typing import Final

import numpy as np

from pamrs._arrays import Array

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

    Parameters
    ----------
    cells : sequence of str
        ``22.11.2022 10:16:51,123``, ``11/22/2022 10:16:51 AM``, ``10:16:51.123``.

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
