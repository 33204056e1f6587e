"""Muscle of pamrs against the independent reference, and laws it must keep."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import pamrs
from tests.property.strategies import both, contractions, muscle_arguments
from tests.tables import rows_of

FEW = settings(max_examples=25, deadline=None)


def away_from_fold(model: Any, e: np.ndarray) -> bool:
    """Whether the ends leave a straight middle and the braid is nowhere about to become taut."""
    geometry = model.geometry
    if geometry.kind == "cylinder":
        return True
    for x in e:
        shape = geometry.solve(float(x))
        if 2.0 * geometry.end_ellipse(float(x), shape.radius)[3] > 0.9 * shape.length:
            return False
    return bool(np.all(np.abs(e - geometry.taut_contraction()) > 1e-4))


@FEW
@given(muscle_arguments(), st.lists(st.floats(-0.9e5, 12e5), min_size=1, max_size=4))
def test_matches_reference(arguments: dict[str, Any], pressures: list[float]) -> None:
    muscle, model = both(arguments)
    e = contractions(model)
    assume(away_from_fold(model, e))
    shapes = [model.geometry.solve(float(x)) for x in e]
    np.testing.assert_allclose(muscle.radius(e), [s.radius for s in shapes], rtol=1e-10)
    np.testing.assert_allclose(muscle.thickness(e), [s.thickness for s in shapes], rtol=1e-9)
    np.testing.assert_allclose(muscle.air_volume(e), [s.air_volume for s in shapes], rtol=1e-9)
    p = np.array(pressures)
    want = np.column_stack([model.force(p, float(x)) for x in e])
    got = muscle.force(p[:, None], e[None, :])
    assert got.shape == (p.size, e.size)
    scale = max(float(np.max(np.abs(want))), 1.0)
    np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-9 * scale)


@FEW
@given(muscle_arguments(), st.floats(0.0, 1.0))
def test_force_is_linear_in_pressure(arguments: dict[str, Any], share: float) -> None:
    muscle, model = both(arguments)
    e = contractions(model)
    assume(away_from_fold(model, e))
    low, high = muscle.force(0.0, e), muscle.force(10e5, e)
    middle = muscle.force(share * 10e5, e)
    scale = float(np.max(np.abs([low, high]))) + 1.0
    np.testing.assert_allclose(middle, low + share * (high - low), rtol=0.0, atol=1e-11 * scale)


@FEW
@given(muscle_arguments())
def test_force_grows_with_pressure_where_the_gas_pulls(arguments: dict[str, Any]) -> None:
    arguments = {**arguments, "modulus_slope": [0.0], "modulus_offset": [1e6]}
    muscle, model = both(arguments)
    e = contractions(model)
    assume(away_from_fold(model, e))
    a_gas = np.array([model.coefficients(float(x))[0] for x in e])
    rise = muscle.force(6e5, e) - muscle.force(2e5, e)
    clear = np.abs(a_gas) > 1e-9 * np.max(np.abs(a_gas))
    np.testing.assert_array_equal(np.sign(rise[clear]), np.sign(a_gas[clear]))


@FEW
@given(muscle_arguments(geometry="cylinder"), st.floats(0.03, 0.3))
def test_cylinder_does_virtual_work(arguments: dict[str, Any], e: float) -> None:
    """Gas force of a cylinder: -dV/dL of the outer volume, plus the bladder term of the
    thickness.
    """
    arguments = {**arguments, "modulus_slope": [0.0], "modulus_offset": [0.0]}
    muscle, model = both(arguments)
    assume(e < 0.95 * model.geometry.max_contraction)
    # The bladder volume is constant, so air and outer volume have the same slope.
    step, rest = 1e-4, arguments["rest_length"]
    around = muscle.air_volume(e + step * np.array([-2.0, -1.0, 1.0, 2.0]))
    slope = (around[0] - 8.0 * around[1] + 8.0 * around[2] - around[3]) / (12.0 * step)
    length, radius, wall = rest * (1.0 - e), float(muscle.radius(e)), float(muscle.thickness(e))
    bladder = model.geometry.rubber_volume / length
    bladder -= wall * length**2 / (2.0 * math.pi * radius * model.geometry.turns**2)
    want = 1e5 * (slope / rest + bladder)
    scale = 1e5 * (abs(slope) / rest + abs(bladder))
    assert float(muscle.force(1e5, e)) == pytest.approx(want, rel=0.0, abs=1e-6 * scale)


@FEW
@given(muscle_arguments())
def test_rubber_keeps_its_volume(arguments: dict[str, Any]) -> None:
    muscle, model = both({**arguments, "geometry": "cylinder"})
    e = contractions(model)
    outer = math.pi * muscle.radius(e) ** 2 * arguments["rest_length"] * (1.0 - e)
    np.testing.assert_allclose(
        outer - muscle.air_volume(e), model.geometry.rubber_volume, rtol=1e-8
    )


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


@pytest.mark.parametrize("e", [math.nan, math.inf, -math.inf, 0.6, -0.2])
def test_impossible_contraction_is_refused(e: float) -> None:
    muscle = shoulder_muscle()
    for method in (muscle.radius, muscle.thickness, muscle.air_volume):
        with pytest.raises(pamrs.ParameterError, match="contraction|length"):
            method(np.array([0.1, e]))
    with pytest.raises(pamrs.ParameterError, match="contraction|length"):
        muscle.force(2e5, e)


@pytest.mark.parametrize("pressure", [math.nan, math.inf, -1.1e5])
def test_impossible_pressure_is_refused(pressure: float) -> None:
    with pytest.raises(pamrs.ParameterError, match="pressure"):
        shoulder_muscle().force(np.array([1e5, pressure]), 0.1)
