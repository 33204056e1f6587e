"""Texts on next experiments and plans, from ``words.toml``."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def words(table: str) -> dict[str, Any]:
    """A table of ``words.toml``: ``telling``, ``measured`` or ``lumped``."""
    text = files("pamrs.diagnosis.next_experiment").joinpath("words.toml")
    found: dict[str, Any] = tomllib.loads(text.read_text(encoding="utf-8"))[table]
    return found
