"""Linear models of rigs with effects, sensors that are off, several joints, dry friction; and of
controllers with corners.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import PID, closed_loop
from pamrs.control.linear import equilibrium, linear_controller, linearise
from pamrs.control.stability import margins
from pamrs.control.trajectories import step
from pamrs.errors import ParameterError
from tests.control.helpers import SmallPid
from tests.simulation.refusals import refused
from tests.tables import rows_of

ANGLE = math.radians(45)
#: What each moving effect adds, where the model has to show it.
MOVING = rows_of(__file__, "moving")
#: effects that have no linear model
KINKED = ("valve_dead_zone", "valve_hysteresis", "mullins_softening", "parameter_drift")
KINKED += ("gauge_drift", "load_cell_drift", "clock_skew", "sensor_lag")


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


@pytest.mark.parametrize("effect", MOVING)
def test_states_of_effects_are_in_the_model(rig, effect):
    """That the model moves as the core does with each of them is said by test_linear.py."""
    given, states = MOVING[effect]
    altered = rig.with_effect(effect, given)
    model = linearise(altered, ANGLE, side="fill")
    assert list(model.states[3:]) == states
    bare = linearise(rig, ANGLE, side="fill")
    assert model.outputs == bare.outputs
    # the effect is in it: without, the answer is another one
    period = 0.3
    out, other = (m.c @ m.sampled(period)[1][:, 0] for m in (model, bare))
    assert np.abs(out / other - 1.0).max() > 1e-3


@pytest.mark.parametrize("effect", KINKED)
def test_what_has_no_linear_model_is_refused_by_name(rig, effect):
    with pytest.raises(ParameterError, match=f"{effect}.*no linear model"):
        linearise(rig.with_effect(effect), ANGLE)


def test_a_relay_of_the_supply_matters_only_where_the_supply_moves(rig):
    fed = rig.with_effect("compressor_cut_in")
    assert linearise(fed, ANGLE).a == pytest.approx(linearise(rig, ANGLE).a, rel=1e-12, abs=1e-12)
    with pytest.raises(ParameterError, match="compressor_cut_in"):
        linearise(fed, ANGLE, held=())


def test_play_and_dead_zone_of_no_width_and_lags_of_no_time_are_none(rig):
    same = rig.with_effect("input_path_lag", {"time_constant": 0.0, "delay": 0.0})
    same = same.with_effect("pressure_lag", {"time_constant": 0.0})
    for play in ("valve_dead_zone", "valve_hysteresis"):
        same = same.with_effect(play, {"half_width": 0.0})
    bare, model = linearise(rig, ANGLE), linearise(same, ANGLE)
    assert model.states == bare.states
    for name in "abc":
        assert getattr(model, name) == pytest.approx(getattr(bare, name), rel=1e-9, abs=1e-9)


def test_a_command_that_moves_nothing_is_refused(rig):
    start = equilibrium(rig, ANGLE)
    with pytest.raises(ParameterError, match="valve_command moves nothing"):
        linearise(rig, ANGLE, side="fill", initial={"supply_pressure": start["muscle_pressure"]})


def test_zeros_of_sensors_move_no_operating_point(rig):
    off = rig.with_parameters({"sensors.angle_zero": 0.05, "sensors.pressure_zero": 700.0})
    true, read = linearise(rig, ANGLE), linearise(off, ANGLE)
    assert read.a == pytest.approx(true.a, rel=1e-9, abs=1e-9)
    assert read.b == pytest.approx(true.b, rel=1e-9, abs=1e-9)
    assert read.point["joint_angle"] == pytest.approx(ANGLE + 0.05)  # what a controller sees there
    assert read.point["muscle_pressure"] == pytest.approx(true.point["muscle_pressure"] + 700.0)


def test_dry_friction_at_rest_and_in_motion_have_boundaries_of_their_own(rig):
    def made(kp):
        return PID(kp, period=0.005)

    def stable(friction, kp):
        models = [linearise(rig, ANGLE, side=s, friction=friction) for s in ("fill", "vent")]
        return all(margins(model, made(kp)).stable for model in models)

    gains = (0.44, 0.5, 7.5, 8.5)
    assert [stable("rest", kp) for kp in gains] == [True, True, True, False]
    assert [stable("moving", kp) for kp in gains] == [True, False, False, False]
    moving = linearise(rig, ANGLE, friction="moving")
    bare = linearise(rig.with_parameters({"arm.coulomb": 0.0}), ANGLE)
    assert moving.a == pytest.approx(bare.a, rel=1e-12, abs=1e-12)
    # between both bounds the arm forgets a small push, and swings for good after a large one; below
    # both it forgets any
    start = equilibrium(rig, ANGLE)
    for kp, push, swings in ((7.0, 0.1, False), (7.0, 0.3, True), (0.4, 0.3, False)):
        aside = {**start, "joint_angle": ANGLE + push}
        run = closed_loop(rig, made(kp), step(ANGLE, ANGLE, duration=12.0), initial=aside)
        late = np.ptp(run.angle[run.time > 9.0])
        assert (late > 1.0) == swings, (kp, push, late)
        assert (late < 0.1) != swings, (kp, push, late)


class DeadBand(SmallPid):
    """Proportional outside an error of 0.01 rad, silent inside."""

    def update(self, time, measurement, reference):
        error = reference.angle - measurement["joint_angle"]
        return self.null + self.kp * math.copysign(max(abs(error) - 0.01, 0.0), error)


def test_a_corner_of_a_controller_is_refused_or_a_side_is_chosen(rig):
    point, law = linearise(rig, ANGLE).point, DeadBand(kp=2.0)
    for side, slope in (("down", -2.0), ("mean", -1.0)):
        found = linear_controller(law, point, ANGLE + 0.01 + 1e-12, side=side).d[0, 0]
        assert found == pytest.approx(slope, rel=1e-4)
    assert linear_controller(law, point, ANGLE + 0.02).d[0, 0] == pytest.approx(-2.0)
    one_side = SmallPid(kp=2.0, ki=0.0)  # of a valve that is at its end
    refused(
        (r"corner.*command over joint_angle", lambda: linear_controller(law, point, ANGLE + 0.01)),
        ("at a limit", lambda: linear_controller(law, point)),
        ("corner", lambda: linear_controller(one_side, point, ANGLE + 2.5)),
    )
