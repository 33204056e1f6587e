"""Recruitment in real time: as few groups of muscles as the torque needs, added and dropped while
the arm moves (dissertation 6.6, its future work).

A group that is added is first filled to where it just does not pull, then takes its share of the
torque along a ramp; one that is dropped gives its share back along it, and is vented when it
carries nothing. In between the torque stays what was asked for:

::

    tau = sum_g w_g (c1 u + c2) + (1 - w_g) t0        w_g from 0 to 1, t0 what it gives idle
    P_g = w_g u + (1 - w_g) P0                        P0 = max(-c2/c1, 0): it just does not pull
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from pamrs._checks import positive, whole
from pamrs.control._parts import FilteredDerivative
from pamrs.control._protocol import Value
from pamrs.control._sharing import Demand, Share
from pamrs.control._torque import GroupTorque
from pamrs.control._values import clip, greater, lesser, positive_number, sin, where
from pamrs.errors import ParameterError

_FILL = 0.3  # of the ramp: how long a group is filled before it pulls
_LEAST_LEVER = 0.1  # sine of an angle below which a torque says little about a weight
_SLOWEST = 0.1  # of the ramp's rate, however low the supply


class Recruitment(Share):
    """Picks how many groups carry the torque, and moves smoothly from one number to another.

    Groups are added when the pressure that the present ones need, now or as predicted, passes a
    share of what is there; some are dropped when those that stay would need less than a smaller
    share of it, and have for a while. What is there is the supply less a reserve (a valve makes no
    flow without a difference, 6.6), at most the pressure limit. While the supply is within the
    reserve of what they all need, groups are filled more slowly: the others keep their air.

    Parameters
    ----------
    groups : sequence of GroupTorque
        All on one side of a joint; they are recruited in this order.
    pressure_limit : float
        [Pa]
    period : float
        Time between two samples of the controller [s].
    add_at, drop_at : float
        Shares of the pressure that is there [1]; ``drop_at`` below ``add_at``.
    dwell : float
        How long fewer groups must have been enough before any is dropped [s].
    ramp : float
        Time over which a group takes its share [s].
    horizon : float
        How far ahead torque and angle are predicted by their rates [s].
    reach : float, optional
        Angle from the vertical [rad] up to which the arm is going to be lifted: the torque there is
        predicted as well, from that of now by the lever of gravity. Groups then come while the
        pressures are low, and stay until less hangs on the arm; without, they come and go in every
        lift, and each time air under pressure is lost.
    reserve : float
        Difference of pressure that a valve needs [Pa]; 6.6 finds 2 bar too little for fast lifts.
    rate_filter : float
        Time constant of the low-pass on those rates [s].
    least : int
        Groups that stay.

    Raises
    ------
    ParameterError
        If a group lowers the joint, or a number is not allowed; the message names it.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("torque_rate", "angle_rate")

    def __init__(
        self,
        groups: Sequence[GroupTorque],
        pressure_limit: float,
        *,
        period: float,
        add_at: float = 0.9,
        drop_at: float = 0.7,
        dwell: float = 1.0,
        ramp: float = 0.5,
        horizon: float = 0.5,
        reach: float | None = None,
        reserve: float = 1e5,
        rate_filter: float = 0.1,
        least: int = 1,
    ) -> None:
        super().__init__(groups, pressure_limit)
        if any(group.sign < 0 for group in self.groups):
            raise ParameterError("recruitment is of groups on one side of a joint, which raise it")
        if not 0.0 < drop_at < add_at <= 1.0:
            raise ParameterError(
                f"drop_at = {drop_at} and add_at = {add_at} are not allowed: 0 < drop_at < add_at "
                "<= 1 is needed, so that a group that was dropped is not needed at once"
            )
        count = len(self.groups)
        self.period, self.ramp = positive_number("period", period), positive_number("ramp", ramp)
        self.add_at, self.drop_at = float(add_at), float(drop_at)
        self.dwell = positive("dwell", dwell, zero=True)
        self.horizon = positive("horizon", horizon, zero=True)
        self.reserve = positive("reserve", reserve, zero=True)
        self.least = whole("least", least, 1, count)
        if reach is not None and not 0.0 < reach < math.pi:
            raise ParameterError(
                f"reach = {reach} rad is not allowed: above 0 and below pi is needed"
            )
        others = [name for group in self.groups for name in getattr(group, "beyond_sine", ())]
        if reach is not None and others:
            raise ParameterError(
                f"reach = {reach} rad is not allowed with {others[0]}: the torque ahead is "
                "predicted by the sine of the joint's angle alone; leave reach out"
            )
        self.reach = None if reach is None else float(reach)
        self.angle_range = self.groups[0].angle_range
        self.torque_rate = FilteredDerivative(rate_filter, self.period)
        self.angle_rate = FilteredDerivative(rate_filter, self.period)
        self._shares = tuple(f"_share_{k}" for k in range(count))
        self._STATE = {  # type: ignore[misc]
            "active": float(least),
            "waited": 0.0,
            "calm": 0.0,
            **{f"share_{k}": 1.0 if k < least else -_FILL for k in range(count)},
        }
        self.reset()

    _active: Value
    _waited: Value
    _calm: Value

    @property
    def active(self) -> Value:
        """Number of groups that are recruited or on their way."""
        return self._active

    @property
    def shares(self) -> tuple[Value, ...]:
        """Ramp of each group: 1 while it carries its whole share, 0 none; below 0 it is being
        filled or vented, and without air at -0.3.
        """
        return tuple(getattr(self, name) for name in self._shares)

    @property
    def vented(self) -> tuple[Any, ...]:
        """True for each group without air; see :attr:`Share.vented`."""
        return tuple(share <= -_FILL for share in self.shares)

    def pressures(self, demand: Demand) -> list[Value]:
        """See :meth:`Share.pressures`."""
        torque, angle, limit = demand.torque, demand.angle, self.pressure_limit
        lines = [group.at(angle) for group in self.groups]
        weights = [clip(share, 0.0, 1.0) for share in self.shares]
        drive = clip(self._drive(torque, lines, weights), 0.0, limit)
        supply = demand.supplies[0]
        for other in demand.supplies[1:]:
            supply = lesser(supply, other)
        self._move(supply, self._choose(torque, angle, lines, supply))
        answers: list[Value] = []
        for share, weight, (c1, c2) in zip(self.shares, weights, lines, strict=True):
            idle = clip(-c2 / c1, 0.0, limit)
            filled = clip(1.0 + share / _FILL, 0.0, 1.0)
            answers.append(clip(filled * (weight * drive + (1.0 - weight) * idle), 0.0, limit))
        return answers

    @staticmethod
    def _drive(
        torque: Value, lines: Sequence[tuple[Value, Value]], weights: Sequence[Value]
    ) -> Value:
        """Pressure of the groups that carry their whole share [Pa]."""
        slope: Value = 0.0
        rest: Value = torque
        for (c1, c2), weight in zip(lines, weights, strict=True):
            slope = slope + weight * c1
            rest = rest - weight * c2 - (1.0 - weight) * clip(c2, 0.0, math.inf)
        return rest / slope

    @staticmethod
    def _needed(torque: Value, lines: Sequence[tuple[Value, Value]]) -> list[Value]:
        """Pressure [Pa] that the first 1, 2, ... groups need for a torque, the others idle."""
        rest: Value = torque
        for _, c2 in lines:
            rest = rest - clip(c2, 0.0, math.inf)
        slope: Value = 0.0
        found = []
        for c1, c2 in lines:
            slope, rest = slope + c1, rest - c2 + clip(c2, 0.0, math.inf)
            found.append(rest / slope)
        return found

    def _choose(
        self,
        torque: Value,
        angle: Value,
        lines: Sequence[tuple[Value, Value]],
        supply: Value,
    ) -> Value:
        """Add or drop groups, by what is needed now and a horizon ahead; return the pressure [Pa]
        that the active ones then need.
        """
        low, high = self.angle_range
        soon = clip(angle + self.horizon * self.angle_rate.update(angle), low, high)
        later = torque + self.horizon * self.torque_rate.update(torque)
        ahead = [group.at(soon) for group in self.groups]
        pairs = zip(self._needed(torque, lines), self._needed(later, ahead), strict=True)
        needed = [greater(now, then) for now, then in pairs]
        if self.reach is not None:
            far = clip(angle, self.reach, high)
            lever = sin(far) / clip(sin(angle), _LEAST_LEVER, 1.0)
            lines = [group.at(far) for group in self.groups]
            most = self._needed(clip(torque, 0.0, math.inf) * lever, lines)
            needed = [greater(a, b) for a, b in zip(needed, most, strict=True)]
        there = clip(supply - self.reserve, self.reserve, self.pressure_limit)
        active, waited = self._active, self._waited + self.period
        wanted = _count(needed, self.add_at * there, self.least)
        fewer = _count(needed, self.drop_at * there, self.least)
        calm = where(fewer < active, self._calm + self.period, 0.0)
        # while some are on their way, more need not be what is missing
        settled = waited >= self.ramp * (1.0 + _FILL)
        add = _both(wanted > active, settled)
        drop = _both(calm >= self.dwell, settled)
        changed = where(add, wanted, where(drop, fewer, active))
        self._waited = where(add, 0.0, where(drop, 0.0, waited))
        self._calm = where(drop, 0.0, calm)
        self._active = changed
        pressure = needed[0]
        for k in range(1, len(needed)):
            pressure = where(changed > k + 0.5, needed[k], pressure)
        return pressure

    def _move(self, supply: Value, needed: Value) -> None:
        """Move every share one sample along its ramp."""
        step = self.period / self.ramp
        left = clip((supply - needed) / self.reserve if self.reserve else 1.0, _SLOWEST, 1.0)
        for k, name in enumerate(self._shares):
            share = getattr(self, name)
            setattr(
                self,
                name,
                where(
                    self._active > k + 0.5,
                    clip(share + step * left, -_FILL, 1.0),
                    clip(share - step, -_FILL, 1.0),
                ),
            )


def _both(a: Any, b: Any) -> Any:
    return (a and b) if isinstance(a, bool) and isinstance(b, bool) else np.logical_and(a, b)


def _count(needed: Sequence[Value], most: Value, least: int) -> Value:
    """The fewest groups that need no more than a pressure, all if none does."""
    count: Value = float(least)
    for k in range(least, len(needed)):
        count = where(needed[k - 1] > most, k + 1.0, count)
    return count
