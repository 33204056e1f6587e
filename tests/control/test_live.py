"""A live loop: what it does at jitter, dropouts, overruns, lost sensors, Ctrl-C and failures; the
safe command comes last, always.
"""

import math
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import pamrs
from pamrs.control import (
    PID,
    Cascade,
    HysteresisCompensation,
    Parallel,
    RigController,
    RigModel,
    closed_loop,
    sweep,
)
from pamrs.control.live import LiveError, SystemClock, run_live
from pamrs.control.simulated_device import FAULTS, SimulatedDevice, VirtualClock
from pamrs.control.trajectories import degrees, lift_hold_return
from tests.control.cases import ARM, CONTROLLERS, DIAGNOSED, PAIR, REGULATED
from tests.control.helpers import SmallPid, with_regulator
from tests.simulation.refusals import refused

LIFT = lift_hold_return(*degrees(15, 50), ramp=2.0, hold=1.0, duration=5.0)


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


def live(
    rig, controller=None, clock=None, device=None, kind=SimulatedDevice, trajectory=LIFT, **options
):
    """A live loop of a device of a kind, and the device; what it raises has it as ``device``."""
    clock, controller = clock or VirtualClock(), controller or SmallPid(period=0.01)
    made = kind(rig, clock, **(device or {}))
    try:
        return run_live(made, controller, trajectory, clock=clock, **options), made
    except BaseException as error:
        error.device = made
        raise


def test_on_time_it_is_the_simulated_loop(rig):
    linked = SmallPid(period=0.01)
    linked.lengths = (0.25, 0.3)  # of its links [m], within which its angles are not
    run, device = live(rig, linked)
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
    broken = {"dropouts": 0.15, "faults": (fault,), "seed": 4}
    pid = PID(2.0, 1.0, period=0.01)
    run, device = live(rig, pid, device=broken, stamp="time", most_missed=9)
    gone = np.isnan(run.channels["joint_angle"])
    assert run.reason == "finished"
    assert run.missed == gone.sum()
    assert 0.1 < gone.mean() < 0.2
    for k in np.flatnonzero(gone):
        assert run.command[k] == (run.command[k - 1] if k else 5.0)
    assert len(device.written) == (~gone).sum() + 2  # the safe command before and after


class Altered(SimulatedDevice):
    """A device whose readings pass through a function."""

    def __init__(self, rig, clock, change, **options):
        super().__init__(rig, clock, **options)
        self.change = change

    def read(self):
        return self.change(super().read())


def test_a_stale_reading_is_seen_by_its_time_or_a_counter(rig):
    stale = {"dropouts": 0.2, "faults": ("stale",), "seed": 1}

    def timeless(m):
        return {n: v for n, v in m.items() if n != "time"}

    for stamp, change, seen in (
        (None, dict, True),
        (None, timeless, False),
        ("frame", lambda m: {**timeless(m), "frame": round(1e3 * m["time"])}, True),
    ):
        run, _ = live(rig, kind=Altered, device={"change": change, **stale}, stamp=stamp)
        assert (50 < run.missed < 150) == seen
        assert seen or run.missed == 0


def test_what_cannot_be_is_no_reading(rig):
    def change(m):
        return {**m, "joint_angle": m["joint_angle"] + (7.0 if 1.0 < m["time"] < 1.03 else 0.0)}

    possible = {"joint_angle": (0.0, 2.2)}
    run, _ = live(rig, kind=Altered, device={"change": change}, plausible=possible)
    assert run.missed == 2
    assert (np.flatnonzero(np.isnan(run.channels["joint_angle"])) == [101, 102]).all()

    def going(m):
        return {"muscle_pressure": m["muscle_pressure"]} if m["time"] > 0.5 else m

    gone = {"kind": Altered, "device": {"change": going}}
    for lost in ({"plausible": {"elbow": (0.0, 1.0)}}, gone):
        run, _ = live(rig, **lost)
        assert (run.reason, run.missed) == ("lost_sensor", 6)


@pytest.mark.parametrize("safe", [5.0, 0.0])
def test_a_lost_sensor_is_a_safe_stop(rig, safe):
    run, device = live(
        rig, device={"lost_from": 2.0, "seed": 1}, stamp="time", most_missed=3, safe=safe
    )
    assert run.reason == "lost_sensor"
    assert run.missed == 4
    when, command = device.written[-1]
    assert command == safe
    assert when == pytest.approx(2.03)
    assert run.time[-1] == pytest.approx(2.03)


@pytest.mark.parametrize("safe", [5.0, 0.0])
def test_no_reading_at_all_commands_nothing_but_the_safe_value(rig, safe):
    """Which is written before the first reading."""
    nothing = {"lost_from": 0.0, "faults": ("none",)}
    run, device = live(rig, device=nothing, most_missed=5, safe=safe)
    assert (run.reason, run.time.size) == ("lost_sensor", 6)
    assert device.written == [(0.0, safe), (pytest.approx(0.05), safe)]
    assert device.command == safe


class Slow(SimulatedDevice):
    """One call takes its time."""

    def __init__(self, rig, clock, at, takes):
        super().__init__(rig, clock)
        self.at, self.takes = at, takes

    def read(self):
        reading = super().read()
        if self.clock.now() >= self.at:
            self.at = math.inf
            self.clock.sleep(self.takes)
        return reading


def test_a_reading_that_hung_is_not_acted_on(rig):
    for takes, reason, missed in ((0.025, "finished", 1), (1.0, "overrun", 1)):
        run, device = live(rig, kind=Slow, device={"at": 0.995, "takes": takes}, safe=0.0)
        assert (run.reason, run.missed) == (reason, missed)
        assert run.stall == pytest.approx(takes - 0.01, abs=0.006)
        assert np.isnan(run.channels["joint_angle"][100])
        after = [pair for pair in device.written if pair[0] > 0.9951]
        # the first command after it is of a new reading, or the safe one
        new = (1.025, after[0][1]) if reason == "finished" else (2.0, 0.0)
        assert after[0] == pytest.approx(new)


def test_an_answer_that_took_too_long_is_not_written(rig):
    clock = VirtualClock()

    class Thinking(SmallPid):
        def update(self, time, measurement, reference):
            if time == 1.0:
                clock.sleep(0.015)
            return super().update(time, measurement, reference)

    run, device = live(rig, Thinking(period=0.01), clock)
    assert (run.reason, run.missed, run.overruns) == ("finished", 1, 0)
    assert run.command[100] == run.command[99]
    # at 1.015 s only the answer to the sample of that moment
    assert [when for when, _ in device.written if 0.995 < when < 1.018] == [pytest.approx(1.015)]


def test_a_clock_that_goes_back_is_an_error_and_no_long_sleep(rig):
    class Jumping(VirtualClock):
        def now(self):
            return super().now() - (3600.0 if super().now() >= 1.0 else 0.0)

    with pytest.raises(LiveError, match="went back") as caught:
        live(rig, clock=Jumping(), safe=0.0)
    assert caught.value.device.written[-1][1] == 0.0
    assert caught.value.run.reason == "failed"
    assert caught.value.run.time.size == 100


def test_overruns_are_counted_and_left_out(rig):
    run, _ = live(rig, PID(2.0, 1.0, period=0.01), VirtualClock(stalls={1.0: 0.045}), most_missed=4)
    assert run.reason == "finished"
    assert run.overruns == 4
    assert run.time == pytest.approx(0.01 * np.arange(500))
    assert np.isnan(run.late).sum() == 4
    lost, _ = live(rig, None, VirtualClock(stalls={1.0: 0.5}), most_missed=4)
    assert lost.reason == "overrun"


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


@pytest.mark.parametrize("error", [ZeroDivisionError("oh"), math.nan])
def test_a_controller_that_fails_is_an_error_after_the_safe_command(rig, error):
    with pytest.raises(LiveError, match="at 1 s") as caught:
        live(rig, Failing(error), safe=0.0)
    assert caught.value.device.written[-1] == (pytest.approx(1.0), 0.0)
    assert caught.value.run.time.size == 100
    assert np.isfinite(caught.value.run.channels["joint_angle"]).all()


class Stubborn(SimulatedDevice):
    """From a second on so many writes fail, and use up what they are given."""

    def __init__(self, rig, clock, failures, **options):
        super().__init__(rig, clock, **options)
        self.failures = failures

    def write(self, command):
        if self.clock.now() >= 1.0 and self.failures:
            self.failures -= 1
            if isinstance(command, dict):
                command.popitem()
            raise OSError("bus")
        super().write(command)


def test_what_is_no_exception_goes_on_after_the_safe_command(rig):
    with pytest.raises(SystemExit) as caught:
        live(rig, Failing(SystemExit()), safe=0.0)
    assert caught.value.device.written[-1][1] == 0.0
    # and says so where that fails
    with pytest.raises(SystemExit) as caught:
        live(rig, Failing(SystemExit(3)), kind=Stubborn, device={"failures": 9}, safe=0.0)
    assert "could not be written: OSError bus" in caught.value.__notes__[0]


TERMINATED = """
import sys, pamrs
from pamrs.control import PID, run_live
from pamrs.control.trajectories import step

class Device:
    def read(self):
        return {"joint_angle": 0.3}
    def write(self, command):
        print(command, flush=True)

run_live(Device(), PID(2.0, period=0.01), step(0.3, 1.0, duration=30.0), safe=0.0)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_that_ends_the_program_leaves_the_safe_command(name):
    number = getattr(signal, name)
    with subprocess.Popen(
        [sys.executable, "-c", TERMINATED],
        stdout=subprocess.PIPE,
        text=True,
        # whoever runs the tests may ignore it (nohup), and a child would go on ignoring it
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    ) as child:
        first = [child.stdout.readline() for _ in range(5)]
        child.send_signal(number)
        rest = child.stdout.read().split()
        assert child.wait(30) == 128 + number
    assert float(first[0]) == 0.0
    assert float(first[4]) > 5.0
    assert float(rest[-1]) == 0.0


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_signals_are_the_programs_own_again_and_never_interrupt_the_safe_command(rig):
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]

    class Signalled(SimulatedDevice):
        """It gets a signal while its last command is written."""

        def write(self, command):
            if self.clock.now() >= 4.9999:
                os.kill(os.getpid(), signal.SIGTERM)
            super().write(command)

    with pytest.raises(SystemExit) as caught:
        live(rig, kind=Signalled, safe=0.0)
    assert caught.value.code == 128 + signal.SIGTERM
    assert caught.value.device.written[-1][1] == 0.0
    assert [signal.getsignal(number) for number in numbers] == before
    # what the program ignores stays ignored
    old = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert live(rig, kind=Signalled)[0].reason == "finished"
    finally:
        signal.signal(signal.SIGTERM, old)


def test_a_loop_runs_in_any_thread(rig):
    found = []
    thread = threading.Thread(target=lambda: found.append(live(rig)[0].reason))
    thread.start()
    thread.join()
    assert found == ["finished"]


def test_a_pressure_is_no_valve_command(rig):
    sliding = CONTROLLERS["sliding"](1.0).outer
    assert sliding.answers == "pressure"
    others = (CONTROLLERS["cascaded pid"](1.0).outer, HysteresisCompensation(sliding, DIAGNOSED))
    for one in (sliding, *others):
        refused(("Cascade", lambda one=one: closed_loop(rig, one, LIFT, 0.1)))
    refused(
        ("Cascade", lambda: live(rig, sliding)),
        ("Cascade", lambda: sweep(rig, sliding, LIFT, 0.1, n=2)),
        ("Cascade", lambda: Parallel(CONTROLLERS["feedforward"](1.0), sliding)),
    )
    assert closed_loop(rig, Cascade(sliding), LIFT, 0.1).command.max() <= 10.0
    # nor is a valve command a pressure, which 5 of 10 V would hardly be
    told = "outer is a .* with answers = 'valve', which is not allowed: 'pressure' is needed"
    refused(*((told, lambda n=n: Cascade(CONTROLLERS[n](1.0))) for n in ("pid", "sliding")))
    # with an actuation that knows what to do with it it is allowed
    known = {"actuation": lambda pressure: {"valve_command": 5.0 + 1e-7 * pressure}}
    assert closed_loop(rig, sliding, LIFT, 0.1, **known).command.max() > 10.0


def test_a_write_that_fails_is_tried_again_for_the_safe_command(rig):
    for failures, words in ((3, "bus$"), (9, "could not be written")):
        with pytest.raises(LiveError, match=words) as caught:
            live(rig, kind=Stubborn, device={"failures": failures}, safe=0.0)
        assert (caught.value.device.written[-1][1] == 0.0) == (failures == 3)


def test_the_machines_clock_runs_in_real_time(rig):
    clock = SystemClock()
    begin = clock.now()
    run = run_live(SimulatedDevice(rig, clock), SmallPid(period=0.02), LIFT, 0.2, most_missed=100)
    assert run.reason == "finished"
    assert clock.now() - begin >= 0.2


def test_bad_input_and_devices_that_cannot_be_are_named(rig):
    clock = VirtualClock()
    pair = SimulatedDevice(pamrs.rigs.named("antagonistic_joint"), clock)
    refused(
        ("safe", lambda: live(rig, safe=11.0)),
        ("limits", lambda: live(rig, limits=(5.0, 1.0))),
        ("limits", lambda: live(rig, limits=(0.0, 1.0, 2.0))),
        ("limits", lambda: live(rig, limits=5.0)),
        ("plausible", lambda: live(rig, plausible={"joint_angle": (1.0, 0.0)})),
        ("controller", lambda: live(rig, 3)),
        ("period", lambda: live(rig, SmallPid(period=0.0))),
        ("most_missed", lambda: live(rig, most_missed=-1)),
        ("duration", lambda: live(rig, duration=0.005)),
        ("bench.*no valve and no regulator", lambda: SimulatedDevice(pamrs.rigs.bench(), clock)),
        ("valve_command.flexor, valve_command.extensor", lambda: pair.write(5.0)),
        ("dropouts", lambda: SimulatedDevice(rig, clock, dropouts=2.0)),
        ("faults", lambda: SimulatedDevice(rig, clock, faults=("smoke",))),
        ("jitter", lambda: VirtualClock(-1.0)),
    )


# ---------------------------------------------------------------- several valves and joints


TURN = lift_hold_return(*degrees(30, 60), ramp=1.0, hold=1.0, duration=3.0)
BOTH = {
    "elbow": lift_hold_return(*degrees(12, 40), ramp=1.0, hold=1.0, duration=3.0),
    "wrist": TURN,
}
VALVES = ["valve_command.flexor", "valve_command.extensor"]


def rig_live(model, trajectory=TURN, device=None, made=RigController, kind=SimulatedDevice, **more):
    """A live loop of a controller of every command, which is made with the sliding law."""
    controller = made(model, model.law("sliding", period=0.01))
    return live(model.rig, controller, device=device, kind=kind, trajectory=trajectory, **more)


@pytest.mark.parametrize(
    ("model", "trajectory"),
    [(PAIR, TURN), (ARM, BOTH), (REGULATED, LIFT)],
    ids=["pair", "arm", "regulated"],
)
def test_on_time_a_loop_of_many_commands_is_the_simulated_one(model, trajectory):
    run, device = rig_live(model, trajectory=trajectory)
    controller = RigController(model, model.law("sliding", period=0.01))
    alone = closed_loop(model.rig, controller, trajectory, sample_time=0.001)
    assert run.reason == "finished"
    commands = run.command if isinstance(run.command, dict) else {"supply_command": run.command}
    assert set(commands) == set(alone.command)
    for name, values in commands.items():
        assert values == pytest.approx(alone.command[name][:-1:10], rel=1e-9, abs=1e-9)
    for name in alone.joints:
        assert run.channels[name] == pytest.approx(alone.channels[name][:-1:10], abs=1e-9)
    assert run.reference == pytest.approx(alone.reference.angle[..., :-1:10])
    closed = 0.0 if model is REGULATED else dict.fromkeys(commands, 5.0)
    assert run.safe_command == device.written[0][1] == device.written[-1][1] == closed


@pytest.mark.parametrize(
    ("safe", "expected"),
    [
        (None, (5.0, 5.0)),
        (0.0, (0.0, 0.0)),
        ({VALVES[1]: 0.0}, (5.0, 0.0)),
        (dict(zip(VALVES, (4.0, 6.0), strict=True)), (4.0, 6.0)),
    ],
)
def test_every_valve_gets_its_safe_command(safe, expected):
    run, device = rig_live(PAIR, device={"lost_from": 1.0}, stamp="time", safe=safe, most_missed=3)
    assert run.reason == "lost_sensor"
    wanted = dict(zip(VALVES, expected, strict=True))
    assert device.written[0] == (0.0, wanted)
    assert device.written[-1] == (pytest.approx(1.03), wanted)
    assert device.command == run.safe_command == wanted
    # what was read until then moved both valves, each by itself
    flexor, extensor = (run.command[name][:100] for name in VALVES)
    assert np.ptp(flexor) > 0.1
    assert np.ptp(extensor) > 0.1


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ZeroDivisionError("oh")])
def test_every_valve_gets_its_safe_command_at_ctrl_c_and_after_an_error(error):
    class Stopped(RigController):
        def update(self, time, measurement, reference):
            if time >= 1.0:
                raise error
            return super().update(time, measurement, reference)

    if isinstance(error, KeyboardInterrupt):
        run, device = rig_live(PAIR, made=Stopped)
        assert run.reason == "interrupted"
    else:
        with pytest.raises(LiveError, match="oh") as caught:
            rig_live(PAIR, made=Stopped)
        device = caught.value.device
    assert device.written[-1] == (pytest.approx(1.0), dict.fromkeys(VALVES, 5.0))


def test_a_driver_that_uses_up_its_commands_gets_all_of_them_again():
    lost = {"kind": Stubborn, "stamp": "time", "most_missed": 3}
    run, device = rig_live(PAIR, device={"failures": 2, "lost_from": 1.0}, **lost)
    assert (run.reason, device.failures) == ("lost_sensor", 0)
    assert device.written[-1][1] == run.safe_command == dict.fromkeys(VALVES, 5.0)
    # one that never writes is told with every command
    with pytest.raises(LiveError, match=r"safe commands {.*flexor': 5.0, .*extensor': 5.0} could"):
        rig_live(PAIR, device={"failures": 99, "lost_from": 1.0}, **lost)


def test_each_command_is_kept_within_its_own_limits():
    free, _ = rig_live(PAIR)
    assert all(values.min() < 3.0 for values in free.command.values())
    limits = {VALVES[0]: (4.0, 6.0), VALVES[1]: (3.0, 7.0)}
    run, _ = rig_live(PAIR, limits=limits)
    for name, (low, high) in limits.items():
        assert run.command[name].min() == low
        assert run.command[name].max() <= high
    same, _ = rig_live(PAIR, limits=(4.96, 5.04))
    assert [values.min() for values in same.command.values()] == [4.96, 4.96]


def test_a_controller_of_one_s_own_says_its_commands_by_the_safe_ones():
    class Both(SmallPid):
        answers = "inputs"

        def update(self, time, measurement, reference):
            seen = {"joint_angle": measurement["joint_angle.elbow"], "joint_rate": 0.0}
            u = super().update(time, seen, reference)
            return {"valve_command": {"flexor": u, "extensor": 10.0 - u}}

    def made(*_):
        return Both(period=0.01, kd=0.0)

    run, _ = rig_live(PAIR, made=made, safe=dict.fromkeys(VALVES, 5.0))
    flexor, extensor = (run.command[name] for name in VALVES)
    assert flexor + extensor == pytest.approx(np.full(300, 10.0))
    assert np.ptp(flexor) > 0.5
    refused((r"safe = None.*command_ranges", lambda: rig_live(PAIR, made=made)))
    with pytest.raises(LiveError, match=r"answered 'valve_command.flexor', 'valve_command.ext"):
        rig_live(PAIR, made=made, kind=OneValve, safe={VALVES[0]: 5.0})


@pytest.mark.parametrize("name", ["shoulder", "throttled_supply"])
def test_a_regulator_in_front_of_a_valve_holds_what_it_begins_with(name):
    """In front of it, or behind a line and its volume: the command is still that of the valve."""
    rig = with_regulator(pamrs.rigs.named(name))
    begins = rig.tables("supply")[""]["initial_pressure"]
    run, device = live(rig)
    alone = closed_loop(rig, SmallPid(period=0.01), LIFT, sample_time=0.001)
    assert run.reason == "finished"
    assert device.command == 5.0
    assert run.channels["joint_angle"] == pytest.approx(alone.angle[:-1:10], abs=1e-9)
    assert run.channels["supply_pressure"] == pytest.approx(np.full(500, begins))
    model = RigModel(rig)
    controller = RigController(model, model.law("sliding", period=0.01))
    assert list(controller.command_ranges) == ["valve_command"]
    whole, _ = live(rig, controller)
    alone = closed_loop(rig, controller, LIFT, sample_time=0.001)
    assert whole.command == pytest.approx(alone.command["valve_command"][:-1:10], abs=1e-9)


def test_a_regulator_in_front_of_a_valve_may_be_set_too():
    rig, clock = with_regulator(pamrs.rigs.shoulder()), VirtualClock()
    device = SimulatedDevice(rig, clock)
    device.write({"valve_command": 5.0, "supply_command": 6e5})
    clock.sleep(1.0)
    device.write({"valve_command": 6.0})
    clock.sleep(1.0)
    assert device.read()["supply_pressure"] == pytest.approx(6e5, rel=1e-6)
    assert device.command == 6.0
    wrong = ({"supply_command": 6e5}, {"valve_command": 5.0, "other": 1.0}, {})
    told = "a number for each of valve_command is"
    refused(*((told, lambda one=one: device.write(one)) for one in wrong))


class OneValve(SimulatedDevice):
    """A device that does not know of its second valve."""

    def write(self, command):
        super().write(dict.fromkeys(VALVES, command))


def test_bad_commands_are_named():
    one, flexor = VALVES[0], r"safe\['valve_command.flexor'\]"
    refused(
        ("valve_command.other", lambda: rig_live(PAIR, safe={"valve_command.other": 5.0})),
        (f"{flexor} = 11", lambda: rig_live(PAIR, safe=11.0)),
        ("'open' is not allowed", lambda: rig_live(PAIR, safe={one: "open"})),
        (f"{flexor} = 5", lambda: rig_live(PAIR, limits={one: (6.0, 7.0)})),
        (
            "limits has 'valve_command'",
            lambda: rig_live(PAIR, limits={"valve_command": (0.0, 7.0)}),
        ),
        ("those of the controller are 'elbow'", lambda: rig_live(PAIR, BOTH)),
    )
