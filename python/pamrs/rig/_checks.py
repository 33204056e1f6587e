"""Problems of a rig that no single key shows: numbers of one block that contradict each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pamrs.rig._units import Units
from pamrs.rig.schema import BLOCKS, qualified, tables_of


def block_problems(model: Mapping[str, Any], units: Units) -> list[str]:
    """Problems within the blocks of a model.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`; a table with a value that could not be read (None) is passed
        over.
    units : Units
        Those of the file.

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
                problems += check(qualified(block, name), table, units)
    gas = model["gas"]
    if gas is not None and gas["ambient_pressure"] is not None:
        problems += _vacuum(model, gas["ambient_pressure"], units)
    return problems


def muscle_problems(label: str, muscle: Mapping[str, Any], units: Units) -> list[str]:
    """Contradictions between the parameters of a muscle; ``label`` is the full name of the block,
    ``"muscle.flexor"``, and ``units`` are those of its file.
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
            f"{label}.softening = {units.said(f'{label}.softening', '1/K', muscle['softening'])} "
            f"is not allowed: a size of at most {1.0 / abs(warmer):.4g} 1/K is needed, "
            f"{abs(warmer):.4g} K {side} {label}.reference_temperature"
        )
    thickness, diameter = muscle["wall_thickness"], muscle["rest_diameter"]
    if not thickness < diameter / 2:
        problems.append(
            f"{label}.wall_thickness = {units.said(f'{label}.wall_thickness', 'm', thickness)} is "
            f"not allowed: less than half of {label}.rest_diameter = "
            f"{units.said(f'{label}.rest_diameter', 'm', diameter)} is needed"
        )
    return problems


def _map_problems(label: str, muscle: Mapping[str, Any]) -> list[str]:
    """Problems of a table of forces: lengths of its axes, falling values, number of forces."""
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


def _valve(label: str, valve: Mapping[str, Any], units: Units) -> list[str]:
    """Problems of a valve: its positions, and the lengths and order of its area table."""
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


def _rising(
    label: str, table: Mapping[str, Any], units: Units, *, low: str, high: str, unit: str
) -> list[str]:
    """Limits of a range that are the wrong way round."""
    if table[low] < table[high]:
        return []
    least, most = (units.said(f"{label}.{end}", unit, table[end]) for end in (low, high))
    return [f"{label}.{high} = {most} is not allowed: more than {label}.{low} = {least} is needed"]


def _link(label: str, link: Mapping[str, Any], units: Units) -> list[str]:
    """A link that nothing holds against its joint: the arm's mass matrix could not be solved."""
    carried = link["mass"] * link["centre"] ** 2 + link["payload"] * link["length"] ** 2
    if link["inertia"] + carried > 0.0:
        return []
    return [
        f"{label} has no inertia about its joint (inertia + mass centre^2 + payload length^2 = 0 "
        "kg m2): more is needed"
    ]


def _vacuum(model: Mapping[str, Any], ambient: float, units: Units) -> list[str]:
    """Chambers that begin below vacuum."""
    found = []
    for name, table in tables_of(model, "chamber").items():
        label = f"{qualified('chamber', name)}.initial_pressure"
        pressure = table["initial_pressure"]
        if pressure is not None and not pressure > -ambient:
            found.append(
                f"{label} = {units.said(label, 'Pa', pressure)} (gauge) is not allowed: more than "
                f"-gas.ambient_pressure = {units.said(label, 'Pa', -ambient)} is needed"
            )
    return found


_CHECKS: dict[str, Callable[[str, Mapping[str, Any], Units], list[str]]] = {
    "valve": _valve,
    "muscle": muscle_problems,
    "joint": partial(_rising, low="min_angle", high="max_angle", unit="rad"),
    "link": _link,
    "load": partial(_rising, low="min_length", high="max_length", unit="m"),
}
