"""Throughput over the size of the batch and over threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .race import race
from .workload import BATCH, SAMPLES, Batches

#: Plants times samples that one call may have: larger batches run for a shorter time.
MOST = 4_000_000
LEAST_SAMPLES = 5
#: Peers are given up beyond this size: their times no longer change, and they take long.
PEERS_UP_TO = 10_000


@dataclass(frozen=True)
class Point:
    """Time of one RK4 step of one plant [s] by each that takes part."""

    size: int
    samples: int
    threads: int
    step: dict[str, float]


def measured(
    batches: Batches, works: dict[str, Callable[[], object] | None], repeats: int, threads: int
) -> Point:
    """Median times of the works that there are."""
    there = {name: work for name, work in works.items() if work is not None}
    count = batches.payloads.size * batches.shoulder.steps
    times = race(there, repeats)
    step = {name: float(np.median(found)) / count for name, found in times.items()}
    return Point(batches.payloads.size, batches.shoulder.command.size, threads, step)


def over_size(sizes: list[int], repeats: int) -> list[Point]:
    """Batches of these sizes on all processors, JAX on one."""
    points = []
    for size in sizes:
        samples = int(np.clip(MOST // size, LEAST_SAMPLES, SAMPLES))
        batches = Batches.of(size, samples)
        works: dict[str, Callable[[], object] | None] = {"pamrs": batches.ours()}
        if size <= PEERS_UP_TO:
            works |= {"Numba prange": batches.numba(), "JAX, one core": batches.jax()}
        points.append(measured(batches, works, repeats, os.cpu_count() or 1))
    return points


def over_threads(repeats: int) -> list[Point]:
    """One batch on one thread, on two, on four and so on up to all processors."""
    most = os.cpu_count() or 1
    counts = sorted({*(2**k for k in range(most.bit_length()) if 2**k <= most), most})
    batches = Batches.of(BATCH)
    return [
        measured(
            batches,
            {"pamrs": batches.ours(count), "Numba prange": batches.numba(count)},
            repeats,
            count,
        )
        for count in counts
    ]
