"""The simulator that goes on sample by sample: the same run, restarts bit for bit, copies,
Ctrl-C.
"""

from __future__ import annotations

import copy
import os
import pickle
import threading

import numpy as np
import pytest

import pamrs
from pamrs.report.motion import write_animation
from tests.scripts import script
from tests.simulation.refusals import refused

COMMAND = 5.0 + 1.2 * np.sin(np.arange(300) * 0.05)


def rig() -> pamrs.Rig:
    """The shoulder with everything on that has a memory."""
    friction = {"friction_constant": 2.0, "friction_pressure": 2e-5, "presliding": 1e-3}
    warm = pamrs.rigs.shoulder().with_effect("heat_transfer")
    return warm.with_effect("muscle_hysteresis", friction)


def simulator(**changes: float) -> pamrs.Simulator:
    return pamrs.Simulator(rig(), sample_time=0.005, **changes)


def test_a_restart_is_exact_to_the_last_bit() -> None:
    first = simulator()
    first.run(COMMAND[:150])
    state = first.state
    straight = first.run(COMMAND[150:])
    again = simulator()
    again.restore(state)
    assert again.time == pytest.approx(0.75)
    for other in (again, pickle.loads(pickle.dumps(again)), copy.deepcopy(again)):
        for name, values in other.run(COMMAND[150:]).items():
            np.testing.assert_array_equal(values, straight[name], err_msg=name)


def test_reset_begins_again_with_other_values() -> None:
    one = simulator()
    one.run(COMMAND)
    assert one.reset({"muscle_pressure": 2e5})["muscle_pressure"] == pytest.approx(2e5)
    assert one.time == 0.0
    one.step(5.0)
    assert one.reset()["muscle_pressure"] == pytest.approx(2e5)


def test_a_rig_without_a_valve_needs_no_command() -> None:
    rig, start = pamrs.rigs.sealed_chamber(), {"muscle_pressure": 5e5}
    chamber = pamrs.Simulator(rig, sample_time=0.1, initial=start)
    assert chamber.step()["muscle_pressure"] == pytest.approx(5e5)


def test_bad_input_is_named_and_leaves_the_state_alone() -> None:
    one = simulator()
    one.run(COMMAND[:20])
    before = one.state
    refused(
        ("valve_command is missing", one.step),
        (r"valve_command\[0\] = nan", lambda: one.step(float("nan"))),
        (r"valve_command\[1\] = inf", lambda: one.run([5.0, np.inf])),
        ("state", lambda: one.restore(before[:-1])),
        (r"state\[0\]", lambda: one.restore(np.full(before.shape, np.nan))),
        ("sample_time = 0", lambda: pamrs.Simulator(rig(), sample_time=0)),
        ("unknown entry 'pressure'", lambda: one.reset({"pressure": 1.0})),
        (r"has 'length', but the rig .* no \[load\]", lambda: one.reset({"length": 0.2})),
        ("muscle_pressure", lambda: one.reset({"muscle_pressure": -1e9})),
    )
    for same in (one, pickle.loads(pickle.dumps(one))):
        np.testing.assert_array_equal(same.state, before)


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_ctrl_c_ends_a_long_run() -> None:
    said = script("""
        import os, signal, threading, time, numpy as np, pamrs
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background begins \
with it ignored
        rig = pamrs.rigs.shoulder()
        pamrs.simulate(rig, np.full(2, 5.0), sample_time=0.005)
        def press():
            time.sleep(0.3)
            print(time.perf_counter(), flush=True)
            os.kill(os.getpid(), signal.SIGINT)
        threading.Thread(target=press).start()
        try:
            pamrs.simulate(rig, np.full(4_000_000, 5.0), sample_time=0.005)
        except KeyboardInterrupt:
            print(time.perf_counter())
    """)
    pressed, ended = (float(line) for line in said)
    assert ended > pressed


def test_a_loop_is_the_run_of_its_commands_whatever_kind_of_number_they_are() -> None:
    arrays = (lambda u: np.array([u]), lambda u: {"": u}, lambda u: {"valve_command": u})
    one, kinds = simulator(), (float, np.float64, *arrays)

    def update(sample: dict[str, float]) -> object:
        k = round(sample["time"] / 0.005)
        return kinds[k // 2 % 5](COMMAND[k])

    run = one.control(update, 0.5, period=0.01)
    held = np.repeat(COMMAND[:100:2], 2)
    np.testing.assert_array_equal(run["valve_command"], [*held, held[-1]])
    again = simulator()
    for name, values in again.run(held).items():
        np.testing.assert_array_equal(run[name][1:], values, err_msg=name)
    assert run.events == again.events == one.events
    np.testing.assert_array_equal(one.state, again.state)
    assert one.observe() == {name: run[name][-1] for name in again.observe()}


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (float("nan"), r"valve_command\[0\] = nan"),
        (float("-inf"), r"valve_command\[0\] = -inf"),
        (None, "valve_command is missing"),
        ([5.0, 6.0], r"valve_command has the shape \(2,\)"),
        ({"extensor": 5.0}, "valve_command has 'extensor'"),
        ({"valve_command": 5.0, "length": 0.2}, "length is given"),
        ({"valve_command": 5.0, "pressure": 2e5}, "pressure is given"),
        ("five", "numbers are needed"),
    ],
)
def test_an_answer_that_cannot_be_is_named_and_stops_the_loop_at_its_sample(
    answer: object, message: str
) -> None:
    one, usual = simulator(), simulator()
    with pytest.raises(pamrs.ParameterError, match=message):
        one.control(lambda sample: answer if sample["time"] > 0.0099 else 5.5, 0.05)
    assert one.time == pytest.approx(0.01)
    usual.run([5.5, 5.5])
    np.testing.assert_array_equal(one.state, usual.state)


def test_an_animation_lasts_as_long_as_it_says(tmp_path) -> None:
    duration, speed = 0.5, 2.5
    image = pytest.importorskip("PIL.Image")
    command = np.full(int(duration * 50) + 1, 5.2)
    run = pamrs.simulate(pamrs.rigs.shoulder(), command, sample_time=0.02)
    lasts = 0.0
    with image.open(write_animation(run, tmp_path / "arm.gif", speed=speed)) as picture:
        for frame in range(picture.n_frames):
            picture.seek(frame)
            lasts += picture.info["duration"] / 1e3
    assert lasts == pytest.approx(duration / speed, abs=0.06)


def test_two_threads_lose_no_sample() -> None:
    simulator = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.001)
    refused: list[str] = []
    done: list[int] = []

    def work() -> None:
        for _ in range(300):
            try:
                simulator.run(np.full(20, 6.0))
                done.append(20)
            except RuntimeError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert round(simulator.time / 0.001) == sum(done)
    assert all("one thread at a time" in text for text in refused)
