"""Corners of a signal stay corners, noise does not shorten the filter, and hum does not either."""

from __future__ import annotations

import numpy as np
import pytest

from pamrs.diagnosis.prepare._signals import filter_length, lengths_of, smoothed
from tests.diagnosis.asked import SETTINGS

DT = 0.005
TIME = DT * np.arange(4000)
FULL = np.full(TIME.size, filter_length(DT, SETTINGS), dtype=np.intp)


def noisy(values: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    return np.asarray(values + size * np.random.default_rng(seed).standard_normal(values.size))


@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_seldom_shortens_it(seed: int) -> None:
    smooth = 1e5 * np.sin(2.0 * np.pi * 0.5 * TIME)
    lengths = lengths_of(noisy(smooth, 400.0, seed), 400.0, DT, SETTINGS)
    assert set(np.unique(lengths)) <= {1, 7, filter_length(DT, SETTINGS)}
    assert np.mean(lengths < filter_length(DT, SETTINGS)) < 0.01


def test_a_corner_is_followed_and_the_rest_is_smoothed() -> None:
    true = 5e5 - 4e5 * np.exp(-np.mod(TIME, 1.0) / 0.1)  # filled in 0.1 s, emptied at once
    found = noisy(true, 400.0)
    lengths = lengths_of(found, 400.0, DT, SETTINGS)
    near = np.mod(TIME + 0.03, 1.0) < 0.06
    adapted, _ = smoothed(found, DT, lengths)
    fixed, _ = smoothed(found, DT, FULL)
    off = np.abs(adapted - true)
    assert off[near].max() < 0.02 * np.abs(fixed - true)[near].max()
    far = np.mod(TIME - 0.1, 1.0) < 0.8
    assert np.mean(lengths[far] == filter_length(DT, SETTINGS)) > 0.95
    assert np.std((adapted - true)[far]) < 0.6 * 400.0


def test_hum_is_not_a_corner() -> None:
    hum = 4000.0 * np.sin(2.0 * np.pi * 60.0 * TIME)
    lengths = lengths_of(noisy(hum, 400.0), 400.0, DT, SETTINGS)
    assert np.mean(lengths == filter_length(DT, SETTINGS)) > 0.95


def test_each_sample_is_that_of_its_filter() -> None:
    found = noisy(np.cumsum(np.sin(TIME)), 1.0)
    lengths = FULL.copy()
    lengths[100:110], lengths[200] = 7, 1
    value, slope = smoothed(found, DT, lengths)
    whole = smoothed(found, DT, FULL)
    kept = lengths > 7
    np.testing.assert_array_equal(value[kept], whole[0][kept])
    np.testing.assert_array_equal(slope[kept], whole[1][kept])
    assert value[200] == found[200]
    assert slope[200] == pytest.approx((found[201] - found[199]) / (2.0 * DT))
    assert not np.array_equal(value[100:110], whole[0][100:110])
