"""Standard deviations of a fit that hold although its residuals are no white noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, t

from pamrs.diagnosis.fit._fitting import Fit, Problem, bin_width, stacked

__all__ = ["spread_over_pieces"]

Array = NDArray[np.float64]


def spread_over_pieces(problem: Problem, found: Fit) -> dict[str, float]:
    """Standard deviations of a fit's parameters, by how much the pieces of its recordings disagree.

    A fit weights each residual by its noise, as if the model had no error. What a model leaves is
    alike for seconds, and pulls at the parameters. The variance of these pulls between pieces is
    the sandwich estimate for clusters (Bell & McCaffrey 2002, CR2), widened by Student's t where
    pieces are few; the larger one of it and of the fit's own standard deviation is taken.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    found : Fit
        The fit, with the jacobians that it ended with.

    Returns
    -------
    dict of str to float
        By dotted name, SI. The fit's own ones where it has no jacobian of all its parameters.
    """
    rows, slopes = stacked(problem, found.residuals, found.inflation)
    names = list(found.scales)
    if slopes is None or not names or slopes.shape[1] != len(names):
        return dict(found.std)
    scales = np.array([found.scales[name] for name in names])
    jacobian = slopes * scales
    pieces = _pieces(problem, found)
    if len(pieces) < 2:
        return dict(found.std)
    size, axes = np.linalg.eigh(found.covariance)
    root = axes * np.sqrt(np.clip(size, 0.0, None)) @ axes.T
    pulls = np.array([_pull(root, jacobian[at], rows[at]) for at in pieces])
    few = float(t.ppf(0.975, len(pieces) - 1) / norm.ppf(0.975))
    wide = few * np.sqrt(np.sum(pulls**2, axis=0)) * scales
    own = np.array([found.std[name] for name in names])
    return found.std | dict(zip(names, np.maximum(own, wide).tolist(), strict=True))


def _pull(root: Array, jacobian: Array, rows: Array) -> Array:
    """How far a piece pulls the scaled parameters; what it decides itself (its leverage) has made
    its residuals smaller, and is put back.
    """
    share, axes = np.linalg.eigh(root @ (jacobian.T @ jacobian) @ root)
    leverage = np.sqrt(np.maximum(1.0 - share, np.finfo(float).eps ** 0.5))
    pull: Array = root @ (axes / leverage @ (axes.T @ (root @ (jacobian.T @ rows))))
    return pull


def _pieces(problem: Problem, found: Fit) -> list[NDArray[np.intp]]:
    """Rows of the stacked residuals in each piece of a recording, all blocks together."""
    noise = problem.settings.noise
    count = 0
    pieces: list[NDArray[np.intp]] = []
    for prepared in problem.recordings:
        width = bin_width(prepared, noise.fit_bin_time)
        own: dict[int, list[NDArray[np.intp]]] = {}
        for block in problem.blocks:
            rows = found.residuals[block.name, prepared.recording.name].rows
            bins = np.arange(rows.size // width)
            at = (bins * width * prepared.dt / noise.piece_time).astype(int)
            for k in np.unique(at):
                own.setdefault(int(k), []).append(count + np.flatnonzero(at == k))
            count += bins.size
        pieces += [np.concatenate(parts) for parts in own.values()]
    return pieces
