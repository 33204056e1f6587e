"""Competing explanations of a located mismatch, fitted side by side and judged on held-out recordings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamrs.diagnosis.blocks import Block, Residual
from pamrs.diagnosis.closure import describe_closure, find_closure
from pamrs.diagnosis.events import EVENTS, fit_events, look_for_events
from pamrs.diagnosis.evidence import Excess, Floor, excess, floors, inflation
from pamrs.diagnosis.fitting import FIT_BIN, Fit, Key, Problem, acts_in, bin_width, fit, residuals
from pamrs.diagnosis.screening import Screen, basis_of, by_effect, screen
from pamrs.diagnosis.signals import Prepared
from pamrs.diagnosis.starts import Start
from pamrs.effects_table import CATALOGUE, EFFECTS, find_parameter
from pamrs.errors import SimulationError
from pamrs.rig import Rig

__all__ = ["Candidate", "Group", "examine", "fits", "significant"]

DETECTION_RATIO, HELD_RATIO, HINT = 1.45, 2.0, 1.15
"""Variance of bin means over the floor's from which a mismatch is taken as real: on recordings that were fitted; on others, where the
fitted ones give a hint of it."""
EVEN, EVEN_PUSH, SOFTNESS = 0.5, 2.6, 0.4
"""Logarithm of the odds of explained to unexplained variance at which a set is named at even odds with ``unlisted`` (pushes, which
take up a good part of anything, need more), and its width."""
LOOKS, PRICE, SECOND = 12.0, 0.5, 3.0
"""Independent looks that a block's residual counts for, price of a parameter, price of a further effect."""
LIKELY, CARRIES = 0.3, 0.8
"""Probability of ``unlisted`` from which a form of what is missing is looked for, and the share of the mismatch that it may leave."""
DOUBTFUL = 0.15
"""Share that every effect of lasting kind leaves, from which events are looked for."""
TELLING = 0.5
"""Excess variance, in units of the floor's, from which recordings are asked how much an effect leaves."""
FORM = 0.04
"""Share of a mismatch's variance that the difference between a catalogue's equation and the truth may leave."""
DRIFT_SHARE, DRIFT_BELIEVED = 0.02, 0.45
"""Share of the pressure below which a drift that no other recording confirms may as well be the bench's own, and how far a name of it
is believed at most."""
LEAST_GAIN, LEAST_SHARE = 12.0, 0.08
"""Gain in chi-square, and share of the largest, from which an effect is fitted."""
MOST_SINGLES, PAIRED, PARTNERS = 5, 2, 2
"""Singles that are fitted; of them those that get a partner, and how many each."""
NEAR, STARTS, RICH = 0.6, 2, 3
"""Share of an effect's best gain from which another of its starts is fitted, how many, and of how many effects."""
BELIEVED = 0.985
"""How far a name is believed at most."""
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
    fitted : dict of str to Excess
        By block, on the recordings to fit.
    gap_closed : float
        Share of the baseline's excess that it removes on held-out recordings.
    scatter : float
        Relative scatter of its size between recordings, beyond its uncertainty.
    gain : float
        Gain in chi-square that the screen promised of a single effect.
    """

    effects: tuple[str, ...]
    fit: Fit
    held_out: dict[str, Excess]
    fitted: dict[str, Excess]
    gap_closed: float
    scatter: float = 0.0
    gain: float = 0.0

    @property
    def misfit(self) -> float:
        """Sum over the blocks of the residual in units of its noise, squared, on the recordings to fit."""
        return sum(float(((r.value[r.rows] / r.noise) ** 2).sum()) for r in self.fit.residuals.values())


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
    floor : dict
        Noise floors.
    suspects : list of Block
        Blocks that keep an excess.
    closure : Candidate or None
        Where no name is likely: a form of what is missing that predicts held-out recordings better than the baseline.
    form : str
        That in words.
    sought : bool
        Whether one was looked for.
    """

    blocks: list[Block]
    nominal: dict[str, Excess]
    baseline: dict[str, Excess]
    candidates: list[Candidate]
    probabilities: dict[str, float]
    mismatch: Block | None
    floor: dict[Key, Floor]
    suspects: list[Block]
    closure: Candidate | None = None
    form: str = ""
    sought: bool = False

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
    first = _refitted(inner, nominal, white)
    floor = floors(inner, inner.core.respecified(first.rig.to_json()))
    if held is not fitted:
        floor |= floors(outer, outer.core.respecified(first.rig.to_json()))
    colour = {b.name: inflation(b, inner.recordings, first.residuals, FIT_BIN) for b in blocks}
    baseline = fit(inner, nominal, (), {}, colour, warm=first) if max(colour.values()) > 2 else first
    was = {b.name: excess(b, inner.recordings, before, floor) for b in blocks}
    now = {b.name: excess(b, inner.recordings, baseline.residuals, floor) for b in blocks}
    outside = residuals(outer, baseline.rig) if held is not fitted else baseline.residuals
    out = {b.name: excess(b, outer.recordings, outside, floor) for b in blocks}
    start = Candidate((), baseline, out, now, 0.0)
    # what parameters could not be told from the fitted recordings shows in the others alone, and is no mismatch
    apart = [b for b in blocks if significant(out[b.name], HELD_RATIO) and now[b.name].ratio > HINT]
    suspects = [b for b in blocks if significant(now[b.name]) or b in apart]
    if not suspects:
        # a parameter at the end of its plausible range is a symptom even where the fit is good
        return Group(blocks, was, now, [start], {"": 1.0}, None, floor, [])
    mismatch = max(suspects, key=lambda b: out[b.name].ratio + now[b.name].ratio)
    say(f"{names}: {mismatch.name} keeps {now[mismatch.name].systematic:.2g} noise units after the refit")
    acting = [e for e in CATALOGUE if fits(nominal, e) and any(acts_in(e, b) for b in suspects)]
    happening = [e for e in acting if e in EVENTS]
    acting = [e for e in acting if e not in EVENTS]
    trial = _Trial(inner, outer, nominal, floor, out, suspects)
    screened = screen(inner, baseline, acting, white, sealed=nominal.model["valve"] is None)
    singles = _singles(trial, screened, baseline, lambda text: say(f"{names}: {text}"))
    if all(_share_left(c, start, suspects) > DOUBTFUL for c in singles):
        say(f"{names}: looking for what happens at times of its own ({', '.join(happening)})")
        singles += [c for e in happening if (c := trial.eventful(e, baseline)) is not None]
    settled = any(_explains(c, suspects) or _share_left(c, start, suspects) < FORM for c in singles)
    # what a single effect leaves may be no more than the difference between its equation and the truth: a pair cannot be asked for
    pairs = [] if settled else _pairs(trial, screened, singles, lambda text: say(f"{names}: {text}"))
    candidates = [start, *singles, *pairs]
    most = _most_believed(fitted, held, mismatch, now[mismatch.name].rms)
    weighed = _weigh(candidates, suspects, most)
    group = Group(blocks, was, now, candidates, weighed, mismatch, floor, suspects)
    if weighed["unlisted"] < LIKELY or len({b.kind for b in suspects}) < len(suspects):
        return group  # of two chambers one form would have to serve both
    group = replace(group, sought=True)
    closed = find_closure(inner, nominal, baseline, colour, suspects, say)
    if closed is None:
        return group
    try:
        judged = trial.judged(closed.effects, closed)
    except SimulationError:
        return group
    # what does not carry over to recordings that were held out is no form of anything
    if _share_left(judged, start, suspects) > CARRIES:
        return group
    return replace(group, closure=judged, form=describe_closure(closed, inner, baseline))


def _refitted(problem: Problem, nominal: Rig, inflation: dict[str, float]) -> Fit:
    """The baseline refitted from the nominal values and, where that leaves more than noise could, from the other side of them."""
    first = fit(problem, nominal, (), {}, inflation)
    rows = sum(int(r.rows.sum()) / bin_width(p, FIT_BIN) for p in problem.recordings for r in _of(p, first.residuals))
    if 2.0 * first.cost < DETECTION_RATIO * rows:
        return first
    known = nominal.parameters
    mirrored = {n: 2.0 * known[n].value - first.values[n] for n in first.moved}
    try:
        second = fit(problem, nominal, (), {}, inflation, warm=replace(first, values=mirrored))
    except SimulationError:
        return first
    return min(first, second, key=lambda f: f.cost)


def _of(prepared: Prepared, found: dict[Key, Residual]) -> list[Residual]:
    return [r for (_, recording), r in found.items() if recording == prepared.recording.name]


def fits(rig: Rig, effect: str) -> bool:
    """Whether a rig has what an effect acts on."""
    kinds = {supply["kind"] for supply in rig.tables("supply").values()}
    if effect in ("compressor_cut_in", "supply_regulator_deadband"):
        return ("tank" if effect == "compressor_cut_in" else "regulator") in kinds
    needs = EFFECTS[effect].at or ("joint" if EFFECTS[effect].block == "arm" else "chamber")
    return bool(rig.tables(needs))


def _most_believed(fitted: Problem, held: Problem, mismatch: Block, left: float) -> float:
    """How far any name is believed at most, which is less where the proof is weak.

    A slow drift of less than two percent of the pressure, with no held-out recording, may as well be the bench's own loss,
    creep of a wall or the transducer's drift.
    """
    if held is not fitted or mismatch.channel != "muscle_pressure":
        return BELIEVED
    typical = np.mean([np.mean(np.abs(p.signals["muscle_pressure"][0])) for p in fitted.recordings])
    return DRIFT_BELIEVED if left < DRIFT_SHARE * float(typical) else BELIEVED


def _share_left(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> float:
    """Share of the baseline's excess variance that a set of effects leaves, the larger of fitted and held-out recordings.

    Recordings that hardly show the mismatch do not count, as long as the effect does not bring one into them.
    """
    shares = []
    for was, now in ((baseline.fitted, candidate.fitted), (baseline.held_out, candidate.held_out)):
        before = sum(max(0.0, was[b.name].ratio - 1.0) for b in suspects)
        after = sum(max(0.0, now[b.name].ratio - 1.0) for b in suspects)
        if before > TELLING or after > max(before, TELLING):
            shares.append(after / before if before > 0.0 else math.inf)
    return max(shares, default=1.0)


def _explains(candidate: Candidate, suspects: list[Block]) -> bool:
    """Whether only noise is left, fitted and held out."""
    return all(e[b.name].ratio < DETECTION_RATIO for b in suspects for e in (candidate.fitted, candidate.held_out))


def significant(found: Excess, ratio: float = DETECTION_RATIO) -> bool:
    """Whether a block keeps more than its noise."""
    return found.ratio > ratio and found.p_value < 0.01


@dataclass(frozen=True, eq=False)
class _Trial:
    """What every attempt at an explanation needs."""

    inner: Problem
    outer: Problem
    nominal: Rig
    floor: dict[Key, Floor]
    out: dict[str, Excess]
    suspects: list[Block]

    @property
    def same(self) -> bool:
        return self.outer.recordings is self.inner.recordings

    def eventful(self, effect: str, baseline: Fit) -> Candidate | None:
        """An effect with times of its own in every recording, held-out ones included."""
        try:
            return self._eventful(effect, baseline)
        except SimulationError:
            return None  # it leaves the range in which the model holds

    def _eventful(self, effect: str, baseline: Fit) -> Candidate | None:
        white = dict.fromkeys((b.name for b in self.inner.blocks), 1.0)
        found = fit_events(effect, self.inner, self.nominal, baseline, white)
        if found is None:
            return None
        if self.same:
            return self.judged((effect,), found)
        bare = found.rig.without_effect(effect)
        size = found.values["payload_change.mass_change"] if effect == "payload_change" else None
        quiet = residuals(self.outer, bare)
        events = look_for_events(effect, self.outer, bare, quiet, white, size)
        if events is None:
            return self.judged((effect,), found, quiet)
        everywhere = replace(
            found, events=replace(events, values=found.events.values | events.values if found.events else events.values)
        )
        return self.judged((effect,), everywhere, residuals(self.outer, bare, events=events))

    def judged(self, effects: tuple[str, ...], found: Fit, outside: dict[Key, Residual] | None = None) -> Candidate:
        """A fitted set on the held-out recordings."""
        if outside is None:
            outside = found.residuals if self.same else residuals(self.outer, found.rig)
        after = {b.name: excess(b, self.outer.recordings, outside, self.floor) for b in self.inner.blocks}
        inside = (
            after if self.same else {b.name: excess(b, self.inner.recordings, found.residuals, self.floor) for b in self.inner.blocks}
        )
        gaps = [(self.out[b.name].ratio - 1.0, max(0.0, after[b.name].ratio - 1.0)) for b in self.suspects]
        total = sum(math.sqrt(max(0.0, g)) for g, _ in gaps)
        gap = 1.0 - sum(math.sqrt(a) for _, a in gaps) / total if total > 0 else 0.0
        return Candidate(effects, found, after, inside, gap, _scatter(effects, self.inner, found))

    def fitted(self, starts: list[Start], warm: Fit, inflation_: dict[str, float]) -> Candidate | None:
        """A set of effects fitted from one start of each, residuals weighted by their own colour; None where it cannot be run."""
        effects = tuple(start.effect for start in starts)
        free = {name: value for start in starts for name, value in start.free.items()}
        held = {name: value for start in starts for name, value in start.held.items()}
        limit = 30 if self.nominal.model["valve"] is None else 8
        try:
            best = fit(self.inner, self.nominal, effects, free, inflation_, fixed=held, warm=warm, frozen=True, evaluations=limit)
            colour = {b.name: inflation(b, self.inner.recordings, best.residuals, FIT_BIN) for b in self.inner.blocks}
            if max(colour.values()) > 2:
                again = {n: v for n, v in best.values.items() if n.partition(".")[0] in EFFECTS}
                again = {n: v if abs(v) > 1e-3 * _typical(n) else 1e-3 * _typical(n) for n, v in again.items()}
                best = fit(self.inner, self.nominal, effects, again, colour, fixed=held, warm=best, frozen=True, evaluations=limit)
            return self.judged(effects, best)
        except SimulationError:
            return None  # it leaves the range in which the model holds


def _singles(trial: _Trial, screened: Screen, baseline: Fit, say: Callable[[str], None]) -> list[Candidate]:
    """The effects that the screen finds worth it, fitted; the most telling first."""
    ranked = by_effect(screened.scores())
    gains = {effect: scores[0].gain for effect, scores in ranked.items()}
    most = max(gains.values(), default=0.0)
    chosen = [e for e, gain in gains.items() if gain > max(LEAST_GAIN, LEAST_SHARE * most)][:MOST_SINGLES]
    say("screened: " + (", ".join(f"{e} {gain:.3g}" for e, gain in list(gains.items())[:8]) or "no effect acts here"))
    white = dict.fromkeys((b.name for b in trial.inner.blocks), 1.0)
    found = []
    for place, effect in enumerate(chosen):
        near = [s for s in ranked[effect] if s.gain > NEAR * gains[effect]]
        tried = [trial.fitted([s.start.scaled(s.size)], baseline, white) for s in near[: STARTS if place < RICH else 1]]
        fitted = [candidate for candidate in tried if candidate is not None]
        if fitted:
            found.append(replace(min(fitted, key=lambda c: c.misfit), gain=gains[effect]))
    return found


def _pairs(trial: _Trial, screened: Screen, singles: list[Candidate], say: Callable[[str], None]) -> list[Candidate]:
    """For the best singles that leave something: the effects that would take most of it, fitted together with them."""
    lasting = [c for c in singles if c.fit.events is None]
    ranked = sorted(lasting, key=lambda c: sum(c.held_out[b.name].ratio for b in trial.suspects))[:PAIRED]
    white = dict.fromkeys((b.name for b in trial.inner.blocks), 1.0)
    tried: set[frozenset[str]] = set()
    found = []
    for single in ranked:
        rows, basis = basis_of(single.fit, trial.inner, white)
        partners = by_effect(screened.scores(rows, basis, without=single.effects))
        least = max(LEAST_GAIN, FORM * float(screened.rows @ screened.rows))
        best = [scores[0] for scores in partners.values() if scores[0].gain > least]
        for score in best[:PARTNERS]:
            both = frozenset({*single.effects, score.effect})
            if both in tried:
                continue
            tried.add(both)
            say(f"trying {' + '.join(sorted(both))}")
            first = Start(single.effects[0], _own(single.fit, single.effects[0]), _held(single.fit, single.effects[0]), (), False)
            candidate = trial.fitted([first, score.start.scaled(score.size)], single.fit, white)
            if candidate is not None:
                found.append(candidate)
    return found


def _own(found: Fit, effect: str) -> dict[str, float]:
    """Fitted parameters of an effect."""
    return {name: value for name, value in found.values.items() if name.partition(".")[0] == effect}


def _held(found: Fit, effect: str) -> dict[str, float]:
    """Parameters of an effect that the fit left."""
    entry = next(e for e in found.rig.effects if e["id"] == effect)
    return {f"{effect}.{n}": v for n, v in entry["parameters"].items() if f"{effect}.{n}" not in found.values}


def _typical(name: str) -> float:
    """A typical size of an effect's parameter, at least its lower bound."""
    parameter = find_parameter(name)
    return max(parameter.default, parameter.lower, 1e-3 * parameter.starts[0])


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


def _weigh(candidates: list[Candidate], suspects: list[Block], most: float) -> dict[str, float]:
    """Probabilities over sets of effects and ``unlisted``.

    Between sets: the logarithm of what each leaves of the mismatch, fitted and held out, on a nominal number of independent looks;
    what the form of an equation may leave (``FORM``) is granted to all of them, so that no second effect is asked for to mend the
    form of the first. Each parameter and each further effect has its price. Against ``unlisted``: the share of the mismatch that
    the set explains where it explains least, and whether its size is the same in all recordings. The constants are those under
    which the stated probabilities came true in a trial with other seeds than the published one (docs/decisions/0014).
    """
    named = [c for c in candidates if c.effects]
    if not named:
        return {"unlisted": 1.0}
    start = candidates[0]
    scores = {c: _score(c, start, suspects) for c in named}
    top = max(scores.values())
    weights = {c: math.exp(max(-60.0, s - top)) for c, s in scores.items()}
    total = sum(weights.values())
    out: dict[str, float] = {}
    unlisted = 0.0
    for c, weight in weights.items():
        share = weight / total
        left = min(max(_share_left(c, start, suspects), 1e-6), 1.0 - 1e-6)
        odds = (math.log((1.0 - left) / left) - (EVEN_PUSH if "external_torque" in c.effects else EVEN)) / SOFTNESS
        if _explains(c, suspects):
            odds = max(odds, 3.0)
        odds -= max(0.0, c.scatter - CONSTANCY) / 0.1
        believed = most / (1.0 + math.exp(-min(60.0, max(-60.0, odds))))
        key = "+".join(c.effects)
        out[key] = out.get(key, 0.0) + share * believed
        unlisted += share * (1.0 - believed)
    out["unlisted"] = unlisted
    return out


def _score(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> float:
    """Logarithm of the weight of a set of effects, up to a constant."""
    total = 0.0
    for was, now in ((baseline.fitted, candidate.fitted), (baseline.held_out, candidate.held_out)):
        for block in suspects:
            granted = FORM * max(0.0, was[block.name].ratio - 1.0)
            total -= 0.25 * LOOKS * math.log(max(1.0, now[block.name].ratio) + granted)
    size = sum(1 for n in candidate.fit.values if n.partition(".")[0] in EFFECTS and not n.endswith(("_2", "_3")))
    return total - PRICE * size - SECOND * (len(candidate.effects) - 1)
