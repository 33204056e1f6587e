"""Pressures in bar where pascals are wanted are told to whoever gave them."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pamrs
from pamrs.errors import UnitWarning

TOLD = r"never exceeds 2 Pa \(gauge\): pascals are wanted, 1 bar is 1e5"


def test_a_force_at_two_pascals_is_doubted() -> None:
    muscle = pamrs.rigs.shoulder().muscle
    with pytest.warns(UnitWarning, match=rf"^pressure {TOLD}") as caught:
        force = muscle.force([0.0, 2.0], 0.05)
    assert np.all(np.isfinite(force))
    assert caught[0].filename == __file__


def test_a_regulator_set_to_two_pascals_is_doubted() -> None:
    rig = pamrs.rigs.regulated_joint()
    with pytest.warns(UnitWarning, match=rf"^supply_command {TOLD}") as caught:
        pamrs.simulate(rig, supply_command=np.full(20, 2.0), sample_time=0.01)
    assert caught[0].filename == __file__


def test_no_pressure_and_usual_ones_are_not() -> None:
    muscle = pamrs.rigs.shoulder().muscle
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        muscle.force(0.0, 0.05)
        muscle.force([1.0, 2e5], 0.05)
