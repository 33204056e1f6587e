"""Run a plant through one recording and measure how far its effects move the channels."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from .effects import RECORDING_PERIOD, Effects
from .excitation import Controller, Excitation, build
from .plant import Plant
from .solver import State

Array = NDArray[np.floating]
SAMPLE_TIME = 0.005
ANGLE_STEP = math.radians(180.0 / 16384.0)
CHANNELS = ("muscle_pressure", "supply_pressure", "joint_angle")


@dataclass(frozen=True)
class Noise:
    """Standard deviation and resolution of the transducers: pressures in Pa, angle in rad."""

    pressure: float
    pressure_step: float
    angle: float
    angle_step: float

    def floor(self) -> Array:
        """Standard deviation of noise and quantisation per channel, in the order of
        :data:`CHANNELS`.
        """
        lsb = math.sqrt(12.0)
        p, a = (
            math.hypot(self.pressure, self.pressure_step / lsb),
            math.hypot(self.angle, self.angle_step / lsb),
        )
        return np.array([p, p, a])


@dataclass(frozen=True)
class Record:
    """One recording of n samples.

    Command (n,) [V], of two valves (n, 2); `logged` with noise and `clean` without, (n, 3) in the
    order of :data:`CHANNELS`, or (n, 4) of a pair, gauge Pa and rad; true states at the samples.
    """

    time: Array
    command: Array
    logged: Array
    clean: Array
    states: list[State]


class Steering(Protocol):
    """A controller: command [V] from reference, measured angle and pressure, dither, and whether
    the valve is to be shut.
    """

    def reset(self) -> None:
        """Forget the past."""

    def __call__(
        self, reference: float, angle: float, pressure: float, dither: float, sealed: bool, /
    ) -> float:
        """The next command [V]."""


class CommandPath:
    """What a command goes through on its way to the opening of the valve."""

    def __init__(self, plant: Plant, sample_time: float = SAMPLE_TIME) -> None:
        self.plant, self.sample_time = plant, sample_time
        delay = sum(e.delay() for e in plant.effects)
        self.whole = int(delay / sample_time)
        self.part = delay - self.whole * sample_time
        self.past = [0.0] * (self.whole + 1)
        shapers = [e.shaper(plant.env) for e in plant.effects]
        self.shapers: list[Callable[[float, float], float]] = [f for f in shapers if f is not None]

    def spans(self, command: float, time: float) -> list[tuple[float, float]]:
        """(opening, duration [s]) pairs of the next sample for a command [V] at a time [s]."""
        x = self.plant.normalised(command)
        for shaper in self.shapers:
            x = shaper(x, time)
        self.past.append(min(max(x, -1.0), 1.0))
        old, new = self.past[-self.whole - 2], self.past[-self.whole - 1]
        spans = [(old, self.part), (new, self.sample_time - self.part)]
        return [s for s in spans if s[1] > 1.0e-9]


def open_loop(nominal: Plant, shape: Excitation, control: Controller) -> Array:
    """Commands [V] that lead the nominal plant along a reference, for replay on another plant."""
    y = nominal.rest(nominal.par.supply_pressure + nominal.par.ambient)
    step, command = 1.0e-3, np.empty(len(shape.reference))
    for i, goal in enumerate(shape.reference.tolist()):
        p, _, angle = nominal.reading(y)
        u = control(goal, angle, p, float(shape.dither[i]), bool(shape.sealed[i]))
        if shape.vent[i]:
            u = control.quantise(control.null - 1.5)
        command[i] = u
        y, step = nominal.advance(y, nominal.normalised(u), SAMPLE_TIME, step, rtol=1.0e-6)
    return command


def prepare(
    nominal: Plant, name: str, duration: float, rng: np.random.Generator
) -> tuple[Excitation, Controller, Array | None]:
    """Excitation, controller and, for an open-loop recording, its commands."""
    shape = build(name, duration, SAMPLE_TIME, rng)
    control = Controller(nominal, SAMPLE_TIME, rng)
    return shape, control, open_loop(nominal, shape, control) if shape.open_loop else None


def run(
    plant: Plant,
    shape: Excitation,
    control: Steering,
    command: Array | None,
    supply: float,
    noise: Noise,
    rng: np.random.Generator,
    index: int = 0,
    sample_time: float = SAMPLE_TIME,
    held: int = 1,
    start: State | None = None,
) -> Record:
    """One recording.

    Parameters
    ----------
    plant : Plant
        The true plant.
    shape, control, command
        From :func:`prepare`; with `command` the loop is open.
    supply : float
        Initial tank pressure [gauge Pa].
    noise : Noise
        Transducers.
    rng : numpy.random.Generator
        Draws the noise.
    index : int
        Number of the recording in the case.
    sample_time : float
        Sample time [s].
    held : int
        Samples for which a command is held.
    start : list of float, optional
        State at the start; at rest by default.
    """
    n = len(shape.reference)
    control.reset()
    white = rng.standard_normal((n, 3)) * [noise.pressure, noise.pressure, noise.angle]
    grid = np.array([noise.pressure_step, noise.pressure_step, noise.angle_step])
    noisy, steps = white.tolist(), grid.tolist()
    reference, dither, sealed = (
        shape.reference.tolist(),
        shape.dither.tolist(),
        shape.sealed.tolist(),
    )
    sent: list[float] = []
    clean: list[tuple[float, float, float]] = []
    states: list[State] = []
    path = CommandPath(plant, sample_time)
    begin = RECORDING_PERIOD * index
    y = start or plant.rest(supply + plant.par.ambient, begin)
    opening, step, u = 0.0, 1.0e-3, 0.0
    for i in range(n):
        y = plant.tick(y)
        states.append(y)
        reading = plant.reading(y, opening)
        clean.append(reading)
        if command is not None:
            u = float(command[i])
        elif i % held == 0:
            p = round((reading[0] + noisy[i][0]) / steps[0]) * steps[0]
            angle = round((reading[2] + noisy[i][2]) / steps[2]) * steps[2]
            u = control(reference[i], angle, p, dither[i], sealed[i])
        sent.append(u)
        for opening, span in path.spans(u, begin + i * sample_time):
            y, step = plant.advance(y, opening, span, step)
    time = sample_time * np.arange(n)
    true = late(plant.effects, time, np.array(clean))
    return Record(time, np.array(sent), np.round((true + white) / grid) * grid, true, states)


def late(effects: Effects, time: Array, clean: Array, kinds: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Channels as a log with another clock holds them; `kinds` gives the number of each among
    :data:`CHANNELS`.
    """
    for effect in effects:
        warp = effect.warp()
        if warp is not None:
            shift = np.array([warp(float(t)) for t in time])[:, list(kinds)]
            clean = np.column_stack(
                [
                    PchipInterpolator(time, clean[:, j])(
                        np.clip(time - shift[:, j], time[0], time[-1])
                    )
                    for j in range(len(kinds))
                ]
            )
    return clean


def follow(
    bare: Plant,
    record: Record,
    index: int = 0,
    shift: tuple[float, float] = (0.0, 0.0),
    window: float = 2.0,
    sample_time: float = SAMPLE_TIME,
) -> Array:
    """Noise-free readings (n, 3) of a plant that gets the commands of a recording of another one.

    Its muscle pressure, angle and rate start from the true state every `window` [s], the tank runs
    through. One classical Runge-Kutta step per sample: its error is some thousandths of the noise.

    Parameters
    ----------
    bare : Plant
        Without a delay in its command path.
    record : Record
        With the true states.
    index : int
        Number of the recording in the case.
    shift : tuple of float
        Added to the pressure [Pa] and angle [rad] at the starts.
    window : float
        Length of a window [s].
    sample_time : float
        Sample time of the recording [s].
    """
    every = round(window / sample_time)
    parts = max(1, math.ceil(sample_time / 6.0e-3))
    found: list[tuple[float, float, float]] = []
    path = CommandPath(bare, sample_time)
    begin = RECORDING_PERIOD * index
    command = record.command.tolist()
    opening = 0.0
    y: State = []
    for i, state in enumerate(record.states):
        if i % every == 0:
            supply = y[1] if y else state[1]
            y = bare.initial(
                state[0] + shift[0], supply, state[2] + shift[1], state[3], begin + i * sample_time
            )
        y = bare.tick(y)
        found.append(bare.reading(y, opening))
        for opening, span in path.spans(command[i], begin + i * sample_time):
            for _ in range(parts):
                y = bare.classical(y, opening, span / parts)
    return late(bare.effects, record.time, np.array(found))


def reach(moved: Array, noise: Noise) -> dict[str, float]:
    """Rms of (n, 3) differences per channel, in units of the noise."""
    rms = np.sqrt((moved**2).mean(axis=0)) / noise.floor()
    return dict(zip(CHANNELS, rms.tolist(), strict=True))
