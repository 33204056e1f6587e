"""A hose that carries waves between two gauges: its length is told from what arrives late."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import prepare, residual, with_unjudged_starts
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis import slopes
from tests.diagnosis.asked import SETTINGS, blocks_of, diagnosed, problem_of
from tests.diagnosis.noisy import driven

TEXT = pamrs.rigs.template("long_tube", "hose", "coefficients")
CHANNELS = ("muscle_pressure.left", "muscle_pressure.right")
NOISE = dict.fromkeys(CHANNELS, 300.0)


def stated(**tolerances: float) -> Rig:
    """The packaged rig with other tolerances of its line."""
    text = TEXT
    for key, was, unit in (("length", "0.02", '"m",  '), ("alpha", "0.02", '"1", ')):
        old = f"unit = {unit}tol = {was} }}"
        assert text.count(old) == 1, (key, old)
        text = text.replace(old, f"unit = {unit}tol = {tolerances.get(key, float(was))} }}")
    return parse_rig(text)


RIG = stated(length=0.2, alpha=0.0)
RIGHT = blocks_of(RIG, CHANNELS)["chamber.right"]


def opened(
    true: Rig, role: str, seed: int, pressure: float, late: float = 0.0, duration: float = 0.8
) -> Recording:
    """The outlet thrown open, 0.8 s at 500 Hz; a late one begins while air flows."""
    start = {"muscle_pressure.left": pressure}
    rows, seconds = round(late / 0.002), duration + late
    given = {"first": rows, "duration": seconds, "initial": start}
    return driven(true, f"r{seed}", role, 0.002, {}, NOISE, [7, seed], **given)


PRESSURES = (2e5, 4e5, 3e5)
"""Where the recordings of a case begin."""


def test_both_gauges_are_boundaries_and_the_hose_lies_in_each_block() -> None:
    blocks = blocks_of(RIG, CHANNELS)
    assert list(blocks) == ["chamber.left", "chamber.right"]
    for block in blocks.values():
        assert {"line.length", "line.diameter", "line.alpha"} <= block.parameters
    usual = RIG.with_parameters({"line.segments": 0})
    for block in blocks_of(usual, CHANNELS).values():
        assert "line.length" in block.parameters
        assert "line.alpha" not in block.parameters


@pytest.mark.parametrize(
    ("wrong", "seen"),
    [({}, False), ({"line.length": 8.6}, True), ({"line.alpha": 1.2}, True)],
)
def test_what_is_wrong_along_the_hose_shows(wrong: dict[str, float], seen: bool) -> None:
    prepared = prepare(opened(RIG.with_parameters(wrong), "fit", 0, 3e5), RIG, SETTINGS)
    left = residual(RIGHT, core_rig(RIG), prepared, [])
    ratio = float(np.std(left.value[left.rows])) / left.noise
    assert (ratio > 2.0) == seen, ratio


def test_sensitivities_are_those_of_differences() -> None:
    prepared = prepare(opened(RIG, "fit", 0, 3e5), RIG, SETTINGS)
    names = ("line.length", "line.diameter", "line.alpha", "chamber.right.alpha_in")
    slopes.are_those_of_differences(RIGHT, RIG, prepared, *names)


BALANCED = parse_rig(pamrs.rigs.template("long_tube"))


@pytest.mark.parametrize("late", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("rig", [RIG, BALANCED])
def test_what_shows_a_flow_before_the_recording_is_not_judged(rig: Rig, late: float) -> None:
    """Nobody measured what flows along the tube as the recording begins: a true model leaves noise
    where that is forgotten.
    """
    prepared = prepare(opened(rig, "fit", 0, 4e5, late, 3.0), rig, SETTINGS)
    blocks, core = list(blocks_of(rig, CHANNELS).values()), core_rig(rig)
    kept = with_unjudged_starts(blocks, core, prepared)
    before, after = (residual(blocks[1], core, p, []) for p in (prepared, kept))
    # a gas that begins warm explains what is left of it by then
    explained = rig is BALANCED and late > 0.2
    assert explained or np.std(before.value[before.rows]) > 1.7 * before.noise
    for block in blocks:
        left = residual(block, core, kept, [])
        assert 0.3 < kept.unsettled[block.channel] * prepared.dt < 2.3
        assert np.std(left.value[left.rows]) < 1.15 * left.noise
    last = kept.unsettled[blocks[1].channel]
    assert not after.rows[:last].any()
    assert after.rows[last:].any()


@pytest.mark.parametrize("rig", [RIG, BALANCED])
@pytest.mark.parametrize("right", [0.0, 2e5])
@pytest.mark.parametrize("wrong", [{}, {"line.length": 8.6}])
def test_a_tube_that_was_at_rest_loses_nothing(
    rig: Rig, right: float, wrong: dict[str, float]
) -> None:
    """At one pressure all along, or opened as the recording begins; an opening tells the length, so
    that it is judged whatever that is.
    """
    start = {"muscle_pressure.left": 2e5, "muscle_pressure.right": right}
    true = rig.with_parameters(wrong)
    one = driven(true, "r", "fit", 0.002, {}, NOISE, [7, 3], duration=1.0, initial=start)
    own = problem_of(rig, [one])
    assert with_unjudged_starts(own.blocks, own.core, own.recordings[0]).unsettled == {}


@pytest.mark.slow
def test_a_diagnosis_of_what_begins_in_a_flow_finds_nothing() -> None:
    found = diagnosed(RIG, lambda role, k: opened(RIG, role, k, PRESSURES[k], 0.1, 3.0))
    assert found.verdict in ("none", "parameters")
    assert not found.effects
    told = [text for text in found.warnings if "were not judged" in text]
    assert len(told) == 2
    assert "what flowed through line before" in told[1]
    assert "begins at rest" in told[1]


@pytest.mark.slow
def test_another_length_is_a_parameter_and_no_missing_physics() -> None:
    true = RIG.with_parameters({"line.length": 8.3})
    found = diagnosed(RIG, lambda role, k: opened(true, role, k, PRESSURES[k]))
    assert found.verdict == "parameters"
    assert not found.effects
    length = found.parameters["line.length"]
    assert abs(length.value - 8.3) < 3.0 * length.std
    assert 8.15 < length.value < 8.45
