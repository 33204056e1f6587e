"""What counts of a hypothesis beside what it leaves: its sizes, its values and its parts."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.evidence import Attempts, Candidate, Weighing, possible_gain, weigh
from pamrs.diagnosis.evidence._weighing import _share_by_trust, loss_by_values
from pamrs.diagnosis.fit import Events, Fit, Problem, fits
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import available_blocks
from pamrs.effects import EFFECTS, Term
from pamrs.simulation import core_rig
from tests.diagnosis import again
from tests.diagnosis.terms import by_text, terms

SETTINGS = DiagnosisSettings()
RIG = pamrs.rigs.shoulder()
BLOCKS = available_blocks(RIG, ("valve_command", *again.NOISE))
ARM = [b for b in BLOCKS if b.name == "arm"]
BEFORE = 1e4


MODULUS = "muscle.modulus_scale"
CREEP = {"muscle_creep": {"stiffness": (300.0, 10.0), "time_constant": (5.0, 0.2)}}
DAMPING = {"muscle_rate_damping": {"damping_constant": (200.0, 5.0)}}


def hypothesis(
    effects: dict[str, dict[str, tuple[float, float]]],
    left: float,
    correlation: float = 0.0,
    events: Events | None = None,
) -> Candidate:
    """Effects with values and standard deviations that leave a share of the arm's mismatch."""
    for effect, values in effects.items():
        assert set(values) <= {p.name for form in EFFECTS[effect].forms for p in form.parameters}
    known = {f"{e}.{n}": pair for e, values in effects.items() for n, pair in values.items()}
    values = {name: value for name, (value, _) in known.items()}
    std = {name: spread for name, (_, spread) in known.items()}
    spreads = np.array(list(std.values()))
    covariance = np.outer(spreads, spreads) * (
        correlation + (1.0 - correlation) * np.eye(len(spreads))
    )
    scales = dict.fromkeys(values, 1.0)
    fit = Fit(terms(*effects), RIG, values, std, covariance, 0.0, {}, scales=scales, events=events)
    kept = {"arm": Excess(1.0 + left * (BEFORE - 1.0), 0.0, 0.5, 1.0, 1.0, 1.2, 0.05)}
    return Candidate(terms(*effects), fit, kept, kept, 0.0)


def weighed(*found: Candidate) -> dict[str, float]:
    return by_text(weigh([hypothesis({}, 1.0), *found], ARM, Weighing(0.985, 30.0, SETTINGS)))


def test_an_effect_that_is_not_told_from_none_names_nothing() -> None:
    clock = {"offset": (5e-4, 7e-4), "rate": (0.0, 1e-5)}
    assert weighed(hypothesis({"clock_skew": clock}, 0.0)) == {"unlisted": 1.0}
    clock["offset"] = (5e-3, 7e-4)
    assert weighed(hypothesis({"clock_skew": clock}, 0.0))["clock_skew"] > 0.9


def test_a_size_without_a_value_that_is_none_is_no_question() -> None:
    """No share of the heat is the usual gas: how well it is known is not whether heat flows."""
    heat = {"share": (0.2, 0.3), "heat_transfer_coefficient": (40.0, 2.0)}
    assert weighed(hypothesis({"heat_transfer": heat}, 0.0))["heat_transfer"] > 0.9


def test_two_sizes_that_do_the_same_are_told_from_none_together() -> None:
    """A lag and a dead time of 4 ms each, of which the recordings tell the sum."""
    path = {"input_path_lag": {"time_constant": (2e-3, 0.25), "delay": (6e-3, 0.25)}}
    assert weighed(hypothesis(path, 0.0)) == {"unlisted": 1.0}
    assert weighed(hypothesis(path, 0.0, correlation=-1.0 + 1e-7))["input_path_lag"] > 0.9


def test_a_value_far_from_its_prior_is_rare_and_not_ruled_out() -> None:
    prior = 0.035
    for times in (0.0, 1.0, 10.0):
        found = hypothesis({"com_offset": {"angle": (times * prior, 1e-4)}}, 0.0)
        assert loss_by_values(found, {}) == pytest.approx(math.log1p(times**2))


@pytest.mark.parametrize(
    ("name", "value", "distance"),
    [
        # an area cannot be negative: a hundredth of it is rarer than the difference says
        ("valve.discharge_area_max", 0.01, math.log(100.0) / 0.1),
        ("valve.discharge_area_max", 1.2, 2.0),
        ("sensors.pressure_zero", 0.01, None),
    ],
)
def test_how_far_a_value_is(name: str, value: float, distance: float | None) -> None:
    nominal, tolerance = 1.0, 0.1
    moved = (value - nominal) / tolerance
    fit = Fit(
        (),
        RIG,
        {name: value},
        {},
        np.zeros((1, 1)),
        0.0,
        {},
        {name: moved},
        scales={name: tolerance},
    )
    found = replace(hypothesis({}, 0.0), fit=fit, wrong=(name,))
    expected = abs(moved) if distance is None else max(distance, abs(moved))
    assert found.outside(1.0) == pytest.approx(math.log(expected))


def test_of_two_that_leave_less_than_forms_do_the_one_that_leaves_less() -> None:
    """A hundredth of a strong mismatch is far above the noise, although a right name in another
    form may leave it; of a mismatch near the noise it is next to nothing.
    """
    creep, damping = hypothesis(CREEP, 1e-6), hypothesis(DAMPING, 1e-6)
    near = weighed(creep, damping)
    far = weighed(hypothesis(CREEP, 1e-2), damping)
    assert far["muscle_creep"] < 0.2 * near["muscle_creep"]
    assert far["muscle_rate_damping"] > 0.7


def predicting(found: Candidate, each: float, stretches: int = 40) -> Candidate:
    """The hypothesis with so much logarithmic density in every stretch of time."""
    return replace(found, densities=lambda: {"arm": np.full(stretches, each)})


def both_known(left: float, other: float, lead: float) -> dict[str, float]:
    """Probabilities of creep and of damping, which leave these shares; damping leads so much in
    each stretch.
    """
    creep = predicting(hypothesis(CREEP, left), -1.0)
    damping = predicting(hypothesis(DAMPING, other), -1.0 + lead)
    return weighed(creep, damping)


def test_names_are_weighed_by_what_they_leave_and_by_what_they_predict() -> None:
    alike = both_known(1e-3, 1e-3, 0.0)
    led = both_known(1e-3, 1e-3, 1.0)
    assert led["muscle_rate_damping"] > alike["muscle_rate_damping"]
    # half of the evidence stays with what is left, and the whole is what it was
    assert led["muscle_creep"] >= 0.5 * alike["muscle_creep"] - 1e-9
    assert sum(led.values()) == pytest.approx(1.0)
    order = weighed(
        predicting(hypothesis(DAMPING, 1e-3), 0.0), predicting(hypothesis(CREEP, 1e-3), -1.0)
    )
    assert order == pytest.approx(led)


def test_prediction_names_nothing_that_leaves_most_of_a_mismatch() -> None:
    """A drift that an autoregression follows is not explained by what predicts it best."""
    found = both_known(1e-3, 0.9, 1.0)
    assert found["muscle_rate_damping"] < 0.02
    assert found["unlisted"] > 0.4


@pytest.mark.parametrize("spoilt", [np.array([]), np.array([math.nan, 0.0]), np.zeros(3)])
def test_what_cannot_be_predicted_is_weighed_by_what_is_left(spoilt: np.ndarray) -> None:
    creep = predicting(hypothesis(CREEP, 1e-3), -1.0, 2)
    other = hypothesis(DAMPING, 1e-3)
    plain = weighed(hypothesis(CREEP, 1e-3), other)
    assert weighed(creep, other) == pytest.approx(plain)
    odd = replace(other, densities=lambda: {"arm": spoilt})
    assert weighed(creep, odd) == pytest.approx(plain)


def test_room_beside_is_what_a_perfect_companion_could_gain() -> None:
    evidence = SETTINGS
    start = hypothesis({}, 1.0)
    rooms = [
        possible_gain(hypothesis(CREEP, left), start, ARM, evidence)
        for left in (0.0, 1e-4, 1e-3, 1e-2, 0.1)
    ]
    assert rooms[0] == pytest.approx(0.0, abs=1e-9)
    assert rooms == sorted(rooms)
    least = evidence.further_price + evidence.parameter_price
    assert rooms[1] < least < rooms[-1]


def test_what_a_set_is_not_trusted_with_falls_to_its_part() -> None:
    """A push beside a damping may be anything: it is not trusted, and takes nothing from the
    damping, which by itself explains more than half.
    """
    pushes = Events(Term("external_torque"), {}, {})
    alone = hypothesis(DAMPING, 0.4)
    beside = hypothesis({**DAMPING, "external_torque": {}}, 0.2, events=pushes)
    other = hypothesis({**CREEP, "external_torque": {}}, 0.2, events=pushes)
    assert weighed(other)["unlisted"] > 0.9
    found = weighed(alone, beside)
    assert found["muscle_rate_damping"] > 0.6
    assert found["muscle_rate_damping"] + found[
        "muscle_rate_damping+external_torque"
    ] == pytest.approx(1.0 - found["unlisted"])


def test_an_effect_that_the_file_states_as_uncertain_is_a_parameter(tmp_path: Path) -> None:
    """A base angle with a tolerance is refitted: an offset of the centre of mass says the same."""
    assert fits(RIG, "com_offset")
    text = RIG.to_toml_text().replace(
        "[arm]\n", '[arm]\nbase_angle = { value = 0.0, unit = "deg", tol = 1.0 }\n'
    )
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    assert not fits(pamrs.load_rig(tmp_path / "rig.toml"), "com_offset")


def test_events_are_looked_for_beside_one_cause_at_a_time() -> None:
    """Other events and wrong values beside them are not fitted."""
    problem = Problem(BLOCKS, [], core_rig(RIG), SETTINGS)
    trial = Attempts(problem, problem, RIG, {}, {}, BLOCKS)
    pushed = hypothesis(
        {"external_torque": {}}, 0.2, events=Events(Term("external_torque"), {}, {})
    )
    wrong = replace(hypothesis({}, 0.2), wrong=("arm.payload",))
    assert trial.fit_events(Term("payload_change"), pushed) is None
    assert trial.fit_events(Term("payload_change"), wrong) is None


def with_wrong(found: Candidate, *names: str) -> Candidate:
    """The same beside values that are 7 tolerances below those of the rig file."""
    fit = replace(
        found.fit,
        values=found.fit.values | dict.fromkeys(names, 0.72),
        moved=dict.fromkeys(names, -7.0),
        scales=dict.fromkeys(found.fit.values, 1.0) | dict.fromkeys(names, 0.04),
        covariance=np.diag([*np.diag(found.fit.covariance), *([1e-4] * len(names))]),
    )
    return replace(found, fit=fit, wrong=names)


def test_what_a_wrong_value_leaves_is_no_forms_error() -> None:
    """A value that leaves 0.2 % of a strong mismatch, 20 times the noise, and the same value
    beside an effect that leaves noise; an effect that leaves as much by itself asks for nothing.
    """
    alone = with_wrong(hypothesis({}, 0.002), MODULUS)
    beside = with_wrong(hypothesis(CREEP, 0.0), MODULUS)
    for by_itself in ([], [hypothesis(CREEP, 0.05)], [hypothesis(CREEP, 0.5)]):
        found = weighed(alone, beside, *by_itself)
        assert found[f"muscle_creep+{MODULUS}"] > 0.9
    one, two = hypothesis(CREEP, 0.002), hypothesis({**CREEP, **DAMPING}, 0.0)
    found = weighed(one, two)
    assert found["muscle_creep"] > found["muscle_creep+muscle_rate_damping"]


@pytest.mark.parametrize(("effect", "value", "both"), [(1e-3, 0.1, 1e-5), (5e-3, 0.2, 0.0)])
def test_an_effect_that_leads_needs_no_wrong_value_beside_it(
    effect: float, value: float, both: float
) -> None:
    """What its equation leaves is granted to it, whatever other values were tried."""
    alone, beside = hypothesis(CREEP, effect), with_wrong(hypothesis(CREEP, both), MODULUS)
    assert weighed(alone, beside)["muscle_creep"] > 0.9
    other = with_wrong(hypothesis({}, value), MODULUS)
    assert weighed(alone, beside, other)["muscle_creep"] > 0.9
    poor = with_wrong(hypothesis({}, 0.5), "arm.payload")
    assert weighed(alone, beside, poor)["muscle_creep"] > 0.9


def test_the_order_of_hypotheses_does_not_matter() -> None:
    """Two values alone, an effect beside both: the better value is what the effect adds to."""
    poor = with_wrong(hypothesis({}, 0.6), "arm.payload")
    good = with_wrong(hypothesis({}, 0.01), MODULUS)
    beside = with_wrong(hypothesis(CREEP, 0.008), "arm.payload", MODULUS)
    one, other = weighed(poor, good, beside), weighed(good, poor, beside)
    assert one == pytest.approx(other)
    assert one[MODULUS] > 0.9


@pytest.mark.parametrize("other", [0.90, 0.91])
def test_what_is_not_trusted_goes_to_the_part_that_leads(other: float) -> None:
    """Of two parts that are trusted as much, or nearly, the one that leads gets it."""
    leads, follows = hypothesis(CREEP, 0.0), hypothesis(DAMPING, 0.0)
    both = hypothesis({**CREEP, **DAMPING}, 0.0)
    weights = {leads: 0.9, follows: 0.1, both: 50.0}
    trusted = {leads: 0.90, follows: other, both: 0.1}
    found = by_text(_share_by_trust(weights, trusted))
    untrusted = (50.0 / 51.0) * 0.9
    assert found["muscle_creep"] == pytest.approx((0.9 / 51.0 + untrusted * 0.9) * 0.9)
    backwards = by_text(_share_by_trust(dict(reversed(weights.items())), trusted))
    assert backwards == pytest.approx(found)
