"""Models side by side: the right one wins, the penalty is honest, what cannot be ranked is
named.
"""

import json

import numpy as np
import pytest

from pamrs import Muscle
from pamrs.errors import ParameterError
from pamrs.fit import FitError, ForceMap, compare_models, fit_friction, fit_muscle
from pamrs.fit._compare import effective_size, recommend
from tests.fit.cases import REST, TOLERANCE, measure, muscle, named


def row(comparison, model, order=None):
    return next(row for row in comparison.rows if (row["model"], row["order"]) == (model, order))


def test_every_model_is_there_and_the_true_one_wins():
    real = muscle("ferraresi", 2)
    comparison = compare_models(measure(real, noise=1.0), real)
    assert len(comparison.rows) == 4 + 3 * 4
    assert [row["rank"] for row in comparison.rows] == list(range(1, 17))
    assert comparison.best.model == "ferraresi"
    assert (comparison.recommended.model, comparison.recommended.order) == ("ferraresi", 2)
    errors = [row["lopo_rms"] for row in comparison.rows]
    assert errors == sorted(errors)


def test_more_unknowns_win_in_the_fit_but_not_in_the_recommendation():
    real = muscle("kothera", 1)
    comparison = compare_models(measure(real, noise=6.0, seed=2), real, models=["kothera"])
    assert row(comparison, "kothera", 4)["rms"] < row(comparison, "kothera", 1)["rms"]
    assert comparison.recommended.order == 1
    assert row(comparison, "kothera", 1)["bic"] < row(comparison, "kothera", 4)["bic"]


def test_of_equal_predictions_the_plausible_geometry_is_recommended():
    rows = [
        {"moved": 5.8, "nvarys": 4, "lopo_rms": 0.0100},
        {"moved": 1.2, "nvarys": 9, "lopo_rms": 0.0111},
        {"moved": 0.9, "nvarys": 7, "lopo_rms": 0.0112},
    ]
    assert recommend(rows) is rows[2]
    assert recommend(rows[:1]) is rows[0]  # none is plausible


def test_how_far_the_geometry_moved_is_told():
    real = muscle("kothera", 1)
    nominal = float(real.parameters["braid_angle"])
    comparison = compare_models(
        measure(real, noise=1.0),
        muscle("kothera", 1, braid_angle=nominal - 0.04),
        models=["kothera"],
        free=["braid_angle"],
        tolerance={"braid_angle": 0.005},
    )
    told = row(comparison, "kothera", 1)["moved"]
    fitted = comparison.fits["kothera", 1].params["braid_angle"].value
    assert told == pytest.approx(abs(fitted - nominal + 0.04) / 0.005)
    assert told > 3.0


def test_orders_that_the_data_do_not_determine_are_listed_and_not_ranked():
    real = muscle("kothera", 1)
    data = measure(real, contractions=[0.05, 0.15], noise=1.0)
    comparison = compare_models(data, real, models=["kothera"])
    assert sorted(row["order"] for row in comparison.rows if row["rank"]) == [1, 2]
    missing = row(comparison, "kothera", 3)
    assert missing["rank"] is None
    assert missing["rms"] is None
    assert "2 different lengths, but order 3" in missing["reason"]
    assert "not ranked: 2 different lengths" in comparison.to_text()
    with pytest.raises(
        FitError, match="determine none of the candidates: kothera: one pressure level only"
    ):
        compare_models(measure(real, pressures=[3e5]), real, models=["kothera"])


def test_the_column_for_a_few_levels_is_a_fit_of_these():
    real = muscle("robinson", 2)
    data = measure(real, noise=3.0)
    comparison = compare_models(
        data, real, models=["robinson", "gaylord"], orders=[2], levels=[0, 2, 5]
    )
    rms, worst = fit_muscle(data, real, levels=[0, 2, 5]).errors_of("held_out")
    found = row(comparison, "robinson", 2)
    assert (found["subset_rms"], found["subset_max"]) == (rms, worst)
    assert comparison.subset == [1e5, 3.5e5, 8e5]
    assert "subset: fitted to 100, 350, 800 kPa" in comparison.to_text()


def test_a_few_levels_that_are_too_few_are_named():
    comparison = compare_models(
        measure(muscle(), noise=1.0), muscle(), models=["kothera"], orders=[1], levels=[3]
    )
    assert "one pressure level only" in comparison.rows[0]["subset_reason"]
    with pytest.raises(ParameterError, match="none is left to predict"):
        compare_models(measure(muscle()), muscle(), models=["gaylord"], levels=range(6))


def test_geometry_is_freed_where_it_has_an_effect():
    data = measure(muscle("robinson", 1), noise=1.0)
    names = ["braid_angle", "wall_thickness", "k0"]
    tolerance = {**TOLERANCE, "k0": 0.1}
    comparison = compare_models(
        data,
        muscle("robinson", 1),
        models=["gaylord", "kothera", "robinson"],
        orders=[1],
        free=names,
        tolerance=tolerance,
    )
    assert row(comparison, "gaylord")["free"] == ["braid_angle"]
    assert row(comparison, "kothera", 1)["free"] == ["braid_angle", "wall_thickness"]
    assert row(comparison, "robinson", 1)["free"] == names
    assert row(comparison, "robinson", 1)["nvarys"] == 5


def test_rows_are_plain():
    comparison = compare_models(
        measure(muscle(), noise=1.0), muscle(), orders=[2, 1], levels=[0, 3, 5]
    )
    assert json.loads(json.dumps(comparison.to_dicts(), allow_nan=False)) == comparison.rows
    assert comparison.to_text().count("\n") == len(comparison.rows) + 6
    assert "best" in repr(comparison)


def loops(seed):
    """A muscle of 300 mm with loops of +- 4 % whose directions nobody noted, and 1 % noise."""
    sizes = {
        "rest_length": 0.3,
        "rest_diameter": 0.023,
        "braid_angle": np.radians(64.0),
        "wall_thickness": 0.0015,
    }
    real = Muscle(**sizes, modulus_slope=[1.2, -0.3], modulus_offset=[5e5, -0.8e5])
    grid = np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0.0, 0.2, 8), [-1, 1], indexing="ij")
    p, e, way = (values.ravel() for values in grid)
    force = real.force(p, e) * (1.0 + 0.04 * way)
    force = force + 0.01 * force.max() * np.random.default_rng(seed).standard_normal(len(p))
    return (
        ForceMap.from_arrays(length=0.3 * (1.0 - e), pressure=p, force=force, rest_length=0.3),
        Muscle(**sizes),
        way,
    )


@pytest.mark.parametrize("seed", range(8))
def test_hysteresis_does_not_recommend_a_model_that_is_plainly_worse(seed):
    data, nominal, way = loops(seed)
    told = ForceMap.from_arrays(
        length=data.length, pressure=data.pressure, force=data.force, rest_length=0.3, direction=way
    )
    for comparison in (
        compare_models(data, nominal),
        compare_models(told, fit_friction(told).to_muscle(nominal)),
    ):
        assert comparison.recommended.model in ("kothera", "robinson")
        assert (
            row(comparison, "elbow_linear")["lopo_excess"]
            > row(comparison, "elbow_linear")["lopo_excess_stderr"]
        )


def test_the_recommendation_compares_level_by_level():
    data, nominal, _ = loops(3)
    comparison = compare_models(data, nominal)
    top = data.force.max()

    def squares(fit):
        error = fit.leave_one_pressure_out().residual / top
        return np.array([np.sum(error[data.level == k] ** 2) for k in range(6)])

    eligible = []
    for found in comparison.rows:
        apart = squares(comparison.fits[found["model"], found["order"]]) - squares(comparison.best)
        mean, stderr = np.mean(apart), np.std(apart, ddof=1) / np.sqrt(6)
        assert (found["lopo_excess"], found["lopo_excess_stderr"]) == pytest.approx(
            (mean, stderr), abs=1e-15
        )
        if mean <= stderr:
            eligible.append(found)
    assert [found["recommended"] for found in comparison.rows].count(True) == 1
    assert comparison.recommended.nvarys == min(found["nvarys"] for found in eligible)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"models": ["hill"]}, "models"),
        ({"models": []}, "models"),
        ({"models": ["kothera"], "orders": []}, "orders"),
    ],
)
def test_arguments_that_are_not_allowed_are_named(settings, message):
    with pytest.raises(ParameterError, match=message):
        compare_models(measure(muscle()), muscle(), **settings)


def test_independent_noise_counts_every_point_and_model_error_does_not():
    pressures, contractions = np.linspace(1e5, 8e5, 12), np.linspace(0.0, 0.25, 30)
    data = measure(muscle(), pressures=pressures, contractions=contractions, noise=5.0)
    assert effective_size(fit_muscle(data, muscle())) > 0.7 * 360
    wave = 20.0 * np.sin(40.0 * data.contraction) * data.pressure / 8e5
    smooth = ForceMap.from_arrays(
        length=data.length, pressure=data.pressure, force=data.force + wave, rest_length=REST
    )
    size = effective_size(fit_muscle(smooth, muscle()))
    assert 12 <= size < 0.2 * 360
    turned = np.where(
        data.level % 2 == 0, wave, -wave
    )  # smooth along each level, opposite in the next
    along = ForceMap.from_arrays(
        length=data.length, pressure=data.pressure, force=data.force + turned, rest_length=REST
    )
    assert effective_size(fit_muscle(along, muscle())) < 0.5 * 360


def test_loops_without_a_friction_law_are_said_to_favour_the_model_with_two_branches():
    real = muscle(friction_coefficient=0.05)
    maps = [measure(real, direction=way, noise=1.0) for way in (-1.0, 1.0)]
    columns = [
        np.concatenate([getattr(m, name) for m in maps]) for name in ("length", "pressure", "force")
    ]
    way = np.repeat([-1.0, 1.0], len(maps[0]))
    data = ForceMap.from_arrays(**named(columns), rest_length=REST, direction=way)
    found = compare_models(data, muscle(), models=["kothera", "elbow_linear"], orders=[2])
    assert "which favours it; fit friction first" in found.to_text()
    fitted = compare_models(data, real, models=["kothera", "elbow_linear"], orders=[2])
    assert fitted.notes == ()
    assert fitted.rows[0]["model"] == "kothera"
