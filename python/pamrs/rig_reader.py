"""Reads rig TOML into a model, collecting every problem on the way."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pamrs.errors import ParameterError, RigError, joined
from pamrs.muscle_models import own_geometry
from pamrs.rig_schema import BLOCKS, REQUIRED_BLOCKS, SCHEMA, Key, keys_of, kind_of
from pamrs.units import to_si

__all__ = ["Content", "Reader", "read_model"]

_TOP = ("schema", "name", "description", "effects")
_QUANTITY = ("value", "unit", "tol", "unknown")


@dataclass
class Content:
    """What a rig file holds: the model, and what is known about its numbers."""

    name: str
    model: dict[str, Any]
    tolerances: dict[str, float] = field(default_factory=dict)
    effect_std: dict[str, dict[str, float]] = field(default_factory=dict)


def read_model(text: str, source: str) -> Content:
    """Read rig TOML.

    Parameters
    ----------
    text : str
        The file's text.
    source : str
        What to call it in messages.

    Returns
    -------
    Content
        Model, tolerances and standard deviations in SI units.

    Raises
    ------
    RigError
        With every problem found.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RigError(f"{source}: not valid TOML: {error}") from error
    reader = Reader()
    content = reader.document(document)
    if reader.problems:
        raise RigError(joined(source, reader.problems))
    return content


def _shown(value: object) -> str:
    text = f"{value:g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


class Reader:
    """Turns tables into SI numbers, and notes every problem instead of stopping at the first."""

    def __init__(self) -> None:
        self.problems: list[str] = []
        self.tolerances: dict[str, float] = {}
        self.effect_std: dict[str, dict[str, float]] = {}

    def problem(self, text: str) -> None:
        """Note a problem."""
        self.problems.append(text)

    def unknown_keys(self, prefix: str, given: Iterable[str], allowed: Iterable[str]) -> None:
        """Note every key that is not allowed, with what is near to it."""
        names = list(allowed)
        for name in given:
            if name not in names:
                near = difflib.get_close_matches(name, names, n=1)
                hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(names)}"
                self.problem(f"unknown key {prefix + name!r}; {hint}")

    # ------------------------------------------------------------------ document

    def document(self, document: Mapping[str, Any]) -> Content:
        """A whole rig file."""
        self.unknown_keys("", document, [*_TOP, *BLOCKS])
        if document.get("schema") != SCHEMA:
            self.problem(f"schema = {_shown(document.get('schema'))} is not allowed: {SCHEMA!r} is needed")
        name = document.get("name", "rig")
        if not isinstance(name, str) or not name.strip():
            self.problem(f"name = {_shown(name)} is not allowed: a text is needed")
            name = "rig"
        model: dict[str, Any] = {"name": name}
        for block in BLOCKS:
            table = document.get(block)
            if table is None:
                if block in REQUIRED_BLOCKS:
                    self.problem(f"the block [{block}] is missing")
                model[block] = self.block("sensors", {}) if block == "sensors" else None
            elif isinstance(table, Mapping):
                model[block] = self.block(block, table)
            else:
                self.problem(f"{block} = {_shown(table)} is not allowed: a table [{block}] is needed")
                model[block] = None
        model["effects"] = self.effects(document.get("effects", []))
        if not self.problems:
            self.cross_checks(model)
        return Content(name, model, self.tolerances, self.effect_std)

    def block(self, block: str, table: Mapping[str, Any]) -> dict[str, Any]:
        """One block by the keys of its table."""
        groups: dict[str, list[str]] = {}
        for key in BLOCKS[block]:
            if key.path:
                groups.setdefault(key.path[0], []).append(key.path[1])
        self.unknown_keys(f"{block}.", table, [*(k.name for k in BLOCKS[block] if not k.path), *groups])
        for group, members in groups.items():
            inner = table.get(group)
            if isinstance(inner, Mapping):
                self.unknown_keys(f"{block}.{group}.", inner, members)
            elif inner is not None:
                self.problem(f"{block}.{group} = {_shown(inner)} is not allowed: give {', '.join(members)} as a table")
        keys = keys_of(block, table)
        for key in BLOCKS[block]:
            if key not in keys and _dig(table, key.where) is not None:
                kind, allowed = _shown(kind_of(block, table)), ", ".join(key.only)
                self.problem(f"{block}.{key.name} is not allowed with {kind}: only with {allowed}")
        content = {key.name: self.value(block, key, _dig(table, key.where)) for key in keys}
        if content.get("geometry") == "":
            content["geometry"] = own_geometry(content["model"])
        return content

    # -------------------------------------------------------------------- values

    def value(self, block: str, key: Key, raw: Any) -> Any:
        """The value of one key in SI, None after noting what is wrong with it."""
        label = ".".join((block, *key.where))
        if raw is None:
            if key.default is None:
                self.problem(f"{label} is missing")
            return list(key.default) if isinstance(key.default, tuple) else key.default
        if key.kind == "choice":
            if raw not in key.choices:
                self.problem(f"{label} = {_shown(raw)} is not allowed: one of {', '.join(map(repr, key.choices))}")
            return raw
        bare_allowed = key.kind == "count" or bool(key.path)
        number, unit, extra = self.quantity(label, key, raw, bare_allowed)
        if number is None:
            return None
        if key.kind == "vector":
            self.spread(f"{block}.{key.name}", label, key, unit, extra)
            return self.vector(label, key, number, unit)
        value = self.scalar(label, key.unit, number, unit, key.lower, key.upper)
        if value is None:
            return None
        self.spread(f"{block}.{key.name}", label, key, unit, extra)
        if key.kind == "count":
            if not value.is_integer():
                self.problem(f"{label} = {value:g} is not allowed: a whole number is needed")
            return int(value)
        return value

    def quantity(self, label: str, key: Key, raw: Any, bare_allowed: bool) -> tuple[Any, str, Mapping[str, Any]]:
        """Number, unit and the whole table of ``{ value, unit, tol, unknown }``, or of a bare number."""
        if not isinstance(raw, Mapping):
            if bare_allowed:
                return raw, key.unit, {}
            self.problem(f"{label} = {_shown(raw)} has no unit: write {{ value = ..., unit = {key.unit!r} }}")
            return None, key.unit, {}
        self.unknown_keys(f"{label}.", raw, _QUANTITY)
        if "value" not in raw:
            self.problem(f"{label}.value is missing")
            return None, key.unit, {}
        unit = raw.get("unit")
        if not isinstance(unit, str):
            self.problem(f"{label}.unit is missing: a unit like {key.unit!r} is needed")
            return None, key.unit, {}
        return raw["value"], unit, raw

    def scalar(
        self,
        label: str,
        si_unit: str,
        number: Any,
        unit: str,
        lower: float,
        upper: float,
        *,
        difference: bool = False,
    ) -> float | None:
        """``number`` in SI, or None after noting what is wrong with it."""
        if isinstance(number, bool) or not isinstance(number, (int, float)):
            self.problem(f"{label} = {_shown(number)} is not allowed: a number is needed")
            return None
        try:
            value = to_si(float(number), unit, si_unit, difference=difference)
        except ParameterError as error:
            self.problem(f"{label}: {error}")
            return None
        except OverflowError:
            value = math.inf
        if not (math.isfinite(value) and lower <= value <= upper):
            given = "" if unit == si_unit else f" ({number:g} {unit})"
            allowed = f"a finite number from {lower:g} to {upper:g} {si_unit}"
            self.problem(f"{label} = {value:g} {si_unit}{given} is not allowed: {allowed}")
            return None
        return value

    def vector(self, label: str, key: Key, numbers: Any, unit: str) -> list[float] | None:
        """A list of numbers in SI."""
        if not isinstance(numbers, list) or not numbers:
            self.problem(f"{label} = {_shown(numbers)} is not allowed: a list of numbers is needed")
            return None
        values = [self.scalar(f"{label}[{i}]", key.unit, number, unit, key.lower, key.upper) for i, number in enumerate(numbers)]
        return [value for value in values if value is not None]

    def spread(self, name: str, label: str, key: Key, unit: str, extra: Mapping[str, Any]) -> None:
        """Keep what is known of a value: ``tol``, or ``unknown = true``."""
        unknown = extra.get("unknown", False)
        if not isinstance(unknown, bool):
            self.problem(f"{label}.unknown = {_shown(unknown)} is not allowed: true or false")
            return
        if unknown:
            if "tol" in extra:
                self.problem(f"{label}: tol and unknown = true exclude each other")
            self.tolerances[name] = math.inf
        elif "tol" in extra:
            tol = self.scalar(f"{label}.tol", key.unit, extra["tol"], unit, 0.0, 1e300, difference=True)
            if tol:
                self.tolerances[name] = tol

    # ------------------------------------------------------------------- effects

    def effects(self, raw: Any) -> list[dict[str, Any]]:
        """The tables ``[[effects]]``."""
        if not isinstance(raw, list) or not all(isinstance(entry, Mapping) for entry in raw):
            self.problem("effects is not allowed as it stands: one table [[effects]] for each is needed")
            return []
        if not raw:
            return []
        from pamrs.effects_table import EFFECTS

        found: list[dict[str, Any]] = []
        for index, entry in enumerate(raw):
            label = f"effects[{index}]"
            self.unknown_keys(f"{label}.", entry, ("id", "parameters"))
            identity = entry.get("id")
            if not isinstance(identity, str) or identity not in EFFECTS:
                allowed = ", ".join(sorted(EFFECTS))
                self.problem(f"{label}.id = {_shown(identity)} is not in the catalogue: {allowed}")
                continue
            if any(identity == other["id"] for other in found):
                self.problem(f"{label}.id = {identity!r} is there twice")
                continue
            given = entry.get("parameters", {})
            if not isinstance(given, Mapping):
                self.problem(f"{label}.parameters = {_shown(given)} is not allowed: a table is needed")
                continue
            info = EFFECTS[identity]
            self.unknown_keys(f"{identity}.", given, [parameter.name for parameter in info.parameters])
            values = {
                parameter.name: self.effect_value(identity, parameter, given.get(parameter.name)) for parameter in info.parameters
            }
            found.append({"id": identity, "parameters": values})
        return found

    def effect_value(self, identity: str, parameter: Any, raw: Any) -> float | None:
        """One parameter of an effect, its default where it is left out."""
        label = f"{identity}.{parameter.name}"
        if raw is None:
            return float(parameter.default)
        if not isinstance(raw, Mapping):
            self.problem(f"{label} = {_shown(raw)} has no unit: write {{ value = ..., unit = {parameter.unit!r} }}")
            return None
        self.unknown_keys(f"{label}.", raw, ("value", "unit", "std"))
        unit = raw.get("unit")
        if "value" not in raw or not isinstance(unit, str):
            self.problem(f"{label}: value and unit (like {parameter.unit!r}) are needed")
            return None
        value = self.scalar(label, parameter.unit, raw["value"], unit, parameter.lower, parameter.upper)
        if "std" in raw:
            std = self.scalar(f"{label}.std", parameter.unit, raw["std"], unit, 0.0, 1e300, difference=True)
            if std is not None:
                self.effect_std.setdefault(identity, {})[parameter.name] = std
        return value

    # -------------------------------------------------------------- whole model

    def cross_checks(self, model: Mapping[str, Any]) -> None:
        """What no key alone shows: lists that belong together, and blocks that need each other."""
        for block, needs in (("valve", "supply"), ("joint", "muscle"), ("joint", "arm"), ("arm", "joint"), ("load", "muscle")):
            if model[block] is not None and model[needs] is None:
                self.problem(f"the block [{block}] needs the block [{needs}], which is missing")
        load = model["load"]
        if load is not None:
            if model["joint"] is not None or model["arm"] is not None:
                self.problem("the block [load] does not go with [joint] and [arm]: a rig has one or the others")
            if not load["min_length"] < load["max_length"]:
                self.problem(
                    f"load.max_length = {load['max_length']:g} m is not allowed: "
                    f"more than load.min_length = {load['min_length']:g} m is needed"
                )
        valve, muscle, joint = model["valve"], model["muscle"], model["joint"]
        if valve is not None:
            self.area_fraction(valve["opening"], valve["fraction"])
        if muscle is not None:
            self.muscle(muscle)
        if joint is not None and not joint["min_angle"] < joint["max_angle"]:
            self.problem(
                f"joint.max_angle = {joint['max_angle']:g} rad is not allowed: "
                f"more than joint.min_angle = {joint['min_angle']:g} rad is needed"
            )

    def area_fraction(self, opening: list[float], fraction: list[float]) -> None:
        """Note what is wrong with a valve's area table."""
        label = "valve.area_fraction"
        if len(opening) != len(fraction) or len(opening) < 2:
            self.problem(
                f"{label}: opening has {len(opening)} values and fraction {len(fraction)}; the same number, two at least, is needed"
            )
            return
        if opening[0] != 0.0 or opening[-1] != 1.0 or any(b <= a for a, b in zip(opening, opening[1:], strict=False)):
            self.problem(f"{label}.opening = {opening} is not allowed: it must rise from 0 to 1")
        if any(b < a for a, b in zip(fraction, fraction[1:], strict=False)):
            self.problem(f"{label}.fraction = {fraction} is not allowed: it must not fall")

    def muscle(self, muscle: Mapping[str, Any]) -> None:
        """Note what does not go together in a muscle."""
        slope, offset = muscle.get("modulus_slope", []), muscle.get("modulus_offset", [])
        if len(slope) != len(offset):
            self.problem(
                f"muscle.modulus_slope has {len(slope)} values and muscle.modulus_offset {len(offset)}; the same number is needed"
            )
        factors = muscle.get("extension_factors", [])
        if factors and len(factors) != 3:
            self.problem(f"muscle.extension_factors has {len(factors)} values; three are needed")
        thickness, diameter = muscle["wall_thickness"], muscle["rest_diameter"]
        if not thickness < diameter / 2:
            self.problem(
                f"muscle.wall_thickness = {thickness:g} m is not allowed: "
                f"less than half of muscle.rest_diameter = {diameter:g} m is needed"
            )


def _dig(table: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    inner: Any = table
    for name in path:
        if not isinstance(inner, Mapping):
            return None
        inner = inner.get(name)
    return inner
