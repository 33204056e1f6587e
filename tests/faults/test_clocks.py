"""Logs with clocks, dates, counters and cells as laboratories write them: right, and told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.recordings import load_case, propose
from pamrs.recordings.logs import TextFormat

HERE = Path(__file__).parent
CLOCKS = HERE / "01_clock_ns_and_sec_nanosec"
CELLS = HERE / "04_one_bad_cell_and_order"
DATES = HERE / "07_dates_and_counters"
NAMED = {"serialmon.txt": "time,valve [V],p_muscle [Pa],angle [deg]"}
LOGS = {
    CLOCKS / "ros_echo_p.csv": ["ns is taken by their size", "time is 1.5 ms later"],
    CLOCKS / "ros2_secnsec.csv": ["header.stamp.sec and header.stamp.nanosec are one clock"],
    DATES / "de_date.csv": [],
    DATES / "us_ampm.csv": ["200 rows have 5 different times (up to 50 rows of one)"],
    DATES / "plotter.txt": [],
    DATES / "serialmon.txt": [],
    DATES / "wrap_ms16.csv": ["overflows of a clock of 16 bits: 1"],
    DATES / "wrap_us32.csv": ["overflows of a clock of 32 bits: 1"],
    DATES / "enc360.csv": ["leaps by a full turn: 4"],
    CELLS / "disorder.csv": ["'OL'", "'#N/A'", "rows that come after later ones"],
    CELLS / "garbled.csv": ["rows with fewer than 4 cells: 2", "'1.5.56'", "without a time: 1"],
    CELLS / "restart.csv": ["rows that repeat the headings, where a recording starts again: 1"],
}


BY_IMPORT = LOGS[CLOCKS / "ros_echo_p.csv"]  # case.toml says it then


def truth() -> np.ndarray:
    """Seconds, volts, pascal and degrees of all these logs."""
    table = np.loadtxt(DATES / "wrap_us32.csv", delimiter=",", skiprows=1)
    table[:, 0] = 0.02 * np.arange(len(table))
    return table


@pytest.mark.parametrize("log", LOGS, ids=lambda path: path.name)
def test_the_log_becomes_the_recording_and_says_what_was_done(tmp_path: Path, log: Path) -> None:
    columns = NAMED.get(log.name)
    form = TextFormat(columns=tuple(columns.split(","))) if columns else None
    proposal = propose([log], pamrs.rigs.shoulder(), form=form)
    (item,) = proposal.logs
    told = "\n".join(item.log.remarks)
    assert all(words in told for words in LOGS[log]), told
    pamrs.rigs.shoulder().to_toml(tmp_path / "rig.toml")
    (tmp_path / "case.toml").write_text(proposal.case_toml(tmp_path), encoding="utf-8")
    recordings = load_case(tmp_path, allow_outside=True).recordings
    issues = "\n".join(issue.text for issue in recordings[0].issues)
    assert all(words in issues for words in LOGS[log] if words not in BY_IMPORT), issues
    wanted = truth()
    offset = {"enc360.csv": -30.0}.get(log.name, 0.0)
    assert len(recordings) == (2 if log.name == "restart.csv" else 1)
    for recording in recordings:
        assert recording.sample_time == pytest.approx(0.02, rel=1e-4)
        assert len(recording) == (
            100 if log.name == "restart.csv" else 200 - (log.name == "garbled.csv")
        )
        rows = np.arange(len(recording))
        seen = {
            "valve_command": wanted[rows, 1],
            "muscle_pressure": wanted[rows, 2],
            "joint_angle": np.radians(wanted[rows, 3] + offset),
        }
        for channel, values in recording.channels.items():
            used = recording.mask[channel]
            assert used.mean() > 0.97
            np.testing.assert_allclose(
                values[used], seen[channel][used], rtol=2e-3, atol=2e-3 * np.ptp(seen[channel])
            )
