"""Covariance of a fit: with independent residuals, and by leaving out one level at a time."""

from __future__ import annotations

import numpy as np

from pamrs._arrays import Array, Index
from pamrs.fit._estimate import Estimate, Problem

_FEWEST_LEVELS = 5


def levels_needed(unknowns: int) -> int:
    """Fitted levels that the jackknife needs: fewer than the unknowns would leave combinations of
    them without any spread.
    """
    return max(_FEWEST_LEVELS, unknowns + 1)


def covariances(problem: Problem, result: Estimate, level: Index) -> tuple[Array, Array | None]:
    """Plain and level-robust covariance of coefficients and geometry.

    Parameters
    ----------
    problem : Problem
        Data and unknowns.
    result : Estimate
        The fit.
    level : (n,) int array
        Level of each fitted row.

    Returns
    -------
    plain : (p, p) array
        ``sigma^2 (J'J + sigma^2 D)^-1`` with the priors' information ``D``: residuals taken as
        independent.
    robust : (p, p) array or None
        Delete-one-level jackknife (CR3) of the linearised fit plus the priors' own share: it holds
        when the residuals of one level hang together. None with fewer than 5 levels or no more
        levels than parameters, or when a level cannot be spared.
    """
    p = result.jacobian.shape[1]
    prior = problem.information(result.design)
    jacobian = result.jacobian / result.sigma if result.sigma > 0.0 else result.jacobian
    if p == 0:
        return np.empty((0, 0)), np.empty((0, 0))
    scale = np.sqrt((jacobian**2).sum(axis=0) + prior**2)
    jacobian, prior = jacobian / scale, prior / scale
    stacked = np.vstack([jacobian, np.diag(prior)])
    _, s, vt = np.linalg.svd(stacked, full_matrices=False)
    root = vt.T / s
    inverse = root @ root.T
    plain = inverse / np.outer(scale, scale)
    if result.sigma == 0.0:
        return plain * 0.0, None
    groups = np.unique(level)
    if len(groups) < levels_needed(p):
        return plain, None
    residual = result.residual / result.sigma
    moves = []
    for group in groups:
        # In the basis of the singular vectors the information matrix is 1; taking a level away
        # leaves 1 - B'B.
        rows = jacobian[level == group] @ root
        left = np.eye(p) - rows.T @ rows
        if np.linalg.eigvalsh(left)[0] < 1e-9:
            return plain, None
        moves.append(root @ np.linalg.solve(left, rows.T @ residual[level == group]))
    spread = np.array(moves).T
    robust = (1.0 - 1.0 / len(groups)) * spread @ spread.T + inverse @ np.diag(prior**2) @ inverse
    return plain, robust / np.outer(scale, scale)
