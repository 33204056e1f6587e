"""Gymnasium environments: one arm, and many of them in one :class:`pamrs.Batch`.

Importing this module registers ``pamrs/Shoulder-v0``;
``gymnasium.make("pamrs.control.gym:pamrs/Shoulder-v0")`` imports it too.

**Task.** Follow a lift, hold and return to an angle that is drawn at each reset, or a trajectory
that is given.

**Action.** Opening of the valve, from -1 (venting, 0 V) over 0 (closed) to 1 (filling, 10 V), held
for one sample.

**Observation.** Joint angle [rad], joint rate [rad/s], muscle pressure [Pa, gauge], reference angle
[rad] and its rate [rad/s], and the opening that was held last, which the reward asks for; kept
within the bounds of the space: the stops with 0.2 rad of give, 30 rad/s, vacuum and twice the
supply.

**Reward.** ``-(error^2 + effort * change^2)`` for each sample: error [rad] after the step, change
of the opening since the last one. A plant that leaves the range of its model costs ``penalty``
more.

**End.** *Terminated* when the plant leaves the range of its model; *truncated* when the record is
over.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.control._values import positive_number
from pamrs.control.trajectories import Trajectory, lift_hold_return
from pamrs.errors import ParameterError, SimulationError, missing_package
from pamrs.rig import Rig
from pamrs.simulation import Simulator

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise missing_package(error, "control") from error

__all__ = ["ID", "ShoulderEnv", "ShoulderVectorEnv"]

ID = "pamrs/Shoulder-v0"

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]


class _Task:
    """What both environments have in common: spaces, what is seen, what it is worth."""

    def __init__(
        self,
        rig: Rig | None,
        trajectory: Trajectory | None,
        targets: tuple[float, float] | None,
        sample_time: float,
        effort: float,
        penalty: float,
    ) -> None:
        from pamrs import rigs

        self.rig = rigs.shoulder() if rig is None else rig
        joints, valves = self.rig.tables("joint"), self.rig.tables("valve")
        if any(set(tables) != {""} for tables in (joints, valves, self.rig.tables("chamber"))):
            raise ParameterError(
                f"rig {self.rig.name!r} is not allowed: one joint, one valve and one chamber, "
                "without names, are needed"
            )
        joint = joints[""]
        self.low, self.high = float(joint["min_angle"]), float(joint["max_angle"])
        self.rest = float(joint["rest_angle"])
        reach = self.high - self.low
        self.targets = (
            (self.low + 0.2 * reach, self.low + 0.6 * reach) if targets is None else targets
        )
        if not self.low <= self.targets[0] <= self.targets[1] <= self.high:
            raise ParameterError(
                f"targets = {targets} is not allowed: rising, from {self.low:g} to {self.high:g} "
                "rad"
            )
        if not (
            math.isfinite(effort) and effort >= 0.0 and math.isfinite(penalty) and penalty >= 0.0
        ):
            raise ParameterError(
                f"effort = {effort} and penalty = {penalty} are not allowed: zero or more is needed"
            )
        sample_time = positive_number("sample_time", sample_time)
        self.trajectory, self.sample_time, self.effort, self.penalty = (
            trajectory,
            sample_time,
            effort,
            penalty,
        )
        self.null, self.range = (float(valves[""][key]) for key in ("null_voltage", "half_range"))
        length = 15.0 if trajectory is None else trajectory.duration
        self.samples = math.floor(length / sample_time + 1e-9)
        if self.samples < 1:
            raise ParameterError(
                f"sample_time = {sample_time} s is not allowed: the record of {length:g} s needs "
                "one sample at least"
            )
        supply = max(
            float(table["initial_pressure"]) for table in self.rig.tables("supply").values()
        )
        ambient = float(self.rig.tables("gas")[""]["ambient_pressure"])
        least = [self.low - 0.2, -30.0, -ambient, self.low - 0.2, -30.0, -1.0]
        most = [self.high + 0.2, 30.0, 2.0 * supply, self.high + 0.2, 30.0, 1.0]
        self.observed = gymnasium.spaces.Box(
            np.array(least, dtype=np.float32), np.array(most, dtype=np.float32), dtype=np.float32
        )
        self.acted = gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)

    def draw(self, random: np.random.Generator) -> Trajectory:
        """The trajectory of an episode."""
        target = float(
            random.uniform(*self.targets)
        )  # drawn also where it is not used, so that seeds mean the same
        if self.trajectory is not None:
            return self.trajectory
        return lift_hold_return(self.rest, target, duration=15.0)

    def seen(self, sample: dict[str, Any], angle: Any, rate: Any, opening: Any) -> Array32:
        """The observation, kept in its space."""
        values = [
            sample["joint_angle"],
            sample["joint_rate"],
            sample["muscle_pressure"],
            angle,
            rate,
            opening,
        ]
        space = self.observed
        return np.clip(np.stack(values, axis=-1).astype(np.float32), space.low, space.high)

    def worth(self, error: Any, change: Any) -> Any:
        """The reward of a sample."""
        return -(error * error + self.effort * change * change)

    def volts(self, opening: Any) -> Any:
        """The valve's command."""
        return self.null + self.range * opening


class ShoulderEnv(gymnasium.Env[Array32, Array32]):
    """One arm with one valve; see the module for actions, observations, rewards and ends.

    Parameters
    ----------
    rig : Rig, optional
        The plant; the shoulder by default.
    trajectory : Trajectory, optional
        What to follow; by default lifts of 15 s to an angle that is drawn from ``targets``.
    targets : (float, float), optional
        Range of that angle [rad]; a fifth to three fifths of the way between the stops by default.
    sample_time : float
        Time that an action is held [s].
    effort, penalty : float
        Of the reward.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    MissingPackageError
        On import, if gymnasium is not installed.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        rig: Rig | None = None,
        trajectory: Trajectory | None = None,
        *,
        targets: tuple[float, float] | None = None,
        sample_time: float = 0.02,
        effort: float = 0.01,
        penalty: float = 100.0,
        render_mode: str | None = None,
    ) -> None:
        _check_render_mode(render_mode)
        self.render_mode = None
        self._task = _Task(rig, trajectory, targets, sample_time, effort, penalty)
        self.observation_space, self.action_space = self._task.observed, self._task.acted
        self._simulator = Simulator(self._task.rig, sample_time=sample_time)
        self._trajectory: Trajectory | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array32, dict[str, Any]]:
        """Begin an episode at rest.

        Parameters
        ----------
        seed : int, optional
            Of what is drawn from now on.
        options : dict, optional
            Not used.

        Returns
        -------
        observation : ndarray, shape (6,)
        info : dict
            ``target`` [rad], the highest angle of the trajectory.
        """
        super().reset(seed=None if seed is None else int(seed))
        self._trajectory = self._task.draw(self.np_random)
        self._k, self._opening = 0, 0.0
        sample = self._simulator.reset()
        wanted = self._trajectory(0.0)
        return self._task.seen(sample, wanted.angle, wanted.rate, self._opening), {
            "target": _target(self._trajectory)
        }

    def step(self, action: Array32) -> tuple[Array32, float, bool, bool, dict[str, Any]]:
        """Hold an opening for one sample.

        Parameters
        ----------
        action : ndarray, shape (1,)
            From -1 to 1; kept within.

        Returns
        -------
        observation, reward, terminated, truncated, info
            ``info`` has the ``error`` [rad] and the ``valve_command`` [V].

        Raises
        ------
        ParameterError
            If the action is not one finite number, or the environment was not reset.
        """
        if self._trajectory is None:
            raise ParameterError("step was called before reset")
        opening = float(_openings(action, 1)[0])
        failed = False
        try:
            sample = self._simulator.step(self._task.volts(opening))
        except SimulationError:
            failed, sample = True, self._simulator.observe()
        self._k += 1
        wanted = self._trajectory(self._k * self._task.sample_time)
        error = float(wanted.angle) - sample["joint_angle"]
        reward = float(self._task.worth(error, opening - self._opening)) - (
            self._task.penalty if failed else 0.0
        )
        self._opening = opening
        info = {"error": error, "valve_command": self._task.volts(opening)}
        seen = self._task.seen(sample, wanted.angle, wanted.rate, opening)
        return seen, reward, failed, not failed and self._k >= self._task.samples, info


class ShoulderVectorEnv(gymnasium.vector.VectorEnv[Array32, Array32, Any]):
    """Many arms in one :class:`pamrs.Batch`; arm ``i`` of a reset with ``seed`` is
    :class:`ShoulderEnv` reset with ``seed + i``, to some 1e-9 where the batch runs in lanes.

    All episodes begin and end together: the batch has one clock. When one plant leaves the range of
    its model, that one is terminated and all others are truncated. The step after an end begins the
    next episodes and ignores its actions (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    num_envs : int
        How many arms.
    rig, trajectory, targets, sample_time, effort, penalty
        As for :class:`ShoulderEnv`.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        rig: Rig | None = None,
        trajectory: Trajectory | None = None,
        *,
        targets: tuple[float, float] | None = None,
        sample_time: float = 0.02,
        effort: float = 0.01,
        penalty: float = 100.0,
        render_mode: str | None = None,
    ) -> None:
        from pamrs.simulation import Batch

        _check_render_mode(render_mode)
        self.render_mode = None
        self._task = _Task(rig, trajectory, targets, sample_time, effort, penalty)
        self._batch = Batch(self._task.rig, n=num_envs, sample_time=sample_time)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = (
            self._task.observed,
            self._task.acted,
        )
        self.observation_space = batch_space(self._task.observed, num_envs)
        self.action_space = batch_space(self._task.acted, num_envs)
        self._randoms = [np.random.default_rng() for _ in range(num_envs)]
        self._trajectories: list[Trajectory] = []
        self._over = False

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array32, dict[str, Any]]:
        """Begin an episode of every arm at rest.

        Parameters
        ----------
        seed : int or list of int, optional
            Of the first arm, the others one more each; or of each.
        options : dict, optional
            Not used.

        Returns
        -------
        observations : ndarray, shape (n, 6)
        infos : dict
            ``target`` [rad], shape (n,).
        """
        if seed is not None:
            seeds = (
                [int(seed) + i for i in range(self.num_envs)]
                if isinstance(seed, (int, np.integer))
                else list(seed)
            )
            if len(seeds) != self.num_envs:
                raise ParameterError(
                    f"seed has {len(seeds)} entries; one for each of {self.num_envs} arms is needed"
                )
            for i, own in enumerate(seeds):
                if own is not None:
                    self._randoms[i] = gymnasium.utils.seeding.np_random(int(own))[0]
        return self._begin()

    def _begin(self) -> tuple[Array32, dict[str, Any]]:
        self._trajectories = [self._task.draw(random) for random in self._randoms]
        self._k, self._over = 0, False
        self._openings = np.zeros(self.num_envs)
        angle, rate = self._wanted()
        targets = np.array([_target(trajectory) for trajectory in self._trajectories])
        seen = self._task.seen(self._batch.reset(), angle, rate, self._openings)
        return seen, {"target": targets, "_target": np.ones(self.num_envs, dtype=np.bool_)}

    def _wanted(self) -> tuple[Array, Array]:
        now = self._k * self._task.sample_time
        points = np.array(
            [trajectory(now)[:2] for trajectory in self._trajectories], dtype=np.float64
        )
        return points[:, 0], points[:, 1]

    def step(
        self, actions: Array32
    ) -> tuple[Array32, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Hold an opening of every arm for one sample.

        Parameters
        ----------
        actions : ndarray, shape (n, 1)

        Returns
        -------
        observations, rewards, terminations, truncations, infos

        Raises
        ------
        ParameterError
            If an action is not finite, or the environment was not reset.
        """
        if not self._trajectories:
            raise ParameterError("step was called before reset")
        none = np.zeros(self.num_envs, dtype=np.bool_)
        if self._over:
            seen, info = self._begin()
            return seen, np.zeros(self.num_envs), none, none.copy(), info
        openings = _openings(actions, self.num_envs)
        sample = self._batch.step(self._task.volts(openings))
        self._k += 1
        failed = np.array([status is not None for status in self._batch.status], dtype=np.bool_)
        angle, rate = self._wanted()
        error = angle - sample["joint_angle"]
        reward = self._task.worth(error, openings - self._openings) - self._task.penalty * failed
        self._openings = openings
        self._over = bool(failed.any()) or self._k >= self._task.samples
        truncated = ~failed if self._over else none
        there = np.ones(self.num_envs, dtype=np.bool_)
        info = {
            "error": error,
            "_error": there,
            "valve_command": self._task.volts(openings),
            "_valve_command": there,
        }
        return self._task.seen(sample, angle, rate, openings), reward, failed, truncated, info


def _check_render_mode(render_mode: str | None) -> None:
    """Refuse what ``gymnasium.make`` passes on, where it is not None."""
    if render_mode is not None:
        raise ParameterError(
            f"render_mode = {render_mode!r} is not allowed: there is none; Simulation.animate "
            "draws an arm"
        )


def _target(trajectory: Trajectory) -> float:
    """The highest angle of a trajectory [rad]."""
    return float(np.max(trajectory.sampled(trajectory.duration / 200.0)[1].angle))


def _openings(action: Any, n: int) -> Array:
    values = np.asarray(action, dtype=np.float64)
    if values.shape not in ((n, 1), (n,)) or not np.isfinite(values).all():
        raise ParameterError(
            f"action with the shape {values.shape} is not allowed: ({n}, 1) finite numbers are "
            "needed"
        )
    return np.clip(values.reshape(n), -1.0, 1.0)


if ID not in gymnasium.registry:
    gymnasium.register(
        ID,
        entry_point="pamrs.control.gym:ShoulderEnv",
        vector_entry_point="pamrs.control.gym:ShoulderVectorEnv",
    )
