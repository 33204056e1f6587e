"""Time, air and energy to fill a volume from a constant supply through one valve, isothermal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from pamrs import _core
from pamrs._checks import positive
from pamrs.errors import ParameterError

_HEAT_CAPACITY_RATIO: Final = 1.4
_CHOKED: Final = (2.0 / (_HEAT_CAPACITY_RATIO + 1.0)) ** (
    _HEAT_CAPACITY_RATIO / (_HEAT_CAPACITY_RATIO - 1.0)
)
_LAMINAR: Final = 0.999  # the orifice law changes its form at these two ratios


@dataclass(frozen=True)
class Filling:
    """Where the air comes from: a constant supply behind one valve, isothermal.

    Parameters
    ----------
    area : float
        Effective orifice area ``Cd A`` [m2]; the default is the shoulder's valve.
    supply_pressure : float
        Gauge pressure of the supply [Pa].
    dead_volume : float
        Volume of the tubing, filled with every stroke [m3].
    ambient_pressure, temperature, gas_constant : float
        Ambient pressure [Pa, absolute], temperature [K], gas constant [J/(kg K)].

    Raises
    ------
    ParameterError
        If a number is not finite and above zero (the dead volume may be zero).
    """

    area: float = 8.4e-6
    supply_pressure: float = 13.8e5
    dead_volume: float = 0.0
    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05

    def __post_init__(self) -> None:
        for name in ("area", "supply_pressure", "ambient_pressure", "temperature", "gas_constant"):
            positive(name, getattr(self, name))
        positive("dead_volume", self.dead_volume, zero=True)

    @classmethod
    def from_sonic_conductance(cls, conductance: float, **others: float) -> Filling:
        """From the sonic conductance of ISO 6358 [m3/(s Pa)], reference air of 1.185 kg/m3 (1 bar,
        20 degC, 65 %).

        Parameters
        ----------
        conductance : float
            ``C``, such that the choked mass flow is ``C rho_0 p``.
        **others : float
            The other parameters.
        """
        positive("conductance", conductance)
        return cls(area=cls(**others)._gas.area_of_conductance(conductance), **others)

    @property
    def _gas(self) -> _core.Gas:
        return _core.Gas(
            self.ambient_pressure, self.temperature, self.gas_constant, _HEAT_CAPACITY_RATIO
        )

    def time(self, volume: float, pressure: float) -> float:
        """Time to fill a constant volume from ambient to a gauge pressure [s].

        Parameters
        ----------
        volume : float
            Air volume [m3], without the dead volume.
        pressure : float
            Gauge pressure [Pa], below the supply's.

        Returns
        -------
        float
            ``(V / (R T)) integral dp / mdot(p)``, the orifice law of the rigs with a constant
            supply.

        Raises
        ------
        ParameterError
            If the pressure is not below the supply's, or a number is not allowed.
        """
        positive("volume", volume)
        positive("pressure", pressure)
        if pressure >= self.supply_pressure:
            raise ParameterError(
                f"pressure = {pressure:g} Pa is not below the supply's {self.supply_pressure:g} Pa"
            )
        supply = self.supply_pressure + self.ambient_pressure
        start, end = self.ambient_pressure / supply, (self.ambient_pressure + pressure) / supply
        # 1/mdot has an integrable infinity near r = 1, so even steps in log(1 - r)
        edges = np.unique(np.clip([start, _CHOKED, _LAMINAR, end], start, end))
        total = 0.0
        nodes, weights = np.polynomial.legendre.leggauss(32)
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            near, far = math.log1p(-low), math.log1p(-high)
            gap = np.exp(0.5 * (near + far) + 0.5 * (far - near) * nodes)
            flow = self._gas.mass_flow(self.area, supply, supply * (1.0 - gap))
            total += 0.5 * (near - far) * float(weights @ (supply * gap / flow))
        return (volume + self.dead_volume) * total / (self.gas_constant * self.temperature)

    def energy(self, rest_volume: float, end_volume: float, pressure: float) -> float:
        """Energy taken from the tank for one stroke [J]: ``mass R T``, as the tank's
        ``(P_initial - P_final) V`` (ch. 6).

        Parameters
        ----------
        rest_volume, end_volume : float
            Air volume before and after [m3], without the dead volume.
        pressure : float
            Gauge pressure after [Pa].
        """
        end = (pressure + self.ambient_pressure) * (end_volume + self.dead_volume)
        return end - self.ambient_pressure * (rest_volume + self.dead_volume)
