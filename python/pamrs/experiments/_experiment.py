"""One experiment: the commands that a person sends, in numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import unit_of
from pamrs.experiments._chains import driving
from pamrs.findings import Protocol
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import Simulation, has_frame, simulate

__all__ = [
    "BAR",
    "MM",
    "Experiment",
    "Points",
    "in_bar",
    "in_mm",
    "limited",
    "listed",
    "nested_triangles",
    "of_commands",
    "other_payload",
    "protocol_of",
    "then",
    "through",
    "waves",
    "within",
]

# [Hz] of a multisine, lowest first: from slow creep to the band of an arm's joint
MULTISINE_FREQUENCIES = (0.1, 0.23, 0.41, 0.73, 1.13, 1.9, 3.1)
# from one to the next, shared by multisines of several chains: just below their mean, 1.77
FREQUENCY_RATIO = 1.7


Array = NDArray[np.float64]
Points = list[tuple[float, float]]


@dataclass(frozen=True)
class Said:
    """How a quantity is said: its unit, the factor from SI, and digits behind the point."""

    unit: str
    factor: float
    digits: int

    def __call__(self, value: float) -> float:
        """A value in SI as it is said."""
        return round(value * self.factor, self.digits)


BAR = Said("bar", 1e-5, 2)  # pressures are told in hundredths of a bar
MM = Said("mm", 1e3, 1)  # lengths in tenths of a millimetre


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
        """Its name without that of a chain."""
        return self.name.partition(".")[0]

    @property
    def commands(self) -> dict[str, Array]:
        """What is sent, by channel [SI]; empty where everything is done by hand."""
        return {} if self.command is None else {self.channel: self.command, **self.also}

    @property
    def duration(self) -> float:
        """Length [s]."""
        return (self.rows - 1) * self.sample_time

    def changed(self, rig: Rig) -> Rig:
        """The rig as it stands in this experiment."""
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


def protocol_of(experiment: Experiment) -> Protocol | None:
    """The commands of an experiment as a rig can play them; None where nothing is sent."""
    if not experiment.commands:
        return None
    time = np.arange(experiment.rows, dtype=np.float64) * experiment.sample_time
    units = {channel: unit_of(channel) for channel in experiment.commands}
    return Protocol(experiment.name, time, experiment.commands, units)


def limited(values: Array, most: float) -> Array:
    """A signal (n,) that follows another one, from one sample to the next by no more than so
    much.
    """
    if values.size < 2 or float(np.abs(np.diff(values)).max()) <= most * (1.0 + 1e-9):
        return values
    out = np.empty_like(values)
    now = out[0] = values[0]
    for k, wanted in enumerate(values[1:], 1):
        now = out[k] = min(max(wanted, now - most), now + most)
    return out


def waves(frequencies: Array, time: Array, turned: float) -> Array:
    """A sum of sines (n,) that grow smaller above 0.6 Hz, their phases by Schroeder's rule and
    turned by an angle [rad], so that its peaks are low.
    """
    count = frequencies.size
    size = 1.0 / np.sqrt(1.0 + (frequencies / 0.6) ** 2)
    phase = -np.pi * np.arange(count) * np.arange(1, count + 1) / count + turned
    each = np.sin(2 * np.pi * frequencies[:, None] * time + phase[:, None])
    return np.asarray((size[:, None] * each).sum(axis=0))


def listed(words: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def through(points: Points, sample_time: float) -> Array:
    """Straight lines through (time, value) points."""
    end = points[-1][0]
    time = np.arange(round(end / sample_time) + 1) * sample_time
    return np.asarray(
        np.interp(time, [p[0] for p in points], [p[1] for p in points]), dtype=np.float64
    )


def then(points: Points, *legs: tuple[float, float]) -> Points:
    """Points continued by (duration, value) legs."""
    out = list(points)
    for duration, value in legs:
        out.append((out[-1][0] + duration, value))
    return out


def in_bar(pressure: float) -> float:
    """A pressure as it is said [bar]."""
    return BAR(pressure)


def in_mm(length: float) -> float:
    """A length as it is said [mm]."""
    return MM(length)


def other_payload(rig: Rig) -> tuple[str, float, str] | None:
    """Another payload that a person may hang on: the parameter, its value [kg], and what it takes
    that the rig file does not list; None where there is none.
    """
    if has_frame(rig):
        return None
    if rig.tables("load"):
        name = "load.mass"
    elif rig.tables("link"):
        name = f"{qualified('link', list(rig.ports('link'))[-1])}.payload"
    else:
        name = "arm.payload"
    now, least = rig.parameter(name).value, rig.parameter(name).lower
    listed = rig.limits.get("payloads")
    others = [m for m in listed or [] if m >= least and not math.isclose(m, now)]
    if (listed is not None and not others) or (listed is None and now <= 0.0):
        return None
    other = max(others, key=lambda m: abs(m - now)) if others else 0.5 * now
    return name, other, "" if others else f"another payload, about {other:.3g} kg"


def nested_triangles(
    low: float,
    high: float,
    what: str,
    said: Said = BAR,
    periods: tuple[float, float] = (12.0, 1.2),
) -> tuple[Points, str, dict[str, Any]]:
    """Triangles of three sizes around the middle of a range of pressures [Pa] or lengths [m], slow
    and then fast: corners, words and numbers.
    """
    middle, reach = low + 0.5 * (high - low), 0.45 * (high - low)
    sizes = (1.0, 0.6, 0.3)
    points: Points = then([(0.0, 0.0)], (2.0, middle))
    for period in periods:
        for share in sizes:
            points = then(
                points,
                (0.25 * period, middle + share * reach),
                (0.5 * period, middle - share * reach),
                (0.25 * period, middle),
            )
    reaches, unit = [said(share * reach) for share in sizes], said.unit
    text = (
        f"drive {what} in nested triangles around {said(middle):g} {unit}, of "
        f"±{reaches[0]:g}, ±{reaches[1]:g} and ±{reaches[2]:g} {unit}, "
        f"first with a period of {periods[0]:g} s, then of {periods[1]:g} s"
    )
    numbers = {
        f"middle_{unit}": said(middle),
        f"reach_{unit}": reaches,
        "periods_s": list(periods),
    }
    return points, text, numbers


def of_commands(
    name: str,
    text: str,
    excitation: dict[str, Any],
    sent: Mapping[str, Array],
    sample_time: float,
    *,
    initial: dict[str, float] | None = None,
    changes: dict[str, float] | None = None,
    extra: float = 0.0,
    needs: str = "",
) -> Experiment:
    """The experiment that plays commands (n,), by channel, and takes ``extra`` seconds more."""
    (channel, command), *also = sent.items()
    seconds = (command.size - 1) * sample_time
    return Experiment(
        name,
        text,
        {"kind": name, **excitation, "duration_s": round(seconds, 1)},
        command,
        command.size,
        sample_time,
        initial or {},
        changes or {},
        seconds + extra,
        channel,
        needs,
        dict(also),
    )


def within(rows: int, sample_time: float, spans: list[tuple[float, float]]) -> NDArray[np.bool_]:
    """Which of so many samples lie in one of some spans of time [s], the ends of spans left out."""
    time, inside = np.arange(rows) * sample_time, np.zeros(rows, dtype=bool)
    for begin, end in spans:
        inside |= (time >= begin) & (time < end)
    return inside
