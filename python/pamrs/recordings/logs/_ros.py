"""ROS bags by rosbags, MCAP by mcap: the numbers of every message, by topic and field."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import RecordingError
from pamrs.recordings.logs._log import Array, Log, Series, TextFormat, collected

__all__ = ["read_bag", "read_mcap"]

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

    Parameters
    ----------
    path : Path
        The folder or file.
    form : TextFormat
        Not used.

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
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    unread: dict[str, str] = {}

    def messages(reader: Any) -> _Messages:
        known = set(reader.typestore.fielddefs)
        for connection in reader.connections:
            if connection.msgtype not in known:
                unread[connection.topic] = (
                    f"its type {connection.msgtype} is not defined in the bag"
                )
        usable = [item for item in reader.connections if item.msgtype in known]
        for connection, stamp, raw in reader.messages(connections=usable) if usable else ():
            yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)

    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        return _collected(path, messages(reader), unread)


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

    Parameters
    ----------
    path : Path
        The file.
    form : TextFormat
        Not used.

    Returns
    -------
    Log
        ``/topic/field/part``; an element of an array is ``field[2]``, or ``field[elbow]`` where
        the message names its elements. Times are the stamps in the messages, where all messages
        of a topic have one, else those at which they were logged, from the first one on; what
        their delay is is said, and ``/topic/arrival`` has the times of arrival.
    """
    from mcap.reader import make_reader

    unread: dict[str, str] = {}

    def messages(stream: Any) -> _Messages:
        factories: dict[str, Any] = {}
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.message_encoding == "json":
                yield channel.topic, message.log_time, json.loads(message.data)
                continue
            kind = channel.message_encoding
            if kind not in factories:
                factories[kind] = _decoders(kind)
            decode = factories[kind] and factories[kind].decoder_for(kind, schema)
            if decode is None:
                unread[channel.topic] = (
                    f"messages encoded as {channel.message_encoding!r} are not read"
                )
            else:
                yield channel.topic, message.log_time, decode(message.data)

    with path.open("rb") as stream:
        return _collected(path, messages(stream), unread)


def _decoders(encoding: str) -> Any:
    """What decodes messages of an encoding; None where nothing does."""
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

    def take(self, name: str, arrived: int, message: Any) -> None:
        """Take the numbers of one message."""
        for inner, value in _numbers(name, message, 0):
            self.rows.setdefault(inner, []).append(len(self.arrived))
            self.values.setdefault(inner, []).append(value)
        self.arrived.append(arrived)
        self.stamps.append(_stamp(message))

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
        told = (
            f"{name}: times are the stamps of its messages, which arrived {middle} ms later in the "
            f"middle ({low} to {high} ms); time = {{ column = '{name}/arrival' }} takes the arrival"
        )
        if abs(np.median(late)) > _OTHER_CLOCK:
            stamps += late.min()
            told += "; the stamps are of another clock, moved so that the least delay is 0"
        return stamps, told


def _collected(path: Path, messages: _Messages, unread: dict[str, str]) -> Log:
    topics: dict[str, _Topic] = {}
    for name, arrived, message in messages:
        topics.setdefault(name, _Topic()).take(name, arrived, message)
    topics = {name: topic for name, topic in topics.items() if topic.values}
    if not topics:
        why = "; ".join(f"{topic}: {text}" for topic, text in unread.items())
        raise RecordingError(f"{path}: no message with numbers was found ({why or 'it is empty'})")
    times = {name: topic.times(name) for name, topic in topics.items()}
    first = min(int(stamps.min()) for stamps, _ in times.values())
    remarks = [told for _, told in times.values() if told]
    if remarks:
        remarks += [
            f"{name}: no stamps, times are those of arrival"
            for name, topic in topics.items()
            if None in topic.stamps
        ]
    found: list[Series] = []
    for name, topic in topics.items():
        stamps, told = times[name]
        clock = _seconds(stamps - first)  # subtracted before they become floating numbers
        clocks = {tuple(range(len(clock))): clock}
        for inner, numbers in topic.values.items():
            rows = tuple(topic.rows[inner])
            own = clocks.setdefault(rows, clock[list(rows)])
            array = np.array(numbers, dtype=np.float64)
            array[~np.isfinite(array)] = np.nan
            found.append(Series(inner, array, _UNITS.get(inner.rpartition("/")[2], ""), own))
        if told:
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
        if part != "name" and _length(inside) == len(labels) > 0:
            for label, item in zip(labels, inside, strict=True):
                yield from _numbers(f"{inner}[{label}]", item, depth + 1)
        else:
            yield from _numbers(inner, inside, depth + 1)


def _length(value: Any) -> int:
    return len(value) if isinstance(value, (list, tuple, np.ndarray)) else -1


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
