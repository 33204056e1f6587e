"""One pneumatic artificial muscle: geometry and force, exact, over arrays; and force laws given as
a table or a function.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike, Mask
from pamrs._checks import (
    as_numbers,
    checked_number,
    contraction_of,
    doubt,
    doubt_pascals,
    finite,
    matched,
    plain,
    positive,
    quantities,
    refused,
    rising,
)
from pamrs.errors import ParameterError
from pamrs.rig.muscle_models import PARAMETERS, own_geometry
from pamrs.rig.schema import keys_of

_LISTS = (
    *("modulus_slope", "modulus_offset", "extension_factors"),
    *("map_pressure", "map_contraction", "map_force"),
)
"""Parameters of several numbers."""
_FRICTION = ("friction_coefficient", "friction_pressure_slope", "friction_floor")


class Muscle:
    """A braided muscle with one of the quasi-static force models of the dissertation (ch. 2 to 4),
    or with a table of forces.

    Every model but ``map`` is ``F = P gas_area(e) + elastic_scale sum_j (slope_j P + offset_j)
    elastic_basis(e)[j]``. A ``map`` is ``F = modulus_scale map(P, e)``, interpolated monotonically;
    the geometry then gives the volume alone. :meth:`from_law` and
    :func:`pamrs.fit.fit_map` make one.

    Parameters
    ----------
    rest_length, rest_diameter : float
        Length and outer diameter at rest [m].
    braid_angle : float
        Angle of the braid from the circumferential plane at rest [rad].
    wall_thickness : float
        Bladder thickness at rest [m].
    model : str
        ``gaylord``, ``chou_hannaford``, ``mooney_rivlin``, ``ferraresi`` (2.8), ``kothera`` (2.16),
        ``robinson`` (2.16 on elliptic ends), ``elbow_linear`` (4.4)-(4.7) or ``map``.
    geometry : {"cylinder", "elliptic", "elliptic_published"}, optional
        Shape of the ends; by default that of the model's source: elliptic for ``robinson``, else
        cylinder.
    modulus_slope, modulus_offset : sequence of float
        ``m_k`` [1] and ``b_k`` [Pa] of the moduli ``E_k = m_k P + b_k``, from order 1 on
        (``ferraresi``, ``kothera``, ``robinson``). Moduli that rise with pressure are a fit, not an
        energy: as a pump (full of air at 3 bar, drawn out from 26.5 % to rest, let go, back) the
        shoulder's muscle gives 126 J of gas work for 98 J at the rod.
    c10, c01 : float
        Mooney-Rivlin constants [Pa] (``mooney_rivlin``).
    bladder_modulus : float
        ``E_R`` [Pa] (``elbow_linear``).
    extension_factors : sequence of float
        Factors on the wall's pressure, on FL and on FT while the muscle lengthens [1]
        (``elbow_linear``).
    map_pressure, map_contraction, map_force : sequence of float
        Gauge pressures [Pa] and contractions [1] of a table, rising, and its forces [N], a row over
        the contractions for each pressure, one after the other (``map``). Beyond them the force
        goes on along straight lines.
    friction_coefficient, friction_pressure_slope, friction_floor : float
        ``c_F = max(coefficient + slope P, floor)`` of the friction hysteresis (2.36) [1, 1/Pa, 1];
        all zero: none.
    friction_presliding : float
        Motion over which the force goes from one branch of the hysteresis to the other in a
        simulation [m].
    buckling_load : float
        The most that one muscle pushes in a rig, where it bows out [N]; 0: it goes slack, 1e9: it
        pushes like a strut, without end. The methods here are those of a muscle that is held
        straight.
    count : int
        Muscles in parallel in a rig; the methods here are those of one muscle.
    modulus_scale : float
        Factor on every elastic parameter, of a ``map`` on its force [1].
    softening : float
        Relative loss of every modulus per kelvin above ``reference_temperature`` [1/K], of every
        model but ``map``.
    temperature, reference_temperature : float
        Of the muscle, and at which its moduli hold [K].
    k0, contraction_slope, extension_slope, neck_floor : float
        Axis ratio of the elliptic ends at rest, its slopes per unit contraction, and the smallest
        radius in extension relative to rest [1].

    Raises
    ------
    ParameterError
        If a value is not finite or not possible, or the model has no such parameter; the message
        names it.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> muscle = pamrs.rigs.shoulder().muscle
    >>> muscle.force(4e5, [0.0, 0.1]).round(1)
    array([3351. , 1289.6])
    >>> muscle.force(4e5, length=[0.276, 0.2484]).round(1)
    array([3351. , 1289.6])
    >>> muscle.replace(model="gaylord").force(4e5, [0.1]).round(1)
    array([3100.6])
    """

    @quantities
    def __init__(
        self,
        *,
        rest_length: float,
        rest_diameter: float,
        braid_angle: float,
        wall_thickness: float,
        model: str = "robinson",
        geometry: str | None = None,
        modulus_slope: Sequence[float] = (),
        modulus_offset: Sequence[float] = (),
        c10: float = 0.0,
        c01: float = 0.0,
        bladder_modulus: float = 0.0,
        extension_factors: Sequence[float] = (0.3, 0.8, 0.8),
        map_pressure: Sequence[float] = (),
        map_contraction: Sequence[float] = (),
        map_force: Sequence[float] = (),
        friction_coefficient: float = 0.0,
        friction_pressure_slope: float = 0.0,
        friction_floor: float = 0.0,
        friction_presliding: float = 1e-3,
        buckling_load: float = 0.0,
        count: int = 1,
        modulus_scale: float = 1.0,
        softening: float = 0.0,
        temperature: float = 293.15,
        reference_temperature: float = 293.15,
        k0: float = 1.64,
        contraction_slope: float = 2.405,
        extension_slope: float = 6.105,
        neck_floor: float = 0.80,
    ) -> None:
        given = dict(locals())  # first of all: every argument is a parameter, and nothing else
        del given["self"]
        lists = {name: [float(v) for v in given[name]] for name in _LISTS}
        shape = own_geometry(model) if geometry is None else geometry
        self._model: dict[str, Any] = given | lists | {"geometry": shape}
        for key in keys_of("muscle", self._model):
            label, value = f"muscle.{key.name}", self._model[key.name]
            if key.kind == "scalar":
                checked_number(label, value, key.lower, key.upper, key.unit)
            for entry in value if key.kind == "vector" else ():
                finite(label, entry)
        if len(self._model["extension_factors"]) != 3:
            raise refused(
                "muscle.extension_factors", list(extension_factors), "three numbers are needed"
            )
        self._core = _core.Muscle(json.dumps(self._model, default=float))

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
        return cls(**model)

    @classmethod
    @quantities
    def from_law(
        cls,
        law: Callable[[Array, Array], ArrayLike],
        *,
        max_pressure: float,
        contraction: tuple[float, float],
        min_pressure: float = 0.0,
        tolerance: float = 1e-3,
        **parameters: Any,
    ) -> Muscle:
        """A muscle by a force law of one's own, compiled to a table.

        Parameters
        ----------
        law : callable
            ``law(pressure, contraction)`` is the pulling force [N] at gauge pressures [Pa] and
            contraction ratios [1], arrays of one shape. It is asked while the table is made and
            never again.
        max_pressure, min_pressure : float
            Range of the gauge pressure [Pa].
        contraction : tuple of float
            Range of the contraction ratio [1].
        tolerance : float
            Largest error of the table between its nodes, as a share of the largest force.
        **parameters
            What else :class:`Muscle` takes: the geometry, which gives the volume, and friction.

        Returns
        -------
        Muscle
            With the model ``map``.

        Raises
        ------
        ParameterError
            If the law gives no finite force somewhere or no array of the shape asked for, a range
            is empty, or no table of 200 by 400 nodes is as near as `tolerance`.

        Examples
        --------
        >>> import pamrs
        >>> muscle = pamrs.Muscle.from_law(
        ...     lambda p, e: 1.2e-3 * p * (1.0 - 3.1 * e) ** 2 - 40.0 * e,
        ...     max_pressure=6e5, contraction=(-0.02, 0.3), rest_length=0.25,
        ...     rest_diameter=0.02, braid_angle=1.2, wall_thickness=0.0015)
        >>> muscle.force(4e5, [0.0, 0.1]).round(0)
        array([480., 225.])
        """
        table = compiled_law(law, (min_pressure, max_pressure), contraction, tolerance)
        return cls(model="map", **table, **parameters)

    @property
    def has_friction(self) -> bool:
        """True where a friction law is given."""
        return any(self.parameters[name] for name in _FRICTION)

    def without_friction(self) -> Muscle:
        """Copy of the muscle without friction."""
        return self.replace(**dict.fromkeys(_FRICTION, 0.0))

    def replace(self, **changes: Any) -> Muscle:
        """Copy of the muscle with other parameters.

        Parameters
        ----------
        **changes
            Parameters of :class:`Muscle`. With another ``model`` the elastic parameters that it
            does not have are left out, and the geometry becomes the model's own unless one is
            given.

        Returns
        -------
        Muscle

        Raises
        ------
        ParameterError
            As for :class:`Muscle`, and for a parameter that there is not.
        """
        unknown = [name for name in changes if name not in self._model]
        if unknown:
            raise ParameterError(
                f"muscle.{unknown[0]} is not a parameter: {', '.join(self._model)}"
            )
        parameters = self.parameters
        model = str(changes.get("model", self.model))
        if model != self.model:
            parameters["geometry"] = None
            kept = PARAMETERS.get(model, ())
            for name in {name for names in PARAMETERS.values() for name in names}.difference(kept):
                parameters.pop(name)
            if "modulus_slope" in kept and not parameters["modulus_slope"]:
                parameters["modulus_slope"] = parameters["modulus_offset"] = [0.0]
        return Muscle(**{**parameters, **changes})

    @property
    def model(self) -> str:
        """Name of the force model."""
        return str(self._model["model"])

    @property
    def geometry(self) -> str:
        """Name of the outer profile."""
        return str(self._model["geometry"])

    @property
    def parameters(self) -> dict[str, Any]:
        """Every argument that the muscle was made with, SI units (a copy)."""
        return {
            name: list(value) if isinstance(value, list) else value
            for name, value in self._model.items()
        }

    @property
    def elastic_scale(self) -> float:
        """Factor on every modulus at the muscle's temperature, ``modulus_scale`` included [1]."""
        own = self._model
        warmer = float(own["temperature"]) - float(own["reference_temperature"])
        return float(own["modulus_scale"]) * (1.0 - float(own["softening"]) * warmer)

    @property
    def fibre_length(self) -> float:
        """Length ``B`` of one braid fibre [m]."""
        return self._core.braid[0]

    @property
    def turns(self) -> float:
        """Turns ``N`` of one braid fibre [1]."""
        return self._core.braid[1]

    @property
    def bladder_volume(self) -> float:
        """Volume ``VB`` of the rubber [m3]."""
        return self._core.braid[2]

    @property
    def contraction_limits(self) -> tuple[float, float]:
        """Contraction ratios at which the muscle is as long as its fibre, and 0.58 of that [1]."""
        return self._core.contraction_limits

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
        """Wall thickness [m]; arguments and errors as :meth:`radius`.

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.thickness, contraction)

    def air_volume(self, contraction: ArrayLike) -> Array:
        """Air volume of one muscle [m3]; arguments and errors as :meth:`radius`.

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.air_volume, contraction)

    def circumferential_strain(self, contraction: ArrayLike) -> Array:
        """Hoop strain of the wall's mid-line, ``(R - t/2)/(R0 - t0/2) - 1`` (2.15) [1]; otherwise
        as :meth:`radius`.

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.circumferential_strain, contraction)

    def braid_taut(self, contraction: ArrayLike) -> Mask:
        """True where the radius has reached its floor in extension; arguments and errors as
        :meth:`radius`.

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1].

        Returns
        -------
        ndarray of bool
        """
        return self._over(self._core.braid_taut, contraction) > 0.5

    def gas_area(self, contraction: ArrayLike) -> Array:
        """Force per gauge pressure without elasticity, while contracting [m2]; otherwise as
        :meth:`radius`.

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1].

        Returns
        -------
        ndarray
        """
        return self._over(self._core.gas_area, contraction)

    def elastic_basis(self, contraction: ArrayLike) -> Array:
        """Force per unit of each elastic parameter of the model, while contracting [m2].

        Parameters
        ----------
        contraction : array_like
            Contraction ratio [1], shape S.

        Returns
        -------
        ndarray
            Shape S + (J,): one column for each order of the stress polynomial, for ``c10`` and
            ``c01``, or for the bladder modulus; none for ``gaylord`` and ``chou_hannaford``.

        Raises
        ------
        ParameterError
            If a contraction ratio is not finite or beyond the braid's limits.
        """
        e = np.asarray(contraction, dtype=np.float64)
        columns = self._core.elastic_basis(np.ascontiguousarray(e.ravel()))
        return columns.reshape(*e.shape, columns.shape[1])

    def force(
        self,
        pressure: ArrayLike,
        contraction: ArrayLike | None = None,
        direction: ArrayLike | None = None,
        *,
        length: ArrayLike | None = None,
    ) -> Array:
        """Pulling force of one muscle [N], exact solve.

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction : array_like, optional
            Contraction ratio ``1 - L/L0`` [1], this or ``length``; broadcast against ``pressure``.
        direction : array_like, optional
            Direction of motion, from -1 (contracting) to +1 (lengthening): adds the friction
            hysteresis and, for ``elbow_linear``, the lengthening branch. None: the contracting
            branch without friction.
        length : array_like, optional
            Length [m].

        Returns
        -------
        ndarray
            Force in the broadcast shape.

        Raises
        ------
        ParameterError
            If a value is not finite, a pressure below vacuum, a contraction beyond the braid's
            limits or a direction outside -1 to 1; if not one of contraction and length is given.

        Warns
        -----
        UnitWarning
            If pressures are so small that bar are meant, or contractions are lengths of the muscle
            at which it could only push.
        """
        return self._forces(self._core.force, pressure, contraction, direction, length)

    @quantities
    def buckled(self, force: ArrayLike) -> Array:
        """Force of one muscle in a rig [N], where it bows out or goes slack when it is pushed.

        Parameters
        ----------
        force : array_like
            What it would be, were the muscle held straight, as :meth:`force` [N].

        Returns
        -------
        ndarray
            A pull as it is, a push as far as ``buckling_load``, in the shape of ``force``.
        """
        (straight,) = matched(force=force)
        held = self._core.buckled(np.ascontiguousarray(straight.ravel()))
        return np.asarray(held.reshape(straight.shape))

    def force_table(
        self,
        pressure: ArrayLike,
        contraction: ArrayLike | None = None,
        direction: ArrayLike | None = None,
        *,
        length: ArrayLike | None = None,
    ) -> Array:
        """Pulling force of one muscle [N] from the compiled table; otherwise as :meth:`force`.

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction : array_like, optional
            Contraction ratio [1], inside :attr:`contraction_range`; broadcast against ``pressure``.
        direction, length : array_like, optional
            As for :meth:`force`.

        Returns
        -------
        ndarray
            Force in the broadcast shape.
        """
        return self._forces(self._core.force_table, pressure, contraction, direction, length)

    @staticmethod
    def _over(function: Callable[[Array], Array], contraction: ArrayLike) -> Array:
        e = as_numbers("contraction", plain("contraction", contraction, "1"))
        return function(np.ascontiguousarray(e.ravel())).reshape(e.shape)

    def _forces(
        self,
        function: Callable[[Array, Array, Array | None], Array],
        pressure: ArrayLike,
        contraction: ArrayLike | None,
        direction: ArrayLike | None,
        length: ArrayLike | None,
    ) -> Array:
        rest = float(self._model["rest_length"])
        contraction = contraction_of(contraction, length, rest)
        given = {"pressure": plain("pressure", pressure, "Pa"), "contraction": contraction}
        given |= {} if direction is None else {"direction": direction}
        arrays = matched(**given)
        flat = [np.ascontiguousarray(array.ravel()) for array in arrays]
        doubt_pascals("pressure", flat[0], inside=2)
        force = function(flat[0], flat[1], flat[2] if len(flat) > 2 else None)
        low, high = flat[1].min(initial=np.inf), flat[1].max(initial=-np.inf)
        pushes = flat[0].max(initial=0.0) > 0.0 and force.max(initial=-np.inf) < 0.0
        if pushes and 0.5 * rest < low <= high < 1.05 * rest:
            doubt(
                f"contraction = {high:.4g} is a ratio at which the muscle only pushes, and could "
                "be its length in m: 1 - L/L0 is wanted, or length=",
                inside=2,
            )
        return force.reshape(arrays[0].shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return Muscle.from_model, (self.parameters,)

    def __repr__(self) -> str:
        m = self._model
        shape = f"rest_length={m['rest_length']:g} m, rest_diameter={m['rest_diameter']:g} m"
        return f"Muscle({self.model}, {self.geometry}, {shape})"


_FIRST: Final = (9, 13)
_MOST: Final = (200, 400)
_HIGHEST: Final = 1e8  # [Pa]


def force_table(
    pressure: Array, contraction: Array, force: Array
) -> Callable[[Array, Array], Array]:
    """The force of a table as the core interpolates it.

    Parameters
    ----------
    pressure, contraction : (p,), (e,) array
        Its axes [Pa], [1].
    force : (p, e) array
        Its forces [N].

    Returns
    -------
    callable
        Force [N] at gauge pressures [Pa] and contraction ratios [1], arrays of one shape.

    Raises
    ------
    ParameterError
        If it is no table.
    """
    return _core.ForceTable(
        np.ascontiguousarray(pressure), np.ascontiguousarray(contraction), np.ravel(force)
    ).force


def compiled_law(
    law: Callable[[Array, Array], ArrayLike],
    pressure: tuple[float, float],
    contraction: tuple[float, float],
    tolerance: float,
) -> dict[str, Any]:
    """Table of a force law for :meth:`pamrs.Muscle.from_law`, refined to a tolerance."""
    low, high = rising("pressure", pressure, -101_325.0, _HIGHEST, "Pa")
    short, far = rising("contraction", contraction, -1.0, 1.0, "")
    positive("tolerance", tolerance)
    size = list(_FIRST)
    while True:
        axes = np.linspace(low, high, size[0]), np.linspace(short, far, size[1])
        force = _asked(law, *np.meshgrid(*axes, indexing="ij"))
        found = force_table(*axes, force)
        most = max(float(np.max(np.abs(force))), 1e-300)
        wrong = [_between(law, found, axes, axis) / most for axis in (0, 1)]
        if max(wrong) <= tolerance:
            return {
                "map_pressure": axes[0].tolist(),
                "map_contraction": axes[1].tolist(),
                "map_force": force.ravel().tolist(),
            }
        axis = int(wrong[1] > wrong[0])
        if 2 * size[axis] - 1 > _MOST[axis]:
            raise ParameterError(
                f"law: a table of {size[0]} x {size[1]} nodes is {max(wrong):.2g} of the largest "
                f"force away, tolerance = {tolerance:g} is asked for; a jump of the law, perhaps"
            )
        size[axis] = 2 * size[axis] - 1


def _asked(law: Callable[[Array, Array], ArrayLike], pressure: Array, contraction: Array) -> Array:
    """The law at some places."""
    force = np.asarray(law(pressure, contraction), dtype=np.float64)
    if force.shape != pressure.shape:
        raise ParameterError(
            f"law: it gave an array of shape {force.shape} for pressures and contractions of shape "
            f"{pressure.shape}; the same is needed"
        )
    wrong = np.flatnonzero(~np.isfinite(force))
    if len(wrong):
        p, e = pressure.ravel()[wrong[0]], contraction.ravel()[wrong[0]]
        raise ParameterError(f"law: its force at {p:g} Pa and a contraction of {e:g} is not finite")
    return force


def _between(
    law: Callable[[Array, Array], ArrayLike],
    found: Callable[[Array, Array], Array],
    axes: tuple[Array, Array],
    axis: int,
) -> float:
    """Largest error halfway between nodes of one axis, in the middle of the other axis too [N]."""
    places = [np.sort(np.concatenate([a, 0.5 * (a[1:] + a[:-1])])) for a in axes]
    places[axis] = 0.5 * (axes[axis][1:] + axes[axis][:-1])
    pressure, contraction = np.meshgrid(*places, indexing="ij")
    force = _asked(law, pressure, contraction)
    table = found(pressure.ravel(), contraction.ravel()).reshape(force.shape)
    return float(np.max(np.abs(table - force)))
