"""Lines of serial monitors: a time before an arrow, numbers that stand behind their labels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from pamrs.recordings.table import told_rows

_ARROW: Final = re.compile(r"\s*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)\s*->\s?(.*)")
_NUMBER: Final = r"[-+]?(?:\d+(?:[.,]\d+)?|\.\d+)(?:[eE][-+]?\d+)?|nan|ovf|inf|OL|#N/A"
_PAIR: Final = re.compile(
    r"[\s,;|{\"]*(?P<name>[^\W\d](?:[^\s:=,;|{}\"]|[ ](?=\S))*)\"?"
    rf"\s*[:=]\s*(?P<value>{_NUMBER})"
    r"(?:\s*(?P<unit>[A-Za-zµ°%]+))?(?=[\s,;|}]|$)[\s,;|}]*",
    re.IGNORECASE,
)
_MOST: Final = 0.8  # of the lines look so


def arrows_apart(lines: Sequence[str]) -> tuple[list[str], list[str]] | None:
    """What stands before and behind the arrow of ``10:16:51.123 -> 5.00,152057``.

    Parameters
    ----------
    lines : sequence of str
        All lines.

    Returns
    -------
    times, rests : list of str
        Of the lines that have an arrow; None where most have none.
    """
    middle = lines[len(lines) // 2 :][:100]
    if sum(_ARROW.fullmatch(line) is not None for line in middle) < _MOST * max(len(middle), 1):
        return None
    found = [match for line in lines if (match := _ARROW.fullmatch(line)) is not None]
    return [match[1] for match in found], [match[2] for match in found]


def _pairs(line: str) -> list[tuple[str, str, str]] | None:
    """Names, numbers and units of a line that has nothing else."""
    place, found = 0, []
    while place < len(line):
        match = _PAIR.match(line, place)
        if match is None:
            return None
        found.append((match["name"].strip(), match["value"], match["unit"] or ""))
        place = match.end()
    return found


def labelled_rows(
    lines: Sequence[str], times: Sequence[str] | None
) -> tuple[list[list[str]], list[str]] | None:
    """Rows of lines like ``t:0.02,u:7.00,p:1.5 bar``.

    Parameters
    ----------
    lines : sequence of str
        All lines.
    times : sequence of str, optional
        What stood before the arrow of each; the first column then.

    Returns
    -------
    rows : list of list of str
        Headings, then rows, each of which ends where a label comes again; empty where a label is
        missing.
    remarks : list of str
        What was left out.
    None where most lines are not so.
    """
    middle = lines[len(lines) // 2 :][:100]
    if sum(_pairs(line) is not None for line in middle) < _MOST * max(len(middle), 1):
        return None
    found = [_pairs(line) for line in lines]
    columns: dict[str, str] = {}
    for pairs in found:
        for name, _, unit in pairs or ():
            columns[name] = columns.get(name) or unit
    place = {name: index for index, name in enumerate(columns)}
    before = ["time"] if times is not None else []
    rows = [[*before, *(f"{name} [{unit}]" if unit else name for name, unit in columns.items())]]
    strange = []
    filled: set[str] = set(columns)  # the first label begins a row
    for number, pairs in enumerate(found, start=1):
        if pairs is None:
            strange.append(number)
        for name, value, _ in pairs or ():
            if name in filled:
                filled.clear()
                rows.append([*(times[number - 1] for _ in before if times), *[""] * len(columns)])
            filled.add(name)
            rows[-1][len(before) + place[name]] = value.replace(",", ".")
    return rows, told_rows(strange, "lines without labels and numbers")
