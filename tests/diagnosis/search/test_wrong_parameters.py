"""Values of the rig file that are wrong: found, named, and kept apart from effects."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.evidence import FittedHypothesis
from pamrs.diagnosis.fit import Problem, fit
from pamrs.diagnosis.search import Attempts, suspected_values
from pamrs.diagnosis.search import _wrong_parameters as wrong_parameters
from pamrs.diagnosis.search._wrong_parameters import FURTHER_SHARE, _needless
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.asked import ROLES, SETTINGS, diagnosed, problem_of
from tests.diagnosis.kept import kept
from tests.diagnosis.noisy import SHOULDER, driven

RIG = pamrs.rigs.shoulder()


def recorded(
    rig: pamrs.Rig, role: str, seed: int, *, force: float = 0.0, seconds: float = 8.0
) -> Recording:
    """Some seconds of a shoulder at 200 Hz; with an angle that lies by a wave of so many rad,
    which no effect makes.
    """
    turn = 2 * np.pi * np.arange(0.0, seconds, 0.005)
    command = {"valve_command": 5.0 + 0.5 * np.sin(0.2 * turn + seed) + 0.25 * np.sin(0.7 * turn)}
    one = driven(rig, f"r{seed}", role, 0.005, command, SHOULDER, [seed])
    angle = one.channels["joint_angle"]
    lies = {"joint_angle": angle + force * np.sin(24.0 * angle + 0.3)}
    return replace(one, channels=one.channels | lies)


def found_in(true: pamrs.Rig, **options: float) -> pamrs.Diagnosis:
    """What the nominal shoulder lacks of recordings of another."""
    return diagnosed(RIG, partial(recorded, true, **options))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "factor"), [("chamber.dead_volume", 2.4), ("arm.payload", 0.75)])
def test_a_wrong_value_is_named_with_an_interval_that_holds_it(name: str, factor: float) -> None:
    true = RIG.parameter(name).value * factor
    records = [recorded(RIG.with_parameters({name: true}), role, k) for k, role in enumerate(ROLES)]
    found = pamrs.diagnose(pamrs.Case("case", RIG, records, Path()), consider=[name])
    assert found.verdict == "parameters"
    (asked,) = found.considered
    # what a model is usually off by covers the rest: no block has a mismatch to be left
    assert asked.left is None or asked.left < 0.05
    assert asked.probability == pytest.approx(
        max(b.probabilities.get(name, 0.0) for b in found.blocks), abs=1e-6
    )
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == name
    assert wrong["nominal"] == RIG.parameter(name).value
    assert wrong["interval"][0] < true < wrong["interval"][1]
    # the model holds the value, and predicts held-out recordings with it
    assert found.rig.parameter(name).value == pytest.approx(true, rel=0.05)
    assert all(error["after"] < error["before"] for error in wrong["held_out"].values())
    assert found.effects == []
    assert found.probabilities[name] > 0.8
    # the excess is the wrong value's, not that of parameters that bend inside their tolerances
    (share,) = (t.share for t in found.budget if t.id == name and t.block == wrong["block"])
    assert share > 0.85
    assert name.replace(".", " ").replace("_", " ") in found.headline
    assert found.text.startswith("The rig file is wrong")
    kept(found)


def test_a_value_inside_its_tolerance_is_not_called_wrong() -> None:
    found = found_in(RIG.with_parameters({"chamber.dead_volume": 1.5e-4 + 2.0 * 2.25e-5}))
    assert found.verdict == "parameters"
    assert found.wrong_parameters == []


@pytest.mark.slow
def test_a_name_in_the_chamber_stands_beside_an_arm_without_one() -> None:
    true = RIG.with_effect("valve_dead_zone", {"half_width": 0.05})
    # five times what an encoder is usually off by
    found = found_in(true, force=2e-2, seconds=12.0)
    assert found.verdict == "effects"
    assert [e["id"] for e in found.effects] == ["valve_dead_zone"]
    assert found.effects[0]["probability"] > 0.8
    assert found.where["block"] == "chamber"
    gas, arm = found.blocks
    assert (gas.blocks, gas.verdict) == (["supply", "chamber"], "effects")
    assert (arm.blocks, arm.verdict, arm.effects) == (["arm"], "unlisted", [])
    chamber = next(m for m in gas["mismatch"] if m["block"] == "chamber")
    assert chamber["held_out"]["refit"]["noises"] > 3.0 * chamber["held_out"]["after"]["noises"]
    kept = found.unexplained[0]
    assert (kept["block"], kept["unit"], kept["verdict"]) == ("arm", "rad", "unlisted")
    assert 1e-2 < kept["size"] < 2.5e-2  # of an encoder that is off by 20 mrad
    assert found.headline.index("dead zone") < found.headline.index("in the arm")
    assert "the residual of the arm" in found.summary().replace("\n", " ").replace("  ", " ")


def test_pairs_of_one_mistake_are_suspected_with_either_at_its_wall() -> None:
    true = RIG.with_parameters({"arm.payload": 0.7 * 9.07})
    problem = problem_of(RIG, [recorded(true, "fit", 1, seconds=12.0)], "arm")
    no_inflation = {"arm": 1.0}
    baseline = fit(problem, RIG, (), {}, no_inflation, evaluations=20)
    found = suspected_values(baseline, problem.blocks)
    assert ("arm.payload",) in found
    assert ("arm.payload", "arm.first_moment") in found
    assert all(abs(baseline.moved[name]) <= 3.0 + 1e-9 for name in baseline.moved)
    more = {"freed": ["arm.payload"], "warm": baseline, "evaluations": 30, "share": 1e-5}
    loose = fit(problem, RIG, (), {}, no_inflation, **more)
    assert loose.freed == ("arm.payload",)
    assert loose.moved["arm.payload"] < -10.0
    assert loose.values["arm.payload"] == pytest.approx(0.7 * 9.07, rel=0.03)
    assert "arm.payload" not in loose.held_by_prior
    assert loose.cost < 0.2 * baseline.cost


@pytest.mark.slow
def test_a_dead_time_of_the_command_leads_a_late_clock() -> None:
    """A clock without a drift would leave the same recordings, and is rarer."""

    def late(role: str, seed: int) -> Recording:
        turn = 2 * np.pi * np.arange(0.0, 12.0, 0.005)
        wave = 0.5 * np.sin(0.2 * turn + seed) + 0.4 * np.sign(np.sin(0.35 * turn + 2 * seed))
        acts = {"valve_command": 5.0 + np.concatenate([np.zeros(5), wave[:-5]])}
        one = driven(RIG, f"r{seed}", role, 0.005, acts, SHOULDER, [seed])
        return replace(one, channels=one.channels | {"valve_command": 5.0 + wave})

    found = diagnosed(RIG, late)
    assert found.verdict == "effects"
    assert found.probabilities["input_path_lag"] > found.probabilities["clock_skew"] > 0.0
    told = {e["id"]: (e["form"], e["parameters"]) for e in found.effects}
    form, parameters = told["input_path_lag"]
    assert form == "dead_time"
    assert parameters["delay"]["value"] == pytest.approx(0.025, abs=5e-4)


@pytest.mark.slow
def test_a_zero_that_two_groups_share_is_named_once() -> None:
    found = found_in(RIG.with_parameters({"sensors.pressure_zero": 4500.0}))
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "sensors.pressure_zero"
    assert wrong["interval"][0] < 4500.0 < wrong["interval"][1]
    # table of parameters, model and name agree
    assert (
        found.parameters["sensors.pressure_zero"]["value"]
        == wrong["value"]
        == found.rig.parameter("sensors.pressure_zero").value
    )


def test_every_parameter_at_its_wall_is_freed_whatever_the_gain_of_pairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pairs = [
        ("arm.payload", "arm.first_moment"),
        ("arm.inertia", "arm.first_moment"),
        ("chamber.dead_volume", "valve.discharge_area_max"),
    ]
    gains = dict.fromkeys(pairs, 1e6) | {("muscle.modulus_scale",): 50.0, ("arm.viscous",): 3.0}
    monkeypatch.setattr(wrong_parameters, "suspected_values", lambda *_: list(gains))
    monkeypatch.setattr(wrong_parameters, "_predicted_gain", lambda *_: gains)
    asked: list[tuple[str, ...]] = []

    class Trial:
        settings, nominal, no_inflation = SETTINGS, RIG, {}
        fit_problem = Problem([], [], core_rig(RIG), SETTINGS)

        def fit_freed(self, names: tuple[str, ...], baseline: object, share: object) -> None:
            asked.append(names)

    assert wrong_parameters.free_suspects(Trial(), None, None, lambda text: None) == []  # type: ignore[arg-type]
    # two pairs at the most, the one parameter with a predicted gain beyond a file that is wrong by
    # chance, and not the other
    assert asked == [*pairs[:2], ("muscle.modulus_scale",)]


def test_a_parameter_beside_another_has_to_take_a_share_of_its_own() -> None:
    def left(misfit: float) -> FittedHypothesis:
        return cast("FittedHypothesis", SimpleNamespace(misfit=misfit))

    attempts = cast("Attempts", SimpleNamespace(settings=SETTINGS))
    share = FURTHER_SHARE
    short = {("a",): left(100.0), ("b",): left(300.0), ("a", "b"): left(101.0 * (1.0 - share))}
    assert _needless(("a", "b"), short, attempts)
    assert not _needless(("a", "b"), short | {("a", "b"): left(99.0 * (1.0 - share))}, attempts)
    assert not _needless(("a",), short, attempts)
    assert not _needless(("b", "c"), short | {("b", "c"): left(100.0)}, attempts)
