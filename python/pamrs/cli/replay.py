"""``pamrs replay``: the recordings of a case and the whole rig simulated from its inputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pamrs._checks import one_of
from pamrs._writing import check_writable
from pamrs.channels import channel_of, laboratory_unit
from pamrs.cli._shared import AllowOutside, progress, rig_named, usable_samples, write
from pamrs.errors import CaseError, RecordingError, SimulationError
from pamrs.units import with_unit

if TYPE_CHECKING:
    from pamrs.recordings import Case, Recording
    from pamrs.rig import Rig
    from pamrs.simulation import Simulation


def replay_command(
    case: Annotated[
        Path,
        typer.Argument(help="Case folder, or a model that a diagnosis wrote (--model) of one."),
    ],
    rig: Annotated[
        Path | None,
        typer.Option(help="A second model to compare: a file, or a rig of the package."),
    ] = None,
    recording: Annotated[
        str, typer.Option(help="Replay this recording alone; by default all.")
    ] = "",
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw recorded and simulated channels of the recording (PNG); without "
            "--recording the first held-out one."
        ),
    ] = None,
    allow_outside: AllowOutside = False,
) -> None:
    """Simulate the whole rig from what went into it in each recording of a case (commands, and
    pressures or lengths where nothing drives them), and compare: free-running, from the first
    sample on. With a diagnosed model its errors are printed with those of the case's own rig.
    """
    check_writable(plot)
    found, model = _loaded(case, rig, allow_outside)
    chosen = _chosen(found, recording)
    shown = next((r for r in chosen if r.role == "held_out"), chosen[0])
    drawn: Simulation | None = None
    compared: Simulation | None = None
    for one in chosen:
        typer.echo(f"{one.name} ({one.role.replace('_', ' ')}, {one.duration:.4g} s)")
        with progress(f"simulating {one.name}"):
            nominal, own = _run(found.rig, one), None if model is None else _run(model, one)
        for line in _lines(nominal, own, one):
            typer.echo(line)
        if one is shown:
            drawn = own or nominal
            compared = None if own is None else nominal
    if plot is not None and drawn is not None:
        from pamrs.report.motion import write_channels

        result, recorded = drawn, usable_samples(shown)
        write(
            {plot: lambda path: write_channels(result, path, recorded=recorded, nominal=compared)}
        )


def _loaded(place: Path, rig: Path | None, allow_outside: bool) -> tuple[Case, Rig | None]:
    """A case with its own rig, and the model file next to it, if there is one."""
    from pamrs import rigs
    from pamrs.recordings import load_case, model_and_case

    model = None
    if not place.exists() and str(place) in rigs.names():
        raise CaseError(
            f"{place} is a rig of the package, not a case; give the folder of a case, and this as "
            f"its rig (pamrs replay CASE --rig {place})"
        )
    if place.is_file() and place.name != "case.toml":
        model, place = model_and_case(place)
    found = load_case(place, allow_outside=allow_outside)
    return found, model if rig is None else rig_named(rig)


def _chosen(case: Case, name: str) -> list[Recording]:
    """The recordings that are wanted."""
    if name:
        one_of("--recording", name, [r.name for r in case.recordings])
    return [r for r in case.recordings if name in ("", r.name)]


def _run(rig: Rig, recording: Recording) -> Simulation | None:
    """A free run; None, with the reason on standard error, where the rig cannot be run so."""
    from pamrs.recordings import CHANNELS
    from pamrs.simulation import differences, replay

    try:
        run = replay(rig, recording)
        if not differences(run, recording):
            there = [name for name in run if name != "time" and channel_of(name) in CHANNELS]
            typer.echo(
                f"{recording.name}: {rig.name} has none of the channels that were recorded "
                f"({', '.join(recording.channels)}); it has {', '.join(there)}",
                err=True,
            )
        return run
    except (RecordingError, SimulationError) as error:
        typer.echo(f"{recording.name}: {rig.name} cannot be run: {error}", err=True)
        return None


def _lines(nominal: Simulation | None, own: Simulation | None, recording: Recording) -> list[str]:
    """One line for each channel that was recorded and simulated."""
    from pamrs.simulation import differences

    before = {} if nominal is None else differences(nominal, recording)
    after = {} if own is None else differences(own, recording)
    found = []
    for name in before | after:
        unit, factor = laboratory_unit(name)
        sizes = [f"{factor * errors[name]:.4g}" for errors in (before, after) if name in errors]
        found.append(with_unit(f"  {name}: rms difference {' -> '.join(sizes)}", unit))
    return found
