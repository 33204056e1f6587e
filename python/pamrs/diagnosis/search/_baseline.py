"""The baseline alone: its parameters refitted inside their tolerances, to the end, and what each
block keeps then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.evidence import (
    WALL_TOLERANCES,
    BlockGroup,
    FittedHypothesis,
    misses_only_held_out,
    significant,
)
from pamrs.diagnosis.fit import (
    FINAL_STEP_SHARE,
    FIT_BIN_TIME,
    Fit,
    Inflation,
    Key,
    Problem,
    Unfollowed,
    bin_width,
    fit,
    known_parameters,
    predicted_by_others,
    predicted_with_doubt,
    residuals,
    stacked,
)
from pamrs.diagnosis.noise import (
    CORRELATED_VARIANCE,
    Excess,
    NoiseLevel,
    bins_of,
    curve_errors_of,
    error_sizes,
    excess,
    inflation_of,
    no_inflation,
    noise_levels,
    with_sizes,
)
from pamrs.diagnosis.prepare import CLEARLY_LESS, Block, Prepared, Residual
from pamrs.diagnosis.search._attempts import Attempts
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import UNDECIDED, Hypothesis, effect_of
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.simulation import core_rig

_DRAGGED = 25.0  # times as large a sum of squares of the others with one recording as without it
# held-out variance over noise that is a mismatch the fitted hardly show (decision 20)
_HELD_OUT_RATIO = 2.0
# variance over that of the noise that the fitted recordings must have for that (decision 20)
_FITTED_HINT = 1.15
# multiple of noise's largest excess that may be a low noise level (decisions 20, 22)
_MARGINAL_MULTIPLE = 1.35
# excess variance over that of the noise up to which it may (decisions 20, 22)
MARGINAL_EXCESS = 0.3


def with_inflation(
    problem: Problem, nominal: Rig, first: Fit, noise_level: Mapping[Key, NoiseLevel]
) -> tuple[Fit, Inflation]:
    """The refitted baseline, fitted on with the inflation by the autocorrelation that it leaves
    where that is large, and that inflation. What then lies at the end of its tolerances may have
    followed the noise there: it is fitted from the nominal values too.
    """
    inflation = inflation_of(problem, first, noise_level)
    if inflation.largest <= CORRELATED_VARIANCE:
        return first, inflation
    fitted = thorough(problem, nominal, inflation, first)
    for _ in range(8 if inflation.apart else 0):  # until no weight falls by much
        # what is apart had moved the baseline, and that missed the others
        last, inflation = inflation, inflation_of(problem, fitted, noise_level)
        fitted = thorough(problem, nominal, inflation, fitted)
        if all(CORRELATED_VARIANCE * now >= last[name] for name, now in inflation.items()):
            break
    _tell_of_apart(problem, fitted, inflation)
    if any(abs(moved) >= WALL_TOLERANCES for moved in fitted.moved.values()):
        fitted = min(fitted, thorough(problem, nominal, inflation, None), key=lambda f: f.cost)
    return fitted, inflation


def _tell_of_apart(problem: Problem, fitted: Fit, inflation: Inflation) -> None:
    """Name the recordings that a refit misses by far more than the others."""
    for block, name in inflation.apart:
        missed = {
            p.recording.name: _sample_noise_levels(fitted.residuals[block, p.recording.name])
            for p in problem.recordings
        }
        most = max(missed[n] for n in missed if (block, n) not in inflation.apart)
        problem.losses.tell(
            f"block {block}: the refitted model misses {name} by {missed[name]:.3g} noise levels "
            f"and the others by {most:.3g} at most: it counts less than they do; look at it, or "
            "leave it out"
        )


def _sample_noise_levels(residual: Residual) -> float:
    """Root mean square of a residual in noise levels of single samples."""
    count = max(1, int(residual.rows.sum()))
    return float(np.linalg.norm(residual.value[residual.rows])) / math.sqrt(count) / residual.noise


def thorough(problem: Problem, nominal: Rig, inflation: dict[str, float], warm: Fit | None) -> Fit:
    """Baseline parameters alone, fitted to the end."""
    return fit(
        problem,
        nominal,
        (),
        {},
        inflation,
        warm=warm,
        evaluations=problem.settings.baseline_evaluations,
        share=FINAL_STEP_SHARE,
    )


def refitted(problem: Problem, nominal: Rig, inflation: dict[str, float]) -> Fit:
    """The baseline refitted from the nominal values and, where that leaves more than noise could,
    from the other side of them; where one recording drags it away from the others, as they have it.
    """
    first = thorough(problem, nominal, inflation, None)
    rows = sum(
        int(r.rows.sum()) / bin_width(p, FIT_BIN_TIME)
        for p in problem.recordings
        for r in _of(p, first.residuals)
    )
    if 2.0 * first.cost < problem.settings.noise_margin * rows:
        return first
    if first.refused is not None or not any(first.moved.values()):
        _check_moved(problem, nominal, inflation, first)
    known = known_parameters(nominal)
    mirrored = {n: 2.0 * known[n].value - first.values[n] for n in first.moved}
    try:
        second = thorough(problem, nominal, inflation, replace(first, values=mirrored))
        first = min(first, second, key=lambda f: f.cost)
        return _as_the_others(problem, nominal, inflation, first)
    except SimulationError:
        return first


def _as_the_others(problem: Problem, nominal: Rig, inflation: dict[str, float], fitted: Fit) -> Fit:
    """A refit with the values that all recordings have but the one that is missed most, where that
    one makes most of what the others are missed by; else as it is.
    """
    missed = {
        p.recording.name: max(map(_sample_noise_levels, _of(p, fitted.residuals)))
        for p in problem.recordings
    }
    worst = max(missed, key=lambda name: missed[name])
    others = replace(
        problem, recordings=[p for p in problem.recordings if p.recording.name != worst]
    )
    if len(others.recordings) < 2:  # a single one is fitted by anything
        return fitted
    alone = thorough(others, nominal, inflation, None)
    of_others, _ = stacked(others, fitted.residuals, inflation)
    if float(of_others @ of_others) < _DRAGGED * 2.0 * alone.cost:
        return fitted
    return fit(problem, nominal, (), {}, inflation, warm=alone, evaluations=1)


def _check_moved(problem: Problem, nominal: Rig, inflation: dict[str, float], first: Fit) -> None:
    """Say that a refit went no further, and why.

    Raises
    ------
    Unfollowed
        If one recording stopped it, which the model cannot follow where it fits the others.
    """
    stopped = first.refused
    if isinstance(stopped, Unfollowed):
        parts = [p for p in problem.recordings if p.recording.name != stopped.recording]
        if parts:
            alone = thorough(replace(problem, recordings=parts), nominal, inflation, None)
            residuals(problem, alone.rig)
            return
    if first.evaluations > 1:
        most = max(map(abs, first.moved.values()), default=0.0)
        why = f"the next step leaves the model's range ({stopped})" if stopped else "no step did"
        problem.losses.tell(
            f"the refit of the baseline stopped {most:.2f} tolerances from the rig file's values, "
            f"although others inside their tolerances should leave less: {why}"
        )


def _of(prepared: Prepared, block_residuals: dict[Key, Residual]) -> list[Residual]:
    return [
        r for (_, recording), r in block_residuals.items() if recording == prepared.recording.name
    ]


@dataclass(frozen=True, eq=False)
class Refit:
    """Refit of some blocks' parameters inside their tolerances, and what each block keeps.

    Attributes
    ----------
    attempts : Attempts
        Recordings, model, noise levels, and the blocks that keep an excess.
    white_fit : Fit
        The refit with white noise.
    inflation : dict of str to float
        Inflation by the autocorrelation that it leaves.
    nominal_excess : dict of str to Excess
        What the nominal model leaves of the recordings to fit, by block.
    start : FittedHypothesis
        The refitted baseline as a hypothesis.
    held_out_alone : list of Block
        Blocks whose excess the held-out recordings alone show.
    nominal_residuals : dict
        What the nominal model leaves of the recordings to fit.
    error : (dict, dict)
        Noise levels with the curve error as stated or usual, and how large it is in each block, as
        a share of that.
    """

    attempts: Attempts
    white_fit: Fit
    inflation: dict[str, float]
    nominal_excess: dict[str, Excess]
    start: FittedHypothesis
    held_out_alone: list[Block]
    nominal_residuals: dict[Key, Residual]
    error: tuple[dict[Key, NoiseLevel], dict[str, float]]

    def with_smaller_error(self, candidates: list[FittedHypothesis]) -> Refit | None:
        """Refit with the smaller curve error that the likeliest hypothesis leaves, or None."""
        attempts, (usual, sizes) = self.attempts, self.error
        each = [(c, *error_sizes(attempts.fit_problem, c.fit.residuals, usual)) for c in candidates]
        _, sizes_left, _ = max(each, key=lambda one: one[2] - _price(one[0], attempts))
        if all(sizes_left[name] > CLEARLY_LESS * size for name, size in sizes.items()):
            return None
        return self.with_error_sizes(
            {name: min(size, sizes_left[name]) for name, size in sizes.items()}
        )

    def with_error_sizes(self, sizes: dict[str, float]) -> Refit | None:
        """Refit with other sizes of the curve error; None where these leave no mismatch."""
        attempts = self.attempts
        inputs = (
            attempts.fit_problem,
            attempts.held_out_problem,
            attempts.nominal,
            self.white_fit,
            self.nominal_residuals,
        )
        refit = _refit_with_error_sizes(*inputs, (self.error[0], sizes))
        return refit if refit.attempts.suspects else None

    def group(
        self,
        candidates: list[FittedHypothesis],
        probabilities: dict[Hypothesis, float],
        mismatch: Block | None,
    ) -> BlockGroup:
        """The blocks as a group, with hypotheses and their probabilities."""
        attempts = self.attempts
        blocks, fit_excess = attempts.fit_problem.blocks, candidates[0].fit_excess
        return BlockGroup(
            blocks,
            self.nominal_excess,
            fit_excess,
            candidates,
            probabilities,
            mismatch,
            attempts.noise_level,
            attempts.suspects,
        )


def refit_blocks(fit_problem: Problem, held_out_problem: Problem, nominal: Rig) -> Refit:
    """Fit parameters inside their tolerances, and find what each block keeps."""
    blocks, settings = fit_problem.blocks, fit_problem.settings
    nominal_residuals = residuals(fit_problem, nominal)
    white_fit = refitted(fit_problem, nominal, no_inflation(blocks))
    curve_errors = curve_errors_of(nominal, settings.usual_error)
    noise_level = noise_levels(fit_problem, core_rig(white_fit.rig, fit_problem.core), curve_errors)
    if held_out_problem.recordings is not fit_problem.recordings:
        noise_level |= noise_levels(
            held_out_problem, core_rig(white_fit.rig, held_out_problem.core), curve_errors
        )
    usual, sizes = noise_level, dict.fromkeys((b.name for b in blocks), 1.0)
    if not error_is_given(nominal, settings):
        sizes, _ = error_sizes(fit_problem, white_fit.residuals, usual)
    return _refit_with_error_sizes(
        fit_problem,
        held_out_problem,
        nominal,
        white_fit,
        nominal_residuals,
        (usual, sizes),
    )


def error_is_given(nominal: Rig, settings: DiagnosisSettings) -> bool:
    """True where the size of the curve error is stated: by the rig file, or as none."""
    return bool(nominal.model_error) or not settings.usual_error


def _refit_with_error_sizes(
    fit_problem: Problem,
    held_out_problem: Problem,
    nominal: Rig,
    white_fit: Fit,
    nominal_residuals: dict[Key, Residual],
    error: tuple[dict[Key, NoiseLevel], dict[str, float]],
) -> Refit:
    """Refit with given sizes of the curve error: noise levels with it as stated or usual, and its
    size in each block as a share of that.
    """
    blocks, settings = fit_problem.blocks, fit_problem.settings
    noise_level = with_sizes(*error)
    nothing_held_out = held_out_problem.recordings is fit_problem.recordings
    baseline, inflation = with_inflation(fit_problem, nominal, white_fit, noise_level)

    def excess_by_block(
        problem: Problem, block_residuals: dict[Key, Residual]
    ) -> dict[str, Excess]:
        return {
            b.name: excess(b, problem.recordings, block_residuals, noise_level, settings)
            for b in blocks
        }

    nominal_excess, fit_excess = (
        excess_by_block(fit_problem, nominal_residuals),
        excess_by_block(fit_problem, baseline.residuals),
    )
    held_out_residuals = (
        predicted_by_others(fit_problem, baseline, inflation)
        if nothing_held_out
        else residuals(held_out_problem, baseline.rig)
    )
    held_out_excess = excess_by_block(held_out_problem, held_out_residuals)
    # what parameters could not be told from the fitted recordings shows in the others alone, and is
    # no mismatch

    def shown_by_held_out(excesses: dict[str, Excess]) -> list[Block]:
        return [
            b
            for b in blocks
            if significant(excesses[b.name], _HELD_OUT_RATIO)
            and fit_excess[b.name].ratio > _FITTED_HINT
            and not nothing_held_out
        ]

    held_out_alone = shown_by_held_out(held_out_excess)
    if misses_only_held_out(fit_excess, held_out_excess, nothing_held_out=nothing_held_out):
        held_out_residuals = predicted_with_doubt(held_out_problem, baseline)
        held_out_excess = excess_by_block(held_out_problem, held_out_residuals)
    alone_with_doubt = shown_by_held_out(held_out_excess)
    suspects = [b for b in blocks if significant(fit_excess[b.name]) or b in alone_with_doubt]
    attempts = Attempts(
        fit_problem, held_out_problem, nominal, noise_level, held_out_excess, suspects
    )
    likelihood = attempts.likelihood_of(baseline.residuals, held_out_residuals)
    start = FittedHypothesis((), baseline, held_out_excess, fit_excess, 0.0, likelihood=likelihood)
    return Refit(
        attempts,
        white_fit,
        inflation,
        nominal_excess,
        start,
        held_out_alone,
        nominal_residuals,
        error,
    )


def _price(candidate: FittedHypothesis, attempts: Attempts) -> float:
    """Log odds that the parameters of a hypothesis cost: their moves, and for each the half
    logarithm of the number of bins (Schwarz), which it could have fitted by chance.
    """
    problem = attempts.fit_problem
    bins = sum(p.n / bins_of(p) for p in problem.recordings) * len(problem.blocks)
    names = {n for n in candidate.fit.values if effect_of(n)} | {*candidate.wrong}
    events = candidate.fit.events.values.values() if candidate.fit.events else ()
    count = len(names) + sum(map(len, events))
    moved = sum(v * v for n, v in candidate.fit.moved.items() if n not in names)
    return 0.5 * (moved + count * math.log(bins)) + attempts.settings.name_price * len(
        candidate.terms
    )


def healthy_group(refit: Refit, common: FittedHypothesis) -> BlockGroup:
    """Group whose baseline, fitted to all recordings, leaves only noise in them."""
    attempts = refit.attempts
    # what the nominal model leaves in the held-out ones is what the parameters are moved for
    nominal_residuals = residuals(attempts.held_out_problem, attempts.nominal)
    largest_excess = {
        b.name: max(
            refit.nominal_excess[b.name],
            attempts.excess(b, attempts.held_out_problem, nominal_residuals),
            key=lambda e: e.ratio,
        )
        for b in attempts.fit_problem.blocks
    }
    return replace(
        refit.group([common], {UNDECIDED: 1.0}, None), nominal=largest_excess, suspects=[]
    )


def fit_all_recordings(attempts: Attempts, start: FittedHypothesis) -> FittedHypothesis | None:
    """One baseline inside its tolerances that leaves only noise in fitted and held-out recordings,
    taken together, if there is one.
    """
    fit_problem, held_out_problem = attempts.fit_problem, attempts.held_out_problem
    both = replace(fit_problem, recordings=[*fit_problem.recordings, *held_out_problem.recordings])
    try:
        common = thorough(both, attempts.nominal, attempts.no_inflation, start.fit)
    except SimulationError:
        return None
    fitted, held_out = (
        {b.name: attempts.excess(b, part, common.residuals) for b in fit_problem.blocks}
        for part in (fit_problem, held_out_problem)
    )
    if any(significant(e[b.name]) for b in fit_problem.blocks for e in (fitted, held_out)):
        return None
    return FittedHypothesis((), common, held_out, fitted, 0.0)


def is_marginal(refit: Refit) -> bool:
    """True where so little is left that the noise level may as well have been estimated too low."""
    return all(
        e.ratio - 1.0 < max(_MARGINAL_MULTIPLE * (e.limit - 1.0), MARGINAL_EXCESS)
        for b in refit.attempts.suspects
        for e in (refit.start.fit_excess[b.name], refit.attempts.baseline_excess[b.name])
    )
