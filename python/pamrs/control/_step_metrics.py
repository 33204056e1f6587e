"""Rise, overshoot and settling of a step, for one run ``(samples,)`` or a batch
``(n, samples)``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.control._signals import checked, plain
from pamrs.errors import ParameterError

Array = NDArray[np.float64]


def rise_time(
    time: ArrayLike,
    angle: ArrayLike,
    start: float,
    target: float,
    *,
    shares: tuple[float, float] = (0.1, 0.9),
) -> float | Array:
    """Time from the first crossing of one share of a step to the first crossing of the other,
    straight lines between samples.

    Parameters
    ----------
    time, angle
        As for :func:`pamrs.control.metrics.squared_error`; the record begins with the step.
    start, target : float
        Angle before the step and commanded by it [rad], not the same.
    shares : (float, float)
        Rising, from 0 to 1.

    Returns
    -------
    float or ndarray, shape (n,)
        [s]; infinite where a share is never reached.

    Raises
    ------
    ParameterError
        As :func:`pamrs.control.metrics.squared_error`, or if the shares do not rise.
    """
    low, high = shares
    if not 0.0 <= low < high <= 1.0:
        raise ParameterError(
            f"shares = {shares} is not allowed: two rising numbers from 0 to 1 are needed"
        )
    t, y = _normalised(time, angle, start, target)
    first, second = (_crossing(t, y, share) for share in shares)
    reached = np.isfinite(second)
    return plain(_of_good(y, np.where(reached, second - np.where(reached, first, 0.0), np.inf)))


def overshoot(time: ArrayLike, angle: ArrayLike, start: float, target: float) -> float | Array:
    """How far the angle goes beyond the target, as a share of the step; 0 where it never does.

    Parameters
    ----------
    time, angle, start, target
        As for :func:`rise_time`.

    Returns
    -------
    float or ndarray, shape (n,)

    Raises
    ------
    ParameterError
        As :func:`pamrs.control.metrics.squared_error`.
    """
    _, y = _normalised(time, angle, start, target)
    return plain(np.maximum(y.max(axis=-1) - 1.0, 0.0))


def settling_time(
    time: ArrayLike, angle: ArrayLike, start: float, target: float, *, band: float = 0.02
) -> float | Array:
    """Time from which the angle stays within a band around the target, straight lines between
    samples.

    Parameters
    ----------
    time, angle, start, target
        As for :func:`rise_time`.
    band : float
        Half width as a share of the step, above zero.

    Returns
    -------
    float or ndarray, shape (n,)
        From the record's begin [s]; infinite where it is outside at the end.

    Raises
    ------
    ParameterError
        As :func:`pamrs.control.metrics.squared_error`, or if the band is not above zero.
    """
    if not (math.isfinite(band) and band > 0.0):
        raise ParameterError(f"band = {band} is not allowed: a number above zero is needed")
    t, y = _normalised(time, angle, start, target)
    away = np.abs(y - 1.0) - band
    outside = away > 0.0
    # the last sample outside, and the crossing between it and the next
    last = y.shape[-1] - 1 - np.argmax(outside[..., ::-1], axis=-1)
    next_one = np.minimum(last + 1, t.size - 1)
    a, b = (np.take_along_axis(away, k[..., None], axis=-1)[..., 0] for k in (last, next_one))
    share = np.where(a > b, a / np.where(a > b, a - b, 1.0), 0.0)
    found = t[last] + share * (t[next_one] - t[last]) - t[0]
    return plain(
        _of_good(y, np.where(~outside.any(axis=-1), 0.0, np.where(outside[..., -1], np.inf, found)))
    )


def _normalised(
    time: ArrayLike, angle: ArrayLike, start: float, target: float
) -> tuple[Array, Array]:
    """Checked time and the share of the step that was made."""
    t, y = checked(time, "angle", angle)
    if not (math.isfinite(start) and math.isfinite(target) and start != target):
        raise ParameterError(
            f"start = {start} and target = {target} are not allowed: two different finite angles "
            "are needed"
        )
    return t, np.asarray((y - start) / (target - start), dtype=np.float64)


def _of_good(y: Array, found: Array) -> Array:
    """What was found, NaN for runs that failed."""
    return np.where(np.isnan(y[..., 0]), np.nan, found)


def _crossing(t: Array, y: Array, share: float) -> Array:
    """First time at which ``y`` reaches a share; infinite where it never does."""
    there = y >= share
    k = np.argmax(there, axis=-1)
    before = np.maximum(k - 1, 0)
    a, b = (np.take_along_axis(y, i[..., None], axis=-1)[..., 0] for i in (before, k))
    part = np.where(b > a, (share - a) / np.where(b > a, b - a, 1.0), 1.0)
    return np.where(
        there.any(axis=-1), t[before] + np.clip(part, 0.0, 1.0) * (t[k] - t[before]), np.inf
    )
