"""Recordings that hold the same samples: a copy is no proof.

Repeated commands give the same signals again, but not the same noise. Two recordings share content
where one tells the other's samples better than any sample is told by its own neighbours: then its
noise is the same, and not its command alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
    """

    own: tuple[float, float]
    other: tuple[float, float]
    share: float


def without_copies(
    recordings: Sequence[Recording], settings: OverlapSettings
) -> tuple[list[Recording], list[str]]:
    """Recordings that prove something, and what was left out, in words.

    A held-out recording that shares samples with a fitted one is left out of the proof; so is one
    of two recordings of the same role most of which is a copy.

    Parameters
    ----------
    recordings : sequence of Recording
        All of a case.
    settings : OverlapSettings
        What counts as the same.

    Returns
    -------
    kept : list of Recording
    said : list of str
        A sentence for each that was left out.
    """
    fitted = [r for r in recordings if r.role == "fit"]
    kept: list[Recording] = []
    said: list[str] = []
    for recording in [*fitted, *(r for r in recordings if r.role != "fit")]:
        for other in kept:
            found = overlap(recording, other, settings)
            across = recording.role != other.role
            if found is None or not (across or found.share > settings.copy_share):
                continue
            why = (
                "it is no held-out proof and was left out of it"
                if across
                else "it says nothing more and was left out"
            )
            said.append(
                f"{_called(recording)} holds the same samples as {_called(other)}, noise included "
                f"({found.own[0]:.4g} to {found.own[1]:.4g} s are its {found.other[0]:.4g} to "
                f"{found.other[1]:.4g} s): {why}"
            )
            break
        else:
            kept.append(recording)
    return [r for r in recordings if any(r is own for own in kept)], said


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
    found = [
        (lag, *_same(slow, fast, names, lag, settings))
        for lag in _lags(slow, fast, names, settings)
    ]
    lag, rows, count = max(found, key=lambda one: one[1].size)
    if rows.size < settings.least_samples:
        return None
    at = float(slow.time[rows[0]]), float(slow.time[rows[-1]])
    shifted = at[0] + lag, at[1] + lag
    own, away = (at, shifted) if slow is one else (shifted, at)
    return Overlap(own, away, min(1.0, count * slow.sample_time / max(one.duration, 1e-300)))


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


def _same(
    slow: Recording, fast: Recording, names: list[str], lag: float, settings: OverlapSettings
) -> tuple[NDArray[np.intp], float]:
    """Which of the slow recording's samples are told by those of the fast one at a lag, and how
    many that makes of all.
    """
    ratio = slow.sample_time / fast.sample_time
    reach = min(settings.most_reach, round(settings.reach * ratio))
    at = slow.time + lag
    inside = (at > -0.5 * slow.sample_time) & (at < fast.duration + 0.5 * slow.sample_time)
    rows, beside = _looked_at(inside, settings), settings.beside_samples
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
    same = told & ~denied
    return rows[same], float(same.sum()) * float(inside.sum()) / max(rows.size, 1)


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
