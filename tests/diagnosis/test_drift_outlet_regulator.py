"""An outlet that is no orifice, zeros that drift, a regulator that waits and has limits: each is
named.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import prepare
from pamrs.recordings import Recording, load_case
from pamrs.rig import parse_rig
from tests.diagnosis.asked import diagnosed, leading
from tests.diagnosis.noisy import noisy
from tests.diagnosis.stands import set_in_steps
from tests.tables import text_of

FAULTS = Path(__file__).parents[1] / "faults"
REGULATED = text_of(__file__, "regulated")
SLEW, DELAY = "supply_regulator_slew", "supply_regulator_delay"


def regulated(**effects: dict[str, float]) -> pamrs.Diagnosis:
    rig = nominal = parse_rig(REGULATED)
    for effect, values in effects.items():
        rig = rig.with_effect(effect, values)
    return diagnosed(nominal, partial(set_in_steps, rig, seconds=5), ("fit", "held_out"))


def test_dead_time_and_slew_limits_of_a_regulator_are_found_without_a_guess() -> None:
    found = regulated(
        supply_regulator_delay={"delay": 0.024},
        supply_regulator_slew={"rise_limit": 73e5, "fall_limit": 21e5},
    )
    # a late clock of the pressures is the same data as a dead time
    best = f"{DELAY}+{SLEW}"
    assert leading(found) == best
    assert found.probabilities[best] > 0.6, found
    sizes = {name: p.value for e in found.effects for name, p in e.parameters.items()}
    assert sizes["delay"] == pytest.approx(0.024, abs=1e-3)
    assert sizes["rise_limit"] == pytest.approx(73e5, rel=0.05)
    assert sizes["fall_limit"] == pytest.approx(21e5, rel=0.05)


def test_a_regulator_without_limits_has_no_name() -> None:
    found = regulated()
    assert not found.effects, found


def test_an_outlet_that_is_laminar_is_no_lag_of_the_gauge() -> None:
    found = pamrs.diagnose(load_case(FAULTS / "05_laminar_outlet"))
    assert leading(found) == "line_flow_law", found
    lags = [p for key, p in found.probabilities.items() if "pressure_lag" in key.split("+")]
    assert sum(lags) < 0.02, found


def test_a_load_cell_that_drifts_is_no_modulus_that_does() -> None:
    case = load_case(FAULTS / "06_load_cell_drift")
    shorter = [recording.between(None, 35.0) for recording in case.recordings]
    found = pamrs.diagnose(replace(case, recordings=shorter))
    assert "load_cell_drift" in leading(found).split("+"), found


def test_even_strokes_are_no_steps_of_a_converter() -> None:
    case = load_case(FAULTS / "06_load_cell_drift")
    for recording in case.recordings:
        # written to 0.1 um, 0.4 mm from sample to sample
        assert prepare(recording, case.rig, DiagnosisSettings()).noise["length"] < 1e-5


def stroked(role: str, seed: int, drift: float, gauge: float) -> Recording:
    """Forty seconds of slow strokes at three held pressures, with zeros that drift [per minute]."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 42.0, 0.05)
    held = rng.permutation([1e5, 2e5, 3e5])[(time // 14).astype(int)]
    length = 0.25 + 0.02 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * time / 10 + seed))
    rig = load_case(FAULTS / "06_load_cell_drift").rig
    run = pamrs.simulate(rig, length=length, pressure=held, sample_time=0.05)
    channels = {
        "length": length,
        "muscle_pressure": held + gauge * time / 60.0,
        "force": run["muscle_force"] + drift * time / 60.0,
    }
    noise = {"length": 1e-6, "muscle_pressure": 50.0, "force": 0.5}
    return noisy(f"r{seed}", role, 0.05, channels, noise, [3, seed])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "sizes"), [("load_cell_drift", (40.0, -25.0)), ("gauge_drift", (1.5e4, -1e4))]
)
def test_each_recording_has_a_drift_of_its_own(effect: str, sizes: tuple[float, float]) -> None:
    cell = effect == "load_cell_drift"

    def made(role: str, seed: int) -> Recording:
        return stroked(role, seed, sizes[seed] * cell, sizes[seed] * (not cell))

    found = diagnosed(load_case(FAULTS / "06_load_cell_drift").rig, made, ("fit", "fit"))
    assert leading(found) == effect, found
    (named,) = found.effects
    told = {event["recording"]: event["change"] for event in named.events}
    assert [told["r0"], told["r1"]] == pytest.approx(sizes, rel=0.15)
