"""Recordings out of a log as it was written: channels by a mapping, parts of one file."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import CHANNELS, channel_of
from pamrs.errors import ParameterError, RecordingError
from pamrs.recordings._case_keys import ROLES
from pamrs.recordings._doubts import made_gauge
from pamrs.recordings._mapping import Clock, Source, read_clock, read_sources
from pamrs.recordings._recording import Issue, Recording
from pamrs.recordings._several_clocks import Sampled, recording_of, sampled
from pamrs.recordings._splitting import Cut, Split, parts, read_split
from pamrs.recordings._stamps import Ticks, counted_on, ticks, unit_of_stamps
from pamrs.recordings.logs import Log, Series, TextFormat, read_log, switched, understood_unit
from pamrs.recordings.table import stem_of
from pamrs.units import same_dimension, to_si


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

    Returns
    -------
    list of Recording

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
    cut = read_split(split, source)
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

    Returns
    -------
    Recording
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

    Returns
    -------
    list of Recording

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
        made = [recording_of(name, role, channels, source, sample_time, said)]
        return _with_remarks(made, log, channels, [])
    column = None
    if cut.column is not None:
        series = log.find(cut.column)
        ticks = clocks.of(series, clock)
        column = Split(series.values[ticks.rows], ticks, series.labels)
    found, left, remarks = parts(channels, cut, column, pieces, source)
    made = [
        recording_of(f"{name}_{part.label}", role, part.channels, source, sample_time, said)
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

        Parameters
        ----------
        series : Series
            Of the log.
        clock : Clock
            Where its times are.

        Returns
        -------
        Ticks

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
        """Times of a series [s], and what else stands in the rows."""
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
