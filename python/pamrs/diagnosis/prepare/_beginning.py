"""How long a recording remembers a beginning that nobody measured.

A regulator whose outlet has no gauge begins a recording somewhere between what it feeds and what it
is set to: at rest all three are the same, and a log that begins as a stopcock is opened has them
bars apart. What its block predicts from either tells the samples that depend on it; these are not
judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs import _core
from pamrs.channels import dotted
from pamrs.diagnosis.prepare._blocks import Block, predicted
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.errors import SimulationError
from pamrs.rig.schema import qualified

__all__ = ["begun_alike", "said_of_beginnings"]


def begun_alike(blocks: Sequence[Block], core: _core.Rig, prepared: Prepared) -> Prepared:
    """A recording whose first samples are not judged in blocks that remember where a regulator
    without a gauge stood.

    Parameters
    ----------
    blocks : sequence of Block
        Those of the rig.
    core : _core.Rig
        The nominal model, compiled.
    prepared : Prepared
        The recording.

    Returns
    -------
    Prepared
        With `unsettled`, the samples by the channel that each such block predicts.
    """
    unsettled = {
        block.channel: count
        for block in blocks
        if block.beside and (count := _remembered(block, core, prepared)) > 0
    }
    return replace(prepared, unsettled=unsettled) if unsettled else prepared


def _remembered(block: Block, core: _core.Rig, prepared: Prepared) -> int:
    """Samples up to the last one that shows where the regulators of a block began."""
    commands = _set(block)
    outlets = {
        qualified("supply", name.partition(".")[2]): max(0.0, float(prepared.held[name][0]))
        for name in commands
    }
    try:
        apart = predicted(block, core, prepared, outlets) - predicted(block, core, prepared)
    except SimulationError:
        return 0  # the fit says what cannot be predicted
    most = prepared.settings.prepare.outlet_noises * prepared.noise[block.channel]
    seen = np.flatnonzero(np.abs(apart) > most)
    return int(seen[-1]) + 1 if seen.size else 0


def _set(block: Block) -> list[str]:
    """Commands of the regulators that a block is driven by."""
    return [name for name in block.drives if name.partition(".")[0] == "supply_command"]


def said_of_beginnings(blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """What is not judged of the beginnings, in words.

    Parameters
    ----------
    blocks : sequence of Block
        Those that are judged.
    recordings : sequence of Prepared
        Those of a case; one that is there twice counts once.

    Returns
    -------
    list of str
        A sentence for each block.
    """
    said = []
    each = {p.recording.name: p for p in recordings}.values()
    for block in blocks:
        own = [p for p in each if p.unsettled.get(block.channel)]
        if own:
            told = ", ".join(
                f"{p.unsettled[block.channel] * p.dt:.3g} s of {p.recording.name}" for p in own
            )
            regulators = [d.partition(".")[2] for d in _set(block)]
            what = " or ".join(dotted("supply_pressure", name) for name in regulators)
            said.append(
                f"block {block.name}: the first {told} were not judged: they show where the "
                f"regulator began, and nobody measured that (a gauge for {what} would)"
            )
    return said
