"""Weak effects and swinging payloads: found, told apart, or left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.evidence import BlockLikelihood, FittedHypothesis, Prior, posterior, share_left
from pamrs.diagnosis.evidence._likelihood import _Covariance
from pamrs.diagnosis.fit import Events
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.search import _baseline
from pamrs.effects import Term
from tests.diagnosis.asked import ROLES, SETTINGS, blocks_of
from tests.diagnosis.likelihoods import BINS, TIMES, made_up, rows_of
from tests.diagnosis.noisy import SHOULDER, driven
from tests.diagnosis.terms import by_text

RIG = pamrs.rigs.shoulder()
LIMIT = 1.1  # of the excess that noise has

PERFECT = pamrs.DiagnosisSettings(usual_error=0.0)


def shoulder_case(truth: pamrs.Rig, speed: float = 1.0) -> pamrs.Case:
    """A shoulder's recordings with the noise of transducers: two to fit, one held out."""
    found = []
    turn = 2 * np.pi * speed * np.arange(0.0, 15.0, 0.005)
    for k, role in enumerate(ROLES):
        wave = (0.35 + 0.1 * k) * np.sin(0.15 * turn) + 0.25 * np.sin(0.4 * turn + k)
        command = {"valve_command": 5.0 + wave}
        found.append(driven(truth, f"run_{k}", role, 0.005, command, SHOULDER, [1114, k]))
    return pamrs.Case("weak", RIG, found, Path())


def test_an_effect_that_hardly_exceeds_the_noise_is_named() -> None:
    def diagnosed(half_width: float) -> pamrs.Diagnosis:
        truth = RIG.with_effect("valve_dead_zone", {"half_width": half_width})
        return pamrs.diagnose(shoulder_case(truth), settings=PERFECT)

    found = diagnosed(1.2e-3)
    assert found.effects[0]["id"] == "valve_dead_zone"
    # the leakage past the closed spool, in its hyperbolic form, nearly does the same
    assert 0.4 < found.probabilities["valve_dead_zone"] < 0.95
    baseline = next(t for t in found.tried if not t["effects"] and t["suspects"])
    assert all(baseline["fitted"][b] < 2.5 for b in baseline["suspects"])
    told = found.effects[0]["parameters"]["half_width"]
    assert abs(told["value"] - 1.2e-3) < max(3e-4, 4.0 * told["std"])
    # of a smaller one, inside the noise, no other name is said
    faint = diagnosed(8e-4)
    assert not [effect for effect in faint.effects if effect["id"] != "valve_dead_zone"]
    assert not faint.wrong_parameters


@pytest.mark.slow
def test_a_dead_time_below_one_sample_is_no_name() -> None:
    late = RIG.with_effect("input_path_lag", {"delay": 1.2e-3, "time_constant": 0.0})
    found = pamrs.diagnose(shoulder_case(late))
    assert not found.effects, found


def test_an_effect_that_held_out_recordings_do_not_share_is_no_name() -> None:
    overlapped = shoulder_case(RIG.with_effect("valve_dead_zone", {"half_width": 8e-4}))
    (*_, sound) = shoulder_case(RIG).recordings
    found = pamrs.diagnose(replace(overlapped, recordings=[*overlapped.recordings[:2], sound]))
    assert found.verdict == "unlisted"
    assert found.probabilities.get("valve_dead_zone", 0.0) < 0.1


@pytest.mark.slow
def test_a_payload_on_a_cord_is_named_with_its_length() -> None:
    truth = RIG.with_effect(
        "payload_swing", {"swinging_share": 0.03, "length": 0.23, "damping_ratio": 0.02}
    )
    found = pamrs.diagnose(shoulder_case(truth))
    assert found.effects[0]["id"] == "payload_swing"
    assert found.probabilities["payload_swing"] > 0.85
    assert abs(found.effects[0]["parameters"]["length"]["value"] - 0.23) < 0.01


def candidate(key: str, left: float, **values: float) -> FittedHypothesis:
    """A made-up set that leaves an excess of a block, fitted and held out; values of its only
    effect by their names alone.
    """
    ratio = {"chamber": Excess(1.0 + left, 0.0, 0.0, 1.0, 1.0, LIMIT)}
    named = {n if "." in n else f"{key}.{n}": value for n, value in values.items()}
    return made_up(RIG, key, ratio, named)


CHAMBER = [blocks_of(RIG, ("valve_command", *SHOULDER))["chamber"]]
STOP = {"joint_end_stop.stiffness": 100.0}


def weighed(*sets: FittedHypothesis, start: FittedHypothesis | None = None) -> dict[str, float]:
    """Probabilities beside a baseline that leaves ten times the noise's variance in the chamber, of
    recordings of 30 s.
    """
    every = [start or candidate("", 10.0), *sets]
    return by_text(posterior(every, CHAMBER, Prior(0.985, 30.0, SETTINGS)))


def test_a_set_that_explains_nothing_says_nothing_against_one_that_does() -> None:
    heat = {"heat_transfer_coefficient": 50.0, "initial_temperature_rise": 1.0, "share": 0.5}
    right = candidate("heat_transfer", 0.0, **heat)
    wrong = candidate("pressure_lag", 9.0, time_constant=1e-3)
    alone, both = weighed(right), weighed(right, wrong)
    assert alone["heat_transfer"] > 0.9
    assert abs(both["heat_transfer"] - alone["heat_transfer"]) < 0.01


def test_a_smaller_rest_tells_among_single_effects_and_asks_for_no_second() -> None:
    rough = candidate("joint_end_stop", 0.35, **STOP)
    close = candidate("pam_crowding_contact", 0.02, contact_area=1e-3)
    assert weighed(rough, close)["pam_crowding_contact"] > 0.6
    swing = {"payload_swing.length": 0.2}
    both = candidate("joint_end_stop+payload_swing", 0.3, **STOP, **swing)
    assert weighed(rough, both)["joint_end_stop"] > 0.6


def test_what_explains_a_mismatch_has_to_take_most_of_it() -> None:
    def named(before: float, left: float) -> float:
        stop = candidate("joint_end_stop", left, **STOP)
        return weighed(stop, start=candidate("", before))["joint_end_stop"]

    assert named(10.0, 9.0) < 0.2
    assert named(10.0, 0.2) > 0.9
    # of hardly a mismatch a noise level that was taken too low is the more probable cause
    assert named(0.1, 0.05) < 0.5


def test_a_clock_that_does_not_drift_gives_way_to_a_lag() -> None:
    lag = candidate("input_path_lag", 0.05, delay=3e-3, time_constant=1e-4)
    still, drifting = (candidate("clock_skew", 0.0, offset=3e-3, rate=r) for r in (1e-6, 3e-4))
    assert weighed(lag, still)["input_path_lag"] > 0.6
    assert weighed(lag, still)["clock_skew"] > 0.05  # but it stays possible
    assert weighed(lag, drifting)["clock_skew"] > 0.5


def test_creep_slower_than_any_recording_gets_a_penalty() -> None:
    seen, unseen = (
        weighed(candidate("muscle_creep", 0.3, stiffness=1e3, time_constant=time))
        for time in (8.0, 300.0)
    )
    assert seen["muscle_creep"] > 0.6
    assert unseen["unlisted"] > 0.8


def test_held_out_recordings_count_as_fitted_ones_do() -> None:
    """What one of them loses is as bad as what the other one gains is good."""
    swing = candidate("payload_swing", 0.0, swinging_share=0.04)
    start = candidate("", 10.0)

    def named(found: FittedHypothesis) -> float:
        return weighed(found, start=start)["payload_swing"]

    covariance = _Covariance([TIMES, TIMES], [np.empty((BINS, 0))] * 2)

    def over_both(fitted: float, held: float) -> BlockLikelihood:
        return covariance.likelihood([rows_of(1.0 + left) for left in (fitted, held)])

    def seen(fitted: float, held: float) -> FittedHypothesis:
        return replace(swing, likelihood=lambda: {"chamber": over_both(fitted, held)})

    start = replace(start, likelihood=lambda: {"chamber": over_both(10.0, 10.0)})
    assert named(seen(0.0, 0.0)) > 0.9
    assert named(seen(0.0, 10.0)) == pytest.approx(named(seen(10.0, 0.0)), rel=1e-6)
    assert named(seen(0.0, 100.0)) < 0.1


def test_events_have_to_explain_fitted_and_held_out_recordings_alike() -> None:
    # their times and sizes were found in both, so that neither is a prediction
    event = {"torque": 4.0, "time": 3.0, "duration": 1.0}
    events = Events(Term("external_torque"), {"run": event})

    def left(fitted: float, held: float, happened: Events | None) -> FittedHypothesis:
        found = candidate("external_torque", fitted)
        ratio = {"chamber": Excess(1.0 + held, 0.0, 0.0, 1.0, 1.0, LIMIT)}
        return replace(found, held_out_excess=ratio, fit=replace(found.fit, events=happened))

    start = left(60.0, 20000.0, None)

    def share(fitted: float, happened: Events | None) -> float:
        return share_left(left(fitted, 120.0, happened), start, CHAMBER)

    assert share(16.0, None) == share(0.3, None) == pytest.approx(0.006)
    assert share(0.3, events) == pytest.approx(0.006)
    assert share(16.0, events) == pytest.approx(16.0 / 60.0)


def test_a_tube_is_named_in_all_blocks_that_it_acts_in() -> None:
    # the chamber alone keeps only noise: its verdict follows that of the arm
    truth = RIG.with_effect("tube_flow_restriction", {"conductance": 7e-8, "tap": 1.0})
    found = pamrs.diagnose(shoulder_case(truth))
    assert [b["block"] for b in found.blocks] == ["chamber", "arm"]
    assert all(b["effects"] == ["tube_flow_restriction"] for b in found.blocks)
    told = found.effects[0]["parameters"]
    assert told["tap"]["value"] == 1.0
    assert abs(told["conductance"]["value"] / 7e-8 - 1.0) < 0.15


def test_a_parameter_that_only_held_out_recordings_show_is_a_parameter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_baseline, "_FITTED_HINT", 0.0)
    monkeypatch.setattr(_baseline, "_HELD_OUT_RATIO", 1.3)
    said: list[str] = []
    known = RIG.parameter("arm.viscous")
    truth = RIG.with_parameters({"arm.viscous": known.value + 2.0 * known.tol})
    slow, fast = shoulder_case(truth, speed=0.02), shoulder_case(truth, speed=2.0)
    case = replace(slow, recordings=[*slow.recordings[:2], fast.recordings[2]])
    found = pamrs.diagnose(case, progress=said.append, settings=PERFECT)
    assert "arm: one baseline leaves noise in all recordings" in said
    assert found.verdict == "parameters"
    assert abs(found.parameters["arm.viscous"]["moved_sigmas"] - 2.0) < 0.2
    joint = found.fit["held_out"]["joint_angle"]
    assert joint["refit"] < 1.1 * joint["noise"]
    assert joint["before"] > 5.0 * joint["noise"]
