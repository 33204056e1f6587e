"""Sliding-mode control (dissertation 5.3.1, (5.5)-(5.11) corrected; Slotine & Li, Applied Nonlinear
Control, 1991, ch. 7 and 9).

::

    s = theta' - theta_r'
    theta_r' = theta_d' - lambda (theta - theta_d)
    theta_r'' = theta_d'' - lambda (theta' - theta_d')
    P_d = (I theta_r'' + b theta_r' + m g r sin(theta) - C2)/C1 - KD sgn(s)

On the simplified plant (5.4) with the right parameters ``I s' = -b s - C1 KD sgn(s)``, so that
``s s' < 0`` outside the boundary layer.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from pamrs.control._joint_sensor import JointSensor
from pamrs.control._model import ArmModel
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed, SampledController
from pamrs.control._values import as_value, clip, positive_gain, sign, sin

__all__ = ["Sliding", "SlidingController", "Surface"]


class Surface(NamedTuple):
    """Where a sample stands relative to the sliding surface."""

    angle: Value
    """Filtered angle [rad]."""
    rate: Value
    """Reference rate ``theta_r'`` [rad/s]."""
    acceleration: Value
    """Reference acceleration ``theta_r''`` [rad/s^2]."""
    s: Value
    """Distance ``theta' - theta_r'`` [rad/s]."""
    switching: Value
    """``KD sgn(s)`` [Pa], within the boundary layer ``KD s/width``."""


class SlidingController(SampledController):
    """What the sliding family has in common: the surface, its switching term, and the limits of the
    pressure.

    Parameters
    ----------
    arm : ArmModel
        The controller's model.
    slope : float or ndarray, shape (n,)
        ``lambda`` [1/s].
    switching : float or ndarray, shape (n,)
        ``KD`` [Pa].
    boundary_layer : float or ndarray, shape (n,)
        Width of the boundary layer, in s [rad/s]; 0: the plain signum.
    period : float
        Time between two updates [s].
    rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.PID`.
    """

    answers = "pressure"
    _PARTS: ClassVar[tuple[str, ...]] = ("sensor",)

    slope, switching, boundary_layer = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: ArmModel,
        *,
        slope: Value = 5.0,
        switching: Value = 2e4,
        boundary_layer: Value = 0.2,
        period: float = 1e-3,
        rate_filter: Value = 0.01,
        angle_filter: Value = 0.0,
        measured_rate: bool = False,
        gains: tuple[Any, ...] = (),
    ) -> None:
        self.arm = arm
        self._slope, self._switching = (
            positive_gain("slope", slope),
            as_value("switching", switching, lower=0.0),
        )
        self._boundary_layer = as_value("boundary_layer", boundary_layer, lower=0.0)
        # a layer of a billionth of a rad/s is the signum, and needs no case of its own in a batch
        self._layer = clip(self._boundary_layer, 1e-12, 1e300)
        self._sharp = isinstance(self._boundary_layer, float) and self._boundary_layer == 0.0
        self.sensor = JointSensor(
            period, angle_filter=angle_filter, rate_filter=rate_filter, measured_rate=measured_rate
        )
        filters = (self.sensor.low_pass.time_constant, self.sensor.slope.time_constant)
        super().__init__(
            period,
            (self._slope, self._switching, self._boundary_layer, *arm.gains, *filters, *gains),
        )
        self._limit = arm.pressure_limit

    def _surface(self, time: float, measurement: Measurement, reference: Reference) -> Surface:
        """The sample, checked, and noted in the filters."""
        aim = self._aim(reference)
        angle, rate = self.sensor.read(self, measurement)
        self._tick(time)
        angle, rate = self.sensor.update(angle, rate)
        wanted = aim.rate - self._slope * (angle - aim.angle)
        acceleration = aim.acceleration - self._slope * (rate - aim.rate)
        s = rate - wanted
        side = sign(s) if self._sharp else clip(s / self._layer, -1.0, 1.0)
        return Surface(angle, wanted, acceleration, s, self._switching * side)


class Sliding(SlidingController):
    """Sliding-mode control with fixed estimates; answers a desired gauge pressure [Pa] for a
    :class:`pamrs.control.Cascade`.

    The defaults are not printed; they were found on the simulated shoulder. A boundary layer keeps
    the valve from chattering at the rate of the samples; the dissertation calls its own runs free
    of chatter, which the plain signum is not.

    Parameters
    ----------
    arm : ArmModel
        The controller's model, simplified as in (5.1)-(5.4) or full.
    **others
        As for :class:`SlidingController`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    def __init__(self, arm: ArmModel, **others: Any) -> None:
        super().__init__(arm, **others)
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Desired gauge pressure [Pa] for a sample, within 0 and the limit; see
        :meth:`pamrs.control.Controller.update`.
        """
        arm = self.arm
        angle, rate, acceleration, _, switching = self._surface(time, measurement, reference)
        torque = arm.inertia * acceleration + arm.viscous * rate + arm.weight * sin(angle)
        return clip(arm.pressure(torque, angle) - switching, 0.0, self._limit)
