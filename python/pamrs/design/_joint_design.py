"""Designing the joint: the best lengths at one pressure, and those that need the least."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import positive, refused, whole
from pamrs.design._problem import LENGTHS, JointProblem, Scores
from pamrs.rig import Joint
from pamrs.units import bar_and_psi

Progress = Callable[[int, int], None]

#: Area below the threshold that counts as "essentially zero", over the area under the threshold
#: [1].
AREA_TOLERANCE: Final = 1e-3

_GENERATION: Final = 20  # designs tried at a time
_ROUNDING: Final = 1e-9  # a smaller shortfall of torque is none


@dataclass(frozen=True)
class JointDesign:
    """A joint's four lengths, and what they are worth.

    Attributes
    ----------
    problem : JointProblem
        What was asked.
    lengths : (4,) array
        In the order of :data:`LENGTHS` [m].
    evaluations : int
        Designs that were tried until it was found; 0 for a design that was given.
    area_tolerance : float
        Area below the threshold that counts as zero, over the area under the threshold [1].

    Raises
    ------
    ParameterError
        If the tolerance is not a finite number from 0 on.
    """

    problem: JointProblem
    lengths: Array
    evaluations: int = 0
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
        """Largest deficit of the torque, as a share of the wanted one [1], 0 where there is none;
        and its angle [rad].
        """
        torque = self.scores.torque[0]
        index = int(np.argmin(torque))
        share = 1.0 - float(torque[index]) / self.problem.torque
        return (share if share > _ROUNDING else 0.0), float(self.problem.angles[index])

    def met(self, tolerance: float | None = None) -> bool:
        """True where the whole range is reached and the area below the threshold is at most a share
        of that under it.

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
        """Words on whether the requirement is met; fully only where no torque is below the wanted
        one.
        """
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
        return {
            "pressure": problem.pressure,
            "lengths": dict(zip(LENGTHS, self.lengths.tolist(), strict=True)),
            "evaluations": self.evaluations,
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
    *,
    evaluations: int = 1820,
    seed: int = 0,
    area_tolerance: float = AREA_TOLERANCE,
    progress: Progress | None = None,
) -> JointDesign:
    """Look for the lengths with the smallest objective at the problem's pressure.

    By SciPy's differential evolution of 20 designs, without polishing.

    Parameters
    ----------
    problem : JointProblem
        What is asked.
    evaluations : int
        Designs that are tried, at least 20; rounded up to whole generations of 20.
    seed : int
        The same seed gives the same result.
    area_tolerance : float
        Kept in the result, for :meth:`JointDesign.met`; plays no part in the search.
    progress : callable, optional
        Called with the designs tried and their number.

    Returns
    -------
    JointDesign
        The best found; :meth:`JointDesign.met` says whether it is good enough.

    Raises
    ------
    ParameterError
        If an argument is not possible.
    """
    lengths, _, used = _smallest(
        lambda points: problem.evaluate(points).fitness, problem, evaluations, seed, progress
    )
    return JointDesign(problem, lengths, used, area_tolerance)


def least_pressure(
    problem: JointProblem,
    *,
    largest_size: float = math.inf,
    evaluations: int = 4000,
    seed: int = 0,
    progress: Progress | None = None,
) -> JointDesign | None:
    """Look for the design with the smallest :meth:`JointProblem.needed_pressure`.

    Parameters
    ----------
    problem : JointProblem
        What is asked; its pressure plays no part.
    largest_size : float
        Largest :meth:`JointProblem.size` allowed [m].
    evaluations, seed, progress
        As for :func:`optimise`.

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

    lengths, pressure, used = _smallest(objective, problem, evaluations, seed, progress)
    if pressure < 1e10:
        return JointDesign(problem.replace(pressure=pressure), lengths, used)
    return None


def _smallest(
    objective: Callable[[Array], Array],
    problem: JointProblem,
    evaluations: int,
    seed: int,
    progress: Progress | None,
) -> tuple[Array, float, int]:
    """Lengths (4,) with the smallest objective of points (n, 4), the objective, count of tries."""
    from scipy.optimize import Bounds, differential_evolution

    whole("evaluations", evaluations, _GENERATION)
    whole("seed", seed)
    size, rounds, span = len(LENGTHS), -(-evaluations // _GENERATION), problem.upper - problem.lower
    tried = 0

    def by_columns(columns: Array, /, *_: Any, **__: Any) -> Any:
        nonlocal tried
        tried += columns.shape[1]
        if progress is not None:
            progress(tried, rounds * _GENERATION)
        return objective(problem.lower + columns.T * span)

    found = differential_evolution(
        by_columns,
        Bounds(np.zeros(size), np.ones(size)),
        popsize=_GENERATION // size,
        maxiter=rounds - 1,
        tol=0.0,
        atol=-1.0,  # never converged: the evaluations decide
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=np.random.default_rng(seed),
    )
    return problem.lower + found.x * span, float(found.fun), tried
