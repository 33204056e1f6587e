"""Fits that the data do not determine, and arguments that are not allowed: errors and warnings that name the reason."""

import numpy as np
import pytest

from pamrs.errors import ParameterError
from pamrs.fit import FitError, ForceMap, fit_muscle

from .fit_cases import CONTRACTIONS, PRESSURES, REST, SHAPE, TOLERANCE, measure, muscle


@pytest.mark.parametrize(
    ("pressures", "contractions", "order", "message"),
    [
        ([3e5], CONTRACTIONS, 2, r"one pressure level only \(300 kPa\).*collinear"),
        ([2e5, 4e5], [0.0, 0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns .*7 points"),
        ([2e5, 4e5, 6e5], [0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns"),
        (PRESSURES, [0.1, 0.2], 3, "2 different lengths, but order 3 has 3 functions of length"),
        (PRESSURES, [0.1, 0.1 + 1e-6, 0.1 + 2e-6, 0.1 + 3e-6], 4, r"cannot tell apart .*collinear .*4 lengths over 0.0003 %"),
    ],
)
def test_data_that_do_not_determine_the_order_are_named(pressures, contractions, order, message):
    with pytest.raises(FitError, match=message):
        fit_muscle(measure(muscle(), pressures=pressures, contractions=contractions), muscle(), order=order)


def test_tolerances_do_not_stand_in_for_points():
    data = measure(muscle(order=1), pressures=[2e5, 6e5], contractions=[0.05, 0.2], noise=1.0)
    settings = {"free": ["braid_angle", "rest_length"], "tolerance": TOLERANCE}
    message = r"4 unknowns \(m1, b1, braid_angle, rest_length\); 5 points are needed at least, or a known noise"
    with pytest.raises(FitError, match=message):
        fit_muscle(data, muscle(order=1), **settings)
    fit = fit_muscle(data, muscle(order=1), noise=1.0, **settings)
    assert abs(fit.params["braid_angle"].value - SHAPE["braid_angle"]) < 2.0 * TOLERANCE["braid_angle"]
    wide = measure(muscle(order=1), pressures=[2e5, 6e5], contractions=[0.05, 0.1, 0.2], noise=1.0)
    assert any("hardly known" in note for note in fit_muscle(wide, muscle(order=1), **settings).warnings)


def test_a_small_range_of_contraction_is_a_warning():
    real = muscle(order=3)
    narrow = fit_muscle(measure(real, contractions=np.linspace(0.1, 0.11, 8), noise=1.0), real)
    assert narrow.condition_number > 1e4
    assert any("hardly separate m1, m2, m3" in note for note in narrow.warnings)
    assert not any("hardly separate" in note for note in fit_muscle(measure(real, noise=1.0), real).warnings)


def test_levels_with_too_few_points_are_named():
    data = measure(muscle())
    thin = ForceMap.from_arrays(
        np.append(data.length, 0.19), np.append(data.pressure, 9.5e5), np.append(data.force, 300.0), rest_length=REST
    )
    with pytest.raises(FitError, match=r"2 points at every level .* 950 kPa \(1\).*Levels with enough: \[0, 1, 2, 3, 4, 5\]"):
        fit_muscle(thin, muscle(), moduli="per_level")


def test_few_levels_give_plain_errors_and_say_so():
    fit = fit_muscle(measure(muscle(), noise=1.0), muscle(), levels=[0, 2, 4])
    assert fit.errors == "plain"
    assert any("5 levels that can each be spared (3 fitted)" in note for note in fit.warnings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"model": "bouc_wen"}, "model = 'bouc_wen'"),
        ({"order": 0}, "order = 0"),
        ({"order": 2.5}, "order = 2.5"),
        ({"model": "gaylord", "order": 2}, "gaylord has no stress polynomial"),
        ({"moduli": "cubic"}, "moduli = 'cubic'"),
        ({"free": ["radius"]}, "free: 'radius'"),
        ({"free": ["k0"]}, "'k0' has no effect on the model kothera with cylinder geometry"),
        ({"model": "gaylord", "free": ["wall_thickness"]}, "'wall_thickness' has no effect"),
        ({"free": ["braid_angle", "braid_angle"]}, "names a parameter twice"),
        ({"free": ["braid_angle"], "tolerance": {"braid_angle": -1.0}}, "tolerance: braid_angle = -1.0"),
        ({"tolerance": {"angle": 1.0}}, "tolerance: 'angle'"),
        ({"levels": [0, 17]}, r"levels = \[0, 17\].*from 0 to 5"),
        ({"levels": [1.4e5]}, "no measurement at 140 kPa"),
        ({"levels": []}, "levels"),
        ({"weights": "points"}, "weights = 'points'"),
        ({"errors": "bootstrap"}, "errors = 'bootstrap'"),
        ({"direction": "up"}, "direction = 'up'"),
        ({"noise": 0.0}, "noise = 0.0"),
    ],
)
def test_arguments_that_are_not_allowed_are_named(settings, message):
    with pytest.raises(ParameterError, match=message):
        fit_muscle(measure(muscle()), muscle(), **settings)


def test_rest_lengths_must_agree():
    with pytest.raises(ParameterError, match=r"the muscle has 0.2 m, the force map 0.21 m"):
        fit_muscle(measure(muscle(), rest=0.21), muscle())


def test_a_map_without_pull_is_refused():
    data = measure(muscle())
    pushed = ForceMap.from_arrays(data.length, data.pressure, -np.abs(data.force) - 1.0, rest_length=REST)
    with pytest.raises(FitError, match="pulling force is needed"):
        fit_muscle(pushed, muscle())


def test_errors_of_unknown_rows():
    with pytest.raises(ParameterError, match="rows = 'some'"):
        fit_muscle(measure(muscle()), muscle()).errors_of("some")
