"""How far a sweep is, and when it will be done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Final, TextIO

#: Seconds from one line to the next, on a terminal and elsewhere.
_TERMINAL, _FILE = 0.5, 15.0
_MINUTE, _HOUR, _DAY = 60, 3600, 86_400


def duration_words(seconds: float) -> str:
    """A duration in two units at most: ``"2 min 5 s"``.

    Examples
    --------
    >>> duration_words(125.0), duration_words(3.2), duration_words(200000.0)
    ('2 min 5 s', '3 s', '2 d 7 h')
    """
    whole = round(seconds)
    for big, name, small, part in (
        (_DAY, "d", _HOUR, "h"),
        (_HOUR, "h", _MINUTE, "min"),
        (_MINUTE, "min", 1, "s"),
    ):
        if whole >= big:
            return f"{whole // big} {name} {whole % big // small} {part}"
    return f"{whole} s"


class Progress:
    """Lines about a sweep on stderr.

    Parameters
    ----------
    name : str
        Of the store.
    runs, done, ended : int
        Runs in all, those done before, and how many of these ended.
    chunks, chunks_done : int
    shown : bool
        Whether anything is written.
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
        shown: bool = True,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._name, self._runs, self._chunks = name, runs, chunks
        self._before, self._done, self._ended = done, done, ended
        self._chunks_done = chunks_done
        self._stream = (stream or sys.stderr) if shown else None
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
        passed, new = self._clock() - self._began, self._done - self._before
        if not new or passed <= 0.0:
            return said
        said += f", {new / passed:.4g} runs/s"
        if self._done == self._runs:
            return f"{said}, took {duration_words(passed)}"
        return f"{said}, {duration_words(passed * (self._runs - self._done) / new)} left"

    def _write(self, line: str, *, last: bool) -> None:
        if self._stream is not None:
            end = "\n" if last else self._end
            self._stream.write(f"{line:<100}{end}" if self._end == "\r" else f"{line}{end}")
            self._stream.flush()
