"""Tanks without a gauge: their pressure is simulated, and drives what they feed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs import _core
from pamrs.channels import block_of, dotted
from pamrs.diagnosis.prepare._blocks import Block, available_blocks, predicted
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import qualified


def begins_at(gauge: str) -> str:
    """Dotted name of the pressure at which the supply of a gauge begins."""
    return f"{qualified('supply', gauge.partition('.')[2])}.initial_pressure"


def tanks_without_gauge(rig: Rig, channels: Sequence[str]) -> list[str]:
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
    with_gauges = {b.channel for b in available_blocks(rig, (*channels, *missing))}
    return [gauge for gauge in missing if gauge in with_gauges]


def blocks_with_tanks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart (:func:`available_blocks`), those driven by the
    simulated pressure of a tank included, the tank itself not.
    """
    tanks = tanks_without_gauge(rig, channels)
    no_gauge = {f"{qualified('supply', t.partition('.')[2])}.pressure_zero" for t in tanks}
    return [
        replace(
            block,
            floating=tuple(name for name in block.drives if name in tanks),
            parameters=block.parameters - no_gauge,
        )
        for block in available_blocks(rig, (*channels, *tanks))
        if block.channel not in tanks
    ]


def with_tanks(rig: Rig, core: _core.Rig, prepared: Prepared, tanks: Sequence[str]) -> Prepared:
    """A recording with the simulated pressures of its tanks without a gauge: from the pressure of
    the rig file, or of the recording where it has one of its own, under what it draws from them.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    prepared : Prepared
        The recording.
    tanks : sequence of str
        From :func:`tanks_without_gauge`.
    """
    names = tuple(prepared.recording.channels)
    for tank in tanks:
        name = block_of(tank)
        full = qualified("supply", name)
        own_pressure = prepared.recording.parameters.get(begins_at(tank))
        first = rig.parameter(begins_at(tank)).value if own_pressure is None else own_pressure.value
        level = np.full(prepared.n, first)
        flat = replace(
            prepared.with_signals({tank: (level, np.zeros(prepared.n))}),
            raw=prepared.raw | {tank: level},
            noise=prepared.noise | {tank: 0.0},
            lengths=prepared.lengths | {tank: np.zeros(prepared.n, dtype=np.intp)},
            simulated=tuple(dict.fromkeys((*prepared.simulated, tank))),
        )
        available = available_blocks(rig, (*names, *flat.simulated))
        (tank_block,) = [replace(b, window=None) for b in available if b.name == full]
        try:
            value = predicted(tank_block, core, flat.bridged())
        except SimulationError:  # it then stands still
            value = level
        slope = np.gradient(value, prepared.dt)
        prepared = flat.with_signals({tank: (value, slope)})
    return prepared


def notes_on_tanks(rig: Rig, blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """Sentences on tanks without a gauge: the blocks that their simulated pressure drives."""
    notes = []
    for tank in dict.fromkeys(name for block in blocks for name in block.floating):
        name = begins_at(tank)
        own_pressures = [
            p.recording.parameters[name] for p in recordings if name in p.recording.parameters
        ]
        first = rig.units.said(name, "Pa", rig.parameter(name).value)
        if own_pressures:
            first = "the pressure that each recording has of its own"
        driven = " and ".join(block.name for block in blocks if tank in block.floating)
        notes.append(
            f"{tank} was not recorded: {driven} is driven by its simulated course from "
            f"{first}; its level and how far it falls are free in each recording"
        )
    return notes
