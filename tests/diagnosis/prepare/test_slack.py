"""A model whose muscles are slack without air, beside a plant whose muscles push back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import notes_on_slack
from pamrs.recordings import Recording
from tests.diagnosis.asked import problem_of
from tests.diagnosis.noisy import GAUGES, driven

LIGHT = pamrs.rigs.hanging_mass().with_parameters(
    {"load.mass": 4.0, "valve.discharge_area_max": 2e-5}
)
PUSHING = LIGHT.with_parameters({"muscle.buckling_load": 1e9})


def vented(true: pamrs.Rig, seed: int, role: str = "fit") -> Recording:
    """The mass lifted and let down at once, 9 s at 200 Hz."""
    time = 0.005 * np.arange(1800)
    command = {"valve_command": np.where(time % (2.6 + seed) < 1.3, 9.0, 1.0)}
    noise = GAUGES | {"length": 3e-5}
    return driven(true, f"r{seed}", role, 0.005, command, noise, [8, seed])


def test_a_model_that_lags_where_its_muscle_is_slack_is_told() -> None:
    """Let down without air, the muscle pushed the mass: 40 mm ahead of the model."""
    problem = problem_of(LIGHT, [vented(PUSHING, k) for k in range(2)], "chamber", "load")
    (told,) = notes_on_slack(LIGHT, problem.blocks, problem.recordings)
    assert told.startswith("the model lags where a muscle is slack: length of r")
    off, left = (float(part.split(" mm")[0]) for part in told.partition(" up to ")[2].split("and "))
    assert off == pytest.approx(39.4, abs=1.0)
    assert left < 0.5
    assert "buckling_load (now 0 N)" in told
    assert notes_on_slack(PUSHING, problem.blocks, problem.recordings) == []


def test_nothing_is_told_of_a_plant_that_is_slack() -> None:
    problem = problem_of(LIGHT, [vented(LIGHT, 0)], "load")
    assert notes_on_slack(LIGHT, problem.blocks, problem.recordings) == []


@pytest.mark.slow
def test_a_diagnosis_says_it_first() -> None:
    made = [vented(PUSHING, k, role) for k, role in enumerate(("fit", "fit", "held_out"))]
    found = pamrs.diagnose(pamrs.Case("light", LIGHT, made, Path()))
    assert found.warnings[0].startswith("the model lags where a muscle is slack")
