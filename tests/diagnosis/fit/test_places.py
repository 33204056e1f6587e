"""Effects at one of several blocks of a kind: what they are called, where they act, and a pair of
muscles of which one leaks.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.diagnosis.evidence import FittedHypothesis, Prior, posterior
from pamrs.diagnosis.fit import Problem, acts_in, places_of, residuals, starts_of
from pamrs.diagnosis.next_experiment import measurable
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import available_blocks
from pamrs.diagnosis.search import Attempts
from pamrs.effects import CATALOGUE, Term, find_parameter
from pamrs.findings import BlockVerdict, Part
from pamrs.recordings import Recording
from pamrs.report.sentences import headline, told_apart
from pamrs.report.words import label
from pamrs.simulation import core_rig
from tests.diagnosis import again, likelihoods, synthetic
from tests.diagnosis.asked import SETTINGS, diagnosed, problem_of
from tests.diagnosis.kept import kept
from tests.diagnosis.noisy import driven
from tests.diagnosis.stands import antagonists
from tests.diagnosis.terms import by_text, terms

PAIR = pamrs.rigs.antagonistic_joint()
LEAK = 2e-11


def recorded(rig: pamrs.Rig, role: str, seed: int, rows: int = 1600) -> Recording:
    """The pair with an angle that is read roughly."""
    return antagonists(rig, role, seed, rows, 3e-3)


TUBE = pamrs.rigs.named("tube")
#: Gauge pressures [Pa] on the left and on the right, and what leaks on the left.
BEGINS = ((6e5, 1e5), (2e5, 5e5), (5e5, 2e5))
LOSS = 2e-9


def over(rig: pamrs.Rig) -> pamrs.Case:
    """Two chambers even out through a tube, five seconds at 50 Hz: two recordings to fit and one
    held out.
    """
    found = []
    names = ("muscle_pressure.left", "muscle_pressure.right")
    for k, ((name, role), begin) in enumerate(zip(again.ROLES, BEGINS, strict=True)):
        start = dict(zip(names, begin, strict=True))
        given = {"duration": 5.0, "initial": start}
        noise = dict.fromkeys(names, 400.0)
        found.append(driven(rig, name, role, 0.02, {}, noise, [11, k], **given))
        found[-1].units.update(dict.fromkeys(names, "Pa"))
    return pamrs.Case("tube", TUBE, found, Path())


def blocks_of(rig: pamrs.Rig, *without: str):
    """The blocks of a rig of which all is measured, but for some channels."""
    return available_blocks(rig, [name for name in measurable(rig) if name not in without])


def test_one_block_of_each_kind_leaves_every_effect_as_it_was() -> None:
    shoulder = pamrs.rigs.shoulder()
    assert not any(places_of(shoulder, effect, blocks_of(shoulder)) for effect in CATALOGUE)


def test_an_effect_can_be_at_each_block_that_the_channels_tell_from_the_others() -> None:
    blocks = blocks_of(PAIR)
    both = ["flexor", "extensor"]
    for effect in ("leak_muscle", "valve_dead_zone", "muscle_hysteresis", "pressure_lag"):
        assert places_of(PAIR, effect, blocks) == both
    # one tank, one joint, the whole rig, and what happens at times of its own
    for effect in ("supply_leak", "joint_end_stop", "clock_skew", "external_torque"):
        assert places_of(PAIR, effect, blocks) == []
    # with one gauge alone a leak everywhere is a leak there
    assert places_of(PAIR, "leak_muscle", blocks_of(PAIR, "muscle_pressure.extensor")) == []
    two = pamrs.rigs.named("two_joint_arm")
    assert places_of(two, "joint_coulomb_stribeck", blocks_of(two)) == ["elbow", "wrist"]


@pytest.mark.parametrize(
    ("term", "acting"),
    [
        ("leak_muscle", {"chamber.flexor", "chamber.extensor"}),
        ("leak_muscle@flexor", {"chamber.flexor"}),
        ("valve_dead_zone@extensor", {"supply", "chamber.extensor"}),
        ("muscle_hysteresis@flexor", {"arm.elbow"}),
        ("pressure_lag@flexor", {"chamber.flexor", "arm.elbow"}),
    ],
)
def test_an_effect_at_one_place_acts_in_the_blocks_that_depend_on_it(term, acting) -> None:
    assert {b.name for b in blocks_of(PAIR) if acts_in(Term.parse(term), b)} == acting


def test_names_with_a_place() -> None:
    everywhere, flexor, extensor = terms(
        "leak_muscle", "leak_muscle@flexor", "leak_muscle@extensor"
    )
    assert everywhere == Term("leak_muscle")
    assert flexor.info is everywhere.info
    one, other = (find_parameter(f"leak_muscle{at}.conductance") for at in ("", "@flexor"))
    assert one is other
    assert everywhere.excluded_by([flexor])
    assert flexor.excluded_by([everywhere])
    assert flexor.excluded_by([flexor])
    assert not flexor.excluded_by([extensor, Term("valve_area")])
    both = label("leak_muscle@flexor+valve_area")
    assert both == f"{label('leak_muscle')} at flexor + valve area"
    left = tuple(((name,), float("nan")) for name in ("leak_muscle", "leak_muscle@flexor"))
    told = told_apart(Part(BlockVerdict([], "effects", {}, [], [], []), None, left, False, False))
    assert "at every chamber from" in told
    assert told.endswith("at flexor")


def test_sensitivities_are_those_of_the_effect_at_its_place() -> None:
    """Against a finite difference, for one instance of an effect and for two."""
    problem = problem_of(PAIR, [recorded(PAIR, "fit", 0, 400)])
    here, there = (
        starts_of(Term("leak_muscle", at), sealed=False)[0] for at in ("flexor", "extensor")
    )
    name, step = "leak_muscle@flexor.conductance", 1e-13

    for begun in (PAIR, there.applied(PAIR)):
        rig = here.applied(begun)
        entry = next(e for e in rig.effects if e["at"] == "flexor")
        more = rig.with_effect(
            "leak_muscle", {"conductance": entry["parameters"]["conductance"] + step}, at="flexor"
        )
        found = residuals(problem, rig, [name])
        moved = residuals(problem, more, [name])
        own = found["chamber.flexor", "r0"]
        slope = (moved["chamber.flexor", "r0"].prediction - own.prediction) / step
        assert own.jacobian is not None
        assert np.abs(slope).max() > 0.0
        # without what a window's start can do in its place
        expected = own.freed(slope)
        np.testing.assert_allclose(own.jacobian[:, 0], expected, atol=2e-2 * np.abs(expected).max())
        assert not np.any(found["chamber.extensor", "r0"].jacobian)


def made_up(term: str, left: float, places: int) -> FittedHypothesis:
    """A hypothesis that leaves such a ratio of either chamber, fitted and held out."""
    effects = terms(term) if term else ()
    rig = PAIR
    for effect in effects:
        rig = rig.with_effect(effect.id, at=effect.at)
    values = {f"{effect}.{effect.info.leading.name}": 1e-11 for effect in effects}
    spread = {name: 0.1 * value for name, value in values.items()}
    covariance = np.diag([std**2 for std in spread.values()])
    left_of = Excess(left, left**0.5, 0.0, 1.0, 1.0, 1.1, 0.02)
    kept = {b.name: left_of for b in blocks_of(PAIR) if b.kind == "chamber"}
    found = likelihoods.made_up(rig, term, kept, values, std=spread, covariance=covariance)
    return replace(found, log_places=math.log(places))


def weighed(*found: FittedHypothesis) -> dict[str, float]:
    chambers = [b for b in blocks_of(PAIR) if b.kind == "chamber"]
    return by_text(
        posterior([made_up("", 40.0, 1), *found], chambers, Prior(0.985, 30.0, SETTINGS))
    )


def test_an_effect_at_many_places_is_no_more_probable_for_it() -> None:
    blocks = blocks_of(PAIR)
    problem = Problem(blocks, [], core_rig(PAIR), SETTINGS)
    attempts = Attempts(problem, problem, PAIR, {}, {}, blocks)
    names = ["leak_muscle", "leak_muscle@flexor", "leak_muscle@extensor"]
    assert attempts.terms_of("leak_muscle") == list(terms(*names))
    assert attempts.terms_of("supply_leak") == [Term("supply_leak")]
    rival = made_up("valve_area", 3.0, 1)
    alone = weighed(made_up("leak_muscle", 3.0, 1), rival)
    shared = weighed(*(made_up(name, 3.0, len(names)) for name in names), rival)
    assert [shared[name] for name in names] == pytest.approx([alone["leak_muscle"] / 3.0] * 3)
    assert shared["valve_area"] == pytest.approx(alone["valve_area"])


def test_places_are_told_apart_by_what_they_leave_inside_the_noise() -> None:
    rival = made_up("valve_area", 1.0, 1)
    even = weighed(*(made_up(f"leak_muscle{at}", 0.9, 2) for at in ("", "@flexor")), rival)
    better = weighed(made_up("leak_muscle", 0.9, 2), made_up("leak_muscle@flexor", 0.3, 2), rival)
    assert even["leak_muscle"] == pytest.approx(even["leak_muscle@flexor"])
    assert better["leak_muscle@flexor"] > 10.0 * better["leak_muscle"]


def test_only_the_place_is_open() -> None:
    chances = {"leak_muscle@flexor": 0.5, "leak_muscle": 0.4, "unlisted": 0.1}
    sets = [[key] for key in chances]
    block = BlockVerdict(["chamber.flexor"], "effects", chances, ["leak_muscle@flexor"], [], sets)
    given = synthetic.diagnosis(effects=[], blocks=[block])
    assert headline(given) == (
        "Something acts in the chamber of flexor that the model leaves out: muscle leak at flexor "
        "(0.50), muscle leak (0.40) or effect outside the catalogue (0.10)"
    )


def is_named(found: pamrs.Diagnosis, at: str, size: float) -> None:
    """That a leak is named with its place and its size."""
    assert found.verdict == "effects"
    (effect,) = found.effects
    assert (effect.id, effect.at) == ("leak_muscle", at)
    assert effect.probability > 0.7
    assert max(found.probabilities, key=found.probabilities.__getitem__) == effect.term
    low, high = effect.parameters["conductance"].interval
    assert low < size < high
    assert high - low < size
    steps = [t for t in found.budget if t.kind == "effect"]
    assert [(t.block, t.id, t.at) for t in steps] == [(f"chamber.{at}", "leak_muscle", at)]
    assert steps[0].share > 0.8


@pytest.fixture(scope="module")
def leaking() -> pamrs.Diagnosis:
    return pamrs.diagnose(over(TUBE.with_effect("leak_muscle", {"conductance": LOSS}, at="left")))


def test_a_leak_of_one_of_two_chambers_is_named_with_its_place(leaking) -> None:
    is_named(leaking, "left", LOSS)


@pytest.mark.slow
def test_a_leak_of_one_muscle_of_a_pair_is_named_and_a_right_channel_stays_right() -> None:
    """Groups share the zeros of gauges: the arm keeps the ones that were settled before."""
    leak = {"conductance": LEAK}
    found = diagnosed(PAIR, partial(recorded, PAIR.with_effect("leak_muscle", leak, at="flexor")))
    is_named(found, "flexor", LEAK)
    angle = found.fit.held_out["joint_angle.elbow"]
    assert angle.after < 1.3 * angle.refit


def test_its_place_is_said_in_text_page_and_json(leaking, tmp_path) -> None:
    said = f"{Term('leak_muscle').info.name} at left"
    assert "leaves out a leak: muscle leak at left (" in headline(leaking)
    assert said in leaking.text
    assert said in leaking.report(tmp_path / "report.html").read_text(encoding="utf-8").lower()
    told = kept(leaking)
    assert told["effects"][0]["at"] == "left"


def test_the_model_has_it_there_and_is_replayed(leaking, tmp_path) -> None:
    again.written(over(leaking.rig), tmp_path / "case")
    model = leaking.rig.with_case("case").to_toml(tmp_path / "model.toml")
    assert 'at = "left"' in model.read_text(encoding="utf-8")
    (entry,) = pamrs.load_rig(model).effects
    assert (entry["id"], entry["at"]) == ("leak_muscle", "left")
    assert pamrs.load_rig(model).effect_std["leak_muscle"]["conductance"] > 0.0
    assert cli.main(["replay", str(model), "--recording", "slow"]) == 0


def test_beside_what_the_model_has_there_nothing_is_missing(leaking) -> None:
    found = pamrs.diagnose(over(leaking.rig), rig=leaking.rig)
    assert found.verdict in ("none", "parameters")
    assert "leak_muscle at left" in found.warnings[0]
