"""Published statements beside what this package gives: value, deviation, and agree / differs /
cannot tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from pamrs.errors import ParameterError

__all__ = [
    "RELATIONS",
    "VERDICTS",
    "Comparison",
    "judge",
    "table",
    "verdicts",
]

#: How ours must stand to the published value.
RELATIONS: Final = ("equals", "above", "below")
#: What can be said about a statement.
VERDICTS: Final = ("agree", "differs", "cannot tell")

_SIGN: Final = {"equals": "", "above": "> ", "below": "< "}


@dataclass(frozen=True)
class Comparison:
    """One published statement compared; made by :func:`judge`.

    Attributes
    ----------
    group, fact, where, unit, note : str
        What the statement is about (a muscle, an experiment), the statement, its place in the
        source, unit of the numbers, remark.
    published, ours, deviation : float
        In ``unit``; the deviation is ours less published. Not a number where there is none.
    relative : float or None
        Deviation over the published value; None where that is zero.
    relation : {"equals", "above", "below"}
        How ours must stand to the published value.
    tolerance : float
        Largest deviation that counts as agreement, in ``unit``; for ``equals``.
    verdict : {"agree", "differs", "cannot tell"}
        By the tolerance or the relation.
    used : bool
        The statement took part in choosing our numbers, so that agreement proves nothing.
    apart : str
        Why it is no part of the score: another reading of a statement that is there already, a
        trial, a diagnosis of our own; empty where it is.
    """

    group: str
    fact: str
    where: str
    unit: str
    published: float
    ours: float
    deviation: float
    relative: float | None
    relation: str
    tolerance: float
    verdict: str
    used: bool
    note: str
    apart: str = ""

    @property
    def criterion(self) -> str:
        """When ours counts as agreeing, in words; empty where there is no published number."""
        if not math.isfinite(self.published):
            return ""
        if self.relation != "equals":
            return self.relation
        return f"within {self.tolerance:.3g} {self.unit}".rstrip()

    @property
    def gap(self) -> str:
        """The deviation as people read it: a share where the numbers should be equal, else a
        difference.
        """
        if self.relative is not None and self.relation == "equals" and math.isfinite(self.relative):
            return f"{100.0 * self.relative:+.1f} %"
        return _number(self.deviation, sign=True)

    @property
    def shown(self) -> tuple[str, str]:
        """The published number, with the sign of its relation, and ours, as tables show them;
        "none" where there is none.
        """
        sign = _SIGN[self.relation] * math.isfinite(self.published)
        return sign + _number(self.published), _number(self.ours)

    @property
    def told_verdict(self) -> str:
        """The verdict as tables show it, with what it rests on."""
        verdict = self.verdict + (" (used to identify)" if self.used else "")
        if not self.apart:
            return verdict
        told = self.apart if self.verdict == "cannot tell" else f"{self.apart}: {verdict}"
        return f"({told})"

    def to_dict(self) -> dict[str, Any]:
        """The fields as a dictionary."""
        return asdict(self)


def judge(
    group: str,
    fact: str,
    where: str,
    published: float,
    ours: float,
    unit: str = "",
    *,
    relation: str = "equals",
    tolerance: float = 0.0,
    used: bool = False,
    cannot_tell: str = "",
    note: str = "",
    apart: str = "",
) -> Comparison:
    """Compare one number with a published one.

    Parameters
    ----------
    group, fact, where : str
        What the statement is about, the statement, and its place in the source.
    published, ours : float
        Both in ``unit``; not a number where there is none.
    unit : str
        Their unit, empty for a pure number.
    relation : {"equals", "above", "below"}
        How ours must stand to the published value; equal is neither above nor below.
    tolerance : float
        Largest absolute deviation that counts as equal, in ``unit``.
    used : bool
        The statement took part in choosing our numbers.
    cannot_tell : str
        Why nothing can be decided; the verdict is then "cannot tell", and this the remark.
    note : str
        A remark; it follows ``cannot_tell`` where both are given.
    apart : str
        Why the line is no part of the score.

    Returns
    -------
    Comparison

    Raises
    ------
    ParameterError
        If the relation is unknown, the tolerance is not a number from zero on, or there is no
        source.
    """
    if relation not in RELATIONS:
        raise ParameterError(
            f"relation = {relation!r} is not allowed: one of {', '.join(RELATIONS)}"
        )
    if not tolerance >= 0.0:
        raise ParameterError(f"tolerance = {tolerance} is not allowed: a number from 0 on")
    if not where.strip():
        raise ParameterError(f"where is empty: the fact {fact!r} needs its place in the source")
    gap = float(ours) - float(published)
    if cannot_tell:
        verdict = "cannot tell"
    elif relation == "equals":
        verdict = "agree" if abs(gap) <= tolerance else "differs"
    else:
        verdict = "agree" if (gap > 0.0 if relation == "above" else gap < 0.0) else "differs"
    return Comparison(
        group=group,
        fact=fact,
        where=where,
        unit=unit,
        published=float(published),
        ours=float(ours),
        deviation=gap,
        relative=gap / published if published else None,
        relation=relation,
        tolerance=float(tolerance),
        verdict=verdict,
        used=used,
        note="; ".join(part for part in (cannot_tell, note) if part),
        apart=apart,
    )


def table(
    rows: Iterable[Comparison],
    *,
    notes: bool = True,
    titles: bool = True,
    headings: Mapping[str, str] | None = None,
) -> str:
    """The comparison as text, one line per statement.

    Parameters
    ----------
    rows : iterable of Comparison
        The statements.
    notes : bool
        Whether source and remark follow each line.
    titles : bool
        Whether a line names each group before its statements.
    headings : mapping of str to str, optional
        What that line says, by group; the group itself by default.

    Returns
    -------
    str
    """
    rows = list(rows)
    width = max([52, *(len(row.fact) for row in rows)])
    lines = [
        f"{'fact':<{width}} {'published':>10} {'ours':>10} {'unit':<7} {'deviation':>9}  verdict"
    ]
    group = ""
    for row in rows:
        if titles and row.group != group:
            group = row.group
            lines += ["", (headings or {}).get(group, group)]
        published, ours = row.shown
        line = (
            f"{row.fact:<{width}} {published:>10} {ours:>10} {row.unit:<7} {row.gap:>9}  "
            f"{row.told_verdict}"
        )
        lines.append(line.rstrip())
        if notes:
            lines.append(f"    {row.where}{': ' + row.note if row.note else ''}")
    return "\n".join(lines)


def verdicts(rows: Sequence[Comparison]) -> str:
    """How many statements agree, differ, or cannot tell, in words, and how many lines stand
    apart.
    """
    counted = [row for row in rows if not row.apart]
    found = {verdict: sum(row.verdict == verdict for row in counted) for verdict in VERDICTS}
    used = sum(row.verdict == "agree" and row.used for row in counted)
    note = f" ({used} used to identify)" if used else ""
    rest = len(rows) - len(counted)
    apart = f"; {rest} lines stand apart" if rest > 1 else "; 1 line stands apart" if rest else ""
    return (
        f"{found['agree']} agree{note}, {found['differs']} differ, {found['cannot tell']} cannot "
        f"tell{apart}"
    )


def _number(value: float, *, sign: bool = False) -> str:
    if not math.isfinite(value):
        return "none"
    value += 0.0  # no minus zero
    digits = 0 if abs(value) >= 1000.0 else 3 if abs(value) < 10.0 else 2
    return f"{value:{'+' if sign else ''}.{digits}f}"
