"""Likelihood of residuals: a Gaussian process of noise, curve error and leftover error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_factor, cho_solve, cho_solve_banded, cholesky_banded

from pamrs.diagnosis.fit import Key
from pamrs.diagnosis.noise import NoiseLevel, bins_of, means_in_noises
from pamrs.diagnosis.prepare import Block, Prepared, Residual

_ERROR_TIME = 1.0  # [s] correlation time of the leftover error (decision 14)
# [noise levels of bin means] sizes of that error that are worked out: splines are smooth over half
# a decade
_SIZES = 10.0 ** np.arange(-1.0, 7.1, 0.5)
_BETWEEN = 10.0 ** np.linspace(-1.0, 7.0, 321)  # those between that are tried
_CURVE_DEVIATIONS = 2.0  # [standard deviations] height of a curve of the curve error at the most
_LEAST_SQUARE = 1e-3  # square below which differences say nothing


Array = NDArray[np.float64]


@dataclass(frozen=True)
class BlockLikelihood:
    """Log density of what a hypothesis leaves of one block, by size of the leftover error.

    Attributes
    ----------
    sizes : (k,) array
        Sizes of the leftover error, in noise levels of bin means; the first is none.
    by_size : (k,) array
        Logarithm of the density of the bin means for each.
    volume : (k,) array
        Logarithm of the determinant of their covariance for each.
    count : int
        How many bins there are.
    power : float
        Mean square of the bin means, in their noise levels squared.
    error_power : float
        The most of it that noise and curve error are likely to have.
    """

    sizes: Array
    by_size: Array
    volume: Array
    count: int
    power: float
    error_power: float = 1.0

    @property
    def log_density(self) -> float:
        """Logarithm of the density under the most probable size."""
        return float(self.by_size.max())

    @property
    def size(self) -> float:
        """Size of the leftover error: the most probable one or, if larger, the root of the power
        that noise and curve error do not explain; infinite where nothing is probable.
        """
        best = int(self.by_size.argmax())
        if not math.isfinite(self.by_size[best]):
            return math.inf
        beyond = math.sqrt(max(0.0, self.power - self.error_power))
        return max(float(self.sizes[best]), beyond)

    def expected(self, size: float) -> float:
        """Log density that residuals with a leftover error of this size have on average."""
        return -0.5 * (self.count + float(np.interp(size, self.sizes, self.volume)))


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Likelihood of the residuals of some blocks and recordings.

    Bin means in units of their noise have the covariance ``1 + C C^T + r^2 K``: noise, the curves C
    of the curve error (the same in all recordings, stated or usual), and a leftover error of the
    size r, which forgets itself exponentially in time. Of r the most probable value counts.

    Attributes
    ----------
    blocks : list of Block
        Blocks.
    recordings : list of Prepared
        Recordings to fit, then held-out ones.
    noise_level : dict of NoiseLevel
        By block and recording.
    """

    blocks: list[Block]
    recordings: list[Prepared]
    noise_level: Mapping[Key, NoiseLevel]
    _known: dict[tuple[object, ...], _Covariance] = field(default_factory=dict, repr=False)
    _lock: Lock = field(default_factory=Lock, repr=False)

    def of(self, residuals: Mapping[Key, Residual]) -> dict[str, BlockLikelihood]:
        """Likelihood of residuals, by block."""
        return {block.name: self._of_block(block.name, residuals) for block in self.blocks}

    def _of_block(self, name: str, residuals: Mapping[Key, Residual]) -> BlockLikelihood:
        at: list[object] = [name]
        rows: list[Array] = []
        bins_in: list[tuple[Prepared, NDArray[np.intp]]] = []
        for prepared in self.recordings:
            key = name, prepared.recording.name
            bins, means = means_in_noises(prepared, residuals[key], self.noise_level[key])
            if means.size:
                at += [prepared.recording.name, bins.tobytes()]
                rows.append(means)
                bins_in.append((prepared, bins))
        with self._lock:  # hypotheses are judged two at a time
            known = self._known.get(tuple(at))
            if known is None:
                known = self._known[tuple(at)] = self._covariance(name, bins_in)
        return known.likelihood(rows)

    def _covariance(
        self, name: str, bins_in: list[tuple[Prepared, NDArray[np.intp]]]
    ) -> _Covariance:
        """Covariance of the usable bin means of a block."""
        times = [bins_of(p) * p.dt * bins.astype(np.float64) for p, bins in bins_in]
        levels = [self.noise_level[name, p.recording.name] for p, _ in bins_in]
        both = zip(levels, bins_in, strict=True)
        return _Covariance(times, [level.curves_in_noises(bins) for level, (_, bins) in both])


class _Covariance:
    """The covariance of a block's bin means under each size of the leftover error."""

    def __init__(self, times: list[Array], curves: list[Array]) -> None:
        self._without = _CovarianceAtSize(0.0, times, curves)
        self._each = [_CovarianceAtSize(size, times, curves) for size in _SIZES]
        self._sizes = np.array([0.0, *_BETWEEN])
        volume = self._between([sized.volume for sized in self._each])
        self._volume = np.array([self._without.volume, *volume])
        bent = [float(np.sum(c**2)) for c in curves]
        mean = sum(bent) / max(1, sum(t.size for t in times))
        self._error_power = 1.0 + _CURVE_DEVIATIONS**2 * mean

    def _between(self, values: list[float]) -> Array:
        """Interpolate values from the sizes that were worked out to all sizes that are tried."""
        return np.asarray(CubicSpline(np.log(_SIZES), values)(np.log(_BETWEEN)), dtype=np.float64)

    def likelihood(self, rows: list[Array]) -> BlockLikelihood:
        """Likelihood of bin means by recording; minus infinity where these are not finite."""
        count, power = sum(y.size for y in rows), sum(float(y @ y) for y in rows)
        if not math.isfinite(power):
            never = np.full(self._sizes.size, -math.inf)
            return BlockLikelihood(
                self._sizes, never, self._volume, count, math.inf, self._error_power
            )
        logs = [math.log(max(sized.square(rows), _LEAST_SQUARE)) for sized in self._each]
        square = np.array([self._without.square(rows), *np.exp(self._between(logs))])
        by_size = -0.5 * (square + self._volume)
        mean = power / max(1, count)
        return BlockLikelihood(self._sizes, by_size, self._volume, count, mean, self._error_power)


class _CovarianceAtSize:
    """Covariance of a block's bin means for one size of the leftover error.

    In time the error is an Ornstein-Uhlenbeck process, whose inverse covariance is tridiagonal, so
    that all takes a time proportional to the number of bins.
    """

    def __init__(self, size: float, times: list[Array], curves: list[Array]) -> None:
        self._factors: list[Array | None] = []
        self._curves = curves
        self.volume = 0.0
        for t in times:
            factor = None
            if size > 0.0:
                bands, forgotten = _inverse(t)
                bands /= size**2
                bands[0] += 1.0
                factor = cholesky_banded(bands, lower=True)
                self.volume += t.size * math.log(size**2) + forgotten
                self.volume += 2.0 * float(np.log(factor[0]).sum())
            self._factors.append(factor)
        normal = np.eye(max((c.shape[1] for c in curves), default=0))
        for k, c in enumerate(curves):
            normal[: c.shape[1], : c.shape[1]] += c.T @ self._white(k, c)
        self._normal = cho_factor(normal, lower=True) if normal.size else None
        if self._normal is not None:
            self.volume += 2.0 * float(np.log(np.diag(self._normal[0])).sum())

    def _white(self, recording: int, values: Array) -> Array:
        """Values times the inverse of the covariance of noise and error in one recording."""
        factor = self._factors[recording]
        return values if factor is None else values - cho_solve_banded((factor, True), values)

    def square(self, rows: list[Array]) -> float:
        """Rows times the inverse of their covariance times rows."""
        total, projected = 0.0, np.zeros(0 if self._normal is None else len(self._normal[0]))
        for k, y in enumerate(rows):
            white, curves = self._white(k, y), self._curves[k]
            total += float(y @ white)
            projected[: curves.shape[1]] += curves.T @ white
        if self._normal is None:
            return total
        return total - float(projected @ cho_solve(self._normal, projected))


def _inverse(times: Array) -> tuple[Array, float]:
    """Inverse covariance of an Ornstein-Uhlenbeck process of variance one at some times, as its
    diagonal and the one below it (2, n), and the log determinant of the covariance.
    """
    remembered = np.exp(-np.diff(times) / _ERROR_TIME)
    fresh = 1.0 - remembered**2
    bands = np.zeros((2, times.size))
    bands[0] = 1.0
    bands[0, 1:] = 1.0 / fresh
    bands[0, :-1] += remembered**2 / fresh
    bands[1, :-1] = -remembered / fresh
    return bands, float(np.log(fresh).sum())
