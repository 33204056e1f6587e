"""The JSON schema of ``rig.toml``, by which editors complete and check it.

What it forbids, the reader refuses; the reader knows more (products of units, numbers of one block
that do not go together, names of other blocks).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from pamrs.declared import BOOLEAN, NAME, NUMBER, TEXT, Rule, document, quantity, table
from pamrs.effects import EFFECTS, EffectInfo, EffectParameter
from pamrs.rig._model_error import ERROR_BLOCKS, ERROR_CHANNELS, STATED
from pamrs.rig.schema import BLOCKS, LIMITS, PORTS, REQUIRED_BLOCKS, SCHEMA, SINGLE_BLOCKS, Key
from pamrs.units import with_unit

__all__ = ["rig_schema"]

_OWN: Final = Rule({"const": "own"}, "", "another value in each recording")
_SPREAD: Final = table(
    {
        "tol": Rule({**NUMBER, "minimum": 0}, "", "one standard deviation of what is known"),
        "unknown": Rule(BOOLEAN, "", "the value is sought, and only a placeholder"),
        "error": _OWN,
    }
)["properties"]
_STD: Final = table(
    {
        "std": Rule({**NUMBER, "minimum": 0}, "", "standard deviation of the value"),
        "error": _OWN,
    }
)["properties"]
_BLOCK_NAME: Final = "^[A-Za-z0-9_-]+$"


def rig_schema() -> dict[str, Any]:
    """The JSON schema of ``rig.toml``."""
    made = _Maker()
    head = table(
        {
            "schema": Rule({"const": SCHEMA}, ""),
            "name": Rule(NAME, "", "what the rig is called"),
            "description": Rule({}, ""),
            "case": Rule(TEXT, "", "folder of the case that the model was diagnosed from"),
            "limits": Rule(
                made.keys("limits", LIMITS, {}), "", "what the bench allows, for experiments"
            ),
            "effects": Rule(made.effects(), "", "physics that the blocks leave out"),
            "model_error": Rule(_model_error(), "", "how well the model itself is known"),
        },
        ["schema", *REQUIRED_BLOCKS],
    )
    head["properties"] |= {block: made.blocks(block) for block in BLOCKS}
    about = "A test bench as pamrs reads it: blocks, their numbers with units, and their ports."
    return document(SCHEMA, about, head, made.definitions)


class _Maker:
    """Makes schemas; quantities of the same unit and bounds are defined once."""

    def __init__(self) -> None:
        self.definitions: dict[str, Any] = {}

    def quantity(
        self, unit: str, ends: tuple[float, float], beside: Mapping[str, Any], *, many: bool = False
    ) -> dict[str, Any]:
        """A reference to the table of a value with its unit and what may stand beside it."""
        spread = "tol" if "tol" in beside else "std"
        name = f"{'list' if many else 'number'} [{unit}] {ends[0]:.6g} to {ends[1]:.6g}, {spread}"
        name = name.replace("/", " per ")
        if name not in self.definitions:
            found = quantity(unit, *ends, many=many)
            found["properties"] |= beside
            self.definitions[name] = {"type": "object", "additionalProperties": False, **found}
        return {"$ref": f"#/$defs/{name.translate(_ESCAPED)}"}

    def value(self, key: Key) -> dict[str, Any]:
        """The value of a key."""
        if key.kind == "choice":
            found: dict[str, Any] = {"enum": [*key.choices]}
        else:
            found = self.quantity(
                key.unit, (key.lower, key.upper), _SPREAD, many=key.kind == "vector"
            )
        if key.kind == "count" or (key.path and key.kind == "scalar"):
            bare = "integer" if key.kind == "count" else "number"
            own = {"type": bare, "minimum": key.lower, "maximum": key.upper}
            found = {"anyOf": [own, found]}
        elif key.path:
            item = {**NUMBER, "minimum": key.lower, "maximum": key.upper}
            found = {"anyOf": [{"type": "array", "items": item, "minItems": 1}, found]}
        shown = {"default": key.default} if isinstance(key.default, str) and key.default else {}
        return {"description": _about(key), **shown, **found}

    def keys(
        self, block: str, keys: tuple[Key, ...], ports: Mapping[str, dict[str, Any]]
    ) -> dict[str, Any]:
        """A table of keys, those in tables inside it and ports included."""
        found: dict[str, Any] = {**ports}
        for key in keys:
            if not key.path:
                found[key.name] = self.value(key)
                continue
            outer, own = key.path
            inner = found.setdefault(outer, {"type": "object", "additionalProperties": False})
            inner.setdefault("properties", {})[own] = self.value(key)
        own_table = {"type": "object", "additionalProperties": False, "properties": found}
        conditions = [] if block == "limits" else _by_kind(block)
        return own_table | ({"allOf": conditions} if conditions else {})

    def blocks(self, block: str) -> dict[str, Any]:
        """A block, or several with a name each."""
        ports = {
            port.name: {
                **TEXT,
                "description": f"a {' or '.join(port.kinds)} by its name"
                + "".join(f', or "{word}"' for word in port.words)
                + f"; left out: {port.default}",
            }
            for port in PORTS.get(block, ())
        }
        self.definitions[block] = self.keys(block, BLOCKS[block], ports)
        one = {"$ref": f"#/$defs/{block}"}
        if block in SINGLE_BLOCKS:
            return one
        named = {
            "type": "object",
            "minProperties": 1,
            "patternProperties": {_BLOCK_NAME: one},
            "additionalProperties": False,
        }
        return {"anyOf": [one, named]}

    def effects(self) -> dict[str, Any]:
        """The tables of effects."""
        keys = {
            "id": Rule({"enum": [*EFFECTS]}, "", "which effect"),
            "at": Rule(TEXT, "", "name of the one block that it acts on"),
            "form": Rule(TEXT, "", "its form; the first one where it is left out"),
            "parameters": Rule({"type": "object"}, "", "values of its parameters"),
        }
        cases = [case for info in EFFECTS.values() for case in self.forms(info)]
        return {"type": "array", "items": {**table(keys, ["id"]), "allOf": cases}}

    def forms(self, info: EffectInfo) -> list[dict[str, Any]]:
        """What an effect may have, by its form."""
        first = info.forms[0].name
        names = [form.name for form in info.forms]
        this: dict[str, Any] = {"properties": {"id": {"const": info.id}}, "required": ["id"]}
        found: list[dict[str, Any]] = [
            {"if": this, "then": {"properties": {"form": {"enum": [*names, ""]}}}}
        ]
        for form in info.forms:
            words = [form.name, ""] if form.name == first else [form.name]
            # the first form is meant where none is named
            needed = ["id"] if form.name == first else ["id", "form"]
            asked = {**this["properties"], "form": {"enum": words}}
            keys = {parameter.name: self.parameter(parameter) for parameter in form.parameters}
            own = {"additionalProperties": False, "properties": keys}
            then = {"properties": {"parameters": own}}
            found.append({"if": {"properties": asked, "required": needed}, "then": then})
        return found

    def parameter(self, parameter: EffectParameter) -> dict[str, Any]:
        """The value of a parameter of an effect."""
        unit = parameter.unit
        about = f"{parameter.meaning}; default {with_unit(f'{parameter.default:g}', unit)}"
        ends = (parameter.lower, parameter.upper)
        return {"description": about, **self.quantity(unit, ends, _STD)}


#: What a reference has in the place of signs of its own (RFC 6901, RFC 3986).
_ESCAPED: Final = str.maketrans({" ": "%20", "[": "%5B", "]": "%5D", "%": "%25", "^": "%5E"})


def _about(key: Key) -> str:
    """Words, unit, bounds and usual value of a key."""
    parts = [key.note] if key.note else []
    if key.kind != "choice":
        unit = with_unit(f"{key.lower:.4g} to {key.upper:.4g}", key.unit)
        parts.append(f"{'each ' if key.kind == 'vector' else ''}{unit}")
    if isinstance(key.default, tuple):
        parts.append(f"default {list(key.default)}")
    elif isinstance(key.default, str):
        parts += [f"default {key.default}"] if key.default else []
    else:
        usual = None if key.default is None else with_unit(f"{key.default:g}", key.unit)
        parts.append("needed" if usual is None else f"default {usual}")
    parts += [f"only with {', '.join(key.only)}"] if key.only else []
    return "; ".join(parts)


def _by_kind(block: str) -> list[dict[str, Any]]:
    """Which keys a block must and must not have, by its kind."""
    needed = [key for key in BLOCKS[block] if key.default is None and not key.only]
    found = [_having(needed, [])] if needed else []
    for told in (key for key in BLOCKS[block] if key.kind == "choice"):
        if not any(key.only and {*key.only} <= {*told.choices} for key in BLOCKS[block]):
            continue
        for word in told.choices:
            own = [key for key in BLOCKS[block] if key.only and {*key.only} <= {*told.choices}]
            without = [key for key in own if word not in key.only]
            needed = [key for key in own if word in key.only and key.default is None]
            this: dict[str, Any] = {"properties": {told.name: {"const": word}}}
            this |= {} if word == told.default else {"required": [told.name]}
            found.append({"if": this, "then": _having(needed, without)})
    return found


def _having(needed: list[Key], without: list[Key]) -> dict[str, Any]:
    """A table that has some keys, and not others; either may stand in tables inside it."""
    found: dict[str, Any] = {}
    for key in needed:
        inner = found
        for name in key.where:
            inner.setdefault("required", [])
            inner["required"] += [name] if name not in inner["required"] else []
            inner = inner.setdefault("properties", {}).setdefault(name, {})
    for key in without:
        inner = found
        for name in key.where[:-1]:
            inner = inner.setdefault("properties", {}).setdefault(name, {})
        inner.setdefault("properties", {})[key.where[-1]] = False
    return found


def _model_error() -> dict[str, Any]:
    """How well the model is known: a share of a block, a share or a size of a channel."""
    stated = {"anyOf": [{**TEXT, "pattern": f"^{STATED}$"}, {"type": "object"}]}
    names = "|".join((*ERROR_BLOCKS, *ERROR_CHANNELS))
    return {
        "type": "object",
        "patternProperties": {rf"^({names})(\..*)?$": stated},
        "additionalProperties": False,
    }
