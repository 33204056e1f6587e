"""HDF5 by h5py: every vector, every column, every field of records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._files import MOST_DEPTH, MOST_PARTS
from pamrs.errors import RecordingError
from pamrs.recordings._gate import Gate
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected
from pamrs.recordings.logs._tables import series_of_matrix

_UNITS: Final = ("unit", "units", "Unit", "Units", "UNIT")
_RATES: Final = ("sample_rate", "sampling_rate", "fs", "rate", "SampleRate")  # [Hz]
_STEPS: Final = ("sample_time", "dt", "wf_increment", "increment")  # [s]
_MOST_COLUMNS: Final = 256


def read_hdf(path: Path, form: TextFormat) -> Log:
    """Read an HDF5 file.

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Its `columns` name the columns of matrices.

    Returns
    -------
    Log
        By path of the data set. Its unit is its attribute ``unit`` or ``units``, its clock the
        attribute ``sample_rate`` [Hz] or ``dt`` [s], of it or of its group.
    """
    import h5py

    found: list[Series] = []
    unread: dict[str, str] = {}
    gate = Gate(path)

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or _elsewhere(item):
            return
        if item.ndim > 2 or item.dtype.kind not in "biufV" or item.size < 2:
            unread[name] = f"it has the shape {item.shape} and the type {item.dtype}"
            return
        if item.ndim == 2 and min(item.shape) > _MOST_COLUMNS:
            unread[name] = f"it has the shape {item.shape}, which is no table"
            return
        gate.admit_array(item.shape, item.dtype)
        for made in series_of_matrix(name, item[()], form.columns, unread, path):
            unit = made.unit or _unit(item)
            found.append(Series(made.name, made.values, unit, _clock(item, len(made.values))))

    with h5py.File(path, "r") as file:
        unread |= leads_elsewhere(file)
        for name, item in members(file):
            take(name, item)
    return collected(path, found, unread)


def _elsewhere(item: Any) -> str:
    """Reason for which a data set is not read: another file, or other data sets that may lead to
    one, hold its numbers.

    Parameters
    ----------
    item : h5py.Dataset
        The data set.

    Returns
    -------
    str
        ``""`` where it has its own.
    """
    if item.is_virtual and all(source.file_name == "." for source in item.virtual_sources()):
        return "it is virtual, a view of other data sets; copy its numbers into one of its own"
    if item.external or item.is_virtual:
        return "its numbers lie in another file; copy them into this one"
    return ""


def leads_elsewhere(group: Any) -> Iterator[tuple[str, str]]:
    """Find the links and data sets of a group, or below it, that lead to other files or may do so.

    Parameters
    ----------
    group : h5py.Group
        Links to other files are not followed. What has several names is looked at once.

    Yields
    ------
    name, why : str
        The path from `group`.
    """
    import h5py

    for name, item in members(group):
        if isinstance(item, h5py.ExternalLink):
            why = f"it is a link to {item.filename!r}; copy what that holds into this file"
            yield name, why
        elif isinstance(item, h5py.Dataset) and (why := _elsewhere(item)):
            yield name, why


def members(group: Any) -> Iterator[tuple[str, Any]]:
    """Iterate over everything in a group and below it, once each, in the order of the names.

    Parameters
    ----------
    group : h5py.Group
        Of a file that is open.

    Yields
    ------
    name, item : str, object
        The path from `group`; a group, a data set or a link to another file.

    Raises
    ------
    RecordingError
        If groups are nested too deep, or there are too many parts.
    """
    import h5py

    def address(of: Any) -> int:
        return int(h5py.h5o.get_info(of.id).addr)

    seen = {address(group)}
    left = [("", group, iter(group))]
    while left:
        path, inside, names = left[-1]
        own = next(names, None)
        if own is None:
            left.pop()
            continue
        name, link = path + own, inside.get(own, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            yield name, link
        elif isinstance(link, h5py.HardLink) and address(item := inside[own]) not in seen:
            seen.add(address(item))
            yield name, item
            if isinstance(item, h5py.Group):
                left.append((f"{name}/", item, iter(item)))
        if len(left) > MOST_DEPTH or len(seen) > MOST_PARTS:
            raise RecordingError(
                f"{group.file.filename}: its groups are nested more than {MOST_DEPTH} deep, or it "
                f"has more than {MOST_PARTS} parts, and at most that is read"
            )


def _unit(item: Any) -> str:
    for key in _UNITS:
        if key in item.attrs:
            said = item.attrs[key]
            text = said.decode(errors="replace") if isinstance(said, bytes) else str(said)
            return text.strip()
    return ""


def _clock(item: Any, count: int) -> Array | None:
    for holder in (item, item.parent):
        for keys, power in ((_STEPS, 1), (_RATES, -1)):
            for key in keys:
                try:
                    step = float(np.asarray(holder.attrs[key]).ravel()[0]) ** power
                except (KeyError, ValueError, TypeError, IndexError, ZeroDivisionError):
                    continue
                if np.isfinite(step) and step > 0.0:
                    return np.arange(count, dtype=np.float64) * step
    return None
