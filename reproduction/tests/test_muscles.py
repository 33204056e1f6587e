"""What is published about the muscles of the library, and the numbers identified from it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamrs.library as library
from pamrs.design.sizing import free_contraction
from pamrs.errors import ParameterError
from reproduction.comparison import verdicts
from reproduction.identify import derive, gent_modulus, least_norm
from reproduction.muscles import facts
from reproduction.muscles.evaluate import KINDS, activation_pressure
from reproduction.muscles.published import compare
from reproduction.six_against_two import compare_design, elbow_requirement
from tests.reference.geometry import GeometryReference

INCH, POUND_FORCE, PSI = 0.0254, 4.4482216152605, 6894.757293168361
#: Verdicts that the library is known for; a change of model or data that flips one must be noticed.
DIFFERS = {
    ("elbow_0625in", "blocked force at 150 psi"),
    ("elbow_0625in", "blocked force at 150 psi, thin wall (3.19)"),
    ("elbow_0625in", "braid angle for 820 lbf"),
    ("elbow_0625in", "maximum diameter, at 63 % of the length"),
    ("elbow_0625in", "braid angle for 1.75 in, cylinder"),
    ("elbow_0625in", "specific blocked force at 150 psi"),
    ("elbow_0625in", "activation pressure (1 % free contraction)"),
    ("large_2in", "blocked force at 90 psi"),
    ("large_2in", "braid angle for 4280 lbf"),
    ("large_2in", "braid angle for 4.5 in, cylinder"),
    ("large_2in", "maximum diameter, at 61 % of the length"),
    ("large_2in_effective", "maximum diameter, at 61 % of the length"),
    ("ch2_075in", "deadband of the blocked force"),
    ("pam_a_1in", "uniaxial stress at 200 %, departure from a line"),
    ("pam_a_1in", "activation pressure (1 % free contraction)"),
    ("pam_b_075in", "one at 8 bar less two at 4 bar, e = 0.05"),
    ("pam_b_075in", "loss of B / loss of A, 2 bar, e = 0.10"),
    ("pam_b_075in", "activation pressure (1 % free contraction)"),
}


@pytest.fixture(scope="module")
def rows():
    return [row for name in library.names() for row in compare(name)]


@pytest.mark.parametrize("name", library.names())
def test_stored_numbers_are_the_derived_ones(name):
    item, again = library.entry(name), derive(library.entry(name))
    for key, value in again.parameters.items():  # six digits are stored
        atol = 6e-6 * np.max(np.abs(value))
        np.testing.assert_allclose(item.parameters[key], value, rtol=0.0, atol=atol)
    assert again.rank == len(again.conditions) < again.unknowns


def test_facts_fitted_are_met(rows):
    used = [row for row in rows if row.basis == "construction"]
    assert len(used) >= 7
    assert [row.fact for row in used if row.verdict != "agree"] == []


def test_verdicts(rows):
    assert {(row.group, row.fact) for row in rows if row.verdict == "differs"} == DIFFERS
    assert verdicts(rows) == (
        "15 agree on their own, 8 by construction, 0 in sign only, 18 differ, 6 cannot tell"
    )


@pytest.mark.parametrize(
    ("name", "psi", "force"),
    [
        ("elbow_0625in", 150.0, 820.0),
        ("large_2in", 90.0, 4280.0),
        ("large_2in_effective", 90.0, 4280.0),
    ],
)
def test_blocked_force_row_against_reference_geometry(name, psi, force, rows):
    item = library.entry(name)
    keys = ("rest_length", "rest_diameter", "braid_angle", "wall_thickness")
    of = GeometryReference(*(item.parameters[key] for key in keys))
    # at rest: pressure on the Gaylord area, plus the wall's two terms
    braid = (3.0 * of.rest_length**2 - of.fibre_length**2) / (4.0 * math.pi * of.turns**2)
    rubber = of.rubber_volume / of.rest_length
    wall = of.wall_thickness * of.rest_length**2
    area = braid + rubber - wall / (2.0 * math.pi * of.rest_radius * of.turns**2)
    row = next(r for r in rows if r.group == name and r.fact.startswith("blocked force at"))
    assert row.published == pytest.approx(force)
    assert row.ours == pytest.approx(area * psi * PSI / POUND_FORCE, rel=1e-9)


def test_published_geometry_cannot_give_the_large_force_and_the_angle_that_can(rows):
    by_fact = {row.fact: row for row in rows if row.group == "large_2in"}
    assert by_fact["blocked force at 90 psi"].relative == pytest.approx(1.508, abs=0.01)
    angle = by_fact["braid angle for 4280 lbf"].ours
    muscle = library.large_2in().replace(braid_angle=math.radians(angle))
    assert float(muscle.force(90 * PSI, 0.0)) == pytest.approx(4280 * POUND_FORCE, rel=1e-9)
    tan = math.tan(math.radians(by_fact["braid angle for 4.5 in, cylinder"].ours))
    assert 2.0 * tan * math.sqrt(1.0 + tan**-2 - 0.61**2) == pytest.approx(4.5, rel=1e-9)


def test_free_contraction_grows_with_pressure_and_activation_inverts_it():
    muscle = library.ch2_075in()
    free = [free_contraction(muscle, p) for p in (0.5e5, 0.7e5, 2e5, 8e5)]
    assert np.all(np.diff(free) > 0.0)
    for e in (0.005, 0.01, 0.05):
        found = free_contraction(muscle, activation_pressure(muscle, e))
        assert found == pytest.approx(e, rel=1e-6)


def test_gent_relation():
    assert gent_modulus(35.0) == pytest.approx(1.395e6, rel=1e-3)
    assert gent_modulus(25.0) < gent_modulus(35.0) < gent_modulus(60.0)
    with pytest.raises(ParameterError, match="shore_a"):
        gent_modulus(float("nan"))


def test_least_norm_moves_only_along_the_facts():
    prior, spread = np.array([1.0, 1.0, 5.0]), np.array([1.0, 0.5, 3.0])
    x, rank = least_norm(np.array([[1.0, 2.0, 0.0]]), np.array([5.0]), prior, spread)
    np.testing.assert_allclose(x, [2.0, 1.5, 5.0], rtol=1e-12)
    assert rank == 1


def test_design_comparison():
    effective = {row.fact: row for row in compare_design("large_2in_effective")}
    assert [fact for fact, row in effective.items() if row.verdict == "differs"] == [
        "muscles needed for 200 ft lbf, elbow_0625in"
    ]
    # with the published blocked force six would do
    assert math.ceil(6.145 * 711.2 / 820.0) == 6
    assert effective["mass, six / two"].ours == pytest.approx(6 * 0.17 / (2 * 2.2), rel=1e-12)


def test_elbow_requirement_does_the_work_of_the_torque():
    points = elbow_requirement(100.0, points=2001).array
    work = float(np.sum(0.5 * (points[1:, 1] + points[:-1, 1]) * np.diff(points[:, 0])))
    lean, reach = math.atan2(0.42, 1.56), math.hypot(1.56, 0.42)
    start = math.pi - 2.0 * lean - 2.0 * math.asin(0.5 * 3.04 / reach)
    assert math.degrees(start) == pytest.approx(9.47, abs=0.01)
    assert work == pytest.approx(100.0 * (math.radians(78.0) - start), rel=1e-5)


def test_every_kind_of_fact_is_used():
    used = {fact.kind for name in library.names() for fact in facts(name)}
    assert used == set(KINDS)
