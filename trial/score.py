"""Open the keys and score what a diagnosis said about each case."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from typing import Any

from .effects import LISTED

SCHEMA = "pamrs.diagnosis/1"
VERDICTS = ("none", "parameters", "effects", "unlisted")
HEALTHY = ("none", "parameters")
#: sum over the channels of what a refit leaves above the noise, in units of it, below which there is no gap to close
LEAST_ROOM = 0.05


@dataclass(frozen=True)
class Row:
    """One scored case; `probability`, `gap`, `utility` and `seconds` are None when the result lacks them.

    `wanted` is the strength ("weak", "medium", "strong", "pair" or ""), `first` what was named first, `claim` the
    largest stated probability and whether its hypothesis is the truth.
    """

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
    ids: tuple[str, ...] = ()
    wanted: str = ""
    left: float | None = None
    first: str = "-"
    claim: tuple[float, bool] | None = None

    @property
    def detected(self) -> bool:
        """Whether missing physics was claimed."""
        return self.verdict in ("effects", "unlisted")

    @property
    def visible(self) -> float:
        """Reach that a refit of the baseline leaves, or the plain reach when the key does not tell."""
        return self.reach if self.left is None else self.left


@dataclass(frozen=True)
class Scores:
    """All rows and the totals (None where no case of that class exists)."""

    rows: list[Row]
    totals: dict[str, float | int | None] = field(default_factory=dict)
    shares: dict[str, tuple[int, int]] = field(default_factory=dict)

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


def _claim(truth: set[str], probabilities: dict[str, float]) -> tuple[float, bool] | None:
    """Largest stated probability and whether it is on the truth; "none" and "parameters" count as one."""
    pooled: dict[frozenset[str], float] = {}
    for name, p in probabilities.items():
        group = frozenset() if name in HEALTHY else frozenset(name.replace(",", "+").split("+"))
        pooled[group] = pooled.get(group, 0.0) + p
    if not pooled:
        return None
    best = max(pooled, key=lambda g: pooled[g])
    # of a pair, either effect alone is a true claim
    right = best <= truth and bool(best) if truth else not best
    return min(pooled[best], 1.0), right


def gap_of(result: dict[str, Any]) -> float | None:
    """Share of the gap to the noise that the diagnosis closed on held-out recordings.

    What named nothing closed nothing: 0, unless its table of errors shows that there was no gap, which gives None.
    """
    fit = result.get("fit", {})
    gap = _number(fit.get("gap_closed"))
    table = fit.get("held_out") or fit.get("channels") or {}
    if gap is not None or not table:
        return gap
    pairs = [(_number(e.get("refit")), _number(e.get("noise"))) for e in table.values()]
    room = sum(r / s - 1.0 for r, s in pairs if r is not None and s)
    return 0.0 if room >= LEAST_ROOM and result["verdict"] != "effects" else None


def score_case(key: dict[str, Any], result: dict[str, Any] | None, catalogue: Sequence[str]) -> Row:
    """Score one case; a missing result is wrong.

    An effect that is not in the catalogue has the truth "unlisted", unless the diagnosis gives that very id a
    probability.
    """
    case, kind, ids = str(key["case"]), str(key["kind"]), [str(i) for i in key["effects"]]
    reach = float(key.get("reach", 0.0))
    labels = list(key.get("wanted", {}).values())
    wanted = "pair" if len(ids) > 1 else str(labels[0]) if labels else ""
    left = _number(key.get("reach_left"))
    if result is None:
        return Row(case, kind, "missing", "-", None, "wrong", 0.0 if ids else None, reach, None, False, None, tuple(ids), wanted, left)
    verdict = str(result["verdict"])
    probabilities = {str(k): float(v) for k, v in result.get("probabilities", {}).items() if v is not None}
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
        # both say that no physics is missing, and which of them is a matter of degree
        chance = sum(probabilities.get(k, 0.0) for k in HEALTHY)
    elif len(truth) == 1:
        chance = probabilities.get(next(iter(truth)))
    else:
        joint = [probabilities.get(sep.join(order)) for sep in ("+", ",") for order in (ids, ids[::-1])]
        chance = next((p for p in joint if p is not None), min((probabilities.get(i, 0.0) for i in truth), default=0.0))
    gap = gap_of(result)
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
        tuple(ids),
        wanted,
        left,
        (named[0] if named else "effects") if verdict == "effects" else verdict,
        _claim(truth, probabilities),
    )


def _count(rows: Iterable[bool]) -> tuple[int, int]:
    kept = list(rows)
    return sum(kept), len(kept)


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
    sick = (*listed, *unlisted)
    seen = [r for r in listed if r.visible >= 3.0]
    shares = {
        "false alarms (null and parameter cases)": _count(r.detected for r in healthy),
        "detected (moves a channel by 3x noise)": _count(r.detected for r in sick if r.reach >= 3.0),
        "detected (3x noise left after a refit)": _count(r.detected for r in sick if r.visible >= 3.0),
        "right name first (catalogue effects)": _count(r.outcome == "right" for r in listed),
        "right name first (3x noise left)": _count(r.outcome == "right" for r in seen),
        "name or ambiguity set holds the truth": _count(r.contains for r in listed),
        "name or set holds the truth (3x noise left)": _count(r.contains for r in seen),
        "unlisted recognised": _count(r.outcome == "right" for r in unlisted),
    }
    utilities = [r.utility if r.utility is not None else 0.0 for r in rows]
    totals: dict[str, float | int | None] = {
        "cases": len(rows),
        "without a result": sum(r.verdict == "missing" for r in rows),
        **{name: k / n if n else None for name, (k, n) in shares.items()},
        "mean probability on the truth (all cases)": mean(r.probability or 0.0 for r in rows),
        "median gap closed (cases with an effect)": _median([r.gap for r in (*listed, *unlisted)]),
        "ambiguity-group utility": mean(utilities),
        "median seconds": _median([r.seconds for r in rows]),
        "right": sum(r.outcome == "right" for r in rows),
        "ambiguous": sum(r.outcome == "ambiguous" for r in rows),
        "wrong": sum(r.outcome == "wrong" for r in rows),
    }
    return Scores(rows, totals, shares)
