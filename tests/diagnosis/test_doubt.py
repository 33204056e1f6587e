"""Predictions of recordings that were not fitted are as uncertain as the parameters are."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import Problem, fit, predicted_with_doubt, residuals, stacked
from pamrs.recordings import Recording
from tests.diagnosis.asked import problem_of
from tests.diagnosis.noisy import SHOULDER, driven

RIG = pamrs.rigs.shoulder()
WHITE = {"chamber": 1.0}


def run(truth: pamrs.Rig, name: str, swing: float, seed: int) -> Recording:
    """Eight seconds about the null of the valve, which stays shut without a swing."""
    dt = 0.01
    command = 5.0 + swing * np.sin(1.7 * dt * np.arange(800))
    given, start = {"valve_command": command}, {"muscle_pressure": 2e5}
    return driven(truth, name, "fit", dt, given, SHOULDER, [44, seed], initial=start)


def power(there: Problem, found: dict[tuple[str, str], object]) -> float:
    rows, _ = stacked(there, found, WHITE)  # type: ignore[arg-type]
    return float(np.mean(rows**2))


@pytest.mark.parametrize(("leak", "explained"), [(0.0, True), (4e-9, False)])
def test_what_the_fit_leaves_open_is_no_mismatch_and_anything_else_is(
    leak: float, explained: bool
) -> None:
    # shut, a valve says nothing of its area, which is 1.8 tolerances off
    area = RIG.parameter("valve.discharge_area_max")
    truth = RIG.with_parameters({area.name: area.value + 1.8 * area.tol})
    shut = problem_of(RIG, [run(truth, "shut", 0.0, 1)], "chamber")
    there = truth.with_effect("leak_muscle", {"conductance": leak}) if leak else truth
    moving = problem_of(RIG, [run(there, "moving", 0.3, 2)], "chamber")
    found = fit(shut, RIG, (), {}, WHITE)
    assert found.std[area.name] > 0.9 * area.tol
    plain = power(moving, residuals(moving, found.rig))
    doubted = power(moving, predicted_with_doubt(moving, found))
    assert plain > 3.0
    assert (doubted < 1.3) == explained
    assert doubted < plain
