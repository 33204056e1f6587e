"""MATLAB's files of every version by mat-io: arrays, structs, Simulink's logs, ControlDesk's."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs.errors import RecordingError
from pamrs.recordings._gate import Gate, admit_matlab
from pamrs.recordings.logs._hdf import leads_elsewhere, members
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected, numbers_of
from pamrs.recordings.logs._tables import series_of_matrix
from pamrs.recordings.logs._words import understood_unit
from pamrs.units import parse_unit, same_dimension

_DEEPEST = 12  # structs in structs


def read_matlab(path: Path, form: TextFormat) -> Log:
    """Read a ``.mat`` file, of version 4 to 7 or 7.3.

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Its `columns` name the columns of matrices.

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
        for name, why in leads_elsewhere(file):
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
            self.found += series_of_matrix(name, value, self.columns, self.unread, self.path)
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
