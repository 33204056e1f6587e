"""The command line: ``pamrs diagnose``, ``effects``, ``fit``, ``import``, ``simulate``,
``size``, ``rig``, ...

Results go to standard output, progress and errors to standard error. The exit code is 0 when the
command did its work (a diagnosis that finds nothing missing included), 1 when it was interrupted, 2
when the input is wrong or an output could not be written from the start (nothing was done then), 4
when the work was done, but a file of it or its text could not be written. Everything heavy is
imported inside the command that needs it, so that ``pamrs --help`` answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Annotated, Final

import typer

from pamrs.cli._shared import with_quiet
from pamrs.cli._streams import guarded
from pamrs.cli.campaign import campaign_command
from pamrs.cli.compare import compare_command
from pamrs.cli.design import design_app
from pamrs.cli.diagnose import diagnose_command
from pamrs.cli.effects import effects_command
from pamrs.cli.example import example_command
from pamrs.cli.fit import fit_app
from pamrs.cli.import_logs import import_command
from pamrs.cli.replay import replay_command
from pamrs.cli.rig import rig_app
from pamrs.cli.simulate import simulate_command
from pamrs.cli.size import size_command
from pamrs.cli.studio import studio_command
from pamrs.errors import NotWrittenError

__all__ = ["NOT_WRITTEN", "app", "main"]

NOT_WRITTEN: Final = 4
"""Exit code when the work was done, but a file of its result could not be written."""
_MOST_SHOWN: Final = 1500
"""Characters of an error's message that are shown: less than a screen."""
_TYPER_INTERRUPTED: Final = 130
"""Exit code of typer after an interrupt, in its newer versions."""

app = typer.Typer(
    name="pamrs",
    help=(
        "Simulate pneumatic artificial muscles, and find the physics that a simulation leaves out."
    ),
    epilog=(
        "Exit codes: 0 done; 1 interrupted; 2 wrong input, nothing done; 4 done, but a file or the "
        "text could not be written."
    ),
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
_GROUPS: Final = {"rig": rig_app, "fit": fit_app, "design": design_app}
_COMMANDS: Final[dict[str, Callable[..., None]]] = {
    "simulate": simulate_command,
    "effects": effects_command,
    "example": example_command,
    "import": import_command,
    "replay": replay_command,
    "size": size_command,
    "studio": studio_command,
    "compare": compare_command,
    "diagnose": diagnose_command,
    "campaign": campaign_command,
}
for _name, _group in _GROUPS.items():
    app.add_typer(_group, name=_name)
for _name, _function in _COMMANDS.items():
    app.command(_name)(_function)
for _group in (app, *_GROUPS.values()):
    for _command in _group.registered_commands:
        _command.callback = _command.callback and with_quiet(_command.callback)


def _print_version(wanted: bool) -> None:
    if wanted:
        from pamrs import __version__

        typer.echo(f"pamrs {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Simulate pneumatic artificial muscles, and find the physics that a simulation leaves out."""


def _one_line(error: BaseException) -> str:
    """The message of an error on one line, its kind where there is no message."""
    parts = [line.strip().removeprefix("- ") for line in str(error).splitlines() if line.strip()]
    if len(parts) > 1:
        parts = [f"{parts[0].rstrip(':')}: {parts[1]}", *parts[2:]]
    return "; ".join(parts) or type(error).__name__


def _refuse(text: str) -> None:
    """Print an error, at most a screen of it."""
    if len(text) > _MOST_SHOWN:
        half = _MOST_SHOWN // 2
        text = f"{text[:half]} [{len(text) - 2 * half} characters left out] {text[-half:]}"
    typer.echo(f"pamrs: error: {text}", err=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``pamrs``; those of this process by default.

    Returns
    -------
    int
        Exit code: 0 done, 1 interrupted, 2 wrong input (one line on standard error says what), 4
        done, but a file or the text could not be written.

    Examples
    --------
    >>> main(["rig", "check", "no_such_file.toml"])
    2
    """
    words = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    with guarded() as lost:
        code = _run(words)
    if not lost:
        return code
    with guarded():
        _refuse(f"not written: {'; '.join(lost)}")
    return code or NOT_WRITTEN


def _run(words: list[str]) -> int:
    """Run a command, or say to a shell how it may go on; the exit code."""
    command = typer.main.get_command(app)
    try:
        code = command.main(args=words, prog_name="pamrs", standalone_mode=False)
        if code == _TYPER_INTERRUPTED:
            raise KeyboardInterrupt
    except (KeyboardInterrupt, EOFError, typer.Abort):
        typer.echo("pamrs: interrupted", err=True)
        return 1
    except NotWrittenError as error:
        _refuse(_one_line(error))
        return NOT_WRITTEN
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        _refuse(f"{where}{error.strerror or _one_line(error)}")
        return 2
    except ValueError as error:
        _refuse(_one_line(error))
        return 2
    except Exception as error:
        from pamrs.errors import PamrsError

        usage = getattr(error, "format_message", None)
        if usage is None and not isinstance(error, PamrsError):
            raise
        _refuse(usage() if usage is not None else _one_line(error))
        return 2
    return int(code or 0)
