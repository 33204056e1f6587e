"""The 2014 dissertation chapter by chapter: what it states beside what pamrs gives.

``reproduction.section("ch3")`` runs the experiments of a chapter and has its statements, each with
a verdict, and its pictures. ``make reproduce`` writes the pages of all chapters; finished chapters
are kept by what they depend on.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

from reproduction import store
from reproduction.page import Section
from reproduction.statements import symbols

__all__ = ["CHAPTERS", "every", "section"]

#: Chapters that there are, and their modules.
CHAPTERS: Final = {f"ch{number}": f"chapter{number}" for number in range(2, 7)}


def section(
    name: str,
    *,
    search: bool = True,
    pictures: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Section:
    """Run the experiments of a chapter.

    Parameters
    ----------
    name : str
        One of :data:`CHAPTERS`.
    search : bool
        Whether what takes minutes runs too: in chapter 3 searches of joints, in chapter 4 finer
        maps of gains and the diagnoses, in chapter 6 eight cycles instead of two.
    pictures : bool
        Whether its pictures are drawn.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    Section
    """
    chapter = importlib.import_module(f"reproduction.{CHAPTERS[name]}")
    rows = chapter.facts(search=search, progress=progress)
    drawn = []
    if pictures:
        if progress is not None:
            progress(f"{name}: pictures")
        drawn = importlib.import_module(f"reproduction.{CHAPTERS[name]}_figures").pictures()
    return Section(
        title=chapter.say.title,
        rows=rows,
        headings=chapter.headings() if hasattr(chapter, "headings") else {},
        in_short=chapter.in_short(rows),
        chosen=chapter.chosen() if hasattr(chapter, "chosen") else chapter.say.chosen(),
        pictures=drawn,
        symbols=symbols(name),
        tables=chapter.tables() if hasattr(chapter, "tables") else {},
    )


def every(
    chapters: list[str],
    cache: Path,
    *,
    search: bool = True,
    progress: Callable[[str], None] = print,
) -> dict[str, Section]:
    """Chapters with their pictures; one that was made before from the same code, core and packages
    is taken from where it is kept.

    A chapter is kept as soon as it is done: what is stopped goes on where it was.

    Parameters
    ----------
    chapters : list of str
        Some of :data:`CHAPTERS`.
    cache : Path
        Folder of the kept chapters.
    search : bool
        As for :func:`section`.
    progress : callable
        Called with what is done next.

    Returns
    -------
    dict of str to Section
        By chapter, in their order.

    Raises
    ------
    OSError
        If a chapter cannot be kept.
    """
    found: dict[str, Section] = {}
    for name in chapters:
        key = store.digest(name, search=search)
        known = store.kept(cache, key)
        if known is None:
            progress(f"{name}: reproducing")
            known = section(name, search=search, progress=progress)
            if store.digest(name, search=search) == key:
                store.keep(cache, key, known)
            else:
                progress(f"{name}: not kept, the code changed while it ran")
        else:
            progress(f"{name}: nothing changed, taken from {cache}")
        found[name] = known
    return found
