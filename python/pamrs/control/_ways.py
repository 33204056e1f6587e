"""The way of the air of one chamber, from a wanted pressure to a valve's or regulator's command."""

from __future__ import annotations

from typing import ClassVar, Protocol

from pamrs.control._air import AirModel
from pamrs.control._parts import FilteredDerivative, LowPass
from pamrs.control._protocol import Measurement, Value
from pamrs.control._sampled import Stateful
from pamrs.control._values import as_value, clip, positive_gain


class AirWay(Protocol):
    """From a wanted pressure to a command; a part of a controller, with a state."""

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Command for a desired gauge pressure [Pa]."""


class FlowInverse(Stateful):
    """The feedforward's way of the air: ``P_d' = kM (P_d - P)``, and the valve command that makes
    it by the volume and its rate (4.13), (4.14).

    Parameters
    ----------
    air : AirModel
        Of the chamber.
    km : float or ndarray, shape (n,)
        ``kM`` [1/s].
    period : float
        Time between two updates [s].
    pressure_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the pressure [s].
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("low_pass",)

    def __init__(
        self, air: AirModel, km: Value, *, period: float, pressure_filter: Value = 0.0
    ) -> None:
        self.air, self.km = air, as_value("km", km, lower=0.0)
        self.low_pass = LowPass(pressure_filter, period)

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Valve command [V] for a desired gauge pressure [Pa]."""
        pressure = self.low_pass.update(measurement["muscle_pressure"])
        offset = self.air.command(
            self.km * (desired - pressure),
            pressure,
            measurement["supply_pressure"],
            measurement["joint_angle"],
            measurement["joint_rate"],
        )
        return self.air.null + offset


class SetPoint(Stateful):
    """What a regulator is set to: the desired pressure, ahead of it by its rate times a time.

    Parameters
    ----------
    pressure_limit : float
        Largest set pressure [Pa].
    period : float
        Time between two updates [s].
    lead : float or ndarray, shape (n,)
        How far ahead [s]; the regulator's time constant makes up for its lag, 0 for nothing.
    rate_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the rate [s].
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("slope",)

    def __init__(
        self, pressure_limit: float, *, period: float, lead: Value = 0.0, rate_filter: Value = 0.02
    ) -> None:
        self.pressure_limit = float(positive_gain("pressure_limit", pressure_limit))
        self.lead = as_value("lead", lead, lower=0.0)
        self.slope = FilteredDerivative(rate_filter, period)

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Set pressure [Pa, gauge] for a desired one."""
        return clip(desired + self.lead * self.slope.update(desired), 0.0, self.pressure_limit)
