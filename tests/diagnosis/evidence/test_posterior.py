"""What counts of a hypothesis beside what it leaves: its sizes, its values and its parts."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.evidence import FittedHypothesis, Prior, possible_gain, posterior
from pamrs.diagnosis.evidence._likelihood import _Covariance
from pamrs.diagnosis.evidence._posterior import _with_capped_names
from pamrs.diagnosis.evidence._prior import loss_by_value
from pamrs.diagnosis.fit import Events, Fit, Problem, Start, fits
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import available_blocks
from pamrs.diagnosis.screen import Score
from pamrs.diagnosis.search import Attempts, _hypotheses
from pamrs.effects import EFFECTS, NONE, UNLISTED, Hypothesis, Term
from pamrs.simulation import core_rig
from tests.diagnosis import again
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.likelihoods import TIMES, made_up, rows_of, stated
from tests.diagnosis.terms import by_text, terms

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
) -> FittedHypothesis:
    """Effects with values and standard deviations that leave a share of the arm's mismatch."""
    for effect, values in effects.items():
        assert set(values) <= {p.name for form in EFFECTS[effect].forms for p in form.parameters}
    known = {f"{e}.{n}": pair for e, values in effects.items() for n, pair in values.items()}
    values = {name: value for name, (value, _) in known.items()}
    std = {name: spread for name, (_, spread) in known.items()}
    spreads = np.array(list(std.values()))
    alike = correlation + (1.0 - correlation) * np.eye(len(spreads))
    fitted = {
        "std": std,
        "covariance": np.outer(spreads, spreads) * alike,
        "events": events,
    }
    kept = {"arm": Excess(1.0 + left * (BEFORE - 1.0), 0.0, 0.5, 1.0, 1.0, 1.2, 0.05)}
    return made_up(RIG, "+".join(effects), kept, values, **fitted)


def weighed(*found: FittedHypothesis) -> dict[str, float]:
    return by_text(posterior([hypothesis({}, 1.0), *found], ARM, Prior(0.985, 30.0, SETTINGS)))


def test_an_effect_that_is_not_told_from_none_names_nothing() -> None:
    clock = {"offset": (5e-4, 7e-4), "rate": (0.0, 1e-5)}
    assert weighed(hypothesis({"clock_skew": clock}, 0.0))["unlisted"] > 0.99
    clock["offset"] = (5e-3, 7e-4)
    assert weighed(hypothesis({"clock_skew": clock}, 0.0))["clock_skew"] > 0.9


def test_a_size_without_a_value_that_is_none_is_no_question() -> None:
    """No share of the heat is the usual gas: how well it is known is not whether heat flows."""
    heat = {"share": (0.2, 0.3), "heat_transfer_coefficient": (40.0, 2.0)}
    assert weighed(hypothesis({"heat_transfer": heat}, 0.0))["heat_transfer"] > 0.9


def test_two_sizes_that_do_the_same_are_told_from_none_together() -> None:
    """A lag and a dead time of 4 ms each, of which the recordings tell the sum."""
    path = {"input_path_lag": {"time_constant": (2e-3, 0.25), "delay": (6e-3, 0.25)}}
    assert weighed(hypothesis(path, 0.0))["unlisted"] > 0.99
    assert weighed(hypothesis(path, 0.0, correlation=-1.0 + 1e-7))["input_path_lag"] > 0.9


def test_a_value_far_from_its_prior_is_rare_and_not_ruled_out() -> None:
    prior = 0.035
    for times in (0.0, 1.0, 10.0):
        found = hypothesis({"com_offset": {"angle": (times * prior, 1e-4)}}, 0.0)
        assert loss_by_value(found, "com_offset.angle") == pytest.approx(math.log1p(times**2))


def test_of_two_the_one_that_leaves_less() -> None:
    """A hundredth of a strong mismatch is far above the noise; a hundredth of the noise is not."""
    far = weighed(hypothesis(CREEP, 1e-2), hypothesis(DAMPING, 1e-6))
    near = weighed(hypothesis(CREEP, 1e-6), hypothesis(DAMPING, 1e-8))
    assert far["muscle_rate_damping"] > 0.9 > far["muscle_creep"]
    assert near["muscle_creep"] == pytest.approx(near["muscle_rate_damping"], rel=0.7)


def test_room_beside_is_what_a_perfect_companion_could_gain() -> None:
    lefts = (0.0, 1e-4, 1e-3, 1e-2, 0.1)
    rooms = [possible_gain(hypothesis(CREEP, left), ARM) for left in lefts]
    assert rooms[0] == pytest.approx(0.0, abs=1e-9)
    assert rooms == sorted(rooms)
    least = SETTINGS.name_price + SETTINGS.parameter_price
    assert rooms[1] < least < rooms[-1]


def test_a_name_has_to_leave_less_than_physics_without_a_name() -> None:
    chances = [weighed(hypothesis(CREEP, left))["muscle_creep"] for left in (1e-3, 0.05, 0.3, 0.9)]
    assert chances == sorted(chances, reverse=True)
    assert chances[0] > 0.9
    assert chances[-1] < 0.2


def test_a_name_that_leaves_much_may_have_been_missed() -> None:
    """An effect of the catalogue is twice as probable as physics without a name, as far as it takes
    the mismatch, more where it leaves a tenth of the amplitude, as forms that err do; a set of two
    costs what a further name costs.
    """
    most = SETTINGS.most_probability

    def odds(found: dict[str, float], name: str) -> float:
        return found[name] / (most * found["unlisted"] - (1.0 - most) * found[name])

    taking = [weighed(hypothesis(CREEP, left)) for left in (0.2, 0.5, 0.8)]
    shared = [odds(found, "muscle_creep") for found in taking]
    assert shared == pytest.approx([1.6, 1.0, 0.4], rel=0.1)
    assert odds(weighed(hypothesis(CREEP, 0.02)), "muscle_creep") > 4.8
    both = weighed(hypothesis({**CREEP, **DAMPING}, 0.5))
    expected = shared[1] * math.exp(-SETTINGS.name_price)
    assert odds(both, "muscle_creep+muscle_rate_damping") == pytest.approx(expected, rel=0.1)
    two = weighed(hypothesis(DAMPING, 0.3), hypothesis(CREEP, 0.31))
    assert two["muscle_rate_damping"] > two["muscle_creep"]
    assert two["muscle_creep"] + two["muscle_rate_damping"] < 2.0 * two["unlisted"]


def test_what_follows_a_curve_of_the_model_is_not_left_by_a_name() -> None:
    """Two names leave as large a residual as the baseline, and one of them half of its error."""
    curve = np.sin(0.5 * TIMES)[:, None] * 100.0
    covariance = _Covariance([TIMES], [curve])
    error = rows_of(401.0) - rows_of(1.0)

    def leaving_rows(found: FittedHypothesis, along: float, size: float) -> FittedHypothesis:
        rows = along * curve[:, 0] + size * error + rows_of(1.0)
        return replace(found, likelihood=lambda: {"arm": covariance.likelihood([rows])})

    start = leaving_rows(hypothesis({}, 1.0), 1.0, 1.0)
    creep = leaving_rows(hypothesis(CREEP, 1.0), 1.05, 0.5)
    damping = leaving_rows(hypothesis(DAMPING, 1.0), 0.95, 1.0)
    found = by_text(posterior([start, creep, damping], ARM, Prior(0.985, 30.0, SETTINGS)))
    assert found["muscle_creep"] > 0.5 > 0.01 > found["muscle_rate_damping"]


def test_names_that_groups_agree_on_are_capped() -> None:
    most = SETTINGS.most_probability
    own = {Hypothesis(terms("muscle_creep")): 50.0, UNLISTED: 0.1, NONE: 0.1}
    found = _with_capped_names(own, most)
    assert sum(found.values()) == pytest.approx(sum(own.values()))
    assert found[Hypothesis(terms("muscle_creep"))] == pytest.approx(most * 50.2)
    unsure = {Hypothesis(terms("muscle_creep")): 0.5, UNLISTED: 0.5}
    assert _with_capped_names(unsure, most) == unsure


def test_a_second_name_pays_for_itself_or_is_not_believed() -> None:
    one = hypothesis(CREEP, 0.01)
    for left, needless in ((0.009, True), (1e-4, False)):
        found = weighed(one, hypothesis({**CREEP, **DAMPING}, left))
        both = found["muscle_creep+muscle_rate_damping"]
        assert (both < found["muscle_creep"]) == needless


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
    attempts = Attempts(problem, problem, RIG, {}, {}, BLOCKS)
    pushed = hypothesis(
        {"external_torque": {}}, 0.2, events=Events(Term("external_torque"), {}, {})
    )
    wrong = replace(hypothesis({}, 0.2), wrong=("arm.payload",))
    assert attempts.fit_events(Term("payload_change"), pushed) is None
    assert attempts.fit_events(Term("payload_change"), wrong) is None


def test_events_pay_for_no_more_numbers_than_there_are_independent_samples() -> None:
    pushes = {name: dict.fromkeys("abcdefghij", 1.0) for name in ("one", "two")}
    events = Events(Term("external_torque"), pushes)
    pushed, prior = hypothesis({}, 0.1, events=events), Prior(0.985, 40.0, SETTINGS)
    each = SETTINGS.parameter_price
    assert prior.price(pushed) - prior.price(pushed, 8.0) == pytest.approx(12.0 * each)
    assert prior.price(pushed, 80.0) == prior.price(pushed)


def with_wrong(found: FittedHypothesis, *names: str) -> FittedHypothesis:
    """The same beside values that are 7 tolerances below those of the rig file."""
    values, moved = dict.fromkeys(names, 0.72), dict.fromkeys(names, -7.0)
    scales = dict.fromkeys(names, 0.04)
    fit = replace(
        found.fit,
        values=found.fit.values | values,
        moved=moved,
        known=stated(values, moved, scales),
        freed=names,
        scales=dict.fromkeys(found.fit.values, 1.0) | scales,
        covariance=np.diag([*np.diag(found.fit.covariance), *([1e-4] * len(names))]),
    )
    return replace(found, fit=fit, wrong=names)


def test_the_order_of_hypotheses_does_not_matter() -> None:
    """Two values alone, an effect beside both: the better value is what the effect adds to."""
    poor = with_wrong(hypothesis({}, 0.6), "arm.payload")
    good = with_wrong(hypothesis({}, 0.01), MODULUS)
    beside = with_wrong(hypothesis(CREEP, 0.008), "arm.payload", MODULUS)
    one, other = weighed(poor, good, beside), weighed(good, poor, beside)
    assert one == pytest.approx(other)
    assert one[MODULUS] > 0.7


@pytest.mark.parametrize(
    ("std", "named"), [(0.1, True), (2.0, True), (2.6, False), (np.inf, False)]
)
def test_a_wrong_value_is_told_from_one_inside_its_tolerances(std: float, *, named: bool) -> None:
    """Seven tolerances off, it has to be two standard deviations beyond the third."""
    wrong = with_wrong(hypothesis({}, 1e-4), MODULUS)
    wrong = replace(wrong, fit=replace(wrong.fit, std={MODULUS: std * wrong.fit.scales[MODULUS]}))
    assert (weighed(wrong).get(MODULUS, 0.0) > 0.5) == named


def test_effects_that_come_to_nothing_are_not_fitted_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three effects of two starts each: only that with a size gets its other start."""
    asked: list[tuple[str, float]] = []
    keys = {**CREEP, **DAMPING, "external_torque": {"torque": (5.0, 0.1)}}

    def shortly(starts: list[Start], _: Fit) -> FittedHypothesis:
        (start,) = starts
        effect = start.effect.id
        asked.append((effect, start.free["size"]))
        size = 1.0 if effect == "muscle_rate_damping" else 0.0
        return hypothesis({effect: {n: (size * v, s) for n, (v, s) in keys[effect].items()}}, 0.5)

    attempts = SimpleNamespace(
        settings=SETTINGS,
        fit_shortly=shortly,
    )
    monkeypatch.setattr(
        _hypotheses, "start_of", lambda fit, effect: Start(effect, {}, {}, (), False)
    )
    search = SimpleNamespace(
        attempts=attempts, start=hypothesis({}, 1.0), weight=lambda candidate: candidate.misfit
    )
    ranked = {
        term: [
            Score(term, Start(term, {"size": k}, {}, (), False), 1.0, 1.0, np.zeros(0))
            for k in (1.0, 2.0)
        ]
        for term in terms(*keys)
    }
    found, _, _ = _hypotheses._shortlist(search, [[term] for term in ranked], ranked)
    assert [term.id for term in found] == ["muscle_rate_damping"]
    assert sorted(asked) == sorted(
        [*((effect, 1.0) for effect in keys), ("muscle_rate_damping", 2.0)]
    )


@pytest.mark.parametrize(
    ("strong", "tried"), [(False, ["muscle_creep"]), (True, [*CREEP, *DAMPING])]
)
def test_inside_the_error_of_the_model_effects_get_a_few_steps(
    monkeypatch: pytest.MonkeyPatch, tried: list[str], *, strong: bool
) -> None:
    """Beside wrong values, those that a signature speaks for; of a strong mismatch all of them."""
    scores = [
        Score(term, Start(term, {"size": 1.0}, {}, (), False), gain, 1.0, np.zeros(0))
        for term, gain in zip(terms(*CREEP, *DAMPING), (100.0, 1.0), strict=True)
    ]
    screened = SimpleNamespace(strong=strong, scores=lambda: scores)
    search = SimpleNamespace(screened=screened, start=SimpleNamespace(fit=None))
    state = SimpleNamespace(search=search, per_recording=[], transient=[], wrong_values=["wrong"])
    monkeypatch.setattr(_hypotheses, "screen_mismatch", lambda refit, tell: state)
    shortly = SimpleNamespace(fit_shortly=lambda starts, _: starts[0].effect.id)
    refit = SimpleNamespace(
        error=({}, {"arm": 1.0}),
        attempts=SimpleNamespace(nominal=RIG, settings=SETTINGS),
        start="start",
        with_error_sizes=lambda sizes: SimpleNamespace(attempts=shortly),
        with_smaller_error=lambda candidates: candidates,
    )
    assert _hypotheses.refit_with_smaller_curve_error(refit, print) == ["start", *tried, "wrong"]
