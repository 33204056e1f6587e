"""Chunks through an executor: a bounded number in flight, each kept as soon as it is done."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from itertools import islice
from typing import Any, Final

from pamrs.errors import PamrsError, ParameterError, SimulationError
from pamrs.sweeps._drives import Done, Task, run_chunk
from pamrs.sweeps._progress import Progress
from pamrs.sweeps._store import Store

#: Chunks in flight for each worker: one is worked out, one waits.
_EACH: Final = 2
#: How often dask tries a chunk again whose worker was lost.
_RETRIES: Final = 3


def executor_of(given: Any) -> Executor | None:
    """An executor, of a dask client its own; None for this process.

    Parameters
    ----------
    given : Executor, distributed.Client or None

    Returns
    -------
    Executor or None

    Raises
    ------
    ParameterError
        If it is none of these.
    """
    if given is None or isinstance(given, Executor):
        return given
    if callable(made := getattr(given, "get_executor", None)):
        own: Executor = made(pure=False, retries=_RETRIES)
        return own
    raise ParameterError(
        f"executor is a {type(given).__name__}; None, an executor of concurrent.futures or a "
        "dask.distributed.Client is needed"
    )


def in_flight_of(executor: Any) -> int:
    """How many chunks are given to an executor at once."""
    workers = getattr(executor, "_max_workers", None)
    client = getattr(executor, "_client", None)
    if workers is None and client is not None:
        workers = sum(client.nthreads().values())
    return _EACH * max(1, workers or os.cpu_count() or 1)


def run_missing(
    store: Store, executor: Executor | None, progress: Progress, *, threads: int | None, most: int
) -> None:
    """Work out every chunk that is not done.

    Parameters
    ----------
    store : Store
        Open.
    executor : Executor or None
        Where; None for this process.
    progress : Progress
        Is told of each chunk.
    threads : int or None
        Most threads of one chunk.
    most : int
        Chunks in flight at most.

    Raises
    ------
    ParameterError
        If an argument of the sweep is not allowed, which a chunk has found.
    SimulationError
        If the executor lost its workers. What is done is kept.
    """
    tasks = ((chunk, store.plan.task(chunk, threads)) for chunk in store.missing())
    done = _here(tasks) if executor is None else _there(tasks, executor, most)
    for chunk, task, result in done:
        entry = store.write(chunk, task.values, result)
        progress.add(entry.runs, entry.ended)


def _here(tasks: Iterator[tuple[int, Task]]) -> Iterator[tuple[int, Task, Done]]:
    for chunk, task in tasks:
        yield chunk, task, run_chunk(task)


def _there(
    tasks: Iterator[tuple[int, Task]], executor: Executor, most: int
) -> Iterator[tuple[int, Task, Done]]:
    flying: dict[Future[Done], tuple[int, Task]] = {}
    try:
        while True:
            for chunk, task in islice(tasks, most - len(flying)):
                flying[executor.submit(run_chunk, task)] = chunk, task
            if not flying:
                return
            for future in wait(flying, return_when=FIRST_COMPLETED).done:
                yield *flying.pop(future), future.result()
    except BrokenExecutor as error:
        raise SimulationError(
            f"the executor lost its workers ({error}); the chunks that are done are kept: call "
            "sweep again with a new executor"
        ) from error
    except PamrsError:
        raise
    except Exception as error:
        if type(error).__module__.partition(".")[0] not in ("distributed", "dask"):
            raise
        raise SimulationError(
            f"dask gave up on a chunk ({type(error).__name__}: {error}); the chunks that are done "
            "are kept: call sweep again"
        ) from error
    finally:
        for future in flying:
            future.cancel()
