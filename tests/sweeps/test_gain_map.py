"""Maps of gains in a store are those of one batch."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

import pamrs
from pamrs import control, sweeps
from pamrs.control import trajectories, tuning

LIFT = trajectories.lift_hold_return(*trajectories.degrees(20, 60))
GAINS = {"kp": [0.5, 2.0], "ki": [0.5, 1.0, 1.5]}
OVER = {**{f"gain.{name}": values for name, values in GAINS.items()}, "arm.payload": [5.0, 9.0]}


@pytest.fixture
def kept(tmp_path):
    return {"store": tmp_path / "out.zarr", "progress": False}


def test_a_map_in_chunks_is_that_of_one_batch(kept):
    rig, law = pamrs.rigs.shoulder(), control.PID
    with ThreadPoolExecutor(2) as pool:
        kept |= {"duration": 0.3, "chunk": 4, "executor": pool}
        found = sweeps.gain_map(rig, law, OVER, LIFT, **kept)
    one = tuning.gain_map(rig, law, GAINS, LIFT, payloads=OVER["arm.payload"], duration=0.3)
    for name in ("rms", "squared_error", "curvature"):
        expected = np.moveaxis(getattr(one, name), 0, -1)
        np.testing.assert_array_equal(found[name].values, expected, err_msg=name)
    assert found["rms"].dims == tuple(OVER)
    assert found["squared_error"].attrs["units"] == "rad2 s"


def test_fixed_gains_and_geometry_belong_to_a_map(kept):
    rig = pamrs.rigs.shoulder()
    over = {"gain.ki": [0.5, 1.0], "joint.upper_offset": [0.02, 0.027432]}
    arguments = {"duration": 0.1, **kept}
    found = sweeps.gain_map(rig, partial(control.PID, 1.0), over, LIFT, **arguments)
    other = rig.with_parameters({"joint.upper_offset": 0.02})
    alone = control.sweep(other, control.PID(1.0, np.array([1.0])), LIFT, 0.1, n=1)
    assert float(found["rms"][1, 0]) == alone.rms[0]
    with pytest.raises(pamrs.ParameterError, match=r"controller: .*PID\(1.0\).*PID\(2.0\)"):
        sweeps.gain_map(rig, partial(control.PID, 2.0), over, LIFT, **arguments)


@pytest.mark.parametrize(
    ("controller", "trajectory", "message"),
    [
        (lambda kp: control.PID(kp), LIFT, "a class, or a function of a module"),
        (control.PID(1.0), LIFT, "a class, or a function of a module"),
        (control.PID, 3.0, "trajectory is a float"),
    ],
)
def test_what_no_other_process_finds_is_refused(kept, controller, trajectory, message):
    rig, over = pamrs.rigs.shoulder(), {"gain.kp": [1.0]}
    with pytest.raises(pamrs.ParameterError, match=message):
        sweeps.gain_map(rig, controller, over, trajectory, **kept)


def test_a_gain_without_its_prefix_and_a_length_are_told(tmp_path, kept):
    rig = pamrs.rigs.hanging_mass()
    with pytest.raises(pamrs.ParameterError, match="'kp': a gain is called 'gain.kp'"):
        sweeps.gain_map(rig, control.PID, {"kp": [1.0]}, LIFT, **kept)
    lift = trajectories.step(0.27, 0.25, duration=0.2)
    found = sweeps.gain_map(rig, by_length, {"gain.kp": [50.0, 100.0]}, lift, **kept)
    assert found["squared_error"].attrs["units"] == "m2 s"
    assert found["rms"].attrs["units"] == "m"
    bench, own = pamrs.rigs.bench(), {**kept, "store": tmp_path / "bench.zarr"}
    with pytest.raises(pamrs.ParameterError, match="frame, which prescribes"):
        sweeps.gain_map(bench, control.PID, {"gain.kp": [1.0]}, lift, **own)


def by_length(kp):
    return control.ByLength(control.PID(kp, period=0.005), pamrs.rigs.hanging_mass())
