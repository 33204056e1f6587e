"""Many recordings in one log: cut by a column, by pauses, or where the clock starts again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs.errors import RecordingError
from pamrs.recordings._clock import Array
from pamrs.recordings._several_clocks import Sampled

__all__ = ["Cut", "Part", "Split", "parts", "read_split"]

_ALLOWED: Final = "'clock', { gap = SECONDS } or { column = \"...\" }"
_FEWEST: Final = 2  # samples of a part; what is shorter is left out
_MOST: Final = 10_000


@dataclass(frozen=True)
class Cut:
    """How a log is parted: at pauses longer than `gap` [s], by a column, else by its clock."""

    gap: float | None = None
    column: str | None = None


class Split(NamedTuple):
    """The column that parts a log, its times [s], and its texts where it has texts."""

    values: Array
    time: Array
    labels: tuple[str, ...]


class Part(NamedTuple):
    """One recording of several: its number or text, and its channels."""

    label: str
    channels: list[Sampled]


def read_split(split: Any, source: str) -> Cut | None:
    """Read the key ``split`` of a recording.

    Parameters
    ----------
    split : str or mapping, optional
        ``"clock"``, ``{"gap": seconds}`` or ``{"column": name}``.
    source : str
        The file, for messages.

    Returns
    -------
    Cut or None

    Raises
    ------
    RecordingError
        If it is none of these.
    """
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
) -> list[Part]:
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
    list of Part
        In the order of the log; parts with fewer than two samples are left out.

    Raises
    ------
    RecordingError
        If there is nothing to cut, or no such piece.
    """
    reference = next((item for item in channels if not item.hold), channels[0])
    if column is not None:
        edges = np.flatnonzero(_differ(column.values)) + 1
        bounds = [0, *edges.tolist(), len(column.values)]
        labels = _labels(column, bounds)
        found = _cut(channels, column.time, bounds, labels)
    elif cut.gap is not None:
        edges = np.flatnonzero(np.diff(reference.time) > cut.gap) + 1
        bounds = [0, *edges.tolist(), len(reference.time)]
        found = _cut(channels, reference.time, bounds, _counted(len(bounds) - 1))
    else:
        found = _by_clock(channels, source)
    found = [
        part
        for part in found
        if all(len(item.time) >= _FEWEST or item.hold and len(item.time) for item in part.channels)
    ]
    if len(found) > _MOST:
        raise RecordingError(f"{source}: split gives {len(found)} parts; {_MOST} are allowed")
    if not found:
        raise RecordingError(f"{source}: split leaves no part in which every channel has samples")
    return found if pieces is None else _chosen(found, pieces, source)


def _differ(values: Array) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Where the next value is another one; NaN is equal to NaN."""
    both = np.isnan(values[1:]) & np.isnan(values[:-1])
    return np.asarray((values[1:] != values[:-1]) & ~both)


def _counted(count: int) -> list[str]:
    return [str(index + 1) for index in range(count)]


def _labels(column: Split, bounds: Sequence[int]) -> list[str]:
    """What the column says in each part; what it says again gets a number. Parts without a value
    have no label and are left out.
    """
    seen: dict[str, int] = {}
    labels: list[str] = []
    for start in bounds[:-1]:
        value = float(column.values[start])
        if math.isnan(value) or (column.labels and not column.labels[int(value)].strip()):
            labels.append("")
            continue
        text = column.labels[int(value)].strip() if column.labels else f"{value:.6g}"
        seen[text] = seen.get(text, 0) + 1
        labels.append(text if seen[text] == 1 else f"{text} ({seen[text]})")
    return labels


def _cut(
    channels: Sequence[Sampled], time: Array, bounds: Sequence[int], labels: Sequence[str]
) -> list[Part]:
    """Parts by rows where a channel has the clock that was cut, else by time."""
    found = []
    for start, stop, label in zip(bounds[:-1], bounds[1:], labels, strict=True):
        low = float(time[start])
        high = float(time[stop]) if stop < len(time) else math.inf
        inside: list[Sampled] = []
        for item in channels:
            if item.time is time or np.array_equal(item.time, time):
                inside.append(_rows(item, start, stop))
            else:
                first, last = (int(np.searchsorted(item.time, edge)) for edge in (low, high))
                inside.append(_rows(item, first - 1 if item.hold and first else first, last))
        if label:
            found.append(Part(label, inside))
    return found


def _rows(item: Sampled, start: int, stop: int) -> Sampled:
    return replace(item, values=item.values[start:stop], time=item.time[start:stop])


def _by_clock(channels: Sequence[Sampled], source: str) -> list[Part]:
    """Parts of rising time, each channel by its own clock."""
    resets = {item.name: np.flatnonzero(np.diff(item.time) < 0.0) + 1 for item in channels}
    counts = {name: len(edges) + 1 for name, edges in resets.items()}
    if len(set(counts.values())) > 1:
        said = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise RecordingError(
            f"{source}: split = 'clock': the clocks of the channels give different numbers of "
            f"parts ({said})"
        )
    edges = {item.name: [0, *resets[item.name].tolist(), len(item.time)] for item in channels}
    return [
        Part(
            str(index + 1),
            [_rows(item, *edges[item.name][index : index + 2]) for item in channels],
        )
        for index in range(next(iter(counts.values())))
    ]


def _chosen(found: list[Part], pieces: Sequence[int | str], source: str) -> list[Part]:
    kept: list[Part] = []
    labels = {part.label: part for part in found}
    for piece in pieces:
        number = isinstance(piece, int) and not isinstance(piece, bool)
        if number and 1 <= int(piece) <= len(found):
            kept.append(found[int(piece) - 1])
        elif isinstance(piece, str) and piece in labels:
            kept.append(labels[piece])
        else:
            some = ", ".join(repr(part.label) for part in found[:8])
            raise RecordingError(
                f"{source}: pieces = {list(pieces)!r}: there is no part {piece!r}; there are "
                f"{len(found)}, called {some}{' and so on' if len(found) > 8 else ''}"
            )
    return kept
