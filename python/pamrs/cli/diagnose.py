"""``pamrs diagnose``: the physics that the recordings of a case show and its model leaves out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pamrs._files import resolved
from pamrs._writing import check_writable, write_atomically
from pamrs.channels import channel_of, with_trait
from pamrs.cli._shared import (
    STDOUT,
    AllowOutside,
    Contents,
    exact,
    file_of,
    json_help,
    progress,
    rig_named,
    write,
)

if TYPE_CHECKING:
    from pamrs.diagnosis import Diagnosis, DiagnosisSettings
    from pamrs.findings import Protocol
    from pamrs.recordings import Case

_MARGIN = 0.05  # share of the recorded range by which commands may leave it unsaid


def diagnose_command(
    case: Annotated[
        Path | None,
        typer.Argument(
            help=(
                "Folder with case.toml, rig.toml and the recordings; or a model that --model "
                "wrote, to go on from it."
            )
        ),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help=(
                "A rig file used instead of the case's own: its effects are held, and further ones "
                "are looked for."
            )
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write the report, one HTML file.")] = None,
    json: Annotated[Path | None, typer.Option(help=json_help("pamrs.diagnosis/2"))] = None,
    pdf: Annotated[
        Path | None, typer.Option(help="Write the first screen of the report, one page of A4.")
    ] = None,
    png: Annotated[Path | None, typer.Option(help="Write the summary picture.")] = None,
    model: Annotated[
        Path | None, typer.Option(help="Write the model: the rig with what was found in it.")
    ] = None,
    experiment: Annotated[
        Path | None,
        typer.Option(
            help="Write the commands of the proposed next experiment (CSV: time and commands)."
        ),
    ] = None,
    consider: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                "A suspicion to be judged with what is found: the id of an effect or the dotted "
                "name of a parameter that may be wrong, several joined by +. May be given again."
            )
        ),
    ] = None,
    perfect_model: Annotated[
        bool,
        typer.Option(
            "--perfect-model",
            help=(
                "The model is exact but for what its file says: without it each block may be off "
                "by a smooth curve of 1 % or of what [model_error] states."
            ),
        ),
    ] = False,
    allow_outside: AllowOutside = False,
    plan: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Instead of a case: a rig file or a rig of the package; say what a diagnosis could "
                "tell."
            )
        ),
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(
            help="With --plan: channels at hand, joined by commas; all but temperatures by default."
        ),
    ] = None,
    pressure_noise: Annotated[
        str | None, typer.Option(help="With --plan: sample noise of the pressures, like '200 Pa'.")
    ] = None,
    angle_noise: Annotated[
        str | None, typer.Option(help="With --plan: sample noise of the angle, like '0.03 deg'.")
    ] = None,
    force_noise: Annotated[
        str | None, typer.Option(help="With --plan: sample noise of a load cell, like '1 N'.")
    ] = None,
) -> None:
    """Find the physics that the rig's model leaves out of a case's recordings; with --plan, what
    could be found at all.

    Files are written before the verdict is printed. Exit code 0: diagnosed; 2: not diagnosed; 4:
    diagnosed, but some file or the text could not be written.
    """
    check_writable(report, file_of(json), pdf, png, model, experiment)
    if plan is not None:
        if case is not None or rig is not None:
            raise typer.BadParameter("give a case (with or without --rig) or --plan, not both")
        if consider:
            raise typer.BadParameter("--consider needs a case: --plan has no recordings to judge")
        if any(path is not None for path in (report, pdf, png, model, experiment)):
            raise typer.BadParameter("--plan writes text and --json only")
        noise = {"pressure": pressure_noise, "angle": angle_noise, "force": force_noise}
        _plan(plan, channels, noise, json, perfect_model=perfect_model)
        return
    if case is None:
        raise typer.BadParameter(
            "the argument CASE is missing: a case folder is needed, or a rig by --plan"
        )
    if any(given is not None for given in (channels, pressure_noise, angle_noise, force_noise)):
        raise typer.BadParameter(
            "--channels, --pressure-noise, --angle-noise and --force-noise need --plan"
        )
    from pamrs.recordings import load_case

    loaded = load_case(case, allow_outside=allow_outside)
    if rig is not None:
        from pamrs.rig import load_rig

        loaded = loaded.with_rig(load_rig(rig), rig)
    from pamrs.diagnosis import diagnose

    settings = _settings(perfect_model=perfect_model)
    with progress(f"diagnosing {loaded.name}") as say:
        result = diagnose(loaded, settings=settings, consider=consider or (), progress=say)
    protocol = result.next_experiment.protocol
    if experiment is not None and protocol is None:
        proposed = bool(result.next_experiment.excitation)
        why = "the proposed experiment is done by hand" if proposed else "no experiment is proposed"
        typer.echo(f"not written: {experiment}: {why}", err=True)
        experiment = None
    files: Contents = {
        json: result.to_json() if json == STDOUT else result.to_json,
        model: lambda path: write_atomically(path, _model_text(result, loaded, path)),
        experiment: "" if protocol is None else protocol.to_csv(),
        png: result.figure,
        pdf: result.pdf,
        report: result.report,
    }
    write(files, result.summary())
    if experiment is not None and protocol is not None:
        for line in _outside_recorded(protocol, loaded):
            typer.echo(f"{experiment}: {line}", err=True)


def _outside_recorded(protocol: Protocol, case: Case) -> list[str]:
    """Commands of an experiment that leave the range in which the recordings have them."""
    import numpy as np

    from pamrs.report.words import sized

    warnings = []
    for name, values in protocol.commands.items():
        recorded = [r.channels[name] for r in case.recordings if name in r.channels]
        seen = np.concatenate([v[np.isfinite(v)] for v in recorded] or [np.empty(0)])
        if not seen.size:
            continue
        low, high = float(seen.min()), float(seen.max())
        margin = _MARGIN * max(high - low, abs(high), abs(low))
        if values.min() < low - margin or values.max() > high + margin:
            ends = (float(values.min()), float(values.max()), low, high)
            first, last, least, most = (sized(v, protocol.units[name]) for v in ends)
            warnings.append(
                f"{name} goes from {first} to {last}, and was recorded from {least} to {most}: "
                "check that the rig can take this before you play it"
            )
    return warnings


def _model_text(result: Diagnosis, case: Case, file: Path) -> str:
    """The model as TOML, with a note of the case that it is from, as seen from the file."""
    import os

    from pamrs.rig import Rig

    if not isinstance(result.rig, Rig):
        return result.model
    home = resolved(case.path)
    try:
        folder = os.path.relpath(home, resolved(file).parent)
    except ValueError:  # on another drive
        folder = str(home)
    return result.rig.with_case(Path(folder).as_posix()).to_toml_text()


def _settings(*, perfect_model: bool) -> DiagnosisSettings | None:
    """Settings for a model that is exact; None for the usual ones."""
    from pamrs.diagnosis import DiagnosisSettings

    return DiagnosisSettings(usual_error=0.0) if perfect_model else None


def _plan(
    rig: Path,
    channels: str | None,
    noises: dict[str, str | None],
    json: Path | None,
    *,
    perfect_model: bool,
) -> None:
    """Print what a diagnosis of a rig could find, given noise by dimension, or write it as JSON."""
    from json import dumps

    from pamrs.diagnosis.next_experiment import measurable, plan_diagnosis

    loaded = rig_named(rig)
    noise: dict[str, float] = {}
    of = {"pressure": with_trait("pressure"), "angle": ("joint_angle",), "force": ("force",)}
    for dimension, text in noises.items():
        if text is not None:
            size = exact(f"{dimension}_noise", text, dimension)
            noise |= dict.fromkeys(of[dimension], size)
    given = (
        [name for name in measurable(loaded) if channel_of(name) != "temperature"]
        if channels is None
        else [name.strip() for name in channels.split(",") if name.strip()]
    )
    with progress(f"planning for {loaded.name}") as say:
        result = plan_diagnosis(
            loaded,
            given,
            noise=noise,
            settings=_settings(perfect_model=perfect_model),
            progress=say,
        )
    write({json: dumps(result.to_dict(), indent=2) + "\n"}, result.text())
