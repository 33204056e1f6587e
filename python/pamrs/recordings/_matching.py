"""Which series of a log is likely which channel: by name, unit and range."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from pamrs.channels import channel_of, dotted
from pamrs.recordings._recording import CHANNELS
from pamrs.recordings._suspicion import (
    AMBIENT,
    PRESSURE_UNITS,
    PRESSURES,
    ambient_of,
    limits_of,
    top_of,
)
from pamrs.recordings.logs import Series, Written, understood_unit
from pamrs.rig import Rig
from pamrs.units import bar_and_psi, parse_unit, same_dimension

__all__ = ["Match", "Open", "channels_of", "matched", "words_of"]

_SET: Final = (
    "set soll sollwert setpoint sp ref reference des desired cmd command commanded target demand "
    "vorgabe"
)
_READ: Final = "act actual ist istwert meas measured mess messwert fb feedback sensor gauge"
#: What says that a series was commanded, and what, that it was measured.
_COMMANDED: Final = frozenset(_SET.split())
_MEASURED: Final = frozenset(_READ.split())
_PRESSURE: Final = "pressure druck p press air luft"
_OUTSIDE: Final = "ambient umgebung room raum"
#: Words of names, strong ones and weak ones. A strong word alone is enough.
_WORDS: Final[dict[str, tuple[frozenset[str], frozenset[str]]]] = {
    channel: (frozenset(strong.split()), frozenset(weak.split()))
    for channel, strong, weak in (
        ("valve_command", "valve ventil servo spool uvalve", f"u ao voltage volt input {_SET}"),
        ("supply_command", "setpoint regulator regler psoll pset", f"supply {_SET}"),
        (
            "supply_pressure",
            "supply tank reservoir source versorgung psup ps psupply ptank vorrat speise kessel "
            "behälter behaelter regulator regler",
            _PRESSURE,
        ),
        ("line_pressure", "line hose tube leitung schlauch pline", _PRESSURE),
        (
            "muscle_pressure",
            "muscle pam mckibben muskel chamber kammer pm p1 pmuscle",
            f"{_PRESSURE} actuator bladder tank",
        ),
        ("joint_angle", "angle winkel theta phi encoder enc", "joint position pos q elbow knee"),
        ("length", "length laenge länge stroke displacement weg lvdt disp", "x position pos laser"),
        ("force", "force kraft loadcell", "load cell f fz"),
        ("joint_torque", "torque moment drehmoment", "m mz joint"),
        (
            "temperature",
            "temperature temp temperatur thermo tc tgas tair ttank tchamber",
            "gas chamber kammer tank tgas tair ttank tchamber",
        ),
        (
            "ambient_temperature",
            f"{_OUTSIDE} umgebungstemperatur raumtemperatur tamb troom",
            "temperature temp temperatur thermo tc umgebungstemperatur raumtemperatur tamb troom",
        ),
        (
            "ambient_pressure",
            f"{_OUTSIDE} atmospheric atmosphere barometric barometer baro luftdruck pamb patm",
            f"{_PRESSURE} barometer baro luftdruck pamb patm",
        ),
        ("reference", "reference ref desired target sollwert", "soll wanted"),
    )
}
#: Channels that a diagnosis sets the rig by, or that stand in a gas: no weak word, and no unit,
#: names them alone.
_ONLY_NAMED: Final = frozenset({"ambient_temperature", "ambient_pressure", "temperature"})
#: Pressures that a rig can do without: "pressure" alone is none of them.
_ONLY_STRONG: Final = frozenset({"supply_pressure", "line_pressure"})
#: What nearly every diagnosis takes: of two channels that are as likely, one of these.
_NEEDED: Final = frozenset(
    ("muscle_pressure", "valve_command", "supply_command", "joint_angle", "length", "force")
)
_COMMANDS: Final = frozenset({"valve_command", "supply_command", "pressure_command", "reference"})
#: Words of what no valve and no regulator is commanded in.
_QUANTITIES: Final = frozenset(
    word
    for channel in ("joint_angle", "length", "force", "joint_torque", "temperature")
    for word in _WORDS[channel][0]
)
#: Channels of files that are played, which no log has.
_PLAYED: Final = frozenset({"pressure_command"})
_NOT: Final = frozenset(
    ("rate", "velocity", "speed", "dot", "acc", "effort", "stamp", "sec", "nanosec", "seq", "id")
    + ("status", "flag", "error", "variance", "covariance")
)
_STRONG: Final = 3.0  # what a strong word counts
_VOLTS: Final = 30.0  # no valve is commanded with more
_NEWTONS: Final = 5e4  # no muscle pulls more


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

    def with_clock(self, time: dict[str, Any], hold: bool) -> Match:
        """The same with a clock."""
        return replace(self, time=time, hold=hold)

    def si(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Its values in SI."""
        values = self.series.values
        if self.calibration is not None:
            (low, high), (first, last) = self.calibration
            values = first + (values - low) * (last - first) / (high - low)
        unit = parse_unit(self.unit)
        return np.asarray(values * unit.scale + unit.offset - self.subtracted)


@dataclass(frozen=True)
class Open:
    """A series that is called like a channel, but whose unit is left to the user.

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
    """Words of a name in small letters: ``AI/pMuscle_1`` has ai, p, muscle, 1. Words that are
    written as one are parted too: ``Solldruck`` is solldruck, soll and druck.
    """
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", name)
    words = [word for word in re.split(r"[^0-9a-zäöüß]+", parted.lower()) if word]
    return [part for word in words for part in (word, *_joined(word))]


def _joined(word: str) -> tuple[str, ...]:
    """The two known words that make one, with the s that German puts between them or not."""
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
    for words in (*(strong | weak for strong, weak in _WORDS.values()), _MEASURED)
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
    kinds = (
        ("valve", "valve_command"),
        ("supply", "supply_pressure"),
        ("chamber", "muscle_pressure"),
        ("joint", "joint_angle"),
        ("load", "length"),
        ("load", "force"),
        ("joint", "joint_torque"),
    )
    found = [dotted(channel, name) for block, channel in kinds for name in rig.tables(block)]
    for name, table in rig.tables("supply").items():
        if table["kind"] == "regulator":
            found.append(dotted("supply_command", name))
    # only an inlet that valves feed has a pressure of its own
    found += [dotted("line_pressure", n) for n, t in rig.ports("line").items() if not t["from"]]
    warm = [name for name, t in rig.tables("chamber").items() if t["gas"] == "energy_balance"]
    outside = ["ambient_temperature", "ambient_pressure"]
    return [*found, *(dotted("temperature", name) for name in warm), *outside]


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
    matches: list[Match] = []
    left: list[Open] = []
    stated = _stated_pressure([candidates[row] for row in taken.values()])
    for column in sorted(taken):
        made = _match(wanted[column], candidates[taken[column]], rig, stated)
        if isinstance(made, Match):
            matches.append(made)
        else:
            left.append(made)
    matches, remarks = _made_gauge(matches, rig)
    remarks += [
        f"{match.series.name} has no unit in the log: {match.unit} is assumed, {match.assumed}"
        for match in matches
        if match.assumed
    ]
    used = {candidates[row].name for row in taken.values()}
    for series in candidates:
        if series.name not in used and _role(series) in _COMMANDED and not series.labels:
            remarks.append(
                f"{series.name} is called like a command ({_role(series)}), and no command of this "
                "rig is left for it: it is not taken for a measured channel"
            )
    return matches, left, remarks


def _stated_pressure(series: Sequence[Series]) -> str:
    """The unit that the log says of a pressure, the first one; empty where it says none."""
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
    if series.unit.strip(" -1[](){}"):
        text = (
            f"{series.name} is called like {name}, but the unit {series.unit!r} is not known: give "
            "a unit, and scale and offset or from and to if it is none"
        )
        return Open(name, series.name, usual, (), text)
    unit, why = _unit_for(name, series, rig, stated)
    if _AIR & set(words_of(series.name)) and channel in PRESSURES:
        unit, why = "", "ATM in its name may be the unit, or say that it is the air outdoors"
    if not unit:
        text = f"{series.name} is called like {name}, and has no unit in the log: {why}; give it"
        return Open(name, series.name, usual, (), text)
    absolute = same_dimension(unit, "Pa") and bool(_ABSOLUTE & set(words_of(series.name)))
    return Match(name, series, unit, absolute, assumed=why)


_AIR: Final = frozenset(("atm",))
_ABSOLUTE: Final = frozenset(("abs", "absolute", "absolut"))
_READINGS: Final[dict[str, tuple[float, ...]]] = {"A": (4.0, 20.0), "V": (0.0, 10.0)}
"""What transmitters give, from the lower end of their range to the upper one."""


def _usual_unit(channel: str) -> str:
    usual = {"Pa": "bar", "rad": "deg", "m": "mm", "N m": "Nm"}
    return usual.get(CHANNELS[channel].unit, CHANNELS[channel].unit)


def _measures(written: Written, channel: str) -> bool:
    return any(same_dimension(written.unit, unit) for unit in _units(channel))


def _made_gauge(matches: list[Match], rig: Rig | None) -> tuple[list[Match], list[str]]:
    """Absolute pressures with what is subtracted from them, and words that say so."""
    ambient, whose = AMBIENT, "the standard atmosphere"
    if rig is not None:
        ambient, whose = ambient_of(rig), "the ambient pressure of the rig file"
    for match in matches:
        if match.channel == "ambient_pressure" and np.isfinite(match.si()).any():
            ambient, whose = float(np.nanmedian(match.si())), match.series.name
    found, remarks = [], []
    for match in matches:
        if match.absolute and match.channel != "ambient_pressure":
            remarks.append(
                f"{match.series.name} is an absolute pressure: {whose}, {bar_and_psi(ambient)}, is "
                "subtracted"
            )
            match = replace(match, subtracted=ambient)
        found.append(match)
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
    """How well name and unit fit; 0 where they do not."""
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
    """Whether pressures are those of air outdoors, and not measured from them."""
    low, high = CHANNELS["ambient_pressure"][1:]
    return low < float(np.median(values)) * parse_unit(written.unit).scale < high


def _called(series: Series, channel: str, words: set[str]) -> float:
    """How well the name of a series fits a channel; 0 where it does not."""
    if _NOT & words:
        return 0.0
    strong, weak = _WORDS[channel]
    role = _role(series)
    if role and (role in _COMMANDED) != (channel in _COMMANDS):
        return 0.0
    named = channel in "_".join(words_of(series.name))
    score = _STRONG * len(strong & words) + 1.0 * len(weak & words)
    if channel in PRESSURES and _WORDS["ambient_pressure"][0] & words:
        return 0.0
    others = _QUANTITIES | (frozenset(_PRESSURE.split()) if channel == "valve_command" else set())
    if channel in ("valve_command", "supply_command") and others & words and not strong & words:
        return 0.0
    if channel in _ONLY_STRONG and not (strong & words or named):
        return 0.0
    if channel == "supply_command" and not (role in _COMMANDED or strong & words or named):
        return 0.0
    if channel in _ONLY_NAMED:
        # where it is says more than what it is
        place, what = (weak, strong) if channel == "temperature" else (strong, weak)
        elsewhere = _WORDS["ambient_temperature"][0] | _WORDS["supply_pressure"][0] - {"tank"}
        if channel == "temperature" and elsewhere & words:
            return 0.0
        written = understood_unit(series.unit)
        told = written is not None and _measures(written, channel)
        if not place & words or not (what & words or told):
            return 0.0
        score += 2.0 if strong & words else 0.0
    return score + (2.0 if named else 0.0)


def _units(channel: str) -> tuple[str, ...]:
    return ("rad", "Pa") if channel == "reference" else (CHANNELS[channel].unit,)


def _lonely(
    candidates: Sequence[Series], wanted: Sequence[str], taken: dict[int, int]
) -> list[tuple[int, int]]:
    """The only series of a dimension, for the only channel of that dimension that is left."""
    found = []
    for column, name in enumerate(wanted):
        channel = channel_of(name)
        if channel in _ONLY_NAMED:
            continue
        rivals = [
            other
            for other in wanted
            if CHANNELS[channel_of(other)].unit == CHANNELS[channel].unit
            and channel_of(other) not in _ONLY_NAMED
        ]
        rows = [
            row
            for row, series in enumerate(candidates)
            if (written := understood_unit(series.unit)) and _measures(written, channel)
            if not _NOT & set(words_of(series.name)) and not _named_otherwise(series, channel)
        ]
        alone = column not in taken and rivals == [name] and len(rows) == 1
        if alone and rows[0] not in taken.values():
            found.append((column, rows[0]))
    return found


def _named_otherwise(series: Series, channel: str) -> bool:
    """Whether a series has the name of another channel, or the other role."""
    words, role = set(words_of(series.name)), _role(series)
    if role and (role in _COMMANDED) != (channel in _COMMANDS):
        return True
    if channel in _COMMANDS and {"pressure", "druck"} & words and not role:
        return True
    return any(strong & words for other, (strong, _) in _WORDS.items() if other != channel)


def _unit_for(name: str, series: Series, rig: Rig | None, stated: str) -> tuple[str, str]:
    """A unit for a series without one, by the range of its values.

    Parameters
    ----------
    name : str
        The channel that it likely is.
    series : Series
        Its numbers.
    rig : Rig or None
        What the rig says of pressures, angles and lengths.
    stated : str
        The unit of the other pressures of the log; empty where it says none.

    Returns
    -------
    unit : str
        Empty where the numbers fit none.
    why : str
    """
    channel = channel_of(name)
    good = series.values[np.isfinite(series.values)]
    low, high = (float(good.min()), float(good.max())) if good.size else (0.0, 0.0)
    numbers = f"its numbers are {low:.4g} to {high:.4g}"
    if CHANNELS[channel].unit == "Pa":
        return _pressure_unit(channel, top_of(series.values), rig, stated, numbers)
    limits = limits_of(rig, name)
    choices = {"joint_angle": ("rad", "deg"), "length": ("m", "mm")}.get(channel)
    if choices and limits:
        slack = 0.25 * (limits[1] - limits[0])
        for unit in choices:
            scale = parse_unit(unit).scale
            if limits[0] - slack <= low * scale and high * scale <= limits[1] + slack:
                return unit, f"{numbers}, which in {unit} lies where the rig file allows it"
    most = max(abs(low), abs(high))
    if channel == "joint_angle":
        return ("rad" if most <= 6.3 else "deg"), numbers
    if channel == "length":
        return ("m" if most <= 3.0 else "mm"), numbers
    if channel in ("temperature", "ambient_temperature"):
        return ("K" if low > 200.0 else "degC"), numbers
    usual = CHANNELS[channel].unit.replace("N m", "Nm")
    if most > (_VOLTS if usual == "V" else _NEWTONS):
        return "", f"{numbers}, too large for {usual}"
    return usual, f"{numbers}, and {usual} is what it is usually logged in"


def _pressure_unit(
    channel: str, top: float, rig: Rig | None, stated: str, numbers: str
) -> tuple[str, str]:
    """The unit in which the largest value is what the supply has or less; a muscle may hardly have
    been filled, which is thought of in bar alone.
    """
    rated = (
        [float(table["initial_pressure"]) for table in rig.tables("supply").values()] if rig else []
    )
    reference = max([*rated, 0.0]) or 8e5
    least, most = (0.6, 1.5) if channel == "supply_pressure" else (0.03, 1.1)
    if channel == "ambient_pressure":
        reference, least, most = AMBIENT, 0.5, 1.15

    def fits(unit: str) -> bool:
        share = top * parse_unit(unit).scale / reference
        hardly = unit == "bar" and channel not in ("supply_pressure", "ambient_pressure")
        return (least <= share or hardly) and share <= most

    if stated and fits(stated):
        return stated, f"{numbers}, and another pressure of the log is in {stated}"
    fitting = [unit for unit in PRESSURE_UNITS if fits(unit)]
    if not fitting:
        return (
            "",
            f"{numbers}, which is no likely pressure here in any of {', '.join(PRESSURE_UNITS)}",
        )
    others = f"; {' or '.join(fitting[1:])} would fit, too" if fitting[1:] else ""
    return fitting[0], numbers + others
