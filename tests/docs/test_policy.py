"""The environment of Gymnasium on the page "train a policy on a rig" does what the page says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pamrs
from tests.docs.test_site import DOCS, programs

pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

SAMPLE = 0.02


@pytest.fixture(scope="module")
def page() -> dict[str, Any]:
    """Names of the page's program after it ran."""
    names: dict[str, Any] = {}
    (text,) = programs(DOCS / "how-to" / "train_a_policy.md")
    exec(compile(text, "train_a_policy.md", "exec"), names)
    return names


def test_the_checker_finds_nothing(page: dict[str, Any]) -> None:
    check_env(page["env"], skip_render_check=True)


def test_a_step_is_the_simulators_and_the_reward_its_error(page: dict[str, Any]) -> None:
    env = page["Lift"](pamrs.rigs.shoulder(), effort=0.5)
    target = env.reset(seed=3)[1]["target"]
    assert target == env.reset(seed=3)[1]["target"] != env.reset()[1]["target"]
    env.reset(seed=3)
    plant, last = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=SAMPLE), 0.0
    for k, action in enumerate((0.5, 1.0, -3.0)):
        seen, reward, *ends, info = env.step(np.array([action], dtype=np.float32))
        action = max(action, -1.0)
        sample = plant.step(5.0 + 5.0 * action)
        error = env.lift(SAMPLE * (k + 1)).angle - sample["joint_angle"]
        assert seen[[0, 1, 4]].tolist() == pytest.approx(
            [sample[name] for name in ("joint_angle", "joint_rate", "muscle_pressure")], rel=1e-6
        )
        assert seen[5] == action
        assert info["error"] == pytest.approx(error)
        assert reward == pytest.approx(-(error**2) - 0.5 * (action - last) ** 2)
        assert ends == [False, False]
        last = action


def test_it_ends_with_its_record_or_when_the_plant_leaves_its_model(page: dict[str, Any]) -> None:
    env, still = page["Lift"](pamrs.rigs.shoulder()), np.zeros(1, dtype=np.float32)
    env.reset(seed=1)
    ends = [env.step(still)[2:4] for _ in range(round(15.0 / SAMPLE))]
    assert ends == [(False, False)] * (len(ends) - 1) + [(False, True)]
    env.reset(seed=1)
    gone = {"joint_angle": 0.5, "joint_rate": -500.0}
    broken = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=SAMPLE, initial=gone)
    env.plant.restore(broken.state)
    seen, reward, *ends, _ = env.step(still)
    assert env.observation_space.contains(seen)
    assert ends == [True, False]
    assert reward < -99.0
