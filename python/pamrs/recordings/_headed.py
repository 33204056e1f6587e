"""Recordings out of files whose headings say it all: ``muscle_pressure [bar]``."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from pamrs.channels import CHANNELS, channel_of
from pamrs.errors import RecordingError, joined, meant
from pamrs.recordings._doubts import unit_trouble
from pamrs.recordings._from_log import check_asked, completed, recordings_of
from pamrs.recordings._mapping import Clock, Source
from pamrs.recordings._recording import Issue, Recording
from pamrs.recordings.dialect import check_marks
from pamrs.recordings.logs import Log, Series, read_log, table_of
from pamrs.recordings.table import Table, is_text, read_table, renamed, stem_of, thousands_of
from pamrs.units import measured_from

HEADING: Final = re.compile(r"^\s*(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*$")


def load_recording(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[str] | Mapping[str, str] | None = None,
    delimiter: str = ",",
    header: bool = True,
    thousands: str | Mapping[str, str] | None = None,
    sample_time: float | None = None,
    decimal: str = ".",
    name: str | None = None,
    role: str = "fit",
    ambient_pressure: float | None = None,
) -> Recording:
    """Read a recording, check it and lay it on a uniform grid.

    Parameters
    ----------
    path : path-like
        ``.csv``, ``.tsv``, ``.txt``, ``.dat`` (each also ``.gz``), or any other log that
        :func:`pamrs.recordings.logs.read_log` reads, such as ``.parquet``.
    columns : sequence or mapping of str, optional
        Headings ``"name [unit]"`` to use instead of the file's: one for each column in order, or a
        mapping from the file's headings. An empty heading leaves the column out.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    header : bool
        Whether the first row holds headings.
    thousands : str or mapping, optional
        Mark between groups of digits, of all columns or by channel: ``{"time": "."}``.
    sample_time : float, optional
        Grid spacing [s]; without a time column, the spacing of the rows. Else the usual interval.
    decimal : str
        Decimal mark.
    name, role : str
        Name (default: the file's stem) and role, ``fit`` or ``held_out``.
    ambient_pressure : float, optional
        What is subtracted from absolute pressures (``bar(a)``) where the file has no channel
        ``ambient_pressure`` [Pa]; by default that of the standard atmosphere.

    Returns
    -------
    Recording
        SI values with masks and issues.

    Raises
    ------
    RecordingError
        If the file cannot be read or a column cannot be understood; the message names file and
        column.
    """
    file = Path(path)
    source = str(file)
    check_asked(source, role, sample_time)
    check_marks(delimiter, decimal, source)
    marks = {thousands} if isinstance(thousands, str) else set((thousands or {}).values())
    if decimal == "," and decimal in marks:  # a column whose points part thousands has no fractions
        raise RecordingError(
            f"{source}: thousands = {decimal!r} is not allowed: it is the decimal mark"
        )
    if file.is_dir():
        raise RecordingError(f"{source}: cannot be read (a folder, not a file)")
    if not header and not isinstance(columns, Sequence):
        raise RecordingError(
            f"{source}: without a header, columns must list what each column is: 'name [unit]'"
        )
    if is_text(file):
        table = read_table(file, delimiter=delimiter, header=header)
    else:
        table = table_of(read_log(file))
    wanted = _understood(renamed(table, columns, source), source)
    if "time" not in wanted and sample_time is None:
        raise RecordingError(
            f"{source}: column 'time' is missing (give sample_time if the rows are evenly spaced)"
        )
    log, missing = _log(file, table, wanted, thousands, decimal)
    clock = Clock("time", wanted["time"][1]) if "time" in wanted else Clock()
    sources = [
        Source(channel, channel, unit, absolute)
        for channel, (_, unit, absolute) in wanted.items()
        if channel != "time"
    ]
    (made,) = recordings_of(log, sources, clock, name or stem_of(file), role, sample_time)
    issues = [Issue("log", channel, 0.0, made.duration, text) for channel, text in missing]
    made = replace(made, issues=[*issues, *made.issues])
    return completed(made, sources, source, ambient_pressure)


# ------------------------------------------------------------------------- columns


def _understood(headings: list[str], source: str) -> dict[str, tuple[int, str, bool]]:
    """Canonical name -> (column, unit, whether absolute) of every heading that is to be used."""
    problems: list[str] = []
    wanted: dict[str, tuple[int, str, bool]] = {}
    for index, heading in enumerate(headings):
        if not heading.strip():
            continue
        match = HEADING.match(heading)
        name = match["name"] if match else heading
        channel = channel_of(name)
        known = channel in CHANNELS and (channel != "time" or name == channel)
        if match is None or not known or name.endswith("."):
            hint = meant(channel.lower(), CHANNELS)
            problems.append(
                f"unknown column {heading!r}; {hint} (columns = {{{heading!r} = ''}} leaves it out)"
            )
            continue
        unit = match["unit"]
        if unit is None or not unit.strip():
            problems.append(
                f"column {heading!r} has no unit: write '{name} [{CHANNELS[channel].unit}]', with "
                "the unit its values are in"
            )
        elif name in wanted:
            problems.append(f"column {heading!r}: the channel {name!r} is there twice")
        else:
            alone, kind = measured_from(unit.strip())
            if trouble := unit_trouble(channel, alone):
                problems.append(f"column {heading!r}: {trouble}")
            wanted[name] = (index, alone, kind == "absolute")
    if not problems and not set(wanted) - {"time"}:
        problems.append("there is no channel to use")
    if problems:
        raise RecordingError(joined(source, problems))
    return wanted


def _log(
    file: Path,
    table: Table,
    wanted: Mapping[str, tuple[int, str, bool]],
    thousands: str | Mapping[str, str] | None,
    decimal: str,
) -> tuple[Log, list[tuple[str, str]]]:
    """The channels of a table as series; what is no number counts as missing, and is said."""
    if isinstance(thousands, Mapping):
        strange = [key for key in thousands if key not in wanted]
        if strange:
            raise RecordingError(
                f"{file}: thousands names {strange[0]!r}, but the channels are: {', '.join(wanted)}"
            )
    series: dict[str, Series] = {}
    remarks: list[tuple[str, str]] = []
    for name, (index, unit, _) in wanted.items():
        mark = thousands_of(thousands, name)
        values, missing = table.samples(index, f"{name} [{unit}]", str(file), mark, decimal)
        remarks += [(name, missing)] if missing else []
        series[name] = Series(name, values, unit)
    return Log(file, series, remarks=table.remarks), remarks
