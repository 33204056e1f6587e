"""Payloads that an arm lifts and holds: the torque of its muscles at a pressure against that of
gravity, over the joint's range.

Statics only: pressure is taken as reached slowly, so that nothing is carried on by its swing.
Coulomb friction of the arm and hysteresis of the muscles are losses while lifting and help while
holding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import checked_number, whole
from pamrs.errors import ParameterError
from pamrs.rig import Joint
from pamrs.simulation import core_rig

if TYPE_CHECKING:
    from pamrs.rig import Rig

Array = NDArray[np.float64]

_LIFTING, _HOLDING = -1.0, 1.0  # direction of the muscles: shortening, about to be drawn out


@dataclass(frozen=True, eq=False)
class Lift:
    """Result of :func:`lift`; SI units, angles from the vertical.

    Attributes
    ----------
    rig : str
        Name of the rig.
    pressure : float
        Gauge pressure of the muscles [Pa].
    payload : float
        Mass at the tip [kg].
    angle : ndarray (n,)
        Angles from the lower stop to the end that was asked for [rad].
    torque, torque_holding : ndarray (n,)
        Torque of the muscles at each angle while they shorten, and the most with which they resist
        being drawn out [N m].
    gravity : ndarray (n,)
        Torque of the arm's and the payload's weight at each angle, with that of a spring across the
        joint [N m].
    coulomb : float
        Coulomb friction of the arm [N m].
    capacity : ndarray (n,)
        Payload that would just be lifted past each angle [kg]: negative where not even the empty
        arm is, infinite where a payload does not weigh on the joint.
    reached : float
        Angle up to which the arm is lifted from its lower stop [rad]; that stop itself where it is
        not lifted at all.
    held : float
        Angle up to which it is held when brought there [rad].
    regained : tuple of (float, float)
        Ranges beyond ``reached`` in which it is lifted again if it is brought there [rad].
    can_lift : bool
        Whether it is lifted over the whole range of ``angle``.
    margin, margin_angle : float
        Least of muscles less friction less gravity over the range [N m], and where [rad].
    payload_limit : float or None
        The most that is lifted over the whole range [kg]: infinite where no payload weighs on the
        joint, None where not even the empty arm is lifted.
    limit_angle : float
        Where that is decided [rad].
    """

    rig: str
    pressure: float
    payload: float
    angle: Array = field(repr=False)
    torque: Array = field(repr=False)
    torque_holding: Array = field(repr=False)
    gravity: Array = field(repr=False)
    coulomb: float
    capacity: Array = field(repr=False)
    reached: float
    held: float
    regained: tuple[tuple[float, float], ...]
    can_lift: bool
    margin: float
    margin_angle: float
    payload_limit: float | None
    limit_angle: float


def lift(
    rig: Rig, *, pressure: float | None = None, to: float | None = None, points: int = 721
) -> Lift:
    """Find what a one-link rig lifts and holds at a pressure.

    At each angle the torque of the muscles ``n F(P, d(theta)/L0) dd/dtheta`` is compared
    with gravity's ``(m lc + mp l) g sin(theta)`` (sections 4 and 5 of the physics reference;
    dissertation (3.24)). A payload that is too much is a result, not an error.

    Parameters
    ----------
    rig : Rig
        With muscle, joint and arm; its payload is what is to be lifted.
    pressure : float, optional
        Gauge pressure of the muscles [Pa]; that of the full supply by default.
    to : float, optional
        Angle up to which the payload is to be lifted [rad]; the upper stop by default.
    points : int
        Angles at which the torques are given; where signs change is found to round-off between
        them.

    Returns
    -------
    Lift

    Raises
    ------
    ParameterError
        If the rig has no muscle, joint or arm, there is no pressure, a value is not finite or
        outside its range; the message names it.
    """
    missing = [block for block in ("muscle", "joint", "arm") if block not in rig.blocks]
    if missing:
        raise ParameterError(
            f"rig {rig.name!r} has no [{missing[0]}]: lifting needs muscle, joint and arm"
        )
    if rig.tables("arm")[""]["kind"] != "one_link":
        raise ParameterError(
            f"rig {rig.name!r} has an arm of several links: what it lifts is found for a one-link "
            "arm only"
        )
    # refuses lengths that the muscle cannot have, and angles that the tendon does not reach
    core_rig(rig)
    pressure = _pressure(rig, pressure)
    joint = next(iter(rig.tables("joint").values()))
    low, high = float(joint["min_angle"]), float(joint["max_angle"])
    end = high if to is None else float(to)
    if not low < end <= high:
        raise ParameterError(
            f"to = {end:g} rad ({math.degrees(end):.4g} deg) is not allowed: above "
            f"joint.min_angle = {_degrees(low)} deg, at most joint.max_angle = {_degrees(high)} deg"
        )
    whole("points", points, 3)
    balance = _Balance(rig, pressure)
    angle = np.linspace(low, end, points)
    torque = balance.torque(angle, _LIFTING)
    capacity = balance.capacity(angle)
    crossings = _crossings(balance.excess, angle)
    lifted = bool(balance.excess(angle[:1])[0] > 0.0)
    reached = (crossings[0] if crossings else end) if lifted else low
    later = [*crossings[1:], end] if lifted else [*crossings, end]
    regained = tuple(zip(later[::2], later[1::2], strict=False))
    margin_angle = _least(balance.excess, angle)
    limit, limit_angle = balance.limit(angle)
    return Lift(
        rig=rig.name,
        pressure=pressure,
        payload=float(balance.arm["payload"]),
        angle=angle,
        torque=torque,
        torque_holding=balance.torque(angle, _HOLDING),
        gravity=balance.gravity(angle),
        coulomb=balance.coulomb,
        capacity=capacity,
        reached=float(reached),
        held=_held(balance, angle),
        regained=regained,
        can_lift=bool(lifted and not crossings),
        margin=_of_one(balance.excess)(margin_angle),
        margin_angle=margin_angle,
        payload_limit=limit,
        limit_angle=limit_angle,
    )


def _hysteresis(rig: Rig, muscle: str) -> tuple[float, float]:
    """Friction of one muscle of a group by the effect of the catalogue that acts on it: constant
    [N], by pressure [N/Pa].
    """
    for effect in rig.effects:
        if effect["id"] == "muscle_hysteresis" and effect.get("at", "") in ("", muscle):
            values = effect["parameters"]
            return values["friction_constant"], values["friction_pressure"]
    return 0.0, 0.0


class _Balance:
    """Torques of one rig at one pressure, as functions of the angle [rad] over arrays."""

    def __init__(self, rig: Rig, pressure: float) -> None:
        self.arm = rig.tables("arm")[""]
        self.joint = next(iter(rig.tables("joint").values()))
        transmissions = rig.tables("transmission")
        self.groups = [
            (
                rig.muscle_of(name),
                Joint.from_model(transmissions.get(name, self.joint)),
                _hysteresis(rig, name),
            )
            for name in rig.tables("muscle")
        ]
        self.pressure = pressure
        self.coulomb = float(self.arm["coulomb"])

    def torque(self, angle: Array, direction: float) -> Array:
        """Of the muscles, while they shorten or are about to be drawn out [N m]; those that would
        lower the arm are vented.
        """
        total = np.zeros(angle.shape)
        for muscle, joint, (constant, by_pressure) in self.groups:
            rest, count = float(muscle.parameters["rest_length"]), int(muscle.parameters["count"])
            arm = joint.torque_arm(angle)
            # a muscle on the other side of the joint lengthens where the arm rises
            way = direction * np.sign(np.where(arm == 0.0, 1.0, arm))
            lowers = (arm < 0.0) & (len(self.groups) > 1)
            pressure = np.where(lowers, 0.0, self.pressure)
            friction = constant + by_pressure * np.maximum(pressure, 0.0)
            force = muscle.force(pressure, joint.shortening(angle) / rest, way) + way * friction
            total += count * muscle.buckled(force) * arm
        return total

    def weight(self, angle: Array) -> Array:
        """Torque of a kilogram at the tip [N m/kg]."""
        direction = angle + self.arm.get("base_angle", 0.0)
        return np.asarray(self.arm["length"] * self.arm["gravity"] * np.sin(direction))

    def own(self, angle: Array) -> Array:
        """Torque that holds the empty arm against gravity and a spring across the joint [N m]."""
        direction = angle + self.arm.get("base_angle", 0.0) + self.arm.get("centre_angle", 0.0)
        weight = self.arm["first_moment"] * self.arm["gravity"] * np.sin(direction)
        spring = self.joint.get("stiffness", 0.0) * (angle - self.joint.get("spring_angle", 0.0))
        return np.asarray(weight + spring)

    def gravity(self, angle: Array) -> Array:
        """Torque that holds the arm with its payload [N m]."""
        return np.asarray(self.own(angle) + self.arm["payload"] * self.weight(angle))

    def excess(self, angle: Array) -> Array:
        """Muscles less friction less gravity, lifting [N m]."""
        return self.torque(angle, _LIFTING) - self.coulomb - self.gravity(angle)

    def keeps(self, angle: Array) -> Array:
        """Muscles and friction less gravity, holding [N m]."""
        return self.torque(angle, _HOLDING) + self.coulomb - self.gravity(angle)

    def free(self, angle: Array) -> Array:
        """Torque left for a payload: muscles less friction less the empty arm [N m]."""
        return self.torque(angle, _LIFTING) - self.coulomb - self.own(angle)

    def capacity(self, angle: Array) -> Array:
        """Payload just lifted past an angle [kg]."""
        free, weight = self.free(angle), self.weight(angle)
        return np.where(weight > 0.0, free / np.where(weight > 0.0, weight, 1.0), math.inf)

    def limit(self, angle: Array) -> tuple[float | None, float]:
        """The most that is lifted at every angle, and where that is decided."""
        where = _least(self.capacity, angle)
        limit = _of_one(self.capacity)(where)
        if limit < 0.0:
            return None, where
        # where a payload helps or does not weigh, the muscles must still do their part
        helped = self.weight(angle) <= 0.0
        load = 0.0 if math.isinf(limit) else limit
        rest = (self.free(angle) - load * self.weight(angle))[helped]
        if rest.size and rest.min() < 0.0:
            return None, float(angle[helped][rest.argmin()])
        return limit, where


def _pressure(rig: Rig, pressure: float | None) -> float:
    """The pressure asked for, or the supply's."""
    if pressure is None:
        if "supply" not in rig.blocks:
            raise ParameterError(
                f"pressure is missing: the rig {rig.name!r} has no [supply] whose pressure could "
                "be taken"
            )
        return max(float(supply["initial_pressure"]) for supply in rig.tables("supply").values())
    return checked_number("pressure", pressure, 0.0, 1e8, "Pa")


def _of_one(function: Callable[[Array], Array]) -> Callable[[float], float]:
    """A function over arrays as one of a single angle."""
    return lambda angle: float(function(np.array([angle]))[0])


def _crossings(function: Callable[[Array], Array], angle: Array) -> list[float]:
    """Angles at which a function changes sign."""
    from scipy.optimize import brentq

    positive, found = function(angle) > 0.0, []
    for index in np.flatnonzero(positive[1:] != positive[:-1]).tolist():
        low, high = float(angle[index]), float(angle[index + 1])
        found.append(float(brentq(_of_one(function), low, high, xtol=1e-14, rtol=1e-14)))
    return found


def _least(function: Callable[[Array], Array], angle: Array) -> float:
    """Angle at which a function is least, refined between its neighbours."""
    from scipy.optimize import minimize_scalar

    values = function(angle)
    best = int(np.argmin(values))
    if not math.isfinite(values[best]) or best in (0, angle.size - 1):
        return float(angle[best])
    around = (float(angle[best - 1]), float(angle[best + 1]))
    found = minimize_scalar(
        _of_one(function), bounds=around, method="bounded", options={"xatol": 1e-10}
    )
    return float(found.x if found.fun < values[best] else angle[best])


def _held(balance: _Balance, angle: Array) -> float:
    """Angle up to which the arm is held, from the lower stop on, which holds it."""
    gaps = _crossings(balance.keeps, angle)
    if balance.keeps(angle[:1])[0] < 0.0:
        return float(angle[0])
    return gaps[0] if gaps else float(angle[-1])


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}"
