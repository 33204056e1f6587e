"""Families that the second plan lacks: a centre of mass off its line, a late angle, moduli that
drift.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from .effects.base import (
    RECORDING_PERIOD,
    Effect,
    Env,
    Port,
    Setting,
    Start,
    State,
    drawn,
    either_sign,
    uniform,
)
from .geometry import JointTables

#: a lag below cannot be seen and would only make the equations stiff [s]
_LEAST = 3.0e-4


@dataclass(frozen=True)
class OffsetMass(Effect, id="com_offset", block="arm", graded=("angle",)):
    """Centre of mass beside the line of the arm, by an angle [rad] seen from the joint."""

    angle: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(either_sign(rng) * uniform(rng, 0.01, 0.03))

    def most(self) -> float:
        return 0.6 / max(abs(self.angle), 1e-9)

    def torque(self, env: Env, first: int) -> Port:
        moment = self.angle * env.par.weight
        return lambda angle, rate, pg, y, d: -moment * math.cos(angle)


@dataclass(frozen=True)
class SaggingMass(Effect, id="com_offset", block="arm", graded=("angle",)):
    """Payload on a bracket that sags: its angle beside the line [rad] is larger by a share `sag`
    where the arm hangs, as the weight pulls along the bracket where it is level.
    """

    angle: float
    sag: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(either_sign(rng) * uniform(rng, 0.01, 0.03), uniform(rng, 0.4, 1.0))

    def most(self) -> float:
        return 0.4 / max(abs(self.angle), 1e-9)

    def torque(self, env: Env, first: int) -> Port:
        moment, sag = self.angle * env.par.weight, self.sag

        def weight(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            along = math.cos(angle)
            return -moment * (1.0 + sag * along * along) * along

        return weight


@dataclass(frozen=True)
class LiquidMass(Effect, id="com_offset", block="arm", graded=("angle",), scales=(1.0,)):
    """Half-full vessel as payload: its centre of mass runs to the lower side, late by
    `time_constant` [s]. State: the angle beside the line [rad] in parts of `angle`.
    """

    angle: float
    time_constant: float
    tilt: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            either_sign(rng) * uniform(rng, 0.01, 0.03),
            uniform(rng, 0.2, 0.8),
            math.radians(uniform(rng, 10.0, 35.0)),
        )

    def most(self) -> float:
        return 0.4 / max(abs(self.angle), 1e-9)

    def place(self, angle: float) -> float:
        """Where the liquid comes to rest at an angle [rad] of the arm, 0..1."""
        return 0.5 + 0.5 * math.tanh((angle - math.pi / 4.0) / self.tilt)

    def start(self, at: Start) -> State:
        return [self.place(at.angle)]

    def torque(self, env: Env, first: int) -> Port:
        moment = self.angle * env.par.weight

        def weight(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            d[first] = (self.place(angle) - y[first]) / self.time_constant
            return -moment * (0.3 + 0.7 * y[first]) * math.cos(angle)

        return weight


@dataclass(frozen=True)
class LateAngle(Effect, id="sensor_lag", block="sensors", graded=("late",)):
    """Angle that is logged late by `late` [s], the pressures not."""

    late: float = drawn(6.0e-3, 14.0e-3)

    def most(self) -> float:
        return 0.4 / max(self.late, 1e-9)

    def warp(self) -> Port:
        return lambda t: (0.0, 0.0, self.late)


@dataclass(frozen=True)
class FilteredAngle(Effect, id="sensor_lag", block="sensors", graded=("lag",), scales=(1.0,)):
    """Angle behind a low pass of first order with a time constant `lag` [s]. State: what it gives
    out.
    """

    lag: float = drawn(8.0e-3, 20.0e-3)

    def most(self) -> float:
        return 0.4 / max(self.lag, 1e-9)

    def start(self, at: Start) -> State:
        return [at.angle]

    def follow(self, env: Env, first: int) -> Port:
        if self.lag < _LEAST:
            return None

        def rate(p: float, y: State, d: State) -> None:
            d[first] = (y[2] - y[first]) / self.lag

        return rate

    def read(self, env: Env, first: int) -> Port:
        if self.lag < _LEAST:
            return None
        return lambda p, ps, angle, y: (p, ps, angle + y[first] - y[2])


@dataclass(frozen=True)
class JitteringAngle(Effect, id="sensor_lag", block="sensors", graded=("late",)):
    """Angle over a bus that is busy: late by `late` [s], and now and then by a share more or
    less.
    """

    late: float = drawn(6.0e-3, 14.0e-3)
    share: float = drawn(0.4, 0.8)
    beat: float = drawn(1.0, 5.0)

    def most(self) -> float:
        return 0.3 / max(self.late, 1e-9)

    def warp(self) -> Port:
        def late(t: float) -> tuple[float, float, float]:
            wave = 2.0 * math.pi * self.beat * (t % RECORDING_PERIOD)
            wander = 0.5 * self.share * (math.sin(wave) + math.sin(0.7236 * wave + 1.0))
            return 0.0, 0.0, self.late * (1.0 + wander)

        return late


@dataclass(frozen=True)
class Drift(Effect, id="parameter_drift", block="muscle", graded=("change",), needs_clock=True):
    """Base: the force of the bladder, all that its moduli make, changes by a share."""

    change: float

    def most(self) -> float:
        return 0.8 / max(abs(self.change), 1e-9)

    def course(self, env: Env, first: int) -> Callable[[float, State, State], float]:
        """``f(v, y, d)``: the share that the change has at a rate of contraction [m/s]."""
        raise NotImplementedError

    def force(self, env: Env, first: int) -> Port:
        par, whole = env.par, env.tables.pull
        gas = JointTables(par.muscle, par.joint, par.count, 0.0).pull
        course = self.course(env, first)

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            bladder = whole(y[2], pg)[0] - gas(y[2], pg)[0]
            return -self.change * course(v, y, d) * bladder

        return resist


@dataclass(frozen=True)
class WarmingUp(Drift):
    """Moduli that change by a share `change` in the end, with a `time_constant` [s]."""

    time_constant: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(either_sign(rng) * uniform(rng, 0.02, 0.05), uniform(rng, 6.0, 30.0))

    def course(self, env: Env, first: int) -> Callable[[float, State, State], float]:
        clock, tau = env.clock, self.time_constant
        return lambda v, y, d: 1.0 - math.exp(-(y[clock] % RECORDING_PERIOD) / tau)


@dataclass(frozen=True)
class Ageing(Drift):
    """Moduli that change by a share `change` in a minute, ever further."""

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(either_sign(rng) * uniform(rng, 0.03, 0.08))

    def course(self, env: Env, first: int) -> Callable[[float, State, State], float]:
        clock = env.clock
        return lambda v, y, d: (y[clock] % RECORDING_PERIOD) / 60.0


@dataclass(frozen=True)
class WarmedByWork(Drift):
    """Rubber that warms while it moves and cools at rest: ``T' = |v|/way - T/time_constant``, the
    moduli change by `change` T, 1 at most. State: T.
    """

    way: float
    time_constant: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(-uniform(rng, 0.03, 0.08), uniform(rng, 0.15, 0.4), uniform(rng, 15.0, 60.0))

    def start(self, at: Start) -> State:
        return [0.0]

    def sizes(self) -> State:
        return [1.0]

    def course(self, env: Env, first: int) -> Callable[[float, State, State], float]:
        def warm(v: float, y: State, d: State) -> float:
            d[first] = abs(v) / self.way - y[first] / self.time_constant
            return math.tanh(y[first])

        return warm


@dataclass(frozen=True)
class WarmingRoom(Drift):
    """Moduli that follow a heater that goes on and off: a slow wave of `period` [s]."""

    period: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(uniform(rng, 0.02, 0.05), uniform(rng, 18.0, 45.0), uniform(rng, 0.0, 6.28))

    def course(self, env: Env, first: int) -> Callable[[float, State, State], float]:
        clock, wave, phase = env.clock, 2.0 * math.pi / self.period, self.phase
        return lambda v, y, d: math.sin(wave * y[clock] + phase)


TYPES: dict[str, type[Effect]] = {t.id: t for t in (OffsetMass, LateAngle, Drift)}
