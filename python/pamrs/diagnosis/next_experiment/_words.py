"""What is asked of a next experiment and said of a plan, as ``words.toml`` has it."""

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
