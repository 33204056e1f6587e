"""The command line of reproduction: ``pamrs reproduce``."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from pamrs.cli._shared import check_packages, check_writable, progress, write

__all__ = ["reproduce_command"]


def reproduce_command(
    chapter: Annotated[
        list[str], typer.Argument(help="Chapters of the 2014 dissertation: ch3, ch4, ch5.")
    ],
    output: Annotated[
        Path,
        typer.Option(
            help=(
                "Folder for facts.csv, facts.md and one PNG for each figure; made if it is not "
                "there."
            )
        ),
    ],
    page: Annotated[
        Path | None,
        typer.Option(help="Where to write the Markdown page, instead of facts.md in the folder."),
    ] = None,
    search: Annotated[
        bool,
        typer.Option(
            help=(
                "Also run what takes minutes: joint searches (ch3, extra search), fine gain maps, "
                "diagnoses."
            )
        ),
    ] = True,
) -> None:
    """Set what a chapter of the dissertation states beside what this package gives, with a verdict
    for each statement.
    """
    from pamrs import reproduce
    from pamrs.comparison import table, to_csv, verdicts
    from pamrs.reproduce.page import page as to_page

    chapters = list(dict.fromkeys(chapter))
    for name in chapters:
        reproduce.check(name)
    check_packages("plot", "matplotlib", "PIL")
    if search and "ch3" in chapters:
        check_packages("search", "deap", "cma")
    if page is not None and not page.resolve().is_relative_to(output.resolve()):
        check_writable(page)  # before a folder is made
    output.mkdir(parents=True, exist_ok=True)
    check_writable(page, output / "facts.csv")
    sections = []
    for name in chapters:
        with progress(f"reproducing {name}"):
            sections.append(
                reproduce.section(
                    name, search=search, progress=lambda text: typer.echo(f"  {text}", err=True)
                )
            )
    rows = [row for section in sections for row in section.rows]
    headings = {group: text for section in sections for group, text in section.headings.items()}
    target = output / "facts.md" if page is None else page
    words = ["pamrs", "reproduce", *chapters, "--output", str(output)]
    words += [] if page is None else ["--page", str(page)]
    words += [] if search else ["--no-search"]
    folder = os.path.relpath(output.resolve(), target.resolve().parent)
    contents: dict[Path, str | bytes | Callable[[Path], object]] = {
        output / "facts.csv": to_csv(rows),
        target: to_page(sections, shlex.join(words), folder),
        **{
            output / f"{picture.name}.png": picture.png
            for section in sections
            for picture in section.pictures
        },
    }
    typer.echo(table(rows, headings=headings))
    typer.echo("")
    for section in sections:
        for sentence in section.in_short:
            typer.echo(sentence)
    typer.echo(f"\n{verdicts(rows)}")
    write(contents)
