"""The command line of reproduction: ``pamrs reproduce``."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from pamrs.cli._shared import check_writable, progress, write
from pamrs.errors import check_packages

__all__ = ["reproduce_command"]


def reproduce_command(
    chapter: Annotated[
        list[str],
        typer.Argument(
            help="Chapters of the 2014 dissertation: ch2, ch3, ch4, ch5, ch6; or all of them: all."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            help=(
                "Folder for facts.csv, facts.md and one PNG for each figure; made if it is not "
                "there. With all: for README.md, a page, a folder and facts.csv for each chapter."
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
                "diagnoses, eight lifting cycles instead of two (ch6)."
            )
        ),
    ] = True,
    cache: Annotated[
        Path | None,
        typer.Option(
            help=(
                "With all: folder in which finished chapters are kept by what they depend on; the "
                "user's folder for caches by default."
            )
        ),
    ] = None,
) -> None:
    """Set what a chapter of the dissertation states beside what this package gives, with a verdict
    for each statement.

    All chapters: one summary page, and finished chapters are kept. A second call takes seconds
    where nothing changed, and one that was stopped goes on with the chapter that it was at.
    """
    from pamrs import reproduce
    from pamrs.comparison import table, to_csv, verdicts
    from pamrs.errors import ParameterError
    from pamrs.reproduce.page import page as to_page

    chapters = list(dict.fromkeys(chapter))
    if "all" in chapters:
        if chapters != ["all"]:
            raise ParameterError(f"chapter = {', '.join(chapters)}: all goes alone")
        if page is not None:
            raise ParameterError(
                f"--page = {str(page)!r} is not allowed with all: its pages are README.md and one "
                "for each chapter in the folder of --output"
            )
        _every(output, search, cache)
        return
    if cache is not None:
        raise ParameterError(f"--cache = {str(cache)!r} is allowed with all only")
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
    in_short = [sentence for section in sections for sentence in section.in_short]
    lines = [table(rows, headings=headings), "", *in_short, f"\n{verdicts(rows)}"]
    write(contents, "\n".join(lines))


def _every(output: Path, search: bool, cache: Path | None) -> None:
    """Every chapter: its page, pictures and table in the folder, and the summary."""
    from pamrs import reproduce
    from pamrs.comparison import to_csv, verdicts
    from pamrs.reproduce.page import page as to_page
    from pamrs.reproduce.summary import summary

    check_packages("plot", "matplotlib", "PIL")
    if search:
        check_packages("search", "deap", "cma")
    output.mkdir(parents=True, exist_ok=True)
    check_writable(output / "README.md")
    if cache is not None:
        cache.mkdir(parents=True, exist_ok=True)
        check_writable(cache / "section.json")
    words = ["pamrs", "reproduce", "all", "--output", str(output)]
    words += [] if search else ["--no-search"]
    try:
        with progress("reproducing all chapters"):
            sections = reproduce.every(
                search=search, cache=cache, progress=lambda text: typer.echo(f"  {text}", err=True)
            )
    except KeyboardInterrupt:
        typer.echo("stopped: what was finished is kept, the same command goes on", err=True)
        raise
    contents: dict[Path, str | bytes | Callable[[Path], object]] = {
        output / "README.md": summary(sections, shlex.join(words))
    }
    for name, section in sections.items():
        chapter = name.replace("ch", "chapter")
        folder = output / chapter
        folder.mkdir(exist_ok=True)
        target = output / f"{chapter}.md"
        alone = ["pamrs", "reproduce", name, "--output", str(folder), "--page", str(target)]
        alone += [] if search else ["--no-search"]
        contents[target] = to_page([section], shlex.join(alone), chapter)
        contents[folder / "facts.csv"] = to_csv(section.rows)
        for picture in section.pictures:
            contents[folder / f"{picture.name}.png"] = picture.png
    told = [f"{section.title}: {verdicts(list(section.rows))}" for section in sections.values()]
    write(contents, "\n".join(told))
