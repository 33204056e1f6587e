"""Competing explanations of a located mismatch, fitted side by side and judged on held-out recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pamrs.diagnosis.blocks import Block, Residual
from pamrs.diagnosis.candidates import EXACT, THOROUGH, Attempts, Candidate, Group, colour_of, significant, start_of, without_colour
from pamrs.diagnosis.closure import describe_closure, find_closure
from pamrs.diagnosis.events import EVENTS
from pamrs.diagnosis.evidence import MARGIN, Floor, excess, floors
from pamrs.diagnosis.faint import faint
from pamrs.diagnosis.fitting import FIT_BIN, Fit, Key, Problem, acts_in, bin_width, fit, residuals
from pamrs.diagnosis.leaving import left_out
from pamrs.diagnosis.resampling import inclusion
from pamrs.diagnosis.screening import Screen, by_effect, screen, stand_of
from pamrs.diagnosis.signals import Prepared
from pamrs.diagnosis.starts import Start
from pamrs.diagnosis.weighing import FINE, FORM, explains, most_believed, same_recordings, share_left, visited, weigh
from pamrs.diagnosis.wrong_parameters import beside_quiet, freed
from pamrs.effects import CATALOGUE, EFFECTS
from pamrs.errors import SimulationError
from pamrs.rig import Rig

__all__ = ["coloured", "examine", "fits", "refitted"]

HELD_RATIO, HINT = 2.0, 1.15
"""Variance over the floor's from which recordings that were held out show a mismatch, where the fitted ones give a hint of it."""
MARGINAL, HARDLY, NOTHING = 1.35, 0.3, 0.6
"""Multiple of noise's largest excess, or excess variance, up to which a mismatch that no effect explains may be none, and the
probability that it is."""
LIKELY, CARRIES = 0.3, 0.8
"""Probability of ``unlisted`` from which a form of what is missing is looked for, and the share of the mismatch that it may leave."""
UNNAMED = 0.5
"""Probability of ``unlisted`` above which no name is more probable than its absence."""
BESIDE, MAIN = 0.08, 0.5
"""Shares left by the best effect of lasting kind between which events are looked for beside it."""
DOUBTFUL = 0.15
"""Share that every effect of lasting kind leaves, from which events are looked for."""
LEAST_GAIN, LEAST_SHARE = 12.0, 0.08
"""Gain in chi-square, and share of the largest, from which an effect is fitted."""
MOST_SINGLES, PAIRED, PARTNERS, PARTNER = 5, 2, 2, 0.01
"""Singles that are fitted; of them those that get a partner, how many each, and the share of the mismatch that one has to promise."""
RIVAL, MOST_RIVALS = 0.03, 4
"""Probability from which sets of effects are fitted to the end, and how many."""
NEAR, STARTS, RICH = 0.6, 2, 3
"""Share of an effect's best gain from which another of its starts is fitted, how many, and of how many effects."""


def examine(fitted: Problem, held: Problem, nominal: Rig, blocks: list[Block], say: Callable[[str], None]) -> list[Group]:
    """Refit the baseline of some blocks, locate what is left, and try every effect that acts there.

    The blocks are one group, unless no name explains all of them and one does explain a block in which alone it acts: then that block
    is a group of its own.

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
    white = without_colour(blocks)
    names = " and ".join(b.name for b in blocks)
    say(f"{names}: refitting the baseline inside its tolerances")
    before = residuals(inner, nominal)
    first = refitted(inner, nominal, white)
    floor = floors(inner, inner.core.respecified(first.rig.to_json()))
    if held is not fitted:
        floor |= floors(outer, outer.core.respecified(first.rig.to_json()))
    baseline, colour = coloured(inner, nominal, first)
    was = {b.name: excess(b, inner.recordings, before, floor) for b in blocks}
    now = {b.name: excess(b, inner.recordings, baseline.residuals, floor) for b in blocks}
    outside = residuals(outer, baseline.rig) if held is not fitted else left_out(inner, baseline, colour)
    out = {b.name: excess(b, outer.recordings, outside, floor) for b in blocks}
    start = Candidate((), baseline, out, now, 0.0)
    # what parameters could not be told from the fitted recordings shows in the others alone, and is no mismatch
    apart = [b for b in blocks if significant(out[b.name], HELD_RATIO) and now[b.name].ratio > HINT and held is not fitted]
    suspects = [b for b in blocks if significant(now[b.name]) or b in apart]
    if apart and not any(significant(now[b.name]) for b in suspects):
        common = _together(inner, outer, nominal, start, floor)
        if common is not None:
            say(f"{names}: one baseline leaves noise in all recordings")
            # what the nominal model leaves in the held-out ones is what the parameters are moved for
            quiet = residuals(outer, nominal)
            ever = {b.name: max(was[b.name], excess(b, outer.recordings, quiet, floor), key=lambda e: e.ratio) for b in blocks}
            return [Group(blocks, ever, common.fitted, [common], {"": 1.0}, None, floor, [])]
    acting = [e for e in CATALOGUE if fits(nominal, e) and any(acts_in(e, b) for b in suspects or blocks)]
    if not suspects:
        # a parameter at the end of its plausible range is a symptom even where the fit is good
        nothing = Group(blocks, was, now, [start], {"": 1.0}, None, floor, [])
        lasting = [e for e in acting if e not in EVENTS]
        attempts = Attempts(inner, outer, nominal, floor, out, blocks)
        return [beside_quiet(attempts, faint(attempts, nothing, lasting, say) or nothing, lambda text: say(f"{names}: {text}"))]
    mismatch = max(suspects, key=lambda b: out[b.name].ratio + now[b.name].ratio)
    say(f"{names}: {mismatch.name} keeps {now[mismatch.name].systematic:.2g} noise units after the refit")
    # so little may as well be a floor that was taken too low, which events of free times would always mend
    marginal = all(e.ratio - 1.0 < max(MARGINAL * (e.limit - 1.0), HARDLY) for b in suspects for e in (now[b.name], out[b.name]))
    happening = [] if marginal else [e for e in acting if e in EVENTS]
    acting = [e for e in acting if e not in EVENTS]
    trial = Attempts(inner, outer, nominal, floor, out, suspects)
    mistaken = freed(trial, baseline, first, lambda text: say(f"{names}: {text}"))
    screened = screen(inner, baseline, acting, white, sealed=nominal.model["valve"] is None)
    singles = _singles(trial, screened, baseline, lambda text: say(f"{names}: {text}"))
    seconds = max(p.n * p.dt for p in inner.recordings)
    singles = _with_same_data(trial, start, singles, seconds)
    if happening and all(share_left(c, start, suspects) > DOUBTFUL for c in (*singles, *mistaken)):
        say(f"{names}: looking for what happens at times of its own ({', '.join(happening)})")
        singles += [c for e in happening if (c := trial.eventful(e, start)) is not None]
    settled = any(
        explains(c, start, suspects) or (share_left(c, start, suspects) < FORM and not _untouched(c, start, suspects))
        for c in (*singles, *mistaken)
    )
    # what a single effect leaves may be no more than the difference between its equation and the truth: a pair cannot be asked for
    pairs = [] if settled else _pairs(trial, screened, start, singles, lambda text: say(f"{names}: {text}"))
    for effect, beside in [] if settled else _beside(trial, screened, start, singles, happening):
        say(f"{names}: looking for {effect} beside {beside.effects[0]}")
        found = trial.eventful(effect, beside)
        pairs += [] if found is None else [found]
    candidates = [start, *singles, *pairs, *mistaken]
    most = most_believed(fitted, held, mismatch, now[mismatch.name].rms)
    ranging = visited(inner)
    weighed = weigh(candidates, suspects, most, seconds, ranging)
    close = sorted((c for c in candidates[1:] if _odds(weighed, c) > RIVAL), key=lambda c: -_odds(weighed, c))[:MOST_RIVALS]
    if len(close) > 1 or (close and not explains(close[0], start, suspects)):
        say(f"{names}: fitting to the end " + ", ".join(c.key for c in close))
        candidates = [trial.polished(c) if c in close else c for c in candidates]
        weighed = weigh(candidates, suspects, most, seconds, ranging)
    if marginal:
        weighed |= {"": NOTHING * weighed["unlisted"], "unlisted": (1.0 - NOTHING) * weighed["unlisted"]}
    often = inclusion(screened, LEAST_GAIN, PARTNER)
    # of the chi-square that is left noise has its part
    missing = screened.stand.power_left * (1.0 - 1.0 / max(now[mismatch.name].ratio, 1.0 + HARDLY))
    promised = {e: scores[0].gain / missing for e, scores in by_effect(screened.scores()).items()}
    group = Group(blocks, was, now, candidates, weighed, mismatch, floor, suspects, inclusion=often, promised=promised)
    parts = _apart(group, trial, most, seconds, ranging) if weighed["unlisted"] > UNNAMED else []
    if parts:
        return parts
    if weighed["unlisted"] < LIKELY or len({b.kind for b in suspects}) < len(suspects):
        return [group]  # of two chambers one form would have to serve both
    if any(b.name == "load" for b in suspects):
        say(f"{names}: no form of what is missing is looked for, since that of a load is not in the simulator")
        return [group]
    group = replace(group, sought=True)
    closed = find_closure(inner, nominal, baseline, colour, suspects, say)
    if closed is None:
        return [group]
    try:
        judged = trial.judged(closed.effects, closed)
    except SimulationError:
        return [group]
    # what does not carry over to recordings that were held out is no form of anything
    if share_left(judged, start, suspects) > CARRIES:
        return [group]
    return [replace(group, closure=judged, form=describe_closure(closed, inner, baseline))]


def _apart(group: Group, trial: Attempts, most: float, seconds: float, ranging: tuple[float, float] | None) -> list[Group]:
    """A group in parts, where a name explains a block in which alone it acts; else nothing.

    A leak of the tank is seen in the tank's pressure, whatever the chamber behind the valve keeps without a name, or with one of its
    own. All parts have one fit, with everything that they name.
    """
    start = group.candidates[0]
    acting = {c: [b for b in group.suspects if _acts(c, b)] for c in group.candidates if c.names}

    def weighed(blocks: list[Block]) -> dict[str, float]:
        there = [c for c in acting if any(b in blocks for b in acting[c])]
        return weigh([start, *there], blocks, most, seconds, ranging, acting)

    own = {b.name: weighed([b]) for b in group.suspects if any(found == [b] for found in acting.values())}
    named = [b for b in group.suspects if own.get(b.name, {"unlisted": 1.0})["unlisted"] < UNNAMED]
    rest = [b for b in group.suspects if b not in named]
    if not named:
        return []
    best = [max((c for c in acting if c.key in own[b.name]), key=lambda c: own[b.name][c.key]) for b in named]
    common = best[0].fit if len(best) == 1 else trial.united(best)
    if common is None:
        return []
    start = replace(start, fit=common)

    def part(blocks: list[Block], suspects: list[Block], probabilities: dict[str, float]) -> Group:
        return replace(
            group,
            blocks=blocks,
            candidates=[start, *(replace(c, fit=common) if c in best else c for c in acting if c.key in probabilities)],
            probabilities=probabilities,
            mismatch=max(suspects, key=lambda b: start.held_out[b.name].ratio + start.fitted[b.name].ratio),
            suspects=suspects,
            promised={e: p for e, p in group.promised.items() if any(acts_in(e, b) for b in suspects)},
        )

    parts = [part([b], [b], own[b.name]) for b in named]
    others = [b for b in group.blocks if b not in named]
    if rest:
        return [*parts, part(others, rest, weighed(rest))]
    # blocks that kept nothing stay with the first part
    return [replace(parts[0], blocks=[*named[:1], *others]), *parts[1:]]


def _acts(candidate: Candidate, block: Block) -> bool:
    """Whether what a hypothesis names acts in a block."""
    return any(acts_in(e, block) for e in candidate.effects) or any(name in block.parameters for name in candidate.wrong)


def _odds(weighed: dict[str, float], candidate: Candidate) -> float:
    """Probability of a hypothesis."""
    return weighed.get(candidate.key, 0.0)


def _together(inner: Problem, outer: Problem, nominal: Rig, start: Candidate, floor: dict[Key, Floor]) -> Candidate | None:
    """One baseline inside its tolerances that leaves only noise in fitted and held-out recordings, taken together, if there is one."""
    both = replace(inner, recordings=[*inner.recordings, *outer.recordings])
    try:
        found = fit(both, nominal, (), {}, without_colour(inner.blocks), warm=start.fit, evaluations=THOROUGH, share=EXACT)
    except SimulationError:
        return None
    fitted, held = ({b.name: excess(b, part.recordings, found.residuals, floor) for b in inner.blocks} for part in (inner, outer))
    if any(significant(e[b.name]) for b in inner.blocks for e in (fitted, held)):
        return None
    return Candidate((), found, held, fitted, 0.0)


def coloured(problem: Problem, nominal: Rig, first: Fit) -> tuple[Fit, dict[str, float]]:
    """The refitted baseline fitted on with the colour that it leaves as weights, where it leaves much, and that colour."""
    colour = colour_of(problem, first)
    if max(colour.values()) <= 2:
        return first, colour
    return fit(problem, nominal, (), {}, colour, warm=first, evaluations=THOROUGH, share=EXACT), colour


def refitted(problem: Problem, nominal: Rig, inflation: dict[str, float]) -> Fit:
    """The baseline refitted from the nominal values and, where that leaves more than noise could, from the other side of them."""
    first = fit(problem, nominal, (), {}, inflation, evaluations=THOROUGH, share=EXACT)
    rows = sum(int(r.rows.sum()) / bin_width(p, FIT_BIN) for p in problem.recordings for r in _of(p, first.residuals))
    if 2.0 * first.cost < MARGIN * rows:
        return first
    known = nominal.parameters
    mirrored = {n: 2.0 * known[n].value - first.values[n] for n in first.moved}
    try:
        second = fit(problem, nominal, (), {}, inflation, warm=replace(first, values=mirrored), evaluations=THOROUGH, share=EXACT)
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
    if effect == "payload_change" and rig.model["load"]:
        return bool(rig.model["load"]["kind"] == "mass")
    needs = EFFECTS[effect].at or ("joint" if EFFECTS[effect].block == "arm" else "chamber")
    return bool(rig.tables(needs))


def _singles(trial: Attempts, screened: Screen, baseline: Fit, say: Callable[[str], None]) -> list[Candidate]:
    """The effects that the screen finds worth it, fitted; the most telling first."""
    ranked = by_effect(screened.scores())
    gains = {effect: scores[0].gain for effect, scores in ranked.items()}
    most = max(gains.values(), default=0.0)
    chosen = [e for e, gain in gains.items() if gain > max(LEAST_GAIN, LEAST_SHARE * most)][:MOST_SINGLES]
    say("screened: " + (", ".join(f"{e} {gain:.3g}" for e, gain in list(gains.items())[:8]) or "no effect acts here"))
    white = trial.white
    found = []
    for place, effect in enumerate(chosen):
        near = [s for s in ranked[effect] if s.gain > NEAR * gains[effect]]
        tried = [trial.fitted([s.start.scaled(s.size)], baseline, white) for s in near[: STARTS if place < RICH else 1]]
        fitted = [candidate for candidate in tried if candidate is not None]
        if fitted:
            found.append(replace(min(fitted, key=lambda c: c.misfit), gain=gains[effect]))
    return found


def _with_same_data(trial: Attempts, start: Candidate, singles: list[Candidate], seconds: float) -> list[Candidate]:
    """The singles, and beside each that may be the same data as another effect (a late clock and a dead time) that other one."""
    found = list(singles)
    for place, single in enumerate(singles):
        same = EFFECTS[single.effects[0]].same_data
        if same is None:
            continue
        own = start_of(single.fit, single.effects[0])
        held = {f"{own.effect}.{name}": value for name, value in same.held}
        if any(own.held[name] != value for name, value in held.items()):
            # the shape that is the same data is taken where it explains as much
            alike = trial.fitted([replace(own, held=own.held | held)], start.fit, trial.white)
            if alike is None or share_left(alike, start, trial.suspects) > share_left(single, start, trial.suspects) + FINE:
                continue
            single = found[place] = replace(alike, gain=single.gain)
        if not same_recordings(single, own.effect, seconds) or any(c.effects == (same.effect,) for c in singles):
            continue
        usual = {f"{same.effect}.{p.name}": p.default for p in EFFECTS[same.effect].parameters}
        usual[f"{same.effect}.{same.parameter}"] = single.fit.values[f"{own.effect}.{same.size}"]
        other = trial.fitted([Start(same.effect, usual, {}, (), False)], start.fit, trial.white)
        found += [] if other is None else [other]
    named = {c.effects for c in found}
    for effect, same in ((e, i.same_data) for e, i in EFFECTS.items() if i.same_data is not None and (e,) not in named):
        twin = next((c for c in singles if c.effects == (same.effect,)), None)
        size = 0.0 if twin is None else twin.fit.values.get(f"{same.effect}.{same.parameter}", 0.0)
        if size <= 0.0:
            continue
        free = {f"{effect}.{same.size}": size, f"{effect}.{same.without}": 0.0}
        held = {f"{effect}.{name}": value for name, value in same.held}
        other = trial.fitted([Start(effect, free, held, (), False)], start.fit, trial.white)
        found += [] if other is None else [other]
    return found


def _beside(
    trial: Attempts, screened: Screen, start: Candidate, singles: list[Candidate], happening: list[str]
) -> list[tuple[str, Candidate]]:
    """Effects with times of their own, each with a lasting one that it may have happened beside.

    That is the lasting effect that leaves least, if it leaves much; and, of those that were fitted, the one whose signature
    is in what the events leave.
    """
    steady = [c for c in singles if c.fit.events is None]
    best = min(steady, key=lambda c: share_left(c, start, trial.suspects), default=start)
    found = [(e, best) for e in happening] if BESIDE < share_left(best, start, trial.suspects) < MAIN else []
    mismatch = float(screened.stand.rows @ screened.stand.rows)
    for single in singles:
        if single.fit.events is None or share_left(single, start, trial.suspects) > MAIN:
            continue
        # what the baseline can do is taken as without the events
        kept = start.fit.residuals
        left = {key: replace(r, jacobian=kept[key].jacobian) for key, r in single.fit.residuals.items()}
        beside = replace(start.fit, residuals=left, moved=single.fit.moved)
        told = [s for s in screened.scores(stand_of(beside, trial.inner, trial.white)) if s.gain > max(LEAST_GAIN, PARTNER * mismatch)]
        partner = next((c for s in told for c in steady if c.effects == (s.effect,)), None)
        if partner is not None and (single.effects[0], partner) not in found:
            found.append((single.effects[0], partner))
    return found


def _untouched(candidate: Candidate, start: Candidate, suspects: list[Block]) -> list[Block]:
    """Blocks in which a set leaves most of what was too much there, in recordings that were fitted or held out."""
    stages = ((start.fitted, candidate.fitted), (start.held_out, candidate.held_out))
    return [
        b
        for b in suspects
        if any(significant(now[b.name]) and now[b.name].ratio - 1.0 > MAIN * (was[b.name].ratio - 1.0) for was, now in stages)
    ]


def _pairs(
    trial: Attempts, screened: Screen, start: Candidate, singles: list[Candidate], say: Callable[[str], None]
) -> list[Candidate]:
    """For the best singles that leave something: the effects that would take most of it, fitted together with them."""
    lasting = [c for c in singles if c.fit.events is None]
    ranked = sorted(lasting, key=lambda c: sum(c.held_out[b.name].ratio for b in trial.suspects))[:PAIRED]
    white = trial.white
    mismatch = float(screened.stand.rows @ screened.stand.rows)
    tried: set[frozenset[str]] = set()
    found = []
    for single in ranked:
        stand = stand_of(single.fit, trial.inner, white)
        partners = [scores[0] for scores in by_effect(screened.scores(stand, without=single.effects)).values()]
        least = max(LEAST_GAIN, PARTNER * mismatch)
        best = [score for score in partners if score.gain > least][:PARTNERS]
        # what one block keeps may be little beside what another one had: an effect of that block alone is asked for by itself
        for block in _untouched(single, start, trial.suspects):
            own = [s for s in partners if s.gain > LEAST_GAIN and [b for b in trial.suspects if acts_in(s.effect, b)] == [block]]
            best += [score for score in own[:1] if score not in best]
        for score in best:
            both = frozenset({*single.effects, score.effect})
            if both in tried:
                continue
            tried.add(both)
            say(f"trying {' + '.join(sorted(both))}")
            candidate = trial.fitted([start_of(single.fit, single.effects[0]), score.start.scaled(score.size)], single.fit, white)
            if candidate is not None:
                found.append(candidate)
    return found
