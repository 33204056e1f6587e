"""The error that a rig file says its model has: smooth curves over what is measured, carried
through the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis.evidence import significant
from pamrs.diagnosis.fit import Problem, residuals
from pamrs.diagnosis.noise import (
    Excess,
    curve_errors_of,
    error_sizes,
    excess,
    noise_levels,
    with_sizes,
)
from pamrs.diagnosis.noise._discrepancy import _flowing, whitening
from pamrs.diagnosis.prepare import Residual, binned
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.asked import SETTINGS, problem_of
from tests.diagnosis.noisy import noisy

Array = NDArray[np.float64]
RIG = pamrs.rigs.shoulder()
DT, ROWS = 0.005, 4000
NOISE = {"supply_pressure": 300.0, "muscle_pressure": 300.0, "joint_angle": 2e-4}
HALF = float(np.radians(0.5))


def recorded(seed: int) -> tuple[Recording, Array]:
    """A slow motion to and fro, without the error of the encoder, and the true angle [rad]."""
    time = DT * np.arange(ROWS)
    volts = 5.0 + 0.3 * np.sin(2.0 * time + seed) ** 2
    run = pamrs.simulate(RIG, volts, sample_time=DT)
    channels = {n: run[n] for n in (*NOISE, "valve_command")}
    noise = NOISE | {"valve_command": 1e-3}
    return noisy(f"r{seed}", "fit", DT, channels, noise, [seed]), run["joint_angle"]


def judged(off: list[Array], stated: dict[str, dict[str, float]]) -> Excess:
    """What the arm keeps where the encoder reads so much too much [rad], a recording each."""
    problem = arm(off)
    level = noise_levels(problem, problem.core, stated)
    left = residuals(problem, RIG)
    return excess(problem.blocks[0], problem.recordings, left, level, SETTINGS)


def arm(off: list[Array]) -> Problem:
    """The arm in recordings whose encoder reads so much too much [rad]."""
    recordings = []
    for seed, more in enumerate(off):
        found, _ = recorded(seed)
        channels = found.channels | {"joint_angle": found.channels["joint_angle"] + more}
        recordings.append(replace(found, channels=channels))
    return problem_of(RIG, recordings, "arm")


def smooth(seed: int) -> Array:
    """Half a degree (rms) as a curve over the angle, the same in every recording."""
    angle = recorded(seed)[1]
    return HALF * np.sqrt(2.0) * np.sin(9.0 * angle + 1.0)


def lagging(seed: int) -> Array:
    """Half a degree that changes its sign with the direction, as play in the encoder does."""
    rate = np.gradient(recorded(seed)[1])
    return HALF * np.sign(rate)


SIZE = {"joint_angle": {"size": HALF}}


def test_a_smooth_curve_inside_the_stated_error_is_none() -> None:
    """An encoder that is off by a curve of half a degree is a mismatch, unless the rig says so."""
    off = [smooth(0), smooth(1)]
    strict = judged(off, {})
    assert significant(strict)
    for stated in (SIZE, {"muscle": {"share": 0.03}}):
        lenient = judged(off, stated)
        assert not significant(lenient)
        assert lenient.noise == strict.noise  # that of the sensor stays what it is
    # an error ten times smaller than the mismatch hides nothing
    assert significant(judged(off, {"joint_angle": {"size": 0.1 * HALF}}))


def test_what_is_no_curve_over_the_reading_is_not_hidden_by_the_stated_error() -> None:
    play = judged([lagging(0), lagging(1)], SIZE)
    curve = judged([smooth(0), smooth(1)], SIZE)
    assert significant(play)
    assert play.ratio > 3.0 * curve.ratio


@pytest.mark.parametrize(
    ("share", "low", "high"), [(0.0, 0.0, 0.03), (0.1, 0.03, 0.2), (1.0, 0.7, 1.0)]
)
def test_the_size_of_an_error_is_found(share: float, low: float, high: float) -> None:
    problem = arm([share * smooth(0), share * smooth(1)])
    level = noise_levels(problem, problem.core, SIZE)
    (size,) = error_sizes(problem, residuals(problem, RIG), level)[0].values()
    assert low <= size <= high
    found = with_sizes(level, {"arm": size})
    (block,) = problem.blocks
    left = excess(block, problem.recordings, residuals(problem, RIG), found, SETTINGS)
    assert not significant(left)
    same = with_sizes(level, {"arm": 1.0})
    assert all(same[key].binned == pytest.approx(level[key].binned) for key in level)


def test_what_the_file_states_takes_the_place_of_the_usual_error() -> None:
    usual = curve_errors_of(RIG, 0.01)
    assert usual["muscle"] == {"share": 0.01}
    assert usual["joint_angle"] == {"share": pytest.approx(0.001)}
    assert curve_errors_of(RIG, 0.0) == {}
    text = RIG.to_toml_text() + '\n[model_error]\nmuscle = "3 %"\n'
    stated = curve_errors_of(parse_rig(text), 0.01)
    assert stated["muscle"] == {"share": pytest.approx(0.03)}
    assert stated["valve"] == {"share": 0.01}


def test_one_curve_acts_in_all_recordings() -> None:
    """A curve that turns over from one recording to the next is no error of an encoder."""
    same, turned = (judged([smooth(0), sign * smooth(1)], SIZE) for sign in (1.0, -1.0))
    assert not significant(same)
    assert significant(turned)


@pytest.mark.parametrize("columns", [0, 1, 7])
def test_whitening_agrees_with_the_dense_covariance(columns: int) -> None:
    rng = np.random.default_rng(3)
    curves = 30.0 * rng.normal(size=(40, columns))
    if columns > 1:
        curves[:, 1] = 2.0 * curves[:, 0]  # curves that are the same are no harm
    rows = rng.normal(size=(40, 2))
    dense = rows.T @ np.linalg.solve(np.eye(40) + curves @ curves.T, rows)
    white = whitening(curves)(rows)
    assert white.T @ white == pytest.approx(dense, rel=1e-6)
    assert whitening(curves)(rows[:, 0]) == pytest.approx(white[:, 0])


def test_an_error_of_a_flow_outlasts_a_hole_in_the_log() -> None:
    """What a hole hides of an output fades on as it does beside it."""
    rows, prediction = np.ones(200, dtype=bool), np.linspace(0.0, 100.0, 200)

    def moved(used: NDArray[np.bool_]) -> Array:
        fading = np.where(used, np.exp(-0.01 * np.arange(200)), 0.0)[:, None]
        base = Residual(prediction, None, prediction, used, 1.0, [(0, 200, fading)])
        return _flowing(np.full((200, 1), 0.01), base)[:, 0]

    holed = rows.copy()
    holed[[0, *range(100, 110), 199]] = False
    assert np.allclose(moved(holed)[1:199], moved(rows)[1:199], rtol=2e-2)
    assert np.all(moved(~rows) == 0.0)


def test_bins_of_a_recording_that_is_shorter_than_one_are_none() -> None:
    few = np.ones(4, dtype=bool)
    for values in (np.ones(4), np.ones((4, 3)), np.ones((4, 0))):
        means, counts = binned(values, few, 5)
        assert means.shape == (0, *values.shape[1:])
        assert counts.shape == (0,)
    means, counts = binned(np.ones((10, 0)), np.ones(10, dtype=bool), 5)
    assert means.shape == (2, 0)
    assert counts.tolist() == [5.0, 5.0]
