"""The command line of blinded trials: ``pamrs prove``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from pamrs.cli._shared import AllowOutside, note

INCOMPLETE: Final = 3
"""Exit code when a case could not be diagnosed."""


def prove_command(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Folder with cases/NAME/case.toml (or NAME/case.toml), and maybe manifest.json."
        ),
    ],
    results: Annotated[
        Path | None,
        typer.Option(help="Where NAME/out.json and run.json go; by default results in the folder."),
    ] = None,
    jobs: Annotated[int, typer.Option(help="Cases at a time.")] = 1,
    limit: Annotated[int | None, typer.Option(help="Only the first so many cases.")] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Diagnose again what has a result.")
    ] = False,
    allow_outside: AllowOutside = False,
    timeout: Annotated[
        float, typer.Option(help="Seconds after which a case is given up.")
    ] = 1800.0,
) -> None:
    """Diagnose every case of a folder, each in a process that is given that case alone; answer keys
    are not opened.

    A run that was stopped goes on where it was. Exit code 0: every case has a result; 3: some case
    could not be diagnosed.
    """
    from pamrs.diagnosis.prove import prove

    proof = prove(
        folder,
        results=results,
        jobs=jobs,
        limit=limit,
        fresh=fresh,
        timeout=timeout,
        say=note,
        allow_outside=allow_outside,
    )
    typer.echo(proof.table())
    for name, error in proof.failed.items():
        typer.echo(f"{name}: {error}")
    note(f"written: {proof.results}")
    if proof.failed:
        raise typer.Exit(INCOMPLETE)
