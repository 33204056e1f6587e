"""``pamrs simulate``: a rig driven by a recording, or by steps that are written on the command
line.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pamrs._checks import refused
from pamrs._writing import check_writable, write_atomically
from pamrs.channels import channel_of, dotted, laboratory_unit, unit_of
from pamrs.cli._shared import Contents, RigName, exact, progress, rig_named, usable_samples, write
from pamrs.errors import ParameterError, RecordingError, meant
from pamrs.units import with_unit

if TYPE_CHECKING:
    from pamrs._arrays import Array
    from pamrs.recordings import Recording
    from pamrs.rig import Rig
    from pamrs.simulation import Simulation

_DIMENSIONS = {
    "valve_command": "voltage",
    "supply_command": "pressure",
    "pressure": "pressure",
    "supply_pressure": "pressure",
    "length": "length",
}
#: Signals that a rig cannot do without, each with an example.
_NEEDED = {"valve_command": "5 V, 8 V @ 1 s", "length": "300 mm"}
_INITIAL = {
    "Pa": "pressure",
    "K": "temperature",
    "rad": "angle",
    "rad/s": "angular speed",
    "m": "length",
    "m/s": "m/s",
}


def simulate_command(
    rig: RigName,
    input: Annotated[
        Path | None, typer.Option("--input", help="Recording whose inputs drive the rig (CSV).")
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                "Without a recording: a signal of steps, 'valve_command = 5 V, 8 V @ 1 s'; one "
                "--hold for each signal."
            )
        ),
    ] = None,
    initial: Annotated[
        list[str] | None,
        typer.Option(help="Without a recording: where it begins, 'muscle_pressure = 2 bar'."),
    ] = None,
    duration: Annotated[str, typer.Option(help="Without a recording: how long.")] = "5 s",
    sample_time: Annotated[
        str, typer.Option(help="Without a recording: time between two rows.")
    ] = "5 ms",
    output: Annotated[
        Path | None, typer.Option("--output", help="Where to write the simulated channels (CSV).")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Write a picture of the channels, with the recorded ones (PNG)."),
    ] = None,
    animation: Annotated[Path | None, typer.Option(help="Write the arm as it moves (GIF).")] = None,
    speed: Annotated[
        float, typer.Option(help="Of the animation: times faster than it happens.")
    ] = 1.0,
) -> None:
    """Drive a rig with a recording's inputs, or with steps, and write what its channels would
    be.
    """
    if input is not None and (hold or initial):
        raise typer.BadParameter("--hold and --initial do not go with --input, which says both")
    check_writable(output, plot, animation)
    loaded = rig_named(rig)
    recorded: dict[str, tuple[Any, Any]] = {}
    recording = None
    if input is not None:
        from pamrs.simulation import replay

        recording = _recorded(input)
        _say_what_is_held(loaded, recording, input)
        with progress(f"simulating {loaded.name}"):
            result = replay(loaded, recording)
        recorded = usable_samples(recording)
    else:
        result = _steps(
            loaded,
            hold or [],
            initial or [],
            exact("duration", duration, "time"),
            exact("sample_time", sample_time, "time"),
        )
    lines = [result.summary()]
    if recording is not None:
        from pamrs.simulation import differences

        for name, rms in differences(result, recording).items():
            unit, factor = laboratory_unit(name)
            line = f"{name}: rms difference from the recording {factor * rms:.4g}"
            lines.append(with_unit(line, unit))
    files: Contents = {
        output: lambda path: _write_csv(path, result),
        plot: lambda path: _plot(path, result, recorded),
        animation: lambda path: _animate(path, result, speed),
    }
    write(files, "\n".join(lines))


def _recorded(path: Path) -> Recording:
    """A recording of inputs; what a laboratory wrote is played by another command."""
    from pamrs.recordings import load_recording

    try:
        return load_recording(path)
    except RecordingError as error:
        raise RecordingError(
            f"{error}; a log that pamrs import has read is simulated by pamrs replay CASE"
        ) from None


def _plot(path: Path, result: Simulation, recorded: dict[str, tuple[Any, Any]]) -> None:
    from pamrs.report.motion import write_channels

    write_channels(result, path, recorded=recorded)


def _animate(path: Path, result: Simulation, speed: float) -> None:
    from pamrs.report.motion import write_animation

    with progress("drawing the motion"):
        write_animation(result, path, speed=speed)


def _say_what_is_held(rig: Rig, recording: Recording, path: Path) -> None:
    """Name the inputs of which some samples cannot be used."""
    from pamrs.simulation import has_frame

    driving = {"valve_command", "supply_command", *(["length"] if has_frame(rig) else [])}
    for name, rows in recording.mask.items():
        if channel_of(name) in driving and rows.any() and not rows.all():
            typer.echo(
                f"{path}: {int((~rows).sum())} unusable samples of {name} hold the last usable one",
                err=True,
            )


def _steps(
    rig: Rig, hold: list[str], initial: list[str], duration: float, sample_time: float
) -> Simulation:
    """Simulate under signals of steps."""
    import numpy as np

    from pamrs.simulation import initial_names, inputs_of, simulate

    if not (0.0 < sample_time <= duration and duration / sample_time < 1e8):
        given = f"--duration = {duration:g} s with --sample-time = {sample_time:g} s"
        raise ParameterError(
            f"{given} is not allowed: two times > 0 s are needed that give from 2 to 1e8 rows"
        )
    time = np.asarray(np.arange(round(duration / sample_time) + 1) * sample_time, dtype=np.float64)
    known = inputs_of(rig).names
    drive: dict[str, Any] = {}
    for text in hold:
        name, values = _held(text, time, known)
        head, _, block = name.partition(".")
        if (head == "length" and "length" in drive) or block in drive.get(head, {}):
            raise refused("--hold", text, f"{name} is given twice")
        if head == "length":
            drive["length"] = values
        else:
            drive.setdefault(head, {})[block] = values
    held = {dotted(head, b) for head, own in drive.items() if head != "length" for b in own}
    start = dict(_began(text, initial_names(rig)) for text in initial)
    for name in known:
        example = _NEEDED.get(channel_of(name))
        if example is not None and name not in held | set(drive):
            raise ParameterError(
                f"--hold is missing for {name}: give --hold '{name} = {example}', or --input with "
                "a recording"
            )
    if not drive:
        drive["duration"] = duration
    with progress(f"simulating {rig.name}"):
        return simulate(rig, sample_time=sample_time, initial=start, **drive)


def _held(text: str, time: Array, known: list[str]) -> tuple[str, Array]:
    """A signal of steps from ``"valve_command.elbow = 5 V, 8 V @ 1 s"``; ``known`` are those that
    the rig takes.
    """
    import numpy as np

    name, steps = _parted("hold", text, "a signal like 'valve_command = 5 V, 8 V @ 1 s'")
    same = [one for one in known if channel_of(one) == name]
    if name not in known and len(same) == 1:
        name = same[0]  # the only one is meant
    if name not in known:
        hint = f"there are: {', '.join(same)}" if same else meant(name, known)
        raise refused("--hold", text, f"the rig takes no signal {name!r}; {hint}")
    dimension = _DIMENSIONS[channel_of(name)]
    values, last = np.zeros(time.size), 0.0
    for k, step in enumerate(steps.split(",")):
        value, at, when = step.partition("@")
        if (k > 0) != bool(at):
            raise refused(
                "--hold", text, "every value but the first needs its time, like '8 V @ 1 s'"
            )
        begin = exact("hold", when, "time") if at else last
        if k > 0 and not last < begin <= time[-1]:
            raise refused(
                "--hold", text, f"times that rise from 0 to {time[-1]:g} s (--duration) are needed"
            )
        last = begin
        values[time >= begin - 1e-9] = exact("hold", value, dimension)
    return name, values


def _parted(option: str, text: str, example: str) -> tuple[str, str]:
    """Split the text of an option at its ``=``."""
    name, equals, value = text.partition("=")
    if not equals:
        raise refused(f"--{option}", text, f"{example} is needed")
    return name.strip(), value


def _began(text: str, known: list[str]) -> tuple[str, float]:
    """An initial value from ``"muscle_pressure.elbow = 2 bar"``; ``known`` are the states that the
    rig has.
    """
    name, value = _parted("initial", text, "a state like 'muscle_pressure = 2 bar'")
    if name not in known:
        raise refused(
            "--initial", text, f"the rig has no state {name!r} to begin from; {meant(name, known)}"
        )
    return name, exact("initial", value, _INITIAL[unit_of(name)])


def _write_csv(path: Path, columns: Simulation) -> None:
    """Write channels in SI units under headers that carry the unit."""
    names = list(columns)
    lines = [",".join(f"{name} [{unit_of(name)}]" for name in names)]
    for row in zip(*(columns[name].tolist() for name in names), strict=True):
        lines.append(",".join(f"{value:.10g}" for value in row))
    write_atomically(path, "\n".join(lines) + "\n")
    typer.echo(f"{columns.rig.name}: {len(columns.time)} samples written to {path}")
