"""The mismatch budget of each block: what of the nominal model's excess over the noise each term
takes, and what stays unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import Judged, is_parameter, parts_of, significant, start_of
from pamrs.diagnosis.explain._owners import owners_of_effects
from pamrs.diagnosis.fit import (
    Events,
    Key,
    Problem,
    acts_in,
    depends,
    fit,
    form_in,
    known_parameters,
    residuals,
    without_term,
)
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
    """A term of a group: its kind and name, what the blocks keep with it and all terms before it,
    and with refitted parameters, of what is named, what they keep with no other name and with all
    others but it.
    """

    kind: str
    name: str
    now: Residuals
    alone: Residuals | None = None
    without: Residuals | None = None


def budget(
    judged: list[Judged],
    fitted: Problem,
    problem: Problem,
    found: Stages,
    noise_level: dict[Key, NoiseLevel],
    nominal: Rig,
    final: Rig,
    events: Events | None = None,
) -> list[BudgetTerm]:
    """The budget of every block whose nominal model leaves more than noise.

    Parameters inside their tolerances take what they take by themselves with their values in the
    final model: fitted without a name they bend towards what is missing. What is named takes what
    the final model takes beyond that. Several names divide it by what each takes, the mean of what
    it takes alone and of what is left without it, parameters and the others fitted again.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts.
    fitted, problem : Problem
        The recordings that were fitted, and held-out ones (the same, where there are no others).
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
        steps = _steps(one, fitted, problem, found, nominal, final, events)
        for block in one.group.blocks:

            def kept(residual: Residuals, block: Block = block) -> Excess:
                return excess(
                    block, problem.recordings, residual, noise_level, problem.settings.noise
                )

            acting = [(name, r) for name, r in bare if not name or acts_in(name, block)]
            before = kept(acting[0][1])
            if not significant(before):
                continue
            held = [_Step("held", name, now) for name, now in acting[1:]]
            stages = [
                _Stage(
                    s.kind,
                    s.name,
                    kept(s.now),
                    *(
                        kept(r)
                        if r is not None and (not s.name or _concerns(s.name, block))
                        else None
                        for r in (s.alone, s.without)
                    ),
                )
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
    alone: Excess | None
    without: Excess | None


def _concerns(name: str, block: Block) -> bool:
    """Whether the output of a block depends on what is named."""
    if is_effect(name):
        return acts_in(name, block)
    return any(depends(block, one) for one in name.split("+"))


def _steps(
    judged: Judged,
    fitted: Problem,
    problem: Problem,
    found: Stages,
    nominal: Rig,
    final: Rig,
    events: Events | None,
) -> list[_Step]:
    """The terms of a group beside what the nominal model holds."""
    names = _in_order(judged)
    if not names:
        refit = _Step("parameters", "", found["refit"])
        if judged.verdict != "unlisted" or judged.group.closure is None:
            return [refit]
        return [refit, _Step("form", "", found["after"])]
    own = replace(problem, blocks=judged.group.blocks)

    @cache
    def kept(present: tuple[str, ...]) -> Residuals:
        if present == names:
            return found["after"]
        if not present and not judged.wrong:
            return found["refit"]
        again = _fitted_again(judged, replace(fitted, blocks=own.blocks), nominal, present)
        if again is None:
            return found["after" if present else "refit"]
        happened = events if events is not None and events.effect in present else None
        try:
            return residuals(own, again, (), happened)
        except SimulationError:  # without the others the model leaves its range
            return found["after" if present else "refit"]

    refitted = kept(()) if len(names) > 1 else None
    try:
        first = residuals(own, _without_names(names, nominal, final))
    except SimulationError:
        first = found["refit"]
    steps = [_Step("parameters", "", first, refitted)]
    for n, name in enumerate(names):
        alone = without = None
        if refitted is not None:
            alone, without = kept((name,)), kept((*names[:n], *names[n + 1 :]))
        steps.append(_Step(_kind(name), name, kept(names[: n + 1]), alone, without))
    return steps


def _fitted_again(
    judged: Judged, fitted: Problem, nominal: Rig, present: tuple[str, ...]
) -> Rig | None:
    """The model of a group with some of its names, fitted; a parameter that is wrong stays at its
    nominal value where it is not among them. None where it leaves its range.
    """
    chosen = judged.chosen
    wrong = [one for name in present if is_parameter(name) for one in name.split("+")]
    effects = [name for name in present if is_effect(name)]
    if len(wrong) == len(chosen.wrong):
        for other in judged.group.candidates:
            if set(other.effects) == set(effects) and set(other.wrong) == set(wrong):
                return other.fit.rig
    happened = chosen.fit.events
    if happened is not None and happened.effect not in effects:
        happened = None
    lasting = [e for e in effects if happened is None or e != happened.effect]
    settings = fitted.settings.fit
    free, held, forms = parts_of(
        [start_of(chosen.fit, effect, settings.least_start) for effect in lasting]
    )
    known = known_parameters(nominal, settings)
    try:
        return fit(
            fitted,
            nominal,
            tuple(lasting),
            free,
            chosen.fit.inflation,
            fixed=held,
            warm=chosen.fit,
            events=happened,
            evaluations=settings.polish_evaluations,
            settled={n: known[n].value for n in chosen.wrong if n not in wrong},
            freed=wrong,
            forms=forms,
        ).rig
    except SimulationError:
        return None


def _without_names(names: tuple[str, ...], nominal: Rig, final: Rig) -> Rig:
    """The final model without what is named: effects, wrong parameters joined by ``+``."""
    back: dict[str, float] = {}
    for name in names:
        if is_parameter(name):
            back |= {n: nominal.parameter(n).value for n in name.split("+")}
        else:
            final = without_term(final, name)
    return final.with_parameters(back)


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


def _in_order(judged: Judged) -> tuple[str, ...]:
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
    return (*wrong, *sorted(effects, key=lambda name: alone.get(name, np.inf)))


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
    shares = _Shares(before, stages, settings)
    was = before
    for k, stage in enumerate(stages):
        name, now = stage.name, stage.now
        share, interval = shares.of(k)
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
    share, interval = shares.unexplained()
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


class _Shares:
    """Shares of a block's terms in the nominal model's excess variance, each with an interval of
    95 % by a Bayesian bootstrap over the pieces of the recordings.

    Parameters
    ----------
    before : Excess
        Of the nominal model.
    stages : list of _Stage
        The terms in their order.
    settings : DiagnosisSettings
        Seed and number of draws.
    """

    def __init__(self, before: Excess, stages: list[_Stage], settings: DiagnosisSettings) -> None:
        counts = np.array([n for _, n in before.pieces], dtype=np.float64)
        rng = np.random.default_rng(settings.seed)
        draws = rng.dirichlet(np.ones(counts.size), settings.verdict.budget_draws) * counts
        # the first row is the share itself, the others are drawn
        self._weights = np.vstack([counts, draws])
        self._whole = np.maximum(self._excess(before), 1e-12)
        self._kept = [self._excess(one) for one in (before, *(stage.now for stage in stages))]
        self._first = next((k for k, stage in enumerate(stages) if stage.without), len(stages))
        refitted = next((s.alone for s in stages if s.kind == "parameters" and s.alone), None)
        whole = (self._excess(refitted) if refitted else self._kept[self._first]) - self._kept[-1]
        none = np.zeros(len(self._weights))
        takes = [
            np.maximum(whole + self._excess(stage.without) - self._excess(stage.alone), 0.0)
            if stage.alone and stage.without
            else none
            for stage in stages[self._first :]
        ]
        total = sum(takes, none)
        # names of which none takes anything have equal parts
        alike = 1.0 / max(1, sum(stage.without is not None for stage in stages))
        self._parts = [
            np.where(total > 1e-12, one / np.maximum(total, 1e-12), alike * bool(stage.without))
            for one, stage in zip(takes, stages[self._first :], strict=True)
        ]

    def _excess(self, one: Excess) -> Array:
        """Excess variance beyond the noise, as it is and in each draw."""
        return np.asarray(self._weights @ np.array([ratio - 1.0 for ratio, _ in one.pieces]))

    def of(self, k: int) -> tuple[float, list[float]]:
        """Share of a term: what it takes after the one before it; several names divide what all of
        them take.
        """
        if k < self._first:
            return self._told(self._kept[k] - self._kept[k + 1])
        taken = self._kept[self._first] - self._kept[-1]
        return self._told(taken * self._parts[k - self._first])

    def unexplained(self) -> tuple[float, list[float]]:
        """Share of what no term takes."""
        return self._told(self._kept[-1])

    def _told(self, taken: Array) -> tuple[float, list[float]]:
        shares = taken / self._whole
        low, high = np.quantile(shares[1:], [0.025, 0.975])
        return float(shares[0]), [float(low), float(high)]
