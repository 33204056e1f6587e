"""A simulation that goes on sample by sample: for controllers, live loops and restarts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, quantities
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation._driving import (
    Signals,
    by_signal,
    initial_values,
    inputs_of,
    keywords,
    signals_of,
)
from pamrs.simulation._simulation import (
    MOST_STATE,
    Event,
    Simulation,
    check_rows,
    check_run,
    chosen_step,
    core_rig,
    loop_samples,
)


class Simulator:
    """A rig that takes one command after the other.

    The command is held exactly over one sample. A simulator can be pickled and copied, and goes on
    from a state bit for bit as the run that it was taken from. It belongs to one thread at a time.
    A run that Ctrl-C ends stays at a sample in between.

    Parameters
    ----------
    rig : Rig
        The model.
    sample_time : float
        Time between two samples [s].
    step : float, optional
        RK4 step [s]; divides ``sample_time``. By default the longest that does and is at most 1 ms.
    initial : mapping of str to float, optional
        Initial values as for :func:`pamrs.simulate`.

    Raises
    ------
    ParameterError
        If an argument is not finite or outside its range; the message names it.

    Examples
    --------
    >>> import pamrs
    >>> simulator = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.005)
    >>> for _ in range(100):
    ...     sample = simulator.step(6.0)
    >>> round(simulator.time, 3), sample["joint_angle"] > 0.27
    (0.5, True)
    """

    @quantities
    def __init__(
        self,
        rig: Rig,
        *,
        sample_time: float,
        step: float | None = None,
        initial: Mapping[str, float] | None = None,
    ) -> None:
        check_run(rig, sample_time)
        self.rig = rig
        self.sample_time = float(sample_time)
        self._step = chosen_step(self.sample_time, step)
        self._initial = initial_values(initial, rig)
        self._inputs = inputs_of(rig)
        self.events: list[Event] = []
        """Events since the start or the last :meth:`reset` or :meth:`restore`, see
        :class:`pamrs.simulation.Event`."""
        self._core = self._started(self._initial)

    def _started(self, initial: Mapping[str, float]) -> _core.Simulator:
        return _core.Simulator(core_rig(self.rig), self.sample_time, self._step, dict(initial))

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._core.samples * self.sample_time

    @property
    def state(self) -> Array:
        """The numbers that everything to come depends on (a copy); give them back to
        :meth:`restore`.
        """
        return self._core.state

    def restore(self, state: ArrayLike) -> None:
        """Go on from a state.

        Parameters
        ----------
        state : array_like
            :attr:`state` of a simulator of the same rig.

        Raises
        ------
        ParameterError
            If it has another length or a number that is not finite.
        """
        numbers = as_numbers("state", state, MOST_STATE)
        self._core.restore(np.ascontiguousarray(numbers.reshape(-1)))
        self.events = []

    @quantities
    def reset(self, initial: Mapping[str, float] | None = None) -> dict[str, float]:
        """Begin again.

        Parameters
        ----------
        initial : mapping of str to float, optional
            Other initial values; those of the last start by default.

        Returns
        -------
        dict of str to float
            The first sample.
        """
        start = self._initial if initial is None else initial_values(initial, self.rig)
        self._core, self._initial = self._started(start), start
        self.events = []
        return self.observe()

    def observe(self) -> dict[str, float]:
        """The present sample: channel -> value in SI units, pressures gauge.

        Returns
        -------
        dict of str to float
        """
        return self._core.observe()

    def step(
        self,
        valve_command: float | Mapping[str, float] | None = None,
        *,
        supply_command: float | Mapping[str, float] | None = None,
        length: float | None = None,
        pressure: float | Mapping[str, float] | None = None,
        supply_pressure: float | Mapping[str, float] | None = None,
    ) -> dict[str, float]:
        """Hold a command for one sample.

        Parameters
        ----------
        valve_command : float or mapping of str to float, optional
            Command [V]; needed by a rig with a valve, of several one for each name.
        supply_command : float or mapping of str to float, optional
            Set pressure of a regulator [Pa, gauge].
        length, pressure, supply_pressure : float, optional
            Length [m] that a load frame, and gauge pressure [Pa] that a chamber without a valve or
            a measured supply reaches by the end of the sample; as for :func:`pamrs.simulate`.

        Returns
        -------
        dict of str to float
            The sample after it.

        Raises
        ------
        ParameterError
            If the command is missing or not finite.
        SimulationError
            If the state leaves the range in which the model holds; the simulator then stays at the
            last good sample.
        """
        done = None
        if supply_command is length is pressure is supply_pressure is None:
            done = self._core.step(valve_command)
        if done is None:
            asked = by_signal(valve_command, supply_command, length, pressure, supply_pressure)
            done = self._held(asked)
        sample, events = done
        if events:
            self.events += [Event(*event) for event in events]
        return sample

    @quantities
    def _held(self, asked: dict[str, Any]) -> Any:
        """A sample of commands that are more than one number, and what happened in it."""
        return self._core.hold(1, self._inputs.numbers(asked))

    @quantities
    def run(
        self,
        valve_command: Signals | None = None,
        *,
        samples: int | None = None,
        supply_command: Signals | None = None,
        length: ArrayLike | None = None,
        pressure: Signals | None = None,
        supply_pressure: Signals | None = None,
    ) -> dict[str, Array]:
        """Hold one command after the other.

        Parameters
        ----------
        valve_command : array_like, shape (n,), or mapping of str to array_like, optional
            Commands [V].
        samples : int, optional
            How many, where no signal says it.
        supply_command, length, pressure, supply_pressure : array_like, shape (n,), optional
            Or a mapping; as in :meth:`step`, for each sample.

        Returns
        -------
        dict of str to ndarray
            The n samples after them.

        Raises
        ------
        ParameterError
            If a command is missing or not finite; the message gives its index.
        SimulationError
            As :meth:`step`.
        """
        self._check_rows(samples or 0)
        asked = by_signal(valve_command, supply_command, length, pressure, supply_pressure)
        signals, count = signals_of(self.rig, asked, samples)
        if count is None:
            raise ParameterError("samples is missing: no signal says how many there are")
        self._check_rows(count)
        return self._advance(count, signals)

    def _check_rows(self, rows: int) -> None:
        """Refuse rows of all channels that would not fit in memory."""
        check_rows(len(core_rig(self.rig).channels), rows)

    @quantities
    def control(
        self,
        update: Callable[
            [dict[str, float]], float | Mapping[str, float] | Mapping[str, Mapping[str, float]]
        ],
        duration: float,
        *,
        period: float | None = None,
    ) -> Simulation:
        """Close the loop with a sampled controller.

        The controller sees the present sample every ``period`` and what it answers is held exactly
        until the next; the rows in between are simulated at the sample time.

        Parameters
        ----------
        update : callable
            Takes the sample (channel -> value in SI units, and ``time`` [s]); returns the valve
            command [V], of several valves a mapping of names, or a mapping of the keywords of
            :meth:`step`.
        duration : float
            How long [s].
        period : float, optional
            Time between two updates [s], a multiple of the sample time; the sample time by default.

        Returns
        -------
        Simulation
            The present sample and all that follow, with the commands that were held from each.

        Raises
        ------
        ParameterError
            If the period is not a multiple of the sample time, or the controller answers what
            :meth:`step` refuses.
        SimulationError
            As :meth:`step`.
        """
        every, total = loop_samples(update, self.sample_time, period, duration)
        self._check_rows(total + 1)
        sample, began, happened = self.observe(), self.time, len(self.events)
        rows = np.empty((len(sample), total + 1))
        rows[:, 0] = list(sample.values())
        channels = dict(zip(sample, rows, strict=True))
        held: dict[str, Array] = {}
        for k in range(0, total, every):
            count = min(every, total - k)
            numbers = self._inputs.numbers(keywords(update({"time": self.time, **sample})))
            sample, events = self._core.hold(count, numbers, rows, k + 1)
            if events:
                self.events += [Event(*event) for event in events]
            for name, value in numbers.items():
                if name not in held:
                    held[name] = np.full(total + 1, np.nan)
                # what was held from the last row is what it would go on with
                held[name][k : k + count + 1] = value
        inputs = {name: values for name, values in held.items() if name not in channels}
        time = np.asarray(began + np.arange(total + 1) * self.sample_time, dtype=np.float64)
        return Simulation({"time": time, **inputs, **channels}, self.rig, self.events[happened:])

    def _advance(self, count: int, signals: dict[str, Array]) -> dict[str, Array]:
        channels, events = self._core.advance(count, signals)
        self.events += [Event(*event) for event in events]
        return channels

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if name != "_core"}
        return {**kept, "events": list(self.events), "state": self.state}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        state, events = kept.pop("state"), kept.pop("events")
        self.__dict__.update(kept)
        self._core = self._started(self._initial)
        self.restore(state)
        self.events = list(events)

    def __repr__(self) -> str:
        return (
            f"Simulator({self.rig.name}, time={self.time:.6g} s, sample_time={self.sample_time:g} "
            "s)"
        )
