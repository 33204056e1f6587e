"""The bounded least squares of the diagnosis, against SciPy's and by its predicted gains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear

from pamrs.diagnosis.fit import levenberg_marquardt
from pamrs.errors import SimulationError

Array = NDArray[np.float64]
Box = tuple[Array, Array]


def box(low: Sequence[float], high: Sequence[float]) -> Box:
    return np.array(low, dtype=float), np.array(high, dtype=float)


def decay(x: Array, time: Array, data: Array) -> tuple[Array, Array, str]:
    wave = np.exp(-x[1] * time)
    return 1e2 * (x[0] * wave - data), 1e2 * np.stack([wave, -x[0] * time * wave], axis=1), "told"


@pytest.mark.parametrize("seed", range(5))
def test_the_same_end_as_scipy_in_a_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 3.0, 200)
    data = 2.0 * np.exp(-1.5 * time) + 0.01 * rng.standard_normal(200)
    walls = box([0.0, 0.1], [1.8, 5.0])  # the best amplitude lies beyond the wall
    start = np.array([0.5, 0.5])
    x, best, _ = levenberg_marquardt(lambda x: decay(x, time, data), start, walls, 40)
    rows, slopes = (lambda x, k=k: decay(x, time, data)[k] for k in (0, 1))
    theirs = least_squares(rows, start, jac=slopes, bounds=walls)
    assert best[2] == "told"
    assert 0.5 * float(best[0] @ best[0]) <= theirs.cost * (1.0 + 2e-3) + 0.2
    assert np.allclose(x, theirs.x, rtol=2e-2)
    assert x[0] == 1.8


def test_a_point_that_cannot_be_simulated_is_taken_back() -> None:
    visited: list[float] = []

    def evaluate(x: Array) -> tuple[Array, Array, None]:
        visited.append(float(x[0]))
        if x[0] > 1.5:
            raise SimulationError("beyond the model's range")
        return 10.0 * np.arctan(2.0 * (x - 1.0)), np.diag(20.0 / (1.0 + 4.0 * (x - 1.0) ** 2)), None

    x, _, _ = levenberg_marquardt(evaluate, np.array([-1.0]), box([-5.0], [5.0]), 30)
    assert max(visited) > 1.5, "the first step overshoots: the case is empty otherwise"
    assert abs(float(x[0]) - 1.0) < 0.02


def test_a_start_that_cannot_be_simulated_is_an_error() -> None:
    def evaluate(x: Array) -> tuple[Array, Array, None]:
        raise SimulationError("no such plant")

    with pytest.raises(SimulationError, match="no such plant"):
        levenberg_marquardt(evaluate, np.zeros(1), box([-1.0], [1.0]), 5)


@pytest.mark.parametrize("size", [1e120, 1e153, 1e200])
def test_sensitivities_that_any_damping_would_make_infinite_are_refused(size: float) -> None:
    """Their squares are finite in the second case, and times a damping they are not."""

    def steep(x: Array) -> tuple[Array, Array, None]:
        return np.array([size * (x[0] - 1.0)]), np.array([[size]]), None

    with pytest.raises(SimulationError, match="too large to be fitted"):
        levenberg_marquardt(steep, np.zeros(1), box([-5.0], [5.0]), 20)


def test_noise_is_not_worth_an_evaluation() -> None:
    rows = np.random.default_rng(1).standard_normal(1000)
    rows += 0.02 - rows.mean()  # a gain of 0.4 in a chi-square of 1000
    jacobian = np.ones((1000, 1))

    def evaluate(x: Array) -> tuple[Array, Array, None]:
        return rows + jacobian[:, 0] * x[0], jacobian, None

    assert levenberg_marquardt(evaluate, np.zeros(1), box([-10.0], [10.0]), 9)[2] == 1


def test_a_step_that_walls_bend_uphill_is_shortened() -> None:
    # the long way to the minimum leaves the box through both parameters, and the corner where it
    # leaves lies uphill
    normal = np.array([[1.0, 0.999], [0.999, 1.0]])
    root = np.linalg.cholesky(normal).T
    aim = np.array([50.0, -45.0])

    def evaluate(x: Array) -> tuple[Array, Array, None]:
        return 10.0 * root @ (x - aim), 10.0 * root, None

    walls = box([-1.0, -40.0], [1.0, 1.0])
    x, (rows, _, _), _ = levenberg_marquardt(evaluate, np.zeros(2), walls, 40)
    theirs = lsq_linear(10.0 * root, 10.0 * root @ aim, walls)
    assert 0.5 * float(rows @ rows) <= theirs.cost * (1.0 + 2e-3)
    assert np.allclose(x, theirs.x, atol=1e-2)


def test_a_fit_ends_where_steps_do_not_keep_their_promise() -> None:
    """Next to a kink the rows rise on both sides, whatever the sensitivities say."""
    spent: list[float] = []

    def evaluate(x: Array) -> tuple[Array, Array, None]:
        spent.append(float(x[0]))
        return 10.0 + 5.0 * np.abs(x), np.array([[5.0]]), None

    x, best, count = levenberg_marquardt(evaluate, np.array([3.0]), box([-9.0], [9.0]), 40)
    assert count == len(spent) < 12
    assert float(best[0][0]) == 10.0 + 5.0 * abs(float(x[0]))
    assert abs(float(x[0])) < min(map(abs, spent)) + 1e-9
