"""Model-based feedforward (dissertation 4.3.2, (4.11)-(4.14)), alone and together with an output
feedback.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from pamrs._checks import one_of
from pamrs.control._air import AirModel
from pamrs.control._model import ArmModel, JointModel
from pamrs.control._parts import JointSensor, LowPass
from pamrs.control._protocol import Controller, Measurement, Reference, Value, check_drives_valve
from pamrs.control._sampled import Fixed, Restorer, SampledController
from pamrs.control._torque import TorqueModel
from pamrs.control._values import as_value, clip, where
from pamrs.errors import ParameterError
from pamrs.rig import Rig


def _torque(arm: JointModel, aim: Reference, friction: bool) -> Value:
    """``tau_d`` [N m] of (4.11), with or without viscous friction."""
    wanted = aim.rate if friction else 0.0
    return arm.inverse_dynamics(aim.angle, aim.rate, wanted, aim.acceleration)


class FeedforwardPressure(SampledController):
    """The feedforward as far as the pressure: answers the drive [Pa] that the model wants for a
    reference, for a :class:`pamrs.control.Cascade` or a :class:`pamrs.control.RigController`.

    ``tau_d = M(q_d) q_d'' + C(q_d, q_d') q_d' + g(q_d)``, of one joint ``I theta_d'' + m g r
    sin(theta_d)``, and the drive that gives it at ``q_d`` (4.11), (4.12). Nothing is measured.

    Parameters
    ----------
    arm : JointModel
        The controller's model.
    period : float
        Time between two updates [s].
    friction : bool
        Whether viscous friction at the commanded rate is added.

    Raises
    ------
    ParameterError
        If the period is not above zero.
    """

    answers = "pressure"
    motion = "commanded"

    def __init__(self, arm: JointModel, *, period: float = 1e-3, friction: bool = False) -> None:
        self.arm, self._friction = arm, bool(friction)
        super().__init__(period, arm.gains)
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Drive [Pa] for a sample, within the arm's limits; see
        :meth:`pamrs.control.Controller.update`.
        """
        aim = self._aim(reference)
        if "joint_angle" in measurement:
            self._read(measurement, "joint_angle")  # a batch of another length is refused
        self._tick(time)
        angle = aim.angle
        if self._batch is not None and angle.__class__ is float:
            angle = np.full(self._batch, angle)
        low, high = self.arm.limits(angle)
        torque = _torque(self.arm, aim._replace(angle=angle), self._friction)
        return clip(self.arm.pressure(torque, angle), low, high)


class Feedforward(SampledController):
    """Inverse dynamics, inverse muscle force, pressure-rate law and inverse orifice.

    ``tau_d = I theta_d'' + m g r sin(theta_d)``, ``P_d`` that gives it at ``theta_d``,
    ``P_d' = kM (P_d - P)``, and the valve command that :meth:`pamrs.control.AirModel.command` finds
    with the measured pressures and the volume and its rate where the joint is to be, or where it
    is.

    Parameters
    ----------
    arm : ArmModel
        The controller's model of the arm.
    air : AirModel
        Its model of valve and chamber.
    km : float or ndarray, shape (n,)
        ``kM`` [1/s]: 0.5 was best in the dissertation, 1.0 simulated; with 0 the feedforward is
        off, and the valve closed (5 V).
    period : float
        Time between two updates [s].
    friction : bool
        Whether ``b theta_d'`` is added to ``tau_d``; as printed it is not.
    motion : {"commanded", "measured"}
        Angle and rate of which ``V`` and ``V'`` in (4.13) are: of the commanded trajectory, as the
        dissertation has it (the pressure is its only measurement, 4.3.2.1), or of the joint.
    lengthening : TorqueModel, optional
        Torque of the muscles while they lengthen, taken for ``P_d`` where the commanded rate is
        below zero: (4.7) instead of (4.4). By default the arm's own torque, both ways.
    pressure_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the pressure [s].
    rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.JointSensor`, with the measured motion only.

    Notes
    -----
    With the commanded motion no angle is needed; one that is there is checked all the same. The
    supply's pressure is that of the channel ``supply_pressure`` where there is one, else the
    rig's initial one. With ``km = 0`` the whole feedforward is switched off, also what would hold
    the pressure while the volume changes, as in the dissertation's series (kM = 0 is pure feedback
    there).

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("sensor", "low_pass")

    km, limits, null = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: ArmModel,
        air: AirModel,
        km: Value = 0.5,
        *,
        period: float = 1e-3,
        friction: bool = False,
        motion: str = "commanded",
        lengthening: TorqueModel | None = None,
        pressure_filter: Value = 0.0,
        rate_filter: Value = 0.02,
        angle_filter: Value = 0.0,
        measured_rate: bool = False,
    ) -> None:
        one_of("motion", motion, ("commanded", "measured"))
        self.arm, self.air, self.motion, self.lengthening = arm, air, motion, lengthening
        self._km = as_value("km", km, lower=0.0)
        self._on: Value = (
            (1.0 if self._km > 0.0 else 0.0)
            if isinstance(self._km, float)
            else (self._km > 0.0).astype(float)
        )
        self._friction = bool(friction)
        self.sensor = JointSensor(
            period, angle_filter=angle_filter, rate_filter=rate_filter, measured_rate=measured_rate
        )
        self.low_pass = LowPass(pressure_filter, period)
        filters = self.low_pass.time_constant, *self.sensor.gains
        super().__init__(period, (self._km, *arm.gains, *filters))
        self._limits, self._null = (air.null - air.half_range, air.null + air.half_range), air.null
        self.reset()

    @classmethod
    def from_rig(cls, rig: Rig, km: Value = 0.5, **others: object) -> Feedforward:
        """Make a feedforward with the full model of a rig.

        Parameters
        ----------
        rig : Rig
            The nominal rig, with the payload that the controller assumes.
        km : float or ndarray, shape (n,)
            [1/s].
        **others
            The other arguments.

        Returns
        -------
        Feedforward
        """
        return cls(ArmModel.from_rig(rig), AirModel(rig), km, **others)  # type: ignore[arg-type]

    def desired_pressure(self, reference: Reference) -> Value:
        """Gauge pressure that the model wants for a reference [Pa], from 0 to the limit."""
        arm = self.arm
        torque = _torque(arm, reference, self._friction)
        pressure = arm.pressure(torque, reference.angle)
        if self.lengthening is not None:
            c1, c2 = self.lengthening.at(reference.angle)
            pressure = where(reference.rate < 0.0, (torque - c2) / c1, pressure)
        return clip(pressure, 0.0, arm.pressure_limit)

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Valve command [V] for a sample; see :meth:`pamrs.control.Controller.update`."""
        return clip(
            self._null + self.offset(time, measurement, reference), self._limits[0], self._limits[1]
        )

    def offset(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Command of :meth:`update` less the valve's null [V]."""
        aim = self._aim(reference)
        pressure = self._read(measurement, "muscle_pressure")
        supply = (
            self._read(measurement, "supply_pressure")
            if "supply_pressure" in measurement
            else self.air.supply_pressure
        )
        if self.motion == "commanded":
            if "joint_angle" in measurement:
                self._read(measurement, "joint_angle")  # a batch of another length is refused
            self._tick(time)
            angle, rate = aim.angle, aim.rate
        else:
            angle, measured = self.sensor.read(self, measurement)
            self._tick(time)
            angle, rate = self.sensor.update(angle, measured)
        pressure = self.low_pass.update(pressure)
        change = self._km * (self.desired_pressure(aim) - pressure)
        return self._on * self.air.command(change, pressure, supply, angle, rate)


class Parallel(SampledController):
    """A feedforward and an output feedback side by side, outputs summed (Fig. 4.4 b).

    Parameters
    ----------
    feedforward : Feedforward
        The model's part.
    feedback : Controller
        PID, fuzzy or another that answers valve volts. One with ``answer`` (as these have) is given
        the feedforward before its limits, so that its anti-windup knows when the sum is at a limit.

    Raises
    ------
    ParameterError
        If the two have not the same period, or the feedback answers a pressure.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("feedforward", "feedback")

    def __init__(self, feedforward: Feedforward, feedback: Controller) -> None:
        check_drives_valve(feedback)
        if feedforward.period != feedback.period:
            raise ParameterError(
                f"feedback.period = {feedback.period} s is not the feedforward's "
                f"{feedforward.period} s"
            )
        self.feedforward, self.feedback = feedforward, feedback
        super().__init__(feedforward.period, parts=(feedforward, feedback))
        self._answer = getattr(feedback, "answer", None) is not None
        self._before = Restorer(feedforward)
        self.null, self._limits = feedforward.null, feedforward.limits
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Valve command [V] for a sample; see :meth:`pamrs.control.Controller.update`."""
        before = self._before.take()
        offset = self.feedforward.offset(time, measurement, reference)
        try:
            if self._answer:
                command: Value = self.feedback.answer(time, measurement, reference, offset)  # type: ignore[attr-defined]
            else:
                command = self.feedback.update(time, measurement, reference) + offset
        except ParameterError:
            self._before.put_back(before)
            raise
        return clip(command, self._limits[0], self._limits[1])
