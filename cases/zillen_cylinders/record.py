"""Friction recordings of pneumatic cylinders: a piston pulled to and fro at constant pressure.

The files are read as they are, without smoothing or a common time grid: a breakaway peak is one or
two samples high and must not be taken for a spike. Rows that cannot be used are flagged with their
reason.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.errors import RecordingError
from pamrs.recordings.table import read_table
from pamrs.units import to_si

__all__ = ["CylinderFolder", "FrictionRecord", "load_friction_folder", "load_friction_record"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GAP: Final = 5.0  # usual intervals without a sample
_NAME: Final = re.compile(r"(?P<cylinder>.+)_(?P<bar>\d+(?:\.\d+)?)bar")
_COLUMNS: Final = ("time [ms]", "", "", "", "position [mm]", "pressure [bar]", "force [N]")
_SI: Final = {"time": "s", "position": "m", "pressure": "Pa", "force": "N"}
# no bench of this kind goes beyond; a column that mostly does is in another unit
_RANGES: Final = {"position": (-5.0, 5.0), "pressure": (-1.1e5, 5e6), "force": (-1e5, 1e5)}


@dataclass(frozen=True, eq=False)
class FrictionRecord:
    """One run at one pressure; make it with :meth:`from_arrays` or :func:`load_friction_record`.

    Attributes
    ----------
    name, cylinder : str
        Name of the run and of the cylinder it belongs to.
    time, position, pressure, force : (n,) array
        Time [s], piston position [m], gauge pressure [Pa], force [N] of every row.
    used : (n,) bool array
        Rows that may be used.
    reason : (n,) tuple of str
        Why a row may not, ``""`` where it may.
    gaps : tuple of (float, float)
        Start and end of the stretches without a sample [s].
    source : str
        The file.
    """

    name: str
    cylinder: str
    time: Array
    position: Array
    pressure: Array
    force: Array
    used: Mask
    reason: tuple[str, ...]
    gaps: tuple[tuple[float, float], ...] = ()
    source: str = ""

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        position: ArrayLike,
        pressure: ArrayLike,
        force: ArrayLike,
        *,
        name: str = "run",
        cylinder: str = "cylinder",
        source: str = "",
    ) -> FrictionRecord:
        """A record from arrays in SI units.

        Parameters
        ----------
        time, position, pressure, force : (n,) array_like
            Time [s], position [m], gauge pressure [Pa], force [N]; NaN where there is no value.
        name, cylinder, source : str
            Names of the run, of the cylinder and of the file.

        Returns
        -------
        FrictionRecord

        Raises
        ------
        RecordingError
            If the columns differ in length, look like another unit, or fewer than 20 rows are
            usable.
        """
        given = {"time": time, "position": position, "pressure": pressure, "force": force}
        columns = {
            word: np.asarray(values, dtype=np.float64).ravel() for word, values in given.items()
        }
        sizes = [len(values) for values in columns.values()]
        if len(set(sizes)) != 1:
            raise RecordingError(
                f"{name}: time, position, pressure and force have {sizes} rows; the same number is "
                "needed"
            )
        reason = np.full(sizes[0], "", dtype=object)
        finite = np.logical_and.reduce([np.isfinite(values) for values in columns.values()])
        reason[~finite] = "not a number"
        for word, (low, high) in _RANGES.items():
            values = columns[word]
            beyond = finite & ((values < low) | (values > high))
            if beyond.sum() > 0.5 * max(1, int(finite.sum())):
                worst = float(values[beyond][0])
                raise RecordingError(
                    f"{name}: {word} = {worst:.6g} {_SI[word]} is outside {low:g} to {high:g} "
                    f"{_SI[word]}; right unit?"
                )
            reason[beyond & (reason == "")] = f"{word} out of range"
        stamps = columns["time"]
        latest = np.maximum.accumulate(np.where(reason == "", stamps, -np.inf))
        late = np.zeros(sizes[0], dtype=bool)
        late[1:] = stamps[1:] <= latest[:-1]
        reason[late & (reason == "")] = "time does not advance"
        used = np.asarray(reason == "", dtype=bool)
        if used.sum() < 20:
            raise RecordingError(
                f"{name}: {int(used.sum())} usable rows of {sizes[0]}; 20 at least are needed"
            )
        kept = stamps[used]
        steps = np.diff(kept)
        holes = np.flatnonzero(steps > _GAP * float(np.median(steps)))
        gaps = tuple((float(kept[i]), float(kept[i + 1])) for i in holes)
        return cls(
            name=name,
            cylinder=cylinder,
            **columns,
            used=used,
            reason=tuple(reason),
            gaps=gaps,
            source=source,
        )

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return (
            f"FrictionRecord({self.name!r}, {int(self.used.sum())} of {len(self)} rows used, "
            f"{len(self.gaps)} gaps)"
        )

    def rows(self) -> tuple[Array, Array, Array, Array]:
        """Time, position, pressure and force of the used rows, in order."""
        keep = self.used
        return self.time[keep], self.position[keep], self.pressure[keep], self.force[keep]

    @property
    def issues(self) -> list[str]:
        """What was found, in words."""
        counts = Counter(why for why in self.reason if why)
        found = [
            f"{self.name}: {n} {'rows' if n > 1 else 'row'} of {len(self)} not used: {why}"
            for why, n in counts.items()
        ]
        if self.gaps:
            longest = max(self.gaps, key=lambda gap: gap[1] - gap[0])
            found.append(
                f"{self.name}: {len(self.gaps)} gap{'s' if len(self.gaps) > 1 else ''} without "
                f"samples, the longest {longest[1] - longest[0]:.3g} s at {longest[0]:.3g} s"
            )
        return found


@dataclass(frozen=True, eq=False)
class CylinderFolder:
    """The runs of a folder.

    Attributes
    ----------
    cylinders : dict of str to list of FrictionRecord
        The runs of each cylinder, by rising pressure.
    duplicates : list of (str, str)
        Files left out because they equal another one byte for byte, and that other one.
    """

    cylinders: dict[str, list[FrictionRecord]] = field(default_factory=dict)
    duplicates: list[tuple[str, str]] = field(default_factory=list)

    @property
    def issues(self) -> list[str]:
        """What was found, in words."""
        found = [f"{gone} equals {kept} byte for byte: left out" for gone, kept in self.duplicates]
        every = [record for records in self.cylinders.values() for record in records]
        return [*found, *(issue for record in every for issue in record.issues)]


def load_friction_record(
    path: str | os.PathLike[str], *, columns: Sequence[str] = _COLUMNS, cylinder: str | None = None
) -> FrictionRecord:
    """Read one run: text without a header, cells separated by blanks.

    Parameters
    ----------
    path : path-like
        The file; ``NAME_3bar.csv`` belongs to the cylinder ``NAME``.
    columns : sequence of str
        ``"name [unit]"`` of each column, ``""`` to leave one out; time, position, pressure and
        force are needed.
    cylinder : str, optional
        Name of the cylinder, if the file's name does not tell.

    Returns
    -------
    FrictionRecord

    Raises
    ------
    RecordingError
        If the file cannot be read, a column is missing, or :meth:`FrictionRecord.from_arrays`
        refuses it.
    """
    file = Path(path)
    source = str(file)
    table = read_table(file, delimiter=" ", header=False)
    if table.width != len(columns):
        raise RecordingError(
            f"{source}: columns lists {len(columns)} names, but there are {table.width} columns"
        )
    values: dict[str, Array] = {}
    for index, heading in enumerate(columns):
        match = re.fullmatch(r"\s*(\w+)\s*\[(.+)\]\s*", heading)
        if not heading.strip():
            continue
        if match is None or match[1] not in _SI:
            raise RecordingError(
                f"{source}: column {heading!r} is not understood: 'time [s]', 'position [m]', "
                "'pressure [Pa]' or 'force [N]'"
            )
        numbers = table.numbers(index, heading, source, None, ".")
        values[match[1]] = numbers * to_si(1.0, match[2].strip(), _SI[match[1]])
    missing = [word for word in _SI if word not in values]
    if missing:
        raise RecordingError(f"{source}: columns names no {' and no '.join(missing)}")
    stem = file.stem
    named = _NAME.fullmatch(stem)
    owner = cylinder or (named["cylinder"] if named else stem)
    return FrictionRecord.from_arrays(**values, name=stem, cylinder=owner, source=source)


def load_friction_folder(path: str | os.PathLike[str]) -> CylinderFolder:
    """Read every ``NAME_Nbar.csv`` of a folder; a file that equals an earlier one byte for byte is
    left out.

    Parameters
    ----------
    path : path-like
        The folder.

    Returns
    -------
    CylinderFolder

    Raises
    ------
    RecordingError
        If there is no such file, or one cannot be read.
    """
    folder = Path(path)
    files = sorted(file for file in folder.glob("*.csv") if _NAME.fullmatch(file.stem))
    if not files:
        raise RecordingError(f"{folder}: no file NAME_Nbar.csv is there")
    seen: dict[str, str] = {}
    found = CylinderFolder()
    for file in files:
        key = hashlib.sha256(file.read_bytes()).hexdigest()
        if key in seen:
            found.duplicates.append((file.stem, seen[key]))
            continue
        seen[key] = file.stem
        record = load_friction_record(file)
        found.cylinders.setdefault(record.cylinder, []).append(record)
    for records in found.cylinders.values():
        records.sort(key=lambda record: float(np.median(record.rows()[2])))
    return found
