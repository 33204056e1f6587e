"""Workbooks of Excel by calamine: each sheet that holds a table."""

from __future__ import annotations

import io
import re
import struct
import zipfile
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Final

from pamrs._files import MOST_BYTES, read_file
from pamrs.errors import RecordingError
from pamrs.recordings._gate import check_size
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected
from pamrs.recordings.logs._text import log_of_lines
from pamrs.recordings.table import lines_of_rows

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
            tables[name] = log_of_lines(path, lines_of_rows(rows), form, ".", said)
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
        texts = [_text(cell) for cell in row]
        for place, text in enumerate(texts):
            if isinstance(row[place], str) and _COMMA.fullmatch(text):
                texts[place] = text.replace(",", ".")
                commas += 1
        rows.append(texts)
    return rows, commas


def _text(cell: Any) -> str:
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
