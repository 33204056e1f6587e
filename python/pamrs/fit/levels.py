"""A law over a few pressure levels, where the levels and not the samples are the independent
observations.

Each level brings a mean and its standard error. Levels scatter about a law by more than these
errors tell, because each was measured in a run of its own; that extra scatter is estimated (Paule &
Mandel 1982) and goes into the weights and the standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pamrs._arrays import Array, solve_normal

__all__ = ["LawParameter", "LevelLine", "fit_levels"]


_STEPS: Final = 80  # halvings of the interval in which the extra scatter is sought
_EXACT: Final = 1e-9  # relative: no mean is known better


@dataclass(frozen=True, slots=True)
class LawParameter:
    """One coefficient of a law.

    Attributes
    ----------
    name : str
        Its name.
    value, stderr : float
        Value and standard error; ``stderr`` is NaN where it cannot be known (one level for each
        coefficient).
    unit : str
        SI unit.
    """

    name: str
    value: float
    stderr: float
    unit: str


@dataclass(frozen=True, slots=True)
class LevelLine:
    """Weighted least squares over levels.

    Attributes
    ----------
    values : (k,) array
        Coefficients.
    covar : (k, k) array
        Their covariance, the extra scatter included.
    between : float
        Standard deviation of the levels about the law beyond their own errors; NaN without a spare
        level.
    redchi : float
        Reduced chi-square with the levels' own errors alone: above 1, the law or the errors do not
        suffice.
    """

    values: Array
    covar: Array
    between: float
    redchi: float

    @property
    def stderr(self) -> Array:
        """Standard errors of the coefficients, (k,)."""
        return np.sqrt(np.diag(self.covar))


def fit_levels(design: Array, observed: Array, stderr: Array) -> LevelLine:
    """Fit a linear law to level means.

    Parameters
    ----------
    design : (m, k) array
        One row for each level, one column for each coefficient; ``m >= k`` and of full rank.
    observed, stderr : (m,) array
        Level means and their standard errors.

    Returns
    -------
    LevelLine
    """
    levels, count = design.shape
    scale = np.max(np.abs(design), axis=0)
    columns = design / scale
    least = _EXACT * max(float(np.max(np.abs(observed))), 1e-300)
    own = np.maximum(stderr, least) ** 2

    def solved(extra: float) -> tuple[Array, Array, float]:
        weight = 1.0 / (own + extra)
        covar = solve_normal(columns.T @ (weight[:, None] * columns), np.eye(count))
        values = covar @ (columns.T @ (weight * observed))
        return values, covar, float(np.sum(weight * (observed - columns @ values) ** 2))

    free = levels - count
    values, covar, chisqr = solved(0.0)
    redchi = chisqr / free if free else float("nan")
    between = 0.0 if free else float("nan")
    if free and chisqr > free:
        low, high = (
            0.0,
            float(np.sum((observed - columns @ values) ** 2)) / free + float(np.max(own)),
        )
        while solved(high)[2] > free:
            high *= 4.0
        for _ in range(_STEPS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if solved(middle)[2] > free else (low, middle)
        values, covar, _ = solved(high)
        between = float(np.sqrt(high))
    return LevelLine(values / scale, covar / np.outer(scale, scale), between, redchi)
