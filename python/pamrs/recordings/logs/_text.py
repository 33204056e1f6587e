"""Logs of cells: text in every dialect (encoding, comments, headings, units and decimals are found
out), JSON (records in an array or in lines, columns in a table, which may lie deeper), and
workbooks of Excel by calamine, each sheet that holds a table.
"""

from __future__ import annotations

import io
import json
import math
import re
import struct
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._files import MOST_BYTES, read_file
from pamrs.errors import RecordingError
from pamrs.recordings._clock import CLOCK_WORDS, is_date, is_moment, moments
from pamrs.recordings._gate import check_size
from pamrs.recordings.logs._log import (
    Log,
    Series,
    TextFormat,
    collected,
    same_unit,
    series_of_texts,
    split_heading,
    understood_unit,
    unwrapped,
)
from pamrs.recordings.table import (
    GROUPED_BY_POINTS,
    NO_VALUE,
    QUANTITY,
    Dialect,
    Lines,
    Table,
    dialect_of,
    first_few,
    is_number,
    is_useful,
    joined_rows,
    left_out_rows,
    lines_of,
    lines_of_rows,
    numbers_of_cells,
    read_text,
    same_width,
    split_rows,
    usual_width,
)
from pamrs.units import parse_unit, same_dimension

_COMMENTS: Final = ("#", "%", "//", "'")
_UNNAMED: Final = "column "
_LINES: Final = 400  # in the middle of a table, which tell how it is written
_HEAD: Final = 5000  # rows above the table, at most
_BEGUN: Final = 20  # rows of an earlier run that may come above the headings
_MOST_TEXTS: Final = 1000  # different texts of a column that can name pieces
_MARKS: Final = {".": "points", ",": "commas"}
_GROUPED_BY_COMMAS = re.compile(r"[-+]?(?:[1-9]\d{0,2}(?:,\d{3})+|\d{1,3})(?:\.\d+)?")
_THOUSANDS = re.compile(r"[-+]?(\d{1,3}(\.\d{3})+|0)")
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+]\d{2,3}(?!\d))")
#: Keys above a table next to which the time between its samples is given.
_SPACING: Final = re.compile(
    r"(?:x[ _]?|horizontal |sampl\w+ |scan )?(?:interval|increment|period|resolution)|sample time|"
    r"delta[ _][xt]|dt|abtast(?:zeit|intervall)",
    re.IGNORECASE,
)
_VALUES: Final = frozenset(("value", "values", "wert", "reading", "valor", "valeur"))


class _Headed(NamedTuple):
    """First row and width of a table, with the names and units from the rows above it."""

    first: int
    kinds: list[str]  # of the cells of most rows, by column
    names: list[str]
    units: list[str]
    rows: list[list[str]]  # headings and units, as they are in the file
    remarks: list[str]
    spacing: float  # seconds between samples, as a row above says; NaN where none does


def read_text_log(path: Path, form: TextFormat) -> Log:
    """Read a text file.

    Parameters
    ----------
    path : Path
        The file; ``.gz`` is unpacked.
    form : TextFormat
        What of its dialect is given; the rest is found out.

    Returns
    -------
    Log
        One series for each column; texts have labels. Columns have no clock yet.

    Raises
    ------
    RecordingError
        If it cannot be read, or no table is found in it.
    """
    text, source = read_text(path), str(path)
    remarks: list[str] = []
    lines = [line for line in text.splitlines() if line.strip()]
    if any(map(_FORTRAN.search, lines[len(lines) // 2 :][:_LINES])):
        text = _FORTRAN.sub("E", text)
        lines = [line for line in text.splitlines() if line.strip()]
        remarks.append("exponents are written with D, as Fortran does: read")
    times: list[str] | None = None
    if form.delimiter is None:
        apart = _times_apart(lines, source)
        if apart is not None:
            lost = len(lines) - len(apart[0])
            remarks += [f"lines without a time: {lost}, left out"] if lost else []
            times, lines = apart
        labelled = _labelled_rows(lines, times, source)
        if labelled is not None:
            rows = lines_of_rows(labelled[0])
            return _log_of_lines(path, rows, form, ".", [*remarks, *labelled[1]])
    kept = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    dialect = dialect_of(kept, source, form.delimiter, form.decimal, form.thousands)
    if times is not None:
        text = "\n".join(f"{a}{dialect.delimiter}{b}" for a, b in zip(times, lines, strict=True))
    if dialect.delimiter == " ":  # a unit belongs to the word before it
        text = re.sub(r"[^\S\n]+(?=[\[(][^\s\])]*[\])])", "", text)
        lines = text.splitlines()
    comments = _comments(lines, dialect)
    body = lines_of(text, dialect.delimiter, source, _COMMENTS)
    return _log_of_lines(path, body, form, dialect.decimal, remarks, comments)


def _log_of_lines(
    path: Path,
    body: Lines,
    form: TextFormat,
    decimal: str,
    remarks: Sequence[str] = (),
    comments: Sequence[list[str]] = (),
) -> Log:
    """Log of a table, with what is above it: cells of comments may be headings."""
    above = _headed(path, body, decimal, form, comments)
    rows = body.after(above.first)
    if len(rows.lines) < 2:
        raise RecordingError(
            f"{path}: no table was found: it has {len(rows.lines)} rows of numbers"
        )
    stamped = "moment" in above.kinds  # then each row has a time of day, and is not asked
    parted = ((k, rows.parted(line)) for k, line in enumerate(rows.lines) if ":" in line)
    odd = (
        {} if stamped else {k: rows.numbers[k] for k, row in parted if _is_dated(row, above.kinds)}
    )
    left = left_out_rows([*odd.values()], "rows with a time of day for a number")
    rows = rows.only([k for k in range(len(rows.lines)) if k not in odd])
    width = len(above.kinds)
    rows, part, said = same_width(rows, width, above.rows, str(path), strict=False)
    said = [*remarks, *above.remarks, *left, *said]
    rows, names, units = _dated(rows, above.names, above.units, said)
    table = Table(names, rows)
    found: list[Series] = []
    unread: dict[str, str] = {}
    for place, unit in enumerate(units):
        _column(table, place, unit, decimal, form.thousands, found, unread, said)
    found = _pivoted(_spaced(found, above.spacing, said), said)
    if part:
        found.append(Series("part", 1.0 + np.array(part) - part[0]))
    return collected(path, found, unread, said)


def _headed(
    path: Path, body: Lines, decimal: str, form: TextFormat, comments: Sequence[list[str]]
) -> _Headed:
    """Read names and units of the columns from the rows above the numbers of a table."""
    head, middle = body.rows(0, _HEAD), len(body.lines) // 2
    first, kinds = _first_row(head, body.rows(middle, middle + _LINES), decimal, form)
    width = len(kinds)
    names, units, used = _headings(head[:first], width, decimal, form, comments)
    remarks = []
    if form.columns is not None:
        if len(form.columns) != width:
            raise RecordingError(
                f"{path}: columns lists {len(form.columns)} names, but there are {width} columns"
            )
        names, units = _named(list(form.columns))
    if used and used[0] in head:
        at = head.index(used[0])
        line = f"the headings are line {body.numbers[at]}"
        remarks += [f"lines above the headings: {at}, not read; {line}"] if at else []
        between = [body.numbers[k] for k in range(at, first) if head[k] not in used]
        remarks += left_out_rows(between, "lines between the headings and the numbers")
    elif not used and form.header is not False and form.columns is None:
        some = f"columns 1 to {width} have no names" if width > 1 else "its column has no name"
        number = body.numbers[min(first, len(body.lines) - 1)]
        remarks.append(f"there are no headings above line {number}: {some}")
    begun = [] if used else head[first : first + _BEGUN]  # headings would say what is in them
    spacing = _stated_spacing(head[:first], begun, decimal)
    return _Headed(first, kinds, names, units, used, remarks, spacing)


def _first_row(
    head: list[list[str]], middle: list[list[str]], decimal: str, form: TextFormat
) -> tuple[int, list[str]]:
    """Index of the first row of numbers, and the kind of the cells of each column."""
    width = usual_width([len(row) for row in middle])

    def kind(cell: str) -> str:
        if is_number(cell, decimal, form.thousands):
            return "number"
        return ("moment" if is_moment(cell) else "quantity") if useful([cell]) else ""

    def useful(row: list[str]) -> int:
        return sum(is_useful(cell, decimal, form.thousands) for cell in row)

    usual = [
        max(kinds := [kind(row[k]) for row in middle if len(row) == width], key=kinds.count)
        for k in range(width)
    ]

    def alike(row: list[str]) -> int:
        same = sum(k == kind(cell) != "" for k, cell in zip(usual, row, strict=False))
        return 0 if _is_dated(row, usual) else same

    # a row of which only half is alike may be one of keys and what they say
    least = sorted(map(alike, middle))[len(middle) // 2] // 2 if middle else 0
    for index, row in enumerate(head):
        if width / 2 < len(row) <= width and alike(row) > least:
            if form.header is None:
                index += _begun_before(head[index : index + _BEGUN], width, useful)
            return (max(index, 1) if form.header else index), usual
    return 0, usual


def _is_dated(row: list[str], kinds: list[str]) -> bool:
    """True where a time of day is in a column of numbers: the row is none of the table."""
    pairs = zip(row, kinds, strict=False)
    times = [cell for cell, kind in pairs if kind == "number" and ":" in cell]
    return any(is_moment(cell.strip()) for cell in times)


def _begun_before(rows: list[list[str]], width: int, useful: Callable[[list[str]], int]) -> int:
    """Rows up to and with headings below a logger's last run; 0 where there are none."""
    last = 0
    for place, row in enumerate(rows):
        if len(row) == width > 1 and all(row) and useful(row) == 0 and len(set(row)) == width:
            last = place + 1
        elif last:
            break
    return last


def _comments(lines: list[str], dialect: Dialect) -> list[list[str]]:
    """Cells of the comments above the numbers: they may hold the headings, ``# t; p1``."""
    found = []
    for line in lines[:200]:
        comment = line.lstrip().startswith(_COMMENTS)
        rows = split_rows(line.lstrip().lstrip("#%/'") if comment else line, dialect.delimiter)
        cells = [cell.strip() for cell in rows[0]] if rows else []
        if comment:
            found.append(cells)
        elif cells and all(is_useful(cell, dialect.decimal, None) for cell in cells):
            break
    return found


def _headings(
    above: list[list[str]],
    width: int,
    decimal: str,
    form: TextFormat,
    comments: Sequence[list[str]],
) -> tuple[list[str], list[str], list[list[str]]]:
    """Names and units from the rows above the numbers, and those rows."""

    def count(row: list[str]) -> int:
        cells = {cell for cell in row if any(map(str.isalpha, cell))}
        return sum(not is_useful(cell, decimal, form.thousands) for cell in cells)

    full = [row for row in above if width < 2 * len(row) and not any(row[width + 1 :])]
    if not any(map(count, full)) and not form.header:
        full = [row for row in comments if len(row) == width > 1]
    if form.header is False or not full or not (any(map(count, full)) or form.header):
        return [f"{_UNNAMED}{i + 1}" for i in range(width)], [""] * width, []
    below = [row for row in full[1:] if _all_units([unwrapped(cell) for cell in row])][-1:]
    names = max(reversed([row for row in full if row not in below]), key=count)
    units = ([*(unwrapped(cell) for row in below for cell in row), *[""] * width])[:width]
    headings = ["time" if is_moment(cell) else cell for cell in ([*names, *[""] * width])[:width]]
    label = [  # of its row, not of a column
        name.endswith(("=", ":"))
        or (min(headings.count(name), units.count(unit)) > 1 and not understood_unit(unit or "s"))
        for name, unit in zip(headings, units, strict=True)
    ]
    headings = ["" if off else name for name, off in zip(headings, label, strict=True)]
    units = [
        "" if off or is_number(unit, decimal, None) else unit
        for unit, off in zip(units, label, strict=True)
    ]
    named, inside = _named(headings)
    merged = [a if a and a != "-" else b for a, b in zip(units, inside, strict=True)]
    return named, merged, [names, *below]


def _stated_spacing(above: list[list[str]], begun: list[list[str]], decimal: str) -> float:
    """Seconds between samples that are written next to a key above a table or in its first rows, or
    below one above it in a row that is none of numbers; NaN for none.
    """
    next_to = (pair for row in above + begun for pair in zip(row, row[1:], strict=False))
    rows = zip(above, above[1:], strict=False)
    said = (two for two in rows if not all(is_useful(c, decimal, None) for c in two[1] if c))
    below = (pair for two in said for pair in zip(*two, strict=False))
    for key, value in (*next_to, *below):
        match = QUANTITY.fullmatch(value)
        if match and _SPACING.fullmatch(key.strip(" =:")):
            unit = understood_unit(match["unit"] or "s")
            if unit is not None and same_dimension(unit.unit, "s"):
                (number,), _ = numbers_of_cells([match["number"]], None, decimal)
                return float(number) * parse_unit(unit.unit).scale
    return math.nan


def _spaced(found: list[Series], spacing: float, remarks: list[str]) -> list[Series]:
    """Series with times where a column without a name rises by the spacing that is given above the
    table, or one counts the samples and nothing else is a clock.
    """
    words = {word for item in found for word in re.findall("[a-z]+", item.name.lower())}
    clocked = any(item.stamps for item in found) or bool(words & CLOCK_WORDS)
    made: list[Series] = []
    times: list[Series] = []
    for item in found if math.isfinite(spacing) and spacing > 0.0 else ():
        steps = np.diff(item.values)
        named = not item.name.startswith(_UNNAMED)
        if not named and np.allclose(steps, spacing, atol=0.5 * spacing, rtol=0.0):
            remarks.append(
                f"{item.name} rises by {spacing:g} s, as a line above it says: the times"
            )
            item = Series("time", item.values, "s")
            times.append(item)
            if len(times) > 1 and np.array_equal(times[0].values, item.values):
                continue
        elif not clocked and len(steps) and np.all(steps == 1.0):
            remarks.append(
                f"{item.name} counts samples, {spacing:g} s apart as a line above them says"
            )
            item = Series(item.name if named else "time", item.values * spacing, "s")
        made.append(item)
    return made or found


def _pivoted(found: list[Series], remarks: list[str]) -> list[Series]:
    """Series of a table with a row for each reading: when, of what, how much."""
    values = [item for item in found if item.name.strip("_ ").lower() in _VALUES]
    texts = [item for item in found if len(item.labels) > 1]
    said = [item for item in texts if _all_units([*map(unwrapped, item.labels)])]
    names = [item for item in texts if item not in said]
    if len(values) != 1 or len(names) != 1 or values[0].labels:
        return found
    (value,), (name,) = values, names
    if not any(
        _times_shared(item, name) for item in found if item is not value and not item.labels
    ):
        return found
    made = []
    for place, label in enumerate(name.labels):
        rows = name.values == place
        called, unit = split_heading(label)
        units = {each.labels[int(k)] for each in said[:1] for k in each.values[rows]}
        unit = " or ".join(sorted(units)) or unit or value.unit
        made.append(Series(called, np.where(rows, value.values, np.nan), unit))
    remarks.append(
        f"{name.name} says of what {value.name} is in each row: {first_few(name.labels)}"
    )
    return [*(item for item in found if item not in (value, name, *said)), *made]


def _times_shared(clock: Series, name: Series) -> bool:
    """True where the times of a clock come again for several labels, and each label once at each:
    those of the commonest label may come alone, where it is read more often than the others.
    """
    _, at = np.unique(clock.values, return_inverse=True)
    pairs = np.unique([at, name.values], axis=1)
    shared = np.bincount(at)[at] > 1
    rarer = name.values != np.argmax(np.bincount(name.values.astype(int)))
    return bool(pairs.shape[1] > 0.9 * len(at) and np.mean(shared[rarer]) > 0.5)


def _dated(
    rows: Lines, names: list[str], units: list[str], remarks: list[str]
) -> tuple[Lines, list[str], list[str]]:
    """Rows, names and units with a date and the time of day next to it in one cell."""
    middle = len(rows.lines) // 2
    some = rows.rows(middle, middle + 1)
    dates = [k for row in some for k, cell in enumerate(row) if is_date(cell)]
    times = [k for row in some for k, cell in enumerate(row) if is_moment(cell)]
    if not dates or not times or is_date(some[0][times[0]].split()[0]):
        return rows, names, units
    date, time, last = dates[0], times[0], ""
    joined = []
    for row in rows.rows():
        last = row[date] or last  # some write it only where it changes
        row[time] = f"{last} {row[time]}"
        joined.append([cell for k, cell in enumerate(row) if k != date])
    remarks.append(f"{names[date]} and {names[time]} are one clock, here {names[time]}")
    kept = [k for k in range(len(names)) if k != date]
    made = joined_rows(zip(rows.numbers, joined, strict=True))
    return made, [names[k] for k in kept], [units[k] for k in kept]


def _all_units(cells: list[str]) -> bool:
    """True where more than half of the cells of a row that have a text are known units."""
    said = [cell for cell in cells if cell not in ("", "-", "1", "%")]
    return any(
        2 * sum(understood_unit(cell) is not None for cell in some) > len(some)
        for some in (said, set(said))  # a label may be next to each of them
    )


def _named(headings: list[str]) -> tuple[list[str], list[str]]:
    pairs = [split_heading(heading.strip('"')) for heading in headings]
    names = [name or f"{_UNNAMED}{i + 1}" for i, (name, _) in enumerate(pairs)]
    return names, [unit for _, unit in pairs]


def _column(
    table: Table,
    place: int,
    unit: str,
    decimal: str,
    thousands: str | None,
    found: list[Series],
    unread: dict[str, str],
    remarks: list[str],
) -> None:
    """Add one column to what was found, or say why it is not."""
    name = (table.header or [])[place]
    values, strange = table.read(place, thousands, decimal)
    if 2 * len(strange) < np.isfinite(values).sum() and not table.doubtful(place, decimal):
        odd = [table.cell(place, row) for row in strange]
        if not any("," in cell or "." in cell for cell in odd):
            remarks += [f"{name}: {text}" for text in table.strange_cells(place, strange)]
            found.append(Series(name, values, unit))
            return
    cells = [str(cell) for cell in table.cells(place)]
    if not any(cells):  # as every row of some programs ends with a delimiter
        if not name.startswith(_UNNAMED):
            unread[name] = "it is empty"
        return
    if thousands is None and (mark := _grouped(cells, decimal)):
        remarks += [f"{name}: {text}" for text in _mark_remark(cells, mark)]
        values, strange = table.read(place, mark, decimal)
    filled = sum(map(bool, cells))
    if 2 * len(strange) < filled:
        remarks += [f"{name}: {text}" for text in table.strange_cells(place, strange)]
        found.append(Series(name, values, unit))
        return
    try:
        made, lost, said = _of_texts(Series(name, values, unit), cells, table, decimal, thousands)
    except RecordingError as error:
        unread[name] = str(error)
        return
    found.append(made)
    remarks += [f"{name}: {text}" for text in (*table.strange_cells(place, lost), *said)]


def _of_texts(
    series: Series, cells: list[str], table: Table, decimal: str, thousands: str | None
) -> tuple[Series, list[int], list[str]]:
    """A column of dates, of numbers with their units or of texts, rows of cells that are none, and
    remarks; an error if there are too many texts or units.
    """
    stamps = moments(cells)
    if stamps is not None:
        lost = np.flatnonzero(np.isnan(stamps[0])).tolist()
        made = Series(series.name, stamps[0], "s", stamps=True)
        return made, lost, [stamps[1]] if stamps[1] else []
    matches = [QUANTITY.fullmatch(cell) for cell in cells]
    units = {match["unit"]: row for row, match in enumerate(matches) if match and match["unit"]}
    if units and 2 * sum(match is not None for match in matches) > sum(map(bool, cells)):
        if len(units) > 1:
            some = (f"{cells[row]!r} in row {table.row_numbers[row]}" for row in units.values())
            raise RecordingError(f"its cells have several units: {first_few(some)}")
        ((unit, row),) = units.items()
        if series.unit and not same_unit(series.unit, unit):
            raise RecordingError(
                f"its heading has the unit {series.unit!r}, and row {table.row_numbers[row]} "
                f"has another one, {cells[row]!r}"
            )
        numbers = [
            match["number"] if match else cell for match, cell in zip(matches, cells, strict=True)
        ]
        mark = thousands or _grouped(numbers, decimal)
        values, lost = numbers_of_cells(numbers, mark, decimal)
        made = replace(series, values=values, unit=series.unit or unit)
        return made, lost, _mark_remark(cells, mark) if thousands is None else []
    if (count := len(set(cells))) > _MOST_TEXTS:
        raise RecordingError(f"it has {count} different texts")
    return series_of_texts(series.name, cells), [], []


def _grouped(cells: Sequence[str], decimal: str) -> str:
    """The mark that parts thousands in a column; empty where none does.

    It is the one that marks no decimals: ``1.520`` after ``980`` where decimals are commas,
    ``1,234.5`` after ``980.2`` where they are points; or ``1.000.000`` in any file.
    """
    written = {cell for cell in cells if cell.lower() not in NO_VALUE}
    mark, grouped = (".", GROUPED_BY_POINTS) if decimal == "," else (",", _GROUPED_BY_COMMAS)
    others = [cell for cell in written if not grouped.fullmatch(cell)]
    if 2 * len(others) < len(written) and any(mark in cell for cell in written - set(others)):
        plain = (cell.replace(decimal, ".") for cell in others)
        if not any(is_number(cell, ".", None) for cell in plain):
            return mark
    twice = any(cell.count(".") > 1 for cell in written)
    return "." if twice and all(map(_THOUSANDS.fullmatch, written)) else ""


def _mark_remark(cells: Sequence[str], mark: str) -> list[str]:
    """Remark on a mark that parts thousands, in a list; empty where none does."""
    some = [cell for cell in cells if mark and mark in cell]
    return [f"{_MARKS[mark]} part thousands, as in {cell!r}" for cell in some[:1]]


#: Lines with a time and the rest: ``10:16:51.123 -> 5.00,152057`` of a serial monitor, and
#: ``rig,bench=1 u=5.0,p=1.2 1669112211000000000`` of InfluxDB.
_APART: Final = (
    re.compile(r"\s*(?P<of>)(?P<time>\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)\s*->\s?(?P<rest>.*)"),
    re.compile(r"(?P<of>[^\s,]+(?:,[^\s,=]+=[^\s,]+)*) (?P<rest>[^\s=]+=\S+) (?P<time>\d{10,19})"),
)
_NUMBER: Final = r"[-+]?(?:\d+(?:[.,]\d+)?|\.\d+)(?:[eE][-+]?\d+)?|nan|ovf|inf|OL|#N/A"
_PAIR: Final = re.compile(
    r"[\s,;|{\"]*(?P<name>[^\W\d](?:[^\s:=,;|{}\"]|[ ](?=\S))*)\"?"
    rf"\s*[:=]\s*(?P<value>{_NUMBER})"
    r"(?:\s*(?P<unit>[A-Za-zµ°%]+))?(?=[\s,;|}]|$)[\s,;|}]*",
    re.IGNORECASE,
)
_MOST: Final = 0.8  # of the lines look so


def _times_apart(lines: Sequence[str], source: str) -> tuple[list[str], list[str]] | None:
    """Times and rests of lines like ``10:16:51.123 -> 5.00,15``; None where most have no time."""
    middle = lines[len(lines) // 2 :][:100]
    for form in _APART:
        if sum(form.fullmatch(line) is not None for line in middle) < _MOST * max(len(middle), 1):
            continue
        found = [match for line in lines if (match := form.fullmatch(line)) is not None]
        other = next((match for match in found if match["of"] != found[0]["of"]), None)
        if other is not None:
            raise RecordingError(
                f"{source}: line {lines.index(other[0]) + 1} is of {other['of']!r}, those before "
                f"it are of {found[0]['of']!r}: write one measurement to a file"
            )
        rests = [re.sub(r"(?<=\d)[iu](?=,|$)", "", match["rest"]) for match in found]
        return [match["time"] for match in found], rests
    return None


def _pairs(line: str) -> list[tuple[str, str, str]] | None:
    """Names, numbers and units of a line that has nothing else."""
    place, found = 0, []
    while place < len(line):
        match = _PAIR.match(line, place)
        if match is None:
            return None
        found.append((match["name"].strip(), match["value"], match["unit"] or ""))
        place = match.end()
    return found


def _labelled_rows(
    lines: Sequence[str], times: Sequence[str] | None, source: str
) -> tuple[list[list[str]], list[str]] | None:
    """Headings and rows of lines like ``t:0.02,u:7.00,p:1.5 bar``, and what was left out; None for
    lines of which most are not so.

    A row ends where a label comes again, and has an empty cell where one is missing. Times that
    stood before an arrow in each line are the first column.
    """
    middle = lines[len(lines) // 2 :][:100]
    if sum(_pairs(line) is not None for line in middle) < _MOST * max(len(middle), 1):
        return None
    found = [_pairs(line) for line in lines]
    columns: dict[str, str] = {}
    for line, pairs in zip(lines, found, strict=True):
        for name, _, unit in pairs or ():
            columns[name] = columns.get(name) or unit
            if unit and not same_unit(columns[name], unit):
                raise RecordingError(
                    f"{source}: line {line[:80]!r} has {name} in {unit!r}, an earlier one in "
                    f"{columns[name]!r}: write one unit for each label"
                )
    place = {name: index for index, name in enumerate(columns)}
    before = ["time"] if times is not None else []
    rows = [[*before, *(f"{name} [{unit}]" if unit else name for name, unit in columns.items())]]
    strange = []
    filled: set[str] = set(columns)  # the first label begins a row
    for number, pairs in enumerate(found, start=1):
        if pairs is None:
            strange.append(number)
        for name, value, _ in pairs or ():
            if name in filled:
                filled.clear()
                rows.append([*(times[number - 1] for _ in before if times), *[""] * len(columns)])
            filled.add(name)
            rows[-1][len(before) + place[name]] = value.replace(",", ".")
    return rows, left_out_rows(strange, "lines without labels and numbers")


def read_json(path: Path, form: TextFormat) -> Log:
    """Read a JSON file.

    Parameters
    ----------
    path : Path
        ``.json``, ``.jsonl`` or ``.ndjson``; ``.gz`` is unpacked.
    form : TextFormat
        Its `columns` hold; the rest JSON says itself.

    Returns
    -------
    Log
        One series for each key; the keys of a path are joined by ``/``.

    Raises
    ------
    RecordingError
        If it is broken, or holds no table.
    """
    text = read_text(path)
    try:
        content = json.loads(text)
    except json.JSONDecodeError:
        lines = enumerate(text.splitlines(), start=1)
        content = [_loaded(path, number, line) for number, line in lines if line.strip()]
    said: list[str] = []
    rows = _rows(content, said)
    if not any(rows):
        raise RecordingError(f"{path}: no table was found: neither a list of records nor columns")
    check_size(len(rows), sum(map(len, rows)), str(path), len(rows[0]))
    body = lines_of_rows([_json_text(each) for each in row] for row in rows)
    return _log_of_lines(path, body, form, ".", said)


def _loaded(path: Path, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: line {number}, column {error.colno}: {error.msg}") from error


def _rows(content: Any, remarks: list[str]) -> list[list[Any]]:
    """Headings and rows of the first table in what was read, without cells where there is none."""
    if isinstance(content, list) and any(isinstance(each, Mapping) for each in content):
        flat = [_flat(each) for each in content if isinstance(each, Mapping)]
        names = list(dict.fromkeys(name for each in flat for name in each))
        return [names, *([each.get(name) for name in names] for each in flat)]
    if isinstance(content, list):
        return content if all(isinstance(each, list) for each in content) else []
    if not isinstance(content, Mapping):
        return []
    inner = [each for each in content.values() if isinstance(each, Mapping)]
    alike = len(inner) == len(content) and all(set(each) == set(inner[0]) for each in inner)
    if alike and not any(isinstance(v, (Mapping, list)) for each in inner for v in each.values()):
        content = {name: list(each.values()) for name, each in content.items()}  # as pandas has it
    lists = {name: each for name, each in _flat(content).items() if isinstance(each, list)}
    for each in filter(None, lists.values()):
        if isinstance(each[0], (Mapping, list)) and any(rows := _rows(each, remarks)):
            heads = content.get("columns")
            return [heads, *rows] if isinstance(heads, list) and rows is each else rows
    counts = [len(each) for each in lists.values() if each]
    usual = max(counts, key=counts.count, default=0)
    others = [f"{name} ({len(each)})" for name, each in lists.items() if len(each) != usual]
    if others:
        remarks.append(f"left out: {', '.join(others)}: the rest have {usual} values each")
    columns = {name: each for name, each in lists.items() if len(each) == usual}
    return [list(columns), *map(list, zip(*columns.values(), strict=True))] if columns else []


def _flat(record: Any, before: str = "") -> dict[str, Any]:
    """Values of a record and of the records in it, by the keys of their paths."""
    if not isinstance(record, Mapping):
        return {before: record}
    found: dict[str, Any] = {}
    for key, value in record.items():
        found |= _flat(value, f"{before}/{key}" if before else str(key))
    return found


def _json_text(value: Any) -> str:
    """A value as a text file has it."""
    if value is None or isinstance(value, str):
        return (value or "").strip()
    return json.dumps(value)


_COMMA: Final = re.compile(r"[-+]?\d+,\d+")
_CELL: Final = re.compile(rb'<(?:\w+:)?(?:c|row)\b[^>]*?\br="([A-Z]{0,7})(\d{1,9})"')
_BLOCK: Final = 1 << 20
_OVERLAP: Final = 400  # bytes of a tag, at most
#: Records of a sheet of Excel 97 that begin with the row and column of a cell.
_OF_CELLS: Final = frozenset((0x06, 0x7E, 0xBD, 0xBE, 0xD6, 0xFD, *range(0x201, 0x206), 0x27E))


def read_sheets(path: Path, form: TextFormat) -> Log:
    """Read a workbook.

    Parameters
    ----------
    path : Path
        ``.xlsx``, ``.xlsm`` or ``.xls``.
    form : TextFormat
        Its `columns`, `header` and `thousands` hold for every sheet.

    Returns
    -------
    Log
        One series for each column; ``sheet/column`` where several sheets hold a table.

    Raises
    ------
    RecordingError
        If no sheet holds a table, or the workbook has more than can be read.
    """
    tables: dict[str, Log] = {}
    unread: dict[str, str] = {}
    for name, cells in _sheets(path).items():
        rows, commas = _texts(cells)
        said = [f"numbers that are texts with a decimal comma: {commas}, read"] if commas else []
        try:
            tables[name] = _log_of_lines(path, lines_of_rows(rows), form, ".", said)
        except RecordingError as error:
            unread[f"sheet {name}"] = str(error).removeprefix(f"{path}: ")
    found: list[Series] = []
    remarks: list[str] = []
    for name, log in tables.items():
        before = f"{name}/" if len(tables) > 1 else ""
        found += [replace(item, name=before + item.name) for item in log.series.values()]
        unread |= {before + key: why for key, why in log.unread.items()}
        remarks += [before + text for text in log.remarks]
    log = collected(path, found, unread, remarks)
    return replace(log, tables=tuple(f"{name}/" for name in tables) if len(tables) > 1 else ())


def _sheets(path: Path) -> dict[str, list[list[Any]]]:
    """Cells of all sheets; what is too large for memory is refused before it is unpacked."""
    from python_calamine import CalamineWorkbook

    data = read_file(path)
    if zipfile.is_zipfile(io.BytesIO(data)):
        _check_packed(path, data)
    else:
        _check_records(path, data)
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        return {name: book.get_sheet_by_name(name).to_python() for name in book.sheet_names}
    except BaseException as error:  # a panic of its Rust is no Exception
        if isinstance(error, (KeyboardInterrupt, MemoryError)):
            raise
        raise RecordingError(f"{path}: cannot be read ({str(error)[:200]})") from error


def _check_packed(path: Path, data: bytes) -> None:
    """Refuse a workbook that unpacks to more than is read, or whose sheets have far cells."""
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        total = sum(item.file_size for item in packed.infolist())
        if total > MOST_BYTES:
            raise RecordingError(
                f"{path}: unpacked it has {total >> 20} MB; at most {MOST_BYTES >> 20} MB are read"
            )
        for item in packed.infolist():
            if item.filename.startswith("xl/worksheets/") and item.filename.endswith(".xml"):
                columns, last, left, rest = {b""}, 0, MOST_BYTES, b""
                with packed.open(item) as stream:
                    while left > 0 and (block := stream.read(_BLOCK)):
                        left -= len(block)
                        for column, row in _CELL.findall(rest + block):
                            columns.add(column)
                            last = max(last, int(row))
                        rest = block[-_OVERLAP:]
                width = max(map(_column_number, columns))
                check_size(last, last * width, f"{path}: {item.filename}")


def _column_number(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - 64
    return number


def _check_records(path: Path, data: bytes) -> None:
    """Refuse a workbook of Excel 97 whose sheets have cells that are far out."""
    rows, columns = 0, 0
    for stream in _streams(data):
        place = 0
        while place + 4 <= len(stream):
            kind, size = struct.unpack_from("<HH", stream, place)
            if kind in _OF_CELLS and size >= 4 and place + 8 <= len(stream):
                row, column = struct.unpack_from("<HH", stream, place + 4)
                rows, columns = max(rows, row + 1), max(columns, column + 1)
            place += 4 + size
    check_size(rows, rows * columns, str(path))


def _streams(data: bytes) -> list[bytes]:
    """Streams of a compound file that are named like a workbook; else the bytes themselves."""
    if data[:8] != bytes.fromhex("d0cf11e0a1b11ae1") or len(data) < 512:
        return [data]
    shift = struct.unpack_from("<H", data, 30)[0]
    size = 1 << min(shift, 16)
    blocks = [data[at : at + size] for at in range(size, len(data), size)]
    listed = struct.unpack_from("<109I", data, 76)
    table = b"".join(blocks[block] for block in listed if block < len(blocks))
    following = struct.unpack(f"<{len(table) // 4}I", table[: len(table) // 4 * 4])

    def chain(block: int) -> bytes:
        found, seen = [], 0
        while block < len(blocks) and block < len(following) and seen <= len(blocks):
            found.append(blocks[block])
            block, seen = following[block], seen + 1
        return b"".join(found)

    folder = chain(struct.unpack_from("<I", data, 48)[0])
    streams = []
    for at in range(0, len(folder) - 127, 128):
        name = folder[at : at + 64].decode("utf-16-le", errors="replace").split("\0")[0]
        if name in ("Workbook", "Book"):
            streams.append(chain(struct.unpack_from("<I", folder, at + 116)[0]))
    return streams


def _texts(cells: list[list[Any]]) -> tuple[list[list[str]], int]:
    """Cells as texts, and how many were texts of numbers with a decimal comma."""
    commas = 0
    rows = []
    for row in cells:
        texts = [_cell_text(cell) for cell in row]
        for place, text in enumerate(texts):
            if isinstance(row[place], str) and _COMMA.fullmatch(text):
                texts[place] = text.replace(",", ".")
                commas += 1
        rows.append(texts)
    return rows, commas


def _cell_text(cell: Any) -> str:
    """A cell as a text file has it."""
    if isinstance(cell, bool):
        return str(int(cell))
    if isinstance(cell, datetime):
        return f"{cell:%Y-%m-%d %H:%M:%S.%f}"
    if isinstance(cell, date):
        return f"{cell:%Y-%m-%d} 00:00:00"
    if isinstance(cell, time):
        return f"{cell:%H:%M:%S.%f}"
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    return cell.strip() if isinstance(cell, str) else repr(cell)
