"""The genetic algorithm of dissertation 3.5 in DEAP's operators."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from deap import base, tools  # type: ignore[import-untyped]
from numpy.typing import NDArray

from pamrs._checks import checked_number, positive, whole
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from reproduction.searches import Evaluator

Array = NDArray[np.float64]
Member = Any  # a list of genes with a fitness


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


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0,)


class _Genes(list[Any]):
    """Binary digits of all lengths one after the other, most significant first."""

    def __init__(self, values: Any = ()) -> None:
        super().__init__(values)
        self.fitness = _Fitness()


def decode(genes: Sequence[int], bits: int) -> Array:
    """Point of the unit cube that binary genes stand for.

    Parameters
    ----------
    genes : sequence of int
        ``d * bits`` digits.
    bits : int
        Digits of each coordinate.

    Returns
    -------
    ndarray, shape (d,)
        From 0 (all digits 0) to 1 (all digits 1).
    """
    places = 2.0 ** np.arange(bits - 1, -1, -1)
    return np.asarray(np.reshape(genes, (-1, bits)) @ places / (2.0**bits - 1.0))


def child(first: Sequence[int], second: Sequence[int]) -> Member:
    """One design out of two: the head of one and the tail of the other, cut at a random place
    (``cxOnePoint``).
    """
    pair = tools.cxOnePoint(_Genes(first), _Genes(second))
    return random.choice(pair)


def redraw_one(genes: Member, bits: int, probability: float) -> Member:
    """With a probability, one variable at random: each of its digits turned with one half
    (``mutFlipBit``).
    """
    if random.random() < probability:
        start = bits * random.randrange(len(genes) // bits)
        genes[start : start + bits] = tools.mutFlipBit(genes[start : start + bits], indpb=0.5)[0]
    return genes


def evolve(evaluator: Evaluator, settings: Genetic) -> None:
    """Run the algorithm until the evaluations are used up or the best fitness stands still.

    The two best of a generation survive, and every other member of the next is a child of these
    two.

    Parameters
    ----------
    evaluator : Evaluator
        Objective on the unit cube; keeps the history.
    settings : Genetic
        Population, elites, digits, mutation, tolerance. Random numbers are Python's own.
    """
    toolbox = base.Toolbox()
    toolbox.register("digit", random.randint, 0, 1)
    toolbox.register(
        "member", tools.initRepeat, _Genes, toolbox.digit, n=settings.bits * evaluator.lower.size
    )
    toolbox.register("population", tools.initRepeat, list, toolbox.member)
    toolbox.register("select", tools.selBest, k=settings.elites)
    toolbox.register("mate", child)
    toolbox.register("mutate", redraw_one, bits=settings.bits, probability=settings.mutation)

    population = toolbox.population(n=settings.population)
    _assign(population, evaluator, settings.bits)
    while evaluator.left and not _settled(evaluator.best, settings):
        elites = toolbox.select(population)
        children = [
            toolbox.mutate(toolbox.mate(*elites[:2]))
            for _ in range(settings.population - settings.elites)
        ]
        _assign(children, evaluator, settings.bits)
        population = elites + children


def _assign(members: list[Member], evaluator: Evaluator, bits: int) -> None:
    values = evaluator(np.array([decode(member, bits) for member in members]))
    for member, value in zip(members, values.tolist(), strict=True):
        member.fitness.values = (value,)


def _settled(best: Array, settings: Genetic) -> bool:
    if settings.tolerance is None or len(best) <= settings.stall:
        return False
    earlier = float(best[-1 - settings.stall])
    return earlier - float(best[-1]) <= settings.tolerance * abs(earlier)
