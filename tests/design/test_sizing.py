"""Muscle sizing: laws of the counts and figures, reasons for what is not feasible, bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamrs.library as library
from pamrs import Muscle
from pamrs.design import Filling
from pamrs.design.sizing import (
    Candidate,
    Requirement,
    SizingResult,
    free_contraction,
    packed_diameter,
    size,
)
from pamrs.errors import ParameterError
from tests.reference.gas import orifice_flow
from tests.simulation.refusals import refused

PAIR = ("elbow_0625in", "large_2in_effective")
ONE_POINT = Requirement([(0.0, 15e3)])


def test_count_is_the_smallest_that_meets_every_point():
    requirement = Requirement([(0.0, 9e3), (0.02, 8e3), (0.05, 4e3)])
    for row in size(PAIR, requirement).rows:
        item = library.entry(row["name"])
        one = item.muscle.force(
            item.max_pressure, requirement.contraction(item.parameters["rest_length"])
        )
        forces = requirement.array[:, 1]
        assert np.all(row["count"] * one >= forces * (1 - 1e-12))
        assert np.any((row["count"] - 1) * one < forces)
        assert row["force_margin"] == pytest.approx(float(np.min(row["count"] * one / forces)))
        assert row["margin_left"] < 1.0 <= row["force_margin"]


def test_count_never_falls_with_the_force_wanted():
    counts = [
        size(PAIR, Requirement([(0.0, f), (0.03, f / 2)])).rows for f in np.linspace(1e3, 60e3, 25)
    ]
    for k in range(2):
        assert np.all(np.diff([rows[k]["count"] for rows in counts]) >= 0)
    assert counts[-1][0]["count"] > counts[0][0]["count"]


def elbows(*points, **given):
    """The row of the elbow's muscle, at a pressure or in a number that is given."""
    candidate = Candidate.from_library("elbow_0625in", **given)
    return size([candidate], Requirement(points)).row("elbow_0625in")


def test_count_never_rises_with_pressure():
    points = (0.0, 9e3), (0.03, 4e3)
    counts = [elbows(*points, pressure=p)["count"] for p in np.linspace(5e5, 12e5, 8)]
    assert np.all(np.diff(counts) <= 0)


def test_figures_scale_with_the_count():
    one, six = (elbows((0.01, 1e3), count=n) for n in (1, 6))
    keys = (
        "mass", "air_volume_rest", "air_volume_end", "air_volume_full", "air_mass_per_stroke",
        "energy_per_stroke",
        "fill_time_rest", "fill_time_full", "blocked_force", "force_margin",
    )  # fmt: skip
    for key in keys:
        assert six[key] == pytest.approx(6 * one[key], rel=1e-12), key
    assert six["specific_force"] == pytest.approx(one["specific_force"], rel=1e-12)
    assert (one["share_left"], six["share_left"]) == (0.0, pytest.approx(5 / 6))


def test_air_volume_is_the_muscles_own():
    row, muscle = elbows((0.02, 1e3), count=3), library.elbow_0625in()
    end = 0.02 / muscle.parameters["rest_length"]
    for at, contraction in (("rest", 0.0), ("end", end), ("full", 0.37)):
        volume = 3 * float(muscle.air_volume(contraction))
        assert row[f"air_volume_{at}"] == pytest.approx(volume, rel=1e-4 if at == "full" else 1e-6)
    absolute = row["pressure"] + 101325.0
    assert row["energy_per_stroke"] == pytest.approx(
        absolute * row["air_volume_end"] - 101325.0 * row["air_volume_rest"]
    )
    assert row["air_mass_per_stroke"] == pytest.approx(row["energy_per_stroke"] / (287.05 * 293.15))


def test_contraction_requirement_equals_the_stroke_requirement():
    length = library.elbow_0625in().parameters["rest_length"]
    wanted = Requirement([(0.1, 5e3)], position="contraction")
    by_contraction = size(["elbow_0625in"], wanted).row("elbow_0625in")
    by_stroke = elbows((0.1 * length, 5e3))
    assert by_stroke.pop("name") == by_contraction.pop("name")
    assert by_stroke == pytest.approx(by_contraction, rel=1e-9)


@pytest.mark.parametrize(
    ("candidate", "requirement", "reason"),
    [
        ("elbow_0625in", Requirement([(0.09, 100.0)]), "beyond the braid's limit"),
        ("elbow_0625in", Requirement([(0.385, 100.0)], "contraction"), "no number is enough"),
        ("elbow_0625in", Requirement([(0.0, 1e7)]), "at most 100 are considered"),
        (Candidate.from_library("elbow_0625in", count=2), ONE_POINT, "5 are needed, 2 are given"),
        (
            Candidate.from_library("elbow_0625in", pressure=14e5),
            ONE_POINT,
            "not below the supply's",
        ),
        (Candidate.from_library("elbow_0625in", pressure=6.0), ONE_POINT, "were bar meant?"),
    ],
)
def test_infeasible_is_told_with_its_reason(candidate, requirement, reason):
    result = size([candidate], requirement)
    assert result.rows == []
    assert reason in result.infeasible["elbow_0625in"]
    assert set(result.best.values()) == {None}
    assert reason in result.table()
    with pytest.raises(ParameterError, match="has no row"):
        result.row("elbow_0625in")


def test_one_infeasible_does_not_hide_the_other():
    result = size(PAIR, Requirement([(0.1, 2e3)]))
    assert list(result.infeasible) == ["elbow_0625in"]
    assert [row["name"] for row in result.rows] == ["large_2in_effective"]
    assert set(result.best.values()) == {"large_2in_effective"}
    assert result.to_dict()["infeasible"] == result.infeasible


def test_best_by_criterion_and_unknown_mass():
    result = size([*PAIR, "ch2_075in"], ONE_POINT)
    assert result.best["count"] == "large_2in_effective"
    assert result.best["redundancy"] == max(result.rows, key=lambda row: row["share_left"])["name"]
    assert result.row("ch2_075in")["mass"] is None
    assert result.row("ch2_075in")["specific_force"] is None
    assert result.best["mass"] == "elbow_0625in"
    table = result.table()
    assert "nan" not in table
    assert " -" in table
    assert isinstance(result, SizingResult)


def test_packing():
    assert packed_diameter(1, 0.02) == pytest.approx(0.02)
    assert packed_diameter(2, 0.02) == pytest.approx(0.04)
    assert packed_diameter(6, 0.02) == pytest.approx(0.06)
    assert packed_diameter(6, 0.02, core=0.03) == pytest.approx(0.07)
    assert packed_diameter(1, 0.02, core=0.03) == pytest.approx(0.07)
    for count in range(2, 12):  # neighbours touch and do not overlap
        ring = 0.5 * (packed_diameter(count, 1.0) - 1.0)
        assert 2.0 * ring * math.sin(math.pi / count) == pytest.approx(1.0)


def test_fill_time_against_the_reference_orifice():
    filling = Filling(area=5e-6, supply_pressure=10e5)
    pressures = np.linspace(101325.0, 101325.0 + 9.9e5, 20001)
    flow = np.array(
        [orifice_flow(5e-6, 10e5 + 101325.0, float(p), 293.15, 287.05) for p in pressures]
    )
    slowness = 1.0 / flow
    area = float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(pressures)))
    assert filling.time(2e-3, 9.9e5) == pytest.approx(2e-3 / (287.05 * 293.15) * area, rel=1e-5)


def test_fill_time_laws():
    filling, double = Filling(), Filling().time(2e-3, 6e5)
    assert double == pytest.approx(2.0 * filling.time(1e-3, 6e5), rel=1e-12)
    assert double == pytest.approx(Filling(dead_volume=1e-3).time(1e-3, 6e5), rel=1e-12)
    assert filling.time(1e-3, 6e5) < filling.time(1e-3, 9e5) < filling.time(1e-3, 13.79e5)
    # choked: dp/dt is constant
    choked = filling.time(1e-3, 4e5) / filling.time(1e-3, 2e5)
    assert choked == pytest.approx(2.0, rel=1e-10)


def test_sonic_conductance_gives_the_choked_flow():
    conductance = 2e-8
    filling = Filling.from_sonic_conductance(conductance, supply_pressure=12e5)
    flow = conductance * 1.185 * (12e5 + 101325.0)  # kg/m3 of the standard's reference air
    assert orifice_flow(filling.area, 12e5 + 101325.0, 101325.0, 293.15, 287.05) == pytest.approx(
        flow, rel=1e-9
    )


def test_bad_input_is_named():
    refused(
        ("points has shape", lambda: Requirement([])),
        ("points has shape", lambda: Requirement([(0.0, 1.0, 2.0)])),
        ("finite", lambda: Requirement([(0.0, math.nan)])),
        ("none below zero", lambda: Requirement([(0.0, -1.0)])),
        ("increase", lambda: Requirement([(0.1, 1.0), (0.0, 1.0)])),
        ("no force is wanted", lambda: Requirement([(0.0, 0.0)])),
        ("position = 'angle'", lambda: Requirement([(0.0, 1.0)], position="angle")),
        ("pressure = -1", lambda: Candidate.from_library("elbow_0625in", pressure=-1.0)),
        ("count = 0", lambda: Candidate.from_library("elbow_0625in", count=0)),
        ("pressure = 'x' is not allowed", lambda: Candidate("x", library.elbow_0625in(), "x")),
        ("mass = inf", lambda: Candidate("x", library.elbow_0625in(), 1e5, mass=math.inf)),
        ("area = 0", lambda: Filling(area=0.0)),
        ("dead_volume", lambda: Filling(dead_volume=-1.0)),
        ("conductance = nan", lambda: Filling.from_sonic_conductance(math.nan)),
        ("not below the supply's", lambda: Filling().time(1e-3, 14e5)),
        ("volume = 0", lambda: Filling().time(0.0, 1e5)),
        ("count = 0", lambda: packed_diameter(0, 0.01)),
        ("count = nan", lambda: packed_diameter(math.nan, 0.01)),
        ("diameter = 0", lambda: packed_diameter(3, 0.0)),
        ("candidates is empty", lambda: size([], ONE_POINT)),
        ("used twice", lambda: size(["elbow_0625in", "elbow_0625in"], ONE_POINT)),
        ("not in the library", lambda: size(["elbow"], ONE_POINT)),
        ("core", lambda: size(["elbow_0625in"], ONE_POINT, core=-1.0)),
        ("max_count = 0", lambda: size(["elbow_0625in"], ONE_POINT, max_count=0)),
    )


def test_a_muscle_whose_geometry_has_no_solution_is_infeasible():
    wide = Muscle(
        rest_length=0.12, rest_diameter=0.05, braid_angle=math.radians(75.0), wall_thickness=0.002
    )
    result = size([Candidate("wide", wide, 5e5), "elbow_0625in"], Requirement([(0.0, 1e3)]))
    assert "at which the geometry has a solution" in result.infeasible["wide"]
    assert [row["name"] for row in result.rows] == ["elbow_0625in"]


@pytest.mark.parametrize("pressure", [1e5, 4e5, 8e5])
def test_free_contraction_is_a_zero_of_the_force(pressure):
    for name in library.names():
        muscle = library.entry(name).muscle
        e = free_contraction(muscle, pressure)
        if e < muscle.contraction_limits[1]:
            assert abs(float(muscle.force(pressure, e))) < 1e-6 * float(muscle.force(pressure, 0.0))
            assert np.all(muscle.force(pressure, np.linspace(0.0, 0.999 * e, 50)) > 0.0)


def test_a_free_contraction_wants_a_pressure():
    refused(("pressure = -1", lambda: free_contraction(library.pam_a_1in(), -1.0)))
