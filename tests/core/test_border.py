"""Arrays at the border: what is no number, and what has another shape, is named by its argument."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.control import metrics, trajectories
from pamrs.errors import ParameterError

SHOULDER, BENCH = pamrs.rigs.shoulder(), pamrs.rigs.bench()
MUSCLE = SHOULDER.muscle
assert MUSCLE is not None
STEP, ROW = {"sample_time": 0.01}, np.arange(10.0)
LOADS = {"n": 10, **STEP}

#: What takes a row of ten numbers, by the name of the argument.
ROWS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "valve_command": (lambda a: pamrs.simulate(SHOULDER, a, **STEP), np.full(10, 5.0)),
    "length": (
        lambda a: pamrs.simulate(BENCH, length=a, pressure=np.full(10, 1e5), **STEP),
        np.full(10, 0.27),
    ),
    "supply_command": (
        lambda a: pamrs.simulate(pamrs.rigs.regulated_joint(), supply_command=a, **STEP),
        np.full(10, 1e5),
    ),
    "arm.payload": (
        lambda a: pamrs.simulate_batch(SHOULDER, [5.0] * 3, parameters={"arm.payload": a}, **LOADS),
        ROW,
    ),
    "time": (lambda a: metrics.rms(a, ROW, ROW), ROW),
    "angle": (lambda a: trajectories.from_samples(ROW, a), ROW),
}

#: What takes an array of any shape.
ANY: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "pressure": (lambda a: MUSCLE.force(a, 0.1), np.full(10, 1e5)),
    "contraction": (lambda a: MUSCLE.radius(a), np.full(10, 0.1)),
    "joint.angle": (
        lambda a: pamrs.Joint(kind="pulley", radius=0.03).torque(MUSCLE, 1e5, a),
        np.full(10, 0.5),
    ),
    "force": (lambda a: MUSCLE.buckled(a), ROW),
}


@pytest.mark.parametrize("name", [*ROWS, *ANY])
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_no_number_is_named_without_a_warning_from_inside(name: str, wrong: float) -> None:
    call, good = (ROWS | ANY)[name]
    given = good.copy()
    given[3] = wrong
    with pytest.raises(ParameterError, match=name.replace(".", r"\.")):
        call(given)


@pytest.mark.parametrize("name", ROWS)
def test_another_shape_says_which_one_is_needed(name: str) -> None:
    call, good = ROWS[name]
    with pytest.raises(ParameterError, match=rf"{name} has the shape \(10, 2\); \(10,\) is needed"):
        call(np.stack([good, good], axis=1))


def test_shapes_that_do_not_go_together_are_told() -> None:
    assert MUSCLE.force(np.full((10, 2), 1e5), np.full(2, 0.1)).shape == (10, 2)
    said = r"pressure and contraction have the shapes \(10, 2\) and \(10,\); one shape for all"
    with pytest.raises(ParameterError, match=said):
        MUSCLE.force(np.full((10, 2), 1e5), np.full(10, 0.1))


@pytest.mark.parametrize("text", ["a", [1.0, "b"], [1.0, [2.0]]])
def test_text_and_ragged_rows_are_no_numbers(text: Any) -> None:
    with pytest.raises(ParameterError, match="numbers are needed"):
        MUSCLE.force(text, 0.1)
