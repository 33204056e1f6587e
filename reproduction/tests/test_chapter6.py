"""Chapter 6 beside ours: work, input and cycles of known curves, the law of what air can give, and
the short experiments.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from reproduction import chapter6, recruiting
from reproduction.recruiting import CYCLE, Cycles, lifting, plant
from reproduction.tests.pages import by_fact

#: Statements of which ours differ; one that changes sides must be noticed.
DIFFER = {
    "air in two muscles at half the pressure over that in one, 4 and 8 bar",
    "one at 8 bar less two at 4 bar, e = 0.05",
    "loss of B / loss of A, 2 bar, e = 0.10",
    "least of tank less muscles with which the arm still reaches its angle",
    "with elasticity: least efficiency",
    "without elasticity: least efficiency",
    "without elasticity: largest efficiency",
    "without elasticity, 27 kg: two muscles less the worse of four and six",
    "torque at 120 deg over that at 15 deg, 13 bar",
    "tubing, by its friction: input with it over that without, least of the ten cases",
}


def cycles(tops=((90.0, 90.0),), fall=1e5):
    """Made-up cycles: up to given angles [deg], the torque 100 N m up and 50 N m down."""
    time = np.arange(0.0, CYCLE * len(tops[0]) + 1e-9, 0.01)
    angle = np.full((len(tops), time.size), math.radians(15.0))
    torque = np.full(angle.shape, 100.0)
    for row, tried in enumerate(tops):
        for k, top in enumerate(tried):
            now = time - CYCLE * k
            ends = ((0.0, 6.0), (6.0, 11.0), (11.0, 17.0))
            up, hold, down = ((now >= begin) & (now < end) for begin, end in ends)
            reach = math.radians(top - 15.0)
            angle[row, up] += reach * now[up] / 6.0
            angle[row, hold] += reach
            angle[row, down] += reach * (1.0 - (now[down] - 11.0) / 6.0)
            torque[row, down] = 50.0
    source = np.linspace(13e5, 13e5 - fall, time.size) + np.zeros_like(angle)
    cases = tuple((9.0, n) for n in (2, 4, 6)[: len(tops)])
    pressure, failed = np.full(angle.shape, 5e5), np.zeros(len(tops), dtype=bool)
    return Cycles(cases, 90.0, 0.015, time, angle, torque, pressure, source, failed)


# ------------------------------------------------------------------- work and input


def test_work_counts_what_rises_and_input_what_the_tank_loses():
    found = cycles(fall=2e5)
    rise = 2.0 * math.radians(75.0)
    assert found.work[0] == pytest.approx(100.0 * rise, rel=1e-3)
    assert found.energy[0] == pytest.approx(2e5 * 0.015)
    assert found.efficiency[0] == pytest.approx(100.0 * rise / 3000.0, rel=1e-3)
    assert found.of(9.0, 2) == found.efficiency[0]
    assert found.count == 2
    with pytest.raises(ValueError, match="not in tuple"):
        found.row(9.0, 6)


def test_cycles_are_followed_up_to_the_first_that_is_not():
    found = cycles(((90.0, 90.0, 90.0), (90.0, 80.0, 90.0), (70.0, 90.0, 90.0)))
    np.testing.assert_allclose(found.tops()[1], [90.0, 80.0, 90.0], atol=0.01)
    assert found.followed().tolist() == [3, 1, 0]
    np.testing.assert_allclose(found.gradient()[0, 0], 13e5 - 1e5 / 6.0 - 5e5, rtol=1e-2)


def test_best_number_follows_most_cycles_before_it_is_efficient():
    found = cycles(((90.0, 60.0), (90.0, 90.0), (90.0, 90.0)))
    torque = found.torque.copy()
    torque[0] *= 9.0
    torque[1] *= 0.5
    other = replace(found, torque=torque)
    assert chapter6.best_number(other, 9.0) == (6, 2)
    assert chapter6.best_number(found, 9.0)[1] == 2


# ------------------------------------------------------------------------- the plants


@pytest.fixture(scope="module")
def one():
    return lifting([(9.0, 2), (9.0, 6)], 90.0, 1)


def test_work_is_what_lifts_the_arm_and_rubs(one):
    rig = plant(9.0, 2)
    arm = {key: rig.parameter(f"arm.{key}").value for key in ("first_moment", "viscous", "coulomb")}
    weight = (arm["first_moment"] + 9.0 * 0.9) * 9.80665
    for row in range(2):
        high = one.angle[row].max()
        rate = np.gradient(one.angle[row], one.time)
        rising = np.maximum(rate, 0.0)
        lift = weight * (math.cos(one.angle[row, 0]) - math.cos(high))
        rub = np.trapezoid(
            arm["viscous"] * rising**2 + arm["coulomb"] * np.tanh(rate / 0.02) * rising, one.time
        )
        assert one.work[row] == pytest.approx(lift + rub, rel=0.01)
    assert one.energy[0] < one.energy[1]
    assert one.followed().tolist() == [1, 1]


def test_vented_muscles_that_bow_out_cost_nothing(one):
    bowed = recruiting.beside_idle(9.0, 90.0, 1)
    struts = recruiting.beside_idle(9.0, 90.0, 1, struts=True)
    assert bowed.efficiency[0] == pytest.approx(one.efficiency[0], rel=0.02)
    assert struts.efficiency[0] < 0.8 * one.efficiency[0]


def test_arm_of_the_test_matrix_is_just_not_lifted():
    from reproduction.lifting import lift

    least, most = chapter6._moments()
    assert most - least == pytest.approx(9.0 * 0.9)
    for more, lifted in ((0.01, False), (-0.01, True)):
        rig = plant(18.0, 2).with_parameters({"arm.first_moment": least + more})
        assert lift(rig, pressure=11.8e5, to=math.radians(90.0)).can_lift == lifted


# ---------------------------------------------------------------------------- the page


@pytest.mark.slow
def test_short_experiments_fill_the_page():
    rows = chapter6.facts(search=False)
    # of two cycles the first, which fills the empty muscles, is half
    close = "least gain of efficiency from a number of muscles to the next lower"
    differ = {row.fact for row in rows if row.verdict == "differs" and not row.apart}
    assert differ - {close} == DIFFER
    assert len({(row.group, row.fact) for row in rows}) == len(rows)
    assert all(row.where[:2] in ("6.", "Ta", "no") for row in rows)
    assert {row.group for row in rows} == set(chapter6.say.groups.values())
    assert all(chapter6.in_short(rows))
    tables = chapter6.tables()
    assert set(tables) <= set(chapter6.say.groups.values())
    stored = by_fact("chapter6")
    assert list(stored) == [(row.group, row.fact) for row in rows]
    counted = [row for row in stored.values() if not row["apart"]]
    whole = {row["fact"] for row in counted if row["verdict"] == "differs"}
    more = {"largest payload that follows every cycle", "number of muscles at 63 kg"}
    assert whole == DIFFER | more
    from reproduction.chapter6_figures import pictures

    for picture in pictures():
        assert picture.group in chapter6.say.groups.values()
        assert picture.png.startswith(b"\x89PNG")
