"""What a hypothesis says of an effect: its id, and behind an ``@`` the one block at which it acts,
where a rig has several of that kind: ``leak_muscle@flexor``.

Without a place it acts at every block of its kind, with one value. A dotted name of a parameter
begins with the same: ``leak_muscle@flexor.conductance``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pamrs.effects._catalogue import EFFECTS
from pamrs.effects._info import EffectInfo, EffectParameter

__all__ = [
    "exclude",
    "find_parameter",
    "id_of",
    "info_of",
    "is_effect",
    "place_of",
    "term_in",
    "term_of",
]


def term_of(effect: str, at: str = "") -> str:
    """An effect at a place; everywhere where the place is empty.

    Examples
    --------
    >>> term_of("leak_muscle", "flexor")
    'leak_muscle@flexor'
    """
    return f"{effect}@{at}" if at else effect


def id_of(term: str) -> str:
    """The id of an effect at a place."""
    return term.partition("@")[0]


def place_of(term: str) -> str:
    """Name of the block at which an effect acts; empty where it acts at every one."""
    return term.partition("@")[2]


def is_effect(term: str) -> bool:
    """Whether a name is that of an effect, with or without a place."""
    return id_of(term) in EFFECTS


def info_of(term: str) -> EffectInfo:
    """What is known of an effect at a place."""
    return EFFECTS[id_of(term)]


def find_parameter(name: str) -> EffectParameter:
    """The parameter of a dotted name such as ``leak_muscle.conductance``, or of the same effect at
    one place, ``leak_muscle@flexor.conductance``; KeyError if there is none.
    """
    term, _, short = name.partition(".")
    forms = reversed(info_of(term).forms)
    return {p.name: p for form in forms for p in form.parameters}[short]


def usual_values(name: str, forms: Mapping[str, str] | None = None) -> tuple[float, float] | None:
    """Mean and standard deviation of the usual values of a dotted effect parameter, by the form
    that its effect has (``forms``, the first where none is given); None where any value is usual.
    """
    term, _, short = name.partition(".")
    form = info_of(term).form((forms or {}).get(term, ""))
    return next((p.prior for p in form.parameters if p.name == short), None)


def term_in(entry: Mapping[str, Any]) -> str:
    """The same of an effect of a rig, as :attr:`pamrs.Rig.effects` lists it."""
    return term_of(entry["id"], entry.get("at", ""))


def exclude(term: str, others: Iterable[str]) -> bool:
    """Whether an effect cannot act beside others: it is there already, or one of the two acts
    everywhere.
    """
    return any(
        id_of(term) == id_of(other) and (term == other or not place_of(term) or not place_of(other))
        for other in others
    )
