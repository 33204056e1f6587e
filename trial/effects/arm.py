"""Effects in the arm, its payload, its surroundings and its base."""

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
class PayloadSwing(Effect, id="payload_swing", block="arm", graded=("share",), scales=(1.0, 1.0)):
    """Part of the payload hangs on a rope of `length` [m] and swings, braked by the air:
    ``-q phi' |phi'|``.

    `share` of the payload, `drag` q [1/rad], `loss` damping ratio of the knot. States: angle from
    the vertical [rad] and its rate.
    """

    share: float = drawn(0.01, 0.02)
    length: float = drawn(0.12, 0.45)
    drag: float = drawn(0.02, 0.1)
    loss: float = drawn(0.003, 0.02)

    def most(self) -> float:
        return 1.0 / self.share if self.share else 1.0

    def motion(self, env: Env, first: int) -> Port:
        par = env.par
        mass, la, rope, g = self.share * par.payload, par.length, self.length, par.gravity
        drag, loss, second = self.drag, 2.0 * self.loss * math.sqrt(g / rope), first + 1
        sin, cos = math.sin, math.cos

        def accelerate(
            torque: float,
            angle: float,
            rate: float,
            inertia: float,
            weight: float,
            y: State,
            d: State,
        ) -> float:
            phi, spin = y[first], y[second]
            c, s = cos(angle - phi), sin(angle - phi)
            # phi'' = free - (la/rope) c angle'', put into the equation of the arm
            free = (
                la / rope * s * rate * rate - g / rope * sin(phi) - (drag * abs(spin) + loss) * spin
            )
            lever = mass * la * rope
            alpha = (torque - weight * sin(angle) - lever * (c * free + s * spin * spin)) / (
                inertia - mass * la * la * c * c
            )
            d[first] = spin
            d[second] = free - la / rope * c * alpha
            return alpha

        return accelerate


def _ease(s: float) -> float:
    """Smooth step from 0 to 1."""
    return 0.0 if s <= 0.0 else 1.0 if s >= 1.0 else s * s * (3.0 - 2.0 * s)


@dataclass(frozen=True)
class PayloadChange(Effect, id="payload_change", block="arm", graded=("mass",), needs_clock=True):
    """Mass is added or taken during a recording, over a time as with sand or a gripper.

    One entry per event: `time` [s] (recording number times 1000 plus the time in it), `mass` [kg],
    `span` [s]. Every recording starts with the nominal load.
    """

    time: tuple[float, ...]
    mass: tuple[float, ...]
    span: tuple[float, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        n = setting.recordings
        start = [
            RECORDING_PERIOD * i + setting.duration * uniform(rng, 0.3, 0.65) for i in range(n)
        ]
        sign = either_sign(rng)
        mass = sign * uniform(rng, 0.025, 0.05)
        return cls(tuple(start), (mass,) * n, (uniform(rng, 0.2, 2.0),) * n)

    def most(self) -> float:
        return 6.0 / max(abs(m) for m in self.mass) if any(self.mass) else 1.0

    def load(self, env: Env) -> Port:
        events = dict.fromkeys(range(64), (0.0, 0.0, 1.0))
        events.update(
            {
                int(t // RECORDING_PERIOD): (t, m, s)
                for t, m, s in zip(self.time, self.mass, self.span, strict=True)
            }
        )

        def added(t: float) -> float:
            at, mass, span = events[int(t // RECORDING_PERIOD)]
            return mass * _ease((t - at) / span)

        return added


@dataclass(frozen=True)
class ExternalTorque(Effect, id="external_torque", block="arm", graded=("size",), needs_clock=True):
    """Pushes on the arm: ``tau sin^2`` over a span, with a tail that dies out, at times that no
    command knows.

    One entry per push: `time` [s] (recording number times 1000 plus the time in it), `size` [N m],
    `span` [s].
    """

    time: tuple[float, ...]
    size: tuple[float, ...]
    span: tuple[float, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        time: list[float] = []
        for i in range(setting.recordings):
            # slots keep the pushes apart
            slots = rng.choice(5, int(rng.integers(2, 4)), replace=False)
            time += [
                RECORDING_PERIOD * i
                + setting.duration * (0.08 + 0.17 * float(s) + uniform(rng, 0.0, 0.06))
                for s in sorted(slots)
            ]
        size = tuple(float(rng.choice([-1.0, 1.0])) * uniform(rng, 0.8, 2.0) for _ in time)
        return cls(tuple(time), size, tuple(uniform(rng, 0.4, 2.5) for _ in time))

    def torque(self, env: Env, first: int) -> Port:
        by_recording: dict[int, list[tuple[float, float, float]]] = {}
        for t, size, span in zip(self.time, self.size, self.span, strict=True):
            by_recording.setdefault(int(t // RECORDING_PERIOD), []).append((t, size, span))
        clock, sin, pi = env.clock, math.sin, math.pi

        def push(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            now, total = y[clock], 0.0
            for t, size, span in by_recording.get(int(now // RECORDING_PERIOD), ()):
                s = (now - t) / span
                if 0.0 < s < 1.0:
                    w = sin(pi * s)
                    total += size * w * w * (1.3 - 0.6 * s)
            return total

        return push


@dataclass(frozen=True)
class BaseFlexibility(
    Effect, id="base_flexibility", block="arm", graded=("compliance",), scales=(0.1, 1.0)
):
    """Mounting that yields under the joint torque, stiffer when bent further; the encoder sits on
    the joint.

    ``q'' = -w^2 (q + c tau + r q^3) - 2 z w q'`` with `compliance` c [rad/(N m)], `frequency` w/2pi
    [Hz], `damping` z, `hardening` r [1/rad2]. States: tilt of the base [rad] and its rate.
    """

    compliance: float = drawn(1.0e-5, 2.0e-5)
    frequency: float = drawn(3.0, 9.0)
    damping: float = drawn(0.01, 0.05)
    hardening: float = drawn(0.0, 200.0)

    def start(self, at: Start) -> State:
        return [-self.compliance * at.weight, 0.0]

    def motion(self, env: Env, first: int) -> Port:
        c, w, r, second = self.compliance, 2.0 * math.pi * self.frequency, self.hardening, first + 1
        w2, loss, sin = w * w, 2.0 * self.damping * w, math.sin

        def accelerate(
            torque: float,
            angle: float,
            rate: float,
            inertia: float,
            weight: float,
            y: State,
            d: State,
        ) -> float:
            q, turn = y[first], y[second]
            bend = -w2 * (q + c * torque + r * q * q * q) - loss * turn
            d[first] = turn
            d[second] = bend
            return (torque - weight * sin(angle + q)) / inertia - bend

        return accelerate
