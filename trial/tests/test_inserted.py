"""Missed cases diagnosed again with their truth inserted: did the search fail, or the weighing?"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from trial.__main__ import main
from trial.inserted import (
    FAILED,
    FORM,
    QUIET,
    SEARCH,
    UNFIT,
    WEIGHT,
    all_inserted,
    diagnosed,
    truth_of,
)
from trial.tests.test_cases import CREEP, HOSE, LEAK, key_of, result_of


def told(result: dict[str, Any], *considered: tuple[float | None, float]) -> dict[str, Any]:
    """What a diagnosis with the truth inserted says: beside its result the share that the truth
    leaves, and its probability.
    """
    found = [{"left": a, "probability": b, "blocks": ["arm"]} for a, b in considered]
    return result | {"considered": found}


NOWHERE = {"left": None, "probability": 0.0, "blocks": []}
#: truth, what was said, what is said with the truth inserted, and what failed
CASES = {
    "right": ([LEAK], ["leak_muscle"], None, ""),
    "lost": ([LEAK], [], told(result_of("effects", ["leak_muscle"]), (0.01, 0.9)), SEARCH),
    "light": ([CREEP], ["heat"], told(result_of("effects", ["heat"]), (0.2, 0.1)), WEIGHT),
    "odd": ([CREEP], [], told(result_of("unlisted"), (0.1, 0.1), (0.8, 0.1)), FORM),
    "inside": ([CREEP], [], told(result_of("unlisted"), (None, 0.0)), UNFIT),
    "quiet": ([LEAK], [], result_of("none") | {"considered": [NOWHERE]}, QUIET),
    "broken": ([LEAK], [], None, FAILED),
    "listed nowhere": ([HOSE], ["muscle_creep"], None, ""),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A trial with a case of each kind, and a diagnosis that says what it is to say."""
    (tmp_path / "keys").mkdir()
    for name, (truth, named, _, _) in CASES.items():
        said = result_of("effects" if named else "unlisted", named)
        (tmp_path / "keys" / f"{name}.json").write_text(json.dumps(key_of(name, truth)))
        (tmp_path / "results" / name).mkdir(parents=True)
        (tmp_path / "results" / name / "out.json").write_text(json.dumps(said))

    def diagnosed(case: Path, suspicion: str) -> dict[str, Any]:
        truth, _, again, _ = CASES[case.name]
        assert suspicion == "+".join(name for name, _, _ in truth)
        if again is None:
            raise ValueError(f"{case}: the model leaves its range")
        return again

    monkeypatch.setattr("trial.inserted.diagnosed", diagnosed)
    return tmp_path


def test_each_missed_case_failed_by_one_thing(folder: Path) -> None:
    found = {own.case: own.failed for own in all_inserted(folder, folder / "results")}
    assert found == {name: failed for name, (*_, failed) in CASES.items() if failed}


def test_the_truth_is_what_a_diagnosis_may_name() -> None:
    key = key_of("a", [LEAK, HOSE, CREEP], wrong=["arm.payload"])
    assert truth_of(key) == "leak_muscle+muscle_creep+arm.payload"


def test_the_command_writes_the_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = folder / "inserted.md"
    assert main(["insert", str(folder), "--markdown", str(page)]) == 0
    text = page.read_text()
    assert text in capsys.readouterr().out
    assert "| lost | leak_muscle | unlisted | leak_muscle | 1 % | 0.90 | search |" in text
    assert "| search | 1 |" in text


def test_a_trial_without_keys_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["insert", str(tmp_path)]) == 2
    assert "no key in" in capsys.readouterr().err


def test_a_case_that_is_none_says_why(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nowhere: no such case folder"):
        diagnosed(tmp_path / "nowhere", "leak_muscle")
