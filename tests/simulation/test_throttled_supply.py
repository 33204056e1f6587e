"""A supply line that restricts: a line from the supply to a chamber in front of the valve."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs

ROWS = 301
TIME = 0.005 * np.arange(ROWS)
FILL = np.where(TIME < 0.8, 7.5, 5.0)
START = {"muscle_pressure.muscle": 1e5, "muscle_pressure.feed": 13.8e5}


def run(**changes: float) -> pamrs.Simulation:
    rig = pamrs.rigs.named("throttled_supply")
    values = {name.replace("__", "."): value for name, value in changes.items()}
    return pamrs.simulate(rig.with_parameters(values), FILL, sample_time=0.005, initial=START)


def wide() -> np.ndarray:
    """Pressure of the plain shoulder."""
    start = {"muscle_pressure": 1e5}
    run = pamrs.simulate(pamrs.rigs.shoulder(), FILL, sample_time=0.005, initial=start)
    return run["muscle_pressure"]


def test_without_restriction_it_is_the_plain_shoulder() -> None:
    """The wider the line and the smaller the chamber, the nearer."""
    plain, apart = wide(), []
    for area, volume in ((4e-5, 2e-5), (1.6e-4, 5e-6)):
        found = run(line__feed__discharge_area=area, chamber__feed__dead_volume=volume)
        difference = found["muscle_pressure.muscle"] - plain
        apart.append(float(np.abs(difference).max() / np.ptp(plain)))
    assert apart[1] < 0.2 * apart[0]
    assert apart[1] < 2e-3


def test_a_narrow_line_chokes_and_decides_the_flow() -> None:
    """Behind an open valve the mass that leaves the tank is that of the choked orifice."""
    area = 5e-7
    found = run(line__feed__discharge_area=area)
    late = (TIME > 0.6) & (TIME < 0.8)
    tank = found["supply_pressure"][late] + 101325.0
    assert np.all(found["muscle_pressure.feed"][late] + 101325.0 < 0.5 * tank)
    flow = np.gradient(found["mass_supplied"], TIME)[late]
    choked = 0.68473 * area * tank / (287.05 * 293.15) ** 0.5
    np.testing.assert_allclose(flow, choked, rtol=1e-4)


def test_what_it_is_connected_to_is_told() -> None:
    rig = pamrs.rigs.named("throttled_supply")
    assert rig.wiring[:2] == [
        "air: chamber.feed -> valve -> chamber.muscle -> ambient",
        "air: supply -> line.feed -> chamber.feed",
    ]
    assert rig.parameter("line.feed.discharge_area").tol == pytest.approx(5e-7)
