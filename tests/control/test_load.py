"""Controllers of a mass that hangs from a muscle: its pull, its equation of motion, and loops whose
error is known.
"""

import dataclasses
import math

import numpy as np
import pytest

import pamrs
from pamrs.control import (
    PID,
    AirModel,
    ArmModel,
    ByLength,
    Cascade,
    Feedforward,
    LoadModel,
    Reference,
    RigController,
    RigModel,
    cascaded_pid,
    closed_loop,
    run_live,
    sweep,
)
from pamrs.control.linear import linear_controller, linearise
from pamrs.control.simulated_device import SimulatedDevice, VirtualClock
from pamrs.control.stability import margins
from pamrs.control.trajectories import cosine_cycles, lift_hold_return, step
from pamrs.control.tuning import gain_map
from tests.simulation.refusals import refused

RIG = pamrs.rigs.named("hanging_mass")
MODEL = RigModel(RIG)
ARM = MODEL.arm
PERIOD = 0.005
LIFT = cosine_cycles(0.272, 0.235, rise=3.0, hold=2.0, cycles=1)
SMOOTH = RIG.with_parameters({"load.coulomb": 0.0})


def rms(run, since=1.0):
    """Root mean square and largest error [mm]."""
    error = 1e3 * run.error[run.time >= since]
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


@pytest.mark.parametrize("length", [0.275, 0.25, 0.22, 0.19])
@pytest.mark.parametrize("pressure", [0.0, 2e5, 6e5])
def test_the_line_is_the_pull_of_the_simulated_muscle(length, pressure):
    start = {"length": length, "muscle_pressure": pressure}
    sample = pamrs.Simulator(RIG, sample_time=1e-3, initial=start).observe()
    c1, c2 = ARM.torque.at(ARM.rest_length - length)
    pull = max(c1 * pressure + c2, 0.0)  # beyond it the muscle is slack
    assert pull == pytest.approx(sample["muscle_force"], rel=1e-7, abs=1e-5)


def test_the_pressure_asked_for_accelerates_the_mass_as_asked():
    """Model, line and drive together against the core: ``m x'' = F - m g - c x'``."""
    length, rate, wanted = 0.245, -0.03, 0.8
    x = ARM.rest_length - length
    pressure = float(ARM.pressure(ARM.inverse_dynamics(x, -rate, -rate, -wanted), x))
    assert 0.0 < pressure < MODEL.pressure_limit
    start = {"length": length, "length_rate": rate, "muscle_pressure": pressure}
    after = pamrs.Simulator(SMOOTH, sample_time=1e-6, initial=start).step(5.0)
    assert (after["length_rate"] - rate) / 1e-6 == pytest.approx(wanted, rel=1e-3)


def test_columns_sum_to_the_pull():
    motion = (0.02, 0.1, -0.2, 0.7)
    columns = ARM.regressor(*motion)
    total = sum(p.value * c for p, c in zip(ARM.parameters, columns, strict=True))
    assert total == pytest.approx(ARM.inverse_dynamics(*motion), rel=1e-12)
    load = RIG.tables("load")[""]
    assert ARM.weight == pytest.approx(load["mass"] * load["gravity"])
    assert ARM.angle_range == pytest.approx((0.276 - 0.28, 0.276 - 0.18))


#: Root mean square error [mm] of a stroke of 37 mm, as packaged: measured, and 15 % more.
FOUND = {"feedforward": 0.68, "sliding": 0.75, "adaptive": 0.73}


@pytest.mark.parametrize("kind", FOUND)
def test_every_law_follows_a_length(kind):
    law = MODEL.law(kind, period=PERIOD, **({"friction": True} if kind == "feedforward" else {}))
    run = closed_loop(RIG, RigController(MODEL, law), LIFT, 10.0)
    assert run.joints == ("length",)
    assert np.array_equal(run.angle, run.channels["length"])
    assert run.error[0] == pytest.approx(0.272 - run.channels["length"][0])
    assert rms(run)[0] < 1.15 * FOUND[kind]
    found = run.metrics()
    assert found.rms == pytest.approx(float(np.sqrt(np.mean(run.error**2))), rel=0.01)
    assert found.unit == "m"
    refused(("'deg' is not allowed: 'm' is needed", lambda: run.metrics(unit="deg")))


def test_the_rig_s_controller_is_the_one_of_its_muscle_by_length():
    law = MODEL.law("sliding", period=PERIOD)
    loop = MODEL.pressure_loop("", period=PERIOD)
    parts = ByLength(Cascade(law, loop), RIG)
    whole = RigController(MODEL, MODEL.law("sliding", period=PERIOD))
    one, other = (closed_loop(RIG, c, LIFT, 3.0) for c in (whole, parts))
    assert one.angle == pytest.approx(other.angle, abs=1e-12)
    forward = Feedforward(ARM, AirModel(RIG), 20.0, friction=True, period=PERIOD)
    assert rms(closed_loop(RIG, ByLength(forward, RIG), LIFT, 10.0))[0] < 1.15 * 0.68


@pytest.mark.parametrize("kind", ["pid", "cascaded"])
def test_an_output_feedback_comes_to_rest_at_a_length(kind):
    """An integral leaves no error on a rig without dry friction; pressure and weight then agree."""
    controller = PID(200.0, 100.0, period=PERIOD)
    if kind == "cascaded":
        gains, loop = {"kp": 2e6, "ki": 1e7, "kd": 0.0}, MODEL.pressure_loop("", period=PERIOD)
        controller = cascaded_pid(MODEL.pressure_limit, **gains, period=PERIOD, inner=loop)
    run = closed_loop(SMOOTH, ByLength(controller, RIG), step(0.27, 0.25, duration=12.0))
    assert 1e3 * abs(run.error[-1]) < 0.1
    c1, c2 = ARM.torque.at(ARM.rest_length - run.angle[-1])
    held = c1 * run.channels["muscle_pressure"][-1] + c2
    assert held == pytest.approx(ARM.weight, rel=0.01)


def test_a_mass_that_is_not_known_is_learnt():
    ignorant = RigModel(RIG.with_parameters({"load.mass": 20.0}))
    law = ignorant.law("adaptive", period=PERIOD)
    closed_loop(RIG, RigController(ignorant, law), LIFT, 20.0)
    assert law.estimates["weight"] == pytest.approx(ARM.weight, rel=0.05)


def test_it_rests_where_it_is_held_and_has_a_linear_model():
    controller = RigController(MODEL, MODEL.law("sliding", period=PERIOD))
    start = controller.holding(0.25)
    assert start["length"] == 0.25
    run = pamrs.simulate(SMOOTH, np.full(501, 5.0), sample_time=0.001, initial=start)
    assert np.abs(run["length"] - 0.25).max() < 1e-7
    model = linearise(SMOOTH, initial=start)
    assert model.states == ("muscle_pressure", "length", "length_rate")
    load = RIG.tables("load")[""]
    assert model.a[2, 2] == pytest.approx(-load["viscous"] / load["mass"], rel=1e-9)
    c1, _ = ARM.torque.at(ARM.rest_length - 0.25)
    assert model.a[2, 0] == pytest.approx(-c1 / load["mass"], rel=1e-6)
    linear = linear_controller(controller, model.point)
    assert {"length", "muscle_pressure"} <= set(linear.inputs)
    assert margins(model, linear).stable


def test_rest_is_a_part_of_the_stroke():
    """A limit of the shoulder's size, 1e-5 m/s, would let a mass pass that falls by 0.04 m/s2."""
    start = RigController(MODEL, MODEL.law("sliding", period=PERIOD)).holding(0.25)
    c1, _ = ARM.torque.at(ARM.rest_length - 0.25)

    def falling(acceleration):
        less = acceleration * RIG.tables("load")[""]["mass"] / c1
        return {**start, "muscle_pressure": start["muscle_pressure"] - less}

    linearise(SMOOTH, initial=falling(1e-3))
    told = r"length_rate is 2.*e-06 m/s.* does not rest"
    refused((told, lambda: linearise(SMOOTH, initial=falling(1e-2))))


def test_what_cannot_be_is_named():
    whole = RigController(MODEL, MODEL.law("sliding", period=PERIOD))
    arm, unseen = pamrs.rigs.shoulder(), {"muscle_pressure": 0.0}
    refused(
        ("by itself", lambda: ByLength(whole, RIG)),
        (r"shoulder.*no \[load\]", lambda: ByLength(PID(1.0), arm)),
        (r"shoulder.*no \[load\].*RigModel", lambda: LoadModel.from_rig(arm)),
        (r"bench.*frame", lambda: ByLength(PID(1.0), pamrs.rigs.bench())),
        ("ByLength", lambda: closed_loop(RIG, PID(1.0, period=PERIOD), LIFT, 0.1)),
        (r"has a \[load\].*RigModel", lambda: ArmModel.from_rig(RIG)),
        ("'simplified'.*where a mass hangs", lambda: RigModel(RIG, torque="simplified")),
        ("'neural'.*'adaptive' is needed for a hanging mass", lambda: MODEL.law("neural")),
        (r"^length = 0.3 .* from 0.18 to 0.28 m$", lambda: whole.holding(0.3)),
        ("no pressures hold length = 0.19", lambda: whole.holding(0.19)),
        ("'length'", lambda: whole.update(0.0, unseen, Reference(0.25))),
        ("rest_length = -1", lambda: ARM.replace(rest_length=-1.0)),
    )
    parts = {f.name: getattr(ARM, f.name) for f in dataclasses.fields(ARM)}
    parts.pop("rest_length")
    with pytest.raises(TypeError, match="rest_length"):
        LoadModel(**parts)
    assert math.isfinite(ARM.replace(inertia=3.0).inertia)


def loops_of_a_length(trajectory):
    """Every way to follow a trajectory by the length of the mass."""
    pid = ByLength(PID(100.0, 50.0, period=PERIOD), RIG)
    many = ByLength(PID(np.array([50.0, 100.0]), period=PERIOD), RIG)
    own = RigController(MODEL, MODEL.law("sliding", period=PERIOD))
    clock = VirtualClock()
    device = SimulatedDevice(RIG, clock)
    return [
        lambda: closed_loop(RIG, pid, trajectory, 0.1),
        lambda: closed_loop(RIG, own, trajectory, 0.1),
        lambda: sweep(RIG, many, trajectory, 0.1, n=2),
        lambda: run_live(device, pid, trajectory, 0.1, clock=clock),
        lambda: run_live(device, own, trajectory, 0.1, clock=clock),
    ]


@pytest.mark.parametrize("end", [math.radians(40), math.radians(2), 25.0])
def test_an_angle_is_no_length(end):
    told = rf"goes to {end:.4g} m, .*load.min_length = 0.18 m to load.max_length = 0.28 m.*\[m\]"
    refused(*((told, call) for call in loops_of_a_length(lift_hold_return(end, 0.25))))


@pytest.mark.parametrize("ends", [(0.28, 0.18), (0.27, 0.179)])
def test_ends_of_the_stroke_and_a_little_beyond_are_lengths(ends):
    """Beyond a stop commands saturate."""
    for call in loops_of_a_length(step(*ends, duration=0.1)):
        call()


def test_a_sweep_knows_the_lengths_of_every_rig():
    """Of which one is first does not matter."""
    short = RIG.with_parameters({"load.min_length": 0.25})
    for plants in ([RIG, short], [short, RIG]):
        pid = ByLength(PID(np.array([50.0, 100.0]), period=PERIOD), RIG)
        assert sweep(plants, pid, step(0.27, 0.19, duration=0.1)).final.shape == (2,)
        low = step(0.27, 0.07, duration=0.1)
        told = r"min_length = 0.18 m to load.max_length = 0.28"
        refused((told, lambda plants=plants, pid=pid, low=low: sweep(plants, pid, low)))


def test_a_map_of_gains_is_told_over_masses():
    """The mass that hangs is the payload of a map; nu is in metres."""
    lift = step(0.27, 0.25, duration=0.5)

    def made(kp):
        return ByLength(PID(kp, 50.0, period=PERIOD), RIG)

    found = gain_map(RIG, made, {"kp": [100.0, 300.0]}, lift, payloads=[10.0, 20.0])
    heavy = RIG.with_parameters({"load.mass": 20.0})
    alone = sweep(heavy, made(np.array([100.0, 300.0])), lift, n=2)
    np.testing.assert_array_equal(found.rms[1], alone.rms)
    assert found.rms[0, 0] != found.rms[1, 0]
    own = gain_map(RIG, made, {"kp": [100.0]}, lift)
    assert own.payloads == [RIG.parameter("load.mass").value]
    gains = {"kp": [100.0]}
    refused(("unit = 'deg' .* a length", lambda: gain_map(RIG, made, gains, lift, unit="deg")))


def test_a_frame_and_a_chamber_say_why_nothing_follows():
    rest = step(0.27, 0.25, duration=0.1)
    bench, chamber = pamrs.rigs.bench(), pamrs.rigs.sealed_chamber()
    frame, empty = "'bench'.*frame.*prescribes", r"'sealed_chamber' has no \[muscle\]"
    refused(
        (frame, lambda: gain_map(bench, PID, {"kp": [1.0]}, rest)),
        (frame, lambda: closed_loop(bench, PID(1.0), rest)),
        (empty, lambda: gain_map(chamber, PID, {"kp": [1.0]}, rest)),
        (empty, lambda: closed_loop(chamber, PID(1.0), rest)),
    )
