"""Which effects are worth a fit: the score of each, the baseline's own freedom taken away first.

An effect at a typical size changes the residuals by a signature. What the baseline parameters (inside their tolerances) and the starts
of the windows can do is projected out of the signature and of the residual; what is left of the residual along what is left of the
signature is the gain in chi-square that the effect would bring (a score test, Rao 1948, with a finite change in the place
of the derivative, since many effects have none at zero).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.diagnosis.fitting import WIDEST, Fit, Problem, changes, stacked
from pamrs.diagnosis.starts import Start, starts_of
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import BLOCKS, qualified

__all__ = ["Score", "Screen", "Stand", "best_size", "by_effect", "screen", "stand_of"]

Array = NDArray[np.float64]
MOST = 8.0
"""Largest multiple of the typical size that a linear gain is believed at."""
LEVELS = 6
"""Levels of the tank's pressure that are tried for the thresholds of a compressor."""
REACHED = (0.5, 0.75, 0.93)
"""Quantiles of the angles that were seen at which an upper stop is tried; a lower one at the others."""
CORDS, BROAD = (0.06, 1.5, 14), 0.08
"""Shortest and longest cord [m] of a swinging payload that are tried, how many, and the damping ratio that they are tried with."""
TUBES = (0.6, 3.0)
"""Parts of the valve's conductance at which a tube is tried."""
INVISIBLE = 1e-6
"""Squared length [units of noise] of a signature below which it is none."""
LEAST = 0.002
"""Smallest multiple that a fit starts from."""
FAR, REFINED = 0.3, 3
"""Multiple of a size below which (and from ``MOST``) the signature is taken again at the size that is wanted, and how often at most."""


@dataclass(frozen=True, eq=False)
class Score:
    """What one effect, from one start, would bring.

    Attributes
    ----------
    effect : str
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

    effect: str
    start: Start
    gain: float
    size: float
    signature: Array


@dataclass(frozen=True, eq=False)
class Stand:
    """Where a fitted model stands, and what its free parameters could still do.

    Attributes
    ----------
    rows : (n,) array
        Stacked residuals.
    left : (n,) array
        What of them the free parameters leave, the pull of their priors included: where an effect would let a parameter go back to
        its nominal value, that counts for the effect.
    jacobian : (n, k) array
        Change of the rows with each free parameter that is not at the end of its range, in tolerances or its own scale.
    moved, free : (k,) array
        How far each is from its nominal value, and 1 where a prior holds it, 0 where none does.
    basis : (n, k) array
        Basis of what the free parameters can do, each column as long as the priors let it: its product with its transpose projects.
    """

    rows: Array
    left: Array
    jacobian: Array
    moved: Array
    free: Array
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
    stand : Stand
        The model.
    signatures : list of (effect, start, (n,) array)
        Each effect's, from each of its starts.
    """

    stand: Stand
    signatures: list[tuple[str, Start, Array]]

    def scores(self, stand: Stand | None = None, *, without: tuple[str, ...] = ()) -> list[Score]:
        """Every start of every effect, the most telling first.

        Parameters
        ----------
        stand : Stand, optional
            Another model than the screen's own (a fitted effect).
        without : tuple of str
            Effects to leave out.
        """
        own = self.stand if stand is None else stand
        found = []
        for effect, start, signature in self.signatures:
            if effect in without:
                continue
            power = own.power(signature)
            if power < INVISIBLE:
                continue
            size, gain = best_size(float(own.left @ signature), power, start)
            found.append(Score(effect, start, gain, size, signature))
        return sorted(found, key=lambda s: -s.gain)


def best_size(along: float, power: float, start: Start) -> tuple[float, float]:
    """Multiple of a start's size at which its signature gains most, inside what is believed, and that gain in chi-square.

    ``along`` is the product of what is left of the residual with the signature, ``power`` that of the signature with itself.
    """
    if power < INVISIBLE:
        return 0.0, 0.0
    low = -MOST if start.signed else LEAST
    size = float(np.clip(-along / power, low, MOST)) if start.scalable else 1.0
    return size, -2.0 * size * along - size**2 * power


def by_effect(scores: list[Score]) -> dict[str, list[Score]]:
    """Scores of each effect, effects and starts in the order of their gain."""
    found: dict[str, list[Score]] = {}
    for score in scores:
        found.setdefault(score.effect, []).append(score)
    return found


def stand_of(fitted: Fit, problem: Problem, inflation: dict[str, float]) -> Stand:
    """Stacked residuals of a fit, and what its free parameters can do.

    The priors enter as rows of their own, so that a parameter that its tolerance holds cannot explain anything away.
    """
    rows, jacobian = stacked(problem, fitted.residuals, inflation)
    if jacobian is None or jacobian.shape[1] == 0:
        none = np.zeros((rows.size, 0))
        return Stand(rows, rows, none, np.zeros(0), np.zeros(0), none)
    # a parameter at the end of its range cannot go on: what it would explain is left for an effect
    names = [n for n in fitted.values if abs(fitted.held_by_prior.get(n, 0.0)) < WIDEST - 1e-3]
    scales = np.array([fitted.scales[name] for name in names])
    scaled = jacobian[:, [list(fitted.values).index(name) for name in names]] * scales
    free = np.array([name in fitted.held_by_prior for name in names], dtype=np.float64)
    # J (J'J + prior)^-1 J' is the projector that a prior leaves; its square root's columns are the basis
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    keep = values > 1e-10 * max(float(values[-1]), 1e-300)
    u = scaled @ vectors[:, keep] / np.sqrt(values[keep])
    inner = (vectors[:, keep] * np.sqrt(values[keep])).T
    normal = inner.T @ inner + np.diag(free) + 1e-12 * np.eye(free.size)
    shrunk = inner @ np.linalg.solve(normal, inner.T)
    weights, turn = np.linalg.eigh(0.5 * (shrunk + shrunk.T))
    basis = (u @ turn) * np.sqrt(np.clip(weights, 0.0, 1.0))
    moved = np.array([fitted.held_by_prior.get(name, 0.0) for name in names])
    pull = u @ (inner @ np.linalg.solve(normal, moved))
    return Stand(rows, rows - basis @ (basis.T @ rows) - pull, scaled, moved, free, basis)


def screen(problem: Problem, fitted: Fit, effects: list[str], inflation: dict[str, float], *, sealed: bool) -> Screen:
    """Signatures of effects at a fitted model.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    fitted : Fit
        The model.
    effects : list of str
        Ids to screen.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fitting.fit`.
    sealed : bool
        Whether the rig has no valve.
    """
    stand = stand_of(fitted, problem, inflation)
    signatures: list[tuple[str, Start, Array]] = []

    def try_(start: Start, looks: int = REFINED) -> float:
        """Add the signature of a start; what it would bring."""
        tried, entry, score = start, None, None
        for _ in range(looks):
            try:
                found = changes(problem, tried.applied(fitted.rig), fitted.residuals, start.effect)
            except SimulationError:
                break  # this size leaves the range in which the model holds
            moved, _ = stacked(problem, found, inflation)
            entry = (start.effect, tried, moved - stand.rows)
            score = max(Screen(stand, [entry]).scores(), key=lambda s: s.gain, default=None)
            if score is None or score.gain <= 0.0 or not start.scalable or FAR <= abs(score.size) < MOST:
                break
            # what a stop or a threshold does is not in proportion to its size: it is looked at where it would be
            wanted = tried.scaled(abs(score.size))
            if wanted == tried:
                break  # its bounds hold it
            tried = wanted
        if entry is not None:
            signatures.append(entry)
        return -math.inf if score is None else score.gain

    for effect in effects:
        starts = _placed(starts_of(effect, sealed=sealed), problem, fitted.rig)
        if effect == "payload_swing":
            for start in _nearest(starts, lambda start: try_(start, 1), signatures):
                try_(start)
        elif effect == "compressor_cut_in":
            before = len(signatures)
            best = _switched(starts[0], problem, lambda start: try_(start, 1))
            signatures[before:] = [entry for entry in signatures[before:] if entry[1] is best]
        else:
            for start in starts:
                try_(start)
    return Screen(stand, signatures)


def _placed(starts: list[Start], problem: Problem, rig: Rig) -> list[Start]:
    """Starts moved to where they act: a stop to angles that were seen, a tube to the valve's own conductance."""
    if starts and starts[0].effect == "tube_flow_restriction":
        return _behind_valve(starts, problem, rig)
    place = "joint_end_stop.angle"
    seen = [p.signals[name][0] for p in problem.recordings for name in p.signals if name.startswith("joint_angle")]
    if not seen or not starts or place not in starts[0].free:
        return starts
    angles = np.concatenate(seen)

    def at(start: Start, share: float) -> Start:
        lower = start.held["joint_end_stop.side"] < 0.0
        return replace(start, free=start.free | {place: float(np.quantile(angles, 1.0 - share if lower else share))})

    return [at(start, share) for start in starts for share in REACHED]


def _nearest(starts: list[Start], try_: Callable[[Start], float], signatures: list[tuple[str, Start, Array]]) -> list[Start]:
    """The cords that tell most among many lengths: what swings long has to be met within a few percent of its frequency.

    They are tried with more damping than a payload has, which makes the resonance broader than the distance between two lengths.
    """
    length, damping = "payload_swing.length", "payload_swing.damping_ratio"
    before = len(signatures)
    tried = [replace(starts[0], free=starts[0].free | {length: float(x), damping: BROAD}) for x in np.geomspace(*CORDS)]
    gains = [try_(start) for start in tried]
    del signatures[before:]
    order = sorted(range(len(tried)), key=lambda k: -gains[k])
    # the best and the best that is no neighbour of it
    far = [k for k in order[1:] if abs(k - order[0]) > 1]
    return [tried[k] for k in (order[0], *far[:1])]


def _behind_valve(starts: list[Start], problem: Problem, rig: Rig) -> list[Start]:
    """Tubes in parts of the largest valve's conductance; an arm, driven by what is read, sees only one behind the transducer."""
    areas = [rig.parameter(f"{qualified('valve', name)}.discharge_area_max").value for name in rig.tables("valve")]
    unit = _core.Gas(*(rig.model["gas"][key.name] for key in BLOCKS["gas"])).area_of_conductance(1.0)
    arm = all(block.kind == "arm" for block in problem.blocks)
    return [
        replace(start, free=start.free | {"tube_flow_restriction.conductance": part * max(areas) / unit})
        for start in starts
        for part in TUBES
        if start.held["tube_flow_restriction.tap"] or not arm
    ]


def _switched(start: Start, problem: Problem, try_: Callable[[Start], float]) -> Start | None:
    """The pressures between which a compressor switches: over the range that the tank was seen in, then closer and closer.

    A relay that is asked once a step has no slope in its thresholds, so that no fit can move them.
    """
    seen = [p.signals[name][0] for p in problem.recordings for name in p.signals if name.startswith("supply_pressure")]
    if not seen:
        return None
    low, high = (float(f(np.concatenate(seen))) for f in (np.min, np.max))
    step = (high - low) / LEVELS
    if step <= 0.0:
        return None

    def at(cut_in: float, cut_out: float) -> Start:
        own = {f"{start.effect}.cut_in_pressure": cut_in, f"{start.effect}.cut_out_pressure": cut_out}
        return replace(start, free={n: v for n, v in start.free.items() if n not in own}, held=start.held | own)

    levels = [low + (k + 0.5) * step for k in range(LEVELS)]
    tried = [(try_(s), a, b, s) for a in levels for b in (*levels, high + step) if b > a for s in [at(a, b)]]
    best = max(tried, key=lambda t: t[0])
    while step > 5e-3 * (high - low):
        step *= 0.5
        _, a, b, _ = best
        around = [(a - step, b), (a + step, b), (a, b - step), (a, b + step)]
        tried = [(try_(s), c, d, s) for c, d in around if 0.0 < c < d for s in [at(c, d)]]
        best = max([best, *tried], key=lambda t: t[0])
    return best[3]
