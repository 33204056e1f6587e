"""Recordings: what is read, what is refused, what is masked and what is left alone."""

from __future__ import annotations

import gzip
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pamrs.errors import PamrsError, RecordingError
from pamrs.recordings import CHANNELS, Recording, load_recording, load_recordings
from pamrs.recordings._recording import find_faults
from pamrs.recordings.table import TEXT

Array = NDArray[np.float64]
N = 4000
DT = 0.005
LSB = {"supply_pressure": 42.0, "muscle_pressure": 42.0, "joint_angle": 0.011}
HEADER = "time [s],valve_command [V],supply_pressure [Pa],muscle_pressure [Pa],joint_angle [deg]"
SENSORS = tuple(LSB)


def lively(seed: int = 3) -> dict[str, Array]:
    """Quantised, noisy channels with ramps, holds and a rest at the stop."""
    rng = np.random.default_rng(seed)
    time = np.arange(N) * DT
    shape = np.interp(time, [0, 1, 4, 7, 9, 13, 16, 20], [0, 0, 1, 1, 0.4, 0.4, 0.9, 0])
    clean = {
        "supply_pressure": 13.6e5 - 6e4 * time / time[-1] - 2e4 * shape,
        "muscle_pressure": 2.8e5 * shape,
        "joint_angle": 15.0 + 80.0 * shape**1.5,
    }
    noise = {"supply_pressure": 600.0, "muscle_pressure": 500.0, "joint_angle": 0.012}
    data = {"time": time, "valve_command": np.round(5.0 + 0.4 * np.gradient(shape, time), 4)}
    for name, values in clean.items():
        data[name] = np.round((values + rng.normal(0.0, noise[name], N)) / LSB[name]) * LSB[name]
    return data


def text(data: dict[str, Array], header: str = HEADER, rows: Any = slice(None)) -> str:
    table = np.column_stack([data[name] for name in ("time", "valve_command", *SENSORS)])[rows]
    lines = [f"{t:.4f},{u:.4f},{s:.1f},{m:.1f},{a:.4f}" for t, u, s, m, a in table]
    return "\n".join([header, *lines]) + "\n"


def load(tmp_path: Path, content: str | dict[str, Array], **options: Any) -> Recording:
    file = tmp_path / "run.csv"
    file.write_text(content if isinstance(content, str) else text(content), encoding="utf-8")
    return load_recording(file, **options)


def refused(tmp_path: Path, content: str, **options: Any) -> str:
    with pytest.raises(RecordingError) as caught:
        load(tmp_path, content, **options)
    assert "run.csv" in str(caught.value)
    return str(caught.value)


def kinds(recording: Recording, channel: str | None = None) -> set[str]:
    return {issue.kind for issue in recording.issues if channel in (None, issue.channel)}


# ------------------------------------------------------------------------- reading


def test_clean_recording_in_si(tmp_path: Path) -> None:
    data = lively()
    recording = load(tmp_path, data, role="held_out")
    assert (recording.name, recording.role, len(recording)) == ("run", "held_out", N)
    assert recording.sample_time == DT
    assert recording.issues == []
    assert recording.valid().all()
    np.testing.assert_allclose(recording.time, np.arange(N) * DT, rtol=0, atol=1e-12)
    found = recording.channels
    np.testing.assert_allclose(found["joint_angle"], np.radians(data["joint_angle"]), atol=2e-6)
    np.testing.assert_allclose(found["muscle_pressure"], data["muscle_pressure"], atol=0.1)
    assert recording.units["joint_angle"] == "rad"
    assert recording.duration == pytest.approx((N - 1) * DT)
    assert "run" in repr(recording)


def test_time_starts_at_zero(tmp_path: Path) -> None:
    data = lively()
    data["time"] = data["time"] + 1234.5
    recording = load(tmp_path, data)
    assert recording.time[0] == 0.0
    assert len(recording) == N
    assert recording.issues == []


def test_columns_without_header_thousands_and_semicolons(tmp_path: Path) -> None:
    stamps = [f"{i * 100_000:,}".replace(",", ".") for i in range(1200)]
    content = "".join(f"{stamp};3.{i % 3};7.6{i % 4}\r\n" for i, stamp in enumerate(stamps))
    form = {"header": False, "delimiter": ";", "thousands": {"time": "."}}
    columns = ["time [us]", "", "muscle_pressure [bar]"]
    recording = load(tmp_path, content, columns=columns, **form)
    assert list(recording.channels) == ["muscle_pressure"]
    assert recording.sample_time == pytest.approx(0.1)
    assert len(recording) == 1200
    assert recording.channels["muscle_pressure"][1] == pytest.approx(7.61e5)


def test_decimal_comma_and_renamed_columns(tmp_path: Path) -> None:
    content = "t;p;junk\n" + "".join(
        f"{i / 10:.1f};{i / 5:.1f};x\n".replace(".", ",") for i in range(30)
    )
    names = {"t": "time [s]", "p": "muscle_pressure [bar]", "junk": ""}
    recording = load(tmp_path, content, columns=names, delimiter=";", decimal=",")
    assert recording.channels["muscle_pressure"][5] == pytest.approx(1e5)


def test_rows_without_a_clock(tmp_path: Path) -> None:
    content = "muscle_pressure [bar]\n" + "".join(f"{i % 9}\n" for i in range(50))
    assert load(tmp_path, content, sample_time=0.02).time[-1] == pytest.approx(0.98)
    assert "'time' is missing" in refused(tmp_path, content)


def test_blank_separated(tmp_path: Path) -> None:
    content = "".join(f"  {i * 10}   {i % 5}.5 \n" for i in range(50))
    columns = ["time [ms]", "force [N]"]
    recording = load(tmp_path, content, columns=columns, header=False, delimiter=" ")
    assert recording.channels["force"][1] == 1.5


def test_reference_may_be_an_angle_or_a_pressure(tmp_path: Path) -> None:
    rows = "".join(f"{i},{i},1\n" for i in range(30))
    header = "time [s],muscle_pressure [bar],reference "
    assert load(tmp_path, f"{header}[bar]\n{rows}").units["reference"] == "Pa"
    assert load(tmp_path, f"{header}[deg]\n{rows}").units["reference"] == "rad"
    assert "reference [V]" in refused(tmp_path, f"{header}[V]\n{rows}")


def test_valid_names_what_is_missing(tmp_path: Path) -> None:
    recording = load(tmp_path, lively())
    with pytest.raises(RecordingError, match="'force'"):
        recording.valid("force")
    assert recording.segments("joint_angle") == [(0, N)]
    assert recording.segments(minimum=N + 1) == []


# ----------------------------------------------------------------------- refusing

ROWS = "0,1\n1,2\n2,3\n"
BAD = [
    ("", {}, ["empty"]),
    ("\n\n  \n", {}, ["empty"]),
    ("time [s],muscle_pressure [bar]\n", {}, ["header without rows"]),
    ("time [s],muscle_pressure [bar]\n0,1\n", {}, ["one row"]),
    ("time [s],muscle_pressure [bar]\n1,1\n1,2\n", {}, ["'time'", "different times"]),
    ("time [s],muscle_pressure [bar]\nnan,1\n,2\n", {}, ["'time'", "no value"]),
    ("time [s],muscle_pressure\n" + ROWS, {}, ["'muscle_pressure'", "no unit", "[Pa]"]),
    ("time [s],muscle_pressure []\n" + ROWS, {}, ["muscle_pressure []", "no unit"]),
    ("time,muscle_pressure [bar]\n" + ROWS, {}, ["'time'", "no unit"]),
    ("time [s],muscle_pressure [V]\n" + ROWS, {}, ["[V]", "wrong dimension", "'Pa'"]),
    ("time [s],muscle_pressure [Bar]\n" + ROWS, {}, ["muscle_pressure [Bar]", "'bar'"]),
    ("time [s],joint_angle [bar]\n" + ROWS, {}, ["joint_angle [bar]", "'rad'"]),
    ("time [s],muscle_presure [bar]\n" + ROWS, {}, ["'muscle_presure [bar]'", "'muscle_pressure'"]),
    ("time [s],zeppelin [bar]\n" + ROWS, {}, ["'zeppelin [bar]'", "valve_command"]),
    ("time [s],force [N],force [N]\n0,1,1\n1,2,2\n", {}, ["'force'", "twice"]),
    ("time [s],force [N]]\n" + ROWS, {}, ["force [N]]"]),
    ("time [s]\n0\n1\n", {}, ["no channel"]),
    ("time [s],force [N]\n0,1\n1,abc\n", {}, ["force [N]", "row 3", "'abc'"]),
    ("time [s],force [N]\n0,1\n1.000.000,2\n", {}, ["time [s]", "row 3", "thousands"]),
    ("time [s];force [N]\n0;1\n1;2,5\n", {"delimiter": ";"}, ["force [N]", "decimal"]),
    ("time [s];force [N]\n0;1\n1;2\n", {}, ["time [s];force [N]"]),
    ("time [s],force [N]\n" + "0,1,2\n" * 9, {}, ["2 cells", "row 2"]),
    ("time [s],force [N]\n" + ROWS, {"columns": ["time [s]"]}, ["1 headings", "2 columns"]),
    ("time [s],force [N]\n" + ROWS, {"columns": {"torque": "force [N]"}}, ["'torque'", "force"]),
    ("time [s],force [N]\n" + ROWS, {"columns": "force [N]"}, ["columns"]),
    (ROWS, {"header": False}, ["columns must list"]),
    ("time [s],force [N]\n" + ROWS, {"role": "test"}, ["'test'", "'held_out'"]),
    ("time [s],force [N]\n" + ROWS, {"sample_time": 0.0}, ["sample_time"]),
    ("time [s],force [N]\n" + ROWS, {"sample_time": math.nan}, ["sample_time"]),
    ("time [s],force [N]\n" + ROWS, {"delimiter": ""}, ["delimiter"]),
    ("time [s],force [N]\n" + ROWS, {"decimal": "x"}, ["decimal = 'x' is not allowed"]),
    ("", {"decimal": ",", "thousands": ","}, ["it is the decimal mark"]),
    ('"time [s],force [N]\n' + ROWS * 20000, {}, ["a quote that is opened"]),
    ("time [s],force [N]\n" + ROWS, {"thousands": {"torque": "."}}, ["'torque'"]),
]


@pytest.mark.parametrize(("content", "options", "wanted"), BAD)
def test_mistakes_name_file_and_column(
    tmp_path: Path, content: str, options: dict[str, Any], wanted: list[str]
) -> None:
    message = refused(tmp_path, content, **options)
    assert all(words in message for words in wanted), message


def test_all_bad_columns_at_once(tmp_path: Path) -> None:
    message = refused(tmp_path, "time [s],force,length [V],zeppelin [m]\n0,1,2,3\n1,2,3,4\n")
    assert "3 problems" in message
    assert all(words in message for words in ("'force'", "length [V]", "zeppelin"))


@pytest.mark.parametrize(
    ("heading", "value", "likely"),
    [
        ("temperature [K]", 21.0, "said to be in K, .* read as degC it is 21.* degC"),
        ("temperature [degC]", 3000.0, "right column and unit"),  # nothing fits
        ("muscle_pressure [bar]", 3e5, "said to be in bar, .* read as Pa it reaches 3"),
    ],
)
def test_impossible_values_name_the_unit_that_fits(
    tmp_path: Path, heading: str, value: float, likely: str
) -> None:
    rows = "".join(f"{0.01 * k:.2f},{value * (1 + 1e-4 * k)}\n" for k in range(100))
    assert re.search(f"not possible.*{likely}", refused(tmp_path, f"time [s],{heading}\n{rows}"))
    name, _, unit = heading.partition(" [")
    channels = {name: {"column": name, "unit": unit[:-1]}}
    with pytest.raises(RecordingError, match=f"not possible.*{likely}"):
        load_recordings(tmp_path / "run.csv", channels=channels, time="time")


def test_swapped_columns_are_seen_by_impossible_values(tmp_path: Path) -> None:
    data = lively()
    data["muscle_pressure"], data["joint_angle"] = data["joint_angle"], data["muscle_pressure"]
    assert "'joint_angle'" in refused(tmp_path, text(data))
    content = "time [s],muscle_pressure [bar]\n" + "".join(f"{i},{-5 - i}\n" for i in range(50))
    assert "'muscle_pressure'" in refused(tmp_path, content)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"absent\.csv"):
        load_recording(tmp_path / "absent.csv")
    with pytest.raises(RecordingError, match="folder"):
        load_recording(tmp_path)
    for name, content in [
        ("a.csv", b"\xff\xfe\x00\x01\x80"),
        ("zero.csv", b"time [s]\x00,"),
        ("broken.csv.gz", b"no gzip at all"),
        ("cut.csv.gz", gzip.compress(b"time [s],force [N]\n0,1\n" * 50)[:30]),
    ]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(RecordingError, match=name):
            load_recording(tmp_path / name)


def test_a_column_of_a_table_of_numbers_is_named(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame({"time [s]": [0.0, 0.1], "force [N]": ["1", "much"]})
    frame.to_parquet(tmp_path / "made.parquet")
    message = r"made\.parquet: column 'force \[N\]', row 3: 'much' is"
    with pytest.raises(RecordingError, match=message):
        load_recording(tmp_path / "made.parquet")


def test_the_help_names_every_ending_that_is_read() -> None:
    endings = filter(None, (*TEXT, ".parquet"))
    assert all(f"``{ending}``" in load_recording.__doc__ for ending in endings)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet='time [s],force[N]\n0123456789.-e naifx"', max_size=120), st.booleans())
def test_any_text_is_read_or_refused(tmp_path: Path, content: str, headed: bool) -> None:
    if headed:
        content = "time [s],force [N]\n" + content
    try:
        recording = load(tmp_path, content)
    except PamrsError:
        return
    for name, values in recording.channels.items():
        assert np.array_equal(np.isfinite(values), recording.mask[name])


# ---------------------------------------------------------------------- the clock


def test_two_samples_only(tmp_path: Path) -> None:
    recording = load(tmp_path, "time [s],muscle_pressure [bar]\n0,1\n0.5,2\n")
    assert len(recording) == 2
    assert recording.valid().all()
    assert kinds(recording) == {"short"}


def test_nan_rows_are_masked_and_not_bridged(tmp_path: Path) -> None:
    data = lively()
    data["muscle_pressure"][100:140] = np.nan
    data["joint_angle"][50] = np.inf
    recording = load(tmp_path, data)
    assert np.flatnonzero(~recording.mask["muscle_pressure"]).tolist() == list(range(100, 140))
    assert np.isnan(recording.channels["muscle_pressure"][100:140]).all()
    assert recording.mask["supply_pressure"].all()
    issue = next(issue for issue in recording.issues if issue.channel == "muscle_pressure")
    assert issue.kind == "nan"
    assert [issue.start, issue.stop] == pytest.approx([0.5, 0.695])
    assert kinds(recording, "joint_angle") == {"nan"}
    assert recording.segments("muscle_pressure", minimum=200) == [(140, N)]


def test_missing_samples_leave_masked_holes(tmp_path: Path) -> None:
    data = lively()
    keep = np.random.default_rng(1).random(N) > 0.3
    keep[[0, -1]] = True
    recording = load(tmp_path, text(data, rows=keep))
    assert len(recording) == N
    assert recording.sample_time == pytest.approx(DT)
    assert np.array_equal(recording.valid(), keep)
    kept = recording.channels["muscle_pressure"][keep]
    np.testing.assert_allclose(kept, data["muscle_pressure"][keep], atol=0.1)
    (gap,) = [issue for issue in recording.issues if issue.kind == "gap"]
    assert "30 %" in gap.text or "29 %" in gap.text


def test_one_gap_is_told_with_its_times(tmp_path: Path) -> None:
    keep = np.ones(N, dtype=bool)
    keep[1000:1100] = False
    recording = load(tmp_path, text(lively(), rows=keep))
    (issue,) = recording.issues
    assert (issue.kind, issue.channel) == ("gap", "time")
    assert [issue.start, issue.stop] == pytest.approx([4.995, 5.5])
    assert np.array_equal(recording.valid(), keep)


def jumping(tmp_path: Path, by: float) -> tuple[dict[str, Array], Recording]:
    """A recording whose clock jumps in the middle."""
    data = lively()
    data["time"] = np.where(np.arange(N) < 2000, data["time"], data["time"] + by)
    return data, load(tmp_path, data)


def test_clock_jumping_back(tmp_path: Path) -> None:
    data, recording = jumping(tmp_path, -3.0)
    (issue,) = recording.issues
    assert issue.kind == "clock_jump"
    assert "back by 2.995 s" in issue.text
    assert recording.segments() == [(0, 2000), (2010, N + 10)]
    measured = recording.channels["muscle_pressure"][recording.valid()]
    np.testing.assert_allclose(measured, data["muscle_pressure"], atol=0.1)


def test_clock_jumping_forward(tmp_path: Path) -> None:
    _, far = jumping(tmp_path, 1e6)
    assert kinds(far) == {"clock_jump"}
    assert len(far) == N + 10
    assert "forward" in far.issues[0].text
    _, hole = jumping(tmp_path, 2.0)  # a little
    assert kinds(hole) == {"gap"}
    assert not hole.valid()[2000:2399].any()


def test_jitter_is_interpolated_between_neighbours(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    stamps = np.arange(900) * 0.1 + rng.uniform(-0.02, 0.02, 900)
    stamps[0] = 0.0
    lines = [f"{t:.4f},{200.0 * t:.4f}" for t in stamps]
    recording = load(tmp_path, "\n".join(["time [s],force [N]", *lines]))
    assert recording.sample_time == pytest.approx(0.1, rel=1e-3)
    assert recording.valid().mean() > 0.99
    used = recording.valid()
    error = recording.channels["force"][used] - 200.0 * recording.time[used]
    assert np.max(np.abs(error)) < 200.0 * 0.1 * 0.06


def test_a_given_sample_time_sets_the_grid(tmp_path: Path) -> None:
    recording = load(tmp_path, lively(), sample_time=0.01)
    assert recording.sample_time == 0.01
    assert len(recording) == N // 2
    assert recording.valid().all()


# ------------------------------------------------------------------------- faults


@pytest.mark.parametrize("channel", SENSORS)
@pytest.mark.parametrize(("start", "length"), [(700, 300), (1600, 300), (N - 300, 300)])
def test_frozen_sensors_are_masked(tmp_path: Path, channel: str, start: int, length: int) -> None:
    data = lively()
    data[channel][start : start + length] = data[channel][start]
    recording = load(tmp_path, data)
    assert kinds(recording) == {"frozen"}
    assert not recording.mask[channel][start : start + length].any()
    assert recording.mask[channel].sum() >= N - length - 4
    issue = recording.issues[0]
    assert issue.channel == channel
    assert issue.start == pytest.approx(start * DT, abs=3 * DT)


def test_a_command_may_stand_still(tmp_path: Path) -> None:
    data = lively()
    data["valve_command"][500:2500] = 5.0012
    data["valve_command"][2600:2700] = 10.0
    assert load(tmp_path, data).issues == []


@pytest.mark.parametrize("channel", ["muscle_pressure", "supply_pressure"])
def test_saturated_transducers_are_masked(tmp_path: Path, channel: str) -> None:
    data = lively()
    limit = np.round(np.quantile(data[channel], 0.8) / LSB[channel]) * LSB[channel]
    clipped = data[channel] > limit
    data[channel] = np.minimum(data[channel], limit)
    recording = load(tmp_path, data)
    assert kinds(recording) == {"saturated"}
    assert recording.mask[channel][clipped].mean() < 0.1


def test_saturation_without_noise(tmp_path: Path) -> None:
    data = lively()
    data["muscle_pressure"] = np.minimum(np.round(2e5 * (1 - np.cos(data["time"])) / 42) * 42, 3e5)
    recording = load(tmp_path, data)
    assert kinds(recording) == {"saturated"}


def test_spikes_are_masked(tmp_path: Path) -> None:
    data = lively()
    for channel, size in (("muscle_pressure", 8e4), ("joint_angle", -9.0)):
        data[channel][[333, 2222]] += size
    recording = load(tmp_path, data)
    assert kinds(recording) == {"outlier"}
    for channel in ("muscle_pressure", "joint_angle"):
        assert np.flatnonzero(~recording.mask[channel]).tolist() == [333, 2222]


def test_constant_channels_are_told(tmp_path: Path) -> None:
    data = lively()
    data["muscle_pressure"][:] = 1e5
    data["joint_angle"][:] = 30.0
    recording = load(tmp_path, data)
    assert kinds(recording) == {"constant"}
    assert not recording.mask["muscle_pressure"].any()
    assert recording.mask["joint_angle"].all()


def test_ordinary_rest_is_no_fault() -> None:
    """An encoder against its stop, a dry joint in mid-travel, a vented muscle cut off at zero,
    ideal data.
    """
    data = lively()
    time = data["time"]
    ideal = np.round(1e5 * np.clip(np.sin(time), 0.0, 1.0), 1)
    encoder = np.round(np.interp(time, [0, 3, 5, 9, 12, 20], [0, 0, 1, 1, 0.3, 0.3]) * 500) * 0.2
    assert find_faults("joint_angle", encoder) == []
    assert find_faults("muscle_pressure", np.maximum(data["muscle_pressure"], 0.0)) == []
    assert find_faults("muscle_pressure", ideal) == []
    assert find_faults("joint_angle", np.maximum(data["joint_angle"], 15.2)) == []
    for channel in SENSORS:
        coarse = np.round(data[channel] / (40 * LSB[channel])) * 40 * LSB[channel]
        assert find_faults(channel, coarse) == []
        assert find_faults(channel, np.repeat(data[channel][::50], 50)) == []


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("thin", [1, 4, 20])
def test_no_false_alarms_on_sound_channels(seed: int, thin: int) -> None:
    data = lively(seed)
    for channel in SENSORS:
        assert find_faults(channel, data[channel][::thin]) == []


def test_every_canonical_channel_is_read(tmp_path: Path) -> None:
    header = ",".join(f"{name} [{channel.unit}]" for name, channel in CHANNELS.items())
    values = {"V": "5", "Pa": "100{}", "K": "300", "ambient_pressure": "100{}00"}
    cells = [
        values.get(name, values.get(channel.unit, "0.5"))
        for name, channel in CHANNELS.items()
        if name != "time"
    ]
    rows = [",".join([str(i), *(cell.format(i * 7 % 11) for cell in cells)]) for i in range(9)]
    recording = load(tmp_path, "\n".join([header, *rows]))
    assert ["time", *recording.channels] == list(CHANNELS)


# ------------------------------------------------------- numbers as they are written


def test_a_decimal_comma_between_commas_is_no_number(tmp_path: Path) -> None:
    """Two columns once became one, which stood in both: 1 bar was read as 10 kPa."""
    rows = "".join(f"{k},{1 + k % 3}\n" for k in range(40))
    read = load(tmp_path, f"time [s],muscle_pressure [bar]\n{rows}", decimal=",")
    assert np.allclose(read.channels["muscle_pressure"][:3], [1e5, 2e5, 3e5])


def test_points_beside_a_decimal_comma_are_asked(tmp_path: Path) -> None:
    content = "time [s];muscle_pressure [kPa]\n0,0;980\n1,0;1.520\n2,0;990\n"
    form = {"delimiter": ";", "decimal": ","}
    assert "'1.520' has a point and decimal is ','" in refused(tmp_path, content, **form)
    read = load(tmp_path, content, **form, thousands={"muscle_pressure": "."})
    assert np.allclose(read.channels["muscle_pressure"], [980e3, 1520e3, 990e3])


def test_an_underscore_is_no_part_of_a_number(tmp_path: Path) -> None:
    rows = "".join(f"{k},{'1_0' if k == 7 else 2 + k % 3}\n" for k in range(40))
    read = load(tmp_path, f"time [s],muscle_pressure [bar]\n{rows}")
    assert np.flatnonzero(~read.mask["muscle_pressure"]).tolist() == [7]


def test_series_of_another_length_are_said(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    units = {"time": "s", "muscle_pressure": "bar", "joint_angle": "deg", "temperature": "K"}
    with h5py.File(tmp_path / "run.h5", "w") as store:
        for name, unit in units.items():
            store[name] = np.arange(10.0 if unit == "K" else 100.0)
            store[name].attrs["unit"] = unit
    said = [issue.text for issue in load_recording(tmp_path / "run.h5").issues]
    assert any("'temperature': not 100 values" in text for text in said)
