"""Verdicts of the groups of blocks and of the whole case, from probabilities (`_posterior`)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis
from pamrs.diagnosis.evidence._posterior import COUNTED, joint_posteriors, normalised, terms_of
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    CATALOGUE,
    NONE,
    PARAMETERS,
    UNDECIDED,
    UNLISTED,
    WITHOUT_NAME,
    Hypothesis,
    Term,
)

_HEALTHY_HYPOTHESES = (NONE, PARAMETERS)  # hypotheses of which nothing is missing
_MOST_SETS = 8  # sets that a case lists


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
    unseen : float
        Probability that nothing is seen and an effect acts that the recordings would hardly show.
    """

    group: BlockGroup
    verdict: str
    probabilities: dict[Hypothesis, float]
    ambiguity: list[Hypothesis]
    chosen: FittedHypothesis
    unseen: float = 0.0

    @property
    def named(self) -> tuple[Term, ...]:
        """Effects that are named."""
        return names_of(self.chosen.effects) if self.verdict == "effects" else ()

    @property
    def form(self) -> FittedHypothesis | None:
        """Fitted form of what has no name: alone, or next to what is named; None without one."""
        form = self.group.closure
        may = form is not None and self.verdict in ("effects", UNLISTED.rest) and not self.wrong
        return form if form is not None and may and names_of(form.effects) == self.named else None

    @property
    def wrong(self) -> tuple[str, ...]:
        """Parameters that are named as wrong."""
        return self.chosen.wrong if self.verdict in ("effects", "parameters") else ()

    @property
    def added(self) -> tuple[Term, ...]:
        """Effects that are named, and parameters that are named as wrong."""
        return (*self.named, *map(Term, self.wrong))

    @property
    def named_alone(self) -> FittedHypothesis:
        """The names as they were fitted without a form; the baseline where there are none."""
        candidates = self.group.candidates
        return next((c for c in candidates if c.terms and c.terms == self.named), candidates[0])

    def probability(self, term: Term) -> float:
        """Probability of an effect or of a wrong parameter, whatever else acts in these blocks."""
        return min(1.0, sum(p for h, p in self.probabilities.items() if term in h.terms))


def names_of(effects: Iterable[Term]) -> tuple[Term, ...]:
    """Effects of the catalogue among some: not the forms of what has no name."""
    return tuple(effect for effect in effects if effect.id in CATALOGUE)


def judge(groups: Sequence[BlockGroup], settings: DiagnosisSettings) -> list[Judged]:
    """Verdicts of all groups, an effect that acts in several being judged once.

    Parameters
    ----------
    groups : sequence of BlockGroup
        Examined, each by itself.
    settings : DiagnosisSettings
        Odds of what is shared, probabilities from which something is named or left open.
    """
    probabilities = joint_posteriors(groups, settings)
    return [
        _with_verdict(group, own, settings)
        for group, own in zip(groups, probabilities, strict=True)
    ]


def _with_verdict(
    group: BlockGroup, probabilities: dict[Hypothesis, float], settings: DiagnosisSettings
) -> Judged:
    """A group with the verdict of its likeliest hypothesis; unlisted only if no name exceeds
    ``named``. What the recordings would hardly show is no answer by itself.
    """
    start = group.candidates[0]
    nothing = sum(probabilities.get(h, 0.0) for h in _HEALTHY_HYPOTHESES)
    unseen = min(probabilities.get(UNLISTED, 0.0), nothing * group.unseen)
    shown = probabilities | {UNLISTED: probabilities.get(UNLISTED, 0.0) - unseen}
    named = {h: p for h, p in probabilities.items() if h not in WITHOUT_NAME}
    healthy = max(_HEALTHY_HYPOTHESES, key=lambda h: probabilities.get(h, 0.0))
    without = shown[UNLISTED]
    best = max(named, key=lambda h: named[h], default=UNDECIDED)
    ambiguity = _left_open(normalised(shown), settings)
    if nothing + unseen >= max(without, named.get(best, 0.0)):
        return Judged(group, healthy.rest, probabilities, ambiguity, start, unseen)
    marginal = [sum(p for h, p in named.items() if term in h.terms) for term in terms_of(named)]
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
        terms = tuple(terms_of(h for h, _ in choice))
        answer = Hypothesis(terms, "" if terms else _rest(h for h, _ in choice) or NONE.rest)
        answers[answer] = answers.get(answer, 0.0) + math.prod(p for _, p in choice)
    return normalised({h: p for h, p in answers.items() if p >= COUNTED or h in WITHOUT_NAME})


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
        terms, rest = tuple(terms_of(choice)), _rest(choice)
        # of what has no name, only that something is missing counts next to a name
        entry = Hypothesis(terms, rest if not terms or rest == UNLISTED.rest else "")
        if entry.words and entry not in answers:
            answers.append(entry)
    return answers[:_MOST_SETS] if len(answers) > 1 else []


def _rest(hypotheses: Iterable[Hypothesis]) -> str:
    """Worst of the answers without a name; empty where no hypothesis gives one."""
    rests = {hypothesis.rest for hypothesis in hypotheses}
    return next((h.rest for h in reversed(WITHOUT_NAME) if h.rest in rests), "")
