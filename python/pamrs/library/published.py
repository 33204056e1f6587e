"""Every published fact beside what the library's muscle gives: value, deviation, and agree / differs / cannot tell."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from pamrs.errors import ParameterError
from pamrs.library import Entry, Fact, entry, names
from pamrs.library.evaluate import KINDS
from pamrs.units import parse_unit

__all__ = ["Comparison", "compare", "compare_all", "table", "verdicts"]


@dataclass(frozen=True)
class Comparison:
    """One fact compared.

    Attributes
    ----------
    muscle, fact, where, unit, note : str
        Muscle, statement, place in the dissertation, unit of the three numbers, remark.
    published, ours, deviation : float
        In ``unit``; the deviation is ours less published.
    relative : float or None
        Deviation over the published value; None where that is zero.
    relation : {"equals", "above", "below"}
        How ours must stand to the published value.
    verdict : {"agree", "differs", "cannot tell"}
        By the fact's tolerance or relation.
    used : bool
        The fact took part in the identification.
    """

    muscle: str
    fact: str
    where: str
    unit: str
    published: float
    ours: float
    deviation: float
    relative: float | None
    relation: str
    verdict: str
    used: bool
    note: str

    def to_dict(self) -> dict[str, Any]:
        """The fields as a dictionary."""
        return asdict(self)


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
    item = entry(name)
    return [_compare(item, fact) for fact in item.facts]


def compare_all() -> list[Comparison]:
    """Compare every published fact of every muscle of the library."""
    return [row for name in names() for row in compare(name)]


def _compare(item: Entry, fact: Fact) -> Comparison:
    if fact.kind not in KINDS:
        raise ParameterError(f"{item.name}: fact kind = {fact.kind!r} is not known: one of {', '.join(KINDS)}")
    ours = KINDS[fact.kind](item, fact.at)
    gap = ours - fact.published
    if fact.cannot_tell:
        verdict = "cannot tell"
    elif fact.relation == "equals":
        verdict = "agree" if abs(gap) <= fact.tolerance else "differs"
    else:
        verdict = "agree" if (gap > 0.0) == (fact.relation == "above") and gap != 0.0 else "differs"
    shown, published = (value / parse_unit(fact.unit).scale for value in (ours, fact.published))
    return Comparison(
        muscle=item.name,
        fact=fact.name,
        where=fact.where,
        unit="" if fact.unit == "1" else fact.unit,
        published=published,
        ours=shown,
        deviation=shown - published,
        relative=gap / fact.published if fact.published else None,
        relation=fact.relation,
        verdict=verdict,
        used=fact.used,
        note=fact.cannot_tell or fact.note,
    )


def table(rows: Iterable[Comparison], *, notes: bool = True, titles: bool = True) -> str:
    """The comparison as text, one line per fact.

    Parameters
    ----------
    rows : iterable of Comparison
        As :func:`compare` or :func:`compare_all` return them.
    notes : bool
        Whether remarks follow their line.
    titles : bool
        Whether a line names the muscle before its facts.

    Returns
    -------
    str
    """
    lines = [f"{'fact':<52} {'published':>10} {'ours':>10} {'unit':<7} {'deviation':>9}  verdict"]
    muscle = ""
    for row in rows:
        if titles and row.muscle != muscle:
            muscle = row.muscle
            lines += ["", f"{muscle}: {entry(muscle).title}" if muscle in names() else muscle]
        published = {"equals": "", "above": "> ", "below": "< "}[row.relation] + _number(row.published)
        deviation = (
            f"{100.0 * row.relative:+.1f} %"
            if row.relative is not None and row.relation == "equals"
            else _number(row.deviation, sign=True)
        )
        verdict = row.verdict + (" (used to identify)" if row.used else "")
        line = f"{row.fact:<52} {published:>10} {_number(row.ours):>10} {row.unit:<7} {deviation:>9}  {verdict}"
        lines.append(line.rstrip())
        if notes:
            lines.append(f"    {row.where}{': ' + row.note if row.note else ''}")
    return "\n".join(lines)


def verdicts(rows: Sequence[Comparison]) -> str:
    """How many facts agree, differ, or cannot tell, in words."""
    found = {verdict: sum(row.verdict == verdict for row in rows) for verdict in ("agree", "differs", "cannot tell")}
    used = sum(row.verdict == "agree" and row.used for row in rows)
    note = f" ({used} used to identify)" if used else ""
    return f"{found['agree']} agree{note}, {found['differs']} differ, {found['cannot tell']} cannot tell"


def _number(value: float, *, sign: bool = False) -> str:
    if not math.isfinite(value):
        return "none"
    value += 0.0  # no minus zero
    digits = 0 if abs(value) >= 1000.0 else 3 if abs(value) < 10.0 else 2
    return f"{value:{'+' if sign else ''}.{digits}f}"
