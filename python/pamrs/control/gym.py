"""Gymnasium environments: one rig, and many of them in one :class:`pamrs.Batch`.

Importing this module registers ``pamrs/Shoulder-v0``;
``gymnasium.make("pamrs.control.gym:pamrs/Shoulder-v0")`` imports it too. Any rig with joints, or a
hanging mass, behind valves or regulators is an environment: ``RigEnv(rig)``.

**Task.** Follow a lift, hold and return to an angle that is drawn at each reset, of several joints
one for each, or trajectories that are given. A mass that hangs is followed by its muscle's length.

**Action.** One number for every valve, and every regulator without a valve, held for one sample:
the opening of a valve, from -1 (venting, 0 V) over 0 (closed) to 1 (filling, 10 V); the set
pressure of a regulator, from -1 (ambient) to 1 (the pressure limit). A regulator that feeds a valve
holds what it begins with.

**Observation.** Joint angles [rad], joint rates [rad/s], chamber pressures [Pa, gauge], reference
angles [rad] and their rates [rad/s], and the actions that were held last, which the reward asks
for; the names of all are in ``env.names``. Kept within the bounds of the space: the stops with 0.2
rad of give, 30 rad/s (0.05 m, 5 m/s of a length), vacuum and twice the largest pressure at first,
or the limit.

**Reward.** ``-(error^2 + effort * change^2)`` for each sample, summed over joints and actions:
error [rad] (or [m]) after the step, change of the action since the last one. A plant that leaves
the range of its model costs ``penalty`` more.

**End.** *Terminated* when the plant leaves the range of its model; *truncated* when the record is
over.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import one_of, positive, refused, whole
from pamrs.channels import channel_of, dotted, unit_of
from pamrs.control._groups import direct_regulators, lengths_of
from pamrs.control._protocol import keywords_of
from pamrs.control.trajectories import JointTrajectories, Trajectory, check_reach, lift_hold_return
from pamrs.errors import ParameterError, SimulationError, missing_package
from pamrs.rig import Rig
from pamrs.simulation import Batch, Simulator, core_rig

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise missing_package(error, "control") from error

__all__ = ["ID", "RigEnv", "RigVectorEnv"]

ID = "pamrs/Shoulder-v0"

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]


class _Moved(NamedTuple):
    """A joint, or a load's length."""

    name: str
    angle: str
    rate: str
    low: float
    high: float
    give: float
    fastest: float


def _moved(rig: Rig) -> list[_Moved]:
    """What of a rig follows a trajectory."""
    found = [
        _Moved(
            name,
            dotted("joint_angle", name),
            dotted("joint_rate", name),
            float(table["min_angle"]),
            float(table["max_angle"]),
            0.2,
            30.0,
        )
        for name, table in rig.tables("joint").items()
    ]
    if (lengths := lengths_of(rig)) is not None:
        found.append(_Moved("", "length", "length_rate", *lengths, 0.05, 5.0))
    if not found or not core_rig(rig).inputs:
        raise ParameterError(
            f"rig {rig.name!r} is not allowed: joints or a mass that hangs, and a valve or "
            "regulator, are needed"
        )
    return found


class _Task:
    """What both environments have in common: spaces, what is seen, what it is worth."""

    def __init__(
        self,
        rig: Rig | None,
        trajectory: Any,
        targets: Any,
        sample_time: float,
        effort: float,
        penalty: float,
        pressure_limit: float | None,
        render_mode: str | None,
    ) -> None:
        # what gymnasium.make passes on
        one_of("render_mode", render_mode, [None], also="; Simulation.animate draws an arm")
        from pamrs import rigs

        self.rig = rigs.shoulder() if rig is None else rig
        self.moved = _moved(self.rig)
        self.targets = self._targets(targets)
        sample_time = positive("sample_time", sample_time)
        self.trajectory = self._given(trajectory)
        self.sample_time, self.effort = sample_time, positive("effort", effort, zero=True)
        self.penalty = positive("penalty", penalty, zero=True)
        direct = {dotted("supply_command", name) for name in direct_regulators(self.rig)}
        self.inputs = tuple(
            name
            for name in core_rig(self.rig).inputs
            if channel_of(name) != "supply_command" or name in direct
        )
        self.middle, self.range, most = self._commands(pressure_limit)
        length = 15.0 if self.trajectory is None else self.trajectory.duration
        self.samples = math.floor(length / sample_time + 1e-9)
        if self.samples < 1:
            raise ParameterError(
                f"sample_time = {sample_time} s is not allowed: the record of {length:g} s needs "
                "one sample at least"
            )
        self.pressures = [dotted("muscle_pressure", name) for name in self.rig.tables("chamber")]
        self.observed, self.names = self._observed(most)
        self.acted = gymnasium.spaces.Box(-1.0, 1.0, (len(self.inputs),), dtype=np.float32)
        first = Simulator(self.rig, sample_time=sample_time).observe()
        self.rest = [first[one.angle] for one in self.moved]

    def _targets(self, given: Any) -> list[tuple[float, float]]:
        """Range of the highest angle of every joint."""
        if isinstance(given, Mapping):
            names = [one.name for one in self.moved]
            if sorted(given) != sorted(names):
                raise ParameterError(
                    f"targets has {', '.join(map(repr, given))}; the joints are "
                    f"{', '.join(map(repr, names))}"
                )
            each = [given[name] for name in names]
        else:
            each = [given] * len(self.moved)
        found = []
        for one, pair in zip(self.moved, each, strict=True):
            reach = one.high - one.low
            low, high = (one.low + 0.2 * reach, one.low + 0.6 * reach) if pair is None else pair
            if not one.low <= low <= high <= one.high:
                ends = f"from {one.low:g} to {one.high:g} {unit_of(one.angle)}"
                raise refused("targets", given, f"rising, {ends}")
            found.append((low, high))
        return found

    def _given(self, trajectory: Any) -> Trajectory | JointTrajectories | None:
        """A trajectory for every joint."""
        if isinstance(trajectory, JointTrajectories):
            trajectory = trajectory.of_joint
        names = [one.name for one in self.moved]
        if trajectory is None:
            return None
        if isinstance(trajectory, Trajectory) and len(names) == 1:
            one = self.moved[0]
            lengths = (one.low, one.high) if one.angle == "length" else None
            check_reach(trajectory, trajectory.duration, lengths)
            return trajectory
        if not isinstance(trajectory, Mapping) or sorted(trajectory) != sorted(names):
            raise ParameterError(
                "trajectory is not allowed: a mapping of "
                f"{', '.join(map(repr, names))} to a trajectory each is needed"
            )
        every = JointTrajectories({name: trajectory[name] for name in names})
        check_reach(every, every.duration)
        return every

    def _commands(self, limit: float | None) -> tuple[Array, Array, float]:
        """Middle and half range of every command, and the largest pressure [Pa]."""
        holding = [*self.rig.tables("supply").values(), *self.rig.tables("chamber").values()]
        most = max(float(table.get("initial_pressure", 0.0)) for table in holding)
        ends = []
        for name in self.inputs:
            block = name.partition(".")[2]
            if channel_of(name) == "valve_command":
                valve = self.rig.tables("valve")[block]
                ends.append((float(valve["null_voltage"]), float(valve["half_range"])))
                continue
            limit = self.rig.limits.get("max_pressure") if limit is None else limit
            if limit is None:
                raise ParameterError(
                    f"rig {self.rig.name!r} has a regulator: give pressure_limit, or [limits] "
                    "max_pressure in the rig"
                )
            limit = positive("pressure_limit", limit)
            most = max(most, limit)
            ends.append((0.5 * limit, 0.5 * limit))
        if not most > 0.0:
            raise ParameterError(
                f"rig {self.rig.name!r} is not allowed: its supplies and chambers begin with "
                f"{most:g} Pa at most, and one above 0 is needed that feeds the valves"
            )
        middle, half = np.array(ends).T
        return middle, half, most

    def _observed(self, most: float) -> tuple[Any, tuple[str, ...]]:
        """The space of observations, and the name of each."""
        ambient = float(self.rig.tables("gas")[""]["ambient_pressure"])
        angles = [(m.angle, m.low - m.give, m.high + m.give) for m in self.moved]
        rates = [(m.rate, -m.fastest, m.fastest) for m in self.moved]
        bounds = [
            *angles,
            *rates,
            *((name, -ambient, 2.0 * most) for name in self.pressures),
            *(
                (dotted("reference", m.name), low, high)
                for m, (_, low, high) in zip(self.moved, angles, strict=True)
            ),
            *((dotted("reference_rate", m.name), -m.fastest, m.fastest) for m in self.moved),
            *((name, -1.0, 1.0) for name in self.inputs),
        ]
        least, largest = (np.array([row[k] for row in bounds], dtype=np.float32) for k in (1, 2))
        names = tuple(row[0] for row in bounds)
        return gymnasium.spaces.Box(least, largest, dtype=np.float32), names

    def draw(self, random: np.random.Generator) -> Trajectory | JointTrajectories:
        """The trajectory of an episode."""
        # drawn also where it is not used, so that seeds mean the same
        each = [float(random.uniform(*pair)) for pair in self.targets]
        if self.trajectory is not None:
            return self.trajectory
        made = {
            one.name: lift_hold_return(rest, target, duration=15.0)
            for one, rest, target in zip(self.moved, self.rest, each, strict=True)
        }
        return made[self.moved[0].name] if len(made) == 1 else JointTrajectories(made)

    def held_first(self) -> Array:
        """Actions before the first one: valves closed, regulators as they begin."""
        found = []
        for k, name in enumerate(self.inputs):
            value = self.middle[k]
            if channel_of(name) == "supply_command":
                table = self.rig.tables("supply")[name.partition(".")[2]]
                value = float(table["initial_pressure"])
            found.append((value - self.middle[k]) / self.range[k])
        return np.asarray(np.clip(found, -1.0, 1.0), dtype=np.float64)

    def seen(self, sample: dict[str, Any], angle: Any, rate: Any, actions: Any) -> Array32:
        """The observation, kept in its space; angles, rates and actions along the first axis."""
        values = [
            *(sample[one.angle] for one in self.moved),
            *(sample[one.rate] for one in self.moved),
            *(sample[name] for name in self.pressures),
            *angle,
            *rate,
            *actions,
        ]
        space = self.observed
        return np.clip(np.stack(values, axis=-1).astype(np.float32), space.low, space.high)

    def errors(self, sample: dict[str, Any], angle: Any) -> Array:
        """Reference less angle of every joint, along the first axis."""
        return np.array(
            [wanted - sample[one.angle] for one, wanted in zip(self.moved, angle, strict=True)]
        )

    def worth(self, error: Array, change: Array) -> Any:
        """The reward of a sample, of arrays along their first axis."""
        return -((error * error).sum(axis=0) + self.effort * (change * change).sum(axis=0))

    def commands(self, actions: Array) -> Array:
        """Commands of actions, along the first axis."""
        shape = (-1,) + (1,) * (actions.ndim - 1)
        made: Array = self.middle.reshape(shape) + self.range.reshape(shape) * actions
        return made

    def keywords(self, commands: Array) -> dict[str, Any]:
        """The same as keywords of a step."""
        values = commands if commands.ndim > 1 else commands.tolist()
        return keywords_of(dict(zip(self.inputs, values, strict=True)))

    def told(self, values: Array) -> Any:
        """Values along the first axis as they are told: plants first, one of them by itself."""
        if len(values) == 1:
            return values[0] if values.ndim > 1 else float(values[0])
        return values.T

    def info(self, error: Array, commands: Array) -> dict[str, Any]:
        """What is told of a step."""
        name = channel_of(self.inputs[0]) if len(self.inputs) == 1 else "commands"
        return {"error": self.told(error), name: self.told(commands)}


class RigEnv(gymnasium.Env[Array32, Array32]):
    """One rig; see the module for actions, observations, rewards and ends.

    Parameters
    ----------
    rig : Rig, optional
        The plant; the shoulder by default.
    trajectory : Trajectory, JointTrajectories, or mapping of str to Trajectory, optional
        What to follow, of several joints one for each; by default lifts of 15 s to an angle that is
        drawn from ``targets``.
    targets : (float, float), or mapping of str to that, optional
        Range of that angle [rad], one for all joints or one for each; a fifth to three fifths of
        the way between the stops by default.
    sample_time : float
        Time that an action is held [s].
    effort, penalty : float
        Of the reward.
    pressure_limit : float, optional
        Largest set pressure of a regulator [Pa]; by default ``max_pressure`` of ``[limits]``.

    Raises
    ------
    ParameterError
        If an argument is not allowed; if the rig has nothing that moves, no command, or no pressure
        above the ambient one to begin with.
    MissingPackageError
        On import, if gymnasium is not installed.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        rig: Rig | None = None,
        trajectory: Trajectory | Mapping[str, Trajectory] | JointTrajectories | None = None,
        *,
        targets: tuple[float, float] | Mapping[str, tuple[float, float]] | None = None,
        sample_time: float = 0.02,
        effort: float = 0.01,
        penalty: float = 100.0,
        pressure_limit: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._task = _Task(
            rig, trajectory, targets, sample_time, effort, penalty, pressure_limit, render_mode
        )
        self.render_mode = None
        self.observation_space, self.action_space = self._task.observed, self._task.acted
        self._simulator = Simulator(self._task.rig, sample_time=self._task.sample_time)
        self._trajectory: Trajectory | JointTrajectories | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Name of every number of an observation."""
        return self._task.names

    @property
    def inputs(self) -> tuple[str, ...]:
        """Name of the command of every number of an action."""
        return self._task.inputs

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
        observation : ndarray, shape (len(names),)
        info : dict
            ``target`` [rad], the highest angle of the trajectory, (joints,) of several.
        """
        super().reset(seed=None if seed is None else int(seed))
        self._trajectory = self._task.draw(self.np_random)
        self._k, self._actions = 0, self._task.held_first()
        sample = self._simulator.reset()
        angle, rate = _wanted(self._trajectory, 0.0)
        return self._task.seen(sample, angle, rate, self._actions), {
            "target": self._task.told(_target(self._trajectory))
        }

    def step(self, action: Array32) -> tuple[Array32, float, bool, bool, dict[str, Any]]:
        """Hold an action for one sample.

        Parameters
        ----------
        action : ndarray, shape (len(inputs),)
            From -1 to 1; kept within.

        Returns
        -------
        observation, reward, terminated, truncated, info
            ``info`` has the ``error`` [rad], of several joints shape (joints,), and the
            ``valve_command`` [V] or ``supply_command`` [Pa], of several ``commands`` in the order
            of :attr:`inputs`.

        Raises
        ------
        ParameterError
            If the action has not one finite number for each command, or the environment was not
            reset.
        """
        if self._trajectory is None:
            raise ParameterError("step was called before reset")
        task = self._task
        actions = _actions(action, (len(task.inputs),))
        commands = task.commands(actions)
        failed = False
        try:
            sample = self._simulator.step(**task.keywords(commands))
        except SimulationError:
            failed, sample = True, self._simulator.observe()
        self._k += 1
        angle, rate = _wanted(self._trajectory, self._k * task.sample_time)
        error = task.errors(sample, angle)
        reward = float(task.worth(error, actions - self._actions))
        self._actions = actions
        seen, over = task.seen(sample, angle, rate, actions), self._k >= task.samples
        return (
            seen,
            reward - (task.penalty if failed else 0.0),
            failed,
            not failed and over,
            task.info(error, commands),
        )


class RigVectorEnv(gymnasium.vector.VectorEnv[Array32, Array32, Any]):
    """Many rigs in one :class:`pamrs.Batch`; rig ``i`` of a reset with ``seed`` is :class:`RigEnv`
    reset with ``seed + i``, to some 1e-9 where the batch runs in lanes.

    All episodes begin and end together: the batch has one clock. When one plant leaves the range of
    its model, that one is terminated and all others are truncated. The step after an end begins the
    next episodes and ignores its actions (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    num_envs : int
        How many rigs.
    rig, trajectory, targets, sample_time, effort, penalty, pressure_limit
        As for :class:`RigEnv`.

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
        trajectory: Trajectory | Mapping[str, Trajectory] | JointTrajectories | None = None,
        *,
        targets: tuple[float, float] | Mapping[str, tuple[float, float]] | None = None,
        sample_time: float = 0.02,
        effort: float = 0.01,
        penalty: float = 100.0,
        pressure_limit: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        try:
            self.num_envs = whole("num_envs", num_envs, 1)
        except ParameterError as error:
            told = f"{error}; the rig comes behind it, RigVectorEnv(64, rig)"
            raise ParameterError(told) from None
        self._task = _Task(
            rig, trajectory, targets, sample_time, effort, penalty, pressure_limit, render_mode
        )
        self.render_mode = None
        self._batch = Batch(self._task.rig, n=num_envs, sample_time=self._task.sample_time)
        self.single_observation_space = self._task.observed
        self.single_action_space = self._task.acted
        self.observation_space = batch_space(self._task.observed, num_envs)
        self.action_space = batch_space(self._task.acted, num_envs)
        self._randoms = [np.random.default_rng() for _ in range(num_envs)]
        self._trajectories: list[Trajectory | JointTrajectories] = []
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
        observations : ndarray, shape (n, len(names))
        infos : dict
            ``target`` [rad], shape (n,), of several joints (n, joints).
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
        self._actions = np.repeat(self._task.held_first()[:, None], self.num_envs, axis=1)
        angle, rate = self._wanted()
        targets = np.array([_target(trajectory) for trajectory in self._trajectories]).T
        seen = self._task.seen(self._batch.reset(), angle, rate, self._actions)
        return seen, {
            "target": self._task.told(targets),
            "_target": np.ones(self.num_envs, dtype=np.bool_),
        }

    def _wanted(self) -> tuple[Array, Array]:
        now = self._k * self._task.sample_time
        points = np.array([_wanted(trajectory, now) for trajectory in self._trajectories])
        angle, rate = points.transpose(1, 2, 0)
        return angle, rate

    def step(
        self, actions: Array32
    ) -> tuple[Array32, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Hold an action of every rig for one sample.

        Parameters
        ----------
        actions : ndarray, shape (n, len(inputs))

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
        task = self._task
        held = _actions(actions, (self.num_envs, len(task.inputs))).T
        commands = task.commands(held)
        sample = self._batch.step(**task.keywords(commands))
        self._k += 1
        failed = np.array([status is not None for status in self._batch.status], dtype=np.bool_)
        angle, rate = self._wanted()
        error = task.errors(sample, angle)
        reward = task.worth(error, held - self._actions) - task.penalty * failed
        self._actions = held
        self._over = bool(failed.any()) or self._k >= task.samples
        truncated = ~failed if self._over else none
        there = np.ones(self.num_envs, dtype=np.bool_)
        told = task.info(error, commands)
        info = {**told, **{f"_{name}": there for name in told}}
        return task.seen(sample, angle, rate, held), reward, failed, truncated, info


def _wanted(trajectory: Trajectory | JointTrajectories, time: float) -> tuple[Array, Array]:
    """Reference angle and rate of every joint."""
    angle, rate, _ = trajectory(time)
    return np.atleast_1d(angle), np.atleast_1d(rate)


def _target(trajectory: Trajectory | JointTrajectories) -> Array:
    """The highest angle of every joint [rad]."""
    each = (
        trajectory.of_joint.values() if isinstance(trajectory, JointTrajectories) else [trajectory]
    )
    return np.array([np.max(one.sampled(one.duration / 200.0)[1].angle) for one in each])


def _actions(action: Any, shape: tuple[int, ...]) -> Array:
    values = np.asarray(action, dtype=np.float64)
    flat = shape[:-1] if shape[-1] == 1 else shape
    if values.shape not in (shape, flat) or not np.isfinite(values).all():
        raise ParameterError(
            f"action with the shape {values.shape} is not allowed: {shape} finite numbers are "
            "needed"
        )
    return np.clip(values.reshape(shape), -1.0, 1.0)


if ID not in gymnasium.registry:
    gymnasium.register(
        ID,
        entry_point="pamrs.control.gym:RigEnv",
        vector_entry_point="pamrs.control.gym:RigVectorEnv",
    )
