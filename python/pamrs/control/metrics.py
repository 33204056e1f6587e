"""Metrics of tracking: those of 4.4.1 and the usual ones, for one run ``(samples,)`` or a batch
``(n, samples)``.

The curvature (4.16) of the graph of angle over time adds a rate squared to one, so its value, and
with it the optimum by (4.18), depends on the units that the axes carry: in degrees and seconds a
moving arm counts for almost nothing, in radians for nearly as much as a resting one. The
dissertation does not say which it used. Everything here takes ``unit`` (``"rad"`` by default) for
it; time is in seconds. The curvature is taken in absolute value, as a signed integral would cancel
oscillation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, refused
from pamrs.control._values import angle_factor, times_of
from pamrs.errors import ParameterError

__all__ = [
    "Metrics",
    "WEIGHTS",
    "combined",
    "evaluate",
    "lag",
    "phases",
    "rms",
    "squared_error",
    "total_curvature",
]


#: Of (4.18): squared error, curvature.
WEIGHTS: Final = (0.25, 0.75)


@dataclass(frozen=True)
class Metrics:
    """Result of :func:`evaluate`; floats for one run, arrays of shape (n,) for a batch.

    Attributes
    ----------
    squared_error : float or ndarray
        nu (4.15) [unit^2 s].
    curvature : float or ndarray
        omega (4.17), absolute, of the measured angle in ``unit`` over seconds.
    rms, largest : float or ndarray
        Root of the mean squared and largest absolute error [rad].
    final : float or ndarray
        Error at the end [rad].
    lag : float or ndarray
        See :func:`lag` [s].
    phases : mapping of str to mapping of str to float or ndarray
        ``rms``, ``largest``, ``mean`` and ``final`` error [rad] of each phase of the trajectory.
    unit : str
        Of the angle in ``squared_error`` and ``curvature``.
    """

    squared_error: float | Array
    curvature: float | Array
    rms: float | Array
    largest: float | Array
    final: float | Array
    lag: float | Array
    phases: Mapping[str, Mapping[str, float | Array]]
    unit: str


def squared_error(
    time: ArrayLike, reference: ArrayLike, angle: ArrayLike, *, unit: str = "rad"
) -> float | Array:
    """Integral of the squared error, nu (4.15), by the trapezoidal rule.

    Parameters
    ----------
    time : array_like, shape (samples,)
        Rising [s].
    reference, angle : array_like, shape (samples,) or (n, samples)
        [rad]
    unit : {"rad", "deg", "m"}
        Of the error in the result.

    Returns
    -------
    float or ndarray, shape (n,)
        [unit^2 s]

    Raises
    ------
    ParameterError
        If shapes do not fit, time does not rise, a value is not finite (in a batch that run failed,
        and its result is NaN), or the unit is unknown.
    """
    t, e = _error(time, reference, angle)
    return _plain(_factor(unit) ** 2 * _integral(t, e * e))


def total_curvature(
    time: ArrayLike, angle: ArrayLike, *, rate: ArrayLike | None = None, unit: str = "rad"
) -> float | Array:
    """Integral of the absolute curvature over time, omega (4.17).

    The curvature (4.16), ``y'' / (1 + y'^2)^(3/2)``, is the time derivative of
    ``y' / sqrt(1 + y'^2)``, so omega is the total variation of that: exact between samples wherever
    the rate is monotone between them, and no second derivative is taken. Noise of the angle adds to
    it at every sample: give a simulated or smoothed one.

    Parameters
    ----------
    time : array_like, shape (samples,)
        Rising [s], three samples at least.
    angle : array_like, shape (samples,) or (n, samples)
        [rad]
    rate : array_like, like ``angle``, optional
        [rad/s], where it is known; else central differences of the angle.
    unit : {"rad", "deg", "m"}
        Of the angle's axis.

    Returns
    -------
    float or ndarray, shape (n,)

    Raises
    ------
    ParameterError
        As :func:`squared_error`.
    """
    _, v = _rate(time, angle, rate, unit)
    return _plain(np.abs(np.diff(slope_sine(v), axis=-1)).sum(axis=-1))


def slope_sine(rate: Array) -> Array:
    """Sine of the slope's angle, ``y' / sqrt(1 + y'^2)``: its total variation is omega.

    Parameters
    ----------
    rate : ndarray
        y' in the unit of the curvature per second.

    Returns
    -------
    ndarray
    """
    return np.asarray(rate / np.sqrt(1.0 + rate * rate), dtype=np.float64)


def combined(
    error: ArrayLike,
    curve: ArrayLike,
    *,
    weights: tuple[float, float] = WEIGHTS,
    axis: int | tuple[int, ...] | None = None,
) -> Array:
    """J (4.18) of each of a set of runs: ``W_nu nu / min(nu) + W_omega omega / min(omega)``; at
    least the sum of the weights.

    J compares the runs of one set; it says nothing across sets.

    Parameters
    ----------
    error, curve : array_like, the same shape
        nu and omega of each run; NaN or infinite where a run failed.
    weights : (float, float)
        W_nu and W_omega, not negative.
    axis : int or tuple of int, optional
        Axes over which the runs are one set, for example those of the gains where another is the
        payload; all by default.

    Returns
    -------
    ndarray, the same shape
        Infinite where a run failed.

    Raises
    ------
    ParameterError
        If shapes differ, a weight is negative, a value is not above zero, or every run of a set
        failed.
    """
    nu, omega = (np.asarray(values, dtype=np.float64) for values in (error, curve))
    if nu.shape != omega.shape or nu.size == 0:
        raise ParameterError(
            f"error and curve have the shapes {nu.shape} and {omega.shape}; the same one, not "
            "empty, is needed"
        )
    if not all(math.isfinite(w) and w >= 0.0 for w in weights) or len(weights) != 2:
        raise refused("weights", weights, "two numbers from 0 on are needed")
    failed = ~(np.isfinite(nu) & np.isfinite(omega))
    total = np.zeros(nu.shape)
    for name, values, weight in (("error", nu, weights[0]), ("curve", omega, weights[1])):
        kept = np.where(failed, np.inf, values)
        least = kept.min(axis=axis, keepdims=True)
        if np.isinf(least).any():
            raise ParameterError("every run of a set failed: there is nothing to compare")
        if (least <= 0.0).any():
            raise ParameterError(
                f"{name} = {least.min():g} is not allowed: above zero is needed, as it divides"
            )
        total += weight * np.where(failed, 0.0, values) / least
    return np.where(failed, np.inf, total)


def rms(time: ArrayLike, reference: ArrayLike, angle: ArrayLike) -> float | Array:
    """Root of the time mean of the squared error.

    Parameters
    ----------
    time, reference, angle
        As for :func:`squared_error`.

    Returns
    -------
    float or ndarray, shape (n,)
        [rad]

    Raises
    ------
    ParameterError
        As :func:`squared_error`.
    """
    t, e = _error(time, reference, angle)
    return _plain(np.sqrt(_integral(t, e * e) / (t[-1] - t[0])))


def lag(time: ArrayLike, reference: ArrayLike, angle: ArrayLike) -> float | Array:
    """Delay of the angle: least squares of ``reference - angle = lag * reference'``, to first order
    in the lag.

    Parameters
    ----------
    time, reference, angle
        As for :func:`squared_error`.

    Returns
    -------
    float or ndarray, shape (n,)
        [s]; zero where the reference never moves.

    Raises
    ------
    ParameterError
        As :func:`squared_error`.
    """
    t, e = _error(time, reference, angle)
    change = np.diff(np.asarray(reference, dtype=np.float64), axis=-1)
    moved = (change * change / np.diff(t)).sum(axis=-1)
    shared = (change * 0.5 * (e[..., 1:] + e[..., :-1])).sum(axis=-1)
    # nothing moved: zero, or NaN where a run failed
    return _plain(np.where(moved > 0.0, shared / np.where(moved > 0.0, moved, 1.0), 0.0 * shared))


def phases(
    time: ArrayLike,
    reference: ArrayLike,
    angle: ArrayLike,
    parts: Mapping[str, tuple[float, float]],
) -> dict[str, dict[str, float | Array]]:
    """Errors in each part of a record, for example of lift, hold and return.

    Parameters
    ----------
    time, reference, angle
        As for :func:`squared_error`.
    parts : mapping of str to (float, float)
        Begin and end [s], as :attr:`pamrs.control.Trajectory.phases`; parts without two samples are
        left out.

    Returns
    -------
    dict of str to dict of str to float or ndarray, shape (n,)
        ``rms``, ``largest``, ``mean`` and ``final`` error [rad], reference minus angle.

    Raises
    ------
    ParameterError
        As :func:`squared_error`.
    """
    t, e = _error(time, reference, angle)
    found: dict[str, dict[str, float | Array]] = {}
    for name, (begin, end) in parts.items():
        inside = np.flatnonzero((t >= begin - 1e-9) & (t <= end + 1e-9))
        if inside.size < 2:
            continue
        part, when = e[..., inside], t[inside]
        length = when[-1] - when[0]
        found[name] = {
            "rms": _plain(np.sqrt(_integral(when, part * part) / length)),
            "largest": _plain(np.abs(part).max(axis=-1)),
            "mean": _plain(_integral(when, part) / length),
            "final": _plain(part[..., -1]),
        }
    return found


def evaluate(
    time: ArrayLike,
    reference: ArrayLike,
    angle: ArrayLike,
    *,
    rate: ArrayLike | None = None,
    parts: Mapping[str, tuple[float, float]] | None = None,
    unit: str = "rad",
) -> Metrics:
    """Every metric of a tracked trajectory at once.

    Parameters
    ----------
    time : array_like, shape (samples,)
        Rising [s].
    reference, angle : array_like, shape (samples,) or (n, samples)
        [rad]
    rate : array_like, like ``angle``, optional
        Of the angle [rad/s], for the curvature.
    parts : mapping of str to (float, float), optional
        As for :func:`phases`.
    unit : {"rad", "deg", "m"}
        Of the angle in nu and omega.

    Returns
    -------
    Metrics

    Raises
    ------
    ParameterError
        As :func:`squared_error`.
    """
    _, e = _error(time, reference, angle)
    return Metrics(
        squared_error=squared_error(time, reference, angle, unit=unit),
        curvature=total_curvature(time, angle, rate=rate, unit=unit),
        rms=rms(time, reference, angle),
        largest=_plain(np.abs(e).max(axis=-1)),
        final=_plain(e[..., -1]),
        lag=lag(time, reference, angle),
        phases=phases(time, reference, angle, parts or {}),
        unit=unit,
    )


def _error(time: ArrayLike, reference: ArrayLike, angle: ArrayLike) -> tuple[Array, Array]:
    """Checked time and reference minus angle."""
    t, y = _checked(time, "angle", angle)
    r = np.asarray(reference, dtype=np.float64)
    if r.shape not in (y.shape, t.shape):
        raise ParameterError(
            f"reference has the shape {r.shape}; that of angle {y.shape} or of time {t.shape} is "
            "needed"
        )
    _, r = _checked(time, "reference", r)
    return t, np.asarray(r - y, dtype=np.float64)


def _factor(unit: str) -> float:
    """Number of units in a radian, or in a metre for a length."""
    return 1.0 if unit == "m" else angle_factor(unit)


def _rate(
    time: ArrayLike, angle: ArrayLike, rate: ArrayLike | None, unit: str
) -> tuple[Array, Array]:
    """Checked time and rate in the unit per second."""
    factor = _factor(unit)
    t, y = _checked(time, "angle", angle)
    if t.size < 3:
        raise ParameterError(f"time has {t.size} samples; a curvature needs three at least")
    if rate is None:
        return t, factor * np.gradient(y, t, axis=-1)
    _, v = _checked(time, "rate", rate)
    if v.shape != y.shape:
        raise ParameterError(f"rate has the shape {v.shape}; that of angle {y.shape} is needed")
    return t, factor * v


def _checked(time: ArrayLike, name: str, values: ArrayLike) -> tuple[Array, Array]:
    """Rising times and values of shape (samples,) or (n, samples) as arrays; anything else is a
    ParameterError.

    Values that are not finite are an error too. In a batch they are those of a run that failed: its
    whole row is NaN, and so is all that is found for it.
    """
    t, y = times_of(time, 2), as_numbers(name, values)
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


def _plain(values: ArrayLike) -> float | Array:
    """A float for one run."""
    found = np.asarray(values, dtype=np.float64)
    return float(found) if found.ndim == 0 else found


def _integral(time: Array, values: Array) -> Array:
    """Integral over time along the last axis by the trapezoidal rule, for numpy 1 and 2."""
    return np.asarray(
        (0.5 * (values[..., 1:] + values[..., :-1]) * np.diff(time)).sum(axis=-1), dtype=np.float64
    )
