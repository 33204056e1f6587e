"""Count failed searches: insert the truth where a diagnosis missed it, and see what it would have
said.

A diagnosis that names something else, or nothing, has either not found the true hypothesis (the
search failed), or found it and weighed it too little, or has no equation that is like the truth.
``pamrs diagnose --consider`` fits the true names from every start and judges them with what the
search found by itself; like `python -m trial prove` it runs in a process of its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .families import UNLISTED
from .marks import keys_of, mark, result_of
from .pair.places import SIDES

#: what a missed case failed by
SEARCH, WEIGHT, FORM, QUIET = "search", "weight", "form", "quiet"
UNFIT, FAILED = "unfit", "failed"
WORDS = {
    SEARCH: "the truth was not found: inserted, it leads",
    WEIGHT: "the truth explains half or more, and something else leads",
    FORM: "the truth, as the catalogue has it, leaves more than half",
    QUIET: "no mismatch is left where the truth acts",
    UNFIT: "the truth was not fitted: a parameter of it stays inside its tolerances, or it would "
    "happen beside another event",
    FAILED: "the diagnosis with the truth inserted ended with an error",
}


@dataclass(frozen=True)
class Inserted:
    """A missed case with the truth inserted.

    Attributes
    ----------
    case : str
        Its name.
    truth : str
        What was inserted, names joined by ``+``.
    said, then : str
        What the diagnosis names without and with it.
    failed : str
        ``search``, ``weight``, ``form``, ``quiet``, ``unfit`` or ``failed``.
    left, probability : float or None
        Share of the mismatch that the truth leaves, and its probability, where it was fitted.
    """

    case: str
    truth: str
    said: str
    then: str
    failed: str
    left: float | None
    probability: float | None


def missed(keys: Path, results: Path) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Keys and results of the cases whose leading name, or whose wrong parameter, was missed."""
    for key in keys_of(keys):
        result = result_of(results, str(key["case"]))
        if result is None:
            continue
        told = mark(key, result)
        if told.leading is False or told.wrong is False:
            yield key, result


def truth_of(key: dict[str, Any]) -> str:
    """Names of a key that a diagnosis may say, joined by ``+``."""
    listed = [
        f"{e['id']}@{e['at']}" if e.get("at") in SIDES else str(e["id"])
        for e in key["effects"]
        if e["mark"] != UNLISTED
    ]
    return "+".join(dict.fromkeys([*listed, *key["wrong_parameters"]]))


def _named(result: dict[str, Any]) -> str:
    """What a result names."""
    names = [str(e["id"]) for e in result["effects"]] if result["verdict"] == "effects" else []
    wrong = [f"wrong {w['name']}" for w in result["wrong_parameters"]]
    return ", ".join([*names, *wrong]) or str(result["verdict"])


def diagnosed(case: Path, suspicion: str) -> dict[str, Any]:
    """What a diagnosis says that judges a suspicion as well.

    Raises
    ------
    ValueError
        If the case cannot be diagnosed; says why.
    """
    with tempfile.TemporaryDirectory() as home:
        out = Path(home) / "out.json"
        words = [str(case), "--consider", suspicion, "--json", str(out)]
        done = subprocess.run(
            [sys.executable, "-m", "pamrs", "diagnose", *words],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise ValueError(f"{case}: {done.stderr.strip() or done.returncode}")
        found: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
        return found


def inserted(key: dict[str, Any], result: dict[str, Any], case: Path) -> Inserted:
    """Diagnose a missed case again with its truth inserted.

    Parameters
    ----------
    key, result : dict
        The opened key, and what was said without it.
    case : path
        Folder of the case.
    """
    truth, said = truth_of(key), _named(result)
    try:
        again = diagnosed(case, truth)
    except ValueError as error:
        return Inserted(str(key["case"]), truth, said, str(error), FAILED, None, None)
    now = mark(key, again)
    considered = [entry for entry in again.get("considered", []) if entry["blocks"]]
    fitted = [entry for entry in considered if entry["left"] is not None]
    # of several groups of blocks the one in which the truth explains least
    worst = max(fitted, key=lambda entry: float(entry["left"]), default=None)
    if not considered:
        failed = QUIET
    elif now.leading is not False and now.wrong is not False:
        failed = SEARCH
    elif worst is None:
        failed = UNFIT
    else:
        failed = WEIGHT if float(worst["left"]) < 0.5 else FORM
    return Inserted(
        str(key["case"]),
        truth,
        said,
        _named(again),
        failed,
        None if worst is None else worst["left"],
        None if worst is None else worst["probability"],
    )


def all_inserted(
    folder: Path, results: Path, progress: Callable[[str], None] | None = None
) -> list[Inserted]:
    """Every missed case of a trial, its truth inserted.

    Parameters
    ----------
    folder : path
        The trial: ``cases``, ``keys``.
    results : path
        Results of ``python -m trial prove``.
    progress : callable, optional
        Called with a line after each case.
    """
    found = []
    for key, result in missed(folder / "keys", results):
        own = inserted(key, result, folder / "cases" / str(key["case"]))
        found.append(own)
        if progress is not None:
            progress(f"{own.case}: {own.truth}: {own.failed}")
    return found


def table(found: list[Inserted]) -> str:
    """Markdown of missed cases."""
    counts = Counter(own.failed for own in found)
    lines = [
        "# Missed cases, the truth inserted\n",
        "| failed | cases | |",
        "|---|---|---|",
        *(f"| {kind} | {counts[kind]} | {words} |" for kind, words in WORDS.items()),
        "",
        "| case | truth | said | with the truth inserted | it leaves | its probability | failed |",
        "|---|---|---|---|---|---|---|",
    ]
    for own in found:
        left = "-" if own.left is None else f"{100.0 * own.left:.2g} %"
        chance = "-" if own.probability is None else f"{own.probability:.2f}"
        lines.append(
            f"| {own.case} | {own.truth} | {own.said} | {own.then} | {left} | {chance} "
            f"| {own.failed} |"
        )
    return "\n".join(lines) + "\n"
