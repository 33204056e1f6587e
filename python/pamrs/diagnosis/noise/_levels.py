"""How much of a block's residual is more than noise: noise levels, excess, statistics of
autocorrelated residuals.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, t

from pamrs import _core
from pamrs.channels import channel_of
from pamrs.diagnosis.fit import Key, Problem, bin_width
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned, change, residual, smoothed
from pamrs.diagnosis.settings import NoiseSettings
from pamrs.errors import SimulationError

__all__ = ["Excess", "NoiseLevel", "bins_of", "excess", "noise_levels"]

Array = NDArray[np.float64]
Stated = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class NoiseLevel:
    """What noise alone leaves in a block's residual over one recording.

    Attributes
    ----------
    sample : float
        Standard deviation of single samples: the output's own noise and that of the drives.
    binned : float
        Standard deviation of bin means, with the error that the rig file says the model has.
    scatter : float
        Standard deviation, from one realisation of the noise to another, of the logarithm of the
        mean square of the bin means.
    stated : float
        Share of the variance of bin means that is the stated error of the model.
    """

    sample: float
    binned: float
    scatter: float = 0.0
    stated: float = 0.0


@dataclass(frozen=True)
class Excess:
    """Residual of a block against its noise level, pooled over recordings.

    Attributes
    ----------
    ratio : float
        Variance of bin means over that of the noise level; 1 when only noise is left.
    systematic : float
        Standard deviation of what is not noise, in units of the noise.
    p_value : float
        Chance of such a ratio (above the margin) from noise, by the scatter of the noise levels.
    limit : float
        Ratio that noise exceeds with the chance ``noise.chance`` of the settings, at most
        ``noise.most_limit``.
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
    settings = prepared.settings.noise
    return max(settings.least_bin_samples, bin_width(prepared, settings.bin_time))


def noise_levels(
    problem: Problem, core: _core.Rig, stated: Stated | None = None
) -> dict[Key, NoiseLevel]:
    """Noise levels of all blocks and recordings, the drives' noise carried through the model by
    simulation.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    core : _core.Rig
        A model close to the data.
    stated : dict, optional
        The model's error as the rig file states it (:attr:`pamrs.Rig.model_error`): excess inside
        it is none.
    """
    found: dict[Key, NoiseLevel] = {}
    settings, known = problem.settings, stated or {}
    for prepared in problem.recordings:
        rng = np.random.default_rng([settings.seed, crc32(prepared.recording.name.encode())])
        for block in problem.blocks:
            base = residual(block, core, prepared, [])
            width = bins_of(prepared)
            powers: list[list[float]] = []
            noisy = [name for name in block.drives if name in prepared.signals]
            rows = base.rows
            _, counts = binned(base.value, rows, width)
            seen = counts > 0
            for _ in range(settings.noise.replicates if seen.any() else 0):
                shaken = np.zeros(prepared.n)
                with contextlib.suppress(
                    SimulationError
                ):  # a realisation that leaves the model's range tells nothing of the others
                    shaken = (
                        change(block, core, _shaken(prepared, noisy, rng), base) - base.value
                        if noisy
                        else shaken
                    )
                means, _ = binned(shaken, rows, width)
                own = rng.normal(0.0, base.noise, int(seen.sum())) / np.sqrt(counts[seen])
                squares = [
                    float(np.mean(v**2)) for v in (shaken[rows], means[seen], means[seen] + own)
                ]
                powers.append(squares)
            sample, drives, _ = np.mean(powers, axis=0) if powers else (0.0, 0.0, 0.0)
            white = float(np.mean(1.0 / counts[seen])) if seen.any() else 1.0
            # mean squares of few modes are skew, their logarithms hardly
            scatter = (
                float(np.std(np.log([both for *_, both in powers]), ddof=1)) if powers else 0.0
            )
            noise = base.noise**2 * white + drives
            error = _stated_variance(block, base, prepared, known)
            error += _carried_variance(block, core, base, prepared, known, rng)
            found[block.name, prepared.recording.name] = NoiseLevel(
                math.sqrt(base.noise**2 + sample),
                math.sqrt(noise + error),
                scatter,
                error / (noise + error),
            )
    return found


_FLOWS = {"supply": ("supply", "valve", "line"), "chamber": ("valve", "line", "chamber")}
"""Blocks of a rig file whose share of error is one of the flow into a block."""
_PULLS = ("muscle", "transmission", "joint", "arm", "link", "load")
"""Blocks whose share of error is one of what moves: as if the pressure were off by it."""


def _stated_variance(block: Block, base: Residual, prepared: Prepared, stated: Stated) -> float:
    """Variance of a block's bin means by the error that the rig file states: sizes as they are,
    shares of what the block's output does after the start of each window.
    """
    channel, own = block.channel, block.channel.partition(".")[2]
    kinds = {channel_of(channel), *_FLOWS.get(block.kind, ())}
    acting = [
        error
        for name, error in stated.items()
        if channel_of(name) in kinds and name.partition(".")[2] in ("", own)
    ]
    if not acting:
        return 0.0
    starts = prepared.starts(block.window, block.drives)
    moved = np.zeros(prepared.n)
    for a, b in zip(starts, [*starts[1:], prepared.n], strict=True):
        moved[a:b] = base.prediction[a:b] - base.prediction[a]
    signal = float(np.mean(moved[base.rows] ** 2)) if base.rows.any() else 0.0
    return sum(e["share"] ** 2 * signal if "share" in e else e["size"] ** 2 for e in acting)


def _drive_errors(block: Block, prepared: Prepared, stated: Stated) -> dict[str, float]:
    """Stated error of what drives a block [SI]: of the measured signal itself, and of the force
    that a pressure stands for.
    """
    pulls = [e["share"] for name, e in stated.items() if channel_of(name) in _PULLS]
    found = {}
    for name in block.drives:
        if name not in prepared.signals:
            continue
        largest = float(np.abs(prepared.signals[name][0]).max())
        error = stated.get(name, stated.get(channel_of(name), {}))
        sizes = [error.get("size", 0.0), error.get("share", 0.0) * largest]
        if block.mechanical and channel_of(name) == "muscle_pressure":
            sizes += [share * largest for share in pulls]
        if any(sizes):
            found[name] = math.hypot(*sizes)
    return found


def _carried_variance(
    block: Block,
    core: _core.Rig,
    base: Residual,
    prepared: Prepared,
    stated: Stated,
    rng: np.random.Generator,
) -> float:
    """Variance of a block's bin means by the stated error of what drives it: curves over the
    measured value, carried through the model by simulation.
    """
    drives = _drive_errors(block, prepared, stated)
    powers = []
    for _ in range(prepared.settings.noise.replicates if drives else 0):
        signals = {}
        for name, size in drives.items():
            value, slope = prepared.signals[name]
            more, steeper = _curve(value, size, rng)
            signals[name] = (value + more, slope * (1.0 + steeper))
        with contextlib.suppress(SimulationError):  # it leaves the model's range
            moved = change(block, core, prepared.shaken(signals), base) - base.value
            means, counts = binned(moved, base.rows, bins_of(prepared))
            powers.append(float(np.mean(means[counts > 0] ** 2)) if counts.any() else 0.0)
    return float(np.mean(powers)) if powers else 0.0


def _curve(value: Array, size: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """An error of a stated size that is a smooth curve over the value, and its derivative."""
    low, range_of = float(value.min()), max(float(np.ptp(value)), 1e-12)
    waves = np.pi * np.arange(3)  # a shift, a slope, a bend
    phases = rng.uniform(0.0, 2.0 * np.pi, 3)
    sizes = rng.normal(0.0, size * math.sqrt(2.0 / 3.0), 3)
    angles = waves * ((value - low) / range_of)[:, None] + phases
    return np.cos(angles) @ sizes, -np.sin(angles) @ (sizes * waves) / range_of


def _shaken(prepared: Prepared, names: Iterable[str], rng: np.random.Generator) -> Prepared:
    """The recording with one more realisation of noise, as smoothed, on some drives."""
    signals = {}
    for name in names:
        raw = rng.normal(0.0, prepared.noise[name], prepared.n)
        value, slope = prepared.signals[name]
        more, steeper = smoothed(raw, prepared.dt, prepared.lengths[name])
        signals[name] = (value + more, slope + steeper)
    return prepared.shaken(signals)


def excess(
    block: Block,
    recordings: list[Prepared],
    found: dict[Key, Residual],
    noise_level: dict[Key, NoiseLevel],
    settings: NoiseSettings,
) -> Excess:
    """Pool a block's residual over recordings and compare it with its noise level."""
    keys: list[Key] = []
    ratios, weights, squares, noises = [], [], [], []
    pieces: list[tuple[float, int]] = []
    for prepared in recordings:
        key = (block.name, prepared.recording.name)
        r = found[key]
        means, counts = binned(r.value, r.rows, bins_of(prepared))
        length = max(1, round(settings.piece_time / (bins_of(prepared) * prepared.dt)))
        own = noise_level[key].binned ** 2
        for first in range(0, means.size, length):
            there = means[first : first + length][counts[first : first + length] > 0]
            if there.size:
                pieces.append((float(np.mean(there**2)) / own, int(there.size)))
        means = means[counts > 0]
        if means.size == 0:
            continue
        keys.append(key)
        ratios.append(float(np.mean(means**2)) / noise_level[key].binned ** 2)
        weights.append(means.size)
        squares.append(float(np.mean(r.value[r.rows] ** 2)))
        noises.append(noise_level[key].sample ** 2)
    if not ratios:
        return Excess(1.0, 0.0, 1.0, float("nan"), float("nan"), settings.margin)
    ratio = float(np.average(ratios, weights=weights))
    share = float(
        np.mean([noise_level[key].binned ** 2 / noise_level[key].sample ** 2 for key in keys])
    )
    shares = np.array(weights) / sum(weights)
    # noise levels are means of as many realisations, and their scatter is known from no more
    random = [(1.0 - noise_level[key].stated) * noise_level[key].scatter for key in keys]
    pooled = math.sqrt(float(np.sum((shares * random) ** 2)))
    scatter = max(1e-6, pooled * math.sqrt(1.0 + 1.0 / settings.replicates))
    chance = t(len(keys) * (settings.replicates - 1))
    beyond = min(settings.most_log_limit, float(chance.isf(settings.chance)) * scatter)
    # the model has one error, the same in all recordings, and its square is that of a few numbers
    stated = float(np.sum(shares * [noise_level[key].stated for key in keys]))
    few = settings.stated_freedom
    larger = 1.0 + stated * (float(chi2.isf(settings.chance, few)) / few - 1.0)
    scatter = math.hypot(scatter, stated * math.sqrt(2.0 / few))
    margin = settings.margin * larger
    return Excess(
        ratio,
        math.sqrt(max(0.0, (ratio - 1.0) * share)),
        float(chance.sf(math.log(max(ratio, 1e-300) / margin) / scatter)),
        math.sqrt(float(np.average(squares, weights=weights))),
        math.sqrt(float(np.average(noises, weights=weights))),
        min(settings.most_limit * larger, margin * math.exp(beyond)),
        scatter,
        tuple(pieces),
    )
