"""Proposes for the series of a log which channel each one is, by name, unit and range, and writes
the ``case.toml``.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final
from unicodedata import normalize

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import positive
from pamrs._files import resolved, shown
from pamrs.channels import CHANNELS, COMMANDED, MEASURED, Channel, channel_of, dotted, with_trait
from pamrs.errors import RecordingError
from pamrs.recordings._clock import CLOCK_WORDS, Ticks, filled_rows, ticks, usual_interval
from pamrs.recordings._doubts import PRESSURES, ambient_of, assumed_unit, subtracted, suspicions
from pamrs.recordings._from_log import (
    SLOW,
    UNTOLD,
    Clocks,
    Cut,
    Sampled,
    Split,
    load_recordings,
    sampled,
    stretches_of,
    unit_of_clock,
)
from pamrs.recordings._recording import Recording
from pamrs.recordings.logs import (
    Log,
    Series,
    TextFormat,
    Written,
    read_log,
    switched,
    understood_unit,
)
from pamrs.recordings.mapping import Clock
from pamrs.recordings.table import first_few, stem_of
from pamrs.rig import Rig
from pamrs.units import parse_unit, same_dimension

#: What says that a series was commanded, and what, that it was measured.
_COMMANDED: Final = frozenset(COMMANDED.split())
_MEASURED: Final = frozenset(MEASURED.split())
#: Channels that a diagnosis sets the rig by, or that are in a gas: no weak word, and no unit,
#: names them alone.
_ONLY_NAMED: Final = frozenset(with_trait("named"))
#: Pressures that a rig can do without: "pressure" alone is none of them.
_ONLY_STRONG: Final = frozenset(with_trait("strong"))
#: What nearly every diagnosis takes: of two channels that are as likely, one of these.
_NEEDED: Final = frozenset(with_trait("needed"))
_COMMANDS: Final = frozenset(with_trait("command"))
#: Words of what no valve and no regulator is commanded in.
_QUANTITIES: Final = frozenset(
    word
    for channel in ("joint_angle", "length", "force", "joint_torque", "temperature")
    for word in CHANNELS[channel].strong
)
_PLAYED: Final = with_trait("played")
_NOT_A_CHANNEL: Final = frozenset(
    ("rate", "velocity", "speed", "dot", "acc", "effort", "stamp", "sec", "nanosec", "seq", "id")
    + ("status", "flag", "error", "variance", "covariance")
)
_STRONG: Final = 3.0  # what a strong word counts


@dataclass(frozen=True, eq=False)
class Match:
    """A channel and the series that it likely is.

    Attributes
    ----------
    channel : str
        Its name.
    series : Series
        The series.
    unit : str
        The unit of its values.
    absolute : bool
        Whether that is an absolute pressure.
    calibration : tuple of tuple of float, optional
        Two numbers of the log, and the values that they stand for, where the log says so.
    assumed : str
        Why this unit, where the log says none; empty where it says it.
    subtracted : float
        The ambient pressure, for an absolute pressure [Pa].
    time : dict
        The key ``time``; empty where the log has a clock for it.
    hold : bool
        Logged on change.
    """

    channel: str
    series: Series
    unit: str
    absolute: bool = False
    calibration: tuple[tuple[float, float], tuple[float, float]] | None = None
    assumed: str = ""
    subtracted: float = 0.0
    time: dict[str, Any] = field(default_factory=dict)
    hold: bool = False

    def si(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Values of the series in SI."""
        values = self.series.values
        if self.calibration is not None:
            (low, high), (first, last) = self.calibration
            values = first + (values - low) * (last - first) / (high - low)
        unit = parse_unit(self.unit)
        return np.asarray(values * unit.scale + unit.offset - self.subtracted)


@dataclass(frozen=True)
class Open:
    """Series with the name of a channel whose unit is left to the user.

    Attributes
    ----------
    channel, series : str
        Their names.
    unit : str
        What the channel could be in.
    readings : tuple of float
        Two numbers of the log for a calibration; empty where only the unit is needed.
    text : str
        What is not known, and what to give.
    """

    channel: str
    series: str
    unit: str
    readings: tuple[float, ...]
    text: str


def words_of(name: str) -> list[str]:
    """Words of a name in small letters, without accents: ``AI/pMuscle_1`` has ai, p, muscle, 1.
    Words that are written as one are parted too: ``Solldruck`` is solldruck, soll and druck.
    """
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", name).lower()
    plain = "".join(c if c in "äöü" else normalize("NFD", c)[0] for c in normalize("NFC", parted))
    words = [word for word in re.split(r"[^0-9a-zäöüß]+", plain) if word]
    return [part for word in words for part in (word, *_joined(word))]


def _joined(word: str) -> tuple[str, ...]:
    """Two known words that form one, perhaps joined by a German s; empty where there are none."""
    for end in range(1, min(len(word), 30)):
        first, second = word[:end], word[end:]
        roles = _COMMANDED | _MEASURED
        if (first in ("p", "u") and second in roles) or (
            {first, first.removesuffix("s")} & _LONG_WORDS and second in _LONG_WORDS
        ):
            return first if first in _LONG_WORDS or end == 1 else first.removesuffix("s"), second
    return ()


_LONG_WORDS: Final = frozenset(
    word
    for words in (*(row.strong | row.weak for row in CHANNELS.values()), _MEASURED)
    for word in words
    if len(word) > 2
)
"""Words that may be part of a longer one."""


def channels_of(rig: Rig | None) -> list[str]:
    """The channels that a bench of this rig can have; all there are without a rig.

    Parameters
    ----------
    rig : Rig or None
        The rig.

    Returns
    -------
    list of str
        With the names of its blocks; at the end what is measured outside the rig, which has none.
    """
    if rig is None:
        return [name for name in CHANNELS if name != "time" and name not in _PLAYED]
    return [
        dotted(name, block)
        for name, row in CHANNELS.items()
        for block in ([""] if row.has("surroundings") else _blocks(row, rig))
    ]


def _blocks(row: Channel, rig: Rig) -> list[str]:
    """Names of the blocks of a rig that have a channel."""
    if row.name == "line_pressure":  # only an inlet that valves feed has a pressure of its own
        return [name for name, table in rig.ports("line").items() if not table["from"]]
    key, value = row.only or ("", "")
    tables = rig.tables(row.block) if row.block else {}
    return [name for name, table in tables.items() if not key or table[key] == value]


def matched(
    candidates: Sequence[Series], wanted: Sequence[str], rig: Rig | None
) -> tuple[list[Match], list[Open], list[str]]:
    """Pair series with channels, the likeliest first.

    Parameters
    ----------
    candidates : sequence of Series
        Those that are no clocks.
    wanted : sequence of str
        Channels.
    rig : Rig or None
        The rig.

    Returns
    -------
    matches : list of Match
        In the order of `wanted`.
    left : list of Open
        Series whose unit is not known, and cannot be inferred.
    remarks : list of str
        Units that were assumed, absolute pressures, and commands that this rig has not.
    """
    candidates = [switched(each) for each in candidates]
    pairs: list[tuple[float, bool, int, int]] = []
    kinds = [channel_of(name) for name in wanted]
    for row, series in enumerate(candidates):
        for column, name in enumerate(wanted):
            score = _score(series, name, kinds.count(kinds[column]) > 1)
            if score > 0.0:
                pairs.append((-score, kinds[column] not in _NEEDED, column, row))
    taken: dict[int, int] = {}
    for *_, column, row in sorted(pairs):
        if column not in taken and row not in taken.values():
            taken[column] = row
    for column, row in _lonely(candidates, wanted, taken):
        taken[column] = row
    stated = _stated_pressure([candidates[row] for row in taken.values()])
    made = [_match(wanted[k], candidates[taken[k]], rig, stated) for k in sorted(taken)]
    left = [each for each in made if isinstance(each, Open)]
    matches = [each for each in made if isinstance(each, Match)]
    matches, remarks = _made_gauge(matches, rig)
    remarks += [
        f"{match.series.name} has no unit in the log: {match.unit} is assumed, {match.assumed}"
        for match in matches
        if match.assumed
    ]
    used = {candidates[row].name for row in taken.values()}
    remarks += [
        f"{each.name} is called like a command ({_role(each)}), and no command of this rig is left "
        "for it: it is not taken for a measured channel"
        for each in candidates
        if each.name not in used and _role(each) in _COMMANDED and not each.labels
    ]
    return matches, left, remarks


def _stated_pressure(series: Sequence[Series]) -> str:
    """Unit of the first pressure whose unit the log states; empty where there is none."""
    for each in series:
        written = understood_unit(each.unit)
        if written is not None and same_dimension(written.unit, "Pa"):
            return written.unit
    return ""


def _match(name: str, series: Series, rig: Rig | None, stated: str) -> Match | Open:
    channel, written = channel_of(name), understood_unit(series.unit)
    si = CHANNELS[channel].unit
    usual = {"Pa": "bar", "rad": "deg", "m": "mm", "N m": "Nm"}.get(si, si)
    if written is not None and _measures(written, channel):
        absolute = written.absolute
        if absolute is None and same_dimension(written.unit, "Pa"):
            absolute = bool(_ABSOLUTE & set(words_of(series.name)))
        return Match(name, series, written.unit, bool(absolute), written.calibration)
    if written is not None:
        electric = next((r for u, r in _READINGS.items() if same_dimension(written.unit, u)), ())
        why = f"is called like {name}, but is in {series.unit}"
        if same_dimension(written.unit, "kg") and channel == "force":
            weight = "lbf" if written.unit == "lb" else "kgf"
            text = f"{series.name} {why}, a mass: {weight} if a weight is meant"
            return Open(name, series.name, weight, (), text)
        text = f"{series.name} {why}: give from and to, its calibration"
        return Open(name, series.name, usual, electric or (0.0, 1.0), text)
    called = f"{series.name} is called like {name}"
    levels = _switch_levels(series)
    if channel in _COMMANDS and levels:
        text = (
            f"{called}, and is {levels}, a switch: give from = [0, 1] and to, what these stand for"
        )
        return Open(name, series.name, usual, (0.0, 1.0), text)
    if series.unit.strip(" -1[](){}"):
        text = (
            f"{called}, but the unit {series.unit!r} is not known: give a unit, and scale and "
            "offset or from and to if it is none"
        )
        return Open(name, series.name, usual, (), text)
    unit, why = assumed_unit(name, series.values, rig, stated)
    if _AIR & set(words_of(series.name)) and channel in PRESSURES:
        unit, why = "", "ATM in its name may be the unit, or say that it is the air outdoors"
    if channel == "valve_command" and not _VOLTAGES & set(words_of(series.name)):
        unit, why = "", "it may be a voltage, or what a pressure or an angle is to be"
    if not unit:
        text = f"{called}, and has no unit in the log: {why}; give it"
        return Open(name, series.name, usual, (), text)
    absolute = same_dimension(unit, "Pa") and bool(_ABSOLUTE & set(words_of(series.name)))
    return Match(name, series, unit, absolute, assumed=why)


def _switch_levels(series: Series) -> str:
    """Words for the two values of a switch; empty for a series that is none."""
    good = series.values[np.isfinite(series.values)]
    if understood_unit(series.unit) or not np.isin(good, (0.0, 1.0)).all():
        return ""
    off, _, on = series.unit.partition("/")
    return f"0 for {off} and 1 for {on}" if on else "0 or 1"


_AIR: Final = frozenset(("atm",))
#: Words of valves and of voltages: what is called a set point alone may be of any channel.
_VOLTAGES: Final = (
    CHANNELS["valve_command"].strong
    | CHANNELS["valve_command"].weak - _COMMANDED
    | {"cmd", "command"}
)
_ABSOLUTE: Final = frozenset(("abs", "absolute", "absolut"))
_READINGS: Final[dict[str, tuple[float, ...]]] = {"A": (4.0, 20.0), "V": (0.0, 10.0)}
"""Signals of usual transmitters, from the lower end of their range to the upper one."""


def _measures(written: Written, channel: str) -> bool:
    return any(same_dimension(written.unit, unit) for unit in CHANNELS[channel].possible)


def _made_gauge(matches: list[Match], rig: Rig | None) -> tuple[list[Match], list[str]]:
    """Matches with the ambient pressure to subtract from absolute ones, and remarks on that."""
    recorded = next((each.si() for each in matches if each.channel == "ambient_pressure"), None)
    stated = None if rig is None else ambient_of(rig)
    found, remarks = list(matches), []
    for k, each in enumerate(matches):
        if each.absolute and each.channel != "ambient_pressure":
            ambient, said = subtracted(recorded, stated, each.unit)
            found[k] = replace(each, subtracted=ambient)
            remarks.append(f"{each.series.name} is an absolute pressure: {said}")
    return found, remarks


def _role(series: Series) -> str:
    """The word that says that a series was commanded, or else measured; empty without one."""
    words = words_of(series.name)
    for place, word in enumerate(words):
        counted = word == "set" and words[place + 1 : place + 2] and words[place + 1].isdigit()
        if word in _COMMANDED and not counted:
            return word
    return next((word for word in words if word in _MEASURED), "")


def _score(series: Series, name: str, several: bool) -> float:
    """Score of a series as a channel by name, unit and range; 0 where it cannot be that channel."""
    good = series.values[np.isfinite(series.values)]
    if series.labels or good.size < 2:
        return 0.0
    channel, _, block = name.partition(".")
    words = set(words_of(series.name))
    exact = series.name == name
    score = 10.0 if exact else _called(series, channel, words)
    if score == 0.0:
        return 0.0
    if block and set(words_of(block)) <= words:
        score += 2.0
    elif block and several:  # a name is needed where there is more than one
        return 0.0
    written = understood_unit(series.unit)
    if written is not None:
        if not _measures(written, channel):
            electric = any(same_dimension(written.unit, unit) for unit in _READINGS)
            weighed = channel == "force" and same_dimension(written.unit, "kg")
            return 0.5 * score if electric or weighed else 0.0
        score += 2.0
    if channel == "ambient_pressure" and written is not None and not _like_weather(good, written):
        return 0.0
    return score - (0.5 if np.ptp(good) == 0.0 else 0.0)


def _like_weather(values: np.ndarray[Any, np.dtype[np.float64]], written: Written) -> bool:
    """True where the median is an atmospheric pressure, absolute."""
    row = CHANNELS["ambient_pressure"]
    pressure = float(np.median(values)) * parse_unit(written.unit).scale
    return row.lower < pressure < row.upper


def _called(series: Series, channel: str, words: set[str]) -> float:
    """Score of the name of a series for a channel; 0 where the name excludes the channel."""
    if _NOT_A_CHANNEL & words:
        return 0.0
    strong, weak = CHANNELS[channel].strong, CHANNELS[channel].weak
    role = _role(series)
    if role and (role in _COMMANDED) != (channel in _COMMANDS):
        return 0.0
    named = channel in "_".join(words_of(series.name))
    score = _STRONG * len(strong & words) + 1.0 * len(weak & words)
    if channel in PRESSURES and CHANNELS["ambient_pressure"].strong & words:
        return 0.0
    others = set(_QUANTITIES)
    if channel == "valve_command":
        others |= CHANNELS["supply_pressure"].weak
    if channel in ("valve_command", "supply_command") and others & words and not strong & words:
        return 0.0
    if channel in _ONLY_STRONG and not (strong & words or named):
        return 0.0
    if channel == "supply_command" and not (role in _COMMANDED or strong & words or named):
        return 0.0
    if channel in _ONLY_NAMED:
        # where it is says more than what it is
        place, what = (weak, strong) if channel == "temperature" else (strong, weak)
        elsewhere = CHANNELS["supply_pressure"].strong - {"tank"}
        elsewhere |= CHANNELS["ambient_temperature"].strong
        if channel == "temperature" and elsewhere & words:
            return 0.0
        written = understood_unit(series.unit)
        fits = written is not None and _measures(written, channel)
        if not place & words or not (what & words or fits):
            return 0.0
        score += 2.0 if strong & words else 0.0
    return score + (2.0 if named else 0.0)


def _lonely(
    candidates: Sequence[Series], wanted: Sequence[str], taken: dict[int, int]
) -> list[tuple[int, int]]:
    """Pairs of the only series and the only channel left of a dimension."""
    found = []
    for column, name in enumerate(wanted):
        channel = channel_of(name)
        if channel in _ONLY_NAMED:
            continue
        unit = CHANNELS[channel].unit
        rivals = [
            other
            for other in wanted
            if CHANNELS[channel_of(other)].unit == unit and channel_of(other) not in _ONLY_NAMED
        ]
        rows = [
            row
            for row, series in enumerate(candidates)
            if (written := understood_unit(series.unit)) and _measures(written, channel)
            if not _NOT_A_CHANNEL & set(words_of(series.name))
            and not _named_otherwise(series, channel)
        ]
        alone = column not in taken and rivals == [name] and len(rows) == 1
        if alone and rows[0] not in taken.values():
            found.append((column, rows[0]))
    return found


def _named_otherwise(series: Series, channel: str) -> bool:
    """True where a series has the name of another channel, or the opposite role."""
    words, role = set(words_of(series.name)), _role(series)
    if role and (role in _COMMANDED) != (channel in _COMMANDS):
        return True
    if channel in _COMMANDS and {"pressure", "druck"} & words and not role:
        return True
    return any(row.strong & words for other, row in CHANNELS.items() if other != channel)


_TRIALS: Final = (
    ("trial", "run", "test", "segment", "cycle", "versuch", "experiment", "lift")
    + ("part",)  # of logs that begin again with their headings
)
_LONG_PAUSE: Final = 50.0  # usual intervals: a longer pause, of a second at least, parts recordings
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
            Where it is to be written; the logs are named from there.
        rig : str
            The rig file, from there.

        Raises
        ------
        RecordingError
            If no channel was recognised in any log.
        """
        if not any(item.matches for item in self.logs):
            names = ", ".join(str(item.log.path) for item in self.logs)
            series = first_few(
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
        names = ", ".join(_spoken(name, rig) for name in missing)
        remarks.append(f"not found in this log: {names}")
    stepped = [known[m.channel] for m in matches if not m.hold and m.channel in known]
    stepped += [clock for each in candidates if (clock := clocks.of(each)) is not None]
    split, pieces, short = _split(log, stepped[0] if stepped else None)
    taken = {each.series.name for each in matches} | {each.series for each in left}
    taken |= {split["column"]} if isinstance(split, dict) and "column" in split else set()
    known_otherwise = _NOT_A_CHANNEL | CLOCK_WORDS
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
    few = first_few(names, _MOST_UNUSED)
    return [f"not used: {few}; where one is a channel of the rig, name it in case.toml"]


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
    every = {k: _rate(time, len(time)) for k, time in times.items() if channel_of(k) not in UNTOLD}
    rates = {name: rate for name, rate in every.items() if rate > 0.0}
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
    long = forward[forward > max(1.0, _LONG_PAUSE * usual_interval(forward, len(time)))]
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
