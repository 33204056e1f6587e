"""The case of a real arm's base joint: episodes become a case whose one block is the joint."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import available_blocks
from tests.loaded import CASES, load_module

SETTINGS = DiagnosisSettings()


def test_episodes_become_a_case(tmp_path: Path) -> None:
    convert = load_module(CASES / "pam_arm_shaj" / "convert.py")
    data = tmp_path / "data"
    data.mkdir()
    rng = np.random.default_rng(1)
    for index in range(13):
        rows = rng.normal(0.3, 0.01 * (index + 1), (60, 24))
        (data / f"20190807-10{index:02d}").write_text(
            json.dumps({"ob": rows.tolist(), "action": []}), encoding="utf-8"
        )
    names = convert.convert(tmp_path / "out", unit_bar=2.0, rate=50.0, data=data)
    case = pamrs.load_case(tmp_path / "out")
    assert len(names) == len(case.recordings) == convert.EPISODES
    assert len(case.held_out) == convert.HELD_OUT
    assert case.recordings[0].sample_time == 0.02
    assert len(case.recordings[0]) == 60 - 2 * convert.RESET
    assert [b.name for b in available_blocks(case.rig, case.channels)] == ["arm.base"]
    assert not case.rig.parameter("transmission.plus.radius").known
