"""Fit a muscle's moduli, and if asked its geometry, to a force map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

from pamrs.fit._result import MuscleFit
from pamrs.fit._solution import solution

if TYPE_CHECKING:
    from pamrs.fit._data import ForceMap
    from pamrs.rig import Muscle

__all__ = ["fit_muscle"]


def fit_muscle(
    data: ForceMap,
    muscle: Muscle,
    *,
    model: str | None = None,
    geometry: str | None = None,
    order: int | None = None,
    moduli: str = "linear",
    free: Iterable[str] = (),
    tolerance: Mapping[str, float] | None = None,
    levels: Sequence[float] | None = None,
    direction: str | None = "data",
    weights: str = "force",
    noise: float | None = None,
    errors: str = "level",
) -> MuscleFit:
    """Fit a force model to measured forces (dissertation 2.2.6 and 2.3).

    The force is linear in the moduli, so these are found by one linear least-squares solution, by
    SVD with scaled columns and without regularisation. Free geometry is searched around it
    (variable projection, Golub and Pereyra 1973).

    Parameters
    ----------
    data : ForceMap
        Measured forces over length and pressure; only its used rows count. Lengths are taken as
        measured, so a fitted rest length changes the contraction ratios.
    muscle : Muscle
        Nominal geometry, friction and modulus scale; its moduli are not used. For the friction of
        the loops in ``data``, fit that first: ``muscle = fit_friction(data).to_muscle(muscle)``.
    model, geometry : str, optional
        Force model and shape; None keeps the muscle's own (another model comes with its own shape).
    order : int, optional
        Order M of the stress polynomial of ``ferraresi``, ``kothera`` and ``robinson``; None takes
        the muscle's own number of moduli, 4 if it has none. Other models have no order.
    moduli : {"linear", "per_level"}
        ``E_k = m_k P + b_k`` over all levels at once, or ``E_k`` free at each level with straight
        lines between them. Models without a polynomial have constants (``c10`` and ``c01``,
        ``bladder_modulus``, or none) in place of ``m_k, b_k``.
    free : iterable of str
        Geometry to fit as well, of :data:`pamrs.fit.GEOMETRY`.
    tolerance : mapping of str to float, optional
        One standard deviation of what is known of each free parameter [SI], a Gaussian prior around
        the muscle's value. A free parameter without one has no prior. Prior and data are weighed by
        the scatter of the residuals, found in the fit. ``modulus_slope`` [1] and ``modulus_offset``
        [Pa] (of every order alike), ``c10``, ``c01`` or ``bladder_modulus`` [Pa] do the same for
        the moduli, around those of the muscle, 0 where it has none; they need ``noise``. With few
        points a wide one, ``{"modulus_slope": 10.0, "modulus_offset": 1e7}`` for a rubber, keeps
        moduli that the points hardly tell from growing large.
    levels : sequence of int or of float, optional
        Pressure levels to fit: whole numbers are indices into ``data.levels``, floats are pressures
        [Pa]. The other levels are predicted and their errors reported. None fits all.
    direction : {"data", None}
        ``"data"`` uses the direction of motion of the rows with the muscle's friction law and, for
        ``elbow_linear``, its lengthening branch; rows of unknown direction have no friction. None
        ignores directions: the mean of a loop.
    weights : {"force", "level"}
        Residuals in N as in the dissertation, or divided by the largest force of their level, which
        minimises (2.37); every fitted level must then pull with 1 % of the map's largest force at
        least.
    noise : float, optional
        Known standard deviation of the residuals, in N (with ``weights="level"`` as a fraction);
        None estimates it. Points count as independent beside the priors; where the misfit is the
        model's, a larger ``noise`` keeps the geometry nearer to nominal.
    errors : {"level", "plain"}
        ``"plain"`` standard errors take residuals as independent. Residuals of a quasi-static map
        are mostly model error and hang together along a level; then plain ones are too small.
        ``"level"``, the default, leaves out one level at a time (jackknife, CR3) and holds for any
        dependence within levels, not for one between them: a misfit that repeats at the same length
        in every level stays unseen. It needs 5 levels and more than there are unknowns, each of
        which the others can do without; otherwise plain ones are given, with a warning.

    Returns
    -------
    MuscleFit

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    FitError
        If the points do not determine the unknowns (too few points or lengths, one pressure level,
        collinear columns), the geometry cannot reach the measured lengths, or a level has no force
        to weigh it by.

    Examples
    --------
    >>> import math, numpy as np, pamrs
    >>> from pamrs.fit import ForceMap, fit_muscle
    >>> muscle = pamrs.rigs.shoulder().muscle
    >>> e, p = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 0.25, 8), [2e5, 4e5, 6e5]))
    >>> data = ForceMap.from_arrays(0.276 * (1 - e), p, muscle.force(p, e), rest_length=0.276)
    >>> fit = fit_muscle(data, muscle, order=2)
    >>> fit.x.round(4)[:2].tolist()
    [3.0, -0.35]
    """
    found = solution(
        data,
        muscle,
        model=model,
        geometry=geometry,
        order=order,
        moduli=moduli,
        free=free,
        tolerance=tolerance,
        levels=levels,
        direction=direction,
        weights=weights,
        noise=noise,
        errors=errors,
    )
    return MuscleFit(**{item.name: getattr(found, item.name) for item in fields(found)})
