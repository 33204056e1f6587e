"""What fails in a diagnosis costs that part alone, and is told; under a test it is raised."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs._arrays import solve_normal
from pamrs._losses import STRICT, Losses
from pamrs.diagnosis.explain import _assemble
from pamrs.diagnosis.model import _conclude
from pamrs.diagnosis.next_experiment import _choice
from pamrs.diagnosis.search import _attempts, _examine, _hypotheses
from pamrs.effects import Term
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording
from pamrs.report import html
from tests.diagnosis.asked import diagnosed
from tests.diagnosis.held import held
from tests.diagnosis.kept import kept
from tests.diagnosis.noisy import SHOULDER, driven
from tests.diagnosis.synthetic import diagnosis

RIG = pamrs.rigs.shoulder()


def broken(*_: object, **__: object) -> Any:
    raise np.linalg.LinAlgError("Singular matrix")


@pytest.fixture
def lenient(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where a user runs it."""
    monkeypatch.delenv(STRICT)


def leaking() -> pamrs.Case:
    return held(3e-11, 120.0)


def shoulder(role: str, seed: int) -> Recording:
    """A run of the nominal shoulder, 4 s at 200 Hz."""
    time = 0.005 * np.arange(800)
    command = {"valve_command": 5.0 + 0.45 * np.sin(1.6 * time) + 0.25 * np.sin(4.1 * time)}
    start = {"muscle_pressure": 2e5, "joint_angle": 0.9}
    return driven(RIG, "run", role, 0.005, command, SHOULDER, [5 + seed], initial=start)


def told(found: pamrs.Diagnosis) -> list[str]:
    return [w for w in found.warnings if "LinAlgError: Singular matrix" in w]


@pytest.mark.usefixtures("lenient")
def test_a_hypothesis_that_fails_costs_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    right = _attempts.fit

    def fit(problem: Any, nominal: Any, effects: Any, *rest: Any, **options: Any) -> Any:
        return (broken if Term("heat_transfer") in effects else right)(
            problem, nominal, effects, *rest, **options
        )

    monkeypatch.setattr(_attempts, "fit", fit)
    found = pamrs.diagnose(leaking())
    assert found.effects[0].id == "leak_muscle"
    assert found.warnings[0] == told(found)[0]
    assert "heat_transfer" in found.warnings[0]
    kept(found)


FAILING = {
    _hypotheses: ("free_suspects", "with_freed_values", "fit_considered"),
    _conclude: ("budget", "free_run"),
    pamrs.diagnosis: ("next_to_record",),
    _assemble: ("describe",),
}
"""Steps by their module."""


@pytest.mark.usefixtures("lenient")
def test_steps_that_fail_cost_themselves(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = [(module, name) for module, own in FAILING.items() for name in own]
    for module, name in names:
        monkeypatch.setattr(module, name, broken)
    found = pamrs.diagnose(leaking())
    assert found.effects[0].id == "leak_muscle"
    assert len(told(found)) == len(names)
    found.report(tmp_path / "page.html")
    found.figure(tmp_path / "picture.png")
    assert "Singular matrix" in (tmp_path / "page.html").read_text(encoding="utf-8")
    kept(found)


@pytest.mark.usefixtures("lenient")
def test_blocks_whose_judgement_fails_cost_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    right = _examine._begin_part

    def begun(fitted: Any, held: Any, nominal: Any, blocks: Any, say: Any) -> Any:
        work = right if blocks[0].mechanical else broken
        return work(fitted, held, nominal, blocks, say)

    monkeypatch.setattr(_examine, "_begin_part", begun)
    found = diagnosed(RIG, shoulder, ("fit",))
    verdicts = {b: entry.verdict for entry in found.blocks for b in entry.blocks}
    assert verdicts.pop("arm") != "not_judged"
    assert verdicts == {"supply": "not_judged", "chamber": "not_judged"}
    assert found.warnings[0].startswith("the judgement of supply and chamber failed")
    monkeypatch.setattr(_examine, "_begin_part", broken)
    with pytest.raises(DiagnosisError, match="Singular matrix"):
        pamrs.diagnose(leaking())


@pytest.mark.usefixtures("lenient")
def test_a_search_for_units_or_offsets_that_fails_costs_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pamrs.diagnosis, "find_misread", broken)
    monkeypatch.setattr(pamrs.diagnosis, "_with_offsets", broken)
    found = pamrs.diagnose(leaking())
    assert found.verdict == "effects"
    assert found.warnings[0].startswith("the search for other units failed and was left out")
    assert found.warnings[1].startswith("the search for offsets of commands failed")


@pytest.mark.usefixtures("lenient")
def test_an_experiment_that_fails_costs_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = pamrs.rigs.sealed_chamber()
    leak = rig.with_effect("leak_muscle", {"conductance": 1e-13})
    sets = [("none", rig, 0.5), ("leak_muscle", leak, 0.5)]
    right, failed = _choice._simulated, []

    def simulated(experiment: Any, hypotheses: Any) -> Any:
        if not failed:
            failed.append(experiment.name)
            broken()
        return right(experiment, hypotheses)

    monkeypatch.setattr(_choice, "_simulated", simulated)
    losses = Losses()
    found = _choice.propose(rig, sets, losses=losses)
    assert found.ranking
    assert failed[0] not in [entry.name for entry in found.ranking]
    assert len(losses.sentences) == 1
    failed.clear()
    with pytest.raises(np.linalg.LinAlgError):
        _choice.propose(rig, sets)


@pytest.mark.usefixtures("lenient")
def test_parts_of_a_page_that_fail_cost_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = ("chain", "map", "facts", "free_run")
    for part in parts:
        home = html._PICTURES if part in html._PICTURES else html._TABLES
        monkeypatch.setitem(home, part, broken)
    page = html.render(diagnosis())
    for part in parts:
        assert f"{part.replace('_', ' ')} failed and was left out" in page
    assert "</html>" in page


def test_under_a_test_it_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(np.linalg.LinAlgError):
        Losses().part("this", broken)
    monkeypatch.setattr(_conclude, "budget", broken)
    with pytest.raises(np.linalg.LinAlgError):
        pamrs.diagnose(leaking())


def test_an_interrupt_is_no_loss(lenient: None) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    losses = Losses()
    with pytest.raises(KeyboardInterrupt):
        losses.part("this", interrupted)
    assert losses.sentences == []


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e20])
@pytest.mark.parametrize("columns", [(0, 0), (0, 1, 1), (0, 1, 2)])
def test_normal_equations_of_any_scale_are_solved(scale: float, columns: tuple[int, ...]) -> None:
    rng = np.random.default_rng(0)
    rows = scale * rng.normal(size=(30, 3))[:, columns] * np.logspace(0, -12, len(columns))
    values = rows @ np.ones(len(columns))
    found = solve_normal(rows.T @ rows, rows.T @ values)
    assert np.linalg.norm(rows @ found - values) < 1e-6 * np.linalg.norm(values)


def test_an_unknown_that_is_not_seen_is_zero() -> None:
    assert solve_normal(np.diag([2.0, 0.0]), np.array([1.0, 0.0])).tolist()[1] == 0.0
