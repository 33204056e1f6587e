"""Moduli from published facts: the least change of a prior that satisfies them.

The unknowns are the slopes ``m_k`` and offsets ``b_k`` of ``E_k = m_k P + b_k``. The force is
linear in them, so each fact is one linear equation. There are fewer facts than unknowns: the facts
determine as many combinations as they have rank, and the rest stays at a prior. Of all moduli that
satisfy the facts, the one nearest to the prior is taken, the distance of each number counted in its
prior standard deviation (weighted least norm).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import ParameterError
from pamrs.library import Entry, quantity
from reproduction.muscles import identification
from reproduction.muscles.evaluate import KINDS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Identification:
    """Numbers derived again from prior and facts.

    Attributes
    ----------
    parameters : dict
        Braid angle [rad] where it is identified, ``modulus_slope`` [1] and ``modulus_offset`` [Pa].
    conditions : tuple of str
        The facts used, one equation each.
    rank, unknowns : int
        Combinations that the facts determine, and numbers sought; the difference is left to the
        prior.
    change : ndarray (unknowns,)
        How far each number moved from its prior, in prior standard deviations.
    """

    parameters: dict[str, Any]
    conditions: tuple[str, ...]
    rank: int
    unknowns: int
    change: Array


def gent_modulus(shore_a: float) -> float:
    """Young's modulus of a rubber from its Shore A hardness [Pa] (Gent 1958).

    Parameters
    ----------
    shore_a : float
        Hardness, from 10 to 90.

    Raises
    ------
    ParameterError
        If the hardness is outside that range.
    """
    if not 10.0 <= shore_a <= 90.0:
        raise ParameterError(f"shore_a = {shore_a} is not allowed: 10 to 90")
    return 1e6 * 0.0981 * (56.0 + 7.62336 * shore_a) / (0.137505 * (254.0 - 2.54 * shore_a))


def least_norm(matrix: Array, target: Array, prior: Array, spread: Array) -> tuple[Array, int]:
    """Solution of ``matrix x = target`` nearest to a prior.

    Parameters
    ----------
    matrix : ndarray (r, n)
        One equation per row, ``r <= n``.
    target : ndarray (r,)
        Right-hand sides.
    prior, spread : ndarray (n,)
        Prior values and their standard deviations; ``sum(((x - prior)/spread)**2)`` is least.

    Returns
    -------
    x : ndarray (n,)
    rank : int
        Number of combinations that the equations determine.
    """
    scaled = matrix * spread
    size = np.linalg.norm(scaled, axis=1)
    rows, rest = scaled / size[:, None], (target - matrix @ prior) / size
    z, _, rank, _ = np.linalg.lstsq(rows, rest, rcond=1e-10)
    return prior + spread * z, int(rank)


def derive(entry: Entry) -> Identification:
    """Derive the identified numbers of a muscle again, from prior and facts only.

    Parameters
    ----------
    entry : Entry
        A muscle of the library; its stored moduli are not used, nor its braid angle where that is
        identified.

    Returns
    -------
    Identification

    Raises
    ------
    ParameterError
        If a condition of the file is unknown or the facts contradict each other.
    """
    muscle = entry.muscle
    identified: dict[str, Any] = {}
    given = identification(entry.name)
    if "angle" in given:
        at = {key: quantity(item) for key, item in given["angle"].items()}
        identified["braid_angle"] = KINDS["angle_for_force"](entry, at)
        muscle = muscle.replace(**identified)
    prior, spread = _prior(given["prior"])
    order = prior.size // 2
    conditions = given.get("condition", [])
    values, rank = prior, 0
    if conditions:
        rows, target = zip(*(_equation(muscle, item, order) for item in conditions), strict=True)
        matrix, right = np.array(rows), np.array(target)
        values, rank = least_norm(matrix, right, prior, spread)
        left = np.abs(matrix @ values - right)
        if np.any(left > 1e-8 * np.abs(matrix * spread).sum(axis=1)):
            raise ParameterError(
                f"the facts of {entry.name} contradict each other: {left} is left over"
            )
    identified["modulus_slope"] = values[:order].tolist()
    identified["modulus_offset"] = values[order:].tolist()
    return Identification(
        parameters=identified,
        conditions=tuple(item["kind"] for item in conditions),
        rank=rank,
        unknowns=prior.size,
        change=(values - prior) / spread,
    )


def _prior(item: Mapping[str, Any]) -> tuple[Array, Array]:
    """Prior values and standard deviations of (slopes, offsets); the deviation is the value
    itself.
    """
    hardness = item.get("shore_hardness")
    softer = (
        gent_modulus(hardness["value"]) / gent_modulus(hardness["reference"]) if hardness else 1.0
    )
    prior = np.array(
        [*item["modulus_slope"], *(softer * v for v in item["modulus_offset"])], dtype=np.float64
    )
    return prior, np.abs(prior)


def _equation(muscle: Any, item: Mapping[str, Any], order: int) -> tuple[Array, float]:
    """Row and right-hand side of one fact in the unknowns (m_1.., b_1..)."""
    kind = item["kind"]
    pressure = quantity(item["pressure"]) if "pressure" in item else math.nan
    powers = np.arange(order, dtype=np.float64)
    if kind == "free_contraction":
        # 0 = P a_gas(e) + sum_k (m_k P + b_k) basis_k(e)
        basis = muscle.elastic_basis(item["contraction"])[:order]
        return np.concatenate([pressure * basis, basis]), -pressure * float(
            muscle.gas_area(item["contraction"])
        )
    if kind == "softening":
        # tangent modulus: 0 = sum_k k E_k eps^(k-1)
        tangent = (powers + 1.0) * item["strain"] ** powers
        return np.concatenate([pressure * tangent, tangent]), 0.0
    if kind == "linear_rubber":
        # the rubber alone (P = 0) is a straight line: b_2 = 0 (order 2)
        return np.concatenate([np.zeros(order), powers]), 0.0
    raise ParameterError(
        f"condition kind = {kind!r} is not known: free_contraction, softening, linear_rubber"
    )
