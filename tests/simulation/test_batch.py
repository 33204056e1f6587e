"""A batch is so many simulators, to the last bit where its plants run one by one, to 1e-9 where
they run in lanes; a plant that ends takes none along."""

from __future__ import annotations

import copy
import os
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.simulation import core_rig
from pamrs.simulation._plants import thread_count
from tests.scripts import script
from tests.simulation.refusals import refused

DT = 0.002


def shoulders(n: int, **changes: Any) -> pamrs.Batch:
    return pamrs.Batch(pamrs.rigs.shoulder(), n=n, **{"sample_time": DT, **changes})


def commands(n: int, sample: int) -> np.ndarray:
    return 5.2 + 0.5 * np.sin(0.37 * np.arange(n) + 0.05 * sample)


def signals(rig: pamrs.Rig, n: int, sample: int) -> dict[str, Any]:
    """Commands of n plants of any packaged rig, other ones for each."""
    given: dict[str, Any] = {}
    for name in core_rig(rig).inputs:
        channel, _, block = name.partition(".")
        volts = commands(n, sample + 14 * len(given.get(channel, ())))
        values = volts if channel == "valve_command" else 3e5 + 2e4 * volts
        given.setdefault(channel, {})[block] = values
    for load in rig.tables("load").values():
        if load["kind"] == "frame":
            low, high = load["min_length"], load["max_length"]
            wave = np.sin(0.1 * sample + np.arange(n))
            given["length"] = 0.5 * (high + low) + 0.2 * (high - low) * wave
            given["pressure"] = 2e5 + 1e4 * np.arange(n) + 1e3 * sample
    return given


def row_of(given: dict[str, Any], row: int) -> dict[str, Any]:
    return {
        name: row_of(values, row) if isinstance(values, dict) else float(values[row])
        for name, values in given.items()
    }


def agree(batch: pamrs.Batch, found: Any, wanted: Any, what: str = "") -> None:
    """The same bits, or in lanes to 1e-9 of the largest magnitude."""
    found, wanted = np.asarray(found), np.asarray(wanted)
    most = 1e-9 * np.abs(wanted).max() if batch.side_by_side.all() else 0.0
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=most, err_msg=what)


def same(one: Any, other: Any) -> None:
    assert one["samples"] == other["samples"]
    assert one["status"] == other["status"]
    for row, (a, b) in enumerate(zip(one["rows"], other["rows"], strict=True)):
        np.testing.assert_array_equal(a, b, err_msg=f"row {row}")


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_every_row_is_the_simulator_of_its_commands(name: str) -> None:
    rig = pamrs.rigs.named(name)
    n, samples = 4, 40
    batch = pamrs.Batch(rig, n=n, sample_time=0.005, threads=2)
    ones = [pamrs.Simulator(rig, sample_time=0.005) for _ in range(n)]
    seen, alone = [], []
    for k in range(samples):
        given = signals(rig, n, k)
        seen.append(batch.step(**given))
        rows = [one.step(**row_of(given, row)) for row, one in enumerate(ones)]
        alone.append({channel: [row[channel] for row in rows] for channel in rows[0]})
    assert list(seen[0]) == list(alone[0])
    for channel in seen[0]:
        agree(batch, [s[channel] for s in seen], [a[channel] for a in alone], channel)
    assert batch.time == ones[0].time
    for row, one in enumerate(ones):
        agree(batch, batch.state["rows"][row], one.state)
    if len(core_rig(rig).inputs) and name != "blow_down_tank":
        assert any(np.ptp(values) > 0.0 for values in seen[-1].values())


def test_lanes_hold_the_rigs_that_simulate_batch_runs_in_them() -> None:
    # the antagonists' friction remembers their direction, and muscles of a pair may go slack
    lanes = {"shoulder", "elbow", "regulated_joint", "hanging_mass", "throttled_supply"}
    for name in pamrs.rigs.names():
        found = pamrs.Batch(pamrs.rigs.named(name), n=2, sample_time=DT).side_by_side
        np.testing.assert_array_equal(found, [name in lanes] * 2, err_msg=name)
    warm = pamrs.rigs.shoulder().with_effect("heat_transfer")
    mixed = pamrs.Batch([SHOULDER, warm, SHOULDER], sample_time=DT)
    assert mixed.side_by_side.tolist() == [True, False, True]
    ones = [pamrs.Batch([rig], sample_time=DT) for rig in mixed.rigs]
    for k in range(20):
        seen, each = mixed.step(5.0 + 0.05 * k), [one.step(5.0 + 0.05 * k) for one in ones]
    for channel, values in seen.items():
        np.testing.assert_array_equal(values, [one[channel][0] for one in each], err_msg=channel)


SHOULDER, REGULATED = pamrs.rigs.shoulder(), pamrs.rigs.named("regulated_joint")
LATE = SHOULDER.with_effect("clock_skew", {"offset": 0.013, "rate": 0.001})
FRICTION = {"friction_constant": 2.0, "friction_pressure": 2e-5, "presliding": 1e-3}
MEMORY = LATE.with_effect("muscle_hysteresis", FRICTION).with_effect("heat_transfer")


@pytest.mark.parametrize(
    ("rigs", "initial", "command"),
    [
        ([MEMORY] * 3, {}, lambda k: commands(3, k)),
        (
            [SHOULDER.with_parameters({"arm.payload": m}) for m in (0.0, 4.5, 9.07, 20.0)],
            {"joint_angle": 0.5},
            lambda k: np.full(4, 5.6 + 0.01 * k),
        ),
        # without a command each keeps its own pressure
        (
            [REGULATED.with_parameters({"supply.initial_pressure": p}) for p in (2e5, 3e5)],
            {},
            lambda k: None,
        ),
    ],
    ids=["memory", "payloads", "regulators"],
)
def test_plants_of_several_rigs_are_those_one_by_one(
    rigs: list[pamrs.Rig], initial: dict[str, float], command: Callable[[int], Any]
) -> None:
    batch = pamrs.Batch(rigs, sample_time=DT, initial=initial)
    ones = [pamrs.Simulator(rig, sample_time=DT, initial=initial) for rig in rigs]
    for k in range(60):
        given = command(k)
        each = [None] * len(rigs) if given is None else given.tolist()
        seen = batch.step(given)
        alone = [one.step(own) for one, own in zip(ones, each, strict=True)]
    for channel, values in seen.items():
        agree(batch, values, [one[channel] for one in alone], channel)
    assert len(set(seen["muscle_pressure"])) == len(rigs)
    assert batch.rigs == tuple(rigs)


def test_a_clock_that_is_off_is_read_only_where_somebody_looks() -> None:
    batch, one = pamrs.Batch(LATE, n=2, sample_time=DT), pamrs.Simulator(LATE, sample_time=DT)
    run = batch.control(lambda sample: 5.5, 0.04, period=0.02, record_every=10)
    for _ in range(20):
        last = one.step(5.5)
    np.testing.assert_array_equal(run["muscle_pressure"][:, -1], [last["muscle_pressure"]] * 2)


def failing() -> pamrs.Batch:
    """Row 1 is thrown out of the muscle's range within a few milliseconds."""
    return shoulders(3, sample_time=0.001, initial={"joint_rate": np.array([0.0, -500.0, 0.0])})


def test_a_row_that_fails_says_why_and_the_others_go_on() -> None:
    batch, healthy = failing(), shoulders(3, sample_time=0.001)
    alone = pamrs.Simulator(SHOULDER, sample_time=0.001, initial={"joint_rate": -500.0})
    good, message = alone.observe(), ""
    for k in range(20):
        try:
            good = alone.step(float(commands(3, k)[1]))
        except pamrs.SimulationError as error:
            message = str(error)
            break
    for k in range(20):
        seen, usual = batch.step(commands(3, k)), healthy.step(commands(3, k))
    status = batch.status
    assert status[0] is status[2] is None
    assert status[1] is not None
    assert status[1].message == message != ""
    assert status[1].time == pytest.approx(alone.time + 0.001)
    for channel, values in seen.items():
        assert np.isfinite(values).all(), channel
        assert values[1] == good[channel], channel
        assert (values[[0, 2]] == usual[channel][[0, 2]]).all(), channel
    assert batch.time == pytest.approx(0.02)
    batch.reset({"joint_rate": 0.0})
    assert batch.status == (None, None, None)
    assert batch.time == 0.0


def test_a_restart_is_exact_and_keeps_what_has_ended() -> None:
    batch = failing()
    for k in range(20):
        batch.step(commands(3, k))
    state = pickle.loads(pickle.dumps(batch.state))
    others = [pickle.loads(pickle.dumps(batch)), copy.deepcopy(batch), failing()]
    others[2].restore(state)
    for k in range(20, 40):
        straight = batch.step(commands(3, k))
    for other in others:
        assert other.time == pytest.approx(0.02)
        for k in range(20, 40):
            again = other.step(commands(3, k))
        same(other.state, batch.state)
        for channel, values in again.items():
            np.testing.assert_array_equal(values, straight[channel], err_msg=channel)


class Loop:
    """A PI controller of one plant or of many, the same operations for both."""

    def __init__(self, gain: Any, rate: Any) -> None:
        self.gain, self.rate, self.sum = gain, rate, 0.0 * np.asarray(gain)
        self.asked: list[float] = []

    def __call__(self, sample: dict[str, Any]) -> Any:
        self.asked.append(sample["time"])
        error = 0.8 - sample["joint_angle"]
        self.sum = self.sum + error * 0.004
        return np.clip(5.0 + self.gain * error + self.rate * self.sum, 0.0, 10.0)


def test_a_closed_loop_is_that_of_each_simulator() -> None:
    gains, rates = np.array([0.5, 2.0, 8.0]), np.array([0.0, 1.0, 3.0])
    loop, batch = Loop(gains, rates), shoulders(3, threads=2)
    run = batch.control(loop, 0.2, period=0.004)
    assert run["joint_angle"].shape == (3, 101)
    assert run.status == (None, None, None)
    assert not run.failed.any()
    np.testing.assert_allclose(loop.asked, 0.004 * np.arange(50), atol=1e-12)
    for row in range(3):
        one = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=DT)
        alone = one.control(Loop(gains[row], rates[row]), 0.2, period=0.004)
        assert set(run) == set(alone) - {"time"}
        np.testing.assert_array_equal(alone.time, run.time)
        for channel in run:
            agree(batch, run[channel][row], alone[channel], channel)
    kept = {"channels": ("joint_angle", "valve_command"), "record_every": 7}
    few = shoulders(3).control(Loop(gains, rates), 0.2, period=0.004, **kept)
    assert set(few) == {"joint_angle", "valve_command"}
    np.testing.assert_array_equal(few.time, run.time[::7])
    for channel in few:
        np.testing.assert_array_equal(few[channel], run[channel][:, ::7], err_msg=channel)
    with pytest.raises(KeyError, match="was not recorded"):
        few["muscle_pressure"]


def test_a_loop_goes_on_where_the_last_one_ended() -> None:
    whole, parts = shoulders(2), shoulders(2)
    run = whole.control(Loop(np.array([1.0, 2.0]), 0.5), 0.1, period=0.004)
    loop = Loop(np.array([1.0, 2.0]), 0.5)
    one, two = parts.control(loop, 0.04, period=0.004), parts.control(loop, 0.06, period=0.004)
    np.testing.assert_array_equal(
        np.hstack([one["joint_angle"], two["joint_angle"][:, 1:]]), run["joint_angle"]
    )
    np.testing.assert_allclose(two.time, run.time[20:], atol=1e-12)


def test_an_answer_that_is_not_finite_ends_its_row_alone() -> None:
    def update(sample: dict[str, Any]) -> dict[str, Any]:
        late = sample["time"] > 0.0099
        return {"valve_command": np.array([5.5, np.nan, 5.5, -np.inf] if late else [5.5] * 4)}

    run = shoulders(4).control(update, 0.04)
    assert run.failed.tolist() == [False, True, False, True]
    ended = run.status[1]
    assert ended is not None
    assert ended.time == pytest.approx(0.01)
    assert ended.message.startswith("valve_command[1] = NaN is not allowed")
    angle = run["muscle_pressure"]
    assert np.isfinite(angle).all()
    assert (angle[1, 5:] == angle[1, 5]).all()
    assert (angle[0] == angle[2]).all()
    assert angle[0, -1] != angle[0, 5]


def test_names_of_several_valves_and_keywords_are_answers() -> None:
    rig = pamrs.rigs.named("antagonistic_joint")
    answer = {"flexor": np.array([5.5, 6.0]), "extensor": 4.8}
    one, two = (
        pamrs.Batch(rig, n=2, sample_time=DT).control(lambda sample, told=told: told, 0.02)
        for told in (answer, {"valve_command": answer})
    )
    np.testing.assert_array_equal(one["joint_angle.elbow"], two["joint_angle.elbow"])
    np.testing.assert_array_equal(one["valve_command.extensor"], np.full((2, 11), 4.8))


def test_bad_input_is_named_and_leaves_the_batch_alone() -> None:
    batch = shoulders(3)
    batch.step(5.5)
    before = batch.state
    first, second, third = before["rows"]

    def loop(update: Any = lambda sample: 5.0, duration: float = 0.1, **options: Any) -> Any:
        return batch.control(update, duration, **options)

    def restored(**changes: Any) -> Any:
        return lambda: batch.restore({**before, **changes})

    refused(
        (r"valve_command\[1\] = NaN", lambda: batch.step([5.0, np.nan, 5.0])),
        (r"valve_command has the shape \(2,\); \(3,\) is needed", lambda: batch.step([5.0, 5.0])),
        ("valve_command is missing", batch.step),
        ("valve_command = .* is not allowed: numbers", lambda: batch.step(["a", "b", "c"])),
        ("supply_command is given", lambda: batch.step(5.0, supply_command=1e5)),
        ("period = ", lambda: loop(period=0.003)),
        ("duration = ", lambda: loop(duration=-1.0)),
        ("duration = ", lambda: loop(duration=np.nan)),
        ("record_every = ", lambda: loop(record_every=0)),
        ("channels has ", lambda: loop(channels=["angle"])),
        ("update is a float", lambda: loop(5.0)),
        ("2 GB", lambda: loop(duration=1e5)),
        ("state is of 2 rows and 3 status; 3 are", restored(rows=[first, second])),
        ("row 2: state", restored(rows=[first, second, third[:-1]])),
        (r"row 1: state\[0\]", restored(rows=[first, np.full_like(second, np.nan), third])),
        ("row 0: state.samples = 1", restored(samples=7)),
        ("state.samples = -1", restored(samples=-1)),
        ("state is of 3 rows and 1 status; 3 are", restored(status=(None,))),
        ("state is not one of a batch", restored(status=(1, 2, 3))),
        ("state has rows; samples, rows and status", lambda: batch.restore({"rows": 1})),
        ("state has 3", lambda: batch.restore(3)),  # type: ignore[arg-type]
        ("muscle_pressure", lambda: batch.reset({"muscle_pressure": [1e5, -1e9, 1e5]})),
    )
    same(batch.state, before)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n": 0}, "n = 0 is not allowed"),
        ({"n": 2.5}, "n = 2.5 is not allowed"),
        ({"n": None}, "n is missing"),
        ({"n": 10**9}, "n is for 1000000000 plants, which is not allowed: at most 10000000"),
        ({"threads": 0}, "threads = 0"),
        ({"sample_time": 0.0}, "sample_time = 0"),
        ({"step": 0.0003}, "step = 0.0003"),
        ({"initial": {"muscle_pressure": [1e5, 2e5]}}, "muscle_pressure is for 2 plants, n for 3"),
        ({"initial": {"muscle_pressure": [1e5, np.inf, 2e5]}}, r"muscle_pressure\[1\] = inf"),
        ({"initial": {"muscle_pressure": [[1e5, 1e5, 2e5]]}}, "shape"),
        ({"initial": {"pressure": 1e5}}, "unknown entry 'pressure'"),
        ({"initial": {"joint_angle": [0.5, 40.0, 0.5]}}, "row 1: initial.joint_angle = 40"),
        ({"rig": []}, "empty"),
        ({"rig": "shoulder"}, "rig is a str"),
        ({"rig": 5}, "rig is a int"),
        ({"rig": [SHOULDER, REGULATED], "n": 2}, "row 1: its inputs are"),
    ],
)
def test_a_batch_that_cannot_be_says_why(changes: dict[str, Any], message: str) -> None:
    with pytest.raises((pamrs.ParameterError, pamrs.RigError), match=message):
        pamrs.Batch(**{"rig": SHOULDER, "n": 3, "sample_time": DT, **changes})


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_ctrl_c_ends_a_long_advance_at_a_sample() -> None:
    said = script("""
        import os, signal, threading, time, numpy as np, pamrs
        signal.signal(signal.SIGINT, signal.default_int_handler)
        batch = pamrs.Batch(pamrs.rigs.shoulder(), n=40, sample_time=0.001)
        def press():
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGINT)
        threading.Thread(target=press).start()
        try:
            batch.control(lambda sample: 5.5, 1e4, period=1e4, channels=["joint_angle"], \
record_every=10_000_000)
        except KeyboardInterrupt:
            again = pamrs.Batch(pamrs.rigs.shoulder(), n=40, sample_time=0.001)
            again.control(lambda sample: 5.5, batch.time, channels=["joint_angle"], \
period=batch.time)
            print(batch.time > 0.0, all((a == b).all() for a, b in zip(batch.state["rows"], \
again.state["rows"])))
    """)
    assert said == ["True", "True"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_batch_goes_on_in_a_forked_process() -> None:
    """Whose threads are not those of its parent."""
    said = script("""
        import os, warnings, numpy as np, pamrs
        warnings.simplefilter("ignore")
        batch = pamrs.Batch(pamrs.rigs.shoulder(), n=300, sample_time=0.001, threads=2)
        batch.step(5.5)
        if (child := os.fork()) == 0:
            batch.step(5.6)
            os._exit(0 if batch.time > 0.0015 else 1)
        print(os.waitpid(child, 0)[1])
    """)
    assert said == ["0"]


def test_a_controller_cannot_change_what_is_recorded():
    """Nor what sensors with a delay have on their way."""
    batch = pamrs.Batch(pamrs.rigs.shoulder(), n=2, sample_time=0.005)

    def update(sample):
        with pytest.raises(ValueError, match="read-only"):
            sample["joint_angle"] -= 1.0
        return 6.0

    run = batch.control(update, 0.1)
    assert (run["joint_angle"] > 0.0).all()
    sample = batch.observe()
    sample["joint_angle"] -= 1.0  # a sample of one's own may be


def test_a_reset_is_a_new_batch_and_keeps_its_threads():
    rigs = [SHOULDER.with_parameters({"arm.payload": m}) for m in (2.0, 9.0)]
    options = {"sample_time": 0.005, "initial": {"joint_angle": [0.4, 0.6]}, "threads": 2}
    used, new = (pamrs.Batch(rigs, **options) for _ in range(2))
    core = used._core
    for _ in range(50):
        used.step([9.0, 6.0])
    used.reset()
    assert used._core is core
    assert used.time == 0.0
    for _ in range(50):
        one, other = used.step([7.0, 3.0]), new.step([7.0, 3.0])
        assert all((one[name] == other[name]).all() for name in one)
    again = pickle.loads(pickle.dumps(used))
    again.reset()
    new.reset({"joint_angle": [0.5, 0.5]})
    assert again.observe()["joint_angle"] == pytest.approx([0.4, 0.6])
    assert new.observe()["joint_angle"] == pytest.approx([0.5, 0.5])
    new.step(5.0)
    assert new.reset()["joint_angle"] == pytest.approx([0.5, 0.5])


def test_threads_are_those_that_the_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1, 4, 5}, raising=False)
    assert thread_count(None) == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    assert thread_count(None) == 7
