"""Linear models and stability: closed forms, and the nonlinear simulation on both sides of the
boundary.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import pamrs
from pamrs.control import PID, Reference, cascaded_pid, closed_loop
from pamrs.control.linear import (
    LinearController,
    LinearModel,
    equilibrium,
    linear_controller,
    linearise,
)
from pamrs.control.stability import margins, open_loop
from pamrs.control.trajectories import step
from pamrs.errors import ParameterError
from tests.control.helpers import SmallPid

control = pytest.importorskip("control")

ANGLE = math.radians(45)


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


def test_equilibrium_stands_still(rig):
    start = equilibrium(rig, ANGLE)
    run = pamrs.simulate(rig, np.full(1001, 5.0), sample_time=0.001, initial=start)
    assert np.ptp(run["joint_angle"]) < 1e-6
    arm = rig.tables("arm")[""]
    weight = (arm["first_moment"] + arm["payload"] * arm["length"]) * arm["gravity"]
    assert run["joint_torque"][0] == pytest.approx(weight * math.sin(ANGLE), rel=1e-8)


def test_python_control_gets_the_names(rig):
    system = linearise(rig, ANGLE).system()
    assert isinstance(system, control.StateSpace)
    assert system.state_labels == ["muscle_pressure", "joint_angle", "joint_rate"]
    assert system.input_labels == ["valve_command"]


def integrator(gain):
    one = np.ones((1, 1))
    return LinearModel(
        0.0 * one, gain * one, one, ("joint_angle",), ("valve_command",), ("joint_angle",)
    )


def proportional(gain, period):
    none = np.zeros((0, 0))
    return LinearController(
        none, np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-gain]]), ("joint_angle",), period
    )


@pytest.mark.parametrize("gain", [0.5, 3.0, 19.9, 20.1])
def test_a_sampled_integrator_is_stable_up_to_two_over_its_period(gain):
    # x+ = (1 - K T) x: the radius is |1 - K T|, the gain margin 2/(K T)
    found = margins(integrator(1.0), proportional(gain, 0.1))
    assert found.radius == pytest.approx(abs(1 - 0.1 * gain))
    assert found.stable == (gain < 20.0)
    assert found.gain == pytest.approx(20.0 / gain, rel=1e-3)
    if gain < 19.0:  # |L| = K T/(2 sin(w T/2)) = 1, its phase -90 deg - w T/2
        crossing = 2 / 0.1 * math.asin(gain * 0.1 / 2)
        assert found.phase_frequency == pytest.approx(crossing, rel=1e-3)
        assert found.phase == pytest.approx(math.pi / 2 - crossing * 0.05, rel=1e-3)


def test_an_unstable_loop_has_no_phase_or_delay_to_spare():
    model, law = integrator(1.0), proportional(3.0, 0.1)
    spare = margins(model, law).delay
    stable, unstable = (margins(model, law, delay=delay) for delay in (0.9 * spare, spare + 0.05))
    assert stable.stable
    assert stable.phase > 0.0
    assert 0.0 < stable.delay < 0.2 * spare
    assert str(stable).startswith("stable (largest eigenvalue 0.")
    assert "delay to spare" in str(stable)
    assert not unstable.stable
    assert unstable.phase is None
    assert unstable.delay is None
    assert unstable.gain < 1.0
    assert str(unstable).startswith("unstable (largest eigenvalue 1.")
    assert "no margin of phase or delay; nearest boundary: all gains times 0." in str(unstable)
    # a gain so small that no gain of one is crossed
    assert "None" not in str(margins(integrator(1.0), proportional(1e-9, 0.1)))


@pytest.mark.parametrize("delay", [0.03, 0.1, 0.14, 0.25])
def test_delay_of_part_of_a_period_is_exact(delay):
    model, law = integrator(1.0), proportional(3.0, 0.1)
    matrix = control.feedback(open_loop(model, law, delay=delay)).A
    # the same loop, simulated finely: x' = u(t - delay), u held over each period
    x, held, fine = 1.0, [], 10_000
    state = np.zeros(matrix.shape[0])
    state[0] = 1.0
    dt = 0.1 / fine
    late = round(delay / dt)
    for k in range(12):
        held.append(-3.0 * x)
        starts = [late + j * fine for j in range(k + 1)]
        for j, u in enumerate(held):
            begin, end = starts[j], starts[j] + fine
            overlap = max(0, min(end, (k + 1) * fine) - max(begin, k * fine))
            x += u * overlap * dt
        state = matrix @ state
        assert state[0] == pytest.approx(x, abs=1e-9)


def test_delay_margin_is_where_delay_makes_it_unstable():
    model, law = integrator(1.0), proportional(3.0, 0.01)
    spare = margins(model, law).delay
    inside, outside = (margins(model, law, delay=f * spare).radius for f in (0.98, 1.02))
    assert inside < 1.0 < outside


def test_a_controller_made_linear_answers_as_itself(rig):
    point = linearise(rig, ANGLE).point
    controller = PID(1.4, 2.5, 0.3, period=0.01, output_filter=0.05, rate_filter=0.02)
    linear = linear_controller(controller, point)
    assert linear.command == pytest.approx(5.0)
    rng, reference = np.random.default_rng(1), Reference(point["joint_angle"])
    for k in range(3):
        controller.update(0.01 * k, point, reference)
    x = np.zeros(linear.a.shape[0])
    for k in range(3, 60):
        moved = rng.normal(0.0, 1e-2)
        y = np.array([moved if name == "joint_angle" else 0.0 for name in linear.inputs])
        seen = {**point, "joint_angle": point["joint_angle"] + moved}
        answer = controller.update(0.01 * k, seen, reference)
        assert answer - 5.0 == pytest.approx((linear.c @ x + linear.d @ y)[0], abs=1e-7)
        x = linear.a @ x + linear.b @ y


def test_a_cascade_is_made_linear_where_it_holds_the_arm(rig):
    point = linearise(rig, ANGLE).point
    with pytest.raises(ParameterError, match="at a limit"):
        linear_controller(cascaded_pid(1.2e6, period=0.005), point)
    controller = cascaded_pid(1.2e6, period=0.005)
    closed_loop(rig, controller, step(ANGLE, ANGLE), 25.0, initial=equilibrium(rig, ANGLE))
    linear = linear_controller(controller, point, state=controller.state)
    assert linear.command == pytest.approx(5.0, abs=0.05)
    assert linear.inputs == ("joint_angle", "joint_rate", "muscle_pressure")
    models = [linearise(rig, ANGLE, side=side) for side in ("fill", "vent")]
    assert all(margins(model, linear).stable for model in models)
    # the inner loop alone is proportional at high frequency: volts per pascal, low-passed
    pressure = linear.d[0, 2] + sum(
        (linear.c @ np.linalg.matrix_power(linear.a, k) @ linear.b)[0, 2] for k in range(8)
    )
    assert pressure == pytest.approx(-2e-4 * (1 + 8 * 0.005), rel=0.05)


def test_both_sides_of_the_boundary_are_what_the_arm_does(rig):
    # proportional control of a sampled arm: the boundary in the gain, then the arm itself a little
    # inside and outside
    def made(kp):
        return SmallPid(kp=kp, ki=0.0, kd=0.1, period=0.01)

    loaded = rig.with_parameters({"arm.payload": 15.0})
    models = [linearise(loaded, ANGLE, side=side) for side in ("fill", "vent")]

    def radius(kp):
        linear = linear_controller(made(kp), models[0].point)
        loops = (control.feedback(open_loop(model, linear)) for model in models)
        return [np.abs(loop.poles()).max() for loop in loops]

    edges = [brentq(lambda kp, k=k: radius(kp)[k] - 1.0, 1.0, 300.0) for k in range(2)]
    inside, outside = 0.8 * min(edges), 1.25 * max(edges)
    start = equilibrium(loaded, ANGLE)
    start["joint_angle"] += 1e-5
    for kp, grows in ((inside, False), (outside, True)):
        run = closed_loop(loaded, made(kp), step(ANGLE, ANGLE, duration=4.0), initial=start)
        early, late = (
            np.abs(run.error[(run.time >= a) & (run.time < a + 0.5)]).max() for a in (0.0, 3.0)
        )
        assert (late > 3 * early) == grows, (kp, early, late)
        assert (late < 0.5 * early) != grows, (kp, early, late)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda rig: linearise(rig, 0.1), "angle"),
        (lambda rig: linearise(rig, math.nan), "angle"),
        (lambda rig: linearise(rig, ANGLE, side="left"), "side"),
        (lambda rig: linearise(rig.with_parameters({"arm.payload": 500.0}), 1.5), "no pressure"),
        (lambda rig: linearise(pamrs.rigs.named("antagonistic_joint"), 0.1), "chamber"),
        (lambda rig: linearise(rig, ANGLE).sampled(0.0), "period"),
        (lambda rig: margins(integrator(1.0), proportional(1.0, 0.1), delay=-1.0), "delay"),
        (lambda rig: linearise(rig, ANGLE, friction="none"), "friction"),
        (lambda rig: linear_controller(PID(1.0), {"joint_angle": 0.5}, side="left"), "side"),
    ],
)
def test_bad_input_is_named(rig, call, word):
    with pytest.raises(ParameterError, match=word):
        call(rig)
