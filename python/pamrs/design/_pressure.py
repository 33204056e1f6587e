"""The smallest pressure: the outer loop of dissertation 3.5, a direct search beside it, and
pressure against size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import positive, refused, whole
from pamrs.design._evaluator import Genetic, Progress
from pamrs.design._joint_design import AREA_TOLERANCE, JointDesign, optimise
from pamrs.design._problem import JointProblem
from pamrs.design._search import PUBLISHED_EVALUATIONS, search, seeded
from pamrs.errors import ParameterError, missing_package
from pamrs.units import bar_and_psi

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """One pressure tried: gauge pressure [Pa], area left below the threshold [J], whether the
    requirement was met, searches made.
    """

    pressure: float
    area_below: float
    met: bool
    searches: int


@dataclass(frozen=True)
class PressureSearch:
    """Result of the outer loop.

    Attributes
    ----------
    met : bool
        Whether any pressure up to ``highest`` was enough.
    design : JointDesign
        The design at the smallest pressure at which this search succeeded, its problem at that
        pressure; the best found where it never did.
    trials : tuple of Trial
        In the order tried.
    evaluations : int
        Of the objective, all searches together.
    tolerance : float
        The pressure just tried without success is less than this below [Pa].
    """

    met: bool
    design: JointDesign
    trials: tuple[Trial, ...]
    evaluations: int
    tolerance: float

    @property
    def pressure(self) -> float | None:
        """The smallest pressure at which this search succeeded [Pa], no bound; None where it never
        did.
        """
        return self.design.problem.pressure if self.met else None

    @property
    def least_possible_pressure(self) -> float:
        """Pressure below which no joint can do [Pa]; the share of the work that may be missing is
        the design's ``area_tolerance``.
        """
        return self.design.problem.least_possible_pressure(self.design.area_tolerance)

    def summary(self) -> str:
        """The result in a line or two."""
        tried = f"{len(self.trials)} pressures, {self.evaluations} evaluations"
        least = (
            "no joint of any shape could do with less than "
            f"{bar_and_psi(self.least_possible_pressure)}"
        )
        if not self.met:
            highest = max(trial.pressure for trial in self.trials)
            return f"NO PRESSURE UP TO {bar_and_psi(highest)} IS ENOUGH ({tried})\n{least}"
        return (
            f"pressure {bar_and_psi(self.design.problem.pressure)}: the smallest at which this "
            f"search succeeded ({tried})\n{least}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Numbers in SI units, ready for JSON."""
        return {
            "met": self.met,
            "pressure": self.pressure,
            "tolerance": self.tolerance,
            "evaluations": self.evaluations,
            "area_tolerance": self.design.area_tolerance,
            "least_possible_pressure": self.least_possible_pressure,
            "trials": [vars(trial) for trial in self.trials],
        }


def minimum_pressure(
    problem: JointProblem,
    method: str = "ga",
    *,
    highest: float | None = None,
    tolerance: float = 2e3,
    area_tolerance: float = AREA_TOLERANCE,
    tries: int = 3,
    evaluations: int = PUBLISHED_EVALUATIONS,
    seed: int = 0,
    genetic: Genetic | None = None,
    progress: Progress | None = None,
) -> PressureSearch:
    """Repeat the search at other pressures until the area below the threshold is essentially zero
    (3.5.1).

    From the problem's pressure upward by half as much again until a search succeeds, then by
    bisection. A search may miss what another start finds, so the result depends on the start and is
    no bound: see :func:`least_pressure`.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    method, evaluations, seed, genetic
        As for :func:`optimise`.
    highest : float, optional
        Pressure beyond which to give up [Pa]; four times the problem's unless told.
    tolerance : float
        Width of the last bracket [Pa].
    area_tolerance : float
        Area below the threshold that counts as zero, over the area under it [1].
    tries : int
        Searches with other random numbers before a pressure counts as too low.
    progress : callable, optional
        Called with the pressures tried and how many there will be about.

    Returns
    -------
    PressureSearch

    Raises
    ------
    ParameterError
        If an argument is not possible.
    """
    limit = 4.0 * problem.pressure if highest is None else highest
    positive("tolerance", tolerance)
    positive("area_tolerance", area_tolerance)
    positive("highest", limit)
    whole("tries", tries, 1)
    trials: list[Trial] = []
    options: dict[str, Any] = {
        "evaluations": evaluations,
        "genetic": genetic,
        "area_tolerance": area_tolerance,
    }
    used = 0

    def attempt(pressure: float) -> JointDesign:
        nonlocal used
        best: JointDesign | None = None
        count = 0
        while count < tries and not (best is not None and best.met()):
            start = seed + 1000 * len(trials) + count
            design = optimise(problem.replace(pressure=pressure), method, **options, seed=start)
            used += design.search.evaluations if design.search is not None else 0
            count += 1
            if best is None or design.met() or design.scores.fitness[0] < best.scores.fitness[0]:
                best = design
        assert best is not None
        trials.append(Trial(pressure, float(best.scores.area_below[0]), best.met(), count))
        if progress is not None:
            progress(
                len(trials),
                len(trials) + max(0, math.ceil(math.log2(max(high - low, tolerance) / tolerance))),
            )
        return best

    low, high = 0.0, min(problem.pressure, limit)
    found = attempt(high)
    while not trials[-1].met and high < limit:
        low, high = high, min(1.5 * high, limit)
        found = attempt(high)
    met = trials[-1].met
    while met and high - low > tolerance:
        middle = 0.5 * (low + high)
        design = attempt(middle)
        if trials[-1].met:
            found, high = design, middle
        else:
            low = middle
    return PressureSearch(met, found, tuple(trials), used, tolerance)


def least_pressure(
    problem: JointProblem,
    method: str = "de",
    *,
    largest_size: float = math.inf,
    evaluations: int = 4000,
    seed: int = 0,
    progress: Progress | None = None,
) -> JointDesign | None:
    """Look for the design with the smallest :meth:`JointProblem.needed_pressure`, without an outer
    loop.

    Parameters
    ----------
    problem : JointProblem
        What is asked; its pressure plays no part.
    method, evaluations, seed, progress
        As for :func:`optimise`.
    largest_size : float
        Largest :meth:`JointProblem.size` allowed [m].

    Returns
    -------
    JointDesign or None
        Its problem at the pressure that it needs; None if no design was found that any pressure
        makes good enough.

    Raises
    ------
    ParameterError
        If an argument is not possible.
    """
    if not largest_size > 0.0:
        raise refused("largest_size", largest_size, "a length above 0 m is needed")

    def objective(points: Array) -> Array:
        needed = problem.needed_pressure(points)
        if not math.isfinite(largest_size):
            return needed
        excess = problem.size(points) / largest_size - 1.0
        return np.where(excess > 0.0, 3e10 * (1.0 + excess), needed)

    found = search(
        objective,
        problem.lower,
        problem.upper,
        method=method,
        evaluations=evaluations,
        seed=seed,
        progress=progress,
    )
    if found.value < 1e10:
        return JointDesign(problem.replace(pressure=found.value), found.point, found)
    return None


@dataclass(frozen=True)
class ParetoFront:
    """Designs of which none needs less pressure at the same size, from the smallest on.

    Attributes
    ----------
    size : (k,) array
        Radius about the axis that holds both ends of the tendon [m].
    pressure : (k,) array
        Pressure needed [Pa].
    lengths : (k, 4) array
        The designs [m].
    """

    size: Array
    pressure: Array
    lengths: Array

    def to_dict(self) -> dict[str, Any]:
        """Numbers in SI units, ready for JSON."""
        return {name: values.tolist() for name, values in vars(self).items()}


def pareto_front(
    problem: JointProblem,
    *,
    population: int = 80,
    generations: int = 100,
    seed: int = 0,
    progress: Progress | None = None,
) -> ParetoFront:
    """Pressure needed against size of the joint, both to be small (NSGA-II of DEAP).

    Parameters
    ----------
    problem : JointProblem
        What is asked; its pressure plays no part.
    population : int
        Members, a multiple of four.
    generations : int
        Rounds after the random start.
    seed : int
        The same seed gives the same front.
    progress : callable, optional
        Called with the generations done and their number.

    Returns
    -------
    ParetoFront
        Empty if no design was found that any pressure makes good enough.

    Raises
    ------
    ParameterError
        If the population is not a multiple of four, or a number is too small.
    MissingPackageError
        If DEAP is not installed; also an ``ImportError``.
    """
    if population < 4 or population % 4 or generations < 1 or seed < 0:
        raise ParameterError(
            f"population = {population}, generations = {generations}, seed = {seed} are not "
            "allowed: a multiple of four, at least 1 and at least 0 are needed"
        )
    try:
        from pamrs.design._genetic import evolve_two
    except ImportError as error:
        raise missing_package(error, "search") from error
    span = problem.upper - problem.lower

    def objectives(unit: Array) -> Array:
        points = problem.lower + unit * span
        return np.stack([problem.needed_pressure(points), problem.size(points)], axis=1)

    with seeded(seed):
        unit = evolve_two(
            objectives, span.size, population=population, generations=generations, progress=progress
        )
    values = objectives(unit)
    good = np.flatnonzero(values[:, 0] < 1e10)
    order = good[np.lexsort((values[good, 0], values[good, 1]))]
    order = (
        order[np.concatenate([[True], np.diff(values[order, 1]) > 0.0])] if len(order) else order
    )
    return ParetoFront(values[order, 1], values[order, 0], problem.lower + unit[order] * span)
