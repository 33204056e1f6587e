"""PID and fuzzy control against hand computation, scipy and the text."""

import inspect
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamrs.control import (
    PID,
    AdaptiveSliding,
    Feedforward,
    Fuzzy,
    Neural,
    PressureLoop,
    Reference,
    Sliding,
    fuzzy_rules,
    fuzzy_surface,
)
from pamrs.errors import ParameterError
from tests.control.cases import AIR, FULL
from tests.simulation.refusals import refused


def surface(x, y):
    rules = fuzzy_rules()
    return fuzzy_surface(x, y, rules.tolist(), rules)


def test_pid_by_hand_with_filtered_derivative():
    controller = PID(2.0, 1.0, 0.5, period=0.1, output_filter=0.0, rate_filter=0.0)
    one = controller.update(0.0, {"joint_angle": 0.3}, Reference(0.5, 0.2))
    two = controller.update(0.1, {"joint_angle": 0.32}, Reference(0.52, 0.2))
    assert one == pytest.approx(5.0 + 2.0 * 0.2 + 0.5 * 0.2)
    assert two == pytest.approx(5.0 + 2.0 * 0.2 + 0.02 + 0.5 * (0.2 - 0.2))


def test_pid_reads_the_rate_where_it_is_told_to():
    controller = PID(0.0, 0.0, 1.0, output_filter=0.0, rate_filter=0.0, measured_rate=True)
    assert controller.update(
        0.0, {"joint_angle": 0.3, "joint_rate": 0.7}, Reference(0.3, 0.2)
    ) == pytest.approx(4.5)
    with pytest.raises(ParameterError, match="joint_rate"):
        controller.update(1e-3, {"joint_angle": 0.3}, Reference(0.3))


def test_units_of_the_gains():
    sample, aim = {"joint_angle": 0.3}, Reference(0.31, 0.0)
    degrees = PID(1.0, unit="deg", output_filter=0.0).update(0.0, sample, aim)
    assert degrees == pytest.approx(5.0 + math.degrees(0.01))
    for one, other in (
        (PID(math.degrees(1.0), output_filter=0.0), PID(1.0, unit="deg", output_filter=0.0)),
        (
            Fuzzy(math.degrees(0.4), math.degrees(0.3), 0.7, unit="deg", output_filter=0.0),
            Fuzzy(0.4, 0.3, 0.7, output_filter=0.0),
        ),
    ):
        answers = [made.update(0.0, sample, aim) for made in (one, other)]
        assert answers[0] == pytest.approx(answers[1])
    refused(("unit", lambda: PID(1.0, unit="grad")))


@pytest.mark.parametrize(
    "make", [lambda **k: PID(1e4, **k), lambda **k: Fuzzy(1e-3, 1.0, 20.0, **k)]
)
def test_volts_stay_within_the_valve_s_range(make):
    for aim, limit in ((2.0, 10.0), (-2.0, 0.0)):
        controller = make(output_filter=0.01)
        answers = [
            controller.update(k * 1e-3, {"joint_angle": 0.0}, Reference(aim)) for k in range(200)
        ]
        assert min(answers) >= 0.0
        assert max(answers) <= 10.0
        assert answers[-1] == pytest.approx(limit, abs=1e-6)
    assert PID(1.0).update(0.0, {"joint_angle": 0.5}, Reference(0.5)) == 5.0


def test_a_bias_moves_the_limits_of_the_anti_windup():
    controller = PID(1.0, 5.0, output_filter=0.0)
    for k in range(2000):
        assert controller.answer(k * 1e-3, {"joint_angle": 0.0}, Reference(0.5), 5.0) == 10.0
    assert controller.law.integrator.value == 0.0


# ---------------------------------------------------------------- fuzzy


def test_rule_table():
    rules = np.rint(3 * fuzzy_rules()).astype(int)
    assert rules[0].tolist() == [-3, -3, -3, -3, -2, -1, 0]
    assert rules[3].tolist() == [-3, -2, -1, 0, 1, 2, 3]
    assert rules[6].tolist() == [0, 1, 2, 3, 3, 3, 3]


def test_a_table_of_indices_gives_the_centres_of_the_sets():
    rules = fuzzy_rules()
    assert rules[2, 4] == 0.0  # error NS and rate PS give ZE
    assert np.array_equal(fuzzy_rules(3.0 * rules), rules)
    refused(("7 x 7", lambda: fuzzy_rules(np.zeros((6, 7)))))


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [(PID, (1.0,)), (Fuzzy, (1.0, 1.0, 1.0)), (Feedforward, (FULL, AIR))],
)
def test_options_of_the_sensor_are_those_of_the_controller(kind, arguments):
    options = {"rate_filter", "angle_filter", "measured_rate"}
    assert options <= set(inspect.signature(kind).parameters)
    with pytest.raises(TypeError, match=rf"^{kind.__name__}\..*kpp"):
        kind(*arguments, kpp=3)


def test_surface_at_the_centres_is_the_table_and_by_hand_between():
    centres = [(k - 3) / 3 for k in range(7)]
    rules = fuzzy_rules()
    for i, x in enumerate(centres):
        for j, y in enumerate(centres):
            assert surface(x, y) == pytest.approx(rules[i, j], abs=1e-12)
    # x = 1/12: ZE 3/4, PS 1/4; y = 1/6: ZE 1/2, PS 1/2; premises 1/2, 1/2, 1/4, 1/4 for ZE, PS, PS,
    # PM
    area = {m: m - m * m / 2 for m in (0.5, 0.25)}
    expected = (area[0.5] * 1 / 3 + area[0.25] * 1 / 3 + area[0.25] * 2 / 3) / (
        2 * area[0.5] + 2 * area[0.25]
    )
    assert surface(1 / 12, 1 / 6) == pytest.approx(expected, abs=1e-12)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_surface_is_odd_bounded_and_saturates_at_the_shoulders(x, y):
    value = surface(x, y)
    assert -1.0 <= value <= 1.0
    assert surface(-x, -y) == pytest.approx(-value, abs=1e-12)
    assert value == surface(max(-1.0, min(1.0, x)), max(-1.0, min(1.0, y)))


def test_surface_rises_but_for_what_the_minimum_does():
    x = np.linspace(-1.1, 1.1, 401)
    grid = np.meshgrid(x, x, indexing="ij")
    f = surface(grid[0].ravel(), grid[1].ravel()).reshape(401, 401)
    for axis in (0, 1):
        fall = (np.maximum.accumulate(f, axis=axis) - f).max()
        assert fall < 0.0075
    assert f.min() == -1.0
    assert f.max() == 1.0


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=20))
def test_batch_of_the_surface_is_the_scalars_bit_for_bit(points):
    x, y = np.array(points).T
    assert surface(x, y).tolist() == [surface(*point) for point in points]


# ---------------------------------------------------------------- the protocol


def test_time_is_watched():
    controller = PID(1.0, period=0.01)
    sample, aim = {"joint_angle": 0.0}, Reference(0.1)
    controller.update(5.0, sample, aim)
    controller.update(5.0149, sample, aim)
    controller.update(5.02, sample, aim)
    for wrong in (5.02, 5.019, 4.0, 5.036, math.nan, math.inf):
        with pytest.raises(ParameterError, match="time = "):
            controller.update(wrong, sample, aim)
    controller.update(5.03, sample, aim)
    controller.reset()
    controller.update(0.0, sample, aim)


def test_lengths_of_a_batch_must_agree():
    with pytest.raises(ParameterError, match="lengths"):
        PID(np.ones(3), np.ones(2))
    controller = PID(np.ones(3))
    with pytest.raises(ParameterError, match="batch of 3"):
        controller.update(0.0, {"joint_angle": np.zeros(4)}, Reference(0.0))
    assert controller.update(0.0, {"joint_angle": 0.0}, Reference(0.0)).shape == (3,)


def test_gains_can_be_read_and_not_changed():
    valve = {"null": 5.0, "limits": (0.0, 10.0), "unit": "rad"}
    for made, names in (
        (PID(1.4, 2.5, 0.1), {"kp": 1.4, "ki": 2.5, "kd": 0.1, **valve}),
        (Fuzzy(0.45, 0.6, 0.65), {"g1": 0.45, "g2": 0.6, "h": 0.65, **valve}),
        (PressureLoop(1.0, 2.0), {"kp": 1.0, "ki": 2.0, "null": 5.0}),
        (Feedforward(FULL, AIR, 0.7), {"km": 0.7, "null": 5.0}),
        (Sliding(FULL), {"slope": 5.0, "switching": 2e4, "boundary_layer": 0.2}),
        (AdaptiveSliding(FULL), {"gains": (1.0, 5.0, 300.0), "deadband": 0.02}),
        (Neural(FULL), {"gains": (300.0, 2e4, 3e5), "deadband": 0.02, "nodes": 22}),
    ):
        for name, value in names.items():
            assert getattr(made, name) == value
            with pytest.raises(AttributeError, match=f"{name} of a {type(made).__name__}"):
                setattr(made, name, 50.0)
    with pytest.raises(ValueError, match="read-only"):
        PID(np.ones(3)).kp[0] = 2.0


def test_a_feedforward_of_no_gain_closes_the_valve():
    sample = {"joint_angle": 0.5, "muscle_pressure": 3e5}
    assert Feedforward(FULL, AIR, 0.0).update(0.0, sample, Reference(1.0, 0.5)) == 5.0
