"""Guesses the channel of each series of a log by name, unit and range."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final
from unicodedata import normalize

import numpy as np

from pamrs.channels import (
    CHANNELS,
    COMMANDED,
    MEASURED,
    Channel,
    channel_of,
    dotted,
    with_trait,
)
from pamrs.recordings._doubts import PRESSURES, ambient_of, assumed_unit, subtracted
from pamrs.recordings.logs import Series, Written, switched, understood_unit
from pamrs.rig import Rig
from pamrs.units import parse_unit, same_dimension

#: What says that a series was commanded, and what, that it was measured.
_COMMANDED: Final = frozenset(COMMANDED.split())
_MEASURED: Final = frozenset(MEASURED.split())
#: Channels that a diagnosis sets the rig by, or that stand in a gas: no weak word, and no unit,
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
NOT_A_CHANNEL: Final = frozenset(
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
            {first, first.removesuffix("s")} & _LONG and second in _LONG
        ):
            return first if first in _LONG or end == 1 else first.removesuffix("s"), second
    return ()


_LONG: Final = frozenset(
    word
    for words in (*(row.strong | row.weak for row in CHANNELS.values()), _MEASURED)
    for word in words
    if len(word) > 2
)
"""Words that may stand in a longer one."""


def channels_of(rig: Rig | None) -> list[str]:
    """The channels that a stand of this rig can have; all there are without a rig.

    Parameters
    ----------
    rig : Rig or None
        The rig.

    Returns
    -------
    list of str
        With the names of its blocks; at the end what is measured beside it, which has none.
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
        Series whose unit is not known, and cannot be told.
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
    usual = _usual_unit(channel)
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
    levels = switch_levels(series)
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


def switch_levels(series: Series) -> str:
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


def _usual_unit(channel: str) -> str:
    usual = {"Pa": "bar", "rad": "deg", "m": "mm", "N m": "Nm"}
    return usual.get(CHANNELS[channel].unit, CHANNELS[channel].unit)


def _measures(written: Written, channel: str) -> bool:
    return any(same_dimension(written.unit, unit) for unit in CHANNELS[channel].possible)


def _made_gauge(matches: list[Match], rig: Rig | None) -> tuple[list[Match], list[str]]:
    """Matches with the ambient pressure to subtract from absolute ones, and remarks on that."""
    recorded = next((each.si() for each in matches if each.channel == "ambient_pressure"), None)
    stated = None if rig is None else ambient_of(rig)
    found, told = list(matches), []
    for k, each in enumerate(matches):
        if each.absolute and each.channel != "ambient_pressure":
            ambient, said = subtracted(recorded, stated, each.unit)
            found[k] = replace(each, subtracted=ambient)
            told.append(f"{each.series.name} is an absolute pressure: {said}")
    return found, told


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
    if NOT_A_CHANNEL & words:
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
        told = written is not None and _measures(written, channel)
        if not place & words or not (what & words or told):
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
            if not NOT_A_CHANNEL & set(words_of(series.name))
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
