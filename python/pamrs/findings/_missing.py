"""The missing input of a block: what its model would need to follow the recordings."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs._views import COLOURS, Panels, View
from pamrs.channels import read_in
from pamrs.findings._entry import OPTIONAL, Entry, to_plain

_POINTS = (24, 120)  # of a curve in a picture, and of one over time
_LETTERS = 76  # of a line above it
_ROOM = 0.25  # of the height of its bands, above and below them
_LEAST_IN_POINT = 4  # values that make one of them


@dataclass(frozen=True, eq=False)
class MissingRecording(Entry):
    """The missing input in one recording.

    Attributes
    ----------
    recording, role : str
        Its name; ``fit`` or ``held_out``.
    time : (n,) array
        [s].
    value, std : (n,) array
        The missing input and its standard deviation, in the unit of the whole.
    arguments : dict of str to (n,) array
        What was measured along it, by name, in ``units`` of the whole.
    noises_before, noises_after : float
        Root mean square of what the block misses without it and with it [noise levels].
    law : (n,) array, optional
        What of it the effects take that a diagnosis names.
    """

    recording: str
    role: str
    time: Array
    value: Array
    std: Array
    arguments: Mapping[str, Array]
    noises_before: float
    noises_after: float
    law: Array | None = field(default=None, metadata=OPTIONAL)

    def __post_init__(self) -> None:
        curves = {n: getattr(self, n) for n in ("time", "value", "std", "law")}
        for name, values in curves.items():
            if values is not None:
                object.__setattr__(self, name, np.asarray(values, dtype=np.float64))
        own = {n: np.asarray(v, dtype=np.float64) for n, v in self.arguments.items()}
        object.__setattr__(self, "arguments", own)

    def along(self, argument: str) -> Array:
        """An argument at each value (n,); the time by its name."""
        return self.time if argument == "time" else self.arguments[argument]

    def each(self, change: Callable[[Array], Array]) -> MissingRecording:
        """Copy with each of its curves changed: some of their points, or fewer digits."""
        return replace(
            self,
            time=change(self.time),
            value=change(self.value),
            std=change(self.std),
            arguments={n: change(v) for n, v in self.arguments.items()},
            law=None if self.law is None else change(self.law),
        )

    def thinned(self, most: int) -> MissingRecording:
        """Thin it to so many points at most, of six digits."""
        every = slice(None, None, max(1, -(-self.time.size // most)))
        return self.each(lambda v: np.array([float(f"{x:.6g}") for x in v[every]]))


@dataclass(frozen=True, eq=False)
class MissingTime(Entry):
    """A time at which a missing input is much larger than at others.

    Attributes
    ----------
    recording : str
        The recording.
    start, stop : float
        [s].
    ratio : float
        Its root mean square there over that everywhere else.
    """

    recording: str
    start: float
    stop: float
    ratio: float


@dataclass(frozen=True, eq=False, repr=False)
class MissingInput(View, Entry):
    """The input that a block's model would need to follow the recordings: a torque at a joint, a
    force at a load, a mass flow into a chamber or tank; elsewhere an error of the reading. It is
    positive where it makes what the block predicts larger.

    Attributes
    ----------
    block : str
        The block, as ``blocks`` of a diagnosis has it.
    unit : str
        Of the input: ``N m``, ``N``, ``kg/s``, or that of the reading; SI.
    sentence : str
        What it depends on, in words.
    argument : str
        What it depends on most: a name of ``units``; empty where no single one explains it.
    explained : float
        Share of the input's square that a function of that argument tells in stretches of time that
        it was not fitted to (0 to 1).
    share : float
        Share of the block's mismatch above the noise that the input explains (0 to 1).
    noises_before, noises_after : float
        Root mean square of what the block misses without it and with it, over all recordings [noise
        levels].
    position, rate : str
        Names of the arguments that are what the block predicts, and its rate; a stroke goes up
        where the rate is positive.
    units : dict of str to str
        SI unit of each argument.
    recordings : list of MissingRecording
        The input in each recording.
    times : list of MissingTime
        Times between which it is much larger than elsewhere, where nothing that was measured
        explains it; the clearest first.
    """

    block: str
    unit: str
    sentence: str
    argument: str
    explained: float
    share: float
    noises_before: float
    noises_after: float
    position: str
    rate: str
    units: dict[str, str]
    recordings: list[MissingRecording]
    times: list[MissingTime] = field(default_factory=list)

    def __repr__(self) -> str:
        return f"MissingInput({self.block!r}: {self.sentence})"

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON has it: a list for each array, null for no number."""
        found: dict[str, Any] = to_plain(self)
        return found

    def thinned(self, most: int) -> MissingInput:
        """Return the same with so many points of each recording at most.

        Parameters
        ----------
        most : int
            At least 1.
        """
        return replace(self, recordings=[own.thinned(most) for own in self.recordings])

    def _panels(self) -> Panels:
        return {"missing_input": partial(_draw, self)} if self.recordings else {}

    def _numbers(self) -> dict[str, str]:
        return {
            "block": self.block,
            "missing": self.sentence,
            "explains": f"{100 * self.share:.0f} % of the mismatch",
            "left": f"{self.noises_after:.3g} noise levels of {self.noises_before:.3g}",
        }


def shown_unit(unit: str) -> tuple[str, float]:
    """The unit that people read an input or an argument in, and the factor from SI."""
    if unit == "kg/s":
        return "g/s", 1e3
    whole, slash, second = unit.partition("/")
    name, factor = read_in(whole)
    return f"{name}{slash}{second}", factor


def _draw(missing: MissingInput, axes: Any) -> None:
    """Draw the input with its band over its argument, up and down strokes apart; without an
    argument over time, of the recording that has most of it.
    """
    argument, recordings = missing.argument or "time", missing.recordings
    if argument == "time":
        recordings = [max(recordings, key=lambda recording: float(np.mean(recording.value**2)))]
    unit, factor = shown_unit(missing.unit)
    of, scale = shown_unit(missing.units[argument])
    x = scale * np.concatenate([recording.along(argument) for recording in recordings])
    y, std = (
        factor * np.concatenate([getattr(recording, n) for recording in recordings])
        for n in ("value", "std")
    )
    up = np.concatenate([recording.arguments[missing.rate] for recording in recordings]) > 0.0
    laws = [recording.law for recording in recordings if recording.law is not None]
    law = factor * np.concatenate(laws) if len(laws) == len(recordings) else None
    both = [(up, "up stroke", COLOURS[0]), (~up, "down stroke", COLOURS[1])]
    strokes = [one for one in both if one[0].any()]
    for rows, _, colour in strokes:
        axes.plot(x[rows], y[rows], ".", color=colour, ms=3.0, alpha=0.4, rasterized=True)
    if argument == "time":
        strokes = [(np.ones_like(up), recordings[0].recording, "#6b7280")]
    ends = []
    for rows, name, colour in strokes:
        columns = (x[rows], y[rows], std[rows] ** 2, (y if law is None else law)[rows])
        places, middle, wide, named = _means(columns, _POINTS[argument == "time"])
        band = 2.0 * np.sqrt(wide)
        axes.fill_between(places, middle - band, middle + band, color=colour, alpha=0.25, lw=0.0)
        axes.plot(places, middle, color=colour, lw=1.4, label=name)
        every = np.concatenate([middle - band, middle + band, named])
        ends += [float(every.min()), float(every.max())]
        if law is not None:
            last = "what is named" if name == strokes[-1][1] else None
            axes.plot(places, named, color="black", lw=1.2, ls="--", label=last)
    axes.axhline(0.0, color="#6b7280", lw=0.7)
    room = _ROOM * (max(ends) - min(ends))
    axes.set_ylim(min(ends) - room, max(ends) + room)  # single points may be far outside the band
    axes.set_title(textwrap.fill(f"Missing: {missing.sentence}", _LETTERS), fontsize="medium")
    axes.set_xlabel(f"{argument.replace('_', ' ')} [{of}]")
    axes.set_ylabel(f"missing, {missing.block.replace('_', ' ')} [{unit}]")
    axes.legend(fontsize="small", frameon=False, title="band: ± 2 std")


def _means(columns: Sequence[Array], most: int) -> list[Array]:
    """Means of so many groups of points at most along the first column."""
    order = np.argsort(columns[0], kind="stable")
    groups = np.array_split(order, min(most, max(1, order.size // _LEAST_IN_POINT)))
    return [np.array([float(column[g].mean()) for g in groups if g.size]) for column in columns]
