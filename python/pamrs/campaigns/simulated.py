"""A bench that is simulated, for rehearsals: a rig that begins at rest before each run, with
sensors that have noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from pamrs.channels import channel_of
from pamrs.control.simulated_device import SimulatedDevice, VirtualClock
from pamrs.diagnosis.next_experiment import measurable
from pamrs.rig import Rig

#: Noise of usual sensors by kind of channel [SI].
NOISE: Final = {"joint_angle": math.radians(0.02), "length": 3e-5, "force": 1.0}
_PRESSURE: Final = 400.0  # [Pa] noise of a gauge of 14 bar
_UNHEARD: Final = ("valve_command", "supply_command", "temperature", "line_pressure")


class SimulatedBench:
    """A rig behind ``read()`` and ``write(command)``; a minute takes no longer than its arithmetic.

    Parameters
    ----------
    rig : Rig
        The plant, with what the nominal model leaves out.
    noise : mapping of str to float, optional
        Standard deviation by kind of channel [SI]; of usual sensors by default.
    seed : int
        Of the noise.
    **device
        What fails, as of :class:`pamrs.control.simulated_device.SimulatedDevice`.
    """

    name = "simulated"

    def __init__(
        self, rig: Rig, *, noise: Mapping[str, float] | None = None, seed: int = 0, **device: Any
    ) -> None:
        self.rig, self.clock, self._device = rig, VirtualClock(), device
        given, self._random = {**NOISE, **(noise or {})}, np.random.default_rng(seed)
        kinds = {name: channel_of(name) for name in measurable(rig)}
        self._noise = {
            name: given.get(kind, _PRESSURE) for name, kind in kinds.items() if kind not in _UNHEARD
        }
        self.prepare()

    def prepare(self) -> None:
        """Fill the tank, empty the muscles: the rig as its file has it."""
        self.plant = SimulatedDevice(self.rig, self.clock, **self._device)

    def read(self) -> Mapping[str, float] | None:
        """The channels now, with noise."""
        found = self.plant.read()
        if found is None:
            return None
        heard = {
            name: found[name] + std * float(self._random.standard_normal())
            for name, std in self._noise.items()
            if name in found
        }
        return {"time": found["time"], **heard}

    def write(self, command: Any) -> None:
        """Hold a command."""
        self.plant.write(command)
