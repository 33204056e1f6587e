"""When a residual is more than noise: noise levels with the noise of the drives, excess over them,
autocorrelation.

Public: `NoiseLevel`, `noise_levels`, `Excess`, `excess`, `bins_of`, `correlation_time`,
`inflation`.
"""

from __future__ import annotations

from pamrs.diagnosis.noise._autocorrelation import CORRELATED_VARIANCE, correlation_time, inflation
from pamrs.diagnosis.noise._levels import Excess, NoiseLevel, bins_of, excess, noise_levels

__all__ = [
    "CORRELATED_VARIANCE",
    "Excess",
    "NoiseLevel",
    "bins_of",
    "correlation_time",
    "excess",
    "inflation",
    "noise_levels",
]
