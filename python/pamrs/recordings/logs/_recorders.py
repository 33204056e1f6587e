"""Files of recorders: ASAM MDF by asammdf, TDMS by npTDMS, ROS bags by rosbags, MCAP by mcap."""

from __future__ import annotations

import gc
import io
import json
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array
from pamrs._files import MOST_BYTES, check_regular, read_file
from pamrs.errors import RecordingError
from pamrs.recordings._gate import Gate, Unpacking, check_size
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected, numbers_of

_SILENCE = threading.Lock()
"""Only one file at a time is opened without what Python says of failing destructors."""


def read_mdf(path: Path, form: TextFormat) -> Log:
    """Read an ASAM measurement file (``.mf4``, ``.mdf``, ``.dat`` of that kind).

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
                if values is None:  # a table of texts comes after the numbers
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


_MOST_ELEMENTS: Final = 64  # of an array in a message; longer ones are images and the like
_DEEPEST: Final = 8
_SECONDS: Final = (("sec", "nanosec"), ("secs", "nsecs"), ("seconds", "nanos"))
_OTHER_CLOCK: Final = 1e9  # ns between stamp and arrival that no network takes
_OF_ADDRESSES: Final = frozenset("%?#")  # rosbags opens a bag by an address, which SQLite decodes

#: Units of fields by the definition of their messages: ``sensor_msgs/FluidPressure`` is absolute.
_UNITS: Final = {"stamp": "s", "fluid_pressure": "Pa(a)"}

_Messages = Iterable[tuple[str, int, Any]]
Times = NDArray[np.int64]


def read_bag(path: Path, form: TextFormat) -> Log:
    """Read a bag of ROS 2 (its folder, or its ``.db3``) or of ROS 1 (``.bag``).

    Returns
    -------
    Log
        As :func:`read_mcap`.

    Raises
    ------
    RecordingError
        If the path of a bag of ROS 2, or a name in its folder, has a mark by which SQLite would
        read another file, or if no message has numbers.
    """
    _check_names(path)
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    unpacked = Unpacking(path, sum(file.stat().st_size for file in files))
    unread: dict[str, str] = {}
    if any(".mcap" in file.suffixes for file in files):
        return _collected(path, _of_files(files, unpacked, unread), unread)
    for file in files:  # before rosbags unpacks it into a folder of its own
        if file.suffix == ".zstd":
            unpacked(read_file(file), MOST_BYTES)
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        return _collected(path, _bag_messages(reader, unpacked, unread), unread)


def _of_files(files: Iterable[Path], unpacked: Unpacking, unread: dict[str, str]) -> _Messages:
    """Messages of the MCAP files of a bag, of which each may be packed as a whole."""
    for file in files:
        if ".mcap" in file.suffixes:
            check_regular(file)
            packed = file.suffix == ".zstd"
            stream = (
                io.BytesIO(unpacked(read_file(file), MOST_BYTES)) if packed else file.open("rb")
            )
            with stream:
                yield from _mcap_messages(stream, unpacked, unread)


def _bag_messages(reader: Any, unpacked: Unpacking, unread: dict[str, str]) -> _Messages:
    """Messages that rosbags reads, with what is packed unpacked here."""
    known = set(reader.typestore.fielddefs)
    for connection in reader.connections:
        if connection.msgtype not in known:
            unread[connection.topic] = f"its type {connection.msgtype} is not defined in the bag"
    usable = [item for item in reader.connections if item.msgtype in known]
    single = False
    for one in reader.readers:
        chunks = getattr(one, "chunks", {})  # of ROS 1
        for at, chunk in chunks.items():
            chunks[at] = chunk._replace(decompressor=unpacked)
        storage = getattr(one, "storage", None)  # of ROS 2
        if storage is not None and storage.metadata.compression_mode == "message":
            storage.metadata, single = storage.metadata._replace(compression_mode=None), True
    for connection, stamp, raw in reader.messages(connections=usable) if usable else ():
        data = unpacked(bytes(raw)) if single else raw
        yield connection.topic, stamp, reader.deserialize(data, connection.msgtype)


def _check_names(path: Path) -> None:
    """Refuse a bag of ROS 2 by whose names SQLite would read another file: ``..%2fother.db3``."""
    if path.suffix == ".bag":  # of ROS 1, no SQLite
        return
    inside = (name for _, *names in os.walk(path) for name in sum(names, []))
    wrong = next((name for name in (str(path), *inside) if _OF_ADDRESSES & set(name)), None)
    if wrong is not None:
        raise RecordingError(
            f"{path}: {wrong!r}: names with %, ? or # are not read from bags (SQLite would read "
            "another file); rename it"
        )


def read_mcap(path: Path, form: TextFormat) -> Log:
    """Read an MCAP file with messages of ROS 2, of Protobuf, or in JSON.

    Returns
    -------
    Log
        ``/topic/field/part``; an element of an array is ``field[2]``, or ``field[elbow]`` where
        the message names its elements. Times are the stamps in the messages, where all messages
        of a topic have one, else those at which they were logged, from the first one on; what
        their delay is is said, and ``/topic/arrival`` has the times of arrival.
    """
    unread: dict[str, str] = {}
    unpacked = Unpacking(path, path.stat().st_size)
    with path.open("rb") as stream:
        return _collected(path, _mcap_messages(stream, unpacked, unread), unread)


def _mcap_messages(stream: Any, unpacked: Unpacking, unread: dict[str, str]) -> _Messages:
    """Messages of an MCAP file in the order of the file."""
    from mcap.records import Channel, Chunk, Message, Schema
    from mcap.stream_reader import StreamReader, breakup_chunk

    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    factories: dict[str, Any] = {}
    for record in StreamReader(stream, emit_chunks=True).records:
        inside = [record]
        if isinstance(record, Chunk):
            data = unpacked(record.data) if record.compression else record.data
            inside = breakup_chunk(replace(record, compression="", data=data))
        for part in inside:
            if isinstance(part, Schema):
                schemas[part.id] = part
            elif isinstance(part, Channel):
                channels[part.id] = part
            if not isinstance(part, Message):
                continue
            channel = channels[part.channel_id]
            kind = channel.message_encoding
            if kind == "json":
                yield channel.topic, part.log_time, json.loads(part.data)
                continue
            if kind not in factories:
                factories[kind] = _decoders(kind)
            schema = schemas.get(channel.schema_id)
            decode = factories[kind] and factories[kind].decoder_for(kind, schema)
            if decode is None:
                unread[channel.topic] = f"messages encoded as {kind!r} are not read"
            else:
                yield channel.topic, part.log_time, decode(part.data)


def _decoders(encoding: str) -> Any:
    """Decoder factory of an encoding of MCAP messages; None for an encoding that has none."""
    if encoding == "cdr":
        from mcap_ros2.decoder import DecoderFactory as Ros

        return Ros()
    if encoding == "protobuf":
        from mcap_protobuf.decoder import DecoderFactory as Protobuf

        return Protobuf()
    return None


class _Topic:
    """The messages of a topic: when they arrived, which stamps they have, and their numbers."""

    def __init__(self) -> None:
        self.arrived: list[int] = []
        self.stamps: list[int | None] = []
        self.rows: dict[str, list[int]] = {}
        self.values: dict[str, list[float]] = {}

    def take(self, name: str, arrived: int, message: Any) -> int:
        """Take the numbers of one message; how many there are."""
        count = 0
        for inner, value in _numbers(name, message, 0):
            self.rows.setdefault(inner, []).append(len(self.arrived))
            self.values.setdefault(inner, []).append(value)
            count += 1
        self.arrived.append(arrived)
        self.stamps.append(_stamp(message))
        return count

    def sort(self) -> None:
        """Put the messages in the order in which they arrived."""
        order = np.argsort(self.arrived, kind="stable")
        if np.all(np.diff(order) > 0):
            return
        self.arrived = [self.arrived[row] for row in order]
        self.stamps = [self.stamps[row] for row in order]
        place = np.argsort(order)
        for name, rows in self.rows.items():
            now = place[rows]
            inner = np.argsort(now)
            self.rows[name] = now[inner].tolist()
            self.values[name] = [self.values[name][row] for row in inner]

    def times(self, name: str) -> tuple[Times, str]:
        """Nanoseconds of the messages: their stamps, else their arrival; and what is to be said."""
        arrived = np.array(self.arrived, dtype=np.int64)
        if any(stamp is None for stamp in self.stamps):
            return arrived, ""
        stamps = np.array(self.stamps, dtype=np.int64)
        late = arrived - stamps
        if np.all(late == 0):
            return arrived, ""
        low, middle, high = (f"{1e-6 * x:.4g}" for x in (late.min(), np.median(late), late.max()))
        remark = (
            f"{name}: times are the stamps of its messages, which arrived {middle} ms later in the "
            f"middle ({low} to {high} ms); time = {{ column = '{name}/arrival' }} takes the arrival"
        )
        if abs(np.median(late)) > _OTHER_CLOCK:
            stamps += late.min()
            remark += "; the stamps are of another clock, moved so that the least delay is 0"
        return stamps, remark


def _collected(path: Path, messages: _Messages, unread: dict[str, str]) -> Log:
    topics: dict[str, _Topic] = {}
    cells = 0
    for name, arrived, message in messages:
        topic = topics.setdefault(name, _Topic())
        cells += topic.take(name, arrived, message)
        check_size(len(topic.arrived), cells, str(path))
    for topic in topics.values():
        topic.sort()
    topics = {name: topic for name, topic in topics.items() if topic.values}
    if not topics:
        why = "; ".join(f"{topic}: {text}" for topic, text in unread.items())
        raise RecordingError(f"{path}: no message with numbers was found ({why or 'it is empty'})")
    times = {name: topic.times(name) for name, topic in topics.items()}
    first = min(int(stamps.min()) for stamps, _ in times.values())
    remarks = [remark for _, remark in times.values() if remark]
    if remarks:
        remarks += [
            f"{name}: no stamps, times are those of arrival"
            for name, topic in topics.items()
            if None in topic.stamps
        ]
    found: list[Series] = []
    for name, topic in topics.items():
        stamps, remark = times[name]
        clock = _seconds(stamps - first)  # subtracted before they become floating numbers
        clocks = {tuple(range(len(clock))): clock}
        for inner, numbers in topic.values.items():
            rows = tuple(topic.rows[inner])
            own = clocks.setdefault(rows, clock[list(rows)])
            array = np.array(numbers, dtype=np.float64)
            array[~np.isfinite(array)] = np.nan
            found.append(Series(inner, array, _UNITS.get(inner.rpartition("/")[2], ""), own))
        if remark:
            arrival = _seconds(np.array(topic.arrived, dtype=np.int64) - first)
            found.append(Series(f"{name}/arrival", arrival, "s", clock))
    return collected(path, found, unread, remarks)


def _seconds(times: Times) -> Array:
    return np.asarray(times * 1e-9, dtype=np.float64)


def _stamp(message: Any) -> int | None:
    """The stamp of a message [ns]: of its header, or its own; None where it has none."""
    fields = message if isinstance(message, dict) else _slots(message)
    for key in ("header", "stamp", "timestamp"):
        inside = fields.get(key)
        if inside is None or isinstance(inside, (str, bytes, int, float, list, tuple, np.ndarray)):
            continue
        inner = inside if isinstance(inside, dict) else _slots(inside)
        if key == "header":
            return _stamp({"stamp": inner["stamp"]}) if "stamp" in inner else None
        for whole, part in _SECONDS:
            if {whole, part} <= set(inner):
                stamp = int(inner[whole]) * 10**9 + int(inner[part])
                return stamp or None  # 0: it was not set
    return None


def _numbers(name: str, value: Any, depth: int) -> Iterator[tuple[str, float]]:
    """Names and values of all numbers in a message."""
    if isinstance(value, (bool, int, float, np.number, np.bool_)):
        yield name, float(value)
        return
    if depth > _DEEPEST or isinstance(value, (str, bytes)) or value is None:
        return
    if isinstance(value, (list, tuple, np.ndarray)):
        if len(value) <= _MOST_ELEMENTS:
            for index, item in enumerate(value):
                yield from _numbers(f"{name}[{index}]", item, depth + 1)
        return
    fields = value if isinstance(value, dict) else _slots(value)
    for whole, part in _SECONDS:
        if {whole, part} == set(fields):
            yield name, float(fields[whole]) + 1e-9 * float(fields[part])
            return
    labels = fields.get("name")
    if not isinstance(labels, (list, tuple)) or not all(isinstance(item, str) for item in labels):
        labels = ()
    for part, inside in fields.items():
        inner = f"{name}/{part}"
        listed = isinstance(inside, (list, tuple, np.ndarray)) and part != "name"
        if listed and len(inside) == len(labels) > 0:
            for label, item in zip(labels, inside, strict=True):
                yield from _numbers(f"{inner}[{label}]", item, depth + 1)
        else:
            yield from _numbers(inner, inside, depth + 1)


def _slots(message: Any) -> dict[str, Any]:
    descriptor = getattr(message, "DESCRIPTOR", None)
    if descriptor is not None:
        return {
            field.name: _field(getattr(message, field.name))
            for field in descriptor.fields
            if not field.has_presence or message.HasField(field.name)
        }
    names = getattr(message, "__slots__", None) or getattr(message, "__dict__", {})
    return {
        str(name): getattr(message, name)
        for name in names
        if not str(name).startswith("_") and hasattr(message, name)
    }


def _field(value: Any) -> Any:
    """A field of a Protobuf message: repeated ones as lists, maps as dictionaries."""
    if hasattr(value, "items"):
        return dict(value.items())
    return list(value) if hasattr(value, "append") else value
