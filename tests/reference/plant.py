"""One-link arm on parallel muscles and a tendon joint: torque and volume at an angle."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .geometry import GeometryReference
from .muscle import MuscleReference, MuscleTable


@dataclass(frozen=True)
class Gas:
    """Ambient state and gas properties (SI)."""

    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05
    heat_capacity_ratio: float = 1.4


@dataclass(frozen=True)
class Chamber:
    """Dead volume (m^3) and polytropic exponents."""

    dead_volume: float = 1.5e-4
    alpha_in: float = 1.4
    alpha_out: float = 1.0
    alpha: float = 1.2


@dataclass(frozen=True)
class Joint:
    """Tendon joint (lengths m, angles rad) with stiff stops."""

    upper_axial: float = 0.0254
    upper_offset: float = 0.027432
    lower_axial: float = 0.027432
    lower_offset: float = 0.004826
    rest_angle: float = math.radians(15.0)
    min_angle: float = math.radians(15.0)
    max_angle: float = math.radians(120.0)
    stop_stiffness: float = 2.0e4
    stop_damping: float = 60.0

    def _lower_point(self, angle: float) -> tuple[float, float]:
        phi = math.pi - angle - math.atan2(self.lower_offset, self.lower_axial)
        reach = math.hypot(self.lower_axial, self.lower_offset)
        return reach * math.cos(phi), reach * math.sin(phi)

    @cached_property
    def tendon_length(self) -> float:
        """Tendon length that makes the contraction zero at the rest angle, m."""
        x, y = self._lower_point(self.rest_angle)
        return math.hypot(self.upper_axial - x, self.upper_offset - y)

    def contraction(self, angle: float) -> float:
        """Muscle contraction d, m."""
        x, y = self._lower_point(angle)
        return (
            x + math.sqrt(self.tendon_length**2 - (self.upper_offset - y) ** 2) - self.upper_axial
        )

    def moment_arm(self, angle: float) -> float:
        """dd/dangle, m."""
        x, y = self._lower_point(angle)
        s = math.sqrt(self.tendon_length**2 - (self.upper_offset - y) ** 2)
        return y - (self.upper_offset - y) * x / s

    def stop_torque(self, angle: float, rate: float) -> float:
        """Torque of the end stops, N m; a stop pushes, it never pulls."""
        if angle < self.min_angle:
            return max(
                self.stop_stiffness * (self.min_angle - angle) - self.stop_damping * rate, 0.0
            )
        if angle > self.max_angle:
            return -max(
                self.stop_stiffness * (angle - self.max_angle) + self.stop_damping * rate, 0.0
            )
        return 0.0


@dataclass(frozen=True)
class Arm:
    """One-link arm with a payload at its tip (SI)."""

    inertia: float = 0.634
    first_moment: float = 1.8
    length: float = 0.9
    payload: float = 9.07
    viscous: float = 3.0
    coulomb: float = 1.5
    coulomb_speed: float = 0.02
    gravity: float = 9.80665
    #: Of the link from the direction of gravity at the joint's zero, and of the centre of mass off
    #: the line of the link.
    base_angle: float = 0.0
    centre_angle: float = 0.0

    def acceleration(self, angle: float, rate: float, torque: float) -> float:
        """Angular acceleration, rad/s^2, under the sum of joint torques `torque`."""
        friction = self.viscous * rate + self.coulomb * math.tanh(rate / self.coulomb_speed)
        link = angle + self.base_angle
        weight = self.gravity * (
            self.first_moment * math.sin(link + self.centre_angle)
            + self.payload * self.length * math.sin(link)
        )
        return (torque - friction - weight) / (self.inertia + self.payload * self.length**2)


@dataclass(frozen=True)
class Plant:
    """Muscles with their chamber, tendon joint and arm."""

    muscle: MuscleReference
    gas: Gas = field(default_factory=Gas)
    chamber: Chamber = field(default_factory=Chamber)
    joint: Joint = field(default_factory=Joint)
    arm: Arm = field(default_factory=Arm)

    @cached_property
    def table(self) -> MuscleTable:
        """Muscle table over the stroke of the joint, with a margin for the depth of the stops."""
        joint, rest = self.joint, self.muscle.geometry.rest_length
        low = joint.contraction(joint.min_angle) / rest
        high = (
            max(joint.contraction(a) for a in np.linspace(joint.min_angle, joint.max_angle, 201))
            / rest
        )
        return self.muscle.tabulate(
            low - 0.004, min(high + 0.01, self.muscle.geometry.max_contraction)
        )

    def torque(self, muscle_pressure: float, angle: float) -> float:
        """Torque of all muscles at an absolute pressure, N m."""
        e = self.joint.contraction(angle) / self.muscle.geometry.rest_length
        force = self.table(e, muscle_pressure - self.gas.ambient_pressure)[0]
        return self.muscle.count * force * self.joint.moment_arm(angle)


def shoulder() -> Plant:
    """Return the nominal shoulder: six one-inch latex muscles."""
    geometry = GeometryReference(0.276, 0.0254, math.radians(73.5), 0.003175)
    return Plant(
        MuscleReference(geometry, [3.0, -0.35, 0.0, 0.0], [1.15e6, -0.15e6, 0.0, 0.0], 1.0, 6)
    )
