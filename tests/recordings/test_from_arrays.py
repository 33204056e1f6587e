"""Cases out of tables in memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import pamrs
from pamrs.errors import CaseError, DiagnosisError, ParameterError, RecordingError
from pamrs.recordings import Recording, load_recordings

RIG = pamrs.rigs.shoulder()
TIME = 0.005 * np.arange(400)
COMMAND = 5.0 + 0.6 * np.sin(3.0 * TIME)
RUN = pamrs.simulate(RIG, COMMAND, sample_time=0.005)
ARRAYS = {
    "valve_command": COMMAND,
    "muscle_pressure": RUN["muscle_pressure"],
    "joint_angle": RUN["joint_angle"],
}
MIXED = [*ARRAYS["joint_angle"][:-1], "open"]


def test_arrays_are_what_a_file_of_the_same_would_be(tmp_path: Path) -> None:
    found = pamrs.Case.from_arrays(RIG, {"run": ARRAYS}, sample_time=0.005).recordings[0]
    table = pd.DataFrame({"t": TIME} | ARRAYS)
    table.to_csv(tmp_path / "run.csv", index=False)
    units = {"valve_command": "V", "muscle_pressure": "Pa", "joint_angle": "rad"}
    channels = {name: {"column": name, "unit": unit} for name, unit in units.items()}
    (read,) = load_recordings(tmp_path / "run.csv", channels=channels, time="t")
    assert (found.name, found.role, found.sample_time) == ("run", "fit", 0.005)
    assert found.units == read.units
    for name, values in read.channels.items():
        assert np.allclose(found.channels[name], values, rtol=1e-12, atol=1e-12)
        assert found.mask[name].all()


def bench() -> pd.DataFrame:
    """Of a bench: bar and degrees."""
    frame = pd.DataFrame(ARRAYS | {"time": TIME})
    return frame.assign(
        muscle_pressure=1e-5 * frame["muscle_pressure"], joint_angle=np.degrees(frame.joint_angle)
    )


def alone(table: object, rig: pamrs.Rig = RIG, **options: Any) -> Recording:
    """The recording of a table."""
    (own,) = pamrs.Case.from_arrays(rig, {"run": table}, **options).recordings
    return own


def same(own: Recording) -> None:
    """That a recording has the signals of the run."""
    assert own.sample_time == pytest.approx(0.005)
    assert own.duration == pytest.approx(TIME[-1])
    for name, values in ARRAYS.items():
        kept = own.mask[name]
        assert np.allclose(own.channels[name][kept], values[kept])


def test_data_frames_in_bar_and_degrees_with_their_own_times() -> None:
    frame = bench()
    frame.loc[20:22, "muscle_pressure"] = np.nan
    units = {"muscle_pressure": "bar", "joint_angle": "deg"}
    tables = {"first": frame, "second": frame}
    case = pamrs.Case.from_arrays(RIG, tables, units=units, held_out=["second"], name="bench")
    assert case.name == "bench"
    assert [r.name for r in case.fit] == ["first"]
    assert [r.name for r in case.held_out] == ["second"]
    own = case.recordings[0]
    assert np.flatnonzero(~own.valid()).tolist() == [20, 21, 22]
    same(own)


def test_arrays_are_diagnosed_without_a_folder() -> None:
    rng = np.random.default_rng(5)
    noise = {"muscle_pressure": 400.0, "joint_angle": 3e-4}
    noisy = {n: v + rng.normal(0.0, noise.get(n, 0.0), v.size) for n, v in ARRAYS.items()}
    lines = list[str]()
    found = pamrs.diagnose(RIG, data=noisy | {"time": TIME}, progress=lines.append)
    assert found.verdict in ("none", "parameters")
    assert [one.recording for one in found.data] == ["data"]
    assert lines[0] == "reading the case"
    shares = [line.share for line in lines]  # type: ignore[attr-defined]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert "chamber: judged" in lines
    with pytest.raises(CaseError, match="'jont_angle'"):
        pamrs.diagnose(RIG, data={"run": noisy | {"jont_angle": [[1.0]]}, "more": noisy})
    with pytest.raises(DiagnosisError, match="data is missing"):
        pamrs.diagnose(RIG)


def _heading() -> object:
    units = {"muscle_pressure": "bar", "joint_angle": "deg", "valve_command": "V", "time": "s"}
    return bench().rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})


def _frame() -> object:
    frame = bench().set_index("time")
    frame.attrs["units"] = {"muscle_pressure": "bar", "joint_angle": "deg"}
    return frame


def _dataset() -> object:
    data = pytest.importorskip("xarray").Dataset.from_dataframe(bench().set_index("time"))
    data["time"] = 1e3 * data["time"]
    for name, unit in (("muscle_pressure", "bar"), ("joint_angle", "deg"), ("time", "ms")):
        data[name].attrs["units"] = unit
    return data


def _pint() -> object:
    quantity = pytest.importorskip("pint").UnitRegistry().Quantity
    table = {name: values.to_numpy() for name, values in bench().items()}
    units = {"muscle_pressure": "bar", "joint_angle": "deg"}
    return table | {name: quantity(table[name], unit) for name, unit in units.items()}


def _dated() -> object:
    when = pd.to_datetime("2026-11-27 09:00") + pd.to_timedelta(TIME, unit="s")
    return pd.DataFrame(ARRAYS).assign(time=when)


def _indexed() -> object:
    return pd.DataFrame(ARRAYS).set_index(pd.Index(TIME, name="time"))


def _coordinate() -> object:
    xarray = pytest.importorskip("xarray")
    return xarray.Dataset({n: ("time", v) for n, v in ARRAYS.items()}, coords={"time": TIME})


@pytest.mark.parametrize("make", [_heading, _frame, _dataset, _pint, _dated, _indexed, _coordinate])
def test_units_and_times_of_a_table_are_those_that_it_says(make: Callable[[], object]) -> None:
    same(alone(make()))


def test_what_is_said_beside_a_table_holds_and_a_wrong_unit_is_named() -> None:
    same(alone(ARRAYS | {"time": 1e3 * TIME}, units={"time": "ms"}))
    frame = bench()
    frame.attrs["units"] = {"muscle_pressure": "psi", "joint_angle": "deg"}
    same(alone(frame, units={"muscle_pressure": "bar"}))
    unit = pytest.importorskip("pint").UnitRegistry()
    with pytest.raises(CaseError, match="'joint_angle' = .* a quantity in rad"):
        alone(frame.to_dict("list") | {"joint_angle": TIME * unit.m})
    turned = ARRAYS | {"joint_angle": unit.Quantity(bench()["joint_angle"].to_numpy(), "deg")}
    message = r"'joint_angle' has a unit of its own: units\['joint_angle"
    with pytest.raises(CaseError, match=message):
        alone(turned, units={"joint_angle": "deg"})


def test_a_run_is_a_table() -> None:
    assert alone(RUN.to_pandas()[list(ARRAYS)[1:]]).duration == pytest.approx(TIME[-1])


def test_masked_values_are_missing_and_turns_are_moved_as_in_a_folder() -> None:
    masked = np.ma.masked_array(ARRAYS["joint_angle"] + 2.0 * np.pi, TIME < 0.1)
    own = alone(ARRAYS | {"joint_angle": masked}, sample_time=0.005)
    assert np.flatnonzero(~own.mask["joint_angle"]).tolist() == list(range(20))
    same(own)


@pytest.mark.parametrize(
    ("tables", "options", "error", "said"),
    [
        ({}, {}, CaseError, "one at least, is needed"),
        ([ARRAYS], {}, CaseError, "a mapping from names to tables"),
        ({"run": TIME}, {}, CaseError, "a dict of arrays, DataFrame or Dataset is needed"),
        ({3: ARRAYS}, {}, CaseError, "recording 3: a name is needed that is a text"),
        ({"run": {}}, {}, CaseError, "recording 'run' has no channel but time"),
        ({"run": {"time": TIME}}, {}, CaseError, "recording 'run' has no channel but time"),
        ({"run": ARRAYS | {"joint_angle": TIME[:9]}}, {}, CaseError, "joint_angle 9"),
        ({"run": ARRAYS | {"joint_angle": ["1"] * 400}}, {}, CaseError, "'joint_angle' has the ty"),
        ({"run": ARRAYS | {"joint_angle": MIXED}}, {}, CaseError, "no numbers, such as 'open'"),
        ({"run": ARRAYS | {"joint_angle": 1j * TIME}}, {}, CaseError, "the type complex128"),
        (
            {"run": ARRAYS | {"joint_angle": TIME[:, None]}},
            {},
            CaseError,
            r"\(400, 1\); \(400,\) is",
        ),
        ({"run": ARRAYS}, {"held_out": ["other"]}, CaseError, r"held_out = \['other'\]"),
        ({"run": ARRAYS}, {"held_out": "run"}, CaseError, "a list of names is needed"),
        ({"run": ARRAYS}, {"held_out": ["run"]}, CaseError, "one recording is needed that is fit"),
        ({"run": ARRAYS}, {"units": {"force": "N"}}, CaseError, "no recording has that channel"),
        ({"run": ARRAYS}, {"units": {"joint_angle": "bar"}}, RecordingError, "bar"),
        ({"run": ARRAYS | {"jont_angle": TIME}}, {}, RecordingError, "did you mean 'joint_angle'"),
        ({"run": ARRAYS}, {"sample_time": None}, CaseError, "give it a channel time"),
        ({"run": ARRAYS}, {"sample_time": -1.0}, ParameterError, "sample_time = -1"),
    ],
)
def test_what_cannot_be_a_case_is_named(tables, options, error, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(error, match=said):
        pamrs.Case.from_arrays(RIG, tables, **{"sample_time": 0.005} | options)


def test_a_table_that_lacks_a_channel_names_that_one_alone() -> None:
    frame = pd.DataFrame(ARRAYS)
    short = frame.drop(columns="joint_angle")
    other = pamrs.simulate(RIG, 10.5 - COMMAND[::-1], sample_time=0.005)
    two = {name: other[name] for name in ("valve_command", "muscle_pressure")}
    for tables, told in (
        ({"run": short}, r"measure supply_pressure, joint_angle$"),
        ({"run": short.assign(supply_pressure=RUN["supply_pressure"])}, r"measure joint_angle$"),
        (
            {"one": frame.assign(supply_pressure=RUN["supply_pressure"]), "two": two},
            r"measure supply_pressure \(not in two\), joint_angle \(not in two\)$",
        ),
    ):
        with pytest.raises(DiagnosisError, match=told):
            pamrs.diagnose(pamrs.Case.from_arrays(RIG, tables, sample_time=0.005))


def test_dates_begin_with_the_first_that_is_one() -> None:
    dates = pd.date_range("2026-01-01", periods=TIME.size, freq="5ms").to_series()
    frame = pd.DataFrame(ARRAYS | {"time": dates.shift(1).to_numpy()})
    assert alone(frame).sample_time == pytest.approx(0.005)


def test_a_column_that_is_there_twice_is_named() -> None:
    frame = pd.DataFrame(ARRAYS)
    twice = pd.concat([frame, frame[["joint_angle"]]], axis=1)
    with pytest.raises(CaseError, match="recording 'run' has 'joint_angle' twice"):
        alone(twice, sample_time=0.005)
    with pytest.raises(CaseError, match="a Rig is needed"):
        alone(frame, "shoulder", sample_time=0.005)  # type: ignore[arg-type]
