"""Scores of several trials of the second plan together: more cases in each stratum."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..summary import percent, table
from .marks import BlockMark, Mark
from .tables import SCHEMA, SHARES, scores, share_of, tables

__all__ = ["page", "pooled"]


def pooled(files: Iterable[Path]) -> dict[str, list[Mark]]:
    """Marks of trials that were scored, by the name of each file.

    Parameters
    ----------
    files : iterable of path
        What ``python -m trial score --json`` wrote.

    Returns
    -------
    dict of str to list of Mark

    Raises
    ------
    ValueError
        If a file has another schema, or two of them have the same name.
    """
    found: dict[str, list[Mark]] = {}
    for file in files:
        told = json.loads(file.read_text(encoding="utf-8"))
        if told.get("schema") != SCHEMA:
            raise ValueError(f"{file}: its schema is {told.get('schema')!r}, not {SCHEMA!r}")
        if file.stem in found:
            raise ValueError(f"{file}: a file of the name {file.stem} is there already")
        found[file.stem] = [_mark(case) for case in told["cases"]]
    if not found:
        raise ValueError("no file of scores was given")
    return found


def _mark(told: dict[str, Any]) -> Mark:
    """A case's mark from the JSON of a score."""
    own = {f.name: told[f.name] for f in fields(Mark) if f.name in told}
    own["tags"] = {name: tuple(values) for name, values in told["tags"].items()}
    own["claims"] = tuple((float(p), bool(right)) for p, right in told["claims"])
    own["blocks"] = tuple(
        BlockMark(**(entry | {"acts": tuple(entry["acts"])})) for entry in told["blocks"]
    )
    return Mark(**own | {name: tuple(told[name]) for name in ("inside", "shares")})


def page(trials: dict[str, list[Mark]]) -> str:
    """Tables of all of them together, and a line for each."""
    return "\n".join(
        [
            tables(scores([m for marks in trials.values() for m in marks])),
            "## Each trial\n",
            "From 3 noises up, beside at most 1 % of model error; a false name over all strengths. "
            "The seeds were diagnosed by the code of their time.\n",
            _each(trials),
        ]
    )


def _each(trials: dict[str, list[Mark]]) -> str:
    names = (
        "leading name right",
        "set holds the truth",
        "wrong parameter named",
        "interval holds",
        "false name",
    )
    rows = [
        (
            stem,
            str(len(marks)),
            *(percent(*share_of(_asked(marks, name), SHARES[name])) for name in names),
        )
        for stem, marks in trials.items()
    ]
    return table(("trial", "cases", *names), rows)


def _asked(marks: Sequence[Mark], name: str) -> list[Mark]:
    """The cases of which a target asks a measure."""
    return [
        m for m in marks if "3 %" not in m.tags["model error"] and (m.seen or name == "false name")
    ]
