"""What an arm lifts and holds: laws, and the same found by a simulation that comes to rest."""

import math

import numpy as np
import pytest

import pamrs
from pamrs import rigs
from pamrs.rig import Joint, Rig
from reproduction.lifting import lift
from tests.simulation.refusals import refused

PSI, LB = 6894.757293168361, 0.45359237
FULL = 150.0 * PSI
#: (2.36), the friction hysteresis of the 0.75-in muscle
HYSTERESIS = {
    "friction_coefficient": 0.16,
    "friction_pressure_slope": -0.145e-6,
    "friction_floor": 0.01,
}


def changed(rig, **blocks):
    """A rig with other entries of its blocks; None leaves a block out."""
    model = rig.model
    for block, entries in blocks.items():
        model[block] = None if entries is None else {**model[block], **entries}
    return Rig(rig.name, model)


@pytest.fixture(scope="module")
def elbow():
    return rigs.named("elbow")


def rest_angle(rig, pressure, *, start=None, seconds=40.0):
    """Angle of rest by brute force: pressure raised slowly (or, from a given angle, on at once),
    arm damped until nothing moves.
    """
    fed = changed(rig, supply=None, valve=None, arm={"viscous": 150.0})
    given = np.full(round(seconds / 0.02), pressure)
    initial = {"joint_angle": start}
    if start is None:
        given *= np.minimum(np.arange(given.size) * 0.02 / (0.5 * seconds), 1.0)
        initial = {}
    result = pamrs.simulate(fed, pressure=given, sample_time=0.02, initial=initial)
    assert abs(float(result["joint_rate"][-1])) < 1e-5, "it has not come to rest"
    return float(result["joint_angle"][-1])


# ----------------------------------------------------------------------------- laws


def test_torques_are_those_of_joint_and_gravity(elbow):
    result = lift(elbow, pressure=FULL, points=50)
    model = elbow.model
    joint = Joint.from_model(model["joint"])
    np.testing.assert_allclose(
        result.torque, joint.torque(elbow.muscle, FULL, result.angle, count=6), rtol=1e-12
    )
    np.testing.assert_array_equal(result.torque, result.torque_holding)  # no hysteresis in the rig
    moment = model["arm"]["first_moment"] + 100.0 * LB * 0.508
    np.testing.assert_allclose(result.gravity, moment * 9.80665 * np.sin(result.angle), rtol=1e-12)
    assert result.angle[0] == model["joint"]["min_angle"]
    assert result.angle[-1] == model["joint"]["max_angle"]


def test_the_angle_reached_is_where_the_torques_meet(elbow):
    result = lift(elbow, pressure=FULL)
    assert not result.can_lift
    at = lift(elbow, pressure=FULL, to=result.reached)
    assert at.torque[-1] - at.coulomb == pytest.approx(at.gravity[-1], rel=1e-9)
    assert at.margin == pytest.approx(0.0, abs=1e-6)
    before = lift(elbow, pressure=FULL, to=result.reached - 1e-4)
    assert before.can_lift
    assert before.reached == before.angle[-1]


def test_capacity_is_the_payload_that_reaches_an_angle(elbow):
    light = lift(elbow, pressure=FULL, points=200)
    for row in (20, 100, 190):
        again = lift(changed(elbow, arm={"payload": float(light.capacity[row])}), pressure=FULL)
        assert again.reached == pytest.approx(float(light.angle[row]), abs=1e-9)


@pytest.mark.parametrize("degrees", [30.0, 60.0, 90.0, 120.0])
def test_payload_limit_is_just_lifted(elbow, degrees):
    to = elbow.model["joint"]["max_angle"] if degrees == 120.0 else math.radians(degrees)
    limit = lift(elbow, pressure=FULL, to=to).payload_limit
    less, more = (changed(elbow, arm={"payload": f * limit}) for f in (0.9999, 1.0001))
    assert lift(less, pressure=FULL, to=to).can_lift
    assert not lift(more, pressure=FULL, to=to).can_lift


def test_the_limit_inside_the_range_is_found_between_the_points(elbow):
    # a cam whose lever is shortest in the middle of the range
    level = {"kind": "polynomial", "coefficients": [0.03, -0.03, 0.0167]}
    level |= {"rest_angle": 0.3, "min_angle": 0.3, "max_angle": 1.9}
    kept = {name: elbow.model["joint"][name] for name in ("stop_stiffness", "stop_damping")}
    rig = Rig("cam", elbow.model | {"joint": kept | level})
    coarse, fine = lift(rig, pressure=FULL, points=31), lift(rig, pressure=FULL, points=20001)
    assert 0.3 < fine.limit_angle < 1.9
    assert coarse.payload_limit == pytest.approx(fine.payload_limit, rel=1e-8)
    assert coarse.payload_limit <= coarse.capacity.min()
    # a payload between what the middle and the end take: stopped in the middle, lifted again beyond
    heavy = rig.with_parameters({"arm.payload": 1.05 * fine.payload_limit})
    result = lift(heavy, pressure=FULL)
    assert not result.can_lift
    (first, last) = result.regained[0]
    assert result.reached < fine.limit_angle < first < last == result.angle[-1]
    plain = changed(heavy, arm={"coulomb": 0.0})
    reached = lift(plain, pressure=FULL).reached
    assert rest_angle(plain, FULL) == pytest.approx(reached, abs=2e-4)


def test_friction_narrows_what_is_lifted_and_widens_what_is_held(elbow):
    plain = lift(elbow, pressure=FULL)
    rough = lift(changed(elbow, arm={"coulomb": 15.0}), pressure=FULL)
    assert rough.reached < plain.reached < plain.held < rough.held
    hysteretic = lift(changed(elbow, muscle=HYSTERESIS), pressure=4e5)
    widened = hysteretic.torque_holding / hysteretic.torque
    np.testing.assert_allclose(widened[:300], 1.102 / 0.898, rtol=1e-9)
    friction = {"friction_constant": 10.0, "friction_pressure": 2e-5, "presliding": 1e-3}
    effect = elbow.with_effect("muscle_hysteresis", friction)
    change = lift(effect, pressure=4e5).torque - lift(elbow, pressure=4e5).torque
    arm = Joint.from_model(elbow.model["joint"]).moment_arm(plain.angle)
    np.testing.assert_allclose(change, -6 * (10.0 + 8.0) * arm, rtol=1e-8, atol=1e-9)


def test_each_muscle_has_the_friction_that_acts_on_it():
    plain = rigs.named("antagonistic_joint")

    def lost(**constants):
        rig = plain
        for at, constant in constants.items():
            values = {"friction_constant": constant, "friction_pressure": 0.0, "presliding": 1e-3}
            rig = rig.with_effect("muscle_hysteresis", values, at="" if at == "all" else at)
        return lift(plain, pressure=2e5).torque - lift(rig, pressure=2e5).torque

    one, other = lost(flexor=10.0), lost(extensor=4.0)
    assert np.abs(one).max() > 0.0
    assert np.abs(other).max() > 0.0
    both = lost(flexor=10.0, extensor=10.0)
    for found, expected in (
        (lost(flexor=10.0, extensor=4.0), one + other),
        (lost(extensor=4.0, flexor=10.0), one + other),
        (lost(all=10.0), both),
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_a_spring_and_a_tilted_base_are_counted():
    """By the equilibrium of the joint at the angle where it is decided."""
    plain_rig, spring = rigs.shoulder(), (25.0, math.radians(40.0))
    rig = plain_rig.with_parameters(
        {
            "joint.stiffness": spring[0],
            "joint.spring_angle": spring[1],
            "arm.base_angle": math.radians(-25.0),
            "arm.centre_angle": math.radians(20.0),
        }
    )
    result, plain = lift(rig, pressure=8e5), lift(plain_rig, pressure=8e5)
    arm = rig.model["arm"]
    link = result.angle + arm["base_angle"]
    expected = arm["gravity"] * (
        arm["first_moment"] * np.sin(link + arm["centre_angle"])
        + arm["payload"] * arm["length"] * np.sin(link)
    ) + spring[0] * (result.angle - spring[1])
    np.testing.assert_allclose(result.gravity, expected, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(result.torque, plain.torque)
    assert result.payload_limit != plain.payload_limit


# ------------------------------------------------------------------ by brute force


@pytest.mark.parametrize(
    ("pounds", "psi"),
    [(100.0, 150.0), (100.0, 60.0), (135.0, 150.0), (380.0, 150.0), (500.0, 150.0)],
)
def test_simulation_comes_to_rest_at_the_angle_reached(elbow, pounds, psi):
    rig = changed(elbow, arm={"coulomb": 0.0, "payload": pounds * LB})
    result = lift(rig, pressure=psi * PSI)
    assert not result.can_lift
    assert rest_angle(rig, psi * PSI) == pytest.approx(result.reached, abs=2e-5)


def test_simulation_with_hysteresis_rests_between_lifted_and_held(elbow):
    rig = changed(elbow, arm={"coulomb": 0.0}, muscle=HYSTERESIS)
    result = lift(rig, pressure=6e5)
    assert math.degrees(result.held - result.reached) > 4.0
    # lifted slowly: the shortening branch; sunk from above: the other branch
    assert rest_angle(rig, 6e5) == pytest.approx(result.reached, abs=2e-4)
    assert rest_angle(rig, 6e5, start=1.9) == pytest.approx(result.held, abs=2e-4)


# -------------------------------------------------------------------------- errors


def test_bad_arguments(elbow):
    no_supply = changed(elbow, supply=None, valve=None)
    refused(
        (r"rig 'sealed_chamber' has no \[muscle\]", lambda: lift(rigs.sealed_chamber())),
        (r"pressure is missing: the rig 'elbow' has no \[supply\]", lambda: lift(no_supply)),
        ("points = 2", lambda: lift(elbow, points=2)),
    )
    for value in (math.nan, math.inf, -1.0):
        refused(("pressure = ", lambda value=value: lift(elbow, pressure=value)))
    told = r"to = .* rad .* at most joint.max_angle = 120.0 deg"
    for value in (0.1, 3.0, math.nan):
        refused((told, lambda value=value: lift(elbow, to=value)))


def test_the_pressure_of_the_supply_is_the_default(elbow):
    assert lift(elbow).pressure == pytest.approx(8.3e5)
