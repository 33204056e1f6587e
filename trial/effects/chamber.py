"""Effects in the gas of the muscles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .base import (
    AIR_CONSTANT,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    Effect,
    Env,
    Port,
    Setting,
    Start,
    State,
    uniform,
)


@dataclass(frozen=True)
class Leak(Effect, id="leak_muscle", block="chamber", graded=("coefficient",)):
    """Leak of the muscles to ambient.

    `form` is "orifice" (ISO 6358 with `ratio` b: ``C rho0 p sqrt(T0/T) psi``), "crack" (the same
    with an area that grows by `growth` per bar of gauge pressure) or "laminar"
    (``k (p^2 - pa^2)``); `coefficient` is C [m3/(s Pa)] or k [kg/(s Pa2)].
    """

    form: str
    coefficient: float
    ratio: float = 0.3
    growth: float = 0.0

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        # time constant of a sealed chamber of 1.5e-3 m3
        tau = 150.0 / uniform(rng, 0.75, 1.3)
        conductance = 1.5e-3 / (tau * REFERENCE_DENSITY * AIR_CONSTANT * REFERENCE_TEMPERATURE)
        form = str(rng.choice(["orifice", "crack", "laminar"]))
        if form == "laminar":
            typical = 3.2e5
            return cls(form, conductance * REFERENCE_DENSITY * typical / (typical**2 - 101325.0**2))
        return cls(
            form,
            conductance,
            uniform(rng, 0.2, 0.45),
            uniform(rng, 0.1, 0.3) if form == "crack" else 0.0,
        )

    def flow(self, pressure: float, ambient: float, temperature: float) -> float:
        """Mass flow [kg/s] out of the muscle at an absolute pressure [Pa]; negative when the muscle
        sucks.
        """
        if self.form == "laminar":
            return self.coefficient * (pressure * pressure - ambient * ambient)
        up, down, sign = (
            (pressure, ambient, 1.0) if pressure >= ambient else (ambient, pressure, -1.0)
        )
        r = down / up
        if r <= self.ratio:
            psi = 1.0
        elif r > 0.999:
            knee = (0.999 - self.ratio) / (1.0 - self.ratio)
            psi = math.sqrt(1.0 - knee * knee) * (1.0 - r) / 0.001
        else:
            knee = (r - self.ratio) / (1.0 - self.ratio)
            psi = math.sqrt(1.0 - knee * knee)
        area = self.coefficient * (1.0 + self.growth * max(pressure - ambient, 0.0) / 1.0e5)
        return (
            sign
            * area
            * REFERENCE_DENSITY
            * up
            * math.sqrt(REFERENCE_TEMPERATURE / temperature)
            * psi
        )

    def leak(self, env: Env) -> Port:
        pa, flow = env.par.ambient, self.flow
        return lambda p, temperature: flow(p, pa, temperature)


@dataclass(frozen=True)
class HeatTransfer(Effect, id="heat_transfer", block="chamber", graded=("share",), scales=(30.0,)):
    """Energy balance of the gas with a temperature of its own, in place of the fixed coefficients.

    Wall exchange ``h = h0 sqrt(p T / (pa T0))`` [W/(m2 K)] over the inner wall of the muscles,
    raised while gas streams in: ``1 + jet m_in / 1 g/s``. `share` is the part of the gas that
    follows the balance, the rest follows the fixed coefficients. State: gas temperature [K].
    """

    coefficient: float
    jet: float
    share: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(uniform(rng, 25.0, 60.0), uniform(rng, 0.0, 0.8), 1.0)

    def most(self) -> float:
        return 1.0 / self.share if self.share else 1.0

    def start(self, at: Start) -> State:
        return [REFERENCE_TEMPERATURE]
