"""Recordings out of a log as it was written: channels by a mapping, parts of one file."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs.channels import channel_of
from pamrs.errors import ParameterError, RecordingError
from pamrs.recordings._clock import Array
from pamrs.recordings._mapping import Clock, Source, read_clock, read_sources
from pamrs.recordings._recording import CHANNELS, Recording, assemble
from pamrs.recordings._several_clocks import Sampled, on_one_clock
from pamrs.recordings._splitting import Cut, Split, parts, read_split
from pamrs.recordings.logs import Log, TextFormat, read_log, understood_unit
from pamrs.units import parse_unit, same_dimension, to_si

__all__ = ["load_recordings", "recordings_of"]

_ROLES: Final = ("fit", "held_out")


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
) -> list[Recording]:
    """Read recordings out of a log that stays as it is.

    Parameters
    ----------
    path : path-like
        Any log that :func:`pamrs.recordings.logs.read_log` reads.
    channels : mapping
        From channels to where they are: ``{"muscle_pressure": {"column": "AI/p1", "unit": "bar",
        "scale": 2.5}}``. Values are ``scale * raw + offset`` in ``unit``, or on the line through
        two readings (``"from": [0, 4095], "to": [0, 10]``); ``time`` is a clock of the channel
        alone, ``hold`` says that it was logged on change.
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
    if role not in _ROLES:
        raise RecordingError(f"{source}: role = {role!r} is not allowed: 'fit' or 'held_out'")
    if sample_time is not None and not (math.isfinite(sample_time) and sample_time > 0.0):
        raise RecordingError(
            f"{source}: sample_time = {sample_time!r} s is not allowed: a positive number is needed"
        )
    sources = read_sources(channels, source)
    clock = read_clock(time, source)
    cut = read_split(split, source)
    content = log or read_log(file, form)
    stem = re.sub(r"\.[^.]*$", "", file.name.removesuffix(".gz"))
    found = recordings_of(content, sources, clock, name or stem, role, sample_time, cut, pieces)
    said = {item.channel: item.unit for item in sources}
    return [
        replace(recording, source=source, said=said).between(start, stop) for recording in found
    ]


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
    channels = [_sampled(log, item, item.clock or clock, sample_time) for item in sources]
    said = {item.channel: item.unit for item in sources}
    if cut is None:
        if pieces is not None:
            raise RecordingError(f"{source}: pieces = {list(pieces)!r} needs split")
        return [_recording(name, role, channels, source, sample_time, said)]
    column = None
    if cut.column is not None:
        series = log.find(cut.column)
        times = _times(log, series.name, clock, sample_time)
        column = Split(series.values, times, series.labels)
    found: list[Recording] = []
    for part in parts(channels, cut, column, pieces, source):
        label = f"{name}_{part.label}"
        found.append(_recording(label, role, part.channels, source, sample_time, said))
    return found


def _recording(
    name: str,
    role: str,
    channels: Sequence[Sampled],
    source: str,
    sample_time: float | None,
    said: Mapping[str, str],
) -> Recording:
    first = channels[0].time
    alike = all(
        channel.time is first or np.array_equal(channel.time, first) for channel in channels
    )
    if not alike or any(channel.hold for channel in channels):
        return on_one_clock(name, role, channels, source, sample_time)
    raw = {channel.name: channel.values for channel in channels}
    units = {channel.name: channel.unit for channel in channels}
    return assemble(name, role, {"time": first, **raw}, units, [], source, sample_time, said)


def _sampled(log: Log, item: Source, clock: Clock, sample_time: float | None) -> Sampled:
    """Values and times of one channel in SI; rows without a time are left out."""
    series = log.find(item.column)
    if series.labels:
        raise RecordingError(
            f"{log.path}: {item.column!r} holds texts like {series.labels[0]!r}, no numbers for "
            f"{item.channel!r}"
        )
    parsed = parse_unit(item.unit)
    values = (item.scale * series.values + item.offset) * parsed.scale + parsed.offset
    unit = CHANNELS[channel_of(item.channel)].unit
    if channel_of(item.channel) == "reference" and not same_dimension(item.unit, "rad"):
        unit = "Pa"
    time = _times(log, series.name, clock, sample_time)
    stamped = np.isfinite(time)
    if not stamped.any():
        raise RecordingError(f"{log.path}: {item.column!r} has no time at all")
    if not stamped.all():
        values, time = values[stamped], time[stamped]
    return Sampled(item.channel, values, time, unit, item.hold)


def _times(log: Log, name: str, clock: Clock, sample_time: float | None) -> Array:
    """Times of a series [s]."""
    series = log.series[name]
    if clock.column is None:
        time = series.time
        if time is None and sample_time is not None:
            time = np.arange(len(series.values), dtype=np.float64) * sample_time
        if time is None:
            raise RecordingError(
                f"{log.path}: the log has no clock for {name!r}: say which channel holds the times "
                '(time = { column = "...", unit = "s" }), or sample_time if they are evenly spaced'
            )
        return time + clock.offset if clock.offset else time
    stamps = log.find(clock.column)
    if len(stamps.values) != len(series.values):
        raise RecordingError(
            f"{log.path}: {name!r} has {len(series.values)} values, but its times "
            f"{stamps.name!r} are {len(stamps.values)}"
        )
    known = understood_unit(stamps.unit)
    unit = clock.unit or (known.unit if known else "s")
    try:
        factor = to_si(1.0, unit, "time")
    except ParameterError as error:
        raise RecordingError(f"{log.path}: the times {stamps.name!r}: {error}") from error
    if factor == 1.0 and not clock.offset:
        return stamps.values
    return stamps.values * factor + clock.offset
