"""What an answer rests on: long recordings are averaged, channels without use are told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import (
    at_ambient,
    available_blocks,
    averaged,
    averaged_to_need,
    impossible_rooms,
    prepare,
    residual,
)
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig, differences, replay
from tests.diagnosis.asked import SETTINGS, blocks_of, diagnosed
from tests.diagnosis.noisy import SHOULDER, driven
from tests.diagnosis.prepare.test_overlap import of, run
from tests.tables import text_of

NAMES = ("valve_command", *SHOULDER)


def test_means_are_of_their_time_and_free_of_aliases() -> None:
    dt = 0.001
    time = dt * np.arange(5000)
    hum = np.sin(2 * np.pi * 200.0 * time)  # would be a constant at every fifth sample
    volts = np.where(time < 2.0015, 5.0, 6.0)
    channels = {"muscle_pressure": 1e5 * time + 1e4 * hum, "valve_command": volts}
    fast = of("fast", "fit", dt, channels)
    slow = averaged(fast, 5)
    assert slow.sample_time == pytest.approx(0.005)
    assert len(slow) == 999
    middle = slow.time + 0.002
    np.testing.assert_allclose(slow.channels["muscle_pressure"], 1e5 * middle, atol=1e-6)
    # a command holds from the middle of its mean on
    step = slow.channels["valve_command"]
    assert step[399] == 5.0
    assert step[400] == 6.0
    assert averaged(fast, 1) is fast
    # the commands of the log are kept: five from each sample to the next
    np.testing.assert_array_equal(slow.commands["valve_command"], volts[2 : 2 + 5 * 999])


def test_holes_stay_holes() -> None:
    values = np.arange(50.0)
    values[10:13] = np.nan  # three of five
    values[20:22] = np.nan  # two of five
    slow = averaged(of("a", "fit", 0.001, {"muscle_pressure": values}), 5)
    assert slow.mask["muscle_pressure"].tolist() == [True, True, False] + [True] * 6
    assert np.isnan(slow.channels["muscle_pressure"][2])
    assert slow.channels["muscle_pressure"][4] == pytest.approx(23.0)


def test_a_valve_lets_through_what_its_openings_do_and_not_their_mean() -> None:
    # a controller moves the spool every 4 ms, mostly about its null, where a mean is shut
    rig, dt = pamrs.rigs.shoulder(), 0.002
    rng = np.random.default_rng(5)
    moves = 5.0 + 0.25 * np.sin(0.02 * np.arange(1000)) + rng.normal(0.0, 0.15, 1000)
    exact, command = dict.fromkeys(SHOULDER, 0.0), {"valve_command": np.repeat(moves, 2)}
    fast = driven(rig, "a", "fit", dt, command, exact, [0], step=0.001)
    chamber, core = blocks_of(rig, NAMES)["chamber"], core_rig(rig)
    logged = averaged(fast, 5)

    def missed(recording: Recording) -> float:
        prepared = prepare(recording, rig, SETTINGS)
        return float(np.std(residual(chamber, core, prepared, []).value))

    assert missed(fast) < 1.0
    assert missed(logged) < 100.0  # a mean is not quite the instant in its middle
    assert missed(replace(logged, commands={})) > 3000.0


def test_only_fast_recordings_are_averaged_and_no_further_than_needed() -> None:
    one = run(duration=16.0)
    blocks = available_blocks(pamrs.rigs.shoulder(), NAMES)
    few = replace(SETTINGS, ample_samples=40)
    assert averaged_to_need([one], blocks, "a", SETTINGS) == ([one], [1])
    assert averaged_to_need([one], blocks, "a", few)[1] == [1]  # at the rate that is needed
    quick = run(dt=0.001, duration=4.0)
    assert averaged_to_need([quick, one], blocks, "a", few)[1] == [9, 1]
    assert averaged_to_need([quick], blocks, "a", SETTINGS)[1] == [3]  # it is short
    words = r"'long': .* 3644 samples .* at most 3500 .* start and"
    with pytest.raises(DiagnosisError, match=words):
        averaged_to_need([quick, one], blocks, "long", replace(few, most_samples=3500))
    sealed = available_blocks(pamrs.rigs.sealed_chamber(), ("muscle_pressure",))
    assert averaged_to_need([quick], sealed, "a", few)[1] == [99]


def test_channels_without_use_are_told_everywhere() -> None:
    rig = pamrs.rigs.sealed_chamber()
    leaky = rig.with_effect("leak_muscle", {"conductance": 3e-11})
    given = {"duration": 60.0, "step": 0.01, "initial": {"muscle_pressure": 7e5}}
    hold = driven(leaky, "hold", "fit", 0.02, {}, {"muscle_pressure": 150.0}, [1], **given)
    rng = np.random.default_rng(2)
    useless = {"line_pressure": (1e5, 150.0), "temperature": (293.0, 0.1)}
    more = {name: rng.normal(*level, len(hold)) for name, level in useless.items()}
    settings = replace(SETTINGS, ample_samples=500)
    hold = of("hold", "fit", 0.02, hold.channels | more)
    found = diagnosed(rig, lambda *_: hold, ("fit",), settings)
    assert [e.id for e in found.effects][:1] == ["leak_muscle"]
    (own,) = json.loads(found.to_json())["data"]
    assert own["used"] == ["muscle_pressure"]
    assert list(own["unused"]) == ["line_pressure", "temperature"]
    assert own["unused"]["line_pressure"] == "the rig has no block [line]"
    assert own["unused"]["temperature"].startswith("the gas of chamber has no temperature of its")
    assert (own["averaged"], own["samples"]) == (5, 599)
    told = " ".join(found.summary().split())
    assert "at 10 Hz (means of 5 samples recorded at 50 Hz); used: muscle_pressure" in told
    assert "recorded but not used: line_pressure (the rig has no block [line])" in told
    from pamrs.report import render_html

    assert "recorded but not used: line_pressure" in render_html(found)


WARM = 320.0
NOZZLE = parse_rig(text_of(__file__, "nozzle"))


def warm_stand(role: str, seed: int, room: float = WARM) -> Recording:
    """A tank that empties through a nozzle at 320 K, by 4.5 % faster than at 293 K."""
    rig = NOZZLE.with_parameters({"gas.temperature": WARM})
    start, noise = {"muscle_pressure": 5e5 + 2e4 * seed}, {"muscle_pressure": 150.0}
    given = {"duration": 40.0, "step": 0.01, "initial": start}
    made = driven(rig, "", role, 0.02, {}, noise, [seed], **given)
    air = np.round(np.random.default_rng(seed).normal(room, 0.1, len(made)), 1)
    return of(f"hold{seed}", role, 0.02, made.channels | {"ambient_temperature": air})


def test_a_measured_room_is_that_of_the_rig() -> None:
    """Air of 320 K goes through a nozzle faster than the 293 K of the rig file say."""
    found = diagnosed(NOZZLE, warm_stand)
    assert found.verdict == "none"
    (told,) = (text for text in found.warnings if text.startswith("gas.temperature is"))
    assert told.startswith("gas.temperature is 320 K, as ambient_temperature was measured (293")
    for own in json.loads(found.to_json())["data"]:
        assert "ambient_temperature" in own["used"]
        assert own["unused"] == {}


def rooms(*temperatures: float) -> list[Recording]:
    """A recording in a room of each of these temperatures."""
    return [
        of(f"hold{k}", "fit", 0.02, {"ambient_temperature": np.full(50, room)})
        for k, room in enumerate(temperatures)
    ]


def room_of(*temperatures: float, rig: pamrs.Rig = NOZZLE) -> tuple[pamrs.Rig, list[str]]:
    """The rig at a room of these temperatures, one for each recording, and what is said."""
    return at_ambient(rig, rooms(*temperatures), SETTINGS)


def test_one_temperature_holds_for_all_recordings() -> None:
    rig, said = room_of(290.0, 291.0, 299.0)
    assert rig.parameter("gas.temperature").value == pytest.approx(291.0, abs=0.1)
    assert "differs between the recordings, from 290.0 to 299.0 K" in said[1]
    assert at_ambient(NOZZLE, [], SETTINGS)[1] == []


@pytest.mark.parametrize(
    ("room", "told"),
    [
        (293.18, "is 293.18 K, as ambient_temperature was measured (to 0.1 K the rig file's)"),
        (293.26, "is 293.26 K, as ambient_temperature was measured (293.15 K in the rig file)"),
    ],
)
def test_temperatures_that_are_told_beside_each_other_differ(room: float, told: str) -> None:
    assert told in room_of(room, rig=known_to(""))[1][0]


@pytest.mark.parametrize("room", [210.0, 249.9, 330.1, 390.0, 500.0, 1900.0])
def test_a_room_that_cannot_be_is_named(room: float) -> None:
    (told,) = impossible_rooms(rooms(293.0, room, 294.0), SETTINGS)
    assert told.startswith(f"ambient_temperature of hold1 ({room} K): no room has it, 250 to 330 K")


def test_an_impossible_room_ends_a_diagnosis_unless_it_is_allowed() -> None:
    hot = pamrs.Case("hot", NOZZLE, [warm_stand("fit", 1, 390.0)], Path())
    with pytest.raises(DiagnosisError, match=r"hold1 \(390.0 K\): no room has it"):
        pamrs.diagnose(hot)
    wider = replace(SETTINGS, most_room=400.0)
    assert "gas.temperature is 390 K" in " ".join(pamrs.diagnose(hot, settings=wider).warnings)


def known_to(tolerance: str) -> pamrs.Rig:
    """The rig at 293.15 K, with what is known of that."""
    value = 'value = 293.15, unit = "K"' + (tolerance and f", {tolerance}")
    text = NOZZLE.to_toml_text()
    assert "[gas]" in text
    return parse_rig(text.replace("[gas]", f"[gas]\ntemperature = {{ {value} }}"))


@pytest.mark.parametrize(
    ("tolerance", "room", "doubted"),
    [
        ("", 273.15, True),  # of an open input
        ("", 293.15 + 14.9, False),
        ("", 293.15 + 15.1, True),
        ("tol = 1.0", 293.15 + 2.9, False),
        ("tol = 1.0", 293.15 - 3.1, True),
        ("tol = 10.0", 293.15 + 14.9, False),
        ("tol = 10.0", 293.15 + 15.1, True),
    ],
)
def test_a_room_far_from_the_rig_file_is_doubted(
    tolerance: str, room: float, doubted: bool
) -> None:
    rig, said = room_of(room, rig=known_to(tolerance))
    assert rig.parameter("gas.temperature").value == pytest.approx(room)
    assert len(said) == 1 + doubted
    if doubted:
        assert f"{abs(room - 293.15):.1f} K away from gas.temperature of the rig file" in said[1]
        assert ("known to 1 K" in said[1]) == (tolerance == "tol = 1.0")


def test_masked_samples_say_nothing_of_the_room() -> None:
    values = np.where(np.arange(50) < 20, 295.0, 273.15)
    one = of("hold", "fit", 0.02, {"ambient_temperature": values})
    usable = replace(one, mask={"ambient_temperature": values > 280.0})
    rig, _ = at_ambient(NOZZLE, [usable], SETTINGS)
    assert rig.parameter("gas.temperature").value == 295.0
    none = replace(one, mask={"ambient_temperature": np.zeros(50, dtype=bool)})
    assert at_ambient(NOZZLE, [none], SETTINGS) == (NOZZLE, [])


def test_a_recorded_temperature_of_the_gas_is_compared_by_a_replay() -> None:
    """Air that is let out cools; a thermometer that reads 2 K too much shows there."""
    gas = 'gas = "energy_balance"'
    wall = 'heat_transfer_coefficient = { value = 20.0, unit = "W/(m2 K)" }'
    text = NOZZLE.to_toml_text().replace("alpha", "# alpha")
    rig = parse_rig(text.replace("[chamber]", f"[chamber]\n{gas}\n{wall}", 1))
    made = pamrs.simulate(rig, duration=20.0, sample_time=0.02, initial={"muscle_pressure": 5e5})
    assert made["temperature"].min() < 289.0
    pressure, gas = made["muscle_pressure"], made["temperature"] + 2.0
    recording = of("hold", "fit", 0.02, {"muscle_pressure": pressure, "temperature": gas})
    told = differences(replay(rig, recording), recording)
    assert told["temperature"] == pytest.approx(2.0, rel=0.01)
