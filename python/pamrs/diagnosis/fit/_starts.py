"""Starts of the fit of an effect: sizes that scale, shapes to be tried, choices that are fixed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pamrs.effects import Form, Term
from pamrs.rig import Rig

CHOSEN = ("choice", "side")
"""Roles of parameters that are tried at both ends of their range and not fitted."""
_TRIED = ("shape", "place", "threshold", "time", "duration")
"""Roles of parameters that are tried from each of their starts."""


@dataclass(frozen=True)
class Start:
    """One start of one effect.

    Attributes
    ----------
    effect : Term
        Its id, with a place where it acts at one block of several.
    free, fixed : dict of str to float
        Dotted parameters that a fit moves, and those that it leaves, SI.
    sizes : tuple of str
        Those of ``free`` that scale the effect.
    signed : bool
        Whether it can turn its sign.
    form : str
        Which form of the effect it is; empty for the first.
    """

    effect: Term
    free: dict[str, float]
    fixed: dict[str, float]
    sizes: tuple[str, ...]
    signed: bool
    form: str = ""

    @property
    def kind(self) -> tuple[str, frozenset[tuple[str, float]]]:
        """Form of the start, and its fixed parameters."""
        return self.form, frozenset(self.fixed.items())

    def applied(self, rig: Rig) -> Rig:
        """The rig with the effect as it starts."""
        values = self.effect.own(self.free | self.fixed)
        return rig.with_effect(self.effect.id, values, at=self.effect.at, form=self.form)

    def moved(self, effect: Term) -> Start:
        """Start with the effect moved to another place."""

        def named(name: str) -> str:
            return f"{effect}{name.removeprefix(str(self.effect))}"

        return replace(
            self,
            effect=effect,
            free={named(name): value for name, value in self.free.items()},
            fixed={named(name): value for name, value in self.fixed.items()},
            sizes=tuple(map(named, self.sizes)),
        )

    def scaled(self, size: float) -> Start:
        """Start with its sizes multiplied (a restriction by the inverse root), inside bounds."""
        bounds = {f"{self.effect}.{p.name}": p for p in self.effect.info.form(self.form).parameters}

        def sized(name: str, value: float) -> float:
            moved = value / math.sqrt(size) if bounds[name].restricts else value * size
            return min(max(moved, bounds[name].lower), bounds[name].upper)

        free = {
            name: sized(name, value) if name in self.sizes else value
            for name, value in self.free.items()
        }
        return replace(self, free=free)


def form_in(rig: Rig, effect: Term) -> str:
    """Form of an effect in a rig; empty for the first, and where the rig does not have it."""
    return next((e.get("form", "") for e in rig.effects if _is(effect, e)), "")


def entry_of(rig: Rig, effect: Term) -> dict[str, Any]:
    """The entry of an effect in a rig: that at its place, or the first of its id."""
    return next(e for e in rig.effects if _is(effect, e))


def _is(effect: Term, entry: Mapping[str, Any]) -> bool:
    """True where an entry of a rig is of an effect: at its place, or anywhere without one."""
    return effect.id == entry["id"] and effect.at in ("", entry.get("at", ""))


def without_term(rig: Rig, effect: Term) -> Rig:
    """A rig without an effect; where it has a place, without that at this place."""
    at = effect.at
    if at and not any(Term.of(e) == effect for e in rig.effects):
        return rig
    return rig.without_effect(effect.id, at=at or None)


def with_effects_of(rig: Rig, other: Rig, but: Collection[str] = ()) -> Rig:
    """A rig with the effects of another one as well, in their forms, but for some ids."""
    for entry in other.effects:
        if entry["id"] not in but:
            rig = with_entry(rig, entry)
    return rig


def with_entry(rig: Rig, entry: Mapping[str, Any], std: Mapping[str, float] | None = None) -> Rig:
    """A rig with an effect of another one as well, and standard deviations of its parameters."""
    form, at = entry.get("form", ""), entry.get("at", "")
    return rig.with_effect(entry["id"], entry["parameters"], std=std, at=at, form=form)


def starts_of(effect: Term, *, sealed: bool) -> list[Start]:
    """Every start of every form of an effect that is the same in all recordings.

    Parameters
    ----------
    effect : Term
        Its id, with a place where it acts at one block of several.
    sealed : bool
        Whether the rig has no valve: a recording may then begin just after a fill.

    Returns
    -------
    list of Start
        One for each form and each combination of its shapes and choices; sizes at their typical
        value.
    """
    info = effect.info
    # of an effect that only ever happens at times of its own the first form stands for all
    forms = info.lasting or info.forms[:1]
    return [start for form in forms for start in _starts_of_form(effect, form, sealed=sealed)]


def _starts_of_form(effect: Term, form: Form, *, sealed: bool) -> list[Start]:
    """Every start of one form."""
    shapes: list[list[tuple[str, float]]] = []
    sizes: dict[str, float] = {}
    fixed: list[list[tuple[str, float]]] = []
    signed = False
    form_name = "" if form is effect.info.forms[0] else form.name
    for parameter in form.parameters:
        name = f"{effect}.{parameter.name}"
        role = parameter.role_in(sealed=sealed)
        if role == "size":
            sizes[name] = next(
                (value for value in parameter.starts if value != 0.0), parameter.default
            )
            signed = signed or parameter.lower < 0.0
        elif role in _TRIED:
            shapes.append([(name, value) for value in parameter.starts])
        else:
            ends = (parameter.lower, parameter.upper) if role in CHOSEN else (parameter.default,)
            fixed.append([(name, value) for value in ends])
    return [
        Start(effect, sizes | dict(shape), dict(chosen), tuple(sizes), signed, form_name)
        for shape in itertools.product(*shapes)
        for chosen in itertools.product(*fixed)
    ]
