"""Cautions about the numbers of a fit: poorly determined moduli, implausible values, outlying
points.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.fit._estimate import Estimate, MapProblem
from pamrs.fit._statistics import FitParameter
from pamrs.units import with_unit

Parameters = Mapping[str, FitParameter]

_LARGE_CONDITION: Final = 1e4
_NARROW: Final = 0.02  # of the rest length
_UNINFORMED: Final = 0.9  # of the tolerance
FAR: Final = 3.0
"""Tolerances from what was known of a size beyond which it is no longer plausible."""
_MOVED: Final = 0.3  # of the nominal value
_FEW_SPARE: Final = 5  # points beyond the unknowns
_STIFF: Final = 1e9  # [Pa], beyond any rubber
_APART: Final = 8.0  # robust standard deviations
_LEAST_APART: Final = 1e-3  # of the largest force
_MOST_APART: Final = 5  # points to name
_MAD: Final = 1.4826  # standard deviation of a normal distribution over its median absolute value
_LOOP: Final = 4.0  # standard errors


def cautions(
    problem: MapProblem, found: Estimate, rows: Mask, labels: Sequence[str], parameters: Parameters
) -> list[str]:
    """Every warning of a fit, in words.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    found : Estimate
        The fit.
    rows : (n,) bool array
        The fitted rows.
    labels : sequence of str
        Which row of the map each of them is.
    parameters : mapping of str to FitParameter
        The fitted numbers.

    Returns
    -------
    list of str
    """
    return [
        *_range(problem, found, rows, len(parameters)),
        *_moduli(found, parameters),
        *_geometry(problem, found, parameters),
        *_points(problem, found, rows, labels),
        *_loops(problem, found, rows),
    ]


def _range(problem: MapProblem, found: Estimate, rows: Mask, unknowns: int) -> list[str]:
    """Cautions about lengths, pressures or points that are too few for the unknowns."""
    notes = []
    span = float(np.ptp(problem.length[rows])) / problem.blank.parameters["rest_length"]
    if found.condition_number > _LARGE_CONDITION:
        notes.append(
            f"condition number {found.condition_number:.2g}: lengths over {100 * span:.3g} % of "
            f"the rest length and {len(np.unique(problem.level[rows]))} pressure levels hardly "
            f"separate {', '.join(found.design.names)}; single moduli mean little, forces inside "
            "the fitted range are not affected"
        )
    if span < _NARROW:
        notes.append(
            f"the fitted lengths span {100 * span:.2g} % of the rest length only: the fit knows "
            "nothing of other lengths"
        )
    spare = int(rows.sum()) - unknowns
    if problem.free and problem.noise is None and spare < _FEW_SPARE:
        notes.append(
            f"{int(rows.sum())} points for {unknowns} unknowns: the scatter, which weighs data "
            "against the tolerances, is hardly known; give noise, fit less, or take more points"
        )
    return notes


def _moduli(found: Estimate, parameters: Parameters) -> list[str]:
    """Cautions about moduli that the points hardly determine, or that no rubber has."""
    notes = []
    moduli = [parameters[name] for name in found.design.names]
    unsure = sum(item.stderr > abs(item.value) for item in moduli)
    if found.design.polynomial and len(found.design.base) > 1 and 2 * unsure >= len(moduli):
        notes.append(
            f"{unsure} of {len(moduli)} moduli are not told from zero: a lower order may predict "
            "as well, compare_models (--compare) ranks them"
        )
    stiff = [item for item in moduli if item.unit == "Pa" and abs(item.value) > _STIFF]
    if stiff:
        named = ", ".join(f"{item.name} = {item.value:.2g} Pa" for item in stiff)
        notes.append(
            f"{named}: beyond 1 GPa, no rubber is that stiff; take a lower order, or "
            "check the units"
        )
    return notes


def _geometry(problem: MapProblem, found: Estimate, parameters: Parameters) -> list[str]:
    """Cautions about free geometry that the points hardly determine, or that moved far from its
    nominal.
    """
    notes = []
    if not found.success:
        notes.append(f"the search of the geometry did not converge: {found.message}")
    for free in problem.free:
        item = parameters[free.name]
        place = with_unit(f"{free.name} = {item.value:.4g}", item.unit)
        nominal = with_unit(f"{free.nominal:.4g}", item.unit)
        if math.isinf(free.tolerance):
            if abs(item.value - free.nominal) > _MOVED * abs(free.nominal):
                share = 100.0 * (item.value / free.nominal - 1.0)
                notes.append(
                    f"{place} moved by {share:+.0f} % from the nominal {nominal}: it stands for "
                    "something else; give a tolerance"
                )
            continue
        if item.stderr_plain > _UNINFORMED * free.tolerance:
            notes.append(
                f"{free.name}: the data say nothing, its value is the prior's (tolerance "
                f"{with_unit(f'{free.tolerance:.3g}', item.unit)})"
            )
        away = abs(free.moved(item.value))
        if away > FAR:
            notes.append(f"{place} lies {away:.1f} tolerances from the nominal {nominal}")
    return notes


def _points(problem: MapProblem, found: Estimate, rows: Mask, labels: Sequence[str]) -> list[str]:
    """Cautions about points that the others do not predict."""
    apart = outlying(problem, found, rows)
    if not apart:
        return []
    force, length, pressure = problem.force[rows], problem.length[rows], problem.pressure[rows]
    weight = problem.weight[rows]
    named = [label for label, fitted in zip(labels, rows.tolist(), strict=True) if fitted]
    words = ", ".join(
        f"{named[i]} ({pressure[i] / 1e3:.4g} kPa, {1e3 * length[i]:.4g} mm: {force[i]:.4g} N, the "
        f"others predict {force[i] - error / weight[i]:.4g} N)"
        for i, error in apart
    )
    which = "it" if len(apart) == 1 else "them"
    apart_by = f"{_APART:g} times their scatter"
    return [f"{words}: further from the other points than {apart_by}; check {which}"]


def outlying(problem: MapProblem, found: Estimate, rows: Mask) -> list[tuple[int, float]]:
    """Outliers, one after the other: each is taken away before the next is sought.

    The error of a point predicted by the others is ``r_i / (1 - h_i)`` with the hat matrix, its
    standard deviation ``sigma / sqrt(1 - h_i)``; sigma is taken from the median of all points,
    which outliers do not move.

    Parameters
    ----------
    problem : MapProblem
        Data and unknowns.
    found : Estimate
        The fit.
    rows : (n,) bool array
        The fitted rows.

    Returns
    -------
    list of (int, float)
        Place among the fitted rows and weighted error of the prediction from the others. Empty with
        few points to spare, and when there are more than 5: then it is the model that errs.
    """
    prior = found.sigma * problem.information(found.design)
    matrix, residual = np.vstack([found.jacobian, np.diag(prior)]), found.residual.copy()
    count = len(residual)
    places = np.arange(count)
    apart: list[tuple[int, float]] = []
    least = _LEAST_APART * float(np.abs(problem.force * problem.weight).max())
    level = problem.level[rows]
    apart_by = _APART + math.log10(max(count, 100) / 100.0) * 2.0
    while len(apart) <= _MOST_APART and len(residual) - matrix.shape[1] >= _FEW_SPARE:
        basis = _basis(matrix)[: len(residual)]
        left = np.clip(1.0 - np.sum(basis**2, axis=1), 0.0, 1.0)
        free = left > 1e-6
        scaled = np.where(free, residual, 0.0) / np.sqrt(np.where(free, left, 1.0))
        ratio = np.abs(scaled) / np.maximum(apart_by * _scatter(scaled, free, level[places]), least)
        at = int(np.argmax(ratio))
        if ratio[at] <= 1.0:
            break
        error = float(residual[at] / left[at])
        apart.append((int(places[at]), error))
        residual = np.delete(residual + basis @ basis[at] * error, at)
        matrix, places = np.delete(matrix, at, axis=0), np.delete(places, at)
    return apart if len(apart) <= _MOST_APART else []


def _scatter(scaled: Array, free: Mask, level: Index) -> Array:
    """Scatter of each point by medians: of all points, or of its own level where that is larger."""
    spread = np.full(len(scaled), _MAD * float(np.median(np.abs(scaled[free]))))
    for group in np.unique(level):
        own = free & (level == group)
        if np.sum(own) >= _FEW_SPARE:
            least = _MAD * float(np.median(np.abs(scaled[own])))
            spread[level == group] = np.maximum(spread[level == group], least)
    return spread


def _basis(matrix: Array) -> Array:
    """Orthonormal columns that span those of a matrix of full rank."""
    if not matrix.shape[1]:
        return matrix
    return np.asarray(np.linalg.qr(matrix / np.linalg.norm(matrix, axis=0))[0])


def _loops(problem: MapProblem, found: Estimate, rows: Mask) -> list[str]:
    """Cautions about directions of motion: only one, exchanged, or loops without friction."""
    way, force = problem.direction[rows], problem.force[rows]
    rubs = problem.blank.has_friction
    if len(way) and not rubs and np.all(way == way[0]) and way[0] != 0:
        word = "contracting" if way[0] < 0 else "lengthening"
        return [f"all rows are {word}: friction cannot be determined and is in the moduli"]
    if rubs or problem.blank.model == "elbow_linear" or not (np.any(way < 0) and np.any(way > 0)):
        return []
    side, residual = way * np.abs(force), found.residual / problem.weight[rows]
    share = float(side @ residual) / float(side @ side)
    rest = residual - share * side
    variance = float(rest @ rest) / (max(len(rest) - 1, 1) * float(side @ side))
    if abs(share) <= _LOOP * math.sqrt(variance):
        return []
    if share < 0.0:
        return [
            f"the forces while lengthening lie {-200 * share:.2g} % below those while contracting: "
            "are the directions exchanged?"
        ]
    return [
        f"the forces while lengthening and contracting differ by +- {100 * share:.2g} %, and the "
        "muscle has no friction: fit it first, fit_friction(data).to_muscle(muscle) (--friction "
        "fit)"
    ]
