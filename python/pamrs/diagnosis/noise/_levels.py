"""Noise levels, excess of residuals over them, and the inflation of fits by both."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, t

from pamrs import _core
from pamrs.diagnosis.fit import FIT_BIN_TIME, PIECE_TIME, Fit, Inflation, Key, Problem, bin_width
from pamrs.diagnosis.noise._autocorrelation import inflated, inflation_apart, usual_inflation
from pamrs.diagnosis.noise._discrepancy import CurveErrors, curves, operating_ranges, whitening
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned, change, residual, smoothed
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import SimulationError

_BIN_TIME = 0.1  # [s] bins of residuals against noise: what is missing is slower (decision 14)
_LEAST_BIN_SAMPLES = 5  # fewest samples of such a bin
# numbers of a curve error, as its square scatters: bumps of a force curve over a stroke
_CURVE_FREEDOM = 4.0
# share of that variance that no curve tells: an error is no exact curve of one value (decision 95)
_CURVE_REST = 0.02
# shares of the usual error that are tried (decision 95)
_ERROR_SHARES = (0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0)
LEAST_SIZE = _ERROR_SHARES[0]  # share of the usual error that is hardly any
# spread of the logarithm of a size that nothing tells: a factor of three (decisions 14, 22, 95)
SIZE_SPREAD = math.log(3.0)


Array = NDArray[np.float64]


@dataclass(frozen=True)
class NoiseLevel:
    """Level of a block's residual over one recording by noise, and by the curve error of the model
    (stated or usual): of single samples, and of bin means (bins of :func:`bins_of` samples).

    Attributes
    ----------
    sample : float
        Standard deviation of single samples: the output's own noise and that of the drives.
    binned : float
        Standard deviation of bin means by noise and curve error together.
    scatter : float
        Standard deviation, from one realisation of the noise to another, of the logarithm of the
        mean square of the bin means.
    curve_share : float
        Share of the variance of bin means that is the curve error.
    off_curves : float
        Standard deviation of bin means about what its curves predict.
    rest_share : float
        Share of that variance that is curve error which no such curve predicts.
    curves : (m, k) array or None
        What each curve, one standard deviation high, does to the bin means; None where no curve
        error acts.
    inflation : float
        Variance of the means of a fit's bins relative to white noise of the output, times their
        correlation time: by so much fits take a block's residual less seriously.
    """

    sample: float
    binned: float
    scatter: float = 0.0
    curve_share: float = 0.0
    off_curves: float = 0.0
    rest_share: float = 0.0
    curves: Array | None = field(default=None, repr=False, compare=False)
    inflation: float = 1.0

    @property
    def noise_variance(self) -> float:
        """Variance of bin means by noise alone."""
        return (1.0 - self.curve_share) * self.binned**2

    @property
    def error_variance(self) -> float:
        """Variance of bin means by the curve error."""
        return self.curve_share * self.binned**2

    @property
    def binned_noise(self) -> float:
        """Standard deviation of bin means by noise alone."""
        return math.sqrt(max(0.0, self.noise_variance))

    def curves_in_noises(self, bins: NDArray[np.intp]) -> Array:
        """The curves at some bins (n, k) in units of that noise; no column where there are none."""
        return (
            np.empty((bins.size, 0))
            if self.curves is None
            else self.curves[bins] / self.binned_noise
        )


@dataclass(frozen=True)
class Excess:
    """Residual of a block against its noise level, pooled over recordings.

    Attributes
    ----------
    ratio : float
        Variance of bin means over that of the noise level of bin means; 1 when only noise is left.
    systematic : float
        Standard deviation of what is not noise in bin means, over all recordings, in noise levels
        of single samples: in units of `noise`.
    p_value : float
        Chance of such a ratio (above the margin) from noise, by the scatter of the noise levels.
    limit : float
        Ratio that noise exceeds with the chance ``noise_chance`` of the settings.
    scatter : float
        Standard deviation of the ratio's logarithm from noise and from what noise levels are known
        to.
    rms, noise : float
        Residual and noise level of single samples, in the channel's unit.
    pieces : tuple of (float, int)
        The ratio in each piece of the recordings, and the bins in it.
    """

    ratio: float
    systematic: float
    p_value: float
    rms: float
    noise: float
    limit: float
    scatter: float = 0.0
    pieces: tuple[tuple[float, int], ...] = ()


def bins_of(prepared: Prepared) -> int:
    """Samples in a bin for the excess."""
    return max(_LEAST_BIN_SAMPLES, bin_width(prepared, _BIN_TIME))


def noise_levels(
    problem: Problem,
    core: _core.Rig,
    curve_errors: CurveErrors | None = None,
    range_recordings: list[Prepared] | None = None,
) -> dict[Key, NoiseLevel]:
    """Noise levels of all blocks and recordings, the drives' noise carried through the model by
    simulation.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    core : _core.Rig
        A model close to the data.
    curve_errors : dict, optional
        From :func:`curve_errors_of`: excess inside them is none.
    range_recordings : list of Prepared, optional
        Recordings whose ranges their curves run over; those of the problem by default.
    """
    levels: dict[Key, NoiseLevel] = {}
    settings, known = problem.settings, curve_errors or {}
    ranges = {
        b.name: operating_ranges(b, range_recordings or problem.recordings)
        for b in problem.blocks
        if known
    }
    for prepared in problem.recordings:
        seed = [settings.seed, crc32(prepared.recording.name.encode())]
        rng, white_noise = np.random.default_rng(seed), np.random.default_rng([*seed, 1])
        for block in problem.blocks:
            base = residual(block, core, prepared, [])
            width = bins_of(prepared)
            powers: list[list[float]] = []
            inflations: list[float] = []
            noisy = [name for name in block.drives if name in prepared.signals]
            rows = base.rows
            _, counts = binned(base.value, rows, width)
            usable = counts > 0
            for _ in range(settings.noise_replicates if usable.any() else 0):
                disturbed = np.zeros(prepared.n)
                with contextlib.suppress(
                    SimulationError
                ):  # a realisation that leaves the model's range tells nothing of the others
                    disturbed = (
                        change(block, core, _with_more_noise(prepared, noisy, rng), base)
                        - base.value
                        if noisy
                        else disturbed
                    )
                means, _ = binned(disturbed, rows, width)
                raw = disturbed + base.freed(white_noise.normal(0.0, base.noise, prepared.n))
                inflations.append(
                    inflated(raw, rows, bin_width(prepared, FIT_BIN_TIME), base.noise)
                )
                own_noise = _own_noise(block, base, prepared, counts, width, rng)[usable]
                parts = (disturbed[rows], means[usable], means[usable] + own_noise, own_noise)
                powers.append([float(np.mean(v**2)) for v in parts])
            sample, drives, _, rounded = np.mean(powers, axis=0) if powers else np.zeros(4)
            white = float(np.mean(1.0 / counts[usable])) if usable.any() else 1.0
            single = base.noise**2 * white
            # mean squares of few modes are skew, their logarithms hardly
            scatter = (
                float(np.std(np.log([both for _, _, both, _ in powers]), ddof=1)) if powers else 0.0
            )
            if block.channel in prepared.steps:
                single = max(single, float(rounded))
            noise = single + drives
            if powers and not {block.channel, *noisy}.isdisjoint(prepared.steps):
                # where the steps of a converter lie is one number that nobody knows, the same in
                # all recordings: of each source the realisation that leaves most counts, no mean
                _, most, _, most_own = np.max(powers, axis=0)
                noise = max(noise, float(most + most_own))
            key = block.name, prepared.recording.name
            bent = None
            if known:
                bent = curves(block, core, base, prepared, ranges[block.name], known, width)
            error = 0.0 if bent is None else _power(bent[usable])
            levels[key] = NoiseLevel(
                math.sqrt(base.noise**2 + sample),
                scatter=scatter,
                curves=bent,
                inflation=max(1.0, float(np.mean(inflations))) if inflations else 1.0,
                **_with_error(noise, error),
            )
    return levels


def means_in_noises(
    prepared: Prepared, block_residual: Residual, level: NoiseLevel
) -> tuple[NDArray[np.intp], Array]:
    """The bins of a recording that are usable (n,), and the means of a residual in them in noise
    levels of bin means (n,), the curve error left out; none where there is no noise.
    """
    means, counts = binned(block_residual.value, block_residual.rows, bins_of(prepared))
    usable = np.flatnonzero(counts if level.binned_noise > 0.0 else ())
    return usable, means[usable] / level.binned_noise if usable.size else np.empty(0)


def error_sizes(
    problem: Problem, residuals: dict[Key, Residual], noise_level: dict[Key, NoiseLevel]
) -> tuple[dict[str, float], float]:
    """Most probable size of the curve error in each block, as a share of the stated or usual one
    and at most 1, by what a hypothesis leaves; and the log evidence of these sizes.

    The residuals are those of one Gaussian process with curves of that size, which has a log-normal
    prior about the usual one: recordings that show a model to be better than usual may show what
    is smaller than the usual error.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    residuals : dict
        Residuals of the recordings.
    noise_level : dict
        From :func:`noise_levels`, with the curves of the usual error.

    Returns
    -------
    sizes : dict of str to float
        By block; 1 where no error acts.
    evidence : float
        Logarithm of the density of the bin means under these sizes, up to a constant.
    """
    sizes, evidence = {}, 0.0
    for block in problem.blocks:
        rows, bent, rest = [], [], []
        for prepared in problem.recordings:
            key = block.name, prepared.recording.name
            level = noise_level[key]
            usable, means = means_in_noises(prepared, residuals[key], level)
            if level.curves is None or not means.size:
                continue
            rows.append(means)
            bent.append(level.curves_in_noises(usable))
            rest.append(
                np.full(means.size, _CURVE_REST * level.curve_share / (1.0 - level.curve_share))
            )
        sizes[block.name] = 1.0
        if rows:
            y, c, r = np.concatenate(rows), np.concatenate(bent), np.concatenate(rest)
            each = {size: _evidence(y, c, r, size) for size in _ERROR_SHARES}
            sizes[block.name] = max(each, key=lambda size: each[size])
            evidence += each[sizes[block.name]]
    return sizes, evidence


def _evidence(rows: Array, curves: Array, rest: Array, size: float) -> float:
    """Log probability of rows with unit noise and curves that are `size` times as high, a size that
    is log-normal about 1.
    """
    variance = 1.0 + size**2 * rest
    y = rows / np.sqrt(variance)
    c = size * curves / np.sqrt(variance)[:, None]
    normal = np.eye(c.shape[1]) + c.T @ c
    projected = c.T @ y
    square = float(y @ y - projected @ np.linalg.solve(normal, projected))
    volume = float(np.linalg.slogdet(normal)[1] + np.log(variance).sum())
    prior = (math.log(size) / SIZE_SPREAD) ** 2
    return -0.5 * (square + volume + prior)


def with_sizes(
    noise_level: dict[Key, NoiseLevel], sizes: dict[str, float]
) -> dict[Key, NoiseLevel]:
    """Noise levels with the curve error of each block so many times as large."""

    def scaled(level: NoiseLevel, size: float) -> NoiseLevel:
        if level.curves is None:
            return level
        variances = _with_error(level.noise_variance, size**2 * level.error_variance)
        return replace(level, **variances, curves=size * level.curves)

    return {key: scaled(level, sizes[key[0]]) for key, level in noise_level.items()}


def _with_error(noise: float, error: float) -> dict[str, float]:
    """Entries of a noise level by the variances of bin means by noise and by curve error."""
    rest = _CURVE_REST * error
    return {
        "binned": math.sqrt(noise + error),
        "curve_share": error / (noise + error),
        "off_curves": math.sqrt(noise + rest),
        "rest_share": rest / (noise + rest),
    }


def _power(curves: Array) -> float:
    """Variance of bin means by curves that are one standard deviation high."""
    return float(np.mean(np.sum(curves**2, axis=1))) if curves.size else 0.0


def _own_noise(
    block: Block,
    base: Residual,
    prepared: Prepared,
    counts: Array,
    width: int,
    rng: np.random.Generator,
) -> Array:
    """One realisation of the output's own noise in bin means (m,): white, or where its converter is
    coarse the rounding of what the model predicts.
    """
    step = prepared.steps.get(block.channel)
    if step is None:
        return rng.normal(0.0, base.noise, counts.size) / np.sqrt(np.maximum(counts, 1.0))
    error = base.freed(_rounding(base.prediction, step, rng))
    return binned(error, base.rows, width)[0]


def _rounding(values: Array, step: float, rng: np.random.Generator) -> Array:
    """Rounding error that a converter, whose steps lie anywhere, adds to values."""
    place = step * rng.uniform()
    placed = values + place
    return np.asarray(np.round(placed / step) * step - place - values, dtype=np.float64)


def _with_more_noise(
    prepared: Prepared, names: Iterable[str], rng: np.random.Generator
) -> Prepared:
    """The recording with one more realisation of noise, as smoothed, on some drives."""
    signals = {}
    for name in names:
        value, slope = prepared.signals[name]
        step = prepared.steps.get(name)
        raw = (
            rng.normal(0.0, prepared.noise[name], prepared.n)
            if step is None
            else _rounding(value, step, rng)
        )
        more, steeper = smoothed(raw, prepared.dt, prepared.lengths[name])
        signals[name] = (value + more, slope + steeper)
    return prepared.with_signals(signals)


def excess(
    block: Block,
    recordings: list[Prepared],
    residuals: dict[Key, Residual],
    noise_level: dict[Key, NoiseLevel],
    settings: DiagnosisSettings,
) -> Excess:
    """Pool a block's residual over recordings and compare it with its noise level.

    Where the model has a curve error, all of the residual is compared with noise and that error
    together; and what its most probable curves leave of it, with what they cost, with the noise
    about them. The one that is farther above its limit counts.
    """
    width = {p.recording.name: bins_of(p) for p in recordings}
    bins = {
        (key := (block.name, p.recording.name)): binned(
            residuals[key].value, residuals[key].rows, width[p.recording.name]
        )
        for p in recordings
    }
    whole = {key: noise_level[key] for key in bins}
    against_all = _pooled(recordings, bins, residuals, whole, settings)
    if all(level.curves is None for level in whole.values()):
        return against_all
    apart = {
        key: replace(level, binned=level.off_curves, curve_share=level.rest_share)
        for key, level in whole.items()
    }
    against_rest = _pooled(recordings, _off_curves(bins, apart), residuals, apart, settings)
    return max(against_all, against_rest, key=lambda e: e.ratio / e.limit)


Bins = dict[Key, tuple[Array, Array]]
"""Means, and usable samples, of the bins of a block in a recording."""


def _off_curves(bins: Bins, levels: dict[Key, NoiseLevel]) -> Bins:
    """Bin means without the most probable curves, so that noise and such curves alone leave the
    variance of the noise (one curve for all recordings).
    """
    known = [key for key, level in levels.items() if level.curves is not None]
    usable = {key: bins[key][1] > 0 for key in known}
    bent = [
        c[usable[key]] / levels[key].binned
        for key in known
        if (c := levels[key].curves) is not None
    ]
    rows = [bins[key][0][usable[key]] / levels[key].binned for key in known]
    white = whitening(np.concatenate(bent))(np.concatenate(rows))
    out, last = dict(bins), 0
    for key, part in zip(known, rows, strict=True):
        means = np.zeros_like(bins[key][0])
        means[usable[key]] = levels[key].binned * white[last : last + part.size]
        out[key], last = (means, bins[key][1]), last + part.size
    return out


def _pooled(
    recordings: list[Prepared],
    bins: Bins,
    residuals: dict[Key, Residual],
    noise_level: dict[Key, NoiseLevel],
    settings: DiagnosisSettings,
) -> Excess:
    """Bin means of a block over its recordings against their noise levels."""
    keys: list[Key] = []
    ratios, weights, squares, noises, beyond_noise = [], [], [], [], []
    pieces: list[tuple[float, int]] = []
    for prepared, (key, (means, counts)) in zip(recordings, bins.items(), strict=True):
        r = residuals[key]
        length = max(1, round(PIECE_TIME / (bins_of(prepared) * prepared.dt)))
        variance = noise_level[key].binned ** 2
        for first in range(0, means.size, length):
            piece = means[first : first + length][counts[first : first + length] > 0]
            if piece.size:
                pieces.append((float(np.mean(piece**2)) / variance, int(piece.size)))
        means = means[counts > 0]
        if means.size == 0:
            continue
        keys.append(key)
        ratios.append(float(np.mean(means**2)) / noise_level[key].binned ** 2)
        weights.append(means.size)
        beyond_noise.append(float(np.mean(means**2)) - noise_level[key].binned ** 2)
        squares.append(float(np.mean(r.value[r.rows] ** 2)))
        noises.append(noise_level[key].sample ** 2)
    if not ratios:
        return Excess(1.0, 0.0, 1.0, float("nan"), float("nan"), settings.noise_margin)
    ratio = float(np.average(ratios, weights=weights))
    shares = np.array(weights) / sum(weights)
    # noise levels are means of as many realisations, and their scatter is known from no more
    random = [(1.0 - noise_level[key].curve_share) * noise_level[key].scatter for key in keys]
    pooled = math.sqrt(float(np.sum((shares * random) ** 2)))
    scatter = max(1e-6, pooled * math.sqrt(1.0 + 1.0 / settings.noise_replicates))
    chance = t(len(keys) * (settings.noise_replicates - 1))
    # as much as a double's exponential bears
    beyond = min(float(chance.isf(settings.noise_chance)) * scatter, 700.0)
    # the model has one error, the same in all recordings, and its square is that of a few numbers
    curve_share = float(np.sum(shares * [noise_level[key].curve_share for key in keys]))
    larger = 1.0 + curve_share * (
        float(chi2.isf(settings.noise_chance, _CURVE_FREEDOM)) / _CURVE_FREEDOM - 1.0
    )
    scatter = math.hypot(scatter, curve_share * math.sqrt(2.0 / _CURVE_FREEDOM))
    margin = settings.noise_margin * larger
    noise = math.sqrt(float(np.average(noises, weights=weights)))
    return Excess(
        ratio,
        math.sqrt(max(0.0, float(np.average(beyond_noise, weights=weights)))) / noise,
        float(chance.sf(math.log(max(ratio, 1e-300) / margin) / scatter)),
        math.sqrt(float(np.average(squares, weights=weights))),
        noise,
        margin * math.exp(beyond),
        scatter,
        tuple(pieces),
    )


def no_inflation(blocks: Iterable[Block]) -> dict[str, float]:
    """Inflation of blocks whose residual is white noise: 1 for each."""
    return dict.fromkeys((b.name for b in blocks), 1.0)


def inflation_of(problem: Problem, fitted: Fit, noise_level: Mapping[Key, NoiseLevel]) -> Inflation:
    """Inflation by the autocorrelation that a fit leaves in each block, at the least that of the
    noise: parameters that follow the noise of a drive leave too little of it. A recording that is
    missed by far more than most has one of its own, so that it takes no weight from the others.
    """

    def noise_of(block: Block) -> float:
        keys = [(block.name, p.recording.name) for p in problem.recordings]
        levels = [noise_level[key].inflation for key in keys if key in noise_level]
        return float(np.mean(levels)) if levels else 1.0

    recordings_and_residuals = problem.recordings, fitted.residuals, FIT_BIN_TIME
    usual = {
        b.name: max(noise_of(b), usual_inflation(b, *recordings_and_residuals))
        for b in problem.blocks
    }
    return Inflation(
        usual,
        {
            key: of_recording
            for b in problem.blocks
            for key, of_recording in inflation_apart(b, *recordings_and_residuals).items()
        },
    )
