"""What is known of moduli before a fit: Gaussian priors beside the points."""

import numpy as np
import pytest

from pamrs.errors import ParameterError
from pamrs.fit import FitError, compare_models, fit_muscle
from tests.fit.cases import TOLERANCE, measure, muscle
from tests.tables import rows_of

WIDE = {"modulus_slope": 10.0, "modulus_offset": 1e7}


def test_a_prior_is_one_more_equation_for_each_coefficient():
    real, noise = muscle(order=2), 5.0
    data = measure(real, noise=noise)
    nominal = muscle(order=2, modulus_slope=[2.0, 0.0], modulus_offset=[5e5, 0.0])
    spread = {"modulus_slope": 0.5, "modulus_offset": 1e5}
    fit = fit_muscle(data, nominal, tolerance=spread, noise=noise)
    p, e, force, *_ = data.used_rows()
    basis = real.elastic_basis(e)
    columns = np.hstack([p[:, None] * basis, basis]) / noise
    weight = np.array([2.0, 2.0, 1e-5, 1e-5])
    prior = np.array([2.0, 0.0, 5e5, 0.0])
    normal = columns.T @ columns + np.diag(weight**2)
    right = columns.T @ ((force - p * real.gas_area(e)) / noise) + weight**2 * prior
    np.testing.assert_allclose(fit.x, np.linalg.solve(normal, right), rtol=1e-7)
    np.testing.assert_allclose(fit.covar_plain, np.linalg.inv(normal), rtol=1e-6)
    assert fit.params["m1"].init_value == 2.0
    assert fit.params["b2"].tolerance == pytest.approx(1e5)


def test_a_wide_prior_moves_nothing_that_the_points_tell():
    data = measure(muscle(order=2), noise=1.0)
    wider = {name: 1e3 * value for name, value in WIDE.items()}
    told = fit_muscle(data, muscle(), tolerance=wider, noise=1.0)
    np.testing.assert_allclose(told.x, fit_muscle(data, muscle()).x, rtol=1e-6)


def test_it_lets_an_order_be_fitted_that_the_points_do_not_determine():
    real = muscle(order=2)
    few = {"pressures": [2e5, 8e5], "contractions": [0.02, 0.12, 0.24]}
    with pytest.raises(FitError, match="6 usable points, but order 4 has 8 unknowns"):
        fit_muscle(measure(real, **few), real, order=4)
    soft = real.replace(modulus_slope=[], modulus_offset=[])
    data = measure(real, noise=1.0, **few)
    fit = fit_muscle(data, soft, order=4, tolerance=WIDE, noise=1.0)
    assert fit.success
    many = measure(real)
    error = fit.predict(many.pressure, length=many.length) - many.force
    assert np.abs(error).max() < 0.03 * many.force.max()


def test_free_geometry_and_priors_go_together_and_leave_one_out_refits():
    real = muscle(order=2)
    data = measure(real, noise=2.0)
    nominal = muscle(order=2, braid_angle=real.parameters["braid_angle"] + 0.01)
    settings = {"free": ["braid_angle"], "tolerance": {**TOLERANCE, **WIDE}, "noise": 2.0}
    fit = fit_muscle(data, nominal, **settings)
    angle = fit.params["braid_angle"]
    assert angle.value == pytest.approx(real.parameters["braid_angle"], abs=4 * angle.stderr)
    others = fit_muscle(data, nominal, **settings, levels=[0, 1, 2, 4, 5])
    left = np.flatnonzero(data.level == 3)
    error = data.force[left] - others.predict(data.pressure[left], length=data.length[left])
    np.testing.assert_allclose(fit.leave_one_pressure_out().residual[left], error, atol=1e-3)
    assert fit.to_rig().parameters["muscle.braid_angle"].tol == pytest.approx(angle.stderr)


def test_moduli_of_each_level_take_the_prior_of_their_pressure():
    real = muscle(order=2)
    data = measure(real, contractions=[0.1], pressures=[2e5, 8e5], noise=1.0)
    known = {"tolerance": {"modulus_slope": 1.0, "modulus_offset": 3e5}, "noise": 1.0}
    fit = fit_muscle(data, real, moduli="per_level", **known)
    assert fit.params["E1_200kPa"].init_value == pytest.approx(2.5 * 2e5 + 9e5)
    assert fit.params["E1_800kPa"].tolerance == pytest.approx(np.hypot(8e5, 3e5))


def test_models_are_compared_with_the_priors_that_they_have():
    data = measure(muscle(order=2), noise=1.0)
    models, known = ["kothera", "mooney_rivlin"], {**WIDE, "c10": 1e7}
    table = compare_models(data, muscle(), models=models, orders=[4], tolerance=known, noise=1.0)
    assert {row["model"] for row in table.rows if row["rank"]} == set(models)


@pytest.mark.parametrize(
    ("settings", "message"),
    rows_of(__file__, "what_makes_no_prior_is_named"),
)
def test_what_makes_no_prior_is_named(settings, message):
    with pytest.raises(ParameterError, match=message):
        fit_muscle(measure(muscle()), muscle(), **settings)
