"""Files of measuring systems: ASAM MDF by asammdf, TDMS by npTDMS."""

from __future__ import annotations

import gc
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs.recordings._gate import Gate
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected, numbers_of

_SILENCE = threading.Lock()
"""Only one file at a time is opened without what Python says of failing destructors."""


def read_mdf(path: Path, form: TextFormat) -> Log:
    """Read an ASAM measurement file (``.mf4``, ``.mdf``, ``.dat`` of that kind).

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Not used.

    Returns
    -------
    Log
        Physical values with their units; those of one group share a clock. Samples marked invalid
        are NaN. A channel that is in several groups is called ``group/channel``.
    """
    found: list[Series] = []
    unread: dict[str, str] = {}
    file: Any
    gate = Gate(path)
    with _opened(path) as file:
        for group in file.groups:
            gate.admit(group.channel_group.cycles_nr, len(group.channels))
        for number, group in enumerate(file.groups):
            master = file.masters_db.get(number)
            time: Array | None = None
            called = getattr(group.channel_group, "acq_name", "") or f"group {number + 1}"
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                signal = file.get(group=number, index=index, ignore_invalidation_bits=True)
                values = numbers_of(signal.samples)
                if values is None:  # a table of texts stands behind the numbers
                    signal = file.get(group=number, index=index, raw=True)
                    values = numbers_of(signal.samples)
                if values is None or len(values) != len(signal.timestamps):
                    unread[channel.name] = "it holds no vector of numbers"
                    continue
                invalid = signal.invalidation_bits
                if invalid is not None:
                    values[np.asarray(invalid, dtype=bool)] = np.nan
                if master is not None and time is None:
                    time = np.asarray(signal.timestamps, dtype=np.float64)
                several = len(file.channels_db.get(channel.name, ())) > 1
                prefix = f"{called}/" if several else ""
                found.append(Series(prefix + channel.name, values, signal.unit or "", time))
    return collected(path, found, unread)


def _opened(path: Path) -> Any:
    """A measurement file. Of a broken one asammdf fails once more as its half-read object is freed,
    with a traceback that nothing can catch: it is freed here, in silence.
    """
    from asammdf import MDF

    reason = ""
    with _SILENCE:
        hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
        try:
            return MDF(path)
        except Exception as error:
            reason = str(error) or type(error).__name__
        finally:
            if reason:
                gc.collect()
            sys.unraisablehook = hook
    raise ValueError(reason)  # the reader of every format says of which file


def read_tdms(path: Path, form: TextFormat) -> Log:
    """Read a TDMS file of LabVIEW.

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Not used.

    Returns
    -------
    Log
        ``group/channel``, scaled as the file says; waveforms have their clocks, which begin at the
        earliest start of any.
    """
    from nptdms import TdmsFile

    found: list[Series] = []
    unread: dict[str, str] = {}
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        gate = Gate(path)
        for channel in channels:
            gate.admit(len(channel))
        starts = [item for channel in channels if (item := _start(channel)) is not None]
        clocks: dict[tuple[float, ...], Array] = {}
        for channel in channels:
            name = f"{channel.group_name}/{channel.name}"
            values = numbers_of(channel[:]) if len(channel) else None
            if values is None:
                unread[name] = "it holds no numbers"
                continue
            unit = channel.properties.get("unit_string") or channel.properties.get(
                "NI_UnitDescription"
            )
            time = _waveform_clock(channel, len(values), min(starts, default=0.0), clocks)
            found.append(Series(name, values, str(unit or ""), time))
    return collected(path, found, unread)


def _start(channel: Any) -> float | None:
    start = channel.properties.get("wf_start_time")
    if start is None or "wf_increment" not in channel.properties:
        return None
    return float(np.datetime64(start, "us").astype(np.int64)) * 1e-6


def _waveform_clock(
    channel: Any, count: int, first: float, clocks: dict[tuple[float, ...], Array]
) -> Array | None:
    """Times of a waveform; waveforms with the same clock share one array."""
    step = channel.properties.get("wf_increment")
    if step is None or not float(step) > 0.0:
        return None
    start = _start(channel)
    begin = float(channel.properties.get("wf_start_offset") or 0.0)
    begin += 0.0 if start is None else start - first
    key = (float(step), begin, float(count))
    if key not in clocks:
        clocks[key] = begin + float(step) * np.arange(count, dtype=np.float64)
    return clocks[key]
