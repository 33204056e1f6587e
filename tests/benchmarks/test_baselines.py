"""The baselines of a trial on small cases: a sealed chamber with and without a leak."""

import json

import numpy as np
import pytest

import pamrs

pytest.importorskip("pysindy")
pytest.importorskip("sklearn")

from benchmarks.baselines import sindy  # noqa: E402
from benchmarks.baselines.__main__ import main  # noqa: E402
from benchmarks.baselines.sheet import _signals, gap_closed  # noqa: E402
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import prepare
from pamrs.recordings import Recording  # noqa: E402

SETTINGS = DiagnosisSettings()


def hold(folder, conductance, *starts):
    """Holds of a known chamber, 60 s at 10 Hz, the last of them held out."""
    rig = pamrs.rigs.sealed_chamber()
    truth = rig.with_effect("leak_muscle", {"conductance": conductance}) if conductance else rig
    folder.mkdir(parents=True)
    (folder / "rig.toml").write_text(rig.to_toml_text())
    text = 'schema = "pamrs.case/1"\nrig = "rig.toml"\n'
    for i, start in enumerate(starts):
        run = pamrs.simulate(
            truth, duration=60.0, sample_time=0.1, step=0.01, initial={"muscle_pressure": start}
        )
        pressure = run["muscle_pressure"] + np.random.default_rng(i).normal(
            0.0, 150.0, run.time.size
        )
        rows = [f"{t:.1f},{p:.2f}" for t, p in zip(run.time, pressure, strict=True)]
        (folder / f"hold_{i}.csv").write_text(
            "\n".join(["time [s],muscle_pressure [Pa]", *rows]) + "\n"
        )
        role = "held_out" if i == len(starts) - 1 else "fit"
        text += f'\n[[recording]]\nfile = "hold_{i}.csv"\nrole = "{role}"\n'
    (folder / "case.toml").write_text(text)


@pytest.mark.slow
def test_a_leak_and_a_tight_chamber(tmp_path, capsys):
    hold(tmp_path / "cases" / "leak", 3e-11, 7e5, 5e5, 6e5)
    hold(tmp_path / "cases" / "tight", 0.0, 7e5, 5e5, 6e5)
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
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    names = ("supply_pressure", "muscle_pressure", "joint_angle")
    channels = {"valve_command": command, **{n: run[n] for n in names}}
    mask = {n: np.ones(command.size, dtype=bool) for n in channels}
    units = dict.fromkeys(channels, "")
    prepared = prepare(
        Recording("r", "fit", run.time, 0.005, channels, mask, [], units), rig, SETTINGS
    )
    found = _signals(prepared, rig)
    assert set(found) == {"p", "dp", "q", "dq", "ps", "x"}
    assert np.allclose(found["x"], (command - 5.0) / rig.model["valve"]["half_range"])
