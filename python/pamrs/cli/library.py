"""``pamrs library``: the muscles of the 2014 dissertation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pamrs._writing import check_writable
from pamrs.cli._shared import write
from pamrs.cli.completion import muscle_names


def library_command(
    name: Annotated[
        str | None,
        typer.Argument(
            help="A muscle of the library; without it, all are listed.",
            autocompletion=muscle_names,
        ),
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Write a rig file: a bench with this muscle.")
    ] = None,
) -> None:
    """List the muscles of the 2014 dissertation, or print one with the origin of each number."""
    check_writable(rig)
    if rig is not None and name is None:
        raise typer.BadParameter("--rig needs the NAME of a muscle")
    from pamrs.library import text

    if name is None:
        typer.echo(text.overview())
        return
    shown = text.description(name)
    from pamrs.library import entry
    from pamrs.rigs import bench

    write({rig: bench(entry(name).muscle, name).to_toml_text() if rig else ""}, shown)
