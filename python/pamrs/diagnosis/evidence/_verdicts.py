"""What each group of blocks says, beside what the others say, and what the case comes to.

Groups of blocks are judged by themselves: what one keeps without a name says nothing of what
another one has. Only an effect that acts in two groups ties them: it is one effect, so that its
evidence in both counts together.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from pamrs.diagnosis.evidence._candidates import Candidate, Group, significant
from pamrs.diagnosis.evidence._weighing import paid_for
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import exclude, is_effect
from pamrs.findings import HEALTHY

__all__ = [
    "WALL_TOLERANCES",
    "Judged",
    "calibrated",
    "case_ambiguity",
    "case_probabilities",
    "case_verdict",
    "is_parameter",
    "judge",
    "symptoms_of",
]

# odds of one effect that acts in two groups of blocks to two effects (decision 4)
_SHARED_ODDS = 6.0
_ALIKE_STDS = 3.0  # [standard deviations] by which the values of one name in two groups may differ
# share of the larger by which values differ however well known, as models err: a factor of two
_ALIKE_SHARE = 0.5
# probability from which a case lists a set: most products of several blocks are nothing
_LISTED = 1e-4
_COUNTED = 1e-6  # probability from which a hypothesis of one group is put beside those of others
_MOST_SETS = 8  # sets that a case lists
# probability of parameters (none) in a group that keeps noise: the rest (decision 4)
_QUIET_LIKELY = 0.83
_QUIET_OTHER = 0.03  # probability of the other one of the two (decision 4)
# probability of unlisted in such a group, too small to see: 24 of 171 groups (decision 4)
_QUIET_UNLISTED = 0.14
# parameters with one at its wall: explained, at a price the owner would mind (decision 4)
_STRAINED_PARAMETERS = 0.75
_STRAINED_UNLISTED = 0.25  # probability of unlisted there (decision 4)
# [tolerances] moved to its wall (fit.most_tolerances), which is suspect (decision 25)
WALL_TOLERANCES = 2.9


WITHOUT_NAME = (*HEALTHY, "unlisted")
"""Hypotheses that name nothing."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A group of blocks with its verdict.

    Attributes
    ----------
    group : Group
        The blocks, and everything found out about them.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``.
    probabilities : dict of str to float
        Over ``none``, ``parameters``, ``unlisted``, sets of effects and wrong parameters (names
        joined by ``+``), the most probable first.
    ambiguity : list of list of str
        Hypotheses that are left, each as its names; empty when settled.
    chosen : Candidate
        The hypothesis that is named; the baseline where none is.
    """

    group: Group
    verdict: str
    probabilities: dict[str, float]
    ambiguity: list[list[str]]
    chosen: Candidate

    @property
    def named(self) -> tuple[str, ...]:
        """Effects that are named."""
        return self.chosen.effects if self.verdict == "effects" else ()

    @property
    def wrong(self) -> tuple[str, ...]:
        """Parameters that are named as wrong."""
        return self.chosen.wrong if self.verdict in ("effects", "parameters") else ()

    def probability(self, name: str) -> float:
        """Probability of an effect or of a wrong parameter, whatever else acts in these blocks."""
        return min(1.0, sum(p for key, p in self.probabilities.items() if name in key.split("+")))


def is_parameter(name: str) -> bool:
    """Whether a name in a hypothesis is that of a parameter of the rig file:
    ``chamber.dead_volume``.
    """
    return "." in name


def symptoms_of(group: Group) -> dict[str, float]:
    """Parameters that the refit without effects moved to their wall, and how far [tolerances]."""
    return {
        name: moved
        for name, moved in group.candidates[0].fit.moved.items()
        if abs(moved) >= WALL_TOLERANCES
    }


def _own(group: Group) -> dict[str, float]:
    """Probabilities of one group by itself; what stands under ``""`` is shared out between nothing
    and parameters that moved.
    """
    found = {key: p for key, p in group.probabilities.items() if key}
    unchanged = group.probabilities.get("", 0.0)
    shifted = bool(group.instead) or any(significant(e) for e in group.nominal.values())
    explained = any(c.wrong for c in group.candidates)
    quiet = {
        "parameters": _QUIET_LIKELY,
        "none": _QUIET_OTHER,
        "unlisted": _QUIET_UNLISTED,
    }
    if symptoms_of(group) and group.mismatch is None and not explained:
        quiet = {"parameters": _STRAINED_PARAMETERS, "unlisted": _STRAINED_UNLISTED}
    elif not shifted:
        quiet |= {"none": _QUIET_LIKELY, "parameters": _QUIET_OTHER}
    for name, share in quiet.items():
        found[name] = found.get(name, 0.0) + unchanged * share
    return {key: p for key, p in found.items() if p >= _COUNTED or key in WITHOUT_NAME}


def calibrated(group: Group, settings: DiagnosisSettings) -> Group:
    """A group whose probabilities are as often right as they say.

    Where hypotheses compete for a mismatch, the logarithm of the odds between any two of them
    counts a share (`certainty` of the settings) that was found on cases of another plant: what
    speaks for a name are residuals of which no model is quite true.
    """
    if group.mismatch is None or group.below_noise:
        return group
    powers = {key: p**settings.certainty for key, p in group.probabilities.items() if p > 0.0}
    return replace(group, probabilities=_normalised(powers))


def judge(groups: Sequence[Group], settings: DiagnosisSettings) -> list[Judged]:
    """The verdict of every group, an effect that acts in several being judged once.

    Parameters
    ----------
    groups : sequence of Group
        Examined, each by itself.
    settings : DiagnosisSettings
        Odds of what is shared, probabilities from which something is named or left open.
    """
    own = [_own(group) for group in groups]
    beside: list[dict[str, float]] = [{} for _ in groups]
    several = _in_several(own)
    fitted = [{c.key: c for c in group.candidates} for group in groups]
    for choice in itertools.product(*(p.items() for p in own)):
        keys = [key for key, _ in choice]
        names = [n for key in keys for n in key.split("+") if n not in WITHOUT_NAME]
        if not _together(names):
            continue  # one effect everywhere and at a place of its own
        weight = math.prod(p for _, p in choice)
        for name in several:
            holders = [
                (group, known[key])
                for group, known, key in zip(groups, fitted, keys, strict=True)
                if name in key.split("+")
            ]
            weight *= _odds_shared(name, holders, settings)
        for found, (key, _) in zip(beside, choice, strict=True):
            found[key] = found.get(key, 0.0) + weight
    return [
        _judged(group, _normalised(found), settings)
        for group, found in zip(groups, beside, strict=True)
    ]


def _in_several(own: Sequence[Mapping[str, float]]) -> set[str]:
    """Names that hypotheses of several groups have."""
    named = [set(_names(found)) for found in own]
    return {name for one, two in itertools.combinations(named, 2) for name in one & two}


def _odds_shared(
    name: str, holders: Sequence[tuple[Group, Candidate]], settings: DiagnosisSettings
) -> float:
    """Odds of one name in several groups of blocks, each with a hypothesis that has it, to as many
    names of which each happens to be there.

    What is there once is paid for once: the dearest price stays, the others are given back. Where
    the groups ask for other values, they are two.
    """
    if len(holders) < 2 or not _alike(name, [c for _, c in holders]):
        return 1.0
    prices = [
        paid_for(c, name, settings)
        for group, c in holders
        if group.mismatch is not None and not group.below_noise
    ]
    again = settings.certainty * (sum(prices) - max(prices, default=0.0))
    return _SHARED_ODDS ** (len(holders) - 1) * math.exp(again)


def _alike(name: str, candidates: Sequence[Candidate]) -> bool:
    """Whether hypotheses give one name the same values, as far as each knows them."""

    def same(parameter: str, one: Candidate, two: Candidate) -> bool:
        first, second = one.fit.values[parameter], two.fit.values[parameter]
        spread = math.hypot(*(c.fit.std.get(parameter, math.inf) for c in (one, two)))
        known = _ALIKE_STDS * spread, _ALIKE_SHARE * max(abs(first), abs(second))
        return abs(first - second) <= max(known)

    return all(
        same(parameter, one, two)
        for one, two in itertools.combinations(candidates, 2)
        for parameter in one.fit.values.keys() & two.fit.values.keys()
        if parameter == name or parameter.partition(".")[0] == name
    )


def _together(names: list[str]) -> bool:
    """Whether the names of several groups can hold at once."""
    unique = sorted({name for name in names if is_effect(name)})
    return not any(exclude(one, unique[k + 1 :]) for k, one in enumerate(unique))


def _normalised(weights: dict[str, float]) -> dict[str, float]:
    total = sum(weights.values())
    return dict(sorted(((key, w / total) for key, w in weights.items()), key=lambda kv: -kv[1]))


def _judged(group: Group, probabilities: dict[str, float], settings: DiagnosisSettings) -> Judged:
    """The verdict: that of the most probable hypothesis; without a name only if no single name is
    more probable than not.
    """
    start = group.candidates[0]
    names = {key: p for key, p in probabilities.items() if key not in WITHOUT_NAME}
    healthy = max(HEALTHY, key=lambda key: probabilities.get(key, 0.0))
    without = probabilities.get("unlisted", 0.0)
    best = max(names, key=lambda key: names[key], default="")
    ambiguity = _sets(probabilities, settings)
    if probabilities.get(healthy, 0.0) >= max(without, names.get(best, 0.0)):
        return Judged(group, healthy, probabilities, ambiguity, start)
    marginal = {
        name: sum(p for key, p in names.items() if name in key.split("+")) for name in _names(names)
    }
    if names.get(best, 0.0) <= without and max(marginal.values(), default=0.0) <= settings.named:
        return Judged(group, "unlisted", probabilities, ambiguity, start)
    chosen = next(c for c in group.candidates if c.key == best)
    return Judged(
        group, "effects" if chosen.effects else "parameters", probabilities, ambiguity, chosen
    )


def _sets(probabilities: dict[str, float], settings: DiagnosisSettings) -> list[list[str]]:
    """Hypotheses that are left, the most probable first; none where one is settled, ``none`` and
    ``parameters`` being one answer.
    """
    healthy = sum(probabilities.get(key, 0.0) for key in HEALTHY)
    others = [p for key, p in probabilities.items() if key not in HEALTHY]
    if max(healthy, *others, 0.0) > settings.settled:
        return []
    found = [sorted(key.split("+")) for key, p in probabilities.items() if p >= settings.in_set]
    return found if len(found) > 1 else []


def case_verdict(judged: Sequence[Judged]) -> str:
    """The verdict of a case: a name wherever a block has one, what is missing without a name only
    where there is none.
    """
    found = [j.verdict for j in judged]
    if "effects" in found or any(j.wrong for j in judged):
        return "effects" if "effects" in found else "parameters"
    return next((verdict for verdict in ("unlisted", "parameters") if verdict in found), "none")


def case_probabilities(judged: Sequence[Judged]) -> dict[str, float]:
    """Probabilities of the possible answers for a case: the names of all its blocks together.

    ``unlisted`` is that something is missing and nothing has a name. What one block keeps without a
    name takes nothing from a name in another.
    """
    found = dict.fromkeys(WITHOUT_NAME, 0.0)
    for choice in itertools.product(*(j.probabilities.items() for j in judged)):
        keys = [key for key, _ in choice]
        names = _names(keys)
        rest = next((key for key in ("unlisted", "parameters") if key in keys), "none")
        key = "+".join(names) or rest
        found[key] = found.get(key, 0.0) + math.prod(p for _, p in choice)
    return _normalised({key: p for key, p in found.items() if p >= _LISTED or key in WITHOUT_NAME})


def case_ambiguity(judged: Sequence[Judged]) -> list[list[str]]:
    """Sets of names that a case leaves open: the open sets of its blocks, each beside what is
    settled in the others.
    """
    if not any(j.ambiguity for j in judged):
        return []
    # what a block is settled to keep without a name is no part of the question
    options = [j.ambiguity or [[*j.named, *j.wrong]] for j in judged]
    found: list[list[str]] = []
    for choice in itertools.product(*options):
        flat = [name for names in choice for name in names]
        rest = next((word for word in reversed(WITHOUT_NAME) if word in flat), None)
        # nothing else counts beside a name but that something else is missing
        entry = [
            *_names(flat),
            *([rest] if rest == "unlisted" or (rest and not _names(flat)) else []),
        ]
        if entry and entry not in found:
            found.append(entry)
    return found[:_MOST_SETS] if len(found) > 1 else []


def _names(keys: Iterable[str]) -> list[str]:
    """Names of effects and of parameters in hypotheses, each once, in alphabetical order."""
    return sorted({name for key in keys for name in key.split("+") if name not in WITHOUT_NAME})
