"""``pamrs size``: how many muscles a force over a stroke needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from pamrs import library
from pamrs._checks import positive, refused
from pamrs._writing import check_writable
from pamrs.cli._shared import (
    QUANTITY,
    document,
    exact,
    file_of,
    json_help,
    named_muscle,
    naming,
    write,
)
from pamrs.cli.completion import beginning
from pamrs.errors import ParameterError
from pamrs.units import same_dimension

if TYPE_CHECKING:
    from pamrs.design.sizing import Candidate, Filling, Requirement

SCHEMA: Final = "pamrs.sizing/1"


def size_command(
    point: Annotated[
        list[str],
        typer.Option(
            help=(
                'POSITION:FORCE of all muscles together: "30 mm:7 kN", or "10 %:7 kN" of '
                "contraction; may be repeated."
            )
        ),
    ],
    muscle: Annotated[
        list[str] | None,
        typer.Argument(
            help="Names of the library (all by default), or rig files with --pressure.",
            autocompletion=beginning(library.names),
        ),
    ] = None,
    pressure: Annotated[
        str | None,
        typer.Option(
            help="Working pressure of every candidate; by default the highest of its tests."
        ),
    ] = None,
    valve: Annotated[
        str | None,
        typer.Option(
            help=(
                'Effective area "8.4 mm2" or sonic conductance "2 l/(s bar)"; the shoulder\'s '
                "valve by default."
            )
        ),
    ] = None,
    supply: Annotated[
        str | None, typer.Option(help="Pressure of the supply; 13.8 bar by default.")
    ] = None,
    dead_volume: Annotated[
        str | None, typer.Option(help='Volume of the tubing, like "20 ml"; none by default.')
    ] = None,
    core: Annotated[
        str | None,
        typer.Option(help='Diameter kept free in the middle of the bundle, like "40 mm".'),
    ] = None,
    max_count: Annotated[int, typer.Option(help="Largest bundle considered.")] = 100,
    json: Annotated[Path | None, typer.Option(help=json_help(SCHEMA))] = None,
) -> None:
    """Count the muscles that a force over a stroke needs, and compare candidates (dissertation
    3.2.3).
    """
    check_writable(file_of(json))
    from pamrs.design.sizing import size

    requirement = _requirement(point)
    filling = _filling(valve, supply, dead_volume)
    free = 0.0 if core is None else _size("core", core, "length", zero=True)
    working = None if pressure is None else _size("pressure", pressure, "pressure")
    candidates = [_candidate(name, working) for name in muscle or library.names()]
    result = size(candidates, requirement, filling=filling, core=free, max_count=max_count)
    lines = [
        f"required: {', '.join(point)}",
        f"valve {filling.area * 1e6:.4g} mm2, supply {filling.supply_pressure / 1e5:.4g} bar, "
        f"dead volume {filling.dead_volume * 1e3:.4g} l\n",
        result.table(),
        *_remarks(candidates),
    ]
    found = {
        "requirement": {"position": requirement.position, "points": requirement.array.tolist()},
        "filling": asdict(filling),
        "core": free,
        "max_count": max_count,
        **result.to_dict(),
    }
    write({json: document(SCHEMA, **found) if json else ""}, "\n".join(lines))


# ------------------------------------------------------------------------- inputs


def _size(name: str, text: str, dimension: str, *, zero: bool = False) -> float:
    """Number with a unit in SI, finite and above zero, or zero where that is allowed."""
    value = exact(name, text, dimension)
    with naming(name, text):
        return positive(dimension, value, zero=zero)


def _measures(text: str, unit: str) -> bool:
    """True where a number's unit is known and has the dimension of ``unit``."""
    match = QUANTITY.match(text)
    try:
        return match is not None and same_dimension(match["unit"] or "", unit)
    except ParameterError:
        return False


def _requirement(points: Sequence[str]) -> Requirement:
    """Points ``POSITION:FORCE``; all positions are strokes, or all are contractions."""
    from pamrs.design.sizing import Requirement

    pairs = []
    for text in points:
        position, colon, force = text.partition(":")
        if not colon:
            raise refused("--point", text, "POSITION:FORCE is needed, like '30 mm:7 kN'")
        pairs.append((position, force))
    kind = "contraction" if _measures(pairs[0][0], "1") else "stroke"
    if any(_measures(position, "1") != (kind == "contraction") for position, _ in pairs):
        raise ParameterError(
            f"--point: {', '.join(points)}: all positions must be strokes, or all contractions"
        )
    dimension = "dimensionless" if kind == "contraction" else "length"
    values = [
        (exact("point", position, dimension), exact("point", force, "force"))
        for position, force in pairs
    ]
    try:
        return Requirement(values, position=kind)
    except ParameterError as error:
        raise ParameterError(f"--point: {', '.join(points)}: {error}") from None


def _filling(valve: str | None, supply: str | None, dead_volume: str | None) -> Filling:
    """Supply and valve; what is not given is the shoulder's."""
    from pamrs.design.sizing import Filling

    others = {}
    if supply is not None:
        others["supply_pressure"] = _size("supply", supply, "pressure")
    if dead_volume is not None:
        others["dead_volume"] = _size("dead_volume", dead_volume, "volume", zero=True)
    if valve is None:
        return Filling(**others)
    if _measures(valve, "m3/(s Pa)"):
        return Filling.from_sonic_conductance(_size("valve", valve, "conductance"), **others)
    return Filling(area=_size("valve", valve, "area"), **others)


def _candidate(name: str, pressure: float | None) -> Candidate:
    """A muscle of the library, or of a rig file."""
    from pamrs.design.sizing import Candidate

    if name in library.names():
        return Candidate.from_library(name, pressure=pressure)
    muscle = named_muscle(name, "MUSCLE")[0]
    if pressure is None:
        raise ParameterError(
            f"MUSCLE = {name!r} is a rig file, which has no working pressure: give --pressure"
        )
    return Candidate(name, muscle, pressure)


# ------------------------------------------------------------------------ outputs


def _remarks(candidates: Sequence[Candidate]) -> list[str]:
    """Candidates of the library that would work beyond the pressures of their tests."""
    tested = {name: library.entry(name).max_pressure for name in library.names()}
    return [
        (
            f"{item.name}: {item.pressure / 1e5:.4g} bar is above the highest pressure of its "
            f"tests, {tested[item.name] / 1e5:.4g} bar"
        )
        for item in candidates
        if item.pressure > tested.get(item.name, item.pressure) * (1.0 + 1e-9)
    ]
