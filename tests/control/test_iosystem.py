"""A rig in python-control gives what the simulator gives."""

import numpy as np
import pytest

import pamrs
from pamrs.control.iosystem import initial_state, iosystem
from tests.simulation.refusals import refused

control = pytest.importorskip("control")


@pytest.mark.parametrize("effect", [None, "muscle_hysteresis"])
def test_its_response_is_the_simulation(effect):
    rig = pamrs.rigs.shoulder() if effect is None else pamrs.rigs.shoulder().with_effect(effect)
    outputs = ["joint_angle", "muscle_pressure", "air_mass"]
    system = iosystem(rig, sample_time=0.005, outputs=outputs)
    assert isinstance(system, control.NonlinearIOSystem)
    assert system.dt == 0.005
    assert system.input_labels == ["valve_command"]
    time = np.arange(401) * 0.005
    command = 5.0 + 2.0 * np.sin(3.0 * time)
    start = {"joint_angle": 0.6, "muscle_pressure": 2e5}
    state = initial_state(rig, sample_time=0.005, initial=start)
    response = control.input_output_response(system, time, command, state)
    alone = pamrs.simulate(rig, command, sample_time=0.005, initial=start)
    for k, name in enumerate(system.output_labels):
        assert (response.outputs[k] == alone[name]).all(), name


def test_named_inputs_and_a_loop_in_python_control():
    rig = pamrs.rigs.named("antagonistic_joint")
    system = iosystem(rig, sample_time=0.005, outputs=["joint_angle.elbow"])
    assert system.input_labels == [f"valve_command_{name}" for name in rig.tables("valve")]
    assert system.output_labels == ["joint_angle_elbow"]
    # a proportional loop around the shoulder by control.interconnect, and by hand
    plant = iosystem(pamrs.rigs.shoulder(), sample_time=0.01, outputs=["joint_angle"], name="plant")
    ends = {"inputs": ["joint_angle"], "outputs": ["valve_command"], "name": "law"}
    gain = control.NonlinearIOSystem(
        None, lambda t, x, u, p: 5.0 + 3.0 * (0.6 - u[0]), dt=0.01, **ends
    )
    loop = control.interconnect([plant, gain], inputs=[], outputs=["joint_angle"])
    time = np.arange(101) * 0.01
    state = initial_state(pamrs.rigs.shoulder(), sample_time=0.01)
    response = control.input_output_response(loop, time, np.zeros((0, time.size)), state)
    alone = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.01).control(
        lambda s: 5.0 + 3.0 * (0.6 - s["joint_angle"]), 1.0
    )
    assert np.ravel(response.outputs) == pytest.approx(alone["joint_angle"], abs=1e-12)


def test_bad_input_is_named():
    shoulder = pamrs.rigs.shoulder()
    late = shoulder.with_effect("clock_skew")
    refused(
        ("sample_time", lambda: iosystem(shoulder, sample_time=0.0)),
        ("outputs", lambda: iosystem(shoulder, sample_time=0.01, outputs=["angle"])),
        ("clock_skew", lambda: iosystem(late, sample_time=0.01)),
    )
