"""Of what several groups of blocks fitted: whose value the model has."""

from __future__ import annotations

import math

from pamrs.diagnosis.evidence import Candidate
from pamrs.effects import Term, effect_of, find_parameter


def owners_of_parameters(candidates: list[Candidate]) -> dict[str, int]:
    """The group that tells most of each parameter that several have (sensors' zeros): the one with
    the least standard deviation.

    What a group leaves without a name is in its autocorrelation, and so in its standard deviations.
    Events are fitted with the values beside them, which stay.
    """

    def spread(k: int, name: str) -> float:
        own = candidates[k].fit
        return own.std.get(name, math.inf) if own.events is None else 0.0

    found: dict[str, int] = {}
    for k, candidate in enumerate(candidates):
        for name in candidate.fit.moved:
            if spread(k, name) <= spread(found.get(name, k), name):
                found[name] = k
    return found


def owners_of_effects(candidates: list[Candidate]) -> dict[Term, int]:
    """The group that tells most of each effect that several have (a clock moves what arm and
    chamber see): the one whose standard deviations are least, on the average of their logarithms.
    """
    found: dict[Term, int] = {}
    for k, candidate in enumerate(candidates):
        for effect in candidate.effects:
            last = candidates[found.get(effect, k)]
            if _doubt(candidate, effect) <= _doubt(last, effect):
                found[effect] = k
    return found


def _doubt(candidate: Candidate, effect: Term) -> float:
    """How little a fit tells of an effect: mean logarithm of the standard deviations of its
    parameters, in units of their typical sizes.
    """
    std = candidate.fit.std
    logs = []
    for name in candidate.fit.values:
        if effect_of(name) == effect:
            parameter = find_parameter(name)
            size = max(abs(s) for s in (parameter.default, *parameter.starts))
            spread = std[name] / size if size > 0.0 else std[name]
            logs.append(math.log(spread) if spread > 0.0 else math.inf)
    return sum(logs) / len(logs) if logs else -math.inf
