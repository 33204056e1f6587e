"""Hysteresis compensation, the future work of 5.5: model-based laws with the muscle friction that a
diagnosis found.

The effect ``muscle_hysteresis`` (Maxwell slip; Vo-Minh et al., IEEE/ASME Trans. Mechatronics
16, 2011) adds ``(W0 + c P) z`` to the force of each muscle, z from -1 while it contracts to +1
while it lengthens, a memory of the way it moved. At a given memory the torque is still a line in
the pressure, so that every law that inverts ``C1 P + C2`` inverts it with

::

    C1' = C1 + n c z r(theta)        C2' = C2 + n W0 z r(theta)

``r`` the torque arm. The static effect ``activation_pressure`` shifts the line, ``C2' - C1' p_th``.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np

from pamrs._checks import one_of, positive
from pamrs.control._protocol import Controller, Measurement, Reference, Value
from pamrs.control._sampled import Restorer, SampledController, Stateful
from pamrs.control._torque import TorqueModel, _parts
from pamrs.control._values import Spline, clip
from pamrs.errors import ParameterError
from pamrs.rig import Rig

_SHARE: Final = (0.125, 0.25, 0.5, 1.0)  # of the presliding distance, by element, as in the core
_LEAST: Final = 0.05  # of C1 without friction that stays in any case


class SlipMemory(Stateful):
    """Memory of a muscle's direction of motion: four Maxwell-slip elements, rate-independent, as
    the core's.

    Parameters
    ----------
    presliding : float
        Distance over which the direction is taken on [m].
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"a": 0.0, "b": 0.0, "c": 0.0, "d": 0.0}

    def __init__(self, presliding: float) -> None:
        positive("presliding", presliding)
        self._distance = tuple(share * presliding for share in _SHARE)
        self.reset()

    _a: Value
    _b: Value
    _c: Value
    _d: Value

    def moved(self, change: Value) -> None:
        """Take note of a change of the muscle's length [m]."""
        d = self._distance
        self._a = clip(self._a + change / d[0], -1.0, 1.0)
        self._b = clip(self._b + change / d[1], -1.0, 1.0)
        self._c = clip(self._c + change / d[2], -1.0, 1.0)
        self._d = clip(self._d + change / d[3], -1.0, 1.0)

    @property
    def mean(self) -> Value:
        """Direction, -1 contracted to +1 lengthened [1]."""
        return (self._a + self._b + self._c + self._d) / 4.0


class HystereticTorque(Stateful):
    """A torque model with the static muscle effects of a rig; its memory is moved by
    :meth:`follow`.

    Parameters
    ----------
    base : TorqueModel
        Without them.
    rig : Rig
        The diagnosed rig, with the effects ``muscle_hysteresis`` or ``activation_pressure``.

    Raises
    ------
    ParameterError
        If the rig has neither, or not one muscle, joint and link.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"shortening": None}
    _PARTS: ClassVar[tuple[str, ...]] = ("memory",)

    def __init__(self, base: TorqueModel, rig: Rig) -> None:
        muscle, joint, table = _parts(rig)
        found = {entry["id"]: entry["parameters"] for entry in rig.effects}
        if not {"muscle_hysteresis", "activation_pressure"} & set(found):
            there = ", ".join(found) or "none"
            raise ParameterError(
                f"rig {rig.name!r} has no muscle_hysteresis and no activation_pressure; its "
                f"effects: {there}"
            )
        friction = found.get(
            "muscle_hysteresis",
            {"friction_constant": 0.0, "friction_pressure": 0.0, "presliding": 1e-3},
        )
        self.base, count = base, int(muscle.parameters["count"])
        self._constant = count * float(friction["friction_constant"])
        self._by_pressure = count * float(friction["friction_pressure"])
        self._threshold = float(found.get("activation_pressure", {"threshold": 0.0})["threshold"])
        low, high = float(table["min_angle"]), float(table["max_angle"])
        angle = np.linspace(low, high, 1025)
        self._travel = Spline(low, high, joint.shortening(angle))
        self._arm = Spline(low, high, joint.torque_arm(angle))
        self.memory = SlipMemory(float(friction["presliding"]))
        self.reset()

    _shortening: Value | None

    def follow(self, angle: Value) -> None:
        """Move the memory to an angle [rad]."""
        # the arm sinks a little into its stops, and the muscle moves with it
        inside = clip(angle, self._travel.low, self._travel.high)
        last = self._shortening
        self._shortening = self._travel(inside) + self._travel.slope(inside) * (angle - inside)
        if last is not None:
            self.memory.moved(last - self._shortening)

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1'`` [N m/Pa] and ``C2'`` [N m] at an angle [rad] with the present memory."""
        c1, c2 = self.base.at(angle)
        arm = self.memory.mean * self._arm(angle)
        slope = c1 + self._by_pressure * arm
        least = _LEAST * c1
        slope = (
            (slope if slope > least else least)
            if slope.__class__ is float
            else np.maximum(slope, least)
        )
        return slope, c2 + self._constant * arm - slope * self._threshold


class HysteresisCompensation(SampledController):
    """A feedforward, sliding, adaptive or neural controller that knows the hysteresis of the
    diagnosed rig.

    Parameters
    ----------
    controller : Controller
        One with a model of the arm (``arm``), in a :class:`pamrs.control.Cascade` or
        :class:`pamrs.control.Parallel` or by itself. It is copied, not changed.
    rig : Rig
        The diagnosed rig.
    source : {"desired", "measured"}
        Angle that moves the memory: the desired one is free of noise and turns when the arm should,
        the measured one is what the muscle does. The networks of :class:`pamrs.control.Neural`
        learn what they use, and are not wrapped.

    Raises
    ------
    ParameterError
        If no part of the controller has a model, or as :class:`HystereticTorque`.
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("torque", "controller")

    def __init__(self, controller: Controller, rig: Rig, *, source: str = "desired") -> None:
        one_of("source", source, ("desired", "measured"))
        self.source = source
        self.controller: Any = copy.deepcopy(controller)
        owner = _owner(self.controller)
        if owner is None:
            raise ParameterError(
                f"controller is a {type(controller).__name__} without a model that is inverted: "
                "nothing to compensate"
            )
        self.torque = HystereticTorque(owner.arm.torque, rig)
        owner.arm = owner.arm.replace(torque=self.torque)
        super().__init__(controller.period, parts=(self.controller,))
        self._before = Restorer(self.torque)
        self.answers = controller.answers
        self.null = getattr(controller, "null", None)
        self.reset()

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Command of the controller, after the memory has moved to the sample's angle; see
        :meth:`pamrs.control.Controller.update`.
        """
        angle = (
            self._aim(reference).angle
            if self.source == "desired"
            else self._read(measurement, "joint_angle")
        )
        before = self._before.take()
        self.torque.follow(angle)
        try:
            answer: Value = self.controller.update(time, measurement, reference)
        except ParameterError as error:
            # a refused sample has not moved the muscle either
            self._before.put_back(before)
            raise self._refusal(str(error)) from None
        self._batch = self._size
        return answer


def _owner(controller: Any) -> Any:
    """The part of a controller whose ``arm`` is inverted at every sample, or None."""
    from pamrs.control._neural import Neural

    for part in (
        controller,
        *(getattr(controller, name, None) for name in ("outer", "feedforward", "controller")),
    ):
        if getattr(part, "arm", None) is not None and not isinstance(part, Neural):
            return part
    return None
