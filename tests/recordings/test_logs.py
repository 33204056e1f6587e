"""Logs of a laboratory: every format, written by its own library, gives the same recording."""

from __future__ import annotations

import importlib.util
import struct
import warnings
import zipfile
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pamrs.errors import MissingPackageError, RecordingError
from pamrs.recordings import load_recording, load_recordings, propose
from pamrs.recordings import logs as logs_package
from pamrs.recordings.logs import TextFormat, _text, read_log
from tests.recordings.written import (
    CHANNELS,
    DT,
    FORMATS,
    SHOULDER,
    UNITS,
    N,
    case_of,
    mapping,
    signals,
    written,
)


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_log_gives_the_same_recording_and_is_proposed(tmp_path: Path, kind: str) -> None:
    data = signals()
    file, pattern, time = written(tmp_path, kind)
    log = read_log(file)
    for name, unit in UNITS.items():
        series = log.find(pattern.format(name))
        assert len(series.values) == N
        assert series.unit in ("", unit, "°" if unit == "deg" else unit)
    head = "time [s],valve_command [V],muscle_pressure [bar],joint_angle [deg]"
    table = np.column_stack(list(data.values()))
    np.savetxt(tmp_path / "plain.csv", table, "%.6f", ",", header=head, comments="")
    wanted = load_recording(tmp_path / "plain.csv")
    proposal = propose([file], SHOULDER)
    (item,) = proposal.logs
    assert {match.channel: match.series.name for match in item.matches} == {
        channel: pattern.format(name) for channel, name in CHANNELS.items()
    }
    (mapped,) = load_recordings(file, channels=mapping(pattern), time=time)
    (proposed,) = case_of(tmp_path, proposal).recordings
    for got in (mapped, proposed):
        assert got.name == file.name.partition(".")[0]
        assert got.sample_time == wanted.sample_time == DT
        assert len(got) == len(wanted) == N
        assert got.units == wanted.units
        for channel in CHANNELS:
            np.testing.assert_array_equal(got.mask[channel], wanted.mask[channel])
            np.testing.assert_allclose(got.channels[channel], wanted.channels[channel], rtol=1e-12)


def text_log(tmp_path: Path, text: str, **form: Any) -> Any:
    file = tmp_path / "log.txt"
    file.write_text(text, encoding="utf-8")
    return read_log(file, TextFormat(**form))


def test_a_table_without_headings(tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * i:.1f} {i % 7} {i}\n" for i in range(30))
    assert list(text_log(tmp_path, rows).series) == ["column 1", "column 2", "column 3"]
    named = text_log(tmp_path, rows, columns=("t [ms]", "p", "n"))
    assert list(named.series) == ["t", "p", "n"]
    assert named.series["t"].unit == "ms"
    with pytest.raises(RecordingError, match="columns lists 2 names, but there are 3 columns"):
        text_log(tmp_path, rows, columns=("t", "p"))


def test_dates_times_of_day_texts_and_thousands(tmp_path: Path) -> None:
    rows = "".join(
        f"12.05.2024 23:59:{50 + i // 2:02d},{5 * (i % 2)}00;trial {i // 4};1.00{i},5\n"
        if i < 20
        else f"13.05.2024 00:00:{(i - 20) // 2:02d},{5 * (i % 2)}00;trial {i // 4};1.00{i % 10},5\n"
        for i in range(40)
    )
    log = text_log(tmp_path, "when;what;load (N)\n" + rows, thousands=".", decimal=",")
    np.testing.assert_allclose(log.series["when"].values, 0.5 * np.arange(40))
    assert log.series["what"].labels[:2] == ("trial 0", "trial 1")
    assert log.series["load"].unit == "N"
    assert log.series["load"].values[3] == 1003.5
    night = "".join(f"{23 if i < 9 else 0}:{(51 + i) % 60:02d}:00,{i}\n" for i in range(20))
    clock = text_log(tmp_path, "clock,p\n" + night).series["clock"]
    np.testing.assert_allclose(clock.values, 60.0 * np.arange(20))


def test_a_cell_that_is_no_number_is_a_missing_sample_and_told(tmp_path: Path) -> None:
    rows = "".join(f"{i},{'oops' if i == 7 else i}\n" for i in range(40))
    log = text_log(tmp_path, "t,p\n" + rows)
    assert np.flatnonzero(np.isnan(log.find("p").values)).tolist() == [7]
    assert log.remarks == ["p: 1 cell is no number ('oops'): taken as missing, in row 9"]


def test_names_that_are_not_there(tmp_path: Path) -> None:
    file, _, _ = written(tmp_path, "hdf5")
    log = read_log(file)
    assert log.find("p1") is log.series["daq/p1"]
    with pytest.raises(RecordingError, match=r"no channel 'daq/p2'; did you mean 'daq/p1'\?"):
        log.find("daq/p2")


@pytest.mark.parametrize("ending", ["mat", "mf4", "db3", "parquet", "feather"])
def test_broken_files_are_named(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"broken.{ending}"
    file.write_bytes(b"\x00\x01 this is none of these formats " * 20)
    with pytest.raises(RecordingError, match=f"broken.{ending}"):
        read_log(file)


@pytest.mark.parametrize(("name", "words"), [("a.docx", "'.docx'"), (".", "a folder"), ("b", "no")])
def test_what_is_not_read(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "a.docx").write_text("x")
    with pytest.raises(RecordingError, match=words):
        read_log(tmp_path / name)


def test_a_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, pattern, _ = written(tmp_path, "mf4")
    there = importlib.util.find_spec
    monkeypatch.setattr(
        logs_package, "find_spec", lambda name: None if name == "asammdf" else there(name)
    )
    with pytest.raises(MissingPackageError, match=r"asammdf.*pip install 'pamrs\[logs\]'"):
        load_recordings(file, channels=mapping(pattern))


def test_objects_in_numpy_files_are_not_executed(tmp_path: Path) -> None:
    np.save(tmp_path / "x.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(RecordingError, match="allow_pickle"):
        read_log(tmp_path / "x.npy")


def test_points_that_part_thousands_are_seen_where_nothing_else_is_possible(tmp_path: Path) -> None:
    rows = "".join(f"{i // 10}.{i % 10}00.000;{i % 7}.125\n" for i in range(40))
    log = text_log(tmp_path, rows)
    np.testing.assert_array_equal(log.series["column 1"].values, 1e5 * np.arange(40))
    np.testing.assert_array_equal(log.series["column 2"].values, np.arange(40) % 7 + 0.125)


def test_a_text_that_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no table was found"):
        text_log(tmp_path, '{"ob": [[0.1, 0.2, 0.3], [0.1, 0.2, 0.3]], "action": [0.1, 0.2]}')


def test_several_groups_of_an_mdf_have_their_clocks_and_invalid_samples(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    slow = np.arange(20) * 0.5
    bad = np.zeros(20, dtype=bool)
    bad[3] = True
    with MDF() as file:
        file.append([Signal(np.arange(100.0), np.arange(100) * 0.1, name="p1", unit="bar")])
        warm = Signal(20.0 + slow, slow, name="T", unit="degC", invalidation_bits=bad)
        file.append([warm, Signal(slow, slow, name="p1", unit="bar")])
        file.save(tmp_path / "run.mf4", overwrite=True)
    log = read_log(tmp_path / "run.mf4")
    assert [name.split("/")[-1] for name in log.series] == ["p1", "T", "p1"]
    temperature = log.find("T")
    assert temperature.unit == "degC"
    assert np.flatnonzero(np.isnan(temperature.values)).tolist() == [3]
    assert temperature.time is not None
    np.testing.assert_allclose(temperature.time, slow)
    with pytest.raises(RecordingError, match="may be any of"):
        log.find("p1")


def test_topics_at_their_own_rates_and_stamps_of_their_own(tmp_path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    number, text = kinds["std_msgs/msg/Float64"], kinds["std_msgs/msg/String"]
    wrench, vector = kinds["geometry_msgs/msg/WrenchStamped"], kinds["geometry_msgs/msg/Vector3"]
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    with Writer(tmp_path / "bag", version=9) as writer:
        made = {
            kind: writer.add_connection(topic, kind.__msgtype__, typestore=store)
            for topic, kind in (("/p", number), ("/note", text), ("/cell", wrench))
        }

        def write(now: int, message: Any) -> None:
            raw = store.serialize_cdr(message, message.__msgtype__)
            writer.write(made[type(message)], now, raw)

        for step in range(100):
            now = 10**18 + step * 10**7
            write(now, number(2.0))
            if step % 5 == 0:
                sent = now - (2 + 12 * (step % 2)) * 10**6
                head = header(stamp(sent // 10**9, sent % 10**9), "cell")
                pull, none = vector(0.0, 0.0, float(step)), vector(0.0, 0.0, 0.0)
                write(now, wrench(head, kinds["geometry_msgs/msg/Wrench"](pull, none)))
        write(10**18, text("start"))
    for path in (tmp_path / "bag", tmp_path / "bag" / "bag.db3"):
        log = read_log(path)
        force = log.find("/cell/wrench/force/z")
        assert force.time is not None
        sent = 0.05 * np.arange(20) - 2e-3 - 12e-3 * (np.arange(20) % 2)
        np.testing.assert_allclose(force.time, sent - sent[0], atol=1e-12)
        np.testing.assert_allclose(force.values, 5.0 * np.arange(20))
        stamps = log.find("/cell/header/stamp").values
        np.testing.assert_allclose(stamps, 1e9 + sent, rtol=0, atol=3e-7)
        arrival = log.find("/cell/arrival").values
        np.testing.assert_allclose(arrival, 0.05 * np.arange(20) + 2e-3, atol=1e-12)
        assert "/cell: times are the stamps of its messages" in log.remarks[0]
        assert "arrived 8 ms later in the middle (2 to 14 ms)" in log.remarks[0]
        assert log.remarks[1:] == ["/p: no stamps, times are those of arrival"]
        assert len(log.find("/p/data").values) == 100


def save_to_mat(path: Path, content: dict[str, Any]) -> None:
    """By mat-io, whose import sets an option that pandas no longer needs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        from matio import save_to_mat
    save_to_mat(str(path), content)


def test_signals_that_simulink_logs_in_a_dataset(tmp_path: Path) -> None:
    opaque = pytest.importorskip("matio.utils.matclass").MatlabOpaque
    time = np.arange(30.0)[:, None] * 0.1
    elements = np.empty((1, 2), dtype=object)
    for place, name in enumerate(("p1", "angle")):
        own = {"Data_": (place + 1.0) * time, "Time_": time, "Name": np.array([name])}
        signal = {"Name": np.array([name]), "Values": opaque(own, "timeseries", "MCOS")}
        elements[0, place] = opaque(signal, "Simulink.SimulationData.Signal", "MCOS")
    dataset = opaque({"Elements": elements}, "Simulink.SimulationData.Dataset", "MCOS")
    save_to_mat(tmp_path / "run.mat", {"logsout": dataset})
    log = read_log(tmp_path / "run.mat")
    assert list(log.series) == ["logsout/p1", "logsout/angle"]
    series = log.find("p1")
    np.testing.assert_allclose(series.values, time.ravel())
    assert series.time is not None


def test_tables_of_pandas_with_dates(tmp_path: Path) -> None:
    import pandas as pd

    when = pd.date_range("2024-05-12", periods=30, freq="20ms")
    column = {"when": when, "p1 [bar]": np.arange(30.0), "what": ["a"] * 10 + ["b"] * 20}
    frame = pd.DataFrame(column)
    for ending in ("parquet", "feather"):
        getattr(frame, f"to_{ending}")(tmp_path / f"run.{ending}")
        log = read_log(tmp_path / f"run.{ending}")
        np.testing.assert_allclose(log.find("when").values, 0.02 * np.arange(30))
        assert (log.find("when").unit, log.find("p1").unit) == ("s", "bar")
        assert log.find("what").labels == ("a", "b")
        frame.set_index("when").to_parquet(tmp_path / "indexed.parquet")
    assert "when" in read_log(tmp_path / "indexed.parquet").series


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.one_of(st.binary(max_size=300), st.text(max_size=300).map(str.encode)))
@pytest.mark.parametrize("ending", ["csv", "npy", "npz", "mcap", "tdms", "h5", "xlsx", "xls"])
def test_any_bytes_are_a_log_or_an_error_that_names_the_file(
    tmp_path: Path, ending: str, data: bytes
) -> None:
    file = tmp_path / f"any.{ending}"
    file.write_bytes(data)
    try:
        told = str(read_log(file).path)
    except RecordingError as error:
        told = str(error)
    assert f"any.{ending}" in told


def test_tables_and_timetables_of_matlab(tmp_path: Path) -> None:
    import pandas as pd

    frame = pd.DataFrame({"p1": np.arange(30.0), "angle": np.arange(30.0)[::-1]})
    steps = np.arange(30).astype("timedelta64[s]")
    timed = frame.set_index(pd.TimedeltaIndex(steps))
    save_to_mat(tmp_path / "run.mat", {"lift": frame, "timed": timed})
    log = read_log(tmp_path / "run.mat")
    np.testing.assert_array_equal(log.find("lift/p1").values, np.arange(30.0))
    time = log.find("timed/p1").time
    assert time is not None
    np.testing.assert_allclose(time, np.arange(30))


def test_older_files_of_asam_that_are_called_dat(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="3.30") as file:
        file.append([Signal(np.arange(50.0), np.arange(50) * 0.1, name="p1", unit="bar")])
        saved = Path(file.save(tmp_path / "run.mdf", overwrite=True))
    saved.rename(tmp_path / "run.dat")
    series = read_log(tmp_path / "run.dat").find("p1")
    assert series.unit == "bar"
    np.testing.assert_array_equal(series.values, np.arange(50.0))
    rows = "".join(f"{0.1 * i:.1f} {i}\n" for i in range(30))
    (tmp_path / "text.dat").write_text(rows, encoding="utf-8")
    assert len(read_log(tmp_path / "text.dat").series) == 2


@pytest.mark.parametrize("kind", ["xlsx", "xls"])
def test_sheets_with_cells_far_out_are_refused_before_they_are_read(
    tmp_path: Path, kind: str
) -> None:
    """Their range is laid out cell by cell, so that one far cell would take all memory."""
    file, _, _ = written(tmp_path, kind)
    data = file.read_bytes()
    if kind == "xls":
        last, far = (struct.pack("<HHHH", 0x203, 14, *at) for at in ((402, 3), (65535, 65535)))
        assert data.count(last) == 1
        file.write_bytes(data.replace(last, far))
    else:
        made = tmp_path / "far.xlsx"
        with zipfile.ZipFile(file) as old, zipfile.ZipFile(made, "w") as new:
            for item in old.infolist():
                text = old.read(item).replace(b'r="D403"', b'r="XFD1048576"')
                new.writestr(item.filename, text)
        file = made
    with pytest.raises(RecordingError, match=r"about \d+ cells; at most"):
        read_log(file)


def test_sheets_with_dates_texts_and_several_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    when = datetime(2022, 11, 22, 10, 16, 51)
    rows = [["Zeit", "Druck [bar]"]]
    rows += [[when + timedelta(seconds=0.5 * i), f"{i},5"] for i in range(40)]
    other = [["t [s]", "x [mm]"], *([i, 2.0 * i] for i in range(40))]
    cells = {"a": rows, "b": other, "notes": [["stand 3"]]}
    monkeypatch.setattr(_text, "_sheets", lambda path: cells)
    log = _text.read_sheets(tmp_path / "run.xlsx", TextFormat())
    assert list(log.series) == ["a/Zeit", "a/Druck", "b/t", "b/x"]
    np.testing.assert_allclose(log.find("Zeit").values, 0.5 * np.arange(40))
    np.testing.assert_allclose(log.find("Druck").values, np.arange(40) + 0.5)
    assert log.remarks == ["a/numbers that are texts with a decimal comma: 40, read"]
    assert "no table was found" in log.unread["sheet notes"]
