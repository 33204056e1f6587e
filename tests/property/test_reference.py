"""The reference model's own consistency (pamrs plays no part here)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference import shoulder

TABLE = shoulder().muscle.tabulate(-0.004, 0.37)


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.003, 0.36), st.floats(0.0, 12e5))
def test_table_equals_the_exact_muscle(e: float, pressure: float) -> None:
    plant = shoulder()
    force, volume, slope = TABLE(e, pressure)
    assert force == pytest.approx(float(plant.muscle.force(pressure, e)), rel=1e-10, abs=1e-6)
    assert volume == pytest.approx(plant.muscle.geometry.solve(e).air_volume, rel=1e-11)
    if e > 0.0031:
        assert slope == pytest.approx(plant.muscle.geometry.air_volume_slope(e), rel=1e-6)
