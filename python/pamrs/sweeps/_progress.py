"""How far a sweep is, and when it will be done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Final, TextIO

from pamrs._progress import LOG, Line, duration_words

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
        """A chunk more is done."""
        self._done += runs
        self._ended += ended
        self._chunks_done += 1
        now = self._clock()
        last = self._done == self._runs
        if last or now - self._said >= self._every:
            self._said = now
            self._write(self.line(), last=last)

    def line(self) -> str:
        """How far it is, in one line."""
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
        """How long it will go on [s]; None where nothing is done yet."""
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
