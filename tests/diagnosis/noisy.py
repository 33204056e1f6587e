"""Recordings of made-up plants with the noise of transducers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

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
    return replace(whole(name, role, dt, found), parameters=dict(parameters or {}))


def whole(name: str, role: str, dt: float, channels: dict[str, NDArray[np.float64]]) -> Recording:
    """A recording without holes, of channels as they are."""
    size = next(iter(channels.values())).size
    mask = {n: np.ones(size, dtype=bool) for n in channels}
    units = dict.fromkeys(channels, "")
    return Recording(name, role, dt * np.arange(size), dt, channels, mask, units=units)
