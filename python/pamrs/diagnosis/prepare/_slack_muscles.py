"""Lag of a model behind what moved because its muscles without air are slack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamrs import _core
from pamrs._views import in_laboratory_units
from pamrs.diagnosis.prepare._blocks import Block, predicted
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig

_STRUT = 1e9  # [N] buckling load of a muscle that pushes back as its force model says
_APART_NOISES = 3.0  # noise levels by which a push shows
_LEAST_SLACK_SHARE = 0.01  # of the samples of a recording in which it has to
_BETTER = 0.5  # share of what is missed there that is left with a push, where the lag is of that


def notes_on_slack(rig: Rig, blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """Sentences on models that lag where muscles are slack, and would follow if these pushed.

    Parameters
    ----------
    rig : Rig
        The model.
    blocks : sequence of Block
        Those that it misses.
    recordings : sequence of Prepared
        The recordings.

    Returns
    -------
    list of str
        A sentence for each block, of the recording in which it lags most.
    """
    tables = rig.tables("muscle").items()
    slack = [qualified("muscle", name) for name, table in tables if table["buckling_load"] == 0.0]
    moving = [block for block in blocks if block.kind == "arm"]
    if not slack or not moving:
        return []
    loads = {f"{name}.buckling_load": _STRUT for name in slack}
    cores = core_rig(rig), core_rig(rig.with_parameters(loads))
    notes = []
    for block in moving:
        lags = {p.recording.name: _lag(block, cores, p) for p in recordings}
        name, most = max(lags.items(), key=lambda lag: lag[1][0])
        if not most[0]:
            continue
        off, rest = (in_laboratory_units(block.channel, value) for value in most)
        notes.append(
            f"the model lags where a muscle is slack: {block.channel} of {name} is up to {off} "
            f"off there, and {rest} if {' and '.join(slack)} pushed back as the force model alone "
            "says; a muscle without air pushes nothing but what its buckling_load (now 0 N) says "
            "that it bears"
        )
    return notes


def _lag(
    block: Block, cores: tuple[_core.Rig, _core.Rig], prepared: Prepared
) -> tuple[float, float]:
    """The most by which a slack model misses what moved, and what a push leaves of that; nothing
    where a push does not explain most of it.
    """
    try:
        slack, pushing = (predicted(block, core, prepared) for core in cores)
    except SimulationError:
        return 0.0, 0.0
    starts = prepared.starts(block.window, block.drives)
    rows = prepared.usable(block.channel, block.drives, starts)
    rows &= np.abs(pushing - slack) > _APART_NOISES * prepared.noise[block.channel]
    measured = prepared.recording.channels[block.channel][rows]
    lag, rest = measured - slack[rows], measured - pushing[rows]
    rare = rows.sum() < _LEAST_SLACK_SHARE * prepared.n
    if rare or np.linalg.norm(rest) > _BETTER * np.linalg.norm(lag):
        return 0.0, 0.0
    return float(np.abs(lag).max()), float(np.abs(rest).max())
