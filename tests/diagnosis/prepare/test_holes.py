"""Holes in a log, and a recording that cannot be used, do not stop the fit of the others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis import _problems
from pamrs.diagnosis.fit import Fit, Problem, residuals
from pamrs.diagnosis.noise import inflation_of, no_inflation
from pamrs.diagnosis.prepare import check_case
from pamrs.diagnosis.search import refitted, with_inflation
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.noisy import SHOULDER, driven, noisy, without
from tests.diagnosis.stands import ISO, LIMITED, set_in_steps, vented

Array = NDArray[np.float64]
SMALL_TANK = parse_rig(
    ISO.replace('{ value = 20, unit = "l", tol = 0.1 }', '{ value = 2, unit = "l" }')
)
CONDUCTANCE = "valve.fill_conductance"


def holed(one: Recording, *holes: tuple[int, int]) -> Recording:
    """The same without the rows of some holes."""
    channels = {name: values.copy() for name, values in one.channels.items()}
    mask = {name: flags.copy() for name, flags in one.mask.items()}
    for first, last in holes:
        for name in channels:
            channels[name][first:last], mask[name][first:last] = np.nan, False
    return replace(one, channels=channels, mask=mask)


def problem_of(rig: Rig, recordings: list[Recording]) -> Problem:
    """Some recordings to be fitted together, as a diagnosis makes them ready."""
    return _problems(pamrs.Case("case", rig, recordings, Path()), SETTINGS, ())[0]


def at_the_end(problem: Problem, rig: Rig) -> Fit:
    first = refitted(problem, rig, no_inflation(problem.blocks))
    return with_inflation(problem, rig, first, {})[0]


def test_a_tank_without_a_gauge_goes_on_behind_a_hole() -> None:
    """Two holes of 0.06 s in one recording began its tank anew, full: what the chamber then missed
    took the weight from all recordings, and a conductance stayed where the file has it.
    """
    known = SMALL_TANK.parameter(CONDUCTANCE)
    true = SMALL_TANK.with_parameters({CONDUCTANCE: known.value + 0.8 * known.tol})
    gauge = {"muscle_pressure": 400.0}
    made = [vented(true, "fit", seed, gauge) for seed in range(3)]
    whole = at_the_end(problem_of(SMALL_TANK, made), SMALL_TANK)
    broken = [*made[:2], holed(made[2], (460, 472), (1037, 1049))]
    problem = problem_of(SMALL_TANK, broken)
    pressure = [p.signals["supply_pressure"][0] for p in problem_of(SMALL_TANK, made).recordings]
    assert np.abs(problem.recordings[2].signals["supply_pressure"][0] - pressure[2]).max() < 2e3
    found = at_the_end(problem, SMALL_TANK)
    assert found.moved[CONDUCTANCE] == pytest.approx(whole.moved[CONDUCTANCE], abs=0.15)
    assert found.std[CONDUCTANCE] < 1.2 * whole.std[CONDUCTANCE]
    assert max(found.inflation.values()) < 1.5 * max(whole.inflation.values())


def stepped(rig: Rig, role: str, seed: int) -> Recording:
    """Steps of a valve at 50 Hz."""
    command = 5.0 + np.random.default_rng(seed).uniform(-3.0, 3.0, 14)
    given = {"valve_command": command.repeat(35)}
    return driven(rig, f"r{seed}", role, 0.02, given, SHOULDER, [3, seed])


@pytest.mark.parametrize(
    ("rig", "made", "rows"),
    [
        (pamrs.rigs.elbow(), stepped, 3),  # no longer than what is bridged
        (parse_rig(LIMITED), lambda *a: without(set_in_steps(*a), "supply_pressure"), 12),
    ],
    ids=["valve", "regulator"],
)
def test_a_command_that_changes_in_a_hole_is_not_taken_for_physics(rig, made, rows) -> None:  # type: ignore[no-untyped-def]
    """Nobody recorded when: what shows it is not judged, and is told."""
    whole = made(rig, "fit", 1)
    name = next(n for n in whole.channels if "command" in n)
    steps = np.flatnonzero(np.diff(whole.channels[name]))[[3, 8]] + 1
    broken = holed(whole, *((at - rows // 2, at - rows // 2 + rows) for at in steps.tolist()))
    problem = problem_of(rig, [broken])
    found = residuals(problem, rig)
    for block in (b for b in problem.blocks if not b.mechanical):
        one = found[block.name, "r1"]
        assert np.std(one.value[one.rows]) < 1.15 * one.noise, block.name
        assert one.rows.sum() > 0.75 * one.rows.size
    calm = holed(whole, *((at + 12, at + 12 + rows) for at in steps.tolist()))
    (prepared,) = problem_of(rig, [calm]).recordings
    assert not prepared.after_holes


def test_a_wave_in_a_small_hole_is_bridged() -> None:
    """A command that is never the same steps nowhere, and turns smoothly in the hole."""
    time = 0.01 * np.arange(1200)
    command = {"valve_command": 5.0 + 0.6 * np.sin(2.0 * time) + 0.3 * np.sin(5.1 * time)}
    one = driven(pamrs.rigs.elbow(), "r0", "fit", 0.01, command, SHOULDER, [4])
    (prepared,) = problem_of(pamrs.rigs.elbow(), [holed(one, (400, 402), (700, 703))]).recordings
    for block in problem_of(pamrs.rigs.elbow(), [one]).blocks:
        assert prepared.clear(block.drives).all()


BENCH = parse_rig(
    (Path(__file__).parents[3] / "cases" / "layouts" / "isometric_bench.toml")
    .read_text(encoding="utf-8")
    .replace('{ value = 27.6,  unit = "cm" }', '{ value = 27.6, unit = "cm", tol = 0.2 }')
)
MOVED = {"muscle.rest_length": 0.8, "muscle.modulus_scale": 0.5}
"""Where the bench's values are [tolerances]."""


def pulled(rig: Rig, role: str, k: int, **own: Array) -> Recording:
    """The bench at one length, its pressure up and down, with the noise of its sensors."""
    time = 0.01 * np.arange(1500)
    pressure = 2.2e5 - 2.15e5 * np.cos(2.0 * np.pi * (0.1 + 0.07 * k) * time)
    length = np.full(time.size, 0.276 * (0.95 - 0.05 * k))
    run = pamrs.simulate(rig, length=length, pressure=pressure, sample_time=0.01)
    channels = {"muscle_pressure": run["muscle_pressure"], "length": length}
    channels |= {"force": run["muscle_force"]}
    noise = {"muscle_pressure": 400.0, "length": 3e-5, "force": 1.0}
    return noisy(f"r{k}", role, 0.01, channels | own, noise, [6, k])


def true_bench() -> Rig:
    known = {name: BENCH.parameter(name) for name in MOVED}
    return BENCH.with_parameters({n: p.value + MOVED[n] * p.tol for n, p in known.items()})


def beside(**own: Array) -> pamrs.Case:
    """Three recordings of the bench, and one of which some channels are others."""
    true, roles = true_bench(), ("fit", "fit", "held_out")
    made = [pulled(true, role, k) for k, role in enumerate(roles)]
    return pamrs.Case("bench", BENCH, [*made, pulled(true, "fit", 3, **own)], Path())


def found_alike(found: pamrs.Diagnosis) -> None:
    """That the recordings which can be used tell what they tell alone."""
    for name, moved in MOVED.items():
        assert found.parameters[name].moved_sigmas == pytest.approx(moved, abs=0.05)


EDGE = 0.276 * (1.0 - 0.3951)
"""The shortest that the muscle of the rig file can be [m]; the true one cannot."""


@pytest.mark.parametrize("length", [0.3, EDGE + 1e-5], ids=["never", "where the fit goes"])
def test_a_recording_that_the_model_cannot_follow_is_left_out_and_named(length: float) -> None:
    """At the end of the model's range each step of the refit was refused: it crept on."""
    found = pamrs.diagnose(beside(length=np.full(1500, length) + 4e-5 * (length < 0.2)))
    assert found.warnings[0].startswith("recording 'r3' is left out: the model cannot follow it")
    assert "contraction_ratio" in found.warnings[0]
    found_alike(found)
    assert all(one.recording != "r3" for one in found.data)


def test_a_recording_that_fits_nothing_takes_no_weight_from_the_others() -> None:
    """Of another length than its log says: by far the largest misfit, and not everyone's."""
    case = beside(length=np.full(1500, 0.25))
    problem = problem_of(BENCH, [r for r in case.recordings if r.role == "fit"])
    found = at_the_end(problem, BENCH)
    for name, moved in MOVED.items():
        assert found.moved[name] == pytest.approx(moved, abs=0.05)
        assert found.std[name] < 0.1 * found.scales[name]
    inflation = inflation_of(problem, found, {})
    assert list(inflation.apart) == [("force", "r3")]
    assert inflation.apart["force", "r3"] > 1e3 * inflation["force"]
    (told,) = problem.losses.sentences
    assert "block force: the refitted model misses r3 by" in told


def lost(one: Recording, name: str) -> Recording:
    """The same with no usable sample of a channel."""
    none = np.zeros(len(one), dtype=bool)
    values = np.full(len(one), np.nan)
    return replace(
        one, channels=one.channels | {name: values}, mask=one.mask | {name: none}, name="bad"
    )


UNUSABLE = {
    "no channel muscle_pressure": lambda one: without(one, "muscle_pressure"),
    "only 0 of": lambda one: lost(one, "muscle_pressure"),
    "no usable sample of valve_command": lambda one: lost(one, "valve_command"),
    "it has 3 samples": lambda one: one.between(0.0, 0.01),
    "joint_angle is outside its joint's range": lambda one: replace(
        one, channels=one.channels | {"joint_angle": 57.3 * one.channels["joint_angle"]}
    ),
}


@pytest.mark.parametrize("words", UNUSABLE)
def test_a_recording_that_cannot_be_used_is_named_beside_others(words: str) -> None:
    time = 0.005 * np.arange(800)
    command = {"valve_command": 5.0 + 0.45 * np.sin(1.6 * time) + 0.25 * np.sin(4.1 * time)}
    start = {"muscle_pressure": 2e5, "joint_angle": 0.9}
    rig = pamrs.rigs.shoulder()
    good, other = (
        driven(rig, f"r{k}", "fit", 0.005, command, SHOULDER, [k], initial=start) for k in range(2)
    )
    bad = replace(UNUSABLE[words](other), name="bad")
    checked = check_case(pamrs.Case("case", rig, [good, bad], Path()), SETTINGS)
    assert [r.name for r in checked.case.recordings] == ["r0"]
    assert [block.name for block in checked.blocks] == ["supply", "chamber", "arm"]
    assert checked.suspected[0].startswith("recording 'bad' is left out: ")
    assert words in checked.suspected[0]
    refused = "surround any block" if "no channel" in words else words
    with pytest.raises(pamrs.DiagnosisError, match=refused):  # alone it is refused
        pamrs.diagnose(pamrs.Case("case", rig, [bad], Path()))


def test_a_refit_that_went_no_further_says_so() -> None:
    """A limit of the rig file that a moved value would break refuses each of its steps."""
    text = BENCH.to_toml_text().replace(
        "min_length = { value = 17.0,", "min_length = { value = 16.7,"
    )
    tight = parse_rig(text)
    assert tight.model["load"]["min_length"] == pytest.approx(0.167)
    problem = problem_of(tight, [pulled(true_bench(), "fit", k) for k in range(3)])
    found = refitted(problem, tight, no_inflation(problem.blocks))
    assert abs(found.moved["muscle.rest_length"]) < 0.1
    (told,) = problem.losses.sentences
    assert "the refit of the baseline stopped" in told
    assert "load.min_length = 16.7 cm" in told
