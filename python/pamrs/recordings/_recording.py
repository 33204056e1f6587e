"""Recordings: tables of named channels with units, checked and laid on a uniform grid.

Headings carry the unit, ``muscle_pressure [bar]``; everything inside is SI, with gauge pressures
and radians. Whatever cannot be trusted is reported as an :class:`Issue` and masked, never used
silently.

A channel is judged against itself. Ordinary quantised data repeat values, a joint rests against its
stop, a vented muscle reads zero: none of that is a fault. A channel counts as frozen when it stays
exactly equal far longer than its own noise ever leaves it equal elsewhere at rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Index, Mask, stretches
from pamrs._checks import quantities
from pamrs._files import MOST_NAME, shown
from pamrs._tables import Columns, Tabular
from pamrs._tables import over_time as columns_over_time
from pamrs._views import Panels, View, in_laboratory_units, over_time
from pamrs.channels import CHANNELS, channel_of
from pamrs.effects import EFFECTS
from pamrs.errors import RecordingError
from pamrs.recordings._clock import Grid, lay_grid
from pamrs.recordings._doubts import suspicions
from pamrs.rig import Rig, full_name, named_entries
from pamrs.units import in_words

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
        Its canonical name; commands are not examined, sensors for everything.
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
        entered = np.zeros(len(steps), dtype=bool)
        for start, stop in runs:
            entered[max(0, start - 1) : stop] = True
        if share > _RAIL_SHARE or entered.all():
            continue
        usual = max(float(steps[~entered].max()), float(np.median(steps)))
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
    """Spikes of one or two samples that are far from both neighbours."""
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


_FEW: Final = 20


@dataclass(frozen=True, slots=True)
class Issue:
    """Finding in a recording: a fault of a channel or of the clock, or a remark on its reading.

    Attributes
    ----------
    kind : str
        ``nan``, ``gap``, ``clock_jump``, ``frozen``, ``saturated``, ``outlier``, ``constant``,
        ``short``, or ``log`` for what was done to the file as it was read.
    channel : str
        Canonical name; ``time`` for the clock.
    start, stop : float
        From when to when [s].
    text : str
        What it is and what was done.
    rail : float or None
        The end of its sensor's range at which a channel is cut off, SI.
    """

    kind: str
    channel: str
    start: float
    stop: float
    text: str
    rail: float | None = None


@dataclass(frozen=True, slots=True)
class OwnValue:
    """A parameter of the rig that had another value in one recording.

    Attributes
    ----------
    value : float
        Its value there, SI.
    nominal : float
        What the rig file of the case says, SI.
    error : str
        What the rig file is wrong by there: ``same`` (a fit moves it by as much as elsewhere),
        ``proportional`` (by the same share), ``none`` (its value is exact), or ``own`` (nobody
        knows it: it is found in this recording, and free around that).
    """

    value: float
    nominal: float
    error: str = "same"

    def at(self, elsewhere: float) -> float:
        """Value in this recording where a model has the value `elsewhere` in the others, SI."""
        if self.error in ("none", "own"):
            return self.value
        if self.error == "proportional":
            return self.value * elsewhere / self.nominal
        return self.value + elsewhere - self.nominal

    @property
    def slope(self) -> float:
        """Derivative of the value in this recording with respect to the value elsewhere."""
        if self.error in ("none", "own"):
            return 0.0
        return self.value / self.nominal if self.error == "proportional" else 1.0


@dataclass(frozen=True, eq=False)
class Recording(View, Tabular):
    """One recording on a uniform grid.

    Attributes
    ----------
    name : str
        The file's stem, or what the case calls it.
    role : str
        ``fit`` or ``held_out``.
    time : (n,) array
        Seconds from 0.
    sample_time : float
        Seconds.
    channels : dict of str to (n,) array
        SI values, NaN where the mask is False.
    mask : dict of str to (n,) bool array
        True where the channel may be used.
    issues : list of Issue
        What was found.
    units : dict of str to str
        SI unit of each channel.
    source : str
        The file that it was read from.
    parameters : dict of str to OwnValue
        Parameters of the rig that had another value in it than in the rig file, by dotted name.
    said : dict of str to str
        Unit in which the file has each channel, as far as it was read from one.
    commands : dict of str to (n * m,) array
        Where each sample is a mean of `m` of the log: the commands of the log, from each sample to
        the next, with holes filled. Empty elsewhere.
    notes : dict of str to str
        By channel, a sentence on how its numbers became values where the file alone does not say: a
        unit that was assumed, an ambient pressure that was subtracted.
    logged : dict of str to (float, (m,) array)
        Of a channel that was sampled more slowly than its grid, and is interpolated between its
        samples: how far these are apart as a rule [s], and their values, NaN where there is none.
    left : tuple of str
        Parts of its log that were not asked for with it.
    """

    name: str
    role: str
    time: Array
    sample_time: float
    channels: dict[str, Array]
    mask: dict[str, Mask]
    issues: list[Issue] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    source: str = ""
    parameters: dict[str, OwnValue] = field(default_factory=dict)
    said: dict[str, str] = field(default_factory=dict)
    commands: dict[str, Array] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    logged: dict[str, tuple[float, Array]] = field(default_factory=dict)
    left: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", shown(self.name)[:MOST_NAME])

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return (
            f"Recording({self.name!r}, {self.role}, {len(self)} samples every {self.sample_time:g} "
            f"s: {', '.join(self.channels)}; {len(self.issues)} issues)"
        )

    def _panels(self) -> Panels:
        return over_time({n: [("", self.time, v, {})] for n, v in self.channels.items()})

    def _numbers(self) -> dict[str, str]:
        spans = {
            name: in_laboratory_units(name, np.nanmin(values), np.nanmax(values))
            for name, values in self.channels.items()
            if np.isfinite(values).any()
        }
        about = f"{self.role}, {self.duration:.4g} s, {len(self)} samples"
        return {f"recording {self.name}": about, **spans, "issues": str(len(self.issues))}

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def rig_there(self, rig: Rig) -> Rig:
        """Copy of a rig with the parameter values that hold in this recording alone.

        Parameters
        ----------
        rig : Rig
            A model with the values elsewhere.

        Returns
        -------
        Rig

        Raises
        ------
        ParameterError
            If the rig has no such parameter, or it cannot have that value.
        """
        for label, entry in named_entries(rig):
            there = {
                short: own.at(entry["parameters"][short])
                for n, own in self.parameters.items()
                for full, _, short in [n.rpartition(".")]
                if full in (label, full_name(entry))
            }
            if there:
                rig = rig.with_effect(
                    entry["id"],
                    entry["parameters"] | there,
                    at=entry.get("at", ""),
                    form=entry.get("form", ""),
                )
        values = {
            n: own.at(rig.parameter(n).value)
            for n, own in self.parameters.items()
            if n.partition(".")[0] not in EFFECTS
        }
        return rig.with_parameters(values) if values else rig

    def valid(self, *channels: str) -> Mask:
        """Samples at which all these channels may be used; without names, all channels that there
        are.

        Parameters
        ----------
        *channels : str
            Canonical names.

        Returns
        -------
        (n,) bool array

        Raises
        ------
        RecordingError
            If the recording lacks one of them.
        """
        combined = np.ones(len(self), dtype=bool)
        for channel in channels or self.channels:
            if channel not in self.mask:
                raise RecordingError(
                    f"recording {self.name!r} has no channel {channel!r}; it has: "
                    f"{', '.join(self.channels)}"
                )
            combined &= self.mask[channel]
        return combined

    def segments(self, *channels: str, minimum: int = 1) -> list[tuple[int, int]]:
        """Stretches without a hole in these channels.

        Parameters
        ----------
        *channels : str
            Canonical names; without names all that there are.
        minimum : int, optional
            Shortest stretch [samples].

        Returns
        -------
        list of (start, stop)
            Sample indices, ``stop`` excluded.
        """
        return [(a, b) for a, b in stretches(self.valid(*channels)) if b - a >= minimum]

    @quantities
    def between(self, start: float | None = None, stop: float | None = None) -> Recording:
        """The part of a recording between two times; its time begins at 0 again.

        Parameters
        ----------
        start, stop : float, optional
            Limits [s], both included; by default the beginning and the end.

        Returns
        -------
        Recording

        Raises
        ------
        RecordingError
            If fewer than two samples are left.
        """
        if start is None and stop is None:
            return self
        low = 0.0 if start is None else float(start)
        high = self.duration if stop is None else float(stop)
        slack = 1e-6 * self.sample_time
        keep = (self.time >= low - slack) & (self.time <= high + slack)
        if keep.sum() < 2:
            raise RecordingError(
                f"recording {self.name!r}: start = {low:g} and stop = {high:g} s leave "
                f"{int(keep.sum())} samples of 0 to {self.duration:g} s; at least 2 are needed"
            )
        offset = float(self.time[keep][0])
        issues = [
            replace(i, start=max(0.0, i.start - offset), stop=i.stop - offset)
            for i in self.issues
            if i.stop >= low and i.start <= high
        ]
        return replace(
            self,
            time=self.time[keep] - offset,
            channels={name: values[keep] for name, values in self.channels.items()},
            mask={name: flags[keep] for name, flags in self.mask.items()},
            issues=issues,
        )

    def _columns(self) -> Columns:
        return columns_over_time(self.time, self.channels, self.units)


# ------------------------------------------------------------------------ assembly


def assemble(
    name: str,
    role: str,
    time: Array,
    raw: Mapping[str, Array],
    units: Mapping[str, str],
    source: str,
    sample_time: float | None,
    said: Mapping[str, str] | None = None,
) -> Recording:
    """A recording of channels that share one clock.

    Parameters
    ----------
    name, role : str
        What it is called and for.
    time : (n,) array
        Seconds, finite.
    raw : mapping of str to (n,) array
        SI values by channel.
    units : mapping of str to str
        SI unit of each.
    source : str
        The file, for messages.
    sample_time : float or None
        Spacing of the grid [s].
    said : mapping of str to str, optional
        The units that the file says, for what is said of impossible values.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If there are fewer than two rows, or a channel cannot be what it is called.
    """
    if len(time) < 2:
        raise RecordingError(f"{source}: one row only; two at least are needed")
    grid = lay_grid(time, source, sample_time)
    issues = [
        Issue(event.kind, "time", event.start, event.stop, event.text) for event in grid.events
    ]
    if len(grid.time) < _FEW:
        text = f"{len(grid.time)} samples only: too few to judge noise or faults"
        issues.append(Issue("short", "time", 0.0, float(grid.time[-1]), text))
    laid = {channel: Laid(values[grid.rows], grid) for channel, values in raw.items()}
    return composed(name, role, laid, issues, source, units, said)


class Laid(NamedTuple):
    """Values of a channel in SI, (r,), of the rows that its grid uses; `held`: logged on change."""

    values: Array
    grid: Grid
    held: bool = False


def composed(
    name: str,
    role: str,
    laid: Mapping[str, Laid],
    issues: list[Issue],
    source: str,
    units: Mapping[str, str],
    said: Mapping[str, str] | None = None,
) -> Recording:
    """A recording of channels on grids with one time.

    Parameters
    ----------
    name, role : str
        What it is called and for.
    laid : mapping of str to Laid
        Its channels, one at least.
    issues : list of Issue
        What was found before.
    source : str
        The file, for messages.
    units : mapping of str to str
        SI unit of each.
    said : mapping of str to str, optional
        The units that the file says, for what is said of impossible values.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If more than a few values of a channel are not possible.
    """
    grid = next(iter(laid.values())).grid
    channels: dict[str, Array] = {}
    masks: dict[str, Mask] = {}
    logged: dict[str, tuple[float, Array]] = {}
    for channel, own in laid.items():
        unit = (said or {}).get(channel, "")
        channels[channel], masks[channel] = _judged(channel, own, source, issues, unit)
        if own.grid.interpolates:
            logged[channel] = own.grid.usual, own.values
    issues.sort(key=lambda issue: (issue.start, issue.channel))
    step, units = grid.sample_time, dict(units)
    return Recording(name, role, grid.time, step, channels, masks, issues, units, logged=logged)


def _judged(
    channel: str, laid: Laid, source: str, issues: list[Issue], said: str
) -> tuple[Array, Mask]:
    """One channel on its grid with its mask; what is wrong with it is added to the issues."""
    values, grid = laid.values.copy(), laid.grid
    limits = CHANNELS[channel_of(channel)]
    usable = np.isfinite(values)
    impossible = usable & ((values < limits.lower) | (values > limits.upper))
    bad = int(impossible.sum())
    if bad > max(3, len(values) // 50):
        worst = in_words(said, limits.unit, float(values[impossible][0]), digits=".6g")
        ends = in_words(said, limits.unit, limits.lower, limits.upper)
        likely = "".join(f" {one.text}" for one in suspicions({channel: values}, {channel: said}))
        raise RecordingError(
            f"{source}: column {channel!r}: {worst} and {bad - 1} more values are not possible "
            f"({ends}); right column and unit?{likely}"
        )
    found = _runs(~usable, "nan", "no value")
    found += _runs(impossible, "outlier", "an impossible value")
    usable &= ~impossible
    values[~usable] = np.nan
    for fault in [] if laid.held else find_faults(channel_of(channel), values):
        found.append(fault)
        if fault.masked:
            usable[fault.start : fault.stop] = False
    for kind, rail in dict.fromkeys((fault.kind, fault.rail) for fault in found):
        same = [fault for fault in found if (fault.kind, fault.rail) == (kind, rail)]
        if len(same) > _FEW:
            total = sum(fault.stop - fault.start for fault in same)
            text = f"{len(same)} stretches, {total} samples in all"
            same = [Fault(kind, same[0].start, same[-1].stop, text)]
        for one in same:
            issues.append(Issue(kind, channel, *grid.when(one.start, one.stop), one.text, rail))
    return grid.lay(values, usable)


def _runs(flags: Mask, kind: str, text: str) -> list[Fault]:
    return [Fault(kind, a, b, f"{text} ({b - a} samples)") for a, b in stretches(flags)]
