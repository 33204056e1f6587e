"""What a controller is told of the plant: noise, resolution and delay of its sensors, seeded."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pamrs.control.protocol import Measurement, Value
from pamrs.errors import ParameterError

__all__ = ["Reader", "Sensors"]


@dataclass(frozen=True)
class Sensors:
    """Imperfect sensors between a plant and its controller.

    A channel is first delayed, then gets noise, then is rounded. In a batch every plant gets the same noise (common random numbers), so
    that gains are compared on the same day; one run with a seed is the same run alone or in a batch.

    Parameters
    ----------
    noise : mapping of str to float
        Channel -> standard deviation of independent normal noise at each of the controller's samples [SI unit of the channel].
    resolution : mapping of str to float
        Channel -> step of the quantiser [SI unit]; the value is the nearest multiple.
    delay : float
        How old every channel is [s], a multiple of the controller's period; before anything is old enough the first sample stands.
    seed : int
        Of the noise.

    Raises
    ------
    ParameterError
        If a number is negative or not finite, or a resolution is zero.

    Examples
    --------
    >>> Sensors(noise={"joint_angle": 1e-3}, resolution={"muscle_pressure": 1e3}, delay=0.004).delay
    0.004
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    delay: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for label, table, zero in (("noise", self.noise, True), ("resolution", self.resolution, False)):
            for channel, value in table.items():
                if not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
                    need = "zero or more" if zero else "a number above zero"
                    raise ParameterError(f"{label} of {channel} = {value} is not allowed: {need} is needed")
        if not (math.isfinite(self.delay) and self.delay >= 0.0):
            raise ParameterError(f"delay = {self.delay} s is not allowed: zero or more is needed")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ParameterError(f"seed = {self.seed!r} is not allowed: a whole number from 0 on is needed")

    def started(self, period: float) -> Reader:
        """Sensors at the beginning of a run.

        Parameters
        ----------
        period : float
            Time between two samples of the controller [s].

        Returns
        -------
        Reader

        Raises
        ------
        ParameterError
            If the delay is not a multiple of the period.
        """
        count = round(self.delay / period)
        if abs(count * period - self.delay) > 1e-6 * period:
            raise ParameterError(f"delay = {self.delay} s is not allowed: a multiple of the controller's period = {period} s is needed")
        return Reader(self, count)


class Reader:
    """Sensors in use: called with each sample of the plant, it says what is read."""

    def __init__(self, sensors: Sensors, samples: int) -> None:
        self._sensors = sensors
        self._late: deque[Measurement] = deque(maxlen=samples + 1)
        self._random = np.random.default_rng(sensors.seed)

    def __call__(self, sample: Measurement) -> dict[str, Value]:
        """Read a sample.

        Parameters
        ----------
        sample : mapping of str to float or ndarray, shape (n,)
            True channels.

        Returns
        -------
        dict of str to float or ndarray, shape (n,)

        Raises
        ------
        ParameterError
            If a channel with noise or a resolution is not there.
        """
        self._late.append(sample)
        read: dict[str, Value] = dict(self._late[0])
        for channel, size in self._sensors.noise.items():
            read[channel] = _there(read, channel) + size * float(self._random.standard_normal())
        for channel, size in self._sensors.resolution.items():
            value = _there(read, channel)
            read[channel] = size * (np.round(value / size) if isinstance(value, np.ndarray) else round(value / size))
        return read


def _there(sample: Measurement, channel: str) -> Value:
    if channel not in sample:
        raise ParameterError(f"sensors have {channel!r}, and the plant has no such channel; it has: {', '.join(sample)}")
    return sample[channel]
