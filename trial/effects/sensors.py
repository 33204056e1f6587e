"""Effects in the transducers and in the log."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .base import (
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


@dataclass(frozen=True)
class PressureLag(Effect, id="pressure_lag", block="sensors", graded=("lag",), scales=(1.0e5,)):
    """Snubber in front of the muscle pressure transducer: its volume fills faster at high pressure.

    ``ps' = (p - ps) p / (lag p_r)`` with `lag` [s] at `pressure` p_r [Pa absolute].
    """

    lag: float = drawn(0.02, 0.03)
    pressure: float = drawn(2.0e5, 3.5e5)

    def start(self, at: Start) -> State:
        return [at.pressure]

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
class ClockSkew(Effect, id="clock_skew", block="sensors", graded=("offset", "skew")):
    """Channels from a second logger: their clock starts late and runs fast or slow, and is set back
    now and then.

    `offset` [s], `skew` [s/s]; `channels` "pressures" or "all" (both pressures and the angle
    against the command).
    """

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
class GearLash(
    Effect, id="encoder_gear_lash", block="sensors", graded=("half_play",), scales=(1.0,)
):
    """Play in the gear of the angle encoder (in no catalogue); `half_play` [rad]. State: angle of
    the encoder.
    """

    half_play: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(math.radians(uniform(rng, 0.04, 0.07)))

    def start(self, at: Start) -> State:
        return [at.angle]

    def tick(self, env: Env, first: int) -> Port:
        half = self.half_play

        def play(y: State) -> None:
            y[first] = min(max(y[first], y[2] - half), y[2] + half)

        return play

    def read(self, env: Env, first: int) -> Port:
        return lambda p, ps, angle, y: (p, ps, y[first])


@dataclass(frozen=True)
class EncoderError(Effect, id="encoder_error", block="sensors", graded=("first", "second")):
    """Magnetic encoder off its axis: the angle reads ``a + A sin(a + phase) + B sin(2 a + phase) +
    C sin(4 a)``, the last by the iron around it; A, B [rad], C in parts of A.
    """

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
class PressureDrift(
    Effect, id="pressure_zero_drift", block="sensors", graded=("size",), needs_clock=True
):
    """Zero of the muscle pressure transducer that wanders while it warms up (in no catalogue);
    `size` [Pa], times in s.
    """

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
