"""Models of a rig for controllers: its arm, the muscles of every joint, the way of their air."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of
from pamrs.control._adaptive import AdaptiveSliding
from pamrs.control._air import AirModel
from pamrs.control._cascade import PressureLoop
from pamrs.control._feedforward import FeedforwardPressure
from pamrs.control._groups import Group, joints_of
from pamrs.control._load import LoadModel
from pamrs.control._model import ArmModel, JointModel
from pamrs.control._neural import Neural
from pamrs.control._planar import PlanarArmModel
from pamrs.control._protocol import Controller
from pamrs.control._sliding import Sliding
from pamrs.control._torque import GroupTorque, TorqueModel, active_groups, group_torques
from pamrs.errors import ParameterError
from pamrs.rig import Rig

_CROSSOVER: Final = 110.0  # 1/s, that of the shoulder's pressure loop with its default gains
_RESET: Final = 1.0  # 1/s, ki/kp of the same
#: I [kg m2] and I/C1 of the shoulder with its payload, at mid-range.
_SHOULDER: Final = (7.9807, 8626.7)
_SHOULDER_RANGE: Final = 1.8326  # rad, between its stops


_LAWS: Final[dict[str, Callable[..., Controller]]] = {
    "feedforward": FeedforwardPressure,
    "sliding": Sliding,
    "adaptive": AdaptiveSliding,
    "neural": Neural,
}


class RigModel:
    """Rig as a model for controllers: its arm, the muscles of every joint, the way of their air.

    Parameters
    ----------
    rig : Rig
        With muscles, joints and an arm, or a mass that hangs from muscles; valves or regulators
        feed the muscles.
    torque, pressure_limit, active
        As for :meth:`pamrs.control.ArmModel.from_rig`.

    Attributes
    ----------
    arm : ArmModel, PlanarArmModel or LoadModel
        For the laws.
    joints : tuple of str
        Names, base first.
    groups : tuple of Group
        Those that are used, in the order of the chambers.
    pressure_limit : float
        [Pa]

    Raises
    ------
    ParameterError
        As :meth:`pamrs.control.ArmModel.from_rig`; if nothing that can be commanded feeds a group.

    Examples
    --------
    >>> import pamrs
    >>> from pamrs.control import RigModel
    >>> model = RigModel(pamrs.rigs.named("two_joint_arm"))
    >>> model.joints, [group.chamber for group in model.groups]
    (('elbow', 'wrist'), ['elbow', 'wrist'])
    """

    def __init__(
        self,
        rig: Rig,
        *,
        torque: Any = "full",
        pressure_limit: float | None = None,
        active: Sequence[str] | None = None,
    ) -> None:
        self.rig, self.joints = rig, joints_of(rig)
        self.groups = active_groups(rig, active)
        self.arm: JointModel = _arm(rig, torque, pressure_limit, active)
        self.pressure_limit = self.arm.pressure_limit
        self.vented = tuple(g for g in active_groups(rig, None) if g not in self.groups)
        self._torques = group_torques(rig, self.groups)

    def of_joint(self, joint: str) -> tuple[Group, ...]:
        """The groups of a joint."""
        return tuple(group for group in self.groups if group.joint == joint)

    def torques_of(self, joint: str) -> tuple[GroupTorque, ...]:
        """The torque of each of them."""
        return tuple(self._torques[group.chamber] for group in self.of_joint(joint))

    def pressure_loop(
        self, chamber: str, *, period: float, crossover: float = _CROSSOVER
    ) -> PressureLoop:
        """A pressure loop for the valve of a chamber, with a gain by the size of valve and volume.

        Parameters
        ----------
        chamber : str
        period : float
            [s]
        crossover : float
            Where the loop crosses over [1/s]; by default that of the shoulder with the gains of
            :class:`pamrs.control.PressureLoop`.

        Returns
        -------
        PressureLoop
        """
        air = AirModel(self.rig, chamber)
        kp = crossover / air.rate_per_volt()
        return PressureLoop(
            kp,
            _RESET * kp,
            period=period,
            limits=(air.null - air.half_range, air.null + air.half_range),
            null=air.null,
        )

    def mobility(self) -> tuple[Array, Array]:
        """Inertia [kg m2] and ``C1`` [N m/Pa] of every joint, in the middle of the joints' ranges.

        Returns
        -------
        tuple of (ndarray, ndarray), shape (J,)
        """
        arm, joints = self.arm, len(self.joints)
        low, high = (np.atleast_1d(end) for end in arm.angle_range)
        middle, still = 0.5 * (low + high), np.zeros(joints)
        held = np.asarray(arm.inverse_dynamics(middle, still, still, still))
        inertia = [
            float((arm.inverse_dynamics(middle, still, still, unit) - held)[k])
            for k, unit in enumerate(np.eye(joints))
        ]
        return np.array(inertia), np.array(np.broadcast_to(arm.torque.at(middle)[0], joints))

    def law(self, kind: str, *, period: float = 1e-3, **changes: Any) -> Controller:
        """A law with the gains that its class has for the shoulder, scaled to this arm: the
        switching term by I/C1 and adaptation by I, so that the loop has the same time constants.

        Parameters
        ----------
        kind : {"feedforward", "sliding", "adaptive", "neural"}
            :class:`FeedforwardPressure`, :class:`Sliding`, :class:`AdaptiveSliding`,
            :class:`Neural`.
        period : float
            [s]
        **changes
            Arguments of the class, instead of those that are scaled.

        Returns
        -------
        Controller

        Raises
        ------
        ParameterError
            If there is no such law, or an argument is not allowed.
        """
        inertia, c1 = self.mobility()
        ease: Any = (inertia / c1) / _SHOULDER[1]
        light = float(inertia.min()) / _SHOULDER[0]
        if len(self.joints) == 1:
            ease = float(ease[0])
        also = ""
        usual: dict[str, dict[str, Any]] = {
            "feedforward": {},
            "sliding": {"switching": 2e4 * ease},
            "adaptive": {
                "switching": 2e4 * ease,
                "gains": (1.0 * light, 5.0 * light, 300.0 * light),
            },
            "neural": {
                "switching": 4e5 * ease,
                "gains": (300.0 * ease, 2e4 * ease, 3e5 * ease),
            },
        }
        if isinstance(self.arm, LoadModel):
            # its stroke is to a mass what the joint's range is to the shoulder
            reach = (self.arm.angle_range[1] - self.arm.angle_range[0]) / _SHOULDER_RANGE
            surface = {"switching": 6e4 * ease * reach, "boundary_layer": 0.2 * reach}
            gains = (light / reach**2, 5.0 * light / reach**2, 300.0 * light)
            usual = {"feedforward": {}, "sliding": surface, "adaptive": {**surface, "gains": gains}}
            also = " for a hanging mass"
        one_of("kind", kind, usual, also=also)
        return _LAWS[kind](self.arm, period=period, **{**usual[kind], **changes})


def _arm(
    rig: Rig,
    torque: str | TorqueModel,
    pressure_limit: float | None,
    active: Sequence[str] | None,
) -> JointModel:
    """The equation of motion of a rig."""
    if rig.tables("load"):
        return LoadModel.from_rig(rig, torque=torque, pressure_limit=pressure_limit, active=active)
    if not rig.tables("link"):
        return ArmModel.from_rig(rig, torque=torque, pressure_limit=pressure_limit, active=active)
    if torque != "full":
        raise ParameterError(
            f"torque = {torque!r} is not allowed for rig {rig.name!r}, which has several joints: "
            "'full' is needed"
        )
    return PlanarArmModel.from_rig(rig, pressure_limit=pressure_limit, active=active)
