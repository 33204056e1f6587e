"""Standard deviations from how much the pieces of recordings disagree."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Fit, Problem, spread_over_pieces
from pamrs.diagnosis.prepare import Residual
from tests.diagnosis import again

Array = NDArray[np.float64]

DT, SECONDS, TRUE = 0.02, 60.0, np.array([0.7, -1.3])
TIME = np.arange(0.0, SECONDS, DT)
SHAPES = np.stack([np.sin(0.9 * TIME), np.cos(0.37 * TIME) ** 3], axis=1)


def coloured(rng: np.random.Generator, memory: float) -> Array:
    """Noise of size one that remembers itself for so many seconds."""
    white = rng.standard_normal(TIME.size)
    if not memory:
        return white
    keep = np.exp(-DT / memory)
    white[1:] *= np.sqrt(1.0 - keep**2)
    return lfilter([1.0], [1.0, -keep], white)


def fitted(noise: Array, shapes: Array = SHAPES) -> tuple[Problem, Fit, Array]:
    """Least squares of two shapes to one recording, as a fit that thinks its noise is white."""
    measured = shapes @ TRUE + noise
    covariance = np.linalg.pinv(shapes.T @ shapes)
    value = covariance @ shapes.T @ measured
    names = ["arm.a", "arm.b"]
    std = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    rows = np.ones(TIME.size, dtype=bool)
    residual = Residual(measured - shapes @ value, shapes, shapes @ value, rows, 1.0)
    prepared = SimpleNamespace(recording=SimpleNamespace(name="r"), dt=DT)
    block = SimpleNamespace(name="arm")
    loose: Any = SimpleNamespace
    problem = loose(blocks=[block], recordings=[prepared], settings=DiagnosisSettings())
    values = dict(zip(names, value.tolist(), strict=True))
    more = {"scales": dict.fromkeys(names, 1.0), "inflation": {"arm": 1.0}}
    kept = {("arm", "r"): residual}
    found = Fit((), loose(), values, std, covariance, 0.0, kept, **more)
    return problem, found, value


@pytest.mark.parametrize("memory", [0.0, 0.5])
def test_intervals_hold_as_often_as_they_say(memory: float) -> None:
    rng = np.random.default_rng(20)
    own, wide = [], []
    for _ in range(300):
        problem, found, value = fitted(coloured(rng, memory))
        spread = spread_over_pieces(problem, found)
        away = np.abs(value - TRUE)
        own.append(away < 1.96 * np.array(list(found.std.values())))
        wide.append(away < 1.96 * np.array(list(spread.values())))
    assert 0.93 < np.mean(wide) <= 0.995
    if memory:  # what the fit says of itself holds less than half as often as it should
        assert np.mean(own) < 0.5


def test_a_fit_without_jacobians_keeps_its_own() -> None:
    problem, found, _ = fitted(coloured(np.random.default_rng(1), 0.5))
    (key,) = found.residuals
    found.residuals[key] = Residual(np.zeros(TIME.size), None, SHAPES[:, 0], TIME >= 0.0, 1.0)
    assert spread_over_pieces(problem, found) == found.std


def test_what_one_piece_alone_shows_does_not_become_certain() -> None:
    # the second shape is there in the first piece only, which then fits it as it likes
    shapes = SHAPES.copy()
    shapes[TIME > 4.0, 1] = 0.0
    problem, found, _ = fitted(coloured(np.random.default_rng(3), 0.5), shapes)
    spread = spread_over_pieces(problem, found)
    assert all(np.isfinite(s) and s >= found.std[n] for n, s in spread.items())


@pytest.mark.slow
def test_the_factor_for_equations_widens_what_is_stated_and_changes_no_value() -> None:
    """Model file and result have the same standard deviation."""
    rig = pamrs.rigs.shoulder()
    given = again.case(rig.with_effect("base_flexibility", {"compliance": 5e-4}), rig)
    usual = pamrs.DiagnosisSettings()
    once = replace(usual, spread_factor=1.0)
    narrow, wide = (pamrs.diagnose(given, settings=s) for s in (once, usual))
    assert wide.effects[0].id == "base_flexibility"
    for name, own in wide.effects[0].parameters.items():
        before = narrow.effects[0].parameters[name]
        assert own.value == before.value
        if own.std is not None and before.std is not None:
            assert own.std == pytest.approx(2.0 * before.std, rel=1e-12)
            assert wide.rig.effect_std["base_flexibility"][name] == own.std
    for name, parameter in wide.parameters.items():
        assert parameter.value == narrow.parameters[name].value
