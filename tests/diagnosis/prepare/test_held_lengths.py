"""A channel that is held or drifts is one cubic: noise of a held length drives no model."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare._signals import lengths_of, smoothed
from tests.diagnosis import frames
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.frames import DT, played

NOISE = frames.NOISE["length"]
ROUGHLY = {"rest_length": 0.1, "rest_diameter": 0.01, "braid_angle": 0.5, "wall_thickness": 0.005}
"""Tolerances of a shape that nobody measured, in the units of the layout."""
LAYOUT = Path(__file__).parents[3] / "cases" / "layouts" / "isometric_bench.toml"


@pytest.mark.parametrize("drift", [0.0, 1.0, 20.0])
def test_a_held_channel_or_one_that_drifts_is_one_cubic(drift: float) -> None:
    true = 0.25 + drift * NOISE * np.linspace(0.0, 1.0, 3000)
    noisy = true + NOISE * np.random.default_rng(1).normal(size=3000)
    value, slope = smoothed(noisy, DT, lengths_of(noisy, NOISE, DT, SETTINGS))
    assert np.abs(value - true).max() < 0.15 * NOISE
    assert slope == pytest.approx(np.gradient(value, DT), abs=1e-3 * NOISE)


@pytest.mark.parametrize("moved", [1.0, 3.0])
@pytest.mark.parametrize("frequency", [0.1, 1.5, 7.0, 13.0])
def test_a_channel_that_moves_by_some_of_its_noise_is_no_cubic(
    moved: float, frequency: float
) -> None:
    sine = moved * NOISE * np.sin(2.0 * np.pi * frequency * DT * np.arange(3000))
    noisy = sine + NOISE * np.random.default_rng(2).normal(size=3000)
    assert lengths_of(noisy, NOISE, DT, SETTINGS).any()


def test_a_short_move_in_a_long_recording_is_seen() -> None:
    noisy = NOISE * np.random.default_rng(3).normal(size=60000)
    noisy[30000:30050] += 3.0 * NOISE
    assert lengths_of(noisy, NOISE, DT, SETTINGS).any()


def bench(plant: pamrs.Rig, rig: pamrs.Rig, seed: int, drift: float) -> pamrs.Case:
    """Three logs at held lengths, which drift by so many of their noises."""
    rest = rig.parameter("muscle.rest_length").value
    time = np.arange(0.0, 30.0, DT)
    recordings = []
    for k, (share, frequency) in enumerate([(0.95, 0.1), (0.90, 0.17), (0.85, 0.24)]):
        pressure = 3e5 - 1.6e5 * np.cos(2.0 * np.pi * frequency * time)
        length = share * rest + drift * NOISE * time / time[-1]
        role = "held_out" if k == 2 else "fit"
        recordings.append(played(plant, f"run_{k + 1}", role, length, pressure, 10 * seed + k))
    return pamrs.Case("bench", rig, recordings, Path())


@pytest.mark.parametrize(("seed", "drift"), [(1, 0.0), (2, 1.0)])
def test_a_right_model_of_an_isometric_bench_is_told_nothing(seed: int, drift: float) -> None:
    rig = pamrs.load_rig(LAYOUT)
    found = pamrs.diagnose(bench(rig, rig, seed, drift))
    assert found.verdict == "none"
    assert not any("is fitted to each recording" in w for w in found.warnings)


def test_a_force_that_is_missing_all_the_time_is_said() -> None:
    rig = pamrs.load_rig(LAYOUT)
    case = bench(rig, rig, 1, 0.0)
    more = [r.channels | {"force": r.channels["force"] + 45.0} for r in case.recordings]
    off = [replace(r, channels=own) for r, own in zip(case.recordings, more, strict=True)]
    found = pamrs.diagnose(replace(case, recordings=off))
    (warning,) = (w for w in found.warnings if "is fitted to each recording" in w)
    assert warning.startswith("muscle_force of the whole rig is ")
    assert found.verdict == "none"  # a force that never changes may be the cell's zero


@pytest.mark.parametrize("measured", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_threshold_of_an_isometric_bench_is_named_where_its_shape_is_known(
    tmp_path: Path, *, measured: bool
) -> None:
    """A wall 4 % off does to a held force what the threshold does, if the file allows it."""
    text, file = LAYOUT.read_text(), tmp_path / "bench.toml"
    for key, tol in () if measured else ROUGHLY.items():
        text = re.sub(rf"^({key}\s*=.*?)\s*}}", rf"\1, tol = {tol} }}", text, flags=re.MULTILINE)
    file.write_text(text)
    rig = pamrs.load_rig(file)
    plant = rig.with_effect("activation_pressure", {"threshold": 8e3})
    found = pamrs.diagnose(bench(plant, rig, 1, 0.0))
    if measured:
        assert found.effects[0]["id"] == "activation_pressure"
        value = found.effects[0]["parameters"]["threshold"]
        assert abs(value["value"] - 8e3) < 2.0 * value["std"]
    else:
        assert found.verdict == "parameters"
        assert not found.effects
