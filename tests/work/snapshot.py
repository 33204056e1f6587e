"""Numbers of the work done, compared with a text file of this folder.

Times depend on the machine and on what else it does; evaluations and steps do not.
``make snapshots`` writes the files anew where the work has changed on purpose; the difference
belongs to the commit that changes it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

FOLDER = Path(__file__).parent


def compare(name: str, counts: Mapping[str, int], *, tolerance: float = 0.0) -> None:
    """Compare counts with those stored in ``name``.txt, or write them where ``PAMRS_SNAPSHOTS`` is
    ``write``.

    `tolerance` is the share by which a count may differ: fits go through LAPACK, whose sums depend
    on the processor, and may spend an evaluation more or less elsewhere.
    """
    file = FOLDER / f"{name}.txt"
    if os.environ.get("PAMRS_SNAPSHOTS") == "write":
        text = "".join(f"{key}: {count}\n" for key, count in counts.items())
        file.write_text(text, encoding="utf-8")
        return
    lines = file.read_text(encoding="utf-8").splitlines()
    stored = {key: int(count) for key, _, count in (line.rpartition(": ") for line in lines)}
    assert list(stored) == list(counts), (
        f"{file.name} has other lines; `make snapshots` if that is meant"
    )
    other = {
        key: f"{was} -> {counts[key]}"
        for key, was in stored.items()
        if abs(counts[key] - was) > tolerance * was
    }
    assert not other, f"other work than in {file.name}; `make snapshots` if that is meant: {other}"
