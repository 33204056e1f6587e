"""Recordings of made-up plants with the noise of transducers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pamrs.recordings import OwnValue, Recording

SHOULDER = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
"""Standard deviations of the channels of a shoulder [Pa, Pa, rad]."""


def noisy(
    name: str,
    role: str,
    dt: float,
    channels: Mapping[str, NDArray[np.float64]],
    noise: Mapping[str, float],
    seed: list[int],
    parameters: Mapping[str, OwnValue] | None = None,
) -> Recording:
    """A recording without holes; white noise is drawn for the channels that have some, in their
    order.
    """
    rng = np.random.default_rng(seed)
    found = {
        n: v + rng.normal(0.0, noise[n], v.size) if n in noise else v for n, v in channels.items()
    }
    size = next(iter(found.values())).size
    return Recording(
        name,
        role,
        dt * np.arange(size),
        dt,
        found,
        {n: np.ones(size, dtype=bool) for n in found},
        units=dict.fromkeys(found, ""),
        parameters=dict(parameters or {}),
    )
