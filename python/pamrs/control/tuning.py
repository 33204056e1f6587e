"""Gains by the combined metric J (4.18): whole grids at once, and a search by SciPy.

Every evaluation is a closed loop of :func:`pamrs.control.sweep`; a grid, over payloads too, is one
call of it, a generation of a search is another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import (
    as_column,
    checked_number,
    finite,
    one_of,
    positive,
    refused,
    rising,
    whole,
)
from pamrs._tables import Columns, Tabular
from pamrs._views import COLOURS, Panels, View, in_laboratory_units
from pamrs.control._groups import joints_of
from pamrs.control._protocol import Controller
from pamrs.control._sweeping import sweep
from pamrs.control.metrics import WEIGHTS, combined
from pamrs.control.trajectories import Trajectory
from pamrs.errors import ParameterError
from pamrs.rig import Rig, payload_of

__all__ = ["GainMap", "GainSearch", "gain_map", "search_gains"]

Factory = Callable[..., Controller]


@dataclass(frozen=True)
class GainMap(View, Tabular):
    """Metrics over a grid of gains, for each payload.

    Attributes
    ----------
    axes : mapping of str to ndarray
        Values of each gain, in the order of the dimensions behind the first.
    payloads : ndarray, shape (p,)
        [kg]
    squared_error, curvature : ndarray, shape (p, ...)
        nu and omega; NaN where a run failed.
    j : ndarray, shape (p, ...)
        J (4.18), each payload a set of its own; infinite where a run failed.
    rms : ndarray, shape (p, ...)
        Error [rad]; NaN where a run failed.
    unit : str
        Of the angle in nu and omega.
    """

    axes: Mapping[str, Array]
    payloads: Array
    squared_error: Array = field(repr=False)
    curvature: Array = field(repr=False)
    j: Array = field(repr=False)
    rms: Array = field(repr=False)
    unit: str = "rad"

    def _columns(self) -> Columns:
        axes = {"payload": self.payloads, **self.axes}
        names = ("j", "squared_error", "curvature", "rms")
        values = {name: (tuple(axes), getattr(self, name)) for name in names}
        return Columns(axes, values, {"payload": "kg", "j": "1", "rms": "rad"})

    def _panels(self) -> Panels:
        return {
            f"{mass:g} kg": partial(self._draw, number=p) for p, mass in enumerate(self.payloads)
        }

    def _draw(self, axes: Any, number: int) -> None:
        """J over the first two gains, the smallest of all others."""
        names, values = list(self.axes), np.where(np.isfinite(self.j), self.j, np.nan)[number]
        values = np.fmin.reduce(values, axis=tuple(range(2, values.ndim))) if names[2:] else values
        grid = [self.axes[name] for name in names[:2]]
        row = self.best()[number]
        axes.set_title(f"J with {self.payloads[number]:g} kg", fontsize="medium")
        axes.set_xlabel(names[0])
        if len(grid) == 1:
            axes.plot(grid[0], values, "o-", color=COLOURS[0], ms=3)
            axes.set_ylabel("J [1]")
        else:
            mesh = axes.pcolormesh(*grid, values.T, shading="nearest")
            axes.figure.colorbar(mesh, ax=axes, label="J [1]")
            axes.set_ylabel(names[1])
        axes.plot(row[names[0]], row[names[1]] if grid[1:] else row["j"], "x", color=COLOURS[1])

    def _numbers(self) -> dict[str, str]:
        numbers = {}
        for row in self.best():
            gains = ", ".join(f"{name} = {row[name]:.4g}" for name in self.axes)
            error = in_laboratory_units("joint_angle", row["rms"])
            numbers[f"best with {row['payload']:g} kg"] = f"{gains}: J {row['j']:.4g}, rms {error}"
        edges = {name: (axis[0], axis[-1]) for name, axis in self.axes.items() if len(axis) > 1}
        border = {n for row in self.best() for n, ends in edges.items() if row[n] in ends}
        return numbers | ({"on the border of the map": ", ".join(sorted(border))} if border else {})

    def best(self, by: str = "j") -> list[dict[str, float]]:
        """The gains with the smallest metric, payload by payload.

        Parameters
        ----------
        by : {"j", "squared_error", "curvature", "rms"}
            Which one.

        Returns
        -------
        list of dict of str to float
            ``payload`` [kg], each gain, and ``j``, ``squared_error``, ``curvature`` and ``rms``
            there.

        Raises
        ------
        ParameterError
            If there is no such metric.
        """
        metrics = ("j", "squared_error", "curvature", "rms")
        one_of("by", by, metrics)
        found = []
        for p, mass in enumerate(self.payloads):
            values = getattr(self, by)[p]
            index = np.unravel_index(
                int(np.argmin(np.where(np.isnan(values), np.inf, values))), values.shape
            )
            row = {"payload": float(mass)}
            row |= {
                name: float(axis[i])
                for (name, axis), i in zip(self.axes.items(), index, strict=True)
            }
            row |= {name: float(getattr(self, name)[(p, *index)]) for name in metrics}
            found.append(row)
        return found

    @property
    def scale(self) -> Array:
        """min(nu) and min(omega) of each payload, shape (p, 2): what J divides by, to compare a
        search with the map.
        """
        ok = np.isfinite(self.squared_error) & np.isfinite(self.curvature)
        axes = tuple(range(1, ok.ndim))
        return np.stack(
            [np.where(ok, m, np.inf).min(axis=axes) for m in (self.squared_error, self.curvature)],
            axis=1,
        )


@dataclass(frozen=True)
class GainSearch:
    """Result of a search for gains.

    Attributes
    ----------
    gains : dict of str to float
        The best ones.
    j : float
        J of them, by ``scale``.
    scale : (float, float)
        nu and omega that J divides by.
    tried : ndarray, shape (loops, gains)
        Every point in the order it was tried, the start first.
    values : ndarray, shape (loops,)
        J of each; infinite where a run failed.
    """

    gains: dict[str, float]
    j: float
    scale: tuple[float, float]
    tried: Array = field(repr=False)
    values: Array = field(repr=False)


def gain_map(
    plant: Rig,
    controller: Factory,
    axes: Mapping[str, Sequence[float]],
    trajectory: Trajectory,
    *,
    payloads: Sequence[float] | None = None,
    weights: tuple[float, float] = WEIGHTS,
    unit: str = "rad",
    **loop: Any,
) -> GainMap:
    """Nu, omega and J over every combination of gains and payloads, in one batch.

    Nu is the integral of the squared error of the angle, omega the curvature of its path, and
    ``J = w1 nu/min(nu) + w2 omega/min(omega)``, (4.18), with the smallest of each payload's map and
    ``weights`` (w1, w2). The result has them as ``squared_error``, ``curvature`` and ``j``.

    Parameters
    ----------
    plant : Rig
        What is controlled; the model that the controller has may be another.
    controller : callable
        Makes the controller of all plants from arrays of gains by name:
        ``lambda kp, ki: PID(kp, ki)``.
    axes : mapping of str to sequence of float
        Values of each gain.
    trajectory : Trajectory
    payloads : sequence of float, optional
        ``arm.payload`` [kg], that of the last link, or the mass that hangs; the plant's own by
        default. The controller knows none of them.
    weights : (float, float)
        Of (4.18).
    unit : {"rad", "deg"}
        Of the angle in nu and omega.
    **loop
        As for :func:`pamrs.control.sweep`: ``duration``, ``sample_time``, ``sensors``, ``initial``
        of numbers, ``threads``.

    Returns
    -------
    GainMap

    Raises
    ------
    ParameterError
        As :func:`pamrs.control.sweep`, if an axis is empty, or every run of a payload failed.

    Examples
    --------
    >>> import pamrs
    >>> from pamrs.control import PID, trajectories
    >>> lift = trajectories.lift_hold_return(*trajectories.degrees(20, 60))
    >>> gains = {"kp": [0.5, 1.0, 1.5], "ki": [8.0, 10.0, 12.0]}
    >>> (best,) = gain_map(pamrs.rigs.shoulder(), PID, gains, lift).best("rms")
    >>> best["kp"], best["ki"], round(best["rms"], 3)  # inside the map, not on its border
    (1.0, 10.0, 0.052)
    """
    grid = {name: as_column(f"axes {name}", values) for name, values in axes.items()}
    if not grid:
        raise ParameterError("axes is empty: values of one gain at least are needed")
    for name, values in grid.items():
        for value in values:
            finite(f"axes {name}", value)
    joints_of(plant)  # a rig that lifts nothing is refused
    payload = payload_of(plant)
    given = [plant.parameter(payload).value] if payloads is None else payloads
    masses = as_column("payloads", given)
    shape = (masses.size, *(values.size for values in grid.values()))
    points = np.meshgrid(*grid.values(), indexing="ij")
    gains = {
        name: np.tile(values.ravel(), masses.size)
        for name, values in zip(grid, points, strict=True)
    }
    loaded = [
        plant if payloads is None else plant.with_parameters({payload: float(mass)})
        for mass in masses
    ]
    rigs = [rig for rig in loaded for _ in range(points[0].size)]
    done = sweep(rigs, controller(**gains), trajectory, unit=unit, **loop)
    nu, omega = done.squared_error.reshape(shape), done.curvature.reshape(shape)
    j = combined(nu, omega, weights=weights, axis=tuple(range(1, len(shape))))
    return GainMap(grid, masses, nu, omega, j, done.rms.reshape(shape), unit)


def search_gains(
    plant: Rig,
    controller: Factory,
    bounds: Mapping[str, tuple[float, float]],
    trajectory: Trajectory,
    *,
    start: Mapping[str, float] | None = None,
    scale: tuple[float, float] | None = None,
    generations: int = 12,
    population: int = 16,
    seed: int = 0,
    weights: tuple[float, float] = WEIGHTS,
    unit: str = "rad",
    **loop: Any,
) -> GainSearch:
    """The gains with the smallest J by ``scipy.optimize.differential_evolution``, a population in
    one batch.

    Parameters
    ----------
    plant, controller, trajectory, weights, unit, **loop
        As for :func:`gain_map`.
    bounds : mapping of str to (float, float)
        Lowest and highest value of each gain.
    start : mapping of str to float, optional
        One value of each gain within its bounds, for example the gains of a row of
        :meth:`GainMap.best`; the middle of the bounds by default. It is tried first, so that the
        result is never worse.
    scale : (float, float), optional
        nu and omega that J divides by, for example a row of :attr:`GainMap.scale`; those of the
        start by default.
    generations, population : int
        ``generations`` populations of closed loops are tried, besides the start.
    seed : int
        The same seed gives the same result.

    Returns
    -------
    GainSearch

    Raises
    ------
    ParameterError
        If an argument is not allowed, every run fails, or the start fails and there is no scale.
    """
    from scipy.optimize import Bounds, differential_evolution

    low, high, begin = _box(bounds, start)
    whole("generations", generations, 1)
    whole("population", population, 5)
    sizes = None if scale is None else [positive("scale", size) for size in scale]
    rng = np.random.default_rng(whole("seed", seed))
    tried: list[Array] = []
    metrics: list[Array] = []

    def run(columns: Array, /) -> Array:
        gains = dict(zip(bounds, np.ascontiguousarray(columns), strict=True))
        plants = [plant] * columns.shape[1]
        done = sweep(plants, controller(**gains), trajectory, unit=unit, **loop)
        tried.append(columns.T)
        metrics.append(np.array([done.squared_error, done.curvature]))
        return metrics[-1]

    first = run(begin[:, None])[:, 0]
    by = np.array(sizes or [positive("nu or omega of the start", size) for size in first.tolist()])

    def j_of(pairs: Array) -> Array:
        found = np.asarray(weights) @ (pairs / by[:, None])
        return np.where(np.isfinite(found), found, np.inf)

    def cost(columns: Array, /, *_: Any, **__: Any) -> Any:
        return j_of(run(columns))

    members = rng.uniform(low, high, (population, low.size))
    members[0] = begin
    try:
        differential_evolution(
            cost,
            Bounds(low, high),
            init=members,
            maxiter=generations - 1,
            tol=0.0,
            atol=-1.0,  # never converged: the generations decide
            polish=False,
            vectorized=True,
            updating="deferred",
            rng=rng,
        )
    except RuntimeError as error:  # SciPy's, for what a controller refused
        raise error.__cause__ or error from None
    values, points = j_of(np.concatenate(metrics, axis=1)), np.concatenate(tried)
    best = int(np.argmin(values))
    if np.isinf(values[best]):
        raise ParameterError("every run failed: there is nothing to compare; narrow the bounds")
    gains = dict(zip(bounds, points[best].tolist(), strict=True))
    return GainSearch(gains, float(values[best]), (float(by[0]), float(by[1])), points, values)


def _box(
    bounds: Mapping[str, tuple[float, float]], start: Mapping[str, float] | None
) -> tuple[Array, Array, Array]:
    """Lowest and highest gains, and the start, in the order of the bounds."""
    if not bounds:
        raise ParameterError("bounds is empty: one gain at least is needed")
    pairs = [rising(f"bounds of {name}", ends) for name, ends in bounds.items()]
    low, high = np.array(pairs, dtype=np.float64).T.copy()
    if start is None:
        return low, high, 0.5 * (low + high)
    if not isinstance(start, Mapping) or set(start) != set(bounds):
        raise refused("start", start, f"one value each of {', '.join(bounds)} is needed")
    begin = [checked_number(f"start of {n}", start[n], *ends) for n, ends in bounds.items()]
    return low, high, np.array(begin)
