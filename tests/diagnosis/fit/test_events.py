"""Pushes and payload changes at times of their own are found where they were put."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import Events, fit, fit_events, refit_events, residuals
from pamrs.diagnosis.fit._vibration import lines_of
from pamrs.diagnosis.prepare import Residual
from pamrs.effects import Term
from pamrs.recordings import Recording
from tests.diagnosis.asked import ROLES, problem_of
from tests.diagnosis.noisy import SHOULDER, driven

RIG = pamrs.rigs.shoulder()
TIMES = {"lift": 4.3, "lower": 7.1, "again": 5.6}


def recordings(
    effect: str,
    make: dict[str, float],
    duration: float = 12.0,
    *,
    plant: pamrs.Rig = RIG,
    form: str = "",
    own: dict[str, dict[str, float]] | None = None,
) -> list[Recording]:
    """Recordings of a shoulder with an event each, with the noise of transducers.

    ``own`` has what happens in each recording, where that is no event at its time.
    """
    found = []
    for number, (name, when) in enumerate(TIMES.items()):
        time = np.arange(0.0, duration, 0.005)
        command = (
            5.0
            + (0.35 + 0.1 * number) * np.sin(2 * np.pi * 0.15 * time)
            + 0.25 * np.sin(2 * np.pi * 0.4 * time + number)
        )
        here = {"time": when} if own is None else own[name]
        rig = plant.with_effect(effect, make | here, form=form)
        given = {"valve_command": command}
        found.append(driven(rig, name, ROLES[number], 0.005, given, SHOULDER, [2014, number]))
    return found


def found_in(records: list[Recording], **options: Any) -> pamrs.Diagnosis:
    return pamrs.diagnose(pamrs.Case("events", RIG, records, Path()), **options)


@pytest.mark.parametrize(
    ("effect", "make"),
    [
        ("external_torque", {"torque": 3.0, "duration": 0.8}),
        pytest.param("payload_change", {"mass_change": 0.4}, marks=pytest.mark.slow),
    ],
)
def test_an_event_is_named_with_its_times(effect: str, make: dict[str, float]) -> None:
    found = found_in(recordings(effect, make, 9.0))
    assert found.verdict == "effects"
    assert found.effects[0]["id"] == effect
    assert found.probabilities[effect] > 0.8
    size = next(iter(make))
    events = sorted(found.effects[0]["events"], key=lambda entry: abs(entry[size]))
    times = {entry["recording"]: entry["time"] for entry in events}  # the largest of each recording
    assert times.keys() == TIMES.keys()
    for name, when in TIMES.items():
        assert abs(times[name] - when) < 0.25, name
    assert found.fit["gap_closed"] > 0.8


def test_events_are_fitted_on_where_their_recordings_count_less() -> None:
    """A heavier payload is taken back to the file's as the recordings lose their weight."""
    payload = RIG.parameter("arm.payload")
    heavier = RIG.with_parameters({payload.name: payload.value + 2.0 * payload.tol})
    push = {"torque": 3.0, "duration": 0.8}
    problem = problem_of(RIG, recordings("external_torque", push, 9.0, plant=heavier))
    problem = replace(problem, blocks=[b for b in problem.blocks if b.name == "arm"])
    white, light = {"arm": 1.0}, {"arm": 1e6}
    baseline = fit(problem, RIG, (), {}, white)
    found = fit_events(Term("external_torque"), problem, RIG, baseline, white)
    assert found is not None
    again = refit_events(found, problem, RIG, baseline, light)
    assert (found.inflation, again.inflation) == (white, light)
    assert found.moved[payload.name] > 1.5
    assert abs(again.moved[payload.name]) < 0.5 * found.moved[payload.name]
    assert again.events is not None
    assert again.events.values.keys() == found.events.values.keys() == TIMES.keys()


@pytest.mark.slow
def test_a_payload_that_is_poured_is_told_as_a_ramp() -> None:
    poured = {"mass_change": 0.6, "duration": 3.0}
    records = recordings("payload_change", poured, form="ramp")
    found = found_in(records)
    (effect,) = found.effects
    assert (effect["id"], effect["form"]) == ("payload_change", "ramp")
    assert found.probabilities["payload_change"] > 0.8
    told = effect["parameters"]["mass_change"]
    assert abs(told["value"] - 0.6) < max(0.03, 2.0 * told["std"])
    assert {event["recording"] for event in effect["events"]} == TIMES.keys()
    for event in effect["events"]:
        assert abs(event["time"] - TIMES[event["recording"]]) < 0.4
        assert abs(event["duration"] - 3.0) < 0.8
    assert found.fit["gap_closed"] > 0.8
    # the model that is written holds what it found, in its form
    assert [e["form"] for e in found.rig.effects] == ["ramp"]


@pytest.mark.slow
def test_a_vibration_is_found_with_another_phase_in_each_recording() -> None:
    phases = {"lift": 0.3, "lower": 2.0, "again": 4.4}
    shaken = {
        name: {"torque": 2.0 * math.cos(phase), "torque_cosine": 2.0 * math.sin(phase)}
        for name, phase in phases.items()
    }
    records = recordings("external_torque", {"frequency": 1.37}, form="vibration", own=shaken)
    found = found_in(records)
    assert found.probabilities["external_torque"] > 0.8
    (effect,) = found.effects
    assert effect["form"] in ("vibration", "two_vibrations")
    low, high = effect["parameters"]["frequency"]["interval"]
    assert low <= 1.37 <= high
    assert high - low < 0.01
    told = {e["recording"]: e for e in effect["events"] if abs(e["frequency"] - 1.37) < 0.01}
    for name, own in shaken.items():
        for part, size in own.items():
            assert abs(told[name][part] - size) < 0.15, (name, part)
    assert found.fit["gap_closed"] > 0.8


def test_lines_stand_out_of_a_red_spectrum() -> None:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 40.0, 0.01)
    red = np.cumsum(rng.normal(0.0, 0.05, time.size))
    value = red + 0.5 * np.sin(2 * np.pi * 0.83 * time) + 0.4 * np.cos(2 * np.pi * 2.41 * time)
    rows = np.ones(time.size, dtype=bool)
    rows[500:700] = False
    kept = Residual(value, None, value, rows, 0.1)
    lines = lines_of([(kept, 0.01)], 0.1, 25.0, 3)
    for wanted in (0.83, 2.41):
        assert min(abs(line - wanted) for line in lines) < 0.5 / 40.0
    assert lines_of([], 0.1, 25.0, 3) == []
    assert lines_of([(kept, 0.01)], 60.0, 90.0, 3) == []  # faster than the samples can tell


def test_a_recording_without_the_event_has_no_slope_in_it() -> None:
    both = recordings("payload_change", {"mass_change": 0.4}, 4.0)[:2]
    happened = Events(Term("payload_change"), {"lift": {"mass_change": 0.4, "time": 2.0}})
    names = ["arm.payload", "payload_change.mass_change"]
    found = residuals(problem_of(RIG, both, "arm"), RIG, names, happened)
    with_event, without = found["arm", "lift"].jacobian, found["arm", "lower"].jacobian
    assert with_event is not None
    assert without is not None
    assert np.abs(with_event[:, 1]).max() > 1e-3
    assert not without[:, 1].any()
    assert without[:, 0].any()


@pytest.mark.slow
def test_a_push_is_found_beside_a_persistent_effect() -> None:
    friction = {"friction_pressure": 1e-4, "presliding": 0.003}
    plant = RIG.with_effect("muscle_hysteresis", friction)
    records = recordings("external_torque", {"torque": 5.0, "duration": 0.8}, plant=plant)
    # what such pushes leave beside the first name is inside what a model is usually off by
    found = found_in(records, settings=pamrs.DiagnosisSettings(usual_error=0.0))
    assert found.probabilities["external_torque+muscle_hysteresis"] > 0.5
    (push,) = [e for e in found.effects if e["id"] == "external_torque"]
    large = [e for e in push["events"] if e["torque"] > 2.5]
    first = {e["recording"]: e["time"] for e in sorted(large, key=lambda e: -e["time"])}
    assert all(abs(first[name] - when) < 0.3 for name, when in TIMES.items())
    # one recording stands for all, with what it knows of its push
    time, torque = (push["parameters"][name] for name in ("time", "torque"))
    assert torque["value"] == pytest.approx(5.0, rel=0.1)
    assert abs(time["value"] - TIMES[push["events"][0]["recording"]]) < 0.3
    assert time["std"] < 0.4
    assert found.rig.effects[0]["id"] == "muscle_hysteresis"
