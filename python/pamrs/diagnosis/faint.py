"""Effects whose signature is in residuals that are no larger than noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from pamrs.diagnosis.blocks import Residual
from pamrs.diagnosis.candidates import Attempts, Candidate, Group
from pamrs.diagnosis.evidence import inflation
from pamrs.diagnosis.fitting import FIT_BIN, Key, Problem, acts_in, fit, residuals, stacked
from pamrs.diagnosis.screening import by_effect, screen
from pamrs.diagnosis.weighing import PRICE, STANDING, believed, doubt, stands
from pamrs.effects_table import EFFECTS
from pamrs.errors import SimulationError

__all__ = ["faint"]

FAINT, RIVAL, FITTED, AGREES = 45.0, 0.3, 3, 0.05
"""Gain in chi-square (coloured) from which a signature counts in residuals that are no larger than noise; share of the largest from
which another effect is its rival, how many are fitted at most, and the share of the gain that held-out recordings have to show."""
FADED, EVEN, MOST = 0.1, 6.0, 0.93
"""Share of chi-square by which rivals are weighed (their equations are not the true ones), logarithm of the odds of a faint effect that
nothing speaks against, and how far it is believed."""


def faint(trial: Attempts, quiet: Group, acting: list[str], say: Callable[[str], None]) -> Group | None:
    """An effect whose signature is in residuals that are no larger than noise; None where there is none.

    The variance of a residual tells nothing of what is much smaller than the noise, a score test along a known signature does. Noise
    that came in with the drives is coloured and counts by its correlation time. Held-out recordings have to agree.
    """
    if trial.same:
        return None
    blocks, start = quiet.blocks, quiet.candidates[0]
    colour = {b.name: inflation(b, trial.inner.recordings, start.fit.residuals, FIT_BIN) for b in blocks}
    screened = screen(trial.inner, start.fit, acting, colour, sealed=trial.nominal.model["valve"] is None)
    best = {effect: scores[0] for effect, scores in by_effect(screened.scores()).items()}
    gains = {effect: score.gain for effect, score in best.items()}
    least = max(FAINT, RIVAL * max(gains.values(), default=0.0))
    chosen = [e for e in sorted(gains, key=lambda e: -gains[e]) if gains[e] > least][:FITTED]
    if not chosen:
        return None
    try:
        # to the last unit of chi-square, or what the baseline still has to gain would count for the effect
        finest = fit(trial.inner, trial.nominal, (), {}, colour, warm=start.fit, share=0.0)
        outside = _chi_square(trial.outer, residuals(trial.outer, finest.rig), colour)
    except SimulationError:
        return None
    inside = 2.0 * finest.cost
    names = " and ".join(b.name for b in blocks)
    seconds = max(p.n * p.dt for p in trial.inner.recordings)
    found: dict[Candidate, float] = {}
    for effect in chosen:
        say(f"{names}: no more than noise, with a signature of {effect} in it (chi-square {gains[effect]:.3g})")
        tried = trial.fitted([best[effect].start.scaled(best[effect].size)], finest, colour, share=0.0)
        if tried is None:
            continue
        gain = inside - _chi_square(trial.inner, tried.fit.residuals, colour) - sum(m * m for m in tried.fit.moved.values())
        over = outside - _chi_square(trial.outer, residuals(trial.outer, tried.fit.rig), colour)
        if gain > FAINT and over > AGREES * gain:
            size = sum(1 for n in tried.fit.values if n.partition(".")[0] in EFFECTS)
            score = 0.5 * FADED * (gain + over - 2.0 * PRICE * size) - STANDING * stands(tried, seconds)
            found[replace(tried, gain=gains[effect])] = score
    if not found:
        return None
    top = max(found, key=lambda c: found[c])
    weights = {c: math.exp(max(-30.0, score - found[top])) for c, score in found.items()}
    total = sum(weights.values())
    probabilities = {c.effects[0]: w / total * believed(EVEN - doubt(c, seconds), MOST) for c, w in weights.items()}
    probabilities["unlisted"] = 1.0 - sum(probabilities.values())
    acts = [b for b in blocks if acts_in(top.effects[0], b)]
    mismatch = max(acts, key=lambda b: quiet.baseline[b.name].ratio - top.fitted[b.name].ratio)
    return replace(quiet, candidates=[start, *found], probabilities=probabilities, mismatch=mismatch, suspects=[mismatch], faint=True)


def _chi_square(problem: Problem, found: dict[Key, Residual], colour: dict[str, float]) -> float:
    """Sum of squares of a problem's bin means in units of their coloured noise."""
    rows, _ = stacked(problem, found, colour)
    return float(rows @ rows)
