"""Noise levels with the noise of the drives, excess of residuals over them, autocorrelation.

Public: `NoiseLevel`, `noise_levels`, `Excess`, `excess`, `bins_of`, `means_in_noises`,
`curve_errors_of`, `whitening`, `error_sizes`, `with_sizes`, `correlation_time`, `usual_inflation`,
`inflation_apart`, `inflation_of`, `no_inflation`.
"""

from __future__ import annotations

from pamrs.diagnosis.noise._autocorrelation import (
    CORRELATED_VARIANCE,
    correlation_time,
    inflation_apart,
    usual_inflation,
)
from pamrs.diagnosis.noise._discrepancy import curve_errors_of, whitening
from pamrs.diagnosis.noise._levels import (
    LEAST_SIZE,
    SIZE_SPREAD,
    Excess,
    NoiseLevel,
    bins_of,
    error_sizes,
    excess,
    inflation_of,
    means_in_noises,
    no_inflation,
    noise_levels,
    with_sizes,
)

__all__ = [
    "CORRELATED_VARIANCE",
    "LEAST_SIZE",
    "SIZE_SPREAD",
    "Excess",
    "NoiseLevel",
    "inflation_apart",
    "inflation_of",
    "bins_of",
    "correlation_time",
    "error_sizes",
    "excess",
    "usual_inflation",
    "means_in_noises",
    "no_inflation",
    "curve_errors_of",
    "noise_levels",
    "whitening",
    "with_sizes",
]
