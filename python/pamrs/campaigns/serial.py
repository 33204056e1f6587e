"""A board at a serial port (Arduino, ESP32), by lines of text.

Every line ends with ``*`` and two hexadecimal digits, the exclusive or of all bytes before them;
every question has a number, which its answer repeats, so that a late answer is told from the right
one. All values are in SI units. ::

    1 ? *2E                             which commands and channels there are
    1 pamrs valve_command > time muscle_pressure joint_angle *..
    2 W 5.25 *..                        hold these commands, in that order
    2 OK *..                            or: 2 E what is not allowed
    3 R *..                             the channels now, in that order
    3 12.345678 301325 0.5236 *..

A board writes its safe command by itself when no line came for half a second: that is what stops
the rig when the cable is pulled. ``examples/pamrs_board.ino`` is such a board.
"""

from __future__ import annotations

import math
import os
import select
import time as _time
from collections.abc import Mapping
from functools import reduce
from typing import Any, Final

from pamrs._checks import positive, refused
from pamrs.errors import ParameterError

__all__ = ["SerialDevice", "checked", "signed"]

_HELLO: Final = "pamrs"
_AGAIN: Final = 0.3  # [s] until a board that did not answer is greeted again
_MOST: Final = 4096  # bytes of a line


def signed(line: str) -> str:
    """A line with its checksum."""
    return f"{line} *{reduce(lambda a, b: a ^ b, line.encode(), 0):02X}"


def checked(line: str) -> list[str]:
    """The words of a line whose checksum is right; none of another one."""
    words, _, _ = line.rpartition(" *")
    return words.split() if words and signed(words) == line else []


class SerialDevice:
    """A board behind ``read()`` and ``write(command)``, for :func:`pamrs.campaign` and
    :func:`pamrs.control.live.run_live`.

    Parameters
    ----------
    port : path-like
        ``/dev/ttyACM0``, ``/dev/ttyUSB0``.
    baud : int
        Bits per second; a period of 5 ms takes 500000 or more.
    timeout : float
        How long an answer is waited for [s].
    patience : float
        How long a board may take to start [s]; opening its port resets many.

    Attributes
    ----------
    name : str
        The port.
    commands, channels : tuple of str
        What the board takes and tells.

    Raises
    ------
    OSError
        If the port is not there, or nothing at it answers as such a board does.
    ParameterError
        If the rate is none of the port's.
    """

    def __init__(
        self,
        port: str | os.PathLike[str],
        *,
        baud: int = 115200,
        timeout: float = 0.05,
        patience: float = 4.0,
    ) -> None:
        self.name, self._timeout = os.fspath(port), positive("timeout", timeout)
        self._number, self._rest = 0, b""
        self._port = os.open(self.name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            _raw(self._port, baud)
            taken, channels = self._greet(positive("patience", patience))
        except BaseException:
            self.close()
            raise
        self.commands, self.channels = tuple(taken), tuple(channels)

    def read(self) -> Mapping[str, float]:
        """The channels now [SI]."""
        values = [float(word) for word in self._ask("R")]
        if len(values) != len(self.channels):
            raise OSError(f"{self.name}: {len(values)} values came, for {', '.join(self.channels)}")
        return dict(zip(self.channels, values, strict=True))

    def write(self, command: Any) -> None:
        """Hold a command from now on.

        Parameters
        ----------
        command : float or mapping of str to float
            Of every command of the board its value [SI].

        Raises
        ------
        ParameterError
            If it has not the commands of the board, or one is not finite.
        OSError
            If the board refuses it, or does not answer.
        """
        given = command if isinstance(command, Mapping) else {self.commands[0]: command}
        if set(given) != set(self.commands) or not all(map(math.isfinite, given.values())):
            needed = f"a finite number for each of {', '.join(self.commands)} is needed"
            raise refused("command", command, f"{needed} by {self.name}")
        answer = self._ask("W " + " ".join(f"{given[name]:.7g}" for name in self.commands))
        if answer != ["OK"]:
            raise OSError(f"{self.name}: the board refused {given}: {' '.join(answer[1:])}")

    def close(self) -> None:
        """Let the port go."""
        os.close(self._port)

    def _greet(self, patience: float) -> tuple[list[str], list[str]]:
        """Commands and channels of the board."""
        end = _time.monotonic() + patience
        while _time.monotonic() < end:
            try:
                answer = self._ask("?", _AGAIN)
            except TimeoutError:
                continue
            if answer[:1] == [_HELLO] and ">" in answer[2:-1]:
                at = answer.index(">")
                return answer[1:at], answer[at + 1 :]
            raise OSError(f"{self.name}: answered {' '.join(answer)!r}: no board of this protocol")
        raise TimeoutError(
            f"{self.name}: nothing answered for {patience:g} s; a board with "
            "examples/pamrs_board.ino is needed, at the same --baud"
        )

    def _ask(self, words: str, timeout: float | None = None) -> list[str]:
        """The answer to a question; what came late of an earlier one is passed over."""
        self._number += 1
        line = (signed(f"{self._number} {words}") + "\n").encode()
        end = _time.monotonic() + (timeout or self._timeout)
        self._send(line, end)
        while True:
            line, newline, rest = self._rest.partition(b"\n")
            if newline:
                self._rest = rest
                found = checked(line.decode("ascii", "replace").strip())
                if found[:1] == [str(self._number)]:
                    return found[1:]
                continue
            left = end - _time.monotonic()
            if left <= 0.0 or not select.select([self._port], [], [], left)[0]:
                raise TimeoutError(f"{self.name}: no answer within {timeout or self._timeout:g} s")
            came = os.read(self._port, _MOST)
            if not came:
                raise OSError(f"{self.name}: the port is gone")
            self._rest = (self._rest + came)[-_MOST:]

    def _send(self, line: bytes, end: float) -> None:
        """Write a line whole."""
        while line:
            left = max(end - _time.monotonic(), 0.0)
            if not select.select([], [self._port], [], left)[1]:
                raise TimeoutError(f"{self.name}: does not take what is sent")
            line = line[os.write(self._port, line) :]


def _raw(port: int, baud: int) -> None:
    """Bytes as they are, at a rate."""
    try:
        import termios
    except ImportError:  # Windows
        raise ParameterError(
            "a serial port is not allowed here: Linux or macOS is needed"
        ) from None
    rate = getattr(termios, f"B{baud}", None)
    if rate is None:
        rates = sorted(int(n[1:]) for n in dir(termios) if n[0] == "B" and n[1:].isdigit())
        raise refused("baud", baud, f"one of {', '.join(map(str, rates[1:]))} is needed")
    settings = termios.tcgetattr(port)
    control = termios.CS8 | termios.CREAD | termios.CLOCAL
    settings[:6] = [0, 0, control, 0, rate, rate]
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, 0
    termios.tcsetattr(port, termios.TCSANOW, settings)
    termios.tcflush(port, termios.TCIOFLUSH)
