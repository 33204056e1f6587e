"""Linear models and margins of loops with several commands: what the nonlinear loop does, the loop
of one muscle, and gains at which a loop is at its boundary.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.control import (
    PID,
    Recruitment,
    Reference,
    RigController,
    RigModel,
    closed_loop,
)
from pamrs.control.linear import linear_controller, linearise
from pamrs.control.stability import margins, open_loop
from pamrs.control.trajectories import step
from pamrs.errors import ParameterError
from tests.control.helpers import CONDUCTANCE, SmallPid, with_regulator, without_friction
from tests.simulation.refusals import refused

control = pytest.importorskip("control")

PERIOD = 0.005
ELBOW = math.radians(45.0)
BOTH = np.radians([45.0, 40.0])


def even_valves(name, angle, **options):
    """A packaged rig without dry friction whose valves have, at the pressures that hold it, the
    same slope where they fill as where they vent: a small motion then has one linear model.
    """
    smooth = without_friction(name)
    start = controller_of(smooth, options).holding(angle)
    gas, model = smooth.model["gas"], smooth.model
    ambient = gas["ambient_pressure"]
    supply = smooth.tables("supply")[""]["initial_pressure"] + ambient
    for valve, table in model["valve"].items():
        chamber = smooth.tables("chamber")[valve]
        pressure = start[f"muscle_pressure.{valve}"] + ambient
        del table["discharge_area_max"]
        # both choked: the flow is in proportion to the pressure in front, the rate to alpha
        ratio = chamber["alpha_in"] * supply / (chamber["alpha_out"] * pressure)
        table |= {"flow": "iso_6358", "fill_critical_ratio": 0.85, "vent_critical_ratio": 0.85}
        table |= {"fill_conductance": CONDUCTANCE, "vent_conductance": CONDUCTANCE * ratio}
    return pamrs.Rig(name, model)


def controller_of(rig, options, **changes):
    model, gains = RigModel(rig), {"slope": 8.0, "switching": 4e3, "boundary_layer": 2.0}
    law = model.law("sliding", **{**gains, "period": PERIOD, **changes})
    return RigController(model, law, **options)


def at_rest(rig, start, **held):
    """Half a second from a start, the valves shut unless another input is held."""
    commands = held or {"valve_command": {name: np.full(501, 5.0) for name in rig.tables("valve")}}
    return pamrs.simulate(rig, **commands, sample_time=0.001, initial=start)


CASES = {
    "antagonistic_joint": (ELBOW, {"stiffness": 18.0}),
    "two_joint_arm": (BOTH, {}),
}


@pytest.fixture(scope="module", params=CASES)
def held(request):
    """Rig, controller, start, linear model, linear controller, angles."""
    angle, options = CASES[request.param]
    rig = even_valves(request.param, angle, **options)
    controller = controller_of(rig, options)
    start = controller.holding(angle)
    model = linearise(rig, initial=start)
    return rig, controller, start, model, linear_controller(controller, model.point), angle


def resting(angle, joints):
    angles = zip(joints, np.atleast_1d(angle).tolist(), strict=True)
    return {name: step(one, one, duration=1.0) for name, one in angles}


def test_what_holds_a_rig_holds_it(held):
    rig, controller, start, model, linear, angle = held
    run = at_rest(rig, start)
    for name, wanted in zip(controller.tracked, np.atleast_1d(angle), strict=True):
        assert np.abs(run[name] - wanted).max() < 1e-6
    assert linear.outputs == tuple(f"valve_command.{name}" for name in rig.tables("valve"))
    assert linear.command == pytest.approx(dict.fromkeys(linear.outputs, 5.0), abs=1e-5)
    assert model.inputs == linear.outputs
    assert set(linear.inputs) <= set(model.outputs)


def test_the_nonlinear_loop_moves_as_the_linear_one(held):
    """From a joint that was pushed aside, sample by sample; filters have seen the rest."""
    rig, controller, start, model, linear, angle = held
    aside, pushed = 2e-5, controller.tracked[-1]
    aim = resting(angle, controller.joints)
    controller.reset()
    for k in range(3):
        controller.update(k * PERIOD, model.point, Reference(angle))
    from_there = {**start, pushed: start[pushed] + aside}
    on = {"sample_time": PERIOD, "step": 1e-4, "start": 3 * PERIOD, "reset": False}
    run = closed_loop(rig, controller, aim, 0.5, initial=from_there, **on)
    matrix = control.feedback(open_loop(model, linear, command=linear.outputs[0])).A
    x = np.zeros((run.time.size, matrix.shape[0]))
    x[0, model.states.index(pushed)] = aside
    for k in range(run.time.size - 1):
        x[k + 1] = matrix @ x[k]
    for name in (*controller.tracked, *(n for n in model.states if n.startswith("muscle_pre"))):
        expected = x[:, model.states.index(name)]
        found = run.channels[name] - start[name]
        assert found == pytest.approx(expected, abs=0.005 * np.abs(expected).max()), name
    # and it comes back as fast as the slowest eigenvalue says
    radius = margins(model, linear, command=linear.outputs[1]).radius
    assert radius == pytest.approx(np.abs(np.linalg.eigvals(matrix)).max(), rel=1e-9)
    assert radius < 1.0


def test_each_loop_is_at_its_boundary_at_its_gain_margin(held):
    """One command is multiplied by it, the others as they are: an eigenvalue on the unit circle."""
    *_, model, linear, _ = held
    finite = 0
    for k, name in enumerate(linear.outputs):
        one = margins(model, linear, command=name, delay=0.004)
        assert one.stable
        assert one.phase > 0.0
        if math.isinf(one.gain):
            continue
        finite += 1
        scale = np.ones(len(linear.outputs))
        scale[k] = one.gain
        turned = replace(linear, c=scale[:, None] * linear.c, d=scale[:, None] * linear.d)
        boundary = margins(model, turned, command=name, delay=0.004)
        assert boundary.radius == pytest.approx(1.0, abs=2e-4)
    assert finite


def test_a_regulated_rig_has_its_set_pressure_as_input():
    # air that comes in as it goes out: else a flow that turns round has two slopes
    rig = pamrs.rigs.named("regulated_joint").with_parameters(
        dict.fromkeys(("chamber.alpha_in", "chamber.alpha_out"), 1.2)
    )
    known = RigModel(rig, pressure_limit=1e6)
    law = known.law("sliding", period=PERIOD)
    controller = RigController(known, law)
    start = controller.holding(ELBOW)
    model = linearise(rig, initial=start)
    assert model.inputs == ("supply_command",)
    supply = rig.tables("supply")[""]
    row = model.states.index("supply_pressure")
    assert model.b[row, 0] == pytest.approx(1.0 / supply["time_constant"], rel=1e-12)
    assert np.count_nonzero(model.b) == 1
    linear = linear_controller(controller, model.point)
    assert linear.command["supply_command"] == pytest.approx(start["muscle_pressure"], rel=1e-6)
    assert margins(model, linear).stable
    # what is driven moves as the simulation does
    step_of = 50.0  # so that the flow stays in the straight piece of its law
    run = at_rest(rig, start, supply_command=np.full(201, start["supply_pressure"] + step_of))
    phi, gamma = model.sampled(0.001)
    x = np.zeros((201, len(model.states)))
    for k in range(200):
        x[k + 1] = phi @ x[k] + gamma[:, 0] * step_of
    for k, name in enumerate(model.states):
        moved = run[name] - run[name][0]
        assert moved == pytest.approx(x[:, k], abs=0.01 * np.abs(x[:, k]).max()), name


@pytest.mark.parametrize("name", ["shoulder", "throttled_supply"])
def test_a_regulator_in_front_of_a_valve_is_held(name):
    """In front of it, or behind a line and its volume: the loop is that of the valve."""
    rig = with_regulator(pamrs.rigs.named(name))
    known = RigModel(rig)
    controller = RigController(known, known.law("sliding", period=PERIOD))
    model = linearise(rig, initial=controller.holding(ELBOW))
    assert model.inputs == ("valve_command",)
    assert "supply_pressure" not in model.states
    assert margins(model, linear_controller(controller, model.point)).stable


def recruited(rig, share=Recruitment):
    known = RigModel(rig)
    groups, options = known.torques_of("shoulder"), {"period": PERIOD, "reach": math.radians(60.0)}
    shares = share(groups, known.pressure_limit, **options)
    return RigController(known, known.law("sliding", period=PERIOD), shares=shares)


@pytest.mark.parametrize("degrees", range(20, 120, 12))
def test_what_a_share_of_groups_asks_for_holds_too(degrees):
    """Pairs without air bow out and push a little, which the share does not count."""
    rig, angle = pamrs.rigs.named("recruitment"), math.radians(degrees)
    controller = recruited(rig)
    before = controller.state
    start = controller.holding(angle)
    assert controller.state == before
    assert start["muscle_pressure.pair_2"] == start["muscle_pressure.pair_3"] == 0.0
    assert np.abs(at_rest(rig, start)["joint_angle.shoulder"] - angle).max() < 1e-7
    linearise(rig, initial=start)
    # one pair holds the arm and what the others push, 3.5 N for each muscle at its lever
    model, joint = RigModel(rig), pamrs.Joint.from_model(rig.tables("joint")["shoulder"])
    c1, c2 = model.torques_of("shoulder")[0].at(angle)
    asked = c1 * start["muscle_pressure.pair_1"] + c2
    pushed = 4.0 * 3.5 * float(joint.torque_arm(angle))
    assert asked - model.arm.weight * math.sin(angle) == pytest.approx(pushed, rel=0.01)


def test_a_regulator_and_a_pressure_that_is_prescribed_hold_too():
    regulated = RigModel(pamrs.rigs.named("regulated_joint"), pressure_limit=1e6)
    model = pamrs.rigs.shoulder().model
    del model["valve"], model["supply"]
    prescribed = RigModel(pamrs.Rig("prescribed", model), pressure_limit=1e6)
    for known, name in ((regulated, "supply_command"), (prescribed, "pressure")):
        start = RigController(known, known.law("sliding", period=PERIOD)).holding(ELBOW)
        run = at_rest(known.rig, start, **{name: np.full(501, start["muscle_pressure"])})
        assert np.abs(run["joint_angle"] - ELBOW).max() < 1e-6


def test_a_share_that_cannot_hold_is_named_and_changes_nothing():
    rig = pamrs.rigs.named("recruitment").with_parameters({"arm.payload": 60.0})
    controller = recruited(rig)  # one pair at first, and three could
    before = controller.state
    with pytest.raises(ParameterError, match=r"hold joint_angle.shoulder = 1.57.*by 4\.68 rad/s2"):
        controller.holding(0.5 * math.pi)
    assert controller.state == before

    class Failing(Recruitment):
        def pressures(self, demand):
            super().pressures(demand)
            raise ZeroDivisionError("oh")

    controller = recruited(rig, Failing)
    before = controller.state
    with pytest.raises(ZeroDivisionError):
        controller.holding(ELBOW)
    assert controller.state == before


class Reordered(SmallPid):
    """Answers two valves, named in another order where the joint is too high, or one of them."""

    answers = "inputs"
    tracked = ("joint_angle.elbow",)

    def __init__(self, one=False):
        super().__init__(kp=2.0, ki=1.0, kd=0.0, period=PERIOD)
        self.one = one

    def update(self, time, measurement, reference):
        angle = measurement["joint_angle.elbow"]
        u = super().update(time, {"joint_angle": angle, "joint_rate": 0.0}, reference)
        answer = {"flexor": u, "extensor": 10.0 - 2.0 * (u - 5.0)}
        if angle > reference.angle:
            answer = dict(list(answer.items())[::-1][: 1 if self.one else 2])
        return {"valve_command": answer}


def test_commands_are_taken_by_their_names():
    point = {"joint_angle.elbow": 0.5}
    found = linear_controller(Reordered(), point)
    assert found.outputs == ("valve_command.flexor", "valve_command.extensor")
    assert found.d[:, 0] == pytest.approx([-2.0, 4.0], rel=1e-6)
    assert found.c[:, 0] == pytest.approx([1.0, -2.0], rel=1e-6)
    with pytest.raises(ParameterError, match="answered valve_command.extensor: valve_command.fl"):
        linear_controller(Reordered(one=True), point)


def test_what_cannot_be_is_named(held):
    rig, controller, start, model, linear, angle = held
    first, alone = controller.tracked[0], linear_controller(PID(1.0), {"joint_angle": 0.5})
    aside, far = {**start, first: start[first] + 0.1}, np.zeros(len(controller.joints)) - 3.0
    heavy = [name for name in rig.parameters if name.rpartition(".")[2] in ("payload", "mass")]
    loaded = controller_of(rig.with_parameters(dict.fromkeys(heavy, 500.0)), {})
    refused(
        ("command = None", lambda: margins(model, linear)),
        (
            "command = 'valve_command.other'",
            lambda: margins(model, linear, command="valve_command.other"),
        ),
        ("one without a name", lambda: open_loop(model, alone)),
        ("angle is missing", lambda: linearise(rig)),
        ("does not rest", lambda: linearise(rig, initial=aside)),
        (
            r"point has no joint_angle\.",
            lambda: linear_controller(controller, {"joint_angle": 0.5}),
        ),
        (r"angle = .* one number each is needed, joint_angle", lambda: controller.holding(far)),
        (r"no pressures hold joint_angle\.", lambda: loaded.holding(angle)),
    )
