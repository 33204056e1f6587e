"""What a thermometer in a gas reads, beside the reference's gas and the law of its lag."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import pamrs
from pamrs.errors import ParameterError
from pamrs.rig import parse_rig
from tests.reference import network

Array = NDArray[np.float64]
AMBIENT, GAS_CONSTANT = 101325.0, 287.05
VOLUME, STEP, ROWS = 2e-3, 0.02, 401
TANK = f"""
schema = "pamrs.rig/1"
name = "tank"
[gas]
ambient_pressure = {{ value = {AMBIENT}, unit = "Pa" }}
temperature = {{ value = 293.15, unit = "K" }}
[chamber]
dead_volume      = {{ value = {VOLUME}, unit = "m3" }}
initial_pressure = {{ value = 6.0, unit = "bar" }}
gas = "energy_balance"
heat_transfer_coefficient = {{ value = 40, unit = "W/(m2 K)" }}
[line]
kind           = "orifice"
from           = "chamber"
to             = "ambient"
discharge_area = {{ value = 4.0, unit = "mm2" }}
"""


def late(time: Array, gas: Array, lag: float) -> Array:
    """Reading [K] of a thermometer that lags so much [s] behind a gas (n,): `T y' = gas - y`
    (Doebelin, Measurement Systems, ch. 8), from equilibrium.
    """
    curve, closest = CubicSpline(time, gas), {"rtol": 1e-9, "atol": 1e-9}
    law, span = (lambda t, y: (curve(t) - y) / lag), (0.0, float(time[-1]))
    return np.asarray(solve_ivp(law, span, gas[:1], t_eval=time, **closest).y[0])


def test_a_thermometer_reads_the_gas_late() -> None:
    """The reference's temperature, `T y' = temperature - y` integrated by SciPy over it."""
    rig = parse_rig(TANK)
    told = network.simulate(json.loads(rig.to_json()), {}, STEP, rows=ROWS)
    gas = (told["muscle_pressure"] + AMBIENT) * VOLUME / (told["air_mass"] * GAS_CONSTANT)
    assert gas.min() < 270.0
    times = {"duration": STEP * (ROWS - 1), "sample_time": STEP, "step": 1e-3}
    plain = pamrs.simulate(rig, **times)
    np.testing.assert_allclose(plain["temperature"], gas, atol=1e-4)
    lag = 0.4
    read = late(told["time"], gas, lag)
    slow = rig.with_effect("thermometer_lag", {"time_constant": lag})
    run = pamrs.simulate(slow, **times)
    assert np.abs(read - gas).max() > 5.0
    np.testing.assert_allclose(run["temperature"], read, atol=2e-3)
    np.testing.assert_array_equal(run["muscle_pressure"], plain["muscle_pressure"])


def test_one_of_two_chambers_may_have_a_slow_thermometer() -> None:
    first = TANK.replace("[chamber]", "[chamber.a]").replace('"chamber"', '"chamber.a"')
    other = TANK[TANK.index("[chamber]") : TANK.index("[line]")].replace("6.0", "0.0")
    rig = parse_rig(
        first.replace('"ambient"', '"chamber.b"') + other.replace("[chamber]", "[chamber.b]")
    )
    slow = rig.with_effect("thermometer_lag", {"time_constant": 0.3}, at="b")
    runs = [pamrs.simulate(r, duration=2.0, sample_time=STEP) for r in (rig, slow)]
    np.testing.assert_array_equal(runs[0]["temperature.a"], runs[1]["temperature.a"])
    assert np.abs(runs[0]["temperature.b"] - runs[1]["temperature.b"]).max() > 5.0
    with pytest.raises(ParameterError, match="'c' names no chamber"):
        rig.with_effect("thermometer_lag", at="c")
