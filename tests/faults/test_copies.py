"""Of a held-out recording that copies a fitted one there is no proof; of a repetition there is."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import overlap, without_copies
from pamrs.recordings import Recording
from tests.diagnosis.prepare.test_overlap import KINDS, SENSORS, SOME_KINDS, of, run

Array = NDArray[np.float64]
HERE = Path(__file__).parent
SETTINGS = DiagnosisSettings()
RANGES = {"supply_pressure": 16e5, "muscle_pressure": 16e5, "joint_angle": np.pi}

ALTERED = (
    *("8 bit", "10 bit", "noise", "three times its noise", "mean of 41", "clock", "reversed"),
    *("clock, resampled", "clock, resampled the other way"),
)


def altered(one: Recording, how: str) -> Recording:
    """A copy that is to pass for another recording."""
    rng = np.random.default_rng(len(how) + 100 * ord(one.name[-1]))
    sensed = {n: v for n, v in one.channels.items() if n in SENSORS}
    rows, dt = np.arange(len(one), dtype=float), one.sample_time
    command = one.channels["valve_command"]
    if how.endswith("bit"):
        steps = {n: RANGES[n] / 2 ** int(how.split()[0]) for n in sensed}
        sensed = {n: np.round(v / steps[n]) * steps[n] for n, v in sensed.items()}
    elif how.endswith("noise"):
        more = 3.0 if how.startswith("three") else 1.0
        sensed = {n: v + more * SENSORS[n] * rng.standard_normal(v.size) for n, v in sensed.items()}
    elif how == "mean of 41":
        sensed = {n: np.convolve(v, np.ones(41) / 41, "valid") for n, v in sensed.items()}
        command = command[20:-20]
    elif how == "clock":
        dt *= 1.02
    elif how.startswith("clock"):
        at = rows / 1.02 if how.endswith("way") else 1.02 * rows[: int(rows.size / 1.02)]
        sensed = {n: np.interp(at, rows, v) for n, v in sensed.items()}
        command = np.interp(at, rows, command)
    else:
        sensed, command = {n: v[::-1] for n, v in sensed.items()}, command[::-1]
    return of("altered", "held_out", dt, {"valve_command": command, **sensed})


def half(one: Recording, first: int, role: str) -> Recording:
    """Every second sample."""
    channels = {n: v[first::2] for n, v in one.channels.items()}
    return of(f"half{first}", role, 2.0 * one.sample_time, channels)


@pytest.mark.parametrize("name", ["14_copy_odd_even", "15_copy_10_bit"])
def test_a_copy_is_no_proof(name: str) -> None:
    case = pamrs.load_case(HERE / name)
    kept, said = without_copies(case.recordings)
    assert [one.role for one in kept] == ["fit"]
    assert re.search(r"^z \(.*z\.csv\) holds the same samples as a .*, noise included", said[0])
    assert "it is no held-out proof and was left out of it" in said[0]


def test_a_diagnosis_of_a_copy_says_that_there_is_no_proof() -> None:
    found = pamrs.diagnose(pamrs.load_case(HERE / "15_copy_10_bit"))
    assert not found.fit.held_out
    assert found.proof == "the fitted recordings (none was held out)"
    assert "on held-out recordings" not in found.summary()


def test_a_repetition_on_the_same_steps_of_a_converter_is_a_proof() -> None:
    """Eight bits, noise of a sixth of a step: what the two share is the command's."""
    case = pamrs.load_case(HERE / "16_repeat_8_bit")
    kept, said = without_copies(case.recordings)
    assert not said
    assert [one.role for one in kept] == ["fit", "held_out"]
    # one of them twice is a copy all the same
    again = replace(case.recordings[0], role="held_out")
    assert len(without_copies([case.recordings[0], again])[0]) == 1


@pytest.mark.parametrize("kind", SOME_KINDS)
@pytest.mark.parametrize("how", ALTERED)
def test_a_copy_that_was_altered_is_found_and_a_repetition_is_not(how: str, kind: str) -> None:
    one, two = run(kind), run(kind, seed=2)
    copy = altered(one, how)
    assert not [k for k in without_copies([one, copy])[0] if k.role == "held_out"]
    if how != "reversed":
        assert overlap(altered(two, how), one) is None
        assert overlap(altered(two, how), altered(one, how)) is None


@pytest.mark.parametrize("kind", ["multisine", "steps", "fast"])
def test_odd_and_even_samples_of_a_log_do_not_prove_each_other(kind: str) -> None:
    one = run(kind)
    kept, _ = without_copies([half(one, 0, "fit"), half(one, 1, "held_out")])
    assert [r.role for r in kept] == ["fit"]
    again = half(run(kind, seed=2), 0, "held_out")
    assert len(without_copies([half(one, 0, "fit"), again])[0]) == 2


@pytest.mark.parametrize("name", SENSORS)
@pytest.mark.parametrize("kind", KINDS)
def test_one_channel_of_a_repetition_may_be_the_copy(kind: str, name: str) -> None:
    one, two = run(kind), run(kind, seed=2)
    mixed = of("mixed", "held_out", one.sample_time, two.channels | {name: one.channels[name]})
    assert len(without_copies([one, mixed])[0]) == 1
    assert len(without_copies([one, replace(two, role="held_out")])[0]) == 2


@pytest.mark.parametrize("seed", [0, 3, 5, 9])
def test_commands_in_many_sharp_steps_are_no_copies(seed: int) -> None:
    """Every corner of the signals is in the same sample of a repetition, whatever its noise."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(5.0 + rng.uniform(-1.5, 1.5, 80), 50)
    made = pamrs.simulate(pamrs.rigs.shoulder(), volts, sample_time=0.005)
    for noise in (0.05, 1.0):
        pair = []
        for role in ("fit", "held_out"):
            own = {n: made[n] + noise * s * rng.standard_normal(4000) for n, s in SENSORS.items()}
            pair.append(of(role, role, 0.005, {"valve_command": volts} | own))
        assert len(without_copies(pair)[0]) == 2
