"""Checks of arguments that several packages share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pamrs.errors import ParameterError
from pamrs.units import with_unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["check_column", "checked_number", "checked_table", "positive"]


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


def checked_number(
    name: str, value: Any, lower: float, upper: float, unit: str = "", *, whole: bool = False
) -> float:
    """A finite number between two bounds.

    Parameters
    ----------
    name : str
        What it is, for the message.
    value : object
        What was given.
    lower, upper : float
        Bounds; ``upper`` may be infinite.
    unit : str, optional
        Its unit.
    whole : bool, optional
        Only a whole number is allowed.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        With name, value and what is allowed.
    """
    last = with_unit("", unit)
    kind = "whole" if whole else "finite"
    allowed = f"{'a whole number ' * whole}from {lower:g} to {upper:g}{last}"
    if math.isinf(upper):
        allowed = f"a {kind} number of {lower:g}{last} or more"
    try:
        if isinstance(value, (str, bytes, bytearray)):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} = {value!r} is not allowed: {'' if whole else 'a number is needed, '}{allowed}"
        ) from None
    if not (math.isfinite(number) and lower <= number <= upper) or (
        whole and not number.is_integer()
    ):
        raise ParameterError(f"{name} = {number:g}{last} is not allowed: {allowed}")
    return number


def check_column(
    name: str, values: NDArray[np.float64], lower: float, upper: float, unit: str
) -> None:
    """Refuse a column of which a number is not finite or outside its bounds.

    Parameters
    ----------
    name : str
        What it is, for the message.
    values : ndarray
        The column.
    lower, upper : float
        Bounds.
    unit : str
        Their unit.

    Raises
    ------
    ParameterError
        With name, row, value and what is allowed.
    """
    import numpy as np

    bad = np.flatnonzero(~(np.isfinite(values) & (values >= lower) & (values <= upper)))
    if bad.size:
        wrong = with_unit(f"{name}[{bad[0]}] = {values[bad[0]]:g}", unit)
        allowed = with_unit(f"from {lower:g} to {upper:g}", unit)
        raise ParameterError(f"{wrong} is not allowed: {allowed}")


def checked_table(name: str, values: Any) -> dict[str, Any]:
    """A copy of a mapping whose keys are names.

    Parameters
    ----------
    name : str
        What it is, for the message.
    values : object
        What was given.

    Returns
    -------
    dict

    Raises
    ------
    ParameterError
        If it is no mapping, or a key is no text.
    """
    if not isinstance(values, Mapping):
        raise ParameterError(f"{name} = {values!r} is not allowed: a mapping of names is needed")
    for key in values:
        if not isinstance(key, str):
            raise ParameterError(f"{name} has the key {key!r}, which is not allowed: a name is one")
    return dict(values)
