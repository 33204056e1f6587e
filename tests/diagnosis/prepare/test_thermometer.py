"""A recorded temperature of a gas is a block of its own, beside the pressure of the same gas."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.next_experiment import _planning, measurable
from pamrs.diagnosis.next_experiment._choice import outcome_of
from pamrs.diagnosis.next_experiment._differences import checked_channels
from pamrs.diagnosis.prepare import available_blocks, thermometers_of
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.experiments import library
from pamrs.recordings import Recording, propose
from pamrs.rig import parse_rig
from tests.diagnosis.asked import ROLES
from tests.diagnosis.noisy import GAUGES, noisy, without
from tests.diagnosis.stands import WALL, WARM, vented
from tests.reference import network
from tests.simulation.test_thermometer import late
from tests.tables import text_of

NOISE = GAUGES | {"temperature": 0.2}
TANK = text_of(__file__, "tank")
_BALANCE = TANK[TANK.index('gas = "') : TANK.index("[line]")]
COEFFICIENTS = TANK.replace(
    _BALANCE,
    "".join(f'{k} = {{ value = 1.35, unit = "1" }}\n' for k in ("alpha_in", "alpha_out", "alpha")),
)


@cache
def emptied(model: str, pressure: float) -> dict[str, np.ndarray]:
    """Ten seconds at 50 Hz by the reference, from a gauge pressure [Pa]."""
    begin = {"muscle_pressure": pressure}
    return network.simulate(json.loads(model), {}, 0.02, begin, 1e-8, rows=501)


def blown(rig: pamrs.Rig, *, lag: float = 0.0, off: float = 0.0) -> list[Recording]:
    """Three blow-downs by the reference model, ten seconds at 50 Hz each, with what a thermometer
    reads that is so late [s] and so much off [K].
    """
    step, found = 0.02, []
    gas = rig.model["gas"]
    volume = rig.parameter("chamber.dead_volume").value
    for k, role in enumerate(ROLES):
        run = emptied(rig.to_json(), (4.0 + k) * 1e5)
        absolute = run["muscle_pressure"] + gas["ambient_pressure"]
        read = absolute * volume / (run["air_mass"] * gas["gas_constant"])
        read = late(run["time"], read, lag) if lag > 0.0 else read
        channels = {"muscle_pressure": run["muscle_pressure"], "temperature": read + off}
        found.append(noisy(f"r{k}", role, step, channels, NOISE, [7, k]))
    return found


def filled(rig: pamrs.Rig, skipped: float = 0.0) -> list[Recording]:
    """Three logs of eight seconds at 200 Hz of a chamber that is filled and vented in steps, each
    begun some time [s] after the plant was.
    """
    return [vented(rig, role, seed, NOISE, skipped) for seed, role in enumerate(ROLES)]


def bare(recordings: list[Recording]) -> list[Recording]:
    """The same without thermometers."""
    return [without(r, "temperature") for r in recordings]


def found_in(rig: pamrs.Rig, recordings: list[Recording]) -> pamrs.Diagnosis:
    return pamrs.diagnose(pamrs.Case("case", rig, recordings, Path()))


def test_a_true_model_misses_nothing_however_much_the_thermometer_is_off() -> None:
    rig = parse_rig(TANK)
    found = found_in(rig, blown(rig, off=1.5))
    assert found.verdict == "none"
    assert [b.blocks for b in found.blocks] == [["chamber", "temperature"]]
    assert found.data[0].used == ["muscle_pressure", "temperature"]
    assert not found.data[0].unused


def test_a_wall_is_known_better_with_a_thermometer() -> None:
    nominal = parse_rig(TANK)
    recordings = blown(nominal.with_parameters({WALL: 60.0}))
    walls = []
    for given in (recordings, bare(recordings)):
        (wrong,) = found_in(nominal, given).wrong_parameters
        assert wrong["name"] == WALL
        assert abs(wrong["value"] - 60.0) < 3.0 * wrong["std"]
        walls.append(wrong["std"])
    with_it, without_it = walls
    assert with_it < 0.85 * without_it


@pytest.fixture(scope="module")
def slowly() -> pamrs.Diagnosis:
    """Of a thermometer that is half a second late."""
    rig = parse_rig(TANK)
    return found_in(rig, blown(rig, lag=0.5))


def test_a_slow_thermometer_is_no_heat_of_the_gas(slowly: pamrs.Diagnosis) -> None:
    found = slowly
    assert found.verdict == "effects"
    assert [e["id"] for e in found.effects] == ["thermometer_lag"]
    assert not found.wrong_parameters
    assert not found.ambiguity
    own = found.effects[0]["parameters"]["time_constant"]
    assert own["value"] == pytest.approx(0.5, abs=3.0 * own["std"] + 0.01)


def test_a_thermometer_that_the_rig_file_knows_hides_no_wall() -> None:
    known = parse_rig(
        TANK + '[[effects]]\nid = "thermometer_lag"\n[effects.parameters]\n'
        'time_constant = { value = 0.4, unit = "s", std = 0.2 }\n'
    )
    truth = parse_rig(TANK).with_parameters({WALL: 60.0})
    found = found_in(known, blown(truth, lag=0.5))
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == WALL
    assert wrong["value"] == pytest.approx(60.0, rel=0.05)
    assert not found.effects


def test_a_thermometer_that_shows_a_share_of_the_wall_vetoes_nothing() -> None:
    """Where it reads 0.7 of what the gas does, a right wall is none other, a wrong one is told."""
    nominal = parse_rig(TANK)
    room = nominal.model["gas"]["temperature"]
    for wall in (20.0, 60.0):
        recordings = blown(nominal.with_parameters({WALL: wall}))
        for one in recordings:
            one.channels["temperature"] = room + 0.7 * (one.channels["temperature"] - room)
        found = found_in(nominal, recordings)
        assert not found.effects or found.verdict != "effects"
        told = [w.value for w in found.wrong_parameters if w.name == WALL]
        assert told == ([pytest.approx(60.0, rel=0.1)] if wall == 60.0 else [])
        error = found.fit.held_out["muscle_pressure"]
        assert error.after < 1.2 * error.noise


def test_a_log_may_begin_while_the_gas_is_warm() -> None:
    """What the gas began with is no missing physics, whether a thermometer says it or not."""
    rig = parse_rig(WARM)
    recordings = filled(rig, 0.6)
    first = [r.channels["temperature"][0] for r in recordings]
    assert max(abs(t - rig.model["gas"]["temperature"]) for t in first) > 8.0
    assert found_in(rig, recordings).verdict == "none"
    begun = found_in(rig, bare(recordings))
    assert begun.verdict == "none"
    assert not begun.answer.missed


def test_holes_of_either_sensor_are_not_judged() -> None:
    rig = parse_rig(TANK)
    recordings = blown(rig)
    for recording in recordings:
        for channel, first in (("temperature", 60), ("muscle_pressure", 150)):
            recording.channels[channel][first : first + 30] = np.nan
            recording.mask[channel][first : first + 30] = False
    assert found_in(rig, recordings).verdict == "none"


def test_a_gas_without_a_temperature_says_what_to_write() -> None:
    rig = parse_rig(COEFFICIENTS)
    recordings = blown(parse_rig(TANK))
    found = found_in(rig, recordings)
    reason = found.data[0].unused["temperature"]
    assert 'gas = "energy_balance"' in reason
    assert "heat_transfer_coefficient" in reason
    assert "[chamber]" in reason
    without = found_in(rig, bare(recordings))
    assert [law.other for law in found.laws] == [law.other for law in without.laws]
    assert found.probabilities == pytest.approx(without.probabilities, abs=1e-3)
    # as a model that holds the effect has one
    held = rig.with_effect("heat_transfer", {"heat_transfer_coefficient": 20.0})
    assert thermometers_of(held) == {"": "temperature"}
    again = found_in(held, recordings)
    assert "temperature" in again.data[0].used
    assert [b.blocks for b in again.blocks] == [["chamber", "temperature"]]


def test_of_two_gases_that_are_joined_neither_is_judged() -> None:
    """The second gets the cold air of the first, which drives no block."""
    first = TANK.replace("[chamber]", "[chamber.a]").replace('"chamber"', '"chamber.a"')
    first = first.replace('"ambient"', '"chamber.b"')
    other = TANK[TANK.index("[chamber]") : TANK.index("[line]")].replace("6.0", "0.0")
    rig = parse_rig(first + other.replace("[chamber]", "[chamber.b]"))
    assert thermometers_of(rig) == {}
    channels = [f"{kind}.{name}" for name in "ab" for kind in ("muscle_pressure", "temperature")]
    recordings = []
    for k, role in enumerate(ROLES):
        begin = {"muscle_pressure.a": (4.0 + k) * 1e5}
        run = pamrs.simulate(rig, duration=10.0, sample_time=0.02, initial=begin)
        noise = {name: NOISE[name.partition(".")[0]] for name in channels}
        own = {name: run[name] for name in channels}
        recordings.append(noisy(f"r{k}", role, 0.02, own, noise, [7, k]))
    found = found_in(rig, recordings)
    assert {block for group in found.blocks for block in group.blocks} == {"chamber.a", "chamber.b"}
    assert "comes from another chamber" in found.data[0].unused["temperature.b"]


def test_a_plan_knows_which_gas_may_have_a_thermometer() -> None:
    assert measurable(parse_rig(TANK), "temperature") == ("temperature",)
    assert measurable(parse_rig(COEFFICIENTS), "temperature") == ()
    with pytest.raises(pamrs.errors.ParameterError, match="'temperature', which is not allowed"):
        checked_channels(parse_rig(COEFFICIENTS), ("muscle_pressure", "temperature"))


def logged(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    """A log of some columns by their headings."""
    rows, log = np.column_stack(list(columns.values())), folder / "log.csv"
    np.savetxt(log, rows, delimiter=",", header=",".join(columns), comments="")
    return log


def test_a_log_tells_the_temperature_of_the_gas_from_others(tmp_path: Path) -> None:
    wave = np.sin(0.1 * np.arange(100))
    columns = {"time [s]": 0.1 * np.arange(100), "p chamber [bar]": 4.0 + wave}
    columns |= {"chamber temp [degC]": 20.0 + wave, "motor temp [degC]": 40.0 + wave}
    log = logged(tmp_path, columns)
    for text, more in ((TANK, {"temperature": "chamber temp"}), (COEFFICIENTS, {})):
        found = propose([log], parse_rig(text))
        told = {m.channel: m.series.name for m in found.logs[0].matches}
        assert told == {"muscle_pressure": "p chamber", **more}


def test_a_thermometer_adds_its_block_and_changes_no_other() -> None:
    rig = parse_rig(WARM)
    channels = ("valve_command", "supply_pressure", "muscle_pressure")
    plain = {b.name: b for b in available_blocks(rig, channels)}
    more = {b.name: b for b in available_blocks(rig, (*channels, "temperature"))}
    assert set(more) - set(plain) == {"temperature"}
    assert more["supply"] == plain["supply"]
    # what the thermometer says of the beginning, a fit says without it
    assert plain["chamber"].warm is not None
    assert more["chamber"].warm is None
    same = replace(more["chamber"], thermometer="", warm=plain["chamber"].warm)
    assert same == plain["chamber"]
    own = more["temperature"]
    assert (own.channel, own.kind, own.closure) == ("temperature", "temperature", None)
    assert set(own.drives) == {"valve_command", "supply_pressure", "muscle_pressure"}
    assert own.anchor == plain["chamber"].window
    assert own.window is None


@pytest.mark.parametrize(("holds", "every"), [(True, 5), (False, 25)])
def test_a_thermometer_slower_than_the_log_is_left_alone(holds: bool, every: int) -> None:
    rig = parse_rig(TANK)
    slow = []
    for recording in blown(rig):
        read, time = recording.channels["temperature"], recording.time
        line = np.interp(time, time[::every], read[::every])
        step = np.repeat(read[::every], every)[: read.size]
        channels = {**recording.channels, "temperature": step if holds else line}
        slow.append(replace(recording, channels=channels))
    found = found_in(rig, slow)
    assert found.verdict == "none"
    assert any("temperature is not judged: in 'r0' one sample in" in w for w in found.warnings)


def test_a_dead_thermometer_stops_no_diagnosis() -> None:
    rig = parse_rig(TANK)
    first, *others = blown(rig)
    mask = {**first.mask, "temperature": np.zeros(len(first), dtype=bool)}
    found = found_in(rig, [replace(first, mask=mask), *others])
    assert found.verdict == "none"
    assert any("in 'r0' only 0 of 501 samples are usable" in w for w in found.warnings)


@pytest.mark.parametrize(
    "name", ["room_air_temp", "ambient_air_temperature", "muscle_temperature", "air"]
)
def test_no_temperature_of_the_room_or_the_rubber_is_that_of_the_gas(
    tmp_path: Path, name: str
) -> None:
    wave = np.sin(0.1 * np.arange(100))
    columns = {"time [s]": 0.1 * np.arange(100), "p chamber [bar]": 4.0 + wave}
    other = {f"{name} [degC]": 21.0 + 0.1 * wave}
    for more, told in (({"T_gas [degC]": 20.0 + wave}, "T_gas"), ({}, None)):
        log = logged(tmp_path, columns | more | other)
        found = propose([log], parse_rig(TANK)).logs[0].matches
        assert {m.channel: m.series.name for m in found}.get("temperature") == told


def test_a_rig_that_states_the_lag_of_its_thermometer_can_be_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = parse_rig(TANK).with_effect("thermometer_lag", {"time_constant": 0.4})
    pool = library(rig, DiagnosisSettings())[:1]
    monkeypatch.setattr(_planning, "library", lambda *_: pool)
    plan = pamrs.plan_diagnosis(rig, ["muscle_pressure", "temperature"])
    assert "thermometer_lag" not in {own.effect for own in plan.limits}


def test_two_models_are_compared_where_only_one_has_a_temperature_of_its_gas() -> None:
    cold, settings = parse_rig(COEFFICIENTS), DiagnosisSettings()
    warm = cold.with_effect("heat_transfer")
    experiment = library(cold, settings)[0]
    pair = [("with", warm, 0.5), ("without", cold, 0.5)]
    noise = {"muscle_pressure": 400.0, "temperature": 0.2}
    told = outcome_of(experiment, pair, noise, ("muscle_pressure", "temperature"), settings)
    alone = outcome_of(experiment, pair, noise, ("muscle_pressure",), settings)
    np.testing.assert_array_equal(told.distance, alone.distance)
