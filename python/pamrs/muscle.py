"""One pneumatic artificial muscle: geometry and force, exact, over arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs import _core
from pamrs.errors import ParameterError

__all__ = ["Muscle"]

Array = NDArray[np.float64]


class Muscle:
    """A braided muscle with the ``robinson`` force model (dissertation ch. 2).

    Parameters
    ----------
    rest_length, rest_diameter : float
        Length and outer diameter at rest [m].
    braid_angle : float
        Angle of the braid from the circumferential plane at rest [rad].
    wall_thickness : float
        Bladder thickness at rest [m].
    modulus_slope, modulus_offset : sequence of float
        ``m_k`` [1] and ``b_k`` [Pa] of the moduli ``E_k = m_k P + b_k``, from order 1 on.
    geometry : {"elliptic", "cylinder"}
        Shape of the ends.
    count : int
        Muscles in parallel in a rig; the methods here are those of one muscle.
    modulus_scale : float
        Factor on every modulus [1].
    k0, contraction_slope, extension_slope, neck_floor : float
        Axis ratio of the elliptic ends at rest, its slopes per unit contraction, and the smallest radius in
        extension relative to rest [1].

    Raises
    ------
    ParameterError
        If a value is not finite or not possible; the message names it.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> muscle = pamrs.rigs.shoulder().muscle
    >>> muscle.force(4e5, [0.0, 0.1]).round(1)
    array([3351. , 1289.6])
    """

    def __init__(
        self,
        *,
        rest_length: float,
        rest_diameter: float,
        braid_angle: float,
        wall_thickness: float,
        modulus_slope: Sequence[float],
        modulus_offset: Sequence[float],
        geometry: str = "elliptic",
        count: int = 1,
        modulus_scale: float = 1.0,
        k0: float = 1.64,
        contraction_slope: float = 2.405,
        extension_slope: float = 6.105,
        neck_floor: float = 0.80,
    ) -> None:
        self._model: dict[str, Any] = {
            "model": "robinson",
            "geometry": geometry,
            "count": count,
            "rest_length": rest_length,
            "rest_diameter": rest_diameter,
            "braid_angle": braid_angle,
            "wall_thickness": wall_thickness,
            "modulus_slope": [float(v) for v in modulus_slope],
            "modulus_offset": [float(v) for v in modulus_offset],
            "modulus_scale": modulus_scale,
            "k0": k0,
            "contraction_slope": contraction_slope,
            "extension_slope": extension_slope,
            "neck_floor": neck_floor,
        }
        for name, value in self._model.items():
            entries = value if isinstance(value, list) else [value]
            for entry in entries:
                if isinstance(entry, float) and not np.isfinite(entry):
                    raise ParameterError(f"muscle.{name} = {entry} is not allowed: a finite number is needed")
        self._core = _core.Muscle(json.dumps(self._model))

    @classmethod
    def from_model(cls, model: Mapping[str, Any]) -> Muscle:
        """The muscle of a rig's model.

        Parameters
        ----------
        model : mapping
            ``rig.model["muscle"]``.

        Returns
        -------
        Muscle
        """
        return cls(**{key: value for key, value in model.items() if key != "model"})

    @property
    def contraction_range(self) -> tuple[float, float]:
        """Smallest and largest contraction ratio that the compiled table covers [1]."""
        return self._core.contraction_range

    @property
    def table_error(self) -> float:
        """Largest relative error of the compiled table against the exact solve [1]."""
        return self._core.table_error

    def radius(self, contraction: ArrayLike) -> Array:
        """Outer radius of the middle part [m].

        Parameters
        ----------
        contraction : array_like
            Contraction ratio ``e = 1 - L/L0`` [1], any shape.

        Returns
        -------
        ndarray
            In the shape of ``contraction``.

        Raises
        ------
        ParameterError
            If a contraction ratio is not finite or beyond the braid's limits.
        """
        return self._over(self._core.radius, contraction)

    def thickness(self, contraction: ArrayLike) -> Array:
        """Wall thickness [m].

        Parameters
        ----------
        contraction : array_like
            Contraction ratio ``e = 1 - L/L0`` [1], any shape.

        Returns
        -------
        ndarray
            In the shape of ``contraction``.

        Raises
        ------
        ParameterError
            If a contraction ratio is not finite or beyond the braid's limits.
        """
        return self._over(self._core.thickness, contraction)

    def air_volume(self, contraction: ArrayLike) -> Array:
        """Air volume of one muscle [m3].

        Parameters
        ----------
        contraction : array_like
            Contraction ratio ``e = 1 - L/L0`` [1], any shape.

        Returns
        -------
        ndarray
            In the shape of ``contraction``.

        Raises
        ------
        ParameterError
            If a contraction ratio is not finite or beyond the braid's limits.
        """
        return self._over(self._core.air_volume, contraction)

    def force(self, pressure: ArrayLike, contraction: ArrayLike) -> Array:
        """Pulling force of one muscle [N], exact solve (dissertation (2.16) on the elliptic geometry).

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction : array_like
            Contraction ratio [1]; broadcast against ``pressure``.

        Returns
        -------
        ndarray
            Force in the broadcast shape.

        Raises
        ------
        ParameterError
            If a value is not finite, a pressure below vacuum, or a contraction beyond the braid's limits.
        """
        return self._forces(self._core.force, pressure, contraction)

    def force_table(self, pressure: ArrayLike, contraction: ArrayLike) -> Array:
        """Pulling force of one muscle [N] from the compiled table; otherwise as :meth:`force`.

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction : array_like
            Contraction ratio [1], inside :attr:`contraction_range`; broadcast against ``pressure``.

        Returns
        -------
        ndarray
            Force in the broadcast shape.
        """
        return self._forces(self._core.force_table, pressure, contraction)

    @staticmethod
    def _over(function: Callable[[Array], Array], contraction: ArrayLike) -> Array:
        e = np.asarray(contraction, dtype=np.float64)
        return function(np.ascontiguousarray(e.ravel())).reshape(e.shape)

    @staticmethod
    def _forces(function: Callable[[Array, Array], Array], pressure: ArrayLike, contraction: ArrayLike) -> Array:
        p, e = np.broadcast_arrays(np.asarray(pressure, dtype=np.float64), np.asarray(contraction, dtype=np.float64))
        return function(np.ascontiguousarray(p.ravel()), np.ascontiguousarray(e.ravel())).reshape(p.shape)

    def __repr__(self) -> str:
        m = self._model
        return f"Muscle(rest_length={m['rest_length']:g} m, rest_diameter={m['rest_diameter']:g} m, {m['geometry']})"
