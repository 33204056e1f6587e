"""Many plants of one rig against each of them by itself."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.simulation import core_rig
from tests.scripts import script
from tests.tables import rows_of

SAMPLE = 0.005
ROWS = 101


def driven(rig: pamrs.Rig, rows: int = ROWS) -> dict[str, object]:
    """Commands that fill, hold and vent, and a length where a frame asks for one."""
    time = np.arange(rows) * SAMPLE
    given: dict[str, object] = {}
    wave = np.where(np.abs(np.sin(8.0 * time)) < 0.3, 0.0, np.sin(8.0 * time))
    valves = {
        name: valve["null_voltage"] + 0.6 * valve["half_range"] * wave
        for name, valve in rig.tables("valve").items()
    }
    if valves:
        given["valve_command"] = valves
    load = rig.tables("load").get("", {})
    if load.get("kind") == "frame":
        low, high = load["min_length"], load["max_length"]
        given["length"] = 0.5 * (low + high) + 0.3 * (high - low) * np.sin(3.0 * time)
    return given or {"duration": float(time[-1])}


def apart(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the largest magnitude."""
    return float(np.abs(found - wanted).max() / max(1e-9, np.abs(wanted).max()))


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_every_packaged_rig_is_what_simulate_gives(name):
    rig = pamrs.rigs.named(name)
    channels = list(core_rig(rig).channels)
    one = pamrs.simulate(rig, sample_time=SAMPLE, **driven(rig))
    many = pamrs.simulate_batch(rig, sample_time=SAMPLE, n=3, record=channels, **driven(rig))
    assert many.status == (None, None, None)
    for channel in channels:
        assert apart(many[channel][1], one[channel]) < 1e-14, channel
        np.testing.assert_array_equal(many[channel][0], many[channel][2])


def test_rigs_with_effects_run_too():
    rig = pamrs.rigs.shoulder().with_effect("leak_muscle", {"conductance": 2e-9})
    payload, volts = np.array([2.0, 9.0]), np.full(ROWS, 6.0)
    options = {"parameters": {"arm.payload": payload}, "record": ["muscle_pressure"]}
    run = pamrs.simulate_batch(rig, volts, sample_time=SAMPLE, **options)
    for k, mass in enumerate(payload):
        loaded = rig.with_parameters({"arm.payload": mass})
        alone = pamrs.simulate(loaded, volts, sample_time=SAMPLE)
        np.testing.assert_array_equal(run["muscle_pressure"][k], alone["muscle_pressure"])


@settings(max_examples=15, deadline=None)
@given(
    payload=st.lists(st.floats(0.0, 25.0), min_size=1, max_size=20),
    dead_volume=st.floats(5e-5, 5e-4),
    command=st.floats(0.0, 10.0),
    angle=st.floats(0.3, 1.8),
)
def test_any_plant_is_the_one_that_simulate_gives(payload, dead_volume, command, angle):
    rig = pamrs.rigs.shoulder()
    k = len(payload) // 2
    signal = np.where(np.arange(61) < 30, command, 5.0)
    drive = {"sample_time": SAMPLE, "initial": {"joint_angle": angle}}
    run = pamrs.simulate_batch(
        rig,
        signal,
        **drive,
        parameters={"arm.payload": payload, "chamber.dead_volume": dead_volume},
        record=["joint_angle", "muscle_pressure", "mass_supplied"],
        reduce={"peak": ("peak", "joint_rate"), "end": ("final", "joint_angle")},
    )
    own = rig.with_parameters({"arm.payload": payload[k], "chamber.dead_volume": dead_volume})
    alone = pamrs.simulate(own, signal, **drive)
    assert apart(run["joint_angle"][k], alone["joint_angle"]) < 1e-8
    assert apart(run["muscle_pressure"][k], alone["muscle_pressure"]) < 1e-7
    assert abs(run["mass_supplied"][k][-1] - alone["mass_supplied"][-1]) < 1e-10
    assert run.reduced["peak"][k] == pytest.approx(np.abs(alone["joint_rate"]).max(), rel=1e-6)
    np.testing.assert_array_equal(run.reduced["end"], run["joint_angle"][:, -1])


def test_each_plant_may_have_its_own_commands():
    rig = pamrs.rigs.shoulder()
    commands = 5.0 + np.linspace(-1.0, 2.0, 9)[:, None] * np.sin(np.arange(ROWS) * 0.1)
    run = pamrs.simulate_batch(rig, commands, sample_time=SAMPLE, record=["joint_angle"], every=4)
    assert run["joint_angle"].shape == (9, 26)
    assert run.time[1] == 4 * SAMPLE
    for k in (0, 8):
        alone = pamrs.simulate(rig, commands[k], sample_time=SAMPLE)
        assert apart(run["joint_angle"][k], alone["joint_angle"][::4]) < 1e-9


def test_a_plant_that_leaves_the_model_ends_as_it_would_alone():
    """Thrown off its stop, the arm stretches the muscles beyond their length; the others go on."""
    rig = pamrs.rigs.shoulder().with_parameters({"joint.stop_stiffness": 5.0})
    command = np.full(ROWS, 6.0)
    thrown = np.array([0.0, -80.0, 0.0, -90.0])
    kept = {"record": ["joint_angle"], "reduce": {"end": ("final", "joint_angle")}}
    drive = {"sample_time": SAMPLE, "initial": {"joint_rate": thrown}}
    run = pamrs.simulate_batch(rig, command, **drive, **kept)
    assert run.failed.tolist() == [False, True, False, True]
    for k, rate in enumerate(thrown):
        start = {"joint_rate": rate}
        if not run.failed[k]:
            wanted = pamrs.simulate(rig, command, sample_time=SAMPLE, initial=start)["joint_angle"]
            assert apart(run["joint_angle"][k], wanted) < 1e-8
            continue
        with pytest.raises(pamrs.SimulationError) as raised:
            pamrs.simulate(rig, command, sample_time=SAMPLE, initial=start)
        # the same but for the last digits of the value
        assert run.status[k].message[:70] == str(raised.value)[:70]
        assert np.isnan(run.reduced["end"][k])
        assert np.isfinite(run["joint_angle"][k]).all()


def test_squared_error_takes_a_reference():
    rig = pamrs.rigs.shoulder()
    references = {"ise": np.linspace(0.3, 1.0, ROWS), "about": 0.5}
    asked = {name: ("squared_error", "joint_angle", one) for name, one in references.items()}
    options = {"n": 2, "record": ["joint_angle"], "reduce": asked}
    run = pamrs.simulate_batch(rig, np.full(ROWS, 6.0), sample_time=SAMPLE, **options)
    for name, reference in references.items():
        squares = (run["joint_angle"][0] - reference) ** 2
        assert run.reduced[name][0] == pytest.approx(np.trapezoid(squares, dx=SAMPLE), rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "words"),
    rows_of(__file__, "what_is_wrong_is_said"),
)
def test_what_is_wrong_is_said(arguments, words):
    given = {"valve_command": np.full(ROWS, 6.0), "sample_time": SAMPLE} | arguments
    with pytest.raises(pamrs.PamrsError, match=words):
        pamrs.simulate_batch(pamrs.rigs.shoulder(), **given)


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_ctrl_c_ends_a_batch_while_other_threads_go_on() -> None:
    said = script("""
        import os, signal, threading, time, numpy as np, pamrs
        signal.signal(signal.SIGINT, signal.default_int_handler)
        counted = 0
        def count():
            global counted
            end = time.monotonic() + 0.3
            while time.monotonic() < end:
                counted += 1
            os.kill(os.getpid(), signal.SIGINT)
        thread = threading.Thread(target=count)
        thread.start()
        try:
            pamrs.simulate_batch(pamrs.rigs.shoulder(), np.full(4000, 5.5), sample_time=1.0,
                parameters={"arm.payload": np.linspace(0.0, 20.0, 4000)}, record=["joint_angle"],
                every=3999)
        except KeyboardInterrupt:
            print("ended", counted > 1000)
    """)
    assert said == ["ended", "True"]
