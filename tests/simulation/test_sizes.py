"""Sizes that no memory holds and times that nobody waits for are errors before the work."""

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError
from tests.simulation.refusals import refused

SHOULDER = pamrs.rigs.shoulder()
COMMAND = np.full(401, 6.0)
END = {"e": ("final", "joint_angle")}


@pytest.mark.parametrize("n", [10**8, 2**62, 10**400, 10**5000], ids=["8", "62", "400", "5000"])
def test_plants_that_no_memory_holds_are_refused(n):
    told, options = "plants.* is not allowed: at most 10000000", {"sample_time": 0.005, "n": n}
    refused(
        (told, lambda: pamrs.simulate_batch(SHOULDER, COMMAND, reduce=END, **options)),
        (told, lambda: pamrs.Batch(SHOULDER, **options)),
    )


def test_the_core_refuses_them_by_itself():
    core = pamrs.simulation.core_rig(SHOULDER)
    for count in (2**40, 2**62):
        with pytest.raises(ParameterError, match=r"is not allowed: at most \d+ \(2 GB\)"):
            pamrs._core.side_by_side(
                core, count, 3, {"valve_command": COMMAND[:3]}, 0.005, 0.001, {}, {},
                ["joint_angle"], 1, [], 1,
            )  # fmt: skip
    with pytest.raises(ValueError, match=r"an array of \d+ numbers is not allowed: at most"):
        core.with_values(np.broadcast_to(1.0, 10**12))


def test_kept_channels_are_counted_together():
    many = {"n": 10**6, "record": ["joint_angle", "muscle_pressure"]}
    with pytest.raises(ParameterError, match="at most 250000000 numbers"):
        pamrs.simulate_batch(SHOULDER, COMMAND, sample_time=0.005, **many)


@pytest.mark.parametrize("values", [np.broadcast_to(5.0, 10**12), {"a": 1}, [10**400], "many"])
def test_what_is_no_array_of_numbers_is_refused(values):
    varied = {"parameters": {"arm.payload": values}}
    for command, options in ((values, {"reduce": END}), (COMMAND, varied)):
        with pytest.raises(ParameterError):
            pamrs.simulate_batch(SHOULDER, command, sample_time=0.005, n=2, **options)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"sample_time": 1e300}, "at most a day"),
        ({"sample_time": 1e9, "step": 1e9}, "at most a day"),
        ({"sample_time": 8e4}, "steps"),
    ],
)
def test_a_step_that_never_ends_is_refused(options, told):
    refused(
        (rf"{told}(?s:.){{,150}}$", lambda: pamrs.simulate(SHOULDER, COMMAND[:3], **options)),
        (told, lambda: pamrs.Simulator(SHOULDER, **options)),
        (told, lambda: pamrs.Batch(SHOULDER, n=2, **options)),
    )


@pytest.mark.parametrize(("duration", "sample_time"), [(1e300, 1e-3), (1e300, 1e-300), (1e9, 1e-9)])
def test_a_run_of_too_many_rows_is_refused(duration, sample_time):
    times = {"duration": duration, "sample_time": sample_time}
    refused(
        ("^(?s:.){,150}rows(?s:.){,150}$", lambda: pamrs.simulate(SHOULDER, 5.0, **times)),
        ("rows", lambda: pamrs.simulate_batch(SHOULDER, 5.0, n=2, reduce=END, **times)),
    )


NO_STATES = (np.broadcast_to(1.0, 10**9), {"samples": 1}, "x", None, [10**400])
NO_STATES += ([float("nan")] * 5, [[1.0], [2.0, 3.0]])


@pytest.mark.parametrize("state", NO_STATES)
def test_a_state_that_is_none_is_refused(state):
    one = pamrs.Simulator(SHOULDER, sample_time=0.005)
    many = pamrs.Batch(SHOULDER, n=2, sample_time=0.005)
    before = many.state
    with pytest.raises(ParameterError):
        one.restore(state)
    for wrong in (
        {**before, "rows": state},
        {**before, "rows": [state, state]},
        {**before, "status": state},
        {**before, "status": [state, state] if state is not None else [1, 2]},
        {**before, "samples": state},
        {**before, "rows": {0: 1.0, 1: 2.0}},
    ):
        with pytest.raises(ParameterError):
            many.restore(wrong)
    assert many.step(5.0)["joint_angle"].shape == (2,)
