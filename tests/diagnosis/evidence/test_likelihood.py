"""The likelihood by which hypotheses are weighed, against dense algebra, and its laws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from pamrs.diagnosis.evidence._likelihood import _Covariance
from tests.diagnosis.likelihoods import BINS, TIMES, of_ratio


def test_it_is_that_of_noise_curves_and_an_error_that_forgets_itself() -> None:
    """Two recordings with gaps; the curves are the same in both."""
    rng = np.random.default_rng(2)
    times = [np.sort(rng.choice(60, n, replace=False)) * 0.1 for n in (17, 1, 30)]
    curves = [rng.normal(size=(t.size, 3)) for t in times]
    curves[1] = np.empty((1, 0))  # no error acts in one of them
    rows = [3.0 * rng.normal(size=t.size) for t in times]
    found = _Covariance(times, curves).likelihood(rows)
    bent = np.vstack([curves[0], np.zeros((1, 3)), curves[2]])
    place = np.concatenate([t + 1e6 * k for k, t in enumerate(times)])
    y = np.concatenate(rows)
    for size, told in zip(found.sizes[:161:7], found.by_size[:161:7], strict=True):
        error = np.exp(-np.abs(place[:, None] - place[None, :]))
        covariance = np.eye(y.size) + bent @ bent.T + size**2 * error
        dense = multivariate_normal(np.zeros(y.size), covariance, allow_singular=True).logpdf(y)
        assert told - 0.5 * y.size * np.log(2.0 * np.pi) == pytest.approx(dense, rel=5e-3)
    assert found.power == pytest.approx(np.mean(y**2))
    assert found.count == y.size


def test_the_size_that_made_the_rows_is_the_most_probable() -> None:
    for size in (0.5, 1.0, 2.3, 14.0, 300.0):
        found = of_ratio(1.0 + size**2)
        assert found.sizes[np.argmax(found.by_size)] == pytest.approx(size, rel=0.2)


def test_less_left_is_more_probable() -> None:
    told = [of_ratio(ratio).log_density for ratio in (1.0, 1.1, 2.0, 10.0, 1e4, 1e8)]
    assert told == sorted(told, reverse=True)


def test_what_is_expected_of_rows_with_an_error_is_about_what_they_have() -> None:
    for size in (1.0, 30.0):
        found = of_ratio(1.0 + size**2)
        assert found.expected(size) == pytest.approx(found.log_density, rel=0.05)
    assert of_ratio(1.0).expected(0.0) == -0.5 * BINS


def test_rows_that_nothing_is_known_of_say_nothing() -> None:
    found = _Covariance([], []).likelihood([])
    assert (found.log_density, found.count, found.power) == (0.0, 0, 0.0)


def test_recordings_of_other_lengths_are_not_mixed_up() -> None:
    """The same times, divided otherwise."""
    for parts in ((5, 5), (3, 7), (10,)):
        times = np.split(0.1 * np.arange(10.0), np.cumsum(parts)[:-1])
        found = _Covariance(times, [np.empty((n, 0)) for n in parts])
        assert found.likelihood([np.ones(n) for n in parts]).count == 10


def test_what_is_not_finite_is_never_probable() -> None:
    rows = np.ones(BINS)
    rows[3] = np.nan
    assert _Covariance([TIMES], [np.empty((BINS, 0))]).likelihood([rows]).log_density == -np.inf
