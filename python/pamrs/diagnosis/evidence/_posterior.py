"""Posterior: probabilities of hypotheses from likelihood (`_likelihood`) and prior (`_prior`).

In this order: `posterior` (hypotheses of one group of blocks; `posterior_where_noise` where the
baseline leaves only noise), `drop_undetermined`, `put_aside`, `joint_posteriors` (all groups, an
effect that acts in several being one).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis, significant
from pamrs.diagnosis.evidence._determined import (
    has_undetermined_effect,
    is_absent,
    may_be_right,
    with_stated_std,
)
from pamrs.diagnosis.evidence._prior import (
    LEAST_UNLISTED,
    MISSED_ODDS,
    SHARED_ODDS,
    UNLISTED_PRICE,
    Prior,
    is_unlikely,
    shares_of_undecided,
)
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.noise import SIZE_SPREAD
from pamrs.diagnosis.prepare import NOISE_STDS, Block
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import UNDECIDED, UNLISTED, WITHOUT_NAME, Hypothesis, Term, effect_of
from pamrs.findings import FORM_ERROR

# tempering, the share of the logarithm of evidence that counts: at least, at most, and as a
# numerator over the variance that is left, since what no model explains depends on itself
# (decision 14)
LEAST_TEMPERING, _MOST_TEMPERING, _NOISE_TEMPERING = 0.01, 0.1, 0.3
# [noise levels of bin means] error whatever is explained: these levels err (decision 14)
_LEAST_ERROR = 0.1
_STRAIN_SHARE = 0.5  # share of the priors' sum of squares that counts (decision 14)
# share of the larger by which values differ however well known, as models err: a factor of two
_ALIKE_SHARE = 0.5
# probability from which a hypothesis of one group is put with those of others, and a case lists a
# set: most products of several groups are nothing
COUNTED = 1e-4


def posterior(
    candidates: list[FittedHypothesis], compared: list[Block], prior: Prior
) -> dict[Hypothesis, float]:
    """Probabilities of the hypotheses and of ``unlisted`` (docs/decisions/0014).

    One evidence for all: how probable each hypothesis makes the recordings, tempered, times its
    odds before any data. Recordings that are held out were not fitted, and count as the others do.
    The baseline as it is competes (`UNDECIDED`: nothing is missing, or parameters inside their
    tolerances are off), and so does `UNLISTED`: physics without a name leaves as large a share of
    the mismatch as a right name does. The right name may have been fitted badly, or in a form that
    the catalogue lacks: then it leaves as much, and names share that chance by their weights, each
    as far as it takes the mismatch with values that its physics has, and leaves as little as forms
    that err leave (`_odds_of_form`). That a set was missed is less probable than that a single name
    was, by the price of its further names. A set with an effect whose size is not distinguished
    from zero names nothing.

    Parameters
    ----------
    candidates : list of FittedHypothesis
        The baseline first, then every hypothesis.
    compared : list of Block
        Blocks by which they are compared.
    prior : Prior
        Odds before any data, and the largest probability of all names together.
    """
    start = candidates[0]
    walls = prior.settings.most_tolerances
    named = [c for c in candidates if c.terms and not is_absent(c, walls)]
    tempering = _tempering([start, *named], compared)
    scores = {c.hypothesis: log_weight(c, start, compared, prior, tempering) for c in named}
    scores[UNDECIDED] = log_weight(start, start, compared, prior, tempering)
    scores[UNLISTED] = _log_weight_unlisted(start, compared, tempering)
    top = max(scores.values())
    weights = {h: math.exp(max(-60.0, score - top)) for h, score in scores.items()}
    rare = {c.hypothesis: prior.rarity(c) for c in named}
    usual = {h: scores[h] + rare[h] for h in rare}
    best = max(usual.values(), default=0.0)
    alike = {h: math.exp(max(-60.0, score - best)) for h, score in usual.items()}
    size = math.sqrt(sum(start.likelihood()[b.name].size ** 2 for b in compared))
    least = _LEAST_ERROR / max(size, _LEAST_ERROR)
    missed = MISSED_ODDS * weights[UNLISTED] / max(sum(alike.values()), 1.0)
    for candidate in named:
        key = candidate.hypothesis
        lost = rare[key] + prior.settings.name_price * (len(candidate.terms) - 1)
        form = _odds_of_form(_share_taken(candidate, start, compared), least)
        weights[key] += missed * alike[key] * form * math.exp(-lost)
    total = sum(weights.values())
    out = {h: weight / total for h, weight in weights.items()}
    for hypothesis in [h for h in out if h.terms]:
        # what no name may have falls to physics without a name
        out[UNLISTED] += (1.0 - prior.cap) * out[hypothesis]
        out[hypothesis] *= prior.cap
    return out


def _share_taken(
    candidate: FittedHypothesis, baseline: FittedHypothesis, compared: list[Block]
) -> float:
    """Share of the power of the baseline's error that a hypothesis removes, 0 to 1."""
    before, after = (
        sum(hypothesis.likelihood()[b.name].size ** 2 for b in compared)
        for hypothesis in (baseline, candidate)
    )
    return min(1.0, max(0.0, 1.0 - after / before)) if before > 0.0 else 0.0


def _odds_of_form(taken: float, least: float) -> float:
    """Odds of a missed name by the share of power that it takes: more than that share where it
    leaves an amplitude as forms of right names that err do (log-normal), of which the best name for
    other physics leaves any share, each as probable. No smaller one than `least` is known.
    """
    left = max(math.sqrt(1.0 - taken), least, FORM_ERROR * math.exp(-(SIZE_SPREAD**2)))
    far = math.log(left / FORM_ERROR) / SIZE_SPREAD
    density = math.exp(-0.5 * far**2) / (math.sqrt(2.0 * math.pi) * SIZE_SPREAD * left)
    return taken * max(1.0, density)


def _tempering(candidates: list[FittedHypothesis], compared: list[Block]) -> float:
    """Share of the log evidence that counts (a power posterior): larger, the nearer the best
    hypothesis is to noise. Noise is independent from bin to bin; what no hypothesis explains is
    not.
    """
    powers = [[c.likelihood()[block.name].power for block in compared] for c in candidates]
    least_power = min(max(powers_of, default=1.0) for powers_of in powers)
    return min(_MOST_TEMPERING, max(LEAST_TEMPERING, _NOISE_TEMPERING / max(least_power, 1e-9)))


def log_weight(
    candidate: FittedHypothesis,
    baseline: FittedHypothesis,
    compared: list[Block],
    prior: Prior,
    tempering: float,
) -> float:
    """Logarithm of a hypothesis's weight, up to a constant: the share `tempering` of its evidence
    in some blocks, less its price, its moved parameters and its rare values.
    """
    evidence = _evidence(candidate, baseline, compared, tempering) - _strain(candidate)
    samples = tempering * sum(baseline.likelihood()[block.name].count for block in compared)
    return evidence - prior.loss(candidate, samples)


def _strain(candidate: FittedHypothesis) -> float:
    """Log odds that a hypothesis loses by moved parameters and by how warm gases began."""
    return 0.5 * _STRAIN_SHARE * (candidate.fit.strain + candidate.fit.start_strain)


def _evidence(
    candidate: FittedHypothesis, baseline: FittedHypothesis, compared: list[Block], tempering: float
) -> float:
    """Tempered log evidence of a hypothesis in some blocks, at the best size of the leftover error;
    an error above a tenth of what the hypothesis explains costs more, the larger it is.
    """
    total = 0.0
    for name in (block.name for block in compared):
        now, before = candidate.likelihood()[name], baseline.likelihood()[name]
        taken = max(0.0, before.size**2 - now.size**2)
        expected = _LEAST_ERROR + FORM_ERROR * math.sqrt(taken)
        beyond = np.log(np.maximum(now.sizes, expected) / expected) / SIZE_SPREAD
        # windows that are too short for a hypothesis leave it fewer bins
        tempered = tempering * before.count / max(1, now.count) * now.by_size
        total += float((tempered - 0.5 * beyond**2).max())
    return total


def _log_weight_unlisted(
    baseline: FittedHypothesis, compared: list[Block], tempering: float
) -> float:
    """Log weight of physics without a name, as if a right name explained all."""
    total = 0.0
    for likelihood in (baseline.likelihood()[block.name] for block in compared):
        error = _LEAST_ERROR + FORM_ERROR * likelihood.size
        total += max(likelihood.log_density, likelihood.expected(error))
    return tempering * total - UNLISTED_PRICE - _strain(baseline)


def possible_gain(candidate: FittedHypothesis, compared: list[Block]) -> float:
    """Largest rise of a candidate's log weight in a search (of the least tempering) by an addition
    that leaves nothing but noise.
    """
    likelihoods = [candidate.likelihood()[block.name] for block in compared]
    return LEAST_TEMPERING * sum(
        max(0.0, likelihood.expected(0.0) - likelihood.log_density) for likelihood in likelihoods
    )


def posterior_where_noise(
    group: BlockGroup, losses: Mapping[FittedHypothesis, float]
) -> BlockGroup:
    """A group whose baseline leaves only noise, with further hypotheses and the log odds that each
    loses before any data; left out are those that leave more than noise of what was fitted, or
    predict what was held out worse than the baseline, and not to noise.
    """
    start = group.candidates[0]
    was = {name: excess.ratio for name, excess in start.held_out_excess.items()}
    scores = {
        c: _plausibility(c) - _plausibility(start) - loss
        for c, loss in losses.items()
        if not any(significant(e) for e in c.fit_excess.values())
        and all(c.held_out_excess[n].ratio <= max(c.held_out_excess[n].limit, was[n]) for n in was)
    }
    top, undecided = max(0.0, *scores.values(), 0.0), group.probabilities[UNDECIDED]
    weights = {c.hypothesis: undecided * math.exp(score - top) for c, score in scores.items()}
    before = {h: p * math.exp(-top) for h, p in group.probabilities.items()}
    total = sum(weights.values()) + sum(before.values())
    probabilities = {h: w / total for h, w in (before | weights).items()}
    return replace(group, candidates=[*group.candidates, *scores], probabilities=probabilities)


def _plausibility(candidate: FittedHypothesis) -> float:
    """Logarithm of how probable a hypothesis makes the recordings, and its own values."""
    evidence = sum(likelihood.log_density for likelihood in candidate.likelihood().values())
    return evidence - 0.5 * (candidate.fit.strain + candidate.fit.start_strain)


def drop_undetermined(group: BlockGroup, problem: Problem) -> BlockGroup:
    """Halve the probability of a single effect whose size is within one standard deviation of zero,
    or of a single wrong value that may be right.

    The rest goes to ``unlisted``: something acts there, but not surely that. Where only noise was
    left it goes to `UNDECIDED`, and sets with a wrong value that may be right are put aside. Other
    sets need no such step: the evidence of the set without the name decides.

    Returns
    -------
    BlockGroup
        With other probabilities; the same where every single name is determined.
    """
    settings, to = problem.settings, _nameless_answer(group)
    for candidate in group.candidates if to == UNDECIDED else []:
        if candidate.wrong and may_be_right(
            with_stated_std(problem, group, candidate), settings.most_tolerances
        ):
            group = put_aside(group, candidate.hypothesis)
    probabilities = dict(group.probabilities)
    for candidate in group.candidates:
        chance = group.probabilities.get(candidate.hypothesis, 0.0)
        was_asked = candidate.wrong and to == UNDECIDED
        if was_asked or len(candidate.terms) != 1 or chance < settings.in_set:
            continue
        with_std = with_stated_std(problem, group, candidate)
        if may_be_right(with_std, settings.most_tolerances) or has_undetermined_effect(with_std):
            probabilities[candidate.hypothesis] -= 0.5 * chance
            probabilities[to] = probabilities.get(to, 0.0) + 0.5 * chance
    return replace(group, probabilities=probabilities)


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


def _probabilities_alone(group: BlockGroup) -> dict[Hypothesis, float]:
    """Probabilities of one group alone, with that of `UNDECIDED` divided among other answers."""
    weights = {h: p for h, p in group.probabilities.items() if h != UNDECIDED}
    undecided = group.probabilities.get(UNDECIDED, 0.0)
    if _leaves_little(group):
        undecided += weights.pop(UNLISTED, 0.0)
    has_wrong_value = any(
        c.wrong and weights.get(c.hypothesis, 0.0) > 0.0 for c in group.candidates
    )
    only_noise = group.mismatch is None and not has_wrong_value
    shares = shares_of_undecided(
        group.unseen,
        unlikely=only_noise and is_unlikely(group.candidates[0].fit),
        nominal_misses=any(significant(e) for e in group.nominal.values()),
    )
    for hypothesis, share in shares.items():
        weights[hypothesis] = weights.get(hypothesis, 0.0) + undecided * share
    return {h: p for h, p in weights.items() if p >= COUNTED or h in WITHOUT_NAME}


def _leaves_little(group: BlockGroup) -> bool:
    """True where the refit leaves less of every block than ``unlisted`` needs."""
    start = group.candidates[0]
    every = [*start.fit_excess.values(), *start.held_out_excess.values()]
    return bool(every) and max(e.systematic for e in every) < LEAST_UNLISTED


def joint_posteriors(
    groups: Sequence[BlockGroup], settings: DiagnosisSettings
) -> list[dict[Hypothesis, float]]:
    """Probabilities of the hypotheses of each group, given those of the others.

    Groups are judged by themselves: what one keeps without a name says nothing of what another one
    has. Only an effect that acts in two groups ties them: it is one effect, so that its evidence in
    both counts together.
    """
    prior = Prior(settings.most_probability, 0.0, settings)
    alone = [_probabilities_alone(group) for group in groups]
    joint: list[dict[Hypothesis, float]] = [{} for _ in groups]
    named = [set(terms_of(weights)) for weights in alone]
    several = sorted({t for one, two in itertools.combinations(named, 2) for t in one & two})
    fitted = [{c.hypothesis: c for c in group.candidates} for group in groups]
    for choice in itertools.product(*(p.items() for p in alone)):
        effects = [term for term in terms_of(h for h, _ in choice) if term.is_effect]
        if any(one.excluded_by(effects[k + 1 :]) for k, one in enumerate(effects)):
            continue  # one effect everywhere and at a place of its own
        weight = math.prod(p for _, p in choice)
        for term in several:
            holders = [
                (group, known[hypothesis])
                for group, known, (hypothesis, _) in zip(groups, fitted, choice, strict=True)
                if term in hypothesis.terms
            ]
            weight *= _odds_shared(term, holders, prior)
        for weights, (hypothesis, _) in zip(joint, choice, strict=True):
            weights[hypothesis] = weights.get(hypothesis, 0.0) + weight
    return [normalised(_with_capped_names(weights, prior.cap)) for weights in joint]


def _with_capped_names(weights: dict[Hypothesis, float], most: float) -> dict[Hypothesis, float]:
    """Cap the weights of all names together at a share of the total; `UNLISTED` gets the rest."""
    total = sum(weights.values())
    named = sum(w for h, w in weights.items() if h.terms)
    if named <= most * total:
        return weights
    capped = {h: w * most * total / named if h.terms else w for h, w in weights.items()}
    capped[UNLISTED] += named - most * total
    return capped


def _odds_shared(
    term: Term, holders: Sequence[tuple[BlockGroup, FittedHypothesis]], prior: Prior
) -> float:
    """Odds that one name acts in several groups of blocks, against a separate cause in each.

    One cause is paid for once: the dearest price stays, the others are given back. Where the groups
    ask for different values, the odds are 1.
    """
    if len(holders) < 2 or not _same_values(term, [c for _, c in holders]):
        return 1.0
    losses = [prior.loss_by_term(c, term) for group, c in holders if group.mismatch is not None]
    again = sum(losses) - max(losses, default=0.0)
    return SHARED_ODDS ** (len(holders) - 1) * math.exp(again)


def _same_values(term: Term, candidates: Sequence[FittedHypothesis]) -> bool:
    """True where all candidates give one term values that may be the same."""

    def same(parameter: str, *both: FittedHypothesis) -> bool:
        first, second = (c.fit.values[parameter] for c in both)
        stds = (c.fit.std.get(parameter, math.inf) for c in both)
        return are_alike(first, second, math.hypot(*stds))

    return all(
        same(parameter, one, two)
        for one, two in itertools.combinations(candidates, 2)
        for parameter in one.fit.values.keys() & two.fit.values.keys()
        if parameter == term.id or effect_of(parameter) == term
    )


def are_alike(first: float, second: float, std: float) -> bool:
    """True where two values differ by at most three standard deviations, or half of the larger."""
    known = NOISE_STDS * std, _ALIKE_SHARE * max(abs(first), abs(second))
    return abs(first - second) <= max(known)


def normalised(weights: dict[Hypothesis, float]) -> dict[Hypothesis, float]:
    """Weights over their sum, the largest first."""
    total = sum(weights.values())
    return dict(sorted(((h, w / total) for h, w in weights.items()), key=lambda item: -item[1]))


def terms_of(hypotheses: Iterable[Hypothesis]) -> list[Term]:
    """Terms of hypotheses, each once, in alphabetical order."""
    return sorted({term for hypothesis in hypotheses for term in hypothesis.terms})
