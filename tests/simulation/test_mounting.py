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
ARM = {"inertia": 0.3, "first_moment": 1.5, "length": 0.5, "payload": 3.0, "viscous": 0.8}


def arm_of(rest: float, reach: tuple[float, float], **arm: Any) -> pamrs.Rig:
    """An arm of one link on a muscle whose pulley is at rest at an angle."""
    stops = {"min_angle": reach[0], "max_angle": reach[1]}
    blocks: Blocks = {
        "gas": {},
        "chamber": {"dead_volume": 1e-4, "initial_pressure": 1e5},
        "muscle": MUSCLE,
        "joint": {"kind": "pulley", "radius": 0.015, "rest_angle": rest, **stops},
        "arm": {**ARM, **arm},
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


def test_the_centre_of_mass_turns_alone() -> None:
    """Without a payload it is a tilt of the base; the payload stays on the line of the link."""
    empty = {"payload": 0.0}
    one = run(arm_of(-0.5, (-0.6, 2.0), centre_angle=0.4, **empty), 0.3)
    other = run(arm_of(-0.5, (-0.6, 2.0), base_angle=0.4, **empty), 0.3)
    np.testing.assert_allclose(one["joint_angle"], other["joint_angle"], rtol=0.0, atol=1e-10)
    loaded = run(arm_of(-0.5, (-0.6, 2.0), centre_angle=0.4), 0.3)
    tilted = run(arm_of(-0.5, (-0.6, 2.0), base_angle=0.4), 0.3)
    assert np.abs(loaded["joint_angle"] - tilted["joint_angle"]).max() > 0.01


TILTS = ((0.0, 0.0), (-0.6, 0.0), (0.3, 0.2), (0.0, -0.3))


@pytest.mark.parametrize(
    "changes",
    [
        [{"arm.base_angle": tilt, "arm.centre_angle": centre} for tilt, centre in TILTS],
        [{"joint.spring_angle": 1.0, "joint.stiffness": k} for k in (0.0, 10.0, 60.0)],
        [{"muscle.softening": 4e-3, "muscle.temperature": t} for t in (293.15, 313.15)],
    ],
    ids=["mounting", "spring", "softening"],
)
def test_plants_in_a_batch_are_each_alone(changes: list[dict[str, float]]) -> None:
    """Side by side in lanes; one for which it comes to nothing keeps its bits among the others."""
    plain = pamrs.rigs.shoulder()
    volts = 5.0 + 0.8 * np.sin(4.0 * 0.005 * np.arange(101))
    rigs = [plain.with_parameters(change) for change in changes]
    batch = pamrs.Batch(rigs, sample_time=0.005)
    assert batch.side_by_side.all()
    found = np.array([batch.step(float(u))["joint_angle"] for u in volts[:-1]])
    for rig, angle in zip([*rigs, plain], [*found.T, found[:, 0]], strict=True):
        alone = pamrs.simulate(rig, volts, sample_time=0.005)["joint_angle"]
        np.testing.assert_array_equal(angle, alone[1:])
    assert len({float(angle) for angle in found[-1]}) == len(rigs)


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


#: Rig, block, what is written into it, key -> value and tolerance, and what the core is told.
KEPT: dict[str, tuple[str, str, dict[str, str], dict[str, tuple[float, float]], Any]] = {
    "mounting": (
        "shoulder",
        "arm",
        {"base_angle": '-90, unit = "deg", tol = 2', "centre_angle": '12, unit = "deg", tol = 2'},
        {"base_angle": (-QUARTER, math.pi / 90), "centre_angle": (math.pi / 15, math.pi / 90)},
        lambda core: (core["arm"].get("centre_angle"), math.pi / 15),
    ),
    "spring": (
        "antagonistic_joint",
        "joint.elbow",
        {"stiffness": '2.5, unit = "N m/rad", tol = 0.5', "spring_angle": '30, unit = "deg"'},
        {"stiffness": (2.5, 0.5), "spring_angle": (math.pi / 6, 0.0)},
        lambda core: (core["joints"][0].get("stiffness"), 2.5),
    ),
    "softening": (
        "shoulder",
        "muscle",
        {"softening": '0.4, unit = "%/K", tol = 0.1', "temperature": '40, unit = "degC"'},
        {"softening": (4e-3, 1e-3), "temperature": (313.15, 0.0)},
        lambda core: (core["muscles"][0]["muscle"].get("softening"), 4e-3),
    ),
}


@pytest.mark.parametrize("name", KEPT)
def test_a_rig_keeps_what_is_written_and_the_core_is_told_no_more(name: str) -> None:
    named, block, lines, wanted, told = KEPT[name]
    rig = pamrs.rigs.named(named)
    assert not told(json.loads(rig.to_json()))[0]
    written = "".join(f"{key} = {{ value = {value} }}\n" for key, value in lines.items())
    changed = parse_rig(rig.to_toml_text().replace(f"[{block}]\n", f"[{block}]\n{written}"))
    again = parse_rig(changed.to_toml_text(comments=False))
    assert again.model == changed.model
    for key, (value, tol) in wanted.items():
        found = again.parameter(f"{block}.{key}")
        assert (found.value, found.tol) == pytest.approx((value, tol))
    there, expected = told(json.loads(again.to_json()))
    assert there == pytest.approx(expected)


def test_an_arm_is_fitted_by_its_mounting_its_joints_springs_and_its_muscles() -> None:
    channels = ("muscle_pressure.elbow", "muscle_pressure.wrist")
    channels += ("joint_angle.elbow", "joint_angle.wrist")
    blocks = available_blocks(pamrs.rigs.named("two_joint_arm"), channels)
    arms = [block for block in blocks if block.kind == "arm"]
    assert len(arms) == 2
    wanted = {"arm.base_angle", "joint.elbow.stiffness", "joint.wrist.spring_angle"}
    assert all(wanted <= arm.parameters for arm in arms)
    channels = ("supply_pressure", "muscle_pressure", "joint_angle", "valve_command")
    arm = available_blocks(pamrs.rigs.shoulder(), channels)[-1]
    assert {"muscle.softening", "muscle.temperature"} <= arm.parameters


def test_what_cannot_be_is_refused_by_name() -> None:
    with pytest.raises(pamrs.RigError, match=r"arm.base_angle = 7 rad is not allowed.* from -6.28"):
        arm_of(-0.5, (-0.6, 2.0), base_angle=7.0)
    text = pamrs.rigs.named("two_joint_arm").to_toml_text()
    text = text.replace("[arm]\n", '[arm]\ncentre_angle = { value = 3, unit = "deg" }\n')
    with pytest.raises(pamrs.RigError, match=r"arm.centre_angle"):
        parse_rig(text)
