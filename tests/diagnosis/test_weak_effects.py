"""Weak effects and swinging payloads: found, told apart, or left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.evidence import (
    BlockLikelihood,
    Candidate,
    Weighing,
    share_left,
    weigh,
)
from pamrs.diagnosis.evidence._likelihood import _Covariance
from pamrs.diagnosis.fit import Events, Fit
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import Block, available_blocks
from pamrs.diagnosis.search import _hypotheses
from pamrs.effects import Term
from tests.diagnosis.likelihoods import BINS, TIMES, leaving, rows_of
from tests.diagnosis.noisy import whole
from tests.diagnosis.terms import by_text, terms

SETTINGS = DiagnosisSettings()

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
SECONDS = 15.0
LIMIT = 1.1  # of the excess that noise has

PERFECT = pamrs.DiagnosisSettings(usual_error=0.0)


def shoulder_case(truth: pamrs.Rig, fitted: int = 2, speed: float = 1.0) -> pamrs.Case:
    """A shoulder's recordings with the noise of transducers: some to fit, one held out."""
    found = []
    for number in range(fitted + 1):
        rng = np.random.default_rng([1114, number])
        time = np.arange(0.0, SECONDS, 0.005)
        turn = 2 * np.pi * speed * time
        command = (
            5.0 + (0.35 + 0.1 * number) * np.sin(0.15 * turn) + 0.25 * np.sin(0.4 * turn + number)
        )
        run = pamrs.simulate(truth, valve_command=command, sample_time=0.005)
        channels = {
            name: run[name] + rng.normal(0.0, sigma, time.size) for name, sigma in NOISE.items()
        }
        channels["valve_command"] = command
        role = "held_out" if number == fitted else "fit"
        found.append(whole(f"run_{number}", role, 0.005, channels))
    return pamrs.Case("weak", pamrs.rigs.shoulder(), found, Path())


def test_an_effect_that_hardly_exceeds_the_noise_is_named() -> None:
    def diagnosed(half_width: float) -> pamrs.Diagnosis:
        truth = pamrs.rigs.shoulder().with_effect("valve_dead_zone", {"half_width": half_width})
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
    found = pamrs.diagnose(
        shoulder_case(
            pamrs.rigs.shoulder().with_effect(
                "input_path_lag", {"delay": 1.2e-3, "time_constant": 0.0}
            )
        )
    )
    assert not found.effects, found


def test_an_effect_that_held_out_recordings_do_not_share_is_no_name() -> None:
    overlapped = shoulder_case(
        pamrs.rigs.shoulder().with_effect("valve_dead_zone", {"half_width": 8e-4})
    )
    sound = shoulder_case(pamrs.rigs.shoulder())
    case = pamrs.Case("mixed", sound.rig, [*overlapped.recordings[:2], sound.recordings[2]], Path())
    found = pamrs.diagnose(case)
    assert found.verdict == "unlisted"
    assert found.probabilities.get("valve_dead_zone", 0.0) < 0.1


@pytest.mark.slow
def test_a_payload_on_a_cord_is_named_with_its_length() -> None:
    truth = pamrs.rigs.shoulder().with_effect(
        "payload_swing", {"swinging_share": 0.03, "length": 0.23, "damping_ratio": 0.02}
    )
    found = pamrs.diagnose(shoulder_case(truth))
    assert found.effects[0]["id"] == "payload_swing"
    assert found.probabilities["payload_swing"] > 0.85
    assert abs(found.effects[0]["parameters"]["length"]["value"] - 0.23) < 0.01


def candidate(effects: tuple[Term, ...], left: float, **values: float) -> Candidate:
    """A made-up set that leaves an excess of a block, fitted and held out."""
    exact, scales = np.zeros((len(values), len(values))), dict.fromkeys(values, 1.0)
    fit = Fit(effects, pamrs.rigs.shoulder(), values, {}, exact, 0.0, {}, scales=scales)
    ratio = {"chamber": Excess(1.0 + left, 0.0, 0.0, 1.0, 1.0, LIMIT)}
    return Candidate(effects, fit, ratio, ratio, 0.0, likelihood=leaving(ratio))


def chamber() -> list[Block]:
    """The chamber of a shoulder."""
    names = ("supply_pressure", "muscle_pressure", "valve_command", "joint_angle")
    blocks = available_blocks(pamrs.rigs.shoulder(), names)
    return [block for block in blocks if block.name == "chamber"]


def weighed(*sets: Candidate, start: Candidate | None = None) -> dict[str, float]:
    """Probabilities beside a baseline that leaves ten times the noise's variance in the chamber, of
    recordings of 30 s.
    """
    every = [start or candidate((), 10.0), *sets]
    return by_text(weigh(every, chamber(), Weighing(0.985, 30.0, SETTINGS)))


def test_a_set_that_explains_nothing_says_nothing_against_one_that_does() -> None:
    right = candidate(
        terms("heat_transfer"),
        0.0,
        **{
            "heat_transfer.heat_transfer_coefficient": 50.0,
            "heat_transfer.initial_temperature_rise": 1.0,
            "heat_transfer.share": 0.5,
        },
    )
    wrong = candidate(terms("pressure_lag"), 9.0, **{"pressure_lag.time_constant": 1e-3})
    alone, both = weighed(right), weighed(right, wrong)
    assert alone["heat_transfer"] > 0.9
    assert abs(both["heat_transfer"] - alone["heat_transfer"]) < 0.01


def test_a_smaller_rest_tells_among_single_effects_and_asks_for_no_second() -> None:
    rough = candidate(terms("joint_end_stop"), 0.35, **{"joint_end_stop.stiffness": 100.0})
    close = candidate(
        terms("pam_crowding_contact"), 0.02, **{"pam_crowding_contact.contact_area": 1e-3}
    )
    assert weighed(rough, close)["pam_crowding_contact"] > 0.6
    both = candidate(
        terms("joint_end_stop", "payload_swing"),
        0.3,
        **{"joint_end_stop.stiffness": 100.0, "payload_swing.length": 0.2},
    )
    assert weighed(rough, both)["joint_end_stop"] > 0.6


def test_what_explains_a_mismatch_has_to_take_most_of_it() -> None:
    def named(before: float, left: float) -> float:
        stop = candidate(terms("joint_end_stop"), left, **{"joint_end_stop.stiffness": 100.0})
        return weighed(stop, start=candidate((), before))["joint_end_stop"]

    assert named(10.0, 9.0) < 0.2
    assert named(10.0, 0.2) > 0.9
    # of hardly a mismatch a noise level that was taken too low is the more probable cause
    assert named(0.1, 0.05) < 0.5


def test_a_clock_that_does_not_drift_gives_way_to_a_lag() -> None:
    lag = candidate(
        terms("input_path_lag"),
        0.05,
        **{"input_path_lag.delay": 3e-3, "input_path_lag.time_constant": 1e-4},
    )
    still = candidate(
        terms("clock_skew"), 0.0, **{"clock_skew.offset": 3e-3, "clock_skew.rate": 1e-6}
    )
    drifting = candidate(
        terms("clock_skew"), 0.0, **{"clock_skew.offset": 3e-3, "clock_skew.rate": 3e-4}
    )
    assert weighed(lag, still)["input_path_lag"] > 0.6
    assert weighed(lag, still)["clock_skew"] > 0.05  # but it stays possible
    assert weighed(lag, drifting)["clock_skew"] > 0.5


def test_creep_slower_than_any_recording_gets_a_penalty() -> None:
    seen = candidate(
        terms("muscle_creep"),
        0.3,
        **{"muscle_creep.stiffness": 1e3, "muscle_creep.time_constant": 8.0},
    )
    unseen = candidate(
        terms("muscle_creep"),
        0.3,
        **{"muscle_creep.stiffness": 1e3, "muscle_creep.time_constant": 300.0},
    )
    assert weighed(seen)["muscle_creep"] > 0.6
    assert weighed(unseen)["unlisted"] > 0.8


def test_held_out_recordings_count_as_fitted_ones_do() -> None:
    """What one of them loses is as bad as what the other one gains is good."""
    swing = candidate(terms("payload_swing"), 0.0, **{"payload_swing.swinging_share": 0.04})
    start = candidate((), 10.0)

    def named(found: Candidate) -> float:
        return weighed(found, start=start)["payload_swing"]

    covariance = _Covariance([TIMES, TIMES], [np.empty((BINS, 0))] * 2)

    def over_both(fitted: float, held: float) -> BlockLikelihood:
        return covariance.likelihood([rows_of(1.0 + left) for left in (fitted, held)])

    def seen(fitted: float, held: float) -> Candidate:
        return replace(swing, likelihood=lambda: {"chamber": over_both(fitted, held)})

    start = replace(start, likelihood=lambda: {"chamber": over_both(10.0, 10.0)})
    assert named(seen(0.0, 0.0)) > 0.9
    assert named(seen(0.0, 10.0)) == pytest.approx(named(seen(10.0, 0.0)), rel=1e-6)
    assert named(seen(0.0, 100.0)) < 0.1


def test_events_have_to_explain_fitted_and_held_out_recordings_alike() -> None:
    # their times and sizes were found in both, so that neither is a prediction
    event = {"torque": 4.0, "time": 3.0, "duration": 1.0}
    events = Events(Term("external_torque"), {"run": event})

    def left(fitted: float, held: float, happened: Events | None) -> Candidate:
        found = candidate(terms("external_torque"), fitted)
        ratio = {"chamber": Excess(1.0 + held, 0.0, 0.0, 1.0, 1.0, LIMIT)}
        return replace(found, held_out=ratio, fit=replace(found.fit, events=happened))

    start = left(60.0, 20000.0, None)

    def share(fitted: float, happened: Events | None) -> float:
        return share_left(left(fitted, 120.0, happened), start, chamber())

    assert share(16.0, None) == share(0.3, None) == pytest.approx(0.006)
    assert share(0.3, events) == pytest.approx(0.006)
    assert share(16.0, events) == pytest.approx(16.0 / 60.0)


@pytest.mark.slow
def test_a_tube_is_named_with_the_place_of_the_transducer() -> None:
    truth = pamrs.rigs.shoulder().with_effect(
        "tube_flow_restriction", {"conductance": 5e-8, "tap": 1.0}
    )
    found = pamrs.diagnose(shoulder_case(truth))
    assert found.effects[0]["id"] == "tube_flow_restriction"
    told = found.effects[0]["parameters"]
    assert told["tap"]["value"] == 1.0
    assert abs(told["conductance"]["value"] / 5e-8 - 1.0) < 0.15


def test_a_parameter_that_only_held_out_recordings_show_is_a_parameter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_hypotheses, "_FITTED_HINT", 0.0)
    monkeypatch.setattr(_hypotheses, "_HELD_OUT_RATIO", 1.3)
    said: list[str] = []
    nominal = pamrs.rigs.shoulder()
    known = nominal.parameter("arm.viscous")
    truth = nominal.with_parameters({"arm.viscous": known.value + 2.0 * known.tol})
    slow, fast = shoulder_case(truth, speed=0.02), shoulder_case(truth, speed=2.0)
    case = pamrs.Case("unseen", nominal, [*slow.recordings[:2], fast.recordings[2]], Path())
    found = pamrs.diagnose(case, progress=said.append, settings=PERFECT)
    assert "arm: one baseline leaves noise in all recordings" in said
    assert found.verdict == "parameters"
    assert abs(found.parameters["arm.viscous"]["moved_sigmas"] - 2.0) < 0.2
    joint = found.fit["held_out"]["joint_angle"]
    assert joint["refit"] < 1.1 * joint["noise"]
    assert joint["before"] > 5.0 * joint["noise"]
