"""The estimate behind every fit: linear coefficients exactly, free geometry around them by variable
projection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.errors import FitError, ParameterError
from pamrs.fit._design import Design, friction_factor
from pamrs.rig import Muscle

_SIGMA_ROUNDS = 30
_STEP = 1e-4  # of a scale, for differences
_NO_TOLERANCE_SCALE = 0.02  # of the nominal value


@dataclass(frozen=True)
class Free:
    """A geometry parameter that is fitted: its nominal value, and one standard deviation of what is
    known of it (infinite: nothing).
    """

    name: str
    nominal: float
    tolerance: float

    def moved(self, value: float) -> float:
        """Deviation of a value from the nominal one, in tolerances; 0 for an infinite tolerance."""
        return (value - self.nominal) / self.tolerance

    @property
    def scale(self) -> float:
        """Step size of the search."""
        if math.isfinite(self.tolerance):
            return self.tolerance
        return _NO_TOLERANCE_SCALE * max(abs(self.nominal), 1e-3)


@dataclass(frozen=True)
class Known:
    """Prior of one kind of coefficient: its values (zero beyond the last) and one standard
    deviation.
    """

    values: tuple[float, ...]
    tolerance: float


_UNKNOWN = Known((), math.inf)


@dataclass(frozen=True)
class MapProblem:
    """Rows of a force map and what is to be fitted to them; all arrays ``(n,)``.

    ``knot`` is the pressure that the moduli see: that of the row, or of its level when moduli are
    free at each level. ``weight`` multiplies force residuals. ``known`` has the priors of
    coefficients, by kind; they need a known ``noise``.
    """

    blank: Muscle
    moduli: str
    free: tuple[Free, ...]
    noise: float | None
    known: Mapping[str, Known]
    pressure: Array
    length: Array
    force: Array
    level: Index
    direction: Array
    weight: Array
    levels: Array

    def design(self, rows: Mask) -> Design:
        """The coefficients that the levels of some rows allow."""
        present = np.unique(self.level[rows])
        return Design.of(self.blank, self.moduli, self.levels[present])

    def knot(self, rows: Mask) -> Array:
        """Pressure at which the moduli of some rows are taken [Pa]."""
        return self.levels[self.level[rows]] if self.moduli == "per_level" else self.pressure[rows]

    def muscle(self, values: Array) -> Muscle:
        """The template with other geometry values."""
        pairs = zip(self.free, values, strict=True)
        moved = {free.name: float(value) for free, value in pairs}
        return self.blank.replace(**moved) if moved else self.blank

    def system(self, design: Design, muscle: Muscle, rows: Mask) -> tuple[Array, Array]:
        """Weighted design matrix (n, k) and target (n,) of some rows for one geometry."""
        contraction = 1.0 - self.length[rows] / muscle.parameters["rest_length"]
        pressure, direction, force = self.pressure[rows], self.direction[rows], self.force[rows]
        weights = design.weights(self.knot(rows))
        gas, columns = design.columns(muscle, pressure, contraction, direction, weights)
        factor = friction_factor(muscle, pressure, direction, force)
        weight = self.weight[rows]
        return columns * (factor * weight)[:, None], (force - factor * gas) * weight

    def expected(self, design: Design) -> tuple[Array, Array]:
        """Prior values of the coefficients (k,) and their information ``1/tolerance`` (k,), 0
        without a prior.
        """
        values, variance = np.zeros(len(design.names)), np.zeros(len(design.names))
        for i, parts in enumerate(design.kinds):
            # one, or slope and offset of a modulus at one pressure
            for kind, place, factor in parts:
                if factor == 0.0:  # a slope at no pressure
                    continue
                known = self.known.get(kind, _UNKNOWN)
                values[i] += factor * (known.values[place] if place < len(known.values) else 0.0)
                variance[i] += (factor * known.tolerance) ** 2
        return np.where(np.isfinite(variance), values, 0.0), 1.0 / np.sqrt(variance)

    def information(self, design: Design) -> Array:
        """``1/tolerance`` of the coefficients and the free geometry (k + q,), 0 without a prior."""
        free = [1.0 / free.tolerance for free in self.free]
        return np.concatenate([self.expected(design)[1], free])

    def equations(self, design: Design, muscle: Muscle, rows: Mask) -> tuple[Array, Array]:
        """:meth:`system`, and below it one equation for each coefficient with a prior, weighted by
        the noise.
        """
        matrix, target = self.system(design, muscle, rows)
        values, information = self.expected(design)
        prior = np.flatnonzero(information)
        if not len(prior) or self.noise is None:
            return matrix, target
        extra = np.diag(self.noise * information)[prior]
        return np.vstack([matrix, extra]), np.concatenate([target, extra @ values])

    def check_reach(self, muscle: Muscle) -> None:
        """Raise FitError if the geometry cannot have one of the lengths."""
        low, high = muscle.contraction_limits
        rest = muscle.parameters["rest_length"]
        longest, shortest = rest * (1.0 - low), rest * (1.0 - high)
        outside = int(np.sum((self.length > longest) | (self.length < shortest)))
        if outside:
            angle = math.degrees(muscle.parameters["braid_angle"])
            raise FitError(
                f"{outside} of {len(self.length)} points have lengths that this geometry cannot "
                f"reach: the braid allows {shortest:.4g} to {longest:.4g} m, the points span "
                f"{self.length.min():.4g} to {self.length.max():.4g} m; check rest_length = "
                f"{rest:g} m and braid_angle = {angle:.4g} deg, or flag the rows with "
                "data.checked_against(muscle)"
            )


@dataclass(frozen=True)
class Estimate:
    """Result of an estimate.

    Attributes
    ----------
    design : Design
    blank : Muscle
        Template with the fitted geometry.
    x : (k,) array
        Coefficients.
    geometry : (q,) array
        Values of the free geometry.
    residual : (n,) array
        Weighted residuals of the fitted rows.
    jacobian : (n, k + q) array
        Derivative of the weighted model.
    sigma : float
        Standard deviation of the weighted residuals.
    condition_number : float
        Of the scaled design matrix.
    message : str
        How the search ended.
    success : bool
        Whether it converged.
    """

    design: Design
    blank: Muscle
    x: Array
    geometry: Array
    residual: Array
    jacobian: Array
    sigma: float
    condition_number: float
    message: str
    success: bool


def estimate(problem: MapProblem, rows: Mask, start: Estimate | None = None) -> Estimate:
    """Fit some rows of a problem.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    rows : (n,) bool array
        The rows to fit.
    start : Estimate, optional
        Where the search of the geometry begins; the nominal geometry by default.

    Returns
    -------
    Estimate

    Raises
    ------
    FitError
        If the rows do not determine the unknowns, or no geometry of the search reaches their
        lengths.
    """
    design = problem.design(rows)
    _check_counts(problem, design, rows)
    nominal = np.array([free.nominal for free in problem.free])
    blank = problem.muscle(nominal)
    problem.check_reach(blank)
    try:
        problem.system(design, blank, rows)
    except ParameterError as error:
        raise FitError(
            f"the nominal geometry does not do at every fitted length: {error}; "
            "data.checked_against(muscle) flags such rows"
        ) from error
    if not problem.free:
        return _at(problem, design, rows, blank, nominal, None, "linear least squares", True)
    return _search(problem, design, rows, start)


def _check_counts(problem: MapProblem, design: Design, rows: Mask) -> None:
    """Refuse a fit with fewer points than unknowns, by level where the moduli are free at each."""
    n, k = int(rows.sum()), len(design.names)
    # a coefficient with a prior needs no point
    with_prior = int(np.count_nonzero(problem.expected(design)[1]))
    # A tolerance is an equation of its own, but what it weighs against the data must come from
    # points to spare.
    extra = len(problem.free)
    if problem.noise is not None:
        extra = sum(math.isinf(free.tolerance) for free in problem.free)
    terms = len(design.base)
    what = f"order {terms}" if design.polynomial else f"the model {problem.blank.model}"
    listed = design.names if k <= 8 else (*design.names[:3], "...", design.names[-1])
    unknowns = [*listed, *(free.name for free in problem.free)]
    if design.per_level and with_prior < k:
        counts = np.bincount(problem.level[rows], minlength=len(problem.levels))
        present = np.flatnonzero(counts).tolist()
        enough = [i for i in present if counts[i] >= terms]
        if len(enough) < len(present):
            few = [i for i in present if i not in enough]
            short = [f"{problem.levels[i] / 1e3:g} kPa ({counts[i]})" for i in few]
            raise FitError(
                f"moduli free at each level need {terms} points at every level for {what}; fewer "
                f"at {', '.join(short)}. Levels with enough: {enough or 'none'}"
            )
    elif design.polynomial and with_prior < k and len(np.unique(problem.level[rows])) < 2:
        only = problem.levels[problem.level[rows][0]] / 1e3
        raise FitError(
            f"one pressure level only ({only:g} kPa): slopes m_k and offsets b_k are collinear; "
            "give two levels at least, or moduli='per_level'"
        )
    needed = k - with_prior + extra + 1
    if n < needed:
        hint = ", or a known noise" if extra and problem.noise is None else ""
        raise FitError(
            f"{n} usable points, but {what} has {k + len(problem.free)} unknowns "
            f"({', '.join(unknowns)}); {needed} points are needed at least{hint}"
        )
    lengths = len(np.unique(np.round(problem.length[rows], 9)))
    if lengths < terms and with_prior < k:
        raise FitError(
            f"{lengths} different lengths, but {what} has {terms} functions of length; {terms} "
            "different lengths are needed"
        )


def _hint(problem: MapProblem, rows: Mask) -> str:
    lengths = np.unique(np.round(problem.length[rows], 9))
    span = (lengths[-1] - lengths[0]) / problem.blank.parameters["rest_length"]
    return (
        f" ({int(rows.sum())} points, {len(np.unique(problem.level[rows]))} pressure levels, "
        f"{len(lengths)} lengths over {100 * span:.3g} % of the rest length); take a lower order, "
        "or more lengths and pressures"
    )


def _at(
    problem: MapProblem,
    design: Design,
    rows: Mask,
    blank: Muscle,
    values: Array,
    sigma: float | None,
    message: str,
    success: bool,
) -> Estimate:
    """The estimate for one geometry: coefficients, Jacobian, noise."""
    matrix, target = problem.system(design, blank, rows)
    found = solve(*problem.equations(design, blank, rows), design.names, _hint(problem, rows))
    residual = found.residual[: len(target)]

    def model(muscle: Muscle) -> Array:
        a, y = problem.system(design, muscle, rows)
        return np.asarray(a @ found.x - y)

    slopes = geometry_slopes(problem, values, model, len(target))
    freedom = max(len(target) - len(found.x) - len(values), 1)
    plain = math.sqrt(float(residual @ residual) / freedom)
    noise = problem.noise if problem.noise is not None else (sigma or plain)
    jacobian, condition = np.hstack([matrix, slopes]), found.condition_number
    return Estimate(
        design, blank, found.x, values, residual, jacobian, noise, condition, message, success
    )


def geometry_slopes(
    problem: MapProblem, values: Array, function: Callable[[Muscle], Array], n: int
) -> Array:
    """Finite differences of a function of the muscle over the free geometry.

    Parameters
    ----------
    problem : MapProblem
        Names and scales of the free geometry.
    values : (q,) array
        Where to take them.
    function : callable
        Muscle -> (n,) array.
    n : int
        Length of its result.

    Returns
    -------
    (n, q) array
        Central differences, one-sided where the other side is impossible.
    """
    slopes = np.zeros((n, len(values)))
    for j, free in enumerate(problem.free):
        ends: list[tuple[float, Array]] = []
        for step in (_STEP * free.scale, 0.0, -_STEP * free.scale):
            moved = values.copy()
            moved[j] += step
            try:
                ends.append((step, function(problem.muscle(moved))))
            except ParameterError:
                continue
        (first, up), (last, down) = ends[0], ends[-1]
        if first > last:
            slopes[:, j] = (up - down) / (first - last)
    return slopes


def _search(problem: MapProblem, design: Design, rows: Mask, start: Estimate | None) -> Estimate:
    """Variable projection: least squares over the geometry, with the coefficients solved exactly
    inside.

    Residuals of the priors, ``(value - nominal)/tolerance``, are stacked with data residuals
    divided by their standard deviation; that is estimated from the residuals, and the search
    repeated until it stays.
    """
    from scipy.optimize import least_squares

    space = _Geometry(problem, design, rows)
    z = np.zeros(len(space.nominal))
    if start is not None:
        z = (start.geometry - space.nominal) / space.scale
    sigma = problem.noise or (start.sigma if start else space.scatter(z))
    found = None
    settled = problem.noise is not None
    for _ in range(_SIGMA_ROUNDS):
        found = least_squares(
            space.residuals, z, jac=space.jacobian, args=(sigma,), x_scale=1.0, xtol=1e-12
        )
        z = np.asarray(found.x)
        if problem.noise is not None:
            break
        new = space.scatter_at(z, np.asarray(found.fun), sigma)
        settled = abs(new / sigma - 1.0) < 1e-3 or new == space.least
        sigma = new
        if settled:
            break
    assert found is not None
    success = bool(found.success) and settled
    message = f"variable projection: {found.message}"
    message += "" if settled else " The noise estimate did not settle."
    values = space.nominal + z * space.scale
    result = _at(problem, design, rows, problem.muscle(values), values, sigma, message, success)
    _check_identified(problem, result)
    return result


class _Geometry:
    """The space that is searched: the free geometry ``z`` in steps of its scale from the nominal
    one.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    design : Design
        Of the fitted rows.
    rows : (n,) bool array
        The rows to fit.
    """

    def __init__(self, problem: MapProblem, design: Design, rows: Mask) -> None:
        self.problem, self.design, self.rows = problem, design, rows
        self.nominal = np.array([free.nominal for free in problem.free])
        self.scale = np.array([free.scale for free in problem.free])
        # 0 without a tolerance
        self.prior = np.array([1.0 / free.tolerance for free in problem.free])
        weighted = problem.force[rows] * problem.weight[rows]
        #: the least standard deviation that rounding leaves
        self.least = 1e-9 * float(np.abs(weighted).max())
        self.n, self.k = len(weighted), len(design.names)
        priors = int(np.count_nonzero(problem.expected(design)[1]))
        self.impossible = np.full(self.n + priors + len(self.nominal), np.inf)

    def residuals(self, z: Array, sigma: float) -> Array:
        """Data residuals over ``sigma``, those of coefficients with a prior, those of the geometry.

        Infinite where the geometry is impossible: the search then shortens its step.
        """
        values = self.nominal + z * self.scale
        try:
            blank = self.problem.muscle(values)
            self.problem.check_reach(blank)
            matrix, target = self.problem.equations(self.design, blank, self.rows)
        except (ParameterError, FitError):
            return self.impossible
        own = (values - self.nominal) * self.prior
        return np.concatenate([project_out(matrix, target) / sigma, own])

    def jacobian(self, z: Array, sigma: float) -> Array:
        """Derivative of the residuals, central where both sides are possible."""
        here = self.residuals(z, sigma)
        columns = []
        for j in range(len(z)):
            step = np.zeros_like(z)
            step[j] = _STEP
            up, down = self.residuals(z + step, sigma), self.residuals(z - step, sigma)
            ends = np.isfinite(up[0]), np.isfinite(down[0])
            if all(ends):
                columns.append((up - down) / (2.0 * _STEP))
            elif ends[0]:
                columns.append((up - here) / _STEP)
            else:
                columns.append((here - down) / _STEP if ends[1] else np.zeros_like(here))
        return np.stack(columns, axis=1)

    def scatter(self, z: Array) -> float:
        """Standard deviation of the data residuals before a search."""
        first = self.residuals(z, 1.0)[: self.n]
        return max(math.sqrt(float(first @ first) / max(self.n - self.k, 1)), self.least)

    def scatter_at(self, z: Array, residuals: Array, sigma: float) -> float:
        """Standard deviation of the data residuals at the end of a search with ``sigma``.

        The geometry takes as many degrees of freedom as the data, not the priors, determine.
        """
        slopes = self.jacobian(z, sigma)[: self.n]
        information = slopes.T @ slopes
        share = np.linalg.lstsq(
            information + np.diag((self.prior * self.scale) ** 2), information, rcond=None
        )[0]
        rest = residuals[: self.n] * sigma
        freedom = max(self.n - self.k - float(np.trace(share)), 1.0)
        return max(math.sqrt(float(rest @ rest) / freedom), self.least)


def _check_identified(problem: MapProblem, result: Estimate) -> None:
    """Refuse a geometry that neither the data nor a tolerance determines."""
    names = (*result.design.names, *(free.name for free in problem.free))
    priors = np.diag(result.sigma * problem.information(result.design))
    loose = [free.name for free in problem.free if math.isinf(free.tolerance)]
    stacked = np.vstack([result.jacobian, priors])
    advice = f"give a tolerance for {', '.join(loose)}" if loose else ""
    hint = f"; {advice or 'take a lower order, or free less geometry'}"
    _, _, s, _ = decompose(stacked, names, hint)
    if loose and s[-1] < 1e-7 * s[0]:  # differences carry no more digits
        raise FitError(
            f"the fitted points do not determine {', '.join(loose)} with the other unknowns{hint}"
        )


def refitted(problem: MapProblem, result: Estimate, rows: Mask, gone: int) -> Estimate:
    """The fit without one level; the search of the geometry starts from ``result``.

    Raises
    ------
    FitError
        If the other levels do not determine the unknowns.
    """
    kept = rows & (problem.level != gone)
    return estimate(problem, kept, result)


#: Ratio of the smallest to the largest singular value below which columns count as collinear.
RANK_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Solution:
    """A linear least-squares solution.

    Attributes
    ----------
    x : (k,) array
        Coefficients.
    residual : (n,) array
        ``y - A x``.
    span : (n, k) array
        Orthonormal basis of the columns of ``A``.
    condition_number : float
        Of ``A`` with every column scaled to length 1; 1 when there is no column.
    """

    x: Array
    residual: Array
    span: Array
    condition_number: float


def decompose(
    matrix: Array, names: Sequence[str], hint: str = ""
) -> tuple[Array, Array, Array, Array]:
    """Scale the columns to length 1 and take the SVD.

    Parameters
    ----------
    matrix : (n, k) array
        Design matrix, ``k >= 1``.
    names : sequence of str
        Names of the columns, for messages.
    hint : str
        What would help, added to the message.

    Returns
    -------
    scale, U, s, Vt : arrays
        ``matrix = U diag(s) Vt diag(scale)``.

    Raises
    ------
    FitError
        If a column is zero or columns are collinear (smallest singular value below 1e-10 of the
        largest).
    """
    scale = np.linalg.norm(matrix, axis=0)
    empty = [name for name, size in zip(names, scale.tolist(), strict=True) if size == 0.0]
    if empty:
        raise FitError(
            f"{', '.join(empty)} {'has' if len(empty) == 1 else 'have'} no effect on any fitted "
            f"point{hint}"
        )
    if not np.isfinite(matrix).all():
        raise FitError("the model gives no finite force at some of the fitted points")
    u, s, vt = np.linalg.svd(matrix / scale, full_matrices=False)
    if s[-1] <= RANK_TOLERANCE * s[0]:
        share = np.abs(vt[-1])
        mixed = [
            name
            for name, part in zip(names, share.tolist(), strict=True)
            if part > 0.1 * share.max()
        ]
        raise FitError(
            f"the fitted points cannot tell apart {', '.join(mixed)}: their columns are "
            f"collinear{hint}"
        )
    return scale, u, s, vt


def solve(matrix: Array, target: Array, names: Sequence[str], hint: str = "") -> Solution:
    """Least squares by SVD with scaled columns; nothing is regularised.

    Parameters
    ----------
    matrix : (n, k) array
        Design matrix; ``k`` may be 0.
    target : (n,) array
        Right-hand side.
    names : sequence of str
        Names of the columns.
    hint : str
        What would help if the columns are collinear.

    Returns
    -------
    Solution

    Raises
    ------
    FitError
        If columns are zero or collinear.
    """
    if matrix.shape[1] == 0:
        return Solution(np.empty(0), target.copy(), np.empty((len(target), 0)), 1.0)
    scale, u, s, vt = decompose(matrix, names, hint)
    x = (vt.T @ ((u.T @ target) / s)) / scale
    return Solution(x, target - matrix @ x, u, float(s[0] / s[-1]))


def project_out(matrix: Array, target: Array) -> Array:
    """The part of ``target`` that no combination of the columns reaches (the inner step of variable
    projection).
    """
    if matrix.shape[1] == 0:
        return target
    q, _ = np.linalg.qr(matrix / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny))
    return np.asarray(target - q @ (q.T @ target))
