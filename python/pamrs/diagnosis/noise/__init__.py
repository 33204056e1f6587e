"""When a residual is more than noise: noise levels with the noise of the drives, excess over them, autocorrelation.

Public: `Floor`, `floors` (noise levels), `Excess`, `excess`, `bins_of`, `correlation_time`, `inflation`.
"""

from __future__ import annotations

from pamrs.diagnosis.noise._autocorrelation import correlation_time, inflation
from pamrs.diagnosis.noise._levels import Excess, Floor, bins_of, excess, floors

__all__ = [
    "Excess",
    "Floor",
    "bins_of",
    "correlation_time",
    "excess",
    "floors",
    "inflation",
]
