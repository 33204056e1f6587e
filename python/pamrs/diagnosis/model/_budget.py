"""Mismatch budget of each block: shares of the nominal model's excess that each term takes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import FittedHypothesis, Judged, significant
from pamrs.diagnosis.fit import (
    Events,
    Key,
    Problem,
    Residuals,
    Stages,
    acts_in,
    concerns,
    form_in,
    known_parameters,
    residuals,
    with_effects_of,
    with_known,
    without_term,
)
from pamrs.diagnosis.noise import Excess, NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import Term, effect_of, find_parameter
from pamrs.errors import SimulationError
from pamrs.findings import BudgetTerm, EffectParameterFound
from pamrs.rig import Parameter, Rig

# weightings of pieces for a share's interval: ten of them lie beyond each 95 % end
_BUDGET_DRAWS = 400
DETERMINED_SHARE = 0.7
"""Standard deviation [tolerances] below which the recordings determine a parameter."""


_NAMED = ("wrong_parameter", "effect")
"""Kinds of terms that a name stands for."""


@dataclass(frozen=True)
class _Step:
    """One step of the budget of a group, and what the blocks keep with it.

    Attributes
    ----------
    kind : str
        Of the step.
    terms : tuple of Term
        What it adds to the model: an effect, or all wrong parameters; none for what has no name.
    now : dict
        What the blocks keep with it and all terms before it.
    change : dict or None
        Of a name, what the final model predicts with it beyond what it predicts without it; None
        where that model leaves its range.
    """

    kind: str
    terms: tuple[Term, ...]
    now: Residuals
    change: Residuals | None = None


def budget(
    judged: list[Judged],
    problem: Problem,
    by_stage: Stages,
    noise_level: dict[Key, NoiseLevel],
    nominal: Rig,
    final: Rig,
    events: Events | None = None,
) -> list[BudgetTerm]:
    """The budget of every block whose nominal model leaves more than noise.

    All terms have the values of the final model, those of the parameters as well: parameters that
    are fitted without a name bend towards what is missing. Parameters inside their tolerances take
    what they take by themselves, what is named takes what the final model takes beyond that.
    Several names divide it in proportion to the squares of what each changes in the prediction.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts.
    problem : Problem
        Held-out recordings (those that were fitted, where there are no others).
    by_stage : dict of str to dict
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
    bare = _without_held(problem, nominal, by_stage["before"])
    for one in judged:
        steps = _steps(one, problem, by_stage, nominal, final, events)
        for block in one.group.blocks:

            def excess_of(residual: Residuals, block: Block = block) -> Excess:
                return excess(block, problem.recordings, residual, noise_level, problem.settings)

            acting = [(e, r) for e, r in bare if e is None or acts_in(e, block)]
            before = excess_of(acting[0][1])
            if not significant(before):
                continue
            stages = [
                _Stage("held", (e,), excess_of(now)) for e, now in acting[1:] if e is not None
            ]
            for step in steps:
                acts = not step.terms or any(concerns(term, block) for term in step.terms)
                change = excess_of(step.change) if step.change and acts else None
                stages.append(_Stage(step.kind, step.terms, excess_of(step.now), acts, change))
            shares = _Shares(before, stages, problem.settings)
            terms += _terms(block, shares, stages, one, owners, final)
    return terms


@dataclass(frozen=True)
class _Stage:
    """Step of one block's budget against the noise; `acts` is true where the step acts there."""

    kind: str
    terms: tuple[Term, ...]
    now: Excess
    acts: bool = True
    change: Excess | None = None


def _steps(
    judged: Judged,
    problem: Problem,
    by_stage: Stages,
    nominal: Rig,
    final: Rig,
    events: Events | None,
) -> list[_Step]:
    """The steps of a group after what the nominal model holds."""
    names = _in_order(judged)
    form = [] if judged.form is None else [_Step("form", (), by_stage["after"])]
    if not names:
        return [_Step("parameters", (), by_stage["refit"]), *form]
    part = replace(problem, blocks=judged.group.blocks)
    known = known_parameters(nominal)
    if judged.form is not None:
        final = _without_form(judged, final)

    @cache
    def with_terms(present: tuple[tuple[Term, ...], ...]) -> Residuals | None:
        if present == names and not form:
            return by_stage["after"]
        happened = events if events is not None and (events.effect,) in present else None
        lacking = [term for terms in names if terms not in present for term in terms]
        rig = _without_terms(lacking, known, final)
        try:
            return residuals(part, rig, (), happened)
        except SimulationError:  # without the others the model leaves its range
            return None

    steps = [_Step("parameters", (), with_terms(()) or by_stage["refit"])]
    for n, terms in enumerate(names):
        now = with_terms(names[: n + 1]) or steps[-1].now
        without = with_terms((*names[:n], *names[n + 1 :])) if len(names) > 1 else None
        whole = with_terms(names)
        change = _difference(whole, without) if whole and without else None
        kind = "effect" if terms[0].is_effect else "wrong_parameter"
        steps.append(_Step(kind, terms, now, change))
    return [*steps, *form]


def _difference(one: Residuals, other: Residuals) -> Residuals:
    """Difference of two models' predictions, by block and recording."""
    return {
        key: replace(r, value=np.where(r.rows, other[key].value - r.value, 0.0))
        for key, r in one.items()
        if key in other
    }


def _without_form(judged: Judged, final: Rig) -> Rig:
    """The final model with what a group names as it was fitted without a form."""
    assert judged.form is not None
    alone = judged.named_alone.fit
    for term in judged.form.effects:
        final = without_term(final, term)
    rig = with_effects_of(final, alone.rig, {entry["id"] for entry in final.effects})
    return with_known(rig, {name: alone.values[name] for name in alone.moved})


def _without_terms(terms: Sequence[Term], known: Mapping[str, Parameter], final: Rig) -> Rig:
    """The final model without some terms: parameters have their nominal values."""
    for term in terms:
        if term.is_effect:
            final = without_term(final, term)
    return with_known(final, {t.id: known[t.id].value for t in terms if t.is_value})


def _without_held(
    problem: Problem, nominal: Rig, before: dict[Key, Residual]
) -> list[tuple[Term | None, dict[Key, Residual]]]:
    """The residuals of the nominal model without the effects that it holds (of None), then with one
    id of them after the other.
    """
    ids = list(dict.fromkeys(entry["id"] for entry in nominal.effects))
    out: list[tuple[Term | None, dict[Key, Residual]]] = []
    rig, now = nominal, before
    try:
        for later in reversed(ids):
            out.insert(0, (Term(later), now))
            rig = rig.without_effect(later)
            now = residuals(problem, rig)
    except SimulationError:  # without it the model leaves its range: nothing to compare with
        return [(None, before)]
    return [(None, now), *out]


def _in_order(judged: Judged) -> tuple[tuple[Term, ...], ...]:
    """Terms that a group names in steps: all wrong parameters, then effects, best alone first."""
    alone = {
        c.effects[0]: sum(e.ratio for e in c.held_out_excess.values())
        for c in judged.group.candidates
        if len(c.effects) == 1
    }
    wrong = [tuple(map(Term, judged.wrong))] if judged.wrong else []
    effects = sorted(judged.named, key=lambda effect: alone.get(effect, np.inf))
    return (*wrong, *((effect,) for effect in effects))


def _terms(
    block: Block,
    shares: _Shares,
    stages: list[_Stage],
    judged: Judged,
    owners: Mapping[Term, Judged],
    final: Rig,
) -> Iterator[BudgetTerm]:
    """The terms of one block, and what is left; ``owners`` are the groups whose values of an effect
    the final model has.
    """
    for k, stage in enumerate(stages):
        terms, now = stage.terms, stage.now
        share, interval = shares.of(k)
        if not stage.acts and share == 0.0:
            continue
        named = terms and stage.kind != "held"
        first = terms[0] if terms else Term("")
        at = first.at or next((e.get("at", "") for e in final.effects if e["id"] == first.id), "")
        yield BudgetTerm(
            block=block.name,
            kind=stage.kind,
            id="+".join(term.id for term in terms),
            form=form_in(final, first),
            share=share,
            interval=interval,
            probability=min(map(judged.probability, terms)) if named else None,
            noises=now.systematic,
            size=now.systematic * now.noise,
            unit=unit_of(block.channel),
            at=at,
            parameters=_values(terms, owners.get(first, judged)),
        )
    was = stages[-1].now
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


def _values(terms: Sequence[Term], judged: Judged) -> dict[str, EffectParameterFound]:
    """Fitted values of a step's effect or wrong parameters, SI."""
    fitted = judged.chosen.fit
    out = {}
    for name, value in fitted.values.items():
        effect = effect_of(name)
        if effect is not None and effect in terms:
            key = name.removeprefix(f"{effect}.")
            form = effect.info.form(form_in(fitted.rig, effect))
            unit = next((p.unit for p in form.parameters if p.name == key), "")
        elif Term(name) in terms:
            key = name
            unit = (find_parameter(name) if effect else fitted.rig.parameter(name)).unit
        else:
            continue
        std = fitted.std.get(name, math.inf)
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
        draws = rng.dirichlet(np.ones(counts.size), _BUDGET_DRAWS) * counts
        # the first row is the share itself, the others are drawn
        self._weights = np.vstack([counts, draws])
        self._whole = np.maximum(self._excess(before), 1e-12)
        self._kept = [self._excess(one) for one in (before, *(stage.now for stage in stages))]
        names = [k for k, stage in enumerate(stages) if stage.kind in _NAMED]
        acting = any(stages[k].acts for k in names)
        self._first, self._end = (names[0], names[-1] + 1) if acting else (len(stages),) * 2
        self._parts = self._divided(stages[self._first : self._end])

    def _excess(self, one: Excess, noise: float = 1.0) -> Array:
        """Excess variance beyond a variance of noise, as it is and in each draw."""
        return np.asarray(self._weights @ np.array([ratio - noise for ratio, _ in one.pieces]))

    def _divided(self, names: list[_Stage]) -> list[Array]:
        """Shares of names in what they take together, by the squares of what each changes in the
        prediction; equal where a name cannot be taken away, none where it does not act.
        """
        none = np.zeros(len(self._weights))
        changes = [
            none if one.change is None else self._excess(one.change, noise=0.0) for one in names
        ]
        total = np.sum([none, *changes], axis=0)
        # a single name, and names of which one cannot be taken away, have equal parts
        known = all(one.change is not None for one in names if one.acts) & (total > 1e-12)
        alike = 1.0 / max(1, sum(one.acts for one in names))
        return [
            np.where(known, change / np.maximum(total, 1e-12), alike * one.acts)
            for change, one in zip(changes, names, strict=True)
        ]

    def of(self, k: int) -> tuple[float, list[float]]:
        """Share of a term: what it takes after the one before it; names divide what all of them
        take.
        """
        if not self._first <= k < self._end:
            return self._with_interval(self._kept[k] - self._kept[k + 1])
        taken = self._kept[self._first] - self._kept[self._end]
        return self._with_interval(taken * self._parts[k - self._first])

    def unexplained(self) -> tuple[float, list[float]]:
        """Share of what no term takes."""
        return self._with_interval(self._kept[-1])

    def _with_interval(self, taken: Array) -> tuple[float, list[float]]:
        shares = taken / self._whole
        low, high = np.quantile(shares[1:], [0.025, 0.975])
        return float(shares[0]), [float(low), float(high)]


def owners_of_parameters(candidates: list[FittedHypothesis]) -> dict[str, int]:
    """Number of the group that determines each parameter best, where several have it (sensors'
    zeros): the one with the least standard deviation; of those that tell hardly more than the file,
    the last one along the chain, whose output it is.

    What a group leaves without a name is in its autocorrelation, and so in its standard deviations.
    A group with events keeps all values that it moved: its events were fitted with them.
    """

    def spread(k: int, name: str) -> float:
        fitted = candidates[k].fit
        std = fitted.std.get(name, math.inf) if fitted.events is None else 0.0
        return min(std, DETERMINED_SHARE * fitted.scales[name]) if name in fitted.scales else std

    owners: dict[str, int] = {}
    for k, candidate in enumerate(candidates):
        for name in candidate.fit.moved:
            if spread(k, name) <= spread(owners.get(name, k), name):
                owners[name] = k
    return owners


def owners_of_effects(candidates: list[FittedHypothesis]) -> dict[Term, int]:
    """Number of the group that determines each effect best, where several have it (a clock moves
    what arm and chamber see): the one with the least mean logarithm of standard deviations.
    """
    owners: dict[Term, int] = {}
    for k, candidate in enumerate(candidates):
        for effect in candidate.effects:
            last = candidates[owners.get(effect, k)]
            if _doubt(candidate, effect) <= _doubt(last, effect):
                owners[effect] = k
    return owners


def _doubt(candidate: FittedHypothesis, effect: Term) -> float:
    """Mean logarithm of the standard deviations of an effect's parameters, in typical sizes."""
    std = candidate.fit.std
    logs = []
    for name in candidate.fit.values:
        if effect_of(name) == effect:
            parameter = find_parameter(name)
            size = max(abs(s) for s in (parameter.default, *parameter.starts))
            spread = std[name] / size if size > 0.0 else std[name]
            logs.append(math.log(spread) if spread > 0.0 else math.inf)
    return sum(logs) / len(logs) if logs else -math.inf
