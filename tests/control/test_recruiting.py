"""Recruitment in real time: the torque stays, groups come and go smoothly, without chatter, and not
at the expense of the supply.
"""

import math

import numpy as np
import pytest

import pamrs
from benchmarks.recruitment import follow
from pamrs.control import Demand, Recruitment, RigController, RigModel, closed_loop
from pamrs.control.trajectories import cosine_cycles, degrees
from tests.simulation.refusals import refused

PERIOD = 0.005
RIG = pamrs.rigs.named("recruitment")
MODEL = RigModel(RIG)
GROUPS, LIMIT = MODEL.torques_of("shoulder"), MODEL.pressure_limit
ANGLE = math.radians(60.0)


def scheduler(**changes):
    return Recruitment(GROUPS, LIMIT, period=PERIOD, **{"dwell": 0.5, **changes})


def following(model, **shares):
    """Sliding control of a rig."""
    return RigController(model, model.law("sliding", period=PERIOD), **shares)


def demand(k, torque, angle=ANGLE, supply=13.8e5):
    return Demand(k * PERIOD, 0.0, torque, angle, (0.0,) * 3, (supply,) * 3)


def play(share, torques, angle=ANGLE, supply=13.8e5):
    """Pressures and numbers of active groups over a series of torques."""
    pressures, active = [], []
    for k, torque in enumerate(torques):
        pressures.append(share.pressures(demand(k, float(torque), angle, supply)))
        active.append(share.active)
    return np.array(pressures), np.array(active)


def given(pressures, angle=ANGLE):
    """Torque of groups that pull, or bow out without pulling [N m]."""
    total = 0.0
    for column, group in zip(np.asarray(pressures).T, GROUPS, strict=True):
        c1, c2 = group.at(angle)
        total = total + np.maximum(c1 * column + c2, 0.0)
    return total


def capacity(count, angle=ANGLE, pressure=13.8e5):
    c1, c2 = GROUPS[0].at(angle)
    return count * (c1 * pressure + c2)


def test_the_torque_is_kept_while_groups_come_and_go():
    """Whatever their number and however far they are on their way."""
    half = np.linspace(0.15, 0.75, 2000) * capacity(3)
    torques = np.concatenate([half, half[::-1]])
    pressures, active = play(scheduler(ramp=0.8), torques)
    assert set(active.tolist()) == {1.0, 2.0, 3.0}
    np.testing.assert_allclose(given(pressures), torques, rtol=1e-9)
    # and no pressure jumps: the fastest is a group that is filled along the ramp
    fastest = LIMIT * PERIOD / (0.3 * 0.8)
    assert np.abs(np.diff(pressures, axis=0)).max() < fastest


def test_as_few_as_the_torque_needs():
    for count in (1, 2, 3):
        share = scheduler()
        torque = (count - 0.3) * capacity(1, pressure=0.9 * (13.8e5 - 1e5))
        pressures, active = play(share, np.full(600, torque))
        assert active[-1] == count
        assert np.count_nonzero(pressures[-1] > 1e5) == count
        assert share.vented == tuple(k >= count for k in range(3))
        assert (pressures[-1][count:] == 0.0).all()


def test_what_swings_within_the_thresholds_changes_nothing():
    """About the torque at which a group is added, by less than the thresholds are apart: once."""
    top = capacity(1, pressure=0.9 * (13.8e5 - 1e5))
    swing = top * (1.0 + 0.08 * np.sin(2.0 * np.pi * 2.0 * np.arange(4000) * PERIOD))
    _, active = play(scheduler(horizon=0.0), swing)
    assert active[0] == 1.0
    assert active[-1] == 2.0
    assert np.count_nonzero(np.diff(active)) == 1
    # with the thresholds together and no dwell the same torque makes it chatter
    _, nervous = play(scheduler(horizon=0.0, drop_at=0.899, dwell=0.0, ramp=0.05), swing)
    assert np.count_nonzero(np.diff(nervous)) > 20


def test_a_short_calm_drops_nothing():
    high, low = 1.5 * capacity(1), 0.3 * capacity(1)
    torques = np.r_[np.full(400, high), np.full(80, low), np.full(400, high), np.full(800, low)]
    _, active = play(scheduler(horizon=0.0), torques)
    assert (active[399:880] == active[399]).all()  # 0.4 s of calm, of the 0.5 that it takes
    assert active[-1] == 1.0


def test_a_rising_torque_is_met_before_it_is_there():
    torques = np.linspace(0.2, 0.85, 1000) * capacity(1)
    when = []
    for horizon in (0.0, 0.5):
        _, active = play(scheduler(horizon=horizon), torques)
        when.append(int(np.argmax(active > 1.5)))
    assert when[1] < when[0] - 50
    assert when[0] > 0


def test_told_how_far_it_lifts_it_recruits_at_the_bottom():
    """The weight that is felt at 20 deg asks for three pairs at 90, and for one where it is."""
    weight = 2.4 * capacity(1, math.radians(90.0)) * 0.85
    torques = np.full(400, weight * math.sin(math.radians(20.0)))
    told, by_rates = (
        play(scheduler(reach=reach), torques, math.radians(20.0))[1][-1]
        for reach in (math.radians(90.0), None)
    )
    assert (told, by_rates) == (3.0, 1.0)


def test_a_supply_that_runs_low_is_filled_from_slowly():
    torque = 1.2 * capacity(1, pressure=12e5)
    rates = []
    for supply in (13.8e5, 6e5):
        share, shares = scheduler(reserve=5e5, ramp=0.5), []
        for k in range(500):
            share.pressures(demand(k, torque, supply=supply))
            shares.append(share.shares[1])
        rates.append(np.diff(shares).max())
    assert rates[1] < 0.5 * rates[0]
    assert rates[0] == pytest.approx(PERIOD / 0.5)


def test_lifts_take_less_air_than_with_a_fixed_number_that_can():
    """One cycle without a payload and one with 36 kg, which a single pair cannot lift."""
    payloads, volume = (0.0, 36.0), 0.015
    fixed = {k: follow(RIG, payloads, fixed=k) for k in (1, 2)}
    lift = follow(RIG, payloads, scheduler={"reach": math.radians(90.0)})
    assert max(fixed[1].per_cycle) > 3.0  # it does not follow
    assert max(fixed[2].per_cycle) < 2.5
    assert max(lift.per_cycle) < 1.6
    assert lift.changes == 1
    assert lift.work == pytest.approx(fixed[2].work, rel=0.01)
    assert lift.energy(volume) < 0.93 * fixed[2].energy(volume)
    assert set(lift.active.tolist()) == {1.0, 2.0}


def test_a_group_that_is_not_used_takes_no_air_from_the_supply():
    """It is drawn out by the others: held at zero by its loop it would be fed."""
    light = RIG.with_parameters({"arm.payload": 5.0})
    model = RigModel(light)
    up = cosine_cycles(*degrees(15, 80), rise=2.0, hold=1.0, cycles=1)
    share = Recruitment(model.torques_of("shoulder"), LIMIT, period=PERIOD)
    run = closed_loop(light, following(model, shares=share), up)
    assert (run.command["valve_command.pair_3"] == 0.0).all()
    one = closed_loop(light, following(RigModel(light, active=["pair_1"])), up)
    took, alone = (each.channels["mass_supplied"][-1] for each in (run, one))
    assert took == pytest.approx(alone, rel=0.01)


def lifts_from_a_small_tank(pressure, active=None, **changes):
    """Five lifts of 12 kg that draw a tank of 6 l down: error [deg], and by how much the tank is
    above the fullest muscles [Pa], of each; the most pairs that have air.
    """
    lifts, count = cosine_cycles(*degrees(15, 60), rise=1.5, hold=1.0, cycles=5), 5
    tank = {"supply.volume": 0.006, "supply.initial_pressure": pressure}
    rig = RIG.with_parameters({"arm.payload": 12.0, **tank})
    model = RigModel(rig, active=active)
    torques, limit = model.torques_of("shoulder"), model.pressure_limit
    share = None if active else Recruitment(torques, limit, period=PERIOD, **changes)
    run = closed_loop(rig, following(model, shares=share), lifts)
    muscles = np.array([run.channels[f"muscle_pressure.pair_{k}"] for k in (1, 2, 3)])
    above = run.channels["supply_pressure"] - muscles.max(axis=0)
    ends = np.linspace(0.0, lifts.duration, count + 1)
    rows = [(run.time >= a) & (run.time < b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    error = np.degrees(run.error)
    rms = [float(np.sqrt(np.mean(error[own] ** 2))) for own in rows]
    pairs = [int((muscles[:, own] > 3e4).sum(axis=0).max()) for own in rows]
    return rms, [float(above[own].min()) for own in rows], pairs


def test_a_tank_that_runs_empty_is_not_starved():
    """In the loop: one pair by itself needs more than is left and falls behind. The scheduler takes
    more pairs at less pressure in time, so that the tank stays above the muscles by the reserve,
    while they are filled too, and the lifts go on.
    """
    rms, above, pairs = lifts_from_a_small_tank(6e5, active=["pair_1"])
    assert rms[0] < 0.4
    assert rms[-1] > 2.0
    assert above[-1] < 5e3
    assert pairs == [1] * 5
    rms, above, pairs = lifts_from_a_small_tank(6e5, reserve=5e4)
    assert max(rms) < 0.4
    assert min(above) > 5e4
    assert pairs[-1] == 3
    assert pairs == sorted(pairs)
    # with more in reserve pairs come earlier, and the tank is further above them where it can be
    _, early, sooner = lifts_from_a_small_tank(6e5, reserve=1.5e5)
    assert early[0] > above[0]
    assert all(a >= b for a, b in zip(sooner, pairs, strict=True))


def test_what_cannot_be_recruited_is_named():
    pair = RigModel(pamrs.rigs.named("antagonistic_joint"))
    refused(
        ("drop_at = 0.6", lambda: scheduler(add_at=0.5, drop_at=0.6)),
        ("least = 0", lambda: scheduler(least=0)),
        ("from 1 to 3", lambda: scheduler(least=4)),
        ("ramp", lambda: scheduler(ramp=0.0)),
        ("dwell", lambda: scheduler(dwell=-1.0)),
        ("reach", lambda: scheduler(reach=4.0)),
        ("one side", lambda: Recruitment(pair.torques_of("elbow"), LIMIT, period=PERIOD)),
        ("3 groups; the joint has 2", lambda: following(pair, shares=scheduler())),
    )
