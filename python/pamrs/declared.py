"""How files and results declare what stands in them, and the JSON schemas that come of it.

A type (an entry of a result, the settings) is a dataclass whose fields carry :func:`told`; a table
that people write (``case.toml``, parts of ``rig.toml``) is a mapping of :class:`Rule`; a quantity
with a unit is :func:`quantity`. What a reader asks (:func:`problems_of`) and what
an editor is told come from the same declaration.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from pamrs.units import from_si, parse_unit, spellings

__all__ = [
    "BOOLEAN",
    "DEFINITIONS",
    "NAME",
    "NUMBER",
    "TEXT",
    "Rule",
    "accepts",
    "document",
    "is_finite",
    "object_of",
    "problems_of",
    "quantity",
    "reference",
    "table",
    "told",
    "unit_text",
    "unknown_key",
]

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


DEFINITIONS: dict[str, Any] = {
    "number": {"type": ["number", "null"]},
    "probability": {"type": ["number", "null"], "minimum": 0, "maximum": 1},
}
"""Definitions that every schema has; null where the data give no number."""

_NUMBER, _PROBABILITY = {"$ref": "#/$defs/number"}, {"$ref": "#/$defs/probability"}
_PAIR = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}
_KINDS: dict[str, dict[str, Any]] = {
    "pair": _PAIR,
    "pair_or_null": {"oneOf": [{"type": "null"}, _PAIR]},
    "pairs": {"type": "array", "items": _PAIR},
    "events": {
        "type": "array",
        "items": {
            "type": "object",
            "required": ["recording"],
            "properties": {"recording": {"type": "string"}},
            "additionalProperties": {"type": "number"},
        },
    },
}
_PLAIN: dict[Any, dict[str, Any]] = {
    str: {"type": "string"},
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: _NUMBER,
    Any: {},
}


def told(
    about: str = "",
    *,
    key: str = "",
    json: bool = True,
    optional: bool = False,
    omit_empty: bool = False,
    kind: str = "",
    enum: Sequence[str] = (),
    required: bool = True,
    least_length: int = 0,
    unit: str = "",
    least: float = -math.inf,
    most: float = math.inf,
    origin: str = "",
) -> dict[str, Any]:
    """Metadata of a field.

    Parameters
    ----------
    about : str
        What it is, for the JSON schema.
    key : str
        Its key, where that is not its name.
    json : bool
        Whether it is written to JSON.
    optional : bool
        Whether its key is absent where it is None.
    omit_empty : bool
        Whether JSON leaves it out where it is None or empty.
    kind : str
        What its type does not say: ``probability``, ``pair``, ``pair_or_null`` and ``pairs`` of
        numbers, ``events``.
    enum : sequence of str
        Allowed values.
    required : bool
        Whether a reader can rely on it.
    least_length : int
        Fewest characters.
    unit : str
        SI unit of a number, ``count`` of a whole one.
    least, most : float
        Range of a number, both ends allowed.
    origin : str
        Where the number comes from.
    """
    given = dict(locals())  # first of all: every argument is a key, and nothing else
    relied_on = required and not optional and not omit_empty
    return given | {"enum": tuple(enum), "required": relied_on}


def reference(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """A reference to the schema of a dataclass, which is added to the definitions.

    Parameters
    ----------
    cls : type
        The dataclass.
    definitions : dict
        Gets the schema by the name of the class, and those of what it holds.
    """
    if cls.__name__ not in definitions:
        definitions[cls.__name__] = {}  # its place, before those of what it holds
        definitions[cls.__name__] = object_of(cls, definitions)
    return {"$ref": f"#/$defs/{cls.__name__}"}


def object_of(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema of a dataclass.

    Parameters
    ----------
    cls : type
        The dataclass; its fields carry what :func:`told` gives them.
    definitions : dict
        Gets the schemas of the dataclasses that it holds.

    Returns
    -------
    dict
        An object without other keys than its fields.
    """
    hints = typing.get_type_hints(cls)
    properties, required = {}, []
    for field in dataclasses.fields(cls):
        meta = field.metadata
        if not meta.get("json", True):
            continue
        key = meta.get("key") or field.name
        properties[key] = _described(_of(hints[field.name], meta, definitions), meta)
        if meta.get("required", True):
            required.append(key)
    doc = (cls.__doc__ or "").strip().partition("\n")[0].rstrip(".")
    found = {"description": doc, "type": "object", "additionalProperties": False}
    return {**found, "required": required, "properties": properties}


def _described(schema: dict[str, Any], meta: Mapping[str, Any]) -> dict[str, Any]:
    """With what is said of the field in front."""
    about = meta.get("about", "")
    unit = meta.get("unit", "")
    text = f"{about} [{unit}]" if unit and unit not in ("1", "count") else about
    return {"description": text, **schema} if text else schema


def _of(hint: Any, meta: Mapping[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema of a type."""
    if meta.get("kind") in _KINDS:
        return _KINDS[meta["kind"]]
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        (own,) = [a for a in inner if a is not type(None)]
        return _or_null(_of(own, meta, definitions), optional=bool(meta.get("optional")))
    if origin is list:
        return {"type": "array", "items": _of(inner[0], meta, definitions)}
    if origin is tuple:
        return _tuple(inner, meta, definitions)
    if origin is dict:
        if inner[1] is Any:
            return {"type": "object"}
        return {"type": "object", "additionalProperties": _of(inner[1], meta, definitions)}
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return reference(hint, definitions)
    if meta.get("enum"):
        return {"enum": list(meta["enum"])}
    if hint is float and meta.get("kind") == "probability":
        return _PROBABILITY
    if hint is float and meta.get("origin"):
        return {"type": "number"}  # a setting always is one
    least = meta.get("least_length", 0)
    return {**_PLAIN[hint], **({"minLength": least} if least else {})}


def _or_null(schema: dict[str, Any], *, optional: bool) -> dict[str, Any]:
    """A type, or null where a value is not known; a number is either anyway."""
    if schema in (_NUMBER, _PROBABILITY) or optional:
        return schema
    if isinstance(schema.get("type"), str) and len(schema) == 1:
        return {"type": [schema["type"], "null"]}
    return {"oneOf": [{"type": "null"}, schema]}


def _tuple(
    inner: tuple[Any, ...], meta: Mapping[str, Any], definitions: dict[str, Any]
) -> dict[str, Any]:
    """A tuple of any length, or of some length of one type."""
    items = {"type": "array", "items": _of(inner[0], meta, definitions)}
    if inner[-1] is Ellipsis:
        return {**items, "minItems": 1}
    return {**items, "minItems": len(inner), "maxItems": len(inner)}


# ------------------------------------------------------------------------ tables that people write

TEXT: Final[dict[str, Any]] = {"type": "string"}
NAME: Final[dict[str, Any]] = {"type": "string", "minLength": 1}
NUMBER: Final[dict[str, Any]] = {"type": "number"}
BOOLEAN: Final[dict[str, Any]] = {"type": "boolean"}


class Rule(NamedTuple):
    """What a key of a table may be.

    Attributes
    ----------
    schema : dict
        As a JSON schema.
    needed : str
        The same in words, for messages: "a text".
    about : str
        What it is.
    """

    schema: dict[str, Any]
    needed: str
    about: str = ""


_TYPES: Final[dict[str, tuple[type, ...]]] = {
    "string": (str,),
    "boolean": (bool,),
    "number": (int, float),
    "integer": (int,),
    "array": (list,),
    "object": (Mapping,),
}


def is_finite(value: object) -> bool:
    """Whether something is a number, and no flag."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def accepts(schema: Mapping[str, Any], value: Any) -> bool:
    """Whether a value is what a schema says: types, lengths, allowed values, members.

    Parameters
    ----------
    schema : mapping
        With ``type``, ``enum``, ``const``, ``anyOf``, ``minLength``, ``maxLength``, ``minItems``,
        ``items`` and ``additionalProperties``; other words are passed over.
    value : object
        As TOML gives it.
    """
    if "anyOf" in schema:
        return any(accepts(one, value) for one in schema["anyOf"])
    if "enum" in schema or "const" in schema:
        return value in schema.get("enum", (schema.get("const"),))
    kind = schema.get("type", "")
    if kind and (
        not isinstance(value, _TYPES[kind]) or (isinstance(value, bool) and kind != "boolean")
    ):
        return False
    if kind in ("number", "integer"):
        return is_finite(value)
    if kind == "string":
        return bool(schema.get("minLength", 0) <= len(value) <= schema.get("maxLength", math.inf))
    if kind == "array":
        inside = schema.get("items", {})
        return len(value) >= schema.get("minItems", 0) and all(accepts(inside, v) for v in value)
    inside = schema.get("additionalProperties", {})
    return kind != "object" or all(accepts(inside, v) for v in value.values())


def unknown_key(prefix: str, name: str, allowed: Iterable[str]) -> str:
    """The message about a key that is not allowed, with what is near to it."""
    names = list(allowed)
    near = difflib.get_close_matches(str(name), names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(names)}"
    return f"unknown key {prefix + str(name)!r}; {hint}"


def problems_of(
    prefix: str,
    given: Mapping[str, Any],
    rules: Mapping[str, Rule],
    *,
    needed: Iterable[str] = (),
    skip: Iterable[str] = (),
) -> list[str]:
    """What is wrong with a table: keys that are unknown, missing, or not what their rules say.

    Parameters
    ----------
    prefix : str
        What stands before a key in messages.
    given : mapping
        The table.
    rules : mapping of str to Rule
        What each key may be.
    needed, skip : iterable of str
        Keys that may not be missing, and those whose values are judged elsewhere.
    """
    found = [unknown_key(prefix, key, rules) for key in given if key not in rules]
    for key, rule in rules.items():
        asked = (key in given or key in needed) and key not in skip
        if asked and not accepts(rule.schema, given.get(key)):
            value = f"{prefix}{key} = {given.get(key)!r}"
            found.append(f"{value} is not allowed: {rule.needed} is needed")
    return found


def table(rules: Mapping[str, Rule], required: Sequence[str] = ()) -> dict[str, Any]:
    """The schema of a table without other keys than those of its rules."""
    keys = {
        name: {**({"description": rule.about} if rule.about else {}), **rule.schema}
        for name, rule in rules.items()
    }
    found = {"type": "object", "additionalProperties": False, "properties": keys}
    return found | ({"required": list(required)} if required else {})


def document(name: str, about: str, schema: dict[str, Any], defs: dict[str, Any]) -> dict[str, Any]:
    """A schema as a file, with what it refers to."""
    head = {"$schema": DIALECT, "$id": f"urn:pamrs:schema:{name.replace('/', ':')}"}
    defs = {"$defs": defs} if defs else {}
    return {**head, "title": name, **schema, "description": about, **defs}


# ----------------------------------------------------------------------- quantities with a unit


@functools.cache
def _unit_words(unit: str, *, absolute: bool) -> dict[str, Any]:
    """The schema of a unit of the dimension of an SI unit: known words, and products of them, whose
    dimension the reader checks.
    """
    words = [unit, *(word for word in spellings(unit) if word != unit)]
    also: list[dict[str, Any]] = [{"pattern": r"[\s*·/^()0-9]"}]
    if unit == "Pa":
        behind = ["g", "gauge", "ü", "rel", "relative"]
        behind += ["a", "abs", "absolute", "absolut"] if absolute else []
        any_case = ("".join(f"[{c.lower()}{c.upper()}]" for c in word) for word in behind)
        also.append({"pattern": f"^({'|'.join(words)})[_,-]*({'|'.join(any_case)})\\.?$"})
    return {"type": "string", "anyOf": [{"enum": words}, *also]}


def unit_text(unit: str, *, absolute: bool = False) -> dict[str, Any]:
    """The schema of a unit as people write it.

    Parameters
    ----------
    unit : str
        The SI unit; its dimension is needed.
    absolute : bool
        Whether a pressure may be absolute (``bar(a)``).
    """
    return _unit_words(unit, absolute=absolute)


def quantity(unit: str, lower: float, upper: float, *, many: bool = False) -> dict[str, Any]:
    """The schema of ``{ value, unit }`` with bounds in each unit.

    Parameters
    ----------
    unit : str
        The SI unit.
    lower, upper : float
        Bounds in it, both allowed.
    many : bool
        Whether the value is a list of numbers.

    Returns
    -------
    dict
        Properties and conditions of an object, to which others may be added.
    """
    number: dict[str, Any] = {"type": "array", "items": NUMBER, "minItems": 1} if many else NUMBER
    limits = []
    for word in (unit, *spellings(unit)):
        bounds = _bounds(word, unit, lower, upper)
        value = {"items": bounds} if many else bounds
        then = {"properties": {"value": value}}
        limits.append({"if": {"properties": {"unit": {"const": word}}}, "then": then})
    return {
        "properties": {"value": number, "unit": unit_text(unit)},
        "required": ["value", "unit"],
        "allOf": limits if math.isfinite(lower) or math.isfinite(upper) else [],
    }


def _bounds(word: str, unit: str, lower: float, upper: float) -> dict[str, float]:
    """Bounds in a unit, as much wider as numbers are rounded when they are converted."""
    found = {}
    for name, bound, side in (("minimum", lower, -1.0), ("maximum", upper, 1.0)):
        if math.isfinite(bound):
            value = from_si(bound, word, unit)
            exact = parse_unit(word)[:2] == (1.0, 0.0)
            found[name] = value if exact else value + side * 1e-12 * (abs(value) + 1e-300)
    return found
