"""Competing explanations of a located mismatch, fitted side by side and judged on held-out recordings."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.blocks import Block
from pamrs.diagnosis.evidence import Excess, Floor, excess, floors, inflation
from pamrs.diagnosis.fitting import FIT_BIN, Fit, Key, Problem, acts_in, fit, residuals
from pamrs.effects_table import EFFECTS, find_parameter
from pamrs.errors import SimulationError
from pamrs.rig import Rig

__all__ = ["Candidate", "Group", "examine", "significant"]

CANDIDATES = ("leak_muscle", "heat_transfer", "muscle_hysteresis")
"""Effects of the catalogue that are tried for an explanation."""
DETECTION_RATIO = 1.6
"""Variance of bin means over the floor's from which a mismatch is taken as real."""
NAMING_GAP = 0.72
"""Share of the gap on held-out recordings that an effect must close to be named at even odds with ``unlisted``."""
GAP_SOFTNESS = 0.05
PAIR_GAP = 0.9
"""Share of the gap from which, without held-out recordings, no second effect is asked for."""
DRIFT_SHARE, DRIFT_DOUBT = 0.02, 3.0
CONSTANCY = 0.35
"""Relative scatter of an effect's size between recordings beyond which it is not that effect."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects, fitted.

    Attributes
    ----------
    effects : tuple of str
        Its effects; empty for the baseline.
    fit : Fit
        On the recordings to fit.
    held_out : dict of str to Excess
        By block, on held-out recordings (on the fitted ones if there are no others).
    gap_closed : float
        Share of the baseline's excess that it removes on held-out recordings.
    scatter : float
        Relative scatter of its size between recordings, beyond its uncertainty.
    """

    effects: tuple[str, ...]
    fit: Fit
    held_out: dict[str, Excess]
    gap_closed: float
    scatter: float = 0.0


@dataclass(frozen=True, eq=False)
class Group:
    """Blocks that are judged together, with everything found out about them.

    Attributes
    ----------
    blocks : list of Block
        Gas blocks (supply, chamber) or the arm.
    nominal, baseline : dict of str to Excess
        Excess by block before and after the refit, on fitted recordings.
    candidates : list of Candidate
        The baseline first, then every set of effects tried.
    probabilities : dict of str to float
        Over the sets (ids joined by ``+``), ``unlisted`` and ``""`` (nothing missing here).
    mismatch : Block or None
        The block with the largest significant excess after the refit.
    """

    blocks: list[Block]
    nominal: dict[str, Excess]
    baseline: dict[str, Excess]
    candidates: list[Candidate]
    probabilities: dict[str, float]
    mismatch: Block | None
    floor: dict[Key, Floor]

    @property
    def best(self) -> Candidate:
        """The most probable set of effects (the baseline when none is)."""
        named = [c for c in self.candidates if c.effects]
        if self.mismatch is None or not named:
            return self.candidates[0]
        return max(named, key=lambda c: self.probabilities.get("+".join(c.effects), 0.0))


def examine(fitted: Problem, held: Problem, nominal: Rig, blocks: list[Block], say: Callable[[str], None]) -> Group:
    """Refit the baseline of some blocks, locate what is left, and try every effect that acts there.

    Parameters
    ----------
    fitted, held : Problem
        Recordings to fit and held-out ones (the same when there are no others).
    nominal : Rig
        Nominal model.
    blocks : list of Block
        Blocks that share parameters.
    say : callable
        Receives progress.
    """
    inner, outer = replace(fitted, blocks=blocks), replace(held, blocks=blocks)
    white = dict.fromkeys((b.name for b in blocks), 1.0)
    names = " and ".join(b.name for b in blocks)
    say(f"{names}: refitting the baseline inside its tolerances")
    before = residuals(inner, nominal)
    first = fit(inner, nominal, (), {}, white)
    floor = floors(inner, inner.core.respecified(first.rig.to_json()))
    if held is not fitted:
        floor |= floors(outer, outer.core.respecified(first.rig.to_json()))
    colour = {b.name: inflation(b, inner.recordings, first.residuals, FIT_BIN) for b in blocks}
    baseline = fit(inner, nominal, (), {}, colour, warm=first.values) if max(colour.values()) > 2 else first
    was = {b.name: excess(b, inner.recordings, before, floor) for b in blocks}
    now = {b.name: excess(b, inner.recordings, baseline.residuals, floor) for b in blocks}
    outside = residuals(outer, baseline.rig) if held is not fitted else baseline.residuals
    out = {b.name: excess(b, outer.recordings, outside, floor) for b in blocks}
    start = Candidate((), baseline, out, 0.0)
    suspects = [b for b in blocks if significant(now[b.name]) and (held is fitted or out[b.name].ratio > 1.25)]
    if not suspects:
        # a parameter at the end of its plausible range is a symptom even where the fit is good
        return Group(blocks, was, now, [start], {"": 1.0}, None, floor)
    mismatch = max(suspects, key=lambda b: out[b.name].ratio)
    say(f"{names}: {mismatch.name} keeps {now[mismatch.name].systematic:.2g} noise units after the refit")
    acting = [e for e in CANDIDATES if any(acts_in(e, b) for b in suspects)]
    sets = [s for k in (1, 2) for s in itertools.combinations(acting, k)]
    candidates = [start]
    for effects in sets:
        settled = any(_explains(c, suspects) or (held is fitted and c.gap_closed > PAIR_GAP) for c in candidates if c.effects)
        if settled and len(effects) > 1:
            continue  # a single effect leaves only noise: a pair cannot be asked for by these data
        say(f"{names}: trying {' + '.join(effects)}")
        candidate = _try(effects, inner, outer, nominal, baseline, white, floor, held is fitted, out, suspects)
        if candidate is not None:
            candidates.append(candidate)
    doubt = _doubt(fitted, held, mismatch, now[mismatch.name].rms)
    return Group(blocks, was, now, candidates, _weigh(candidates, suspects, outer, doubt), mismatch, floor)


def _doubt(fitted: Problem, held: Problem, mismatch: Block, left: float) -> float:
    """Odds against every name where the proof is weak.

    A slow drift of less than two percent of the pressure, with no held-out recording, may as well be the bench's own loss,
    creep of a wall or the transducer's drift.
    """
    if held is not fitted or mismatch.channel != "muscle_pressure":
        return 0.0
    typical = np.mean([np.mean(np.abs(p.signals["muscle_pressure"][0])) for p in fitted.recordings])
    return DRIFT_DOUBT if left < DRIFT_SHARE * float(typical) else 0.0


def _explains(candidate: Candidate, suspects: list[Block]) -> bool:
    return all(candidate.held_out[b.name].ratio < DETECTION_RATIO for b in suspects)


def significant(found: Excess) -> bool:
    """Whether a block keeps more than its noise."""
    return found.ratio > DETECTION_RATIO and found.p_value < 0.01


def _start_sets(effects: tuple[str, ...], sealed: bool) -> list[tuple[dict[str, float], dict[str, float]]]:
    """Starts of the free parameters, and held ones, for each start of the multi-start."""
    choices: list[list[tuple[str, float]]] = []
    fixed: dict[str, float] = {}
    alternatives: list[dict[str, float]] = [{}]
    for effect in effects:
        for parameter in EFFECTS[effect].parameters:
            name = f"{effect}.{parameter.name}"
            if parameter.name == "laminar_share":
                # a hole or a porous wall: a mixture is not identifiable from a drift
                alternatives = [{name: 0.0}, {name: 1.0}]
            elif parameter.name == "initial_temperature_rise":
                if sealed:
                    choices.append([(name, 5.0)])
                else:
                    fixed[name] = 0.0
            else:
                choices.append([(name, value) for value in parameter.starts])
    return [(dict(choice), fixed | other) for choice in itertools.product(*choices) for other in alternatives]


def _try(
    effects: tuple[str, ...],
    inner: Problem,
    outer: Problem,
    nominal: Rig,
    baseline: Fit,
    weights: dict[str, float],
    floor: dict[Key, Floor],
    same: bool,
    out: dict[str, Excess],
    suspects: list[Block],
) -> Candidate | None:
    sealed = nominal.model["valve"] is None
    limit = 30 if sealed else 8
    tried = []
    for starts, fixed in _start_sets(effects, sealed):
        try:
            found = fit(inner, nominal, effects, starts, weights, fixed=fixed, warm=baseline.values, evaluations=limit)
        except SimulationError:
            continue  # this start leaves the range in which the model holds
        tried.append((found, fixed))
    if not tried:
        return None
    best, fixed = min(tried, key=lambda f: f[0].cost)
    colour = {b.name: inflation(b, inner.recordings, best.residuals, FIT_BIN) for b in inner.blocks}
    if max(colour.values()) > 2:
        starts = {n: v for n, v in best.values.items() if n.partition(".")[0] in EFFECTS}
        starts = {n: max(v, 1e-3 * _typical(n)) for n, v in starts.items()}
        best = fit(inner, nominal, effects, starts, colour, fixed=fixed, warm=best.values, evaluations=limit)
    outside = best.residuals if same else residuals(outer, best.rig)
    after = {b.name: excess(b, outer.recordings, outside, floor) for b in inner.blocks}
    gaps = [(out[b.name].ratio - 1.0, max(0.0, after[b.name].ratio - 1.0)) for b in suspects]
    total = sum(math.sqrt(max(0.0, g)) for g, _ in gaps)
    gap = 1.0 - sum(math.sqrt(a) for _, a in gaps) / total if total > 0 else 0.0
    return Candidate(effects, best, after, gap, _scatter(effects, inner, best))


def _typical(name: str) -> float:
    """A typical size of an effect's parameter, at least its lower bound."""
    parameter = find_parameter(name)
    return max(parameter.default, parameter.lower)


def _scatter(effects: tuple[str, ...], problem: Problem, best: Fit) -> float:
    """Relative scatter of a single effect's size between recordings, beyond its uncertainty.

    One Gauss-Newton step of the effect's leading parameter alone in each recording: a wrong effect needs another size in
    every regime.
    """
    if len(effects) != 1 or len(problem.recordings) < 2:
        return 0.0
    leading = {
        "leak_muscle": "leak_muscle.conductance",
        "muscle_hysteresis": "muscle_hysteresis.friction_pressure",
    }.get(effects[0])
    if leading is None or best.values.get(leading, 0.0) <= 0:
        return 0.0
    found = residuals(problem, best.rig, [leading])
    steps, errors = [], []
    for prepared in problem.recordings:
        num = den = 0.0
        for block in problem.blocks:
            r = found[block.name, prepared.recording.name]
            if r.jacobian is None or not acts_in(effects[0], block):
                continue
            slope = r.jacobian[:, 0] / r.noise
            unit = inflation(block, [prepared], found, FIT_BIN)
            num += float(slope @ (r.value / r.noise)) / unit
            den += float(slope @ slope) / unit
        if den > 0:
            steps.append(num / den / best.values[leading])
            errors.append(1.0 / math.sqrt(den) / best.values[leading])
    if len(steps) < 2:
        return 0.0
    beyond = [max(0.0, abs(s) - 2.0 * e) for s, e in zip(steps, errors, strict=True)]
    return float(max(beyond))


def _weigh(candidates: list[Candidate], suspects: list[Block], outer: Problem, doubt: float) -> dict[str, float]:
    """Probabilities over sets of effects and ``unlisted``.

    Between sets: the logarithm of the held-out excess ratio on a nominal number of independent samples (a fortieth of the
    rows), with a BIC-like price per parameter. Against
    ``unlisted``: the share of the gap that the best set closes, whether what it leaves is above the floor, and whether its
    size is the same in all recordings.
    """
    named = [c for c in candidates if c.effects]
    if not named:
        return {"unlisted": 1.0}
    scores = {}
    for c in named:
        ratio = sum(c.held_out[b.name].ratio for b in suspects)
        rows = sum(len(p.recording) for p in outer.recordings)
        effective = max(20.0, rows / 40.0)
        size = sum(1 for n in c.fit.values if n.partition(".")[0] in EFFECTS)
        scores[c] = -0.5 * effective * math.log(max(ratio, 0.5 * len(suspects))) - 0.5 * size * math.log(effective)
    top = max(scores.values())
    weights = {c: math.exp(max(-60.0, s - top)) for c, s in scores.items()}
    total = sum(weights.values())
    out: dict[str, float] = {}
    unlisted = 0.0
    for c, weight in weights.items():
        share = weight / total
        left = max(c.held_out[b.name].ratio for b in suspects)
        odds = (c.gap_closed - NAMING_GAP) / GAP_SOFTNESS
        if left < DETECTION_RATIO:
            odds = max(odds, 3.0)
        odds -= max(0.0, c.scatter - CONSTANCY) / 0.1
        odds -= doubt
        believed = 0.985 / (1.0 + math.exp(-min(60.0, max(-60.0, odds))))
        out["+".join(c.effects)] = share * believed
        unlisted += share * (1.0 - believed)
    out["unlisted"] = unlisted
    return out
