"""Standard experiments that a rig can do, each as the commands that a person sends, with its
numbers in words.

The levels follow from the rig: the lowest pressure at which its arm leaves the stop and the highest
that keeps it off the other one. Commands are found on the model by a loop over its muscle pressure
that inverts the valve, and then sent as they are, so that every hypothesis answers to the same
ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.control import OrificeInverse
from pamrs.diagnosis.settings import NextExperimentSettings
from pamrs.errors import DiagnosisError, SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import BLOCKS
from pamrs.simulation import Simulation, Simulator, regulators_of, simulate, switching_valves

__all__ = ["Experiment", "Range", "is_sealed", "library", "pressure_range", "trial_of"]

Array = NDArray[np.float64]
Points = list[tuple[float, float]]

_LEAST_SHARE = 0.14
"""Least flow that a command is found for, as a share of the choked one: near equal pressures the
valve would open without bound."""


@dataclass(frozen=True)
class Range:
    """Pressures between which an experiment moves, gauge [Pa].

    Attributes
    ----------
    low, high : float
        At which the arm just moves, and at which it nears its upper stop.
    """

    low: float
    high: float

    def at(self, share: float) -> float:
        """The pressure at a share of the range [Pa]."""
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True, eq=False)
class Experiment:
    """One experiment, ready to be simulated.

    Attributes
    ----------
    name : str
        Its kind, ``"sealed_hold"``.
    text : str
        What to do, with numbers.
    excitation : dict
        The same for a program: ``kind`` and numbers with their unit in the name.
    command : (n,) array or None
        Valve command [V], or set pressure of a regulator [Pa, gauge]; None for a chamber without
        either.
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

    @property
    def commands(self) -> dict[str, Array]:
        """What is sent, by channel [SI]; empty where everything is done by hand."""
        return {} if self.command is None else {self.channel: self.command}

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
        driven: dict[str, Any] = dict(self.commands) or {"duration": self.duration}
        return simulate(
            self.changed(rig), sample_time=self.sample_time, initial=self.initial, **driven
        )


def trial_of(
    rig: Rig, reference: Array, *, sample_time: float, bandwidth: float, **options: Any
) -> Array:
    """Valve commands that make the muscle pressure of a rig follow a reference.

    Parameters
    ----------
    rig : Rig
        A rig of one chain with a valve.
    reference : (n,) array
        Gauge pressure [Pa].
    sample_time : float
        Time between samples [s].
    bandwidth : float
        Of the loop [rad/s].
    **options
        ``shut`` ((n,) bool array: samples at which the command is the null voltage), ``dither``
        ((n,) array added to the command [V]), ``initial`` (as for :func:`pamrs.simulate`).

    Returns
    -------
    (n,) array
        Command [V].
    """
    n = reference.size
    shut = options.get("shut", np.zeros(n, dtype=bool))
    dither = options.get("dither", np.zeros(n))
    model = rig.model
    valve, gas = model["valve"], model["gas"]
    ambient, warm = gas["ambient_pressure"], gas["gas_constant"] * gas["temperature"]
    orifice = OrificeInverse(
        ambient, gas["temperature"], gas["gas_constant"], gas["heat_capacity_ratio"]
    )
    if valve["flow"] == "orifice":
        widest = valve["discharge_area_max"]
    else:  # the loop makes good what this misses of the larger path
        unit = _core.Gas(*(gas[key.name] for key in BLOCKS["gas"])).area_of_conductance(1.0)
        widest = unit * max(valve["fill_conductance"], valve["vent_conductance"])
    fractions, openings = np.asarray(valve["fraction"]), np.asarray(valve["opening"])
    null, half = valve["null_voltage"], valve["half_range"]
    slope = np.gradient(reference, sample_time)

    def update(sample: Mapping[str, float]) -> float:
        k = min(n - 1, round(sample["time"] / sample_time))
        if shut[k]:
            return float(null)
        wanted = bandwidth * (reference[k] - sample["muscle_pressure"]) + slope[k]
        mass = wanted * sample["air_volume"] / warm
        inside, supply = sample["muscle_pressure"] + ambient, sample["supply_pressure"] + ambient
        up, down = (supply, inside) if mass > 0.0 else (inside, ambient)
        flow = max(orifice.flow(up, down), _LEAST_SHARE * orifice.flow(up, 0.0))
        opening = float(np.interp(abs(mass) / (widest * flow), fractions, openings))
        return float(
            np.clip(
                null + math.copysign(half * opening, mass) + dither[k], null - half, null + half
            )
        )

    simulator = Simulator(rig, sample_time=sample_time, initial=options.get("initial"))
    every = max(1, round(0.01 / sample_time))
    total = (n - 1 + every - 1) // every * every
    found = simulator.control(update, total * sample_time, period=every * sample_time)
    return np.ascontiguousarray(found["valve_command"][:n])


def pressure_range(
    rig: Rig, settings: NextExperimentSettings, *, highest: float | None = None
) -> Range:
    """Pressures between which a rig is worth exciting.

    Parameters
    ----------
    rig : Rig
        A rig of one chain.
    settings : NextExperimentSettings
        Bandwidth of the loop that finds them.
    highest : float, optional
        Gauge pressure that is not to be exceeded [Pa], for example the highest that was recorded.

    Returns
    -------
    Range
        With an arm or a load, from where it has moved by a twentieth of its range to nine tenths of
        it; without one, from a tenth to six tenths of the supply's pressure. Never above what the
        rig file says that the stand allows.

    Raises
    ------
    DiagnosisError
        If nothing says how high the set pressure of a regulator may go.
    """
    model = rig.model
    said = [p for p in (highest, rig.limits.get("max_pressure")) if p is not None]
    most = min(said, default=math.inf)
    if is_sealed(rig):
        top = min(7.0e5, most) if highest is None else most
        return Range(0.35 * top, top)
    regulated = bool(regulators_of(rig))
    if regulated and not said:
        raise DiagnosisError(
            f"rig {rig.name!r} is fed by a regulator, and nothing says how high its pressure may "
            "go: [limits] max_pressure of the rig file, or a recording of the pressure, is needed"
        )
    top = most if regulated else min(0.8 * model["supply"]["initial_pressure"], most)
    joint, load = model["joint"], model["load"]
    if model["arm"] is None and load is None:
        return Range(0.1 * top, min(0.75 * top, 7.0e5))
    ramp = np.linspace(0.0, top, 1501)
    if regulated:
        found = simulate(rig, supply_command=ramp, sample_time=0.01)
    else:
        command = trial_of(rig, ramp, sample_time=0.01, bandwidth=settings.bandwidth)
        found = simulate(rig, command, sample_time=0.01)
    if load is None:
        share = (found["joint_angle"] - joint["rest_angle"]) / (
            joint["max_angle"] - joint["rest_angle"]
        )
    else:
        share = (found["length"][0] - found["length"]) / (found["length"][0] - load["min_length"])
    pressure = np.maximum.accumulate(found["muscle_pressure"])
    low = float(pressure[np.argmax(share > 0.05)]) if (share > 0.05).any() else 0.2 * top
    high = float(pressure[np.argmax(share > 0.85)]) if (share > 0.85).any() else top
    high = min(max(high, 1.2 * low), top)
    return Range(low, high) if high > low else Range(0.3 * top, top)


def is_sealed(rig: Rig) -> bool:
    """Whether nobody sends a command to a rig: a chamber without a valve and without a supply."""
    return not (rig.tables("valve") or rig.tables("supply"))


def _through(points: Points, sample_time: float) -> Array:
    """Straight lines through (time, value) points."""
    end = points[-1][0]
    time = np.arange(round(end / sample_time) + 1) * sample_time
    return np.asarray(
        np.interp(time, [p[0] for p in points], [p[1] for p in points]), dtype=np.float64
    )


def _then(points: Points, *legs: tuple[float, float]) -> Points:
    """Points continued by (duration, value) legs."""
    out = list(points)
    for duration, value in legs:
        out.append((out[-1][0] + duration, value))
    return out


def _bar(pressure: float) -> float:
    return round(pressure * 1e-5, 2)


class _Maker:
    """Builds the experiments of one rig."""

    def __init__(self, rig: Rig, sample_time: float, span: Range, bandwidth: float) -> None:
        self.rig, self.dt, self.span, self.bandwidth = rig, sample_time, span, bandwidth
        self.regulated = bool(regulators_of(rig))
        self.what = "the regulator's set pressure" if self.regulated else "the muscle pressure"

    def driven(
        self, name: str, text: str, excitation: dict[str, Any], reference: Array, **options: Any
    ) -> Experiment:
        changes, initial = options.pop("changes", {}), options.pop("initial", {})
        extra, bandwidth = options.pop("extra", 0.0), options.pop("bandwidth", self.bandwidth)
        needs = options.pop("needs", "")
        rig = self.rig.with_parameters(changes) if changes else self.rig
        if self.regulated:
            command = np.clip(reference, 0.0, self.span.high)
        else:
            command = trial_of(
                rig, reference, sample_time=self.dt, bandwidth=bandwidth, initial=initial, **options
            )
        seconds = (reference.size - 1) * self.dt
        done = {"kind": name, **excitation, "duration_s": round(seconds, 1)}
        channel = "supply_command" if self.regulated else "valve_command"
        return Experiment(
            name,
            text,
            done,
            command,
            reference.size,
            self.dt,
            initial,
            changes,
            seconds + extra,
            channel,
            needs,
        )

    def levels(self, *shares: float) -> tuple[list[float], str]:
        pressures = [self.span.at(s) for s in shares]
        return pressures, ", ".join(
            f"{_bar(p):g}" for p in pressures[:-1]
        ) + f" and {_bar(pressures[-1]):g} bar"

    def triangle(self, name: str, period: float, cycles: int, **options: Any) -> Experiment:
        low, high = self.span.at(0.05), self.span.at(0.95)
        points: Points = _then([(0.0, 0.0)], (2.0, low))
        for _ in range(cycles):
            points = _then(points, (0.5 * period, high), (0.5 * period, low))
        text = options.pop("text", "") + (
            f"drive {self.what} as a triangle between {_bar(low):g} and {_bar(high):g} bar "
            f"with a period of {period:g} s, {cycles} cycles, the first one kept"
        )
        excitation = {
            "levels_bar": [_bar(low), _bar(high)],
            "period_s": period,
            "cycles": cycles,
            **options.pop("also", {}),
        }
        return self.driven(name, text, excitation, _through(points, self.dt), **options)

    def sealed(self, hold: float = 16.0) -> Experiment:
        pressures, words = self.levels(0.15, 0.55, 0.95)
        return self._holds(
            "sealed_hold",
            pressures,
            hold,
            f"fill to {words}, shut the valve at each and hold it for {hold:g} s",
        )

    def both_sides(self, hold: float = 16.0) -> Experiment | None:
        """Holds above and below the pressure at which equal leaks from the supply and to the
        ambient balance.
        """
        ambient = self.rig.model["gas"]["ambient_pressure"]
        middle = self.span.at(0.5) + ambient
        supply = max(
            middle / 0.8 - ambient, 1.15 * self.span.at(0.8)
        )  # x = psi(x) of ISO 6358: 0.76 to 0.81
        if supply > self.rig.model["supply"]["initial_pressure"]:
            return None  # more than the supply gives
        pressures, words = self.levels(0.1, 0.8)
        text = (
            f"turn the supply down to {_bar(supply):g} bar, so that leaks through the valve's "
            f"centre would balance near {_bar(middle - ambient):g} bar; fill to {words}, on both "
            f"sides of it, shut the valve at each and hold it for {hold:g} s"
        )
        also = {"supply_bar": _bar(supply), "balance_bar": _bar(middle - ambient)}
        return self._holds(
            "holds_both_sides", pressures, hold, text, also, {"supply_pressure": supply}, extra=60.0
        )

    def _holds(
        self,
        name: str,
        pressures: list[float],
        hold: float,
        text: str,
        also: dict[str, Any] | None = None,
        initial: dict[str, float] | None = None,
        extra: float = 0.0,
    ) -> Experiment:
        points: Points = [(0.0, 0.0)]
        closed: list[tuple[float, float]] = []
        for pressure in pressures:
            points = _then(points, (1.0, pressure), (1.0, pressure))
            closed.append((points[-1][0], points[-1][0] + hold))
            points = _then(points, (hold, pressure))
        reference = _through(points, self.dt)
        time = np.arange(reference.size) * self.dt
        shut = np.zeros(reference.size, dtype=bool)
        for a, b in closed:
            shut |= (time >= a) & (time < b)
        excitation = {"levels_bar": [_bar(p) for p in pressures], "hold_s": hold, **(also or {})}
        return self.driven(
            name, text, excitation, reference, shut=shut, initial=initial or {}, extra=extra
        )

    def multisine(self) -> Experiment:
        frequencies = [0.1, 0.23, 0.41, 0.73, 1.13, 1.9, 3.1]
        time = np.arange(round(30.0 / self.dt) + 1) * self.dt
        size = 1.0 / np.sqrt(1.0 + (np.array(frequencies) / 0.6) ** 2)
        phase = (
            -np.pi
            * np.arange(len(frequencies))
            * np.arange(1, len(frequencies) + 1)
            / len(frequencies)
        )
        wave = (
            size[:, None]
            * np.sin(2 * np.pi * np.array(frequencies)[:, None] * time + phase[:, None])
        ).sum(axis=0)
        wave *= 0.4 / np.abs(wave).max()
        reference = np.clip(time / 3.0, 0.0, 1.0) * (
            self.span.at(0.5) + wave * (self.span.high - self.span.low)
        )
        low, high = self.span.at(0.1), self.span.at(0.9)
        text = (
            f"drive {self.what} as a multisine of {frequencies[0]:g} to "
            f"{frequencies[-1]:g} Hz between {_bar(low):g} and {_bar(high):g} bar for 30 s"
        )
        excitation = {"frequencies_hz": frequencies, "levels_bar": [_bar(low), _bar(high)]}
        return self.driven("multisine", text, excitation, reference)

    def staircase(self) -> Experiment:
        shares = [0.1, 0.35, 0.6, 0.85, 0.6, 0.35, 0.1]
        points: Points = [(0.0, 0.0)]
        for share in shares:
            points = _then(points, (0.5, self.span.at(share)), (4.5, self.span.at(share)))
        _, words = self.levels(*shares[:4])
        text = f"climb to {words} and down again, with {self.what} held for 4.5 s at each step"
        excitation = {"levels_bar": [_bar(self.span.at(s)) for s in shares], "hold_s": 4.5}
        return self.driven("staircase", text, excitation, _through(points, self.dt))

    def long_hold(self) -> Experiment:
        up, back = self.span.at(0.9), self.span.at(0.45)
        points = _then(
            [(0.0, 0.0)],
            (2.0, self.span.at(0.05)),
            (0.3, up),
            (25.0, up),
            (0.3, back),
            (25.0, back),
        )
        text = (
            f"step to {_bar(up):g} bar, then back to {_bar(back):g} bar, and keep "
            f"{self.what} there for 25 s after each"
        )
        excitation = {"levels_bar": [_bar(up), _bar(back)], "hold_s": 25.0}
        return self.driven("long_hold", text, excitation, _through(points, self.dt))

    def step_and_shut(self) -> Experiment:
        base, small, large = self.span.at(0.05), self.span.at(0.3), self.span.at(0.8)
        points: Points = _then([(0.0, 0.0)], (1.5, base), (0.5, base))
        closed = []
        for goal in (small, base, large, base):
            points = _then(points, (0.02, goal), (0.35, goal))
            closed.append((points[-1][0], points[-1][0] + 4.0))
            points = _then(points, (4.0, goal))
        reference = _through(points, self.dt)
        time = np.arange(reference.size) * self.dt
        shut = np.zeros(reference.size, dtype=bool)
        for a, b in closed:
            shut |= (time >= a) & (time < b)
        text = (
            f"step from {_bar(base):g} bar to {_bar(small):g} bar and back, then to "
            f"{_bar(large):g} bar and back (sizes 1:3), with the valve far open, shut it 0.35 s "
            "after each step and watch for 4 s"
        )
        excitation = {"levels_bar": [_bar(base), _bar(small), _bar(large)], "watch_s": 4.0}
        return self.driven("step_and_shut", text, excitation, reference, shut=shut, bandwidth=30.0)

    def nested(self) -> Experiment:
        middle, reach = self.span.at(0.5), 0.45 * (self.span.high - self.span.low)
        points: Points = _then([(0.0, 0.0)], (2.0, middle))
        for period in (12.0, 1.2):
            for share in (1.0, 0.6, 0.3):
                points = _then(
                    points,
                    (0.25 * period, middle + share * reach),
                    (0.5 * period, middle - share * reach),
                    (0.25 * period, middle),
                )
        text = (
            f"drive {self.what} in nested triangles around {_bar(middle):g} bar, of "
            f"±{_bar(reach):g}, ±{_bar(0.6 * reach):g} and ±{_bar(0.3 * reach):g} bar, first with "
            "a period of 12 s, then of 1.2 s"
        )
        excitation = {
            "middle_bar": _bar(middle),
            "reach_bar": [_bar(s * reach) for s in (1.0, 0.6, 0.3)],
            "periods_s": [12.0, 1.2],
        }
        return self.driven("nested_triangles", text, excitation, _through(points, self.dt))

    def null_ramp(self) -> Experiment:
        middle = self.span.at(0.5)
        half = self.rig.model["valve"]["half_range"]
        reach, period, seconds = 0.03 * half, 2.0, 24.0
        time = np.arange(round((seconds + 2.0) / self.dt) + 1) * self.dt
        phase = np.clip(time - 2.0, 0.0, None) / period % 1.0
        dither = reach * (1.0 - 4.0 * np.abs(((phase + 0.25) % 1.0) - 0.5)) * (time >= 2.0)
        reference = np.clip(time / 2.0, 0.0, 1.0) * middle
        text = (
            f"hold {_bar(middle):g} bar by slow corrections and ramp the valve command through its "
            f"null by ±{1e3 * reach:.0f} mV in both directions, period {period:g} s, for "
            f"{seconds:g} s"
        )
        excitation = {"level_bar": _bar(middle), "reach_v": round(reach, 4), "period_s": period}
        return self.driven("null_ramp", text, excitation, reference, dither=dither, bandwidth=1.5)

    def free_decay(self) -> Experiment | None:
        pressure = self.span.at(0.5)
        joint = self.rig.model["joint"]
        reference = _through([(0.0, pressure), (8.0, pressure)], self.dt)
        shut = np.ones(reference.size, dtype=bool)
        slow = _through([(0.0, 0.0), (3.0, pressure), (6.0, pressure)], 0.01)
        command = trial_of(self.rig, slow, sample_time=0.01, bandwidth=self.bandwidth)
        rest = simulate(self.rig, command, sample_time=0.01)["joint_angle"][-1]
        turned = min(
            float(rest) + 0.15 * (joint["max_angle"] - joint["min_angle"]),
            joint["max_angle"] - 0.05,
        )
        shown = round(math.degrees(turned - float(rest)), 0)
        initial = {"muscle_pressure": pressure, "joint_angle": turned}
        text = (
            f"at {_bar(pressure):g} bar with the valve shut, lift the arm by hand by {shown:g} "
            "deg, let it go and record 8 s from the release"
        )
        excitation = {"level_bar": _bar(pressure), "deflection_deg": shown}
        try:
            return self.driven(
                "free_decay", text, excitation, reference, shut=shut, initial=initial, extra=30.0
            )
        except SimulationError:
            return None

    def set_steps(self) -> Experiment:
        base, small, large = self.span.at(0.05), self.span.at(0.3), self.span.at(0.8)
        points: Points = _then([(0.0, 0.0)], (1.5, base), (2.0, base))
        for goal in (small, base, large, base):
            points = _then(points, (0.0, goal), (5.0, goal))
        text = (
            f"step {self.what} from {_bar(base):g} bar to {_bar(small):g} bar and back, then to "
            f"{_bar(large):g} bar and back (sizes 1:3), and keep each for 5 s"
        )
        excitation = {"levels_bar": [_bar(base), _bar(small), _bar(large)], "hold_s": 5.0}
        return self.driven("set_steps", text, excitation, _through(points, self.dt))

    def fine_staircase(self) -> Experiment:
        middle, step = self.span.at(0.5), 0.01 * (self.span.high - self.span.low)
        points: Points = _then([(0.0, 0.0)], (2.0, middle), (2.0, middle))
        for k in (*range(1, 7), *range(5, -7, -1), *range(-5, 1)):
            points = _then(points, (0.0, middle + k * step), (1.5, middle + k * step))
        text = (
            f"move {self.what} by single steps of {step * 1e-5:.2g} bar, six up from "
            f"{_bar(middle):g} bar, twelve down and six up again, 1.5 s each"
        )
        excitation = {"middle_bar": _bar(middle), "step_bar": round(step * 1e-5, 4), "hold_s": 1.5}
        return self.driven("fine_staircase", text, excitation, _through(points, self.dt))

    def other_payload(self) -> Experiment | None:
        name = "load.mass" if self.rig.model["load"] else "arm.payload"
        now = self.rig.parameter(name).value
        listed = self.rig.limits.get("payloads")
        least = self.rig.parameter(name).lower
        others = [m for m in listed or [] if m >= least and not math.isclose(m, now)]
        if (listed is not None and not others) or (listed is None and now <= 0.0):
            return None
        other = max(others, key=lambda m: abs(m - now)) if others else 0.5 * now
        needs = "" if others else f"another payload, about {other:.3g} kg"
        text = f"change the payload to {other:.3g} kg and "
        also = {"payload_kg": round(other, 3)}
        changes = {name: other}
        return self.triangle(
            "other_payload", 12.0, 2, text=text, also=also, changes=changes, extra=90.0, needs=needs
        )


def _sealed_library(rig: Rig, sample_time: float, span: Range) -> list[Experiment]:
    out = []
    for name, pressure, seconds in (
        ("hold_low", span.low, 600.0),
        ("hold_high", span.high, 600.0),
        ("hold_short", span.high, 120.0),
        ("hold_long", span.high, 1800.0),
    ):
        then = "open its outlet" if rig.tables("line") else "shut it off"
        text = (
            f"fill the chamber to {_bar(pressure):g} bar, {then} and record {seconds:g} s from "
            "that moment"
        )
        excitation = {"kind": name, "levels_bar": [_bar(pressure)], "duration_s": seconds}
        rows = round(seconds / sample_time) + 1
        out.append(
            Experiment(
                name,
                text,
                excitation,
                None,
                rows,
                sample_time,
                {"muscle_pressure": pressure},
                {},
                seconds,
            )
        )
    return out


def library(
    rig: Rig,
    settings: NextExperimentSettings,
    *,
    sample_time: float | None = None,
    highest: float | None = None,
    only: Collection[str] | None = None,
) -> list[Experiment]:
    """The standard experiments that a rig can do.

    Parameters
    ----------
    rig : Rig
        A rig of one chain: with a valve or a regulator, with or without an arm or a hanging load;
        or a chamber that nobody sends a command to.
    settings : NextExperimentSettings
        Sample time where none is given, and bandwidth of the pressure loop.
    sample_time : float, optional
        Time between samples [s].
    highest : float, optional
        Gauge pressure that is not to be exceeded [Pa].
    only : collection of str, optional
        Names of those to make; all by default.

    Returns
    -------
    list of Experiment
        Those that the rig survives in simulation.
    """
    several = [block for block in rig.blocks if "" not in rig.tables(block)]
    if several:
        raise DiagnosisError(
            f"rig {rig.name!r} has named blocks ({', '.join(several)}); experiments are made for "
            "rigs of one chain"
        )
    if switching_valves(rig):
        raise DiagnosisError(
            f"rig {rig.name!r} has a valve that switches; experiments are made for valves that "
            "open by degrees"
        )
    regulated = bool(regulators_of(rig)) and not rig.tables("valve")
    if not rig.tables("valve") and not regulated and (rig.tables("supply") or rig.tables("muscle")):
        raise DiagnosisError(
            f"rig {rig.name!r} has no valve that a person could command, and no regulator; "
            "experiments need one, or a sealed chamber"
        )
    span = pressure_range(rig, settings, highest=highest)
    if is_sealed(rig):
        sealed = _sealed_library(
            rig, settings.sealed_sample_time if sample_time is None else sample_time, span
        )
        return [e for e in sealed if only is None or e.name in only]
    make = _Maker(
        rig, settings.sample_time if sample_time is None else sample_time, span, settings.bandwidth
    )
    makers: dict[str, Callable[[], Experiment | None]] = {
        "multisine": make.multisine,
        "sealed_hold": make.sealed,
        "slow_triangle": lambda: make.triangle("slow_triangle", 15.0, 2),
        "step_and_shut": make.step_and_shut,
        "staircase": make.staircase,
        "long_hold": make.long_hold,
        "nested_triangles": make.nested,
        "fast_triangle": lambda: make.triangle("fast_triangle", 1.5, 10),
        "null_ramp": make.null_ramp,
        "holds_both_sides": make.both_sides,
    }
    if regulated:
        hold = ("multisine", "slow_triangle", "staircase", "long_hold", "nested_triangles")
        makers = {name: makers[name] for name in (*hold, "fast_triangle")}
        makers |= {"set_steps": make.set_steps, "fine_staircase": make.fine_staircase}
    if rig.model["arm"] is not None or rig.model["load"] is not None:
        makers |= {"other_payload": make.other_payload}
    if rig.model["arm"] is not None and not regulated:
        makers |= {"free_decay": make.free_decay}
    out = []
    for name, maker in makers.items():
        if only is not None and name not in only:
            continue
        try:
            found = maker()
        except SimulationError:
            continue  # the model does not hold there: nothing to propose to anyone
        if found is not None and not _exceeds(found, rig):
            out.append(found)
    return out


def _exceeds(experiment: Experiment, rig: Rig) -> bool:
    """Whether an experiment goes beyond the pressure that the rig file says the stand allows: what
    a command is found for is overshot where the valve is far open.
    """
    most = rig.limits.get("max_pressure")
    if most is None:
        return False
    return bool(experiment.simulate(rig)["muscle_pressure"].max() > most)
