"""Units: conversion, dimensions, and messages for what cannot be read."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamrs.errors import PamrsError, ParameterError
from pamrs.units import DIMENSIONS, from_si, measured_from, parse_unit, same_dimension, to_si
from tests.tables import rows_of

KNOWN = rows_of(__file__, "known")


@pytest.mark.parametrize(("value", "unit", "dimension", "expected"), KNOWN)
def test_known_conversions(value: float, unit: str, dimension: str, expected: float) -> None:
    assert to_si(value, unit, dimension) == pytest.approx(expected, rel=1e-14)


@given(st.floats(-1e6, 1e6), st.sampled_from([row[1:3] for row in KNOWN]))
def test_back_and_forth(value: float, pair: tuple[str, str]) -> None:
    unit, dimension = pair
    assert from_si(to_si(value, unit, dimension), unit, dimension) == pytest.approx(
        value, rel=1e-12, abs=1e-9
    )


def test_a_difference_of_temperatures_has_no_offset() -> None:
    assert to_si(3.0, "degC", "K", difference=True) == 3.0
    assert from_si(3.0, "degC", "K", difference=True) == 3.0


@pytest.mark.parametrize("unit", DIMENSIONS.values())
def test_si_units_stand_as_they_are(unit: str) -> None:
    assert parse_unit(unit).scale == 1.0
    assert parse_unit(unit).offset == 0.0


@pytest.mark.parametrize(
    ("unit", "dimension"),
    [
        ("V", "pressure"),
        ("bar", "angle"),
        ("1", "angle"),
        ("deg", "1"),
        ("kg m", "inertia"),
        ("s", "length"),
    ],
)
def test_wrong_dimension_names_both(unit: str, dimension: str) -> None:
    with pytest.raises(ParameterError) as caught:
        to_si(1.0, unit, dimension)
    assert repr(unit) in str(caught.value)
    assert repr(DIMENSIONS.get(dimension, dimension)) in str(caught.value)


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("Bar", "unknown unit 'Bar'; did you mean 'bar'"),
        ("bar " * 40, "too long"),
        ("  ", "empty"),
        *((unit, unit.split()[-1]) for unit in ("pascal", "m//s", "m/", "(m)", "2", "m3/(s")),
        *((unit, unit.split()[-1]) for unit in ("kg-m2", "[bar]", "bar bar bara")),
        # a number was read as a power of one, and a factor was lost without a word
        *((unit, "unknown unit") for unit in ("100 kPa", "10 bar", "bar*10", "bar/10", "kPa x 10")),
    ],
)
def test_what_is_no_unit_is_named(unit: str, said: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(said)):
        parse_unit(unit)


@pytest.mark.parametrize(
    ("unit", "alone"),
    [
        ("bar(a)", "bar"), ("bara", "bar"), ("bar_abs", "bar"), ("psia", "psi"),
        ("psi(a)", "psi"), ("kPa abs", "kPa"), ("kPa abs.", "kPa"), ("hPa(a)", "hPa"),
        ("ata", "at"), ("mmHg absolute", "mmHg"), ("kgf/cm2 (a)", "kgf/cm2"),
    ],
)  # fmt: skip
def test_absolute_pressures_are_told_from_gauge_pressures(unit: str, alone: str) -> None:
    assert measured_from(unit) == (alone, "absolute")
    assert measured_from(alone) == (alone, "")
    assert measured_from(f"{alone}(g)") == (alone, "gauge")
    with pytest.raises(ParameterError, match="gauge pressures here"):
        parse_unit(unit)


@pytest.mark.parametrize("unit", ["a", "m(a)", "V abs", "kg a", "bar(b)", "bar(a)(a)"])
def test_only_pressures_are_absolute(unit: str) -> None:
    assert measured_from(unit) == (unit, "")


@given(st.text(max_size=12))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        unit = parse_unit(text)
    except PamrsError:
        return
    assert math.isfinite(unit.scale)
    assert unit.scale > 0.0


def test_turns_in_a_second_are_no_angular_speed() -> None:
    """They differ by 2 pi, and nobody can tell which was meant."""
    for turns, angular in (("Hz", "rad/s"), ("kHz", "rpm"), ("Hz", "deg/s")):
        assert not same_dimension(turns, angular)
        assert not same_dimension(angular, turns)
    with pytest.raises(ParameterError, match="a unit like 'Hz' is needed"):
        to_si(20.0, "rad/s", "Hz")
    assert same_dimension("1/s", "Hz")
    assert same_dimension("1/s", "rad/s")


def test_the_angle_counts_only_alone() -> None:
    assert same_dimension("N m/rad", "N m")
    assert not same_dimension("rad", "1")
    assert not same_dimension("N m", "N")
