"""Gauges of supplies and of inlets of lines have zeros in the baseline, as those of chambers do."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import blocks_with_tanks
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import replay
from tests.diagnosis.asked import blocks_of, diagnosed, names_value
from tests.diagnosis.noisy import GAUGES, driven
from tests.tables import text_of

NOISE = {"supply_pressure": 400.0, "line_pressure": 400.0, "muscle_pressure": 400.0}
REGULATED, FED = (text_of(__file__, name) for name in ("gauged_regulator", "fed"))


def recorded(rig: Rig, role: str, seed: int) -> Recording:
    """Six seconds at 200 Hz of steps, of the set pressure or of the valve."""
    rng = np.random.default_rng(seed)
    levels = np.concatenate([[0.0], rng.uniform(0.0, 1.0, 19)]).repeat(60)
    if rig.tables("valve"):
        drive = {"valve_command": 5.0 + 4.0 * (2.0 * levels - 1.0)}
    else:
        drive = {"supply_command": 0.5e5 + 5.5e5 * levels}
    noise = GAUGES if "supply_command" in drive else NOISE
    return driven(rig, f"r{seed}", role, 0.005, drive, noise, [3, seed])


def with_zeros(text: str, zeros: dict[str, float]) -> pamrs.Diagnosis:
    """The diagnosis of a rig whose gauges have zeros that its file does not know."""
    nominal = parse_rig(text)
    true = nominal.with_parameters(zeros)
    return diagnosed(nominal, partial(recorded, true), ("fit", "held_out"))


def test_left_out_they_are_known_as_well_as_those_of_the_chambers() -> None:
    rig = parse_rig(FED)
    for name in ("supply.pressure_zero", "line.pressure_zero", "sensors.pressure_zero"):
        parameter = rig.parameter(name)
        assert (parameter.value, parameter.tol) == (0.0, 1000.0)
    told = 'pressure_zero = { value = 2, unit = "kPa" }\n[valve]'
    exact = parse_rig(FED.replace("[valve]", told))
    assert (exact.parameter("supply.pressure_zero").value, exact.parameters) == (
        2000.0,
        {**rig.parameters, "supply.pressure_zero": exact.parameter("supply.pressure_zero")},
    )
    assert exact.parameter("supply.pressure_zero").tol == 0.0
    through = FED.replace("[line]", '[line]\nfrom = "supply"').replace(
        'inlet_volume = { value = 5, unit = "ml", tol = 1 }', ""
    )
    through = through[: through.index("[valve]")] + through[through.index("[line]") :]
    assert parse_rig(through).parameter("line.pressure_zero").tol == 0.0
    needless = through.replace(
        "[chamber]", 'pressure_zero = { value = 1, unit = "kPa" }\n[chamber]'
    )
    with pytest.raises(pamrs.RigError, match="only an inlet that valves feed has a gauge"):
        parse_rig(needless)


def test_a_block_has_the_zeros_of_what_is_read_around_it() -> None:
    rig = parse_rig(FED)
    every = ("valve_command", "supply_pressure", "line_pressure", "muscle_pressure")

    def zeros(channels: tuple[str, ...]) -> dict[str, set[str]]:
        blocks = blocks_of(rig, channels)
        return {
            name: {n for n in b.parameters if n.endswith("pressure_zero")}
            for name, b in blocks.items()
        }

    supply, line, chamber = "supply.pressure_zero", "line.pressure_zero", "sensors.pressure_zero"
    assert zeros(every) == {
        "supply": {supply, line},
        "line": {supply, line, chamber},
        "chamber": {supply, chamber},
    }
    without = tuple(name for name in every if name != "line_pressure")
    assert zeros(without)["supply"] == {supply, chamber}
    # the level of a tank that is simulated is free as it is
    lone = tuple(name for name in without if name != "supply_pressure")
    (block,) = blocks_with_tanks(rig, lone)
    assert (block.floating, supply in block.parameters) == (("supply_pressure",), False)


def test_a_replay_begins_at_what_the_gauges_read() -> None:
    rig = parse_rig(FED).with_parameters({"supply.pressure_zero": 9e3, "line.pressure_zero": -5e3})
    record = recorded(rig, "fit", 0)
    run = replay(rig, record)
    for name in ("supply_pressure", "line_pressure", "muscle_pressure"):
        assert np.sqrt(np.mean((run[name] - record.channels[name]) ** 2)) < 3.0 * NOISE[name]


@pytest.mark.parametrize(
    ("text", "zeros"),
    [
        (REGULATED, {"supply.pressure_zero": 1500.0}),
        pytest.param(
            FED,
            {"supply.pressure_zero": 1500.0, "line.pressure_zero": -1500.0},
            marks=pytest.mark.slow,
        ),
    ],
    ids=["regulator", "tank_and_line"],
)
def test_a_bias_of_a_gauge_is_no_missing_physics(text: str, zeros: dict[str, float]) -> None:
    found = with_zeros(text, zeros)
    assert found.verdict in ("none", "parameters"), found.summary()
    assert not found.effects
    assert found.probabilities.get("unlisted", 0.0) < 0.2


def test_a_bias_beyond_its_tolerance_is_a_value_of_the_file_that_is_wrong() -> None:
    found = with_zeros(REGULATED, {"supply.pressure_zero": 9000.0})
    names_value(found, "supply.pressure_zero", 9000.0, 0.07)
