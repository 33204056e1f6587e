"""``pamrs import``: what a log has, and a case that points at it."""

from __future__ import annotations

import math
import os
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from pamrs._checks import refused
from pamrs._files import is_inside, resolved
from pamrs.cli._shared import Contents, check_new, exact, option, progress, rig_named, write
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from pamrs.recordings import LogProposal

_MOST_STEP: Final = 86_400.0
"""Longest spacing of samples [s]."""


def import_command(
    log: Annotated[
        list[Path],
        typer.Argument(
            help=(
                "Logs of one rig: CSV and other text, JSON, Excel, Parquet, Feather, MATLAB, HDF5, "
                "MF4, TDMS, ROS bags, MCAP, NumPy. They are not changed."
            )
        ),
    ],
    rig: Annotated[
        Path | None,
        typer.Option(help="Rig file, or a rig of the package: which channels there can be."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder that gets case.toml; without it, it is printed."),
    ] = None,
    copy: Annotated[
        bool,
        typer.Option(
            "--copy",
            help="Copy logs and rig file into that folder, which is then complete by itself.",
        ),
    ] = False,
    sample_time: Annotated[
        str | None,
        typer.Option(help='For logs without any clock: the spacing of the samples, "1 ms".'),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            help='For tables without headings: a name for each column, "time [ms], p1 [bar], x".'
        ),
    ] = None,
) -> None:
    """List the channels of logs, and propose which of them is which channel of the rig."""
    file = None if out is None else out / "case.toml"
    if file is not None:
        check_new(file)
    from pamrs.diagnosis.prepare import questions
    from pamrs.diagnosis.settings import DiagnosisSettings
    from pamrs.recordings import propose
    from pamrs.recordings.logs import TextFormat, check_readable

    copies = _copies(log, out) if copy else {}
    for path in log:
        check_readable(path)
    form = None
    if columns is not None:
        form = TextFormat(columns=tuple(name.strip() for name in columns.split(",")))
    model = None if rig is None else rig_named(rig)
    step = None if sample_time is None else _spacing(sample_time)
    with progress(f"reading {len(log)} log{'s' if len(log) > 1 else ''}"):
        proposal = propose(log, model, sample_time=step, form=form)
        if model is not None:
            for item in proposal.logs:
                item.remarks.extend(questions(item, model, DiagnosisSettings()))
    for item in proposal.logs:
        _show(item)
    folder = out or Path()
    named, contents = _rig_entry(rig, folder, copy=copy, written=out is not None)
    if copies:
        logs = [
            replace(item, log=replace(item.log, path=copies.get(item.log.path, item.log.path)))
            for item in proposal.logs
        ]
        proposal = replace(proposal, logs=logs)
    text = proposal.case_toml(folder, named)
    if file is None:
        typer.echo(text)
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    used = [*log, *([rig] if rig is not None and rig.exists() else [])]
    contents[file] = text
    if copies:
        _copy(copies, file.parent)
    write(contents)
    outside = not copy and any(not is_inside(file.parent, path) for path in used)
    allowed = " --allow-outside" if outside else ""
    expected = file.parent / "rig.toml"
    missing = (
        "" if rig is not None or expected.exists() else f", put the rig file there as {expected}"
    )
    folder_name = shlex.quote(str(file.parent))
    if (held := proposal.held_out) is not None:
        name = Path(os.path.relpath(resolved(held.log.path), resolved(folder))).as_posix()
        typer.echo(f"held out: {name}; role in {file} chooses others")
    typer.echo(f"look at {file}{missing}, then: pamrs diagnose {folder_name}{allowed}")


def _spacing(text: str) -> float:
    """The spacing of samples [s]."""
    step = exact("sample_time", text, "time")
    if not 0.0 < step <= _MOST_STEP:
        raise refused(option("sample_time"), text.strip(), "above zero, a day at most")
    return step


def _rig_entry(
    rig: Path | None, folder: Path, *, copy: bool, written: bool
) -> tuple[str, Contents]:
    """Name of the rig file in ``case.toml``, and its text where it has to be written there."""
    default = folder / "rig.toml"
    if rig is None:
        return default.name, {}
    if rig.exists() and (not copy or is_inside(folder, rig)):
        return Path(os.path.relpath(resolved(rig), resolved(folder))).as_posix(), {}
    if rig.exists():
        check_new(default)
        return default.name, {default: rig.read_text(encoding="utf-8")}
    from pamrs import rigs

    template = rigs.template(str(rig), str(rig), "coefficients")
    if (
        written
        and default.exists()
        and default.read_text(encoding="utf-8", errors="replace") != template
    ):
        raise FileExistsError(
            f"{default}: is there already, and is not {rig}; it is not overwritten: give it as "
            "--rig, or another --out"
        )
    return default.name, {default: template}


def _copies(logs: list[Path], folder: Path | None) -> dict[Path, Path]:
    """Targets for logs outside a folder that are copied into it; existing ones are refused."""
    if folder is None:
        raise ParameterError("copy needs a folder: give it as --out")
    targets = {path: folder / path.name for path in logs if not is_inside(folder, path)}
    seen: dict[str, Path] = {}
    for path, target in targets.items():
        if path.is_dir() and is_inside(path, folder):
            raise ParameterError(f"out = {folder}: lies in {path}, which is to be copied there")
        check_new(target)
        other = seen.setdefault(target.name.casefold(), path)
        if other is not path:
            same = resolved(other) == resolved(path)
            why = "the same log twice" if same else f"{other} has that name too; rename one"
            raise FileExistsError(f"{path}: {why}")
    return targets


def _copy(copies: dict[Path, Path], folder: Path) -> None:
    """Copy logs, files or the folders of bags: all to temporary names, then each to its own."""
    import shutil
    import tempfile

    with tempfile.TemporaryDirectory(prefix=".copies-", dir=folder) as place:
        made = {Path(place) / str(number): pair for number, pair in enumerate(copies.items())}
        for temporary, (path, _) in made.items():
            if path.is_dir():
                shutil.copytree(path, temporary)
            else:
                shutil.copyfile(path, temporary)
        for temporary, (_, target) in made.items():
            temporary.rename(target)


def _show(item: LogProposal) -> None:
    """The channels of a log as a table, and what to look at."""
    typer.echo(f"{item.log.path}: {len(item.listed)} channels")
    for text in item.log.remarks:
        typer.echo(f"  read: {text}")
    rows = [("channel", "samples", "rate", "unit", "from", "to", "proposed as")]
    for each in item.listed:
        rate = f"{each.rate:.4g} Hz" if math.isfinite(each.rate) else "-"
        low, high = (f"{x:.5g}" if math.isfinite(x) else "-" for x in (each.low, each.high))
        rows.append((each.name, str(each.count), rate, each.unit or "-", low, high, each.channel))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = zip(row, widths, strict=True)
        typer.echo("  " + "  ".join(cell.ljust(width) for cell, width in cells).rstrip())
    for name, reason in item.log.unread.items():
        typer.echo(f"  {name}: not read, {reason}")
    if item.split is not None:
        count = len(item.pieces)
        typer.echo(f"  {count} recording{'s' * (count > 1)}: split = {item.split!r}")
    for text in item.remarks:
        typer.echo(f"  look: {text}")
    typer.echo("")
