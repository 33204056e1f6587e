"""Gymnasium environments: clean by its checker, seeded, ends and rewards right; many are the single
ones.
"""

import inspect
import math

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

from pamrs.control import RigController, RigModel, closed_loop  # noqa: E402
from pamrs.control import gym as gym_module  # noqa: E402
from pamrs.control.trajectories import lift_hold_return  # noqa: E402
from tests.simulation.refusals import refused  # noqa: E402

#: A plant that leaves the range of its model within a sample.
BREAKING = {"joint_angle": 0.5, "joint_rate": -500.0}
SHORT = lift_hold_return(0.3, 0.9, ramp=0.2, hold=0.2, duration=0.8)
STILL = np.zeros(1, dtype=np.float32)


def test_the_space_has_physical_bounds():
    env = gym_module.RigEnv()
    low, high = env.observation_space.low, env.observation_space.high
    assert np.isfinite(low).all()
    assert np.isfinite(high).all()
    assert low[2] == pytest.approx(-101325.0)
    assert high[0] == pytest.approx(math.radians(120) + 0.2)
    assert env.action_space.shape == (1,)


def test_it_ends_with_its_record_or_when_the_plant_leaves_its_model():
    env = gym_module.RigEnv(trajectory=SHORT)
    env.reset()
    ends = [env.step(STILL)[2:4] for _ in range(40)]
    assert ends == [(False, False)] * 39 + [(False, True)]
    env.reset()
    broken = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.02, initial=BREAKING)
    env._simulator.restore(broken.state)
    seen, reward, *ends, _ = env.step(STILL)
    assert env.observation_space.contains(seen)
    assert ends == [True, False]
    assert reward < -99.0


def test_seeds_choose_the_target_within_its_range():
    env = gym_module.RigEnv(targets=(0.5, 1.0))
    targets = [env.reset(seed=s)[1]["target"] for s in (1, 2, np.int64(1))]
    assert targets[0] == targets[2] != targets[1]
    more = [env.reset()[1]["target"] for _ in range(30)]
    assert len(set(more)) == 30
    assert 0.5 <= min(more) < max(more) <= 1.0


def test_one_plant_that_ends_truncates_the_others():
    many = gym_module.RigVectorEnv(3, trajectory=SHORT)
    many.reset(seed=1)
    start = {"joint_angle": 0.5, "joint_rate": [0.0, -500.0, 0.0]}
    other = pamrs.Batch(pamrs.rigs.shoulder(), n=3, sample_time=0.02, initial=start)
    many._batch.restore(other.state)
    _, reward, terminated, truncated, _ = many.step(np.zeros((3, 1), dtype=np.float32))
    assert terminated.tolist() == [False, True, False]
    assert truncated.tolist() == [True, False, True]
    assert (reward < -99.0).tolist() == [False, True, False]


def test_the_vector_is_made_by_its_name_and_takes_any_whole_number_as_seed():
    made = gymnasium.make_vec(
        "pamrs/Shoulder-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    assert isinstance(made.unwrapped, gym_module.RigVectorEnv)
    targets = [made.reset(seed=seed)[1]["target"] for seed in ([3, 4], np.int64(3), 3)]
    assert np.array_equal(targets, [targets[0]] * 3)


# ---------------------------------------------------------------- several valves and joints


NAMES = ("antagonistic_joint", "two_joint_arm", "regulated_joint", "hanging_mass", "recruitment")
PAIR, ARM, REGULATED, MASS, BUNDLE = map(pamrs.rigs.named, NAMES)
SHOULDER = pamrs.rigs.shoulder()
UNLIMITED = pamrs.Rig(
    "unlimited", {key: part for key, part in REGULATED.model.items() if key != "limits"}
)
LIFTS = {"elbow": SHORT, "wrist": lift_hold_return(0.4, 0.8, ramp=0.2, hold=0.2, duration=0.8)}


def of(rig, trajectory=None, **options):
    if rig is REGULATED:
        options["pressure_limit"] = 1e6
    return gym_module.RigEnv(rig, trajectory, **options)


@pytest.mark.parametrize(
    ("rig", "seen", "acted"),
    [
        (SHOULDER, 6, 1),
        (PAIR, 8, 2),
        (ARM, 12, 2),
        (REGULATED, 6, 1),
        (MASS, 6, 1),
        (BUNDLE, 10, 3),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_the_checker_finds_nothing_on_any_rig(rig, seen, acted):
    made = gymnasium.make("pamrs.control.gym:pamrs/Shoulder-v0") if rig is SHOULDER else None
    env = made.unwrapped if made else of(rig)
    assert env.observation_space.shape == (seen,) == (len(env.names),)
    assert env.action_space.shape == (acted,) == (len(env.inputs),)
    check_env(env, skip_render_check=True)


def test_a_step_of_two_joints_is_the_simulators():
    env = of(ARM, LIFTS, effort=0.5)
    words = ("joint_angle", "joint_rate", "muscle_pressure", "reference", "reference_rate")
    words = (*words, "valve_command")
    assert env.names == tuple(f"{word}.{name}" for word in words for name in ("elbow", "wrist"))
    seen, info = env.reset(seed=1)
    assert info["target"].tolist() == pytest.approx([0.9, 0.8])
    simulator, last = pamrs.Simulator(ARM, sample_time=0.02), np.zeros(2)
    for k, action in enumerate(([0.4, -0.2], [1.0, 0.5], [-0.5, 3.0])):
        seen, reward, *_, info = env.step(np.array(action, dtype=np.float32))
        action = np.clip(np.float32(action), -1.0, 1.0).astype(float)
        sample = simulator.step({"elbow": 5.0 + 5.0 * action[0], "wrist": 5.0 + 5.0 * action[1]})
        wanted = [trajectory(0.02 * (k + 1)) for trajectory in LIFTS.values()]
        error = [w.angle - sample[n] for w, n in zip(wanted, env.names[:2], strict=True)]
        assert seen[:6] == pytest.approx([sample[n] for n in env.names[:6]], rel=1e-6)
        assert seen[6:8] == pytest.approx([w.angle for w in wanted], rel=1e-6)
        assert seen[8:10] == pytest.approx([w.rate for w in wanted], rel=1e-6)
        assert seen[10:] == pytest.approx(action, rel=1e-6)
        change = action - last
        expected = -(np.dot(error, error) + 0.5 * np.dot(change, change))
        assert reward == pytest.approx(expected, rel=1e-12)
        assert info["error"] == pytest.approx(error)
        assert info["commands"] == pytest.approx(5.0 + 5.0 * action)
        last = action


def fed_by_a_chamber(pressure):
    """The shoulder whose valve is fed by a vessel in the place of the supply."""
    model = pamrs.rigs.named("throttled_supply").model
    del model["supply"], model["line"]["feed"]
    model["chamber"]["feed"] |= {"initial_pressure": pressure, "dead_volume": 0.015}
    return pamrs.Rig("vessel", model)


def test_a_vessel_may_feed_the_valve():
    env = of(fed_by_a_chamber(9e5), SHORT)
    names = [name for name in env.names if name.startswith("muscle_pressure")]
    high = [env.observation_space.high[env.names.index(name)] for name in names]
    assert high == [1.8e6] * 2
    check_env(env, skip_render_check=True)
    with pytest.raises(ParameterError, match="vessel.*begin with 0 Pa at most"):
        of(fed_by_a_chamber(0.0), SHORT)


def test_a_regulator_is_set_from_nothing_to_its_limit():
    env = of(REGULATED, SHORT)
    seen, _ = env.reset()
    start = REGULATED.tables("supply")[""]["initial_pressure"]
    assert seen[-1] == pytest.approx(start / 5e5 - 1.0)
    for action, pressure in ((-1.0, 0.0), (0.2, 6e5), (1.0, 1e6)):
        *_, info = env.step(np.array([action], dtype=np.float32))
        assert info["supply_command"] == pytest.approx(pressure, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "trajectory"), [("antagonistic_joint", SHORT), ("two_joint_arm", LIFTS)]
)
def test_a_controller_of_a_rig_does_in_an_environment_what_it_does_in_a_loop(name, trajectory):
    rig = pamrs.rigs.named(name)
    model = RigModel(rig)
    controller = RigController(model, model.law("sliding", period=0.02))
    run = closed_loop(rig, controller, trajectory, sample_time=0.02)
    env = of(rig, trajectory, sample_time=0.02)
    seen, _ = env.reset()
    commands = np.array([run.command[name] for name in env.inputs])
    angles = [seen[: len(model.joints)]]
    for k in range(40):
        # what it answers in the loop, as an action
        seen, *_, info = env.step(((commands[:, k] - 5.0) / 5.0).astype(np.float32))
        angles.append(seen[: len(model.joints)])
        assert info["commands"] == pytest.approx(commands[:, k], abs=1e-5)
    expected = np.array([run.channels[name] for name in run.joints]).T
    assert np.array(angles) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("rig", [SHOULDER, PAIR, ARM, MASS], ids=lambda rig: rig.name)
def test_many_rigs_are_the_single_ones(rig):
    """To the last digits, which differ where the batch runs in lanes; one arm to its end."""
    options = {"sample_time": 0.05, **({"targets": (0.5, 1.0)} if rig is SHOULDER else {})}
    many = gym_module.RigVectorEnv(3, rig, **options)
    ones = [of(rig, **options) for _ in range(3)]
    seen, info = many.reset(seed=7)
    first = [env.reset(seed=7 + i) for i, env in enumerate(ones)]
    assert (seen == np.stack([f[0] for f in first])).all()
    assert np.array(info["target"]) == pytest.approx(np.array([f[1]["target"] for f in first]))
    assert many.observation_space.contains(seen)
    rng = np.random.default_rng(0)
    for k in range(300 if rig is SHOULDER else 20):
        action = rng.uniform(-1, 1, many.action_space.shape).astype(np.float32)
        seen, reward, terminated, truncated, info = many.step(action)
        alone = [env.step(a) for env, a in zip(ones, action, strict=True)]
        np.testing.assert_allclose(seen, np.stack([a[0] for a in alone]), rtol=1e-5, atol=1e-8)
        assert reward == pytest.approx([a[1] for a in alone], rel=1e-6)
        assert terminated.tolist() == [a[2] for a in alone]
        assert truncated.tolist() == [a[3] for a in alone] == [k == 299] * 3
        told = np.array([a[4]["error"] for a in alone])
        assert info["error"] == pytest.approx(told, rel=1e-6, abs=1e-9)
    if rig is SHOULDER:  # the step after the end begins the next episodes
        assert many._batch.side_by_side.all()
        seen, reward, terminated, truncated, _ = many.step(action)
        assert (seen == np.stack([env.reset()[0] for env in ones])).all()
        assert not (terminated | truncated | reward.astype(bool)).any()


def test_bad_input_is_named():
    env, many, shown = gym_module.RigEnv(), gym_module.RigVectorEnv, "Simulation.animate draws"
    env.reset()
    far, in_degrees = lift_hold_return(0.25, math.radians(40)), lift_hold_return(20.0, 60.0)
    refused(
        ("bench.*joints or a mass", lambda: gym_module.RigEnv(pamrs.rigs.named("bench"))),
        ("pressure_limit", lambda: gym_module.RigEnv(UNLIMITED)),
        ("pressure_limit", lambda: gym_module.RigEnv(REGULATED, pressure_limit=-1.0)),
        ("a mapping of 'elbow', 'wrist'", lambda: gym_module.RigEnv(ARM, SHORT)),
        ("a mapping of 'elbow', 'wrist'", lambda: gym_module.RigEnv(ARM, {"elbow": SHORT})),
        ("joints are 'elbow', 'w", lambda: gym_module.RigEnv(ARM, targets={"elbow": (0.5, 1.0)})),
        ("from 0.18 to 0.28 m", lambda: gym_module.RigEnv(MASS, targets=(0.5, 1.0))),
        ("targets", lambda: gym_module.RigEnv(targets=(1.0, 0.5))),
        ("effort", lambda: gym_module.RigEnv(effort=-1.0)),
        ("sample_time", lambda: gym_module.RigEnv(sample_time=0.0)),
        ("sample_time", lambda: gym_module.RigEnv(sample_time=math.nan)),
        ("sample_time", lambda: gym_module.RigEnv(sample_time="a")),
        ("sample_time", lambda: gym_module.RigEnv(trajectory=SHORT, sample_time=1.0)),
        (f"'human' is not allowed: None is needed; {shown}", lambda: many(1, render_mode="human")),
        (shown, lambda: gym_module.RigEnv(render_mode="human")),
        ("before reset", lambda: gym_module.RigEnv().step(np.zeros(1))),
        ("action", lambda: env.step(np.array([math.nan]))),
        (r"action with the shape \(2,\)", lambda: env.step(np.zeros(2))),
        ("goes to 0.6981 m, .*load.max_length = 0.28 m", lambda: gym_module.RigEnv(MASS, far)),
        ("goes to 60 rad.*degrees", lambda: gym_module.RigEnv(None, in_degrees)),
    )


@pytest.mark.parametrize("made", [gym_module.RigEnv, gym_module.RigVectorEnv])
def test_the_options_of_the_task_are_those_of_the_environment(made):
    assert "sample_time" in inspect.signature(made).parameters
    with pytest.raises(TypeError, match=rf"^{made.__name__}.*sampel_time"):
        made(sampel_time=0.1)


@pytest.mark.parametrize("num_envs", [pamrs.rigs.shoulder(), 0, 2.5, True])
def test_a_vector_asks_how_many_first(num_envs):
    with pytest.raises(ParameterError, match=r"num_envs = .* from 1 on .* RigVectorEnv\(64, rig\)"):
        gym_module.RigVectorEnv(num_envs)
