"""Cascade control: the outer loop asks for a pressure, an inner PI loop makes it with the valve
(dissertation 5.3, Fig. 5.3; ch. 6).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from pamrs.control._parts import LowPass
from pamrs.control._pid import PID, PIDLaw
from pamrs.control._protocol import (
    Controller,
    Measurement,
    Reference,
    Value,
    check_answers_pressure,
)
from pamrs.control._sampled import Fixed, Restorer, SampledController
from pamrs.errors import ParameterError

#: Not printed: found on the simulated shoulder, see :func:`cascaded_pid`.
_ANGLE_GAINS: Final[Mapping[str, float]] = {"kp": 6e5, "ki": 1.2e6, "kd": 1e5}


class PressureLoop(SampledController):
    """PI control of the muscle's pressure by the valve, desired and measured pressure low-passed
    (5.3.1).

    As a controller of its own it takes ``reference.angle`` as the desired gauge pressure [Pa]; in a
    :class:`Cascade` the outer loop gives it.

    Parameters
    ----------
    kp, ki : float or ndarray, shape (n,)
        Gains [V/Pa, V/(Pa s)]; not printed. With the shoulder's valve (some 0.55 MPa/s per volt
        near its null) the default crosses over at about 100 rad/s; a quarter of it made the
        adaptive laws oscillate.
    period : float
        Time between two updates [s].
    limits, null, anti_windup, tracking_time
        As for :class:`pamrs.control.PID`.
    pressure_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on either pressure [s].

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("law", "desired_filter", "pressure_filter")

    kp, ki = Fixed("law.kp"), Fixed("law.ki")
    limits, null = Fixed("law.limits"), Fixed("law.offset")

    def __init__(
        self,
        kp: Value = 2e-4,
        ki: Value = 2e-4,
        *,
        period: float = 1e-3,
        limits: tuple[float, float] = (0.0, 10.0),
        null: float = 5.0,
        anti_windup: str = "clamping",
        tracking_time: Value = 0.5,
        pressure_filter: Value = 0.005,
    ) -> None:
        self.law = PIDLaw(
            kp,
            ki,
            0.0,
            period=period,
            limits=limits,
            offset=null,
            anti_windup=anti_windup,
            tracking_time=tracking_time,
        )
        self.desired_filter = LowPass(pressure_filter, period)
        self.pressure_filter = LowPass(pressure_filter, period)
        super().__init__(period, (*self.law.gains, self.pressure_filter.time_constant))
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Valve command [V] for a desired gauge pressure ``reference.angle`` [Pa]."""
        return self.track(time, measurement, self._aim(reference).angle)

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Valve command [V] for a desired gauge pressure [Pa]."""
        if desired.__class__ is not float:
            desired = self._sized("desired pressure", desired)
        pressure = self._read(measurement, "muscle_pressure")
        self._tick(time)
        return self.law.update(
            self.desired_filter.update(desired) - self.pressure_filter.update(pressure)
        )


class Cascade(SampledController):
    """An outer controller that answers a desired pressure [Pa], and the loop that makes it.

    Parameters
    ----------
    outer : Controller
        Sliding, adaptive, neural, one of your own with ``answers = "pressure"``; a PID of the angle
        is in :func:`cascaded_pid`.
    inner : PressureLoop, optional
        By default one with the gains and the period that it has by itself.

    Attributes
    ----------
    desired : float or ndarray or None
        Pressure that the outer controller asked for at the last sample [Pa], for records.

    Raises
    ------
    ParameterError
        If the outer controller answers valve volts, or the two have not the same period.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("outer", "inner")
    _STATE: ClassVar[Mapping[str, Any]] = {"asked": None}

    def __init__(self, outer: Controller, inner: PressureLoop | None = None) -> None:
        check_answers_pressure(outer)
        self.outer = outer
        self.inner = PressureLoop(period=outer.period) if inner is None else inner
        if self.inner.period != outer.period:
            raise ParameterError(
                f"inner.period = {self.inner.period} s is not the outer's {outer.period} s"
            )
        super().__init__(outer.period, parts=(outer, self.inner))
        self._before = Restorer(outer)
        self.reset()

    @property
    def desired(self) -> Value | None:
        """Pressure that was asked for last [Pa]."""
        return self._asked

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Valve command [V] for a sample; see :meth:`pamrs.control.Controller.update`."""
        before = self._before.take()
        asked = self.outer.update(time, measurement, reference)
        try:
            command = self.inner.track(time, measurement, asked)
        except ParameterError:
            self._before.put_back(before)
            raise
        self._asked: Value | None = asked
        self._batch = None if asked.__class__ is float else np.size(asked)
        return command


def cascaded_pid(
    pressure_limit: float,
    *,
    kp: Value = _ANGLE_GAINS["kp"],
    ki: Value = _ANGLE_GAINS["ki"],
    kd: Value = _ANGLE_GAINS["kd"],
    period: float = 1e-3,
    inner: PressureLoop | None = None,
    **others: Any,
) -> Cascade:
    """Cascaded PID (Fig. 5.18), with ``kd = 0`` the cascaded PI of ch. 6: angle PID gives P_d,
    pressure PI the volts.

    Parameters
    ----------
    pressure_limit : float
        Largest gauge pressure that is asked for [Pa].
    kp, ki, kd : float or ndarray, shape (n,)
        Gains of the angle [Pa/rad, Pa/(rad s), Pa s/rad]; none are printed: the defaults follow on
        the simulated shoulder.
    period : float
        Time between two updates [s].
    inner : PressureLoop, optional
        The inner loop.
    **others
        Further arguments of :class:`pamrs.control.PID`.

    Returns
    -------
    Cascade

    Raises
    ------
    ParameterError
        As :class:`pamrs.control.PID` and :class:`Cascade`.
    """
    outer = PID(
        kp,
        ki,
        kd,
        period=period,
        **{"output_filter": 0.0, "limits": (0.0, pressure_limit), "null": 0.0, **others},
    )
    outer.answers = "pressure"
    return Cascade(outer, PressureLoop(period=period) if inner is None else inner)
