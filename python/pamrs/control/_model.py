"""Equations of motion of model-based controllers: inertia, gravity, and the muscle torque as a line
in the pressure.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

from pamrs._checks import finite, refused, rising
from pamrs.control._groups import highest_pressure, joints_of
from pamrs.control._protocol import Value
from pamrs.control._torque import TorqueModel, drive_limits, joint_torque
from pamrs.control._values import as_value, positive_gain, sin
from pamrs.errors import ParameterError
from pamrs.rig import Rig


class MotionParameter(NamedTuple):
    """A number of the equation of motion that is linear in it, which a controller may estimate."""

    name: str
    """``inertia``, ``viscous``, ``weight``; of several joints with their names behind."""
    kind: int
    """0: inertia [kg m2], 1: viscous friction [N m s/rad], 2: weight [N m]."""
    value: Value
    """As the model has it."""


class JointModel(abc.ABC):
    """Equation of motion as a controller has it, of one joint or of several.

    With one joint every value is a float, or an array of shape ``(n,)`` for a batch of n plants.
    With J joints it is an array of shape ``(J n,)``: the n values of the first joint, then those of
    the second. So a law that is written for a batch of plants holds for several joints, which are
    coupled in :meth:`inverse_dynamics` and :meth:`regressor` alone.

    What a law asks for is a *drive* [Pa], in which the torque of the muscles is a line,
    ``tau = C1 u + C2``: the pressure of one muscle, or of all that pull together; of muscles on
    both sides their difference (:class:`OpposedTorque`).

    Attributes
    ----------
    joints : int
        How many.
    torque : TorqueModel
        C1 and C2.
    pressure_limit : float
        Largest gauge pressure that may be asked for [Pa]; the smallest is 0.
    angle_range : tuple of (float or ndarray, float or ndarray)
        Of the joint [rad], of several one for each.
    """

    torque: TorqueModel
    pressure_limit: float
    angle_range: tuple[Any, Any]

    @property
    @abc.abstractmethod
    def joints(self) -> int:
        """Number of joints."""

    @property
    @abc.abstractmethod
    def parameters(self) -> tuple[MotionParameter, ...]:
        """Parameters in which the torque is linear, in the order of :meth:`regressor`."""

    @property
    def gains(self) -> tuple[Value, ...]:
        """Values that may be arrays of a batch."""
        return tuple(p.value for p in self.parameters)

    def springs(self, angle: Value) -> Value:
        """Torque [N m] that turns the joints against springs across them, ``k (q - q_k)``: taken as
        known, and estimated by no law.
        """
        return 0.0

    @abc.abstractmethod
    def inverse_dynamics(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> Value:
        """Torque [N m] that moves the joints as wanted: ``M(q) a + C(q, q') v + B v + g(q)``, and
        :meth:`springs`.

        Parameters
        ----------
        angle, rate : float or ndarray
            ``q`` and ``q'`` [rad, rad/s].
        wanted_rate, acceleration : float or ndarray
            ``v`` and ``a`` [rad/s, rad/s^2]: those of the motion itself, or of a sliding surface.

        Returns
        -------
        float or ndarray
        """

    @abc.abstractmethod
    def regressor(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> tuple[Value, ...]:
        """``Y``, a column for each of :attr:`parameters`: their sum, each times its parameter, is
        :meth:`inverse_dynamics` less :meth:`springs`.
        """

    def over_joints(self, value: Value) -> Value:
        """Sum over the joints of a plant, in every row of that plant."""
        return value

    def limits(self, angle: Value) -> tuple[Value, Value]:
        """Least and largest drive that may be asked for at an angle [Pa]."""
        return drive_limits(self.torque, angle, self.pressure_limit)

    def pressure(self, torque: Value, angle: Value) -> Value:
        """Drive [Pa] that gives a torque [N m] at an angle [rad], without limits (4.12): with one
        muscle its gauge pressure.
        """
        c1, c2 = self.torque.at(angle)
        return (torque - c2) / c1


@dataclasses.dataclass(frozen=True, eq=False)
class ArmModel(JointModel):
    """Equation of motion (5.4) as a controller has it: ``I theta'' + b theta' + m g r sin(theta) =
    C1(theta) P + C2(theta)``, with ``sin(theta + tilt) + k (theta - theta_k)`` on a tilted base and
    a spring across the joint.

    Attributes
    ----------
    inertia : float or ndarray, shape (n,)
        ``I`` with the payload [kg m2].
    viscous : float or ndarray, shape (n,)
        ``b`` [N m s/rad].
    weight : float or ndarray, shape (n,)
        ``m g r`` with the payload: torque of gravity at 90 deg [N m].
    torque : TorqueModel
        C1 and C2.
    pressure_limit : float
        Largest gauge pressure that may be asked for [Pa]; the smallest is 0.
    angle_range : tuple of (float, float)
        Of the joint [rad].
    tilt : float
        Angle of the centre of mass, payload included, from the direction of gravity where the
        joint's angle is zero [rad].
    spring : tuple of (float, float)
        Stiffness of a spring across the joint [N m/rad], and the angle at which it is at rest
        [rad].
    """

    inertia: Value
    viscous: Value
    weight: Value
    torque: TorqueModel = dataclasses.field(repr=False)
    pressure_limit: float
    angle_range: tuple[float, float]
    tilt: float = 0.0
    spring: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("inertia", "viscous", "weight"):
            object.__setattr__(self, name, as_value(name, getattr(self, name)))
        object.__setattr__(
            self, "pressure_limit", float(positive_gain("pressure_limit", self.pressure_limit))
        )
        rising("angle_range", self.angle_range)
        stiffness, rest = (float(value) for value in self.spring)
        if not (math.isfinite(stiffness) and math.isfinite(rest) and stiffness >= 0.0):
            needed = "a finite stiffness of zero or more [N m/rad] and a finite angle [rad]"
            raise refused("spring", self.spring, needed)
        finite("tilt", self.tilt)

    @classmethod
    def from_rig(
        cls,
        rig: Rig,
        *,
        torque: str | TorqueModel = "full",
        pressure_limit: float | None = None,
        active: Sequence[str] | None = None,
    ) -> ArmModel:
        """The nominal model of a rig with one joint, with its payload.

        Parameters
        ----------
        rig : Rig
            With muscles, joint and a one-link arm; one of several links has a
            :class:`pamrs.control.PlanarArmModel`.
        torque : {"full", "simplified"} or TorqueModel
            Which torque model; of several muscles the full one.
        pressure_limit : float, optional
            [Pa]; by default the initial pressure of the supply, or ``max_pressure`` of ``[limits]``
            where that is less or a regulator feeds the muscles.
        active : sequence of str, optional
            Chambers whose muscles are used; all by default. The others stay without air.

        Returns
        -------
        ArmModel

        Raises
        ------
        ParameterError
            If the rig has not these blocks, there is no such torque model or chamber, the muscles
            cannot raise the joint, or there is nothing to take the limit from.
        """
        names = joints_of(rig)
        if rig.tables("load"):
            raise ParameterError(
                f"rig {rig.name!r} has a [load] instead of [joint] and [arm]: it has a "
                "LoadModel, and a RigModel takes either"
            )
        arm = next(iter(rig.tables("arm").values()))
        if arm["kind"] != "one_link" or len(names) != 1:
            raise ParameterError(
                f"rig {rig.name!r} has an arm of kind {arm['kind']!r} with {len(names)} joints: it "
                "has a PlanarArmModel, and a RigModel takes either"
            )
        joint = rig.tables("joint")[names[0]]
        weight, tilt = _weight(arm)
        return cls(
            inertia=arm["inertia"] + arm["payload"] * arm["length"] ** 2,
            viscous=arm["viscous"],
            weight=weight,
            torque=joint_torque(rig, names[0], torque, active),
            pressure_limit=highest_pressure(rig) if pressure_limit is None else pressure_limit,
            angle_range=(joint["min_angle"], joint["max_angle"]),
            tilt=tilt,
            spring=(joint.get("stiffness", 0.0), joint.get("spring_angle", 0.0)),
        )

    def replace(self, **changes: Any) -> Self:
        """Copy of the model with other attributes."""
        return dataclasses.replace(self, **changes)

    def scaled(self, factor: Value) -> Self:
        """Copy with ``I``, ``b`` and ``m g r`` times a factor: the wrong estimates of 5.4.1, 0.1
        and 10.
        """
        return self.replace(
            inertia=self.inertia * factor,
            viscous=self.viscous * factor,
            weight=self.weight * factor,
        )

    @property
    def joints(self) -> int:
        """1."""
        return 1

    @property
    def parameters(self) -> tuple[MotionParameter, ...]:
        """``I``, ``b`` and ``m g r``."""
        return (
            MotionParameter("inertia", 0, self.inertia),
            MotionParameter("viscous", 1, self.viscous),
            MotionParameter("weight", 2, self.weight),
        )

    def inverse_dynamics(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> Value:
        """``I a + b v + m g r sin(theta + tilt) + k (theta - theta_k)``; see
        :meth:`JointModel.inverse_dynamics`.
        """
        moved = self.inertia * acceleration + self.viscous * wanted_rate
        return moved + self.weight * self.lever(angle) + self.springs(angle)

    def lever(self, angle: Value) -> Value:
        """Factor of :attr:`weight` in the torque of gravity [1]: ``sin(theta + tilt)``."""
        return sin(angle + self.tilt)

    def springs(self, angle: Value) -> Value:
        """``k (theta - theta_k)``; see :meth:`JointModel.springs`."""
        stiffness, rest = self.spring
        return stiffness * (angle - rest) if stiffness else 0.0

    def regressor(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> tuple[Value, ...]:
        """``a``, ``v`` and ``sin(theta + tilt)``; see :meth:`JointModel.regressor`."""
        return acceleration, wanted_rate, self.lever(angle)


def _weight(arm: Mapping[str, Any]) -> tuple[float, float]:
    """Largest torque of gravity [N m], and the angle of all mass from its direction where the
    joint's angle is zero [rad].
    """
    hanging, base = arm["payload"] * arm["length"], arm.get("base_angle", 0.0)
    own = base + arm.get("centre_angle", 0.0)
    level = arm["first_moment"] * math.cos(own) + hanging * math.cos(base)
    side = arm["first_moment"] * math.sin(own) + hanging * math.sin(base)
    if side == 0.0:
        return level * arm["gravity"], 0.0
    return math.hypot(level, side) * arm["gravity"], math.atan2(side, level)
