"""Fits, evaluations and predictions that the diagnosis of fixed recordings takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Problem, _fitting, fit
from pamrs.diagnosis.prepare import available_blocks, prepare
from pamrs.diagnosis.search import refitted
from pamrs.effects import Term
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.held import held
from tests.diagnosis.noisy import whole
from tests.work.snapshot import compare

TOLERANCE = 0.1
SETTINGS = DiagnosisSettings()
NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}


class Work:
    """What is spent: counting stand-ins for the prediction of a block and for the least squares of
    a fit.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.predicted: list[tuple[int, int]] = []
        self.evaluated: list[int] = []
        predict, solve = _fitting.residual, _fitting.levenberg_marquardt

        def residual(block: Any, core: Any, prepared: Any, parameters: list[str]) -> Any:
            self.predicted.append((prepared.n, len(parameters)))
            return predict(block, core, prepared, parameters)

        def least_squares(*arguments: Any, **options: Any) -> Any:
            found = solve(*arguments, **options)
            self.evaluated.append(found[2])
            return found

        monkeypatch.setattr(_fitting, "residual", residual)
        monkeypatch.setattr(_fitting, "levenberg_marquardt", least_squares)

    def of(self, name: str, job: Callable[[], object]) -> dict[str, int]:
        """Counts of a job by what they count."""
        self.predicted.clear()
        self.evaluated.clear()
        job()
        return {
            f"{name}: fits": len(self.evaluated),
            f"{name}: evaluations of the fits": sum(self.evaluated),
            f"{name}: predictions of a block": len(self.predicted),
            f"{name}: samples predicted": sum(rows for rows, _ in self.predicted),
            f"{name}: sensitivities of a sample": sum(
                rows * columns for rows, columns in self.predicted
            ),
        }


def recorded(rig: pamrs.Rig, seed: int) -> Recording:
    """Eight seconds of a shoulder at 200 Hz, with the noise of transducers."""
    rng = np.random.default_rng(seed)
    time = 0.005 * np.arange(1600)
    command = (
        5.0 + 0.5 * np.sin(2 * np.pi * 0.2 * time + seed) + 0.25 * np.sin(2 * np.pi * 0.7 * time)
    )
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    channels = {
        name: run[name] + sigma * rng.standard_normal(time.size) for name, sigma in NOISE.items()
    }
    channels["valve_command"] = command
    return whole(f"r{seed}", "fit", 0.005, channels)


def hold(conductance: float) -> pamrs.Case:
    return held(conductance, 60.0, step=None)


def test_work_of_the_refit_and_of_an_effect_of_a_shoulder(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = pamrs.rigs.shoulder()
    truth = rig.with_effect("muscle_hysteresis").with_parameters({"chamber.dead_volume": 1.7e-4})
    recordings = [prepare(recorded(truth, seed), rig, SETTINGS) for seed in (1, 2)]
    blocks = available_blocks(rig, (*NOISE, "valve_command"))
    work, counts = Work(monkeypatch), {}
    for kind in ("supply", "chamber", "arm"):
        chosen = [block for block in blocks if block.kind == kind]
        problem, white = (
            Problem(chosen, recordings, core_rig(rig), SETTINGS),
            {block.name: 1.0 for block in chosen},
        )
        counts |= work.of(f"refit of the {kind}", lambda p=problem, w=white: refitted(p, rig, w))
    starts = {
        "muscle_hysteresis.friction_pressure": 1e-5,
        "muscle_hysteresis.friction_constant": 1.0,
    }
    counts |= work.of(
        "hysteresis of the arm",
        lambda: fit(problem, rig, (Term("muscle_hysteresis"),), starts, white, evaluations=30),
    )
    compare("shoulder", counts, tolerance=TOLERANCE)


def test_work_of_whole_diagnoses_of_a_sealed_chamber(monkeypatch: pytest.MonkeyPatch) -> None:
    work, counts = Work(monkeypatch), {}
    for name, conductance in (("tight chamber", 0.0), ("leak", 3e-11)):
        case = hold(conductance)
        counts |= work.of(name, lambda case=case: pamrs.diagnose(case))
    compare("sealed_chamber", counts, tolerance=TOLERANCE)
