"""A hose and a muscle behind the valve's gauge: nobody measured the muscle's pressure, which is
simulated from the gauge on.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import acts_in
from pamrs.diagnosis.prepare import residual, unjudged_blocks
from pamrs.effects import Term
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.asked import blocks_of, diagnosed, names_value, problem_of
from tests.diagnosis.noisy import driven

HOSE = """
[line]
kind         = "tube"
length       = { value = 2, unit = "m", tol = 0.01 }
diameter     = { value = 3, unit = "mm", tol = 0.05 }
inlet_volume = { value = 5, unit = "cm3", tol = 0.5 }
"""
RIG = parse_rig(pamrs.rigs.shoulder().to_toml_text() + HOSE)
NOISE = {"supply_pressure": 400.0, "line_pressure": 400.0, "joint_angle": 3e-4}
CHANNELS = ("valve_command", *NOISE)
DT = 0.005


def moved(rig: pamrs.Rig, role: str, seed: int) -> Recording:
    """Ten seconds of lifts and steps without the muscle's gauge, from a rest at 2 bar."""
    time, rest = np.arange(0.0, 10.0, DT), round(4.0 / DT)
    command = (
        5.0
        + 0.25 * np.sin(2 * np.pi * (0.2 + 0.05 * seed) * time)
        + 0.2 * np.sign(np.sin(2 * np.pi * 0.37 * time + seed))
    )
    given = {"valve_command": np.concatenate([np.full(rest, 5.0), command])}
    start = {"muscle_pressure": 2e5, "line_pressure": 2e5, "joint_angle": 0.6}
    return driven(rig, f"r{seed}", role, DT, given, NOISE, [9, seed], first=rest, initial=start)


def test_the_arm_is_predicted_from_the_gauge_on() -> None:
    blocks = blocks_of(RIG, CHANNELS)
    assert set(blocks) == {"supply", "line", "arm"}
    for name in ("line", "arm"):
        assert blocks[name].beside == ("chamber",)
        assert {"line.diameter", "chamber.dead_volume"} <= blocks[name].parameters
        assert acts_in(Term("leak_muscle"), blocks[name])
    assert blocks["arm"].drives == ("line_pressure",)
    assert {"line_pressure", "joint_angle"} & {*blocks["line"].drives} == {"joint_angle"}
    (chamber,) = unjudged_blocks(RIG, CHANNELS)
    assert "simulated behind a gauge" in chamber.why
    assert blocks_of(RIG, (*CHANNELS, "muscle_pressure"))["arm"].beside == ()


def test_a_true_model_leaves_noise() -> None:
    problem = problem_of(RIG, [moved(RIG, "fit", 0)])
    for block in problem.blocks:
        found = residual(block, problem.core, problem.recordings[0], ["line.diameter"])
        assert np.std(found.value[found.rows]) < 1.2 * found.noise, block.name
        assert found.jacobian is not None
        shows = np.abs(found.jacobian).max() * 1e-4 / found.noise
        assert (shows > 1.0) == (block.name != "supply"), block.name


def test_a_narrow_hose_is_named_without_a_gauge_in_the_muscle() -> None:
    narrow = RIG.with_parameters({"line.diameter": 2.5e-3})
    names_value(diagnosed(RIG, partial(moved, narrow)), "line.diameter", 2.5e-3, 0.02)


def test_a_chamber_that_a_valve_feeds_needs_its_own_gauge() -> None:
    plain = pamrs.rigs.shoulder()
    channels = ("valve_command", "supply_pressure", "joint_angle")
    assert blocks_of(plain, channels) == {}
    waves = parse_rig(pamrs.rigs.shoulder().to_toml_text() + HOSE + "segments = 8\n")
    assert set(blocks_of(waves, CHANNELS)) <= {"supply", "line"}
    with pytest.raises(pamrs.errors.DiagnosisError, match="muscle_pressure"):
        diagnosed(plain, partial(_without_line, plain))


def _without_line(rig: pamrs.Rig, role: str, seed: int) -> Recording:
    time = np.arange(0.0, 4.0, DT)
    given, noise = {"valve_command": 5.0 + 0.3 * np.sin(time)}, {"joint_angle": 3e-4}
    return driven(rig, f"r{seed}", role, DT, given, noise, [9, seed])
