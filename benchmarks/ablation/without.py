"""The judgement of kept cases without each of its prices, priors and parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from benchmarks.ablation.kept import Weighed, found_by, keep_cases, weighed_of
from pamrs.diagnosis.evidence import posterior
from pamrs.effects import UNLISTED, Hypothesis
from trial.marks import Mark, covered, family, keys_of, mark, opened, result_of
from trial.summary import table

_EVIDENCE = "pamrs.diagnosis.evidence"

#: what is left out of prior and posterior: names of their modules, and what stands in their place
WEIGHTS: dict[str, dict[str, Any]] = {
    "more of the evidence counts near the noise": {"_posterior._tempering": lambda *_: 0.02},
    "forms of equations err": {"_posterior.FORM_ERROR": 1e-6},
    "a missed name leaves little": {"_posterior._odds_of_form": lambda taken, _: taken},
    "noise levels err": {"_posterior._LEAST_ERROR": 1e-6},
    "a right name may be missed": {"_posterior.MISSED_ODDS": 0.0},
    "physics without a name costs": {"_posterior.UNLISTED_PRICE": 0.0},
    "parameters have tolerances": {"_posterior._STRAIN_SHARE": 0.0},
    "names, parameters and places cost": {"_prior.Prior.price": lambda *_: 0.0},
    "values have usual ranges": {"_prior.loss_by_value": lambda *_: 0.0},
    "a time constant is seen": {"_prior._has_unseen_time": lambda *_: False},
    "a free clock drifts": {"_prior._lacks_drift": lambda *_: False},
    "an absent effect names nothing": {"_posterior.is_absent": lambda *_: False},
}
#: parts of the search that are left out, by how their names begin
PARTS = (
    "the search for effects inside the error of the model",
    "the common fit of all recordings",
    "the search for a value at the end of its range",
    "the search for wrong values",
    "the effects that are the same data as others",
    "the search for sets of names",
    "what other blocks name",
    "the division of the blocks by their names",
    "the search for other units",
)
_FLOOR = 1e-3  # least probability in a log score


@dataclass(frozen=True)
class Answer:
    """Posterior of a group of blocks, compared with what is concealed.

    Attributes
    ----------
    first, false, unlisted : bool or None
        Whether the leading name is right, nothing is there that is named, physics without a name is
        recognised; None where the question does not arise.
    log_score : float
        Logarithm of the probability of what is true.
    """

    first: bool | None
    false: bool | None
    unlisted: bool | None
    log_score: float


def _names(hypothesis: Hypothesis) -> frozenset[str]:
    return frozenset(family(str(term).partition("@")[0]) for term in hypothesis.terms)


def answer(
    probabilities: Mapping[Hypothesis, float],
    there: Collection[str],
    elsewhere: Collection[str] = (),
    *,
    odd: bool = False,
) -> Answer:
    """What probabilities say of blocks in which some names act, or physics that has none (`odd`).

    Names that act in other blocks are not false here: they may be seen through them.
    """
    sets: dict[frozenset[str], float] = {}
    for hypothesis, chance in probabilities.items():
        if hypothesis.terms:
            sets[_names(hypothesis)] = sets.get(_names(hypothesis), 0.0) + chance
    unnamed = probabilities.get(UNLISTED, 0.0)
    singles: dict[str, float] = {}
    for names, chance in sets.items():
        for name in names:
            singles[name] = singles.get(name, 0.0) + chance
    named = sum(sets.values())
    lead = max(singles, key=lambda name: singles[name], default="")
    says = bool(lead) and singles[lead] > max(unnamed, 1.0 - named - unnamed)
    if odd and not there:
        return Answer(None, None, unnamed > named, math.log(max(unnamed, _FLOOR)))
    if there:
        exact = sets.get(frozenset(there), 0.0)
        return Answer(says and lead in there, None, None, math.log(max(exact, _FLOOR)))
    return Answer(None, says and lead not in elsewhere, None, math.log(max(1.0 - named, _FLOOR)))


def _kept(folder: Path) -> list[tuple[dict[str, Any], Path]]:
    """Keys of the cases that are kept of a trial, and where."""
    kept = folder / "kept"
    keys = keys_of(folder / "keys")
    return [(key, kept) for key in keys if (kept / f"{key['case']}.json").exists()]


@dataclass(frozen=True)
class _Group:
    """What was weighed of some blocks: names that act there and in the whole rig, and whether
    physics without a name acts there.
    """

    weighed: Weighed
    there: set[str]
    anywhere: set[str]
    odd: bool

    def answer(self) -> Answer:
        """The posterior, compared with what is concealed."""
        own = self.weighed
        found = posterior(own.candidates, own.suspects, own.prior)
        return answer(found, self.there, self.anywhere, odd=self.odd)


def _groups(folder: Path) -> Iterator[_Group]:
    for key, kept in _kept(folder):
        case = str(key["case"])
        truth = opened(key)
        for own in weighed_of(kept, case):
            where = covered(b.name for b in own.suspects)
            there = {name for name, block in truth.listed if block in where}
            there |= {name for name, block in truth.wrong_block.items() if block in where}
            anywhere = truth.names.union(truth.wrong)
            yield _Group(own, there, anywhere, bool(where.intersection(truth.unlisted)))


def _count(values: Iterable[bool | None]) -> str:
    told = [v for v in values if v is not None]
    return f"{sum(told)} of {len(told)}"


def _gain(before: Sequence[float], after: Sequence[float]) -> str:
    """Mean of differences of pairs, with its standard error."""
    each = [a - b for a, b in zip(after, before, strict=True)]
    mean = sum(each) / max(1, len(each))
    spread = math.sqrt(sum((d - mean) ** 2 for d in each)) / max(1, len(each))
    return f"{mean:+.3f} ± {spread:.3f}"


def weights_table(trials: Iterable[Path]) -> str:
    """Markdown: the posterior of kept cases of trials without each of its prices and priors."""
    groups = [group for folder in trials for group in _groups(folder)]
    whole = [group.answer() for group in groups]
    rows = []
    for name, instead in {"(nothing)": {}, **WEIGHTS}.items():
        with ExitStack() as left_out:
            for own, value in instead.items():
                left_out.enter_context(patch(f"{_EVIDENCE}.{own}", value))
            told = [group.answer() for group in groups]
        rows.append(
            (
                name,
                _count(a.first for a in told),
                _count(a.false for a in told),
                _count(a.unlisted for a in told),
                _gain([a.log_score for a in whole], [a.log_score for a in told]),
            )
        )
    head = ("without", "first name", "false names", "unlisted", "log score")
    return table(head, rows)


def _brier(marks: Iterable[Mark]) -> list[float]:
    """Squared distance of stated and true, the mean of each case."""
    return [
        sum((chance - true) ** 2 for chance, true in m.claims) / len(m.claims) if m.claims else 0.0
        for m in marks
    ]


def parts_table(
    trials: Iterable[Path],
    *,
    parts: Sequence[str] = PARTS,
    jobs: int = 1,
    progress: Callable[[str], None] | None = None,
) -> str:
    """Markdown: the search without each of its parts, on kept cases in which it found something.

    Parameters
    ----------
    trials : sequence of path
        Folders of trials; ``kept`` of each gets a folder for each part.
    parts : sequence of str
        How the names of the parts begin.
    jobs : int
        Processes.
    progress : callable, optional
        Called with a line after each case.
    """
    rows = []
    folders = list(trials)
    for part in parts:
        before: list[Mark] = []
        after: list[Mark] = []
        for folder in folders:
            concerned = [
                (key, kept)
                for key, kept in _kept(folder)
                if any(what.startswith(part) for what in found_by(kept, str(key["case"])))
            ]
            out = folder / "kept" / part.replace(" ", "_")
            cases = [folder / "cases" / str(key["case"]) for key, _ in concerned]
            keep_cases(cases, out, without=part, jobs=jobs, progress=progress)
            for key, kept in concerned:
                before.append(mark(key, result_of(kept, str(key["case"]))))
                after.append(mark(key, result_of(out, str(key["case"]))))
        rows.append((part, str(len(before)), *_both(before, after)))
    return table(_HEAD, rows)


_ASKED = ("leading", "holds", "wrong", "false_name", "unlisted")
_HEAD = (
    *("without", "cases", "first name", "set", "wrong value", "false names", "unlisted"),
    *("Brier", "seconds"),
)


def _both(before: Sequence[Mark], after: Sequence[Mark]) -> Iterator[str]:
    """What is right with a part and without it."""
    for name in _ASKED:
        was = _count(getattr(m, name) for m in before)
        now = _count(getattr(m, name) for m in after)
        yield f"{was.split()[0]}, {now}"
    yield _gain(_brier(before), _brier(after))
    seconds = [sum(m.seconds or 0.0 for m in marks) for marks in (before, after)]
    yield f"{seconds[0]:.0f}, {seconds[1]:.0f}"
