"""Parts of controllers against exact answers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pamrs
from pamrs.control import PID, FilteredDerivative, Fuzzy, Integrator, LowPass, PIDLaw, sweep
from pamrs.control.trajectories import step
from tests.simulation.refusals import refused


@given(st.floats(1e-3, 1.0), st.floats(1e-4, 0.1))
def test_low_pass_step_response_is_exact_at_samples(tau, period):
    filtered = LowPass(tau, period, initial=0.0)
    answers = [filtered.update(1.0) for _ in range(50)]
    exact = [-math.expm1(-(k + 1) * period / tau) for k in range(50)]
    assert answers == pytest.approx(exact, rel=1e-9)


def test_low_pass_begins_without_a_transient_and_zero_passes():
    filtered = LowPass(0.5, 0.01)
    assert [filtered.update(3.0) for _ in range(3)] == [3.0, 3.0, 3.0]
    through = LowPass(0.0, 0.01)
    assert [through.update(x) for x in (1.0, -2.0, 5.0)] == [1.0, -2.0, 5.0]
    mixed = LowPass(np.array([0.0, 0.5]), 0.01, initial=0.0)
    assert mixed.update(1.0) == pytest.approx([1.0, -math.expm1(-0.02)])


def test_filtered_derivative_of_a_ramp_is_exact():
    tau, period, slope = 0.05, 0.002, -3.0
    derivative = FilteredDerivative(tau, period)
    answers = [derivative.update(slope * k * period) for k in range(200)]
    assert answers == pytest.approx(
        [-slope * math.expm1(-k * period / tau) for k in range(200)], abs=1e-11
    )


@pytest.mark.parametrize("mode", ["clamping", "back_calculation", "none"])
def test_anti_windup(mode):
    how = {"anti_windup": mode, "tracking_time": 0.05}
    law = PIDLaw(2.0, 4.0, 0.0, period=0.01, limits=(-1.0, 1.0), **how)
    for _ in range(1000):
        assert law.update(3.0) == 1.0
    after = [law.update(-0.1) for _ in range(1000)]
    left = next((k for k, value in enumerate(after) if value < 1.0), None)
    # without, 4 * 3 * 10 s of windup are taken back by 0.4 per second: still there after ten
    assert left == (None if mode == "none" else 0)


def test_back_calculation_drives_the_integral_to_what_the_limit_allows():
    how = {"anti_windup": "back_calculation", "tracking_time": 0.1}
    law = PIDLaw(2.0, 4.0, 0.0, period=0.001, limits=(-1.0, 1.0), **how)
    for _ in range(5000):
        law.update(1.0)
    # ki e = excess/Tt in balance: 2 + I - 1 = 0.4
    assert law.integrator.value == pytest.approx(-0.6, abs=1e-6)


def test_clamping_lets_the_integral_come_back():
    integral = Integrator(0.1)
    integral.update(1.0, 0.5)
    assert integral.value == 0.0
    integral.update(-1.0, 0.5)
    assert integral.value == pytest.approx(-0.1)
    batch = Integrator(0.1)
    batch.update(np.array([1.0, -1.0, 1.0]), np.array([0.5, 0.5, 0.0]))
    assert batch.value == pytest.approx([0.0, -0.1, 0.1])


def test_wrong_arguments_are_named():
    refused(
        ("time_constant", lambda: LowPass(-1.0, 0.1)),
        ("time_constant", lambda: LowPass(math.nan, 0.1)),
        ("period", lambda: LowPass(1.0, 0.0)),
        ("period", lambda: LowPass(1.0, np.ones(2))),
        ("period", lambda: PID(1.0, period=np.ones(2))),
        ("limits", lambda: Fuzzy(1.0, 1.0, 1.0, limits=(0.0,))),
        ("limits", lambda: PID(1.0, limits=(0.0,))),
        ("limits", lambda: PID(1.0, limits="ab")),
        ("controller", lambda: sweep(pamrs.rigs.shoulder(), 3, step(0.3, 0.5), 0.1, n=2)),
        ("period", lambda: FilteredDerivative(1.0, -1.0)),
        ("anti_windup", lambda: Integrator(0.1, anti_windup="some")),
        ("tracking_time", lambda: Integrator(0.1, tracking_time=0.01)),
        ("limits", lambda: PIDLaw(1.0, 0.0, 0.0, period=0.1, limits=(1.0, 2.0))),
        ("kp", lambda: PIDLaw(math.inf, 0.0, 0.0, period=0.1, limits=(-1.0, 2.0))),
        ("kp", lambda: PIDLaw([[1.0]], 0.0, 0.0, period=0.1, limits=(-1.0, 2.0))),
        ("kp", lambda: PIDLaw("a", 0.0, 0.0, period=0.1, limits=(-1.0, 2.0))),
    )
