"""What an entry of a result is: a frozen dataclass that can be read like a dictionary."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class Entry(Mapping[str, Any]):
    """Part of a result: attributes with types, readable by key as well.

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

    Parameters
    ----------
    value : object
        Entries, numpy objects, containers and plain values.

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
    found = {}
    for field in dataclasses.fields(entry):
        value, meta = getattr(entry, field.name), field.metadata
        absent = meta.get("optional") and value is None
        empty = meta.get("omit_empty") and (value is None or value == [])
        if meta.get("json", True) and not absent and not empty:
            found[meta.get("key") or field.name] = to_plain(value)
    if "unit" in found:
        found["unit"] = found["unit"] or "1"  # of a plain number
    return found
