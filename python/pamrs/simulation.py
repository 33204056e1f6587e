"""Simulation of a rig under a held valve command."""

from __future__ import annotations

import importlib
import math
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

#: Initial values, and the block that each needs.
_INITIAL = {
    "muscle_pressure": "chamber",
    "supply_pressure": "supply",
    "joint_angle": "arm",
    "joint_rate": "arm",
    "length": "load",
    "length_rate": "load",
}
_STABLE = 2.0  # of the 2.78 of RK4 on the negative real axis


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
        Initial ``muscle_pressure``, ``supply_pressure`` [Pa, gauge], ``joint_angle`` [rad], ``joint_rate`` [rad/s], or with a
        linear load ``length`` [m], ``length_rate`` [m/s]. What is left out is at rest: muscle vented, tank at its initial
        pressure, joint at its rest angle, muscle at its rest length.
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
    check_run(rig, sample_time)
    has_valve = rig.model["valve"] is not None
    if valve_command is None:
        if has_valve:
            raise ParameterError("valve_command is missing: a rig with a valve needs one value per sample [V]")
        command = np.zeros(_rows(sample_time, duration, length, pressure))
    else:
        if duration is not None:
            raise ParameterError(f"duration = {duration} is not allowed together with valve_command, which sets it")
        command = held_command(valve_command)
    start: dict[str, Any] = dict(initial_values(initial, rig))
    for name, values, first, channel in _prescribed(rig, length, pressure):
        signal = _signal(name, values, command.size)
        if start.setdefault(first, float(signal[0])) != float(signal[0]):
            raise ParameterError(f"initial {first} = {start[first]:g} does not go with {name}[0] = {signal[0]:g}: leave one out")
        start[channel] = np.ascontiguousarray(signal[1:])
    channels = core_rig(rig).simulate(command, sample_time, chosen_step(sample_time, step, rig), **start)
    time = np.asarray(np.arange(command.size) * sample_time, dtype=np.float64)
    shown = {"valve_command": command} if has_valve else {}
    return Simulation({"time": time, **shown, **channels}, rig)


def check_run(rig: Rig, sample_time: float) -> None:
    """Refuse what is not a rig and a sample time [s] that is not a finite number above zero."""
    if not isinstance(rig, Rig):
        raise ParameterError(f"rig is a {type(rig).__name__}; a Rig is needed, for example pamrs.load_rig({rig!r})")
    if not (np.isfinite(sample_time) and sample_time > 0):
        raise ParameterError(f"sample_time = {sample_time} is not allowed: a finite time > 0 s is needed")


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


def _prescribed(rig: Rig, length: ArrayLike | None, pressure: ArrayLike | None) -> list[tuple[str, ArrayLike, str, str]]:
    """What is prescribed, checked against the rig: (name, values, its initial value, its channel of the core)."""
    given = []
    frame = rig.model["load"] is not None and rig.model["load"]["kind"] == "frame"
    if length is not None:
        if not frame:
            raise ParameterError('length is given, which only a rig with a load frame takes ([load] kind = "frame")')
        low, high = rig.model["load"]["min_length"], rig.model["load"]["max_length"]
        _within("length", length, low, high, "m")
        given.append(("length", length, "length", "lengths"))
    elif frame:
        raise ParameterError("length is missing: a load frame needs one value per sample [m]")
    if pressure is not None:
        if rig.model["valve"] is not None:
            raise ParameterError("pressure is given, which only a rig without [valve] takes: there the valve decides")
        _within("pressure", pressure, 1.0 - rig.model["gas"]["ambient_pressure"], 1e8, "Pa (gauge)")
        given.append(("pressure", pressure, "muscle_pressure", "pressures"))
    return given


def _within(name: str, values: ArrayLike, low: float, high: float, unit: str) -> None:
    """Refuse a prescribed channel that leaves a range; the message gives the row."""
    try:
        signal = np.asarray(values, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is not allowed: numbers are needed [{unit}]") from None
    bad = np.flatnonzero(~((signal >= low) & (signal <= high)))
    if bad.size:
        raise ParameterError(f"{name}[{bad[0]}] = {signal[bad[0]]:g} is not allowed: a number from {low:g} to {high:g} {unit}")


def _signal(name: str, values: ArrayLike, rows: int) -> Array:
    """A prescribed channel with one value for each row."""
    signal = np.asarray(values, dtype=np.float64)
    if signal.shape != (rows,):
        raise ParameterError(f"{name} has the shape {signal.shape}; ({rows},) is needed, one value for each row")
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


def initial_values(initial: Mapping[str, float] | None, rig: Rig) -> dict[str, float]:
    """Initial values by the names of the core; names that the rig does not have are refused."""
    start: dict[str, float] = {}
    for name, value in (initial or {}).items():
        if name not in _INITIAL:
            raise ParameterError(f"initial has the unknown entry {name!r}; allowed: {', '.join(_INITIAL)}")
        if _INITIAL[name] not in rig.blocks:
            raise ParameterError(f"initial has {name!r}, but the rig {rig.name!r} has no [{_INITIAL[name]}]")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise ParameterError(f"initial {name} = {value!r} is not allowed: a number is needed") from None
        start |= {"joint_rate": -number} if name == "length_rate" else {name: number}
    return start


def chosen_step(sample_time: float, step: float | None, rig: Rig) -> float:
    """The RK4 step [s]: the default, or the one given if it is short enough for the rig's stops and friction."""
    if step is None:
        return default_step(sample_time, rig)
    longest = stable_step(rig)
    if step > longest:
        raise ParameterError(
            f"step = {step:g} s is not allowed for the rig {rig.name!r}: at most {longest:.3g} s, "
            "or its stops and friction become unstable"
        )
    return float(step)


def stable_step(rig: Rig) -> float:
    """Longest RK4 step [s] that the stops and the friction of a rig allow; infinite where it has neither arm nor mass."""
    model = rig.model
    if model["arm"] is not None:
        arm, joint = model["arm"], model["joint"]
        inertia = arm["inertia"] + arm["payload"] * arm["length"] ** 2
        stiffness, damping = joint["stop_stiffness"], joint["stop_damping"] + arm["viscous"]
        coulomb = arm["coulomb"] / arm["coulomb_speed"]
    elif model["load"] is not None and model["load"]["kind"] == "mass":
        load = model["load"]
        inertia, stiffness, damping = load["mass"], load["stop_stiffness"], load["stop_damping"] + load["viscous"]
        coulomb = load["coulomb"] / load["coulomb_speed"]
    else:
        return math.inf
    fastest = max((damping + coulomb) / inertia, math.sqrt(stiffness / inertia))
    return _STABLE / fastest if fastest > 0.0 else math.inf


def default_step(sample_time: float, rig: Rig | None = None, longest: float = 1e-3) -> float:
    """The longest step [s] that divides a sample time [s], is at most ``longest`` and short enough for a rig."""
    limit = longest if rig is None else min(longest, stable_step(rig))
    return sample_time / max(1, int(np.ceil(sample_time / limit - 1e-9)))
