"""The command line of lifting: ``pamrs lift``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from pamrs._writing import check_writable
from pamrs.cli._shared import RigName, document, exact, file_of, json_help, naming, rig_named, write

SCHEMA: Final = "pamrs.lift/1"


def lift_command(
    rig: RigName,
    pressure: Annotated[
        str | None,
        typer.Option(help='Gauge pressure, like "8 bar"; that of the supply by default.'),
    ] = None,
    payload: Annotated[
        str | None, typer.Option(help='Mass at the tip, like "120 kg"; that of the rig by default.')
    ] = None,
    to: Annotated[
        str | None,
        typer.Option(
            help='How far it is to be lifted, like "90 deg"; to the upper stop by default.'
        ),
    ] = None,
    png: Annotated[Path | None, typer.Option(help="Write a picture.")] = None,
    json: Annotated[Path | None, typer.Option(help=json_help(SCHEMA))] = None,
) -> None:
    """Say what an arm lifts and holds at a pressure, up to which angle, and how much it could lift
    at most.
    """
    check_writable(png, file_of(json))
    from pamrs.design import lift

    loaded = rig_named(rig)
    if payload is not None:
        mass = exact("payload", payload, "mass")
        if "arm.payload" in loaded.parameters:
            with naming("payload", payload):
                loaded = loaded.with_parameters({"arm.payload": mass})
    result = lift(
        loaded,
        pressure=None if pressure is None else exact("pressure", pressure, "pressure"),
        to=None if to is None else exact("to", to, "angle"),
    )
    write({json: document(SCHEMA, **result.to_dict()), png: result.figure}, result.summary())
