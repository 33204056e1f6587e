"""Searches of a box under a budget of evaluations: the published genetic algorithm, CMA-ES, and
blind chance.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final

import cma  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs._checks import one_of, refused, whole
from reproduction.genetic import Genetic, evolve

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]

#: Genetic algorithm of 3.5, CMA-ES, and independent random points.
METHODS: Final = ("ga", "cma", "random")

#: Evaluations of the published algorithm: 20 designs, then 18 new ones in each of 100 generations.
PUBLISHED_EVALUATIONS: Final = 1820


@dataclass(frozen=True)
class Search:
    """Result of a search.

    Attributes
    ----------
    point : (d,) array
        The best point.
    value : float
        Its objective.
    evaluations : int
        How often the objective was evaluated.
    converged : bool
        The search stopped before its evaluations were used up.
    best : (g,) array
        Smallest objective after each generation; that of the random start first.
    """

    point: Array
    value: float
    evaluations: int
    converged: bool
    best: Array


@dataclass
class Evaluator:
    """The objective on the unit cube: counts evaluations, keeps the best, stops answering when the
    budget is spent.
    """

    objective: Objective
    lower: Array
    upper: Array
    budget: int
    used: int = 0
    _rows: list[tuple[float, Array]] = field(default_factory=list)

    @property
    def left(self) -> int:
        """Evaluations that may still be made."""
        return self.budget - self.used

    @property
    def best(self) -> Array:
        """Smallest objective after each generation, (g,)."""
        return np.array([value for value, _ in self._rows])

    def __call__(self, unit: ArrayLike) -> Array:
        """Evaluate points of the cube, (n, d) -> (n,); infinite for points beyond the budget."""
        rows = np.atleast_2d(np.asarray(unit, dtype=np.float64))
        values = np.full(len(rows), np.inf)
        made = min(len(rows), self.left)
        if made:
            points = self.lower + np.clip(rows[:made], 0.0, 1.0) * (self.upper - self.lower)
            values[:made] = self.objective(points)
            self.used += made
            index = int(np.argmin(values[:made]))
            found = float(values[index]), points[index]
            self._rows.append(min([*self._rows[-1:], found], key=lambda row: row[0]))
        return values

    def result(self) -> Search:
        """The best point, and how it was found."""
        value, point = self._rows[-1]
        return Search(point, value, self.used, self.left > 0, self.best)


def search(
    objective: Objective,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    method: str = "ga",
    evaluations: int = PUBLISHED_EVALUATIONS,
    seed: int = 0,
    genetic: Genetic | None = None,
) -> Search:
    """Look for the smallest value of a function in a box.

    Parameters
    ----------
    objective : callable
        Points (n, d) to values (n,).
    lower, upper : array_like, shape (d,)
        The box; a coordinate with equal limits is fixed.
    method : {"ga", "cma", "random"}
        The genetic algorithm of 3.5 (operators of DEAP); CMA-ES (cma, from random starts, the
        population doubled at each); random points.
    evaluations : int
        Budget, at least one population. All methods but a converged genetic algorithm use it up
        exactly.
    seed : int
        The same seed gives the same result; the random numbers of the caller are left as they are.
    genetic : Genetic, optional
        Settings of the genetic algorithm.

    Returns
    -------
    Search

    Raises
    ------
    ParameterError
        If the method is unknown, the budget too small, or the seed negative.
    """
    settings = genetic or Genetic()
    one_of("method", method, METHODS)
    if evaluations < settings.population:
        least = f"at least one population of {settings.population} is needed"
        raise refused("evaluations", evaluations, least)
    whole("seed", seed)
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    evaluator = Evaluator(objective, low, high, evaluations)
    if method == "ga":
        with _seeded(seed):
            evolve(evaluator, settings)
    elif method == "cma":
        _cma(evaluator, seed)
    else:
        rng = np.random.default_rng(seed)
        while evaluator.left:
            evaluator(rng.random((20, low.size)))
    return evaluator.result()


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Python's own random numbers from a seed, and afterwards as before (DEAP draws from them)."""
    state = random.getstate()
    random.seed(seed)
    try:
        yield
    finally:
        random.setstate(state)


def _cma(evaluator: Evaluator, seed: int) -> None:
    """CMA-ES from random starts with growing populations until the budget is spent."""
    rng = np.random.default_rng(seed)
    size = evaluator.lower.size
    population = 4 + int(3 * np.log(size))
    # random numbers of its own: numpy's global ones stay as they are
    options = {
        "bounds": [0.0, 1.0],
        "verbose": -9,
        "seed": np.nan,
        "randn": lambda *shape: rng.standard_normal(shape),
    }
    while evaluator.left:
        strategy = cma.CMAEvolutionStrategy(
            rng.random(size), 0.3, {**options, "popsize": population}
        )
        while evaluator.left and not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, evaluator(points).tolist())
        population *= 2
