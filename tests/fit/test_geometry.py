"""Fitting geometry together with the moduli: recovery, priors, limits of the braid."""

import math

import numpy as np
import pytest

from pamrs.fit import FitError, fit_muscle
from tests.fit.cases import TOLERANCE, measure, muscle


@pytest.mark.parametrize("model", ["kothera", "robinson"])
def test_geometry_comes_back_within_its_errors(model):
    real = muscle(model, braid_angle=math.radians(70.9), rest_diameter=0.0206)
    data = measure(real, noise=1.0, seed=4)
    names = ("braid_angle", "rest_diameter")
    fit = fit_muscle(data, muscle(model), free=names, tolerance=TOLERANCE)
    assert fit.success
    for name in names:
        item = fit.params[name]
        assert abs(item.value - real.parameters[name]) < 3.5 * item.stderr_plain
        assert item.stderr_plain < 0.5 * item.tolerance
        assert abs(item.value - item.init_value) > 3.0 * item.stderr_plain
    assert fit.noise == pytest.approx(1.0, rel=0.2)
    assert fit.nvarys == 6


def test_geometry_without_a_prior_and_without_noise_is_exact():
    real = muscle(rest_length=0.202)
    fit = fit_muscle(measure(real), muscle(), free=["rest_length"])
    assert fit.params["rest_length"].value == pytest.approx(0.202, abs=1e-7)
    assert fit.params["rest_length"].tolerance is None
    assert fit.max_error < 1e-6


def test_a_parameter_that_the_data_say_nothing_of_keeps_its_prior():
    real = muscle("robinson")
    data = measure(real, contractions=np.linspace(0.0, 0.2, 9), noise=1.0)
    free = {"free": ["extension_slope"]}
    fit = fit_muscle(data, real, **free, tolerance={"extension_slope": 0.5})
    item = fit.params["extension_slope"]
    assert item.value == pytest.approx(6.105, abs=1e-6)
    assert item.stderr == pytest.approx(0.5, rel=1e-6)
    assert any("extension_slope: the data say nothing" in note for note in fit.warnings)
    message = "extension_slope has no effect on any fitted point; give a tolerance for extension_s"
    with pytest.raises(FitError, match=message):
        fit_muscle(data, real, **free)


def test_prior_and_data_are_weighed_by_the_scatter():
    real = muscle(braid_angle=math.radians(71.0))
    data = measure(real, noise=1.0)
    known = {"free": ["braid_angle"], "tolerance": TOLERANCE}
    fits = (fit_muscle(data, muscle(), **known, noise=noise) for noise in (0.1, 10.0, 1e5))
    away = np.degrees([fit.params["braid_angle"].value for fit in fits]) - 70.0
    assert away[0] == pytest.approx(1.0, abs=0.05)
    assert away[0] > away[1] > away[2]
    assert away[2] == pytest.approx(0.0, abs=0.02)


def test_fitted_geometry_costs_degrees_of_freedom():
    real = muscle(order=1)
    few = {"pressures": [2e5, 7e5], "contractions": [0.0, 0.1, 0.2]}
    free = {"free": ["braid_angle"], "tolerance": {"braid_angle": math.inf}}
    noise = [
        fit_muscle(measure(real, **few, noise=1.0, seed=seed), real, **free).noise
        for seed in range(100)
    ]
    assert np.mean(np.square(noise)) == pytest.approx(1.0, abs=0.13)  # 6 points, 3 unknowns


def test_level_errors_with_geometry_follow_the_refits():
    real = muscle(order=1, braid_angle=math.radians(70.5))
    data = measure(real, noise=2.0)
    settings = {"muscle": muscle(order=1), "free": ["braid_angle"]}
    fit = fit_muscle(data, **settings)
    others = [[k for k in range(6) if k != gone] for gone in range(6)]
    parts = [fit_muscle(data, **settings, levels=kept).x - fit.x for kept in others]
    expected = np.sqrt(5.0 / 6.0 * np.sum(np.square(parts), axis=0))
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covar)), expected, rtol=0.05)


def test_geometry_that_cannot_reach_the_lengths_is_named():
    data = measure(muscle(), contractions=np.linspace(0.0, 0.3, 8))
    flat = muscle(braid_angle=math.radians(50.0), wall_thickness=1e-4)
    message = r"geometry cannot reach: the braid allows .* braid_angle = 50 deg"
    with pytest.raises(FitError, match=message):
        fit_muscle(data, flat, order=1)


def test_search_stays_where_the_braid_reaches():
    real, nominal = (muscle(braid_angle=math.radians(angle)) for angle in (66.0, 65.0))
    data = measure(real, contractions=np.linspace(0.0, 0.32, 9), noise=1.0)
    fit = fit_muscle(data, nominal, free=["braid_angle"], tolerance={"braid_angle": 0.1})
    low, high = fit.muscle.contraction_limits
    assert low < 0.0
    assert high > 0.32
