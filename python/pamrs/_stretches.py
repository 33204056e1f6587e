"""Stretches in which something holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where a flag stays set.

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
