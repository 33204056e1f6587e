"""A chamber with an energy balance: the coefficient of its wall is a parameter like others."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.noisy import noisy
from tests.diagnosis.test_iso_valve import TEXT as ISO

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0}
WALL = "chamber.heat_transfer_coefficient"
TEXT = ISO[: ISO.index("alpha_in")] + (
    'gas = "energy_balance"\n'
    'heat_transfer_coefficient = { value = 20, unit = "W/(m2 K)", tol = 4 }\n'
)


def recorded(
    rig: pamrs.Rig,
    role: str,
    seed: int,
    noise: Mapping[str, float] = NOISE,
    skipped: float = 0.0,
) -> Recording:
    """Eight seconds at 200 Hz of a chamber that is filled and vented in steps, the first ones left
    out; the channels that have noise.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 8.0, 0.005)
    steps = 5.0 + rng.uniform(0.5, 4.0, 16) * np.tile([1.0, -1.0], 8)
    command = steps[(time / 0.5).astype(int)]
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    first = round(skipped / 0.005)
    channels = {"valve_command": command} | {name: run[name] for name in noise}
    kept = {name: values[first:] for name, values in channels.items()}
    return noisy(f"r{seed}", role, 0.005, kept, noise, [7, seed])


def diagnosed(nominal: pamrs.Rig, true: pamrs.Rig) -> pamrs.Diagnosis:
    roles = ("fit", "fit", "held_out")
    recordings = [recorded(true, role, seed) for seed, role in enumerate(roles)]
    return pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))


def test_a_true_model_misses_nothing() -> None:
    nominal = parse_rig(TEXT)
    assert diagnosed(nominal, nominal).verdict == "none"


@pytest.mark.slow
def test_a_wall_that_takes_three_times_the_heat_is_named() -> None:
    nominal = parse_rig(TEXT)
    found = diagnosed(nominal, nominal.with_parameters({WALL: 60.0}))
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == WALL
    assert wrong["value"] == pytest.approx(60.0, rel=0.05)
