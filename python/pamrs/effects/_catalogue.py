"""The catalogue: what the core says that each effect is, with the words of the file of its name."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final

from pamrs import _core
from pamrs.effects._info import ClosureTerm, EffectInfo, EffectParameter, Form, SameData, Words


def _words(effect: str) -> dict[str, Any]:
    """The words of an effect."""
    file = resources.files("pamrs.effects").joinpath("words", f"{effect}.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


#: Fields of a parameter that are the core's as they stand.
_AS_TOLD: Final = (
    "channel",
    "repeats",
    "tried",
    "same_everywhere",
    "time_constant",
    "own",
    "restricts",
    "like",
)


def _pair(value: list[float] | None) -> tuple[float, float] | None:
    return None if value is None else (float(value[0]), float(value[1]))


def _parameter(told: dict[str, Any], meanings: dict[str, str]) -> EffectParameter:
    return EffectParameter(
        name=told["name"],
        unit=told["unit"],
        default=told["default"],
        lower=told["lower"],
        upper=told["upper"],
        starts=tuple(told["starts"]),
        meaning=meanings[told["name"]],
        neutral=told["neutral"],
        expected=_pair(told["expected"]),
        prior=_pair(told["prior"]),
        role=told["role"] or "",
        role_sealed=told["role_sealed"] or "",
        scan=None if told["scan"] is None else tuple(told["scan"]),
        needed_in=tuple(told["needed_in"]),
        **{name: told[name] for name in _AS_TOLD},
    )


def _form(told: dict[str, Any], meanings: dict[str, str], equation: str) -> Form:
    return Form(
        name=told["name"],
        parameters=tuple(_parameter(parameter, meanings) for parameter in told["parameters"]),
        states=tuple(state["name"] for state in told["states"]),
        ports=tuple(told["ports"]),
        equation=equation,
    )


def _same_data(told: dict[str, Any], words: dict[str, Any]) -> SameData:
    held = tuple((name, value) for name, value in told["held"])
    return SameData(**{**told, "held": held, "told_by": words["told_by"]})


def _info(told: dict[str, Any]) -> EffectInfo:
    """One effect, as the core tells it, with its words."""
    words = _words(told["id"])
    terms = tuple(
        ClosureTerm(**{**term, "variables": tuple(term["variables"])})
        for term in words.get("terms", ())
    )
    meanings = {
        **{term.name: f"coefficient of {term.formula}" for term in terms},
        **words["parameters"],
    }
    usual, *others = told["forms"]
    equations = {usual["name"]: words["equation"]}
    equations |= {form["name"]: words["forms"][form["name"]] for form in others}
    kink = told["kink"]
    return EffectInfo(
        id=told["id"],
        name=words["name"],
        block=told["block"],
        at=told["at"],
        equation=words["equation"],
        fingerprint=words["fingerprint"],
        separates=words["separates"],
        forms=tuple(_form(form, meanings, equations[form["name"]]) for form in told["forms"]),
        reference=told["source"],
        rivals=tuple(words.get("rivals", ())),
        catalogue=told["named"],
        same_data=tuple(_same_data(same, words) for same in told["same_data"]),
        terms=terms,
        label=words.get("label", ""),
        stated_by=tuple(words.get("stated_by", ())),
        acts_in=tuple(told["acts_in"]),
        experiment=words.get("experiment", ""),
        excitation=tuple(
            (k, tuple(v) if isinstance(v, list) else v)
            for k, v in words.get("excitation", {}).items()
        ),
        last_only=told["last_only"],
        on_loads=told["on_loads"],
        supplies=tuple(told["supplies"]),
        frees_mass=told["frees_mass"],
        dry_friction=told["dry_friction"],
        kink=None
        if kink is None
        else (tuple(kink["where_not_zero"]), kink["why"], kink["of_supplies"]),
        at_rest=tuple(
            (act, *change) for told_change in told["at_rest"] for act, change in told_change.items()
        ),
    )


def _of_words(effect: str) -> Words:
    words = _words(effect)
    return Words(*(words[key] for key in ("what", "letter", "symbols", "odd_in")))


EFFECTS: Final[dict[str, EffectInfo]] = {
    told["id"]: _info(told) for told in json.loads(_core.effects())
}
"""Every effect by its id, in the order of the chain; sums of terms last."""
CATALOGUE: Final[dict[str, EffectInfo]] = {
    name: effect for name, effect in EFFECTS.items() if effect.catalogue
}
"""Those that a diagnosis may name."""
CLOSURE_TERMS: Final[dict[str, tuple[ClosureTerm, ...]]] = {
    name: effect.terms for name, effect in EFFECTS.items() if effect.terms
}
"""Terms of each sum, in the order of its parameters."""
CLOSURE_OF: Final[dict[str, str]] = {
    ("arm" if EFFECTS[name].at == "joint" else EFFECTS[name].at): name for name in CLOSURE_TERMS
}
"""Sum of terms of each block of the cut chain."""
WORDS: Final[dict[str, Words]] = {name: _of_words(name) for name in CLOSURE_TERMS}
"""How each sum of terms is put into words."""
MEMORY_OF: Final[dict[str, str]] = {"time": "memory_time", "distance": "memory_angle"}
"""Shape that a term of a kind with memory depends on."""


def ports_of(entry: Mapping[str, Any]) -> tuple[str, ...]:
    """The ports at which an effect of a rig acts, as :attr:`pamrs.Rig.effects` lists it."""
    return EFFECTS[entry["id"]].form(entry.get("form", "")).ports
