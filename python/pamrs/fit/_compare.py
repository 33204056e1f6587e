"""Compares force models, ranked by the prediction of pressures that their fit has not seen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import refused
from pamrs.errors import FitError, ParameterError
from pamrs.fit._cautions import FAR
from pamrs.fit._data import ForceMap
from pamrs.fit._design import CONSTANTS, template
from pamrs.fit._result import MuscleFit
from pamrs.fit._solution import COEFFICIENTS, fit_muscle, has_effect, level_indices
from pamrs.rig import Muscle
from pamrs.rig.muscle_models import ELASTIC_PARAMETERS, MODELS, POLYNOMIAL_MODELS

_NEAR: Final = 1.25  # times the best leave-one-pressure-out error, for a recommendation


@dataclass(frozen=True, eq=False, repr=False)
class ModelComparison:
    """Models side by side: made by :func:`compare_models`.

    Attributes
    ----------
    rows : list of dict
        One entry a candidate, best first, those that could not be ranked last. Errors are fractions
        of the map's largest force.

        ``model``, ``order``, ``geometry``, ``free`` (list), ``nvarys``, ``condition_number``;
        ``rank``: 1 is best, None when the data do not determine the candidate, with ``reason`` in
        words; ``rms``, ``max``: all levels fitted; ``lopo_rms``, ``lopo_max``, ``lopo_stderr``:
        leave-one-pressure-out over all points, ``lopo_interior_rms``, ``lopo_end_rms``: levels
        between others, and the two outer levels; ``lopo_excess``, ``lopo_excess_stderr``: squared
        leave-one-pressure-out error of a level beyond that of the first rank, mean over the levels
        and its standard error, in squares of the map's largest force; ``aicc``, ``bic``: with the
        effective sample size, ``aicc`` None when that is too small for the number of unknowns;
        ``subset_rms``, ``subset_max``: fitted to the chosen levels only, error on the others, with
        ``subset_reason`` when impossible; ``moved``: how far the farthest fitted size lies from
        what was known of it [tolerances]; ``recommended``: True for one candidate.
    fits : dict of (model, order) to MuscleFit
        The fits of all levels.
    effective_size : float
        Independent points in the map, see :func:`compare_models`.
    ndata : int
        Points in the map.
    subset : list of float
        Pressures of the chosen levels [Pa]; empty without.
    notes : tuple of str
        What to know before using the ranking.
    """

    rows: list[dict[str, Any]]
    fits: dict[tuple[str, int | None], MuscleFit]
    effective_size: float
    ndata: int
    subset: list[float]
    notes: tuple[str, ...] = ()

    @property
    def best(self) -> MuscleFit:
        """The fit of the first rank."""
        return self._fit(self.rows[0])

    @property
    def recommended(self) -> MuscleFit:
        """The fit with the fewest unknowns of those that predict no worse than the best and whose
        geometry is plausible, see :func:`compare_models`.
        """
        return self._fit(next(row for row in self.rows if row["recommended"]))

    def _fit(self, row: Mapping[str, Any]) -> MuscleFit:
        return self.fits[row["model"], row["order"]]

    def to_dicts(self) -> list[dict[str, Any]]:
        """Copies of :attr:`rows`, plain numbers and text."""
        return [dict(row) for row in self.rows]

    def to_text(self) -> str:
        """The comparison as a table; errors in percent of the largest force."""
        head = (
            f"{'rank':>4}  {'model':15} {'M':>2} {'k':>3} {'rms':>6} {'max':>6} | {'LOPO rms':>8} "
            f"{'max':>6} {'ends':>6} | {'AICc':>7} {'BIC':>7}"
        )
        lines = [
            f"{self.ndata} points, effectively {self.effective_size:.3g} independent, the number "
            "that AICc and BIC here count",
            "errors in % of the map's largest force; k unknowns",
        ]
        if self.subset:
            levels = ", ".join(f"{p / 1e3:g}" for p in self.subset)
            lines.append(f"subset: fitted to {levels} kPa, error on the other levels")
            head += f" | {'subset':>7} {'max':>6}"
        lines += [
            head,
            *map(self._line, self.rows),
            "* fewest unknowns among those that predict pressures left out (LOPO) no worse than "
            "rank 1:",
            "  the excess of their squared errors, level by level, is within one standard error, "
            f"their rms within {_NEAR:g} times",
        ]
        lines += [f"note: {note}" for note in self.notes]
        return "\n".join(lines) + "\n"

    def _line(self, row: Mapping[str, Any]) -> str:
        def share(name: str, width: int) -> str:
            return f"{'-':>{width}}" if row[name] is None else f"{100 * row[name]:{width}.2f}"

        def number(name: str) -> str:
            return f"{'-':>7}" if row[name] is None else f"{row[name]:7.1f}"

        place = "-" if row["rank"] is None else f"{row['rank']}{'*' if row['recommended'] else ''}"
        start = f"{place:>4}  {row['model']:15} {row['order'] or '':>2} {row['nvarys']:3d} "
        if row["rank"] is None:
            return start + f"not ranked: {row['reason']}"
        line = (
            f"{start}{share('rms', 6)} {share('max', 6)} | {share('lopo_rms', 8)} "
            f"{share('lopo_max', 6)} {share('lopo_end_rms', 6)} | {number('aicc')} {number('bic')}"
        )
        subset = f" | {share('subset_rms', 7)} {share('subset_max', 6)}" if self.subset else ""
        return line + subset

    def __repr__(self) -> str:
        ranked = sum(row["rank"] is not None for row in self.rows)
        first = self.rows[0]
        best = f"{first['model']} {first['order'] or ''}"
        return f"ModelComparison({ranked} of {len(self.rows)} ranked, best {best})"


def compare_models(
    data: ForceMap,
    muscle: Muscle,
    *,
    models: Iterable[str] | None = None,
    orders: Iterable[int] = (1, 2, 3, 4),
    free: Iterable[str] = (),
    tolerance: Mapping[str, float] | None = None,
    levels: Sequence[float] | None = None,
    weights: str = "force",
    direction: str | None = "data",
    noise: float | None = None,
) -> ModelComparison:
    """Fit every model and order, and rank them by leave-one-pressure-out error.

    The ranking asks what a fit is for: pressures that were not measured. AICc and BIC are given
    with it, computed with the number of effectively independent points, since residuals of a
    quasi-static map are smooth model error and counting every point would favour many unknowns.
    That number is ``n (1 - r_e)/(1 + r_e) (1 - r_P)/(1 + r_P)`` with the correlation of
    neighbouring residuals along contraction and along pressure (negative ones count as 0), of the
    best-ranked candidate, and at least the number of pressure levels.

    Recommended is the candidate with the fewest unknowns among those that predict no worse than the
    first rank; one whose fitted geometry lies within three tolerances of what was known of it goes
    before one whose does not. No worse means: the squared errors of each level left out are
    subtracted level by level, and the mean of these differences may be one standard error at most.
    Differences of pairs do not know the scatter that all candidates share, such as hysteresis or
    noise.

    Parameters
    ----------
    data : ForceMap
        Measured forces.
    muscle : Muscle
        Nominal muscle; its friction is that of every candidate.
        :meth:`pamrs.fit.FrictionFit.to_muscle` gives it that of the loops.
    models : iterable of str, optional
        Models to compare; all by default.
    orders : iterable of int
        Orders of the models with a stress polynomial.
    free, tolerance
        Geometry to fit and what is known, as in :func:`pamrs.fit.fit_muscle`; what a model does not
        have is left out for that model.
    levels : sequence of int or float, optional
        Indices or pressures of a few levels: every candidate is also fitted to these alone and its
        error on the others shown.
    weights, direction, noise
        As in :func:`pamrs.fit.fit_muscle`.

    Returns
    -------
    ModelComparison
        Candidates that the data do not determine are listed with the reason, and not ranked.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    FitError
        If the data determine none of the candidates.
    """
    chosen = list(MODELS if models is None else models)
    wanted = sorted({int(order) for order in orders})
    unknown = [name for name in chosen if name not in MODELS]
    if unknown or not chosen:
        raise refused("models", chosen, f"of {', '.join(MODELS)}")
    pairs = [
        (name, order)
        for name in chosen
        for order in (wanted if name in POLYNOMIAL_MODELS else [None])
    ]
    if not pairs:
        raise ParameterError("orders is empty: models with a stress polynomial need one at least")
    rows: list[dict[str, Any]] = []
    fits: dict[tuple[str, int | None], MuscleFit] = {}
    names = tuple(free)
    shared = {"weights": weights, "direction": direction, "noise": noise}
    for name, order in pairs:
        blank = template(muscle, name, None if name != muscle.model else muscle.geometry, order)
        used = tuple(item for item in names if has_effect(item, name, blank.geometry))
        foreign = set(COEFFICIENTS) - set(ELASTIC_PARAMETERS[name])
        spread = {key: value for key, value in (tolerance or {}).items() if key not in foreign}
        settings = {"model": name, "order": order, "free": used, "tolerance": spread, **shared}
        row, fit = _candidate(data, muscle, settings, levels)
        rows.append({**row, "geometry": blank.geometry, "free": list(used)})
        if fit is not None:
            fits[name, order] = fit
    ranked, size = _ranked(rows, fits)
    subset = [] if levels is None else [float(data.levels[i]) for i in level_indices(data, levels)]
    rows = ranked + [row for row in rows if row["reason"] is not None]
    count = int(data.used.sum())
    return ModelComparison(rows, fits, size, count, subset, _loops(data, muscle, direction))


def _ranked(
    rows: list[dict[str, Any]], fits: Mapping[tuple[str, int | None], MuscleFit]
) -> tuple[list[dict[str, Any]], float]:
    """The candidates by rank, their criteria written into them, and the number of independent
    points.

    Raises
    ------
    FitError
        If no candidate was fitted.
    """
    ranked = [row for row in rows if row["reason"] is None]
    ranked.sort(key=lambda row: (row["lopo_rms"], row["nvarys"]))
    if not ranked:
        reasons = "; ".join(f"{row['model']}: {row['reason']}" for row in rows)
        raise FitError(f"the data determine none of the candidates: {reasons}")
    first = fits[ranked[0]["model"], ranked[0]["order"]]
    size, least = effective_size(first), _level_squares(first)
    for place, row in enumerate(ranked, start=1):
        fit = fits[row["model"], row["order"]]
        _, row["aicc"], row["bic"] = fit.criteria(size)
        row["rank"] = place
        excess = _level_squares(fit) - least
        row["lopo_excess"] = float(excess.mean())
        row["lopo_excess_stderr"] = float(np.std(excess, ddof=1)) / math.sqrt(len(excess))
    # a candidate that fails at one level only has an excess of one standard error, however large
    near = _NEAR * ranked[0]["lopo_rms"]
    eligible = [r for r in ranked if r["lopo_excess"] <= r["lopo_excess_stderr"]]
    recommend([r for r in eligible if r["lopo_rms"] <= near])["recommended"] = True
    return ranked, size


def recommend(eligible: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Choose among candidates that predict equally well: one whose geometry is as measured, if
    there is one; of these the one with the fewest unknowns.

    Parameters
    ----------
    eligible : sequence of dict
        Rows of a comparison with ``moved``, ``nvarys`` and ``lopo_rms``.
    """
    return min(eligible, key=lambda row: (row["moved"] > FAR, row["nvarys"], row["lopo_rms"]))


def _loops(data: ForceMap, muscle: Muscle, direction: str | None) -> tuple[str, ...]:
    """Note on loops of a muscle without friction, for which only one model has two branches."""
    if direction is None or muscle.has_friction or not data.has_loops:
        return ()
    return (
        "the rows are loops and the muscle has no friction: only elbow_linear has a branch for "
        "each direction, which favours it; fit friction first, "
        "fit_friction(data).to_muscle(muscle)",
    )


_COLUMNS: Final = (
    "rank", "reason", "condition_number", "rms", "max", "lopo_rms", "lopo_max", "lopo_stderr",
    "lopo_interior_rms", "lopo_end_rms", "lopo_excess", "lopo_excess_stderr", "aicc", "bic",
    "subset_rms", "subset_max", "subset_reason", "moved",
)  # fmt: skip


def _level_squares(fit: MuscleFit) -> Array:
    """Squared leave-one-pressure-out errors of each level, over the squared largest force."""
    top = float(fit.data.force[fit.data.used].max())
    return fit.leave_one_pressure_out().level_squares() / top**2


def _candidate(
    data: ForceMap, muscle: Muscle, settings: dict[str, Any], levels: Sequence[float] | None
) -> tuple[dict[str, Any], MuscleFit | None]:
    """One row of the table, and the fit of all levels where there is one."""
    row = {name: settings[name] for name in ("model", "order")}
    row |= {"nvarys": _unknowns(settings), "recommended": False} | dict.fromkeys(_COLUMNS)
    try:
        fit = fit_muscle(data, muscle, **settings)
        cross = fit.leave_one_pressure_out()
    except FitError as reason:
        return row | {"reason": str(reason)}, None
    moved = [abs(free.moved(fit.params[free.name].value)) for free in fit.free]
    row |= {
        "condition_number": fit.condition_number,
        "rms": fit.rms_error,
        "max": fit.max_error,
        "lopo_rms": cross.rms,
        "lopo_max": cross.max,
        "lopo_stderr": cross.rms_stderr,
        "lopo_interior_rms": cross.interior_rms,
        "lopo_end_rms": cross.end_rms,
        "moved": max(moved, default=0.0),
    }
    if levels is not None:
        try:
            others = fit_muscle(data, muscle, levels=levels, **settings).errors_of("held_out")
        except FitError as reason:
            row["subset_reason"] = str(reason)
        else:
            if others is None:
                raise ParameterError(
                    f"levels = {list(levels)} are all levels of the map: none is left to predict"
                )
            row["subset_rms"], row["subset_max"] = others
    return row, fit


def _unknowns(settings: Mapping[str, Any]) -> int:
    name, count = settings["model"], len(settings["free"])
    if name in POLYNOMIAL_MODELS:
        return count + int(2 * settings["order"])
    return count + len(CONSTANTS[name])


def effective_size(fit: MuscleFit) -> float:
    """Number of effectively independent points of a fit, from the correlation of neighbouring
    residuals.

    Parameters
    ----------
    fit : MuscleFit
        Its fitted rows are ordered by level, then by length.

    Returns
    -------
    float
        Between the number of levels and ``ndata``.
    """
    rows = fit.fitted
    level, length, way = fit.data.level[rows], fit.data.length[rows], fit.data.direction[rows]
    order = np.lexsort((length, level, way))
    level, length, way, residual = level[order], length[order], way[order], fit.residual[order]
    # neighbours on one branch: the branches of a loop lie apart
    same = (level[1:] == level[:-1]) & (way[1:] == way[:-1])
    along = _correlation(residual[1:][same], residual[:-1][same])
    below, above = [np.empty(0)], [np.empty(0)]
    for branch in np.unique(way):
        groups = [(level == group) & (way == branch) for group in np.unique(level[way == branch])]
        for lower, upper in zip(groups[:-1], groups[1:], strict=True):
            at = (length[lower] >= length[upper][0]) & (length[lower] <= length[upper][-1])
            below.append(residual[lower][at])
            above.append(np.interp(length[lower][at], length[upper], residual[upper]))
    across = _correlation(np.concatenate(below), np.concatenate(above))
    size = len(residual) * (1.0 - along) / (1.0 + along) * (1.0 - across) / (1.0 + across)
    return float(min(max(size, len(np.unique(level))), len(residual)))


def _correlation(one: Array, other: Array) -> float:
    """Correlation about zero, negative values as 0."""
    spread = math.sqrt(float(one @ one) * float(other @ other))
    return max(float(one @ other) / spread, 0.0) if spread > 0.0 else 0.0
