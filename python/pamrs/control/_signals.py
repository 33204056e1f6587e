"""Recorded signals as the metrics take them, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.errors import ParameterError

Array = NDArray[np.float64]


def checked(time: ArrayLike, name: str, values: ArrayLike) -> tuple[Array, Array]:
    """Rising times and values of shape (samples,) or (n, samples) as arrays; anything else is a
    ParameterError.

    Values that are not finite are an error too. In a batch they are those of a run that failed: its
    whole row is NaN, and so is all that is found for it.
    """
    t, y = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or not np.isfinite(t).all() or not (np.diff(t) > 0.0).all():
        raise ParameterError(
            f"time with the shape {t.shape} is not allowed: two or more finite, rising times [s] "
            "are needed"
        )
    if y.ndim not in (1, 2) or y.shape[-1] != t.size:
        raise ParameterError(
            f"{name} has the shape {y.shape}; ({t.size},) or (n, {t.size}) is needed"
        )
    finite = np.isfinite(y)
    if finite.all():
        return t, y
    if y.ndim == 1:
        raise ParameterError(
            f"{name} is not finite at {t[np.flatnonzero(~finite)[0]]:g} s, which is not allowed"
        )
    return t, np.where(finite.all(axis=-1, keepdims=True), y, np.nan)


def plain(values: ArrayLike) -> float | Array:
    """A float for one run."""
    found = np.asarray(values, dtype=np.float64)
    return float(found) if found.ndim == 0 else found


def integral(time: Array, values: Array) -> Array:
    """Integral over time along the last axis by the trapezoidal rule (numpy 1 and 2 name theirs
    differently).
    """
    return np.asarray(
        (0.5 * (values[..., 1:] + values[..., :-1]) * np.diff(time)).sum(axis=-1), dtype=np.float64
    )
