"""Tables that are in memory, as arrays by the channel's name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import as_said, is_quantity, misshapen, plain
from pamrs.channels import unit_of
from pamrs.errors import CaseError, ParameterError, joined
from pamrs.recordings._headed import HEADING

_NUMBERS = "biuf"  # kinds of arrays that are numbers
_DATES = "mM"  # kinds that are times
_MIXED = "OU"  # kinds that may be numbers among other things


class Arrays(NamedTuple):
    """A recording's channels.

    Attributes
    ----------
    values : dict of str to (n,) array
        By name.
    units : dict of str to str
        Of those whose table says it: in the heading (``muscle_pressure [bar]``), or in ``attrs`` of
        a column or a frame.
    """

    values: dict[str, Array]
    units: dict[str, str]


def is_table(thing: Any) -> bool:
    """True where something has channels by name: a dict, DataFrame or Dataset."""
    return isinstance(thing, Mapping) or hasattr(thing, "columns")


def arrays_of(
    recordings: Mapping[str, Any],
    held_out: Sequence[str],
    units: Mapping[str, str],
    sample_time: float | None,
) -> dict[str, Arrays]:
    """Arrays by recording and channel, ``time`` among them where a table has one, as a channel, an
    index or a coordinate.

    Parameters
    ----------
    recordings : mapping of str to mapping
        Dicts of arrays, DataFrames or Datasets.
    held_out : sequence of str
        Recordings that are not fitted.
    units : mapping of str to str
        Units by channel.
    sample_time : float, optional
        Spacing of the recordings without times.

    Raises
    ------
    CaseError
        Naming every recording or channel that is wrong, and what is allowed.
    """
    if not isinstance(recordings, Mapping) or not recordings:
        raise CaseError(
            f"recordings = {as_said(recordings)} is not allowed: a mapping from names to tables, "
            "one at least, is needed"
        )
    problems = list[str]()
    tables = {name: _table(problems, name, table, units) for name, table in recordings.items()}
    problems += [
        f"recording {name!r} has no times: give it a channel time [s], or sample_time"
        for name, table in tables.items()
        if table.values and "time" not in table.values and sample_time is None
    ]
    problems += _names(tables, held_out, units)
    if problems:
        raise CaseError(joined("case", problems))
    return tables


def _table(problems: list[str], name: Any, table: Any, given: Mapping[str, str]) -> Arrays:
    """Read the channels of one recording, with units given apart; adds to `problems`."""
    if not isinstance(name, str):
        problems.append(f"recording {name!r}: a name is needed that is a text")
    found = Arrays({}, {})
    if not is_table(table):
        needed = "a dict of arrays, DataFrame or Dataset is needed"
        problems.append(f"recording {name!r} = {as_said(table)}: {needed}")
        return found
    pairs = [(*_heading(key), values) for key, values in table.items()]
    if "time" not in [key for key, _, _ in pairs]:
        pairs += _times(table)
    keys = [key for key, _, _ in pairs]
    twice = [key for key in dict.fromkeys(keys) if keys.count(key) > 1]
    problems += [f"recording {name!r} has {key!r} twice" for key in twice]
    for key, unit, values in pairs:
        label = f"recording {name!r}, {key!r}"
        own = unit_of(key)
        if is_quantity(values):
            try:
                values = plain(label, values, own)
            except ParameterError as error:
                problems.append(str(error))
                continue
            unit = own
            if key in given:
                problems.append(f"{label} has a unit of its own: units[{key!r}] is not allowed")
        dated = key == "time" and np.asarray(values).dtype.kind in _DATES
        array = _array(problems, label, values, dates=dated)
        if array is not None:
            found.values[key] = array
            if said := "s" if dated else unit or _noted(key, values, table):
                found.units[key] = said
    if len(found.values) == len(pairs) and len({a.size for a in found.values.values()}) > 1:
        told = ", ".join(f"{key} {values.size}" for key, values in found.values.items())
        problems.append(f"recording {name!r}: arrays of one length are needed, not {told}")
    if not set(found.values) - {"time"}:
        problems.append(f"recording {name!r} has no channel but time")
    return found


def _heading(key: Any) -> tuple[Any, str]:
    """Name and unit of ``muscle_pressure [bar]``; the unit is empty where it has none."""
    match = HEADING.match(key) if isinstance(key, str) else None
    return (match["name"], match["unit"] or "") if match and match["unit"] else (key, "")


def _noted(key: str, values: Any, table: Any) -> str:
    """The unit of a channel in ``attrs`` of itself, or of its table by name; empty without."""
    for one in (values, table):
        units = (getattr(one, "attrs", None) or {}).get("units")
        if isinstance(units, Mapping):
            units = units.get(key)
        if isinstance(units, str):
            return units
    return ""


def _times(table: Any) -> list[tuple[str, str, Any]]:
    """Times of a table that are an index or a coordinate called ``time``."""
    if "time" in getattr(table, "coords", ()):
        return [("time", "", table.coords["time"])]
    index = getattr(table, "index", None)
    name, unit = _heading(getattr(index, "name", None))
    return [("time", unit, index)] if name == "time" else []


def _array(problems: list[str], label: str, values: Any, *, dates: bool) -> Array | None:
    """One channel; times since the first where they are dates."""
    masked = np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else None
    array = np.asarray(values)
    if dates and array.size:
        since = array - np.fmin.reduce(array) if array.dtype.kind == "M" else array
        array = since / np.timedelta64(1, "s")
    mixed = array.flat if array.dtype.kind in _MIXED else ()
    if wrong := [value for value in mixed if not _is_number(value)]:
        problems.append(f"{label} has values that are no numbers, such as {as_said(wrong[0])}")
        return None
    array = array.astype(np.float64) if array.dtype.kind == "O" else array
    if array.dtype.kind not in _NUMBERS:
        problems.append(f"{label} has the type {array.dtype}: numbers are needed")
        return None
    if array.ndim != 1 or array.size == 0:
        problems.append(str(misshapen(label, array.shape)))
        return None
    found = array.astype(np.float64)
    if masked is not None:
        found[masked] = np.nan
    return found


def _is_number(value: Any) -> bool:
    """True where a value converts to a float, or is None because it was not measured."""
    try:
        return value is None or float(value) is not None
    except (TypeError, ValueError):
        return False


def _names(
    tables: Mapping[str, Arrays], held_out: Sequence[str], units: Mapping[str, str]
) -> list[str]:
    """Problems of `held_out` and `units`: recordings or channels in them that do not exist."""
    known = ", ".join(map(repr, tables))
    channels = {key for table in tables.values() for key in table.values}
    problems = [f"units[{k!r}]: no recording has that channel" for k in units if k not in channels]
    if isinstance(held_out, str):
        return [*problems, f"held_out = {held_out!r}: a list of names is needed"]
    wrong = [name for name in held_out if name not in tables]
    if wrong:
        problems.append(f"held_out = {wrong}: recordings are {known}")
    elif set(held_out) == set(tables):
        problems.append(f"held_out = {list(held_out)}: one recording is needed that is fitted")
    return problems
