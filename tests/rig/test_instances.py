"""Several instances of one effect in a rig: each at its own block, with its own parameters."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import pamrs
from pamrs import _core
from pamrs.errors import ParameterError, RigError
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig

SIDES = ("flexor", "extensor")
SHUT = {"flexor": 5.0, "extensor": 5.0}


def leaking(flexor: float, extensor: float) -> pamrs.Rig:
    """The antagonistic joint, its two chambers with a leak each [m3/(s Pa)]."""
    rig = pamrs.rigs.named("antagonistic_joint")
    rig = rig.with_effect("leak_muscle", {"conductance": flexor}, at="flexor")
    return rig.with_effect("leak_muscle", {"conductance": extensor}, at="extensor")


def held(rig: pamrs.Rig) -> pamrs.Simulation:
    """Both valves shut for five seconds."""
    return pamrs.simulate(rig, SHUT, sample_time=0.01, duration=5.0)


def test_only_one_of_two_chambers_loses_its_pressure() -> None:
    tight, one = held(pamrs.rigs.named("antagonistic_joint")), held(leaking(1e-10, 0.0))
    lost = {side: (tight[f"air_mass.{side}"] - one[f"air_mass.{side}"])[-1] for side in SIDES}
    assert lost["flexor"] > 0.05 * tight["air_mass.flexor"][-1]
    assert abs(lost["extensor"]) < 1e-12 * tight["air_mass.extensor"][-1]
    assert one["muscle_pressure.flexor"][-1] < 0.9 * tight["muscle_pressure.flexor"][-1]
    both = held(leaking(1e-10, 3e-11))
    kept = {side: both[f"air_mass.{side}"][-1] / tight[f"air_mass.{side}"][-1] for side in SIDES}
    assert kept["flexor"] < kept["extensor"] < 0.99


def test_two_alike_are_one_everywhere() -> None:
    everywhere = pamrs.rigs.named("antagonistic_joint").with_effect(
        "leak_muscle", {"conductance": 1e-10}
    )
    one, two = held(leaking(1e-10, 1e-10)), held(everywhere)
    for channel in one:
        np.testing.assert_array_equal(one[channel], two[channel])


def predict(
    core: _core.Rig, run: pamrs.Simulation, block: str, names: list[str]
) -> tuple[np.ndarray, np.ndarray | None]:
    """What a block predicts from a simulation, with the slopes over some parameters."""
    n = run.time.size
    measured = {
        name: (run[name], np.gradient(run[name], 0.01))
        for name in run
        if name.startswith(("supply_pressure", "muscle_pressure", "joint_angle"))
    }
    commands = {f"valve_command.{side}": np.full(n, 5.0) for side in SIDES}
    return core.predict(block, commands, 0.01, 0.001, [0], names, measured, n)


@pytest.mark.parametrize(("side", "other"), [SIDES, SIDES[::-1]])
def test_each_leak_has_a_sensitivity_of_its_own(side: str, other: str) -> None:
    sizes = {"flexor": 1e-10, "extensor": 3e-11}
    rig = leaking(**sizes)
    run, core = held(rig), core_rig(rig)
    own, foreign = (f"leak_muscle.{name}.conductance" for name in (side, other))
    assert {own, foreign} <= set(core.parameter_names)
    _, jacobian = predict(core, run, f"chamber.{side}", [own, foreign])
    assert jacobian is not None
    assert np.all(jacobian[:, 1] == 0.0)
    step = 1e-3 * sizes[side]
    up, down = (
        predict(core_rig(leaking(**{**sizes, side: sizes[side] + h})), run, f"chamber.{side}", [])[
            0
        ]
        for h in (step, -step)
    )
    slope = (up - down) / (2.0 * step)
    assert np.abs(slope).max() > 0.0
    np.testing.assert_allclose(jacobian[:, 0], slope, rtol=0.0, atol=1e-4 * np.abs(slope).max())


def test_other_values_are_those_of_another_description() -> None:
    core = core_rig(leaking(1e-10, 3e-11))
    values = core.values
    values[core.parameter_names.index("leak_muscle.extensor.conductance")] = 2e-11
    again = core.with_values(values)
    np.testing.assert_array_equal(again.values, core_rig(leaking(1e-10, 2e-11)).values)
    values[core.parameter_names.index("leak_muscle.flexor.conductance")] = -1.0
    with pytest.raises(ParameterError, match=r"leak_muscle\.flexor\.conductance"):
        core.with_values(values)


def noted() -> pamrs.Rig:
    """Two leaks, each with its own standard deviation."""
    rig = pamrs.rigs.named("antagonistic_joint")
    for side, size in (("flexor", 1e-10), ("extensor", 3e-11)):
        rig = rig.with_effect(
            "leak_muscle", {"conductance": size}, std={"conductance": 0.1 * size}, at=side
        )
    return rig


def test_a_file_keeps_each_with_what_is_known_of_it() -> None:
    rig = noted()
    text = rig.to_toml_text()
    again = parse_rig(text)
    assert again.effects == rig.effects
    assert [effect["at"] for effect in again.effects] == list(SIDES)
    assert again.to_toml_text() == text
    assert text.count("std = ") == 2
    one, two = held(rig), held(again)
    for channel in one:
        np.testing.assert_array_equal(one[channel], two[channel])


def test_pickling_keeps_each() -> None:
    rig = noted()
    held(rig)
    again = pickle.loads(pickle.dumps(rig))
    assert again.effects == rig.effects
    assert again.to_toml_text() == rig.to_toml_text()
    np.testing.assert_array_equal(held(again)["joint_angle.elbow"], held(rig)["joint_angle.elbow"])


def test_one_at_a_block_is_replaced_or_taken_away_alone() -> None:
    rig = noted()
    changed = rig.with_effect("leak_muscle", {"conductance": 5e-11}, at="chamber.flexor")
    sizes = {effect["at"]: effect["parameters"]["conductance"] for effect in changed.effects}
    assert sizes == {"flexor": 5e-11, "extensor": 3e-11}
    assert [effect["at"] for effect in rig.without_effect("leak_muscle", at="flexor").effects] == [
        "extensor"
    ]
    assert rig.without_effect("leak_muscle").effects == []
    everywhere = rig.with_effect("leak_muscle", {"conductance": 5e-11})
    assert ["at" in effect for effect in everywhere.effects] == [False]


def test_one_at_a_block_is_found_by_both_names() -> None:
    rig = pamrs.rigs.named("antagonistic_joint")
    core = core_rig(rig.with_effect("leak_muscle", {"conductance": 1e-10}, at="flexor"))
    run = held(rig)
    short, full = (
        predict(core, run, "chamber.flexor", [name])[1]
        for name in ("leak_muscle.conductance", "leak_muscle.flexor.conductance")
    )
    np.testing.assert_array_equal(short, full)


def test_the_same_block_twice_is_refused_in_a_file() -> None:
    entry = '\n[[effects]]\nid = "leak_muscle"\nat = "flexor"\n'
    with pytest.raises(RigError, match=r"effects\[2\].*leak_muscle.*twice"):
        parse_rig(noted().to_toml_text() + entry)
