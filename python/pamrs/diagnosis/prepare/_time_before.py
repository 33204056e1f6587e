"""Commands and pressures before a recording began, as far as its first samples show them."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import channel_of, with_trait
from pamrs.diagnosis.prepare._signals import Prepared

# [Pa] how far a pressure is followed back to before a recording: a rate at its edge is uncertain
_MOST_MOVED = 2e4


_PRESSURE_CHANNELS: Final = with_trait("pressure")


class TimeBefore(NamedTuple):
    """Assumed time before a recording: commands and pressures stay at their first values, and
    lately the pressures moved at their first rate.

    Attributes
    ----------
    samples, moving : int
        How many there were, and how many of them the pressures moved.
    """

    samples: int
    moving: int

    def commands(self, commands: dict[str, Array], n: int) -> dict[str, Array]:
        """Commands of a recording of `n` samples with those before it."""
        return {
            name: np.concatenate([np.full(self.samples * (values.size // n), values[0]), values])
            for name, values in commands.items()
        }

    def signals(
        self, signals: dict[str, tuple[Array, Array]], prepared: Prepared
    ) -> dict[str, tuple[Array, Array]]:
        """Channels and their time derivatives with those before them."""
        back = prepared.dt * np.minimum(np.arange(self.samples, 0, -1), self.moving)
        extended = {}
        for name, (value, slope) in signals.items():
            first, rate = (float(array[0]) for array in prepared.with_starts(name, [0]))
            was = np.full(self.samples, first)
            if channel_of(name) in _PRESSURE_CHANNELS:
                was -= np.clip(rate * back, -_MOST_MOVED, _MOST_MOVED)
                was = np.maximum(was, min(first, -_MOST_MOVED))
            extended[name] = (
                np.concatenate([was, value]),
                np.concatenate([np.gradient(was, prepared.dt), slope]),
            )
        return extended
