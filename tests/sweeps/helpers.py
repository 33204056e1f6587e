"""A small sweep that the tests share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import pamrs

DT = 0.005
COMMAND = np.full(21, 6.0)
GRID: dict[str, Any] = {
    "arm.payload": [2.0, 5.0, 9.0],
    "initial.joint_angle": [0.4, 0.6, 0.7, 0.8],
    "chamber.dead_volume": [1e-4, 1.5e-4],
}
METRICS: dict[str, tuple[Any, ...]] = {
    "end": ("final", "joint_angle"),
    "least": ("min", "joint_rate"),
    "most": ("max", "muscle_pressure"),
    "swing": ("peak", "joint_rate"),
    "level": ("mean", "muscle_pressure"),
    "ise": ("squared_error", "joint_angle", 0.8),
}


def small(store: Path | str, over: Any = None, **changes: Any) -> xr.Dataset:
    """24 runs in six chunks, some arguments changed."""
    arguments: dict[str, Any] = {
        "metrics": METRICS,
        "sample_time": DT,
        "valve_command": COMMAND,
        "chunk": 4,
        "progress": False,
        **changes,
    }
    rig = arguments.pop("rig", None) or pamrs.rigs.shoulder()
    return pamrs.sweep(rig, GRID if over is None else over, store=store, **arguments)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """The same names, dimensions, coordinates and numbers to the last bit."""
    xr.testing.assert_identical(one.load(), other.load())
