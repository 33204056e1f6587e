"""The channels that a run keeps."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.simulation._simulation import core_rig

ROWS, SAMPLE = 60, 0.01
STATES = ("supply_pressure", "muscle_pressure", "joint_angle", "joint_rate")
#: Rigs that lanes take, that they do not, and whose readings are no states.
RIGS = {
    "shoulder": pamrs.rigs.shoulder,
    "antagonistic_joint": pamrs.rigs.antagonistic_joint,
    "blow_down_tank": pamrs.rigs.blow_down_tank,
    "hanging_mass": pamrs.rigs.hanging_mass,
    "late pressures": lambda: pamrs.rigs.shoulder().with_effect("clock_skew", {"offset": 0.02}),
}


def signals(rig: pamrs.Rig) -> dict[str, np.ndarray]:
    wave = np.sin(8.0 * SAMPLE * np.arange(ROWS))
    valves = [(v["null_voltage"], v["half_range"]) for v in rig.tables("valve").values()]
    given = [null + 0.6 * half * wave for null, half in valves] or [4e5 + 1e5 * wave]
    return dict(zip(core_rig(rig).inputs, given, strict=False))


@pytest.mark.parametrize("name", RIGS)
def test_what_is_kept_is_what_a_whole_run_has(name):
    core = core_rig(RIGS[name]())
    given = signals(RIGS[name]())
    whole, events = core.simulate(ROWS, given, SAMPLE, 1e-3, {})
    # each channel alone, and all in another order
    for record in [*([channel] for channel in core.channels), list(core.channels)[::-1]]:
        kept, seen = core.simulate(ROWS, given, SAMPLE, 1e-3, {}, record)
        assert list(kept) == record
        assert seen == events
        for channel in record:
            np.testing.assert_array_equal(kept[channel], whole[channel], err_msg=channel)


@pytest.mark.parametrize("record", [[], ["joint_angle"], ["joint_torque"]])
def test_a_run_of_one_row(record):
    run = pamrs.simulate(pamrs.rigs.shoulder(), [5.0], sample_time=SAMPLE, record=record)
    assert [values.size for values in run.values()] == [1] * (2 + len(record))


def test_a_run_that_leaves_the_curves_keeps_the_same():
    """An arm thrown beyond its stop goes on by the equations of the blocks."""
    rig = pamrs.rigs.shoulder()
    drive = {"sample_time": SAMPLE, "initial": {"joint_rate": 30.0}}
    whole = pamrs.simulate(rig, np.full(ROWS, 6.0), **drive)
    kept = pamrs.simulate(rig, np.full(ROWS, 6.0), **drive, record=STATES)
    low, high = (rig.model["joint"][end] for end in ("min_angle", "max_angle"))
    assert whole["joint_angle"].max() > high + 0.25 * (high - low)
    for channel in STATES:
        np.testing.assert_array_equal(kept[channel], whole[channel])


def test_a_prescribed_pressure_needs_no_sums():
    rig = pamrs.rigs.bench(pamrs.rigs.shoulder().muscle)
    pressure = 2e5 + 1e5 * np.sin(8.0 * SAMPLE * np.arange(ROWS))
    length = np.full(ROWS, rig.model["muscle"]["rest_length"])
    drive = {"sample_time": SAMPLE, "pressure": pressure, "length": length}
    whole = pamrs.simulate(rig, **drive)
    kept = pamrs.simulate(rig, **drive, record=["muscle_force"])
    np.testing.assert_array_equal(kept["muscle_force"], whole["muscle_force"])


def test_a_run_of_some_channels_says_what_it_lacks():
    command = np.full(ROWS, 6.0)
    run = pamrs.simulate(pamrs.rigs.shoulder(), command, sample_time=SAMPLE, record=STATES)
    assert list(run) == ["time", "valve_command", *STATES]
    for ask in (lambda: run.balance, run.summary):
        with pytest.raises(pamrs.ParameterError, match="record left out .*joint_torque"):
            ask()


@pytest.mark.parametrize(
    ("record", "message"),
    [("joint_angle", "record = 'joint_angle'"), (["angle"], "'angle' is not a channel; there are")],
)
def test_what_is_no_channel_is_refused(record, message):
    with pytest.raises((pamrs.ParameterError, pamrs.RigError), match=message):
        pamrs.simulate(pamrs.rigs.shoulder(), [5.0, 5.0], sample_time=SAMPLE, record=record)
