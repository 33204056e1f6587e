"""What a log has, which of it is likely which channel, and the ``case.toml`` that says so."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._checks import positive
from pamrs.channels import channel_of
from pamrs.errors import RecordingError
from pamrs.recordings._clock import Array, usual_interval
from pamrs.recordings._matching import Match, channels_of, matched, words_of
from pamrs.recordings._several_clocks import SLOW, UNTOLD
from pamrs.recordings._suspicion import suspicions
from pamrs.recordings.logs import Log, Series, TextFormat, read_log, understood_unit
from pamrs.rig import Rig
from pamrs.units import parse_unit, same_dimension

__all__ = ["Listed", "LogProposal", "Proposal", "propose"]

_TIMES: Final = (
    "t",
    "time",
    "zeit",
    "timestamp",
    "stamp",
    "seconds",
    "sec",
    "clock",
    "when",
    "tijd",
    "tiempo",
)
_TRIALS: Final = ("trial", "run", "test", "segment", "cycle", "versuch", "experiment", "lift")
_LONG: Final = 50.0  # usual intervals: a longer pause, of a second at least, parts recordings
_MOST_PARTS: Final = 200
_SHORTEST: Final = 32  # samples of a part that is worth a recording


@dataclass(frozen=True)
class Listed:
    """One series of a log, as it is shown.

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
    """What is proposed for one log.

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
    split : str or dict, optional
        The key ``split``.
    parts : int
        How many recordings that makes.
    remarks : list of str
        What to look at.
    """

    log: Log
    listed: list[Listed]
    matches: list[Match]
    time: dict[str, Any] = field(default_factory=dict)
    split: str | dict[str, Any] | None = None
    parts: int = 1
    remarks: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Proposal:
    """What is proposed for some logs of one rig.

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
            raise RecordingError(
                f"{names}: no channel was recognised; name the columns of a text without headings "
                "(--columns, in Python TextFormat(columns=...)), or write case.toml by hand"
            )
        lines = [
            "# Proposed by pamrs import from names, units and ranges: look at every line.",
            'schema = "pamrs.case/1"',
            f"rig = {_toml(rig)}",
        ]
        usable = [item for item in self.logs if item.matches]
        for place, item in enumerate(usable):
            last = place == len(usable) - 1
            if item.parts > 2 and last:
                lines += self._entry(item, folder, "fit", list(range(1, item.parts)))
                lines += self._entry(item, folder, "held_out", [item.parts])
            else:
                role = "held_out" if last and len(usable) > 1 else "fit"
                lines += self._entry(item, folder, role, None)
        return "\n".join(lines) + "\n"

    def _entry(
        self, item: LogProposal, folder: Path, role: str, pieces: list[int] | None
    ) -> list[str]:
        file = os.path.relpath(item.log.path.resolve(), folder.resolve())
        lines = ["", *(f"# {text}" for text in item.remarks if role == "fit" or pieces is None)]
        lines += ["[[recording]]", f"file = {_toml(Path(file).as_posix())}", f'role = "{role}"']
        if self.columns is not None:
            lines.append(f"columns = {_toml(list(self.columns))}")
        if item.time:
            lines.append(f"time = {_toml(item.time)}")
        elif self.sample_time is not None and not any(
            m.series.time is not None for m in item.matches
        ):
            lines.append(f"sample_time = {self.sample_time!r}")
        if item.split is not None:
            lines.append(f"split = {_toml(item.split)}")
        if pieces is not None:
            lines.append(f"pieces = {_toml(pieces)}")
        lines.append("[recording.channels]")
        for match in item.matches:
            entry: dict[str, Any] = {"column": match.series.name, "unit": match.unit}
            if match.offset:
                entry["offset"] = float(f"{match.offset:.6g}")
            if match.time and match.time != item.time:
                entry["time"] = match.time
            if match.hold:
                entry["hold"] = True
            key = _toml(match.channel) if "." in match.channel else match.channel
            lines.append(f"{key} = {_toml(entry)}")
        return lines


def _toml(value: Any) -> str:
    """A value as TOML writes it on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(inside)}" for key, inside in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


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
    proposals = [_proposal(log, wanted, rig, sample_time) for log in read]
    return Proposal(proposals, sample_time, form.columns if form else None)


def _proposal(
    log: Log, wanted: Sequence[str], rig: Rig | None, sample_time: float | None
) -> LogProposal:
    rising = [series for series in log.series.values() if _like_a_clock(series)]
    clocks = {name: _clock_column(rising, series) for name, series in log.series.items()}
    used = {entry["column"] for entry in clocks.values() if entry}
    candidates = [series for name, series in log.series.items() if name not in used]
    matches, remarks = matched(candidates, wanted, rig)
    times = {match.channel: _times(log, match.series, clocks, sample_time) for match in matches}
    held = _held({name: time for name, time in times.items() if time is not None})
    matches = [
        match.with_clock(clocks[match.series.name], match.channel in held) for match in matches
    ]
    shared = next((match.time for match in matches if match.time and not match.hold), {})
    for match in matches:
        if times[match.channel] is None:
            remarks.append(
                f"{match.series.name} has no clock: give --sample-time, or time in case.toml"
            )
        if match.hold:
            remarks.append(
                f"{match.series.name} has few samples at uneven times: taken as logged on change "
                "(hold)"
            )
    remarks += _rates({m.channel: times[m.channel] for m in matches if not m.hold})
    remarks += _suspect(matches, rig)
    missing = [name for name in wanted if name not in times and channel_of(name) not in SLOW]
    if missing and rig is not None:
        told = ", ".join(_spoken(name, rig) for name in missing)
        remarks.append(f"not found in this log: {told}")
    stepped = [times[m.channel] for m in matches if not m.hold and times[m.channel] is not None]
    split, parts = _split(log, stepped[0] if stepped else None)
    listed = [
        _listed(series, _times(log, series, clocks, None), matches)
        for series in log.series.values()
    ]
    return LogProposal(log, listed, matches, shared, split, parts, remarks)


_SENSORS: Final = {
    "valve_command": "voltage of the valve",
    "supply_command": "set pressure of the regulator",
    "supply_pressure": "pressure in the tank or behind the regulator",
    "line_pressure": "pressure between valve and hose",
    "muscle_pressure": "pressure in the muscle or its chamber",
    "temperature": "temperature of the gas in the muscle or its chamber",
    "joint_angle": "angle of the joint",
    "length": "length of the muscle",
    "force": "pull of the muscles, by a load cell",
    "joint_torque": "torque of the muscles at the joint, by a torque sensor",
}
"""What is measured on each channel that a rig can have."""
_EXTRA: Final = ("line_pressure", "temperature", "force", "joint_torque")
"""Channels that few stands have, and that only tell one block from the next; but for a frame."""


def _spoken(channel: str, rig: Rig) -> str:
    """A channel, what it measures, and whether a case can do without it."""
    kind = channel_of(channel)
    frames = [t for t in rig.tables("load").values() if t.get("kind", "mass") == "frame"]
    extra = kind in _EXTRA and not (kind == "force" and frames)
    return f"{channel} ({_SENSORS[kind]}{'; not needed, tells blocks apart' * extra})"


def _like_a_clock(series: Series) -> bool:
    """Whether a series is called like a time, and rises."""
    words = words_of(series.name)
    called = bool(words) and (words[-1] in _TIMES or words[0] in _TIMES)
    if series.labels or not (called or words == ["x", "value"]):  # LabVIEW calls its time X_Value
        return False
    steps = np.diff(series.values[np.isfinite(series.values)])
    return bool(len(steps)) and bool(np.mean(steps >= 0.0) > 0.9) and bool(np.any(steps > 0.0))


def _clock_column(rising: Sequence[Series], series: Series) -> dict[str, Any]:
    """The key ``time`` for a series without a clock: the one of its length nearest by name."""
    if series.time is not None or series in rising:
        return {}
    fitting = [other for other in rising if len(other.values) == len(series.values)]
    if not fitting:
        return {}

    def rank(other: Series) -> tuple[int, int]:
        return len(os.path.commonprefix([other.name, series.name])), -len(other.name)

    best = max(fitting, key=rank)
    return {"column": best.name, "unit": _time_unit(best)}


def _time_unit(series: Series) -> str:
    """The unit that the log says, else the one in which the samples are 10 us to 1 s apart."""
    known = understood_unit(series.unit)
    if known is not None and same_dimension(known.unit, "s"):
        return known.unit
    steps = np.diff(series.values)
    usual = float(np.median(steps[steps > 0.0]))
    if usual < 0.5:
        return "s"
    return "ms" if usual < 1000.0 else "us"


def _times(
    log: Log, series: Series, clocks: dict[str, dict[str, Any]], sample_time: float | None
) -> Array | None:
    entry = clocks[series.name]
    if series.time is not None:
        return series.time
    if entry:
        scale = parse_unit(entry["unit"]).scale
        return np.asarray(log.series[entry["column"]].values * scale, dtype=np.float64)
    if sample_time is not None:
        return np.arange(len(series.values), dtype=np.float64) * sample_time
    return None


def _held(times: dict[str, Array]) -> set[str]:
    """Channels with few samples at uneven times beside the others."""
    most = max((len(time) for time in times.values()), default=0)
    found = set()
    for name, time in times.items():
        steps = np.diff(time)
        steps = steps[steps > 0.0]
        uneven = len(steps) < 2 or float(np.std(steps)) > 0.5 * float(np.mean(steps))
        if 5 * len(time) < most and uneven:
            found.add(name)
    return found


def _rates(times: dict[str, Array | None]) -> list[str]:
    """What becomes of channels that were sampled at different rates."""
    rates: dict[str, float] = {}
    for name, time in times.items():
        steps = np.diff(time) if time is not None else np.empty(0)
        if np.any(steps > 0.0) and channel_of(name) not in UNTOLD:
            rates[name] = 1.0 / usual_interval(steps[steps > 0.0], len(steps) + 1)
    if not rates or max(rates.values()) < 1.01 * min(rates.values()):
        return []
    fastest = max(rates, key=lambda name: rates[name])
    return [
        f"sampled at {min(rates.values()):.4g} to {rates[fastest]:.4g} Hz: all are laid on the "
        f"{rates[fastest]:.4g} Hz of {fastest} (sample_time in case.toml chooses another grid)"
    ]


def _suspect(matches: Sequence[Match], rig: Rig | None) -> list[str]:
    values = {match.channel: match.si() for match in matches}
    said = {match.channel: match.unit for match in matches if match.said}
    return [found.text for found in suspicions(values, said, rig)]


def _listed(series: Series, time: Array | None, matches: Sequence[Match]) -> Listed:
    good = series.values[np.isfinite(series.values)]
    if series.labels:
        good = good[:0]
    low, high = (float(good.min()), float(good.max())) if good.size else (np.nan, np.nan)
    rate = np.nan
    steps = np.diff(time) if time is not None else np.empty(0)
    steps = steps[steps > 0.0]
    if len(steps):
        rate = 1.0 / usual_interval(steps, len(series.values))
    channel = next((match.channel for match in matches if match.series is series), "")
    return Listed(series.name, len(series.values), float(rate), series.unit, low, high, channel)


def _split(log: Log, time: Array | None) -> tuple[str | dict[str, Any] | None, int]:
    """Where one recording ends and the next begins, and how many that makes."""
    if time is None or len(time) < 2 * _SHORTEST:
        return None, 1
    for series in log.series.values():
        words = words_of(series.name)
        if len(series.values) == len(time) and words and words[-1] in _TRIALS:
            count = 1 + int(np.sum(np.diff(series.values) != 0.0))
            if 1 < count <= min(_MOST_PARTS, len(time) // _SHORTEST):
                return {"column": series.name}, count
    steps = np.diff(time)
    back = int(np.sum(steps < 0.0))
    if 0 < back < min(_MOST_PARTS, len(time) // _SHORTEST):
        return "clock", back + 1
    forward = steps[steps > 0.0]
    if not len(forward):
        return None, 1
    long = forward[forward > max(1.0, _LONG * usual_interval(forward, len(time)))]
    if 0 < len(long) < min(_MOST_PARTS, len(time) // _SHORTEST):
        return {"gap": float(f"{0.5 * float(long.min()):.3g}")}, len(long) + 1
    return None, 1
