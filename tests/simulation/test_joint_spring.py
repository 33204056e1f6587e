"""A spring across a joint: its sign, the free arm's frequency, its energy, where it balances the
weight.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import pamrs
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
    start = {"joint_angle": REST + 0.5}
    arm = free_arm(kind, **SPRING)
    run = pamrs.simulate(arm, duration=2.0, sample_time=0.001, initial=start)
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
