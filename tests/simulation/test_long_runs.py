"""What long runs show: energy over 1,000 swings."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import cumulative_simpson

import pamrs
from tests.reference.plant import shoulder

CYCLES = 1000
AMBIENT = 101325.0


def frictionless() -> pamrs.Rig:
    """The shoulder without friction, its muscles struts: with the valve shut it only swings."""
    return pamrs.rigs.shoulder().with_parameters(
        {"arm.viscous": 0.0, "arm.coulomb": 0.0, "muscle.buckling_load": 1e9}
    )


def potential(angle: np.ndarray, pressure: float, start: float) -> np.ndarray:
    """Of weight, rubber and the air that is shut in [J] by the reference, over angles."""
    plant = shoulder()
    muscle, rest = plant.muscle, plant.muscle.geometry.rest_length

    def volume(bent: float) -> float:
        one = plant.table(plant.joint.contraction(bent) / rest, 0.0)[1]
        return muscle.count * one + plant.chamber.dead_volume

    first = (pressure + AMBIENT) * volume(start) ** plant.chamber.alpha
    moment = plant.arm.first_moment + plant.arm.payload * plant.arm.length
    torque = [
        plant.torque(first / volume(bent) ** plant.chamber.alpha, bent)
        - moment * plant.arm.gravity * math.sin(bent)
        for bent in angle
    ]
    return np.asarray(-cumulative_simpson(torque, x=angle, initial=0.0))


def test_energy_of_a_thousand_swings_stays() -> None:
    rig = frictionless()
    start, pressure, sample = math.radians(70.0), 3.5e5, 0.01
    shut = rig.parameter("valve.null_voltage").value
    rows, begun = 110_000, {"joint_angle": start, "muscle_pressure": pressure}
    kept = {"sample_time": sample, "record": ["joint_angle", "joint_rate"]}
    run = pamrs.simulate(rig, np.full(rows, shut), initial=begun, **kept)
    angle, rate = run["joint_angle"], run["joint_rate"]
    turns = int((np.diff(np.sign(rate)) != 0).sum())
    assert turns >= 2 * CYCLES
    assert angle.min() > math.radians(15.0)  # no stop
    assert np.ptp(angle) > math.radians(20.0)
    grid = np.linspace(angle.min(), angle.max(), 401)
    stored = np.interp(angle, grid, potential(grid, pressure, start))
    arm = rig.model["arm"]
    inertia = arm["inertia"] + arm["payload"] * arm["length"] ** 2
    energy = stored + 0.5 * inertia * rate**2
    swing = float(np.ptp(stored))
    part = rows // 50
    drift = (energy[-part:].mean() - energy[:part].mean()) / swing
    assert abs(drift) < 1e-6
    assert np.ptp(energy) < 1e-4 * swing  # what the reference's table and the grid leave open
