"""``pamrs campaign``: a rig diagnosed by experiments of its own choice."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pamrs._checks import refused
from pamrs.channels import unit_of
from pamrs.cli._shared import RigName, exact, progress, rig_named

if TYPE_CHECKING:
    from pamrs.control.live import Device
    from pamrs.rig import Rig

_SIMULATED = "simulated"
_OF_COMMANDS = "as often as there are commands, in SI units."


def campaign_command(
    rig: RigName,
    out: Annotated[
        Path, typer.Option(help="Folder of the campaign; the same command goes on with it.")
    ] = Path("campaign"),
    device: Annotated[
        str | None,
        typer.Option(
            help=(
                "What plays the commands: a serial port (/dev/ttyACM0), 'simulated', or "
                "'simulated:PLANT.toml' for another plant than the model."
            )
        ),
    ] = None,
    step: Annotated[
        bool,
        typer.Option(
            "--step",
            help="Without a device: write commands and a sheet for the bench, and end; the next "
            "call takes the recording.",
        ),
    ] = False,
    recording: Annotated[
        Path | None, typer.Option(help="With --step: the recording of the step that waits for it.")
    ] = None,
    case: Annotated[
        Path | None, typer.Option(help="A case folder: what was recorded before.")
    ] = None,
    log: Annotated[
        list[Path] | None,
        typer.Option(help="A recording with units in its headings; may be given again."),
    ] = None,
    minutes: Annotated[float, typer.Option(help="Time at the bench.")] = 30.0,
    runs: Annotated[int, typer.Option(help="Runs at most.")] = 6,
    air: Annotated[
        float, typer.Option(help="Litres of air at ambient pressure, at most.")
    ] = 1000.0,
    highest: Annotated[
        str | None, typer.Option(help="Pressure up to which experiments go, like '3 bar'.")
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(help=f"NAME=LOW:HIGH of a command, like valve_command=3:7; {_OF_COMMANDS}"),
    ] = None,
    safe: Annotated[
        list[str] | None,
        typer.Option(help=f"NAME=VALUE that is written first and last; {_OF_COMMANDS}"),
    ] = None,
    rest: Annotated[
        list[str] | None,
        typer.Option(help=f"NAME=VALUE that is written before each run; {_OF_COMMANDS}"),
    ] = None,
    period: Annotated[
        str | None, typer.Option(help="Time between two commands, like '10 ms'.")
    ] = None,
    unattended: Annotated[
        bool,
        typer.Option("--unattended", help="With --step: no experiment that takes hands."),
    ] = False,
    baud: Annotated[int, typer.Option(help="Of a serial port.")] = 115200,
) -> None:
    """Diagnose, propose an experiment, play it, and again, until it is decided what is missing.

    Exit code 0: ended, and said why; 1: interrupted, the safe command was written; 2: wrong input,
    or the device failed: what was recorded is kept, and the same command goes on.
    """
    if step == (device is not None):
        raise typer.BadParameter("give --device or --step, one of the two")
    if recording is not None and not step:
        raise typer.BadParameter("--recording needs --step: a device records by itself")
    from pamrs.campaigns import Bench, Budget, campaign
    from pamrs.recordings import load_case, load_recording

    loaded = rig_named(rig)
    ambient = float(loaded.tables("gas")[""]["ambient_pressure"])
    before = list(load_case(case).recordings) if case is not None else []
    before += [load_recording(path, ambient_pressure=ambient) for path in log or ()]
    bench = Bench(
        limits={name: _span(name, text) for name, text in _named("limit", limit)},
        safe={name: _number("safe", name, text) for name, text in _named("safe", safe)},
        rest={name: _number("rest", name, text) for name, text in _named("rest", rest)},
        highest=None if highest is None else exact("highest", highest, "pressure"),
        period=None if period is None else exact("period", period, "time"),
        unattended=unattended,
    )
    with progress(f"campaign on {loaded.name}") as say:
        found = campaign(
            None if device is None else _device(device, loaded, baud),
            loaded,
            before,
            out=out,
            budget=Budget(minutes, runs, air),
            bench=bench,
            recording=recording,
            progress=say,
        )
    typer.echo(found.summary())
    typer.echo(f"Pages: {found.path / 'campaign.html'}")


def _device(name: str, rig: Rig, baud: int) -> Device:
    """The device that a text names."""
    if name.partition(":")[0] == _SIMULATED:
        from pamrs.campaigns import SimulatedBench

        plant = name.partition(":")[2]
        simulated: Device = SimulatedBench(rig_named(Path(plant)) if plant else rig)
        return simulated
    from pamrs.campaigns import SerialDevice

    return SerialDevice(name, baud=baud)


def _named(option: str, given: list[str] | None) -> list[tuple[str, str]]:
    """NAME=VALUE in two parts."""
    for text in given or ():
        if "=" not in text:
            raise refused(f"--{option}", text, "NAME=VALUE is needed, like valve_command=5")
    return [
        (name.strip(), value.strip()) for name, _, value in (t.partition("=") for t in given or ())
    ]


def _number(option: str, name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        needed = f"a number in {unit_of(name) or 'SI units'} is needed"
        raise refused(f"--{option} {name}", text, needed) from None


def _span(name: str, text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    if not colon:
        raise refused(f"--limit {name}", text, "LOW:HIGH is needed, like 3:7")
    return _number("limit", name, low), _number("limit", name, high)
