"""Fits, evaluations and predictions that the diagnosis of fixed recordings takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import _fitting, fit
from pamrs.diagnosis.search import refitted
from pamrs.effects import Term
from pamrs.recordings import Recording
from tests.diagnosis.asked import problem_of
from tests.diagnosis.held import held
from tests.diagnosis.noisy import SHOULDER, driven
from tests.work.snapshot import compare

TOLERANCE = 0.1


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
            f"{name}: sensitivities of a sample": sum(rows * n for rows, n in self.predicted),
        }


def recorded(rig: pamrs.Rig, seed: int) -> Recording:
    """Eight seconds of a shoulder at 200 Hz, with the noise of transducers."""
    turn = 2 * np.pi * 0.005 * np.arange(1600)
    wave = 0.5 * np.sin(0.2 * turn + seed) + 0.25 * np.sin(0.7 * turn)
    given = {"valve_command": 5.0 + wave}
    return driven(rig, f"r{seed}", "fit", 0.005, given, SHOULDER, [seed])


def test_work_of_the_refit_and_of_an_effect_of_a_shoulder(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = pamrs.rigs.shoulder()
    truth = rig.with_effect("muscle_hysteresis").with_parameters({"chamber.dead_volume": 1.7e-4})
    recordings = [recorded(truth, seed) for seed in (1, 2)]
    work, counts = Work(monkeypatch), {}
    for kind in ("supply", "chamber", "arm"):
        problem, white = problem_of(rig, recordings, kind), {kind: 1.0}
        counts |= work.of(f"refit of the {kind}", lambda p=problem, w=white: refitted(p, rig, w))
    starts = {"friction_pressure": 1e-5, "friction_constant": 1.0}
    starts = {f"muscle_hysteresis.{name}": value for name, value in starts.items()}
    friction = (Term("muscle_hysteresis"),)
    counts |= work.of(
        "hysteresis of the arm",
        lambda: fit(problem, rig, friction, starts, white, evaluations=30),
    )
    compare("shoulder", counts, tolerance=TOLERANCE)


def test_work_of_whole_diagnoses_of_a_sealed_chamber(monkeypatch: pytest.MonkeyPatch) -> None:
    work, counts = Work(monkeypatch), {}
    for name, conductance in (("tight chamber", 0.0), ("leak", 3e-11)):
        case = held(conductance, 60.0, step=None)
        counts |= work.of(name, lambda case=case: pamrs.diagnose(case))
    compare("sealed_chamber", counts, tolerance=TOLERANCE)
