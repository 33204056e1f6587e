"""Places where effects act: the rigs that can have them, and blocks of the cut chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pamrs.diagnosis.prepare import Block
from pamrs.effects import EFFECTS, EffectInfo, SameData, Term, effect_of
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.rig.schema import ACTS, kind_of, split_name

_CHANNELS = {
    "supply": ("supply_pressure", "supply_command"),
    "valve": ("valve_command",),
    "chamber": ("muscle_pressure", "temperature"),
    "joint": ("joint_angle",),
}
"""Channels that belong to a block of the rig."""


def depends(block: Block, name: str) -> bool:
    """True where a block's output depends on a parameter, given by its dotted name."""
    effect = effect_of(name)
    return name in block.parameters if effect is None else acts_in(effect, block)


def concerns(term: Term, block: Block) -> bool:
    """True where a block's output depends on an effect or a value of the rig file."""
    return acts_in(term, block) if term.is_effect else depends(block, term.id)


def acts_in(effect: Term, block: Block) -> bool:
    """True where an effect acts inside a block of the cut chain: that of its own block of the rig,
    unless it names others.

    Of several tanks, chambers or joints an effect acts on every one, with the same parameters,
    where it has no place; with one (``leak_muscle@flexor``), on that block alone.
    """
    info, at = effect.info, effect.at
    kinds = info.acts_in or ACTS.get(info.block, ())
    there = any(kind in kinds for kind in (block.kind, *block.simulated))
    return there and (not at or _has(block, info.at, at))


def _has(block: Block, kind: str, name: str) -> bool:
    """True where a block of the cut chain is, has parameters of, or is driven by a rig's block."""
    channels = {f"{channel}.{name}" for channel in _CHANNELS.get(kind, ())}
    return (
        block.name == f"{kind}.{name}"
        or any(parameter.startswith(f"{kind}.{name}.") for parameter in block.parameters)
        or not channels.isdisjoint((block.channel, *block.drives))
    )


def places_of(rig: Rig, effect: str, blocks: Sequence[Block]) -> list[str]:
    """Blocks of a rig at each of which alone an effect may act, by name, where the cut chain can
    tell them from each other; empty where there are not two of them.

    Parameters
    ----------
    rig : Rig
        The rig.
    effect : str
        Id of an effect that is the same in all recordings.
    blocks : sequence of Block
        Those that are judged together.
    """
    info = EFFECTS[effect]
    if not info.at or info.last_only or (info.transient and not info.own):
        return []
    places = [
        name
        for name in rig.tables(info.at)
        if name
        and any(acts_in(Term(effect, name), block) for block in blocks)
        and _possible(rig, effect, name)
    ]
    return places if len(places) > 1 else []


def _possible(rig: Rig, effect: str, at: str) -> bool:
    """True where a rig can have an effect at a block."""
    try:
        rig.with_effect(effect, at=at)
    except ParameterError:
        return False
    return True


def core_names(rig: Rig, names: Sequence[str]) -> list[str]:
    """Dotted names of parameters as the core has them: with a place where an id is there twice."""
    ids = [entry["id"] for entry in rig.effects]

    def named(name: str) -> str:
        effect = effect_of(name)
        if effect is None or not effect.at:
            return name
        place = f".{effect.at}" if ids.count(effect.id) > 1 else ""
        return f"{effect.id}{place}{name.removeprefix(str(effect))}"

    return [named(name) for name in names]


def fits(rig: Rig, effect: str) -> bool:
    """True where a rig has what an effect acts on, and no uncertain parameter for the same."""
    info = EFFECTS[effect]
    if info.stated_by:
        blocks = (split_name(name) for name, given in rig.parameters.items() if given.tol > 0.0)
        if {f"{block}.{key}" for block, _, key in blocks}.intersection(info.stated_by):
            return False
    return _acts_on(rig, info)


def same_data_in(rig: Rig, effect: Term) -> SameData | None:
    """Description of another effect that leaves the same recordings in a rig; None without one."""
    found = (s for s in effect.info.same_data if _acts_on(rig, EFFECTS[s.effect]))
    same = next(found, None)
    return same and replace(same, held=same.held if rig.tables(same.held_at) else ())


def _acts_on(rig: Rig, info: EffectInfo) -> bool:
    """True where a rig has a block of the kind that an effect acts on."""
    usual = info.at or ("joint" if info.block == "arm" else "chamber")
    return any(
        kind in ("", kind_of(block, table))
        for block, kind in info.needs or ((usual, ""),)
        for table in rig.tables(block).values()
    )
