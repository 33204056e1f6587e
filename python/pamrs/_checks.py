"""Checks of arguments that several packages share."""

from __future__ import annotations

import math

from pamrs.errors import ParameterError

__all__ = ["positive"]


def positive(name: str, value: float, *, zero: bool = False) -> float:
    """The value, if it is finite and above zero (or zero, where that is allowed).

    Parameters
    ----------
    name : str
        What the message calls it.
    value : float
        The number.
    zero : bool
        Whether zero is allowed.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        Naming the argument, its value and what is allowed.
    """
    allowed = f"a finite number {'from' if zero else 'above'} zero is needed"
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} = {value!r} is not allowed: {allowed}") from None
    if not (math.isfinite(number) and (number > 0.0 or (zero and number == 0.0))):
        raise ParameterError(f"{name} = {value} is not allowed: {allowed}")
    return number
