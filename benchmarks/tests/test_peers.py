"""The peers of the benchmarks solve the same equations: only then do their times say anything."""

import numpy as np
import pytest

import pamrs
from benchmarks import peers
from benchmarks.goals import ALLOWED, Goal
from benchmarks.race import Ratio, race, ratio

SAMPLES = 201  # 1 s


@pytest.mark.parametrize("name", ["shoulder_numba", "shoulder_scipy"])
def test_one_run_is_the_same(name):
    module = peers.installed(name)
    if isinstance(module, str):
        pytest.skip(module)
    rig, command = peers.packaged(), peers.wave(SAMPLES)
    ours = pamrs.simulate(rig, command, sample_time=peers.SAMPLE_TIME, step=1e-3)
    payload = rig.model["arm"]["payload"]
    theirs = module.single(*peers.shoulder(rig), peers.opening(rig, command), payload)
    assert np.degrees(np.abs(theirs[:, 2] - ours["joint_angle"])).max() < ALLOWED
    assert np.ptp(np.degrees(ours["joint_angle"])) > 10.0
    gauge = theirs[:, :2] - rig.model["gas"]["ambient_pressure"]
    for column, channel in enumerate(("muscle_pressure", "supply_pressure")):
        assert np.abs(gauge[:, column] - ours[channel]).max() < 20.0, channel


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("shoulder_numba", "batch"),
        ("shoulder_jax", "batch"),
        ("shoulder_jax", "batch_diffrax"),
    ],
)
def test_a_batch_is_the_same(module, name):
    found = peers.installed(module)
    if isinstance(found, str):
        pytest.skip(found)
    if name == "batch_diffrax":
        pytest.importorskip("diffrax")
    rig, command, payloads = peers.packaged(), peers.wave(SAMPLES), np.array([0.0, 7.0, 20.0])
    theirs = getattr(found, name)(*peers.shoulder(rig), peers.opening(rig, command), payloads)
    for payload, end in zip(payloads, theirs, strict=True):
        run = pamrs.simulate(
            rig.with_parameters({"arm.payload": payload}),
            command,
            sample_time=peers.SAMPLE_TIME,
            step=1e-3,
        )
        assert np.degrees(abs(run["joint_angle"][-1] - end)) < ALLOWED


def test_a_missing_peer_is_named():
    assert "not installed" in str(peers.installed("shoulder_that_is_not_there"))


def test_a_ratio_is_taken_turn_by_turn():
    found = ratio({"a": np.array([1.0, 2.0, 4.0]), "b": np.array([2.0, 4.0, 8.0])}, "b", "a")
    assert found == Ratio(2.0, 2.0, 2.0)
    times = race({"a": lambda: None, "b": lambda: sum(range(10))}, repeats=2, least=0.0)
    assert {name: found.shape for name, found in times.items()} == {"a": (2,), "b": (2,)}


def test_a_goal_needs_the_same_result():
    def verdict(middle, apart):
        return Goal("", "", 1.0, 1.0, Ratio(middle, middle, middle), apart, 4.0).verdict

    assert verdict(5.0, 1e-6) == "met"
    assert verdict(3.0, 1e-6) == "not met"
    assert verdict(50.0, 0.1) == "not the same result"
