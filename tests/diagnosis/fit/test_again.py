"""A model that holds effects already is diagnosed again: they are part of the baseline, and what is
missing beside them is named.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.diagnosis.fit import known_parameters, with_effects_of, with_known
from pamrs.diagnosis.fit._known_parameters import _HELD_SHARE
from pamrs.diagnosis.prepare import without_passing
from tests.diagnosis import again

SHOULDER = pamrs.rigs.shoulder()
LEAKING = SHOULDER.with_effect("leak_muscle", {"conductance": 1e-9}, std={"conductance": 1e-11})
BOTH = LEAKING.with_effect("muscle_hysteresis")


@pytest.fixture(scope="module")
def recordings() -> list[pamrs.Recording]:
    """Of a plant that leaks and whose muscle has friction."""
    return again.case(BOTH, SHOULDER, 700).recordings


def diagnosed(recordings: list[pamrs.Recording], model: pamrs.Rig) -> pamrs.Diagnosis:
    return pamrs.diagnose(pamrs.Case("shoulder", SHOULDER, recordings, Path()), rig=model)


@pytest.fixture(scope="module")
def found(recordings) -> pamrs.Diagnosis:
    """With a model that has the leak already."""
    return diagnosed(recordings, LEAKING)


def test_what_is_missing_beside_a_held_effect_is_named(found) -> None:
    assert found.verdict == "effects"
    assert [effect.id for effect in found.effects] == ["muscle_hysteresis"]
    assert found.where.block == "arm"
    # the leak is a term of the budget that is there already, and a parameter of the baseline
    (held,) = [term for term in found.budget if term.kind == "held"]
    assert (held.block, held.id, held.probability) == ("chamber", "leak_muscle", None)
    assert held.share == pytest.approx(1.0, abs=0.1)
    fitted = found.parameters["leak_muscle.conductance"]
    assert abs(fitted.value - 1e-9) < 4.0 * fitted.std
    assert "holds already" in found.warnings[0]
    assert "leak_muscle" in found.summary()
    # the model has both, each with what is known of it
    assert isinstance(found.rig, pamrs.Rig)
    assert [entry["id"] for entry in found.rig.effects] == ["leak_muscle", "muscle_hysteresis"]
    assert found.rig.effect_std["leak_muscle"]["conductance"] == pytest.approx(fitted.std)


@pytest.mark.slow
def test_another_block_is_named_beside_friction_that_is_held(recordings) -> None:
    # half of what the friction is: the others are fitted beside a value that has to move
    half = {"friction_constant": 3.5, "friction_pressure": 4e-5}
    found = diagnosed(recordings, SHOULDER.with_effect("muscle_hysteresis", half))
    assert [effect.id for effect in found.effects] == ["leak_muscle"]
    assert {b.verdict for b in found.blocks if "arm" in b.blocks} <= {"none", "parameters"}


def test_nothing_is_missing_where_the_model_holds_all(recordings) -> None:
    found = diagnosed(recordings, BOTH)
    assert found.verdict == "none"
    assert found.effects == []
    assert {(t.block, t.id) for t in found.budget if t.kind == "held"} == {
        ("chamber", "leak_muscle"),
        ("arm", "muscle_hysteresis"),
    }
    # the file stays as it was
    assert isinstance(found.rig, pamrs.Rig)
    assert found.rig.to_toml_text() == BOTH.to_toml_text()


def test_an_effect_that_the_plant_does_not_have_is_a_wrong_parameter() -> None:
    found = pamrs.diagnose(again.case(SHOULDER, LEAKING, 900))
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong.name == "leak_muscle.conductance"
    assert wrong.value < 0.02 * wrong.nominal


def test_the_command_goes_on_from_the_model_that_it_wrote(
    recordings, found, tmp_path, capsys, monkeypatch
) -> None:
    given = pamrs.Case("shoulder", LEAKING, recordings, tmp_path)
    home = again.written(given, tmp_path / "case")
    model, further = tmp_path / "found" / "model.toml", tmp_path / "found" / "further.toml"
    model.parent.mkdir()
    with monkeypatch.context() as first:
        first.setattr(pamrs.diagnosis, "diagnose", lambda case, settings, consider, progress: found)
        assert cli.main(["diagnose", str(home), "--model", str(model)]) == 0
    assert "muscle_hysteresis" in model.read_text(encoding="utf-8")
    assert pamrs.load_rig(model).case == "../case"
    capsys.readouterr()
    written = tmp_path / "again.json"
    words = ["diagnose", str(model), "--model", str(further), "--json", str(written)]
    assert cli.main(words) == 0
    told = json.loads(written.read_text(encoding="utf-8"))
    assert told["verdict"] == "none"
    held = {t["id"] for t in told["budget"] if t["kind"] == "held"}
    assert held == {"leak_muscle", "muscle_hysteresis"}
    assert "holds already" in capsys.readouterr().out
    assert pamrs.load_rig(further).case == "../case"


def test_the_command_takes_another_rig(tmp_path, capsys, monkeypatch) -> None:
    seen = []

    def noted(case: pamrs.Case, **options: object) -> pamrs.Diagnosis:
        seen.append(case)
        raise pamrs.DiagnosisError("enough")

    monkeypatch.setattr(pamrs.diagnosis, "diagnose", noted)
    short = [again.recorded(SHOULDER, "slow", "fit", 0, 60)]
    home = again.written(pamrs.Case("shoulder", SHOULDER, short, tmp_path), tmp_path / "case")
    model = LEAKING.to_toml(tmp_path / "model.toml")
    assert cli.main(["diagnose", str(home), "--rig", str(model)]) != 0
    assert [entry["id"] for entry in seen[0].rig.effects] == ["leak_muscle"]
    # a file that says nothing of a case is no case
    capsys.readouterr()
    assert cli.main(["diagnose", str(model)]) != 0
    assert "--rig" in capsys.readouterr().err


def test_a_note_of_the_case_stays_with_the_model(tmp_path) -> None:
    noted = LEAKING.with_case("../case")
    assert noted.with_parameters({"arm.payload": 1.0}).with_effect("muscle_creep").case == "../case"
    assert pamrs.load_rig(noted.to_toml(tmp_path / "rig.toml")).case == "../case"
    assert noted.with_case("").to_toml_text() == LEAKING.to_toml_text()
    command = {"valve_command": np.full(20, 5.5), "sample_time": 0.01}
    one, other = (pamrs.simulate(rig, **command)["joint_angle"] for rig in (noted, LEAKING))
    assert np.array_equal(one, other)


def test_known_of_a_held_parameter_is_at_least_a_share_of_it() -> None:
    known = known_parameters(LEAKING)
    assert known["leak_muscle.conductance"].tol == pytest.approx(_HELD_SHARE * 1e-9)
    assert known["leak_muscle.laminar_share"].tol == 0.0  # a choice
    assert known["arm.payload"] == SHOULDER.parameter("arm.payload")
    wide = SHOULDER.with_effect("leak_muscle", {"conductance": 1e-9}, std={"conductance": 2e-9})
    assert known_parameters(wide)["leak_muscle.conductance"].tol == 2e-9


def test_values_of_held_effects_keep_place_form_and_deviation() -> None:
    rig = pamrs.rigs.named("antagonistic_joint")
    for name, size in (("flexor", 1e-12), ("extensor", 2e-12)):
        made = {"conductance": size}
        rig = rig.with_effect("leak_muscle", made, std={"conductance": 0.1 * size}, at=name)
    values = {"leak_muscle.flexor.conductance": 3e-12, "valve.flexor.null_voltage": 5.01}
    moved = with_known(rig, values, {"leak_muscle.extensor.conductance": 5e-13})
    leaks = {e["at"]: e["parameters"]["conductance"] for e in moved.effects}
    assert leaks == {"flexor": 3e-12, "extensor": 2e-12}
    assert moved.effect_std["leak_muscle.flexor"]["conductance"] == pytest.approx(1e-13)
    assert moved.effect_std["leak_muscle.extensor"]["conductance"] == 5e-13
    assert moved.parameter("valve.flexor.null_voltage").value == 5.01
    other = SHOULDER.with_effect("leak_muscle").with_effect("muscle_creep")
    kept = with_effects_of(LEAKING, other, {"leak_muscle"}).effects
    assert [e["id"] for e in kept] == ["leak_muscle", "muscle_creep"]


def test_what_happens_at_its_own_times_is_looked_for_anew() -> None:
    passing = LEAKING.with_effect("payload_change", {"mass_change": 0.4, "time": 3.0})
    assert without_passing(passing).to_toml_text() == LEAKING.to_toml_text()
    found = diagnosed([again.recorded(LEAKING, "slow", "fit", 0)], passing)
    assert any("payload_change" in warning for warning in found.warnings[:2])
    assert found.verdict in ("none", "parameters")
