"""Many recordings in one log: cut by a column, by pauses, or where the clock starts again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs.errors import RecordingError
from pamrs.recordings._several_clocks import Sampled
from pamrs.recordings._stamps import Ticks

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
