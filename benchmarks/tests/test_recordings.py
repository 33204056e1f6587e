"""The page of the recordings of others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.recordings import (
    CHAMBERS,
    LEAKING,
    arm_text,
    chamber_mark,
    cylinder_budget,
    cylinder_rows,
    lung_mark,
    lung_tables,
    page,
)

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "../shared/recordings"
FRICTION = RECORDINGS / "pneumatic_cylinders_zillen/results_pneumatic-actuator/data/friction"


def result(verdict: str, *named: str) -> dict:
    """As much of a result as a mark needs."""
    return {"verdict": verdict, "effects": [{"id": name} for name in named]}


def test_marks_of_chambers() -> None:
    assert "**right**" in chamber_mark(LEAKING[0], result("effects", "leak_muscle"))
    assert "**wrong**" in chamber_mark(LEAKING[0], result("unlisted"))
    assert "**cannot tell**" in chamber_mark("Aluminium", result("unlisted", "leak_muscle"))
    assert "**wrong**" in chamber_mark("Aluminium", result("effects", "leak_muscle"))
    assert len(set(CHAMBERS)) == 7


def test_marks_of_the_lung(tmp_path: Path) -> None:
    def told(first: str, *laws: str) -> dict:
        found = [{"name": name} for name in laws]
        return {"verdict": "unlisted", "probabilities": {first: 0.6, "none": 0.1}, "laws": found}

    assert "**right**" in lung_mark("wrong_resistor", told("line.discharge_area"))
    assert "**partly**" in lung_mark("wrong_resistor", told("line_flow_law"))
    assert "**wrong**" in lung_mark("control_redo", told("line_flow_law"))
    assert "**wrong**" in lung_mark("control_redo", told("unlisted", "chamber.gas"))
    assert "**cannot tell**" in lung_mark("control_redo", told("unlisted"))
    assert "**right**" in lung_mark("control_redo", {**told("none"), "verdict": "none"})
    assert "**cannot tell**" in lung_mark("hose_off", None)
    said: list[str] = []
    assert "not there" in lung_tables(ROOT / "cases", tmp_path / "no", tmp_path, said.append)[0]
    assert len(said) == 1


def test_what_the_assumed_unit_changes_is_said() -> None:
    def told(before: float, refit: float, moved: float) -> dict:
        entry = {"value": 0.2, "moved_sigmas": moved}
        return {
            "verdict": "unlisted",
            "fit": {"held_out": {"joint_angle.base": {"before": before, "refit": refit}}},
            "parameters": {"arm.inertia": entry},
        }

    parts = {"friction": 0.7, "other": 0.02}
    text = arm_text(
        {3.0: told(0.2, 0.1, -1.0), 1.5: told(0.1, 0.12, -3.0)}, {3.0: parts, 1.5: parts}
    )
    assert "after the refit from 100 to\n  120 mrad, 11 %" in text
    assert "at least one unit: arm.inertia" in text
    assert "3 bar: friction 70 %, others 2 %" in text


def test_recordings_that_are_not_there_are_missed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="the recordings are not there"):
        page(ROOT / "cases", tmp_path / "no", tmp_path / "out", print)
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not FRICTION.is_dir(), reason="the recordings are not there")
def test_shares_of_a_cylinder_add_up() -> None:
    from cases.zillen_cylinders.record import load_friction_folder

    told = cylinder_budget(load_friction_folder(FRICTION).cylinders["Kidney_lc"])
    assert np.isclose(sum(v for v, _, _ in told["shares"].values()), 1.0)
    assert told["after"] < told["constant"] < told["before"]


@pytest.mark.slow
@pytest.mark.skipif(not FRICTION.is_dir(), reason="the recordings are not there")
def test_every_cylinder_has_a_row() -> None:
    assert len(cylinder_rows(FRICTION)) == 4
