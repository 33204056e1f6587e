"""Free runs of the whole rig beside the cut chain, and what else schema 2 has."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import Events, Problem, residuals
from pamrs.diagnosis.model import _free_run
from pamrs.diagnosis.prepare import averaged, with_unjudged_starts
from pamrs.effects import Term
from pamrs.errors import SimulationError
from pamrs.findings import FreeRun
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis import synthetic
from tests.diagnosis.asked import problem_of
from tests.diagnosis.explain.test_assemble import NAMES, recorded
from tests.diagnosis.kept import kept
from tests.diagnosis.stands import WARM, vented
from trial.marks import result_of as scored
from trial.prove import valid_result


def ran(
    problem: Problem, before: Rig, after: Rig, events: Events | None = None, **more: Any
) -> tuple[list[FreeRun], str, Any]:
    """Free runs of a problem with two models, what is said of them, and their curves."""
    found = {"before": residuals(problem, before), "after": residuals(problem, after)}
    runs, note, curves = _free_run.free_run(problem, found, before, after, events, **more)
    return runs or [], note, curves


def test_the_true_model_runs_freely_to_the_noise_and_the_nominal_one_drifts() -> None:
    rig = pamrs.rigs.shoulder()
    true = rig.with_effect("leak_muscle", {"conductance": 3e-9})
    problem = problem_of(rig, [recorded(true, "a", "held_out")])
    (run,), note, curves = ran(problem, rig, true)
    assert note == ""
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
    runs, note, _ = ran(problem_of(rig, [silent]), rig, rig)
    assert runs == []
    assert "silent" in note
    assert "valve_command" in note
    runs, note, _ = ran(problem_of(rig, [silent, whole]), rig, rig)
    assert [r.recording for r in runs] == ["whole"]
    assert "silent" in note


@pytest.mark.parametrize(("seed", "skipped", "told"), [(2, 0.0, 0), (0, 0.6, 28), (2, 0.6, 17)])
def test_a_gas_with_a_temperature_is_judged_as_others(
    seed: int, skipped: float, told: float
) -> None:
    """Begun at rest, in a transient, or 17 K above the room: a true model explains it, one that
    lacks a leak does not.
    """
    rig = parse_rig(WARM)
    known = [(n, p.value, p.tol) for n, p in rig.parameters.items() if 0.0 < p.tol < math.inf]
    names, values, tolerances = zip(*known, strict=True)
    file = _free_run.KnownValues(names, np.array(values), np.diag(tolerances))
    off, errors = {}, {}
    for leak in (0.0, 3e-8):
        true = rig.with_effect("leak_muscle", {"conductance": leak}) if leak else rig
        problem = problem_of(rig, [vented(true, "held_out", seed, skipped=skipped)])
        recordings = [
            with_unjudged_starts(problem.blocks, problem.core, p) for p in problem.recordings
        ]
        problem = replace(problem, recordings=recordings)
        begun = residuals(problem, rig)["chamber", f"r{seed}"].temperature
        assert leak or begun == pytest.approx(293.15 + told, abs=1.0)
        (run,), *_ = ran(problem, rig, rig, known=file)
        off[leak] = {name for name, error in run.channels.items() if error.off}
        errors[leak] = run.channels["muscle_pressure"].after
    assert not off[0.0]
    assert off[3e-8] == {"muscle_pressure"}
    assert errors[0.0] < 500.0  # 400 Pa are noise


def test_likely_values_keep_to_what_a_rig_can_have() -> None:
    """A wall that takes no heat, and would take less: the volume is looked for all the same."""
    rig = parse_rig(WARM).with_parameters({"chamber.heat_transfer_coefficient": 0.0})
    names = ("chamber.heat_transfer_coefficient", "chamber.dead_volume")
    known = _free_run.KnownValues(names, np.array([0.0, 5e-4]), np.diag([4.0, 5e-5]))
    true = rig.with_parameters({"chamber.dead_volume": 5.6e-4})
    problem = problem_of(rig, [vented(true, "held_out", 2)])
    (run,), *_ = ran(problem, rig, rig, known=known)
    assert run.channels["muscle_pressure"].noises > 5.0
    assert not run.channels["muscle_pressure"].off


def test_nothing_is_said_of_a_clock_that_is_ahead_of_its_commands() -> None:
    """No simulation answers a command that is still to come."""
    rig = parse_rig(WARM)
    true = rig.with_effect("leak_muscle", {"conductance": 3e-8})
    told = _free_run.KnownValues(("chamber.dead_volume",), np.array([5e-4]), np.array([[5e-6]]))
    problem = problem_of(rig, [vented(true, "held_out", 2)])
    for offset, off in ((0.04, True), (-0.04, False)):
        late = rig.with_effect("clock_skew", {"offset": offset})
        (run,), *_ = ran(problem, rig, late, known=told)
        assert run.channels["muscle_pressure"].off is off
        assert ("ahead of its commands" in run.note) is not off


def test_of_a_long_log_the_first_part_is_asked_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = parse_rig(WARM)
    true = rig.with_effect("leak_muscle", {"conductance": 3e-8})
    told = _free_run.KnownValues(("chamber.dead_volume",), np.array([5e-4]), np.array([[5e-6]]))
    problem = problem_of(rig, [vented(true, "held_out", 2)])
    runs = []
    for samples in (_free_run._OFF_SAMPLES, 1000):
        monkeypatch.setattr(_free_run, "_OFF_SAMPLES", samples)
        (run,), *_ = ran(problem, rig, rig, known=told)
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
    errors = []
    for one in (means, replace(means, commands={})):
        (run,), *_ = ran(problem_of(rig, [one]), rig, rig)
        errors.append(run.channels["muscle_pressure"].before)
    assert errors[0] < 300.0
    assert errors[1] > 1000.0


def test_a_model_that_leaves_its_range_has_no_number_and_stops_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = pamrs.rigs.shoulder()
    worse = rig.with_effect("leak_muscle", {"conductance": 3e-9})
    problem = problem_of(rig, [recorded(rig, "a", "fit")])
    honest = _free_run.replay

    def left(model: Rig, recording: Recording, **options: Any) -> pamrs.Simulation:
        if model.effects:
            raise SimulationError("contraction left the table")
        return honest(model, recording, **options)

    monkeypatch.setattr(_free_run, "replay", left)
    runs, *_ = ran(problem, rig, worse)
    (run,) = runs
    assert run.note == "with what was found: contraction left the table"
    assert all(math.isnan(e.after) and e.before > 0.0 for e in run.channels.values())
    content = kept(synthetic.diagnosis(free_run=runs))
    assert content["free_run"][0]["channels"]["joint_angle"]["after"] is None


def test_what_happened_in_one_recording_is_in_its_free_run_only() -> None:
    rig = pamrs.rigs.shoulder()
    event = {"torque": 4.0, "time": 3.0, "duration": 1.0}
    final = rig.with_effect("external_torque", event)
    problem = problem_of(rig, [recorded(rig, n, "fit", seed=k) for k, n in enumerate("ab")])
    events = Events(Term("external_torque"), {"a": event})
    runs, *_ = ran(problem, rig, final, events)
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
