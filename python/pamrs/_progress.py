"""Progress of long work, with the time left: lines of text for a callable, for a notebook, and for
``logging.getLogger("pamrs")``, which is silent unless a program wants to hear it.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

LOG: Final = logging.getLogger("pamrs")
LOG.addHandler(logging.NullHandler())

_MINUTE, _HOUR, _DAY = 60, 3600, 86_400
_LEAST_SHARE: Final = 0.05  # of the work, before which its speed says little
#: Of what is left of a part up to nearly its end, what a line without a share gets.
_UNKNOWN: Final = 0.15
_NEARLY: Final = 0.95


class Line(str):
    """Text on the progress of a work, with the share done and the time left.

    Attributes
    ----------
    share : float or None
        How much of the work is done, from 0 to 1.
    left : float or None
        Time left at its present pace [s].
    part : str
        Of several that are done at the same time, the one that `share` is of; empty for the whole.
    """

    share: float | None
    left: float | None
    part: str

    def __new__(
        cls, text: str, share: float | None = None, left: float | None = None, part: str = ""
    ) -> Line:
        """A line of text with what is known of the work."""
        self = super().__new__(cls, text)
        self.share, self.left, self.part = share, left, part
        return self

    @property
    def whole(self) -> str:
        """Text with percent and time left: ``"42 %, about 9 s left: shoulder: screened"``."""
        if self.share is None:
            return str(self)
        left = "" if self.left is None else f", about {duration_words(self.left)} left"
        return f"{100 * self.share:.0f} %{left}: {self}"


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


class Steps:
    """Progress of a work of unknown length: each step's line is passed on with the share done and
    the time left. Threads may share one.

    Parameters
    ----------
    to : callable, optional
        Gets each :class:`Line`; without one a notebook shows them, and nobody else.
    within : (float, float), optional
        Shares of the work between which its parts are done.
    clock : callable, optional
        Gives a time [s].
    """

    def __init__(
        self,
        to: Callable[[str], object] | None = None,
        *,
        within: tuple[float, float] = (0.0, 1.0),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._to, self._within, self._clock = receiver(to), within, clock
        self._began, self._share = clock(), 0.0
        self._parts: dict[str, float] = {}
        self._lock = threading.Lock()

    def __call__(self, text: str, share: float | None = None) -> None:
        """Pass a line on."""
        with self._lock:
            own = text.share if isinstance(text, Line) else share
            part = text.part if isinstance(text, Line) else ""
            if part:
                done = self._parts.get(part, 0.0)
                more = max(0.0, _NEARLY - done) * _UNKNOWN if own is None else 0.0
                self._parts[part] = max(own or 0.0, done + more)
                low, high = self._within
                own = low + (high - low) * sum(self._parts.values()) / len(self._parts)
            self._share = max(self._share, own or 0.0)
            passed = self._clock() - self._began
            line = Line(text, self._share, _time_left(passed, self._share))
        # outside of the lock, since whoever gets a line may wait for another thread
        LOG.info("%s", line.whole)
        self._to(line)


def _time_left(passed: float, share: float) -> float | None:
    """Time left [s] of a work that took ``passed`` for a share; None at its begin, and near its
    end, where one more law of the rig file may be tried.
    """
    known = _LEAST_SHARE <= share < _NEARLY or share == 1.0
    return passed * (1.0 - share) / share if known else None


@contextmanager
def at_even_times(
    text: str, tell: Callable[[str], object], seconds: float
) -> Iterator[Callable[[str], None]]:
    """Report the progress of a work every so many seconds, whether it says something just then or
    not; gives a function that takes the lines of the work.
    """
    began, said, ended = time.monotonic(), deque([text], maxlen=1), threading.Event()

    def go_on() -> None:
        while not ended.wait(seconds):
            passed, line = time.monotonic() - began, said[-1]
            share = getattr(line, "share", None)
            if share is None:
                tell(f"{line}: {duration_words(passed)} so far")
                continue
            tell(Line(line, share, _time_left(passed, share)).whole)

    thread = threading.Thread(target=go_on, daemon=True)
    thread.start()
    try:
        yield said.append
    finally:
        ended.set()
        thread.join()


def receiver(given: Callable[[str], object] | None) -> Callable[[str], object]:
    """Callable that takes lines: the one given, else the output of a notebook's cell, else one that
    drops them.
    """
    if given is not None:
        return given
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return _in_notebook() if getattr(shell, "kernel", None) is not None else lambda line: None


def _in_notebook() -> Callable[[str], object]:
    """Function that shows lines in a notebook's cell, each replacing the one before."""
    display: Any = sys.modules["IPython"].display.display
    handle: list[Any] = []

    def show(line: str) -> None:
        content = {"text/plain": line.whole if isinstance(line, Line) else line}
        if handle:
            handle[0].update(content, raw=True)
        else:
            handle.append(display(content, raw=True, display_id=True))

    return show
