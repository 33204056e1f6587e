"""The page of all chapters: how many statements agree, and each that counts with verdict, reason
and picture.
"""

from __future__ import annotations

from collections.abc import Mapping

from pamrs.comparison import VERDICTS, Comparison
from reproduction.page import Section
from reproduction.statements import text

__all__ = ["counts", "summary"]


def counts(section: Section) -> dict[str, int]:
    """How many statements have each verdict, how many of those that agree were used to identify,
    and how many lines stand apart.

    Parameters
    ----------
    section : Section

    Returns
    -------
    dict of str to int
        By verdict, ``"used"`` and ``"apart"``.
    """
    counted = [row for row in section.rows if not row.apart]
    return {
        **{verdict: sum(row.verdict == verdict for row in counted) for verdict in VERDICTS},
        "used": sum(row.verdict == "agree" and row.used for row in counted),
        "apart": len(section.rows) - len(counted),
    }


def summary(sections: Mapping[str, Section], command: str) -> str:
    """The page.

    Parameters
    ----------
    sections : mapping of str to Section
        By chapter; the page of ``"ch6"`` is ``chapter6.md`` beside this one, its pictures in
        ``chapter6``.
    command : str
        The command that makes it, shown on top.

    Returns
    -------
    str
        Markdown.
    """
    lines = [text("summary").format(command=command).rstrip()]
    total = dict.fromkeys((*VERDICTS, "used", "apart"), 0)
    for name, section in sections.items():
        found = counts(section)
        total = {key: total[key] + found[key] for key in total}
        lines.append(f"| [{section.title}]({_page(name)}.md) | {_cells(found)} |")
    lines += [f"| **all** | {_cells(total)} |", ""]
    for name, section in sections.items():
        lines += [
            f"## {section.title}",
            "",
            "| statement | where | published | ours | verdict | reason | picture |",
            "|---|---|--:|--:|---|---|---|",
        ]
        group = None
        for row in section.rows:
            if row.apart:
                continue
            if row.group != group:
                group = row.group
                head = section.headings.get(group, group).replace("|", "\\|")
                lines.append(f"| **{head}** | | | | | | |")
            lines.append(_line(name, section, row))
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _page(name: str) -> str:
    return name.replace("ch", "chapter")


def _cells(found: Mapping[str, int]) -> str:
    return " | ".join(
        str(found[key]) for key in ("agree", "used", "differs", "cannot tell", "apart")
    )


def _line(name: str, section: Section, row: Comparison) -> str:
    published, ours = row.shown
    pictures = [one.name for one in section.pictures if one.group == row.group]
    links = " ".join(
        f"[{number}]({_page(name)}/{one}.png)" for number, one in enumerate(pictures, 1)
    )
    verdict = f"**{row.verdict}**" if row.verdict == "differs" else row.verdict
    reason = row.criterion if row.verdict == "agree" else row.note
    cells = (
        row.fact,
        row.where,
        f"{published} {row.unit}".strip(),
        f"{ours} {row.unit}".strip(),
        verdict + (" (used)" if row.used else ""),
        reason,
        links,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
