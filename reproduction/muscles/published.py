"""Every published fact beside what the library's muscle gives: value, deviation, and agree /
differs / cannot tell.
"""

from __future__ import annotations

from pamrs.library import Entry, entry, names
from pamrs.units import parse_unit
from reproduction.comparison import Comparison, judge
from reproduction.muscles import Fact, facts
from reproduction.muscles.evaluate import KINDS

__all__ = ["compare", "compare_entry", "headings"]


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
        If there is no such muscle.
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
    return [_compare(item, fact) for fact in facts(item.name)]


def headings() -> dict[str, str]:
    """Name and title of each muscle, by its name, which is the group of its facts."""
    return {name: f"{name}: {entry(name).title}" for name in names()}


def _compare(item: Entry, fact: Fact) -> Comparison:
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
