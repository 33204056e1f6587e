"""A result that is read from its file is what was written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import pamrs
from pamrs.errors import DiagnosisError
from tests.diagnosis import synthetic


@pytest.mark.parametrize("make", [synthetic.diagnosis, synthetic.sealed_chamber, synthetic.nothing])
def test_what_was_written_is_read(make, tmp_path: Path) -> None:
    made = make()
    written = made.to_json(tmp_path / "result.json")
    read = pamrs.load_result(tmp_path)
    assert isinstance(read, pamrs.Diagnosis)
    assert read.to_json() == written
    assert read == pamrs.load_result(tmp_path / "result.json") == made
    assert (read.case, read.text, repr(read)) == (made.case, made.text, repr(made))
    assert read.summary() == made.summary()
    assert made._repr_html_().startswith(read._repr_html_())  # behind it, a picture
    assert [type(one) for one in read.effects] == [type(one) for one in made.effects]
    assert [one.name for one in read.effects] == [one.name for one in made.effects]


def test_what_a_file_does_not_keep_says_what_to_do(tmp_path: Path) -> None:
    synthetic.diagnosis().to_json(tmp_path / "result.json")
    read = pamrs.load_result(tmp_path)
    with pytest.raises(DiagnosisError, match="rig is not kept .* --model wrote"):
        _ = read.rig
    with pytest.raises(DiagnosisError, match="run pamrs.diagnose on the case again"):
        read.report(tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "pamrs.diagnosis/9"}, "'pamrs.diagnosis/9' is not allowed: pamrs.diagnosis/1"),
        ({"verdict": "maybe"}, "verdict is 'maybe'"),
        ({"effects": [{"probability": 0.5}]}, "is no complete result"),
        ({"effects": 3}, "is no complete result"),
        ({"where": [1]}, "is no complete result"),
        ({"settings": {"speed": 1}}, "settings has 'speed'"),
    ],
)
def test_what_is_no_result_is_named(change, said: str, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    file.write_text(json.dumps(json.loads(synthetic.diagnosis().to_json()) | change))
    with pytest.raises(DiagnosisError, match=said):
        pamrs.load_result(file)


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(DiagnosisError, match=r"result\.json: cannot be read"):
        pamrs.load_result(tmp_path)
    (tmp_path / "result.json").write_text("[1, 2")
    with pytest.raises(DiagnosisError, match="is not the JSON of a result"):
        pamrs.load_result(tmp_path)
    (tmp_path / "result.json").write_text("[1, 2]")
    with pytest.raises(DiagnosisError, match="schema = None"):
        pamrs.load_result(tmp_path)
