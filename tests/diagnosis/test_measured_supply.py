"""A supply of which nothing is known but its pressure, which was recorded; and a meter of what it
gives.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import implausible
from pamrs.errors import DiagnosisError, ParameterError, RecordingError
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import differences, replay
from tests.diagnosis.asked import SETTINGS, blocks_of, diagnosed, names_value
from tests.diagnosis.noisy import GAUGES, noisy, without
from tests.tables import text_of

RIG = parse_rig(text_of(__file__, "measured"))
DT = 0.005
#: [kg/s] noise of the meter
METER = 2e-5


def wall(seed: int) -> np.ndarray:
    """Pressure of a compressor's line that others draw from [Pa, gauge], eight seconds."""
    time = np.arange(0.0, 8.0, DT)
    return 2.5e5 + 1.2e5 * np.sin(1.3 * time + seed) + 0.5e5 * np.sin(4.1 * time)


def drawn(rig: pamrs.Rig, role: str, seed: int, *, metered: bool = False) -> Recording:
    """A chamber that such a line fills and empties; by finer steps than the log has."""
    fine = np.interp(np.arange(0.0, 8.0, DT / 5), DT * np.arange(1600), wall(seed))
    run = pamrs.simulate(rig, supply_pressure=fine, sample_time=DT / 5)
    channels = {name: run[name][::5] for name in GAUGES}
    if metered:  # what the chamber has more of, and what leaks out of it, has flown in
        channels["air_flow"] = np.gradient(run["air_mass"] + run["mass_vented"], DT / 5)[::5]
    return noisy(f"r{seed}", role, DT, channels, GAUGES | {"air_flow": METER}, [5, seed])


def test_the_recorded_pressure_drives_the_rest_and_is_not_judged() -> None:
    assert set(blocks_of(RIG, GAUGES)) == {"chamber"}
    found = diagnosed(RIG, partial(drawn, RIG))
    assert found.verdict in ("none", "parameters")
    assert [block.blocks for block in found.blocks] == [["chamber"]]
    assert found.free_run is not None
    assert {*found.free_run[0].channels} == {"muscle_pressure"}
    narrow = RIG.with_parameters({"line.discharge_area": 1.6e-6})
    names_value(diagnosed(RIG, partial(drawn, narrow)), "line.discharge_area", 1.6e-6, 0.02)


def test_a_simulation_takes_the_pressure_as_an_input() -> None:
    given = wall(1)
    run = pamrs.simulate(RIG, supply_pressure=given, sample_time=DT)
    np.testing.assert_allclose(run["supply_pressure"], given, rtol=1e-9)
    constant = pamrs.simulate(RIG, duration=5.0, sample_time=DT)
    assert np.ptp(constant["supply_pressure"]) == 0.0
    assert constant["muscle_pressure"][-1] == pytest.approx(2e5, rel=1e-3)
    one = pamrs.Simulator(RIG, sample_time=DT, initial={"supply_pressure": given[0]})
    stepped = [one.step(supply_pressure=float(p))["muscle_pressure"] for p in given[1:40]]
    np.testing.assert_allclose(stepped, run["muscle_pressure"][1:40], rtol=1e-9)
    recording = drawn(RIG.with_parameters({"supply.pressure_zero": 3e3}), "fit", 2)
    again = replay(RIG.with_parameters({"supply.pressure_zero": 3e3}), recording)
    assert differences(again, recording)["muscle_pressure"] < 600.0
    assert "supply_pressure" not in differences(again, recording)


def test_what_is_missing_or_cannot_be_is_named() -> None:
    blind = without(drawn(RIG, "fit", 0), "supply_pressure")
    with pytest.raises(DiagnosisError, match="supply_pressure"):
        pamrs.diagnose(pamrs.Case("wall", RIG, [blind], Path()))
    far = RIG.with_parameters({"supply.initial_pressure": 1e4})  # no recording is held against it
    assert implausible(drawn(RIG, "fit", 0), far, SETTINGS) == []
    with pytest.raises(RecordingError, match="no usable supply_pressure, which the rig needs"):
        replay(RIG, blind)
    with pytest.raises(ParameterError, match=r"supply_pressure\[3\] = nan"):
        pamrs.simulate(RIG, supply_pressure=[1e5, 1e5, 1e5, np.nan], sample_time=DT)
    tank = parse_rig(
        text_of(__file__, "measured").replace(
            '"measured"', '"tank"\nvolume = { value = 1, unit = "l" }'
        )
    )
    words = r'only a supply takes that is measured \(\[supply\] kind = "measured"\)'
    with pytest.raises(ParameterError, match=words):
        pamrs.simulate(tank, supply_pressure=wall(0), sample_time=DT)
    with pytest.raises(pamrs.RigError, match=r"supply\.volume is not allowed with 'measured'"):
        parse_rig(
            text_of(__file__, "measured").replace(
                '"measured"', '"measured"\nvolume = { value = 1, unit = "l" }'
            )
        )


def test_a_meter_tells_a_narrow_line_from_a_larger_chamber() -> None:
    """Either fills more slowly; only one lets less through at the same pressures."""
    assert set(blocks_of(RIG, (*GAUGES, "air_flow"))) == {"chamber", "flow"}
    narrow = RIG.with_parameters({"line.discharge_area": 1.5e-6})
    found = diagnosed(RIG, partial(drawn, narrow, metered=True))
    names_value(found, "line.discharge_area", 1.5e-6, 0.01)
    larger = RIG.with_parameters({"chamber.dead_volume": 1.35e-3})
    found = diagnosed(RIG, partial(drawn, larger, metered=True))
    names_value(found, "chamber.dead_volume", 1.35e-3, 0.01)
    assert found.fit["held_out"]["air_flow"].before < 1.2


def test_a_meter_that_is_not_zeroed_is_no_missing_physics() -> None:
    def tared(role: str, seed: int) -> Recording:
        one = drawn(RIG, role, seed, metered=True)
        channels = one.channels | {"air_flow": one.channels["air_flow"] + 3e-4}
        return replace(one, channels=channels)

    assert diagnosed(RIG, tared).verdict in ("none", "parameters")


def test_a_leak_behind_the_meter_is_seen_by_the_gauge_alone() -> None:
    leaking = RIG.with_effect("leak_muscle", {"conductance": 2e-9})
    found = diagnosed(RIG, partial(drawn, leaking, metered=True))
    assert [effect.id for effect in found.effects] == ["leak_muscle"]
    assert found.fit["held_out"]["air_flow"].before < 1.2
