"""How far residuals remember: autocorrelation time, and what it makes of their weight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Key, bin_width
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned

__all__ = ["CORRELATED_VARIANCE", "correlation_time", "inflation"]

# variance times autocorrelation time of residuals that weights a fit again (decision 20)
CORRELATED_VARIANCE = 2.0


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


def inflation(
    block: Block, recordings: list[Prepared], found: dict[Key, Residual], width: float
) -> float:
    """Variance of a block's bin means relative to white sample noise, times their correlation time
    (>= 1).
    """
    values = []
    for prepared in recordings:
        r = found[block.name, prepared.recording.name]
        means, counts = binned(r.value, r.rows, bin_width(prepared, width))
        scaled = (means * np.sqrt(counts))[counts > 0] / r.noise
        if scaled.size:
            values.append(float(np.mean(scaled**2)) * correlation_time(scaled))
    return max(1.0, float(np.mean(values))) if values else 1.0
