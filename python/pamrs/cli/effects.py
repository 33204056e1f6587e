"""``pamrs effects``: the catalogue of omitted physics, or one effect of it."""

from __future__ import annotations

from typing import Annotated

import typer

from pamrs.cli.completion import beginning, effect_ids


def effects_command(
    effect: Annotated[
        str | None,
        typer.Argument(
            metavar="ID",
            help="An effect of the catalogue; without it, all are listed.",
            autocompletion=beginning(effect_ids),
        ),
    ] = None,
) -> None:
    """List the physics that a model can leave out, or print one effect: equation, fingerprint,
    rivals, parameters, rig file.
    """
    from pamrs.effects import text

    typer.echo(text.overview() if effect is None else text.description(effect))
