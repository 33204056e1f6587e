"""Reads force maps from tables with units in their headings, and from recordings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Mask
from pamrs.errors import ParameterError, RecordingError, joined
from pamrs.fit._data import ForceMap
from pamrs.fit._ways import series_ways
from pamrs.recordings import Recording, load_recording
from pamrs.recordings.logs import read_log, table_of
from pamrs.recordings.mapping import CALIBRATION_KEYS, Calibration, read_calibration
from pamrs.recordings.table import (
    Table,
    check_marks,
    decimal_of,
    dialect_of,
    has,
    is_text,
    read_table,
    read_text,
    renamed,
    stem_of,
)
from pamrs.units import parse_unit, same_dimension, to_si

# channel -> SI unit
_UNITS: Final = {
    "length": "m",
    "contraction": "1",
    "pressure": "Pa",
    "force": "N",
    "direction": "1",
    "time": "s",
}
_ALIASES: Final = {
    "muscle_length": "length",
    "contraction_ratio": "contraction",
    "muscle_pressure": "pressure",
    "gauge_pressure": "pressure",
    "muscle_force": "force",
    "tension": "force",
}
_SPECIMEN: Final = ("muscle", "specimen", "sample", "actuator", "id")
_DIRECTIONS: Final = {
    "contracting": -1.0,
    "contraction": -1.0,
    "shortening": -1.0,
    "lengthening": 1.0,
    "extending": 1.0,
    "extension": 1.0,
    "": 0.0,
    "unknown": 0.0,
}
_HEADING = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?)[\])]\s*$")
_NUMERIC = re.compile(r"[-+]?(\d[\d.,]*|[.,]\d+)([eE][-+]?\d+)?")
_NARROW: Final = 0.006  # a map of contractions from 0 to less than 0.6 % is one of fractions
# a pressure with fewer distinct values in a time series is a set point, not a sensor
_SET_POINTS: Final = 50


class _Column(NamedTuple):
    position: int
    heading: str
    unit: str
    line: Calibration = Calibration()


#: What a column is: a heading with its unit, or a table with that as ``name`` and a calibration.
Columns = Mapping[str, "str | Mapping[str, Any]"] | Sequence["str | Mapping[str, Any]"]


def read_map(
    file: Path,
    *,
    rest_length: float | None = None,
    columns: Columns | None = None,
    where: Mapping[str, str | float] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    name: str | None = None,
    **levels: Any,
) -> ForceMap:
    """Read a force map from a table; arguments and errors as those of
    :func:`pamrs.fit.load_force_map`.
    """
    source = str(file)
    if rest_length is None:
        raise RecordingError(
            f"{source}: rest_length is missing: give the length at zero contraction, in m"
        )
    if file.is_dir():
        raise RecordingError(f"{source}: cannot be read (a folder, not a file)")
    check_marks(delimiter, decimal, source)
    delimiter, table = _table(file, delimiter, decimal, columns)
    headings, lines = _calibrated(table, columns, source)
    found, strange = _understood(headings, lines, source)
    given = [table.cells(own.position) for name, own in found.items() if name != "direction"]
    texts = [cells for cells in given if not isinstance(cells, np.ndarray)]
    decimal = decimal or decimal_of(texts, source)
    wanted = {heading: str(value) for heading, value in (where or {}).items()}
    title = name or "_".join([stem_of(file), *wanted.values()])
    if "time" in found:
        if wanted:
            raise RecordingError(
                f"{source}: where does not apply to a table with a time column, which is one "
                "recording"
            )
        if lines:
            raise RecordingError(
                f"{source}: scale, offset, from and to do not apply to a table with a time column, "
                "which is one recording (in Python: load_recordings and from_recording)"
            )
        recording = load_recording(
            file,
            columns=_channels(table, found),
            delimiter=delimiter,
            decimal=decimal,
            header=table.header is not None,
            name=title,
        )
        return from_recording(recording, rest_length=rest_length, **levels)
    keep, notes = _kept(table, wanted, decimal, source)
    if where is None:
        _one_specimen(table, strange, source)
    if unused := [heading for heading in strange if heading not in wanted]:
        notes.append(f"columns not used: {', '.join(unused)}")
    notes += table.remarks
    values = {
        channel: _numbers(table, column, channel, source, decimal)[keep]
        for channel, column in found.items()
    }
    if "length" not in values:
        contraction = _fraction(values["contraction"], source)
        notes += _narrow(contraction, found["contraction"])
        values["length"] = rest_length * (1.0 - contraction)
    measured = ("length", "pressure", "force")
    length, pressure, force = (values[name] for name in measured)
    return ForceMap.from_arrays(
        length=length,
        pressure=pressure,
        force=force,
        rest_length=rest_length,
        direction=values.get("direction"),
        **levels,
        name=title,
        source=source,
        notes=notes,
        row_numbers=np.asarray(table.row_numbers)[keep].tolist(),
        units={name: found[name].unit for name in measured if name in found},
    )


def _table(
    file: Path, delimiter: str | None, decimal: str | None, columns: Columns | None
) -> tuple[str, Table]:
    """Table of a file, with or without headings, and the separator of its cells."""
    if not is_text(file):
        return ",", table_of(read_log(file))
    if delimiter is None:
        lines = [line for line in read_text(file).splitlines() if line.strip()]
        delimiter = dialect_of(lines[1:], str(file), None, decimal).delimiter
    listed = columns is not None and not isinstance(columns, Mapping)
    table = read_table(file, delimiter=delimiter, header=True)
    if not any(_NUMERIC.fullmatch(cell) for cell in table.header or []):
        return delimiter, table
    if not listed:
        raise RecordingError(
            f"{file}: the first row has numbers, {', '.join(table.header or [])[:60]!r}, and "
            'no headings: say what each column is, columns = ["length [mm]", "force [N]", "", '
            '"pressure [bar]"] in a .toml description (in Python: the argument columns)'
        )
    return delimiter, read_table(file, delimiter=delimiter, header=False)


def _calibrated(
    table: Table, columns: Columns | None, source: str
) -> tuple[list[str], dict[int, Calibration]]:
    """Headings of all columns, and the calibrations of those that have one."""
    problems: list[str] = []
    lines: dict[int, Calibration] = {}
    headings = []
    for index, entry in enumerate(renamed(table, columns, source)):
        if isinstance(entry, Mapping):
            unknown = [key for key in entry if key not in ("name", *CALIBRATION_KEYS)]
            if unknown or not isinstance(entry.get("name"), str):
                problems.append(
                    f"columns: {dict(entry)!r} is not allowed: name (a heading with its unit) with "
                    "scale and offset, or from and to"
                )
            else:
                lines[index] = read_calibration(problems, f"columns: {entry['name']}", entry)
            entry = str(entry.get("name", ""))
        headings.append(str(entry))
    if problems:
        raise RecordingError(joined(source, problems))
    return headings, lines


def _split(heading: str) -> tuple[str, str | None]:
    """Channel and unit of a heading; the channel as written if it is none that is known."""
    text = heading.strip()
    match = _HEADING.match(text)
    if match:
        name, unit = match["name"], match["unit"].strip()
        plain = name.strip().lower().replace(" ", "_")
        return _ALIASES.get(plain, plain), unit or None
    plain = text.lower().replace(" ", "_")
    if _ALIASES.get(plain, plain) in _UNITS:
        return _ALIASES.get(plain, plain), None
    name, _, unit = text.rpartition("_")
    plain = _ALIASES.get(name.lower(), name.lower())
    return (plain, unit) if plain in _UNITS else (text, None)


def _understood(
    headings: Sequence[str], lines: Mapping[int, Calibration], source: str
) -> tuple[dict[str, _Column], list[str]]:
    """Columns by channel, and the headings that are none."""
    problems: list[str] = []
    found: dict[str, _Column] = {}
    strange: list[str] = []
    for index, heading in enumerate(headings):
        if not heading.strip():
            continue
        channel, unit = _split(heading)
        if channel not in _UNITS:
            strange.append(heading)
            continue
        if channel in found:
            problems.append(
                f"column {heading!r}: {channel} is there twice (an empty name in columns leaves "
                "one out)"
            )
            continue
        if unit is None and channel == "direction":
            unit = "1"
        if unit is None:
            problems.append(
                f"column {heading!r} has no unit: write '{channel} [{_UNITS[channel]}]', with the "
                "unit its values are in"
            )
            continue
        try:
            to_si(1.0, unit, _UNITS[channel])
        except ParameterError as error:
            problems.append(f"column {heading!r}: {error}")
        found[channel] = _Column(index, heading, unit, lines.get(index, Calibration()))
    if not problems:
        lacking = [] if {"length", "contraction"} & set(found) else ["length"]
        lacking += [channel for channel in ("pressure", "force") if channel not in found]
        if lacking:
            problems.append(_lacking(lacking, headings, strange))
        if {"length", "contraction"} <= set(found):
            problems.append(
                "both length and contraction are there: leave one out with an empty name in columns"
            )
    if problems:
        raise RecordingError(joined(source, problems))
    return found, strange


def _lacking(channels: Sequence[str], headings: Sequence[str], strange: Sequence[str]) -> str:
    """Message on missing columns, with the headings that there are and a mapping to copy."""
    maps = []
    for channel in channels:
        fitting = [heading for heading in strange if _measures(heading, _UNITS[channel])]
        own, unit = "...", _UNITS[channel]
        if len(fitting) == 1:
            own, unit = fitting[0], _split(fitting[0])[1] or unit
        maps.append(f'"{own}" = "{channel} [{unit}]"')
    names = ", ".join(
        channel + (" (or contraction)" if channel == "length" else "") for channel in channels
    )
    return (
        f"no column for {names}; there are: {', '.join(headings)}. Rename the headings, or map "
        f"them with columns = {{ {', '.join(maps)} }} in a .toml description (in Python: the "
        "argument columns)"
    )


def _measures(heading: str, si_unit: str) -> bool:
    """True where a heading has a unit of this dimension."""
    match = _HEADING.match(heading)
    try:
        return match is not None and same_dimension(match["unit"].strip(), si_unit)
    except ParameterError:
        return False


def _numbers(table: Table, column: _Column, channel: str, source: str, decimal: str) -> Array:
    if channel == "direction" and not isinstance(table.cells(column.position), np.ndarray):
        return _direction_cells(table, column, source)
    values = table.numbers(column.position, column.heading, source, None, decimal)
    unit = parse_unit(column.unit)
    return np.asarray(column.line.of(values) * unit.scale + unit.offset)


def _direction_cells(table: Table, column: _Column, source: str) -> Array:
    cells = [str(cell) for cell in table.cells(column.position)]
    values = np.zeros(len(cells))
    for row, cell in enumerate(cells):
        text = cell.strip().lower()
        try:
            values[row] = _DIRECTIONS[text] if text in _DIRECTIONS else float(text)
        except ValueError:
            words = ", ".join(filter(None, _DIRECTIONS))
            raise RecordingError(
                f"{source}: column {column.heading!r}, row {table.row_numbers[row]}: {cell[:40]!r} "
                f"is not allowed: -1, 0, 1, {words}"
            ) from None
    return values


def _fraction(contraction: Array, source: str) -> Array:
    usual = float(np.nanmedian(np.abs(contraction))) if np.isfinite(contraction).any() else 0.0
    if usual > 1.0:
        raise RecordingError(
            f"{source}: contraction around {usual:.4g}: wrong unit? The column is probably in %"
        )
    return contraction


def _narrow(contraction: Array, column: _Column) -> list[str]:
    """A note if contractions in percent are as small as fractions would be."""
    finite = contraction[np.isfinite(contraction)]
    span = float(np.ptp(finite)) if len(finite) else 0.0
    small = 0.0 < span < _NARROW and float(np.max(np.abs(finite))) <= _NARROW
    if parse_unit(column.unit).scale == 1.0 or not small:
        return []
    said = f"contractions span only {100.0 * span:.2g} %"
    return [f"{said}: are they fractions? write contraction [1]"]


def _cells(table: Table, heading: str, source: str) -> list[str]:
    header = table.header or []
    if heading not in header:
        raise RecordingError(
            f"{source}: where names the column {heading!r}, but {has(heading, header)}"
        )
    return [str(cell).strip() for cell in table.cells(header.index(heading))]


def _kept(
    table: Table, where: Mapping[str, str], decimal: str, source: str
) -> tuple[Mask, list[str]]:
    """Rows that ``where`` asks for, and a note about the others."""
    keep = np.ones(len(table.row_numbers), dtype=bool)
    for heading, value in where.items():
        cells = _cells(table, heading, source)
        same = np.array([_alike(cell, value, decimal) for cell in cells])
        if not same.any():
            have = ", ".join(list(dict.fromkeys(cells))[:12])
            raise RecordingError(
                f"{source}: where: no row has {heading} = {value!r}; there are: {have}"
            )
        keep &= same
    others = int((~keep).sum())
    chosen = ", ".join(f"{heading} = {value}" for heading, value in where.items())
    if not others:
        return keep, []
    rows = f"{others} rows of the file are not {chosen} and belong"
    if others == 1:
        rows = f"1 row of the file is not {chosen} and belongs"
    return keep, [f"{rows} to another map"]


def _alike(cell: str, value: str, decimal: str) -> bool:
    if cell == value:
        return True
    try:
        return float(cell.replace(decimal, ".")) == float(value.replace(decimal, "."))
    except ValueError:
        return False


def _one_specimen(table: Table, strange: Sequence[str], source: str) -> None:
    """Refuse a table of several muscles when nobody says which one is meant."""
    for heading in strange:
        if heading.lower() in _SPECIMEN and heading in (table.header or []):
            values = list(dict.fromkeys(_cells(table, heading, source)))
            if len(values) > 1:
                raise RecordingError(
                    f"{source}: column {heading!r} has {len(values)} values "
                    f"({', '.join(values[:6])}): choose one, where {heading} = {values[0]}"
                )


def _channels(table: Table, found: Mapping[str, _Column]) -> list[str]:
    """Headings for :func:`load_recording`: canonical channels, ``""`` for the other columns."""
    if "contraction" in found:
        raise RecordingError(
            "a recording with a time column needs the column length, not contraction"
        )
    headings = [""] * table.width
    for channel, (index, _, unit, _) in found.items():
        if channel == "pressure":
            held = len(set(np.asarray(table.cells(index)).tolist())) < _SET_POINTS
            headings[index] = f"{'reference' if held else 'muscle_pressure'} [{unit}]"
        elif channel != "direction":
            headings[index] = f"{channel} [{unit}]"
    return headings


def from_recording(
    recording: Recording,
    *,
    rest_length: float,
    clipped: float | None = None,
    level_tolerance: float | None = None,
) -> ForceMap:
    """A force map from a bench's recording: slow length cycles at held pressures, or slow pressure
    cycles at held lengths (where rising pressure counts as contracting).

    Parameters
    ----------
    recording : Recording
        With the channels length, force and muscle_pressure (or reference, a pressure that is set).
    rest_length : float
        Length at zero contraction [m].
    clipped, level_tolerance : float, optional
        As in :meth:`ForceMap.from_arrays`.

    Returns
    -------
    ForceMap
        One row for each sample. The direction is that of the stroke between two turning points;
        near the turns, where the smoothed length moves at less than a tenth of its usual speed, it
        is 0. Masked samples are flagged.

    Raises
    ------
    RecordingError
        If a channel is missing or fewer than two samples are usable.
    """
    pressure = "muscle_pressure" if "muscle_pressure" in recording.channels else "reference"
    needed = ("length", pressure, "force")
    lacking = [channel for channel in needed if channel not in recording.channels]
    if lacking:
        raise RecordingError(
            f"recording {recording.name!r} has no channel {lacking[0]!r}; it has: "
            f"{', '.join(recording.channels)}"
        )
    return ForceMap.from_arrays(
        length=recording.channels["length"],
        pressure=recording.channels[pressure],
        force=recording.channels["force"],
        rest_length=rest_length,
        direction=series_ways(
            recording.channels["length"], recording.channels[pressure], rest_length
        ),
        clipped=clipped,
        level_tolerance=level_tolerance,
        faulty=~recording.valid(*needed),
        check_duplicates=False,
        name=recording.name,
        notes=[f"{issue.channel} at {issue.start:g} s: {issue.text}" for issue in recording.issues],
    )
