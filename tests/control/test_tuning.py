"""Sweeps are their single runs; grids and searches find the same optimum."""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import PID, Sensors, closed_loop, sweep
from pamrs.control.trajectories import degrees, lift_hold_return
from pamrs.control.tuning import gain_map, search_gains
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

    monkeypatch.setattr("pamrs.control._sweeping.Batch", Watched)
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


BOX = {"kp": (0.2, 4.0), "ki": (0.0, 3.0)}


def test_a_search_is_at_least_as_good_as_the_grid_and_seeded(rig):
    grid = gain_map(
        rig, pid, {name: np.linspace(*box, 6) for name, box in BOX.items()}, LIFT, **FAST
    )
    scale = tuple(grid.scale[0])
    options = {"generations": 4, "seed": 5, "scale": scale}
    found = [search_gains(rig, pid, BOX, LIFT, **options, **FAST) for _ in range(2)]
    assert found[0].tried.shape == (65, 2)
    assert (found[0].tried == found[1].tried).all()
    assert found[0].j == found[1].j == found[0].values.min()
    assert found[0].j < 1.02 * grid.j.min()
    run = closed_loop(rig, pid(**found[0].gains), LIFT, **FAST).metrics()
    j = 0.25 * run.squared_error / scale[0] + 0.75 * run.curvature / scale[1]
    assert found[0].j == pytest.approx(j)


def test_a_search_is_never_worse_than_its_start(rig):
    # one population of a wide box: without the start there is nothing as good as the best of a map
    bounds = {"kp": (0.1, 400.0), "ki": (0.0, 300.0)}
    grid = gain_map(rig, pid, {"kp": [0.7, 2.1], "ki": [0.0, 0.9]}, LIFT, **FAST)
    best = grid.best()[0]
    start = {name: best[name] for name in ("ki", "kp")}  # in any order
    more = {"generations": 1, "population": 8, "seed": 4, **FAST}
    scale = tuple(grid.scale[0])
    alone, found = (
        search_gains(rig, pid, bounds, LIFT, start=s, scale=scale, **more) for s in (None, start)
    )
    assert found.tried.shape == alone.tried.shape == (9, 2)
    assert found.tried[0].tolist() == [best["kp"], best["ki"]]
    assert found.values[0] == pytest.approx(best["j"])
    assert found.j <= found.values[0]
    assert found.j < alone.j
    # without a scale J is one at the start
    own = search_gains(rig, pid, bounds, LIFT, start=start, **more)
    assert own.values[0] == pytest.approx(1.0)
    assert own.scale == pytest.approx((best["squared_error"], best["curvature"]))


def searched(rig, bounds=None, **options):
    given = {"kp": (1.0, 2.0)} if bounds is None else bounds
    return search_gains(rig, pid, given, LIFT, **options, **FAST)


def test_what_a_controller_refuses_in_a_search_is_named(rig):
    def made(kp):
        return PID(kp, 0.0, 0.0, period=0.01 if kp.size == 1 else -1.0)

    with pytest.raises(ParameterError, match="period"):
        search_gains(rig, made, {"kp": (1.0, 2.0)}, LIFT, **FAST)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda r: gain_map(r, pid, {}, LIFT), "axes"),
        (lambda r: gain_map(r, pid, {"kp": []}, LIFT), "kp"),
        (lambda r: gain_map(r, pid, {"kp": [1.0]}, LIFT, payloads=[]), "payloads"),
        (lambda r: searched(r, {}), "bounds"),
        (lambda r: searched(r, {"kp": (1.0, 1.0)}), "kp"),
        (lambda r: searched(r, {"kp": (1.0, math.nan)}), "kp"),
        (lambda r: searched(r, population=4), "population"),
        (lambda r: searched(r, seed=-1), "seed"),
        (lambda r: searched(r, generations=0), "generations"),
        (lambda r: searched(r, scale=(0.0, 1.0)), "scale"),
        (lambda r: searched(r, start={"kp": 2.5}), "start of kp = 2.5 .* 1 to 2"),
        (lambda r: searched(r, start={"kp": math.nan}), "start of kp = nan"),
        (lambda r: searched(r, start={"kp": "a"}), "start of kp = 'a'"),
        (lambda r: searched(r, start={"ki": 1.0}), "start = .* one value each of kp"),
    ],
)
def test_bad_input_is_named(rig, call, word):
    with pytest.raises(ParameterError, match=word):
        call(rig)
