"""Autocorrelation time of residuals, and the inflation by which fits take them less seriously."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Key, bin_width
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned

# variance times autocorrelation time of residuals that weights a fit again (decision 20)
CORRELATED_VARIANCE = 2.0
# times that of the usual recording from which one counts by its own: it took the weight of all
_APART = 100.0


Array = NDArray[np.float64]


def correlation_time(values: Array) -> float:
    """Integrated autocorrelation time of a series in samples (at least 1), by the first negative
    lag.
    """
    centred = values - values.mean()
    power = float(centred @ centred)
    if values.size < 4 or power <= 0:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * values.size)
    rho = np.fft.irfft(np.abs(spectrum) ** 2)[: values.size // 2] / power
    negative = np.flatnonzero(rho <= 0)
    stop = int(negative[0]) if negative.size else rho.size
    return max(1.0, 1.0 + 2.0 * float(rho[1:stop].sum()))


def inflated(values: Array, rows: NDArray[np.bool_], width: int, noise: float) -> float:
    """Variance of the bin means of a residual (n,) relative to white noise of single samples, times
    their correlation time; 0 where no bin has a sample.
    """
    means, counts = binned(values, rows, width)
    scaled = (means * np.sqrt(counts))[counts > 0] / noise
    return float(np.mean(scaled**2)) * correlation_time(scaled) if scaled.size else 0.0


def _inflations(
    block: Block, recordings: list[Prepared], residuals: dict[Key, Residual], width: float
) -> dict[Key, float]:
    """Inflation (as of `inflated`) of a block in each recording that has a sample of it."""
    widths = {(block.name, p.recording.name): bin_width(p, width) for p in recordings}
    values = {
        key: inflated(residuals[key].value, residuals[key].rows, count, residuals[key].noise)
        for key, count in widths.items()
    }
    return {key: value for key, value in values.items() if value > 0.0}


def _most(values: dict[Key, float]) -> float:
    """Largest inflation that counts as usual: 100 times the lower median, or 100; 0 of none."""
    ordered = sorted(values.values())
    return _APART * max(1.0, ordered[(len(ordered) - 1) // 2]) if ordered else 0.0


def usual_inflation(
    block: Block, recordings: list[Prepared], residuals: dict[Key, Residual], width: float
) -> float:
    """Variance of a block's bin means relative to white sample noise, times their correlation time
    (>= 1), without recordings that are far above the others.
    """
    values = _inflations(block, recordings, residuals, width)
    usual = [value for value in values.values() if value <= _most(values)]
    return max(1.0, float(np.mean(usual))) if usual else 1.0


def inflation_apart(
    block: Block, recordings: list[Prepared], residuals: dict[Key, Residual], width: float
) -> dict[Key, float]:
    """Inflation of each recording in which it is far larger than in half of them."""
    values = _inflations(block, recordings, residuals, width)
    return {key: value for key, value in values.items() if value > _most(values)}
