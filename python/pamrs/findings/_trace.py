"""A measured and simulated channel, and what a model file is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pamrs._arrays import Array


class ModelFile(Protocol):
    """Anything that can write itself as a model file; normally a `pamrs.Rig`."""

    def to_toml_text(self) -> str:
        """Return the model as TOML."""


@dataclass(frozen=True)
class Trace:
    """One channel of one recording, measured and simulated.

    Parameters
    ----------
    recording, role : str
        Name of the recording; role ``fit`` or ``held_out``.
    channel, unit : str
        Canonical channel and its SI unit.
    time : array_like, shape (n,)
        Time in s.
    measured, before : array_like, shape (n,)
        Measurement and simulation with the nominal model, in `unit`; NaN where masked.
    refit, after : array_like or None, shape (n,)
        Simulation after the refit of parameters only, and with the effect; None becomes NaN.
    residual_before, residual_after : array_like or None, shape (n,)
        Residual of the refitted baseline and of the model with the effect; by default measured
        minus `refit` (or `before` when there is no refit) and measured minus `after`.

    Raises
    ------
    ValueError
        If an array has not the shape of `time`.
    """

    recording: str
    role: str
    channel: str
    unit: str
    time: Array
    measured: Array
    before: Array
    refit: Array | None = None
    after: Array | None = None
    residual_before: Array | None = None
    residual_after: Array | None = None

    def __post_init__(self) -> None:
        def put(name: str, array: Array) -> None:
            object.__setattr__(self, name, array)

        put("time", np.asarray(self.time, dtype=np.float64))
        curves = ("measured", "before", "refit", "after", "residual_before", "residual_after")
        for name in curves:
            value = getattr(self, name)
            if value is None:
                continue
            array = np.asarray(value, dtype=np.float64)
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError(
                    f"trace {self.recording}/{self.channel}: {name} has shape {array.shape}, "
                    f"time has shape {self.time.shape}; both must be the same (n,)"
                )
            put(name, array)
        nan = np.full(self.time.shape, np.nan)
        baseline = self.before if self.refit is None else self.refit
        after = nan.copy() if self.after is None else self.after
        put("refit", nan.copy() if self.refit is None else self.refit)
        put("after", after)
        if self.residual_before is None:
            put("residual_before", self.measured - baseline)
        if self.residual_after is None:
            put("residual_after", self.measured - after)
