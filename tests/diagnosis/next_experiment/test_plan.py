"""What channels can tell, before any data."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.cli import main
from pamrs.diagnosis import limits
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.next_experiment import _planning as plan
from pamrs.diagnosis.next_experiment._differences import _UNSTATED_STD_SHARE, _free
from pamrs.effects import CATALOGUE, EFFECTS
from pamrs.errors import SimulationError
from pamrs.experiments import commands_for, library, pressure_range
from pamrs.findings import DETECTED, TOLD_APART
from pamrs.simulation import core_rig
from tests.diagnosis.asked import EXACT, SETTINGS

ALL = ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")


def test_levels_follow_from_the_rig() -> None:
    for name in ("shoulder", "elbow"):
        rig = pamrs.rigs.named(name)
        span = pressure_range(rig)
        assert 0.0 < span.low < span.high < rig.model["supply"]["initial_pressure"]
    assert pressure_range(pamrs.rigs.shoulder(), highest=2e5).high <= 2e5


@pytest.mark.parametrize("gas", [(287.05, 1.4), (2077.1, 1.667), (188.9, 1.3)])
def test_commands_are_found_for_the_gas_of_the_rig(gas: tuple[float, float]) -> None:
    constant, ratio = gas
    own = {"gas.gas_constant": constant, "gas.heat_capacity_ratio": ratio}
    rig = pamrs.rigs.shoulder().with_parameters(own)
    reference = np.interp(np.arange(401) * 0.01, [0.0, 1.0, 2.0, 4.0], [0.0, 1e5, 1e5, 3e5])
    (command,) = commands_for(rig, {"": reference}, sample_time=0.01).values()
    found = pamrs.simulate(rig, command, sample_time=0.01)["muscle_pressure"]
    assert np.abs(found - reference)[50:].max() < 0.1e5


def test_each_of_two_leaks_keeps_its_own_uncertainty() -> None:
    rig = pamrs.rigs.antagonistic_joint()
    problem = Problem([], [], core_rig(rig), SETTINGS)
    spread = {"conductance": 1e-11}
    one = rig.with_effect("leak_muscle", {"conductance": 5e-11}, at="flexor", std=spread)
    assert _free(problem, one)["leak_muscle.conductance"] == pytest.approx(1e-11)
    two = one.with_effect("leak_muscle", {"conductance": 6e-11}, at="extensor")
    free = _free(problem, two)
    assert free["leak_muscle.flexor.conductance"] == pytest.approx(1e-11)
    assert free["leak_muscle.extensor.conductance"] == pytest.approx(_UNSTATED_STD_SHARE * 6e-11)


def test_a_sealed_chamber_is_planned_quickly(capsys: pytest.CaptureFixture[str], tmp_path) -> None:
    out = tmp_path / "plan.json"
    words = ["--plan", "sealed_chamber", "--pressure-noise", "100 Pa", "--json", str(out)]
    assert main(["diagnose", *words]) == 0
    written = json.loads(out.read_text())
    assert written["schema"] == "pamrs.plan/1"
    assert written["noise"] == {"muscle_pressure": 100.0}
    verdicts = {e["id"]: e["verdict"] for e in written["effects"]}
    assert verdicts["leak_muscle"] != "not seen"
    assert "payload_swing" in written["not_asked"]  # there is no arm
    assert not verdicts.keys() & set(written["not_asked"])
    assert verdicts.keys() | set(written["not_asked"]) == set(CATALOGUE)
    page = capsys.readouterr().out
    assert "leak_muscle" in page
    assert "Not tested with this rig" in page


def test_a_plan_tells_how_far_it_is() -> None:
    heard = list[str]()
    pamrs.plan_diagnosis(pamrs.rigs.sealed_chamber(), ["muscle_pressure"], progress=heard.append)
    assert heard[:2] == ["hold_low", "hold_high"]
    assert [line.share for line in heard] == [0.0, 0.25, 0.5, 0.75]  # type: ignore[attr-defined]


def test_an_experiment_that_the_model_cannot_follow_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = pamrs.rigs.sealed_chamber()
    low, *_ = library(rig, SETTINGS, only=["hold_low"])

    def lost(*_: Any) -> None:
        raise SimulationError("the pressure leaves its range")

    high = replace(low, name="hold_high")
    monkeypatch.setattr(plan, "library", lambda *_: [low, high])
    simulate = type(low).simulate
    monkeypatch.setattr(
        type(low), "simulate", lambda own, of: (lost if own is high else simulate)(own, of)
    )
    found = pamrs.plan_diagnosis(rig, ["muscle_pressure"], progress=lambda _: None)
    assert [each["name"] for each in found.experiments] == ["hold_low"]


def test_unknown_names_are_errors_that_name_them() -> None:
    rig = pamrs.rigs.sealed_chamber()
    for channel, more, words in (
        ("pressure", {}, "'pressure'.*muscle_pressure"),
        ("joint_angle", {}, "'joint_angle'"),
        ("muscle_pressure", {"experiments": ["wiggle"]}, "'wiggle'.*hold_low"),
        ("muscle_pressure", {"noise": {"muscle_pressure": -1.0}}, "muscle_pressure = -1"),
    ):
        with pytest.raises(pamrs.ParameterError, match=words):
            pamrs.plan_diagnosis(rig, [channel], **more)


@pytest.mark.parametrize(
    "words",
    [
        ["diagnose"],
        ["diagnose", "case", "--plan", "shoulder"],
        ["diagnose", "case", "--channels", "time"],
    ],
)
def test_a_case_or_a_plan(words: list[str]) -> None:
    assert main(words) == 2


@pytest.fixture(scope="module")
def few():
    """Plans of the shoulder from one experiment in the place of all, computed once, so that the
    tests are quick.
    """
    pool = library(pamrs.rigs.shoulder(), SETTINGS, sample_time=0.01, only=["slow_triangle"])
    made = plan._products
    kept: dict[tuple[Any, ...], Any] = {}

    def once(blocks, rig, prepared, *rest):
        own = (*blocks, prepared.recording.name)
        if own not in kept:
            kept[own] = made(blocks, rig, prepared, *rest)
        return kept[own]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plan, "library", lambda *_: pool)
        patch.setattr(plan, "_products", once)
        yield lambda *channels: pamrs.plan_diagnosis(
            pamrs.rigs.shoulder(), channels, experiments=["slow_triangle"], settings=EXACT
        )


@pytest.fixture(scope="module")
def whole(few):
    return few(*ALL)


def test_all_channels_cut_three_blocks(whole: pamrs.Plan) -> None:
    assert [b["name"] for b in whole.blocks] == ["supply", "chamber", "arm"]
    assert whole.missing == []
    arm = whole.blocks[-1]
    assert arm["drives"] == ["muscle_pressure"]
    assert "force" in arm["why"]


def test_effects_show_in_their_own_block(whole: pamrs.Plan) -> None:
    assert whole.limit("muscle_hysteresis").block == "arm"
    assert whole.limit("valve_dead_zone").block in ("supply", "chamber")
    assert whole.limit("valve_dead_zone").verdict == "named"
    own = whole.limit("muscle_hysteresis")
    assert own.seen_from == pytest.approx(own.typical * DETECTED / own.seen)
    assert own.named_from == pytest.approx(own.typical * TOLD_APART / own.distance)
    assert own.named_from >= TOLD_APART / DETECTED * own.seen_from


def test_without_the_angle_the_arm_is_not_isolable(few) -> None:
    found = few(*ALL[:3])
    assert "arm" not in [b["name"] for b in found.blocks]
    lost = {b["name"]: b["needs"] for b in found.missing}
    assert lost["arm"] == ["joint_angle"]
    assert found.limit("muscle_hysteresis").verdict == "not seen"
    assert found.additions[0].name == "joint_angle"
    assert "muscle_hysteresis" in found.additions[0].seen
    assert "not arm (muscle, joint and arm): without joint_angle" in found.text()


def test_holds_on_both_sides_separate_a_leak_from_centre_leakage(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = pamrs.rigs.shoulder()
    (both,) = pool = library(rig, SETTINGS, sample_time=0.01, only=["holds_both_sides"])
    monkeypatch.setattr(plan, "library", lambda *_: pool)
    leaks = {name: EFFECTS[name] for name in ("leak_muscle", "valve_centre_leakage")}
    monkeypatch.setattr(limits, "CATALOGUE", leaks)
    quiet = {"muscle_pressure": 20.0, "supply_pressure": 20.0, "joint_angle": 1e-4}
    found = pamrs.plan_diagnosis(
        rig, ALL, experiments=["holds_both_sides"], noise=quiet, settings=EXACT
    )
    assert found.separable("leak_muscle", "valve_centre_leakage")
    centre = rig.with_effect("valve_centre_leakage", {"conductance": 3e-10})
    leaking, still = both.simulate(centre), both.simulate(rig)
    change = leaking["muscle_pressure"] - still["muscle_pressure"]
    start, stop = round(2.5 / both.sample_time), round(17.5 / both.sample_time)
    assert change[stop] > change[start]  # it fills below the balance
    assert change[-1] < change[-1 - (stop - start)]  # and empties above it
