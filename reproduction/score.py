"""Each published statement counts once: which lines of a chapter stand apart, and why."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

from pamrs.comparison import Comparison

__all__ = ["OTHER", "OWN", "SAME", "TRIAL", "Apart", "scored"]

#: Why a line stands apart: the statement in another reading; the same statement for another
#: payload or quantity; what nobody stated; a plant that was tried.
OTHER: Final = "another reading"
SAME: Final = "the same statement"
OWN: Final = "a check of our own"
TRIAL: Final = "a trial"

#: Patterns of group and statement, both whole, and why they stand apart.
Apart = tuple[str, str, str]


def scored(rows: Iterable[Comparison], apart: Sequence[Apart]) -> list[Comparison]:
    """The lines, those that a pattern fits being no part of the score; the first that fits decides.

    Parameters
    ----------
    rows : iterable of Comparison
        Of a chapter.
    apart : sequence of (str, str, str)
        Regular expressions of group and statement, and the reason.

    Returns
    -------
    list of Comparison
    """
    found = []
    for row in rows:
        why = next(
            (
                why
                for group, fact, why in apart
                if re.fullmatch(group, row.group) and re.fullmatch(fact, row.fact)
            ),
            row.apart,
        )
        found.append(replace(row, apart=why))
    return found
