"""The baseline alone: its parameters refitted inside their tolerances, to the end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pamrs.diagnosis.evidence import WALL_TOLERANCES, autocorrelation_of
from pamrs.diagnosis.fit import (
    FINAL_STEP_SHARE,
    FIT_BIN_TIME,
    Fit,
    Key,
    Problem,
    bin_width,
    fit,
    known_parameters,
)
from pamrs.diagnosis.noise import CORRELATED_VARIANCE, NoiseLevel
from pamrs.diagnosis.prepare import Prepared, Residual
from pamrs.errors import SimulationError
from pamrs.rig import Rig


def with_autocorrelation(
    problem: Problem, nominal: Rig, first: Fit, noise_level: Mapping[Key, NoiseLevel]
) -> tuple[Fit, dict[str, float]]:
    """The refitted baseline, fitted on with the autocorrelation that it leaves as weights where
    that is large, and the weights. What then lies at the end of its tolerances may have followed
    the noise there: it is fitted from the nominal values too.
    """
    autocorrelation = autocorrelation_of(problem, first, noise_level)
    if max(autocorrelation.values()) <= CORRELATED_VARIANCE:
        return first, autocorrelation
    found = thorough(problem, nominal, autocorrelation, first)
    if any(abs(moved) >= WALL_TOLERANCES for moved in found.moved.values()):
        found = min(found, thorough(problem, nominal, autocorrelation, None), key=lambda f: f.cost)
    return found, autocorrelation


def thorough(problem: Problem, nominal: Rig, inflation: dict[str, float], warm: Fit | None) -> Fit:
    """Baseline parameters alone, fitted to the end."""
    settings = problem.settings
    evaluations = settings.baseline_evaluations
    return fit(
        problem,
        nominal,
        (),
        {},
        inflation,
        warm=warm,
        evaluations=evaluations,
        share=FINAL_STEP_SHARE,
    )


def refitted(problem: Problem, nominal: Rig, inflation: dict[str, float]) -> Fit:
    """The baseline refitted from the nominal values and, where that leaves more than noise could,
    from the other side of them.
    """
    settings = problem.settings
    first = thorough(problem, nominal, inflation, None)
    rows = sum(
        int(r.rows.sum()) / bin_width(p, FIT_BIN_TIME)
        for p in problem.recordings
        for r in _of(p, first.residuals)
    )
    if 2.0 * first.cost < settings.noise_margin * rows:
        return first
    known = known_parameters(nominal)
    mirrored = {n: 2.0 * known[n].value - first.values[n] for n in first.moved}
    try:
        second = thorough(problem, nominal, inflation, replace(first, values=mirrored))
    except SimulationError:
        return first
    return min(first, second, key=lambda f: f.cost)


def _of(prepared: Prepared, found: dict[Key, Residual]) -> list[Residual]:
    return [r for (_, recording), r in found.items() if recording == prepared.recording.name]
