"""Where effects act: in which rigs, and in which blocks of the cut chain."""

from __future__ import annotations

from pamrs.diagnosis.prepare import Block
from pamrs.effects import EFFECTS
from pamrs.rig import Rig
from pamrs.rig.schema import kind_of

__all__ = ["ACTS", "acts_in", "depends", "fits"]

ACTS: dict[str, tuple[str, ...]] = {
    "supply": ("supply",),
    "valve": ("supply", "chamber"),
    "line": ("supply", "chamber"),
    "chamber": ("chamber",),
    "muscle": ("arm", "pull"),
    "joint": ("arm",),
    "arm": ("arm",),
}
"""Kinds of block of the cut rig in which the effects of a block of the rig act, unless they say
others themselves.

Of several tanks, chambers or joints an effect acts on every one, with the same parameters: so the
core has it where the effect has no ``at``, and one parameter that all recordings and blocks share
is what they can decide. An effect of one muscle alone shows as a block that keeps its mismatch
while its neighbours lose theirs; ``Rig.with_effect(..., at="flexor")`` then has it.
"""


def depends(block: Block, name: str) -> bool:
    """Whether a block's output depends on a parameter."""
    effect = name.partition(".")[0]
    if effect in EFFECTS:
        return acts_in(effect, block)
    return name in block.parameters


def acts_in(effect: str, block: Block) -> bool:
    """Whether an effect acts inside a block of the cut chain."""
    info = EFFECTS[effect]
    places = info.acts_in or ACTS.get(info.block, ())
    return any(kind in places for kind in (block.kind, *block.beside))


def fits(rig: Rig, effect: str) -> bool:
    """Whether a rig has what an effect acts on."""
    info = EFFECTS[effect]
    usual = info.at or ("joint" if info.block == "arm" else "chamber")
    return any(
        kind in ("", kind_of(block, table))
        for block, kind in info.needs or ((usual, ""),)
        for table in rig.tables(block).values()
    )
