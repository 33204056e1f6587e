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

RESULTS = ("pamrs.diagnosis/1", "pamrs.diagnosis/2")
VERDICTS = ("none", "parameters", "effects", "unlisted")
HEALTHY = ("none", "parameters")
#: sum over the channels of what a refit leaves above the noise, in units of it, below which there
#: is no gap to close
LEAST_ROOM = 0.05
#: block of the rig in which an effect of a block of the plant acts; transducers go by their channel
_ACTS = {
    "supply": "supply",
    "valve": "chamber",
    "line": "chamber",
    "chamber": "chamber",
    "muscle": "arm",
    "joint": "arm",
    "arm": "arm",
    "encoder_gear_lash": "arm",
    "encoder_error": "arm",
    "pressure_lag": "chamber",
    "pressure_zero_drift": "chamber",
}


@dataclass(frozen=True)
class Row:
    """One scored case; `probability`, `gap`, `utility` and `seconds` are None when the result lacks
    them.

    `wanted` is the strength ("weak", "medium", "strong", "pair" or ""), `first` what was named
    first, `claim` the largest stated probability and whether its hypothesis is the truth.

    `labels` are the strengths of all `ids`, `listed` those of `ids` that can be named,
    `name_probability` the probability that they are among what is missing. `rest_said` tells, of a
    listed effect beside one of no catalogue, whether the result says that a block where the latter
    acts keeps a mismatch; `unexplained` are the blocks it says so of. `wrong` are the parameters
    that are far off, with their tolerances, `wrong_named` those that the result names,
    `interval_holds` whether the stated intervals hold the true values (None where they are not
    named). `false_name`: on a case without an effect, an effect or `unlisted` was claimed, or a
    parameter called wrong on a null. `held_out` is the largest error on held-out recordings after
    the diagnosis, in units of the noise, and `said` all that was said.
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
        """Reach that a refit of the baseline leaves, or the plain reach when the key does not
        tell.
        """
        return self.reach if self.left is None else self.left


@dataclass(frozen=True)
class Scores:
    """All rows and the totals (None where no case of that class exists)."""

    rows: list[Row]
    totals: dict[str, float | int | None] = field(default_factory=dict)
    shares: dict[str, tuple[int, int]] = field(default_factory=dict)

    def text(self) -> str:
        """Table and totals as plain text."""
        head = (
            "case",
            "truth",
            "verdict",
            "named",
            "p(truth)",
            "outcome",
            "gap",
            "reach",
            "seconds",
        )
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
        lines = [
            "  ".join(cell.ljust(w) for cell, w in zip(line, width, strict=True)).rstrip()
            for line in [head, *body]
        ]
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

    For each answer ``m = 1 - n(N+1)/(f(n+1)) - n'(N'+1)/(f(n'+1))`` with n the missed effects, N
    the components that the answer calls healthy, n' the effects named wrongly, N' the effects
    named, f the number of components.
    """
    marks = []
    for answer in answers:
        missed, extra = len(truth - answer), len(answer - truth)
        sick = len(answer)
        well = components - sick
        marks.append(
            1.0
            - missed * (well + 1) / (components * (missed + 1))
            - extra * (sick + 1) / (components * (extra + 1))
        )
    return mean(marks)


def _result(folder: Path, case: str) -> dict[str, Any] | None:
    for path in (folder / case / "out.json", folder / f"{case}.json"):
        if path.is_file():
            data = json.loads(path.read_text(encoding="utf-8"))
            if not isinstance(data, dict) or data.get("schema") not in RESULTS:
                raise ValueError(f"{path}: schema must be one of {', '.join(RESULTS)}")
            if data.get("verdict") not in VERDICTS:
                raise ValueError(
                    f"{path}: verdict {data.get('verdict')!r} is not one of {', '.join(VERDICTS)}"
                )
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
    """What a hypothesis claims, empty where it is healthy; names of parameters count only on
    demand.
    """
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
    """Probability that all these names are among what is missing, each by the block that knows most
    of it.
    """

    def within(told: dict[str, Any], name: str) -> float:
        chances = _numbers(told.get("probabilities", {})).items()
        return min(1.0, sum(p for k, p in chances if name in _parts(k, True)))

    blocks = result.get("blocks") or [result]
    return math.prod(max((within(b, name) for b in blocks), default=0.0) for name in names)


def _block_of(effect: str) -> str:
    """Block of the rig in which an effect acts."""
    return _ACTS.get(effect) or _ACTS.get(TYPES[effect].block if effect in TYPES else "", "")


def _claim(truth: set[str], probabilities: dict[str, float]) -> tuple[float, bool] | None:
    """Largest stated probability and whether it is on the truth; "none" and "parameters" count as
    one.

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

    What named nothing closed nothing: 0, unless its table of errors shows that there was no gap,
    which gives None.
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
    """Largest error after the diagnosis on held-out recordings, in units of the noise of its
    channel.
    """
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


def _said(
    result: dict[str, Any], named: Sequence[str], wrong: Sequence[str], unexplained: Sequence[str]
) -> str:
    """Verdict, names, wrong parameters, what stays unexplained and the sets that cannot be told
    apart, in one line.
    """
    verdict = str(result["verdict"])
    text = f"effects {', '.join(named)}" if verdict == "effects" else verdict
    if wrong:
        text += f"; wrong {', '.join(wrong)}"
    if unexplained:
        text += f"; unexplained in {', '.join(dict.fromkeys(unexplained))}"
    sets = [" + ".join(map(str, group)) for group in result.get("ambiguity", [])]
    return text + (f"; not told apart: {' or '.join(sets)}" if len(sets) > 1 else "")


@dataclass(frozen=True)
class _Truth:
    """What a key conceals, and what of it a diagnosis can name.

    `known` are the names that count as such: the catalogue, and what this diagnosis gave a
    probability. `listed` are the effects that can be named, `parts` what is to be claimed: effects,
    "unlisted", parameters that are `far` off.
    """

    case: str
    kind: str
    ids: list[str]
    known: set[str]
    listed: tuple[str, ...]
    far: dict[str, Any]
    parts: set[str]

    @property
    def mixed(self) -> bool:
        """Whether an effect that can be named stands beside one that cannot."""
        return 0 < len(self.listed) < len(self.ids)


def _truth(
    key: dict[str, Any], probabilities: dict[str, float], catalogue: Sequence[str]
) -> _Truth:
    ids = [str(i) for i in key["effects"]]
    known = {*catalogue, *(i for i in ids if i in probabilities)}
    far: dict[str, Any] = key.get("wrong_parameters", {})
    parts = {i if i in known else "unlisted" for i in ids} | set(far)
    listed = tuple(i for i in ids if i in known)
    return _Truth(str(key["case"]), str(key["kind"]), ids, known, listed, far, parts)


@dataclass(frozen=True)
class _Told:
    """What a result claims: its verdict, the effects best first, those of them that are judged, the
    parameters that it calls wrong, the blocks that keep a mismatch, and the sets that it cannot
    tell apart.
    """

    verdict: str
    named: list[str]
    top: list[str]
    wrong: tuple[str, ...]
    unexplained: tuple[str, ...]
    sets: list[set[str]]

    @property
    def plain(self) -> str:
        """Verdict, or the wrong parameters where it names them."""
        return "+".join(self.wrong) if self.verdict == "parameters" and self.wrong else self.verdict


def _told(result: dict[str, Any], truth: _Truth) -> _Told:
    verdict = str(result["verdict"])
    # effects, best first: a single name is judged, a pair must be named whole
    named = [str(e["id"]) for e in result.get("effects", [])]
    judged = max(1, len(truth.listed) if truth.mixed else len(truth.parts))
    # what a name leaves is no claim of its own
    left = [
        e for e in result.get("unexplained") or [] if e.get("verdict", "unlisted") == "unlisted"
    ]
    groups = result.get("ambiguity", [])
    return _Told(
        verdict,
        named,
        named[:judged] if verdict == "effects" else [],
        tuple(str(e["name"]) for e in result.get("wrong_parameters") or []),
        tuple(str(e["block"]) for e in left),
        [{part for i in group for part in str(i).split("+")} for group in groups],
    )


def _outcome(truth: _Truth, told: _Told) -> tuple[str, bool]:
    """Right, ambiguous or wrong, and whether the answer or a set holds the truth."""
    verdict, parts, sets = told.verdict, truth.parts, told.sets
    near = False
    if truth.far:
        right = verdict == "parameters" and set(told.wrong) == parts
        contains = right or parts in sets
        near = verdict in HEALTHY
    elif truth.mixed:
        listed = set(truth.listed)
        right = verdict == "effects" and set(told.top) == listed
        contains = right or any(s - {"unlisted"} == listed for s in sets)
    elif not truth.ids:
        right = verdict == truth.kind
        # "parameters" and "none" both say that no physics is missing
        contains = verdict in HEALTHY or any(s <= set(HEALTHY) for s in sets)
    else:
        claim = told.top if verdict == "effects" else told.named
        right = _answer(verdict, claim) == parts
        contains = right or parts in sets
    return "right" if right else "ambiguous" if near or contains else "wrong", contains


def _chance(truth: _Truth, result: dict[str, Any], probabilities: dict[str, float]) -> float | None:
    """Stated probability of the truth; None where it is not stated."""
    if truth.mixed:
        return _among(result, truth.listed)
    pooled = _pooled(probabilities, bool(truth.far))
    if not truth.ids:
        # "none" and "parameters" say that no physics is missing, and which of them is a matter of
        # degree
        return pooled.get(frozenset(truth.parts), 0.0)
    if len(truth.parts) == 1:
        return pooled.get(frozenset(truth.parts))
    ids = truth.ids
    joint = [probabilities.get(sep.join(order)) for sep in ("+", ",") for order in (ids, ids[::-1])]
    each = min((probabilities.get(i, 0.0) for i in truth.parts), default=0.0)
    return next((p for p in joint if p is not None), each)


def _utility(truth: _Truth, told: _Told) -> float:
    """Utility of the sets that a result cannot tell apart, or of its answer."""
    far = bool(truth.far)
    answer = _answer(told.verdict, told.named)
    # wrong parameters are healthy, unless the truth is one
    groups = told.sets if told.sets else [answer | (set(told.wrong) if far else set())]
    whole = bool(truth.ids) and len(truth.listed) == len(truth.ids)
    rest = {"unlisted"} if told.unexplained and not whole else set[str]()
    groups = [s - set(HEALTHY) | rest for s in groups]
    groups = groups if far else [s - _parameters(s) for s in groups]
    names = {*truth.known, "unlisted", *told.named, *truth.parts, *(told.wrong if far else ())}
    return utility(truth.parts, groups, len(names))


def _of_key(key: dict[str, Any], truth: _Truth) -> dict[str, Any]:
    """What the row of a case has from its key, with or without a result."""
    labels = list(key.get("wanted", {}).values())
    return {
        "reach": float(key.get("reach", 0.0)),
        "ids": tuple(truth.ids),
        "wanted": "pair" if len(truth.ids) > 1 else str(labels[0]) if labels else "",
        "left": _number(key.get("reach_left")),
        "labels": tuple(map(str, labels)),
        "listed": truth.listed,
        "wrong": tuple((str(k), float(e["tolerances"])) for k, e in truth.far.items()),
        "seed": int(key.get("seed", 0)),
    }


def _missing(key: dict[str, Any], truth: _Truth) -> Row:
    """The row of a case without a result."""
    return Row(
        case=truth.case,
        truth=truth.kind,
        verdict="missing",
        named="-",
        probability=None,
        outcome="wrong",
        gap=0.0 if truth.ids else None,
        utility=None,
        contains=False,
        seconds=None,
        rest_said=False if truth.mixed else None,
        **_of_key(key, truth),
    )


def score_case(key: dict[str, Any], result: dict[str, Any] | None, catalogue: Sequence[str]) -> Row:
    """Score one case; a missing result is wrong.

    An effect that is not in the catalogue has the truth "unlisted", unless the diagnosis gives that
    very id a probability. Of a listed effect beside such a one, the listed one must be named first;
    what is said of the rest is scored apart.
    """
    probabilities = _numbers((result or {}).get("probabilities", {}))
    truth = _truth(key, probabilities, catalogue)
    if result is None:
        return _missing(key, truth)
    told = _told(result, truth)
    outcome, contains = _outcome(truth, told)
    chance = _chance(truth, result, probabilities)
    effects = told.verdict == "effects"
    claimed = told.verdict in ("effects", "unlisted") or bool(told.unexplained)
    rest_said = None
    if truth.mixed:
        hidden = [_block_of(i) for i in truth.ids if i not in truth.known]
        rest_said = any(b.startswith(block) for b in told.unexplained for block in hidden)
    return Row(
        case=truth.case,
        truth=truth.kind,
        verdict=told.verdict,
        named="+".join(told.top) if effects else told.plain,
        probability=chance if chance is not None else 0.0,
        outcome=outcome,
        gap=gap_of(result),
        utility=_utility(truth, told),
        contains=contains,
        seconds=_number(result.get("seconds")),
        **_of_key(key, truth),
        first=(told.named[0] if told.named else "effects") if effects else told.plain,
        claim=_claim(truth.parts, probabilities),
        name_probability=_among(result, truth.listed) if truth.listed else None,
        rest_said=rest_said,
        unexplained=told.unexplained,
        wrong_named=told.wrong,
        interval_holds=_holds(truth.far, list(result.get("wrong_parameters") or [])),
        false_name=not truth.ids and (claimed or bool(told.wrong and not truth.far)),
        held_out=_held_out(result),
        said=_said(result, told.named, told.wrong, told.unexplained),
    )


def _count(rows: Iterable[bool]) -> tuple[int, int]:
    kept = list(rows)
    return sum(kept), len(kept)


def _median(values: Sequence[float | None]) -> float | None:
    kept = [v for v in values if v is not None]
    return median(kept) if kept else None


def score(
    keys: Path, results: Path, catalogue: Sequence[str] = LISTED, first: int | None = None
) -> Scores:
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
        "detected (moves a channel by 3x noise)": _count(
            r.detected for r in sick if r.reach >= 3.0
        ),
        "detected (3x noise left after a refit)": _count(
            r.detected for r in sick if r.visible >= 3.0
        ),
        "right name first (catalogue effects)": _count(r.outcome == "right" for r in listed),
        "right name first (3x noise left)": _count(r.outcome == "right" for r in seen),
        "name or ambiguity set holds the truth": _count(r.contains for r in listed),
        "name or set holds the truth (3x noise left)": _count(r.contains for r in seen),
        "unlisted recognised": _count(r.outcome == "right" for r in unlisted),
    }
    if mixed:
        shares["right name first (beside an effect of no catalogue)"] = _count(
            r.outcome == "right" for r in mixed
        )
        shares["unexplained rest is said"] = _count(
            r.rest_said for r in mixed if r.rest_said is not None
        )
    if far:
        shares["wrong parameter named"] = _count(r.outcome == "right" for r in far)
        shares["wrong parameter named or in an ambiguity set"] = _count(r.contains for r in far)
        shares["stated interval holds the wrong parameter"] = _count(
            r.interval_holds for r in far if r.interval_holds is not None
        )
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
