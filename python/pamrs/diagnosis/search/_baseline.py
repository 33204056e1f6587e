"""The baseline alone: its parameters refitted inside their tolerances, to the end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pamrs.diagnosis.evidence import WALL_TOLERANCES
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
    residuals,
    stacked,
)
from pamrs.diagnosis.noise import CORRELATED_VARIANCE, NoiseLevel, inflation_of
from pamrs.diagnosis.prepare import Prepared, Residual
from pamrs.errors import SimulationError
from pamrs.rig import Rig

_MOST_OWN_WEIGHTINGS = 8  # of a refit beside recordings that count by their own
_LEAST_OTHERS = 2  # recordings that have to agree against one: a single one is fitted by anything
_DRAGGED = 25.0  # times as large a sum of squares of the others beside one recording as without it


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
    for _ in range(_MOST_OWN_WEIGHTINGS if inflation.apart else 0):
        # what stands apart had moved the baseline, and that missed the others
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
    if len(others.recordings) < _LEAST_OTHERS:
        return fitted
    alone = thorough(others, nominal, inflation, None)
    beside, _ = stacked(others, fitted.residuals, inflation)
    if float(beside @ beside) < _DRAGGED * 2.0 * alone.cost:
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
