"""Quantities of pint at the border: converted to SI where a number with a unit is taken."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pint
import pytest

import pamrs
from pamrs._checks import ARGUMENTS
from pamrs.control import PID, closed_loop, trajectories
from pamrs.errors import ParameterError
from pamrs.fit import ForceMap
from pamrs.units import same_dimension

U = pint.UnitRegistry()
SHOULDER = pamrs.rigs.shoulder()
MUSCLE = SHOULDER.muscle
assert MUSCLE is not None
JOINT = pamrs.Joint(kind="pulley", radius=0.03)
LOOP = PID(1.4, 0.5, period=0.005)


LEAK = "ml/s/bar"


def _stepped(sample: Any, command: Any) -> float:
    plant = pamrs.Simulator(SHOULDER, sample_time=sample, initial={"joint_angle": 20 * U.deg})
    return plant.step(command)["joint_angle"]


def _batch(sample: Any, command: Any) -> Any:
    return pamrs.Batch(SHOULDER, n=2, sample_time=sample).step(command)["muscle_pressure"]


def _map(pressure: Any, length: Any) -> Any:
    grid = np.array([0.20, 0.19, 0.18, 0.20, 0.19, 0.18])
    given = np.repeat([2e5, 4e5], 3)
    unit = pressure.units if hasattr(pressure, "units") else None
    lengths = grid if unit is None else U.Quantity(1e3 * grid, "mm")
    pressures = given if unit is None else U.Quantity(1e-5 * given, "bar")
    return ForceMap.from_arrays(
        length=lengths, pressure=pressures, force=1e-3 * given, rest_length=length
    ).contraction


CASES: dict[str, tuple[Callable[..., Any], tuple[Any, ...], tuple[Any, ...]]] = {
    "force": (MUSCLE.force, (4 * U.bar, 10 * U.percent), (4e5, 0.1)),
    "radius": (MUSCLE.radius, (10 * U.percent,), (0.1,)),
    "shortening": (JOINT.shortening, (U.Quantity([30.0, 40.0], "deg"),), (np.radians([30, 40]),)),
    "muscle": (
        lambda length: MUSCLE.replace(rest_length=length).force(4e5, 0.1),
        (150 * U.mm,),
        (0.15,),
    ),
    "parameters": (
        lambda mass: SHOULDER.with_parameters({"arm.payload": mass}).parameter("arm.payload").value,
        (900 * U.g,),
        (0.9,),
    ),
    "simulate": (
        lambda t, p: pamrs.simulate(
            SHOULDER, 5.0, sample_time=5e-3, duration=t, initial={"muscle_pressure": p}
        )["muscle_pressure"],
        (300 * U.ms, 1 * U.bar),
        (0.3, 1e5),
    ),
    "simulator": (_stepped, (5 * U.ms, 6000 * U.mV), (0.005, 6.0)),
    "batch": (_batch, (5 * U.ms, U.Quantity([5500.0, 6000.0], "mV")), (0.005, [5.5, 6.0])),
    "map": (_map, (1 * U.bar, 200 * U.mm), (1e5, 0.2)),
    "volts": (
        lambda u: pamrs.simulate(SHOULDER, u, sample_time=0.05)["joint_angle"],
        ([5500 * U.mV, 5.6 * U.V, 5.7 * U.V],),
        ([5.5, 5.6, 5.7],),
    ),
    "plants": (
        lambda mass: pamrs.simulate_batch(
            SHOULDER,
            5.5,
            sample_time=5e-3,
            duration=0.1,
            parameters={"arm.payload": mass},
            reduce={"end": ("final", "joint_angle")},
        ).reduced["end"],
        (U.Quantity([500.0, 900.0], "g"),),
        ([0.5, 0.9],),
    ),
    "moduli": (
        lambda offset: pamrs.Muscle(
            rest_length=0.2,
            rest_diameter=0.02,
            braid_angle=1.2,
            wall_thickness=1e-3,
            modulus_slope=[1.0],
            modulus_offset=offset,
        ).force(4e5, 0.1),
        ([500 * U.kPa],),
        ([5e5],),
    ),
    "effect": (
        lambda q: SHOULDER.with_effect("leak_muscle", {"conductance": q}).effects[0]["parameters"][
            "conductance"
        ],
        (U.Quantity(1.0, LEAK),),
        (1.0 * U.Quantity(1.0, LEAK).to_base_units().magnitude,),
    ),
    "trajectory": (
        lambda low, high: trajectories.cosine_cycles(low, high)(3.0).angle,
        (15 * U.deg, 50 * U.deg),
        (np.radians(15.0), np.radians(50.0)),
    ),
    "closed loop": (
        lambda to, t: closed_loop(SHOULDER, LOOP, trajectories.step(0.3, to), t).angle,
        (40 * U.deg, 200 * U.ms),
        (np.radians(40.0), 0.2),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_quantity_is_what_it_is_in_si(name: str) -> None:
    function, given, plain = CASES[name]
    assert np.allclose(function(*given), function(*plain), rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: MUSCLE.force(4 * U.m, 0.1), "pressure = .* a quantity in Pa"),
        (lambda: MUSCLE.force(4e5, 2 * U.cm), "contraction = .* a quantity in 1"),
        (lambda: JOINT.shortening(3 * U.m), "angle = .* a quantity in rad"),
        (
            lambda: pamrs.simulate(
                SHOULDER, 5.0, sample_time=5e-3, duration=1, initial={"joint_angle": 1 * U.m}
            ),
            "initial joint_angle = .* a quantity in rad",
        ),
        (lambda: SHOULDER.with_parameters({"arm.payload": 3 * U.m}), "arm.payload = .* in kg"),
        (lambda: pamrs.simulate(SHOULDER, 5.0, sample_time=3 * U.m, duration=1), "sample_time = "),
        (
            lambda: pamrs.sweep(
                SHOULDER,
                {"arm.payload": U.Quantity([1.0, 2.0], "kg")},
                {"end": ("final", "joint_angle")},
                sample_time=5e-3,
            ),
            "arm.payload = .* plain numbers are needed here, in SI units",
        ),
        (
            lambda: pamrs.Simulator(SHOULDER, sample_time=0.01).restore([1 * U.m] * 9),
            "state = .* plain numbers are needed here",
        ),
    ],
)
def test_a_quantity_of_another_dimension_is_named(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        call()


def _public() -> list[tuple[str, Any, Any]]:
    found = []
    owners = [pamrs.fit, pamrs.control, trajectories, pamrs.sweeps]
    for owner in [pamrs, *owners]:
        for name in owner.__all__:
            thing = getattr(owner, name)
            inside = vars(thing).items() if inspect.isclass(thing) else [(name, thing)]
            found += [
                (f"{name}.{own}", getattr(function, "__func__", function), thing)
                for own, function in inside
                if inspect.isfunction(getattr(function, "__func__", function))
            ]
    return [(n, f, own) for n, f, own in found if getattr(f, "quantities", 0) and "._" not in n]


@pytest.mark.parametrize(("name", "function", "owner"), _public())
def test_units_are_those_of_the_docstring(name: str, function: Any, owner: Any) -> None:
    text = inspect.getdoc(owner if name.endswith("__init__") else function) or ""
    part = text.partition("Parameters\n")[2].partition("\nReturns\n")[0].partition("\nRaises\n")[0]
    told = re.findall(r"^([\w, ]+)(?: : .*)?\n((?:    .*\n?)+)", part, re.MULTILINE)
    assert told
    for names, about in told:
        units = re.findall(r"\[([^\],]+)[^\]]*\]", about)
        for argument in names.split(", "):
            if argument in ARGUMENTS and units:
                unit = ARGUMENTS[argument]
                assert any(unit == own or same_dimension(unit, own) for own in units), argument
