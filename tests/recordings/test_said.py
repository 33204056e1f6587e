"""What a log writes in an unusual place is read, or said: nothing is lost without a word."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import pamrs
from pamrs.cli import app
from pamrs.diagnosis.prepare import noted_units
from pamrs.errors import CaseError
from pamrs.recordings import Proposal, load_case, load_recording, load_recordings, propose
from pamrs.recordings.logs import read_log, split_heading, understood_unit
from tests.recordings.written import SHOULDER, case_of, write_table, write_workbook

COUNT = 100
TIME = 0.02 * np.arange(COUNT)
WAVE = np.sin(3.0 * TIME) ** 2
ANGLE = 30.0 + 20.0 * WAVE


PLAIN = {"time [s]": TIME, "valve [V]": 5.0 + WAVE}


def few(values: np.ndarray) -> list[str]:
    return [f"{value:.6g}" for value in values]


def log(tmp_path: Path, heading: str, values: np.ndarray) -> Proposal:
    """A log of a shoulder with one column of this heading."""
    columns = PLAIN | {"angle [deg]": ANGLE, heading: values}
    return propose([write_table(tmp_path / "run.csv", columns)], SHOULDER)


@pytest.mark.parametrize(
    ("heading", "unit", "absolute"),
    [
        ("p1_psi_filt", "psi", None), ("P1_PSI_RAW", "psi", None), ("pressure.kPa.1", "kPa", None),
        ("p1PsiFilt", "psi", None), ("angle_deg_filtered", "deg", None), ("t_ms_raw", "ms", None),
        ("length_in", "in", None), ("Stroke_In", "in", None), ("p1 [psi] filt", "psi", None),
        ("p [bar] abs", "bar", True), ("p (kPa) absolute", "kPa", True),
        ("Druck [bar] absolut", "bar", True), ("p [bar] (abs)", "bar", True),
        ("p [bar] gauge", "bar", False), ("p (psi) rel", "psi", False),
    ],
)  # fmt: skip
def test_a_unit_inside_a_name_is_read(heading: str, unit: str, absolute: bool | None) -> None:
    known = understood_unit(split_heading(heading)[1])
    assert known is not None
    assert (known.unit, known.absolute) == (unit, absolute)


@pytest.mark.parametrize("heading", ["p_in", "bar_force", "valve in", "P1_ATM", "p_deg_or_psi_x"])
def test_a_word_that_may_be_no_unit_is_none(heading: str) -> None:
    assert split_heading(heading)[1] == ""


def test_a_unit_inside_a_name_reaches_the_recording(tmp_path: Path) -> None:
    (only,) = case_of(tmp_path, log(tmp_path, "p1_psi_filt", 14.5 * (1 + WAVE))).recordings
    np.testing.assert_allclose(
        only.channels["muscle_pressure"], 14.5 * 6894.757293 * (1 + WAVE), rtol=1e-5
    )
    assert not only.notes


def test_an_absolute_pressure_behind_its_bracket_becomes_gauge(tmp_path: Path) -> None:
    proposal = log(tmp_path, "p_muscle [bar] abs", 1.01325 + WAVE)
    (only,) = case_of(tmp_path, proposal).recordings
    np.testing.assert_allclose(only.channels["muscle_pressure"], 1e5 * WAVE, atol=5.0)
    assert "absolute" in only.notes["muscle_pressure"]


def test_atm_in_a_name_is_doubted(tmp_path: Path) -> None:
    (item,) = log(tmp_path, "P1_ATM", 1.0 + WAVE).logs
    assert "muscle_pressure" not in {match.channel for match in item.matches}
    assert "ATM in its name may be the unit, or say" in item.left[0].text


def test_english_thousands_in_quotes_are_read_and_said(tmp_path: Path) -> None:
    pascal = 1e5 * (0.001 + WAVE)
    quoted = [f'"{value:,.1f}"' for value in pascal]
    file = write_table(tmp_path / "run.csv", PLAIN | {"p_muscle [Pa]": quoted}, ",")
    read = read_log(file)
    np.testing.assert_allclose(read.series["p_muscle"].values, pascal, atol=0.051)
    assert any("p_muscle: commas part thousands, as in " in text for text in read.remarks)


def test_a_heading_that_is_there_twice_is_said(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    rows = "".join(f"{t:.2f};{1 + w:.5f};{3 + w:.5f}\n" for t, w in zip(TIME, WAVE, strict=True))
    file.write_text(f"time [s];p_muscle [bar];p_muscle [bar]\n{rows}", encoding="utf-8")
    (item,) = propose([file], SHOULDER).logs
    assert "the name 'p_muscle' is there again: this one is 'p_muscle (2)' here" in item.log.remarks


@pytest.mark.parametrize(("first", "bits"), [(40, 16), (40, 32)])
def test_a_counter_that_wraps_below_zero_is_counted_on(
    tmp_path: Path, first: int, bits: int
) -> None:
    counts = (first - 120 * WAVE).round()
    assert counts.min() < 0
    whole = (counts % 2**bits).astype(np.int64).tolist()
    columns = {"time [s]": TIME, "encoder [counts]": whole}
    file = write_table(tmp_path / "run.csv", columns)
    channels = {"joint_angle": {"column": "encoder", "unit": "deg", "scale": 0.1}}
    (found,) = load_recordings(file, time="time", channels=channels)
    np.testing.assert_allclose(found.channels["joint_angle"], np.radians(0.1 * counts), atol=1e-9)
    assert any(f"overflows of a counter of {bits} bits: " in issue.text for issue in found.issues)


def clock(seconds: float) -> str:
    """Local time of the night in which summer time ends, some seconds after 02:59:59."""
    total = 3 * 3600 - 1 + seconds
    total -= 3600 * (seconds >= 1.0)
    return f"2026-10-25 {int(total // 3600):02d}:{int(total // 60) % 60:02d}:{total % 60:06.3f}"


def test_a_clock_that_is_set_back_in_autumn_is_joined_and_said(tmp_path: Path) -> None:
    columns = {"Zeit": [clock(t) for t in TIME], "p_muscle [bar]": 1 + WAVE}
    read = read_log(write_table(tmp_path / "run.csv", columns))
    np.testing.assert_allclose(read.series["Zeit"].values, TIME, atol=1e-6)
    assert any("goes back by an hour after '2026-10-25 02:59:59" in text for text in read.remarks)
    world = columns | {"Zeit": [f"{clock(t)} UTC" for t in TIME]}
    read = read_log(write_table(tmp_path / "world.csv", world))
    assert not any("goes back" in text for text in read.remarks)


TWO = """schema = "pamrs.case/1"
rig = "rig.toml"
"""
ENTRY = """[[recording]]
file = "run.csv"
{more}
time = "time"
[recording.channels]
muscle_pressure = {{ column = "p_muscle", unit = "bar" }}
"""


def in_three_parts(tmp_path: Path, *more: str) -> pamrs.Case:
    """A case of a log with a bad cell and three runs, with entries that say `more`."""
    pressure = few(1 + WAVE)
    pressure[7] = "OL"
    runs = [i // 40 for i in range(COUNT)]
    columns = {"time [s]": TIME, "p_muscle [bar]": pressure, "run": runs}
    write_table(tmp_path / "run.csv", columns)
    return case_of(tmp_path, TWO + "".join(ENTRY.format(more=each) for each in more))


def test_parts_that_no_recording_takes_are_repeated_as_a_warning(tmp_path: Path) -> None:
    split = 'split = { column = "run" }\npieces = '
    case = in_three_parts(tmp_path, f"{split}[1]", f'{split}[3]\nrole = "held_out"')
    (told,) = noted_units(case)
    assert told.startswith("run.csv: 1 of the parts of this log (1) are in no recording")
    assert not noted_units(in_three_parts(tmp_path, f"{split}[1, 2]", f"{split}[3]"))


def test_what_was_done_to_a_log_is_said_once(tmp_path: Path) -> None:
    split = 'split = { column = "run" }\npieces = '
    case = in_three_parts(tmp_path, f"{split}[1]", f"{split}[2]", f"{split}[3]")
    told = [issue.text for each in case.recordings for issue in each.issues if issue.kind == "log"]
    assert sum("'OL'" in text for text in told) == 1


def test_two_recordings_of_one_name_are_told_the_cure(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"two recordings are called 'run': .*name = \"...\""):
        in_three_parts(tmp_path, "start = 0.0", "start = 0.5")
    assert len(in_three_parts(tmp_path, "", 'name = "again"').recordings) == 2


def sheet(first: float) -> list[list[object]]:
    table = zip(TIME, 5.0 + WAVE, first + WAVE, ANGLE, strict=True)
    return [["time [s]", "valve [V]", "p_muscle [bar]", "angle [deg]"], *map(list, table)]


def test_every_sheet_of_a_workbook_is_proposed(tmp_path: Path) -> None:
    pytest.importorskip("python_calamine")
    file = tmp_path / "run.xlsx"
    notes: list[list[object]] = [["x", "y"], *([float(i), 2.0 * i] for i in range(40))]
    write_workbook(file, sheet(1.0), sheet(2.0), notes, names=("up", "down", "notes"))
    proposal = propose([file], SHOULDER)
    assert [len(item.matches) for item in proposal.logs] == [3, 3, 0]
    assert any("no channel was recognised in notes" in t for t in proposal.logs[2].remarks)
    case = case_of(tmp_path, proposal)
    assert [each.name for each in case.recordings] == ["run_up", "run_down"]
    for each, first in zip(case.recordings, (1.0, 2.0), strict=True):
        np.testing.assert_allclose(each.channels["muscle_pressure"], 1e5 * (first + WAVE))


@pytest.mark.parametrize("inside", [True, False])
def test_the_printed_command_accepts_the_paths_that_were_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, inside: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    SHOULDER.to_toml(tmp_path / "my_rig.toml")
    columns = PLAIN | {"p_muscle [bar]": 1 + WAVE, "angle [deg]": ANGLE}
    write_table(tmp_path / "my_log.csv", columns)
    out = "." if inside else "my_case"
    asked = ["import", "my_log.csv", "--rig", "my_rig.toml", "--out", out]
    said = CliRunner().invoke(app, asked)
    assert said.exit_code == 0, said.output
    command = shlex.split(said.output.rpartition("then: pamrs ")[2])
    assert command == ["diagnose", out] + ([] if inside else ["--allow-outside"])
    assert load_case(out, allow_outside="--allow-outside" in command).recordings


def test_one_faulty_cell_changes_no_other(tmp_path: Path) -> None:
    """Blocks of rows that NumPy parses, and those that are taken apart, give the same numbers."""
    rng = np.random.default_rng(5)
    table = np.column_stack([0.001 * np.arange(9000), rng.normal(size=(9000, 2))])
    rows = [",".join(f"{value:.9g}" for value in row) for row in table]
    for name, place in (("whole", None), ("faulty", 4321)):
        lines = ["time [s],force [N],joint_torque [Nm]", *rows]
        if place is not None:
            lines[place + 1] = f"{table[place, 0]:.9g},OL,{table[place, 2]:.9g}"
        (tmp_path / f"{name}.csv").write_text("\n".join(lines), encoding="utf-8")
    whole, faulty = (load_recording(tmp_path / f"{name}.csv") for name in ("whole", "faulty"))
    for channel, values in whole.channels.items():
        kept = faulty.mask[channel]
        assert np.array_equal(values[kept], faulty.channels[channel][kept])
        assert np.flatnonzero(~kept).tolist() == ([4321] if channel == "force" else [])
