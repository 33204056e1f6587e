"""Fitting moduli to force maps: recovery, standard errors, prediction, handing on."""

import json
import math
import sys

import numpy as np
import pytest

from pamrs import load_rig, rigs
from pamrs.errors import MissingPackageError, ParameterError
from pamrs.fit import FitError, fit_muscle
from pamrs.rig import Rig
from tests.fit.cases import (
    CONTRACTIONS,
    OFFSETS,
    PRESSURES,
    SLOPES,
    TOLERANCE,
    grid,
    joined,
    mapped,
    measure,
    muscle,
    remade,
    truth,
)


def stderr(fit):
    return [item.stderr for item in fit.params.values()]


def without(level, count=6):
    """All levels but one."""
    return [index for index in range(count) if index != level]


# ------------------------------------------------------------------------ recovery


@pytest.mark.parametrize("model", ["gaylord", "chou_hannaford", "mooney_rivlin", "elbow_linear"])
def test_constants_of_every_model_come_back(model):
    real = muscle(model)
    fit = fit_muscle(measure(real), real)
    np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-9)
    assert fit.max_error < 1e-11
    assert fit.order is None
    if fit.nvarys:  # free at each level, they are the same at all
        _, values, _ = fit_muscle(measure(real), real, moduli="per_level").moduli()
        np.testing.assert_allclose(values - values[0], 0.0, atol=1e-4)


@pytest.mark.parametrize("model", ["ferraresi", "kothera", "robinson"])
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_slopes_and_offsets_come_back_to_rounding(model, order):
    real = muscle(model, order)
    fit = fit_muscle(measure(real), real)
    assert fit.order == order
    assert list(fit.params) == [f"{letter}{k}" for letter in "mb" for k in range(1, order + 1)]
    np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-13 * fit.condition_number * 100)
    forces = (muscle.force(4e5, CONTRACTIONS) for muscle in (fit.muscle, real))
    np.testing.assert_allclose(*forces, rtol=1e-9, atol=1e-9)
    assert fit.rsquared == pytest.approx(1.0, abs=1e-12)


def test_modulus_scale_stays_a_factor():
    real = muscle(modulus_scale=0.5)
    fit = fit_muscle(measure(real), real)
    np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-10)


def test_another_model_and_order_can_be_asked_for():
    fit = fit_muscle(measure(muscle("robinson")), muscle("gaylord"), model="robinson", order=3)
    assert (fit.model, fit.geometry, fit.order) == ("robinson", "elliptic", 3)
    np.testing.assert_allclose(fit.x, [2.5, -1.2, 0.0, 9e5, -2.1e5, 0.0], rtol=1e-8, atol=1e-3)


def test_plain_standard_errors_cover_as_they_should():
    real = muscle()
    inside = []
    for seed in range(120):
        fit = fit_muscle(measure(real, noise=4.0, seed=seed), real, errors="plain")
        inside.append(np.abs(fit.x - truth(real, fit)) < stderr(fit))
    assert 0.62 < np.mean(inside) < 0.74  # 0.683 for a normal distribution


def test_standard_errors_by_level_see_errors_that_a_level_shares():
    real = muscle(order=1)
    pressures = np.linspace(1e5, 8e5, 15)
    found, plain, level = [], [], []
    for seed in range(60):
        data = measure(real, pressures=pressures, noise=1.0, seed=seed)
        # rubber that creeps between levels
        stiffer = 0.1 * np.random.default_rng(1000 + seed).standard_normal(15)[data.level]
        at = data.pressure, data.contraction
        elastic = real.force(*at) - real.replace(modulus_scale=0.0).force(*at)
        fit = fit_muscle(remade(data, force=data.force + stiffer * elastic), real)
        assert fit.errors == "level"
        found.append(fit.x)
        plain.append([item.stderr_plain for item in fit.params.values()])
        level.append(stderr(fit))
    spread = np.std(found, axis=0)
    np.testing.assert_allclose(np.mean(level, axis=0), spread, rtol=0.25)
    assert np.all(np.mean(plain, axis=0) < 0.6 * spread)


def test_level_errors_are_the_jackknife_of_explicit_refits():
    real = muscle(order=1)
    data = measure(real, noise=4.0, seed=5)
    fit = fit_muscle(data, real)
    parts = np.array([fit_muscle(data, real, levels=without(gone)).x - fit.x for gone in range(6)])
    np.testing.assert_allclose(fit.covar, (1.0 - 1.0 / 6) * parts.T @ parts, rtol=1e-7)


# ---------------------------------------------------------------------- per level


def test_per_level_moduli_lie_on_the_line_when_the_truth_is_a_line():
    real = muscle("robinson")
    data = measure(real)
    fit = fit_muscle(data, real, moduli="per_level")
    levels, values, spread = fit.moduli()
    np.testing.assert_allclose(values, np.outer(levels, SLOPES[:2]) + OFFSETS[:2], rtol=1e-8)
    assert spread.shape == values.shape
    e = np.array([0.05, 0.2])
    for found in (fit.predict(2.7e5, e), fit.muscle_at(2.7e5).force(2.7e5, e)):
        np.testing.assert_allclose(found, real.force(2.7e5, e), rtol=1e-9)
    assert list(fit.params)[:3] == ["E1_100kPa", "E2_100kPa", "E1_200kPa"]


def test_names_tell_the_pressure_of_each_level_apart():
    real = muscle(order=1)
    p, e = grid([2e5, 2.0004e5, 343.75e3], CONTRACTIONS)
    data = mapped(p, e, real.force(p, e), level_tolerance=10.0)
    every = fit_muscle(data, real, moduli="per_level").params
    assert list(every) == ["E1_200kPa", "E1_200.04kPa", "E1_343.75kPa"]
    some = fit_muscle(data, real, moduli="per_level", levels=[0, 2]).params
    assert list(some) == ["E1_200kPa", "E1_343.8kPa"]


def test_moduli_of_a_linear_fit_have_the_error_of_the_line():
    real = muscle(order=1)
    fit = fit_muscle(measure(real, noise=3.0), real)
    levels, values, spread = fit.moduli()
    gradients = np.column_stack([levels, np.ones_like(levels)])
    np.testing.assert_allclose(values[:, 0], gradients @ fit.x, rtol=1e-12)
    variance = np.einsum("li,ij,lj->l", gradients, fit.covar, gradients)
    np.testing.assert_allclose(spread[:, 0], np.sqrt(variance))


def test_per_level_does_not_go_beyond_its_levels():
    fit = fit_muscle(measure(muscle()), muscle(), moduli="per_level")
    with pytest.raises(ParameterError, match="900 kPa.*known from 100 to 800 kPa"):
        fit.predict(9e5, 0.1)
    with pytest.raises(FitError, match=r"muscle_at\(pressure\)"):
        _ = fit.muscle
    with pytest.raises(FitError, match=r"muscle_at\(pressure\)"):
        fit.to_rig()


def test_a_level_has_its_own_moduli_whatever_the_other_levels_say():
    real = muscle()
    nominal, contraction = grid(PRESSURES, CONTRACTIONS)
    # a regulator holds no level exactly
    pressure = nominal + np.random.default_rng(0).uniform(-1e3, 1e3, len(nominal))
    force = real.force(pressure, contraction)

    def moduli(other):
        changed = np.where(nominal == PRESSURES[0], force, other * force)
        data = mapped(pressure, contraction, changed)
        return fit_muscle(data, real, moduli="per_level").moduli()[1]

    np.testing.assert_allclose(moduli(1.5)[0], moduli(1.0)[0], rtol=1e-9)
    assert moduli(1.0)[0, 0] == pytest.approx(SLOPES[0] * PRESSURES[0] + OFFSETS[0], rel=0.01)


# ------------------------------------------------------------------ subset, errors


def test_some_levels_predict_the_others():
    real = muscle("robinson", 4)
    data = measure(real, noise=2.0)
    fit = fit_muscle(data, real, levels=[0, 2, 5])
    assert fit.ndata == 33
    assert int(fit.fitted.sum()) == 33
    rms, worst = fit.errors_of("held_out")
    by_hand = np.abs(data.force - fit.muscle.force(data.pressure, data.contraction))[~fit.fitted]
    assert worst == pytest.approx(by_hand.max() / data.force.max())
    assert rms == pytest.approx(math.sqrt(np.mean(by_hand**2)) / data.force.max())
    assert fit.max_error == max(worst, fit.errors_of("fitted")[1])
    assert fit.error_by_pressure().fitted.tolist() == [True, False, True, False, False, True]
    np.testing.assert_array_equal(fit_muscle(data, real, levels=[1e5, 3.5e5, 8e5]).x, fit.x)


def test_error_by_pressure_is_2_37():
    real = muscle()
    data = measure(real, noise=5.0)
    fit = fit_muscle(data, real)
    errors = fit.error_by_pressure()
    for k, pressure in enumerate(PRESSURES):
        rows = data.pressure == pressure
        model = fit.predict(data.pressure[rows], data.contraction[rows])
        share = (data.force[rows] - model) / data.force[rows].max()
        assert errors.rms[k] == pytest.approx(math.sqrt(np.mean(share**2)))
        assert errors.max[k] == pytest.approx(np.abs(share).max())
    assert fit.errors_of("held_out") is None


@pytest.mark.parametrize("force", [0.0, -1.0, 0.5])
def test_a_level_that_does_not_pull_is_no_scale_and_no_obstacle(force):
    pull = force * np.cos(np.arange(len(CONTRACTIONS)))
    rest = mapped(0.0 * pull, CONTRACTIONS, pull)
    data = joined(measure(muscle(), noise=2.0), rest)
    others = [1, 2, 3, 4, 5, 6]
    for levels in (None, others):
        fit = fit_muscle(data, muscle(), levels=levels)
        errors = fit.error_by_pressure()
        assert errors.levels.tolist() == PRESSURES.tolist()
        assert errors.weak.tolist() == [0.0]
        assert "0 kPa: not in this table" in fit.fit_report()
        cross = fit.leave_one_pressure_out()
        assert cross.by_pressure.weak.tolist() == ([0.0] if levels is None else [])
        assert math.isfinite(cross.rms)
        assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["weak_levels"] == [0.0]
    weighed = fit_muscle(data, muscle(), weights="level", levels=others)
    assert weighed.errors_of("held_out")[0] < 1.0
    message = r"weights = 'level' .* at 0 kPa \(.* N\): leave these levels out"
    with pytest.raises(FitError, match=message):
        fit_muscle(data, muscle(), weights="level")


def test_weights_by_level_minimise_2_37():
    real = muscle(order=3)
    data = measure(real, noise=8.0, seed=2)
    plain, level = (fit_muscle(data, real, order=2, weights=by) for by in ("force", "level"))
    squares = [np.sum(fit.error_by_pressure().rms ** 2) for fit in (plain, level)]
    assert squares[1] < squares[0]
    assert np.sum(level.all_residuals**2) > plain.chisqr


def test_one_pressure_left_out_equals_refits():
    real = muscle()
    data = measure(real, noise=5.0, seed=1)
    cross = fit_muscle(data, real).leave_one_pressure_out()
    expected = np.empty(len(data))
    for gone in range(len(PRESSURES)):
        own = data.level == gone
        other = fit_muscle(data, real, levels=without(gone))
        expected[own] = data.force[own] - other.predict(data.pressure[own], data.contraction[own])
    np.testing.assert_allclose(cross.residual, expected, rtol=1e-8, atol=1e-9)
    top = data.force.max()
    ends = np.isin(data.level, [0, 5])
    assert cross.rms == pytest.approx(math.sqrt(np.mean(expected**2)) / top)
    assert cross.max == pytest.approx(np.abs(expected).max() / top)
    assert cross.end_rms == pytest.approx(math.sqrt(np.mean(expected[ends] ** 2)) / top)
    assert cross.interior_max == pytest.approx(np.abs(expected[~ends]).max() / top)
    assert cross.rms > fit_muscle(data, real).rms_error
    assert cross.rms_stderr > 0.0


def test_one_pressure_left_out_with_moduli_per_level():
    real = muscle()
    cross = fit_muscle(measure(real), real, moduli="per_level").leave_one_pressure_out()
    assert cross.max < 1e-9  # straight lines through and beyond the levels: the truth is one


def test_leaving_out_needs_levels_to_spare():
    data = measure(muscle(), pressures=[2e5, 6e5])
    with pytest.raises(FitError, match="^without 200 kPa the other levels do not determine"):
        fit_muscle(data, muscle()).leave_one_pressure_out()
    alone = fit_muscle(measure(muscle(), pressures=[2e5]), muscle(), moduli="per_level")
    with pytest.raises(FitError, match="two pressure levels at least are needed to predict one"):
        alone.leave_one_pressure_out()


# -------------------------------------------------------------------- direction


def test_friction_of_the_muscle_goes_with_the_direction():
    real = muscle(friction_coefficient=0.16, friction_pressure_slope=-0.145e-6, friction_floor=0.01)
    for way in (-1, 1):
        data = measure(real, direction=way)
        fit = fit_muscle(data, real)
        np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-8)
        for found in (fit.best_fit, fit.predict(data.pressure, data.contraction, direction=way)):
            np.testing.assert_allclose(found, data.force, rtol=1e-9, atol=1e-6)
        assert fit.score() == pytest.approx(1.0)
        assert fit_muscle(data, real, direction=None).max_error > 1e-3


def test_elbow_model_has_a_branch_for_lengthening():
    real = muscle("elbow_linear")

    def modulus(data, **options):
        return fit_muscle(data, real, **options).params["bladder_modulus"].value

    down, up = (measure(real, direction=way) for way in (-1, 1))
    assert [modulus(down), modulus(up)] == pytest.approx([8e5, 8e5], rel=1e-8)
    assert modulus(up, direction=None) != pytest.approx(8e5, rel=1e-3)
    both = joined(up, measure(real))  # unknown directions are on the contraction branch
    assert fit_muscle(both, real).max_error < 1e-9


# -------------------------------------------------------------------- prediction


def test_prediction_says_where_it_extrapolates():
    fit = fit_muscle(measure(muscle()), muscle())
    assert fit.outside([3e5, 9e5, 3e5, 9e5], [0.1, 0.1, 0.27, 0.27]).tolist() == [0, 1, 2, 3]
    assert fit.outside(3e5, length=[0.19, 0.21]).tolist() == [0, 2]
    np.testing.assert_allclose(fit.predict(3e5, length=0.18), fit.predict(3e5, 0.1))


def test_prediction_refuses_what_is_not_possible():
    fit = fit_muscle(measure(muscle()), muscle())
    with pytest.raises(ParameterError, match="contraction or length"):
        fit.predict(3e5)
    with pytest.raises(ParameterError, match="pressure = nan is not allowed"):
        fit.predict(math.nan, 0.1)
    with pytest.raises(ParameterError):
        fit.predict(3e5, 0.9)


def test_score_of_another_map():
    real = muscle()
    fit = fit_muscle(measure(real, noise=3.0), real)
    assert 0.999 < fit.score(measure(real, noise=3.0, seed=9)) < 1.0
    assert fit.score(measure(muscle(modulus_scale=3.0))) < fit.score()


# -------------------------------------------------------------------- handing on


def shoulder_map(real):
    """Forces of a muscle of the shoulder."""
    e, p = grid(np.linspace(0.0, 0.25, 9), PRESSURES)
    return mapped(p, e, real.force(p, e), rest=0.276)


def test_fit_becomes_a_rig_that_keeps_what_the_fit_did_not_change():
    shoulder = rigs.shoulder()
    real = shoulder.muscle
    data = shoulder_map(real)
    rig = fit_muscle(data, real, order=2).to_rig(shoulder)
    assert rig.blocks == shoulder.blocks
    assert rig.model["muscle"]["count"] == 6
    at = data.pressure, data.contraction
    np.testing.assert_allclose(rig.muscle.force(*at), real.force(*at), rtol=1e-7, atol=1e-6)
    volume = "chamber.dead_volume"
    assert rig.parameter(volume).tol == shoulder.parameter(volume).tol
    other = 0.5 * real.parameters["friction_coefficient"] + 0.01
    tolerances = {"muscle.braid_angle": 0.02, "muscle.friction_coefficient": 0.03}
    told = Rig(shoulder.name, shoulder.model, tolerances)
    rig = fit_muscle(data, real.replace(friction_coefficient=other), order=2).to_rig(told)
    assert [rig.parameter(name).tol for name in tolerances] == [0.02, 0.0]


def test_fit_becomes_a_bench_with_tolerances(tmp_path):
    real = muscle("robinson")
    free = {"free": ["braid_angle"], "tolerance": TOLERANCE}
    fit = fit_muscle(measure(real, noise=2.0), real, **free)
    rig = load_rig(fit.to_rig().to_toml(tmp_path / "bench.toml"))
    given, found = rig.parameter("muscle.braid_angle"), fit.params["braid_angle"]
    assert (given.value, given.tol) == (found.value, found.stderr)
    np.testing.assert_allclose(rig.muscle.force(3e5, 0.1), fit.predict(3e5, 0.1), rtol=1e-12)


def test_report_and_dictionary_hold_the_numbers():
    data, free = measure(muscle(), noise=3.0), {"free": ["braid_angle"], "tolerance": TOLERANCE}
    fit = fit_muscle(data, muscle(), levels=[0, 1, 4, 5], **free)
    text = fit.fit_report()
    words = ("kothera, order 2", "m1", "braid_angle", "nominal 1.2217", "independent")
    assert all(word in text for word in (*words, "not fitted", "levels not fitted"))
    plain = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    assert [item["name"] for item in plain["parameters"]] == list(fit.params)
    assert plain["held_out_max_error"] == fit.errors_of("held_out")[1]
    assert (fit.ndata, fit.nvarys, fit.nfree) == (44, 5, 39)
    assert fit.aic < fit.aicc < fit.bic
    assert "order 2" in repr(fit)


def test_the_report_says_what_its_numbers_are_of():
    data = measure(muscle(), noise=3.0)
    fit = fit_muscle(data, muscle())
    text = fit.fit_report()
    rms = math.sqrt(fit.chisqr / fit.ndata)
    for words in (
        f"chi2 {fit.chisqr:.4g} N2, residual rms {rms:.4g} N\n",
        "with all 66 points as independent: AIC",
        "of the map's largest force: rms",
        "force error of each level, of the largest force of that level:",
    ):
        assert words in text
    assert "reduced" not in text
    known = fit_muscle(data, muscle(), noise=3.0)
    reduced = f"reduced chi2 {known.chisqr / 9.0 / known.nfree:.4g}"
    assert f"{reduced} with the stated noise of 3 N" in known.fit_report()
    level = fit_muscle(data, muscle(), weights="level", noise=0.01).fit_report()
    assert "N2" not in level
    assert "with the stated noise of 1 % of the level's largest force" in level


def test_a_fit_is_handed_on_to_lmfit():
    lmfit = pytest.importorskip("lmfit")
    fit = fit_muscle(measure(muscle(), noise=3.0), muscle())
    found = fit.to_lmfit()
    assert isinstance(found, lmfit.Parameters)
    assert list(found) == list(fit.params)
    for name, item in fit.params.items():
        assert (found[name].value, found[name].stderr) == (item.value, item.stderr)
        assert found[name].user_data["unit"] == item.unit
    first, second, *_ = fit.params
    expected = fit.covar[0, 1] / np.prod(stderr(fit)[:2])
    assert found[first].correl[second] == pytest.approx(expected)
    assert abs(expected) < 1.0
    assert str(lmfit.fit_report(found)).count("+/-") == len(found)
    assert lmfit.Parameters().loads(found.dumps())[first].value == found[first].value


def test_a_missing_lmfit_is_named(monkeypatch):
    fit = fit_muscle(measure(muscle()), muscle())
    monkeypatch.setitem(sys.modules, "lmfit", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'pamrs\[lmfit\]'"):
        fit.to_lmfit()
