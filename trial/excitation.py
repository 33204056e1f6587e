"""Reference trajectories and the controller that drives the valve."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .plant import Plant

Array = NDArray[np.floating]
DAC_STEP = 10.0 / 4095.0

#: name, role, in the order in which they are written
RECORDINGS = (
    ("lift_hold", "fit"),
    ("multisine", "fit"),
    ("sealed_holds", "fit"),
    ("angle_steps", "held_out"),
    ("slow_triangle", "held_out"),
    ("open_cycles", "fit"),
)
_SUBSETS = {1: (2,), 2: (2, 3), 3: (1, 2, 3), 4: (0, 1, 2, 3), 5: (0, 1, 2, 3, 4)}


def select(count: int) -> list[tuple[str, str]]:
    """Names and roles of `count` (1 to 5) recordings."""
    if count not in _SUBSETS:
        raise ValueError(f"recordings must be 1 to 5, got {count!r}")
    return [RECORDINGS[i] for i in _SUBSETS[count]]


@dataclass(frozen=True)
class Excitation:
    """Reference angle [rad], masks of samples (valve at the null voltage
    that the controller assumes, valve wide open to vent), dither [V].

    All of shape (n,). With `open_loop` the commands are found on the nominal plant and replayed.
    """

    reference: Array
    sealed: NDArray[np.bool_]
    dither: Array
    vent: NDArray[np.bool_]
    open_loop: bool = False


def _ramps(time: Array, points: list[tuple[float, float]], smooth: bool) -> Array:
    """Angle [deg] through (time, angle) points, by half cosines or straight lines."""
    t = np.array([p[0] for p in points])
    v = np.array([p[1] for p in points])
    if not smooth:
        return np.asarray(np.interp(time, t, v))
    i = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 2)
    s = np.clip((time - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)
    return np.asarray(v[i] + (v[i + 1] - v[i]) * 0.5 * (1.0 - np.cos(np.pi * s)))


@dataclass(frozen=True)
class _Course:
    """Reference angle [deg], and masks and dither as :class:`Excitation` has them; None where there
    are none.
    """

    angle: Array
    sealed: NDArray[np.bool_] | None = None
    dither: Array | None = None
    vent: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class _Clock:
    """Times of the samples [s], shape (n,), and how long they and one of them take [s]."""

    time: Array
    duration: float
    sample_time: float


def _lift_hold(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Lifts to random levels with holds, now and then back down."""
    points = [(0.0, 16.0)]
    while points[-1][0] < clock.duration:
        t, level = points[-1]
        goal = float(rng.uniform(30.0, 85.0))
        if abs(goal - level) < 15.0:
            goal = level + math.copysign(20.0, goal - level)
        move, hold = float(rng.uniform(3.0, 6.0)), float(rng.uniform(3.0, 5.0))
        points += [(t + move, goal), (t + move + hold, goal)]
        if rng.random() < 0.4:
            points += [(points[-1][0] + move, 18.0), (points[-1][0] + move + 1.5, 18.0)]
    return _Course(_ramps(clock.time, points, smooth=True))


def _multisine(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Nine sines about a level, faded in, with a dither on the command."""
    time = clock.time
    base = np.geomspace(0.08, 2.2, 9) * rng.uniform(0.9, 1.1, 9)
    size = 1.0 / np.sqrt(1.0 + (base / 0.5) ** 2)
    phase = rng.uniform(0.0, 2.0 * np.pi, (9, 1))
    wave = (size[:, None] * np.sin(2.0 * np.pi * base[:, None] * time + phase)).sum(axis=0)
    wave *= 26.0 / np.abs(wave).max()
    fade = np.clip(time / 3.0, 0.0, 1.0)
    angle = 16.0 + fade * (float(rng.uniform(48.0, 58.0)) - 16.0 + wave)
    every = max(1, round(0.06 / clock.sample_time))
    n = len(time)
    dither = np.repeat(rng.choice([-0.15, 0.15], n // every + 1), every)[:n]
    return _Course(angle, dither=dither)


def _sealed_holds(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Moves to random levels; the valve is held closed at each."""
    time = clock.time
    angle, sealed = np.full(len(time), 16.0), np.zeros(len(time), dtype=bool)
    t, level = 0.0, 16.0
    while t < clock.duration:
        goal = float(rng.uniform(30.0, 95.0))
        if abs(goal - level) < 12.0:
            goal = level + math.copysign(18.0, 60.0 - level)
        move, hold = float(rng.uniform(1.5, 3.5)), float(rng.uniform(5.0, 8.0))
        settle = move + float(rng.uniform(0.3, 1.0))
        part = (time >= t) & (time < t + settle + hold)
        points = [(0.0, level), (move, goal), (settle + hold + 1.0, goal)]
        angle[part] = _ramps(time[part] - t, points, smooth=True)
        sealed |= (time >= t + settle) & (time < t + settle + hold)
        t, level = t + settle + hold, goal
    return _Course(angle, sealed=sealed)


def _angle_steps(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Quick steps to random levels."""
    points = [(0.0, 16.0)]
    while points[-1][0] < clock.duration:
        t, level = points[-1]
        goal = float(rng.uniform(20.0, 95.0))
        hold = float(rng.uniform(1.5, 4.0))
        move = max(0.25, abs(goal - level) / 120.0)
        points += [(t + move, goal), (t + move + hold, goal)]
    return _Course(_ramps(clock.time, points, smooth=False))


def _slow_triangle(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Slowly up and down, with a small loop on the way down."""
    points = [(0.0, 16.0)]
    top = float(rng.uniform(75.0, 95.0))
    points.append((float(rng.uniform(0.4, 0.5)) * clock.duration, top))
    middle = float(rng.uniform(55.0, 65.0))
    points.append((points[-1][0] + (top - middle) / 4.0, middle))
    inner = middle + float(rng.uniform(8.0, 14.0))
    points.append((points[-1][0] + (inner - middle) / 4.0, inner))
    points.append((max(clock.duration, points[-1][0] + 5.0), 18.0))
    return _Course(_ramps(clock.time, points, smooth=False))


def _open_cycles(clock: _Clock, rng: np.random.Generator) -> _Course:
    """Fills in one or two moves with sealed pauses, then vents.

    Every cycle starts afresh, so that errors do not pile up.
    """
    time = clock.time
    sealed, vent = np.zeros(len(time), dtype=bool), np.zeros(len(time), dtype=bool)
    points = [(0.0, 16.0)]
    while points[-1][0] < clock.duration:
        t = points[-1][0]
        for level in rng.uniform(30.0, 80.0, int(rng.integers(1, 3))).tolist():
            move, hold = float(rng.uniform(0.8, 2.5)), float(rng.uniform(1.0, 2.5))
            points += [(t + move, level), (t + move + hold, level)]
            sealed |= (time >= t + move + 0.4) & (time < t + move + hold)
            t += move + hold
        points += [(t + 0.1, 15.5), (t + 2.2, 15.5)]
        vent |= (time >= t) & (time < t + 2.2)
    return _Course(_ramps(time, points, smooth=True), sealed=sealed, vent=vent)


_COURSES: dict[str, Callable[[_Clock, np.random.Generator], _Course]] = {
    "lift_hold": _lift_hold,
    "multisine": _multisine,
    "sealed_holds": _sealed_holds,
    "angle_steps": _angle_steps,
    "slow_triangle": _slow_triangle,
    "open_cycles": _open_cycles,
}


def build(name: str, duration: float, sample_time: float, rng: np.random.Generator) -> Excitation:
    """Build one excitation.

    Parameters
    ----------
    name : str
        One of the names in :data:`RECORDINGS`.
    duration, sample_time : float
        Length and sample time [s].
    rng : numpy.random.Generator
        Source of levels and times.

    Raises
    ------
    ValueError
        Unknown name.
    """
    if name not in _COURSES:
        raise ValueError(
            f"unknown excitation {name!r}; known: {', '.join(r[0] for r in RECORDINGS)}"
        )
    n = round(duration / sample_time)
    course = _COURSES[name](_Clock(sample_time * np.arange(n), duration, sample_time), rng)
    return Excitation(
        np.radians(np.clip(course.angle, 15.5, 105.0)),
        np.zeros(n, dtype=bool) if course.sealed is None else course.sealed,
        np.zeros(n) if course.dither is None else course.dither,
        np.zeros(n, dtype=bool) if course.vent is None else course.vent,
        name == "open_cycles",
    )


class Loop:
    """PID on a measured angle and loops of the pressures behind it, on a 12-bit output.

    Parameters
    ----------
    period : float
        Time between two commands [s].
    pid : (3,) array
        Gains on the error, its integral and the rate, before each is drawn within 15 %.
    flows : (2,) array
        Gains from a gap of pressure to filling and to venting [V/Pa]; drawn the same way.
    limit : float
        Of the integral, either side.
    rng : numpy.random.Generator
        Draws the gains.
    calm : float
        Less than 1 where slow sampling leaves less room for the rate and for the valve.
    """

    def __init__(
        self,
        period: float,
        pid: Array,
        flows: Array,
        limit: float,
        rng: np.random.Generator,
        calm: float = 1.0,
    ) -> None:
        gains = pid * rng.uniform(0.85, 1.15, 3) * np.array([calm, 1.0, calm])
        self.kp, self.ki, self.kd = (float(v) for v in gains)
        self.fill, self.vent = (float(v) for v in calm * flows * rng.uniform(0.85, 1.15, 2))
        self.period, self.limit = period, limit
        self.smooth = 1.0 - math.exp(-2.0 * math.pi * 12.0 * period)
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.sum, self.rate = 0.0, 0.0
        self.last: float | None = None

    @staticmethod
    def quantise(command: float) -> float:
        """Nearest level [V, or bar of a regulator] of the output within 0 to 10."""
        return round(min(max(command, 0.0), 10.0) / DAC_STEP) * DAC_STEP

    def see(self, angle: float) -> None:
        """Take in a measured angle: its rate is filtered at 12 Hz."""
        if self.last is not None:
            self.rate += self.smooth * ((angle - self.last) / self.period - self.rate)
        self.last = angle

    def gather(self, error: float) -> None:
        """Add an error to the integral."""
        self.sum = min(max(self.sum + error * self.period, -self.limit), self.limit)

    def feedback(self, error: float) -> float:
        """What the angle asks for beside the feedforward [Pa]."""
        return self.kp * error + self.ki * self.sum - self.kd * self.rate

    def opened(self, gap: float, null: float, dither: float) -> float:
        """Command [V] of a valve for a gap of pressure [Pa]."""
        command = null + (self.fill if gap > 0.0 else self.vent) * gap + dither
        return self.quantise(min(max(command, null - 2.5), null + 1.5))


class Controller(Loop):
    """PID on the angle with feedforward from the nominal model over an inner pressure loop.

    Parameters
    ----------
    nominal : Plant
        What the controller believes (its holding pressure and null voltage).
    sample_time : float
        Sample time [s].
    rng : numpy.random.Generator
        Draws the gains within 15 %.
    """

    def __init__(self, nominal: Plant, sample_time: float, rng: np.random.Generator) -> None:
        pid, flows = np.array([6.0e4, 8.0e4, 5.0e4]), np.array([1.6e-5, 5.0e-5])
        super().__init__(sample_time, pid, flows, 1.0, rng)
        self.null = nominal.par.null_voltage
        grid = np.radians(np.linspace(14.0, 112.0, 99))
        self.first, self.width = float(grid[0]), float(grid[1] - grid[0])
        self.hold = [nominal.holding_pressure(float(a)) for a in grid]

    def __call__(
        self, reference: float, angle: float, pressure: float, dither: float, sealed: bool
    ) -> float:
        """Command [V] from the reference and measured angle [rad] and the measured gauge pressure
        [Pa].
        """
        self.see(angle)
        if sealed:
            return self.quantise(self.null)
        s = min(max((reference - self.first) / self.width, 0.0), 97.999)
        i = int(s)
        ahead = self.hold[i] + (s - i) * (self.hold[i + 1] - self.hold[i])
        error = reference - angle
        self.gather(error)
        wanted = max(ahead + self.feedback(error), 0.0)
        return self.opened(wanted - pressure, self.null, dither)
