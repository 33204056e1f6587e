"""Base class of the entries of a result, and their conversion to and from plain values."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

NOT_WRITTEN: Final = {"json": False}
"""Metadata of a field that JSON has not."""
OPTIONAL: Final = {"optional": True}
"""Metadata of a field whose key is absent where it is None."""
OMIT_EMPTY: Final = {"omit_empty": True}
"""Metadata of a list that JSON leaves out where it is empty."""


@dataclasses.dataclass(frozen=True, eq=False)
class Entry(Mapping[str, Any]):
    """Part of a result: attributes with types, readable by key as well. A field whose key is not
    its name has it as ``key`` in its metadata.

    ``entry["block"]``, ``entry.get("block")`` and ``entry.keys()`` say the same as
    ``entry.block``; two entries are equal when their keys and values are, and so are an entry and
    a dictionary.
    """

    def _fields(self) -> Iterator[tuple[str, Any]]:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None or not field.metadata.get("optional"):
                yield field.metadata.get("key") or field.name, value

    def __getitem__(self, key: str) -> Any:
        for name, value in self._fields():
            if name == key:
                return value
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        return (name for name, _ in self._fields())

    def __len__(self) -> int:
        return sum(1 for _ in self._fields())


def to_plain(value: Any) -> Any:
    """A value as JSON has it: entries by their written fields, null for what is not finite.

    Raises
    ------
    TypeError
        For anything else.
    """
    if isinstance(value, Entry):
        return _entry(value)
    if isinstance(value, Mapping):
        return {str(k): to_plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return to_plain(value.tolist())
    if isinstance(value, np.generic):
        return to_plain(value.item())
    if isinstance(value, (str, bool, int)) or value is None:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (Sequence, set, frozenset)):
        ordered = sorted(value) if isinstance(value, (set, frozenset)) else value
        return [to_plain(v) for v in ordered]
    raise TypeError(f"cannot write a {type(value).__name__} to JSON")


def _entry(entry: Entry) -> dict[str, Any]:
    content = {}
    for field in dataclasses.fields(entry):
        value, meta = getattr(entry, field.name), field.metadata
        absent = meta.get("optional") and value is None
        empty = meta.get("omit_empty") and value == []
        if meta.get("json", True) and not absent and not empty:
            content[meta.get("key") or field.name] = to_plain(value)
    if "unit" in content:
        content["unit"] = content["unit"] or "1"  # of a plain number
    return content


def from_plain(hint: Any, value: Any) -> Any:
    """A value as it was before `to_plain`: entries of their types, NaN where a number is null.

    Parameters
    ----------
    hint : type
        What it was: an entry, a plain type, or a container of either.
    value : object
        As JSON has it.

    Raises
    ------
    TypeError, ValueError, AttributeError
        If the value cannot be that.
    """
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        (only,) = [one for one in inner if one is not type(None)]
        return None if value is None else from_plain(only, value)
    if origin is list:
        return [from_plain(inner[0], one) for one in value]
    if origin in (dict, Mapping):
        return {key: from_plain(inner[1], one) for key, one in value.items()}
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return hint(**fields_from(hint, value))
    if hint is float:
        return math.nan if value is None else float(value)
    if hint in (str, bool, int) and not isinstance(value, hint):
        raise TypeError(f"{value!r} is no {hint.__name__}")
    return value


def fields_from(cls: type[Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a dataclass from the fields of it that were written; as :func:`from_plain`."""
    if not isinstance(given, Mapping):
        raise TypeError(f"{given!r} is no table of {cls.__name__}")
    hints, arguments = typing.get_type_hints(cls), {}
    for field in dataclasses.fields(cls):
        key = field.metadata.get("key") or field.name
        if field.metadata.get("json", True) and key in given:
            arguments[field.name] = from_plain(hints[field.name], given[key])
    return arguments
