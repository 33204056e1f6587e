"""Open the keys and score what a diagnosis said about each case."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from typing import Any

from .effects import LISTED, TYPES

SCHEMA = "pamrs.diagnosis/1"
VERDICTS = ("none", "parameters", "effects", "unlisted")
HEALTHY = ("none", "parameters")
#: sum over the channels of what a refit leaves above the noise, in units of it, below which there is no gap to close
LEAST_ROOM = 0.05
#: block of the rig in which an effect of a block of the plant acts; transducers go by their channel
_ACTS = {
    "supply": "supply", "valve": "chamber", "line": "chamber", "chamber": "chamber", "muscle": "arm", "joint": "arm", "arm": "arm",
    "encoder_gear_lash": "arm", "encoder_eccentricity": "arm", "pressure_lag": "chamber", "pressure_zero_drift": "chamber",
}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One scored case; `probability`, `gap`, `utility` and `seconds` are None when the result lacks them.

    `wanted` is the strength ("weak", "medium", "strong", "pair" or ""), `first` what was named first, `claim` the
    largest stated probability and whether its hypothesis is the truth.

    `labels` are the strengths of all `ids`, `listed` those of `ids` that can be named, `name_probability` the probability
    that they are among what is missing. `rest_said` tells, of a listed effect beside one of no catalogue, whether the
    result says that a block where the latter acts keeps a mismatch; `unexplained` are the blocks it says so of. `wrong`
    are the parameters that are far off, with their tolerances, `wrong_named` those that the result names,
    `interval_holds` whether the stated intervals hold the true values (None where they are not named). `false_name`: on
    a case without an effect, an effect or `unlisted` was claimed, or a parameter called wrong on a null.
    `held_out` is the largest error on held-out recordings after the diagnosis, in units of the noise, and `said` all
    that was said.
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
    labels: tuple[str, ...] = ()
    listed: tuple[str, ...] = ()
    name_probability: float | None = None
    rest_said: bool | None = None
    unexplained: tuple[str, ...] = ()
    wrong: tuple[tuple[str, float], ...] = ()
    wrong_named: tuple[str, ...] = ()
    interval_holds: bool | None = None
    false_name: bool = False
    held_out: float | None = None
    said: str = "no result"
    seed: int = 0

    @property
    def mixed(self) -> bool:
        """Whether an effect that can be named stands beside one that cannot."""
        return 0 < len(self.listed) < len(self.ids)

    @property
    def healthy(self) -> bool:
        """Whether nothing is missing and no parameter is far off."""
        return not self.ids and not self.wrong

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


def _parameters(names: Iterable[str]) -> set[str]:
    """Those of the names that are parameters (dotted), not effects."""
    return {n for n in names if "." in n}


def _parts(name: str, parameters: bool) -> frozenset[str]:
    """What a hypothesis claims, empty where it is healthy; names of parameters count only on demand."""
    parts = frozenset(name.replace(",", "+").split("+")) - set(HEALTHY)
    return parts if parameters else parts - _parameters(parts)


def _pooled(probabilities: dict[str, float], parameters: bool) -> dict[frozenset[str], float]:
    """Stated probabilities by what is claimed."""
    found: dict[frozenset[str], float] = {}
    for name, p in probabilities.items():
        group = _parts(name, parameters)
        found[group] = found.get(group, 0.0) + p
    return found


def _numbers(table: dict[str, Any]) -> dict[str, float]:
    return {str(k): float(v) for k, v in table.items() if v is not None}


def _among(result: dict[str, Any], names: Sequence[str]) -> float:
    """Probability that all these names are among what is missing, each by the block that knows most of it."""

    def within(told: dict[str, Any], name: str) -> float:
        chances = _numbers(told.get("probabilities", {})).items()
        return min(1.0, sum(p for k, p in chances if name in _parts(k, True)))

    blocks = result.get("blocks") or [result]
    return math.prod(max((within(b, name) for b in blocks), default=0.0) for name in names)


def _block_of(effect: str) -> str:
    """Block of the rig in which an effect acts."""
    return _ACTS.get(effect) or _ACTS.get(TYPES[effect].block if effect in TYPES else "", "")


def _claim(truth: set[str], probabilities: dict[str, float]) -> tuple[float, bool] | None:
    """Largest stated probability and whether it is on the truth; "none" and "parameters" count as one.

    A wrong parameter counts as healthy, unless the truth is one: then the names must equal it.
    """
    far = bool(_parameters(truth))
    pooled = _pooled(probabilities, far)
    if not pooled:
        return None
    best = max(pooled, key=lambda g: pooled[g])
    if far:
        return min(pooled[best], 1.0), best == truth
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
    named = result["verdict"] == "effects" or bool(result.get("wrong_parameters"))
    return 0.0 if room >= LEAST_ROOM and not named else None


def _held_out(result: dict[str, Any]) -> float | None:
    """Largest error after the diagnosis on held-out recordings, in units of the noise of its channel."""
    table = (result.get("fit", {}).get("held_out") or {}).values()
    pairs = [(_number(e.get("after")), _number(e.get("noise"))) for e in table]
    return max((a / s for a, s in pairs if a is not None and s), default=None)


def _holds(true: dict[str, Any], told: Sequence[dict[str, Any]]) -> bool | None:
    """Whether the stated intervals hold the true values; None where not all of them are stated."""
    intervals = {str(e["name"]): e.get("interval") or (None, None) for e in told}
    found = []
    for name, entry in true.items():
        low, high = (_number(v) for v in intervals.get(name, (None, None)))
        if low is None or high is None:
            return None
        found.append(low <= float(entry["value"]) <= high)
    return all(found) if found else None


def _said(result: dict[str, Any], named: Sequence[str], wrong: Sequence[str], unexplained: Sequence[str]) -> str:
    """Verdict, names, wrong parameters, what stays unexplained and the sets that cannot be told apart, in one line."""
    verdict = str(result["verdict"])
    text = f"effects {', '.join(named)}" if verdict == "effects" else verdict
    if wrong:
        text += f"; wrong {', '.join(wrong)}"
    if unexplained:
        text += f"; unexplained in {', '.join(dict.fromkeys(unexplained))}"
    sets = [" + ".join(map(str, group)) for group in result.get("ambiguity", [])]
    return text + (f"; not told apart: {' or '.join(sets)}" if len(sets) > 1 else "")


def score_case(key: dict[str, Any], result: dict[str, Any] | None, catalogue: Sequence[str]) -> Row:
    """Score one case; a missing result is wrong.

    An effect that is not in the catalogue has the truth "unlisted", unless the diagnosis gives that very id a
    probability. Of a listed effect beside such a one, the listed one must be named first; what is said of the rest is
    scored apart.
    """
    case, kind, ids = str(key["case"]), str(key["kind"]), [str(i) for i in key["effects"]]
    reach = float(key.get("reach", 0.0))
    labels = list(key.get("wanted", {}).values())
    wanted = "pair" if len(ids) > 1 else str(labels[0]) if labels else ""
    left = _number(key.get("reach_left"))
    far: dict[str, Any] = key.get("wrong_parameters", {})
    wrong = tuple((str(k), float(e["tolerances"])) for k, e in far.items())
    probabilities = _numbers((result or {}).get("probabilities", {}))
    known = {*catalogue, *(i for i in ids if i in probabilities)}
    listed = tuple(i for i in ids if i in known)
    mixed = 0 < len(listed) < len(ids)
    common: dict[str, Any] = {
        "ids": tuple(ids),
        "wanted": wanted,
        "left": left,
        "labels": tuple(map(str, labels)),
        "listed": listed,
        "wrong": wrong,
        "seed": int(key.get("seed", 0)),
    }
    if result is None:
        gap, missed = 0.0 if ids else None, False if mixed else None
        return Row(case, kind, "missing", "-", None, "wrong", gap, reach, None, False, None, **common, rest_said=missed)
    verdict = str(result["verdict"])
    # effects, best first: a single name is judged, a pair must be named whole
    named = [str(e["id"]) for e in result.get("effects", [])]
    truth = {i if i in known else "unlisted" for i in ids} | set(far)
    top = named[: max(1, len(listed) if mixed else len(truth))] if verdict == "effects" else []
    told_wrong = list(result.get("wrong_parameters") or [])
    wrong_named = tuple(str(e["name"]) for e in told_wrong)
    # what a name leaves is no claim of its own
    unexplained = tuple(str(e["block"]) for e in result.get("unexplained") or [] if e.get("verdict", "unlisted") == "unlisted")
    rest = {"unlisted"} if unexplained else set[str]()
    answer = _answer(verdict, named)
    sets = [{part for i in group for part in str(i).split("+")} for group in result.get("ambiguity", [])]
    if far:
        right = verdict == "parameters" and set(wrong_named) == truth
        contains = right or truth in sets
        outcome = "right" if right else ("ambiguous" if contains or verdict in HEALTHY else "wrong")
    elif mixed:
        right = verdict == "effects" and set(top) == set(listed)
        contains = right or any(s - {"unlisted"} == set(listed) for s in sets)
        outcome = "right" if right else ("ambiguous" if contains else "wrong")
    elif not ids:
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
    pooled = _pooled(probabilities, bool(far))
    if mixed:
        chance = _among(result, listed)
    elif not ids:
        # "none" and "parameters" say that no physics is missing, and which of them is a matter of degree
        chance = pooled.get(frozenset(truth), 0.0)
    elif len(truth) == 1:
        chance = pooled.get(frozenset(truth))
    else:
        joint = [probabilities.get(sep.join(order)) for sep in ("+", ",") for order in (ids, ids[::-1])]
        chance = next((p for p in joint if p is not None), min((probabilities.get(i, 0.0) for i in truth), default=0.0))
    gap = gap_of(result)
    # wrong parameters are healthy, unless the truth is one
    groups = sets if sets else [answer | (set(wrong_named) if far else set())]
    groups = [s - {"none", "parameters"} | (set() if ids and len(listed) == len(ids) else rest) for s in groups]
    groups = groups if far else [s - _parameters(s) for s in groups]
    components = len({*known, "unlisted", *named, *truth, *(wrong_named if far else ())})
    mark = utility(truth, groups, components)
    plain = "+".join(wrong_named) if verdict == "parameters" and wrong_named else verdict
    label = "+".join(top) if verdict == "effects" else plain
    claimed = verdict in ("effects", "unlisted") or bool(rest)
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
        **common,
        first=(named[0] if named else "effects") if verdict == "effects" else plain,
        claim=_claim(truth, probabilities),
        name_probability=_among(result, listed) if listed else None,
        rest_said=any(b.startswith(_block_of(i)) for b in unexplained for i in ids if i not in known) if mixed else None,
        unexplained=unexplained,
        wrong_named=wrong_named,
        interval_holds=_holds(far, told_wrong),
        false_name=not ids and (claimed or bool(wrong_named and not far)),
        held_out=_held_out(result),
        said=_said(result, named, wrong_named, unexplained),
    )


def _count(rows: Iterable[bool]) -> tuple[int, int]:
    kept = list(rows)
    return sum(kept), len(kept)


def _median(values: Sequence[float | None]) -> float | None:
    kept = [v for v in values if v is not None]
    return median(kept) if kept else None


def score(keys: Path, results: Path, catalogue: Sequence[str] = LISTED, first: int | None = None) -> Scores:
    """Score every key in a folder, or the first so many by name.

    Parameters
    ----------
    keys : Path
        Folder with the key files.
    results : Path
        Folder with ``case_xxx/out.json`` or ``case_xxx.json``.
    catalogue : sequence of str
        Effect ids that the diagnosis may name; others are unlisted.
    first : int, optional
        How many; all by default.

    Raises
    ------
    ValueError
        No key, or a result of another schema.
    """
    files = sorted(Path(keys).glob("*.json"))[:first]
    if not files:
        raise ValueError(f"no key in {keys}")
    rows: list[Row] = []
    for file in files:
        key = json.loads(file.read_text(encoding="utf-8"))
        rows.append(score_case(key, _result(Path(results), str(key["case"])), catalogue))
    healthy = [r for r in rows if r.healthy]
    far = [r for r in rows if r.wrong]
    listed = [r for r in rows if r.ids and all(i in catalogue for i in r.ids)]
    mixed = [r for r in rows if r.ids and r not in listed and any(i in catalogue for i in r.ids)]
    unlisted = [r for r in rows if r.ids and not any(i in catalogue for i in r.ids)]
    sick = (*listed, *unlisted, *mixed)
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
    if mixed:
        shares["right name first (beside an effect of no catalogue)"] = _count(r.outcome == "right" for r in mixed)
        shares["unexplained rest is said"] = _count(r.rest_said for r in mixed if r.rest_said is not None)
    if far:
        shares["wrong parameter named"] = _count(r.outcome == "right" for r in far)
        shares["wrong parameter named or in an ambiguity set"] = _count(r.contains for r in far)
        shares["stated interval holds the wrong parameter"] = _count(r.interval_holds for r in far if r.interval_holds is not None)
        shares["false names (no effect concealed)"] = _count(r.false_name for r in (*healthy, *far))
    utilities = [r.utility if r.utility is not None else 0.0 for r in rows]
    totals: dict[str, float | int | None] = {
        "cases": len(rows),
        "without a result": sum(r.verdict == "missing" for r in rows),
        **{name: k / n if n else None for name, (k, n) in shares.items()},
        "mean probability on the truth (all cases)": mean(r.probability or 0.0 for r in rows),
        "median gap closed (cases with an effect)": _median([r.gap for r in sick]),
        "ambiguity-group utility": mean(utilities),
        "median seconds": _median([r.seconds for r in rows]),
        "right": sum(r.outcome == "right" for r in rows),
        "ambiguous": sum(r.outcome == "ambiguous" for r in rows),
        "wrong": sum(r.outcome == "wrong" for r in rows),
    }
    return Scores(rows, totals, shares)
