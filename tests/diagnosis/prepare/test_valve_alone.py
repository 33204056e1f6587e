"""A gauge between valve and line: the valve is a block of its own, beside the chamber."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import limits
from pamrs.diagnosis.fit import acts_in
from pamrs.diagnosis.next_experiment import _planning as plan
from pamrs.diagnosis.next_experiment._differences import usual_noise
from pamrs.diagnosis.prepare import prepare, residual
from pamrs.effects import EFFECTS, Term
from pamrs.experiments import library
from pamrs.recordings import Recording
from pamrs.rig import Rig, load_rig
from pamrs.simulation import core_rig
from tests.diagnosis import slopes
from tests.diagnosis.asked import EXACT, SETTINGS, blocks_of, diagnosed
from tests.diagnosis.noisy import driven

RIG = load_rig(Path(__file__).parents[3] / "cases" / "layouts" / "eight_metres.toml")
NOISE = {"supply_pressure": 400.0, "line_pressure": 400.0, "muscle_pressure": 400.0}
CHANNELS = ("valve_command", *NOISE)


def recorded(true: Rig, role: str, seed: int) -> Recording:
    """Steps of the valve, twelve seconds at 200 Hz."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(1.0, 9.0, 24), 100)
    given = {"valve_command": command}
    return driven(true, f"r{seed}", role, 0.005, given, NOISE, [5, seed])


def test_every_gauge_is_a_boundary() -> None:
    blocks = blocks_of(RIG, CHANNELS)
    assert list(blocks) == ["supply", "line", "chamber"]
    assert set(blocks["supply"].drives) == {"line_pressure", "valve_command"}
    assert set(blocks["line"].drives) == {"supply_pressure", "muscle_pressure", "valve_command"}
    assert set(blocks["chamber"].drives) == {"supply_pressure", "valve_command"}
    assert blocks["line"].covers == "valve and line inlet"
    assert blocks["chamber"].covers == "valve, line and chamber"
    assert "valve.vent_conductance" in blocks["line"].parameters
    assert "line.inlet_volume" in blocks["line"].parameters
    assert "valve.vent_conductance" in blocks["chamber"].parameters
    assert "line.diameter" in blocks["line"].parameters & blocks["chamber"].parameters
    assert "chamber.dead_volume" not in blocks["line"].parameters
    assert acts_in(Term("valve_dead_zone"), blocks["line"])
    assert not acts_in(Term("muscle_hysteresis"), blocks["line"])


def test_the_inlet_drives_the_chamber_where_the_valve_cannot() -> None:
    lacking = ("valve_command", "line_pressure", "muscle_pressure")  # a tank without a gauge
    (chamber,) = blocks_of(RIG, lacking).values()
    assert (chamber.name, chamber.drives) == ("chamber", ("line_pressure",))
    assert chamber.covers == "line and chamber"
    assert "valve.vent_conductance" not in chamber.parameters
    prepared = prepare(recorded(RIG, "fit", 0), RIG, SETTINGS)
    left = residual(chamber, core_rig(RIG), prepared, [])
    assert np.std(left.value[left.rows]) < 2.0 * left.noise


def test_without_that_gauge_valve_and_line_are_one() -> None:
    without = tuple(name for name in CHANNELS if name != "line_pressure")
    blocks = blocks_of(RIG, without)
    assert list(blocks) == ["supply", "chamber"]
    assert set(blocks["chamber"].drives) == {"supply_pressure", "valve_command"}
    assert blocks["chamber"].covers == "valve, line and chamber"


@pytest.mark.parametrize(
    ("wrong", "seen"),
    [
        ({"valve.vent_conductance": 3.9e-9}, {"line", "chamber"}),
        ({"valve.fill_conductance": 3.9e-9}, {"supply", "line", "chamber"}),
        ({"chamber.dead_volume": 6e-4}, {"chamber"}),
        ({"line.diameter": 3.2e-3}, {"line", "chamber"}),
        ({}, set()),
    ],
)
def test_what_is_wrong_shows_between_its_gauges(wrong: dict[str, float], seen: set[str]) -> None:
    prepared = prepare(recorded(RIG.with_parameters(wrong), "fit", 0), RIG, SETTINGS)
    for name, block in blocks_of(RIG, CHANNELS).items():
        left = residual(block, core_rig(RIG), prepared, [])
        ratio = float(np.std(left.value[left.rows])) / left.noise
        assert (ratio > 2.0) == (name in seen), (name, ratio)


def test_sensitivities_of_the_inlet_are_those_of_differences() -> None:
    prepared = prepare(recorded(RIG, "fit", 0), RIG, SETTINGS)
    block = blocks_of(RIG, CHANNELS)["line"]
    names = ("valve.vent_conductance", "line.diameter", "line.inlet_volume")
    slopes.are_those_of_differences(block, RIG, prepared, *names)


@pytest.mark.slow
def test_a_small_leak_behind_the_line_is_named() -> None:
    """From one gauge to the other it is some pascals: only what it adds up to tells it."""
    # half of that is as well a null voltage that is half a tolerance off
    true = RIG.with_effect("leak_muscle", {"conductance": 2e-11})
    found = diagnosed(RIG, partial(recorded, true))
    assert [e.id for e in found.effects] == ["leak_muscle"]
    assert found.effects[0].probability > 0.8
    assert found.effects[0].parameters["conductance"].value == pytest.approx(2e-11, rel=0.15)
    assert found.where["block"] == "chamber"


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch):
    """A plan with some channels, of one experiment and three effects."""
    (triangle,) = pool = library(RIG, SETTINGS, only=["slow_triangle"])
    monkeypatch.setattr(plan, "library", lambda *_: pool)
    names = ("leak_muscle", "valve_dead_zone", "valve_centre_leakage")
    monkeypatch.setattr(limits, "CATALOGUE", {name: EFFECTS[name] for name in names})
    return lambda *channels: pamrs.plan_diagnosis(
        RIG, channels, experiments=[triangle.name], settings=EXACT
    )


def test_a_plan_knows_the_gauge_in_front_of_the_line(planned) -> None:
    whole = planned(*CHANNELS)
    assert [block["name"] for block in whole.blocks] == ["supply", "line", "chamber"]
    assert whole.missing == []
    assert whole.noise["line_pressure"] == usual_noise()["muscle_pressure"]
    assert whole.limit("valve_dead_zone").verdict != "not seen"
    assert whole.limit("leak_muscle").block == "chamber"
    chamber = whole.blocks[-1]
    assert "through the line" in chamber["why"]
    assert "no pressure is measured between" not in whole.text()


def test_a_plan_says_what_that_gauge_would_add(planned) -> None:
    without = planned(*(name for name in CHANNELS if name != "line_pressure"))
    assert [block["name"] for block in without.blocks] == ["supply", "chamber"]
    (line,) = without.missing
    assert (line["name"], line["needs"]) == ("line", ["line_pressure"])
    (gauge,) = (a for a in without.additions if a.kind == "channel")
    assert gauge.name == "line_pressure"
    assert gauge.bits > 0.0
    assert "no pressure is measured between the valve's outlet and the muscle" in without.text()


def test_a_plan_takes_each_block_as_its_channels_drive_it(planned) -> None:
    """Behind a gauge at the line's inlet a chamber shows no valve, whatever other channels would
    make of it.
    """
    few = planned("line_pressure", "muscle_pressure")
    (chamber,) = few.blocks
    assert chamber["drives"] == ["line_pressure"]
    assert few.limit("valve_dead_zone").verdict == "not seen"
    assert few.limit("valve_dead_zone").left == 0.0
    # what is lost makes a pressure drop along the hose, and does not add up (decision 0003)
    lost = few.limit("leak_muscle").left
    assert 0.0 < lost < 0.5 * planned(*CHANNELS).limit("leak_muscle").left
