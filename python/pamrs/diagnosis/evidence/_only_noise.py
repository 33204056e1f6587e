"""Probabilities of hypotheses for blocks of which the baseline leaves only noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis, significant
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import UNDECIDED


def price_of_wrong(candidate: FittedHypothesis, settings: DiagnosisSettings) -> float:
    """Logarithm of what wrong values cost where the baseline explains all: a file that is further
    outside its tolerances is rarer, but less and less so.
    """
    beyond = candidate.beyond_walls(settings.most_tolerances)
    return settings.file_log_odds * len(candidate.wrong) + beyond


def weigh_only_noise(group: BlockGroup, prices: Mapping[FittedHypothesis, float]) -> BlockGroup:
    """A group whose baseline leaves only noise, with further hypotheses and the logarithm of what
    each costs; those that leave more than noise, or predict worse, are left out.
    """
    start = group.candidates[0]
    scores = {
        c: _plausibility(c) - _plausibility(start) - price
        for c, price in prices.items()
        if not any(significant(e) for e in c.fit_excess.values()) and _carries_over(c, start)
    }
    top, undecided = max(0.0, *scores.values(), 0.0), group.probabilities[UNDECIDED]
    weights = {c.hypothesis: undecided * math.exp(score - top) for c, score in scores.items()}
    before = {h: p * math.exp(-top) for h, p in group.probabilities.items()}
    total = sum(weights.values()) + sum(before.values())
    probabilities = {h: w / total for h, w in (before | weights).items()}
    return replace(group, candidates=[*group.candidates, *scores], probabilities=probabilities)


def _plausibility(candidate: FittedHypothesis) -> float:
    """Logarithm of how probable a hypothesis makes the recordings, and its own values."""
    evidence = sum(likelihood.most for likelihood in candidate.likelihood().values())
    return evidence - 0.5 * (candidate.fit.strain + candidate.fit.start_strain)


def _carries_over(candidate: FittedHypothesis, start: FittedHypothesis) -> bool:
    """True where held-out recordings are predicted as well as by the baseline, or to noise."""
    pairs = [(candidate.held_out_excess[name], was) for name, was in start.held_out_excess.items()]
    return all(now.ratio <= max(now.limit, was.ratio) for now, was in pairs)
