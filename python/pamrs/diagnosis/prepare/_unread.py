"""Tanks without a gauge: their pressure is simulated, and drives what they feed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs import _core
from pamrs.channels import dotted
from pamrs.diagnosis.prepare._blocks import Block, available_blocks, predicted
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import qualified

__all__ = ["blocks_beside_tanks", "said_of_tanks", "unread_tanks", "with_tanks"]


def unread_tanks(rig: Rig, channels: Sequence[str]) -> list[str]:
    """Channels of tanks that nobody measured and whose pressure can be simulated, since what they
    feed and what is commanded there is recorded.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    channels : sequence of str
        What every recording has.
    """
    tanks = [name for name, table in rig.tables("supply").items() if table["kind"] == "tank"]
    gauges = [dotted("supply_pressure", name) for name in tanks]
    missing = [gauge for gauge in gauges if gauge not in channels]
    there = {b.channel for b in available_blocks(rig, (*channels, *missing))}
    return [gauge for gauge in missing if gauge in there]


def blocks_beside_tanks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart (:func:`available_blocks`), those driven by the
    simulated pressure of a tank included, the tank itself not.
    """
    tanks = unread_tanks(rig, channels)
    return [
        replace(block, floating=tuple(name for name in block.drives if name in tanks))
        for block in available_blocks(rig, (*channels, *tanks))
        if block.channel not in tanks
    ]


def with_tanks(rig: Rig, core: _core.Rig, prepared: Prepared, tanks: Sequence[str]) -> Prepared:
    """A recording with the simulated pressures of its tanks without a gauge: from the pressure of
    the rig file, under what the recording draws from them.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    prepared : Prepared
        The recording.
    tanks : sequence of str
        From :func:`unread_tanks`.
    """
    names = tuple(prepared.recording.channels)
    for tank in tanks:
        name = tank.partition(".")[2]
        full = qualified("supply", name)
        begun = float(rig.tables("supply")[name]["initial_pressure"])
        level = np.full(prepared.n, begun)
        flat = replace(
            prepared,
            signals=prepared.signals | {tank: (level, np.zeros(prepared.n))},
            raw=prepared.raw | {tank: level},
            noise=prepared.noise | {tank: 0.0},
            lengths=prepared.lengths | {tank: np.zeros(prepared.n, dtype=np.intp)},
            simulated=(*prepared.simulated, tank),
        )
        found = available_blocks(rig, (*names, *flat.simulated))
        (own,) = [replace(b, window=None) for b in found if b.name == full]
        try:
            value = predicted(own, core, flat)
        except SimulationError:  # it then stands still
            value = level
        slope = np.gradient(value, prepared.dt)
        prepared = replace(flat, signals=flat.signals | {tank: (value, slope)})
    return prepared


def said_of_tanks(rig: Rig, blocks: Sequence[Block]) -> list[str]:
    """What is taken of tanks without a gauge, in words."""
    said = []
    for tank in dict.fromkeys(name for block in blocks for name in block.floating):
        table = rig.tables("supply")[tank.partition(".")[2]]
        driven = " and ".join(block.name for block in blocks if tank in block.floating)
        said.append(
            f"{tank} was not recorded: {driven} is driven by its simulated course from "
            f"{table['initial_pressure'] / 1e5:.3g} bar, whose level is free in each recording"
        )
    return said
