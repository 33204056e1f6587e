"""A spring across a joint: its sign, the free arm's frequency, its energy, where it balances the
weight, and how a file has it.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.rig import parse_rig
from tests.property.networks import MUSCLE, Blocks, rig_of

STIFFNESS, REST, INERTIA = 30.0, 0.9, 0.2


def free_arm(kind: str = "one_link", arm: dict[str, Any] | None = None, **hinge: Any) -> pamrs.Rig:
    """An arm whose muscle has no lever: what moves it is weight, friction and spring."""
    stops = {"min_angle": -3.0, "max_angle": 3.0}
    blocks: Blocks = {
        "gas": {},
        "chamber": {"dead_volume": 1e-4},
        "muscle": MUSCLE,
        "joint": {"kind": "pulley", "radius": 0.0, "rest_angle": 0.0, **stops, **hinge},
    }
    if kind == "one_link":
        blocks["arm"] = {"inertia": INERTIA, "length": 0.4, "gravity": 0.0, **(arm or {})}
    else:
        own = {"length": 0.4, "mass": 1.0, "centre": 0.2, "inertia": INERTIA - 0.04}
        blocks["link"] = own
        blocks["arm"] = {"kind": "planar", "gravity": 0.0, **(arm or {})}
    return rig_of(blocks)


SPRING = {"stiffness": STIFFNESS, "spring_angle": REST}


@pytest.mark.parametrize("kind", ["one_link", "planar"])
def test_the_free_arm_swings_with_the_root_of_stiffness_over_inertia(kind: str) -> None:
    run = pamrs.simulate(
        free_arm(kind, **SPRING),
        duration=2.0,
        sample_time=0.001,
        initial={"joint_angle": REST + 0.5},
    )
    frequency = math.sqrt(STIFFNESS / INERTIA)
    wanted = REST + 0.5 * np.cos(frequency * run["time"])
    np.testing.assert_allclose(run["joint_angle"], wanted, rtol=0.0, atol=1e-7)
    assert run["joint_rate"][1] < 0.0  # it pulls towards its rest


def test_energy_of_weight_and_spring_is_kept() -> None:
    arm = {"gravity": 9.80665, "first_moment": 0.6, "payload": 0.5}
    run = pamrs.simulate(
        free_arm(arm=arm, **SPRING), duration=3.0, sample_time=0.002, initial={"joint_angle": -1.0}
    )
    inertia, moment = INERTIA + 0.5 * 0.4**2, 0.6 + 0.5 * 0.4
    angle, rate = run["joint_angle"], run["joint_rate"]
    energy = (
        0.5 * inertia * rate**2
        - 9.80665 * moment * np.cos(angle)
        + 0.5 * STIFFNESS * (angle - REST) ** 2
    )
    assert np.ptp(angle) > 1.0
    np.testing.assert_allclose(energy, energy[0], rtol=0.0, atol=1e-8 * np.ptp(rate**2))


def test_at_rest_it_carries_the_weight() -> None:
    arm = {"gravity": 9.80665, "first_moment": 1.2, "viscous": 4.0}
    run = pamrs.simulate(free_arm(arm=arm, **SPRING), duration=10.0, sample_time=0.01)
    angle = run["joint_angle"][-1]
    assert STIFFNESS * (REST - angle) == pytest.approx(9.80665 * 1.2 * math.sin(angle), rel=1e-6)
    assert 0.1 < angle < REST


def test_a_plant_in_a_batch_and_one_without_a_spring() -> None:
    """Each of a batch as it is alone; stiffness zero is none, to the last bit."""
    plain = pamrs.rigs.shoulder()
    time = 0.005 * np.arange(101)
    volts = 5.0 + 0.8 * np.sin(4.0 * time)
    values = np.array([0.0, 10.0, 60.0])
    sprung = plain.with_parameters({"joint.spring_angle": 1.0})
    rigs = [sprung.with_parameters({"joint.stiffness": float(k)}) for k in values]
    batch = pamrs.Batch(rigs, sample_time=0.005)
    assert batch.side_by_side.all()
    found = np.array([batch.step(float(u))["joint_angle"] for u in volts[:-1]])
    alone = [pamrs.simulate(rig, volts, sample_time=0.005)["joint_angle"] for rig in rigs]
    np.testing.assert_array_equal(found.T, [angle[1:] for angle in alone])
    assert np.ptp(found[-1]) > 1e-3
    without = pamrs.simulate(plain, volts, sample_time=0.005)["joint_angle"]
    np.testing.assert_array_equal(alone[0], without)


# ------------------------------------------------------------------ the file


def test_a_rig_keeps_its_spring() -> None:
    rig = pamrs.rigs.named("antagonistic_joint")
    assert rig.tables("joint")["elbow"]["stiffness"] == 0.0
    assert "stiffness" not in json.loads(rig.to_json())["joints"][0]
    text = rig.to_toml_text().replace(
        "[joint.elbow]",
        '[joint.elbow]\nstiffness = { value = 2.5, unit = "N m/rad", tol = 0.5 }\n'
        'spring_angle = { value = 30, unit = "deg" }',
    )
    sprung = parse_rig(text)
    own = sprung.tables("joint")["elbow"]
    assert own["stiffness"] == 2.5
    assert own["spring_angle"] == pytest.approx(math.pi / 6)
    assert sprung.parameter("joint.elbow.stiffness").tol == 0.5
    again = parse_rig(sprung.to_toml_text())
    assert again.model == sprung.model
    assert again.parameter("joint.elbow.stiffness").tol == 0.5
    core = json.loads(sprung.to_json())
    assert core["joints"][0]["stiffness"] == 2.5


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"stiffness": -1.0}, "joint.stiffness = -1 N m/rad is not allowed.* from 0 to"),
        ({"stiffness": 2e9}, "joint.stiffness = 2e.09 N m/rad is not allowed"),
        ({"spring_angle": 9.0}, "joint.spring_angle = 9 rad is not allowed"),
    ],
)
def test_what_cannot_be_is_refused_by_name(change: dict[str, float], why: str) -> None:
    with pytest.raises(pamrs.RigError, match=why):
        free_arm(**change)
