"""What a model-based controller knows of its arm: inertia, gravity, and the torque of the muscles
as a line in the pressure.

At an angle the torque of every force model is ``tau = C1(theta) P + C2(theta)``: exactly so for the
full model (:class:`FullTorque`, from the core's own muscle and joint), and with cubic C1 and C2 for
the simplified one, (5.1)-(5.3) (:class:`SimplifiedTorque`).
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.control._protocol import Value
from pamrs.control._spline import Spline
from pamrs.control._values import as_value, positive_gain
from pamrs.errors import ParameterError
from pamrs.rig import Joint

if TYPE_CHECKING:
    from pamrs.rig import Muscle, Rig

__all__ = [
    "ArmModel",
    "FullTorque",
    "GaylordTorque",
    "SimplifiedTorque",
    "TorqueModel",
    "torque_line",
]

Array = NDArray[np.float64]

_NODES: Final = (
    1025  # of a table over the joint's range; makes its error some 1e-9 of the largest value
)
_LEAST_SLOPE: Final = 0.01  # of the largest C1: below it a pressure says nothing about the torque
_INCH: Final = 0.0254


class TorqueModel(Protocol):
    """Torque of the muscles at an angle, a line in the gauge pressure."""

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa], above zero, and ``C2`` [N m] at an angle [rad]."""


def _parts(rig: Rig) -> tuple[Muscle, Joint, dict[str, Any]]:
    """Muscle, joint and joint's table of a rig that a controller of one joint can know."""
    for block in ("muscle", "joint", "arm"):
        if len(rig.tables(block)) != 1:
            raise ParameterError(
                f"rig {rig.name!r} has {len(rig.tables(block))} [{block}]: a controller's model "
                "needs exactly one"
            )
    arm = next(iter(rig.tables("arm").values()))
    if arm["kind"] != "one_link":
        raise ParameterError(
            f"rig {rig.name!r} has an arm of kind {arm['kind']!r}: a controller's model needs "
            "one_link"
        )
    name = next(iter(rig.tables("muscle")))
    own = next(iter(rig.tables("joint").values()))
    return rig.muscle_of(name), Joint.from_model(rig.tables("transmission").get(name, own)), own


def _supply_pressure(rig: Rig) -> float:
    supplies = rig.tables("supply")
    if not supplies:
        raise ParameterError(
            f"rig {rig.name!r} has no [supply]: the pressure limit cannot be taken from it"
        )
    return max(float(supply["initial_pressure"]) for supply in supplies.values())


def torque_line(rig: Rig, angle: ArrayLike, *, lengthening: bool = False) -> tuple[Array, Array]:
    """``C1`` and ``C2`` of the full model at angles, exact: the core's muscle in one direction of
    motion, without friction.

    Parameters
    ----------
    rig : Rig
        With one muscle (or bundle), one joint and a one-link arm.
    angle : array_like
        Angles [rad].
    lengthening : bool
        Whether the muscle lengthens: another branch with the model ``elbow_linear``, (4.7).

    Returns
    -------
    tuple of (ndarray, ndarray)
        [N m/Pa] and [N m], in the shape of ``angle``.

    Raises
    ------
    ParameterError
        If the rig has not exactly these blocks, or the joint cannot have an angle.
    """
    muscle, joint, _ = _parts(rig)
    count, pressure = int(muscle.parameters["count"]), 1e6
    smooth = muscle.replace(
        friction_coefficient=0.0, friction_pressure_slope=0.0, friction_floor=0.0
    )
    contraction = joint.shortening(angle) / float(muscle.parameters["rest_length"])
    direction, arm = (1.0 if lengthening else -1.0), joint.torque_arm(angle)
    zero, full = (
        np.asarray(count * smooth.force(p, contraction, direction) * arm) for p in (0.0, pressure)
    )
    return (full - zero) / pressure, zero


class FullTorque:
    """Torque of the full model from tables over the joint's range; beyond it that of its ends.

    Where C1 falls below a hundredth of its largest value (a muscle at the end of its stroke) it is
    held there, so that what would need any pressure asks for the limit.

    Parameters
    ----------
    rig : Rig
        As for :func:`torque_line`.
    lengthening : bool
        As for :func:`torque_line`.

    Attributes
    ----------
    error : float
        Largest error of the tables half way between their places, relative to the largest values
        [1].

    Raises
    ------
    ParameterError
        As :func:`torque_line`.
    """

    def __init__(self, rig: Rig, *, lengthening: bool = False) -> None:
        _, _, table = _parts(rig)
        low, high = float(table["min_angle"]), float(table["max_angle"])
        c1, c2 = torque_line(rig, np.linspace(low, high, _NODES), lengthening=lengthening)
        self._floor = float(_LEAST_SLOPE * c1.max())
        if not self._floor > 0.0:
            raise ParameterError(
                f"rig {rig.name!r}: pressure lowers the torque everywhere, so no pressure can be "
                "asked for"
            )
        self.slope, self.rest = Spline(low, high, c1), Spline(low, high, c2)
        between = 0.5 * (np.linspace(low, high, _NODES)[1:] + np.linspace(low, high, _NODES)[:-1])
        pairs = zip(
            (self.slope(between), self.rest(between)),
            torque_line(rig, between, lengthening=lengthening),
            (c1, c2),
            strict=True,
        )
        self.error = max(
            float(np.abs(table - exact).max() / max(np.abs(values).max(), 1e-300))
            for table, exact, values in pairs
        )

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` [N m] at an angle [rad]."""
        slope, floor = self.slope(angle), self._floor
        if slope.__class__ is float:
            return (slope if slope > floor else floor), self.rest(angle)
        return np.maximum(slope, floor), self.rest(angle)


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
        """By least squares from the full model, over even angles and pressures from zero.

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
            _supply_pressure(rig)
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


class GaylordTorque:
    """The educated guess of (5.25): Gaylord's force on a constant arm,
    ``C1 = n (3 L^2 - B^2)/(4 pi N^2) r_eff``, ``C2 = 0``.

    The length is linear in the angle, ``L = L0 - r_eff (theta - theta_0)``. As printed, L = 5 in
    with B = 11.23 in, the force would be negative (3 L^2 < B^2): the muscle's own rest length is
    taken, and its own B and N, which for the shoulder are 11.33 in and 1.02.

    Parameters
    ----------
    rig : Rig
        As for :func:`torque_line`.
    effective_radius : float
        ``r_eff`` [m]; 0.7 in as printed.

    Raises
    ------
    ParameterError
        As :func:`torque_line`; if the radius is not above zero.
    """

    def __init__(self, rig: Rig, effective_radius: float = 0.7 * _INCH) -> None:
        muscle, joint, table = _parts(rig)
        radius = float(positive_gain("effective_radius", effective_radius))
        gaylord = muscle.replace(model="gaylord")
        low, high = float(table["min_angle"]), float(table["max_angle"])
        angle = np.linspace(low, high, _NODES)
        rest = float(muscle.parameters["rest_length"])
        contraction = np.minimum(
            radius * (angle - float(joint.parameters["rest_angle"])) / rest,
            muscle.contraction_limits[1],
        )
        c1 = int(muscle.parameters["count"]) * gaylord.gas_area(contraction) * radius
        self._slope = Spline(low, high, np.maximum(c1, _LEAST_SLOPE * c1.max()))

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` = 0 at an angle [rad]."""
        return self._slope(angle), 0.0


@dataclasses.dataclass(frozen=True, eq=False)
class ArmModel:
    """Equation of motion (5.4) as a controller has it: ``I theta'' + b theta' + m g r sin(theta) =
    C1(theta) P + C2(theta)``.

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
    """

    inertia: Value
    viscous: Value
    weight: Value
    torque: TorqueModel = dataclasses.field(repr=False)
    pressure_limit: float
    angle_range: tuple[float, float]

    def __post_init__(self) -> None:
        for name in ("inertia", "viscous", "weight"):
            object.__setattr__(self, name, as_value(name, getattr(self, name)))
        object.__setattr__(
            self, "pressure_limit", float(positive_gain("pressure_limit", self.pressure_limit))
        )
        low, high = (float(value) for value in self.angle_range)
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ParameterError(
                f"angle_range = {self.angle_range} is not allowed: two finite angles, the first "
                "below the second"
            )

    @classmethod
    def from_rig(
        cls, rig: Rig, *, torque: str | TorqueModel = "full", pressure_limit: float | None = None
    ) -> ArmModel:
        """The nominal model of a rig, with its payload.

        Parameters
        ----------
        rig : Rig
            As for :func:`torque_line`.
        torque : {"full", "simplified", "gaylord"} or TorqueModel
            Which torque model.
        pressure_limit : float, optional
            [Pa]; by default the initial pressure of the supply.

        Returns
        -------
        ArmModel

        Raises
        ------
        ParameterError
            As :func:`torque_line`; if there is no such torque model or no supply to take the limit
            from.
        """
        _, _, joint = _parts(rig)
        arm = next(iter(rig.tables("arm").values()))
        makers: dict[str, Any] = {
            "full": FullTorque,
            "simplified": SimplifiedTorque.fit,
            "gaylord": GaylordTorque,
        }
        if isinstance(torque, str):
            if torque not in makers:
                raise ParameterError(
                    f"torque = {torque!r} is not allowed: one of {', '.join(makers)}, or a model"
                )
            torque_model: TorqueModel = makers[torque](rig)
        else:
            torque_model = torque
        return cls(
            inertia=arm["inertia"] + arm["payload"] * arm["length"] ** 2,
            viscous=arm["viscous"],
            weight=(arm["first_moment"] + arm["payload"] * arm["length"]) * arm["gravity"],
            torque=torque_model,
            pressure_limit=_supply_pressure(rig) if pressure_limit is None else pressure_limit,
            angle_range=(joint["min_angle"], joint["max_angle"]),
        )

    def replace(self, **changes: Any) -> ArmModel:
        """The same with other attributes."""
        return dataclasses.replace(self, **changes)

    def scaled(self, factor: Value) -> ArmModel:
        """With ``I``, ``b`` and ``m g r`` times a factor: the wrong estimates of 5.4.1, 0.1
        and 10.
        """
        return self.replace(
            inertia=self.inertia * factor,
            viscous=self.viscous * factor,
            weight=self.weight * factor,
        )

    @property
    def gains(self) -> tuple[Value, ...]:
        """Everything that may be an array."""
        return self.inertia, self.viscous, self.weight

    def pressure(self, torque: Value, angle: Value) -> Value:
        """Gauge pressure [Pa] that gives a torque [N m] at an angle [rad], without limits
        (4.12).
        """
        c1, c2 = self.torque.at(angle)
        return (torque - c2) / c1
