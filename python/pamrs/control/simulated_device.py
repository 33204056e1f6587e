"""A rig that behaves like hardware on a bus: it goes on between readings, readings fail, and time
is not even. For rehearsals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from pamrs._checks import checked_number, positive, refused
from pamrs.channels import channel_of, dotted
from pamrs.control._groups import direct_regulators
from pamrs.control._protocol import commands_of, keywords_of
from pamrs.control.live import Clock
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Simulator, core_rig

__all__ = ["FAULTS", "SimulatedDevice", "VirtualClock"]

#: Ways in which a reading fails.
FAULTS: Final = ("exception", "none", "nan", "stale")


class VirtualClock:
    """A clock that only moves when somebody waits, a little late each time; a minute of a loop
    takes no longer than its arithmetic.

    Parameters
    ----------
    jitter : float
        Mean lateness of a wait [s], exponentially distributed.
    stalls : mapping of float to float
        Time -> how long the machine then stands still [s], once.
    seed : int
        Of the lateness.

    Raises
    ------
    ParameterError
        If a time is negative or not finite.
    """

    def __init__(
        self, jitter: float = 0.0, *, stalls: Mapping[float, float] | None = None, seed: int = 0
    ) -> None:
        for pair in (stalls or {}).items():
            for value in pair:
                positive("stalls", value, zero=True)
        self._jitter, self._time = positive("jitter", jitter, zero=True), 0.0
        self._stalls = sorted((stalls or {}).items())
        self._random = np.random.default_rng(seed)

    def now(self) -> float:
        """Seconds since the clock was made."""
        return self._time

    def sleep(self, seconds: float) -> None:
        """Move on, a little too far."""
        late = float(self._random.exponential(self._jitter)) if self._jitter > 0.0 else 0.0
        self._time += max(seconds, 0.0) + late
        while self._stalls and self._time >= self._stalls[0][0]:
            self._time += self._stalls.pop(0)[1]


class SimulatedDevice:
    """A rig behind ``read()`` and ``write(command)``; it moves with its clock, whatever the loop
    does.

    A rig with one valve, or one regulator without a valve, takes a number; one with several a
    mapping of all of them by their names, ``{"valve_command.flexor": 5.0,
    "valve_command.extensor": 5.0}``. Until something is written valves are at their null, and
    regulators hold what they begin with. A regulator that feeds a valve goes on holding that unless
    a mapping has it too.

    Parameters
    ----------
    rig : Rig
        The plant.
    clock : Clock
        Shared with the loop.
    sample_time : float
        Resolution in time [s]: readings and commands act at its multiples.
    dropouts : float
        Probability that a reading fails, from 0 to 1.
    faults : sequence of str
        Some of :data:`FAULTS`, equally often.
    lost_from : float
        Time from which every reading fails [s].
    seed : int
        Of the failures.
    initial : mapping of str to float, optional
        As for :func:`pamrs.simulate`.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    """

    def __init__(
        self,
        rig: Rig,
        clock: Clock,
        *,
        sample_time: float = 1e-3,
        dropouts: float = 0.0,
        faults: tuple[str, ...] = FAULTS,
        lost_from: float = math.inf,
        seed: int = 0,
        initial: Mapping[str, float] | None = None,
    ) -> None:
        checked_number("dropouts", dropouts, 0.0, 1.0)
        if not faults or any(fault not in FAULTS for fault in faults):
            raise refused("faults", faults, f"some of {', '.join(FAULTS)}")
        self._held = _at_first(rig)
        self._needed = _needed(rig, self._held)
        self.simulator = Simulator(rig, sample_time=sample_time, initial=initial)
        self.clock = clock
        self.written: list[tuple[float, Any]] = []
        """Time [s] and value of every command that was written."""
        self._began = clock.now()
        self._dropouts, self._faults, self._lost_from = dropouts, faults, lost_from
        self._random = np.random.default_rng(seed)
        self._last = self._sample()

    def read(self) -> Mapping[str, float] | None:
        """The channels now, with the plant's own ``time`` [s]; or a failure."""
        self._advance()
        lost = self.clock.now() - self._began >= self._lost_from
        if lost or self._random.random() < self._dropouts:
            fault = self._faults[int(self._random.integers(len(self._faults)))]
            if fault == "exception":
                raise OSError("the sensor did not answer")
            if fault == "nan":
                return {**self._sample(), "joint_angle": math.nan}
            return None if fault == "none" else self._last
        self._last = self._sample()
        return self._last

    @property
    def command(self) -> Any:
        """Command that is held: a number for a single one, else a mapping by name; regulators that
        feed a valve are left out until they are written.
        """
        held = {name: self._held[name] for name in self._needed}
        return next(iter(held.values())) if len(held) == 1 else held

    def write(self, command: float | Mapping[str, float]) -> None:
        """Hold a command from now on.

        Parameters
        ----------
        command : float or mapping of str to float
            [V] of a valve, [Pa] of a regulator.

        Raises
        ------
        ParameterError
            If it has not the commands of the rig.
        """
        needed = self._needed
        if isinstance(command, Mapping):
            given = dict(commands_of(command))
        else:
            given = dict.fromkeys(needed, command) if len(needed) == 1 else {}
        if not set(needed) <= set(given) <= set(self._held):
            raise refused("command", command, f"a number for each of {', '.join(needed)} is needed")
        self._advance()
        self._held |= {name: float(value) for name, value in given.items()}
        self.written.append((self.clock.now() - self._began, self.command))

    def _sample(self) -> dict[str, float]:
        return {"time": self.simulator.time, **self.simulator.observe()}

    def _advance(self) -> None:
        """Let the plant live until now."""
        behind = round(
            (self.clock.now() - self._began - self.simulator.time) / self.simulator.sample_time
        )
        if behind > 0:
            signals = {name: np.full(behind, value) for name, value in self._held.items()}
            self.simulator.run(**keywords_of(signals))


def _at_first(rig: Rig) -> dict[str, float]:
    """Value of every command of a rig before anything is written."""
    found = {}
    for name in core_rig(rig).inputs:
        kind, block = channel_of(name), name.partition(".")[2]
        if kind == "valve_command":
            found[name] = float(rig.tables("valve")[block]["null_voltage"])
        elif kind == "supply_command":
            found[name] = float(rig.tables("supply")[block]["initial_pressure"])
    if not found:
        raise ParameterError(
            f"rig {rig.name!r} is not allowed: it has no valve and no regulator, and one at least "
            "is needed"
        )
    return found


def _needed(rig: Rig, held: Mapping[str, float]) -> tuple[str, ...]:
    """Commands that every write has: all but those of regulators that feed valves."""
    direct = {dotted("supply_command", name) for name in direct_regulators(rig)}
    return tuple(n for n in held if channel_of(n) == "valve_command" or n in direct)
