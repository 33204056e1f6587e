"""Every key that ``case.toml`` may have, by the table in which it stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from pamrs.declared import Rule, holds, is_finite, is_name, is_text
from pamrs.recordings.calibration import KEYS

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
#: The table of a channel that stands in the log; ``unit`` is that of the channel.
CHANNEL: Final[dict[str, Rule]] = {
    "column": Rule(is_name, "a text", "its series in the log"),
    "less": Rule(is_name, "a text", "a second series, taken off it before what follows"),
    "unit": Rule(is_name, "a text"),
    **dict.fromkeys(KEYS, Rule(None, "a calibration", "value = scale raw + offset, or from to")),
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
