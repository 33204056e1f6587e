"""The sliding family on the plant of its own laws, (5.4) with the pressure as input: s s' < 0,
Lyapunov functions, bounded weights.
"""

import math

import numpy as np
import pytest

from pamrs.control import AdaptiveSliding, Cascade, Neural, Reference, Sliding, fuzzy_rules
from pamrs.errors import ParameterError
from tests.control.cases import FULL, PERIOD, SIMPLIFIED, samples, singles
from tests.simulation.refusals import refused

LAMBDA, KD = 5.0, 2e4
STEP = 1e-3


def aim(time):
    a, w = math.radians(20.0), 1.3
    return Reference(
        math.radians(60.0) + a * math.sin(w * time),
        a * w * math.cos(w * time),
        -a * w * w * math.sin(w * time),
    )


def acceleration(pressure, angle, rate):
    """(5.4) for the angle's second derivative."""
    arm = SIMPLIFIED
    c1, c2 = arm.torque.at(angle)
    return (c1 * pressure + c2 - arm.viscous * rate - arm.weight * math.sin(angle)) / arm.inertia


def run(controller, duration, each=None):
    """The plant with the pressure held over a sample, a step of Runge and Kutta; rows of time,
    angle, rate, s, pressure.
    """
    rows, state = [], np.array([0.87, 0.0])
    for k in range(round(duration / STEP)):
        t = k * STEP
        ref = aim(t)
        s = state[1] - (ref.rate - LAMBDA * (state[0] - ref.angle))
        sample = {"joint_angle": float(state[0]), "joint_rate": float(state[1])}
        pressure = controller.update(t, sample, ref)
        if each is not None:
            each(s)
        rows.append((t, *state, s, pressure))
        slopes: list = []
        for share in (0.0, 0.5, 0.5, 1.0):
            x = state + (share * STEP * slopes[-1] if slopes else 0.0)
            slopes.append(np.array([x[1], acceleration(pressure, x[0], x[1])]))
        state = state + STEP / 6.0 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
    return np.array(rows)


#: Measured motion as it is, at every step of the plant.
TRUE = {"slope": LAMBDA, "measured_rate": True, "rate_filter": 0.0, "period": STEP}


def sharp(kind, *arguments, **others):
    return kind(*arguments, **{"switching": KD, **TRUE, **others})


@pytest.mark.parametrize("s0", [-1.5, -0.2, 0.3, 2.0])
@pytest.mark.parametrize("degrees", [45.0, 65.0, 90.0])
def test_s_falls_outside_the_boundary_layer(s0, degrees):
    """I s' = -b s - C1 KD sgn(s), at once, from the plant's own acceleration."""
    angle, ref = math.radians(degrees), Reference(math.radians(degrees) - 0.01, 0.1, 0.3)
    rate = ref.rate - LAMBDA * 0.01 + s0
    controller = sharp(Sliding, SIMPLIFIED.replace(pressure_limit=1e9), boundary_layer=0.1)
    pressure = controller.update(0.0, {"joint_angle": angle, "joint_rate": rate}, ref)
    change = acceleration(pressure, angle, rate) - (ref.acceleration - LAMBDA * (rate - ref.rate))
    assert s0 * change < 0.0
    if pressure == 0.0:  # a muscle cannot push: only so much of the law is left
        assert s0 > 0.0
        return
    c1, _ = SIMPLIFIED.torque.at(angle)
    expected = (-SIMPLIFIED.viscous * s0 - c1 * KD * math.copysign(1.0, s0)) / SIMPLIFIED.inertia
    assert change == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("layer", [0.0, 0.05])
def test_sliding_reaches_the_surface_and_stays(layer):
    rows = run(sharp(Sliding, SIMPLIFIED, boundary_layer=layer), 4.0)
    s = np.abs(rows[:, 3])
    width = max(layer, 0.02)
    outside = np.flatnonzero(s > width)
    assert outside.size, "it begins outside"
    inside = int(np.argmax(s <= width))
    assert np.all(np.diff(s[:inside]) < 0.0), "s s' < 0 on the way to the layer"
    assert outside.max() < inside, "and it does not come out again"
    error = np.abs(rows[:, 1] - [aim(t).angle for t in rows[:, 0]])
    assert error[-1] < width / LAMBDA


def test_wrong_estimates_are_covered_by_a_large_enough_switching_term():
    rows = run(sharp(Sliding, SIMPLIFIED.scaled(0.7), switching=1.2e5, boundary_layer=0.0), 2.0)
    assert np.abs(rows[-500:, 3]).max() < 0.05


def test_adaptive_law_by_hand():
    gains, free = (2.0, 3.0, 400.0), {"bounds": None, "hold_at_limit": False}
    controller = sharp(AdaptiveSliding, SIMPLIFIED, gains, boundary_layer=0.0, **free)
    angle, rate, ref = 1.0, 0.4, Reference(1.05, 0.2, 0.5)
    wanted = ref.rate - LAMBDA * (angle - ref.angle)
    s, second = rate - wanted, ref.acceleration - LAMBDA * (rate - ref.rate)
    controller.update(0.0, {"joint_angle": angle, "joint_rate": rate}, ref)
    columns = (second, wanted, math.sin(angle))
    for name, gain, column in zip(controller.estimates, gains, columns, strict=True):
        expected = getattr(SIMPLIFIED, name) - gain * column * s * STEP
        assert controller.estimates[name] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("factor", [0.6, 1.6])
@pytest.mark.parametrize("bounds", [None, "default"])
def test_the_lyapunov_function_of_the_adaptive_law_does_not_grow(factor, bounds):
    gains = (1.0, 5.0, 300.0)
    true = np.array([SIMPLIFIED.inertia, SIMPLIFIED.viscous, SIMPLIFIED.weight])
    arm, narrow = SIMPLIFIED.scaled(factor), {"boundary_layer": 0.02, "deadband": 0.02}
    controller = sharp(AdaptiveSliding, arm, gains, **narrow, bounds=bounds)
    values = []

    def lyapunov(s):
        off = np.array(list(controller.estimates.values())) - true
        values.append(0.5 * true[0] * s * s + 0.5 * float(np.sum(off**2 / gains)))

    rows = run(controller, 6.0, each=lyapunov)
    s, v = rows[:, 3], np.array(values)
    free = (rows[:, 4] > 0.0) & (rows[:, 4] < SIMPLIFIED.pressure_limit)
    grows = np.diff(v)[(np.abs(s[:-1]) > 0.03) & free[:-1]]
    assert grows.size > 100
    # what is left is the sampling: second order in the step
    assert grows.max() < 1e-3 * v[0]
    assert v[-1] < v[0]
    assert np.abs(s[-1000:]).max() < 0.2 * np.abs(s).max()


def test_deadband_is_two_sided_and_stops_the_adaptation():
    for kind, name in ((AdaptiveSliding, "estimates"), (Neural, "weights")):
        controller = kind(SIMPLIFIED, **TRUE)
        before = {key: np.array(value) for key, value in getattr(controller, name).items()}
        for k in range(51):  # the last one is beyond it
            share = -1.01 if k == 50 else 0.99 * (-1) ** k
            sample = {"joint_angle": 1.0, "joint_rate": share * controller.deadband}
            controller.update(k * STEP, sample, Reference(1.0))
            now = getattr(controller, name)
            assert all(np.array_equal(before[key], now[key]) for key in before) == (k < 50)


@pytest.mark.parametrize("shape", [(), (3,)])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_weights_are_bounded_whatever_happens(shape, sense):
    """A measurement that never follows: what would grow without end stops at its bounds."""
    sample = {"joint_angle": np.full(shape, 0.8) if shape else 0.8, "joint_rate": -5.0 * sense}
    adaptive = sharp(AdaptiveSliding, SIMPLIFIED, (1e5, 1e5, 1e5), hold_at_limit=False)
    neural = sharp(Neural, SIMPLIFIED, gains=(1e9, 1e9, 1e9), hold_at_limit=False)
    free = sharp(Neural, SIMPLIFIED, gains=(1e9, 1e9, 1e9), bounds=None, hold_at_limit=False)
    for k in range(500):
        reference = Reference(0.8 + sense, 0.5, 0.5)
        for controller in (adaptive, neural, free):
            controller.update(k * STEP, sample, reference)
    pairs = list(zip(adaptive.bounds, map(np.asarray, adaptive.estimates.values()), strict=True))
    assert all(np.all((value >= low) & (value <= high)) for (low, high), value in pairs)
    assert any(np.all(np.isin(value, ends)) for ends, value in pairs)
    for name, bound in zip(neural.weights, neural.bounds, strict=True):
        assert np.abs(neural.weights[name]).max() == bound
        assert np.abs(free.weights[name]).max() > bound


def test_adaptation_stands_still_at_a_limit_of_the_pressure():
    held = sharp(AdaptiveSliding, SIMPLIFIED)
    free = sharp(AdaptiveSliding, SIMPLIFIED, hold_at_limit=False)
    sample, far = {"joint_angle": 0.5, "joint_rate": 0.0}, Reference(2.0, 0.0, 400.0)
    for k in range(100):  # far below the aim and asked for more than there is
        for controller in (held, free):
            assert controller.update(k * STEP, sample, far) == 1.38e6
    assert held.estimates["weight"] == SIMPLIFIED.weight
    assert free.estimates["weight"] > SIMPLIFIED.weight


# ---------------------------------------------------------------- networks


def test_the_basis_is_a_partition_of_unity():
    controller = Neural(SIMPLIFIED, nodes=17)
    angle = np.linspace(*SIMPLIFIED.angle_range, 1001)
    basis = controller.basis(angle)
    assert basis.shape == (1001, 17)
    assert basis.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.all(basis >= 0.0)
    assert np.all((basis > 0.0).sum(axis=1) <= 2)
    assert controller.basis(controller.angles) == pytest.approx(np.eye(17), abs=1e-12)
    assert controller.basis(0.0).tolist() == [1.0, *[0.0] * 16]


def test_the_start_from_the_model_is_the_sliding_law():
    """At the nodes the networks that start from a model give what sliding control gives
    (5.17)-(5.19).
    """
    still = {"start": "model", "nodes": 10, "gains": (0.0, 0.0, 0.0)}
    for arm in (SIMPLIFIED, FULL):
        neural = sharp(Neural, arm, boundary_layer=0.2, **still)
        sliding = sharp(Sliding, arm, boundary_layer=0.2)
        for k, angle in enumerate(neural.angles[2:8].tolist()):
            sample = {"joint_angle": angle, "joint_rate": 0.2}
            ref = Reference(angle + 0.02, 0.1, 0.2)
            one, other = (c.update(k * STEP, sample, ref) for c in (neural, sliding))
            assert one == pytest.approx(other, rel=1e-6)


def test_networks_learn_from_zero_on_their_plant():
    controller, arm = Neural(SIMPLIFIED, **TRUE), SIMPLIFIED
    rows = run(controller, 12.0)
    error = np.abs(rows[:, 1] - [aim(t).angle for t in rows[:, 0]])
    parts = [float(np.sqrt(np.mean(part**2))) for part in np.array_split(error, 4)]
    assert parts[-1] < 0.4 * parts[0]
    assert all(np.all(np.isfinite(w)) for w in controller.weights.values())
    # the static network has learnt what holds the arm where it has been
    angle = math.radians(60.0)
    holds = arm.pressure(arm.weight * math.sin(angle), angle)
    learnt = float(controller.basis(angle) @ controller.weights["G"])
    assert learnt == pytest.approx(holds, rel=0.35)


@pytest.mark.parametrize("shape", [(), (2,)])
def test_saved_and_loaded_bit_for_bit(tmp_path, shape):
    trained, again = (Cascade(Neural(SIMPLIFIED, period=PERIOD)) for _ in range(2))
    rows = [sample if shape else singles(sample) for sample in samples(300, shape=shape)]
    for k, row in enumerate(rows):
        trained.update(k * PERIOD, row, aim(k * PERIOD))
    again.outer.load(trained.outer.save(tmp_path / "networks.json"))
    assert any(np.any(w != 0.0) for w in again.outer.weights.values())
    for name, weights in trained.outer.weights.items():
        assert np.array_equal(weights, again.outer.weights[name])
    again.reset()
    assert np.array_equal(again.outer.weights["G"], trained.outer.weights["G"])
    assert [p.name for p in tmp_path.iterdir()] == ["networks.json"]
    again.update(0.0, rows[0], aim(0.0))


def test_files_that_are_no_networks_are_refused(tmp_path):
    controller = Neural(SIMPLIFIED)
    path = controller.save(tmp_path / "a.json")
    with pytest.raises(ParameterError, match="nodes"):
        Neural(SIMPLIFIED, nodes=9).load(path)
    text = path.read_text()
    changes = (("networks/1", "networks/9"), ("0.0", "NaN"), ("0.0, ", ""))
    for wrong in ("", "{}", "[1]", *(text.replace(*change, 1) for change in changes)):
        path.write_text(wrong)
        refused(("a.json", lambda: controller.load(path)))
    refused(("missing.json", lambda: controller.load(tmp_path / "missing.json")))


def test_wrong_arguments_are_named():
    refused(
        ("slope", lambda: Sliding(SIMPLIFIED, slope=0.0)),
        ("switching", lambda: Sliding(SIMPLIFIED, switching=-1.0)),
        ("boundary_layer", lambda: Sliding(SIMPLIFIED, boundary_layer=math.nan)),
        ("gains", lambda: AdaptiveSliding(SIMPLIFIED, (1.0, 1.0))),
        ("bounds", lambda: AdaptiveSliding(SIMPLIFIED, bounds=[(0.0, 1.0)] * 3)),
        ("bounds = 'some'.* or three pairs", lambda: AdaptiveSliding(SIMPLIFIED, bounds="some")),
        ("start", lambda: Neural(SIMPLIFIED, start="other")),
        ("nodes", lambda: Neural(SIMPLIFIED, nodes=1)),
        ("bounds", lambda: Neural(SIMPLIFIED, bounds=(1.0, 1.0, -1.0))),
        ("arm", lambda: Neural(SIMPLIFIED.scaled(np.ones(2)), start="model")),
        ("7 x 7", lambda: fuzzy_rules(np.full((7, 7), 4.0))),
    )
