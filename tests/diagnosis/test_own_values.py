"""Parameters that had another value in a recording: a payload that was hung on, another nozzle."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Problem, residuals
from pamrs.diagnosis.prepare import available_blocks, prepare
from pamrs.errors import CaseError, DiagnosisError
from pamrs.recordings import OwnValue, Recording, load_case
from pamrs.simulation import core_rig
from tests.diagnosis.noisy import SHOULDER as NOISE
from tests.diagnosis.noisy import noisy

SETTINGS = DiagnosisSettings()
DT = 0.005
SHOULDER = pamrs.rigs.shoulder()
NAME = "arm.payload"
LOADS = {"light": SHOULDER.parameter(NAME).value, "heavy": 13.0, "half": 11.0}
ROLES = {"light": "fit", "heavy": "fit", "half": "held_out"}


def recordings(true: pamrs.Rig, *, told: bool, error: str = "same") -> list[Recording]:
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
        run = pamrs.simulate(rig, command, sample_time=DT)
        channels = {"valve_command": command} | {n: run[n] for n in NOISE}
        own = {NAME: OwnValue(load, nominal, error)} if told and more else {}
        found.append(noisy(name, ROLES[name], DT, channels, NOISE, [31, k], own))
    return found


def test_a_payload_that_is_told_is_no_missing_physics() -> None:
    case = pamrs.Case("loads", SHOULDER, recordings(SHOULDER, told=True), Path())
    found = pamrs.diagnose(case)
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
    case = pamrs.Case("loads", SHOULDER, recordings(true, told=True), Path())
    found = pamrs.diagnose(case)
    assert found.probabilities["muscle_hysteresis"] > 0.8
    assert found.fit["gap_closed"] > 0.9


@pytest.mark.parametrize(("error", "slope"), [("same", 1.0), ("proportional", 1.5), ("none", 0.0)])
def test_sensitivities_are_those_of_the_value_elsewhere(error: str, slope: float) -> None:
    (record, *_) = recordings(SHOULDER, told=False)
    nominal = SHOULDER.parameter(NAME).value
    own = OwnValue(1.5 * nominal, nominal, error)
    assert own.slope == pytest.approx(slope)
    assert own.at(nominal) == pytest.approx(1.5 * nominal)
    told = Recording(
        "told", "fit", record.time, DT, record.channels, record.mask, parameters={NAME: own}
    )
    prepared = prepare(told, SHOULDER, SETTINGS)
    (arm,) = [b for b in available_blocks(SHOULDER, tuple(record.channels)) if b.name == "arm"]
    there = prepare(replace(told, parameters={}), SHOULDER, SETTINGS)
    core = core_rig(SHOULDER)
    found = residuals(Problem([arm], [prepared], core, SETTINGS), SHOULDER, [NAME])["arm", "told"]
    # as of a rig that has the value everywhere
    heavy = SHOULDER.with_parameters({NAME: 1.5 * nominal})
    alone = residuals(Problem([arm], [there], core, SETTINGS), heavy, [NAME])["arm", "told"]
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
        run = pamrs.simulate(SHOULDER.with_parameters({AREA: area}), command, sample_time=DT)
        channels = {"valve_command": command} | {n: run[n] for n in NOISE}
        own = {AREA: OwnValue(nominal, nominal, error)} if error else {}
        role = "held_out" if name == "between" else "fit"
        found.append(noisy(name, role, DT, channels, NOISE, [37, k], own))
    return found


def test_a_value_of_each_recording_is_found_there() -> None:
    found = pamrs.diagnose(pamrs.Case("nozzles", SHOULDER, nozzles(error="own"), Path()))
    assert found.verdict in ("none", "parameters")
    (told,) = (w for w in found.warnings if w.startswith(f"{AREA} is free in each recording"))
    assert "the largest is 2.9 times the smallest" in told
    values = [float(v) for v in re.findall(r": ([\de.-]+) in narrow, ([\de.-]+) in wide", told)[0]]
    assert values == pytest.approx([AREAS["narrow"], AREAS["wide"]], rel=0.02)
    # the whole rig has them too
    (run,) = found.free_run or []
    assert run.channels["muscle_pressure"].after < 3.0 * NOISE["muscle_pressure"]


def test_nozzles_that_nobody_told_are_no_single_value() -> None:
    found = pamrs.diagnose(pamrs.Case("nozzles", SHOULDER, nozzles(error=""), Path()))
    assert found.verdict not in ("none", "parameters") or found.wrong_parameters


def test_a_leak_of_each_day_is_a_value_of_its_own() -> None:
    rig = SHOULDER.with_effect("leak_muscle", {"conductance": 1e-9})
    (record, *_) = nozzles(error="")
    name = "leak_muscle.conductance"
    own = replace(record, parameters={name: OwnValue(3e-9, 1e-9, "own")})
    assert own.rig_there(rig).effects[0]["parameters"]["conductance"] == 3e-9
    assert rig.effects[0]["parameters"]["conductance"] == 1e-9


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
    [
        ('{ "arm.payloat" = { value = 12, unit = "kg" } }', "has no parameter 'arm.payloat'"),
        ('{ "arm.payload" = { value = 12, unit = "bar" } }', "wrong dimension"),
        ('{ "arm.payload" = { value = 12 } }', "unit = None is not allowed"),
        ('{ "arm.payload" = { value = -12, unit = "kg" } }', "-12"),
        ('{ "arm.payload" = { value = 2, unit = "kg", error = "some" } }', "error = 'some'"),
        ('"heavy"', "a table of parameters"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, parameters: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        load_case(written(tmp_path, parameters))


def test_geometry_cannot_differ_in_a_diagnosis() -> None:
    (record, *_) = recordings(SHOULDER, told=False)
    own = {"muscle.rest_length": OwnValue(0.28, 0.276)}
    odd = Recording("odd", "fit", record.time, DT, record.channels, record.mask, parameters=own)
    with pytest.raises(DiagnosisError, match=r"muscle\.rest_length cannot differ"):
        pamrs.diagnose(pamrs.Case("odd", SHOULDER, [odd], Path()))
