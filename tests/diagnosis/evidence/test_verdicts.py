"""Verdicts of groups of blocks, and what a case comes to: by laws, without a recording."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.diagnosis import evidence
from pamrs.diagnosis.evidence import BlockGroup, FittedHypothesis, Judged, judge
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import Block
from pamrs.effects import Hypothesis, Term
from pamrs.findings import Unexplained, WrongParameter, case_verdict
from pamrs.report.sentences import kept_sentence, sentence_of
from tests.diagnosis.asked import SETTINGS, blocks_of
from tests.diagnosis.likelihoods import made_up
from tests.diagnosis.noisy import SHOULDER
from tests.diagnosis.terms import by_text, of_texts, terms

RIG = pamrs.rigs.shoulder()
BLOCKS = blocks_of(RIG, ("valve_command", *SHOULDER))
HEALTHY = ("none", "parameters", "unlisted")


def candidate(key: str, moved: dict[str, float] | None = None) -> FittedHypothesis:
    """A hypothesis by its key, without a fit behind it."""
    return made_up(RIG, key, {}, moved=moved or {})


def group(
    name: str,
    probabilities: dict[str, float],
    *,
    moved: dict[str, float] | None = None,
    shifted: bool = False,
) -> BlockGroup:
    """A group of one block with given probabilities."""
    block: Block = BLOCKS[name]
    keys = [key for key in probabilities if key not in ("", "unlisted")]
    size = Excess(4.0 if shifted else 1.0, 1.0, 0.0, 1.0, 1.0, 1.1)
    mismatch = None if set(probabilities) == {""} else block
    found = [candidate("", moved), *map(candidate, keys)]
    kept, chances = {name: size}, of_texts(probabilities)
    return BlockGroup([block], kept, kept, found, chances, mismatch, {}, [])


def case_probabilities(judged: list[Judged]) -> dict[str, float]:
    """Those of the case, by the text of each hypothesis."""
    return by_text(evidence.case_probabilities(judged))


def left_open(found: list[Hypothesis]) -> list[list[str]]:
    """Hypotheses by their words."""
    return [hypothesis.words for hypothesis in found]


def case_ambiguity(judged: list[Judged]) -> list[list[str]]:
    """What a case leaves open, by words."""
    return left_open(evidence.case_ambiguity(judged))


def said(*groups: BlockGroup) -> tuple[list[Judged], str]:
    judged = judge(groups, SETTINGS)
    return judged, case_verdict(j.verdict for j in judged)


def test_one_block_without_a_name_takes_nothing_from_a_name_in_another() -> None:
    gas, arm = {"valve_dead_zone": 0.98, "unlisted": 0.02}, {"muscle_creep": 0.01, "unlisted": 0.99}
    judged, verdict = said(group("chamber", gas), group("arm", arm))
    assert verdict == "effects"
    assert [j.verdict for j in judged] == ["effects", "unlisted"]
    assert judged[0].named == terms("valve_dead_zone")
    (alone,) = judge([group("chamber", gas)], SETTINGS)
    name = Term("valve_dead_zone")
    assert judged[0].probability(name) == pytest.approx(alone.probability(name))
    found = case_probabilities(judged)
    assert max(found, key=lambda key: found[key]) == "valve_dead_zone"
    assert found["unlisted"] < 0.03
    assert case_ambiguity(judged) == []


def test_an_effect_of_two_groups_is_judged_once() -> None:
    gas = {"pressure_lag": 0.5, "input_path_lag": 0.45, "unlisted": 0.05}
    judged, _ = said(group("chamber", gas), group("arm", {"pressure_lag": 0.9, "unlisted": 0.1}))
    # what the arm tells of it counts in the chamber too
    assert judged[0].probability(Term("pressure_lag")) > 0.8
    assert case_probabilities(judged)["pressure_lag"] > 0.7
    assert judged[1].probability(Term("pressure_lag")) > 0.9


def with_encoder(found: BlockGroup, size: float) -> BlockGroup:
    """The group with a value of the encoder's error in its hypothesis."""
    fit = found.candidates[0].fit
    known = {"values": {"encoder_error.sine": size}, "std": {"encoder_error.sine": 0.01}}
    own = [
        replace(c, fit=replace(fit, effects=c.effects, **known))
        if c.terms == terms("encoder_error")
        else c
        for c in found.candidates
    ]
    return replace(found, candidates=own)


def test_what_two_groups_have_is_paid_for_once() -> None:
    """The price of an effect, and of a value that is rare, is that of one effect."""
    gas = {"encoder_error": 0.95, "unlisted": 0.05}
    arm = {"sensors.pressure_zero": 0.9, "encoder_error": 0.05, "unlisted": 0.05}

    def of_arm(size: float, other: float | None = None) -> float:
        judged, _ = said(
            with_encoder(group("chamber", gas), size if other is None else other),
            with_encoder(group("arm", arm), size),
        )
        return judged[1].probability(Term("encoder_error"))

    alone = judge([group("arm", arm)], SETTINGS)[0].probability(Term("encoder_error"))
    usual, rare = of_arm(0.0), of_arm(0.2)  # 20 standard deviations of what is usual
    assert alone < usual < 0.5 < rare
    # values that differ are two effects
    assert of_arm(0.2, other=-0.2) == pytest.approx(alone)


def test_open_sets_stand_beside_what_is_settled() -> None:
    gas = {"leak_muscle": 0.6, "chamber.dead_volume": 0.4}
    open_sets = [["leak_muscle"], ["chamber.dead_volume"]]
    for creep, settled in ((0.98, ["muscle_creep"]), (0.02, [])):
        arm = {"muscle_creep": creep, "unlisted": 1.0 - creep}
        judged, verdict = said(group("chamber", gas), group("arm", arm))
        assert verdict == "effects"
        assert case_ambiguity(judged) == [[*names, *settled] for names in open_sets]


def test_a_wrong_parameter_is_the_verdict_parameters() -> None:
    judged, verdict = said(
        group("chamber", {"chamber.dead_volume": 0.97, "unlisted": 0.03}), group("arm", {"": 1.0})
    )
    assert verdict == "parameters"
    assert judged[0].wrong == ("chamber.dead_volume",)
    assert case_probabilities(judged)["chamber.dead_volume"] > 0.9
    # but where another block keeps something without a name, physics is missing
    wrong = group("chamber", {"chamber.dead_volume": 1.0})
    assert said(wrong, group("arm", {"unlisted": 1.0}))[1] == "unlisted"
    assert said(wrong, group("arm", {"muscle_creep": 1.0}))[1] == "effects"


def test_a_name_that_is_more_probable_than_not_is_given() -> None:
    def of(chances: dict[str, float]) -> Judged:
        (judged,) = judge([group("arm", chances)], SETTINGS)
        return judged

    one = of({"muscle_creep": 0.35, "muscle_creep+payload_swing": 0.25, "unlisted": 0.4})
    assert (one.verdict, one.named) == ("effects", terms("muscle_creep"))
    both = ["muscle_creep", "payload_swing"]
    assert left_open(one.ambiguity) == [["unlisted"], ["muscle_creep"], both]
    two = of({"muscle_creep": 0.45, "muscle_hysteresis": 0.4, "unlisted": 0.15})
    assert (two.verdict, two.named) == ("effects", terms("muscle_creep"))
    none = of({"muscle_creep": 0.35, "muscle_hysteresis": 0.25, "unlisted": 0.4})
    assert none.verdict == "unlisted"


def test_healthy_groups() -> None:
    gas, arm = (group(name, {"": 1.0}) for name in ("chamber", "arm"))
    assert said(gas, arm)[1] == "none"
    assert said(group("chamber", {"": 1.0}, shifted=True), arm)[1] == "parameters"
    # a parameter at its wall, and nobody knows why
    at_wall = [["parameters"], ["unlisted"]]
    gas = group("chamber", {"": 1.0}, moved={"chamber.alpha": 3.0})
    judged, verdict = said(gas, arm)
    assert verdict == "parameters"
    assert left_open(judged[0].ambiguity) == at_wall
    # each inside its tolerances, and all together unlikely
    several = {f"arm.{k}": 2.2 for k in range(5)}
    assert left_open(said(group("arm", {"": 1.0}, moved=several))[0][0].ambiguity) == at_wall
    fewer = dict.fromkeys(list(several)[:1], 2.2)
    assert not said(group("arm", {"": 1.0}, moved=fewer, shifted=True))[0][0].ambiguity
    judged, _ = said(gas, group("arm", {"": 1.0}, moved={"arm.payload": 3.0}))
    assert case_ambiguity(judged) == at_wall
    # what is open in a block keeps that it may have no name
    arm = group("arm", {"muscle_creep": 0.5, "unlisted": 0.5})
    judged, _ = said(group("chamber", {"valve_dead_zone": 1.0}), arm)
    assert sorted(case_ambiguity(judged)) == [
        ["muscle_creep", "valve_dead_zone"],
        ["valve_dead_zone", "unlisted"],
    ]


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    gas=st.dictionaries(
        st.sampled_from(["leak_muscle", "pressure_lag", "chamber.dead_volume", "unlisted"]),
        st.floats(0.01, 1.0),
        min_size=1,
    ),
    arm=st.dictionaries(
        st.sampled_from(["muscle_creep", "pressure_lag", "arm.payload", "unlisted"]),
        st.floats(0.01, 1.0),
        min_size=1,
    ),
)
def test_probabilities_add_to_one_and_verdicts_follow_them(
    gas: dict[str, float], arm: dict[str, float]
) -> None:
    found = [{k: v / sum(p.values()) for k, v in p.items()} for p in (gas, arm)]
    judged = judge([group("chamber", found[0]), group("arm", found[1])], SETTINGS)
    for j in judged:
        assert sum(j.probabilities.values()) == pytest.approx(1.0)
        assert bool(j.named or j.wrong) == (j.verdict in ("effects", "parameters"))
        settled = max(j.probabilities.values()) >= 0.9
        assert not (settled and j.ambiguity)
        assert all(j.probabilities[h] >= 0.05 for h in j.ambiguity)
    sets = case_ambiguity(judged)
    assert len({tuple(s) for s in sets}) == len(sets)
    assert not sets or any(j.ambiguity for j in judged)
    # a set is names, maybe with what has none; or one word
    assert all(s and (len(s) == 1 or set(s).isdisjoint({"none", "parameters"})) for s in sets)
    case = case_probabilities(judged)
    assert sum(case.values()) == pytest.approx(1.0)
    assert set(HEALTHY) <= set(case)
    found_in = {j.verdict for j in judged}
    nameless = "unlisted" in found_in and "effects" not in found_in
    assert (case_verdict(found_in) == "unlisted") == nameless


def test_sentences_have_units_of_the_field() -> None:
    sizes = (1.5e-4, 2.25e-5, 3.6e-4, 5e-6, [3.5e-4, 3.7e-4], "m3", 9.3, 0.98, {})
    wrong = WrongParameter("chamber.dead_volume", "chamber", *sizes)
    assert sentence_of(wrong) == "chamber dead volume is 360.0 +- 5.0 cm3, not 150 +- 22"
    kept = Unexplained("arm", "joint_angle", "rad", 15.2, 0.007, "unlisted")
    assert kept_sentence(kept) == (
        "the residual of the arm is 15 times the noise level (0.40 deg), and no name explains it"
    )


def test_a_wrong_value_is_named_beside_an_effect() -> None:
    both = {"clock_skew+valve.discharge_area_max": 0.9, "unlisted": 0.1}
    judged, verdict = said(group("chamber", both))
    assert verdict == "effects"
    assert judged[0].named == terms("clock_skew")
    assert judged[0].wrong == ("valve.discharge_area_max",)


@pytest.mark.parametrize(("left", "verdict"), [(0.4, "parameters"), (0.6, "unlisted")])
def test_less_than_half_a_noise_level_is_no_physics_without_a_name(
    left: float, verdict: str
) -> None:
    own = group("chamber", {"unlisted": 1.0}, shifted=True)
    size = {"chamber": Excess(3.0, left, 0.0, 1.0, 1.0, 1.1)}
    base = replace(own.candidates[0], fit_excess=size, held_out_excess=size)
    (found,) = judge([replace(own, candidates=[base], unseen=0.25)], SETTINGS)
    assert found.verdict == verdict
    chance = found.probabilities[Hypothesis((), "unlisted")]
    assert chance == pytest.approx(1.0 if verdict == "unlisted" else 0.2)
    assert found.unseen == pytest.approx(0.0 if verdict == "unlisted" else 0.2)
