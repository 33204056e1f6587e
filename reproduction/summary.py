"""The page of all chapters: how many statements have which kind of verdict, and each that counts
with kind, reason and picture.
"""

from __future__ import annotations

from collections.abc import Mapping

from reproduction.comparison import KINDS, Comparison
from reproduction.page import Section
from reproduction.statements import text


def counts(section: Section) -> dict[str, int]:
    """How many statements have each kind of verdict, and how many lines stand apart.

    Parameters
    ----------
    section : Section

    Returns
    -------
    dict of str to int
        By kind, in the order of :data:`reproduction.comparison.KINDS`, and ``"apart"``.
    """
    counted = [row for row in section.rows if not row.apart]
    return {
        **{kind: sum(row.kind == kind for row in counted) for kind in KINDS},
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
    every = {name: counts(section) for name, section in sections.items()}
    total = {key: sum(found[key] for found in every.values()) for key in (*KINDS, "apart")}
    whole = sum(total[kind] for kind in KINDS)
    lines = [
        text("summary").format(command=command, own=total[KINDS[0]], whole=whole).rstrip(),
        *(
            f"| [{section.title}]({_page(name)}.md) | {_cells(every[name])} |"
            for name, section in sections.items()
        ),
        f"| **all** | {_cells(total)} |",
        "",
    ]
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
    return " | ".join(str(number) for number in found.values())


def _line(name: str, section: Section, row: Comparison) -> str:
    published, ours = row.shown
    pictures = [one.name for one in section.pictures if one.group == row.group]
    links = " ".join(
        f"[{number}]({_page(name)}/{one}.png)" for number, one in enumerate(pictures, 1)
    )
    kind = f"**{row.kind}**" if row.verdict == "differs" else row.kind
    reason = row.criterion if row.kind == KINDS[0] else row.remark or row.criterion
    cells = (
        row.fact,
        row.where,
        f"{published} {row.unit}".strip(),
        f"{ours} {row.unit}".strip(),
        kind,
        reason,
        links,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
