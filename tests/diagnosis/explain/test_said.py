"""What a diagnosis says it looked at, and in which order: blocks that were not judged, the whole
rig from its commands alone, names that are not determined or spoil a channel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs import report
from pamrs.diagnosis.evidence import (
    BlockGroup,
    FittedHypothesis,
    drop_undetermined,
    judge,
    put_aside,
)
from pamrs.diagnosis.fit import Events, Problem, fit, known_parameters, residuals
from pamrs.diagnosis.model import _conclude, _free_run
from pamrs.diagnosis.next_experiment._asked import _telling, next_to_record
from pamrs.diagnosis.noise import NoiseLevel
from pamrs.diagnosis.prepare import unjudged_blocks
from pamrs.effects import UNDECIDED, UNLISTED, Hypothesis, Term
from pamrs.experiments import experiments_of
from pamrs.findings import (
    MOST_MISSED,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    FreeRun,
    FreeRunError,
)
from pamrs.report import sentences
from tests.diagnosis.asked import SETTINGS, blocks_of, diagnosed, problem_of
from tests.diagnosis.explain.test_assemble import NAMES, recorded
from tests.diagnosis.kept import kept
from tests.diagnosis.terms import by_text, of_texts, terms
from tests.report.test_words import group, seen, stages

LEAK = terms("leak_muscle")
RIG = pamrs.rigs.shoulder()


def found_without(true: pamrs.Rig, leave_out: str) -> pamrs.diagnosis.Diagnosis:
    """The diagnosis of two logs of a shoulder that lack a channel."""

    def one(role: str, k: int) -> pamrs.Recording:
        return recorded(true, f"r{k}", role, leave_out=leave_out, seed=k)

    return diagnosed(RIG, one, ("fit", "held_out"))


def test_blocks_that_were_not_judged_are_said_everywhere() -> None:
    found = found_without(RIG, "valve_command")
    assert found.verdict in ("none", "parameters")
    told = {b.blocks[0]: b for b in found.not_judged}
    assert list(told) == ["supply", "chamber"]
    assert [b.blocks for b in found.judged] == [["arm"]]
    assert told["chamber"].covers == "valve, line and chamber"
    assert told["chamber"].reason == "valve_command is not in every recording"
    content = kept(found)
    assert [b["verdict"] for b in content["blocks"][1:]] == ["not_judged", "not_judged"]
    for text in (found.headline, found.text, found.summary()):
        flat = " ".join(text.split())
        assert "valve, line and chamber (valve_command is not in every recording)" in flat
        assert "in the arm" in flat  # nothing is missing of what was judged
    assert (found.answer.settled, [p.group.blocks for p in found.answer.quiet]) == (True, [["arm"]])
    page = report.render_html(found)
    assert "not judged" in page
    assert "valve_command is not in every recording" in page


def test_every_block_of_a_full_log_is_judged() -> None:
    assert unjudged_blocks(RIG, NAMES) == []
    lacking = tuple(name for name in NAMES if name != "joint_angle")
    assert [b.name for b in unjudged_blocks(RIG, lacking)] == ["supply", "chamber", "arm"]


@pytest.mark.parametrize(
    "what", ["area", pytest.param("leak", marks=pytest.mark.slow), "nothing", "level"]
)
def test_valve_and_chamber_are_judged_without_a_gauge_at_the_tank(what: str) -> None:
    name = "valve.discharge_area_max"
    area, level = RIG.parameter(name), RIG.parameter("supply.initial_pressure")
    true = {
        "area": RIG.with_parameters({name: 0.75 * area.value}),
        "leak": RIG.with_effect("leak_muscle", {"conductance": 1e-9}),
        "nothing": RIG,
        "level": RIG.with_parameters({level.name: level.value + 1.5 * level.tol}),
    }[what]
    found = found_without(true, "supply_pressure")
    judged = {name for b in found.judged for name in b.blocks}
    assert judged == {"chamber", "arm"}
    assert [b.blocks for b in found.not_judged] == [["supply"]]
    assert any("supply_pressure was not recorded: chamber" in w for w in found.warnings)
    if what == "area":
        (wrong,) = found.wrong_parameters
        assert wrong.name == name
        assert wrong.value == pytest.approx(0.75 * area.value, rel=0.05)
    elif what == "leak":
        assert [e.id for e in found.effects] == ["leak_muscle"]
        told = found.effects[0].parameters["conductance"]
        assert told.value == pytest.approx(1e-9, rel=0.1)
    else:
        assert found.verdict in ("none", "parameters")
        assert found.wrong_parameters == []


def known_of(rig: pamrs.Rig) -> _free_run.KnownValues:
    """What the rig file says of the values."""
    own = {n: p for n, p in known_parameters(rig).items() if p.tol > 0.0}
    tols = np.diag([p.tol for p in own.values()])
    return _free_run.KnownValues(tuple(own), np.array([p.value for p in own.values()]), tols)


@pytest.mark.parametrize(("strength", "off"), [(0.0, False), (3e-9, True)])
def test_a_free_run_beyond_what_is_known_of_the_values_is_off(strength: float, off: bool) -> None:
    moved = {"valve.discharge_area_max": 1.0, "supply.initial_pressure": -1.0}
    true = RIG.with_parameters(
        {n: RIG.parameter(n).value + far * RIG.parameter(n).tol for n, far in moved.items()}
    )
    true = true.with_effect("leak_muscle", {"conductance": strength}) if strength else true
    problem = problem_of(RIG, [recorded(true, "a", "fit")])
    own = residuals(problem, RIG)
    runs, *_ = _free_run.free_run(
        problem, {"before": own, "after": own}, RIG, RIG, None, known_of(RIG)
    )
    assert runs is not None
    error = runs[0].channels["muscle_pressure"]
    assert error.noises > MOST_MISSED  # the nominal values miss it in both cases
    assert error.off is off


def ran(noises: float, *, off: bool) -> FreeRun:
    error = FreeRunError("Pa", 3e4, 400.0 * noises, 800.0, 400.0, 400.0, off)
    return FreeRun("log", "held_out", 10.0, {"muscle_pressure": error})


def test_nothing_is_settled_while_the_whole_rig_is_off() -> None:
    own = group("arm", "joint_angle", 0.98, effects=["muscle_creep"])
    quiet = seen(own, free_run=[ran(57.0, off=False)])
    loud = seen(own, free_run=[ran(57.0, off=True)])
    assert (quiet.answer.settled, loud.answer.settled, loud.answer.why) == (True, False, "missed")
    assert loud.headline == (
        "The model of the arm may leave out a slow change of the muscle: muscle creep (0.98). The "
        "mended model still misses muscle pressure by 0.23 bar (57 noise levels; your model: 0.30 "
        "bar) in the whole rig; what else is missing was not found"
    )
    assert "whole rig" not in quiet.headline
    assert "not settled: more is missing" in report.render_html(loud)


def test_the_next_experiment_of_a_rig_that_is_off_is_no_end() -> None:
    problem = problem_of(RIG, [recorded(RIG, "a", "fit")])
    blocks = problem.blocks
    white = dict.fromkeys(("supply", "chamber", "arm"), 1.0)
    base = FittedHypothesis((), fit(problem, RIG, (), {}, white), {}, {}, 0.0)
    quiet = judge([BlockGroup(blocks, {}, {}, [base], {UNDECIDED: 1.0}, None, {}, [])], SETTINGS)
    healthy = group("arm", "joint_angle", 0.9, "none")
    errors_of_run = FreeRunError("Pa", 3e4, 2e4, 8.0, 4.0, 400.0, True)

    def told(problem: Problem, *off: str) -> str:
        errors = dict.fromkeys(off, errors_of_run)
        run = FreeRun("log", "held_out", 10.0, errors)
        found = seen(healthy, verdict="none", free_run=[run])
        return next_to_record(found, [], [], RIG, quiet, problem, problem).text

    assert told(problem).startswith("The answer is settled")
    # a block that has the channel is asked, without one what surrounds it
    assert "no judged block shows why. For the chamber: step" in told(problem, "muscle_pressure")
    # an error of the chamber goes on to the arm, which fits to the noise by itself
    assert "For the chamber" in told(problem, "joint_angle", "muscle_pressure")
    # one that keeps more than noise within the usual error of its model is asked about first
    arm = replace(healthy, mismatch=[replace(m, model_error=1.0) for m in healthy.mismatch])
    large = {"joint_angle": {"noise": 1e-3, "before": 0.05, "refit": 0.05, "after": 0.05}}
    run = FreeRun("log", "held_out", 10.0, {"muscle_pressure": errors_of_run})
    whole = seen(arm, verdict="none", free_run=[run], fit={"channels": {}, "held_out": large})
    text = next_to_record(whole, [], [], RIG, quiet, problem, problem).text
    assert text.startswith(
        "The whole rig misses the muscle pressure, and no judged block shows why"
    )
    assert "For the arm" in text
    few = replace(problem, blocks=[b for b in blocks if b.name != "chamber"])
    assert "record the channels between it" in told(few, "muscle_pressure")


def test_what_may_leak_is_shut_in_inside_the_pressures_that_were_recorded() -> None:
    chamber = blocks_of(RIG, NAMES)["chamber"]
    assert _telling(chamber, RIG).kind == "step_and_shut"
    assert _telling(chamber, RIG, terms("pressure_lag")).kind == "step_and_shut"
    leak = _telling(chamber, RIG, terms("leak_muscle"))
    assert leak.kind == "sealed_hold"
    assert "inside those that are already recorded" in leak.text
    record = recorded(RIG, "a", "fit")
    (hold,) = experiments_of(RIG, [record], SETTINGS, ["sealed_hold"])
    run = hold.simulate(RIG)
    assert run["muscle_pressure"].max() < 1.02 * record.channels["muscle_pressure"].max()


def block_of(name: str, channel: str, noises: float, *, more: bool, **named: Any) -> BlockVerdict:
    own = group(name, channel, 0.9, **named)
    (mismatch,) = own.mismatch
    sized = replace(mismatch, fitted=stages(noises, more=more), held_out=None)
    verdict = "effects" if named else "unlisted"
    return replace(own, mismatch=[sized], verdict=verdict)


def test_the_headline_says_what_each_block_misses() -> None:
    sure = block_of("chamber", "muscle_pressure", 0.3, more=False, effects=["muscle_creep"])
    large = block_of("arm", "joint_angle", 175.0, more=True)
    told = seen(sure, replace(large, probabilities={"unlisted": 0.9})).headline
    assert told == (
        "The model leaves out muscle creep in the chamber (0.90) and an effect outside the "
        "catalogue in the arm (0.90)"
    )


def term(kind: str, share: float, name: str = "") -> BudgetTerm:
    wide = [share - 0.1, share + 0.1]
    return BudgetTerm("arm", kind, name, "", share, wide, None, 3.0, 0.001, "rad")


def test_shares_that_cancel_are_told_together() -> None:
    rest = term("unexplained", 0.37)
    told = sentences.budget_sentence(
        [term("parameters", -8.33), term("effect", 8.96, "muscle_creep"), rest]
    )
    assert told.startswith(
        "parameters inside tolerance and muscle creep together 63 % (53 to 73); 37 % unexplained"
    )
    worse = sentences.budget_sentence(
        [term("effect", -8.33, "muscle_creep"), term("unexplained", 9.33)]
    )
    assert "%" not in worse
    assert worse == "more is unexplained than with the nominal model."


def leak_group(strength: float) -> tuple[Problem, BlockGroup]:
    """A chamber's group with the leak that its log has, fitted, and a companion beside it."""
    true = RIG.with_effect("leak_muscle", {"conductance": strength})
    problem = problem_of(RIG, [recorded(true, "all", "fit")], "chamber")
    (chamber,) = problem.blocks
    free = {"leak_muscle.conductance": strength}
    base = fit(problem, RIG, (), {}, {"chamber": 1.0})
    found = fit(problem, RIG, LEAK, free, {"chamber": 1.0})
    candidates = [
        FittedHypothesis((), base, {}, {}, 0.0),
        FittedHypothesis(LEAK, found, {}, {}, 1.0),
    ]
    chances = of_texts({"leak_muscle": 0.9, "unlisted": 0.1})
    return problem, BlockGroup([chamber], {}, {}, candidates, chances, chamber, {}, [chamber])


def test_a_name_that_is_determined_stands() -> None:
    problem, own = leak_group(3e-9)
    assert drop_undetermined(own, problem).probabilities == own.probabilities


def test_a_name_whose_value_is_not_determined_does_not_lead() -> None:
    problem, own = leak_group(1e-13)  # far below what the log could tell
    after = drop_undetermined(own, problem)
    assert by_text(after.probabilities) == pytest.approx({"leak_muscle": 0.45, "unlisted": 0.55})
    (judged,) = judge([after], SETTINGS)
    assert judged.verdict == "unlisted"
    # whether a companion is needed the evidence of the set without it has said
    base, leak = own.candidates
    pair = replace(leak, effects=LEAK, wrong=("chamber.dead_volume",))
    alone = replace(base, wrong=("chamber.dead_volume",))
    chances = {pair.hypothesis: 0.6, alone.hypothesis: 0.3, UNLISTED: 0.1}
    both = replace(own, candidates=[base, leak, pair, alone], probabilities=chances)
    left = drop_undetermined(both, problem).probabilities
    # a value that stayed where it was is not wrong
    assert left == chances | {alone.hypothesis: 0.15, UNLISTED: 0.25}


@pytest.mark.parametrize(("together", "kept"), [(0.99, 0.9), (0.0, 0.45)])
def test_a_size_is_as_uncertain_as_its_shape_and_yet_determined(
    monkeypatch: pytest.MonkeyPatch, together: float, kept: float
) -> None:
    """A stiffness of 500 +- 600 N/m of a creep whose time constant is as uncertain: together they
    are known, alone the stiffness is not.
    """
    problem, own = leak_group(3e-9)
    base, leak = own.candidates
    names = ["muscle_creep.stiffness", "muscle_creep.time_constant"]
    std = dict(zip(names, (300.0, 2.0), strict=True))  # stated twice as wide
    monkeypatch.setattr(
        "pamrs.diagnosis.evidence._determined.spread_over_pieces", lambda problem, found: std
    )
    creep = replace(
        leak.fit,
        rig=RIG.with_effect("muscle_creep", {"stiffness": 500.0}),
        values=dict(zip(names, (500.0, 3.0), strict=True)),
        scales=dict(zip(names, (500.0, 3.0), strict=True)),
        covariance=np.array([[1.0, together], [together, 1.0]]),
    )
    named = replace(leak, effects=(Term("muscle_creep"),), fit=creep)
    chances = {named.hypothesis: 0.9, UNLISTED: 0.1}
    left = drop_undetermined(
        replace(own, candidates=[base, named], probabilities=chances), problem
    ).probabilities
    assert left[named.hypothesis] == pytest.approx(kept)


@pytest.mark.parametrize(
    ("off", "std", "kept"), [(5.0, 0.5, 1.0), (5.0, 2.4, 0.0), (18.0, 8.0, 1.0), (18.0, 9.5, 0.0)]
)
def test_a_wrong_value_that_is_not_determined_is_no_name_in_noise(
    monkeypatch: pytest.MonkeyPatch, off: float, std: float, kept: float
) -> None:
    """Less than one standard deviation beyond the third tolerance, or two off the file's value:
    alone and with a leak it is put aside, and what remains keeps its odds.
    """
    name = "chamber.dead_volume"
    problem, own = leak_group(3e-9)
    base, leak = own.candidates[:2]
    tolerance = base.fit.scales[name]
    far = base.fit.known[name].value + off * tolerance
    monkeypatch.setattr(
        "pamrs.diagnosis.evidence._determined.spread_over_pieces",
        lambda problem, found: dict.fromkeys(found.values, 1e-12) | {name: std * tolerance},
    )
    wrong, pair = (
        replace(
            one,
            fit=replace(
                one.fit,
                moved=one.fit.moved | {name: off},
                values=one.fit.values | {name: far},
            ),
            wrong=(name,),
        )
        for one in (base, leak)
    )
    chances = {wrong.hypothesis: 0.6, pair.hypothesis: 0.2, leak.hypothesis: 0.15, UNDECIDED: 0.05}
    every = [base, wrong, pair, leak]
    near = replace(own, candidates=every, probabilities=chances, mismatch=None)
    left = drop_undetermined(near, problem).probabilities
    assert left.get(wrong.hypothesis, 0.0) == pytest.approx(kept * 0.6)
    assert left.get(pair.hypothesis, 0.0) == pytest.approx(kept * 0.2)
    assert left[leak.hypothesis] == pytest.approx(3.0 * left[UNDECIDED])
    assert sum(left.values()) == pytest.approx(1.0)


def test_events_of_another_effect_determine_no_value() -> None:
    problem, own = leak_group(1e-13)
    leak = own.candidates[1]

    def left(effect: str) -> dict[Hypothesis, float]:
        happened = Events(Term(effect), {"all": {"torque": 1.0}})
        beside = replace(leak, fit=replace(leak.fit, events=happened))
        group = replace(own, candidates=[own.candidates[0], beside])
        return drop_undetermined(group, problem).probabilities

    assert left("external_torque")[Hypothesis(LEAK)] == pytest.approx(0.45)
    # what happened itself is known by its times
    assert left("leak_muscle") == own.probabilities


def test_a_name_that_spoils_a_channel_is_put_aside() -> None:
    _, own = leak_group(3e-9)
    (judged,) = judge([own], SETTINGS)
    assert judged.named == LEAK
    assert _conclude._blamed([judged], ["muscle_pressure"]) == {0}
    assert _conclude._blamed([judged], ["joint_angle"]) == set()  # it acts nowhere there
    after = put_aside(own, Hypothesis(LEAK))
    assert after.probabilities == {UNLISTED: 1.0}
    assert [c.hypothesis for c in after.candidates] == [UNDECIDED]
    more = replace(own, probabilities=own.probabilities | of_texts({"x": 0.3}))
    assert by_text(put_aside(more, Hypothesis(LEAK)).probabilities) == pytest.approx(
        {"unlisted": 0.25, "x": 0.75}
    )
    quiet = replace(own, probabilities={Hypothesis(LEAK): 1.0}, mismatch=None)
    assert put_aside(quiet, Hypothesis(LEAK)).probabilities == {UNDECIDED: 1.0}


def test_a_group_that_misses_much_is_not_one_of_which_nothing_is_missing() -> None:
    problem, own = leak_group(3e-9)
    quiet = replace(own, candidates=own.candidates[:1], mismatch=None, suspects=[])
    quiet = replace(quiet, probabilities={UNDECIDED: 1.0})
    levels = {("chamber", "all"): NoiseLevel(400.0, 400.0)}
    models, *_ = _conclude._sound_models(RIG, problem, problem, [quiet], levels)
    (judged,) = models.judged
    assert (judged.verdict, models.verdict) == ("unlisted", "unlisted")
    assert (judged.group.mismatch, judged.group.suspects) == (own.blocks[0], own.blocks)
    # an error of the model of that size explains it
    wide = {key: NoiseLevel(400.0, 4e4, curve_share=0.9999) for key in levels}
    models, *_ = _conclude._sound_models(RIG, problem, problem, [quiet], wide)
    assert models.verdict in ("none", "parameters")


def test_a_name_that_predicts_its_block_worse_than_the_rig_file_is_put_aside() -> None:
    _, own = leak_group(3e-9)
    (judged,) = judge([own], SETTINGS)

    def blamed(before: float, after: float) -> set[int]:
        table = {"muscle_pressure": ChannelError(725.0, before, 2.0 * before, after)}
        return _conclude._worse_than_file([judged], table, 0.1)

    assert blamed(800.0, 898.0) == {0}
    assert blamed(800.0, 810.0) == set()  # no more than chance
    assert blamed(800.0, 790.0) == set()
    assert _conclude._without_addition(own, judged).probabilities == {UNLISTED: 1.0}
