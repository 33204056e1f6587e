"""One-link arm driven by parallel muscles through a tendon joint, and the sealed rigid chamber."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from .gas import Valve, orifice_flow
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
class Trajectory:
    """Sampled states; pressures absolute in Pa, angle in rad, rate in rad/s; every array (n,)."""

    time: NDArray[np.float64]
    valve_command: NDArray[np.float64]
    muscle_pressure: NDArray[np.float64]
    supply_pressure: NDArray[np.float64]
    joint_angle: NDArray[np.float64]
    joint_rate: NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """Tank, valve, muscles, tendon joint and arm."""

    muscle: MuscleReference
    supply_volume: float = 0.015
    gas: Gas = field(default_factory=Gas)
    valve: Valve = field(default_factory=Valve)
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

    def derivative(self, state: NDArray[np.float64], command: float) -> list[float]:
        """Time derivative of (muscle pressure, supply pressure, angle, rate); pressures
        absolute.
        """
        pressure, supply, angle, rate = state.tolist()
        gas, rest, n = self.gas, self.muscle.geometry.rest_length, self.muscle.count
        moment_arm = self.joint.moment_arm(angle)
        force, volume_one, slope = self.table(
            self.joint.contraction(angle) / rest, pressure - gas.ambient_pressure
        )
        volume = n * volume_one + self.chamber.dead_volume
        volume_rate = n * slope * moment_arm * rate / rest
        area = self.valve.area(command)
        inflow = outflow = 0.0
        props = (gas.temperature, gas.gas_constant, gas.heat_capacity_ratio)
        if area > 0.0:
            inflow = orifice_flow(area, supply, pressure, *props)
        elif area < 0.0:
            outflow = orifice_flow(-area, pressure, gas.ambient_pressure, *props)
        rt = gas.gas_constant * gas.temperature
        chamber = self.chamber
        pressure_rate = (
            rt * (chamber.alpha_in * inflow - chamber.alpha_out * outflow)
            - chamber.alpha * pressure * volume_rate
        ) / volume
        torque = n * force * moment_arm + self.joint.stop_torque(angle, rate)
        return [
            pressure_rate,
            -rt * inflow / self.supply_volume,
            rate,
            self.arm.acceleration(angle, rate, torque),
        ]

    def _rhs(self, _: float, state: NDArray[np.float64], command: float) -> list[float]:
        return self.derivative(state, command)

    def simulate(
        self,
        valve_command: ArrayLike,
        sample_time: float,
        initial: Mapping[str, float],
        rtol: float = 1e-10,
    ) -> Trajectory:
        """Integrate adaptively, restarting at every sample, where the command may jump.

        Parameters
        ----------
        valve_command : array_like (n,)
            Volts; entry k is held from sample k to sample k + 1.
        sample_time : float
            Seconds between samples.
        initial : mapping
            ``muscle_pressure`` and ``supply_pressure`` (absolute, Pa), ``joint_angle`` (rad) and
            ``joint_rate`` (rad/s).
        """
        command = np.asarray(valve_command, dtype=float)
        names = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")
        states = np.empty((command.size, 4))
        states[0] = [initial[name] for name in names]
        atol = [rtol * scale for scale in (1e5, 1e6, 1.0, 1.0)]
        for k in range(command.size - 1):
            solution = solve_ivp(
                partial(self._rhs, command=float(command[k])),
                (0.0, sample_time),
                states[k],
                method="DOP853",
                rtol=rtol,
                atol=atol,
                first_step=min(1e-3, sample_time),
            )
            if not solution.success:
                raise RuntimeError(f"integration failed in sample {k}: {solution.message}")
            states[k + 1] = solution.y[:, -1]
        return Trajectory(
            sample_time * np.arange(command.size, dtype=np.float64), command, *states.T.copy()
        )


def shoulder() -> Plant:
    """Return the nominal shoulder rig: six one-inch latex muscles and a 15 L tank."""
    geometry = GeometryReference(0.276, 0.0254, math.radians(73.5), 0.003175)
    return Plant(
        MuscleReference(geometry, [3.0, -0.35, 0.0, 0.0], [1.15e6, -0.15e6, 0.0, 0.0], 1.0, 6)
    )


def with_overrides(plant: Plant, overrides: Mapping[str, float]) -> Plant:
    """Return `plant` with scalars replaced by dotted name: ``{"arm.payload": 10.0}`` (SI)."""
    groups: dict[str, dict[str, Any]] = {}
    for name, value in overrides.items():
        block, key = name.split(".")
        groups.setdefault(block, {})[key] = value
    for block, values in groups.items():
        if block == "supply":
            plant = replace(plant, supply_volume=values["volume"])
        elif block == "muscle":
            own = {k: v for k, v in values.items() if k in ("count", "modulus_scale")}
            shape = {k: v for k, v in values.items() if k not in own}
            geometry = replace(plant.muscle.geometry, **shape)
            plant = replace(plant, muscle=replace(plant.muscle, geometry=geometry, **own))
        else:
            plant = replace(plant, **{block: replace(getattr(plant, block), **values)})
    return plant


def sealed_chamber(pressure: float, times: ArrayLike) -> NDArray[np.float64]:
    """Pressure of a rigid chamber with no opening and no effect: it stays."""
    return np.full(np.shape(times), pressure)
