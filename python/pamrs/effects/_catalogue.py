"""The catalogue: what the core says that each effect is, with the words of the file of its name."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final

from pamrs import _core
from pamrs.effects._info import (
    BenchUnit,
    ClosureTerm,
    EffectInfo,
    EffectParameter,
    Form,
    SameData,
    Words,
)


def _words(effect: str) -> dict[str, Any]:
    """The words of an effect."""
    file = resources.files("pamrs.effects").joinpath("words", f"{effect}.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _parameter(stated: dict[str, Any], meanings: dict[str, str]) -> EffectParameter:
    """A parameter, as the core tells it, with its words."""
    own: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in stated.items()}
    own |= {key: stated[key] or "" for key in ("role", "role_sealed")}
    return EffectParameter(**own, meaning=meanings[stated["name"]])


def _form(stated: dict[str, Any], meanings: dict[str, str], equation: str) -> Form:
    return Form(
        name=stated["name"],
        parameters=tuple(_parameter(parameter, meanings) for parameter in stated["parameters"]),
        states=tuple(state["name"] for state in stated["states"]),
        ports=tuple(stated["ports"]),
        equation=equation,
    )


#: Of an effect, as the core tells it.
_OF_CORE: Final = ("block", "at", "last_only", "on_loads", "frees_mass", "dry_friction")


def _info(stated: dict[str, Any]) -> EffectInfo:
    """One effect, as the core tells it, with its words."""
    words = _words(stated["id"])
    terms = tuple(
        ClosureTerm(**{**term, "variables": tuple(term["variables"])})
        for term in words.get("terms", ())
    )
    meanings = {
        **{term.name: f"coefficient of {term.formula}" for term in terms},
        **words["parameters"],
    }
    usual, *others = stated["forms"]
    equations = {usual["name"]: words["equation"]}
    equations |= {form["name"]: words["forms"][form["name"]] for form in others}
    kink = stated["kink"]
    excitation = words.get("excitation", {}).items()
    return EffectInfo(
        id=stated["id"],
        forms=tuple(_form(form, meanings, equations[form["name"]]) for form in stated["forms"]),
        reference=stated["source"],
        catalogue=stated["named"],
        same_data=tuple(
            SameData(
                **{**same, "held": tuple(map(tuple, same["held"])), "told_by": words["told_by"]}
            )
            for same in stated["same_data"]
        ),
        terms=terms,
        excitation=tuple((k, tuple(v) if isinstance(v, list) else v) for k, v in excitation),
        acts_in=tuple(stated["acts_in"]),
        supplies=tuple(stated["supplies"]),
        kink=None
        if kink is None
        else (tuple(kink["where_not_zero"]), kink["why"], kink["of_supplies"]),
        at_rest=tuple((act, *change) for one in stated["at_rest"] for act, change in one.items()),
        rivals=tuple(words.get("rivals", ())),
        stated_by=tuple(words.get("stated_by", ())),
        like_values=tuple(words.get("like_values", ())),
        most=dict(words.get("most", {})),
        bench_units=tuple(BenchUnit(**unit) for unit in words.get("bench_units", ())),
        **{key: stated[key] for key in _OF_CORE},
        **{key: words[key] for key in ("name", "equation", "fingerprint", "separates")},
        **{key: words.get(key, "") for key in ("label", "experiment", "shares", "bench")},
    )


EFFECTS: Final[dict[str, EffectInfo]] = {
    stated["id"]: _info(stated) for stated in json.loads(_core.effects())
}
"""Every effect by its id, in the order of the chain; sums of terms last."""
CATALOGUE: Final[dict[str, EffectInfo]] = {
    name: effect for name, effect in EFFECTS.items() if effect.catalogue
}
"""Effects that a diagnosis may name."""
CLOSURE_TERMS: Final[dict[str, tuple[ClosureTerm, ...]]] = {
    name: effect.terms for name, effect in EFFECTS.items() if effect.terms
}
"""Terms of each sum, in the order of its parameters."""
CLOSURE_OF: Final[dict[str, str]] = {
    ("arm" if EFFECTS[name].at == "joint" else EFFECTS[name].at): name for name in CLOSURE_TERMS
}
"""Sum of terms of each block of the cut chain."""
WORDS: Final[dict[str, Words]] = {
    name: Words(*(_words(name)[key] for key in ("what", "letter", "symbols", "odd_in")))
    for name in CLOSURE_TERMS
}
"""Words for each sum of terms."""
MEMORY_OF: Final[dict[str, str]] = {"time": "memory_time", "distance": "memory_angle"}
"""Shape that a term of a kind with memory depends on."""


def ports_of(entry: Mapping[str, Any]) -> tuple[str, ...]:
    """The ports at which an effect of a rig acts, as :attr:`pamrs.Rig.effects` lists it."""
    return EFFECTS[entry["id"]].form(entry.get("form", "")).ports
