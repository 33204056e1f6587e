"""Texts of the pages, one Markdown file each, with places for what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def written(name: str, **measured: Any) -> str:
    """A page with what was measured in its places."""
    text = Path(__file__).with_name(f"{name}.md").read_text(encoding="utf-8")
    return text.format(**measured)
