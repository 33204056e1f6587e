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
from tests.diagnosis.asked import blocks_of, diagnosed, leading, names_value, problem_of
from tests.diagnosis.noisy import driven, without

HOSE = """
[line]
kind         = "tube"
length       = { value = 2, unit = "m", tol = 0.01 }
diameter     = { value = 3, unit = "mm", tol = 0.05 }
inlet_volume = { value = 40, unit = "cm3", tol = 4 }
"""
RIG = parse_rig(pamrs.rigs.shoulder().to_toml_text() + HOSE)
NOISE = {"supply_pressure": 400.0, "line_pressure": 400.0, "joint_angle": 3e-4}
CHANNELS = ("valve_command", *NOISE)
DT = 0.01


def moved(
    rig: pamrs.Rig,
    role: str,
    seed: int,
    dt: float = DT,
    square: float = 0.2,
    noise: dict[str, float] = NOISE,
) -> Recording:
    """Eight seconds of lifts and steps from a rest at 2 bar, by a valve or a regulator."""
    time, rest = np.arange(0.0, 8.0, dt), round(4.0 / dt)
    swing = np.sin(2 * np.pi * (0.2 + 0.05 * seed) * time)
    way = 0.25 * swing + square * np.sign(np.sin(2 * np.pi * 0.37 * time + seed))
    way = np.concatenate([np.zeros(rest), way])
    valve = bool(rig.tables("valve"))
    given = {"valve_command": 5.0 + way} if valve else {"supply_command": 2e5 + 2e5 * way}
    start = {"muscle_pressure": 2e5, "joint_angle": 0.6}
    start["line_pressure" if valve else "supply_pressure"] = 2e5
    return driven(rig, f"r{seed}", role, dt, given, noise, [9, seed], first=rest, initial=start)


def test_the_arm_is_predicted_from_the_gauge_on() -> None:
    blocks = blocks_of(RIG, CHANNELS)
    assert set(blocks) == {"supply", "line", "arm"}
    for name in ("line", "arm"):
        assert blocks[name].simulated == ("chamber",)
        assert {"line.diameter", "chamber.dead_volume"} <= blocks[name].parameters
        assert acts_in(Term("leak_muscle"), blocks[name])
        assert blocks[name].covers.endswith(", with line and chamber")
    assert blocks["arm"].drives == ("line_pressure",)
    assert set(blocks["line"].drives) == {"supply_pressure", "valve_command", "joint_angle"}
    assert unjudged_blocks(RIG, CHANNELS) == []
    assert blocks_of(RIG, (*CHANNELS, "muscle_pressure"))["arm"].simulated == ()


@pytest.mark.parametrize(
    ("rig", "gauge"), [(RIG, "line_pressure"), (pamrs.rigs.regulated_joint(), "supply_pressure")]
)
def test_with_a_gauge_in_the_muscle_the_prediction_is_the_same(rig: pamrs.Rig, gauge: str) -> None:
    """Exact samples: what is left is how pressures go from one sample to the next."""
    apart = []
    for dt in (4e-3, 1e-3):
        exact = dict.fromkeys((gauge, "muscle_pressure", "joint_angle"), 0.0)
        full = moved(rig, "fit", 0, dt, 0.0, exact)
        predictions = []
        for one in (full, without(full, "muscle_pressure")):
            problem = problem_of(rig, [one], "arm")
            (block,) = problem.blocks
            assert block.drives == (gauge if one is not full else "muscle_pressure",)
            predictions.append(residual(block, problem.core, problem.recordings[0], []).value)
        apart.append(float(np.abs(predictions[1] - predictions[0]).max()))
    assert apart[1] < 2e-5  # [rad]
    assert apart[1] < 0.25 * apart[0]


def test_a_true_model_leaves_noise() -> None:
    full = moved(RIG, "fit", 0, noise=NOISE | {"muscle_pressure": 400.0})
    misses = []
    for one in (full, without(full, "muscle_pressure")):
        problem = problem_of(RIG, [one], "line", "arm")
        prepared = problem.recordings[0]
        line, arm = (residual(b, problem.core, prepared, ["line.diameter"]) for b in problem.blocks)
        misses.append([np.std(found.value[found.rows]) / found.noise for found in (line, arm)])
    assert misses[1][0] < 1.1
    assert misses[1][1] < 1.1 * misses[0][1]  # noise of the gauge drives the arm
    for found in (line, arm):
        assert np.abs(found.jacobian).max() * 1e-4 > found.noise  # of a hose 0.1 mm narrower


@pytest.mark.parametrize(
    ("rig", "narrow", "noise"),
    [
        pytest.param(RIG, 2.5e-3, NOISE, marks=pytest.mark.slow),
        (
            pamrs.rigs.regulated_joint(),
            4e-3,
            {"supply_pressure": 400.0, "joint_angle": 3e-4},
        ),
    ],
    ids=["valve", "regulator"],
)
def test_a_narrow_hose_is_named_without_a_gauge_in_the_muscle(
    rig: pamrs.Rig, narrow: float, noise: dict[str, float]
) -> None:
    true = rig.with_parameters({"line.diameter": narrow})
    found = diagnosed(rig, lambda role, seed: moved(true, role, seed, noise=noise))
    names_value(found, "line.diameter", narrow, 0.02)
    assert not found.answer.missed  # the whole rig begins at the gauge, too
    assert found.headline.count("line diameter") == 1


@pytest.mark.slow
def test_a_leak_is_named_without_a_gauge_in_the_muscle() -> None:
    leaking = RIG.with_effect("leak_muscle", {"conductance": 5e-11})
    found = diagnosed(RIG, partial(moved, leaking))
    assert leading(found) == "leak_muscle", found.summary()


def test_a_chamber_that_a_valve_feeds_needs_its_own_gauge() -> None:
    plain = pamrs.rigs.shoulder()
    channels = ("valve_command", "supply_pressure", "joint_angle")
    assert blocks_of(plain, channels) == {}
    waves = parse_rig(pamrs.rigs.shoulder().to_toml_text() + HOSE + "segments = 8\n")
    assert set(blocks_of(waves, CHANNELS)) <= {"supply", "line"}
    with pytest.raises(pamrs.errors.DiagnosisError, match="muscle_pressure"):
        diagnosed(plain, lambda role, seed: without(moved(RIG, role, seed), "line_pressure"))
