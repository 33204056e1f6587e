"""A spring across the joint and a tilted base whose numbers in the file are wrong are named."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.noisy import noisy

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 5e-4}
SPRING = """
stiffness    = { value = 20, unit = "N m/rad", tol = 1 }
spring_angle = { value = 90, unit = "deg", tol = 1 }
"""
MOUNTED = 'base_angle = { value = -10, unit = "deg", tol = 0.5 }\n'
TEXT = (
    pamrs.rigs.shoulder()
    .to_toml_text()
    .replace("[joint]\n", "[joint]" + SPRING)
    .replace("[arm]\n", "[arm]\n" + MOUNTED)
)


def recorded(rig: pamrs.Rig, role: str, seed: int) -> Recording:
    """Twelve seconds at 100 Hz, up and down in steps of the valve."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 12.0, 0.01)
    steps = 5.0 + rng.uniform(0.3, 1.2, 24) * np.tile([1.0, -1.0], 12)
    command = steps[(time / 0.5).astype(int)]
    start = {"muscle_pressure": 3e5, "joint_angle": 0.9}
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.01, initial=start)
    channels = {"valve_command": command} | {name: run[name] for name in NOISE}
    return noisy(f"r{seed}", role, 0.01, channels, NOISE, [2, seed])


@pytest.mark.parametrize(
    ("name", "true"),
    [
        ("", 0.0),
        pytest.param("joint.stiffness", 35.0, marks=pytest.mark.slow),
        pytest.param("arm.base_angle", math.radians(-20.0), marks=pytest.mark.slow),
    ],
)
def test_what_is_wrong_in_the_file_is_named(name: str, true: float) -> None:
    nominal = parse_rig(TEXT)
    rig = nominal.with_parameters({name: true} if name else {})
    roles = ("fit", "fit", "held_out")
    recordings = [recorded(rig, role, seed) for seed, role in enumerate(roles)]
    found = pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))
    if not name:
        assert found.verdict == "none"
        return
    assert found.verdict == "parameters"
    wrong = {entry["name"]: entry["value"] for entry in found.wrong_parameters}
    assert wrong[name] == pytest.approx(true, rel=0.1)
