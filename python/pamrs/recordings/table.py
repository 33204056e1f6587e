"""Reads the table of a recording: text or Parquet in, columns of numbers out.

Nothing is judged here but whether a cell is a number; empty cells and the usual words for "no
value" become NaN.
"""

from __future__ import annotations

import csv
import io
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs._files import MOST_BYTES, MOST_SIZE, read_file
from pamrs.errors import RecordingError
from pamrs.recordings._gate import admit_arrow, check_size

__all__ = [
    "NO_VALUE",
    "Table",
    "is_text",
    "numbers_in",
    "numbers_of_cells",
    "read_table",
    "read_text",
    "split_rows",
    "told_cells",
    "told_rows",
]

Array = NDArray[np.float64]

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
    remarks : list of str
        Rows that were left out, and why.
    """

    def __init__(
        self,
        header: list[str] | None,
        cells: Sequence[Sequence[str] | Array],
        row_numbers: Sequence[int],
        remarks: list[str],
    ) -> None:
        self.header = header
        self.cells = cells
        self.row_numbers = row_numbers
        self.remarks = remarks

    def samples(
        self, index: int, label: str, source: str, thousands: str | None, decimal: str
    ) -> tuple[Array, str]:
        """Column ``index`` as samples, in which a cell that is no number is a missing one.

        Returns
        -------
        values : (n,) array
            NaN where there is none.
        remark : str
            Which cells are no numbers; empty where there are none.

        Raises
        ------
        RecordingError
            If too many are none: the column is written in another way, or is another one.
        """
        cells = self.cells[index]
        if isinstance(cells, np.ndarray):
            return cells, ""
        values, strange = numbers_of_cells(cells, thousands, decimal)
        if not strange:
            return values, ""
        hint = _number_hint(cells[strange[0]], thousands, decimal)
        if len(strange) > len(cells) // (20 if hint else 5):
            self.numbers(index, label, source, thousands, decimal)  # says which
        return values, told_cells([cells[row] for row in strange])

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
        values, strange = numbers_of_cells(cells, thousands, decimal)
        for row in strange:
            text = cells[row].strip()
            raise RecordingError(
                f"{source}: column {label!r}, row {self.row_numbers[row]}: {text[:40]!r} is not a "
                "number" + _number_hint(text, thousands, decimal)
            )
        return values


def numbers_of_cells(
    cells: Sequence[str], thousands: str | None, decimal: str
) -> tuple[Array, list[int]]:
    """Numbers of cells.

    Parameters
    ----------
    cells : sequence of str
        As they stand in the file.
    thousands : str or None
        Mark between groups of digits.
    decimal : str
        Decimal mark.

    Returns
    -------
    values : (n,) array
        NaN where there is no number.
    strange : list of int
        Rows of cells that are neither a number nor a usual word for none.
    """
    plain = [cell.replace(thousands, "") for cell in cells] if thousands else cells
    if decimal != ".":
        plain = [cell.replace(decimal, ".") for cell in plain]
    strange: list[int] = []
    try:
        values = np.array(plain, dtype=np.float64)
    except ValueError:
        values = np.full(len(plain), math.nan)
        for row, cell in enumerate(plain):
            text = cell.strip()
            if text.lower() not in NO_VALUE:
                try:
                    values[row] = float(text)
                except ValueError:
                    strange.append(row)
    values[~(np.abs(values) < MOST_SIZE)] = math.nan
    return values, strange


def told_cells(cells: Sequence[str]) -> str:
    """What is said of cells that are no numbers: ``3 cells are no numbers ('OL', '#N/A')``."""
    words = list(dict.fromkeys(cell.strip()[:20] for cell in cells))
    some = ", ".join(map(repr, words[:4])) + (" and so on" if len(words) > 4 else "")
    count = "1 cell is no number" if len(cells) == 1 else f"{len(cells)} cells are no numbers"
    return f"{count} ({some}): taken as missing"


def _number_hint(text: str, thousands: str | None, decimal: str) -> str:
    if decimal == "." and "," in text:
        return " (give decimal=',' if the comma is the decimal mark)"
    if thousands is None and text.count(".") > 1:
        return " (give thousands='.' for this column if the point marks thousands)"
    return ""


def read_table(path: Path, *, delimiter: str, header: bool, decimal: str = "") -> Table:
    """Read the table of one file.

    Parameters
    ----------
    path : Path
        The file; the ending tells the format.
    delimiter : str
        What separates cells in text files; ``" "`` means any run of blanks.
    header : bool
        Whether the first row of a text file has the headings.
    decimal : str
        Decimal mark of a file of which only numbers are wanted: then its cells may be numbers.

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
    return _parse(read_text(path), str(path), delimiter, header, decimal)


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


def _parse(text: str, source: str, delimiter: str, header: bool, decimal: str) -> Table:
    lines = text.count("\n") + 1
    marks = 0 if delimiter == " " else text.count(delimiter)
    width = 1 + text[: text.find("\n") % (len(text) + 1)].count(delimiter)
    check_size(lines, lines + marks, source, width)
    quick = _quick(text, delimiter, header, decimal)
    if quick is not None:
        return quick
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
    again = [
        index
        for index, row in enumerate(rows)
        if len(row) == width and headings and [cell.strip() for cell in row] == headings
    ]
    ragged = [index for index, row in enumerate(rows) if len(row) != width]
    if len(ragged) > max(1, len(rows) // 20):
        raise RecordingError(
            f"{source}: {len(ragged)} of {len(rows)} rows do not have {width} cells (first: row "
            f"{numbers[ragged[0]]}, delimiter {delimiter!r})"
        )
    remarks = told_rows([numbers[i] for i in ragged], f"rows that do not have {width} cells")
    remarks += told_rows([numbers[i] for i in again], "rows that repeat the headings")
    gone = {*ragged, *again}
    kept = [index for index in range(len(rows)) if index not in gone]
    if not kept:
        raise RecordingError(f"{source}: no row has {width} cells")
    columns = list(zip(*(rows[index] for index in kept), strict=True))
    return Table(headings, columns, [numbers[index] for index in kept], remarks)


def told_rows(numbers: Sequence[int], what: str) -> list[str]:
    """What is said of rows that are left out: none where there is none."""
    if not numbers:
        return []
    return [f"{what}: {len(numbers)} (first: row {numbers[0]}), left out"]


def _quick(text: str, delimiter: str, header: bool, decimal: str) -> Table | None:
    """A table of nothing but numbers, as NumPy reads it; None if it is not one."""
    if not decimal or '"' in text:
        return None
    heading, _, body = text.partition("\n") if header else ("", "", text)
    values = numbers_in(body.splitlines(), delimiter, decimal)
    headings = [cell.strip() for cell in split_rows(heading, delimiter)[0]] if heading else None
    if values is None or not heading.strip() and header:
        return None
    if headings is not None and len(headings) != len(values):
        return None
    return Table(headings, list(values), range(1 + header, 1 + header + values.shape[1]), [])


def numbers_in(lines: Sequence[str], delimiter: str, decimal: str) -> Array | None:
    """Columns of lines that hold nothing but numbers.

    Parameters
    ----------
    lines : sequence of str
        One for each row.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    decimal : str
        Decimal mark.

    Returns
    -------
    (columns, rows) array or None
        None where a cell is missing or no number, or a line is empty.
    """
    if not lines or not lines[0].strip():
        return None
    if decimal != ".":
        lines = [line.replace(decimal, ".") for line in lines]
    try:
        values = np.loadtxt(
            lines, delimiter=None if delimiter == " " else delimiter, ndmin=2, comments=None
        )
    except ValueError:
        return None
    if len(values) != len(lines) or not values.size:
        return None
    values[~np.isfinite(values)] = math.nan
    return np.ascontiguousarray(values.T)


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
        admit_arrow(path)
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
    return Table([str(name) for name in frame.columns], columns, range(1, len(frame) + 1), [])


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
