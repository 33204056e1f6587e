"""From a log to channels: units, lines through two readings, clocks, events, parts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.errors import CaseError, MissingPackageError, RecordingError
from pamrs.recordings import Recording, _gate, load_case, load_recordings
from pamrs.recordings import logs as logs_package
from tests.recordings.written import DT, N, case_of, mapping, npz, signals, written
from tests.tables import rows_of

P1 = {"column": "p1", "unit": "bar"}
BASE = {"muscle_pressure": P1}
ANGLE = {"column": "angle", "unit": "deg"}
APART = BASE | {"joint_angle": ANGLE | {"time": "ta"}}


def one(file: Path, **options: Any) -> Recording:
    """The only recording of a log."""
    (got,) = load_recordings(file, **{"channels": BASE, "time": "t"} | options)
    return got


def test_counts_scales_signs_and_absolute_pressures(tmp_path: Path) -> None:
    data = signals()
    series = {"adc": np.round(data["p1"] / 10.0 * 4095), "enc": -data["angle"] * 100}
    file = npz(tmp_path, t=data["t"] * 1e3, **series, abs=data["p1"] + 1.0)
    flexor = {"column": "adc", "unit": "bar", "from": [0, 4095], "to": [0, 10]}
    channels = {
        "muscle_pressure.flexor": flexor,
        "joint_angle": {"column": "enc", "unit": "deg", "scale": -0.01, "offset": 5},
        "muscle_pressure": {"extensor": {"column": "abs", "unit": "bar", "offset": -1.0}},
    }
    got = one(file, channels=channels, time={"column": "t", "unit": "ms"})
    assert got.sample_time == DT
    wanted = data["p1"] * 1e5
    assert np.abs(got.channels["muscle_pressure.flexor"] - wanted).max() < 0.51 * 10e5 / 4095
    np.testing.assert_allclose(got.channels["muscle_pressure.extensor"], wanted, atol=1e-6)
    np.testing.assert_allclose(got.channels["joint_angle"], np.radians(data["angle"] + 5))


def test_a_table_is_straight_between_its_points_and_goes_on_beyond(tmp_path: Path) -> None:
    raw = np.linspace(-0.5, 5.0, 61)
    file = npz(tmp_path, t=np.arange(61) * DT, adc=raw)
    want = np.interp(raw, [0, 1, 4], [0, 2, 3])
    want += np.minimum(raw, 0) * 2 + np.maximum(raw - 4, 0) / 3
    for given, stand_for in (([0, 1, 4], [0, 2, 3]), ([4, 1, 0], [3, 2, 0])):
        entry = {"column": "adc", "unit": "bar", "from": given, "to": stand_for}
        got = one(file, channels={"muscle_pressure": entry})
        np.testing.assert_allclose(got.channels["muscle_pressure"], 1e5 * want, atol=1e-6)


@pytest.mark.parametrize("clocks", [1, 2])
def test_a_channel_that_had_one_value_all_the_time(tmp_path: Path, clocks: int) -> None:
    data = signals()
    file = npz(tmp_path, t=data["t"], p1=data["p1"], t2=data["t"] + 0.002, f=data["angle"])
    channels = {
        "muscle_pressure": {"column": "p1", "unit": "bar(a)"},
        "length": {"value": 0.25, "unit": "m"},
        "ambient_pressure": {"value": 950, "unit": "hPa"},
        "force": {"column": "f", "unit": "N", "time": "t" if clocks == 1 else "t2"},
    }
    got = one(file, channels=channels, start=1.0, stop=2.0)
    assert set(got.channels["length"].tolist()) == {0.25}
    assert got.valid("length").all()
    assert len(got.channels["length"]) == len(got)
    assert not [issue for issue in got.issues if issue.channel == "length"]
    assert got.units["length"] == "m"
    gauge = one(file, start=1.0, stop=2.0)
    count = min(len(got), len(gauge))
    apart = gauge.channels["muscle_pressure"][:count] - got.channels["muscle_pressure"][:count]
    np.testing.assert_allclose(apart, 95e3, atol=2e3 if clocks == 2 else 1e-6)
    assert "the recorded ambient pressure" in got.notes["muscle_pressure"]
    with pytest.raises(RecordingError, match="every channel has a value"):
        load_recordings(file, channels={"length": {"value": 0.25, "unit": "m"}})


def test_a_channel_that_is_one_series_less_another(tmp_path: Path) -> None:
    data = signals()
    flows = {"q_in": data["p1"], "q_out": 0.25 * data["p1"], "short": data["p1"][:5]}
    file = npz(tmp_path, t=data["t"], p1=data["p1"], **flows)
    entry = {"column": "q_in", "less": "q_out", "unit": "g/s", "scale": 2.0}
    got = one(file, channels=BASE | {"air_flow": entry})
    np.testing.assert_allclose(got.channels["air_flow"], 1.5e-3 * data["p1"], rtol=1e-12)
    for wrong, words in (
        ({"less": "short"}, r"air_flow\.less = 'short' is not allowed: .* same rows as 'q_in'"),
        ({"less": "q_up"}, "q_up"),
        ({"less": ""}, r"air_flow\.less"),
        ({"unit": "bar"}, "kg/s"),
    ):
        with pytest.raises(RecordingError, match=words):
            one(file, channels=BASE | {"air_flow": entry | wrong})


def test_channels_with_clocks_of_their_own(tmp_path: Path) -> None:
    """Fast pressures are averaged over the encoder's interval, its clock is 40 ms behind, and the
    command holds from one change to the next.
    """
    fast = np.arange(8000) * 1e-3 + 100.0
    slow = np.arange(1700) * 5e-3 + 99.7
    rng = np.random.default_rng(1)
    pressure = 2.0 + np.sin(fast) + rng.normal(0.0, 0.01, len(fast))
    angle = 30.0 + 10.0 * np.sin(slow + 0.04)
    own = {"tu": [99.0, 102.0, 102.0, 104.0], "u": [5.0, 6.0, 7.0, 4.0]}
    file = npz(tmp_path, tp=fast, p1=pressure, ta=slow, angle=angle, **own)
    channels = {
        "muscle_pressure": P1 | {"time": "tp"},
        "joint_angle": ANGLE | {"time": {"column": "ta", "offset": 0.04}},
        "valve_command": {"column": "u", "unit": "V", "time": "tu", "hold": True},
    }
    got = one(file, channels=channels, time=None, sample_time=5e-3)
    assert got.sample_time == 5e-3
    assert got.duration == pytest.approx(7.995, abs=0.011)
    assert got.valid().all()
    true = 100.0 + got.time
    assert np.abs(got.channels["muscle_pressure"] / 1e5 - 2.0 - np.sin(true)).std() < 0.006
    assert np.abs(np.degrees(got.channels["joint_angle"]) - 30 - 10 * np.sin(true)).max() < 1e-3
    wanted = np.select([true < 102 - 1e-7, true < 104 - 1e-7], [5.0, 7.0], 4.0)
    np.testing.assert_allclose(got.channels["valve_command"], wanted, atol=1e-9)
    assert any("before another channel begins" in issue.text for issue in got.issues)
    fine = one(file, channels=channels, time=None)
    assert fine.sample_time == 1e-3
    assert fine.valid("muscle_pressure").mean() > 0.99


@pytest.mark.parametrize("aside", [0.0, 0.0007, 0.0025, 0.004])
@pytest.mark.parametrize("rate", [200.0, 1000.0, 333.0])
def test_averages_delay_nothing(tmp_path: Path, aside: float, rate: float) -> None:
    fast, slow = np.arange(2000) / rate, np.arange(400) * 0.01 + aside
    file = npz(tmp_path, t=fast, p1=1.0 + fast, ta=slow, angle=np.sin(slow))
    got = one(file, channels=APART, sample_time=0.01)
    assert got.sample_time == 0.01
    assert got.valid().all()
    late = 1.0 + got.time + aside - got.channels["muscle_pressure"] / 1e5
    assert np.abs(late).max() < 3e-4  # s, for one bar is one second here
    assert abs(late.mean()) < 3e-5


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("sample_time", [0.02, 0.01, 0.005, 0.001])
def test_commands_do_as_much_in_all(tmp_path: Path, hold: bool, sample_time: float) -> None:
    """A command holds from sample to sample: on any grid its integral stays what it was."""
    rng = np.random.default_rng(2)
    time = np.arange(1000) * 0.005
    volts = rng.uniform(0.0, 10.0, 1000)
    file = npz(tmp_path, t=time, u=volts, tp=time + 0.001, p1=1.0 + time)
    command = {"column": "u", "unit": "V", "time": "t", "hold": hold}
    channels = {"muscle_pressure": P1 | {"time": "tp"}, "valve_command": command}
    got = one(file, channels=channels, time=None, sample_time=sample_time)
    laid = got.channels["valve_command"]
    assert np.isfinite(laid).all()
    times = 0.001 + got.time
    fine = np.arange(0.0, 4.99, 1e-4)
    wanted = np.cumsum(volts[np.floor(fine / 0.005 + 1e-6).astype(int)]) * 1e-4
    done = np.cumsum(laid) * sample_time
    ends = times + sample_time
    inside = ends < 4.98
    there = np.interp(ends[inside], fine + 1e-4, wanted) - np.interp(0.001, fine + 1e-4, wanted)
    np.testing.assert_allclose(done[inside], there, atol=1e-3)


def test_gaps_of_one_clock_are_masked(tmp_path: Path) -> None:
    data = signals()
    keep = (data["t"] < 1.0) | (data["t"] > 1.5)
    file = npz(tmp_path, t=data["t"], p1=data["p1"], ta=data["t"][keep], angle=data["angle"][keep])
    got = one(file, channels=APART)
    assert got.valid("muscle_pressure").all()
    hole = ~got.valid("joint_angle")
    assert 45 <= hole.sum() <= 52
    assert [issue.channel for issue in got.issues if issue.kind == "gap"] == ["joint_angle"]


def test_clocks_that_never_meet(tmp_path: Path) -> None:
    count = np.arange(50.0)
    file = npz(tmp_path, t=count, p1=count, ta=count + 1e6, angle=count)
    with pytest.raises(RecordingError, match=r"not sampled at the same time: .*1000000"):
        one(file, channels=APART)


def test_parts_of_one_log(tmp_path: Path) -> None:
    data = signals()
    clock = np.concatenate([data["t"], data["t"], data["t"] + 0.5])
    trial = np.repeat([1.0, 2.0, 7.0], N)
    pause = np.concatenate([data["t"] + 10.0 * k for k in range(3)])
    pressure = np.tile(data["p1"], 3)
    file = npz(tmp_path, t=clock, trial=trial, pause=pause, p1=pressure)
    for split, time, names in (
        ("clock", "t", ["run_1", "run_2", "run_3"]),
        ({"gap": 2.0}, "pause", ["run_1", "run_2", "run_3"]),
        ({"column": "trial"}, "t", ["run_1", "run_2", "run_7"]),
    ):
        got = load_recordings(file, channels=BASE, time=time, split=split)
        assert [part.name for part in got] == names
        for part in got:
            assert len(part) == N
            np.testing.assert_allclose(part.channels["muscle_pressure"], data["p1"] * 1e5)
    last = one(file, split={"column": "trial"}, pieces=["7"], start=1.0, stop=2.0)
    assert (last.name, len(last)) == ("run_7", 101)
    with pytest.raises(RecordingError, match=r"no part 4; there are 3, called '1'"):
        load_recordings(file, channels=BASE, time="t", split="clock", pieces=[4])


def test_parts_by_texts(tmp_path: Path) -> None:
    rows = [
        f"{0.01 * i:.2f};{i % 9};{'lift' if i < 50 else 'drop' if i < 100 else ''}"
        for i in range(150)
    ]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["t;p1;what", *rows]))
    got = load_recordings(file, channels=BASE, time="t", split={"column": "what"})
    assert [(part.name, len(part)) for part in got] == [("log_lift", 50), ("log_drop", 50)]


WRONG = [
    ({}, {}, "channels = {}"),
    ({"muscle_presure": {"column": "p1", "unit": "bar"}}, {}, "did you mean 'muscle_pressure'"),
    ({"time": {"column": "t", "unit": "s"}}, {}, "by the key time"),
    ({"muscle_pressure": "p1"}, {}, "channels.muscle_pressure = 'p1'"),
    ({"muscle_pressure": {"column": "p1"}}, {}, "channels.muscle_pressure.unit = None"),
    ({"muscle_pressure": {"column": "p1", "unit": "V"}}, {}, "wrong dimension"),
    ({"muscle_pressure": P1 | {"scal": 2}}, {}, "did you mean 'scale'"),
    ({"muscle_pressure": P1 | {"scale": 0}}, {}, "scale = 0"),
    ({"muscle_pressure": P1 | {"scale": np.nan}}, {}, "scale = nan"),
    ({"muscle_pressure": P1 | {"from": [0, 1]}}, {}, "belong together"),
    ({"muscle_pressure": P1 | {"from": [1, 1], "to": [0, 1]}}, {}, "equal"),
    ({"muscle_pressure": P1 | {"hold": 1}}, {}, "hold = 1"),
    ({"length": {"value": "x", "unit": "m"}}, {}, "channels.length.value = 'x'"),
    ({"length": {"value": 0.2}}, {}, "channels.length.unit = None"),
    ({"length": {"value": 0.2, "unit": "m", "hold": True}}, {}, "unknown key"),
    ({"length": {"value": 0.2, "unit": "m(a)"}}, {}, "unknown unit 'm(a)'"),
    ({"length": {"column": "p1", "unit": "m", "from": [0, 1, 1], "to": [0, 1, 2]}}, {}, "rises"),
    ({"length": {"column": "p1", "unit": "m", "from": [0, 1, 2], "to": [0, 1]}}, {}, "as many"),
    ({"muscle_pressure": P1 | {"assumed": 1}}, {}, "assumed = 1"),
    ({"muscle_pressure": P1 | {"scale": 10**400}}, {}, "scale = 1000"),
    ({"muscle_pressure": P1 | {"time": 3}}, {}, "time = 3"),
    (BASE, {"time": {"column": "t", "unit": "bar"}}, "wrong dimension"),
    (BASE, {"time": {"column": "t", "offset": "1"}}, "time.offset = '1'"),
    (BASE, {"time": "x"}, "no channel 'x'"),
    (BASE, {"time": "short"}, "400 values, but its times 'short' are 3"),
    (BASE, {}, "no clock for 'p1'"),
    (BASE, {"time": "t", "split": "gap"}, "split = 'gap'"),
    (BASE, {"time": "t", "split": {"gap": -1}}, "split = "),
    (BASE, {"time": "t", "pieces": [1]}, "needs split"),
    (BASE, {"time": "t", "role": "test"}, "role = 'test'"),
    (BASE, {"time": "t", "sample_time": -1.0}, "sample_time = -1.0"),
    ({"muscle_pressure": P1 | {"hold": True}}, {"time": "t"}, "hold"),
]  # fmt: skip


@pytest.mark.parametrize(("channels", "options", "words"), WRONG)
def test_mistakes_are_named(
    tmp_path: Path, channels: Any, options: dict[str, Any], words: str
) -> None:
    data = signals()
    file = npz(tmp_path, t=data["t"], p1=data["p1"], short=[1.0, 2.0, 3.0])
    with pytest.raises(RecordingError) as caught:
        load_recordings(file, channels=channels, **options)
    assert words in str(caught.value)
    assert "run.npz" in str(caught.value)


def test_without_a_clock_the_spacing_is_enough(tmp_path: Path) -> None:
    got = one(npz(tmp_path, p1=signals()["p1"]), time=None, sample_time=0.02)
    assert (got.sample_time, len(got)) == (0.02, N)


# ------------------------------------------------------------------------- cases

CASE = """schema = "pamrs.case/1"

[[recording]]
file = "{file}"
split = {{ gap = 1.0 }}
pieces = [1, 2]
time = "t"
channels.muscle_pressure = {{ column = "p1", unit = "bar" }}

[[recording]]
file = "{file}"
role = "held_out"
split = {{ gap = 1.0 }}
pieces = [3]
time = "t"
[recording.channels]
muscle_pressure = {{ column = "p1", unit = "bar" }}
"""


def case(home: Path, file: Path, toml: str = CASE) -> pamrs.Case:
    return case_of(home, toml.format(file=file.name), pamrs.rigs.sealed_chamber())


def three_lifts(tmp_path: Path) -> Path:
    """A log of three lifts with pauses between them."""
    data = signals()
    time = np.concatenate([data["t"] + 10.0 * k for k in range(3)])
    return npz(tmp_path, t=time, p1=np.tile(data["p1"], 3))


def test_a_case_takes_parts_of_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reads: list[Path] = []
    read = logs_package.read_log
    monkeypatch.setattr(
        "pamrs.recordings._case.read_log", lambda *given: reads.append(given[0]) or read(*given)
    )
    found = case(tmp_path, three_lifts(tmp_path))
    assert [item.name for item in found.fit] == ["run_1", "run_2"]
    assert [item.name for item in found.held_out] == ["run_3"]
    assert len(reads) == 1


def test_what_was_not_logged_is_a_value_in_the_case(tmp_path: Path) -> None:
    """A length that a frame held, a set pressure that somebody turned by hand."""
    data = signals()
    file = npz(tmp_path, t=data["t"], p1=data["p1"])
    toml = """schema = "pamrs.case/1"
[[recording]]
file = "{file}"
time = "t"
[recording.channels]
muscle_pressure = {{ column = "p1", unit = "bar" }}
length = {{ value = 0.25, unit = "m" }}
supply_command = {{ value = 6.0, unit = "bar" }}
"""
    (only,) = case(tmp_path, file, toml).recordings
    assert set(only.channels) == {"muscle_pressure", "length", "supply_command"}
    for channel, value in (("length", 0.25), ("supply_command", 6e5)):
        np.testing.assert_allclose(only.channels[channel], value)
        assert only.valid(channel).all()
    assert not [issue for issue in only.issues if issue.channel in ("length", "supply_command")]


def test_parts_of_a_bag_are_limited_together(monkeypatch: pytest.MonkeyPatch) -> None:
    import zstandard

    packed = zstandard.compress(bytes(1000))
    monkeypatch.setattr(_gate, "MOST_BYTES", 2500)
    unpacked = _gate.Unpacking(Path("run.bag"), 0)
    assert unpacked(b"as it is") == b"as it is"
    assert [len(unpacked(packed)) for _ in range(2)] == [1000, 1000]
    with pytest.raises(RecordingError, match="unpacks to too much with the rest"):
        unpacked(packed)
    with pytest.raises(RecordingError, match="unpacks to more than 0 MB"):
        _gate.Unpacking(Path("run.bag"), 0)(packed, 999)


@pytest.mark.parametrize(("old", "new", "words"), rows_of(__file__, "mistakes_in_a_case"))
def test_mistakes_in_a_case(tmp_path: Path, old: str, new: str, words: str) -> None:
    file = three_lifts(tmp_path)
    toml = CASE.replace("{{", "{").replace("}}", "}")
    assert old in toml
    with pytest.raises(CaseError) as caught:
        case_of(tmp_path, toml.replace("{file}", file.name).replace(old, new, 1))
    assert words in str(caught.value)


def test_a_missing_package_stops_a_case_before_its_rig_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, _, _ = written(tmp_path, "tdms")
    monkeypatch.setattr(logs_package, "find_spec", lambda name: None)
    (tmp_path / "rig.toml").write_text("not a rig")
    (tmp_path / "case.toml").write_text(CASE.format(file=file.name))
    with pytest.raises(MissingPackageError, match=r"nptdms.*pamrs\[logs\]"):
        load_case(tmp_path)


def test_a_bag_in_a_case(tmp_path: Path) -> None:
    file, pattern, _ = written(tmp_path, "bag")
    entry = mapping(pattern)["muscle_pressure"]
    toml = (
        'schema = "pamrs.case/1"\n[[recording]]\nfile = "{file}"\n[recording.channels]\n'
        f'muscle_pressure = {{{{ column = "{entry["column"]}", unit = "bar" }}}}\n'
    )
    (only,) = case(tmp_path, file, toml).recordings
    assert only.name == "run_bag"
    assert len(only) == N


# ------------------------------------------------------------------------- the page


def test_the_example_of_the_page(tmp_path: Path) -> None:
    """``docs/logs_mapping.md``: three lifts in one log, the encoder late, the tank on change."""
    page = (Path(__file__).parents[2] / "docs" / "logs_mapping.md").read_text(encoding="utf-8")
    toml = page.split("```toml\n")[1].split("```")[0]
    data = signals()
    time = np.concatenate([data["t"] + 10.0 * k for k in range(3)])
    slow = np.concatenate([np.arange(0.0, 4.0, 0.02) + 10.0 * k for k in range(3)])
    angle = np.interp(slow, time, np.tile(data["angle"], 3))
    np.savez(
        tmp_path / "bench.npz",
        t=time * 1e3,
        u=np.tile(data["u"], 3),
        adc1=np.round(np.tile(data["p1"], 3) * 409.5),
        t_enc=slow - 0.04,
        enc=(90.0 - angle) * 10.0,
        t_tank=np.array([0.0, 2.0, 12.0]),
        p_tank=np.array([8.0, 7.9, 7.8]),
    )
    found = case_of(tmp_path, toml)
    assert [item.name for item in found.fit] == ["bench_1", "bench_2"]
    assert [item.name for item in found.held_out] == ["bench_3"]
    for item in found.recordings:
        assert item.sample_time == 0.01
        wanted = np.interp(item.time, data["t"], data["angle"])
        assert np.abs(np.degrees(item.channels["joint_angle"]) - wanted).max() < 0.1
        wanted = np.interp(item.time, data["t"], data["p1"])
        assert np.abs(item.channels["muscle_pressure"] / 1e5 - wanted).max() < 0.02
    np.testing.assert_allclose(found.fit[1].channels["supply_pressure"][[0, -1]], [7.9e5, 7.8e5])


def test_parts_by_a_column_with_a_clock_of_its_own(tmp_path: Path) -> None:
    fast, slow = np.arange(4000) * 1e-3, np.arange(40) * 0.1
    trial = np.repeat([1.0, np.nan, 3.0, 4.0], 10)
    file = npz(tmp_path, t=fast, p1=2.0 + np.sin(fast), ts=slow, trial=trial)
    channels = {"muscle_pressure": P1 | {"time": "t"}}
    got = load_recordings(file, channels=channels, time="ts", split={"column": "trial"})
    names = ["run_1", "run_3", "run_4"]
    assert [(part.name, len(part)) for part in got] == [(name, 1000) for name in names]
    first = got[1].channels["muscle_pressure"][0] / 1e5
    assert first == pytest.approx(2.0 + np.sin(2.0), abs=2e-3)


def test_a_pause_of_years_is_an_error_and_no_array(tmp_path: Path) -> None:
    far = np.concatenate([np.arange(50) * 0.01, np.arange(50) * 0.01 + 1.7e9])
    file = npz(tmp_path, t=far, p1=np.arange(100.0), ta=far + 1e-3, angle=np.arange(100.0))
    with pytest.raises(RecordingError, match="split = { gap"):
        one(file, channels=APART)
    assert len(load_recordings(file, channels=APART, time="t", split={"gap": 10.0})) == 2
