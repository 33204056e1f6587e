"""``pamrs studio``: a page on this computer, for who has a rig and logs but likes no shell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pamrs.cli._shared import note
from pamrs.errors import missing_package


def studio_command(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Case folder: a new one, or one that is there. Without it, a new temporary one."
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: a free one.")
    ] = 0,
    browser: Annotated[
        bool, typer.Option(help="Open the page in the browser of this computer.")
    ] = True,
) -> None:
    """Show a page in the browser: rig, logs, check, diagnosis, report, next experiment.

    It answers on this computer alone, to who has its address. Ctrl-C ends it.
    """
    try:
        from pamrs.studio import Studio, serve
    except ImportError as error:
        raise missing_package(error, "studio") from error
    import tempfile

    made = folder is None
    folder = Path(tempfile.mkdtemp(prefix="pamrs-studio-")) if folder is None else folder
    studio = Studio(folder)

    def ready(address: str) -> None:
        typer.echo(f"open {address}")
        note(f"case folder: {studio.folder}; Ctrl-C ends this page")
        if browser:
            import webbrowser

            webbrowser.open(address)

    serve(studio, port, ready=ready)
    if made and studio.empty():
        folder.rmdir()
        return
    typer.echo(f"case folder: {studio.folder}")
