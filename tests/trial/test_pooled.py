"""Scored trials of the second plan together."""

import json
from pathlib import Path

import pytest

from trial.__main__ import main
from trial.second.pooled import page, pooled
from trial.second.tables import scores, to_json

PROOF = Path(__file__).parents[2] / "docs" / "proof"
FILES = [PROOF / f"second_plan_seed_{seed}.json" for seed in (10501, 10701)]


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_a_trial_by_itself_has_its_own_scores(file):
    (marks,) = pooled([file]).values()
    own, told = (json.loads(text) for text in (to_json(scores(marks)), file.read_text()))
    for part in ("all", "strata", "leave_form_out", "cases"):
        assert own[part] == told[part]


def test_cases_of_several_count_together(tmp_path, capsys):
    trials = pooled(FILES)
    one, other, both = (
        scores(marks)["strata"]["rig"]["shoulder"]["leading name right"]
        for marks in (*trials.values(), [m for marks in trials.values() for m in marks])
    )
    assert both["n"] == one["n"] + other["n"] > 0
    assert both["hits"] == one["hits"] + other["hits"]
    main(["pool", *map(str, FILES), "--markdown", str(tmp_path / "page.md")])
    said = (tmp_path / "page.md").read_text()
    assert said.strip() == capsys.readouterr().out.strip() == page(trials).strip()
    assert "second_plan_seed_10701" in said


def test_what_is_no_score_is_refused(tmp_path):
    other = tmp_path / "other.json"
    other.write_text('{"schema": "pamrs.trial-scores/1", "cases": []}')
    with pytest.raises(ValueError, match="trial-scores/1"):
        pooled([other])
    with pytest.raises(ValueError, match="there already"):
        pooled([FILES[0], FILES[0]])
    with pytest.raises(ValueError, match="no file"):
        pooled([])
