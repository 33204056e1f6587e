"""Stated error of the model: ``[model_error]`` of a rig file.

An entry is named after a kind of block (``muscle = "1 %"``, a share of what the block does to its
output) or after a measured channel (``joint_angle = "0.1 deg"``, a size, or a share of the range
that it visits). It is one standard deviation of a smooth curve that stays what it is, as the error
of a force over the stroke or of an encoder over the angle does (docs/decisions/0095).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from pamrs.channels import UNITS, channel_of
from pamrs.rig.schema import qualified, tables_of

if TYPE_CHECKING:
    from pamrs.rig._reader import Reader

#: Kinds of block whose error can be stated, as a share.
ERROR_BLOCKS: Final = (
    "supply", "valve", "line", "chamber", "muscle", "transmission", "joint", "arm", "link", "load",
)  # fmt: skip
#: Measured channels whose error can be stated, and the blocks of which there has to be one.
ERROR_CHANNELS: Final = {
    "supply_pressure": "supply",
    "muscle_pressure": "chamber",
    "temperature": "chamber",
    "joint_angle": "joint",
    "length": "load",
}
#: A number and its unit, as a pattern.
_TEXT: Final = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S.*?)\s*")


def read_model_error(reader: Reader, raw: Any, model: Mapping[str, Any]) -> dict[str, Any]:
    """The table ``[model_error]`` in SI.

    Parameters
    ----------
    reader : Reader
        Notes what is wrong.
    raw : object
        The table as TOML has it, None where there is none.
    model : mapping
        The blocks that were read.

    Returns
    -------
    dict
        Name -> ``{"share": number}`` or ``{"size": SI value}``.
    """
    if raw is None:
        return {}
    if not isinstance(raw, Mapping):
        reader.refuse("model_error", raw, "a table [model_error] is needed")
        return {}
    found = {}
    for name, entry in _flat(raw):
        kind = channel_of(name)
        if kind not in (*ERROR_BLOCKS, *ERROR_CHANNELS):
            reader.unknown_keys("model_error.", [kind], [*ERROR_BLOCKS, *ERROR_CHANNELS])
            continue
        block, own = ERROR_CHANNELS.get(kind, kind), name.partition(".")[2]
        tables = tables_of(model, block)
        if not tables or (own and own not in tables):
            reader.problems.append(
                f"model_error.{name} is not allowed: the rig has no {qualified(block, own)}"
            )
            continue
        value = _value(reader, name, entry)
        if value is not None:
            found[name] = value
    return found


def _flat(raw: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Entries by dotted name: ``muscle_pressure.flexor`` may be a table in a table."""
    for name, entry in raw.items():
        if isinstance(entry, Mapping) and not {"value", "unit"} & {*entry}:
            yield from ((f"{name}.{own}", inner) for own, inner in entry.items())
        else:
            yield name, entry


def _value(reader: Reader, name: str, entry: Any) -> dict[str, float] | None:
    """A share or a size, written as ``"1 %"`` or as ``{ value = 1, unit = "%" }``."""
    label, kind = f"model_error.{name}", channel_of(name)
    si_unit = UNITS[kind] if kind in ERROR_CHANNELS else ""
    like = "'1 %'" + (f" or '0.1 {si_unit}'" if si_unit else "")
    if isinstance(entry, Mapping):
        number, unit = entry.get("value"), entry.get("unit")
    else:
        match = _TEXT.fullmatch(entry) if isinstance(entry, str) else None
        number, unit = (_number(match[1]), match[2]) if match else (None, None)
    if number is None or not isinstance(unit, str):
        reader.refuse(label, entry, f"a text like {like} is needed")
        return None
    if unit == "%":
        share = reader.scalar(label, "1", number, "%", 0.0, 1.0)
        return None if share is None else {"share": share}
    if not si_unit:
        reader.refuse(label, entry, f"of a block a share like {like}")
        return None
    size = reader.scalar(label, si_unit, number, unit, 0.0, 1e300, difference=True)
    return None if size is None else {"size": size}


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def error_lines(model: Mapping[str, Any]) -> list[str]:
    """``[model_error]`` as lines of TOML; none where nothing is stated."""
    stated = model.get("model_error") or {}
    lines = ["", "[model_error]"] if stated else []
    for name, value in stated.items():
        key = f'"{name}"' if "." in name else name
        if "share" in value:
            number, unit = 100.0 * value["share"], "%"
        else:
            number, unit = value["size"], UNITS[channel_of(name)]
        lines.append(f'{key} = {{ value = {float(number)!r}, unit = "{unit}" }}')
    return lines
