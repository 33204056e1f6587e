"""The reader of text tables: bytes in, rows of one width and columns of numbers out.

Whole blocks of rows are parsed by NumPy; only blocks with a cell that is no number are taken apart
cell by cell. Empty cells and the usual words for "no value" become NaN. Which columns are what is
for those who call it.

The dialect of a text is what separates its cells and which mark its numbers have.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs._files import MOST_SIZE, read_file
from pamrs.errors import RecordingError
from pamrs.recordings._clock import is_moment
from pamrs.recordings._gate import check_size

NO_VALUE = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "+inf"})
#: Endings of files that are read as text; each may be packed (``.gz``).
TEXT: Final = (".csv", ".tsv", ".txt", ".dat", "")
_PART: Final = "\x1f"  # is between cells that were quoted, or are no text of a file
_BLOCK: Final = 2000  # rows that are parsed together
_CUT: Final = 20  # one row in so many may be cut short


class Lines(NamedTuple):
    """Rows of a text.

    Attributes
    ----------
    lines : list of str
        One for each row.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    numbers : sequence of int
        Number of each in the file, from 1, as an editor counts.
    """

    lines: list[str]
    delimiter: str
    numbers: Sequence[int]

    def rows(self, start: int = 0, stop: int | None = None) -> list[list[str]]:
        """Cells of some rows, without blanks around them."""
        return [[cell.strip() for cell in self.parted(line)] for line in self.lines[start:stop]]

    def parted(self, line: str) -> list[str]:
        """Cells of one row."""
        return line.split() if self.delimiter == " " else line.split(self.delimiter)

    def widths(self) -> list[int]:
        """Number of cells of each row."""
        if self.delimiter == " ":
            return [len(line.split()) for line in self.lines]
        return [line.count(self.delimiter) + 1 for line in self.lines]

    def only(self, places: Sequence[int]) -> Lines:
        """Some of the rows."""
        if len(places) == len(self.lines):
            return self
        return Lines(
            [self.lines[i] for i in places], self.delimiter, [self.numbers[i] for i in places]
        )

    def after(self, count: int) -> Lines:
        """The rows below the first ones."""
        return Lines(self.lines[count:], self.delimiter, self.numbers[count:])


class Table:
    """Columns of a file.

    Parameters
    ----------
    header : list of str or None
        The file's own headings, None when it has none.
    body : Lines or sequence of columns
        Rows of one width; for files that are no text the cells or numbers of each column.
    remarks : sequence of str
        Rows that were left out, and why.
    """

    def __init__(
        self,
        header: list[str] | None,
        body: Lines | Sequence[Sequence[str] | Array],
        remarks: Sequence[str] = (),
    ) -> None:
        self.header = header
        self.remarks = list(remarks)
        self._lines = body if isinstance(body, Lines) else None
        self._columns: dict[int, Sequence[str] | Array] = {}
        self._matrices: dict[str, _Matrix] = {}
        if isinstance(body, Lines):
            self.row_numbers = body.numbers
            self.width = len(body.parted(body.lines[0])) if body.lines else 0
        else:
            self._columns = dict(enumerate(body))
            self.width = len(body)
            self.row_numbers = range(2, 2 + len(body[0]))

    def cells(self, index: int) -> Sequence[str] | Array:
        """Column ``index`` as the file has it: texts, or numbers where it is no text file."""
        if index not in self._columns and self._lines is not None:
            part = self._lines.parted
            self._columns[index] = [part(line)[index].strip() for line in self._lines.lines]
        return self._columns[index]

    def cell(self, index: int, row: int) -> str:
        """One cell of a column."""
        if index in self._columns or self._lines is None:
            return str(self.cells(index)[row])
        return self._lines.parted(self._lines.lines[row])[index].strip()

    def read(self, index: int, thousands: str | None, decimal: str) -> tuple[Array, list[int]]:
        """Numbers of column ``index``.

        Parameters
        ----------
        index : int
            Which column.
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
        if thousands is None and self._lines is not None:
            if decimal not in self._matrices:
                self._matrices[decimal] = _matrix(self._lines, decimal, self.width)
            matrix = self._matrices[decimal]
            if index not in matrix.whole:
                return matrix.values[index], matrix.strange[index]
        cells = self.cells(index)
        if isinstance(cells, np.ndarray):
            return cells, []
        return numbers_of_cells(cells, thousands, decimal)

    def doubtful(self, index: int, decimal: str) -> bool:
        """True where only all cells of a column together show the format of its numbers."""
        matrix = self._matrices.get(decimal)
        return matrix is not None and index in matrix.whole

    def strange_cells(self, index: int, rows: Sequence[int]) -> list[str]:
        """Remark on cells of a column that are no numbers, in a list; empty where there are none:
        ``3 cells are no numbers ('OL', '#N/A'): taken as missing, the first in row 7``.
        """
        if not rows:
            return []
        some = first_few(dict.fromkeys(repr(self.cell(index, row)[:20]) for row in rows))
        count = "1 cell is no number" if len(rows) == 1 else f"{len(rows)} cells are no numbers"
        first = f"{'the first ' * (len(rows) > 1)}in row {self.row_numbers[rows[0]]}"
        return [f"{count} ({some}): taken as missing, {first}"]

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
        values, strange = self.read(index, thousands, decimal)
        if thousands is None and decimal == "," and self.doubtful(index, decimal):
            pointed = [cell for cell in map(str, self.cells(index)) if "." in cell]
            if pointed:
                raise RecordingError(
                    f"{source}: column {label!r}: {pointed[0]!r} has a point and decimal is ',': "
                    "give thousands = '.' if it parts thousands, decimal = '.' if it does not"
                )
        if not strange:
            return values, ""
        cells = [self.cell(index, row) for row in strange]
        hint = _number_hint(cells[0], thousands, decimal)
        if len(strange) > len(values) // (20 if hint else 5):
            self.numbers(index, label, source, thousands, decimal)  # says which
        return values, self.strange_cells(index, strange)[0]

    def numbers(
        self, index: int, label: str, source: str, thousands: str | None, decimal: str
    ) -> Array:
        """Column ``index`` as numbers, NaN where it has no value.

        Raises
        ------
        RecordingError
            If a cell is not a number; the message names column, row and cell.
        """
        values, strange = self.read(index, thousands, decimal)
        if strange:
            row, text = self.row_numbers[strange[0]], self.cell(index, strange[0])
            raise RecordingError(
                f"{source}: column {label!r}, row {row}: {text[:40]!r} is not a number"
                + _number_hint(text, thousands, decimal)
            )
        return values


class _Matrix(NamedTuple):
    """Numbers of all columns, rows of each that are no numbers, and columns read as a whole."""

    values: Array
    strange: list[list[int]]
    whole: set[int]


def _matrix(body: Lines, decimal: str, width: int) -> _Matrix:
    values = np.full((width, len(body.lines)), math.nan)
    strange: list[list[int]] = [[] for _ in range(width)]
    whole: set[int] = set()
    for start in range(0, len(body.lines), _BLOCK):
        wanted = [index for index in range(width) if index not in whole]
        lines = body.lines[start : start + _BLOCK]
        stop = start + len(lines)
        parsed = _parsed(lines, body.delimiter, decimal, wanted if whole else None)
        if parsed is not None and parsed.shape[1] == len(wanted):
            values[wanted, start:stop] = parsed.T
            continue
        columns = list(zip(*map(body.parted, lines), strict=True))
        for index in wanted:
            own, odd = numbers_of_cells(columns[index], None, decimal)
            values[index, start:stop] = own
            strange[index] += [start + row for row in odd]
            pointed = decimal == "," and any("." in cell for cell in columns[index])
            if pointed or 2 * len(odd) > len(lines):
                whole.add(index)
    values[~(np.abs(values) < MOST_SIZE)] = math.nan
    return _Matrix(values, strange, whole)


def _parsed(
    lines: list[str], delimiter: str, decimal: str, columns: list[int] | None
) -> Array | None:
    """Rows of nothing but numbers, parsed by NumPy; None where a cell is no number or ambiguous."""
    text = "\n".join(lines)
    if "_" in text:  # no digits of a number, whatever Python says
        return None
    if decimal != ".":
        if "." in text:  # points may part thousands
            return None
        lines = text.replace(decimal, ".").split("\n")
    mark = None if delimiter == " " else delimiter
    try:
        values = np.loadtxt(lines, delimiter=mark, ndmin=2, comments=None, usecols=columns)
    except ValueError:
        return None
    return values if len(values) == len(lines) else None


def numbers_of_cells(
    cells: Sequence[str], thousands: str | None, decimal: str
) -> tuple[Array, list[int]]:
    """Numbers of cells, NaN where there is none, and the places of those that are no numbers."""
    plain = [cell.replace(thousands, "") for cell in cells] if thousands else cells
    if decimal != ".":
        plain = [cell.replace(decimal, ".") for cell in plain]
    strange: list[int] = []
    try:
        if any("_" in cell for cell in plain):
            raise ValueError("an underscore is no part of a number")
        values = np.array(plain, dtype=np.float64)
    except ValueError:
        values = np.full(len(plain), math.nan)
        for row, cell in enumerate(plain):
            try:
                values[row] = float(cell.replace("_", "?"))
            except ValueError:
                if cell.strip().lower() not in NO_VALUE:
                    strange.append(row)
    values[~(np.abs(values) < MOST_SIZE)] = math.nan
    return values, strange


def first_few(texts: Iterable[str], most: int = 4) -> str:
    """The first of some texts, parted by commas, and how many more there are."""
    words = list(texts)
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + more


def left_out_rows(numbers: Sequence[int], what: str) -> list[str]:
    """Remark on rows that are left out, in a list; empty where there are none."""
    if not numbers:
        return []
    return [f"{what}: {len(numbers)} (first: row {numbers[0]}), left out"]


def _number_hint(text: str, thousands: str | None, decimal: str) -> str:
    if decimal == "." and "," in text:
        return " (give decimal=',' if the comma is the decimal mark)"
    if thousands is None and text.count(".") > 1:
        return " (give thousands='.' for this column if the point marks thousands)"
    return ""


def is_text(path: Path) -> bool:
    """True where a file is read as text, by its ending; the others are logs of their own kinds."""
    ending = path.with_suffix("").suffix if path.suffix.lower() == ".gz" else path.suffix
    return ending.lower() in TEXT


def stem_of(path: Path) -> str:
    """Name of a file without its last ending and without ``.gz``."""
    return path.name.removesuffix(".gz").rpartition(".")[0] or path.name.removesuffix(".gz")


def read_text(path: Path) -> str:
    """Text of a file, unpacked.

    Parameters
    ----------
    path : Path
        The file; ``.gz`` is unpacked.

    Returns
    -------
    str
        By its mark of byte order, by its zero bytes, as UTF-8, or as Windows writes it.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable, empty or no text.
    """
    try:
        data = read_file(path, packed=path.suffix.lower() == ".gz")
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{path}: cannot be read ({reason})") from error
    encoding = "utf-8-sig"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif data[1:400:2].count(0) > len(data[1:400:2]) // 2:
        encoding = "utf-16-le"
    elif data[0:400:2].count(0) > len(data[0:400:2]) // 2:
        encoding = "utf-16-be"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "\x00" in text:
        raise RecordingError(f"{path}: not a text file (it has zero bytes)")
    if not text.strip():
        raise RecordingError(f"{path}: the file is empty")
    return text


def lines_of(text: str, delimiter: str, source: str, comments: tuple[str, ...] = ()) -> Lines:
    """Rows of a text, without empty ones.

    Parameters
    ----------
    text : str
        All of it.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    source : str
        The file, for messages.
    comments : tuple of str
        Beginnings of lines that are no rows.

    Returns
    -------
    Lines
        Cells in quotes may hold the delimiter; what parts them then is another mark.

    Raises
    ------
    RecordingError
        If there are more than are read.
    """
    count = text.count("\n") + 1
    marks = 0 if delimiter == " " else text.count(delimiter)
    width = 1 + text[: text.find("\n") % (len(text) + 1)].count(delimiter)
    check_size(count, count + marks, source, width)
    lines = text.splitlines()
    if '"' in text and delimiter != " ":
        kept = (
            "" if comments and line.lstrip().startswith(comments) else f"{line}\n" for line in lines
        )
        reader = csv.reader(kept, delimiter=delimiter)
        rows = ((reader.line_num, row) for row in reader)
        try:
            return joined_rows((number, row) for number, row in rows if any(map(str.strip, row)))
        except csv.Error as error:
            raise RecordingError(
                f"{source}: a quote that is opened in row {reader.line_num + 1} or before is not "
                f"closed ({error})"
            ) from error
    blank = f"{delimiter} \t"
    places = [
        number
        for number, line in enumerate(lines)
        if line.strip(blank) and not (comments and line.lstrip().startswith(comments))
    ]
    if len(places) == len(lines):
        return Lines(lines, delimiter, range(1, len(lines) + 1))
    return Lines([lines[i] for i in places], delimiter, [i + 1 for i in places])


def lines_of_rows(rows: Iterable[Sequence[str]]) -> Lines:
    """Rows whose cells are parted already, as of a sheet; without empty ones."""
    return joined_rows((number, row) for number, row in enumerate(rows, start=1) if any(row))


def joined_rows(rows: Iterable[tuple[int, Sequence[str]]]) -> Lines:
    """Rows whose cells are parted already, each with its number in the file."""
    lines, numbers = [], []
    for number, row in rows:
        lines.append(_PART.join(" ".join(cell.split("\n")) for cell in row))
        numbers.append(number)
    return Lines(lines, _PART, numbers)


def split_rows(text: str, delimiter: str) -> list[list[str]]:
    """Cells of each row; ``" "`` means any run of blanks."""
    if delimiter == " ":
        return [line.split() for line in text.splitlines()]
    if '"' in text:
        try:
            return list(csv.reader(text.splitlines(), delimiter=delimiter))
        except csv.Error as error:
            raise RecordingError(f"a quote that is opened is not closed ({error})") from error
    return [line.split(delimiter) for line in text.splitlines()]


def usual_width(widths: Sequence[int]) -> int:
    """Number of cells that most rows have; 0 where there are no rows."""
    return max(set(widths), key=widths.count) if widths else 0


def same_width(
    body: Lines, width: int, headings: Sequence[Sequence[str]], source: str, *, strict: bool
) -> tuple[Lines, list[int], list[str]]:
    """Rows of one width, without those that repeat the headings.

    Parameters
    ----------
    body : Lines
        Rows below the headings.
    width : int
        How many cells each has.
    headings : sequence of sequence of str
        The rows above them, as far as they are headings.
    source : str
        The file, for messages.
    strict : bool
        Whether many rows that are shorter are an error; else their last cells are empty, as
        programs write that end a row with its last value.

    Returns
    -------
    rows : Lines
        Those that are left.
    part : list of int
        How often the headings came again before each of them; empty where they never did.
    remarks : list of str
        What was left out.

    Raises
    ------
    RecordingError
        If `strict` and more than one row in twenty has another width.
    """
    counts = body.widths()
    heads = [list(row) for row in headings if row and row[0]]
    first = tuple({row[0] for row in heads})
    again = [
        place
        for place, line in enumerate(body.lines)
        if first and line.lstrip(" \t").startswith(first)
        if [cell.strip() for cell in body.parted(line)] in heads
    ]
    repeated = set(again)
    short = [i for i, count in enumerate(counts) if count < width and i not in repeated]
    wide = [i for i, count in enumerate(counts) if count > width and i not in repeated]
    odd = sorted([*short, *wide])
    many = max(1, len(counts) // _CUT)
    if strict and len(odd) > many:
        above = f" as the first row has, {headings[0][0][:60]!r}, ..." if headings else ""
        reasons = {
            ",": " (commas cannot both part the cells and mark the decimals)",
            " ": " (a heading with a blank in it counts as two cells: write time[s])",
        }
        raise RecordingError(
            f"{source}: {len(odd)} of {len(counts)} rows do not have {width} cells{above}: row "
            f"{body.numbers[odd[0]]} has {counts[odd[0]]} with the delimiter {body.delimiter!r}"
            f"{reasons.get(body.delimiter, '')}. The first row must hold the headings; give "
            "delimiter and decimal, like delimiter = ';' and decimal = ','"
        )
    if len(short) > many:
        padded = list(body.lines)
        for place in short:
            blank = " nan" if body.delimiter == " " else body.delimiter
            padded[place] += blank * (width - counts[place])
        body, short = Lines(padded, body.delimiter, body.numbers), []
    remarks = []
    for gone, what in (
        (short, f"rows with fewer than {width} cells"),
        (wide, f"rows with more than {width} cells"),
        (again, "rows that repeat the headings, where a recording starts again"),
    ):
        remarks += left_out_rows([body.numbers[i] for i in gone], what)
    left = {*again, *wide, *short}
    places = [i for i in range(len(counts)) if i not in left] if left else range(len(counts))
    part = np.searchsorted(again, places).tolist() if again else []
    return body.only(places), part, remarks


def read_table(path: Path, *, delimiter: str, header: bool) -> Table:
    """Read a text file whose first row has the headings, or which has none.

    Parameters
    ----------
    path : Path
        The file.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    header : bool
        Whether the first row has the headings.

    Returns
    -------
    Table
        The columns.

    Raises
    ------
    RecordingError
        If the file is missing, unreadable, empty or has no rows.
    """
    source = str(path)
    body = lines_of(read_text(path), delimiter, source)
    headings = body.rows(0, 1) if header else []
    body = body.after(len(headings))
    if not body.lines:
        raise RecordingError(f"{source}: a header without rows")
    width = len(headings[0]) if headings else usual_width(body.widths())
    body, _, remarks = same_width(body, width, headings, source, strict=True)
    if not body.lines:
        raise RecordingError(f"{source}: no row has {width} cells")
    return Table(headings[0] if headings else None, body, remarks)


def renamed(table: Table, columns: Any, source: str) -> list[Any]:
    """Headings of the columns: the file's own, or those that the caller gives for them.

    Parameters
    ----------
    table : Table
        The columns.
    columns : mapping, sequence or None
        From headings of the file, or one for each column; None for the file's own.
    source : str
        The file, for messages.

    Returns
    -------
    list
        One for each column.

    Raises
    ------
    RecordingError
        If it names a heading that is not there, or not as many as there are columns.
    """
    given = table.header or []
    if columns is None:
        return list(given)
    if isinstance(columns, str) or not isinstance(columns, (Mapping, Sequence)):
        raise RecordingError(
            f"{source}: columns = {columns!r} is not allowed: a table from headings to headings, "
            "or a list of one for each column"
        )
    if isinstance(columns, Mapping):
        for key in columns:
            if key not in given:
                raise RecordingError(f"{source}: columns names {key!r}, but {has(key, given)}")
        return [columns.get(heading, heading) for heading in given]
    if len(columns) != table.width:
        raise RecordingError(
            f"{source}: columns lists {len(columns)} headings, but there are {table.width} columns"
        )
    return list(columns)


def has(name: str, header: Sequence[str]) -> str:
    """Headings that a file has, as words, with the nearest one to a heading that it lacks."""
    plain = name.strip().lower()
    near = [heading for heading in header if plain and heading.lower().startswith(plain)]
    near = near or difflib.get_close_matches(name, header, n=1, cutoff=0.6)
    return f"the file has: {', '.join(header)}" + (f"; did you mean {near[0]!r}?" if near else "")


def thousands_of(thousands: str | Mapping[str, str] | None, name: str) -> str | None:
    """The thousands mark of one column: ``thousands`` is one mark for all, or one for each name."""
    if thousands is None or isinstance(thousands, str):
        return thousands
    return thousands.get(name)


_PAIRS: Final = tuple((mark, decimal) for mark in ("\t", ";", ",", "|", " ") for decimal in ".,")
_LINES: Final = 400  # in which the dialect is looked for
#: Numbers next to others whose decimal mark is the comma: points part thousands.
GROUPED_BY_POINTS: Final = re.compile(r"[-+]?(?:[1-9]\d{0,2}(?:\.\d{3})+|\d{1,3})(?:,\d+)?")
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
        return GROUPED_BY_POINTS.fullmatch(cell) is not None
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
