"""Backlash of a joint: the form `with_play` of `base_flexibility`."""

import numpy as np
import pytest

import pamrs

COMPLIANCE, PLAY = 2e-4, 0.03
LOOSE = {"compliance": COMPLIANCE, "natural_frequency": 8.0, "damping_ratio": 0.5}


def held(rig: pamrs.Rig) -> tuple[float, float]:
    """Angle [rad] and torque of the muscles [N m] after 10 s at one set pressure."""
    run = pamrs.simulate(rig, supply_command=np.full(1001, 2e5), sample_time=0.01)
    return float(run["joint_angle"][-1]), float(run["joint_torque"][-1])


def test_the_link_stands_behind_the_play() -> None:
    """At rest the weight is that of a link which stands further by half the play and by what the
    spring gives way.
    """
    rig = pamrs.rigs.regulated_joint().with_parameters({"arm.coulomb": 0.0})
    angle, torque = held(rig)
    weight = torque / np.sin(angle)
    loose = rig.with_effect("base_flexibility", LOOSE | {"play": PLAY}, form="with_play")
    angle, torque = held(loose)
    turned = np.arcsin(torque / weight) - angle
    assert turned == pytest.approx(-(COMPLIANCE * torque + 0.5 * PLAY), rel=2e-3)
