"""A controller closed around a simulated plant: one run, recorded at the plant's sample time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import check_names, finite, one_of, quantities
from pamrs._tables import Columns, Tabular
from pamrs._tables import over_time as columns_over_time
from pamrs._views import Curve, Panels, View, in_laboratory_units, over_time
from pamrs.channels import channel_of, rate_of, unit_of
from pamrs.control._groups import joints_of, lengths_of
from pamrs.control._protocol import Controller, Reference, check_controller, check_drives_valve
from pamrs.control._sensors import Reader, Sensors, reader_of
from pamrs.control.metrics import Metrics, evaluate
from pamrs.control.trajectories import JointTrajectories, Trajectory, check_reach
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Event, Simulator, core_rig, default_step, whole_samples

#: From a controller's command to the keywords of :meth:`pamrs.Simulator.step`:
#: ``lambda u: {"valve_command": {"flexor": u, ...}}``.
Actuation: TypeAlias = "Callable[[Any], Mapping[str, Any]]"
#: Beyond any valve's command [V]: what answers more answers something else.
MOST_VOLTS = 1000.0


@dataclass(frozen=True)
class ClosedLoop(View, Tabular):
    """A closed loop as it went.

    Attributes
    ----------
    time : ndarray, shape (samples,)
        From the loop's begin [s]; the first row is the state that it began with.
    reference : Reference of ndarrays, shape (samples,)
        Where the joint should have been; of several joints (joints, samples).
    command : ndarray, shape (samples,), or mapping of str to ndarray
        What the controller held from each row on; every input by its name where it answers them
        all.
    channels : mapping of str to ndarray, shape (samples,)
        What the plant did, SI, without the sensors' errors.
    trajectory : Trajectory or JointTrajectories
    rig : Rig
        The plant.
    events : list of Event
        Stops reached and left, flows that became choked.
    joints : tuple of str
        Names of the channels that are tracked.
    """

    time: Array
    reference: Reference
    command: Any
    channels: Mapping[str, Array] = field(repr=False)
    trajectory: Trajectory | JointTrajectories
    rig: Rig = field(repr=False)
    events: list[Event] = field(repr=False, default_factory=list)
    joints: tuple[str, ...] = ("joint_angle",)

    @property
    def joint(self) -> str:
        """Name of the first channel that is tracked."""
        return self.joints[0]

    @property
    def angle(self) -> Array:
        """The joint's angle [rad], shape (samples,); of several joints (joints, samples)."""
        if len(self.joints) == 1:
            return self.channels[self.joints[0]]
        return np.array([self.channels[name] for name in self.joints])

    @property
    def error(self) -> Array:
        """Reference minus angle [rad]."""
        return np.asarray(self.reference.angle - self.angle, dtype=np.float64)

    def _panels(self) -> Panels:
        lines: dict[str, list[Curve]] = {}
        for name, wanted in zip(self.joints, np.atleast_2d(self.reference.angle), strict=True):
            reference = ("reference", self.time, wanted, {"color": "black", "ls": "--", "lw": 0.9})
            lines[name] = [reference, ("measured", self.time, self.channels[name], {})]
        own = self.command if isinstance(self.command, Mapping) else {}
        for name, values in {**self.channels, **own}.items():
            lines.setdefault(name, [("", self.time, values, {})])
        return over_time(lines)

    def _numbers(self) -> dict[str, str]:
        numbers = {"rig": self.rig.name, "time": f"{self.time[-1] - self.time[0]:.4g} s"}
        for name, error in zip(self.joints, np.atleast_2d(self.error), strict=True):
            sizes = {"rms": np.sqrt(np.mean(error**2)), "largest": np.abs(error).max()}
            sizes["last"] = error[-1]
            for word, size in sizes.items():
                numbers[f"{word} error of {name}"] = in_laboratory_units(name, size)
        return numbers | {"events": str(len(self.events))}

    def metrics(self, joint: str | None = None, *, unit: str | None = None) -> Metrics:
        """Errors, curvature and phases, see :func:`pamrs.control.metrics.evaluate`.

        Parameters
        ----------
        joint : str, optional
            Name of the joint, where several are tracked.
        unit : {"rad", "deg"}, optional
            Of the angle in nu and omega; rad by default. A length is in m.

        Returns
        -------
        Metrics

        Raises
        ------
        ParameterError
            If the unit is not one of what is tracked, the run has less than three rows, or several
            joints are tracked and none of them is named.
        """
        wanted, trajectory, channel = self.reference.angle, self.trajectory, self.joint
        if isinstance(trajectory, JointTrajectories):
            names = list(trajectory.of_joint)
            name: str = one_of("joint", joint, names)
            k = names.index(name)
            channel, wanted = self.joints[k], np.asarray(wanted)[k]
            trajectory = trajectory.of_joint[name]
        own = unit_of(channel)
        allowed = ("rad", "deg") if own == "rad" else (own,)
        chosen: str = one_of("unit", own if unit is None else unit, allowed)
        return evaluate(
            self.time,
            wanted,
            self.channels[channel],
            rate=self.channels.get(rate_of(channel)),
            parts=trajectory.phases,
            unit=chosen,
        )

    def _columns(self) -> Columns:
        commands = self.command if isinstance(self.command, Mapping) else {"command": self.command}
        wanted = self._wanted()
        own = unit_of(self.joint)
        units = {name: own + "/s" * name.startswith("reference_rate") for name in wanted}
        found = columns_over_time(self.time, {**wanted, **commands, **self.channels}, units)
        known = {name: unit for name, unit in found.units.items() if name != "command"}
        return found._replace(units=known)  # what a command is, its actuation alone says

    def _wanted(self) -> dict[str, Array]:
        """Reference and its rate as columns."""
        fields = {"reference": self.reference.angle, "reference_rate": self.reference.rate}
        if not isinstance(self.trajectory, JointTrajectories):
            return {name: np.asarray(values) for name, values in fields.items()}
        return {
            f"{name}.{joint}": np.asarray(values)[k]
            for name, values in fields.items()
            for k, joint in enumerate(self.trajectory.of_joint)
        }


@quantities
def closed_loop(
    plant: Rig | Simulator,
    controller: Controller,
    trajectory: Trajectory | Mapping[str, Trajectory] | JointTrajectories,
    duration: float | None = None,
    *,
    sample_time: float | None = None,
    step: float | None = None,
    initial: Mapping[str, float] | None = None,
    sensors: Sensors | Reader | None = None,
    actuation: Actuation | None = None,
    measured: Mapping[str, str] | None = None,
    channels: Iterable[str] | None = None,
    start: float = 0.0,
    reset: bool = True,
) -> ClosedLoop:
    """Let a controller follow a trajectory with a simulated plant.

    At each of its samples, ``controller.period`` apart, the controller sees the plant and the
    reference of that moment; what it answers is held exactly until its next sample. The plant may
    be another than the model that the controller was made with.

    Parameters
    ----------
    plant : Rig or Simulator
        A rig begins at ``initial``; a simulator goes on from where it is, at its own sample time.
    controller : Controller
        For one plant.
    trajectory : Trajectory, JointTrajectories, or mapping of str to Trajectory
        Where the joint should be; of several joints one for each name.
    duration : float, optional
        [s]; the trajectory's by default.
    sample_time : float, optional
        Time between two rows [s], a divisor of the controller's period; by default the longest that
        is at most 1 ms. Not for a simulator.
    step, initial : optional
        As for :class:`pamrs.Simulator`; not for a simulator.
    sensors : Sensors or Reader, optional
        What the controller reads; the truth by default. A reader,
        ``sensors.started(controller.period)``, goes on from loop to loop, where sensors begin
        again, with their noise and their delay.
    actuation : callable, optional
        From the command to the keywords of :meth:`pamrs.Simulator.step`: ``lambda u:
        {"valve_command": {"flexor": u, "extensor": 10.0 - u}}``. By default the command is that of
        the only valve, or of the only regulator of a rig without valves.
    measured : mapping of str to str, optional
        What the controller calls a channel -> the rig's name of it, for rigs with named blocks:
        ``{"joint_angle": "joint_angle.elbow"}``. The other channels keep their names.
    channels : iterable of str, optional
        Which of the rig's channels to record; all by default.
    start : float
        Time of the trajectory, and of the controller, at which the loop begins [s].
    reset : bool
        Whether the controller is reset first; without, it goes on (with ``start``) from what it has
        learnt.

    Returns
    -------
    ClosedLoop

    Raises
    ------
    ParameterError
        If times do not fit together, a name is unknown, the controller answers what is not a finite
        number, or a pressure where a valve is driven.
    SimulationError
        If the plant's state leaves the range in which the model holds.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> from pamrs.control import ArmModel, Cascade, Sliding, closed_loop
    >>> from pamrs.control.trajectories import cosine_cycles, degrees
    >>> rig = pamrs.rigs.shoulder()
    >>> follow = Cascade(Sliding(ArmModel.from_rig(rig)))
    >>> turn = cosine_cycles(*degrees(20, 50), rise=2.0, hold=1.0, cycles=1)
    >>> run = closed_loop(rig, follow, turn)
    >>> round(float(np.degrees(run.metrics().rms)), 1)  # of an arm that goes from 20 to 50 deg
    1.0
    """
    simulator = _simulator(plant, controller, sample_time, step, initial)
    dt = simulator.sample_time
    every = whole_samples("controller.period", controller.period, dt, least=1)
    wanted_of = trajectories_of(trajectory, controller)
    total = whole_samples(
        "duration", wanted_of.duration if duration is None else duration, dt, least=1
    )
    finite("start", start)
    act = actuation_of(simulator.rig, controller) if actuation is None else actuation
    # a restart at the same float
    began = round(start / dt) if abs(round(start / dt) * dt - start) < 1e-9 * dt else start / dt
    alias = measured_by(controller, measured)
    tracked = _angles(simulator.rig, controller, alias)
    by_length = tracked[0] == "length"
    check_reach(wanted_of, total * dt, lengths_of(simulator.rig) if by_length else None)
    names = _recorded(simulator.rig, channels, tracked)
    read = reader_of(sensors, controller.period)
    if reset:
        controller.reset()
    commands = np.full(total + 1, np.nan)
    whole = controller.answers == "inputs" and actuation is None
    k = 0

    def answer(sample: dict[str, float]) -> Any:
        nonlocal k
        now = (began + k) * dt
        for called, name in alias.items():
            sample[called] = sample[name]
        command = controller.update(now, sample if read is None else read(sample), wanted_of(now))
        if whole:
            k += every
            return command
        try:
            value = float(command)
        except (TypeError, ValueError):
            value = math.nan
        if not math.isfinite(value):
            raise ParameterError(
                f"the controller's command at {now:g} s is {command!r}: one finite number is needed"
            )
        commands[k : k + every + 1] = value  # the last row is what it would go on with
        k += every
        return act(value)

    run = simulator.control(answer, total * dt, period=every * dt)
    held: Any = commands
    if whole:
        held = {name: run[name] for name in core_rig(simulator.rig).inputs if name in run}
    elif actuation is None:
        _check_volts(simulator.rig, commands)
    time = np.asarray(np.arange(total + 1) * dt, dtype=np.float64)
    wanted = wanted_of(np.asarray((began + np.arange(total + 1)) * dt, dtype=np.float64))
    out = {name: run[name] for name in names}
    return ClosedLoop(
        time,
        wanted,
        held,
        out,
        wanted_of,
        simulator.rig,
        run.events,
        tuple(tracked[::2]),
    )


def trajectories_of(
    given: Trajectory | Mapping[str, Trajectory] | JointTrajectories, controller: Controller
) -> Trajectory | JointTrajectories:
    """A trajectory for each joint of a controller, in its order.

    Parameters
    ----------
    given : Trajectory, JointTrajectories, or mapping of str to Trajectory
    controller : Controller

    Returns
    -------
    Trajectory or JointTrajectories

    Raises
    ------
    ParameterError
        If the joints are not those of the controller.
    """
    joints: tuple[str, ...] = getattr(controller, "joints", ("",))
    if isinstance(given, JointTrajectories):
        given = given.of_joint
    if isinstance(given, Trajectory):
        if len(joints) > 1:
            raise ParameterError(
                f"trajectory is one for the joints {', '.join(joints)}: a mapping of each to its "
                "own is needed"
            )
        return given
    if sorted(given) != sorted(joints):
        raise ParameterError(
            f"trajectory has the joints {', '.join(map(repr, given)) or 'none'}; those of the "
            f"controller are {', '.join(map(repr, joints))}"
        )
    if len(joints) == 1:
        return given[joints[0]]
    return JointTrajectories({name: given[name] for name in joints})


def measured_by(controller: Controller, measured: Mapping[str, str] | None) -> dict[str, str]:
    """Names of the rig for the channels that a controller reads; a controller of one named joint
    needs none given.

    Parameters
    ----------
    controller : Controller
    measured : mapping of str to str, optional
        As for :func:`closed_loop`.

    Returns
    -------
    dict of str to str
    """
    alias = dict(measured or {})
    joints = getattr(controller, "joints", ("",))
    if getattr(controller, "tracked", ()) == ("length",):
        alias.setdefault("joint_angle", "length")
    if len(joints) == 1 and joints[0]:
        alias.setdefault("joint_angle", f"joint_angle.{joints[0]}")
    return alias


def _angles(rig: Rig, controller: Controller, alias: Mapping[str, str]) -> list[str]:
    """The rig's names of angle and rate of every joint that is tracked, one after the other."""
    joints = getattr(controller, "joints", ("",))
    if len(joints) == 1:
        return list(tracked_of(rig, alias))
    return [
        name
        for joint in joints
        for name in tracked_of(rig, {"joint_angle": f"joint_angle.{joint}"})
    ]


def _check_volts(rig: Rig, commands: Array) -> None:
    """Refuse commands that are no volts of a valve."""
    largest = float(np.nanmax(np.abs(commands)))
    if rig.tables("valve") and largest > MOST_VOLTS:
        raise ParameterError(
            f"the controller answered {largest:.3g} V: if that is a pressure [Pa], set its answers "
            "= 'pressure' and put it in a pamrs.control.Cascade"
        )


def _simulator(
    plant: Rig | Simulator,
    controller: Controller,
    sample_time: float | None,
    step: float | None,
    initial: Mapping[str, float] | None,
) -> Simulator:
    """The simulator that a run goes on with."""
    check_controller(controller)
    if isinstance(plant, Simulator):
        if not (sample_time is None and step is None and initial is None):
            raise ParameterError(
                "sample_time, step or initial is given, and the simulator has its own: give a Rig "
                "instead"
            )
        return plant
    return Simulator(
        plant,
        sample_time=default_step(controller.period) if sample_time is None else sample_time,
        step=step,
        initial=initial,
    )


def _recorded(rig: Rig, channels: Iterable[str] | None, tracked: Iterable[str]) -> list[str]:
    """Names of the channels that are kept; the tracked ones always are."""
    known = core_rig(rig).channels
    if channels is None:
        return known
    wanted = list(dict.fromkeys([*tracked, *channels]))
    check_names("channels", wanted, known, "channel of the plant")
    return wanted


def tracked_of(rig: Rig, measured: Mapping[str, str] | None) -> tuple[str, str]:
    """The rig's names of angle and rate of the joint that is tracked.

    Parameters
    ----------
    rig : Rig
    measured : mapping of str to str, optional
        As for :func:`closed_loop`.

    Returns
    -------
    tuple of (str, str)

    Raises
    ------
    ParameterError
        If a channel is not known, or there is no such joint.
    """
    known = core_rig(rig).channels
    check_names("measured", (measured or {}).values(), known, "channel of the plant")
    angle = (measured or {}).get("joint_angle", "joint_angle")
    if angle not in known:
        raise ParameterError(
            f"the rig {rig.name!r} has no channel {angle!r}; name the joint by measured, or put "
            "the controller into ByLength where a mass hangs; it has: "
            f"{', '.join(known)}"
        )
    return angle, rate_of(angle)


def actuation_of(rig: Rig, controller: Controller) -> Actuation:
    """Function from a single command to the keywords of ``Simulator.step``: it drives the only
    valve, or the only regulator of a rig without valves; commands by name are passed on.

    Parameters
    ----------
    rig : Rig
    controller : Controller
        Whose command it is.

    Returns
    -------
    callable

    Raises
    ------
    ParameterError
        If there is no such input, or more than one, or a valve would be given a pressure.
    """
    if controller.answers == "inputs":
        return lambda command: command
    inputs = core_rig(rig).inputs
    found = [name for name in inputs if name.startswith("valve_command")] or [
        n for n in inputs if n.startswith("supply_command")
    ]
    if not found:
        joints_of(rig)  # what is no arm and no mass says so
        raise ParameterError(
            f"the rig {rig.name!r} has no valve and no regulator that a command drives; it has the "
            f"inputs {', '.join(inputs) or 'none'}"
        )
    if len(found) != 1:
        raise ParameterError(
            f"the rig {rig.name!r} has the inputs {', '.join(inputs)}: "
            "give actuation, from one command to the keywords of Simulator.step"
        )
    kind = channel_of(found[0])
    if kind == "valve_command":
        check_drives_valve(controller)
    return lambda command: {kind: command}
