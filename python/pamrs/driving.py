"""What drives a rig: commands and prescribed channels from a user's arguments to the names of the core, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.channels import channel_of, dotted
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from pamrs.rig import Rig

__all__ = ["Signals", "has_frame", "initial_values", "regulators_of", "sensor_zero", "signals_of"]

Array = NDArray[np.float64]
#: One array for a block without a name or the only one of its kind, else one for each name.
Signals = ArrayLike | Mapping[str, ArrayLike]

#: State that an initial value can be given for, and the block whose name stands behind it.
_INITIAL = {
    "muscle_pressure": "chamber",
    "supply_pressure": "supply",
    "line_pressure": "line",
    "joint_angle": "joint",
    "joint_rate": "joint",
    "length": "load",
    "length_rate": "load",
}
_LEAST_PRESSURE = 1.0  # Pa, absolute
_MOST_PRESSURE = 1e8  # Pa, gauge


def signals_of(
    rig: Rig,
    *,
    valve_command: Signals | None = None,
    supply_command: Signals | None = None,
    length: ArrayLike | None = None,
    pressure: Signals | None = None,
    rows: int | None = None,
) -> tuple[dict[str, Array], int | None]:
    """Every signal that a rig takes, by the core's names, and how many values each has.

    Parameters
    ----------
    rig : Rig
        The model.
    valve_command : array_like, shape (n,), or mapping of str to array_like, optional
        Commands [V] of each valve by its name.
    supply_command : array_like, shape (n,), or mapping of str to array_like, optional
        Set pressures [Pa, gauge] of regulators.
    length : array_like, shape (n,), optional
        What a load frame prescribes [m].
    pressure : array_like, shape (n,), or mapping of str to array_like, optional
        Pressures [Pa, gauge] that are held in chambers without a valve.
    rows : int, optional
        How many values there must be; numbers are taken as signals that stay.

    Returns
    -------
    signals : dict of str to ndarray, shape (n,)
    n : int or None
        None where nothing was given.

    Raises
    ------
    ParameterError
        If a signal is missing, not taken by the rig, of another length or outside its range; the message names it.
    """
    valves, regulators = rig.tables("valve"), regulators_of(rig)
    given = {
        **_named("valve_command", valve_command, list(valves), "valve"),
        **_named("supply_command", supply_command, regulators, "supply of kind regulator"),
        **({} if length is None else {"length": length}),
        **_named("pressure", pressure, list(rig.tables("chamber")), "chamber"),
    }
    for name in valves:
        if dotted("valve_command", name) not in given:
            raise ParameterError(f"{dotted('valve_command', name)} is missing: a rig with a valve needs one value per sample [V]")
    _check_prescribed(rig, given)
    sizes = {name: np.size(values) for name, values in given.items() if np.ndim(values) > 0}
    count = rows if rows is not None else (next(iter(sizes.values())) if sizes else None)
    signals = {}
    for name, values in given.items():
        signals[name] = _signal(name, values, count, rig)
        count = signals[name].size
    return signals, count


def initial_values(initial: Mapping[str, float] | None, rig: Rig) -> dict[str, float]:
    """Initial values by the names of the core; names that the rig does not have are refused."""
    start: dict[str, float] = {}
    for name, value in (initial or {}).items():
        channel, _, block = name.partition(".")
        if channel not in _INITIAL:
            raise ParameterError(f"initial has the unknown entry {name!r}; allowed: {', '.join(_INITIAL)}")
        tables = rig.tables(_INITIAL[channel])
        if not tables:
            raise ParameterError(f"initial has {name!r}, but the rig {rig.name!r} has no [{_INITIAL[channel]}]")
        if block not in tables:
            raise ParameterError(
                f"initial has {name!r}; the rig {rig.name!r} has: {', '.join(dotted(channel, other) for other in tables)}"
            )
        try:
            start[name] = float(value)
        except (TypeError, ValueError):
            raise ParameterError(f"initial {name} = {value!r} is not allowed: a number is needed") from None
    return start


def has_frame(rig: Rig) -> bool:
    """Whether a load frame prescribes the length."""
    return any(load["kind"] == "frame" for load in rig.tables("load").values())


def regulators_of(rig: Rig) -> list[str]:
    """Names of the supplies that are regulators."""
    return [name for name, table in rig.tables("supply").items() if table["kind"] == "regulator"]


def sensor_zero(rig: Rig, key: str, block: str) -> float:
    """Zero (``pressure_zero``, ``angle_zero``) of a block's sensor: its own, or the common one."""
    sensors = rig.tables("sensors")
    return float(sensors.get(block, sensors.get("", {})).get(key, 0.0))


def _named(channel: str, given: Signals | None, names: list[str], block: str) -> dict[str, ArrayLike]:
    """A user's argument as signals by the core's names."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        if len(names) > 1:
            raise ParameterError(
                f"{channel} is one signal, and the rig has a {block} each of: {', '.join(names)}; give a mapping of names"
            )
        return {dotted(channel, names[0] if names else ""): given}
    if set(given) == {""} and len(names) == 1:
        return {dotted(channel, names[0]): given[""]}  # the only one is meant
    for name in given:
        if name not in names:
            raise ParameterError(
                f"{channel} has {name!r}, and the rig has no {block} of that name; it has: {', '.join(names) or 'none'}"
            )
    return {dotted(channel, name): values for name, values in given.items()}


def _check_prescribed(rig: Rig, given: Mapping[str, ArrayLike]) -> None:
    """What may be prescribed follows from the blocks."""
    frame = has_frame(rig)
    if frame and "length" not in given:
        raise ParameterError("length is missing: a load frame needs one value per sample [m]")
    if not frame and "length" in given:
        raise ParameterError('length is given, which only a rig with a load frame takes ([load] kind = "frame")')
    fed = {valve["to"].partition(".")[2] for valve in rig.ports("valve").values() if valve["to"].startswith("chamber")}
    for name in given:
        channel, _, chamber = name.partition(".")
        if channel == "pressure" and chamber in fed:
            raise ParameterError(f"{name} is given, which only a rig without [valve] takes: there the valve decides")
        if channel == "supply_command" and not regulators_of(rig):
            raise ParameterError('supply_command is given, which only a supply takes that is a regulator ([supply] kind = "regulator")')


def _signal(name: str, values: ArrayLike, rows: int | None, rig: Rig) -> Array:
    """One signal as a checked array; a number stays the same in every row."""
    try:
        signal = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is not allowed: numbers are needed") from None
    if signal.ndim == 0 and rows is not None:
        signal = np.full(rows, float(signal))
    if signal.ndim != 1 or signal.size == 0 or (rows is not None and signal.size != rows):
        needed = "(n,) with n >= 1" if rows is None else f"({rows},)"
        raise ParameterError(f"{name} has the shape {signal.shape}; {needed} is needed, one value for each row")
    low, high, allowed = _range(name, rig)
    bad = np.flatnonzero(~((signal >= low) & (signal <= high) & np.isfinite(signal)))
    if bad.size:
        raise ParameterError(f"{name}[{bad[0]}] = {signal[bad[0]]:g} is not allowed: {allowed}")
    return np.ascontiguousarray(signal)


def _range(name: str, rig: Rig) -> tuple[float, float, str]:
    """Lowest and highest value of a signal, and the words for it."""
    channel = channel_of(name)
    if channel == "valve_command":
        return -np.inf, np.inf, "a finite voltage is needed"
    if channel == "length":
        load = rig.tables("load")[""]
        low, high, unit = load["min_length"], load["max_length"], "m"
    else:
        low, high, unit = _LEAST_PRESSURE - rig.tables("gas")[""]["ambient_pressure"], _MOST_PRESSURE, "Pa (gauge)"
    return low, high, f"a number from {low:g} to {high:g} {unit}"
