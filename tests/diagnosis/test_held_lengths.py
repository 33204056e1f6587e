"""A channel that stands still is its mean: noise of a held length drives no model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare._signals import lengths_of, smoothed
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.recordings import Recording

DT, NOISE = 0.01, 3e-5
LAYOUT = Path(__file__).parents[2] / "cases" / "layouts" / "isometric_bench.toml"
SETTINGS = DiagnosisSettings().prepare


def test_a_held_channel_is_its_mean_and_its_slope_is_zero() -> None:
    held = 0.25 + NOISE * np.random.default_rng(1).normal(size=3000)
    value, slope = smoothed(held, DT, lengths_of(held, NOISE, DT, SETTINGS))
    assert value == pytest.approx(np.full(3000, held.mean()), rel=1e-12)
    assert not slope.any()


@pytest.mark.parametrize("moved", [1.0, 3.0])
def test_a_channel_that_moves_by_some_of_its_noise_is_not_held(moved: float) -> None:
    time = DT * np.arange(3000)
    sine = moved * NOISE * np.sin(2.0 * np.pi * 0.1 * time)
    noisy = sine + NOISE * np.random.default_rng(2).normal(size=3000)
    value, _ = smoothed(noisy, DT, lengths_of(noisy, NOISE, DT, SETTINGS))
    assert np.std(value - sine) < 0.6 * NOISE
    assert np.std(value) > 0.5 * np.std(sine)


def test_drift_of_a_tenth_of_the_noise_is_seen() -> None:
    drift = np.linspace(0.0, 0.5, 12000) * NOISE
    noisy = drift + NOISE * np.random.default_rng(3).normal(size=12000)
    value, _ = smoothed(noisy, DT, lengths_of(noisy, NOISE, DT, SETTINGS))
    assert np.ptp(value) > 0.0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_right_model_of_an_isometric_bench_is_told_nothing(seed: int) -> None:
    rig = pamrs.load_rig(LAYOUT)
    rest = rig.parameter("muscle.rest_length").value
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 30.0, DT)
    recordings = []
    for k, (share, frequency) in enumerate([(0.95, 0.1), (0.90, 0.17), (0.85, 0.24)]):
        pressure = 3e5 - 1.6e5 * np.cos(2.0 * np.pi * frequency * time)
        length = np.full(time.size, share * rest)
        run = pamrs.simulate(rig, length=length, pressure=pressure, sample_time=DT)
        clean = {"muscle_pressure": pressure, "length": length, "force": run["muscle_force"]}
        sizes = {"muscle_pressure": 400.0, "length": NOISE, "force": 1.0}
        channels = {
            n: v[: time.size] + sizes[n] * rng.normal(size=time.size) for n, v in clean.items()
        }
        mask = {n: np.ones(time.size, dtype=bool) for n in channels}
        role = "held_out" if k == 2 else "fit"
        recordings.append(Recording(f"run_{k + 1}", role, time, DT, channels, mask, [], {}))
    found = pamrs.diagnose(pamrs.Case("bench", rig, recordings, Path()))
    assert found.verdict == "none"
