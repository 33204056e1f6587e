"""How an arm hangs: a tilted base, and a centre of mass off the line of the link."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import available_blocks
from pamrs.rig import parse_rig
from tests.property.networks import MUSCLE, Blocks, rig_of

QUARTER = math.pi / 2
GRAVITY = 9.80665


def arm_of(rest: float, reach: tuple[float, float], **arm: Any) -> pamrs.Rig:
    """An arm of one link on a muscle whose pulley is at rest at an angle."""
    stops = {"min_angle": reach[0], "max_angle": reach[1]}
    blocks: Blocks = {
        "gas": {},
        "chamber": {"dead_volume": 1e-4, "initial_pressure": 1e5},
        "muscle": MUSCLE,
        "joint": {"kind": "pulley", "radius": 0.015, "rest_angle": rest, **stops},
        "arm": {
            "inertia": 0.3,
            "first_moment": 1.5,
            "length": 0.5,
            "payload": 3.0,
            "viscous": 0.8,
            **arm,
        },
    }
    return rig_of(blocks)


def run(rig: pamrs.Rig, start: float, **others: float) -> pamrs.Simulation:
    initial = {"joint_angle": start, **others}
    return pamrs.simulate(rig, duration=1.0, sample_time=0.005, initial=initial)


@pytest.mark.parametrize("tilt", [QUARTER, -0.7, 2.9])
def test_a_tilted_base_is_a_shifted_zero(tilt: float) -> None:
    """The same stand with its zero elsewhere: the muscle's rest and the stops turn with it."""
    plumb = run(arm_of(-0.5, (-0.6, 2.0)), 0.3)
    turned = run(arm_of(-0.5 - tilt, (-0.6 - tilt, 2.0 - tilt), base_angle=tilt), 0.3 - tilt)
    assert np.ptp(plumb["joint_angle"]) > 0.2
    for name, shift in (("joint_angle", tilt), ("joint_rate", 0.0), ("muscle_pressure", 0.0)):
        scale = np.ptp(plumb[name])
        np.testing.assert_allclose(
            turned[name] + shift, plumb[name], rtol=0.0, atol=1e-9 * scale, err_msg=name
        )


def test_a_quarter_of_a_turn_makes_a_cosine_of_the_sine() -> None:
    """Linear models by the core's own derivatives, and accelerations from rest."""
    inertia, moment = 0.3 + 3.0 * 0.25, 1.5 + 3.0 * 0.5
    for angle in (0.0, 0.4, 1.1):
        first = {}
        for base in (0.0, QUARTER):
            rig = arm_of(-0.5, (-0.6, 2.0), base_angle=base, viscous=0.0)
            moved = pamrs.simulate(
                rig, duration=2e-4, sample_time=1e-4, initial={"joint_angle": angle}
            )
            first[base] = moved["joint_rate"][1] / 1e-4
        found = (first[0.0] - first[QUARTER]) * inertia / (GRAVITY * moment)
        assert found == pytest.approx(math.cos(angle) - math.sin(angle), abs=1e-5)


def test_the_centre_of_mass_turns_alone() -> None:
    """Without a payload it is a tilt of the base; the payload stays on the line of the link."""
    empty = {"payload": 0.0}
    one = run(arm_of(-0.5, (-0.6, 2.0), centre_angle=0.4, **empty), 0.3)
    other = run(arm_of(-0.5, (-0.6, 2.0), base_angle=0.4, **empty), 0.3)
    np.testing.assert_allclose(one["joint_angle"], other["joint_angle"], rtol=0.0, atol=1e-10)
    loaded = run(arm_of(-0.5, (-0.6, 2.0), centre_angle=0.4), 0.3)
    tilted = run(arm_of(-0.5, (-0.6, 2.0), base_angle=0.4), 0.3)
    assert np.abs(loaded["joint_angle"] - tilted["joint_angle"]).max() > 0.01


def test_tilts_in_a_batch_are_each_alone() -> None:
    """Side by side in lanes; those that hang straight keep their bits among tilted ones."""
    plain = pamrs.rigs.shoulder()
    volts = 5.0 + 0.8 * np.sin(4.0 * 0.005 * np.arange(101))
    rigs = [
        plain.with_parameters({"arm.base_angle": tilt, "arm.centre_angle": centre})
        for tilt, centre in ((0.0, 0.0), (-0.6, 0.0), (0.3, 0.2), (0.0, -0.3))
    ]
    batch = pamrs.Batch(rigs, sample_time=0.005)
    assert batch.side_by_side.all()
    found = np.array([batch.step(float(u))["joint_angle"] for u in volts[:-1]])
    for rig, angle in zip(rigs, found.T, strict=True):
        alone = pamrs.simulate(rig, volts, sample_time=0.005)["joint_angle"]
        np.testing.assert_array_equal(angle, alone[1:])
    assert len({float(angle) for angle in found[-1]}) == 4
    whole = pamrs.simulate(plain, volts, sample_time=0.005)["joint_angle"]
    np.testing.assert_array_equal(found[:, 0], whole[1:])


def test_a_payload_on_a_cord_hangs_straight_down_from_a_tilted_arm() -> None:
    """`payload_swing` on a base that is turned, and on one whose zero is turned."""
    cord = {"length": 0.4, "damping_ratio": 0.02}
    swing = [
        run(rig.with_effect("payload_swing", cord), start)
        for rig, start in (
            (arm_of(-0.5, (-0.6, 2.0)), 0.3),
            (arm_of(-1.2, (-1.3, 1.3), base_angle=0.7), -0.4),
        )
    ]
    plumb, turned = (one["joint_angle"] for one in swing)
    assert np.ptp(plumb) > 0.2
    np.testing.assert_allclose(turned + 0.7, plumb, rtol=0.0, atol=1e-8)


def test_a_rig_keeps_how_its_arm_is_mounted() -> None:
    rig = pamrs.rigs.shoulder()
    core = json.loads(rig.to_json())["arm"]
    assert not {"base_angle", "centre_angle"} & set(core)
    lines = [
        f'{key} = {{ value = {value}, unit = "deg", tol = 2 }}'
        for key, value in (("base_angle", "-90"), ("centre_angle", "12"))
    ]
    text = rig.to_toml_text().replace("[arm]\n", "[arm]\n" + "\n".join(lines) + "\n")
    mounted = parse_rig(text)
    assert mounted.parameter("arm.base_angle").value == pytest.approx(-QUARTER)
    assert mounted.parameter("arm.centre_angle").tol == pytest.approx(math.radians(2.0))
    again = parse_rig(mounted.to_toml_text())
    assert again.model == mounted.model
    assert again.parameter("arm.base_angle").tol == mounted.parameter("arm.base_angle").tol
    assert json.loads(again.to_json())["arm"]["centre_angle"] == pytest.approx(math.radians(12.0))


def test_an_arm_is_fitted_by_its_mounting_and_its_joints_springs() -> None:
    channels = ("muscle_pressure.elbow", "muscle_pressure.wrist")
    channels += ("joint_angle.elbow", "joint_angle.wrist")
    blocks = available_blocks(pamrs.rigs.named("two_joint_arm"), channels)
    arms = [block for block in blocks if block.kind == "arm"]
    assert len(arms) == 2
    wanted = {"arm.base_angle", "joint.elbow.stiffness", "joint.wrist.spring_angle"}
    assert all(wanted <= arm.parameters for arm in arms)


def test_what_cannot_be_is_refused_by_name() -> None:
    with pytest.raises(pamrs.RigError, match=r"arm.base_angle = 7 rad is not allowed.* from -6.28"):
        arm_of(-0.5, (-0.6, 2.0), base_angle=7.0)
    text = pamrs.rigs.named("two_joint_arm").to_toml_text()
    text = text.replace("[arm]\n", '[arm]\ncentre_angle = { value = 3, unit = "deg" }\n')
    with pytest.raises(pamrs.RigError, match=r"arm.centre_angle"):
        parse_rig(text)
