"""Attempts at hypotheses: their fits to the recordings, and what these leave."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TypeVar

import numpy as np

from pamrs.channels import block_of, channel_of
from pamrs.diagnosis.evidence import (
    BlockLikelihood,
    FittedHypothesis,
    Likelihood,
    misses_only_held_out,
    significant,
)
from pamrs.diagnosis.fit import (
    FINAL_STEP_SHARE,
    LEAST_STEP_SHARE,
    Events,
    Fit,
    Inflation,
    Key,
    Problem,
    Start,
    fit,
    fit_events,
    free_baseline,
    known_parameters,
    look_for_events,
    parts_of,
    places_of,
    predicted_by_others,
    predicted_with_doubt,
    refit_events,
    residuals,
    start_of,
    with_effects_of,
    without_term,
)
from pamrs.diagnosis.noise import (
    CORRELATED_VARIANCE,
    Excess,
    NoiseLevel,
    excess,
    inflation_of,
    no_inflation,
)
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.search._closure import SHORT_EVALUATIONS, find_closure
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import Term, effect_of, ports_of
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.simulation import core_rig

# share of impossible pressures behind a late gauge: slopes at smoothed edges are too large
_EMPTIER_SHARE = 0.05
# share of the highest pressure that is below ambient: a capillary's were by 13 to 16 %
_EMPTIER_PART = 0.02
_SEALED_EVALUATIONS = 30  # evaluations of a fit for a rig without a valve, which are cheap
_POLISH_EVALUATIONS = 10  # evaluations of the last stretch of a fit (decision 22)
# fits of a set weighted by what it leaves, while correlated variance falls (decision 103), and
# turns in which events and the effects with them are fitted
_MOST_TURNS = 4
_LEAST_TURN = 0.8  # share of the sum of squares above which a further turn is not worth it
# alternatives of a kind that are followed: starts of an effect, singles and their partners
# (decision 13), pairs of parameters, those at their walls (decision 25)
BEAM = 2


Found = TypeVar("Found")


@dataclass(frozen=True, eq=False)
class Attempts:
    """Fits of hypotheses to the recordings of one model, and what these leave of them.

    Attributes
    ----------
    fit_problem, held_out_problem : Problem
        Recordings to fit and held-out ones (the same recordings where there are no others).
    nominal : Rig
        The model of the rig file, to which hypotheses add.
    noise_level : dict
        Noise levels by block and recording, of all recordings.
    baseline_excess : dict of str to Excess
        By block, what the refitted baseline leaves of held-out recordings; without any, of each
        recording as predicted by the others. The shares of it that fits remove are compared.
    suspects : list of Block
        Blocks that keep an excess after the refit.
    """

    fit_problem: Problem
    held_out_problem: Problem
    nominal: Rig
    noise_level: dict[Key, NoiseLevel]
    baseline_excess: dict[str, Excess]
    suspects: list[Block]

    @property
    def settings(self) -> DiagnosisSettings:
        """Settings of the diagnosis."""
        return self.fit_problem.settings

    @property
    def compared(self) -> list[Block]:
        """Blocks with an excess and others of their kind, by which hypotheses are compared."""
        kinds = {channel_of(b.name) for b in self.suspects}
        return [b for b in self.fit_problem.blocks if channel_of(b.name) in kinds]

    @property
    def nominal_effects(self) -> set[str]:
        """Ids of the effects that the nominal model has already."""
        return {entry["id"] for entry in self.nominal.effects}

    @property
    def no_inflation(self) -> dict[str, float]:
        """Inflation of blocks whose residual has no autocorrelation: 1 for each."""
        return no_inflation(self.fit_problem.blocks)

    @cached_property
    def likelihood(self) -> Likelihood:
        """Likelihood of what a hypothesis leaves of all recordings, fitted and held out."""
        held_out = [] if self.nothing_held_out else self.held_out_problem.recordings
        recordings = [*self.fit_problem.recordings, *held_out]
        return Likelihood(self.fit_problem.blocks, recordings, self.noise_level)

    def likelihood_of(
        self, fit_residuals: Mapping[Key, Residual], held_out_residuals: Mapping[Key, Residual]
    ) -> Callable[[], Mapping[str, BlockLikelihood]]:
        """Likelihood of a hypothesis's residuals by block, worked out when it is asked for.

        Where no recording is held out it is that of the fitted residuals: what others predict of
        each recording does not enter.
        """
        every = fit_residuals if self.nothing_held_out else {**fit_residuals, **held_out_residuals}
        return cache(partial(self.likelihood.of, every))

    @property
    def nothing_held_out(self) -> bool:
        """True where no recording is held out."""
        return self.held_out_problem.recordings is self.fit_problem.recordings

    def inflation_of(self, fitted: Fit) -> Inflation:
        """Inflation by the autocorrelation that a fit leaves, at the least that of the noise."""
        return inflation_of(self.fit_problem, fitted, self.noise_level)

    def starts_of(self, candidate: FittedHypothesis) -> list[Start]:
        """Starts of another fit from each effect of a candidate."""
        return [start_of(candidate.fit, effect) for effect in candidate.effects]

    def fit_events(self, effect: Term, candidate: FittedHypothesis) -> FittedHypothesis | None:
        """Fit an effect with times of its own in every recording, next to a candidate's effects."""
        if effect.id in {e.id for e in candidate.effects}:
            return None  # it would replace what it is to happen with
        if candidate.fit.events is not None or candidate.wrong:
            return None  # what happens with other events, or wrong values, is not fitted
        stiffest = LEAST_STEP_SHARE * self.fit_problem.core.stable_step
        if core_rig(candidate.fit.rig, self.fit_problem.core).stable_step < stiffest:
            return None  # it would take too long
        return self._attempt(
            (*candidate.terms, effect), lambda: self._fit_events(effect, candidate)
        )

    def _fit_events(self, effect: Term, candidate: FittedHypothesis) -> FittedHypothesis | None:
        no_inflation = self.no_inflation
        model = with_effects_of(self.nominal, candidate.fit.rig, self.nominal_effects)
        fitted = fit_events(effect, self.fit_problem, model, candidate.fit, no_inflation)
        if fitted is None:
            return None
        if candidate.effects:
            fitted = self._fit_in_turn(fitted, candidate, no_inflation)
        elif (left := self.inflation_of(fitted)).largest > CORRELATED_VARIANCE:
            fitted = refit_events(fitted, self.fit_problem, model, candidate.fit, left)
        effects = (*candidate.effects, effect)
        if self.nothing_held_out:
            return self.assess(effects, fitted)
        bare = without_term(fitted.rig, effect)
        without = residuals(self.held_out_problem, bare)
        form = fitted.events.form if fitted.events else ""
        known = {n: fitted.values[f"{effect}.{n}"] for n in effect.info.form(form).shared}
        events = look_for_events(
            effect, self.held_out_problem, bare, without, no_inflation, known, form
        )
        if events is None:
            return self.assess(effects, fitted, without)
        everywhere = replace(
            fitted,
            events=replace(
                events,
                values=fitted.events.values | events.values if fitted.events else events.values,
            ),
        )
        return self.assess(
            effects, everywhere, residuals(self.held_out_problem, bare, events=events)
        )

    def _fit_in_turn(
        self, fitted: Fit, candidate: FittedHypothesis, inflation: dict[str, float]
    ) -> Fit:
        """Refit the persistent effects of a candidate with its events, then look for the events
        anew with these, as long as either leaves much less: effects that were fitted without the
        events had followed them.
        """
        last = self._refit_around_events(fitted, candidate, inflation)
        for _ in range(_MOST_TURNS):
            assert last.events is not None
            bare = without_term(last.rig, last.events.effect)
            model = with_effects_of(self.nominal, bare, self.nominal_effects)
            found = residuals(self.fit_problem, bare, list(candidate.fit.moved))
            known = replace(last, effects=candidate.effects, rig=bare, residuals=found, events=None)
            again = fit_events(last.events.effect, self.fit_problem, model, known, inflation)
            if again is None:
                return last
            before = last
            last = self._refit_around_events(again, replace(candidate, fit=known), inflation)
            if last.cost > _LEAST_TURN * before.cost:
                return min(last, before, key=lambda one: one.cost)
        return last

    def _refit_around_events(
        self, fitted: Fit, candidate: FittedHypothesis, inflation: dict[str, float]
    ) -> Fit:
        """Refit the persistent effects of a candidate while the events stay as they are."""
        assert fitted.events is not None
        effect = fitted.events.effect
        warm = replace(
            candidate.fit,
            values=candidate.fit.values | {n: fitted.values[n] for n in candidate.fit.moved},
        )
        again = self._fit(
            self.starts_of(candidate),
            inflation,
            warm,
            events=fitted.events,
            evaluations=SHORT_EVALUATIONS,
        )
        names = [n for n in fitted.values if effect_of(n) == effect]
        return replace(
            again,
            effects=(*candidate.effects, effect),
            rig=fitted.events.put_into(again.rig, next(iter(fitted.events.values))),
            values=again.values | {n: fitted.values[n] for n in names},
            std=again.std | {n: fitted.std[n] for n in names},
        )

    def excess(
        self, block: Block, problem: Problem, block_residuals: dict[Key, Residual]
    ) -> Excess:
        """Excess over the noise of a block's residual in the recordings of a problem."""
        return excess(block, problem.recordings, block_residuals, self.noise_level, self.settings)

    def assess(
        self,
        effects: tuple[Term, ...],
        fitted: Fit,
        held_out_residuals: dict[Key, Residual] | None = None,
    ) -> FittedHypothesis:
        """A fit with its excess over the noise, in the recordings that were fitted and in held-out
        ones; without any, in each recording as the others predict it.
        """
        blocks = self.fit_problem.blocks
        fit_excess = {b.name: self.excess(b, self.fit_problem, fitted.residuals) for b in blocks}
        if held_out_residuals is None:
            held_out_residuals = (
                predicted_by_others(self.fit_problem, fitted, self.inflation_of(fitted))
                if self.nothing_held_out
                else residuals(self.held_out_problem, fitted.rig)
            )
        held_out_excess = {
            b.name: self.excess(b, self.held_out_problem, held_out_residuals) for b in blocks
        }
        if fitted.events is None and misses_only_held_out(
            fit_excess, held_out_excess, nothing_held_out=self.nothing_held_out
        ):
            held_out_residuals = predicted_with_doubt(self.held_out_problem, fitted)
            held_out_excess = {
                b.name: self.excess(b, self.held_out_problem, held_out_residuals) for b in blocks
            }
        gaps = [
            (
                self.baseline_excess[b.name].ratio - 1.0,
                max(0.0, held_out_excess[b.name].ratio - 1.0),
            )
            for b in self.suspects
        ]
        total = sum(math.sqrt(max(0.0, g)) for g, _ in gaps)
        gap = 1.0 - sum(math.sqrt(a) for _, a in gaps) / total if total > 0 else 0.0
        return FittedHypothesis(
            effects,
            fitted,
            held_out_excess,
            fit_excess,
            gap,
            log_places=sum(math.log(len(self.terms_of(e.id))) for e in effects),
            likelihood=self.likelihood_of(fitted.residuals, held_out_residuals),
        )

    def fit_form(
        self,
        base: FittedHypothesis,
        inflation: dict[str, float],
        blocks: list[Block],
        say: Callable[[str], None],
    ) -> FittedHypothesis | None:
        """Fit a form of what a baseline leaves of some blocks, or names, which are refitted with
        it; None where there is none, or the model cannot be run with it.
        """
        try:
            closure = find_closure(
                self.fit_problem,
                self.nominal,
                base.fit,
                inflation,
                blocks,
                say,
                self.noise_level,
            )
            return None if closure is None else self.assess(closure.effects, closure)
        except SimulationError:
            return None

    def terms_of(self, effect: str) -> list[Term]:
        """Terms of an effect: everywhere, and at each place that the blocks can distinguish."""
        places = places_of(self.nominal, effect, self.fit_problem.blocks)
        return [Term(effect, at) for at in ("", *places)]

    def fit_effects(
        self, starts: list[Start], warm: Fit, inflation: dict[str, float]
    ) -> FittedHypothesis | None:
        """Fit effects from one start each, residuals inflated by their own autocorrelation; None
        where the model cannot be run.
        """
        effects = tuple(start.effect for start in starts)
        if not self.nominal_effects.isdisjoint(e.id for e in effects):
            return None  # it would replace what the model has
        settings, sealed = self.settings, self.nominal.model["valve"] is None
        limit = _SEALED_EVALUATIONS if sealed else settings.effect_evaluations

        def fit_and_assess() -> FittedHypothesis:
            best = self._fit(starts, inflation, warm, evaluations=limit)
            inflation_left = self.inflation_of(best)
            if inflation_left.largest > CORRELATED_VARIANCE:
                again = [start_of(best, effect) for effect in effects]
                best = self._fit(again, inflation_left, best, evaluations=limit)
            return self.assess(effects, best)

        return self._attempt(effects, fit_and_assess)

    def fit_shortly(
        self, starts: list[Start], warm: Fit, wrong: tuple[str, ...] = ()
    ) -> FittedHypothesis | None:
        """Fit effects and freed parameters in a few steps: enough to see which of many sets are
        worth a whole fit; None where the model cannot be run.
        """
        effects = tuple(start.effect for start in starts)
        if not self.nominal_effects.isdisjoint(e.id for e in effects):
            return None

        def fit_and_assess() -> FittedHypothesis:
            short = self._fit(
                starts, self.no_inflation, warm, wrong=wrong, evaluations=SHORT_EVALUATIONS
            )
            return replace(self.assess(effects, short), wrong=wrong)

        return self._attempt((*effects, *wrong), fit_and_assess)

    def _attempt(self, terms: Iterable[object], work: Callable[[], Found]) -> Found | None:
        """Run an attempt at a hypothesis; None where it leaves the model's range or fails."""

        def in_range() -> Found | None:
            try:
                return work()
            except SimulationError:
                return None

        return self.fit_problem.losses.part(
            f"the hypothesis {' + '.join(map(str, terms))}", in_range
        )

    def _fit(
        self,
        starts: list[Start],
        inflation: dict[str, float],
        warm: Fit,
        *,
        wrong: Collection[str] = (),
        events: Events | None = None,
        evaluations: int | None = None,
        share: float | None = None,
    ) -> Fit:
        """Fit effects from a start of each, with the baseline from where another fit left it and
        some parameters freed; the rest as in :func:`pamrs.diagnosis.fit.fit`.
        """
        free, fixed, forms = parts_of(starts)
        fitted = fit(
            self.fit_problem,
            self.nominal,
            tuple(start.effect for start in starts),
            free,
            inflation,
            fixed=fixed,
            warm=warm,
            events=events,
            evaluations=evaluations,
            share=share,
            freed=wrong,
            forms=forms,
        )
        if _emptier_than_empty(self.fit_problem, fitted):
            raise SimulationError("a pressure behind a slow gauge is below the ambient")
        return fitted

    def _fit_alone(self, names: tuple[str, ...]) -> Fit:
        """Fit freed parameters in a few steps from nominal values of all others.

        The others belong there if these are the wrong ones; fitted freely from the start, they soon
        reach their walls.
        """
        known = known_parameters(self.nominal)
        others = [n for n in free_baseline(self.fit_problem, self.nominal) if n not in names]
        return fit(
            self.fit_problem,
            self.nominal,
            (),
            {},
            self.no_inflation,
            freed=names,
            settled={n: known[n].value for n in others},
            evaluations=SHORT_EVALUATIONS,
        )

    def fit_freed_shortly(self, names: tuple[str, ...]) -> FittedHypothesis | None:
        """Fit the baseline with some parameters freed in a few steps, from where these go alone:
        enough to see which of many are worth a whole fit.
        """

        def fit_and_assess() -> FittedHypothesis:
            short = fit(
                self.fit_problem,
                self.nominal,
                (),
                {},
                self.no_inflation,
                warm=self._fit_alone(names),
                freed=names,
                evaluations=SHORT_EVALUATIONS,
            )
            return replace(self.assess((), short), wrong=names)

        return self._attempt(names, fit_and_assess)

    def fit_freed(
        self, names: tuple[str, ...], baseline: Fit, share: float | None = None
    ) -> FittedHypothesis | None:
        """Fit the baseline to its end with some parameters freed from their tolerance; None where
        it cannot be run.

        It begins where these go alone; and, where that leaves more than noise, at the values of the
        baseline as well, of which the better one is taken. ``share`` is the share of the sum of
        squares below which a step is not worth it, other than the usual one.
        """
        least = FINAL_STEP_SHARE if share is None else share

        def fitted(inflation: dict[str, float], warm: Fit) -> Fit:
            return fit(
                self.fit_problem,
                self.nominal,
                (),
                {},
                inflation,
                warm=warm,
                freed=names,
                evaluations=self.settings.baseline_evaluations,
                share=least,
            )

        def fit_and_assess(alone: bool) -> FittedHypothesis:
            first = fitted(self.no_inflation, self._fit_alone(names) if alone else baseline)
            inflation = self.inflation_of(first)
            correlated = inflation.largest > CORRELATED_VARIANCE
            assessed = self.assess((), fitted(inflation, first) if correlated else first)
            return replace(assessed, wrong=names)

        best: FittedHypothesis | None = None
        for alone in (True, False):
            assessed = self._attempt(names, partial(fit_and_assess, alone))
            if assessed is None:
                continue
            if best is None or assessed.misfit < best.misfit:
                best = assessed
            if not any(significant(e) for e in best.fit_excess.values()):
                break
        return best

    def fit_together(
        self, starts: list[Start], warm: Fit, wrong: tuple[str, ...] = ()
    ) -> FittedHypothesis | None:
        """Fit effects, each from a start, with some parameters freed from their tolerance; None
        where the model cannot be run, or where these parameters stay inside their tolerances.
        """
        if not wrong:
            return self.fit_effects(starts, warm, self.no_inflation)
        limit = self.settings.effect_evaluations
        names = (*(start.effect for start in starts), *wrong)
        candidate = self._attempt(names, lambda: self._continue(starts, warm, wrong, limit))
        if candidate is None or not candidate.is_wrong(self.settings.most_tolerances):
            return None
        return candidate

    def _continue(
        self,
        starts: list[Start],
        warm: Fit,
        wrong: tuple[str, ...],
        evaluations: int,
        share: float | None = None,
    ) -> FittedHypothesis:
        """Continue a fit of effects and freed parameters until its inflation stops falling."""
        effects = tuple(start.effect for start in starts)
        inflation, fitted = self.inflation_of(warm), warm
        for _ in range(_MOST_TURNS):
            fitted = self._fit(
                starts, inflation, fitted, wrong=wrong, evaluations=evaluations, share=share
            )
            inflation_left = self.inflation_of(fitted)
            if not any(
                CORRELATED_VARIANCE * now < inflation[b] for b, now in inflation_left.items()
            ):
                break  # it leaves not much less than it was inflated by
            inflation, starts = (
                inflation_left,
                [start_of(fitted, effect) for effect in effects],
            )
        return replace(self.assess(effects, fitted), wrong=wrong)

    def fit_united(self, candidates: list[FittedHypothesis]) -> Fit | None:
        """Fit all that several hypotheses name, each for its own block; None where it fails."""
        if any(c.fit.events is not None for c in candidates):
            return None
        starts = [start for c in candidates for start in self.starts_of(c)]
        wrong = [name for c in candidates for name in c.wrong]
        warm = replace(
            candidates[0].fit,
            values=candidates[0].fit.values
            | {n: c.fit.values[n] for c in candidates for n in c.wrong},
        )
        names = (*(start.effect for start in starts), *wrong)
        return self._attempt(
            names,
            lambda: self._fit(starts, self.no_inflation, warm, wrong=wrong, share=FINAL_STEP_SHARE),
        )

    def polish(self, candidate: FittedHypothesis) -> FittedHypothesis:
        """Fit a candidate's persistent effects to the end.

        The first fit ends where little is to be gained; of sets that nearly say the same the one
        that was left further from its end would lose.
        """
        fitted = candidate.fit
        if fitted.events is not None or not candidate.effects:
            return candidate
        starts, end = self.starts_of(candidate), (_POLISH_EVALUATIONS, FINAL_STEP_SHARE)
        polished = self._attempt(
            candidate.terms, lambda: self._continue(starts, fitted, candidate.wrong, *end)
        )
        return candidate if polished is None else replace(polished, gain=candidate.gain)


def _emptier_than_empty(problem: Problem, fitted: Fit) -> bool:
    """True where a gauge's fitted lag implies pressures below ambient, and no recording has any."""
    for entry in fitted.rig.effects:
        if "reading" not in ports_of(entry) or Term.of(entry) not in fitted.effects:
            continue
        lag = entry["parameters"]["time_constant"]
        for prepared in problem.recordings:
            for name, (value, slope) in prepared.signals.items():
                block = block_of(name)
                if channel_of(name) != "muscle_pressure":
                    continue
                rows = prepared.recording.mask[name]
                if not rows.any():
                    continue
                if entry.get("at", "") not in ("", block):
                    continue
                behind = np.quantile((value + lag * slope)[rows], _EMPTIER_SHARE)
                lowest, highest = value[rows].min(), value[rows].max()
                if behind < min(0.0, lowest) - _EMPTIER_PART * highest:
                    return True
    return False
