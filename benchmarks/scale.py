"""What a sweep costs on one core, for docs/scale.md: ``python -m benchmarks.scale [runs]``.

Seconds are those of the processor, so that other work on the machine does not count.
"""

from __future__ import annotations

import dataclasses
import pickle
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np

import pamrs

#: 2 s of the shoulder at 5 ms, steps of 1 ms.
COMMAND = np.full(401, 6.0)
METRICS = {
    "end": ("final", "joint_angle"),
    "peak": ("max", "joint_angle"),
    "error": ("squared_error", "joint_angle", 0.8),
    "air": ("final", "mass_supplied"),
}
PARAMETERS = ["arm.payload", "arm.viscous", "chamber.dead_volume", "supply.volume"]


class Nothing(Executor):
    """Answers every chunk with numbers out of one run: what is left is the bookkeeping."""

    def __init__(self) -> None:
        self.bytes = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """A future that is done."""
        (task,) = args
        n = len(next(iter(task.values.values())))
        self.bytes = len(pickle.dumps(task))
        one = fn(dataclasses.replace(task, values={k: v[:1] for k, v in task.values.items()}))
        noise = np.random.default_rng(0).normal(1.0, 0.1, n)
        metrics = {name: values[0] * noise for name, values in one.metrics.items()}
        future: Future[Any] = Future()
        future.set_result(one._replace(metrics=metrics, ended_at=np.full(n, np.nan)))
        return future


def timed(work: Callable[[], object]) -> float:
    """Seconds of the processor."""
    began = time.process_time()
    work()
    return time.process_time() - began


def size_of(folder: Path) -> tuple[int, int]:
    """Bytes and files under a folder."""
    files = [file for file in folder.rglob("*") if file.is_file()]
    return sum(file.stat().st_size for file in files), len(files)


def swept(store: Path, runs: int, chunk: int, executor: Executor | None = None) -> float:
    """Seconds of a sweep on one thread."""
    rig = pamrs.rigs.shoulder()
    middle = np.array([rig.parameter(name).value for name in PARAMETERS])
    drawn = middle * np.random.default_rng(0).uniform(0.9, 1.1, (runs, len(PARAMETERS)))
    given = {"sample_time": 0.005, "valve_command": COMMAND, "store": store, "samples": drawn}
    how = {"executor": executor, "chunk": chunk, "threads": 1, "progress": False}
    return timed(lambda: pamrs.sweep(rig, PARAMETERS, METRICS, **given, **how))


def main() -> None:
    """Print every number."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 2048
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        swept(folder / "first.zarr", 64, 64)  # imports, compilation
        seconds = swept(folder / "runs.zarr", runs, runs)
        print(f"{runs / seconds:.4g} runs/s on one thread, {seconds / runs * 1e3:.3g} ms each")
        for chunk, chunks in ((65_536, 64), (1024, 512)):
            nothing, store = Nothing(), folder / f"{chunk}.zarr"
            seconds = swept(store, chunks * chunk, chunk, nothing)
            size, files = size_of(store)
            again = swept(store, chunks * chunk, chunk, nothing)
            print(
                f"chunks of {chunk} runs: {seconds / chunks * 1e3:.3g} ms of bookkeeping each, "
                f"{size / chunks / chunk:.3g} bytes for each run, {files / chunks:.3g} files, "
                f"a task of {nothing.bytes / 1e6:.3g} MB; the same call on the finished store of "
                f"{chunks} chunks takes {again * 1e3:.3g} ms"
            )


if __name__ == "__main__":
    main()
