"""Designing the joint: one search at one pressure, and the comparison of search methods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs._checks import positive
from pamrs.design._evaluator import Genetic, Progress, Search
from pamrs.design._problem import LENGTHS, JointProblem, Scores
from pamrs.design._search import METHODS, PUBLISHED_EVALUATIONS, search
from pamrs.errors import ParameterError
from pamrs.rig import Joint
from pamrs.units import bar_and_psi

Array = NDArray[np.float64]

#: Area below the threshold that counts as "essentially zero", over the area under the threshold
#: [1].
AREA_TOLERANCE: Final = 1e-3

_QUARTILES: Final = ("best", "quartile_low", "median", "quartile_high", "worst")
_ROUNDING: Final = 1e-9  # a smaller shortfall of torque is none


@dataclass(frozen=True)
class JointDesign:
    """A joint's four lengths, what they are worth, and the search that found them.

    Attributes
    ----------
    problem : JointProblem
        What was asked.
    lengths : (4,) array
        In the order of :data:`LENGTHS` [m].
    search : Search or None
        How they were found; None for a design that was given.
    area_tolerance : float
        Area below the threshold that counts as zero, over the area under the threshold [1].

    Raises
    ------
    ParameterError
        If the tolerance is not a finite number from 0 on.
    """

    problem: JointProblem
    lengths: Array
    search: Search | None = None
    area_tolerance: float = AREA_TOLERANCE

    def __post_init__(self) -> None:
        positive("area_tolerance", self.area_tolerance, zero=True)

    @classmethod
    def of(cls, problem: JointProblem, lengths: ArrayLike) -> JointDesign:
        """A given design in a problem; errors as :meth:`JointProblem.evaluate`."""
        values = np.asarray(lengths, dtype=np.float64)
        problem.evaluate(values)
        return cls(problem, values.reshape(len(LENGTHS)))

    @property
    def scores(self) -> Scores:
        """Objective, areas and torque, arrays of one row."""
        return self.problem.evaluate(self.lengths)

    @property
    def joint(self) -> Joint:
        """The joint, for torques and simulations."""
        return self.problem.joint(self.lengths)

    @property
    def size(self) -> float:
        """Radius about the axis that holds both ends of the tendon [m]."""
        return float(self.problem.size(self.lengths)[0])

    @property
    def needed_pressure(self) -> float | None:
        """Smallest pressure at which this joint gives the torque at every angle [Pa]; None if there
        is none.
        """
        value = float(self.problem.needed_pressure(self.lengths)[0])
        return value if value < 1e10 else None

    @property
    def shortfall(self) -> tuple[float, float]:
        """How far the least torque is below the wanted one, over the wanted one [1], 0 where
        nothing is; and its angle [rad].
        """
        torque = self.scores.torque[0]
        index = int(np.argmin(torque))
        share = 1.0 - float(torque[index]) / self.problem.torque
        return (share if share > _ROUNDING else 0.0), float(self.problem.angles[index])

    def met(self, tolerance: float | None = None) -> bool:
        """Whether the whole range is reached and the area below the threshold is at most a share of
        that under it.

        The share is ``tolerance``, by default :attr:`area_tolerance`. The torque may be below the
        wanted one by more than that over a few angles: see :attr:`shortfall`.
        """
        scores, share = self.scores, self.area_tolerance if tolerance is None else tolerance
        return bool(
            scores.available[0] and scores.area_below[0] <= share * self.problem.required_area
        )

    def summary(self) -> str:
        """The design in words, lengths in mm and inches; says so where the requirement is not
        met.
        """
        problem, scores = self.problem, self.scores
        lines = [f"{'length':<14}{'mm':>9}{'in':>9}   bounds [mm]"]
        for name, value in zip(LENGTHS, self.lengths.tolist(), strict=True):
            low, high = (1e3 * bound for bound in problem.bounds[name])
            edge = ""
            if min(1e3 * value - low, high - 1e3 * value) < 1e-3 * (high - low):
                edge = "  at its bound"
            lines.append(
                f"{name:<14}{1e3 * value:>9.2f}{value / 0.0254:>9.3f}   {low:.4g} to "
                f"{high:.4g}{edge}"
            )
        torque = scores.torque[0]
        below, needed = float(scores.area_below[0]), self.needed_pressure
        last = math.degrees(float(scores.max_angle[0]))
        share = 100.0 * below / problem.required_area
        lines += [
            f"pressure {bar_and_psi(problem.pressure)}, torque {torque.min():.4g} to "
            f"{torque.max():.4g} N m, wanted {problem.torque:.4g} N m",
            f"J = {float(scores.fitness[0]):.6g} J: area below {below:.4g} J ({share:.3g} % of the "
            f"work wanted), above {float(scores.area_above[0]):.4g} J",
            f"stroke {100.0 * float(np.nanmax(scores.contraction[0])):.3g} % of the rest length, "
            f"radius about the axis {1e3 * self.size:.4g} mm",
        ]
        if self.met():
            lines.append(self._how_met())
        else:
            end = math.degrees(problem.max_angle)
            why = ""
            if not scores.available[0]:
                why = (
                    f"; the muscles turn the joint up to {last:.4g} deg only, {end:.4g} deg are "
                    "required"
                )
            lines.append(f"THE REQUIREMENT IS NOT MET: this is the best found{why}")
        lines.append(
            "no pressure makes this joint good enough"
            if needed is None
            else f"this joint needs {bar_and_psi(needed)} for the torque everywhere"
        )
        return "\n".join(lines)

    def _how_met(self) -> str:
        """Plainly met only where no torque is below the wanted one."""
        short, angle = self.shortfall
        if short == 0.0:
            return "the requirement is met"
        least = (
            f"least torque {100.0 * short:.2g} % below the wanted one at {math.degrees(angle):.4g} "
            "deg"
        )
        return f"met within {100.0 * self.area_tolerance:.3g} % of the work wanted; {least}"

    def to_dict(self) -> dict[str, Any]:
        """Numbers of the design in SI units, ready for JSON."""
        scores, problem = self.scores, self.problem
        short, short_angle = self.shortfall
        found: dict[str, Any] = {}
        if self.search is not None:
            history = self.search.history
            found = {
                "method": self.search.method,
                "seed": self.search.seed,
                "evaluations": self.search.evaluations,
                "converged": self.search.converged,
                "history": {
                    "evaluations": history.evaluations.tolist(),
                    "best": history.best.tolist(),
                    "lengths": history.points.tolist(),
                },
            }
        return {
            "pressure": problem.pressure,
            "lengths": dict(zip(LENGTHS, self.lengths.tolist(), strict=True)),
            "met": self.met(),
            "area_tolerance": self.area_tolerance,
            "shortfall": short,
            "shortfall_angle": short_angle,
            "fitness": float(scores.fitness[0]),
            "area_below": float(scores.area_below[0]),
            "area_above": float(scores.area_above[0]),
            "available": bool(scores.available[0]),
            "available_angle": float(scores.max_angle[0]),
            "needed_pressure": self.needed_pressure,
            "size": self.size,
            "angle": problem.angles.tolist(),
            "torque": scores.torque[0].tolist(),
            **found,
        }

    def to_toml(self) -> str:
        """The block ``[joint]`` of a rig file with this joint and its range."""
        problem = self.problem
        angles = {
            "rest_angle": problem.min_angle,
            "min_angle": problem.min_angle,
            "max_angle": problem.max_angle,
        }
        lengths = dict(zip(LENGTHS, self.lengths.tolist(), strict=True))
        lines = ["[joint]", f'kind         = "{problem.kind}"']
        lines += [
            f'{name:<12} = {{ value = {value:.9g}, unit = "m" }}' for name, value in lengths.items()
        ]
        lines += [
            f'{name:<12} = {{ value = {math.degrees(value):.9g}, unit = "deg" }}'
            for name, value in angles.items()
        ]
        return "\n".join(lines) + "\n"


def optimise(
    problem: JointProblem,
    method: str = "ga",
    *,
    evaluations: int = PUBLISHED_EVALUATIONS,
    seed: int = 0,
    genetic: Genetic | None = None,
    area_tolerance: float = AREA_TOLERANCE,
    progress: Progress | None = None,
) -> JointDesign:
    """Look for the lengths with the smallest objective at the problem's pressure.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    method, evaluations, seed, genetic, progress
        As for :func:`pamrs.design.search`; by default the algorithm of 3.5 for 100 generations.
    area_tolerance : float
        Kept in the result, for :meth:`JointDesign.met`; plays no part in the search.

    Returns
    -------
    JointDesign
        The best found; :meth:`JointDesign.met` says whether it is good enough.

    Raises
    ------
    ParameterError
        If an argument is not possible.
    """
    found = search(
        lambda points: problem.evaluate(points).fitness,
        problem.lower,
        problem.upper,
        method=method,
        evaluations=evaluations,
        seed=seed,
        genetic=genetic,
        progress=progress,
    )
    return JointDesign(problem, found.point, found, area_tolerance)


@dataclass(frozen=True)
class MethodComparison:
    """Search methods at equal numbers of evaluations.

    Attributes
    ----------
    methods : tuple of str
        The methods.
    seeds : tuple of int
        The seeds.
    fitness : (methods, seeds) array
        Best objective of each run [J].
    evaluations : (methods, seeds) array
        Evaluations of each run.
    """

    methods: tuple[str, ...]
    seeds: tuple[int, ...]
    fitness: Array
    evaluations: NDArray[np.int64]

    def rows(self) -> list[dict[str, Any]]:
        """For each method the median, quartiles, best and worst objective [J] and the evaluations
        of one run.
        """
        result = []
        for name, values, used in zip(self.methods, self.fitness, self.evaluations, strict=True):
            quartiles = np.percentile(values, [0.0, 25.0, 50.0, 75.0, 100.0]).tolist()
            row = {"method": name, "evaluations": int(used.max()), "runs": len(values)}
            result.append(row | dict(zip(_QUARTILES, quartiles, strict=True)))
        return result

    def table(self) -> str:
        """:meth:`rows` as text, J in joule."""
        head = "".join(f"{name.replace('_', ' '):>15}" for name in _QUARTILES)
        lines = [f"{'method':<8}{'evaluations':>12}{'runs':>6}{head}"]
        for row in self.rows():
            numbers = "".join(f"{row[name]:>15.6g}" for name in _QUARTILES)
            lines.append(f"{row['method']:<8}{row['evaluations']:>12}{row['runs']:>6}{numbers}")
        return "\n".join(lines)


def compare_methods(
    problem: JointProblem,
    *,
    methods: Sequence[str] = METHODS,
    seeds: Sequence[int] = tuple(range(10)),
    evaluations: int = PUBLISHED_EVALUATIONS,
    genetic: Genetic | None = None,
    progress: Progress | None = None,
) -> MethodComparison:
    """Run each method with each seed, all with the same number of evaluations.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    methods : sequence of str
        Of :data:`pamrs.design.METHODS`.
    seeds : sequence of int
        One run each.
    evaluations : int
        Of each run.
    genetic : Genetic, optional
        Settings of the genetic algorithm; by default as published but without stopping early.
    progress : callable, optional
        Called with the runs done and their number.

    Returns
    -------
    MethodComparison

    Raises
    ------
    ParameterError
        If there is no method or seed, or an argument is not possible.
    """
    if not methods or not seeds:
        raise ParameterError("methods and seeds must not be empty")
    settings = genetic or Genetic(tolerance=None)
    fitness = np.zeros((len(methods), len(seeds)))
    used = np.zeros(fitness.shape, dtype=np.int64)
    for row, method in enumerate(methods):
        for column, seed in enumerate(seeds):
            found = optimise(
                problem, method, evaluations=evaluations, seed=seed, genetic=settings
            ).search
            assert found is not None
            fitness[row, column], used[row, column] = found.value, found.evaluations
            if progress is not None:
                progress(row * len(seeds) + column + 1, fitness.size)
    return MethodComparison(tuple(methods), tuple(seeds), fitness, used)
