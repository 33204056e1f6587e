"""Dependence of a missing input on what was measured, by regressions that are judged on
stretches of time that they were not fitted to; and the sentence that says it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import channel_of
from pamrs.findings import MissingInput, MissingRecording, MissingTime, shown_unit
from pamrs.report.words import format_number, listed, spoken_name

_HATS = 8  # of a smooth function of one argument
_FOLDS = 4  # of stretches of time: each is told from the others
_STRETCHES = 12  # of each recording
_SMOOTHING_RIDGE = 1e-3  # of the rows' weight: what no row tells stays zero
_CLEARER = 0.05  # share of the square by which a less simple function must tell more
_LEAST_EXPLAINED = 0.4  # share of the square from which an argument explains the input
_TURN = 0.02  # of the fastest rate, below which a motion has no direction
# correlation from which a size grows or falls with an argument, and mean over mean size from which
# an input has one direction
_MOSTLY = 0.8
_OTHER_SIZE = 1.3  # ratio of sizes from which they are not the same
_EDGES = 100  # of the times in a recording at which an input may begin and end
_MUCH_LARGER = 3.0  # ratio of root mean squares from which it is there at some times alone
_LEAST_OF_SQUARE = 0.1  # share of its square in such a time
_MOST_OF_TIME = 0.6  # share of a recording up to which that is said
# share of the square that an argument leaves at least in such times, and by so many times more
# than there is at all others
_LEFT_BY_ARGUMENT, _MORE_THAN_OTHER_TIMES = 0.2, 5.0
_MOST_TIMES = 5  # of an input in all recordings
_FASTER = 1.4  # the same of the fastest third of a motion and the middle one

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _JoinedInput:
    """Missing input and its arguments, all recordings one after the other.

    Attributes
    ----------
    value, weight : (n,) array
        The input, and how much of what is known of it the recording tells (0 to 1).
    arguments : dict of str to (n,) array
        What was measured along it.
    fold : (n,) array
        To which stretches of time a row belongs.
    recording : (n,) array
        Its number.
    """

    value: Array
    weight: Array
    arguments: dict[str, Array]
    fold: NDArray[np.intp]
    recording: NDArray[np.intp]

    @classmethod
    def of(cls, recordings: Sequence[MissingRecording], names: Sequence[str]) -> _JoinedInput:
        """Rows of some recordings."""
        arguments = {
            n: np.concatenate([recording.along(n) for recording in recordings]) for n in names
        }
        value, std = (
            np.concatenate([getattr(recording, n) for recording in recordings])
            for n in ("value", "std")
        )
        widest = max(float(std.max()), 1e-300)
        weight = np.maximum(1.0 - (std / widest) ** 2, 0.0) + 1e-6
        folds = [
            (_STRETCHES * np.arange(recording.time.size) // max(1, recording.time.size) + k)
            % _FOLDS
            for k, recording in enumerate(recordings)
        ]
        which = np.repeat(
            np.arange(len(recordings)), [recording.time.size for recording in recordings]
        )
        return cls(value, weight, arguments, np.concatenate(folds), which)

    def fitted(self, columns: Array, rows: NDArray[np.bool_]) -> Array:
        """Fit a linear function of columns (n, k) to some rows; its values (n,) at all rows."""
        weighted = columns[rows] * self.weight[rows, None]
        ridge = _SMOOTHING_RIDGE * float(np.sum(self.weight[rows])) / columns.shape[1]
        normal = weighted.T @ columns[rows] + ridge * np.eye(columns.shape[1])
        values: Array = columns @ np.linalg.solve(normal, weighted.T @ self.value[rows])
        return values

    def share_predicted(self, columns: Array) -> float:
        """Share of the input's square that a function predicts in stretches not fitted to."""
        guess = np.empty_like(self.value)
        for k in range(_FOLDS):
            inside = self.fold == k
            guess[inside] = self.fitted(columns, ~inside)[inside]
        missed = float(self.weight @ (self.value - guess) ** 2)
        return 1.0 - missed / max(float(self.weight @ self.value**2), 1e-300)

    def mean(self, values: Array, rows: NDArray[np.bool_]) -> float:
        """Weighted mean of some rows."""
        return float(np.average(values[rows], weights=self.weight[rows]))

    def thirds(self, x: Array, rows: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
        """Rows with the lowest, the middle and the highest third of some values."""
        low, high = np.quantile(x[rows], (1.0 / 3.0, 2.0 / 3.0))
        return [rows & (x <= low), rows & (x > low) & (x < high), rows & (x >= high)]


def _hats(x: Array) -> Array:
    """A smooth function's columns (n, k): hats between quantiles."""
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, _HATS)))
    return np.stack([np.interp(x, knots, row) for row in np.eye(knots.size)], axis=1)


def _candidates(along: _JoinedInput, position: str, rate: str) -> dict[str, Array]:
    """Columns of a function of each argument, the simplest first."""
    fastest = max(float(np.quantile(np.abs(along.arguments[rate]), 0.95)), 1e-300)
    # the sign of the rate, smooth where it turns
    direction = np.tanh(along.arguments[rate] / (_TURN * fastest))
    columns = {"": np.ones((along.value.size, 1))}
    columns[rate] = direction[:, None] * _hats(np.abs(along.arguments[rate]))
    columns |= {n: _hats(x) for n, x in along.arguments.items() if n not in (rate, "time")}
    either = [
        _hats(along.arguments[position]) * (s * direction[:, None] > 0.0) for s in (1.0, -1.0)
    ]
    columns["strokes"] = np.hstack(either)
    each = [along.recording == k for k in range(along.recording[-1] + 1)]
    time = [
        _hats(np.where(inside, along.arguments["time"], 0.0)) * inside[:, None] for inside in each
    ]
    return columns | {"time": np.hstack(time)}


def times_of(recordings: Sequence[MissingRecording]) -> list[MissingTime]:
    """Times between which a missing input is much larger than at all others, the clearest first:
    edges under which its squares in and outside of them are the most probable ones of two normal
    distributions.
    """
    squares = [recording.value**2 for recording in recordings]
    free = [np.ones(square.size, dtype=bool) for square in squares]
    times = list[MissingTime]()
    while len(times) < _MOST_TIMES:
        each = [_clearest(k, squares, free) for k in range(len(recordings))]
        k = max(range(len(each)), key=lambda k: each[k][0])
        gain, (start, stop), ratio = each[k]
        if gain <= 0.0:
            break
        recording = recordings[k]
        times.append(
            MissingTime(
                recording.recording,
                float(recording.time[start]),
                float(recording.time[stop - 1]),
                ratio,
            )
        )
        free[k][start:stop] = False
    return times


def _clearest(
    k: int, squares: Sequence[Array], free: Sequence[NDArray[np.bool_]]
) -> tuple[float, tuple[int, int], float]:
    """Rows of one recording between which the squares differ most from what they are elsewhere:
    gain in log likelihood, zero where they are not much larger there; first row and one past the
    last; ratio of the roots of their means.
    """
    power, count = (
        np.concatenate([[0.0], np.cumsum(part)]) for part in (squares[k] * free[k], free[k])
    )
    parts = [square[part] for square, part in zip(squares, free, strict=True)]
    all_power = math.fsum(float(np.sum(part)) for part in parts)
    all_count = float(sum(part.size for part in parts))
    whole = math.fsum(float(np.sum(square)) for square in squares)
    edges = np.unique(np.linspace(0, squares[k].size, _EDGES + 1).astype(int))
    a, b = (edges[i] for i in np.triu_indices(edges.size, 1))
    inside, within = power[b] - power[a], count[b] - count[a]
    least = 1e-12 * all_power + 1e-300
    high = (inside + least) / np.maximum(within, 1.0)
    low = (all_power - inside + least) / np.maximum(all_count - within, 1.0)
    gain = all_count * np.log((all_power + least) / all_count)
    gain = gain - within * np.log(high) - (all_count - within) * np.log(low)
    clear = (high > _MUCH_LARGER**2 * low) & (b - a < _MOST_OF_TIME * squares[k].size)
    clear &= (within == b - a) & (inside > _LEAST_OF_SQUARE * whole)
    best = int(np.argmax(np.where(clear, gain, 0.0)))
    rows = int(a[best]), int(b[best])
    return float(gain[best] * clear[best]), rows, math.sqrt(float(high[best] / low[best]))


def with_words(missing: MissingInput) -> MissingInput:
    """Describe what a missing input depends on, and when it acts if that is at some times alone.

    Returns
    -------
    MissingInput
        With ``argument``, ``explained``, ``sentence`` and ``times``.
    """
    argument, share, sentence = _explained(missing)
    times = [] if 1.0 - share < _LEFT_BY_ARGUMENT else times_of(missing.recordings)
    inside = [
        _during(recording, t)
        for recording in missing.recordings
        for t in times
        if t.recording == recording.recording
    ]
    whole, during = (
        math.fsum(float(np.sum(recording.value**2)) for recording in part)
        for part in (missing.recordings, inside)
    )
    if not times or 1.0 - share < _MORE_THAN_OTHER_TIMES * (1.0 - during / whole):
        return replace(missing, argument=argument, explained=share, sentence=sentence)
    _, _, sentence = _explained(replace(missing, recordings=inside))
    spans = [f"from {t.start:.1f} to {t.stop:.1f} s of {t.recording}" for t in times]
    ratio = format_number(times[0].ratio, 2)
    sentence += f", {listed(spans)}: {ratio} times as much as at other times"
    return replace(
        missing, argument="time", explained=during / whole, sentence=sentence, times=times
    )


def _during(recording: MissingRecording, time: MissingTime) -> MissingRecording:
    """The part of a recording between the ends of a time."""
    rows = (recording.time >= time.start) & (recording.time <= time.stop)
    return recording.each(lambda values: values[rows])


def _explained(missing: MissingInput) -> tuple[str, float, str]:
    """Argument that explains most of an input (``time`` for a steady one, empty where no single one
    does), the share of its square that a function of it explains, cross-validated, and a sentence.
    """
    along = _JoinedInput.of(missing.recordings, [*missing.units])
    candidates = _candidates(along, missing.position, missing.rate)
    shares = {name: along.share_predicted(columns) for name, columns in candidates.items()}
    best = max(shares.values())
    name = next(n for n, share in shares.items() if share > best - _CLEARER)
    if best < _LEAST_EXPLAINED:
        size = _shown(along.mean(np.abs(along.value), along.weight > 0.0), missing.unit)
        named = _share_of_names(missing, along)
        return "", max(0.0, best), f"{size}{named or ', and no single argument explains it'}"
    columns = candidates[name]
    others = [n for n in missing.units if n not in (name, "time", missing.rate)]
    others = [n for n in others if not (name == "strokes" and n == missing.position)]
    deeper = {
        n: along.share_predicted(
            np.hstack([columns, columns * _scaled(along.arguments[n])[:, None]])
        )
        for n in others
    }
    second = max(deeper, key=lambda n: deeper[n], default="")
    if second and deeper[second] < shares[name] + _CLEARER:
        second = ""
    sentence = _sentence(missing, along, name, along.fitted(columns, along.weight > 0.0))
    if second:
        sentence += _on_second_argument(missing, along, name, second)
    argument = {"": "time", "strokes": missing.position}.get(name, name)
    return argument, min(1.0, max(shares[name], 0.0)), sentence + _share_of_names(missing, along)


def _share_of_names(missing: MissingInput, along: _JoinedInput) -> str:
    """Words on the share of an input's square that named effects take; empty where it is small."""
    laws = [recording.law for recording in missing.recordings if recording.law is not None]
    if len(laws) < len(missing.recordings):
        return ""
    rest, whole = (along.value - np.concatenate(laws)) ** 2, along.value**2
    share = 1.0 - float(along.weight @ rest) / max(float(along.weight @ whole), 1e-300)
    return f", of which {100.0 * share:.0f} % is what is named" if share > _LEAST_EXPLAINED else ""


def _scaled(x: Array) -> Array:
    """An argument with mean 0 and standard deviation 1."""
    centred: Array = (x - x.mean()) / max(float(x.std()), 1e-300)
    return centred


def _shown(value: float, unit: str) -> str:
    """A size of the input, or a value of an argument, in the unit that people read."""
    name, factor = shown_unit(unit)
    return f"{format_number(factor * value, 2)} {name}"


def _sense(missing: MissingInput, mean: float) -> str:
    """Direction of an input of one sign, in words."""
    noun = spoken_name(missing.block)
    if missing.unit == "kg/s" and channel_of(missing.block) != "flow":
        return f" into the {noun}" if mean > 0.0 else f" out of the {noun}"
    more = "larger" if mean > 0.0 else "smaller"
    return f" towards a {more} {spoken_name(missing.position)}"


def _sentence(missing: MissingInput, along: _JoinedInput, name: str, fit: Array) -> str:
    """Sentence on the input as a function of one argument."""
    rate = along.arguments[missing.rate]
    every = along.weight > 0.0
    if name == missing.rate:
        moving = np.abs(rate) > np.median(np.abs(rate))
        against = along.mean(fit * np.sign(rate), moving) < 0.0
        size_in_words = _shown(along.mean(np.abs(fit), moving), missing.unit)
        _, middle, fast = (
            along.mean(np.abs(fit), rows) if rows.any() else 0.0
            for rows in along.thirds(np.abs(rate), every)
        )
        growing = ", growing with the rate" if fast > _FASTER * middle else ""
        if channel_of(missing.block) in ("arm", "load"):
            return f"{size_in_words} {'against' if against else 'with'} the motion{growing}"
        ways = ("falls", "grows")[:: 1 if against else -1]
        noun = spoken_name(missing.position)
        return f"{size_in_words} more while the {noun} {ways[0]}, less while it {ways[1]}{growing}"
    mean, size = along.mean(fit, every), along.mean(np.abs(fit), every)
    sided = abs(mean) > _MOSTLY * size
    size_in_words = _shown(size, missing.unit) + (_sense(missing, mean) if sided else "")
    if not name:
        return f"{size_in_words}, steadily"
    if name == "strokes":
        noun = spoken_name(missing.position)
        return f"{size_in_words}, depending on the {noun} and on the direction of its stroke"
    noun, x = ("time" if name == "time" else spoken_name(name)), along.arguments[name]
    trend = float(np.corrcoef(np.abs(fit) if sided else fit, x)[0, 1])
    if name == "time" or abs(trend) < _MOSTLY:
        return f"{size_in_words}, depending on the {noun}"
    return f"{size_in_words}, {'growing' if trend > 0.0 else 'falling'} with the {noun}"


def _on_second_argument(missing: MissingInput, along: _JoinedInput, name: str, second: str) -> str:
    """Dependence of the input's size on a second argument, in words."""
    rate = np.abs(along.arguments[missing.rate])
    rows = rate > np.median(rate) if name == missing.rate else along.weight > 0.0
    low, _, high = along.thirds(along.arguments[second], rows)
    sizes = [along.mean(np.abs(along.value), part) for part in (low, high)]
    places = [along.mean(along.arguments[second], part) for part in (low, high)]
    if max(sizes) < _OTHER_SIZE * min(sizes):
        return f", other at another {spoken_name(second)}"
    larger = int(sizes[1] > sizes[0])
    ratio = sizes[larger] / max(sizes[1 - larger], 1e-300)
    times = "twice" if 1.75 < ratio < 2.25 else f"{format_number(ratio, 2)} times"
    at_larger, at_smaller = (
        _shown(place, missing.units[second]) for place in (places[larger], places[1 - larger])
    )
    return f", {times} as large at a {spoken_name(second)} of {at_larger} as of {at_smaller}"
