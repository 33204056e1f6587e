"""Muscle with elliptic ends and tendon joint, written independently of the package under test."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize import brentq

Array = NDArray[np.floating]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True)
class Shape:
    """Shape of one muscle at one length (SI units).

    `radius` and `thickness` belong to the middle section, `volume` is the air volume; `taut` tells
    that the neck floor holds.
    """

    length: float
    radius: float
    thickness: float
    volume: float
    taut: bool


class Muscle:
    """One braided muscle with elliptic ends; lengths in m, moduli in Pa.

    Parameters
    ----------
    spec : dict
        Keys rest_length, rest_diameter, braid_angle [rad], wall_thickness, modulus_slope,
        modulus_offset, k0, contraction_slope, extension_slope, neck_floor.
    """

    def __init__(self, spec: dict[str, Any]) -> None:
        self.rest_length = float(spec["rest_length"])
        self.rest_radius = 0.5 * float(spec["rest_diameter"])
        angle = float(spec["braid_angle"])
        self.wall = float(spec["wall_thickness"])
        self.fibre = self.rest_length / math.sin(angle)
        self.turns = self.rest_length / (2.0 * math.pi * self.rest_radius * math.tan(angle))
        self.rubber = (
            math.pi * (self.rest_radius**2 - (self.rest_radius - self.wall) ** 2) * self.rest_length
        )
        self.slope = [float(v) for v in spec["modulus_slope"]]
        self.offset = [float(v) for v in spec["modulus_offset"]]
        self.k0 = float(spec["k0"])
        self.k_con = float(spec["contraction_slope"])
        self.k_ext = float(spec["extension_slope"])
        self.neck = float(spec["neck_floor"])

    def _ends(
        self, contraction: float, radius: float
    ) -> tuple[float, float, float, float, float, float]:
        k = self.k0 - (self.k_con if contraction >= 0.0 else self.k_ext) * contraction
        q = k / math.sqrt(k * k + 3.0)
        a = (radius - self.rest_radius) / (1.0 - q)
        b = k * abs(a)
        return a, b, radius - a, math.sqrt(3.0) * q * abs(a), math.atan(math.sqrt(3.0) / k), q

    def fibre_excess(self, contraction: float, radius: float) -> float:
        """Fibre length [m] that the radius [m] would need, less the true one."""
        length = self.rest_length * (1.0 - contraction)
        a, b, c, reach, last, _ = self._ends(contraction, radius)
        middle = (
            (length - 2.0 * reach)
            / length
            * math.hypot(length, 2.0 * math.pi * radius * self.turns)
        )
        if a == 0.0:
            return middle - self.fibre
        w = 2.0 * math.pi * self.turns * reach / (length * last)
        v = 0.5 * last * (_NODES + 1.0)
        speed = np.sqrt(
            ((a * np.cos(v) + c) * w) ** 2 + (a * np.sin(v)) ** 2 + (b * np.cos(v)) ** 2
        )
        return middle + last * float(_WEIGHTS @ speed) - self.fibre

    def shape(self, contraction: float) -> Shape:
        """Solve the shape at a contraction ratio (positive when shorter than at rest)."""
        length = self.rest_length * (1.0 - contraction)
        if not 0.55 * self.fibre < length < self.fibre:
            raise ValueError(
                f"contraction ratio {contraction!r} leaves the range of the braid (length "
                f"{length:.4f} m)"
            )
        taut = False
        rest = self.rest_radius
        if abs(contraction) < 1.0e-15:
            radius = rest
        else:
            floor = max(math.sqrt(self.rubber / (math.pi * length)), self.neck * rest)
            step = 0.01 * rest if contraction > 0.0 else -(rest - floor) / 40.0
            near, radius = rest, floor
            sign = math.copysign(1.0, self.fibre_excess(contraction, rest))
            for i in range(1, 200 if step > 0.0 else 41):
                far = rest + i * step
                if sign * self.fibre_excess(contraction, far) <= 0.0:
                    lo, hi = min(near, far), max(near, far)
                    radius = float(
                        brentq(
                            lambda r: self.fibre_excess(contraction, r),
                            lo,
                            hi,
                            xtol=1e-16,
                            rtol=1e-14,
                        )
                    )
                    break
                near = far
            else:
                if step > 0.0:
                    raise ValueError(f"no braid radius at contraction ratio {contraction!r}")
                taut = True
        a, b, c, reach, last, _ = self._ends(contraction, radius)
        cylinder = length - 2.0 * reach
        first = cylinder * radius + 2.0 * b * (
            c * math.sin(last) + a * (0.5 * last + 0.25 * math.sin(2.0 * last))
        )
        sin_l = math.sin(last)
        second = cylinder * radius**2 + 2.0 * b * (
            c * c * sin_l
            + 2.0 * a * c * (0.5 * last + 0.25 * math.sin(2.0 * last))
            + a * a * (sin_l - sin_l**3 / 3.0)
        )
        wall = (first - math.sqrt(first * first - length * self.rubber / math.pi)) / length
        volume = math.pi * (second - 2.0 * wall * first + wall * wall * length)
        return Shape(length, radius, wall, volume, taut)

    def force_terms(self, shape: Shape, modulus_scale: float = 1.0) -> tuple[float, float]:
        """Force of one muscle as ``gauge_pressure * first + second`` [m2, N]."""
        length, radius, wall, turns = shape.length, shape.radius, shape.thickness, self.turns
        hoop = wall * length**2 / (2.0 * math.pi * radius * turns**2)
        axial = self.rubber / length
        gas = (3.0 * length**2 - self.fibre**2) / (4.0 * math.pi * turns**2) + axial - hoop
        ez = length / self.rest_length - 1.0
        ec = (radius - 0.5 * wall) / (self.rest_radius - 0.5 * self.wall) - 1.0
        first = sum(m * (ez**k * axial - ec**k * hoop) for k, m in enumerate(self.slope, 1))
        second = sum(m * (ez**k * axial - ec**k * hoop) for k, m in enumerate(self.offset, 1))
        return gas + modulus_scale * first, modulus_scale * second


class Tendon:
    """Tendon joint: contraction [m] and moment arm [m/rad] as functions of the joint angle
    [rad].
    """

    def __init__(self, spec: dict[str, Any]) -> None:
        self.axial = float(spec["upper_axial"])
        self.offset = float(spec["upper_offset"])
        self.lower = math.hypot(float(spec["lower_axial"]), float(spec["lower_offset"]))
        self.tilt = math.atan2(float(spec["lower_offset"]), float(spec["lower_axial"]))
        x, y = self._point(float(spec["rest_angle"]))
        self.tendon = math.hypot(self.axial - x, self.offset - y)

    def _point(self, angle: float) -> tuple[float, float]:
        phi = math.pi - angle - self.tilt
        return self.lower * math.cos(phi), self.lower * math.sin(phi)

    def contraction(self, angle: float) -> float:
        """Contraction [m] of the muscles at a joint angle [rad]."""
        x, y = self._point(angle)
        return x + math.sqrt(self.tendon**2 - (self.offset - y) ** 2) - self.axial

    def arm(self, angle: float) -> float:
        """Moment arm [m] at a joint angle [rad]."""
        x, y = self._point(angle)
        return y - (self.offset - y) * x / math.sqrt(self.tendon**2 - (self.offset - y) ** 2)


class Pulley:
    """A tendon over a wheel: contraction [m] and moment arm [m/rad]; the angle [rad] counts the way
    in which the muscle pulls.
    """

    def __init__(self, spec: dict[str, Any]) -> None:
        self.radius, self.rest = float(spec["radius"]), float(spec["rest_angle"])

    def contraction(self, angle: float) -> float:
        """Contraction [m] of the muscles at a joint angle [rad]."""
        return self.radius * (angle - self.rest)

    def arm(self, angle: float) -> float:
        """Moment arm [m], the same at every angle."""
        return self.radius


class Straight:
    """A muscle that lifts a mass without a joint: the coordinate is its own shortening [m]."""

    def __init__(self, spec: dict[str, Any]) -> None:
        self.rest = float(spec["rest_angle"])

    def contraction(self, angle: float) -> float:
        """Shortening [m] of the muscles."""
        return angle - self.rest

    def arm(self, angle: float) -> float:
        """Shortening per shortening."""
        return 1.0


_PULLS: dict[str, type[Tendon] | type[Pulley] | type[Straight]] = {
    "mass": Straight,
    "pulley": Pulley,
}


@lru_cache(maxsize=8)
def _rows(muscle: str, tendon: str, count: int) -> tuple[Array, Array]:
    """Knots [rad] and exact quantities of the joint, see :meth:`JointTables.exact`; the arguments
    are JSON.
    """
    spec, joint = json.loads(muscle), json.loads(tendon)
    shapes, pull = Muscle(spec), _PULLS.get(joint.get("kind", ""), Tendon)(joint)
    step, below, above = grid_of(joint)
    knots = float(joint["rest_angle"]) + step * np.arange(-below, above + 1)
    return knots, np.array([JointTables.exact(shapes, pull, count, float(t)) for t in knots])


#: knots per degree, and how many of them lie below and above the rest angle
STEP, BELOW, ABOVE = 0.1, 80, 1160


def grid_of(joint: dict[str, Any]) -> tuple[float, int, int]:
    """Distance of the knots [rad, or m of shortening], and how many lie below and above rest."""
    return (2.0e-4, 40, 480) if joint.get("kind") == "mass" else (math.radians(STEP), BELOW, ABOVE)


class JointTables:
    """Everything the plant needs as cubic pieces over the joint angle.

    Rows of `cells`: coefficients of one cell, for the gas torque per pressure [m3], the elastic
    torque [N m], the air volume of all muscles [m3], the contraction [m] and the wall area [m2];
    each cubic highest power first.

    Parameters
    ----------
    muscle, joint : dict
        Geometry, see :class:`Muscle` and :class:`Tendon`.
    count : int
        Number of parallel muscles.
    modulus_scale : float
        Multiplies every modulus.
    """

    def __init__(
        self, muscle: dict[str, Any], joint: dict[str, float], count: int, modulus_scale: float
    ) -> None:
        knots, exact = _rows(
            json.dumps(muscle, sort_keys=True), json.dumps(joint, sort_keys=True), count
        )
        self.step, below, above = grid_of(joint)
        self.knots = knots
        self.start = float(knots[0])
        rows = np.column_stack(
            [exact[:, 0] + modulus_scale * exact[:, 1], modulus_scale * exact[:, 2], exact[:, 3:]]
        )
        cells: list[tuple[float, ...]] = []
        for lo, hi, kind in ((0, below, PchipInterpolator), (below, below + above, CubicSpline)):
            pieces = kind(knots[lo : hi + 1], rows[lo : hi + 1])
            # c has shape (4, cells, quantities)
            cells.extend(
                tuple(c) for c in np.transpose(pieces.c, (1, 2, 0)).reshape(hi - lo, -1).tolist()
            )
        self.cells = cells

    @staticmethod
    def exact(
        muscle: Muscle, tendon: Tendon | Pulley | Straight, count: int, angle: float
    ) -> Array:
        """Quantities at one angle [rad] without interpolation.

        Gas torque per pressure without and per modulus scale, elastic torque per modulus scale, air
        volume, contraction, wall area.
        """
        contraction = tendon.contraction(angle)
        shape = muscle.shape(contraction / muscle.rest_length)
        gas, _ = muscle.force_terms(shape, 0.0)
        first, second = muscle.force_terms(shape, 1.0)
        arm = count * tendon.arm(angle)
        wall = count * 2.0 * math.pi * (shape.radius - shape.thickness) * shape.length
        return np.array(
            [gas * arm, (first - gas) * arm, second * arm, count * shape.volume, contraction, wall]
        )

    def cell(self, angle: float) -> tuple[tuple[float, ...], float]:
        """Coefficients of the cell of an angle [rad] and the distance from its knot [rad]."""
        i = min(max(int((angle - self.start) / self.step), 0), len(self.cells) - 1)
        return self.cells[i], angle - self.start - i * self.step

    def at(self, angle: float) -> Array:
        """Interpolated quantities at one angle [rad]."""
        k, s = self.cell(angle)
        return np.asarray(np.array(k).reshape(5, 4) @ np.array([s**3, s * s, s, 1.0]))

    def contraction(self, angle: float) -> float:
        """Contraction [m] at one angle [rad]."""
        k, s = self.cell(angle)
        return ((k[12] * s + k[13]) * s + k[14]) * s + k[15]

    def pull(self, angle: float, gauge: float) -> tuple[float, float, float]:
        """Force of all muscles [N], its slope over contraction [N/m] and the moment arm [m/rad]."""
        k, s = self.cell(angle)
        torque = (
            gauge * (((k[0] * s + k[1]) * s + k[2]) * s + k[3])
            + ((k[4] * s + k[5]) * s + k[6]) * s
            + k[7]
        )
        slope = (
            gauge * ((3.0 * k[0] * s + 2.0 * k[1]) * s + k[2])
            + (3.0 * k[4] * s + 2.0 * k[5]) * s
            + k[6]
        )
        arm = (3.0 * k[12] * s + 2.0 * k[13]) * s + k[14]
        force = torque / arm
        return force, (slope - force * (6.0 * k[12] * s + 2.0 * k[13])) / (arm * arm), arm


class RigidTables:
    """A rigid cube of a volume [m3], without muscles: only its wall does not vanish."""

    def __init__(self, volume: float) -> None:
        self.start, self.step = 0.0, 1.0
        self.cells = [(*(0.0,) * 19, 6.0 * volume ** (2.0 / 3.0))]

    def at(self, angle: float) -> Array:
        """Quantities as those of :class:`JointTables`, all zero."""
        return np.zeros(5)

    def contraction(self, angle: float) -> float:
        """Contraction [m]."""
        return 0.0

    def pull(self, angle: float, gauge: float) -> tuple[float, float, float]:
        """Force [N], its slope [N/m] and the moment arm [m/rad], of none."""
        return 0.0, 0.0, 0.0
