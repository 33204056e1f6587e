"""Muscle of pamrs against the independent reference, and laws it must keep."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings

import pamrs
from tests.property.strategies import both, muscle_arguments
from tests.tables import rows_of

FEW = settings(max_examples=25, deadline=None)


@FEW
@given(muscle_arguments())
def test_rest_shape(arguments: dict[str, Any]) -> None:
    muscle, model = both(arguments)
    bore = 0.5 * arguments["rest_diameter"] - arguments["wall_thickness"]
    assert float(muscle.radius(0.0)) == pytest.approx(0.5 * arguments["rest_diameter"], rel=1e-12)
    assert float(muscle.thickness(0.0)) == pytest.approx(arguments["wall_thickness"], rel=1e-12)
    assert float(muscle.air_volume(0.0)) == pytest.approx(
        math.pi * bore**2 * arguments["rest_length"], rel=1e-12
    )
    # At rest there is no strain, so no elastic force either.
    assert float(muscle.force(0.0, 0.0)) == pytest.approx(0.0, abs=1e-6)
    assert float(muscle.force(3e5, 0.0)) == pytest.approx(
        3e5 * model.coefficients(0.0)[0], rel=1e-9
    )


@pytest.mark.parametrize("e", [1e-300, 1e-17, -1e-17, 1e-15, -1e-15, 1e-12, -1e-12])
def test_a_hair_from_rest(e: float) -> None:
    muscle = shoulder_muscle()
    assert float(muscle.radius(e)) == pytest.approx(0.0127, rel=1e-9)
    assert float(muscle.force(4e5, e)) == pytest.approx(float(muscle.force(4e5, 0.0)), rel=1e-7)


def shoulder_muscle(**changes: Any) -> pamrs.Muscle:
    """Muscle of the shoulder rig with some arguments changed."""
    arguments: dict[str, Any] = {
        "rest_length": 0.276,
        "rest_diameter": 0.0254,
        "braid_angle": math.radians(73.5),
        "wall_thickness": 0.003175,
        "modulus_slope": [3.0, -0.35, 0.0, 0.0],
        "modulus_offset": [1.15e6, -0.15e6, 0.0, 0.0],
    }
    return pamrs.Muscle(**{**arguments, **changes})


@pytest.mark.parametrize(
    ("name", "value"),
    rows_of(__file__, "impossible_muscle_is_refused_by_name"),
)
def test_impossible_muscle_is_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=name) as caught:
        shoulder_muscle(**{name: value})
    assert isinstance(caught.value, (pamrs.ParameterError, pamrs.RigError))
