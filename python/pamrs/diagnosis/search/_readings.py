"""Other units of channels, tried before any physics: whether what the model misses is how a column
is read.

A wrong unit is a factor of a short list, a wrong zero of a pressure is one atmosphere: an effect or
a wrong parameter has no reason to look like either. Each way to read each channel, and all channels
of a kind at once, is judged by what the refitted baseline then leaves in all blocks together. It is
believed where it takes nearly all that is above the noise, and where a factor (or an offset) that
is free would be the one of the list. Of factors of a few per cent parameters inside their
tolerances absorb most: such a one is believed where the sum of squares clearly falls to no more
than noise, and a free factor is the one of the list within its standard error. The gain of a sensor
would look the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import block_of, channel_of, unit_of
from pamrs.diagnosis.fit import (
    Fit,
    Problem,
    free_baseline,
    known_parameters,
    residuals,
    stacked,
)
from pamrs.diagnosis.noise import (
    correlation_time,
    excess,
    inflation_of,
    no_inflation,
    noise_levels,
)
from pamrs.diagnosis.prepare import NOISE_STDS, Prepared, Residual, implausible
from pamrs.diagnosis.search._baseline import refitted, thorough
from pamrs.errors import SimulationError
from pamrs.findings import ChannelError
from pamrs.rig import Rig
from pamrs.simulation import core_rig
from pamrs.units import measured_from, parse_unit

# [variances of the noise] from which units are doubted: a wrong one leaves hundreds, drives two
_SUSPECT = 3.0
# share of that excess which a unit may leave after one step of the parameters to be worth a fit
_PROMISING = 0.3
_FITTED = 4  # units that are fitted, the most promising first; others leave more
# share of the excess that a unit may leave: physics may be there too, found by others
_LEFT = 0.05
# log of a small factor (bar, atmosphere, kgf/cm2), which parameters absorb: a free one tells
_SMALL_STEP = 0.1
# standard errors by which such a factor beats none: some ten are tried, in coloured noise
_CLEAR_STDS = 5.0
# parts of the step from the unit said within which a free factor is, half being no nearer
_CLOSER = 0.25


OTHERS: Final[dict[str, tuple[str, ...]]] = {
    "Pa": ("Pa", "hPa", "mmHg", "inH2O", "kPa", "psi", "mH2O", "kgf/cm2", "bar", "atm", "MPa"),
    "rad": ("mrad", "deg", "rad", "rev"),
    "m": ("um", "mm", "cm", "in", "m"),
    "N": ("N", "lbf", "kgf", "kN"),
    "N m": ("N mm", "lbf in", "N m", "lbf ft", "kgf m"),
    "V": ("mV", "V"),
}
"""Units that a column may be in, by the SI unit of its channel."""


@dataclass(frozen=True)
class Reading:
    """Another way to read channels of a log.

    Attributes
    ----------
    channels : tuple of str
        Which ones.
    said, likely : str
        The unit of the log, and the one that fits; ``"gauge"`` and ``"absolute"`` of pressures with
        another zero.
    factors : tuple of float
        By which the SI values of each channel are multiplied.
    offset : float
        What is added to them then, SI.
    gain, std : float
        Of a factor of a few per cent: the one that is free, and its standard error; NaN of others.
    before, after : float
        What the refitted baseline leaves, in variances of the noise, as the log is said to be and
        read so: the mean square of bin means over all blocks.
    fit, was : Fit or None
        The refitted baselines, read so and as the log is said to be.
    """

    channels: tuple[str, ...]
    said: str
    likely: str
    factors: tuple[float, ...]
    offset: float = 0.0
    gain: float = math.nan
    std: float = math.nan
    before: float = math.nan
    after: float = math.nan
    fit: Fit | None = None
    was: Fit | None = None

    @property
    def size(self) -> float:
        """Distance from the unit said: an offset [SI], or the logarithm of the largest factor."""
        return abs(self.offset) or max(abs(math.log(factor)) for factor in self.factors)

    def of(self, prepared: Prepared) -> Prepared:
        """Recording with its channels read in this way."""
        maps = dict(zip(self.channels, self.factors, strict=True))

        def turned(values: Mapping[str, Array]) -> dict[str, Array]:
            return {
                name: maps[name] * v + self.offset if name in maps else v
                for name, v in values.items()
            }

        recording = replace(
            prepared.recording,
            channels=turned(prepared.recording.channels),
            commands=turned(prepared.recording.commands),
        )
        signals = {
            name: (maps[name] * value + self.offset, maps[name] * slope)
            if name in maps
            else (value, slope)
            for name, (value, slope) in prepared.signals.items()
        }
        noise = {name: maps.get(name, 1.0) * level for name, level in prepared.noise.items()}
        return replace(
            prepared,
            recording=recording,
            commands=turned(prepared.commands),
            held=turned(prepared.held),
            signals=signals,
            raw=turned(prepared.raw),
            noise=noise,
            steps={name: maps.get(name, 1.0) * step for name, step in prepared.steps.items()},
            _start_states={},
        )

    def read(self, problem: Problem) -> Problem:
        """Problem with its recordings read in this way."""
        return replace(problem, recordings=[self.of(p) for p in problem.recordings])


def find_misread(problem: Problem, nominal: Rig) -> Reading | None:
    """The way to read channels that explains what the model misses, where there is one.

    Parameters
    ----------
    problem : Problem
        Recordings to fit, as their log is said to be.
    nominal : Rig
        The nominal model.

    Returns
    -------
    Reading or None
        None where the baseline leaves little more than noise, and where no unit of the list takes
        nearly all of what it leaves.
    """
    every = list(_readings(problem, nominal))
    small = [r for r in every if not r.offset and r.size < _SMALL_STEP]
    large = _worth_a_fit(problem, nominal, [r for r in every if r not in small])
    # what is no more than a gauge's slope may be off by tells nothing
    small = [r for r in small if r.size >= NOISE_STDS * problem.settings.gauge_error]
    if not (small or large):
        return None
    try:
        was = refitted(problem, nominal, no_inflation(problem.blocks))
    except SimulationError:
        return None
    fitted = [_fit_reading(problem, nominal, was, reading) for reading in large]
    if _power(problem, was) <= _SUSPECT:
        fitted += [_fit_gain(problem, nominal, was, reading) for reading in small]
    believed = [r for r in fitted if r is not None and r.fit is not None]
    return min(believed, key=lambda r: r.fit.cost if r.fit else math.inf, default=None)


def _worth_a_fit(problem: Problem, nominal: Rig, readings: Sequence[Reading]) -> list[Reading]:
    """Readings that take most of what one step of the parameters leaves, where that is much."""
    names = free_baseline(problem, nominal)
    least_left = _linear(problem, nominal, names)
    if least_left <= _SUSPECT:
        return []
    powers: list[tuple[float, Reading]] = []
    for reading in readings:
        reread = reading.read(problem)
        if _possible(reread, nominal):
            with suppress(SimulationError):
                powers.append((_linear(reread, nominal, names), reading))
    powers.sort(key=lambda item: item[0])
    worth = [r for power, r in powers if power - 1.0 <= _PROMISING * (least_left - 1.0)]
    return worth[:_FITTED]


def _fit_reading(problem: Problem, nominal: Rig, was: Fit, reading: Reading) -> Reading | None:
    """A reading with its fit, where the recordings ask for it."""
    reread = reading.read(problem)
    try:
        now = refitted(reread, nominal, no_inflation(problem.blocks))
    except SimulationError:
        return None
    before, after = _power(problem, was), _power(reread, now)
    if after - 1.0 > _LEFT * (before - 1.0) or _spoils_a_block(problem, was, reread, now):
        return None
    if not _free_is_listed(reread, now, reading):
        return None
    return replace(reading, before=before, after=after, fit=now, was=was)


def _fit_gain(problem: Problem, nominal: Rig, was: Fit, reading: Reading) -> Reading | None:
    """A reading by a factor of a few per cent, where the recordings ask for it.

    Parameters inside their tolerances absorb most of what it misses, and what it takes is less than
    noise from bin to bin: asked is the sum of squares, priors included, as the parameters follow
    the factor, each block's residual weighted by its autocorrelation. Where physics is missing too
    it is not reported.
    """
    reread = reading.read(problem)
    beyond = replace(reading, factors=tuple(factor**2 for factor in reading.factors)).read(problem)
    try:
        now = thorough(reread, nominal, no_inflation(problem.blocks), was)
        before, after = _power(problem, was), _power(reread, now)
        levels, least = noise_levels(reread, core_rig(now.rig)), 0.5 * _CLEAR_STDS**2
        left = (
            excess(b, reread.recordings, now.residuals, levels, reread.settings)
            for b in reread.blocks
        )
        if was.cost - now.cost < least * max(1.0, after) or any(
            one.ratio > one.limit for one in left
        ):
            return None
        inflation = inflation_of(reread, now, levels)
        none, listed, far = (
            thorough(read, nominal, inflation, start).cost
            for read, start in ((problem, was), (reread, now), (beyond, now))
        )
        if none - listed < least:
            return None
    except SimulationError:
        return None
    # a parabola through none, the factor and its square, in steps of the factor
    bend = none - 2.0 * listed + far
    if bend <= 0.0:
        return None
    best = 0.5 + (none - listed) / bend
    std = math.sqrt(0.5 / bend)
    step = math.log(reading.factors[0])
    gain = math.exp(step * best)
    clear = abs(gain - 1.0) >= NOISE_STDS * problem.settings.gauge_error
    if not clear or abs(best - 1.0) > NOISE_STDS * std:
        return None
    fits = replace(reading, before=before, after=after, fit=now, was=was)
    return replace(fits, gain=gain, std=gain * abs(step) * std)


def _power(problem: Problem, fitted: Fit) -> float:
    rows, _ = stacked(problem, fitted.residuals, fitted.inflation)
    return float(rows @ rows) / max(1, rows.size)


def _spoils_a_block(problem: Problem, was: Fit, reread: Problem, now: Fit) -> bool:
    """True where a reading clearly raises what any block leaves: the right unit does not, whatever
    physics is missing as well.
    """
    blocks = [[block] for block in problem.blocks]
    before = [_power(replace(problem, blocks=one), was) for one in blocks]
    after = [_power(replace(reread, blocks=one), now) for one in blocks]
    return any(b > _SUSPECT * max(1.0, a) for a, b in zip(before, after, strict=True))


def _linear(problem: Problem, rig: Rig, names: Sequence[str]) -> float:
    """Mean square of bin means, in variances of the noise, that the baseline leaves after one step
    of its parameters inside their tolerances.
    """
    known = known_parameters(rig)
    rows, slope = stacked(problem, residuals(problem, rig, names), no_inflation(problem.blocks))
    square = float(rows @ rows)
    if not math.isfinite(square):
        raise SimulationError("a residual is not finite")
    if slope is not None and np.all(np.isfinite(slope)):
        scaled = slope * np.array([known[name].tol for name in names])
        normal = scaled.T @ scaled + np.eye(len(names))
        most = problem.settings.most_tolerances
        step = np.clip(np.linalg.solve(normal, -scaled.T @ rows), -most, most)
        square = min(square, float(np.sum((rows + scaled @ step) ** 2)))
    return square / max(1, rows.size)


def _free_is_listed(problem: Problem, fitted: Fit, reading: Reading) -> bool:
    """True where a free factor (or offset), fitted with the parameters, would be that of the list;
    the problem is that of the reading.
    """
    step = 0.005 * (abs(reading.offset) or 1.0)  # for the derivative
    factor, offset = (1.0, step) if reading.offset else (1.0 + step, 0.0)
    moved = replace(reading, factors=(factor,) * len(reading.channels), offset=offset)
    pairs = [(p, moved.of(p)) for p in problem.recordings]
    # in units of the noise that it has, or a free factor would make the noise larger
    other = replace(problem, recordings=[replace(m, noise=p.noise) for p, m in pairs])
    names = list(fitted.values)
    rows, slope = stacked(problem, residuals(problem, fitted.rig, names), fitted.inflation)
    try:
        turned, _ = stacked(other, residuals(other, fitted.rig), fitted.inflation)
    except SimulationError:
        return False
    if turned.size != rows.size:
        return False
    columns = [((turned - rows) / step)[:, None]]
    if slope is not None:
        columns.append(slope * np.array([fitted.scales[name] for name in names]))
    design = np.concatenate(columns, axis=1)
    prior = np.diag([0.0] + [1.0] * (design.shape[1] - 1))
    strain = np.array([0.0, *(fitted.moved[name] for name in names)][: design.shape[1]])
    inverse = np.linalg.pinv(design.T @ design + prior, hermitian=True)
    away = abs(float((inverse @ (design.T @ rows + prior @ strain))[0]))
    # what the model leaves besides is coloured, so as many numbers fewer, and other in each block
    weight = design @ inverse[:, 0]
    coloured = float(np.sum((weight * rows) ** 2)) * correlation_time(rows)
    spread = NOISE_STDS * math.sqrt(max(0.0, inverse[0, 0], coloured))
    exact = problem.settings.gauge_error * (abs(reading.offset) or 1.0)
    return away <= max(exact, spread) and away + spread <= _CLOSER * reading.size


def _possible(problem: Problem, nominal: Rig) -> bool:
    """True where recordings read in this way can be of the rig at all."""
    return not any(implausible(p.recording, nominal, problem.settings) for p in problem.recordings)


def _readings(problem: Problem, nominal: Rig) -> Iterator[Reading]:
    """Ways to read the channels that the blocks use: each alone, all of one name, those of one part
    of the rig (a supply's gauge and its command), and all of one dimension.
    """

    def part(name: str) -> tuple[str, str, str]:
        return channel_of(name).partition("_")[0], block_of(name), unit_of(name)

    used = list(
        dict.fromkeys(name for block in problem.blocks for name in (block.channel, *block.drives))
    )
    units_said = {name: _unit_said(problem, name) for name in used}
    sets = dict.fromkeys(
        [
            *((name,) for name in used),
            *(tuple(n for n in used if channel_of(n) == channel_of(name)) for name in used),
            *(tuple(n for n in used if part(n) == part(name)) for name in used),
            *(tuple(n for n in used if unit_of(n) == unit_of(name)) for name in used),
        ]
    )
    ambient = float(nominal.model["gas"]["ambient_pressure"])
    for channels in sets:
        kinds = {unit_of(name) for name in channels}
        if len(kinds) > 1:
            continue
        unit = kinds.pop()
        log_units = " and ".join(dict.fromkeys(units_said[name] for name in channels))
        sizes = [_size(units_said[name]) for name in channels]
        for other in OTHERS.get(unit, ()):
            factors = tuple(_size(other) / size for size in sizes)
            if max(abs(math.log(factor)) for factor in factors) > 1e-6:
                yield Reading(channels, log_units, other, factors)
        if unit == "Pa":
            same = (1.0,) * len(channels)
            yield Reading(channels, "gauge", "absolute", same, -ambient)
            yield Reading(channels, "absolute", "gauge", same, ambient)


def _unit_said(problem: Problem, channel: str) -> str:
    """The unit in which the log is said to have a channel; SI where it was read from none."""
    units = (p.recording.said.get(channel, "") for p in problem.recordings)
    unit = next((u for u in units if u), "")
    return unit or unit_of(channel)


def _size(unit: str) -> float:
    """Size of a unit, that of an absolute pressure without what says so."""
    return parse_unit(measured_from(unit)[0]).scale


def reading_errors(nominal: Rig, problem: Problem, reading: Reading) -> dict[str, ChannelError]:
    """Errors of each channel as the log says, before and after the refit, and read so."""
    if reading.was is None or reading.fit is None:
        return {}
    turned = reading.read(problem)
    try:
        before = residuals(problem, nominal)
        refit = residuals(problem, reading.was.rig)
        after = residuals(turned, reading.fit.rig)
    except SimulationError:
        return {}
    errors_of: dict[str, ChannelError] = {}
    for block in problem.blocks:
        keys = [(block.name, p.recording.name) for p in problem.recordings]
        noise = math.sqrt(float(np.mean([p.noise[block.channel] ** 2 for p in turned.recordings])))
        errors = [_rms([stage[key] for key in keys]) for stage in (before, refit, after)]
        errors_of[block.channel] = ChannelError(noise, *errors)
    return errors_of


def _rms(of_recordings: list[Residual]) -> float:
    values = np.concatenate([r.value[r.rows] for r in of_recordings])
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan
