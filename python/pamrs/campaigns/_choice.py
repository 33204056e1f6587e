"""Choice of the next experiment: those that may be played, those that were, and the one that tells
most of what is open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pamrs.campaigns._bench import Commands
from pamrs.campaigns._budget import Budget, Cost, cost_of
from pamrs.channels import channel_of
from pamrs.diagnosis import Diagnosis, DiagnosisSettings
from pamrs.diagnosis.next_experiment import (
    Plan,
    measurable,
    parts_any,
    plan_diagnosis,
    propose,
)
from pamrs.effects import NONE, UNLISTED
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.experiments import Experiment, experiments_of, library
from pamrs.findings import NextExperiment
from pamrs.recordings import Recording
from pamrs.report.words import hypothesis_label, listed, spoken_name
from pamrs.rig import Rig

_LEAST_NOISES: Final = 1.0  # [noise levels] below which a pair is not told apart
_LEVELS: Final = 0.1  # share by which numbers of an experiment may differ and be the same
_BY_HAND: Final = 1.0  # [s] of effort beyond its length from which an experiment takes hands


@dataclass(frozen=True, eq=False)
class ProposedRun:
    """An experiment that is to be played.

    Attributes
    ----------
    experiment : Experiment
        Which one.
    why : str
        What it is to tell.
    repeats : bool
        Whether it was played before.
    rivals : list of (str, Rig, float)
        Models that predict it: label, rig, probability.
    bits : float or None
        What it is expected to tell [bit]; None where rivals were not compared.
    """

    experiment: Experiment
    why: str
    repeats: bool = False
    rivals: list[tuple[str, Any, float]] = field(default_factory=list)
    bits: float | None = None


@dataclass(frozen=True, eq=False)
class Pool:
    """Experiments that may be played.

    Attributes
    ----------
    new, again : dict of str to Experiment
        Allowed ones by name that were not played at this level, and those that were once.
    costs : dict of str to Cost
        What each takes.
    refused : dict of str to str
        Why each of the others may not be played.
    by_hand : list of Experiment
        Those that need another payload, or hands.
    """

    new: dict[str, Experiment]
    again: dict[str, Experiment]
    costs: dict[str, Cost]
    refused: dict[str, str]
    by_hand: list[Experiment]


def pool_of(
    commands: Commands,
    recordings: Sequence[Recording],
    played: Sequence[tuple[str, Mapping[str, Any]]],
    left: tuple[Budget, Cost],
    settings: DiagnosisSettings,
    *,
    hands: bool,
) -> Pool:
    """Experiments that may be played on a bench after some others (name and numbers), within what
    is left of a budget; with somebody at hand or without.

    Raises
    ------
    ParameterError
        If the limits of the bench allow none of the rig's experiments.
    DiagnosisError
        If there are none for such a rig.
    """
    rig, bench = commands.rig, commands.bench
    if bench.highest is None:
        every = experiments_of(rig, recordings, settings)
    else:
        every = library(rig, settings, highest=bench.highest)
    pool = Pool({}, {}, {}, {}, [])
    beyond = {e.name: commands.beyond(e) for e in every if e.commands}
    if beyond and all(beyond.values()):
        name, why = next(iter(beyond.items()))
        raise ParameterError(f"limits allow no experiment of rig {rig.name!r}: of {name}, {why}")
    budget, spent = left
    for one in every:
        helped = bool(one.changes or one.needs) or one.effort > one.duration + _BY_HAND
        if not hands and (helped or not one.commands):
            pool.by_hand.append(one)
            continue
        times = sum(alike(one, *own) for own in played)
        cost = pool.costs[one.name] = cost_of(one, rig, bench.settle)
        over = budget.passed(spent + cost)
        why = beyond.get(one.name, "") or (over and f"the budget would be passed, {over}")
        if why or times > 1:
            pool.refused[one.name] = why or "it was played twice"
        else:
            (pool.again if times else pool.new)[one.name] = one
    return pool


def alike(experiment: Experiment, name: str, numbers: Mapping[str, Any]) -> bool:
    """True where an experiment is one of this kind and level."""
    return experiment.name == name and _near(experiment.excitation, numbers)


def _near(value: Any, other: Any) -> bool:
    """True where two settings of an experiment are alike: words, numbers, or many of these."""
    if isinstance(value, Mapping) and isinstance(other, Mapping):
        return value.keys() == other.keys() and all(_near(value[key], other[key]) for key in value)
    one, two = (v.tolist() if isinstance(v, np.ndarray) else v for v in (value, other))
    if isinstance(one, (list, tuple)) and isinstance(two, (list, tuple)):
        return len(one) == len(two) and all(map(_near, one, two))
    if isinstance(one, (int, float)) and isinstance(two, (int, float)):
        return math.isclose(one, two, rel_tol=_LEVELS)
    return bool(one == two)


def shows_of(plan: Plan) -> dict[str, list[str]]:
    """Of each effect that a standard experiment shows at its usual size, the experiments that do,
    the best one first.
    """
    found = {o.effect: [o.recording] for o in plan.limits if o.verdict != "not seen"}
    for addition in plan.additions:
        for effect in addition.seen if addition.kind == "experiment" else ():
            found.setdefault(effect, []).append(addition.name)
    return found


def plan_of(rig: Rig, recordings: Sequence[Recording], settings: DiagnosisSettings) -> Plan:
    """A plan with the channels that were recorded; with all that are usual before there are any."""
    usual = [
        name for name in measurable(rig) if channel_of(name) not in ("temperature", "line_pressure")
    ]
    heard = [n for n in measurable(rig) if recordings and all(n in r.channels for r in recordings)]
    return plan_diagnosis(rig, heard or usual, settings=settings)


def unseen(diagnosis: Diagnosis) -> list[str]:
    """Effects that the recordings would not show at their usual size."""
    return [own.effect for own in diagnosis.limits if own.verdict == "not seen"]


def is_open(diagnosis: Diagnosis | None, recordings: int) -> str:
    """Open question of a diagnosis of so many recordings, in words; empty where there is none."""
    if diagnosis is None:
        return "nothing was recorded yet"
    if not diagnosis.answer.settled:
        return diagnosis.headline
    if recordings < 2:
        return "the answer rests on one recording, and has not predicted another one yet"
    return ""


def proposed(
    rig: Rig,
    diagnosis: Diagnosis | None,
    pool: Pool,
    blind: Mapping[str, list[str]],
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    *,
    repeat: bool,
) -> ProposedRun | None:
    """The experiment that tells most of what is open; None where no allowed one parts it.

    With `repeat` one that was played before is asked again, to see what chance leaves.
    """
    own = NextExperiment() if diagnosis is None else diagnosis.next_experiment
    rivals = list(own.hypotheses)
    allowed = pool.again if repeat else pool.new
    if diagnosis is not None and not (repeat or diagnosis.answer.settled) and len(rivals) > 1:
        found = _parting(rig, own, allowed, recordings, settings)
        if found is not None or not _is_nameless(diagnosis):
            return found
    if not any(label == str(NONE) for label, _, _ in rivals):
        rivals.append((str(NONE), rig, 0.0 if rivals else 1.0))  # what the rig file says
    hidden = diagnosis is not None and diagnosis.answer.why == "unseen" and not repeat
    if own.protocol is not None and own.protocol.name in allowed and not hidden:
        return ProposedRun(allowed[own.protocol.name], own.text, repeat, rivals)
    if repeat:
        name = next(iter(allowed), "")
        why = "The same once more: whether it comes out alike says what chance leaves."
        return ProposedRun(allowed[name], why, repeat, rivals) if name else None
    parting = (pair for pair in own.pairs if pair.noises is None or pair.noises >= _LEAST_NOISES)
    separating = next((pair for pair in parting if pair.experiment in allowed), None)
    if separating is not None:
        return ProposedRun(allowed[separating.experiment], separating.text, repeat, rivals)
    return _showing(diagnosis, allowed, blind, rivals)


def _is_nameless(diagnosis: Diagnosis) -> bool:
    """True where something without a name is missing or not ruled out, or no model with a name
    explains what is missed.
    """
    open_ones = [diagnosis.verdict, *(name for own in diagnosis.ambiguity for name in own)]
    return UNLISTED.rest in open_ones or diagnosis.answer.why == "missed"


def _parting(
    rig: Rig,
    own: NextExperiment,
    allowed: Mapping[str, Experiment],
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
) -> ProposedRun | None:
    """The allowed experiment that parts most of what is left; None where none does."""
    if not allowed:
        return None
    found = own
    if not _is_of(own, allowed):
        try:
            found = propose(
                rig,
                own.hypotheses,
                own.noise,
                recordings,
                experiments=list(allowed.values()),
                settings=settings,
            )
        except DiagnosisError:  # none of them can be simulated with every rival
            return None
    if found.protocol is None or found.curves is None or not parts_any(found):
        return None
    compared = [rival for rival in own.hypotheses if rival[0] in found.curves.predicted]
    return ProposedRun(
        allowed[found.protocol.name], found.text, False, compared, found.expected_information_bits
    )


def _is_of(own: NextExperiment, allowed: Mapping[str, Experiment]) -> bool:
    """True where a proposal is one of the allowed experiments, command by command."""
    mine = allowed.get(own.protocol.name) if own.protocol is not None else None
    if mine is None or own.protocol is None or own.curves is None:
        return False
    theirs = own.protocol.commands
    return theirs.keys() == mine.commands.keys() and all(
        np.array_equal(theirs[name], values) for name, values in mine.commands.items()
    )


def _showing(
    diagnosis: Diagnosis | None,
    allowed: Mapping[str, Experiment],
    blind: Mapping[str, list[str]],
    rivals: list[tuple[str, Any, float]],
) -> ProposedRun | None:
    """The allowed experiment that shows most of what was not seen yet, at the least effort; else
    the cheapest one, where nothing was recorded or the answer is not settled.
    """
    best = min(
        allowed.values(), key=lambda one: (-len(_shown_by(one, blind)), one.effort), default=None
    )
    if best is None:
        return None
    shown = _shown_by(best, blind)
    if shown:
        why = f"It would show {_effects(shown)} at the usual size."
        if diagnosis is not None and diagnosis.answer.settled:
            why = f"An answer from one recording has to predict another one. {why}"
        return ProposedRun(best, why, False, rivals)
    if diagnosis is not None and diagnosis.answer.why in ("", "unseen"):
        return None
    why = "The answer is not settled: another motion may tell more."
    if diagnosis is None:
        why = "Nothing was recorded yet: this one takes the least effort."
    elif _is_nameless(diagnosis):
        why = "Not all that is missing has a name yet: another motion shows what it depends on."
    return ProposedRun(best, why, False, rivals)


def _shown_by(experiment: Experiment, blind: Mapping[str, list[str]]) -> list[str]:
    """Effects not seen yet that an experiment shows."""
    return [effect for effect, names in blind.items() if experiment.name in names]


def asked_for(diagnosis: Diagnosis | None, pool: Pool) -> str:
    """Other help to ask for: a sensor, another payload, hands, in words."""
    found = []
    if diagnosis is not None:
        ranking = diagnosis.next_experiment.ranking
        sensor = next((own.sensor for own in ranking if own.sensor), "")
        found += [f"a sensor: {spoken_name(sensor)}"] if sensor else []
    for one in pool.by_hand:
        what = "another payload" if one.changes else "somebody at the bench"
        found.append(f"{what}: {one.text}")
    return "; ".join(found) or "another sensor"


def _effects(names: Iterable[str], most: int = 4) -> str:
    """Effects in words, a few of them."""
    every = [hypothesis_label(name) for name in names]
    more = [f"{len(every) - most} others"] if len(every) > most else []
    return listed([*every[:most], *more], "or" if not more else "and")
