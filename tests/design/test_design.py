"""Joint design: the objective, and what a search finds."""

import math
import tomllib

import numpy as np
import pytest
from scipy.integrate import quad

from pamrs import Joint, ParameterError, library
from pamrs.design import (
    LENGTHS,
    JointDesign,
    JointProblem,
    least_pressure,
    optimise,
)
from pamrs.design._problem import _areas
from tests.scripts import script
from tests.simulation.refusals import refused
from tests.tables import rows_of

INCH = 0.0254
GOOD = [0.0145, 0.0204, 0.0282, -0.0085]
TABLE = np.array([1.00, 1.08, 1.08, 0.19]) * INCH


def problem(**changes):
    values = {
        "muscle": library.pam_a_1in(),
        "count": 6,
        "torque": 1000.0,
        "min_angle": math.radians(15.0),
        "max_angle": math.radians(120.0),
        "pressure": 1.6e6,
    }
    return JointProblem(**{**values, **changes})


# --------------------------------------------------------------------- objective


@pytest.mark.parametrize("torque", [700.0, 1000.0, 1300.0])
@pytest.mark.parametrize("lengths", [GOOD, [0.03, 0.03, 0.02, 0.0]])
def test_objective_is_the_slow_integral(torque, lengths):
    task = problem(torque=torque, points=421)
    joint = Joint(rest_angle=task.min_angle, **dict(zip(LENGTHS, lengths, strict=True)))

    def gap(angle, sign):
        return max(
            sign * (float(joint.torque(task.muscle, task.pressure, angle, count=6)) - torque), 0.0
        )

    below, above = (
        quad(gap, task.min_angle, task.max_angle, (sign,), limit=400)[0] for sign in (-1.0, 1.0)
    )
    scores = task.evaluate(lengths)
    assert scores.area_below[0] == pytest.approx(below, abs=2e-5 * task.required_area)
    assert scores.area_above[0] == pytest.approx(above, abs=2e-5 * task.required_area)
    stroke = joint.shortening(task.angles).max()
    penalty = 0.0 if stroke <= 0.15 * 0.276 else 1e4
    assert scores.fitness[0] == pytest.approx(
        below + 0.01 * above + penalty, abs=1e-4 * task.required_area
    )


def test_areas_are_cut_where_the_line_crosses():
    below, above = _areas(
        np.array([0.0, 1.0, 3.0]), np.array([[-1.0, 3.0, 3.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]])
    )
    assert below == pytest.approx([0.125, 0.25 + 1.0, 0.0])
    assert above == pytest.approx([1.125 + 6.0, 0.25, 0.0])


def test_a_dead_centre_ends_the_range():
    task = problem()
    dead = [0.02, 0.0, 0.03, -0.02]
    arm = task.joint(dead).moment_arm(task.angles)
    assert arm[0] < 0.0 < arm[-1]
    assert task.evaluate(dead).max_angle[0] == task.min_angle
    assert not task.evaluate(dead).available[0]


def test_the_penalty_begins_at_the_largest_stroke():
    task = problem()
    stroke = problem().joint(GOOD).shortening(task.max_angle)
    contraction = float(stroke) / 0.276
    inside, outside = (
        task.replace(max_contraction=contraction * factor).evaluate(GOOD)
        for factor in (1.0001, 0.9999)
    )
    assert inside.available[0]
    assert inside.max_angle[0] == pytest.approx(task.max_angle)
    assert not outside.available[0]
    assert outside.max_angle[0] < task.max_angle
    assert outside.fitness[0] - inside.fitness[0] == pytest.approx(1e4, rel=1e-9)


def test_many_designs_at_once_are_the_same_as_one_by_one():
    task = problem(points=31)
    designs = task.lower + (task.upper - task.lower) * np.random.default_rng(1).random((40, 4))
    together = task.evaluate(designs)
    for row, design in enumerate(designs):
        alone = task.evaluate(design)
        assert alone.fitness[0] == pytest.approx(together.fitness[row], rel=1e-12)
        assert alone.torque[0] == pytest.approx(together.torque[row], rel=1e-12)


def test_designs_out_of_reach_are_penalised_and_finite():
    task = problem(max_angle=math.radians(170.0))
    short = np.array([0.001, 0.02, 0.02, 0.08])
    with pytest.raises(ParameterError, match="folded"):
        task.joint(short)
    designs = np.array(
        [short, [0.0127, 0.0635, 0.0127, 0.0], [0.5, 0.5, 0.5, 0.5], [0.05, 0.0, 0.05, 0.05]]
    )
    scores = task.evaluate(designs)
    for name in ("fitness", "area_below", "area_above", "torque", "max_angle"):
        assert np.all(np.isfinite(getattr(scores, name))), name
    assert np.all(scores.fitness >= 1e4)
    assert not np.any(scores.available)
    assert np.all(task.needed_pressure(designs) >= 1e10)
    assert np.all(np.isfinite(task.size(designs)))
    folding = {"upper_axial": (0.001, 0.003), "lower_offset": (0.04, 0.09)}
    assert not JointDesign.of(task, short).met()
    assert np.isfinite(optimise(task.replace(bounds=folding), evaluations=60).scores.fitness[0])


def test_a_muscle_that_cannot_pull_is_slack():
    task = problem(pressure=5e3)
    scores = task.evaluate(GOOD)
    assert float(task.muscle.force(5e3, scores.contraction[0, -1])) < 0.0
    assert scores.torque[0, -1] == 0.0
    assert scores.area_below[0] <= task.required_area


def test_needed_pressure_is_where_the_torque_just_suffices():
    task = problem()
    needed = float(task.needed_pressure(GOOD)[0])
    assert task.replace(pressure=needed).evaluate(GOOD).torque.min() == pytest.approx(
        task.torque, rel=1e-9
    )
    assert JointDesign.of(task.replace(pressure=1.001 * needed), GOOD).met(1e-9)
    assert JointDesign.of(task, TABLE).needed_pressure is None  # beyond 15 % of stroke


def test_met_within_a_tolerance_is_not_called_met():
    task = problem()
    needed = float(task.needed_pressure(GOOD)[0])
    low = JointDesign.of(task.replace(pressure=0.99 * needed), GOOD)
    torque = low.scores.torque[0]
    short, angle = low.shortfall
    assert low.met()
    assert short == pytest.approx(1.0 - torque.min() / task.torque)
    assert angle == task.angles[int(np.argmin(torque))]
    words = (
        f"met within 0.1 % of the work wanted; least torque {100 * short:.2g} % below the wanted "
        f"one at {math.degrees(angle):.4g} deg"
    )
    assert words in low.summary()
    assert "the requirement is met" not in low.summary()
    told = {"met": True, "area_tolerance": 1e-3, "shortfall": short, "shortfall_angle": angle}
    assert told.items() <= low.to_dict().items()
    enough = JointDesign.of(task.replace(pressure=needed), GOOD)
    assert enough.shortfall[0] == 0.0
    assert "the requirement is met" in enough.summary()


def test_a_design_keeps_its_tolerance():
    task = problem(pressure=0.99 * float(problem().needed_pressure(GOOD)[0]))
    strict, loose = (
        JointDesign(task, np.array(GOOD), area_tolerance=value) for value in (0.0, 0.05)
    )
    assert (strict.met(), loose.met(), strict.met(0.05)) == (False, True, True)
    assert (strict.to_dict()["met"], loose.to_dict()["met"]) == (False, True)
    assert "THE REQUIREMENT IS NOT MET" in strict.summary()
    assert "met within 5 % of the work wanted" in loose.summary()
    with pytest.raises(ParameterError, match="area_tolerance"):
        JointDesign(task, np.array(GOOD), area_tolerance=-1.0)


def test_no_joint_gets_more_work_out_of_a_stroke_than_the_muscle_gives():
    task = problem()
    designs = task.lower + (task.upper - task.lower) * np.random.default_rng(2).random((500, 4))
    needed = task.needed_pressure(designs)
    assert np.sum(needed < 1e10) > 20
    assert np.all(needed >= task.least_possible_pressure())
    # the area below the threshold is at least the work that is missing
    low = task.replace(pressure=1.2e6)
    stroke = np.linspace(0.0, low.max_stroke, 4001)
    work = 6 * np.trapezoid(low.muscle.force(low.pressure, stroke / 0.276), stroke)
    scores = low.evaluate(designs)
    assert work < low.required_area
    assert scores.area_below[scores.available].min() >= low.required_area - work - 1e-3
    # a joint whose arm fits the muscle at every angle needs just this: the work of the muscle is
    # the work wanted
    force = 6 * task.muscle.force(task.least_possible_pressure(), stroke / 0.276)
    assert np.trapezoid(force, stroke) == pytest.approx(task.required_area, rel=1e-6)


def test_the_published_joint_law_gives_less_torque():
    assert np.all(problem(kind="published").evaluate(GOOD).torque < problem().evaluate(GOOD).torque)


def test_impossible_problems_are_named():
    for changes, word in rows_of(__file__, "impossible_problems_are_named"):
        refused((word, lambda changes=changes: problem(**changes)))


@pytest.mark.parametrize(
    "designs", [[0.1, 0.2], [[math.nan, 0.1, 0.1, 0.1]], [-0.1, 0.1, 0.1, 0.1]]
)
def test_impossible_designs_are_named(designs):
    with pytest.raises(ParameterError):
        problem().evaluate(designs)


# ---------------------------------------------------------------------- searches


def test_a_long_tendon_on_a_constant_force_is_a_pulley():
    # muscle ends far away, force nearly constant over a short range: torque = F (arm), arm is about
    # the lower link's lever
    far = {"upper_axial": (2.0, 2.0), "lower_axial": (0.001, 0.05)}
    far |= {"upper_offset": (0.0, 0.0), "lower_offset": (0.0, 0.0)}
    angles = {"min_angle": math.radians(80.0), "max_angle": math.radians(84.0)}
    task = problem(**angles, torque=400.0, points=11, bounds=far)
    found = optimise(task, evaluations=300)
    lever = task.torque / (6.0 * float(task.muscle.force(task.pressure, 0.0)))
    assert found.lengths[2] == pytest.approx(lever, rel=0.03)
    assert found.met(2e-3)


# ---------------------------------------------------------------- pressure, size


def test_bounds_that_cannot_reach_the_range_give_a_result_too():
    far = {"lower_axial": (0.2, 0.21), "upper_axial": (0.2, 0.21)}
    task = problem(points=22, bounds=far)
    design = optimise(task, evaluations=100)
    assert not design.scores.available[0]
    assert "up to" in design.summary()
    assert least_pressure(task, evaluations=200) is None


def test_a_search_repeats_by_its_seed_and_counts_what_it_tries():
    task, told = problem(points=22), []
    one, same, other = (
        optimise(task, evaluations=90, seed=seed, progress=lambda *at: told.append(at))
        for seed in (7, 7, 8)
    )
    assert np.array_equal(one.lengths, same.lengths)
    assert not np.array_equal(one.lengths, other.lengths)
    assert one.evaluations == one.to_dict()["evaluations"] == 100
    assert told[:5] == [(20 * k, 100) for k in range(1, 6)]
    for name, value in {"evaluations": 19, "seed": -1}.items():
        with pytest.raises(ParameterError, match=name):
            optimise(task, **{name: value})


def test_more_torque_and_less_room_need_more_pressure():
    tasks = [problem(points=22, torque=torque) for torque in (600.0, 900.0, 1200.0)]
    found = [least_pressure(task, evaluations=1000) for task in tasks]
    pressures = [design.problem.pressure for design in found]
    assert pressures[0] < pressures[1] < pressures[2]
    for task, design in zip(tasks, found, strict=True):
        assert task.least_possible_pressure() < design.problem.pressure
        assert design.met(1e-9)
    room = [0.053, 0.045, 0.037]
    small = [least_pressure(problem(points=22), largest_size=size) for size in room]
    assert all(design.size <= size for design, size in zip(small, room, strict=True))
    assert np.all(np.diff([design.problem.pressure for design in small]) > 0.0)
    refused(("largest_size", lambda: least_pressure(problem(), largest_size=0.0)))


def test_size_holds_both_ends_of_the_tendon():
    task = problem()
    stroke = task.joint(GOOD).shortening(task.angles).max()
    assert task.size(GOOD)[0] == pytest.approx(
        max(math.hypot(GOOD[0] + stroke, GOOD[1]), math.hypot(GOOD[2], GOOD[3]))
    )


# -------------------------------------------------------------------------- package


def test_a_design_round_trips_as_a_joint():
    design = JointDesign.of(problem(), GOOD)
    block = tomllib.loads(design.to_toml())["joint"]
    assert [block[name]["value"] for name in LENGTHS] == pytest.approx(GOOD)
    assert block["max_angle"] == {"value": pytest.approx(120.0), "unit": "deg"}
    assert design.evaluations == 0


def test_friction_plays_no_part():
    muscle = library.ch2_075in()
    assert muscle.parameters["friction_coefficient"] > 0.0
    plain = muscle.replace(
        friction_coefficient=0.0, friction_pressure_slope=0.0, friction_floor=0.0
    )
    values = [problem(muscle=item, points=22).evaluate(GOOD).fitness[0] for item in (muscle, plain)]
    assert values[0] == values[1]


def test_the_package_is_light():
    heavy = {"scipy", "matplotlib"}
    begin = "import sys, pamrs.design, pamrs.cli.design; "
    assert script(f"{begin}print(*({heavy} & set(sys.modules)))") == []
