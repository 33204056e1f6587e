"""One experiment: the commands that a person sends, in numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from string import Formatter
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import unit_of
from pamrs.experiments._chains import driving
from pamrs.findings import Protocol
from pamrs.rig import Rig, payload_of
from pamrs.simulation import Simulation, has_frame, simulate
from pamrs.units import to_si

#: Units that texts are written in, their SI unit, and digits behind the point.
_SAID: Final = {"bar": ("Pa", 2), "mm": ("m", 1), "kg": ("kg", 2), "deg": ("rad", 0)}


@dataclass(frozen=True, eq=False)
class Experiment:
    """One experiment, ready to be simulated.

    Attributes
    ----------
    name : str
        Its kind, ``"sealed_hold"``; behind a dot the chain that it moves alone,
        ``"slow_triangle.flexor"``.
    text : str
        What to do, with numbers.
    excitation : dict
        The same for a program: ``kind`` and numbers with their unit in the name.
    command : (n,) array or None
        Valve command [V], or pressure that a regulator or a bench is set to [Pa, gauge]; None for a
        chamber that nobody sends a command to.
    rows : int
        Number of samples.
    sample_time : float
        Time between them [s].
    initial : dict of str to float
        As for :func:`pamrs.simulate`.
    changes : dict of str to float
        Parameters of the rig that the person changes (another payload), SI.
    effort : float
        What it costs, as time [s]: its length and what must be changed by hand.
    channel : str
        Channel of the command.
    needs : str
        What it takes that the rig file does not say to be there, in words; empty for nothing.
    also : dict of str to (n,) array
        Further commands by their channels, as ``command``, and the length that a frame prescribes
        [m].
    """

    name: str
    text: str
    excitation: dict[str, Any]
    command: Array | None
    rows: int
    sample_time: float
    initial: dict[str, float] = field(default_factory=dict)
    changes: dict[str, float] = field(default_factory=dict)
    effort: float = 0.0
    channel: str = "valve_command"
    needs: str = ""
    also: dict[str, Array] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """Name of the experiment without that of a chain."""
        return self.name.partition(".")[0]

    @property
    def commands(self) -> dict[str, Array]:
        """Commands by channel [SI]; empty where everything is done by hand."""
        return {} if self.command is None else {self.channel: self.command, **self.also}

    @property
    def duration(self) -> float:
        """Length [s]."""
        return (self.rows - 1) * self.sample_time

    def changed(self, rig: Rig) -> Rig:
        """The rig as it is in this experiment."""
        return rig.with_parameters(self.changes) if self.changes else rig

    def simulate(self, rig: Rig) -> Simulation:
        """The experiment on a rig, every hypothesis from the same commands.

        Raises
        ------
        SimulationError
            If the state leaves the range in which the model holds.
        """
        driven: dict[str, Any] = driving(self.commands) or {"duration": self.duration}
        return simulate(
            self.changed(rig), sample_time=self.sample_time, initial=self.initial, **driven
        )


class QuantityFormatter(Formatter):
    """Formatter of the texts of experiments, in the units of a rig's file.

    Numbers that a text marks ``{level:bar}``, ``{length:mm.3g}``, are in that unit, and written in
    the rig's unit, which ``{bar}`` stands for: as fine as hundredths of a bar and tenths of a
    millimetre, or as their format says.
    """

    def __init__(self, rig: Rig) -> None:
        self._units = {name: rig.units.usual(si) for name, (si, _) in _SAID.items()}

    def format_field(self, value: Any, format_spec: str) -> str:
        """A number, in the unit of the rig where it is marked."""
        name, _, own = format_spec.partition(".")
        if name not in self._units:
            return str(super().format_field(value, format_spec))
        si, digits = _SAID[name]
        scale = to_si(1.0, name, si) / to_si(1.0, self._units[name], si)
        fine = digits - round(math.log10(scale))
        return f"{value * scale:.{own}}" if own else f"{round(value * scale, fine):g}"

    def get_value(self, key: int | str, args: Any, kwargs: Any) -> Any:
        """A fact, or the unit that a name stands for."""
        return self._units[str(key)] if key in self._units else super().get_value(key, args, kwargs)

    def each(self, values: Sequence[float], name: str, last: str = " and ") -> str:
        """Numbers in a row, with their unit behind the last one."""
        words, unit = [self.format_field(value, name) for value in values], name.partition(".")[0]
        row = [part for part in (", ".join(words[:-1]), *words[-1:]) if part]
        return f"{last.join(row)} {self._units[unit]}"


def protocol_of(experiment: Experiment) -> Protocol | None:
    """The commands of an experiment as a rig can play them; None where nothing is sent."""
    if not experiment.commands:
        return None
    time = np.arange(experiment.rows, dtype=np.float64) * experiment.sample_time
    units = {channel: unit_of(channel) for channel in experiment.commands}
    return Protocol(experiment.name, time, experiment.commands, units)


def limited(values: Array, most: float) -> Array:
    """Follow a signal (n,) by steps of at most so much from one sample to the next."""
    if values.size < 2 or float(np.abs(np.diff(values)).max()) <= most * (1.0 + 1e-9):
        return values
    out = np.empty_like(values)
    now = out[0] = values[0]
    for k, wanted in enumerate(values[1:], 1):
        now = out[k] = min(max(wanted, now - most), now + most)
    return out


def in_bar(pressure: float) -> float:
    """Convert a pressure [Pa] to bar, rounded to hundredths."""
    return round(pressure * 1e-5, 2)


def in_mm(length: float) -> float:
    """Convert a length [m] to millimetres, rounded to tenths."""
    return round(length * 1e3, 1)


def other_payload(rig: Rig) -> tuple[str, float, str] | None:
    """Another payload for the rig: the parameter, its value [kg], and words on what to get where
    the rig file lists none; None where no other is possible.
    """
    if has_frame(rig):
        return None
    name = payload_of(rig)
    now, least = rig.parameter(name).value, rig.parameter(name).lower
    listed = rig.limits.get("payloads")
    others = [m for m in listed or [] if m >= least and not math.isclose(m, now)]
    if (listed is not None and not others) or (listed is None and now <= 0.0):
        return None
    other = max(others, key=lambda m: abs(m - now)) if others else 0.5 * now
    load = rig.units.said(name, "kg", other, digits=".3g")
    return name, other, "" if others else f"another payload, about {load}"
