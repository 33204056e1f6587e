"""Recordings made ready for the cut chain: smoothed drive signals, noise levels, windows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import PchipInterpolator
from scipy.signal import savgol_filter
from scipy.stats import chi2, norm

from pamrs import _core
from pamrs._arrays import Array, Index, Mask, stretches
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import EFFECTS
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig, supplies_of

# standard deviations by which noise may move a value: one in 370 is moved farther
NOISE_STDS = 3.0
ROUNDING = 1e-6  # share, noise level or square of one below which a number is rounding
# chance that noise alone shortens the filter: a corner has to miss more (decision 22)
_SMOOTHING_ODDS = 1e-3
# samples of each spectrum in which a band quieter than the noise is sought (decision 22)
_SPECTRUM_SAMPLES = 64
# spectra without a sample that was left out, from which bands are compared (decision 22)
_LEAST_SPECTRA = 16
# variance share below which the quietest band is the noise: white noise has 0.38 (decision 22)
_BAND_SHARE = 0.25
# [s] stretches at a start that give value and slope; the longest that fits (decision 22)
_START_REACHES = (0.04, 0.08, 0.16)
# ratio of two variances, or errors, that count as equal: a cubic fits the stretch of a start
# (decision 22); commands moved by an offset leave 0.95 to 1.02 of a healthy rig, 1.45 of a wall
AS_LARGE = 1.1
# deviations by which a stretch may have more, and slopes of two differ (Lepski 1991)
_START_STDS = 2.0
_START_LEAST_SAMPLES = 8  # fewest samples of a stretch: a cubic takes four
_BRIDGED_SAMPLES = 3  # longest hole in a driving signal that is bridged
# usual change of a command over as many samples beyond which it steps in a hole: a sine has 1.4
_STEP_CHANGES = 3.0
# share of repeated samples from which values step by a converter; corners of triangles give 1 %
_ROUNDED_STILL = 0.03
# noise in converter steps below which rounding is not white; at half a step it nearly is
_ROUNDED_SHARE = 0.5
# fewest samples of a recording, and usable ones of a channel: noise takes eleven, a leak of a shut
# chamber shows in sixteen
_FEWEST_SAMPLES = 12
_LEAST_CHANNEL_SHARE = 0.2  # share of a channel's samples that must be usable


Lengths = Index


DRIVES = ("supply_pressure", "line_pressure", "muscle_pressure", "joint_angle", "length")
"""Channels at which a rig is cut, without the names of blocks."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """One recording with what the cut chain needs.

    Attributes
    ----------
    recording : Recording
        As loaded.
    commands : dict of str to (n,) array
        Commands by the names of the core, of valves [V] and regulators [Pa], holes filled with the
        last value; a command that was not recorded stays at rest, and no block that it drives is
        judged.
    held : dict of str to (n * m,) array
        The same as the log has them, `m` from each sample to the next.
    signals : dict of str to (value, slope)
        Smoothed channels and their time derivatives, holes bridged, by the names of the core
        (``muscle_pressure.flexor``).
    raw : dict of str to (n,) array
        The same channels as measured, holes bridged.
    noise : dict of str to float
        Standard deviation of each channel's sample noise, quantisation included.
    lengths : dict of str to (n,) array of int
        Samples of the filter at each sample of a channel.
    settings : DiagnosisSettings
        What it was made ready by.
    steps : dict of str to float
        Step of the converter of each channel whose own noise is smaller than that, so that its
        rounding is not white.
    unsettled : dict of str to int
        First samples of a channel that are not judged, since they show where something that nobody
        measured began.
    after_holes : dict of str to (n,) bool array
        Rows of a channel that are not judged, since they show when a command changed that was not
        recorded as it did.
    temperatures : dict of str to float
        Temperature at which a gas without a thermometer began [K], by the channel of its pressure:
        that of the room but where the recording begins in a transient. The first windows are freed
        of it.
    outlets : dict of str to (float, float)
        Where regulators begin at rest, as the recording states it, and how well that is known [Pa,
        gauge; a standard deviation], by their full names.
    simulated : tuple of str
        Channels among the signals that nobody measured: pressures of tanks without a gauge.
    at_rest : frozenset of str
        Channels of motions that begin at rest, as what follows tells.
    """

    recording: Recording
    commands: dict[str, Array]
    held: dict[str, Array]
    signals: dict[str, tuple[Array, Array]]
    raw: dict[str, Array]
    noise: dict[str, float]
    lengths: dict[str, Lengths]
    settings: DiagnosisSettings
    steps: dict[str, float] = field(default_factory=dict)
    unsettled: dict[str, int] = field(default_factory=dict)
    after_holes: dict[str, Mask] = field(default_factory=dict)
    temperatures: dict[str, float] = field(default_factory=dict)
    outlets: dict[str, tuple[float, float]] = field(default_factory=dict)
    simulated: tuple[str, ...] = ()
    at_rest: frozenset[str] = frozenset()
    _start_states: dict[tuple[str, tuple[int, ...]], tuple[Array, Array]] = field(
        repr=False, default_factory=dict
    )
    _clear: dict[tuple[str, ...], Mask] = field(repr=False, default_factory=dict)

    def driving(self, *, mechanical: bool) -> dict[str, Array]:
        """Commands for the prediction of a block: what moves knows them by the pressures alone, so
        that their means will do; a gas gets them as the log has them.
        """
        return self.commands if mechanical else self.held

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.recording)

    @property
    def dt(self) -> float:
        """Sample time [s]."""
        return self.recording.sample_time

    def clear(self, drives: tuple[str, ...]) -> Mask:
        """Rows at which every drive was measured: holes of up to three samples are bridged, longer
        ones, and those in which a command steps, are cut out together with what the smoothing
        carries over their edges.
        """
        if drives not in self._clear:
            settings = self.settings
            reach = round(0.5 * settings.smoothing_time / self.dt)
            out = np.ones(self.n, dtype=bool)
            measured = [name for name in drives if name not in self.simulated]
            mask = self.recording.valid(*measured) if measured else out
            for a, b in _long_holes(mask, 0):
                if b - a > _BRIDGED_SAMPLES or any(_steps(c, a, b) for c in self.commands.values()):
                    out[max(0, a - reach) : b + reach] = False
            out.flags.writeable = False
            self._clear[drives] = out
        return self._clear[drives]

    def starts(self, window: float | None, drives: tuple[str, ...]) -> list[int]:
        """Samples at which windows begin: every ``window`` seconds (None: once) and after each hole
        in the drives.
        """
        starts = {0}
        if window is not None:
            starts |= set(range(0, self.n, max(8, round(window / self.dt))))
        good = self.clear(drives)
        starts |= set((np.flatnonzero(good[1:] & ~good[:-1]) + 1).tolist())
        return sorted(starts)

    def with_starts(self, channel: str, starts: list[int]) -> tuple[Array, Array]:
        """Smoothed channel and its derivative, with the best estimates of both where windows start.

        At the edge of a recording the filter's derivative is ten times as noisy as inside, and a
        joint that is given a speed that it did not have slides from where it stood. At a start the
        longest stretch counts to which a cubic still fits but for the noise: of a channel that is
        one cubic all of it.
        """
        key = (channel, tuple(starts))
        if key not in self._start_states:
            value, slope = (array.copy() for array in self.signals[channel])
            for at in starts if self.lengths[channel].any() else []:
                state = _state(
                    self.raw[channel],
                    self.recording.mask[channel],
                    self.noise[channel],
                    self.dt,
                    at,
                )
                if at == 0 and channel in self.at_rest:
                    rows = np.flatnonzero(self.recording.mask[channel])[:_START_LEAST_SAMPLES]
                    state = float(np.median(self.raw[channel][rows])), 0.0
                if state is not None:
                    value[at], slope[at] = state
            self._start_states[key] = value, slope
        return self._start_states[key]

    def bridged(self) -> Prepared:
        """Recording without holes, for simulations through them: no window begins there."""
        whole = {name: np.ones_like(own) for name, own in self.recording.mask.items()}
        return replace(
            self, recording=replace(self.recording, mask=whole), _start_states={}, _clear={}
        )

    def commanded_early(self) -> Prepared | None:
        """Recording whose commands change where a hole in them begins, not where it ends; None
        where that is no change.
        """
        commands, logged = dict(self.commands), dict(self.held)
        for name in set(commands) & set(self.recording.channels):
            mask = self.recording.mask[name]
            early = held(commands[name][::-1], mask[::-1])[::-1]
            if np.any(early != commands[name]):
                each = logged[name].size // self.n
                known = np.repeat(mask, each)
                commands[name] = np.ascontiguousarray(early)
                logged[name] = np.where(known, logged[name], np.repeat(early, each))
        if all(commands[name] is values for name, values in self.commands.items()):
            return None
        return replace(self, commands=commands, held=logged)

    def with_signals(self, shaken: dict[str, tuple[Array, Array]]) -> Prepared:
        """Recording with other smoothed channels; the starts of all others are kept."""
        kept = {
            key: state for key, state in dict(self._start_states).items() if key[0] not in shaken
        }
        return replace(self, signals=self.signals | shaken, _start_states=kept)

    def usable(self, output: str, drives: tuple[str, ...], starts: list[int]) -> Mask:
        """Rows whose prediction rests on measured drives since their window began, and whose output
        was measured.
        """
        bad = ~self.clear(drives)
        rows = np.zeros(self.n, dtype=bool)
        for a, b in zip(starts, [*starts[1:], self.n], strict=True):
            first = np.flatnonzero(bad[a:b])
            rows[a : a + (int(first[0]) if first.size else b - a)] = True
        rows[: self.unsettled.get(output, 0)] = False
        if output in self.after_holes:
            rows &= ~self.after_holes[output]
        return rows & self.recording.mask[output]


def noise_level(values: Array, mask: Mask, *, seed: int) -> float:
    """Standard deviation of white sample noise, from third differences, robust; at least that of
    quantisation.

    White noise is as loud in one band of frequencies as in another. Where a band is far quieter
    than the third differences say, these are of what the channel really did (a valve that chatters
    from sample to sample), and the noise is that of the quietest band.

    Parameters
    ----------
    values : (n,) array
        Samples on a uniform grid.
    mask : (n,) bool array
        Which may be used.
    seed : int
        Of the dither on a quantised channel.

    Returns
    -------
    float
        In the unit of ``values``; 0 if there are fewer than eight usable samples.
    """
    ok = mask[:-3] & mask[1:-2] & mask[2:-1] & mask[3:]
    if ok.sum() < 8:
        return 0.0
    rounded = _stays(values, mask)
    lattice = _lattice(values[mask]) if rounded else 0.0
    # the median of differences of whole steps moves by whole steps: as much noise as the lattice
    # brings smears them, and is taken off
    dithered = values + np.random.default_rng(seed).uniform(-0.5, 0.5, values.size) * lattice
    variance = (1.4826 * float(np.median(np.abs(np.diff(dithered, 3)[ok])))) ** 2 / 20.0
    least = _quietest_band(values, mask)
    if least < _BAND_SHARE * variance:
        # what jumps from sample to sample shows no small step in time, and a finer lattice
        finer = _lattice(np.unique(values[mask])) if rounded else 0.0
        return float(np.sqrt(max(least, finer**2 / 12.0)))
    return float(np.sqrt(max(variance - lattice**2 / 12.0, lattice**2 / 12.0)))


def _lattice(values: Array) -> float:
    """Smallest step from one number to the next, but for rounding."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-12 * max(1e-12, float(np.abs(values).max()))]
    return float(steps.min()) if steps.size else 0.0


def _stays(values: Array, mask: Mask) -> bool:
    """True where a channel often keeps its value from sample to sample, as one that a converter
    rounds does; an even stroke that is sampled evenly rounds nothing.
    """
    both = mask[1:] & mask[:-1]
    equal = np.diff(values)[both] == 0.0
    return bool(equal.size) and float(np.mean(equal)) > _ROUNDED_STILL


def _quietest_band(values: Array, mask: Mask) -> float:
    """Variance of white noise as loud everywhere as the quietest band of a signal; infinite where
    too few samples are usable in a row.
    """
    lines = _SPECTRUM_SAMPLES // 16
    if values.size < _SPECTRUM_SAMPLES:
        return math.inf
    every, usable = (
        np.lib.stride_tricks.sliding_window_view(part, _SPECTRUM_SAMPLES)[:: _SPECTRUM_SAMPLES // 2]
        for part in (values, mask)
    )
    pieces = every[usable.all(axis=1)]
    if len(pieces) < _LEAST_SPECTRA:
        return math.inf
    window = np.hanning(_SPECTRUM_SAMPLES)
    pieces = pieces - pieces.mean(axis=1, keepdims=True)
    power = np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2 / float(window @ window)
    # the lowest eighth is motion, the last line has half as many numbers
    bands = power[:, lines : 8 * lines].reshape(len(pieces), -1, lines).mean(axis=2)
    return float(np.median(bands, axis=0).min())


def filter_length(dt: float, settings: DiagnosisSettings) -> int:
    """Samples of the smoothing filter at a sample time [s]: odd, at least seven."""
    return max(7, round(settings.smoothing_time / dt) | 1)


def lengths_of(values: Array, noise: float, dt: float, settings: DiagnosisSettings) -> Lengths:
    """Samples over which each sample of a channel can be smoothed: the longest filter to which a
    cubic fits but for the noise, 1 where none does; 0 where one cubic fits the whole channel.

    A pressure has a corner where a valve or a regulator switches, and a filter over the corner
    makes it a bow. What a cubic misses is compared with the noise, or with what it misses at most
    samples where that is more: hum and drift are everywhere, corners are not.

    Parameters
    ----------
    values : (n,) array
        The channel, holes bridged.
    noise : float
        Standard deviation of its noise.
    dt : float
        Sample time [s].
    settings : DiagnosisSettings
        Length of the filter, and how seldom noise alone may shorten it.

    Returns
    -------
    (n,) array of int
    """
    shortest, length = filter_length(math.inf, settings), filter_length(dt, settings)
    if _is_one_cubic(values, noise, length):
        return np.zeros(values.size, dtype=np.intp)
    lengths = np.ones(values.size, dtype=np.intp)
    for count in sorted({shortest, max(shortest, round(0.5 * length) | 1), length}):
        basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, count), 4))[0]
        frames = np.lib.stride_tricks.sliding_window_view(values - values.mean(), count)
        missed = np.sum((frames - (frames @ basis) @ basis.T) ** 2, axis=1) / (count - 4)
        usual = max(noise**2, float(np.median(missed)))
        fits = missed <= usual * chi2.isf(_SMOOTHING_ODDS, count - 4) / (count - 4)
        lengths[np.pad(fits, count // 2, mode="edge")] = count
    return lengths


def _is_one_cubic(values: Array, noise: float, length: int) -> bool:
    """True where one cubic fits a whole channel but for its noise: it is held, or drifts.

    Noise of such a channel would drive a model, and an effect that makes the model answer less to
    what drives it would seem to be in the data. Asked of what the cubic misses are its means over
    so many samples, all together and the largest, and its variance: the noise is known by the same
    samples, so that the latter may be off by twice what chance does.
    """
    missed = values - _cubic(values)(np.arange(values.size))
    pieces = missed[: values.size // length * length].reshape(-1, length)
    count = len(pieces)
    if count <= 4:
        return False
    means = pieces.mean(axis=1) * (math.sqrt(length) / noise)
    spread = 1.0 + 2.0 * float(norm.isf(_SMOOTHING_ODDS)) * math.sqrt(2.0 / values.size)
    return bool(
        means @ means <= chi2.isf(_SMOOTHING_ODDS, count - 4)
        and np.abs(means).max() <= norm.isf(0.5 * _SMOOTHING_ODDS / count)
        and float(np.mean(missed**2)) <= spread * noise**2
    )


def _cubic(values: Array) -> Polynomial:
    """The cubic of least squares through a channel, over the numbers of its samples."""
    return Polynomial.fit(np.arange(values.size), values, 3)


def smoothed(values: Array, dt: float, lengths: Lengths) -> tuple[Array, Array]:
    """A channel smoothed by local cubics (Savitzky & Golay 1964), and its time derivative.

    Parameters
    ----------
    values : (n,) array
        The channel, holes bridged.
    dt : float
        Sample time [s].
    lengths : (n,) array of int
        Length of the filter at each sample, as of `lengths_of`; 1 for the sample as it is, 0
        for one cubic through all samples.

    Returns
    -------
    value, slope : (n,) arrays
    """
    if not lengths.any():
        whole, samples = _cubic(values), np.arange(values.size)
        return whole(samples), whole.deriv()(samples) / dt
    value, slope = values.copy(), np.gradient(values, dt)
    for count in np.unique(lengths[lengths > 1]):
        rows = lengths == count
        value[rows] = savgol_filter(values, int(count), 3)[rows]
        slope[rows] = savgol_filter(values, int(count), 3, deriv=1, delta=dt)[rows]
    return value, slope


def _long_holes(mask: Mask, bridged: int) -> list[tuple[int, int]]:
    """First sample of each hole that is not bridged, and the first after it."""
    return [(a, b) for a, b in stretches(~mask) if b - a > bridged]


def _steps(command: Array, a: int, b: int) -> bool:
    """True where a command steps in a hole: by far more than it usually changes in that time."""
    if a == 0 or b == command.size or command[b] == command[a - 1]:
        return False
    usual = float(np.median(np.abs(command[b - a + 1 :] - command[: a - b - 1])))
    return bool(abs(command[b] - command[a - 1]) > _STEP_CHANGES * usual)


def _state(
    values: Array, mask: Mask, noise: float, dt: float, at: int
) -> tuple[float, float] | None:
    """Value and slope at a sample by the longest stretch around it, free of long holes, that a
    cubic fits but for the noise.

    From the shortest on, as long as the slope stays within what the shorter one leaves open (Lepski
    1991): at the edge of a recording a cubic that hardly misses the samples may miss the slope by
    far. None where no cubic fits.
    """
    holes = _long_holes(mask, _BRIDGED_SAMPLES)
    first = max((b for _, b in holes if b <= at), default=0)
    last = min((a for a, _ in holes if a >= at), default=values.size)
    state, spread = None, math.inf
    for reach in sorted({max(round(s / dt), _START_LEAST_SAMPLES // 2) for s in _START_REACHES}):
        # a side that is cut off makes the other longer
        low, high = max(first, at - reach), min(last, at + reach + 1)
        low, high = (
            max(first, min(low, high - 2 * reach - 1)),
            min(last, max(high, low + 2 * reach + 1)),
        )
        rows = low + np.flatnonzero(mask[low:high])
        count = rows.size
        if count < _START_LEAST_SAMPLES:
            continue
        powers = np.vander((rows - at) / count, 4, increasing=True)
        inverse = np.linalg.inv(powers.T @ powers)
        cubic = inverse @ (powers.T @ values[rows])
        rest = values[rows] - powers @ cubic
        slope = float(cubic[1]) / (count * dt)
        most = AS_LARGE + _START_STDS * math.sqrt(2.0 / (count - 4))
        rough = float(rest @ rest) > most * (count - 4) * noise**2
        if state is not None and (rough or abs(slope - state[1]) > _START_STDS * spread):
            break
        if not rough:
            state, spread = (
                (float(cubic[0]), slope),
                noise * math.sqrt(inverse[1, 1]) / (count * dt),
            )
    return state


def _bridged(values: Array, mask: Mask) -> Array:
    """A channel with its holes bridged by cubics that turn nowhere between samples (Fritsch &
    Butland 1984), and before the first sample and after the last one as it is there.
    """
    known, missing = np.flatnonzero(mask), np.flatnonzero(~mask)
    bridged = values.copy()
    if missing.size:
        between = PchipInterpolator(known, values[known])
        bridged[missing] = between(np.clip(missing, known[0], known[-1]))
    return bridged


def prepare(recording: Recording, rig: Rig, settings: DiagnosisSettings) -> Prepared:
    """Smooth the drive signals of a recording and estimate its noise.

    Raises
    ------
    DiagnosisError
        If the recording is too short, or lacks a command or usable samples that the rig's blocks
        need.
    """
    core = core_rig(rig)
    if why := unusable(recording, rig, core, settings):
        raise DiagnosisError(f"recording {recording.name!r}: {why}")
    signals, raw, noise, lengths, steps = {}, {}, {}, {}, {}
    for name in _looked_at(recording, rig, core):
        mask = recording.mask[name]
        raw[name] = filled = _bridged(recording.channels[name], mask)
        noise[name] = _noise_of(recording, name, settings)
        rounded = _stays(recording.channels[name], mask)
        step = _lattice(_as_logged(recording, name)) if rounded else 0.0
        if noise[name] < _ROUNDED_SHARE * step:
            steps[name] = step
        if noise[name] <= 0:
            noise[name] = max(1e-9, 1e-6 * float(np.ptp(filled)))
        lengths[name] = lengths_of(filled, noise[name], recording.sample_time, settings)
        signals[name] = smoothed(filled, recording.sample_time, lengths[name])
    commands = {name: _command(recording, rig, name) for name in core.inputs}
    logged = max((v.size for v in recording.commands.values()), default=0) // len(recording) or 1
    as_logged = {
        name: recording.commands.get(name, np.repeat(values, logged))
        for name, values in commands.items()
    }
    prepared = Prepared(
        recording, commands, as_logged, signals, raw, noise, lengths, settings, steps
    )
    return replace(prepared, outlets=_stated_outlets(recording, rig))


def _stated_outlets(recording: Recording, rig: Rig) -> dict[str, tuple[float, float]]:
    """Pressures at which a recording says that regulators begin, and how well it knows them."""
    outlets = {}
    for supply in supplies_of(rig, "regulator"):
        full = qualified("supply", supply)
        name = f"{full}.initial_pressure"
        stated = recording.parameters.get(name)
        if stated is not None and stated.error != "own":
            known = abs(stated.slope) * rig.parameter(name).tol if stated.slope else 0.0
            if math.isfinite(known):
                outlets[full] = (stated.value, known)
    return outlets


def _looked_at(recording: Recording, rig: Rig, core: _core.Rig) -> list[str]:
    """Measured channels of a recording that its rig has a use for: what is measured of a block that
    it does not have is left alone.
    """
    drives = [name for name in core.channels if channel_of(name) in DRIVES]
    outputs = (pulls_of(rig), thermometers_of(rig), flows_of(rig))
    every = (*drives, *(name for channels in outputs for name in channels.values()))
    return [name for name in every if name in recording.channels]


def unusable(recording: Recording, rig: Rig, core: _core.Rig, settings: DiagnosisSettings) -> str:
    """Reason why a recording cannot be diagnosed; empty where it can.

    Parameters
    ----------
    recording : Recording
        As loaded.
    rig : Rig
        Nominal model.
    core : _core.Rig
        The same, compiled.
    settings : DiagnosisSettings
        How it is made ready.

    Returns
    -------
    str
        That it is too short, or lacks a command or usable samples of a channel that the rig's
        blocks need.
    """
    length = max(_FEWEST_SAMPLES, filter_length(recording.sample_time, settings))
    if len(recording) < length:
        return f"it has {len(recording)} samples; at least {length} are needed for a diagnosis"
    if why := uncommanded(recording, rig, core.inputs):
        return why
    for name in _looked_at(recording, rig, core):
        mask = recording.mask[name]
        if few_usable(mask):
            return f"only {int(mask.sum())} of {mask.size} samples of {name} are usable"
    lost = [n for n in core.inputs if n in recording.mask and not recording.mask[n].any()]
    return f"no usable sample of {lost[0]}" if lost else ""


def _noise_of(recording: Recording, name: str, settings: DiagnosisSettings) -> float:
    """Standard deviation of a channel's sample noise.

    What is interpolated between samples that are farther apart than the grid's is far smoother
    than they are: their own noise counts, as that of so many independent samples as were recorded.
    """
    seed = settings.seed
    values, mask = recording.channels[name], recording.mask[name]
    if name not in recording.logged:
        return noise_level(values, mask, seed=seed)
    apart, logged = recording.logged[name]
    known = np.isfinite(logged)
    single = noise_level(np.where(known, logged, 0.0), known, seed=seed)
    return single * math.sqrt(max(1.0, apart / recording.sample_time))


def _as_logged(recording: Recording, name: str) -> Array:
    """Usable values of a channel as they were recorded, not interpolated."""
    if name not in recording.logged:
        return np.unique(recording.channels[name][recording.mask[name]])
    values = recording.logged[name][1]
    return np.unique(values[np.isfinite(values)])


def few_usable(mask: Mask) -> bool:
    """True where too few samples of a channel are usable for a diagnosis."""
    least = max(_FEWEST_SAMPLES, _LEAST_CHANNEL_SHARE * mask.size)
    return bool(mask.sum() < least)


def pulls_of(rig: Rig) -> dict[str, str]:
    """Channels of what the muscles of a rig put on its joints (torques), by the name of the joint,
    or on its load (a force), by no name.
    """
    if rig.model["load"]:
        return {"": "force"}
    return {name: dotted("joint_torque", name) for name in rig.tables("joint")}


def flows_of(rig: Rig) -> dict[str, str]:
    """Channels of what flows into a rig's chambers through the valves and lines that lead to them,
    by the names of those that have some.
    """
    ends = [e["to"] for block in ("valve", "line") for e in rig.ports(block).values()]
    fed = [name for name in rig.tables("chamber") if qualified("chamber", name) in ends]
    return {name: dotted("air_flow", name) for name in fed}


def warm_chambers(rig: Rig) -> list[str]:
    """Names of the chambers whose gas has a temperature of its own: those with an energy balance,
    and those on which an effect acts that gives them one.
    """
    warming = [entry.get("at", "") for entry in rig.effects if EFFECTS[entry["id"]].frees_mass]
    return [
        name
        for name, table in rig.tables("chamber").items()
        if table["gas"] == "energy_balance" or "" in warming or name in warming
    ]


def thermometers_of(rig: Rig) -> dict[str, str]:
    """Channels of the temperatures of a rig's gases that can be judged, by the names of their
    chambers: those that no valve or line joins to another gas with a temperature of its own, which
    comes along with what flows and drives no block.
    """
    warm = {qualified("chamber", name): name for name in warm_chambers(rig)}
    lines = rig.ports("line")
    behind = {qualified("line", name): ends["to"] for name, ends in lines.items()}
    ways = [(e["from"], behind.get(e["to"], e["to"])) for e in rig.ports("valve").values()]
    ways += [(ends["from"], ends["to"]) for ends in lines.values()]
    joined = {end for way in ways if all(end in warm for end in way) for end in way}
    return {name: dotted("temperature", name) for full, name in warm.items() if full not in joined}


def moves_by_gauges(recording: Recording, rig: Rig) -> bool:
    """True where what moves a rig's joints or load was measured past its valves, so that they can
    be judged without a command.
    """
    joints = (
        ["length"]
        if rig.model["load"]
        else [dotted("joint_angle", name) for name in rig.tables("joint")]
    )
    pulling = [
        dotted("muscle_pressure", block_of(ends["chamber"]))
        for ends in rig.ports("muscle").values()
    ]
    return bool(joints) and {*joints, *pulling} <= set(recording.channels)


def uncommanded(recording: Recording, rig: Rig, inputs: list[str]) -> str:
    """Reason why a recording without a command cannot be used; empty where it has all, or where
    what moves a joint or load was measured past the valves.
    """
    missing = [name for name in inputs if name not in recording.channels]
    if not missing or moves_by_gauges(recording, rig):
        return ""
    what = "valve" if channel_of(missing[0]) == "valve_command" else "regulator"
    return (
        f"it has no channel {missing[0]}, and the rig has a {what}; it has: "
        f"{', '.join(recording.channels)}"
    )


def _command(recording: Recording, rig: Rig, name: str) -> Array:
    """A command with its holes filled; at rest where it was not recorded."""
    channel, _, block = name.partition(".")
    if name not in recording.channels:
        table, key = (
            ("valve", "null_voltage")
            if channel == "valve_command"
            else ("supply", "initial_pressure")
        )
        return np.full(len(recording), float(rig.tables(table)[block][key]))
    mask = recording.mask[name]
    return held(recording.channels[name], mask)


def held(values: Array, mask: Mask) -> Array:
    """A command whose holes are filled with the last usable value, those before the first one with
    the first.

    Parameters
    ----------
    values : (n,) array
        Samples.
    mask : (n,) bool array
        Which may be used; at least one.

    Returns
    -------
    (n,) array
    """
    first = int(np.argmax(mask))
    last = np.maximum.accumulate(np.where(mask, np.arange(mask.size), first))
    return np.ascontiguousarray(values[last])


def binned(values: Array, rows: Mask, width: int) -> tuple[Array, Array]:
    """Means over consecutive bins of ``width`` samples, counting usable rows only.

    Returns
    -------
    means : (m,) or (m, k) array
        0 where a bin has no usable row.
    counts : (m,) array
        Usable rows in each bin.
    """
    n = rows.size // width * width
    weights = rows[:n].reshape(-1, width).astype(np.float64)
    counts = weights.sum(axis=1)
    data = values[:n].reshape(*weights.shape, math.prod(values.shape[1:]))
    means = (weights[:, None, :] @ data)[:, 0] / np.maximum(counts, 1.0)[:, None]
    return means.reshape(counts.size, *values.shape[1:]), counts
