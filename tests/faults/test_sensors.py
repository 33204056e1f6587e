"""What a sensor or the unit of its column does to a log, and what is to be said of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

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


def test_bar_labelled_psi_is_said_first_and_nothing_is_named() -> None:
    found = pamrs.diagnose(HERE / "11_bar_labelled_psi")
    assert found.verdict == "units"
    (read,) = found.misread
    assert (read.said, read.likely) == ("psi", "bar")
    assert set(read.channels) == {"supply_pressure", "muscle_pressure"}
    assert read.factors == pytest.approx([14.5038, 14.5038], rel=1e-4)
    assert read.after < 3.0 < 1e5 < read.before
    _says_nothing_else(found, "supply_pressure and muscle_pressure are likely in bar, not in psi")


def test_an_absolute_pressure_as_gauge_is_said_first_and_nothing_is_named() -> None:
    """The muscle alone would be 'a pressure that is needed before it pulls', 0.89."""
    found = pamrs.diagnose(HERE / "12_absolute_as_gauge")
    assert found.verdict == "units"
    (read,) = found.misread
    assert (read.channels, read.said, read.likely) == (["muscle_pressure"], "gauge", "absolute")
    assert read.offset == -101325.0
    assert read.factors == [1.0]
    _says_nothing_else(found, "muscle_pressure is likely absolute and not gauge")


def _says_nothing_else(found: pamrs.Diagnosis, claim: str) -> None:
    """The text, the page and JSON begin with the unit, and have no name beside it."""
    assert found.summary().splitlines()[1].startswith(claim[:60])
    assert claim in found.to_html()
    written = json.loads(found.to_json())
    assert claim in written["misread"][0]["text"]
    assert not found.effects
    assert not found.wrong_parameters
    assert {block.verdict for block in found.blocks} == {"not_judged"}


def _as(case: pamrs.recordings.Case, channels: dict[str, float]) -> pamrs.recordings.Case:
    """A case whose values of some channels are in another unit than its log says."""
    turned = [
        replace(r, channels={n: v * channels.get(n, 1.0) for n, v in r.channels.items()})
        for r in case.recordings
    ]
    return replace(case, recordings=turned)


def test_technical_atmospheres_labelled_bar_get_no_name() -> None:
    """2 % of a factor are inside what parameters can do, or are told as the unit."""
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    found = pamrs.diagnose(_as(case, {"muscle_pressure": 1e5 / 98066.5}))
    assert not found.effects
    assert found.verdict in ("parameters", "units")


def test_a_command_in_another_unit_is_told() -> None:
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    found = pamrs.diagnose(_as(case, {"valve_command": 1e-3}))
    assert found.verdict == "units"
    assert found.misread[0].channels == ["valve_command"]
    assert found.misread[0].factors == pytest.approx([1e3])
