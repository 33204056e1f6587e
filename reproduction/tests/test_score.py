"""What counts as what in the score: the rows that were judged otherwise before, one sentence one
row, and reasons of differences.
"""

import re
from collections import Counter

import numpy as np
import pytest

from reproduction import CHAPTERS, chapter4, chapter5, chapter5_comparison, tracking
from reproduction.chapter4_statements import on_stop, restless, statements
from reproduction.comparison import BASES, KINDS
from reproduction.lift import GAINS, Map
from reproduction.tests.pages import facts, page_of
from reproduction.tests.test_chapter4 import made, verdicts

#: Sentences that state several numbers or orders, each of which is a row.
SEVERAL = (
    "the efficiency range jumps from 10-30% to 52-66%",
    "unmodeled factors, which could include",
    "higher error at high pressures",
    "'remains stable'",
    "'no overshoot is present'",
    "'smooth and accurate'",
    "smaller in all stages",
    "low-amplitude, high-frequency content",
)


def stored(chapter):
    return [row for row in facts(chapter) if not row["apart"]]


# ------------------------------------------------------------------------ what is stored


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_every_row_has_one_kind(chapter):
    for row in stored(chapter):
        assert row["kind"] in KINDS
        assert row["basis"] in BASES
        assert (row["kind"] in BASES.values()) == (row["verdict"] == "agree")


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_difference_has_its_reason_or_says_that_none_is_known(chapter):
    text = page_of(chapter)
    for row in stored(chapter):
        if row["kind"] == "differs":
            line = rf"^- \[\d+\] {re.escape(row['fact'])}: (.+)$"
            assert re.search(line, text, flags=re.MULTILINE), row["fact"]
            assert row["reason"] or "reason not known" in text


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_one_sentence_is_one_row(chapter):
    quoted = Counter(row["where"] for row in stored(chapter) if "'" in row["where"])
    again = [where for where, rows in quoted.items() if rows > 1]
    assert [where for where in again if not any(text in where for text in SEVERAL)] == []


# ----------------------------------------------------------------------- how it is judged


def test_overshoot_onto_the_stop_decides_nothing():
    fact = "PID, 34 kg: overshoot below the rest position"
    assert verdicts(PID=made(rest=-5.0))[fact] == "agree"
    assert verdicts(PID=made(rest=-5.6))[fact] == "cannot tell"
    assert on_stop(made(rest=-5.0)) == ""


def test_run_that_does_not_come_to_rest_is_said_in_its_rows():
    runs = dict.fromkeys(GAINS, made()) | {"FF+PID": made(swing=3.0)}
    told = {row.fact for row in statements("g", runs) if "not at rest in the hold" in row.note}
    assert {fact for fact in told if fact.startswith("FF+PID")} == {
        "FF+PID: largest overshoot of the hold",
        "FF+PID: swing in the last 2 s of the hold",
        "FF+PID: error in the lift, 45 kg over 11 kg",
    }
    assert not any(fact.startswith("fuzzy") for fact in told)
    assert restless("x", made()) == ""
    assert restless("x", made(swing=3.0)).startswith("x 6.0 (11 kg)")


@pytest.mark.parametrize(("place", "told"), [((0, 1), True), ((1, 2), True), ((1, 1), False)])
def test_optimum_on_the_border_of_a_map_is_none(place, told):
    j = np.full((3, 3, 3), 2.0)
    j[:, place[0], place[1]] = 1.0
    axes = {"kP": np.array([0.2, 1.0, 2.0]), "kI": np.array([0.0, 1.0, 2.0])}
    gains = Map(axes, (11.0, 23.0, 34.0), j, {"rad": j}, {"rad": j})
    assert bool(chapter4._border(gains, 0)) == told
    if told:
        assert "with 11 kg" in chapter4._border(gains, 0)


def test_orders_are_judged_by_the_worst_payload():
    told = chapter5_comparison._judged({0.0: 10.8, 25.0: 0.67})
    assert told == "0 lb 10.80 (does not), 25 lb 0.67 (holds)"
    assert chapter5_comparison._judged({0.0: 1.2}, above=True) == "0 lb 1.20 (holds)"


def test_triangle_at_phase_0_begins_at_its_mean_and_is_else_the_experiments():
    plan = chapter5.FULL
    printed = chapter5._phase_zero(plan)
    used = np.degrees(tracking.waves(plan.record).sampled(tracking.PERIOD)[1].angle)
    assert 15.0 < printed.min() < printed.max() < 110.0
    assert used.min() < 15.0
    quarter = round(0.25 / 0.16 / tracking.PERIOD)
    time = tracking.PERIOD * np.arange(used.size)
    cosines = sum(a * np.cos(w * time) for a, w in chapter5._table())
    shifted = (used - cosines)[quarter:]
    assert np.abs(shifted - (printed - cosines)[: shifted.size]).max() < 0.05
