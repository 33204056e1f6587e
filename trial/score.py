"""Open the keys and score what a diagnosis said about each case."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from typing import Any

from .effects import LISTED

SCHEMA = "pamrs.diagnosis/1"
VERDICTS = ("none", "parameters", "effects", "unlisted")


@dataclass(frozen=True)
class Row:
    """One scored case; `probability`, `gap`, `utility` and `seconds` are None when the result lacks them."""

    case: str
    truth: str
    verdict: str
    named: str
    probability: float | None
    outcome: str
    gap: float | None
    reach: float
    utility: float | None
    contains: bool
    seconds: float | None


@dataclass(frozen=True)
class Scores:
    """All rows and the totals (None where no case of that class exists)."""

    rows: list[Row]
    totals: dict[str, float | int | None] = field(default_factory=dict)

    def text(self) -> str:
        """Table and totals as plain text."""
        head = ("case", "truth", "verdict", "named", "p(truth)", "outcome", "gap", "reach", "seconds")
        body = [
            (
                r.case,
                r.truth,
                r.verdict,
                r.named,
                _show(r.probability),
                r.outcome,
                _show(r.gap),
                f"{r.reach:.1f}",
                _show(r.seconds, 1),
            )
            for r in self.rows
        ]
        width = [max(len(line[i]) for line in [head, *body]) for i in range(len(head))]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(line, width, strict=True)).rstrip() for line in [head, *body]]
        lines.append("")
        wide = max(len(k) for k in self.totals)
        lines += [f"{k.ljust(wide)}  {_show(v, 3)}" for k, v in self.totals.items()]
        return "\n".join(lines)


def _show(value: float | int | None, digits: int = 2) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.{digits}f}"


def _number(value: Any) -> float | None:
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if good else None


def utility(truth: set[str], answers: Sequence[set[str]], components: int) -> float:
    """Mean ambiguity-group utility over the answers.

    For each answer ``m = 1 - n(N+1)/(f(n+1)) - n'(N'+1)/(f(n'+1))`` with n the missed effects, N the
    components that the answer calls healthy, n' the effects named wrongly, N' the effects named, f the number
    of components.
    """
    marks = []
    for answer in answers:
        missed, extra = len(truth - answer), len(answer - truth)
        sick = len(answer)
        well = components - sick
        marks.append(1.0 - missed * (well + 1) / (components * (missed + 1)) - extra * (sick + 1) / (components * (extra + 1)))
    return mean(marks)


def _result(folder: Path, case: str) -> dict[str, Any] | None:
    for path in (folder / case / "out.json", folder / f"{case}.json"):
        if path.is_file():
            data = json.loads(path.read_text(encoding="utf-8"))
            if not isinstance(data, dict) or data.get("schema") != SCHEMA:
                raise ValueError(f"{path}: schema must be {SCHEMA!r}")
            if data.get("verdict") not in VERDICTS:
                raise ValueError(f"{path}: verdict {data.get('verdict')!r} is not one of {', '.join(VERDICTS)}")
            return data
    return None


def _answer(verdict: str, effects: Sequence[str]) -> set[str]:
    """The claim as a set: the effects named, or "unlisted"; none and parameters claim no fault."""
    if verdict == "effects":
        return set(effects)
    return {"unlisted"} if verdict == "unlisted" else set()


def score_case(key: dict[str, Any], result: dict[str, Any] | None, catalogue: Sequence[str]) -> Row:
    """Score one case; a missing result is wrong.

    An effect that is not in the catalogue has the truth "unlisted", unless the diagnosis gives that very id a
    probability.
    """
    case, kind, ids = str(key["case"]), str(key["kind"]), [str(i) for i in key["effects"]]
    reach = float(key.get("reach", 0.0))
    if result is None:
        return Row(case, kind, "missing", "-", None, "wrong", None, reach, None, False, None)
    verdict = str(result["verdict"])
    probabilities = {str(k): float(v) for k, v in result.get("probabilities", {}).items()}
    known = {*catalogue, *(i for i in ids if i in probabilities)}
    # effects, best first: a single name is judged, a pair must be named whole
    named = [str(e["id"]) for e in result.get("effects", [])]
    truth = {i if i in known else "unlisted" for i in ids}
    top = named[: max(1, len(truth))] if verdict == "effects" else []
    answer = _answer(verdict, named)
    sets = [{str(i) for i in group} for group in result.get("ambiguity", [])]
    if not ids:
        right = verdict == kind
        # "parameters" and "none" both say that no physics is missing
        harmless = verdict in ("none", "parameters")
        contains = harmless or any(s <= {"none", "parameters"} for s in sets)
        outcome = "right" if right else ("ambiguous" if harmless or contains else "wrong")
    else:
        right = _answer(verdict, top) == truth if verdict == "effects" else answer == truth
        contains = right or truth in sets
        outcome = "right" if right else ("ambiguous" if contains else "wrong")
    chance: float | None
    if not ids:
        chance = probabilities.get(kind)
    elif len(truth) == 1:
        chance = probabilities.get(next(iter(truth)))
    else:
        joint = [probabilities.get(sep.join(order)) for sep in ("+", ",") for order in (ids, ids[::-1])]
        chance = next((p for p in joint if p is not None), min((probabilities.get(i, 0.0) for i in truth), default=0.0))
    gap = _number(result.get("fit", {}).get("gap_closed"))
    groups = sets if sets else [answer]
    groups = [s - {"none", "parameters"} for s in groups]
    components = len({*known, "unlisted", *named})
    mark = utility(truth, groups, components)
    label = "+".join(top) if verdict == "effects" else verdict
    return Row(
        case,
        kind,
        verdict,
        label,
        chance if chance is not None else 0.0,
        outcome,
        gap,
        reach,
        mark,
        contains,
        _number(result.get("seconds")),
    )


def _share(rows: Sequence[bool]) -> float | None:
    return mean(1.0 if r else 0.0 for r in rows) if rows else None


def _median(values: Sequence[float | None]) -> float | None:
    kept = [v for v in values if v is not None]
    return median(kept) if kept else None


def score(keys: Path, results: Path, catalogue: Sequence[str] = LISTED) -> Scores:
    """Score every key in a folder.

    Parameters
    ----------
    keys : Path
        Folder with the key files.
    results : Path
        Folder with ``case_xxx/out.json`` or ``case_xxx.json``.
    catalogue : sequence of str
        Effect ids that the diagnosis may name; others are unlisted.

    Raises
    ------
    ValueError
        No key, or a result of another schema.
    """
    files = sorted(Path(keys).glob("*.json"))
    if not files:
        raise ValueError(f"no key in {keys}")
    rows: list[Row] = []
    healthy: list[Row] = []
    listed: list[Row] = []
    unlisted: list[Row] = []
    for file in files:
        key = json.loads(file.read_text(encoding="utf-8"))
        row = score_case(key, _result(Path(results), str(key["case"])), catalogue)
        rows.append(row)
        ids = key["effects"]
        (healthy if not ids else listed if all(i in catalogue for i in ids) else unlisted).append(row)
    said = ("effects", "unlisted")
    clear = [r for r in (*listed, *unlisted) if r.reach >= 3.0]
    utilities = [r.utility if r.utility is not None else 0.0 for r in rows]
    totals: dict[str, float | int | None] = {
        "cases": len(rows),
        "without a result": sum(r.verdict == "missing" for r in rows),
        "false alarms (null and parameter cases)": _share([r.verdict in said for r in healthy]),
        "detected (effect moves a channel by 3x noise)": _share([r.verdict in said for r in clear]),
        "right name first (catalogue effects)": _share([r.outcome == "right" for r in listed]),
        "name or ambiguity set holds the truth": _share([r.contains for r in listed]),
        "mean probability on the truth (all cases)": mean(r.probability or 0.0 for r in rows),
        "unlisted recognised": _share([r.outcome == "right" for r in unlisted]),
        "median gap closed (cases with an effect)": _median([r.gap for r in (*listed, *unlisted)]),
        "ambiguity-group utility": mean(utilities),
        "median seconds": _median([r.seconds for r in rows]),
        "right": sum(r.outcome == "right" for r in rows),
        "ambiguous": sum(r.outcome == "ambiguous" for r in rows),
        "wrong": sum(r.outcome == "wrong" for r in rows),
    }
    return Scores(rows, totals)
