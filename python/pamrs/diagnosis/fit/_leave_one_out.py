"""Every recording predicted by a fit to the others, where a case does not say which are held out;
every piece of a single one.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.fit._fitting import (
    FIT_BIN_TIME,
    Fit,
    Key,
    Problem,
    bin_width,
    residuals,
    stacked,
)
from pamrs.diagnosis.prepare import Residual

# share of a direction that one recording alone tells (leverage, Cook & Weisberg 1982)
_SOLE_SOURCE = 0.9
_PIECES_LEFT_OUT = 5  # pieces of a single recording, each predicted by the others (decision 111)


def predicted_by_others(
    problem: Problem, fitted: Fit, inflation: dict[str, float]
) -> dict[Key, Residual]:
    """Residuals of each recording under the fit that the other recordings would have given; of a
    single recording each piece of its time under the fit that the other pieces would have given.

    One Gauss-Newton step away from the common fit for each of them, with the sensitivities that
    the fit ended with (as the leverage of a sample gives its deleted residual: Cook & Weisberg
    1982). What only the recording itself tells of the parameters, such as the size of a leak where
    one recording alone holds the pressure, is taken from it: the others say nothing for or against
    it.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    fitted : Fit
        A fit to all recordings.
    inflation : dict of str to float
        Variance of each block's binned residual relative to white sample noise.

    Returns
    -------
    dict of (str, str) to Residual
        By block and recording; the fit's own where sensitivities are not known of all parameters.
    """
    names = list(fitted.values)
    fitted = _with_sensitivities(problem, fitted)
    if not names or not _knows_all(fitted):
        return fitted.residuals
    # what happens at times of its own has its own size as a scale
    scales = np.array([fitted.scales.get(n) or abs(fitted.values[n]) or 1.0 for n in names])
    parts = _parts(problem, fitted)
    sums = [_sums(problem, fitted, inflation, scales, part) for part in parts]
    total = np.sum([normal for normal, _ in sums], axis=0) + np.diag(
        [1.0 if name in fitted.held_by_prior else 0.0 for name in names]
    )
    # what keeps it invertible
    total += 1e-9 * np.diag(np.maximum(np.diag(total), 1e-9))
    root = np.linalg.inv(np.linalg.cholesky(total))
    out = dict(fitted.residuals)
    for part, (normal, gradient) in zip(parts, sums, strict=True):
        # in these coordinates all parts together tell one unit of every direction, and `shares` of
        # it come from this one
        shares, turn = np.linalg.eigh(root @ normal @ root.T)
        step = turn.T @ (root @ gradient)
        moved = np.where(
            shares < _SOLE_SOURCE, step / np.maximum(1.0 - shares, 1.0 - _SOLE_SOURCE), 0.0
        )
        change = root.T @ (turn @ moved) * scales
        for key, rows in part.items():
            residual = fitted.residuals[key]
            assert residual.jacobian is not None
            value = out[key].value.copy()
            value[rows] = residual.value[rows] - residual.jacobian[rows] @ change
            out[key] = replace(residual, value=value)
    return out


def _knows_all(fitted: Fit) -> bool:
    """True where a fit has the sensitivities to all of its parameters."""
    return all(
        r.jacobian is not None and r.jacobian.shape[1] == len(fitted.values)
        for r in fitted.residuals.values()
    )


def _with_sensitivities(problem: Problem, fitted: Fit) -> Fit:
    """A fit with the sensitivities of a single recording, where what happens in it at times of its
    own was fitted without them; of several recordings each has happenings of its own.
    """
    if len(problem.recordings) > 1 or _knows_all(fitted):
        return fitted
    return replace(
        fitted, residuals=residuals(problem, fitted.rig, list(fitted.values), fitted.events)
    )


def _parts(problem: Problem, fitted: Fit) -> list[dict[Key, slice]]:
    """Samples that are left out together, by block and recording."""
    sizes = {key: r.value.size for key, r in fitted.residuals.items()}
    if len(problem.recordings) > 1:
        return [
            {key: slice(0, size) for key, size in sizes.items() if key[1] == p.recording.name}
            for p in problem.recordings
        ]
    (only,) = problem.recordings
    width = bin_width(only, FIT_BIN_TIME)
    ends = [
        width * round(k / _PIECES_LEFT_OUT * (only.n // width)) for k in range(_PIECES_LEFT_OUT)
    ] + [only.n]
    return [
        {key: slice(first, last) for key in sizes}
        for first, last in itertools.pairwise(ends)
        if last > first
    ]


def _sums(
    problem: Problem,
    fitted: Fit,
    inflation: dict[str, float],
    scales: Array,
    part: dict[Key, slice],
) -> tuple[Array, Array]:
    """Normal matrix and gradient from the samples of a part."""
    within = {}
    for key, samples in part.items():
        residual = fitted.residuals[key]
        assert residual.jacobian is not None
        used = np.zeros_like(residual.rows)
        used[samples] = residual.rows[samples]
        within[key] = replace(residual, rows=used)
    recordings = [p for p in problem.recordings if any(p.recording.name == r for _, r in part)]
    rows, slope = stacked(replace(problem, recordings=recordings), within, inflation)
    assert slope is not None
    scaled = slope * scales
    return scaled.T @ scaled, scaled.T @ rows
