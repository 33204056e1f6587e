"""Chunks through an executor: a bounded number in flight, each kept as soon as it is done and
reported as progress.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from itertools import islice
from typing import Any, Final, TextIO

from pamrs._progress import LOG, Line, duration_words
from pamrs.errors import PamrsError, ParameterError, SimulationError
from pamrs.sweeps._drives import Done, Task, run_chunk
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
    """Number of chunks that an executor gets at once."""
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
        Counts each chunk.
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
    here = ((chunk, task, run_chunk(task)) for chunk, task in tasks)
    done = here if executor is None else _there(tasks, executor, most)
    for chunk, task, result in done:
        entry = store.write(chunk, task.values, result)
        progress.add(entry.runs, entry.ended)


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


#: Seconds from one line to the next, on a terminal and elsewhere.
_TERMINAL, _FILE = 0.5, 10.0


class Progress:
    """Lines about a sweep on stderr.

    Parameters
    ----------
    name : str
        Of the store.
    runs, done, ended : int
        Runs in all, those done before, and how many of these ended.
    chunks, chunks_done : int
    shown : bool or callable
        Whether anything is written; what is called with each line instead.
    stream : text stream, optional
        By default stderr.
    clock : callable
        Gives a time [s].
    """

    def __init__(
        self,
        name: str,
        *,
        runs: int,
        chunks: int,
        done: int = 0,
        ended: int = 0,
        chunks_done: int = 0,
        shown: bool | Callable[[str], object] = True,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._name, self._runs, self._chunks = name, runs, chunks
        self._before, self._done, self._ended = done, done, ended
        self._chunks_done = chunks_done
        self._to = shown if callable(shown) else None
        self._stream = (stream or sys.stderr) if shown and self._to is None else None
        self._clock, self._began = clock, clock()
        terminal = self._stream is not None and self._stream.isatty()
        self._every: Final = _TERMINAL if terminal else _FILE
        self._end: Final = "\r" if terminal else "\n"
        self._said = self._began
        if done:
            self._write(f"{self.line()}, going on", last=True)

    def add(self, runs: int, ended: int) -> None:
        """Count a chunk as done."""
        self._done += runs
        self._ended += ended
        self._chunks_done += 1
        now = self._clock()
        last = self._done == self._runs
        if last or now - self._said >= self._every:
            self._said = now
            self._write(self.line(), last=last)

    def line(self) -> str:
        """Progress of the sweep in one line."""
        ended = f" ({self._ended} ended before their end)" if self._ended else ""
        said = (
            f"sweep {self._name}: {self._chunks_done} of {self._chunks} chunks, "
            f"{self._done} of {self._runs} runs{ended}"
        )
        passed, left = self._clock() - self._began, self._left()
        if left is None:
            return said
        said += f", {(self._done - self._before) / passed:.4g} runs/s"
        if self._done == self._runs:
            return f"{said}, took {duration_words(passed)}"
        return f"{said}, {duration_words(left)} left"

    def _left(self) -> float | None:
        """Remaining time [s], by the rate of the runs so far; None before the first."""
        passed, new = self._clock() - self._began, self._done - self._before
        return passed * (self._runs - self._done) / new if new and passed > 0.0 else None

    def _write(self, line: str, *, last: bool) -> None:
        LOG.info("%s", line)
        if self._to is not None:
            self._to(Line(line, self._done / self._runs, self._left()))
        if self._stream is not None:
            end = "\n" if last else self._end
            self._stream.write(f"{line:<100}{end}" if self._end == "\r" else f"{line}{end}")
            self._stream.flush()
