"""Run a plant through one recording and measure how far its effects move the channels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

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
    """What a command goes through on its way to the opening of the valve.

    `kinds` has the number of each channel among :data:`CHANNELS`, `shut` the opening of no command,
    `clocks` the effects that may make a log late.
    """

    kinds: tuple[int, ...] = (0, 1, 2)
    shut: Any = 0.0

    def __init__(self, plant: Plant, sample_time: float = SAMPLE_TIME) -> None:
        self.plant, self.sample_time, self.clocks = plant, sample_time, plant.effects
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

    def begun(self, state: State, shift: tuple[float, ...], tank: State, clock: float) -> State:
        """State of the plant at a time [s] as that of another one, but for its tank, with shifts of
        the pressure [Pa] and the angle [rad].
        """
        pressure, angle = state[0] + shift[0], state[2] + shift[1]
        return self.plant.initial(pressure, tank[1], angle, state[3], clock)


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
    control.reset()
    reference, dither, sealed = (
        shape.reference.tolist(),
        shape.dither.tolist(),
        shape.sealed.tolist(),
    )

    def steer(i: int, measured: Iterator[float]) -> float:
        if command is not None:
            return float(command[i])
        p, _, angle = measured
        return control(reference[i], angle, p, dither[i], sealed[i])

    path = CommandPath(plant, sample_time)
    y = start or plant.rest(supply + plant.par.ambient, RECORDING_PERIOD * index)
    every = 1 if command is not None else held
    return recorded(path, steer, len(reference), y, noise, rng, index, every)


def recorded(
    path: Any,
    steer: Callable[[int, Iterator[float]], Any],
    n: int,
    y: State,
    noise: Noise,
    rng: np.random.Generator,
    index: int,
    held: int,
) -> Record:
    """A recording of `n` samples of the plant of a path, from a state.

    `steer` gives the command, or those of a pair, from the number of a sample and what the channels
    measure, every `held` samples; the others as :func:`run`.
    """
    plant, sample_time = path.plant, path.sample_time
    spread = np.array([(noise.pressure, noise.angle)[k == 2] for k in path.kinds])
    grid = np.array([(noise.pressure_step, noise.angle_step)[k == 2] for k in path.kinds])
    white = rng.standard_normal((n, len(path.kinds))) * spread
    noisy, steps = white.tolist(), grid.tolist()
    sent: list[Any] = []
    clean: list[tuple[float, ...]] = []
    states: list[State] = []
    begin = RECORDING_PERIOD * index
    opening, step, u = path.shut, 1.0e-3, path.shut
    for i in range(n):
        y = plant.tick(y)
        states.append(y)
        reading = plant.reading(y, opening)
        clean.append(reading)
        if i % held == 0:
            measured = zip(reading, noisy[i], steps, strict=True)
            u = steer(i, (round((v + e) / s) * s for v, e, s in measured))
        sent.append(u)
        for opening, span in path.spans(u, begin + i * sample_time):
            y, step = plant.advance(y, opening, span, step)
    time = sample_time * np.arange(n)
    true = late(path.clocks, time, np.array(clean), path.kinds)
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
    bare: Any,
    record: Record,
    index: int = 0,
    shift: tuple[float, ...] | None = None,
    window: float = 2.0,
    sample_time: float = SAMPLE_TIME,
    way: Callable[[Any, float], Any] = CommandPath,
) -> Array:
    """Noise-free readings (n, 3), or (n, 4) of a pair, of a plant that gets the commands of a
    recording of another one.

    Its muscle pressure, angle and rate start from the true state every `window` [s], the tank runs
    through. One classical Runge-Kutta step per sample: its error is some thousandths of the noise.

    Parameters
    ----------
    bare : Plant or PairPlant
        Without a delay in its command path.
    record : Record
        With the true states.
    index : int
        Number of the recording in the case.
    shift : tuple of float, optional
        Added to each pressure [Pa] and to the angle [rad] at the starts; by default nothing.
    window : float
        Length of a window [s].
    sample_time : float
        Sample time of the recording [s].
    way : callable
        Makes the path of the commands: :class:`CommandPath`, or that of a pair.
    """
    every = round(window / sample_time)
    parts = max(1, math.ceil(sample_time / 6.0e-3))
    found: list[tuple[float, ...]] = []
    path = way(bare, sample_time)
    none = (0.0,) * len(path.kinds)
    begin = RECORDING_PERIOD * index
    opening = path.shut
    y: State = []
    for i, (state, command) in enumerate(zip(record.states, record.command.tolist(), strict=True)):
        clock = begin + i * sample_time
        if i % every == 0:
            y = path.begun(state, shift or none, y or state, clock)
        y = bare.tick(y)
        found.append(bare.reading(y, opening))
        for opening, span in path.spans(command, clock):
            for _ in range(parts):
                y = bare.classical(y, opening, span / parts)
    return late(path.clocks, record.time, np.array(found), path.kinds)


def reach(moved: Array, noise: Noise) -> dict[str, float]:
    """Rms of (n, 3) differences per channel, in units of the noise."""
    rms = np.sqrt((moved**2).mean(axis=0)) / noise.floor()
    return dict(zip(CHANNELS, rms.tolist(), strict=True))
