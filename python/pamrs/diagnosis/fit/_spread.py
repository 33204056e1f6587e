"""Standard deviations of a fit that hold although its residuals are no white noise."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, t

from pamrs._arrays import Array, Index
from pamrs.diagnosis.fit._fitting import FIT_BIN_TIME, Fit, Key, Problem, bin_width, stacked
from pamrs.diagnosis.prepare import Residual

# [s] independent pieces: longer than wrong residuals stay alike; arm windows are 2.5 s
PIECE_TIME = 5.0


def spread_over_pieces(problem: Problem, fitted: Fit) -> dict[str, float]:
    """Standard deviations of a fit's parameters, by how much the pieces of its recordings disagree.

    A fit weights each residual by its noise, as if the model had no error. What a model leaves is
    alike for seconds, and pulls at the parameters. The variance of these pulls between pieces is
    the sandwich estimate for clusters (Bell & McCaffrey 2002, CR2), widened by Student's t where
    pieces are few; the larger one of it and of the fit's own standard deviation is taken.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    fitted : Fit
        The fit, with the jacobians that it ended with.

    Returns
    -------
    dict of str to float
        By dotted name, SI. The fit's own ones where it has no jacobian of all its parameters.
    """
    rows, slopes = stacked(problem, fitted.residuals, fitted.inflation)
    names = list(fitted.scales)
    if slopes is None or not names or slopes.shape[1] != len(names):
        return dict(fitted.std)
    scales = np.array([fitted.scales[name] for name in names])
    wide = scales * pieces_spread(
        rows, slopes * scales, fitted.covariance, pieces_of(problem, fitted.residuals)
    )
    stated = np.array([fitted.std[name] for name in names])
    return fitted.std | dict(zip(names, np.maximum(stated, wide).tolist(), strict=True))


def pieces_spread(rows: Array, jacobian: Array, covariance: Array, pieces: list[Index]) -> Array:
    """Standard deviations by how much pieces of the residuals pull the parameters apart.

    Parameters
    ----------
    rows : (n,) array
        Stacked residuals, without priors.
    jacobian : (n, k) array
        Their sensitivities to the scaled parameters.
    covariance : (k, k) array
        Of the scaled parameters, by the fit, priors included.
    pieces : list of array
        Rows of each piece.

    Returns
    -------
    (k,) array
        Of the scaled parameters; zero where there are not two pieces.
    """
    if len(pieces) < 2:
        return np.zeros(covariance.shape[0])
    size, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.clip(size, 0.0, None)) @ axes.T
    pulls = np.array([_pull(root, jacobian[at], rows[at]) for at in pieces])
    few = float(t.ppf(0.975, len(pieces) - 1) / norm.ppf(0.975))
    return np.asarray(few * np.sqrt(np.sum(pulls**2, axis=0)), dtype=np.float64)


def _pull(root: Array, jacobian: Array, rows: Array) -> Array:
    """Pull of a piece on the scaled parameters; its residuals, which its own leverage made smaller,
    are scaled up again (CR2).
    """
    share, axes = np.linalg.eigh(root @ (jacobian.T @ jacobian) @ root)
    leverage = np.sqrt(np.maximum(1.0 - share, np.finfo(float).eps ** 0.5))
    return np.asarray(root @ (axes / leverage @ (axes.T @ (root @ (jacobian.T @ rows)))))


def pieces_of(problem: Problem, residuals: dict[Key, Residual]) -> list[Index]:
    """Rows of the stacked residuals in each piece of a recording, all blocks together."""
    count = 0
    pieces: list[Index] = []
    for prepared in problem.recordings:
        width = bin_width(prepared, FIT_BIN_TIME)
        rows_of: dict[int, list[Index]] = {}
        for block in problem.blocks:
            rows = residuals[block.name, prepared.recording.name].rows
            bins = np.arange(rows.size // width)
            at = (bins * width * prepared.dt / PIECE_TIME).astype(int)
            for k in np.unique(at):
                rows_of.setdefault(int(k), []).append(count + np.flatnonzero(at == k))
            count += bins.size
        pieces += [np.concatenate(parts) for parts in rows_of.values()]
    return pieces
