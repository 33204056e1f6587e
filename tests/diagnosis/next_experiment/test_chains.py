"""Rigs of several chains, regulators and valves that switch: what a person can record on them, and
what some channels could tell of them before anything is recorded.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.diagnosis import limits
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.next_experiment import _planning as plan
from pamrs.diagnosis.next_experiment import measurable, propose
from pamrs.diagnosis.next_experiment._asked import _Question, _telling
from pamrs.diagnosis.prepare import available_blocks
from pamrs.effects import EFFECTS
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments import (
    Experiment,
    can_shut,
    chains_of,
    commands_for,
    experiments_of,
    library,
    pressure_range,
    protocol_of,
)
from pamrs.experiments._chains import driving
from pamrs.experiments._maker import _shares, _turned, rows
from pamrs.experiments._protocols import _LEAST_HIGHEST
from pamrs.recordings import Recording, load_recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig, replay
from tests.diagnosis.asked import EXACT, SETTINGS
from tests.diagnosis.noisy import whole
from tests.simulation.test_spools import PAIR
from tests.tables import text_of

JOINT = pamrs.rigs.antagonistic_joint()
TWO = pamrs.rigs.named("two_joint_arm")
REGULATED = pamrs.rigs.named("regulated_joint")
PULSED = parse_rig(PAIR)
SIDES = ("flexor", "extensor")
REGULATORS = text_of(__file__, "two_regulators")


def only(rig: Rig, *names: str, **options) -> list[Experiment]:
    return library(rig, SETTINGS, sample_time=0.01, only=names, **options)


def to_four_bar(rig: Rig, more: str = "") -> Rig:
    """A rig whose file allows so much, and maybe more."""
    own = rig.to_toml_text().partition("\n[limits]")[0]
    limits = '\n[limits]\nmax_pressure = { value = 4, unit = "bar" }\n'
    return parse_rig(own + limits + more)


def asked_of(rig: Rig, kind: str = "") -> dict[str, str]:
    """The experiment that each block of a kind, or of any, is asked by."""
    blocks = available_blocks(rig, measurable(rig))
    asked = _Question(rig, [], blocks, [], Problem(blocks, [], core_rig(rig), SETTINGS))
    made = {b.name: asked.experiment(b)[2] for b in blocks if b.kind == kind or not kind}
    return {name: experiment.name for name, experiment in made.items() if experiment is not None}


def test_a_chain_is_a_chamber_with_its_valves_or_a_regulator_with_what_it_fills() -> None:
    flexor, extensor = chains_of(JOINT)
    assert (flexor.name, extensor.name) == SIDES
    assert flexor.commands == ("valve_command.flexor",)
    assert extensor.pressure == "muscle_pressure.extensor"
    assert flexor.moves == extensor.moves == ("joint_angle.elbow",)
    assert [c.moves for c in chains_of(TWO)] == [("joint_angle.elbow",), ("joint_angle.wrist",)]
    (only_one,) = chains_of(pamrs.rigs.named("throttled_supply"))
    assert (only_one.name, only_one.pressure) == ("", "muscle_pressure.muscle")
    (pulsed,) = chains_of(PULSED)
    assert pulsed.commands == ("valve_command.fill", "valve_command.vent")
    assert can_shut(PULSED, pulsed)
    (regulated,) = chains_of(REGULATED)
    assert regulated.commands == ("supply_command",)
    assert not can_shut(REGULATED, regulated)
    left, right = chains_of(parse_rig(REGULATORS))
    assert (left.commands, right.pressure) == (("supply_command.left",), "muscle_pressure.right")
    assert chains_of(pamrs.rigs.named("tube")) == []


def test_pressures_follow_references_of_their_own() -> None:
    time = 0.01 * np.arange(1501)
    wave = 0.6e5 * np.sin(2.0 * np.pi * 0.1 * time)
    wanted = {"flexor": 3e5 + wave, "extensor": 3e5 - wave}
    sent = commands_for(JOINT, wanted, sample_time=0.01)
    assert list(sent) == ["valve_command.flexor", "valve_command.extensor"]
    found = pamrs.simulate(JOINT, sample_time=0.01, **driving(sent))
    for side in SIDES:
        missed = found[f"muscle_pressure.{side}"] - wanted[side]
        # but for the jerks of the joint
        assert np.percentile(np.abs(missed[100:]), 90) < 0.15e5
    turned = found["joint_angle.elbow"][100:]
    assert turned.max() - turned.min() > np.radians(20)


@pytest.mark.parametrize("carrier", [True, False], ids=["duty", "on or off"])
def test_valves_that_switch_hold_a_pressure(carrier: bool) -> None:
    off = {f"valve.{name}.carrier_frequency": 0.0 for name in ("fill", "vent")}
    rig = PULSED if carrier else PULSED.with_parameters(off)
    levels = ([0.0, 1.0, 4.0, 5.0, 9.0], [2e5, 3e5, 3e5, 1e5, 1e5])
    reference = np.interp(0.01 * np.arange(901), *levels)
    sent = commands_for(rig, {"": reference}, sample_time=0.01)
    found = pamrs.simulate(rig, sample_time=0.01, **driving(sent))["muscle_pressure"]
    for begin, level in ((250, 3e5), (700, 1e5)):
        assert float(np.mean(found[begin : begin + 150])) == pytest.approx(level, abs=0.2e5)
    for values in sent.values():
        assert (values.min(), values.max()) <= (24.0, 24.0)
        assert values.min() >= 0.0
        if not carrier:
            assert set(np.unique(values)) <= {0.0, 24.0}


def test_two_valves_of_a_chamber_are_told_as_two() -> None:
    for experiment in only(PULSED, "sealed_hold", "step_and_shut"):
        assert "the valves" in experiment.text
        assert "the valve " not in experiment.text


@pytest.mark.parametrize("count", range(2, 15))
def test_every_chain_has_an_order_of_its_own(count: int) -> None:
    ordered = [row for row in rows("protocol") if row.get("build") == "orders"]
    assert len(ordered) == 3
    for row in ordered:
        shares = _shares(row, count)
        orders = {tuple(np.round(_turned(shares, k), 9)) for k in range(count)}
        assert len(orders) == count
        if row["name"] != "long_hold":  # its shares are not the same from both ends
            assert all(set(order) <= set(np.round(shares, 9)) for order in orders)


def test_what_cannot_be_shut_gets_no_holds() -> None:
    rig = parse_rig(re.sub(r'(without_current *=) "closed"', r'\1 "vent"', PULSED.to_toml_text()))
    (chain,) = chains_of(rig)
    assert not can_shut(rig, chain)
    names = {e.name for e in only(rig, "sealed_hold", "step_and_shut", "set_steps", "null_ramp")}
    assert names == {"set_steps"}
    assert {e.name for e in only(PULSED, "sealed_hold", "set_steps")} == {"sealed_hold"}


def test_one_chain_moves_and_the_others_are_held() -> None:
    held = {}
    for experiment in only(JOINT, "slow_triangle"):
        moved = experiment.excitation["moved"]
        (still,) = set(SIDES) - {moved}
        assert experiment.name == f"slow_triangle.{moved}"
        assert f"hold {still} at" in experiment.text
        held[still] = 1e5 * experiment.excitation["held_bar"][still]
        run = experiment.simulate(JOINT)
        later = {s: run[f"muscle_pressure.{s}"][300:] for s in SIDES}
        assert np.ptp(later[moved]) > 1.5e5
        assert np.abs(later[still] - held[still]).max() < 0.2e5
    assert set(held) == set(SIDES)


def test_all_chains_move_at_once_and_none_as_another() -> None:
    (waves,) = only(JOINT, "multisine")
    assert set(waves.commands) == {f"valve_command.{side}" for side in SIDES}
    one, other = waves.excitation["frequencies_hz"].values()
    assert not set(one) & set(other)
    run = waves.simulate(JOINT)
    pressures = np.array([run[f"muscle_pressure.{side}"][500:] for side in SIDES])
    assert abs(np.corrcoef(pressures)[0, 1]) < 0.5
    (holds,) = only(JOINT, "sealed_hold")
    up, down = holds.excitation["levels_bar"].values()
    assert up == sorted(up)
    assert down == sorted(down, reverse=True)
    angle = holds.simulate(JOINT)["joint_angle.elbow"]
    assert np.ptp(angle) > np.radians(40)  # against each other


@pytest.mark.parametrize(
    "rig", [pytest.param(JOINT, marks=pytest.mark.slow), TWO], ids=["one joint", "two joints"]
)
def test_experiments_keep_to_what_rig_and_recordings_allow(rig: Rig) -> None:
    limited = to_four_bar(rig, 'payloads = { value = [0.1, 0.9], unit = "kg" }\n')
    pool = library(limited, SETTINGS, sample_time=0.01)
    assert {e.kind for e in pool} >= {"multisine", "slow_triangle", "other_payload", "staircase"}
    valves = limited.tables("valve")
    for experiment in pool:
        run = experiment.simulate(limited)
        assert max(run[c.pressure].max() for c in chains_of(rig)) <= 4e5
        for name, table in valves.items():
            reach = np.abs(experiment.commands[f"valve_command.{name}"] - table["null_voltage"])
            assert reach.max() <= table["half_range"] + 1e-9
    (payload,) = (e for e in pool if e.kind == "other_payload")
    assert payload.needs == ""
    assert set(payload.changes.values()) <= {0.1, 0.9}


def recording(peaks: dict[str, float]) -> Recording:
    channels = {name: np.linspace(0.0, peak, 200) for name, peak in peaks.items()}
    return whole("r", "fit", 0.01, channels)


def test_each_chain_stays_inside_its_own_recorded_pressures() -> None:
    peaks = {"muscle_pressure.flexor": 4e5, "muscle_pressure.extensor": 3e5}
    (waves,) = experiments_of(JOINT, [recording(peaks)], SETTINGS, {"multisine"})
    run = waves.simulate(JOINT)
    for name, peak in peaks.items():
        assert run[name].max() <= 1.06 * peak
    # without a gauge it goes no higher than what has one
    alone = recording({"muscle_pressure.flexor": 3e5})
    (waves,) = experiments_of(JOINT, [alone], SETTINGS, {"multisine"})
    assert waves.simulate(JOINT)["muscle_pressure.extensor"].max() <= 1.06 * 3e5


@pytest.mark.parametrize("flexor", [4e5, 0.15e5], ids=["one filled", "none filled"])
def test_what_was_recorded_without_pressure_is_not_filled(flexor: float) -> None:
    peaks = {"muscle_pressure.flexor": flexor, "muscle_pressure.extensor": 0.19e5}
    # muscles that push: a slack pair swings, and squeezes the air in one of no pressure
    joint = JOINT.with_parameters({f"muscle.{side}.buckling_load": 1e9 for side in SIDES})
    (waves,) = experiments_of(joint, [recording(peaks)], SETTINGS, {"multisine"})
    run = waves.simulate(joint)
    late = run.time > 5.0  # the rig begins at 2 bar
    for name, peak in peaks.items():
        assert run[name][late].max() <= 1.06 * max(peak, _LEAST_HIGHEST)
    # what has no gauge is no higher than what has one, and what has one was not filled
    alone = recording({"muscle_pressure.flexor": flexor})
    (waves,) = experiments_of(JOINT, [alone], SETTINGS, {"multisine"})
    top = 1.06 * max(flexor, _LEAST_HIGHEST)
    assert waves.simulate(JOINT)["muscle_pressure.extensor"][late].max() <= top


@pytest.mark.parametrize(
    ("rig", "kind"),
    [(JOINT, "staircase"), (PULSED, "step_and_shut"), (parse_rig(REGULATORS), "multisine")],
    ids=["antagonists", "pulses", "regulators"],
)
def test_the_file_of_an_experiment_is_played_by_its_rig(
    rig: Rig, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (experiment,) = only(rig, kind)
    protocol = protocol_of(experiment)
    assert protocol is not None
    file = tmp_path / "next.csv"
    file.write_text(protocol.to_csv(), encoding="utf-8")
    heading = file.read_text(encoding="utf-8").splitlines()[0]
    commands = [c for chain in chains_of(rig) for c in chain.commands]
    assert [h.partition(" ")[0] for h in heading.split(",")] == ["time", *commands]
    played, run = replay(rig, load_recording(file)), experiment.simulate(rig)
    for chain in chains_of(rig):
        assert np.allclose(played[chain.pressure], run[chain.pressure], atol=20.0)
    model, out = rig.to_toml(tmp_path / "rig.toml"), tmp_path / "out.csv"
    words = ["simulate", str(model), "--input", str(file), "--output", str(out)]
    assert cli.main(words) == 0, capsys.readouterr().err
    assert len(out.read_text(encoding="utf-8").splitlines()) == experiment.rows + 1


def test_a_question_about_a_chamber_moves_its_own_chain() -> None:
    assert asked_of(JOINT) == {
        "supply": "sealed_hold",
        "chamber.flexor": "step_and_shut.flexor",
        "chamber.extensor": "step_and_shut.extensor",
        "arm.elbow": "nested_triangles.flexor",
    }


MIXED = parse_rig(
    JOINT.to_toml_text().replace(
        "[valve.flexor]",
        """[valve.flexor]
spool           = "switching"
with_current    = "fill"
without_current = "vent"
opening_delay   = { value = 0, unit = "ms" }
closing_delay   = { value = 0, unit = "ms" }
""",
    )
)
"""The same with a 3/2 valve, which cannot be shut, at the flexor."""


def test_a_question_never_moves_another_chain_than_the_block_s_own() -> None:
    assert [can_shut(MIXED, chain) for chain in chains_of(MIXED)] == [False, True]
    assert asked_of(MIXED, "chamber") == {
        "chamber.flexor": "set_steps.flexor",
        "chamber.extensor": "step_and_shut.extensor",
    }


def chamber(name: str) -> str:
    """A chamber of a rig file, as those behind the two regulators."""
    (_, table) = REGULATORS.split("[chamber.left]")
    return f"[chamber.{name}]{table.partition('[')[0]}"


HOLDS = {"hold_low", "hold_high", "hold_short", "hold_long"}
"""All that can be done with chambers that nothing drives."""
UNJOINED = 'schema = "pamrs.rig/1"\nname = "unjoined"\n[gas]\n' + chamber("left") + chamber("right")


def test_only_what_lines_join_blows_over() -> None:
    rig = parse_rig(UNJOINED)
    assert chains_of(rig) == []
    assert {e.name for e in library(rig, SETTINGS)} == HOLDS
    blocks = available_blocks(rig, measurable(rig))
    assert {_telling(block, rig).kind for block in blocks} == {"hold_low"}
    line = """
[line]
kind     = "tube"
from     = "chamber.left"
to       = "chamber.right"
length   = { value = 2, unit = "m", tol = 0.05 }
diameter = { value = 4, unit = "mm", tol = 0.05 }
"""
    rig = parse_rig(UNJOINED + chamber("third") + line)
    over = {e.name: e for e in library(rig, SETTINGS) if e.kind == "blow_over"}
    assert list(over) == ["blow_over.left", "blow_over.right"]
    assert over["blow_over.left"].duration < 30.0  # not as long as the third one stays apart
    assert asked_of(rig, "chamber") == {
        "chamber.left": "blow_over.left",
        "chamber.right": "blow_over.right",
        "chamber.third": "hold_low",
    }


def test_pressures_that_cannot_be_found_are_told_in_words(monkeypatch) -> None:
    sealed = pamrs.rigs.sealed_chamber()
    assert library(sealed, SETTINGS, highest={})[0].name == "hold_low"
    with pytest.raises(DiagnosisError, match="has the chains flexor, extensor; the pressures of a"):
        pressure_range(JOINT)
    words = r"highest has 'flexr', .* one of 'flexor', 'extensor'"
    with pytest.raises(ParameterError, match=words):
        library(JOINT, SETTINGS, highest={"flexr": 2e5})

    def fails(*args: object, **options: object) -> None:
        raise SimulationError("the gas leaves its range")

    with monkeypatch.context() as patched:
        patched.setattr("pamrs.experiments._chains.simulate", fails)
        for rig in (JOINT, pamrs.rigs.shoulder()):
            with pytest.raises(DiagnosisError, match="while its pressures rise.*leaves its range"):
                library(rig, SETTINGS)
    # an experiment that a model does not survive is left out, whoever simulates it
    with monkeypatch.context() as patched:
        patched.setattr("pamrs.experiments._protocols.simulate", fails)
        left = {e.kind for e in library(pamrs.rigs.named("tube"), SETTINGS)}
        assert left == HOLDS
    monkeypatch.setattr(Experiment, "simulate", fails)
    assert only(to_four_bar(JOINT), "multisine") == []


def test_a_noise_of_a_kind_is_that_of_all_its_channels() -> None:
    leak = JOINT.with_effect("leak_muscle", {"conductance": 2e-12}, at="flexor")
    hypotheses = [("none", JOINT, 0.5), ("leak_muscle", leak, 0.5)]
    pool = only(JOINT, "multisine")
    every = {f"muscle_pressure.{side}": 5e3 for side in SIDES}

    def bits(noise: dict[str, float] | None) -> float:
        return propose(JOINT, hypotheses, noise, experiments=pool).expected_information_bits

    assert bits({"muscle_pressure": 5e3}) == bits(every) < bits(None)


def planned(monkeypatch: pytest.MonkeyPatch, rig: Rig, kinds: tuple[str, ...], *effects: str):
    """Plans of a rig from some kinds of experiments and effects in the place of all."""
    pool = only(rig, *kinds)
    monkeypatch.setattr(plan, "library", lambda *_: pool)
    monkeypatch.setattr(limits, "CATALOGUE", {name: EFFECTS[name] for name in effects})
    return lambda *channels, **options: pamrs.plan_diagnosis(
        rig, channels or measurable(rig), experiments=kinds, settings=EXACT, **options
    )


def test_a_plan_tells_a_leak_at_one_muscle_from_one_at_the_other(monkeypatch) -> None:
    effects = ("leak_muscle", "valve_dead_zone")
    made = planned(monkeypatch, JOINT, ("sealed_hold", "step_and_shut"), *effects)
    found = made()
    assert set(found.seen) == {f"{effect}@{side}" for effect in effects for side in SIDES}
    for side in SIDES:
        assert found.limit(f"leak_muscle@{side}").block == f"chamber.{side}"
        assert found.separable(f"leak_muscle@{side}", f"valve_dead_zone@{side}")
    assert found.separable("leak_muscle@flexor", "leak_muscle@extensor")
    names = ["sealed_hold", *(f"step_and_shut.{side}" for side in SIDES)]
    assert [e["name"] for e in found.experiments] == names
    written = json.loads(json.dumps(found.to_dict()))["effects"]
    assert {(e["id"], e["at"]) for e in written} >= {("leak_muscle", s) for s in SIDES}
    assert "leak_muscle@extensor" in found.text()
    with pytest.raises(ParameterError, match="leak_muscle@flexor"):
        found.limit("leak_muscle")
    # without a gauge at the extensor nothing says what it loses
    fewer = made(*(c for c in measurable(JOINT) if c != "muscle_pressure.extensor"))
    assert [b["name"] for b in fewer.blocks] == ["chamber.flexor"]
    assert fewer.limit("leak_muscle@flexor").verdict != "not seen"
    assert fewer.limit("leak_muscle@extensor").verdict == "not seen"
    gauge = fewer.additions[0]
    assert gauge.name == "muscle_pressure.extensor"
    assert "leak_muscle@extensor" in gauge.seen
    assert {m["name"] for m in fewer.missing} == {"supply", "chamber.extensor", "arm.elbow"}


def test_names_without_a_block_stand_for_all_of_a_kind(monkeypatch) -> None:
    made = planned(monkeypatch, JOINT, ("step_and_shut.flexor",), "leak_muscle")
    found = made("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")
    assert found.channels == measurable(JOINT)
    noisy = made(noise={"muscle_pressure": 900.0, "muscle_pressure.flexor": 100.0})
    assert noisy.noise["muscle_pressure.flexor"] == 100.0
    assert noisy.noise["muscle_pressure.extensor"] == 900.0
    sharp, blunt = (noisy.limit(f"leak_muscle@{side}").left for side in SIDES)
    usual = {s: found.limit(f"leak_muscle@{s}").left for s in SIDES}
    assert sharp > usual["flexor"]
    assert blunt < usual["extensor"]
    with pytest.raises(ParameterError, match=r"muscle_pressure\.biceps.*muscle_pressure\.flexor"):
        made("muscle_pressure.biceps")
    with pytest.raises(ParameterError, match=r"noise has 'noise'.*muscle_pressure\.extensor"):
        made(noise={"noise": 1.0})


def test_effects_of_a_time_or_of_the_last_joint_are_planned_as_they_can_be(monkeypatch) -> None:
    effects = ("payload_change", "external_torque")
    found = planned(monkeypatch, JOINT, ("slow_triangle.flexor",), *effects)()
    assert set(found.seen) == set(effects)
    # no more than is there can be taken away
    payload = JOINT.parameter("arm.payload").value
    assert found.limit("payload_change").typical <= payload


def test_a_regulated_joint_is_planned(monkeypatch) -> None:
    effects = ("supply_regulator_deadband", "muscle_hysteresis", "leak_muscle")
    made = planned(monkeypatch, REGULATED, ("slow_triangle", "set_steps"), *effects)
    found = made()
    assert [b["name"] for b in found.blocks] == ["supply", "chamber", "arm"]
    assert set(found.seen) == {"supply_regulator_deadband", "muscle_hysteresis"}
    # the regulator makes good what a leak takes
    assert found.limit("leak_muscle").verdict == "not seen"
    assert "regulator" in found.text()
    lumped = made("supply_command", "muscle_pressure", "joint_angle")
    assert [b["covers"] for b in lumped.blocks][0] == "regulator, line and chamber"
    assert lumped.limit("supply_regulator_deadband").verdict != "not seen"
    blind = made("supply_command", "supply_pressure", "muscle_pressure")
    assert blind.limit("muscle_hysteresis").verdict == "not seen"
    assert blind.additions[0].name == "joint_angle"
    assert "muscle_hysteresis" in blind.additions[0].seen


def test_two_regulators_and_pulsed_valves_are_planned(monkeypatch) -> None:
    rig = parse_rig(REGULATORS)
    found = planned(monkeypatch, rig, ("set_steps",), "supply_regulator_deadband")()
    assert found.separable("supply_regulator_deadband@left", "supply_regulator_deadband@right")
    leak = planned(monkeypatch, PULSED, ("sealed_hold",), "leak_muscle", "valve_area")()
    assert leak.limit("leak_muscle").verdict != "not seen"
    assert leak.channels == measurable(PULSED)
