"""Whatever has a tolerance moves in a fit, noise of drives weighs as noise, and joints begin at
rest: what healthy rigs were given names for.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pamrs
from pamrs.diagnosis.fit import Problem, fit, free_baseline, residuals
from pamrs.diagnosis.fit._fitting import Scaling
from pamrs.diagnosis.fit._known_parameters import (
    in_tolerances,
    largest_value,
    moved_slope,
    moved_value,
)
from pamrs.diagnosis.noise import inflation_of, noise_levels
from pamrs.diagnosis.prepare import Prepared, predicted, residual, with_unjudged_starts
from pamrs.rig import Parameter
from pamrs.simulation import core_rig
from tests.diagnosis.asked import SETTINGS, problem_of
from tests.diagnosis.healthy import healthy_case

SHAPES = ["muscle.flexor.rest_length", "transmission.extensor.radius"]


def judged(case: pamrs.Case, kind: str) -> Problem:
    """The blocks of a kind over the recordings of a case to fit."""
    every = problem_of(case.rig, [r for r in case.recordings if r.role == "fit"])
    return replace(every, blocks=[b for b in every.blocks if b.kind == kind])


@pytest.fixture(scope="module")
def pair() -> Problem:
    return judged(healthy_case("antagonistic_joint", 3, 100, sharp=False), "arm")


def test_no_effect_is_larger_than_its_rig_allows() -> None:
    """No friction pulls more than its muscle, no reading drifts by more than a tenth of it."""
    rig = pamrs.rigs.hanging_mass()
    pressure = max(rig.limits["max_pressure"], rig.tables("supply")[""]["initial_pressure"])
    assert rig.muscle is not None
    pull = float(rig.muscle.force(pressure, 0.0))
    most = {
        "muscle_hysteresis.friction_constant": min(pull, 1e4),
        "muscle_hysteresis.friction_pressure": pull / pressure,
        "gauge_drift.change": 0.1 * pressure,
    }
    assert {name: largest_value(rig, name) for name in most} == pytest.approx(most)
    far = dict.fromkeys(most, 1e9)
    scaling = Scaling(rig, [], far, SETTINGS)
    found = [scaling.value(name, x) for name, x in zip(most, scaling.start, strict=True)]
    assert found == pytest.approx(list(most.values()))
    assert scaling.value("gauge_drift.change", -1e9) == pytest.approx(-most["gauge_drift.change"])


def test_every_tolerance_of_an_arm_is_free(pair: Problem) -> None:
    rig = pamrs.rigs.antagonistic_joint()
    given = [
        name
        for name, known in rig.parameters.items()
        if 0.0 < known.tol < math.inf
        and name.partition(".")[0] in ("muscle", "transmission", "joint", "arm")
    ]
    assert set(SHAPES) < set(given) <= set(free_baseline(pair, rig))


@pytest.mark.parametrize("name", SHAPES)
def test_sensitivities_to_a_shape_are_those_of_two_simulations(pair: Problem, name: str) -> None:
    rig = pamrs.rigs.antagonistic_joint()
    known = rig.parameters[name]
    told = residuals(pair, rig, [name, "arm.viscous"])
    step = 0.05 * known.tol
    low, high = (
        core_rig(rig.with_parameters({name: known.value + way * step})) for way in (-1.0, 1.0)
    )
    block = pair.blocks[0]
    for prepared in pair.recordings:
        found = told[block.name, prepared.recording.name]
        assert found.jacobian is not None
        moved = predicted(block, high, prepared) - predicted(block, low, prepared)
        apart = found.freed(moved) / (2.0 * step)
        size = float(np.linalg.norm(apart))
        assert size * known.tol > 10.0 * found.noise  # it is seen
        assert np.linalg.norm(found.jacobian[:, 0] - apart) < 0.05 * size


def test_a_fit_that_follows_the_noise_of_a_drive_weighs_no_more(pair: Problem) -> None:
    rig = pamrs.rigs.antagonistic_joint()
    found = fit(pair, rig, (), {}, {"arm.elbow": 1.0})
    levels = noise_levels(pair, core_rig(found.rig))
    own = inflation_of(pair, found, {})["arm.elbow"]
    known = inflation_of(pair, found, levels)["arm.elbow"]
    assert known == pytest.approx(max(own, np.mean([v.inflation for v in levels.values()])))
    assert known > 1.5 * own > 15.0  # white noise of the angle alone would be 1


def test_a_joint_on_its_stop_begins_at_rest_whatever_its_first_samples_say() -> None:
    """Noise gave it -14 deg/s, so that it bounced: a torque from outside with 0.80."""
    case = healthy_case("elbow", 1, 200, sharp=True)
    problem = judged(case, "arm")
    tolerances = {n: p.tol for n, p in case.rig.parameters.items() if 0.0 < p.tol < math.inf}

    def begun(prepared: Prepared) -> tuple[bool, float]:
        block = problem.blocks[0]
        residual(block, problem.core, prepared, [])  # keeps the starts that it finds
        found = with_unjudged_starts([block], problem.core, prepared, tolerances)
        starts = found.starts(block.window, block.drives)
        return bool(found.at_rest), float(found.with_starts("joint_angle", starts)[1][0])

    first, second = (begun(prepared) for prepared in problem.recordings)
    assert first == (True, 0.0)
    assert not second[0]
    assert abs(second[1]) < math.radians(1.0)


@given(
    value=st.floats(1e-3, 1e3),
    share=st.floats(0.01, 2.0),
    far=st.floats(-8.0, 8.0),
    zero=st.booleans(),
)
def test_a_distance_in_tolerances_is_that_of_its_value(
    value: float, share: float, far: float, zero: bool
) -> None:
    """Below its value a positive quantity moves by factors; what may be negative moves straight."""
    known = Parameter("a.b", value, "1", share * value, -math.inf if zero else 0.0, math.inf)
    moved = moved_value(known, far)
    straight = value + far * known.tol
    assert moved == pytest.approx(straight if zero or far > 0.0 else value * math.exp(far * share))
    least = -math.inf if zero else -math.log(1e3) / share
    assert in_tolerances(known, moved) == pytest.approx(max(far, least), abs=1e-6)
    near = moved_value(known, far + 1e-6), moved_value(known, far - 1e-6)
    if abs(far) > 1e-5:
        slope = (near[0] - near[1]) / 2e-6
        assert moved_slope(known, far) == pytest.approx(slope, rel=1e-3)
