"""The command line: ``pamrs diagnose``, ``effects``, ``prove``, ``fit``, ``library``, ``lift``, ``simulate``, ``size``, ``rig``, ...

Results go to standard output, progress and errors to standard error. The exit code is 0 when the
command did its work (a diagnosis that finds nothing missing included), 2 when the input is wrong,
3 when ``prove`` has a case without a result.
Everything heavy is imported inside the command that needs it, so that ``pamrs --help`` answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from pamrs.cli_design import design_app
from pamrs.cli_effects import effects_command
from pamrs.cli_fit import fit_app
from pamrs.cli_library import library_command, size_command
from pamrs.cli_lift import lift_command
from pamrs.cli_prove import prove_command
from pamrs.cli_reproduce import reproduce_command
from pamrs.cli_shared import check_writable, exact, progress, rig_named, write
from pamrs.cli_simulate import simulate_command
from pamrs.rig_files import packaged

__all__ = ["app", "main"]

app = typer.Typer(
    name="pamrs",
    help="Simulate pneumatic artificial muscles, and find the physics that a simulation leaves out.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
rig_app = typer.Typer(help="Work with rig files.")
app.add_typer(rig_app, name="rig")
app.add_typer(fit_app, name="fit")
app.add_typer(design_app, name="design")
app.command("simulate")(simulate_command)
app.command("effects")(effects_command)
app.command("library")(library_command)
app.command("lift")(lift_command)
app.command("prove")(prove_command)
app.command("reproduce")(reproduce_command)
app.command("size")(size_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        from pamrs import __version__

        typer.echo(f"pamrs {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Simulate pneumatic artificial muscles, and find the physics that a simulation leaves out."""


@app.command("diagnose")
def _diagnose(
    case: Annotated[Path | None, typer.Argument(help="Folder with case.toml, rig.toml and the recordings.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write the report, one HTML file.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write the result (schema pamrs.diagnosis/1).")] = None,
    png: Annotated[Path | None, typer.Option(help="Write the summary picture.")] = None,
    model: Annotated[Path | None, typer.Option(help="Write the rig with the named effect in it.")] = None,
    plan: Annotated[
        Path | None, typer.Option(help="Instead of a case: a rig file or a rig of the package; say what a diagnosis could tell.")
    ] = None,
    channels: Annotated[str | None, typer.Option(help="With --plan: channels at hand, joined by commas; all by default.")] = None,
    pressure_noise: Annotated[str | None, typer.Option(help="With --plan: sample noise of the pressures, like '200 Pa'.")] = None,
    angle_noise: Annotated[str | None, typer.Option(help="With --plan: sample noise of the angle, like '0.03 deg'.")] = None,
) -> None:
    """Find the physics that the rig's model leaves out of a case's recordings; with --plan, what could be found at all."""
    check_writable(report, json, png, model)
    if plan is not None:
        if case is not None:
            raise typer.BadParameter("give a case or --plan, not both")
        if report is not None or png is not None or model is not None:
            raise typer.BadParameter("--plan writes text and --json only")
        _plan(plan, channels, pressure_noise, angle_noise, json)
        return
    if case is None:
        raise typer.BadParameter("the argument CASE is missing: a case folder is needed, or a rig by --plan")
    if not (channels is None and pressure_noise is None and angle_noise is None):
        raise typer.BadParameter("--channels, --pressure-noise and --angle-noise need --plan")
    from pamrs.case import load_case

    loaded = load_case(case)
    from pamrs.diagnosis import diagnose

    with progress(f"diagnosing {loaded.name}"):
        result = diagnose(loaded)
    if json is not None:
        result.to_json(json)
    if model is not None:
        from pamrs.writing import write_atomically

        write_atomically(model, result.model)
    if report is not None:
        result.report(report)
    if png is not None:
        result.figure(png)
    typer.echo(result.summary())
    for path in (report, json, png, model):
        if path is not None:
            typer.echo(f"written: {path}", err=True)


def _plan(rig: Path, channels: str | None, pressure_noise: str | None, angle_noise: str | None, json: Path | None) -> None:
    """What a diagnosis could tell, to standard output and a file."""
    from json import dumps

    from pamrs.diagnosis.differences import MEASURABLE
    from pamrs.diagnosis.plan import plan_diagnosis
    from pamrs.simulation import core_rig

    loaded = rig_named(rig)
    noise: dict[str, float] = {}
    if pressure_noise is not None:
        noise |= dict.fromkeys(("supply_pressure", "muscle_pressure"), exact("pressure_noise", pressure_noise, "pressure"))
    if angle_noise is not None:
        noise["joint_angle"] = exact("angle_noise", angle_noise, "angle")
    core = core_rig(loaded)
    every = [name for name in MEASURABLE if name in {*core.inputs, *core.channels}]
    given = every if channels is None else [name.strip() for name in channels.split(",") if name.strip()]
    with progress(f"planning for {loaded.name}"):
        result = plan_diagnosis(loaded, given, noise=noise)
    if json is not None:
        write({json: dumps(result.to_dict(), indent=2) + "\n"})
    typer.echo(result.text())


@rig_app.command("check")
def _rig_check(file: Annotated[Path, typer.Argument(help="Rig file (TOML), or the name of a rig of the package.")]) -> None:
    """Check a rig file, say what is connected to what, and list its parameters in SI units."""
    from pamrs.simulation import core_rig

    rig = rig_named(file)
    core_rig(rig)  # what only the whole model shows: lengths that the muscle cannot have, angles that the tendon does not reach
    for line in rig.wiring:
        typer.echo(line)
    width = max((len(name) for name in rig.parameters), default=0)
    for name, parameter in rig.parameters.items():
        known = f"{parameter.value:.6g}" if parameter.known else "unknown"
        spread = f" ± {parameter.tol:.3g}" if parameter.known and parameter.tol else ""
        typer.echo(f"{name:<{width}}  {known}{spread} {parameter.unit}")
    typer.echo(f"{file}: rig {rig.name!r} is valid, {len(rig.parameters)} parameters, {len(rig.effects)} effects")


@rig_app.command("new")
def _rig_new(
    file: Annotated[Path, typer.Argument(help="The file to write; it must not be there yet.")],
    like: Annotated[str, typer.Option(help=f"Rig of the package to begin with: {', '.join(packaged())}.")] = "shoulder",
    name: Annotated[
        str | None, typer.Option(help="What to call the rig; by default as the file, or its folder if that is rig.toml.")
    ] = None,
) -> None:
    """Write a rig file to begin with, every key explained in comments."""
    from pamrs import rigs
    from pamrs.writing import write_atomically

    file.parent.mkdir(parents=True, exist_ok=True)
    if file.exists():
        raise FileExistsError(f"{file}: is there already; it is not overwritten")
    called = file.resolve().parent.name if file.stem == "rig" else file.stem
    write_atomically(file, rigs.template(like, (called or file.stem) if name is None else name))
    typer.echo(f"written: {file}; change it, then: pamrs rig check {file}")


def _one_line(error: BaseException) -> str:
    """The message of an error on one line, its kind where there is no message."""
    parts = [line.strip().removeprefix("- ") for line in str(error).splitlines() if line.strip()]
    if len(parts) > 1:
        parts = [f"{parts[0].rstrip(':')}: {parts[1]}", *parts[2:]]
    return "; ".join(parts) or type(error).__name__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``pamrs``; those of this process by default.

    Returns
    -------
    int
        Exit code: 0 done, 1 interrupted, 2 wrong input (one line on standard error says what), 3 a case without a result.

    Examples
    --------
    >>> main(["rig", "check", "no_such_file.toml"])
    2
    """
    command = typer.main.get_command(app)
    words = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    try:
        code = command.main(args=words, prog_name="pamrs", standalone_mode=False)
    except (KeyboardInterrupt, EOFError, typer.Abort):
        typer.echo("pamrs: interrupted", err=True)
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        typer.echo(f"pamrs: error: {where}{error.strerror or _one_line(error)}", err=True)
        return 2
    except ValueError as error:
        typer.echo(f"pamrs: error: {_one_line(error)}", err=True)
        return 2
    except Exception as error:
        from pamrs.errors import PamrsError

        usage = getattr(error, "format_message", None)
        if usage is None and not isinstance(error, PamrsError):
            raise
        typer.echo(f"pamrs: error: {usage() if usage is not None else _one_line(error)}", err=True)
        return 2
    return int(code or 0)
