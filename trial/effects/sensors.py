"""Effects in the transducers and in the log."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from .base import RECORDING_PERIOD, Effect, Env, Port, Setting, Start, State, either_sign, uniform


@dataclass(frozen=True)
class PressureLag(Effect):
    """Snubber in front of the muscle pressure transducer: its volume fills faster at high pressure.

    ``ps' = (p - ps) p / (lag p_r)`` with `lag` [s] at `pressure` p_r [Pa absolute].
    """

    id: ClassVar[str] = "pressure_lag"
    block: ClassVar[str] = "sensors"
    graded: ClassVar[tuple[str, ...]] = ("lag",)
    lag: float
    pressure: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(uniform(rng, 0.02, 0.03), uniform(rng, 2.0e5, 3.5e5))

    def start(self, at: Start) -> State:
        return [at.pressure]

    def sizes(self) -> State:
        return [1.0e5]

    def follow(self, env: Env, first: int) -> Port:
        # a lag below 0.3 ms cannot be seen and would only make the equations stiff
        if self.lag < 3.0e-4:
            return None
        scale = 1.0 / (self.lag * self.pressure)

        def rate(p: float, y: State, d: State) -> None:
            d[first] = (p - y[first]) * p * scale

        return rate

    def read(self, env: Env, first: int) -> Port:
        if self.lag < 3.0e-4:
            return None
        pa = env.par.ambient
        return lambda p, ps, angle, y: (y[first] - pa, ps, angle)


@dataclass(frozen=True)
class ClockSkew(Effect):
    """Channels from a second logger: their clock starts late and runs fast or slow, and is set back
    now and then.

    `offset` [s], `skew` [s/s]; `channels` "pressures" or "all" (both pressures and the angle
    against the command).
    """

    id: ClassVar[str] = "clock_skew"
    block: ClassVar[str] = "sensors"
    graded: ClassVar[tuple[str, ...]] = ("offset", "skew")
    offset: float
    skew: float
    channels: str

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        sign = either_sign(rng)
        return cls(
            sign * uniform(rng, 4.0e-3, 8.0e-3),
            sign * uniform(rng, 2.0e-4, 8.0e-4),
            "pressures" if rng.random() < 0.5 else "all",
        )

    def most(self) -> float:
        return 0.3 / max(abs(self.offset), 1e-9)

    def warp(self) -> Port:
        angle = 1.0 if self.channels == "all" else 0.0

        def late(t: float) -> tuple[float, float, float]:
            shift = self.offset + self.skew * (t % RECORDING_PERIOD)
            return shift, shift, angle * shift

        return late


@dataclass(frozen=True)
class GearLash(Effect):
    """Play in the gear of the angle encoder (in no catalogue); `half_play` [rad]. State: angle of
    the encoder.
    """

    id: ClassVar[str] = "encoder_gear_lash"
    block: ClassVar[str] = "sensors"
    graded: ClassVar[tuple[str, ...]] = ("half_play",)
    half_play: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(math.radians(uniform(rng, 0.04, 0.07)))

    def start(self, at: Start) -> State:
        return [at.angle]

    def sizes(self) -> State:
        return [1.0]

    def tick(self, env: Env, first: int) -> Port:
        half = self.half_play

        def play(y: State) -> None:
            y[first] = min(max(y[first], y[2] - half), y[2] + half)

        return play

    def read(self, env: Env, first: int) -> Port:
        return lambda p, ps, angle, y: (p, ps, y[first])


@dataclass(frozen=True)
class EncoderError(Effect):
    """Magnetic encoder off its axis: the angle reads ``a + A sin(a + phase) + B sin(2 a + phase) +
    C sin(4 a)``, the last by the iron around it; A, B [rad], C in parts of A.
    """

    id: ClassVar[str] = "encoder_error"
    block: ClassVar[str] = "sensors"
    graded: ClassVar[tuple[str, ...]] = ("first", "second")
    first: float
    second: float
    fourth: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            math.radians(uniform(rng, 0.05, 0.08)),
            math.radians(uniform(rng, 0.01, 0.04)),
            uniform(rng, 0.1, 0.2),
            uniform(rng, 0.0, 2.0 * math.pi),
        )

    def read(self, env: Env, first: int) -> Port:
        a, b, phase, sin = self.first, self.second, self.phase, math.sin
        c = self.fourth * a
        return lambda p, ps, angle, y: (
            p,
            ps,
            angle + a * sin(angle + phase) + b * sin(2.0 * angle + phase) + c * sin(4.0 * angle),
        )


@dataclass(frozen=True)
class PressureDrift(Effect):
    """Zero of the muscle pressure transducer that wanders while it warms up (in no catalogue);
    `size` [Pa], times in s.
    """

    id: ClassVar[str] = "pressure_zero_drift"
    block: ClassVar[str] = "sensors"
    graded: ClassVar[tuple[str, ...]] = ("size",)
    needs_clock: ClassVar[bool] = True
    size: float
    time_constant: float
    period: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        sign = either_sign(rng)
        return cls(
            sign * uniform(rng, 1.2e3, 1.8e3), uniform(rng, 8.0, 20.0), uniform(rng, 15.0, 40.0)
        )

    def read(self, env: Env, first: int) -> Port:
        clock, size, tau, wave = (
            env.clock,
            self.size,
            self.time_constant,
            2.0 * math.pi / self.period,
        )

        def drift(p: float, ps: float, angle: float, y: State) -> tuple[float, float, float]:
            t = y[clock] % RECORDING_PERIOD
            return p + size * (1.0 - math.exp(-t / tau) + 0.4 * math.sin(wave * t)), ps, angle

        return drift
