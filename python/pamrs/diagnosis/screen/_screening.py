"""Screen for effects that are worth a fit: a score for each, the baseline's freedom taken away
first.

An effect at a typical size changes the residuals by a signature. What the baseline parameters
(inside their tolerances) and the starts of the windows can do is projected out of the signature and
of the residual; what is left of the residual along what is left of the signature is the gain in
chi-square that the effect would bring (a score test, Rao 1948, with a finite change instead of the
derivative, since many effects have none at zero).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, solve_normal
from pamrs.channels import channel_of
from pamrs.diagnosis.fit import (
    Fit,
    Key,
    Problem,
    Start,
    acts_in,
    changes,
    places_of,
    stacked,
    starts_of,
)
from pamrs.diagnosis.prepare import ROUNDING, Block, Residual
from pamrs.effects import EffectParameter, Term
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import BLOCKS

_MOST_LINEAR = 8.0  # [typical sizes] largest size at which a linear gain is relied on (decision 13)
# [typical sizes] smallest start: a compressor may deliver 500 times less (decision 20)
_LEAST_SIGNATURE_SIZE = 0.002
# [sizes tried] size below which (and from most_size) the signature is taken again there
_REPEAT_BELOW = 0.3
# signatures of one start at the most, each at the size that the last one suggested
_MOST_SIGNATURES = 3
# [typical sizes] sizes at which each start is tried where a mismatch is strong (decision 13)
STRONG_SIZES = (0.05, 0.3, 4.0, 20.0)
_THRESHOLD_LEVELS = 6  # levels of a channel that are tried for the thresholds of a switch
_THRESHOLD_PRECISION = 5e-3  # share of the channel's range to which they are narrowed down
# quantiles of a channel tried as a place of contact; from above at the others
_PLACE_SHARES = (0.5, 0.75, 0.93)
# parts of a valve's largest opening at which a restriction next to it is tried
_OPENING_SHARES = (0.6, 3.0)


Signature = tuple[Term, Start, Array]
"""Effect, where it starts, and what it does to the stacked residuals there."""
_Values = tuple[str, str, tuple[tuple[str, float], ...]]
"""Effect, form, and its parameters with their values, SI."""


@dataclass(frozen=True, eq=False)
class Score:
    """Gain in chi-square that one effect, from one start, would bring.

    Attributes
    ----------
    effect : Term
        Its id.
    start : Start
        Where it starts.
    gain : float
        Gain in chi-square.
    size : float
        Multiple of the start's size at which it is largest.
    signature : (n,) array
        Change of the stacked residuals at the start's size.
    """

    effect: Term
    start: Start
    gain: float
    size: float
    signature: Array


@dataclass(frozen=True, eq=False)
class Tangent:
    """Residual and tangent space of a fitted model.

    Attributes
    ----------
    rows : (n,) array
        Stacked residuals.
    left : (n,) array
        What of them the free parameters leave, the pull of their priors included: where an effect
        would let a parameter go back to its nominal value, that counts for the effect.
    basis : (n, k) array
        Basis of what the free parameters that are not at the end of their range can do, each column
        as long as the priors let it: its product with its transpose projects.
    """

    rows: Array
    left: Array
    basis: Array

    @property
    def power_left(self) -> float:
        """Squared length of what the free parameters leave of the residuals."""
        return max(float(self.left @ self.left), 1e-300)

    def power(self, signature: Array) -> float:
        """Squared length of what the free parameters leave of a signature."""
        return float(signature @ (signature - self.basis @ (self.basis.T @ signature)))


@dataclass(frozen=True, eq=False)
class Screen:
    """Signatures of effects at a fitted model, to be scored against any residual near to it.

    Attributes
    ----------
    tangent : Tangent
        The model.
    signatures : list of (effect, start, (n,) array)
        Each effect's, from each of its starts.
    strong : bool
        Whether so much is left that signatures, linear in what a strong effect is not, rank effects
        and no more.
    """

    tangent: Tangent
    signatures: list[Signature]
    strong: bool = False

    def scores(
        self, tangent: Tangent | None = None, *, without: tuple[Term, ...] = ()
    ) -> list[Score]:
        """Every start of every effect, the most telling first.

        Parameters
        ----------
        tangent : Tangent, optional
            Another model than the screen's own (a fitted effect).
        without : tuple of Term
            Effects to leave out, with those that cannot act with them.
        """
        space = self.tangent if tangent is None else tangent
        scores = []
        for effect, start, signature in self.signatures:
            if effect.excluded_by(without):
                continue
            power = space.power(signature)
            if power < ROUNDING:
                continue
            size, gain = _best_size(float(space.left @ signature), power, start)
            scores.append(Score(effect, start, gain, size, signature))
        return sorted(scores, key=lambda s: -s.gain)


def _best_size(along: float, power: float, start: Start) -> tuple[float, float]:
    """Multiple of a start's size at which its signature gains most, inside its plausible range, and
    that gain in chi-square.

    ``along`` is the product of what is left of the residual with the signature, ``power`` that of
    the signature with itself.
    """
    if power < ROUNDING:
        return 0.0, 0.0
    low = -_MOST_LINEAR if start.signed else _LEAST_SIGNATURE_SIZE
    size = float(np.clip(-along / power, low, _MOST_LINEAR)) if start.sizes else 1.0
    return size, -2.0 * size * along - size**2 * power


def by_effect(scores: list[Score]) -> dict[Term, list[Score]]:
    """Scores of each effect, effects and starts in the order of their gain."""
    ranked: dict[Term, list[Score]] = {}
    for score in scores:
        ranked.setdefault(score.effect, []).append(score)
    return ranked


def best_of_each_kind(scores: list[Score]) -> list[Score]:
    """Best score of each form and choice of an effect, the best first."""
    best: dict[tuple[str, frozenset[tuple[str, float]]], Score] = {}
    for score in scores:
        best.setdefault(score.start.kind, score)
    return list(best.values())


def tangent_of(fitted: Fit, problem: Problem, inflation: dict[str, float]) -> Tangent:
    """Stacked residuals of a fit, and what its free parameters can do.

    The priors enter as rows of their own, so that a parameter that its tolerance holds cannot
    explain anything away.
    """
    rows, jacobian = stacked(problem, fitted.residuals, inflation)
    # a parameter at the end of its range cannot go on: what it would explain is left for an effect
    walls = problem.settings.most_tolerances
    names = [n for n in fitted.values if abs(fitted.held_by_prior.get(n, 0.0)) < walls - 1e-3]
    if jacobian is None or not names:
        return Tangent(rows, rows, np.zeros((rows.size, 0)))
    scales = np.array([fitted.scales[name] for name in names])
    scaled = jacobian[:, [list(fitted.values).index(name) for name in names]] * scales
    free = np.array([name in fitted.held_by_prior for name in names], dtype=np.float64)
    # J (J'J + prior)^-1 J' is the projector that a prior leaves; its square root's columns are the
    # basis
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    keep = values > 1e-10 * max(float(values[-1]), 1e-300)
    u = scaled @ vectors[:, keep] / np.sqrt(values[keep])
    inner = (vectors[:, keep] * np.sqrt(values[keep])).T
    normal = inner.T @ inner + np.diag(free)
    shrunk = inner @ solve_normal(normal, inner.T)
    weights, turn = np.linalg.eigh(0.5 * (shrunk + shrunk.T))
    basis = (u @ turn) * np.sqrt(np.clip(weights, 0.0, 1.0))
    moved = np.array([fitted.held_by_prior.get(name, 0.0) for name in names])
    pull = u @ (inner @ solve_normal(normal, moved))
    return Tangent(rows, rows - basis @ (basis.T @ rows) - pull, basis)


def screen(
    problem: Problem,
    fitted: Fit,
    effects: list[Term],
    inflation: dict[str, float],
    *,
    sealed: bool,
    strong: bool = False,
) -> Screen:
    """Signatures of effects at a fitted model.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    fitted : Fit
        The model.
    effects : list of Term
        Those to screen, by their ids, with a place where they act at one block of several.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fit.fit`.
    sealed : bool
        Whether the rig has no valve.
    strong : bool, optional
        Whether so much is left that a signature at one size tells little of another: each start is
        then looked at in several.
    """
    search = _SignatureSearch(
        problem, fitted, inflation, tangent_of(fitted, problem, inflation), strong
    )
    for effect in effects:
        if not effect.at:
            search.residuals_of.clear()
        starts = starts_of(effect, sealed=sealed)
        for form in dict.fromkeys(start.form for start in starts):
            search.add_form([start for start in starts if start.form == form])
    return Screen(search.tangent, search.signatures, strong)


@dataclass(frozen=True, eq=False)
class _SignatureSearch:
    """A fitted model at which signatures are taken.

    Attributes
    ----------
    problem : Problem
        Blocks and recordings.
    fitted : Fit
        The model.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fit.fit`.
    tangent : Tangent
        Of the model.
    strong : bool
        As in :func:`screen`.
    signatures : list of (effect, start, (n,) array)
        Those that were taken.
    everywhere : dict of values to Start
        Where the looks at an effect at every block of its kind ended, by where they began: those at
        one of these blocks begin there.
    residuals_of : dict of values to dict
        What it does there, by block and recording.
    """

    problem: Problem
    fitted: Fit
    inflation: dict[str, float]
    tangent: Tangent
    strong: bool
    signatures: list[Signature] = field(default_factory=list)
    everywhere: dict[_Values, Start] = field(default_factory=dict)
    residuals_of: dict[_Values, dict[Key, Residual]] = field(default_factory=dict)

    def add_form(self, starts: list[Start]) -> None:
        """Add the signatures of one form of an effect, given all its starts."""
        first = starts[0]
        parameters = first.effect.info.form(first.form).parameters
        if any(p.scan for p in parameters):
            for start in _scan_resonance(
                first, lambda start: self.add_signature(start, 1), self.signatures
            ):
                self.add_signature(start)
                self.add_signature(_as_usual(start, first))
        elif any(p.role == "threshold" for p in parameters):
            before = len(self.signatures)
            best = _find_thresholds(first, self.problem, lambda start: self.add_signature(start, 1))
            self.signatures[before:] = [s for s in self.signatures[before:] if s[1] is best]
        else:
            for start in _moved_to_action(starts, self.problem, self.fitted.rig):
                self.add_signature(start)

    def add_signature(self, start: Start, most: int | None = None) -> float:
        """Add the signature of a start; return its gain in chi-square (minus infinity: none)."""
        everywhere = self.everywhere.get(_values(start)) if start.effect.at else None
        start_tried, best = start if everywhere is None else everywhere.moved(start.effect), None
        for _ in range(_MOST_SIGNATURES if most is None else most):
            shown = self._signature_of(start_tried)
            if shown is None:
                break
            best = shown
            score = shown[1]
            if (
                score is None
                or score.gain <= 0.0
                or not start.sizes
                or _REPEAT_BELOW <= abs(score.size) < _MOST_LINEAR
            ):
                break
            # what a stop or a threshold does is not in proportion to its size: it is looked at
            # where it would be
            wanted = start_tried.scaled(abs(score.size))
            if wanted == start_tried:
                break  # its bounds hold it
            start_tried = wanted
        if self.strong and start.sizes and most is None and everywhere is None:
            others = [self._signature_of(start.scaled(size)) for size in STRONG_SIZES]
            # what a signature says of other sizes than its own is not relied on
            known = [shown for shown in (best, *others) if shown is not None]
            best = max(known, key=lambda shown: self._taken(shown[0]), default=None)
        if best is None:
            return -math.inf
        self.signatures.append(best[0])
        if not start.effect.at:
            self.everywhere[_values(start)] = best[0][1]
        return -math.inf if best[1] is None else best[1].gain

    def _signature_of(self, start: Start) -> tuple[Signature, Score | None] | None:
        """The signature of a start and its score; None where the model cannot be run so."""
        what = f"the signature of {start.effect}"
        block_residuals = self.problem.losses.part(what, lambda: self._changes(start))
        if block_residuals is None:
            return None
        if not start.effect.at:
            self.residuals_of[_values(start)] = block_residuals
        rows, _ = stacked(self.problem, block_residuals, self.inflation)
        entry = (start.effect, start, rows - self.tangent.rows)
        return entry, next(iter(Screen(self.tangent, [entry]).scores()), None)

    def _changes(self, start: Start) -> dict[Key, Residual] | None:
        """Residuals with an effect at the size of a start; None where that leaves the range in
        which the model holds.
        """
        fitted, known = self.fitted, self._known(start)
        try:
            rig = start.applied(fitted.rig)
            return changes(self.problem, rig, fitted.residuals, start.effect, known)
        except SimulationError:
            return None

    def _known(self, start: Start) -> dict[Key, Residual]:
        """Residuals known of an effect at one place: in blocks where it acts at no other place,
        those of the effect everywhere.
        """
        term = start.effect
        everywhere = self.residuals_of.get(_values(start), {}) if term.at else {}
        if not everywhere:
            return {}
        others = places_of(self.fitted.rig, term.id, self.problem.blocks)
        rivals = [t for at in others if (t := Term(term.id, at)) != term]
        alone = {b.name for b in self.problem.blocks if not any(acts_in(t, b) for t in rivals)}
        return {key: r for key, r in everywhere.items() if key[0] in alone}

    def _taken(self, entry: Signature) -> float:
        """Reduction of the chi-square by a start at its own size."""
        signature = entry[2]
        along = float(self.tangent.left @ signature)
        return -2.0 * along - self.tangent.power(signature)


def _values(start: Start) -> _Values:
    """Effect, form and values of a start, wherever it acts."""
    values = start.free | start.fixed
    unplaced = tuple(sorted((n.removeprefix(str(start.effect)), v) for n, v in values.items()))
    return start.effect.id, start.form, unplaced


def _measured(problem: Problem, channel: str) -> Array | None:
    """Everything that was measured of the channels of one kind; None where there is none."""
    measured = [
        p.signals[name][0]
        for p in problem.recordings
        for name in p.signals
        if channel_of(name) == channel
    ]
    return np.concatenate(measured) if measured else None


def _moved_to_action(starts: list[Start], problem: Problem, rig: Rig) -> list[Start]:
    """Starts moved to where they act: a contact to places that were reached, a restriction to the
    size of the opening next to it.
    """
    effect = starts[0].effect
    info = effect.info
    parameters = info.form(starts[0].form).parameters
    opening = next((p for p in parameters if p.like), None)
    if opening is not None:
        return _restrictions_like(starts, opening, problem, rig)
    place = next((p for p in parameters if p.role == "place"), None)
    reached = None if place is None else _measured(problem, place.channel)
    if place is None or reached is None:
        return starts
    sides = [f"{effect}.{side.name}" for side in parameters if side.role == "side"]

    def at(start: Start, share: float) -> Start:
        lower = any(start.fixed[side] < 0.0 for side in sides)
        there = float(np.quantile(reached, 1.0 - share if lower else share))
        return replace(start, free=start.free | {f"{effect}.{place.name}": there})

    return [at(start, share) for start in starts for share in _PLACE_SHARES]


def _scan_resonance(
    start: Start, add_signature: Callable[[Start], float], signatures: list[Signature]
) -> list[Start]:
    """Starts at the frequencies that gain most among many: what swings long has to be met within a
    few percent of its frequency.

    They are tried with more damping than the effect has, which makes the resonance broader than the
    distance between two values.
    """
    parameters = start.effect.info.form(start.form).parameters
    scanned = next(p for p in parameters if p.scan)
    assert scanned.scan is not None
    broad = {f"{start.effect}.{p.name}": p.tried for p in parameters if p.tried is not None}
    before = len(signatures)
    name = f"{start.effect}.{scanned.name}"
    starts = [
        replace(start, free=start.free | {name: float(x)} | broad)
        for x in np.geomspace(*scanned.scan)
    ]
    gains = [add_signature(one) for one in starts]
    del signatures[before:]
    order = sorted(range(len(starts)), key=lambda k: -gains[k])
    # the best and the best that is no neighbour of it
    far = [k for k in order[1:] if abs(k - order[0]) > 1]
    return [starts[k] for k in (order[0], *far[:1])]


def _as_usual(start: Start, first: Start) -> Start:
    """Start whose resonance is as broad as usual: from a broader one a fit may end next to it."""
    parameters = start.effect.info.form(start.form).parameters
    names = [f"{start.effect}.{p.name}" for p in parameters if p.tried is not None]
    return replace(start, free=start.free | {name: first.free[name] for name in names})


#: Of a valve by ISO 6358.
_CONDUCTANCES = ("fill_conductance", "vent_conductance")


def _restrictions_like(
    starts: list[Start], parameter: EffectParameter, problem: Problem, rig: Rig
) -> list[Start]:
    """Restrictions in parts of the conductance of the largest opening next to them, where a block
    could show them.
    """
    kind, _, area = parameter.like.partition(".")
    unit = _core.Gas(*(rig.model["gas"][key.name] for key in BLOCKS["gas"])).area_of_conductance(
        1.0
    )
    areas = [
        table[area] if area in table else unit * max(table[key] for key in _CONDUCTANCES)
        for table in rig.tables(kind).values()
    ]
    name = f"{starts[0].effect}.{parameter.name}"
    return [
        replace(start, free=start.free | {name: part * max(areas) / unit})
        for start in starts
        for part in _OPENING_SHARES
        if any(_shows(start, block) for block in problem.blocks)
    ]


def _shows(start: Start, block: Block) -> bool:
    """True where an effect acts in a block with the choices that a start holds."""
    values = start.free | start.fixed
    parameters = [
        p for p in start.effect.info.form(start.form).parameters if block.kind in p.needed_in
    ]
    return acts_in(start.effect, block) and all(
        values[f"{start.effect}.{p.name}"] for p in parameters
    )


def _find_thresholds(
    start: Start, problem: Problem, add_signature: Callable[[Start], float]
) -> Start | None:
    """The levels of a channel between which something switches: over the range that was seen, then
    closer and closer.

    A relay that is asked once a step has no slope in its thresholds, so that no fit can move them.
    """
    on, off = start.effect.info.with_role("threshold")
    measured = _measured(problem, on.channel)
    if measured is None:
        return None
    low, high = (float(f(measured)) for f in (np.min, np.max))
    step = (high - low) / _THRESHOLD_LEVELS
    if step <= 0.0:
        return None

    def at(switch_on: float, switch_off: float) -> Start:
        thresholds = {
            f"{start.effect}.{on.name}": switch_on,
            f"{start.effect}.{off.name}": switch_off,
        }
        return replace(
            start,
            free={n: v for n, v in start.free.items() if n not in thresholds},
            fixed=start.fixed | thresholds,
        )

    levels = [low + (k + 0.5) * step for k in range(_THRESHOLD_LEVELS)]
    pairs = [
        (add_signature(s), a, b, s)
        for a in levels
        for b in (*levels, high + step)
        if b > a
        for s in [at(a, b)]
    ]
    best = max(pairs, key=lambda t: t[0])
    while step > _THRESHOLD_PRECISION * (high - low):
        step *= 0.5
        _, a, b, _ = best
        around = [(a - step, b), (a + step, b), (a, b - step), (a, b + step)]
        pairs = [(add_signature(s), c, d, s) for c, d in around if 0.0 < c < d for s in [at(c, d)]]
        best = max([best, *pairs], key=lambda t: t[0])
    return best[3]
