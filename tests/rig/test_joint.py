"""Joints: power, the reference's tendon, kinds chosen in a rig file, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.rig import parse_rig
from tests.reference import shoulder

TENDON: dict[str, Any] = {
    "rest_angle": math.radians(15.0),
    "upper_axial": 0.0254,
    "upper_offset": 0.027432,
    "lower_axial": 0.027432,
    "lower_offset": 0.004826,
}
KINDS: dict[str, dict[str, Any]] = {
    "tendon": TENDON,
    "published": {**TENDON, "kind": "published"},
    "pulley": {"kind": "pulley", "rest_angle": 0.2, "radius": 0.03},
    "polynomial": {"kind": "polynomial", "rest_angle": 0.2, "coefficients": [0.03, -0.002, 0.001]},
}
ANGLES = np.radians(np.linspace(16.0, 119.0, 12))


def test_the_tendon_is_that_of_the_reference() -> None:
    joint, peer = pamrs.Joint(**TENDON), shoulder().joint
    np.testing.assert_allclose(
        joint.shortening(ANGLES), [peer.contraction(float(a)) for a in ANGLES], rtol=1e-12
    )
    np.testing.assert_allclose(
        joint.moment_arm(ANGLES), [peer.moment_arm(float(a)) for a in ANGLES], rtol=1e-12
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_moment_arm_is_the_slope_of_the_shortening(kind: str) -> None:
    joint, h = pamrs.Joint(**KINDS[kind]), 1e-4
    steps = [joint.shortening(ANGLES + k * h) for k in (-2.0, -1.0, 1.0, 2.0)]
    slope = (steps[0] - 8.0 * steps[1] + 8.0 * steps[2] - steps[3]) / (12.0 * h)
    np.testing.assert_allclose(joint.moment_arm(ANGLES), slope, rtol=1e-9)
    lost = joint.torque_arm(ANGLES) < joint.moment_arm(ANGLES)
    assert lost.all() if kind == "published" else not lost.any()


def test_torque_of_a_bundle() -> None:
    joint, muscle = pamrs.Joint(**TENDON), pamrs.library.pam_a_1in()
    torque = joint.torque(muscle, [[4e5], [8e5]], ANGLES, count=6)
    pull = muscle.force(8e5, joint.shortening(ANGLES) / 0.276)
    np.testing.assert_allclose(torque[1], 6 * pull * joint.moment_arm(ANGLES), rtol=1e-12)


def test_angles_that_the_tendon_does_not_reach_are_named() -> None:
    joint = pamrs.Joint(**{**TENDON, "lower_offset": 0.06, "lower_axial": 0.02})
    angles = np.linspace(0.0, math.pi, 60)
    reached = joint.reaches(angles)
    assert reached.any()
    assert not reached.all()
    with pytest.raises(pamrs.ParameterError, match=r"joint\.angle.*tendon reaches"):
        joint.shortening(angles)
    assert not joint.reaches([math.nan]).any()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "hinge"}, r'joint\.kind = "hinge".*"pulley"'),
        ({"upper_axial": math.nan}, r"joint\.upper_axial = nan"),
        ({"upper_axial": 0.0}, r"joint\.upper_axial = 0"),
        ({"kind": "polynomial"}, r"joint\.coefficients"),
        ({"kind": "polynomial", "coefficients": [math.inf]}, r"joint\.coefficients"),
        ({"kind": "pulley", "radius": 50.0}, r"joint\.radius = 50"),
    ],
)
def test_what_makes_no_joint_is_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(pamrs.ParameterError, match=words):
        pamrs.Joint(**{**TENDON, **changes})


def rig_with(kind: str) -> str:
    """The shoulder with another kind of joint."""
    own = {
        "pulley": 'radius = { value = 30.0, unit = "mm" }',
        "polynomial": 'coefficients = { value = [0.03, -0.002], unit = "m" }',
    }.get(kind, "")
    lines = []
    block = ""
    for line in pamrs.rigs.shoulder().to_toml_text(comments=False).splitlines():
        block = line if line.startswith("[") else block
        name = line.partition(" = ")[0]
        if name == "kind" and block == "[joint]":
            lines += [f'kind = "{kind}"', own]
        elif not (name in TENDON and name != "rest_angle" and own):
            lines.append(line)
    return "\n".join(lines)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_chosen_in_a_rig_file(kind: str) -> None:
    rig = parse_rig(rig_with(kind))
    assert parse_rig(rig.to_toml_text()).model == rig.model
    assert ("joint.radius" in rig.parameters) == (kind == "pulley")
    joint = pamrs.Joint.from_model(rig.model["joint"])
    run = pamrs.simulate(rig, np.full(101, 6.0), sample_time=0.005)
    shortening = joint.shortening(run["joint_angle"]) / rig.model["muscle"]["rest_length"]
    np.testing.assert_allclose(run["contraction_ratio"], shortening, rtol=1e-10, atol=1e-12)
    torque = run["muscle_force"] * joint.torque_arm(run["joint_angle"])
    np.testing.assert_allclose(run["joint_torque"], torque, rtol=1e-10, atol=1e-9)


def test_the_keys_of_another_kind_are_refused() -> None:
    text = rig_with("pulley").replace(
        'kind = "pulley"', 'kind = "pulley"\nupper_axial = { value = 0.02, unit = "m" }'
    )
    with pytest.raises(
        pamrs.RigError,
        match=r"joint\.upper_axial is not allowed with 'pulley': only with tendon, published",
    ):
        parse_rig(text)
