"""A force law of the user's as a table of forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike
from pamrs._checks import positive, rising
from pamrs.errors import ParameterError

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
    """What :meth:`pamrs.Muscle.from_law` gives to the muscle: axes and forces of a table."""
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
    """Largest error halfway between nodes of one axis, in the middle of the other one too [N]."""
    places = [np.sort(np.concatenate([a, 0.5 * (a[1:] + a[:-1])])) for a in axes]
    places[axis] = 0.5 * (axes[axis][1:] + axes[axis][:-1])
    pressure, contraction = np.meshgrid(*places, indexing="ij")
    force = _asked(law, pressure, contraction)
    table = found(pressure.ravel(), contraction.ravel()).reshape(force.shape)
    return float(np.max(np.abs(table - force)))
