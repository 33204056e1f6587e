"""Joints by the searches of dissertation 3.5: at one pressure, and the outer loop that looks for
the smallest one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import positive, whole
from pamrs.design import AREA_TOLERANCE, JointDesign, JointProblem, optimise
from reproduction.genetic import Genetic
from reproduction.searches import PUBLISHED_EVALUATIONS, search

Array = NDArray[np.float64]


def designed(
    problem: JointProblem,
    method: str = "ga",
    *,
    evaluations: int = PUBLISHED_EVALUATIONS,
    seed: int = 0,
    genetic: Genetic | None = None,
    area_tolerance: float = AREA_TOLERANCE,
) -> JointDesign:
    """The joint with the smallest objective at the problem's pressure that a search found.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    method : str
        One of :data:`reproduction.searches.METHODS`, or ``"de"``, that of
        :func:`pamrs.design.optimise`.
    evaluations, seed, genetic
        As for :func:`reproduction.searches.search`; by default the algorithm of 3.5 for 100
        generations.
    area_tolerance : float
        Kept in the result, for :meth:`JointDesign.met`; plays no part in the search.

    Returns
    -------
    JointDesign
    """
    if method == "de":
        return optimise(problem, evaluations=evaluations, seed=seed, area_tolerance=area_tolerance)
    found = search(
        lambda points: problem.evaluate(points).fitness,
        problem.lower,
        problem.upper,
        method=method,
        evaluations=evaluations,
        seed=seed,
        genetic=genetic,
    )
    return JointDesign(problem, found.point, found.evaluations, area_tolerance)


def objectives(
    problem: JointProblem,
    method: str,
    seeds: Iterable[int],
    evaluations: int = PUBLISHED_EVALUATIONS,
) -> Array:
    """Best objective of a method with each seed [J], as many evaluations each; a genetic algorithm
    does not stop early.
    """
    lasting = Genetic(tolerance=None)
    runs = (
        designed(problem, method, evaluations=evaluations, seed=seed, genetic=lasting)
        for seed in seeds
    )
    return np.array([float(run.scores.fitness[0]) for run in runs])


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
    design : JointDesign
        The design at the smallest pressure at which a search succeeded, its problem at that
        pressure; the best found where none did.
    trials : tuple of Trial
        In the order tried.
    """

    design: JointDesign
    trials: tuple[Trial, ...]

    @property
    def met(self) -> bool:
        """True where some pressure was enough."""
        return any(trial.met for trial in self.trials)

    @property
    def pressure(self) -> float | None:
        """The smallest pressure at which this search succeeded [Pa], no bound; None where it never
        did.
        """
        return self.design.problem.pressure if self.met else None


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
) -> PressureSearch:
    """Repeat the search at other pressures until the area below the threshold is essentially zero
    (3.5.1).

    From the problem's pressure upward by half as much again until a search succeeds, then by
    bisection. A search may miss what another start finds, so the result depends on the start and is
    no bound: see :func:`pamrs.design.least_pressure`.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    method, evaluations, seed
        As for :func:`designed`.
    highest : float, optional
        Pressure beyond which to give up [Pa]; four times the problem's unless told.
    tolerance : float
        Width of the last bracket [Pa].
    area_tolerance : float
        Area below the threshold that counts as zero, over the area under it [1].
    tries : int
        Searches with other random numbers before a pressure counts as too low.

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
    positive("highest", limit)
    whole("tries", tries, 1)
    trials: list[Trial] = []

    def attempt(pressure: float) -> JointDesign:
        best: JointDesign | None = None
        count = 0
        while count < tries and not (best is not None and best.met()):
            design = designed(
                problem.replace(pressure=pressure),
                method,
                evaluations=evaluations,
                seed=seed + 1000 * len(trials) + count,
                area_tolerance=area_tolerance,
            )
            count += 1
            if best is None or design.met() or design.scores.fitness[0] < best.scores.fitness[0]:
                best = design
        assert best is not None
        trials.append(Trial(pressure, float(best.scores.area_below[0]), best.met(), count))
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
    return PressureSearch(found, tuple(trials))
