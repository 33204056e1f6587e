"""Margins of the sampled loops: the law, the core's own linear model, and a loop that passes it."""

import math

import pytest

from pamrs.control.linear import linearise
from reproduction import chapter4, chapter5, chapter6_loops, lift, recruiting, tracking
from reproduction.margins import (
    MARGIN,
    bearable,
    fastest,
    inner_gains,
    inner_margin,
    loop_margin,
)
from reproduction.recruiting import FILTER, MATRIX, MUSCLES, PERIOD, lifting, plant, rig_of

#: What all numbers of muscles had before.
SIX = {"kp": 4e-4, "ki": 2e-4, "pressure_filter": FILTER}


@pytest.mark.parametrize("muscles", MUSCLES)
def test_fastest_is_what_the_core_has_where_the_air_flows_choked(muscles):
    rig = plant(0.0, muscles)
    model = linearise(rig, math.radians(15.5), side="fill")
    row = model.states.index("muscle_pressure")
    # the core is half a degree above the least volume
    assert fastest(rig, "null") == pytest.approx(model.b[row, 0], rel=0.02)
    assert fastest(rig) == pytest.approx(1.5 * fastest(rig, "null"))
    assert fastest(rig) == pytest.approx(fastest(plant(0.0, 6)) * 6.0 / muscles, rel=1e-9)


def test_bearable_gain_is_the_boundary_of_the_sampled_loop():
    assert bearable(0.005, 0.0) == 2.0
    assert bearable(0.005, 0.0025) == pytest.approx(2.0 * math.cosh(1.0) / math.sinh(1.0))
    rig = plant(9.0, 4)
    gains = {"kp": bearable(PERIOD, FILTER) / (PERIOD * fastest(rig)), "ki": 0.0}
    assert inner_margin(rig, {**gains, "pressure_filter": FILTER}, PERIOD) == pytest.approx(
        1.0, abs=2e-3
    )
    # the recurrence itself, just below the boundary and just above it
    for share, grows in ((0.98, False), (1.02, True)):
        pole, moved = math.exp(-PERIOD / FILTER), share * bearable(PERIOD, FILTER)
        pressure, seen = 1.0, 0.0
        for _ in range(600):
            seen += (1.0 - pole) * (pressure - seen)
            pressure -= moved * seen
        assert (abs(pressure) > 10.0) == grows


@pytest.mark.parametrize("name", [*recruiting.READINGS, *recruiting.SUSPECTS])
def test_every_row_of_chapter_6_has_a_pressure_loop_with_room(name):
    changed = {**recruiting.READINGS, **recruiting.SUSPECTS}[name]
    cases = set(MATRIX[50.0]) | {(payload, n) for payload in recruiting.EXTENDED for n in MUSCLES}
    for payload, muscles in sorted(cases):
        rig = rig_of(payload, muscles, changed=changed)
        loop = recruiting.inner_loop(rig)
        assert inner_margin(rig, loop, PERIOD) == pytest.approx(MARGIN, rel=0.01)


@pytest.mark.parametrize("gains", [recruiting.GAINS])
def test_whole_loops_of_the_test_matrix_are_stable(gains):
    for payload, muscles in MATRIX[90.0]:
        rig = plant(payload, muscles)
        for angle in (16.0, 50.0, 88.0):
            found = loop_margin(
                rig,
                lambda rig=rig, n=muscles: recruiting.controller([rig], float(n), gains),
                math.radians(angle),
            )
            assert found > 1.9, (payload, muscles, angle)


def test_gains_of_six_muscles_put_two_into_a_limit_cycle(monkeypatch):
    case = [(27.0, 2)]
    assert inner_margin(plant(*case[0]), SIX, PERIOD) < 0.34
    stable = lifting(case, 50.0, 2)
    monkeypatch.setattr(recruiting, "inner_loop", lambda _: SIX)
    cycling = lifting(case, 50.0, 2)
    assert chapter6_loops.turning(cycling) > 0.3
    assert chapter6_loops.turning(stable) < 0.01
    assert cycling.efficiency[0] < 0.9 * stable.efficiency[0]


def test_loop_of_chapter_5_is_stable_next_to_the_valves_null():
    loop = {key: tracking.LOOP[key] for key in SIX}
    rig = tracking.plant(0.0)
    assert inner_margin(rig, loop, tracking.PERIOD, "null") > 1.4
    assert 0.95 < inner_margin(rig, loop, tracking.PERIOD) < 1.0  # in large moves only: it says so
    half = inner_gains(rig, tracking.PERIOD, tracking.LOOP["pressure_filter"])
    assert half["kp"] == pytest.approx(0.5 * tracking.LOOP["kp"], rel=0.03)


@pytest.mark.parametrize(("payload", "stable"), [(0.0, False), (25.0, True), (50.0, True)])
@pytest.mark.parametrize("kind", ["cascaded PID", "sliding"])
def test_loops_of_chapter_5_have_a_margin_with_a_payload_and_it_says_where_not(
    kind, payload, stable
):
    assert (float(chapter5._whole(kind, payload)) > 1.4) == stable


def test_pid_of_chapter_4_is_held_by_dry_friction_alone():
    rig = lift.plant(lift.VARIANTS[chapter4.SMOOTH], lift.PAYLOADS[1])
    assert float(chapter4._pid_margin(rig, 1.4, 2.5)) < 1.0
    assert float(chapter4._pid_margin(rig, 0.2, 0.0)) > 1.0
