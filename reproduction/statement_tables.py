"""Statements as Markdown and CSV, and by short names for sentences about them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from reproduction.comparison import Comparison


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
            if row.remark:
                number += 1
                mark = f" [{number}]"
                remarks.append(f"- [{number}] {row.fact}: {row.remark}")
            counts = row.verdict == "differs" and not row.apart
            verdict = f"**{row.told_verdict}**" if counts else row.told_verdict
            cells = (
                row.fact,
                row.where,
                *row.shown,
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
    """The comparison as CSV with a heading, the kind of verdict last; what is no number stays
    empty.

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
    writer.writerow([*(field.name for field in fields(Comparison)), "kind"])
    for row in rows:
        writer.writerow([*(_cell(value) for value in row.to_dict().values()), row.kind])
    return stream.getvalue()


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else ""
    return "" if value is None else str(value)
