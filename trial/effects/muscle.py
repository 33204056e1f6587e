"""Effects in the muscles: friction, memory, damping, onset, softening, contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .base import Effect, Env, Port, Setting, Start, State, drawn, uniform


@dataclass(frozen=True)
class Hysteresis(Effect, id="muscle_hysteresis", block="muscle", graded=("friction",)):
    """Friction of the braid, scaled by ``gauge pressure / reference_pressure``.

    `form` "bouc_wen": one state ``z' = x'/d (1 - |z|^n (beta sgn(x' z) + 1 - beta))``; "dahl_bank":
    many states ``z_i' = x'/d_i (1 - sgn(x') z_i)``, a smooth Maxwell-slip bank. `friction` [N] and
    `distance` [m] have one entry per state; x is the contraction.
    """

    form: str
    friction: tuple[float, ...]
    distance: tuple[float, ...]
    reference_pressure: float
    exponent: float = 1.0
    beta: float = 0.6

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        reference = 4.0e5
        total = 600.0 * uniform(rng, 0.75, 1.3)  # all muscles, at the reference pressure
        if rng.random() < 0.5:
            d = uniform(rng, 0.8e-3, 2.0e-3)
            return cls(
                "bouc_wen",
                (total,),
                (d,),
                reference,
                uniform(rng, 1.0, 1.6),
                uniform(rng, 0.5, 0.7),
            )
        distances = np.geomspace(0.15e-3, 6.0e-3, 6)
        weights = rng.uniform(0.6, 1.4, 6)
        weights *= total / weights.sum()
        return cls("dahl_bank", tuple(weights.tolist()), tuple(distances.tolist()), reference)

    def start(self, at: Start) -> State:
        return [0.0] * len(self.friction)

    def sizes(self) -> State:
        return [1.0] * len(self.friction)

    def force(self, env: Env, first: int) -> Port:
        rows = [
            (first + j, w, 1.0 / d)
            for j, (w, d) in enumerate(zip(self.friction, self.distance, strict=True))
        ]
        dahl, n, beta, reference = (
            self.form == "dahl_bank",
            self.exponent,
            self.beta,
            self.reference_pressure,
        )

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            total, back = 0.0, v < 0.0
            for j, w, rate in rows:
                z = y[j]
                if dahl:
                    d[j] = v * rate * (1.0 + z if back else 1.0 - z)
                else:
                    sign = -1.0 if (z < 0.0) != back else 1.0
                    d[j] = v * rate * (1.0 - abs(z) ** n * (beta * sign + 1.0 - beta))
                total += w * z
            return total * pg / reference if pg > 0.0 else 0.0

        return resist


@dataclass(frozen=True)
class Creep(Effect, id="muscle_creep", block="muscle", graded=("stiffness",)):
    """Stress relaxation over three decades: parallel branches whose stiffness falls with their time
    constant.

    ``F = sum k_i (x - x_i)``, ``x_i' = (x - x_i)/tau_i``, k_i ~ tau_i^-`power`; `stiffness` [N/m]
    of all muscles and all branches together, time constants [s].
    """

    stiffness: float
    power: float
    time_constant: tuple[float, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        quick = uniform(rng, 1.0, 2.5)
        step = uniform(rng, 3.5, 6.0)
        return cls(
            uniform(rng, 3.0e3, 5.0e3),
            uniform(rng, 0.05, 0.3),
            (quick, quick * step, quick * step**2),
        )

    def start(self, at: Start) -> State:
        return [at.contraction] * len(self.time_constant)

    def sizes(self) -> State:
        return [0.05] * len(self.time_constant)

    def force(self, env: Env, first: int) -> Port:
        weights = [tau**-self.power for tau in self.time_constant]
        rows = [
            (first + j, self.stiffness * w / sum(weights), 1.0 / tau)
            for j, (w, tau) in enumerate(zip(weights, self.time_constant, strict=True))
        ]

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            total = 0.0
            for j, k, rate in rows:
                gap = x - y[j]
                d[j] = gap * rate
                total += k * gap
            return total

        return resist


@dataclass(frozen=True)
class RateDamping(Effect, id="muscle_rate_damping", block="muscle", graded=("damping",)):
    """Shear-thinning friction of the thread in the rubber: ``F = b (1 + pg/p_r) v_r asinh(v/v_r)``,
    weaker on extension.

    `damping` b [N s/m] of all muscles without pressure, `pressure` p_r [Pa], `speed` v_r [m/s],
    `asymmetry` -1..1.
    """

    damping: float = drawn(1.5e3, 3.0e3)
    pressure: float = drawn(0.5e5, 1.5e5)
    speed: float = drawn(0.01, 0.03)
    asymmetry: float = drawn(0.2, 0.5)

    def force(self, env: Env, first: int) -> Port:
        b, pr, vr, skew, asinh, sqrt = (
            self.damping,
            self.pressure,
            self.speed,
            self.asymmetry,
            math.asinh,
            math.sqrt,
        )

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            s = v / vr
            side = 1.0 + skew * s / sqrt(1.0 + s * s)
            return b * (1.0 + (pg / pr if pg > 0.0 else 0.0)) * vr * asinh(s) * side

        return resist


@dataclass(frozen=True)
class ActivationPressure(Effect, id="activation_pressure", block="muscle", graded=("threshold",)):
    """Pressure spent on laying the bladder against the braid: ``lost = pg p_th / (pg + p_th)``,
    `threshold` p_th [Pa].
    """

    threshold: float = drawn(5.0e3, 15.0e3)

    def lost_pressure(self, env: Env) -> Port:
        th = self.threshold
        return lambda pg: pg * th / (pg + th) if pg > 0.0 else 0.0


@dataclass(frozen=True)
class Mullins(Effect, id="mullins_softening", block="muscle", graded=("damage",), scales=(0.05,)):
    """Softening of the bladder below the largest contraction of the past.

    The elastic torque falls by ``damage (1 - exp(-(x_max - x)/w))``; `worked` [m] is the
    contraction before the recording, `width` w [m]. State: x_max.
    """

    damage: float = drawn(0.05, 0.1)
    width: float = drawn(4.0e-3, 9.0e-3)
    worked: float = drawn(0.0, 8.0e-3)

    def most(self) -> float:
        return 0.9 / self.damage if self.damage else 1.0

    def start(self, at: Start) -> State:
        return [max(at.contraction, self.worked)]

    def elastic(self, env: Env, first: int) -> Port:
        damage, width, exp = self.damage, self.width, math.exp

        def soften(x: float, torque: float, y: State) -> float:
            below = y[first] - x
            return -damage * (1.0 - exp(-below / width)) * torque if below > 0.0 else 0.0

        return soften

    def tick(self, env: Env, first: int) -> Port:
        contraction = env.tables.contraction

        def largest(y: State) -> None:
            x = contraction(y[2])
            if x > y[first]:
                y[first] = x

        return largest


@dataclass(frozen=True)
class Crowding(Effect, id="pam_crowding_contact", block="muscle", graded=("stiffness",)):
    """Contact of swelling neighbours: ``F = c pg (x - x_c)^1.5`` against contraction, with a little
    friction.

    `stiffness` c [m2/m^1.5] of all muscles, `onset` x_c [m], `rubbing` share of the force as
    friction.
    """

    stiffness: float = drawn(0.1, 0.2)
    onset: float = drawn(0.014, 0.021)
    rubbing: float = drawn(0.0, 0.15)

    def force(self, env: Env, first: int) -> Port:
        c, onset, rub = self.stiffness, self.onset, self.rubbing

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            over = x - onset
            if over <= 0.0 or pg <= 0.0:
                return 0.0
            return float(c * pg * over**1.5 * (1.0 + rub * math.tanh(v / 1.0e-3)))

        return resist


@dataclass(frozen=True)
class Buckling(Effect, id="muscle_buckling", block="muscle", graded=("push",)):
    """Muscles that fold while they carry little pressure push back (in no catalogue).

    ``F = F_b (x/w) exp(1 - x/w) / (1 + (pg/p_b)^2)``, `push` F_b [N], `length` w [m], `pressure`
    p_b [Pa].
    """

    push: float = drawn(60.0, 120.0)
    length: float = drawn(3.0e-3, 8.0e-3)
    pressure: float = drawn(0.8e5, 1.6e5)

    def force(self, env: Env, first: int) -> Port:
        push, w, pb, exp = self.push, self.length, self.pressure, math.exp

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            if x <= 0.0:
                return 0.0
            s, r = x / w, pg / pb
            return push * s * exp(1.0 - s) / (1.0 + r * r)

        return resist
