"""Pressure-dependent friction of a pneumatic cylinder, fitted on some pressures and predicted on
others.

Sliding friction ``F_c = f0 + f1 p`` and its neighbours (constant, proportional, quadratic, with a
speed term), and the breakaway from rest ``F_b = ratio F_c``. Pairs of strokes are the repeats
within a pressure, pressures the independent observations of the law.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cases.zillen_cylinders.record import FrictionRecord
from cases.zillen_cylinders.strokes import (
    Onset,
    StrokePairs,
    onset_at_rest,
    pair_strokes,
    reversal_onsets,
)
from pamrs.errors import ParameterError, RecordingError
from pamrs.fit.levels import LawParameter, fit_levels

__all__ = [
    "LAWS",
    "CylinderFriction",
    "HeldOut",
    "LevelFriction",
    "columns",
    "fit_cylinder_friction",
    "mean_of_series",
]

Array = NDArray[np.float64]

#: Coefficients of each law: name and unit; ``fv`` goes with the mean speed of the two directions.
LAWS: Final[dict[str, tuple[tuple[str, str], ...]]] = {
    "constant": (("f0", "N"),),
    "proportional": (("f1", "N/Pa"),),
    "linear": (("f0", "N"), ("f1", "N/Pa")),
    "quadratic": (("f0", "N"), ("f1", "N/Pa"), ("f2", "N/Pa2")),
    "linear_speed": (("f0", "N"), ("f1", "N/Pa"), ("fv", "N s/m")),
}
_SAME: Final = 0.1  # relative difference of pressures that are still one level
_COLLINEAR: Final = 0.95  # correlation of speed and pressure above which the two are not told apart
_MOST_CORRELATION: Final = 0.9  # of neighbouring repeats
_PEAKS: Final = ("seen", "at least")


@dataclass(frozen=True, slots=True)
class LevelFriction:
    """Friction at one pressure.

    Attributes
    ----------
    name : str
        The run.
    pressure : float
        Mean gauge pressure [Pa].
    friction, stderr : float
        Sliding friction and its standard error from the scatter of the pairs of strokes [N].
    pairs : int
        Number of pairs.
    drift : float
        Change from the first to the last pair, as a share of the mean [1].
    speed_against, speed_giving : float
        Sliding speed against the gas and giving way [m/s].
    rest : Onset or None
        The breakaway from rest; None if the first stroke is not usable.
    reversal_ratio, reversal_stderr, reversal_ripple : float
        Largest friction in the first tenth of a stroke after a reversal over the sliding friction:
        mean over strokes, its standard error, and the same of equally long stretches in the middle.
    """

    name: str
    pressure: float
    friction: float
    stderr: float
    pairs: int
    drift: float
    speed_against: float
    speed_giving: float
    rest: Onset | None
    reversal_ratio: float
    reversal_stderr: float
    reversal_ripple: float

    @property
    def speed(self) -> float:
        """Mean of the two speeds [m/s]."""
        return 0.5 * (self.speed_against + self.speed_giving)

    @property
    def breakaway(self) -> float | None:
        """Largest friction at the start from rest [N], None where no peak was sampled."""
        if self.rest is None or self.rest.status not in _PEAKS:
            return None
        return self.rest.peak


@dataclass(frozen=True, slots=True)
class HeldOut:
    """A pressure that the law had not seen.

    Attributes
    ----------
    level : LevelFriction
        What was measured, with the area of the fit that predicts.
    predicted, stderr : float
        What the law says, and its standard error with the scatter between levels [N].
    breakaway : float or None
        Predicted breakaway from rest [N], None if the fit has no ratio.
    extrapolated : bool
        Whether the pressure lies outside those of the fit.
    """

    level: LevelFriction
    predicted: float
    stderr: float
    breakaway: float | None
    extrapolated: bool

    @property
    def error(self) -> float:
        """Predicted minus measured [N]."""
        return self.predicted - self.level.friction

    @property
    def relative_error(self) -> float:
        """:attr:`error` as a share of the measured friction [1]."""
        return self.error / self.level.friction


@dataclass(frozen=True, eq=False)
class CylinderFriction:
    """A fitted friction law; the names are those of lmfit's results where there is one.

    Attributes
    ----------
    name, law : str
        The cylinder, and the key of :data:`LAWS`.
    params : dict of str to LawParameter
        ``f0`` [N], ``f1`` [N/Pa] and so on, ``breakaway_ratio`` [1] where a peak was sampled,
        ``area`` [m2], ``force_zero`` [N].
    levels, held_out_levels : list of LevelFriction
        Pressures of the fit, by rising pressure, and those left out.
    best_fit, residual : (m,) array
        Law at the levels of the fit, and measured minus law [N].
    ndata, nvarys, nfree : int
        Levels, coefficients of the law, and their difference.
    redchi : float
        Reduced chi-square with the scatter of the strokes alone; NaN without a spare level.
    between : float
        Scatter of the levels about the law beyond that of their strokes [N]; NaN without a spare
        level.
    covar : (k, k) array
        Covariance of the law's coefficients.
    pairs : dict of str to StrokePairs
        The strokes of every run.
    issues : list of str
        What was found.
    """

    name: str
    law: str
    params: dict[str, LawParameter]
    levels: list[LevelFriction]
    held_out_levels: list[LevelFriction]
    best_fit: Array
    residual: Array
    ndata: int
    nvarys: int
    nfree: int
    redchi: float
    between: float
    covar: Array
    pairs: dict[str, StrokePairs]
    issues: list[str]

    @property
    def every_level(self) -> list[LevelFriction]:
        """The pressures of the fit, then those left out."""
        return [*self.levels, *self.held_out_levels]

    @property
    def area(self) -> float:
        """Piston area [m2]."""
        return self.params["area"].value

    @property
    def pressures(self) -> Array:
        """Pressures of the fit [Pa]."""
        return np.array([level.pressure for level in self.levels])

    @property
    def speed_correlation(self) -> float:
        """Correlation of sliding speed and pressure over the levels of the fit; NaN with fewer than
        three.
        """
        return _correlation(self.levels)

    def predict(self, pressure: ArrayLike, velocity: ArrayLike | None = None) -> Array:
        """Sliding friction [N].

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        velocity : array_like, optional
            Velocity [m/s], broadcast against ``pressure``; with it the friction has the sign of the
            velocity and is 0 at rest. The law ``linear_speed`` needs it.

        Returns
        -------
        ndarray

        Raises
        ------
        ParameterError
            If a value is not finite, or the law needs a velocity that is not given.
        """
        p = np.asarray(pressure, dtype=np.float64)
        v = None if velocity is None else np.asarray(velocity, dtype=np.float64)
        for word, values in (("pressure", p), ("velocity", v)):
            if values is not None and not np.all(np.isfinite(values)):
                raise ParameterError(f"{word}: a value is not finite")
        if v is None and self.law == "linear_speed":
            raise ParameterError("velocity is needed: the law linear_speed depends on it")
        p, speed = np.broadcast_arrays(p, 0.0 if v is None else np.abs(v))
        size: Array = _design(self.law, p, speed) @ self._coefficients()
        return size if v is None else np.sign(v) * size

    def breakaway(self, pressure: ArrayLike) -> Array:
        """Breakaway friction from rest [N]: ``breakaway_ratio`` times the sliding friction.

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
            If no breakaway peak was sampled at the pressures of the fit.
        """
        if "breakaway_ratio" not in self.params:
            raise ParameterError(
                f"{self.name}: no breakaway peak was sampled at the pressures of the fit"
            )
        return np.asarray(self.params["breakaway_ratio"].value * self.predict(pressure))

    def held_out(self) -> list[HeldOut]:
        """The pressures left out of the fit, predicted."""
        return [self._predicted(level) for level in self.held_out_levels]

    def leave_one_pressure_out(self) -> list[HeldOut]:
        """Each pressure of all runs predicted from all the others, area included.

        Returns
        -------
        list of HeldOut
            By rising pressure.

        Raises
        ------
        RecordingError
            If the others do not determine the law.
        """
        found = []
        for name, pairs in self.pairs.items():
            rest = [other for key, other in self.pairs.items() if key != name]
            found += _fit(self.name, rest, [pairs], self.law, self._given_area()).held_out()
        return found

    def fit_report(self) -> str:
        """The result in words and tables, without the leave-one-out refits."""
        from cases.zillen_cylinders.report import report_text

        return report_text(self)

    def _given_area(self) -> float | None:
        return None if "force_zero" in self.params else self.area

    def _coefficients(self) -> Array:
        return np.array([self.params[name].value for name, _ in LAWS[self.law]])

    def _predicted(self, level: LevelFriction) -> HeldOut:
        row = _design(self.law, np.array([level.pressure]), np.array([level.speed]))[0]
        extra = 0.0 if math.isnan(self.between) else self.between
        stderr = math.sqrt(float(row @ self.covar @ row) + extra**2 + level.stderr**2)
        value = float(row @ self._coefficients())
        ratio = self.params.get("breakaway_ratio")
        broken = None if ratio is None else ratio.value * value
        outside = not self.pressures.min() <= level.pressure <= self.pressures.max()
        return HeldOut(level, value, stderr, broken, outside)


def fit_cylinder_friction(
    records: Sequence[FrictionRecord],
    *,
    fit_on: Sequence[float] | None = None,
    law: str = "linear",
    area: float | None = None,
    margin: float = 0.25,
) -> CylinderFriction:
    """Fit the friction law of one cylinder.

    Parameters
    ----------
    records : sequence of FrictionRecord
        Runs of one cylinder, one for each pressure, each with three pairs of strokes at least.
    fit_on : sequence of float, optional
        Pressures [Pa] whose runs are fitted; the others are predicted. By default all.
    law : str
        A key of :data:`LAWS`.
    area : float, optional
        Piston area [m2]; by default the slope of the mean pull of both directions over the
        pressures of the fit.
    margin : float
        Share of the travel left out at each end of the strokes.

    Returns
    -------
    CylinderFriction

    Raises
    ------
    ParameterError
        If an argument is not possible, or no run has a pressure of ``fit_on``.
    RecordingError
        If a run has no reversal or too few strokes, or the pressures do not determine the law or
        the area.
    """
    if law not in LAWS:
        raise ParameterError(f"law = {law!r} is not allowed: {', '.join(LAWS)}")
    if area is not None and not (math.isfinite(area) and area > 0.0):
        raise ParameterError(f"area = {area!r} m2 is not allowed: a positive number is needed")
    if not records:
        raise ParameterError("records is empty: one run at least is needed")
    owners = sorted({record.cylinder for record in records})
    if len(owners) > 1:
        raise ParameterError(
            f"records belong to {len(owners)} cylinders ({', '.join(owners)}): fit one at a time"
        )
    names = [record.name for record in records]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ParameterError(
            f"records: {twice[0]!r} is there twice; every run needs a name of its own"
        )
    pairs = _by_pressure(pair_strokes(record, margin=margin) for record in records)
    chosen = _chosen(pairs, fit_on)
    rest = [item for item in pairs if item not in chosen]
    return _fit(owners[0], chosen, rest, law, area)


def _by_pressure(pairs: Iterable[StrokePairs]) -> list[StrokePairs]:
    return sorted(pairs, key=lambda item: item.pressure)


def _chosen(pairs: list[StrokePairs], fit_on: Sequence[float] | None) -> list[StrokePairs]:
    if fit_on is None:
        return pairs
    found: list[StrokePairs] = []
    for pressure in fit_on:
        near = [item for item in pairs if abs(item.pressure - pressure) <= _SAME * abs(pressure)]
        if not near:
            have = ", ".join(f"{item.pressure / 1e3:.0f}" for item in pairs)
            raise ParameterError(
                f"fit_on: no run at {pressure / 1e3:g} kPa; there are runs at {have} kPa"
            )
        found += [item for item in near if item not in found]
    return _by_pressure(found)


def _fit(
    name: str, chosen: list[StrokePairs], rest: list[StrokePairs], law: str, area: float | None
) -> CylinderFriction:
    terms = LAWS[law]
    _check_determined(name, chosen, law)
    every = _by_pressure([*chosen, *rest])
    extent = _area(name, chosen, area)
    size = extent["area"].value
    levels, left = ([_level(item, size) for item in part] for part in (chosen, rest))
    pressure, friction, stderr, speed = columns(levels)
    if law == "linear_speed" and abs(_correlation(levels)) > _COLLINEAR:
        raise RecordingError(
            f"{name}: speed and pressure have a correlation of {_correlation(levels):.2f} over the "
            "runs: they are not told apart"
        )
    design = _design(law, pressure, speed)
    line = fit_levels(design, friction, stderr)
    params = {
        key: LawParameter(key, float(value), float(error), unit)
        for (key, unit), value, error in zip(terms, line.values, line.stderr, strict=True)
    }
    params |= _breakaway(levels)
    best = np.asarray(design @ line.values)
    return CylinderFriction(
        name=name,
        law=law,
        params=params | extent,
        levels=levels,
        held_out_levels=left,
        best_fit=best,
        residual=friction - best,
        ndata=len(levels),
        nvarys=len(terms),
        nfree=len(levels) - len(terms),
        redchi=line.redchi,
        between=line.between,
        covar=line.covar,
        pairs={item.record.name: item for item in every},
        issues=[
            issue for item in (*chosen, *rest) for issue in (*item.record.issues, *item.issues)
        ],
    )


def _check_determined(name: str, chosen: list[StrokePairs], law: str) -> None:
    """Refuse fewer different pressures than the law has coefficients."""
    terms, pressures = LAWS[law], [item.pressure for item in chosen]
    distinct = 1 + sum(b - a > _SAME * b for a, b in pairwise(pressures))
    if distinct >= len(terms):
        return
    what = f"the {len(terms)} coefficients of the law {law!r} are"
    if distinct == 1:
        what = "the slope f1 of friction over pressure is"
    have = ", ".join(f"{pressure / 1e3:.0f}" for pressure in pressures)
    raise RecordingError(
        f"{name}: {distinct} pressure{'s' if distinct > 1 else ''} ({have} kPa): {what} not "
        "determinable"
    )


def columns(levels: Sequence[LevelFriction]) -> tuple[Array, Array, Array, Array]:
    """Pressure [Pa], friction and its standard error [N] and speed [m/s] of some levels."""
    pressure, friction, stderr, speed = (
        np.array([getattr(level, key) for level in levels])
        for key in ("pressure", "friction", "stderr", "speed")
    )
    return pressure, friction, stderr, speed


def _area(name: str, pairs: list[StrokePairs], area: float | None) -> dict[str, LawParameter]:
    """Piston area and force zero, from the mean pull of both directions over the pressures."""
    if area is not None:
        return {"area": LawParameter("area", area, math.nan, "m2")}
    pressure = np.array([item.pressure for item in pairs])
    if len(pairs) < 2 or np.ptp(pressure) <= _SAME * pressure.max():
        raise RecordingError(
            f"{name}: the piston area is not determinable from one pressure; give area"
        )
    pull = np.array([float(np.mean(item.mid_force)) for item in pairs])
    design = np.column_stack([np.ones_like(pressure), pressure])
    line = fit_levels(design, pull, np.zeros_like(pull))
    error = line.stderr if len(pairs) > 2 else np.full(2, math.nan)
    return {
        "area": LawParameter("area", float(line.values[1]), float(error[1]), "m2"),
        "force_zero": LawParameter("force_zero", float(line.values[0]), float(error[0]), "N"),
    }


def _level(pairs: StrokePairs, area: float) -> LevelFriction:
    values = pairs.friction(area)
    friction, stderr = mean_of_series(values)
    if friction <= 0.0:
        raise RecordingError(
            f"{pairs.record.name}: friction comes out as {friction:.3g} N with area = {area:.4g} "
            "m2; right area and units?"
        )
    onsets = reversal_onsets(pairs, area)
    ratio, ratio_error = mean_of_series(np.array([onset.ratio for onset in onsets]))
    return LevelFriction(
        name=pairs.record.name,
        pressure=pairs.pressure,
        friction=friction,
        stderr=stderr,
        pairs=len(pairs),
        drift=float(values[-1] - values[0]) / friction,
        speed_against=float(np.mean(pairs.speed_against)),
        speed_giving=float(np.mean(pairs.speed_giving)),
        rest=onset_at_rest(pairs, area),
        reversal_ratio=ratio,
        reversal_stderr=ratio_error,
        reversal_ripple=float(np.mean([onset.ripple for onset in onsets])),
    )


def _breakaway(levels: list[LevelFriction]) -> dict[str, LawParameter]:
    """Mean ratio of the sampled breakaway peaks to the sliding friction; its error from their
    scatter, NaN for one alone.
    """
    ratios = [level.breakaway / level.friction for level in levels if level.breakaway is not None]
    if not ratios:
        return {}
    error = float(np.std(ratios, ddof=1) / math.sqrt(len(ratios))) if len(ratios) > 1 else math.nan
    return {"breakaway_ratio": LawParameter("breakaway_ratio", float(np.mean(ratios)), error, "1")}


def _design(law: str, pressure: Array, speed: Array) -> Array:
    terms = {"f0": np.ones_like(pressure), "f1": pressure, "f2": pressure**2, "fv": speed}
    return np.stack([terms[key] for key, _ in LAWS[law]], axis=-1)


def _correlation(levels: Sequence[LevelFriction]) -> float:
    if len(levels) < 3:
        return math.nan
    pressure, _, _, speed = columns(levels)
    if np.ptp(speed) == 0.0:
        return 0.0
    return float(np.corrcoef(pressure, speed)[0, 1])


def mean_of_series(values: Array) -> tuple[float, float]:
    """Mean and its standard error of repeats in the order they were measured.

    Repeats that drift or hang together count as fewer: ``n (1 - r)/(1 + r)`` of them, at least 2,
    with ``r`` the correlation of neighbours, corrected for its bias in a short series and kept
    within 0 and 0.9.

    Parameters
    ----------
    values : (n,) array
        Two repeats at least.

    Returns
    -------
    (mean, stderr) : tuple of float
    """
    n = len(values)
    mean = float(np.mean(values))
    off = values - mean
    power = float(np.sum(off**2))
    if power == 0.0:
        return mean, 0.0
    r = float(np.sum(off[1:] * off[:-1])) / power
    r = min(max(r + (1.0 + 4.0 * r) / n, 0.0), _MOST_CORRELATION) if n > 3 else 0.0
    effective = max(n * (1.0 - r) / (1.0 + r), min(2.0, n))
    return mean, float(np.sqrt(power / (n - 1) / effective))
