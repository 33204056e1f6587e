"""Metrics against closed forms, one run and a batch alike."""

import math

import numpy as np
import pytest

from pamrs.control import metrics as m
from pamrs.errors import ParameterError
from tests.simulation.refusals import refused


def second_order(zeta, w, time):
    """Step response of ``w^2 / (s^2 + 2 zeta w s + w^2)`` and its rate."""
    d, decay = w * math.sqrt(1 - zeta**2), np.exp(-zeta * w * time)
    sine = np.sin(d * time)
    return 1 - decay * (np.cos(d * time) + zeta * w / d * sine), decay * w * w / d * sine


def test_curvature_of_a_circle_is_one_over_its_radius():
    radius = 2.0
    time = np.linspace(-1.2, 1.2, 4001)
    angle = np.sqrt(radius**2 - time**2)
    # its integral over time is the change of the slope's sine: here time / radius
    known = m.total_curvature(time, angle, rate=-time / angle)
    assert known == pytest.approx(2.4 / radius, rel=1e-12)
    assert m.total_curvature(time, angle) == pytest.approx(2.4 / radius, rel=1e-3)


def test_curvature_depends_on_the_unit_and_does_not_cancel():
    time = np.linspace(0.0, 2 * math.pi, 20001)
    angle, rate = 0.5 * np.sin(time), 0.5 * np.cos(time)
    # the sine of the slope goes from v/sqrt(1+v^2) to its negative and back: four times its largest
    # value
    for unit, scale in (("rad", 1.0), ("deg", 180 / math.pi)):
        v = 0.5 * scale
        found = m.total_curvature(time, angle, rate=rate, unit=unit)
        assert found == pytest.approx(4 * v / math.sqrt(1 + v * v), rel=1e-9)
    # a moving arm's wiggle counts less in degrees: same wiggle at rest and on a ramp of 10 deg/s
    wiggle, ramp = 1e-3 * np.sin(20 * time), math.radians(10) * time
    ratio = {
        u: m.total_curvature(time, ramp + wiggle, unit=u) / m.total_curvature(time, wiggle, unit=u)
        for u in ("rad", "deg")
    }
    assert ratio["rad"] > 0.9
    assert ratio["deg"] < 0.02


def test_squared_error_rms_and_lag_of_known_signals():
    time = np.linspace(0.0, 10.0, 10001)
    reference, late = 0.1 * time, 0.1 * (time - 0.75)
    for unit, error in (("rad", 0.075), ("deg", math.degrees(0.075))):
        assert m.squared_error(time, reference, late, unit=unit) == pytest.approx(10 * error**2)
    assert m.rms(time, reference, late) == pytest.approx(0.075)
    assert m.lag(time, reference, late) == pytest.approx(0.75)
    sine = np.sin(2 * math.pi * time)
    assert m.squared_error(time, 0 * time, 0.3 * sine) == pytest.approx(0.09 * 5.0)
    assert m.lag(time, np.ones_like(time), 0 * time) == 0.0


def test_a_batch_is_its_runs():
    time = np.linspace(0.0, 12.0, 1201)
    runs = [second_order(z, 3.0, time) for z in (0.2, 0.5, 0.8, 0.3)]
    angle, rate = (np.stack([run[k] for run in runs]) for k in range(2))
    reference = np.minimum(time, 1.0)
    parts = {"first": (0.0, 1.0), "later": (1.0, 12.0), "beyond": (20.0, 30.0)}
    together = m.evaluate(time, reference, angle, rate=rate, parts=parts)
    assert set(together.phases) == {"first", "later"}
    for k in range(4):
        one = m.evaluate(time, reference, angle[k], rate=rate[k], parts=parts)
        for name in ("squared_error", "curvature", "rms", "largest", "final", "lag"):
            assert isinstance(getattr(one, name), float)
            assert getattr(together, name)[k] == pytest.approx(getattr(one, name), rel=1e-12)
        for part, values in one.phases.items():
            found = {name: of[k] for name, of in together.phases[part].items()}
            assert found == pytest.approx(values, rel=1e-12)
    # squared errors of the parts add up to that of the whole
    whole = together.phases["first"]["rms"] ** 2 * 1.0 + together.phases["later"]["rms"] ** 2 * 11.0
    assert whole == pytest.approx(together.squared_error)


def test_combined_is_one_at_best_and_ranks_by_weights():
    nu, omega = np.array([[1.0, 2.0], [4.0, np.nan]]), np.array([[3.0, 1.0], [1.0, 1.0]])
    j = m.combined(nu, omega)
    assert j == pytest.approx(np.array([[0.25 + 2.25, 0.5 + 0.75], [1.0 + 0.75, np.inf]]))
    assert m.combined([2.0, 4.0], [1.0, 5.0]).min() == pytest.approx(1.0)  # one run best in both
    per_row = m.combined(nu, omega, axis=1)
    assert per_row == pytest.approx(np.array([[2.5, 1.25], [1.0, np.inf]]))
    assert m.combined(nu, omega, weights=(1.0, 0.0))[0, 0] == 1.0


def test_bad_input_is_named():
    refused(
        ("time", lambda: m.squared_error([0, 1, 1], [0, 0, 0], [0, 0, 0])),
        ("angle", lambda: m.squared_error([0, 1], [0, 0], [0, 0, 0])),
        ("reference", lambda: m.squared_error([0, 1], [0, 0, 0], [0, 0])),
        ("unit", lambda: m.squared_error([0, 1], [0, 0], [0, 0], unit="grad")),
        ("three", lambda: m.total_curvature([0, 1], [0, 0])),
        ("rate", lambda: m.total_curvature([0, 1, 2], [0, 0, 0], rate=[0, 0])),
        ("shapes", lambda: m.combined([1.0], [1.0, 2.0])),
        ("weights", lambda: m.combined([1.0], [1.0], weights=(-1.0, 1.0))),
        ("failed", lambda: m.combined([math.nan], [1.0])),
        ("error = 0", lambda: m.combined([0.0, 1.0], [1.0, 1.0])),
    )


def test_what_is_not_finite_is_refused_or_a_run_that_failed():
    time = np.linspace(0.0, 2.0, 201)
    good = 1.0 - np.exp(-3.0 * time)
    bad, late = good.copy(), good.copy()
    bad[50], late[5] = math.nan, math.inf
    reference = np.ones_like(time)
    functions = {
        "nu": lambda y: m.squared_error(time, reference, y),
        "omega": lambda y: m.total_curvature(time, y),
        "rms": lambda y: m.rms(time, reference, y),
        "lag": lambda y: m.lag(time, time, y),
        "lag of rest": lambda y: m.lag(time, reference, y),
        "final": lambda y: m.evaluate(time, reference, y).final,
        "phase": lambda y: m.phases(time, reference, y, {"end": (1.0, 2.0)})["end"]["rms"],
    }
    for name, function in functions.items():
        for wrong in (bad, late):
            with pytest.raises(ParameterError, match="angle is not finite"):
                function(wrong)
        found = function(np.stack([good, bad, late]))
        assert found[0] == pytest.approx(function(good)), name
        assert np.isnan(found[1:]).all(), name
    with pytest.raises(ParameterError, match="reference"):
        m.rms(time, bad, good)
