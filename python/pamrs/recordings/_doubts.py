"""Doubts of units: those that no channel can have, that physics contradicts or that a log does not
say, and pressures that are measured from another zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import CHANNELS, channel_of, dotted, with_trait
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.units import in_words, parse_unit, to_si

if TYPE_CHECKING:
    from pamrs.recordings._recording import Recording


AMBIENT: Final = 101325.0
PRESSURES: Final = with_trait("pressure")
_UNITS: Final = ("bar", "psi", "kPa", "MPa", "mbar", "Pa")
_TOP: Final = 0.995  # quantile that stands for the largest value, spikes left out
_LOW: Final = 0.005
_HIGHEST: Final = 25e5  # no pneumatic muscle or its supply goes higher, without a rig to ask [Pa]
_RATED: Final = (0.6, 1.5)  # a tank next to what the rig file says of it
_LEAST: Final = 0.02  # of the supply, which a muscle is filled to at the least
_OVER: Final = 1.15  # a muscle next to what feeds it
_CONNECTED: Final = 0.2  # of what the rig file says, from which a supply's gauge is believed
_REST: Final = 0.02  # share of the samples that rest at the lowest level
_STAYS: Final = 0.8  # of the samples near it that are there: a curve that passes has fewer
_NEAR: Final = 0.06  # of the ambient pressure, around which a level counts as ambient
_AMBIENT_OFF: Final = 0.02  # of the stated ambient pressure; a gauge and weather do less
_VOLTS: Final = 30.0  # no valve is commanded with more
_TURNS: Final = (-2.0 * np.pi, 2.0 * np.pi)  # [rad] no joint goes farther
_LENGTHS: Final = (1e-3, 3.0)  # [m] no muscle is shorter or longer
_STILL: Final = 0.02  # of the range that is allowed; a recording has more
_NEWTONS: Final = 5e4  # no muscle pulls more
_SLACK: Final = 0.25  # of an allowed range, which may be left at its ends


@dataclass(frozen=True)
class Suspicion:
    """A unit that is likely wrong.

    Attributes
    ----------
    channel : str
        Its name.
    said, likely : str
        The unit that was said, and the one that fits; ``"absolute"`` and ``"gauge"`` where the
        zero of a pressure is another one.
    text : str
        The evidence in plain words.
    """

    channel: str
    said: str
    likely: str
    text: str


def _level(values: Array, share: float) -> float:
    """A quantile; 0 where there is no value."""
    good = values[np.isfinite(values)]
    return float(np.quantile(good, share)) if good.size else 0.0


def _top_of(values: Array) -> float:
    """The largest value without spikes."""
    return _level(values, _TOP)


def ambient_of(rig: Rig) -> float:
    """The ambient pressure that a rig file says, absolute [Pa]."""
    return float((rig.model.get("gas") or {}).get("ambient_pressure", AMBIENT))


def limits_of(rig: Rig | None, name: str) -> tuple[float, float] | None:
    """Smallest and largest angle or length that a rig allows a joint or a load [SI].

    Parameters
    ----------
    rig : Rig or None
        The rig.
    name : str
        Channel, ``joint_angle`` or ``length`` with or without the name of a block.

    Returns
    -------
    lower, upper : float
        None where the rig does not say.
    """
    kinds = {
        "joint_angle": ("joint", "min_angle", "max_angle"),
        "length": ("load", "min_length", "max_length"),
    }
    if rig is None or channel_of(name) not in kinds:
        return None
    block, low, high = kinds[channel_of(name)]
    table = rig.tables(block).get(name.partition(".")[2])
    if table is None or table.get(low) is None or table.get(high) is None:
        return None
    return float(table[low]), float(table[high])


def suspicions(
    channels: Mapping[str, Array], said: Mapping[str, str], rig: Rig | None = None
) -> list[Suspicion]:
    """Ask of every channel whether its unit can be what it is said to be.

    Parameters
    ----------
    channels : mapping of str to (n,) array
        SI values by channel, as they come out with the units that are said.
    said : mapping of str to str
        The unit of each.
    rig : Rig, optional
        What is compared with: pressure of the tank, ends of the joint, lengths of the muscle.

    Returns
    -------
    list of Suspicion
        Empty where nothing speaks against the units.
    """
    found: list[Suspicion] = []
    for name, values in channels.items():
        unit, kind = said.get(name, ""), channel_of(name)
        if not unit or not np.isfinite(values).any():
            continue
        if kind in PRESSURES:
            found += _pressure(name, unit, channels, said, rig)
        elif kind in ("temperature", "ambient_temperature"):
            found += _temperature(name, unit, values, rig)
        elif kind in ("joint_angle", "length"):
            found += _range(name, unit, values, rig)
    return found


def _other(values: Array | float, said: str, other: str) -> Array | float:
    """SI values of a channel if its numbers were in the unit `other`, not in the unit `said`."""
    one, two = parse_unit(said), parse_unit(other)
    return (values - one.offset) / one.scale * two.scale + two.offset


def _as_large(one: str, two: str) -> bool:
    """True where two units have the same scale."""
    return abs(parse_unit(one).scale / parse_unit(two).scale - 1.0) < 1e-9


def unit_trouble(channel: str, unit: str) -> str:
    """Reason for which a channel cannot be in a unit; empty where it can."""
    troubles = []
    for si_unit in CHANNELS[channel].possible:
        try:
            to_si(1.0, unit, si_unit)
        except ParameterError as error:
            troubles.append(str(error))
        else:
            return ""
    return troubles[0]


# ---------------------------------------------------------------------- pressures


def _fed_by(
    name: str, channels: Mapping[str, Array], said: Mapping[str, str], rig: Rig | None
) -> tuple[float, str] | None:
    """The pressure that a channel is judged by, and what it is: of a muscle or a line what was
    recorded of its supply, or else what the rig file or a command says of it.

    A regulator may be set to anything: its largest command says how far, and nothing does where
    that was not recorded.
    """
    rated = _rated(name, channels, rig)
    if channel_of(name) == "supply_pressure":
        return rated
    recorded = _recorded_supply(channels, said, rig)
    # a gauge that is not connected, or that is the muscle's, tells nothing of its supply
    lowest = max(0.0, _level(channels[name], _LOW))
    connected = recorded > lowest and (rated is None or recorded > _CONNECTED * rated[0])
    return (recorded, "the recorded supply") if connected else rated


def _recorded_supply(
    channels: Mapping[str, Array], said: Mapping[str, str], rig: Rig | None
) -> float:
    """Highest recorded supply pressure [Pa], in its likeliest unit; 0 where none was recorded."""
    tops = [0.0]
    for name, values in channels.items():
        if channel_of(name) != "supply_pressure":
            continue
        tops.append(_top_of(values))
        unit = said.get(name, "")
        for wrong in _pressure(name, unit, channels, said, rig) if unit else ():
            tops[-1] = float(_other(tops[-1], unit, wrong.likely))
    return max(tops)


def _rated(name: str, channels: Mapping[str, Array], rig: Rig | None) -> tuple[float, str] | None:
    """Largest pressure [Pa] of a supply by rig file or regulator's command, and words on it."""
    rated: list[tuple[float, str]] = []
    for block, table in (rig.tables("supply") if rig else {}).items():
        other = channel_of(name) == "supply_pressure" and dotted("supply_pressure", block) != name
        if other or table["kind"] == "measured":
            continue
        command = channels.get(dotted("supply_command", block))
        if table["kind"] != "regulator":
            rated.append((float(table["initial_pressure"]), "the supply of the rig file"))
        elif command is not None:
            rated.append((_top_of(command), "the largest command of the regulator"))
    return max(rated) if rated and max(rated)[0] > 0.0 else None


def _pressure(
    name: str,
    unit: str,
    channels: Mapping[str, Array],
    said: Mapping[str, str],
    rig: Rig | None,
) -> Iterator[Suspicion]:
    values = channels[name]
    top = _top_of(values)
    source = _fed_by(name, channels, said, rig)
    supply = channel_of(name) == "supply_pressure"
    reference, what = source or (_HIGHEST, "what pneumatic muscles take")
    if source is None and rig is not None:  # a tank of the rig file that nothing feeds
        tanks = [
            float(table.get("initial_pressure", 0.0)) for table in rig.tables("chamber").values()
        ]
        reference = max([reference, *(_OVER * tank for tank in tanks)])
    least = _RATED[0] if supply and source else 0.0
    most = (_RATED[1] if supply else _OVER) if source else 1.0
    wrong = top > 0.0 and not least <= top / reference <= most
    if wrong and not _agrees(name, top, unit, channels, said):
        likely = _fitting(top, unit, reference, least or _LEAST, most)
        if likely:
            turned = float(_other(top, unit, likely))
            now, other = (_in_both(unit, "Pa", rig, value) for value in (top, reference))
            yield Suspicion(
                name,
                unit,
                likely,
                f"{name} is said to be in {unit}, so it would reach {now}, against {other} of "
                f"{what}; read as {likely} it reaches {_in_both(likely, 'Pa', rig, turned)}",
            )
            return
    yield from _absolute(name, unit, values, rig)


def _agrees(
    name: str, top: float, unit: str, channels: Mapping[str, Array], said: Mapping[str, str]
) -> bool:
    """True where another pressure in another unit is as high, which supports both units."""
    for other, values in channels.items():
        own = said.get(other, "")
        if other == name or not own or channel_of(other) not in (*PRESSURES, "supply_command"):
            continue
        if not _as_large(own, unit) and top / _OVER < _top_of(values) < top * _OVER:
            return True
    return False


def _fitting(top: float, unit: str, reference: float, least: float, most: float) -> str:
    """First other unit of pressure that puts the maximum between two shares of a reference, else
    "".
    """
    for other in _UNITS:
        fits = least <= float(_other(top, unit, other)) / reference <= most
        if fits and not _as_large(other, unit):
            return other
    return ""


def _absolute(name: str, unit: str, values: Array, rig: Rig | None) -> Iterator[Suspicion]:
    """Doubt pressures that rest at the ambient (likely absolute) or a vacuum (likely gauge)."""
    good = values[np.isfinite(values)]
    if good.size < 20:
        return
    ambient, low = AMBIENT if rig is None else ambient_of(rig), _level(good, _LOW)
    span = _top_of(good) - low
    near = 0.02 * max(span, 0.0) + 500.0
    rests, about = (float(np.mean(good <= low + width * near)) for width in (1.0, 2.0))
    passes = rests < max(_REST, _STAYS * about) or span < 0.2 * ambient
    if passes or channel_of(name) == "supply_pressure":
        return
    if abs(low - ambient) < _NEAR * ambient:
        yield Suspicion(
            name,
            "gauge",
            "absolute",
            f"{name} never falls below {in_words(unit, 'Pa', low)} and rests there for "
            f"{100 * rests:.0f} % of its samples: the ambient pressure, so its values are likely "
            f'absolute and not gauge; unit = "{unit}(a)" makes them gauge',
        )
    elif abs(low + ambient) < _NEAR * ambient:
        yield Suspicion(
            name,
            "absolute",
            "gauge",
            f"{name} rests at {in_words(unit, 'Pa', low)} for {100 * rests:.0f} % of its samples, "
            "a vacuum: its values are gauge pressures already, and the ambient pressure was "
            "subtracted once more",
        )


def _in_both(unit: str, si: str, rig: Rig | None, *values: float) -> str:
    """Values in the unit of the log, and in that of the rig file where it differs."""
    own = unit if rig is None else rig.units.usual(si)
    said = in_words(unit, si, *values)
    return said if _as_large(own, unit) else f"{said} ({in_words(own, si, *values)})"


# ------------------------------------------------------------- temperature, motion


def _temperature(name: str, unit: str, values: Array, rig: Rig | None) -> Iterator[Suspicion]:
    middle = float(np.nanmedian(values))
    for other in ("degC", "K", "degF"):
        turned = float(_other(middle, unit, other))
        if not 220.0 < middle < 400.0 and 250.0 < turned < 350.0:
            yield Suspicion(
                name,
                unit,
                other,
                f"{name} is said to be in {unit}, so it would be "
                f"{_in_both(unit, 'K', rig, middle)}; read as {other} it is "
                f"{_in_both(other, 'K', rig, turned)}",
            )
            return


def _room(name: str, rig: Rig | None) -> tuple[float, float, float]:
    """Limits of an angle or a length by the rig file, and what it may go beyond them; without a rig
    file those of every bench, and nothing [SI].
    """
    given = limits_of(rig, name)
    low, high = given or (_TURNS if channel_of(name) == "joint_angle" else _LENGTHS)
    return low, high, _SLACK * (high - low) if given else 0.0


def _range(name: str, unit: str, values: Array, rig: Rig | None) -> Iterator[Suspicion]:
    """Doubt the unit of an angle or a length outside the rig's limits, else the usual range."""
    angle = channel_of(name) == "joint_angle"
    low, high, slack = _room(name, rig)
    bottom, top = _level(values, _LOW), _top_of(values)

    def fits(first: float, last: float) -> bool:
        return low - slack <= first and last <= high + slack

    if fits(bottom, top) and not (slack and top - bottom < _STILL * (high - low)):
        return
    for other in ("deg", "rad", "mrad", "rev") if angle else ("m", "mm", "cm", "in", "um"):
        if _as_large(other, unit):
            continue
        first, last = (float(_other(edge, unit, other)) for edge in (bottom, top))
        if fits(first, last) and last - first > 5.0 * (top - bottom) * fits(bottom, top):
            ends = "the rig file allows" if slack else "possible are"
            si = "rad" if angle else "m"
            own = unit if rig is None else rig.units.usual(si)
            now, then, wide = (
                in_words(own, si, *ends) for ends in ((bottom, top), (first, last), (low, high))
            )
            yield Suspicion(
                name,
                unit,
                other,
                f"{name} is said to be in {unit}, so it would go from {now}, where {ends} {wide}; "
                f"read as {other} it goes from {then}",
            )
            return


# ------------------------------------------------------------- without a unit, absolute


def assumed_unit(name: str, values: Array, rig: Rig | None, stated: str) -> tuple[str, str]:
    """A unit for a channel without one, by the range of its values.

    Parameters
    ----------
    name : str
        The channel that it likely is.
    values : (n,) array
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
    good = values[np.isfinite(values)]
    low, high = (float(good.min()), float(good.max())) if good.size else (0.0, 0.0)
    numbers = f"its numbers are {low:.4g} to {high:.4g}"
    if CHANNELS[channel].unit == "Pa":
        return _pressure_unit(channel, _top_of(values), rig, stated, numbers)
    units = {"joint_angle": ("rad", "deg"), "length": ("m", "mm")}.get(channel)
    if units:
        first, last, slack = _room(name, rig)
        ends = {u: (low * parse_unit(u).scale, high * parse_unit(u).scale) for u in units}
        fit = [u for u, (a, b) in ends.items() if first - slack <= a and b <= last + slack]
        if len(fit) > 1:  # a rig hardly stays within so little of what it can do
            fit = [u for u in fit if ends[u][1] - ends[u][0] >= _STILL * (last - first)]
        where = "the rig file allows it" if slack else "it can be"
        if len(fit) != 1:
            return "", f"{numbers}, which does not lie in one of {', '.join(units)} where {where}"
        return fit[0], f"{numbers}, which in {fit[0]} lies where {where}"
    if channel in ("temperature", "ambient_temperature"):
        return ("K" if low > 200.0 else "degC"), numbers
    most, usual = max(abs(low), abs(high)), CHANNELS[channel].unit.replace("N m", "Nm")
    if most > (_VOLTS if usual == "V" else _NEWTONS):
        return "", f"{numbers}, too large for {usual}"
    return usual, f"{numbers}, and {usual} is what it is usually logged in"


def _pressure_unit(
    channel: str, top: float, rig: Rig | None, stated: str, numbers: str
) -> tuple[str, str]:
    """Unit of pressure with which the maximum fits the supply, and words on the choice."""
    supplies = rig.tables("supply").values() if rig else ()
    reference = max([0.0, *(float(table["initial_pressure"]) for table in supplies)]) or 8e5
    least, most = _RATED if channel == "supply_pressure" else (_LEAST, 1.1)
    if channel == "ambient_pressure":
        reference, least, most = AMBIENT, 0.5, 1.15

    def fits(unit: str) -> bool:
        share = top * parse_unit(unit).scale / reference
        hardly = unit == "bar" and channel not in ("supply_pressure", "ambient_pressure")
        return (least <= share or hardly) and share <= most

    if stated and fits(stated):
        return stated, f"{numbers}, and another pressure of the log is in {stated}"
    fitting = [unit for unit in _UNITS if fits(unit)]
    if not fitting:
        return "", f"{numbers}, which is no likely pressure here in any of {', '.join(_UNITS)}"
    if len(fitting) > 1:
        return "", f"{numbers}, which may be {' or '.join(fitting)}"
    return fitting[0], numbers


def subtracted(recorded: Array | None, stated: float | None, unit: str) -> tuple[float, str]:
    """Ambient pressure to subtract from absolute pressures to make them gauge.

    Parameters
    ----------
    recorded : (n,) array or None
        Recorded ambient pressure [Pa].
    stated : float or None
        That of the rig file [Pa].
    unit : str
        Of the log, for the words.

    Returns
    -------
    pressure : float
        The median of the recorded one, else the stated one, else the standard atmosphere [Pa].
    said : str
        Words that say so.
    """
    ambient, whose = AMBIENT, "the standard atmosphere, since nothing says another,"
    if stated is not None:
        ambient, whose = stated, "the ambient pressure of the rig file,"
    if recorded is not None and np.isfinite(recorded).any():
        ambient, whose = float(np.nanmedian(recorded)), "the recorded ambient pressure,"
        if stated is not None and abs(ambient - stated) > _AMBIENT_OFF * stated:
            whose += f" where the rig file says {in_words(unit, 'Pa', stated)},"
    return ambient, f"{whose} {in_words(unit, 'Pa', ambient)}, is subtracted"


def made_gauge(
    recording: Recording, absolute: Sequence[str], stated: float | None = None
) -> Recording:
    """A recording whose absolute pressures became gauge pressures.

    Parameters
    ----------
    recording : Recording
        As it was read.
    absolute : sequence of str
        Channels that were recorded as absolute pressures; the ambient pressure stays one.
    stated : float, optional
        Ambient pressure where none was recorded [Pa]; by default that of the standard atmosphere.

    Returns
    -------
    Recording
        With the median of the recorded ambient pressure, or else the stated one, subtracted, and
        a note for each channel that says so.
    """
    names = [name for name in absolute if channel_of(name) != "ambient_pressure"]
    if not names:
        return recording
    channels, notes = dict(recording.channels), dict(recording.notes)
    room = channels.get("ambient_pressure")
    for name in names:
        ambient, said = subtracted(room, stated, recording.said.get(name, ""))
        channels[name] = channels[name] - ambient
        note = f"was recorded as an absolute pressure: {said}"
        notes[name] = "; ".join([*filter(None, [notes.get(name)]), note])
    return replace(recording, channels=channels, notes=notes)
