"""Fits that the data do not determine, and arguments that are not allowed: errors and warnings that
name the reason.
"""

import numpy as np
import pytest

from pamrs.errors import ParameterError
from pamrs.fit import FitError, ForceMap, fit_friction, fit_muscle, load_force_map
from tests.fit.cases import CONTRACTIONS, PRESSURES, REST, SHAPE, TOLERANCE, measure, muscle, named
from tests.tables import rows_of


@pytest.mark.parametrize(
    ("pressures", "contractions", "order", "message"),
    [
        ([3e5], CONTRACTIONS, 2, r"one pressure level only \(300 kPa\).*collinear"),
        ([2e5, 4e5], [0.0, 0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns .*7 points"),
        ([2e5, 4e5, 6e5], [0.1, 0.2], 3, r"6 usable points, but order 3 has 6 unknowns"),
        (PRESSURES, [0.1, 0.2], 3, "2 different lengths, but order 3 has 3 functions of length"),
        (
            PRESSURES,
            [0.1, 0.1 + 1e-6, 0.1 + 2e-6, 0.1 + 3e-6],
            4,
            r"cannot tell apart .*collinear .*4 lengths over 0.0003 %",
        ),
    ],
)
def test_data_that_do_not_determine_the_order_are_named(pressures, contractions, order, message):
    with pytest.raises(FitError, match=message):
        fit_muscle(
            measure(muscle(), pressures=pressures, contractions=contractions), muscle(), order=order
        )


def test_tolerances_do_not_stand_in_for_points():
    data = measure(muscle(order=1), pressures=[2e5, 6e5], contractions=[0.05, 0.2], noise=1.0)
    settings = {"free": ["braid_angle", "rest_length"], "tolerance": TOLERANCE}
    message = (
        r"4 unknowns \(m1, b1, braid_angle, rest_length\); 5 points are needed at least, or a "
        r"known noise"
    )
    with pytest.raises(FitError, match=message):
        fit_muscle(data, muscle(order=1), **settings)
    fit = fit_muscle(data, muscle(order=1), noise=1.0, **settings)
    assert (
        abs(fit.params["braid_angle"].value - SHAPE["braid_angle"]) < 2.0 * TOLERANCE["braid_angle"]
    )
    wide = measure(muscle(order=1), pressures=[2e5, 6e5], contractions=[0.05, 0.1, 0.2], noise=1.0)
    assert any(
        "hardly known" in note for note in fit_muscle(wide, muscle(order=1), **settings).warnings
    )


def test_a_small_range_of_contraction_is_a_warning():
    real = muscle(order=3)
    narrow = fit_muscle(measure(real, contractions=np.linspace(0.1, 0.11, 8), noise=1.0), real)
    assert narrow.condition_number > 1e4
    assert any("hardly separate m1, m2, m3" in note for note in narrow.warnings)
    assert not any(
        "hardly separate" in note for note in fit_muscle(measure(real, noise=1.0), real).warnings
    )


def test_levels_with_too_few_points_are_named():
    data = measure(muscle())
    thin = ForceMap.from_arrays(
        length=np.append(data.length, 0.19),
        pressure=np.append(data.pressure, 9.5e5),
        force=np.append(data.force, 300.0),
        rest_length=REST,
    )
    with pytest.raises(
        FitError,
        match=r"2 points at every level .* 950 kPa \(1\).*Levels with enough: \[0, 1, 2, 3, 4, 5\]",
    ):
        fit_muscle(thin, muscle(), moduli="per_level")


def test_few_levels_give_plain_errors_and_say_so():
    fit = fit_muscle(measure(muscle(), noise=1.0), muscle(), levels=[0, 2, 4])
    assert fit.errors == "plain"
    assert any(
        "errors by level need 5 fitted levels for 4 unknowns, there are 3" in note
        for note in fit.warnings
    )
    many = fit_muscle(measure(muscle(order=3), noise=1.0), muscle(order=3))
    assert any(
        "errors by level need 7 fitted levels for 6 unknowns, there are 6" in note
        for note in many.warnings
    )


def test_a_level_that_cannot_be_missed_gives_plain_errors():
    data = measure(muscle(), noise=1.0)
    kept = np.isin(data.level, [0, 5]) | np.isclose(data.contraction, CONTRACTIONS[4])
    thin = ForceMap.from_arrays(
        length=data.length[kept],
        pressure=data.pressure[kept],
        force=data.force[kept],
        rest_length=REST,
    )
    fit = fit_muscle(thin, muscle())
    assert fit.errors == "plain"
    assert any("one of the 6 cannot be missed" in note for note in fit.warnings)


def noted(fit, words):
    return [note for note in fit.warnings if words in note]


def test_moduli_that_are_not_told_from_zero_are_counted():
    data = measure(muscle(order=1), noise=8.0)
    fit = fit_muscle(data, muscle(order=1), order=4)
    count = sum(item.stderr > abs(item.value) for item in fit.params.values())
    assert count >= 4
    assert noted(
        fit,
        (
            f"{count} of 8 moduli are not told from zero: a lower order may predict as well, "
            "compare_models (--compare)"
        ),
    )
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
    fit = fit_muscle(
        ForceMap.from_arrays(
            length=data.length, pressure=data.pressure, force=force, rest_length=REST
        ),
        muscle(),
        **settings,
    )
    (note,) = noted(fit, "times their scatter")
    assert (
        f"index 17 (200 kPa, {1e3 * data.length[17]:.4g} mm: {force[17]:.4g} N, the others predict "
        in note
    )
    assert "index 40 (" in note
    assert note.count("index ") == 2
    if not settings:
        others = ForceMap.from_arrays(
            **named(np.delete(v, [5, *wrong]) for v in (data.length, data.pressure, force)),
            rest_length=REST,
        )
        predicted = float(fit_muscle(others, muscle()).predict(2e5, length=data.length[17]))
        assert float(
            note.split("index 17 ")[1].split("the others predict ")[1].split(" N")[0]
        ) == pytest.approx(predicted, abs=40.0)


def test_a_point_of_a_file_is_named_by_its_row_there(tmp_path):
    data = measure(muscle(), noise=2.0)
    force = data.force.copy()
    force[30] += 900.0
    rows = "\n".join(
        f"{v},{p},{f},B" for v, p, f in zip(1e3 * data.length, data.pressure, force, strict=True)
    )
    (tmp_path / "map.csv").write_text(
        "length [mm],pressure [Pa],force [N],specimen\n250,1e5,1,A\n" + rows + "\n",
        encoding="utf-8",
    )
    loaded = load_force_map(tmp_path / "map.csv", rest_length=REST, where={"specimen": "B"})
    (note,) = noted(fit_muscle(loaded, muscle()), "times their scatter")
    assert note.startswith("row 33 (")


@pytest.mark.parametrize("share", [0.005, 0.01])
def test_scatter_that_grows_with_the_force_names_no_point(share):
    found = 0
    for seed in range(40):
        data = measure(muscle())
        noise = share * np.random.default_rng(seed).standard_normal(len(data.force))
        map_ = ForceMap.from_arrays(
            length=data.length,
            pressure=data.pressure,
            force=data.force * (1.0 + noise),
            rest_length=REST,
        )
        found += bool(noted(fit_muscle(map_, muscle()), "their scatter"))
    assert found <= 2


def test_exchanged_directions_are_asked_about():
    real = muscle(friction_coefficient=0.05)
    maps = [measure(real, direction=way, noise=0.5) for way in (-1.0, 1.0)]
    columns = [
        np.concatenate([getattr(m, name) for m in maps]) for name in ("length", "pressure", "force")
    ]
    way = np.concatenate([np.ones(len(maps[0])), -np.ones(len(maps[1]))])
    data = ForceMap.from_arrays(**named(columns), rest_length=REST, direction=way)
    assert noted(fit_muscle(data, muscle()), "are the directions exchanged?")
    assert any("are the directions exchanged?" in issue for issue in fit_friction(data).issues)
    one = ForceMap.from_arrays(
        length=maps[0].length,
        pressure=maps[0].pressure,
        force=maps[0].force,
        rest_length=REST,
        direction=-np.ones(len(maps[0])),
    )
    assert noted(
        fit_muscle(one, muscle()), "all rows are contracting: friction cannot be determined"
    )


def test_loops_without_friction_do_not_tell_any():
    told = 0
    for seed in range(30):
        maps = [measure(muscle(), noise=8.0, seed=2 * seed + k) for k in (0, 1)]
        columns = [
            np.concatenate([getattr(m, name) for m in maps])
            for name in ("length", "pressure", "force")
        ]
        way = np.concatenate([-np.ones(len(maps[0])), np.ones(len(maps[1]))])
        told += fit_friction(
            ForceMap.from_arrays(**named(columns), rest_length=REST, direction=way)
        ).told
    assert told <= 1


def test_scatter_alone_names_no_point():
    named = sum(
        bool(noted(fit_muscle(measure(muscle(), noise=5.0, seed=seed), muscle()), "their scatter"))
        for seed in range(100)
    )
    assert named == 0


def test_lengths_that_hardly_differ_are_a_warning():
    close = measure(muscle(order=1), contractions=np.linspace(0.1, 0.118, 6), noise=1.0)
    assert noted(
        fit_muscle(close, muscle(order=1)), "the fitted lengths span 1.8 % of the rest length only"
    )
    assert not noted(
        fit_muscle(measure(muscle(order=1), noise=1.0), muscle(order=1)), "lengths span"
    )


def test_a_modulus_beyond_any_rubber_is_named():
    steel = muscle(order=1, modulus_offset=[3e9])
    (note,) = noted(
        fit_muscle(measure(steel, contractions=np.linspace(0.0, 0.01, 8)), steel), "1 GPa"
    )
    assert note.startswith("b1 = 3e+09 Pa: beyond 1 GPa")


def test_geometry_that_moves_far_without_a_tolerance_is_named():
    real = muscle(order=1, wall_thickness=1.1e-3)
    nominal = muscle(order=1, wall_thickness=1.8e-3)
    fit = fit_muscle(measure(real, noise=0.1), nominal, free=["wall_thickness"])
    assert noted(fit, "moved by -39 % from the nominal 0.0018 m")
    near = fit_muscle(
        measure(real, noise=0.1), muscle(order=1, wall_thickness=1.2e-3), free=["wall_thickness"]
    )
    assert not noted(near, "moved by")


def test_hysteresis_of_a_muscle_without_friction_is_named():
    rubbing = muscle(friction_coefficient=0.04)
    parts = [measure(rubbing, direction=way, noise=3.0, seed=way + 1) for way in (-1, 1)]
    columns = [
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("length", "pressure", "force", "direction")
    ]
    loops = ForceMap.from_arrays(**named(columns[:3]), rest_length=REST, direction=columns[3])
    (note,) = noted(fit_muscle(loops, muscle()), "the muscle has no friction")
    assert "differ by +- 4 %" in note
    assert not noted(fit_muscle(loops, rubbing), "no friction")
    assert not noted(fit_muscle(loops, muscle(), direction=None), "no friction")
    still = ForceMap.from_arrays(
        length=columns[0],
        pressure=columns[1],
        force=np.tile(measure(muscle(), noise=3.0).force, 2),
        rest_length=REST,
        direction=columns[3],
    )
    assert not noted(fit_muscle(still, muscle()), "no friction")


@pytest.mark.parametrize(
    ("settings", "message"),
    rows_of(__file__, "arguments_that_are_not_allowed_are_named"),
)
def test_arguments_that_are_not_allowed_are_named(settings, message):
    with pytest.raises(ParameterError, match=message):
        fit_muscle(measure(muscle()), muscle(), **settings)


def test_rest_lengths_must_agree():
    with pytest.raises(ParameterError, match=r"the muscle has 0.2 m, the force map 0.21 m"):
        fit_muscle(measure(muscle(), rest=0.21), muscle())


def test_a_map_without_pull_is_refused():
    data = measure(muscle())
    pushed = ForceMap.from_arrays(
        length=data.length,
        pressure=data.pressure,
        force=-np.abs(data.force) - 1.0,
        rest_length=REST,
    )
    with pytest.raises(FitError, match="pulling force is needed"):
        fit_muscle(pushed, muscle())


def test_errors_of_unknown_rows():
    with pytest.raises(ParameterError, match="rows = 'some'"):
        fit_muscle(measure(muscle()), muscle()).errors_of("some")
