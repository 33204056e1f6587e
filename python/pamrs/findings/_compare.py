"""Two results side by side, and what changed from one to the other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pamrs.findings._entries import NOT_JUDGED, VERDICTS
from pamrs.findings._entry import to_plain
from pamrs.units import with_unit

_Value = TypeVar("_Value")

CLEARLY = 2.0
"""[standard deviations] Difference of two values from which one is said to have changed."""
LIKELY = 0.1
"""Difference of two probabilities from which that is said."""
LEAST = 0.005
"""Probability below which in both results a candidate is left out."""
FARTHER = 1.1
"""Ratio of two errors from which that is said."""


@dataclass(frozen=True)
class Compared:
    """Two results side by side: of everything what the first and what the second has, None where it
    has nothing of it.

    Attributes
    ----------
    names : (str, str)
        Of the results.
    verdict, block : (str or None, str or None)
        The verdicts, and the blocks with the mismatch.
    candidates : dict of str to pair of float
        Probability of each hypothesis about that block, and of names in other blocks.
    parameters : dict of str to pair of dict
        ``value``, ``std``, ``unit`` and ``identifiable`` of parameters of effects and of the rig,
        SI.
    missed : dict of str to pair of float
        Root mean square error of each channel with what was found, in noise levels, on held-out
        recordings (fitted ones where there are none).
    free_run : dict of str to pair of float
        The same of the whole rig from its commands alone, by ``recording: channel``, SI.
    changed : list of str
        What changed, in words; empty where nothing that counts did.
    """

    names: tuple[str, str]
    verdict: tuple[str | None, str | None]
    block: tuple[str | None, str | None]
    candidates: dict[str, tuple[float | None, float | None]]
    parameters: dict[str, tuple[dict[str, Any] | None, dict[str, Any] | None]]
    missed: dict[str, tuple[float | None, float | None]]
    free_run: dict[str, tuple[float | None, float | None]]
    changed: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON has it."""
        return {key: to_plain(value) for key, value in vars(self).items()}


def compare_results(
    names: tuple[str, str], first: Mapping[str, Any], second: Mapping[str, Any]
) -> Compared:
    """Set two results side by side.

    Parameters
    ----------
    names : (str, str)
        What they are called.
    first, second : mapping
        Contents of their JSON files.
    """

    def each(of: Callable[[Mapping[str, Any]], dict[str, _Value]]) -> dict[str, Any]:
        one, other = of(first), of(second)
        return {name: (one.get(name), other.get(name)) for name in one | other}

    ranked = sorted(each(_candidates).items(), key=lambda item: -max(v or 0.0 for v in item[1]))
    compared = Compared(
        names=names,
        verdict=(first["verdict"], second["verdict"]),
        block=(first["where"]["block"], second["where"]["block"]),
        candidates={n: pair for n, pair in ranked if max(v or 0.0 for v in pair) >= LEAST},
        parameters=each(_parameters),
        missed=each(_missed),
        free_run=each(_free_run),
    )
    compared.changed.extend(_changed(compared, first, second))
    return compared


def _candidates(result: Mapping[str, Any]) -> dict[str, float]:
    """Probabilities of the group of blocks with the mismatch (those of the case where none has),
    and those of names in other groups.
    """
    located = result["where"]["block"]
    judged = [b for b in result["blocks"] if b["verdict"] != NOT_JUDGED]
    located_chances = [b["probabilities"] for b in judged if located in b["blocks"]]
    chances = dict(located_chances[0] if located_chances else result["probabilities"])
    for block in judged:
        for name, p in block["probabilities"].items():
            if name not in VERDICTS and p > chances.get(name, 0.0):
                chances[name] = p
    return chances


def _parameters(result: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Parameters of what is named, then of the rig."""
    named = result["effects"] if result["verdict"] == "effects" else []
    named_parameters = {
        f"{_term(effect)}.{name}": parameter
        for effect in named
        for name, parameter in effect["parameters"].items()
    }
    named_parameters |= {parameter["name"]: parameter for parameter in result["wrong_parameters"]}
    every = result["parameters"] | named_parameters
    keys = ("value", "std", "unit", "identifiable")
    return {n: {k: every[n].get(k) for k in keys} for n in [*named_parameters, *every]}


def _missed(result: Mapping[str, Any]) -> dict[str, float]:
    errors = result["fit"]["held_out"] or result["fit"]["channels"]
    return {n: e["after"] / e["noise"] for n, e in errors.items() if e["after"] and e["noise"]}


def _free_run(result: Mapping[str, Any]) -> dict[str, float]:
    return {
        f"{run['recording']}: {channel}": error["after"]
        for run in result["free_run"] or []
        for channel, error in run["channels"].items()
        if error["after"] is not None
    }


def _changed(compared: Compared, first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Sentences on what changed from one result to the other."""
    sentences = []
    for what, (one, other) in (("verdict", compared.verdict), ("block", compared.block)):
        if one != other:
            sentences.append(f"{what}: {one or 'none'} before, now {other or 'none'}")
    before, now = _named(first), _named(second)
    sentences += [f"{name} is named now" for name in sorted(now - before)]
    held = {name.partition(".")[0] for name in second["parameters"]}
    for name in sorted(before - now):
        sentences.append(
            f"{name} is {'held by the model' if name in held else 'not named any more'}"
        )
    for name, (p, q) in compared.candidates.items():
        if abs((p or 0.0) - (q or 0.0)) >= LIKELY:
            sentences.append(f"probability of {name}: {p or 0.0:.2f} before, now {q or 0.0:.2f}")
    for name, (old, new) in compared.parameters.items():
        if old and new and (apart := _apart(old, new)) >= CLEARLY:
            latest = with_unit(f"{new['value']:.4g}", new["unit"] or "")
            values = f"{old['value']:.4g} before, now {latest}"
            sentences.append(f"{name}: {values} ({apart:.1f} standard deviations)")
    for table, what in ((compared.missed, "missed of"), (compared.free_run, "free run of")):
        for name, (size, new_size) in table.items():
            if size and new_size and not 1.0 / FARTHER < new_size / size < FARTHER:
                sentences.append(f"{what} {name}: {new_size / size:.2g} times what it was")
    for key in ("inputs", "settings", "version"):
        one, other = first.get(key), second.get(key)
        if one != other and one is not None and other is not None:
            sentences.append(
                f"version {one} and {other}"
                if key == "version"
                else f"{key} differ: "
                + ", ".join(sorted(n for n in {*one, *other} if one.get(n) != other.get(n)))
            )
    return sentences


def _term(effect: Mapping[str, Any]) -> str:
    """Name of an effect in hypotheses: its id, with the block at which it acts."""
    return f"{effect['id']}@{effect['at']}" if effect.get("at") else str(effect["id"])


def _named(result: Mapping[str, Any]) -> set[str]:
    """Effects and parameters that a result names."""
    effects = {_term(e) for e in result["effects"] if result["verdict"] == "effects"}
    return effects | {w["name"] for w in result["wrong_parameters"]}


def _apart(old: Mapping[str, Any], new: Mapping[str, Any]) -> float:
    """Distance of two values in their joint standard deviation; 0 where it is not known, or one of
    them is not determined.
    """
    if False in (old["identifiable"], new["identifiable"]):
        return 0.0
    std = math.hypot(old["std"] or 0.0, new["std"] or 0.0)
    known = std > 0.0 and old["value"] is not None and new["value"] is not None
    return abs(new["value"] - old["value"]) / std if known else 0.0
