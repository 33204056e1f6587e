"""``pamrs rig``: check a rig file, or write one to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pamrs import rigs
from pamrs._files import resolved
from pamrs._writing import write_atomically
from pamrs.cli._shared import RigName, check_new, rig_named
from pamrs.cli.completion import beginning
from pamrs.units import from_si, with_unit

if TYPE_CHECKING:
    from pamrs.rig import Rig

rig_app = typer.Typer(help="Work with rig files.")


@rig_app.command("check")
def _rig_check(file: RigName) -> None:
    """Check a rig file, say what is connected to what, and list its parameters, and those of its
    effects with their bounds, in the units of the file; what is possible and hardly meant is a
    warning.
    """
    from pamrs.simulation import core_rig

    rig = rig_named(file)
    # what only the whole model shows: lengths that the muscle cannot have, angles that the tendon
    # does not reach
    core_rig(rig)
    for line in rig.wiring:
        typer.echo(line)
    shown = {}
    for name, own in rig.parameters.items():
        unknown = with_unit("unknown", rig.units.of(name, own.unit))
        value = rig.units.said(name, own.unit, own.value, own.tol, ".6g") if own.known else unknown
        shown[name] = value
    shown |= _of_effects(rig)
    shown |= {name: f"{shown[name]}, another one in each recording" for name in rig.own}
    width = max(map(len, shown), default=0)
    for name, text in shown.items():
        typer.echo(f"{name:<{width}}  {text}")
    for caution in rig.cautions:
        typer.echo(f"warning: {caution}")
    count = len(rig.effects)
    typer.echo(
        f"{file}: rig {rig.name!r} is valid, {len(rig.parameters)} parameters, {count} "
        f"effect{'s' * (count != 1)}"
    )


def _of_effects(rig: Rig) -> dict[str, str]:
    """Value, standard deviation and bounds of every effect parameter, by its full name."""
    if not rig.effects:
        return {}
    from pamrs.effects import EFFECTS
    from pamrs.rig.schema import qualified

    shown = {}
    several = [entry["id"] for entry in rig.effects]
    for entry in rig.effects:
        own = entry["id"]
        full = qualified(own, entry.get("at", ""))
        spread = rig.effect_std.get(own if several.count(own) == 1 else full, {})
        for p in EFFECTS[own].form(entry.get("form", "")).parameters:
            name, std = f"{full}.{p.name}", spread.get(p.name, 0.0)
            unit = rig.units.of(name, p.unit)
            low, high = (from_si(end, unit, p.unit) for end in (p.lower, p.upper))
            known = rig.units.said(name, p.unit, entry["parameters"][p.name], std, ".6g")
            shown[name] = f"{known}; allowed from {with_unit(f'{low:g} to {high:g}', unit)}"
    return shown


@rig_app.command("new")
def _rig_new(
    file: Annotated[Path, typer.Argument(help="The file to write; it must not be there yet.")],
    like: Annotated[
        str,
        typer.Option(
            help=f"Rig of the package to begin with: {', '.join(rigs.names())}.",
            autocompletion=beginning(rigs.names),
        ),
    ] = "shoulder",
    name: Annotated[
        str | None,
        typer.Option(
            help="What to call the rig; by default as the file, or its folder if that is rig.toml."
        ),
    ] = None,
    gas: Annotated[
        str,
        typer.Option(
            help="Law of the chambers: energy_balance, or coefficients as the packaged rig has it."
        ),
    ] = "energy_balance",
) -> None:
    """Write a rig file to begin with, every key explained in comments."""
    file.parent.mkdir(parents=True, exist_ok=True)
    check_new(file)
    called = resolved(file).parent.name if file.stem == "rig" else file.stem
    called = (called or file.stem) if name is None else name
    text = rigs.template(like, called, gas)
    write_atomically(file, text)
    if gas == "energy_balance" and rigs.named(like).tables("chamber"):
        typer.echo(
            "the gas of this file is an energy balance, which keeps mass; that of the packaged "
            f"{like} has coefficients of the literature: --gas coefficients writes it as it is"
        )
    typer.echo(f"written: {file}; change it, then: pamrs rig check {file}")
