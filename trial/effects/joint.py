"""Effects in the joint and its transmission."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .base import Effect, Env, Port, Setting, State, drawn, uniform


@dataclass(frozen=True)
class Stribeck(Effect, id="joint_coulomb_stribeck", block="joint", graded=("friction",)):
    """Break-away friction on top of the baseline: ``f / (1 + (w/w_s)^2)`` against the motion, more
    one way.

    `friction` f [N m], `speed` w_s [rad/s], `turn` [rad/s] over which the sign changes (algebraic
    sigmoid), `asymmetry` -1..1.
    """

    friction: float = drawn(1.0, 2.0)
    speed: float = drawn(0.04, 0.12)
    turn: float = drawn(4.0e-3, 8.0e-3)
    asymmetry: float = drawn(-0.2, 0.2)

    def torque(self, env: Env, first: int) -> Port:
        f, ws, turn, skew, sqrt = self.friction, self.speed, self.turn, self.asymmetry, math.sqrt

        def drag(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            s, r = rate / turn, rate / ws
            sign = s / sqrt(1.0 + s * s)
            return -f * sign * (1.0 + skew * sign) / (1.0 + r * r)

        return drag


@dataclass(frozen=True)
class EndStop(Effect, id="joint_end_stop", block="joint", graded=("stiffness",)):
    """Rubber bumper inside the range: progressive, with loss in compression.

    ``tau = -k d (1 + (d/d0)^2) (1 + loss rate)``, never pulling; `angle` [rad] where it touches,
    `stiffness` k [N m/rad], `depth` d0 [rad], `loss` [s/rad].
    """

    angle: float
    stiffness: float
    depth: float
    loss: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            math.radians(uniform(rng, 50.0, 62.0)),
            uniform(rng, 10.0, 20.0),
            math.radians(uniform(rng, 6.0, 15.0)),
            uniform(rng, 0.1, 0.5),
        )

    def torque(self, env: Env, first: int) -> Port:
        at, k, d0, loss = self.angle, self.stiffness, self.depth, self.loss

        def stop(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            deep = angle - at
            if deep <= 0.0:
                return 0.0
            r = deep / d0
            return -k * deep * (1.0 + r * r) * max(1.0 + loss * rate, 0.0)

        return stop


@dataclass(frozen=True)
class HoseTorque(Effect, id="hose_torque", block="joint", graded=("spring", "slip"), scales=(1.0,)):
    """Hose laid over the joint: a spring that stiffens with pressure and slips in its clamps (in no
    catalogue).

    `spring` [N m] amplitude of ``-sin(2 (angle - rest))``, `pressure` [Pa] that doubles it, `slip`
    [N m] of a Dahl element with the angle `give` [rad].
    """

    spring: float
    slip: float
    rest: float
    pressure: float
    give: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            uniform(rng, 0.4, 0.8),
            uniform(rng, 0.2, 0.4),
            math.radians(uniform(rng, 20.0, 45.0)),
            uniform(rng, 0.8e5, 2.0e5),
            math.radians(uniform(rng, 1.0, 4.0)),
        )

    def torque(self, env: Env, first: int) -> Port:
        spring, slip, rest, pr, give, sin = (
            self.spring,
            self.slip,
            self.rest,
            self.pressure,
            self.give,
            math.sin,
        )

        def pull(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            z = y[first]
            d[first] = rate / give * (1.0 + z if rate < 0.0 else 1.0 - z)
            stiff = 1.0 + (pg / pr if pg > 0.0 else 0.0)
            return -spring * stiff * sin(2.0 * (angle - rest)) - slip * z

        return pull


@dataclass(frozen=True)
class TendonCompliance(Effect, id="tendon_compliance", block="joint", graded=("compliance",)):
    """Tendon and brackets stretch: the muscles shorten further, ``s = c F`` (in no catalogue).

    `compliance` c [m/N] for the force F of all muscles; one Newton step on the muscle stiffness.
    """

    compliance: float = drawn(1.0e-6, 2.0e-6)

    def gear(self, env: Env) -> Port:
        c, pull = self.compliance, env.tables.pull

        def stretched(angle: float, pg: float) -> tuple[float, float]:
            force, slope, arm = pull(angle, pg)
            if force <= 0.0:
                return angle, 1.0
            shifted = angle + c * force / (1.0 - c * min(slope, 0.0)) / arm
            return shifted, arm / pull(shifted, pg)[2]

        return stretched


@dataclass(frozen=True)
class MomentArm(Effect, id="moment_arm_error", block="joint", graded=("error",)):
    """Tendon geometry wrong by more than its tolerance (in no catalogue).

    The muscles see the angle ``a + e sin(n a + phase)``, so force arm and volume stay consistent;
    `error` e [rad], `order` n.
    """

    error: float
    order: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(
            math.radians(uniform(rng, 0.05, 0.1)),
            uniform(rng, 2.0, 3.5),
            uniform(rng, 0.0, 2.0 * math.pi),
        )

    def gear(self, env: Env) -> Port:
        e, n, phase, sin, cos = self.error, self.order, self.phase, math.sin, math.cos
        return lambda angle, pg: (
            angle + e * sin(n * angle + phase),
            1.0 + e * n * cos(n * angle + phase),
        )
