"""Effects in the tank and its supply."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from .base import Effect, Env, Port, Setting, Start, State, log_uniform, uniform


@dataclass(frozen=True)
class SupplyLeak(Effect, id="supply_leak", block="supply", graded=("rate",)):
    """Leak of the tank: laminar, ``k (ps^2 - pa^2)``, or through a slit that opens with pressure,
    ``k (ps - pa)^n``.

    `rate` [kg/s] is the flow at `reference` [Pa absolute].
    """

    form: str
    rate: float
    exponent: float
    reference: float = 14.0e5

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        form = "laminar" if rng.random() < 0.5 else "slit"
        return cls(form, uniform(rng, 1.2e-5, 2.0e-5), uniform(rng, 0.6, 1.4))

    def tank(self, env: Env, first: int) -> Port:
        pa, n, laminar = env.par.ambient, self.exponent, self.form == "laminar"
        gain = env.par.gas_constant * env.par.temperature / env.par.supply_volume
        full = self.reference**2 - pa * pa if laminar else (self.reference - pa) ** n
        k = gain * self.rate / full

        def rate(ps: float, m_in: float, y: State, d: State) -> float:
            if laminar:
                return -k * (ps * ps - pa * pa)
            return -k * float(max(ps - pa, 0.0) ** n)

        return rate


@dataclass(frozen=True)
class Compressor(
    Effect,
    id="compressor_cut_in",
    block="supply",
    graded=("delivery",),
    needs_clock=True,
    scales=(1.0, 1.0),
):
    """Piston compressor between two tank pressures.

    Delivery [kg/s] falls with the back pressure by the clearance volume (`clearance`), comes up
    with a time constant `rise` [s] after the start (unloading valve), and pulsates as ``2 sin^2``
    with depth `pulsation` at `frequency` [Hz]. `on` and `off` are absolute pressures [Pa].
    """

    delivery: float
    on: float
    off: float
    clearance: float
    rise: float
    pulsation: float
    frequency: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        on = setting.supply_pressure + 101325.0 - uniform(rng, 0.02e5, 0.25e5)
        return cls(
            delivery=uniform(rng, 1.5e-4, 2.5e-4),
            on=on,
            off=on + uniform(rng, 0.3e5, 0.8e5),
            clearance=uniform(rng, 0.03, 0.06),
            rise=uniform(rng, 0.1, 0.5),
            pulsation=uniform(rng, 0.2, 0.6),
            frequency=uniform(rng, 8.0, 20.0),
        )

    def start(self, at: Start) -> State:
        running = 1.0 if at.supply < self.on else 0.0
        return [running, running]

    def tank(self, env: Env, first: int) -> Port:
        pa, clock, second = env.par.ambient, env.clock, first + 1
        gain = env.par.gas_constant * env.par.temperature / env.par.supply_volume * self.delivery
        wave, depth, spoil, rise = (
            2.0 * math.pi * self.frequency,
            self.pulsation,
            self.clearance,
            self.rise,
        )
        sin = math.sin

        def rate(ps: float, m_in: float, y: State, d: State) -> float:
            running = y[second]
            d[second] = (y[first] - running) / rise
            volumetric = 1.0 + spoil - spoil * (ps / pa) ** (1.0 / 1.3)
            s = sin(0.5 * wave * y[clock])
            return float(gain * running * volumetric * (1.0 + depth * (2.0 * s * s - 1.0)))

        return rate

    def tick(self, env: Env, first: int) -> Port:
        on, off = self.on, self.off

        def switch(y: State) -> None:
            if y[1] < on:
                y[first] = 1.0
            elif y[1] > off:
                y[first] = 0.0

        return switch


@dataclass(frozen=True)
class SupplyCooling(
    Effect, id="supply_gas_cooling", block="supply", graded=("share",), scales=(1.0,)
):
    """Gas in the tank cools while it expands and warms at the wall (in no catalogue).

    `share` is the part of the temperature change that reaches the pressure; `time_constant` [s] of
    the wall.
    """

    share: float
    time_constant: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        return cls(uniform(rng, 0.05, 0.1), log_uniform(rng, 3.0, 12.0))

    def most(self) -> float:
        return 1.2 / self.share if self.share else 1.0

    def tank(self, env: Env, first: int) -> Port:
        par, share, tau = env.par, self.share, self.time_constant
        t0, kappa = par.temperature, par.kappa
        gain = par.gas_constant * t0 / par.supply_volume

        def rate(ps: float, m_in: float, y: State, d: State) -> float:
            # excess temperature: adiabatic expansion of what stays, wall exchange
            excess = y[first]
            change = -(kappa - 1.0) * (t0 + excess) * gain * m_in / ps - excess / tau
            d[first] = change
            return float(share * ps / t0 * change)

        return rate
