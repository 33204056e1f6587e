"""What the documentation has of the reproduction."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs" / "reproduction"


@cache
def facts(chapter: str) -> list[dict[str, str]]:
    """The rows of a chapter's table."""
    with (DOCS / chapter / "facts.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def by_fact(chapter: str) -> dict[tuple[str, str], dict[str, str]]:
    """The same by group and fact."""
    return {(row["group"], row["fact"]): row for row in facts(chapter)}


def page_of(chapter: str) -> str:
    """Its page."""
    return (DOCS / f"{chapter}.md").read_text(encoding="utf-8")
