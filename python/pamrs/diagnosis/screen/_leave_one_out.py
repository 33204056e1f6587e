"""Every recording predicted by a fit to the others, where a case does not say which are held
out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Fit, Key, Problem, stacked
from pamrs.diagnosis.prepare import Residual

__all__ = ["left_out"]

Array = NDArray[np.float64]

_RIDGE = 1e-9


def left_out(problem: Problem, found: Fit, inflation: dict[str, float]) -> dict[Key, Residual]:
    """Residuals of each recording under the fit that the other recordings would have given.

    One Gauss-Newton step away from the common fit for each recording, with the sensitivities that
    the fit ended with (as the leverage of a sample gives its deleted residual: Cook & Weisberg
    1982). What only the recording itself tells of the parameters, such as the size of a leak where
    one recording alone holds the pressure, is taken from it: the others say nothing for or against
    it.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    found : Fit
        A fit to all recordings.
    inflation : dict of str to float
        Variance of each block's binned residual relative to white sample noise.

    Returns
    -------
    dict of (str, str) to Residual
        By block and recording; the fit's own where there is one recording only, or sensitivities
        are not known of all parameters.
    """
    names = list(found.values)
    known = all(
        r.jacobian is not None and r.jacobian.shape[1] == len(names)
        for r in found.residuals.values()
    )
    if len(problem.recordings) < 2 or not known or not names:
        return found.residuals
    scales = np.array([found.scales[name] for name in names])
    normals, gradients = [], []
    for prepared in problem.recordings:
        rows, slope = stacked(replace(problem, recordings=[prepared]), found.residuals, inflation)
        assert slope is not None
        scaled = slope * scales
        normals.append(scaled.T @ scaled)
        gradients.append(scaled.T @ rows)
    total = np.sum(normals, axis=0) + np.diag(
        [1.0 if name in found.held_by_prior else 0.0 for name in names]
    )
    total += _RIDGE * np.diag(np.maximum(np.diag(total), _RIDGE))
    root = np.linalg.inv(np.linalg.cholesky(total))
    out = dict(found.residuals)
    alone = problem.settings.fit.sole_source
    for prepared, normal, gradient in zip(problem.recordings, normals, gradients, strict=True):
        # in these coordinates all recordings together tell one unit of every direction, and
        # `shares` of it come from this one
        shares, turn = np.linalg.eigh(root @ normal @ root.T)
        step = turn.T @ (root @ gradient)
        moved = np.where(shares < alone, step / np.maximum(1.0 - shares, 1.0 - alone), 0.0)
        change = root.T @ (turn @ moved) * scales
        for block in problem.blocks:
            key = (block.name, prepared.recording.name)
            own = found.residuals[key]
            assert own.jacobian is not None
            out[key] = replace(own, value=own.value - own.jacobian @ change)
    return out
