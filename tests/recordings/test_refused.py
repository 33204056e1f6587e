"""What a case file gets wrong about its log is refused, never read as other numbers."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from pamrs import RecordingError
from pamrs.recordings import load_recording


def written(tmp_path: Path, heading: str, rows: list[str]) -> Path:
    file = tmp_path / "run.csv"
    file.write_text("\n".join([heading, *rows]) + "\n")
    return file


def test_a_decimal_comma_between_commas_is_no_number(tmp_path: Path) -> None:
    """Two columns once became one, which stood in both: 1 bar was read as 10 kPa."""
    rows = [f"{k},{1 + k % 3}" for k in range(40)]
    file = written(tmp_path, "time [s],muscle_pressure [bar]", rows)
    read = load_recording(file, decimal=",")
    assert np.allclose(read.channels["muscle_pressure"][:3], [1e5, 2e5, 3e5])


def test_points_beside_a_decimal_comma_are_asked(tmp_path: Path) -> None:
    file = written(tmp_path, "time [s];muscle_pressure [kPa]", ["0,0;980", "1,0;1.520", "2,0;990"])
    with pytest.raises(RecordingError, match=r"'1\.520' has a point and decimal is ','"):
        load_recording(file, delimiter=";", decimal=",")
    read = load_recording(file, delimiter=";", decimal=",", thousands={"muscle_pressure": "."})
    assert np.allclose(read.channels["muscle_pressure"], [980e3, 1520e3, 990e3])


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"decimal": "x"}, "decimal = 'x' is not allowed"),
        ({"decimal": ",", "thousands": ","}, "it is the decimal mark"),
    ],
)
def test_marks_that_cannot_be_are_refused(tmp_path: Path, keys: dict[str, str], told: str) -> None:
    file = written(tmp_path, "time [s];muscle_pressure [bar]", ["0,0;0,25", "1,0;0,25"])
    with pytest.raises(RecordingError, match=told):
        load_recording(file, delimiter=";", **keys)


def test_a_quote_that_is_not_closed_is_an_error_of_the_recording(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},{k % 7}" for k in range(20000)]
    file = written(tmp_path, '"time [s],muscle_pressure [bar]', rows)
    with pytest.raises(RecordingError, match="a quote that is opened"):
        load_recording(file)


def test_an_underscore_is_no_part_of_a_number(tmp_path: Path) -> None:
    rows = [f"{k},{'1_0' if k == 7 else 2 + k % 3}" for k in range(40)]
    read = load_recording(written(tmp_path, "time [s],muscle_pressure [bar]", rows))
    assert not read.mask["muscle_pressure"][7]
    assert read.mask["muscle_pressure"].sum() == 39


def test_series_of_another_length_are_said(tmp_path: Path) -> None:
    file = tmp_path / "run.h5"
    with h5py.File(file, "w") as store:
        for name, unit, count in (
            ("time", "s", 100),
            ("muscle_pressure", "bar", 100),
            ("joint_angle", "deg", 100),
            ("temperature", "K", 10),
        ):
            store[name] = np.arange(count, dtype=float)
            store[name].attrs["unit"] = unit
    said = [issue.text for issue in load_recording(file).issues]
    assert any("'temperature': not 100 values" in text for text in said)
