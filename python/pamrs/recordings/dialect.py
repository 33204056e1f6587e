"""Tells from a text what separates the cells of its rows and which mark its numbers have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from pamrs.errors import RecordingError
from pamrs.recordings._dates import is_moment
from pamrs.recordings.table import NO_VALUE, split_rows, usual_width

_PAIRS: Final = tuple((mark, decimal) for mark in ("\t", ";", ",", "|", " ") for decimal in ".,")
_LINES: Final = 400  # in which the dialect is looked for
#: Numbers beside others whose decimal mark is the comma: points part thousands.
BESIDE_COMMAS: Final = re.compile(r"[-+]?(?:[1-9]\d{0,2}(?:\.\d{3})+|\d{1,3})(?:,\d+)?")
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?(\d+\.\d*|\.\d+)([eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")  # 1,234: a thousand, or one and a bit
#: A number with its unit in one cell: ``2.31 bar``.
QUANTITY: Final = re.compile(
    r"(?P<number>[-+]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][-+]?\d+)?)\s?(?P<unit>(?:[A-Za-z°µ%][^\s,;|]{0,9})?)"
)
_GIVE: Final = "in the .toml description or to load_force_map"


class Dialect(NamedTuple):
    """Separator of the cells of a text table, and its decimal mark."""

    delimiter: str
    decimal: str


def check_marks(delimiter: str | None, decimal: str | None, source: str) -> None:
    """Refuse marks that separate no cells or mark no decimals.

    Raises
    ------
    RecordingError
        Naming the argument, its value and what is allowed.
    """
    if delimiter is not None and len(delimiter) != 1:
        raise RecordingError(
            f"{source}: delimiter = {delimiter!r} is not allowed: one character is needed, like "
            "',' or ';' or '\\t' (tabulator)"
        )
    if decimal not in (None, ".", ","):
        raise RecordingError(
            f"{source}: decimal = {decimal!r} is not allowed: '.' or ',' is needed"
        )


def is_number(cell: str, decimal: str, thousands: str | None) -> bool:
    """True where a cell is a number in a dialect."""
    cell = cell.replace(thousands, "") if thousands else cell
    if decimal == "," and "." in cell:
        return BESIDE_COMMAS.fullmatch(cell) is not None
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return True


def is_useful(cell: str, decimal: str, thousands: str | None) -> bool:
    """True where a cell is a number, perhaps with a unit, a date or a time of day."""
    match = QUANTITY.fullmatch(cell)
    number = match["number"] if match else cell
    return is_number(number, decimal, thousands) or is_moment(cell)


def dialect_of(
    lines: Sequence[str],
    source: str,
    delimiter: str | None = None,
    decimal: str | None = None,
    thousands: str | None = None,
) -> Dialect:
    """Delimiter and decimal mark with which most cells of the middle of a text are numbers.

    Parameters
    ----------
    lines : sequence of str
        Rows with something in them.
    source : str
        The file, for messages.
    delimiter, decimal, thousands : str, optional
        What is given.

    Returns
    -------
    Dialect

    Raises
    ------
    RecordingError
        If there are no numbers in any.
    """
    middle = len(lines) // 2
    sample = "\n".join(lines[middle : middle + _LINES])
    best: tuple[float, Dialect] = (0.0, Dialect(delimiter or ",", decimal or "."))
    for mark, point in _PAIRS:
        if delimiter not in (None, mark) or decimal not in (None, point):
            continue
        if mark == "," and point == "," and '"' not in sample:
            continue
        if point == "," and decimal is None and "," not in sample:
            continue
        rows = [[cell.strip() for cell in row] for row in split_rows(sample, mark)]
        if not rows:
            continue
        cells = [cell for row in rows for cell in row if cell.lower() not in NO_VALUE]
        good = sum(is_useful(cell, point, thousands) for cell in cells)
        usual = usual_width([len(row) for row in rows])
        share = (good / max(len(cells), 1)) * sum(len(row) == usual for row in rows) / len(rows)
        score = share + (0.2 if usual > 1 else 0.0) * (share > 0.0)
        if score > best[0] + 1e-9:
            best = score, Dialect(mark, point)
    if best[0] <= 0.0:
        raise RecordingError(
            f"{source}: no table of numbers was found: cells cannot be told apart; give delimiter "
            "and decimal, like delimiter = ';' and decimal = ','"
        )
    return best[1]


def decimal_of(columns: Iterable[Sequence[str]], source: str) -> str:
    """Decimal mark of measured columns: the comma if numbers are written with it, else the point.

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
