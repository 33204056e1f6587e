"""The compound trajectory of chapter 5."""

import math

import numpy as np
import pytest

from reproduction.waves import TABLE_5_1, waves

DEG = math.pi / 180.0


def test_compound_has_the_amplitudes_and_the_triangle_of_5_24():
    trajectory = waves()
    # the triangle begins at its lowest value, zero
    assert trajectory(0.0).angle / DEG == pytest.approx(20 + 13 + 7 + 5 + 50)
    # without the sinusoids, a triangle between 50 and 70 deg of 0.16 Hz
    bare = waves(cosines=())
    time, reference = bare.sampled(0.001, 1.0 / 0.16)
    assert reference.angle.min() / DEG == pytest.approx(50.0)
    assert reference.angle.max() / DEG == pytest.approx(70.0)
    assert reference.angle.mean() / DEG == pytest.approx(60.0, abs=1e-2)
    assert bare(1.0).angle == pytest.approx(bare(1.0 + 3 / 0.16).angle)
    # spectrum: each amplitude of Table 5.1 by least squares over a long record
    time = np.arange(0.0, 2000.0, 0.01)
    rest = (trajectory(time).angle - bare(time).angle) / DEG
    columns = np.stack([np.cos(w * time) for _, w in TABLE_5_1])
    assert np.linalg.lstsq(columns.T, rest, rcond=None)[0] == pytest.approx([20, 13, 7, 5])


def test_rate_and_acceleration_are_the_derivatives_between_corners():
    trajectory, h = waves(), 1e-5
    time = np.random.default_rng(0).uniform(0.0, 100.0, 400)
    time = time[np.abs((time / 3.125 + 0.5) % 1.0 - 0.5) > 1e-3]
    here, before, after = (trajectory(time + s) for s in (0.0, -h, h))
    assert here.rate == pytest.approx((after.angle - before.angle) / (2 * h), abs=1e-8)
    assert here.acceleration == pytest.approx((after.rate - before.rate) / (2 * h), abs=1e-7)


def test_one_time_and_many_give_the_same():
    trajectory, time = waves(), np.linspace(-1.0, 101.0, 331)
    many = trajectory(time)
    for k, t in enumerate(time):
        assert trajectory(float(t)) == pytest.approx([v[k] for v in many], abs=1e-12)
