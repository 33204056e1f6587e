"""A mass that hangs from muscles as a controller has it, and controllers of its length.

What an angle is to a joint, the *shortening* ``x = L0 - L`` [m] of the muscles is to the mass: it
rises with the pressure, and ``m x'' + c x' + m g = F(P, x)``, with ``F = C1(x) P + C2(x)`` [N] as a
torque is. So every law of one joint holds, with metres and newtons for radians and newton metres.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import ClassVar

from pamrs._checks import positive
from pamrs.control._groups import highest_pressure, joints_of, lengths_of
from pamrs.control._model import ArmModel
from pamrs.control._protocol import Controller, Measurement, Reference, Value
from pamrs.control._sampled import SampledController
from pamrs.control._torque import TorqueModel, joint_torque, rest_length_of
from pamrs.errors import ParameterError
from pamrs.rig import Rig


@dataclasses.dataclass(frozen=True, eq=False)
class LoadModel(ArmModel):
    """Equation of motion of a hanging mass, ``m x'' + c x' + m g = C1(x) P + C2(x)`` over the
    shortening ``x`` of its muscles; dry friction is in no model here.

    Attributes
    ----------
    inertia : float or ndarray, shape (n,)
        The mass ``m`` [kg].
    viscous : float or ndarray, shape (n,)
        ``c`` [N s/m].
    weight : float or ndarray, shape (n,)
        ``m g`` [N].
    torque : TorqueModel
        C1 [N/Pa] and C2 [N] of the muscles' pull.
    pressure_limit : float
        Largest gauge pressure that may be asked for [Pa]; the smallest is 0.
    angle_range : tuple of (float, float)
        Of the shortening [m].
    rest_length : float
        ``L0`` of the muscles [m].
    """

    rest_length: float = dataclasses.field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("rest_length", self.rest_length)

    @classmethod
    def from_rig(
        cls,
        rig: Rig,
        *,
        torque: str | TorqueModel = "full",
        pressure_limit: float | None = None,
        active: Sequence[str] | None = None,
    ) -> LoadModel:
        """The nominal model of a rig with a mass that hangs from its muscles.

        Parameters
        ----------
        rig : Rig
        torque : "full" or TorqueModel
            Pull of the muscles.
        pressure_limit, active
            As for :meth:`pamrs.control.ArmModel.from_rig`.

        Returns
        -------
        LoadModel

        Raises
        ------
        ParameterError
            If no mass hangs from the muscles, or as :meth:`pamrs.control.ArmModel.from_rig`.
        """
        if not rig.tables("load"):
            raise ParameterError(
                f"rig {rig.name!r} has no [load]: an arm has an ArmModel, and a RigModel takes "
                "either"
            )
        (name,), load = joints_of(rig), next(iter(rig.tables("load").values()))
        if isinstance(torque, str) and torque != "full":
            raise ParameterError(
                f"torque = {torque!r} is not allowed for rig {rig.name!r}, where a mass hangs: "
                "'full' is needed, or a model of the pull"
            )
        rest = rest_length_of(rig)
        return cls(
            inertia=load["mass"],
            viscous=load["viscous"],
            weight=load["mass"] * load["gravity"],
            torque=joint_torque(rig, name, torque, active),
            pressure_limit=highest_pressure(rig) if pressure_limit is None else pressure_limit,
            angle_range=(rest - float(load["max_length"]), rest - float(load["min_length"])),
            rest_length=rest,
        )

    def lever(self, angle: Value) -> Value:
        """1: a mass weighs the same everywhere."""
        return 1.0 + 0.0 * angle


def shortened(reference: Reference, rest_length: float) -> Reference:
    """A reference of a length as one of the shortening."""
    return Reference(rest_length - reference.angle, -reference.rate, -reference.acceleration)


class ByLength(SampledController):
    """A controller of a joint's angle, made to follow the length of the muscles that lift a mass.

    The controller is given the shortening ``L0 - L`` [m] and its rate for angle and rate, of what
    is measured and of the reference, whose ``angle`` is then a length [m]. Its gains are per metre.
    A :class:`pamrs.control.RigController` does so by itself.

    Parameters
    ----------
    controller : Controller
        It answers valve volts or a pressure: a PID, a cascade, a feedforward with a
        :class:`LoadModel`.
    rig : Rig
        The rig that it knows, for the muscles' length at rest.

    Raises
    ------
    ParameterError
        If the controller answers every input of a rig, or no mass hangs in the rig.

    Examples
    --------
    >>> import pamrs
    >>> from pamrs.control import PID, ByLength, closed_loop
    >>> from pamrs.control.trajectories import step
    >>> rig = pamrs.rigs.named("hanging_mass")
    >>> lift = ByLength(PID(200.0, 100.0, period=0.005), rig)
    >>> run = closed_loop(rig, lift, step(0.27, 0.25, duration=4.0))
    >>> bool(abs(run.error[-1]) < 0.0005)
    True
    """

    #: Channels that are tracked.
    tracked: ClassVar[tuple[str, ...]] = ("length",)
    _PARTS: ClassVar[tuple[str, ...]] = ("controller",)

    def __init__(self, controller: Controller, rig: Rig) -> None:
        if controller.answers == "inputs":
            raise ParameterError(
                f"controller is a {type(controller).__name__}, which answers every input of a rig: "
                "it follows a length by itself where its rig has one"
            )
        joints_of(rig)
        self.rest_length, self.controller = rest_length_of(rig), controller
        #: Shortest and longest length that the mass can have [m].
        self.lengths = lengths_of(rig)
        self.answers = controller.answers
        super().__init__(controller.period, parts=(controller,))
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Command or pressure for a sample; see :meth:`pamrs.control.Controller.update`."""
        aim = shortened(self._aim(reference), self.rest_length)
        seen = {
            **measurement,
            "joint_angle": self.rest_length - self._read(measurement, "length"),
        }
        if "length_rate" in measurement:
            seen["joint_rate"] = -self._read(measurement, "length_rate")
        return self.controller.update(time, seen, aim)
