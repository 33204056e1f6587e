"""The next experiment: about the block of the mismatch, inside what the stand allows, for each open
pair, as commands that a rig plays; and as telling as it says.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.evidence import BlockGroup, Judged
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.next_experiment import measurable, propose
from pamrs.diagnosis.next_experiment._asked import _measured, _pair, _Question, _telling
from pamrs.diagnosis.next_experiment._choice import entropy, outcome_of
from pamrs.diagnosis.next_experiment._differences import (
    linear,
    misfit,
    noise_of,
    problem_of,
    taken,
    usual_noise,
)
from pamrs.diagnosis.prepare import available_blocks
from pamrs.effects import Hypothesis, Term
from pamrs.errors import DiagnosisError, RigError
from pamrs.experiments import Experiment, library
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis import again
from tests.diagnosis.asked import SETTINGS, diagnosed
from tests.diagnosis.likelihoods import made_up
from tests.diagnosis.noisy import driven

NOISE = usual_noise()
SHOULDER = pamrs.rigs.shoulder()
ANTAGONISTS = pamrs.rigs.antagonistic_joint()
REGULATED = pamrs.rigs.named("regulated_joint")
SENSORS = ("supply_pressure", "muscle_pressure", "joint_angle")
OPEN = DiagnosisSettings(settled=0.99999, in_set=5e-4, simulated_from=5e-4)
"""Settings by which hardly anything is settled."""


def limited(rig: pamrs.Rig, text: str, folder: Path) -> pamrs.Rig:
    """A rig whose file says what the stand allows."""
    file = folder / "limited.toml"
    unlimited = rig.to_toml_text().partition("\n[limits]")[0]
    file.write_text(f"{unlimited}\n[limits]\n{text}\n", encoding="utf-8")
    return pamrs.load_rig(file)


PAIRS = {
    "friction or creep": (
        SHOULDER,
        ("muscle_hysteresis", {"friction_constant": 0.5, "friction_pressure": 5e-6}),
        ("muscle_creep", {"stiffness": 60.0, "time_constant": 3.0}),
        ("staircase", "nested_triangles"),
    ),
    "leaks": (
        SHOULDER,
        ("leak_muscle", {"conductance": 5e-11}),
        ("valve_centre_leakage", {"conductance": 5e-12}),
        ("step_and_shut", "multisine"),
    ),
    "leak of one muscle or the other": (
        ANTAGONISTS,
        ("leak_muscle", {"conductance": 2e-12}, "flexor"),
        ("leak_muscle", {"conductance": 2e-12}, "extensor"),
        ("step_and_shut.extensor", "multisine"),
    ),
    "friction or creep on a frame": (
        pamrs.rigs.bench(),
        ("muscle_hysteresis", {"friction_constant": 2.0, "friction_pressure": 0.0}),
        ("muscle_creep", {"stiffness": 300.0, "time_constant": 3.0}),
        ("slow_triangle", "nested_strokes"),
    ),
    "regulator or sensor": (
        REGULATED,
        ("supply_regulator_deadband", {"dead_band": 2e3}),
        ("pressure_lag", {}),
        ("fast_triangle", "set_steps"),
    ),
}


@pytest.mark.parametrize(
    "pair",
    [
        # the first pair asks the same of a joint
        pytest.param(pair, marks=pytest.mark.slow) if pair.endswith("frame") else pair
        for pair in PAIRS
    ],
)
def test_rivals_are_told_apart_as_predicted(pair: str) -> None:
    rig, *both, names = PAIRS[pair]
    rivals, labels = [], []
    for effect, values, *at in both:
        rivals.append(rig.with_effect(effect, values, at=at[0] if at else ""))
        labels.append(str(Term(effect, *at)))
    hypotheses = [(label, rival, 0.5) for label, rival in zip(labels, rivals, strict=True)]
    pool = library(rig, SETTINGS, sample_time=0.01, highest=4e5, only=names)
    noise, channels = noise_of(rig), measurable(rig)
    proposed = propose(rig, hypotheses, noise, channels=channels, experiments=pool)
    chosen = next(e for e in pool if e.name == proposed.excitation["kind"])
    outcome = outcome_of(chosen, hypotheses, noise, channels, SETTINGS)
    bits = []
    for i, j in ((0, 1), (1, 0)):
        gained, missed = [], []
        key, predicted = outcome.left[i, j].largest
        for seed in range(4):
            # the rig of hypothesis i plays the experiment, with the noise of its sensors
            run = chosen.simulate(rivals[i])
            rng = np.random.default_rng([seed, i])
            played = taken(run, rig, chosen.name, noise, SETTINGS, rng=rng)
            problem = problem_of(rig, [played], channels, SETTINGS)
            problem = replace(problem, blocks=outcome.problem.blocks)
            right, wrong = (
                misfit(problem, linear(problem, rivals[k]), outcome.errors) for k in (i, j)
            )
            gained.append(wrong.total - right.total)
            missed.append(wrong.rms[key] ** 2 - right.rms[key] ** 2)
            bits.append(1.0 - math.log2(1.0 + math.exp(-0.5 * gained[-1])))
        assert min(gained) > 0.0
        assert float(np.median(gained)) == pytest.approx(outcome.distance[i, j], rel=0.15)
        assert math.sqrt(float(np.median(missed))) == pytest.approx(predicted, rel=0.15)
    # the bound that is stated is one
    assert float(np.mean(bits)) > outcome.bits - 0.02
    assert outcome.bits == pytest.approx(proposed.expected_information_bits, abs=1e-3)
    # a recording that shows as much leaves nothing to be expected of the same again
    same = propose(rig, hypotheses, noise, [played], channels=channels, experiments=[chosen])
    assert same.expected_information_bits == 0.0
    assert "better than the recordings that there are" in same.text
    assert replace(outcome, shown=outcome.distance / 3.0).bits == outcome.bits


def test_a_regulator_is_set_no_higher_than_is_known_to_be_allowed(tmp_path) -> None:
    text = REGULATED.to_toml_text().partition("[limits]")[0]
    unlimited = parse_rig(text)
    with pytest.raises(DiagnosisError, match="max_pressure"):
        library(unlimited, SETTINGS)
    with pytest.raises(DiagnosisError, match="max_pressure"):
        pamrs.plan_diagnosis(unlimited, ["muscle_pressure"])
    rig = limited(unlimited, 'max_pressure = { value = 2.5, unit = "bar" }', tmp_path)
    pool = library(rig, SETTINGS, sample_time=0.01)
    assert {"set_steps", "fine_staircase", "nested_triangles"} <= {e.name for e in pool}
    assert not {"sealed_hold", "null_ramp", "step_and_shut"} & {e.name for e in pool}
    for experiment in pool:
        assert experiment.channel == "supply_command"
        assert experiment.command is not None
        assert experiment.command.min() >= 0.0
        assert experiment.command.max() <= 2.5e5


@pytest.mark.parametrize("rig", [SHOULDER, pamrs.rigs.elbow()], ids=["shoulder", "elbow"])
def test_commands_that_overshoot_are_planned_lower(rig: pamrs.Rig) -> None:
    """Stepped with the valve far open, the shoulder's chamber passed what was recorded by a fifth,
    and the elbow's by a third as its arm fell.
    """
    pool = {e.name: e for e in library(rig, SETTINGS, sample_time=0.01, highest=3e5)}
    assert {"step_and_shut", "free_decay"} <= pool.keys()
    reached = {e.simulate(rig)["muscle_pressure"].max() for e in pool.values()}
    assert 2.9e5 < max(reached) <= 1.05 * 3e5


def payloads(rig: pamrs.Rig) -> list[Experiment]:
    return library(rig, SETTINGS, sample_time=0.01, only={"other_payload", "slow_triangle"})


def test_another_payload_is_proposed_where_there_is_one(tmp_path) -> None:
    now = SHOULDER.parameter("arm.payload").value
    _, unlisted = payloads(SHOULDER)
    assert unlisted.needs
    listed = limited(SHOULDER, f'payloads = {{ value = [{now}, 2.0, 7.5], unit = "kg" }}', tmp_path)
    _, other = payloads(listed)
    assert (other.needs, other.changes) == ("", {"arm.payload": 2.0})
    assert pamrs.load_rig(listed.to_toml(tmp_path / "again.toml")).limits == listed.limits
    only = limited(SHOULDER, f'payloads = {{ value = [{now}], unit = "kg" }}', tmp_path)
    assert [e.name for e in payloads(only)] == ["slow_triangle"]
    # one that nobody is known to have comes last, whatever it tells
    payload = SHOULDER.with_parameters({"arm.payload": 1.1 * now})
    moment = SHOULDER.parameter("arm.first_moment").value + 0.1 * now * 0.9
    hypotheses = [
        ("arm.payload", payload, 0.5),
        ("arm.first_moment", SHOULDER.with_parameters({"arm.first_moment": moment}), 0.5),
    ]
    found = propose(SHOULDER, hypotheses, experiments=payloads(SHOULDER))
    assert found.ranking[-1].name == "other_payload"
    assert found.excitation["kind"] == "slow_triangle"


@pytest.mark.parametrize("text", ["max_pressure = 3.0", "speed = 1.0", 'payloads = "two"'])
def test_wrong_limits_are_named(text: str, tmp_path) -> None:
    with pytest.raises(RigError, match=r"limits\."):
        limited(SHOULDER, text, tmp_path)


STEADY = REGULATED.with_parameters({"supply.droop": 0.0})


def regulated(role: str, seed: int) -> Recording:
    """A joint whose recorded command is not what its regulator got: nothing explains that."""
    time = 0.005 * np.arange(800)
    command = 2e5 + 0.8e5 * np.sin(2.0 * np.pi * 0.2 * (1.0 + 0.4 * seed) * time + seed)
    command += 0.5e5 * np.sign(np.sin(2.0 * np.pi * 0.15 * time))
    given = {"supply_command": command}
    one = driven(STEADY, f"r{seed}", role, 0.005, given, again.NOISE, [7, seed])
    read = {"supply_command": command * (1.0 + 0.08 * np.sin(2.0 * np.pi * 0.8 * time))}
    return replace(one, channels=one.channels | read)


def test_what_a_regulator_lacks_is_asked_of_the_regulator() -> None:
    found = diagnosed(STEADY, regulated)
    assert found.where.block == "supply"
    asked = found.next_experiment
    assert asked.excitation["block"] == "supply"
    assert "set pressure" in asked.text
    assert "hold" not in asked.excitation["kind"]
    assert "leak" not in asked.text
    assert asked.protocol is not None
    highest = max(regulated("fit", k).channels["supply_command"].max() for k in range(3))
    assert asked.protocol.commands["supply_command"].max() <= 1.05 * highest


@pytest.mark.parametrize(
    ("rig", "channels", "kinds"),
    [
        ("shoulder", ("valve_command", *SENSORS), ["sealed_hold", "step_and_shut", "nested"]),
        ("regulated_joint", ("supply_command", *SENSORS), ["set_steps", "set_steps", "nested"]),
        ("sealed_chamber", ("muscle_pressure",), ["hold_low"]),
        ("tube", ("muscle_pressure.left", "muscle_pressure.right"), ["blow_over", "blow_over"]),
    ],
)
def test_every_block_has_its_own_experiment(
    rig: str, channels: tuple[str, ...], kinds: list[str]
) -> None:
    model = pamrs.rigs.named(rig)
    blocks = available_blocks(model, channels)
    told = [_telling(block, model).kind for block in blocks]
    assert all(name.startswith(kind) for name, kind in zip(told, kinds, strict=True))


@pytest.mark.parametrize(
    "wrong", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["effect", "parameter"]
)
def test_every_open_pair_has_an_experiment(wrong: bool) -> None:
    volume = SHOULDER.parameter("chamber.dead_volume")
    truth = (
        SHOULDER.with_parameters({volume.name: volume.value + 6.0 * volume.tol})
        if wrong
        else SHOULDER.with_effect("leak_muscle", {"conductance": 5e-11})
    )
    given = again.case(truth, SHOULDER)
    found = pamrs.diagnose(replace(given, recordings=given.recordings[:2]), settings=OPEN)
    names = {n for s in found.ambiguity for n in s}
    assert {"unlisted", volume.name if wrong else "leak_muscle"} <= names
    asked = found.next_experiment
    between = {frozenset(pair.between) for pair in asked.pairs}
    labels = {"+".join(n for n in s if n != "unlisted") or "unlisted" for s in found.ambiguity}
    labels |= {"unlisted"}
    assert between == {frozenset(two) for two in itertools.combinations(labels, 2)}
    assert all(pair.text for pair in asked.pairs)
    first = next(p for p in asked.pairs if "unlisted" in p.between)
    assert "has to predict" in first.text
    assert ("Measure the chamber dead volume" in first.text) is wrong
    if not wrong:
        assert first.noises is not None
        assert first.noises > 1.0
    assert "Next experiment" in found.summary()
    assert found.to_dict()["next_experiment"]["pairs"]


def test_an_effect_and_parameters_that_moved_are_simulated_as_a_pair() -> None:
    leak = SHOULDER.with_effect("leak_muscle", {"conductance": 3e-11})
    pool = library(SHOULDER, SETTINGS, sample_time=0.01, highest=4e5, only={"step_and_shut"})
    hypotheses = [("leak_muscle", leak, 0.6), ("parameters", SHOULDER, 0.4)]
    found = propose(SHOULDER, hypotheses, NOISE, experiments=pool)
    (pair,) = found.pairs
    assert pair.between == ["leak_muscle", "parameters"]
    assert pair.noises is not None
    # a leak of no size is the other model: what tells is what that one misses
    assert pair.noises > 1.0
    assert "parameters in tolerance" in pair.text
    assert 0.0 < found.expected_information_bits < entropy([0.6, 0.4])


@pytest.mark.parametrize("driven", [True, False], ids=["valves", "none"])
def test_a_pair_that_nothing_simulates_is_told_in_words(driven: bool) -> None:
    rig = pamrs.rigs.antagonistic_joint()
    if not driven:  # pressures that are given: no experiment of the library drives them
        cut = re.sub(r"(?m)^\[(supply|valve).*\n(?:(?!\[).*\n)*", "", rig.to_toml_text())
        rig = parse_rig(cut)
    blocks = available_blocks(rig, measurable(rig))
    start = made_up(rig, "", {})
    sets = [Hypothesis.parse("muscle_creep"), Hypothesis.parse("muscle_hysteresis")]
    arm = blocks[-1]
    group = BlockGroup([arm], {}, {}, [start], {}, arm, {}, [arm])
    judged = [Judged(group, "effects", {}, sets, start)]
    problem = Problem(blocks, [], core_rig(rig), SETTINGS)
    asked = _Question(rig, judged, blocks, [], problem)
    told = _pair(asked, *sets, [])
    assert told.between == ["muscle_creep", "muscle_hysteresis"]
    assert ("nested triangles" if driven else "nested loops") in told.text
    assert "arm of elbow" in told.text
    # of two chains that move the joint the first one is moved
    assert (told.experiment, told.noises) == ("nested_triangles.flexor" if driven else "", None)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (["sensors.pressure_zero"], "pressure zero of the sensors (read the gauge with the air"),
        (["arm.payload", "chamber.dead_volume"], "arm payload (weigh it) or the chamber dead vol"),
        (["muscle.rest_length"], "muscle rest length (with a ruler or a caliper)"),
        (["valve.null_voltage"], "valve null voltage by itself: these recordings cannot tell"),
    ],
)
def test_each_value_is_measured_in_the_way_of_its_kind(values: list[str], told: str) -> None:
    assert told in _measured([Term.parse(f"{name}") for name in values], SHOULDER)


def test_no_value_is_measured_by_what_measures_another_kind() -> None:
    """Nobody weighs a zero."""
    for name, known in SHOULDER.parameters.items():
        said = _measured([Term.parse(name)], SHOULDER)
        assert ("weigh" in said) == (known.unit == "kg"), name
        assert ("ruler" in said) == (known.unit == "m"), name
