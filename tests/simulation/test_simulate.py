"""The simulation call: rows, defaults, results and refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import pamrs
from tests.tables import rows_of

START = {"muscle_pressure": 1e5, "joint_angle": 0.52}
CHANNELS = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")


def run(command: Any = (5.5,) * 11, **changes: Any) -> Any:
    """Short shoulder run with some arguments changed."""
    arguments: dict[str, Any] = {"sample_time": 0.005, "step": 5e-4, "initial": START, **changes}
    rig = pamrs.rigs.shoulder().with_parameters(arguments.pop("parameters", {}))
    return pamrs.simulate(rig, valve_command=command, **arguments)


def test_first_row_is_the_initial_state() -> None:
    """Missing values have defaults."""
    for initial, wanted in (
        ({**START, "supply_pressure": 9e5, "joint_rate": 0.25}, (1e5, 9e5, 0.52, 0.25)),
        ({}, (0.0, 13.8e5, math.radians(15.0), 0.0)),
    ):
        result = run(initial=initial)
        first = [float(result[name][0]) for name in CHANNELS]
        assert first == pytest.approx(wanted, rel=1e-12, abs=1e-9)


def test_command_holds_until_the_next_row() -> None:
    steady = run([5.0] * 11)
    late = run([5.0] * 5 + [7.0] * 6)
    np.testing.assert_array_equal(late["muscle_pressure"][:6], steady["muscle_pressure"][:6])
    assert late["muscle_pressure"][6] > steady["muscle_pressure"][6] + 100.0
    # The last command has no row after it.
    last, even = (run([6.0] * 10 + [volts])["muscle_pressure"] for volts in (9.0, 6.0))
    np.testing.assert_array_equal(last, even)


def test_unknown_channel_names_the_known_ones() -> None:
    with pytest.raises(KeyError, match="joint_angle"):
        run()["no_such_channel"]


PARAMETERS = [
    ("arm.payload", -1.0),
    ("arm.inertia", math.nan),
    ("supply.volume", 0.0),
    ("chamber.dead_volume", -1e-4),
    ("valve.discharge_area_max", math.inf),
    ("arm.no_such_thing", 1.0),
]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        *rows_of(__file__, "bad_argument_is_refused_by_name"),
        *((name, {"parameters": {name: value}}) for name, value in PARAMETERS),
        ("valve_command", {"command": None, "duration": 0.1}),
        ("valve_command = 6 is one number: duration", {"command": 6.0}),
    ],
)
def test_bad_argument_is_refused_by_name(name: str, changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=name.replace(".", r"\.")) as caught:
        run(**changes)
    assert isinstance(caught.value, (pamrs.ParameterError, pamrs.RigError))


def test_a_command_beyond_its_valve_is_an_event_and_is_said() -> None:
    command = np.full(31, 6.0)
    command[5:10], command[20:] = 50.0, -3.0
    result = run(command)
    told = [(round(e.time, 6), e.kind) for e in result.events if e.kind.startswith("command")]
    clipped, inside = "command_clipped", "command_in_range"
    assert told == [(0.025, clipped), (0.05, inside), (0.1, clipped)]
    line = "valve: command clipped to its range of 0 to 10 V from 0.025 s to 0.05 s and once more; "
    assert line + "50 V was asked for" in result.summary().splitlines()
    assert [e.time for e in result.events] == sorted(e.time for e in result.events)
    # a recorded command scatters about the end of the range
    assert "clipped" not in run(np.full(31, 10.02)).summary()


def test_what_happens_often_is_counted() -> None:
    result = run(np.full(601, 10.0))
    count = sum(e.kind == "max_stop_reached" for e in result.events)
    assert count > 2
    assert f"and {count - 1} more times" in result.summary()
