"""Proportional-integral-derivative control (dissertation (4.9)): the law, and the controller of the
joint angle, with what it shares with fuzzy control.
"""

from __future__ import annotations

import abc
from collections.abc import Iterable
from typing import Any, ClassVar

from pamrs.control._parts import Integrator, JointSensor, LowPass
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed, SampledController, Stateful
from pamrs.control._values import angle_factor, as_value, clip, limits_around


class OutputFeedback(SampledController):
    """A controller of the joint angle by the valve, which a feedforward can be added to.

    Parameters
    ----------
    period : float
        Time between two updates [s].
    gains : iterable of float or ndarray
        Everything that may be an array, but for the sensor's.
    unit, limits, null, rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.PID`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    unit, limits, null = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        period: float,
        gains: Iterable[Any],
        *,
        unit: str,
        limits: tuple[float, float],
        null: float,
        rate_filter: Value,
        angle_filter: Value,
        measured_rate: bool,
    ) -> None:
        self._unit, self._scale = unit, angle_factor(unit)
        low, high, self._null = limits_around(limits, null)
        self._limits = low, high
        self.sensor = JointSensor(
            period, angle_filter=angle_filter, rate_filter=rate_filter, measured_rate=measured_rate
        )
        super().__init__(period, (*gains, *self.sensor.gains))

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Valve command [V] for a sample; see :meth:`pamrs.control.Controller.update`."""
        return self.answer(time, measurement, reference, 0.0)

    @abc.abstractmethod
    def answer(
        self, time: float, measurement: Measurement, reference: Reference, bias: Value
    ) -> Value:
        """Command of :meth:`update`, with ``bias`` [V], a feedforward, added before the limits."""


class PIDLaw(Stateful):
    """``u = offset + kP e + kI int e dt + kD e'``, limited, then low-passed.

    The integral counts from the next sample on, as if the error were held. The limits come before
    the low-pass, whose output then never leaves them, and the anti-windup looks at the limits
    alone.

    Parameters
    ----------
    kp, ki, kd : float or ndarray, shape (n,)
        Gains, per unit of error.
    period : float
        Time between two updates [s].
    limits : tuple of (float, float)
        Smallest and largest output.
    offset : float
        Output for no error.
    anti_windup, tracking_time
        As for :class:`pamrs.control.Integrator`.
    output_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the output [s]; 0: none.

    Raises
    ------
    ParameterError
        If a number is not finite or the limits do not have the offset between them.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("integrator", "low_pass")

    kp, ki, kd, output_filter, limits, offset = Fixed(), Fixed(), Fixed(), Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        kp: Value,
        ki: Value,
        kd: Value,
        *,
        period: float,
        limits: tuple[float, float],
        offset: float = 0.0,
        anti_windup: str = "clamping",
        tracking_time: Value = 0.5,
        output_filter: Value = 0.0,
    ) -> None:
        self._kp, self._ki, self._kd = as_value("kp", kp), as_value("ki", ki), as_value("kd", kd)
        low, high, self._offset = limits_around(limits, offset)
        self._limits = low, high
        self._low, self._high = low - self._offset, high - self._offset
        self._output_filter = as_value("output_filter", output_filter, lower=0.0)
        self._through = self._output_filter.__class__ is float and self._output_filter == 0.0
        self.low_pass = LowPass(self._output_filter, period, initial=0.0)
        self.integrator = Integrator(period, anti_windup=anti_windup, tracking_time=tracking_time)
        self.derives = bool(
            (self._kd != 0.0) if isinstance(self._kd, float) else (self._kd != 0.0).any()
        )

    @property
    def gains(self) -> tuple[Value, ...]:
        """Values that may be arrays of a batch."""
        return self._kp, self._ki, self._kd, self._output_filter, self.integrator._tracking

    def update(self, error: Value, error_rate: Value = 0.0, bias: Value = 0.0) -> Value:
        """Output for a sample.

        Parameters
        ----------
        error, error_rate : float or ndarray
            ``e`` and ``e'``.
        bias : float or ndarray
            Added to the output before its limits, past the low-pass: a feedforward.

        Returns
        -------
        float or ndarray
            Within the limits.
        """
        low, high = self._low, self._high
        integrator = self.integrator
        wanted = self._kp * error + integrator._integral + bias
        if self.derives:
            wanted = wanted + self._kd * error_rate
        limited = clip(wanted, low, high)
        integrator.update(self._ki * error, wanted - limited)
        if not self._through:
            limited = clip(self.low_pass.update(limited - bias) + bias, low, high)
        return limited + self._offset


class PID(OutputFeedback):
    """PID control of the joint angle by the valve (dissertation 4.3.1.1), volts around the closed
    valve.

    ``e = theta_d - theta``, ``e' = theta_d' - theta'``; a low-pass on the output as in 4.3.1.1. A
    gain may be an array: each plant of a batch then has its own.

    The printed gains are taken as volts per **radian**: 5 V open the valve wholly, which with
    degrees kP = 1.4 would do at an error of 3.6 deg and kI = 2.5 after a second at 2 deg, a switch
    rather than the slow, winding-up loop that 4.5 describes; and the fuzzy controller tuned on the
    same rig has the slope h/g1 = 0.65/0.45 = 1.44 V/rad, almost kP = 1.4, with g1 surely in
    radians.

    Parameters
    ----------
    kp, ki, kd : float or ndarray, shape (n,)
        Gains [V/unit, V/(unit s), V s/unit].
    period : float
        Time between two updates [s].
    unit : {"rad", "deg"}
        Unit of the angle in the gains.
    limits : tuple of (float, float)
        Smallest and largest output [V].
    null : float
        Output for no error: the valve is closed [V].
    anti_windup : {"clamping", "back_calculation", "none"}
        What keeps the integral bounded at a limit; the dissertation had none.
    tracking_time : float or ndarray, shape (n,)
        Of the back-calculation [s].
    output_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the output [s].
    rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.JointSensor`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.

    Examples
    --------
    >>> from pamrs.control import PID, Reference
    >>> controller = PID(2.0, 1.0, 0.0, output_filter=0.0)
    >>> controller.update(0.0, {"joint_angle": 0.3}, Reference(0.5))
    5.4
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("law", "sensor")

    kp, ki, kd = Fixed("law.kp"), Fixed("law.ki"), Fixed("law.kd")
    output_filter = Fixed("law.output_filter")

    def __init__(
        self,
        kp: Value,
        ki: Value = 0.0,
        kd: Value = 0.0,
        *,
        period: float = 1e-3,
        unit: str = "rad",
        limits: tuple[float, float] = (0.0, 10.0),
        null: float = 5.0,
        anti_windup: str = "clamping",
        tracking_time: Value = 0.5,
        output_filter: Value = 0.05,
        rate_filter: Value = 0.02,
        angle_filter: Value = 0.0,
        measured_rate: bool = False,
    ) -> None:
        self.law = PIDLaw(
            kp,
            ki,
            kd,
            period=period,
            limits=limits,
            offset=null,
            anti_windup=anti_windup,
            tracking_time=tracking_time,
            output_filter=output_filter,
        )
        super().__init__(
            period,
            self.law.gains,
            unit=unit,
            limits=limits,
            null=null,
            rate_filter=rate_filter,
            angle_filter=angle_filter,
            measured_rate=measured_rate,
        )
        self._simple = not self.law.derives and self.sensor._through
        self.reset()

    def answer(
        self, time: float, measurement: Measurement, reference: Reference, bias: Value
    ) -> Value:
        """Command of :meth:`update`, with ``bias`` [V], a feedforward, added before the limits, so
        that the anti-windup includes it.
        """
        aim = self._aim(reference)
        if bias.__class__ is not float:
            bias = self._sized("bias", bias)
        if self._simple:
            angle = self._read(measurement, "joint_angle")
            self._tick(time)
            return self.law.update(self._scale * (aim.angle - angle), 0.0, bias)
        angle, rate = self.sensor.read(self, measurement)
        self._tick(time)
        angle, rate = self.sensor.update(angle, rate)
        return self.law.update(
            self._scale * (aim.angle - angle), self._scale * (aim.rate - rate), bias
        )
