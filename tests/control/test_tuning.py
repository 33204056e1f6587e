"""Sweeps are their single runs; grids and searches find the same optimum; perturbed plants are what
they say.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import PID, Sensors, closed_loop, sweep
from pamrs.control.trajectories import degrees, lift_hold_return
from pamrs.control.tuning import gain_map, perturbed, search_gains
from pamrs.errors import ParameterError
from tests.control.helpers import SmallPid

LIFT = lift_hold_return(*degrees(15, 50), ramp=2.0, hold=1.0, duration=6.0)
FAST = {"duration": 3.0, "sample_time": 0.01}


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


def pid(kp, ki):
    return PID(kp, ki, 0.0, period=0.01)


@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_a_sweep_is_its_single_runs(rig, unit):
    kp, ki = np.array([1.0, 2.0, 1.5, 0.5]), np.array([0.5, 1.0, 0.0, 2.0])
    rigs = [rig.with_parameters({"arm.payload": m}) for m in (5.0, 9.0, 12.0, 5.0)]
    sensors = Sensors(noise={"joint_angle": 1e-4}, delay=0.01, seed=3)
    loop = {"duration": 3.0, "sample_time": 0.005, "sensors": sensors}
    whole = sweep(rigs, SmallPid(kp, ki), LIFT, channels=["joint_angle"], unit=unit, **loop)
    assert not whole.failed.any()
    for k in range(4):
        one = closed_loop(rigs[k], SmallPid(kp[k], ki[k]), LIFT, **loop)
        # side by side in lanes, the single ones are not: the last digits differ
        np.testing.assert_allclose(whole.run["joint_angle"][k], one.angle, rtol=1e-8)
        single = one.metrics(unit=unit)
        for name in ("squared_error", "curvature", "rms", "largest", "final"):
            assert getattr(whole, name)[k] == pytest.approx(getattr(single, name), rel=1e-7)


def test_the_loops_of_a_map_run_side_by_side(rig, monkeypatch):
    ways = []

    class Watched(pamrs.Batch):
        def control(self, *args, **options):
            ways.append(self.side_by_side)
            return super().control(*args, **options)

    monkeypatch.setattr("pamrs.simulation.Batch", Watched)
    axes = {"kp": [0.5, 1.0], "ki": [0.0, 1.0]}
    gain_map(rig, pid, axes, LIFT, payloads=[2.0, 9.0], **FAST)
    assert [way.tolist() for way in ways] == [[True] * 8]
    leaky = rig.with_effect("leak_muscle")
    gain_map(leaky, pid, axes, LIFT, payloads=[2.0, 9.0], **FAST)
    assert [way.tolist() for way in ways[1:]] == [[False] * 8]


def test_a_map_is_a_sweep_of_every_combination(rig):
    axes = {"kp": [0.5, 1.0, 2.0], "ki": [0.0, 1.0]}
    found = gain_map(rig, pid, axes, LIFT, payloads=[2.0, 9.0], **FAST)
    assert found.j.shape == (2, 3, 2)
    for p, mass in enumerate((2.0, 9.0)):
        loaded = rig.with_parameters({"arm.payload": mass})
        run = closed_loop(loaded, pid(2.0, 1.0), LIFT, **FAST).metrics()
        assert found.squared_error[p, 2, 1] == pytest.approx(run.squared_error, rel=1e-8)
        assert found.curvature[p, 2, 1] == pytest.approx(run.curvature, rel=1e-8)
    # J of the best is one only if it is best in both; each payload is a set of its own
    best = found.best()
    assert [row["payload"] for row in best] == [2.0, 9.0]
    for p, row in enumerate(best):
        nu, omega = found.squared_error[p], found.curvature[p]
        j = 0.25 * nu / nu.min() + 0.75 * omega / omega.min()
        assert found.j[p] == pytest.approx(j)
        assert row["j"] == pytest.approx(j.min())
        assert found.scale[p] == pytest.approx([nu.min(), omega.min()])
    least = found.rms[0].min()
    assert found.best("rms")[0]["rms"] == least
    assert least == pytest.approx(math.sqrt(found.squared_error[0].min() / 3.0))
    assert found.best("squared_error")[0]["squared_error"] == found.squared_error[0].min()


@pytest.mark.parametrize("method", ["cma", "optuna"])
def test_a_search_is_at_least_as_good_as_the_grid_and_seeded(rig, method):
    pytest.importorskip({"cma": "cma", "optuna": "optuna"}[method])
    bounds = {"kp": (0.2, 4.0), "ki": (0.0, 3.0)}
    axes = {name: np.linspace(*box, 6) for name, box in bounds.items()}
    grid = gain_map(rig, pid, axes, LIFT, **FAST)
    scale = tuple(grid.scale[0])
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    options = {"method": method, "evaluations": 64, "seed": 5, "scale": scale}
    found = [search_gains(rig, pid, bounds, LIFT, **options, **FAST) for _ in range(2)]
    assert (np.random.get_state()[1] == state).all()  # noqa: NPY002
    assert found[0].tried.shape == (64, 2)
    assert (found[0].tried == found[1].tried).all()
    assert found[0].j == found[1].j == found[0].values.min()
    assert found[0].j < 1.02 * grid.j.min()
    run = closed_loop(rig, pid(**found[0].gains), LIFT, **FAST).metrics()
    j = 0.25 * run.squared_error / scale[0] + 0.75 * run.curvature / scale[1]
    assert found[0].j == pytest.approx(j)


@pytest.mark.parametrize("method", ["cma", "optuna"])
@pytest.mark.parametrize("scaled", [True, False])
def test_a_search_is_never_worse_than_its_start(rig, method, scaled):
    pytest.importorskip(method)
    # one population of a wide box: without the start there is nothing as good as the best of a map
    bounds = {"kp": (0.1, 400.0), "ki": (0.0, 300.0)}
    grid = gain_map(rig, pid, {"kp": [0.7, 2.1], "ki": [0.0, 0.9]}, LIFT, **FAST)
    best = grid.best()[0]
    start = {name: best[name] for name in ("ki", "kp")}  # in any order
    more = {"evaluations": 8, "scale": tuple(grid.scale[0])} if scaled else {"evaluations": 16}
    more |= {"method": method, "population": 8, "seed": 4, **FAST}
    alone, found = (search_gains(rig, pid, bounds, LIFT, start=s, **more) for s in (None, start))
    first = 0 if scaled else 8
    assert found.tried.shape == alone.tried.shape
    assert found.tried[first].tolist() == [best["kp"], best["ki"]]
    assert found.squared_error[first] == pytest.approx(best["squared_error"], rel=1e-12)
    assert found.j <= found.values[first]
    assert found.tried[:first].tolist() == alone.tried[:first].tolist()
    if scaled:
        assert found.values[0] == pytest.approx(best["j"])
        assert found.j < alone.j


def test_a_search_without_a_scale_takes_that_of_its_first_population(rig):
    """And begins then, also on its bounds."""
    pytest.importorskip("cma")
    bounds, start = {"kp": (0.2, 4.0), "ki": (0.0, 3.0)}, {"kp": 4.0, "ki": 0.0}
    options = {"evaluations": 24, "population": 8, "seed": 1, "start": start}
    found = search_gains(rig, pid, bounds, LIFT, **options, **FAST)
    assert found.scale == pytest.approx((found.squared_error[:8].min(), found.curvature[:8].min()))
    assert found.values.size == 24
    assert found.tried[8].tolist() == [4.0, 0.0]


def searched(rig, bounds=None, **options):
    return search_gains(rig, pid, {"kp": (1.0, 2.0)} if bounds is None else bounds, LIFT, **options)


def test_a_controller_for_another_model_controls_the_perturbed_plant(rig):
    plant = perturbed(rig, seed=2)
    same, other = (
        gain_map(r, pid, {"kp": [2.0], "ki": [1.0]}, LIFT, **FAST).squared_error[0, 0, 0]
        for r in (rig, plant)
    )
    assert same != other
    assert other == pytest.approx(same, rel=0.3)


def test_perturbed_is_off_by_what_it_says(rig):
    plant = perturbed(rig, force=1.06, friction=0.9, inertia=1.04)
    for name, factor in {"viscous": 0.9, "coulomb": 0.9, "inertia": 1.04, "payload": 1.0}.items():
        found, known = (one.parameter(f"arm.{name}").value for one in (plant, rig))
        assert found == pytest.approx(factor * known)
    # at rest length the pressure's part of the force goes with the cross-section
    pull = [float(r.muscle.force(8e5, 0.0) - r.muscle.force(0.0, 0.0)) for r in (rig, plant)]
    assert pull[1] / pull[0] == pytest.approx(1.06, rel=0.02)
    factors = {
        n: perturbed(rig, seed=7).parameter(n).value / rig.parameter(n).value
        for n in ("arm.viscous", "arm.inertia")
    }
    assert all(0.025 <= abs(f - 1.0) <= 0.05 for f in factors.values())
    assert perturbed(rig, seed=7).model == perturbed(rig, seed=7).model
    assert perturbed(rig, seed=7).model != perturbed(rig, seed=8).model
    assert perturbed(rig).model == rig.model


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda r: perturbed(r, force=0.0), "force"),
        (lambda r: perturbed(r, seed=-1), "seed"),
        (lambda r: perturbed(r, seed=1, spread=2.0), "spread"),
        (lambda r: gain_map(r, pid, {}, LIFT), "axes"),
        (lambda r: gain_map(r, pid, {"kp": []}, LIFT), "kp"),
        (lambda r: gain_map(r, pid, {"kp": [1.0]}, LIFT, payloads=[]), "payloads"),
        (lambda r: searched(r, {}), "bounds"),
        (lambda r: searched(r, {"kp": (1.0, 1.0)}), "kp"),
        (lambda r: searched(r, {"kp": (1.0, math.nan)}), "kp"),
        (lambda r: searched(r, method="ga"), "method"),
        (lambda r: searched(r, evaluations=8), "population"),
        (lambda r: searched(r, evaluations=30, population=16), "evaluations"),
        (lambda r: searched(r, seed=-1), "seed"),
        (lambda r: searched(r, scale=(0.0, 1.0)), "scale"),
        (lambda r: searched(r, start={"kp": 2.5}), "start of kp = 2.5 .* 1 to 2"),
        (lambda r: searched(r, start={"kp": math.nan}), "start of kp = nan"),
        (lambda r: searched(r, start={"kp": "a"}), "start of kp = 'a'"),
        (lambda r: searched(r, start={"ki": 1.0}), "start = .*: one value each of kp"),
    ],
)
def test_bad_input_is_named(rig, call, word):
    with pytest.raises(ParameterError, match=word):
        call(rig)
