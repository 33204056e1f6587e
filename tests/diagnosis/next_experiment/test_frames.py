"""Experiments and plans of a load frame: what is asked keeps to what the bench can do, is a file
that it plays, and settles what small strokes leave open.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.diagnosis import limits
from pamrs.diagnosis.next_experiment import _planning as plan
from pamrs.diagnosis.next_experiment import measurable
from pamrs.diagnosis.next_experiment._differences import usual_noise
from pamrs.effects import EFFECTS
from pamrs.errors import DiagnosisError
from pamrs.experiments import chains_of, experiments_of, is_sealed, library, protocol_of
from pamrs.experiments._frame import _LEAST_STROKE
from pamrs.experiments._maker import _FILLING_TIME
from pamrs.recordings import load_recording
from pamrs.simulation import reading, replay
from tests.diagnosis import frames
from tests.diagnosis.asked import EXACT, SETTINGS
from tests.diagnosis.frames import BENCH, PAIR, REGULATED, REST, VALVED

HOME = Path(__file__).parents[3]
OPEN = {
    "muscle_hysteresis": {"friction_constant": 1.4, "friction_pressure": 0.0, "presliding": 3e-3},
    "muscle_creep": {"stiffness": 300.0},
}
"""Effects that small strokes at one speed do not tell apart."""
FRAMES = pytest.mark.parametrize(
    "rig",
    [BENCH, PAIR, *(pytest.param(rig, marks=pytest.mark.slow) for rig in (VALVED, REGULATED))],
    ids=lambda rig: rig.name,
)


def after(effect: str, *moved: np.ndarray) -> pamrs.Diagnosis:
    """The diagnosis with one more recording."""
    truth = BENCH.with_effect(effect, OPEN[effect])
    return pamrs.diagnose(frames.with_one_more(frames.case(truth), truth, *moved))


@pytest.fixture(scope="module")
def strokes() -> Callable[[str], pamrs.Diagnosis]:
    """Of small strokes of a bench with an effect."""
    return cache(lambda e: pamrs.diagnose(frames.case(BENCH.with_effect(e, OPEN[e]))))


@pytest.mark.slow
@pytest.mark.parametrize("effect", OPEN)
def test_what_small_strokes_leave_open_is_settled_by_what_is_proposed(effect, strokes) -> None:
    first = strokes(effect)
    names = {name for names in first.ambiguity for name in names}
    assert set(OPEN) <= names
    told = first.next_experiment
    assert told.expected_information_bits is not None
    assert told.expected_information_bits > 0.5
    pair = next(p for p in told.pairs if set(p.between) == set(OPEN))
    assert pair.experiment
    assert " cm" in pair.text  # the unit of the file
    others = [p for p in told.pairs if "unlisted" in p.between]
    assert all(p.experiment == "nested_strokes" for p in others)
    protocol = told.protocol
    assert protocol is not None
    assert protocol.units == {"pressure_command": "Pa", "length": "m"}
    best = after(effect, protocol.commands["length"], protocol.commands["pressure_command"])
    assert best.ambiguity == []
    assert best.probabilities[effect] > 0.8


@FRAMES
def test_experiments_keep_to_what_a_frame_can_do(rig: pamrs.Rig) -> None:
    pool = {e.name: e for e in library(rig, SETTINGS, sample_time=0.01)}
    assert {"slow_strokes", "strokes_at_speeds", "nested_strokes", "length_steps"} <= set(pool)
    load, (rest, *_) = rig.tables("load")[""], rig.tables("muscle").values()
    filled = chains_of(rig)[0].before(rig) if rig in (VALVED, REGULATED) else None
    for experiment in pool.values():
        run = experiment.simulate(rig)
        length = experiment.commands["length"]
        assert length.min() >= load["min_length"]
        assert length.max() <= rest["rest_length"]
        assert np.abs(np.diff(length)).max() <= SETTINGS.length_rate * 0.01 * (1 + 1e-9)
        for name, values in experiment.commands.items():
            if name.startswith("pressure_command"):
                assert np.abs(np.diff(values)).max() <= SETTINGS.pressure_rate * 0.01 * (1 + 1e-9)
        for chain in chains_of(rig):
            assert run[chain.pressure].max() <= rig.limits["max_pressure"]
        force = reading(run, "force")
        assert force is not None
        # what is not filled yet cannot pull
        assert force[0 if filled is None else round(_FILLING_TIME / 0.01) :].min() > 0.0
    still = pool["multisine"].commands["length"]
    assert np.ptp(still) == 0.0
    assert "with the length held at" in pool["multisine"].text
    assert np.ptp(pool["slow_strokes"].commands["length"]) > 0.05
    moved = pool["length_and_pressure"].commands
    assert all(np.ptp(values) > 0.0 for values in moved.values())


def test_recordings_say_how_long_how_fast_and_how_high() -> None:
    given = frames.case(BENCH)
    pool = experiments_of(BENCH, given.recordings, SETTINGS)
    longest = max(frames.strokes(k)[0].max() for k in range(3))
    highest = max(frames.strokes(k)[1].max() for k in range(3))
    shortest = longest - _LEAST_STROKE * REST
    for experiment in pool:
        length, pressure = (experiment.commands[n] for n in ("length", "pressure_command"))
        assert shortest - 1e-3 <= length.min()
        assert length.max() <= longest + 2e-4
        assert pressure.max() <= 1.06 * highest
    # a servo-hydraulic frame that was seen to move at 0.1 m/s is asked for as much
    time = 0.01 * np.arange(1000)
    fast = REST * 0.93 + 0.01 * np.sin(2 * np.pi * 2.0 * time)
    quick = frames.played(BENCH, "quick", "fit", fast, np.full(1000, 3e5), 9)
    asked = experiments_of(BENCH, [quick], SETTINGS, {"strokes_at_speeds"})[0].commands["length"]
    rate = float(np.abs(np.diff(asked)).max()) / 0.01
    assert SETTINGS.length_rate < rate <= 0.13


def test_a_muscle_that_was_held_is_moved_by_the_least_stroke() -> None:
    pressure = 3e5 + 1e5 * np.sin(np.arange(1000) * 0.05)
    held = frames.played(BENCH, "held", "fit", np.full(1000, 0.95 * REST), pressure, 1)
    (found,) = experiments_of(BENCH, [held], SETTINGS, {"slow_strokes"})
    length = found.commands["length"]
    assert length.max() == pytest.approx(0.95 * REST, abs=3e-4)
    assert np.ptp(length) == pytest.approx(_LEAST_STROKE * REST, abs=3e-4)


def test_a_stand_that_cannot_move_gets_no_strokes() -> None:
    text = BENCH.to_toml_text().replace("17.0,", "27.4,").replace("28.5,", "27.55,")
    still = pamrs.rig.parse_rig(text)
    assert still.tables("load")[""]["max_length"] == pytest.approx(0.2755)
    found = library(still, SETTINGS, sample_time=0.01)
    assert found
    assert all(np.ptp(e.commands["length"]) == 0.0 for e in found)


@FRAMES
def test_every_experiment_is_a_file_that_the_rig_plays(rig: pamrs.Rig, tmp_path: Path) -> None:
    file = tmp_path / "next.csv"
    for experiment in library(rig, SETTINGS, sample_time=0.01):
        protocol = protocol_of(experiment)
        assert protocol is not None
        file.write_text(protocol.to_csv(), encoding="utf-8")
        if experiment.initial:
            continue  # something is set by hand, as its text says
        run = replay(rig, load_recording(file))
        own = experiment.simulate(rig)
        forces = (reading(one, "force") for one in (run, own))
        np.testing.assert_allclose(*forces, rtol=0.0, atol=1e-3)


def test_a_shut_valve_keeps_the_air_while_the_length_moves() -> None:
    (experiment,) = library(VALVED, SETTINGS, sample_time=0.01, only={"sealed_strokes"})
    run = experiment.simulate(VALVED)
    shut = run.time >= _FILLING_TIME
    mass = run["air_mass"][shut]
    assert np.ptp(mass) < 1e-6 * mass.mean()
    pressure, volume = run["muscle_pressure"][shut] + 101325.0, run["air_volume"][shut]
    assert pressure[np.argmin(volume)] > pressure[np.argmax(volume)]
    assert "sealed_strokes" not in {e.name for e in library(REGULATED, SETTINGS, sample_time=0.01)}


def test_a_frame_is_no_sealed_chamber_and_has_a_load_cell() -> None:
    assert not is_sealed(BENCH)
    assert measurable(BENCH) == ("muscle_pressure", "length", "force")
    assert "force" not in measurable(pamrs.rigs.named("hanging_mass"))
    commands = [chain.commands for chain in chains_of(PAIR)]
    assert commands == [("pressure_command.left",), ("pressure_command.right",)]
    given = {"length": 0.28, "pressure": {"left": 2e5, "right": 3e5}}
    run = pamrs.simulate(PAIR, **given, sample_time=0.01, duration=0.1)
    both = run["muscle_force.left"] + run["muscle_force.right"]
    np.testing.assert_array_equal(reading(run, "force"), both)
    assert reading(run, "joint_angle") is None


def test_nothing_says_how_high_a_bench_may_go() -> None:
    assert BENCH.muscle is not None
    bare = pamrs.rigs.bench(BENCH.muscle)
    for what in (lambda: library(bare, SETTINGS), lambda: pamrs.plan_diagnosis(bare, ["force"])):
        with pytest.raises(DiagnosisError, match="max_pressure"):
            what()
    (told,) = library(bare, SETTINGS, highest=2e5, only={"slow_strokes"})
    assert told.commands["pressure_command"].max() <= 2e5
    # a force map ends at its highest pressure
    sizes = {"rest_length": 0.3, "rest_diameter": 0.023, "braid_angle": 1.1}
    reach = {"max_pressure": 4e5, "contraction": (-0.02, 0.25)}
    muscle = pamrs.Muscle.from_law(
        lambda p, e: 1e-3 * p * (1.0 - 3.0 * e), **reach, **sizes, wall_thickness=0.0015
    )
    (found,) = library(pamrs.rigs.bench(muscle), SETTINGS, only={"slow_triangle"})
    assert 3.5e5 < found.commands["pressure_command"].max() <= 4e5


def planned(monkeypatch: pytest.MonkeyPatch, rig: pamrs.Rig, *effects: str):
    """Plans of a rig from a few experiments and effects in the place of all."""
    kinds = {"slow_triangle", "slow_strokes", "strokes_at_speeds", "sealed_hold"}
    pool = library(rig, SETTINGS, sample_time=0.01, only=kinds)
    monkeypatch.setattr(plan, "library", lambda *_: pool)
    monkeypatch.setattr(limits, "CATALOGUE", {name: EFFECTS[name] for name in effects})
    return lambda *kinds, channels=(), noise=None: pamrs.plan_diagnosis(
        rig, channels or measurable(rig), experiments=kinds, noise=noise, settings=EXACT
    )


def test_held_lengths_show_no_friction_and_strokes_do(monkeypatch: pytest.MonkeyPatch) -> None:
    made = planned(monkeypatch, BENCH, "muscle_hysteresis", "muscle_rate_damping")
    still = made("slow_triangle")
    assert still.seen == ()
    moved = next(a for a in still.additions if a.name == "slow_strokes")
    assert "muscle_hysteresis" in moved.seen
    assert still.noise["force"] == usual_noise()["force"]
    quiet = {"muscle_pressure": 50.0, "length": 1e-5, "force": 0.3}
    both = made("slow_strokes", "strokes_at_speeds", noise=quiet)
    assert set(both.seen) == {"muscle_hysteresis", "muscle_rate_damping"}
    assert both.separable("muscle_hysteresis", "muscle_rate_damping")
    blind = made("slow_strokes", channels=("muscle_pressure", "length"))
    assert blind.seen == ()
    assert blind.additions[0].name == "force"


def test_a_frame_with_a_valve_is_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    made = planned(monkeypatch, VALVED, "leak_muscle", "muscle_hysteresis")
    found = made("sealed_hold", "slow_strokes")
    assert [b["name"] for b in found.blocks] == ["supply", "chamber", "force"]
    assert found.limit("leak_muscle").block == "chamber"
    assert found.limit("muscle_hysteresis").block == "force"
    assert set(found.seen) == {"leak_muscle", "muscle_hysteresis"}


def test_the_packaged_layout_is_planned_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    some = ("muscle_hysteresis", "activation_pressure", "leak_muscle")
    monkeypatch.setattr(limits, "CATALOGUE", {name: EFFECTS[name] for name in some})
    layout, out = HOME / "cases" / "layouts" / "isometric_bench.toml", tmp_path / "plan.json"
    words = ["diagnose", "--plan", str(layout), "--force-noise", "2 N", "--json", str(out)]
    assert cli.main(words) == 0
    page = capsys.readouterr().out
    assert "slow_strokes: hold" in page
    assert "What would add most" in page
    written = json.loads(out.read_text(encoding="utf-8"))
    assert written["noise"]["force"] == 2.0
    limit = {e["id"]: e["seen_from"] for e in written["effects"]}
    assert (
        2.0 < limit["muscle_hysteresis"] < 50.0
    )  # N: more than the noise, less than a tenth of the pull
    assert "leak_muscle" in written["not_asked"]  # the bench sets the pressure
