"""Recordings out of a log as it was written: channels by a mapping, with clocks of their own on one
grid, parts of one file.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.channels import CHANNELS, channel_of, with_trait
from pamrs.errors import ParameterError, RecordingError
from pamrs.recordings._clock import (
    GAP,
    Grid,
    Rows,
    Ticks,
    check_samples,
    counted_on,
    filled_rows,
    gaps,
    reading_rows,
    spread,
    ticks,
    unit_of_stamps,
    unwound,
    usual_interval,
)
from pamrs.recordings._doubts import made_gauge
from pamrs.recordings._recording import Issue, Laid, Recording, assemble, composed
from pamrs.recordings.logs import Log, Series, TextFormat, read_log, switched, understood_unit
from pamrs.recordings.mapping import ROLES, Clock, Source, read_clock, read_sources
from pamrs.recordings.table import stem_of
from pamrs.units import same_dimension, to_si

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
        how = "held until the next one" if hold else "taken as sampled at their own times"
        remarks.append(f"{len(places)} of {len(values)} rows have a value of it: {how}")
    time = clock.time[places] if hold else spread(clock.time[places])[0]
    return Sampled(name, values[places], time, unit, hold, clock, places, tuple(remarks))


def _recording_of(
    name: str,
    role: str,
    channels: Sequence[Sampled],
    source: str,
    sample_time: float | None,
    said: Mapping[str, str],
) -> Recording:
    """A recording of channels, whether they share a clock or not."""
    first = channels[0].time
    alike = all(
        channel.time is first or np.array_equal(channel.time, first) for channel in channels
    )
    if not alike or any(channel.hold for channel in channels):
        return _on_one_clock(name, role, channels, source, sample_time)
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


def _on_one_clock(
    name: str, role: str, channels: Sequence[Sampled], source: str, sample_time: float | None
) -> Recording:
    """A recording of channels with different clocks, where all of them were sampled.

    By default its grid is that of the fastest measured channel (commands and temperatures left
    out). On a coarser one a channel is averaged, on a finer one it is interpolated between
    neighbours.
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


_ALLOWED: Final = "'clock', { gap = SECONDS } or { column = \"...\" }"
_FEWEST: Final = 2  # samples of a part; what is shorter is left out
_MOST: Final = 10_000


@dataclass(frozen=True)
class Cut:
    """Rule that parts a log: at pauses longer than `gap` [s], by a column, else by its clock."""

    gap: float | None = None
    column: str | None = None


class Split(NamedTuple):
    """The column that parts a log, its clock, and its texts where it has texts."""

    values: Array
    clock: Ticks
    labels: tuple[str, ...]


class Stretch(NamedTuple):
    """Rows ``start`` to ``stop`` (exclusive) with number, from 1, and label, empty for no part."""

    number: int
    label: str
    start: int
    stop: int


class Part(NamedTuple):
    """One recording of several: its number and text, and its channels."""

    number: int
    label: str
    channels: list[Sampled]


def _read_split(split: Any, source: str) -> Cut | None:
    """Cut that the key ``split`` of a recording says."""
    if split is None:
        return None
    if split == "clock":
        return Cut()
    if isinstance(split, Mapping) and len(split) == 1:
        gap, column = split.get("gap"), split.get("column")
        if isinstance(gap, (int, float)) and not isinstance(gap, bool) and 0.0 < gap < math.inf:
            return Cut(gap=float(gap))
        if isinstance(column, str) and column:
            return Cut(column=column)
    raise RecordingError(f"{source}: split = {split!r} is not allowed: {_ALLOWED} is needed")


def parts(
    channels: Sequence[Sampled],
    cut: Cut,
    column: Split | None,
    pieces: Sequence[int | str] | None,
    source: str,
) -> tuple[list[Part], list[str], list[str]]:
    """Part the channels of a log.

    Parameters
    ----------
    channels : sequence of Sampled
        The channels; their clocks may differ.
    cut : Cut
        How.
    column : Split or None
        What `cut` names, if it names a column.
    pieces : sequence of int or str, optional
        Numbers (from 1) or texts of the parts to keep; by default all.
    source : str
        The file, for messages.

    Returns
    -------
    parts : list of Part
        In the order of the log.
    left : list of str
        What the parts are called that `pieces` does not name.
    remarks : list of str
        Parts that are left out, since a channel has fewer than two samples there.

    Raises
    ------
    RecordingError
        If there is nothing to cut, or no such piece.
    """
    reference = next((item for item in channels if not item.hold), channels[0])
    clock = column.clock if column is not None else _clock_of(reference)
    several = {id(_clock_of(item)): _clock_of(item) for item in channels if not item.hold}
    if cut.gap is None and column is None and len(several) > 1:
        made = _by_clock(channels, source)
    else:
        made = _cut(channels, clock, stretches_of(cut, clock.spread[0], column))
    found = [
        part
        for part in made
        if all(len(item.time) >= _FEWEST or item.hold and len(item.time) for item in part.channels)
    ]
    short = [part.label for part in made if part not in found]
    if len(found) > _MOST:
        raise RecordingError(f"{source}: split gives {len(found)} parts; {_MOST} are allowed")
    if not found:
        raise RecordingError(f"{source}: split leaves no part in which every channel has samples")
    chosen = found if pieces is None else _chosen(found, pieces, short, source)
    if pieces is not None:
        return chosen, [part.label for part in made if part not in chosen], []
    listed = f"{len(short)} of {len(made)} parts ({', '.join(short[:8])})"
    remark = f"{listed} are left out: a channel has fewer than {_FEWEST} samples there"
    return chosen, [], [remark] if short else []


def stretches_of(cut: Cut, time: Array, column: Split | None) -> list[Stretch]:
    """Stretches into which a clock is parted by a rule.

    Parameters
    ----------
    cut : Cut
        How.
    time : (n,) array
        The clock [s].
    column : Split or None
        What `cut` names, if it names a column.

    Returns
    -------
    list of Stretch
        Those that have a label, counted from 1.
    """
    if column is not None:
        before, after = column.values[:-1], column.values[1:]
        begins = (after != before) & ~(np.isnan(after) & np.isnan(before))
    else:
        steps = np.diff(time)
        begins = steps < 0.0 if cut.gap is None else steps > cut.gap
    edges = np.flatnonzero(begins) + 1
    bounds = [0, *edges.tolist(), len(time)]
    starts = bounds[:-1]
    labels = _labels(column, starts) if column else [str(k + 1) for k in range(len(starts))]
    named = [part for part in zip(labels, starts, bounds[1:], strict=True) if part[0]]
    return [Stretch(number, *part) for number, part in enumerate(named, start=1)]


def _clock_of(item: Sampled) -> Ticks:
    return item.clock or Ticks(np.arange(len(item.time)), item.time)


def _labels(column: Split, starts: Sequence[int]) -> list[str]:
    """Text of the column in each part, numbered where it repeats; empty without a value."""
    seen: dict[str, int] = {}
    labels: list[str] = []
    for start in starts:
        value = float(column.values[start])
        if math.isnan(value) or (column.labels and not column.labels[int(value)].strip()):
            labels.append("")
            continue
        text = column.labels[int(value)].strip() if column.labels else f"{value:.6g}"
        seen[text] = seen.get(text, 0) + 1
        labels.append(text if seen[text] == 1 else f"{text} ({seen[text]})")
    return labels


def _cut(channels: Sequence[Sampled], clock: Ticks, stretches: Sequence[Stretch]) -> list[Part]:
    """Parts by rows where a channel has the clock that was cut, else by time."""
    time = clock.spread[0]
    found = []
    for number, label, start, stop in stretches:
        low = float(time[start])
        high = float(time[stop]) if stop < len(time) else math.inf
        inside = [_inside(item, clock, start, stop, low, high) for item in channels]
        found.append(Part(number, label, inside))
    return found


def _inside(item: Sampled, clock: Ticks, start: int, stop: int, low: float, high: float) -> Sampled:
    """Samples of a channel in a part; a held channel also has the value from before the part."""
    own = item.clock
    if own is clock or (own is not None and np.array_equal(own.time, clock.time)):
        if item.places is None:
            return item.rows(start, stop)
        first, last = (int(np.searchsorted(item.places, edge)) for edge in (start, stop))
        before = item.hold and first > 0 and (first == last or item.places[first] > start)
    else:
        first, last = (int(np.searchsorted(item.time, edge)) for edge in (low, high))
        before = item.hold and first > 0
    inside = item.rows(first - before, last)
    if before:
        time = inside.time.copy()
        time[0] = min(time[0], low)
        inside = replace(inside, time=time)
    return inside


def _by_clock(channels: Sequence[Sampled], source: str) -> list[Part]:
    """Parts of rising time, each channel by its own clock."""
    cut = {item.name: stretches_of(Cut(), _clock_of(item).spread[0], None) for item in channels}
    counts = {name: len(found) for name, found in cut.items()}
    if len(set(counts.values())) > 1:
        said = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise RecordingError(
            f"{source}: split = 'clock': the clocks of the channels give different numbers of "
            f"parts ({said})"
        )
    each = [_cut([item], _clock_of(item), cut[item.name]) for item in channels]
    return [
        Part(same[0].number, same[0].label, [part.channels[0] for part in same])
        for same in zip(*each, strict=True)
    ]


def _chosen(
    found: list[Part], pieces: Sequence[int | str], short: Sequence[str], source: str
) -> list[Part]:
    kept: list[Part] = []
    labels: dict[int | str, Part] = {part.label: part for part in found}
    labels |= {part.number: part for part in found}
    asked = f"{source}: pieces = {list(pieces)!r}"
    for piece in pieces:
        if not isinstance(piece, bool) and piece in labels:
            kept.append(labels[piece])
            continue
        if str(piece) in short:
            few = f"a channel has fewer than {_FEWEST} samples"
            raise RecordingError(f"{asked}: in part {piece!r} {few}")
        some = ", ".join(repr(part.label) for part in found[:8])
        more = " and so on" if len(found) > 8 else ""
        raise RecordingError(
            f"{asked}: there is no part {piece!r}; there are {len(found)}, called {some}{more}"
        )
    return kept


def load_recordings(
    path: str | os.PathLike[str],
    *,
    channels: Mapping[str, Any],
    time: str | Mapping[str, Any] | None = None,
    split: str | Mapping[str, Any] | None = None,
    pieces: Sequence[int | str] | None = None,
    sample_time: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    name: str | None = None,
    role: str = "fit",
    form: TextFormat | None = None,
    log: Log | None = None,
    ambient_pressure: float | None = None,
) -> list[Recording]:
    """Read recordings out of a log that stays as it is.

    Parameters
    ----------
    path : path-like
        Any log that :func:`pamrs.recordings.logs.read_log` reads.
    channels : mapping
        From channels to where they are: ``{"muscle_pressure": {"column": "AI/p1", "unit": "bar",
        "scale": 2.5}}``. Values are ``scale * raw + offset`` in ``unit``, or on the lines through
        two or more readings (``"from": [0, 4095], "to": [0, 10]``); ``time`` is a clock of the
        channel alone, ``hold`` says that it was logged on change. ``{"value": 0.25, "unit": "m"}``
        is a channel that had this value all the time.
    time : str or mapping, optional
        The series with the times of all channels, ``{"column": "t", "unit": "ms", "offset": 0}``;
        not needed where the log has clocks.
    split : str or mapping, optional
        Where one recording ends and the next begins: ``"clock"`` (the clock steps back), ``{"gap":
        2.0}`` (no sample for longer [s]), ``{"column": "trial"}`` (a series changes).
    pieces : sequence of int or str, optional
        Which of the parts, counted from 1, or by the text that a column has; by default all.
    sample_time : float, optional
        Grid spacing [s]; without any clock, the spacing of the samples.
    start, stop : float, optional
        Only this part of each recording [s].
    name, role : str
        Name (default: the file's stem; parts get their number or text) and role.
    form : TextFormat, optional
        How a text file is written, where that is not to be found out.
    log : Log, optional
        The log, where it was read before.
    ambient_pressure : float, optional
        What is subtracted from absolute pressures (a unit like ``bar(a)``) where no channel
        ``ambient_pressure`` was recorded [Pa]; by default that of the standard atmosphere.

    Raises
    ------
    RecordingError
        If the log or a channel cannot be understood; the message names it.
    MissingPackageError
        If a package that reads the log is missing; the message names the extra.
    """
    file = Path(path)
    source = str(file)
    check_asked(source, role, sample_time)
    sources = read_sources(channels, source)
    constants = [item for item in sources if not item.column]
    sources = [item for item in sources if item.column]
    if not sources:
        raise RecordingError(f"{source}: every channel has a value; one of the log is needed")
    clock = read_clock(time, source)
    cut = _read_split(split, source)
    content = log or read_log(file, form)
    called = name or stem_of(file)
    found = recordings_of(content, sources, clock, called, role, sample_time, cut, pieces)
    every = [*sources, *constants]
    made = [completed(each, every, source, ambient_pressure) for each in found]
    return [each.between(start, stop) for each in made]


def check_asked(source: str, role: str, sample_time: float | None) -> None:
    """Refuse a role or a spacing of samples that there is not.

    Raises
    ------
    RecordingError
        Naming the value and what is allowed.
    """
    if role not in ROLES:
        raise RecordingError(f"{source}: role = {role!r} is not allowed: 'fit' or 'held_out'")
    if sample_time is not None and not (math.isfinite(sample_time) and sample_time > 0.0):
        raise RecordingError(
            f"{source}: sample_time = {sample_time!r} s is not allowed: a positive number is needed"
        )


def completed(
    recording: Recording, sources: Sequence[Source], source: str, ambient_pressure: float | None
) -> Recording:
    """A recording with its constant channels, its units and pressures that are gauge.

    Parameters
    ----------
    recording : Recording
        As it was read.
    sources : sequence of Source
        All its channels.
    source : str
        The file.
    ambient_pressure : float, optional
        What is subtracted from absolute pressures where none was recorded [Pa].
    """
    channels, masks = dict(recording.channels), dict(recording.mask)
    units, count = dict(recording.units), len(recording)
    for item in sources:
        if not item.column:
            channels[item.channel] = np.full(count, float(item.si(item.value)))
            masks[item.channel] = np.ones(count, dtype=bool)
            units[item.channel] = _si_unit(item)
    said = {item.channel: item.unit for item in sources}
    notes = {
        item.channel: f"is assumed to be in {item.unit}: {item.assumed}"
        for item in sources
        if item.assumed
    }
    whole = replace(recording, channels=channels, mask=masks, units=units)
    whole = replace(whole, source=source, said=said, notes=notes)
    absolute = [item.channel for item in sources if item.absolute]
    return made_gauge(whole, absolute, ambient_pressure)


def _si_unit(item: Source) -> str:
    if channel_of(item.channel) == "reference" and not same_dimension(item.unit, "rad"):
        return "Pa"
    return CHANNELS[channel_of(item.channel)].unit


def recordings_of(
    log: Log,
    sources: Sequence[Source],
    clock: Clock,
    name: str,
    role: str = "fit",
    sample_time: float | None = None,
    cut: Cut | None = None,
    pieces: Sequence[int | str] | None = None,
) -> list[Recording]:
    """Recordings of a log that was read.

    Parameters
    ----------
    log : Log
        The log.
    sources : sequence of Source
        Where each channel is.
    clock : Clock
        That of channels without one of their own.
    name, role : str
        What they are called and for.
    sample_time : float, optional
        Grid spacing [s].
    cut : Cut, optional
        How the log is parted.
    pieces : sequence of int or str, optional
        Which parts.

    Raises
    ------
    RecordingError
        If a channel cannot be understood.
    """
    source = str(log.path)
    clocks = Clocks(log, sample_time)
    channels = [_sampled(log, item, clocks, item.clock or clock) for item in sources]
    said = {item.channel: item.unit for item in sources}
    if cut is None:
        if pieces is not None:
            raise RecordingError(f"{source}: pieces = {list(pieces)!r} needs split")
        made = [_recording_of(name, role, channels, source, sample_time, said)]
        return _with_remarks(made, log, channels, [])
    column = None
    if cut.column is not None:
        series = log.find(cut.column)
        ticks = clocks.of(series, clock)
        column = Split(series.values[ticks.rows], ticks, series.labels)
    found, left, remarks = parts(channels, cut, column, pieces, source)
    made = [
        _recording_of(f"{name}_{part.label}", role, part.channels, source, sample_time, said)
        for part in found
    ]
    made = [replace(each, left=tuple(left)) for each in made]
    return _with_remarks(made, log, channels, remarks)


def _with_remarks(
    made: list[Recording], log: Log, channels: Sequence[Sampled], remarks: Sequence[str]
) -> list[Recording]:
    """The recordings, the first of them with what was done to the log as it was read."""
    if not made:
        return made
    said = [("time", text) for text in [*log.remarks, *remarks]]
    seen: list[Ticks] = []
    for item in channels:
        if item.clock is not None and not any(item.clock is clock for clock in seen):
            seen.append(item.clock)
            said += [("time", text) for text in item.clock.remarks]
            said += [("time", item.clock.spread[1])] if item.clock.spread[1] else []
        said += [(item.name, text) for text in item.remarks]
    first = made[0]
    issues = [Issue("log", channel, 0.0, first.duration, text) for channel, text in said]
    return [replace(first, issues=[*issues, *first.issues]), *made[1:]]


def _sampled(log: Log, item: Source, clocks: Clocks, clock: Clock) -> Sampled:
    """Values and times of one channel in SI; rows without a time are left out."""
    series, *others = (switched(log.find(name)) for name in (item.column, item.less) if name)
    raw, said = series.values, ""
    for each in (series, *others):
        if each.labels:
            raise RecordingError(
                f"{log.path}: {each.name!r} holds texts like {each.labels[0]!r}, no numbers for "
                f"{item.channel!r}"
            )
    for less in others:
        if len(less.values) != len(raw) or less.time is not series.time:
            raise RecordingError(
                f"{log.path}: channels.{item.channel}.less = {item.less!r} is not allowed: a "
                f"series of the same rows as {item.column!r} is needed"
            )
        raw = raw - less.values
    if CHANNELS[channel_of(item.channel)].has("moves"):
        raw, said = counted_on(raw)
    made = sampled(item.channel, item.si(raw), clocks.of(series, clock), _si_unit(item), item.hold)
    return replace(made, remarks=(said, *made.remarks)) if said else made


def unit_of_clock(series: Series) -> tuple[str, str]:
    """Unit of the times in a series: what the log says, else by name and size; and a remark."""
    known = understood_unit(series.unit)
    said = known.unit if known is not None and same_dimension(known.unit, "s") else ""
    return unit_of_stamps(series.values, series.name, said)


class Clocks:
    """The clocks of a log, each put in order once."""

    def __init__(self, log: Log, sample_time: float | None) -> None:
        self.log = log
        self.sample_time = sample_time
        self._made: dict[tuple[str | int, str | None, float], Ticks] = {}

    def of(self, series: Series, clock: Clock) -> Ticks:
        """Times at which the rows of a series were taken.

        Raises
        ------
        RecordingError
            If there are none, or they are not as many.
        """
        if clock.column is not None:
            stamps = self.log.find(clock.column)
            if len(stamps.values) != len(series.values):
                raise RecordingError(
                    f"{self.log.path}: {series.name!r} has {len(series.values)} values, but its "
                    f"times {stamps.name!r} are {len(stamps.values)}"
                )
        column: str | int = clock.column or len(series.values)
        if clock.column is None and series.time is not None:
            column = id(series.time)
        key = (column, clock.unit, clock.offset)
        if key not in self._made:
            found, others = self._stamps(series, clock)
            if not np.isfinite(found).any():
                where = f": column {clock.column!r} has no value at all" if clock.column else ""
                raise RecordingError(f"{self.log.path}: {series.name!r} has no time at all{where}")
            self._made[key] = ticks(found, others)
        return self._made[key]

    def _stamps(self, series: Series, clock: Clock) -> tuple[Array, list[Array]]:
        """Times of a series [s], and what else is in the rows."""
        if clock.column is None:
            time = series.time
            if time is None and self.sample_time is not None:
                return np.arange(len(series.values), dtype=np.float64) * self.sample_time, []
            if time is None:
                raise RecordingError(
                    f"{self.log.path}: the log has no clock for {series.name!r}: say which channel "
                    'holds the times (time = { column = "...", unit = "s" }), or sample_time if '
                    "they are evenly spaced"
                )
            others = [each.values for each in self.log.series.values() if each.time is time]
            return time + clock.offset if clock.offset else time, others
        stamps = self.log.find(clock.column)
        unit = self._unit(stamps, clock)
        others = [
            each.values
            for each in self.log.series.values()
            if each is not stamps and len(each.values) == len(stamps.values)
        ]
        return stamps.values * to_si(1.0, unit, "time") + clock.offset, others

    def _unit(self, stamps: Series, clock: Clock) -> str:
        known = understood_unit(stamps.unit)
        unit = clock.unit or (known.unit if known else "s")
        try:
            to_si(1.0, unit, "time")
        except ParameterError as error:
            raise RecordingError(f"{self.log.path}: the times {stamps.name!r}: {error}") from error
        fits, why = unit_of_stamps(stamps.values, stamps.name, unit)
        if fits != unit:
            raise RecordingError(f"{self.log.path}: {why}; time = {{ unit = {fits!r} }} says so")
        return unit
