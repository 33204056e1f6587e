"""The same samples under two names prove nothing; a command that is repeated does."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import decimate

import pamrs
from pamrs.diagnosis.prepare import overlap, without_copies
from pamrs.diagnosis.prepare._copies import ARM_WINDOW, WINDOW_SAMPLES
from pamrs.recordings import Recording
from tests.diagnosis.held import RIG as CHAMBER
from tests.diagnosis.held import hold
from tests.diagnosis.noisy import SHOULDER as SENSORS
from tests.diagnosis.noisy import driven

Array = NDArray[np.float64]
RIG = pamrs.rigs.shoulder()
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
    bits: float = 0.0,
    duration: float = 12.0,
) -> Recording:
    """A shoulder under a command, with noise of its own; quantised to multiples of the noise."""
    volts = {"valve_command": command(kind, dt * np.arange(round(duration / dt)))}
    channels = driven(RIG, kind, "fit", dt, volts, SENSORS, [seed]).channels
    for name, size in SENSORS.items() if bits else ():
        channels[name] = np.round(channels[name] / (bits * size)) * bits * size
    return of(f"{kind}{seed}", "fit", dt, channels)


def of(name: str, role: str, dt: float, channels: dict[str, Array]) -> Recording:
    size = len(next(iter(channels.values())))
    mask = {n: np.isfinite(v) for n, v in channels.items()}
    return Recording(
        name, role, dt * np.arange(size), dt, channels, mask, [], {}, source=f"{name}.csv"
    )


def each(one: Recording, change: Callable[[Array], Array], dt: float = 0.0) -> Recording:
    """A copy whose channels are changed, at another sample time where one is given."""
    channels = {n: change(v) for n, v in one.channels.items()}
    return of("copy", "held_out", dt or one.sample_time, channels)


def means_of_five(values: Array) -> Array:
    return values[: values.size // 5 * 5].reshape(-1, 5).mean(axis=1)


def interpolated(one: Recording) -> Recording:
    finer = np.arange(0.0, one.duration, 0.0037)
    return each(one, lambda v: np.interp(finer, one.time, v), 0.0037)


def with_holes(one: Recording) -> Recording:
    gone = np.random.default_rng(3).random(len(one)) < 0.1
    return each(one, lambda v: np.where(gone, np.nan, v))


def extended(one: Recording) -> Recording:
    other = run("multisine", seed=77, dt=one.sample_time).between(0.0, 799 * one.sample_time)
    window = one.between(1000 * one.sample_time, 1999 * one.sample_time)
    return joined("copy", other, window, other)


COPIES: dict[str, Callable[[Recording], Recording]] = {
    "equal": lambda one: each(one, np.copy),
    "shifted": lambda one: each(one, lambda v: v[700:]),
    "window": lambda one: each(one, lambda v: v[900:1900]),
    "every second": lambda one: each(one, lambda v: v[::2], 2 * one.sample_time),
    "means of five": lambda one: each(one, means_of_five, 5 * one.sample_time),
    "filtered": lambda one: each(one, lambda v: decimate(v, 4, ftype="fir"), 4 * one.sample_time),
    "interpolated": interpolated,
    "rounded": lambda one: each(one, lambda v: np.array([float(f"{x:.5g}") for x in v])),
    "with holes": with_holes,
    "extended": extended,
}
"""Copies, as a person makes them."""


SOME_KINDS = [*KINDS[:2], *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS[2:])]


@pytest.mark.parametrize("bits", [pytest.param(0.0, marks=pytest.mark.slow), 2.0])
@pytest.mark.parametrize("kind", SOME_KINDS)
@pytest.mark.parametrize("how", COPIES)
def test_copies_are_found_however_they_were_made(how: str, kind: str, bits: float) -> None:
    one = run(kind, bits=bits)
    copy = COPIES[how](one)
    for first, second in ((copy, one), (one, copy)):
        assert overlap(first, second) is not None


def test_where_the_copy_lies_is_told() -> None:
    one = run()
    found = overlap(COPIES["window"](one), one)
    assert found is not None
    assert found.own == pytest.approx((0.0, 5.0), abs=0.4)
    assert found.other == pytest.approx((4.5, 9.5), abs=0.4)
    assert found.other[0] - found.own[0] == pytest.approx(4.5, abs=0.011)
    assert found.share > 0.9


@pytest.mark.parametrize(
    "bits",
    [
        0.0,
        pytest.param(0.5, marks=pytest.mark.slow),
        pytest.param(2.0, marks=pytest.mark.slow),
        6.0,
    ],
)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dt", [0.002, 0.005, 0.02])
def test_a_repetition_is_no_copy(kind: str, bits: float, dt: float) -> None:
    one, two = run(kind, dt=dt, bits=bits), run(kind, seed=2, dt=dt, bits=bits)
    assert overlap(one, two) is None
    assert overlap(two, one) is None


@pytest.mark.parametrize("dt", [0.001, 0.02])
@pytest.mark.parametrize("kind", KINDS)
def test_a_repetition_at_another_rate_is_no_copy(kind: str, dt: float) -> None:
    assert overlap(run(kind), run(kind, seed=2, dt=dt)) is None


def test_windows_of_one_run_that_do_not_meet_are_two() -> None:
    one = run(duration=40.0)
    assert overlap(one.between(0.0, 19.0), one.between(20.0, 39.0)) is None


def test_rests_on_steps_of_a_converter_are_no_copies() -> None:
    """Two vented muscles, minutes at one reading and its neighbour."""
    rng = np.random.default_rng(5)
    rests = [
        of(f"rest{k}", "fit", 0.01, {"muscle_pressure": 100.0 * (rng.random(6000) < chance)})
        for k, chance in enumerate((0.0, 0.0, 0.01, 0.01, 0.3, 0.3))
    ]
    for a in range(0, 6, 2):
        assert overlap(rests[a], rests[a + 1]) is None


def test_a_copy_is_left_out_of_the_proof_and_said() -> None:
    one, two = run(seed=1), replace(run(seed=2), role="held_out")
    kept, said = without_copies([one, COPIES["shifted"](one), two])
    assert [r.name for r in kept] == [one.name, two.name]
    assert len(said) == 1
    assert "copy (copy.csv) holds the same samples as multisine1 (multisine1.csv)" in said[0]
    assert "it is no held-out proof and was left out of it" in said[0]
    twice, said = without_copies([one, replace(one, name="copy"), two])
    assert [r.name for r in twice] == [one.name, two.name]
    assert "it says nothing more and was left out" in said[0]
    assert without_copies([one, two]) == ([one, two], [])


def joined(name: str, *parts: Recording) -> Recording:
    """Recordings one after the other, to be held out."""
    names = parts[0].channels
    channels = {n: np.concatenate([part.channels[n] for part in parts]) for n in names}
    return of(name, "held_out", parts[0].sample_time, channels)


@pytest.mark.parametrize(
    ("kind", "bits", "count"),
    [*((kind, bits, 1) for kind in KINDS for bits in (0.0, 2.0)), ("steps", 0.0, 4)],
)
def test_what_a_held_out_window_does_not_share_is_kept(kind: str, bits: float, count: int) -> None:
    """Two windows of one file, the second one at another rate too."""
    whole = run(kind, duration=40.0, bits=bits)
    one = whole.between(0.0, 18.0)
    later = whole.between(10.0, 40.0)
    proof = replace(each(later, lambda v: v[::count], count * whole.sample_time), name="proof")
    kept, said = without_copies([one, proof])
    assert [r.name for r in kept] == [one.name, "proof"]
    # the first 8 s of it are shared; a gap, and a window in which that is told, are left out too
    begin = proof.duration - kept[1].duration
    margin = ARM_WINDOW + WINDOW_SAMPLES * proof.sample_time
    assert 8.0 + ARM_WINDOW <= begin <= 8.0 + margin + 0.5
    step = round(begin / proof.sample_time)
    for name, values in kept[1].channels.items():
        np.testing.assert_array_equal(values, proof.channels[name][step:])
    assert overlap(kept[1], one) is None
    assert len(said) == 1
    assert f"{proof.duration:.4g} s are held out, the rest is no proof" in said[0]


def test_a_copy_inside_other_data_leaves_both_sides() -> None:
    one = run(duration=40.0)
    before, after = run(seed=77, duration=15.0), run(seed=78, duration=20.0)
    proof = joined("proof", before, one.between(4.0, 12.0), after)
    kept, said = without_copies([one, proof])
    first, second = (r for r in kept if r.role == "held_out")
    assert first.duration == pytest.approx(15.0 - ARM_WINDOW, abs=0.7)
    assert second.duration == pytest.approx(20.0 - ARM_WINDOW, abs=0.7)
    assert first.duration < 15.0 - ARM_WINDOW
    assert second.duration < 20.0 - ARM_WINDOW
    assert first.name.startswith("proof, 0 to 1")
    assert second.name.endswith(f"{proof.duration:.4g} s")
    assert " and " in said[0]


def test_two_copies_at_different_times_are_both_cut_out() -> None:
    one, two = run(duration=30.0), run("fast", seed=5, duration=30.0)
    new = run(seed=77, duration=24.0)
    proof = joined("proof", two.between(3.0, 13.0), new, one.between(6.0, 16.0))
    kept, _ = without_copies([one, two, proof])
    (left,) = (r for r in kept if r.role == "held_out")
    assert left.duration == pytest.approx(24.0 - 2 * ARM_WINDOW, abs=1.4)
    assert all(overlap(left, fitted) is None for fitted in (one, two))
    at = proof.channels["muscle_pressure"].tolist().index(left.channels["muscle_pressure"][0])
    assert 2000 < at < 2000 + 4800


def test_what_is_left_is_left_out_where_it_is_short() -> None:
    whole = run(duration=40.0)
    proof = replace(whole.between(4.0, 26.0), name="proof", role="held_out")
    kept, said = without_copies([whole.between(0.0, 18.0), proof])
    assert len(kept) == 1
    assert "it is no held-out proof and was left out of it" in said[0]
    assert "s, is too short" in said[0]
    assert re.search(r"does not share, 5\.\d+ s", said[0])


def test_a_rest_that_cannot_be_told_counts_as_shared() -> None:
    """On one step of the converter the copy is what it copies, and says nothing of it."""
    rng = np.random.default_rng(8)
    rough, still = 400.0 * rng.standard_normal(2000), np.zeros(4000)
    one = of("one", "fit", 0.01, {"muscle_pressure": 2e5 + np.r_[rough, still]})
    proof = replace(one, name="proof", role="held_out")
    kept, said = without_copies([one, proof])
    assert kept == [one]
    assert "is too short" not in said[0]


def test_a_stretch_is_kept_once() -> None:
    whole = run(duration=40.0)
    proof = replace(whole.between(10.0, 40.0), name="proof", role="held_out")
    again = replace(proof, name="again")
    kept, said = without_copies([whole.between(0.0, 18.0), proof, again])
    assert [r.name for r in kept] == [whole.name, "proof"]
    assert "again (multisine1.csv) holds the same samples as proof" in said[-1]
    assert "it says nothing more and was left out" in said[-1]


def leaking(duration: float) -> Recording:
    """A recording of a sealed chamber with a leak that its file knows nothing of."""
    return replace(hold(3e-11, duration), source="hold.csv")


def found_in(*recordings: Recording) -> pamrs.Diagnosis:
    return pamrs.diagnose(pamrs.Case("holds", CHAMBER, list(recordings), Path()))


def test_a_diagnosis_is_proved_by_what_is_not_shared() -> None:
    whole = leaking(140.0)
    proof = replace(whole.between(35.0, 140.0), name="proof", role="held_out")
    found = found_in(whole.between(0.0, 60.0), proof)
    assert found.fit.held_out
    assert [effect.id for effect in found.effects] == ["leak_muscle"]
    assert "proof (hold.csv) holds the same samples as hold" in found.warnings[0]
    assert "105 s are held out, the rest is no proof" in found.summary()


def test_a_diagnosis_says_that_there_is_no_proof() -> None:
    one = leaking(60.0)
    found = found_in(one, replace(one, name="again", role="held_out"))
    assert not found.fit.held_out
    assert found.proof == "the fitted recordings (none was held out)"
    assert "again (hold.csv) holds the same samples as hold" in found.warnings[0]
    assert "no held-out proof" in found.summary()
