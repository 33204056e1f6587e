"""Whatever has a tolerance moves in a fit, noise of drives weighs as noise, and joints begin at
rest: what healthy rigs were given names for.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.evidence import autocorrelation_of
from pamrs.diagnosis.fit import Problem, fit, free_baseline, residuals
from pamrs.diagnosis.noise import noise_levels
from pamrs.diagnosis.prepare import Prepared, begun_alike, predicted, residual
from pamrs.simulation import core_rig
from tests.diagnosis.asked import problem_of
from tests.diagnosis.healthy import healthy_case

SHAPES = ["muscle.flexor.rest_length", "transmission.extensor.radius"]


def judged(case: pamrs.Case, kind: str) -> Problem:
    """The blocks of a kind over the recordings of a case to fit."""
    every = problem_of(case.rig, [r for r in case.recordings if r.role == "fit"])
    return replace(every, blocks=[b for b in every.blocks if b.kind == kind])


@pytest.fixture(scope="module")
def pair() -> Problem:
    return judged(healthy_case("antagonistic_joint", 3, 100, sharp=False), "arm")


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
    own = autocorrelation_of(pair, found, {})["arm.elbow"]
    known = autocorrelation_of(pair, found, levels)["arm.elbow"]
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
        found = begun_alike([block], problem.core, prepared, tolerances)
        starts = found.starts(block.window, block.drives)
        return bool(found.at_rest), float(found.begun("joint_angle", starts)[1][0])

    first, second = (begun(prepared) for prepared in problem.recordings)
    assert first == (True, 0.0)
    assert not second[0]
    assert abs(second[1]) < math.radians(1.0)
