"""Limits: sizes from which recordings show an effect, and from which they can name it.

An effect at a typical size changes the residuals of the cut chain by a signature. Parameters inside
their tolerances and the error of the model may take what they can of it; the rest, in units of the
noise, gives the size from which the effect is detected. The rest that is left when another
signature of any size is taken out as well gives the size from which it is distinguished from that
one (Eriksson, Frisk & Krysander, A method for quantitative fault diagnosability analysis of
stochastic linear descriptor models, Automatica 49, 2013: distinguishability; the error of the model
counts as noise here).
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from pamrs._arrays import Array, Mask, solve_normal
from pamrs.diagnosis.fit import (
    Key,
    Problem,
    Start,
    acts_in,
    changes,
    fits,
    known_parameters,
    places_of,
    residuals,
    starts_of,
)
from pamrs.diagnosis.noise import NoiseLevel, bins_of
from pamrs.diagnosis.prepare import ROUNDING, Block, Prepared, binned
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CATALOGUE, Term
from pamrs.errors import ParameterError, RigError, SimulationError
from pamrs.findings import DETECTED, TOLD_APART, Limit
from pamrs.rig import Rig
from pamrs.simulation import core_rig

__all__ = ["Limits", "Products", "counted", "limits_of", "possible_starts", "products_of"]

_MOST_MULTIPLE = 1e4  # [typical sizes] largest size of an effect that is worth telling
# halvings of a size until a rig can have it: below a hundredth it is another effect
_MOST_HALVINGS = 8

Products = Mapping[tuple[Block, str], Array]
"""Products of all columns of a block in a recording with each other: curves of the model's error,
baseline parameters by one tolerance, signatures.
"""


def possible_starts(rig: Rig, blocks: Sequence[Block]) -> list[Start]:
    """Every start of every effect that a rig can have and does not have; at each place of an effect
    where some blocks distinguish these.
    """
    starts: list[Start] = []
    held_ids = {held["id"] for held in rig.effects}
    for effect in CATALOGUE:
        acting = any(acts_in(Term(effect), block) for block in blocks)
        if effect in held_ids or not acting or not fits(rig, effect):
            continue
        places = places_of(rig, effect, list(blocks))
        for term in [Term(effect, at) for at in places] or [Term(effect)]:
            usual = starts_of(term, sealed=rig.model["valve"] is None)
            starts += [s for start in usual if (s := _possible(rig, start)) is not None]
    return starts


def _possible(rig: Rig, start: Start) -> Start | None:
    """A start of an effect, halved until a rig can have it (a small arm does not carry as much
    payload as an effect takes away); None where it never can.
    """
    for halvings in range(_MOST_HALVINGS):
        smaller = start.scaled(0.5**halvings) if halvings else start
        with contextlib.suppress(ParameterError, RigError, SimulationError):
            core_rig(smaller.applied(rig))
            return smaller
    return None


def counted(prepared: Prepared, block: Block, settings: DiagnosisSettings) -> float:
    """Independent samples that a recording counts as in a block: fewer where its beginning is not
    judged.
    """
    dropped = min(prepared.n, prepared.unsettled.get(block.channel, 0))
    return settings.effective_samples * (1.0 - dropped / prepared.n)


def products_of(
    problem: Problem,
    rig: Rig,
    starts: Sequence[Start],
    baseline: Sequence[str],
    noise_level: Mapping[Key, NoiseLevel],
) -> Products:
    """Products of what some recordings show of effects, baseline parameters and the model's error.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    rig : Rig
        Model near to them, without the effects.
    starts : sequence of Start
        Effects at typical sizes.
    baseline : sequence of str
        Parameters that may move inside their tolerances.
    noise_level : dict
        By block and recording, with the curves of the model's error.

    Raises
    ------
    SimulationError
        If the model leaves the range in which it holds.
    """
    base = residuals(problem, rig, list(baseline))
    known = known_parameters(rig)
    tolerances = np.array([known[name].tol for name in baseline])
    columns: dict[tuple[Block, str], list[Array]] = {}
    weights: dict[tuple[Block, str], float] = {}
    for prepared in problem.recordings:
        for block in problem.blocks:
            place = block, prepared.recording.name
            base_residual = base[block.name, prepared.recording.name]
            level = noise_level[block.name, prepared.recording.name]
            free = (
                np.zeros((base_residual.value.size, 0))
                if base_residual.jacobian is None
                else base_residual.jacobian
            )
            means, counts = binned(free * tolerances, base_residual.rows, bins_of(prepared))
            curves = np.empty((means.shape[0], 0)) if level.curves is None else level.curves
            share = counted(prepared, block, problem.settings) / max(1, int((counts > 0).sum()))
            weights[place] = math.sqrt(share) / (level.binned_noise or math.inf)
            columns[place] = [curves, means, np.zeros((means.shape[0], len(starts)))]
    for k, start in enumerate(starts):
        acting = replace(problem, blocks=[b for b in problem.blocks if acts_in(start.effect, b)])
        try:
            found_with = changes(acting, start.applied(rig), base, start.effect)
        except SimulationError:
            continue  # this size leaves the range in which the model holds
        for prepared in problem.recordings:
            for block in acting.blocks:
                key = block.name, prepared.recording.name
                moved = found_with[key].value - base[key].value
                means, _ = binned(moved, base[key].rows, bins_of(prepared))
                columns[block, prepared.recording.name][2][:, k] = means
    every = {place: weights[place] * np.hstack(parts) for place, parts in columns.items()}
    return {place: rows.T @ rows for place, rows in every.items()}


def _freed(products: Array, count: int) -> Array:
    """Products of the last columns, the first (normal priors of one unit) being fitted out."""
    if count == 0:
        return products
    fitted_out, mixed = products[:count, :count], products[:count, count:]
    rest: Array = products[count:, count:] - mixed.T @ solve_normal(
        fitted_out + np.eye(count), mixed
    )
    return rest


def _copies(products: Array, curves: int, count: int) -> Array:
    """Multiple of each effect's signature at which all of them in a block are together as large as
    the curves of its error; infinite where an effect does not show.
    """
    power = np.diag(products)[products.shape[0] - count :]
    acting = power > ROUNDING**2
    error = float(np.trace(products[:curves, :curves])) / max(1, int(acting.sum()))
    return np.where(acting, np.sqrt(error / np.where(acting, power, 1.0)), math.inf)


def _without_error(products: Array, curves: int, copies: Array) -> Array:
    """Products of a block's baseline and signatures after the error of its model is fitted out: its
    curves, and a small copy of every effect (no model errs in functions of place alone).
    """
    error_and_baseline, signatures = np.split(
        np.arange(products.shape[0]), [products.shape[0] - copies.size]
    )
    order = np.concatenate(
        [error_and_baseline[:curves], signatures, error_and_baseline[curves:], signatures]
    )
    rest = np.ones(products.shape[0] - curves)
    scale = np.concatenate([np.ones(curves), np.where(np.isfinite(copies), copies, 0.0), rest])
    return _freed(products[np.ix_(order, order)] * np.outer(scale, scale), curves + copies.size)


class Limits:
    """Limits of effects by what some blocks show over some recordings.

    Parameters
    ----------
    products : dict
        As of :func:`products_of`; of several models or experiments joined.
    starts, baseline
        As there.
    settings : DiagnosisSettings
        How many samples of a recording are independent.

    Attributes
    ----------
    each : dict of str to Limit
        By effect.
    bits : float
        Half the logarithm of the determinant of the effects' information at their typical sizes
        [bit].
    """

    def __init__(
        self,
        products: Products,
        starts: Sequence[Start],
        baseline: Sequence[str],
        settings: DiagnosisSettings,
    ) -> None:
        self._products = products
        self._given = starts, baseline, settings
        names = [str(s.effect) for s in starts]
        k, count = len(baseline), len(starts)
        self.each = {name: Limit(name) for name in names}
        self.bits = 0.0
        if not products:
            return
        of_block: dict[Block, Array] = {}
        shown_alone: dict[tuple[Block, str], Array] = {}
        copies: dict[Block, Array] = {}
        for place, values in products.items():
            block, curves = place[0], values.shape[0] - k - count
            of_block[block] = of_block.get(block, 0.0) + values
            # a further recording never enlarges the error of the model
            sizes = _copies(values, curves, count)
            copies[block] = np.minimum(copies.get(block, math.inf), sizes)
            alone = np.diag(_freed(values[curves:, curves:], k))
            shown_alone[place] = np.sqrt(np.clip(alone, 0.0, None) / settings.effective_samples)
        rest = (_without_error(v, v.shape[0] - k - count, copies[b]) for b, v in of_block.items())
        total = np.asarray(sum(rest))
        # a parameter beyond its tolerances is a rival, too: its own column without a prior
        free = total - total[:, :k] @ solve_normal(total[:k, :k] + np.eye(k), total[:k])
        self._labels = np.array([*baseline, *names])
        self._free, self._power = free, np.clip(np.diag(free), 0.0, None)
        self._best = {names[j]: k + j for j in np.argsort(self._power[k:]).tolist()}
        for name, at in self._best.items():
            j = at - k
            where = max(shown_alone, key=lambda place: float(shown_alone[place][j]))
            self.each[name] = self._limit(
                starts[j], float(shown_alone[where][j]), (where[0].name, where[1])
            )
        chosen = [self._best[name] for name in self.each]
        information = np.eye(len(chosen)) + free[np.ix_(chosen, chosen)]
        self.bits = 0.5 * float(np.linalg.slogdet(information)[1]) / math.log(2.0)

    def acting(self, unexplained: Mapping[str, float] | None = None) -> list[Limit]:
        """Limits of the effects that act in a block; more than one noise level that a diagnosis
        leaves unexplained of a block counts as noise.
        """
        left = {name: size for name, size in (unexplained or {}).items() if size > 1.0}
        scaled = {
            (block, recording): values / left.get(block.name, 1.0) ** 2
            for (block, recording), values in self._products.items()
        }
        limits = Limits(scaled, *self._given) if left else self
        return [limit for limit in limits.each.values() if limit.block]

    def _taken(self, name: str, rivals: Mask) -> Array:
        """Part of an effect's squared signature that each rival column takes at its best size."""
        showing = rivals & (self._power > ROUNDING**2)
        shared = self._free[self._best[name]] ** 2
        return np.where(showing, shared, 0.0) / np.maximum(self._power, ROUNDING**2)

    def _limit(self, start: Start, shown: float, where: tuple[str, str]) -> Limit:
        """Limit of an effect by the one of its starts that shows most."""
        name = str(start.effect)
        power = float(self._power[self._best[name]])
        if shown < ROUNDING or power <= 0.0:
            return Limit(name)
        taken = self._taken(name, self._labels != name)
        rival = int(np.argmax(taken))
        distance = math.sqrt(max(power - float(taken[rival]), 0.0))
        named = Limit(
            name,
            shown,
            *where,
            seen=math.sqrt(power),
            distance=distance,
            rival=str(self._labels[rival]),
        )
        if not start.sizes:
            return named
        leading = start.sizes[0]
        return replace(
            named,
            size=leading,
            typical=abs(start.free[leading]),
            seen_from=_sized(start, DETECTED / named.seen),
            named_from=_sized(start, TOLD_APART / max(distance, 1e-300)),
        )

    @cached_property
    def unseparated(self) -> dict[tuple[str, str], float]:
        """Effects that are seen at their typical sizes and not told apart there, with the cosine of
        the angle between their signatures.
        """
        shown = [effect for effect, limit in self.each.items() if limit.seen >= DETECTED]
        return {
            pair: self._cosine(*pair)
            for pair in itertools.combinations(shown, 2)
            if self._apart(*pair) < TOLD_APART
        }

    def _cosine(self, one: str, other: str) -> float:
        """Cosine of the angle between two effects' signatures."""
        i, j = self._best[one], self._best[other]
        size = math.sqrt(max(float(self._power[i] * self._power[j]), 1e-300))
        return min(1.0, abs(float(self._free[i, j])) / size)

    def _apart(self, one: str, other: str) -> float:
        """Distance of two effects at their typical sizes, the smaller of both ways."""
        rests = (
            self._power[self._best[a]] - self._taken(a, self._labels == b).max()
            for a, b in ((one, other), (other, one))
        )
        return math.sqrt(max(min(map(float, rests)), 0.0))


def _sized(start: Start, size: float) -> float:
    """Leading parameter of an effect at a multiple of its start's size; NaN where its bounds hold
    it, or nobody would search for so much.
    """
    leading = start.sizes[0]
    value = start.scaled(size).free[leading]
    held = math.isclose(start.scaled(0.999 * size).free[leading], value, rel_tol=1e-9)
    return math.nan if held or size > _MOST_MULTIPLE else abs(value)


def limits_of(
    problem: Problem, rig: Rig, baseline: Sequence[str], noise_level: Mapping[Key, NoiseLevel]
) -> Limits:
    """Limits of every effect that a rig can have, by recordings that are there.

    Parameters
    ----------
    problem, rig, baseline, noise_level
        As of :func:`products_of`.

    Raises
    ------
    SimulationError
        If the model leaves the range in which it holds.
    """
    starts = possible_starts(rig, problem.blocks)
    products = products_of(problem, rig, starts, baseline, noise_level)
    return Limits(products, starts, baseline, problem.settings)
