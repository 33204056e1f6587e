"""Finds what is wrong with a sampled channel: frozen, saturated, spiked, constant.

A channel is judged against itself. Ordinary quantised data repeat values, a joint rests against its
stop, a vented muscle reads zero: none of that is a fault. A channel counts as frozen when it stays
exactly equal far longer than its own noise ever leaves it equal elsewhere at rest.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Index, stretches
from pamrs.channels import CHANNELS

_WINDOW: Final = 40  # samples of a window in which rest and noise are judged
_LEAST: Final = 20  # no shorter run is ever suspect
_CHANCE: Final = 1e-6  # chance of a false alarm per channel, under the channel's own noise
_MARGIN: Final = 2.0  # on the longest expected run
_RAIL_SHARE: Final = 0.1  # of the samples that dropouts may take; more is how the channel is
_RAIL_LEAP: Final = 5.0  # step into a dropout over the largest one elsewhere
_RAIL_SAME: Final = 0.3  # difference before and after it, over that step
_EDGES: Final = 1.5  # quanta that noise has to span, at least two, for stays to be judged by it
_REST: Final = 12.0  # quanta that a channel at rest may span


class Fault(NamedTuple):
    """Faulty stretch, ``rows[start:stop]`` of the channel as it was read; `rail` is the end of the
    sensor's range that it ran into.
    """

    kind: str
    start: int
    stop: int
    text: str
    masked: bool = True
    rail: float | None = None


def find_faults(channel: str, values: Array) -> list[Fault]:
    """Judge one channel.

    Parameters
    ----------
    channel : str
        Its canonical name; commands are only looked at for nothing, sensors for everything.
    values : (n,) array
        SI values in the order of sampling, NaN where there is none.

    Returns
    -------
    list of Fault
        In the order of kinds: constant, outlier, saturated, frozen.
    """
    row = CHANNELS[channel]
    if row.has("command") or row.has("unjudged") or len(values) < 3:
        return []
    good = np.flatnonzero(np.isfinite(values))
    data = values[good]
    if len(data) < 3:
        return []
    if np.all(data == data[0]):
        if len(data) < _LEAST:
            return []
        masked, text = (
            row.has("clips") and not row.has("steady"),
            "one and the same value throughout",
        )
        return [Fault("constant", int(good[0]), int(good[-1]) + 1, text, masked)]
    faults = _rails(data, good)
    for fault in faults:
        good = good[(good < fault.start) | (good >= fault.stop)]
    data = values[good]
    if len(data) < 3:
        return faults
    faults += _outliers(data, good)
    spiked = np.zeros(len(values), dtype=bool)
    for fault in faults:
        spiked[fault.start : fault.stop] = True
    good = good[~spiked[good]]
    data = values[good]
    if len(data) < 3 * _LEAST:
        return faults
    for kind, start, stop in _Stretches(channel, data).suspects():
        where = "its extreme value" if kind == "saturated" else "exactly one value"
        found = _fault(kind, good, start, stop, f"{stop - start} samples at {where}")
        cut_off = kind == "saturated"
        faults.append(found._replace(rail=float(data[start])) if cut_off else found)
    return faults


def _rails(data: Array, good: Index) -> list[Fault]:
    """Dropouts: runs at one end of the range, entered and left by leaps found nowhere else."""
    found: list[Fault] = []
    if len(data) < 3 * _LEAST:
        return found
    steps = np.abs(np.diff(data))
    for value in (float(data.min()), float(data.max())):
        runs = stretches(data == value)
        share = sum(stop - start for start, stop in runs) / len(data)
        beside = np.zeros(len(steps), dtype=bool)
        for start, stop in runs:
            beside[max(0, start - 1) : stop] = True
        if share > _RAIL_SHARE or beside.all():
            continue
        usual = max(float(steps[~beside].max()), float(np.median(steps)))
        if not all(_dropped(data, start, stop, usual) for start, stop in runs):
            continue
        for start, stop in runs:
            if stop - start > 1:  # a single one is an outlier
                text = f"{stop - start} samples at the end of its range ({value:.4g}, SI), "
                found.append(_fault("saturated", good, start, stop, f"{text}reached by a leap"))
    return found


def _fault(kind: str, good: Index, start: int, stop: int, text: str) -> Fault:
    """A fault of the channel, from samples of its good rows."""
    return Fault(kind, int(good[start]), int(good[stop - 1]) + 1, text)


def _dropped(data: Array, start: int, stop: int, usual: float) -> bool:
    """True where a run is a dropout: leaps at both ends, about the same value on either side."""
    sides = [float(data[i]) for i in (start - 1, stop) if 0 <= i < len(data)]
    leaps = [abs(side - float(data[start])) for side in sides]
    same = len(sides) == 1 or abs(sides[0] - sides[1]) <= _RAIL_SAME * min(leaps)
    return bool(leaps) and min(leaps) > _RAIL_LEAP * usual and same


def _outliers(data: Array, good: Index) -> list[Fault]:
    """Spikes of one or two samples that stand off from both sides."""
    n = len(data)
    if n < _LEAST:
        return []
    from scipy.ndimage import rank_filter  # `import pamrs` is light

    low, middle, high = (rank_filter(data, rank, 7, mode="nearest") for rank in (2, 3, 4))
    off, local = data - middle, high - low
    quantum = _quantum(data)
    ordinary = np.quantile(np.abs(off), 0.99)
    limit = np.maximum(np.maximum(12.0 * quantum, 7.0 * ordinary), 6.0 * local)
    apart = np.abs(off) > limit
    if apart.sum() > n // 50:
        return []
    return [
        _fault("outlier", good, start, stop, f"a spike of {off[start]:.3g} (SI)")
        for start, stop in stretches(apart)
    ]


def _quantum(data: Array) -> float:
    """Smallest step between values: a low quantile of those above rounding."""
    steps = np.diff(np.unique(data))
    span = float(data.max() - data.min())
    steps = steps[steps > 1e-9 * max(span, abs(float(data[0])) * 1e-3)]
    return float(np.quantile(steps, 0.05)) if len(steps) else 0.0


class _Stretches:
    """Runs of exactly equal values of one channel, judged by its noise."""

    def __init__(self, channel: str, data: Array) -> None:
        self.channel = channel
        self.data = data
        self.step = np.diff(data)
        edges = np.flatnonzero(self.step != 0.0) + 1
        self.starts = np.concatenate([[0], edges])
        self.stops = np.concatenate([edges, [len(data)]])
        self.lengths = self.stops - self.starts
        self.quantum = _quantum(data)
        self.low, self.high = float(data.min()), float(data.max())
        self.typical = float(np.quantile(np.abs(self.step[self.step != 0.0]), 0.5))
        self.rest_windows, self.limit = self._noise()

    def _noise(self) -> tuple[int, float]:
        """Count of windows that rest with live noise, and the longest run of equal samples."""
        count = len(self.data) // _WINDOW
        if count < 3:
            return 0, math.inf
        windows = self.data[: count * _WINDOW].reshape(count, _WINDOW)
        steps = np.diff(windows, axis=1)
        equal = np.mean(steps == 0.0, axis=1)
        spans = np.ptp(windows, axis=1)
        signs = np.sign(steps)
        reversals = np.sum(signs[:, 1:] * signs[:, :-1] < 0, axis=1) + _skipped_reversals(signs)
        noisy = reversals >= 5
        calm = noisy
        if noisy.any():
            calm = spans <= np.quantile(spans[noisy], 0.5) * 2 + _REST * self.quantum
        alive = noisy & calm
        number = int(alive.sum())
        # noise that crosses one edge of a converter's steps, and no more, crosses none where the
        # signal rests between two edges: however long it stays there, it tells nothing
        if number < 3 or float(np.median(spans[alive])) < _EDGES * self.quantum:
            return number, math.inf
        most = min(max(float(np.max(equal[alive])), 0.05), 0.97)
        n = len(self.data)
        return number, max(_LEAST, _MARGIN * (1.0 + math.log(n / _CHANCE) / -math.log(most)))

    def suspects(self) -> list[tuple[str, int, int]]:
        """``(kind, start, stop)`` of the stretches that are saturated or frozen."""
        found: list[tuple[str, int, int]] = []
        clipped: dict[float, bool] = {}
        for index in np.flatnonzero(self.lengths >= _LEAST):
            start, stop = int(self.starts[index]), int(self.stops[index])
            value = float(self.data[start])
            extreme = value in (self.low, self.high)
            if extreme and self._ordinary_extreme(value):
                continue
            long = stop - start > self.limit
            clips = extreme and CHANNELS[self.channel].has("clips")
            if clips and (long or self._cut_off(start, stop)):
                clipped[value] = True
            elif (long and self._believable(start, stop)) or self._leaps(start, stop):
                found.append(("frozen", start, stop))
        for value in clipped:
            at = (self.data[self.starts] == value) & (self.lengths >= 3)
            ends = zip(self.starts[at].tolist(), self.stops[at].tolist(), strict=True)
            found += [("saturated", start, stop) for start, stop in ends]
        return sorted(found, key=lambda item: item[1])

    def _ordinary_extreme(self, value: float) -> bool:
        """True for extremes that are no fault: a joint at its stop, a pressure or force at zero."""
        if CHANNELS[self.channel].has("rests"):
            return True
        return value == self.low and abs(value) <= 0.02 * (self.high - self.low)

    def _believable(self, start: int, stop: int) -> bool:
        """True where an overlong run is a sensor fault, not a joint held by friction."""
        if not CHANNELS[self.channel].has("rests"):
            return True
        lively = self.rest_windows * _WINDOW >= 3 * (stop - start)
        return lively or self._jump(start, stop) > max(3.0 * self.quantum, 3.0 * self.typical)

    def _jump(self, start: int, stop: int) -> float:
        """The step with which the channel comes back to life."""
        return abs(float(self.step[stop - 1])) if stop < len(self.data) else 0.0

    def _leaps(self, start: int, stop: int) -> bool:
        """True where a run ends with a step above 5 times every other step of the channel."""
        size = np.abs(self.step)
        before = float(size[: max(start - 1, 0)].max(initial=0.0))
        after = float(size[stop:].max(initial=0.0))
        return self._jump(start, stop) > 5.0 * max(before, after, self.quantum)

    def _cut_off(self, start: int, stop: int) -> bool:
        """True where the signal enters or leaves the extreme faster than it usually steps."""
        slopes = []
        if start >= 6:
            slopes.append(abs(float(self.data[start] - self.data[start - 6])) / 6)
        if stop + 6 <= len(self.data):
            slopes.append(abs(float(self.data[stop + 5] - self.data[stop - 1])) / 6)
        usual = max(3.0 * self.quantum, self.typical)
        return len(slopes) > 0 and max(slopes) > usual and math.isinf(self.limit)


def _skipped_reversals(signs: Array) -> Index:
    """Reversals across one or two equal samples: up, still, down."""
    one = (signs[:, 2:] * signs[:, :-2] < 0) & (signs[:, 1:-1] == 0)
    two = (signs[:, 3:] * signs[:, :-3] < 0) & (signs[:, 2:-1] == 0) & (signs[:, 1:-2] == 0)
    return np.asarray(np.sum(one, axis=1) + np.sum(two, axis=1))
