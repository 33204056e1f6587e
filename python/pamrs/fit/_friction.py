"""Friction of a muscle from its hysteresis loops: the coefficients of (2.36).

``F_total = F + d c_F |F|`` with ``c_F = max(c0 + c1 P, floor)`` and ``d`` = -1 while contracting,
+1 while lengthening (Robinson 2014, (2.36)). At one contraction half the difference of the two
branches is ``c_F |F|`` and half their sum is ``F``, whatever the force model: friction comes from
the loops alone, and the mean curve goes to the fit of the moduli.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array, ArrayLike, Index, Mask
from pamrs._checks import refused
from pamrs._views import COLOURS, Panels, View
from pamrs.errors import ParameterError, RecordingError
from pamrs.findings import to_plain
from pamrs.fit._data import ForceMap
from pamrs.fit._export import to_lmfit
from pamrs.fit._validation import WEAK
from pamrs.fit._ways import held_lengths
from pamrs.fit.levels import LawParameter, LevelLine, fit_levels
from pamrs.rig import Muscle

_FEWEST: Final = 4  # rows of a branch
_BINS: Final = 200  # of a branch's contraction: rows nearer than that are averaged
# stretches of contraction whose coefficients are compared for the standard error
_BLOCKS: Final = 8
# of a level's largest mean force: below it a loop tells nothing about the ratio
_SLACK: Final = 0.05
# of the presliding distance, where slip elements of 1/8, 1/4, 1/2 and 1 of it average to zero
_HALFWAY: Final = 2.0 / 7.0
_PART_WAY: Final = 0.95  # of the way to either branch: rows within are in transition
_RESOLVED: Final = 3  # rows in transition that a reversal needs
_NEAR_TURN: Final = 0.05  # of the range of a pressure cycle, where the force is between branches
_SIGNIFICANT: Final = 0.05
_SURE: Final = 4.0  # standard errors, for a friction that nobody asked about
_OF_A_LEVEL: Final = (
    *("pressure", "coefficient", "stderr", "law", "at_floor", "rows"),
    *("contraction", "force", "half_width"),
)
_OF_A_FIT: Final = (
    *("parameters", "floor", "presliding", "presliding_reason", "levels", "residual", "ndata"),
    *("nvarys", "nfree", "redchi", "between", "covar", "slope_pvalue", "slope_significant"),
    *("isometric", "issues"),
)


@dataclass(frozen=True, slots=True)
class FrictionLevel:
    """The loop of one pressure.

    Attributes
    ----------
    pressure : float
        Gauge pressure [Pa].
    coefficient, stderr : float
        ``c_F`` and its standard error from the scatter over the contraction [1].
    contraction, force, half_width : (k,) array
        Contractions of the branch with fewer of them, within both [1], mean force of the branches
        there [N], half their difference [N].
    pressures : (k,) array
        Gauge pressure at each of them [Pa]: that of the level, or, at held lengths, those of the
        branch with fewer of them.
    rows : int
        Rows of both branches.
    at_floor : bool
        Whether the fitted law is on its floor here.
    """

    pressure: float
    coefficient: float
    stderr: float
    contraction: Array
    force: Array
    half_width: Array
    pressures: Array
    rows: int
    at_floor: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class FrictionFit(View):
    """Friction coefficients of a muscle; the names are those of lmfit's results where there is one.

    Attributes
    ----------
    params : dict of str to LawParameter
        ``friction_coefficient`` [1] and ``friction_pressure_slope`` [1/Pa].
    floor : float
        The least that ``c_F`` becomes, as given [1].
    presliding : float or None
        Distance of motion over which the force goes from one branch to the other [m]; None if not
        determinable.
    presliding_reason : str
        How it was found, or why it is not determinable.
    levels : list of FrictionLevel
        By rising pressure.
    best_fit, residual : (m,) array
        ``c_F`` of the law at the levels, and measured minus law [1].
    ndata, nvarys, nfree : int
        Levels above the floor, coefficients, and their difference.
    redchi : float
        Reduced chi-square with the levels' own errors; NaN without a spare level.
    between : float
        Scatter of the levels about the law beyond their own errors [1]; NaN without a spare level.
    covar : (2, 2) array
        Covariance of the coefficients.
    slope_pvalue : float
        Chance of a slope this far from zero if there were none; NaN without a spare level.
    issues : list of str
        What was found.
    isometric : bool
        Whether the loops are those of pressure cycles at held lengths.
    """

    params: dict[str, LawParameter]
    floor: float
    presliding: float | None
    presliding_reason: str
    levels: list[FrictionLevel]
    best_fit: Array
    residual: Array
    ndata: int
    nvarys: int
    nfree: int
    redchi: float
    between: float
    covar: Array
    slope_pvalue: float
    issues: list[str]
    isometric: bool = False

    def _law(self) -> tuple[LawParameter, LawParameter]:
        """Offset and slope of the law."""
        return self.params["friction_coefficient"], self.params["friction_pressure_slope"]

    def __repr__(self) -> str:
        c0, c1 = (item.value for item in self._law())
        law = f"max({c0:.4g} {'-' if c1 < 0.0 else '+'} {1e6 * abs(c1):.4g}/MPa P, {self.floor:g})"
        return f"FrictionFit(c_F = {law}, {len(self.levels)} levels)"

    def _panels(self) -> Panels:
        return {"coefficient": self._draw}

    def _draw(self, axes: Any) -> None:
        """Coefficient of each level with two standard errors, and the law."""
        pressure, value, error = _columns(self.levels)
        grid = np.linspace(0.0, 1.08 * float(pressure.max()), 200)
        axes.plot(grid / 1e3, self.predict(grid), color=COLOURS[0], lw=1.6, label="law")
        style: dict[str, Any] = {"fmt": "o", "ms": 5, "color": COLOURS[1], "lw": 0.9}
        axes.errorbar(pressure / 1e3, value, 2.0 * error, label="each level, ± 2 s.e.", **style)
        axes.axhline(self.floor, color="0.4", lw=0.8, ls=(0, (1, 2)), label="floor")
        axes.set_xlim(0.0, grid[-1] / 1e3)
        axes.set_ylim(bottom=min(0.0, 1.1 * float(np.min(value - 2.0 * error))))
        axes.set_xlabel("pressure [kPa]")
        axes.set_ylabel("friction coefficient [1]")
        axes.legend(loc="best")

    def _numbers(self) -> dict[str, str]:
        c0, c1 = self._law()
        return {
            "c0": f"{c0.value:.4g} ± {c0.stderr:.2g}",
            "c1": f"{1e6 * c1.value:.4g} ± {1e6 * c1.stderr:.2g} 1/MPa",
            "floor": f"{self.floor:g}",
            "presliding": self.presliding_reason,
        }

    @property
    def told(self) -> bool:
        """True where the loops distinguish a friction from none: two levels or more are above the
        floor, and all levels together are by four standard errors.
        """
        mean, spread = _pooled(self.levels)
        return self.ndata >= 2 and mean > _SURE * spread

    @property
    def slope_significant(self) -> bool:
        """True where the slope over pressure differs from zero at 5 %; False where that cannot be
        tested.
        """
        return self.slope_pvalue < _SIGNIFICANT

    def predict(self, pressure: ArrayLike) -> Array:
        """``c_F`` at gauge pressures [Pa].

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].

        Returns
        -------
        ndarray

        Raises
        ------
        ParameterError
            If a pressure is not finite.
        """
        p = np.asarray(pressure, dtype=np.float64)
        if not np.all(np.isfinite(p)):
            raise ParameterError("pressure: a value is not finite")
        c0, c1 = (item.value for item in self._law())
        return np.maximum(c0 + c1 * p, self.floor)

    def to_muscle(self, muscle: Muscle) -> Muscle:
        """The muscle with this friction.

        Parameters
        ----------
        muscle : Muscle
            Any muscle.

        Returns
        -------
        Muscle
            A copy with the friction arguments replaced; its presliding distance stays where none
            was determinable.
        """
        changes = {name: parameter.value for name, parameter in self.params.items()}
        changes["friction_floor"] = self.floor
        if self.presliding is not None:
            changes["friction_presliding"] = self.presliding
        return muscle.replace(**changes)

    def to_lmfit(self) -> Any:
        """The fitted numbers as ``lmfit.Parameters``: values, standard errors and correlations, SI
        units in ``user_data["unit"]``.

        Raises
        ------
        MissingPackageError
            If lmfit is not installed.
        """
        return to_lmfit(self.params, self.covar)

    def fit_report(self) -> str:
        """The result in words and a table."""
        c0, c1 = self._law()
        lines = [
            "friction of the muscle: F_total = F + d c_F |F|, c_F = max(c0 + c1 P, floor)",
            f"  c0 = {c0.value:.4g} +- {c0.stderr:.2g}",
            f"  c1 = {c1.value * 1e6:.4g} +- {c1.stderr * 1e6:.2g} 1/MPa ({self._slope_words()})",
            f"  floor = {self.floor:g} (given)",
            f"  presliding: {self.presliding_reason}",
            "  pressure [kPa]    c_F +- s.e.         law   rows",
        ]
        for level, law in zip(self.levels, self.best_fit.tolist(), strict=True):
            floor = "  on the floor" if level.at_floor else ""
            lines.append(
                f"  {level.pressure / 1e3:11.1f}{level.coefficient:10.4f} +- "
                f"{level.stderr:.4f}{law:10.4f}{level.rows:7d}{floor}"
            )
        return "\n".join([*lines, *(f"  note: {issue}" for issue in self.issues)])

    def to_dict(self) -> dict[str, Any]:
        """The result as plain data, SI units; None where a number is not determinable."""
        levels = [
            {key: law if key == "law" else getattr(level, key) for key in _OF_A_LEVEL}
            for level, law in zip(self.levels, self.best_fit.tolist(), strict=True)
        ]
        own = {"parameters": [asdict(item) for item in self.params.values()], "levels": levels}
        plain = {key: own[key] if key in own else getattr(self, key) for key in _OF_A_FIT}
        found: dict[str, Any] = to_plain(plain)
        return found

    def _slope_words(self) -> str:
        if math.isnan(self.slope_pvalue):
            return "its significance cannot be tested without a spare pressure"
        word = "significant" if self.slope_significant else "not significant"
        return f"{word}, p = {self.slope_pvalue:.2g}"


def fit_friction(data: ForceMap, *, floor: float = 0.01) -> FrictionFit:
    """Friction coefficients from the hysteresis loops of a muscle.

    Parameters
    ----------
    data : ForceMap
        Length cycles at held pressures, or pressure cycles at held lengths (isometric). Without
        directions of motion they are those of the rows' order (:meth:`ForceMap.with_directions`).
    floor : float
        The least that ``c_F`` becomes; 0.01 in (2.36).

    Returns
    -------
    FrictionFit

    Raises
    ------
    ParameterError
        If ``floor`` is negative or not below 1.
    RecordingError
        If no direction is known or can be inferred, or fewer than two pressures have both branches.
    """
    if not (math.isfinite(floor) and 0.0 <= floor < 1.0):
        raise refused("floor", floor, "at least 0 and below 1")
    data = data.with_directions()
    gas, e, _, _, way = data.used_rows()
    if not np.any(way):
        raise RecordingError(f"{data.label}: {_NO_WAY}")
    held = held_lengths(e, gas)
    levels, issues = _isometric_levels(data, held) if held else _loops(data)
    pressure, coefficient, _ = _columns(levels)
    line, above = _law(levels, floor)
    above &= coefficient > floor
    issues += _doubts(levels, above, floor)
    levels = [replace(x, at_floor=not bool(on)) for x, on in zip(levels, above, strict=True)]
    free = max(int(above.sum()) - 2, 0)
    distance, reason = None, "not determinable: the length is held"
    if not held:
        distance, reason = _presliding(data, levels)
    best = np.maximum(line.values[0] + line.values[1] * pressure, floor)
    names = {"friction_coefficient": "1", "friction_pressure_slope": "1/Pa"}
    return FrictionFit(
        params={
            name: LawParameter(name, float(line.values[k]), float(line.stderr[k]), unit)
            for k, (name, unit) in enumerate(names.items())
        },
        floor=floor,
        presliding=distance,
        presliding_reason=reason,
        levels=levels,
        best_fit=best,
        residual=coefficient - best,
        ndata=int(above.sum()),
        nvarys=2,
        nfree=free,
        redchi=line.redchi,
        between=line.between,
        covar=line.covar,
        slope_pvalue=_pvalue(line, free),
        issues=issues,
        isometric=bool(held),
    )


def _loops(data: ForceMap) -> tuple[list[FrictionLevel], list[str]]:
    """The loop of every pressure that has one, and what was found of the others.

    Raises
    ------
    RecordingError
        If fewer than two pressures have both branches.
    """
    gas, e, pull, level, way = data.used_rows()
    issues = list(data.issues)
    unknown = int(np.sum(way == 0))
    if unknown:
        issues.append(f"{unknown} rows have no direction of motion: not used here")
    levels: list[FrictionLevel] = []
    least = WEAK * float(np.abs(pull).max())
    for index, nominal in enumerate(data.levels.tolist()):
        rows, title = level == index, f"{nominal / 1e3:.0f} kPa"
        if float(np.abs(pull[rows]).max()) < least:
            issues.append(
                f"{title}: forces below {100 * WEAK:g} % of the map's largest: no coefficient"
            )
            continue
        found = _loop(float(np.median(gas[rows])), e[rows], pull[rows], way[rows])
        if isinstance(found, str):
            issues.append(f"{title}: {found}: no coefficient")
        else:
            levels.append(found)
    if not levels:
        raise RecordingError(f"{data.label}: no pressure gives a coefficient ({'; '.join(issues)})")
    if len(levels) < 2:
        raise RecordingError(
            f"{data.label}: one pressure only ({levels[0].pressure / 1e3:.0f} kPa): the slope c1 "
            "is not determinable"
        )
    return levels, issues


_NO_WAY: Final = (
    "friction needs both branches of a loop, and no row has a direction of motion: give a column "
    "direction (-1 or 'contracting', 1 or 'lengthening'), or the rows in the order measured, over "
    "length and back at each pressure or over pressure and back at each length"
)
"""Request for a map with directions."""


def _isometric_levels(data: ForceMap, held: list[Index]) -> tuple[list[FrictionLevel], list[str]]:
    """The loops of pressure cycles at held lengths, by bands of pressure.

    The law (2.36) is about motion between the fittings; held, the braid still slides where the
    muscle pulls itself straight: rising pressure is its contracting.

    Raises
    ------
    RecordingError
        If too few pressures have both branches.
    """
    gas, e, pull, _, way = data.used_rows()
    note = "loops of pressure at held lengths: rising pressure counts as contracting"
    issues = [*data.issues, note]
    pairs = []
    for part in held:
        found = _pairs(gas[part], pull[part], way[part])
        length = f"{100.0 * float(np.median(e[part])):.3g} % contraction"
        if isinstance(found, str):
            issues.append(f"{length}: {found}: not used")
            continue
        grid, mean, half = found
        low, high = float(gas[part].min()), float(gas[part].max())
        margin = _NEAR_TURN * (high - low)
        inside = (grid >= low + margin) & (grid <= high - margin)
        at = np.full(len(grid), float(np.median(e[part])))
        pairs.append(np.column_stack([grid, at, mean, half])[inside])
    rows = np.concatenate(pairs) if pairs else np.empty((0, 4))
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    bands = min(_BLOCKS, len(rows) // _FEWEST)
    if bands < 2:
        raise RecordingError(
            f"{data.label}: {len(rows)} pressures have both branches at a held length, "
            f"{2 * _FEWEST} at least are needed" + (f" ({'; '.join(issues)})" if issues else "")
        )
    levels = []
    for band in np.array_split(rows, bands):
        pressure, at, mean, half = band.T
        coefficient, stderr = _coefficient(mean, half)
        size = np.abs(mean)
        middle = _ratio(pressure * size, size)  # weighted as the ratios are
        parts = coefficient, stderr, at, mean, half, pressure, len(band)
        levels.append(FrictionLevel(middle, *parts))
    return levels, issues


def _doubts(levels: list[FrictionLevel], above: Mask, floor: float) -> list[str]:
    """Doubts about a friction law: levels at the floor, branches that are exchanged."""
    found: list[str] = []
    if above.sum() == 1:
        found.append(
            f"only one pressure is above the floor of {floor:g}: the slope c1 is hardly "
            "determined by it and its neighbour"
        )
    pooled, spread = _pooled(levels)
    if pooled < -_SURE * spread:
        found.append(
            f"forces while lengthening lie below those while contracting (c_F = {pooled:.2g} "
            f"+- {spread:.1g}): are the directions exchanged?"
        )
    if not above.any():
        found.append(
            f"no coefficient is above the floor of {floor:g}: the law is its floor at every "
            "pressure"
        )
    return found


def _loop(
    pressure: float, contraction: Array, force: Array, way: NDArray[np.int8]
) -> FrictionLevel | str:
    """The loop of one level, or why it has none."""
    found = _pairs(contraction, force, way)
    if isinstance(found, str):
        return found
    grid, mean, half = found
    coefficient, stderr = _coefficient(mean, half)
    at = np.full(len(grid), pressure)
    return FrictionLevel(pressure, coefficient, stderr, grid, mean, half, at, int(np.sum(way != 0)))


def _pairs(
    abscissa: Array, force: Array, way: NDArray[np.int8]
) -> tuple[Array, Array, Array] | str:
    """Contractions that both branches of a loop cover, their mean force there and half their
    difference; or the reason why there are none.
    """
    branches = [(abscissa[way == d], force[way == d]) for d in (-1, 1)]
    for (at, _), word in zip(branches, ("contracting", "lengthening"), strict=True):
        if len(at) < _FEWEST:
            return f"{len(at)} rows while {word}, {_FEWEST} at least are needed"
    merged = [_merged(at, f) for at, f in branches]
    low, high = max(float(at[0]) for at, _ in merged), min(float(at[-1]) for at, _ in merged)
    grid = min((at[(at >= low) & (at <= high)] for at, _ in merged), key=len)
    if len(grid) < _FEWEST:
        return f"the two branches share {len(grid)} contractions, {_FEWEST} at least are needed"
    shortening, lengthening = (np.interp(grid, at, f) for at, f in merged)
    return grid, 0.5 * (lengthening + shortening), 0.5 * (lengthening - shortening)


def _coefficient(mean: Array, half: Array) -> tuple[float, float]:
    """``c_F`` of a loop and its standard error, from the scatter of stretches of it."""
    size = np.abs(mean)
    strong = size > _SLACK * float(size.max())
    coefficient = _ratio(half[strong], size[strong])
    blocks = [part for part in np.array_split(np.flatnonzero(strong), _BLOCKS) if len(part)]
    parts = np.array([_ratio(half[part], size[part]) for part in blocks])
    stderr = float(np.std(parts, ddof=1) / math.sqrt(len(parts))) if len(parts) > 1 else 0.0
    return coefficient, stderr


def _merged(contraction: Array, force: Array) -> tuple[Array, Array]:
    """One branch by rising contraction; repeated passes are averaged."""
    spacing = float(np.ptp(contraction)) / _BINS
    bins = np.zeros(len(force), dtype=np.int64)
    if spacing > 0.0:
        bins = np.rint((contraction - contraction.min()) / spacing).astype(np.int64)
    _, inverse, counts = np.unique(bins, return_inverse=True, return_counts=True)
    return np.bincount(inverse, contraction) / counts, np.bincount(inverse, force) / counts


def _ratio(half: Array, size: Array) -> float:
    """Slope of ``half = c size`` by least absolute deviations: the weighted median of the
    ratios.
    """
    ratio = half / size
    order = np.argsort(ratio)
    share = np.cumsum(size[order])
    return float(ratio[order][np.searchsorted(share, 0.5 * share[-1])])


def _columns(levels: list[FrictionLevel]) -> tuple[Array, Array, Array]:
    """Pressure, coefficient and its standard error of the levels."""
    pressure, coefficient, stderr = (
        np.array([getattr(x, key) for x in levels]) for key in ("pressure", "coefficient", "stderr")
    )
    return pressure, coefficient, stderr


def _pooled(levels: list[FrictionLevel]) -> tuple[float, float]:
    """One coefficient for all levels and its standard error, from the levels' own errors or their
    scatter, whichever is larger.
    """
    _, value, error = _columns(levels)
    weight = 1.0 / np.maximum(error, 1e-9) ** 2
    mean = float(weight @ value / weight.sum())
    return mean, float(1.0 / math.sqrt(weight.sum()))


def _law(levels: list[FrictionLevel], floor: float) -> tuple[LevelLine, Mask]:
    """The line through the levels above the floor, and which they are: the split with the least
    squares of ``max(line, floor)``.
    """
    pressure, value, error = _columns(levels)
    design = np.column_stack([np.ones_like(pressure), pressure])
    count = len(levels)
    best: tuple[float, LevelLine, Mask] | None = None
    splits = [(0, n) for n in range(count, 1, -1)] + [(n, count) for n in range(1, count - 1)]
    for first, last in splits:
        above = (np.arange(count) >= first) & (np.arange(count) < last)
        line = fit_levels(design[above], value[above], error[above])
        law = design @ line.values
        if np.any(law[~above] > floor) or np.all(law[above] <= floor):
            continue
        score = float(np.sum((value - np.maximum(law, floor)) ** 2))
        if best is None or score < 0.999 * best[0] - 1e-18:
            best = (score, line, above)
    if best is None:
        return fit_levels(design, value, error), np.zeros(count, dtype=bool)
    return best[1], best[2]


def _pvalue(line: LevelLine, free: int) -> float:
    if free < 1:
        return math.nan
    if line.stderr[1] == 0.0:
        return 0.0 if line.values[1] != 0.0 else 1.0
    from scipy.stats import t

    return float(2.0 * t.sf(abs(line.values[1]) / line.stderr[1], free))


def _presliding(data: ForceMap, levels: list[FrictionLevel]) -> tuple[float | None, str]:
    """Median presliding distance [m] over the reversals, in which 2/7 of it leads halfway to the
    other branch, and words on it; None where it is not determinable.
    """
    _, contraction, force, level, way = data.used_rows()
    coefficients = {int(np.argmin(np.abs(data.levels - x.pressure))): x.coefficient for x in levels}
    turns = np.flatnonzero((level[1:] == level[:-1]) & (way[1:] == -way[:-1]) & (way[1:] != 0)) + 1
    found: list[float] = []
    sparse = 0
    for turn in turns:
        c = coefficients.get(int(level[turn]), 0.0)
        before, after = _runs(level, way, int(turn))
        if c <= 0.0 or before.stop - before.start < _FEWEST:
            sparse += 1
            continue
        order = np.argsort(contraction[before], kind="stable")
        old = np.interp(contraction[after], contraction[before][order], force[before][order])
        d = float(way[turn])
        mean = old / (1.0 - d * c * np.sign(old))
        share = d * (force[after] - mean) / (c * np.maximum(np.abs(mean), 1e-12))
        moved = np.abs(contraction[after] - contraction[turn - 1]) * data.rest_length
        crossed = np.flatnonzero(share > 0.0)
        partly = share[: int(np.argmax(share > _PART_WAY))]
        if not len(crossed) or crossed[0] < 1 or np.sum(partly > -_PART_WAY) < _RESOLVED:
            sparse += 1
            continue
        k = int(crossed[0])
        part = -share[k - 1] / (share[k] - share[k - 1])
        found.append(float(moved[k - 1] + part * (moved[k] - moved[k - 1])) / _HALFWAY)
    if len(found) >= 2 and len(found) > sparse:
        value = float(np.median(found))
        return value, f"{value * 1e3:.3g} mm, median of {len(found)} reversals"
    if not len(turns):
        return None, "not determinable: no reversal within a pressure"
    few = f"the rows are too sparse after {sparse} of {len(turns)} reversals"
    return None, f"not determinable: {few}"


def _runs(level: Index, way: NDArray[np.int8], turn: int) -> tuple[slice, slice]:
    """The rows of one direction before and after a turn, within its level."""
    same = (level == level[turn]) & (way == way[turn])
    stop = turn + int(np.argmin(same[turn:])) if not same[turn:].all() else len(way)
    same = (level == level[turn]) & (way == way[turn - 1])
    back = same[:turn][::-1]
    start = turn - (int(np.argmin(back)) if not back.all() else turn)
    return slice(start, turn), slice(turn, stop)
