"""A bench that is simulated, for rehearsals: a rig that begins at rest before each run, with
sensors that have noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from pamrs.channels import channel_of
from pamrs.control.simulated_device import SimulatedDevice, VirtualClock
from pamrs.diagnosis.next_experiment import noise_of
from pamrs.rig import Rig

_UNHEARD: Final = ("temperature", "line_pressure")  # a usual bench has no sensors of these


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
        self._random, every = np.random.default_rng(seed), noise_of(rig, noise)
        self._noise = {n: std for n, std in every.items() if channel_of(n) not in _UNHEARD}
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
