"""Fits a muscle's moduli, and if asked its geometry, to a force map: checks what is asked, chooses
rows and unknowns, and puts the numbers together.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs._checks import one_of, refused
from pamrs.errors import FitError, ParameterError
from pamrs.fit._cautions import cautions
from pamrs.fit._checks import check_rest_length
from pamrs.fit._data import ForceMap
from pamrs.fit._design import template
from pamrs.fit._estimate import Estimate, Free, Known, MapProblem, estimate
from pamrs.fit._result import MuscleFit
from pamrs.fit._statistics import FitParameter
from pamrs.fit._validation import WEAK, level_forces
from pamrs.rig import Muscle
from pamrs.rig.muscle_models import ELASTIC_PARAMETERS, POLYNOMIAL_MODELS

#: Geometry that can be fitted, and its unit.
GEOMETRY: Final[dict[str, str]] = {
    "rest_length": "m",
    "rest_diameter": "m",
    "braid_angle": "rad",
    "wall_thickness": "m",
    "k0": "1",
    "contraction_slope": "1",
    "extension_slope": "1",
    "neck_floor": "1",
}

#: Coefficients of the models that can have a prior.
COEFFICIENTS: Final[tuple[str, ...]] = (
    *("modulus_slope", "modulus_offset"),
    *("c10", "c01", "bladder_modulus"),
)

_ELLIPTIC_ONLY = ("k0", "contraction_slope", "extension_slope", "neck_floor")
_WALLLESS = ("gaylord",)


def has_effect(name: str, model: str, geometry: str) -> bool:
    """True where a geometry parameter enters the force of a model."""
    return not (name in _ELLIPTIC_ONLY and geometry == "cylinder") and not (
        name == "wall_thickness" and model in _WALLLESS
    )


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
        None estimates it. Points count as independent of each other and of the priors; where the
        misfit is the model's, a larger ``noise`` keeps the geometry nearer to nominal.
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
    >>> force, length = muscle.force(p, e), 0.276 * (1 - e)
    >>> data = ForceMap.from_arrays(pressure=p, length=length, force=force, rest_length=0.276)
    >>> fit = fit_muscle(data, muscle, order=2)
    >>> fit.x.round(4)[:2].tolist()
    [3.0, -0.35]
    """
    one_of("weights", weights, ("force", "level"))
    one_of("errors", errors, ("level", "plain"))
    one_of("direction", direction, ("data", None))
    rows = _chosen(data, levels)
    blank = template(muscle, model, geometry, order)
    spread = _tolerances(tolerance)
    unknowns = _free(blank, tuple(free), spread)
    known = _known(muscle, blank, spread)
    if noise is not None and not (_is_number(noise) and 0.0 < noise < math.inf):
        raise refused("noise", noise, "a positive number is needed")
    if known and noise is None:
        raise ParameterError(
            f"tolerance of {', '.join(known)} needs noise: the standard deviation of the forces "
            "that it is weighed against"
        )
    check_rest_length(blank, data.rest_length)
    problem = _problem(data, blank, moduli, unknowns, known, noise, direction)
    if not float(problem.force[rows].max()) > 0.0:
        raise FitError(
            f"the largest force of the fitted rows is {problem.force[rows].max():g} N: a pulling "
            "force is needed"
        )
    if weights == "level":
        problem = _weighted(problem, rows)
    return _result(data, problem, rows, estimate(problem, rows), errors)


def level_indices(data: ForceMap, levels: Sequence[float]) -> list[int]:
    """Indices of levels given as whole numbers (indices) or floats (pressures in Pa)."""
    chosen = np.asarray(levels)
    if chosen.ndim != 1 or not len(chosen) or chosen.dtype.kind not in "iuf":
        raise refused("levels", levels, "a list of indices, or of pressures in Pa as floats")
    if chosen.dtype.kind == "f":
        return data.level_indices(chosen.tolist())
    count = len(data.levels)
    if np.any((chosen < -count) | (chosen >= count)):
        needed = f"indices from 0 to {count - 1}; pressures are given as floats, in Pa"
        raise refused("levels", chosen.tolist(), needed)
    return sorted({int(index) % count for index in chosen})


def _chosen(data: ForceMap, levels: Sequence[float] | None) -> Mask:
    level = data.level[data.used]
    if levels is None:
        return np.ones(len(level), dtype=bool)
    return np.isin(level, level_indices(data, levels))


def _free(blank: Muscle, names: tuple[str, ...], tolerance: dict[str, float]) -> tuple[Free, ...]:
    known = blank.parameters
    for name in names:
        one_of("free", name, GEOMETRY)
        if not has_effect(name, blank.model, blank.geometry):
            raise ParameterError(
                f"free: {name!r} has no effect on the model {blank.model} with {blank.geometry} "
                "geometry"
            )
    if len(set(names)) < len(names):
        raise ParameterError(f"free = {list(names)} names a parameter twice")
    spread = {name: float(tolerance.get(name, math.inf)) for name in names}
    return tuple(Free(name, float(known[name]), spread[name]) for name in names)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def _tolerances(tolerance: Mapping[str, float] | None) -> dict[str, float]:
    allowed = (*GEOMETRY, *COEFFICIENTS)
    for name, value in (tolerance or {}).items():
        one_of("tolerance", name, allowed)
        if not (_is_number(value) and value > 0.0):
            needed = "a positive number is needed (infinite for no prior)"
            raise refused(f"tolerance: {name}", value, needed)
    return dict(tolerance or {})


def _known(muscle: Muscle, blank: Muscle, tolerance: Mapping[str, float]) -> dict[str, Known]:
    """Priors of the coefficients: around the muscle's own values where it has the same kind."""
    same = {blank.model, muscle.model} <= set(POLYNOMIAL_MODELS) or muscle.model == blank.model
    own = muscle.parameters if same else {}
    known: dict[str, Known] = {}
    for name in (name for name in COEFFICIENTS if math.isfinite(tolerance.get(name, math.inf))):
        if name not in ELASTIC_PARAMETERS[blank.model]:
            raise ParameterError(
                f"tolerance: {name!r} is not allowed: the model {blank.model} has no such "
                "coefficient"
            )
        values = np.atleast_1d(own.get(name, 0.0)).tolist()
        known[name] = Known(tuple(values), float(tolerance[name]))
    return known


def _problem(
    data: ForceMap,
    blank: Muscle,
    moduli: str,
    free: tuple[Free, ...],
    known: Mapping[str, Known],
    noise: float | None,
    direction: str | None,
) -> MapProblem:
    used = data.used
    pressure, _, force, level, way = data.used_rows()
    steps = way.astype(np.float64) if direction == "data" else np.zeros(len(force))
    return MapProblem(
        blank=blank,
        moduli=moduli,
        free=free,
        known=known,
        noise=noise,
        pressure=pressure,
        length=data.length[used],
        force=force,
        level=level,
        direction=steps,
        weight=np.ones(len(force)),
        levels=data.levels,
    )


def _weighted(problem: MapProblem, rows: Mask) -> MapProblem:
    """The problem with every fitted residual over the largest force of its level."""
    tops = level_forces(problem)
    weak = tops < WEAK * float(problem.force.max())
    named = [
        f"{problem.levels[i] / 1e3:g} kPa ({tops[i]:.3g} N)"
        for i in np.unique(problem.level[rows])
        if weak[i]
    ]
    if named:
        raise FitError(
            "weights = 'level' divides by the largest force of a level, which is below "
            f"{100 * WEAK:g} % of the map's largest at {', '.join(named)}: leave these levels out, "
            "or take weights = 'force'"
        )
    return replace(problem, weight=1.0 / np.where(weak, 1.0, tops)[problem.level])


def _result(
    data: ForceMap, problem: MapProblem, rows: Mask, found: Estimate, errors: str
) -> MuscleFit:
    plain, robust = covariances(problem, found, problem.level[rows])
    warnings = []
    kind = errors
    if errors == "level" and robust is None:
        kind = "plain"
        if found.sigma > 0.0:
            count, needed = len(np.unique(problem.level[rows])), levels_needed(len(plain))
            why = (
                f"errors by level leave out one level at a time, and one of the {count} cannot be "
                "missed"
            )
            if count < needed:
                why = (
                    f"errors by level need {needed} fitted levels for {len(plain)} unknowns, there "
                    f"are {count}"
                )
            warnings.append(f"standard errors take the residuals as independent: {why}")
    covar = plain if kind == "plain" or robust is None else robust
    parameters = _parameters(problem, found, covar, plain)
    warnings += cautions(problem, found, rows, data.labels(), parameters)
    return MuscleFit(
        data=data,
        params=parameters,
        covar=covar,
        covar_plain=plain,
        errors=kind,
        success=found.success,
        message=found.message,
        warnings=tuple(warnings),
        _problem=problem,
        _estimate=found,
        _rows=rows,
    )


def _parameters(
    problem: MapProblem, found: Estimate, covar: Array, plain: Array
) -> dict[str, FitParameter]:
    spread, spread_plain = np.sqrt(np.diag(covar)).tolist(), np.sqrt(np.diag(plain)).tolist()
    parameters = {}
    expected, information = problem.expected(found.design)
    for i, (name, unit) in enumerate(zip(found.design.names, found.design.units, strict=True)):
        expectation = (
            (float(expected[i]), 1.0 / float(information[i])) if information[i] else (None, None)
        )
        parameters[name] = FitParameter(
            name, float(found.x[i]), spread[i], unit, spread_plain[i], *expectation
        )
    for i, free in enumerate(problem.free, start=len(found.x)):
        known = free.tolerance if math.isfinite(free.tolerance) else None
        value = float(found.geometry[i - len(found.x)])
        parameters[free.name] = FitParameter(
            free.name, value, spread[i], GEOMETRY[free.name], spread_plain[i], free.nominal, known
        )
    return parameters


_FEWEST_LEVELS = 5


def levels_needed(unknowns: int) -> int:
    """Fitted levels that the jackknife needs: fewer than the unknowns would leave combinations of
    them without any spread.
    """
    return max(_FEWEST_LEVELS, unknowns + 1)


def covariances(problem: MapProblem, result: Estimate, level: Index) -> tuple[Array, Array | None]:
    """Plain and level-robust covariance of coefficients and geometry.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    result : Estimate
        The fit.
    level : (n,) int array
        Level of each fitted row.

    Returns
    -------
    plain : (p, p) array
        ``sigma^2 (J'J + sigma^2 D)^-1`` with the priors' information ``D``: residuals taken as
        independent.
    robust : (p, p) array or None
        Delete-one-level jackknife (CR3) of the linearised fit plus the priors' own share: it holds
        when the residuals of one level hang together. None with fewer than 5 levels or no more
        levels than parameters, or when a level cannot be spared.
    """
    p = result.jacobian.shape[1]
    prior = problem.information(result.design)
    jacobian = result.jacobian / result.sigma if result.sigma > 0.0 else result.jacobian
    if p == 0:
        return np.empty((0, 0)), np.empty((0, 0))
    scale = np.sqrt((jacobian**2).sum(axis=0) + prior**2)
    jacobian, prior = jacobian / scale, prior / scale
    stacked = np.vstack([jacobian, np.diag(prior)])
    _, s, vt = np.linalg.svd(stacked, full_matrices=False)
    root = vt.T / s
    inverse = root @ root.T
    plain = inverse / np.outer(scale, scale)
    if result.sigma == 0.0:
        return plain * 0.0, None
    groups = np.unique(level)
    if len(groups) < levels_needed(p):
        return plain, None
    residual = result.residual / result.sigma
    moves = []
    for group in groups:
        # In the basis of the singular vectors the information matrix is 1; taking a level away
        # leaves 1 - B'B.
        rows = jacobian[level == group] @ root
        left = np.eye(p) - rows.T @ rows
        if np.linalg.eigvalsh(left)[0] < 1e-9:
            return plain, None
        moves.append(root @ np.linalg.solve(left, rows.T @ residual[level == group]))
    spread = np.array(moves).T
    robust = (1.0 - 1.0 / len(groups)) * spread @ spread.T + inverse @ np.diag(prior**2) @ inverse
    return plain, robust / np.outer(scale, scale)
