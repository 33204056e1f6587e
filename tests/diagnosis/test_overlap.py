"""The same samples under two names prove nothing; a command that is repeated does."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import decimate

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import overlap, without_copies
from pamrs.recordings import Recording

Array = NDArray[np.float64]
SETTINGS = DiagnosisSettings().overlap
RIG = pamrs.rigs.shoulder()
SENSORS = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
KINDS = ("multisine", "steps", "holds", "fast")


def command(kind: str, time: Array) -> Array:
    """Commands that a stand repeats: smooth, in steps, mostly at rest, fast."""
    if kind == "multisine":
        return 5.0 + 0.4 * np.sin(1.3 * time) + 0.2 * np.sin(4.4 * time)
    if kind == "steps":
        return 5.0 + 0.6 * np.sign(np.sin(2 * np.pi * time / 4.0))
    if kind == "holds":
        return np.where(time < 2.0, 5.6, 5.0)
    return 5.0 + 0.8 * np.sin(2 * np.pi * 3.0 * time)


@cache
def run(
    kind: str = "multisine",
    *,
    seed: int = 1,
    dt: float = 0.005,
    noise: float = 1.0,
    bits: float = 0.0,
    duration: float = 16.0,
    role: str = "fit",
) -> Recording:
    """A shoulder under a command, with noise of its own; quantised to multiples of the noise."""
    time = dt * np.arange(round(duration / dt))
    volts = command(kind, time)
    made = pamrs.simulate(RIG, volts, sample_time=dt)
    rng = np.random.default_rng(seed)
    channels = {"valve_command": volts}
    for name, size in SENSORS.items():
        values = made[name] + noise * size * rng.standard_normal(time.size)
        channels[name] = np.round(values / (bits * size)) * bits * size if bits else values
    return of(f"{kind}{seed}", role, dt, channels)


def of(name: str, role: str, dt: float, channels: dict[str, Array]) -> Recording:
    size = len(next(iter(channels.values())))
    mask = {n: np.isfinite(v) for n, v in channels.items()}
    return Recording(
        name, role, dt * np.arange(size), dt, channels, mask, [], {}, source=f"{name}.csv"
    )


def changed(one: Recording, how: str) -> Recording:
    """A copy, as a person makes one."""
    channels, dt = dict(one.channels), one.sample_time
    if how == "shifted":
        channels = {n: v[700:] for n, v in channels.items()}
    elif how == "window":
        channels = {n: v[900:1900] for n, v in channels.items()}
    elif how == "every second":
        channels, dt = {n: v[::2] for n, v in channels.items()}, 2 * dt
    elif how == "means of five":
        channels = {
            n: v[: v.size // 5 * 5].reshape(-1, 5).mean(axis=1) for n, v in channels.items()
        }
        dt *= 5
    elif how == "filtered":
        channels, dt = {n: decimate(v, 4, ftype="fir") for n, v in channels.items()}, 4 * dt
    elif how == "interpolated":
        finer = np.arange(0.0, one.duration, 0.0037)
        channels = {n: np.interp(finer, one.time, v) for n, v in channels.items()}
        dt = 0.0037
    elif how == "rounded":
        channels = {n: np.array([float(f"{x:.5g}") for x in v]) for n, v in channels.items()}
    elif how == "with holes":
        gone = np.random.default_rng(3).random(len(one)) < 0.1
        channels = {n: np.where(gone, np.nan, v) for n, v in channels.items()}
    elif how == "extended":
        other = run("multisine", seed=77, dt=dt)
        channels = {
            n: np.concatenate([other.channels[n][:800], v[1000:2000], other.channels[n][:800]])
            for n, v in channels.items()
        }
    return of("copy", "held_out", dt, channels)


COPIES = (
    "equal",
    "shifted",
    "window",
    "every second",
    "means of five",
    "filtered",
    "interpolated",
    "rounded",
    "with holes",
    "extended",
)


@pytest.mark.parametrize("bits", [0.0, 2.0])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("how", COPIES)
def test_copies_are_found_however_they_were_made(how: str, kind: str, bits: float) -> None:
    one = run(kind, bits=bits)
    copy = changed(one, how)
    for first, second in ((copy, one), (one, copy)):
        assert overlap(first, second, SETTINGS) is not None


def test_where_the_copy_lies_is_told() -> None:
    one = run()
    found = overlap(changed(one, "window"), one, SETTINGS)
    assert found is not None
    assert found.own == pytest.approx((0.0, 5.0), abs=0.4)
    assert found.other == pytest.approx((4.5, 9.5), abs=0.4)
    assert found.other[0] - found.own[0] == pytest.approx(4.5, abs=0.011)
    assert found.share > 0.9


@pytest.mark.parametrize("bits", [0.0, 0.5, 2.0, 6.0])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dt", [0.002, 0.005, 0.02])
def test_a_repetition_is_no_copy(kind: str, bits: float, dt: float) -> None:
    one, two = run(kind, dt=dt, bits=bits), run(kind, seed=2, dt=dt, bits=bits)
    assert overlap(one, two, SETTINGS) is None
    assert overlap(two, one, SETTINGS) is None


@pytest.mark.parametrize("kind", KINDS)
def test_a_repetition_at_another_rate_is_no_copy(kind: str) -> None:
    assert overlap(run(kind), run(kind, seed=2, dt=0.001), SETTINGS) is None
    assert overlap(run(kind), run(kind, seed=2, dt=0.02), SETTINGS) is None


def test_windows_of_one_run_that_do_not_meet_are_two() -> None:
    one = run(duration=40.0)
    assert overlap(one.between(0.0, 19.0), one.between(20.0, 39.0), SETTINGS) is None


def test_rests_on_steps_of_a_converter_are_no_copies() -> None:
    """Two vented muscles, minutes at one reading and its neighbour."""
    rng = np.random.default_rng(5)
    rests = [
        of(f"rest{k}", "fit", 0.01, {"muscle_pressure": 100.0 * (rng.random(6000) < chance)})
        for k, chance in enumerate((0.0, 0.0, 0.01, 0.01, 0.3, 0.3))
    ]
    for a in range(0, 6, 2):
        assert overlap(rests[a], rests[a + 1], SETTINGS) is None


def test_a_copy_is_left_out_of_the_proof_and_said() -> None:
    one, two = run(seed=1), replace(run(seed=2), role="held_out")
    kept, said = without_copies([one, changed(one, "shifted"), two], SETTINGS)
    assert [r.name for r in kept] == [one.name, two.name]
    assert len(said) == 1
    assert "copy (copy.csv) holds the same samples as multisine1 (multisine1.csv)" in said[0]
    assert "it is no held-out proof and was left out of it" in said[0]
    twice, said = without_copies([one, replace(changed(one, "equal"), role="fit"), two], SETTINGS)
    assert [r.name for r in twice] == [one.name, two.name]
    assert "it says nothing more and was left out" in said[0]
    assert without_copies([one, two], SETTINGS) == ([one, two], [])


def test_a_diagnosis_says_that_there_is_no_proof() -> None:
    rig = pamrs.rigs.sealed_chamber()
    leaky = rig.with_effect("leak_muscle", {"conductance": 3e-11})
    made = pamrs.simulate(
        leaky, duration=60.0, sample_time=0.1, step=0.01, initial={"muscle_pressure": 7e5}
    )
    noise = np.random.default_rng(1).normal(0.0, 150.0, made.time.size)
    hold = of("hold", "fit", 0.1, {"muscle_pressure": made["muscle_pressure"] + noise})
    again = replace(hold, name="again", role="held_out")
    found = pamrs.diagnose(pamrs.Case("twice", rig, [hold, again], Path()))
    assert not found.fit.held_out
    assert found.proof == "the fitted recordings (none was held out)"
    assert "again (hold.csv) holds the same samples as hold" in found.warnings[0]
    assert "no held-out proof" in found.summary()
