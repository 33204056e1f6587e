"""A law of motion on any rig: what it asks of each joint becomes pressures of the chambers, and
these the commands of valves and regulators.

::

    law              angles -> drive of each joint            one equation, see each law
    arm.torque       drive -> torque                          JointModel
    share            torque -> pressure of each chamber       Together, CoContraction, Recruitment
    way of the air   pressure -> command of its valve         PressureLoop, FlowInverse
                     or regulator                             SetPoint
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from pamrs._checks import check_names, one_of, refused
from pamrs.channels import dotted, unit_of
from pamrs.control._air import AirModel, FlowInverse, SetPoint
from pamrs.control._at_rest import SAMPLE, after, closed, kept, resting, slowest
from pamrs.control._groups import Group, lengths_of
from pamrs.control._load import shortened
from pamrs.control._protocol import (
    Controller,
    Measurement,
    Reference,
    Value,
    check_answers_pressure,
    keywords_of,
)
from pamrs.control._rig_model import RigModel
from pamrs.control._sampled import Restorer, SampledController, Stateful
from pamrs.control._sharing import CoContraction, Demand, Share, Together
from pamrs.control._values import where as chosen
from pamrs.errors import ParameterError
from pamrs.simulation import Simulator, core_rig

_STEPS: Final = 20  # of Newton's method on the torque that holds; one or two are enough
_STILL: Final = 1e-3  # of the rate below which a joint rests: a linear model is far from its limit


class _Law(Stateful):
    """A law over all joints, as a part: with J joints its batch has J rows for each plant."""

    def __init__(self, law: Controller, joints: int) -> None:
        self.law, self.joints = law, joints
        batch = getattr(law, "_gain_batch", None)
        if batch is not None and batch % joints:
            raise ParameterError(
                f"law has gains for {batch} rows: a multiple of the {joints} joints is needed"
            )
        self.gain_batch = None if batch is None else batch // joints

    def reset(self) -> None:
        self.law.reset()

    @property
    def state(self) -> dict[str, Any]:
        return self.law.state

    def restore(self, state: Mapping[str, Any]) -> None:
        self.law.restore(state)

    def _leaves(self) -> dict[str, bool]:
        leaves = self.law._leaves() if isinstance(self.law, Stateful) else {"state": False}
        return {f"law.{name}": changed for name, changed in leaves.items()}

    def _check_state(
        self, state: Mapping[str, Any], where: str = "state", batch: int | None = -1
    ) -> None:
        if not isinstance(self.law, SampledController):
            return
        self.law._check_state(state, where)
        own = state["batch"]
        plants = 1 if batch is None else batch
        allowed = (None, batch) if self.joints == 1 else (None, self.joints * plants)
        if batch != -1 and own not in allowed:
            rows = f"{self.joints * plants} rows are needed for {self.joints} joints"
            raise refused(f"{where}.batch", own, f"{rows} of {plants} plants")


def _command_of(group: Group) -> str:
    """Name of the command that fills and vents a group, ``valve_command.flexor``."""
    return dotted(group.feed.input, group.feed.name)


class _Named(Stateful):
    """Parts with the names of chambers or joints."""

    def __init__(self, parts: Mapping[str, Any]) -> None:
        self._PARTS = tuple(f"of {name}" for name in parts)  # type: ignore[misc]
        for name, part in parts.items():
            setattr(self, f"of {name}", part)


class RigController(SampledController):
    """A law of motion on any rig; answers the keywords of :meth:`pamrs.Simulator.step`.

    Parameters
    ----------
    model : RigModel
        What is known of the rig.
    law : Controller
        It answers a pressure (:class:`Sliding`, :class:`AdaptiveSliding`, :class:`Neural`,
        :class:`FeedforwardPressure`, one of your own), and was made with ``model.arm``: the drive
        of every joint.
    stiffness : float, ndarray, shape (n,), callable, or mapping of str to one, optional
        Of joints with muscles on both sides [N m/rad], see :class:`CoContraction`; the least
        pressures by default.
    shares : mapping of str to Share, optional
        Joint -> how its muscles share the torque, instead of :class:`Together` or
        :class:`CoContraction`; a share by itself for a rig of one joint.
    air : {"loop", "flow"} or mapping of str to AirWay, optional
        From a wanted pressure to a valve's command: a pressure loop with a gain by the valve's
        size, or the feedforward's :class:`FlowInverse`; or chamber -> one of your own. By default
        ``"flow"`` with a law whose motion is commanded, else ``"loop"``. A regulator is set to the
        pressure.
    km : float or ndarray, shape (n,)
        Of ``"flow"`` [1/s].
    lead : float or "lag"
        How far a regulator's set pressure is ahead of the wanted one [s], see :class:`SetPoint`;
        ``"lag"``: by its own time constant.

    Notes
    -----
    Channels are ``joint_angle``, ``joint_rate``, ``muscle_pressure`` and ``supply_pressure`` with
    the rig's names behind. With several joints a reference has one entry for each along its first
    axis, base first. A mass that hangs is followed by ``length`` and ``length_rate``, and a
    reference of it is a length [m]. Groups that the model leaves out stay vented.

    Raises
    ------
    ParameterError
        If the law answers no pressure, a name is unknown, or a number is not allowed.

    Examples
    --------
    >>> import pamrs
    >>> from pamrs.control import RigController, RigModel, Sliding, closed_loop
    >>> from pamrs.control.trajectories import degrees, step
    >>> rig = pamrs.rigs.named("antagonistic_joint")
    >>> model = RigModel(rig)
    >>> law = Sliding(model.arm, slope=8.0, period=0.005)
    >>> controller = RigController(model, law, stiffness=6.0)
    >>> run = closed_loop(rig, controller, step(*degrees(20, 45), duration=2.0))
    >>> bool(abs(run.error[-1]) < 0.05)
    True
    """

    answers = "inputs"
    _PARTS: ClassVar[tuple[str, ...]] = ("law", "shares", "air")

    def __init__(
        self,
        model: RigModel,
        law: Controller,
        *,
        stiffness: Any = None,
        shares: Share | Mapping[str, Share] | None = None,
        air: str | Mapping[str, Any] | None = None,
        km: Value = 20.0,
        lead: Value | str = "lag",
    ) -> None:
        check_answers_pressure(law)
        self.model, self.joints = model, model.joints
        self.law = _Law(law, len(model.joints))
        self._commanded = getattr(law, "motion", "measured") == "commanded"
        given = {model.joints[0]: shares} if isinstance(shares, Share) else dict(shares or {})
        check_names("shares", given, model.joints, "joint of the rig")
        self._shares = [self._share(name, given.get(name), stiffness) for name in model.joints]
        self.shares = _Named(dict(zip(model.joints, self._shares, strict=True)))
        chosen = ("flow" if self._commanded else "loop") if air is None else air
        self._ways = [self._way(group, chosen, law.period, km, lead) for group in model.groups]
        self.air = _Named(
            {group.chamber: way for group, way in zip(model.groups, self._ways, strict=True)}
        )
        super().__init__(law.period, parts=[w for w in self._ways if isinstance(w, Controller)])
        sizes = {size for size in (self._gain_batch, self.law.gain_batch) if size is not None}
        sizes |= {np.size(km)} if isinstance(km, np.ndarray) else set()
        if len(sizes) > 1:
            raise ParameterError(
                f"law and air have gains for {sorted(sizes)} plants: one number is needed"
            )
        self._gain_batch = sizes.pop() if sizes else None
        self._number = {name: k for k, name in enumerate(model.joints)}
        # a mass is followed by its length, and the law gets the shortening
        self._rest_length = getattr(model.arm, "rest_length", None)
        #: Shortest and longest length that a hanging mass can have [m]; None for joints.
        self.lengths = lengths_of(model.rig)
        self._channels = self._named_channels()
        #: Channels of the joints that are tracked, base first.
        self.tracked = tuple(self._channels[0])
        # the lowest command opens a group to the ambient
        lowest = {name: low for name, (_, low, _) in self.command_ranges.items()}
        self._vented = {name: lowest[name] for name in map(_command_of, model.vented)}
        self._called = [_command_of(group) for group in model.groups]
        self._open = [lowest[name] for name in self._called]
        self._before = Restorer(self)
        self.reset()

    # ------------------------------------------------------------------ made

    def _share(self, joint: str, given: Share | None, stiffness: Any) -> Share:
        if isinstance(stiffness, Mapping):
            check_names("stiffness", stiffness, self.joints, "joint of the rig")
            stiffness = stiffness.get(joint)
        torques, limit = self.model.torques_of(joint), self.model.pressure_limit
        if given is not None:
            if len(given.groups) != len(torques):
                raise ParameterError(
                    f"the share of {dotted('joint', joint)} is for {len(given.groups)} groups; "
                    f"the joint has {len(torques)}"
                )
            return given
        if len({torque.sign for torque in torques}) > 1:  # muscles on both sides
            return CoContraction(torques, limit, stiffness=stiffness)
        if stiffness is not None:
            raise ParameterError(
                f"stiffness is given for {dotted('joint', joint)}, whose muscles are all on one "
                "side: it follows from the torque"
            )
        return Together(torques, limit)

    def _way(
        self, group: Group, chosen: str | Mapping[str, Any], period: float, km: Value, lead: Any
    ) -> Any:
        model, feed = self.model, group.feed
        if isinstance(chosen, Mapping):
            check_names("air", chosen, [g.chamber for g in model.groups], "chamber with muscles")
            if group.chamber in chosen:
                return chosen[group.chamber]
            chosen = "flow" if self._commanded else "loop"
        one_of("air", chosen, ("loop", "flow"), also=", or a way for each chamber")
        if feed.input != "valve_command":
            if lead == "lag":
                supply = model.rig.tables("supply").get(feed.supply or "", {})
                lead = float(supply.get("time_constant", 0.0))
            return SetPoint(model.pressure_limit, period=period, lead=lead)
        if chosen == "flow":
            return FlowInverse(AirModel(model.rig, group.chamber), km, period=period)
        return model.pressure_loop(group.chamber, period=period)

    def _named_channels(self) -> tuple[list[str], list[str], list[str], list[str | None]]:
        model = self.model
        angles, rates = ["length"], ["length_rate"]
        if self._rest_length is None:
            angles = [dotted("joint_angle", name) for name in model.joints]
            rates = [dotted("joint_rate", name) for name in model.joints]
        pressures = [dotted("muscle_pressure", group.chamber) for group in model.groups]
        return angles, rates, pressures, [group.feed.source for group in model.groups]

    @property
    def command_ranges(self) -> dict[str, tuple[float, float, float]]:
        """Safe, lowest and highest value of every command by its name, ``valve_command.flexor``. A
        valve is closed at its safe value and keeps the air, a regulator is set to the ambient
        pressure.
        """
        found = {}
        for group in (*self.model.groups, *self.model.vented):
            low, rest, high = 0.0, 0.0, self.model.pressure_limit
            if group.feed.input == "valve_command":
                valve = self.model.rig.tables("valve")[group.feed.name]
                rest, half = float(valve["null_voltage"]), float(valve["half_range"])
                low, high = rest - half, rest + half
            found[_command_of(group)] = (rest, low, high)
        return found

    # ------------------------------------------------------------------ used

    def update(  # type: ignore[override]
        self, time: float, measurement: Measurement, reference: Reference
    ) -> dict[str, Any]:
        """Commands for a sample.

        Parameters
        ----------
        time : float
            [s]
        measurement : mapping of str to float or ndarray, shape (n,)
            Channels in SI units.
        reference : Reference
            Of one joint as for every controller; of J joints with entries of shape (J,), or (J, n)
            for a batch, or numbers for all.

        Returns
        -------
        dict
            ``valve_command`` [V], ``supply_command`` or ``pressure`` [Pa], each a number (an array
            of a batch) or a mapping of names to one.

        Raises
        ------
        ParameterError
            If a channel is missing or not finite; the message names it. Nothing is changed then.
        """
        angles, rates, pressures, supplies = self._read_all(measurement)
        aim = self._rows_of(reference)
        sample: dict[str, Value] = {"joint_angle": self._stacked(angles)}
        if rates is not None:
            sample["joint_rate"] = self._stacked(rates)
        before = self._before.take()
        try:
            drive = self.law.law.update(time, sample, aim)
            self._tick(time)
            return self._commands(time, drive, sample, aim, pressures, supplies)
        except ParameterError as error:
            self._before.put_back(before)
            raise self._refusal(str(error)) from None

    def _read_all(
        self, measurement: Measurement
    ) -> tuple[list[Value], list[Value] | None, list[Value], list[Value]]:
        angle, rate, pressure, supply = self._channels
        limit = self.model.pressure_limit
        angles = [self._read(measurement, name) for name in angle]
        rates = (
            [self._read(measurement, name) for name in rate]
            if all(name in measurement for name in rate)
            else None
        )
        if self._rest_length is not None:
            angles = [self._rest_length - angles[0]]
            rates = None if rates is None else [-rates[0]]
        pressures = [self._read(measurement, name) for name in pressure]
        supplies = [
            self._read(measurement, name) if name is not None and name in measurement else limit
            for name in supply
        ]
        return angles, rates, pressures, supplies

    def _commands(
        self,
        time: float,
        drive: Value,
        sample: Mapping[str, Value],
        aim: Reference,
        pressures: list[Value],
        supplies: list[Value],
    ) -> dict[str, Any]:
        """Convert the drive of the joints to the commands of valves and regulators."""
        arm = self.model.arm
        at = aim.angle if self._commanded else sample["joint_angle"]
        c1, c2 = arm.torque.at(self._full(at))
        torque = c1 * drive + c2
        each = [self._of_each(value) for value in (drive, torque, at)]
        turning = aim.rate if self._commanded else sample.get("joint_rate", 0.0)
        turned = self._of_each(self._full(turning))
        wanted, idle = self._shared(time, each, pressures, supplies)
        answers: dict[str, Any] = {}
        for i, (group, way) in enumerate(zip(self.model.groups, self._ways, strict=True)):
            k = self._number[group.joint]
            seen = {
                "muscle_pressure": pressures[i],
                "supply_pressure": supplies[i],
                "joint_angle": each[2][k],
                "joint_rate": turned[k],
            }
            command = self._sized_for_batch(way.track(time, seen, wanted[group.chamber]))
            vented = idle[group.chamber]
            if vented is not False:
                command = chosen(vented, self._open[i], command)
            answers[self._called[i]] = command
        answers |= {name: self._sized_for_batch(low) for name, low in self._vented.items()}
        return keywords_of(answers)

    def _shared(
        self,
        time: float,
        each: Sequence[Sequence[Value]],
        pressures: Sequence[Value],
        supplies: Sequence[Value],
    ) -> tuple[dict[str, Value], dict[str, Any]]:
        """Pressure of every chamber [Pa] for the drives, torques and angles of the joints, and True
        for each that is open to the ambient.
        """
        wanted: dict[str, Value] = {}
        idle: dict[str, Any] = {}
        for k, (name, share) in enumerate(zip(self.joints, self._shares, strict=True)):
            which = [i for i, g in enumerate(self.model.groups) if g.joint == name]
            demand = Demand(
                time,
                each[0][k],
                each[1][k],
                each[2][k],
                tuple(pressures[i] for i in which),
                tuple(supplies[i] for i in which),
            )
            for i, value in zip(which, share.pressures(demand), strict=True):
                wanted[self.model.groups[i].chamber] = value
            for i, vented in zip(which, share.vented, strict=True):
                idle[self.model.groups[i].chamber] = vented
        return wanted, idle

    def holding(self, angle: ArrayLike) -> dict[str, float]:
        """Initial values at which the model's rig rests: joints at their angles, chambers at the
        pressures that the shares ask for there, regulators set to them. Where the rig does not rest
        at them (a muscle without air that still pushes, which no share counts), the torque that the
        shares are asked for is changed by Newton's method until it does.

        Parameters
        ----------
        angle : float or array_like, shape (joints,)
            Of every joint [rad], base first; the length [m] of a hanging mass.

        Returns
        -------
        dict of str to float
            For :func:`pamrs.simulate`, :func:`closed_loop` and
            :func:`pamrs.control.linear.linearise`.

        Raises
        ------
        ParameterError
            If there is not an angle for each joint within its range, or no pressures up to the
            limit hold them, or none that the shares give.
        """
        arm, joints = self.model.arm, len(self.joints)
        rows = self._rows_held(angle)
        still = rows * 0.0
        c1, c2 = arm.torque.at(rows)
        torque = arm.inverse_dynamics(rows, still, still, still)
        self._check_drive(arm.pressure(torque, rows), rows, angle)
        for _ in range(_STEPS):
            drive = arm.pressure(torque, rows)
            each = [
                [float(value) for value in np.broadcast_to(values, joints)]
                for values in (drive, c1 * drive + c2, rows)
            ]
            start = self._beginning(angle, self._asked(each))
            moved, limits = self._drifting(start)
            if np.all(np.abs(moved) < _STILL * limits):
                return start
            # what the shares do not know (a muscle without air that bows out) is torque that lacks
            pushed = rows * 0.0 + (float(moved[0]) if joints == 1 else moved) / SAMPLE
            torque = torque - (
                arm.inverse_dynamics(rows, still, still, pushed)
                - arm.inverse_dynamics(rows, still, still, still)
            )
        k = int(np.argmax(np.abs(moved) / limits))
        raise ParameterError(
            f"no pressures hold {self.tracked[k]} = {np.ravel(angle)[k]:g}: at those that the "
            f"shares give it is accelerated by {abs(moved[k]) / SAMPLE:.3g} "
            f"{unit_of(self._channels[1][k])}2"
        )

    def _rows_held(self, angle: ArrayLike) -> Any:
        """Angles to hold, in the rows of the model, within their ranges."""
        joints, rest_length = len(self.joints), self._rest_length
        at = np.asarray(angle, dtype=np.float64)
        if rest_length is not None:
            at = rest_length - at
        low, high = (np.broadcast_to(end, joints) for end in self.model.arm.angle_range)
        if at.size != joints or not np.all((low <= at.ravel()) & (at.ravel() <= high)):
            if rest_length is not None:
                low, high = rest_length - high, rest_length - low
            ends = "; ".join(
                f"{name} from {first:.4g} to {last:.4g} {unit_of(name)}"
                for name, first, last in zip(self.tracked, low, high, strict=True)
            )
            what = "angle" if rest_length is None else "length"
            at_given = np.asarray(angle).tolist()
            raise refused(what, at_given, f"one number each is needed, {ends}")
        return float(at.ravel()[0]) if joints == 1 else at.ravel()

    def _check_drive(self, drive: Value, rows: Value, angle: ArrayLike) -> None:
        """Refuse angles whose drive is out of reach."""
        joints = len(self.joints)
        least, most = (np.broadcast_to(end, joints) for end in self.model.arm.limits(rows))
        for k, asked in enumerate(np.broadcast_to(drive, joints)):
            if not least[k] <= asked <= most[k]:
                raise ParameterError(
                    f"no pressures hold {self.tracked[k]} = {np.ravel(angle)[k]:g}: a drive of "
                    f"{asked:.4g} Pa is needed, and {least[k]:.4g} to {most[k]:.4g} can be had"
                )

    def _asked(self, each: Sequence[Sequence[Value]]) -> dict[str, Value]:
        """Pressure of every chamber [Pa] for drives, torques and angles; the state of the shares is
        kept.
        """
        groups, before = self.model.groups, self._before.take()
        rest, limit = [0.0] * len(groups), [self.model.pressure_limit] * len(groups)
        try:
            return self._shared(0.0, each, rest, limit)[0]
        finally:
            self._before.put_back(before)

    def _beginning(self, angle: ArrayLike, pressures: Mapping[str, Value]) -> dict[str, float]:
        """Initial values of angles and of pressures of the chambers."""
        start = dict(zip(self.tracked, np.ravel(angle).astype(float).tolist(), strict=True))
        for group in self.model.groups:
            pressure = float(pressures[group.chamber])
            start[dotted("muscle_pressure", group.chamber)] = pressure
            if group.feed.input == "supply_command":
                start[dotted("supply_pressure", group.feed.name)] = pressure
            start |= {name: pressure for name in self._lines_to(group.chamber)}
        return start

    def _drifting(self, start: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Rate of every joint [rad/s] shortly after initial values, signed as in the model, and the
        rate below which a joint counts as at rest.
        """
        rig = resting(self.model.rig)
        simulator = Simulator(rig, sample_time=SAMPLE, initial=start)
        commands = {**closed(rig), **kept(rig, simulator.observe())}
        for group in (*self.model.groups, *self.model.vented):
            if group.feed.input == "pressure":
                pressure = dotted("muscle_pressure", group.chamber)
                commands[dotted("pressure", group.chamber)] = start.get(pressure, 0.0)
        rates, limits = after(simulator, commands), slowest(rig)
        names = self._channels[1]
        sense = 1.0 if self._rest_length is None else -1.0
        return sense * np.array([rates[n] for n in names]), np.array([limits[n] for n in names])

    def _lines_to(self, chamber: str) -> list[str]:
        """Names of the pressures in lines that end in a chamber."""
        rig = self.model.rig
        known, place = core_rig(rig).states, dotted("chamber", chamber)
        lines = [name for name, ports in rig.ports("line").items() if ports["to"] == place]
        return [name for name in (dotted("line_pressure", n) for n in lines) if name in known]

    # ------------------------------------------------------------------ rows

    def _rows_of(self, reference: Reference) -> Reference:
        """The reference with the rows of the law."""
        joints = len(self.joints)
        if joints == 1:
            aim = self._aim(reference)
            return aim if self._rest_length is None else shortened(aim, self._rest_length)
        try:
            fields = Reference(*reference)
            arrays = [np.asarray(value, dtype=np.float64) for value in fields]
        except (TypeError, ValueError):
            raise self._refusal(
                f"reference = {reference!r} is not allowed: a Reference with an entry for each of "
                f"{', '.join(self.joints)} is needed"
            ) from None
        plants = 1 if self._size is None else self._size
        found = []
        for name, array in zip(Reference._fields, arrays, strict=True):
            if not np.all(np.isfinite(array)):
                raise self._refusal(f"reference.{name} is not finite")
            if array.ndim == 2 and array.shape[0] == joints and self._size is None:
                self._size = plants = array.shape[1]
            if array.shape not in ((), (joints,), (joints, plants)):
                raise self._refusal(
                    f"reference.{name} has shape {array.shape}: {(joints,)} is needed, or "
                    f"{(joints, plants)}"
                )
            rows = array if array.ndim == 0 else array.reshape(joints, -1)
            found.append(np.broadcast_to(rows, (joints, plants)).ravel())
        return Reference(*found)

    def _stacked(self, values: list[Value]) -> Value:
        """Values of each joint as rows."""
        if len(values) == 1:
            return values[0]
        plants = self._size or 1
        return np.concatenate([np.broadcast_to(value, plants) for value in values])

    def _full(self, value: Value) -> Value:
        """Rows of a value that may be one number for all."""
        if value.__class__ is float and len(self.joints) == 1:
            return value
        rows = len(self.joints) * (self._size or 1)
        return np.broadcast_to(value, rows) if np.ndim(value) == 0 else value

    def _of_each(self, value: Value) -> list[Value]:
        """Rows as one value for each joint."""
        if len(self.joints) == 1:
            return [value]
        rows = np.asarray(value).reshape(len(self.joints), -1)
        return rows[:, 0].tolist() if self._size is None else list(rows)

    def _sized_for_batch(self, value: Value) -> Value:
        """A command for every plant of a batch."""
        if self._size is None:
            return float(value)
        return np.full(self._size, value) if np.ndim(value) == 0 else np.asarray(value)
