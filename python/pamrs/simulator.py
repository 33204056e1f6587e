"""A simulation that goes on sample by sample: for controllers, live loops and restarts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs import _core
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import check_run, chosen_step, core_rig, held_command, initial_values

__all__ = ["Simulator"]

Array = NDArray[np.float64]


class Simulator:
    """A rig that takes one command after the other.

    The command is held exactly over one sample. A simulator can be pickled and copied, and goes on from a state bit for bit as
    the run that it was taken from. It belongs to one thread at a time. A run that Ctrl-C ends stays at a sample in between.

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

    def __init__(self, rig: Rig, *, sample_time: float, step: float | None = None, initial: Mapping[str, float] | None = None) -> None:
        check_run(rig, sample_time)
        self.rig = rig
        self.sample_time = float(sample_time)
        self._step = chosen_step(self.sample_time, step, rig)
        self._initial = initial_values(initial, rig)
        self._has_valve = rig.model["valve"] is not None
        self._core = self._started(self._initial)

    def _started(self, initial: Mapping[str, float]) -> _core.Simulator:
        return _core.Simulator(core_rig(self.rig), self.sample_time, self._step, **initial)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._core.samples * self.sample_time

    @property
    def state(self) -> Array:
        """The numbers that everything to come depends on (a copy); give them back to :meth:`restore`."""
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
        self._core.restore(np.ascontiguousarray(np.asarray(state, dtype=np.float64)))

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
        return self.observe()

    def observe(self) -> dict[str, float]:
        """The present sample: channel -> value in SI units, pressures gauge.

        Returns
        -------
        dict of str to float
        """
        return _single(self._core.observe())

    def step(
        self, valve_command: float | None = None, *, length: float | None = None, pressure: float | None = None
    ) -> dict[str, float]:
        """Hold a command for one sample.

        Parameters
        ----------
        valve_command : float, optional
            Command [V]; needed by a rig with a valve.
        length, pressure : float, optional
            Length [m] that a load frame, and gauge pressure [Pa] that a regulator reaches by the end of the sample; as for
            :func:`pamrs.simulate`.

        Returns
        -------
        dict of str to float
            The sample after it.

        Raises
        ------
        ParameterError
            If the command is missing or not finite.
        SimulationError
            If the state leaves the range in which the model holds; the simulator then stays at the last good sample.
        """
        if valve_command is None:
            if self._has_valve:
                raise ParameterError("valve_command is missing: a rig with a valve needs one value per sample [V]")
            valve_command = 0.0
        given = [None if value is None else np.array([value], dtype=np.float64) for value in (length, pressure)]
        return _single(self._core.advance(np.array([valve_command], dtype=np.float64), *given))

    def run(self, valve_command: ArrayLike, *, length: ArrayLike | None = None, pressure: ArrayLike | None = None) -> dict[str, Array]:
        """Hold one command after the other.

        Parameters
        ----------
        valve_command : array_like, shape (n,)
            Commands [V]; for a rig without a valve only their number counts.
        length, pressure : array_like, shape (n,), optional
            As in :meth:`step`, for the end of each sample.

        Returns
        -------
        dict of str to ndarray
            The n samples after them.

        Raises
        ------
        ParameterError
            If a command is not finite; the message gives its index.
        SimulationError
            As :meth:`step`.
        """
        given = [None if v is None else np.ascontiguousarray(np.asarray(v, dtype=np.float64)) for v in (length, pressure)]
        return self._core.advance(held_command(valve_command), *given)

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if name != "_core"}
        return {**kept, "state": self.state}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        state = kept.pop("state")
        self.__dict__.update(kept)
        self._core = self._started(self._initial)
        self.restore(state)

    def __repr__(self) -> str:
        return f"Simulator({self.rig.name}, time={self.time:.6g} s, sample_time={self.sample_time:g} s)"


def _single(channels: Mapping[str, Array]) -> dict[str, float]:
    return {name: float(values[0]) for name, values in channels.items()}
