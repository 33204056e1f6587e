"""What a search is given and gives: objective under a budget, settings, course, result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs._checks import checked_number, positive, whole
from pamrs.errors import ParameterError

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Genetic:
    """Settings of the genetic algorithm; the defaults are those of 3.5 where it prints them.

    Parameters
    ----------
    population : int
        Designs in a generation.
    elites : int
        Best ones that survive; the two best are the parents of all others.
    bits : int
        Binary digits of each length (not printed).
    mutation : float
        Probability that a child gets one of its lengths at random (not printed; the text names
        MATLAB's ``ga()``, which by default makes a fifth of the children by mutation, and has the
        same population, elites and generations).
    tolerance : float or None
        The search has converged when the best fitness fell by less than this share over ``stall``
        generations; None runs all generations. The text prints neither number; these are MATLAB's.
    stall : int
        See ``tolerance``.

    Raises
    ------
    ParameterError
        If a value is not possible.
    """

    population: int = 20
    elites: int = 2
    bits: int = 12
    mutation: float = 0.2
    tolerance: float | None = 1e-6
    stall: int = 50

    def __post_init__(self) -> None:
        if self.elites < 2 or self.population <= self.elites:
            raise ParameterError(
                f"population = {self.population}, elites = {self.elites} are not allowed: "
                "at least two elites, and more designs than those, are needed"
            )
        whole("bits", self.bits, 1, 52)
        checked_number("mutation", self.mutation, 0.0, 1.0)
        whole("stall", self.stall, 1)
        if self.tolerance is not None:
            positive("tolerance", self.tolerance, zero=True)


@dataclass(frozen=True)
class History:
    """How a search went, one entry for each generation; entry 0 is the random start.

    Attributes
    ----------
    evaluations : (g,) array
        Evaluations made so far.
    best : (g,) array
        Smallest objective so far.
    middle : (g,) array
        Median of the designs evaluated in this generation.
    points : (g, d) array
        The best point so far.
    """

    evaluations: NDArray[np.int64]
    best: Array
    middle: Array
    points: Array


@dataclass(frozen=True)
class Search:
    """Result of a search.

    Attributes
    ----------
    method : str
        One of :data:`METHODS`.
    point : (d,) array
        The best point.
    value : float
        Its objective.
    evaluations : int
        How often the objective was evaluated.
    seed : int
        Seed of the random numbers.
    converged : bool
        The search stopped before its evaluations were used up.
    history : History
    """

    method: str
    point: Array
    value: float
    evaluations: int
    seed: int
    converged: bool
    history: History


@dataclass
class Evaluator:
    """The objective on the unit cube: counts evaluations, keeps the history, stops answering when
    the budget is spent.
    """

    objective: Objective
    lower: Array
    upper: Array
    budget: int
    progress: Progress | None = None
    used: int = 0
    _rows: list[tuple[int, float, float, Array]] = field(default_factory=list)

    @property
    def left(self) -> int:
        """Evaluations that may still be made."""
        return self.budget - self.used

    @property
    def best(self) -> Array:
        """Smallest objective after each generation, (g,)."""
        return np.array([row[1] for row in self._rows])

    def __call__(self, unit: ArrayLike) -> Array:
        """Evaluate points of the cube, (n, d) -> (n,); infinite for points beyond the budget."""
        rows = np.atleast_2d(np.asarray(unit, dtype=np.float64))
        values = np.full(len(rows), np.inf)
        made = min(len(rows), self.left)
        if made:
            points = self.lower + np.clip(rows[:made], 0.0, 1.0) * (self.upper - self.lower)
            values[:made] = self.objective(points)
            if np.isnan(values[:made]).any():
                bad = points[np.isnan(values[:made])][0]
                raise ParameterError(f"objective: its value at {bad.tolist()} is not a number")
            self.used += made
            index = int(np.argmin(values[:made]))
            value, point = float(values[index]), points[index]
            if self._rows and self._rows[-1][1] <= value:
                value, point = self._rows[-1][1], self._rows[-1][3]
            self._rows.append((self.used, value, float(np.median(values[:made])), point))
            if self.progress is not None:
                self.progress(self.used, self.budget)
        return values

    def result(self, method: str, seed: int) -> Search:
        """What was found."""
        used, best, middle, points = zip(*self._rows, strict=True)
        history = History(
            np.array(used, dtype=np.int64), np.array(best), np.array(middle), np.array(points)
        )
        return Search(method, points[-1], best[-1], self.used, seed, self.left > 0, history)
