"""One run: commands played to a device by the live loop, its recording kept as it comes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._record import Recorder
from pamrs.channels import unit_of
from pamrs.control import Controller
from pamrs.control.live import Clock, Device, LiveError, SystemClock, run_live
from pamrs.control.trajectories import step
from pamrs.diagnosis.next_experiment import measurable
from pamrs.errors import ParameterError
from pamrs.findings import Protocol

_LOST: Final = 0.1  # [s] without a usable reading after which a device is stopped
_RISEN: Final = 5e4  # [Pa] by which a pressure may rise while its valve is to vent
_EMPTY: Final = 2e3  # [Pa] below which a chamber begins empty, and its valve vents all the time
_GAP: Final = 2e4  # [Pa] from which on a valve opens by a quarter before a run


class _Player(Controller):
    """Commands in the order of their times, behind those that bring the rig to rest."""

    answers = "inputs"

    def __init__(self, commands: Commands, protocol: Protocol, period: float) -> None:
        self.command_ranges, self.rest = commands.ranges, commands.rest
        self.period = period
        self.lead = round(commands.bench.settle / period)
        step_time = float(protocol.time[1] - protocol.time[0])
        count = int(float(protocol.time[-1]) / period + 1e-6) + 1
        held = np.minimum(
            (np.arange(count) * period / step_time + 1e-6).astype(int), len(protocol.time) - 1
        )
        own = {name: np.asarray(values)[held] for name, values in protocol.commands.items()}
        self.sent: dict[str, Array] = {
            name: own.get(name, np.full(count, safe)) for name, safe in commands.safe.items()
        }
        self.rows = self.lead + count
        self.begins = commands.begins
        self.recorder: Recorder | None = None
        self.reset()

    def reset(self) -> None:
        """Begin at time zero."""
        self._before: Mapping[str, Any] = {}
        self._last: object = None

    def update(self, time: float, measurement: Any, reference: Any) -> Any:
        """The commands of a sample."""
        k = round(time / self.period) - self.lead
        fresh, self._last = measurement is not self._last, measurement
        if k < 0:
            return self._resting(measurement)
        if self.recorder is not None and fresh:
            self.recorder.due = measurement
        return {name: float(values[k]) for name, values in self.sent.items()}

    def _resting(self, measurement: Mapping[str, float]) -> dict[str, float]:
        """Commands that bring every pressure to where a run begins.

        Raises
        ------
        ParameterError
            If a pressure rises while its valves are commanded to vent.
        """
        self._before, sent = self._before or dict(measurement), dict(self.rest)
        for name, (valves, begin) in self.begins.items():
            now = measurement.get(name, begin)
            gap = -1.0
            if begin > _EMPTY:
                gap = min(max((begin - now) / _GAP, -1.0), 1.0)
                for valve, null in valves.items():
                    _, low, high = self.command_ranges[valve]
                    sent[valve] = min(max(null + gap * (null - self.rest[valve]), low), high)
            then = max(self._before.get(name, 0.0), begin)
            vents = gap < 0.0 and all(sent[valve] < null for valve, null in valves.items())
            if vents and now > then + _RISEN:
                levels = ", ".join(
                    f"{valve} = {sent[valve]:.4g} V, below null_voltage = {null:.4g} V,"
                    for valve, null in valves.items()
                )
                raise ParameterError(
                    f"{levels} vents by the rig file, and {name} rose from {then:.4g} to {now:.4g} "
                    "Pa: the sign of the command is wrong, or the ports of the valve are swapped"
                )
        return sent

    @property
    def state(self) -> dict[str, Any]:
        """Nothing that outlives a sample."""
        return {}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Nothing to go on from."""


@dataclass(frozen=True)
class Played:
    """A run as it went.

    Attributes
    ----------
    reason : str
        As of :class:`pamrs.control.live.LiveRun`.
    seconds : float
        How long it took, what comes before it included [s].
    rows : int
        Rows of its recording.
    """

    reason: str
    seconds: float
    rows: int


def play(device: Device, commands: Commands, protocol: Protocol, path: Path) -> Played:
    """Play the commands of an experiment to a device.

    Parameters
    ----------
    device : Device
        The plant; ``prepare()``, where it has one, is called first, and ``clock`` is its clock.
    commands : Commands
        Commands that the bench accepts.
    protocol : Protocol
        What is played.
    path : Path
        The recording, a file that is not there yet.

    Raises
    ------
    LiveError
        If the device failed, or was lost: the message names it, what it did and what is allowed;
        the safe command was written, unless it says otherwise, and the recording so far is kept.
    KeyboardInterrupt
        At Ctrl-C, after the safe command.
    """
    period = commands.bench.period or float(protocol.time[1] - protocol.time[0])
    player = _Player(commands, protocol, period)
    clock: Clock = getattr(device, "clock", None) or SystemClock()
    getattr(device, "prepare", lambda: None)()
    heard = [name for name in measurable(commands.rig) if name not in commands.ranges]
    recorder = Recorder(device, path, heard, commands.ranges, commands.plausible, clock)
    player.recorder = recorder
    called = getattr(device, "name", type(device).__name__)
    kept = f"{path} keeps what was recorded"
    try:
        run = run_live(
            recorder,
            player,
            step(0.0, 0.0, duration=player.rows * period),
            player.rows * period,
            most_missed=max(5, round(_LOST / period)),
            clock=clock,
        )
    except LiveError as error:
        raise LiveError(f"device = {called}: {error}; {kept}", error.run) from error
    finally:
        recorder.close()
    if run.reason == "interrupted":
        raise KeyboardInterrupt
    if run.reason != "finished":
        why = recorder.trouble or "the machine was too late"
        safe = ", ".join(f"{k} = {v:g} {unit_of(k)}" for k, v in commands.safe.items())
        raise LiveError(
            f"device = {called}: stopped after {len(run.time) * period:.3g} s ({run.reason}): "
            f"{why}; an answer is needed every {period:g} s; the safe command ({safe}) was "
            f"written, {kept}",
            run,
        )
    return Played(run.reason, len(run.time) * period, recorder.rows)
