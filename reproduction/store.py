"""Chapters that were reproduced before, kept by all that they depend on.

A chapter is kept in a folder of its own under the digest of the package's files, the core, the
versions of what it calculates and draws with, and what was asked for. A file that changes gives
another digest; nothing is ever taken for something else, and nothing has to be thrown away by hand.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import tempfile
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import pamrs
from reproduction.comparison import Comparison
from reproduction.page import Picture, Section

#: Folders of the package, of its reproduction, and of the other code that chapter 6 stands beside.
_ROOTS: Final = (
    Path(pamrs.__file__).parent,
    Path(__file__).parent,
    Path(__file__).parents[1] / "tests" / "reference",
)
#: What is calculated and drawn with, besides them.
_PACKAGES: Final = ("numpy", "scipy", "matplotlib", "Pillow", "deap", "cma")
#: Parts of them on which no number and no picture depends.
_WITHOUT: Final = frozenset({"cli", "__main__.py", "page.py", "store.py", "summary.py"})
#: How a chapter is written; another number is another digest.
_FORMAT: Final = 2


def folder() -> Path:
    """Where chapters are kept if nothing else is asked for: the user's folder for caches."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(base) if base else Path.home() / ".cache") / "pamrs" / "reproduction"


def inputs(name: str) -> dict[str, Path]:
    """The files that a chapter depends on: of the package all but the command line, of the
    reproduction what belongs to no other chapter, and the reference of the tests.

    Parameters
    ----------
    name : str
        Of the chapter, ``"ch6"``.

    Returns
    -------
    dict of str to Path
        By what names them in the digest, in order.
    """
    found = {}
    for root in _ROOTS:
        for path in sorted(root.rglob("*")):
            part = path.relative_to(root)
            other = part.name.startswith("chapter") and not part.name.startswith(
                f"chapter{name[2:]}"
            )
            hidden = any(word.startswith((".", "__pycache__")) for word in part.parts)
            if path.is_file() and not (other or hidden or part.parts[0] in _WITHOUT):
                found[f"{root.name}/{part.as_posix()}"] = path
    return found


def digest(name: str, *, search: bool) -> str:
    """Digest of all that a chapter depends on.

    Parameters
    ----------
    name : str
        Of the chapter, ``"ch6"``.
    search : bool
        As for :func:`reproduction.section`.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    files = [f"{k} {hashlib.sha256(v.read_bytes()).hexdigest()}" for k, v in inputs(name).items()]
    versions = [f"{package} {metadata.version(package)}" for package in _PACKAGES]
    asked = [f"format {_FORMAT}", name, str(search), platform.machine(), platform.python_version()]
    return hashlib.sha256("\n".join([*files, *versions, *asked]).encode()).hexdigest()


def kept(root: Path, key: str) -> Section | None:
    """A chapter that is kept.

    Parameters
    ----------
    root : Path
        Folder of the kept chapters.
    key : str
        As :func:`digest` gives it.

    Returns
    -------
    Section or None
        None where there is none, or what is there cannot be read.
    """
    place = root / key
    try:
        told = json.loads((place / "section.json").read_text(encoding="utf-8"))
        return Section(
            title=told["title"],
            rows=[Comparison(**row) for row in told["rows"]],
            headings=told["headings"],
            in_short=told["in_short"],
            chosen=[(a, b, c) for a, b, c in told["chosen"]],
            pictures=[
                Picture(**one, png=(place / f"{one['name']}.png").read_bytes())
                for one in told["pictures"]
            ],
            symbols=[(a, b, c) for a, b, c in told["symbols"]],
            tables=told["tables"],
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None


def keep(root: Path, key: str, section: Section) -> None:
    """Keep a chapter: whole or not at all.

    Parameters
    ----------
    root : Path
        Folder of the kept chapters; made if it is not there.
    key : str
        As :func:`digest` gives it.
    section : Section
        The chapter.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    root.mkdir(parents=True, exist_ok=True)
    told: dict[str, Any] = {
        "title": section.title,
        "rows": [asdict(row) for row in section.rows],
        "headings": dict(section.headings),
        "in_short": list(section.in_short),
        "chosen": [list(one) for one in section.chosen],
        "pictures": [
            {"name": one.name, "group": one.group, "caption": one.caption}
            for one in section.pictures
        ],
        "symbols": [list(one) for one in section.symbols],
        "tables": dict(section.tables),
    }
    made = Path(tempfile.mkdtemp(dir=root, prefix=".making-"))
    try:
        for one in section.pictures:
            (made / f"{one.name}.png").write_bytes(one.png)
        (made / "section.json").write_text(json.dumps(told), encoding="utf-8")
        if (root / key).exists():  # what was there could not be read
            shutil.rmtree(root / key)
        made.rename(root / key)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise
