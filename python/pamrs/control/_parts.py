"""Parts of controllers: low-pass, filtered derivative, integral with anti-windup, and the joint as
it is measured.

All are sampled with a period, exact for what they say they hold between samples, and have an
explicit state.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from pamrs._checks import one_of
from pamrs.control._protocol import Measurement, Value
from pamrs.control._sampled import SampledController, Stateful
from pamrs.control._values import as_value, positive_number

ANTI_WINDUP: Final = ("clamping", "back_calculation", "none")
"""Ways to keep an integral from growing while the output is at a limit; ``none`` as in the
dissertation."""


def _pole(time_constant: Value, period: float) -> Value:
    """``exp(-T/tau)``, 0 where the time constant is 0."""
    array = np.asarray(time_constant)
    safe = np.where(array > 0.0, array, 1.0)
    pole = np.where(array > 0.0, np.exp(-period / safe), 0.0)
    return float(pole) if pole.ndim == 0 else pole


class LowPass(Stateful):
    """First-order low-pass ``tau y' = x - y``, exact for an input that is held from sample to
    sample.

    ``update(x)`` answers what the continuous filter gives at the end of the period over which ``x``
    is held: ``y += (1 - a)(x - y)``, ``a = exp(-T/tau)``. A unit step from the first sample on
    gives ``1 - exp(-(k + 1) T/tau)``.

    Parameters
    ----------
    time_constant : float or ndarray, shape (n,)
        ``tau`` [s]; 0 passes everything.
    period : float
        ``T`` [s].
    initial : float, optional
        Output before the first sample; by default the first input, so that it begins without a
        transient.

    Raises
    ------
    ParameterError
        If the time constant is negative, the period not above zero, or a number not finite.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"output": None}

    def __init__(
        self, time_constant: Value, period: float, *, initial: float | None = None
    ) -> None:
        self.time_constant = as_value("time_constant", time_constant, lower=0.0)
        pole = _pole(self.time_constant, positive_number("period", period))
        self._share = 1.0 - pole
        # last + 1 (value - last) is not always the value in floating point
        self._passes = bool(np.any(np.asarray(self._share) == 1.0))
        self._initial = None if initial is None else as_value("initial", initial)
        self.reset()

    def _start(self) -> dict[str, Any]:
        return {"output": self._initial}

    def update(self, value: Value) -> Value:
        """Output at the end of the period over which ``value`` is held."""
        last: Value | None = self._output
        if last is None:
            self._output: Value | None = value
            return value
        output = last + self._share * (value - last)
        if self._passes:
            output = (
                value
                if self._share.__class__ is float
                else np.where(self._share == 1.0, value, output)
            )
        self._output = output
        return output


class FilteredDerivative(Stateful):
    """Low-passed derivative ``tau y' = x' - y``, exact for an input that is linear from sample to
    sample.

    ``y_k = a y_(k-1) + (1 - a)(x_k - x_(k-1))/T``: a ramp gives its slope without a bias, which the
    form for a held input does not. The first sample gives 0.

    Parameters
    ----------
    time_constant : float or ndarray, shape (n,)
        ``tau`` [s]; 0 gives the difference quotient.
    period : float
        ``T`` [s].

    Raises
    ------
    ParameterError
        As :class:`LowPass`.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"input": None, "output": 0.0}

    def __init__(self, time_constant: Value, period: float) -> None:
        self.time_constant = as_value("time_constant", time_constant, lower=0.0)
        length = positive_number("period", period)
        self._pole = _pole(self.time_constant, length)
        self._slope = (1.0 - self._pole) / length
        self.reset()

    def update(self, value: Value) -> Value:
        """Rate of change at this sample [unit of the value per second]."""
        last: Value | None = self._input
        self._input: Value | None = value
        if last is not None:
            self._output: Value = self._pole * self._output + self._slope * (value - last)
        return self._output


class Integrator(Stateful):
    """Integral of a rate that is held from sample to sample, with anti-windup.

    Parameters
    ----------
    period : float
        ``T`` [s].
    anti_windup : {"clamping", "back_calculation", "none"}
        ``clamping`` holds the integral while the output is beyond a limit and the rate points
        outwards; ``back_calculation`` takes ``excess/tracking_time`` off the rate; ``none``
        integrates on.
    tracking_time : float or ndarray, shape (n,)
        Time constant of the back-calculation [s].

    Raises
    ------
    ParameterError
        If there is no such anti-windup, or a time is not above zero.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"integral": 0.0}

    def __init__(
        self, period: float, *, anti_windup: str = "clamping", tracking_time: Value = 0.5
    ) -> None:
        one_of("anti_windup", anti_windup, ANTI_WINDUP)
        self._period = positive_number("period", period)
        self._mode = ANTI_WINDUP.index(anti_windup)
        # from one sample to the next not more than the whole excess is taken off
        self._tracking = as_value("tracking_time", tracking_time, lower=self._period)
        self.reset()

    @property
    def value(self) -> Value:
        """The integral at the present sample."""
        return self._integral

    def update(self, rate: Value, excess: Value) -> None:
        """Go on to the next sample.

        Parameters
        ----------
        rate : float or ndarray
            What is integrated, per second.
        excess : float or ndarray
            By how much the output is beyond its limit, with its sign; 0 inside.
        """
        if self._mode == 0:
            if rate.__class__ is float and excess.__class__ is float:
                if rate * excess > 0.0:
                    return
            else:
                rate = np.where(rate * excess > 0.0, 0.0, rate)
        elif self._mode == 1:
            rate = rate - excess / self._tracking
        self._integral: Value = self._integral + rate * self._period


class JointSensor(Stateful):
    """Angle and rate of the joint.

    Parameters
    ----------
    period : float
        Time between two samples [s].
    angle_filter : float or ndarray, shape (n,)
        Time constant of the angle's low-pass [s]; 0: none.
    rate_filter : float or ndarray, shape (n,)
        Time constant of the rate's low-pass [s].
    measured_rate : bool
        Whether ``joint_rate`` is read; by default the rate is the filtered derivative of the angle,
        since the rigs of the dissertation measure angle and pressure only.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("low_pass", "slope")

    def __init__(
        self,
        period: float,
        *,
        angle_filter: Value = 0.0,
        rate_filter: Value = 0.02,
        measured_rate: bool = False,
    ) -> None:
        self.measured_rate = bool(measured_rate)
        self.low_pass = LowPass(angle_filter, period)
        self.slope: LowPass | FilteredDerivative = (
            LowPass(rate_filter, period)
            if measured_rate
            else FilteredDerivative(rate_filter, period)
        )
        self._through = angle_filter.__class__ is float and angle_filter == 0.0

    @property
    def gains(self) -> tuple[Value, ...]:
        """Values that may be arrays of a batch: the time constants [s]."""
        return self.low_pass.time_constant, self.slope.time_constant

    def read(
        self, owner: SampledController, measurement: Measurement
    ) -> tuple[Value, Value | None]:
        """Angle [rad] and, where it is measured, rate [rad/s] of a sample, checked; changes
        nothing.
        """
        angle = owner._read(measurement, "joint_angle")
        return angle, owner._read(measurement, "joint_rate") if self.measured_rate else None

    def update(self, angle: Value, rate: Value | None) -> tuple[Value, Value]:
        """Filtered angle [rad] and rate [rad/s] of what :meth:`read` gave."""
        slope = self.slope.update(angle if rate is None else rate)
        return (angle if self._through else self.low_pass.update(angle)), slope
