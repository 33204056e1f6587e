"""Gymnasium environments: clean by its checker, seeded, ends and rewards right; many are the single
ones.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

from pamrs.control import gym as gym_module  # noqa: E402
from pamrs.control.trajectories import lift_hold_return  # noqa: E402

#: A plant that leaves the range of its model within a sample.
BREAKING = {"joint_angle": 0.5, "joint_rate": -500.0}
SHORT = lift_hold_return(0.3, 0.9, ramp=0.2, hold=0.2, duration=0.8)


def test_the_checker_finds_nothing():
    check_env(gym_module.ShoulderEnv(trajectory=SHORT), skip_render_check=True)
    made = gymnasium.make("pamrs.control.gym:pamrs/Shoulder-v0")
    check_env(made.unwrapped, skip_render_check=True)


def test_the_space_has_physical_bounds():
    env = gym_module.ShoulderEnv()
    low, high = env.observation_space.low, env.observation_space.high
    assert np.isfinite(low).all()
    assert np.isfinite(high).all()
    assert low[2] == pytest.approx(-101325.0)
    assert high[0] == pytest.approx(math.radians(120) + 0.2)
    assert env.action_space.shape == (1,)


def test_a_step_is_the_simulators():
    env = gym_module.ShoulderEnv(trajectory=SHORT, effort=0.5)
    env.reset(seed=1)
    simulator = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.02)
    last = 0.0
    for k, opening in enumerate((0.4, 1.0, -0.5, 3.0)):
        seen, reward, terminated, truncated, info = env.step(np.array([opening], dtype=np.float32))
        opening = float(np.clip(np.float32(opening), -1.0, 1.0))
        sample = simulator.step(5.0 + 5.0 * opening)
        assert seen[:3] == pytest.approx(
            [sample[n] for n in ("joint_angle", "joint_rate", "muscle_pressure")], rel=1e-6
        )
        wanted = SHORT(0.02 * (k + 1))
        assert seen[3:] == pytest.approx([wanted.angle, wanted.rate, opening], rel=1e-6)
        assert reward == pytest.approx(
            -((wanted.angle - sample["joint_angle"]) ** 2) - 0.5 * (opening - last) ** 2
        )
        assert info["valve_command"] == pytest.approx(5.0 + 5.0 * opening)
        assert not terminated
        assert not truncated
        last = opening


def test_it_is_truncated_at_the_end_and_not_before():
    env = gym_module.ShoulderEnv(trajectory=SHORT)
    env.reset()
    ends = [env.step(np.zeros(1, dtype=np.float32))[2:4] for _ in range(40)]
    assert ends == [(False, False)] * 39 + [(False, True)]


def test_a_plant_that_leaves_its_model_is_terminated():
    env = gym_module.ShoulderEnv(trajectory=SHORT)
    env.reset()
    env._simulator.restore(
        pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=0.02, initial=BREAKING).state
    )
    seen, reward, terminated, truncated, _ = env.step(np.zeros(1, dtype=np.float32))
    assert env.observation_space.contains(seen)
    assert terminated
    assert not truncated
    assert reward < -99.0


def test_seeds_choose_the_target_within_its_range():
    env = gym_module.ShoulderEnv(targets=(0.5, 1.0))
    targets = [env.reset(seed=s)[1]["target"] for s in (1, 2, 1)]
    assert targets[0] == targets[2] != targets[1]
    more = [env.reset()[1]["target"] for _ in range(30)]
    assert len(set(more)) == 30
    assert 0.5 <= min(more) < max(more) <= 1.0


def test_many_arms_are_the_single_ones():
    many = gym_module.ShoulderVectorEnv(3, sample_time=0.05, targets=(0.5, 1.0))
    assert many._batch.side_by_side.all()  # the single ones are not: the last digits differ
    ones = [gym_module.ShoulderEnv(sample_time=0.05, targets=(0.5, 1.0)) for _ in range(3)]
    seen, info = many.reset(seed=7)
    first = [env.reset(seed=7 + i) for i, env in enumerate(ones)]
    assert (seen == np.stack([f[0] for f in first])).all()
    assert info["target"] == pytest.approx([f[1]["target"] for f in first])
    assert many.observation_space.contains(seen)
    rng = np.random.default_rng(0)
    for k in range(300):
        action = rng.uniform(-1, 1, (3, 1)).astype(np.float32)
        seen, reward, terminated, truncated, _ = many.step(action)
        alone = [env.step(a) for env, a in zip(ones, action, strict=True)]
        np.testing.assert_allclose(seen, np.stack([a[0] for a in alone]), rtol=1e-6, atol=1e-9)
        assert reward == pytest.approx([a[1] for a in alone], rel=1e-7)
        assert terminated.tolist() == [a[2] for a in alone]
        assert truncated.tolist() == [a[3] for a in alone] == [k == 299] * 3
    # the step after the end begins the next episodes
    seen, reward, terminated, truncated, info = many.step(action)
    assert (seen == np.stack([env.reset()[0] for env in ones])).all()
    assert not (terminated | truncated).any()
    assert not reward.any()


def test_one_plant_that_ends_truncates_the_others():
    many = gym_module.ShoulderVectorEnv(3, trajectory=SHORT)
    many.reset(seed=1)
    other = pamrs.Batch(
        pamrs.rigs.shoulder(),
        n=3,
        sample_time=0.02,
        initial={"joint_angle": 0.5, "joint_rate": [0.0, -500.0, 0.0]},
    )
    many._batch.restore(other.state)
    _, reward, terminated, truncated, _ = many.step(np.zeros((3, 1), dtype=np.float32))
    assert terminated.tolist() == [False, True, False]
    assert truncated.tolist() == [True, False, True]
    assert (reward < -99.0).tolist() == [False, True, False]


def test_a_seed_may_be_any_whole_number():
    many, env = gym_module.ShoulderVectorEnv(2), gym_module.ShoulderEnv()
    assert (many.reset(seed=np.int64(3))[0] == many.reset(seed=3)[0]).all()
    assert (env.reset(seed=np.int64(3))[1]["target"]) == env.reset(seed=3)[1]["target"]


def test_the_vector_is_made_by_its_name():
    made = gymnasium.make_vec(
        "pamrs/Shoulder-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    assert isinstance(made.unwrapped, gym_module.ShoulderVectorEnv)
    made.reset(seed=[1, 2])


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: gym_module.ShoulderEnv(pamrs.rigs.named("antagonistic_joint")), "one joint"),
        (lambda: gym_module.ShoulderEnv(targets=(1.0, 0.5)), "targets"),
        (lambda: gym_module.ShoulderEnv(effort=-1.0), "effort"),
        (lambda: gym_module.ShoulderEnv(sample_time=0.0), "sample_time"),
        (lambda: gym_module.ShoulderEnv(sample_time=math.nan), "sample_time"),
        (lambda: gym_module.ShoulderEnv(sample_time="a"), "sample_time"),
        (lambda: gym_module.ShoulderEnv(trajectory=SHORT, sample_time=1.0), "sample_time"),
        (lambda: gym_module.ShoulderEnv(render_mode="human"), "render_mode"),
        (lambda: gym_module.ShoulderVectorEnv(2, render_mode="human"), "render_mode"),
        (lambda: gym_module.ShoulderEnv().step(np.zeros(1)), "before reset"),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ParameterError, match=word):
        call()
    env = gym_module.ShoulderEnv()
    env.reset()
    with pytest.raises(ParameterError, match="action"):
        env.step(np.array([math.nan]))
