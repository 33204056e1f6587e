"""Fits that the data do not determine, and arguments that are not allowed: errors and warnings that
name the reason.
"""

import numpy as np
import pytest

from pamrs.errors import ParameterError
from pamrs.fit import FitError, fit_friction, fit_muscle, load_force_map
from tests.fit.cases import (
    CONTRACTIONS,
    PRESSURES,
    REST,
    SHAPE,
    TOLERANCE,
    joined,
    loops,
    measure,
    muscle,
    remade,
)
from tests.tables import rows_of


def noted(fit, words):
    return [note for note in fit.warnings if words in note]


@pytest.mark.parametrize(
    ("pressures", "contractions", "order", "message"),
    [
        ([3e5], CONTRACTIONS, 2, r"one pressure level only \(300 kPa\).*collinear"),
        ([2e5, 4e5], [0.0, 0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns .*7 points"),
        ([2e5, 4e5, 6e5], [0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns"),
        (PRESSURES, [0.1, 0.2], 3, "2 different lengths, but order 3 has 3 functions of length"),
        (PRESSURES, 0.1 + 1e-6 * np.arange(4), 4, r"cannot tell apart .*4 lengths over 0.0003 %"),
    ],
)
def test_data_that_do_not_determine_the_order_are_named(pressures, contractions, order, message):
    data = measure(muscle(), pressures=pressures, contractions=contractions)
    with pytest.raises(FitError, match=message):
        fit_muscle(data, muscle(), order=order)


def test_tolerances_do_not_stand_in_for_points():
    real = muscle(order=1)
    data = measure(real, pressures=[2e5, 6e5], contractions=[0.05, 0.2], noise=1.0)
    settings = {"free": ["braid_angle", "rest_length"], "tolerance": TOLERANCE}
    unknowns = r"4 unknowns \(m1, b1, braid_angle, rest_length\)"
    with pytest.raises(FitError, match=f"{unknowns}; 5 points are .* at least, or a known noise"):
        fit_muscle(data, real, **settings)
    angle = fit_muscle(data, real, noise=1.0, **settings).params["braid_angle"].value
    assert abs(angle - SHAPE["braid_angle"]) < 2.0 * TOLERANCE["braid_angle"]
    wide = measure(real, pressures=[2e5, 6e5], contractions=[0.05, 0.1, 0.2], noise=1.0)
    assert noted(fit_muscle(wide, real, **settings), "hardly known")


def test_a_small_range_of_contraction_is_a_warning():
    real = muscle(order=3)
    narrow = fit_muscle(measure(real, contractions=np.linspace(0.1, 0.11, 8), noise=1.0), real)
    assert narrow.condition_number > 1e4
    assert noted(narrow, "hardly separate m1, m2, m3")
    assert not noted(fit_muscle(measure(real, noise=1.0), real), "hardly separate")
    real = muscle(order=1)
    close = measure(real, contractions=np.linspace(0.1, 0.118, 6), noise=1.0)
    words = "the fitted lengths span 1.8 % of the rest length only"
    assert noted(fit_muscle(close, real), words)
    assert not noted(fit_muscle(measure(real, noise=1.0), real), "lengths span")


def test_levels_with_too_few_points_are_named():
    data, one = measure(muscle()), {"length": 0.19, "pressure": 9.5e5, "force": 300.0}
    more = {name: np.append(getattr(data, name), value) for name, value in one.items()}
    message = r"2 points at every level .* 950 kPa \(1\).*with enough: \[0, 1, 2, 3, 4, 5\]"
    with pytest.raises(FitError, match=message):
        fit_muscle(remade(data, **more), muscle(), moduli="per_level")


def test_levels_that_are_too_few_give_plain_errors_and_say_so():
    data = measure(muscle(), noise=1.0)
    few = fit_muscle(data, muscle(), levels=[0, 2, 4])
    many = fit_muscle(measure(muscle(order=3), noise=1.0), muscle(order=3))
    sparse = np.isin(data.level, [0, 5]) | np.isclose(data.contraction, CONTRACTIONS[4])
    thin = fit_muscle(remade(data, sparse), muscle())
    for fit, words in (
        (few, "errors by level need 5 fitted levels for 4 unknowns, there are 3"),
        (many, "errors by level need 7 fitted levels for 6 unknowns, there are 6"),
        (thin, "one of the 6 cannot be missed"),
    ):
        assert fit.errors == "plain"
        assert noted(fit, words)


def test_moduli_that_are_not_told_from_zero_are_counted():
    data = measure(muscle(order=1), noise=8.0)
    fit = fit_muscle(data, muscle(order=1), order=4)
    count = sum(item.stderr > abs(item.value) for item in fit.params.values())
    assert count >= 4
    told = f"{count} of 8 moduli are not told from zero: a lower order may predict as well, "
    assert noted(fit, f"{told}compare_models (--compare)")
    assert not noted(fit_muscle(data, muscle(order=1)), "not told from zero")


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"free": ["braid_angle"], "tolerance": TOLERANCE},
        {"weights": "level"},
        {"model": "gaylord"},
    ],
)
def test_a_point_that_the_others_do_not_predict_is_named_by_its_row(settings):
    data = measure(muscle(settings.get("model", "kothera")), noise=2.0)
    assert not noted(fit_muscle(data, muscle(), **settings), "times their scatter")
    force = data.force.copy()
    wrong = [17, 40]
    force[wrong] += [900.0, -700.0]
    force[5] = np.nan  # rows that are not used count too
    (note,) = noted(fit_muscle(remade(data, force=force), muscle(), **settings), "their scatter")
    row = f"index 17 (200 kPa, {1e3 * data.length[17]:.4g} mm: {force[17]:.4g} N, the others "
    assert f"{row}predict " in note
    assert "index 40 (" in note
    assert note.count("index ") == 2
    if not settings:
        others = fit_muscle(remade(data, np.delete(np.arange(len(data)), [5, *wrong])), muscle())
        told = float(note.split("index 17 ")[1].split("the others predict ")[1].split(" N")[0])
        predicted = float(others.predict(2e5, length=data.length[17]))
        assert told == pytest.approx(predicted, abs=40.0)


def test_a_point_of_a_file_is_named_by_its_row_there(tmp_path):
    data = measure(muscle(), noise=2.0)
    force = data.force.copy()
    force[30] += 900.0
    table = zip(1e3 * data.length, data.pressure, force, strict=True)
    rows = ["length [mm],pressure [Pa],force [N],specimen", "250,1e5,1,A"]
    rows += [f"{v},{p},{f},B" for v, p, f in table]
    (tmp_path / "map.csv").write_text("\n".join(rows), encoding="utf-8")
    loaded = load_force_map(tmp_path / "map.csv", rest_length=REST, where={"specimen": "B"})
    (note,) = noted(fit_muscle(loaded, muscle()), "times their scatter")
    assert note.startswith("row 33 (")


@pytest.mark.parametrize("share", [0.005, 0.01])
def test_scatter_that_grows_with_the_force_names_no_point(share):
    found = 0
    data = measure(muscle())
    for seed in range(40):
        noise = share * np.random.default_rng(seed).standard_normal(len(data.force))
        fit = fit_muscle(remade(data, force=data.force * (1.0 + noise)), muscle())
        found += bool(noted(fit, "their scatter"))
    assert found <= 2


def test_scatter_alone_names_no_point():
    fits = (fit_muscle(measure(muscle(), noise=5.0, seed=k), muscle()) for k in range(100))
    assert not any(noted(fit, "their scatter") for fit in fits)


def test_exchanged_directions_are_asked_about():
    right = loops(muscle(friction_coefficient=0.05), noise=0.5)
    data = remade(right, direction=-right.direction)
    assert noted(fit_muscle(data, muscle()), "are the directions exchanged?")
    assert any("are the directions exchanged?" in issue for issue in fit_friction(data).issues)
    one = remade(right, right.direction < 0, direction=-np.ones(len(right) // 2))
    words = "all rows are contracting: friction cannot be determined"
    assert noted(fit_muscle(one, muscle()), words)


def test_loops_without_friction_do_not_tell_any():
    told = 0
    for seed in range(30):
        maps = [measure(muscle(), noise=8.0, seed=2 * seed + k) for k in (0, 1)]
        told += fit_friction(joined(*maps, direction=np.repeat([-1, 1], len(maps[0])))).told
    assert told <= 1


def test_hysteresis_of_a_muscle_without_friction_is_named():
    rubbing = muscle(friction_coefficient=0.04)
    data = loops(rubbing, noise=3.0, seeds=(0, 2))
    (note,) = noted(fit_muscle(data, muscle()), "the muscle has no friction")
    assert "differ by +- 4 %" in note
    still = remade(
        data, force=np.tile(measure(muscle(), noise=3.0).force, 2), direction=data.direction
    )
    for fit in (
        fit_muscle(data, rubbing),
        fit_muscle(data, muscle(), direction=None),
        fit_muscle(still, muscle()),
    ):
        assert not noted(fit, "no friction")


def test_a_modulus_beyond_any_rubber_is_named():
    steel = muscle(order=1, modulus_offset=[3e9])
    fit = fit_muscle(measure(steel, contractions=np.linspace(0.0, 0.01, 8)), steel)
    (note,) = noted(fit, "1 GPa")
    assert note.startswith("b1 = 3e+09 Pa: beyond 1 GPa")


@pytest.mark.parametrize(("nominal", "far"), [(1.8e-3, True), (1.2e-3, False)])
def test_geometry_that_moves_far_without_a_tolerance_is_named(nominal, far):
    data = measure(muscle(order=1, wall_thickness=1.1e-3), noise=0.1)
    fit = fit_muscle(data, muscle(order=1, wall_thickness=nominal), free=["wall_thickness"])
    words = "moved by -39 % from the nominal 0.0018 m" if far else "moved by"
    assert bool(noted(fit, words)) == far


@pytest.mark.parametrize(
    ("settings", "message"), rows_of(__file__, "arguments_that_are_not_allowed_are_named")
)
def test_arguments_that_are_not_allowed_are_named(settings, message):
    with pytest.raises(ParameterError, match=message):
        fit_muscle(measure(muscle()), muscle(), **settings)


def test_what_does_not_go_with_the_map_is_refused():
    with pytest.raises(ParameterError, match=r"the muscle has 0.2 m, the force map 0.21 m"):
        fit_muscle(measure(muscle(), rest=0.21), muscle())
    data = measure(muscle())
    with pytest.raises(FitError, match="pulling force is needed"):
        fit_muscle(remade(data, force=-np.abs(data.force) - 1.0), muscle())
    with pytest.raises(ParameterError, match="rows = 'some'"):
        fit_muscle(data, muscle()).errors_of("some")
