"""Several instances of one effect in a rig: each at its own block, with its own parameters."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError
from pamrs.simulation import core_rig

SHUT = {"flexor": 5.0, "extensor": 5.0}


def leaking(flexor: float, extensor: float) -> pamrs.Rig:
    """The antagonistic joint, its two chambers with a leak each [m3/(s Pa)]."""
    rig = pamrs.rigs.named("antagonistic_joint")
    rig = rig.with_effect("leak_muscle", {"conductance": flexor}, at="flexor")
    return rig.with_effect("leak_muscle", {"conductance": extensor}, at="extensor")


def held(rig: pamrs.Rig) -> pamrs.Simulation:
    """Both valves shut for five seconds."""
    return pamrs.simulate(rig, SHUT, sample_time=0.01, duration=5.0)


def test_two_alike_are_one_everywhere() -> None:
    everywhere = pamrs.rigs.named("antagonistic_joint").with_effect(
        "leak_muscle", {"conductance": 1e-10}
    )
    one, two = held(leaking(1e-10, 1e-10)), held(everywhere)
    for channel in one:
        np.testing.assert_array_equal(one[channel], two[channel])


def test_other_values_are_those_of_another_description() -> None:
    core = core_rig(leaking(1e-10, 3e-11))
    values = core.values
    values[core.parameter_names.index("leak_muscle.extensor.conductance")] = 2e-11
    again = core.with_values(values)
    np.testing.assert_array_equal(again.values, core_rig(leaking(1e-10, 2e-11)).values)
    values[core.parameter_names.index("leak_muscle.flexor.conductance")] = -1.0
    with pytest.raises(ParameterError, match=r"leak_muscle\.flexor\.conductance"):
        core.with_values(values)
