"""What findings come to: verdict, what leads, what is still missed, and whether that is settled."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from pamrs.findings import (
    BlockMismatch,
    BlockVerdict,
    ChannelError,
    FreeRun,
    FreeRunError,
    MismatchSize,
    MismatchStages,
    MissingInput,
    beyond,
    case_verdict,
    left_of,
)
from pamrs.report import sentences
from pamrs.report.sentences import case_badge
from tests.diagnosis import synthetic

NAMES = {"effects": ["muscle_creep"], "parameters": [], "none": [], "unlisted": []}


def sizes(noises: float, *, more: bool) -> MismatchStages:
    size = MismatchSize(noises, 1e-3 * noises, more)
    return MismatchStages(size, size, size)


def group(block: str, verdict: str, chance: float, refit: float = 1.0, **more: Any) -> BlockVerdict:
    """A group of one block whose verdict has a probability."""
    key = "muscle_creep" if verdict == "effects" else verdict
    rest = {} if key == "unlisted" else {"unlisted": 1.0 - chance}
    own = BlockMismatch(block, f"{block}_channel", "rad", sizes(refit, more=refit > 2.0), None)
    found = BlockVerdict(
        [block], verdict, {key: chance, **rest}, NAMES[verdict], [], [], [own], block=block
    )
    return replace(found, **more)


def found(*groups: BlockVerdict, after: float = 1.0, error: float = 0.0, off: float = 0.0) -> Any:
    """A result: the final model misses so many noise levels of each channel, and as a whole."""
    blocks = [
        replace(g, mismatch=[replace(m, model_error=1e-3 * error) for m in g.mismatch])
        for g in groups
    ]
    mismatch = [m for g in groups for m in g.mismatch]
    sized = {m.channel: 1e-3 * m.fitted.refit.noises for m in mismatch}
    table = {
        c: dict(noise=1e-3, before=2 * r, refit=r, after=1e-3 * after) for c, r in sized.items()
    }
    run = FreeRunError("rad", 2e-3 * off, 1e-3 * off, None, None, 1e-3, off > 0.0)
    runs = [FreeRun("log", "held_out", 10.0, dict.fromkeys(sized, run))] if off else None
    verdict = case_verdict(g.verdict for g in groups)
    fit = {"channels": table, "held_out": {}, "gap_closed": None}
    effects = [{"id": "muscle_creep", "probability": 0.9, "parameters": {}}]
    named = effects if verdict == "effects" else []
    return synthetic.diagnosis(
        blocks=blocks, verdict=verdict, effects=named, fit=fit, free_run=runs, where={}
    )


def test_a_case_is_what_its_groups_say_at_the_worst() -> None:
    order = ("none", "parameters", "unlisted", "effects")
    for k, last in enumerate(order):
        assert case_verdict(order[: k + 1]) == last
    # what the whole rig misses is missing, whatever the groups say
    assert [case_verdict([own], missed=True) for own in order] == ["unlisted"] * 3 + ["effects"]


def test_noise_and_twice_the_error_of_the_model_are_no_miss() -> None:
    assert beyond(13.0, 1.0, 6.0) == pytest.approx(13.0 - math.hypot(1.0, 12.0))
    assert beyond(7.0, 1.0, 0.0) == 6.0
    assert beyond(math.nan, 1.0, 0.0) == beyond(7.0, 0.0, 0.0) == 0.0


@pytest.mark.parametrize(
    ("noises", "error", "more", "left", "healthy"),
    [
        (1.9, 0.0, False, "noise", "noise"),
        (1.2, 0.0, True, "more", "noise"),
        (5.0, 3.0, False, "error", "error"),
        # another shape than the error has; where nothing is missing, it is that error
        (5.0, 3.0, True, "more", "error"),
        (7.0, 3.0, False, "more", "more"),
    ],
)
def test_what_is_left_is_noise_the_error_of_the_model_or_more(
    noises: float, error: float, more: bool, left: str, healthy: str
) -> None:
    own = BlockMismatch("arm", "joint_angle", "rad", sizes(noises, more=more), None, error)
    table = ChannelError(1.0, noises, noises, noises)
    assert left_of(own, table, "after") == left
    assert left_of(own, table, "after", healthy=True) == healthy


@pytest.mark.parametrize(
    ("chance", "after", "off", "why"),
    [
        (0.9, 1.0, 0.0, ""),
        (0.75, 1.0, 0.0, "probability"),
        (0.9, 9.5, 0.0, "missed"),
        (0.9, 1.0, 8.5, "missed"),
        # forms of equations err by a tenth of what they explain
        (0.9, 6.5, 6.5, ""),
    ],
)
def test_an_answer_is_settled_or_says_why_not(
    chance: float, after: float, off: float, why: str
) -> None:
    told = found(group("arm", "effects", chance, 20.0), after=after, off=off)
    assert (told.answer.settled, told.answer.why) == (not why, why)
    assert told.answer.names == ["muscle_creep"]
    assert told.answer.probability == chance
    assert ("not settled" in case_badge(told)) == bool(why)
    # the name comes first, then what is missed with it
    assert told.headline.startswith("The model of the arm ")
    assert ("The mended model still misses arm channel by " in told.headline) == (why == "missed")
    assert ("may leave out" in sentences.title(told)) == bool(why)


def test_a_value_that_is_wrong_has_no_equation_that_errs() -> None:
    own = group("arm", "effects", 0.9, 20.0, wrong_parameters=["arm.payload"])
    assert found(own, after=6.5).answer.why == "missed"


def test_sets_that_are_left_leave_it_open() -> None:
    left = [["muscle_creep"], ["unlisted"]]
    told = found(group("arm", "effects", 0.6, 20.0, ambiguity=left))
    assert told.answer.why == "sets"
    assert told.answer.parts[0].left == ((("muscle_creep",), 0.6), (("unlisted",), 0.4))


def test_what_is_inside_the_stated_error_is_not_missed() -> None:
    arm = group("arm", "parameters", 0.86, 30.0)
    assert not found(arm, after=30.0, error=14.0).answer.missed
    (own,) = found(arm, after=30.0, error=10.0).answer.missed
    assert (own.block, own.channel, own.noises) == ("arm", "arm_channel", pytest.approx(30.0))
    assert own.beyond == pytest.approx(30.0 - math.hypot(1.0, 20.0))


def test_nothing_is_missing_is_no_answer_of_a_rig_that_misses_as_a_whole() -> None:
    told = found(group("chamber", "none", 0.86), group("arm", "parameters", 0.86), off=80.0)
    answer = told.answer
    assert (answer.verdict, answer.settled, answer.block) == ("unlisted", False, None)
    assert answer.parts == []
    assert [own.block for own in answer.missed] == [None, None]
    assert told.headline.startswith(
        "The refitted model still misses chamber channel by 4.6 deg (80"
    )
    assert told.headline.endswith("what is missing was not found")


def test_what_is_missing_without_a_name_is_told_by_what_it_depends_on() -> None:
    law = "2.5 N m, depending on the joint angle and on the direction of its stroke"
    numbers = (0.55, 1.0, 114.0, 0.4, "joint_angle", "joint_rate", {}, [])
    unnamed = found(group("arm", "unlisted", 0.8, 20.0), group("chamber", "none", 0.86))
    for argument, said in (("joint_angle", True), ("", False)):
        missing = MissingInput("arm", "N m", law, argument, *numbers)
        told = replace(unnamed, missing_input=missing).headline
        assert told.startswith("Something acts in the arm")
        assert (f"; it amounts to {law}" in told) == said
    named = found(group("arm", "effects", 0.9, 20.0))
    missing = MissingInput("arm", "N m", law, "joint_angle", *numbers)
    assert "it amounts to" not in replace(named, missing_input=missing).headline


def test_the_largest_mismatch_leads_behind_a_settled_name() -> None:
    """A chamber that misses by 1.2 noise levels does not lead over an arm that misses by 20."""
    small, large = group("chamber", "unlisted", 0.8, 1.2), group("arm", "unlisted", 0.8, 20.0)
    assert found(small, large).answer.block == "arm"
    named = group("chamber", "effects", 0.9, 3.0)
    assert found(large, named).answer.block == "chamber"
    unsure = group("chamber", "effects", 0.6, 3.0)
    assert found(large, unsure).answer.block == "arm"
