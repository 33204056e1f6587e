"""Text logs in every dialect: encoding, comments, headings, units and decimals are found out."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from pamrs._files import read_file
from pamrs.errors import RecordingError
from pamrs.recordings.logs._log import Array, Log, Series, TextFormat, collected
from pamrs.recordings.logs._words import split_heading, understood_unit
from pamrs.recordings.table import NO_VALUE, split_rows

__all__ = ["read_text_log"]

_COMMENTS: Final = ("#", "%", "//", "'")
_PAIRS: Final = tuple((mark, decimal) for mark in ("\t", ";", ",", "|", " ") for decimal in ".,")
_UNNAMED: Final = "column "
_LINES: Final = 400  # in which the dialect is looked for
_HEAD: Final = 5000  # rows above the table, at most
_MOST_TEXTS: Final = 1000  # different texts of a column that can name pieces
_THOUSANDS = re.compile(r"[-+]?(\d{1,3}(\.\d{3})+|0)")
_CLOCK = re.compile(
    r"(?:(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[ T]+)?"
    r"(?P<rest>\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:Z|[+-]\d{2}:?\d{2})?)"
)


class _Dialect(NamedTuple):
    delimiter: str
    decimal: str


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
    kept = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    dialect = _dialect(kept, form, path)
    if dialect.delimiter == " ":  # a unit belongs to the word before it
        lines, kept = ([re.sub(r"\s+\[", "[", line) for line in some] for some in (lines, kept))
    rows = [_stripped(row) for row in split_rows("\n".join(kept), dialect.delimiter)]
    rows = [row for row in rows if any(cell.strip() for cell in row)]
    first, width = _first_row(rows, dialect, form)
    if len(rows) - first < 2:
        raise RecordingError(
            f"{path}: no table was found: it has {len(rows) - first} rows of numbers"
        )
    names, units = _headings(rows[:first], width, form, _last_comment(lines, dialect, width))
    if form.columns is not None:
        if len(form.columns) != width:
            raise RecordingError(
                f"{path}: columns lists {len(form.columns)} names, but there are {width} columns"
            )
        names, units = _named(list(form.columns))
    body = [(row + [""] * width)[:width] for row in rows[first:] if len(row) <= width]
    found: list[Series] = []
    unread: dict[str, str] = {}
    if len(rows) - first - len(body):
        unread["rows"] = f"{len(rows) - first - len(body)} rows have more than {width} cells"
    for place, cells in enumerate(zip(*body, strict=True)):
        _column(names[place], units[place], cells, dialect, form.thousands, found, unread)
    return collected(path, found, unread)


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
        return False
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return True


def _useful(cell: str, decimal: str, thousands: str | None) -> bool:
    return _is_number(cell, decimal, thousands) or _CLOCK.fullmatch(cell) is not None


def _dialect(lines: list[str], form: TextFormat, path: Path) -> _Dialect:
    """Delimiter and decimal mark with which most cells of the middle of the file are numbers."""
    middle = len(lines) // 2
    sample = "\n".join(lines[middle : middle + _LINES])
    best: tuple[float, _Dialect] = (0.0, _Dialect(form.delimiter or ",", form.decimal or "."))
    for mark, decimal in _PAIRS:
        if form.delimiter not in (None, mark) or form.decimal not in (None, decimal):
            continue
        if mark == "," and decimal == ",":
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


def _first_row(rows: list[list[str]], dialect: _Dialect, form: TextFormat) -> tuple[int, int]:
    """Index of the first row of numbers, and how many columns there are."""
    middle = rows[len(rows) // 2 :][:_LINES]
    width = _usual(middle)

    def useful(row: list[str]) -> int:
        return sum(_useful(cell, dialect.decimal, form.thousands) for cell in row)

    typical = sorted(map(useful, middle))[len(middle) // 2]
    for index, row in enumerate(rows[:_HEAD]):
        if width / 2 < len(row) <= width and useful(row) >= max(1, (typical + 1) // 2):
            return (max(index, 1) if form.header else index), width
    return 0, width


def _last_comment(lines: list[str], dialect: _Dialect, width: int) -> list[str] | None:
    """Headings that stand in a comment, ``# t; p1``."""
    for line in reversed(lines[:200]):
        if line.lstrip().startswith(_COMMENTS):
            cells = _stripped(split_rows(line.lstrip().lstrip("#%/'"), dialect.delimiter)[0])
            if len(cells) == width and width > 1:
                return cells
    return None


def _headings(
    above: list[list[str]], width: int, form: TextFormat, comment: list[str] | None
) -> tuple[list[str], list[str]]:
    """Names and units out of the rows above the numbers: headings, and perhaps a row of units."""
    full = [row for row in above if len(row) in (width, width + 1) or 2 * len(row) > width > 2]
    if form.header is False or not (full or comment):
        return [f"{_UNNAMED}{i + 1}" for i in range(width)], [""] * width
    full = full or [comment or []]
    last = [cell.strip("[]() ") for cell in full[-1]]
    units = [""] * width
    if len(full) > 1 and _all_units(last):
        units = ([*last, *[""] * width])[:width]
        full.pop()
    named, inside = _named(([*full[-1], *[""] * width])[:width])
    return named, [a if a and a != "-" else b for a, b in zip(units, inside, strict=True)]


def _all_units(cells: list[str]) -> bool:
    said = [cell for cell in cells if cell not in ("", "-", "1", "%")]
    return bool(said) and all(understood_unit(cell) for cell in said)


def _named(headings: list[str]) -> tuple[list[str], list[str]]:
    pairs = [split_heading(heading.strip('"')) for heading in headings]
    names = [name or f"{_UNNAMED}{i + 1}" for i, (name, _) in enumerate(pairs)]
    return names, [unit for _, unit in pairs]


def _column(
    name: str,
    unit: str,
    cells: tuple[str, ...],
    dialect: _Dialect,
    thousands: str | None,
    found: list[Series],
    unread: dict[str, str],
) -> None:
    """Add one column to what was found, or say why it is not."""
    if not any(cells):  # as every row of some programs ends with a delimiter
        if not name.startswith(_UNNAMED):
            unread[name] = "it is empty"
        return
    values, strange = _numbers(cells, dialect.decimal, thousands)
    if strange and thousands is None and _grouped(cells):
        values, strange = _numbers(cells, dialect.decimal, ".")
    if not strange:
        found.append(Series(name, values, unit))
        return
    stamps = _stamps(cells)
    if stamps is not None:
        found.append(Series(name, stamps, "s"))
        return
    if 2 * len(strange) < len(cells):
        row = strange[0]
        unread[name] = f"in row {row + 1} of the numbers {cells[row][:40]!r} is not a number"
        return
    labels = tuple(dict.fromkeys(cells))
    if len(labels) > _MOST_TEXTS:
        unread[name] = f"it has {len(labels)} different texts"
        return
    place = {label: float(i) for i, label in enumerate(labels)}
    found.append(Series(name, np.array([place[cell] for cell in cells]), "", None, labels))


def _numbers(cells: Sequence[str], decimal: str, thousands: str | None) -> tuple[Array, list[int]]:
    """Values, NaN where there is none, and the rows whose cells are no number."""
    plain = [cell.replace(thousands, "") for cell in cells] if thousands else list(cells)
    if decimal == ",":
        plain = [cell.replace(",", ".") for cell in plain]
    strange: list[int] = []
    try:
        values = np.array(plain, dtype=np.float64)
    except ValueError:
        values = np.full(len(plain), math.nan)
        for row, cell in enumerate(plain):
            if cell.lower() not in NO_VALUE:
                try:
                    values[row] = float(cell)
                except ValueError:
                    strange.append(row)
    values[~np.isfinite(values)] = math.nan
    return values, strange


def _grouped(cells: Sequence[str]) -> bool:
    """Whether points part thousands: ``1.000.000`` beside ``900.000``, and no other number."""
    return all(_THOUSANDS.fullmatch(cell) or cell.lower() in NO_VALUE for cell in cells)


def _stamps(cells: Sequence[str]) -> Array | None:
    """Seconds since the first cell if all are times of day or dates with one."""
    seconds = np.empty(len(cells))
    start: datetime | None = None
    days, before = 0, -math.inf
    for row, cell in enumerate(cells):
        moment = _moment(cell)
        if moment is None:
            return None
        start = start or moment
        value = (moment - start).total_seconds()
        if moment.year == 1900 and value + 86400.0 * days < before - 43200.0:
            days += 1  # a clock of times of day ran past midnight
        seconds[row] = before = value + 86400.0 * days
    return seconds


def _moment(cell: str) -> datetime | None:
    match = _CLOCK.fullmatch(cell)
    if match is None:
        return None
    date, rest = match["date"] or "1900-01-01", match["rest"].replace(",", ".").strip()
    parts = re.split(r"[-./]", date)
    if len(parts[0]) != 4:  # 12.05.2024: day first, month first only with slashes
        parts = [parts[2], parts[0], parts[1]] if "/" in date else [parts[2], parts[1], parts[0]]
    hour = rest if rest[1] != ":" else "0" + rest
    try:
        year, month, day = (int(part) for part in parts)
        return datetime.fromisoformat(f"{year:04d}-{month:02d}-{day:02d}T{hour}").replace(
            tzinfo=None
        )
    except ValueError:
        return None
