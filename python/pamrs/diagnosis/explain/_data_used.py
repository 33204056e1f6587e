"""Recordings, samples and channels that the answer rests on, and why others are not used."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamrs import _core
from pamrs.channels import CHANNELS, channel_of
from pamrs.diagnosis.prepare import (
    AMBIENT,
    AMBIENT_PRESSURE,
    Block,
    Unjudged,
    thermometers_of,
    warm_chambers,
)
from pamrs.findings import RecordingUsed
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.rig.schema import qualified

_WITHOUT_ENERGY = (
    'the gas of {chamber} has no temperature of its own: write gas = "energy_balance" and '
    "heat_transfer_coefficient into [{chamber}] to have it judged. That of the room is "
    "ambient_temperature"
)
_WITH_ANOTHER = (
    "the gas of {chamber} comes from another chamber, or goes there, with a temperature that no "
    "block is driven by"
)
"""Why the temperature of a gas is not judged."""


def data_used(
    recordings: Sequence[Recording],
    counts: Sequence[int],
    blocks: Sequence[Block],
    rig: Rig,
    core: _core.Rig,
    unjudged: Sequence[Unjudged],
) -> list[RecordingUsed]:
    """Samples and channels of each recording that the answer rests on.

    Parameters
    ----------
    recordings : sequence of Recording
        Those that were used, as they were used.
    counts : sequence of int
        Recorded samples in each of their samples.
    blocks : sequence of Block
        The blocks that were judged.
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    unjudged : sequence of Unjudged
        The blocks that were not.
    """
    needed = {name for block in blocks for name in (block.channel, *block.drives)}
    needed |= set(core.inputs)
    used = []
    for recording, count in zip(recordings, counts, strict=True):
        unused = {
            name: _why(name, rig, core, unjudged)
            for name in recording.channels
            if name not in needed and channel_of(name) not in (AMBIENT, AMBIENT_PRESSURE)
        }
        used.append(
            RecordingUsed(
                recording=recording.name,
                role=recording.role,
                source=recording.source,
                samples=len(recording),
                sample_time=recording.sample_time,
                averaged=count,
                used=[name for name in recording.channels if name not in unused],
                unused=unused,
                masked={
                    name: share
                    for name, mask in recording.mask.items()
                    if (share := float(np.mean(~mask))) > 0.0
                },
                parameters={name: value.value for name, value in recording.parameters.items()},
                read=[
                    issue.text if issue.channel == "time" else f"{issue.channel}: {issue.text}"
                    for issue in recording.issues
                    if issue.kind == "log"
                ],
            )
        )
    return used


def _why(name: str, rig: Rig, core: _core.Rig, unjudged: Sequence[Unjudged]) -> str:
    """Reason why a channel is not used."""
    kind, _, block = name.partition(".")
    if kind == "temperature" and name in core.channels and block not in thermometers_of(rig):
        why = _WITH_ANOTHER if block in warm_chambers(rig) else _WITHOUT_ENERGY
        return why.format(chamber=qualified("chamber", block))
    table = CHANNELS[channel_of(name)].block
    if name in core.channels or name in core.inputs:
        names = ", ".join(block.name for block in unjudged)
        return "no block that is judged needs it" + f"; not judged: {names}" * bool(names)
    blocks = rig.tables(table) if table else {}
    if table and (not rig.model.get(table) or (block and block not in blocks)):
        return f"the rig has no block [{table}{'.' + block if block else ''}]"
    return f"no block of the model has a {kind.replace('_', ' ')} to compare it with"
