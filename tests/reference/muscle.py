"""Force of one muscle: pressure, finite bladder thickness, elasticity linear in pressure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray

from .geometry import GeometryReference, Shape


@dataclass(frozen=True)
class MuscleReference:
    """One muscle of the ``robinson`` model.

    Parameters
    ----------
    geometry : GeometryReference
        Shape of the muscle.
    modulus_slope, modulus_offset : sequence of float
        m_k (1) and b_k (Pa) of the stress polynomial sum_k (m_k P + b_k) eps^k.
    modulus_scale : float
        Factor on every modulus.
    count : int
        Number of equal muscles in parallel; forces and volumes below are of one.
    """

    geometry: GeometryReference
    modulus_slope: Sequence[float]
    modulus_offset: Sequence[float]
    modulus_scale: float = 1.0
    count: int = 1

    def strains(self, shape: Shape) -> tuple[float, float]:
        """Axial and circumferential bladder strain."""
        geo = self.geometry
        middle = shape.radius - 0.5 * shape.thickness
        return (
            shape.length / geo.rest_length - 1.0,
            middle / (geo.rest_radius - 0.5 * geo.wall_thickness) - 1.0,
        )

    def coefficients(self, e: float) -> tuple[float, float, float]:
        """a_gas, a_elastic (m^2) and b_elastic (N): F = P a_gas + scale (P a_elastic + b_elastic)."""
        geo, shape = self.geometry, self.geometry.solve(e)
        axial = geo.rubber_volume / shape.length
        hoop = shape.thickness * shape.length**2 / (2.0 * math.pi * shape.radius * geo.turns**2)
        gaylord = (3.0 * shape.length**2 - geo.fibre_length**2) / (4.0 * math.pi * geo.turns**2)
        eps_z, eps_c = self.strains(shape)

        def resultant(moduli: Sequence[float]) -> float:
            sz = sum(m * eps_z ** (k + 1) for k, m in enumerate(moduli))
            sc = sum(m * eps_c ** (k + 1) for k, m in enumerate(moduli))
            return sz * axial - sc * hoop

        return gaylord + axial - hoop, resultant(self.modulus_slope), resultant(self.modulus_offset)

    def force(self, pressure: ArrayLike, e: float) -> NDArray[np.float64]:
        """Force at gauge `pressure` (Pa, any shape) and one contraction ratio, N."""
        a_gas, a_elastic, b_elastic = self.coefficients(e)
        p = np.asarray(pressure, dtype=float)
        return p * a_gas + self.modulus_scale * (p * a_elastic + b_elastic)

    def tabulate(self, e_min: float, e_max: float, degree: int = 28) -> MuscleTable:
        """Chebyshev table on [e_min, e_max].

        One seam is at e = 0, where the end ellipse has a kink; the others shorten the pieces near it,
        because the continued branch has a singularity a little way into extension.
        """
        edges = [e_min, *(seam for seam in (0.0, 0.03, 0.12) if e_min < seam < e_max), e_max]
        pieces = []
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
            points = 0.5 * (low + high) + 0.5 * (high - low) * nodes
            rows = np.array([(*self.coefficients(float(x)), self.geometry.solve(float(x)).air_volume) for x in points])
            fits = [Chebyshev.fit(points, rows[:, j], degree, domain=[low, high]) for j in range(4)]
            pieces.append((low, high, fits, fits[3].deriv()))
        return MuscleTable(self.modulus_scale, pieces)


class MuscleTable:
    """Force, volume and volume slope of one muscle from Chebyshev series (for the integrator)."""

    def __init__(self, scale: float, pieces: list[tuple[float, float, list[Chebyshev], Chebyshev]]) -> None:
        self.scale = scale
        self.pieces = pieces

    def __call__(self, e: float, pressure: float) -> tuple[float, float, float]:
        """Force (N), air volume (m^3) and dV/de (m^3) at contraction ratio `e`, gauge `pressure` (Pa)."""
        for low, high, fits, slope in self.pieces:
            if low <= e <= high:
                a_gas, a_elastic, b_elastic, volume = (_clenshaw(f, e) for f in fits)
                force = pressure * a_gas + self.scale * (pressure * a_elastic + b_elastic)
                return force, volume, _clenshaw(slope, e)
        raise ValueError(f"contraction ratio {e} outside the table")


def _clenshaw(series: Chebyshev, x: float) -> float:
    """Value of a Chebyshev series at one point (plain floats: the integrator calls this often)."""
    low, high = series.domain
    y = 2.0 * (2.0 * x - low - high) / (high - low)
    b1 = b2 = 0.0
    coef = series.coef.tolist()
    for c in coef[:0:-1]:
        b1, b2 = c + y * b1 - b2, b1
    return float(coef[0] + 0.5 * y * b1 - b2)
