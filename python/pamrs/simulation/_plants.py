"""Arguments of many plants: how many there are, a number for each, how many threads."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, as_said, misshapen, refused, whole
from pamrs.errors import ParameterError

_MOST_THREADS = 256
_MOST_PLANTS = 10_000_000


def plants_of(n: int | None, rigs: int | None, given: Mapping[str, ArrayLike]) -> int:
    """Number of plants from what says it: a number, a sequence of rigs, arrays by their name."""
    sizes = {name: int(max(np.shape(v))) for name, v in given.items() if np.ndim(v)}
    if n is not None:
        sizes = {"n": whole("n", n, 1), **sizes}
    if rigs is not None:
        sizes = {"rig": rigs, **sizes}
    if not sizes:
        raise ParameterError(
            "n is missing: the number of plants (or an array with a value for each of them)"
        )
    first, count = next(iter(sizes.items()))
    if count > _MOST_PLANTS:
        raise ParameterError(
            f"{first} is for {as_said(count)} plants, which is not allowed: at most {_MOST_PLANTS} "
            "at a time (pamrs.sweep runs more, chunk by chunk)"
        )
    for name, size in sizes.items():
        if size != count or size < 1:
            raise ParameterError(
                f"{name} is for {size} plants, {first} for {count}; one number of plants, 1 at "
                "least, is needed"
            )
    return count


def rowwise(name: str, values: ArrayLike, n: int, *, finite: bool = True) -> Array:
    """A number for each plant; whether it is finite is only looked at where that is asked for."""
    array = as_numbers(name, values, _MOST_PLANTS)
    if array.ndim == 0:
        array = np.full(n, float(array))
    if array.shape != (n,):
        raise misshapen(name, array.shape, n, "one value for each plant")
    for row in np.flatnonzero(~np.isfinite(array))[:1] if finite else ():
        raise refused(f"{name}[{row}]", array[row], "a finite number is needed")
    return np.ascontiguousarray(array)


def thread_count(threads: int | None) -> int:
    """Number of threads that may work: the one given, else that of the processors."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return min(len(os.sched_getaffinity(0)), _MOST_THREADS)
        return min(os.cpu_count() or 1, _MOST_THREADS)
    return whole("threads", threads, 1, _MOST_THREADS)
