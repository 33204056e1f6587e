"""A closed loop is the simulator with a controller: period, hold, sensors, restart."""

import copy
import math

import numpy as np
import pytest

import pamrs
from pamrs.control import Controller, Sensors, closed_loop, sweep
from pamrs.control.trajectories import degrees, lift_hold_return, step
from pamrs.errors import ParameterError
from tests.control.helpers import SmallPid
from tests.simulation.refusals import refused
from tests.tables import rows_of

LIFT = lift_hold_return(*degrees(15, 60), ramp=2.0, hold=1.0, duration=8.0)


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


class Listening(SmallPid):
    """Keeps what it was told and answered."""

    def reset(self):
        super().reset()
        self.heard = []

    def update(self, time, measurement, reference):
        command = super().update(time, measurement, reference)
        self.heard.append((time, dict(measurement), reference, command))
        return command


def test_the_command_is_held_from_one_sample_of_the_controller_to_the_next(rig):
    controller = Listening(period=0.008)
    run = closed_loop(rig, controller, LIFT, 1.0, sample_time=0.001)
    assert run.time.size == 1001
    assert len(controller.heard) == 125
    for k, (time, sample, reference, command) in enumerate(controller.heard):
        assert time == pytest.approx(0.008 * k)
        assert (run.command[8 * k : 8 * k + 8] == command).all()
        assert reference == LIFT(time)
        assert sample.pop("time") == pytest.approx(time)
        for name, value in sample.items():
            assert run.channels[name][8 * k] == value
    # the plant under these commands, without a controller, is the same to the last bit
    alone = pamrs.simulate(rig, run.command, sample_time=0.001)
    for name, values in run.channels.items():
        assert (alone[name] == values).all()
    assert run.reference.angle == pytest.approx(LIFT(run.time).angle)


def test_it_follows_and_its_metrics_are_those_of_its_rows(rig):
    run = closed_loop(rig, SmallPid(), lift_hold_return(*degrees(15, 60)))
    found = run.metrics()
    assert found.rms < math.radians(8)
    assert abs(found.phases["hold"]["final"]) < math.radians(4)
    assert set(found.phases) == {"lift", "hold", "return", "rest"}
    assert found.squared_error == pytest.approx(np.sum(run.error**2) * 1e-3, rel=1e-2)
    slower = closed_loop(rig, SmallPid(kp=1.0, ki=0.5), run.trajectory).metrics()
    assert slower.lag > found.lag > 0.1
    with pytest.raises(ParameterError, match="unit = ''.*'rad', 'deg' is needed"):
        run.metrics(unit="")


def test_a_restarted_loop_with_noise_and_delay_is_the_whole_one(rig):
    sensors = Sensors(noise={"joint_angle": 2e-3}, delay=0.02, seed=4)
    whole = closed_loop(rig, SmallPid(), LIFT, 3.0, sample_time=0.005, sensors=sensors)
    simulator, reader = pamrs.Simulator(rig, sample_time=0.005), sensors.started(0.005)
    controller, on = SmallPid(), {"start": 1.5, "reset": False}
    first = closed_loop(simulator, controller, LIFT, 1.5, sensors=reader)
    kept, state, learnt = copy.deepcopy(reader.state), simulator.state, controller.state
    second = closed_loop(simulator, controller, LIFT, 1.5, sensors=reader, **on)
    assert (np.concatenate([first.command[:-1], second.command]) == whole.command).all()
    # and from the state alone, in another process so to say
    simulator.restore(state)
    controller, other = SmallPid(), Sensors(noise={"joint_angle": 2e-3}, delay=0.02).started(0.005)
    controller.restore(learnt)
    other.restore(kept)
    again = closed_loop(simulator, controller, LIFT, 1.5, sensors=other, **on)
    assert (again.command == second.command).all()
    wrong = ({}, {**kept, "late": 3}, {**kept, "random": {}}, {**kept, "late": kept["late"] * 3})
    refused(
        *(("state", lambda one=one: other.restore(one)) for one in wrong),
        ("period", lambda: closed_loop(rig, SmallPid(period=0.01), LIFT, 0.1, sensors=reader)),
    )


def test_sensors_delay_round_and_are_noisy_as_said(rig):
    noisy = {"noise": {"joint_angle": 2e-3}, "resolution": {"muscle_pressure": 5e3}}
    controller = Listening()

    def looped(seed):
        sensors = Sensors(**noisy, delay=0.02, seed=seed)
        return closed_loop(rig, controller, LIFT, 2.0, sample_time=0.005, sensors=sensors)

    others, again, run = (looped(seed) for seed in (5, 4, 4))
    told, pressure = (
        np.array([heard[1][name] for heard in controller.heard])
        for name in ("joint_angle", "muscle_pressure")
    )
    late = np.maximum(np.arange(told.size) - 4, 0)
    noise = told - run.angle[late]
    assert noise.std() == pytest.approx(2e-3, rel=0.15)
    assert abs(noise.mean()) < 5e-4
    assert np.abs(pressure - run.channels["muscle_pressure"][late]).max() <= 2.5e3 + 1e-6
    assert pressure / 5e3 == pytest.approx(np.round(pressure / 5e3))
    assert (again.command == run.command).all()
    assert (others.command != run.command).any()


class Still(Controller):
    """Answers always the same, and has no state."""

    period = 0.005
    state = {}  # noqa: RUF012

    def __init__(self, answer):
        self.answer = answer

    def reset(self):
        """Nothing to forget."""

    def restore(self, state):
        """Nothing to go on from."""

    def update(self, time, measurement, reference):
        return self.answer


def test_a_regulator_and_named_blocks_are_driven_by_name():
    rig = pamrs.rigs.named("antagonistic_joint")
    first, second = rig.tables("valve")
    still, aim = Still(5.5), step(0.0, 0.1)

    def split_up(command):
        return {"valve_command": {first: command, second: 10.0 - command}}

    options = {"actuation": split_up, "measured": {"joint_angle": "joint_angle.elbow"}}
    run = closed_loop(rig, still, aim, 0.5, **options)
    split = {first: np.full(501, 5.5), second: np.full(501, 4.5)}
    alone = pamrs.simulate(rig, split, sample_time=0.001)
    assert (run.angle == alone["joint_angle.elbow"]).all()
    assert np.ptp(run.angle) > 0.01
    # a sweep names them as well
    kept = {"channels": ["joint_angle.elbow"], "sample_time": 0.001}
    many = sweep(rig, still, aim, 0.5, n=2, **options, **kept)
    assert (many.run["joint_angle.elbow"][0] == run.angle).all()
    assert many.largest[1] == pytest.approx(np.abs(run.error[::5]).max())
    refused(
        ("measured", lambda: closed_loop(rig, still, aim, 0.1, actuation=lambda u: {})),
        ("actuation", lambda: closed_loop(rig, still, aim, 0.1)),
        ("measured", lambda: sweep(rig, still, aim, 0.5, n=2, actuation=split_up)),
    )


def test_a_table_has_a_column_for_everything(rig):
    pytest.importorskip("pandas")
    run = closed_loop(rig, SmallPid(), LIFT, 0.5, channels=["muscle_pressure"])
    frame = run.to_pandas()
    units = {"time": "s", "reference": "rad", "reference_rate": "rad/s", "muscle_pressure": "Pa"}
    assert units.items() <= frame.attrs["units"].items()
    assert "command" not in frame.attrs["units"]
    channels = ["joint_angle", "joint_rate", "muscle_pressure"]
    assert list(frame.columns) == ["reference", "reference_rate", "command", *channels]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"sample_time": 0.003}, "controller.period"),
        ({"duration": 0.0123}, "duration"),
        ({"duration": math.nan}, "duration"),
        ({"channels": ["pressure"]}, "channels has 'pressure'"),
        ({"measured": {"joint_angle": "angle"}}, "measured"),
        ({"controller": SmallPid(kp=np.ones(3))}, "command"),
        ({"controller": SmallPid(kp=math.nan)}, "command at 0 s"),
        ({"controller": 3}, "controller"),
        ({"sensors": 3}, "sensors"),
        ({"controller": SmallPid(period=0.0)}, "controller.period"),
        ({"sensors": Sensors(delay=0.0031)}, "delay"),
        ({"sensors": Sensors(noise={"angle": 1.0})}, "angle"),
    ],
)
def test_bad_input_is_named(rig, change, word):
    arguments = {"controller": SmallPid(), "duration": 0.5, **change}
    with pytest.raises(ParameterError, match=word):
        closed_loop(rig, arguments.pop("controller"), LIFT, **arguments)


def test_bad_sensors_are_named():
    for bad in rows_of(__file__, "bad_sensors_are_named"):
        refused((next(iter(bad)), lambda bad=bad: Sensors(**bad)))


def test_degrees_for_radians_and_pressures_for_volts_are_refused():
    rig, far = pamrs.rigs.shoulder(), lift_hold_return(20.0, 60.0, ramp=2.0)
    told = "answered 2e.05 V.*put it in a pamrs.control.Cascade"
    refused(
        ("goes to 60 rad.*degrees converts", lambda: closed_loop(rig, SmallPid(), far)),
        (told, lambda: closed_loop(rig, Still(2e5), step(0.3, 0.4, duration=0.1))),
    )
