"""The likelihood by which hypotheses are weighed: what each leaves of the recordings as a Gaussian
process of the sensors' noise, the error of the model, and an error that nobody states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cho_solve_banded, cholesky_banded

from pamrs.diagnosis.fit import Key
from pamrs.diagnosis.noise import NoiseLevel, bins_of
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned

_ERROR_TIME = 1.0  # [s] correlation time of the error that nobody states (decision 14)
# [noise levels] sizes of that error that are tried, half a decade apart
_SIZES = np.array([0.0, *10.0 ** np.arange(-1.0, 5.1, 0.5)])


Array = NDArray[np.float64]


@dataclass(frozen=True)
class BlockLikelihood:
    """How probable what a hypothesis leaves of a block is.

    Attributes
    ----------
    by_size : (k,) array
        Logarithm of the density of the bin means for each size of the error that nobody states.
    volume : (k,) array
        Logarithm of the determinant of their covariance for each size.
    sizes : (k,) array
        Those sizes, in noise levels.
    count : int
        How many bins there are.
    power : float
        Mean square of the bin means, in noise levels squared.
    """

    by_size: Array
    volume: Array
    sizes: Array
    count: int
    power: float

    @property
    def most(self) -> float:
        """Logarithm of the density under the most probable size."""
        return float(self.by_size.max())

    def expected(self, size: float) -> float:
        """Logarithm of the density of rows that have an error of this size, and no more."""
        known = np.log(np.maximum(self.sizes, self.sizes[1]))
        volume = float(np.interp(math.log(max(size, self.sizes[1])), known, self.volume))
        return -0.5 * (self.count + volume)


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The likelihood of some blocks and recordings.

    Bin means in units of their noise have the covariance ``1 + C C^T + r^2 K``: noise, the curves C
    of the model's error (the same in all recordings), and an error of the size r that nobody
    states, which forgets itself exponentially in time. Of r the most probable value counts.

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
    _known: dict[tuple[str, bytes], _Covariance] = field(default_factory=dict, repr=False)

    def of(self, found: Mapping[Key, Residual]) -> dict[str, BlockLikelihood]:
        """How probable residuals are, by block."""
        return {block.name: self._of_block(block.name, found) for block in self.blocks}

    def _of_block(self, name: str, found: Mapping[Key, Residual]) -> BlockLikelihood:
        rows: list[Array] = []
        times: list[Array] = []
        curves: list[Array] = []
        for prepared in self.recordings:
            key, width = (name, prepared.recording.name), bins_of(prepared)
            level = self.noise_level[key]
            noise = math.sqrt(max(0.0, level.noise_variance))
            means, counts = binned(found[key].value, found[key].rows, width)
            seen = np.flatnonzero(counts)
            if seen.size and noise > 0.0:
                rows.append(means[seen] / noise)
                times.append(width * prepared.dt * seen.astype(np.float64))
                bent = level.curves
                curves.append(np.empty((seen.size, 0)) if bent is None else bent[seen] / noise)
        at = name, b"".join(t.tobytes() for t in times)
        if at not in self._known:
            self._known[at] = _Covariance(times, curves)
        return self._known[at].likelihood(rows)


class _Covariance:
    """The covariance of a block's bin means under each size of the error that nobody states."""

    def __init__(self, times: list[Array], curves: list[Array]) -> None:
        self._each = [_Sized(size, times, curves) for size in _SIZES]
        self._volume = np.array([sized.volume for sized in self._each])

    def likelihood(self, rows: list[Array]) -> BlockLikelihood:
        """That of bin means, recording by recording."""
        power = sum(float(y @ y) for y in rows)
        square = np.array([sized.square(rows) for sized in self._each])
        count = sum(y.size for y in rows)
        by_size = -0.5 * (square + self._volume)
        return BlockLikelihood(by_size, self._volume, _SIZES, count, power / max(1, count))


class _Sized:
    """That covariance for one size.

    In time the error is an Ornstein-Uhlenbeck process, whose inverse covariance is tridiagonal, so
    that all takes a time proportional to the number of bins.
    """

    def __init__(self, size: float, times: list[Array], curves: list[Array]) -> None:
        self._factors: list[Array | None] = []
        self.volume = 0.0
        for t in times:
            if size > 0.0:
                bands, forgotten = _inverse(t)
                bands /= size**2
                bands[0] += 1.0
                factor = cholesky_banded(bands, lower=True)
                self.volume += t.size * math.log(size**2) + forgotten
                self.volume += 2.0 * float(np.log(factor[0]).sum())
                self._factors.append(factor)
            else:
                self._factors.append(None)
        self._curves = [self._white(k, c) for k, c in enumerate(curves)]
        most = max((c.shape[1] for c in curves), default=0)
        normal = np.eye(most)
        for c, white in zip(curves, self._curves, strict=True):
            normal[: c.shape[1], : c.shape[1]] += c.T @ white
        self._normal = cho_factor(normal, lower=True) if most else None
        if self._normal is not None:
            self.volume += 2.0 * float(np.log(np.diag(self._normal[0])).sum())

    def _white(self, recording: int, values: Array) -> Array:
        """Values times the inverse of the covariance of noise and error in one recording."""
        factor = self._factors[recording]
        return values if factor is None else values - cho_solve_banded((factor, True), values)

    def square(self, rows: list[Array]) -> float:
        """Rows times the inverse of their covariance times rows."""
        found = sum(float(y @ self._white(k, y)) for k, y in enumerate(rows))
        if self._normal is None:
            return found
        told = np.zeros(len(self._normal[0]))
        for white, y in zip(self._curves, rows, strict=True):
            told[: white.shape[1]] += white.T @ y
        return found - float(told @ cho_solve(self._normal, told))


def _inverse(times: Array) -> tuple[Array, float]:
    """The inverse covariance of such a process of variance one at some times, as its diagonal and
    the one below it (2, n), and the logarithm of the determinant of the covariance.
    """
    kept = np.exp(-np.diff(times) / _ERROR_TIME)
    fresh = 1.0 - kept**2
    bands = np.zeros((2, times.size))
    bands[0] = 1.0
    bands[0, 1:] = 1.0 / fresh
    bands[0, :-1] += kept**2 / fresh
    bands[1, :-1] = -kept / fresh
    return bands, float(np.log(fresh).sum())
