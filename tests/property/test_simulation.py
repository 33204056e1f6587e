"""Trajectories of pamrs against the independent reference, and laws they must keep."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import pamrs
from tests.property.strategies import commands, rig_overrides
from tests.reference import shoulder
from tests.runs import Run
from tests.tables import rows_of

AMBIENT = 101325.0
ROWS = 31
SAMPLE_TIME = 0.005
MUSCLE = pamrs.Muscle.from_model(pamrs.rigs.shoulder().model["muscle"])
CHANNELS = {"muscle_pressure": 1e5, "supply_pressure": 1e5, "joint_angle": 1.0, "joint_rate": 1.0}
START = {"muscle_pressure": 1.5e5, "supply_pressure": 13.8e5, "joint_angle": 0.9, "joint_rate": 0.0}
FEW = settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def touches_stop(angle: np.ndarray) -> bool:
    """Whether a trajectory comes within 1 mrad of an end stop."""
    stops = shoulder().joint
    return bool(angle.min() < stops.min_angle + 1e-3 or angle.max() > stops.max_angle - 1e-3)


def driven(
    command: list[float], initial: dict[str, float], overrides: dict[str, float] | None = None
) -> Run:
    """A run of the shoulder whose muscles push like struts: with slack ones it hardly moves."""
    commands = {"valve_command": np.array(command)}
    rig, rows = pamrs.rigs.shoulder(), len(command)
    return Run(rig, SAMPLE_TIME, rows, initial, commands, overrides or {}).with_struts


# A failing example is not shrunk: the reference is too slow for the hundreds of runs that would
# take.
@settings(FEW, max_examples=6, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(
    rig_overrides(),
    commands(ROWS),
    st.floats(0.8e5, 3e5),
    st.floats(math.radians(35.0), math.radians(80.0)),
    st.floats(-0.5, 0.5),
)
def test_matches_reference(
    overrides: dict[str, float], command: list[float], pressure: float, angle: float, rate: float
) -> None:
    initial = {
        "muscle_pressure": pressure,
        "supply_pressure": 12e5,
        "joint_angle": angle,
        "joint_rate": rate,
    }
    run = driven(command, initial, overrides)
    got, want = run.core(1e-4), run.reference(1e-10)
    tolerance = 5e-3 if touches_stop(want["joint_angle"]) else 1e-6
    for name, scale in CHANNELS.items():
        scale = max(scale, float(np.ptp(want[name])))
        miss = float(np.max(np.abs(got[name] - want[name]))) / scale
        assert miss < tolerance, (name, miss)


@pytest.mark.parametrize(
    ("case", "command", "changes", "rows"),
    rows_of(__file__, "corners_match_reference"),
)
def test_corners_match_reference(
    case: str, command: float, changes: dict[str, float], rows: int
) -> None:
    initial = {**START, **changes}
    run = driven([command] * rows, initial)
    got, want = run.core(1e-5), run.reference(1e-10)
    if "stop" in case:
        assert touches_stop(want["joint_angle"])
    for name, scale in CHANNELS.items():
        miss = float(np.max(np.abs(got[name] - want[name]))) / scale
        assert miss < (1e-4 if "stop" in case else 1e-6), (case, name, miss)


@FEW
@given(rig_overrides(), commands(ROWS))
def test_the_future_of_a_command_cannot_change_the_past(
    overrides: dict[str, float], command: list[float]
) -> None:
    rig = pamrs.rigs.shoulder().with_parameters(overrides)
    run, changed = (
        pamrs.simulate(rig, valve_command=volts, sample_time=SAMPLE_TIME, step=1e-3, initial=START)
        for volts in (command, [*command[:20], *(9.0 - u / 2.0 for u in command[20:])])
    )
    for name in CHANNELS:
        np.testing.assert_array_equal(run[name][:21], changed[name][:21])
    assert abs(command[20] - 6.0) < 0.5 or not np.array_equal(
        run["muscle_pressure"], changed["muscle_pressure"]
    )


@FEW
@given(st.floats(5.1, 8.0), st.floats(1e5, 3e5))
def test_isothermal_filling_keeps_the_gas(u: float, pressure: float) -> None:
    """With every exponent 1 the products p V of tank and chamber add up to a constant while
    filling.
    """
    exponents = {"chamber.alpha_in": 1.0, "chamber.alpha_out": 1.0, "chamber.alpha": 1.0}
    rig = pamrs.rigs.shoulder().with_parameters(exponents)
    run = pamrs.simulate(
        rig,
        valve_command=[u] * 41,
        sample_time=SAMPLE_TIME,
        step=2e-4,
        initial={**START, "muscle_pressure": pressure},
    )
    plant = shoulder()
    d = np.array([plant.joint.contraction(a) for a in run["joint_angle"]])
    volume = 6 * MUSCLE.air_volume(d / 0.276) + plant.chamber.dead_volume
    tank = rig.parameter("supply.volume").value
    gas = (run["muscle_pressure"] + AMBIENT) * volume + (run["supply_pressure"] + AMBIENT) * tank
    moved = tank * np.ptp(run["supply_pressure"])
    assert float(np.ptp(gas)) < 1e-6 * moved + 1e-9 * gas[0]


@given(st.floats(0.0, 12e5))
@settings(max_examples=15, deadline=None)
def test_sealed_chamber_holds_its_pressure_exactly(pressure: float) -> None:
    run = pamrs.simulate(
        pamrs.rigs.sealed_chamber(),
        duration=10.0,
        sample_time=0.1,
        step=0.01,
        initial={"muscle_pressure": pressure},
    )
    values = run["muscle_pressure"]
    np.testing.assert_array_equal(values, np.full_like(values, values[0]))
    assert float(values[0]) == pytest.approx(pressure, rel=1e-15, abs=1e-9)
