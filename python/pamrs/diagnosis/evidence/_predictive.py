"""Weights of hypotheses by how probable each made what was recorded, stretch by stretch of time.

Residuals are correlated in time, and no model is quite true: of each hypothesis and block an
autoregression is fitted to what it leaves of the recordings that were fitted, its innovations at
least as large as the noise; the logarithms of its density, summed over stretches that are longer
than that correlation, are drawn anew by a Bayesian bootstrap, so that a lead that rests on a few
stretches counts for little: pseudo-BMA+ of Yao, Vehtari, Simpson & Gelman (Bayesian Analysis 13,
2018).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Key
from pamrs.diagnosis.noise import NoiseLevel, bins_of
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned

# order of the autoregression of what a hypothesis leaves (decision 14: 1, 2, 4 and 8 do alike)
_PREDICTIVE_ORDER = 4
# [s] stretches drawn, longer than a joint's start; 3 and 6 s do alike (decision 14)
_PREDICTIVE_STRETCH = 3.0
_PREDICTIVE_DRAWS = 1000  # draws of the bootstrap (a share is then known to 2 %)
_PREDICTIVE_SEED = 0  # seed of the bootstrap (any)


Array = NDArray[np.float64]
Densities = Mapping[str, Array]
"""Logarithm of the density of each stretch of time, by block."""


def log_densities(
    blocks: list[Block],
    fitted: tuple[list[Prepared], Mapping[Key, Residual]],
    held_out: tuple[list[Prepared], Mapping[Key, Residual]],
    noise_level: Mapping[Key, NoiseLevel],
) -> Densities:
    """Logarithms of the density of what a hypothesis leaves, by block and stretch of time.

    Parameters
    ----------
    blocks : list of Block
        Blocks of the cut chain.
    fitted, held_out : (list of Prepared, dict of Residual)
        Recordings with what it leaves of them. Where nothing was held out, what it leaves of each
        recording as the others predict it is ``held_out``, and counts alone.
    noise_level : dict of NoiseLevel
        By block and recording.
    """
    same = held_out[0] is fitted[0]
    found = {}
    for block in blocks:
        inside, outside = (
            [
                _standardised(block, prepared, left, noise_level)
                for prepared in recordings
                if (block.name, prepared.recording.name) in left
            ]
            for recordings, left in (fitted, held_out)
        )
        weights, variance = _autoregression([z for z, _ in inside], _PREDICTIVE_ORDER)
        judged = outside if same else [*outside, *inside]
        found[block.name] = np.array(
            [
                density
                for z, dt in judged
                for density in _stretches(z, weights, variance, _PREDICTIVE_STRETCH / dt)
            ]
        )
    return found


def _standardised(
    block: Block,
    prepared: Prepared,
    left: Mapping[Key, Residual],
    noise_level: Mapping[Key, NoiseLevel],
) -> tuple[Array, float]:
    """Bin means (n,) in units of their noise, nan where nothing is usable; their spacing [s]."""
    key, width = (block.name, prepared.recording.name), bins_of(prepared)
    means, counts = binned(left[key].value, left[key].rows, width)
    return np.where(counts > 0, means / noise_level[key].binned, np.nan), width * prepared.dt


def _lagged(z: Array, order: int) -> tuple[Array, Array]:
    """Values (n,) and those before each of them (n, order), newest first; where all are known."""
    if z.size <= order:
        return np.empty(0), np.empty((0, order))
    before = np.lib.stride_tricks.sliding_window_view(z[:-1], order)[:, ::-1]
    known = np.isfinite(z[order:]) & np.isfinite(before).all(axis=1)
    return z[order:][known], before[known]


def _autoregression(series: list[Array], order: int) -> tuple[Array, float]:
    """Weights (order,) of the values before, and the variance of what they do not predict: at least
    that of the noise.
    """
    pairs = [_lagged(z, order) for z in series]
    values = np.concatenate([v for v, _ in pairs]) if pairs else np.empty(0)
    before = np.concatenate([b for _, b in pairs]) if pairs else np.empty((0, order))
    if values.size < 3 * (order + 1):
        return np.zeros(order), max(1.0, float(np.mean(values**2))) if values.size else 1.0
    weights = np.linalg.lstsq(before, values, rcond=None)[0]
    return weights, max(1.0, float(np.mean((values - before @ weights) ** 2)))


def _stretches(z: Array, weights: Array, variance: float, bins: float) -> list[float]:
    """Logarithm of the density of each stretch of so many bins."""
    values, before = _lagged(z, weights.size)
    each = -0.5 * (np.log(2.0 * np.pi * variance) + (values - before @ weights) ** 2 / variance)
    length = max(1, round(bins))
    return [float(each[first : first + length].sum()) for first in range(0, each.size, length)]


def bootstrapped(scores: Array, priors: Array) -> Array:
    """Weights (k,) of hypotheses, which add up to one.

    Parameters
    ----------
    scores : (k, n) array
        Logarithm of the density of each of n stretches under each of k hypotheses.
    priors : (k,) array
        Logarithm of what each weighs before any stretch.
    """
    count = scores.shape[1]
    rng = np.random.default_rng(_PREDICTIVE_SEED)
    drawn = count * rng.dirichlet(np.ones(count), _PREDICTIVE_DRAWS)
    total = drawn @ scores.T + priors
    weights = np.exp(total - total.max(axis=1, keepdims=True))
    shares: Array = (weights / weights.sum(axis=1, keepdims=True)).mean(axis=0)
    return shares
