"""ROS bags by rosbags, MCAP by mcap: the numbers of every message, by topic and field."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs.errors import RecordingError
from pamrs.recordings.logs._log import Log, Series, TextFormat, collected

__all__ = ["read_bag", "read_mcap"]

_MOST_ELEMENTS: Final = 64  # of an array in a message; longer ones are images and the like
_DEEPEST: Final = 8
_OF_ADDRESSES: Final = frozenset("%?#")  # rosbags opens a bag by an address, which SQLite decodes

_Messages = Iterable[tuple[str, int, Any]]


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
        the message names its elements. Times are those at which the messages were logged, from the
        first one on; the stamps in the messages are channels of their own.
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


def _collected(path: Path, messages: _Messages, unread: dict[str, str]) -> Log:
    stamps: dict[str, list[int]] = {}
    values: dict[str, list[float]] = {}
    for topic, stamp, message in messages:
        for name, value in _numbers(topic, message, 0):
            stamps.setdefault(name, []).append(stamp)
            values.setdefault(name, []).append(value)
    if not stamps:
        why = "; ".join(f"{topic}: {text}" for topic, text in unread.items())
        raise RecordingError(f"{path}: no message with numbers was found ({why or 'it is empty'})")
    first = min(min(times) for times in stamps.values())
    clocks: dict[tuple[int, ...], Any] = {}
    found: list[Series] = []
    for name, numbers in values.items():
        key = tuple(stamps[name])
        if key not in clocks:  # nanoseconds are subtracted before they become floating numbers
            clocks[key] = (np.array(key, dtype=np.int64) - first) * 1e-9
        order = np.argsort(clocks[key], kind="stable")
        array = np.array(numbers, dtype=np.float64)
        array[~np.isfinite(array)] = np.nan
        unit = "s" if name.endswith("/stamp") else ""
        found.append(Series(name, array[order], unit, clocks[key][order]))
    return collected(path, found, unread)


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
    for whole, part in (("sec", "nanosec"), ("seconds", "nanos")):  # of ROS, of Protobuf
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
