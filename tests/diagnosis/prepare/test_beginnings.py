"""Where a regulator without a gauge began: what depends on it is not judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pamrs.diagnosis.limits import counted
from pamrs.diagnosis.next_experiment._choice import Outcome, outcome_of
from pamrs.diagnosis.prepare import (
    Block,
    Prepared,
    available_blocks,
    predicted,
    prepare,
    residual,
    with_unjudged_starts,
)
from pamrs.errors import PamrsError
from pamrs.experiments import Experiment
from pamrs.recordings import OwnValue, Recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis.asked import SETTINGS, diagnosed, problem_of
from tests.diagnosis.noisy import GAUGES, driven
from tests.diagnosis.stands import LIMITED

RIG = parse_rig(LIMITED)
DT = 0.005
FILLING = 3e5 + 2e5 * np.sin(2.0 * np.arange(0.0, 6.0, DT))


def made(
    rig: Rig, command: np.ndarray, outlet: float, chamber: float, seed: int = 3
) -> tuple[Block, Prepared]:
    """The chamber of a log that begins with these pressures, the outlet having no gauge."""
    start = {"supply_pressure": outlet, "muscle_pressure": chamber}
    given, noise = {"supply_command": command}, {"muscle_pressure": 400.0}
    one = driven(rig, "lift", "fit", DT, given, noise, [seed], initial=start)
    (block,) = available_blocks(rig, tuple(one.channels))
    return block, prepare(one, rig, SETTINGS)


@pytest.mark.parametrize("outlet", [0.0, 1.5e5, 3e5])
def test_what_shows_the_unknown_beginning_is_not_judged(outlet: float) -> None:
    """A stopcock is opened as the log begins, or the set pressure jumps: whatever the regulator's
    outlet is, a true model leaves noise.
    """
    core = core_rig(RIG)
    block, prepared = made(RIG, FILLING, outlet, 0.0)
    kept = with_unjudged_starts([block], core, prepared)
    before, after = (residual(block, core, p, []) for p in (prepared, kept))
    assert 0.3 < kept.unsettled["muscle_pressure"] * DT < 1.5
    assert not after.rows[: kept.unsettled["muscle_pressure"]].any()
    assert np.array_equal(after.rows[400:], before.rows[400:])
    assert np.std(after.value[after.rows]) < 1.1 * after.noise
    if outlet > 0.0:
        assert np.std(before.value[before.rows]) > 5.0 * before.noise


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_regulator_at_rest_at_its_stated_start_is_judged_from_the_first_sample(
    late: float,
) -> None:
    """The chamber is empty, the regulator stands at 1.5 bar and is then set to 3 bar."""
    rig = RIG.with_parameters({"supply.initial_pressure": 1.5e5, "supply.dead_time": late})
    block, prepared = made(rig, FILLING, 1.5e5, 0.0)
    core = core_rig(rig)

    def begun(value: OwnValue) -> Prepared:
        stated = {"supply.initial_pressure": value}
        again = prepare(replace(prepared.recording, parameters=stated), rig, SETTINGS)
        return with_unjudged_starts([block], core, again)

    said, wrong = (begun(OwnValue(p, 1.5e5, "none")) for p in (1.5e5, 2.5e5))
    assert said.unsettled == wrong.unsettled == {}
    assert np.std(residual(block, core, said, []).value) < 1.1 * said.noise["muscle_pressure"]
    assert np.std(residual(block, core, wrong, []).value) > 5.0 * said.noise["muscle_pressure"]
    assert begun(OwnValue(1.5e5, 1.5e5, "own")).unsettled["muscle_pressure"] > 0


def test_a_stated_start_that_is_not_sure_costs_the_samples_that_show_it() -> None:
    text = LIMITED.replace('0.5, unit = "bar"', '1.5, unit = "bar", tol = 0.2')
    rig = parse_rig(text)
    block, prepared = made(rig, FILLING, 1.5e5, 0.0)
    stated = {"supply.initial_pressure": OwnValue(1.5e5, 1.5e5)}
    unsure = prepare(replace(prepared.recording, parameters=stated), rig, SETTINGS)
    kept = with_unjudged_starts([block], core_rig(rig), unsure)
    least = with_unjudged_starts([block], core_rig(rig), prepared).unsettled["muscle_pressure"]
    assert 0 < kept.unsettled["muscle_pressure"] <= least


def test_a_log_that_begins_at_rest_loses_nothing() -> None:
    command = np.repeat([2e5, 4e5, 3e5], 400)
    block, prepared = made(RIG, command, 2e5, 2e5)
    kept = with_unjudged_starts([block], core_rig(RIG), prepared)
    assert kept.unsettled.get("muscle_pressure", 0) * DT < 0.3


def test_a_supply_with_a_gauge_begins_where_it_was_measured() -> None:
    one = driven(RIG, "lift", "fit", DT, {"supply_command": FILLING}, GAUGES, [3])
    problem = problem_of(RIG, [one])
    assert with_unjudged_starts(problem.blocks, problem.core, problem.recordings[0]).unsettled == {}


def test_outlets_are_those_of_supplies_and_above_a_vacuum() -> None:
    core = core_rig(RIG)
    block, prepared = made(RIG, FILLING, 3e5, 0.0)
    far, near = (predicted(block, core, prepared, {"supply": p}) for p in (3e5, 0.0))
    assert far[20] - near[20] > 1e4
    for wrong in ({"tank": 1e5}, {"supply": -2e5}, {"supply": float("nan")}):
        with pytest.raises(PamrsError):
            predicted(block, core, prepared, wrong)


def test_a_diagnosis_says_what_it_did_not_judge() -> None:
    def lift(role: str, seed: int) -> Recording:
        command = FILLING + 1e5 * np.sin(3.1 * seed + 7.0 * np.arange(0.0, 6.0, DT))
        _, prepared = made(RIG, command, float(command[0]), 0.0, seed)
        return replace(prepared.recording, name=f"r{seed}", role=role)

    found = diagnosed(RIG, lift)
    assert found.verdict == "none"
    assert not found.answer.missed  # the whole rig is not judged by it either
    (told,) = (text for text in found.warnings if "were not judged" in text)
    assert "block chamber: the first 0." in told
    assert "of r0, " in told
    assert "of r2" in told
    assert "a gauge for supply_pressure would" in told


def fills(duration: float, *channels: str) -> Outcome:
    """What a set pressure that begins far above the chamber would tell of two time constants."""
    command = np.full(round(duration / DT), 4e5)
    start = {"supply_pressure": 4e5, "muscle_pressure": 0.0}
    given = ("fill", "open the stopcock", {"kind": "fill"}, command, command.size, DT, start)
    done = Experiment(*given, channel="supply_command")
    nominal = parse_rig(LIMITED.replace(", tol = 0.01 }", " }", 1))  # of the time constant
    slow = nominal.with_parameters({"supply.time_constant": 0.2})
    hypotheses = [("none", nominal, 0.5), ("supply.time_constant", slow, 0.5)]
    return outcome_of(done, hypotheses, GAUGES, ("supply_command", *channels), SETTINGS)


def test_an_experiment_tells_nothing_by_samples_that_are_not_judged() -> None:
    """All that the two differ by is in the filling: a gauge at the regulator tells it."""
    blind, seen = fills(8.0, "muscle_pressure"), fills(8.0, "supply_pressure", "muscle_pressure")
    (prepared,) = blind.problem.recordings
    dropped = prepared.unsettled["muscle_pressure"]
    assert 0.5 < dropped * DT < 6.0
    assert seen.problem.recordings[0].unsettled == {}
    assert blind.bits < 0.05
    assert seen.bits > 0.9


def test_a_recording_counts_by_the_samples_that_are_judged() -> None:
    """What is told of nothing but rows after the beginning is told by as many as are left."""
    (prepared,) = fills(8.0, "muscle_pressure").problem.recordings
    (block,) = available_blocks(RIG, ("supply_command", "muscle_pressure"))
    most = SETTINGS.effective_samples
    dropped = prepared.unsettled["muscle_pressure"]
    assert counted(prepared, block, SETTINGS) == most * (1 - dropped / prepared.n)
    whole = replace(prepared, unsettled={})
    assert counted(whole, block, SETTINGS) == most


def test_an_experiment_shorter_than_its_beginning_tells_nothing() -> None:
    found = fills(0.5, "muscle_pressure")
    assert found.problem.recordings[0].unsettled["muscle_pressure"] >= 100
    assert np.array_equal(found.distance, np.zeros((2, 2)))
