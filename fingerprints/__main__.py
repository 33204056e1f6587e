"""``python -m fingerprints OUT`` writes the pages and the pictures to a folder (``make effects``:
to docs/effects).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from fingerprints.pages import pages
from fingerprints.sheet import picture
from fingerprints.table import EXPERIMENTS


def main() -> None:
    """Write what the command line asks for."""
    parser = argparse.ArgumentParser(
        description=(
            "Pages of the catalogue of effects, and their fingerprints as the simulator draws them."
        )
    )
    parser.add_argument("out", type=Path, help="folder for the pages and the pictures")
    parser.add_argument(
        "--only",
        metavar="ID",
        choices=sorted(EXPERIMENTS),
        help="draw the picture of one effect only",
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (given.out / name).write_text(text, encoding="utf-8")
    for effect, experiment in EXPERIMENTS.items():
        if given.only in (None, effect):
            (given.out / f"{effect}.png").write_bytes(picture(experiment))
    print(f"written: {given.out}")


if __name__ == "__main__":
    main()
