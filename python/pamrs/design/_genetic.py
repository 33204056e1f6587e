"""The genetic algorithm of dissertation 3.5 in DEAP's operators, and NSGA-II for two objectives."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from deap import base, tools  # type: ignore[import-untyped]
from numpy.typing import NDArray

from pamrs.design._evaluator import Evaluator, Genetic

Array = NDArray[np.float64]
Member = Any  # a list of genes with a fitness


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0,)


class _TwoFitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0, -1.0)


class _Genes(list[Any]):
    """Binary digits of all lengths one after the other, most significant first."""

    def __init__(self, values: Any = ()) -> None:
        super().__init__(values)
        self.fitness = _Fitness()


class _Point(list[float]):
    """Coordinates in the unit cube."""

    def __init__(self, values: Any = ()) -> None:
        super().__init__(values)
        self.fitness = _TwoFitness()


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


def evolve_two(
    objectives: Callable[[Array], Array],
    size: int,
    *,
    population: int,
    generations: int,
    progress: Callable[[int, int], None] | None,
) -> Array:
    """NSGA-II (Deb 2002, with its usual settings) for two objectives on the unit cube.

    Parameters
    ----------
    objectives : callable
        Points (n, size) to values (n, 2), both to be small.
    size : int
        Coordinates.
    population : int
        Members, a multiple of four.
    generations : int
        Rounds after the random start.
    progress : callable, optional
        Called with the generations done and their number.

    Returns
    -------
    ndarray, shape (k, size)
        The members that none other beats in both objectives.
    """
    crossing = {"eta": 20.0, "low": 0.0, "up": 1.0}
    members = [_Point(random.random() for _ in range(size)) for _ in range(population)]
    _assign_two(members, objectives)
    members = tools.selNSGA2(members, population)
    for generation in range(generations):
        children = [_Point(member) for member in tools.selTournamentDCD(members, population)]
        for first, second in zip(children[::2], children[1::2], strict=True):
            if random.random() < 0.9:
                tools.cxSimulatedBinaryBounded(first, second, **crossing)
            for member in (first, second):
                tools.mutPolynomialBounded(member, **crossing, indpb=1.0 / size)
        _assign_two(children, objectives)
        members = tools.selNSGA2(members + children, population)
        if progress is not None:
            progress(generation + 1, generations)
    return np.array(tools.sortNondominated(members, population, first_front_only=True)[0])


def _assign_two(members: list[_Point], objectives: Callable[[Array], Array]) -> None:
    for member, values in zip(members, objectives(np.array(members)).tolist(), strict=True):
        member.fitness.values = tuple(values)
