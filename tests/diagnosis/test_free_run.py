"""Free runs of the whole rig beside the cut chain, and what else schema 2 has."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Events, Problem, residuals
from pamrs.diagnosis.model import _free_run
from pamrs.diagnosis.prepare import available_blocks, averaged, begun_alike, prepare
from pamrs.diagnosis.prove import valid_result
from pamrs.diagnosis.result import schema
from pamrs.effects import Term
from pamrs.errors import SimulationError
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis import synthetic
from tests.diagnosis.test_assemble import NAMES, recorded
from tests.diagnosis.test_gas_law import NOISE as PRESSURES
from tests.diagnosis.test_gas_law import TEXT as WARM
from tests.diagnosis.test_gas_law import recorded as filled
from trial.marks import result_of as scored

SETTINGS = DiagnosisSettings()


def problem_of(rig: Rig, records: list[Recording]) -> Problem:
    names = [n for n in NAMES if all(n in r.channels for r in records)]
    blocks = available_blocks(rig, names)
    return Problem(blocks, [prepare(r, rig, SETTINGS) for r in records], core_rig(rig), SETTINGS)


def test_the_true_model_runs_freely_to_the_noise_and_the_nominal_one_drifts() -> None:
    rig = pamrs.rigs.shoulder()
    true = rig.with_effect("leak_muscle", {"conductance": 3e-9})
    problem = problem_of(rig, [recorded(true, "a", "held_out")])
    found = {"before": residuals(problem, rig), "after": residuals(problem, true)}
    runs, note, curves = _free_run.free_run(problem, found, rig, true, None)
    assert note == ""
    assert runs is not None
    (run,) = runs
    assert (run.recording, run.role, run.note) == ("a", "held_out", "")
    assert run.seconds == pytest.approx(5.995)
    assert set(run.channels) == {"supply_pressure", "muscle_pressure", "joint_angle"}
    error = run.channels["muscle_pressure"]
    assert error.unit == "Pa"
    assert error.after == pytest.approx(400.0, rel=0.1)  # the transducer's noise
    assert error.before > 3.0 * error.after
    assert error.cut_after is not None
    assert error.cut_before is not None
    assert error.cut_after < error.cut_before
    drawn = next(c for c in curves if c.channel == "muscle_pressure")
    assert (drawn.recording, drawn.role, drawn.unit) == ("a", "held_out", "Pa")
    for curve, size in ((drawn.before, error.before), (drawn.after, error.after)):
        assert curve is not None
        missed = float(np.sqrt(np.nanmean((drawn.measured - curve) ** 2)))
        assert missed == pytest.approx(size, rel=1e-9)


def test_without_a_command_there_is_no_free_run_and_it_is_said_why() -> None:
    rig = pamrs.rigs.shoulder()
    silent = recorded(rig, "silent", "held_out", leave_out="valve_command")
    whole = recorded(rig, "whole", "held_out", seed=2)
    problem = problem_of(rig, [silent])
    found = {"before": residuals(problem, rig), "after": residuals(problem, rig)}
    runs, note, _ = _free_run.free_run(problem, found, rig, rig, None)
    assert runs is None
    assert "silent" in note
    assert "valve_command" in note
    both = problem_of(rig, [silent, whole])
    found = {"before": residuals(both, rig), "after": residuals(both, rig)}
    runs, note, _ = _free_run.free_run(both, found, rig, rig, None)
    assert [r.recording for r in runs or []] == ["whole"]
    assert "silent" in note


@pytest.mark.parametrize(("seed", "skipped", "told"), [(2, 0.0, 0), (0, 0.6, 28), (2, 0.6, 0)])
def test_a_gas_with_a_temperature_is_judged_as_others(
    seed: int, skipped: float, told: float
) -> None:
    """Begun at rest, in a transient, or 17 K above the room, which no pressure tells: a true model
    explains it, one that lacks a leak does not.
    """
    rig = parse_rig(WARM)
    known = [(n, p.value, p.tol) for n, p in rig.parameters.items() if 0.0 < p.tol < math.inf]
    names, values, tolerances = zip(*known, strict=True)
    file = _free_run.KnownValues(names, np.array(values), np.diag(tolerances))
    off, errors = {}, {}
    for leak in (0.0, 3e-8):
        true = rig.with_effect("leak_muscle", {"conductance": leak}) if leak else rig
        records = [filled(true, "held_out", seed, PRESSURES, skipped)]
        problem = problem_of(rig, records)
        recordings = [begun_alike(problem.blocks, problem.core, p) for p in problem.recordings]
        problem = replace(problem, recordings=recordings)
        begun = recordings[0].temperatures.get("muscle_pressure", 293.15)
        assert leak or begun == pytest.approx(293.15 + told, abs=1.0)
        found = {"before": residuals(problem, rig), "after": residuals(problem, rig)}
        runs, *_ = _free_run.free_run(problem, found, rig, rig, None, file)
        assert runs is not None
        off[leak] = {name for name, error in runs[0].channels.items() if error.off}
        errors[leak] = runs[0].channels["muscle_pressure"].after
    assert not off[0.0]
    assert off[3e-8] == {"muscle_pressure"}
    assert errors[0.0] < 500.0 or (skipped and not told)  # 400 Pa are noise


def test_of_a_long_log_the_first_part_is_asked_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = parse_rig(WARM)
    true = rig.with_effect("leak_muscle", {"conductance": 3e-8})
    told = _free_run.KnownValues(("chamber.dead_volume",), np.array([5e-4]), np.array([[5e-6]]))
    problem = problem_of(rig, [filled(true, "held_out", 2, PRESSURES)])
    found = {"before": residuals(problem, rig), "after": residuals(problem, rig)}
    runs = []
    for samples in (_free_run._OFF_SAMPLES, 1000):
        monkeypatch.setattr(_free_run, "_OFF_SAMPLES", samples)
        (run,), *_ = _free_run.free_run(problem, found, rig, rig, None, told)
        assert run.channels["muscle_pressure"].off
        runs.append(run)
    whole, part = runs
    assert (whole.note, part.note) == ("", "whether it is off was asked of its first 5 s")
    assert part.channels == whole.channels


def test_means_run_freely_under_the_commands_of_their_log() -> None:
    rig = pamrs.rigs.shoulder()
    whole = recorded(rig, "whole", "held_out")
    jumping = whole.channels["valve_command"] + np.resize([0.1, 0.1, -0.1, -0.1], len(whole))
    made = pamrs.simulate(rig, valve_command=jumping, sample_time=whole.sample_time)
    fast = replace(
        whole, channels={"valve_command": jumping} | {name: made[name] for name in NAMES[1:]}
    )
    means = averaged(fast, 5)
    problem = problem_of(rig, [means])
    found = {"before": residuals(problem, rig), "after": residuals(problem, rig)}
    runs, *_ = _free_run.free_run(problem, found, rig, rig, None)
    assert runs is not None
    assert runs[0].channels["muscle_pressure"].before < 300.0
    problem = problem_of(rig, [replace(means, commands={})])
    runs, *_ = _free_run.free_run(problem, found, rig, rig, None)
    assert runs is not None
    assert runs[0].channels["muscle_pressure"].before > 1000.0


def test_a_model_that_leaves_its_range_has_no_number_and_stops_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = pamrs.rigs.shoulder()
    worse = rig.with_effect("leak_muscle", {"conductance": 3e-9})
    problem = problem_of(rig, [recorded(rig, "a", "fit")])
    found = {"before": residuals(problem, rig), "after": residuals(problem, worse)}
    honest = _free_run.replay

    def left(model: Rig, recording: Recording, **options: Any) -> pamrs.Simulation:
        if model.effects:
            raise SimulationError("contraction left the table")
        return honest(model, recording, **options)

    monkeypatch.setattr(_free_run, "replay", left)
    runs, *_ = _free_run.free_run(problem, found, rig, worse, None)
    assert runs is not None
    (run,) = runs
    assert run.note == "with what was found: contraction left the table"
    assert all(math.isnan(e.after) and e.before > 0.0 for e in run.channels.values())
    content = synthetic.diagnosis(free_run=runs).to_dict()
    assert content["free_run"][0]["channels"]["joint_angle"]["after"] is None
    jsonschema.validate(json.loads(json.dumps(content)), schema())


def test_what_happened_in_one_recording_is_in_its_free_run_only() -> None:
    rig = pamrs.rigs.shoulder()
    event = {"torque": 4.0, "time": 3.0, "duration": 1.0}
    final = rig.with_effect("external_torque", event)
    records = [recorded(rig, name, "fit", seed=k) for k, name in enumerate("ab")]
    problem = problem_of(rig, records)
    found = {"before": residuals(problem, rig), "after": residuals(problem, rig)}
    events = Events(Term("external_torque"), {"a": event})
    runs, *_ = _free_run.free_run(problem, found, rig, final, events)
    assert runs is not None
    pushed, quiet = (run.channels["joint_angle"] for run in runs)
    assert pushed.after != pushed.before
    assert quiet.after == quiet.before


@pytest.mark.parametrize(("name", "read"), [("1", True), ("2", True), ("3", False)])
def test_results_of_the_first_schema_can_still_be_read(
    tmp_path: Path, name: str, read: bool
) -> None:
    out = tmp_path / "case_a" / "out.json"
    out.parent.mkdir()
    out.write_text(json.dumps({"schema": f"pamrs.diagnosis/{name}", "verdict": "none"}))
    assert (valid_result(out) is not None) == read
    if read:
        assert scored(tmp_path, "case_a") is not None
    else:
        with pytest.raises(ValueError, match="schema must be one of"):
            scored(tmp_path, "case_a")
