"""Limits on the size that a file claims for itself, checked before it is read or unpacked."""

from __future__ import annotations

import bz2
import io
import math
import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._files import MOST_BYTES, MOST_CELLS, MOST_COLUMNS, MOST_PIECE, MOST_ROWS
from pamrs.errors import RecordingError

_NUMBER: Final = 8
"""Bytes of a number as it is kept."""
_DENSEST: Final = 100
"""Factor by which numbers become smaller when they are packed, at most."""


def check_size(rows: int, cells: int, source: str, columns: int = 0) -> None:
    """Refuse tables that no memory holds.

    Raises
    ------
    RecordingError
        If it is more than is read.
    """
    counts = (
        (rows, MOST_ROWS, "rows"),
        (cells, MOST_CELLS, "cells"),
        (columns, MOST_COLUMNS, "columns"),
    )
    for count, most, what in counts:
        if count > most:
            raise RecordingError(
                f"{source}: about {count} {what}; at most {most} are read: cut it into parts, or "
                "keep only the rows and columns that are needed"
            )


class Gate:
    """Sums what is to be read of one file, and refuses what is too much.

    Parameters
    ----------
    path : Path
        The file, for messages.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows = self._cells = self._columns = 0

    def admit(self, rows: int, columns: int = 1, size: int = 0) -> None:
        """Count a part of the file towards its limits.

        Parameters
        ----------
        rows, columns : int
            What it says that it has.
        size : int, optional
            Bytes that it takes unpacked, where they are more than those of its numbers.

        Raises
        ------
        RecordingError
            If it is too much, together with what was asked for before.
        """
        self._rows = max(self._rows, int(rows))
        self._columns += int(columns)
        self._cells += max(int(rows) * int(columns), -(-int(size) // _NUMBER))
        check_size(self._rows, self._cells, str(self._path), self._columns)

    def admit_array(self, shape: Sequence[int], dtype: np.dtype[Any]) -> None:
        """Count an array towards the limits; samples run along its longest axis."""
        count = math.prod(int(n) for n in shape)
        rows = max((int(n) for n in shape), default=1)
        self.admit(rows, count // rows if rows else 0, count * dtype.itemsize)


def admit_numpy(path: Path) -> None:
    """Ask for a ``.npy`` or ``.npz`` file by the headings of its arrays.

    Raises
    ------
    RecordingError
        If they say too much, or more than there is in the file.
    ValueError, OSError, zipfile.BadZipFile
        If it is broken.
    """
    gate = Gate(path)
    with path.open("rb") as stream:
        if stream.read(2) != b"PK":
            stream.seek(0)
            size = path.stat().st_size
            if _admit_heading(gate, stream) > size:
                raise RecordingError(
                    f"{path}: cut short: its heading says more than the {size} bytes that it has"
                )
            return
    with zipfile.ZipFile(path) as packed:
        for member in packed.infolist():
            with packed.open(member) as stream:
                _admit_heading(gate, stream)


def _admit_heading(gate: Gate, stream: Any) -> int:
    """Count the array whose NumPy heading comes next towards the limits; its size in bytes."""
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0
    if version != (1, 0):
        read = np.lib.format.read_array_header_2_0
    shape, _, dtype = read(stream)
    gate.admit_array(shape, dtype)
    return math.prod(shape) * int(dtype.itemsize)


def admit_matlab(path: Path) -> None:
    """Ask for a MATLAB file of version 5 to 7 by what its parts unpack to.

    Raises
    ------
    RecordingError
        If that is too much.
    """
    gate = Gate(path)
    with path.open("rb") as stream:
        order = {b"IM": "<", b"MI": ">"}.get(stream.read(128)[126:128])
        while order is not None and len(tag := stream.read(8)) == 8:  # noqa: PLR2004
            kind, size = struct.unpack(f"{order}II", tag)
            if kind != _PACKED:
                gate.admit(1, 1, size)
                stream.seek(size, 1)
                continue
            unpacking = zlib.decompressobj()
            while size > 0 and (part := stream.read(min(size, _PIECE))):
                size -= len(part)
                while part:
                    gate.admit(1, 0, len(unpacking.decompress(part, _PIECE)))
                    part = unpacking.unconsumed_tail


_PACKED: Final = 15
"""Kind of a part that is packed by zlib."""
_PIECE: Final = 1 << 20
"""Bytes that are unpacked at a time."""


def admit_arrow(path: Path) -> None:
    """Ask for a Parquet or Feather file by what it says of its rows and columns.

    Raises
    ------
    RecordingError
        If that is too much.
    pyarrow.ArrowException
        If it is broken.
    """
    import pyarrow as pa
    import pyarrow.parquet

    gate = Gate(path)
    if path.suffix.lower() == ".parquet":
        metadata = pyarrow.parquet.read_metadata(path)
        size = sum(metadata.row_group(k).total_byte_size for k in range(metadata.num_row_groups))
        gate.admit(metadata.num_rows, metadata.num_columns, size)
        return
    with pa.memory_map(str(path)) as stream:
        if stream.read(6) != b"ARROW1":
            return  # the first version, which packs nothing
        stream.seek(8)
        reader = pa.ipc.MessageReader.open_stream(stream)
        columns = 1
        for message in iter(reader.read_next_message, None):
            if message.type == "schema":
                columns = max(1, len(pa.ipc.read_schema(message)))
                continue
            if message.type not in ("record batch", "dictionary"):
                return
            heading = message.metadata.to_pybytes()
            gate.admit(_rows_of(heading, nested=message.type == "dictionary"), columns)


def _rows_of(message: bytes, *, nested: bool) -> int:
    """Rows of a batch of Arrow by the heading of its message, without unpacking it.

    A table of FlatBuffers begins with the distance to a list of the places of its fields: that of
    the batch is the third one of the message (and the second one of a dictionary), its length the
    first one of the batch.
    """

    def number(kind: str, at: int) -> int:
        return int(struct.unpack_from(f"<{kind}", message, at)[0])

    def field(table: int, index: int) -> int:
        places = table - number("i", table)
        return table + number("H", places + 4 + 2 * index)

    def inside(at: int) -> int:
        return at + number("I", at)

    batch = inside(field(inside(0), 2))
    if nested:
        batch = inside(field(batch, 1))
    return number("q", field(batch, 0))


class Unpacking:
    """Unpacks the parts of a bag (zstd, lz4, bzip2), and refuses what no memory holds whatever
    their headings say.

    Parameters
    ----------
    path : Path
        The bag, for messages.
    size : int
        Its bytes: all parts together may unpack to a hundred times as many, or half a gigabyte.
    """

    def __init__(self, path: Path, size: int) -> None:
        self._path, self._left = path, MOST_BYTES + _DENSEST * size

    def __call__(self, data: bytes, most: int = MOST_PIECE) -> bytes:
        """Unpack a part.

        Parameters
        ----------
        data : bytes
            As it is in the bag; what is not packed stays as it is.
        most : int
            Bytes that it may have unpacked.

        Raises
        ------
        RecordingError
            If it has more, alone or together with those before it.
        """
        opened = _unpacked(data)
        if opened is None:
            return data
        content = bytes(opened.read(min(most, self._left) + 1))
        self._left -= len(content)
        if len(content) > most or self._left < 0:
            limit = (
                f"more than {most >> 20} MB" if len(content) > most else "too much with the rest"
            )
            raise RecordingError(
                f"{self._path}: a part of {len(data)} bytes unpacks to {limit}, which is not read; "
                "write it again in smaller parts, or only the topics that are needed"
            )
        return content


def _unpacked(data: bytes) -> Any:
    """Unpacking stream of zstd, lz4 or bzip2 bytes, known by their first ones; None for others."""
    if data.startswith(b"\x28\xb5\x2f\xfd"):
        import zstandard

        unpacker = zstandard.ZstdDecompressor(max_window_size=MOST_PIECE)
        return unpacker.stream_reader(io.BytesIO(data), read_across_frames=True)
    if data.startswith(b"\x04\x22\x4d\x18"):
        import lz4.frame

        return lz4.frame.open(io.BytesIO(data))
    return bz2.open(io.BytesIO(data)) if data.startswith(b"BZh") else None
