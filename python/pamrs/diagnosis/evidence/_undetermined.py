"""Names whose values the recordings do not determine, and hypotheses that are taken out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis
from pamrs.diagnosis.evidence._weighing import (
    fitted_sizes,
    is_near_none,
    may_be_inside,
    value_may_be_inside,
)
from pamrs.diagnosis.fit import Fit, Problem, spread_over_pieces
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import UNDECIDED, UNLISTED, Hypothesis

# stated deviations within which a size, or that a value is wrong, is not determined; a stated one
# is twice the pieces'
_DETERMINED_STDS = 1.0


def with_stated_std(
    problem: Problem, group: BlockGroup, candidate: FittedHypothesis
) -> FittedHypothesis:
    """Candidate with the standard deviations that are reported: by how much pieces of the
    recordings disagree, times ``spread_factor`` for parameters that no prior holds.
    """
    part, factor = replace(problem, blocks=group.blocks), problem.settings.spread_factor
    known = candidate.fit.held_by_prior
    std = {
        name: spread * (1.0 if name in known else factor)
        for name, spread in spread_over_pieces(part, candidate.fit).items()
    }
    return replace(candidate, fit=replace(candidate.fit, std=std))


def drop_undetermined(group: BlockGroup, problem: Problem) -> BlockGroup:
    """Halve the probability of a single effect whose size is within one standard deviation of zero,
    or of a single wrong value that may be inside its tolerances.

    The rest goes to ``unlisted``: something acts there, but not surely that. Where only noise was
    left it goes to `UNDECIDED`, and a wrong value loses all. A set needs no such step: the evidence
    of the set without the name decides.

    Parameters
    ----------
    group : BlockGroup
        Examined.
    problem : Problem
        Its recordings to fit.

    Returns
    -------
    BlockGroup
        With other probabilities; the same where every single name is determined.
    """
    settings = problem.settings
    probabilities = dict(group.probabilities)
    to = _nameless_answer(group)
    for candidate in group.candidates:
        chance = group.probabilities.get(candidate.hypothesis, 0.0)
        if len(candidate.terms) != 1 or chance < settings.in_set:
            continue
        with_std = with_stated_std(problem, group, candidate)
        inside = may_be_inside(with_std, settings.most_tolerances, _DETERMINED_STDS)
        if inside or _has_undetermined_effect(with_std):
            lost = 1.0 if candidate.wrong and to == UNDECIDED else 0.5
            probabilities[candidate.hypothesis] -= lost * chance
            probabilities[to] = probabilities.get(to, 0.0) + lost * chance
    return replace(group, probabilities=probabilities)


def is_outside(fitted: Fit, name: str, settings: DiagnosisSettings) -> bool:
    """True where a fitted value is at least one standard deviation outside its tolerances."""
    walls = settings.most_tolerances
    return not value_may_be_inside(fitted, name, walls, _DETERMINED_STDS)


def _has_undetermined_effect(candidate: FittedHypothesis) -> bool:
    """True where all fitted sizes of an effect together are within one standard deviation of zero.
    Effects with times of their own are left out: these times determine them.

    What happened at times of its own in single recordings is told by when it happened.
    """
    fitted = candidate.fit
    happened = None if fitted.events is None else fitted.events.effect
    names = list(fitted.values)
    for effect in (e for e in candidate.effects if e != happened):
        sizes = fitted_sizes(fitted, effect)
        if not sizes:
            continue
        at = [names.index(name) for name in sizes]
        values, std = np.array([(fitted.values[n], fitted.std[n]) for n in sizes]).T
        spread = fitted.covariance[np.ix_(at, at)]
        narrow = np.sqrt(np.diag(spread))
        if not (np.isfinite(std).all() and (narrow > 0.0).all()):
            if not np.isfinite(std).any():
                return True
            continue
        spread = spread * np.outer(std / narrow, std / narrow)
        distance = values @ np.linalg.pinv(spread, hermitian=True) @ values
        if is_near_none(distance, len(sizes), _DETERMINED_STDS):
            return True
    return False


def put_aside(group: BlockGroup, hypothesis: Hypothesis) -> BlockGroup:
    """Remove a hypothesis from a group, and rescale the probabilities of the others to 1; where
    none is left, all goes to ``unlisted``, or to `UNDECIDED` where only noise is left.
    """
    probabilities = {h: p for h, p in group.probabilities.items() if h != hypothesis}
    total = sum(probabilities.values())
    if total > 0.0:
        probabilities = {h: p / total for h, p in probabilities.items()}
    else:
        probabilities[_nameless_answer(group)] = 1.0
    candidates = [c for c in group.candidates if c.hypothesis != hypothesis]
    return replace(group, candidates=candidates, probabilities=probabilities)


def _nameless_answer(group: BlockGroup) -> Hypothesis:
    """Answer without a name: `UNDECIDED` where only noise is left, else `UNLISTED`."""
    return UNDECIDED if group.mismatch is None else UNLISTED
