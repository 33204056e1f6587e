"""Orifice flow and the five-port proportional valve."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

#: Pressure ratio above which the flow is taken as laminar.
LAMINAR_RATIO = 0.999


def critical_ratio(gamma: float = 1.4) -> float:
    """Pressure ratio below which the orifice is choked."""
    return float((2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0)))


def flow_function(ratio: float, gamma: float = 1.4) -> float:
    """Dimensionless flow psi at pressure ratio `ratio` = downstream / upstream (absolute), in
    0..1.
    """
    if ratio > LAMINAR_RATIO:
        return flow_function(LAMINAR_RATIO, gamma) * (1.0 - ratio) / (1.0 - LAMINAR_RATIO)
    if ratio <= critical_ratio(gamma):
        return float(
            (2.0 / (gamma + 1.0)) ** (1.0 / (gamma - 1.0)) * math.sqrt(gamma / (gamma + 1.0))
        )
    inside = ratio ** (2.0 / gamma) - ratio ** ((gamma + 1.0) / gamma)
    return math.sqrt(gamma / (gamma - 1.0) * inside)


def orifice_flow(
    area: float,
    upstream: float,
    downstream: float,
    temperature: float,
    gas_constant: float,
    gamma: float = 1.4,
) -> float:
    """Mass flow (kg/s) through discharge area `area` (m^2) to the lower absolute pressure (Pa)."""
    if downstream > upstream:
        raise ValueError("the reference covers flow from the higher pressure to the lower only")
    scale = math.sqrt(2.0 / (gas_constant * temperature))
    return area * upstream * scale * flow_function(downstream / upstream, gamma)


def iso_flow(
    conductance: float, critical: float, upstream: float, downstream: float, temperature: float
) -> float:
    """Mass flow (kg/s) after ISO 6358-1:2013 to the lower absolute pressure (Pa).

    `conductance` in m^3/(s Pa) at the reference atmosphere (1.185 kg/m^3, 293.15 K); straight above
    `LAMINAR_RATIO`.
    """
    if downstream > upstream:
        raise ValueError("the reference covers flow from the higher pressure to the lower only")
    ratio = downstream / upstream
    choked = conductance * 1.185 * upstream * math.sqrt(293.15 / temperature)
    if ratio <= critical:
        return choked
    curved = min(ratio, LAMINAR_RATIO)
    flow = choked * math.sqrt(1.0 - ((curved - critical) / (1.0 - critical)) ** 2)
    return flow * (1.0 - ratio) / (1.0 - LAMINAR_RATIO) if ratio > LAMINAR_RATIO else flow


@dataclass(frozen=True)
class Valve:
    """Proportional valve, closed at `null_voltage`; above it fills, below it vents."""

    discharge_area_max: float = 8.4e-6
    #: Sonic conductance (m^3/(s Pa)) and critical ratio of filling and of venting in its place.
    iso: tuple[tuple[float, float], tuple[float, float]] | None = None
    null_voltage: float = 5.0
    half_range: float = 5.0
    opening: Sequence[float] = (0.0, 0.25, 0.5, 0.75, 1.0)
    fraction: Sequence[float] = (0.0, 0.2, 0.5, 0.8, 1.0)

    def area(self, command: float) -> float:
        """Discharge area (m^2) at a command voltage: positive fills, negative vents."""
        return self.discharge_area_max * self.share(command)

    def share(self, command: float) -> float:
        """Share of the widest opening at a command voltage: positive fills, negative vents."""
        return self.share_at(min(max((command - self.null_voltage) / self.half_range, -1.0), 1.0))

    def share_at(self, x: float) -> float:
        """The same at a normalised position of the spool."""
        i = min(bisect_right(self.opening, abs(x)), len(self.opening) - 1)
        low, high = self.opening[i - 1], self.opening[i]
        share = (abs(x) - low) / (high - low)
        fraction = self.fraction[i - 1] + share * (self.fraction[i] - self.fraction[i - 1])
        return math.copysign(fraction, x)
