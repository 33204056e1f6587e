"""Friction of cylinders: strokes, breakaway and law from synthetic runs whose friction is known,
and the real set.
"""

import warnings
from pathlib import Path

import numpy as np
import pytest

from cases.zillen_cylinders.compare import compare_friction_laws
from cases.zillen_cylinders.figure import plot_cylinders
from cases.zillen_cylinders.laws import fit_cylinder_friction, mean_of_series
from cases.zillen_cylinders.record import FrictionRecord, load_friction_folder, load_friction_record
from cases.zillen_cylinders.strokes import onset_at_rest, pair_strokes
from pamrs.errors import ParameterError, RecordingError
from pamrs.fit.levels import fit_levels
from tests.tables import rows_of

SHARED = Path(__file__).parents[2] / "../shared/recordings/pneumatic_cylinders_zillen"
DATA = SHARED / "results_pneumatic-actuator/data/friction"
AREA, ZERO, F0, F1, RATIO = 5.0e-4, 1.5, 3.0, 8e-6, 1.8
PRESSURES = (1e5, 2e5, 4e5, 5e5, 7e5)
STEP, STROKE = 0.01, 0.036


def run(pressure, *, seed=0, scatter=0.02, between=0.0, cycles=5, speeds=(0.02, 0.03)):
    """A run with friction F0 + F1 p: at rest, then to and fro; the regulator lags by 4 kPa to each
    side.
    """
    rng = np.random.default_rng(seed + int(pressure / 1e4))
    friction = (F0 + F1 * pressure) * (1.0 + between * rng.standard_normal())
    position, force, gas = [np.zeros(15)], [np.zeros(15)], [np.zeros(15)]
    for _ in range(cycles):
        factor = 1.0 + scatter * rng.standard_normal()
        for way, speed in ((1, speeds[0]), (-1, speeds[1])):
            x = np.arange(0.0, STROKE, speed * STEP)
            x = x if way > 0 else STROKE - x
            position.append(x)
            begun = np.clip(np.abs(x - x[0]) / 4e-4, 0.0, 1.0)
            pull = way * factor * friction
            force.append(pull * begun ** (0.5 if len(force) > 1 else 0.0))
            gas.append(np.full(len(x), way * 4e3))
    position, force, gas = (np.concatenate(part) for part in (position, force, gas))
    force[16:19] = friction * np.array([0.7, 1.0, 0.9]) * RATIO
    gas = gas + pressure
    force = ZERO + AREA * gas + force
    noise = 0.003 * rng.standard_normal(len(force))
    time = STEP * np.arange(len(force))
    position = position + 2e-6 * rng.standard_normal(len(position))
    names = {"name": f"run_{pressure / 1e5:.0f}bar", "cylinder": "made"}
    return FrictionRecord.from_arrays(time, position, gas, force + noise, **names)


def runs(**options):
    return [run(pressure, **options) for pressure in PRESSURES]


# ------------------------------------------------------------------------ statistics


def test_level_means_with_extra_scatter():
    x = np.array([1.0, 2.0, 3.0, 4.0])
    design = np.column_stack([np.ones(4), x])
    own = np.full(4, 0.1)
    close = fit_levels(design, 1.0 + 2.0 * x + 0.02 * np.array([1, -1, -1, 1]), own)
    assert close.between == 0.0
    assert np.allclose(close.values, [1.0, 2.0], atol=1e-9)
    assert close.stderr[1] == pytest.approx(0.1 / np.sqrt(5.0), rel=1e-9)
    far = fit_levels(design, 1.0 + 2.0 * x + 2.0 * np.array([1, -1, -1, 1]), own)
    # four residuals of 2 and two spare levels: a variance of 8 in all
    assert far.between == pytest.approx(np.sqrt(8.0 - 0.01), rel=1e-6)
    assert far.redchi == pytest.approx(800.0, rel=1e-6)
    assert np.isnan(fit_levels(design[:2], x[:2], own[:2]).between)


def test_drifting_repeats_count_as_fewer():
    rng = np.random.default_rng(3)
    independent = np.mean([mean_of_series(rng.standard_normal(10))[1] for _ in range(300)])
    assert 0.9 / np.sqrt(10) < independent < 1.5 / np.sqrt(10)
    drift = np.linspace(-1.0, 1.0, 10)
    assert mean_of_series(drift)[1] == pytest.approx(np.std(drift, ddof=1) / np.sqrt(2.0), rel=0.1)
    assert mean_of_series(np.full(5, 2.0)) == (2.0, 0.0)


# ------------------------------------------------------------------- known friction


def test_known_friction_and_breakaway_are_recovered():
    fit = fit_cylinder_friction(runs(seed=1))
    for name, truth in (("f0", F0), ("f1", F1)):
        parameter = fit.params[name]
        assert abs(parameter.value - truth) < 3.0 * parameter.stderr
        assert 0.0 < parameter.stderr < 0.1 * truth
    assert fit.area == pytest.approx(AREA, rel=1e-3)
    assert fit.params["force_zero"].value == pytest.approx(ZERO, abs=0.1)
    assert fit.params["breakaway_ratio"].value == pytest.approx(RATIO, rel=0.03)
    assert fit.breakaway(3e5) == pytest.approx(RATIO * (F0 + F1 * 3e5), rel=0.05)
    assert (fit.ndata, fit.nvarys, fit.nfree) == (5, 2, 3)
    assert np.allclose(fit.best_fit + fit.residual, [level.friction for level in fit.levels])
    assert np.allclose(fit.predict(fit.pressures), fit.best_fit)


def test_standard_errors_tell_the_truth():
    slopes, held_out = [], []
    for seed in range(30):
        records = [run(p, seed=100 * seed, scatter=0.01, between=0.05, cycles=3) for p in PRESSURES]
        fit = fit_cylinder_friction(records, area=AREA)
        slope = fit.params["f1"]
        slopes.append((slope.value - F1) / slope.stderr)
        crossed = (item for item in fit.leave_one_pressure_out() if not item.extrapolated)
        held_out += [item.error / item.stderr for item in crossed]
    # a scatter that only the levels show, two or three of them to spare: Student's tails, so
    # medians and wide limits
    assert 0.7 < float(np.std(slopes)) < 1.6
    assert 0.5 < float(np.median(np.abs(held_out))) < 1.1


def test_held_out_pressures_are_predicted_with_their_error():
    fit = fit_cylinder_friction(runs(seed=2), fit_on=(1e5, 4e5, 7e5))
    found = fit.held_out()
    assert [round(item.level.pressure / 1e5) for item in found] == [2, 5]
    for item in found:
        assert abs(item.relative_error) < 0.05
        assert abs(item.error) < 4.0 * item.stderr
        assert not item.extrapolated
        assert item.breakaway == pytest.approx(item.level.breakaway, rel=0.1)
    crossed = fit.leave_one_pressure_out()
    assert [item.extrapolated for item in crossed] == [True, False, False, False, True]
    assert max(abs(item.relative_error) for item in crossed) < 0.1


def test_a_pause_of_the_logger_hides_the_breakaway():
    whole = run(3e5)

    def onset_without(first, last):
        rows = np.r_[0:first, last : len(whole)]
        columns = (whole.time, whole.position, whole.pressure, whole.force)
        record = FrictionRecord.from_arrays(*(values[rows] for values in columns))
        onset = onset_at_rest(pair_strokes(record), AREA)
        assert onset is not None
        return onset

    assert onset_without(15, 22).status == "missed"
    onset = onset_without(18, 25)
    assert onset.status == "at least"
    assert onset.ratio == pytest.approx(RATIO, rel=0.05)


def test_speed_and_pressure_are_told_apart_only_if_they_vary_apart():
    together = [run(p, speeds=(0.02 + 2e-8 * p, 0.03)) for p in PRESSURES]
    with pytest.raises(RecordingError, match="speed and pressure have a correlation of 1.00"):
        fit_cylinder_friction(together, law="linear_speed")
    speeds = zip(PRESSURES, (0.02, 0.04, 0.03, 0.02, 0.03), strict=True)
    apart = [run(p, speeds=(v, v)) for p, v in speeds]
    fit = fit_cylinder_friction(apart, law="linear_speed")
    assert abs(fit.params["fv"].value) < 3.0 * fit.params["fv"].stderr
    with pytest.raises(ParameterError, match="velocity is needed"):
        fit.predict(1e5)


def test_figure(tmp_path):
    fit = fit_cylinder_friction(runs(), fit_on=(1e5, 4e5, 7e5))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plot_cylinders([fit]).savefig(tmp_path / "friction.png")
    assert (tmp_path / "friction.png").stat().st_size > 20_000
    with pytest.raises(ParameterError, match="loop = 'no' is no run"):
        plot_cylinders([fit], loop="no")


# ------------------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("options", "message"), rows_of(__file__, "what_the_runs_do_not_determine_is_named")
)
def test_what_the_runs_do_not_determine_is_named(options, message):
    with pytest.raises(RecordingError, match=message):
        fit_cylinder_friction(runs(), **options)


# ----------------------------------------------------------------------------- files


def write(path, record):
    spare = [np.zeros(len(record))] * 3
    measured = [record.position * 1e3, record.pressure / 1e5, record.force]
    table = np.column_stack([record.time * 1e3, *spare, *measured])
    np.savetxt(path, table, fmt="%.6f", delimiter="\t")


def test_folder_with_a_duplicate(tmp_path):
    for pressure in (1e5, 3e5):
        write(tmp_path / f"A_{pressure / 1e5:.0f}bar.csv", run(pressure))
    (tmp_path / "B_1bar.csv").write_bytes((tmp_path / "A_1bar.csv").read_bytes())
    found = load_friction_folder(tmp_path)
    assert found.duplicates == [("B_1bar", "A_1bar")]
    assert list(found.cylinders) == ["A"]
    assert "B_1bar equals A_1bar byte for byte: left out" in found.issues
    back = found.cylinders["A"][1]
    assert np.allclose(back.force, run(3e5).force, atol=1e-5)
    assert np.allclose(back.pressure, run(3e5).pressure, atol=1.0)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(RecordingError, match="no file NAME_Nbar.csv is there"):
        load_friction_folder(tmp_path)
    write(tmp_path / "A_1bar.csv", run(1e5))
    for columns, message in (
        (("time [ms]", "force [N]"), "columns lists 2 names, but there are 7 columns"),
        (("time [ms]", *[""] * 4, "pressure [bar]", "force [N]"), "columns names no position"),
    ):
        with pytest.raises(RecordingError, match=message):
            load_friction_record(tmp_path / "A_1bar.csv", columns=columns)


# -------------------------------------------------------------------------- real set


@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not beside the project")
def test_real_cylinders():
    found = load_friction_folder(DATA)
    assert found.duplicates == [(f"O-ring_{bar}bar", f"Circle_{bar}bar") for bar in (1, 3, 5, 7)]
    counts = {name: len(records) for name, records in found.cylinders.items()}
    assert counts == {"Circle": 7, "Kidney_lc": 7, "O-ring257": 4, "X-ring257": 4}
    kidney = fit_cylinder_friction(found.cylinders["Kidney_lc"], fit_on=(1e5, 4e5, 7e5))
    assert max(abs(item.relative_error) for item in kidney.held_out()) < 0.10
    ring = fit_cylinder_friction(found.cylinders["O-ring257"])
    assert max(abs(item.relative_error) for item in ring.leave_one_pressure_out()) < 0.08
    assert ring.area == pytest.approx(np.pi / 4 * 0.0257**2, rel=0.01)
    # the X-ring is linear up to 5 bar, and then it is not: the law must say so
    sealed = found.cylinders["X-ring257"]
    (far,) = fit_cylinder_friction(sealed[:3], fit_on=(1e5, 3e5), area=ring.area).held_out()
    assert abs(far.relative_error) < 0.05
    whole = fit_cylinder_friction(sealed)
    assert whole.between > 1.0
    assert whole.redchi > 10.0
    rest = {level.name: level.rest.status for level in whole.levels if level.rest is not None}
    assert rest["X-ring257_7bar"] == "seen"
    assert rest["X-ring257_5bar"] == "missed"


# --------------------------------------------------------------- what it depends on


def test_pressure_is_named_where_speed_does_not_go_with_it():
    speeds = [(0.02, 0.03), (0.03, 0.045), (0.018, 0.026), (0.028, 0.04), (0.022, 0.03)]
    pairs = zip(PRESSURES, speeds, strict=True)
    records = [run(p, scatter=0.01, between=0.01, speeds=s) for p, s in pairs]
    found = compare_friction_laws(records, name="made")
    assert found.settled
    assert found.pressure > 0.98
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    assert found.probabilities["coulomb_pressure"] > 0.5
    assert "made: friction depends on pressure" in found.statement()


def test_pressure_is_not_named_where_speed_falls_with_it():
    falling = {p: (0.04 - 8e-8 * p, 0.05 - 1e-7 * p) for p in (2e5, 3e5, 4e5)}
    records = [run(p, scatter=0.01, speeds=speeds) for p, speeds in falling.items()]
    found = compare_friction_laws(records)
    assert not found.settled
    assert found.probabilities["stribeck"] > 0.03
    assert "not settled" in found.statement()
    assert "speed goes with pressure" in found.statement()
