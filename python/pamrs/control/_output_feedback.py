"""What PID and fuzzy control share: the joint as measured, a unit of the angle, volts around the
closed valve.
"""

from __future__ import annotations

import abc
from collections.abc import Iterable
from typing import Any

from pamrs.control._parts import JointSensor
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed, SampledController
from pamrs.control._values import angle_factor, limits_around


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
        """As :meth:`update`, with ``bias`` [V] added before the limits: a feedforward beside it."""
