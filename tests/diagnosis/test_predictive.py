"""Weights by prediction: densities against another computation, and laws of the bootstrap."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from pamrs.diagnosis.evidence._predictive import _autoregression, _stretches, bootstrapped
from pamrs.diagnosis.settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def autoregressive(count: int, share: float, size: float, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = np.zeros(count)
    for k in range(1, count):
        z[k] = share * z[k - 1] + size * rng.normal()
    return z


def test_an_autoregression_is_found_again() -> None:
    weights, variance = _autoregression([autoregressive(20_000, 0.8, 3.0)], 2)
    assert weights == pytest.approx([0.8, 0.0], abs=0.02)
    assert variance == pytest.approx(9.0, rel=0.03)


def test_no_hypothesis_predicts_better_than_the_noise_lets_it() -> None:
    """A noise level that was estimated too high makes nothing more probable."""
    assert _autoregression([autoregressive(5000, 0.0, 0.4)], 2)[1] == 1.0
    assert _autoregression([np.full(3, 0.1)], 4)[1] == 1.0
    assert _autoregression([], 4)[1] == 1.0


def test_densities_are_those_of_each_sample_after_those_before_it() -> None:
    z = autoregressive(40, 0.5, 1.5)
    z[[7, 20]] = np.nan
    weights, variance = np.array([0.4, 0.1]), 2.0
    expected = [
        norm.logpdf(z[k], weights[0] * z[k - 1] + weights[1] * z[k - 2], np.sqrt(variance))
        for k in range(2, 40)
        if np.isfinite(z[k - 2 : k + 1]).all()
    ]
    found = _stretches(z, weights, variance, 5.0)
    assert len(found) == -(-len(expected) // 5)
    assert found == pytest.approx([sum(expected[i : i + 5]) for i in range(0, len(expected), 5)])


@given(st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=6), st.integers(1, 30))
def test_without_a_difference_the_priors_decide(priors: list[float], count: int) -> None:
    found = bootstrapped(np.zeros((len(priors), count)), np.array(priors))
    whole = np.exp(priors) / np.exp(priors).sum()
    assert found == pytest.approx(whole, abs=1e-9)


@given(st.floats(-1e3, 1e3))
def test_only_differences_count(shift: float) -> None:
    scores = np.random.default_rng(1).normal(size=(3, 12))
    plain = bootstrapped(scores, np.zeros(3))
    assert bootstrapped(scores + shift, np.zeros(3)) == pytest.approx(plain, abs=1e-6)
    assert plain.sum() == pytest.approx(1.0)


def test_a_lead_in_every_stretch_counts_more_than_as_large_a_lead_in_one() -> None:
    everywhere, once = np.zeros((2, 20)), np.zeros((2, 20))
    everywhere[0] = 0.4
    once[0, 5] = 8.0
    sure, open_ = (bootstrapped(s, np.zeros(2))[0] for s in (everywhere, once))
    assert sure > 0.999
    assert 0.6 < open_ < 0.98
