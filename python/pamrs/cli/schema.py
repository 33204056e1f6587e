"""``pamrs schema``: JSON schemas of what people write and what a diagnosis gives."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pamrs._writing import write_atomically
from pamrs.cli._shared import note


class _What(StrEnum):
    rig = "rig"
    case = "case"
    result = "result"


def schema_command(
    what: Annotated[_What, typer.Argument(help="rig.toml, case.toml or result.json.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write; without it, to standard output.")
    ] = None,
) -> None:
    """Write the JSON schema of rig.toml, case.toml or result.json: keys, units, bounds, defaults.

    With '#:schema rig.schema.json' in its first line, editors complete and check a rig file
    (VS Code: Even Better TOML).
    """
    if what is _What.rig:
        from pamrs.rig.json_schema import rig_schema as made
    elif what is _What.case:
        from pamrs.recordings import case_schema as made
    else:
        from pamrs.diagnosis.result import schema as made
    text = json.dumps(made(), ensure_ascii=False, separators=(",", ":")) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return

    write_atomically(out, text)
    note(f"written: {out}")
