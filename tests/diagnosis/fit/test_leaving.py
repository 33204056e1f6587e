"""Where no recording is held out, each is predicted by the others: as a fit to the others would,
without one. What is predicted is as uncertain as the parameters are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import (
    Fit,
    Problem,
    fit,
    predicted_by_others,
    predicted_with_doubt,
    residuals,
    stacked,
)
from pamrs.recordings import Recording
from tests.diagnosis.asked import diagnosed, problem_of
from tests.diagnosis.held import hold as held_chamber
from tests.diagnosis.noisy import SHOULDER, driven

RIG = pamrs.rigs.sealed_chamber()


def hold(name: str, conductance: float, seconds: float = 60.0, seed: int = 0) -> Recording:
    return held_chamber(conductance, seconds, name=name, seed=seed)


def problem(*recordings: Recording) -> Problem:
    return problem_of(RIG, recordings)


WHITE = {"chamber": 1.0}


def leaking(given: Problem) -> Fit:
    """The leak fitted to every recording of a problem."""
    start, fixed = {"leak_muscle.conductance": 1e-11}, {"leak_muscle.laminar_share": 0.0}
    effects = ("leak_muscle",)
    return fit(given, RIG, effects, start, WHITE, fixed=fixed, evaluations=30, share=0.0)


def rms(found: object, key: tuple[str, str]) -> float:
    return float(np.sqrt(np.mean(found[key].value ** 2)))  # type: ignore[index]


def test_one_step_is_what_a_fit_to_the_others_predicts() -> None:
    leaks = {"one": 2e-11, "two": 2.2e-11, "three": 2.6e-11}
    everything = problem(*(hold(n, c, seed=k) for k, (n, c) in enumerate(leaks.items())))
    found = leaking(everything)
    away = predicted_by_others(everything, found, WHITE)
    for k, name in enumerate(leaks):
        every = everything.recordings
        others = replace(everything, recordings=[*every[:k], *every[k + 1 :]])
        alone = replace(everything, recordings=[every[k]])
        refitted = residuals(alone, leaking(others).rig)
        key = (everything.blocks[0].name, name)
        assert rms(away, key) > 1.1 * rms(found.residuals, key)
        assert abs(rms(away, key) / rms(refitted, key) - 1.0) < 0.05


def test_of_one_recording_each_piece_is_predicted_by_the_others() -> None:
    # a bump that no leak makes pulls at all of them
    bumpy = hold("one", 2e-11)
    bumpy.channels["muscle_pressure"][150:200] -= 2000.0
    single = problem(bumpy)
    found = leaking(single)
    key = (single.blocks[0].name, "one")
    own, away = found.residuals[key], predicted_by_others(single, found, {key[0]: 1.0})[key]
    # the last fifth against a linear fit to the first four
    rows, slope = stacked(single, found.residuals, {key[0]: 1.0})
    assert slope is not None
    assert own.jacobian is not None
    names = list(found.values)
    scales = np.array([found.scales[n] for n in names])
    first = slice(0, 4 * rows.size // 5)
    held = np.diag([1.0 if n in found.held_by_prior else 0.0 for n in names])
    moved = np.array([found.held_by_prior.get(n, 0.0) for n in names])
    near = slope[first] * scales
    step = -np.linalg.solve(near.T @ near + held, near.T @ rows[first] + moved)
    last = slice(4 * own.value.size // 5 + 1, None)  # a bin may begin one sample later
    expected = own.value[last] - own.jacobian[last] @ (scales * step)
    assert np.abs(expected - own.value[last]).max() > 100.0
    np.testing.assert_allclose(away.value[last], expected, atol=5.0)


def test_what_one_recording_alone_tells_is_taken_from_it() -> None:
    together = problem(hold("long", 2e-11, 200.0), hold("short", 2e-11, 4.0, seed=1))
    found = leaking(together)
    away = predicted_by_others(together, found, WHITE)
    key = (together.blocks[0].name, "long")
    assert rms(away, key) < 1.01 * rms(found.residuals, key)


def of_leaks(*leaks: float) -> pamrs.Diagnosis:
    """Of two holds of two minutes."""
    return diagnosed(RIG, lambda _, k: hold(f"r{k}", leaks[k], 120.0, seed=k), ("fit", "fit"))


def test_recordings_without_roles_name_a_leak_that_is_in_all_of_them() -> None:
    found = of_leaks(3e-11, 3e-11)
    assert found.effects[0]["id"] == "leak_muscle"
    assert any("how the other recordings predict each" in w for w in found.warnings)
    one, two = (
        next(t for t in found.tried if t["effects"] == e)["held_out"]["chamber"]
        for e in ([], ["leak_muscle"])
    )
    assert one > 20.0 * two


@pytest.mark.slow
def test_a_leak_that_is_another_in_each_recording_is_less_sure() -> None:
    alike, differ = of_leaks(3e-11, 3e-11), of_leaks(1e-11, 9e-11)
    # a name still carries most of it; that it is not the same in both speaks against it
    assert differ.probabilities["unlisted"] > 3.0 * alike.probabilities["unlisted"]


SHOULDER_RIG = pamrs.rigs.shoulder()


def moved(truth: pamrs.Rig, name: str, swing: float, seed: int) -> Recording:
    """Eight seconds about the null of the valve, which stays shut without a swing."""
    dt = 0.01
    command = 5.0 + swing * np.sin(1.7 * dt * np.arange(800))
    given, start = {"valve_command": command}, {"muscle_pressure": 2e5}
    return driven(truth, name, "fit", dt, given, SHOULDER, [44, seed], initial=start)


def power(there: Problem, found: dict[tuple[str, str], object]) -> float:
    rows, _ = stacked(there, found, WHITE)  # type: ignore[arg-type]
    return float(np.mean(rows**2))


@pytest.mark.parametrize(("leak", "explained"), [(0.0, True), (4e-9, False)])
def test_what_the_fit_leaves_open_is_no_mismatch_and_anything_else_is(
    leak: float, explained: bool
) -> None:
    # shut, a valve says nothing of its area, which is 1.8 tolerances off
    area = SHOULDER_RIG.parameter("valve.discharge_area_max")
    truth = SHOULDER_RIG.with_parameters({area.name: area.value + 1.8 * area.tol})
    shut = problem_of(SHOULDER_RIG, [moved(truth, "shut", 0.0, 1)], "chamber")
    there = truth.with_effect("leak_muscle", {"conductance": leak}) if leak else truth
    moving = problem_of(SHOULDER_RIG, [moved(there, "moving", 0.3, 2)], "chamber")
    found = fit(shut, SHOULDER_RIG, (), {}, WHITE)
    assert found.std[area.name] > 0.9 * area.tol
    plain = power(moving, residuals(moving, found.rig))
    doubted = power(moving, predicted_with_doubt(moving, found))
    assert plain > 3.0
    assert (doubted < 1.3) == explained
    assert doubted < plain
