"""Find the size of an effect that moves its most affected channel by a wanted multiple of the noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
#: multiples of the noise; medium lies a little above 3, so that every medium case counts as detectable
STRENGTHS = {"weak": 1.5, "medium": 3.3, "strong": 10.0}


def aim(
    simulate: Callable[[float], tuple[float, T]],
    target: float,
    most: float,
    start: float = 1.0,
    tolerance: float = 0.08,
    tries: int = 9,
) -> tuple[float, float, T]:
    """Scale an effect until it reaches a target.

    Parameters
    ----------
    simulate : callable
        Gives the reach of a scale factor, and whatever else is wanted of the last call.
    target : float
        Wanted reach.
    most : float
        Largest factor allowed.
    start : float
        First factor.
    tolerance : float
        Relative distance from the target that is good enough.
    tries : int
        Largest number of simulations.

    Returns
    -------
    factor, reach : float
        The best found.
    result
        What `simulate` gave with it.
    """
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    best: tuple[float, float, T] | None = None
    factor = min(start, most)
    for attempt in range(tries):
        found, result = simulate(factor)
        if best is None or abs(math.log(max(found, 1e-9) / target)) < abs(math.log(max(best[1], 1e-9) / target)):
            best = (factor, found, result)
        if abs(found / target - 1.0) <= tolerance or (found < target and factor >= most):
            break
        x, y = math.log(factor), math.log(max(found, 1e-9) / target)
        if y < 0.0:
            low = (x, y)
        else:
            high = (x, y)
        if low is not None and high is not None:
            # straight line in logarithms, kept off the ends, and the middle every third time
            share = -low[1] / (high[1] - low[1])
            share = 0.5 if attempt % 3 == 2 else min(max(share, 0.1), 0.9)
            x = low[0] + share * (high[0] - low[0])
        else:
            x -= min(max(y, -2.5), 2.5)
        factor = min(math.exp(x), most)
    assert best is not None
    return best
