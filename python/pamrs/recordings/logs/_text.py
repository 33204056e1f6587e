"""Text logs in every dialect: encoding, comments, headings, units and decimals are found out."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from pamrs._files import read_file
from pamrs.errors import RecordingError
from pamrs.recordings.logs._dates import is_moment, moments
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected
from pamrs.recordings.logs._serial import arrows_apart, labelled_rows
from pamrs.recordings.logs._words import split_heading, understood_unit, unwrapped
from pamrs.recordings.table import (
    NO_VALUE,
    numbers_in,
    numbers_of_cells,
    split_rows,
    told_cells,
    told_rows,
)

__all__ = ["log_of_rows", "read_text_log"]

_COMMENTS: Final = ("#", "%", "//", "'")
_PAIRS: Final = tuple((mark, decimal) for mark in ("\t", ";", ",", "|", " ") for decimal in ".,")
_UNNAMED: Final = "column "
_LINES: Final = 400  # in which the dialect is looked for
_HEAD: Final = 5000  # rows above the table, at most
_BEGUN: Final = 20  # rows of an earlier run that may stand above the headings
_MOST_TEXTS: Final = 1000  # different texts of a column that can name pieces
_CUT: Final = 20  # one row in so many may be cut short; more are rows whose last cells are empty
_BESIDE_COMMAS = re.compile(r"[-+]?(?:[1-9]\d{0,2}(?:\.\d{3})+|\d{1,3})(?:,\d+)?")
_THOUSANDS = re.compile(r"[-+]?(\d{1,3}(\.\d{3})+|0)")


class _Dialect(NamedTuple):
    delimiter: str
    decimal: str


class _Headed(NamedTuple):
    """Where the numbers of a table begin, and what stands above them."""

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
    text = _decoded(_bytes(path), path)
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
            return log_of_rows(path, labelled[0], form, ".", [*remarks, *labelled[1]])
    kept = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    dialect = _dialect(kept, form, path)
    if times is not None:
        kept = [f"{time}{dialect.delimiter}{line}" for time, line in zip(times, lines, strict=True)]
    if dialect.delimiter == " ":  # a unit belongs to the word before it
        lines, kept = ([re.sub(r"\s+\[", "[", line) for line in some] for some in (lines, kept))
    comment = _last_comment(lines, dialect)
    quick = _quick(path, kept, dialect, form, comment)
    if quick is not None:
        return quick
    rows = [_stripped(row) for row in split_rows("\n".join(kept), dialect.delimiter)]
    return log_of_rows(path, rows, form, dialect.decimal, remarks, comment)


def _quick(
    path: Path, lines: list[str], dialect: _Dialect, form: TextFormat, comment: list[str] | None
) -> Log | None:
    """The log of a text that has nothing but numbers below its headings; None if it has more."""
    middle = len(lines) // 2
    if form.thousands is not None or '"' in "".join(lines[:_LINES]):
        return None
    if dialect.decimal == "," and any("." in line for line in lines[len(lines) // 2 :]):
        return None  # points may part thousands
    head, sample = (
        [_stripped(row) for row in split_rows("\n".join(some), dialect.delimiter)]
        for some in (lines[:_HEAD], lines[middle : middle + _LINES])
    )
    if len(head) != len(lines[:_HEAD]) or len(lines) < _LINES:
        return None
    above = _headed(path, head, sample, dialect.decimal, form, comment)
    columns = numbers_in(lines[above.first :], dialect.delimiter, dialect.decimal)
    if columns is None or len(columns) != above.width:
        return None
    found = [
        Series(name, values, unit)
        for name, unit, values in zip(above.names, above.units, columns, strict=True)
    ]
    return collected(path, found, None, above.remarks)


def log_of_rows(
    path: Path,
    rows: list[list[str]],
    form: TextFormat,
    decimal: str,
    remarks: Sequence[str] = (),
    comment: list[str] | None = None,
) -> Log:
    """The log of a table whose cells are texts.

    Parameters
    ----------
    path : Path
        The file.
    rows : list of list of str
        Its cells, without blanks around them.
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
    rows = [row for row in rows if any(row)]
    above = _headed(path, rows[:_HEAD], rows[len(rows) // 2 :][:_LINES], decimal, form, comment)
    first, width = above.first, above.width
    body = rows[first:]
    if len(body) < 2:
        raise RecordingError(f"{path}: no table was found: it has {len(body)} rows of numbers")
    again = [i for i, row in enumerate(body) if row[0] and row in above.rows]
    wide = [i for i, row in enumerate(body) if len(row) > width]
    short = [i for i, row in enumerate(body) if len(row) < width]
    if len(short) > max(1, len(body) // _CUT):
        short = []  # as programs write that end a row with its last value
    said = [*remarks, *above.remarks]
    for gone, what in (
        (short, f"rows with fewer than {width} cells"),
        (wide, f"rows with more than {width} cells"),
        (again, "rows that repeat the headings, where a recording starts again"),
    ):
        said += told_rows([first + 1 + i for i in gone], what)
    left = {*again, *wide, *short}
    kept = [(row + [""] * width)[:width] for i, row in enumerate(body) if i not in left]
    found: list[Series] = []
    unread: dict[str, str] = {}
    for name, unit, cells in zip(above.names, above.units, zip(*kept, strict=True), strict=True):
        _column(name, unit, cells, decimal, form.thousands, found, unread, said)
    if again:
        before = np.cumsum(np.isin(np.arange(len(body)), again))
        part = np.array([before[i] for i in range(len(body)) if i not in left])
        found.append(Series("part", 1.0 + part - part[0]))
    return collected(path, found, unread, said)


def _headed(
    path: Path,
    head: list[list[str]],
    middle: list[list[str]],
    decimal: str,
    form: TextFormat,
    comment: list[str] | None,
) -> _Headed:
    """What stands above the numbers of a table."""
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


def _bytes(path: Path) -> bytes:
    try:
        return read_file(path, packed=path.suffix.lower() == ".gz")
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{path}: cannot be read ({reason})") from error


def _decoded(data: bytes, path: Path) -> str:
    """Text by its mark of byte order, by its zero bytes, as UTF-8, or as Windows writes it."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif data[1:400:2].count(0) > len(data[1:400:2]) // 2:
        encoding = "utf-16-le"
    elif data[0:400:2].count(0) > len(data[0:400:2]) // 2:
        encoding = "utf-16-be"
    else:
        encoding = "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "\x00" in text:
        raise RecordingError(f"{path}: not a text file (it has zero bytes)")
    if not text.strip():
        raise RecordingError(f"{path}: the file is empty")
    return text


def _stripped(row: Sequence[str]) -> list[str]:
    return [cell.strip() for cell in row]


def _is_number(cell: str, decimal: str, thousands: str | None) -> bool:
    cell = cell.replace(thousands, "") if thousands else cell
    if decimal == "," and "." in cell:
        return _BESIDE_COMMAS.fullmatch(cell) is not None
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return True


def _useful(cell: str, decimal: str, thousands: str | None) -> bool:
    return _is_number(cell, decimal, thousands) or is_moment(cell)


def _dialect(lines: list[str], form: TextFormat, path: Path) -> _Dialect:
    """Delimiter and decimal mark with which most cells of the middle of the file are numbers."""
    middle = len(lines) // 2
    sample = "\n".join(lines[middle : middle + _LINES])
    best: tuple[float, _Dialect] = (0.0, _Dialect(form.delimiter or ",", form.decimal or "."))
    for mark, decimal in _PAIRS:
        if form.delimiter not in (None, mark) or form.decimal not in (None, decimal):
            continue
        if mark == "," and decimal == "," and '"' not in sample:
            continue
        if decimal == "," and form.decimal is None and "," not in sample:
            continue
        rows = [_stripped(row) for row in split_rows(sample, mark)]
        cells = [cell for row in rows for cell in row if cell.lower() not in NO_VALUE]
        good = sum(_useful(cell, decimal, form.thousands) for cell in cells)
        usual = _usual(rows)
        share = (good / max(len(cells), 1)) * sum(len(row) == usual for row in rows) / len(rows)
        score = share + (0.2 if usual > 1 else 0.0) * (share > 0.0)
        if score > best[0] + 1e-9:
            best = score, _Dialect(mark, decimal)
    if best[0] <= 0.0:
        raise RecordingError(
            f"{path}: no table of numbers was found; give delimiter and decimal in case.toml"
        )
    return best[1]


def _usual(rows: Sequence[Sequence[str]]) -> int:
    widths = [len(row) for row in rows] or [0]
    return max(set(widths), key=widths.count)


def _first_row(
    head: list[list[str]], middle: list[list[str]], decimal: str, form: TextFormat
) -> tuple[int, int]:
    """Index of the first row of numbers, and how many columns there are."""
    width = _usual(middle)

    def useful(row: list[str]) -> int:
        return sum(_useful(cell, decimal, form.thousands) for cell in row)

    typical = sorted(map(useful, middle))[len(middle) // 2] if middle else 0
    for index, row in enumerate(head):
        if width / 2 < len(row) <= width and useful(row) >= max(1, (typical + 1) // 2):
            if form.header is None:
                index += _begun_before(head[index : index + _BEGUN], width, useful)
            return (max(index, 1) if form.header else index), width
    return 0, width


def _begun_before(rows: list[list[str]], width: int, useful: Callable[[list[str]], int]) -> int:
    """How many rows come before headings that a logger wrote after what was left of its last run,
    with those headings; 0 where there are none.
    """
    last = 0
    for place, row in enumerate(rows):
        if len(row) == width > 1 and all(row) and useful(row) == 0 and len(set(row)) == width:
            last = place + 1
        elif last:
            break
    return last


def _last_comment(lines: list[str], dialect: _Dialect) -> list[str] | None:
    """The last comment above the numbers: it may hold the headings, ``# t; p1``."""
    for line in reversed(lines[:200]):
        if line.lstrip().startswith(_COMMENTS):
            cells = _stripped(split_rows(line.lstrip().lstrip("#%/'"), dialect.delimiter)[0])
            if not any(_is_number(cell, dialect.decimal, None) for cell in cells):
                return cells
    return None


def _headings(
    above: list[list[str]], width: int, form: TextFormat, comment: list[str] | None
) -> tuple[list[str], list[str], list[list[str]]]:
    """Names and units out of the rows above the numbers: headings, and perhaps a row of units; and
    those rows.
    """
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
    """Whether a row is one of units: more than half of what it says are some that are known."""
    said = [cell for cell in cells if cell not in ("", "-", "1", "%")]
    return 2 * sum(understood_unit(cell) is not None for cell in said) > len(said)


def _named(headings: list[str]) -> tuple[list[str], list[str]]:
    pairs = [split_heading(heading.strip('"')) for heading in headings]
    names = [name or f"{_UNNAMED}{i + 1}" for i, (name, _) in enumerate(pairs)]
    return names, [unit for _, unit in pairs]


def _column(
    name: str,
    unit: str,
    cells: Sequence[str],
    decimal: str,
    thousands: str | None,
    found: list[Series],
    unread: dict[str, str],
    remarks: list[str],
) -> None:
    """Add one column to what was found, or say why it is not."""
    if not any(cells):  # as every row of some programs ends with a delimiter
        if not name.startswith(_UNNAMED):
            unread[name] = "it is empty"
        return
    if thousands is None and decimal == "," and _grouped_beside_commas(cells):
        thousands = "."
        remarks.append(f"{name}: points part thousands, as commas are decimals in this file")
    values, strange = numbers_of_cells(cells, thousands, decimal)
    if strange and thousands is None and _grouped(cells):
        values, strange = numbers_of_cells(cells, ".", decimal)
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
    labels = tuple(dict.fromkeys(cells))
    if len(labels) > _MOST_TEXTS:
        unread[name] = f"it has {len(labels)} different texts"
        return
    place = {label: float(i) for i, label in enumerate(labels)}
    found.append(Series(name, np.array([place[cell] for cell in cells]), "", None, labels))


def _grouped(cells: Sequence[str]) -> bool:
    """Whether points part thousands: ``1.000.000`` beside ``900.000``, and no other number."""
    return all(_THOUSANDS.fullmatch(cell) or cell.lower() in NO_VALUE for cell in cells)


def _grouped_beside_commas(cells: Sequence[str]) -> bool:
    """Whether points part thousands where decimals are commas: ``1.520`` after ``980``."""
    return any("." in cell for cell in cells) and all(
        _BESIDE_COMMAS.fullmatch(cell) or cell.lower() in NO_VALUE for cell in cells
    )
