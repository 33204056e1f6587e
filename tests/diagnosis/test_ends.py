"""Parameters at the end of their range explain nothing more."""

from __future__ import annotations

import numpy as np

from pamrs.diagnosis.screen._screening import _ends

WALLS = 3.0


def ends(
    columns: np.ndarray, rows: np.ndarray, moved: list[float], free: list[float]
) -> np.ndarray:
    return _ends(columns, rows, np.array(moved), np.array(free), WALLS)


def test_a_parameter_that_the_residual_asks_far_out_is_at_its_end() -> None:
    columns = 100.0 * np.eye(4)[:, :2]
    # the first would go to 10 tolerances, the second to 1
    rows = -columns @ np.array([10.0, 1.0])
    found = ends(columns, rows, [1.0, 0.0], [1.0, 1.0])
    assert found[0] == WALLS
    assert np.isnan(found[1])


def test_where_one_ends_the_others_may_come_back() -> None:
    # both do nearly the same: alone the second is asked for no more than 2 tolerances
    columns = np.array([[100.0, 0.0], [100.0, 1.0]]).T
    rows = -(columns @ np.array([9.0, 0.0])) + np.array([400.0, 0.0])
    found = ends(columns, rows, [0.0, 0.0], [1.0, 1.0])
    assert np.nansum(np.isfinite(found)) == 1


def test_a_parameter_without_a_prior_has_no_end() -> None:
    columns = 100.0 * np.eye(3)[:, :1]
    assert np.isnan(ends(columns, -columns @ np.array([50.0]), [0.0], [0.0])).all()


def test_one_that_stands_at_its_end_stays() -> None:
    columns = 100.0 * np.eye(3)[:, :1]
    found = ends(columns, np.zeros(3), [-WALLS], [1.0])
    assert found.tolist() == [-WALLS]
