"""A Gaussian process of the discrepancy (Kennedy & O'Hagan 2001), with scikit-learn.

The residual, in units of its noise, is a function of the measured signals at the same time: squared
exponential with a length for each signal, and white noise. Lengths and variances maximise the
marginal likelihood of 300 of the up to 600 points that it learns from. Where it does not help when
one recording to fit is left out at a time, nothing is corrected, as with SINDy.
"""

from __future__ import annotations

import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from benchmarks.baselines.sheet import Array, Column

POINTS, TUNED = 600, 300
"""Points that it learns from, and of them those for the likelihood of lengths and variances."""
SEED = 20010901


def correct(column: Column) -> tuple[list[Array], str]:
    """Corrections for the held-out stretches of a block, and the kernel that gave them."""
    inside = [
        np.concatenate([np.arange(a, b) for a, b in s.pieces] or [np.zeros(0, dtype=int)])
        for s in column.inner
    ]
    y = np.concatenate([s.y[i] for s, i in zip(column.inner, inside, strict=True)])
    u = np.concatenate([s.u[i] for s, i in zip(column.inner, inside, strict=True)])
    if y.size < 16 or not y.std() > 0.0:
        return [np.zeros(len(s.y)) for s in column.outer], "no correction"
    rng = np.random.default_rng(SEED)
    chosen = rng.permutation(y.size)[:POINTS]
    power = float(y.var())
    kernel = ConstantKernel(0.5 * power, (1e-4 * power, 1e2 * power)) * RBF(
        np.ones(u.shape[1]), (5e-2, 1e2)
    ) + WhiteKernel(0.5 * power, (1e-4 * power, 1e1 * power))
    few = chosen[:TUNED]
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", ConvergenceWarning
        )  # a length at its bound: the signal has no say
        tuned = GaussianProcessRegressor(kernel, random_state=0).fit(u[few], y[few])
    owner = np.repeat(np.arange(len(inside)), [i.size for i in inside])[chosen]
    if len(column.inner) > 1:
        ratios = []
        for left, stretch in enumerate(column.inner):
            rest = chosen[owner != left]
            guess = (
                GaussianProcessRegressor(tuned.kernel_, optimizer=None)
                .fit(u[rest], y[rest])
                .predict(stretch.u)
            )
            ratios.append(stretch.error(guess) / max(stretch.error(), 1e-9))
        if np.mean(ratios) >= 1.0:
            return [np.zeros(len(s.y)) for s in column.outer], "no correction"
    model = GaussianProcessRegressor(tuned.kernel_, optimizer=None).fit(u[chosen], y[chosen])
    return [model.predict(s.u) for s in column.outer], str(model.kernel_)
