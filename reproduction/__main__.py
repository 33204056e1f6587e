"""``python -m reproduction OUT`` writes a page, pictures and a table of each chapter to a folder,
and a page of all statements (``make reproduce``: to docs/reproduction).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from reproduction import CHAPTERS, every, store
from reproduction.comparison import verdicts
from reproduction.page import Section, page
from reproduction.statement_tables import to_csv
from reproduction.summary import summary


def write(out: Path, sections: Mapping[str, Section], command: str) -> None:
    """Write the pages, the pictures and the tables of chapters to a folder; the page of all
    statements where all chapters are there.

    Parameters
    ----------
    out : Path
        The folder; made if it is not there.
    sections : mapping of str to Section
        By chapter.
    command : str
        What makes the pages, shown on top of each.
    """
    for name, section in sections.items():
        folder = out / CHAPTERS[name]
        folder.mkdir(parents=True, exist_ok=True)
        text = page([section], command, folder.name)
        (out / f"{folder.name}.md").write_text(text, encoding="utf-8")
        (folder / "facts.csv").write_text(to_csv(section.rows), encoding="utf-8")
        for picture in section.pictures:
            (folder / f"{picture.name}.png").write_bytes(picture.png)
    if len(sections) == len(CHAPTERS):
        (out / "README.md").write_text(summary(sections, command), encoding="utf-8")


def main(words: Sequence[str] | None = None) -> None:
    """Make what the command line asks for."""
    parser = argparse.ArgumentParser(
        prog="python -m reproduction",
        description="The 2014 dissertation beside pamrs: every statement with a verdict.",
    )
    parser.add_argument("out", type=Path, help="folder for the pages")
    parser.add_argument(
        "--only", choices=CHAPTERS, metavar="CHAPTER", help="one chapter: " + ", ".join(CHAPTERS)
    )
    parser.add_argument(
        "--no-search", action="store_true", help="without what takes minutes; other numbers"
    )
    parser.add_argument(
        "--cache", type=Path, default=store.folder(), help="folder in which chapters are kept"
    )
    given = parser.parse_args(words)
    chapters = list(CHAPTERS) if given.only is None else [given.only]
    try:
        sections = every(chapters, given.cache, search=not given.no_search)
    except KeyboardInterrupt:
        sys.exit("stopped: what was finished is kept, the same command goes on")
    write(given.out, sections, "make reproduce" + " without searches" * given.no_search)
    for section in sections.values():
        print(f"{section.title}: {verdicts(list(section.rows))}")


if __name__ == "__main__":
    main()
