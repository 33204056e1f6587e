"""What is kept of a diagnosis, and the judgement without one of its parts."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from benchmarks.ablation import kept as keeping
from benchmarks.ablation.__main__ import main
from benchmarks.ablation.kept import found_by, keep_case, weighed_of
from benchmarks.ablation.without import WEIGHTS, answer
from pamrs.diagnosis.evidence import posterior
from pamrs.effects import UNDECIDED, UNLISTED, Hypothesis, Term
from tests.diagnosis.held import held
from trial.tests.test_cases import LEAK, key_of

HEAT = "the hypothesis heat_transfer"


def names(*ids: str) -> Hypothesis:
    return Hypothesis(tuple(map(Term, ids)))


SAID = {names("leak_muscle"): 0.6, names("leak_muscle", "muscle_creep"): 0.1, UNLISTED: 0.3}


def test_the_leading_name_is_the_one_with_most_over_all_sets() -> None:
    right = answer(SAID, {"leak_muscle"})
    assert (right.first, right.false, right.unlisted) == (True, None, None)
    assert right.log_score == pytest.approx(math.log(0.6))
    assert answer(SAID, {"muscle_creep"}).first is False
    assert answer(SAID, {"muscle_creep"}).log_score == pytest.approx(math.log(1e-3))
    both = answer(SAID, {"leak_muscle", "muscle_creep"})
    assert both.first is True
    assert both.log_score == pytest.approx(math.log(0.1))


def test_a_name_of_what_acts_in_another_block_is_not_false() -> None:
    assert answer(SAID, ()).false is True
    assert answer(SAID, (), {"leak_muscle"}).false is False
    assert answer({UNDECIDED: 0.9, UNLISTED: 0.1}, ()).false is False


def test_physics_without_a_name_is_recognised_when_it_leads_all_names() -> None:
    assert answer(SAID, (), odd=True).unlisted is False
    assert answer({names("leak_muscle"): 0.4, UNLISTED: 0.6}, (), odd=True).unlisted is True


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A trial with a chamber that leaks, what is kept of it, and of it without a hypothesis."""
    monkeypatch.setattr(keeping, "load_case", lambda _: held(3e-11, 60.0))
    case = tmp_path / "cases" / "case_0001"
    case.mkdir(parents=True)
    (case / "case.toml").touch()
    (tmp_path / "keys").mkdir()
    (tmp_path / "keys" / "case_0001.json").write_text(json.dumps(key_of("case_0001", [LEAK])))
    keep_case(case, tmp_path / "kept")
    keep_case(case, tmp_path / "kept" / HEAT.replace(" ", "_"), HEAT)
    return tmp_path


def test_what_is_kept_is_judged_without_each_part(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = folder / "kept"
    (own,) = weighed_of(kept, "case_0001")
    found = posterior(own.candidates, own.suspects, own.prior)
    stated = json.loads((kept / "case_0001.json").read_text())["probabilities"]
    leading = max(found, key=lambda h: found[h])
    assert str(leading) == "leak_muscle"
    assert stated["leak_muscle"] == pytest.approx(found[leading], abs=5e-3)

    assert HEAT in found_by(kept, "case_0001")
    without = kept / HEAT.replace(" ", "_")
    assert HEAT not in found_by(without, "case_0001")
    tried = {str(c.hypothesis) for w in weighed_of(without, "case_0001") for c in w.candidates}
    assert "leak_muscle" in tried
    assert "heat_transfer" not in tried

    page = folder / "page.md"
    nothing = "the search for other units"
    words = [str(folder), "--part", HEAT, nothing, "--markdown", str(page)]
    assert main(words) == 0  # what is kept is not diagnosed again
    text = page.read_text()
    assert text in capsys.readouterr().out
    assert "| (nothing) | 1 of 1 | 0 of 0 | 0 of 0 | +0.000 ± 0.000 |" in text
    assert sum(line.startswith("| ") for line in text.splitlines()) == 2 + 1 + len(WEIGHTS) + 2
    assert f"| {HEAT} | 1 | 1, 1 of 1 |" in text
    assert f"| {nothing} | 0 | 0, 0 of 0 |" in text


def test_too_few_processes_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(folder), "--jobs", "0"]) == 2
    assert "--jobs = 0" in capsys.readouterr().err
