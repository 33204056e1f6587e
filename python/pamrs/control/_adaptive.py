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
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from pamrs.control._model import ArmModel
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed
from pamrs.control._sliding import SlidingController
from pamrs.control._values import as_value, clip, sin
from pamrs.errors import ParameterError

__all__ = ["AdaptiveSliding", "dead"]

_NAMES: Final = ("inertia", "viscous", "weight")

#: Table 5.2, by trial: gains of I, b, m g r.
_PUBLISHED: Final[Mapping[int, tuple[float, float, float]]] = {
    1: (10.0, 10.0, 0.01),
    2: (100.0, 100.0, 0.001),
    3: (100.0, 100.0, 0.0001),
}


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
    arm : ArmModel
        Torque model, and the estimates to start with.
    gains : sequence of three float or ndarray, shape (n,)
        Diagonal of Gamma for I, b and m g r, SI with radians [kg m2, N m s/rad, N m, each per rad/s
        of s, its factor in Y, and second].
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

    _STATE: ClassVar[Mapping[str, Any]] = {"inertia": 0.0, "viscous": 0.0, "weight": 0.0}

    gains, deadband, bounds = Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: ArmModel,
        gains: Sequence[Value] = (1.0, 5.0, 300.0),
        *,
        deadband: Value = 0.02,
        bounds: Sequence[tuple[float, float]] | str | None = "default",
        hold_at_limit: bool = True,
        **others: Any,
    ) -> None:
        if len(gains) != 3:
            raise ParameterError(
                f"gains has {len(gains)} entries: three are needed, for I, b and m g r"
            )
        pairs = zip(_NAMES, gains, strict=True)
        self._gains: tuple[Value, ...] = tuple(
            as_value(f"gains[{name}]", value, lower=0.0) for name, value in pairs
        )
        self._deadband = as_value("deadband", deadband, lower=0.0)
        self.hold_at_limit = bool(hold_at_limit)
        self._bounds = _bounds(arm, bounds)
        super().__init__(arm, gains=(*self._gains, self._deadband), **others)
        self._rates = tuple(gain * self.period for gain in self._gains)
        self.reset()

    @classmethod
    def published(cls, arm: ArmModel, trial: int, **others: Any) -> AdaptiveSliding:
        """With the gains of Table 5.2, deadband 0.02 and without projection, as printed.

        The unit of the printed gains is not stated. Taken as SI with radians the estimates of I and
        b move as far as Fig. 5.10 shows (to about 1000 and 200 in 100 s), that of m g r hardly: its
        unit there is another, since a payload of 50 lb weighs 200 N m.

        Parameters
        ----------
        arm : ArmModel
            As for the class.
        trial : {1, 2, 3}
            Row of the table.
        **others
            The other arguments.

        Returns
        -------
        AdaptiveSliding

        Raises
        ------
        ParameterError
            If there is no such trial.
        """
        if trial not in _PUBLISHED:
            raise ParameterError(f"trial = {trial!r} is not allowed: 1, 2 or 3")
        return cls(arm, _PUBLISHED[trial], **{"bounds": None, **others})

    @property
    def estimates(self) -> dict[str, Value]:
        """Present estimates of I [kg m2], b [N m s/rad] and m g r [N m]."""
        return {"inertia": self._inertia, "viscous": self._viscous, "weight": self._weight}

    _inertia: Value
    _viscous: Value
    _weight: Value

    def _start(self) -> dict[str, Any]:
        return {"inertia": self.arm.inertia, "viscous": self.arm.viscous, "weight": self.arm.weight}

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Desired gauge pressure [Pa] for a sample, within 0 and the limit; see
        :meth:`pamrs.control.Controller.update`.
        """
        angle, rate, acceleration, s, switching = self._surface(time, measurement, reference)
        inertia, viscous, weight = self._inertia, self._viscous, self._weight
        sine = sin(angle)
        wanted = (
            self.arm.pressure(inertia * acceleration + viscous * rate + weight * sine, angle)
            - switching
        )
        pressure = clip(wanted, 0.0, self._limit)
        error = dead(s, self._deadband)
        if self.hold_at_limit:
            error = held(error, wanted - pressure)
        if error.__class__ is not float or error != 0.0:
            g = self._rates
            inertia, viscous, weight = (
                inertia - g[0] * acceleration * error,
                viscous - g[1] * rate * error,
                weight - g[2] * sine * error,
            )
            if self._bounds is not None:
                (a, b), (c, d), (e, f) = self._bounds
                inertia, viscous, weight = (
                    clip(inertia, a, b),
                    clip(viscous, c, d),
                    clip(weight, e, f),
                )
            self._inertia, self._viscous, self._weight = inertia, viscous, weight
        return pressure


def held(error: Value, excess: Value) -> Value:
    """0 where adapting by an error would carry a pressure farther beyond its limit, which it is by
    ``excess``; else the error.
    """
    # every adaptation moves the pressure against the sign of s
    if error.__class__ is float and excess.__class__ is float:
        return 0.0 if error * excess < 0.0 else error
    return np.where(error * excess < 0.0, 0.0, error)


def _bounds(
    arm: ArmModel, bounds: Sequence[tuple[float, float]] | str | None
) -> tuple[tuple[float, float], ...] | None:
    """Checked bounds of the three estimates."""
    if bounds is None:
        return None
    starts = [np.asarray(value) for value in arm.gains]
    if isinstance(bounds, str):
        if bounds != "default":
            raise ParameterError(
                f"bounds = {bounds!r} is not allowed: 'default', three pairs or None"
            )
        tops = [10.0 * float(start.max()) for start in starts]
        # an arm of which nothing is known: what its muscles could move at all
        torque = (
            float(np.max(arm.torque.at(np.linspace(*arm.angle_range, 33))[0])) * arm.pressure_limit
        )
        scale = (torque / 10.0, torque / 10.0, torque)
        bounds = [
            (0.0, top if top > 0.0 else other) for top, other in zip(tops, scale, strict=True)
        ]
    if len(bounds) != 3:
        raise ParameterError(
            f"bounds has {len(bounds)} entries: three pairs are needed, for I, b and m g r"
        )
    checked = []
    for name, start, pair in zip(_NAMES, starts, bounds, strict=True):
        low, high = float(pair[0]), float(pair[1])
        if not (low < high and np.all(start >= low) and np.all(start <= high)):
            raise ParameterError(
                f"bounds[{name}] = {(low, high)} is not allowed: rising, with the start "
                f"{start.tolist()} within"
            )
        checked.append((low, high))
    return tuple(checked)
