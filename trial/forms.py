"""Forms of effects that the first plans lack: further equations of the same families."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .effects.base import (
    RECORDING_PERIOD,
    REFERENCE_DENSITY,
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


def sonic(pressure: float, ambient: float, conductance: float, ratio: float = 0.3) -> float:
    """Mass flow [kg/s] to ambient through a sonic conductance [m3/(s Pa)] of ISO 6358."""
    if pressure <= ambient:
        return 0.0
    r = ambient / pressure
    if r <= ratio:
        psi = 1.0
    else:
        # a straight line near a ratio of 1, as the standard allows
        edge = min(r, 0.999)
        psi = math.sqrt(1.0 - ((edge - ratio) / (1.0 - ratio)) ** 2) * (
            1.0 if r <= 0.999 else (1.0 - r) / 0.001
        )
    return conductance * REFERENCE_DENSITY * pressure * psi


@dataclass(frozen=True)
class OrificeTankLeak(Effect, id="supply_leak", block="supply", graded=("conductance",)):
    """Hole in the tank: a sonic conductance C [m3/(s Pa)]."""

    conductance: float = drawn(0.8e-11, 1.4e-11)

    def tank(self, env: Env, first: int) -> Port:
        pa, c = env.par.ambient, self.conductance
        gain = env.par.gas_constant * env.par.temperature / env.par.supply_volume
        return lambda ps, m_in, y, d: -gain * sonic(ps, pa, c)


@dataclass(frozen=True)
class Play(Effect, id="valve_hysteresis", block="valve", graded=("half_width",)):
    """Play of the spool of +- `half_width` of half the stroke."""

    half_width: float = drawn(0.0015, 0.003)

    def most(self) -> float:
        return 0.1 / max(self.half_width, 1e-9)

    def shaper(self, env: Env) -> Port:
        half, place = self.half_width, [0.0]

        def follow(x: float, t: float) -> float:
            place[0] = min(max(place[0], x - half), x + half)
            return place[0]

        return follow


@dataclass(frozen=True)
class FadingLeakage(Effect, id="valve_centre_leakage", block="valve", graded=("conductance",)):
    """Leakage of both lands, sonic conductance [m3/(s Pa)] that fades as ``exp(-|x|/reach)``."""

    conductance: float = drawn(0.8e-11, 1.5e-11)
    reach: float = drawn(0.02, 0.05)

    def gap(self, env: Env, first: int) -> Port:
        c, reach, pa = self.conductance, self.reach, env.par.ambient

        def flows(x: float, ps: float, p: float) -> tuple[float, float]:
            now = c * math.exp(-abs(x) / reach)
            return sonic(ps, p, now), sonic(p, pa, now)

        return flows


@dataclass(frozen=True)
class JitterDelay(Effect, id="input_path_lag", block="valve", graded=("pure",)):
    """Dead time [s] of the command that jitters: the far end reads it on a clock of its own, so
    that up to `jitter` of the delay comes or goes from sample to sample.
    """

    pure: float = drawn(0.012, 0.02)
    jitter: float = drawn(0.3, 0.6)
    beat: float = drawn(3.0, 7.0)

    def most(self) -> float:
        return 0.2 / max(self.pure, 1e-9)

    def shaper(self, env: Env) -> Port:
        past: list[tuple[float, float]] = []

        def late(x: float, t: float) -> float:
            if past and t < past[-1][0]:
                past.clear()
            past.append((t, x))
            beat = (t * self.beat) % 1.0
            at = t - self.pure * (1.0 + self.jitter * (beat - 0.5))
            while len(past) > 2 and past[1][0] <= at:
                past.pop(0)
            if len(past) < 2 or at <= past[0][0]:
                return past[0][1]
            (a, u), (b, v) = past[0], past[1]
            return u + (v - u) * min((at - a) / (b - a), 1.0)

        return late


@dataclass(frozen=True)
class ElasticHose(Effect, id="tube_flow_restriction", block="line", graded=("turbulent",)):
    """Hose that widens with pressure: ``pv^2 - p^2 = b m |m| / (1 + pg/pe)^4``; the transducer sits
    at the valve.
    """

    turbulent: float = drawn(1.0e15, 2.0e15)
    pressure: float = drawn(1.0e6, 2.0e6)

    def line(self, env: Env) -> Port:
        b, pe, pa = self.turbulent, self.pressure, env.par.ambient

        def port(m: float, p: float) -> float:
            wide = (1.0 + max(p - pa, 0.0) / pe) ** 4
            return math.sqrt(max(p * p + m * abs(m) * b / wide, 1.0e6))

        return port


@dataclass(frozen=True)
class SealLeak(Effect, id="leak_muscle", block="chamber", graded=("conductance",)):
    """Seal at the end fitting that leaks only where the muscle is shorter than `onset` [m]."""

    conductance: float
    onset: float
    width: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(uniform(rng, 1.5e-10, 3.0e-10), uniform(rng, 0.01, 0.016), 0.004)

    def seal(self, env: Env) -> Port:
        pa, place = env.par.ambient, env.tables.contraction

        def flow(p: float, angle: float) -> float:
            share = min(max((place(angle) - self.onset) / self.width, 0.0), 1.0)
            return sonic(p, pa, self.conductance * share * share * (3.0 - 2.0 * share))

        return flow


@dataclass(frozen=True)
class CrackLeak(Effect, id="leak_muscle", block="chamber", graded=("rate",)):
    """Leak through cracks: ``m = k pg^n`` with the flow `rate` [kg/s] at 4 bar gauge."""

    rate: float = drawn(0.6e-4, 1.2e-4)
    exponent: float = drawn(1.1, 1.4)

    def leak(self, env: Env) -> Port:
        pa = env.par.ambient

        def flow(p: float, temperature: float) -> float:
            return float(self.rate * (max(p - pa, 0.0) / 4.0e5) ** self.exponent)

        return flow


@dataclass(frozen=True)
class LuGre(Effect, id="muscle_hysteresis", block="muscle", graded=("friction",), scales=(0.001,)):
    """Bristles of the braid whose stiffness falls with pressure, ``z' = v - |v| z / d(pg)``, on a
    friction proportional to gauge pressure; `friction` [N] at 4 bar, `distance` d [m] there.
    """

    friction: float = drawn(450.0, 800.0)
    distance: float = drawn(0.6e-3, 1.5e-3)
    loss: float = drawn(0.005, 0.02)

    def force(self, env: Env, first: int) -> Port:
        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            load = max(pg, 0.0) / 4.0e5
            deep = self.distance * (0.4 + 0.6 * min(load, 2.0))
            rate = v - abs(v) * y[first] / deep
            d[first] = rate
            return float(self.friction * load * (y[first] + self.loss * rate) / deep)

        return resist


@dataclass(frozen=True)
class OneWay(Effect, id="muscle_hysteresis", block="muscle", graded=("friction",), scales=(1.0,)):
    """Dahl friction of the braid, proportional to gauge pressure and wider while it lengthens."""

    friction: float = drawn(500.0, 800.0)
    distance: float = drawn(0.6e-3, 1.8e-3)
    share: float = drawn(0.2, 0.5)

    def force(self, env: Env, first: int) -> Port:
        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            z = y[first]
            d[first] = v / self.distance * (1.0 + z if v < 0.0 else 1.0 - z)
            wide = 1.0 if z < 0.0 else self.share
            return self.friction * max(pg, 0.0) / 4.0e5 * z * wide

        return resist


@dataclass(frozen=True)
class ForceRelaxation(
    Effect, id="muscle_creep", block="muscle", graded=("share",), scales=(1.0e3,)
):
    """A share of the muscles' whole force lags by `time_constant` [s]: it falls at rest."""

    share: float = drawn(0.02, 0.04)
    time_constant: float = drawn(2.0, 8.0)

    def most(self) -> float:
        return 0.4 / self.share if self.share else 1.0

    def force(self, env: Env, first: int) -> Port:
        pull = env.tables.pull

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            whole = pull(y[2], pg)[0]
            d[first] = (whole - y[first]) / self.time_constant
            return self.share * y[first]

        return resist


@dataclass(frozen=True)
class Viscous(Effect, id="muscle_rate_damping", block="muscle", graded=("constant", "slope")):
    """``F = (b0 + b1 pg) v``, `lengthening` times as much while the muscle lengthens."""

    constant: float = drawn(500.0, 1500.0)
    slope: float = drawn(0.005, 0.015)
    lengthening: float = drawn(0.3, 0.9)

    def force(self, env: Env, first: int) -> Port:
        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            side = self.lengthening if v < 0.0 else 1.0
            return (self.constant + self.slope * max(pg, 0.0)) * v * side

        return resist


@dataclass(frozen=True)
class ExponentialOnset(Effect, id="activation_pressure", block="muscle", graded=("threshold",)):
    """Pressure spent on the bladder, ``lost = th (1 - exp(-pg/th))``."""

    threshold: float = drawn(5.0e3, 15.0e3)

    def lost_pressure(self, env: Env) -> Port:
        th = self.threshold
        return lambda pg: th * (1.0 - math.exp(-pg / th)) if pg > 0.0 else 0.0


@dataclass(frozen=True)
class DeadBand(Effect, id="activation_pressure", block="muscle", graded=("threshold",)):
    """Nothing happens below a gauge pressure `threshold` [Pa], which stays lost above it."""

    threshold: float = drawn(5.0e3, 15.0e3)

    def lost_pressure(self, env: Env) -> Port:
        th = self.threshold
        return lambda pg: min(pg, th) if pg > 0.0 else 0.0


@dataclass(frozen=True)
class PressureSoftening(
    Effect, id="mullins_softening", block="muscle", graded=("damage",), scales=(1.0e5,)
):
    """Softening below the largest gauge pressure of the past; state: that pressure [Pa]."""

    damage: float = drawn(0.05, 0.1)
    width: float = drawn(0.5e5, 1.2e5)

    def most(self) -> float:
        return 0.9 / self.damage if self.damage else 1.0

    def elastic(self, env: Env, first: int) -> Port:
        pa = env.par.ambient

        def soften(x: float, torque: float, y: State) -> float:
            below = y[first] - (y[0] - pa)
            return -self.damage * (1.0 - math.exp(-max(below, 0.0) / self.width)) * torque

        return soften

    def tick(self, env: Env, first: int) -> Port:
        pa = env.par.ambient

        def largest(y: State) -> None:
            y[first] = max(y[first], y[0] - pa)

        return largest


@dataclass(frozen=True)
class AngleFriction(Effect, id="joint_coulomb_stribeck", block="joint", graded=("friction",)):
    """Break-away friction of a joint whose bearing is tighter at some angles (rad)."""

    friction: float = drawn(1.0, 2.0)
    speed: float = drawn(0.1, 0.3)
    order: float = drawn(2.0, 4.0)
    phase: float = drawn(0.0, 6.0)

    def torque(self, env: Env, first: int) -> Port:
        def drag(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            tight = 1.0 + 0.8 * math.sin(self.order * angle + self.phase)
            s = rate / 6.0e-3
            sign = s / math.sqrt(1.0 + s * s)
            return -self.friction * tight * sign * (0.5 + 0.5 * math.exp(-abs(rate) / self.speed))

        return drag


@dataclass(frozen=True)
class SlidingMass(Effect, id="payload_change", block="arm", graded=("mass",), scales=(1.0,)):
    """Mass [kg] that slides along the arm by `way` [m] when it is steep; state: its place, 0..1."""

    mass: float
    way: float
    angle: float
    time_constant: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            uniform(rng, 0.1, 0.3),
            uniform(rng, 0.1, 0.2),
            math.radians(uniform(rng, 45.0, 65.0)),
            uniform(rng, 0.3, 1.0),
        )

    def most(self) -> float:
        return 6.0 / self.mass if self.mass else 1.0

    def torque(self, env: Env, first: int) -> Port:
        lever = self.mass * env.par.gravity * self.way

        def weight(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            there = 0.5 + 0.5 * math.tanh((angle - self.angle) / 0.1)
            d[first] = (there - y[first]) / self.time_constant
            return lever * y[first] * math.sin(angle)

        return weight


@dataclass(frozen=True)
class Waves(Effect, id="external_torque", block="arm", graded=("size",), needs_clock=True):
    """Torque [N m] on the arm as a sum of sines of angular frequencies [rad/s]: a steady vibration
    (one or two), or wind (many, the slow ones stronger).
    """

    size: tuple[float, ...]
    rate: tuple[float, ...]
    phase: tuple[float, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls.of(rng, 2)

    @classmethod
    def of(cls, rng: np.random.Generator, count: int) -> Self:
        """`count` sines: up to two of 0.5 to 3 Hz, more of 0.03 to 1.5 Hz in a red spectrum."""
        few = count <= 2
        low, high = (0.5, 3.0) if few else (0.03, 1.5)
        rate = 2.0 * math.pi * np.exp(rng.uniform(math.log(low), math.log(high), count))
        size = np.ones(count) if few else 1.0 / (1.0 + (rate / 1.0) ** 1.6)
        size *= uniform(rng, 0.4, 0.8) / math.sqrt(float((size**2).sum()))
        phase = rng.uniform(0.0, 2.0 * math.pi, count)
        return cls(tuple(size.tolist()), tuple(rate.tolist()), tuple(phase.tolist()))

    def torque(self, env: Env, first: int) -> Port:
        clock, rows = env.clock, list(zip(self.size, self.rate, self.phase, strict=True))

        def push(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            t = y[clock]
            return sum(a * math.sin(w * t + f) for a, w, f in rows)

        return push


@dataclass(frozen=True)
class TwoOpenings(Effect, id="valve_area", block="valve", graded=("difference",)):
    """A share `difference` more opening where the valve fills, less where it vents; no wider than
    the stroke.
    """

    difference: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        sign = either_sign(rng)
        return cls(sign * uniform(rng, 0.05, 0.15))

    def most(self) -> float:
        return 0.8 / max(abs(self.difference), 1e-9)

    def shaper(self, env: Env) -> Port:
        more, less = 1.0 + self.difference, 1.0 - self.difference
        return lambda x, t: min(x * more, 1.0) if x > 0.0 else max(x * less, -1.0)


@dataclass(frozen=True)
class BentOpening(Effect, id="valve_area", block="valve", graded=("bend",)):
    """Opening that bends over the stroke, ``x (1 + b (1 - |x|))``; the ends stay."""

    bend: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        sign = either_sign(rng)
        return cls(sign * uniform(rng, 0.1, 0.3))

    def most(self) -> float:
        return 0.8 / max(abs(self.bend), 1e-9)

    def shaper(self, env: Env) -> Port:
        return lambda x, t: x * (1.0 + self.bend * max(1.0 - abs(x), 0.0))


@dataclass(frozen=True)
class FirstOrderReading(
    Effect, id="pressure_lag", block="sensors", graded=("lag",), scales=(1.0e5,)
):
    """First-order lag [s] of the transducer of the muscle pressure."""

    lag: float = drawn(0.02, 0.03)

    def most(self) -> float:
        return 0.5 / max(self.lag, 1e-9)

    def start(self, at: Start) -> State:
        return [at.pressure]

    def follow(self, env: Env, first: int) -> Port:
        # a lag below 0.3 ms cannot be seen and would only make the equations stiff
        if self.lag < 3.0e-4:
            return None

        def rate(p: float, y: State, d: State) -> None:
            d[first] = (p - y[first]) / self.lag

        return rate

    def read(self, env: Env, first: int) -> Port:
        if self.lag < 3.0e-4:
            return None
        pa = env.par.ambient
        return lambda p, ps, angle, y: (y[first] - pa, ps, angle)


@dataclass(frozen=True)
class ClockJitter(Effect, id="clock_skew", block="sensors", graded=("offset",)):
    """Log of the pressures whose stamps are late by `offset` [s] and wander by a share of it."""

    offset: float = drawn(6.0e-3, 12.0e-3)
    share: float = drawn(0.4, 0.8)
    beat: float = drawn(3.0, 9.0)

    def most(self) -> float:
        return 0.3 / max(abs(self.offset), 1e-9)

    def warp(self) -> Port:
        def late(t: float) -> tuple[float, float, float]:
            local = t % RECORDING_PERIOD
            wander = math.sin(2.0 * math.pi * self.beat * local)
            wander += math.sin(2.0 * math.pi * 1.618 * self.beat * local)
            shift = self.offset * (1.0 + 0.5 * self.share * wander)
            return shift, shift, 0.0

        return late
