"""Recordings of made-up plants with the noise of transducers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.experiments._chains import driving
from pamrs.recordings import OwnValue, Recording

SHOULDER = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
"""Standard deviations of the channels of a shoulder [Pa, Pa, rad]."""
GAUGES = {"supply_pressure": 400.0, "muscle_pressure": 400.0}
"""Those of a supply and of a chamber [Pa]."""


def driven(
    rig: pamrs.Rig,
    name: str,
    role: str,
    dt: float,
    commands: dict[str, NDArray[np.float64]],
    noise: Mapping[str, float],
    seed: list[int],
    *,
    first: int = 0,
    **options: Any,
) -> Recording:
    """A rig under commands by channel: these, and the channels that have noise, from a row on."""
    run = pamrs.simulate(rig, sample_time=dt, **driving(commands), **options)
    channels = commands | {n: run[n] for n in noise if n not in commands}
    return noisy(name, role, dt, {n: v[first:] for n, v in channels.items()}, noise, seed)


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


def without(one: Recording, *names: str) -> Recording:
    """The same without some channels."""
    kept = [n for n in one.channels if n not in names]
    return replace(
        one, channels={n: one.channels[n] for n in kept}, mask={n: one.mask[n] for n in kept}
    )
