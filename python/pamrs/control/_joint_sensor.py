"""The joint as a controller sees it: angle and rate, low-passed, the rate measured or taken from
the angle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from pamrs.control._parts import FilteredDerivative, LowPass
from pamrs.control._protocol import Measurement, Value
from pamrs.control._sampled import Stateful

if TYPE_CHECKING:
    from pamrs.control._sampled import SampledController


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
        self.slope: LowPass | FilteredDerivative
        self.slope = (
            LowPass(rate_filter, period)
            if measured_rate
            else FilteredDerivative(rate_filter, period)
        )
        self._through = angle_filter.__class__ is float and angle_filter == 0.0

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
