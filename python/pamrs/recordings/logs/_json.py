"""JSON: records in an array or in lines, columns in a table; the table may lie deeper."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pamrs.errors import RecordingError
from pamrs.recordings._gate import check_size
from pamrs.recordings.logs._log import Log, TextFormat
from pamrs.recordings.logs._text import log_of_lines
from pamrs.recordings.table import lines_of_rows, read_text


def read_json(path: Path, form: TextFormat) -> Log:
    """Read a JSON file.

    Parameters
    ----------
    path : Path
        ``.json``, ``.jsonl`` or ``.ndjson``; ``.gz`` is unpacked.
    form : TextFormat
        Its `columns` hold; the rest JSON says itself.

    Returns
    -------
    Log
        One series for each key; the keys of a path are joined by ``/``.

    Raises
    ------
    RecordingError
        If it is broken, or holds no table.
    """
    text = read_text(path)
    try:
        content = json.loads(text)
    except json.JSONDecodeError:
        lines = enumerate(text.splitlines(), start=1)
        content = [_loaded(path, number, line) for number, line in lines if line.strip()]
    said: list[str] = []
    rows = _rows(content, said)
    if not any(rows):
        raise RecordingError(f"{path}: no table was found: neither a list of records nor columns")
    check_size(len(rows), sum(map(len, rows)), str(path), len(rows[0]))
    body = lines_of_rows([_text(each) for each in row] for row in rows)
    return log_of_lines(path, body, form, ".", said)


def _loaded(path: Path, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: line {number}, column {error.colno}: {error.msg}") from error


def _rows(content: Any, remarks: list[str]) -> list[list[Any]]:
    """Headings and rows of the first table in what was read, without cells where there is none."""
    if isinstance(content, list) and any(isinstance(each, Mapping) for each in content):
        flat = [_flat(each) for each in content if isinstance(each, Mapping)]
        names = list(dict.fromkeys(name for each in flat for name in each))
        return [names, *([each.get(name) for name in names] for each in flat)]
    if isinstance(content, list):
        return content if all(isinstance(each, list) for each in content) else []
    if not isinstance(content, Mapping):
        return []
    inner = [each for each in content.values() if isinstance(each, Mapping)]
    alike = len(inner) == len(content) and all(set(each) == set(inner[0]) for each in inner)
    if alike and not any(isinstance(v, (Mapping, list)) for each in inner for v in each.values()):
        content = {name: list(each.values()) for name, each in content.items()}  # as pandas has it
    lists = {name: each for name, each in _flat(content).items() if isinstance(each, list)}
    for each in filter(None, lists.values()):
        if isinstance(each[0], (Mapping, list)) and any(rows := _rows(each, remarks)):
            heads = content.get("columns")
            return [heads, *rows] if isinstance(heads, list) and rows is each else rows
    counts = [len(each) for each in lists.values() if each]
    usual = max(counts, key=counts.count, default=0)
    others = [f"{name} ({len(each)})" for name, each in lists.items() if len(each) != usual]
    if others:
        remarks.append(f"left out: {', '.join(others)}: the rest have {usual} values each")
    columns = {name: each for name, each in lists.items() if len(each) == usual}
    return [list(columns), *map(list, zip(*columns.values(), strict=True))] if columns else []


def _flat(record: Any, before: str = "") -> dict[str, Any]:
    """Values of a record and of the records in it, by the keys of their paths."""
    if not isinstance(record, Mapping):
        return {before: record}
    found: dict[str, Any] = {}
    for key, value in record.items():
        found |= _flat(value, f"{before}/{key}" if before else str(key))
    return found


def _text(value: Any) -> str:
    """A value as a text file has it."""
    if value is None or isinstance(value, str):
        return (value or "").strip()
    return json.dumps(value)
