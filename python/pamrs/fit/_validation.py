"""Errors of a fit in the words of the dissertation, and on pressures that the fit has not seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.errors import FitError
from pamrs.fit._estimate import Estimate, MapProblem, refitted

#: Share of the map's largest force below which a level's own largest force is no scale for its
#: errors.
WEAK: Final = 0.01


@dataclass(frozen=True, repr=False)
class PressureErrors:
    """Error of each pressure level, the measure (2.37), where the level pulls enough to be its
    scale.

    Attributes
    ----------
    levels : (m,) array
        Pressure [Pa].
    points : (m,) int array
        Number of points.
    rms, max : (m,) array
        Root mean square, and largest magnitude, of ``(F - F_model)/F_max`` with the level's own
        largest measured force [1].
    fitted : (m,) bool array
        Whether the level was part of the fit.
    weak : (k,) array
        Pressure of the levels that are not in the arrays above [Pa]: their largest force is below 1
        % of the map's largest.
    """

    levels: Array
    points: Index
    rms: Array
    max: Array
    fitted: Mask
    weak: Array

    @property
    def note(self) -> str:
        """Note on the levels that are left out of (2.37), with the reason; empty when none is."""
        if not len(self.weak):
            return ""
        names = ", ".join(f"{pressure / 1e3:.5g}" for pressure in self.weak)
        return (
            f"{names} kPa: not in this table, the largest force there is below {100 * WEAK:g} % of "
            "the map's largest"
        )

    def __repr__(self) -> str:
        left = f", {len(self.weak)} left out" if len(self.weak) else ""
        worst = ""
        if len(self.rms):
            worst = f", rms at most {100 * self.rms.max():.2f} % of the level's largest force"
        return f"PressureErrors({len(self.levels)} levels{left}{worst})"

    @classmethod
    def of(cls, problem: MapProblem, error: Array, rows: Mask, fitted: Mask) -> PressureErrors:
        """Gather force errors [N] of all rows (n,) over the levels present in ``rows``."""
        everything = np.unique(problem.level[rows])
        tops = level_forces(problem)
        pulls = tops[everything] >= WEAK * float(problem.force.max())
        present = everything[pulls]
        shares = [error[rows & (problem.level == level)] / tops[level] for level in present]
        return cls(
            problem.levels[present],
            np.array([len(share) for share in shares], dtype=np.intp),
            np.array([np.sqrt(np.mean(share**2)) for share in shares]),
            np.array([np.abs(share).max() for share in shares]),
            np.isin(present, np.unique(problem.level[fitted])),
            problem.levels[everything[~pulls]],
        )


def level_forces(problem: MapProblem) -> Array:
    """Largest measured force of every level [N]; zero or negative where a level does not pull."""
    return np.array(
        [problem.force[problem.level == level].max() for level in range(len(problem.levels))]
    )


def summary(error: Array, scale: float) -> tuple[float, float] | None:
    """Rms and largest magnitude of force errors over ``scale``; None without a row."""
    if not len(error):
        return None
    return float(np.sqrt(np.mean(error**2))) / scale, float(np.abs(error).max()) / scale


@dataclass(frozen=True, repr=False)
class CrossValidation:
    """Leave-one-pressure-out: every fitted level predicted by a fit of the others.

    Attributes
    ----------
    by_pressure : PressureErrors
        (2.37) of each level as predicted; all levels are marked as not fitted.
    predicted, residual : (n,) array
        Predicted force, and measured minus predicted [N], of the fitted rows in the map's order.
    level : (n,) int array
        Index of the level of these rows in the map.
    rms, max : float
        Over all points, as fractions of the map's largest force.
    interior_rms, interior_max : float or None
        The same over the levels between others (interpolation in pressure); None when there are
        none.
    end_rms, end_max : float
        Over the lowest and the highest level, which are extrapolated.
    rms_stderr : float
        Standard error of ``rms`` from the spread over the levels (delete-one-level jackknife).
    """

    by_pressure: PressureErrors
    predicted: Array
    residual: Array
    level: Index
    rms: float
    max: float
    interior_rms: float | None
    interior_max: float | None
    end_rms: float
    end_max: float
    rms_stderr: float

    def __repr__(self) -> str:
        return (
            f"CrossValidation({len(np.unique(self.level))} levels, each from the others: rms "
            f"{100 * self.rms:.2f} %, max {100 * self.max:.2f} % of the map's largest force)"
        )

    def level_squares(self) -> Array:
        """Sum of the squared prediction errors of each fitted level [N2], by rising pressure."""
        return np.array(
            [np.sum(self.residual[self.level == group] ** 2) for group in np.unique(self.level)]
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, errors as fractions."""
        numbers = {k: v for k, v in vars(self).items() if v is None or isinstance(v, float)}
        each = self.by_pressure
        return numbers | {
            "levels": each.levels.tolist(),
            "level_rms": each.rms.tolist(),
            "level_max": each.max.tolist(),
            "points": each.points.tolist(),
            "weak_levels": each.weak.tolist(),
        }


def leave_one_out(problem: MapProblem, result: Estimate, rows: Mask) -> CrossValidation:
    """Predict each fitted level from the others.

    Without free geometry and priors the refits follow from the one decomposition: the prediction
    error of a level is ``(1 - H_g)^-1 r_g`` with its block ``H_g`` of the hat matrix. Otherwise
    everything is refitted.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    result : Estimate
        The fit of all rows.
    rows : (n,) bool array
        The fitted rows.

    Returns
    -------
    CrossValidation

    Raises
    ------
    FitError
        If there are fewer than two levels, or the others do not determine the unknowns.
    """
    level = problem.level[rows]
    groups = np.unique(level)
    if len(groups) < 2:
        raise FitError(
            "two pressure levels at least are needed to predict one from the others; there is one"
        )
    linear = not (problem.free or problem.known or result.design.per_level)
    error = _by_hat_matrix(problem, result, level) if linear else _by_refits(problem, result, rows)
    error = error / problem.weight[rows]
    everywhere = np.zeros(len(rows))
    everywhere[rows] = error
    by_pressure = PressureErrors.of(problem, everywhere, rows, np.zeros_like(rows))
    top = float(problem.force.max())
    ends = np.isin(level, [groups[0], groups[-1]])
    rms, worst = summary(error, top) or (0.0, 0.0)
    interior_rms, interior_max = summary(error[~ends], top) or (None, None)
    end_rms, end_max = summary(error[ends], top) or (0.0, 0.0)
    dropped = np.array([np.sqrt(np.mean(error[level != group] ** 2)) / top for group in groups])
    spread = float(np.sqrt((1.0 - 1.0 / len(groups)) * np.sum((dropped - dropped.mean()) ** 2)))
    predicted = problem.force[rows] - error
    inside, outside = (interior_rms, interior_max), (end_rms, end_max)
    return CrossValidation(
        by_pressure, predicted, error, level, rms, worst, *inside, *outside, spread
    )


def _gone(problem: MapProblem, level: int, why: str) -> FitError:
    return FitError(
        f"without {problem.levels[level] / 1e3:g} kPa the other levels do not determine the fit: "
        f"{why}"
    )


def _by_hat_matrix(problem: MapProblem, result: Estimate, level: Index) -> Array:
    if not result.jacobian.shape[1]:
        return result.residual
    scaled = result.jacobian / np.linalg.norm(result.jacobian, axis=0)
    span, _, _ = np.linalg.svd(scaled, full_matrices=False)
    error = np.empty_like(result.residual)
    for group in np.unique(level):
        own = level == group
        left = np.eye(span.shape[1]) - span[own].T @ span[own]
        if np.linalg.eigvalsh(left)[0] < 1e-9:
            points = f"{int(np.sum(~own))} points for {', '.join(result.design.names)}"
            raise _gone(problem, int(group), points)
        # (1 - H_g)^-1 r_g by the Woodbury identity: small matrices however long the level is.
        moved = np.linalg.solve(left, span[own].T @ result.residual[own])
        error[own] = result.residual[own] + span[own] @ moved
    return error


def _by_refits(problem: MapProblem, result: Estimate, rows: Mask) -> Array:
    error = np.zeros(len(rows))
    for group in np.unique(problem.level[rows]):
        try:
            other = refitted(problem, result, rows, int(group))
        except FitError as reason:
            raise _gone(problem, int(group), str(reason)) from reason
        own = rows & (problem.level == group)
        matrix, target = problem.system(other.design, other.blank, own)
        error[own] = target - matrix @ other.x
    return error[rows]
