"""A rig file written again with the numbers of another rig: comments, order and units of its author
stay, and only what differs is written anew.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final, cast

import tomlkit
import tomlkit.items
from tomlkit.exceptions import TOMLKitError

from pamrs.errors import ParameterError, RigError
from pamrs.rig._reader import Content, read_model
from pamrs.rig._writer import block_lines, effect_lines, entry_text, limit_lines, toml_text
from pamrs.rig.schema import BLOCKS, PORTS, Key, keys_of, qualified, tables_of
from pamrs.units import from_si, to_si

#: How far a number is looked for that converts to the very same number in SI, in units in the last
#: place; beyond, the value is written in SI.
_NEIGHBOURS: Final = 4


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
        was = read_model(text, "rig")
        if toml_text(was) == plain:
            return text
        document = tomlkit.parse(text)
        _Editor(document, was, content).edit()
        edited = tomlkit.dumps(document)
        return edited if toml_text(read_model(edited, "rig")) == plain else plain
    except (RigError, ParameterError, TOMLKitError):
        return plain


class _Editor:
    """Brings a document from one content to another."""

    def __init__(self, document: tomlkit.TOMLDocument, was: Content, now: Content) -> None:
        self.document, self.was, self.now = document, was, now

    def edit(self) -> None:
        """All of it."""
        if self.was.name != self.now.name:
            self.document["name"] = self.now.name
        case = self.now.model.get("case", "")
        if self.was.model.get("case", "") != case:
            if case:
                self.document["case"] = case
            else:
                self.document.remove("case")
        for block in BLOCKS:
            self.blocks(block)
        self.rest("limits", limit_lines)
        self.rest("model_error", _error_lines)
        self.effects()

    def rest(self, name: str, lines: Any) -> None:
        """A table that is written whole where it differs."""
        before, after = list(lines(self.was.model)), list(lines(self.now.model))
        if before == after:
            return
        if name in self.document:
            self.document.remove(name)
        if after:
            self.document.update(tomlkit.parse("\n".join(after) + "\n"))

    # -------------------------------------------------------------------- blocks

    def blocks(self, block: str) -> None:
        """The blocks of one kind."""
        before, after = tables_of(self.was.model, block), tables_of(self.now.model, block)
        for name, table in after.items():
            label = qualified(block, name)
            place = self.table(block, name)
            if name in before and place is not None:
                self.ports(label, block, place)
                self.keys(label, block, before[name], table, place)
            elif before.get(name) != table or _told(self.now, label):
                self.add(block, name, block_lines(self.now, block, name, table))
        for name in before:
            if name not in after:
                self.drop(block, name)

    def table(self, block: str, name: str) -> Any:
        """The table of one block in the document, None where it has none."""
        found: Any = self.document.get(block)
        return found if not name or found is None else found.get(name)

    def add(self, block: str, name: str, lines: Iterator[str]) -> None:
        """A block that was not there."""
        if name and block in self.document:
            own = tomlkit.parse("\n".join(lines) + "\n")
            table = tomlkit.table()
            table.update(own)
            self.document[block][name] = table
            return
        text = "\n".join([f"[{qualified(block, name)}]", *lines]) + "\n"
        self.document.update(tomlkit.parse(text))

    def drop(self, block: str, name: str) -> None:
        """A block that is there no more."""
        if not name:
            self.document.remove(block)
        else:
            cast(Any, self.document[block]).remove(name)

    def ports(self, label: str, block: str, place: Any) -> None:
        """What a block is connected to."""
        before = self.was.model.get("ports", {}).get(label, {})
        after = self.now.model.get("ports", {}).get(label, {})
        for port in PORTS.get(block, ()):
            if before.get(port.name) != after.get(port.name):
                _put(place, port.name, after.get(port.name))

    def keys(
        self,
        label: str,
        block: str,
        before: Mapping[str, Any],
        after: Mapping[str, Any],
        place: Any,
    ) -> None:
        """The entries of a block that differ."""
        for key in (key for key in keys_of(block, before) if key.name not in after):
            inner = place.get(key.where[0])
            if len(key.where) == 2 and inner is not None:
                inner.pop(key.where[1], None)
                if not inner:
                    place.remove(key.where[0])
            elif inner is not None:
                place.remove(key.name)
        for key in keys_of(block, after):
            if key.name not in after:
                continue
            dotted = f"{label}.{key.name}"
            tol, old = (c.tolerances.get(dotted, 0.0) for c in (self.now, self.was))
            value = after[key.name]
            if key.name in before and before[key.name] == value and tol == old:
                continue
            if key.name not in before and value == key.default and not tol:
                continue
            if len(key.where) == 2 and key.where[0] not in place:
                place[key.where[0]] = tomlkit.inline_table()
            inner = place[key.where[0]] if len(key.where) == 2 else place
            own = self.now.leaves_open(dotted)
            _set(inner, key.where[-1], key, (value, own), tol, old)

    # ------------------------------------------------------------------- effects

    def effects(self) -> None:
        """The list of effects: those that are in both with new numbers, the others gone or added at
        the end; written whole where their order is another.
        """
        before, after = self.was.model["effects"], self.now.model["effects"]
        if before == after and self.was.effect_std == self.now.effect_std:
            return
        tables: Any = self.document.get("effects", [])
        wanted = [_identity(effect) for effect in after]
        for index in reversed(range(len(before))):
            if _identity(before[index]) not in wanted:
                del tables[index]
        there = [_identity(effect) for effect in before if _identity(effect) in wanted]
        if wanted[: len(there)] != there or not isinstance(tables, tomlkit.items.AoT):
            if "effects" in self.document:
                self.document.remove("effects")
            there, tables = [], []
        for effect, table in zip(after, tables, strict=False):
            self.numbers(effect, table)
        new = [line for effect in after[len(there) :] for line in effect_lines(self.now, effect)]
        if not new:
            if not after and "effects" in self.document:
                self.document.remove("effects")
            return
        added: Any = tomlkit.parse("\n".join(new) + "\n")["effects"]
        if "effects" not in self.document:
            self.document.append("effects", added)
            return
        for table in added:
            tables.append(table)

    def numbers(self, effect: Mapping[str, Any], table: Any) -> None:
        """The parameters of one effect."""
        name = qualified(effect["id"], effect.get("at", ""))
        own: Any = tomlkit.parse("\n".join(effect_lines(self.now, effect)) + "\n")
        fresh = own["effects"][0]["parameters"]
        old = next(e for e in self.was.model["effects"] if _identity(e) == _identity(effect))
        stds = [c.effect_std.get(name, {}) for c in (self.was, self.now)]
        given = table.setdefault("parameters", tomlkit.table())
        for parameter, value in effect["parameters"].items():
            same = old["parameters"][parameter] == value
            if same and stds[0].get(parameter) == stds[1].get(parameter):
                continue
            given[parameter] = fresh[parameter]


def _identity(effect: Mapping[str, Any]) -> tuple[str, str, str]:
    return effect["id"], effect.get("at", ""), effect.get("form", "")


def _told(content: Content, label: str) -> bool:
    """Whether tolerances or ports of a block are given."""
    return label in content.model.get("ports", {}) or any(
        name.startswith(f"{label}.") for name in content.tolerances
    )


def _error_lines(model: Mapping[str, Any]) -> list[str]:
    from pamrs.rig._model_error import error_lines

    return error_lines(model)


def _put(place: Any, name: str, value: str | None) -> None:
    if value is None:
        place.remove(name)
    else:
        place[name] = value


# ---------------------------------------------------------------------------------- values


def _set(place: Any, name: str, key: Key, given: tuple[Any, bool], tol: float, old: float) -> None:
    """One entry: its numbers in the unit that it has, where that loses nothing; `given` is the
    value, and whether each recording has its own.
    """
    value, own = given
    entry = place.get(name)
    if isinstance(entry, Mapping):
        unit = str(entry["unit"])
        numbers = _in_unit(key, value, tol, unit)
        if numbers is None:
            unit, numbers = key.unit, (value, tol)
        elif _told_by(tol) == _told_by(old):
            _in_place(cast(Any, entry), key, value, numbers, tol != old)
            return
        text = entry_text(key._replace(unit=unit, path=()), *numbers, own=own)
        place[name] = tomlkit.value(text)
        return
    place[name] = tomlkit.value(entry_text(key, value, tol, own=own))


def _told_by(tol: float) -> str:
    """The word that says how well a value is known."""
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
    """The number that `unit` needs to be read as this value, to the last bit; the one with the
    fewest digits. None where there is none.
    """
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
