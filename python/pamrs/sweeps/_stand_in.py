"""Stand-in for ``pamrs.simulation.simulate_batch``: the same arguments and results, one run after
the other. To be deleted when :mod:`pamrs.simulation` has the function.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.errors import PamrsError, ParameterError, SimulationError
from pamrs.rig import Rig
from pamrs.simulation import Failure, core_rig, simulate

__all__ = ["simulate_batch"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Run:
    """What the lanes return, as far as a sweep reads it."""

    reduced: dict[str, Array]
    status: tuple[Failure | None, ...]


def simulate_batch(
    rig: Rig,
    *,
    valve_command: Any = None,
    sample_time: float,
    n: int,
    step: float | None = None,
    duration: float | None = None,
    supply_command: Any = None,
    length: Any = None,
    pressure: Any = None,
    initial: Mapping[str, ArrayLike] | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    record: Sequence[str] = (),
    every: int = 1,
    reduce: Mapping[str, tuple[Any, ...]] | None = None,
    threads: int | None = None,
) -> _Run:
    """Runs of one rig with other parameters, reduced to numbers; signals are those of all runs."""
    del record, every, threads
    columns = {name: np.atleast_1d(v) for name, v in (parameters or {}).items()}
    starts = {name: np.asarray(v, dtype=np.float64) for name, v in (initial or {}).items()}
    reduced = {name: np.full(n, np.nan) for name in reduce or {}}
    status: list[Failure | None] = [None] * n
    for row in range(n):
        try:
            run = simulate(
                _with_values(
                    rig, {k: float(np.broadcast_to(v, n)[row]) for k, v in columns.items()}
                ),
                valve_command=valve_command,
                sample_time=sample_time,
                step=step,
                duration=duration,
                supply_command=supply_command,
                length=length,
                pressure=pressure,
                initial={k: float(np.broadcast_to(v, n)[row]) for k, v in starts.items()},
            )
        except SimulationError as error:
            status[row] = Failure(0.0, str(error))
            continue
        for name, (kind, channel, *reference) in (reduce or {}).items():
            if channel not in run:
                raise ParameterError(
                    f"reduce[{name!r}] has the unknown channel {channel!r}; there are: "
                    f"{', '.join(run)}"
                )
            reduced[name][row] = _number(kind, run[channel], run.time, *reference)
    return _Run(reduced, tuple(status))


def _with_values(rig: Rig, values: Mapping[str, float]) -> Rig:
    """A rig with other values, of its effects too."""
    own = {name: value for name, value in values.items() if name in rig.parameters}
    changed = rig.with_parameters(own) if own else rig
    for entry in rig.effects:
        full = ".".join(filter(None, (entry["id"], entry.get("at", ""))))
        given = {
            name: values[f"{full}.{name}"]
            for name in entry["parameters"]
            if f"{full}.{name}" in values
        }
        if given:
            changed = changed.with_effect(
                entry["id"],
                {**entry["parameters"], **given},
                at=entry.get("at", ""),
                form=entry.get("form", ""),
            )
    unknown = [
        name for name in values if name not in own and name not in core_rig(rig).parameter_names
    ]
    if unknown:
        raise PamrsError(f"unknown parameters {unknown}")
    return changed


def _number(kind: str, values: Array, time: Array, reference: ArrayLike = 0.0) -> float:
    if kind == "squared_error":
        return float(np.trapezoid((values - np.asarray(reference)) ** 2, time))
    simple: dict[str, Any] = {
        "final": lambda v: v[-1],
        "min": np.min,
        "max": np.max,
        "peak": lambda v: np.max(np.abs(v)),
        "mean": np.mean,
    }
    return float(simple[kind](values))
