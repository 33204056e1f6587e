"""The reference model's own consistency (pamrs plays no part here)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference import Joint, orifice_flow, shoulder
from tests.reference.gas import critical_ratio, flow_function

TABLE = shoulder().muscle.tabulate(-0.004, 0.37)


@given(st.floats(math.radians(15.0), math.radians(120.0)))
def test_moment_arm_is_the_slope_of_the_contraction(angle: float) -> None:
    """tau dtheta = n F dd holds because tau = n F dd/dtheta."""
    joint, h = Joint(), 1e-3
    d = [joint.contraction(angle + n * h) for n in (-2, -1, 1, 2)]
    slope = (d[0] - 8.0 * d[1] + 8.0 * d[2] - d[3]) / (12.0 * h)
    assert joint.moment_arm(angle) == pytest.approx(slope, abs=1e-12)


def test_contraction_is_zero_at_rest() -> None:
    joint = Joint()
    assert joint.contraction(joint.rest_angle) == pytest.approx(0.0, abs=1e-16)


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.003, 0.36), st.floats(0.0, 12e5))
def test_table_equals_the_exact_muscle(e: float, pressure: float) -> None:
    plant = shoulder()
    force, volume, slope = TABLE(e, pressure)
    assert force == pytest.approx(float(plant.muscle.force(pressure, e)), rel=1e-10, abs=1e-6)
    assert volume == pytest.approx(plant.muscle.geometry.solve(e).air_volume, rel=1e-11)
    if e > 0.0031:
        assert slope == pytest.approx(plant.muscle.geometry.air_volume_slope(e), rel=1e-6)


def test_flow_function_is_continuous() -> None:
    for ratio in (critical_ratio(), 0.999):
        below, above = flow_function(ratio * (1.0 - 1e-12)), flow_function(ratio * (1.0 + 1e-12))
        assert below == pytest.approx(above, rel=1e-8)
    assert flow_function(1.0) == 0.0


def test_choked_flow_is_proportional_to_upstream_pressure() -> None:
    flows = np.array([orifice_flow(1e-6, p, 1e5, 293.15, 287.05) for p in (4e5, 8e5)])
    assert flows[1] == pytest.approx(2.0 * flows[0], rel=1e-14)
    # ISO 6358: a nozzle of 1 mm2 passes 0.0404 p / sqrt(T) g/s per mm2 and Pa of upstream pressure.
    assert flows[0] == pytest.approx(0.0404 * 1e-6 * 4e5 / math.sqrt(293.15), rel=2e-3)
