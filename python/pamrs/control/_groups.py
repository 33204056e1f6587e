"""Joints of a rig, the groups of muscles that turn each, and the valve or regulator of a group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pamrs.channels import dotted
from pamrs.errors import ParameterError
from pamrs.rig import Rig


def check_single(rig: Rig, blocks: tuple[str, ...], needed: str) -> None:
    """Refuse a rig with none or several of a kind of block."""
    for block in blocks:
        if (count := len(rig.tables(block))) != 1:
            raise ParameterError(
                f"rig {rig.name!r} has {count} [{block}]: a controller's model {needed}"
            )


def beyond_sine(rig: Rig, joint: str) -> tuple[str, ...]:
    """Parameters, as ``key = value``, with which the holding torque of a joint is not a constant
    times the sine of its angle.
    """
    if rig.tables("load"):
        return ("load.kind = 'mass', whose weight is the same everywhere",)
    arm, own = next(iter(rig.tables("arm").values())), rig.tables("joint")[joint]
    found = [("arm", arm, key, "rad") for key in ("base_angle", "centre_angle")]
    found.append((dotted("joint", joint), own, "stiffness", "N m/rad"))
    return tuple(
        f"{block}.{key} = {table[key]:g} {unit}"
        for block, table, key, unit in found
        if table.get(key, 0.0) != 0.0
    )


@dataclass(frozen=True)
class Feed:
    """Input that sets the pressure of a chamber.

    Attributes
    ----------
    input : {"valve_command", "supply_command", "pressure"}
        Keyword of :meth:`pamrs.Simulator.step`: a valve's volts, a regulator's set pressure, or the
        pressure itself where the rig has neither.
    name : str
        Of the valve, regulator or chamber.
    supply : str or None
        Name of the supply behind it, through lines; None where there is none.
    source : str or None
        Channel of the pressure that it fills from: the supply's, or that of a chamber in front of
        the valve.
    """

    input: str
    name: str
    supply: str | None
    source: str | None = None


@dataclass(frozen=True)
class Group:
    """Muscles that share a chamber, on one joint.

    Attributes
    ----------
    chamber, joint : str
        Their names.
    muscles : tuple of str
    feed : Feed
    """

    chamber: str
    joint: str
    muscles: tuple[str, ...]
    feed: Feed


def joints_of(rig: Rig) -> tuple[str, ...]:
    """Names of a rig's joints, base first; one without a name where a mass hangs from the muscles.

    Parameters
    ----------
    rig : Rig

    Returns
    -------
    tuple of str

    Raises
    ------
    ParameterError
        If it has no muscle, joint or arm; if a load frame prescribes the length of its muscles.
    """
    for name, load in rig.tables("load").items():
        if load.get("kind", "mass") == "frame":
            raise ParameterError(
                f"rig {rig.name!r}: [{dotted('load', name)}] is a frame, which prescribes the "
                "length of the muscles, so that no controller moves them: follow a force by a "
                "pressure (pamrs.control.torque_line has it, a line in the pressure), or take a "
                "load of kind 'mass'"
            )
    if rig.tables("load"):
        return ("",)
    for block in ("muscle", "joint", "arm"):
        if not rig.tables(block):
            raise ParameterError(
                f"rig {rig.name!r} has no [{block}]: a controller's model needs muscle, joint and "
                "arm"
            )
    links = rig.ports("link")
    if not links:
        return tuple(rig.tables("joint"))
    return tuple(_short(ports["joint"]) for ports in links.values())


def lengths_of(rig: Rig) -> tuple[float, float] | None:
    """Shortest and longest length of the muscles of a mass that hangs [m]; None where none hangs.

    Parameters
    ----------
    rig : Rig

    Returns
    -------
    tuple of (float, float) or None
    """
    for load in rig.tables("load").values():
        if load.get("kind", "mass") == "mass":
            return float(load["min_length"]), float(load["max_length"])
    return None


def groups_of(rig: Rig) -> tuple[Group, ...]:
    """The groups of muscles of a rig, in the order of its chambers.

    Parameters
    ----------
    rig : Rig

    Returns
    -------
    tuple of Group

    Raises
    ------
    ParameterError
        If the muscles of a chamber turn different joints, or two valves feed one chamber.
    """
    muscles = {
        name: (_short(ports["chamber"]), _short(ports["joint"]))
        for name, ports in rig.ports("muscle").items()
    }
    found = []
    ways = (rig.ports("valve"), rig.ports("line"), rig.tables("supply"))
    for chamber in rig.tables("chamber"):
        here = tuple(name for name, (place, _) in muscles.items() if place == chamber)
        turned = {muscles[name][1] for name in here}
        if len(turned) > 1:
            raise ParameterError(
                f"rig {rig.name!r}: the muscles of {dotted('chamber', chamber)} turn the joints "
                f"{', '.join(sorted(turned))}; a controller's model needs a chamber for each"
            )
        if here:
            found.append(Group(chamber, turned.pop(), here, _feed(rig.name, chamber, *ways)))
    return tuple(found)


def direct_regulators(rig: Rig) -> tuple[str, ...]:
    """Names of the regulators by which a rig is driven: those whose air reaches muscles without a
    valve, or that feed no valve. What lies between is passed: lines, and chambers without muscles.

    Parameters
    ----------
    rig : Rig

    Returns
    -------
    tuple of str
    """
    pulling = {ports["chamber"] for ports in rig.ports("muscle").values()}
    lines = rig.ports("line")
    ways = [
        {ports["from"], ports["to"], dotted("line", name)} - {""} for name, ports in lines.items()
    ]
    taken = {ports["from"] for ports in rig.ports("valve").values()}
    found = []
    for name, table in rig.tables("supply").items():
        reached, new = set(), {dotted("supply", name)}
        while new:
            reached |= new
            here = new - pulling
            new = set().union(*(way for way in ways if way & here)) - reached
        if table.get("kind") == "regulator" and (reached & pulling or not reached & taken):
            found.append(name)
    return tuple(found)


def highest_pressure(rig: Rig) -> float:
    """The largest gauge pressure that a controller may ask for by default [Pa]: what the supplies
    hold at first, or ``max_pressure`` of ``[limits]`` where that is less, or a regulator is set by
    the controller itself.

    Raises
    ------
    ParameterError
        If the rig says neither.
    """
    supplies = rig.tables("supply")
    direct = direct_regulators(rig)
    held = [
        float(supply["initial_pressure"]) for name, supply in supplies.items() if name not in direct
    ]
    stated = rig.limits.get("max_pressure")
    if stated is not None:
        held = [min([float(stated), *held])] if held else [float(stated)]
    if not held:
        what = "regulators without valves" if supplies else "no [supply]"
        raise ParameterError(
            f"rig {rig.name!r} has {what}: the pressure limit cannot be taken from it; give "
            "pressure_limit, or [limits] max_pressure in the rig"
        )
    return max(held)


def _short(block: str) -> str:
    """Name of a block without its kind: ``"joint.elbow"`` as ``"elbow"``, ``"joint"`` as ``""``."""
    return block.partition(".")[2]


def _feed(
    rig: str,
    chamber: str,
    valves: Mapping[str, Mapping[str, str]],
    lines: Mapping[str, Mapping[str, str]],
    supplies: Mapping[str, Mapping[str, Any]],
) -> Feed:
    """Find the valve or regulator that feeds a chamber, through lines."""
    here, passed = dotted("chamber", chamber), set()
    while here not in passed:
        passed.add(here)
        fed = [(name, ports) for name, ports in valves.items() if ports["to"] == here]
        if len(fed) > 1:
            raise ParameterError(
                f"rig {rig!r}: the valves {', '.join(n for n, _ in fed)} feed {here}; a "
                "controller's model needs one"
            )
        if fed:
            return Feed("valve_command", fed[0][0], *_behind(fed[0][1]["from"], lines))
        before = [ports["from"] for ports in lines.values() if ports["to"] == here]
        before += [dotted("line", name) for name, ports in lines.items() if ports["to"] == here]
        places = [place for place in before if place and place not in passed]
        supplied = [place for place in places if place.partition(".")[0] == "supply"]
        if supplied:
            name = _short(supplied[0])
            if supplies[name].get("kind") != "regulator":
                break
            return Feed("supply_command", name, name, dotted("supply_pressure", name))
        if not places:
            return Feed("pressure", chamber, None)
        here = places[-1]
    raise ParameterError(
        f"rig {rig!r}: nothing that can be commanded feeds {dotted('chamber', chamber)}; a valve "
        "or a regulator is needed"
    )


def _behind(place: str, lines: Mapping[str, Mapping[str, str]]) -> tuple[str | None, str | None]:
    """Supply behind a valve, lines passed, and the channel of the pressure before the valve."""
    block, name = place.partition(".")[0], _short(place)
    if block == "supply":
        return name, dotted("supply_pressure", name)
    here, passed = place, set()
    while here not in passed:
        passed.add(here)
        for ports in lines.values():
            if ports["to"] == here and ports["from"]:
                here = ports["from"]
                break
        if here.partition(".")[0] == "supply":
            return _short(here), dotted("muscle_pressure", name)
    return None, None
