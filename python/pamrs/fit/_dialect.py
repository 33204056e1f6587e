"""Tells from the text of a table what separates its cells and which mark its numbers have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from pamrs.errors import RecordingError
from pamrs.recordings.table import split_rows

__all__ = ["decimal_of", "delimiter_of"]

_DELIMITERS: Final = (
    "\t;,| "  # the blank stands for any run of blanks; a decimal comma makes ";" likelier than ","
)
_LINES: Final = 500  # of a long table
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?(\d+\.\d*|\.\d+)([eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")  # 1,234: a thousand, or one and a bit
_GIVE: Final = "in the .toml description or to load_force_map"


def delimiter_of(text: str, source: str) -> str:
    """What separates the cells: the mark with which nearly all rows have as many cells as the
    header, two at least.

    Parameters
    ----------
    text : str
        The table with its header.
    source : str
        The file, for the message.

    Returns
    -------
    str
        A tabulator, semicolon, comma, bar, or a blank for runs of blanks.

    Raises
    ------
    RecordingError
        If no mark does.
    """
    numbered = [
        (number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()
    ][:_LINES]
    if len(numbered) < 2:
        return ","  # there is no table, which the reader says
    numbers, lines = zip(*numbered, strict=True)
    widths = {
        mark: [len(row) for row in split_rows("\n".join(lines), mark)] for mark in _DELIMITERS
    }
    for mark, (header, *rows) in widths.items():
        odd = sum(width != header for width in rows)
        if header > 1 and odd <= max(1, len(rows) // 20) and 2 * odd < len(rows):
            return mark
    widest = max(_DELIMITERS.strip(" "), key=lambda mark: widths[mark][0])
    header, *rows = widths[widest]
    if header == 1:
        what = (
            f"the first row, {lines[0].strip()[:60]!r}, is not parted by tabulators, semicolons or "
            "commas"
        )
    else:
        row = next(i for i, width in enumerate(rows) if width != header)
        what = (
            f"with the delimiter {widest!r} the header has {header} cells, row {numbers[row + 1]} "
            f"has {rows[row]}"
        )
        what += (
            " (commas cannot both part the cells and mark the decimals)" if widest == "," else ""
        )
    raise RecordingError(
        f"{source}: cells cannot be told apart: {what}. The first row must hold the headings; "
        f"give delimiter and decimal {_GIVE}, like delimiter = ';' and decimal = ','"
    )


def decimal_of(columns: Iterable[Sequence[str]], source: str) -> str:
    """Decimal mark of the measured columns: the comma if numbers are written with it, else the
    point.

    Parameters
    ----------
    columns : iterable of sequences of str
        Their cells.
    source : str
        The file, for the message.

    Returns
    -------
    str
        ``","`` or ``"."``.

    Raises
    ------
    RecordingError
        If both marks are there, or the commas may part thousands.
    """
    cells = [cell.strip() for column in columns for cell in column]
    commas = [cell for cell in cells if "," in cell]
    if not commas:
        return "."
    for cell in commas:
        if cell.count(",") + cell.count(".") > 1 and re.fullmatch(r"[+-]?\d[\d.,]*", cell):
            raise RecordingError(
                f"{source}: {cell!r} has a mark between thousands: write numbers with the decimal "
                "mark only"
            )
    marked = [cell for cell in commas if _COMMA.fullmatch(cell)]
    pointed = [cell for cell in cells if _POINT.fullmatch(cell)]
    if marked and pointed:
        raise RecordingError(
            f"{source}: {marked[0]!r} and {pointed[0]!r}: which mark is the decimal one? Write all "
            f"numbers with the same, or give decimal (and delimiter) {_GIVE}"
        )
    whole = [cell for cell in cells if re.fullmatch(r"[+-]?\d+", cell)]
    if marked and whole and all(_GROUPED.fullmatch(cell) for cell in marked):
        raise RecordingError(
            f"{source}: {marked[0]!r} and {whole[0]!r}: does the comma mark decimals or "
            f"thousands? For decimals give decimal = ',' {_GIVE}; thousands must be written "
            "without a mark"
        )
    return "," if marked else "."
