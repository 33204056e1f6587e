"""Files of arrays: HDF5 by h5py, Parquet and Feather by pyarrow, those of NumPy, and those of
MATLAB, of every version, by mat-io: structs, logs of Simulink and ControlDesk.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._files import MOST_DEPTH, MOST_PARTS
from pamrs.errors import RecordingError
from pamrs.recordings._gate import Gate, admit_arrow, admit_matlab, admit_numpy
from pamrs.recordings.logs._log import (
    Log,
    Series,
    TextFormat,
    collected,
    numbers_of,
    series_of_texts,
    split_heading,
    understood_unit,
)
from pamrs.units import parse_unit, same_dimension


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
        found += _series_of_matrix("", content, form.columns, unread, path)
    else:
        with content:
            for name in content.files:
                found += _series_of_matrix(name, content[name], form.columns, unread, path)
    return collected(path, found, unread)


def _series_of_matrix(
    heading: str, array: Any, columns: tuple[str, ...] | None, unread: dict[str, str], path: Path
) -> list[Series]:
    """Series of one array: a vector, the columns of a matrix, the fields of records.

    Samples run along the longer axis; `unread` gets what is none of these, with the reason.
    """
    name, unit = split_heading(heading)
    values = np.asarray(array)
    if values.dtype.names:
        found: list[Series] = []
        for part in values.dtype.names:
            inside = f"{heading}/{part}" if heading else part
            found += _series_of_matrix(inside, values[part], None, unread, path)
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


_UNITS: Final = ("unit", "units", "Unit", "Units", "UNIT")
_RATES: Final = ("sample_rate", "sampling_rate", "fs", "rate", "SampleRate")  # [Hz]
_STEPS: Final = ("sample_time", "dt", "wf_increment", "increment")  # [s]
_MOST_COLUMNS: Final = 256


def read_hdf(path: Path, form: TextFormat) -> Log:
    """Read an HDF5 file.

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
        for made in _series_of_matrix(name, item[()], form.columns, unread, path):
            unit = made.unit or _unit(item)
            found.append(Series(made.name, made.values, unit, _clock(item, len(made.values))))

    with h5py.File(path, "r") as file:
        unread |= _leads_elsewhere(file)
        for name, item in members(file):
            take(name, item)
    return collected(path, found, unread)


def _elsewhere(item: Any) -> str:
    """Reason for which a data set is not read: another file, or other data sets that may lead to
    one, hold its numbers.

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


def _leads_elsewhere(group: Any) -> Iterator[tuple[str, str]]:
    """Links and data sets in a group that lead to other files, or may do so, and why."""
    import h5py

    for name, item in members(group):
        if isinstance(item, h5py.ExternalLink):
            why = f"it is a link to {item.filename!r}; copy what that holds into this file"
            yield name, why
        elif isinstance(item, h5py.Dataset) and (why := _elsewhere(item)):
            yield name, why


def members(group: Any) -> Iterator[tuple[str, Any]]:
    """Iterate over everything in a group and below it, once each, in the order of the names.

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


_DEEPEST = 12  # structs in structs


def read_matlab(path: Path, form: TextFormat) -> Log:
    """Read a ``.mat`` file, of version 4 to 7 or 7.3.

    Returns
    -------
    Log
        Vectors, columns of matrices, ``timeseries`` objects and structures with time (each with
        its clock), and the measurements of dSPACE ControlDesk (``X`` and ``Y``).
    """
    with warnings.catch_warnings():  # its import sets an option that pandas 3 no longer needs
        warnings.simplefilter("ignore", DeprecationWarning)
        from matio import load_from_mat
    _check_own_numbers(path)
    content = load_from_mat(str(path))
    reader = _Reader(path, form.columns)
    for name, value in content.items():
        if not name.startswith("__"):
            reader.take(name, value, 0)
    return collected(path, reader.found, reader.unread)


def _check_own_numbers(path: Path) -> None:
    """Refuse a file that unpacks to too much or (version 7.3, which is HDF5) leads to others."""
    import h5py

    if not h5py.is_hdf5(path):
        admit_matlab(path)
        return

    with h5py.File(path, "r") as file:
        for name, why in _leads_elsewhere(file):
            raise RecordingError(f"{path}: {name}: {why}")
        gate = Gate(path)
        for _, item in members(file):
            if isinstance(item, h5py.Dataset):
                gate.admit_array(item.shape or (), item.dtype)


class _Reader:
    """Walks through the variables of a file."""

    def __init__(self, path: Path, columns: tuple[str, ...] | None) -> None:
        self.path = path
        self.columns = columns
        self.found: list[Series] = []
        self.unread: dict[str, str] = {}

    def take(self, name: str, value: Any, depth: int) -> None:
        """Add what one variable, or one field, holds."""
        value = _bare(value)
        fields = _fields(value)
        if fields is not None and depth < _DEEPEST:
            if not (
                self._timeseries(name, fields)
                or self._of_simulink(name, fields, depth)
                or self._with_time(name, fields)
                or self._controldesk(name, fields)
            ):
                for part, inside in fields.items():
                    self.take(f"{name}/{part}", inside, depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            for index, item in enumerate(value.ravel()):
                self.take(f"{name}/{_own_name(item) or index + 1}", item, depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.names:
            for index, item in enumerate(value.ravel()):
                self.take(f"{name}/{_own_name(item) or index + 1}", _record(item), depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
            self.found += _series_of_matrix(name, value, self.columns, self.unread, self.path)
        elif hasattr(value, "columns") and hasattr(value, "iloc"):  # a table or a timetable
            self._frame(name, value)
        elif depth == 0:
            self.unread[name] = "it holds no numbers"

    def _frame(self, name: str, frame: Any) -> None:
        time = numbers_of(frame.index.to_numpy()) if frame.index.dtype.kind in "mM" else None
        for column in frame.columns:
            values = numbers_of(frame[column].to_numpy())
            if values is not None:
                self.found.append(Series(f"{name}/{column}", values, "", time))

    def _timeseries(self, name: str, fields: Mapping[str, Any]) -> bool:
        """A ``timeseries`` object, or a struct with its properties."""
        data = fields.get("data")
        values = numbers_of(data) if isinstance(data, np.ndarray) else None
        about = _fields(fields.get("timeinfo")) or _Fields()
        time = _times(fields.get("time"), about)
        if values is None or time is None or not len(time):
            return False
        unit = _text((_fields(fields.get("datainfo")) or _Fields()).get("units")) or _text(
            fields.get("units")
        )
        inside = _text(fields.get("name"))
        self._columns(name, inside, np.asarray(data), _seconds(time, about), unit)
        return True

    def _of_simulink(self, name: str, fields: Mapping[str, Any], depth: int) -> bool:
        """A data set of Simulink (``logsout``), or a signal of one: only what was logged."""
        if not getattr(fields, "kind", "").startswith("Simulink."):
            return False
        for part in ("elements", "values"):
            inside = fields.get(part)
            if inside is not None and not (
                isinstance(inside, np.ndarray) and inside.dtype != object
            ):
                self.take(name, inside, depth + 1)
                return True
        return False

    def _with_time(self, name: str, fields: Mapping[str, Any]) -> bool:
        """Simulink's "Structure With Time": ``time`` and ``signals``."""
        signals, times = fields.get("signals"), fields.get("time")
        if signals is None or not isinstance(times, np.ndarray):
            return False
        time = numbers_of(times)
        if time is None or not len(time):
            return False
        listed = _list(signals)
        for index, signal in enumerate(listed):
            label = _text(signal.get("label")) or _text(signal.get("blockname"))
            part = label or ("" if len(listed) == 1 else f"signal {index + 1}")
            if isinstance(signal.get("values"), np.ndarray):
                self._columns(f"{name}/{part}" if part else name, "", signal["values"], time, "")
        return True

    def _controldesk(self, name: str, fields: Mapping[str, Any]) -> bool:
        """ControlDesk of dSPACE: clocks in ``X``, measurements in ``Y``, joined by ``XIndex``."""
        if "x" not in fields or "y" not in fields:
            return False
        clocks = [numbers_of(item["data"]) for item in _list(fields["x"]) if "data" in item]
        measured = [item for item in _list(fields["y"]) if "data" in item]
        if not clocks or not measured:
            return False
        for item in measured:
            index = numbers_of(item.get("xindex", np.array([1.0])))
            which = int(index[0]) - 1 if index is not None and len(index) else 0
            time = clocks[which] if 0 <= which < len(clocks) else None
            own = _text(item.get("name")).strip().replace('"', "")
            part = own.removeprefix("Model Root/").removeprefix("Platform()://Model Root/")
            self._columns(part or name, "", item["data"], time, _text(item.get("unit")))
        return True

    def _columns(self, name: str, inside: str, data: Any, time: Array | None, unit: str) -> None:
        """One series for each column of data whose samples run along one of its axes."""
        array = np.squeeze(np.asarray(data))
        count = len(time) if time is not None else array.size
        own = (name.rpartition("/")[2], "unnamed")
        label = f"{name}/{inside}" if inside and inside not in own else name
        if array.ndim == 0 or count not in array.shape:
            self.unread[label] = f"{array.size} values for {count} times"
            return
        table = np.moveaxis(array, array.shape.index(count), 0).reshape(count, -1)
        for index in range(table.shape[1]):
            values = numbers_of(table[:, index])
            if values is not None:
                part = f"{label}/{index + 1}" if table.shape[1] > 1 else label
                self.found.append(Series(part, values, unit, time))


def _bare(value: Any) -> Any:
    """The only element of an array of objects or records, else the value itself."""
    while isinstance(value, np.ndarray) and value.size == 1 and value.dtype == object:
        value = value.ravel()[0]
    return value


def _record(item: Any) -> dict[str, Any]:
    return {part: item[part] for part in item.dtype.names}


def _fields(value: Any) -> _Fields | None:
    """Fields of a struct or properties of an object; None for all else."""
    value = _bare(value)
    given = getattr(value, "properties", None)
    if given is None and isinstance(value, np.void) and value.dtype.names:
        given = _record(value)
    if given is None and isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        given = _record(value.ravel()[0])
    if given is None and isinstance(value, Mapping):
        given = value
    if not isinstance(given, Mapping):
        return None
    made = _Fields({str(part): _bare(inside) for part, inside in given.items()})
    made.kind = str(getattr(value, "classname", ""))
    return made


class _Fields(dict[str, Any]):
    """Dict looked up regardless of capitals and a last ``_``; `kind` is the class of an object."""

    kind: str = ""

    def _key(self, key: object) -> str | None:
        wanted = str(key).lower()
        return next((own for own in self if own.lower().rstrip("_") == wanted), None)

    def __contains__(self, key: object) -> bool:
        return self._key(key) is not None

    def get(self, key: str, default: Any = None) -> Any:
        """The field of that name."""
        own = self._key(key)
        return default if own is None else dict.__getitem__(self, own)

    def __getitem__(self, key: str) -> Any:
        own = self._key(key)
        if own is None:
            raise KeyError(key)
        return dict.__getitem__(self, own)


def _list(value: Any) -> list[dict[str, Any]]:
    """Structs of a struct array or of a cell array."""
    value = _bare(value)
    single = _fields(value)
    if single is not None:
        return [single]
    items: Any = value.ravel() if isinstance(value, np.ndarray) else ()
    return [fields for item in items if (fields := _fields(item)) is not None]


def _own_name(item: Any) -> str:
    fields = _fields(item)
    return _text(fields.get("name")) if fields else ""


def _text(value: Any) -> str:
    value = _bare(value)
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in "UO" or value.size != 1:
            return ""
        value = value.ravel()[0]
    return value.strip() if isinstance(value, str) else ""


def _times(time: Any, about: Mapping[str, Any]) -> Array | None:
    """Times of a timeseries: as stored, or evenly spaced by start, increment and length."""
    values = numbers_of(time) if isinstance(time, np.ndarray) else None
    if values is not None and len(values) and np.isfinite(values).all():
        return values
    said = [numbers_of(about.get(key, np.nan)) for key in ("start", "increment", "length")]
    if any(item is None or len(item) != 1 or not np.isfinite(item[0]) for item in said):
        return None
    start, step, count = (float(item[0]) for item in said if item is not None)
    if not 2 <= count <= 1e9:
        return None
    return np.asarray(start + step * np.arange(int(count)), dtype=np.float64)


def _seconds(time: Array, about: Mapping[str, Any]) -> Array:
    known = understood_unit(_text(about.get("units")) or "s")
    if known is None or not same_dimension(known.unit, "s"):
        raise RecordingError(f"the unit {_text(about.get('units'))!r} of a time is not known")
    return time * parse_unit(known.unit).scale
