"""Simulation of a rig under a held valve command."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs import _core
from pamrs.errors import ParameterError
from pamrs.rig import Rig

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Simulation", "core_rig", "simulate"]

Array = NDArray[np.float64]

_INITIAL = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate", "length")


class Simulation(Mapping[str, Array]):
    """Simulated channels by name, SI, gauge pressures; ``time`` [s] is a channel too.

    ``result["muscle_pressure"]`` is an array with one row per sample; ``result.time`` is ``result["time"]``.
    """

    def __init__(self, channels: Mapping[str, Array], rig: Rig) -> None:
        self._channels = dict(channels)
        self.rig = rig

    @property
    def time(self) -> Array:
        """Time of each row [s]."""
        return self._channels["time"]

    def __getitem__(self, channel: str) -> Array:
        try:
            return self._channels[channel]
        except KeyError:
            raise KeyError(f"no channel {channel!r}; there are: {', '.join(self._channels)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def to_pandas(self) -> pd.DataFrame:
        """All channels as a table indexed by time [s]."""
        import pandas as pd

        columns = {name: values for name, values in self._channels.items() if name != "time"}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time"))

    def plot(self, path: str | os.PathLike[str], *, recorded: Mapping[str, tuple[Array, Array]] | None = None) -> Path:
        """Write a picture of the channels over time, a PNG.

        Parameters
        ----------
        path : path-like
            The file.
        recorded : mapping of str to (time, value), optional
            Recorded channels to draw beside them [s, SI].

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ImportError
            If matplotlib is missing; names the extra to install.
        """
        from pamrs.writing import write_atomically

        return write_atomically(path, _motion().channels_png(self, recorded))

    def animate(self, path: str | os.PathLike[str], *, speed: float = 1.0) -> Path:
        """Write the arm as it moves, an animated GIF.

        Parameters
        ----------
        path : path-like
            The file.
        speed : float
            Times faster than it happens.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ImportError
            If matplotlib is missing; names the extra to install.
        ParameterError
            If the rig has no arm, there are fewer than two samples, or the speed is not a finite number above zero.
        """
        written: Path = _motion().write_animation(self, Path(path), speed=speed)
        return written

    def __repr__(self) -> str:
        return f"Simulation({self.rig.name}: {self.time.size} rows of {', '.join(self._channels)})"


def _motion() -> ModuleType:
    """The module that draws; an ImportError names the extra where matplotlib is missing."""
    try:
        return importlib.import_module("pamrs.report.motion")
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install 'pamrs[plot]'") from error


def core_rig(rig: Rig) -> _core.Rig:
    """The compiled rig of a description, kept with it so that a second simulation costs no compilation."""
    cached: Any = rig.__dict__.get("_compiled")
    if cached is None:
        cached = _core.Rig(rig.to_json())
        object.__setattr__(rig, "_compiled", cached)
    compiled: _core.Rig = cached
    return compiled


def simulate(
    rig: Rig,
    valve_command: ArrayLike | None = None,
    *,
    sample_time: float,
    step: float | None = None,
    initial: Mapping[str, float] | None = None,
    duration: float | None = None,
    length: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
) -> Simulation:
    """Simulate a rig from an initial state by fixed-step RK4.

    Parameters
    ----------
    rig : Rig
        The model.
    valve_command : array_like, shape (n,), optional
        Command [V]; entry ``k`` is held over ``[k, k + 1)`` samples. Needed by a rig with a valve.
    sample_time : float
        Time between rows [s].
    step : float, optional
        RK4 step [s]; divides ``sample_time``. By default the longest that does and is at most 1 ms.
    initial : mapping of str to float, optional
        Initial ``muscle_pressure``, ``supply_pressure`` [Pa, gauge], ``joint_angle`` [rad], ``joint_rate`` [rad/s], or
        ``length`` [m] with a linear load. What is left out is at rest: muscle vented, tank at its initial pressure, joint at
        its rest angle, muscle at its rest length.
    duration : float, optional
        Simulated time [s] of a rig without a valve, instead of ``valve_command``.
    length : array_like, shape (n,), optional
        Length of the muscle at each row [m], straight lines between: what a load frame (``[load] kind = "frame"``) prescribes.
    pressure : array_like, shape (n,), optional
        Gauge pressure in the muscle at each row [Pa], as a regulator holds it, for a rig without a valve.

    Returns
    -------
    Simulation
        n rows at ``k * sample_time``; the first one is the initial state.

    Raises
    ------
    ParameterError
        If an argument is not finite or outside its range; the message names it.
    SimulationError
        If the state leaves the range in which the model holds.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> rig = pamrs.rigs.shoulder()
    >>> result = pamrs.simulate(rig, valve_command=np.full(201, 6.0), sample_time=0.005)
    >>> bool(result["joint_angle"][-1] > result["joint_angle"][0])
    True
    """
    if not isinstance(rig, Rig):
        raise ParameterError(f"rig is a {type(rig).__name__}; a Rig is needed, for example pamrs.load_rig({rig!r})")
    if not (np.isfinite(sample_time) and sample_time > 0):
        raise ParameterError(f"sample_time = {sample_time} is not allowed: a finite time > 0 s is needed")
    has_valve = rig.model["valve"] is not None
    if valve_command is None:
        if has_valve:
            raise ParameterError("valve_command is missing: a rig with a valve needs one value per sample [V]")
        command = np.zeros(_rows(sample_time, duration, length, pressure))
    else:
        if duration is not None:
            raise ParameterError(f"duration = {duration} is not allowed together with valve_command, which sets it")
        command = held_command(valve_command)
    fine = default_step(sample_time) if step is None else step
    start: dict[str, Any] = dict(initial_values(initial))
    prescribed = (("length", length, "length", "lengths"), ("pressure", pressure, "muscle_pressure", "pressures"))
    for name, values, first, channel in prescribed:
        if values is not None:
            signal = _signal(name, values, command.size)
            start |= {first: float(signal[0]), channel: np.ascontiguousarray(signal[1:])}
    channels = core_rig(rig).simulate(command, sample_time, fine, **start)
    time = np.asarray(np.arange(command.size) * sample_time, dtype=np.float64)
    shown = {"valve_command": command} if has_valve else {}
    return Simulation({"time": time, **shown, **channels}, rig)


def _rows(sample_time: float, duration: float | None, *signals: ArrayLike | None) -> int:
    """Number of rows without a valve command: that of what is prescribed, or of the duration."""
    given = [np.asarray(signal) for signal in signals if signal is not None]
    if given:
        if duration is not None:
            raise ParameterError(f"duration = {duration} is not allowed together with length or pressure, which set it")
        return max(int(given[0].size), 1)
    if duration is None or not (np.isfinite(duration) and duration >= 0):
        raise ParameterError(f"duration = {duration} is not allowed: a finite time >= 0 s (or give valve_command)")
    return round(duration / sample_time) + 1


def _signal(name: str, values: ArrayLike, rows: int) -> Array:
    """A prescribed channel, one finite value for each row."""
    signal = np.asarray(values, dtype=np.float64)
    if signal.shape != (rows,):
        raise ParameterError(f"{name} has the shape {signal.shape}; ({rows},) is needed, one value for each row")
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        raise ParameterError(f"{name}[{bad[0]}] = {signal[bad[0]]} is not allowed: a finite number is needed")
    return signal


def held_command(valve_command: ArrayLike) -> NDArray[np.float64]:
    """Commands [V] as an array (n,), n >= 1, checked; ParameterError names the first that is not finite."""
    command = np.ascontiguousarray(np.asarray(valve_command, dtype=np.float64))
    if command.ndim != 1 or command.size == 0:
        raise ParameterError(f"valve_command has the shape {command.shape}; (n,) with n >= 1 is needed")
    bad = np.flatnonzero(~np.isfinite(command))
    if bad.size:
        raise ParameterError(f"valve_command[{bad[0]}] = {command[bad[0]]} is not allowed: a finite voltage is needed")
    return command


def initial_values(initial: Mapping[str, float] | None) -> dict[str, float]:
    """Initial values by name, unknown names refused."""
    start = dict(initial or {})
    unknown = sorted(set(start) - set(_INITIAL))
    if unknown:
        raise ParameterError(f"initial has the unknown entry {unknown[0]!r}; allowed: {', '.join(_INITIAL)}")
    return {name: float(value) for name, value in start.items()}


def default_step(sample_time: float, longest: float = 1e-3) -> float:
    """The longest step [s] up to ``longest`` that divides a sample time [s]."""
    return sample_time / max(1, int(np.ceil(sample_time / longest - 1e-9)))
