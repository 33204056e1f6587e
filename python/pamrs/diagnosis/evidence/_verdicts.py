"""Verdicts of the groups of blocks, each given those of the others, and of the whole case.

Groups of blocks are judged by themselves: what one keeps without a name says nothing of what
another one has. Only an effect that acts in two groups ties them: it is one effect, so that its
evidence in both counts together.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from scipy.stats import chi2

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis, significant
from pamrs.diagnosis.evidence._weighing import price_of_term
from pamrs.diagnosis.fit import Fit
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    NONE,
    PARAMETERS,
    UNDECIDED,
    UNLISTED,
    WITHOUT_NAME,
    Hypothesis,
    Term,
    effect_of,
)

_HEALTHY_HYPOTHESES = (NONE, PARAMETERS)  # hypotheses of which nothing is missing
# odds of one effect that acts in two groups of blocks to two effects (decision 4)
SHARED_ODDS = 6.0
_ALIKE_STDS = 3.0  # [standard deviations] by which the values of one name in two groups may differ
# share of the larger by which values differ however well known, as models err: a factor of two
_ALIKE_SHARE = 0.5
# probability from which a case lists a set: most products of several blocks are nothing
_LISTED = 1e-4
_COUNTED = 1e-6  # probability from which a hypothesis of one group is put beside those of others
_MOST_SETS = 8  # sets that a case lists
# `UNDECIDED` of a group of which only noise is left is divided by these numbers (decision 4):
# most of it goes to parameters where these moved, else to none
_QUIET_LIKELY = 0.83
# of none where parameters moved, of parameters where they did not
_QUIET_OTHER = 0.03
# of unlisted: in 24 of 171 such groups physics was missing that was too small to be seen
_QUIET_UNLISTED = 0.14
# of parameters where their values are unlikely: these explain all, at a price the owner would mind
_STRAINED_PARAMETERS = 0.75
_STRAINED_UNLISTED = 0.25  # of unlisted there
# [tolerances] moved to its wall (fit.most_tolerances), which is suspect (decision 25)
WALL_TOLERANCES = 2.9
# [noise levels] left in a group below which nothing has no name: both such groups of 40 read cases
# lacked nothing (decision 4)
_LEAST_UNLISTED = 0.5
_UNLIKELY = 0.01  # chance of a baseline below which its values count against it


@dataclass(frozen=True, eq=False)
class Judged:
    """A group of blocks with its verdict.

    Attributes
    ----------
    group : BlockGroup
        The blocks, and everything found out about them.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``.
    probabilities : dict of Hypothesis to float
        The most probable first.
    ambiguity : list of Hypothesis
        Those that are left open; empty when settled.
    chosen : FittedHypothesis
        The hypothesis that is named; the baseline where none is.
    """

    group: BlockGroup
    verdict: str
    probabilities: dict[Hypothesis, float]
    ambiguity: list[Hypothesis]
    chosen: FittedHypothesis

    @property
    def named(self) -> tuple[Term, ...]:
        """Effects that are named."""
        return self.chosen.effects if self.verdict == "effects" else ()

    @property
    def wrong(self) -> tuple[str, ...]:
        """Parameters that are named as wrong."""
        return self.chosen.wrong if self.verdict in ("effects", "parameters") else ()

    @property
    def added(self) -> tuple[Term, ...]:
        """Effects that are named, and parameters that are named as wrong."""
        return (*self.named, *map(Term, self.wrong))

    def probability(self, term: Term) -> float:
        """Probability of an effect or of a wrong parameter, whatever else acts in these blocks."""
        return min(1.0, sum(p for h, p in self.probabilities.items() if term in h.terms))


def parameters_at_wall(fit: Fit) -> dict[str, float]:
    """Parameters that a fit moved to their wall, and how far [tolerances]."""
    return {name: far for name, far in fit.moved.items() if abs(far) >= WALL_TOLERANCES}


def _probabilities_alone(group: BlockGroup) -> dict[Hypothesis, float]:
    """Probabilities of one group alone, with that of `UNDECIDED` divided among other answers."""
    weights = {h: p for h, p in group.probabilities.items() if h != UNDECIDED}
    undecided = group.probabilities.get(UNDECIDED, 0.0)
    if _leaves_little(group):
        undecided += weights.pop(UNLISTED, 0.0)
    nominal_misses = any(significant(e) for e in group.nominal.values())
    has_wrong_value = any(
        c.wrong and weights.get(c.hypothesis, 0.0) > 0.0 for c in group.candidates
    )
    quiet = {PARAMETERS: _QUIET_LIKELY, NONE: _QUIET_OTHER, UNLISTED: _QUIET_UNLISTED}
    unlikely = is_unlikely(group.candidates[0].fit)
    if unlikely and group.mismatch is None and not has_wrong_value:
        quiet = {PARAMETERS: _STRAINED_PARAMETERS, UNLISTED: _STRAINED_UNLISTED}
    elif not nominal_misses:
        quiet |= {NONE: _QUIET_LIKELY, PARAMETERS: _QUIET_OTHER}
    for hypothesis, share in quiet.items():
        weights[hypothesis] = weights.get(hypothesis, 0.0) + undecided * share
    return {h: p for h, p in weights.items() if p >= _COUNTED or h in WITHOUT_NAME}


def _leaves_little(group: BlockGroup) -> bool:
    """True where the refit leaves less of every block than ``unlisted`` needs."""
    start = group.candidates[0]
    every = [*start.fit_excess.values(), *start.held_out_excess.values()]
    return bool(every) and max(e.systematic for e in every) < _LEAST_UNLISTED


def is_unlikely(fit: Fit) -> bool:
    """True where a value is at its wall, or values inside their tolerances and starts of gases lie
    further from what is known of them, together, than one in a hundred draws of them.
    """
    if parameters_at_wall(fit):
        return True
    moved = sum(abs(far) > 0.0 for far in fit.held_by_prior.values())
    starts = sum(residual.strain > 0.0 for residual in fit.residuals.values())
    return bool(chi2.sf(fit.strain + fit.start_strain, max(1, moved + starts)) < _UNLIKELY)


def judge(groups: Sequence[BlockGroup], settings: DiagnosisSettings) -> list[Judged]:
    """Verdicts of all groups, an effect that acts in several being judged once.

    Parameters
    ----------
    groups : sequence of BlockGroup
        Examined, each by itself.
    settings : DiagnosisSettings
        Odds of what is shared, probabilities from which something is named or left open.
    """
    alone = [_probabilities_alone(group) for group in groups]
    joint: list[dict[Hypothesis, float]] = [{} for _ in groups]
    several = _in_several(alone)
    fitted = [{c.hypothesis: c for c in group.candidates} for group in groups]
    for choice in itertools.product(*(p.items() for p in alone)):
        if not _possible_together(_terms(h for h, _ in choice)):
            continue  # one effect everywhere and at a place of its own
        weight = math.prod(p for _, p in choice)
        for term in several:
            holders = [
                (group, known[hypothesis])
                for group, known, (hypothesis, _) in zip(groups, fitted, choice, strict=True)
                if term in hypothesis.terms
            ]
            weight *= _odds_shared(term, holders, settings)
        for weights, (hypothesis, _) in zip(joint, choice, strict=True):
            weights[hypothesis] = weights.get(hypothesis, 0.0) + weight
    return [
        _with_verdict(
            group, _normalised(_with_capped_names(weights, settings.most_probability)), settings
        )
        for group, weights in zip(groups, joint, strict=True)
    ]


def _with_capped_names(weights: dict[Hypothesis, float], most: float) -> dict[Hypothesis, float]:
    """Cap the weights of all names together at a share of the total; `UNLISTED` gets the rest."""
    total = sum(weights.values())
    named = sum(w for h, w in weights.items() if h.terms)
    if named <= most * total:
        return weights
    capped = {h: w * most * total / named if h.terms else w for h, w in weights.items()}
    capped[UNLISTED] += named - most * total
    return capped


def _in_several(alone: Sequence[Mapping[Hypothesis, float]]) -> list[Term]:
    """Terms that hypotheses of several groups have."""
    named = [set(_terms(weights)) for weights in alone]
    return sorted({term for one, two in itertools.combinations(named, 2) for term in one & two})


def _odds_shared(
    term: Term, holders: Sequence[tuple[BlockGroup, FittedHypothesis]], settings: DiagnosisSettings
) -> float:
    """Odds that one name acts in several groups of blocks, against a separate cause in each.

    One cause is paid for once: the dearest price stays, the others are given back. Where the groups
    ask for different values, the odds are 1.
    """
    if len(holders) < 2 or not _same_values(term, [c for _, c in holders]):
        return 1.0
    prices = [
        price_of_term(c, term, settings) for group, c in holders if group.mismatch is not None
    ]
    again = sum(prices) - max(prices, default=0.0)
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
    known = _ALIKE_STDS * std, _ALIKE_SHARE * max(abs(first), abs(second))
    return abs(first - second) <= max(known)


def _possible_together(terms: Sequence[Term]) -> bool:
    """True where no effect among the terms of several groups excludes another."""
    effects = [term for term in terms if term.is_effect]
    return not any(one.excluded_by(effects[k + 1 :]) for k, one in enumerate(effects))


def _normalised(weights: dict[Hypothesis, float]) -> dict[Hypothesis, float]:
    total = sum(weights.values())
    return dict(sorted(((h, w / total) for h, w in weights.items()), key=lambda item: -item[1]))


def _with_verdict(
    group: BlockGroup, probabilities: dict[Hypothesis, float], settings: DiagnosisSettings
) -> Judged:
    """A group with the verdict of its likeliest hypothesis; unlisted only if no name exceeds
    ``named``.
    """
    start = group.candidates[0]
    named = {h: p for h, p in probabilities.items() if h not in WITHOUT_NAME}
    healthy = max(_HEALTHY_HYPOTHESES, key=lambda h: probabilities.get(h, 0.0))
    without = probabilities.get(UNLISTED, 0.0)
    best = max(named, key=lambda h: named[h], default=UNDECIDED)
    ambiguity = _left_open(probabilities, settings)
    if probabilities.get(healthy, 0.0) >= max(without, named.get(best, 0.0)):
        return Judged(group, healthy.rest, probabilities, ambiguity, start)
    marginal = [sum(p for h, p in named.items() if term in h.terms) for term in _terms(named)]
    if named.get(best, 0.0) <= without and max(marginal, default=0.0) <= settings.named:
        return Judged(group, UNLISTED.rest, probabilities, ambiguity, start)
    chosen = next(c for c in group.candidates if c.hypothesis == best)
    return Judged(
        group, "effects" if chosen.effects else "parameters", probabilities, ambiguity, chosen
    )


def _left_open(
    probabilities: dict[Hypothesis, float], settings: DiagnosisSettings
) -> list[Hypothesis]:
    """Hypotheses that are left open, the most probable first; none where one is settled, `NONE` and
    `PARAMETERS` being one answer.
    """
    healthy = sum(probabilities.get(h, 0.0) for h in _HEALTHY_HYPOTHESES)
    others = [p for h, p in probabilities.items() if h not in _HEALTHY_HYPOTHESES]
    if max(healthy, *others, 0.0) > settings.settled:
        return []
    open_ones = [
        Hypothesis(tuple(sorted(h.terms)), h.rest)
        for h, p in probabilities.items()
        if p >= settings.in_set
    ]
    return open_ones if len(open_ones) > 1 else []


def case_probabilities(judged: Sequence[Judged]) -> dict[Hypothesis, float]:
    """Probabilities of the possible answers for a case: the terms of all its blocks together.

    `UNLISTED` is that something is missing and nothing has a name. What one block keeps without a
    name takes nothing from a name in another.
    """
    answers = dict.fromkeys(WITHOUT_NAME, 0.0)
    for choice in itertools.product(*(j.probabilities.items() for j in judged)):
        terms = tuple(_terms(h for h, _ in choice))
        answer = Hypothesis(terms, "" if terms else _rest(h for h, _ in choice) or NONE.rest)
        answers[answer] = answers.get(answer, 0.0) + math.prod(p for _, p in choice)
    return _normalised({h: p for h, p in answers.items() if p >= _LISTED or h in WITHOUT_NAME})


def case_ambiguity(judged: Sequence[Judged]) -> list[Hypothesis]:
    """Hypotheses that a case leaves open: those of its blocks, each with what is settled in the
    others.
    """
    if not any(j.ambiguity for j in judged):
        return []
    # what a block is settled to keep without a name is no part of the question
    options = [j.ambiguity or [Hypothesis(j.added)] for j in judged]
    answers: list[Hypothesis] = []
    for choice in itertools.product(*options):
        terms, rest = tuple(_terms(choice)), _rest(choice)
        # of what has no name, only that something is missing counts beside a name
        entry = Hypothesis(terms, rest if not terms or rest == UNLISTED.rest else "")
        if entry.words and entry not in answers:
            answers.append(entry)
    return answers[:_MOST_SETS] if len(answers) > 1 else []


def _terms(hypotheses: Iterable[Hypothesis]) -> list[Term]:
    """Terms of hypotheses, each once, in alphabetical order."""
    return sorted({term for hypothesis in hypotheses for term in hypothesis.terms})


def _rest(hypotheses: Iterable[Hypothesis]) -> str:
    """Worst of the answers without a name; empty where no hypothesis gives one."""
    rests = {hypothesis.rest for hypothesis in hypotheses}
    return next((h.rest for h in reversed(WITHOUT_NAME) if h.rest in rests), "")
