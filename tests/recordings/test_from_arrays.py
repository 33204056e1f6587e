"""Cases out of tables in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pamrs
from pamrs.errors import CaseError, RecordingError

RIG = pamrs.rigs.shoulder()
TIME = 0.005 * np.arange(400)
COMMAND = 5.0 + 0.6 * np.sin(3.0 * TIME)
RUN = pamrs.simulate(RIG, COMMAND, sample_time=0.005)
ARRAYS = {
    "valve_command": COMMAND,
    "muscle_pressure": RUN["muscle_pressure"],
    "joint_angle": RUN["joint_angle"],
}


def test_arrays_are_what_a_file_of_the_same_would_be(tmp_path: Path) -> None:
    found = pamrs.Case.from_arrays(RIG, {"run": ARRAYS}, sample_time=0.005).recordings[0]
    table = pd.DataFrame({"t": TIME} | ARRAYS)
    table.to_csv(tmp_path / "run.csv", index=False)
    units = {"valve_command": "V", "muscle_pressure": "Pa", "joint_angle": "rad"}
    (read,) = pamrs.recordings.load_recordings(
        tmp_path / "run.csv",
        channels={name: {"column": name, "unit": unit} for name, unit in units.items()},
        time={"column": "t", "unit": "s"},
    )
    assert (found.name, found.role, found.sample_time) == ("run", "fit", 0.005)
    assert found.units == read.units
    for name, values in read.channels.items():
        assert np.allclose(found.channels[name], values, rtol=1e-12, atol=1e-12)
        assert found.mask[name].all()


def test_data_frames_in_bar_and_degrees_with_their_own_times() -> None:
    frame = pd.DataFrame(ARRAYS) / {
        "valve_command": 1.0,
        "muscle_pressure": 1e5,
        "joint_angle": 1.0,
    }
    frame["joint_angle"] = np.degrees(frame["joint_angle"])
    frame["time"] = TIME
    frame.loc[20:22, "muscle_pressure"] = np.nan
    case = pamrs.Case.from_arrays(
        RIG,
        {"first": frame, "second": frame},
        units={"muscle_pressure": "bar", "joint_angle": "deg"},
        held_out=["second"],
        name="bench",
    )
    assert case.name == "bench"
    assert [r.name for r in case.fit] == ["first"]
    assert [r.name for r in case.held_out] == ["second"]
    own = case.recordings[0]
    assert not own.mask["muscle_pressure"][20:23].any()
    kept = own.mask["muscle_pressure"]
    assert np.allclose(own.channels["muscle_pressure"][kept], ARRAYS["muscle_pressure"][kept])
    assert np.allclose(own.channels["joint_angle"], ARRAYS["joint_angle"])


def test_a_case_of_arrays_is_diagnosed() -> None:
    rng = np.random.default_rng(5)
    noise = {"muscle_pressure": 400.0, "joint_angle": 3e-4}
    noisy = {n: v + rng.normal(0.0, noise.get(n, 0.0), v.size) for n, v in ARRAYS.items()}
    found = pamrs.diagnose(pamrs.Case.from_arrays(RIG, {"run": noisy}, sample_time=0.005))
    assert found.verdict in ("none", "parameters")


@pytest.mark.parametrize(
    ("tables", "options", "error", "said"),
    [
        ({}, {}, CaseError, "one at least is needed"),
        ({"run": {}}, {}, CaseError, "recording 'run': arrays of one length are needed"),
        (
            {"run": ARRAYS | {"joint_angle": TIME[:9]}},
            {},
            CaseError,
            r"joint_angle \(9,\)",
        ),
        ({"run": ARRAYS}, {"held_out": ["other"]}, CaseError, r"held_out = \['other'\]"),
        ({"run": ARRAYS}, {"units": {"force": "N"}}, CaseError, "no recording has that channel"),
        ({"run": ARRAYS}, {"units": {"joint_angle": "bar"}}, RecordingError, "bar"),
        ({"run": ARRAYS | {"jont_angle": TIME}}, {}, RecordingError, "did you mean 'joint_angle'"),
        ({"run": ARRAYS}, {"sample_time": None}, RecordingError, "sample_time"),
    ],
)
def test_what_cannot_be_a_case_is_named(tables, options, error, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(error, match=said):
        pamrs.Case.from_arrays(RIG, tables, **{"sample_time": 0.005} | options)
