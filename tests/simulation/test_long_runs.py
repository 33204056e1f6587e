"""What long runs show: energy over 1,000 swings, and a muscle contracted to its end."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

import pamrs
from tests.reference.geometry import GeometryReference
from tests.reference.muscle import MuscleReference
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


def test_a_muscle_contracts_to_its_end_and_stays_there() -> None:
    light, pressure = 0.5, 7.0e5
    rig = pamrs.rigs.hanging_mass().with_parameters({"load.mass": light})
    run = pamrs.simulate(rig, np.full(2001, 10.0), sample_time=0.005)
    length, held = run["length"], run["muscle_pressure"]
    assert not any(event.kind.startswith("braid") for event in run.events)
    assert held[-1] > 0.95 * pressure  # the tank has given some
    model = rig.model["muscle"]
    geometry = GeometryReference(
        *(model[key] for key in ("rest_length", "rest_diameter", "braid_angle", "wall_thickness"))
    )
    muscle = MuscleReference(geometry, model["modulus_slope"], model["modulus_offset"])
    table = muscle.tabulate(0.0, 0.36)
    weight = light * 9.80665 / model["count"]
    end = brentq(lambda e: float(table(e, held[-1])[0]) - weight, 0.05, 0.35)
    assert 1.0 - length[-1] / model["rest_length"] > 0.25
    assert abs(1.0 - length[-1] / model["rest_length"] - end) < 1e-5
    assert np.ptp(length[-200:]) < 1e-6
