"""What a diagnosis makes of its groups: cases that were wrong once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.assemble import _ambiguity, _chosen
from pamrs.diagnosis.protocols import library
from pamrs.errors import DiagnosisError
from pamrs.recording import Recording

NAMES = ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")


def recorded(rig: pamrs.Rig, name: str, role: str, *, leave_out: str = "", seed: int = 1) -> Recording:
    """Ten seconds of a shoulder at 200 Hz, with the noise of transducers."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.005)
    command = 5.0 + 0.4 * np.sin(2 * np.pi * 0.2 * time + seed) + 0.2 * np.sin(2 * np.pi * 0.7 * time)
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    noise = {"valve_command": 0.0, "supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
    values = {"valve_command": command, **{n: run[n] for n in NAMES[1:]}}
    channels = {n: values[n] + noise[n] * rng.standard_normal(time.size) for n in NAMES if n != leave_out}
    mask = {n: np.ones(time.size, dtype=bool) for n in channels}
    return Recording(name, role, time, 0.005, channels, mask, [], dict.fromkeys(channels, ""))


def test_an_effect_of_two_blocks_is_named_once() -> None:
    rig = pamrs.rigs.shoulder()
    late = rig.with_effect("pressure_lag", {"time_constant": 0.02})
    records = [recorded(late, f"r{k}", role, seed=k) for k, role in enumerate(("fit", "fit", "held_out"))]
    found = pamrs.diagnose(pamrs.Case("late", rig, records, Path()))
    assert found.verdict == "effects"
    assert [e["id"] for e in found.effects if e["probability"] > 0.5] == ["pressure_lag"]
    assert found.text.count("pressure_lag") >= 1
    assert "pressure_lag) and" not in found.text
    assert "probability 0.00" not in found.text
    assert sum(found.probabilities.values()) == pytest.approx(1.0, abs=1e-6)


def test_recordings_may_have_other_channels() -> None:
    rig = pamrs.rigs.shoulder()
    heavy = rig.with_effect("muscle_creep", {"stiffness": 800.0, "time_constant": 2.0})
    records = [recorded(heavy, "all", "fit"), recorded(heavy, "some", "fit", leave_out="supply_pressure", seed=2)]
    found = pamrs.diagnose(pamrs.Case("unequal", rig, records, Path()))
    assert found.where["block"] == "arm"


def test_a_rig_without_tolerances_can_be_diagnosed() -> None:
    rig = pamrs.rigs.sealed_chamber()
    bare = pamrs.rig.parse_rig(
        "\n".join(line.split(", tol")[0] + " }" if ", tol" in line else line for line in rig.to_toml_text().splitlines())
    )
    assert all(p.tol == 0.0 for p in bare.parameters.values() if p.known)
    run = pamrs.simulate(
        bare.with_effect("leak_muscle", {"conductance": 3e-11}), duration=60.0, sample_time=0.1, initial={"muscle_pressure": 7e5}
    )
    pressure = run["muscle_pressure"] + np.random.default_rng(3).normal(0.0, 150.0, run.time.size)
    mask = {"muscle_pressure": np.ones(run.time.size, dtype=bool)}
    hold = Recording("hold", "fit", run.time, 0.1, {"muscle_pressure": pressure}, mask, [], {"muscle_pressure": "Pa"})
    found = pamrs.diagnose(pamrs.Case("bare", bare, [hold], Path()))
    assert found.effects[0]["id"] == "leak_muscle"


@pytest.mark.parametrize("name", ["antagonistic_joint", "two_joint_arm", "recruitment", "regulated_joint"])
def test_experiments_are_refused_for_rigs_that_nobody_could_command(name: str) -> None:
    with pytest.raises(DiagnosisError, match=r"named blocks|no valve"):
        library(pamrs.rigs.named(name))


def test_one_set_is_no_ambiguity() -> None:
    assert _ambiguity({"leak_muscle": 0.89, "unlisted": 0.04, "none": 0.04, "parameters": 0.03}) == []
    assert _ambiguity({"leak_muscle": 0.6, "heat_transfer": 0.4}) == [["leak_muscle"], ["heat_transfer"]]
    assert _chosen([], frozenset({"leak_muscle"})) == []
