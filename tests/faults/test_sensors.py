"""What a sensor or the unit of its column does to a log, and what is to be said of it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import prepare, without_rails
from pamrs.diagnosis.result import schema
from pamrs.diagnosis.settings import DiagnosisSettings, PlausibilitySettings
from pamrs.errors import DiagnosisError
from pamrs.recordings import Case, Recording
from pamrs.report import render_html

HERE = Path(__file__).parent
ROOT = Path(pamrs.__file__).parent / "rigs"


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
    assert claim.replace("_", " ") in render_html(found).replace("_", " ")
    jsonschema.validate(json.loads(found.to_json()), schema())
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


def test_volts_labelled_millivolts_are_told() -> None:
    case = _as(pamrs.load_case(HERE / "13_gauge_clipped"), {"valve_command": 1e-3})
    said = [replace(r, said=r.said | {"valve_command": "mV"}) for r in case.recordings]
    found = pamrs.diagnose(replace(case, recordings=said))
    assert found.verdict == "units"
    assert found.misread[0].channels == ["valve_command"]
    assert found.misread[0].likely == "V"
    assert found.misread[0].factors == pytest.approx([1e3])


@pytest.mark.parametrize("grid", [0.002, 0.005])
def test_noise_does_not_follow_interpolation(tmp_path: Path, grid: float) -> None:
    """Events 35 ms apart, of a converter with steps of 1.2 kPa, on a grid that is finer."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.035)
    pressure = 2e5 + 1e5 * np.sin(0.7 * time) + rng.normal(0.0, 300.0, time.size)
    rows = "\n".join(
        f"{t:.6f},{round(p / 1200.0) * 1200.0}" for t, p in zip(time, pressure, strict=True)
    )
    file = tmp_path / "log.csv"
    file.write_text(f"time [s],muscle_pressure [Pa]\n{rows}\n")
    recording = pamrs.load_recording(file, sample_time=grid)
    rig = pamrs.load_rig(ROOT / "sealed_chamber.toml")
    noise = prepare(recording, rig, DiagnosisSettings()).noise["muscle_pressure"]
    # each event counts once: white noise of the grid that is as large in the mean of many
    single = noise * math.sqrt(grid / 0.035)
    assert 346.0 <= single < 1200.0
    assert recording.logged["muscle_pressure"][0] == pytest.approx(0.035, rel=1e-3)


def test_noise_of_what_is_on_its_own_grid_is_as_it_was() -> None:
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    assert not any(recording.logged for recording in case.recordings)


def _healthy(change: Callable[[dict[str, np.ndarray]], None]) -> pamrs.recordings.Case:
    """A sound rig at 100 Hz, of which a sensor or logger spoils something."""
    case = pamrs.load_case(HERE / "12_absolute_as_gauge")
    spoilt = []
    for recording in case.recordings:
        channels = {name: values.copy() for name, values in recording.channels.items()}
        channels["muscle_pressure"] -= 101325.0
        change(channels)
        mask = {name: np.isfinite(values) for name, values in channels.items()}
        spoilt.append(replace(recording, channels=channels, mask=mask))
    return replace(case, recordings=spoilt)


def test_rounding_to_eight_bits_is_no_physics() -> None:
    """Of a coarse converter the rounding is not white: it stays for as long as a step lasts."""

    def rounded(channels: dict[str, np.ndarray]) -> None:
        for name, top in (("supply_pressure", 1.6e6), ("muscle_pressure", 1.6e6)):
            step = top / 256
            channels[name][:] = np.round(channels[name] / step) * step
        step = np.pi / 256
        channels["joint_angle"][:] = np.round(channels["joint_angle"] / step) * step

    case = _healthy(rounded)
    made = prepare(case.recordings[0], case.rig, DiagnosisSettings())
    assert made.steps["muscle_pressure"] == pytest.approx(6250.0)
    found = pamrs.diagnose(case)
    assert found.verdict in ("none", "parameters")


def test_blocks_without_a_value_are_no_physics() -> None:
    def holes(channels: dict[str, np.ndarray]) -> None:
        channels["muscle_pressure"][300:380] = np.nan
        channels["joint_angle"][600:650] = np.nan

    assert pamrs.diagnose(_healthy(holes)).verdict in ("none", "parameters")


def test_a_command_that_was_not_logged_is_refused_with_its_evidence() -> None:
    def dead(channels: dict[str, np.ndarray]) -> None:
        channels["valve_command"][:] = 5.0

    with pytest.raises(DiagnosisError, match="valve_command has one value throughout"):
        pamrs.diagnose(_healthy(dead))


@pytest.mark.parametrize(("count", "apart"), [(16, 2.0), (37, 1.0)])
@pytest.mark.parametrize("leak", [0.0, 0.01])
def test_few_samples_tell_a_leak(count: int, apart: float, leak: float) -> None:
    rng = np.random.default_rng(count)
    time = np.arange(count) * apart
    recordings = []
    for name in ("one", "two"):
        pressure = 4e5 * np.exp(-leak * time) + rng.normal(0.0, 300.0, count)
        recordings.append(
            Recording(
                name,
                "fit",
                time,
                apart,
                {"muscle_pressure": pressure},
                {"muscle_pressure": np.ones(count, dtype=bool)},
                units={"muscle_pressure": "Pa"},
            )
        )
    rig = pamrs.load_rig(ROOT / "sealed_chamber.toml")
    found = pamrs.diagnose(Case("short", rig, recordings, HERE))
    assert [effect.id for effect in found.effects][:1] == (["leak_muscle"] if leak else [])
