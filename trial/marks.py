"""Open the keys and mark what a diagnosis said about each case."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .cases import SCHEMA
from .design import SECOND, STRENGTHS
from .families import KNOWN, OTHER, UNLISTED
from .pair.places import BOTH, SIDES

RESULTS = ("pamrs.diagnosis/1", "pamrs.diagnosis/2")
HEALTHY = ("none", "parameters")
#: sum over the channels of what a refit leaves above the noise, in units of it, below which there
#: is no gap to close
LEAST_ROOM = 0.05
#: noises that must be left for the targets to ask for a name: 3, less what the search for a size
#: leaves open
SEEN = 2.5
CHANNEL = {"supply": "supply_pressure", "chamber": "muscle_pressure", "arm": "joint_angle"}
BLOCKS = tuple(CHANNEL)
#: points within which the share of a term is right
POINTS = 0.15


@dataclass(frozen=True)
class BlockMark:
    """One group of blocks of a case: where it is (supply, chamber, arm), whether its leading name
    is right (None without an effect of a family there), whether it names what is not there, and the
    blocks of it where such effects act.
    """

    block: str
    leading: bool | None
    false_name: bool
    acts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mark:
    """One case: its strata and what was right of it; None where the question does not arise.

    `tags` has one or several values of each stratum. `seen`: enough is left for the targets to ask;
    `above`: the effects leave no less than the model error of their blocks. `leading`: the first
    name is one of the effects. `holds`: each thing that is wrong is named or stands in a set.
    `wrong`: the parameters that are far off are named. `false_name`, of cases without an effect: an
    effect or a right parameter is named, or, without model error, unlisted physics. `calm`, of
    healthy cases whose model error is stated: `none` or `parameters`. `inside` and `shares`:
    whether intervals hold the truth, and shares of terms are right. `claims`: leading probability
    of each group of blocks, and whether its hypothesis is true. `placed`, of right names of effects
    that act at a side of a pair: the place is right. `located`, where anything is wrong: the block
    that is said first is one in which it is.
    """

    case: str
    truth: str
    said: str
    tags: dict[str, tuple[str, ...]]
    seen: bool
    above: bool
    verdict: str
    leading: bool | None = None
    holds: bool | None = None
    wrong: bool | None = None
    false_name: bool | None = None
    calm: bool | None = None
    unlisted: bool | None = None
    inside: tuple[bool, ...] = ()
    shares: tuple[bool, ...] = ()
    gap: float | None = None
    seconds: float | None = None
    claims: tuple[tuple[float, bool], ...] = ()
    blocks: tuple[BlockMark, ...] = ()
    placed: bool | None = None
    located: bool | None = None

    def to_dict(self) -> dict[str, Any]:
        """For the JSON of a score; without places where these are no question."""
        places = ("placed", "located")
        told = {k: v for k, v in self.__dict__.items() if k not in places or v is not None}
        told["blocks"] = [b.__dict__ for b in self.blocks]
        return told


@dataclass(frozen=True)
class Truth:
    """What a key conceals: ids of families by block, parameters far off, unlisted by block; places
    by id. A block of a side of a pair has its name, as `chamber.flexor`.
    """

    listed: tuple[tuple[str, str], ...]
    unlisted: tuple[str, ...]
    wrong: dict[str, Any]
    wrong_block: dict[str, str]
    error: dict[str, float]
    at: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> set[str]:
        return {name for name, _ in self.listed}


@dataclass(frozen=True)
class _Told:
    """What a result says: names best first, parameters called wrong, sets, groups of blocks."""

    verdict: str
    named: list[str]
    wrong: set[str]
    sets: list[set[str]]
    groups: list[dict[str, Any]]
    rest: set[str]
    effects: list[dict[str, Any]] = field(default_factory=list)
    parameters: list[dict[str, Any]] = field(default_factory=list)


def covered(names: Iterable[str]) -> set[str]:
    """Blocks of a rig that some of its own are, as :func:`place`, and with the sides of a pair: one
    without a name stands for both.
    """
    found = set()
    for name in names:
        block, side = next(iter(place([name]))), name.partition(".")[2]
        found |= {block, *(f"{block}.{s}" for s in SIDES if side in ("", s))}
    return found


def _where(block: str, at: str) -> tuple[str, ...]:
    """A block of the rig, or that of each side at which an effect acts in it."""
    if block != "chamber" or not at:
        return (block,)
    return tuple(f"{block}.{side}" for side in (SIDES if at == BOTH else (at,)))


def family(name: str) -> str:
    """A name without its place: of ``leak_muscle@flexor`` the first part."""
    return name.partition("@")[0]


def place(names: Iterable[str]) -> set[str]:
    """Where blocks of a rig are: supply, chamber (with valve and line) or arm (with all others)."""
    found = set()
    for name in names:
        head = name.split(".")[0]
        gas = head in ("chamber", "valve", "line")
        found.add("supply" if head == "supply" else "chamber" if gas else "arm")
    return found


def _number(value: Any) -> float | None:
    good = isinstance(value, int | float) and not isinstance(value, bool) and value == value
    return float(value) if good else None


#: physics of no catalogue in the plans, and the name that the catalogue has had for it since
NAMED_SINCE = {
    "tendon_compliance": "tendon_give",
    "exhaust_back_pressure": "exhaust_back_pressure",
}


def opened(key: dict[str, Any]) -> Truth:
    """What a key conceals."""
    effects = [
        {**e, "id": NAMED_SINCE[e["id"]], "mark": OTHER} if e["id"] in NAMED_SINCE else e
        for e in key["effects"]
    ]
    listed = tuple(
        (str(e["id"]), block)
        for e in effects
        if e["mark"] != UNLISTED
        for block in _where(str(e["block"]), e.get("at", ""))
    )
    error = {
        t["block"]: max(t["left"].values(), default=0.0)
        for t in key["terms"]
        if t["kind"] == "model_error"
    }
    return Truth(
        listed,
        tuple(
            block
            for e in effects
            if e["mark"] == UNLISTED
            for block in _where(str(e["block"]), e.get("at", ""))
        ),
        dict(key["wrong_parameters"]),
        {
            t["id"]: _where(t["block"], t.get("at", ""))[0]
            for t in key["terms"]
            if t["kind"] == "parameter"
        },
        error,
        {str(e["id"]): str(e["at"]) for e in key["effects"] if e.get("at")},
    )


def _sets(entries: Iterable[Any]) -> list[set[str]]:
    return [{family(part) for i in group for part in str(i).split("+")} for group in entries]


def _told(result: dict[str, Any]) -> _Told:
    groups = [g for g in result.get("blocks") or [] if g.get("verdict") != "not_judged"]
    verdict = str(result["verdict"])
    effects = list(result.get("effects") or [])
    named = [family(str(e["id"])) for e in effects] if verdict == "effects" else []
    for group in groups:
        if group.get("verdict") == "effects":
            own = (family(str(i)) for i in group.get("effects", []))
            named += [i for i in own if i not in named]
    told = list(result.get("wrong_parameters") or [])
    wrong = {str(e["name"]) for e in told}
    sets = _sets(result.get("ambiguity") or [])
    for group in groups:
        wrong |= {str(n) for n in group.get("wrong_parameters", [])}
        sets += _sets(group.get("ambiguity") or [])
    rest = {
        str(e["block"])
        for e in result.get("unexplained") or []
        if e.get("verdict", "unlisted") == "unlisted"
    }
    return _Told(verdict, named, wrong, sets, groups, rest, effects, told)


def _parts(name: str) -> set[str]:
    return {family(part) for part in name.replace(",", "+").split("+")} - set(HEALTHY)


def _claim(
    probabilities: dict[str, Any], truth: Truth, where: set[str]
) -> tuple[float, bool] | None:
    """Largest stated probability of a group of blocks and whether it is on the truth there."""
    pooled: dict[frozenset[str], float] = {}
    for name, p in probabilities.items():
        if (value := _number(p)) is not None:
            group = frozenset(_parts(str(name)))
            pooled[group] = pooled.get(group, 0.0) + value
    if not pooled:
        return None
    best = max(pooled, key=lambda g: pooled[g])
    names = {n for n, block in truth.listed if block in where}
    names |= {n for n, block in truth.wrong_block.items() if block in where}
    odd = bool(set(truth.unlisted) & where) or any(b in where for b in truth.error)
    right = best <= (names | ({"unlisted"} if odd else set()))
    # nothing is a true claim where nothing is wrong but a model error that a refit takes up
    right = right and (bool(best) or not (names or set(truth.unlisted) & where))
    return min(pooled[best], 1.0), right


def _inside(key: dict[str, Any], told: _Told) -> tuple[bool, ...]:
    """Whether stated intervals hold true values: parameters of effects, and those far off."""
    found = []

    def hold(entry: dict[str, Any], true: float) -> None:
        ends = entry.get("interval") or (None, None)
        low, high = _number(ends[0]), _number(ends[1])
        value, std = _number(entry.get("value")), _number(entry.get("std"))
        if low is None and value is not None and std is not None:
            low, high = value - 1.96 * std, value + 1.96 * std
        if low is not None and high is not None:
            found.append(low <= true <= high)

    for effect in key["effects"]:
        for entry in told.effects:
            if entry.get("id") == effect["id"] and told.verdict == "effects":
                for name, true in effect["catalogue_parameters"].items():
                    fitted = (entry.get("parameters") or {}).get(name)
                    if fitted:
                        hold(fitted, float(true))
    for entry in told.parameters:
        if entry["name"] in key["wrong_parameters"]:
            hold(entry, float(key["wrong_parameters"][entry["name"]]["value"]))
    return tuple(found)


def _shares(key: dict[str, Any], result: dict[str, Any]) -> tuple[bool, ...]:
    """Whether the budget gives each true term its share within 15 points; nothing without one.

    True shares are of what is left beside parameters inside their tolerances, and so are those
    that are compared with them.
    """
    budget = result.get("budget")
    if not budget:
        return ()
    found = []

    def told(name: str, block: str) -> float:
        """Share of a name in a block, the part that parameters inside their tolerances take away
        left out.
        """
        own = [b for b in budget if block in covered([str(b.get("block", ""))])]
        kept = sum(_number(b.get("share")) or 0.0 for b in own if b.get("kind") == "parameters")
        there = sum(_number(b.get("share")) or 0.0 for b in own if b.get("id") == name)
        return there / (1.0 - kept) if kept < 1.0 else 0.0

    for term in key["terms"]:
        if term["kind"] == "model_error" or term.get("share") is None:
            continue
        where = _where(term["block"], term.get("at", ""))
        share = sum(told(term["id"], block) for block in where) / len(where)
        found.append(abs(share - float(term["share"])) <= POINTS)
    return tuple(found)


def _blocks(truth: Truth, told: _Told) -> tuple[BlockMark, ...]:
    """Marks of the groups of blocks that a result judges by themselves."""
    found = []
    for group in told.groups:
        where = covered(group.get("blocks") or [])
        there = {n for n, block in truth.listed if block in where}
        named = group.get("effects", []) if group.get("verdict") == "effects" else []
        named = [family(str(name)) for name in named]
        extra = set(named) - there
        acts = {block.split(".")[0] for _, block in truth.listed if block in where}
        found.append(
            BlockMark(
                "+".join(sorted(place(group.get("blocks") or []))),
                bool(named) and named[0] in there if there else None,
                bool(extra) and not there and not set(truth.unlisted) & where,
                tuple(sorted(acts)),
            )
        )
    return tuple(found)


def _nearest(reached: float) -> str:
    """The strength of the plan that is nearest to what an effect reached, in ratio."""
    return f"{min(STRENGTHS, key=lambda s: abs(math.log(max(reached, 1e-9) / s))):g}"


def _stratum(size: float, edges: Sequence[float]) -> str:
    """Between which edges a size is: ``1.5 to 3``."""
    between = [f"{low:g} to {high:g}" for low, high in itertools.pairwise(edges)]
    words = (f"below {edges[0]:g}", *between, f"above {edges[-1]:g}")
    return words[sum(size >= edge for edge in edges)]


def _own(key: dict[str, Any]) -> tuple[str, ...]:
    """How much the weakest effect leaves in the channel of its own block [noises]."""
    sizes = [
        max(
            (v for c, v in t["left"].items() if c.split(".")[0] == CHANNEL[t["block"]]), default=0.0
        )
        for t in key["terms"]
        if t["kind"] == "effect"
    ]
    if not sizes:
        return ()
    return (_stratum(min(sizes), (1.5, 3.0, 10.0, 100.0)),)


def distance_of(key: dict[str, Any], result: dict[str, Any] | None) -> float | None:
    """How far the clearest effect of a case is from its nearest rival, by the limits of the result
    [standard deviations]: in proportion to what it leaves; None without limits.
    """
    limits = {family(str(own["effect"])): own for own in (result or {}).get("limits") or []}
    found = [
        float(own["distance"]) * float(effect["reached"]) / float(own["left"])
        for effect in key["effects"]
        if (own := limits.get(str(effect["id"]))) and own["left"]
    ]
    return max(found, default=None)


def _tags(key: dict[str, Any], result: dict[str, Any] | None) -> dict[str, tuple[str, ...]]:
    """The strata of a case."""
    spec, effects = key["spec"], key["effects"]
    distance = distance_of(key, result)
    lab, percent = spec["lab"], int(spec["percent"])
    marks = {e["mark"] for e in effects}
    kind = "effect" if effects else "healthy"
    if key["wrong_parameters"]:
        kind = "wrong parameter and effect" if effects else "wrong parameter"
    blocks = {e["block"] for e in effects}
    places = tuple(sorted({str(e["at"]) for e in effects if e.get("at")}))
    return {
        "truth": (kind,),
        "strength": (_nearest(max(e["reached"] for e in effects)),) if effects else (),
        "effects": (str(len(effects)),) if effects else (),
        "own channel": _own(key),
        "distance": () if distance is None else (_stratum(distance, (1.0, 2.0, 4.0, 8.0, 16.0)),),
        "placing": (("one block" if len(blocks) == 1 else "several blocks"),)
        if len(effects) > 1
        else (),
        "model error": (f"{percent} %",),
        "form": tuple(m for m in (KNOWN, OTHER, UNLISTED) if m in marks),
        "first catalogue": tuple(
            sorted({"yes" if e["first_catalogue"] else "no" for e in effects if e["mark"] == KNOWN})
        ),
        "block": tuple(b for b in BLOCKS if b in blocks),
        **({"place": places} if places else {}),
        "rig": (str(spec["rig"]),),
        "rate": (f"{lab['rate']} Hz",),
        "bits": (f"{lab['bits']} bit",),
        "log": (
            "one free log" if lab["one"] else "several recordings",
            *(["dropouts"] if lab["dropouts"] else []),
            *([f"no {lab['missing'].replace('_pressure', ' gauge')}"] if lab["missing"] else []),
        ),
    }


def _seen(key: dict[str, Any], truth: Truth) -> tuple[bool, bool]:
    """Whether enough of every effect and wrong parameter is left, and no less than model error."""
    terms = [t for t in key["terms"] if t["kind"] != "model_error"]
    sizes = [max(t["left"].values(), default=0.0) for t in terms]
    above = all(
        size >= truth.error.get(t["block"], 0.0) for t, size in zip(terms, sizes, strict=True)
    )
    return all(s >= SEEN for s in sizes), above


def _words(key: dict[str, Any]) -> str:
    """The truth in one line."""
    parts = [
        f"{e['id']}/{e['form']}{' at ' + e['at'] if e.get('at') else ''} {e['reached']:.3g}"
        for e in key["effects"]
    ]
    parts += [f"{n} {e['tolerances']:+.1f} tol" for n, e in key["wrong_parameters"].items()]
    if percent := int(key["spec"]["percent"]):
        parts.append(f"model error {percent} %")
    return " + ".join(parts) or "none"


def _with_places(told: _Told) -> list[str]:
    """The names, each with the place that stands beside it."""
    at = {family(str(e["id"])): str(e.get("at", "")) for e in told.effects}
    return [f"{name} at {at[name]}" if at.get(name) else name for name in told.named]


def _placed(truth: Truth, told: _Told) -> bool | None:
    """Whether the first name is at its place, where that name is right and has one: at both sides
    are an effect without a place and two of them.
    """
    first = told.named[0] if told.named else ""
    if first not in truth.names or first not in truth.at:
        return None
    said = {str(e.get("at", "")) for e in told.effects if family(str(e["id"])) == first}
    right = truth.at[first]
    return said in ({""}, set(SIDES)) if right == BOTH else said == {right}


def _located(truth: Truth, result: dict[str, Any]) -> bool:
    """Whether the block that is said first is one in which something is missing or wrong."""
    said = (result.get("where") or {}).get("block")
    wrong = {b for _, b in truth.listed} | {*truth.unlisted, *truth.wrong_block.values()}
    return bool(said) and bool(covered([str(said)]) & wrong)


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


def mark(key: dict[str, Any], result: dict[str, Any] | None) -> Mark:
    """Mark one case; a missing result is wrong wherever a question arises."""
    truth = opened(key)
    seen, above = _seen(key, truth)
    tags = _tags(key, result)
    blank = {"verdict": "none", "seconds": None}
    told = _told(result or blank)
    names, wrong = truth.names, set(truth.wrong)
    missing = result is None
    sets = set().union(*told.sets) if told.sets else set()
    answer = set(told.named) | told.wrong | sets
    healthy = not key["effects"] and not wrong
    odd = told.verdict == "unlisted" or any(g.get("verdict") == "unlisted" for g in told.groups)
    claims: list[tuple[float, bool]] = []
    for group in told.groups or [{**(result or {}), "blocks": list(BLOCKS)}]:
        where = covered(group.get("blocks") or BLOCKS)
        claim = _claim(group.get("probabilities") or {}, truth, where)
        claims += [claim] if claim else []
    holds: bool | None = None
    if not healthy:
        odd_holds = not truth.unlisted or odd or "unlisted" in sets
        holds = not missing and odd_holds and (names | wrong) <= answer
    false = None
    if not key["effects"] and not missing:
        claimed = bool(told.named) or bool(told.wrong - wrong)
        plain = not int(key["spec"]["percent"]) and (odd or bool(told.rest))
        false = claimed or plain
    said = ", ".join(_with_places(told)) or told.verdict
    said += f"; wrong {', '.join(sorted(told.wrong))}" if told.wrong else ""
    said += f"; rest in {', '.join(sorted(told.rest))}" if told.rest else ""
    return Mark(
        case=str(key["case"]),
        truth=_words(key),
        said="no result" if missing else said,
        tags=tags,
        seen=seen,
        above=above,
        verdict="missing" if missing else told.verdict,
        leading=(bool(told.named) and told.named[0] in names) if names else None,
        holds=holds,
        wrong=wrong <= told.wrong if wrong else None,
        false_name=false,
        calm=(not missing and told.verdict in HEALTHY)
        if healthy and key["spec"]["stated"]
        else None,
        unlisted=(odd and not told.named) if truth.unlisted and not names else None,
        inside=_inside(key, told),
        shares=_shares(key, result or {}),
        gap=(gap_of(result) if result else 0.0) if not healthy else None,
        seconds=_number((result or {}).get("seconds")),
        claims=tuple(claims),
        blocks=_blocks(truth, told),
        placed=_placed(truth, told) if not missing else None,
        located=None if healthy else _located(truth, result or {}),
    )


def keys_of(folder: Path, first: int | None = None) -> list[dict[str, Any]]:
    """The keys of a folder, or the first so many.

    Raises
    ------
    ValueError
        No key, or one of another schema.
    """
    files = sorted(Path(folder).glob("*.json"))[:first]
    if not files:
        raise ValueError(f"no key in {folder}")
    found = []
    for file in files:
        key: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if key.get("schema") != SCHEMA:
            raise ValueError(f"{file}: schema must be {SCHEMA!r}")
        found.append(key)
    return found


def marks(keys: Path, results: Path, first: int | None = None) -> list[Mark]:
    """Mark every case whose key is in a folder, or the first so many.

    Raises
    ------
    ValueError
        No key, a key of another plan, or a result of another schema.
    """
    return [mark(key, result_of(Path(results), str(key["case"]))) for key in keys_of(keys, first)]


def result_of(folder: Path, case: str) -> dict[str, Any] | None:
    """What was said of a case; None where there is no result.

    Raises
    ------
    ValueError
        A result of another schema.
    """
    for path in (folder / case / "out.json", folder / f"{case}.json"):
        if path.is_file():
            data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            if data.get("schema") not in RESULTS:
                raise ValueError(f"{path}: schema must be one of {', '.join(RESULTS)}")
            return data
    return None


def plan_of(keys: Path) -> str:
    """Name of the plan of strata whose keys are in a folder."""
    first = sorted(Path(keys).glob("*.json"))[0]
    return str(json.loads(first.read_text(encoding="utf-8")).get("plan", SECOND))
