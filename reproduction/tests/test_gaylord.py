"""Gaylord's force as the educated guess of (5.25)."""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import FullTorque
from reproduction.gaylord import GaylordTorque


def test_gaylord_estimate():
    rig = pamrs.rigs.shoulder()
    guess, muscle = GaylordTorque(rig), rig.muscle
    angle = math.radians(60.0)
    length = 0.276 - 0.7 * 0.0254 * math.radians(45.0)
    area = (3 * length**2 - muscle.fibre_length**2) / (4 * math.pi * muscle.turns**2)
    by_hand = 6 * area * 0.7 * 0.0254
    assert guess.at(angle)[0] == pytest.approx(by_hand, rel=1e-6)
    assert guess.at(np.array([angle]))[0][0] == guess.at(angle)[0]
    assert guess.at(angle)[1] == 0.0
    # as printed, 5 in long and with B = 11.23 in, the muscle would push
    assert 3 * 5.0**2 < 11.23**2
    # it overestimates the slope where the muscle is contracted
    assert guess.at(math.radians(110.0))[0] > FullTorque(rig).at(math.radians(110.0))[0]
