"""Whether a rig rests: what its joints and loads do in a short sample while every valve is closed
and every regulator keeps its pressure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from pamrs.channels import dotted
from pamrs.rig import Rig
from pamrs.simulation import Simulator

#: How long it is looked at [s].
SAMPLE: Final = 2.5e-4
#: Rate after that time, of the range between the stops [1/s], below which something rests: in a
#: tenth of a second, the time of a loop, it moves a ten-thousandth of its range by such an
#: acceleration. Of a joint of 115 deg 1e-5 rad/s, of a stroke of 0.1 m 5e-7 m/s.
_REST: Final = 5e-6


def after(simulator: Simulator, inputs: Mapping[str, float]) -> dict[str, float]:
    """Channels one sample later; the simulator is left as it was.

    Parameters
    ----------
    simulator : Simulator
        With the sample time :data:`SAMPLE`.
    inputs : mapping of str to float
        Commands by name.

    Returns
    -------
    dict of str to float
    """
    state = simulator.state
    block = simulator._advance(1, {name: np.array([value]) for name, value in inputs.items()})
    simulator.restore(state)
    return {name: float(values[0]) for name, values in block.items()}


def closed(rig: Rig) -> dict[str, float]:
    """Every valve at its null."""
    return {
        dotted("valve_command", name): float(table["null_voltage"])
        for name, table in rig.tables("valve").items()
    }


def kept(rig: Rig, sample: Mapping[str, float]) -> dict[str, float]:
    """Every regulator set to the pressure that it has."""
    return {
        dotted("supply_command", name): sample[dotted("supply_pressure", name)]
        for name, table in rig.tables("supply").items()
        if table.get("kind") == "regulator"
    }


def slowest(rig: Rig) -> dict[str, float]:
    """Rate of every joint [rad/s] and load [m/s] by its channel, below which it rests if it has no
    more after a short sample.
    """
    ends = {
        dotted("joint_rate", name): (table["min_angle"], table["max_angle"])
        for name, table in rig.tables("joint").items()
    }
    for table in rig.tables("load").values():
        if table.get("kind", "mass") == "mass":
            ends["length_rate"] = table["min_length"], table["max_length"]
    return {name: _REST * float(high - low) for name, (low, high) in ends.items()}
