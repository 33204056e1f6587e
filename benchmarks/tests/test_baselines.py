"""The baselines of a trial on small cases: a sealed chamber with and without a leak."""

import json
from dataclasses import replace

import numpy as np
import pytest

import pamrs

pytest.importorskip("pysindy")
pytest.importorskip("sklearn")

from benchmarks.baselines import sindy  # noqa: E402
from benchmarks.baselines.__main__ import main  # noqa: E402
from benchmarks.baselines.sheet import _signals, gap_closed  # noqa: E402
from pamrs.diagnosis.prepare import prepare  # noqa: E402
from tests.diagnosis import again  # noqa: E402
from tests.diagnosis.asked import SETTINGS  # noqa: E402
from tests.diagnosis.held import RIG, hold  # noqa: E402
from tests.diagnosis.noisy import SHOULDER, driven  # noqa: E402


def holds(folder, conductance, *starts):
    """Holds of a known chamber, 60 s at 10 Hz, the last of them held out."""
    found = []
    for k, start in enumerate(starts):
        role = "held_out" if k == len(starts) - 1 else "fit"
        one = hold(conductance, 60.0, name=f"hold_{k}", seed=k, start=start)
        found.append(replace(one, role=role, units={"muscle_pressure": "Pa"}))
    again.written(pamrs.Case("holds", RIG, found, folder), folder)


@pytest.mark.slow
def test_a_leak_and_a_tight_chamber(tmp_path, capsys):
    holds(tmp_path / "cases" / "leak", 3e-11, 7e5, 5e5, 6e5)
    holds(tmp_path / "cases" / "tight", 0.0, 7e5, 5e5, 6e5)
    assert main([str(tmp_path), "--jobs", "1"]) == 0
    out = tmp_path / "results" / "baselines"
    leak, tight = (json.loads((out / f"{name}.json").read_text()) for name in ("leak", "tight"))
    for told in (leak, tight):
        assert told["schema"] == "pamrs.baselines/1"
        assert told["named"] is None
        assert set(told["models"]) == {"sindy", "gp"}
    assert leak["detected"]["refit"] is True
    assert leak["gap_closed"]["refit"] == 0.0
    assert 0.0 <= leak["gap_closed"]["free"] < 0.9  # a zero and an exponent are no leak
    assert 0.0 <= leak["gap_closed"]["sindy"] <= 1.0
    assert tight["detected"]["refit"] is False
    assert tight["gap_closed"] == {"refit": None, "free": None, "sindy": None, "gp": None}
    stamp = (out / "leak.json").stat().st_mtime_ns
    (tmp_path / "cases" / "tight" / "hold_0.csv").unlink()
    assert main([str(tmp_path)]) == 3  # the one is kept, the other another case now, and broken
    assert (out / "leak.json").stat().st_mtime_ns == stamp
    assert "tight: CaseError" in capsys.readouterr().out


def test_the_gap_is_pooled_like_that_of_the_diagnosis():
    table = {
        "a": {"noise": 1.0, "refit": 3.0, "gp": 2.0},
        "b": {"noise": 2.0, "refit": 2.0, "gp": 2.0},
    }
    assert gap_closed(table, "gp") == pytest.approx(0.5)
    assert gap_closed({"a": {"noise": 1.0, "refit": 1.04, "gp": 1.0}}, "gp") is None
    assert gap_closed({"a": {"noise": 1.0, "refit": 3.0, "gp": 9.0}}, "gp") == 0.0


def test_a_known_equation_is_run_as_it_should():
    drive, rate, h = np.ones(201), np.full(201, -2.0), 0.005
    found = sindy._first(0.0, drive, rate, h)
    assert found[-1] == pytest.approx(0.5 * (1.0 - np.exp(-2.0 * 2.0)), rel=1e-4)
    feedback = np.column_stack([np.full(201, -25.0), np.zeros(201)])
    swing = sindy._second((1.0, 0.0), np.zeros(201), feedback, h)
    assert swing[100] == pytest.approx(np.cos(5.0), abs=5e-3)


def test_the_library_grows():
    u = np.random.default_rng(1).normal(size=(50, 3))
    widths = {size: sindy.library(u, ("p", "q", "x"), size)[0].shape[1] for size in sindy.LIBRARIES}
    assert widths == {"linear": 4, "even and odd": 13, "full": 19}
    terms, called = sindy.library(u, ("p", "q", "x"), "full")
    assert len(called) == terms.shape[1]
    assert np.allclose(terms[:, called.index("q|q|")], u[:, 1] * np.abs(u[:, 1]))


def test_the_features_of_a_whole_arm_have_the_valves_opening():
    rig = pamrs.rigs.shoulder()
    command = 5.0 + 0.5 * np.sin(0.005 * np.arange(400))
    one = driven(rig, "r", "fit", 0.005, {"valve_command": command}, SHOULDER, [1])
    found = _signals(prepare(one, rig, SETTINGS), rig)
    assert set(found) == {"p", "dp", "q", "dq", "ps", "x"}
    assert np.allclose(found["x"], (command - 5.0) / rig.model["valve"]["half_range"])
