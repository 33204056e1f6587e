"""Many plants of one rig, side by side in the vector lanes of the processor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, check_column, one_of, plain, quantities, refused, whole
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation._batch import BatchRun, Failure
from pamrs.simulation._driving import by_signal, initial_values, inputs_of, prescribed
from pamrs.simulation._plants import plants_of, rowwise, thread_count
from pamrs.simulation._simulation import (
    MOST_NUMBERS,
    check_run,
    chosen_step,
    core_rig,
    names_of,
    rows_of,
)

#: What a run can be reduced to.
REDUCTIONS = ("final", "min", "max", "peak", "mean", "squared_error")
#: Reduction and channel, and for the squared error a reference.
Reduction = tuple[str, str] | tuple[str, str, ArrayLike]


@quantities
def simulate_batch(
    rig: Rig,
    valve_command: Any = None,
    *,
    sample_time: float,
    n: int | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    initial: Mapping[str, ArrayLike] | None = None,
    step: float | None = None,
    duration: float | None = None,
    supply_command: Any = None,
    length: ArrayLike | None = None,
    pressure: Any = None,
    supply_pressure: Any = None,
    record: Sequence[str] = (),
    every: int = 1,
    reduce: Mapping[str, Reduction] | None = None,
    threads: int | None = None,
) -> BatchRun:
    """Simulate many plants of one rig that differ in parameters, starts or commands.

    Each plant runs as with :func:`pamrs.simulate`. Rigs without effects whose arm is one link or a
    hanging mass run side by side in the vector lanes of the processor; their channels agree with
    :func:`pamrs.simulate` to about 1e-9 of their size. All others run one by one. Other
    plants of the batch, and the number of threads, change no bit of it.

    Parameters
    ----------
    rig : Rig
        The model of all plants.
    valve_command : array_like, shape (rows,) or (n, rows), or mapping of str to it, optional
        Commands [V] as of :func:`pamrs.simulate`, common ones or a line for each plant.
    sample_time : float
        Time between rows [s].
    n : int, optional
        Number of plants, where no array says it.
    parameters : mapping of str to float or array_like, shape (n,), optional
        Parameters of the rig by name in SI units, ``arm.payload``, with a value for each plant.
    initial : mapping of str to float or array_like, shape (n,), optional
        Initial values as of :func:`pamrs.simulate`.
    step : float, optional
        RK4 step [s] as of :func:`pamrs.simulate`; each plant takes the one that it needs.
    duration : float, optional
        Simulated time [s], where no signal has a length.
    supply_command : array_like, shape (rows,) or (n, rows), or mapping of str to it, optional
        Set pressures of regulators [Pa, gauge], in the same way.
    length : array_like, shape (rows,) or (n, rows), optional
        What a load frame prescribes [m], in the same way.
    pressure, supply_pressure : array_like, shape (rows,) or (n, rows), or mapping of str to it
        Pressures of chambers without a valve and of measured supplies [Pa, gauge], in the same way.
    record : sequence of str, optional
        Channels to be kept, nothing by default.
    every : int, optional
        Keep each ``every``-th row.
    reduce : mapping of str to (reduction, channel) or (reduction, channel, reference), optional
        Numbers of the whole run by a name of yours: ``("final", "joint_angle")``; reductions are
        ``final``, ``min``, ``max``, ``peak`` (largest magnitude), ``mean`` and ``squared_error``
        (time integral of the squared difference from ``reference``, a number or an array of shape
        (rows,), in the channel's unit). Energies are final values of the balance:
        ``("final", "energy_supplied")``. No trajectory is kept for them.
    threads : int, optional
        Most threads that work; by default one for each processor that this process may use.

    Returns
    -------
    BatchRun
        ``run["joint_angle"]`` of shape (n, kept rows), ``run.reduced["name"]`` of shape (n,),
        ``run.status``. A plant whose state leaves the range in which the model holds stays at its
        last good sample, and its reduced numbers are NaN.

    Raises
    ------
    ParameterError
        If an argument is not finite, outside its range or of another shape; the message names it.
    RigError
        If a parameter or channel is unknown, or a signal is missing.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> run = pamrs.simulate_batch(
    ...     pamrs.rigs.shoulder(), np.full(201, 6.0), sample_time=0.005,
    ...     parameters={"arm.payload": np.linspace(0.0, 20.0, 500)},
    ...     reduce={"end": ("final", "joint_angle")},
    ... )
    >>> run.reduced["end"].shape, bool(run.reduced["end"][0] > run.reduced["end"][-1])
    ((500,), True)
    """
    check_run(rig, sample_time)
    asked = by_signal(valve_command, supply_command, length, pressure, supply_pressure)
    given = inputs_of(rig).named(asked)
    signals = {name: _numbers(name, values) for name, values in given.items()}
    rows = _row_count(signals, duration, sample_time)
    starts = initial_values(dict.fromkeys(initial or {}, 0.0), rig)
    known = rig.parameters if parameters else {}
    plants = {
        name: plain(name, values, known[name].unit if name in known else "1")
        for name, values in (parameters or {}).items()
    }
    per_plant = {
        **{name: _numbers(name, values) for name, values in plants.items()},
        **{f"initial {name}": _numbers(name, (initial or {})[name]) for name in starts},
        **{name: values[:, 0] for name, values in signals.items() if values.ndim == 2},
    }
    count = plants_of(n, None, per_plant)
    reduced = dict(reduce or {})
    kept = -(-rows // whole("every", every, 1))
    wanted = names_of("record", record)
    if count * (kept * len(wanted) + len(reduced)) > MOST_NUMBERS:
        raise ParameterError(
            f"{count} plants with {kept} rows of {len(wanted)} channels are not allowed: at most "
            f"{MOST_NUMBERS} numbers (2 GB); raise every, or ask for numbers of whole runs "
            "(reduce)"
        )
    begin = {name: rowwise(f"initial {name}", (initial or {})[name], count) for name in starts}
    core = core_rig(rig)
    recorded, numbers, ended = _core.side_by_side(
        core,
        count,
        rows,
        prescribed(
            {n: np.full(rows, float(v)) if v.ndim == 0 else v for n, v in signals.items()},
            begin,
            count,
        ),
        sample_time,
        chosen_step(sample_time, step),
        _parameters(rig, plants, count),
        begin,
        wanted,
        every,
        [_reduction(name, asked, rows) for name, asked in reduced.items()],
        thread_count(threads),
    )
    return BatchRun(
        time=np.asarray(np.arange(kept) * every * sample_time, dtype=np.float64),
        channels=dict(zip(record, recorded, strict=True)),
        status=tuple(None if why is None else Failure(*why) for why in ended),
        reduced=dict(zip(reduced, numbers, strict=True)),
    )


def _parameters(rig: Rig, given: Mapping[str, ArrayLike], count: int) -> dict[str, Array]:
    """Parameters with a value for each plant, inside what a rig file may say."""
    found = {name: rowwise(name, values, count) for name, values in given.items()}
    known = rig.parameters if found else {}
    for name, values in found.items():
        if name in known:
            limits = known[name]
            check_column(name, values, limits.lower, limits.upper, limits.unit)
    return found


def _numbers(name: str, values: ArrayLike) -> Array:
    array = as_numbers(name, values, MOST_NUMBERS)
    if array.ndim > 2 or array.size == 0:
        raise ParameterError(
            f"{name} has the shape {array.shape}; (rows,) or (n, rows) is needed, of one value at "
            "least"
        )
    return array


def _row_count(signals: Mapping[str, Array], duration: float | None, sample_time: float) -> int:
    """Rows of time, from the signals or the duration."""
    sizes = {name: values.shape[-1] for name, values in signals.items() if values.ndim}
    if duration is not None:
        return rows_of(duration, sample_time, sizes)
    if not sizes:
        raise ParameterError(
            "duration is missing: a finite time >= 0 s is needed (or give valve_command an array)"
        )
    first, rows = next(iter(sizes.items()))
    for name, size in sizes.items():
        if size != rows:
            raise ParameterError(
                f"{name} has {size} values in time, {first} has {rows}; one number of rows is "
                "needed"
            )
    return int(rows)


def _reduction(name: str, asked: Reduction, rows: int) -> tuple[str, str, list[float]]:
    """A reduction as the core takes it: channel, kind and reference."""
    if isinstance(asked, str) or not isinstance(asked, Sequence) or len(asked) not in (2, 3):
        raise refused(
            f"reduce[{name!r}]",
            asked,
            '(reduction, channel) or ("squared_error", channel, reference) is needed',
        )
    kind, channel, *more = asked
    one_of(f"reduce[{name!r}]", kind, REDUCTIONS)
    if not more:
        return str(channel), str(kind), []
    if kind != "squared_error":
        raise ParameterError(f"reduce[{name!r}] has a reference, which only squared_error takes")
    reference = _numbers(f"reduce[{name!r}] reference", more[0])
    if reference.ndim == 0:
        reference = np.full(rows, float(reference))
    if reference.shape != (rows,) or not np.isfinite(reference).all():
        raise ParameterError(
            f"reduce[{name!r}] has a reference of shape {reference.shape}; a finite number or "
            f"({rows},) of them is needed"
        )
    return str(channel), str(kind), reference.tolist()
