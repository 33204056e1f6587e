"""Text logs in every dialect: encoding, comments, headings, units and decimals are found out."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from pamrs.errors import RecordingError
from pamrs.recordings._dates import is_moment, moments
from pamrs.recordings.dialect import BESIDE_COMMAS, Dialect, dialect_of, is_number, is_useful
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected, series_of_texts
from pamrs.recordings.logs._words import split_heading, understood_unit, unwrapped
from pamrs.recordings.table import (
    NO_VALUE,
    Lines,
    Table,
    lines_of,
    lines_of_rows,
    read_text,
    same_width,
    split_rows,
    told_cells,
    told_rows,
    usual_width,
)

_COMMENTS: Final = ("#", "%", "//", "'")
_UNNAMED: Final = "column "
_LINES: Final = 400  # in the middle of a table, which tell how it is written
_HEAD: Final = 5000  # rows above the table, at most
_BEGUN: Final = 20  # rows of an earlier run that may stand above the headings
_MOST_TEXTS: Final = 1000  # different texts of a column that can name pieces
_MARKS: Final = {".": "points", ",": "commas"}
_BESIDE_POINTS = re.compile(r"[-+]?(?:[1-9]\d{0,2}(?:,\d{3})+|\d{1,3})(?:\.\d+)?")
_THOUSANDS = re.compile(r"[-+]?(\d{1,3}(\.\d{3})+|0)")


class _Headed(NamedTuple):
    """First row and width of a table, with the names and units from the rows above it."""

    first: int
    width: int
    names: list[str]
    units: list[str]
    rows: list[list[str]]  # headings and units, as they stand in the file
    remarks: list[str]


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
    lines = [line for line in text.splitlines() if line.strip()]
    times: list[str] | None = None
    remarks: list[str] = []
    if form.delimiter is None:
        apart = arrows_apart(lines)
        if apart is not None:
            lost = len(lines) - len(apart[0])
            remarks = [f"lines without a time and an arrow: {lost}, left out"] if lost else []
            times, lines = apart
        labelled = labelled_rows(lines, times)
        if labelled is not None:
            rows = lines_of_rows(labelled[0])
            return log_of_lines(path, rows, form, ".", [*remarks, *labelled[1]])
    kept = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    dialect = dialect_of(kept, source, form.delimiter, form.decimal, form.thousands)
    if times is not None:
        text = "\n".join(f"{a}{dialect.delimiter}{b}" for a, b in zip(times, lines, strict=True))
    if dialect.delimiter == " ":  # a unit belongs to the word before it
        text = re.sub(r"[^\S\n]+\[", "[", text)
        lines = [re.sub(r"\s+\[", "[", line) for line in lines]
    comment = _last_comment(lines, dialect)
    body = lines_of(text, dialect.delimiter, source, _COMMENTS)
    return log_of_lines(path, body, form, dialect.decimal, remarks, comment)


def log_of_lines(
    path: Path,
    body: Lines,
    form: TextFormat,
    decimal: str,
    remarks: Sequence[str] = (),
    comment: list[str] | None = None,
) -> Log:
    """The log of a table, with what stands above it.

    Parameters
    ----------
    path : Path
        The file.
    body : Lines
        Its rows.
    form : TextFormat
        What is given of it.
    decimal : str
        Decimal mark.
    remarks : sequence of str
        What was said of it before.
    comment : list of str, optional
        Headings that stand in a comment.

    Returns
    -------
    Log

    Raises
    ------
    RecordingError
        If it is no table of numbers.
    """
    middle = len(body.lines) // 2
    sample = body.rows(middle, middle + _LINES)
    above = _headed(path, body.rows(0, _HEAD), sample, decimal, form, comment)
    rows = body.after(above.first)
    if len(rows.lines) < 2:
        raise RecordingError(
            f"{path}: no table was found: it has {len(rows.lines)} rows of numbers"
        )
    rows, part, said = same_width(rows, above.width, above.rows, str(path), strict=False)
    table = Table(above.names, rows)
    said = [*remarks, *above.remarks, *said]
    found: list[Series] = []
    unread: dict[str, str] = {}
    for place, unit in enumerate(above.units):
        _column(table, place, unit, decimal, form.thousands, found, unread, said)
    if part:
        found.append(Series("part", 1.0 + np.array(part) - part[0]))
    return collected(path, found, unread, said)


def _headed(
    path: Path,
    head: list[list[str]],
    middle: list[list[str]],
    decimal: str,
    form: TextFormat,
    comment: list[str] | None,
) -> _Headed:
    """Read names and units of the columns from the rows above the numbers of a table."""
    first, width = _first_row(head, middle, decimal, form)
    if comment is not None and not (len(comment) == width and width > 1):
        comment = None
    above = head[:first]
    names, units, used = _headings(above, width, form, comment)
    remarks = []
    if form.columns is not None:
        if len(form.columns) != width:
            raise RecordingError(
                f"{path}: columns lists {len(form.columns)} names, but there are {width} columns"
            )
        names, units = _named(list(form.columns))
    over = len(above) - len(used)
    if over > 0 and any(used):
        remarks.append(f"lines above the headings: {over}, not read")
    return _Headed(first, width, names, units, used, remarks)


def _first_row(
    head: list[list[str]], middle: list[list[str]], decimal: str, form: TextFormat
) -> tuple[int, int]:
    """Index of the first row of numbers, and how many columns there are."""
    width = usual_width([len(row) for row in middle])

    def useful(row: list[str]) -> int:
        return sum(is_useful(cell, decimal, form.thousands) for cell in row)

    typical = sorted(map(useful, middle))[len(middle) // 2] if middle else 0
    for index, row in enumerate(head):
        if width / 2 < len(row) <= width and useful(row) >= max(1, (typical + 1) // 2):
            if form.header is None:
                index += _begun_before(head[index : index + _BEGUN], width, useful)
            return (max(index, 1) if form.header else index), width
    return 0, width


def _begun_before(rows: list[list[str]], width: int, useful: Callable[[list[str]], int]) -> int:
    """Rows up to and with headings below a logger's last run; 0 where there are none."""
    last = 0
    for place, row in enumerate(rows):
        if len(row) == width > 1 and all(row) and useful(row) == 0 and len(set(row)) == width:
            last = place + 1
        elif last:
            break
    return last


def _last_comment(lines: list[str], dialect: Dialect) -> list[str] | None:
    """The last comment above the numbers: it may hold the headings, ``# t; p1``."""
    for line in reversed(lines[:200]):
        if line.lstrip().startswith(_COMMENTS):
            rows = split_rows(line.lstrip().lstrip("#%/'"), dialect.delimiter)
            cells = [cell.strip() for cell in rows[0]] if rows else []
            if not any(is_number(cell, dialect.decimal, None) for cell in cells):
                return cells
    return None


def _headings(
    above: list[list[str]], width: int, form: TextFormat, comment: list[str] | None
) -> tuple[list[str], list[str], list[list[str]]]:
    """Names and units from the rows above the numbers, and those rows."""
    full = [row for row in above if len(row) in (width, width + 1) or 2 * len(row) > width > 2]
    if form.header is False or not (full or comment):
        return [f"{_UNNAMED}{i + 1}" for i in range(width)], [""] * width, []
    full = full or [comment or []]
    used = full[-1:]
    last = [unwrapped(cell) for cell in full[-1]]
    units = [""] * width
    if len(full) > 1 and _all_units(last):
        units = ([*last, *[""] * width])[:width]
        used = full[-2:]
    headings = ["time" if is_moment(cell) else cell for cell in used[0]]
    named, inside = _named(([*headings, *[""] * width])[:width])
    return named, [a if a and a != "-" else b for a, b in zip(units, inside, strict=True)], used


def _all_units(cells: list[str]) -> bool:
    """True where more than half of the cells of a row that have a text are known units."""
    said = [cell for cell in cells if cell not in ("", "-", "1", "%")]
    return 2 * sum(understood_unit(cell) is not None for cell in said) > len(said)


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
            remarks += [f"{name}: {told_cells(odd)}"] if odd else []
            found.append(Series(name, values, unit))
            return
    cells = [str(cell) for cell in table.cells(place)]
    if not any(cells):  # as every row of some programs ends with a delimiter
        if not name.startswith(_UNNAMED):
            unread[name] = "it is empty"
        return
    if thousands is None and (mark := _grouped(cells, decimal)):
        remarks.append(f"{name}: {_MARKS[mark]} part thousands, as in {_example(cells, mark)!r}")
        values, strange = table.read(place, mark, decimal)
    filled = sum(map(bool, cells))
    if 2 * len(strange) < filled:
        if strange:
            remarks.append(f"{name}: {told_cells([cells[row] for row in strange])}")
        found.append(Series(name, values, unit))
        return
    stamps = moments(cells)
    if stamps is not None:
        lost = [cell for cell, value in zip(cells, stamps[0], strict=True) if np.isnan(value)]
        remarks += [f"{name}: {told_cells(lost)}"] if lost else []
        remarks += [f"{name}: {stamps[1]}"] if stamps[1] else []
        found.append(Series(name, stamps[0], "s", stamps=True))
        return
    if (count := len(set(cells))) > _MOST_TEXTS:
        unread[name] = f"it has {count} different texts"
        return
    found.append(series_of_texts(name, cells))


def _grouped(cells: Sequence[str], decimal: str) -> str:
    """The mark that parts thousands in a column; empty where none does.

    It is the one that marks no decimals: ``1.520`` after ``980`` where decimals are commas,
    ``1,234.5`` after ``980.2`` where they are points; or ``1.000.000`` in any file.
    """
    told = {cell for cell in cells if cell.lower() not in NO_VALUE}
    mark, grouped = (".", BESIDE_COMMAS) if decimal == "," else (",", _BESIDE_POINTS)
    others = [cell for cell in told if not grouped.fullmatch(cell)]
    if 2 * len(others) < len(told) and any(mark in cell for cell in told - set(others)):
        plain = (cell.replace(decimal, ".") for cell in others)
        if not any(is_number(cell, ".", None) for cell in plain):
            return mark
    twice = any(cell.count(".") > 1 for cell in told)
    return "." if twice and all(map(_THOUSANDS.fullmatch, told)) else ""


def _example(cells: Sequence[str], mark: str) -> str:
    return next(cell for cell in cells if mark in cell)


_ARROW: Final = re.compile(r"\s*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)\s*->\s?(.*)")
_NUMBER: Final = r"[-+]?(?:\d+(?:[.,]\d+)?|\.\d+)(?:[eE][-+]?\d+)?|nan|ovf|inf|OL|#N/A"
_PAIR: Final = re.compile(
    r"[\s,;|{\"]*(?P<name>[^\W\d](?:[^\s:=,;|{}\"]|[ ](?=\S))*)\"?"
    rf"\s*[:=]\s*(?P<value>{_NUMBER})"
    r"(?:\s*(?P<unit>[A-Za-zµ°%]+))?(?=[\s,;|}]|$)[\s,;|}]*",
    re.IGNORECASE,
)
_MOST: Final = 0.8  # of the lines look so


def arrows_apart(lines: Sequence[str]) -> tuple[list[str], list[str]] | None:
    """Split lines like ``10:16:51.123 -> 5.00,152057`` at the arrow.

    Parameters
    ----------
    lines : sequence of str
        All lines.

    Returns
    -------
    times, rests : list of str
        Of the lines that have an arrow; None where most have none.
    """
    middle = lines[len(lines) // 2 :][:100]
    if sum(_ARROW.fullmatch(line) is not None for line in middle) < _MOST * max(len(middle), 1):
        return None
    found = [match for line in lines if (match := _ARROW.fullmatch(line)) is not None]
    return [match[1] for match in found], [match[2] for match in found]


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


def labelled_rows(
    lines: Sequence[str], times: Sequence[str] | None
) -> tuple[list[list[str]], list[str]] | None:
    """Rows of lines like ``t:0.02,u:7.00,p:1.5 bar``.

    Parameters
    ----------
    lines : sequence of str
        All lines.
    times : sequence of str, optional
        What stood before the arrow of each; the first column then.

    Returns
    -------
    rows : list of list of str
        Headings, then rows, each of which ends where a label comes again; empty where a label is
        missing.
    remarks : list of str
        What was left out.
    None where most lines are not so.
    """
    middle = lines[len(lines) // 2 :][:100]
    if sum(_pairs(line) is not None for line in middle) < _MOST * max(len(middle), 1):
        return None
    found = [_pairs(line) for line in lines]
    columns: dict[str, str] = {}
    for pairs in found:
        for name, _, unit in pairs or ():
            columns[name] = columns.get(name) or unit
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
    return rows, told_rows(strange, "lines without labels and numbers")
