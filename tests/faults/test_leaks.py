"""Leaks of a gas with a temperature that begin with the first sample: no warm start is one."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.asked import diagnosed

CHAMBER = """
schema = "pamrs.rig/1"
name = "chamber"
[gas]
[chamber]
gas = "energy_balance"
heat_transfer_coefficient = { value = %s, unit = "W/(m2 K)", tol = %s }
dead_volume = { value = %s, unit = "l", tol = %s }
[sensors]
pressure_zero = { value = 0.0, unit = "Pa", tol = %s }
"""
SEALED = parse_rig(CHAMBER % (50, 25, 0.1, 0.002, 1000))
CUFF = parse_rig(CHAMBER % (20, 10, 0.4, 0.1, 200))


def logged(name: str, role: str, time: np.ndarray, pressure: np.ndarray) -> Recording:
    """A recording of a pressure alone [Pa]."""
    used, units = {"muscle_pressure": np.full(time.size, True)}, {"muscle_pressure": "Pa"}
    step = float(time[1] - time[0])
    return Recording(name, role, time, step, {"muscle_pressure": pressure}, used, units=units)


@pytest.mark.parametrize("conductance", [3.376e-12, 8.41e-12])
def test_a_leak_from_the_first_sample_is_a_leak(conductance: float) -> None:
    """6 bar that fall with a time constant of 250 or 100 s while the valve is shut."""
    rng = np.random.default_rng(11)
    true = SEALED.with_effect("leak_muscle", {"conductance": conductance})

    def made(role: str, k: int) -> Recording:
        start = {"muscle_pressure": (6.0, 5.5, 6.1)[k] * 1e5}
        run = pamrs.simulate(true, duration=40.0, sample_time=0.02, initial=start)
        pressure = run["muscle_pressure"] + rng.normal(0.0, 200.0, len(run["time"]))
        return logged(f"r{k}", role, np.asarray(run["time"]), pressure)

    found = diagnosed(SEALED, made)
    assert [effect.id for effect in found.effects] == ["leak_muscle"], found.summary()
    assert found.effects[0].parameters["conductance"].value == pytest.approx(conductance, rel=0.05)
    assert not any("begin in a transient" in warning for warning in found.warnings)


def deflated(law: str, role: str, k: int) -> Recording:
    """A cuff at 0.2 bar that lets its air out: isothermal, by a law of its own."""
    rng, time = np.random.default_rng([2, k]), np.arange(0.0, 17.0, 0.02)
    first = (165.0, 150.0, 170.0)[k]
    pressure = (
        first * np.exp(-time / 11.0)
        if law == "laminar"
        else (first**-0.5 + 0.5 * 0.0092 * time) ** -2.0
    )
    pressure = pressure + rng.normal(0.0, 0.15, time.size)
    return logged(f"r{k}", role, time, 133.322 * pressure)


@pytest.mark.parametrize("law", ["laminar", "power"])
def test_a_cuff_that_lets_its_air_out_leaks(law: str) -> None:
    """No gas at 0.2 bar is 50 K warm: compression makes 17 K at the most."""
    found = diagnosed(CUFF, lambda role, k: deflated(law, role, k))
    assert [effect.id for effect in found.effects] == ["leak_muscle"], found.summary()
    if law == "power":
        assert found.effects[0].parameters["exponent"].value == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(("rig", "warm"), [(SEALED, 30.0), (SEALED, -15.0), (CUFF, 8.0)])
def test_a_gas_that_begins_warm_or_cold_leaves_out_nothing(rig: Rig, warm: float) -> None:
    """Filled, or let out, just before: only the wall warms and cools it afterwards."""
    rng, first = np.random.default_rng(5), 0.2e5 if rig is CUFF else 6e5

    def made(role: str, k: int) -> Recording:
        start = {"muscle_pressure": first * (1.0 + 0.1 * k), "temperature": 293.15 + warm}
        run = pamrs.simulate(rig, duration=20.0, sample_time=0.02, initial=start)
        pressure = run["muscle_pressure"] + rng.normal(0.0, 20.0, len(run["time"]))
        return logged(f"r{k}", role, np.asarray(run["time"]), pressure)

    found = diagnosed(rig, made)
    assert found.verdict in ("none", "parameters"), found.summary()
    assert any(f"{warm:+.0f} K in r0" in warning for warning in found.warnings), found.warnings
