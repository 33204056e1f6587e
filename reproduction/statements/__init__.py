"""The statements of the chapters as tables: what is published, where, by which criterion ours
agrees, and what is to be said of it.

A table ``chapterN.toml`` has one ``[[statement]]`` for each line of the chapter's page. In its
texts, ``{0}``, ``{1:.2f}``, ... are places for what the code found.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from reproduction.comparison import Comparison, judge

__all__ = ["OTHER", "OWN", "TRIAL", "Lines", "Statements", "symbols", "text"]

#: Why a line is no part of the score: the statement in another reading; what nobody stated; a plant
#: that was tried.
OTHER: Final = "another reading"
OWN: Final = "a check of our own"
TRIAL: Final = "a trial"

_TEXTS: Final = ("fact", "where", "unit", "cannot_tell", "note", "reason")


def text(name: str) -> str:
    """What a page begins with: a Markdown file of this folder."""
    return Path(__file__).with_name(f"{name}.md").read_text(encoding="utf-8")


def _table(name: str) -> dict[str, Any]:
    """A table of this folder."""
    return tomllib.loads(Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8"))


def symbols(chapter: str) -> list[tuple[str, str, str]]:
    """Name, meaning and unit of the symbols and abbreviations that a chapter's page uses.

    Parameters
    ----------
    chapter : str
        ``"ch6"``.
    """
    return [
        (one["name"], one["meaning"], one["unit"])
        for one in _table("symbols")["symbol"]
        if chapter in one["chapters"]
    ]


class Statements:
    """The table of a chapter.

    Parameters
    ----------
    chapter : str
        ``"chapter6"``.

    Attributes
    ----------
    title : str
        Of the chapter.
    groups : dict of str to str
        The experiments by the name under which code and pictures find their group.
    pictures : list of dict
        ``name``, ``group`` and ``caption`` of each picture, in their order.
    rows : dict of str to dict
        Each statement by its id.
    numbers : list of dict
        ``name``, ``value`` and ``reason`` of each number that the chapter does not give.
    apart : list of (str, str, str)
        Patterns of group and statement, both whole, of lines that are no part of the score, and
        why.
    bases : list of (str, str, str)
        Patterns of lines that no table of statements has, and what their agreement rests on.
    """

    def __init__(self, chapter: str) -> None:
        table = _table(chapter)
        self.title: str = table["title"]
        self.groups: dict[str, str] = table["groups"]
        self.pictures: list[dict[str, str]] = table.get("picture", [])
        self.rows: dict[str, dict[str, Any]] = {row.pop("id"): row for row in table["statement"]}
        self.apart = [(one["group"], one["fact"], one["why"]) for one in table.get("apart", [])]
        self.bases = [(one["group"], one["fact"], one["basis"]) for one in table.get("basis", [])]
        self._share: float = table.get("share", 0.0)
        self.numbers: list[dict[str, str]] = table.get("chosen", [])
        self._short: list[str] = table["short"]

    def entry(self, key: str, *said: Any, **more: Any) -> dict[str, Any]:
        """A statement without our number, as arguments of :func:`reproduction.comparison.judge`.

        Parameters
        ----------
        key : str
            Its id.
        *said
            What stands in the places of its texts.
        **more
            What the table leaves open.

        Returns
        -------
        dict of str to Any
        """
        found = {"group": "", **self.rows[key], **more}
        found["group"] = self.groups.get(found["group"], found["group"])
        for name in _TEXTS:
            if name in self.rows[key]:
                found[name] = found[name].format(*said)
        published = found["published"]
        share = self._share * abs(published) if math.isfinite(published) else 0.0
        return {"tolerance": share, **found}

    def __call__(self, key: str, ours: float = math.nan, *said: Any, **more: Any) -> Comparison:
        """A statement beside our number.

        Parameters
        ----------
        key : str
            Its id.
        ours : float
            Our number; none by default.
        *said
            What stands in the places of its texts.
        **more
            What the table leaves open.

        Returns
        -------
        Comparison
        """
        return judge(ours=float(ours), **self.entry(key, *said, **more))

    def lines(self, group: str = "") -> Lines:
        """No line yet, of a group where the table leaves it open."""
        return Lines(self, group)

    def scored(self, rows: Iterable[Comparison]) -> list[Comparison]:
        """The lines, those that a pattern of :attr:`apart` fits being no part of the score, and
        with the bases of :attr:`bases`; the first pattern that fits decides.
        """
        return [
            replace(
                row,
                apart=_first(self.apart, row, row.apart),
                basis=_first(self.bases, row, row.basis),
            )
            for row in rows
        ]

    def short(self, *said: tuple[Any, ...]) -> list[str]:
        """The sentences to begin with, each with what stands in its places."""
        return [text.format(*one) for text, one in zip(self._short, said, strict=True)]

    def chosen(self, *said: Any) -> list[tuple[str, str, str]]:
        """Name, value and reason of each number that the chapter does not give.

        Parameters
        ----------
        *said
            What stands in the places of the values.
        """
        return [(one["name"], one["value"].format(*said), one["reason"]) for one in self.numbers]


class Lines(list[Comparison]):
    """Statements beside our numbers, one after the other."""

    def __init__(self, table: Statements, group: str = "") -> None:
        super().__init__()
        self._table, self._group = table, {"group": group} if group else {}

    def say(self, key: str, ours: float = math.nan, *said: Any, **more: Any) -> None:
        """One more, with the arguments of :class:`Statements`."""
        self.append(self._table(key, ours, *said, **self._group, **more))


def _first(patterns: list[tuple[str, str, str]], row: Comparison, otherwise: str) -> str:
    """What the first pattern that fits a line says of it."""
    return next((said for group, fact, said in patterns if _fit(row, group, fact)), otherwise)


def _fit(row: Comparison, group: str, fact: str) -> bool:
    return bool(re.fullmatch(group, row.group) and re.fullmatch(fact, row.fact))
