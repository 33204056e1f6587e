"""Names whose values the recordings do not determine, and names that are put aside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from pamrs.diagnosis.evidence._candidates import BlockGroup, Candidate
from pamrs.diagnosis.evidence._weighing import may_be_inside
from pamrs.diagnosis.fit import Problem, form_in, spread_over_pieces
from pamrs.effects import UNDECIDED, UNLISTED, Hypothesis, Term

# stated deviations within which a size, or that a value is wrong, is not determined; a stated one
# is twice the pieces'
_DETERMINED_STDS = 1.0


def with_stated_std(problem: Problem, group: BlockGroup, candidate: Candidate) -> Candidate:
    """A fit with standard deviations that hold for residuals that are no noise; and, of what no
    prior holds, for equations that are not quite the rig's.
    """
    own, factor = replace(problem, blocks=group.blocks), problem.settings.spread_factor
    known = candidate.fit.held_by_prior
    std = {
        name: spread * (1.0 if name in known else factor)
        for name, spread in spread_over_pieces(own, candidate.fit).items()
    }
    return replace(candidate, fit=replace(candidate.fit, std=std))


def drop_undetermined(group: BlockGroup, problem: Problem) -> BlockGroup:
    """A group in which a name alone, whose values are not told from none (a wrong value: from one
    inside its tolerances) by the standard deviations that are stated, has half of its probability;
    a wrong value has none where no more than noise was left.

    The rest falls to ``unlisted``: something acts there, and which effect was not told (to nothing,
    where no more than noise was left). Whether a set needs such a name is told by the evidence of
    the set without it.

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
    found = dict(group.probabilities)
    to = _without_name(group)
    for candidate in group.candidates:
        chance = group.probabilities.get(candidate.hypothesis, 0.0)
        if len(candidate.terms) != 1 or chance < settings.in_set:
            continue
        stated = with_stated_std(problem, group, candidate)
        inside = may_be_inside(stated, settings.most_tolerances, _DETERMINED_STDS)
        if inside or undetermined_effects(stated):
            lost = 1.0 if candidate.wrong and to == UNDECIDED else 0.5
            found[candidate.hypothesis] -= lost * chance
            found[to] = found.get(to, 0.0) + lost * chance
    return replace(group, probabilities=found)


def undetermined_effects(candidate: Candidate) -> list[Term]:
    """Effects of a set whose sizes, all together, are not told from none by its standard
    deviations: with their shapes as uncertain as they are.

    What happened at times of its own in single recordings is told by when it happened.
    """
    found = candidate.fit
    happened = None if found.events is None else found.events.effect
    names, sealed = list(found.scales), found.rig.model["valve"] is None
    out = []
    for effect in (e for e in candidate.effects if e != happened):
        form = effect.info.form(form_in(found.rig, effect))
        sizes = [
            f"{effect}.{p.name}"
            for p in form.parameters
            if p.role_in(sealed=sealed) == "size" and p.neutral == 0.0
        ]
        at = [names.index(name) for name in sizes if name in names]
        if not at:
            continue
        own = np.array([found.values[names[k]] for k in at])
        std = np.array([found.std[names[k]] for k in at])
        spread = found.covariance[np.ix_(at, at)]
        narrow = np.sqrt(np.diag(spread))
        if not (np.isfinite(std).all() and (narrow > 0.0).all()):
            out += [effect] * (not np.isfinite(std).any())
            continue
        spread = spread * np.outer(std / narrow, std / narrow)
        distance = own @ np.linalg.pinv(spread, hermitian=True) @ own
        if chi2.sf(distance, len(at)) > chi2.sf(_DETERMINED_STDS**2, 1):
            out.append(effect)
    return out


def put_aside(group: BlockGroup, hypothesis: Hypothesis) -> BlockGroup:
    """A group without one of its hypotheses: the others are as probable as they are where it is
    known not to hold; ``unlisted`` where there is none, and nothing where no more than noise was
    left.
    """
    found = {h: p for h, p in group.probabilities.items() if h != hypothesis}
    total = sum(found.values())
    if total > 0.0:
        found = {h: p / total for h, p in found.items()}
    else:
        found[_without_name(group)] = 1.0
    kept = [c for c in group.candidates if c.hypothesis != hypothesis]
    return replace(group, candidates=kept, probabilities=found)


def _without_name(group: BlockGroup) -> Hypothesis:
    """What is left of a name that does not hold: a signature below the noise is nothing then."""
    return UNDECIDED if group.below_noise or group.mismatch is None else UNLISTED
