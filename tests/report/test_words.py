"""What a reader is told of shares, sizes and noise, and of one cause that several groups see."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pamrs.diagnosis.explain._conditions import _shares, _sign
from pamrs.findings import (
    BlockMismatch,
    BlockVerdict,
    BudgetTerm,
    MismatchSize,
    MismatchStages,
    Unexplained,
)
from pamrs.report import render_html, sentences
from tests.diagnosis import synthetic

KEYS = ("noise", "before", "refit", "after")


def stages(noises: float, *, more: bool) -> MismatchStages:
    size = MismatchSize(noises, 1e-3 * noises, more)
    return MismatchStages(size, size, size)


def group(
    block: str, channel: str, chance: float, verdict: str = "unlisted", **named: list[str]
) -> BlockVerdict:
    """A group of one block, which keeps noise alone with the final model; of the verdict where it
    names nothing.
    """
    names = [*named.get("effects", []), *named.get("wrong", [])]
    verdict = "effects" if named.get("effects") else "parameters" if names else verdict
    rest = "none" if verdict == "unlisted" else "unlisted"
    mismatch = BlockMismatch(block, channel, "rad", stages(0.5, more=True), stages(0.4, more=False))
    return BlockVerdict(
        blocks=[block],
        verdict=verdict,
        probabilities={"+".join(names or [verdict]): chance, rest: 1.0 - chance},
        effects=named.get("effects", []),
        wrong_parameters=named.get("wrong", []),
        ambiguity=[],
        mismatch=[mismatch],
    )


def term(kind: str, share: float, noises: float, name: str = "") -> BudgetTerm:
    return BudgetTerm("arm", kind, name, "", share, [share, share], None, noises, 0.001, "rad")


def seen(*blocks: BlockVerdict, **more: Any) -> Any:
    """A diagnosis with the groups of blocks that are given."""
    where = {"block": blocks[-1].blocks[0], "channel": "joint_angle", "text": "There."}
    found = [
        {"id": name, "probability": 0.9, "parameters": {}}
        for name in dict.fromkeys(e for b in blocks for e in b.effects)
    ]
    return synthetic.diagnosis(blocks=list(blocks), where=where, effects=found, **more)


def test_one_cause_that_two_groups_see_is_told_once() -> None:
    one = group("chamber", "muscle_pressure", 0.93, effects=["encoder_error"])
    two = group("arm", "joint_angle", 0.984, effects=["encoder_error"])
    found = seen(one, two)
    assert found.headline == (
        "The model leaves out encoder error in the arm (0.98) and in the chamber (0.93)"
    )
    assert sentences.name_chance(found, "encoder_error") == "0.98 in the arm, 0.93 in the chamber"
    # another name is told by itself
    other = group("arm", "joint_angle", 0.9, effects=["muscle_creep"])
    told = "encoder error in the chamber (0.93) and muscle creep in the arm (0.90)"
    assert seen(one, other).headline == f"The model leaves out {told}"


def test_a_settled_name_leads_the_title_whatever_else_is_located() -> None:
    sure = group("chamber", "muscle_pressure", 0.93, effects=["leak_muscle"])
    creep = group("arm", "joint_angle", 0.4, effects=["muscle_creep"])
    left = replace(creep, effects=[], ambiguity=[["unlisted"], ["muscle_creep"]])
    found = seen(sure, left, verdict="effects")
    assert sentences.title(found) == (
        "The model of the chamber leaves out a leak: muscle leak (0.93); something else may act "
        "in the arm"
    )
    assert sentences.facts(found)[0][0] == "chamber"
    names = [row.name for row in sentences.rivals(found)]
    assert names[0] == "muscle leak in the chamber"
    assert any(name.endswith("in the arm") for name in names)


def test_noise_that_is_left_is_not_called_unexplained(tmp_path: Any) -> None:
    terms = [term("parameters", 0.99, 0.1), term("unexplained", 0.01, 0.029)]
    found = seen(group("arm", "joint_angle", 0.9, effects=["muscle_creep"]), budget=terms)
    ((block, told),) = sentences.budget_sentences(found)
    assert (block, sentences.left_in(found, "arm")) == ("arm", "noise")
    assert told == "parameters inside tolerance 99 % (99 to 99); only noise is left."
    assert "unexplained" not in sentences.budget_sentences(found)[0][1]
    # where it is more than noise, or a result does not say, the size is told
    assert "1 % unexplained" in sentences.budget_sentence(terms)
    inside = sentences.budget_sentence(terms, "error")
    assert inside.endswith("what is left is inside the usual error of the model.")


def test_shares_are_explained_where_they_can_be_misread() -> None:
    rest = term("unexplained", 0.0, 0.0)
    quiet = synthetic.diagnosis(budget=[term("parameters", 1.0, 0.1), rest])
    assert sentences.BUDGET_NOTE[:30] not in " ".join(quiet.summary().split())
    for taken in (
        [term("parameters", -0.2, 0.1), term("effect", 1.2, 0.1, "muscle_creep")],
        [term("parameters", -0.1, 0.1)],
        [term("parameters", 0.7, 0.1), term("effect", 0.3, 0.1, "muscle_creep")],
    ):
        told = " ".join(synthetic.diagnosis(budget=[*taken, rest]).summary().split())
        assert sentences.BUDGET_NOTE in told


@pytest.mark.parametrize(
    ("role", "where"),
    [("held_out", " on held-out recordings,"), ("fit", " on the fitted recordings,"), ("", ",")],
)
def test_a_size_says_which_recordings_it_is_of(role: str, where: str) -> None:
    kept = Unexplained("arm", "joint_angle", "rad", 21.0, 0.007, "unlisted", role=role)
    assert f"is 21 times the noise level (0.40 deg){where} and" in sentences.kept_sentence(kept)


def test_one_size_of_a_mismatch_stands_everywhere() -> None:
    errors = {
        "muscle_pressure": (100.0, 500.0, 500.0, 400.0),
        "joint_angle": (0.001, 0.02, 0.011, 0.001),
    }
    fit = {
        "channels": {},
        "held_out": {name: dict(zip(KEYS, told, strict=True)) for name, told in errors.items()},
        "gap_closed": 11.0 / 14.0,
    }
    found = seen(group("arm", "joint_angle", 0.9, effects=["muscle_creep"]), fit=fit)
    told = "11 noise levels (0.63 deg)"
    assert str(sentences.miss(found, "joint_angle", "refit")) == told
    assert sentences.mended_sentence(found, "With it,") == (
        f"With it, the model misses joint angle by 1.0 noise levels (0.057 deg) instead of {told}, "
        "on held-out recordings."
    )
    other = group("chamber", "muscle_pressure", 0.9)
    page = render_html(seen(other, found.judged[0], fit=fit, traces=[]))
    assert "11× noise" in page  # the table of errors
    assert "11 noise levels (0.63 deg)" in page  # block by block, and why parameters lost
    assert sentences.miss(found, "force", "refit") is None
    none = seen(group("arm", "joint_angle", 0.9), fit={**fit, "held_out": {}})
    assert sentences.mended_sentence(none, "With it,") == ""


def test_residuals_of_both_signs_do_not_cancel() -> None:
    swings = 20.0 * np.sin(np.linspace(0.0, 6 * np.pi, 300))
    assert _sign(swings, rising=False) == ", where the measurement lies above and below the model"
    assert _sign(swings, rising=True) == ", where the measurement rises and falls against the model"
    assert _sign(np.abs(swings), rising=False) == ", where the measurement lies above the model"
    assert _sign(-np.abs(swings), rising=True) == ", where the measurement falls against the model"
    assert _sign(0.01 * swings, rising=False) == ""  # noise has no side


def test_conditions_count_nothing_twice() -> None:
    z = np.concatenate([np.full(20, 3.0), np.full(20, 2.0), np.full(60, 1.0)])  # excess 8, 3 and 0
    at = np.arange(100)
    masks = {"closed": at < 30, "at rest": at < 40, "open": at >= 30, "seldom": at < 5}
    found = _shares(masks, z, rising=False)
    assert [c.name for c in found] == ["at rest", "open"]  # "closed" is inside of "at rest"
    assert [c.share for c in found] == pytest.approx([1.0, 0.0])
    found = _shares({"closed": at < 30, "at rest": (at >= 10) & (at < 40)}, z, rising=False)
    # 160 + 30 of 220 are in the first; of the second 30 are left that the first has not
    assert [(c.name, c.time) for c in found] == [("closed", 0.3), ("at rest", 0.1)]
    assert [c.share for c in found] == pytest.approx([190 / 220, 30 / 220])
    assert found[1].text.startswith("otherwise at rest: 14 % of the excess over the noise, in 10 %")
    assert not _shares(masks, np.zeros(100), rising=False)


def test_a_miss_inside_the_usual_error_of_a_model_is_said_so() -> None:
    """The arm misses ten noises where its model is usually off by twelve."""
    own = group("arm", "joint_angle", 0.9, "none")
    (mismatch,) = own.mismatch
    errors = {"joint_angle": dict(zip(KEYS, (0.001, 0.02, 0.01, 0.01), strict=True))}
    fit = {"channels": errors, "held_out": {}, "gap_closed": None}
    for error, told in (
        (0.012, "to within its usual error (joint angle 0.57 deg of up to 1.4 deg)"),
        (0.0046, "to within 10 noise levels (0.57 deg) of joint angle"),
    ):
        quiet = replace(own, mismatch=[replace(mismatch, model_error=error)])
        found = synthetic.diagnosis(
            blocks=[quiet], verdict="none", effects=[], probabilities={"none": 1.0}, fit=fit
        )
        assert sentences.title(found).endswith(f"the model explains these recordings {told}")
