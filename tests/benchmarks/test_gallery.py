"""A page for every real recording."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import pamrs
from benchmarks import gallery
from benchmarks.real import CHAMBERS, LEAKING, diagnosed

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "../shared/recordings"
PAGES = ROOT / "cases" / "gallery"
SECTIONS = (
    "The rig",
    "What is not known",
    "What is found",
    "Budget",
    "What would settle it",
    "Next experiment",
)
needs_recordings = pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs ../shared")


def headings(text: str) -> tuple[str, ...]:
    return tuple(re.findall(r"^## (.+)$", text, flags=re.M))


def test_the_index_names_every_page_and_each_has_all_sections() -> None:
    index = (PAGES / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\]\((\w[^)]*\.md)\)", index))
    assert named == {path.name for path in PAGES.glob("*.md")} - {"README.md"}
    assert {f"chamber_{name}.md" for name in CHAMBERS} < named
    for name in named:
        text = (PAGES / name).read_text(encoding="utf-8")
        assert headings(text) == SECTIONS
        for link in re.findall(r"\]\(([^)]+)\)", text):
            assert (PAGES / link).is_file(), f"{name}: {link}"


@needs_recordings
def test_a_page_says_what_its_diagnosis_says() -> None:
    for name in (LEAKING[1], "Aluminium"):
        case = pamrs.load_case(ROOT / "cases/zillen_chambers" / name, allow_outside=True)
        page = gallery.chamber_page(name, case, diagnosed(case, lambda text: None))
        leaks = name in LEAKING
        assert ("Verdict **effects** (leak_muscle" in page.text) is leaks
        assert "Unknown to the rig file: chamber.dead_volume." in page.text
        assert headings(page.text) == SECTIONS
        assert page.line.startswith("loses 100 % of 6.3 bar" if leaks else "loses 0.4 % of 7.32")


@needs_recordings
def test_a_force_maps_page_has_both_predictions() -> None:
    name = gallery.MAPS[1]
    page = gallery.map_page(name, ROOT / "cases/festo_dmsp" / f"{name}.toml")
    assert "within 1.07 % of the largest force" in page.line
    assert 'model = "map"' in page.text


def test_without_the_recordings_it_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(tmp_path / "out"), "--recordings", str(tmp_path), "--pages", str(tmp_path / "p")]
    assert gallery.main(words) == 2
    assert "the recordings are not there" in capsys.readouterr().err
    assert not (tmp_path / "p").exists()
