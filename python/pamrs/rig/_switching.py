"""Switching effects on and off: what is asked for, checked, and its place in the list of a rig."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pamrs._checks import checked_number, checked_table, one_of, refused
from pamrs.errors import ParameterError, joined, meant
from pamrs.rig._ports import bare, effect_problem, hanging_problem, near_name
from pamrs.rig.schema import qualified

if TYPE_CHECKING:
    from pamrs.rig._rig import Rig

Entry = dict[str, Any]
"""An effect of a model: ``id``, ``parameters``, and ``at`` and ``form`` where they are given."""


def new_entry(
    model: Mapping[str, Any], effect: Any, parameters: Any, std: Any, at: Any, form: Any
) -> tuple[Entry, dict[str, float]]:
    """Entry of an effect from arguments of :meth:`pamrs.Rig.with_effect`, and its deviations."""
    from pamrs.effects import CATALOGUE, EFFECTS

    if not isinstance(effect, str) or effect not in EFFECTS:
        raise ParameterError(
            f"effect = {effect!r} is not in the catalogue{near_name(str(effect), CATALOGUE)}"
        )
    info = EFFECTS[effect]
    forms = [known.name for known in info.forms]
    if form != "":
        one_of("form", form, forms, also=f" for {effect}")
    place = block_name(info.at, at)
    given = {} if parameters is None else checked_table("parameters", parameters)
    spread = {} if std is None else checked_table("std", std)
    known = {parameter.name: parameter for parameter in info.form(form).parameters}
    problems = [
        f"unknown parameter {name!r}; {meant(name, known)}"
        for name in dict.fromkeys([*given, *spread])
        if name not in known
    ]
    problems += [text] if (text := effect_problem(model, effect, place)) else []
    usual = {name: p.default for name, p in known.items()}
    ranges = {name: (name, p.lower, p.upper, p.unit) for name, p in known.items()}
    spreads = {name: (f"std of {name}", 0.0, math.inf, p.unit) for name, p in known.items()}
    chosen, wrong = _checked(usual | given, ranges)
    deviations, wrong_too = _checked(spread, spreads)
    if problems := [*problems, *wrong, *wrong_too]:
        raise ParameterError(joined(f"effect {effect!r}", problems))
    where = {"at": place} if place else {}
    own = {"form": form} if form not in ("", forms[0]) else {}
    return {"id": effect, **where, **own, "parameters": chosen}, deviations


def _checked(
    given: Mapping[str, Any], ranges: Mapping[str, tuple[str, float, float, str]]
) -> tuple[dict[str, float], list[str]]:
    """Checked numbers of those given, and problems; `ranges` has label, bounds and unit of each."""
    chosen, problems = {}, []
    for name, (label, low, high, unit) in ranges.items():
        try:
            if name in given:
                chosen[name] = checked_number(label, given[name], low, high, unit)
        except ParameterError as error:
            problems.append(str(error))
    return chosen, problems


def kind_of_entry(entry: Mapping[str, Any]) -> tuple[str, str, str]:
    """Id, block and form of an effect: everything but its numbers."""
    return entry["id"], entry.get("at", ""), entry.get("form", "")


def placed(entries: Iterable[Entry], entry: Entry) -> list[Entry]:
    """The effects of a rig with one more, instead of the first of those that it replaces."""
    place, found, first = entry.get("at", ""), [], None
    for old in entries:
        if old["id"] != entry["id"] or (place and old.get("at", "") not in ("", place)):
            found.append(old)
        elif first is None:
            first = len(found)
    found.insert(len(found) if first is None else first, entry)
    if text := hanging_problem(found):
        raise ParameterError(joined(f"effect {entry['id']!r}", [text]))
    return found


def without(entries: list[Entry], effect: Any, at: Any) -> list[Entry]:
    """The effects of a rig less those of an id, or less the one of them at a block."""
    from pamrs.effects import EFFECTS

    if effect is None:
        if at is not None:
            raise ParameterError(f"at = {at!r} is not allowed without the id of an effect")
        return []
    if at is None:
        return [entry for entry in entries if entry["id"] != effect]
    place = block_name(EFFECTS[effect].at if effect in EFFECTS else "", at)
    of_id = [entry.get("at", "") for entry in entries if entry["id"] == effect]
    if place not in of_id:
        there = ", ".join(f"at {name!r}" if name else "everywhere" for name in of_id)
        there = there or "nowhere in this rig, which is without it"
        raise refused("at", at, f"{effect} acts {there}")
    return [entry for entry in entries if entry["id"] != effect or entry.get("at", "") != place]


def block_name(block: str, at: Any) -> str:
    """Name of the block at which an effect acts, without its kind."""
    if not isinstance(at, str):
        raise refused("at", at, "the name of a block is needed")
    return bare(block, at)


def full_name(entry: Entry) -> str:
    """Full name of an effect, ``leak_muscle.flexor``."""
    return qualified(entry["id"], entry.get("at", ""))


def named_entries(rig: Rig) -> Iterator[tuple[str, Entry]]:
    """Each effect of a rig with the name that its parameters begin with: its id, and behind a dot
    the block where several have that id.
    """
    entries = rig.effects
    ids = [entry["id"] for entry in entries]
    for entry in entries:
        yield entry["id"] if ids.count(entry["id"]) == 1 else full_name(entry), entry


def effect_parameter(rig: Rig, name: str) -> tuple[str, str, Entry] | None:
    """Effect and parameter that a dotted name means, None where it is no effect of the rig: the
    name of :func:`named_entries`, the parameter, and the effect. The block may be given where the
    effect is the only one of its id as well.
    """
    full, _, short = name.rpartition(".")
    for label, entry in named_entries(rig):
        if full in (label, full_name(entry)) and short in entry["parameters"]:
            return label, short, entry
    return None
