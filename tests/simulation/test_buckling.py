"""Muscles do not push: without pressure they are slack, or push up to their buckling load."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import pamrs
from pamrs.cli import app
from pamrs.rig import parse_rig

PAIRS = ("pair_1", "pair_2", "pair_3")
STRUT = 1e9


def lifted(load: float, seconds: float = 20.0) -> pamrs.Simulation:
    """The first pair of the recruitment rig at 6 bar, the others vented."""
    values = {f"muscle.{pair}.buckling_load": load for pair in PAIRS}
    large = {"supply.initial_pressure": 6e5, "supply.volume": 5.0}
    rig = pamrs.rigs.recruitment().with_parameters(values | large)
    command = dict(zip(PAIRS, (9.0, 1.0, 1.0), strict=True))
    return pamrs.simulate(rig, command, sample_time=0.01, duration=seconds)


def test_muscles_without_air_do_not_hold_the_arm_down() -> None:
    slack, strut = lifted(3.5), lifted(STRUT)
    angles = [float(np.degrees(run["joint_angle.shoulder"][-1])) for run in (slack, strut)]
    assert angles[0] > 95.0
    assert angles[1] < 60.0
    # no pair of two pushes more than twice the load; the pair with air pulls as it did
    for pair in PAIRS:
        assert float(np.min(slack[f"muscle_force.{pair}"])) >= -7.0 - 1e-9
    assert float(np.min(strut["muscle_force.pair_2"])) < -1000.0
    first = [float(run["muscle_force.pair_1"][0]) for run in (slack, strut)]
    assert first[0] == pytest.approx(first[1], abs=1e-9)


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_muscles_of_the_packaged_rigs_are_slack_or_bow_out(name: str) -> None:
    loads = [table["buckling_load"] for table in pamrs.rigs.named(name).tables("muscle").values()]
    assert set(loads) <= ({3.5} if name == "recruitment" else {0.0})
    # a new file says so
    told = pamrs.rigs.template(name)
    assert told.count("\nbuckling_load") == len(loads)


def text_without_key(name: str) -> str:
    """The file of a packaged rig without what it says of a push."""
    lines = (resources.files("pamrs.rigs") / f"{name}.toml").read_text(encoding="utf-8")
    return "\n".join(x for x in lines.splitlines() if not x.startswith("buckling_load"))


def without_key(name: str) -> pamrs.Rig:
    """A packaged rig whose file says nothing of a push."""
    return parse_rig(text_without_key(name))


def test_where_nothing_is_said_a_muscle_is_slack() -> None:
    assert without_key("antagonistic_joint").tables("muscle")["flexor"]["buckling_load"] == 0.0
    assert pamrs.library.entry("pam_a_1in").muscle.parameters["buckling_load"] == 0.0


def test_a_file_that_says_nothing_of_a_push_is_told(tmp_path: Path) -> None:
    """It may be of the time when muscles pushed, and lag where they are slack now."""
    told = [c for c in without_key("antagonistic_joint").cautions if "slack without air" in c]
    assert [c.partition(" is ")[0] for c in told] == ["muscle.flexor", "muscle.extensor"]
    assert all("lags where the muscle is slack" in caution for caution in told)
    (caution,) = without_key("hanging_mass").cautions
    muscle = pamrs.Muscle.from_model(pamrs.rigs.hanging_mass().tables("muscle")[""])
    push = -float(muscle.force(0.0, 1.0 - np.linspace(0.18, 0.276, 500) / 0.276).min())
    said = float(caution.partition("by up to ")[2].partition(" N")[0])
    assert said == pytest.approx(push, rel=0.01)
    assert without_key("bench").cautions == []  # its length is held
    file = tmp_path / "rig.toml"
    file.write_text(without_key("hanging_mass").to_toml_text(comments=False), encoding="utf-8")
    assert not pamrs.load_rig(file).cautions  # what was made says what it has
    file.write_text(text_without_key("hanging_mass"), encoding="utf-8")
    found = CliRunner().invoke(app, ["rig", "check", str(file)])
    assert f"warning: {caution}" in found.output


def against_a_vented_extensor(rig: pamrs.Rig) -> pamrs.Simulation:
    """The flexor keeps its 2 bar."""
    command = {"flexor": np.full(1000, 5.0), "extensor": np.zeros(1000)}
    return pamrs.simulate(rig, sample_time=0.01, valve_command=command)


def test_what_pushes_is_said() -> None:
    held = {f"muscle.{side}.buckling_load": STRUT for side in ("flexor", "extensor")}
    rig = pamrs.rigs.antagonistic_joint().with_parameters(held)
    struts = against_a_vented_extensor(rig)
    assert np.degrees(struts["joint_angle.elbow"][-1]) == pytest.approx(79.7, abs=0.3)
    pushes = [event for event in struts.events if event.kind == "muscle_pushes"]
    assert {event.block for event in pushes} == {"muscle.flexor", "muscle.extensor"}
    assert "muscle.extensor: pushes, each muscle with up to 591.5 N" in struts.summary()
    assert len(rig.cautions) == 2
    assert all("buckling_load = 1e+09 N" in caution for caution in rig.cautions)
    assert "push: muscle.flexor, each by up to 1e+09 N" in rig.wiring
    bows = pamrs.rigs.recruitment()
    assert not bows.cautions  # possible, and meant
    assert "push: muscle.pair_1, each by up to 3.5 N" in bows.wiring
    assert not [line for line in pamrs.rigs.shoulder().wiring if line.startswith("push")]


@pytest.mark.parametrize("lane", ["elbow", "hanging_mass", "shoulder"])
def test_lanes_know_slack_muscles(lane: str) -> None:
    """The same run by the exact equations: what effects act on does not run in lanes."""
    rig = pamrs.rigs.named(lane)
    alone = rig.with_effect("pressure_lag", {"time_constant": 0.0})
    command = np.r_[np.full(60, 8.0), np.full(200, 0.0), np.full(60, 9.0)]
    ways = [pamrs.simulate(one, sample_time=0.01, valve_command=command) for one in (rig, alone)]
    for channel in ("joint_angle", "length", "muscle_work", "muscle_pressure"):
        if channel in ways[0]:
            fast, exact = (run[channel] for run in ways)
            np.testing.assert_allclose(fast, exact, atol=1e-7 * float(np.abs(exact).max()))


@pytest.mark.parametrize("load", [-1e-3, -3.5, 2e9, float("nan")])
def test_a_load_that_cannot_be_is_named(load: float) -> None:
    with pytest.raises(pamrs.PamrsError, match="buckling_load"):
        pamrs.rigs.recruitment().with_parameters({"muscle.pair_1.buckling_load": load})
