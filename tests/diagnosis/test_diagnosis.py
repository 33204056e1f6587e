"""Diagnosis: known answers are recovered, nothing is found where nothing is, bad data are refused
in words.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import available_blocks, noise_level, prepare
from pamrs.effects import EFFECTS
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.asked import SETTINGS, diagnosed
from tests.diagnosis.held import RIG as SEALED
from tests.diagnosis.held import held
from tests.diagnosis.kept import kept
from tests.diagnosis.noisy import SHOULDER, driven

RIG = pamrs.rigs.shoulder()
ROOT = Path(__file__).parents[2]
CHAMBERS = ROOT / "cases" / "zillen_chambers"
DATA = ROOT / ".." / "shared" / "recordings" / "pneumatic_cylinders_zillen"


def test_every_parameter_of_the_catalogue_is_one_that_a_fit_can_move() -> None:
    for effect in EFFECTS.values():
        name = "regulated_joint" if "regulator" in effect.supplies else "shoulder"
        rig = pamrs.rigs.named("blow_down_tank" if effect.at == "line" else name)
        names = core_rig(rig.with_effect(effect.id)).parameter_names
        assert set({f"{effect.id}.{p.name}" for p in effect.parameters}) <= set(names)


@pytest.mark.parametrize("laminar", [0.0, 1.0])
def test_a_leak_is_named_with_its_size(laminar: float) -> None:
    found = pamrs.diagnose(held(3e-11, 120.0, laminar_share=laminar))
    assert found.verdict == "effects"
    assert found.effects[0]["id"] == "leak_muscle"
    parameters = found.effects[0]["parameters"]
    assert parameters["laminar_share"]["value"] == laminar
    value, std = parameters["conductance"]["value"], parameters["conductance"]["std"]
    assert abs(value - 3e-11) < max(4 * std, 0.01 * 3e-11)
    assert found.fit["gap_closed"] > 0.95
    kept(found)
    assert "leak_muscle" in found.model
    tested = {a["id"]: a for a in found.tested}
    assert {"leak_muscle", "heat_transfer"} <= set(tested)
    assert found.tested[0]["left"] < 0.05
    assert tested["leak_muscle"]["predicted_gain"] > 0.5


def test_the_form_of_a_leak_that_empties_the_chamber_is_found() -> None:
    """A crack at 6.3 bar, 138 s: its linear size falls short many times, in every form."""
    volume = SEALED.parameter("chamber.dead_volume").value
    leak = {"conductance": 1.1e-6 * volume, "exponent": 1.1}
    truth = SEALED.with_effect("leak_muscle", leak, form="power")
    given = {"duration": 138.0, "step": 0.01, "initial": {"muscle_pressure": 6.3e5}}
    one = driven(truth, "hold", "fit", 0.1, {}, {"muscle_pressure": 100.0}, [3], **given)
    found = diagnosed(SEALED, lambda *_: one, ("fit",))
    assert [(e.id, e.form) for e in found.effects] == [("leak_muscle", "power")]
    low, high = found.effects[0].parameters["exponent"].interval
    assert low <= 1.1 <= high


def test_a_diagnosis_repeats_exactly() -> None:
    first, second = (pamrs.diagnose(held(2e-12, 120.0)) for _ in range(2))
    assert first.probabilities == second.probabilities
    assert first.parameters == second.parameters


ROWS = np.arange(4000)


@pytest.mark.parametrize(
    ("signal", "level", "rel"),
    [
        (500.0 * np.sin(0.01 * ROWS), 1.0, 0.08),
        (500.0 * np.sin(0.01 * ROWS), 40.0, 0.08),
        # a valve that opens and shuts from sample to sample is no noise
        (np.where(ROWS % 2, 2e5, 0.0) * (1.0 + 0.02 * np.sin(ROWS / 90)), 400.0, 0.2),
    ],
    ids=["quiet", "loud", "chatter"],
)
def test_noise_level_is_recovered(signal: np.ndarray, level: float, rel: float) -> None:
    values = signal + np.random.default_rng(0).normal(0.0, level, ROWS.size)
    found = noise_level(values, np.ones(ROWS.size, dtype=bool), seed=SETTINGS.seed)
    assert found == pytest.approx(level, rel=rel)


def test_quantised_rest_has_the_noise_of_its_lattice() -> None:
    values = np.where(np.arange(400) % 50 == 0, 42.0, 0.0)
    found = noise_level(values, np.ones(400, dtype=bool), seed=SETTINGS.seed)
    assert found == pytest.approx(42.0 / np.sqrt(12.0))


def test_too_few_samples_are_refused_in_words() -> None:
    short = held(0.0, 0.1)
    with pytest.raises(pamrs.DiagnosisError, match="2 samples"):
        pamrs.diagnose(short)


def test_a_missing_channel_is_named() -> None:
    case = held(0.0, 120.0)
    with pytest.raises(pamrs.DiagnosisError, match="valve_command"):
        pamrs.diagnose(case.with_rig(RIG))


def test_a_third_of_the_samples_missing_changes_nothing() -> None:
    case = held(3e-11, 120.0)
    (recording,) = case.recordings
    holes = np.random.default_rng(3).random(len(recording)) < 0.3
    recording.mask["muscle_pressure"][holes] = False
    recording.channels["muscle_pressure"][holes] = np.nan
    found = pamrs.diagnose(case)
    assert found.effects[0]["id"] == "leak_muscle"
    assert found.effects[0]["parameters"]["conductance"]["value"] == pytest.approx(3e-11, rel=0.03)


def shoulder_recording(n: int = 2000) -> Recording:
    """A recording of the nominal shoulder with noise."""
    time = 0.005 * np.arange(n)
    command = {"valve_command": 5.0 + 0.3 * np.sin(time) + 0.1 * np.sin(5 * time)}
    start = {"muscle_pressure": 2e5, "joint_angle": 0.9}
    return driven(RIG, "run", "fit", 0.005, command, SHOULDER, [5], initial=start)


def usable(recording: Recording) -> dict[str, np.ndarray]:
    """The rows that each block can use."""
    prepared = prepare(recording, RIG, SETTINGS)
    return {
        b.name: prepared.usable(b.channel, b.drives, prepared.starts(b.window, b.drives))
        for b in available_blocks(RIG, tuple(recording.channels))
    }


def test_a_hole_in_a_drive_costs_only_itself() -> None:
    recording = shoulder_recording()
    recording.mask["muscle_pressure"][500:520] = False
    recording.mask["valve_command"][900:930] = False
    rows = usable(recording)
    assert not rows["supply"][900:930].any()
    assert not rows["chamber"][900:930].any()
    # the arm is driven by the pressure: the hole and the smoothing's reach on both sides, and no
    # more
    assert int((~rows["arm"]).sum()) <= 20 + 2 * 6 + 1


def test_mostly_missing_data_are_not_used() -> None:
    recording = shoulder_recording()
    recording.mask["valve_command"][: len(recording) - 60] = False
    recording.mask["muscle_pressure"][100:1500] = False
    rows = usable(recording)
    assert rows["supply"].mean() <= 0.2
    assert rows["chamber"].mean() <= 0.2


@pytest.mark.skipif(not DATA.exists(), reason="the recordings of ../shared are absent")
@pytest.mark.parametrize(("name", "leaks"), [("Ultimaker_015", True), ("Aluminium", False)])
def test_printed_chambers(name: str, leaks: bool) -> None:
    found = pamrs.diagnose(CHAMBERS / name, allow_outside=True)
    leak = found.probabilities.get("leak_muscle", 0.0)
    if leaks:
        assert found.verdict == "effects"
        # in whatever set: heat of the wall or a late gauge may stand beside it
        assert [e.id for e in found.effects] == ["leak_muscle"]
        assert found.effects[0].probability > 0.85
        time_constant = found.effects[0]["parameters"]["time_constant"]["value"]
        assert 4.0 < time_constant < 30.0
    else:
        # a drift of half a percent is not called a leak with confidence
        assert leak < 0.9
        (slow,) = (e for e in found.effects if e.id == "leak_muscle")
        assert slow.parameters["time_constant"].value > 1e4


@pytest.mark.parametrize(("highest", "named"), [(0.1, False), (0.3, True)])
def test_physics_in_the_held_out_recording_alone_is_searched_there(
    highest: float, *, named: bool
) -> None:
    """A stop that two small movements never reach: they prove what is fitted to the third."""
    stopped = RIG.with_effect("joint_end_stop", {"angle": 1.6, "stiffness": 300.0})
    time = 0.01 * np.arange(2000)
    made = []
    for k, size in enumerate((0.1, 0.08, highest)):
        command = 5.0 + size * (np.sin(time) + 0.3 * np.sin(5 * time))
        role, start = "fit" if k < 2 else "held_out", {"muscle_pressure": 2e5, "joint_angle": 0.9}
        given = ({"valve_command": command}, SHOULDER, [k])
        made.append(driven(stopped, "abc"[k], role, 0.01, *given, initial=start))
    found = pamrs.diagnose(pamrs.Case("stop", RIG, made, Path()))
    assert [e.id for e in found.effects] == ["joint_end_stop"] * named, found.summary()
    fitted = [d.recording for d in found.data if d.role == "fit"]
    assert fitted == (["a", "c"] if named else ["a", "b"])
    assert any("a and b" not in w and "c, held out" in w for w in found.warnings) is named
