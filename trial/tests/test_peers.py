"""Other methods beside the diagnosis on cases of the second plan."""

from __future__ import annotations

from trial.marks import Mark
from trial.peers import _one, peers_page

TAGS = {"strength": ("10",), "model error": ("0 %",), "truth": ("effect",), "log": ()}


def case(name: str, *, block: str = "", log: str = "several recordings"):
    """A case whose refit leaves 10 noises of the pressure, and what others make of it."""
    tags = {**TAGS, "log": (log,), **({} if block else {"strength": ()})}
    mark = Mark(
        name, "a", "b", tags, True, True, "effects",
        leading=True if block else None, gap=0.8,
    )  # fmt: skip
    held = {
        "muscle_pressure": {"noise": 1e3, "refit": 1e4, "free": 5.5e3, "sindy": 2e3, "gp": 1e4},
        "length": {"noise": 1e-4, "refit": 1e-4, "free": 1.2e-4, "sindy": 1e-4, "gp": 1e-4},
    }
    told = {
        "held_out": held,
        "gap_closed": {"refit": 0.0, "free": 0.48, "sindy": 0.9, "gp": 0.0},
        "models": {
            "sindy": {"chamber": "dr/dt = -3.8 dp +2e-05 x -0.1 r", "load": "no correction"},
            "gp": {"chamber": "no correction", "load": "no correction"},
        },
        "detected": {"refit": True},
        "seconds": {"refit": 1.0, "sindy": 2.0, "gp": 3.0},
    }
    terms = [{"kind": "effect", "block": block}] if block else []
    return _one(mark, {"terms": [*terms, {"kind": "model_error", "block": "arm"}]}, told)


def test_what_a_method_says_of_a_case() -> None:
    found = case("case_0001", block="chamber")
    assert not found.healthy
    assert found.gaps["pamrs"] == 0.8
    assert found.block == {"free": "chamber", "sindy": "chamber", "gp": ""}
    assert found.silent == {"sindy": False, "gp": True}
    assert found.worse == {"free": True, "sindy": False, "gp": False}
    assert case("case_0002").healthy


def test_the_page_counts_case_by_case() -> None:
    text = peers_page([case("case_0001", block="chamber"), case("case_0002")])
    assert "| with recordings held out | 1 | 0.00 | 0.48 | 0.90 | 0.00 | 0.80 |" in text
    assert "| SINDy | 0 | 0 | 1 |" in text
    assert "| refit, free | 1 | 0 | 0 |" in text
    assert "right effect named first | 0 by construction" in text


def test_a_case_with_one_recording_stands_alone() -> None:
    text = peers_page([case("case_0001", block="chamber", log="one free log")])
    assert "| one recording, judged on what was fitted | 1 | 0.00 | 0.48 | 0.90" in text
    assert "with recordings held out |" not in text
    assert "| SINDy | 0 | 0 | 0 |" in text
