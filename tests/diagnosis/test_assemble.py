"""What a diagnosis makes of its groups: cases that were wrong once."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.evidence import BlockGroup, Candidate, judge
from pamrs.diagnosis.explain import _words as words
from pamrs.diagnosis.fit import Problem, fit, residuals
from pamrs.diagnosis.model._conclude import _merged, _settled
from pamrs.diagnosis.prepare import available_blocks, prepare
from pamrs.diagnosis.screen import tangent_of
from pamrs.effects import UNDECIDED
from pamrs.errors import DiagnosisError
from pamrs.experiments import library
from pamrs.findings import ChannelError
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis.healthy import healthy_case
from tests.diagnosis.noisy import whole
from tests.diagnosis.terms import terms

SETTINGS = DiagnosisSettings()

NAMES = ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")


def recorded(
    rig: pamrs.Rig, name: str, role: str, *, leave_out: str = "", seed: int = 1
) -> Recording:
    """Six seconds of a shoulder at 200 Hz, with the noise of transducers."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 6.0, 0.005)
    command = (
        5.0 + 0.4 * np.sin(2 * np.pi * 0.2 * time + seed) + 0.2 * np.sin(2 * np.pi * 0.7 * time)
    )
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    noise = {
        "valve_command": 0.0,
        "supply_pressure": 400.0,
        "muscle_pressure": 400.0,
        "joint_angle": 3e-4,
    }
    values = {"valve_command": command, **{n: run[n] for n in NAMES[1:]}}
    channels = {
        n: values[n] + noise[n] * rng.standard_normal(time.size) for n in NAMES if n != leave_out
    }
    return whole(name, role, 0.005, channels)


@pytest.mark.slow
def test_an_effect_of_two_blocks_is_named_once() -> None:
    rig = pamrs.rigs.shoulder()
    late = rig.with_effect("pressure_lag", {"time_constant": 0.02})
    records = [
        recorded(late, f"r{k}", role, seed=k) for k, role in enumerate(("fit", "fit", "held_out"))
    ]
    found = pamrs.diagnose(pamrs.Case("late", rig, records, Path()))
    assert found.verdict == "effects"
    assert [e["id"] for e in found.effects if e["probability"] > 0.5] == ["pressure_lag"]
    assert found.text.count("pressure_lag") >= 1
    assert "pressure_lag) and" not in found.text
    assert found.headline.count("pressure lag") == 1
    own = found.effects[0].parameters
    told = [t for t in found.budget if t.id == "pressure_lag"]
    assert told  # with one value each, whichever groups of blocks see it
    assert all(t.parameters[name].value == value.value for t in told for name, value in own.items())
    assert "probability 0.00" not in found.text
    assert sum(found.probabilities.values()) == pytest.approx(1.0, abs=1e-6)


def test_recordings_may_have_other_channels() -> None:
    rig = pamrs.rigs.shoulder()
    heavy = rig.with_effect("muscle_creep", {"stiffness": 800.0, "time_constant": 2.0})
    records = [
        recorded(heavy, "all", "fit"),
        recorded(heavy, "some", "fit", leave_out="supply_pressure", seed=2),
    ]
    found = pamrs.diagnose(pamrs.Case("unequal", rig, records, Path()))
    assert found.where["block"] == "arm"


def test_a_rig_without_tolerances_can_be_diagnosed() -> None:
    rig = pamrs.rigs.sealed_chamber()
    bare = pamrs.rig.parse_rig(
        "\n".join(
            line.split(", tol")[0] + " }" if ", tol" in line else line
            for line in rig.to_toml_text().splitlines()
        )
    )
    assert all(p.tol == 0.0 for p in bare.parameters.values() if p.known)
    run = pamrs.simulate(
        bare.with_effect("leak_muscle", {"conductance": 3e-11}),
        duration=60.0,
        sample_time=0.1,
        initial={"muscle_pressure": 7e5},
    )
    pressure = run["muscle_pressure"] + np.random.default_rng(3).normal(0.0, 150.0, run.time.size)
    hold = whole("hold", "fit", 0.1, {"muscle_pressure": pressure})
    found = pamrs.diagnose(pamrs.Case("bare", bare, [hold], Path()))
    assert found.effects[0]["id"] == "leak_muscle"


@pytest.mark.parametrize("name", ["shoulder", "antagonistic_joint"])
def test_experiments_are_refused_for_rigs_that_nobody_could_command(name: str) -> None:
    text = pamrs.rigs.named(name).to_toml_text()
    driven = re.sub(r"(?m)^\[(supply|valve).*\n(?:(?!\[).*\n)*", "", text)
    with pytest.raises(DiagnosisError, match="no valve that a person could command"):
        library(parse_rig(driven), SETTINGS)


def test_one_zero_serves_both_groups_and_the_others_are_fitted_beside_it() -> None:
    rig = pamrs.rigs.shoulder()
    true = rig.with_parameters({"sensors.pressure_zero": 800.0, "chamber.alpha": 1.25})
    prepared = prepare(recorded(true, "all", "fit"), rig, SETTINGS)
    blocks = {b.name: b for b in available_blocks(rig, NAMES)}
    chamber = Problem([blocks["chamber"]], [prepared], core_rig(rig), SETTINGS)
    # as if its own data had said another zero
    moved = fit(chamber, rig, (), {}, {"chamber": 1.0}, settled={"sensors.pressure_zero": -2500.0})
    values, tolerances = (
        {**found, "sensors.pressure_zero": zero}
        for found, zero in ((moved.values, -2500.0), (moved.moved, -2.5))
    )
    first = replace(moved, values=values, moved=tolerances)
    last = fit(
        Problem([blocks["arm"]], [prepared], core_rig(rig), SETTINGS), rig, (), {}, {"arm": 1.0}
    )
    candidates = [Candidate((), found, {}, {}, 0.0) for found in (first, last)]
    groups = [
        BlockGroup([blocks[n]], {}, {}, [c], {UNDECIDED: 1.0}, None, {}, [])
        for n, c in zip(("chamber", "arm"), candidates, strict=True)
    ]
    judged = judge(groups, SETTINGS)
    settled = _settled(rig, chamber, judged, candidates)
    assert settled[1] is candidates[1]
    model = _merged(rig, settled)
    assert model.parameter("sensors.pressure_zero").value == last.values["sensors.pressure_zero"]

    def missed(model: pamrs.Rig) -> float:
        found = residuals(chamber, model)["chamber", "all"]
        return float(np.sqrt(np.mean(found.value[found.rows] ** 2)))

    assert missed(model) < missed(_merged(rig, candidates))
    assert missed(model) < 1.02 * missed(true)


def test_pressures_that_begin_at_one_atmosphere_are_asked_about() -> None:
    rig = pamrs.rigs.shoulder()
    gauge = recorded(rig, "all", "fit")
    pressure = gauge.channels["muscle_pressure"] - gauge.channels["muscle_pressure"][0]
    cases = [
        pamrs.Case(
            "c",
            rig,
            [replace(gauge, channels=gauge.channels | {"muscle_pressure": pressure + zero})],
            Path(),
        )
        for zero in (0.0, 101325.0)
    ]
    assert words.absolute(cases[0]) == []
    (told,) = words.absolute(cases[1])
    assert "absolute pressures" in told


def test_a_channel_that_a_new_model_spoils_is_told() -> None:
    table = {
        "muscle_pressure": {"noise": 400.0, "before": 7500.0, "refit": 26900.0, "after": 8910.0},
        "joint_angle": {"noise": 1e-3, "before": 1e-2, "refit": 5e-3, "after": 1e-3},
    }
    channels = {name: ChannelError(**row) for name, row in table.items()}
    spoiled = replace(channels["muscle_pressure"], after=9100.0)
    (told,) = words.worse({**channels, "muscle_pressure": spoiled})
    assert "muscle pressure by 91.0 mbar, the nominal one by 75.0 mbar" in told
    assert words.worse({"joint_angle": channels["joint_angle"]}) == []


def test_parameters_that_are_all_at_their_walls_explain_nothing() -> None:
    rig = pamrs.rigs.shoulder()
    prepared = prepare(recorded(rig, "all", "fit"), rig, SETTINGS)
    blocks = {b.name: b for b in available_blocks(rig, NAMES)}
    arm = Problem([blocks["arm"]], [prepared], core_rig(rig), SETTINGS)
    found = fit(arm, rig, (), {}, {"arm": 1.0})
    walls = SETTINGS.most_tolerances
    stuck = replace(found, moved=dict.fromkeys(found.moved, walls))
    free, held = (tangent_of(one, arm, {"arm": 1.0}) for one in (found, stuck))
    assert free.basis.shape[1] > 0
    assert held.basis.shape == (held.rows.size, 0)
    np.testing.assert_array_equal(held.left, held.rows)


def without_damping() -> pamrs.Rig:
    """A hanging mass whose file does not say how its guide is damped."""
    text = (Path(pamrs.rigs.__file__).parent / "hanging_mass.toml").read_text(encoding="utf-8")
    text, count = re.subn(r"^viscous *=.*$", "", text, flags=re.MULTILINE)
    assert count == 1
    return parse_rig(text)


def test_a_value_that_the_file_leaves_out_is_offered_beside_the_effect_with_its_law() -> None:
    case, named = SimpleNamespace(rig=without_damping()), SimpleNamespace(named=())
    assert words.left_out(case, [named]) == []
    named.named = terms("muscle_rate_damping", "leak_muscle")
    (told,) = words.left_out(case, [named])
    assert told.startswith("load.viscous is exactly 0 in the rig file")
    assert words.left_out(SimpleNamespace(rig=pamrs.rigs.hanging_mass()), [named]) == []


@pytest.mark.slow
def test_damping_that_the_file_leaves_out_is_said_with_the_verdict() -> None:
    case = replace(healthy_case("hanging_mass", 1, 200, sharp=False), rig=without_damping())
    found = pamrs.diagnose(case)
    assert found.effects[0].id == "muscle_rate_damping"
    assert any(told.startswith("load.viscous is exactly 0") for told in found.warnings)
