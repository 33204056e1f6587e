"""Signals that end a program, as exceptions: a live loop must write its safe command first."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any, Final, NoReturn, Self

_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class Termination:
    """While it is open, Ctrl-C is a KeyboardInterrupt, and SIGTERM, SIGHUP and SIGBREAK are
    ``SystemExit(128 + number)``.

    An exception is raised once at most and only while :attr:`armed`, so that none can come between
    the loop and its safe command; what comes later is kept in :attr:`late`. Handlers that the
    program has set, or that ignore a signal (``nohup``), stay. Outside the main thread nothing is
    done: signals do not reach it.

    Attributes
    ----------
    armed : bool
        Whether a signal may raise now.
    late : int or None
        The last signal that did not raise.
    """

    def __init__(self) -> None:
        self.armed = False
        self.late: int | None = None
        self._old: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
                if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                    self._old[number] = signal.signal(number, self._came)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._old.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raise for a signal that came while it was not armed."""
        if self.late is not None:
            number, self.late = self.late, None
            self._raise(number)

    def _came(self, number: int, frame: FrameType | None) -> None:
        if not self.armed:
            self.late = number
            return
        self.armed = False
        self._raise(number)

    @staticmethod
    def _raise(number: int) -> NoReturn:
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)
