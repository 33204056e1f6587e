"""The diagnosis beside what other methods made of the same cases
(``python -m benchmarks.baselines``).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from .effects import LISTED
from .score import Row, score
from .strength import STRENGTHS
from .targets import SEEN, wilson

SCHEMA = "pamrs.baselines/1"
METHODS = {"refit": "refit only", "sindy": "SINDy", "gp": "Gaussian process", "pamrs": "pamrs"}
CLASSES = (
    *(f"catalogue, {label}" for label in STRENGTHS),
    "catalogue",
    "pair",
    *(f"unlisted, {label}" for label in STRENGTHS),
    "unlisted",
)


@dataclass(frozen=True)
class Compared:
    """One case by every method: the gap that each closed (None: there was none), and whether a
    refit alone raised an alarm.
    """

    row: Row
    kind: str
    gaps: dict[str, float | None]
    alarm: bool | None


def class_of(row: Row, catalogue: Sequence[str]) -> str:
    """Class of a case and the strength of its effect, in words."""
    if not row.ids:
        return row.truth
    if len(row.ids) > 1:
        return "pair"
    kind = "catalogue" if row.ids[0] in catalogue else "unlisted"
    return f"{kind}, {row.wanted}" if row.wanted else kind


def told_by_others(file: Path) -> dict[str, Any]:
    """What the other methods made of a case.

    Raises
    ------
    ValueError
        A result of another schema.
    """
    told: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if told.get("schema") != SCHEMA:
        raise ValueError(f"{file}: schema must be {SCHEMA!r}")
    return told


def compared(keys: Path, results: Path, catalogue: Sequence[str] = LISTED) -> list[Compared]:
    """Every case that the baselines were run on.

    Parameters
    ----------
    keys : Path
        Folder with the keys.
    results : Path
        Results of the diagnosis, with ``baselines/NAME.json``.
    catalogue : sequence of str
        As in :func:`trial.score.score`.

    Raises
    ------
    ValueError
        A baseline's result of another schema.
    """
    found = []
    for row in score(keys, results, catalogue).rows:
        file = Path(results) / "baselines" / f"{row.case}.json"
        if not file.is_file():
            continue
        told = told_by_others(file)
        gaps = {m: told["gap_closed"].get(m) for m in METHODS if m != "pamrs"}
        gaps["pamrs"] = None if gaps["refit"] is None else row.gap
        found.append(Compared(row, class_of(row, catalogue), gaps, told["detected"].get("refit")))
    return found


def medians(rows: Iterable[Compared]) -> tuple[dict[str, float], int]:
    """Median gap closed by method, over the cases in which every method has one, and their
    number.
    """
    whole = [{m: g for m, g in c.gaps.items() if g is not None} for c in rows]
    whole = [g for g in whole if len(g) == len(METHODS)]
    return ({m: median([g[m] for g in whole]) for m in METHODS} if whole else {}), len(whole)


def _share(rows: Iterable[Compared], hit: Callable[[Compared], bool | None]) -> str:
    told = [bool(hit(c)) for c in rows]
    if not told:
        return "-"
    low, high = wilson(sum(told), len(told))
    return f"{100 * sum(told) / len(told):.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def side_by_side(rows: Sequence[Compared]) -> str:
    """Markdown: the gap closed by class and strength, and what each method detects and names."""
    lines = [
        (
            "Median share of the gap to the noise closed on held-out recordings; a case whose "
            "refit leaves no gap is left out.\n"
        ),
        "| class | cases | " + " | ".join(METHODS.values()) + " |",
        "|---|---|" + "---|" * len(METHODS),
    ]
    for name in (*CLASSES, "all"):
        middle, count = medians(c for c in rows if c.row.ids and name in ("all", c.kind))
        if count:
            lines.append(
                f"| {name} | {count} | " + " | ".join(f"{middle[m]:.2f}" for m in METHODS) + " |"
            )
    healthy = [c for c in rows if c.row.healthy]
    seen = [c for c in rows if c.row.ids and c.row.visible >= SEEN]
    listed = [c for c in seen if not c.kind.startswith("unlisted")]
    none = "0 % by construction"
    refit = (_share(healthy, lambda c: c.alarm), _share(seen, lambda c: c.alarm))
    mine = (_share(healthy, lambda c: c.row.detected), _share(seen, lambda c: c.row.detected))
    lines += [
        "\nThe refit raises an alarm by chi-square (1 %, its residual's means over 0.1 s against "
        "the diagnosis' own noise level). SINDy and the Gaussian process predict; they neither "
        "test nor name a cause.\n",
        "| | refit, chi-square | SINDy | Gaussian process | pamrs |",
        "|---|---|---|---|---|",
        f"| false alarms | {refit[0]} | - | - | {mine[0]} |",
        f"| detected ({SEEN:g} x noise left) | {refit[1]} | - | - | {mine[1]} |",
        f"| right name first (catalogue, {SEEN:g} x noise left) | {none} | {none} | {none} | "
        f"{_share(listed, lambda c: c.row.outcome == 'right')} |",
    ]
    return "\n".join(lines)
