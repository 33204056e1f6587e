"""Samples that a sensor dropped: masked in any channel, told with their times, and no window
begins with them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import without_impossible
from pamrs.recordings import Issue, Recording, load_recording
from pamrs.recordings._recording import find_faults
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.noisy import whole
from tests.diagnosis.test_load import RIG, recording


def dropped(name: str, value: float, stretches: list[tuple[int, int]]) -> Recording:
    """A lift in which one channel has another value now and then."""
    one = recording(RIG, "slow", "fit", 0, 6.0)
    values = one.channels[name].copy()
    for first, last in stretches:
        values[first:last] = value
    return replace(one, channels=one.channels | {name: values}, source="lift.csv")


@pytest.mark.parametrize("value", [0.0, 3.0])
def test_a_length_beyond_the_load_does_not_end_the_run(value: float) -> None:
    """Also where windows of the load begin: at 0 and 2.5 s."""
    bad = dropped("length", value, [(0, 12), (495, 520), (1000, 1010)])
    bad = replace(bad, issues=[Issue("log", "time", 0.0, 6.0, "rows without a time: 3 of 1204")])
    found = pamrs.diagnose(pamrs.Case("lift", RIG, [bad], Path()))
    assert found.verdict in ("none", "parameters")
    (told,) = (text for text in found.warnings if "beyond the possible" in text)
    assert "47 samples of length in lift.csv" in told
    assert "0 to 0.055 s, 2.475 to 2.595 s, 5 to 5.045 s" in told
    (own,) = found.data
    assert own.masked["length"] == pytest.approx(47 / len(bad))
    assert own.read == ["rows without a time: 3 of 1204"]
    first = " ".join(line.strip() for line in found.summary().splitlines()[1:6])
    wanted = f"rows without a time: 3 of 1204; length: 47 of {len(bad)} samples masked."
    assert f"As read: {bad.name}: {wanted}" in first


@pytest.mark.parametrize(
    ("name", "value"), [("muscle_pressure", -2e5), ("supply_pressure", 2e7), ("length", -1.0)]
)
def test_every_channel_is_looked_at(name: str, value: float) -> None:
    bad = dropped(name, value, [(30, 40)])
    (masked,), (told,) = without_impossible([bad], RIG, SETTINGS)
    assert np.flatnonzero(~masked.mask[name]).tolist() == list(range(30, 40))
    assert np.isnan(masked.channels[name][30:40]).all()
    assert f"10 samples of {name} in lift.csv" in told
    sound = dropped(name, value, [])
    (kept,), said = without_impossible([sound], RIG, SETTINGS)
    assert said == []
    assert all(mask.all() for mask in kept.mask.values())


ONCE = (30, 40)
SHOULDER = pamrs.rigs.shoulder()


def commanded(stretches: list[tuple[int, int]], *values: float) -> Recording:
    """A wave of a valve's command inside its range, with other values now and then."""
    time = 0.005 * np.arange(2000)
    table = SHOULDER.model["valve"]
    command = table["null_voltage"] + 0.8 * table["half_range"] * np.sin(time)
    for (first, last), value in zip(stretches, values, strict=True):
        command[first:last] = value
    return replace(whole("a", "fit", 0.005, {"valve_command": command}), source="lift.csv")


def test_commands_that_a_logger_lost_are_masked() -> None:
    bad = commanded([(0, 12), ONCE, (1990, 2000)], -327.68, -327.68, -327.68)
    (masked,), (told,) = without_impossible([bad], SHOULDER, SETTINGS)
    assert np.flatnonzero(~masked.mask["valve_command"]).tolist() == [
        *range(12), *range(30, 40), *range(1990, 2000)
    ]  # fmt: skip
    assert "32 samples of valve_command in lift.csv are beyond the possible" in told
    assert "0 to 0.055 s, 0.15 to 0.195 s, 9.95 to 9.995 s" in told


@pytest.mark.parametrize(
    ("stretches", "values"),
    [
        ([ONCE], (10.0,)),  # the end of the valve's range
        ([ONCE, (40, 60)], (25.0, 11.0)),  # a controller comes back from beyond what is possible
        ([(100, 101), (101, 102), (102, 103)], (25.0, 30.0, 28.0)),  # ... or moves there
        ([(100, 800)], (30.0,)),  # ... or stays there
    ],
)
def test_what_a_controller_asked_for_stays(
    stretches: list[tuple[int, int]], values: tuple[float, ...]
) -> None:
    (kept,), said = without_impossible([commanded(stretches, *values)], SHOULDER, SETTINGS)
    assert said == []
    assert kept.mask["valve_command"].all()


@pytest.mark.parametrize("channel", ["joint_angle", "length", "muscle_pressure", "temperature"])
@pytest.mark.parametrize("rail", [-0.5, 9.0])
def test_rails_inside_the_possible_are_masked_too(channel: str, rail: float) -> None:
    rng = np.random.default_rng(2)
    values = 3.0 + np.sin(0.01 * np.arange(3000)) + rng.normal(0.0, 0.01, 3000)
    for first, last in ((0, 9), (700, 705), (1500, 1540)):
        values[first:last] = rail
    faults = list(find_faults(channel, values))
    assert all(fault.masked for fault in faults)
    masked = {row for fault in faults for row in range(fault.start, fault.stop)}
    assert masked == {*range(9), *range(700, 705), *range(1500, 1540)}


def test_a_valve_that_vents_at_once_is_no_dropout() -> None:
    """A slow log of a muscle that is filled and vented between two rows."""
    rng = np.random.default_rng(2)
    full = np.repeat(np.arange(60) % 2, 20) * 5e5
    values = np.maximum(full + (full > 0) * rng.normal(0.0, 300.0, full.size), 0.0)
    assert not [f for f in find_faults("muscle_pressure", values) if f.masked]


def test_jitter_of_the_timer_is_one_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    stamps = 0.005 * np.arange(2000) + 0.0004 * rng.standard_normal(2000)
    late = np.arange(100, 1900, 160)
    kept = np.delete(stamps, [*late, *range(1950, 1970)])
    rows = "".join(f"{t:.5f},{2e5 + 300 * rng.standard_normal():.0f}\n" for t in kept)
    file = tmp_path / "a.csv"
    file.write_text("time [s],muscle_pressure [Pa]\n" + rows)
    issues = [issue for issue in load_recording(file).issues if issue.channel == "time"]
    assert len(issues) == 2
    assert f"timer jitter: {late.size} times" in issues[0].text
    assert "(about 20 missing)" in issues[1].text
