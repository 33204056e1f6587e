"""Made-up stands: their rigs, and recordings of each, by role and seed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.noisy import GAUGES, driven
from tests.tables import text_of

ISO = text_of(__file__, "iso")
LIMITED = text_of(__file__, "regulated_limits")
WALL = "chamber.heat_transfer_coefficient"
WARM = ISO[: ISO.index("alpha_in")] + (
    'gas = "energy_balance"\n'
    'heat_transfer_coefficient = { value = 20, unit = "W/(m2 K)", tol = 4 }\n'
)
SPRING = """
stiffness    = { value = 20, unit = "N m/rad", tol = 1 }
spring_angle = { value = 90, unit = "deg", tol = 1 }
"""
MOUNTED = parse_rig(
    pamrs.rigs.shoulder()
    .to_toml_text()
    .replace("[joint]\n", "[joint]" + SPRING)
    .replace("[arm]\n", '[arm]\nbase_angle = { value = -10, unit = "deg", tol = 0.5 }\n')
)
ONE_GAUGE = {"muscle_pressure": 400.0, "joint_angle": 3e-4}
"""Noise of a regulated joint whose outlet has no gauge."""


def both_ways(rng: np.random.Generator, count: int, low: float, high: float) -> np.ndarray:
    """Voltages that fill and vent by turns."""
    return 5.0 + rng.uniform(low, high, count) * np.resize([1.0, -1.0], count)


def vented(
    rig: Rig, role: str, seed: int, noise: Mapping[str, float] = GAUGES, skipped: float = 0.0
) -> Recording:
    """Eight seconds at 200 Hz of a chamber that is filled and vented in steps, the first ones left
    out; the channels that have noise.
    """
    command = {"valve_command": both_ways(np.random.default_rng(seed), 16, 0.5, 4.0).repeat(100)}
    first = round(skipped / 0.005)
    return driven(rig, f"r{seed}", role, 0.005, command, noise, [7, seed], first=first)


def set_in_steps(rig: Rig, role: str, seed: int, seconds: int = 8) -> Recording:
    """Steps of a regulator's set pressure at 200 Hz, at rest before the log."""
    levels = np.random.default_rng(seed).uniform(0.5e5, 6e5, 2 * seconds - 1)
    command = {"supply_command": np.concatenate([[0.5e5], levels]).repeat(100)}
    return driven(rig, f"r{seed}", role, 0.005, command, GAUGES, [1, seed])


def lifted(rig: Rig, role: str, seed: int) -> Recording:
    """Twelve seconds of a shoulder at 100 Hz, up and down in steps of the valve."""
    command = {"valve_command": both_ways(np.random.default_rng(seed), 24, 0.3, 1.2).repeat(50)}
    noise = GAUGES | {"joint_angle": 5e-4}
    start = {"muscle_pressure": 3e5, "joint_angle": 0.9}
    return driven(rig, f"r{seed}", role, 0.01, command, noise, [2, seed], initial=start)


def switched(rig: Rig, role: str, seed: int) -> Recording:
    """Eight seconds at 200 Hz of commands of one or two valves that are held for some samples."""
    rng = np.random.default_rng([7, seed])
    tables = rig.tables("valve")
    table = next(iter(tables.values()))
    low = -1.0 if table["spool"] == "second_order" else 0.0
    commands = {}
    for name in tables:
        share = np.repeat(rng.uniform(low, 1.0, 80), 20)
        channel = f"valve_command.{name}" if name else "valve_command"
        commands[channel] = table["null_voltage"] + table["half_range"] * share
    return driven(rig, f"r{seed}", role, 0.005, commands, {"muscle_pressure": 300.0}, [2, seed])


def set_in_waves(rig: Rig, role: str, seed: int) -> Recording:
    """Waves and steps of a regulator's set pressure, without the supply's gauge."""
    time = np.arange(0.0, 14.0, 0.005)
    command = 1.9e5 + 0.7e5 * np.sin(2 * np.pi * (0.15 + 0.05 * seed) * time)
    command += 0.4e5 * np.sign(np.sin(2 * np.pi * 0.23 * time + seed))
    given = {"supply_command": command}
    return driven(rig, f"r{seed}", role, 0.005, given, ONE_GAUGE, [41, seed])


def antagonists(rig: Rig, role: str, seed: int, rows: int = 1600, angle: float = 3e-4) -> Recording:
    """Both valves of the antagonistic joint moved against each other, 8 s at 200 Hz; the angle is
    read so finely [rad].
    """
    time, phase = 0.005 * np.arange(rows), np.random.default_rng([7, seed]).uniform(0.0, 6.0, 3)
    flexor = 0.5 * np.sin(1.3 * time + phase[0]) + 0.35 * np.sin(3.1 * time + phase[1])
    extensor = 0.5 * np.sin(1.3 * time + phase[0] + 0.4) + 0.3 * np.sin(2.7 * time + phase[2])
    commands = {"valve_command.flexor": 5.0 + flexor, "valve_command.extensor": 5.0 - extensor}
    pressures = ("supply_pressure", "muscle_pressure.flexor", "muscle_pressure.extensor")
    noise = dict.fromkeys(pressures, 400.0) | {"joint_angle.elbow": angle}
    return driven(rig, f"r{seed}", role, 0.005, commands, noise, [11, seed])
