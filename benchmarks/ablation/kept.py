"""Diagnose read cases and keep what was decided on the way, so that the judgement can be tried
without parts of it and without new fits.

Of each case the folder gets the result (``case_0001.json``), the parts of the search that found
something (``case_0001.parts.json``), and every set of hypotheses that was weighed, without
residuals (``case_0001.pickle``). The diagnosis has no hooks for this: its functions are replaced by
ones that keep what they are given.
"""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from unittest.mock import patch

from pamrs._losses import Losses
from pamrs.diagnosis import diagnose
from pamrs.diagnosis.evidence import Candidate, Weighing, weigh
from pamrs.diagnosis.prepare import Block
from pamrs.errors import PamrsError
from pamrs.recordings import load_case
from trial.concealed import write


@dataclass(frozen=True)
class Weighed:
    """Hypotheses that were weighed against each other.

    Attributes
    ----------
    candidates : list of Candidate
        The baseline first; without residuals.
    suspects : list of Block
        Blocks by which they were compared.
    weighing : Weighing
        Prices.
    """

    candidates: list[Candidate]
    suspects: list[Block]
    weighing: Weighing


def _light(candidate: Candidate) -> Candidate:
    """A hypothesis without residuals, its likelihood worked out."""
    known = dict(candidate.likelihood())
    fit = replace(candidate.fit, residuals={})
    return replace(candidate, fit=fit, scattered=float, likelihood=partial(dict, known))


@contextmanager
def _recorded(without: str) -> Iterator[tuple[dict[tuple[str, ...], Weighed], set[str]]]:
    """What a diagnosis weighs last of each group of blocks, and the parts of it that found
    something; the parts whose name begins as `without` are left out.
    """
    weighed: dict[tuple[str, ...], Weighed] = {}
    found_by: set[str] = set()
    part = Losses.part

    def keep(
        candidates: list[Candidate], suspects: list[Block], weighing: Weighing
    ) -> dict[Any, float]:
        light = [_light(c) for c in candidates]
        weighed[tuple(b.name for b in suspects)] = Weighed(light, suspects, weighing)
        return weigh(candidates, suspects, weighing)

    def tried(
        self: Losses, what: str, work: Callable[[], Any], instead: Any = None, **how: Any
    ) -> Any:
        if without and what.startswith(without):
            return instead
        found = part(self, what, work, instead, **how)
        if found is not instead and not (isinstance(found, list) and found == instead):
            found_by.add(what)
        return found

    with (
        patch("pamrs.diagnosis.search._hypotheses.weigh", keep),
        patch.object(Losses, "part", tried),
    ):
        yield weighed, found_by


def keep_case(case: Path, out: Path, without: str = "") -> None:
    """Diagnose a case and keep its result, its weighings and the parts that found something.

    Parameters
    ----------
    case : path
        Its folder.
    out : path
        Folder for what is kept.
    without : str
        How the name of a part of the search begins that is left out; nothing by default.
    """
    with _recorded(without) as (weighed, found_by):
        try:
            result = diagnose(load_case(case)).to_json()
        except PamrsError as error:
            result = json.dumps({"schema": "", "verdict": "failed", "error": str(error)})
    out.mkdir(parents=True, exist_ok=True)
    at = out / case.name
    part = at.with_suffix(".part")
    part.write_bytes(pickle.dumps(list(weighed.values())))
    part.replace(at.with_suffix(".pickle"))
    write(at.with_suffix(".parts.json"), json.dumps(sorted(found_by)) + "\n")
    write(at.with_suffix(".json"), result)  # last: with it the case is complete


def keep_cases(
    cases: Iterable[Path],
    out: Path,
    *,
    without: str = "",
    jobs: int = 1,
    progress: Callable[[str], None] | None = None,
) -> None:
    """The same of several cases; those that are complete are not diagnosed again.

    Parameters
    ----------
    cases : iterable of path
        Their folders.
    out : path
        Folder for what is kept.
    without : str
        How the name of a part of the search begins that is left out; nothing by default.
    jobs : int
        Processes.
    progress : callable, optional
        Called with a line after each case.
    """
    missing = [case for case in cases if not (out / f"{case.name}.json").exists()]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        begun = {pool.submit(keep_case, case, out, without): case for case in missing}
        for done in as_completed(begun):
            done.result()
            if progress is not None:
                progress(f"{begun[done].name} kept")


def weighed_of(out: Path, case: str) -> Sequence[Weighed]:
    """What was weighed in a case that is kept."""
    found: list[Weighed] = pickle.loads((out / f"{case}.pickle").read_bytes())
    return found


def found_by(out: Path, case: str) -> set[str]:
    """Parts of the search that found something in a case that is kept."""
    return set(json.loads((out / f"{case}.parts.json").read_text(encoding="utf-8")))
