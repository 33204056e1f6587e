"""Published statements beside what this package gives: value, deviation, agree / differs / cannot
tell, and what an agreement rests on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from pamrs._checks import one_of, refused
from pamrs.errors import ParameterError

__all__ = [
    "BASES",
    "KINDS",
    "RELATIONS",
    "VERDICTS",
    "Comparison",
    "judge",
    "verdicts",
]

#: How ours must stand to the published value.
RELATIONS: Final = ("equals", "above", "below")
#: What can be said about a statement.
VERDICTS: Final = ("agree", "differs", "cannot tell")
#: What an agreement rests on: nothing but the statement's number; what was taken from the statement
#: itself or follows from how the thing was built; a sign, where another model would agree as well.
BASES: Final[Mapping[str, str]] = {
    "": "agrees on its own",
    "construction": "agrees by construction",
    "sign": "agrees in sign only",
}
#: What counts in a score: only the first says that ours is right.
KINDS: Final = (*BASES.values(), "differs", "cannot tell")

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
    basis : {"", "construction", "sign"}
        What an agreement rests on, see :data:`BASES`.
    reason : str
        Why it differs, where that is known.
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
    basis: str
    note: str
    apart: str = ""
    reason: str = ""

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
    def kind(self) -> str:
        """The verdict with what an agreement rests on: one of :data:`KINDS`."""
        return BASES[self.basis] if self.verdict == "agree" else self.verdict

    @property
    def remark(self) -> str:
        """Reason and note; of a line that counts and differs without one, that it is not known."""
        unknown = self.verdict == "differs" and not self.apart
        reason = self.reason or ("reason not known" if unknown else "")
        return "; ".join(part for part in (reason, self.note) if part)

    @property
    def told_verdict(self) -> str:
        """The kind of verdict as tables show it, in brackets where it does not count."""
        if not self.apart:
            return self.kind
        told = self.apart if self.verdict == "cannot tell" else f"{self.apart}: {self.verdict}"
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
    basis: str = "",
    cannot_tell: str = "",
    note: str = "",
    apart: str = "",
    reason: str = "",
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
    basis : {"", "construction", "sign"}
        What an agreement rests on, see :data:`BASES`.
    cannot_tell : str
        Why nothing can be decided; the verdict is then "cannot tell", and this the remark.
    note : str
        A remark; it follows ``cannot_tell`` where both are given.
    apart : str
        Why the line is no part of the score.
    reason : str
        Why it differs, where that is known.

    Returns
    -------
    Comparison

    Raises
    ------
    ParameterError
        If the relation or the basis is unknown, the tolerance is not a number from zero on, or
        there is no source.
    """
    one_of("relation", relation, RELATIONS)
    one_of("basis", basis, BASES)
    if not tolerance >= 0.0:
        raise refused("tolerance", tolerance, "a number from 0 on")
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
        basis=basis,
        note="; ".join(part for part in (cannot_tell, note) if part),
        apart=apart,
        reason=reason,
    )


def verdicts(rows: Sequence[Comparison]) -> str:
    """How many statements agree on their own, by construction and in sign only, differ, or cannot
    tell, in words, and how many lines stand apart.
    """
    counted = [row for row in rows if not row.apart]
    own, built, sign, differs, open_ = (sum(row.kind == kind for row in counted) for kind in KINDS)
    rest = len(rows) - len(counted)
    apart = f"; {rest} lines stand apart" if rest > 1 else "; 1 line stands apart" if rest else ""
    return (
        f"{own} agree on their own, {built} by construction, {sign} in sign only, "
        f"{differs} differ, {open_} cannot tell{apart}"
    )


def _number(value: float, *, sign: bool = False) -> str:
    if not math.isfinite(value):
        return "none"
    value += 0.0  # no minus zero
    digits = 0 if abs(value) >= 1000.0 else 3 if abs(value) < 10.0 else 2
    return f"{value:{'+' if sign else ''}.{digits}f}"
