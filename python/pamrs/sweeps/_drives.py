"""Drives of a sweep, which work out the numbers of a chunk of runs: the part that a worker needs.
All of it can be pickled.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of, refused
from pamrs.channels import dotted, unit_of
from pamrs.errors import ParameterError, RigError
from pamrs.rig import Rig, parse_rig
from pamrs.rig.schema import qualified
from pamrs.simulation import REDUCTIONS, core_rig, simulate_batch
from pamrs.sweeps._axes import INITIAL, Quantity, digest, quantity


class Metric(NamedTuple):
    """One number of each run.

    Attributes
    ----------
    reduction : str
        One of :data:`pamrs.simulation.REDUCTIONS`.
    channel : str
        For example ``joint_angle``.
    reference : float or tuple of float
        What the squared error is reckoned from, for all samples or one for each, in the channel's
        unit.
    """

    reduction: str
    channel: str
    reference: float | tuple[float, ...] = 0.0

    @property
    def unit(self) -> str:
        """SI unit of the number; ``rad2 s`` of a squared error of an angle."""
        unit = unit_of(self.channel)
        if self.reduction != "squared_error":
            return unit
        squared = [
            part.rstrip("0123456789") + str(2 * int(part.lstrip(part.rstrip("0123456789")) or 1))
            for part in unit.split("/")[0].split()
            if part != "1"
        ]
        below = [f"/{part}2" for part in unit.split("/")[1:]]
        return " ".join([*squared, "s"]) + "".join(below)

    def given(self) -> tuple[Any, ...]:
        """Metric in the form that ``simulate_batch`` takes."""
        if self.reduction != "squared_error":
            return self.reduction, self.channel
        varies = isinstance(self.reference, tuple)
        return self.reduction, self.channel, np.array(self.reference) if varies else self.reference


def metric_of(name: str, given: Any) -> Metric:
    """A metric from what the user wrote.

    Parameters
    ----------
    name : str
        Of the metric, for messages.
    given : tuple
        ``("final", "joint_angle")``, ``("squared_error", "joint_angle", 0.8)``.

    Returns
    -------
    Metric

    Raises
    ------
    ParameterError
        If it is neither; the message says what is allowed.
    """
    parts = tuple(given) if isinstance(given, (tuple, list)) else ()
    most = 3 if parts and parts[0] == "squared_error" else 2
    if not (2 <= len(parts) <= most and all(isinstance(word, str) for word in parts[:2])):
        raise refused(
            f"metrics[{name!r}]",
            given,
            "('final', 'joint_angle') or ('squared_error', 'joint_angle', reference) is needed",
        )
    one_of(f"the reduction of metrics[{name!r}]", parts[0], REDUCTIONS)
    if len(parts) == 2:
        return Metric(parts[0], parts[1])
    try:
        reference = np.array(parts[2], dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"metrics[{name!r}] has a reference that is not a number") from None
    if reference.ndim > 1 or not np.isfinite(reference).all():
        raise ParameterError(
            f"metrics[{name!r}] has a reference that is not allowed: a finite number, or one for "
            "each sample"
        )
    return Metric(
        parts[0], parts[1], tuple(reference.tolist()) if reference.ndim else float(reference)
    )


class Done(NamedTuple):
    """Result of a chunk.

    Attributes
    ----------
    metrics : dict of str to ndarray, shape (n,)
        SI; NaN for runs that ended.
    ended_at : ndarray, shape (n,)
        When a run ended [s]; NaN for those that reached the end.
    first : tuple of (int, str) or None
        Place in the chunk and message of the first run that ended.
    """

    metrics: dict[str, Array]
    ended_at: Array
    first: tuple[int, str] | None


class Drive(ABC):
    """Base of what drives the runs; a subclass works out a group of runs of one rig."""

    def quantity(self, rig: Rig, name: str) -> Quantity:
        """Unit and bounds of a number that varies; errors as of :func:`quantity`."""
        return quantity(rig, name)

    @abstractmethod
    def metric_units(self) -> dict[str, str]:
        """SI unit of each metric."""

    @abstractmethod
    def describe(self) -> dict[str, str]:
        """Entries of the plan that identify this drive: name -> digest or words."""

    @abstractmethod
    def run(self, rig: Rig, n: int, values: Mapping[str, Array], threads: int | None) -> Done:
        """Work out the numbers of n runs of one rig, with values that need no other rig."""

    @abstractmethod
    def rig_names(self, rig: Rig, names: Iterable[str]) -> list[str]:
        """Names, of those that vary, that need a rig of its own for each value."""


def failed_rows(status: tuple[Any, ...]) -> tuple[Array, tuple[int, str] | None]:
    """Time at which each row ended early [s], NaN for others, and the first with its message."""
    times = np.array([np.nan if ended is None else ended.time for ended in status])
    first = next(((k, ended.message) for k, ended in enumerate(status) if ended is not None), None)
    return times, first


@dataclass(frozen=True, eq=False)
class OpenLoop(Drive):
    """Commands over time, the same for all runs.

    Attributes
    ----------
    metrics : dict of str to Metric
    sample_time : float
        [s]
    step : float or None
        RK4 step [s].
    duration : float or None
        [s], where no signal has a length.
    signals : dict
        ``valve_command`` and so on as :func:`pamrs.simulate` takes them.
    initial : dict of str to float
    """

    metrics: dict[str, Metric]
    sample_time: float
    step: float | None = None
    duration: float | None = None
    signals: dict[str, Any] = field(default_factory=dict)
    initial: dict[str, float] = field(default_factory=dict)

    def metric_units(self) -> dict[str, str]:
        return {name: metric.unit for name, metric in self.metrics.items()}

    def describe(self) -> dict[str, str]:
        found = {name: repr(getattr(self, name)) for name in ("sample_time", "step", "duration")}
        found |= {name: _signal_words(signal) for name, signal in self.signals.items()}
        found |= {f"initial {name}": repr(value) for name, value in self.initial.items()}
        return found | {
            f"metric {name}": json.dumps(metric) for name, metric in self.metrics.items()
        }

    def rig_names(self, rig: Rig, names: Iterable[str]) -> list[str]:
        quick = {*core_rig(rig).parameter_names, *self._tanks(rig)}
        return [name for name in names if name not in quick and not name.startswith(INITIAL)]

    def _tanks(self, rig: Rig) -> dict[str, str]:
        """Names of the tanks' parameters ``initial_pressure`` -> their names as initial values."""
        tanks = [name for name, table in rig.tables("supply").items() if table["kind"] == "tank"]
        return {
            f"{qualified('supply', name)}.initial_pressure": start
            for name in tanks
            if (start := dotted("supply_pressure", name)) not in self.initial
        }

    def run(self, rig: Rig, n: int, values: Mapping[str, Array], threads: int | None) -> Done:
        tanks = self._tanks(rig)
        starts = {tanks[k]: v for k, v in values.items() if k in tanks}
        starts |= {k.removeprefix(INITIAL): v for k, v in values.items() if k.startswith(INITIAL)}
        numbers = {k: v for k, v in values.items() if not k.startswith(INITIAL) and k not in tanks}
        fixed = {name: np.full(n, value) for name, value in self.initial.items()}
        batch = simulate_batch(
            rig,
            n=n,
            sample_time=self.sample_time,
            step=self.step,
            duration=self.duration,
            initial=fixed | starts or None,
            parameters=numbers or None,
            reduce={name: metric.given() for name, metric in self.metrics.items()},
            threads=threads,
            **self.signals,
        )
        ended_at, first = failed_rows(batch.status)
        return Done({name: batch.reduced[name] for name in self.metrics}, ended_at, first)


def _signal_words(signal: Any) -> str:
    if isinstance(signal, Mapping):
        return "; ".join(f"{name}: {_signal_words(signal[name])}" for name in sorted(signal))
    if np.ndim(signal) == 0:
        return repr(signal)
    return f"{np.shape(signal)}, {digest(signal)}"


@dataclass(frozen=True, eq=False)
class Task:
    """One chunk for a worker.

    Attributes
    ----------
    rig : str
        TOML text.
    drive : Drive
    values : dict of str to ndarray, shape (n,)
        What varies.
    threads : int or None
        Most threads that work; None for one on each processor.
    """

    rig: str
    drive: Drive
    values: dict[str, Array]
    threads: int | None = 1


@lru_cache(maxsize=4)
def _read(text: str) -> Rig:
    rig = parse_rig(text)
    core_rig(rig)
    return rig


def run_chunk(task: Task) -> Done:
    """Work out a chunk; what a worker of an executor runs.

    Parameters
    ----------
    task : Task

    Returns
    -------
    Done
        Metrics of each run. A run whose rig is not possible has ended at 0 s.

    Raises
    ------
    ParameterError
        If an argument of the sweep is not allowed.
    """
    rig = _read(task.rig)
    n = len(next(iter(task.values.values())))
    own = task.drive.rig_names(rig, task.values)
    if not own:
        return task.drive.run(rig, n, task.values, task.threads)
    units = task.drive.metric_units()
    metrics = {name: np.full(n, np.nan) for name in units}
    ended_at = np.zeros(n)
    first: list[tuple[int, str]] = []
    table = np.stack([task.values[name] for name in own])
    groups, of_run = np.unique(table, axis=1, return_inverse=True)
    for k in range(groups.shape[1]):
        rows = np.flatnonzero(of_run.reshape(-1) == k)
        rest = {name: v[rows] for name, v in task.values.items() if name not in own}
        changed = dict(zip(own, groups[:, k].tolist(), strict=True))
        found = _run_other(task, rig, changed, rest, rows.size)
        for name in metrics:
            metrics[name][rows] = found.metrics[name]
        ended_at[rows] = found.ended_at
        first += [(int(rows[found.first[0]]), found.first[1])] if found.first else []
    return Done(metrics, ended_at, min(first, default=None))


def _run_other(
    task: Task, rig: Rig, changed: dict[str, float], rest: dict[str, Array], n: int
) -> Done:
    """Runs of a rig of other geometry; one that is not possible ends at once."""
    try:
        other = rig.with_parameters(changed)
        core_rig(other, core_rig(rig))
    except (RigError, ParameterError) as error:
        nothing = {name: np.full(n, np.nan) for name in task.drive.metric_units()}
        return Done(nothing, np.zeros(n), (0, " ".join(str(error).split())))
    return task.drive.run(other, n, rest, task.threads)
