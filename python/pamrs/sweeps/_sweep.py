"""Runs of one rig with other parameters, by the million: chunks that are kept as they are done."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from pamrs._checks import as_numbers, check_kind, finite, misshapen, quantities, whole
from pamrs.errors import ParameterError
from pamrs.rig import Rig, check_sample_time
from pamrs.sweeps._axes import INITIAL, Axes
from pamrs.sweeps._drives import Drive, OpenLoop, metric_of, run_chunk
from pamrs.sweeps._plan import SweepPlan
from pamrs.sweeps._running import Progress, executor_of, in_flight_of, run_missing
from pamrs.sweeps._store import ENDED_AT, Store, open_sweep

if TYPE_CHECKING:
    import xarray as xr


@quantities
def sweep(
    rig: Rig,
    over: Mapping[str, ArrayLike] | Sequence[str],
    metrics: Mapping[str, tuple[Any, ...]],
    *,
    samples: ArrayLike | None = None,
    sample_time: float,
    valve_command: ArrayLike | Mapping[str, ArrayLike] | None = None,
    supply_command: ArrayLike | Mapping[str, ArrayLike] | None = None,
    length: ArrayLike | None = None,
    pressure: ArrayLike | Mapping[str, ArrayLike] | None = None,
    supply_pressure: ArrayLike | Mapping[str, ArrayLike] | None = None,
    initial: Mapping[str, float] | None = None,
    duration: float | None = None,
    step: float | None = None,
    store: str | os.PathLike[str] = "out.zarr",
    executor: Any = None,
    chunk: int | None = None,
    threads: int | None = None,
    in_flight: int | None = None,
    progress: bool | Callable[[str], object] = True,
) -> xr.Dataset:
    """Run a rig over a grid or over samples of its parameters, and keep a few numbers of each run.

    The runs are cut into chunks. A chunk that is done is kept in the store, whatever happens then:
    the same call goes on where the last one ended, also after ``kill -9``. A run that leaves the
    range in which the model holds has ended: its metrics are NaN, and it is counted.

    Parameters
    ----------
    rig : Rig
        The model.
    over : mapping of str to array_like, shape (k,), or sequence of str
        A grid: name -> values [SI], all combinations. Names are parameters of the rig
        (``arm.payload``) and of its effects (``leak_muscle.conductance``), and initial values
        (``initial.joint_angle``). With ``samples`` the names of their columns. Parameters of which
        the wiring depends (lengths of joints and muscles, stops, gas) need a rig of their own for
        each value, which takes longer.
    metrics : mapping of str to tuple
        Name -> ``(reduction, channel)`` with the reductions ``final``, ``min``, ``max``, ``peak``
        (the largest magnitude) and ``mean``, or ``("squared_error", channel, reference)``, the time
        integral of the squared difference from a number or from one for each sample.
    samples : array_like, shape (runs, len(over)), optional
        Values [SI], a run in each row: what a sampler of SALib or ``scipy.stats.qmc`` gives.
    sample_time : float
        Time between samples [s].
    valve_command, supply_command, length, pressure, supply_pressure
        As for :func:`pamrs.simulate`, with one value for each sample, the same for all runs; with
        ``duration`` a number that stays.
    initial : mapping of str to float, optional
        Initial values of all runs, as for :func:`pamrs.simulate`.
    duration : float, optional
        Simulated time [s], where no signal has a length.
    step : float, optional
        RK4 step [s], as for :func:`pamrs.simulate`.
    store : path-like
        Folder of the result, a Zarr group. One that is there must be of the same sweep.
    executor : concurrent.futures.Executor or dask.distributed.Client, optional
        Where chunks are worked out; by default in this process on ``threads`` threads.
    chunk : int, optional
        Runs of a chunk at most; by default some 64 chunks, of 1024 to 65 536 runs.
    threads : int, optional
        Most threads of one chunk; by default one for each processor in this process, 1 with an
        executor.
    in_flight : int, optional
        Chunks that an executor has at once; by default two for each worker.
    progress : bool or callable
        Whether to write to stderr how far it is; or what is called with each line, whose ``share``
        (0 to 1) and ``left`` [s] say how much is done and how long it will go on.

    Returns
    -------
    xarray.Dataset
        As of :func:`pamrs.sweeps.open_sweep`: read from the store when it is needed.

    Raises
    ------
    ParameterError
        If an argument is unknown or outside its range, or the store is that of another sweep; the
        message names it.
    SimulationError
        If an executor lost its workers; what is done is kept.
    MissingPackageError
        If zarr or xarray is not installed.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> grid = {"arm.payload": [2.0, 9.0], "initial.joint_angle": [0.4, 0.6, 0.8]}
    >>> metrics = {"end": ("final", "joint_angle"), "most": ("max", "muscle_pressure")}
    >>> map_ = pamrs.sweep(pamrs.rigs.shoulder(), grid, metrics, sample_time=0.005,
    ...                    valve_command=np.full(21, 6.0), store="map.zarr", progress=False)
    >>> dict(map_["end"].sizes), map_["end"].attrs["units"], map_.attrs["runs_ended"]
    ({'arm.payload': 2, 'initial.joint_angle': 3}, 'rad', 0)
    """
    if not isinstance(metrics, Mapping) or not metrics:
        raise ParameterError("metrics is empty; {'end': ('final', 'joint_angle')} is one")
    signals = {
        "valve_command": valve_command,
        "supply_command": supply_command,
        "length": length,
        "pressure": pressure,
        "supply_pressure": supply_pressure,
    }
    drive = OpenLoop(
        {str(name): metric_of(name, given) for name, given in metrics.items()},
        check_sample_time(rig, sample_time, inside=2),
        None if step is None else finite("step", step),
        None if duration is None else finite("duration", duration),
        {name: _signal(name, given) for name, given in signals.items() if given is not None},
        {name: finite(f"initial {name}", value) for name, value in (initial or {}).items()},
    )
    return run_plan(
        rig,
        Axes.of(over, samples),
        drive,
        store=store,
        executor=executor,
        chunk=chunk,
        threads=threads,
        in_flight=in_flight,
        progress=progress,
    )


def _signal(name: str, given: Any) -> Any:
    if isinstance(given, Mapping):
        return {key: _signal(f"{name}.{key}", values) for key, values in given.items()}
    signal = as_numbers(name, given).copy()
    if signal.ndim > 1 or signal.size == 0:
        raise misshapen(name, signal.shape, each="one value for each sample, the same for all runs")
    return signal if signal.ndim else float(signal)


def run_plan(
    rig: Rig,
    axes: Axes,
    drive: Drive,
    *,
    store: str | os.PathLike[str],
    executor: Any = None,
    chunk: int | None = None,
    threads: int | None = None,
    in_flight: int | None = None,
    progress: bool | Callable[[str], object] = True,
) -> xr.Dataset:
    """Run what a drive says over axes; other arguments, result and errors as of :func:`sweep`."""
    check_kind("rig", rig, Rig, "a Rig (pamrs.rigs.shoulder(), pamrs.load_rig(path))")
    axes.check(lambda name: drive.quantity(rig, name))
    _check_names(axes, drive)
    if chunk is not None:
        whole("chunk", chunk, 1)
    if threads is not None:
        whole("threads", threads, 1, 256)
    workers = executor_of(executor)
    most = in_flight_of(workers) if in_flight is None else whole("in_flight", in_flight, 1)
    if workers is not None and threads is None:
        threads = 1
    plan = SweepPlan.of(rig, axes, drive, chunk)
    first = plan.task(0, 1)  # tried before there is a store, for arguments that are not allowed
    run_chunk(replace(first, values={name: own[:1] for name, own in first.values.items()}))
    with Store(store, plan, rig) as kept:
        entries = kept.entries.values()
        shown = Progress(
            str(kept.path),
            runs=len(axes),
            chunks=len(plan.blocks),
            done=sum(entry.runs for entry in entries),
            ended=sum(entry.ended for entry in entries),
            chunks_done=len(entries),
            shown=progress,
        )
        run_missing(kept, workers, shown, threads=threads, most=most)
    return open_sweep(store)


def _check_names(axes: Axes, drive: Drive) -> None:
    taken = {*axes.names, *axes.dims, ENDED_AT}
    for name in drive.metric_units():
        if name in taken or not name or name.startswith((".", "__")) or "/" in name:
            raise ParameterError(
                f"metrics has the name {name!r}, which is not allowed: a name without '/' that is "
                f"none of {', '.join(sorted(taken))}"
            )
    for name in drive.initial if isinstance(drive, OpenLoop) else ():
        if INITIAL + name in axes.names:
            raise ParameterError(f"initial has {name!r}, which varies; leave it out")
