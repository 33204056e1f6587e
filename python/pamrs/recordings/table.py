"""Reads the table of a recording: text or Parquet in, columns of numbers out.

Nothing is judged here but whether a cell is a number; empty cells and the usual words for "no
value" become NaN.
"""

from __future__ import annotations

import csv
import importlib
import io
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs._files import MOST_BYTES, read_file
from pamrs.errors import RecordingError

__all__ = ["NO_VALUE", "Table", "check_size", "is_text", "read_table", "read_text", "split_rows"]

Array = NDArray[np.float64]

MOST_ROWS: Final = 5_000_000
"""Rows of a table."""
MOST_CELLS: Final = 20_000_000
"""Cells of a table."""
NO_VALUE = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "+inf"})
_TEXT = (".csv", ".tsv", ".txt", ".dat", "")


class Table:
    """Raw columns of a file.

    Parameters
    ----------
    header : list of str or None
        The file's own headings, None when it has none.
    cells : sequence of columns
        For text files the cells of each column, for others numbers.
    row_numbers : list of int
        Number of each row (from 1, as an editor counts them; the header and blank rows count).
    ragged : list of int
        Row numbers with too few or too many cells.
    """

    def __init__(
        self,
        header: list[str] | None,
        cells: Sequence[Sequence[str] | Array],
        row_numbers: list[int],
        ragged: list[int],
    ) -> None:
        self.header = header
        self.cells = cells
        self.row_numbers = row_numbers
        self.ragged = ragged

    def numbers(
        self, index: int, label: str, source: str, thousands: str | None, decimal: str
    ) -> Array:
        """Column ``index`` as numbers, NaN where it has no value.

        Raises
        ------
        RecordingError
            If a cell is not a number; the message names column, row and cell.
        """
        cells = self.cells[index]
        if isinstance(cells, np.ndarray):
            return cells
        if thousands:
            cells = [cell.replace(thousands, "") for cell in cells]
        if decimal != ".":
            cells = [cell.replace(decimal, ".") for cell in cells]
        try:
            return np.array(cells, dtype=np.float64)
        except ValueError:
            pass
        values = np.empty(len(cells))
        for row, cell in enumerate(cells):
            text = cell.strip()
            try:
                values[row] = math.nan if text.lower() in NO_VALUE else float(text)
            except ValueError:
                raise RecordingError(
                    (
                        f"{source}: column {label!r}, row {self.row_numbers[row]}: {text[:40]!r} "
                        "is not a number"
                    )
                    + _number_hint(text, thousands, decimal)
                ) from None
        return values


def _number_hint(text: str, thousands: str | None, decimal: str) -> str:
    if decimal == "." and "," in text:
        return " (give decimal=',' if the comma is the decimal mark)"
    if thousands is None and text.count(".") > 1:
        return " (give thousands='.' for this column if the point marks thousands)"
    return ""


def read_table(path: Path, *, delimiter: str, header: bool) -> Table:
    """Read the table of one file.

    Parameters
    ----------
    path : Path
        The file; the ending tells the format.
    delimiter : str
        What separates cells in text files; ``" "`` means any run of blanks.
    header : bool
        Whether the first row of a text file has the headings.

    Returns
    -------
    Table
        The columns.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable, empty or has no rows.
    """
    if not is_text(path):
        return _READERS[path.suffix.lower()](path)
    return _parse(read_text(path), str(path), delimiter, header)


def is_text(path: Path) -> bool:
    """Whether a file is read as text, by its ending; the other kinds have a reader of their own."""
    return path.suffix.lower() not in _READERS


def read_text(path: Path) -> str:
    """Text of a file, unpacked.

    Parameters
    ----------
    path : Path
        The file; the ending tells the format.

    Returns
    -------
    str
        What is in it.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable or no text in UTF-8.
    """
    packed = path.suffix == ".gz"
    ending = (path.with_suffix("").suffix if packed else path.suffix).lower()
    if ending not in _TEXT:
        raise RecordingError(
            f"{path}: the format {ending!r} is not read here; readable are {_READABLE}"
        )
    try:
        raw = read_file(path, packed=packed)
        wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
        text = raw.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        raise RecordingError(
            f"{path}: not a text file in UTF-8; readable are {_READABLE}"
        ) from None
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})"
        ) from error
    if "\x00" in text:
        raise RecordingError(
            f"{path}: not a text file (it has zero bytes); readable are {_READABLE}"
        )
    return text


def check_size(rows: int, cells: int, source: str) -> None:
    """Refuse tables that no memory holds."""
    for count, most, what in ((rows, MOST_ROWS, "rows"), (cells, MOST_CELLS, "cells")):
        if count > most:
            raise RecordingError(
                f"{source}: about {count} {what}; at most {most} are read: cut it into parts, or "
                "keep only the rows and columns that are needed"
            )


def _parse(text: str, source: str, delimiter: str, header: bool) -> Table:
    lines = text.count("\n") + 1
    check_size(lines, lines + (text.count(delimiter) if delimiter != " " else 0), source)
    rows, numbers = [], []
    for number, row in enumerate(split_rows(text, delimiter), start=1):
        if any(cell.strip() for cell in row):
            rows.append(row)
            numbers.append(number)
    if not rows:
        raise RecordingError(f"{source}: the file is empty")
    headings = [cell.strip() for cell in rows.pop(0)] if header else None
    numbers = numbers[int(header) :]
    if not rows:
        raise RecordingError(f"{source}: a header without rows")
    width = len(headings) if headings is not None else _usual_width(rows)
    ragged = []
    for index, row in enumerate(rows):
        if len(row) != width:
            ragged.append(numbers[index])
            rows[index] = (row + [""] * width)[:width] if len(row) < width else [""] * width
    if len(ragged) > max(1, len(rows) // 20):
        raise RecordingError(
            f"{source}: {len(ragged)} of {len(rows)} rows do not have {width} cells (first: row "
            f"{ragged[0]}, delimiter {delimiter!r})"
        )
    return Table(headings, list(zip(*rows, strict=True)), numbers, ragged)


def split_rows(text: str, delimiter: str) -> list[list[str]]:
    """Cells of each row; ``" "`` means any run of blanks."""
    if delimiter == " ":
        return [line.split() for line in text.splitlines()]
    if '"' in text:
        return list(csv.reader(io.StringIO(text), delimiter=delimiter))
    return [line.split(delimiter) for line in text.splitlines()]


def _usual_width(rows: list[list[str]]) -> int:
    widths = [len(row) for row in rows]
    return max(set(widths), key=widths.count)


def _parquet_size(path: Path) -> tuple[int, int]:
    """Rows and cells by the file's own account; none where pyarrow is missing or cannot tell."""
    try:
        told = importlib.import_module("pyarrow.parquet").read_metadata(path)
    except Exception:  # what is wrong with the file is said when it is read
        return 0, 0
    return int(told.num_rows), int(told.num_rows) * int(told.num_columns)


def _parquet(path: Path) -> Table:
    if not path.is_file():
        what = "it is not a regular file" if path.exists() else "no such file"
        raise RecordingError(f"{path}: cannot be read ({what})")
    if path.stat().st_size > MOST_BYTES:
        raise RecordingError(f"{path}: more than {MOST_BYTES >> 20} MB, and at most that is read")
    try:
        import pandas as pd
    except ImportError as error:
        raise RecordingError(
            f"{path}: Parquet needs pandas and pyarrow: pip install 'pamrs[io]' pyarrow"
        ) from error
    try:
        check_size(*_parquet_size(path), str(path))
        frame = pd.read_parquet(path)
    except RecordingError:
        raise
    except Exception as error:  # each engine has its own kinds for a broken file
        raise RecordingError(f"{path}: cannot be read ({error})") from error
    columns = []
    for place, name in enumerate(frame.columns):
        try:
            columns.append(np.asarray(frame.iloc[:, place], dtype=np.float64))
        except (TypeError, ValueError) as error:
            raise RecordingError(
                f"{path}: column {str(name)!r} does not hold numbers only ({error})"
            ) from error
    if not len(frame):
        raise RecordingError(f"{path}: a header without rows")
    return Table([str(name) for name in frame.columns], columns, list(range(1, len(frame) + 1)), [])


_READERS: Final[dict[str, Callable[[Path], Table]]] = {".parquet": _parquet}
"""Reader of each ending whose files are not text: a new kind is one function and its entry here."""
_READABLE: Final = (
    f"{', '.join(ending for ending in _TEXT if ending)} (each also .gz) and {', '.join(_READERS)}; "
    "other logs with the key channels (pamrs import LOG writes it)"
)


def thousands_of(thousands: str | Mapping[str, str] | None, name: str) -> str | None:
    """The thousands mark of one column: ``thousands`` is one mark for all, or one for each name."""
    if thousands is None or isinstance(thousands, str):
        return thousands
    return thousands.get(name)
