"""Trajectories: printed numbers, and rate and acceleration as the derivatives of the angle."""

import math
import pickle

import numpy as np
import pytest

from pamrs.control import trajectories as tr
from tests.simulation.refusals import refused

DEG = math.pi / 180.0


def every():
    table_time = np.linspace(0.0, 4.0, 41)
    return {
        "lift": tr.lift_hold_return(15 * DEG, 60 * DEG),
        "step": tr.step(0.3, 0.8, at=1.0),
        "cycles": tr.cosine_cycles(15 * DEG, 90 * DEG),
        "table": tr.from_samples(table_time, np.sin(table_time)),
    }


CORNERS = {
    "lift": (0.0, 5.0, 10.0, 15.0),
    "step": (1.0,),
    "cycles": tuple(k * 11.0 + s for k in range(16) for s in (0.0, 6.0)),
    "table": (0.0, 4.0),
}


@pytest.mark.parametrize("name", every())
def test_rate_and_acceleration_are_the_derivatives_between_corners(name):
    trajectory = every()[name]
    time = np.random.default_rng(0).uniform(0.0, trajectory.duration, 400)
    h = 1e-5
    time = time[[min(abs(t - c) for c in CORNERS[name]) > 1e-3 for t in time]]
    here, before, after = (trajectory(time + s) for s in (0.0, -h, h))
    assert here.rate == pytest.approx((after.angle - before.angle) / (2 * h), abs=1e-8)
    assert here.acceleration == pytest.approx((after.rate - before.rate) / (2 * h), abs=1e-7)


@pytest.mark.parametrize("name", every())
def test_one_time_and_many_give_the_same_and_survive_a_pickle(name):
    trajectory = every()[name]
    copied = pickle.loads(pickle.dumps(trajectory))
    time = np.concatenate([np.linspace(-1.0, trajectory.duration + 1.0, 331), CORNERS[name]])
    many = copied(time)
    for k, t in enumerate(time):
        one = trajectory(float(t))
        assert [type(v) for v in one] == [float] * 3
        assert one == pytest.approx([v[k] for v in many], abs=1e-12)


def test_lift_hold_return_is_the_printed_one():
    trajectory = tr.lift_hold_return(*tr.degrees(15, 60))
    angle = trajectory(np.array([0.0, 2.5, 5.0, 9.9, 12.5, 15.0, 24.0])).angle / DEG
    assert angle == pytest.approx([15.0, 37.5, 60.0, 60.0, 37.5, 15.0, 15.0])
    names, ends = ("lift", "hold", "return", "rest"), (0.0, 5.0, 10.0, 15.0, 25.0)
    parts = zip(ends[:-1], ends[1:], strict=True)
    assert trajectory.phases == dict(zip(names, parts, strict=True))
    # at a corner the rate is that of what follows
    assert trajectory(0.0).rate == pytest.approx(9 * DEG)
    assert trajectory(5.0).rate == 0.0
    assert trajectory(10.0).rate == pytest.approx(-9 * DEG)
    time, reference = trajectory.sampled(0.001)
    assert time.size == 25001
    assert not reference.acceleration.any()


def test_cosine_cycles_rise_hold_and_return_eight_times():
    trajectory = tr.cosine_cycles(15 * DEG, 50 * DEG)
    assert trajectory.duration == 8 * 22.0
    for k in (0, 3, 7):
        angle = trajectory(22.0 * k + np.array([0.0, 3.0, 6.0, 11.0, 14.0, 17.0, 21.9])).angle / DEG
        assert angle == pytest.approx([15.0, 32.5, 50.0, 50.0, 32.5, 15.0, 15.0])
    time = np.linspace(0.0, 22.0, 22001)
    assert np.abs(np.diff(trajectory(time).rate)).max() < 1e-3  # the rate has no jump


def test_a_table_with_noise_is_smoothed():
    rng = np.random.default_rng(3)
    time = np.linspace(0.0, 6.0, 301)
    noisy = np.sin(time) + rng.normal(0.0, 0.01, time.size)
    smooth, through = tr.from_samples(time, noisy, smoothing=None), tr.from_samples(time, noisy)
    inner = time[20:-20]
    assert through(time).angle == pytest.approx(noisy, abs=1e-12)
    error = [np.std(t(inner).rate - np.cos(inner)) for t in (smooth, through)]
    assert error[0] < 0.03
    assert error[1] > 10 * error[0]
    # its own clock
    assert tr.from_samples(time + 100.0, noisy)(1.0) == pytest.approx(through(1.0), abs=1e-9)


def test_bad_input_is_named():
    refused(
        ("high", lambda: tr.lift_hold_return(0.2, math.nan)),
        ("ramp", lambda: tr.lift_hold_return(0.2, 1.0, ramp=0.0)),
        ("duration", lambda: tr.lift_hold_return(0.2, 1.0, duration=14.0)),
        ("at = 9", lambda: tr.step(0.0, 1.0, at=9.0)),
        ("cycles", lambda: tr.cosine_cycles(0.2, 1.0, cycles=0)),
        ("3 samples; 5", lambda: tr.from_samples([0, 1, 2], [0, 1, 2])),
        (r"time\[2\]", lambda: tr.from_samples([0, 1, 1, 2, 3], [0, 1, 2, 3, 4])),
        ("smoothing", lambda: tr.from_samples(range(5), range(5), smoothing=-1.0)),
        ("time", lambda: tr.step(0.0, 1.0)(math.nan)),
        ("sample_time", lambda: tr.step(0.0, 1.0).sampled(0.0)),
    )
