"""JSON schemas from dataclasses: one definition for each type of entry."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any

__all__ = ["DEFINITIONS", "object_of", "reference"]

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
        The dataclass; its fields carry what `pamrs.findings.told` gives them, or the ``reason``
        and ``unit`` of a setting.
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
    about = meta.get("about") or meta.get("reason", "")
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
    if hint is float and "reason" in meta:
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
