"""Which series of a log is likely which channel: by name, unit and range."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from pamrs.channels import channel_of, dotted
from pamrs.recordings._recording import CHANNELS
from pamrs.recordings._suspicion import PRESSURE_UNITS, PRESSURES, limits_of, top_of
from pamrs.recordings.logs import Series, understood_unit
from pamrs.rig import Rig
from pamrs.units import parse_unit, same_dimension

__all__ = ["Match", "channels_of", "matched", "words_of"]

#: Words of names, strong ones and weak ones. A strong word alone is enough.
_WORDS: Final[dict[str, tuple[frozenset[str], frozenset[str]]]] = {
    channel: (frozenset(strong.split()), frozenset(weak.split()))
    for channel, strong, weak in (
        ("valve_command", "valve ventil servo spool uvalve", "u command cmd ao voltage volt input"),
        ("supply_command", "setpoint regulator psoll pset", "set soll command cmd"),
        (
            "supply_pressure",
            "supply tank reservoir source versorgung psup ps psupply ptank",
            "pressure druck p air",
        ),
        ("line_pressure", "line hose tube leitung schlauch pline", "pressure druck p"),
        (
            "muscle_pressure",
            "muscle pam mckibben muskel chamber kammer pm p1 pmuscle",
            "pressure druck p actuator bladder",
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
            "ambient umgebung room raum umgebungstemperatur raumtemperatur tamb troom",
            "temperature temp temperatur thermo tc umgebungstemperatur raumtemperatur tamb troom",
        ),
        ("reference", "reference ref desired target sollwert", "soll wanted"),
    )
}
#: Channels that a diagnosis sets the rig by, or that stand in a gas: no weak word, and no unit,
#: names them alone.
_ONLY_NAMED: Final = frozenset({"ambient_temperature", "temperature"})
#: Channels of files that are played, which no log has.
_PLAYED: Final = frozenset({"pressure_command"})
_NOT: Final = frozenset(
    ("rate", "velocity", "speed", "dot", "acc", "effort", "stamp", "sec", "nanosec", "seq", "id")
    + ("status", "flag", "error")
)


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
    offset : float
        Added to them, in that unit: an absolute pressure becomes gauge.
    said : bool
        Whether the log says the unit; else it was chosen by the range.
    time : dict
        The key ``time``; empty where the log has a clock for it.
    hold : bool
        Logged on change.
    """

    channel: str
    series: Series
    unit: str
    offset: float = 0.0
    said: bool = True
    time: dict[str, Any] = field(default_factory=dict)
    hold: bool = False

    def with_clock(self, time: dict[str, Any], hold: bool) -> Match:
        """The same with a clock."""
        return replace(self, time=time, hold=hold)

    def si(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Its values in SI."""
        unit = parse_unit(self.unit)
        return np.asarray((self.series.values + self.offset) * unit.scale + unit.offset)


def words_of(name: str) -> list[str]:
    """Words of a name in small letters: ``AI/pMuscle_1`` has ai, p, muscle, 1."""
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", name)
    return [word for word in re.split(r"[^0-9a-zäöüß]+", parted.lower()) if word]


def channels_of(rig: Rig | None) -> list[str]:
    """The channels that a stand of this rig can have; all there are without a rig.

    Parameters
    ----------
    rig : Rig or None
        The rig.

    Returns
    -------
    list of str
        With the names of its blocks; at the end the ambient temperature, which has none.
    """
    if rig is None:
        return [name for name in CHANNELS if name != "time" and name not in _PLAYED]
    kinds = (
        ("valve", "valve_command"),
        ("supply", "supply_pressure"),
        ("line", "line_pressure"),
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
    warm = [name for name, t in rig.tables("chamber").items() if t["gas"] == "energy_balance"]
    return [*found, *(dotted("temperature", name) for name in warm), "ambient_temperature"]


def matched(
    candidates: Sequence[Series], wanted: Sequence[str], rig: Rig | None
) -> tuple[list[Match], list[str]]:
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
    remarks : list of str
        Units that were chosen, and series whose unit keeps them from being what they are called.
    """
    remarks: list[str] = []
    pairs: list[tuple[float, int, int]] = []
    kinds = [channel_of(name) for name in wanted]
    for row, series in enumerate(candidates):
        for column, name in enumerate(wanted):
            score = _score(series, name, kinds.count(kinds[column]) > 1, remarks)
            if score > 0.0:
                pairs.append((-score, column, row))
    taken: dict[int, int] = {}
    for _, column, row in sorted(pairs):
        if column not in taken and row not in taken.values():
            taken[column] = row
    for column, row in _lonely(candidates, wanted, taken):
        taken[column] = row
    matches = []
    for column in sorted(taken):
        series, name = candidates[taken[column]], wanted[column]
        written = understood_unit(series.unit)
        if written is not None:
            matches.append(Match(name, series, written.unit, written.offset))
            continue
        unit, why = _unit_for(name, series, rig)
        remarks.append(f"{series.name} has no unit in the log: {unit} is assumed, {why}")
        matches.append(Match(name, series, unit, said=False))
    return matches, remarks


def _score(series: Series, name: str, several: bool, remarks: list[str]) -> float:
    """How well name and unit fit; 0 where they do not."""
    good = series.values[np.isfinite(series.values)]
    if series.labels or good.size < 2:
        return 0.0
    channel, _, block = name.partition(".")
    words = words_of(series.name)
    if series.name == name:
        score = 10.0
    else:
        strong, weak = _WORDS[channel]
        score = 3.0 * len(strong & set(words)) + 1.0 * len(weak & set(words))
        if channel in _ONLY_NAMED:
            # where it is says more than that it is a temperature
            place, what = (weak, strong) if channel == "temperature" else (strong, weak)
            elsewhere = _WORDS["ambient_temperature"][0] | _WORDS["supply_pressure"][0] - {"tank"}
            if channel == "temperature" and elsewhere & set(words):
                return 0.0
            if not place & set(words) or not (what & set(words) or understood_unit(series.unit)):
                return 0.0
            score += 2.0 if strong & set(words) else 0.0
        score += 2.0 if channel in "_".join(words) else 0.0
    if block and set(words_of(block)) <= set(words):
        score += 2.0
    elif block and several:  # a name is needed where there is more than one
        return 0.0
    if score == 0.0 or (_NOT & set(words) and series.name != name):
        return 0.0
    written = understood_unit(series.unit)
    if written is not None:
        if not any(same_dimension(written.unit, unit) for unit in _units(channel)):
            text = (
                f"{series.name} is called like {channel}, but is in {series.unit}: give from and "
                "to, its calibration"
            )
            if score >= 3.0 and same_dimension(written.unit, "V") and text not in remarks:
                remarks.append(text)
            return 0.0
        score += 2.0
    return score - (0.5 if np.ptp(good) == 0.0 else 0.0)


def _units(channel: str) -> tuple[str, ...]:
    return ("rad", "Pa") if channel == "reference" else (CHANNELS[channel].unit,)


def _lonely(
    candidates: Sequence[Series], wanted: Sequence[str], taken: dict[int, int]
) -> list[tuple[int, int]]:
    """The only series of a dimension, for the only channel of that dimension that is left."""
    found = []
    for column, name in enumerate(wanted):
        if channel_of(name) in _ONLY_NAMED:
            continue
        unit = CHANNELS[channel_of(name)].unit
        rivals = [other for other in wanted if CHANNELS[channel_of(other)].unit == unit]
        rows = [
            row
            for row, series in enumerate(candidates)
            if (written := understood_unit(series.unit)) and same_dimension(written.unit, unit)
            if not _NOT & set(words_of(series.name)) and not _named_otherwise(series, name)
        ]
        alone = column not in taken and rivals == [name] and len(rows) == 1
        if alone and rows[0] not in taken.values():
            found.append((column, rows[0]))
    return found


def _named_otherwise(series: Series, name: str) -> bool:
    """Whether a series has the name of another channel."""
    words = set(words_of(series.name))
    return any(
        strong & words for channel, (strong, _) in _WORDS.items() if channel != channel_of(name)
    )


def _unit_for(name: str, series: Series, rig: Rig | None) -> tuple[str, str]:
    """A unit for a series without one, by the range of its values.

    Parameters
    ----------
    name : str
        The channel that it likely is.
    series : Series
        Its numbers.
    rig : Rig or None
        What the rig says of pressures, angles and lengths.

    Returns
    -------
    unit, why : str
    """
    channel = channel_of(name)
    good = series.values[np.isfinite(series.values)]
    low, high = (float(good.min()), float(good.max())) if good.size else (0.0, 0.0)
    numbers = f"its numbers are {low:.4g} to {high:.4g}"
    if channel in PRESSURES or channel == "supply_command":
        return _pressure_unit(channel, top_of(series.values), rig), numbers
    limits = limits_of(rig, name)
    choices = {"joint_angle": ("rad", "deg"), "length": ("m", "mm")}.get(channel)
    if choices and limits:
        slack = 0.25 * (limits[1] - limits[0])
        for unit in choices:
            scale = parse_unit(unit).scale
            if limits[0] - slack <= low * scale and high * scale <= limits[1] + slack:
                return unit, f"{numbers}, which in {unit} lies where the rig file allows it"
    if channel == "joint_angle":
        return ("rad" if max(abs(low), abs(high)) <= 6.3 else "deg"), numbers
    if channel == "length":
        return ("m" if max(abs(low), abs(high)) <= 3.0 else "mm"), numbers
    if channel in ("temperature", "ambient_temperature"):
        return ("K" if low > 200.0 else "degC"), numbers
    return CHANNELS[channel].unit.replace("N m", "Nm"), numbers


def _pressure_unit(channel: str, top: float, rig: Rig | None) -> str:
    """The unit in which the largest value is what the supply has or less; a muscle may hardly have
    been filled, which is thought of in bar alone.
    """
    rated = (
        [float(table["initial_pressure"]) for table in rig.tables("supply").values()] if rig else []
    )
    reference = max([*rated, 0.0]) or 8e5
    least, most = (0.6, 1.5) if channel == "supply_pressure" else (0.03, 1.1)
    for unit in PRESSURE_UNITS:
        share = top * parse_unit(unit).scale / reference
        if least <= share <= most or (
            unit == "bar" and channel != "supply_pressure" and share < most
        ):
            return unit
    return "bar"
