"""Effects that show although only noise is left: by a signature that is smaller, or by a parameter
that had to move far instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.evidence import (
    Attempts,
    Candidate,
    Group,
    capped,
    penalty,
    price,
    stands,
    unlikely,
    visited,
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
from pamrs.diagnosis.screen import Screen, Stand, by_effect, inclusion, screen
from pamrs.errors import SimulationError

__all__ = ["below_noise"]


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


def below_noise(
    trial: Attempts, quiet: Group, acting: list[str], say: Callable[[str], None]
) -> Group | None:
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
    quiet : Group
        The blocks, none of which keeps an excess.
    acting : list of str
        Effects that act in them.
    say : callable
        Receives progress.
    """
    if trial.same:
        return None
    start, settings = quiet.candidates[0], trial.settings.below_noise
    autocorrelation = trial.autocorrelation(start.fit)
    screened = screen(
        trial.inner, start.fit, acting, autocorrelation, sealed=trial.nominal.model["valve"] is None
    )
    best = {effect: scores[0] for effect, scores in by_effect(screened.scores()).items()}
    gains = {effect: score.gain for effect, score in best.items()}
    needed = settings.least_gain + _by_chance(trial, screened.stand)
    least = max(needed, settings.rival_share * max(gains.values(), default=0.0))
    chosen = [e for e in sorted(gains, key=lambda e: -gains[e]) if gains[e] > least][
        : settings.most_fitted
    ]
    starts = {e: Begun(best[e].start.scaled(best[e].size), {}) for e in chosen}
    starts = starts or _instead(screened, start.fit, trial, autocorrelation)
    against = _finest(trial, start.fit, starts, autocorrelation) if starts else None
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
        tried = trial.fitted(
            [begun.start], replace(against.fit, values=values), autocorrelation, share=0.0
        )
        if tried is not None:
            tried = replace(tried, gain=gains.get(effect, 0.0))
            _weigh(found, tried, begun, against, trial, needed)
    if not found.shown and not found.eased:
        return None
    often = inclusion(screened, settings.least_gain, 1.0, trial.settings) if found.shown else {}
    return replace(_group(found, quiet, starts, trial), inclusion=often)


def _by_chance(trial: Attempts, stand: Stand) -> float:
    """Gain in chi-square that a signature has by chance where the rig file states an error of the
    model: a smooth error has a share of any shape.
    """
    stated = max((level.stated for level in trial.noise_level.values()), default=0.0)
    return trial.settings.below_noise.stated_share * stated * stand.power_left


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


def _finest(
    trial: Attempts, start: Fit, starts: dict[str, Begun], autocorrelation: dict[str, float]
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


def _weigh(
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
    settings, autocorrelation = trial.settings.below_noise, against.autocorrelation
    seconds = max(p.n * p.dt for p in trial.inner.recordings)
    within = against.inside - _chi_square(trial.inner, tried.fit.residuals, autocorrelation)
    over = against.outside - _chi_square(
        trial.outer, residuals(trial.outer, tried.fit.rig), autocorrelation
    )
    relief = against.fit.strain - tried.fit.strain
    gain = within + relief
    evidence = trial.settings.evidence
    odd = evidence.standing_price * stands(tried, seconds) + unlikely(
        tried, visited(trial.inner), evidence
    )
    if odd > settings.log_odds:
        return  # it would have to have values that its physics hardly has
    cost = price(tried, trial.settings)
    if gain > needed and over > settings.held_out_share * gain:
        found.shown[tried] = (
            0.5 * settings.gain_weight * (gain + over) - settings.gain_weight * cost - odd
        )
    elif (
        _gone_back(begun, against.fit, tried.fit, settings.gone_back_share)
        and relief > settings.relief
        and min(gain, gain + over) > settings.relief
    ):
        found.eased[tried] = (
            0.5 * min(relief, gain, gain + over) - cost - odd - settings.parameters_log_odds
        )


def _group(found: _Found, quiet: Group, starts: dict[str, Begun], trial: Attempts) -> Group:
    """The quiet group with what was found in it, and its probabilities."""
    settings, shown = trial.settings.below_noise, bool(found.shown)
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
    most = settings.most_probability
    probabilities = {
        c.effects[0]: w
        / total
        * capped(settings.log_odds - penalty(c, seconds, trial.settings.evidence), most)
        for c, w in weights.items()
    }
    if not shown:
        probabilities[""] = most / total
    probabilities["unlisted"] = 1.0 - sum(probabilities.values())
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


def _instead(
    screened: Screen, found: Fit, trial: Attempts, autocorrelation: dict[str, float]
) -> dict[str, Begun]:
    """Effects that do what a parameter was moved far for."""
    settings = trial.settings.below_noise
    known = known_parameters(trial.nominal, trial.settings.fit)
    _, jacobian = stacked(trial.inner, found.residuals, autocorrelation)
    best: dict[str, tuple[float, Begun]] = {}
    for name, moved in found.moved.items():
        if abs(moved) < settings.moved_tolerances or jacobian is None:
            continue
        done = jacobian[:, list(found.values).index(name)] * found.scales[name] * moved
        for effect, start, signature in screened.signatures:
            sizes = float(np.linalg.norm(signature)), float(np.linalg.norm(done))
            if min(sizes) == 0.0 or not start.scalable:
                continue
            cosine = float(signature @ done) / math.prod(sizes)
            match = abs(cosine) if start.signed else cosine
            if match > max(settings.same_cosine, best[effect][0] if effect in best else 0.0):
                size = math.copysign(sizes[1] / sizes[0], cosine)
                best[effect] = (
                    match,
                    Begun(start.scaled(size), {name: known[name].value}),
                )
    nearest = sorted(best, key=lambda e: -best[e][0])[: settings.most_fitted]
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
