"""Two results side by side, as text and as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pamrs.channels import unit_of
from pamrs.findings import Compared
from pamrs.report import words
from pamrs.report.page import render_page
from pamrs.units import with_unit

_NOTHING = "-"


def _value(own: dict[str, Any] | None) -> str:
    """A parameter with its standard deviation and unit."""
    if own is None or own["value"] is None:
        return _NOTHING
    if own["identifiable"] is False:
        return "not determined"
    unit, factor = words.display_unit(own["unit"] or "", abs(own["value"]))
    std = None if own["std"] is None else own["std"] * factor
    text = words.format_uncertain(own["value"] * factor, std)
    return words.plain(with_unit(text, unit))


def tables(found: Compared) -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Tables of two results: titles, and rows of a name and both entries.

    Parameters
    ----------
    found : Compared
        Both results.
    """

    def size(name: str, value: float | None) -> str:
        return _NOTHING if value is None else words.sized(value, unit_of(name.rpartition(": ")[2]))

    def noises(value: float | None) -> str:
        return _NOTHING if value is None else words.plain(words.format_number(value, 2))

    def spoken(block: str | None) -> str:
        return words.spoken_name(block) if block else _NOTHING

    one, other = found.verdict
    pairs = {
        "answer": [
            ("verdict", one or _NOTHING, other or _NOTHING),
            ("block", spoken(found.block[0]), spoken(found.block[1])),
        ],
        "probability": [
            (words.hypothesis_label(n), *(words.format_probability(p or 0.0) for p in pair))
            for n, pair in found.candidates.items()
        ],
        "missed with what was found [noise levels]": [
            (words.spoken_name(n), *map(noises, pair)) for n, pair in found.missed.items()
        ],
        "whole rig from its commands alone": [
            (n, size(n, pair[0]), size(n, pair[1])) for n, pair in found.free_run.items()
        ],
        "parameters": [(n, *map(_value, pair)) for n, pair in found.parameters.items()],
    }
    return [(title, rows) for title, rows in pairs.items() if rows]  # type: ignore[misc]


def comparison_text(found: Compared) -> str:
    """Both results as text for a terminal.

    Parameters
    ----------
    found : Compared
        Both results.
    """
    every = tables(found)
    wide = [
        max(len(row[k]) for row in ([("", *found.names)] + [r for _, rows in every for r in rows]))
        for k in range(3)
    ]
    wide[0] = max(wide[0], *(len(title) for title, _ in every))
    lines = [f"{'':{wide[0]}}  {found.names[0]:>{wide[1]}}  {found.names[1]:>{wide[2]}}"]
    for title, rows in every:
        lines += ["", title]
        lines += [f"{a:{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in rows]
    changes = found.changed or ["nothing that counts"]
    return "\n".join([*lines, "", "changed", *(f"  {line}" for line in changes)])


def comparison_html(found: Compared) -> str:
    """Both results as one page without references to anything outside it.

    Parameters
    ----------
    found : Compared
        Both results.
    """
    page = Path(__file__).with_name("compare.html.j2")
    return render_page(page, names=found.names, changed=found.changed, tables=tables(found))
