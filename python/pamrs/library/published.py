"""Every published fact beside what the library's muscle gives: value, deviation, and agree /
differs / cannot tell.
"""

from __future__ import annotations

from collections.abc import Iterable

from pamrs import comparison
from pamrs._checks import one_of
from pamrs.comparison import Comparison, judge, verdicts
from pamrs.library import Entry, Fact, entry, names
from pamrs.library.evaluate import KINDS
from pamrs.units import parse_unit

__all__ = ["Comparison", "compare", "compare_all", "compare_entry", "headings", "table", "verdicts"]


def compare(name: str) -> list[Comparison]:
    """Compare every published fact of one muscle.

    Parameters
    ----------
    name : str
        A name of the library.

    Returns
    -------
    list of Comparison

    Raises
    ------
    ParameterError
        If there is no such muscle, or its file has a kind of fact that is not known.
    """
    return compare_entry(entry(name))


def compare_entry(item: Entry) -> list[Comparison]:
    """Compare every published fact of a muscle, which may be the library's with another number.

    Parameters
    ----------
    item : Entry
        The muscle.

    Returns
    -------
    list of Comparison
    """
    return [_compare(item, fact) for fact in item.facts]


def compare_all() -> list[Comparison]:
    """Compare every published fact of every muscle of the library."""
    return [row for name in names() for row in compare(name)]


def headings() -> dict[str, str]:
    """Name and title of each muscle, by its name, which is the group of its facts."""
    return {name: f"{name}: {entry(name).title}" for name in names()}


def table(rows: Iterable[Comparison], *, notes: bool = True, titles: bool = True) -> str:
    """The comparison as text, as :func:`pamrs.comparison.table`, under the titles of the
    muscles.
    """
    return comparison.table(rows, notes=notes, titles=titles, headings=headings())


def _compare(item: Entry, fact: Fact) -> Comparison:
    one_of(f"{item.name}: fact kind", fact.kind, KINDS)
    scale = parse_unit(fact.unit).scale
    return judge(
        item.name,
        fact.name,
        fact.where,
        fact.published / scale,
        KINDS[fact.kind](item, fact.at) / scale,
        "" if fact.unit == "1" else fact.unit,
        relation=fact.relation,
        tolerance=fact.tolerance / scale,
        basis="construction" if fact.used else "",
        cannot_tell=fact.cannot_tell,
        reason="" if fact.cannot_tell else fact.note,
    )
