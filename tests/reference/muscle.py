"""Force of one muscle for every force model, written so that it does not repeat closed forms.

Gas forces are -dV/dL and the Mooney-Rivlin force is VB dW/dL (F dL = VB dW - P dV, F pulling;
(3.21) prints a minus), both differentiated numerically by a complex step (Squire and Trapp 1998),
which loses no digits. The membrane terms are the force balance as stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray

from .geometry import GeometryReference, Shape

#: Models whose elasticity is a polynomial of the strains.
POLYNOMIAL = ("ferraresi", "kothera", "robinson")

#: Models whose pressure also acts in the wall (2.16).
THICK_WALL = ("kothera", "robinson", "elbow_linear")


@dataclass(frozen=True)
class MuscleReference:
    """One muscle.

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
    model : str
        Force model: gaylord, chou_hannaford, mooney_rivlin, ferraresi, kothera, robinson or
        elbow_linear.
    c10, c01 : float
        Constants of the Mooney-Rivlin energy, Pa.
    bladder_modulus : float
        E_R of ``elbow_linear``, Pa.
    extension_factors : (float, float, float)
        Factors on the wall pressure, axial and hoop terms of ``elbow_linear`` while lengthening
        (4.7).
    friction_coefficient, friction_pressure_slope, friction_floor : float
        c_F = max(coefficient + slope P, floor) of the hysteresis (2.36).
    """

    geometry: GeometryReference
    modulus_slope: Sequence[float] = ()
    modulus_offset: Sequence[float] = ()
    modulus_scale: float = 1.0
    count: int = 1
    model: str = "robinson"
    c10: float = 0.0
    c01: float = 0.0
    bladder_modulus: float = 0.0
    extension_factors: Sequence[float] = (0.3, 0.8, 0.8)
    friction_coefficient: float = 0.0
    friction_pressure_slope: float = 0.0
    friction_floor: float = 0.0

    def strains(self, shape: Shape) -> tuple[float, float]:
        """Axial and circumferential bladder strain; the latter of the mid wall unless the wall is
        constant.
        """
        geo = self.geometry
        axial = shape.length / geo.rest_length - 1.0
        if self.model == "ferraresi":
            return axial, shape.radius / geo.rest_radius - 1.0
        middle = shape.radius - 0.5 * shape.thickness
        return axial, middle / (geo.rest_radius - 0.5 * geo.wall_thickness) - 1.0

    def membrane(self, shape: Shape, axial: float, hoop: float) -> float:
        """Force of an axial and a hoop stress in the wall, the hoop stress through the braid, N."""
        geo = self.geometry
        wall = geo.wall_thickness if self.model == "ferraresi" else shape.thickness
        return axial * geo.rubber_volume / shape.length - hoop * self.hoop_area(
            shape, wall * shape.length
        )

    def hoop_area(self, shape: Shape, section: float) -> float:
        """Axial force per unit of hoop stress acting on a wall section (m^2) of the muscle, m^2."""
        return section * shape.length / (2.0 * math.pi * shape.radius * self.geometry.turns**2)

    def along_braid(
        self, quantity: Callable[[complex, complex], complex], shape: Shape, radius: float
    ) -> float:
        """-d/dL of quantity(L, R), R following the braid from `radius`: (2 pi N R)^2 + L^2
        stays.
        """
        step = 1e-20 * shape.length
        length = complex(shape.length, step)
        turned = (
            (shape.length - length)
            * (shape.length + length)
            / (2.0 * math.pi * self.geometry.turns) ** 2
        )
        return -quantity(length, np.sqrt(radius**2 + turned)).imag / step

    def gas_area(self, e: float) -> float:
        """Force per unit of pressure, moduli left out, m^2."""
        geo, shape = self.geometry, self.geometry.solve(e)
        # Gaylord's force is that of the cylinder that the braid covers, whatever the shape is.
        covered = geo.cylinder_radius(e)
        area = self.along_braid(lambda length, radius: math.pi * length * radius**2, shape, covered)
        if self.model == "chou_hannaford":
            wall = geo.wall_thickness

            def bore_less_outside(length: complex, radius: complex) -> complex:
                return math.pi * length * ((radius - wall) ** 2 - radius**2)

            area += self.along_braid(bore_less_outside, shape, shape.radius)
        if self.model in THICK_WALL:
            area += self.membrane(shape, 1.0, 1.0)
        return area

    def energy(self, c10: float, c01: float, length: complex, radius: complex) -> complex:
        """Mooney-Rivlin energy of the whole bladder, J."""
        one, two = length / self.geometry.rest_length, radius / self.geometry.rest_radius
        squares = (one**2, two**2, 1.0 / (one * two) ** 2)
        first, second = sum(squares), sum(1.0 / square for square in squares)
        return self.geometry.rubber_volume * (c10 * (first - 3.0) + c01 * (second - 3.0))

    def elbow_parts(self, e: float) -> tuple[float, float]:
        """FL and FT of (4.5) and (4.6) per unit of E_R, m^2."""
        geo, shape = self.geometry, self.geometry.solve(e)
        stretched = shape.thickness * shape.length - geo.wall_thickness * geo.rest_length
        return geo.rubber_volume * (1.0 / geo.rest_length - 1.0 / shape.length), self.hoop_area(
            shape, stretched
        )

    def moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Slope and offset of the modulus in front of every column of `elastic_basis`."""
        offsets: Sequence[float] = ()
        if self.model in POLYNOMIAL:
            offsets = self.modulus_offset
        elif self.model == "mooney_rivlin":
            offsets = (self.c10, self.c01)
        elif self.model == "elbow_linear":
            offsets = (self.bladder_modulus,)
        slopes = self.modulus_slope if self.model in POLYNOMIAL else np.zeros(len(offsets))
        return np.array(slopes, dtype=float), np.array(offsets, dtype=float)

    def elastic_basis(self, e: float) -> NDArray[np.float64]:
        """Force per unit of each modulus, m^2."""
        shape = self.geometry.solve(e)
        if self.model in POLYNOMIAL:
            axial, hoop = self.strains(shape)
            orders = range(1, len(self.modulus_offset) + 1)
            return np.array([self.membrane(shape, axial**k, hoop**k) for k in orders])
        if self.model == "mooney_rivlin":
            units = ((1.0, 0.0), (0.0, 1.0))
            energies = [partial(self.energy, *unit) for unit in units]
            slopes = [self.along_braid(energy, shape, shape.radius) for energy in energies]
            return -np.array(slopes)
        return np.array([sum(self.elbow_parts(e))]) if self.model == "elbow_linear" else np.zeros(0)

    def coefficients(self, e: float) -> tuple[float, float, float]:
        """a_gas, a_elastic (m^2) and b_elastic (N): F = P a_gas + scale (P a_elastic +
        b_elastic).
        """
        basis, (slopes, offsets) = self.elastic_basis(e), self.moduli()
        return self.gas_area(e), float(basis @ slopes), float(basis @ offsets)

    def force(
        self, pressure: ArrayLike, e: float, direction: float | None = None
    ) -> NDArray[np.float64]:
        """Force at gauge `pressure` (Pa, any shape) and one contraction ratio, N.

        `direction` is -1 while contracting and +1 while lengthening; None leaves the hysteresis
        out.
        """
        a_gas, a_elastic, b_elastic = self.coefficients(e)
        p = np.asarray(pressure, dtype=float)
        force = p * a_gas + self.modulus_scale * (p * a_elastic + b_elastic)
        if direction is None:
            return force
        if self.model == "elbow_linear":
            share = 0.5 * (1.0 + direction)
            force = (1.0 - share) * force + share * self._lengthening(p, e)
        friction = np.maximum(
            self.friction_coefficient + self.friction_pressure_slope * p, self.friction_floor
        )
        return force + direction * friction * np.abs(force)

    def _lengthening(self, p: NDArray[np.float64], e: float) -> NDArray[np.float64]:
        """Lengthening branch (4.7) of ``elbow_linear``, N."""
        gas, axial, hoop = self.extension_factors
        in_wall = self.membrane(self.geometry.solve(e), 1.0, 1.0)
        along, around = self.elbow_parts(e)
        elastic = self.modulus_scale * self.bladder_modulus * (axial * along + hoop * around)
        return p * (self.gas_area(e) - (1.0 - gas) * in_wall) + elastic

    def tabulate(self, e_min: float, e_max: float, degree: int = 28) -> MuscleTable:
        """Chebyshev table on [e_min, e_max].

        One seam is at e = 0, where the end ellipse has a kink; the others shorten the pieces near
        it, because the continued branch has a singularity a little way into extension.
        """
        edges = [e_min, *(seam for seam in (0.0, 0.03, 0.12) if e_min < seam < e_max), e_max]
        pieces = []
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
            points = 0.5 * (low + high) + 0.5 * (high - low) * nodes
            rows = np.array(
                [
                    (*self.coefficients(float(x)), self.geometry.solve(float(x)).air_volume)
                    for x in points
                ]
            )
            fits = [Chebyshev.fit(points, rows[:, j], degree, domain=[low, high]) for j in range(4)]
            pieces.append((low, high, fits, fits[3].deriv()))
        return MuscleTable(self.modulus_scale, pieces)


class MuscleTable:
    """Force, volume and volume slope of one muscle from Chebyshev series (for the integrator)."""

    def __init__(
        self, scale: float, pieces: list[tuple[float, float, list[Chebyshev], Chebyshev]]
    ) -> None:
        self.scale = scale
        self.pieces = []
        for low, high, fits, slope in pieces:
            order = np.arange(fits[0].coef.size)
            rows = [*(f.coef for f in fits), np.append(slope.coef, 0.0)]
            self.pieces.append((low, high, order, np.array(rows)))

    def __call__(self, e: float, pressure: float) -> tuple[float, float, float]:
        """Force (N), air volume (m^3) and dV/de (m^3) at contraction ratio `e`, gauge `pressure`
        (Pa).
        """
        for low, high, order, rows in self.pieces:
            if low <= e <= high:
                # T_k(cos t) = cos(k t)
                angle = math.acos(max(-1.0, min(1.0, (2.0 * e - low - high) / (high - low))))
                found = (rows @ np.cos(order * angle)).tolist()
                a_gas, a_elastic, b_elastic, volume, slope = found
                force = pressure * a_gas + self.scale * (pressure * a_elastic + b_elastic)
                return force, volume, slope
        raise ValueError(f"contraction ratio {e} outside the table")
