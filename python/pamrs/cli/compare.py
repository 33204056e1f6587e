"""``pamrs compare``: two results of diagnoses side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pamrs._writing import check_writable
from pamrs.cli._shared import document, file_of, json_help, write


def compare_command(
    first: Annotated[
        Path,
        typer.Argument(metavar="A", help="A result (--json of diagnose), or a folder with it."),
    ],
    second: Annotated[Path, typer.Argument(metavar="B", help="The result to compare it with.")],
    json: Annotated[Path | None, typer.Option(help=json_help("pamrs.comparison/1"))] = None,
    out: Annotated[Path | None, typer.Option(help="Write a page, one HTML file.")] = None,
) -> None:
    """Set two results of diagnose side by side: verdict, block, candidates with probabilities,
    parameters, what the models miss, and what changed.
    """
    check_writable(file_of(json), out)
    from pamrs.diagnosis.result import load_result
    from pamrs.findings import compare_results
    from pamrs.report.compare import comparison_html, comparison_text

    one, other = (load_result(path).to_dict() for path in (first, second))
    found = compare_results(_names(first, second), one, other)
    result = document("pamrs.comparison/1", **found.to_dict())
    write({json: result, out: comparison_html(found)}, comparison_text(found))


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Names of two results: their files or folders, in full where these are the same."""
    one, other = map(_short, (first, second))
    return (one, other) if one != other else (str(first), str(second))


def _short(path: Path) -> str:
    """Name of a folder, of a file without ending, of the folder of a ``result.json``."""
    whole = path.absolute()
    if whole.is_dir():
        return whole.name
    return whole.parent.name if whole.name == "result.json" else whole.stem
