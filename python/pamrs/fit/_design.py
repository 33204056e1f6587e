"""The force of every model as a linear form: gas force plus columns times coefficients.

``F(P, e) = P gas_area(e) + sum_jk w_j(P) x_jk basis_k(e)``: for moduli linear in pressure the
weights ``w`` are ``(P, 1)`` and ``x`` the slopes ``m_k`` and offsets ``b_k``; for constant
coefficients there is one weight, 1; for moduli free at each level the weights are hat functions
over the levels, that is linear interpolation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of, refused, whole
from pamrs.errors import FitError
from pamrs.rig import Muscle
from pamrs.rig.muscle_models import ELASTIC_PARAMETERS, MODELS, POLYNOMIAL_MODELS

#: Coefficients of the models without a stress polynomial.
CONSTANTS: Final[dict[str, tuple[str, ...]]] = {
    model: tuple(name for name in names if name != "extension_factors")
    for model, names in ELASTIC_PARAMETERS.items()
    if model not in POLYNOMIAL_MODELS
}

_DEFAULT_ORDER, _LARGEST_ORDER = 4, 12
_UNIT_MODULUS = 1e6  # [Pa], to read a column off the force


def template(muscle: Muscle, model: str | None, geometry: str | None, order: int | None) -> Muscle:
    """The muscle with the chosen model and every modulus 0.

    Parameters
    ----------
    muscle : Muscle
        Nominal muscle.
    model, geometry : str, optional
        None keeps the muscle's own; another model comes with its own geometry unless one is named.
    order : int, optional
        Order M of the stress polynomial; None takes the number of moduli that the muscle has,
        else 4.

    Returns
    -------
    Muscle

    Raises
    ------
    ParameterError
        If the model is unknown, or the order does not go with it.
    """
    name = muscle.model if model is None else model
    one_of("model", name, MODELS)
    changes: dict[str, Any] = {"model": name}
    if geometry is not None or name != muscle.model:
        changes["geometry"] = geometry
    if name in POLYNOMIAL_MODELS:
        given = muscle.parameters
        own = max(len(given["modulus_slope"]), len(given["modulus_offset"]))
        terms = (own or _DEFAULT_ORDER) if order is None else order
        moduli = [0.0] * whole("order", terms, 1, _LARGEST_ORDER)
        changes |= {"modulus_slope": moduli, "modulus_offset": moduli}
    elif order is not None:
        raise refused("order", order, f"the model {name} has no stress polynomial; leave order out")
    else:
        changes |= dict.fromkeys(CONSTANTS[name], 0.0)
    return muscle.replace(**changes)


@dataclass(frozen=True)
class Design:
    """Coefficients of a fit, and their columns in the design matrix.

    Attributes
    ----------
    base : tuple of str
        Names of the basis functions: ``E1``..., ``c10`` and ``c01``, ``bladder_modulus``, or none.
    per_level : bool
        Coefficients free at each level.
    knots : (g,) array
        Pressures of the levels [Pa]; used when ``per_level``.
    """

    base: tuple[str, ...]
    per_level: bool
    knots: Array

    @classmethod
    def of(cls, muscle: Muscle, moduli: str, knots: Array) -> Design:
        """The design of a template muscle; ``moduli`` is ``"linear"`` or ``"per_level"``."""
        one_of("moduli", moduli, ("linear", "per_level"))
        if muscle.model in POLYNOMIAL_MODELS:
            base = tuple(f"E{k}" for k in range(1, len(muscle.parameters["modulus_offset"]) + 1))
        else:
            base = CONSTANTS[muscle.model]
        return cls(base, moduli == "per_level" and bool(base), knots)

    @property
    def polynomial(self) -> bool:
        """True when the basis is that of a stress polynomial."""
        return self.base[:1] == ("E1",)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coefficients: ``m1.. b1..``, the model's own, or ``E1_100kPa`` when free at
        each level.
        """
        if self.per_level:
            knots = self.knots / 1e3
            decimals = next(  # as many as tell them apart: 343.8kPa
                d for d in range(1, 20) if len(set(np.round(knots, d).tolist())) == len(knots)
            )
            levels = [f"{round(pressure, decimals):.12g}kPa" for pressure in knots.tolist()]
            return tuple(f"{name}_{level}" for level in levels for name in self.base)
        if self.polynomial:
            return tuple(f"{letter}{name[1:]}" for letter in "mb" for name in self.base)
        return self.base

    @property
    def kinds(self) -> tuple[tuple[tuple[str, int, float], ...], ...]:
        """Terms that each coefficient adds up: parameter of the muscle, index in it, factor;
        ``("modulus_slope", 0, 1.0)`` for ``m1``.
        """
        kinds, places = ("modulus_slope", "modulus_offset"), range(len(self.base))
        if not self.polynomial:
            groups = len(self.knots) if self.per_level else 1
            return tuple(((name, 0, 1.0),) for name in groups * self.base)
        if not self.per_level:
            return tuple(((kind, k, 1.0),) for kind in kinds for k in places)
        return tuple(
            tuple((kind, k, factor) for kind, factor in zip(kinds, (p, 1.0), strict=True))
            for p in self.knots.tolist()
            for k in places
        )

    @property
    def units(self) -> tuple[str, ...]:
        """SI units of the coefficients."""
        slopes = "m" if self.polynomial else ()
        return tuple("1" if name[0] in slopes else "Pa" for name in self.names)

    def weights(self, pressure: Array) -> Array:
        """``w_j(P)``, shape ``(n, j)``; beyond the outer levels the hat functions continue as
        straight lines.
        """
        ones = np.ones_like(pressure)
        if self.per_level:
            if len(self.knots) == 1:
                return ones[:, None]
            left = np.clip(np.searchsorted(self.knots, pressure) - 1, 0, len(self.knots) - 2)
            share = (pressure - self.knots[left]) / (self.knots[left + 1] - self.knots[left])
            weights = np.zeros((len(pressure), len(self.knots)))
            rows = np.arange(len(pressure))
            weights[rows, left] = 1.0 - share
            weights[rows, left + 1] = share
            return weights
        return np.stack([pressure, ones], axis=1) if self.polynomial else ones[:, None]

    def columns(
        self, muscle: Muscle, pressure: Array, contraction: Array, direction: Array, weights: Array
    ) -> tuple[Array, Array]:
        """Gas force (n,) and the columns (n, k) of the coefficients, without friction; all inputs
        (n,).
        """
        gas, basis = _parts(muscle, pressure, contraction, direction)
        return gas, (weights[:, :, None] * basis[:, None, :]).reshape(len(gas), len(self.names))

    def moduli(self, x: Array, pressure: Array) -> Array:
        """Coefficients of the basis functions at some pressures, shape ``(n, K)``."""
        weights = self.weights(pressure)
        return weights @ x.reshape(weights.shape[1], len(self.base))

    def muscle(self, blank: Muscle, x: Array) -> Muscle:
        """The template muscle with the coefficients in it."""
        if self.per_level:
            raise FitError(
                "moduli that are free at each level make no single muscle: use "
                "muscle_at(pressure), or fit with moduli='linear'"
            )
        if self.polynomial:
            slope, offset = x.reshape(2, -1).tolist()
            return blank.replace(modulus_slope=slope, modulus_offset=offset)
        return blank.replace(**dict(zip(self.base, x.tolist(), strict=True)))

    def muscle_at(self, blank: Muscle, x: Array, pressure: float) -> Muscle:
        """The template muscle with the moduli of one pressure, held constant."""
        values = self.moduli(x, np.array([pressure]))[0].tolist()
        if self.polynomial:
            return blank.replace(modulus_slope=[0.0] * len(values), modulus_offset=values)
        return blank.replace(**dict(zip(self.base, values, strict=True)))


def _parts(
    muscle: Muscle, pressure: Array, contraction: Array, direction: Array
) -> tuple[Array, Array]:
    """Gas force and elastic basis of a template muscle; the lengthening branch of ``elbow_linear``
    has its own.
    """
    if muscle.model == "elbow_linear" and np.any(direction > 0):
        still = muscle.without_friction()
        way = np.where(direction == 0, -1.0, direction)
        gas = still.force(pressure, contraction, direction=way)
        stiff = still.replace(bladder_modulus=_UNIT_MODULUS)
        loaded = stiff.force(pressure, contraction, direction=way)
        return gas, ((loaded - gas) / _UNIT_MODULUS)[:, None]
    # A map repeats its lengths at every level, and the braid solve is what costs.
    distinct, at = np.unique(contraction, return_inverse=True)
    basis = muscle.elastic_scale * muscle.elastic_basis(distinct)
    return pressure * muscle.gas_area(distinct)[at], basis[at]


def friction_factor(muscle: Muscle, pressure: Array, direction: Array, force: Array) -> Array:
    """``1 + d c_F sign(F)`` of (2.36), the factor between the force without and with friction."""
    given = muscle.parameters
    c_f = np.maximum(
        given["friction_coefficient"] + given["friction_pressure_slope"] * pressure,
        given["friction_floor"],
    )
    return np.asarray(1.0 + direction * c_f * np.sign(force))
