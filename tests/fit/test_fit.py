"""Fitting moduli to force maps: recovery, standard errors, prediction, handing on."""

import json
import math

import numpy as np
import pytest

from pamrs import rigs
from pamrs.errors import ParameterError
from pamrs.fit import FitError, ForceMap, fit_muscle
from pamrs.rig import Rig
from tests.fit.cases import (
    CONTRACTIONS,
    OFFSETS,
    PRESSURES,
    REST,
    SLOPES,
    TOLERANCE,
    measure,
    muscle,
    truth,
)

# ------------------------------------------------------------------------ recovery


@pytest.mark.parametrize("model", ["gaylord", "chou_hannaford", "mooney_rivlin", "elbow_linear"])
def test_constants_of_every_model_come_back(model):
    real = muscle(model)
    fit = fit_muscle(measure(real), real)
    np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-9)
    assert fit.max_error < 1e-11
    assert fit.order is None


@pytest.mark.parametrize("model", ["ferraresi", "kothera", "robinson"])
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_slopes_and_offsets_come_back_to_rounding(model, order):
    real = muscle(model, order)
    fit = fit_muscle(measure(real), real)
    assert fit.order == order
    assert list(fit.params) == [f"{letter}{k}" for letter in "mb" for k in range(1, order + 1)]
    np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-13 * fit.condition_number * 100)
    np.testing.assert_allclose(
        fit.muscle.force(4e5, CONTRACTIONS), real.force(4e5, CONTRACTIONS), rtol=1e-9, atol=1e-9
    )
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
        inside.append(
            np.abs(fit.x - truth(real, fit)) < [item.stderr for item in fit.params.values()]
        )
    share = np.mean(inside)
    assert 0.62 < share < 0.74  # 0.683 for a normal distribution


def test_standard_errors_by_level_see_errors_that_a_level_shares():
    real = muscle(order=1)
    pressures = np.linspace(1e5, 8e5, 15)
    found, plain, level = [], [], []
    for seed in range(60):
        data = measure(real, pressures=pressures, noise=1.0, seed=seed)
        stiffer = (
            0.1 * np.random.default_rng(1000 + seed).standard_normal(15)[data.level]
        )  # rubber that creeps between levels
        elastic = real.force(data.pressure, data.contraction) - real.replace(
            modulus_scale=0.0
        ).force(data.pressure, data.contraction)
        crept = ForceMap.from_arrays(
            length=data.length,
            pressure=data.pressure,
            force=data.force + stiffer * elastic,
            rest_length=REST,
        )
        fit = fit_muscle(crept, real)
        assert fit.errors == "level"
        found.append(fit.x)
        plain.append([item.stderr_plain for item in fit.params.values()])
        level.append([item.stderr for item in fit.params.values()])
    spread = np.std(found, axis=0)
    np.testing.assert_allclose(np.mean(level, axis=0), spread, rtol=0.25)
    assert np.all(np.mean(plain, axis=0) < 0.6 * spread)


def test_level_errors_are_the_jackknife_of_explicit_refits():
    real = muscle(order=1)
    data = measure(real, noise=4.0, seed=5)
    fit = fit_muscle(data, real)
    count = len(data.levels)
    parts = [
        fit_muscle(data, real, levels=[i for i in range(count) if i != gone]).x - fit.x
        for gone in range(count)
    ]
    expected = (1.0 - 1.0 / count) * np.array(parts).T @ np.array(parts)
    np.testing.assert_allclose(fit.covar, expected, rtol=1e-7)


# ---------------------------------------------------------------------- per level


def test_per_level_moduli_lie_on_the_line_when_the_truth_is_a_line():
    real = muscle("robinson")
    data = measure(real)
    fit = fit_muscle(data, real, moduli="per_level")
    levels, values, stderr = fit.moduli()
    np.testing.assert_allclose(values, np.outer(levels, SLOPES[:2]) + OFFSETS[:2], rtol=1e-8)
    assert stderr.shape == values.shape
    np.testing.assert_allclose(
        fit.predict(2.7e5, [0.05, 0.2]), real.force(2.7e5, [0.05, 0.2]), rtol=1e-9
    )
    np.testing.assert_allclose(
        fit.muscle_at(2.7e5).force(2.7e5, 0.1), real.force(2.7e5, 0.1), rtol=1e-9
    )
    assert list(fit.params)[:3] == ["E1_100kPa", "E2_100kPa", "E1_200kPa"]


def test_names_tell_the_pressure_of_each_level_apart():
    real = muscle(order=1)
    p, e = (
        grid.ravel() for grid in np.meshgrid([2e5, 2.0004e5, 343.75e3], CONTRACTIONS, indexing="ij")
    )
    data = ForceMap.from_arrays(
        length=REST * (1.0 - e),
        pressure=p,
        force=real.force(p, e),
        rest_length=REST,
        level_tolerance=10.0,
    )
    assert list(fit_muscle(data, real, moduli="per_level").params) == [
        "E1_200kPa",
        "E1_200.04kPa",
        "E1_343.75kPa",
    ]
    assert list(fit_muscle(data, real, moduli="per_level", levels=[0, 2]).params) == [
        "E1_200kPa",
        "E1_343.8kPa",
    ]


def test_moduli_of_a_linear_fit_have_the_error_of_the_line():
    real = muscle(order=1)
    fit = fit_muscle(measure(real, noise=3.0), real)
    levels, values, stderr = fit.moduli()
    np.testing.assert_allclose(
        values[:, 0], fit.params["m1"].value * levels + fit.params["b1"].value, rtol=1e-12
    )
    for level, spread in zip(levels, stderr[:, 0], strict=True):
        gradient = np.array([level, 1.0])
        assert spread == pytest.approx(math.sqrt(gradient @ fit.covar @ gradient))


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
    nominal = np.repeat(PRESSURES, len(CONTRACTIONS))
    pressure = nominal + np.random.default_rng(0).uniform(
        -1e3, 1e3, len(nominal)
    )  # a regulator holds no level exactly
    contraction = np.tile(CONTRACTIONS, len(PRESSURES))
    force = real.force(pressure, contraction)

    def moduli(other):
        changed = np.where(nominal == PRESSURES[0], force, other * force)
        data = ForceMap.from_arrays(
            length=REST * (1.0 - contraction), pressure=pressure, force=changed, rest_length=REST
        )
        return fit_muscle(data, real, moduli="per_level").moduli()[1]

    np.testing.assert_allclose(moduli(1.5)[0], moduli(1.0)[0], rtol=1e-9)
    assert moduli(1.0)[0, 0] == pytest.approx(SLOPES[0] * PRESSURES[0] + OFFSETS[0], rel=0.01)


@pytest.mark.parametrize("model", ["mooney_rivlin", "elbow_linear"])
def test_constants_can_be_free_at_each_level(model):
    real = muscle(model)
    fit = fit_muscle(measure(real), real, moduli="per_level")
    _, values, _ = fit.moduli()
    np.testing.assert_allclose(values - values[0], 0.0, atol=1e-4)


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
        share = (
            data.force[rows] - fit.predict(data.pressure[rows], data.contraction[rows])
        ) / data.force[rows].max()
        assert errors.rms[k] == pytest.approx(math.sqrt(np.mean(share**2)))
        assert errors.max[k] == pytest.approx(np.abs(share).max())
    assert fit.errors_of("held_out") is None


def with_level_at_zero(force):
    """A map whose first level, at 0 Pa, has a force of this size."""
    data = measure(muscle(), noise=2.0)
    length = REST * (1.0 - CONTRACTIONS)
    pull = force * np.cos(np.arange(len(length)))
    return ForceMap.from_arrays(
        length=np.append(data.length, length),
        pressure=np.append(data.pressure, np.zeros(len(length))),
        force=np.append(data.force, pull),
        rest_length=REST,
    )


@pytest.mark.parametrize("force", [0.0, -1.0, 0.5])
def test_a_level_that_does_not_pull_is_no_scale_and_no_obstacle(force):
    data = with_level_at_zero(force)
    for levels in (None, [1, 2, 3, 4, 5, 6]):
        fit = fit_muscle(data, muscle(), levels=levels)
        errors = fit.error_by_pressure()
        assert errors.levels.tolist() == PRESSURES.tolist()
        assert errors.weak.tolist() == [0.0]
        assert "0 kPa: not in this table" in fit.fit_report()
        cross = fit.leave_one_pressure_out()
        assert cross.by_pressure.weak.tolist() == ([0.0] if levels is None else [])
        assert math.isfinite(cross.rms)
        assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["weak_levels"] == [0.0]
    assert (
        fit_muscle(data, muscle(), weights="level", levels=[1, 2, 3, 4, 5, 6]).errors_of(
            "held_out"
        )[0]
        < 1.0
    )
    with pytest.raises(
        FitError, match=r"weights = 'level' .* at 0 kPa \(.* N\): leave these levels out"
    ):
        fit_muscle(data, muscle(), weights="level")


def test_weights_by_level_minimise_2_37():
    real = muscle(order=3)
    data = measure(real, noise=8.0, seed=2)
    plain, level = (
        fit_muscle(data, real, order=2, weights=weights) for weights in ("force", "level")
    )

    def total(fit):
        return np.sum(fit.error_by_pressure().rms ** 2)

    assert total(level) < total(plain)
    assert np.sum(level.all_residuals**2) > plain.chisqr


def test_one_pressure_left_out_equals_refits():
    real = muscle()
    data = measure(real, noise=5.0, seed=1)
    cross = fit_muscle(data, real).leave_one_pressure_out()
    expected = np.empty(len(data))
    for gone in range(len(PRESSURES)):
        own = data.level == gone
        other = fit_muscle(data, real, levels=[k for k in range(len(PRESSURES)) if k != gone])
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
    with pytest.raises(
        FitError, match="two pressure levels at least are needed to predict one from the others"
    ):
        fit_muscle(
            measure(muscle(), pressures=[2e5]), muscle(), moduli="per_level"
        ).leave_one_pressure_out()


# -------------------------------------------------------------------- direction


def test_friction_of_the_muscle_goes_with_the_direction():
    real = muscle(friction_coefficient=0.16, friction_pressure_slope=-0.145e-6, friction_floor=0.01)
    for way in (-1, 1):
        data = measure(real, direction=way)
        fit = fit_muscle(data, real)
        np.testing.assert_allclose(fit.x, truth(real, fit), rtol=1e-8)
        np.testing.assert_allclose(fit.best_fit, data.force, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(
            fit.predict(data.pressure, data.contraction, direction=way),
            data.force,
            rtol=1e-9,
            atol=1e-6,
        )
        assert fit.score() == pytest.approx(1.0)
        assert fit_muscle(data, real, direction=None).max_error > 1e-3


def test_elbow_model_has_a_branch_for_lengthening():
    real = muscle("elbow_linear")
    for way in (-1, 1):
        fit = fit_muscle(measure(real, direction=way), real)
        assert fit.params["bladder_modulus"].value == pytest.approx(8e5, rel=1e-8)
    up, unknown = measure(real, direction=1), measure(real)
    both = ForceMap.from_arrays(
        length=np.append(up.length, unknown.length),
        pressure=np.append(up.pressure, unknown.pressure),
        force=np.append(up.force, unknown.force),
        rest_length=REST,
        direction=np.append(up.direction, unknown.direction),
    )
    assert (
        fit_muscle(both, real).max_error < 1e-9
    )  # unknown directions are on the contraction branch
    assert fit_muscle(up, real, direction=None).params["bladder_modulus"].value != pytest.approx(
        8e5, rel=1e-3
    )


# -------------------------------------------------------------------- prediction


def test_prediction_says_where_it_extrapolates():
    fit = fit_muscle(measure(muscle()), muscle())
    assert fit.outside([3e5, 9e5, 3e5, 9e5], [0.1, 0.1, 0.27, 0.27]).tolist() == [0, 1, 2, 3]
    assert fit.outside(3e5, length=[0.19, 0.21]).tolist() == [0, 2]
    np.testing.assert_allclose(fit.predict(3e5, length=0.18), fit.predict(3e5, 0.1))


def test_predicted_spread_is_that_of_repeated_fits():
    real = muscle()
    at_p, at_e = np.array([2e5, 4e5, 8e5]), np.array([0.0, 0.15, 0.25])
    fits = [
        fit_muscle(measure(real, noise=5.0, seed=seed), real, errors="plain", noise=5.0)
        for seed in range(150)
    ]
    spread = np.std([fit.predict(at_p, at_e) for fit in fits], axis=0)
    np.testing.assert_allclose(fits[0].predict_std(at_p, at_e), spread, rtol=0.2)
    both = fits[0].predict_std(at_p, at_e, new_point=True)
    np.testing.assert_allclose(both, np.hypot(fits[0].predict_std(at_p, at_e), 5.0))


def test_predicted_spread_includes_the_geometry():
    fit = fit_muscle(
        measure(muscle(order=1), noise=2.0),
        muscle(order=1),
        free=["braid_angle"],
        tolerance=TOLERANCE,
    )
    best = fit.muscle
    given = best.parameters
    sides = []
    for sign in (1.0, -1.0):
        slope, offset = (
            given["modulus_slope"][0] + sign * 1e-3,
            given["modulus_offset"][0] + sign * 10.0,
        )
        angle = given["braid_angle"] + sign * 1e-5
        changes = {"modulus_slope": [slope]}, {"modulus_offset": [offset]}, {"braid_angle": angle}
        sides.append(
            np.array([float(best.replace(**change).force(4e5, 0.1)) for change in changes])
        )
    gradient = (sides[0] - sides[1]) / (2.0 * np.array([1e-3, 10.0, 1e-5]))
    assert fit.predict_std(4e5, 0.1) == pytest.approx(
        math.sqrt(gradient @ fit.covar @ gradient), rel=1e-5
    )


def test_prediction_refuses_what_is_not_possible():
    fit = fit_muscle(measure(muscle()), muscle())
    with pytest.raises(ParameterError, match="contraction or length"):
        fit.predict(3e5)
    with pytest.raises(ParameterError, match="pressure has a value that is not finite"):
        fit.predict(math.nan, 0.1)
    with pytest.raises(ParameterError):
        fit.predict(3e5, 0.9)


def test_score_of_another_map():
    real = muscle()
    fit = fit_muscle(measure(real, noise=3.0), real)
    assert 0.999 < fit.score(measure(real, noise=3.0, seed=9)) < 1.0
    assert fit.score(measure(muscle(modulus_scale=3.0))) < fit.score()


# -------------------------------------------------------------------- handing on


def test_fit_becomes_a_rig():
    shoulder = rigs.shoulder()
    real = shoulder.muscle
    e, p = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 0.25, 9), PRESSURES))
    data = ForceMap.from_arrays(
        length=0.276 * (1.0 - e), pressure=p, force=real.force(p, e), rest_length=0.276
    )
    rig = fit_muscle(data, real, order=2).to_rig(shoulder)
    assert rig.blocks == shoulder.blocks
    assert rig.model["muscle"]["count"] == 6
    np.testing.assert_allclose(rig.muscle.force(p, e), real.force(p, e), rtol=1e-7, atol=1e-6)
    assert rig.parameter("chamber.dead_volume").tol == shoulder.parameter("chamber.dead_volume").tol


def test_fit_becomes_a_bench_with_tolerances(tmp_path):
    from pamrs import load_rig

    fit = fit_muscle(
        measure(muscle("robinson"), noise=2.0),
        muscle("robinson"),
        free=["braid_angle"],
        tolerance=TOLERANCE,
    )
    rig = load_rig(fit.to_rig().to_toml(tmp_path / "bench.toml"))
    assert rig.parameter("muscle.braid_angle").value == fit.params["braid_angle"].value
    assert rig.parameter("muscle.braid_angle").tol == fit.params["braid_angle"].stderr
    np.testing.assert_allclose(rig.muscle.force(3e5, 0.1), fit.predict(3e5, 0.1), rtol=1e-12)


def test_report_and_dictionary_hold_the_numbers():
    fit = fit_muscle(
        measure(muscle(), noise=3.0),
        muscle(),
        levels=[0, 1, 4, 5],
        free=["braid_angle"],
        tolerance=TOLERANCE,
    )
    text = fit.fit_report()
    for word in (
        "kothera, order 2",
        "m1",
        "braid_angle",
        "nominal 1.2217",
        "not fitted",
        "levels not fitted",
        "independent",
    ):
        assert word in text
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
    assert (
        f"chi2 {fit.chisqr:.4g} N2, residual rms {math.sqrt(fit.chisqr / fit.ndata):.4g} N\n"
        in text
    )
    assert "reduced" not in text
    assert "with all 66 points as independent: AIC" in text
    assert "of the map's largest force: rms" in text
    assert "force error of each level, of the largest force of that level:" in text
    known = fit_muscle(data, muscle(), noise=3.0)
    assert (
        f"reduced chi2 {known.chisqr / 9.0 / known.nfree:.4g} with the stated noise of 3 N"
        in known.fit_report()
    )
    level = fit_muscle(data, muscle(), weights="level", noise=0.01)
    assert "N2" not in level.fit_report()
    assert "with the stated noise of 1 % of the level's largest force" in level.fit_report()


def test_a_rig_keeps_the_tolerances_of_what_the_fit_did_not_change():
    shoulder = rigs.shoulder()
    real = shoulder.muscle
    e, p = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 0.25, 9), PRESSURES))
    data = ForceMap.from_arrays(
        length=0.276 * (1.0 - e), pressure=p, force=real.force(p, e), rest_length=0.276
    )
    nominal = real.replace(
        friction_coefficient=0.5 * real.parameters["friction_coefficient"] + 0.01
    )
    told = Rig(
        shoulder.name,
        shoulder.model,
        {"muscle.braid_angle": 0.02, "muscle.friction_coefficient": 0.03},
    )
    rig = fit_muscle(data, nominal, order=2).to_rig(told)
    assert rig.parameter("muscle.braid_angle").tol == 0.02
    assert rig.parameter("muscle.friction_coefficient").tol == 0.0
