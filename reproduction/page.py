"""The page of one or several chapters: pictures, tables and remarks as Markdown."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from reproduction.comparison import Comparison, verdicts
from reproduction.statement_tables import markdown
from reproduction.statements import text


@dataclass(frozen=True)
class Picture:
    """One picture of a chapter.

    Attributes
    ----------
    name : str
        Name of its file without ending.
    group : str
        The group of statements that it belongs to.
    caption : str
        What it shows, one or two sentences.
    png : bytes
        The picture.
    """

    name: str
    group: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class Section:
    """What is told of one chapter.

    Attributes
    ----------
    title : str
        Its title.
    rows : sequence of Comparison
        Its statements.
    headings : mapping of str to str
        What is said above a group, where that is more than its name.
    in_short : sequence of str
        Sentences to begin with.
    chosen : sequence of (str, str, str)
        Name, value and reason of each number that the source does not give.
    pictures : sequence of Picture
        Its pictures.
    symbols : sequence of (str, str, str)
        Name, meaning and unit of the symbols and abbreviations that it uses.
    tables : mapping of str to str
        Tables of numbers that stand below a group, as Markdown.
    """

    title: str
    rows: Sequence[Comparison]
    headings: Mapping[str, str]
    in_short: Sequence[str]
    chosen: Sequence[tuple[str, str, str]]
    pictures: Sequence[Picture]
    symbols: Sequence[tuple[str, str, str]] = ()
    tables: Mapping[str, str] = field(default_factory=dict)


def page(sections: Sequence[Section], command: str, folder: str | os.PathLike[str] = ".") -> str:
    """The page.

    Parameters
    ----------
    sections : sequence of Section
        One for each chapter.
    command : str
        The command that makes it, shown on top.
    folder : path-like
        Where the pictures are, as seen from the page.

    Returns
    -------
    str
        Markdown.
    """
    lines = [text("page").format(command=command)]
    for section in sections:
        lines += [f"## {section.title}", "", f"{verdicts(list(section.rows))}.", ""]
        lines += [f"- {sentence}" for sentence in section.in_short] + [""]
        lines += _symbols(section)
        if section.chosen:
            lines += [
                "### Numbers that the source does not give",
                "",
                "| number | value | from |",
                "|---|---|---|",
            ]
            lines += [
                f"| `{name}` | {value} | {reason} |" for name, value, reason in section.chosen
            ] + [""]
        below = {group: f"{text}\n\n" for group, text in section.tables.items()}
        for picture in section.pictures:
            file = (Path(folder) / f"{picture.name}.png").as_posix()
            below[picture.group] = (
                below.get(picture.group, "")
                + f"![{picture.caption}]({file})\n\n*{picture.caption}*\n\n"
            )
        lines += [markdown(section.rows, headings=section.headings, below=below)]
    return "\n".join(lines).rstrip() + "\n"


def _symbols(section: Section) -> list[str]:
    """The table of a chapter's symbols, with an empty line behind; nothing where there are none."""
    if not section.symbols:
        return []
    rows = [f"| {name} | {meaning} | {unit} |" for name, meaning, unit in section.symbols]
    return [
        "### Symbols and abbreviations",
        "",
        "| symbol | meaning | unit |",
        "|---|---|---|",
        *rows,
        "",
    ]
