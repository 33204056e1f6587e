"""Chapters that were reproduced before, kept by all that they depend on.

A chapter is kept in a folder of its own under the digest of the package's files, the core, the
versions of what it calculates and draws with, and what was asked for. A file that changes gives
another digest; nothing is ever taken for something else, and nothing has to be thrown away by hand.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import platform
import shutil
import tempfile
from dataclasses import asdict
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from pamrs.comparison import Comparison
from pamrs.reproduce.page import Picture, Section

__all__ = ["digest", "folder", "inputs", "keep", "kept"]

#: Folder of the package.
_ROOT: Final = Path(__file__).parents[1]
#: What is calculated and drawn with, besides the package.
_PACKAGES: Final = ("numpy", "scipy", "matplotlib", "Pillow", "deap", "cma")
#: Parts of the package that no number and no picture of a chapter depends on.
_WITHOUT: Final = ("cli", "reproduce", "_moved.py", "__main__.py")
#: Files of this package that only arrange what the chapters give.
_ARRANGING: Final = frozenset({"__init__", "_store", "page", "summary"})
#: How a chapter is written; another number is another digest.
_FORMAT: Final = 1


def folder() -> Path:
    """Where chapters are kept if nothing else is asked for: the user's folder for caches."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(base) if base else Path.home() / ".cache") / "pamrs" / "reproduce"


def inputs(module: str) -> list[Path]:
    """The files that a chapter depends on: of the package all but the command line, of this one
    what the chapter's module and its pictures import, and the symbols.

    Parameters
    ----------
    module : str
        Of the chapter, ``"_chapter6"``.

    Returns
    -------
    list of Path
        In order.
    """
    rest = [path for path in _files(_ROOT) if path.relative_to(_ROOT).parts[0] not in _WITHOUT]
    own = _imported(_ROOT / "reproduce", (module, f"{module}_figures", "_symbols"))
    return sorted([*rest, *own])


def _files(root: Path) -> list[Path]:
    return [
        path
        for path in root.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and not path.name.startswith(".")
    ]


def _imported(root: Path, modules: tuple[str, ...]) -> set[Path]:
    """Files of this package that modules of it import, directly or not."""
    found: set[Path] = set()
    waiting = list(modules)
    while waiting:
        path = root / f"{waiting.pop()}.py"
        if path in found or not path.is_file() or path.stem in _ARRANGING:
            continue
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(
                "pamrs.reproduce"
            ):
                names = (node.module or "").split(".")[2:] or [a.name for a in node.names]
                waiting.extend(names)
            elif isinstance(node, ast.Import):
                waiting.extend(
                    alias.name.split(".")[2]
                    for alias in node.names
                    if alias.name.startswith("pamrs.reproduce.")
                )
    return found


@cache
def _hashed(path: Path, size: int, changed: int) -> str:
    """Digest of a file; size and time of change are those that it was asked for with."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def digest(name: str, module: str, *, search: bool) -> str:
    """Digest of all that a chapter depends on.

    Parameters
    ----------
    name, module : str
        Of the chapter: ``"ch6"``, ``"_chapter6"``.
    search : bool
        As for :func:`pamrs.reproduce.section`.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    found = hashlib.sha256()
    for path in inputs(module):
        state = path.stat()
        content = _hashed(path, state.st_size, state.st_mtime_ns)
        found.update(f"{path.relative_to(_ROOT).as_posix()} {content}\n".encode())
    versions = [f"{package} {_version(package)}" for package in _PACKAGES]
    asked = [f"format {_FORMAT}", name, str(search), platform.machine(), platform.python_version()]
    found.update("\n".join([*versions, *asked]).encode())
    return found.hexdigest()


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "none"


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
