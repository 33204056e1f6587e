"""What no key of a rig alone shows: numbers of one block that do not go together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pamrs.rig.schema import BLOCKS, qualified, tables_of


def block_problems(model: Mapping[str, Any]) -> list[str]:
    """Problems within the blocks of a model.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`; a table with a value that could not be read (None) is passed
        over.

    Returns
    -------
    list of str
        One sentence each, with the block, the value and what is allowed.
    """
    problems: list[str] = []
    for block in BLOCKS:
        check = _CHECKS.get(block)
        for name, table in tables_of(model, block).items():
            if check is not None and None not in table.values():
                problems += check(qualified(block, name), table)
    gas = model["gas"]
    if gas is not None and gas["ambient_pressure"] is not None:
        problems += _vacuum(model, gas["ambient_pressure"])
    return problems


def muscle_problems(label: str, muscle: Mapping[str, Any]) -> list[str]:
    """What does not go together in a muscle; ``label`` is what the block is called,
    ``"muscle.flexor"``.
    """
    problems = []
    slope, offset = muscle.get("modulus_slope", []), muscle.get("modulus_offset", [])
    if len(slope) != len(offset):
        problems.append(
            f"{label}.modulus_slope has {len(slope)} values and {label}.modulus_offset "
            f"{len(offset)}; the same number is needed"
        )
    factors = muscle.get("extension_factors", [])
    if factors and len(factors) != 3:
        problems.append(f"{label}.extension_factors has {len(factors)} values; three are needed")
    problems += _map_problems(f"{label}.map", muscle) if "map_force" in muscle else []
    warmer = muscle.get("temperature", 0.0) - muscle.get("reference_temperature", 0.0)
    if muscle.get("softening", 0.0) * warmer > 1.0:
        side = "above" if warmer > 0.0 else "below"
        problems.append(
            f"{label}.softening = {muscle['softening']:g} 1/K is not allowed: a size of at most "
            f"{1.0 / abs(warmer):.4g} 1/K is needed, {abs(warmer):.4g} K {side} "
            f"{label}.reference_temperature"
        )
    thickness, diameter = muscle["wall_thickness"], muscle["rest_diameter"]
    if not thickness < diameter / 2:
        problems.append(
            f"{label}.wall_thickness = {thickness:g} m is not allowed: "
            f"less than half of {label}.rest_diameter = {diameter:g} m is needed"
        )
    return problems


def _map_problems(label: str, muscle: Mapping[str, Any]) -> list[str]:
    """What is wrong with a table of forces."""
    problems = []
    sizes = []
    for axis, most in (("pressure", 200), ("contraction", 400)):
        values = muscle[f"map_{axis}"]
        sizes.append(len(values))
        if not 2 <= len(values) <= most:
            problems.append(f"{label}.{axis} has {len(values)} values; from 2 to {most} are needed")
        if any(b <= a for a, b in zip(values, values[1:], strict=False)):
            problems.append(f"{label}.{axis} is not allowed: its values must rise")
    if len(muscle["map_force"]) != sizes[0] * sizes[1]:
        problems.append(
            f"{label}.force has {len(muscle['map_force'])} values; {sizes[0]} x {sizes[1]} are "
            "needed, a row over the contractions for each pressure"
        )
    return problems


def _valve(label: str, valve: Mapping[str, Any]) -> list[str]:
    """What is wrong with a valve's area table and its positions."""
    problems = _positions(label, valve)
    opening, fraction, label = valve["opening"], valve["fraction"], f"{label}.area_fraction"
    if len(opening) != len(fraction) or len(opening) < 2:
        return [
            *problems,
            f"{label}: opening has {len(opening)} values and fraction {len(fraction)}; the same "
            "number, two at least, is needed",
        ]
    if (
        opening[0] != 0.0
        or opening[-1] != 1.0
        or any(b <= a for a, b in zip(opening, opening[1:], strict=False))
    ):
        problems.append(f"{label}.opening = {opening} is not allowed: it must rise from 0 to 1")
    if any(b < a for a, b in zip(fraction, fraction[1:], strict=False)):
        problems.append(f"{label}.fraction = {fraction} is not allowed: it must not fall")
    return problems


def _positions(label: str, valve: Mapping[str, Any]) -> list[str]:
    """Positions of a spool that switches: two that are not the same, three around a closed one."""
    here, there = valve.get("with_current"), valve.get("without_current")
    if here is None or (here != there and (here != "either" or there == "closed")):
        return []
    needed = "'closed'" if here == "either" else f"another than '{here}'"
    return [
        f"{label}.without_current = {there!r} is not allowed: with {label}.with_current = "
        f"{here!r}, {needed} is needed"
    ]


def _rising(label: str, table: Mapping[str, Any], low: str, high: str, unit: str) -> list[str]:
    """Limits of a range that are the wrong way round."""
    if table[low] < table[high]:
        return []
    return [
        f"{label}.{high} = {table[high]:g} {unit} is not allowed: more than {label}.{low} = "
        f"{table[low]:g} {unit} is needed"
    ]


def _link(label: str, link: Mapping[str, Any]) -> list[str]:
    """A link that nothing holds against its joint: the arm's mass matrix could not be solved."""
    carried = link["mass"] * link["centre"] ** 2 + link["payload"] * link["length"] ** 2
    if link["inertia"] + carried > 0.0:
        return []
    return [
        f"{label} has no inertia about its joint (inertia + mass centre^2 + payload length^2 = 0 "
        "kg m2): more is needed"
    ]


def _vacuum(model: Mapping[str, Any], ambient: float) -> list[str]:
    """Chambers that begin below vacuum."""
    start = {name: table["initial_pressure"] for name, table in tables_of(model, "chamber").items()}
    return [
        f"{qualified('chamber', name)}.initial_pressure = {pressure:g} Pa (gauge) is not allowed: "
        f"more than -gas.ambient_pressure = {-ambient:g} Pa is needed"
        for name, pressure in start.items()
        if pressure is not None and not pressure > -ambient
    ]


_CHECKS: dict[str, Callable[[str, Mapping[str, Any]], list[str]]] = {
    "valve": _valve,
    "muscle": muscle_problems,
    "joint": partial(_rising, low="min_angle", high="max_angle", unit="rad"),
    "link": _link,
    "load": partial(_rising, low="min_length", high="max_length", unit="m"),
}
