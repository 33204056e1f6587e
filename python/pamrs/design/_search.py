"""Searches of a box under a budget of evaluations: the published genetic algorithm, two others
beside it, and blind chance.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from pamrs._checks import matched, one_of, refused, whole
from pamrs.design._evaluator import Array, Evaluator, Genetic, Objective, Progress, Search
from pamrs.errors import missing_package

#: Genetic algorithm of 3.5, differential evolution, CMA-ES, and independent random points.
METHODS: Final = ("ga", "de", "cma", "random")

#: Evaluations of the published algorithm: 20 designs, then 18 new ones in each of 100 generations.
PUBLISHED_EVALUATIONS: Final = 1820


def search(
    objective: Objective,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    method: str = "ga",
    evaluations: int = PUBLISHED_EVALUATIONS,
    seed: int = 0,
    genetic: Genetic | None = None,
    progress: Progress | None = None,
) -> Search:
    """Look for the smallest value of a function in a box.

    Parameters
    ----------
    objective : callable
        Points (n, d) to values (n,).
    lower, upper : array_like, shape (d,)
        The box; a coordinate with equal limits is fixed.
    method : {"ga", "de", "cma", "random"}
        The genetic algorithm of 3.5 (operators of DEAP); differential evolution (scipy, 20 members,
        else its defaults, no polishing); CMA-ES (cma, from random starts, the population doubled at
        each); random points.
    evaluations : int
        Budget, at least one population. All methods but a converged genetic algorithm use it up
        exactly.
    seed : int
        The same seed gives the same result; the random numbers of the caller are left as they are.
    genetic : Genetic, optional
        Settings of the genetic algorithm.
    progress : callable, optional
        Called with the evaluations made and the budget.

    Returns
    -------
    Search

    Raises
    ------
    ParameterError
        If the method is unknown, the budget too small, the seed negative, a limit not finite, or
        the function gives a number that is none.
    MissingPackageError
        If DEAP or cma is not installed; also an ``ImportError``.
    """
    settings = genetic or Genetic()
    one_of("method", method, METHODS)
    if evaluations < settings.population:
        least = f"at least one population of {settings.population} is needed"
        raise refused("evaluations", evaluations, least)
    whole("seed", seed)
    low, high = matched(lower=lower, upper=upper)
    evaluator = Evaluator(objective, low, high, evaluations, progress)
    if method == "ga":
        try:
            from pamrs.design._genetic import evolve
        except ImportError as error:
            raise missing_package(error, "search") from error
        with seeded(seed):
            evolve(evaluator, settings)
    elif method == "de":
        _differential_evolution(evaluator, seed)
    elif method == "cma":
        _cma(evaluator, seed)
    else:
        rng = np.random.default_rng(seed)
        while evaluator.left:
            evaluator(rng.random((20, low.size)))
    return evaluator.result(method, seed)


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Python's own random numbers from a seed, and afterwards as before (DEAP draws from them)."""
    state = random.getstate()
    random.seed(seed)
    try:
        yield
    finally:
        random.setstate(state)


def _differential_evolution(evaluator: Evaluator, seed: int) -> None:
    from scipy.optimize import Bounds, differential_evolution

    size = evaluator.lower.size
    members = max(5, -(-20 // size))
    rounds = -(-evaluator.budget // (members * size))

    def by_columns(columns: Array, /, *_: Any, **__: Any) -> Any:
        return evaluator(columns.T)

    differential_evolution(
        by_columns,
        Bounds(np.zeros(size), np.ones(size)),
        popsize=members,
        maxiter=rounds - 1,
        tol=0.0,
        atol=-1.0,  # never converged: the budget decides
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=np.random.default_rng(seed),
    )


def _cma(evaluator: Evaluator, seed: int) -> None:
    """CMA-ES from random starts with growing populations until the budget is spent."""
    try:
        import cma  # type: ignore[import-untyped]
    except ImportError as error:
        raise missing_package(error, "search") from error
    rng = np.random.default_rng(seed)
    size = evaluator.lower.size
    population = 4 + int(3 * np.log(size))
    # its own random numbers: numpy's global ones stay as they are
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
