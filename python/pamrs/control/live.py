"""Controllers on a live loop: anything that can be read and written, with a safe stop whatever happens.

The controller is called for every period of its own clock, as if it were in a simulation: a tick that brought no usable reading, or
that the machine was too late for, is answered with the last good reading, and **its answer is not written**: the plant keeps the last
command. So filters and integrals keep their time, and nothing new is commanded on what was not seen.
"""

from __future__ import annotations

import math
import time as _time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from pamrs.control.protocol import Controller
from pamrs.control.trajectories import Trajectory
from pamrs.errors import PamrsError, ParameterError

__all__ = ["Clock", "Device", "LiveError", "LiveRun", "SystemClock", "run_live"]

Array = NDArray[np.float64]

_SAFE_ATTEMPTS: Final = 3


class LiveError(PamrsError, RuntimeError):
    """The safe command could not be written, or the device or the controller failed; the plant may need a hand."""


class Device(Protocol):
    """A plant as a live loop sees it."""

    def read(self) -> Mapping[str, float] | None:
        """The channels now in SI units; None, an exception or a value that is not finite count as a missed reading."""

    def write(self, command: float) -> None:
        """Hold a command from now on."""


class Clock(Protocol):
    """Time as a live loop sees it."""

    def now(self) -> float:
        """Seconds since some moment; never goes back."""

    def sleep(self, seconds: float) -> None:
        """Wait."""


class SystemClock:
    """The machine's monotonic clock."""

    def now(self) -> float:
        """Seconds since some moment."""
        return _time.perf_counter()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        _time.sleep(seconds)


@dataclass(frozen=True)
class LiveRun:
    """A live loop as it went; arrays have one row for each period of the controller, to the end or the stop.

    Attributes
    ----------
    reason : {"finished", "lost_sensor", "interrupted"}
        Why it ended; interrupted by Ctrl-C.
    time : ndarray, shape (rows,)
        Nominal time of each period [s].
    reference, command : ndarray, shape (rows,)
        Reference angle [rad] and what the plant was told to hold.
    channels : mapping of str to ndarray, shape (rows,)
        What was read; NaN where nothing was.
    late : ndarray, shape (rows,)
        By how much each period was begun after its time [s]; NaN for those that were left out.
    missed : int
        Periods without a usable reading, those left out by overruns not counted.
    overruns : int
        Periods left out because the loop came more than a period late.
    safe_command : float
        What was written at the end.
    """

    reason: str
    time: Array
    reference: Array
    command: Array
    channels: Mapping[str, Array] = field(repr=False)
    late: Array = field(repr=False)
    missed: int
    overruns: int
    safe_command: float

    @property
    def jitter(self) -> float:
        """Standard deviation of the lateness [s]; NaN without a row."""
        seen = self.late[np.isfinite(self.late)]
        return float(seen.std()) if seen.size else math.nan

    @property
    def latest(self) -> float:
        """Largest lateness [s]; NaN without a row."""
        seen = self.late[np.isfinite(self.late)]
        return float(seen.max()) if seen.size else math.nan


def run_live(
    device: Device,
    controller: Controller,
    trajectory: Trajectory,
    duration: float | None = None,
    *,
    safe: float = 5.0,
    limits: tuple[float, float] = (0.0, 10.0),
    most_missed: int = 5,
    stamp: str | None = None,
    clock: Clock | None = None,
) -> LiveRun:
    """Let a controller follow a trajectory with a live device.

    The safe command is written at the end, at a lost sensor, at Ctrl-C and before any exception goes on.

    Parameters
    ----------
    device : Device
        Anything with ``read()`` and ``write(command)``.
    controller : Controller
        For one plant; it is reset first.
    trajectory : Trajectory
    duration : float, optional
        [s], a multiple of the controller's period; the trajectory's by default.
    safe : float
        The command that is safe: 5 V closes the valve and keeps the air, 0 V vents the muscle, and the arm comes down.
    limits : (float, float)
        Commands are kept within; the safe one too.
    most_missed : int
        Readings missed in a row that are borne; one more is a lost sensor. Periods left out by an overrun count too.
    stamp : str, optional
        Channel that rises with every new reading, a time or a counter: one that does not rise is stale, and counts as missed.
    clock : Clock, optional
        The machine's by default.

    Returns
    -------
    LiveRun
        Also after a lost sensor or Ctrl-C: :attr:`LiveRun.reason` says so.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    LiveError
        If ``write`` or the controller failed, or the controller answered what is not a finite number; the cause is chained. The safe
        command was written, unless the message says that it could not be.
    """
    loop = _Loop(device, controller, trajectory, duration, safe, limits, most_missed, stamp, clock or SystemClock())
    reason, failed = "", None
    try:
        reason = loop.run()
    except KeyboardInterrupt:
        reason = "interrupted"
    except Exception as error:
        failed = error
    finally:
        # also on the way out of what is no Exception, SystemExit for example
        unsafe = loop.stop()
    if failed is not None:
        raise LiveError(f"the live loop failed at {loop.k * loop.period:g} s: {failed}{unsafe}") from failed
    if unsafe:
        raise LiveError(f"the live loop ended ({reason}){unsafe}")
    return loop.result(reason)


class _Loop:
    """A live loop at work."""

    def __init__(
        self,
        device: Device,
        controller: Controller,
        trajectory: Trajectory,
        duration: float | None,
        safe: float,
        limits: tuple[float, float],
        most_missed: int,
        stamp: str | None,
        clock: Clock,
    ) -> None:
        from pamrs.control.loop import multiple

        low, high = limits
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ParameterError(f"limits = {limits} is not allowed: two rising finite numbers are needed")
        if not low <= safe <= high:
            raise ParameterError(f"safe = {safe} is not allowed: from {low:g} to {high:g} is needed")
        if isinstance(most_missed, bool) or not isinstance(most_missed, int) or most_missed < 0:
            raise ParameterError(f"most_missed = {most_missed!r} is not allowed: a whole number from 0 on is needed")
        self.device, self.controller, self.trajectory, self.clock = device, controller, trajectory, clock
        self.safe, self.low, self.high, self.most_missed, self.stamp = float(safe), low, high, most_missed, stamp
        self.period = controller.period
        self.total = multiple("duration", trajectory.duration if duration is None else duration, self.period)
        self.k = 0
        self.held = self.safe
        self.last: Mapping[str, float] | None = None
        self.seen = -math.inf
        self.missed = self.in_a_row = self.overruns = 0
        self.rows: list[tuple[float, float, float, Mapping[str, float] | None]] = []

    def run(self) -> str:
        """To the end or until the sensor is lost."""
        self.controller.reset()
        begin = self.clock.now()
        while self.k < self.total:
            due = begin + self.k * self.period
            ahead = due - self.clock.now()
            if ahead > 0.0:
                self.clock.sleep(ahead)
            late = self.clock.now() - due
            for _ in range(min(math.floor(late / self.period), self.total - self.k)):
                self.overruns += 1
                self._without_reading(math.nan)
                late -= self.period
                if self.in_a_row > self.most_missed:
                    return "lost_sensor"
            if self.k == self.total:
                break
            reading = self._read()
            if reading is None:
                self.missed += 1
                self._without_reading(late)
                if self.in_a_row > self.most_missed:
                    return "lost_sensor"
            else:
                self.in_a_row, self.last = 0, reading
                command = float(self._asked(reading))
                if not math.isfinite(command):
                    raise ParameterError(f"the controller's command is {command}: a finite number is needed")
                self.held = min(max(command, self.low), self.high)
                self.device.write(self.held)
                self._note(late, reading)
        # the last command is held for its period too, as every other
        ahead = begin + self.total * self.period - self.clock.now()
        if ahead > 0.0:
            self.clock.sleep(ahead)
        return "finished"

    def _asked(self, reading: Mapping[str, float]) -> Any:
        now = self.k * self.period
        return self.controller.update(now, reading, self.trajectory(now))

    def _without_reading(self, late: float) -> None:
        """A period that the controller lives through with the last reading, and the plant with the last command."""
        self.in_a_row += 1
        if self.last is not None:
            self._asked(self.last)
        self._note(late, None)

    def _note(self, late: float, reading: Mapping[str, float] | None) -> None:
        self.rows.append((self.k * self.period, self.held, late, reading))
        self.k += 1

    def _read(self) -> Mapping[str, float] | None:
        """A usable reading, or None."""
        try:
            given = self.device.read()
            reading = None if given is None else {name: float(value) for name, value in given.items()}
        except Exception:  # whatever a driver raises, the arm has to be held
            return None
        if not reading or not all(map(math.isfinite, reading.values())):
            return None
        if self.stamp is not None:
            if not reading.get(self.stamp, -math.inf) > self.seen:
                return None
            self.seen = reading[self.stamp]
        return reading

    def stop(self) -> str:
        """Write the safe command; words for the message if that was not possible."""
        why = ""
        for _ in range(_SAFE_ATTEMPTS):
            try:
                self.device.write(self.safe)
            except BaseException as error:  # a second Ctrl-C must not keep the valve open
                why = f"; and the safe command {self.safe:g} could not be written: {type(error).__name__} {error}"
            else:
                return ""
        return why

    def result(self, reason: str) -> LiveRun:
        """What happened."""
        when, command, late = (np.array([row[i] for row in self.rows], dtype=np.float64) for i in range(3))
        names = dict.fromkeys(name for row in self.rows for name in (row[3] or ()))
        channels = {n: np.array([math.nan if r[3] is None else r[3].get(n, math.nan) for r in self.rows]) for n in names}
        wanted = np.asarray(self.trajectory(when).angle, dtype=np.float64)
        return LiveRun(reason, when, wanted, command, channels, late, self.missed, self.overruns, self.safe)
