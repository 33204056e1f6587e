"""The three geometries against the independent reference, their limits, and the reference against
closed forms.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import pamrs
from tests.property.strategies import GEOMETRIES, both, muscle_arguments, reference_of, stroke
from tests.reference import GeometryReference, MuscleReference, Shape

FEW = settings(max_examples=10, deadline=None, derandomize=True)
MORE = settings(max_examples=25, deadline=None, derandomize=True)


def solved(muscle: pamrs.Muscle, e: float) -> Shape:
    """Shape of a muscle of pamrs in the words of the reference."""
    length = muscle.parameters["rest_length"] * (1.0 - e)
    values = (muscle.radius(e), muscle.thickness(e), muscle.air_volume(e))
    return Shape(length, *(float(v) for v in values), bool(muscle.braid_taut(e)))


def tube_volume(shape: Shape, geometry: GeometryReference, e: float, inset: float) -> float:
    """Volume of the body whose surface lies `inset` below the outer profile of a shape, by
    quadrature, m^3.
    """
    end = 0.0 if geometry.kind == "cylinder" else geometry.end_ellipse(e, shape.radius)[3]
    ends, _ = quad(
        lambda z: (geometry.profile(z, e, shape.radius) - inset) ** 2,
        0.0,
        end,
        epsabs=0.0,
        epsrel=1e-12,
    )
    return math.pi * (2.0 * ends + (shape.length - 2.0 * end) * (shape.radius - inset) ** 2)


@pytest.mark.parametrize("kind", GEOMETRIES)
@FEW
@given(data=st.data())
def test_shape_equals_the_reference(kind: str, data: st.DataObject) -> None:
    muscle, reference = both(data.draw(muscle_arguments(kind)))
    geometry, e = reference.geometry, stroke(reference)
    shapes = [geometry.solve(float(x)) for x in e]
    # Where no radius fits the printed minimum is flat: it fixes the radius to about half the
    # digits.
    flat = np.zeros(e.size, dtype=bool)
    if kind == "elliptic_published":
        flat = np.array(
            [not geometry.fits(float(x), shape.radius) for x, shape in zip(e, shapes, strict=True)]
        )
    for rtol, rows in ((1e-9, ~flat), (1e-6, flat)):
        for name in ("radius", "thickness", "air_volume"):
            want = np.array([getattr(shape, name) for shape in shapes])
            np.testing.assert_allclose(
                getattr(muscle, name)(e)[rows], want[rows], rtol=rtol, err_msg=name
            )
        hoop = np.array([reference.strains(shape)[1] for shape in shapes])
        np.testing.assert_allclose(
            muscle.circumferential_strain(e)[rows], hoop[rows], rtol=rtol, atol=10.0 * rtol
        )
    np.testing.assert_array_equal(muscle.braid_taut(e), [shape.braid_taut for shape in shapes])
    assert muscle.fibre_length == pytest.approx(geometry.fibre_length, rel=1e-13)
    assert muscle.turns == pytest.approx(geometry.turns, rel=1e-13)
    assert muscle.bladder_volume == pytest.approx(geometry.rubber_volume, rel=1e-13)
    limits = (geometry.min_contraction, geometry.max_contraction)
    assert muscle.contraction_limits == pytest.approx(limits, rel=0.0, abs=1e-13)


@pytest.mark.parametrize("kind", GEOMETRIES)
@FEW
@given(data=st.data())
def test_rubber_and_air_fill_the_profile(kind: str, data: st.DataObject) -> None:
    """The wall keeps the volume of the rubber, and the air is what lies inside it."""
    arguments = data.draw(muscle_arguments(kind))
    muscle, geometry = pamrs.Muscle(**arguments), reference_of(arguments).geometry
    for e in stroke(reference_of(arguments)):
        shape = solved(muscle, float(e))
        inside = tube_volume(shape, geometry, float(e), shape.thickness)
        assert inside == pytest.approx(shape.air_volume, rel=1e-10)
        outside = tube_volume(shape, geometry, float(e), 0.0)
        assert outside - inside == pytest.approx(
            geometry.rubber_volume, rel=1e-10, abs=1e-13 * outside
        )


@FEW
@given(muscle_arguments("elliptic"))
def test_solved_radius_fits_the_fibre(arguments: dict[str, Any]) -> None:
    muscle, geometry = pamrs.Muscle(**arguments), reference_of(arguments).geometry
    for e in stroke(reference_of(arguments)):
        estimate = geometry.fibre_estimate(float(e), float(muscle.radius(e)))
        if bool(muscle.braid_taut(e)):
            assert e < 0.0
            assert float(muscle.radius(e)) == pytest.approx(
                geometry.radius_floor(float(e)), rel=1e-12
            )
            assert estimate > geometry.fibre_length
        else:
            assert estimate == pytest.approx(geometry.fibre_length, rel=1e-12)


#: A muscle whose least miss is at the floor itself: a search that stops just short of it must still
#: say taut.
AT_THE_FLOOR = {
    "rest_length": 0.1,
    "rest_diameter": 0.004,
    "braid_angle": math.radians(72.0),
    "wall_thickness": 0.0005,
    "modulus_slope": [0.0],
    "modulus_offset": [0.0],
    "geometry": "elliptic_published",
}


@FEW
@given(muscle_arguments("elliptic_published"))
@example(AT_THE_FLOOR)
def test_published_radius_misses_the_fibre_least(arguments: dict[str, Any]) -> None:
    muscle, geometry = pamrs.Muscle(**arguments), reference_of(arguments).geometry
    for e in stroke(reference_of(arguments))[[0, 1, 2, 4, 5, 6, 7]]:
        radius = float(muscle.radius(e))
        last = geometry.rest_radius + 1.6 * (geometry.cylinder_radius(e) - geometry.rest_radius)
        low, high = sorted(
            (geometry.rest_radius, geometry.radius_floor(float(e)) if e < 0.0 else last)
        )
        assert low * (1.0 - 1e-12) <= radius <= high * (1.0 + 1e-12)
        misses = [
            abs(geometry.fibre_estimate(float(e), x) - geometry.fibre_length)
            for x in np.linspace(low, high, 60)
        ]
        own = abs(geometry.fibre_estimate(float(e), radius) - geometry.fibre_length)
        assert own <= min(misses) + 1e-12 * geometry.fibre_length
        assert bool(muscle.braid_taut(e)) == (e < 0.0 and radius < low * (1.0 + 1e-9))


@MORE
@given(muscle_arguments("elliptic"), st.floats(0.01, 0.2), st.floats(0.3, 0.33))
def test_published_radius_crosses_the_solved_one_at_the_sphere(
    arguments: dict[str, Any], tall: float, flat: float
) -> None:
    """Polar and parametric angle agree at rest and on a spherical end (k = 1); a tall end is
    followed too far.
    """
    muscle = pamrs.Muscle(**arguments)
    published = muscle.replace(geometry="elliptic_published")
    for same in (0.0, (1.64 - 1.0) / 2.405):
        assert float(published.radius(same)) == pytest.approx(float(muscle.radius(same)), rel=1e-10)
    assert float(published.radius(tall)) < float(muscle.radius(tall)) * (1.0 - 1e-5)
    assert float(published.radius(flat)) > float(muscle.radius(flat)) * (1.0 + 1e-5)


@MORE
@given(muscle_arguments("cylinder"), st.floats(0.0, 1.0))
def test_cylinder_in_extension_stops_at_its_floor(arguments: dict[str, Any], share: float) -> None:
    """The radius of the braid's cylinder, but never less than the bladder or 0.8 of the resting
    radius.
    """
    muscle = pamrs.Muscle(**arguments)
    low, _ = muscle.contraction_limits
    e = share * low * (1.0 - 1e-9)
    length, rest = arguments["rest_length"] * (1.0 - e), 0.5 * arguments["rest_diameter"]
    free = math.sqrt(muscle.fibre_length**2 - length**2) / (2.0 * math.pi * muscle.turns)
    floor = max(math.sqrt(muscle.bladder_volume / (math.pi * length)), 0.8 * rest)
    assert float(muscle.radius(e)) == pytest.approx(max(free, floor), rel=1e-10)
    if abs(free - floor) > 1e-9 * rest:
        assert bool(muscle.braid_taut(e)) == (free < floor)
    assert not bool(muscle.braid_taut(0.2))


@pytest.mark.parametrize("kind", GEOMETRIES)
def test_a_thick_bladder_fills_the_braid(kind: str) -> None:
    """With a wall of half the radius the bladder, not the measured 0.8 R0, sets the floor."""
    arguments = {
        "rest_length": 0.3,
        "rest_diameter": 0.02,
        "braid_angle": 1.25,
        "wall_thickness": 0.005,
        "geometry": kind,
    }
    muscle = pamrs.Muscle(**arguments, modulus_slope=[0.0], modulus_offset=[1e6])
    geometry = reference_of(arguments).geometry
    e = 0.9 * geometry.min_contraction
    assert geometry.radius_floor(e) > 0.8 * geometry.rest_radius
    assert float(muscle.radius(e)) == pytest.approx(geometry.solve(e).radius, rel=1e-9)
    # A full cylinder has no bore: its thickness is a difference under a root, good to half the
    # digits.
    assert float(muscle.thickness(e)) == pytest.approx(geometry.solve(e).thickness, rel=1e-6)
    assert np.isfinite(float(muscle.force(2e5, e)))


@MORE
@given(muscle_arguments("elliptic"), st.floats(0.05, 0.3))
def test_slender_muscle_is_a_cylinder(arguments: dict[str, Any], e: float) -> None:
    """The ends take a share of the length that falls as D/L, and so does what they change."""
    gaps = []
    short = min(arguments["rest_length"], 0.3)  # a muscle is at most 10 m long
    for stretch in (2.0, 8.0, 32.0):
        muscle = pamrs.Muscle(**{**arguments, "rest_length": stretch * short})
        cylinder = muscle.replace(geometry="cylinder")
        gaps.append(
            [
                abs(float(muscle.radius(e) / cylinder.radius(e)) - 1.0),
                abs(float(muscle.air_volume(e) / cylinder.air_volume(e)) - 1.0),
            ]
        )
    gaps = np.array(gaps)
    assert np.all(gaps[2] < 0.02)
    np.testing.assert_allclose(gaps[1] / gaps[2], 4.0, rtol=0.1)


# --- The reference against closed forms (pamrs plays no part)


@MORE
@given(muscle_arguments(), st.sampled_from(GEOMETRIES))
def test_reference_gas_areas_are_the_closed_forms(arguments: dict[str, Any], kind: str) -> None:
    reference = reference_of({**arguments, "geometry": kind})
    geometry, wall = reference.geometry, arguments["wall_thickness"]
    for e in stroke(reference):
        shape = geometry.solve(float(e))
        length, radius, turns = shape.length, shape.radius, geometry.turns
        gaylord = (3.0 * length**2 - geometry.fibre_length**2) / (4.0 * math.pi * turns**2)
        thick = (
            2.0 * math.pi * radius * wall
            - math.pi * wall**2
            - length**2 * wall / (2.0 * math.pi * turns**2 * radius)
        )
        scale = length**2 / turns**2
        got = replace(reference, model="gaylord").gas_area(float(e))
        assert got == pytest.approx(gaylord, rel=0.0, abs=1e-13 * scale)
        got = replace(reference, model="chou_hannaford").gas_area(float(e))
        assert got == pytest.approx(gaylord + thick, rel=0.0, abs=1e-13 * scale)


@MORE
@given(muscle_arguments(), st.sampled_from(GEOMETRIES))
def test_reference_rubber_follows_principal_stresses(arguments: dict[str, Any], kind: str) -> None:
    """dW/dL = s1 / L - s2 L / (2 pi N R)^2 with the plane stresses s_i = 2 (l_i^2 - l_3^2) (C10 +
    C01 l_j^2).
    """
    reference: MuscleReference = replace(
        reference_of({**arguments, "geometry": kind}), model="mooney_rivlin"
    )
    geometry = reference.geometry
    for e in stroke(reference):
        shape = geometry.solve(float(e))
        one, two = shape.length / geometry.rest_length, shape.radius / geometry.rest_radius
        thin = 1.0 / (one * two) ** 2
        for column, (c10, c01) in enumerate(((1.0, 0.0), (0.0, 1.0))):
            axial = 2.0 * (one**2 - thin) * (c10 + c01 * two**2)
            hoop = 2.0 * (two**2 - thin) * (c10 + c01 * one**2)
            turn = shape.length / (2.0 * math.pi * geometry.turns * shape.radius) ** 2
            want = geometry.rubber_volume * (axial / shape.length - hoop * turn)
            scale = (
                geometry.rubber_volume
                / shape.length
                * (1.0 + abs(axial) + abs(hoop) * turn * shape.length)
            )
            assert reference.elastic_basis(float(e))[column] == pytest.approx(
                want, rel=0.0, abs=1e-13 * scale
            )
