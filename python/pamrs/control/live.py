"""Controllers on a live loop: anything that can be read and written, with a safe stop whatever
happens.

Before the first reading the safe command is written. The controller is called for every period of
its own clock, as if it were in a simulation: a tick that brought no usable reading, or that the
machine was too late for, is answered with the last good reading, and **its answer is not written**:
the plant keeps the last command. A reading that took longer than a period, or one whose answer did,
is not usable either: the plant has moved on. So filters and integrals keep their time, and nothing
new is commanded on what was not seen.
"""

from __future__ import annotations

import math
import signal
import threading
import time as _time
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import FrameType
from typing import Any, Final, Protocol, Self

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import rising, whole
from pamrs.control._live_commands import Command, LiveCommands
from pamrs.control._loop import trajectories_of
from pamrs.control._protocol import Controller, Reference, check_controller
from pamrs.control.trajectories import JointTrajectories, Trajectory, check_reach
from pamrs.errors import PamrsError, ParameterError
from pamrs.simulation import whole_samples

__all__ = ["Clock", "Device", "LiveError", "LiveRun", "SystemClock", "run_live"]


_SAFE_ATTEMPTS: Final = 3


class LiveError(PamrsError, RuntimeError):
    """The safe command could not be written, or the device or the controller failed; the plant may
    need a hand.

    Attributes
    ----------
    run : LiveRun or None
        What was recorded until then; its reason is ``"failed"`` where something failed before the
        end.
    """

    def __init__(self, message: str, run: LiveRun | None = None) -> None:
        super().__init__(message)
        self.run = run


class Device(Protocol):
    """A plant as a live loop sees it.

    Both calls must come back, or raise, within a fraction of the controller's period: give the
    driver its timeouts. While one hangs nobody can write, as a driver is seldom safe to use from a
    second thread; what a call that hung brings is not acted on, and the safe command follows as
    soon as it is back. That the valve closes when its program hangs, is killed (SIGKILL) or loses
    its power is the device's own task: a watchdog in its firmware, or a valve that rests where it
    is safe.
    """

    def read(self) -> Mapping[str, float] | None:
        """The channels now in SI units; None, an exception or a value that is not finite count as a
        missed reading.
        """

    def write(self, command: Any) -> None:
        """Hold a command from now on: a number where the controller has one command (volts of a
        valve), else a mapping with a number for each by its name, ``{"valve_command.flexor": 5.0,
        "valve_command.extensor": 5.0}``; all of them, always.
        """


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
    """A live loop as it went; arrays have one row for each period of the controller, to the end or
    the stop.

    Attributes
    ----------
    reason : {"finished", "lost_sensor", "overrun", "interrupted", "failed"}
        Why it ended; overrun if too many periods in a row were left out as the machine, or ``read``
        and ``write``, were too slow: a longer period helps (5 to 10 ms on an ordinary operating
        system). Interrupted by Ctrl-C, failed in :attr:`LiveError.run` only.
    time : ndarray, shape (rows,)
        Nominal time of each period [s].
    reference : ndarray, shape (rows,)
        Reference angle [rad]; of several joints (joints, rows).
    command : ndarray, shape (rows,), or mapping of str to ndarray
        What the plant was commanded to hold; of several commands each by its name.
    channels : mapping of str to ndarray, shape (rows,)
        What was read; NaN where nothing was.
    late : ndarray, shape (rows,)
        By how much each period was begun after its time [s]; NaN for those that were left out.
    missed : int
        Periods without a usable reading, those left out by overruns not counted.
    overruns : int
        Periods left out because the loop came more than a period late.
    safe_command : float or dict of str to float
        What was written at the end.
    stall : float
        Largest lateness of all, periods that were left out included [s].
    """

    reason: str
    time: Array
    reference: Array
    command: Any
    channels: Mapping[str, Array] = field(repr=False)
    late: Array = field(repr=False)
    missed: int
    overruns: int
    safe_command: Any
    stall: float

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
    trajectory: Trajectory | Mapping[str, Trajectory] | JointTrajectories,
    duration: float | None = None,
    *,
    safe: Command | None = None,
    limits: tuple[float, float] | Mapping[str, tuple[float, float]] | None = None,
    most_missed: int = 5,
    stamp: str | None = None,
    plausible: Mapping[str, tuple[float, float]] | None = None,
    clock: Clock | None = None,
) -> LiveRun:
    """Let a controller follow a trajectory with a live device.

    The safe command is written before the first reading, at the end, at a lost sensor, at Ctrl-C
    and before any exception goes on. In the main thread SIGTERM, SIGHUP and SIGBREAK are such
    exceptions while the loop runs, ``SystemExit(128 + number)``, unless the program handles or
    ignores them itself. For what no program can answer see :class:`Device`.

    Parameters
    ----------
    device : Device
        Anything with ``read()`` and ``write(command)``.
    controller : Controller
        For one plant; it is reset first. It answers what the device takes: volts of a valve, or
        every command of a rig, as a :class:`pamrs.control.RigController` does. One that answers a
        pressure belongs in a :class:`pamrs.control.Cascade`.
    trajectory : Trajectory, JointTrajectories, or mapping of str to Trajectory
        Of several joints one for each name.
    duration : float, optional
        [s], a multiple of the controller's period; the trajectory's by default.
    safe : float or mapping of str to float, optional
        The command that is safe, one for all or each by its name, ``valve_command.flexor``. By
        default 5 V, which closes the valve and keeps the air (0 V vents the muscle, and the arm
        comes down); of a :class:`pamrs.control.RigController` the null of every valve of its rig,
        and 0 Pa of a regulator, as nothing else is sure to be had: the arm comes down.
    limits : (float, float) or mapping of str to (float, float), optional
        Commands are kept within; the safe ones too. By default 0 to 10 V; of a
        :class:`pamrs.control.RigController` the range of every valve, and of a regulator 0 to the
        model's pressure limit.
    most_missed : int
        Readings missed in a row that are borne; one more is a lost sensor. Periods left out by an
        overrun count too.
    stamp : str, optional
        Channel that rises with every new reading, a time or a counter: one that does not rise is
        stale, and counts as missed. By default ``time``, if the first reading has it.
    plausible : mapping of str to (float, float), optional
        Channel -> lowest and highest value [SI] that can be: a reading outside, or without the
        channel, counts as missed.
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
        If ``write`` or the controller failed, the clock went back, or the controller answered what
        is not a finite number; the cause is chained, the record so far is :attr:`LiveError.run`.
        The safe command was written, unless the message says that it could not be.
    """
    loop = _Loop(
        device,
        controller,
        trajectory,
        duration,
        safe,
        limits,
        most_missed,
        stamp,
        plausible,
        clock or SystemClock(),
    )
    reason, failed = "failed", None
    with Termination() as termination:
        try:
            reason = loop.run(termination)
        except BaseException as error:  # SystemExit too goes on only after the safe command
            failed = error
        unsafe = loop.stop()
    if isinstance(failed, KeyboardInterrupt) or (
        failed is None and termination.late == signal.SIGINT
    ):
        reason, failed = "interrupted", None
    if isinstance(failed, Exception):
        text = f"the live loop failed at {loop.k * loop.period:g} s: {failed}{unsafe}"
        raise LiveError(text, loop.result(reason)) from failed
    if failed is None and termination.late not in (None, signal.SIGINT):
        failed = SystemExit(128 + termination.late)
    if failed is not None:
        if unsafe:
            failed.add_note(f"the live loop ended{unsafe}")
        raise failed
    if unsafe:
        raise LiveError(f"the live loop ended ({reason}){unsafe}", loop.result(reason))
    return loop.result(reason)


class _Loop:
    """A live loop at work."""

    def __init__(
        self,
        device: Device,
        controller: Controller,
        trajectory: Trajectory | Mapping[str, Trajectory] | JointTrajectories,
        duration: float | None,
        safe: Command | None,
        limits: Any,
        most_missed: int,
        stamp: str | None,
        plausible: Mapping[str, tuple[float, float]] | None,
        clock: Clock,
    ) -> None:
        check_controller(controller)
        self.commands = LiveCommands(controller, safe, limits)
        whole("most_missed", most_missed)
        self.device, self.controller, self.clock = device, controller, clock
        self.trajectory = trajectories_of(trajectory, controller)
        self.most_missed, self.stamp = most_missed, stamp
        self.plausible = {
            name: rising(f"plausible[{name}]", values) for name, values in (plausible or {}).items()
        }
        self.period = controller.period
        self.total = whole_samples(
            "duration",
            self.trajectory.duration if duration is None else duration,
            self.period,
            least=1,
        )
        by_length = getattr(controller, "tracked", ()) == ("length",)
        lengths = getattr(controller, "lengths", None) if by_length else None
        check_reach(self.trajectory, self.total * self.period, lengths)
        self.k = 0
        self.held = self.commands.safe
        self.last: Mapping[str, float] | None = None
        self.seen = -math.inf
        self.missed = self.in_a_row = self.overruns = 0
        self.stall = 0.0
        self.rows: list[
            tuple[float, Any, Mapping[str, float], float, Mapping[str, float] | None]
        ] = []

    def run(self, termination: Termination) -> str:
        """Run to the end, or until the sensor is lost; only in here a signal may raise."""
        termination.armed = True
        try:
            return self._run()
        finally:
            termination.armed = False

    def _run(self) -> str:
        self.controller.reset()
        # until something is seen the plant holds what is safe, not what was left on it
        self.device.write(self.commands.written(self.commands.safe))
        begin = self.clock.now()
        while self.k < self.total:
            late = self._wait(begin + self.k * self.period)
            self.stall = max(self.stall, late)
            for _ in range(min(math.floor(late / self.period), self.total - self.k)):
                self.overruns += 1
                self._without_reading(math.nan)
                late -= self.period
                if self.in_a_row > self.most_missed:
                    return "overrun"
            if self.k == self.total:
                break
            begun = self.clock.now()
            reading = self._read()
            if reading is None or self.clock.now() - begun > self.period:
                self.missed += 1
                self._without_reading(late)
            else:
                self._with_reading(reading, begun, late)
            if self.in_a_row > self.most_missed:
                return "lost_sensor"
        # the last command is held for its period too, as every other
        self._wait(begin + self.total * self.period)
        return "finished"

    def _wait(self, due: float) -> float:
        """Wait for a time; return the lateness [s]."""
        ahead = due - self.clock.now()
        if 0.0 < ahead < 2.0 * self.period:
            self.clock.sleep(ahead)
        late = self.clock.now() - due
        # after a tick that was on time a period is waited, never two
        if late < -2.0 * self.period:
            raise ParameterError(
                f"the clock went back, to {-late:.4g} s before the next sample: one that never "
                "does is needed"
            )
        return late

    def _wanted(self) -> Reference:
        return self.trajectory(self.k * self.period)

    def _with_reading(self, reading: Mapping[str, float], begun: float, late: float) -> None:
        """A period with a usable reading; its answer is written unless it took too long."""
        self.last, wanted = reading, self._wanted()
        answer = self.controller.update(self.k * self.period, reading, wanted)
        held = self.commands.kept(answer)
        if self.clock.now() - begun > self.period:
            self.missed += 1
            self.in_a_row += 1
            self._note(wanted, late, None)
            return
        self.in_a_row, self.held = 0, held
        self.device.write(self.commands.written(held))
        self._note(wanted, late, reading)

    def _without_reading(self, late: float) -> None:
        """Run a period with the last reading for the controller, the last command for the plant."""
        self.in_a_row += 1
        wanted = self._wanted()
        if self.last is not None:
            self.controller.update(self.k * self.period, self.last, wanted)
        self._note(wanted, late, None)

    def _note(self, wanted: Reference, late: float, reading: Mapping[str, float] | None) -> None:
        self.rows.append((self.k * self.period, wanted.angle, self.held, late, reading))
        self.k += 1

    def _read(self) -> Mapping[str, float] | None:
        """A usable reading, or None."""
        try:
            given = self.device.read()
            reading = (
                None if given is None else {name: float(value) for name, value in given.items()}
            )
        except Exception:  # whatever a driver raises, the arm has to be held
            return None
        if not reading or not all(map(math.isfinite, reading.values())):
            return None
        if self.last is not None and not self.last.keys() <= reading.keys():
            return None  # a channel that was there is gone
        if any(
            not low <= reading.get(name, math.nan) <= high
            for name, (low, high) in self.plausible.items()
        ):
            return None
        if self.stamp is None:
            self.stamp = "time" if "time" in reading else ""
        if self.stamp:
            if not reading.get(self.stamp, -math.inf) > self.seen:
                return None
            self.seen = reading[self.stamp]
        return reading

    def stop(self) -> str:
        """Write the safe command; words for the message if that was not possible."""
        why, safe = "", self.commands.written(self.commands.safe)
        for _ in range(_SAFE_ATTEMPTS):
            try:
                # a fresh one each time: a driver may use up what it is given, and fail half way
                self.device.write(self.commands.written(self.commands.safe))
            except BaseException as error:  # a second Ctrl-C must not keep the valve open
                why = (
                    f"; and the safe command {safe:g} could not be written: "
                    if self.commands.single
                    else f"; and the safe commands {safe} could not be written: "
                ) + f"{type(error).__name__} {error}"
            else:
                return ""
        return why

    def result(self, reason: str) -> LiveRun:
        """Record of the loop up to now, with the reason for its end."""
        when, late = (np.array([row[i] for row in self.rows], dtype=np.float64) for i in (0, 3))
        wanted = np.array([row[1] for row in self.rows], dtype=np.float64)
        held = {
            name: np.array([row[2][name] for row in self.rows], dtype=np.float64)
            for name in self.commands.names
        }
        names = dict.fromkeys(name for row in self.rows for name in (row[4] or ()))
        channels = {
            n: np.array([math.nan if r[4] is None else r[4].get(n, math.nan) for r in self.rows])
            for n in names
        }
        return LiveRun(
            reason,
            when,
            wanted.T,
            self.commands.written(held),
            channels,
            late,
            self.missed,
            self.overruns,
            self.commands.written(self.commands.safe),
            self.stall,
        )


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

    def _came(self, number: int, frame: FrameType | None) -> None:
        if not self.armed:
            self.late = number
            return
        self.armed = False
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)
