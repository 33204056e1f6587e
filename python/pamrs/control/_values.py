"""Numbers of one plant or of a batch: the few operations that need a word for both, lean for plain
floats, and a tabulated function.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import (
    as_column,
    as_numbers,
    checked_number,
    matched,
    misshapen,
    one_of,
    rising,
)
from pamrs.control._protocol import Value
from pamrs.errors import ParameterError

#: How many of a unit are in a radian.
_PER_RADIAN: Final[dict[str, float]] = {"rad": 1.0, "deg": 180.0 / math.pi}


def as_value(
    name: str, value: Any, *, lower: float = -math.inf, upper: float = math.inf, above: bool = False
) -> Value:
    """A finite float, or a finite array of shape (n,), within bounds.

    Parameters
    ----------
    name : str
        What it is, for messages.
    value : float or array_like, shape (n,)
        What was given.
    lower, upper : float
        What is allowed.
    above : bool
        Whether ``lower`` itself is refused.

    Returns
    -------
    float or ndarray, shape (n,)
        Never a numpy scalar, whose arithmetic is slow.

    Raises
    ------
    ParameterError
        If it is not of that form; the message names it.
    """
    array = as_numbers(name, value)
    if array.ndim > 1 or array.size == 0:
        raise misshapen(name, array.shape, each="or a number")
    wrong = ~(np.isfinite(array) & (array >= lower) & (array <= upper))
    if above:
        wrong |= array == lower
    if np.any(wrong):
        first = np.atleast_1d(array)[np.atleast_1d(wrong)][0]
        bound = f"above {lower:g}" if above else f"from {lower:g}"
        allowed = "finite"
        if lower > -math.inf or upper < math.inf:
            allowed = f"finite, {bound} to {upper:g}"
        raise ParameterError(f"{name} = {first:g} is not allowed: {allowed} is needed")
    if array.ndim == 0:
        return float(array)
    # whoever could write into it would change some of what follows from it
    kept = array.copy()
    kept.flags.writeable = False
    return kept


def gains_of(names: Sequence[str], gains: Sequence[Any]) -> tuple[Value, ...]:
    """Check that a gain is at least zero for each of some names; see :func:`as_value`."""
    if len(gains) != len(names):
        raise ParameterError(
            f"gains has {len(gains)} entries: {len(names)} are needed, for {', '.join(names)}"
        )
    pairs = zip(names, gains, strict=True)
    return tuple(as_value(f"gains[{name}]", value, lower=0.0) for name, value in pairs)


def times_of(values: Any, least: int) -> Array:
    """Rising times [s], ``least`` of them or more; a ParameterError for anything else."""
    (times,) = matched(time=as_column("time", values))
    if times.size < least:
        raise ParameterError(f"time has {times.size} samples; {least} at least are needed")
    if not (np.diff(times) > 0.0).all():
        k = int(np.argmin(np.diff(times)))
        raise ParameterError(
            f"time[{k + 1}] = {times[k + 1]:g} s is not allowed: times have to rise, and time[{k}] "
            f"is {times[k]:g} s"
        )
    return times


def positive_gain(name: str, value: Any) -> Value:
    """A gain above zero, see :func:`as_value`."""
    return as_value(name, value, lower=0.0, above=True)


def positive_number(name: str, value: Any) -> float:
    """One number above zero for the whole batch, see :func:`as_value`."""
    checked = positive_gain(name, value)
    if isinstance(checked, np.ndarray):
        raise ParameterError(f"{name} is an array: one number for the whole batch is needed")
    return checked


def limits_around(limits: Any, null: Any) -> tuple[float, float, float]:
    """Check limits of an output and its null: two rising finite numbers, the null between them."""
    low, high = rising("limits", limits)
    return low, high, checked_number("the null of limits", null, low, high)


def angle_factor(unit: str) -> float:
    """Number of units, ``"rad"`` or ``"deg"``, in a radian; a ParameterError for another unit."""
    one_of("unit", unit, _PER_RADIAN)
    return _PER_RADIAN[unit]


def clip(value: Value, low: Value, high: Value) -> Value:
    """``value`` within ``low`` and ``high``, which are not checked against each other."""
    if value.__class__ is float and low.__class__ is float and high.__class__ is float:
        return low if value < low else high if value > high else value
    return np.minimum(np.maximum(value, low), high)


def greater(a: Value, b: Value) -> Value:
    """The larger one of two."""
    if a.__class__ is float and b.__class__ is float:
        return a if a > b else b
    return np.maximum(a, b)


def lesser(a: Value, b: Value) -> Value:
    """The smaller one of two."""
    if a.__class__ is float and b.__class__ is float:
        return a if a < b else b
    return np.minimum(a, b)


def sign(value: Value) -> Value:
    """-1, 0 or 1."""
    if value.__class__ is float:
        return 1.0 if value > 0.0 else -1.0 if value < 0.0 else 0.0
    return np.sign(value)


def sin(value: Value) -> Value:
    """Sine; that of an array may differ from that of a float in the last bit."""
    if value.__class__ is float:
        return math.sin(value)
    return np.sin(value)


def where(condition: Any, value: Value, other: Value) -> Value:
    """``value`` where a condition holds, ``other`` elsewhere."""
    if isinstance(condition, bool) and value.__class__ is float and other.__class__ is float:
        return value if condition else other
    return np.where(condition, value, other)


class Spline:
    """Cubic spline through values at even places, held beyond the ends; the same for floats and
    arrays, bit for bit.

    Parameters
    ----------
    low, high : float
        First and last place.
    values : ndarray, shape (k,)
        Values at k >= 4 even places.
    """

    def __init__(self, low: float, high: float, values: Array) -> None:
        from scipy.interpolate import CubicSpline

        self.low, self.high, self.cells = float(low), float(high), values.size - 1
        self._step = (self.high - self.low) / self.cells
        self._coefficients = np.ascontiguousarray(
            CubicSpline(np.arange(values.size) * self._step, values).c.T
        )
        self._rows: list[list[float]] = self._coefficients.tolist()

    def __call__(self, place: Value) -> Value:
        """Value at a place."""
        if place.__class__ is float:
            x = (
                self.low if place < self.low else self.high if place > self.high else place
            ) - self.low
            cell = int(x / self._step)
            if cell >= self.cells:
                cell = self.cells - 1
            a, b, c, d = self._rows[cell]
            x -= cell * self._step
            return ((a * x + b) * x + c) * x + d
        places, (ka, kb, kc, kd) = self._find(np.asarray(place))
        return np.asarray(((ka * places + kb) * places + kc) * places + kd)

    def slope(self, place: Value) -> Value:
        """Derivative at a place; beyond the ends that of the end."""
        if place.__class__ is float:
            x = (
                self.low if place < self.low else self.high if place > self.high else place
            ) - self.low
            cell = int(x / self._step)
            if cell >= self.cells:
                cell = self.cells - 1
            a, b, c, _ = self._rows[cell]
            x -= cell * self._step
            return (3.0 * a * x + 2.0 * b) * x + c
        places, (ka, kb, kc, _) = self._find(np.asarray(place))
        return np.asarray((3.0 * ka * places + 2.0 * kb) * places + kc)

    def _find(self, place: Array) -> tuple[Array, Array]:
        x = np.minimum(np.maximum(place, self.low), self.high) - self.low
        cell = np.minimum((x / self._step).astype(np.intp), self.cells - 1)
        return x - cell * self._step, self._coefficients[cell].T
