"""Inputs of a rig: commands and prescribed channels from a user's arguments to the names of the
core, checked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, by_hand, doubt_pascals, misshapen, one_of, refused
from pamrs.channels import channel_of, dotted, unit_of
from pamrs.errors import ParameterError, meant
from pamrs.rig import Rig
from pamrs.simulation._plants import rowwise

#: One array for a block without a name or the only one of its kind, else one for each name.
Signals = ArrayLike | Mapping[str, ArrayLike]

#: What a rig can be driven by, in the order in which it is recorded.
SIGNALS = ("valve_command", "supply_command", "length", "pressure", "supply_pressure")
#: State that an initial value can be given for, and the block whose name comes after it.
_INITIAL = {
    "muscle_pressure": "chamber",
    "supply_pressure": "supply",
    "line_pressure": "line",
    "segment_pressure": "line",
    "segment_flow": "line",
    "joint_angle": "joint",
    "joint_rate": "joint",
    "length": "load",
    "length_rate": "load",
    "temperature": "chamber",
}
#: States along a tube that carries waves, and how many there are less than segments.
_BETWEEN = {"segment_pressure": 1, "segment_flow": 0}
_LEAST_ABSOLUTE_PRESSURE = 1.0  # Pa, absolute
_MOST_PRESSURE = 1e8  # Pa, gauge


def by_signal(*given: Any) -> dict[str, Any]:
    """A user's arguments by :data:`SIGNALS`, in their order."""
    return dict(zip(SIGNALS, given, strict=True))


def signals_of(
    rig: Rig, asked: Mapping[str, Signals | None], rows: int | None = None
) -> tuple[dict[str, Array], int | None]:
    """Every signal that a rig takes, by the core's names, and how many values each has.

    Parameters
    ----------
    rig : Rig
        The model.
    asked : mapping of str to array_like, shape (n,), or to a mapping of str to array_like
        A user's arguments by :data:`SIGNALS`, None for those that are left out: commands [V] of
        valves, set pressures [Pa, gauge] of regulators, the length [m] that a load frame
        prescribes, and pressures [Pa, gauge] that are held in chambers without a valve and that
        measured supplies had.
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
        If a signal is missing, not taken by the rig, of another length or outside its range; the
        message names it.
    """
    inputs = inputs_of(rig)
    given = inputs.named(asked)
    sizes = {name: max(np.shape(values)) for name, values in given.items() if np.ndim(values) > 0}
    count = rows if rows is not None else (next(iter(sizes.values())) if sizes else None)
    signals = {}
    for name, values in given.items():
        signals[name] = _signal(name, values, count, inputs.range(name))
        count = signals[name].size
    return signals, count


class Inputs:
    """Signals that a rig takes, looked up once: for loops that ask at every sample.

    Parameters
    ----------
    rig : Rig
        The model.
    """

    def __init__(self, rig: Rig) -> None:
        self._names = {
            "valve_command": (list(rig.tables("valve")), "valve"),
            "supply_command": (supplies_of(rig, "regulator"), "supply of kind regulator"),
            "pressure": (list(rig.tables("chamber")), "chamber"),
            "supply_pressure": (supplies_of(rig, "measured"), "supply of kind measured"),
        }
        self._valves = [dotted("valve_command", name) for name in self._names["valve_command"][0]]
        self._frame = has_frame(rig)
        self._fed = {
            valve["to"].partition(".")[2]
            for valve in rig.ports("valve").values()
            if valve["to"].startswith("chamber")
        }
        self._ranges: dict[str, tuple[float, float, str]] = {}
        self._load = rig.tables("load").get("", {})
        self._ambient = float(rig.tables("gas")[""]["ambient_pressure"])
        # One valve and nothing else that must be given: what most loops answer.
        self._only = self._valves[0] if len(self._valves) == 1 and not self._frame else None

    @property
    def names(self) -> list[str]:
        """Every signal that can be given."""
        found = [*self._valves, *(["length"] if self._frame else [])]
        found += [dotted("supply_command", name) for name in self._names["supply_command"][0]]
        chambers = [name for name in self._names["pressure"][0] if name not in self._fed]
        found += [dotted("pressure", name) for name in chambers]
        sources = self._names["supply_pressure"][0]
        return found + [dotted("supply_pressure", name) for name in sources]

    def named(self, asked: Mapping[str, Any]) -> dict[str, ArrayLike]:
        """A user's arguments by the core's names, as they were given; arguments and errors as of
        :func:`signals_of`.
        """
        for name in asked:
            one_of("the name of a signal", name, SIGNALS)
        given: dict[str, ArrayLike] = {}
        for channel in SIGNALS:
            signal = asked.get(channel)
            if channel == "length" and signal is not None:
                given["length"] = signal
            elif signal is not None:
                given |= _named(channel, signal, *self._names[channel])
        for name in self._valves:
            if name not in given:
                raise ParameterError(
                    f"{name} is missing: a rig with a valve needs one value per sample [V]"
                )
        self._check_prescribed(given)
        return given

    def numbers(self, asked: Mapping[str, Any]) -> dict[str, float]:
        """Commands of one sample, checked, by the core's names; arguments and errors as of
        :func:`signals_of`.
        """
        if self._only is not None and len(asked) == 1:
            volts = asked.get("valve_command")
            if isinstance(volts, float) and math.isfinite(volts):
                return {self._only: volts}
        numbers: dict[str, float] = {}
        for name, value in self.named(asked).items():
            low, high, allowed = self.range(name)
            if isinstance(value, float) and low <= value <= high and math.isfinite(value):
                numbers[name] = value
            else:
                numbers[name] = float(_signal(name, value, 1, (low, high, allowed))[0])
        return numbers

    def rows(self, rows: int, asked: Mapping[str, Any]) -> dict[str, Array]:
        """Commands of one sample of several plants, one number for each; ranges are not checked."""
        given = self.named(asked).items()
        return {name: rowwise(name, values, rows, finite=False) for name, values in given}

    def range(self, name: str) -> tuple[float, float, str]:
        """Lowest and highest value of a signal, and the words for it."""
        if name not in self._ranges:
            self._ranges[name] = self._found_range(name)
        return self._ranges[name]

    def _found_range(self, name: str) -> tuple[float, float, str]:
        channel = channel_of(name)
        if channel == "valve_command":
            return -np.inf, np.inf, "a finite voltage is needed"
        if channel == "length":
            low, high, unit = self._load["min_length"], self._load["max_length"], "m"
        else:
            low, high, unit = _LEAST_ABSOLUTE_PRESSURE - self._ambient, _MOST_PRESSURE, "Pa (gauge)"
        return low, high, f"a number from {low:g} to {high:g} {unit}"

    def _check_prescribed(self, given: Mapping[str, ArrayLike]) -> None:
        """Refuse prescribed channels that contradict the blocks, and a frame without a length."""
        if self._frame and "length" not in given:
            raise ParameterError("length is missing: a load frame needs one value per sample [m]")
        if not self._frame and "length" in given:
            raise ParameterError(
                'length is given, which only a rig with a load frame takes ([load] kind = "frame")'
            )
        for name in given:
            channel, _, chamber = name.partition(".")
            if channel == "pressure" and chamber in self._fed:
                raise ParameterError(
                    f"{name} is given, which only a rig without [valve] takes: there the valve "
                    "decides"
                )
            kind = {"supply_command": "regulator", "supply_pressure": "measured"}.get(channel)
            if kind is not None and not self._names[channel][0]:
                what = "a regulator" if kind == "regulator" else kind
                raise ParameterError(
                    f"{channel} is given, which only a supply takes that is {what} "
                    f'([supply] kind = "{kind}")'
                )


def inputs_of(rig: Rig) -> Inputs:
    """Inputs of a rig, kept with it: a second run does not look them up again."""
    cached: Inputs | None = rig.__dict__.get("_inputs")
    if cached is None:
        cached = Inputs(rig)
        object.__setattr__(rig, "_inputs", cached)
    return cached


def initial_names(rig: Rig) -> list[str]:
    """Every state of a rig that an initial value can be given for.

    Parameters
    ----------
    rig : Rig
        The model.

    Returns
    -------
    list of str
        ``muscle_pressure.flexor``, ``joint_angle.elbow``.
    """
    return [dotted(state, name) for state in _INITIAL for name in _having(rig, state)]


def _having(rig: Rig, state: str) -> list[str]:
    """Names of the blocks that have a state; for a tube, with the number of the segment."""
    tables = rig.tables(_INITIAL[state])
    if state == "temperature":
        return [name for name, table in tables.items() if table["gas"] == "energy_balance"]
    if state not in _BETWEEN:
        return list(tables)
    return [
        dotted(name, str(k)) if name else str(k)
        for name, table in tables.items()
        for k in range(1, int(table.get("segments", 0)) + 1 - _BETWEEN[state])
    ]


def keywords(answer: Any) -> dict[str, Any]:
    """Keywords of :meth:`pamrs.Simulator.step` for a controller's answer; one command means the
    valve.
    """
    if isinstance(answer, Mapping) and any(name in SIGNALS for name in answer):
        return dict(answer)
    return {"valve_command": answer}


def prescribed(
    signals: Mapping[str, Array], start: dict[str, Any], plants: int | None = None
) -> dict[str, Array]:
    """Signals as the core takes them: what is prescribed is for the end of each sample, and its
    first value (of each of several plants) goes into the initial values.
    """
    driven: dict[str, Array] = {}
    for name, signal in signals.items():
        if channel_of(name) in ("valve_command", "supply_command"):
            driven[name] = signal
            continue
        held = channel_of(name) == "pressure"
        channel = name.replace("pressure", "muscle_pressure", 1) if held else name
        first: Any = float(signal[0]) if plants is None else signal[..., 0]
        if plants is not None:
            first = np.ascontiguousarray(np.broadcast_to(first, (plants,)))
        begun, values = np.atleast_1d(start.setdefault(channel, first)), np.atleast_1d(first)
        for k in np.flatnonzero(begun != values):
            of = "" if plants is None else f" of row {k}"
            raise ParameterError(
                f"initial {channel} = {begun[k]:g} does not go with {name}[0] = {values[k]:g}{of}: "
                "leave one out"
            )
        # the last one is not run
        driven[name] = np.ascontiguousarray(
            np.concatenate([signal[..., 1:], signal[..., -1:]], axis=-1)
        )
    return driven


def initial_values(initial: Mapping[str, float] | None, rig: Rig) -> dict[str, float]:
    """Initial values by the names of the core; names that the rig does not have are refused."""
    start: dict[str, float] = {}
    for name, value in (initial or {}).items():
        channel, _, block = name.partition(".")
        if channel not in _INITIAL:
            raise ParameterError(f"initial has the unknown entry {name!r}; {meant(name, _INITIAL)}")
        known = _having(rig, channel)
        if not rig.tables(_INITIAL[channel]):
            raise ParameterError(
                f"initial has {name!r}, but the rig {rig.name!r} has no [{_INITIAL[channel]}]"
            )
        if channel == "temperature" and block not in known:
            raise ParameterError(
                f"initial has {name!r}: a chamber with gas = 'energy_balance' is needed"
            )
        if channel in _BETWEEN and not known:
            raise ParameterError(
                f"initial has {name!r}, but no tube of the rig {rig.name!r} has the segments for it"
            )
        if block not in known:
            raise ParameterError(
                f"initial has {name!r}, which the rig {rig.name!r} does not have; "
                f"{meant(name, [dotted(channel, other) for other in known])}"
            )
        try:
            start[name] = float(value)
        except (TypeError, ValueError):
            raise refused(f"initial {name}", value, "a number is needed") from None
        if unit_of(channel) == "Pa" and by_hand(start[name]):
            doubt_pascals(f"initial {name}", start[name], inside=3)
    return start


def has_frame(rig: Rig) -> bool:
    """True where a load frame prescribes the length."""
    return any(load["kind"] == "frame" for load in rig.tables("load").values())


def supplies_of(rig: Rig, kind: str) -> list[str]:
    """Names of the supplies of a kind: ``regulator``, ``measured``."""
    return [name for name, table in rig.tables("supply").items() if table["kind"] == kind]


def sensor_zero(rig: Rig, kind: str, key: str, block: str) -> float:
    """Zero (``pressure_zero``, ``angle_zero``) of the sensor of a block of a kind: its own, or the
    common one; supplies and lines have theirs themselves.
    """
    own = kind if kind in ("supply", "line") else "sensors"
    tables = rig.tables(own)
    return float(tables.get(block, tables.get("", {})).get(key, 0.0))


def _named(channel: str, given: Signals, names: list[str], block: str) -> dict[str, ArrayLike]:
    """A user's argument as signals by the core's names."""
    if not isinstance(given, Mapping):
        if len(names) > 1:
            raise ParameterError(
                f"{channel} is one signal, and the rig has a {block} each of: {', '.join(names)}; "
                "give a mapping of names"
            )
        return {dotted(channel, names[0] if names else ""): given}
    if set(given) == {""} and len(names) == 1:
        return {dotted(channel, names[0]): given[""]}  # the only one is meant
    for name in given:
        if name not in names:
            raise ParameterError(
                f"{channel} has {name!r}, and the rig has no {block} of that name; "
                f"{meant(str(name), names)}"
            )
    return {dotted(channel, name): values for name, values in given.items()}


def _signal(
    name: str, values: ArrayLike, rows: int | None, allowed_range: tuple[float, float, str]
) -> Array:
    """One signal as a checked array; a number stays the same in every row."""
    signal = as_numbers(name, values)
    if signal.ndim == 0 and rows is not None:
        signal = np.full(rows, float(signal))
    if signal.ndim == 0:
        raise ParameterError(
            f"{name} = {float(signal):g} is one number: duration is missing, how long it is held "
            "(or give one value for each row)"
        )
    if signal.ndim != 1 or signal.size == 0 or (rows is not None and signal.size != rows):
        raise misshapen(name, signal.shape, rows, "one value for each row")
    low, high, allowed = allowed_range
    least, most = float(signal.min()), float(signal.max())
    if not (low <= least and most <= high and math.isfinite(least) and math.isfinite(most)):
        bad = np.flatnonzero(~((signal >= low) & (signal <= high) & np.isfinite(signal)))
        raise ParameterError(f"{name}[{bad[0]}] = {signal[bad[0]]:g} is not allowed: {allowed}")
    return np.ascontiguousarray(signal)
