"""The command line: ``pamrs diagnose``, ``fit``, ``library``, ``lift``, ``reproduce``, ``simulate``, ``size`` and ``rig check``.

Results go to standard output, progress and errors to standard error. The exit code is 0 when the
command did its work (a diagnosis that finds nothing missing included), 2 when the input is wrong.
Everything heavy is imported inside the command that needs it, so that ``pamrs --help`` answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pamrs.cli_design import design_app
from pamrs.cli_fit import fit_app
from pamrs.cli_library import library_command, size_command
from pamrs.cli_lift import lift_command
from pamrs.cli_reproduce import reproduce_command
from pamrs.cli_shared import check_writable, progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pamrs.recording import Recording
    from pamrs.rig import Rig

__all__ = ["app", "main"]

CHANNEL_UNITS = {
    "time": "s",
    "valve_command": "V",
    "supply_pressure": "Pa",
    "muscle_pressure": "Pa",
    "joint_angle": "rad",
    "length": "m",
    "force": "N",
    "joint_torque": "N m",
    "temperature": "K",
    "reference": "rad",
    "joint_rate": "rad/s",
    "muscle_force": "N",
    "contraction_ratio": "1",
    "length_rate": "m/s",
    "air_volume": "m3",
}
STATE_NEEDS = {"muscle_pressure": "chamber", "supply_pressure": "supply", "joint_angle": "arm", "length": "load"}
SENSOR_ZEROS = {"muscle_pressure": "pressure_zero", "joint_angle": "angle_zero"}
STATES = tuple(STATE_NEEDS)

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
app.command("library")(library_command)
app.command("lift")(lift_command)
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
    case: Annotated[Path, typer.Argument(help="Folder with case.toml, rig.toml and the recordings.")],
    report: Annotated[Path | None, typer.Option(help="Write the report, one HTML file.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write the result (schema pamrs.diagnosis/1).")] = None,
    png: Annotated[Path | None, typer.Option(help="Write the summary picture.")] = None,
    model: Annotated[Path | None, typer.Option(help="Write the rig with the named effect in it.")] = None,
) -> None:
    """Find the physics that the rig's model leaves out of a case's recordings."""
    check_writable(report, json, png, model)
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


@app.command("simulate")
def _simulate(
    rig: Annotated[Path, typer.Argument(help="Rig file (TOML), or the name of a rig of the package.")],
    input: Annotated[Path, typer.Option("--input", help="Recording whose inputs drive the rig (CSV).")],
    output: Annotated[Path | None, typer.Option("--output", help="Where to write the simulated channels (CSV).")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write a picture of the channels beside the recorded ones (PNG).")] = None,
    animation: Annotated[Path | None, typer.Option(help="Write the arm as it moves (GIF).")] = None,
    speed: Annotated[float, typer.Option(help="Of the animation: times faster than it happens.")] = 1.0,
) -> None:
    """Drive a rig with a recording's inputs and write what its channels would be."""
    if output is None and plot is None and animation is None:
        raise typer.BadParameter("nothing would be written: give --output, --plot or --animation")
    check_writable(output, plot, animation)
    import numpy as np

    from pamrs.recording import load_recording
    from pamrs.simulation import simulate

    loaded = _rig(rig)
    recording = load_recording(input)
    zeros = {name: loaded.model["sensors"][zero] for name, zero in SENSOR_ZEROS.items()}
    initial = {
        name: float(recording.channels[name][recording.mask[name]][0]) - zeros.get(name, 0.0)
        for name in STATES
        if name in recording.channels and recording.mask[name].any() and loaded.model[STATE_NEEDS[name]]
    }
    drive: dict[str, Any] = {}
    if loaded.model["valve"] is not None:
        drive["valve_command"] = _held(recording, "valve_command", input)
    if (loaded.model["load"] or {}).get("kind") == "frame":
        drive["length"] = _held(recording, "length", input)
        if loaded.model["valve"] is None and recording.mask.get("muscle_pressure", np.zeros(1)).any():
            drive["pressure"] = _held(recording, "muscle_pressure", input) - zeros["muscle_pressure"]
        initial = {name: value for name, value in initial.items() if name == "supply_pressure"}
    elif loaded.model["valve"] is None:
        drive["duration"] = float(recording.time[-1])
    with progress(f"simulating {loaded.name}"):
        result = simulate(loaded, sample_time=recording.sample_time, initial=initial, **drive)
    if output is not None:
        _write_csv(output, result)
        typer.echo(f"{loaded.name}: {len(result.time)} samples written to {output}")
    if plot is not None:
        recorded = {name: (recording.time[usable], recording.channels[name][usable]) for name, usable in recording.mask.items()}
        result.plot(plot, recorded=recorded)
        typer.echo(f"written: {plot}", err=True)
    if animation is not None:
        with progress("drawing the motion"):
            result.animate(animation, speed=speed)
        typer.echo(f"written: {animation}", err=True)
    for name, recorded_as in (*((name, name) for name in STATES), ("muscle_force", "force")):
        usable = recording.mask.get(recorded_as)
        if name in result and name not in drive and usable is not None and usable.any():
            apart = result[name][usable] - recording.channels[recorded_as][usable]
            rms = float((apart**2).mean() ** 0.5)
            typer.echo(f"{name}: rms difference from the recording {rms:.4g} {CHANNEL_UNITS[name]}")


def _held(recording: Recording, name: str, path: Path) -> NDArray[np.float64]:
    """A channel whose unusable samples repeat the last usable one, as a valve does that hears nothing new."""
    import numpy as np

    if name not in recording.channels or not recording.mask[name].any():
        raise ValueError(f"{path}: no usable {name}, which the rig needs")
    usable = recording.mask[name]
    last = np.maximum.accumulate(np.where(usable, np.arange(usable.size), int(np.argmax(usable))))
    if not usable.all():
        typer.echo(f"{path}: {int((~usable).sum())} unusable samples of {name} hold the last usable one", err=True)
    held: NDArray[np.float64] = recording.channels[name][last]
    return held


def _write_csv(path: Path, columns: Mapping[str, NDArray[np.float64]]) -> None:
    """Write channels in SI units under headers that carry the unit; masked samples stay empty."""
    import math

    from pamrs.writing import write_atomically

    names = list(columns)
    lines = [",".join(f"{name} [{CHANNEL_UNITS.get(name, '1')}]" for name in names)]
    for row in zip(*(columns[name].tolist() for name in names), strict=True):
        lines.append(",".join("" if math.isnan(value) else f"{value:.10g}" for value in row))
    write_atomically(path, "\n".join(lines) + "\n")


@rig_app.command("check")
def _rig_check(file: Annotated[Path, typer.Argument(help="Rig file (TOML), or the name of a rig of the package.")]) -> None:
    """Check a rig file and list its parameters in SI units."""
    from pamrs.simulation import core_rig

    rig = _rig(file)
    core_rig(rig)  # what only the whole model shows: lengths that the muscle cannot have, angles that the tendon does not reach
    width = max((len(name) for name in rig.parameters), default=0)
    for name, parameter in rig.parameters.items():
        known = f"{parameter.value:.6g}" if parameter.known else "unknown"
        spread = f" ± {parameter.tol:.3g}" if parameter.known and parameter.tol else ""
        typer.echo(f"{name:<{width}}  {known}{spread} {parameter.unit}")
    typer.echo(f"{file}: rig {rig.name!r} is valid, {len(rig.parameters)} parameters, {len(rig.effects)} effects")


@rig_app.command("new")
def _rig_new(
    file: Annotated[Path, typer.Argument(help="The file to write; it must not be there yet.")],
    like: Annotated[str, typer.Option(help="Rig of the package to begin with: shoulder or sealed_chamber.")] = "shoulder",
    name: Annotated[str | None, typer.Option(help="What to call the rig; by default as the file.")] = None,
) -> None:
    """Write a rig file to begin with, every key explained in comments."""
    from pamrs import rigs
    from pamrs.writing import write_atomically

    check_writable(file)
    if file.exists():
        raise FileExistsError(f"{file}: is there already; it is not overwritten")
    write_atomically(file, rigs.template(like, file.stem if name is None else name))
    typer.echo(f"written: {file}; change it, then: pamrs rig check {file}")


def _rig(file: Path) -> Rig:
    """A rig file, or a rig of the package by its name."""
    from pamrs import rigs
    from pamrs.rig import load_rig

    return rigs.named(str(file)) if not file.exists() and str(file) in rigs.names() else load_rig(file)


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
        Exit code: 0 done, 1 interrupted, 2 wrong input (one line on standard error says what).

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
