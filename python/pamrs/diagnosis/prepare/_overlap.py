"""Recordings that hold the same samples: a copy is no proof.

Repeated commands give the same signals again, but not the same noise. Two recordings share content
where one tells the other's samples better than any sample is told by its own neighbours: then its
noise is the same, and not its command alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import channel_of
from pamrs.diagnosis.settings import OverlapSettings
from pamrs.recordings import Recording

__all__ = ["Overlap", "overlap", "without_copies"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SET = ("valve_command", "supply_command", "reference")
"""What is set and not measured: it repeats exactly."""


@dataclass(frozen=True)
class Overlap:
    """What one recording holds of another.

    Attributes
    ----------
    own, other : (start, stop)
        From when to when in the recording and in the other one [s].
    share : float
        Share of the recording's time.
    free : tuple of (start, stop)
        Stretches of the recording that are not in the other one [s]: beyond its ends, or with noise
        that it does not tell. Where nothing can be told, the samples count as shared.
    """

    own: tuple[float, float]
    other: tuple[float, float]
    share: float
    free: tuple[tuple[float, float], ...] = field(default=(), repr=False)


def without_copies(
    recordings: Sequence[Recording], settings: OverlapSettings
) -> tuple[list[Recording], list[str]]:
    """Recordings that prove something, and what was left out, in words.

    Of a held-out recording that shares samples with a fitted one only the stretches are kept that
    it does not share, some time away from what it does; none where they are short. Of two
    recordings of the same role the second is left out where most of it is a copy.

    Parameters
    ----------
    recordings : sequence of Recording
        All of a case.
    settings : OverlapSettings
        What counts as the same, and what is long enough to be kept.

    Returns
    -------
    kept : list of Recording
        In their order; a stretch has the name of its recording, one of several its times too.
    said : list of str
        A sentence for each of which something was left out.
    """
    places = range(len(recordings))
    kept: dict[int, list[Recording]] = {}  # by place: one recording may be listed twice
    said: list[str] = []
    for place in sorted(places, key=lambda k: recordings[k].role != "fit"):
        before = [one for parts in kept.values() for one in parts]
        kept[place], told = _new_in(recordings[place], before, settings)
        said += told
    return [one for place in places for one in kept[place]], said


def _new_in(
    recording: Recording, before: Sequence[Recording], settings: OverlapSettings
) -> tuple[list[Recording], list[str]]:
    """What of a recording is not in others, and a sentence where that is not all of it."""
    for other in before:
        found = overlap(recording, other, settings)
        across = recording.role != other.role
        if found is None or not (across or found.share > settings.copy_share):
            continue
        same = (
            f"{_called(recording)} holds the same samples as {_called(other)}, noise included "
            f"({found.own[0]:.4g} to {found.own[1]:.4g} s are its {found.other[0]:.4g} to "
            f"{found.other[1]:.4g} s): "
        )
        if not across:
            return [], [same + "it says nothing more and was left out"]
        left = _left_of(recording, found.free, before, settings)
        if not left:
            spent = max((stop - start for start, stop in found.free), default=0.0)
            short = f"; the longest stretch that it does not share, {spent:.3g} s, is too short"
            why = "it is no held-out proof and was left out of it"
            return [], [same + why + (short if spent > 0.0 else "")]
        parts = " and ".join(f"{start:.4g} to {stop:.4g} s" for start, stop in left)
        cut = [recording.between(*part) for part in left]
        if len(cut) > 1:
            cut = [
                replace(one, name=f"{one.name}, {part[0]:.4g} to {part[1]:.4g} s")
                for one, part in zip(cut, left, strict=True)
            ]
        said = [same + f"of it {parts} are held out, the rest is no proof"]
        once = [_new_in(one, before, settings) for one in cut]
        return [one for kept, _ in once for one in kept], [
            *said,
            *(s for _, told in once for s in told),
        ]
    return [recording], []


def _left_of(
    recording: Recording,
    free: Sequence[tuple[float, float]],
    before: Sequence[Recording],
    settings: OverlapSettings,
) -> list[tuple[float, float]]:
    """Stretches that share nothing with any recording of another role, long enough for a proof."""
    least = max(settings.least_left, settings.least_samples * recording.sample_time)
    found: list[tuple[float, float]] = []
    for start, stop in free:
        if stop - start < least:
            continue
        part = recording.between(start, stop)
        shared = (overlap(part, o, settings) for o in before if o.role != recording.role)
        again = next((one for one in shared if one is not None), None)
        if again is None:
            found.append((start, stop))
        elif again.free != ((0.0, part.duration),):  # shorter than before: this comes to an end
            inner = [(start + a, start + b) for a, b in again.free if b - a < stop - start]
            found += _left_of(recording, inner, before, settings)
    return found


def _called(recording: Recording) -> str:
    return recording.name + (f" ({recording.source})" if recording.source else "")


def overlap(one: Recording, other: Recording, settings: OverlapSettings) -> Overlap | None:
    """The stretch that two recordings share, noise included; None where there is none.

    Shifted and resampled copies are found, windows of one recording too.

    Parameters
    ----------
    one, other : Recording
        In any order.
    settings : OverlapSettings
        What counts as the same.

    Returns
    -------
    Overlap or None
        As seen from `one`.
    """
    names = [
        name for name in one.channels if name in other.channels and channel_of(name) not in _SET
    ]
    if not names:
        return None
    slow, fast = (one, other) if one.sample_time >= other.sample_time else (other, one)
    if slow.sample_time > settings.most_rate_ratio * fast.sample_time:
        return None
    tried = [
        (lag, _same(slow, fast, names, lag, settings)) for lag in _lags(slow, fast, names, settings)
    ]
    lag, seen = max(tried, key=lambda one: one[1].same.sum())
    rows = seen.rows[seen.same]
    if rows.size < settings.least_samples:
        return None
    at = float(slow.time[rows[0]]), float(slow.time[rows[-1]])
    shifted = at[0] + lag, at[1] + lag
    own, away = (at, shifted) if slow is one else (shifted, at)
    both = min(slow.duration, fast.duration - lag) - max(0.0, -lag)
    share = min(1.0, both * float(seen.same.mean()) / max(one.duration, 1e-300))
    taken = _taken(slow, fast, names, lag, settings)
    shift = 0.0 if slow is one else lag
    margin = settings.gap + _unsure(slow, settings) * slow.sample_time
    taken = [(a + shift, b + shift) for a, b in taken]
    return Overlap(own, away, share, _gaps(one.duration, taken, margin))


def _unsure(slow: Recording, settings: OverlapSettings) -> int:
    """Samples at the end of what is shared that may not be told as such: those of a window, and of
    a whole block where blocks do not lie side by side.
    """
    whole = len(slow) <= settings.most_blocks * settings.block_samples
    return settings.window_samples if whole else settings.block_samples


def _taken(
    slow: Recording,
    fast: Recording,
    names: list[str],
    lag: float,
    settings: OverlapSettings,
) -> list[tuple[float, float]]:
    """Stretches that two recordings share at a lag, in times of the slow one [s]: rows that are
    told, and all beside them that are not denied over three windows or more.
    """
    at = slow.time + lag
    free = (at < 0.0) | (at > fast.duration)
    shared, denied = np.zeros(free.size, dtype=bool), np.zeros(free.size, dtype=bool)
    # a block that is shared in part may deny all of it, so blocks begin at each of its windows
    for phase in range(0, settings.block_samples, _unsure(slow, settings)):
        seen = _same(slow, fast, names, lag, settings, phase)
        shared[seen.rows[seen.same]] = True
        denied[seen.rows] = seen.denied & (denied[seen.rows] | (phase == 0))
    denied = np.flatnonzero(denied & ~shared)
    own = np.zeros(free.size, dtype=bool)
    for run in np.split(denied, np.flatnonzero(np.diff(denied) != 1) + 1):
        own[run] = run.size >= settings.least_samples
    for first, last in _runs(~free & ~own & ~shared):
        beside = own[[k for k in (first - 1, last) if 0 <= k < own.size]]
        # what cannot be told is new where noise of its own is on both sides; so is part of a window
        part = last - first < settings.window_samples
        new = beside.any() if part else beside.size == 2 and beside.all()
        shared[first:last] = not new
    return [(float(slow.time[a]), float(slow.time[b - 1])) for a, b in _runs(shared)]


def _runs(of: Mask) -> list[tuple[int, int]]:
    """First and one past the last row of each run."""
    edges = np.flatnonzero(np.diff(np.r_[False, of, False].astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _gaps(
    duration: float, taken: Sequence[tuple[float, float]], margin: float
) -> tuple[tuple[float, float], ...]:
    """What a recording has beside stretches of it, with a margin on either side [s]."""
    found, start = [], 0.0
    for a, b in taken:
        found.append((start, a - margin))
        start = max(start, b + margin)
    return tuple((a, b) for a, b in [*found, (start, duration)] if b > a)


def _filled(recording: Recording, name: str) -> Array:
    """A channel with its holes bridged by lines."""
    mask, index = recording.mask[name], np.arange(len(recording))
    if not mask.any():
        return np.zeros(index.size)
    return np.asarray(np.interp(index, index[mask], recording.channels[name][mask]))


def _lags(
    slow: Recording, fast: Recording, names: list[str], settings: OverlapSettings
) -> list[float]:
    """Times [s] by which the fast recording may run behind, the likeliest first.

    Their whitened cross-correlation peaks where noise is the same; a repeated command makes peaks
    too, which the comparison of the samples refuses.
    """
    dt = slow.sample_time
    grid = np.arange(int(fast.duration / dt + 1.5)) * dt
    size = 1 << int(np.ceil(np.log2(len(slow) + grid.size)))
    total = np.zeros(size)
    for name in names:
        spectra = []
        for values in (_filled(slow, name), np.interp(grid, fast.time, _filled(fast, name))):
            rough = np.diff(values, 2)
            limit = 4.0 * float(np.mean(np.abs(rough))) if rough.size else 0.0
            spectra.append(np.fft.rfft(np.clip(rough, -limit, limit), size))
        cross = np.conj(spectra[0]) * spectra[1]
        total += np.fft.irfft(cross / np.maximum(np.abs(cross), 1e-300), size)
    peaks = np.argsort(total)[::-1][: settings.lags]
    return [float(p if p < grid.size else p - size) * dt for p in peaks]


class _Seen(NamedTuple):
    """Which rows of the slow recording were looked at, which of them the fast one tells in every
    channel that says anything, and which it does not tell in one.
    """

    rows: NDArray[np.intp]
    same: Mask
    denied: Mask


def _same(
    slow: Recording,
    fast: Recording,
    names: list[str],
    lag: float,
    settings: OverlapSettings,
    phase: int = 0,
) -> _Seen:
    """What the samples of the fast recording tell at a lag of those of the slow one; blocks and
    windows begin after the first `phase` rows.
    """
    ratio = slow.sample_time / fast.sample_time
    reach = min(settings.most_reach, round(settings.reach * ratio))
    at = slow.time + lag
    inside = (at > -0.5 * slow.sample_time) & (at < fast.duration + 0.5 * slow.sample_time)
    rows, beside = _looked_at(inside, settings)[phase:], settings.beside_samples
    told, denied = np.zeros(rows.size, dtype=bool), np.zeros(rows.size, dtype=bool)
    for name in names:
        if np.count_nonzero(~denied) < settings.least_samples:
            break
        filled = _filled(slow, name)
        centre = float(filled.mean())
        values, source = filled[rows] - centre, _filled(fast, name) - centre
        steps = np.arange(-reach, reach + 1) * fast.sample_time
        others = np.stack([np.interp(at[rows] + s, fast.time, source) for s in steps], axis=1)
        own = [k for k in range(-beside, beside + 1) if k]
        near = np.stack([np.roll(filled, k)[rows] - centre for k in own], axis=1)
        good = slow.mask[name][rows] & (rows >= beside) & (rows < len(slow) - beside)
        if good.sum() < settings.least_samples:
            continue
        left = _left(values, others, good, settings.block_samples)
        alone = _left(values, near, good, settings.block_samples)
        judged, alike = _by_window(values, filled[rows], good, alone, left, settings)
        told |= judged & alike
        denied |= judged & ~alike
    return _Seen(rows, told & ~denied, denied)


def _by_window(
    values: Array, samples: Array, good: Mask, alone: Array, left: Array, settings: OverlapSettings
) -> tuple[Mask, Mask]:
    """Rows of windows in which a channel says anything, and those in which the other recording
    tells its noise. At rest on one step of the converter samples are equal by chance.
    """
    length = settings.window_samples
    count = -(-values.size // length)

    def windows(of: Array | Mask) -> NDArray[Any]:
        return np.pad(of, (0, count * length - of.size)).reshape(count, length)

    order = np.argsort(~windows(good), axis=1, kind="stable")  # what may be used comes first

    def usable(of: Array) -> Array:
        return np.take_along_axis(windows(of), order, axis=1)

    sizes = windows(good).sum(axis=1)
    there = np.arange(length) < sizes[:, None]
    ranked = np.sort(np.where(there, usable(alone), np.inf), axis=1)
    last = np.maximum(sizes - 1, 0) * settings.usual_share
    below, share = last.astype(int), last - last.astype(int)
    at = np.arange(count)
    above = ranked[at, np.minimum(below + 1, np.maximum(sizes - 1, 0))]
    with np.errstate(invalid="ignore"):
        limit = ranked[at, below] + share * (above - ranked[at, below])
        usual = there & (usable(alone) <= limit[:, None])
    members = np.maximum(usual.sum(axis=1), 1)
    size = (usable(alone) * usual).sum(axis=1) / members
    missed = (usable(left) * usual).sum(axis=1) / members
    moved = (np.diff(usable(values), axis=1) != 0.0) & there[:, 1:]
    alive = moved.sum(axis=1) / np.maximum(sizes - 1, 1)
    rounding = 1e-12 * np.maximum(np.abs(usable(samples) * there).max(axis=1), 1e-300)
    judged = (sizes >= length // 2) & (alive >= settings.least_alive) & (size > rounding)
    rows = np.repeat(np.stack([judged, missed < settings.noise_share * size]), length, axis=1)
    return rows[0, : values.size], rows[1, : values.size]


def _looked_at(inside: Mask, settings: OverlapSettings) -> NDArray[np.intp]:
    """The rows that are compared: all, of long recordings blocks spread over them."""
    rows, block = np.flatnonzero(inside), settings.block_samples
    if rows.size <= settings.most_blocks * block:
        return rows
    starts = np.linspace(0, rows.size - block, settings.most_blocks).astype(int)
    return np.asarray(rows[(starts[:, None] + np.arange(block)).ravel()])


def _left(values: Array, by: Array, rows: Mask, block: int) -> Array:
    """What linear combinations of columns, of each block's own, leave of values, in absolute
    value.
    """
    left = np.abs(values)
    for a in range(0, values.size, block):
        own = np.flatnonzero(rows[a : a + block]) + a
        if own.size > 2 * by.shape[1]:
            weights, *_ = np.linalg.lstsq(by[own], values[own], rcond=None)
            left[own] = np.abs(values[own] - by[own] @ weights)
    return left
