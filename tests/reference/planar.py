"""Planar arm of N revolute links by recursive Newton-Euler, in the plane of gravity.

The first angle counts from the gravity vector, each further one from the link before. Only forces
and moments of the single bodies enter; the mass matrix is the response to unit accelerations,
column by column, so no closed form of it is written down anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Link:
    """One link with a point mass at its tip (SI); its inertia is about its own centre of mass."""

    length: float
    mass: float
    centre: float
    inertia: float
    payload: float = 0.0
    viscous: float = 0.0
    coulomb: float = 0.0
    coulomb_speed: float = 0.02

    @classmethod
    def from_model(cls, model: Mapping[str, Any]) -> Link:
        """Link of a rig description, whose ``name`` and ``joint`` do not matter here."""
        return cls(**{key: value for key, value in model.items() if key not in ("name", "joint")})

    def friction(self, rate: float) -> float:
        """Torque against the rate of the link's own joint, N m."""
        return self.viscous * rate + self.coulomb * math.tanh(rate / self.coulomb_speed)


@dataclass(frozen=True)
class PlanarArm:
    """Links from the base outwards."""

    links: Sequence[Link]
    gravity: float = 9.80665
    #: Of the first link from the direction of gravity where its joint's angle is zero, rad.
    base_angle: float = 0.0

    def inverse_dynamics(
        self,
        angle: Sequence[float],
        rate: Sequence[float],
        acceleration: Sequence[float],
        gravity: float | None = None,
    ) -> list[float]:
        """Joint torques (N m) that make the motion, friction left out; `gravity` in place of the
        arm's own.
        """
        phi = omega = alpha = 0.0
        # The base rises with g instead of every body falling; the axes turn with a tilted base.
        rise = self.gravity if gravity is None else gravity
        ax, ay = rise * math.sin(self.base_angle), rise * math.cos(self.base_angle)
        moved = []
        for link, q, v, a in zip(self.links, angle, rate, acceleration, strict=True):
            phi, omega, alpha = phi + q, omega + v, alpha + a
            ux, uy = math.sin(phi), -math.cos(phi)
            # A point at distance s from the joint has the acceleration of the joint plus s (alpha
            # n - omega^2 u), n = (-uy, ux).
            bx, by = -alpha * uy - omega**2 * ux, alpha * ux - omega**2 * uy
            centre = link.mass * (ax + link.centre * bx), link.mass * (ay + link.centre * by)
            ax, ay = ax + link.length * bx, ay + link.length * by
            moved.append(
                (link, ux, uy, centre, (link.payload * ax, link.payload * ay), link.inertia * alpha)
            )
        torques = []
        fx = fy = moment = 0.0
        for link, ux, uy, centre, tip, spin in reversed(moved):
            fx, fy = fx + tip[0], fy + tip[1]
            moment += (
                spin
                + link.centre * (ux * centre[1] - uy * centre[0])
                + link.length * (ux * fy - uy * fx)
            )
            fx, fy = fx + centre[0], fy + centre[1]
            torques.append(moment)
        return torques[::-1]

    def mass_matrix(self, angle: Sequence[float]) -> NDArray[np.float64]:
        """H(q), kg m^2."""
        units = np.eye(len(self.links)).tolist()
        still = [0.0] * len(units)
        return np.array([self.inverse_dynamics(angle, still, unit, 0.0) for unit in units]).T

    def bias(self, angle: Sequence[float], rate: Sequence[float]) -> list[float]:
        """C(q, q') q' + G(q), N m."""
        return self.inverse_dynamics(angle, rate, [0.0] * len(self.links))

    def acceleration(
        self, angle: Sequence[float], rate: Sequence[float], torque: Sequence[float]
    ) -> list[float]:
        """Angular accelerations, rad/s^2, under the sums of joint torques `torque`; friction is the
        arm's own.
        """
        bias = self.bias(angle, rate)
        net = [
            t - b - link.friction(v)
            for t, b, link, v in zip(torque, bias, self.links, rate, strict=True)
        ]
        found: list[float] = np.linalg.solve(self.mass_matrix(angle), net).tolist()
        return found

    def kinetic_energy(self, angle: ArrayLike, rate: ArrayLike) -> Any:
        """Kinetic energy, J; complex angles and rates are allowed (complex-step derivatives)."""
        phi, omega = np.cumsum(np.asarray(angle)), np.cumsum(np.asarray(rate))
        total: Any = 0.0
        vx: Any = 0.0
        vy: Any = 0.0
        for link, x, y, w in zip(self.links, np.cos(phi), np.sin(phi), omega, strict=True):
            cx, cy = vx + link.centre * x * w, vy + link.centre * y * w
            vx, vy = vx + link.length * x * w, vy + link.length * y * w
            total += 0.5 * (
                link.mass * (cx**2 + cy**2) + link.payload * (vx**2 + vy**2) + link.inertia * w**2
            )
        return total

    def potential_energy(self, angle: ArrayLike) -> Any:
        """Potential energy above the height of the first joint, J; complex angles are allowed."""
        total: Any = 0.0
        height: Any = 0.0
        along = np.cumsum(np.asarray(angle)) + self.base_angle
        for link, x in zip(self.links, np.cos(along), strict=True):
            total += link.mass * (height - link.centre * x)
            height = height - link.length * x
            total += link.payload * height
        return self.gravity * total
