"""Types of arrays by what they hold, stretches of set flags, and solutions of normal equations with
unknowns of any scale.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Array", "ArrayLike", "Index", "Mask", "solve_normal", "stretches"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

_RIDGE: Final = 1e-12
"""Share of the diagonal that is added to it: more than the rounding of the sums, far less than
anything that data tell."""


def solve_normal(normal: Array, right: Array) -> Array:
    """Solution of normal equations, also where they are singular.

    Each unknown is measured by its own entry of the diagonal, and the ridge is a part of that: an
    absolute one is lost next to large entries and bends small ones.

    Parameters
    ----------
    normal : (n, n) array
        Symmetric, with no negative direction but by rounding.
    right : (n,) or (n, m) array
        Right-hand side.

    Returns
    -------
    (n,) or (n, m) array
        An unknown that the equations do not see is zero.
    """
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    size[~(size > 0.0)] = 1.0
    scaled = normal / size / size[:, None]
    scaled[np.diag_indices_from(scaled)] += _RIDGE * len(size)
    rows = (slice(None), *([None] * (right.ndim - 1)))
    return np.asarray(np.linalg.solve(scaled, right / size[rows]) / size[rows])


def stretches(flags: Mask) -> list[tuple[int, int]]:
    """Stretches in which a flag stays set.

    Parameters
    ----------
    flags : ndarray of bool, shape (n,)
        One flag for each sample.

    Returns
    -------
    list of (start, stop)
        Sample indices, ``stop`` excluded.
    """
    padded = np.concatenate([[False], flags, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
