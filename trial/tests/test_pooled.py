"""Scored trials of the second plan together."""

import json
import re
from pathlib import Path

import pytest

from trial.__main__ import main
from trial.diagram import reliability_diagram
from trial.pooled import page, pooled, table_of_cases
from trial.tables import scores, to_json

PROOF = Path(__file__).parents[2] / "docs" / "proof"
TABLE = PROOF / "cases.jsonl.gz"
SEEDS = ("second_plan_seed_10501", "second_plan_seed_10701")


@pytest.fixture
def files(tmp_path):
    """Scores of two trials as ``score --json`` writes them."""
    written = []
    for seed in SEEDS:
        (marks,) = pooled([TABLE], seed).values()
        written.append(tmp_path / f"{seed}.json")
        written[-1].write_text(to_json(scores(marks)))
    return written


def test_a_trial_by_itself_has_the_scores_of_its_rows(files):
    assert pooled(files) == {seed: pooled([TABLE], seed)[seed] for seed in SEEDS}


def test_cases_of_several_count_together(files, tmp_path, capsys):
    trials = pooled(files)
    one, other, both = (
        scores(marks)["strata"]["rig"]["shoulder"]["leading name right"]
        for marks in (*trials.values(), [m for marks in trials.values() for m in marks])
    )
    assert both["n"] == one["n"] + other["n"] > 0
    assert both["hits"] == one["hits"] + other["hits"]
    table = tmp_path / "two.jsonl.gz"
    main(["pool", *map(str, files), "--markdown", str(tmp_path / "page.md"), "--cases", str(table)])
    said = (tmp_path / "page.md").read_text()
    assert said.strip() == capsys.readouterr().out.strip() == page(trials).strip()
    assert "second_plan_seed_10701" in said
    assert pooled([table]) == trials


def test_the_table_is_the_same_bytes_for_the_same_cases():
    assert table_of_cases(pooled([TABLE])) == TABLE.read_bytes()


def test_the_published_page_has_the_numbers_of_the_table():
    """Every row of the page's tables stands, number for number, in what ``pool`` prints."""

    def cells(line):
        return [cell.strip().replace("*", "") for cell in line.strip("|").split("|")]

    printed = page(pooled([TABLE], "second_plan_seed_202")) + page(pooled([TABLE]))
    known = {tuple(cells(line)) for line in printed.splitlines() if line.startswith("|")}
    rows = [
        cells(line)
        for line in (PROOF / "README.md").read_text().splitlines()
        if re.match(r"\| (second_plan|third_plan|pair_plan|\d+ % \||[\d.]+ to)", line)
    ]
    assert len(rows) == 11 + 3 + 7
    for *row, last in rows:
        own = (*row,) if "plan" in row[0] else (*row, last)  # behind a trial stands its digest
        assert any(line[: len(own)] == own for line in known), own
    targets = [
        c for c in map(cells, (PROOF / "README.md").read_text().splitlines()) if "missed" in c
    ]
    assert targets
    for name, *rest in targets:
        assert any(row[0] == name and list(row[2:]) == rest for row in known)


def test_the_published_diagram_is_of_the_published_cases(tmp_path):
    """Counts of groups and the mean distance from what was stated, as it writes them."""

    def words(file):
        return re.findall(r"<text[^>]*>([^<]*)<", file.read_text())

    drawn = tmp_path / "drawn.svg"
    main(["pool", str(TABLE), "--only", "second_plan_seed_202", "--diagram", str(drawn)])
    assert words(drawn) == words(PROOF / "reliability.svg")
    assert {"365", "11.4 points off in the mean"} <= set(words(drawn))
    with pytest.raises(ValueError, match="nothing to draw"):
        reliability_diagram([], drawn)


def test_what_is_no_score_is_refused(files, tmp_path):
    other = tmp_path / "other.json"
    other.write_text(json.dumps({"schema": "pamrs.trial-scores/1", "cases": []}))
    with pytest.raises(ValueError, match="trial-scores/1"):
        pooled([other])
    with pytest.raises(ValueError, match="there already"):
        pooled([files[0], TABLE])
    with pytest.raises(ValueError, match="no scored trial"):
        pooled([])
    with pytest.raises(ValueError, match="begins 'none'"):
        pooled([TABLE], "none")
