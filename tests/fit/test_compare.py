"""Models side by side: the right one wins, the penalty is honest, what cannot be ranked is
named.
"""

import json

import numpy as np
import pytest

from pamrs import Muscle
from pamrs.errors import ParameterError
from pamrs.fit import FitError, compare_models, fit_friction, fit_muscle
from pamrs.fit._compare import effective_size, recommend
from tests.fit.cases import TOLERANCE, grid, loops, mapped, measure, muscle, remade


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
    nominal = muscle("kothera", 1, braid_angle=float(real.parameters["braid_angle"]) - 0.04)
    free = {"free": ["braid_angle"], "tolerance": {"braid_angle": 0.005}}
    comparison = compare_models(measure(real, noise=1.0), nominal, models=["kothera"], **free)
    told = row(comparison, "kothera", 1)["moved"]
    fitted = comparison.fits["kothera", 1].params["braid_angle"].value
    assert told == pytest.approx(abs(fitted - nominal.parameters["braid_angle"]) / 0.005)
    assert told > 3.0


def test_orders_that_the_data_do_not_determine_are_listed_and_not_ranked():
    real = muscle("kothera", 1)
    data = measure(real, contractions=[0.05, 0.15], noise=1.0)
    comparison = compare_models(data, real, models=["kothera"])
    assert sorted(row["order"] for row in comparison.rows if row["rank"]) == [1, 2]
    missing = row(comparison, "kothera", 3)
    assert (missing["rank"], missing["rms"]) == (None, None)
    assert "2 different lengths, but order 3" in missing["reason"]
    assert "not ranked: 2 different lengths" in comparison.to_text()
    message = "determine none of the candidates: kothera: one pressure level only"
    with pytest.raises(FitError, match=message):
        compare_models(measure(real, pressures=[3e5]), real, models=["kothera"])


def test_a_geometry_without_a_solution_leaves_the_other_models_to_be_compared():
    sizes = {"rest_length": 0.12, "rest_diameter": 0.05, "wall_thickness": 0.002}
    wide = Muscle(**sizes, braid_angle=np.radians(75.0))
    p, e = grid([2e5, 4e5, 6e5], np.linspace(0.0, 0.2, 6))
    force = wide.replace(model="kothera", modulus_slope=[1.0], modulus_offset=[5e5]).force(p, e)
    data = mapped(p, e, force, rest=0.12)
    with pytest.raises(FitError, match="the nominal geometry does not do at every fitted length"):
        fit_muscle(data, wide, order=1, free=["braid_angle"], tolerance={"braid_angle": 0.02})
    rows = compare_models(data, wide, models=["kothera", "robinson"], orders=[1]).rows
    assert [(row["model"], row["rank"]) for row in rows] == [("kothera", 1), ("robinson", None)]


def test_the_column_for_a_few_levels_is_a_fit_of_these():
    real = muscle("robinson", 2)
    data = measure(real, noise=3.0)
    models = {"models": ["robinson", "gaylord"], "orders": [2]}
    comparison = compare_models(data, real, **models, levels=[0, 2, 5])
    found = row(comparison, "robinson", 2)
    alone = fit_muscle(data, real, levels=[0, 2, 5]).errors_of("held_out")
    assert (found["subset_rms"], found["subset_max"]) == alone
    assert comparison.subset == [1e5, 3.5e5, 8e5]
    assert "subset: fitted to 100, 350, 800 kPa" in comparison.to_text()
    few = compare_models(data, real, **models, levels=[3])
    assert "one pressure level only" in row(few, "robinson", 2)["subset_reason"]
    with pytest.raises(ParameterError, match="none is left to predict"):
        compare_models(data, real, models=["gaylord"], levels=range(6))


def test_geometry_is_freed_where_it_has_an_effect():
    names = ["braid_angle", "wall_thickness", "k0"]
    comparison = compare_models(
        measure(muscle("robinson", 1), noise=1.0),
        muscle("robinson", 1),
        models=["gaylord", "kothera", "robinson"],
        orders=[1],
        free=names,
        tolerance={**TOLERANCE, "k0": 0.1},
    )
    assert row(comparison, "gaylord")["free"] == ["braid_angle"]
    assert row(comparison, "kothera", 1)["free"] == ["braid_angle", "wall_thickness"]
    assert row(comparison, "robinson", 1)["free"] == names
    assert row(comparison, "robinson", 1)["nvarys"] == 5


def test_rows_are_plain():
    data = measure(muscle(), noise=1.0)
    comparison = compare_models(data, muscle(), orders=[2, 1], levels=[0, 3, 5])
    assert json.loads(json.dumps(comparison.to_dicts(), allow_nan=False)) == comparison.rows
    assert comparison.to_text().count("\n") == len(comparison.rows) + 6
    assert "best" in repr(comparison)


def swollen(seed):
    """A muscle of 300 mm with loops of +- 4 % whose directions nobody noted, and 1 % noise."""
    sizes = {"rest_length": 0.3, "rest_diameter": 0.023, "wall_thickness": 0.0015}
    nominal = Muscle(**sizes, braid_angle=np.radians(64.0))
    real = nominal.replace(modulus_slope=[1.2, -0.3], modulus_offset=[5e5, -0.8e5])
    p, e, way = grid(np.linspace(1e5, 6e5, 6), np.linspace(0.0, 0.2, 8), [-1, 1])
    force = real.force(p, e) * (1.0 + 0.04 * way)
    force = force + 0.01 * force.max() * np.random.default_rng(seed).standard_normal(len(p))
    return mapped(p, e, force, rest=0.3), nominal, way


@pytest.mark.parametrize("seed", range(8))
def test_hysteresis_does_not_recommend_a_model_that_is_plainly_worse(seed):
    data, nominal, way = swollen(seed)
    told = remade(data, direction=way)
    for comparison in (
        compare_models(data, nominal),
        compare_models(told, fit_friction(told).to_muscle(nominal)),
    ):
        assert comparison.recommended.model in ("kothera", "robinson")
        elbow = row(comparison, "elbow_linear")
        assert elbow["lopo_excess"] > elbow["lopo_excess_stderr"]


def test_the_recommendation_compares_level_by_level():
    data, nominal, _ = swollen(3)
    comparison = compare_models(data, nominal)
    top = data.force.max()

    def squares(fit):
        error = fit.leave_one_pressure_out().residual / top
        return np.array([np.sum(error[data.level == k] ** 2) for k in range(6)])

    eligible = []
    for found in comparison.rows:
        apart = squares(comparison.fits[found["model"], found["order"]]) - squares(comparison.best)
        mean, stderr = np.mean(apart), np.std(apart, ddof=1) / np.sqrt(6)
        told = found["lopo_excess"], found["lopo_excess_stderr"]
        assert told == pytest.approx((mean, stderr), abs=1e-15)
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
    smooth = remade(data, force=data.force + wave)
    assert 12 <= effective_size(fit_muscle(smooth, muscle())) < 0.2 * 360
    # smooth along each level, opposite in the next
    turned = np.where(data.level % 2 == 0, wave, -wave)
    along = remade(data, force=data.force + turned)
    assert effective_size(fit_muscle(along, muscle())) < 0.5 * 360
    # the branches of a loop are not independent of themselves
    fit = fit_muscle(loops(muscle(order=1, friction_coefficient=0.1)), muscle(), direction=None)
    assert effective_size(fit) < 0.1 * fit.ndata


def test_loops_without_a_friction_law_are_said_to_favour_the_model_with_two_branches():
    real = muscle(friction_coefficient=0.05)
    data, models = loops(real, noise=1.0), ["kothera", "elbow_linear"]
    found = compare_models(data, muscle(), models=models, orders=[2])
    assert "which favours it; fit friction first" in found.to_text()
    fitted = compare_models(data, real, models=models, orders=[2])
    assert fitted.notes == ()
    assert fitted.rows[0]["model"] == "kothera"
