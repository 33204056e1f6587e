"""Distances of a parameter from its nominal value, in tolerances."""

from __future__ import annotations

import math

from pamrs.rig import Parameter

# multiple of its nominal value, or of other walls, for a freed parameter (decision 25)
_FREED_MULTIPLE = 10.0
_LEAST_RATIO = 1e-3  # share of its nominal value that a positive parameter has at the least


def _is_positive(known: Parameter) -> bool:
    """Whether a parameter is a positive quantity: below its value its tolerance is a factor."""
    return known.lower >= 0.0 < known.value


def moved_value(known: Parameter, tolerances: float) -> float:
    """A parameter [SI] so many tolerances from its nominal value.

    Upwards a tolerance is added; downwards a positive quantity is multiplied by
    ``exp(-tol / value)`` for each, so that nearly nothing is as far away as it is unlikely.
    """
    moved = known.value + tolerances * known.tol
    if tolerances < 0.0 and _is_positive(known):
        moved = known.value * math.exp(tolerances * known.tol / known.value)
    return min(max(moved, known.lower), known.upper)


def moved_slope(known: Parameter, tolerances: float) -> float:
    """Change of a parameter [SI] with one more tolerance."""
    if tolerances < 0.0 and _is_positive(known):
        return known.tol * math.exp(tolerances * known.tol / known.value)
    return known.tol


def in_tolerances(known: Parameter, value: float) -> float:
    """Distance of a value [SI] from the nominal one, in tolerances."""
    if value < known.value and _is_positive(known):
        ratio = max(value / known.value, _LEAST_RATIO)
        return math.log(ratio) * known.value / known.tol
    return (value - known.value) / known.tol


def ends_in_tolerances(
    known: Parameter, most: float, *, freed: bool = False
) -> tuple[float, float]:
    """The least and the largest distance that a fit allows a parameter, in tolerances: so many on
    both sides, of one that is freed what its bounds and a multiple of its value allow.
    """
    if freed:
        most = _FREED_MULTIPLE * max(most, abs(known.value) / known.tol)
    low, high = (in_tolerances(known, end) for end in (known.lower, known.upper))
    return max(low, -most), min(high, most)
