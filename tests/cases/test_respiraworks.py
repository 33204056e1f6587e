"""The cases of a ventilator's test lung: logs in the authors' format become tables and rigs."""

from __future__ import annotations

import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import available_blocks
from tests.loaded import CASES, load_module

HEAD = "# covent_pc_4\n# Built at revision a9175b3 (dirty)\n"
TIME = np.arange(0.0, 12.0, 0.01)
BREATH = (TIME + 2.5) % 3.0 < 1.0
"""Breathing in: three seconds a breath, the first one from 0.5 s on."""


@pytest.fixture(scope="module")
def convert() -> ModuleType:
    return load_module(CASES / "respiraworks" / "convert.py")


def log(**series: np.ndarray) -> str:
    """A log as the authors write it, with the set pressure and the airway's."""
    wanted = np.where(BREATH, 35.0, 10.0)
    table = {"time(sec)": TIME, "pc_setpoint": wanted, "pressure": wanted - 0.5, **series}
    rows = ["  ".join(f"{value:.3f}" for value in row) for row in np.array(list(table.values())).T]
    return HEAD + "  ".join(table) + "\n" + "\n".join(rows) + "\n"


def test_every_case_of_a_volume_is_read(convert: ModuleType, tmp_path: Path) -> None:
    text = log(volume=np.where(BREATH, 400.0, 20.0))
    convert.write(tmp_path, "missing_setting", text)
    case = pamrs.load_case(tmp_path)
    assert [recording.role for recording in case.recordings] == ["fit", "held_out"]
    lung = case.recordings[0].channels["muscle_pressure"] / convert.CMH2O
    assert np.isclose(lung.max() - lung.min(), 38.0)  # 380 ml over 10 ml/cmH2O
    assert [block.name for block in available_blocks(case.rig, case.channels)] == [
        "supply",
        "chamber",
    ]


def test_a_zero_of_the_flow_meters_is_levelled_or_left(convert: ModuleType) -> None:
    drop = np.full(TIME.size, 1.0)
    found = convert.columns(log(dp_inhale=drop, dp_exhale=-drop))
    levelled = convert.lung_pressure(found, convert.CASES["unit_new"])
    left = convert.lung_pressure(found, convert.CASES["flow_drift"])
    begins = np.isclose(TIME % 3.0, 0.49)
    assert np.allclose(levelled[begins], 10.0, atol=1e-6)
    flow = 2.0 * convert.metered(np.array([1.0]))[0]
    assert np.isclose(left[-1] - left[0], flow * (TIME[-1] - TIME[0]) / 20.0)
    # Bernoulli from the bore to the throat, less 3 %
    drop_of = (
        0.5 * 1.225 * ((0.5e-6 * flow / 0.97) ** 2) * (1.0 / 2.3758e-5**2 - 1.0 / 1.7789e-4**2)
    )
    assert np.isclose(drop_of, convert.CMH2O, rtol=1e-3)


def test_files_are_read_from_the_history(convert: ModuleType, tmp_path: Path) -> None:
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    with pytest.raises(ValueError, match="README"):
        convert.convert(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()
