"""Effects that show although only noise is left: by a signature that is smaller, or by a parameter that had to move far instead."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.blocks import Residual
from pamrs.diagnosis.candidates import Attempts, Candidate, Group
from pamrs.diagnosis.fitting import Fit, Key, Problem, acts_in, fit, residuals, stacked
from pamrs.diagnosis.resampling import inclusion
from pamrs.diagnosis.screening import Screen, by_effect, screen
from pamrs.diagnosis.starts import Start
from pamrs.diagnosis.weighing import STANDING, believed, doubt, price, stands, unlikely, visited
from pamrs.errors import SimulationError

__all__ = ["faint"]

FAINT, RIVAL, FITTED, AGREES = 45.0, 0.3, 4, 0.05
"""Gain in chi-square (coloured) from which a signature counts in residuals that are no larger than noise; share of the largest from
which another effect is its rival, how many are fitted at most, and the share of the gain that held-out recordings have to show."""
FADED, EVEN, MOST = 0.1, 6.0, 0.93
"""Share of chi-square by which rivals are weighed (their equations are not the true ones), logarithm of the odds of a faint effect that
nothing speaks against, and how far it is believed."""
TENSE, ALIKE, RELIEF, RARE = 1.75, 0.8, 3.0, 1.5
"""Tolerances that a parameter has moved by from which effects that do the same are asked whether they would let it go back, and cosine
from which they do the same; what of the priors' sum of squares that has to spare; logarithm of the odds of parameters that are off to
all effects that do the same."""


@dataclass(frozen=True)
class Begun:
    """Where the fit of a faint effect begins.

    Attributes
    ----------
    start : Start
        The effect.
    back : dict of str to float
        Parameters that it stands in for, put back to their nominal values; empty where the residual speaks for the effect.
    """

    start: Start
    back: dict[str, float]


def faint(trial: Attempts, quiet: Group, acting: list[str], say: Callable[[str], None]) -> Group | None:
    """An effect that shows although the refitted baseline leaves no more than noise; None where there is none.

    The variance of a residual tells nothing of what is much smaller than the noise, a score test along a known signature does. Noise
    that came in with the drives is coloured and counts by its correlation time. Held-out recordings have to agree.

    Where an effect and a parameter do the same (a lost activation pressure and the zero of the transducer), nothing is left at all;
    what speaks for the effect is how far the parameter had to leave its nominal value, and the two stay a set.
    """
    if trial.same:
        return None
    blocks, start = quiet.blocks, quiet.candidates[0]
    colour = trial.colour(start.fit)
    screened = screen(trial.inner, start.fit, acting, colour, sealed=trial.nominal.model["valve"] is None)
    best = {effect: scores[0] for effect, scores in by_effect(screened.scores()).items()}
    gains = {effect: score.gain for effect, score in best.items()}
    least = max(FAINT, RIVAL * max(gains.values(), default=0.0))
    chosen = [e for e in sorted(gains, key=lambda e: -gains[e]) if gains[e] > least][:FITTED]
    starts = {e: Begun(best[e].start.scaled(best[e].size), {}) for e in chosen} or _instead(screened, start.fit, trial, colour)
    if not starts:
        return None
    try:
        # to the last unit of chi-square and from wherever an effect begins, or what the baseline still has to gain would count for it
        begins = [start.fit, *(replace(start.fit, values=start.fit.values | b.back) for b in starts.values() if b.back)]
        finest = min((fit(trial.inner, trial.nominal, (), {}, colour, warm=w, share=0.0) for w in begins), key=lambda f: f.cost)
        outside = _chi_square(trial.outer, residuals(trial.outer, finest.rig), colour)
    except SimulationError:
        return None
    inside = _chi_square(trial.inner, finest.residuals, colour)
    names = " and ".join(b.name for b in blocks)
    seconds = max(p.n * p.dt for p in trial.inner.recordings)
    ranging = visited(trial.inner)
    shown: dict[Candidate, float] = {}
    eased: dict[Candidate, float] = {}
    for effect, begun in starts.items():
        why = ", ".join(f"{n} moved far where {effect} does the same" for n in begun.back)
        say(f"{names}: no more than noise, " + (why or f"with a signature of {effect} in it (chi-square {gains[effect]:.3g})"))
        tried = trial.fitted([begun.start], replace(finest, values=finest.values | begun.back), colour, share=0.0)
        if tried is None:
            continue
        tried = replace(tried, gain=gains.get(effect, 0.0))
        within = inside - _chi_square(trial.inner, tried.fit.residuals, colour)
        over = outside - _chi_square(trial.outer, residuals(trial.outer, tried.fit.rig), colour)
        relief = finest.strain - tried.fit.strain
        gain = within + relief
        odd = STANDING * stands(tried, seconds) + unlikely(tried, ranging)
        if gain > FAINT and over > AGREES * gain:
            shown[tried] = 0.5 * FADED * (gain + over) - FADED * price(tried) - odd
        elif _gone_back(begun, finest, tried.fit) and relief > RELIEF and min(gain, gain + over) > RELIEF:
            eased[tried] = 0.5 * min(relief, gain, gain + over) - price(tried) - odd - RARE
    if not shown and not eased:
        return None
    found = shown or eased
    top = max(found, key=lambda c: found[c])
    # against noise what is faint stands alone, against parameters that may be off what eases them has a rival
    weights = {
        c: math.exp(max(-30.0, score - (found[top] if shown else 0.0))) / (1 if shown else len(found)) for c, score in found.items()
    }
    total = sum(weights.values()) + (0.0 if shown else 1.0)
    probabilities = {c.effects[0]: w / total * believed(EVEN - doubt(c, seconds), MOST) for c, w in weights.items()}
    if not shown:
        probabilities[""] = MOST / total
    probabilities["unlisted"] = 1.0 - sum(probabilities.values())
    acts = [b for b in blocks if acts_in(top.effects[0], b)]
    mismatch = max(acts, key=lambda b: quiet.baseline[b.name].ratio - top.fitted[b.name].ratio)
    return replace(
        quiet,
        candidates=[start, *found],
        probabilities=probabilities,
        mismatch=mismatch,
        suspects=[mismatch],
        faint=True,
        instead=() if shown else tuple(starts[top.effects[0]].back),
        inclusion=inclusion(screened, FAINT, 1.0) if shown else {},
    )


def _instead(screened: Screen, found: Fit, trial: Attempts, colour: dict[str, float]) -> dict[str, Begun]:
    """Effects that do what a parameter was moved far for."""
    _, jacobian = stacked(trial.inner, found.residuals, colour)
    best: dict[str, tuple[float, Begun]] = {}
    for name, moved in found.moved.items():
        if abs(moved) < TENSE or jacobian is None:
            continue
        done = jacobian[:, list(found.values).index(name)] * found.scales[name] * moved
        for effect, start, signature in screened.signatures:
            sizes = float(np.linalg.norm(signature)), float(np.linalg.norm(done))
            if min(sizes) == 0.0 or not start.scalable:
                continue
            cosine = float(signature @ done) / math.prod(sizes)
            match = abs(cosine) if start.signed else cosine
            if match > max(ALIKE, best[effect][0] if effect in best else 0.0):
                size = math.copysign(sizes[1] / sizes[0], cosine)
                best[effect] = match, Begun(start.scaled(size), {name: trial.nominal.parameter(name).value})
    nearest = sorted(best, key=lambda e: -best[e][0])[:FITTED]
    return {effect: best[effect][1] for effect in nearest}


def _gone_back(begun: Begun, before: Fit, after: Fit) -> bool:
    """Whether the parameters that an effect stands in for are where they were expected, once it is there."""
    return bool(begun.back) and all(abs(after.moved[n]) < 0.5 * abs(before.moved[n]) for n in begun.back)


def _chi_square(problem: Problem, found: dict[Key, Residual], colour: dict[str, float]) -> float:
    """Sum of squares of a problem's bin means in units of their coloured noise."""
    rows, _ = stacked(problem, found, colour)
    return float(rows @ rows)
