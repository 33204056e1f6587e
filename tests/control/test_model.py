"""What a model-based controller knows of a rig: inverses are inverses, and the simplified torque is
near the full one.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs import _core
from pamrs.control import (
    AirModel,
    ArmModel,
    ConductanceInverse,
    Feedforward,
    FullTorque,
    OrificeInverse,
    Reference,
    RigModel,
    SimplifiedTorque,
    torque_line,
)
from pamrs.errors import ParameterError
from pamrs.rig import Joint
from tests.control.helpers import CONDUCTANCE, with_iso_valve
from tests.reference.gas import iso_flow
from tests.simulation.refusals import refused

SHOULDER = pamrs.rigs.shoulder()


def rig_torque(rig, pressure, angle):
    muscle, joint = rig.muscle, Joint.from_model(rig.model["joint"])
    return joint.torque(muscle, pressure, angle, count=muscle.parameters["count"])


@pytest.mark.parametrize("name", ["shoulder", "elbow"])
def test_torque_is_a_line_in_the_pressure(name):
    rig = pamrs.rigs.named(name)
    angle = np.radians([20.0, 45.0, 80.0, 110.0])
    c1, c2 = torque_line(rig, angle)
    for pressure in (0.0, 2e5, 1.3e6):
        expected = rig_torque(rig, pressure, angle)
        assert c1 * pressure + c2 == pytest.approx(expected, rel=1e-10, abs=1e-9)


@pytest.mark.parametrize("name", ["shoulder", "elbow"])
def test_inverse_force_is_the_inverse_of_the_rig_s_torque(name):
    rig = pamrs.rigs.named(name)
    arm = ArmModel.from_rig(rig)
    for angle in np.radians([16.0, 33.3, 71.2, 100.0]).tolist():
        for torque in (5.0, 60.0):
            pressure = arm.pressure(torque, angle)
            assert float(rig_torque(rig, pressure, angle)) == pytest.approx(torque, rel=1e-7)
    assert arm.torque.error < 1e-9


def test_desired_pressure_holds_the_simulated_arm_where_it_should_be():
    """Inverse dynamics and inverse force against the simulator: at P_d without motion the net
    torque is zero.
    """
    rig = SHOULDER.with_parameters({"arm.coulomb": 0.0})
    controller = Feedforward.from_rig(rig, 1.0)
    arm = rig.model["arm"]
    weight = (arm["first_moment"] + arm["payload"] * arm["length"]) * arm["gravity"]
    for angle in (math.radians(degrees) for degrees in (30.0, 60.0, 90.0)):
        pressure = float(controller.desired_pressure(Reference(angle)))
        start = {"joint_angle": angle, "muscle_pressure": pressure}
        sample = pamrs.Simulator(rig, sample_time=1e-3, initial=start).observe()
        assert sample["joint_torque"] == pytest.approx(weight * math.sin(angle), rel=1e-6)


def test_air_of_the_feedforward_is_that_of_the_motion_it_is_told():
    """(4.13) at a pressure that is wanted: what flows makes up for the volume that grows."""
    air, arm = AirModel(SHOULDER), ArmModel.from_rig(SHOULDER)
    aim = Reference(math.radians(60.0), 0.4, 0.0)
    wanted = float(Feedforward(arm, air, 1.0).desired_pressure(aim))
    supply = air.supply_pressure

    def command(motion, degrees):
        """At the second of two samples 1 s apart in which the joint turns by 0.1 rad."""
        controller = Feedforward(arm, air, 1.0, motion=motion, rate_filter=0.0, period=1.0)
        last = math.radians(degrees)
        for time, angle in ((0.0, last - 0.1), (1.0, last)):
            volts = controller.update(time, {"joint_angle": angle, "muscle_pressure": wanted}, aim)
        return volts - 5.0

    told = air.command(0.0, wanted, supply, aim.angle, aim.rate)
    assert told > 0.1
    for degrees in (40.0, 70.0):
        assert command("commanded", degrees) == pytest.approx(told, rel=1e-12)
        there = air.command(0.0, wanted, supply, math.radians(degrees), 0.1)
        assert command("measured", degrees) == pytest.approx(there, rel=1e-9)
    told = "motion = 'guessed' is not allowed: one of 'commanded'"
    refused((told, lambda: Feedforward(arm, air, 1.0, motion="guessed")))


def test_a_muscle_of_two_branches_has_two_desired_pressures():
    """(4.12) with (4.4) up and with (4.7) down: each gives the torque in its own direction."""
    muscle = SHOULDER.muscle.replace(
        model="elbow_linear", bladder_modulus=1.5e6, extension_factors=(0.3, 0.8, 0.8)
    )
    rig = pamrs.Rig("two", {**SHOULDER.model, "muscle": {**muscle.parameters, "count": 6}})
    arm, joint = ArmModel.from_rig(rig), Joint.from_model(rig.model["joint"])
    down = FullTorque(rig, lengthening=True)
    both = Feedforward(arm, AirModel(rig), 1.0, lengthening=down)
    angle = math.radians(60.0)
    contraction = float(joint.shortening(angle)) / muscle.parameters["rest_length"]
    pressures = []
    for rate, direction in ((0.3, -1.0), (0.0, -1.0), (-0.3, 1.0)):
        pressure = float(both.desired_pressure(Reference(angle, rate, 0.0)))
        torque = 6 * muscle.force(pressure, contraction, direction) * joint.torque_arm(angle)
        assert float(torque) == pytest.approx(float(arm.weight) * math.sin(angle), rel=1e-7)
        pressures.append(pressure)
    assert pressures[0] == pressures[1] > pressures[2] + 1e3
    rates = np.array([0.3, 0.0, -0.3])
    together = both.desired_pressure(Reference(angle + 0.0 * rates, rates, 0.0 * rates))
    np.testing.assert_allclose(together, pressures, rtol=1e-12)
    # friction is no part of a line in the pressure
    rubbing = {**rig.model["muscle"], "friction_coefficient": 0.16}
    same = torque_line(pamrs.Rig("rubbing", {**rig.model, "muscle": rubbing}), angle)
    np.testing.assert_array_equal(same, torque_line(rig, angle))


GAS_KEYS = ("ambient_pressure", "temperature", "gas_constant", "heat_capacity_ratio")


def check_inverse(inverse, flows, size):
    """A passage of a size is found back from what it lets through (ratio -> flow), and nothing
    flows backwards.
    """
    upstream = 7.3e5
    ends = [inverse.critical, 0.998, 0.999, 0.9995, 0.99999]
    ratios = np.concatenate([np.linspace(0.02, 0.99, 98), ends])
    flow = flows(size, upstream, upstream * ratios)
    pairs = zip(flow.tolist(), (upstream * ratios).tolist(), strict=True)
    found = [inverse.size(one, upstream, downstream) for one, downstream in pairs]
    assert found == pytest.approx([size] * ratios.size, rel=1e-9)
    assert inverse.size(flow, upstream, upstream * ratios).tolist() == found
    assert inverse.flow(1e5, 2e5) == 0.0
    assert math.isfinite(inverse.size(1e-3, 2e5, 2e5))
    assert inverse.size(0.0, 2e5, 2e5) == 0.0
    return upstream, ratios, flow


def test_orifice_inverse_against_the_core():
    values = [SHOULDER.model["gas"][key] for key in GAS_KEYS]
    check_inverse(OrificeInverse(*values), _core.Gas(*values).mass_flow, 3.1e-6)


def test_area_table_backwards():
    air, valve = AirModel(SHOULDER), SHOULDER.model["valve"]
    opening = np.linspace(0.0, 1.0, 101)
    share = np.interp(opening, valve["opening"], valve["fraction"])
    assert air.opening(share) == pytest.approx(opening, abs=1e-12)
    assert [air.opening(float(a)) for a in share] == air.opening(share).tolist()
    assert air.opening(1e5) == 1.0


def test_conductance_inverse_against_the_core_and_iso_6358():
    gas = SHOULDER.model["gas"]
    values = [gas[key] for key in GAS_KEYS]
    core, size = _core.Gas(*values), 2.4e-8
    for b in (0.0, 0.2, 0.528, 0.9):
        inverse = ConductanceInverse(b, *values)
        upstream, ratios, flow = check_inverse(
            inverse, lambda c, *at, b=b: core.conductance_flow(c, b, *at), size
        )
        known = [iso_flow(size, b, upstream, upstream * r, gas["temperature"]) for r in ratios]
        assert flow == pytest.approx(known, rel=1e-12)


ISO = with_iso_valve(SHOULDER, (CONDUCTANCE, 0.3), (1.3 * CONDUCTANCE, 0.45))


@pytest.mark.parametrize("rate", [2e5, -1e5, 3e4])
@pytest.mark.parametrize(
    ("rig", "pressure"),
    [(SHOULDER, 4e5), (ISO, 1e5), (ISO, 4e5), (ISO, 11e5)],
    ids=["area", "iso low", "iso", "iso high"],
)
def test_the_valve_command_makes_the_wanted_pressure_rate_in_the_simulator(rate, rig, pressure):
    start = {"joint_angle": math.radians(60.0), "muscle_pressure": pressure, "joint_rate": 0.3}
    # the arm hardly moves in it
    simulator = pamrs.Simulator(rig, sample_time=1e-6, initial=start)
    sample, air = simulator.observe(), AirModel(rig)
    names = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")
    volts = air.command(rate, *(sample[name] for name in names))
    assert abs(volts) < air.half_range
    after = simulator.step(air.null + volts)
    found = (after["muscle_pressure"] - sample["muscle_pressure"]) / 1e-6
    assert found == pytest.approx(rate, rel=1e-3, abs=100.0)
    many = air.command(np.array([rate, -rate]), *(sample[name] for name in names))
    assert many[0] == pytest.approx(volts, rel=1e-12)


def test_a_valve_that_only_fills_is_asked_for_no_vent():
    air = AirModel(with_iso_valve(SHOULDER, (CONDUCTANCE, 0.3), (0.0, 0.3)))
    assert air.command(-1e5, 5e5, 1e6, 1.0, 0.0) == 0.0
    assert air.command(1e5, 5e5, 1e6, 1.0, 0.0) > 0.0
    assert air.command(np.array([-1e5, 1e5]), 5e5, 1e6, 1.0, 0.0)[0] == 0.0
    with pytest.raises(ParameterError, match=r"valve\.fill_conductance = 0 .*fills nothing"):
        AirModel(with_iso_valve(SHOULDER, (0.0, 0.3), (CONDUCTANCE, 0.3)))


def test_gain_of_a_pressure_loop_is_by_the_conductance_that_fills():
    """The equivalent area asks for the same gain, twice the conductance for half of it."""
    gas = SHOULDER.model["gas"]
    unit = _core.Gas(*(gas[key] for key in GAS_KEYS)).area_of_conductance(1.0)
    same = with_iso_valve(SHOULDER, (8.4e-6 / unit, 0.528), (8.4e-6 / unit, 0.528))
    wide = with_iso_valve(SHOULDER, (2 * 8.4e-6 / unit, 0.528), (1e-9, 0.2))
    gains = [RigModel(rig).pressure_loop("", period=0.005).kp for rig in (SHOULDER, same, wide)]
    assert gains[1] == pytest.approx(gains[0], rel=0.01)
    assert gains[2] == pytest.approx(0.5 * gains[1], rel=0.01)


def test_no_air_where_the_supply_is_below_the_muscle():
    air, supplies = AirModel(SHOULDER), np.array([4e5, 9e5, 4e5])
    assert air.command(1e5, 5e5, 4e5, 1.0, 0.0) == 0.0
    assert air.command(np.array([1e5, 1e5, -1e5]), 5e5, supplies, 1.0, 0.0)[0] == 0.0
    assert air.command(0.0, 5e5, 4e5, 1.0, 0.0) == 0.0


def test_simplified_torque_is_the_least_squares_fit_with_its_residual():
    from scipy.optimize import least_squares

    fit = SimplifiedTorque.fit(SHOULDER)
    assert fit.relative < 0.005  # 0.38 % of the largest torque
    assert fit.rms < 6.0
    assert fit.largest < 30.0
    angle, pressure = np.radians(np.linspace(15, 110, 191)), np.linspace(0, 13.8e5, 21)
    torque = np.array([rig_torque(SHOULDER, p, angle) for p in pressure])

    def residual(k):
        slope, rest = np.polyval(k[:4], angle), np.polyval(k[4:], angle)
        return (np.outer(pressure / 1e6, slope) + rest - torque).ravel()

    k = np.array(fit.coefficients) * np.repeat([1e6, 1.0], 4)
    assert np.sqrt(np.mean(residual(k) ** 2)) == pytest.approx(fit.rms, rel=1e-9)
    better = least_squares(residual, k)
    assert better.cost == pytest.approx(0.5 * np.sum(residual(k) ** 2), rel=1e-8)
    c1, c2 = fit.at(angle)
    assert [fit.at(float(a)) for a in angle] == list(zip(c1.tolist(), c2.tolist(), strict=True))
    assert fit.at(0.0) == fit.at(math.radians(15.0))


def test_wrong_models_and_rigs_that_they_cannot_be_of_are_named():
    for name in ("bench", "two_joint_arm", "tube"):
        refused((name, lambda name=name: ArmModel.from_rig(pamrs.rigs.named(name))))
    for name in ("recruitment", "antagonistic_joint", "two_joint_arm"):
        told = f"{name}.*exactly one"
        refused((told, lambda name=name: torque_line(pamrs.rigs.named(name), 1.0)))
    refused(
        ("inertia", lambda: ArmModel.from_rig(SHOULDER).replace(inertia=math.nan)),
        ("torque = 'other'", lambda: ArmModel.from_rig(SHOULDER, torque="other")),
        ("eight", lambda: SimplifiedTorque([1.0], (0.0, 1.0))),
        ("above zero", lambda: SimplifiedTorque([0, 0, 0, -1.0, 0, 0, 0, 0], (0.0, 1.0))),
    )
