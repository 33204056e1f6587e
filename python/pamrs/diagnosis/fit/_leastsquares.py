"""Bounded least squares by Levenberg and Marquardt on the normal equations.

The residuals of a diagnosis are tens of thousands of rows of a dozen parameters, one evaluation
gives rows and sensitivities together, and a gain that the noise could have made is worth no further
evaluation. SciPy's `least_squares` decomposes the tall matrix at every step, evaluates rows and
sensitivities apart, and its tolerances are relative: it took four times as long to the same end
(docs/decisions/0014).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from pamrs._arrays import Array
from pamrs.errors import SimulationError

# [chi-square] predicted gain of a step below which a fit ends: noise makes as much (decision 14)
_STEP_GAIN = 0.2
_STEP_SHARE = 2e-3  # the same in a first fit, as a share of the sum of squares (decision 14)
# evaluations that gain less than a step: as many as damping takes (decision 57)
_STALL_EVALUATIONS = 5
_MOST_DAMPING = 1e8  # damping at which they give up


T = TypeVar("T")


def levenberg_marquardt(
    evaluate: Callable[[Array], tuple[Array, Array, T]],
    start: Array,
    bounds: tuple[Array, Array],
    evaluations: int,
    share: float | None = None,
) -> tuple[Array, tuple[Array, Array, T], int]:
    """Minimise half the sum of squares inside a box.

    Parameters
    ----------
    evaluate : callable
        Rows (n,), their sensitivities (n, k) and whatever else is wanted of the best point. A
        `SimulationError` after the first evaluation is a step that is taken back.
    start : (k,) array
        Where to begin; moved into the box.
    bounds : (k,) arrays
        The box.
    evaluations : int
        Limit, the first included.
    share : float, optional
        Another share; 0 where the last few units of chi-square count.

    Returns
    -------
    x : (k,) array
        The best point.
    best : tuple
        What ``evaluate`` gave there.
    spent : int
        Evaluations.

    Raises
    ------
    SimulationError
        If the start cannot be evaluated.

    References
    ----------
    Marquardt (1963); active bounds as in Kanzow, Yamashita & Fukushima (2004).
    """
    low, high = bounds

    def evaluated(x: Array) -> tuple[tuple[Array, Array, T], Array, Array]:
        """Evaluate a point and form its normal equations."""
        evaluation = evaluate(x)
        rows, jacobian, _ = evaluation
        # squares that overflow, or will, are outside the range as much as what is no number
        with np.errstate(over="ignore", invalid="ignore"):
            gradient, normal = jacobian.T @ rows, jacobian.T @ jacobian
            known = float(np.trace(normal) + rows @ rows) < 1e200
        if not known:
            raise SimulationError("the model's sensitivities are too large to be fitted")
        return evaluation, gradient, normal

    least = _STEP_SHARE if share is None else share
    x = np.clip(start, low, high)
    best, gradient, normal = evaluated(x)
    spent, damping = 1, 1e-4  # to begin with (Marquardt (1963))
    reached = [float(best[0] @ best[0])]  # by each evaluation
    while x.size and spent < evaluations:
        rows = best[0]
        worth = max(_STEP_GAIN, least * float(rows @ rows))
        hard = damping
        step = _step(x, gradient, normal, hard, low, high)
        # a long step that the walls bend may lead uphill: a shorter one meets fewer of them
        while (
            gain := -2.0 * float(gradient @ step) - float(step @ normal @ step)
        ) < worth and hard < _MOST_DAMPING:
            hard = 10.0 * hard
            step = _step(x, gradient, normal, hard, low, high)
        late = reached[-1 - _STALL_EVALUATIONS :]
        if gain < worth or (len(late) > _STALL_EVALUATIONS and late[0] - late[-1] < worth):
            break
        candidate = np.clip(x + step, low, high)
        spent += 1
        try:
            evaluation, *equations = evaluated(candidate)
        except SimulationError:
            damping = max(10.0 * hard, 1e-2)
            continue
        reached.append(reached[-1])
        gained = float(rows @ rows - evaluation[0] @ evaluation[0])
        if gained > 0.0:
            x, best, reached[-1] = candidate, evaluation, reached[-1] - gained
            gradient, normal = equations
            damping = (
                damping * 0.1
                if gained > 0.5 * gain
                else damping * (2.0 if gained < 0.1 * gain else 1.0)
            )
            damping = max(damping, 1e-9)
        else:
            damping = max(10.0 * hard, 1e-2)
            if damping > _MOST_DAMPING:
                break
    return x, best, spent


def _step(
    x: Array, gradient: Array, normal: Array, damping: float, low: Array, high: Array
) -> Array:
    """Damped step of the free parameters; those that would leave the box go to its wall, and the
    others are solved again.
    """
    step = np.zeros_like(x)
    free = ~(((x <= low) & (gradient > 0.0)) | ((x >= high) & (gradient < 0.0)))
    scale = np.diag(normal).copy()
    scale[scale <= 0.0] = 1.0
    for _ in range(x.size):
        if not free.any():
            break
        inner = normal[np.ix_(free, free)] + np.diag(damping * scale[free])
        right = -(gradient[free] + normal[np.ix_(free, ~free)] @ step[~free])
        step[free] = np.linalg.lstsq(inner, right, rcond=1e-12)[0]
        out = free & ((x + step < low) | (x + step > high))
        if not out.any():
            break
        step[out] = np.where(x[out] + step[out] < low[out], low[out], high[out]) - x[out]
        free &= ~out
    return step
