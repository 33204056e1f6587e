"""Tables of cases: rows of a TOML file beside the test that goes through them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def rows_of(test: str, name: str) -> Any:
    """A table by its name, for a test whose file (``__file__``) is called as that of the tables."""
    with Path(test).with_suffix(".toml").open("rb") as file:
        rows = tomllib.load(file)[name]
    assert rows, f"{name} has no cases"
    return rows


def text_of(test: str, name: str) -> str:
    """A rig of the folder ``rigs`` beside a test (``__file__``), as text that it may change."""
    return (Path(test).parent / "rigs" / f"{name}.toml").read_text(encoding="utf-8")
