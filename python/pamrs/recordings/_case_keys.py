"""What ``case.toml`` may say: one declaration, by which it is read and its JSON schema is made."""

from __future__ import annotations

from typing import Any, Final

from pamrs.channels import CHANNELS
from pamrs.declared import (
    BOOLEAN,
    NAME,
    NUMBER,
    TEXT,
    Rule,
    document,
    table,
    unit_text,
)
from pamrs.recordings.calibration import KEYS

SCHEMA: Final = "pamrs.case/1"
ROLES: Final = ("fit", "held_out")
ERRORS: Final = ("same", "proportional", "none", "own")
#: How a text file is written.
DIALECT: Final = ("delimiter", "decimal", "thousands", "header")
FORMAT: Final = ("columns", "delimiter", "header", "thousands", "sample_time", "decimal")
#: What goes with ``channels``.
LOG: Final = ("channels", "time", "split", "pieces")

_CHARACTER: Final = {"type": "string", "minLength": 1, "maxLength": 1}
_TEXTS: Final = {"type": "array", "items": TEXT}
_BY_NAME: Final = {"type": "object", "additionalProperties": TEXT}
_OWN_VALUE: Final = table(
    {
        "value": Rule(NUMBER, "a number"),
        "unit": Rule(TEXT, "a unit", "needed where there is a value"),
        "error": Rule(
            {"enum": [*ERRORS]}, "one of them", "how its error goes with that of the rig file"
        ),
    }
)

TOP: Final[dict[str, Rule]] = {
    "schema": Rule({"const": SCHEMA}, repr(SCHEMA)),
    "name": Rule(TEXT, "a text", "default: that of the folder"),
    "description": Rule(TEXT, "a text"),
    "rig": Rule(TEXT, "a text", "file of the rig, relative to this one; default rig.toml"),
    "source": Rule(TEXT, "a text", "where to get recordings that are not there"),
    "recording": Rule({"type": "array", "minItems": 1}, "a table for each"),
}
#: Of ``[[recording]]``; the order is that of messages.
ENTRY: Final[dict[str, Rule]] = {
    "file": Rule(NAME, "a file name", "relative to this file"),
    "name": Rule(NAME, "a text", "default: the file's stem"),
    "role": Rule({"enum": [*ROLES]}, "'fit' or 'held_out'", "held_out: kept for the proof"),
    "start": Rule(NUMBER, "a number of seconds", "only from then on [s]"),
    "stop": Rule(NUMBER, "a number of seconds", "only until then [s]"),
    "parameters": Rule(
        {"type": "object", "additionalProperties": _OWN_VALUE},
        "a table",
        "values of the rig that were others in this recording, by dotted name",
    ),
    "columns": Rule(
        {"anyOf": [_TEXTS, _BY_NAME]},
        "a list of headings, or a table from headings to headings",
        "what each column is: 'name [unit]'",
    ),
    "delimiter": Rule(_CHARACTER, "one character", "between columns"),
    "header": Rule(BOOLEAN, "true or false", "whether the first line has headings"),
    "thousands": Rule(
        {"anyOf": [TEXT, _BY_NAME]},
        "a mark, or a table from channels to marks",
        "between groups of digits",
    ),
    "sample_time": Rule(NUMBER, "a number of seconds", "spacing of the samples [s]"),
    "decimal": Rule({"enum": [".", ","]}, "'.' or ','", "the decimal mark"),
    "channels": Rule({}, "a table", "where each channel is in the log"),
    "time": Rule({}, "a series, or a table", "the series with the times"),
    "split": Rule({}, "'clock' or a table", "where one recording ends and the next begins"),
    "pieces": Rule(
        {"type": "array", "minItems": 1},
        "a list of numbers or texts of parts",
        "which parts, counted from 1, or their texts",
    ),
}
#: What is another thing where the entry says its channels.
OF_A_LOG: Final[dict[str, Rule]] = {
    "columns": Rule(_TEXTS, "a list of names, one for each column"),
    "thousands": Rule(TEXT, "a mark"),
}

_ASSUMED: Final = Rule(TEXT, "a text", "why the unit is assumed, where the log says none")
#: The table of a clock.
CLOCK: Final[dict[str, Rule]] = {
    "column": Rule(NAME, "a text", "the series with the times"),
    "unit": Rule(unit_text("s"), "a unit of time"),
    "offset": Rule(NUMBER, "a number of seconds", "added to the times [s]"),
}
_CLOCK: Final = {"anyOf": [NAME, table(CLOCK)]}
#: The table of a channel that stands in the log; ``unit`` is that of the channel.
CHANNEL: Final[dict[str, Rule]] = {
    "column": Rule(NAME, "a text", "its series in the log"),
    "unit": Rule(NAME, "a text"),
    **{name: Rule({}, "a calibration", "value = scale raw + offset, or from to") for name in KEYS},
    "time": Rule(_CLOCK, "a clock", "its own clock"),
    "hold": Rule(BOOLEAN, "true or false", "logged on change: a value holds until the next"),
    "assumed": _ASSUMED,
}
#: That of a channel that had one value all the time.
CONSTANT: Final[dict[str, Rule]] = {
    "value": Rule(NUMBER, "a number", "what it was all the time"),
    "unit": Rule(NAME, "a text"),
    "assumed": _ASSUMED,
}


def case_schema() -> dict[str, Any]:
    """The JSON schema of ``case.toml``."""
    found = table(TOP, ["schema", "recording"])
    entry = table(ENTRY | {"time": Rule(_CLOCK, ""), "split": Rule(_SPLIT, "")}, ["file"])
    entry["properties"]["channels"] = {
        **_channels(),
        "description": ENTRY["channels"].about,
    }
    alone: dict[str, Any] = {name: False for name in LOG if name != "channels"}
    mapped = {name: rule.schema for name, rule in OF_A_LOG.items()}
    entry |= {
        "if": {"required": ["channels"]},
        "then": {"properties": mapped},
        "else": {"properties": alone},
    }
    found["properties"]["recording"] |= {"items": entry}
    about = "Recordings made on a rig, as pamrs reads them."
    return document(SCHEMA, about, found, {})


_SPLIT: Final = {
    "anyOf": [
        {"const": "clock"},
        {**table({"gap": Rule({**NUMBER, "exclusiveMinimum": 0}, "")}, ["gap"])},
        {**table({"column": Rule(NAME, "")}, ["column"])},
    ]
}


def _channels() -> dict[str, Any]:
    """Channels by name, those of several blocks as ``name.block`` or as a table of blocks."""
    properties, patterns = {}, {}
    for name in CHANNELS:
        if name == "time":
            continue
        units = CHANNELS[name].possible
        unit = {"anyOf": [unit_text(unit, absolute=unit == "Pa") for unit in units]}
        own = {
            "anyOf": [
                table(rules | {"unit": Rule(unit, "")}, needed)
                for rules, needed in ((CHANNEL, ["column", "unit"]), (CONSTANT, ["value", "unit"]))
            ]
        }
        several = {"type": "object", "minProperties": 1, "additionalProperties": own}
        properties[name] = {"anyOf": [*own["anyOf"], several]}
        patterns[rf"^{name}\..+$"] = own
    return {
        "type": "object",
        "minProperties": 1,
        "properties": properties,
        "patternProperties": patterns,
        "additionalProperties": False,
    }
