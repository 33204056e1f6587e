"""The mismatch budget of each block: what of the nominal model's excess over the noise each term
takes, and what stays unexplained.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import Judged, is_parameter, significant
from pamrs.diagnosis.explain._owners import owners_of_effects
from pamrs.diagnosis.fit import Events, Key, Problem, acts_in, form_in, residuals, without_term
from pamrs.diagnosis.noise import Excess, NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import id_of, info_of, is_effect, place_of
from pamrs.errors import SimulationError
from pamrs.findings import BudgetTerm, EffectParameterFound
from pamrs.rig import Rig

__all__ = ["budget"]

Array = NDArray[np.float64]
Stages = dict[str, dict[Key, Residual]]
Residuals = dict[Key, Residual]


@dataclass(frozen=True)
class _Step:
    """A term of a group: its kind and id, what the blocks keep with it and all terms before it; and
    what they keep without and with it, after the terms before it, and after those behind it.
    """

    kind: str
    name: str
    now: Residuals
    drops: tuple[tuple[Residuals, Residuals], ...]


def budget(
    judged: list[Judged],
    problem: Problem,
    found: Stages,
    noise_level: dict[Key, NoiseLevel],
    nominal: Rig,
    final: Rig,
    events: Events | None = None,
) -> list[BudgetTerm]:
    """The budget of every block whose nominal model leaves more than noise.

    All terms have the values of the final model, those of the parameters as well: parameters that
    were fitted without an effect take up what is the effect's. What a term takes depends on what
    is there already; a share is the mean of what it takes after all terms before it, and of what
    it takes after all those behind it.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts.
    problem : Problem
        Held-out recordings (those that were fitted, where there are no others).
    found : dict of str to dict
        Their residuals by stage (``before``, ``refit``, ``after``), block and recording.
    noise_level : dict
        Noise by block and recording.
    nominal, final : Rig
        The nominal model, and that with everything that was found.
    events : Events, optional
        What happened in single recordings.

    Returns
    -------
    list of BudgetTerm
        Block by block: effects that the nominal model holds already, parameters inside their
        tolerances, then what is named, the largest first, then what no name explains. The shares
        of a block add up to 1.
    """
    terms: list[BudgetTerm] = []
    best = owners_of_effects([one.chosen for one in judged])
    owners = {name: judged[k] for name, k in best.items() if name in judged[k].named}
    bare = _without_held(problem, nominal, found["before"])
    for one in judged:
        steps = _steps(one, problem, found, nominal, final, events)
        for block in one.group.blocks:

            def kept(residual: Residuals, block: Block = block) -> Excess:
                return excess(
                    block, problem.recordings, residual, noise_level, problem.settings.noise
                )

            acting = [(name, r) for name, r in bare if not name or acts_in(name, block)]
            before = kept(acting[0][1])
            if not significant(before):
                continue
            held = [
                _Step("held", name, now, ((was, now),))
                for (_, was), (name, now) in itertools.pairwise(acting)
            ]
            stages = [
                _Stage(s.kind, s.name, kept(s.now), [(kept(a), kept(b)) for a, b in s.drops])
                for s in (*held, *steps)
            ]
            terms += _terms(block, before, stages, one, owners, final, problem.settings)
    return terms


@dataclass(frozen=True)
class _Stage:
    """A term of one block: as in `_Step`, against its noise."""

    kind: str
    name: str
    now: Excess
    drops: list[tuple[Excess, Excess]]


def _steps(
    judged: Judged,
    problem: Problem,
    found: Stages,
    nominal: Rig,
    final: Rig,
    events: Events | None,
) -> list[_Step]:
    """The terms of a group beside what the nominal model holds."""
    names = _in_order(judged)
    if not names:
        refit = _Step("parameters", "", found["refit"], ((found["before"], found["refit"]),))
        if judged.verdict != "unlisted" or judged.group.closure is None:
            return [refit]
        after = found["after"]
        return [refit, _Step("form", "", after, ((found["refit"], after),))]
    own = replace(problem, blocks=judged.group.blocks)
    every = ("", *names)

    def kept(present: tuple[str, ...]) -> Residuals:
        if not present or present == every:
            return found["after" if present else "before"]
        happened = events if events is not None and events.effect in present else None
        return residuals(own, _with_only(present, every, nominal, final), (), happened)

    try:
        forward = [kept(every[:n]) for n in range(len(every) + 1)]
    except SimulationError:  # a part of the model leaves its range: it is said as a whole
        now = found["after"]
        return [_Step(_kind(names[0]), names[0], now, ((found["before"], now),))]
    try:
        backward = [kept(every[n:]) for n in range(len(every) + 1)]
    except SimulationError:
        backward = []
    steps = []
    for n, name in enumerate(every):
        drops = [(forward[n], forward[n + 1])]
        if backward:
            drops.append((backward[n + 1], backward[n]))
        kind = _kind(name) if name else "parameters"
        steps.append(_Step(kind, name, forward[n + 1], tuple(drops)))
    return steps


def _with_only(present: tuple[str, ...], every: tuple[str, ...], nominal: Rig, final: Rig) -> Rig:
    """The final model with some of its terms: parameters inside their tolerances under an empty
    name, wrong ones joined by ``+``, effects.
    """
    rig = final
    wrong: dict[str, bool] = {}
    for name in every:
        if name and is_parameter(name):
            wrong |= dict.fromkeys(name.split("+"), name in present)
        elif name and name not in present:
            rig = without_term(rig, name)
    there = "" in present
    back = {n: p.value for n, p in nominal.parameters.items() if not wrong.get(n, there)}
    return rig.with_parameters(back)


def _without_held(
    problem: Problem, nominal: Rig, before: dict[Key, Residual]
) -> list[tuple[str, dict[Key, Residual]]]:
    """The residuals of the nominal model without the effects that it holds (under an empty name),
    then with one id of them after the other.
    """
    ids = list(dict.fromkeys(entry["id"] for entry in nominal.effects))
    out: list[tuple[str, dict[Key, Residual]]] = []
    rig, now = nominal, before
    try:
        for later in reversed(ids):
            out.insert(0, (later, now))
            rig = rig.without_effect(later)
            now = residuals(problem, rig)
    except SimulationError:  # without it the model leaves its range: nothing to compare with
        return [("", before)]
    return [("", now), *out]


def _kind(name: str) -> str:
    """What a name of a hypothesis is."""
    return "wrong_parameter" if is_parameter(name) else "effect"


def _in_order(judged: Judged) -> list[str]:
    """Names of a group: wrong parameters in one, then effects, the one that leaves least by itself
    first.
    """
    alone = {
        c.effects[0]: sum(e.ratio for e in c.held_out.values())
        for c in judged.group.candidates
        if len(c.effects) == 1
    }
    wrong = ["+".join(judged.wrong)] if judged.wrong else []
    effects = [name for name in judged.named if is_effect(name)]
    return [*wrong, *sorted(effects, key=lambda name: alone.get(name, np.inf))]


def _terms(
    block: Block,
    before: Excess,
    stages: list[_Stage],
    judged: Judged,
    owners: Mapping[str, Judged],
    final: Rig,
    settings: DiagnosisSettings,
) -> Iterator[BudgetTerm]:
    """The terms of one block, and what is left; ``owners`` are the groups whose values of an effect
    the final model has.
    """
    counts = np.array([n for _, n in before.pieces], dtype=np.float64)
    rng = np.random.default_rng(settings.seed)
    draws = rng.dirichlet(np.ones(counts.size), settings.verdict.budget_draws) * counts
    was = before
    for stage in stages:
        name, now = stage.name, stage.now
        share, interval = _share(before, stage.drops, counts, draws)
        named = name and stage.kind != "held"
        chance = judged.probabilities.get(name, judged.probability(name)) if named else None
        yield BudgetTerm(
            block=block.name,
            kind=stage.kind,
            id=id_of(name),
            form=form_in(final, name),
            share=share,
            interval=interval,
            probability=chance,
            noises=now.systematic,
            size=now.systematic * now.noise,
            unit=unit_of(block.channel),
            at=place_of(name)
            or next((e.get("at", "") for e in final.effects if e["id"] == name), ""),
            parameters=_values(name, owners.get(name, judged)),
        )
        was = now
    share, interval = _share(before, [(was, None)], counts, draws)
    yield BudgetTerm(
        block=block.name,
        kind="unexplained",
        id="",
        form="",
        share=share,
        interval=interval,
        probability=None,
        noises=was.systematic,
        size=was.systematic * was.noise,
        unit=unit_of(block.channel),
    )


def _values(name: str, judged: Judged) -> dict[str, EffectParameterFound]:
    """What the recordings say of a term: values of the effect, or of the wrong parameters, SI."""
    found, names = judged.chosen.fit, set(name.split("+"))
    form = info_of(name).form(form_in(found.rig, name)).parameters if is_effect(name) else ()
    units = {p.name: p.unit for p in form}
    out = {}
    for full, value in found.values.items():
        own, _, parameter = full.partition(".")
        if own == name:
            key, unit = parameter, units.get(parameter, "")
        elif full in names:
            key, unit = full, found.rig.parameter(full).unit
        else:
            continue
        std = found.std.get(full, math.inf)
        out[key] = EffectParameterFound(value, std if math.isfinite(std) else None, unit)
    return out


def _share(
    before: Excess, drops: Sequence[tuple[Excess, Excess | None]], counts: Array, draws: Array
) -> tuple[float, list[float]]:
    """Share of the nominal model's excess variance that a step takes, the mean of several drops (to
    the noise, where there is no next step), and its interval of 95 % by a Bayesian bootstrap over
    the pieces of the recordings: ``counts`` are the bins in each, ``draws`` as many weighted anew.
    """

    def ratios(one: Excess | None) -> Array:
        return np.array([r for r, _ in one.pieces]) if one is not None else np.ones(counts.size)

    first = ratios(before)
    taken = np.mean([ratios(upper) - ratios(lower) for upper, lower in drops], axis=0)
    excess_of = np.maximum(draws @ (first - 1.0), 1e-12)
    shares = draws @ taken / excess_of
    whole = max(float(counts @ (first - 1.0)), 1e-12)
    low, high = np.quantile(shares, [0.025, 0.975])
    return float(counts @ taken) / whole, [float(low), float(high)]
