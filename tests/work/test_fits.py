"""Evaluations that fits of fixed problems take."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from numpy.typing import NDArray

from pamrs.diagnosis.fit import levenberg_marquardt
from pamrs.fit import fit_muscle
from tests.fit.cases import TOLERANCE, measure, muscle
from tests.work.snapshot import compare

Array = NDArray[np.float64]


def rosenbrock(x: Array) -> tuple[Array, Array, None]:
    """Rows with a curved valley."""
    rows = 1e3 * np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    return rows, 1e3 * np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]), None


def test_evaluations_of_the_bounded_least_squares() -> None:
    counts = {}
    boxes = {"wide": 10.0, "its end outside the box": 0.7}
    for name, wall in boxes.items():
        bounds = (np.full(2, -10.0), np.full(2, wall))
        counts[f"valley, {name}"] = levenberg_marquardt(
            rosenbrock, np.array([-1.2, 1.0]), bounds, 200, 0.0
        )[2]
    compare("least_squares", counts)


def test_evaluations_of_the_fits_of_a_muscle(monkeypatch: pytest.MonkeyPatch) -> None:
    spent: list[int] = []
    solve = scipy.optimize.least_squares

    def counted(*arguments, **options):
        found = solve(*arguments, **options)
        spent.append(found.nfev)
        return found

    monkeypatch.setattr(scipy.optimize, "least_squares", counted)
    counts = {}
    for model in ("kothera", "robinson"):
        real = muscle(model, braid_angle=np.radians(70.9), rest_diameter=0.0206)
        data = measure(real, noise=1.0, seed=4)
        for names in (("braid_angle",), ("braid_angle", "rest_diameter")):
            spent.clear()
            fit_muscle(data, muscle(model), free=names, tolerance=TOLERANCE)
            what = f"{model}, {' and '.join(names)} free"
            counts[f"{what}: searches"] = len(spent)
            counts[f"{what}: evaluations"] = sum(spent)
    assert spent, "the fit does not search by scipy.optimize.least_squares any more"
    compare("muscle_fits", counts, tolerance=0.1)
