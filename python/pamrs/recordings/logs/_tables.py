"""Parquet and Feather by pyarrow, NumPy's own files by NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pamrs.errors import RecordingError
from pamrs.recordings._gate import admit_arrow, admit_numpy
from pamrs.recordings.logs._log import (
    Log,
    Series,
    TextFormat,
    collected,
    numbers_of,
    series_of_texts,
)
from pamrs.recordings.logs._words import split_heading


def read_arrow(path: Path, form: TextFormat) -> Log:
    """Read a Parquet or Feather file.

    Parameters
    ----------
    path : Path
        The file; ``.parquet``, else Feather (Arrow's file format, of either version).
    form : TextFormat
        Not used: these files say what is in them.

    Returns
    -------
    Log
        A series for each column of numbers, flags, durations or date-times.
    """
    import pyarrow.feather
    import pyarrow.parquet

    admit_arrow(path)
    if path.suffix.lower() == ".parquet":
        table = pyarrow.parquet.read_table(path)
    else:
        table = pyarrow.feather.read_table(path)
    found: list[Series] = []
    unread: dict[str, str] = {}
    for column in table.schema:
        name, unit = split_heading(column.name)
        said = (column.metadata or {}).get(b"unit")
        kept = table.column(column.name)
        values = numbers_of(kept.to_numpy())
        if values is None:
            found.append(series_of_texts(name, [str(item) for item in kept.to_pylist()], unit))
            continue
        stamps = str(column.type).startswith(("timestamp", "duration", "time"))
        if stamps:
            unit = "s"
        found.append(Series(name, values, said.decode() if said else unit, stamps=stamps))
    return collected(path, found, unread)


def read_numpy(path: Path, form: TextFormat) -> Log:
    """Read a ``.npy`` or ``.npz`` file; nothing in it is executed.

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Its `columns` name the columns of a matrix.

    Returns
    -------
    Log
        A series for each vector, each column of a matrix, each field of records.
    """
    admit_numpy(path)
    content = np.load(path, allow_pickle=False)
    found: list[Series] = []
    unread: dict[str, str] = {}
    if isinstance(content, np.ndarray):
        found += series_of_matrix("", content, form.columns, unread, path)
    else:
        with content:
            for name in content.files:
                found += series_of_matrix(name, content[name], form.columns, unread, path)
    return collected(path, found, unread)


def series_of_matrix(
    heading: str, array: Any, columns: tuple[str, ...] | None, unread: dict[str, str], path: Path
) -> list[Series]:
    """Series of one array: a vector, the columns of a matrix, the fields of records.

    Parameters
    ----------
    heading : str
        Its name, perhaps with a unit.
    array : array-like
        Of one or two axes; samples run along the longer one.
    columns : tuple of str, optional
        Names for the columns of a matrix.
    unread : dict
        Gets what is none of these, and why.
    path : Path
        The file, for messages.

    Returns
    -------
    list of Series

    Raises
    ------
    RecordingError
        If `columns` does not fit the matrix.
    """
    name, unit = split_heading(heading)
    values = np.asarray(array)
    if values.dtype.names:
        found: list[Series] = []
        for part in values.dtype.names:
            inside = f"{heading}/{part}" if heading else part
            found += series_of_matrix(inside, values[part], None, unread, path)
        return found
    values = np.squeeze(values)
    if values.ndim not in (1, 2) or values.size < 2:
        unread[name or "the array"] = f"it has the shape {np.shape(array)}"
        return []
    if values.ndim == 1:
        numbers = numbers_of(values)
        if numbers is None:
            unread[name] = "it holds no numbers"
            return []
        return [Series(name or "column 1", numbers, unit)]
    table = values if values.shape[0] >= values.shape[1] else values.T
    names = columns or tuple(f"column {index + 1}" for index in range(table.shape[1]))
    if len(names) != table.shape[1]:
        raise RecordingError(
            f"{path}: columns lists {len(names)} names, but {name or 'the array'} has "
            f"{table.shape[1]} columns"
        )
    prefix = f"{name}/" if name else ""
    found = []
    for index, own in enumerate(names):
        numbers = numbers_of(table[:, index])
        if numbers is not None:
            part, inside = split_heading(own)
            found.append(Series(prefix + part, numbers, inside or unit))
    return found
