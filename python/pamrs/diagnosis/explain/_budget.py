"""The mismatch budget of each block: what of the nominal model's excess over the noise each term
takes, and what stays unexplained.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import Judged, is_parameter, significant
from pamrs.diagnosis.fit import Key, Problem, acts_in, form_in, residuals
from pamrs.diagnosis.noise import Excess, NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import EFFECTS
from pamrs.errors import SimulationError
from pamrs.findings import BudgetTerm, EffectParameterFound
from pamrs.rig import Rig

__all__ = ["budget"]

Array = NDArray[np.float64]
Stages = dict[str, dict[Key, Residual]]
Stage = tuple[str, str, Excess]
"""Kind of a term, its id, and what the block keeps with it and with all terms before it."""


def budget(
    judged: list[Judged],
    problem: Problem,
    found: Stages,
    noise_level: dict[Key, NoiseLevel],
    nominal: Rig,
    final: Rig,
) -> list[BudgetTerm]:
    """The budget of every block whose nominal model leaves more than noise.

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

    Returns
    -------
    list of BudgetTerm
        Block by block: effects that the nominal model holds already, parameters inside their
        tolerances, then what is named, the largest first, then what no name explains. The shares
        of a block add up to 1.
    """
    terms: list[BudgetTerm] = []
    bare = _without_held(problem, nominal, found["before"])
    for one in judged:
        # what is left out again, term by term, where several are named
        partial = _without(one, problem, final)
        for block in one.group.blocks:

            def kept(residual: dict[Key, Residual], block: Block = block) -> Excess:
                return excess(
                    block, problem.recordings, residual, noise_level, problem.settings.noise
                )

            acting = [(name, r) for name, r in bare if not name or acts_in(name, block)]
            before = kept(acting[0][1])
            if not significant(before):
                continue
            stages: list[Stage] = [("held", name, kept(r)) for name, r in acting[1:]]
            stages += [("parameters", "", kept(found["refit"]))]
            stages += [(_kind(name), name, kept(residual)) for name, residual in partial[:-1]]
            last = partial[-1][0] if partial else ""
            form = one.verdict == "unlisted" and one.group.closure is not None
            if last or form:
                kind = "form" if form else _kind(last)
                stages.append((kind, last, kept(found["after"])))
            terms += _terms(block, before, stages, one, final, problem.settings)
    return terms


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


def _without(judged: Judged, problem: Problem, final: Rig) -> list[tuple[str, dict[Key, Residual]]]:
    """What is named, that which leaves least by itself first, each with the residuals of the model
    that has it and those before it; of the last one, which is the whole model, none.
    """
    names = _in_order(judged)
    own = replace(problem, blocks=judged.group.blocks)
    out: list[tuple[str, dict[Key, Residual]]] = []
    for count, name in enumerate(names[:-1], 1):
        rig = final
        for later in names[count:]:
            rig = rig.without_effect(later)
        try:
            out.append((name, residuals(own, rig)))
        except SimulationError:  # it is said together with the next one
            continue
    return [*out, *((name, {}) for name in names[-1:])]


def _in_order(judged: Judged) -> list[str]:
    """Names of a group, the one that leaves least by itself first; wrong parameters in one."""
    if judged.wrong:
        return ["+".join(judged.wrong)]
    alone = {
        c.effects[0]: sum(e.ratio for e in c.held_out.values())
        for c in judged.group.candidates
        if len(c.effects) == 1
    }
    return sorted(judged.named, key=lambda name: alone.get(name, np.inf))


def _terms(
    block: Block,
    before: Excess,
    stages: list[Stage],
    judged: Judged,
    final: Rig,
    settings: DiagnosisSettings,
) -> Iterator[BudgetTerm]:
    """The terms of one block, and what is left."""
    counts = np.array([n for _, n in before.pieces], dtype=np.float64)
    rng = np.random.default_rng(settings.seed)
    draws = rng.dirichlet(np.ones(counts.size), settings.verdict.budget_draws) * counts
    was = before
    for kind, name, now in stages:
        share, interval = _share(before, was, now, counts, draws)
        named = name and kind != "held"
        chance = judged.probabilities.get(name, judged.probability(name)) if named else None
        yield BudgetTerm(
            block=block.name,
            kind=kind,
            id=name,
            form=form_in(final, name),
            share=share,
            interval=interval,
            probability=chance,
            noises=now.systematic,
            size=now.systematic * now.noise,
            unit=unit_of(block.channel),
            at=next((e.get("at", "") for e in final.effects if e["id"] == name), ""),
            parameters=_values(name, judged),
        )
        was = now
    share, interval = _share(before, was, None, counts, draws)
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
    form = EFFECTS[name].form(form_in(found.rig, name)).parameters if name in EFFECTS else ()
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
        out[key] = EffectParameterFound(value, found.std.get(full), unit)
    return out


def _share(
    before: Excess, was: Excess, now: Excess | None, counts: Array, draws: Array
) -> tuple[float, list[float]]:
    """Share of the nominal model's excess variance that a step takes (the rest, where there is no
    next one), and its interval of 95 % by a Bayesian bootstrap over the pieces of the recordings:
    ``counts`` are the bins in each, ``draws`` as many weighted anew.
    """
    first, upper, lower = (
        np.array([r for r, _ in e.pieces]) if e is not None else np.ones(counts.size)
        for e in (before, was, now)
    )
    excess_of = np.maximum(draws @ (first - 1.0), 1e-12)
    shares = draws @ (upper - lower) / excess_of
    whole = max(float(counts @ (first - 1.0)), 1e-12)
    low, high = np.quantile(shares, [0.025, 0.975])
    return float(counts @ (upper - lower)) / whole, [float(low), float(high)]
