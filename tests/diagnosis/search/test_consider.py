"""Names that the caller suspects are judged with what the search finds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import pamrs
from pamrs import cli
from tests.diagnosis import again
from tests.diagnosis.kept import kept
from tests.tables import rows_of

RIG = pamrs.rigs.shoulder()
LEAK = {"conductance": 2e-10}


@pytest.fixture(scope="module")
def asked() -> pamrs.Diagnosis:
    """A leak, with three suspicions, one of them twice."""
    given = again.case(RIG.with_effect("leak_muscle", LEAK), RIG, 1800)
    twice = ("leak_muscle + heat_transfer", "heat_transfer+leak_muscle")
    return pamrs.diagnose(given, consider=["valve_area", twice[0], "base_flexibility", twice[1]])


def test_each_suspicion_has_its_share_and_its_probability(asked: pamrs.Diagnosis) -> None:
    area, both, base = asked.considered
    assert (area.names, set(both.names)) == (["valve_area"], {"leak_muscle", "heat_transfer"})
    assert all(own.blocks == both.blocks and "chamber" in own.blocks for own in (area, both))
    # a freer exhaust is no leak; heat adds nothing to what a leak explains
    assert area.left is not None
    assert area.left > 0.5
    assert area.probability < 0.05
    assert both.left is not None
    assert both.left < 0.05
    assert asked.effects[0].id == "leak_muscle"
    # nothing is missing in the arm
    assert (base.names, base.blocks, base.left) == (["base_flexibility"], [], None)
    assert base.probability < 0.05


@pytest.mark.slow
def test_what_cannot_be_fitted_together_is_said() -> None:
    """An effect that happens at times of its own beside a wrong value, and beside another one."""
    given = again.case(RIG.with_effect("payload_change", {"mass_change": 2.0, "time": 4.0}), RIG)
    asked = ["payload_change+external_torque", "payload_change+arm.payload"]
    found = pamrs.diagnose(given, consider=asked)
    both, with_value = found.considered
    assert (with_value.left, with_value.probability) == (None, 0.0)
    # a push takes nothing that the change of the payload leaves
    assert both.left == pytest.approx(0.0, abs=0.02)
    assert both.probability < 0.1
    assert "it happens with another event or a wrong value" in found.summary()


def test_it_is_told_in_text_and_json(asked: pamrs.Diagnosis) -> None:
    data = kept(asked)
    assert [entry["names"] for entry in data["considered"]] == [
        list(own.names) for own in asked.considered
    ]
    said = " ".join(asked.summary().split())
    assert "Asked for: base flexibility: only noise is left in the blocks where it acts" in said


def test_without_a_mismatch_there_is_nothing_to_explain() -> None:
    found = pamrs.diagnose(again.case(RIG, RIG), consider=["base_flexibility"])
    (own,) = found.considered
    assert (own.names, own.blocks, own.left) == (["base_flexibility"], [], None)
    assert json.loads(found.to_json())["considered"][0]["blocks"] == []


@pytest.mark.parametrize(("name", "said"), rows_of(__file__, "a_name_that_is_none_is_refused"))
def test_a_name_that_is_none_is_refused(name: str, said: str) -> None:
    rig = RIG.with_effect("base_flexibility")
    with pytest.raises(ValueError, match=said):
        pamrs.diagnose(again.case(rig, rig), consider=[name])


def test_a_single_text_and_a_wrong_word_of_the_command_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = again.case(RIG, RIG)
    with pytest.raises(ValueError, match="a list of such texts"):
        pamrs.diagnose(given, consider="leak_muscle")
    folder = again.written(given, tmp_path / "case")
    assert cli.main(["diagnose", str(folder), "--consider", "leak_muscel"]) == 2
    assert "did you mean 'leak_muscle'" in capsys.readouterr().err
