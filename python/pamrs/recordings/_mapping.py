"""Maps series of a log to channels: the keys ``channels`` and ``time`` of a recording."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import CHANNELS, channel_of
from pamrs.declared import problems_of
from pamrs.errors import ParameterError, RecordingError, joined, meant
from pamrs.recordings._case_keys import CHANNEL, CLOCK, CONSTANT
from pamrs.recordings._doubts import unit_trouble
from pamrs.recordings.calibration import Calibration, read_calibration
from pamrs.units import measured_from, parse_unit, to_si


@dataclass(frozen=True)
class Clock:
    """Clock of a channel: the times at which its samples were taken.

    Attributes
    ----------
    column : str, optional
        The series with the times; by default the clock that the log has for the channel.
    unit : str, optional
        Unit of that series; by default what the log says, else seconds.
    offset : float
        Added to the times [s]: what this clock is behind that of the other channels.
    """

    column: str | None = None
    unit: str | None = None
    offset: float = 0.0


@dataclass(frozen=True)
class Source:
    """Series of a log that gives a channel, with the calibration from its numbers to `unit`.

    Attributes
    ----------
    channel : str
        Its name, ``muscle_pressure``.
    column : str
        The series of the log; empty for a channel that had one value all the time.
    unit : str
        Unit of the values.
    absolute : bool
        Whether that is an absolute pressure.
    less : str
        A second series of the log, taken off the first one number by number; empty for none.
    line : Calibration
        From the numbers of the log.
    value : float
        For a channel with one value, that, in `unit`.
    clock : Clock, optional
        Its own; by default that of the recording.
    hold : bool
        It was logged on change: a value holds until the next one.
    assumed : str
        Why the unit is assumed, where the log says none.
    """

    channel: str
    column: str
    unit: str
    absolute: bool = False
    less: str = ""
    line: Calibration = Calibration()
    value: float = math.nan
    clock: Clock | None = None
    hold: bool = False
    assumed: str = ""

    def si(self, raw: Array | float) -> Array:
        """Values in SI of numbers of the log; absolute pressures stay absolute."""
        unit = parse_unit(self.unit)
        return np.asarray(self.line.of(raw) * unit.scale + unit.offset)


def read_sources(channels: Any, source: str) -> list[Source]:
    """Read the table ``channels`` of a recording.

    Parameters
    ----------
    channels : mapping
        From names of channels to tables with ``column``, ``unit`` and what else there is, or with
        ``value`` and ``unit``.
    source : str
        The file, for messages.

    Returns
    -------
    list of Source

    Raises
    ------
    RecordingError
        Naming every entry that is wrong, its value and what is allowed.
    """
    if not isinstance(channels, Mapping) or not channels:
        raise RecordingError(
            f"{source}: channels = {channels!r} is not allowed: a table from channels to "
            '{ column = "...", unit = "..." } is needed'
        )
    problems: list[str] = []
    made = [_source(problems, name, entry) for name, entry in _flat(channels)]
    if problems:
        raise RecordingError(joined(source, problems))
    return [each for each in made if each is not None]


def _flat(channels: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """``muscle_pressure.flexor = {...}`` is a table in a table for TOML."""
    for name, entry in channels.items():
        nested = isinstance(entry, Mapping) and not {"column", "value"} & set(entry) and entry
        if nested and all(isinstance(inside, Mapping) for inside in entry.values()):
            yield from ((f"{name}.{block}", inside) for block, inside in entry.items())
        else:
            yield name, entry


def _source(problems: list[str], name: str, entry: Any) -> Source | None:
    label = f"channels.{name}"
    channel = channel_of(name)
    if channel not in CHANNELS or channel == "time" or name.endswith("."):
        known = [key for key in CHANNELS if key != "time"]
        hint = meant(channel.lower(), known)
        hint = "times are given by the key time" if channel == "time" else hint
        problems.append(f"{label}: unknown channel {name!r}; {hint}")
        return None
    if not isinstance(entry, Mapping):
        problems.append(f'{label} = {entry!r} is not allowed: {{ column = "...", unit = "..." }}')
        return None
    before, constant = len(problems), "value" in entry
    rules = CONSTANT if constant else CHANNEL
    needed = ("unit",) if constant else ("column", "unit")
    problems += problems_of(f"{label}.", entry, rules, needed=needed, skip=("time",))
    if len(problems) > before:
        return None
    unit, kind = measured_from(entry["unit"])
    if trouble := unit_trouble(channel, unit):
        problems.append(f"{label}.unit: {trouble}")
    shared = {"absolute": kind == "absolute", "assumed": entry.get("assumed", "")}
    if constant:
        return Source(name, "", unit, value=float(entry["value"]), **shared)
    line = read_calibration(problems, label, entry)
    clock = _clock(problems, f"{label}.time", entry["time"]) if "time" in entry else None
    hold = entry.get("hold", False)
    shared["less"] = entry.get("less", "")
    return Source(name, entry["column"], unit, line=line, clock=clock, hold=hold, **shared)


def read_clock(time: Any, source: str) -> Clock:
    """Read the key ``time`` of a recording.

    Parameters
    ----------
    time : str or mapping, optional
        The name of a series, or a table with ``column``, ``unit`` and ``offset``.
    source : str
        The file, for messages.

    Returns
    -------
    Clock

    Raises
    ------
    RecordingError
        If it is none of these.
    """
    problems: list[str] = []
    clock = Clock() if time is None else _clock(problems, "time", time)
    if problems:
        raise RecordingError(joined(source, problems))
    return clock


def _clock(problems: list[str], label: str, entry: Any) -> Clock:
    if isinstance(entry, str) and entry:
        return Clock(entry)
    if not isinstance(entry, Mapping):
        problems.append(
            f"{label} = {entry!r} is not allowed: the name of a series, or a table with column, "
            "unit and offset"
        )
        return Clock()
    wrong = problems_of(f"{label}.", entry, CLOCK)
    problems += wrong
    if wrong:
        return Clock()
    column, unit, offset = entry.get("column"), entry.get("unit"), entry.get("offset", 0.0)
    if unit is not None:
        try:
            to_si(1.0, unit, "time")
        except ParameterError as error:
            problems.append(f"{label}.unit: {error}")
    return Clock(column, unit, float(offset))
