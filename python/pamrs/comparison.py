"""Published statements beside what this package gives: value, deviation, and agree / differs /
cannot tell.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Final

from pamrs.errors import ParameterError

__all__ = [
    "RELATIONS",
    "VERDICTS",
    "Comparison",
    "Told",
    "judge",
    "markdown",
    "shown",
    "table",
    "to_csv",
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

    def to_dict(self) -> dict[str, Any]:
        """The fields as a dictionary."""
        return asdict(self)


class Told:
    """Statements by the short name of their group, for sentences about them.

    Parameters
    ----------
    rows : sequence of Comparison
        The statements.
    groups : mapping of str to str
        Short name -> group; a group that is not in it is its own name.
    digits : int
        Decimals of a number, unless told.
    """

    def __init__(self, rows: Sequence[Comparison], groups: Mapping[str, str], digits: int) -> None:
        self._rows = {(row.group, row.fact): row for row in rows}
        self._groups, self._digits = groups, digits

    def row(self, group: str, fact: str) -> Comparison:
        """One statement; KeyError if it is not there."""
        return self._rows[self._groups.get(group, group), fact]

    def ours(self, group: str, fact: str, digits: int | None = None) -> str:
        """Our number in words; KeyError if the statement is not there."""
        return f"{self.row(group, fact).ours:.{self._digits if digits is None else digits}f}"


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
        line = (
            f"{row.fact:<{width}} {_published(row):>10} {_number(row.ours):>10} {row.unit:<7} "
            f"{row.gap:>9}  {_verdict(row)}"
        )
        lines.append(line.rstrip())
        if notes:
            lines.append(f"    {row.where}{': ' + row.note if row.note else ''}")
    return "\n".join(lines)


def markdown(
    rows: Iterable[Comparison],
    *,
    headings: Mapping[str, str] | None = None,
    below: Mapping[str, str] | None = None,
) -> str:
    """The comparison as Markdown: a table for each group, its remarks as a list below.

    Parameters
    ----------
    rows : iterable of Comparison
        The statements; a group stands together.
    headings : mapping of str to str, optional
        Heading of each group; the group itself by default.
    below : mapping of str to str, optional
        What follows a group.

    Returns
    -------
    str
    """
    groups: dict[str, list[Comparison]] = {}
    for row in rows:
        groups.setdefault(row.group, []).append(row)
    lines: list[str] = []
    number = 0
    for group, members in groups.items():
        lines += [f"### {(headings or {}).get(group, group)}", ""]
        lines += [
            "| statement | where | published | ours | unit | deviation | criterion | verdict |",
            "|---|---|--:|--:|---|--:|---|---|",
        ]
        remarks = []
        for row in members:
            mark = ""
            if row.note:
                number += 1
                mark = f" [{number}]"
                remarks.append(f"- [{number}] {row.fact}: {row.note}")
            counts = row.verdict == "differs" and not row.apart
            verdict = f"**{_verdict(row)}**" if counts else _verdict(row)
            cells = (
                row.fact,
                row.where,
                _published(row),
                _number(row.ours),
                row.unit,
                row.gap,
                row.criterion,
                verdict + mark,
            )
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        lines += ["", *remarks, *([""] if remarks else [])]
        if below and group in below:
            lines += [below[group].rstrip(), ""]
    return "\n".join(lines).rstrip() + "\n"


def to_csv(rows: Iterable[Comparison]) -> str:
    """The comparison as CSV with a heading; what is no number stays empty.

    Parameters
    ----------
    rows : iterable of Comparison
        The statements.

    Returns
    -------
    str
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([field.name for field in fields(Comparison)])
    for row in rows:
        writer.writerow([_cell(value) for value in row.to_dict().values()])
    return stream.getvalue()


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


def shown(row: Comparison) -> tuple[str, str]:
    """The published number, with the sign of its relation, and ours, as tables show them.

    Parameters
    ----------
    row : Comparison

    Returns
    -------
    published, ours : str
        "none" where there is none.
    """
    return _published(row), _number(row.ours)


def _published(row: Comparison) -> str:
    return _SIGN[row.relation] * math.isfinite(row.published) + _number(row.published)


def _verdict(row: Comparison) -> str:
    verdict = row.verdict + (" (used to identify)" if row.used else "")
    if not row.apart:
        return verdict
    return f"({row.apart})" if row.verdict == "cannot tell" else f"({row.apart}: {verdict})"


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else ""
    return "" if value is None else str(value)


def _number(value: float, *, sign: bool = False) -> str:
    if not math.isfinite(value):
        return "none"
    value += 0.0  # no minus zero
    digits = 0 if abs(value) >= 1000.0 else 3 if abs(value) < 10.0 else 2
    return f"{value:{'+' if sign else ''}.{digits}f}"
