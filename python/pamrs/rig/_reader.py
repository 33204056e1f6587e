"""Reads rig TOML into a model, collecting every problem on the way."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from pamrs._checks import angle_meant, as_said
from pamrs._files import MOST_NAME, parse_toml, shown
from pamrs.declared import unknown_key
from pamrs.errors import ParameterError, RigError, joined
from pamrs.rig._checks import block_problems
from pamrs.rig._model_error import read_model_error
from pamrs.rig._ports import bare, connect, near_name
from pamrs.rig._units import Units
from pamrs.rig.muscle_models import own_geometry
from pamrs.rig.schema import (
    BLOCKS,
    LIMITS,
    PORTS,
    REQUIRED_BLOCKS,
    SCHEMA,
    SINGLE_BLOCKS,
    Key,
    Port,
    keys_of,
    kind_for,
    of_kind,
    qualified,
    tables_of,
)
from pamrs.units import from_si, to_si, with_unit

_TOP = ("schema", "name", "description", "case", "limits", "effects", "model_error")
_QUANTITY = ("value", "unit", "tol", "unknown", "error")
_OWN = "own"
#: Keys of [sensors] that only loads of some kinds have.
_SENSORS_OF_LOADS = {"length_zero": ("mass",), "force_gain": ("mass", "frame")}
_NAME = re.compile(r"[A-Za-z0-9_-]+")


@dataclass
class Content:
    """Content of a rig file: the model, what is known of its numbers, and its units."""

    name: str
    model: dict[str, Any]
    tolerances: dict[str, float] = field(default_factory=dict)
    effect_std: dict[str, dict[str, float]] = field(default_factory=dict)
    units: Units = field(default_factory=Units)

    def leaves_open(self, dotted: str) -> bool:
        """True where a parameter has another value in each recording: ``error = "own"``."""
        return dotted in self.model.get("own", ())


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
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise RigError(f"{source}: not valid TOML: {error}") from error
    reader = Reader()
    content = reader.document(document)
    if reader.problems:
        raise RigError(joined(source, reader.problems))
    return content


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else as_said(value)


class Reader:
    """Turns tables into SI numbers, and notes every problem instead of stopping at the first."""

    def __init__(self) -> None:
        self.problems: list[str] = []
        self.tolerances: dict[str, float] = {}
        self.effect_std: dict[str, dict[str, float]] = {}
        self.units = Units()
        self.ports: dict[str, dict[str, str]] = {}
        self.own: list[str] = []
        self.whole = True  # every block was understood: what is connected to what can be checked

    def refuse(self, name: str, value: object, needed: str) -> None:
        """Note a value that is not allowed, and what is needed."""
        self.problems.append(f"{name} = {_shown(value)} is not allowed: {needed}")

    def unknown_keys(self, prefix: str, given: Iterable[str], allowed: Iterable[str]) -> None:
        """Note every key that is not allowed, with what is near to it."""
        names = list(allowed)
        self.problems += [unknown_key(prefix, name, names) for name in given if name not in names]

    # ------------------------------------------------------------------ document

    def document(self, document: Mapping[str, Any]) -> Content:
        """A whole rig file."""
        self.unknown_keys("", document, [*_TOP, *BLOCKS])
        if document.get("schema") != SCHEMA:
            self.refuse("schema", document.get("schema"), f"{SCHEMA!r} is needed")
        name = document.get("name", "rig")
        if not isinstance(name, str) or not name.strip():
            self.refuse("name", name, "a text is needed")
            name = "rig"
        name = shown(name)[:MOST_NAME]
        case = document.get("case", "")
        if not isinstance(case, str):
            self.refuse("case", case, "the path of a case is needed")
            case = ""
        self.whole = set(document) <= {*_TOP, *BLOCKS}
        model: dict[str, Any] = {"name": name, **({"case": case} if case else {})}
        model |= self.limits(document.get("limits"))
        for block in BLOCKS:
            model[block] = self.blocks(block, document.get(block))
        self.sensors(model, document.get("sensors"))
        model["ports"] = self.ports
        model["effects"] = self.effects(document.get("effects", []))
        model |= {"own": self.own} if self.own else {}
        model["model_error"] = read_model_error(self, document.get("model_error"), model)
        if self.whole:
            ports, problems = connect(model)
            self.problems += problems
            self.gauges(model, ports, document)
        self.problems += block_problems(model, self.units)
        return Content(name, model, self.tolerances, self.effect_std, self.units)

    def limits(self, raw: Any) -> dict[str, Any]:
        """Limits of the bench from the table ``limits``, in SI; empty where the file has none."""
        if raw is None:
            return {}
        if not isinstance(raw, Mapping):
            self.refuse("limits", raw, "a table is needed")
            return {}
        self.unknown_keys("limits.", raw, (key.name for key in LIMITS))
        found = {
            key.name: self.value("limits", key, raw[key.name]) for key in LIMITS if key.name in raw
        }
        return {"limits": found}

    def blocks(self, block: str, raw: Any) -> dict[str, Any] | None:
        """A block without a name, or all blocks of a kind by their names; None where there is
        none.
        """
        if raw is None:
            if block in REQUIRED_BLOCKS:
                self.problems.append(f"the block [{block}] is missing")
                self.whole = False
            return None
        if not isinstance(raw, Mapping):
            self.refuse(block, raw, f"a table [{block}] is needed")
            self.whole = False
            return None
        names = _block_names(block, raw)
        if not names:
            return self.block(block, raw, ports=PORTS.get(block, ()))
        others = [name for name in raw if name not in names]
        if block in SINGLE_BLOCKS or others:
            self.whole = False
            named = ", ".join(f"[{block}.{name}]" for name in names)
            if block in SINGLE_BLOCKS:
                self.problems.append(
                    f"{named} is not allowed: a rig has one [{block}], without a name"
                )
            else:
                self.problems.append(
                    f"[{block}] has {', '.join(others)} and {named}: either one [{block}] or "
                    "only named ones are needed"
                )
            return None
        wrong = [name for name in names if not _NAME.fullmatch(name)]
        for name in wrong:
            self.problems.append(
                f"[{block}.{name!r}]: the name {name!r} is not allowed: letters, digits, _ and - "
                "are needed"
            )
            self.whole = False
        return {
            name: self.block(block, raw[name], name, ports=PORTS.get(block, ()))
            for name in names
            if name not in wrong
        }

    def block(
        self, block: str, table: Mapping[str, Any], name: str = "", *, ports: Iterable[Port] = ()
    ) -> dict[str, Any]:
        """One block by the keys of its table; the ports that it may have go to :attr:`ports`."""
        label = qualified(block, name)
        groups: dict[str, list[str]] = {}
        for key in BLOCKS[block]:
            if key.path:
                groups.setdefault(key.path[0], []).append(key.path[1])
        allowed = [port.name for port in ports]
        self.unknown_keys(
            f"{label}.", table, [*allowed, *(k.name for k in BLOCKS[block] if not k.path), *groups]
        )
        for group, members in groups.items():
            inner = table.get(group)
            if isinstance(inner, Mapping):
                self.unknown_keys(f"{label}.{group}.", inner, members)
            elif inner is not None:
                self.refuse(f"{label}.{group}", inner, f"give {', '.join(members)} as a table")
        for port in allowed:
            other = table.get(port)
            if isinstance(other, str):
                self.ports.setdefault(label, {})[port] = other
            elif other is not None:
                self.refuse(f"{label}.{port}", other, "the name of a block is needed")
        keys = keys_of(block, table)
        for key in BLOCKS[block]:
            if key in keys or _dig(table, key.where) is None:
                continue
            if of_kind(block, table, key):
                self.problems.append(
                    f"{label}.{key.name} is not allowed without {key.needs}: it is {key.note}"
                )
            else:
                kind, only = _shown(kind_for(block, table, key)), ", ".join(key.only)
                self.problems.append(
                    f"{label}.{key.name} is not allowed with {kind}: only with {only}"
                )
        content = {key.name: self.value(label, key, _dig(table, key.where)) for key in keys}
        if content.get("geometry") == "":
            content["geometry"] = own_geometry(content["model"])
        return content

    def sensors(self, model: dict[str, Any], raw: Any) -> None:
        """Put in the sensors that a file leaves out, and hold their names against the chambers and
        joints.

        Sensors without a name are those of every chamber and joint, so that they are always there
        where none has a name.
        """
        if raw is None:
            model["sensors"] = self.block("sensors", {})
        owners = {
            "pressure_zero": tables_of(model, "chamber"),
            "angle_zero": tables_of(model, "joint"),
        }
        self._of_loads(model, raw)
        for name, table in tables_of(model, "sensors").items():
            if not name or not self.whole:
                continue
            if not any(name in names for names in owners.values()):
                named = dict.fromkeys(
                    other for names in owners.values() for other in names if other
                )
                self.problems.append(
                    f"the block [sensors.{name}] is named after no chamber and no "
                    f"joint{near_name(name, named)}"
                )
                continue
            for key, names in owners.items():
                if name not in names:
                    del table[key]
                    if key in raw[name]:
                        what = "chamber" if key == "pressure_zero" else "joint"
                        self.problems.append(
                            f"sensors.{name}.{key} is not allowed: the rig has no {what}.{name}"
                        )

    def gauges(
        self, model: dict[str, Any], ports: Mapping[str, Any], document: Mapping[str, Any]
    ) -> None:
        """Give pressure zeros left out at supplies and line inlets the chambers' tolerance."""
        stated = [
            self.tolerances.get(f"{qualified('sensors', name)}.pressure_zero", 0.0)
            for name in tables_of(model, "sensors")
        ]
        tol = max((known for known in stated if math.isfinite(known)), default=0.0)
        for block in ("supply", "line"):
            for name in tables_of(model, block):
                given = document[block][name] if name else document[block]
                inlet = block == "supply" or ports["line"][name].get("from") == ""
                if inlet and tol and "pressure_zero" not in given:
                    self.tolerances[f"{qualified(block, name)}.pressure_zero"] = tol

    def _of_loads(self, model: dict[str, Any], raw: Any) -> None:
        """Keep what belongs to a load in unnamed sensors of a rig that has one, refuse others."""
        kind = (model["load"] or {}).get("kind")
        for (name, table), (key, kinds) in product(
            tables_of(model, "sensors").items(), _SENSORS_OF_LOADS.items()
        ):
            if kind in kinds and not name:
                continue
            given = isinstance(raw, Mapping) and key in (raw.get(name) or {} if name else raw)
            if given and self.whole:
                label = qualified("sensors", name)
                needs = "it belongs in [sensors], without a name"
                if kind not in kinds:
                    allowed = " or ".join(f'"{each}"' for each in kinds)
                    needs = f"a [load] with kind = {allowed} is needed"
                self.problems.append(f"{label}.{key} is not allowed: {needs}")
            table.pop(key, None)

    # -------------------------------------------------------------------- values

    def value(self, block: str, key: Key, raw: Any) -> Any:
        """Value of a key of a block in SI, None after noting a problem."""
        label = ".".join((block, *key.where))
        if raw is None:
            if key.default is None:
                self.problems.append(f"{label} is missing")
            return list(key.default) if isinstance(key.default, tuple) else key.default
        if key.kind == "choice":
            if raw not in key.choices:
                self.refuse(label, raw, f"one of {', '.join(map(repr, key.choices))}")
                return None
            return raw
        bare_allowed = key.kind == "count" or bool(key.path)
        number, unit, extra = self.quantity(label, key, raw, bare_allowed)
        if number is None:
            return None
        if key.kind == "vector":
            self.spread(f"{block}.{key.name}", label, key, unit, extra)
            return self.vector(label, key, number, unit)
        whole = key.kind == "count"
        value = self.scalar(label, key.unit, number, unit, key.lower, key.upper, whole=whole)
        if value is None:
            return None
        if whole:
            for word in ("tol", "unknown", "error"):
                if extra.get(word):
                    self.problems.append(f"{label}.{word} is not allowed: a count is known")
            return int(value)
        self.spread(f"{block}.{key.name}", label, key, unit, extra)
        self.units.written.update({f"{block}.{key.name}": unit} if extra else {})
        return value

    def quantity(
        self, label: str, key: Key, raw: Any, bare_allowed: bool
    ) -> tuple[Any, str, Mapping[str, Any]]:
        """Number, unit and table of ``{ value, unit, tol, unknown }``, or of a bare number."""
        if not isinstance(raw, Mapping):
            if bare_allowed:
                return raw, key.unit, {}
            self.no_unit(label, raw, key.unit)
            return None, key.unit, {}
        self.unknown_keys(f"{label}.", raw, _QUANTITY)
        if "value" not in raw:
            self.problems.append(f"{label}.value is missing")
            return None, key.unit, {}
        unit = raw.get("unit")
        if not isinstance(unit, str):
            self.problems.append(f"{label}.unit is missing: a unit like {key.unit!r} is needed")
            return None, key.unit, {}
        return raw["value"], unit, raw

    def no_unit(self, label: str, raw: Any, unit: str) -> None:
        """Note a number without the table that gives its unit."""
        self.problems.append(
            f"{label} = {_shown(raw)} has no unit: write {{ value = ..., unit = {unit!r} }}"
        )

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
        whole: bool = False,
    ) -> float | None:
        """``number`` in SI, or None after noting what is wrong with it."""
        what = "a whole number" if whole else "a finite number"
        if isinstance(number, bool) or not isinstance(number, (int, float)):
            needed = what if whole else "a number"
            self.refuse(label, number, f"{needed} is needed")
            return None
        try:
            value = to_si(float(number), unit, si_unit, difference=difference)
        except ParameterError as error:
            self.problems.append(f"{label}: {error}")
            return None
        except OverflowError:
            value = math.inf
        if not (math.isfinite(value) and lower <= value <= upper) or (
            whole and not value.is_integer()
        ):
            low, high = (from_si(x, unit, si_unit, difference=difference) for x in (lower, upper))
            allowed = with_unit(f"{what} from {low:g} to {high:g}", unit)
            meant = angle_meant(label, value, lower, upper) if si_unit == "rad" else ""
            wrong = with_unit(f"{label} = {number:g}", unit)
            self.problems.append(f"{wrong} is not allowed: {allowed}{meant}")
            return None
        return value

    def vector(self, label: str, key: Key, numbers: Any, unit: str) -> list[float] | None:
        """A list of numbers in SI."""
        if not isinstance(numbers, list) or not numbers:
            self.refuse(label, numbers, "a list of numbers is needed")
            return None
        values = [
            self.scalar(f"{label}[{i}]", key.unit, number, unit, key.lower, key.upper)
            for i, number in enumerate(numbers)
        ]
        known = [value for value in values if value is not None]
        return known if len(known) == len(values) else None

    def spread(self, name: str, label: str, key: Key, unit: str, extra: Mapping[str, Any]) -> None:
        """Keep what is known of a value: ``tol``, ``unknown = true``, or ``error = "own"``."""
        if "error" in extra:
            self.of_each_recording(name, label, extra)
            if key.kind == "vector":
                self.problems.append(
                    f"{label}.error is not allowed: a list is the same in each recording"
                )
        unknown = extra.get("unknown", False)
        if not isinstance(unknown, bool):
            self.refuse(f"{label}.unknown", unknown, "true or false")
            return
        if unknown:
            if "tol" in extra:
                self.problems.append(f"{label}: tol and unknown = true exclude each other")
            self.tolerances[name] = math.inf
        elif "tol" in extra:
            tol = self.scalar(
                f"{label}.tol", key.unit, extra["tol"], unit, 0.0, 1e300, difference=True
            )
            if tol:
                self.tolerances[name] = tol

    def of_each_recording(self, name: str, label: str, extra: Mapping[str, Any]) -> None:
        """Keep that a value is another one in each recording, which nobody knows."""
        if extra["error"] != _OWN:
            self.refuse(
                f"{label}.error",
                extra["error"],
                f"{_OWN!r}, another value in each recording; the known value of one recording is "
                "given in case.toml",
            )
        for word in ("tol", "unknown", "std"):
            if word in extra:
                self.problems.append(f"{label}: {word} and error = {_OWN!r} exclude each other")
        self.own.append(name)

    # ------------------------------------------------------------------- effects

    def effects(self, raw: Any) -> list[dict[str, Any]]:
        """The tables ``[[effects]]``."""
        if not isinstance(raw, list) or not all(isinstance(entry, Mapping) for entry in raw):
            self.problems.append(
                "effects is not allowed as it is: one table [[effects]] for each is needed"
            )
            return []
        if not raw:
            return []
        from pamrs.effects import CATALOGUE, EFFECTS

        found: list[dict[str, Any]] = []
        for index, entry in enumerate(raw):
            label = f"effects[{index}]"
            self.unknown_keys(f"{label}.", entry, ("id", "at", "form", "parameters"))
            identity = entry.get("id")
            if not isinstance(identity, str) or identity not in EFFECTS:
                self.problems.append(
                    f"{label}.id = {_shown(identity)} is not in the "
                    f"catalogue{near_name(str(identity), CATALOGUE)}"
                )
                continue
            info = EFFECTS[identity]
            place = self.place(label, info.at or "rig", entry.get("at", ""))
            if any(
                identity == other["id"] and (not place or other.get("at", "") in ("", place))
                for other in found
            ):
                self.problems.append(
                    f"{label}.id = {identity!r} is there twice: of several each needs another "
                    "block (at)"
                )
                continue
            given = entry.get("parameters", {})
            if not isinstance(given, Mapping):
                self.refuse(f"{label}.parameters", given, "a table is needed")
                continue
            name = entry.get("form", "")
            form = next((form for form in info.forms if name in ("", form.name)), None)
            if form is None:
                names = ", ".join(repr(form.name) for form in info.forms)
                self.refuse(f"{label}.form", name, f"{identity} has {names}")
                continue
            self.unknown_keys(
                f"{identity}.", given, [parameter.name for parameter in form.parameters]
            )
            values = {
                parameter.name: self.effect_value(
                    identity, place, parameter, given.get(parameter.name)
                )
                for parameter in form.parameters
            }
            own = {"form": name} if name and name != info.forms[0].name else {}
            found.append(
                {"id": identity, **({"at": place} if place else {}), **own, "parameters": values}
            )
        return found

    def place(self, label: str, block: str, raw: Any) -> str:
        """Name of the block that an effect acts on, ``""`` for every one of its kind."""
        if not isinstance(raw, str):
            self.refuse(f"{label}.at", raw, f"the name of a {block} is needed")
            return ""
        return bare(block, raw)

    def effect_value(self, identity: str, place: str, parameter: Any, raw: Any) -> float | None:
        """One parameter of an effect, its default where it is left out."""
        label = f"{identity}.{parameter.name}"
        if raw is None:
            return float(parameter.default)
        if not isinstance(raw, Mapping):
            self.no_unit(label, raw, parameter.unit)
            return None
        if "tol" in raw:
            self.problems.append(
                f"{label}.tol is not allowed: an effect has no nominal value to keep to; how well "
                "this one is known is its standard deviation, std"
            )
        self.unknown_keys(
            f"{label}.", (k for k in raw if k != "tol"), ("value", "unit", "std", "error")
        )
        if "error" in raw:
            self.of_each_recording(f"{qualified(identity, place)}.{parameter.name}", label, raw)
        unit = raw.get("unit")
        if "value" not in raw or not isinstance(unit, str):
            self.problems.append(f"{label}: value and unit (like {parameter.unit!r}) are needed")
            return None
        full = qualified(identity, place)
        value = self.scalar(
            label, parameter.unit, raw["value"], unit, parameter.lower, parameter.upper
        )
        if value is not None:
            self.units.written[f"{full}.{parameter.name}"] = unit
        if "std" in raw:
            std = self.scalar(
                f"{label}.std", parameter.unit, raw["std"], unit, 0.0, 1e300, difference=True
            )
            if std is not None:
                self.effect_std.setdefault(full, {})[parameter.name] = std
        return value


def _block_names(block: str, table: Mapping[str, Any]) -> list[str]:
    """Entries of a block that are named blocks: neither its own keys nor mistyped ones."""
    own = {*(key.where[0] for key in BLOCKS[block]), *(port.name for port in PORTS.get(block, ()))}
    names = [
        name
        for name, inner in table.items()
        if name not in own and isinstance(inner, Mapping) and not {"value", "unit"} & {*inner}
    ]
    if own & {*table}:
        names = [name for name in names if not difflib.get_close_matches(name, own, n=1)]
    return names


def _dig(table: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    inner: Any = table
    for name in path:
        if not isinstance(inner, Mapping):
            return None
        inner = inner.get(name)
    return inner
