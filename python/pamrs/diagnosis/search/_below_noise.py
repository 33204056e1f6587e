"""Effects that show although only noise is left: by a signature that is smaller, or by a parameter
that had to move far instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.evidence import (
    STANDING_PRICE,
    Attempts,
    BlockGroup,
    Candidate,
    capped_probability,
    lacks_drift,
    loss_by_values,
    penalty,
    price,
    visited_ranges,
)
from pamrs.diagnosis.fit import (
    Fit,
    Key,
    Problem,
    Start,
    acts_in,
    fit,
    known_parameters,
    residuals,
    stacked,
)
from pamrs.diagnosis.prepare import Residual
from pamrs.diagnosis.screen import Screen, Tangent, by_effect, inclusion_shares, screen
from pamrs.effects import UNDECIDED, UNLISTED, Term
from pamrs.errors import SimulationError

# share of a stated error that a signature has by chance: most had less (decision 111)
_STATED_SHARE = 0.3
_RIVAL_SHARE = 0.3  # share of the largest gain from which another effect is its rival (decision 20)
_MOST_FITTED = 4  # rivals that are fitted
_HELD_OUT_SHARE = 0.05  # share of the gain that held-out recordings have to show (decision 20)
# share of chi-square that weighs rivals: their equations are not quite true (decision 20)
_GAIN_WEIGHT = 0.1
_LOG_ODDS = 6.0  # log odds of an effect to unlisted where nothing speaks against it (decision 20)
_MOST_PROBABILITY = 0.93  # largest probability of an effect below the noise (decision 20)
# [tolerances] moved by a parameter that effects may undo: healthy 1.2 at most (decision 20)
_MOVED_TOLERANCES = 1.75
# cosine of two signatures from which an effect does the same as a parameter (decision 20)
_SAME_COSINE = 0.8
# [chi-square] fall of the priors' sum of squares that an effect has to bring (decision 20)
_RELIEF = 3.0
# log odds of parameters that are off to all effects that do the same (decision 20)
_PARAMETERS_LOG_ODDS = 1.5
_GONE_BACK_SHARE = 0.5  # share of its movement to which the parameter has to go back (decision 20)


@dataclass(frozen=True)
class Begun:
    """Where the fit of an effect below the noise begins.

    Attributes
    ----------
    start : Start
        The effect.
    back : dict of str to float
        Parameters that it is confounded with, put back to their nominal values; empty where the
        residual speaks for the effect.
    """

    start: Start
    back: dict[str, float]


def find_below_noise(
    trial: Attempts, quiet: BlockGroup, acting: list[Term], say: Callable[[str], None]
) -> BlockGroup | None:
    """An effect that shows although the refitted baseline leaves no more than noise; None where
    there is none.

    The variance of a residual tells nothing of what is much smaller than the noise, a score test
    along a known signature does. Noise that came in with the drives is autocorrelated and counts by
    its correlation time. Held-out recordings have to agree.

    Where an effect and a parameter do the same (a lost activation pressure and the zero of the
    transducer), nothing is left at all; what speaks for the effect is how far the parameter had to
    leave its nominal value, and the two stay a set.

    Parameters
    ----------
    trial : Attempts
        Recordings, model, noise levels.
    quiet : BlockGroup
        The blocks, none of which keeps an excess.
    acting : list of Term
        Effects that act in them.
    say : callable
        Receives progress.
    """
    if trial.same:
        return None
    start, settings = quiet.candidates[0], trial.settings
    autocorrelation = trial.autocorrelation(start.fit)
    screened = screen(
        trial.inner, start.fit, acting, autocorrelation, sealed=trial.nominal.model["valve"] is None
    )
    best = {effect: scores[0] for effect, scores in by_effect(screened.scores()).items()}
    gains = {effect: score.gain for effect, score in best.items()}
    needed = settings.least_gain_below_noise + _gain_by_chance(trial, screened.tangent)
    least = max(needed, _RIVAL_SHARE * max(gains.values(), default=0.0))
    chosen = [e for e in sorted(gains, key=lambda e: -gains[e]) if gains[e] > least][:_MOST_FITTED]
    starts = {e: Begun(best[e].start.scaled(best[e].size), {}) for e in chosen}
    starts = starts or _matching_shifted(screened, start.fit, trial, autocorrelation)
    against = _fit_baseline_exactly(trial, start.fit, starts, autocorrelation) if starts else None
    if against is None:
        return None
    found = _Found({}, {})
    names = " and ".join(b.name for b in quiet.blocks)
    for effect, begun in starts.items():
        why = ", ".join(f"{n} moved far where {effect} does the same" for n in begun.back)
        say(
            f"{names}: no more than noise, "
            + (why or f"with a signature of {effect} in it (chi-square {gains[effect]:.3g})")
        )
        values = against.fit.values | begun.back
        tried = trial.fit_effects(
            [begun.start], replace(against.fit, values=values), autocorrelation, share=0.0
        )
        if tried is not None:
            tried = replace(tried, gain=gains.get(effect, 0.0))
            _add_if_shown(found, tried, begun, against, trial, needed)
    if not found.shown and not found.eased:
        return None
    often = (
        inclusion_shares(screened, settings.least_gain_below_noise, 1.0, trial.settings)
        if found.shown
        else {}
    )
    return replace(_group(found, quiet, starts, trial), inclusion=often)


def _gain_by_chance(trial: Attempts, tangent: Tangent) -> float:
    """Gain in chi-square that a signature has by chance where the rig file states an error of the
    model: a smooth error has a share of any shape.
    """
    stated = max((level.stated for level in trial.noise_level.values()), default=0.0)
    return _STATED_SHARE * stated * tangent.power_left


@dataclass(frozen=True, eq=False)
class _Finest:
    """The baseline fitted to its last unit of chi-square.

    Attributes
    ----------
    fit : Fit
        On the recordings to fit.
    autocorrelation : dict of str to float
        Weights of the noise's autocorrelation.
    inside, outside : float
        Chi-square on the recordings to fit and on those held out.
    """

    fit: Fit
    autocorrelation: dict[str, float]
    inside: float
    outside: float


@dataclass(frozen=True, eq=False)
class _Found:
    """Log odds of effects whose signature is in the residual, and of effects that let a parameter
    go back.
    """

    shown: dict[Candidate, float]
    eased: dict[Candidate, float]


def _fit_baseline_exactly(
    trial: Attempts, start: Fit, starts: dict[Term, Begun], autocorrelation: dict[str, float]
) -> _Finest | None:
    """The baseline to the last unit of chi-square and from wherever an effect begins: what it still
    has to gain would count for one.
    """
    begins = [
        start,
        *(replace(start, values=start.values | b.back) for b in starts.values() if b.back),
    ]
    try:
        fits = [
            fit(trial.inner, trial.nominal, (), {}, autocorrelation, warm=begin, share=0.0)
            for begin in begins
        ]
        finest = min(fits, key=lambda f: f.cost)
        outside = _chi_square(trial.outer, residuals(trial.outer, finest.rig), autocorrelation)
    except SimulationError:
        return None
    return _Finest(
        finest,
        autocorrelation,
        _chi_square(trial.inner, finest.residuals, autocorrelation),
        outside,
    )


def _add_if_shown(
    found: _Found,
    tried: Candidate,
    begun: Begun,
    against: _Finest,
    trial: Attempts,
    needed: float,
) -> None:
    """Put a fitted effect among those that are found, if chi-square (a gain of more than `needed`)
    or priors and held-out recordings speak for it.
    """
    autocorrelation = against.autocorrelation
    seconds = max(p.n * p.dt for p in trial.inner.recordings)
    within = against.inside - _chi_square(trial.inner, tried.fit.residuals, autocorrelation)
    over = against.outside - _chi_square(
        trial.outer, residuals(trial.outer, tried.fit.rig), autocorrelation
    )
    relief = against.fit.strain - tried.fit.strain
    gain = within + relief
    odd = STANDING_PRICE * lacks_drift(tried, seconds) + loss_by_values(
        tried, visited_ranges(trial.inner)
    )
    if odd > _LOG_ODDS:
        return  # it would have to have values that its physics hardly has
    cost = price(tried, trial.settings)
    if gain > needed and over > _HELD_OUT_SHARE * gain:
        found.shown[tried] = 0.5 * _GAIN_WEIGHT * (gain + over) - _GAIN_WEIGHT * cost - odd
    elif (
        _gone_back(begun, against.fit, tried.fit, _GONE_BACK_SHARE)
        and relief > _RELIEF
        and min(gain, gain + over) > _RELIEF
    ):
        found.eased[tried] = (
            0.5 * min(relief, gain, gain + over) - cost - odd - _PARAMETERS_LOG_ODDS
        )


def _group(
    found: _Found, quiet: BlockGroup, starts: dict[Term, Begun], trial: Attempts
) -> BlockGroup:
    """The quiet group with what was found in it, and its probabilities."""
    shown = bool(found.shown)
    seconds = max(p.n * p.dt for p in trial.inner.recordings)
    odds = found.shown or found.eased
    top = max(odds, key=lambda c: odds[c])
    # against noise such an effect stands alone, against parameters that may be off what eases them
    # has a rival
    weights = {
        c: math.exp(max(-30.0, score - (odds[top] if shown else 0.0))) / (1 if shown else len(odds))
        for c, score in odds.items()
    }
    total = sum(weights.values()) + (0.0 if shown else 1.0)
    probabilities = {
        c.hypothesis: w
        / total
        * capped_probability(_LOG_ODDS - penalty(c, seconds), _MOST_PROBABILITY)
        for c, w in weights.items()
    }
    if not shown:
        probabilities[UNDECIDED] = _MOST_PROBABILITY / total
    probabilities[UNLISTED] = 1.0 - sum(probabilities.values())
    acts = [b for b in quiet.blocks if acts_in(top.effects[0], b)]
    mismatch = max(acts, key=lambda b: quiet.baseline[b.name].ratio - top.fitted[b.name].ratio)
    return replace(
        quiet,
        candidates=[quiet.candidates[0], *odds],
        probabilities=probabilities,
        mismatch=mismatch,
        suspects=[mismatch],
        below_noise=True,
        instead=() if shown else tuple(starts[top.effects[0]].back),
    )


def _matching_shifted(
    screened: Screen, found: Fit, trial: Attempts, autocorrelation: dict[str, float]
) -> dict[Term, Begun]:
    """Effects whose signature matches a strongly shifted parameter."""
    known = known_parameters(trial.nominal)
    _, jacobian = stacked(trial.inner, found.residuals, autocorrelation)
    best: dict[Term, tuple[float, Begun]] = {}
    for name, moved in found.moved.items():
        if abs(moved) < _MOVED_TOLERANCES or jacobian is None:
            continue
        done = jacobian[:, list(found.values).index(name)] * found.scales[name] * moved
        for effect, start, signature in screened.signatures:
            sizes = float(np.linalg.norm(signature)), float(np.linalg.norm(done))
            if min(sizes) == 0.0 or not start.scalable:
                continue
            cosine = float(signature @ done) / math.prod(sizes)
            match = abs(cosine) if start.signed else cosine
            if match > max(_SAME_COSINE, best[effect][0] if effect in best else 0.0):
                size = math.copysign(sizes[1] / sizes[0], cosine)
                best[effect] = (
                    match,
                    Begun(start.scaled(size), {name: known[name].value}),
                )
    nearest = sorted(best, key=lambda e: -best[e][0])[:_MOST_FITTED]
    return {effect: best[effect][1] for effect in nearest}


def _gone_back(begun: Begun, before: Fit, after: Fit, share: float) -> bool:
    """Whether the parameters that an effect is confounded with are where they were expected, once
    it is there.
    """
    return bool(begun.back) and all(
        abs(after.moved[n]) < share * abs(before.moved[n]) for n in begun.back
    )


def _chi_square(
    problem: Problem, found: dict[Key, Residual], autocorrelation: dict[str, float]
) -> float:
    """Sum of squares of a problem's bin means in units of their autocorrelated noise."""
    rows, _ = stacked(problem, found, autocorrelation)
    return float(rows @ rows)
