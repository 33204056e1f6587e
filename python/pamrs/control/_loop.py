"""A controller closed around a simulated plant: one run, recorded at the plant's sample time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import channel_of
from pamrs.control._protocol import Controller, Reference, check_controller, check_drives_valve
from pamrs.control._sensors import Reader, Sensors, reader_of
from pamrs.control.metrics import Metrics, evaluate
from pamrs.control.trajectories import Trajectory, check_angles
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Event, Simulator, core_rig, default_step, whole_samples

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Actuation", "ClosedLoop", "actuation_of", "closed_loop", "tracked_of"]

Array = NDArray[np.float64]
#: From a controller's command to the keywords of :meth:`pamrs.Simulator.step`:
#: ``lambda u: {"valve_command": {"flexor": u, ...}}``.
Actuation: TypeAlias = "Callable[[Any], Mapping[str, Any]]"
#: Beyond any valve's command [V]: what answers more answers something else.
MOST_VOLTS = 1000.0


@dataclass(frozen=True)
class ClosedLoop:
    """A closed loop as it went.

    Attributes
    ----------
    time : ndarray, shape (samples,)
        From the loop's begin [s]; the first row is the state that it began with.
    reference : Reference of ndarrays, shape (samples,)
        Where the joint should have been.
    command : ndarray, shape (samples,)
        What the controller held from each row on.
    channels : mapping of str to ndarray, shape (samples,)
        What the plant did, SI, without the sensors' errors.
    trajectory : Trajectory
    rig : Rig
        The plant.
    events : list of Event
        Stops reached and left, flows that became choked.
    joint : str
        Name of the channel that is tracked.
    """

    time: Array
    reference: Reference
    command: Array
    channels: Mapping[str, Array] = field(repr=False)
    trajectory: Trajectory
    rig: Rig = field(repr=False)
    events: list[Event] = field(repr=False, default_factory=list)
    joint: str = "joint_angle"

    @property
    def angle(self) -> Array:
        """The joint's angle [rad]."""
        return self.channels[self.joint]

    @property
    def error(self) -> Array:
        """Reference minus angle [rad]."""
        return np.asarray(self.reference.angle - self.angle, dtype=np.float64)

    def metrics(self, *, unit: str = "rad") -> Metrics:
        """Errors, curvature and phases, see :func:`pamrs.control.metrics.evaluate`.

        Parameters
        ----------
        unit : {"rad", "deg"}
            Of the angle in nu and omega.

        Returns
        -------
        Metrics

        Raises
        ------
        ParameterError
            If the unit is unknown or the run has less than three rows.
        """
        rate = self.channels.get(self.joint.replace("joint_angle", "joint_rate", 1))
        return evaluate(
            self.time,
            self.reference.angle,
            self.angle,
            rate=rate,
            parts=self.trajectory.phases,
            unit=unit,
        )

    def to_pandas(self) -> pd.DataFrame:
        """All columns as a table indexed by time [s].

        Returns
        -------
        pandas.DataFrame
            ``reference`` and ``reference_rate``, ``command``, and every channel.

        Raises
        ------
        MissingPackageError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            from pamrs.errors import missing_package

            raise missing_package(error, "io") from None
        columns = {
            "reference": self.reference.angle,
            "reference_rate": self.reference.rate,
            "command": self.command,
            **self.channels,
        }
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time"))


def closed_loop(
    plant: Rig | Simulator,
    controller: Controller,
    trajectory: Trajectory,
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
    trajectory : Trajectory
        Where the joint should be.
    duration : float, optional
        [s]; the trajectory's by default.
    sample_time : float, optional
        Time between two rows [s], a divisor of the controller's period; by default the longest that
        is at most 1 ms. Not for a simulator.
    step, initial : optional
        As for :class:`pamrs.Simulator`; not for a simulator.
    sensors : Sensors or Reader, optional
        What the controller is told; the truth by default. A reader,
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
    >>> import pamrs
    >>> from pamrs.control import PID, closed_loop
    >>> from pamrs.control.trajectories import degrees, step
    >>> run = closed_loop(pamrs.rigs.shoulder(), PID(1.4, 0.5, period=0.005),
    ...     step(*degrees(15, 40), duration=2.0))
    >>> run.time.size, bool(run.angle[-1] > run.angle[0])
    (2001, True)
    """
    simulator = _simulator(plant, controller, sample_time, step, initial)
    dt = simulator.sample_time
    every = whole_samples("controller.period", controller.period, dt, least=1)
    total = whole_samples(
        "duration", trajectory.duration if duration is None else duration, dt, least=1
    )
    check_angles(trajectory, total * dt)
    if not math.isfinite(start):
        raise ParameterError(f"start = {start} s is not allowed: a finite number is needed")
    act = actuation_of(simulator.rig, controller) if actuation is None else actuation
    began = (
        round(start / dt) if abs(round(start / dt) * dt - start) < 1e-9 * dt else start / dt
    )  # a restart at the same float
    names = _recorded(simulator.rig, channels, measured)
    read = reader_of(sensors, controller.period)
    if reset:
        controller.reset()
    commands = np.full(total + 1, np.nan)
    alias = dict(measured or {})
    k = 0

    def answer(sample: dict[str, float]) -> Any:
        nonlocal k
        now = (began + k) * dt
        for called, name in alias.items():
            sample[called] = sample[name]
        command = controller.update(now, sample if read is None else read(sample), trajectory(now))
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
    if actuation is None:
        _check_volts(simulator.rig, commands)
    time = np.asarray(np.arange(total + 1) * dt, dtype=np.float64)
    wanted = trajectory(np.asarray((began + np.arange(total + 1)) * dt, dtype=np.float64))
    out = {name: run[name] for name in names}
    return ClosedLoop(
        time,
        wanted,
        commands,
        out,
        trajectory,
        simulator.rig,
        run.events,
        alias.get("joint_angle", "joint_angle"),
    )


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


def _recorded(
    rig: Rig, channels: Iterable[str] | None, measured: Mapping[str, str] | None
) -> list[str]:
    """Names of the channels that are kept; the tracked ones always are."""
    known, tracked = core_rig(rig).channels, tracked_of(rig, measured)
    if channels is None:
        return known
    wanted = list(dict.fromkeys([*tracked, *channels]))
    for name in wanted:
        if name not in known:
            raise ParameterError(
                f"channels has {name!r}, and the rig has no such channel; it has: "
                f"{', '.join(known)}"
            )
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
    for name in (measured or {}).values():
        if name not in known:
            raise ParameterError(
                f"measured has {name!r}, and the rig has no such channel; it has: "
                f"{', '.join(known)}"
            )
    angle = (measured or {}).get("joint_angle", "joint_angle")
    if angle not in known:
        raise ParameterError(
            f"the rig {rig.name!r} has no channel {angle!r}; name the joint by measured; it has: "
            f"{', '.join(known)}"
        )
    return angle, angle.replace("joint_angle", "joint_rate", 1)


def actuation_of(rig: Rig, controller: Controller) -> Actuation:
    """What a single command drives: the only valve, or the only regulator of a rig without valves.

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
    inputs = core_rig(rig).inputs
    found = [name for name in inputs if name.startswith("valve_command")] or [
        n for n in inputs if n.startswith("supply_command")
    ]
    if len(found) != 1:
        raise ParameterError(
            f"the rig {rig.name!r} has the inputs {', '.join(inputs) or 'none'}: "
            "give actuation, from one command to the keywords of Simulator.step"
        )
    kind = channel_of(found[0])
    if kind == "valve_command":
        check_drives_valve(controller)
    return lambda command: {kind: command}
