"""Effects in the valve, its command path and the line behind it."""

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
    State,
    drawn,
    either_sign,
    log_uniform,
    uniform,
)


@dataclass(frozen=True)
class DeadZone(
    Effect, id="valve_dead_zone", block="valve", graded=("supply_width", "exhaust_width")
):
    """Overlap of the spool, normalised widths of both edges; clearance rounds the corner over
    `rounding` widths.
    """

    supply_width: float = drawn(0.02, 0.04)
    exhaust_width: float = drawn(0.02, 0.04)
    rounding: float = drawn(0.08, 0.2)

    def most(self) -> float:
        return 0.3 / max(self.supply_width, self.exhaust_width, 1e-9)

    def opening(self, x: float) -> float:
        """Effective opening, -1..1, of a normalised spool command."""
        width = self.supply_width if x > 0.0 else self.exhaust_width
        if width == 0.0:
            return x
        soft2 = (self.rounding * width) ** 2
        s = abs(x) - width
        soft = s + math.sqrt(s * s + soft2)
        shut = -width + math.sqrt(width * width + soft2)
        full = 1.0 - width + math.sqrt((1.0 - width) ** 2 + soft2)
        return math.copysign((soft - shut) / (full - shut), x)

    def shaper(self, env: Env) -> Port:
        return lambda x, t: self.opening(x)


@dataclass(frozen=True)
class ValveHysteresis(Effect, id="valve_hysteresis", block="valve", graded=("half_width",)):
    """Friction of the spool: it lags the command by up to `half_width` of half the stroke.

    Dahl's law over the path of the command: ``dz = (1 - z sgn(dx)) |dx| / d sgn(dx)``, so the
    corner of the loop is round, with `d` = `bend` half widths.
    """

    half_width: float = drawn(0.0015, 0.003)
    bend: float = drawn(1.2, 2.5)

    def most(self) -> float:
        return 0.1 / max(self.half_width, 1e-9)

    def shaper(self, env: Env) -> Port:
        half, path = self.half_width, self.bend * self.half_width
        memory = [0.0, 0.0]  # command and friction

        def follow(x: float, t: float) -> float:
            if half == 0.0:
                return x
            step = x - memory[0]
            if step:
                sign = math.copysign(1.0, step)
                memory[1] = sign + (memory[1] - sign) * math.exp(-abs(step) / path)
            memory[0] = x
            return x - half * memory[1]

        return follow


@dataclass(frozen=True)
class CentreLeakage(
    Effect, id="valve_centre_leakage", block="valve", graded=("supply_land", "exhaust_land")
):
    """Laminar leakage past the lands of the spool, ``k (pu^2 - pd^2) / (1 + |x| / x_l)``: the gap
    grows longer.

    `supply_land` and `exhaust_land` are k of the two lands [kg/(s Pa2)], `reach` is x_l.
    """

    supply_land: float
    exhaust_land: float
    reach: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        k = uniform(rng, 0.5e-17, 1.0e-17)
        return cls(k, k * log_uniform(rng, 4.0, 9.0), uniform(rng, 0.01, 0.04))

    def gap(self, env: Env, first: int) -> Port:
        a, b, reach, pa2 = self.supply_land, self.exhaust_land, self.reach, env.par.ambient**2

        def flows(x: float, ps: float, p: float) -> tuple[float, float]:
            shape = 1.0 / (1.0 + abs(x) / reach)
            return a * shape * (ps * ps - p * p), b * shape * (p * p - pa2)

        return flows


@dataclass(frozen=True)
class ValveArea(Effect, id="valve_area", block="valve", graded=("excess",)):
    """Window of the sleeve that narrows beyond a knee: a share `excess` more opening per stroke
    below `knee` (a part of half the stroke), less above it, the same at the end; `venting` of it on
    the side that vents.
    """

    excess: float = drawn(0.1, 0.3)
    knee: float = drawn(0.25, 0.5)
    venting: float = drawn(0.5, 1.0)

    def most(self) -> float:
        return 0.8 * (1.0 / self.knee - 1.0) / max(self.excess, 1e-9)

    def opening(self, x: float) -> float:
        """Effective opening, -1..1, of a normalised spool command."""
        size = abs(x)
        more = self.excess if x > 0.0 else self.excess * self.venting
        low, high = size / self.knee, (1.0 - size) / (1.0 - self.knee)
        return x + math.copysign(more * self.knee * max(min(low, high), 0.0), x)

    def shaper(self, env: Env) -> Port:
        return lambda x, t: self.opening(x)


@dataclass(frozen=True)
class InputLag(Effect, id="input_path_lag", block="valve", graded=("pure", "lag"), scales=(1.0,)):
    """Pure delay [s] of the command, then a spool that follows with a time constant `lag` [s],
    slower for big steps.

    ``xs' = (s/lag) tanh((x - xs)/s)`` with `stroke` s, a part of half the full stroke.
    """

    pure: float = drawn(8.0e-3, 14.0e-3)
    lag: float = drawn(6.0e-3, 10.0e-3)
    stroke: float = drawn(0.08, 0.3)

    def most(self) -> float:
        return 0.25 / max(self.pure + self.lag, 1e-9)

    def _slow(self) -> bool:
        # a shorter lag only makes the equations stiff: it acts as a delay
        return self.lag >= 3.0e-4

    def delay(self) -> float:
        return self.pure if self._slow() else self.pure + self.lag

    def spool(self, env: Env, first: int) -> Port:
        if not self._slow():
            return None
        s, rate, tanh = self.stroke, self.stroke / self.lag, math.tanh

        def slide(x: float, y: State, d: State) -> float:
            xs = y[first]
            d[first] = rate * tanh((x - xs) / s)
            return xs

        return slide


@dataclass(frozen=True)
class TubeRestriction(
    Effect, id="tube_flow_restriction", block="line", graded=("laminar", "turbulent")
):
    """Hose between the valve manifold, where the transducer sits, and the muscles.

    Isothermal pipe flow with a laminar and a turbulent part: ``pv^2 - p^2 = a m + b m |m|``, with
    `laminar` a [Pa2 s/kg] and `turbulent` b [Pa2 s2/kg2].
    """

    laminar: float = drawn(1.0e11, 4.0e11)
    turbulent: float = drawn(4.0e14, 8.0e14)

    def line(self, env: Env) -> Port:
        a, b, sqrt = self.laminar, self.turbulent, math.sqrt

        def port(m: float, p: float) -> float:
            return sqrt(max(p * p + m * (a + b * abs(m)), 1.0e6))

        return port


@dataclass(frozen=True)
class ExhaustBackPressure(
    Effect, id="exhaust_back_pressure", block="valve", graded=("resistance",)
):
    """Silencer behind the exhaust edge: ``pe^2 - pa^2 = b m^2`` with `resistance` b [Pa2 s2/kg2]
    (in no catalogue).
    """

    resistance: float = drawn(1.0e16, 2.0e16)

    def exhaust(self, env: Env) -> Port:
        b, pa2, sqrt = self.resistance, env.par.ambient**2, math.sqrt
        return lambda m: sqrt(pa2 + b * m * abs(m)) if m > 0.0 else sqrt(pa2)


@dataclass(frozen=True)
class NullDrift(Effect, id="valve_null_drift", block="valve", graded=("warm", "wave")):
    """Null voltage that drifts with the temperature of the solenoid (in no catalogue).

    A warm-up with `time_constant` [s] by `warm` of half the stroke, and a slow wave of `wave` with
    `period` [s].
    """

    warm: float
    wave: float
    time_constant: float
    period: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        sign = either_sign(rng)
        return cls(
            sign * uniform(rng, 0.0008, 0.0015),
            uniform(rng, 0.0002, 0.0006),
            uniform(rng, 6.0, 20.0),
            uniform(rng, 14.0, 30.0),
        )

    def shaper(self, env: Env) -> Port:
        def move(x: float, t: float) -> float:
            local = t % RECORDING_PERIOD
            warm = self.warm * (1.0 - math.exp(-local / self.time_constant))
            return x - warm - self.wave * math.sin(2.0 * math.pi * t / self.period)

        return move
