"""Values of the rig file that are wrong: parameters freed from their tolerance, as rivals of the
effects.

The baseline moves inside three tolerances. A parameter that moved may stand for physics that is
missing, or the file may be wrong about it. Which of the two is decided as between effects:
the parameter is freed, everything is fitted again, and held-out recordings judge.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.evidence import WALL_TOLERANCES, FittedHypothesis, significant
from pamrs.diagnosis.fit import (
    Fit,
    Problem,
    ends_in_tolerances,
    known_parameters,
    levenberg_marquardt,
    stacked,
    two_at_a_time,
)
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.search._attempts import BEAM, Attempts
from pamrs.rig import Rig
from pamrs.rig.schema import split_name

# share of what a set leaves that a further effect takes, and of a mismatch that a partner or a form
# without a name takes; less is the form of the others
FURTHER_SHARE = 0.2
# freed parameters, and pairs of them, that are fitted to their end (decision 25)
_MOST_FINISHED = 3
# times the misfit of a freed parameter that leaves noise, for others fitted with it
_NEAR_MISFIT = 2.0
_SUSPECTED_TOLERANCES = 1.0  # [tolerances] moved by a value whose freeing is looked at
# [tolerances] moved by a suspect with effects, which take a part of what it would do
FAR_TOLERANCES = 2.0
# share of the largest gain from which an effect, or a pair, is fitted (decisions 13, 25)
LEAST_GAIN_SHARE = 0.08
# wrong by one mistake: other valve and fittings, load, arm (decision 25)
_WRONG_TOGETHER = (
    ("chamber.dead_volume", "valve.discharge_area_max"),
    ("arm.payload", "arm.first_moment"),
    ("arm.inertia", "arm.first_moment"),
    ("link.mass", "link.centre"),
    ("link.inertia", "link.mass"),
)


Array = NDArray[np.float64]


def suspected_values(fitted: Fit, blocks: list[Block]) -> list[tuple[str, ...]]:
    """Parameters that moved, alone, and in pairs that one mistake makes wrong together: of several
    that moved a little one may be far off.

    Returns
    -------
    list of tuple of str
        Dotted names.
    """
    moved = [
        name for name, distance in fitted.moved.items() if abs(distance) >= _SUSPECTED_TOLERANCES
    ]
    at_wall = [name for name in moved if abs(fitted.moved[name]) >= WALL_TOLERANCES]
    sets: list[tuple[str, ...]] = [(name,) for name in moved]
    for one, other in itertools.permutations(fitted.moved, 2):
        together = any({one, other} <= block.parameters for block in blocks) and _same_owner(
            one, other
        )
        if (
            (_kind(one), _kind(other)) in _WRONG_TOGETHER
            and together
            and not {one, other}.isdisjoint(at_wall)
        ):
            sets.append((one, other))
    return sets


def _same_owner(one: str, other: str) -> bool:
    """True where one mistake may make two parameters wrong: of blocks of one kind they have to
    belong to the same block.
    """
    first, second = split_name(one), split_name(other)
    return first[0] != second[0] or first[1] == second[1]


def _kind(name: str) -> str:
    """Kind of block and key of a dotted name, without the block's own: ``chamber.dead_volume``."""
    kind, _, key = split_name(name)
    return f"{kind}.{key}"


def free_suspects(
    attempts: Attempts,
    baseline: Fit,
    first: Fit,
    say: Callable[[str], None],
    share: float | None = None,
) -> list[FittedHypothesis]:
    """The suspected parameters, each freed and fitted, and the pairs of the largest gain predicted
    by the linear model.

    Where the mismatch is large its autocorrelation leaves little weight to the recordings, so that
    the priors hold what a fit with white noise moved: parameters that moved in either fit are
    suspects.

    Parameters
    ----------
    attempts : Attempts
        Recordings, model, noise levels.
    baseline : Fit
        The refitted baseline, with sensitivities.
    first : Fit
        The same with white noise.
    say : callable
        Receives progress.
    share : float, optional
        Of the sum of squares, below which a step is not worth it; 0 where the last few units of
        chi-square count.
    """
    walls = attempts.settings.most_tolerances
    suspects = [
        names
        for fitted in (baseline, first)
        for names in suspected_values(fitted, attempts.fit_problem.blocks)
    ]
    gains = _worth_a_fit(attempts, baseline, list(dict.fromkeys(suspects)), attempts.no_inflation)
    # the linear model says little of what is far away: each parameter is fitted, whatever its
    # predicted gain with others
    least = LEAST_GAIN_SHARE * max(gains.values(), default=0.0)
    pairs = [names for names, gain in gains.items() if len(names) > 1 and gain > least][:BEAM]
    candidates = []
    sets = [names for names in gains if len(names) == 1 or names in pairs]
    for names, candidate in _fit_freed(attempts, sets, baseline, say, share).items():
        if candidate is not None and candidate.is_wrong(walls):
            candidates.append(replace(candidate, gain=gains[names]))
    return candidates


def far_parameters(attempts: Attempts, fitted: Fit) -> list[str]:
    """Parameters that a fit with effects moved far, and whose freeing promises most by the linear
    model; the most promising first.
    """
    far: list[tuple[str, ...]] = [
        (name,) for name, moved in fitted.moved.items() if abs(moved) >= FAR_TOLERANCES
    ]
    gains = _worth_a_fit(attempts, fitted, far, attempts.inflation_of(fitted))
    return [name for (name,) in gains][:BEAM]


def _worth_a_fit(
    attempts: Attempts, fitted: Fit, sets: list[tuple[str, ...]], inflation: dict[str, float]
) -> dict[tuple[str, ...], float]:
    """Sets of parameters whose freeing is worth a fit by the linear model, with their gain in
    chi-square, the largest first.
    """
    gains = _predicted_gain(attempts.fit_problem, attempts.nominal, fitted, sets, inflation)
    return {
        n: gains[n]
        for n in sorted(gains, key=lambda n: -gains[n])
        if gains[n] > 2.0 * attempts.settings.file_log_odds
    }


def _fit_freed(
    attempts: Attempts,
    sets: list[tuple[str, ...]],
    baseline: Fit,
    say: Callable[[str], None],
    share: float | None,
) -> dict[tuple[str, ...], FittedHypothesis | None]:
    """Each set of parameters freed: those that leave least after a few steps are fitted to their
    end, the others come as they are.
    """

    def to_the_end(
        several: list[tuple[str, ...]],
    ) -> dict[tuple[str, ...], FittedHypothesis | None]:
        ended = two_at_a_time(lambda names: attempts.fit_freed(names, baseline, share), several)
        return dict(zip(several, ended, strict=True))

    if len(sets) <= _MOST_FINISHED:
        return to_the_end(sets)
    say(f"trying other values of {', '.join(' and '.join(names) for names in sets)}")
    short_fits = zip(sets, two_at_a_time(attempts.fit_freed_shortly, sets), strict=True)
    short = {names: c for names, c in short_fits if c is not None}
    worth = [names for names in short if not _needless(names, short, attempts)]
    best = sorted(worth, key=lambda names: short[names].misfit)[:_MOST_FINISHED]
    if best and not any(significant(e) for e in short[best[0]].fit_excess.values()):
        # what leaves much more than one that leaves noise does not get there
        near = _NEAR_MISFIT * short[best[0]].misfit
        best = [names for names in best if short[names].misfit <= near]
    return {**short, **to_the_end(best)}


def _needless(
    names: tuple[str, ...], short: Mapping[tuple[str, ...], FittedHypothesis], attempts: Attempts
) -> bool:
    """True where one of several parameters, freed alone, leaves nearly as little."""
    alone = [short[name,].misfit for name in names if (name,) in short] if len(names) > 1 else []
    return any((1.0 - FURTHER_SHARE) * misfit < short[names].misfit for misfit in alone)


def _predicted_gain(
    problem: Problem,
    nominal: Rig,
    baseline: Fit,
    suspects: list[tuple[str, ...]],
    inflation: dict[str, float],
) -> dict[tuple[str, ...], float]:
    """Gain in chi-square, priors included, that freeing parameters brings by the sensitivities at
    the baseline.
    """
    if not suspects:
        return {}
    settings = problem.settings
    names = list(baseline.moved)
    rows, jacobian = stacked(problem, baseline.residuals, inflation)
    if jacobian is None:
        return {}
    scaled = jacobian[:, [list(baseline.values).index(n) for n in names]] * [
        baseline.scales[n] for n in names
    ]
    # the triangle of a QR decomposition has the same sums of squares in a few rows
    triangle: Array = np.asarray(np.linalg.qr(np.column_stack([scaled, rows]), mode="r"))
    slopes, rest = triangle[:, :-1], triangle[:, -1]
    begin = np.array([baseline.moved[n] for n in names])
    known = known_parameters(nominal)
    ends = [ends_in_tolerances(known[n], math.inf) for n in names]
    low, high = np.array(ends).T

    def cost(loose: tuple[str, ...]) -> float:
        bound = np.array([n not in loose for n in names], dtype=np.float64)
        wall = np.where(bound > 0.0, settings.most_tolerances, np.inf)
        prior = np.diag(bound)

        def evaluate(x: Array) -> tuple[Array, Array, None]:
            return (
                np.concatenate([rest + slopes @ (x - begin), bound * x]),
                np.concatenate([slopes, prior]),
                None,
            )

        limits = (np.maximum(low, -wall), np.minimum(high, wall))
        _, (values, _, _), _ = levenberg_marquardt(
            evaluate,
            begin,
            limits,
            evaluations=50,  # to its end: it is linear
            share=0.0,
        )
        return float(values @ values)

    was = cost(())
    return {loose: was - cost(loose) for loose in suspects}
