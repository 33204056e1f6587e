"""Channels with clocks of their own, on one grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.channels import channel_of, with_trait
from pamrs.errors import RecordingError
from pamrs.recordings._clock import GAP, Grid, check_samples, gaps, usual_interval
from pamrs.recordings._recording import Issue, Laid, Recording, assemble, composed
from pamrs.recordings._stamps import Rows, Ticks, filled_rows, reading_rows, spread, unwound

_UNEVEN: Final = 0.02  # steps of the grid that the middle of what is averaged may lie aside
#: A diagnosis can do without them: they need not last as long as the others.
SLOW: Final = frozenset(with_trait("slow"))
COMMANDS: Final = frozenset(with_trait("command"))
#: What does not say how fine the grid is: commands, which hold, keep their sum on any grid.
UNTOLD: Final = SLOW | COMMANDS
_FINEST: Final = 1000  # samples of the grid for each one that was recorded, at most
_CUT: Final = 2.0  # samples at the ends whose loss is not worth a word


@dataclass(frozen=True, eq=False)
class Sampled:
    """A channel as it was sampled.

    Attributes
    ----------
    name : str
        The channel.
    values : (n,) array
        SI values, NaN where there is none.
    time : (n,) array
        Seconds on the clock of the recording, finite.
    unit : str
        SI unit.
    hold : bool
        Logged on change: a value holds until the next one.
    clock : Ticks, optional
        The rows of the log that it was read from.
    places : (n,) array of int, optional
        Which of them it has values in; None if in all of them.
    remarks : tuple of str
        What was done to its values as they were read.
    """

    name: str
    values: Array
    time: Array
    unit: str
    hold: bool = False
    clock: Ticks | None = None
    places: Rows | None = None
    remarks: tuple[str, ...] = ()

    def rows(self, start: int, stop: int) -> Sampled:
        """Copy of the channel with its samples ``start`` to ``stop`` (exclusive) alone."""
        places = None if self.places is None else self.places[start:stop]
        return replace(
            self, values=self.values[start:stop], time=self.time[start:stop], places=places
        )


def sampled(name: str, values: Array, clock: Ticks, unit: str, hold: bool = False) -> Sampled:
    """A channel with the times of its values.

    Parameters
    ----------
    name : str
        The channel.
    values : (n,) array
        SI values of all rows of the log, NaN where there is none.
    clock : Ticks
        When the rows were taken.
    unit : str
        SI unit.
    hold : bool
        Logged on change.

    Returns
    -------
    Sampled
        A channel that has values in few rows only has their times: a slower one is no fault, and a
        command holds until it is written again. So has one whose readings the log repeats.
    """
    values = values[clock.rows]
    remarks: list[str] = []
    if unit == "rad":
        values, said = unwound(values)
        remarks += [said] if said else []
    commanded = channel_of(name) in COMMANDS
    places = np.flatnonzero(np.isfinite(values)) if hold else filled_rows(values)
    repeated = None if hold or commanded else reading_rows(values)
    if repeated is not None:
        places, stay = repeated
        rate = 1.0 / max(float(np.median(np.diff(clock.time[places]))), 1e-12)
        remarks.append(f"each reading stays for {stay:g} rows: {rate:.2g} Hz, each counts once")
    elif places is None or len(places) == len(values):
        time = clock.time if hold else clock.spread[0]
        return Sampled(name, values, time, unit, hold, clock, None, tuple(remarks))
    elif not hold:
        hold = commanded
        told = "held until the next one" if hold else "taken as sampled at their own times"
        remarks.append(f"{len(places)} of {len(values)} rows have a value of it: {told}")
    time = clock.time[places] if hold else spread(clock.time[places])[0]
    return Sampled(name, values[places], time, unit, hold, clock, places, tuple(remarks))


def recording_of(
    name: str,
    role: str,
    channels: Sequence[Sampled],
    source: str,
    sample_time: float | None,
    said: Mapping[str, str],
) -> Recording:
    """A recording of channels, whether they share a clock or not.

    Parameters
    ----------
    name, role : str
        What it is called and for.
    channels : sequence of Sampled
        Its channels, one at least.
    source : str
        The file, for messages.
    sample_time : float, optional
        Spacing of the grid [s].
    said : mapping of str to str
        Unit of each channel in the file.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If a channel cannot be what it is called, or a clock does not rise.
    """
    first = channels[0].time
    alike = all(
        channel.time is first or np.array_equal(channel.time, first) for channel in channels
    )
    if not alike or any(channel.hold for channel in channels):
        return on_one_clock(name, role, channels, source, sample_time)
    raw = {channel.name: channel.values for channel in channels}
    units = {channel.name: channel.unit for channel in channels}
    return assemble(name, role, first, raw, units, source, sample_time, said)


class _Averaged(Grid):
    """Grid coarser than the samples: means with weights that fall to zero one step of the grid
    away, which delay nothing and keep a straight line as it is.
    """

    def lay(self, values: Array, usable: Mask) -> tuple[Array, Mask]:
        """Means on the grid; where too little is on one side, what is recorded there."""
        step = self.sample_time
        first = np.searchsorted(self._stamps, self.time - step, side="left")
        last = np.searchsorted(self._stamps, self.time + step, side="right")
        weight, moment, total = (np.zeros(len(self.time)) for _ in range(3))
        for offset in range(int(np.max(last - first, initial=0))):
            place = np.minimum(first + offset, len(values) - 1)
            away = self._stamps[place] - self.time
            share = np.maximum(1.0 - np.abs(away) / step, 0.0)
            share *= usable[place] & (first + offset < last)
            weight += share
            moment += share * away
            total += share * np.where(usable[place], values[place], 0.0)
        laid, mask = super().lay(values, usable)
        even = (weight > 0.0) & (np.abs(moment) <= _UNEVEN * step * weight)
        laid[even] = total[even] / weight[even]
        return laid, mask | even


class _Held(Grid):
    """Events: each value holds until the next one; there may be only one."""

    interpolates = False

    def _place_samples(self) -> None:
        """Do nothing: events are not interpolated."""

    def lay(self, values: Array, usable: Mask) -> tuple[Array, Mask]:
        """The last value at or before each time; NaN, and False in the mask, before the first."""
        near = 1e-6 * self.sample_time
        place = np.searchsorted(self._stamps, self.time + near, side="right") - 1
        mask: Mask = (place >= 0) & usable[np.maximum(place, 0)]
        laid = np.where(mask, values[np.maximum(place, 0)], np.nan)
        return laid, mask


class _Commanded(_Held):
    """Grid of commands, which hold between samples: their mean over the step of the grid that
    follows, which keeps their integral.
    """

    def lay(self, values: Array, usable: Mask) -> tuple[Array, Mask]:
        """Means; NaN, and False in the mask, where the command was not recorded."""
        _, mask = super().lay(values, usable)
        near = 1e-6 * self.sample_time
        lasting = np.diff(self._stamps)
        lost = ~usable[:-1] | (lasting > GAP * self.usual)
        safe = np.where(usable, values, 0.0)
        total = np.concatenate([[0.0], np.cumsum(safe[:-1] * lasting)])
        losses = np.concatenate([[0], np.cumsum(lost)])
        edges = np.append(self.time, self.time[-1] + self.sample_time)
        place = np.searchsorted(self._stamps, edges + near, side="right") - 1
        place = np.clip(place, 0, len(values) - 1)
        upto = total[place] + safe[place] * (edges - self._stamps[place])
        mask = mask & (losses[np.minimum(place[1:], len(lasting))] == losses[place[:-1]])
        same = place[1:] == place[:-1]
        mean = np.where(same, safe[place[:-1]], np.diff(upto) / self.sample_time)
        return np.where(mask, mean, np.nan), mask


def on_one_clock(
    name: str, role: str, channels: Sequence[Sampled], source: str, sample_time: float | None
) -> Recording:
    """A recording of channels with different clocks, where all of them were sampled.

    Parameters
    ----------
    name, role : str
        What it is called and for.
    channels : sequence of Sampled
        One at least that is not held.
    source : str
        The file, for messages.
    sample_time : float, optional
        Spacing of the grid [s]; by default that of the fastest measured channel (commands and
        temperatures left out). On a coarser one a channel is averaged, on a finer one it is
        interpolated between neighbours.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If a clock does not rise, or the channels were not sampled at the same time.
    """
    stepped = [channel for channel in channels if not channel.hold]
    if not stepped:
        raise RecordingError(f"{source}: every channel has hold = true; one sampled one is needed")
    rows = {channel.name: _rising(channel, source) for channel in channels}
    usual: dict[str, float] = {}
    for channel in stepped:
        intervals = np.diff(channel.time[rows[channel.name]])
        usual[channel.name] = usual_interval(intervals, len(channel.time))
    telling = [each for each in stepped if channel_of(each.name) not in UNTOLD] or stepped
    step = sample_time or min(usual[channel.name] for channel in telling)
    ended = [each for each in stepped if channel_of(each.name) not in SLOW] or stepped
    start, time = _common(ended, step, source)
    issues: list[Issue] = []
    laid: dict[str, Laid] = {}
    for channel in channels:
        own = rows[channel.name]
        stamps = channel.time[own] - start
        interval = usual.get(channel.name, step)
        kind = Grid
        if channel_of(channel.name) in COMMANDS and len(own) > 1:
            kind = _Commanded
        elif channel.hold:
            kind = _Held
        elif 2.0 * interval <= step * 1.01:
            kind = _Averaged
        if not channel.hold:
            issues += _missing(channel.name, stamps, interval, time, step)
        grid = kind(stamps, own, step, np.inf if channel.hold else interval, [], time)
        laid[channel.name] = Laid(channel.values[own], grid, channel.hold)
    units = {channel.name: channel.unit for channel in channels}
    return composed(name, role, laid, issues, source, units)


def _rising(channel: Sampled, source: str) -> Index:
    """Rows whose times differ from the row before; the last one of events at the same time."""
    intervals = np.diff(channel.time)
    if np.any(intervals < 0.0):
        at = int(np.argmax(intervals < 0.0))
        raise RecordingError(
            f"{source}: the clock of {channel.name!r} steps back by {-float(intervals[at]):.6g} s "
            f"at {float(channel.time[at]):.6g} s; with several clocks that is not allowed (split = "
            "'clock' makes a recording of each part)"
        )
    keep = np.concatenate([intervals > 0.0, [True]] if channel.hold else [[True], intervals > 0.0])
    rows = np.flatnonzero(keep)
    if len(rows) < 2 and not channel.hold:
        raise RecordingError(
            f"{source}: {channel.name!r} has {len(rows)} samples at different times; 2 are needed "
            "(hold = true if it is logged on change)"
        )
    return rows


def _common(channels: Sequence[Sampled], step: float, source: str) -> tuple[float, Array]:
    """Start time and grid of the stretch in which all channels were sampled."""
    start = max(float(channel.time[0]) for channel in channels)
    stop = min(float(channel.time[-1]) for channel in channels)
    check_samples(max(stop - start, 0.0), step, source)
    count = int(np.floor((stop - start) / step + 0.05)) + 1
    if stop <= start or count < 2:
        spans = "; ".join(
            f"{channel.name} from {channel.time[0]:.9g} to {channel.time[-1]:.9g} s"
            for channel in channels
        )
        raise RecordingError(
            f"{source}: the channels were not sampled at the same time: {spans} (time = {{ offset "
            "= ... }} of a channel moves its clock)"
        )
    most = _FINEST * max(len(channel.time) for channel in channels)
    if count > most:
        raise RecordingError(
            f"{source}: {stop - start:.6g} s in steps of {step:.6g} s are {count} samples, more "
            f"than {_FINEST:g} times what was recorded; long pauses part recordings with split = "
            "{ gap = ... }, and sample_time says another step"
        )
    return start, np.arange(count, dtype=np.float64) * step


def _missing(name: str, stamps: Array, interval: float, time: Array, step: float) -> list[Issue]:
    """Issues of a channel: its gaps, and its samples outside the recording."""
    elapsed = np.diff(stamps)
    events = gaps(stamps, elapsed, np.zeros(len(elapsed), dtype=bool), interval)
    last = float(time[-1])
    found = [
        Issue("gap", name, max(0.0, event.start), min(last, event.stop), event.text)
        for event in events
        if event.stop > 0.0 and event.start < last
    ]
    for lost, words, at in (
        (-float(stamps[0]), "before another channel begins", 0.0),
        (float(stamps[-1]) - last, "after another channel ends", last),
    ):
        if lost > _CUT * step:
            text = f"{lost:.4g} s of it, {words}, are left out"
            found.append(Issue("gap", name, at, at, text))
    return found
