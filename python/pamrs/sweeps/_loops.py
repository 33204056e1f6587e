"""Maps of gains: a controller closed around every run of a sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs import control
from pamrs._arrays import Array, ArrayLike
from pamrs._checks import check_kind, refused
from pamrs.control.trajectories import Trajectory
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import core_rig
from pamrs.sweeps._axes import INITIAL, Axes, Quantity, digest
from pamrs.sweeps._drives import Done, Drive, failed_rows
from pamrs.sweeps._sweep import run_plan

if TYPE_CHECKING:
    import xarray as xr

#: How the name of a gain begins: ``gain.kp``.
GAIN: Final = "gain."
_NO_RIG: Final = (GAIN, INITIAL)
#: Metric -> its SI unit.
_UNITS: Final = {
    "squared_error": "rad2 s",
    "curvature": "1",
    "rms": "rad",
    "largest": "rad",
    "final": "rad",
}


@dataclass(frozen=True, eq=False)
class SweptLoop(Drive):
    """A controller and what it follows.

    Attributes
    ----------
    controller : callable
        Makes the controller of all plants from arrays of gains by name.
    trajectory : Trajectory
    loop : dict
        Numbers for :func:`pamrs.control.sweep`: ``duration``, ``sample_time``, ``step``,
        ``initial``.
    by_length : bool
        Whether the length of a hanging mass is followed, instead of an angle.
    """

    controller: Callable[..., Any]
    trajectory: Trajectory
    loop: dict[str, Any] = field(default_factory=dict)
    by_length: bool = False

    def quantity(self, rig: Rig, name: str) -> Quantity:
        if name.startswith(GAIN):
            return Quantity(name, "1", -np.inf, np.inf)
        try:
            return super().quantity(rig, name)
        except ParameterError as error:
            if name.isidentifier():
                raise ParameterError(
                    f"{name!r}: a gain is called '{GAIN}{name}'; {error}"
                ) from None
            raise

    def metric_units(self) -> dict[str, str]:
        angle = "m" if self.by_length else "rad"
        return {name: unit.replace("rad", angle) for name, unit in _UNITS.items()}

    def describe(self) -> dict[str, str]:
        duration = self.loop.get("duration") or self.trajectory.duration
        wanted = self.trajectory(np.linspace(0.0, duration, 10_001))
        numbers = digest(np.stack([wanted.angle, wanted.rate]))
        return {
            "controller": _name_of(self.controller),
            "trajectory": f"{self.trajectory.name}, {numbers}",
        } | {f"loop {name}": repr(value) for name, value in sorted(self.loop.items())}

    def rig_names(self, rig: Rig, names: Iterable[str]) -> list[str]:
        quick = set(core_rig(rig).parameter_names) & set(rig.parameters)
        return [name for name in names if name not in quick and not name.startswith(_NO_RIG)]

    def run(self, rig: Rig, n: int, values: Mapping[str, Array], threads: int | None) -> Done:
        gains = {k.removeprefix(GAIN): v for k, v in values.items() if k.startswith(GAIN)}
        starts = {k.removeprefix(INITIAL): v for k, v in values.items() if k.startswith(INITIAL)}
        own = [k for k in values if not k.startswith(_NO_RIG)]
        table = np.array([values[name] for name in own]).reshape(len(own), n)
        rigs = [
            rig.with_parameters(dict(zip(own, column, strict=True))) if own else rig
            for column in table.T.tolist()
        ]
        loop = {**self.loop, "initial": {**self.loop.get("initial", {}), **starts} or None}
        found = control.sweep(
            rigs, self.controller(**gains), self.trajectory, threads=threads, **loop
        )
        ended_at, first = failed_rows(found.run.status)
        return Done({name: getattr(found, name) for name in _UNITS}, ended_at, first)


def _name_of(controller: Any) -> str:
    """Name of a controller, the same in every process."""
    if isinstance(controller, partial):
        fixed = [*map(repr, controller.args)]
        fixed += [f"{name}={value!r}" for name, value in sorted(controller.keywords.items())]
        return f"{_name_of(controller.func)}({', '.join(fixed)})"
    name = f"{getattr(controller, '__module__', '')}.{getattr(controller, '__qualname__', '')}"
    if not callable(controller) or "<" in name or name.startswith(".") or name.endswith("."):
        raise refused(
            "controller",
            controller,
            "a class, or a function of a module, that is called with gains by name and can be "
            "pickled (functools.partial fixes the others)",
        )
    return name


def gain_map(
    rig: Rig,
    controller: Callable[..., Any],
    over: Mapping[str, ArrayLike] | Sequence[str],
    trajectory: Trajectory,
    *,
    samples: ArrayLike | None = None,
    duration: float | None = None,
    sample_time: float | None = None,
    step: float | None = None,
    initial: Mapping[str, float] | None = None,
    store: str | os.PathLike[str] = "gains.zarr",
    **runs: Any,
) -> xr.Dataset:
    """A controller closed around a rig over gains, parameters and geometry, in a store.

    :func:`pamrs.control.tuning.gain_map` is the same for maps that are done in one go.

    Parameters
    ----------
    rig : Rig
        What is controlled.
    controller : callable
        Makes the controller of all plants from arrays of gains by name: a class such as
        ``control.PID``, or a function of a module, ``functools.partial`` for fixed gains.
    over, samples
        As for :func:`sweep`; a gain has the name ``gain.kp``.
    trajectory : Trajectory
        What the joint should do.
    duration, sample_time, step
        As for :func:`pamrs.control.sweep`.
    initial : mapping of str to float, optional
        Initial values of all runs.
    store, **runs
        As for :func:`sweep`: ``executor``, ``chunk``, ``threads``, ``in_flight``, ``progress``.

    Returns
    -------
    xarray.Dataset
        ``squared_error`` (nu, 4.15) [rad2 s], ``curvature`` (omega, 4.17), ``rms``, ``largest`` and
        ``final`` [rad], of a hanging mass [m2 s] and [m]; NaN where a run ended.

    Raises
    ------
    ParameterError, SimulationError, MissingPackageError
        As :func:`sweep`, and if the controller is not one that every process can find by its name.
    """
    _name_of(controller)
    check_kind("trajectory", trajectory, Trajectory, "one of pamrs.control.trajectories")
    given = {"duration": duration, "sample_time": sample_time, "step": step}
    loop: dict[str, Any] = {k: float(v) for k, v in given.items() if v is not None}
    loop |= {"initial": {k: float(v) for k, v in initial.items()}} if initial else {}
    hangs = any(load.get("kind", "mass") == "mass" for load in rig.tables("load").values())
    drive = SweptLoop(controller, trajectory, loop, by_length=hangs)
    return run_plan(rig, Axes.of(over, samples), drive, store=store, **runs)
