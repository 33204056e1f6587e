"""Controllers on arms with a spring across the joint, on a tilted base, with a centre of mass off
the line of the link.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import (
    ArmModel,
    PlanarArmModel,
    Recruitment,
    RigController,
    RigModel,
    closed_loop,
)
from pamrs.control.trajectories import cosine_cycles, degrees
from pamrs.errors import ParameterError
from tests.control.helpers import reference_arm
from tests.reference.plant import Arm
from tests.simulation.refusals import refused

PERIOD = 0.005
SPRING = (25.0, math.radians(40.0))
# the spring lifts the arm past where the reference begins: only muscles that push hold it down
PLAIN = pamrs.rigs.shoulder().with_parameters({"arm.coulomb": 0.0, "muscle.buckling_load": 1e9})
MOUNTED = PLAIN.with_parameters(
    {
        "joint.stiffness": SPRING[0],
        "joint.spring_angle": SPRING[1],
        "arm.base_angle": math.radians(-25.0),
        "arm.centre_angle": math.radians(20.0),
    }
)
LIFT = cosine_cycles(*degrees(20, 70), rise=3.0, hold=2.0, cycles=1)


def test_the_model_is_the_equation_of_the_reference():
    rng = np.random.default_rng(3)
    keys = (*Arm.__dataclass_fields__,)
    arm = Arm(**{key: MOUNTED.model["arm"][key] for key in keys})
    model = ArmModel.from_rig(MOUNTED)
    for angle, rate, torque in rng.uniform((-1.0, -2.0, -50.0), (2.0, 2.0, 300.0), (20, 3)):
        spring = SPRING[0] * (angle - SPRING[1])
        acceleration = arm.acceleration(angle, rate, torque - spring)
        found = model.inverse_dynamics(angle, rate, rate, acceleration)
        assert found == pytest.approx(torque, abs=1e-9)
        columns = model.regressor(angle, rate, rate, acceleration)
        total = sum(p.value * c for p, c in zip(model.parameters, columns, strict=True))
        assert total + model.springs(angle) == pytest.approx(found, abs=1e-9)


def test_the_model_of_several_joints_is_the_equation_of_the_reference():
    rng = np.random.default_rng(7)
    rig = pamrs.rigs.named("two_joint_arm").with_parameters(
        {"arm.base_angle": 0.6, "joint.wrist.stiffness": 4.0, "joint.wrist.spring_angle": 0.3}
    )
    arm, model = reference_arm(rig, 0.6), PlanarArmModel.from_rig(rig)
    for _ in range(10):
        angle, rate, acceleration = rng.uniform(-2.0, 2.0, (3, 2))
        expected = np.array(arm.inverse_dynamics(angle.tolist(), rate.tolist(), acceleration))
        expected += model.viscous * rate + np.array([0.0, 4.0 * (angle[1] - 0.3)])
        found = model.inverse_dynamics(angle, rate, rate, acceleration)
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-11)
        rows = [np.repeat(value, 3) for value in (angle, rate, rate, acceleration)]
        found = model.inverse_dynamics(*rows)
        np.testing.assert_allclose(found, np.repeat(expected, 3), rtol=1e-12, atol=1e-11)


def error(rig, model, kind, **options):
    """Largest error from the second second on [deg]."""
    law = model.law(kind, period=PERIOD, **options)
    run = closed_loop(rig, RigController(model, law), LIFT, 8.0)
    return float(np.degrees(np.abs(run.error[run.time >= 1.0]).max()))


@pytest.mark.parametrize("kind", ["feedforward", "sliding", "adaptive", "neural"])
def test_every_law_follows_as_without_and_feedforward_needs_the_terms(kind):
    options = {"feedforward": {"friction": True}, "neural": {"start": "model"}}.get(kind, {})
    known, plain = RigModel(MOUNTED), RigModel(PLAIN)
    found = error(MOUNTED, known, kind, **options)
    assert found < 1.5 * error(PLAIN, plain, kind, **options) + 0.1
    if kind in ("feedforward", "sliding"):
        assert found < 0.35 * error(MOUNTED, plain, kind, **options)


def test_recruitment_for_a_reach_refuses_them_by_name():
    rig = pamrs.rigs.recruitment()
    for changes, word in (
        ({"joint.shoulder.stiffness": 5.0}, r"joint.shoulder.stiffness = 5 N m/rad"),
        ({"arm.base_angle": 0.2}, r"arm.base_angle = 0.2 rad"),
    ):
        model = RigModel(rig.with_parameters(changes))
        groups = model.torques_of("shoulder")
        Recruitment(groups, model.pressure_limit, period=PERIOD)
        with pytest.raises(ParameterError, match=rf"reach = 1.5 rad is not allowed with {word}"):
            Recruitment(groups, model.pressure_limit, period=PERIOD, reach=1.5)


def test_a_mounting_that_cannot_be_is_refused():
    arm = ArmModel.from_rig(PLAIN)
    several = PlanarArmModel.from_rig(pamrs.rigs.named("two_joint_arm"))
    refused(
        ("spring = ", lambda: arm.replace(spring=(-1.0, 0.0))),
        ("spring = ", lambda: arm.replace(spring=(1.0, math.nan))),
        ("tilt = inf", lambda: arm.replace(tilt=math.inf)),
        ("tilt", lambda: several.replace(tilt=math.nan)),
        ("spring", lambda: several.replace(spring=(np.array([-5.0, 1.0]), np.zeros(2)))),
        ("spring", lambda: several.replace(spring=(np.array([5.0]), np.zeros(2)))),
        ("spring", lambda: several.replace(spring=(np.ones(2), np.array([0.0, math.inf])))),
    )
