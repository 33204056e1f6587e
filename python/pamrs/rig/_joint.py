"""A joint on its own: how far a muscle shortens at an angle, and how much torque its pull gives."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike, Mask
from pamrs._checks import as_numbers, doubt_pascals, finite, plain, quantities
from pamrs.rig._muscle import Muscle
from pamrs.rig.schema import SPRING, STOPS


class Joint:
    """A joint that a bundle of muscles turns: four-parameter tendon, constant pulley, or a
    polynomial.

    Every kind but ``published`` conserves power: ``tau dtheta = F dd`` (dissertation ch. 3,
    corrected; section 4 of the physics reference).

    Parameters
    ----------
    kind : {"tendon", "published", "pulley", "polynomial"}
        ``published`` is the tendon joint with the torque as printed in (3.6)-(3.8), too small by
        the square of the cosine of the tendon's angle.
    rest_angle : float
        Joint angle at which the muscles are at rest length [rad].
    upper_axial, upper_offset, lower_axial, lower_offset : float
        ``lu``, ``ru``, ``ll``, ``rl`` of the tendon joint [m] (Table 3.5).
    radius : float
        Of the pulley [m]; negative for a muscle on the other side.
    coefficients : sequence of float
        ``c_k`` of the shortening ``sum_k c_k (theta - rest_angle)^k``, k from 1 [m/rad^k].

    Raises
    ------
    ParameterError
        If a value is not finite or not possible; the message names it.

    Examples
    --------
    >>> import pamrs
    >>> joint = pamrs.Joint(rest_angle=0.26, upper_axial=0.0254, upper_offset=0.0274,
    ...     lower_axial=0.0274, lower_offset=0.0048)
    >>> joint.shortening([0.6, 1.0]).round(4)
    array([0.0071, 0.0168])
    """

    @quantities
    def __init__(
        self,
        *,
        kind: str = "tendon",
        rest_angle: float = 0.0,
        upper_axial: float = 0.0,
        upper_offset: float = 0.0,
        lower_axial: float = 0.0,
        lower_offset: float = 0.0,
        radius: float = 0.0,
        coefficients: Sequence[float] = (),
    ) -> None:
        self._spec: dict[str, Any] = {
            "kind": kind,
            "rest_angle": float(rest_angle),
            "upper_axial": float(upper_axial),
            "upper_offset": float(upper_offset),
            "lower_axial": float(lower_axial),
            "lower_offset": float(lower_offset),
            "radius": float(radius),
            "coefficients": [float(value) for value in coefficients],
        }
        for name, value in self._spec.items():
            for number in value if isinstance(value, list) else [value]:
                if name != "kind":
                    finite(f"joint.{name}", number)
        self._core = _core.Joint(json.dumps(self._spec))

    @classmethod
    def from_model(cls, model: Mapping[str, Any]) -> Joint:
        """The joint of a rig's model.

        Parameters
        ----------
        model : mapping
            ``rig.model["joint"]``; its stops are left out.

        Returns
        -------
        Joint
        """
        return cls(**{key: value for key, value in model.items() if key not in (*STOPS, *SPRING)})

    @property
    def parameters(self) -> dict[str, Any]:
        """Every argument that the joint was made with, SI units (a copy)."""
        return {
            name: list(value) if isinstance(value, list) else value
            for name, value in self._spec.items()
        }

    def shortening(self, angle: ArrayLike) -> Array:
        """Shortening of the muscle [m].

        Parameters
        ----------
        angle : array_like
            Joint angle [rad], any shape.

        Returns
        -------
        ndarray
            In the shape of ``angle``.

        Raises
        ------
        ParameterError
            If an angle is not finite or the tendon is too short for it.
        """
        return self._over(self._core.shortening, angle)

    def moment_arm(self, angle: ArrayLike) -> Array:
        """Rate of shortening per rate of angle, ``dd/dtheta`` [m]; arguments and errors as
        :meth:`shortening`.

        Parameters
        ----------
        angle : array_like
            Joint angle [rad].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.moment_arm, angle)

    def torque_arm(self, angle: ArrayLike) -> Array:
        """Torque per pull [m]: the moment arm, except for ``published``; otherwise as
        :meth:`shortening`.

        Parameters
        ----------
        angle : array_like
            Joint angle [rad].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.torque_arm, angle)

    def reaches(self, angle: ArrayLike) -> Mask:
        """True where the joint can have an angle.

        Parameters
        ----------
        angle : array_like
            Joint angle [rad]; what is not finite is not reached.

        Returns
        -------
        ndarray of bool
        """
        return self._over(self._core.reaches, angle) > 0.5

    def torque(
        self, muscle: Muscle, pressure: ArrayLike, angle: ArrayLike, *, count: int = 1
    ) -> Array:
        """Torque of a bundle of equal muscles [N m].

        Parameters
        ----------
        muscle : Muscle
            One of them.
        pressure : array_like
            Gauge pressure [Pa].
        angle : array_like
            Joint angle [rad]; broadcast against ``pressure``.
        count : int
            Muscles in parallel.

        Returns
        -------
        ndarray
            In the broadcast shape.

        Raises
        ------
        ParameterError
            As :meth:`shortening` and :meth:`pamrs.Muscle.force`.
        """
        pressure = plain("pressure", pressure, "Pa")
        doubt_pascals("pressure", pressure)
        contraction = self.shortening(angle) / float(muscle.parameters["rest_length"])
        return np.asarray(count * muscle.force(pressure, contraction) * self.torque_arm(angle))

    @staticmethod
    def _over(function: Callable[[Array], Array], angle: ArrayLike) -> Array:
        values = as_numbers("angle", plain("angle", angle, "rad"))
        return function(np.ascontiguousarray(values.ravel())).reshape(values.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return Joint.from_model, (self.parameters,)

    def __repr__(self) -> str:
        return (
            f"Joint({self._spec['kind']}, rest_angle={math.degrees(self._spec['rest_angle']):.4g} "
            "deg)"
        )
