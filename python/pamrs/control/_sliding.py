"""Sliding-mode control (dissertation 5.3.1, (5.5)-(5.11) corrected; Slotine & Li, Applied Nonlinear
Control, 1991, ch. 7 and 9).

::

    s = theta' - theta_r'
    theta_r' = theta_d' - lambda (theta - theta_d)
    theta_r'' = theta_d'' - lambda (theta' - theta_d')
    P_d = (I theta_r'' + b theta_r' + m g r sin(theta) - C2)/C1 - KD sgn(s)

On the simplified plant (5.4) with the right parameters ``I s' = -b s - C1 KD sgn(s)``, so that
``s s' < 0`` outside the boundary layer.

Of several joints the torque is ``M(q) q_r'' + C(q, q') q_r' + B q_r' + g(q)``
(:meth:`pamrs.control.JointModel.inverse_dynamics`), and ``s' M s/2`` falls as ``I s^2/2`` does.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np

from pamrs.control._model import JointModel
from pamrs.control._parts import JointSensor
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed, SampledController
from pamrs.control._values import as_value, clip, positive_gain, sign


class Surface(NamedTuple):
    """State of a sample relative to the sliding surface."""

    angle: Value
    """Filtered angle [rad]."""
    motion: Value
    """Filtered rate [rad/s]."""
    rate: Value
    """Reference rate ``theta_r'`` [rad/s]."""
    acceleration: Value
    """Reference acceleration ``theta_r''`` [rad/s^2]."""
    s: Value
    """Distance ``theta' - theta_r'`` [rad/s]."""
    switching: Value
    """``KD sgn(s)`` [Pa], within the boundary layer ``KD s/width``."""


class SlidingController(SampledController):
    """Base of the sliding family: the surface, its switching term, and the limits of the pressure.

    Parameters
    ----------
    arm : JointModel
        The controller's model.
    slope : float or ndarray, shape (n,)
        ``lambda`` [1/s]. Of J joints this, the next two and the gains of a law may be one number
        for each joint, shape (J,), or (J n,) for a batch of n plants.
    switching : float or ndarray, shape (n,)
        ``KD`` [Pa].
    boundary_layer : float or ndarray, shape (n,)
        Width of the boundary layer, in s [rad/s]; 0: the plain signum.
    period : float
        Time between two updates [s].
    rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.PID`, but ``rate_filter`` is 0.01 s by default.
    """

    answers = "pressure"
    _PARTS: ClassVar[tuple[str, ...]] = ("sensor",)

    slope, switching, boundary_layer = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: JointModel,
        *,
        slope: Value = 5.0,
        switching: Value = 2e4,
        boundary_layer: Value = 0.2,
        period: float = 1e-3,
        gains: tuple[Any, ...] = (),
        rate_filter: Value = 0.01,
        angle_filter: Value = 0.0,
        measured_rate: bool = False,
    ) -> None:
        self.arm = arm
        self._slope = positive_gain("slope", slope)
        self._switching = as_value("switching", switching, lower=0.0)
        self._boundary_layer = as_value("boundary_layer", boundary_layer, lower=0.0)
        # a layer of a billionth of a rad/s is the signum, and needs no case of its own in a batch
        self._layer = clip(self._boundary_layer, 1e-12, 1e300)
        self._sharp = isinstance(self._boundary_layer, float) and self._boundary_layer == 0.0
        self.sensor = JointSensor(
            period, angle_filter=angle_filter, rate_filter=rate_filter, measured_rate=measured_rate
        )
        self._several = arm.joints > 1
        own = (self._slope, self._switching, self._boundary_layer, *gains)
        super().__init__(
            period,
            # one number for each joint says nothing about how many plants there are
            (*(g for g in own if not (self._several and np.size(g) == arm.joints)), *arm.gains)
            + self.sensor.gains,
        )

    def _rows(self, gain: Value, like: Value) -> Value:
        """A gain in the rows of a value: one for each joint is that of all its plants."""
        if not self._several or gain.__class__ is float or np.size(gain) == np.size(like):
            return gain
        return np.repeat(gain, np.size(like) // self.arm.joints)

    def _surface(self, time: float, measurement: Measurement, reference: Reference) -> Surface:
        """The sample, checked, and noted in the filters."""
        aim = self._aim(reference)
        angle, rate = self.sensor.read(self, measurement)
        self._tick(time)
        angle, rate = self.sensor.update(angle, rate)
        slope = self._rows(self._slope, angle)
        wanted = aim.rate - slope * (angle - aim.angle)
        acceleration = aim.acceleration - slope * (rate - aim.rate)
        s = rate - wanted
        side = sign(s) if self._sharp else clip(s / self._rows(self._layer, s), -1.0, 1.0)
        switching = self._rows(self._switching, s) * side
        return Surface(angle, rate, wanted, acceleration, s, switching)


class Sliding(SlidingController):
    """Sliding-mode control with fixed estimates; answers a desired gauge pressure [Pa] for a
    :class:`pamrs.control.Cascade`.

    The defaults are not printed; they were found on the simulated shoulder. A boundary layer keeps
    the valve from chattering at the rate of the samples; the dissertation calls its own runs free
    of chatter, which the plain signum is not.

    Parameters
    ----------
    arm : JointModel
        The controller's model, simplified as in (5.1)-(5.4) or full.
    **others
        As for :class:`SlidingController`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    def __init__(self, arm: JointModel, **others: Any) -> None:
        super().__init__(arm, **others)
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Desired gauge pressure [Pa] for a sample, within the arm's limits; see
        :meth:`pamrs.control.Controller.update`.
        """
        arm = self.arm
        angle, motion, rate, acceleration, _, switching = self._surface(
            time, measurement, reference
        )
        torque = arm.inverse_dynamics(angle, motion, rate, acceleration)
        low, high = arm.limits(angle)
        return clip(arm.pressure(torque, angle) - switching, low, high)
