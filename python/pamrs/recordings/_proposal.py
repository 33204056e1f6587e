"""Proposes for the series of a log which channel each one is, and writes the ``case.toml``."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import positive
from pamrs._files import resolved, shown
from pamrs.channels import CHANNELS, channel_of
from pamrs.errors import RecordingError
from pamrs.recordings._clock import usual_interval
from pamrs.recordings._doubts import suspicions
from pamrs.recordings._from_log import Clocks, load_recordings, unit_of_clock
from pamrs.recordings._mapping import Clock
from pamrs.recordings._matching import (
    NOT_A_CHANNEL,
    Match,
    Open,
    channels_of,
    matched,
    words_of,
)
from pamrs.recordings._recording import Recording
from pamrs.recordings._several_clocks import SLOW, UNTOLD, Sampled, sampled
from pamrs.recordings._splitting import Cut, Split, stretches_of
from pamrs.recordings._stamps import CLOCK_WORDS, Ticks, filled_rows, ticks
from pamrs.recordings.logs import Log, Series, TextFormat, read_log, understood_unit
from pamrs.recordings.table import stem_of, told_few
from pamrs.rig import Rig
from pamrs.units import parse_unit, same_dimension

_TRIALS: Final = (
    ("trial", "run", "test", "segment", "cycle", "versuch", "experiment", "lift")
    + ("part",)  # of logs that begin again with their headings
)
_LONG: Final = 50.0  # usual intervals: a longer pause, of a second at least, parts recordings
_MOST_PARTS: Final = 200
_SHORTEST: Final = 32  # samples of a part that is worth a recording
_MOST_UNUSED: Final = 6  # series that are no channel and are named


@dataclass(frozen=True)
class Listed:
    """Row of the list of series that is shown to the user.

    Attributes
    ----------
    name : str
        Its path in the log.
    count : int
        Samples.
    rate : float
        Samples per second; NaN where the log has no clock for it.
    unit : str
        As the log writes it.
    low, high : float
        Smallest and largest number of the log; NaN where there is none.
    channel : str
        The channel that is proposed, or empty.
    """

    name: str
    count: int
    rate: float
    unit: str
    low: float
    high: float
    channel: str


@dataclass(frozen=True, eq=False)
class LogProposal:
    """Proposal for one log: its channels, their clock, and the split into recordings.

    Attributes
    ----------
    log : Log
        The log.
    listed : list of Listed
        Its series.
    matches : list of Match
        Which of them is which channel.
    time : dict
        The key ``time``; empty where the log has clocks.
    left : list of Open
        Series that are called like a channel, but whose unit is left to the user.
    split : str or dict, optional
        The key ``split``.
    pieces : list of int
        The numbers of the parts that are long enough for a recording; empty without a split.
    short : int
        How many are not.
    remarks : list of str
        What to look at.
    name : str
        The key ``name``; empty where the file says it.
    """

    log: Log
    listed: list[Listed]
    matches: list[Match]
    time: dict[str, Any] = field(default_factory=dict)
    left: list[Open] = field(default_factory=list)
    split: str | dict[str, Any] | None = None
    pieces: list[int] = field(default_factory=list)
    short: int = 0
    remarks: list[str] = field(default_factory=list)
    name: str = ""

    @property
    def channels(self) -> dict[str, dict[str, Any]]:
        """The key ``channels``."""
        found = {}
        for match in self.matches:
            unit = f"{match.unit}(a)" if match.absolute else match.unit
            entry: dict[str, Any] = {"column": match.series.name, "unit": unit}
            if match.calibration is not None:
                entry["from"], entry["to"] = map(list, match.calibration)
            if match.assumed:
                entry["assumed"] = match.assumed
            if match.time and match.time != self.time:
                entry["time"] = match.time
            if match.hold:
                entry["hold"] = True
            found[match.channel] = entry
        return found

    def recordings(self, ambient_pressure: float | None = None) -> list[Recording]:
        """Recordings of the log as proposed.

        Parameters
        ----------
        ambient_pressure : float, optional
            What is subtracted from absolute pressures [Pa].

        Returns
        -------
        list of Recording
            Empty where no channel was recognised, or one has no clock.

        Raises
        ------
        RecordingError
            If a channel cannot be what it is proposed as.
        """
        if not self.matches or any(not m.time and m.series.time is None for m in self.matches):
            return []
        return load_recordings(
            self.log.path,
            channels=self.channels,
            time=self.time or None,
            split=self.split,
            pieces=self.pieces or None,
            log=self.log,
            ambient_pressure=ambient_pressure,
        )


@dataclass(frozen=True, eq=False)
class Proposal:
    """Proposal for some logs of one rig.

    Attributes
    ----------
    logs : list of LogProposal
        In the order in which they were given.
    sample_time : float, optional
        What was given for logs without a clock [s].
    columns : tuple of str, optional
        Names that were given for columns without any.
    """

    logs: list[LogProposal]
    sample_time: float | None = None
    columns: tuple[str, ...] | None = None

    def case_toml(self, folder: Path, rig: str = "rig.toml") -> str:
        """The text of a ``case.toml`` that points at the logs.

        Parameters
        ----------
        folder : Path
            Where it is to stand; the logs are named from there.
        rig : str
            The rig file, from there.

        Returns
        -------
        str

        Raises
        ------
        RecordingError
            If no channel was recognised in any log.
        """
        if not any(item.matches for item in self.logs):
            names = ", ".join(str(item.log.path) for item in self.logs)
            series = told_few(
                [each.name for item in self.logs for each in item.listed], _MOST_UNUSED
            )
            left = "".join(f"\n{each.text}" for item in self.logs for each in item.left)
            raise RecordingError(
                f"{names}: no channel was recognised among {series}; name the columns of a text "
                "without headings (--columns, in Python TextFormat(columns=...)), or write "
                "case.toml by hand" + left
            )
        lines = [
            "# Proposed by pamrs import from names, units and ranges: look at every line.",
            'schema = "pamrs.case/1"',
            f"rig = {_toml(rig)}",
        ]
        held = self.held_out
        for item in self._usable:
            if item is held and len(item.pieces) > 2:
                lines += self._entry(item, folder, "fit", item.pieces[:-1])
                lines += self._entry(item, folder, "held_out", item.pieces[-1:])
            else:
                role = "held_out" if item is held else "fit"
                lines += self._entry(item, folder, role, item.pieces if item.short else None)
        return "\n".join(lines) + "\n"

    @property
    def _usable(self) -> list[LogProposal]:
        """The logs of which a channel was recognised."""
        return [item for item in self.logs if item.matches]

    @property
    def held_out(self) -> LogProposal | None:
        """Log that is held out, of several parts the last alone; None where none can be."""
        usable = self._usable
        several = len(usable) > 1 or any(len(item.pieces) > 2 for item in usable)
        return usable[-1] if several else None

    def _entry(
        self, item: LogProposal, folder: Path, role: str, pieces: list[int] | None
    ) -> list[str]:
        file = os.path.relpath(resolved(item.log.path), resolved(folder))
        said = item.remarks if role == "fit" or pieces is None else []
        clocked = item.time or any(m.series.time is not None for m in item.matches)
        keys = {
            "file": Path(file).as_posix(),
            "role": role,
            "name": item.name or None,
            "columns": self.columns and list(self.columns),
            "time": item.time or None,
            "sample_time": None if clocked else self.sample_time,
            "split": item.split,
            "pieces": pieces,
        }
        lines = ["", *(f"# {shown(text)}" for text in said), "[[recording]]"]
        lines += [f"{key} = {_toml(value)}" for key, value in keys.items() if value is not None]
        lines.append("[recording.channels]")
        lines += [f"{_key(name)} = {_toml(entry)}" for name, entry in item.channels.items()]
        for each in item.left:
            entry: dict[str, Any] = {"column": each.series, "unit": each.unit}
            if each.readings:
                entry |= {"from": list(each.readings), "to": [0, 1]}
            lines += [f"# {shown(each.text)}:", f"# {_key(each.channel)} = {_toml(entry)}"]
        return lines


def _key(channel: str) -> str:
    return _toml(channel) if "." in channel else channel


def _toml(value: Any) -> str:
    """A value as TOML writes it on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(inside)}" for key, inside in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def propose(
    paths: Sequence[str | os.PathLike[str]],
    rig: Rig | None = None,
    *,
    sample_time: float | None = None,
    form: TextFormat | None = None,
) -> Proposal:
    """Look at logs and say what of them is likely which channel.

    Parameters
    ----------
    paths : sequence of path-like
        Logs of one rig.
    rig : Rig, optional
        The rig: which channels there can be, and between which values.
    sample_time : float, optional
        For logs without any clock, the spacing of the samples [s].
    form : TextFormat, optional
        How text files are written, where that is not to be found out.

    Returns
    -------
    Proposal

    Raises
    ------
    RecordingError
        If a log cannot be read.
    ParameterError
        If `sample_time` is not above zero.
    MissingPackageError
        If a package that reads a log is missing; the message names the extra.
    """
    if sample_time is not None:
        sample_time = positive("sample_time", sample_time)
    wanted = channels_of(rig)
    read = [read_log(Path(path), form) for path in paths]
    proposals = [each for log in read for each in _proposals(log, wanted, rig, sample_time)]
    return Proposal(proposals, sample_time, form.columns if form else None)


def _proposals(
    log: Log, wanted: Sequence[str], rig: Rig | None, sample_time: float | None
) -> list[LogProposal]:
    """Proposals for a log: one for each table where several share channels, else one for all."""
    whole = _proposal(log, wanted, rig, sample_time)
    each = [_proposal(log.only(table), wanted, rig, sample_time) for table in log.tables]
    channels = [match.channel for item in each for match in item.matches]
    if len(set(channels)) == len(channels):
        return [whole]
    made = []
    for table, item in zip(log.tables, each, strict=True):
        sheet = table.rstrip("/")
        if not item.matches:
            item.remarks.append(f"no channel was recognised in {sheet}: nothing is proposed for it")
        made.append(replace(item, name=f"{stem_of(log.path)}_{sheet}"))
    return made


def _proposal(
    log: Log, wanted: Sequence[str], rig: Rig | None, sample_time: float | None
) -> LogProposal:
    clocks = _Clocks(log, sample_time)
    candidates = [series for name, series in log.series.items() if name not in clocks.used]
    matches, left, remarks = matched(candidates, wanted, rig)
    remarks += [each.text for each in left]
    made = {match.channel: clocks.of(match.series) for match in matches}
    known = {name: clock for name, clock in made.items() if clock is not None}
    laid = {
        m.channel: sampled(
            m.channel, m.si(), known[m.channel], "rad" if same_dimension(m.unit, "rad") else ""
        )
        for m in matches
        if m.channel in known
    }
    held = _held({name: item.time for name, item in laid.items()})
    matches = [
        replace(m, time=clocks.entries[m.series.name], hold=m.channel in held) for m in matches
    ]
    shared = next((match.time for match in matches if match.time and not match.hold), {})
    for match in matches:
        name = match.series.name
        if match.channel not in known:
            remarks.append(
                f"{name} has no clock: give the spacing of its samples (--sample-time), or time in "
                "case.toml"
            )
        if match.hold:
            remarks.append(
                f"{name} has few samples at uneven times: taken as logged on change (hold)"
            )
    remarks += _rates(
        {m.channel: laid[m.channel].time for m in matches if not m.hold and m.channel in laid}
    )
    remarks += _suspect(matches, rig, laid)
    begun = {*made, *(each.channel for each in left)}
    missing = [name for name in wanted if name not in begun and channel_of(name) not in SLOW]
    if missing and rig is not None:
        told = ", ".join(_spoken(name, rig) for name in missing)
        remarks.append(f"not found in this log: {told}")
    stepped = [known[m.channel] for m in matches if not m.hold and m.channel in known]
    stepped += [clock for each in candidates if (clock := clocks.of(each)) is not None]
    split, pieces, short = _split(log, stepped[0] if stepped else None)
    taken = {each.series.name for each in matches} | {each.series for each in left}
    taken |= {split["column"]} if isinstance(split, dict) and "column" in split else set()
    known_otherwise = NOT_A_CHANNEL | CLOCK_WORDS
    unused = [
        series.name
        for series in candidates
        if series.name not in taken
        and known_otherwise.isdisjoint(words_of(series.name))
        and not any(text.startswith(f"{series.name} ") for text in remarks)
    ]
    remarks += _unused(unused)
    listed = [_listed(series, clocks.of(series), matches) for series in log.series.values()]
    read = [*log.remarks, *clocks.remarks]
    read += [f"{name}: {text}" for name, item in laid.items() for text in item.remarks]
    read += [
        f"{name}: {lost} of {len(item.values)} samples are missing"
        for name, item in laid.items()
        if (lost := int(np.sum(np.isnan(item.values))))
    ]
    if short:
        count = short + len(pieces)
        read.append(f"{short} of {count} parts have fewer than {_SHORTEST} samples: left out")
    log = replace(log, remarks=read)
    return LogProposal(log, listed, matches, shared, left, split, pieces, short, remarks)


def _unused(names: list[str]) -> list[str]:
    """Remark on series that are no channel, at most one."""
    if not names:
        return []
    told = told_few(names, _MOST_UNUSED)
    return [f"not used: {told}; where one is a channel of the rig, name it in case.toml"]


def _spoken(channel: str, rig: Rig) -> str:
    """Channel as words: its name, its sensor, and a note where a case can do without it."""
    kind = CHANNELS[channel_of(channel)]
    frames = [t for t in rig.tables("load").values() if t.get("kind", "mass") == "frame"]
    extra = kind.has("extra") and not (kind.name == "force" and frames)
    return f"{channel} ({kind.sensor}{'; not needed, tells blocks apart' * extra})"


def _like_a_clock(series: Series) -> bool:
    """True where a series has the name of a clock, holds time stamps or is in a unit of time, and
    rises.
    """
    words = words_of(series.name)
    called = bool(words) and (words[-1] in CLOCK_WORDS or words[0] in CLOCK_WORDS)
    called |= series.stamps or words == ["x", "value"]  # LabVIEW calls its time X_Value
    known = understood_unit(series.unit)
    if known is not None and not same_dimension(known.unit, "s"):
        return False
    good = series.values[np.isfinite(series.values)]
    if series.labels or not (called or known) or len(good) < 2:
        return False
    steps = np.diff(ticks(good).time)
    rises = steps >= 0.0 if called else steps > 0.0  # a duration may stay and rise at times
    return bool(np.mean(rises) > 0.9) and bool(np.any(steps > 0.0))


class _Clocks:
    """Clocks of a log: the series that hold the times of others, and remarks on them."""

    def __init__(self, log: Log, sample_time: float | None) -> None:
        self._step = sample_time
        self._clocks = Clocks(log, sample_time)
        self.remarks: list[str] = []
        self._rising = [series for series in log.series.values() if _like_a_clock(series)]
        self.entries = {name: self._column(series) for name, series in log.series.items()}
        self.used = {entry["column"] for entry in self.entries.values() if entry}
        if len(self.used) == 1:
            self._compare(log.series[next(iter(self.used))])

    def _column(self, series: Series) -> dict[str, Any]:
        """The key ``time`` for a series without a clock: the one of its length nearest by name,
        fine ones before coarse ones, stamps of messages before those of their arrival.
        """
        if series.time is not None or series in self._rising:
            return {}
        fitting = [each for each in self._rising if len(each.values) == len(series.values)]
        if not fitting:
            return {}

        def rank(other: Series) -> tuple[bool, int, bool, int]:
            fine = 2 * len(np.unique(other.values)) > len(other.values)
            near = len(os.path.commonprefix([other.name, series.name]))
            return fine, near, "header" in words_of(other.name), -len(other.name)

        best = max(fitting, key=rank)
        unit, remark = unit_of_clock(best)
        if remark and remark not in self.remarks:
            self.remarks.append(remark)
        return {"column": best.name, "unit": unit}

    def of(self, series: Series) -> Ticks | None:
        """Times of the rows of a series; None where the log has no clock for it."""
        entry = self.entries[series.name]
        if series.time is None and not entry and (self._step is None or series in self._rising):
            return None
        try:
            made = self._clocks.of(series, Clock(entry.get("column"), entry.get("unit")))
        except RecordingError:  # no time in any row
            return None
        spread = made.spread[1] if filled_rows(series.values) is None else ""
        said = [text for text in (*made.remarks, spread) if text]
        self.remarks += [text for text in said if text not in self.remarks]
        return made

    def _compare(self, used: Series) -> None:
        """Say by how much another clock of the same rows lags behind the one that is used."""
        mine = used.values * parse_unit(unit_of_clock(used)[0]).scale
        for other in self._rising:
            if other is used or len(other.values) != len(mine):
                continue
            scale = parse_unit(unit_of_clock(other)[0]).scale
            away = other.values * scale - mine
            away = away[np.isfinite(away)]
            if len(away) and float(np.max(np.abs(away))) < 60.0:
                self.remarks.append(
                    f"the clock is {used.name}; {other.name} is {1e3 * np.median(away):.3g} ms "
                    f"later in the middle ({1e3 * away.min():.3g} to {1e3 * away.max():.3g} ms)"
                )


def _held(times: dict[str, Array]) -> set[str]:
    """Channels logged on change: less than a fifth of the most samples, at uneven times."""
    most = max((len(time) for time in times.values()), default=0)

    def uneven(time: Array) -> bool:
        steps = np.diff(time)
        steps = steps[steps > 0.0]
        return len(steps) < 2 or float(np.std(steps)) > 0.5 * float(np.mean(steps))

    return {name for name, time in times.items() if 5 * len(time) < most and uneven(time)}


def _rates(times: dict[str, Array]) -> list[str]:
    """Remark on the common grid of channels with different rates; empty for one rate."""
    told = {k: _rate(time, len(time)) for k, time in times.items() if channel_of(k) not in UNTOLD}
    rates = {name: rate for name, rate in told.items() if rate > 0.0}
    if not rates or max(rates.values()) < 1.01 * min(rates.values()):
        return []
    fastest = max(rates, key=lambda name: rates[name])
    return [
        f"sampled at {min(rates.values()):.4g} to {rates[fastest]:.4g} Hz: all are laid on the "
        f"{rates[fastest]:.4g} Hz of {fastest} (sample_time in case.toml chooses another grid)"
    ]


def _rate(time: Array, count: int) -> float:
    """Samples per second of so many samples; NaN where no time is later than another."""
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    return 1.0 / usual_interval(forward, count) if len(forward) else np.nan


def _suspect(matches: Sequence[Match], rig: Rig | None, laid: Mapping[str, Sampled]) -> list[str]:
    values = {m.channel: laid[m.channel].values if m.channel in laid else m.si() for m in matches}
    said = {match.channel: match.unit for match in matches if not match.assumed}
    return [found.text for found in suspicions(values, said, rig)]


def _listed(series: Series, clock: Ticks | None, matches: Sequence[Match]) -> Listed:
    good = series.values[np.isfinite(series.values)]
    if series.labels:
        good = good[:0]
    low, high = (float(good.min()), float(good.max())) if good.size else (np.nan, np.nan)
    channel = next((match.channel for match in matches if match.series is series), "")
    times = np.empty(0) if clock is None else sampled(channel, series.values, clock, "").time
    rate = _rate(times, len(series.values))
    return Listed(series.name, len(series.values), rate, series.unit, low, high, channel)


def _split(log: Log, clock: Ticks | None) -> tuple[str | dict[str, Any] | None, list[int], int]:
    """Key ``split`` of a log, the numbers of its long parts, and the count of its short ones."""
    if clock is None or len(clock.rows) < 2 * _SHORTEST:
        return None, [], 0
    time = clock.spread[0]
    rows = int(clock.rows.max()) + 1
    for series in log.series.values():
        words = words_of(series.name)
        if len(series.values) >= rows and words and words[-1] in _TRIALS:
            column = Split(series.values[clock.rows], clock, series.labels)
            found = _numbers(Cut(column=series.name), time, column)
            if found is not None:
                return {"column": series.name}, *found
    steps = np.diff(time)
    if np.any(steps < 0.0):
        found = _numbers(Cut(), time, None)
        return ("clock", *found) if found else (None, [], 0)
    forward = steps[steps > 0.0]
    if not len(forward):
        return None, [], 0
    long = forward[forward > max(1.0, _LONG * usual_interval(forward, len(time)))]
    if len(long):
        gap = float(f"{0.5 * float(long.min()):.3g}")
        found = _numbers(Cut(gap=gap), time, None)
        if found is not None:
            return {"gap": gap}, *found
    return None, [], 0


def _numbers(cut: Cut, time: Array, column: Split | None) -> tuple[list[int], int] | None:
    """Numbers of the long parts and the count of the others; None for one part or too many."""
    found = stretches_of(cut, time, column)
    long = [part.number for part in found if part.stop - part.start >= _SHORTEST]
    if len(found) < 2 or not long or len(long) > _MOST_PARTS:
        return None
    if len(found) - len(long) > len(long):
        return None
    return long, len(found) - len(long)
