"""The mismatch budget of each block: what of the nominal model's excess over the noise each term
takes, and what stays unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import (
    Candidate,
    Judged,
    is_parameter,
    parts_of,
    significant,
    start_of,
)
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
    with_effects_of,
    with_known,
    without_term,
)
from pamrs.diagnosis.noise import Excess, NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import find_parameter, id_of, info_of, is_effect, place_of
from pamrs.errors import SimulationError
from pamrs.findings import BudgetTerm, EffectParameterFound
from pamrs.rig import Parameter, Rig

__all__ = ["budget"]

Array = NDArray[np.float64]
Stages = dict[str, dict[Key, Residual]]
Residuals = dict[Key, Residual]

_NAMED = ("wrong_parameter", "effect")
"""Kinds of terms that a name stands for."""


@dataclass(frozen=True)
class _Step:
    """A term of a group, and what the blocks keep with it.

    Attributes
    ----------
    kind, name : str
        Kind and name of the term.
    now : dict
        What the blocks keep with it and all terms before it.
    named : bool
        Whether it divides what several names take together.
    alone, without : dict or None
        What they keep with no other name, and with all others but it; None where no such model
        holds.
    """

    kind: str
    name: str
    now: Residuals
    named: bool = False
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
        shown = []
        for block in one.group.blocks:

            def kept(residual: Residuals | None, block: Block = block) -> Excess | None:
                if residual is None:
                    return None
                return excess(
                    block, problem.recordings, residual, noise_level, problem.settings.noise
                )

            acting = [(name, r) for name, r in bare if not name or acts_in(name, block)]
            before = _there(kept(acting[0][1]))
            if significant(before):
                shown.append((block, before, acting, kept))
        if not shown:
            continue
        others = [name for other in judged if other is not one for name in _in_order(other)]
        parts = _Parts(one, fitted, problem, found, nominal, final, events, others)
        steps, refitted = parts.steps()
        for block, before, acting, kept in shown:
            held = [_Step("held", name, now) for name, now in acting[1:]]
            stages = [
                _Stage(
                    s.kind,
                    s.name,
                    _there(kept(s.now)),
                    s.named and _concerns(s.name, block),
                    kept(s.alone),
                    kept(s.without),
                )
                for s in (*held, *steps)
            ]
            shares = _Shares(before, stages, kept(refitted), problem.settings)
            terms += _terms(block, shares, stages, one, owners, final)
    return terms


def _there(one: Excess | None) -> Excess:
    """What is known to be there."""
    if one is None:
        raise AssertionError("every term has residuals")
    return one


@dataclass(frozen=True)
class _Stage:
    """A term of one block: as in `_Step`, against its noise."""

    kind: str
    name: str
    now: Excess
    named: bool = False
    alone: Excess | None = None
    without: Excess | None = None


def _concerns(name: str, block: Block) -> bool:
    """Whether the output of a block depends on what is named."""
    if is_effect(name):
        return acts_in(name, block)
    return any(depends(block, one) for one in name.split("+"))


class _Parts:
    """What the blocks of a group keep with parts of what it names.

    Parameters
    ----------
    judged : Judged
        The group.
    fitted, problem : Problem
        The recordings that were fitted, and those that are judged.
    found : dict
        Residuals of the whole models, by stage.
    nominal, final : Rig
        The nominal model, and that with everything that was found.
    events : Events, optional
        What happened in single recordings.
    others : list of str
        What other groups name.
    """

    def __init__(
        self,
        judged: Judged,
        fitted: Problem,
        problem: Problem,
        found: Stages,
        nominal: Rig,
        final: Rig,
        events: Events | None,
        others: list[str],
    ) -> None:
        self.judged, self.found = judged, found
        self.names = _in_order(judged)
        self.blocks = judged.group.blocks
        self.fitted = replace(fitted, blocks=self.blocks)
        self.problem = replace(problem, blocks=self.blocks)
        self.nominal, self.final, self.events = nominal, final, events
        # what other groups found acts here too, whichever of the own names are there
        acting = [n for n in others if any(_concerns(n, block) for block in self.blocks)]
        self.others = [n for n in acting if n not in self.names]
        self._kept: dict[tuple[str, ...], Residuals | None] = {}

    def steps(self) -> tuple[list[_Step], Residuals | None]:
        """The terms beside what the nominal model holds; and, where several names are to be told
        apart, what parameters leave that are fitted without any of them.
        """
        found, names = self.found, self.names
        if not names:
            refit = _Step("parameters", "", found["refit"])
            if self.judged.verdict != "unlisted" or self.judged.group.closure is None:
                return [refit], None
            return [refit, _Step("form", "", found["after"])], None
        several = len(names) > 1
        steps = [_Step("parameters", "", self._by_themselves())]
        for n, name in enumerate(names):
            alone = without = None
            if several:
                alone = self.kept((name,))
                without = self.kept((*names[:n], *names[n + 1 :]))
            now = self.kept(names[: n + 1]) or steps[-1].now
            steps.append(_Step(_kind(name), name, now, several, alone, without))
        return steps, self.kept(()) if several else None

    def _by_themselves(self) -> Residuals:
        """What parameters leave with their values in the final model, without any name."""
        known = known_parameters(self.nominal, self.fitted.settings.fit)
        try:
            return residuals(self.problem, _without_names(self.names, known, self.final))
        except SimulationError:  # without the names the model leaves its range
            return self.found["refit"]

    def kept(self, present: tuple[str, ...]) -> Residuals | None:
        """What the blocks keep with some of the names, all else fitted again; None where no such
        model holds.
        """
        if present == self.names:
            return self.found["after"]
        if not present and not self.judged.wrong and not self.others:
            return self.found["refit"]
        if present not in self._kept:
            try:
                rig, happened = self._model(present)
                if happened is not None:
                    rig = rig.without_effect(happened.effect)
                self._kept[present] = residuals(self.problem, rig, (), happened)
            except SimulationError:
                self._kept[present] = None
        return self._kept[present]

    def _model(self, present: tuple[str, ...]) -> tuple[Rig, Events | None]:
        """The model with some of the names, fitted; a parameter that is wrong stays at its nominal
        value where it is not among them.
        """
        chosen = self.judged.chosen
        wrong = [one for name in present if is_parameter(name) for one in name.split("+")]
        effects = [name for name in present if is_effect(name)]
        happened = self.events if self.events and self.events.effect in effects else None
        if len(wrong) == len(chosen.wrong) and not self.others and happened is None:
            alike = [c for c in self.judged.group.candidates if self._is(c, effects, wrong)]
            if alike:
                return min(alike, key=lambda c: c.fit.cost).fit.rig, None
        settings = self.fitted.settings.fit
        lasting = [e for e in effects if happened is None or e != happened.effect]
        free, held, forms = parts_of(
            [start_of(chosen.fit, effect, settings.least_start) for effect in lasting]
        )
        known = known_parameters(self.nominal, settings)
        own = {id_of(name) for name in self.names if is_effect(name)}
        own |= {self.events.effect} if self.events else set()
        base = with_effects_of(self.nominal, self.final, own) if self.others else self.nominal
        there = known_parameters(self.final, settings)
        elsewhere = [n for name in self.others if is_parameter(name) for n in name.split("+")]
        found = fit(
            self.fitted,
            base,
            tuple(lasting),
            free,
            chosen.fit.inflation,
            fixed=held,
            warm=chosen.fit,
            events=happened,
            evaluations=settings.polish_evaluations,
            settled={n: known[n].value for n in chosen.wrong if n not in wrong}
            | {n: there[n].value for n in elsewhere},
            freed=wrong,
            forms=forms,
        )
        return found.rig, happened

    def _is(self, candidate: Candidate, effects: list[str], wrong: list[str]) -> bool:
        """Whether a candidate has these names, in the forms of the one that was chosen."""
        return (
            set(candidate.effects) == set(effects)
            and set(candidate.wrong) == set(wrong)
            and candidate.fit.events is None
            and all(
                form_in(candidate.fit.rig, e) == form_in(self.judged.chosen.fit.rig, e)
                for e in effects
            )
        )


def _without_names(names: tuple[str, ...], known: Mapping[str, Parameter], final: Rig) -> Rig:
    """The final model without what is named: effects, wrong parameters joined by ``+``."""
    back: dict[str, float] = {}
    for name in names:
        if is_parameter(name):
            back |= {n: known[n].value for n in name.split("+")}
        else:
            final = without_term(final, name)
    return with_known(final, back)


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
    shares: _Shares,
    stages: list[_Stage],
    judged: Judged,
    owners: Mapping[str, Judged],
    final: Rig,
) -> Iterator[BudgetTerm]:
    """The terms of one block, and what is left; ``owners`` are the groups whose values of an effect
    the final model has.
    """
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
            there = find_parameter(full) if is_effect(own) else found.rig.parameter(full)
            key, unit = full, there.unit
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
    refitted : Excess or None
        What parameters leave that are fitted without a name, where several names are told apart.
    settings : DiagnosisSettings
        Seed and number of draws.
    """

    def __init__(
        self,
        before: Excess,
        stages: list[_Stage],
        refitted: Excess | None,
        settings: DiagnosisSettings,
    ) -> None:
        counts = np.array([n for _, n in before.pieces], dtype=np.float64)
        rng = np.random.default_rng(settings.seed)
        draws = rng.dirichlet(np.ones(counts.size), settings.verdict.budget_draws) * counts
        # the first row is the share itself, the others are drawn
        self._weights = np.vstack([counts, draws])
        self._whole = np.maximum(self._excess(before), 1e-12)
        self._kept = [self._excess(one) for one in (before, *(stage.now for stage in stages))]
        # names divide what they take together; where none of them acts here, each takes its own
        names = [k for k, stage in enumerate(stages) if stage.kind in _NAMED]
        divided = any(stage.named for stage in stages)
        self._first = names[0] if names and divided else len(stages)
        self._parts = self._divided(stages[self._first :], refitted)

    def _excess(self, one: Excess) -> Array:
        """Excess variance beyond the noise, as it is and in each draw."""
        return np.asarray(self._weights @ np.array([ratio - 1.0 for ratio, _ in one.pieces]))

    def _divided(self, stages: list[_Stage], refitted: Excess | None) -> list[Array]:
        """Parts of names in what they take together, by the mean of what each takes alone and of
        what is left without it, as far as models of both hold; names that do not act here have
        none.
        """
        after, none = self._kept[-1], np.zeros(len(self._weights))
        takes = []
        for stage in stages:
            each = []
            if stage.named and stage.alone is not None and refitted is not None:
                each.append(self._excess(refitted) - self._excess(stage.alone))
            if stage.named and stage.without is not None:
                each.append(self._excess(stage.without) - after)
            takes.append(np.maximum(np.mean(each, axis=0), 0.0) if each else none)
        total = np.sum([none, *takes], axis=0)
        together = self._kept[self._first] - after
        # where no name takes anything, or they predict worse together, all have equal parts
        told = (total > 1e-12) & (together > 0.0)
        alike = 1.0 / max(1, sum(stage.named for stage in stages))
        return [
            np.where(told, one / np.maximum(total, 1e-12), alike * stage.named)
            for one, stage in zip(takes, stages, strict=True)
        ]

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
