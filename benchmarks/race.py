"""Works timed in turns: what slows the machine for a while slows all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Times = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Ratio:
    """Median and quartiles of a ratio over all repetitions."""

    middle: float
    low: float
    high: float


def race(
    works: Mapping[str, Callable[[], object]], repeats: int = 15, least: float = 0.25
) -> Times:
    """Time every work once in each repetition, in another order each time.

    Parameters
    ----------
    works : mapping of str to callable
        Each is called twice beforehand.
    repeats : int
        Number of repetitions.
    least : float
        A repetition calls a work as often as it takes to fill this time [s], and once at least, so
        that short and long works are timed at the same clock of the processor.

    Returns
    -------
    dict of str to ndarray, shape (repeats,)
        Time of one call [s].
    """
    calls = {}
    for name, work in works.items():
        work()
        start = time.perf_counter()
        work()
        calls[name] = max(1, round(least / max(time.perf_counter() - start, 1e-9)))
    times = {name: np.empty(repeats) for name in works}
    order = list(works)
    for k in range(repeats):
        for name in order:
            work, count = works[name], range(calls[name])
            start = time.perf_counter()
            for _ in count:
                work()
            times[name][k] = (time.perf_counter() - start) / len(count)
        order = [*order[1:], order[0]]
    return times


def ratio(times: Times, peer: str, ours: str) -> Ratio:
    """How many times as long the peer takes, repetition by repetition."""
    low, middle, high = np.quantile(times[peer] / times[ours], [0.25, 0.5, 0.75])
    return Ratio(float(middle), float(low), float(high))
