"""Chapter 6's lifting cycles as a quasi-static balance: no valve, no controller, no inertia.

At every angle of the cosine lift the pressure is that with which the muscles bear weight and
friction. The chamber equation (6.4), integrated along the motion, says what air goes in; the tank
gives it at constant temperature (6.5). What has to go out goes to the ambient and is lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .plant import Plant, shoulder

#: Of 6.4.2: seconds for a lift, radians at its begin.
RISE = 6.0
LOW = math.radians(15.0)


@dataclass(frozen=True)
class Balance:
    """Of all cycles together: work of the muscles while the arm rises, and what the tank lost [J];
    torques of the first lift at their angles.
    """

    work: float
    energy: float

    @property
    def efficiency(self) -> float:
        """(6.9)."""
        return self.work / self.energy


def lifting_plant(
    payload: float, muscles: int, *, model: str = "robinson", ambient: float = 101325.0
) -> Plant:
    """The shoulder with a payload [kg], as many muscles, each with its share of the dead volume."""
    plant = shoulder()
    return replace(
        plant,
        muscle=replace(plant.muscle, count=muscles, model=model),
        gas=replace(plant.gas, ambient_pressure=ambient),
        chamber=replace(plant.chamber, dead_volume=plant.chamber.dead_volume * muscles / 6.0),
        arm=replace(plant.arm, payload=payload),
    )


def cycles(plant: Plant, high: float, count: int = 8, *, points: int = 400) -> Balance:
    """The cycles of 6.4.2 up to an angle [rad], from muscles without air."""
    share = np.linspace(0.0, 1.0, points)
    angle = LOW + (high - LOW) * 0.5 * (1.0 - np.cos(math.pi * share))
    rate = (high - LOW) * 0.5 * math.pi / RISE * np.sin(math.pi * share)
    up, torque_up, volume = _along(plant, angle, rate)
    down, _, _ = _along(plant, angle[::-1], -rate[::-1])
    into = 0.0
    before = 0.0
    for _ in range(count):
        into += _filled(plant, np.r_[before, up], np.r_[volume[0], volume])
        # what the motion down asks for first vents, then fills a little at the end
        into += _filled(plant, np.r_[up[-1], down], np.r_[volume[-1], volume[::-1]])
        before = float(down[-1])
    work = float(np.trapezoid(torque_up, angle))
    return Balance(count * work, into)


def _along(
    plant: Plant, angle: NDArray[np.float64], rate: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gauge pressures, torques and volumes with which the arm moves so slowly."""
    arm, chamber, muscle = plant.arm, plant.chamber, plant.muscle
    moment = arm.first_moment + arm.payload * arm.length
    pressures, torques, volumes = [], [], []
    for bent, turning in zip(angle, rate, strict=True):
        friction = arm.viscous * turning + arm.coulomb * math.tanh(turning / arm.coulomb_speed)
        wanted = moment * arm.gravity * math.sin(bent) + friction

        def lacking(gauge: float, bent: float = bent, wanted: float = wanted) -> float:
            return plant.torque(gauge + plant.gas.ambient_pressure, bent) - wanted

        pressure = 0.0 if lacking(0.0) >= 0.0 else float(brentq(lacking, 0.0, 3e6))
        e = plant.joint.contraction(bent) / muscle.geometry.rest_length
        pressures.append(pressure)
        torques.append(plant.torque(pressure + plant.gas.ambient_pressure, bent))
        volumes.append(muscle.count * plant.table(e, pressure)[1] + chamber.dead_volume)
    return np.array(pressures), np.array(torques), np.array(volumes)


def _filled(plant: Plant, pressure: NDArray[np.float64], volume: NDArray[np.float64]) -> float:
    """What the tank loses [J] for a path of gauge pressures and volumes: ``alpha_in R T dm = V dP
    + alpha P dV`` where that is above zero.
    """
    whole = pressure + plant.gas.ambient_pressure
    middle, mean = 0.5 * (volume[1:] + volume[:-1]), 0.5 * (whole[1:] + whole[:-1])
    moved = middle * np.diff(pressure) + plant.chamber.alpha * mean * np.diff(volume)
    return float(np.maximum(moved, 0.0).sum()) / plant.chamber.alpha_in
