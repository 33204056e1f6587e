"""The compound trajectory of chapter 5."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs.control import Trajectory

Array = NDArray[np.float64]

#: Amplitude [deg] and angular frequency [rad/s] of the sinusoids of (5.24).
TABLE_5_1: Final = ((20.0, 0.70), (13.0, 0.95), (7.0, 1.55), (5.0, 0.80))


@dataclass(frozen=True)
class Waves:
    """Cosines, a triangle wave and a bias; goes on for ever."""

    cosines: tuple[tuple[float, float], ...]  # rad, rad/s
    bias: float  # rad, the triangle's mean within
    height: float  # rad, peak to peak
    frequency: float  # Hz

    def at(self, time: float) -> tuple[float, float, float]:
        """Angle, rate, acceleration at one time."""
        angle, rate, acceleration = self.bias, 0.0, 0.0
        for size, w in self.cosines:
            c = size * math.cos(w * time)
            angle += c
            rate -= size * w * math.sin(w * time)
            acceleration -= w * w * c
        turn = self.frequency * time % 1.0
        rising = turn < 0.5
        angle += self.height * ((2.0 * turn if rising else 2.0 - 2.0 * turn) - 0.5)
        return angle, rate + (2.0 if rising else -2.0) * self.height * self.frequency, acceleration

    def over(self, time: Array) -> tuple[Array, Array, Array]:
        """The same at many."""
        angle, rate, acceleration = (np.full(time.shape, start) for start in (self.bias, 0.0, 0.0))
        for size, w in self.cosines:
            c = size * np.cos(w * time)
            angle += c
            rate -= size * w * np.sin(w * time)
            acceleration -= w * w * c
        turn = self.frequency * time % 1.0
        rising = turn < 0.5
        angle += self.height * (np.where(rising, 2.0 * turn, 2.0 - 2.0 * turn) - 0.5)
        return (
            angle,
            rate + np.where(rising, 2.0, -2.0) * self.height * self.frequency,
            acceleration,
        )


def waves(
    duration: float = 100.0, cosines: tuple[tuple[float, float], ...] = TABLE_5_1
) -> Trajectory:
    """The compound trajectory (5.24), ``sum A_i cos(w_i t) + triangle + bias``.

    The triangle, 20 deg high about 10 deg at 0.16 Hz, begins at its lowest value and rises; the
    dissertation prints frequency, height and bias of it, not its phase. At its tips the rate is
    that of what follows, and the acceleration that of the cosines.

    Parameters
    ----------
    duration : float
        Length of the record [s].
    cosines : tuple of (float, float)
        Amplitude [deg] and angular frequency [rad/s] of each; Table 5.1 by default.

    Returns
    -------
    Trajectory
    """
    given = tuple((math.radians(size), w) for size, w in cosines)
    mean = math.radians(50.0) + math.radians(10.0)
    return Trajectory("compound", duration, Waves(given, mean, math.radians(20.0), 0.16))
