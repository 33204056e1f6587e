"""Scores of several trials together: more cases in each stratum.

A trial comes from the JSON of ``python -m trial score`` or, beside others, from a compressed table
of scored cases, one JSON object a line with the name of its trial (``docs/proof/cases.jsonl.gz``).
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from .marks import BlockMark, Mark
from .summary import percent, table
from .tables import SCHEMA, SHARES, scores, share_of, tables

#: ending of a table of scored cases
CASES = ".jsonl.gz"


def pooled(files: Iterable[Path], only: str = "") -> dict[str, list[Mark]]:
    """Marks of scored trials, by the name of each trial.

    Parameters
    ----------
    files : iterable of path
        Scores as ``python -m trial score --json`` writes them, each named after its trial, and
        tables of cases (``.jsonl.gz``).
    only : str, optional
        Trials whose name begins with these letters; all by default.

    Returns
    -------
    dict of str to list of Mark

    Raises
    ------
    ValueError
        If a file has another schema, two files hold a trial of the same name, or no trial is left.
    """
    found: dict[str, list[Mark]] = {}
    for file in files:
        for name, cases in _trials(file):
            if name in found:
                raise ValueError(f"{file}: a trial of the name {name} is there already")
            if name.startswith(only):
                found[name] = [_mark(case) for case in cases]
    if not found:
        raise ValueError(
            "no scored trial was given" + (f" whose name begins {only!r}" if only else "")
        )
    return found


def _trials(file: Path) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Name and scored cases of each trial of a file."""
    if file.name.endswith(CASES):
        rows: dict[str, list[dict[str, Any]]] = {}
        for line in gzip.decompress(file.read_bytes()).decode().splitlines():
            row = json.loads(line)
            rows.setdefault(row.pop("trial"), []).append(row)
        yield from rows.items()
        return
    told = json.loads(file.read_text(encoding="utf-8"))
    if told.get("schema") != SCHEMA:
        raise ValueError(f"{file}: its schema is {told.get('schema')!r}, not {SCHEMA!r}")
    yield file.stem, told["cases"]


def table_of_cases(trials: dict[str, list[Mark]]) -> bytes:
    """Every case of every trial as one compressed table, the same bytes for the same cases."""
    rows = (
        json.dumps({"trial": name} | mark.to_dict(), separators=(",", ":"))
        for name, marks in trials.items()
        for mark in marks
    )
    return gzip.compress("".join(f"{row}\n" for row in rows).encode(), 9, mtime=0)


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
