"""Adaptive sliding-mode control (dissertation 5.3.2, (5.12)-(5.15) corrected; Slotine & Li, Applied
Nonlinear Control, 1991, ch. 9).

::

    P_d = (Y a - C2)/C1 - KD sgn(s)
    Y = [theta_r'', theta_r', sin(theta)]
    a = [I, b, m g r]
    a' = -Gamma Y^T s_D                    s_D = s where |s| > deadband, else 0

With the simplified plant ``V = I s^2/2 + (a - a*)^T Gamma^-1 (a - a*)/2`` has
``V' = -b s^2 - C1 KD |s|`` outside the deadband and does not grow; the projection onto the bounds
does not change that as long as they hold the true values.

Of several joints ``Y`` has a column for each parameter of the arm
(:meth:`pamrs.control.JointModel.regressor`), and ``Y^T s_D`` is a sum over the joints.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from pamrs._checks import one_of, refused
from pamrs.control._model import JointModel
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed
from pamrs.control._sliding import SlidingController
from pamrs.control._values import as_value, clip, gains_of
from pamrs.errors import ParameterError

_NAMES: Final = ("inertia", "viscous", "weight")


def dead(s: Value, deadband: Value) -> Value:
    """``s`` where it is beyond a deadband on either side, else 0 (5.15)."""
    if s.__class__ is float and deadband.__class__ is float:
        return s if s > deadband or s < -deadband else 0.0
    return np.where(np.abs(s) > deadband, s, 0.0)


class AdaptiveSliding(SlidingController):
    """Adaptive sliding-mode control; answers a desired gauge pressure [Pa] for a
    :class:`pamrs.control.Cascade`.

    Adaptation stands still while the pressure asked for is beyond a limit and would be carried
    farther beyond: an arm that lies on its stop cannot follow, and teaches nothing. It may be
    switched off.

    Parameters
    ----------
    arm : JointModel
        Torque model, and the estimates to start with.
    gains : sequence of three float or ndarray, shape (n,)
        Diagonal of Gamma for I, b and m g r, SI with radians [kg m2, N m s/rad, N m, each per rad/s
        of s, its factor in Y, and second]; of several joints one for all inertias, frictions and
        weights.
    deadband : float or ndarray, shape (n,)
        Of s [rad/s]; 0.02 as printed.
    bounds : sequence of three pairs, or None
        Projection of the estimates; by default from 0 to ten times the start, or to the arm's own
        scale where that is 0. None: free, as in the dissertation, whose estimates drift.
    hold_at_limit : bool
        Whether adaptation stands still at a limit of the pressure.
    **others
        As for :class:`pamrs.control.SlidingController`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed, or a start is outside its bounds; the message
        names it.
    """

    #: Of one joint; of several, the parameters of the arm.
    _STATE: ClassVar[Mapping[str, Any]] = {"inertia": 0.0, "viscous": 0.0, "weight": 0.0}

    gains, deadband, bounds = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: JointModel,
        gains: Sequence[Value] = (1.0, 5.0, 300.0),
        *,
        deadband: Value = 0.02,
        bounds: Sequence[tuple[float, float]] | str | None = "default",
        hold_at_limit: bool = True,
        **others: Any,
    ) -> None:
        self._gains = gains_of(_NAMES, gains)
        self._deadband = as_value("deadband", deadband, lower=0.0)
        self.hold_at_limit = bool(hold_at_limit)
        self._parameters = arm.parameters
        self._names = tuple(f"_{parameter.name}" for parameter in self._parameters)
        self._getter = operator.attrgetter(*self._names)
        self._others = range(1, len(self._names))
        self._STATE = {p.name: p.value for p in self._parameters}  # type: ignore[misc]
        self._bounds = _bounds(arm, bounds)
        super().__init__(arm, gains=(*self._gains, self._deadband), **others)
        self._rates = tuple(self._gains[p.kind] * self.period for p in self._parameters)
        self.reset()

    @property
    def estimates(self) -> dict[str, Value]:
        """Present estimates of I [kg m2], b [N m s/rad] and m g r [N m], ``inertia``, ``viscous``
        and ``weight``; of several joints those of :attr:`pamrs.control.JointModel.parameters`.
        """
        joints, found = self.arm.joints, {}
        for parameter, name in zip(self._parameters, self._names, strict=True):
            value = getattr(self, name)
            rows = joints if isinstance(value, np.ndarray) else 1
            found[parameter.name] = value if rows == 1 else value[: value.size // rows]
        return found

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Desired gauge pressure [Pa] for a sample, within the arm's limits; see
        :meth:`pamrs.control.Controller.update`.
        """
        arm = self.arm
        angle, motion, rate, acceleration, s, switching = self._surface(
            time, measurement, reference
        )
        columns = arm.regressor(angle, motion, rate, acceleration)
        estimates = self._getter(self)
        torque = estimates[0] * columns[0]
        for k in self._others:
            torque = torque + estimates[k] * columns[k]
        torque = torque + arm.springs(angle)
        wanted = arm.pressure(torque, angle) - switching
        low, high = arm.limits(angle)
        pressure = clip(wanted, low, high)
        error = dead(s, self._rows(self._deadband, s))
        if self.hold_at_limit:
            error = held(error, wanted - pressure)
        if error.__class__ is not float or error != 0.0:
            self._adapt(estimates, columns, error)
        return pressure

    def _adapt(
        self, estimates: tuple[Value, ...], columns: tuple[Value, ...], error: Value
    ) -> None:
        """``a' = -Gamma Y^T s_D``, kept within the bounds."""
        bounds = self._bounds
        for k, name in enumerate(self._names):
            if self._several:
                rate = self._rows(self._rates[k], error)
                value = estimates[k] - self.arm.over_joints(rate * columns[k] * error)
            else:
                value = estimates[k] - self._rates[k] * columns[k] * error
            if bounds is not None:
                low, high = bounds[k]
                value = clip(value, low, high)
            setattr(self, name, value)


def held(error: Value, excess: Value) -> Value:
    """Error by which to adapt, 0 where it would carry a pressure farther beyond its limit."""
    # every adaptation moves the pressure against the sign of s
    if error.__class__ is float and excess.__class__ is float:
        return 0.0 if error * excess < 0.0 else error
    return np.where(error * excess < 0.0, 0.0, error)


def _bounds(
    arm: JointModel, bounds: Sequence[tuple[float, float]] | str | None
) -> tuple[tuple[float, float], ...] | None:
    """Checked bounds of every estimate."""
    if bounds is None:
        return None
    parameters = arm.parameters
    if isinstance(bounds, str):
        one_of("bounds", bounds, ("default", None), also=", or three pairs")
        # an arm of which nothing is known: what its muscles could move at all
        lowest, highest = arm.angle_range
        places = np.linspace(lowest, highest, 33)  # of each joint, along the first axis
        c1 = arm.torque.at(places.T.ravel())[0]
        torque = float(np.max(c1)) * arm.pressure_limit
        scale = (torque / 10.0, torque / 10.0, torque)
        tops = [10.0 * float(np.max(p.value)) for p in parameters]
        pairs = [
            (0.0, top if top > 0.0 else scale[p.kind])
            for top, p in zip(tops, parameters, strict=True)
        ]
    else:
        if len(bounds) != 3:
            raise ParameterError(
                f"bounds has {len(bounds)} entries: three pairs are needed, for I, b and m g r"
            )
        pairs = [bounds[parameter.kind] for parameter in parameters]
    checked = []
    for parameter, pair in zip(parameters, pairs, strict=True):
        low, high, start = float(pair[0]), float(pair[1]), np.asarray(parameter.value)
        if not (low < high and np.all(start >= low) and np.all(start <= high)):
            needed = f"rising, with the start {start.tolist()} within"
            raise refused(f"bounds[{parameter.name}]", (low, high), needed)
        checked.append((low, high))
    return tuple(checked)
