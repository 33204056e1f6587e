"""Recordings that hold the same samples: a copy is no proof.

Repeated commands give the same signals again, but not the same noise. Two recordings share content
where one predicts the other's samples better than its own neighbours predict any sample: then its
noise is the same, and not its command alone.

A channel's deviations are what its own neighbours do not predict of a sample: of a smooth signal
its noise, whatever the signal is. Those of a repetition are independent of one another. Those of a
copy go together at one alignment, however it was filtered, thinned, shifted, reversed or covered by
more noise. Where the steps of a converter are far wider than the noise, its flips are compared
instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from pamrs._arrays import Array, Index, Mask, stretches
from pamrs.channels import channel_of
from pamrs.diagnosis.prepare._blocks import ARM_WINDOW, SUPPLY_WINDOW
from pamrs.recordings import Recording

_COPY_SHARE = 0.5  # share of a recording that is in another one of its role before it is left out
_MOST_RATE_RATIO = 50.0  # ratio of sample times up to which recordings are compared


@dataclass(frozen=True)
class Overlap:
    """Samples that one recording shares with another.

    Attributes
    ----------
    own, other : (start, stop)
        From when to when in the recording and in the other recording [s].
    share : float
        Share of the recording's time.
    free : tuple of (start, stop)
        Stretches of the recording that are not in the other recording [s]: beyond its ends, or with
        noise that it does not predict. Where nothing can be decided, the samples count as shared.
    """

    own: tuple[float, float]
    other: tuple[float, float]
    share: float
    free: tuple[tuple[float, float], ...] = field(default=(), repr=False)


def without_copies(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Recordings that prove something, and what was left out, in words.

    Of a held-out recording that shares samples with a fitted one only the stretches are kept that
    it does not share, some time away from what it does; none where they are short. Of two
    recordings of the same role the second is left out where most of it is a copy.

    Returns
    -------
    kept : list of Recording
        In their order; a stretch has the name of its recording, one of several its times too.
    notes : list of str
        A sentence for each of which something was left out.
    """
    places = range(len(recordings))
    kept_parts: dict[int, list[Recording]] = {}  # by place: one recording may be listed twice
    notes, channels = list[str](), _ChannelDeviations()
    for place in sorted(places, key=lambda k: recordings[k].role != "fit"):
        before = [one for parts in kept_parts.values() for one in parts]
        kept_parts[place], notes_of_one = _unshared_parts(recordings[place], before, channels)
        notes += notes_of_one
    return [one for place in places for one in kept_parts[place]], notes


def _unshared_parts(
    recording: Recording, before: Sequence[Recording], channels: _ChannelDeviations
) -> tuple[list[Recording], list[str]]:
    """Parts of a recording that are not in others, and a sentence where these are not all of it."""
    for other in before:
        shared = overlap(recording, other, channels)
        across = recording.role != other.role
        if shared is None or not (across or shared.share > _COPY_SHARE):
            continue
        same = (
            f"{_name_of(recording)} holds the same samples as {_name_of(other)}, noise included "
            f"({shared.own[0]:.4g} to {shared.own[1]:.4g} s are its {shared.other[0]:.4g} to "
            f"{shared.other[1]:.4g} s): "
        )
        if not across:
            return [], [same + "it says nothing more and was left out"]
        new = _unshared_stretches(recording, shared.free, before, channels)
        if not new:
            spent = max((stop - start for start, stop in shared.free), default=0.0)
            short = f"; the longest stretch that it does not share, {spent:.3g} s, is too short"
            why = "it is no held-out proof and was left out of it"
            return [], [same + why + (short if spent > 0.0 else "")]
        parts = " and ".join(f"{start:.4g} to {stop:.4g} s" for start, stop in new)
        cut = [recording.between(*part) for part in new]
        if len(cut) > 1:
            cut = [
                replace(one, name=f"{one.name}, {part[0]:.4g} to {part[1]:.4g} s")
                for one, part in zip(cut, new, strict=True)
            ]
        note = [same + f"of it {parts} are held out, the rest is no proof"]
        once = [_unshared_parts(one, before, channels) for one in cut]
        return [one for parts, _ in once for one in parts], [
            *note,
            *(s for _, texts in once for s in texts),
        ]
    return [recording], []


def _unshared_stretches(
    recording: Recording,
    free: Sequence[tuple[float, float]],
    before: Sequence[Recording],
    channels: _ChannelDeviations,
) -> list[tuple[float, float]]:
    """Stretches that share nothing with any recording of another role, long enough for a proof."""
    # two of the longest windows are a proof (decision 111)
    least = max(2.0 * SUPPLY_WINDOW, LEAST_SAMPLES * recording.sample_time)
    stretches_left: list[tuple[float, float]] = []
    for start, stop in free:
        if stop - start < least:
            continue
        part = recording.between(start, stop)
        others = (o for o in before if o.role != recording.role)
        shared = (overlap(part, other, channels) for other in others)
        shared_again = next((one for one in shared if one is not None), None)
        if shared_again is None:
            stretches_left.append((start, stop))
        elif shared_again.free != (
            (0.0, part.duration),
        ):  # shorter than before: this comes to an end
            inner = [(start + a, start + b) for a, b in shared_again.free if b - a < stop - start]
            stretches_left += _unshared_stretches(recording, inner, before, channels)
    return stretches_left


def _name_of(recording: Recording) -> str:
    return recording.name + (f" ({recording.source})" if recording.source else "")


def overlap(
    one: Recording,
    other: Recording,
    channels: _ChannelDeviations | None = None,
) -> Overlap | None:
    """The stretch that two recordings share, noise included; None where there is none.

    Shifted and resampled copies are found, windows of one recording too.

    Parameters
    ----------
    one, other : Recording
        In any order.
    channels : _ChannelDeviations, optional
        What was found of the recordings before.

    Returns
    -------
    Overlap or None
        As seen from `one`.
    """
    names = [name for name in one.channels if name in other.channels and not is_set(name)]
    slow, fast = (one, other) if one.sample_time >= other.sample_time else (other, one)
    if not names or slow.sample_time > _MOST_RATE_RATIO * fast.sample_time:
        return None
    each = _shared_rows(slow, fast, names, channels or _ChannelDeviations())
    clearest = max(each, key=lambda one: int(one.same.sum()), default=None)
    if clearest is None:
        return None
    runs = [
        (float(slow.time[a]), float(slow.time[b - 1])) for a, b in stretches(_shared_mask(clearest))
    ]
    rows = np.flatnonzero(clearest.same)
    at = (float(slow.time[rows[0]]), float(slow.time[rows[-1]]))
    in_fast = _in_other(clearest.alignment, at)
    if slow is not one:
        runs = [_in_other(clearest.alignment, run) for run in runs][
            :: 1 if clearest.alignment.rate > 0.0 else -1
        ]
    in_one, in_other = (at, in_fast) if slow is one else (in_fast, at)
    share = min(
        1.0,
        rows.size
        * slow.sample_time
        * (in_one[1] - in_one[0])
        / max(at[1] - at[0], 1e-300)
        / max(one.duration, 1e-300),
    )
    # within a window a joint's past fades (decision 111)
    margin = ARM_WINDOW + WINDOW_SAMPLES * slow.sample_time
    return Overlap(in_one, in_other, share, _gaps(one.duration, runs, margin))


def _in_other(way: _Alignment, run: tuple[float, float]) -> tuple[float, float]:
    """Ends of a stretch in the other recording [s]."""
    first, last = (float(way.of(np.array(time))) for time in run)
    return min(first, last), max(first, last)


def _shared_mask(alignment: _SharedRows) -> Mask:
    """Rows that two recordings share: those found to be the same, and all between them but for runs
    of three windows or more that differ.
    """
    shared, new_rows = alignment.same.copy(), np.zeros(alignment.same.size, dtype=bool)
    for first, last in stretches(alignment.other):
        new_rows[first:last] = last - first >= LEAST_SAMPLES
    for first, last in stretches(~new_rows & ~shared & alignment.inside):
        neighbours = new_rows[[k for k in (first - 1, last) if 0 <= k < new_rows.size]]
        # what is not clear is new where noise of its own is on both sides; so is part of a window
        part = last - first < WINDOW_SAMPLES
        new = neighbours.any() if part else neighbours.size == 2 and neighbours.all()
        shared[first:last] = not new
    return shared


def _gaps(
    duration: float, taken: Sequence[tuple[float, float]], margin: float
) -> tuple[tuple[float, float], ...]:
    """Stretches of a recording outside given ones, with a margin on either side [s]."""
    gaps, start = [], 0.0
    for a, b in taken:
        gaps.append((start, a - margin))
        start = max(start, b + margin)
    return tuple((a, b) for a, b in [*gaps, (start, duration)] if b > a)


# correlation of noise in chance deviations: repetitions reach 5.3, copies 9.2 (decision 111)
_LEAST_PEAK = 6.5
# the correlation itself: corners of a command leave 0.15, a noisy copy 0.3 (decision 111)
_LEAST_CORRELATION = 0.2
# that over other lags': a command repeats a period away, noise never does (decision 111)
_PEAK_RATIO = 1.5
# correlation of a window's noise with the other's from which it is shared: copies 1, chance 0.1
_FOLLOW_SHARE = 0.5
# the same of most shared windows; below it own noise covers the copy, all that meets is shared
_CLEAN_COPY_SHARE = 0.75
# the same in chance deviations, of windows with few samples: some 1e-5 for a window
_CHANCE_SHARE = 4.5
# converter step over noise, rounding included, that a repetition repeats (decision 111)
_COARSE_STEP = 2.2
# [noise levels] beyond which a sample is a step that repeats: one in two thousand by chance
_STEP_NOISES = 3.5
# lone flips of a converter from which two are compared: twelve others by chance 1e-5
_LEAST_FLIPS = 12.0
# samples on different steps over flips: 0 for a copy, 1 for a repetition (decision 111)
_FLIP_SHARE = 0.35
_CLOCK = 0.05  # share by which the clock of a copy may go faster or slower
_RATE_BLOCKS = 3  # blocks that say how it goes
# samples from the beginning in which those blocks lie: seconds for a million samples
_MOST_SEARCHED = 16384
_PHASES = 12  # offsets between the samples of two rates that are tried
# [sample times] error of the time between two recordings' samples that makes odd and even ones
_BETWEEN_ERROR = 0.02
# what two such leave in a window, over their noise: chance of some 1e-3 with ten windows
_BETWEEN_LEFT = 1.6
# share of a window that has to move: at rest on one step recordings are equal by chance
_LEAST_ALIVE = 0.2
# samples of a window in which noise is compared: its mean differs by a tenth by chance
WINDOW_SAMPLES = 64
LEAST_SAMPLES = 3 * WINDOW_SAMPLES  # that are shared at the least
# neighbours on either side by which a sample is predicted without the other recording, and samples
# within which a flip of a converter goes back
_NEIGHBOURS = 4
# samples of a block that is looked for in a recording whose clock goes otherwise
_BLOCK_SAMPLES = 256


_SET: Final = ("valve_command", "supply_command", "reference")
# deviations on either side by which one of the other recording is predicted, and shifts in time
# that are looked at
_REACH: Final = 8
_ROWS: Final = 20_000  # rows from which a linear combination of a few columns is found


def is_set(name: str) -> bool:
    """True where a channel is set and not measured: it repeats exactly."""
    return channel_of(name) in _SET


@dataclass(frozen=True)
class _Alignment:
    """Times of a recording's samples in another recording.

    Attributes
    ----------
    rate, lag : float
        The sample at a time t [s] is at ``rate t + lag`` [s] of the other recording [1, s].
    mean : bool
        Whether it is a mean of samples there.
    """

    rate: float
    lag: float
    mean: bool = False

    def of(self, time: Array) -> Array:
        """Times in the other recording [s]."""
        return self.rate * time + self.lag


class _SharedRows(NamedTuple):
    """Rows of the slower of two recordings at an alignment: those that lie in the faster one, those
    in which some channel's deviations are the same, and those in which all channels that show
    anything differ.
    """

    alignment: _Alignment
    inside: Mask
    same: Mask
    other: Mask


class _Deviations(NamedTuple):
    """A channel: its values, where they are known, their deviations by their standard deviation
    (zero where nothing is known), and the step of the converter where the noise is far smaller.
    """

    values: Array
    known: Mask
    deviations: Array
    step: float

    def at(self, rows: Index) -> _Deviations:
        """Channel at some rows."""
        return _Deviations(self.values[rows], self.known[rows], self.deviations[rows], self.step)


class _ChannelDeviations:
    """Channels of recordings with their deviations, each found once."""

    def __init__(self) -> None:
        self._by_name: dict[tuple[Recording, str], _Deviations] = {}

    def of(self, recording: Recording, names: Sequence[str]) -> dict[str, _Deviations]:
        """Channels of a recording, by name."""
        for name in names:
            if (recording, name) not in self._by_name:
                values, known = recording.channels[name], recording.mask[name]
                self._by_name[recording, name] = _channel(values, known)
        return {name: self._by_name[recording, name] for name in names}


def _shared_rows(
    slow: Recording, fast: Recording, names: list[str], channels: _ChannelDeviations
) -> Iterator[_SharedRows]:
    """Every alignment at which deviations of some channel of two recordings are the same.

    Of two recordings of a million samples each it takes some seconds, most of them for correlations
    over all lags; the search for another rate of the clock looks at the beginnings alone.
    """
    slow_channels, fast_channels = channels.of(slow, names), channels.of(fast, names)
    ratio = slow.sample_time / fast.sample_time
    some = False
    for rate, start in _clocks(slow, fast, slow_channels, fast_channels):
        if some and rate not in (1.0, -1.0):
            return
        phases = min(_PHASES, max(1, round(abs(rate) * ratio)))
        for mean in (False, True) if abs(rate) * ratio > 1.5 else (False,):
            for phase in range(phases):
                at = _Alignment(rate, start + phase * fast.sample_time, mean)
                for alignment in _alignments_at(slow, fast, (slow_channels, fast_channels), at):
                    some = True
                    yield alignment
    if not some:
        yield from _between(slow, fast, slow_channels, fast_channels)


# ------------------------------------------------------------------ channels


def _channel(values: Array, known: Mask) -> _Deviations:
    """Channel with the deviation of each sample from what its neighbours predict."""
    index = np.arange(values.size)
    nothing = np.zeros(values.size)
    if known.sum() < 4 * _NEIGHBOURS or not np.ptp(values[known]) > 0.0:
        return _Deviations(nothing, known, nothing, 0.0)
    filled = values if known.all() else np.interp(index, index[known], values[known])
    centred, offsets = filled - filled.mean(), np.r_[-_NEIGHBOURS:0, 1 : _NEIGHBOURS + 1]
    inner = known & (index >= _NEIGHBOURS) & (index < values.size - _NEIGHBOURS)
    flat = np.diff(centred) == 0.0
    moves = inner & ~(np.r_[False, flat] & np.r_[flat, False])
    counted = moves if moves.sum() > 4 * _NEIGHBOURS else inner  # a rest says nothing of the noise
    use, deviations, weights = counted, centred, np.zeros(offsets.size)
    for _ in range(4):  # steps of the signal do not say how noise is predicted
        if use.sum() < 2 * offsets.size:
            break
        weights, follows = _prediction_by(centred, offsets, centred, use)
        deviations = centred - follows
        size = 1.25 * float(np.mean(np.abs(deviations[use])))
        use = counted & (np.abs(deviations) <= _STEP_NOISES * size)
    size = float(np.sqrt(np.mean(deviations[use] ** 2))) if use.any() else 0.0
    step = _step(filled[known])
    noise = size / float(np.sqrt(1.0 + weights @ weights))
    coarse = step if step > _COARSE_STEP * noise else 0.0
    if not size > 1e-12 * float(np.abs(centred).max()):
        return _Deviations(filled, known, nothing, coarse)
    # a step of the signal is left in all samples around it
    steps = uniform_filter1d((counted & ~use).astype(float), 4 * _NEIGHBOURS + 1) > 1e-6
    return _Deviations(filled, known, np.where(inner & ~steps, deviations / size, 0.0), coarse)


def _prediction_by(source: Array, offsets: Index, wanted: Array, use: Mask) -> tuple[Array, Array]:
    """Weights with which a source's samples at some offsets predict the wanted ones best in some
    rows, and that prediction of all samples.
    """
    rows = np.flatnonzero(use)
    rows = rows[:: max(1, rows.size // _ROWS)]
    near = source[(rows[:, None] + offsets) % source.size]
    weights = np.linalg.lstsq(near, wanted[rows], rcond=None)[0]
    reach = int(np.abs(offsets).max())
    kernel = np.zeros(2 * reach + 1)
    kernel[reach - offsets] = weights
    return weights, np.convolve(source, kernel, "full")[reach : reach + source.size]


def _step(values: Array) -> float:
    """The step of the converter that values lie on; 0 where they lie on none."""
    levels = np.unique(values)
    if levels.size < 2:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * (levels[-1] - levels[0])]
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    off = (levels - levels[0]) / step
    return step if np.mean(np.abs(off - np.round(off)) < 0.02) > 0.99 else 0.0


def _channel_at(
    fast: Recording, name: str, one: _Deviations, at: Array, width: float
) -> _Deviations:
    """A channel at times [s], which may be its own, from either end."""
    for way in (1, -1):
        apart = at - fast.time[::way] if at.size == len(fast) else np.inf
        if np.max(np.abs(apart)) < 1e-6 * fast.sample_time:  # but for rounding
            return one.at(np.arange(len(fast))[::way])
    return _interpolated(fast, name, at, width)._replace(step=one.step)


def _interpolated(fast: Recording, name: str, at: Array, width: float) -> _Deviations:
    """A channel at times [s]; means over a width [s] above its sample time. What lies between two
    samples or is a mean is on no step of a converter, and has its pattern all the same.
    """
    index, mask, dt = np.arange(len(fast)), fast.mask[name], fast.sample_time
    if not mask.any():
        return _channel(np.zeros(at.size), np.zeros(at.size, dtype=bool))
    values = np.interp(index, index[mask], fast.channels[name][mask])
    inside = (at > -0.5 * dt) & (at < fast.duration + 0.5 * dt)
    known = inside & (np.interp(at, fast.time, mask.astype(float)) > 0.99)
    if width <= 1.5 * dt:
        return _channel(np.interp(at, fast.time, values), known)
    edges = dt * (np.arange(values.size + 1) - 0.5)
    total = np.concatenate([[0.0], np.cumsum(values) * dt])
    high, low = (np.interp(at + half, edges, total) for half in (0.5 * width, -0.5 * width))
    return _channel((high - low) / width, known)


# ------------------------------------------------------------------ clocks and lags


def _clocks(
    slow: Recording,
    fast: Recording,
    slow_channels: dict[str, _Deviations],
    fast_channels: dict[str, _Deviations],
) -> Iterator[tuple[float, float]]:
    """Rates of the slower clock in the faster one, and times from which they run [1, s]: as both
    say; backwards; sample by sample; as blocks of it are found there.
    """
    yield 1.0, 0.0
    yield -1.0, fast.duration
    ratio = fast.sample_time / slow.sample_time
    if 1.0 - _CLOCK < ratio < 1.0:
        yield ratio, 0.0
    rate = _rate(slow, fast, slow_channels, fast_channels)
    if rate is not None:
        yield rate, 0.0


def _rate(
    slow: Recording,
    fast: Recording,
    slow_channels: dict[str, _Deviations],
    fast_channels: dict[str, _Deviations],
) -> float | None:
    """The rate at which the deviations of blocks are found in the other recording; None where they
    are not.
    """
    ratio = fast.sample_time / slow.sample_time
    if len(slow) < 2 * _BLOCK_SAMPLES or ratio < 0.5:
        return None
    searched = min(len(slow), _MOST_SEARCHED)
    starts = np.linspace(0, searched - _BLOCK_SAMPLES, _RATE_BLOCKS).astype(int)
    step = 0.5 / _BLOCK_SAMPLES
    rates = 1.0 + step * np.arange(2, int(_CLOCK / step) + 1)
    best, rate_found = _LEAST_PEAK, None
    for name, channel in slow_channels.items():
        other = fast_channels[name].deviations[: 2 * _MOST_SEARCHED]
        length = next_fast_len(other.size + 2 * _BLOCK_SAMPLES, real=True)
        spectrum = rfft(_single(other), length)
        for rate in (*rates, *(2.0 - rates)):
            rows = np.arange(0.0, _BLOCK_SAMPLES - 1.0, ratio / rate)
            peaks, places = [], []
            for start in starts:
                part = channel.deviations[start : start + _BLOCK_SAMPLES]
                block = np.interp(rows, np.arange(_BLOCK_SAMPLES), part)
                cross = irfft(spectrum * np.conj(rfft(_single(block), length)), length)
                place = int(np.argmax(np.abs(cross)))
                peaks.append(abs(float(cross[place])) / (float(np.linalg.norm(block)) + 1e-300))
                places.append(place if place < other.size else place - length)
            line = np.polyfit(starts * slow.sample_time, places, 1)
            off = np.abs(np.polyval(line, starts * slow.sample_time) - places)
            if min(peaks) > best and off.max() < 4.0:
                best, rate_found = min(peaks), float(line[0]) * fast.sample_time
    return rate_found


def _alignments_at(
    slow: Recording,
    fast: Recording,
    channels: tuple[dict[str, _Deviations], dict[str, _Deviations]],
    alignment: _Alignment,
) -> Iterator[_SharedRows]:
    """Alignments of one rate at which some channel's deviations agree in both recordings."""
    slow_channels, fast_channels = channels
    step = alignment.rate * slow.sample_time
    count = int(fast.duration / abs(step) + 1.5)
    at: Array = alignment.lag + step * np.arange(count, dtype=np.float64)
    width = abs(step) if alignment.mean else 0.0
    other = {name: _channel_at(fast, name, one, at, width) for name, one in fast_channels.items()}
    between = abs(step) / fast.sample_time
    whole = abs(between - round(between)) < 1e-6  # what lies between samples is on no step
    lags = {name: _lags(channel, other[name]) for name, channel in slow_channels.items()}
    for lag in dict.fromkeys(lag for by_lag in lags.values() for lag in by_lag):
        rows = np.arange(max(0, -lag), min(len(slow), count - lag))
        pairs = {n: (one.at(rows), other[n].at(rows + lag)) for n, one in slow_channels.items()}
        copied = {n: lags[n].get(lag, 0.0) for n in pairs}
        flips = {n for n, pair in pairs.items() if whole and _same_flips(*pair)}
        if not (flips or any(copied.values())):
            continue
        inside, same, others = np.zeros((3, len(slow)), dtype=bool)
        inside[rows] = True
        for name, (a, b) in pairs.items():
            alike, unlike, clear = _by_window(a, b)
            if copied[name] and clear and alike.sum() >= LEAST_SAMPLES:
                same[rows] |= alike
            elif copied[name] > _LEAST_CORRELATION or name in flips:
                same[rows] |= a.known & b.known
            others[rows] |= unlike
        if same.sum() >= LEAST_SAMPLES:
            here = _Alignment(alignment.rate, alignment.lag + lag * step, alignment.mean)
            yield _SharedRows(here, inside, same, others & ~same)


def _single(values: Array) -> NDArray[np.float32]:
    """Numbers in single precision: what they say of noise is far less certain."""
    return values.astype(np.float32)


def _lags(a: _Deviations, b: _Deviations) -> dict[int, float]:
    """Rows by which one channel may run behind in the other recording, and the correlation of their
    deviations where these go together there and nowhere else, 0 elsewhere: a command that is
    repeated has its periods too.
    """
    shares: dict[int, float] = {}
    pairs = [(a.deviations, b.deviations, 1)]
    if a.step or b.step:  # flips of a converter tell more than what neighbours leave of them
        pairs.append((np.sign(np.diff(a.values)), np.sign(np.diff(b.values)), _REACH))
    for one, other, most in pairs:
        length = next_fast_len(max(one.size + other.size, 2), real=True)
        cross, power = (
            irfft(rfft(_single(y), length) * np.conj(rfft(_single(x), length)), length)
            for x, y in ((one, other), (one * one, other * other))
        )
        peaks = np.abs(cross) / np.sqrt(np.maximum(power, 1.0))
        peaks[power < _LEAST_ALIVE * LEAST_SAMPLES] = 0.0
        for _ in range(most):
            place = int(np.argmax(peaks))
            peak = float(peaks[place])
            if not peak > 0.0:
                break
            around = np.arange(place - WINDOW_SAMPLES, place + WINDOW_SAMPLES + 1)
            peaks[around % length] = 0.0
            alone = peak > max(_LEAST_PEAK, _PEAK_RATIO * float(peaks.max()))
            lag = place if place < other.size else place - length
            noise_alone = most == 1 and alone and not (a.step and b.step)
            share = peak / float(np.sqrt(max(power[place], 1.0))) if noise_alone else 0.0
            shares[lag] = max(shares.get(lag, 0.0), share)
    return shares


def _by_window(a: _Deviations, b: _Deviations) -> tuple[Mask, Mask, bool]:
    """Rows about which the deviations of one channel follow those of the other channel, rows about
    which they do not, and whether the two differ so clearly that windows can be told apart.
    """
    wanted = a.deviations
    offsets = np.arange(-_REACH, _REACH + 1)
    if wanted.size < 4 * offsets.size or not (wanted.any() and b.deviations.any()):
        nothing = np.zeros(wanted.size, dtype=bool)
        return nothing, nothing, False
    use = wanted != 0.0
    _, follows = _prediction_by(b.deviations, offsets, wanted, use)
    product, own_power, other, alive = (
        uniform_filter1d(part, WINDOW_SAMPLES, mode="nearest")
        for part in (
            wanted * follows,
            wanted**2,
            np.where(use, follows, 0.0) ** 2,
            (use & (b.deviations != 0.0)).astype(float),
        )
    )
    share = product / np.sqrt(np.maximum(own_power * other, 1e-300))
    says = alive > _LEAST_ALIVE
    chance = _CHANCE_SHARE / np.sqrt(np.maximum(alive * WINDOW_SAMPLES, 1.0))
    alike = says & (share > np.maximum(_FOLLOW_SHARE, chance))
    clear = bool(alike.any()) and float(np.median(share[alike])) > _CLEAN_COPY_SHARE
    return alike, says & (share <= _FOLLOW_SHARE), clear


def _same_flips(a: _Deviations, b: _Deviations) -> bool:
    """True where two channels on the steps of a converter flip in the same samples; noise of their
    own would let them flip in others.
    """
    step = max(a.step, b.step)
    known = a.known & b.known
    if not step > 0.0 or known.sum() < LEAST_SAMPLES:
        return False
    zero = float((a if a.step >= b.step else b).values[known].min())
    for origin in (zero, zero + 0.5 * step):  # rounded, or cut off
        levels = [np.round((one.values[known] - origin) / step) for one in (a, b)]
        expected = 0.5 * sum(_flips(level) for level in levels)
        if expected < _LEAST_FLIPS:
            continue
        if np.count_nonzero(levels[0] != levels[1]) < _FLIP_SHARE * expected:
            return True
    return False


def _flips(levels: Array) -> int:
    """Number of flips of a converter by noise: there, back and there again within a few samples. A
    signal that turns goes there and back once, and does so in every repetition.
    """
    change = np.diff(levels)
    at = np.flatnonzero(change)
    back = (change[at[1:]] * change[at[:-1]] < 0.0) & (np.diff(at) <= _NEIGHBOURS)
    return int(np.count_nonzero(back[1:] & back[:-1]))


# ------------------------------------------------------------------ samples between samples


def _between(
    slow: Recording,
    fast: Recording,
    slow_channels: dict[str, _Deviations],
    other: dict[str, _Deviations],
) -> Iterator[_SharedRows]:
    """Samples of one run that were dealt out to two recordings: those of one lie at a whole
    fraction between those of the second and differ by noise alone, and no command that is repeated
    made both.
    """
    dt = slow.sample_time
    if abs(dt - fast.sample_time) > 1e-3 * dt or _repeats(slow, fast):
        return
    for name, channel in slow_channels.items():
        lag = _fraction(channel, other[name], dt)
        if lag is None:
            continue
        inside = (slow.time + lag >= 0.0) & (slow.time + lag <= fast.duration)
        if inside.sum() >= LEAST_SAMPLES:
            yield _SharedRows(
                _Alignment(1.0, lag), inside, inside, np.zeros(inside.size, dtype=bool)
            )
            return


def _repeats(slow: Recording, fast: Recording) -> bool:
    """True where both recordings have the same changing command, sample by sample."""
    size = min(len(slow), len(fast))
    for name, values in slow.channels.items():
        if name in fast.channels and is_set(name):
            one, other = values[:size], fast.channels[name][:size]
            both = slow.mask[name][:size] & fast.mask[name][:size]
            if both.any() and np.ptp(one[both]) > 0.0 and np.array_equal(one[both], other[both]):
                return True
    return False


def _fraction(a: _Deviations, b: _Deviations, dt: float) -> float | None:
    """Time [s] between the samples of two channels where it is a whole fraction of the sample time
    and nothing but noise is left between the two; None elsewhere.
    """
    size = min(a.values.size, b.values.size)
    if size < LEAST_SAMPLES or a.step or b.step:
        return None
    index = np.arange(size, dtype=float)
    smooth = uniform_filter1d(b.values[:size], _NEIGHBOURS)
    curve = CubicSpline(index, b.values[:size])
    inner = (index > 2.0) & (index < size - 3.0) & a.known[:size] & b.known[:size]
    if inner.sum() < LEAST_SAMPLES:
        return None
    slope, lag, rest = np.gradient(smooth), 0.0, np.zeros(size)
    for _ in range(8):
        rest = a.values[:size] - curve(np.clip(index + lag, 0.0, size - 1.0))
        power = float(np.sum(slope[inner] ** 2))
        lag += float(np.sum((slope * rest)[inner])) / max(power, 1e-300)
        if not abs(lag) < 2.0:
            return None
    noise = float(np.std(rest[inner]))
    unsure = noise / np.sqrt(max(power, 1e-300))
    whole = min((round(lag * n) / n for n in (2, 3)), key=lambda part: abs(part - lag))
    off = abs(whole - lag) > max(3.0 * unsure, _BETWEEN_ERROR)
    if off or unsure > _BETWEEN_ERROR or abs(whole - round(whole)) < 1e-9:
        return None
    blocks = rest[inner][: inner.sum() // WINDOW_SAMPLES * WINDOW_SAMPLES]
    means = blocks.reshape(-1, WINDOW_SAMPLES).mean(axis=1)
    rough = np.diff(rest[inner]).std() / np.sqrt(2.0)
    chance = rough / np.sqrt(WINDOW_SAMPLES)
    return whole * dt if np.sqrt(np.mean(means**2)) < _BETWEEN_LEFT * chance else None
