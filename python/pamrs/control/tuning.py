"""Gains by the combined metric J (4.18): whole grids at once, and the same J by CMA-ES or Optuna;
on plants that the model is not.

Every evaluation is a closed loop of :func:`pamrs.control.sweep`; a grid, over payloads too, is one
call of it, a generation of a search is another.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
from pamrs.errors import ParameterError, missing_package
from pamrs.rig import Rig, payload_of

__all__ = ["METHODS", "GainMap", "GainSearch", "gain_map", "perturbed", "search_gains"]

Array = NDArray[np.float64]
Factory = Callable[..., Controller]

#: CMA-ES, and the tree-structured Parzen estimator of Optuna.
METHODS: Final = ("cma", "optuna")
#: What a run that failed counts as, in a search that needs a number.
_FAILED: Final = 1e3


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
        told = {}
        for row in self.best():
            gains = ", ".join(f"{name} = {row[name]:.4g}" for name in self.axes)
            error = in_laboratory_units("joint_angle", row["rms"])
            told[f"best with {row['payload']:g} kg"] = f"{gains}: J {row['j']:.4g}, rms {error}"
        edges = {name: (axis[0], axis[-1]) for name, axis in self.axes.items() if len(axis) > 1}
        border = {n for row in self.best() for n, ends in edges.items() if row[n] in ends}
        return told | ({"on the border of the map": ", ".join(sorted(border))} if border else {})

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
    """What a search found.

    Attributes
    ----------
    gains : dict of str to float
        The best ones.
    j : float
        J of them, by ``scale``.
    scale : (float, float)
        nu and omega that J divides by.
    tried : ndarray, shape (evaluations, gains)
        Every point in the order it was evaluated.
    values : ndarray, shape (evaluations,)
        J of each; infinite where a run failed.
    squared_error, curvature : ndarray, shape (evaluations,)
    method : str
    seed : int
    """

    gains: dict[str, float]
    j: float
    scale: tuple[float, float]
    tried: Array = field(repr=False)
    values: Array = field(repr=False)
    squared_error: Array = field(repr=False)
    curvature: Array = field(repr=False)
    method: str = "cma"
    seed: int = 0


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
        What is controlled; the model that the controller has may be another, see :func:`perturbed`.
    controller : callable
        Makes the controller of all plants from arrays of gains by name:
        ``lambda kp, ki: PID(kp, ki)``.
    axes : mapping of str to sequence of float
        Values of each gain.
    trajectory : Trajectory
    payloads : sequence of float, optional
        ``arm.payload`` [kg], that of the last link, or the mass that hangs; the plant's own by
        default. The controller is told none of them.
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
    method: str = "cma",
    evaluations: int = 200,
    population: int = 16,
    seed: int = 0,
    start: Mapping[str, float] | None = None,
    scale: tuple[float, float] | None = None,
    weights: tuple[float, float] = WEIGHTS,
    unit: str = "rad",
    **loop: Any,
) -> GainSearch:
    """The gains with the smallest J by a search, a population at a time.

    J divides by the smallest nu and omega of a set of runs, which a search does not know
    beforehand: it takes ``scale``, for example a row of :attr:`GainMap.scale`, or else the smallest
    ones of a first population of random gains, which counts as evaluations.

    A search of few evaluations may end worse than a map or a guess that is at hand already: given
    as ``start``, it is one of the runs.

    Parameters
    ----------
    plant, controller, trajectory, weights, unit, **loop
        As for :func:`gain_map`.
    bounds : mapping of str to (float, float)
        Lowest and highest value of each gain.
    method : {"cma", "optuna"}
        CMA-ES, or Optuna's tree-structured Parzen estimator.
    evaluations : int
        Most closed loops, the first population too; without a scale two populations at least.
        CMA-ES leaves a rest that is no whole population.
    population : int
        Loops in one batch.
    seed : int
        The same seed gives the same result; the random numbers of the caller stay as they are.
    start : mapping of str to float, optional
        One value of each gain, within its bounds, for example the gains of a row of
        :meth:`GainMap.best`. The search begins there: its first evaluation, after the population
        that finds a scale, is the start itself, so that the result is never worse. By default
        CMA-ES begins in the middle of the bounds, Optuna anywhere.
    scale : (float, float), optional
        nu and omega that J divides by.

    Returns
    -------
    GainSearch

    Raises
    ------
    ParameterError
        If an argument is not allowed, or every run failed.
    MissingPackageError
        If cma or optuna is not installed.
    """
    low, high = _box(bounds)
    given = None if start is None else _within(start, bounds)
    _check_search(method, evaluations, population, seed, scale)
    loops = _Loops(
        plant, controller, trajectory, {**loop, "unit": unit}, tuple(bounds), low, high, given
    )
    rng = np.random.default_rng(seed)
    by = _first_scale(loops, rng.random((population, low.size))) if scale is None else scale

    def objective(points: Array) -> Array:
        nu, omega = loops.run(points)
        value = weights[0] * nu / by[0] + weights[1] * omega / by[1]
        return np.where(np.isfinite(value), np.minimum(value, _FAILED), _FAILED)

    left = evaluations - sum(map(len, loops.tried))
    searched = _cma if method == "cma" else _optuna
    searched(objective, low.size, left, population, rng, loops.begin)
    nu, omega = (np.concatenate([pair[k] for pair in loops.metrics]) for k in range(2))
    values = weights[0] * nu / by[0] + weights[1] * omega / by[1]
    values = np.where(np.isfinite(values), values, np.inf)
    points = np.concatenate(loops.tried)
    best = int(np.argmin(values))
    if math.isinf(values[best]):
        raise ParameterError("every run failed: there is nothing to compare; narrow the bounds")
    gains = {name: float(points[best, k]) for k, name in enumerate(bounds)}
    return GainSearch(gains, float(values[best]), by, points, values, nu, omega, method, seed)


def _check_search(
    method: str, evaluations: int, population: int, seed: int, scale: tuple[float, float] | None
) -> None:
    """Refuse the arguments of a search that cannot be.

    Raises
    ------
    ParameterError
        Which argument, its value and what is allowed.
    """
    one_of("method", method, METHODS)
    whole("population", population, 4, evaluations)
    if scale is None and evaluations < 2 * population:
        needed = f"without a scale two populations = {2 * population} are needed"
        raise refused("evaluations", evaluations, f"{needed}, as the first finds it")
    whole("seed", seed, 0, 2**32 - 1)
    for size in scale or ():
        positive("scale", size)


@dataclass
class _Loops:
    """Closed loops of points of the unit cube between the lowest and highest gains; every one is
    kept.

    ``given`` are the gains of the start. ``tried`` holds the gains of each batch, ``metrics`` its
    nu and omega.
    """

    plant: Rig
    controller: Factory
    trajectory: Trajectory
    settings: dict[str, Any]
    names: tuple[str, ...]
    low: Array
    high: Array
    given: Array | None
    tried: list[Array] = field(default_factory=list)
    metrics: list[tuple[Array, Array]] = field(default_factory=list)

    @property
    def begin(self) -> Array | None:
        """The start in the unit cube."""
        return None if self.given is None else (self.given - self.low) / (self.high - self.low)

    def run(self, points: Array) -> tuple[Array, Array]:
        """Nu and omega of points in the unit cube, in one batch."""
        gains = self.low + points * (self.high - self.low)
        if self.begin is not None and self.given is not None:
            gains[np.all(points == self.begin, axis=1)] = self.given  # to the last bit
        named = {name: np.ascontiguousarray(gains[:, k]) for k, name in enumerate(self.names)}
        plants = [self.plant] * len(gains)
        done = sweep(plants, self.controller(**named), self.trajectory, **self.settings)
        self.tried.append(gains)
        self.metrics.append((done.squared_error, done.curvature))
        return self.metrics[-1]


def _first_scale(loops: _Loops, points: Array) -> tuple[float, float]:
    """The smallest nu and omega of a first population.

    Raises
    ------
    ParameterError
        If every run failed.
    """
    nu, omega = loops.run(points)
    ok = np.isfinite(nu) & np.isfinite(omega)
    if not ok.any():
        raise ParameterError(
            "every run of the first population failed: there is nothing to compare; narrow the "
            "bounds"
        )
    return float(nu[ok].min()), float(omega[ok].min())


def perturbed(
    rig: Rig,
    seed: int | None = None,
    *,
    spread: float = 0.05,
    force: float | None = None,
    friction: float | None = None,
    inertia: float | None = None,
) -> Rig:
    """A plant that the controller's model is not quite: muscle force, friction and arm inertia off
    by a few per cent, as in 4.4.2.

    Parameters
    ----------
    rig : Rig
        The controller's model, with an arm and a tendon-driven muscle with a diameter.
    seed : int, optional
        Factors that are not given are ``1 +- spread * (0.5 to 1)``, so that each is really off;
        without a seed they are one.
    spread : float
        From 0 to 0.5.
    force : float, optional
        Factor on the muscles' cross-section, and so on what pressure pulls with; their volume goes
        with it. The bladder's elastic force, a smaller part, keeps its modulus.
    friction : float, optional
        On the arm's viscous and Coulomb friction.
    inertia : float, optional
        On the arm's inertia; the payload is known.

    Returns
    -------
    Rig

    Raises
    ------
    ParameterError
        If a factor is not above zero, the spread is not allowed, or the rig has no such parameters.

    Examples
    --------
    >>> import pamrs
    >>> plant = perturbed(pamrs.rigs.shoulder(), friction=1.1)
    >>> round(plant.parameter("arm.viscous").value, 6)
    3.3
    """
    checked_number("spread", spread, 0.0, 0.5)
    chosen = [1.0, 1.0, 1.0]
    if seed is not None:
        rng = np.random.default_rng(whole("seed", seed))
        chosen = (1.0 + spread * rng.choice([-1.0, 1.0], 3) * rng.uniform(0.5, 1.0, 3)).tolist()
    given = {"force": force, "friction": friction, "inertia": inertia}
    factors = {
        name: positive(name, drawn if own is None else own)
        for (name, own), drawn in zip(given.items(), chosen, strict=True)
    }
    names = {"muscle.rest_diameter": math.sqrt(factors["force"]), "arm.inertia": factors["inertia"]}
    names |= {"arm.viscous": factors["friction"], "arm.coulomb": factors["friction"]}
    return rig.with_parameters(
        {
            name: factor * rig.parameter(name).value
            for name, factor in names.items()
            if factor != 1.0
        }
    )


def _box(bounds: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    if not bounds:
        raise ParameterError("bounds is empty: one gain at least is needed")
    pairs = [rising(f"bounds of {name}", ends) for name, ends in bounds.items()]
    low, high = np.array(pairs, dtype=np.float64).T.copy()
    return low, high


def _within(start: Mapping[str, float], bounds: Mapping[str, tuple[float, float]]) -> Array:
    """A start in the order of the bounds, checked."""
    if not isinstance(start, Mapping) or set(start) != set(bounds):
        raise refused(
            "start", start, f"one value each of {', '.join(bounds)} is needed, as in bounds"
        )
    for name, (low, high) in bounds.items():
        checked_number(f"start of {name}", start[name], low, high)
    return np.array([start[name] for name in bounds], dtype=np.float64)


def _cma(
    objective: Callable[[Array], Array],
    size: int,
    budget: int,
    population: int,
    rng: np.random.Generator,
    begin: Array | None,
) -> None:
    """CMA-ES from a start or the middle, and from random places when it has converged, until the
    budget is spent.
    """
    try:
        import cma  # type: ignore[import-untyped]
    except ImportError as error:
        raise missing_package(error, "search") from error
    if size == 1:
        raise ParameterError(
            "bounds has one gain; CMA-ES needs two at least: take optuna, or a gain_map"
        )
    # its own random numbers: numpy's global ones stay as they are
    options = {
        "bounds": [0.0, 1.0],
        "verbose": -9,
        "seed": np.nan,
        "randn": lambda *shape: rng.standard_normal(shape),
    }
    start, given = (np.full(size, 0.5), None) if begin is None else (begin, begin)
    while budget >= population:
        strategy = cma.CMAEvolutionStrategy(start, 0.3, {**options, "popsize": population})
        while budget >= population and not strategy.stop():
            points = strategy.ask()
            if given is not None:
                points[0], given = given, None  # CMA-ES itself never tries where it begins
            strategy.tell(points, objective(np.asarray(points, dtype=np.float64)).tolist())
            budget -= population
        start = rng.random(size)


def _optuna(
    objective: Callable[[Array], Array],
    size: int,
    budget: int,
    population: int,
    rng: np.random.Generator,
    begin: Array | None,
) -> None:
    """Optuna's Parzen estimator, from a start if there is one, a population at a time (points that
    wait count as bad ones).
    """
    try:
        import optuna
    except ImportError as error:
        raise missing_package(error, "search") from error
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        with warnings.catch_warnings():
            # of constant_liar
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            sampler = optuna.samplers.TPESampler(seed=int(rng.integers(2**31)), constant_liar=True)
        study = optuna.create_study(sampler=sampler)
        if begin is not None:
            study.enqueue_trial({str(k): float(value) for k, value in enumerate(begin)})
        while budget > 0:
            trials = [study.ask() for _ in range(min(population, budget))]
            points = np.array(
                [[trial.suggest_float(str(k), 0.0, 1.0) for k in range(size)] for trial in trials]
            )
            for trial, value in zip(trials, objective(points), strict=True):
                study.tell(trial, float(value))
            budget -= len(trials)
    finally:
        optuna.logging.set_verbosity(before)
