"""The next experiment: what separates, how much it tells, how it is shown."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.next_experiment import propose
from pamrs.diagnosis.next_experiment._choice import entropy, information
from pamrs.diagnosis.next_experiment._differences import taken, usual_noise
from pamrs.experiments import library
from tests.diagnosis import synthetic
from tests.diagnosis.kept import kept

SETTINGS = DiagnosisSettings()
NOISE = usual_noise()


@pytest.fixture(scope="module")
def pool():
    """The experiments of the shoulder."""
    names = ("null_ramp", "nested_triangles", "slow_triangle")
    found = library(pamrs.rigs.shoulder(), SETTINGS, sample_time=0.01, only=names)
    return {experiment.name: experiment for experiment in found}


@pytest.fixture(scope="module")
def speeds(pool):
    """Creep or hysteresis, at two speeds and with holds."""
    rig = pamrs.rigs.shoulder()
    friction = {"friction_constant": 0.5, "friction_pressure": 5e-6}
    creep = {"stiffness": 60.0, "time_constant": 3.0}
    hypotheses = [
        ("muscle_hysteresis", rig.with_effect("muscle_hysteresis", friction), 0.5),
        ("muscle_creep", rig.with_effect("muscle_creep", creep), 0.4),
    ]
    return propose(rig, hypotheses, experiments=[pool["nested_triangles"], pool["slow_triangle"]])


def test_information_lies_between_nothing_and_the_uncertainty() -> None:
    p = [0.5, 0.3, 0.2]
    rng = np.random.default_rng(1)
    assert information(p, np.zeros((3, 3))) == pytest.approx(0.0, abs=1e-12)
    far = 1e4 * (1.0 - np.eye(3))
    assert information(p, far) == pytest.approx(entropy(p), rel=1e-9)
    last = 0.0
    distance = rng.uniform(0.5, 1.0, (3, 3)) * (1.0 - np.eye(3))
    for size in (0.1, 1.0, 10.0, 100.0):
        now = information(p, size * distance)
        assert last < now <= entropy(p)
        last = now
    assert information([1.0, 0.0], np.array([[0.0, 9e9], [9e9, 0.0]])) == 0.0
    assert entropy([2.0, 2.0]) == pytest.approx(1.0)


def test_speed_separates_creep_from_hysteresis(speeds) -> None:
    uncertainty = entropy([0.5, 0.4])
    assert 0.3 * uncertainty < speeds["expected_information_bits"] <= uncertainty
    ranking = {entry["name"]: entry["bits"] for entry in speeds["ranking"]}
    assert ranking["nested_triangles"] >= ranking["slow_triangle"] - 0.02
    assert all(0.0 <= bits <= uncertainty for bits in ranking.values())
    assert speeds["excitation"]["kind"] == speeds["ranking"][0]["name"]
    assert "creep" in speeds["text"]
    assert "bar" in speeds["text"]


def test_curves_are_what_each_hypothesis_predicts(speeds) -> None:
    curves = speeds["curves"]
    assert curves["channel"] == "joint_angle"
    assert curves["leading"] == "muscle_hysteresis"
    assert set(curves["values"]) == {"muscle_hysteresis", "muscle_creep"}
    assert all(v.shape == curves["time"].shape for v in curves["values"].values())
    left = curves["left"]["muscle_creep"]
    assert left.shape == curves["bin_time"].shape
    assert np.abs(left).max() > 2.0 * curves["noise"]


def test_the_report_draws_them_and_json_does_not_hold_them(speeds) -> None:
    pytest.importorskip("matplotlib")
    pytest.importorskip("jinja2")
    found = synthetic.diagnosis(next_experiment=speeds)
    from pamrs.report import render_html

    page = render_html(found)
    assert "cannot explain" in page
    assert "experiments compared" in page
    assert "the other way round" in page
    written = kept(found)
    keys = {"text", "instruction", "excitation", "protocol", "pairs"}
    keys.add("expected_information_bits")
    assert set(written["next_experiment"]) == keys


def test_an_effect_is_known_from_itself(pool) -> None:
    rig = pamrs.rigs.shoulder()
    same = rig.with_effect("leak_muscle", {"conductance": 2e-11})
    found = propose(rig, [("a", same, 0.5), ("b", same, 0.5)], experiments=[pool["null_ramp"]])
    assert found["expected_information_bits"] < 0.05
    assert "another sensor" in found["text"]


def test_recordings_say_the_channels_the_clock_and_the_pressure() -> None:
    rig = pamrs.rigs.sealed_chamber()
    leak = rig.with_effect("leak_muscle", {"conductance": 1e-13})
    run = pamrs.simulate(rig, duration=20.0, sample_time=0.2, initial={"muscle_pressure": 4e5})
    prepared = taken(run, rig, "hold", NOISE, SETTINGS)
    rivals = [("none", rig, 0.6), ("leak_muscle", leak, 0.4)]
    found = propose(rig, rivals, {"muscle_pressure": 50.0}, [prepared])
    assert max(found["excitation"]["levels_bar"]) <= 4.21
    assert found["curves"]["time"][1] == pytest.approx(0.2)
    none, leaking = (found["curves"]["values"][name] for name in ("none", "leak_muscle"))
    assert math.isclose(none[0], leaking[0])


def test_a_missing_sensor_is_proposed(pool) -> None:
    rig = pamrs.rigs.shoulder()
    hypotheses = [
        ("muscle_hysteresis", rig.with_effect("muscle_hysteresis"), 0.5),
        ("leak_muscle", rig.with_effect("leak_muscle", {"conductance": 1e-10}), 0.5),
    ]
    some = ["valve_command", "supply_pressure", "muscle_pressure"]
    found = propose(rig, hypotheses, channels=tuple(some), experiments=[pool["null_ramp"]])
    assert found["excitation"]["sensor"] == "joint_angle"
    assert "one more channel: joint angle" in found["text"]


def test_one_hypothesis_needs_no_experiment_and_impossible_arguments_are_named() -> None:
    rig = pamrs.rigs.sealed_chamber()
    leak = rig.with_effect("leak_muscle")
    found = propose(rig, [("none", rig, 0.999), ("leak_muscle", leak, 0.0)])
    assert found["expected_information_bits"] == 0.0
    assert found["curves"] is found.curves is None
    with pytest.raises(pamrs.ParameterError, match="hypotheses is empty"):
        propose(rig, [])
    with pytest.raises(pamrs.ParameterError, match="'none' is 1.5"):
        propose(rig, [("none", rig, 1.5)])
    with pytest.raises(pamrs.ParameterError, match="'angle'.*muscle_pressure"):
        propose(rig, [("none", rig, 0.5), ("leak_muscle", leak, 0.5)], channels=("angle",))
