"""A planar arm of several joints as a controller has it.

The arm's equation is linear in its parameters. In the directions of the links ``phi_i = q_1 + ... +
q_i`` it reads (Spong, Hutchinson & Vidyasagar, *Robot Modeling and Control*, ch. 7)

::

    tau_i = sum_j A_ij (cos(phi_i - phi_j) phi_j'' + sin(phi_i - phi_j) phi_j'^2) + B_i g sin(phi_i)

and the torque of a joint is the sum of those on its link and all beyond. With the rate of a sliding
surface instead of one of the two in ``phi_j'^2`` the matrix ``H' - 2 C`` stays skew (Slotine & Li,
Applied Nonlinear Control, 1991, 9.1).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import finite, refused
from pamrs.control._groups import highest_pressure, joints_of
from pamrs.control._model import JointModel, MotionParameter
from pamrs.control._protocol import Value
from pamrs.control._torque import TorqueModel, drive_limits, joint_torque
from pamrs.control._values import positive_gain
from pamrs.errors import ParameterError
from pamrs.rig import Rig


class JointTorques:
    """The torque models of several joints as one, over rows as :class:`JointModel` has them.

    Parameters
    ----------
    torques : sequence of TorqueModel
        One for each joint, base first.
    """

    def __init__(self, torques: Sequence[TorqueModel]) -> None:
        self.torques = tuple(torques)

    def of_each(self, angle: Value) -> list[Value]:
        """The angles of each joint: floats of one plant, arrays (n,) of a batch."""
        rows = np.asarray(angle).reshape(len(self.torques), -1)
        return rows[:, 0].tolist() if rows.shape[1] == 1 else list(rows)

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` [N m] at angles [rad]."""
        each = [torque.at(q) for torque, q in zip(self.torques, self.of_each(angle), strict=True)]
        return _rows([c1 for c1, _ in each], angle), _rows([c2 for _, c2 in each], angle)

    def limits(self, angle: Value, pressure_limit: float) -> tuple[Value, Value]:
        """Least and largest drive at angles [Pa]."""
        each = [
            drive_limits(torque, q, pressure_limit)
            for torque, q in zip(self.torques, self.of_each(angle), strict=True)
        ]
        return _rows([low for low, _ in each], angle), _rows([high for _, high in each], angle)


def _rows(values: Sequence[Value], like: Value) -> Array:
    """Values of each joint as rows, in the shape of the angles."""
    n = np.size(like) // len(values)
    return np.concatenate([np.broadcast_to(value, n) for value in values])


@dataclasses.dataclass(frozen=True, eq=False)
class PlanarArmModel(JointModel):
    """Equation of motion of a planar arm, ``M(q) q'' + C(q, q') q' + B q' + g(q) = C1 u + C2``; see
    :class:`JointModel` for its rows.

    Attributes
    ----------
    names : tuple of str
        Of the joints, base first.
    coupling : ndarray, shape (J, J)
        ``A``: inertia of each link with what hangs from it, and ``l_i B_j`` for i < j [kg m2].
    weight : ndarray, shape (J,)
        ``B_i g``: torque of gravity on each link when it is level [N m].
    viscous : ndarray, shape (J,)
        Of each joint [N m s/rad].
    torque : TorqueModel
        C1 and C2 of every joint.
    pressure_limit : float
        Largest gauge pressure that may be asked for [Pa].
    angle_range : tuple of (ndarray, ndarray), shape (J,)
        Of the joints [rad].
    tilt : float
        Angle of the first link from the direction of gravity where its joint's angle is zero [rad].
    spring : tuple of (ndarray, ndarray), shape (J,)
        Stiffness of springs across the joints [N m/rad], and the angles at which they are at rest
        [rad]; none where left out.
    """

    names: tuple[str, ...]
    coupling: Array
    weight: Array
    viscous: Array
    torque: TorqueModel = dataclasses.field(repr=False)
    pressure_limit: float
    angle_range: tuple[Array, Array]
    tilt: float = 0.0
    spring: tuple[Array, Array] | None = None

    def __post_init__(self) -> None:
        n = len(self.names)
        shapes = {"coupling": (n, n), "weight": (n,), "viscous": (n,)}
        for name, shape in shapes.items():
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ParameterError(
                    f"{name} of shape {value.shape} is not allowed: finite numbers of shape "
                    f"{shape} are needed for the joints {', '.join(self.names)}"
                )
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        finite("tilt", self.tilt)
        if self.spring is not None:
            stiffness, rest = (np.array(part, dtype=np.float64) for part in self.spring)
            both = np.concatenate([stiffness.ravel(), rest.ravel()])
            right = stiffness.shape == rest.shape == (n,) and bool(np.all(np.isfinite(both)))
            if not (right and np.all(stiffness >= 0.0)):
                needed = "finite stiffnesses of zero or more and finite angles are needed for the "
                raise refused("spring", self.spring, f"{needed}joints {', '.join(self.names)}")
            stiffness.flags.writeable = rest.flags.writeable = False
            object.__setattr__(self, "spring", (stiffness, rest))
        object.__setattr__(
            self, "pressure_limit", float(positive_gain("pressure_limit", self.pressure_limit))
        )

    @classmethod
    def from_rig(
        cls,
        rig: Rig,
        *,
        pressure_limit: float | None = None,
        active: Sequence[str] | None = None,
    ) -> PlanarArmModel:
        """The nominal model of a rig with an arm of several links, with its payloads.

        Parameters
        ----------
        rig : Rig
        pressure_limit, active
            As for :meth:`pamrs.control.ArmModel.from_rig`.

        Returns
        -------
        PlanarArmModel

        Raises
        ------
        ParameterError
            As :meth:`pamrs.control.ArmModel.from_rig`.
        """
        names = joints_of(rig)
        links, tables = list(rig.tables("link").values()), rig.tables("joint")
        if not links:
            raise ParameterError(f"rig {rig.name!r} has no [link]: it has an ArmModel")
        coupling, moment = _assembled(links)
        arm = next(iter(rig.tables("arm").values()))
        least, most = (
            np.array([float(tables[name][end]) for name in names])
            for end in ("min_angle", "max_angle")
        )
        stiffness, at = (
            np.array([float(tables[name].get(key, 0.0)) for name in names])
            for key in ("stiffness", "spring_angle")
        )
        return cls(
            names,
            coupling,
            moment * float(arm["gravity"]),
            np.array([float(link["viscous"]) for link in links]),
            JointTorques([joint_torque(rig, name, "full", active) for name in names]),
            highest_pressure(rig) if pressure_limit is None else pressure_limit,
            (least, most),
            float(arm.get("base_angle", 0.0)),
            (stiffness, at) if np.any(stiffness) else None,
        )

    def replace(self, **changes: Any) -> PlanarArmModel:
        """Copy of the model with other attributes."""
        return dataclasses.replace(self, **changes)

    def scaled(self, factor: float) -> PlanarArmModel:
        """Copy with inertias, friction and weights times a factor."""
        return self.replace(
            coupling=self.coupling * factor,
            weight=self.weight * factor,
            viscous=self.viscous * factor,
        )

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.names)

    @property
    def gains(self) -> tuple[Value, ...]:
        """Values that may be arrays of a batch: none."""
        return ()

    @property
    def parameters(self) -> tuple[MotionParameter, ...]:
        """``A_ii`` and ``A_ij``, ``b_i``, ``B_i g``."""
        names, n = self.names, len(self.names)
        return (
            *(
                MotionParameter(f"inertia_{names[i]}", 0, float(self.coupling[i, i]))
                for i in range(n)
            ),
            *(
                MotionParameter(f"inertia_{names[i]}_{names[j]}", 0, float(self.coupling[i, j]))
                for i in range(n)
                for j in range(i + 1, n)
            ),
            *(MotionParameter(f"viscous_{names[i]}", 1, float(self.viscous[i])) for i in range(n)),
            *(MotionParameter(f"weight_{names[i]}", 2, float(self.weight[i])) for i in range(n)),
        )

    def over_joints(self, value: Value) -> Value:
        """Sum over the joints of a plant, in every row of that plant."""
        rows = np.asarray(value).reshape(self.joints, -1)
        return np.tile(rows.sum(axis=0), self.joints)

    def rows(self, value: Sequence[Value], plants: int = 1) -> Array:
        """A gain for each joint as rows of a batch of plants.

        Parameters
        ----------
        value : sequence of float or ndarray, shape (n,)
            One for each joint, base first.
        plants : int
            n.

        Returns
        -------
        ndarray, shape (J n,)

        Raises
        ------
        ParameterError
            If there is not one for each joint.
        """
        if len(value) != self.joints:
            raise ParameterError(
                f"value has {len(value)} entries: one for each of {', '.join(self.names)} is needed"
            )
        return _rows(list(value), np.empty(self.joints * plants))

    def inverse_dynamics(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> Value:
        """See :meth:`JointModel.inverse_dynamics`."""
        columns = self.regressor(angle, rate, wanted_rate, acceleration)
        total: Value = 0.0
        for parameter, column in zip(self.parameters, columns, strict=True):
            total = total + parameter.value * column
        return total + self.springs(angle)

    def springs(self, angle: Value) -> Value:
        """See :meth:`JointModel.springs`."""
        if self.spring is None:
            return 0.0
        stiffness, rest = (np.asarray(values)[:, None] for values in self.spring)
        turned = np.asarray(angle).reshape(self.joints, -1) - rest
        return np.asarray(stiffness * turned).reshape(np.shape(angle))

    def regressor(
        self, angle: Value, rate: Value, wanted_rate: Value, acceleration: Value
    ) -> tuple[Value, ...]:
        """See :meth:`JointModel.regressor`."""
        n = self.joints
        shape = np.shape(angle)

        def directions(value: Value) -> Array:
            return np.cumsum(np.broadcast_to(value, shape).reshape(n, -1), axis=0)

        phi, turn = directions(angle) + self.tilt, directions(rate)
        wanted, push = directions(wanted_rate), directions(acceleration)
        sine, cosine = np.sin(phi), np.cos(phi)
        still = np.zeros_like(phi)

        def on_links(torques: dict[int, Array]) -> Array:
            links = still.copy()
            for link, torque in torques.items():
                links[link] = torque
            return np.cumsum(links[::-1], axis=0)[::-1].reshape(shape)

        columns = [on_links({i: push[i]}) for i in range(n)]
        for i in range(n):
            for j in range(i + 1, n):
                c = cosine[i] * cosine[j] + sine[i] * sine[j]
                s = sine[i] * cosine[j] - cosine[i] * sine[j]
                on_i = c * push[j] + s * turn[j] * wanted[j]
                on_j = c * push[i] - s * turn[i] * wanted[i]
                columns.append(on_links({i: on_i, j: on_j}))
        own = np.broadcast_to(wanted_rate, shape).reshape(n, -1)
        for i in range(n):
            friction = still.copy()
            friction[i] = own[i]
            columns.append(friction.reshape(shape))
        columns += [on_links({i: sine[i]}) for i in range(n)]
        return tuple(columns)


def _assembled(links: Sequence[dict[str, Any]]) -> tuple[Array, Array]:
    """``A`` [kg m2] and ``B`` [kg m] of links in series, base first."""
    n = len(links)
    coupling, moment, beyond = np.zeros((n, n)), np.zeros(n), 0.0
    for i in reversed(range(n)):
        link = links[i]
        carried = float(link["payload"]) + beyond
        length, mass, centre = (float(link[key]) for key in ("length", "mass", "centre"))
        coupling[i, i] = float(link["inertia"]) + mass * centre**2 + carried * length**2
        moment[i] = mass * centre + carried * length
        coupling[i, i + 1 :] = coupling[i + 1 :, i] = length * moment[i + 1 :]
        beyond = carried + mass
    return coupling, moment
