"""What a sensor or the unit of its column does to a log, and what is to be said of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pamrs
from pamrs.diagnosis.prepare import without_rails
from pamrs.diagnosis.settings import PlausibilitySettings

HERE = Path(__file__).parent


def test_a_clipped_gauge_is_masked_in_all_recordings_and_said_first() -> None:
    """Each recording reaches 6 bar, where the gauge ends; in one of them it only touches that."""
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    short = case.recordings[0]
    assert short.channels["muscle_pressure"][short.mask["muscle_pressure"]].max() == 6e5

    found = pamrs.diagnose(case)
    assert found.verdict in ("none", "parameters")
    assert not found.effects
    assert "muscle_pressure is clipped: its sensor's range ends at 6 bar" in found.warnings[0]
    assert all(f" in {name}" in found.warnings[0] for name in "abc")
    assert all(u.masked["muscle_pressure"] > 0.03 for u in found.data)


def test_what_a_recording_exceeds_is_no_end_of_its_sensor() -> None:
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    one = case.recordings[0]
    higher = one.channels["muscle_pressure"] + 5e3
    one.channels["muscle_pressure"][:] = higher
    kept, said = without_rails(case.recordings, PlausibilitySettings())
    assert not said
    assert all(
        np.array_equal(k.channels["joint_angle"], r.channels["joint_angle"], equal_nan=True)
        for k, r in zip(kept, case.recordings, strict=True)
    )
    assert kept[0].mask["muscle_pressure"].all()
