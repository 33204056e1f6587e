"""A live loop: what it does at jitter, dropouts, overruns, lost sensors, Ctrl-C and failures; the safe command comes last, always."""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control import PID, closed_loop
from pamrs.control.live import LiveError, SystemClock, run_live
from pamrs.control.simulated_device import FAULTS, SimulatedDevice, VirtualClock
from pamrs.control.trajectories import degrees, lift_hold_return
from pamrs.errors import ParameterError
from tests.unit.control_helpers import SmallPid

LIFT = lift_hold_return(*degrees(15, 50), ramp=2.0, hold=1.0, duration=5.0)


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


def live(rig, controller=None, clock=None, device=None, **options):
    clock = clock or VirtualClock()
    device = SimulatedDevice(rig, clock, **(device or {}))
    return run_live(device, controller or SmallPid(period=0.01), LIFT, clock=clock, **options), device


def test_on_time_it_is_the_simulated_loop(rig):
    run, device = live(rig)
    alone = closed_loop(rig, SmallPid(period=0.01), LIFT, sample_time=0.001)
    assert run.reason == "finished"
    assert run.command == pytest.approx(alone.command[:-1:10], abs=1e-9)
    assert run.channels["joint_angle"] == pytest.approx(alone.angle[:-1:10], abs=1e-9)
    assert (run.missed, run.overruns) == (0, 0)
    assert run.latest < 1e-9
    assert device.written[-1] == (pytest.approx(5.0), 5.0)


def test_jitter_is_measured_and_borne(rig):
    run, _ = live(rig, PID(2.0, 1.0, period=0.01), VirtualClock(1e-3, seed=2))
    assert run.reason == "finished"
    assert run.jitter == pytest.approx(1e-3, rel=0.2)  # of an exponential distribution, its mean
    assert run.overruns == 0
    even, _ = live(rig, PID(2.0, 1.0, period=0.01))
    error = [np.sqrt(np.mean((r.channels["joint_angle"] - r.reference) ** 2)) for r in (run, even)]
    assert error[0] == pytest.approx(error[1], rel=0.1)
    assert error[0] != error[1]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_missed_reading_holds_the_command_and_the_controller_keeps_its_time(rig, fault):
    run, device = live(
        rig, PID(2.0, 1.0, period=0.01), device={"dropouts": 0.15, "faults": (fault,), "seed": 4}, stamp="time", most_missed=9
    )
    gone = np.isnan(run.channels["joint_angle"])
    assert run.reason == "finished"
    assert run.missed == gone.sum()
    assert 0.1 < gone.mean() < 0.2
    for k in np.flatnonzero(gone):
        assert run.command[k] == (run.command[k - 1] if k else 5.0)
    assert len(device.written) == (~gone).sum() + 1


def test_a_stale_reading_is_only_seen_by_its_stamp(rig):
    run, _ = live(rig, device={"dropouts": 0.2, "faults": ("stale",), "seed": 1})
    assert run.missed == 0


@pytest.mark.parametrize("safe", [5.0, 0.0])
def test_a_lost_sensor_is_a_safe_stop(rig, safe):
    run, device = live(rig, device={"lost_from": 2.0, "seed": 1}, stamp="time", most_missed=3, safe=safe)
    assert run.reason == "lost_sensor"
    assert run.missed == 4
    when, command = device.written[-1]
    assert command == safe
    assert when == pytest.approx(2.03)
    assert run.time[-1] == pytest.approx(2.03)
    angle = device.simulator.observe()["joint_angle"]
    after = pamrs.Simulator(rig, sample_time=0.001)
    after.restore(device.simulator.state)
    moved = after.run(np.full(3000, safe))["joint_angle"][-1]
    if safe == 0.0:
        assert moved < math.radians(20)  # vented, the arm comes down
    else:
        assert abs(moved - angle) < math.radians(25)  # closed, it stays about where it was
        assert moved > math.radians(25)


def test_no_reading_at_all_commands_nothing_but_the_safe_value(rig):
    run, device = live(rig, device={"lost_from": 0.0, "faults": ("none",)}, most_missed=5, safe=5.0)
    assert run.reason == "lost_sensor"
    assert run.time.size == 6
    assert [command for _, command in device.written] == [5.0]


def test_overruns_are_counted_and_left_out(rig):
    run, _ = live(rig, PID(2.0, 1.0, period=0.01), VirtualClock(stalls={1.0: 0.045}), most_missed=4)
    assert run.reason == "finished"
    assert run.overruns == 4
    assert run.time == pytest.approx(0.01 * np.arange(500))
    assert np.isnan(run.late).sum() == 4
    lost, _ = live(rig, None, VirtualClock(stalls={1.0: 0.5}), most_missed=4)
    assert lost.reason == "lost_sensor"


class Failing(SmallPid):
    def __init__(self, error, at=1.0):
        super().__init__(period=0.01)
        self.error, self.at = error, at

    def update(self, time, measurement, reference):
        if time >= self.at:
            if isinstance(self.error, float):
                return self.error
            raise self.error
        return super().update(time, measurement, reference)


def test_ctrl_c_gives_the_record_and_the_safe_command(rig):
    run, device = live(rig, Failing(KeyboardInterrupt()), safe=0.0)
    assert run.reason == "interrupted"
    assert run.time.size == 100
    assert device.written[-1][1] == 0.0


@pytest.mark.parametrize("error", [ZeroDivisionError("oh"), math.nan])
def test_a_controller_that_fails_is_an_error_after_the_safe_command(rig, error):
    clock = VirtualClock()
    device = SimulatedDevice(rig, clock)
    with pytest.raises(LiveError, match="at 1 s"):
        run_live(device, Failing(error), LIFT, clock=clock, safe=0.0)
    assert device.written[-1] == (pytest.approx(1.0), 0.0)


def test_what_is_no_exception_goes_on_after_the_safe_command(rig):
    clock = VirtualClock()
    device = SimulatedDevice(rig, clock)
    with pytest.raises(SystemExit):
        run_live(device, Failing(SystemExit()), LIFT, clock=clock, safe=0.0)
    assert device.written[-1][1] == 0.0


def test_a_write_that_fails_is_tried_again_for_the_safe_command(rig):
    class Stubborn(SimulatedDevice):
        def __init__(self, failures, *arguments):
            super().__init__(*arguments)
            self.failures = failures

        def write(self, command):
            if self.clock.now() >= 1.0 and self.failures:
                self.failures -= 1
                raise OSError("bus")
            super().write(command)

    for failures, words in ((3, "bus$"), (9, "could not be written")):
        clock = VirtualClock()
        device = Stubborn(failures, rig, clock)
        with pytest.raises(LiveError, match=words):
            run_live(device, SmallPid(period=0.01), LIFT, clock=clock, safe=0.0)
        assert (device.written[-1][1] == 0.0) == (failures == 3)


def test_the_machines_clock_runs_in_real_time(rig):
    clock = SystemClock()
    begin = clock.now()
    run = run_live(SimulatedDevice(rig, clock), SmallPid(period=0.02), LIFT, 0.2, most_missed=100)
    assert run.reason == "finished"
    assert clock.now() - begin >= 0.2


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"safe": 11.0}, "safe"),
        ({"limits": (5.0, 1.0)}, "limits"),
        ({"most_missed": -1}, "most_missed"),
        ({"duration": 0.005}, "duration"),
    ],
)
def test_bad_input_is_named(rig, change, word):
    clock = VirtualClock()
    with pytest.raises(ParameterError, match=word):
        run_live(SimulatedDevice(rig, clock), SmallPid(period=0.01), LIFT, clock=clock, **change)
    for wrong in ({"dropouts": 2.0}, {"faults": ("smoke",)}):
        with pytest.raises(ParameterError, match=next(iter(wrong))):
            SimulatedDevice(rig, clock, **wrong)
    with pytest.raises(ParameterError, match="jitter"):
        VirtualClock(-1.0)
