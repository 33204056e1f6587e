"""Rigs as laboratories have them, each diagnosed with its effect concealed."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import pamrs
from pamrs.findings import WrongParameter
from tests.loaded import CASES, load_module


@pytest.fixture(scope="module")
def layouts() -> ModuleType:
    return load_module(CASES / "layouts" / "layouts.py")


def test_every_layout_writes_a_case_that_is_read(layouts: ModuleType, tmp_path: Path) -> None:
    assert layouts.main([str(tmp_path)]) == 0
    for name in layouts.LAYOUTS:
        case = pamrs.load_case(tmp_path / name)
        assert [r.role for r in case.recordings] == ["fit", "fit", "held_out"]
        page = (tmp_path / name / "README.md").read_text(encoding="utf-8")
        assert layouts.LAYOUTS[name].conceals in page
        assert f"pamrs diagnose out/layouts/{name}" in page
    hanging = pamrs.load_case(tmp_path / "hanging_mass")
    for recording in hanging.recordings:
        masked = int(np.sum(~recording.mask["length"]))
        assert 40 <= masked <= 120  # six dropouts of eight samples, and little beside them
    told = [issue for recording in hanging.recordings for issue in recording.issues]
    holes = [issue for issue in told if (issue.kind, issue.channel) == ("saturated", "length")]
    assert len(holes) >= 17  # six in each of three recordings, of which two may meet
    assert [holes[0].start, holes[0].stop] == pytest.approx([5.28, 5.35], abs=6e-3)
    assert "8 samples" in holes[0].text
    assert layouts.main([str(tmp_path), "moon"]) == 2


def with_its_effect(layouts: ModuleType, name: str, folder: Path) -> pamrs.Diagnosis:
    """The diagnosis of a layout, which names the effect that it conceals and no other."""
    layout = layouts.LAYOUTS[name]
    found = pamrs.diagnose(layouts.write(layout, folder))
    assert [e.id for e in found.effects] == [layout.conceals]
    return found


def with_its_value(
    layouts: ModuleType, name: str, folder: Path
) -> tuple[pamrs.Diagnosis, WrongParameter]:
    """The same of a layout whose rig file has a wrong value, with what it says of that."""
    layout = layouts.LAYOUTS[name]
    found = pamrs.diagnose(layouts.write(layout, folder))
    (wrong,) = found.wrong_parameters
    assert wrong.name == layout.conceals
    return found, wrong


@pytest.mark.slow
def test_an_isometric_bench_has_no_force_below_a_pressure(
    layouts: ModuleType, tmp_path: Path
) -> None:
    found = with_its_effect(layouts, "isometric_bench", tmp_path)
    assert found.effects[0].parameters["threshold"]["value"] == pytest.approx(2e4, rel=0.1)


def test_three_nozzles_show_the_heat_of_the_wall(layouts: ModuleType, tmp_path: Path) -> None:
    found, wrong = with_its_value(layouts, "tank_three_nozzles", tmp_path)
    assert not found.effects
    assert wrong.value == pytest.approx(50.0, rel=0.02)
    assert "temperature" in found.data[0].used


@pytest.mark.slow
def test_one_gauge_finds_the_dead_time(layouts: ModuleType, tmp_path: Path) -> None:
    _, wrong = with_its_value(layouts, "regulator_one_gauge", tmp_path)
    assert wrong.value == pytest.approx(0.03, abs=5e-4)


@pytest.mark.slow
def test_a_gauge_at_each_end_of_the_tube_finds_the_exhaust(
    layouts: ModuleType, tmp_path: Path
) -> None:
    found, wrong = with_its_value(layouts, "eight_metres", tmp_path)
    assert wrong.value == pytest.approx(3.9e-9, rel=0.02)
    assert wrong.probability > 0.8
    assert found.where["block"] in ("line", "chamber")


@pytest.mark.slow
def test_a_hanging_mass_shows_the_friction_of_its_braid(
    layouts: ModuleType, tmp_path: Path
) -> None:
    found = with_its_effect(layouts, "hanging_mass", tmp_path)
    assert found.effects[0].probability > 0.8
    assert sum("saturated in length" in text for text in found.warnings) >= 17
