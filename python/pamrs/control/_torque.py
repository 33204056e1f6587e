"""Torque of the muscles of a joint as a controller has it: a line in the pressure.

At an angle the torque of every force model is ``tau = C1(theta) P + C2(theta)``: exactly so for the
full model (:class:`FullTorque`, :class:`GroupTorque`, from the core's own muscle and joint), and
with cubic C1 and C2 for the simplified one, (5.1)-(5.3) (:class:`SimplifiedTorque`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Protocol

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import check_names, one_of
from pamrs.channels import dotted
from pamrs.control._groups import Group, beyond_sine, check_single, groups_of, highest_pressure
from pamrs.control._protocol import Value
from pamrs.control._values import Spline, clip, positive_gain, where
from pamrs.errors import ParameterError
from pamrs.rig import Joint, Muscle, Rig

# of a table over the joint's range; makes its error some 1e-9 of the largest value
_NODES: Final = 1025
_STRUT: Final = 1e9  # buckling load of a muscle that pushes, whatever it is pushed with [N]
_LEAST_SLOPE: Final = 0.01  # of the largest C1: below it a pressure says nothing about the torque


class TorqueModel(Protocol):
    """Torque of the muscles at an angle, a line in the gauge pressure."""

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa], above zero, and ``C2`` [N m] at an angle [rad]."""


def drive_limits(torque: TorqueModel, angle: Value, pressure_limit: float) -> tuple[Value, Value]:
    """Least and largest drive at an angle [Pa]: a model's own, or any pressure up to the limit."""
    own = getattr(torque, "limits", None)
    found: tuple[Value, Value] = own(angle, pressure_limit) if own else (0.0, pressure_limit)
    return found


class _Straight:
    """Geometry of a muscle that pulls a load straight: its "angle" is the shortening [m]."""

    def shortening(self, angle: ArrayLike) -> Array:
        """Return the argument: the shortening [m]."""
        return np.asarray(angle, dtype=np.float64)

    def torque_arm(self, angle: ArrayLike) -> Array:
        """Ones: change of the shortening with itself [1]."""
        return np.ones_like(np.asarray(angle, dtype=np.float64))


def rest_length_of(rig: Rig) -> float:
    """Length at rest of the muscles that pull on a load [m]; they have one.

    Parameters
    ----------
    rig : Rig

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        If the rig has no load or no muscle.
    """
    muscles = rig.tables("muscle")
    if not rig.tables("load") or not muscles:
        raise ParameterError(f"rig {rig.name!r} has no [load] with a muscle: one is needed")
    return float(next(iter(muscles.values()))["rest_length"])


def _parts(rig: Rig, muscle: str | None = None) -> tuple[Muscle, Any, dict[str, Any]]:
    """Muscle of a rig, its geometry, and the joint's table or the ends of the shortening of a load;
    without a name the only muscle of a rig with one joint and one link.
    """
    if rig.tables("load"):
        if muscle is None:
            raise ParameterError(
                f"rig {rig.name!r} has a [load] instead of [joint] and [arm], which this "
                "model of a joint needs; RigModel and LoadModel take a load"
            )
        rest, load = rest_length_of(rig), next(iter(rig.tables("load").values()))
        ends = {"min_angle": rest - load["max_length"], "max_angle": rest - load["min_length"]}
        return rig.muscle_of(muscle), _Straight(), ends
    if muscle is None:
        check_single(rig, ("muscle", "joint", "arm"), "of one muscle needs exactly one")
        arm = next(iter(rig.tables("arm").values()))
        if arm["kind"] != "one_link":
            raise ParameterError(
                f"rig {rig.name!r} has an arm of kind {arm['kind']!r}: a controller's model of one "
                "muscle needs one_link"
            )
        muscle = next(iter(rig.tables("muscle")))
    joint = rig.ports("muscle")[muscle]["joint"].partition(".")[2]
    own = rig.tables("joint")[joint]
    return rig.muscle_of(muscle), Joint.from_model(rig.tables("transmission").get(muscle, own)), own


def torque_line(
    rig: Rig, angle: ArrayLike, *, lengthening: bool = False, muscle: str | None = None
) -> tuple[Array, Array]:
    """``C1`` and ``C2`` of the full model at angles, exact: the core's muscle in one direction of
    motion, without friction.

    Parameters
    ----------
    rig : Rig
        With one muscle (or bundle), one joint and a one-link arm, or any with a muscle of the name.
    angle : array_like
        Angles [rad].
    lengthening : bool
        Whether the muscle lengthens: another branch with the model ``elbow_linear``, (4.7).
    muscle : str, optional
        Name of the muscle, of a rig with several.

    Returns
    -------
    tuple of (ndarray, ndarray)
        [N m/Pa] and [N m], in the shape of ``angle``.

    Raises
    ------
    ParameterError
        If the rig has not exactly these blocks, or the joint cannot have an angle.
    """
    model, joint, _ = _parts(rig, muscle)
    count, pressure = int(model.parameters["count"]), 1e6
    smooth = model.replace(
        friction_coefficient=0.0, friction_pressure_slope=0.0, friction_floor=0.0
    )
    contraction = joint.shortening(angle) / float(model.parameters["rest_length"])
    direction, arm = (1.0 if lengthening else -1.0), joint.torque_arm(angle)
    zero, full = (
        np.asarray(count * smooth.force(p, contraction, direction) * arm) for p in (0.0, pressure)
    )
    return (full - zero) / pressure, zero


class GroupTorque:
    """Torque of a group of muscles with one pressure, from tables of the full model over the
    joint's range; beyond it that of its ends.

    Where C1 falls below a hundredth of its largest size (a muscle at the end of its stroke), or has
    the other sign, it is held there, so that what would need any pressure asks for the limit.

    Parameters
    ----------
    rig : Rig
    muscles : tuple of str
        Names of the muscles, all on one joint.
    lengthening : bool
        As for :func:`torque_line`.

    Attributes
    ----------
    sign : int
        1 where pressure raises the angle, -1 where it lowers it.
    angle_range : tuple of (float, float)
        Of the joint [rad].
    slackens : bool
        Whether its muscles go slack or bow out where the line is beyond zero: none of them is a
        strut.
    beyond_sine : tuple of str
        Keys of the rig, with their values, for which the torque that holds the joint is not the
        sine of its angle times a number: springs, a tilted base.
    error : float
        Largest error of the tables half way between their places, relative to the largest values
        [1].

    Raises
    ------
    ParameterError
        If pressure changes no torque.
    """

    def __init__(self, rig: Rig, muscles: tuple[str, ...], *, lengthening: bool = False) -> None:
        table = _parts(rig, muscles[0])[2]
        low, high = self.angle_range = float(table["min_angle"]), float(table["max_angle"])
        joint = rig.ports("muscle")[muscles[0]]["joint"].partition(".")[2]
        self.slackens = all(rig.tables("muscle")[m]["buckling_load"] < _STRUT for m in muscles)
        self.beyond_sine = beyond_sine(rig, joint)
        place = np.linspace(low, high, _NODES)
        between = 0.5 * (place[1:] + place[:-1])

        def line(angle: Array) -> tuple[Array, Array]:
            each = [torque_line(rig, angle, lengthening=lengthening, muscle=m) for m in muscles]
            return np.sum([c for c, _ in each], axis=0), np.sum([c for _, c in each], axis=0)

        c1, c2 = line(place)
        self.sign = 1 if c1.max() >= -c1.min() else -1
        self._floor = float(_LEAST_SLOPE * np.abs(c1).max())
        if not self._floor > 0.0:
            raise ParameterError(
                f"rig {rig.name!r}: pressure in {', '.join(muscles) or 'the muscle'} changes no "
                "torque, so no pressure can be asked for"
            )
        self.slope, self.rest = Spline(low, high, c1), Spline(low, high, c2)
        pairs = zip((self.slope(between), self.rest(between)), line(between), (c1, c2), strict=True)
        self.error = max(
            float(np.abs(table - exact).max() / max(np.abs(values).max(), 1e-300))
            for table, exact, values in pairs
        )

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa], of the group's sign, and ``C2`` [N m] at an angle [rad]."""
        slope, floor = self.slope(angle), self._floor
        if self.sign > 0:
            if slope.__class__ is float:
                return (slope if slope > floor else floor), self.rest(angle)
            return np.maximum(slope, floor), self.rest(angle)
        if slope.__class__ is float:
            return (slope if slope < -floor else -floor), self.rest(angle)
        return np.minimum(slope, -floor), self.rest(angle)

    def taut(self, angle: Value, least: float, most: float) -> Value:
        """Least gauge pressure at an angle at which the line holds, within two bounds [Pa]: muscles
        that slacken do so below it. The lower bound where the upper one does not make them taut.
        """
        if not self.slackens:
            return least
        slope, rest = self.at(angle)
        begins = -rest / slope
        return where(begins < most, clip(begins, least, most), least)

    def stiffness(self, angle: Value) -> tuple[Value, Value]:
        """``k1`` [N m/(rad Pa)] and ``k2`` [N m/rad]: ``-dtau/dtheta = k1 P + k2`` while the
        pressure is held.
        """
        return -self.slope.slope(angle), -self.rest.slope(angle)


class FullTorque(GroupTorque):
    """Torque of the full model of a rig with one muscle (or bundle), as :class:`GroupTorque`.

    Parameters
    ----------
    rig : Rig
        As for :func:`torque_line`.
    lengthening : bool
        As for :func:`torque_line`.

    Raises
    ------
    ParameterError
        As :func:`torque_line`; if pressure lowers the torque.
    """

    def __init__(self, rig: Rig, *, lengthening: bool = False) -> None:
        _parts(rig)
        super().__init__(rig, (next(iter(rig.tables("muscle"))),), lengthening=lengthening)
        if self.sign < 0:
            raise ParameterError(
                f"rig {rig.name!r}: pressure lowers the torque everywhere, so no pressure can be "
                "asked for"
            )


class BundleTorque:
    """Torque of groups on one side of a joint, all with the same pressure: the sum of their lines.

    Parameters
    ----------
    groups : tuple of GroupTorque
        At least one, all of which raise the angle.
    """

    def __init__(self, groups: tuple[GroupTorque, ...]) -> None:
        self.groups = groups

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` [N m] at an angle [rad]."""
        c1, c2 = self.groups[0].at(angle)
        for group in self.groups[1:]:
            a, b = group.at(angle)
            c1, c2 = c1 + a, c2 + b
        return c1, c2


class OpposedTorque:
    """Torque of muscles on both sides of a joint, as a line in a difference of pressures.

    The difference is ``tau/C1``, ``C1 = (sum |C1 of each group|)/2`` and ``C2 = 0``: what two
    muscles that are alike would differ by. Which pressures give the torque is
    :class:`pamrs.control.CoContraction`'s to say.

    Parameters
    ----------
    groups : tuple of GroupTorque
        Some of which raise the angle and some lower it.
    """

    def __init__(self, groups: tuple[GroupTorque, ...]) -> None:
        self.groups = groups

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` = 0 at an angle [rad]."""
        total: Value = 0.0
        for group in self.groups:
            total = total + 0.5 * group.sign * group.at(angle)[0]
        return total, 0.0

    def limits(self, angle: Value, pressure_limit: float) -> tuple[Value, Value]:
        """Least and largest difference at an angle [Pa], every pressure from 0 to the limit, and
        muscles that slacken at least taut.
        """
        total: Value = 0.0
        low: Value = 0.0
        high: Value = 0.0
        for group in self.groups:
            c1, c2 = group.at(angle)
            total = total + 0.5 * group.sign * c1
            most = c2 + c1 * pressure_limit
            least = c2 + c1 * group.taut(angle, 0.0, pressure_limit)
            low, high = (low + least, high + most) if group.sign > 0 else (low + most, high + least)
        return low / total, high / total


class SimplifiedTorque:
    """Simplified torque model (5.1)-(5.3): ``C1 = k1 x^3 + k2 x^2 + k3 x + k4``,
    ``C2 = k5 x^3 + k6 x^2 + k7 x + k8``.

    Parameters
    ----------
    coefficients : sequence of float
        ``k1`` to ``k8`` [N m/Pa/rad^i, N m/rad^i], for angles x in radians.
    angle_range : tuple of (float, float)
        Where they hold [rad]; beyond it the ends' values are used.
    rms, largest : float, optional
        Residual of the fit [N m].
    relative : float, optional
        Its rms in parts of the largest torque of the fit [1].

    Raises
    ------
    ParameterError
        If there are not eight finite coefficients, or C1 is not above zero over the range.
    """

    def __init__(
        self,
        coefficients: ArrayLike,
        angle_range: tuple[float, float],
        *,
        rms: float = math.nan,
        largest: float = math.nan,
        relative: float = math.nan,
    ) -> None:
        k = np.asarray(coefficients, dtype=np.float64)
        if k.shape != (8,) or not np.all(np.isfinite(k)):
            raise ParameterError(
                f"coefficients of shape {k.shape} are not allowed: eight finite numbers are needed"
            )
        self.coefficients: tuple[float, ...] = tuple(k.tolist())
        self.angle_range = (float(angle_range[0]), float(angle_range[1]))
        self.rms, self.largest, self.relative = rms, largest, relative
        least = float(np.polyval(k[:4], np.linspace(*self.angle_range, 501)).min())
        if not least > 0.0:
            raise ParameterError(
                f"coefficients give C1 = {least:g} N m/Pa within the range: above zero is needed"
            )

    @classmethod
    def fit(
        cls,
        rig: Rig,
        *,
        low: float = math.radians(15.0),
        high: float = math.radians(110.0),
        pressure: float | None = None,
    ) -> SimplifiedTorque:
        """Fit the simplified model to the full one by least squares, over even angles and pressures
        from zero.

        Parameters
        ----------
        rig : Rig
            As for :func:`torque_line`.
        low, high : float
            Range of the angle [rad], by default that of the dissertation, cut to the joint's own.
        pressure : float, optional
            Largest gauge pressure [Pa]; that of the supply by default.

        Returns
        -------
        SimplifiedTorque
            With its residual.

        Raises
        ------
        ParameterError
            As :func:`torque_line`; if the range is empty or C1 of the fit is not above zero.
        """
        _, _, table = _parts(rig)
        low, high = max(low, float(table["min_angle"])), min(high, float(table["max_angle"]))
        if not low < high:
            raise ParameterError(
                f"low = {low:g} rad and high = {high:g} rad leave nothing of the joint's range"
            )
        top = (
            highest_pressure(rig)
            if pressure is None
            else float(positive_gain("pressure", pressure))
        )
        angle = np.linspace(low, high, 191)
        c1, c2 = torque_line(rig, angle)
        powers = np.vander(angle, 4)
        scaled = np.linspace(0.0, 1.0, 21)
        torque = np.outer(scaled * top, c1) + c2
        columns = np.concatenate(
            [(scaled[:, None, None] * powers), np.broadcast_to(powers, (21, *powers.shape))], axis=2
        ).reshape(-1, 8)
        k = np.linalg.lstsq(columns, torque.ravel(), rcond=None)[0]
        residual = columns @ k - torque.ravel()
        k[:4] /= top
        rms, biggest = float(np.sqrt(np.mean(residual**2))), float(np.abs(torque).max())
        return cls(
            k, (low, high), rms=rms, largest=float(np.abs(residual).max()), relative=rms / biggest
        )

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` [N m] at an angle [rad]."""
        low, high = self.angle_range
        k1, k2, k3, k4, k5, k6, k7, k8 = self.coefficients
        if angle.__class__ is float:
            x: Value = low if angle < low else high if angle > high else angle
        else:
            x = np.minimum(np.maximum(angle, low), high)
        return ((k1 * x + k2) * x + k3) * x + k4, ((k5 * x + k6) * x + k7) * x + k8


def active_groups(rig: Rig, active: Sequence[str] | None) -> tuple[Group, ...]:
    """The groups of muscles of a rig that are used.

    Parameters
    ----------
    rig : Rig
    active : sequence of str, optional
        Names of their chambers; all by default.

    Returns
    -------
    tuple of Group

    Raises
    ------
    ParameterError
        If a name is none of a chamber with muscles, or as
        :func:`pamrs.control._groups.groups_of`.
    """
    groups = groups_of(rig)
    if active is None:
        return groups
    there = [group.chamber for group in groups]
    check_names("active", active, there, "chamber with muscles")
    return tuple(group for group in groups if group.chamber in active)


def group_torques(rig: Rig, groups: Sequence[Group]) -> dict[str, GroupTorque]:
    """The torque of each group; those that are alike, of a bundle of hundreds, are one.

    Parameters
    ----------
    rig : Rig
    groups : sequence of Group

    Returns
    -------
    dict of str to GroupTorque
        Chamber -> torque.

    Raises
    ------
    ParameterError
        As :class:`GroupTorque`.
    """
    muscles, ways, joints = (rig.tables(b) for b in ("muscle", "transmission", "joint"))
    made: dict[str, GroupTorque] = {}
    found = {}
    for group in groups:
        what = [(muscles[name], ways.get(name), joints.get(group.joint)) for name in group.muscles]
        key = repr(what)
        if key not in made:
            made[key] = GroupTorque(rig, group.muscles)
        found[group.chamber] = made[key]
    return found


def joint_torque(
    rig: Rig, joint: str, torque: str | TorqueModel, active: Sequence[str] | None
) -> TorqueModel:
    """The torque model of a joint, or of what a mass hangs from.

    Parameters
    ----------
    rig : Rig
    joint : str
        Its name.
    torque : {"full", "simplified"} or TorqueModel
        Which; of several muscles the full one.
    active : sequence of str, optional
        Chambers whose muscles are used; all by default.

    Returns
    -------
    TorqueModel

    Raises
    ------
    ParameterError
        If there is no such torque model or chamber, or no muscle in use raises the angle.
    """
    groups = active_groups(rig, active)
    makers: dict[str, Any] = {
        "full": FullTorque,
        "simplified": SimplifiedTorque.fit,
    }
    one_link = active is None and not rig.tables("link")
    alone = one_link and len(rig.tables("muscle")) == len(rig.tables("joint")) == 1
    if isinstance(torque, str):
        one_of("torque", torque, makers, also=", or a model")
        if alone:
            made: TorqueModel = makers[torque](rig)
            return made
    elif alone or rig.tables("load"):
        return torque
    if torque != "full":
        raise ParameterError(
            f"torque = {torque!r} is not allowed for rig {rig.name!r}, which has several muscles: "
            "'full' is needed"
        )
    each = tuple(group_torques(rig, [g for g in groups if g.joint == joint]).values())
    if all(group.sign < 0 for group in each):
        where = dotted("joint", joint)
        raise ParameterError(
            f"rig {rig.name!r}: no muscle in use raises the angle of {where}, so that no pressure "
            "can be asked for"
        )
    if len({group.sign for group in each}) > 1:
        return OpposedTorque(each)
    return each[0] if len(each) == 1 else BundleTorque(each)
