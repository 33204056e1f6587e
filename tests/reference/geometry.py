"""Geometry of one braided muscle: exact solve by bracketing and adaptive quadrature.

``elliptic_published`` keeps the choices printed in Robinson (2014) for comparison: the braid on an
end is followed over the parametric angles 0 to pi/3 (2.27), and |B - B_est(R)| is minimised (2.30)
where ``elliptic`` solves for its zero. The sum of squared increments printed as (2.28) is not a
length: the arc-length integral stands for it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

#: Shortest admissible length as a fraction of the braid fibre length.
SHORTEST_OF_FIBRE = 0.58

#: The printed minimisation looks from R0 this many times as far as the radius of the cylinder
#: (contraction).
PUBLISHED_REACH = 1.6


@dataclass(frozen=True)
class Shape:
    """Muscle shape at one length (SI units)."""

    length: float
    radius: float
    thickness: float
    air_volume: float
    braid_taut: bool


@dataclass(frozen=True)
class GeometryReference:
    """Geometry of a muscle with elliptic ends (solved, or as published), or of a plain cylinder.

    Parameters
    ----------
    rest_length, rest_diameter, wall_thickness : float
        Resting length, outer diameter and bladder thickness, m.
    braid_angle : float
        Braid angle from the circumferential plane, rad.
    kind : {"elliptic", "elliptic_published", "cylinder"}
        Shape of the ends.
    k0, contraction_slope, extension_slope : float
        Axis ratio of the end ellipse and its slopes per unit contraction ratio.
    neck_floor : float
        Least outer radius in extension as a fraction of the resting radius.
    """

    rest_length: float
    rest_diameter: float
    braid_angle: float
    wall_thickness: float
    kind: str = "elliptic"
    k0: float = 1.64
    contraction_slope: float = 2.405
    extension_slope: float = 6.105
    neck_floor: float = 0.80

    @property
    def rest_radius(self) -> float:
        """Resting outer radius, m."""
        return 0.5 * self.rest_diameter

    @property
    def fibre_length(self) -> float:
        """Length B of one braid fibre, m."""
        return self.rest_length / math.sin(self.braid_angle)

    @property
    def turns(self) -> float:
        """Turns N of one braid fibre."""
        return self.rest_length / (2.0 * math.pi * self.rest_radius * math.tan(self.braid_angle))

    @property
    def rubber_volume(self) -> float:
        """Bladder volume VB, m^3."""
        r0, t0 = self.rest_radius, self.wall_thickness
        return math.pi * (r0**2 - (r0 - t0) ** 2) * self.rest_length

    @property
    def max_contraction(self) -> float:
        """Contraction ratio at the shortest admissible length."""
        return 1.0 - SHORTEST_OF_FIBRE * self.fibre_length / self.rest_length

    @property
    def min_contraction(self) -> float:
        """Contraction ratio (negative) at which the muscle is as long as its fibre."""
        return 1.0 - self.fibre_length / self.rest_length

    def end_ratio(self, e: float) -> float:
        """Axis ratio k of the end ellipse."""
        return self.k0 - (self.contraction_slope if e >= 0.0 else self.extension_slope) * e

    def end_ellipse(self, e: float, radius: float) -> tuple[float, float, float, float]:
        """Signed minor half-axis a, half-axis b, centre offset c and axial length b' of one end."""
        k = self.end_ratio(e)
        q = k / math.sqrt(k * k + 3.0)
        a = (radius - self.rest_radius) / (1.0 - q)
        return a, k * abs(a), radius - a, math.sqrt(3.0) * q * abs(a)

    def fibre_estimate(self, e: float, radius: float) -> float:
        """Fibre length B_est that a middle radius implies, m."""
        length = self.rest_length * (1.0 - e)
        a, b, c, end = self.end_ellipse(e, radius)
        straight = (
            (length - 2.0 * end) / length * math.hypot(length, 2.0 * math.pi * radius * self.turns)
        )
        if a == 0.0:
            return straight
        published = self.kind == "elliptic_published"
        v1 = math.pi / 3.0 if published else math.atan(math.sqrt(3.0) / self.end_ratio(e))
        w = 2.0 * math.pi * self.turns * end / (length * v1)

        def speed(v: float) -> float:
            cos, sin = math.cos(v), math.sin(v)
            return math.sqrt(((a * cos + c) * w) ** 2 + (a * sin) ** 2 + (b * cos) ** 2)

        arc, _ = quad(speed, 0.0, v1, epsabs=0.0, epsrel=1e-13, limit=200)
        return straight + 2.0 * arc

    def fits(self, e: float, radius: float) -> bool:
        """Whether the fibre implied by a radius has the length of the fibre."""
        return abs(self.fibre_estimate(e, radius) - self.fibre_length) <= 1e-9 * self.fibre_length

    def radius_floor(self, e: float) -> float:
        """Least outer radius in extension, m."""
        length = self.rest_length * (1.0 - e)
        return max(
            math.sqrt(self.rubber_volume / (math.pi * length)), self.neck_floor * self.rest_radius
        )

    def cylinder_radius(self, e: float) -> float:
        """Radius of a cylinder that the braid covers, m; zero where the muscle is as long as its
        fibre.
        """
        fibre, length = self.fibre_length, self.rest_length * (1.0 - e)
        return math.sqrt(max((fibre - length) * (fibre + length), 0.0)) / (
            2.0 * math.pi * self.turns
        )

    def solve_radius(self, e: float) -> tuple[float, bool]:
        """Return the outer radius of the middle part and whether the braid is taut."""
        r0 = self.rest_radius
        if self.kind == "cylinder":
            radius, floor = self.cylinder_radius(e), self.radius_floor(e)
            return (floor, True) if e < 0.0 and radius < floor else (radius, False)
        if e == 0.0:
            return r0, False
        if self.kind == "elliptic_published":
            return self._closest_radius(e)

        def miss(radius: float) -> float:
            return self.fibre_estimate(e, radius) - self.fibre_length

        # March away from the resting radius, so that the root found is the one nearest to it.
        floor = self.radius_floor(e)
        step = 0.04 * r0 if e > 0.0 else -(r0 - floor) / 24.0
        near, miss_near = r0, miss(r0)
        if abs(miss_near) <= 1e-15 * self.fibre_length:
            return r0, False
        for _ in range(400):
            far = near + step
            if e < 0.0 and far < floor * (1.0 + 1e-15):
                far = floor
            miss_far = miss(far)
            if miss_near * miss_far <= 0.0:
                root = brentq(miss, near, far, xtol=1e-18, rtol=8.9e-16)
                return float(root), False
            if far == floor:
                return floor, True
            near, miss_near = far, miss_far
        raise ValueError(f"no radius fits the fibre at contraction ratio {e}")

    def _closest_radius(self, e: float) -> tuple[float, bool]:
        """Radius of least |B - B_est|: the zero nearest to R0, else the least miss on a fine grid,
        refined.

        Without a zero the least miss may lie between R0 and the floor; only at the floor does the
        braid count as taut.
        """
        r0 = self.rest_radius
        last = (
            r0 + PUBLISHED_REACH * (self.cylinder_radius(e) - r0)
            if e > 0.0
            else self.radius_floor(e)
        )

        def miss(radius: float) -> float:
            return self.fibre_estimate(e, radius) - self.fibre_length

        grid = np.linspace(r0, last, 65)
        misses = [miss(float(radius)) for radius in grid]
        for near, far, miss_near, miss_far in zip(
            grid[:-1], grid[1:], misses[:-1], misses[1:], strict=True
        ):
            if miss_near * miss_far <= 0.0:
                return float(brentq(miss, near, far, xtol=1e-18, rtol=8.9e-16)), False
        least = int(np.argmin(np.abs(misses)))
        ends = float(grid[max(least - 1, 0)]), float(grid[min(least + 1, grid.size - 1)])
        bounds = min(ends), max(ends)
        found = minimize_scalar(
            lambda radius: abs(miss(radius)),
            bounds=bounds,
            method="bounded",
            options={"xatol": 1e-12},
        )
        inside = abs(found.x - grid[least]) > 1e-9 * r0 and found.fun < abs(misses[least])
        best = float(found.x if inside else grid[least])
        return best, e < 0.0 and best == last

    def profile(self, z: float, e: float, radius: float) -> float:
        """Outer radius f(z) at axial position z, m."""
        length = self.rest_length * (1.0 - e)
        z = min(z, length - z)
        a, b, c, end = self.end_ellipse(e, radius)
        if z >= end or a == 0.0 or self.kind == "cylinder":
            return radius
        return c + a * math.sqrt(1.0 - ((z - end) / b) ** 2)

    def solve(self, e: float) -> Shape:
        """Shape at contraction ratio `e`, every integral by adaptive quadrature."""
        length = self.rest_length * (1.0 - e)
        radius, taut = self.solve_radius(e)
        end = 0.0 if self.kind == "cylinder" else self.end_ellipse(e, radius)[3]
        straight = length - 2.0 * end

        def over_length(inset: float, power: int) -> float:
            curved = 0.0
            if end > 0.0:
                curved, _ = quad(
                    lambda z: (self.profile(z, e, radius) - inset) ** power,
                    0.0, end, epsabs=0.0, epsrel=1e-13, limit=200,
                )  # fmt: skip
            return straight * (radius - inset) ** power + 2.0 * curved

        i1 = over_length(0.0, 1)
        # VB = pi (2 t I1 - t^2 L); the stable form of the smaller root.
        share = self.rubber_volume / math.pi
        root = math.sqrt(max(i1 * i1 - length * share, 0.0))
        thickness = share / (i1 + root)
        return Shape(length, radius, thickness, math.pi * over_length(thickness, 2), taut)

    def air_volume_slope(self, e: float, step: float = 1e-3) -> float:
        """dV/de by a sixth-order central difference; `e` must be 3 `step` away from any kink,
        m^3.
        """
        weights = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
        points = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
        values = np.array([self.solve(e + n * step).air_volume for n in points])
        return float(weights @ values / step)

    def taut_contraction(self) -> float:
        """Contraction ratio (negative) below which the braid is taut; no tautness gives the lower
        limit.
        """
        low = self.min_contraction if self.kind == "cylinder" else min(-0.05, self.min_contraction)
        grid = np.linspace(0.0, low, 201)
        taut = [self.solve_radius(float(e))[1] for e in grid]
        if True not in taut:
            return float(grid[-1])
        first = taut.index(True)

        taut_at, slack_at = float(grid[first]), float(grid[first - 1])
        for _ in range(40):
            middle = 0.5 * (taut_at + slack_at)
            if self.solve_radius(middle)[1]:
                taut_at = middle
            else:
                slack_at = middle
        return taut_at
