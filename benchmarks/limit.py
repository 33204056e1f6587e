"""How far the package is from what the machine can do at most."""

from __future__ import annotations

from dataclasses import dataclass

from .counting import Work, work_of_a_step
from .machine import peaks
from .race import race
from .workload import BATCH, Batches, Shoulder

__all__ = ["Limit", "Share", "limit"]


@dataclass(frozen=True)
class Share:
    """One way to run: time of a step of one plant on one core [s], and shares of the peaks."""

    work: str
    step: float
    flops: float
    of_arithmetic: float
    of_memory: float


@dataclass(frozen=True)
class Limit:
    """Work of a step, peaks of one core [flop/s, B/s], and shares of them."""

    work: Work
    peak_flops: float
    peak_bytes: float
    shares: list[Share]


def limit(repeats: int) -> Limit:
    """Count the work, measure the peaks, and time the package on one core.

    Parameters
    ----------
    repeats : int
        Repetitions; the shortest counts, as for the peaks.

    Returns
    -------
    Limit
    """
    shoulder, batches = Shoulder(), Batches.of(BATCH)
    work, most = work_of_a_step(shoulder.rig), peaks()
    times = race({"one": shoulder.ours, "batch": batches.ours(1)}, repeats)
    # a batch that is reduced keeps its states in registers and caches: nothing streams
    ways = [
        ("one run, four states kept", times["one"].min() / shoulder.steps, work.stream_bytes),
        (f"{BATCH} plants, reduced", times["batch"].min() / shoulder.steps / BATCH, 0.0),
    ]
    shares = [
        Share(
            name,
            float(step),
            work.flops / step,
            float(work.flops / step / most["flops"]),
            float(streamed / step / most["bytes"]),
        )
        for name, step, streamed in ways
    ]
    return Limit(work, most["flops"], most["bytes"], shares)
