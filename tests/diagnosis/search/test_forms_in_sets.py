"""Sets are fitted until the weights are those of what they leave, and each of their effects has the
form that leaves least beside the others; of several groups the one that knows an effect best says
its values.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

import pamrs
from pamrs.diagnosis.evidence import FittedHypothesis, Prior, significant
from pamrs.diagnosis.fit import fit, form_in, starts_of
from pamrs.diagnosis.model import owners_of_effects
from pamrs.diagnosis.screen import screen
from pamrs.diagnosis.search import Attempts
from pamrs.diagnosis.search._sets import _STRONG_RATIO, Search, far_above_noise, in_best_forms
from pamrs.effects import Term
from tests.diagnosis.again import case
from tests.diagnosis.asked import SETTINGS, problem_of
from tests.diagnosis.held import RIG, attempts_at
from tests.diagnosis.terms import terms

SHOULDER = pamrs.rigs.shoulder()
LEAKY = RIG.with_effect("leak_muscle", {"conductance": 5e-12, "exponent": 1.6}, form="power")


@pytest.fixture(scope="module")
def attempts() -> Attempts:
    """A chamber with a leak in its second form, held from three pressures, the last one held
    out.
    """
    return attempts_at(LEAKY, (8e5, 5e5, 3e5), 60.0)


def hurried(attempts: Attempts, evaluations: int) -> FittedHypothesis:
    """A leak in its first form and the heat of the wall, fitted in so many evaluations."""
    starts = [starts_of(effect, sealed=True)[0] for effect in terms("leak_muscle", "heat_transfer")]
    free = {name: value for start in starts for name, value in start.free.items()}
    fixed = {name: value for start in starts for name, value in start.fixed.items()}
    effects = tuple(start.effect for start in starts)
    found = fit(
        attempts.fit_problem,
        RIG,
        effects,
        free,
        attempts.no_inflation,
        fixed=fixed,
        evaluations=evaluations,
    )
    return attempts.assess(effects, found)


def test_a_set_ends_weighted_by_what_it_leaves(attempts: Attempts) -> None:
    begun = hurried(attempts, 1)
    ended = attempts.polish(begun)
    first, last = attempts.inflation_of(begun.fit), attempts.inflation_of(ended.fit)
    for block, left in last.items():
        assert first[block] > 10.0 * left  # it left far more where it began
        assert ended.fit.inflation[block] <= 2.0 * left


def test_an_effect_gets_the_form_that_leaves_least_beside_the_others(attempts: Attempts) -> None:
    base = hurried(attempts, 20)
    assert any(significant(kept) for kept in base.fit_excess.values())
    start = fit(attempts.fit_problem, RIG, (), {}, attempts.no_inflation)
    both = list(terms("leak_muscle", "heat_transfer"))
    screened = screen(attempts.fit_problem, start, both, attempts.no_inflation, sealed=True)
    told: list[str] = []
    search = Search(attempts, screened, base, Prior(0.985, 60.0, SETTINGS), told.append)
    found = in_best_forms(search, base)
    assert told[0] == "trying other forms of leak_muscle in leak_muscle+heat_transfer"
    assert form_in(found.fit.rig, Term("leak_muscle")) == "power"
    assert found.misfit < base.misfit
    assert found.fit.values["leak_muscle.exponent"] == pytest.approx(1.6, abs=0.1)


def test_what_is_far_above_the_noise_is_so_by_its_size_or_its_power(attempts: Attempts) -> None:
    base = hurried(attempts, 20)
    (block,) = attempts.suspects
    strong = _STRONG_RATIO

    def left(ratio: float, systematic: float) -> FittedHypothesis:
        kept = replace(base.fit_excess[block.name], ratio=ratio, systematic=systematic)
        return replace(base, fit_excess={block.name: kept}, held_out_excess={block.name: kept})

    assert not far_above_noise(attempts, left(0.9 * strong, 0.9 * math.sqrt(strong)))
    assert far_above_noise(attempts, left(1.1 * strong, 1.0))
    assert far_above_noise(attempts, left(1.0, 1.1 * math.sqrt(strong)))


def group(std: dict[str, float], *effects: str) -> FittedHypothesis:
    """A fit that knows its parameters so well."""
    own = SimpleNamespace(values=dict.fromkeys(std, 1.0), std=std)
    return cast("FittedHypothesis", SimpleNamespace(fit=own, effects=terms(*effects)))


def test_the_group_that_knows_an_effect_best_has_its_values() -> None:
    chamber = group({"clock_skew.offset": 2e-3, "clock_skew.rate": 1e-4}, "clock_skew")
    arm = group({"clock_skew.offset": math.inf, "clock_skew.rate": math.inf}, "clock_skew")
    vague = group({"clock_skew.offset": 0.1, "clock_skew.rate": 1e-2}, "clock_skew")
    assert owners_of_effects([chamber, arm]) == {Term("clock_skew"): 0}
    assert owners_of_effects([arm, chamber]) == {Term("clock_skew"): 1}
    assert owners_of_effects([vague, chamber, vague]) == {Term("clock_skew"): 1}


def test_what_no_residual_depends_on_is_not_known() -> None:
    problem = problem_of(SHOULDER, case(SHOULDER, SHOULDER).recordings[:1], "arm")
    # pressure and angle of one logger: the arm does not see when they were recorded
    free = {"clock_skew.offset": 0.01, "clock_skew.rate": 1e-4}
    fixed = {"clock_skew.angle_share": 1.0}
    given = (problem, SHOULDER, terms("clock_skew"), free, {"arm": 1.0})
    found = fit(*given, fixed=fixed, evaluations=2)
    assert math.isinf(found.std["clock_skew.offset"])
    assert math.isinf(found.std["clock_skew.rate"])
    assert all(math.isfinite(found.std[name]) for name in found.moved)
