"""Parameters that had another value in a recording: a payload that was hung on, another nozzle."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import residuals
from pamrs.diagnosis.prepare import Residual
from pamrs.errors import CaseError, DiagnosisError
from pamrs.recordings import OwnValue, Recording, load_case
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.asked import ROLES, problem_of
from tests.diagnosis.noisy import SHOULDER as NOISE
from tests.diagnosis.noisy import driven
from tests.diagnosis.prepare.test_gauge_zeros import FED
from tests.tables import rows_of

DT = 0.005
SHOULDER = pamrs.rigs.shoulder()
SHOULDER_TEXT = SHOULDER.to_toml_text()
NAME = "arm.payload"
LOADS = {"light": SHOULDER.parameter(NAME).value, "heavy": 13.0, "half": 11.0}


def recordings(true: pamrs.Rig, *, told: bool) -> list[Recording]:
    """A shoulder with another payload in each recording, which the recordings say or do not."""
    found = []
    nominal = SHOULDER.parameter(NAME).value
    for k, (name, load) in enumerate(LOADS.items()):
        time = np.arange(0.0, 12.0, DT)
        command = (
            5.0
            + (0.4 + 0.05 * k) * np.sin(2 * np.pi * 0.15 * time)
            + 0.25 * np.sin(2 * np.pi * 0.4 * time + k)
        )
        more = load - nominal
        rig = true.with_parameters({NAME: true.parameter(NAME).value + more})
        one = driven(rig, name, ROLES[k], DT, {"valve_command": command}, NOISE, [31, k])
        own = {NAME: OwnValue(load, nominal, "same")} if told and more else {}
        found.append(replace(one, parameters=own))
    return found


def found_in(rig: pamrs.Rig, records: list[Recording]) -> pamrs.Diagnosis:
    return pamrs.diagnose(pamrs.Case("case", rig, records, Path()))


def test_a_payload_that_is_told_is_no_missing_physics() -> None:
    found = found_in(SHOULDER, recordings(SHOULDER, told=True))
    assert found.verdict in ("none", "parameters")
    assert found.fit["held_out"]["joint_angle"].after < 1.2 * np.degrees(3e-4)
    assert {d.recording: d.parameters for d in found.data} == {
        "light": {},
        "heavy": {NAME: 13.0},
        "half": {NAME: 11.0},
    }
    assert f"heavy with {NAME} = 13" in found.summary().replace("\n ", "")


@pytest.mark.slow
def test_an_effect_is_named_beside_it() -> None:
    true = SHOULDER.with_effect("muscle_hysteresis", {"friction_pressure": 1e-4})
    found = found_in(SHOULDER, recordings(true, told=True))
    assert found.probabilities["muscle_hysteresis"] > 0.8
    assert found.fit["gap_closed"] > 0.9


@pytest.mark.parametrize(("error", "slope"), [("same", 1.0), ("proportional", 1.5), ("none", 0.0)])
def test_sensitivities_are_those_of_the_value_elsewhere(error: str, slope: float) -> None:
    (record, *_) = recordings(SHOULDER, told=False)
    nominal = SHOULDER.parameter(NAME).value
    own = OwnValue(1.5 * nominal, nominal, error)
    assert own.slope == pytest.approx(slope)
    assert own.at(nominal) == pytest.approx(1.5 * nominal)

    def left(one: Recording, rig: Rig) -> Residual:
        return residuals(problem_of(SHOULDER, [one], "arm"), rig, [NAME])["arm", one.name]

    found = left(replace(record, parameters={NAME: own}), SHOULDER)
    # as of a rig that has the value everywhere
    alone = left(record, SHOULDER.with_parameters({NAME: 1.5 * nominal}))
    assert found.jacobian is not None
    assert alone.jacobian is not None
    np.testing.assert_allclose(found.value, alone.value, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.jacobian, slope * alone.jacobian, rtol=1e-12, atol=1e-14)
    assert np.abs(alone.jacobian).max() > 1e-3


AREA = "valve.discharge_area_max"
AREAS = {"narrow": 3.0e-6, "wide": 8.7e-6, "between": 5.0e-6}


def nozzles(*, error: str) -> list[Recording]:
    """A shoulder with another nozzle in each recording, whose size nobody knows."""
    found = []
    nominal = SHOULDER.parameter(AREA).value
    for k, (name, area) in enumerate(AREAS.items()):
        time = np.arange(0.0, 10.0, DT)
        command = 5.0 + 0.4 * np.sin(1.2 * time + k) + 0.2 * np.sin(4.4 * time)
        rig = SHOULDER.with_parameters({AREA: area})
        one = driven(rig, name, ROLES[k], DT, {"valve_command": command}, NOISE, [37, k])
        own = {AREA: OwnValue(nominal, nominal, error)} if error else {}
        found.append(replace(one, parameters=own))
    return found


def left_to_recordings(rig: Rig, key: str) -> Rig:
    """A rig whose file says of a value that each recording has its own."""
    (line,) = (own for own in rig.to_toml_text().splitlines() if own.startswith(f"{key} "))
    open_ended = re.sub(r",\s*(tol|std) = [^ ,}]+", "", line).replace(" }", ', error = "own" }', 1)
    return parse_rig(rig.to_toml_text().replace(line, open_ended))


def told_of(found: pamrs.Diagnosis, name: str) -> tuple[dict[str, float], str]:
    """What the warnings say of the values of each recording."""
    (told,) = (w for w in found.warnings if w.startswith(f"{name} is free in each recording"))
    values = re.findall(r"[:,] ([\de.+-]+) in (\w+)", told)
    return {recording: float(value) for value, recording in values}, told


@pytest.mark.parametrize("in_rig", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_value_of_each_recording_is_found_there(in_rig: bool) -> None:
    rig = left_to_recordings(SHOULDER, "discharge_area_max") if in_rig else SHOULDER
    found = found_in(rig, nozzles(error="" if in_rig else "own"))
    assert found.verdict in ("none", "parameters")
    values, told = told_of(found, AREA)
    assert "the largest is 2.9 times the smallest" in told
    assert values == pytest.approx(AREAS, rel=0.02)
    assert {d.recording: d.parameters[AREA] for d in found.data} == pytest.approx(AREAS, rel=0.02)
    # the whole rig has them too
    (run,) = found.free_run or []
    assert run.channels["muscle_pressure"].after < 3.0 * NOISE["muscle_pressure"]


@pytest.mark.slow
def test_nozzles_that_nobody_told_are_no_single_value() -> None:
    found = found_in(SHOULDER, nozzles(error=""))
    assert found.verdict not in ("none", "parameters") or found.wrong_parameters


LEAK = "leak_muscle.conductance"
RATES = {"monday": 1e-11, "tuesday": 2.9e-11, "wednesday": 1.7e-11}


@pytest.mark.parametrize("at", ["", "wall"])
def test_a_leak_of_each_day_is_found_there(at: str) -> None:
    tight = pamrs.rigs.sealed_chamber()
    if at:
        text = tight.to_toml_text().replace("[chamber]", f"[chamber.{at}]")
        tight = parse_rig(text.replace("[sensors]", f"[sensors.{at}]"))
    channel = f"muscle_pressure.{at}" if at else "muscle_pressure"
    days = []
    for k, (day, rate) in enumerate(RATES.items()):
        true = tight.with_effect("leak_muscle", {"conductance": rate}, at=at)
        given = {"duration": 60.0, "step": 0.01, "initial": {channel: 7e5}}
        days.append(driven(true, day, ROLES[k], 0.1, {}, {channel: 150.0}, [41, k], **given))
    rig = tight.with_effect("leak_muscle", {"conductance": 2e-11}, at=at)
    rig = left_to_recordings(rig, "conductance")
    assert rig.own == (f"leak_muscle.{at}.conductance" if at else LEAK,)
    found = found_in(rig, days)
    assert found.verdict in ("none", "parameters"), found.summary()
    values, told = told_of(found, LEAK)
    assert values == pytest.approx(RATES, rel=0.05)
    assert "the largest is 2.9 times the smallest" in told


BEGUN = {"full": 7e5, "half": 4.5e5, "later": 5.5e5}


def test_a_tank_without_a_gauge_begins_each_recording_at_its_own_pressure() -> None:
    tank = parse_rig(FED)
    name = "supply.initial_pressure"
    records = []
    for k, (day, begun) in enumerate(BEGUN.items()):
        levels = {"valve_command": np.random.default_rng(k).uniform(0.0, 10.0, 20).repeat(100)}
        true, noise = tank.with_parameters({name: begun}), {"muscle_pressure": 150.0}
        records.append(driven(true, day, ROLES[k], DT, levels, noise, [43, k]))
    found = found_in(left_to_recordings(tank, "initial_pressure"), records)
    assert found.verdict in ("none", "parameters"), found.summary()
    values, _ = told_of(found, name)
    assert values == pytest.approx(BEGUN, rel=0.02)


def test_a_pressure_that_is_read_needs_no_value_of_its_own() -> None:
    (first, *_) = recordings(SHOULDER, told=False)
    found = found_in(left_to_recordings(SHOULDER, "initial_pressure"), [first])
    assert "supply.initial_pressure: its gauge says where each recording begins" in found.warnings


def test_a_rig_file_says_which_values_are_those_of_recordings() -> None:
    rig = left_to_recordings(SHOULDER, "discharge_area_max")
    assert (rig.own, rig.parameter(AREA).tol) == ((AREA,), 0.0)
    for comments in (True, False):
        again = parse_rig(rig.with_parameters({AREA: 9e-6}).to_toml_text(comments=comments))
        assert (again.own, again.parameter(AREA).value) == ((AREA,), 9e-6)
    leaking = left_to_recordings(SHOULDER.with_effect("leak_muscle"), "conductance")
    assert leaking.own == parse_rig(leaking.to_toml_text(comments=False)).own == (LEAK,)
    assert leaking.without_effect("leak_muscle").own == ()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ('{ value = 8e-6, unit = "m2", error = "same" }', "error = 'same' is not allowed: 'own'"),
        ('{ value = 8e-6, unit = "m2", tol = 1e-6, error = "own" }', "exclude each other"),
    ],
)
def test_what_a_rig_file_cannot_say_of_them(entry: str, message: str) -> None:
    text = re.sub(r"discharge_area_max = {.*}", f"discharge_area_max = {entry}", SHOULDER_TEXT)
    with pytest.raises(pamrs.RigError, match=message):
        parse_rig(text)


def written(folder: Path, parameters: str) -> Path:
    SHOULDER.to_toml(folder / "rig.toml")
    time = np.arange(0.0, 0.5, DT)
    rows = "\n".join(f"{t:.3f},5,2e5" for t in time)
    (folder / "a.csv").write_text(f"time [s],valve_command [V],muscle_pressure [Pa]\n{rows}\n")
    (folder / "case.toml").write_text(
        f'schema = "pamrs.case/1"\n[[recording]]\nfile = "a.csv"\nparameters = {parameters}\n'
    )
    return folder


def test_a_case_file_says_them_in_any_unit(tmp_path: Path) -> None:
    folder = written(tmp_path, '{ "arm.payload" = { value = 12000, unit = "g", error = "none" } }')
    (recording,) = load_case(folder).recordings
    assert recording.parameters == {NAME: OwnValue(12.0, LOADS["light"], "none")}
    assert recording.rig_there(SHOULDER).parameter(NAME).value == 12.0


def test_a_case_file_leaves_a_value_to_the_recording(tmp_path: Path) -> None:
    (one,) = load_case(written(tmp_path, '{ "arm.payload" = { error = "own" } }')).recordings
    assert one.parameters == {NAME: OwnValue(LOADS["light"], LOADS["light"], "own")}
    told = '{ "leak_muscle.conductance" = { value = 2e-9, unit = "m3/(s Pa)", error = "own" } }'
    folder = written(tmp_path, told)
    SHOULDER.with_effect("leak_muscle", {"conductance": 1e-9}).to_toml(folder / "rig.toml")
    (one,) = load_case(folder).recordings
    assert one.parameters == {"leak_muscle.conductance": OwnValue(2e-9, 1e-9, "own")}


@pytest.mark.parametrize(
    ("parameters", "message"),
    rows_of(__file__, "what_is_wrong_is_said"),
)
def test_what_is_wrong_is_said(tmp_path: Path, parameters: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        load_case(written(tmp_path, parameters))


def test_geometry_cannot_differ_in_a_diagnosis() -> None:
    (record, *_) = recordings(SHOULDER, told=False)
    own = {"muscle.rest_length": OwnValue(0.28, 0.276)}
    with pytest.raises(DiagnosisError, match=r"muscle\.rest_length cannot differ"):
        found_in(SHOULDER, [replace(record, parameters=own)])
