"""Shares of the muscles of a joint in its torque: from the drive or the torque that a law asks for
to the pressure of each chamber.

A share is asked once for each sample of the controller, in order, so that one with a state
(:class:`pamrs.control.Recruitment`) can count time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from pamrs.control._protocol import Value
from pamrs.control._sampled import Stateful
from pamrs.control._torque import GroupTorque
from pamrs.control._values import as_value, clip, greater, lesser
from pamrs.errors import ParameterError

#: A number for all time, or a function of time [s].
Stiffness: TypeAlias = "Value | Callable[[float], Value]"
_LEAST_STIFFNESS_GAIN = 1e-12  # N m/rad per Pa: below it the pressures do not change the stiffness


class Demand(NamedTuple):
    """Demand on the muscles of a joint at a sample."""

    time: float
    """[s]"""
    drive: Value
    """[Pa]"""
    torque: Value
    """That of the drive at the angle [N m]."""
    angle: Value
    """Angle of the joint at which the torque is wanted [rad]."""
    pressures: tuple[Value, ...]
    """Of the groups' chambers, gauge, as measured [Pa]."""
    supplies: tuple[Value, ...]
    """Of what feeds each, gauge [Pa]; the pressure limit where it is not measured."""


class Share(Stateful):
    """Rule by which the groups of a joint share its torque.

    Parameters
    ----------
    groups : sequence of GroupTorque
        Of the joint.
    pressure_limit : float
        Largest gauge pressure that may be asked for [Pa].
    """

    def __init__(self, groups: Sequence[GroupTorque], pressure_limit: float) -> None:
        self.groups, self.pressure_limit = tuple(groups), float(pressure_limit)

    def pressures(self, demand: Demand) -> list[Value]:
        """Gauge pressure for every group [Pa], from 0 to the limit.

        Parameters
        ----------
        demand : Demand

        Returns
        -------
        list of float or ndarray
        """
        raise NotImplementedError

    @property
    def vented(self) -> tuple[Any, ...]:
        """True for each group that is left open to the ambient since it is not used: a pressure
        loop would feed it from the supply wherever it is drawn out below the ambient pressure.
        """
        return (False,) * len(self.groups)


class Together(Share):
    """Share with one pressure for every group of a side: the drive itself."""

    def pressures(self, demand: Demand) -> list[Value]:
        """See :meth:`Share.pressures`."""
        pressure = clip(demand.drive, 0.0, self.pressure_limit)
        return [pressure] * len(self.groups)


class CoContraction(Share):
    """Muscles on both sides of a joint: torque by their difference, stiffness by what they have in
    common.

    At an angle torque and stiffness are lines in the two pressures,

    ::

        tau = sum (c1 P + c2)        K = -dtau/dtheta = sum (k1 P + k2)   at held pressures

    so that two numbers that are asked for give two pressures. Where both cannot be had, the torque
    is kept and the stiffness comes as near as the pressures allow.

    Parameters
    ----------
    groups : sequence of GroupTorque
        Those of one side have one pressure.
    pressure_limit : float
        [Pa]
    stiffness : float, ndarray, shape (n,), callable or None
        ``K`` [N m/rad], or a function of the time [s] that gives it. None: the least pressures that
        give the torque.
    least_pressure : float
        Gauge pressure below which no muscle is let [Pa]. Muscles that slacken are let no lower
        than the pressure at which they begin to pull.

    Raises
    ------
    ParameterError
        If the groups are all on one side, or a number is not allowed.
    """

    def __init__(
        self,
        groups: Sequence[GroupTorque],
        pressure_limit: float,
        *,
        stiffness: Stiffness | None = None,
        least_pressure: float = 0.0,
    ) -> None:
        super().__init__(groups, pressure_limit)
        self._up = [k for k, group in enumerate(self.groups) if group.sign > 0]
        self._down = [k for k, group in enumerate(self.groups) if group.sign < 0]
        if not self._up or not self._down:
            raise ParameterError(
                "stiffness is chosen by muscles on both sides of a joint; here all are on one"
            )
        self._stiffness = stiffness if callable(stiffness) else stiffness_of(stiffness)
        self.least_pressure = float(
            as_value("least_pressure", least_pressure, lower=0.0, upper=self.pressure_limit)
        )

    def pressures(self, demand: Demand) -> list[Value]:
        """See :meth:`Share.pressures`."""
        wanted = self._stiffness
        if callable(wanted):
            wanted = stiffness_of(wanted(demand.time))
        high, angle = self.pressure_limit, demand.angle
        up, down = self._least(self._up, angle), self._least(self._down, angle)
        a, a0, ka, ka0 = self._side(self._up, angle)
        b, b0, kb, kb0 = self._side(self._down, angle)
        # tau = a p + b q + a0 + b0 with b < 0: a line of pairs, of which the limits cut a piece
        left = demand.torque - a0 - b0
        first = greater(down, (a * up - left) / -b)
        last = lesser(high, (left - a * high) / b)
        q = first
        if wanted is not None:
            gain = kb - ka * b / a
            rest = ka * left / a + ka0 + kb0
            q = _towards(wanted - rest, gain, first, last)
        q = clip(q, down, high)
        p = clip((left - b * q) / a, up, high)
        return [p if group.sign > 0 else q for group in self.groups]

    def stiffness(self, pressures: Sequence[Value], angle: Value) -> Value:
        """Stiffness of the joint by its muscles [N m/rad] at pressures [Pa] that are held and make
        them taut.

        Parameters
        ----------
        pressures : sequence of float or ndarray
            Of the groups.
        angle : float or ndarray
            [rad]

        Returns
        -------
        float or ndarray
        """
        total: Value = 0.0
        for group, pressure in zip(self.groups, pressures, strict=True):
            k1, k2 = group.stiffness(angle)
            total = total + k1 * pressure + k2
        return total

    def _least(self, which: list[int], angle: Value) -> Value:
        """Least pressure of the groups of a side [Pa]: that at which all of them are taut."""
        low: Value = self.least_pressure
        for k in which:
            low = greater(low, self.groups[k].taut(angle, self.least_pressure, self.pressure_limit))
        return low

    def _side(self, which: list[int], angle: Value) -> tuple[Value, Value, Value, Value]:
        """``c1, c2, k1, k2`` of the groups of a side."""
        c1, c2 = self.groups[which[0]].at(angle)
        k1, k2 = self.groups[which[0]].stiffness(angle)
        for k in which[1:]:
            (d1, d2), (l1, l2) = self.groups[k].at(angle), self.groups[k].stiffness(angle)
            c1, c2, k1, k2 = c1 + d1, c2 + d2, k1 + l1, k2 + l2
        return c1, c2, k1, k2


def stiffness_of(value: Any) -> Value | None:
    """Checked stiffness [N m/rad]; None stays None."""
    return None if value is None else as_value("stiffness", value, lower=0.0)


def _towards(needed: Value, gain: Value, first: Value, last: Value) -> Value:
    """``needed/gain`` within bounds; the first where the gain is nothing."""
    if needed.__class__ is gain.__class__ is first.__class__ is last.__class__ is float:
        if abs(gain) < _LEAST_STIFFNESS_GAIN or not math.isfinite(needed):
            return first
        return clip(needed / gain, first, last)
    still = np.abs(gain) < _LEAST_STIFFNESS_GAIN
    return np.where(still, first, clip(needed / np.where(still, 1.0, gain), first, last))
