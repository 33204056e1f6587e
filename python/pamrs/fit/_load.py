"""Reads force maps: a table alone, or a description with its table and its muscle."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pamrs.errors import ParameterError
from pamrs.fit._data import ForceMap
from pamrs.fit._description import read_description
from pamrs.fit._files import Columns, read_map

if TYPE_CHECKING:
    from pamrs.rig import Muscle


@dataclass(frozen=True, eq=False)
class MeasuredMuscle:
    """A force map with the muscle it was measured on, as a ``pamrs.force_map/1`` file describes
    them.

    Attributes
    ----------
    data : ForceMap
        The map, checked against the muscle.
    muscle : Muscle
        Geometry, and the force model to start from.
    tolerance : dict of str to float
        Standard deviation of what the file knows of a number, SI; infinite where it is unknown.
    noise : float or None
        Standard deviation of the forces [N], where the file gives one; priors of moduli need it.
    description : str
        What the file says about it.
    """

    data: ForceMap
    muscle: Muscle
    tolerance: dict[str, float]
    noise: float | None = None
    description: str = ""


def load_force_map(
    path: str | os.PathLike[str],
    *,
    rest_length: float | None = None,
    columns: Columns | None = None,
    where: Mapping[str, str | float] | None = None,
    clipped: float | None = None,
    level_tolerance: float | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    name: str | None = None,
    allow_outside: bool = False,
) -> ForceMap:
    """Read a force map.

    Parameters
    ----------
    path : path-like
        A table, text, Parquet, a workbook of Excel or another log, with the columns length or
        contraction, pressure, force and, if known, direction (-1 or "contracting", 1 or
        "lengthening"). Units are in the headings: ``length [mm]``, ``pressure_kPa``,
        ``force (N)``. With a column ``time`` it is read as a recording of a bench. Or a ``.toml``
        description (schema ``pamrs.force_map/1``), to which only `allow_outside` applies.
    rest_length : float, optional
        Length at zero contraction [m]; needed for a table.
    columns : mapping or sequence, optional
        From the file's headings to headings as above; an empty one leaves the column out. A list of
        one for each column where the file has no headings. Instead of a heading a table with that
        as ``name`` and ``scale`` and ``offset``, or ``from`` and ``to``, as in ``case.toml``:
        ``{"name": "force [N]", "scale": 50.0}`` for a load cell in volts.
    where : mapping of str to str or float, optional
        Column of the file -> value: only rows with these values belong to the map. Numbers count as
        numbers: 1 is 1.000.
    clipped, level_tolerance : float, optional
        As in :meth:`ForceMap.from_arrays`.
    delimiter : str, optional
        What separates cells, ``" "`` for any run of blanks; by default the tabulator, semicolon,
        comma, bar or blank with which the rows have as many cells as the header.
    decimal : str, optional
        Decimal mark; by default the comma if the measured columns have numbers like ``12,5``, else
        the point.
    name : str, optional
        What to call the map; by default the file's stem, or what the description says.
    allow_outside : bool
        Whether the table of a description may lie outside the description's folder.

    Returns
    -------
    ForceMap

    Raises
    ------
    RecordingError
        If the file cannot be read, its cells cannot be told apart, a column is missing, has no unit
        or the wrong one, or fewer than two rows are usable.
    """
    file = Path(path)
    given: dict[str, Any] = {
        "rest_length": rest_length,
        "columns": columns,
        "where": where,
        "clipped": clipped,
        "level_tolerance": level_tolerance,
        "delimiter": delimiter,
        "decimal": decimal,
        "name": name,
    }
    if file.suffix.lower() != ".toml":
        return read_map(file, **given)
    for key, value in given.items():
        if value is not None:
            raise ParameterError(f"{key} cannot be given: {file} describes its table itself")
    return load_measured_muscle(file, allow_outside=allow_outside).data


def load_measured_muscle(
    path: str | os.PathLike[str], *, allow_outside: bool = False
) -> MeasuredMuscle:
    """Read a ``pamrs.force_map/1`` description: where the table is, what its columns are, which
    muscle it is of.

    Parameters
    ----------
    path : path-like
        The TOML file. ``file`` in it is relative to its folder; ``columns`` maps the table's
        headings to headings with units; ``where`` picks rows; ``clipped_force``,
        ``level_tolerance`` and ``noise`` are quantities; ``[muscle]`` is as in a rig file, with
        ``tol`` as the standard deviation of what is known.
    allow_outside : bool
        Whether the table may lie outside the file's folder (``../map.csv``, or links).

    Returns
    -------
    MeasuredMuscle

    Raises
    ------
    RecordingError
        With every problem found in the description, or if the table cannot be read.
    """
    found = read_description(Path(path), allow_outside=allow_outside)
    data = load_force_map(found.table, **found.options)
    return MeasuredMuscle(
        data.checked_against(found.muscle), found.muscle, found.tolerance, found.noise, found.text
    )
