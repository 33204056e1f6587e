"""Diagnose read cases and keep what was decided on the way, so that the judgement can be tried
without parts of it and without new fits.

Of each case the folder gets the result (``case_0001.json``), the parts of the search that found
something or tried to (``case_0001.parts.json``), and the hypotheses of each group of blocks,
without residuals (``case_0001.pickle``). The diagnosis has no hooks for this: its functions are
replaced by ones that keep what they are given. All that is kept of a trial has to come from one
state of the code.
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
from pamrs.diagnosis.evidence import BlockGroup, FittedHypothesis, Prior
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.search import Mismatch
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
    prior : Prior
        Prices.
    """

    candidates: list[FittedHypothesis]
    suspects: list[Block]
    prior: Prior


def _light(candidate: FittedHypothesis) -> FittedHypothesis:
    """A hypothesis without residuals, its likelihood worked out."""
    known = dict(candidate.likelihood())
    fit = replace(candidate.fit, residuals={})
    return replace(candidate, fit=fit, likelihood=partial(dict, known))


@contextmanager
def _recorded(without: str) -> Iterator[tuple[list[Weighed], set[str]]]:
    """What a diagnosis weighs of each group of blocks that is judged, and the parts of it that
    found something; the parts whose name begins as `without` are left out.
    """
    weighed: list[Weighed] = []
    found_by: set[str] = set()
    part, divided = Losses.part, Mismatch.groups

    def keep(self: Any, say: Callable[[str], None]) -> list[BlockGroup]:
        groups = divided(self, say)
        for group in groups:
            # of an undivided mismatch more blocks may be compared than have an excess
            compared = self.search.attempts.compared if len(groups) == 1 else group.suspects
            light = [_light(c) for c in group.candidates]
            weighed.append(Weighed(light, compared, self.search.prior))
        return groups

    def tried(
        self: Losses, what: str, work: Callable[[], Any], instead: Any = None, **how: Any
    ) -> Any:
        if without and what.startswith(without):
            return instead
        found = part(self, what, work, instead, **how)
        if found is not instead and not (isinstance(found, list) and found == instead):
            found_by.add(what)
        return found

    with patch.object(Mismatch, "groups", keep), patch.object(Losses, "part", tried):
        yield weighed, found_by


def keep_case(case: Path, out: Path, without: str = "") -> None:
    """Diagnose a case and keep its result, what was weighed and the parts that found something.

    Parameters
    ----------
    case : path
        Its folder.
    out : path
        Folder for what is kept.
    without : str
        How the name of a part of the search begins that is left out; nothing by default.
    """
    out.mkdir(parents=True, exist_ok=True)
    at = out / case.name
    with _recorded(without) as (weighed, found_by):
        try:
            result = diagnose(load_case(case)).to_json()
        except PamrsError as error:
            write(at.with_suffix(".failed"), f"{error}\n")
            return
    part = at.with_suffix(".part")
    part.write_bytes(pickle.dumps(weighed))
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
    done_before = (".json", ".failed")
    missing = [
        case for case in cases if not any((out / f"{case.name}{s}").exists() for s in done_before)
    ]
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
