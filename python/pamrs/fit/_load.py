"""Reads force maps: a table alone, or a description with its table and its muscle."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from pamrs._files import is_inside, toml_document
from pamrs.declared import Rule, holds, is_finite, is_text, problems_of
from pamrs.errors import ParameterError, RecordingError, joined
from pamrs.fit._data import ForceMap
from pamrs.fit._files import Columns, read_map
from pamrs.rig import Muscle, Reader, muscle_problems
from pamrs.rig.muscle_models import models_with


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


SCHEMA: Final = "pamrs.force_map/1"
_TOP: Final = {
    "schema": Rule(lambda value: value == SCHEMA, repr(SCHEMA)),
    **dict.fromkeys(
        ("name", "description", "source", "file", "delimiter", "decimal"), Rule(is_text, "a text")
    ),
    "columns": Rule(
        holds((list, Mapping), lambda value: isinstance(value, (str, Mapping))),
        "a table of texts, or a list of one for each column",
    ),
    "where": Rule(
        holds(Mapping, lambda value: isinstance(value, (str, bool)) or is_finite(value)),
        "a table of texts",
    ),
    **dict.fromkeys(("clipped_force", "level_tolerance", "noise", "muscle"), Rule(None, "")),
}

#: Moduli of a muscle whose moduli a fit is to find, in the order that it takes unless said
#: otherwise.
NO_MODULI: Final = (0.0, 0.0, 0.0, 0.0)
_ZEROS: Final[dict[str, Any]] = {
    "modulus_slope": {"value": list(NO_MODULI), "unit": "1"},
    "modulus_offset": {"value": list(NO_MODULI), "unit": "Pa"},
    "c10": {"value": 0.0, "unit": "Pa"},
    "bladder_modulus": {"value": 0.0, "unit": "Pa"},
}


class Description(NamedTuple):
    """Content of a force map description.

    Attributes
    ----------
    table : Path
        Where the table is.
    options : dict
        How to read it: arguments of :func:`pamrs.fit.load_force_map`.
    muscle : Muscle
        Geometry, and the force model to start from.
    tolerance : dict of str to float
        Standard deviation of what is known of a number, SI; infinite where it is unknown.
    noise : float or None
        Standard deviation of the forces [N].
    text : str
        What it says about the measurements.
    """

    table: Path
    options: dict[str, Any]
    muscle: Muscle
    tolerance: dict[str, float]
    noise: float | None
    text: str


def read_description(file: Path, *, allow_outside: bool = False) -> Description:
    """Read a ``pamrs.force_map/1`` file, but not yet its table.

    Parameters
    ----------
    file : Path
        The TOML file.
    allow_outside : bool
        Whether its table may lie outside its folder.

    Returns
    -------
    Description

    Raises
    ------
    RecordingError
        With every problem found in it.
    """
    document = toml_document(file, RecordingError)
    reader = Reader()
    reader.problems += problems_of("", document, _TOP, needed=("schema",))
    if "file" not in document:
        reader.problems.append("file is missing: the table with the measurements")
    clipped = _quantity(reader, document, "clipped_force", "N")
    tolerance = _quantity(reader, document, "level_tolerance", "Pa")
    noise = _quantity(reader, document, "noise", "N")
    block = document.get("muscle")
    model: dict[str, Any] = {}
    if isinstance(block, Mapping):
        model = reader.block("muscle", with_moduli(block))
        if not reader.problems:
            reader.problems += muscle_problems("muscle", model, reader.units)
    else:
        reader.problems.append(
            "the block [muscle] is missing: the muscle's geometry, as in a rig file"
        )
    if reader.problems:
        raise RecordingError(joined(str(file), reader.problems))
    texts = {key: document.get(key, "") for key, rule in _TOP.items() if rule.accepts is is_text}
    where = {key: str(value) for key, value in document.get("where", {}).items()}
    table = Path(os.path.normpath(file.parent / texts["file"]))
    if not (allow_outside or "\0" in texts["file"] or is_inside(file.parent, table)):
        raise RecordingError(
            f"{file}: file = {texts['file']!r}: lies outside the folder of the description; copy "
            "it there, or allow it with --allow-outside (in Python: load_measured_muscle(..., "
            "allow_outside=True))"
        )
    if not table.exists():
        advice = texts["source"] or "correct file in the description"
        raise RecordingError(
            f"{file}: file = {texts['file']!r}: there is no file {table}; {advice}"
        )
    options = {
        "rest_length": model["rest_length"],
        "columns": document.get("columns", {}),
        "where": where or None,
        "clipped": clipped,
        "level_tolerance": tolerance,
        "delimiter": texts["delimiter"] or None,
        "decimal": texts["decimal"] or None,
        "name": texts["name"] or file.stem,
    }
    known = {name.partition(".")[2]: spread for name, spread in reader.tolerances.items()}
    return Description(table, options, Muscle.from_model(model), known, noise, texts["description"])


def with_moduli(block: Mapping[str, Any]) -> dict[str, Any]:
    """A ``[muscle]`` block with zeros where it leaves out the moduli of its model, which a fit is
    to find.
    """
    model = str(block.get("model", "robinson"))
    zeros = {key: value for key, value in _ZEROS.items() if model in models_with(key)}
    return {**zeros, **block}


def _quantity(reader: Reader, document: Mapping[str, Any], key: str, unit: str) -> float | None:
    """``{ value, unit }`` in SI, None where there is none or after noting what is wrong with it."""
    raw = document.get(key)
    if raw is None:
        return None
    whole = isinstance(raw, Mapping) and set(raw) == {"value", "unit"}
    if not (whole and isinstance(raw["unit"], str)):
        reader.problems.append(
            f"{key} = {raw!r} is not allowed: write {{ value = ..., unit = {unit!r} }}"
        )
        return None
    return reader.scalar(key, unit, raw["value"], raw["unit"], -1e9, 1e9)
