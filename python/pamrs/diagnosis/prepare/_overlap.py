"""Recordings that hold the same samples: a copy is no proof.

Repeated commands give the same signals again, but not the same noise. Two recordings share content
where one tells the other's samples better than any sample is told by its own neighbours: then its
noise is the same, and not its command alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamrs._arrays import Mask, stretches
from pamrs.diagnosis.prepare._deviations import (
    LEAST_SAMPLES,
    WINDOW_SAMPLES,
    Alignment,
    ChannelDeviations,
    SharedRows,
    is_set,
    shared_rows,
)
from pamrs.recordings import Recording

_COPY_SHARE = 0.5  # share of a recording that is in another one of its role before it is left out
# [s] between what is shared and what is kept: within it a joint's past fades (decision 111)
_GAP = 2.5
# [s] of a held-out recording that is kept as a proof: two long windows (decision 111)
_LEAST_LEFT = 8.0
_MOST_RATE_RATIO = 50.0  # ratio of sample times up to which recordings are compared


@dataclass(frozen=True)
class Overlap:
    """Samples that one recording shares with another.

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


def without_copies(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Recordings that prove something, and what was left out, in words.

    Of a held-out recording that shares samples with a fitted one only the stretches are kept that
    it does not share, some time away from what it does; none where they are short. Of two
    recordings of the same role the second is left out where most of it is a copy.

    Parameters
    ----------
    recordings : sequence of Recording
        All of a case.

    Returns
    -------
    kept : list of Recording
        In their order; a stretch has the name of its recording, one of several its times too.
    notes : list of str
        A sentence for each of which something was left out.
    """
    places = range(len(recordings))
    kept_parts: dict[int, list[Recording]] = {}  # by place: one recording may be listed twice
    notes, channels = list[str](), ChannelDeviations()
    for place in sorted(places, key=lambda k: recordings[k].role != "fit"):
        before = [one for parts in kept_parts.values() for one in parts]
        kept_parts[place], notes_of_one = _unshared_parts(recordings[place], before, channels)
        notes += notes_of_one
    return [one for place in places for one in kept_parts[place]], notes


def _unshared_parts(
    recording: Recording, before: Sequence[Recording], channels: ChannelDeviations
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
    channels: ChannelDeviations,
) -> list[tuple[float, float]]:
    """Stretches that share nothing with any recording of another role, long enough for a proof."""
    least = max(_LEAST_LEFT, LEAST_SAMPLES * recording.sample_time)
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
    channels: ChannelDeviations | None = None,
) -> Overlap | None:
    """The stretch that two recordings share, noise included; None where there is none.

    Shifted and resampled copies are found, windows of one recording too.

    Parameters
    ----------
    one, other : Recording
        In any order.
    channels : ChannelDeviations, optional
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
    each = shared_rows(slow, fast, names, channels or ChannelDeviations())
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
    margin = _GAP + WINDOW_SAMPLES * slow.sample_time
    return Overlap(in_one, in_other, share, _gaps(one.duration, runs, margin))


def _in_other(way: Alignment, run: tuple[float, float]) -> tuple[float, float]:
    """Ends of a stretch in the other recording [s]."""
    first, last = (float(way.of(np.array(time))) for time in run)
    return min(first, last), max(first, last)


def _shared_mask(alignment: SharedRows) -> Mask:
    """Rows that two recordings share: those found to be the same, and all between them but for runs
    of three windows or more that differ.
    """
    shared, new_rows = alignment.same.copy(), np.zeros(alignment.same.size, dtype=bool)
    for first, last in stretches(alignment.other):
        new_rows[first:last] = last - first >= LEAST_SAMPLES
    for first, last in stretches(~new_rows & ~shared & alignment.inside):
        beside = new_rows[[k for k in (first - 1, last) if 0 <= k < new_rows.size]]
        # what cannot be told is new where noise of its own is on both sides; so is part of a window
        part = last - first < WINDOW_SAMPLES
        new = beside.any() if part else beside.size == 2 and beside.all()
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
