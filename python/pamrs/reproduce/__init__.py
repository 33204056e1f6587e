"""The 2014 dissertation chapter by chapter: what it states beside what this package gives.

``pamrs.reproduce.section("ch3")`` runs the experiments of a chapter and has its statements, each
with a verdict, and its pictures; ``pamrs reproduce ch3 --output DIR`` writes them.
``pamrs.reproduce.every()`` does so for all chapters and keeps each one by what it depends on
(``pamrs reproduce all``).
"""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from pathlib import Path

    from pamrs.reproduce.page import Section

__all__ = ["check", "every", "names", "section"]

#: Chapter -> its module; the one of its pictures has the same name and ``_figures``.
_CHAPTERS: Final = {f"ch{number}": f"_chapter{number}" for number in range(2, 7)}


def names() -> list[str]:
    """Names of the chapters that there are."""
    return list(_CHAPTERS)


def check(name: str) -> None:
    """Refuse a chapter that there is not.

    Parameters
    ----------
    name : str
        One of :func:`names`.

    Raises
    ------
    ParameterError
        If there is no such chapter; the message lists those that there are.
    """
    if name not in _CHAPTERS:
        near = difflib.get_close_matches(str(name), _CHAPTERS, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        raise ParameterError(
            f"chapter = {name!r} is not reproduced.{hint} There are: {', '.join(_CHAPTERS)}"
        )


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
        One of :func:`names`.
    search : bool
        Whether what takes minutes runs too: in chapter 3 searches of joints (extra ``search``), in
        chapter 4 finer maps of gains and the diagnoses, in chapter 6 eight cycles instead of two.
    pictures : bool
        Whether its pictures are drawn (extra ``plot``).
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    Section

    Raises
    ------
    ParameterError
        If there is no such chapter; the message lists those that there are.
    MissingPackageError
        If an extra is missing; the message names it.
    """
    from pamrs.reproduce._symbols import symbols
    from pamrs.reproduce.page import Section

    check(name)
    if pictures:
        try:
            drawn = importlib.import_module(f"pamrs.reproduce.{_CHAPTERS[name]}_figures")
        except ImportError as error:
            from pamrs.errors import missing_package

            raise missing_package(error, "plot") from error
    chapter = importlib.import_module(f"pamrs.reproduce.{_CHAPTERS[name]}")
    rows = chapter.facts(search=search, progress=progress)
    if pictures and progress is not None:
        progress(f"{name}: pictures")
    return Section(
        title=chapter.TITLE,
        rows=rows,
        headings=chapter.headings(),
        in_short=chapter.in_short(rows),
        chosen=chapter.chosen(),
        pictures=drawn.pictures() if pictures else [],
        symbols=symbols(name),
        tables=chapter.tables() if hasattr(chapter, "tables") else {},
    )


def every(
    *,
    search: bool = True,
    cache: Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Section]:
    """Every chapter with its pictures; a chapter that was made before from the same code, core,
    inputs and packages is taken from where it is kept.

    A chapter is kept as soon as it is done: what is stopped goes on where it was.

    Parameters
    ----------
    search : bool
        As for :func:`section`.
    cache : Path, optional
        Folder of the kept chapters; the user's folder for caches by default.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    dict of str to Section
        By chapter, in their order.

    Raises
    ------
    MissingPackageError
        If an extra is missing; the message names it.
    OSError
        If a chapter cannot be kept.
    """
    from pamrs.reproduce import _store

    root = _store.folder() if cache is None else cache
    tell = progress or (lambda _: None)
    found: dict[str, Section] = {}
    for name, module in _CHAPTERS.items():
        key = _store.digest(name, module, search=search)
        known = _store.kept(root, key)
        if known is None:
            tell(f"{name}: reproducing")
            known = section(name, search=search, progress=progress)
            if _store.digest(name, module, search=search) == key:
                _store.keep(root, key, known)
            else:
                tell(f"{name}: not kept, the code changed while it ran")
        else:
            tell(f"{name}: nothing changed, taken from {root}")
        found[name] = known
    return found
