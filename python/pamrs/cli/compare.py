"""``pamrs compare``: two results of diagnoses side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pamrs.cli._shared import check_writable, document, write

__all__ = ["compare_command"]


def compare_command(
    first: Annotated[
        Path,
        typer.Argument(metavar="A", help="A result (--json of diagnose), or a folder with it."),
    ],
    second: Annotated[Path, typer.Argument(metavar="B", help="The result to compare it with.")],
    json: Annotated[
        Path | None, typer.Option(help="Write both (schema pamrs.comparison/1).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write a page, one HTML file.")] = None,
) -> None:
    """Set two results of diagnose side by side: verdict, block, candidates with probabilities,
    parameters, what the models miss, and what changed.
    """
    check_writable(json, out)
    from pamrs.findings import compare_results
    from pamrs.report.compare import comparison_html, comparison_text

    results = _read(first), _read(second)
    found = compare_results(_names(first, second), *results)
    write(
        {
            json: document("pamrs.comparison/1", **found.to_dict()),
            out: comparison_html(found),
        },
        comparison_text(found),
    )


def _names(first: Path, second: Path) -> tuple[str, str]:
    """What two results are called: their files or folders, in full where these are the same."""
    short = [path.stem if path.stem != "result" else path.parent.name for path in (first, second)]
    one, other = short if short[0] != short[1] else (str(first), str(second))
    return one, other


def _read(path: Path) -> dict[str, Any]:
    """A result, by its file or the folder with ``result.json``."""
    from json import JSONDecodeError, loads

    from pamrs.diagnosis.result import READABLE
    from pamrs.errors import ParameterError

    file = path / "result.json" if path.is_dir() else path
    try:
        told = loads(file.read_text(encoding="utf-8"))
    except (JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ParameterError(f"{file}: not a result of diagnose: no JSON ({error})") from None
    schema = told.get("schema") if isinstance(told, dict) else None
    if schema not in READABLE:
        allowed = " or ".join(map(repr, READABLE))
        raise ParameterError(
            f"{file}: not a result of diagnose: schema is {schema!r}; allowed is {allowed} "
            "(pamrs diagnose CASE --json result.json writes it)"
        )
    missing = [key for key in _NEEDED if key not in told]
    if missing:
        raise ParameterError(f"{file}: a result without {', '.join(missing)}; write it again")
    return {"free_run": None, "wrong_parameters": [], "blocks": [], **told}


_NEEDED = ("verdict", "where", "effects", "probabilities", "parameters", "fit")
