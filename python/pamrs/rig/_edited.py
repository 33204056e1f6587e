"""A rig file written again with the numbers of another rig: comments, order and units of its author
stay, and only what differs is written anew.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from typing import Any, Final

import tomlkit
import tomlkit.items
from tomlkit.exceptions import TOMLKitError

from pamrs.errors import ParameterError, RigError
from pamrs.rig._reader import Content, read_model
from pamrs.rig._switching import kind_of_entry
from pamrs.rig._writer import entry_text, toml_text
from pamrs.rig.schema import BLOCKS, Key
from pamrs.units import from_si, to_si

#: How far a number is looked for that converts to the very same number in SI, in units in the last
#: place; beyond, the value is written in SI.
_NEIGHBOURS: Final = 4
#: Tables that are written whole where they differ.
_WHOLE: Final = ("limits", "model_error")


def edited_text(text: str, content: Content) -> str:
    """A rig file with the content of another rig.

    Parameters
    ----------
    text : str
        The file's text.
    content : Content
        What it is to say.

    Returns
    -------
    str
        The text with every value, block and effect that differs written anew, in the unit that the
        file has for it where that gives the same number to the last bit. Where the text cannot be
        brought to say it, `content` in SI units without comments.
    """
    plain = toml_text(content)
    try:
        before = toml_text(read_model(text, "rig"))
        if before == plain:
            return text
        document = tomlkit.parse(text)
        _edit(document, tomllib.loads(before), tomlkit.parse(plain), ())
        edited = tomlkit.dumps(document)
        return edited if toml_text(read_model(edited, "rig")) == plain else plain
    except (RigError, ParameterError, TOMLKitError):
        return plain


def _edit(place: Any, before: Mapping[str, Any], after: Any, path: tuple[str, ...]) -> None:
    """Bring a table of the file from one content to another, both as they are written in SI."""
    for name in before:
        if name not in after and name in place:
            place.remove(name)
    for name, wanted in after.items():
        old, new = before.get(name), tomlkit.item(wanted).unwrap()
        here, key = place.get(name), _key_at((*path, name))
        if old == new:
            continue
        if name == "effects":
            _edit_effects(place, old or [], wanted)
        elif name in _WHOLE:
            place.pop(name, None)
            place.append(name, wanted)
        elif isinstance(new, Mapping) and "value" not in new:
            if here is None and isinstance(wanted, tomlkit.items.InlineTable):
                place[name] = here = tomlkit.inline_table()
            if here is None:
                place.append(name, wanted)
            else:
                _edit(here, old or {}, wanted, (*path, name))
                if not here:
                    place.remove(name)
        elif key is not None and isinstance(here, Mapping):
            _set(place, name, key, _quantity(old), _quantity(new))
        elif here is not None or key is None or old is not None or new != _usual(key):
            place[name] = wanted


def _edit_effects(document: Any, before: list[Any], after: Any) -> None:
    """Edit the list of effects: new numbers in place, others removed or added at the end; written
    whole where their order differs.
    """
    wanted = [kind_of_entry(effect) for effect in after]
    there = [kind_of_entry(effect) for effect in before if kind_of_entry(effect) in wanted]
    tables: Any = document.get("effects", [])
    if wanted[: len(there)] != there or not isinstance(tables, tomlkit.items.AoT):
        document.pop("effects", None)
        document.append("effects", after)
        return
    for index in reversed(range(len(before))):
        if kind_of_entry(before[index]) not in wanted:
            del tables[index]
    known = {kind_of_entry(effect): effect["parameters"] for effect in before}
    for effect, table in zip(after, tables, strict=False):
        given = table.setdefault("parameters", tomlkit.table())
        for name, value in effect["parameters"].items():
            if known[kind_of_entry(effect)].get(name) != value.unwrap():
                given[name] = value
    for effect in after[len(there) :]:
        tables.append(effect)


def _key_at(path: tuple[str, ...]) -> Key | None:
    """The key of a rig file at a place, None where there is none."""
    keys = BLOCKS.get(path[0], ()) if len(path) > 1 else ()
    return next((key for key in keys if key.where in (path[-1:], path[-2:])), None)


def _quantity(written: Any) -> tuple[Any, float, bool]:
    """Value and tolerance of an entry, in SI, and True where each recording has its own value."""
    if not isinstance(written, Mapping):
        return written, 0.0, False
    tol = math.inf if written.get("unknown") else written.get("tol", 0.0)
    return written["value"], tol, "error" in written


def _usual(key: Key) -> Any:
    """Default of a key in SI, as a file has it; None where it has none."""
    if key.default is None:
        return None
    return tomllib.loads(f"x = {entry_text(key, key.default, 0.0)}")["x"]


# ---------------------------------------------------------------------------------- values


def _set(
    place: Any, name: str, key: Key, before: tuple[Any, float, bool], now: tuple[Any, float, bool]
) -> None:
    """One entry, in the unit that it has, where that loses nothing."""
    (value, tol, own), old, entry = now, before[1], place[name]
    unit = str(entry["unit"])
    numbers = _in_unit(key, value, tol, unit)
    if numbers is None:
        unit, numbers = key.unit, (value, tol)
    elif _tolerance_key(tol) == _tolerance_key(old):
        _in_place(entry, key, value, numbers, tol != old)
        return
    text = entry_text(key._replace(unit=unit, path=()), *numbers, own=own)
    place[name] = tomlkit.value(text)


def _tolerance_key(tol: float) -> str:
    """Key that states a tolerance: ``unknown`` for infinity, ``tol``, or ``""`` for none."""
    return "unknown" if math.isinf(tol) else "tol" if tol else ""


def _in_place(entry: Any, key: Key, value: Any, numbers: tuple[Any, float], spread: bool) -> None:
    """Write what differs into ``{ value, unit, tol }``."""
    unit = str(entry["unit"])
    if [to_si(float(given), unit, key.unit) for given in _listed(entry["value"])] != _listed(value):
        entry["value"] = numbers[0]
    if spread:
        entry["tol"] = numbers[1]


def _in_unit(key: Key, value: Any, tol: float, unit: str) -> tuple[Any, float] | None:
    """Value and tolerance in a unit; None where it cannot hold them."""
    found = [_number_in(float(number), unit, key.unit) for number in _listed(value)]
    spread: float | None = tol
    if tol and not math.isinf(tol):
        spread = _number_in(tol, unit, key.unit, difference=True)
    if spread is None or any(number is None for number in found):
        return None
    if key.kind == "count":
        return int(value), spread
    return (found if isinstance(value, list) else found[0]), spread


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list) else [value]


def _number_in(value: float, unit: str, si: str, *, difference: bool = False) -> float | None:
    """Shortest number that is read in `unit` as this value, to the last bit; None for none."""
    near = from_si(value, unit, si, difference=difference)
    for digits in (12, 15, 16):
        short = float(f"{near:.{digits}g}")
        if to_si(short, unit, si, difference=difference) == value:
            return short
    low = high = near
    for _ in range(_NEIGHBOURS):
        for number in (low, high):
            if to_si(number, unit, si, difference=difference) == value:
                return number
        low, high = math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
    return None
