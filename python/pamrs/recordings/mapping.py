"""Maps series of a log to channels: every key that ``case.toml`` may have, calibrations from the
numbers of a log to values, and the keys ``channels`` and ``time`` of a recording.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import CHANNELS, channel_of
from pamrs.declared import Rule, holds, is_finite, is_name, is_text, problems_of
from pamrs.errors import ParameterError, RecordingError, joined, meant
from pamrs.recordings._doubts import unit_trouble
from pamrs.units import measured_from, parse_unit, to_si

#: Keys of an entry that say a calibration.
CALIBRATION_KEYS: Final = ("scale", "offset", "from", "to")


class Calibration(NamedTuple):
    """Line or table from the numbers of a log to values.

    Attributes
    ----------
    scale, offset : float
        A value is ``scale * raw + offset``.
    table : tuple of tuple of float, optional
        Instead of them: three or more numbers of the log, rising, and the values that they stand
        for. Straight between neighbours, and beyond the ends as in the last interval.
    """

    scale: float = 1.0
    offset: float = 0.0
    table: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    def of(self, raw: Array | float) -> Array:
        """Convert numbers of the log to values."""
        numbers = np.asarray(raw, dtype=np.float64)
        if self.table is None:
            return np.asarray(self.scale * numbers + self.offset)
        given, stand_for = map(np.asarray, self.table)
        place = np.clip(np.searchsorted(given, numbers) - 1, 0, len(given) - 2)
        slope = np.diff(stand_for) / np.diff(given)
        return np.asarray(stand_for[place] + slope[place] * (numbers - given[place]))


def read_calibration(problems: list[str], label: str, entry: Mapping[str, Any]) -> Calibration:
    """Read the keys ``scale`` and ``offset``, or ``from`` and ``to``, of an entry.

    Parameters
    ----------
    problems : list of str
        Gets what is wrong.
    label : str
        What the entry is called, for messages.
    entry : mapping
        The entry, with other keys or not.

    Returns
    -------
    Calibration
        That which changes nothing where the entry says none, or where it is wrong.
    """
    if ("from" in entry) != ("to" in entry) or (
        "from" in entry and {"scale", "offset"} & set(entry)
    ):
        problems.append(
            f"{label}: from and to belong together, like from = [0, 4095], to = [0, 10], and "
            "replace scale and offset"
        )
        return Calibration()
    if "from" in entry:
        return _readings(problems, label, entry["from"], entry["to"])
    for key in ("scale", "offset"):
        value = entry.get(key, 1.0)
        if not is_finite(value) or (key == "scale" and value == 0):
            needed = "a number other than zero" if key == "scale" else "a number"
            problems.append(f"{label}.{key} = {value!r} is not allowed: {needed} is needed")
            return Calibration()
    return Calibration(float(entry.get("scale", 1.0)), float(entry.get("offset", 0.0)))


def _readings(problems: list[str], label: str, given: Any, stand_for: Any) -> Calibration:
    lists = [given, stand_for]
    if not all(
        isinstance(each, (list, tuple)) and len(each) > 1 and all(map(is_finite, each))
        for each in lists
    ) or len(given) != len(stand_for):
        problems.append(
            f"{label}: from = {given!r}, to = {stand_for!r} is not allowed: as many numbers in "
            "both, two at least"
        )
        return Calibration()
    rises = [b > a for a, b in itertools.pairwise(given)]
    falls = [b < a for a, b in itertools.pairwise(given)]
    if not (all(rises) or all(falls)) or min(stand_for) == max(stand_for):
        problems.append(
            f"{label}: from = {given!r}, to = {stand_for!r}: two equal numbers, or from neither "
            "rises nor falls all the way"
        )
        return Calibration()
    if len(given) == 2:
        scale = (stand_for[1] - stand_for[0]) / (given[1] - given[0])
        return Calibration(scale, stand_for[0] - scale * given[0])
    way = 1 if rises[0] else -1
    return Calibration(table=(tuple(map(float, given[::way])), tuple(map(float, stand_for[::way]))))


SCHEMA: Final = "pamrs.case/1"
ROLES: Final = ("fit", "held_out")
ERRORS: Final = ("same", "proportional", "none", "own")
#: How a text file is written.
DIALECT: Final = ("delimiter", "decimal", "thousands", "header")
FORMAT: Final = ("columns", "delimiter", "header", "thousands", "sample_time", "decimal")
#: What goes with ``channels``.
LOG: Final = ("channels", "time", "split", "pieces")


def _one_of(*allowed: str) -> Callable[[Any], bool]:
    return lambda value: value in allowed


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool)


TOP: Final[dict[str, Rule]] = {
    "schema": Rule(_one_of(SCHEMA), repr(SCHEMA)),
    "name": Rule(is_text, "a text", "default: that of the folder"),
    "description": Rule(is_text, "a text"),
    "rig": Rule(is_text, "a text", "file of the rig, relative to this one; default rig.toml"),
    "source": Rule(is_text, "a text", "where to get recordings that are not there"),
    "recording": Rule(None, "a table for each"),
}
#: Of ``[[recording]]``; the order is that of messages.
ENTRY: Final[dict[str, Rule]] = {
    "file": Rule(is_name, "a file name", "relative to this file"),
    "name": Rule(is_name, "a text", "default: the file's stem"),
    "role": Rule(_one_of(*ROLES), "'fit' or 'held_out'", "held_out: kept for the proof"),
    "start": Rule(is_finite, "a number of seconds", "only from then on [s]"),
    "stop": Rule(is_finite, "a number of seconds", "only until then [s]"),
    "parameters": Rule(
        None,
        "a table",
        "values of the rig that were others in this recording, by dotted name: value, unit and "
        f"maybe error ({', '.join(ERRORS)}), how its error goes with that of the rig file",
    ),
    "columns": Rule(
        holds((list, Mapping), is_text),
        "a list of headings, or a table from headings to headings",
        "what each column is: 'name [unit]'",
    ),
    "delimiter": Rule(
        lambda value: isinstance(value, str) and len(value) == 1,
        "one character",
        "between columns",
    ),
    "header": Rule(_is_flag, "true or false", "whether the first line has headings"),
    "thousands": Rule(
        holds((str, Mapping), is_text),
        "a mark, or a table from channels to marks",
        "between groups of digits",
    ),
    "sample_time": Rule(is_finite, "a number of seconds", "spacing of the samples [s]"),
    "decimal": Rule(_one_of(".", ","), "'.' or ','", "the decimal mark"),
    "channels": Rule(None, "a table", "where each channel is in the log"),
    "time": Rule(None, "a series, or a table", "the series with the times"),
    "split": Rule(
        None,
        "'clock' or a table",
        "where one recording ends and the next begins: 'clock', or a table with gap (a pause of "
        "more seconds) or column (a series that changes)",
    ),
    "pieces": Rule(
        lambda value: isinstance(value, list) and len(value) > 0,
        "a list of numbers or texts of parts",
        "which parts, counted from 1, or their texts",
    ),
}
#: What is another thing where the entry says its channels.
OF_A_LOG: Final[dict[str, Rule]] = {
    "columns": Rule(holds(list, is_text), "a list of names, one for each column"),
    "thousands": Rule(is_text, "a mark"),
}

_ASSUMED: Final = Rule(is_text, "a text", "why the unit is assumed, where the log says none")
#: The table of a clock.
CLOCK: Final[dict[str, Rule]] = {
    "column": Rule(is_name, "a text", "the series with the times"),
    "unit": Rule(is_name, "a text", "of these times"),
    "offset": Rule(is_finite, "a number of seconds", "added to the times [s]"),
}
#: The table of a channel that is in the log; ``unit`` is that of the channel.
CHANNEL: Final[dict[str, Rule]] = {
    "column": Rule(is_name, "a text", "its series in the log"),
    "less": Rule(is_name, "a text", "a second series, taken off it before what follows"),
    "unit": Rule(is_name, "a text"),
    **dict.fromkeys(
        CALIBRATION_KEYS, Rule(None, "a calibration", "value = scale raw + offset, or from to")
    ),
    "time": Rule(None, "a series, or a table", "its own clock"),
    "hold": Rule(_is_flag, "true or false", "logged on change: a value holds until the next"),
    "assumed": _ASSUMED,
}
#: That of a channel that had one value all the time.
CONSTANT: Final[dict[str, Rule]] = {
    "value": Rule(is_finite, "a number", "what it was all the time"),
    "unit": Rule(is_name, "a text"),
    "assumed": _ASSUMED,
}
CASE_KEYS: Final[dict[str, dict[str, Rule]]] = {
    "": TOP,
    "recording": ENTRY,
    "recording.channels.NAME": CHANNEL,
    "recording.channels.NAME, of a constant": CONSTANT,
    "recording.time": CLOCK,
}
"""Keys of ``case.toml`` by their table, ``""`` for the file itself."""


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
