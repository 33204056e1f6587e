"""Sets of several hypotheses: which effects, and which values that are wrong, are fitted
together.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pamrs.diagnosis.evidence import Attempts, Candidate, explains, share_left, significant
from pamrs.diagnosis.fit import acts_in
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.screen import Score, Screen, by_effect, stand_of
from pamrs.diagnosis.search._wrong_parameters import strained_parameters
from pamrs.effects import exclude, id_of

__all__ = ["beside_wrong", "left_everywhere", "settles", "several", "without_needless"]

Say = Callable[[str], None]


def several(
    trial: Attempts,
    screened: Screen,
    start: Candidate,
    singles: list[Candidate],
    mistaken: list[Candidate],
    transient: list[str],
    tell: Say,
) -> list[Candidate]:
    """Sets of two hypotheses and more, where no single one settles the mismatch.

    Parameters
    ----------
    trial : Attempts
        Recordings, model, noise levels.
    screened : Screen
        Signatures of the effects.
    start : Candidate
        The refitted baseline.
    singles, mistaken : list of Candidate
        Single effects and values that are wrong, fitted by themselves.
    transient : list of str
        Effects that happen at times of their own.
    tell : callable
        Receives progress.

    Returns
    -------
    list of Candidate
    """
    pairs = _pairs(trial, screened, start, singles, tell)
    pairs += _telling_together(trial, start, singles, mistaken, pairs, tell)
    for effect, beside in _beside(trial, screened, start, singles, transient):
        tell(f"looking for {effect} beside {beside.effects[0]}")
        found = trial.transient(effect, beside)
        pairs += [] if found is None else [found]
    return [*pairs, *_grown(trial, screened, pairs, tell)]


def beside_wrong(trial: Attempts, sets: list[Candidate], tell: Say) -> list[Candidate]:
    """The single effect and the set that leave least, each beside a file that is wrong: parameters
    that they move far, freed one at a time.
    """
    lasting = [c for c in sets if c.fit.events is None]
    singles = [c for c in lasting if len(c.effects) == 1]
    best = [min(part, key=left_everywhere) for part in (singles, lasting) if part]
    walls = trial.settings.fit.most_tolerances
    found = []
    for candidate in dict.fromkeys(best):
        starts = [trial.start_of(candidate.fit, e) for e in candidate.effects]
        for name in strained_parameters(trial, candidate.fit):
            tell(f"trying {' + '.join(candidate.effects)} beside another {name}")
            beside = trial.beside_wrong(starts, candidate.fit, (name,))
            if beside is not None and beside.is_wrong(walls):
                found.append(beside)
    return found


def _pairs(
    trial: Attempts, screened: Screen, start: Candidate, singles: list[Candidate], tell: Say
) -> list[Candidate]:
    """For the best singles that leave something: the effects that would take most of it, fitted
    together with them.
    """
    settings = trial.settings.search
    persistent = [c for c in singles if c.fit.events is None]
    ranked = sorted(
        persistent, key=lambda c: sum(c.held_out[b.name].ratio for b in trial.suspects)
    )[: settings.most_paired]
    white = trial.white
    mismatch = float(screened.stand.rows @ screened.stand.rows)
    tried: set[frozenset[str]] = set()
    found = []
    for single in ranked:
        stand = stand_of(single.fit, trial.inner, white)
        partners = [
            scores[0]
            for scores in by_effect(screened.scores(stand, without=single.effects)).values()
        ]
        least = max(settings.least_gain, settings.partner_share * mismatch)
        likely = [score for score in partners if score.gain > least]
        best = _one_place_each(likely)[: settings.most_partners]
        # what is left in one block may be little beside what another one had: an effect of that
        # block alone is tested by itself
        for block in _untouched(single, start, trial):
            there = [
                s
                for s in partners
                if [b for b in trial.suspects if acts_in(s.effect, b)] == [block]
            ]
            own = [s for s in there if s.gain > settings.least_gain]
            best += [score for score in own[:1] if score not in best]
        for score in best:
            both = frozenset({*single.effects, score.effect})
            if both in tried:
                continue
            tried.add(both)
            tell(f"trying {' + '.join(sorted(both))}")
            candidate = _with_partner(trial, single, score)
            if candidate is not None:
                found.append(candidate)
    return found


def _telling_together(
    trial: Attempts,
    start: Candidate,
    singles: list[Candidate],
    mistaken: list[Candidate],
    pairs: list[Candidate],
    tell: Say,
) -> list[Candidate]:
    """The single effects that leave least, each with what takes a telling share of the mismatch by
    itself: another effect, or a value that is wrong.

    The signature of a strong effect beside another one is linear in what is not; where both were
    fitted, both are known.
    """
    settings, evidence = trial.settings.search, trial.settings.evidence
    left = {
        c: share_left(c, start, trial.compared, evidence)
        for c in (*singles, *mistaken)
        if c.fit.events is None
    }
    telling = sorted((c for c in left if left[c] < settings.telling_left), key=left.__getitem__)
    leading = [c for c in telling if c.effects][: settings.most_paired]
    done = {frozenset(c.names) for c in pairs}
    found = []
    for one in leading:
        for other in [c for c in telling if c is not one][: settings.most_partners]:
            names = frozenset({*one.names, *other.names})
            if names in done or any(exclude(e, one.effects) for e in other.effects):
                continue
            done.add(names)
            tell(f"trying {' + '.join(sorted(names))}")
            both = _joined(trial, one, other)
            found += [] if both is None else [both]
    return found


def _one_place_each(scores: list[Score]) -> list[Score]:
    """Of scores in the order of their gain the first of each effect, wherever it acts."""
    best: dict[str, Score] = {}
    for score in scores:
        best.setdefault(id_of(score.effect), score)
    return list(best.values())


def _joined(trial: Attempts, one: Candidate, other: Candidate) -> Candidate | None:
    """Two hypotheses, the first one of them an effect, fitted together from where each stood."""
    starts = [trial.start_of(c.fit, effect) for c in (one, other) for effect in c.effects]
    if not other.wrong:
        return trial.fitted(starts, one.fit, trial.white)
    values = {name: other.fit.values[name] for name in other.wrong}
    warm = replace(one.fit, values=one.fit.values | values)
    both = trial.beside_wrong(starts, warm, other.wrong)
    walls = trial.settings.fit.most_tolerances
    return both if both is not None and both.is_wrong(walls) else None


def _beside(
    trial: Attempts,
    screened: Screen,
    start: Candidate,
    singles: list[Candidate],
    happening: list[str],
) -> list[tuple[str, Candidate]]:
    """Effects with times of their own, each with a persistent one that it may have happened beside.

    That is the persistent effect that leaves least, if it leaves much; and, of those that were
    fitted, the one whose signature is in what the events leave.
    """
    settings, evidence = trial.settings.search, trial.settings.evidence

    def left_by(candidate: Candidate) -> float:
        return share_left(candidate, start, trial.compared, evidence)

    steady = [c for c in singles if c.fit.events is None]
    best = min(steady, key=left_by, default=start)
    found = (
        [(e, best) for e in happening]
        if settings.transient_beside < left_by(best) < settings.much_left
        else []
    )
    mismatch = float(screened.stand.rows @ screened.stand.rows)
    for single in singles:
        if single.fit.events is None or left_by(single) > settings.much_left:
            continue
        # what the baseline can do is taken as without the events
        kept = start.fit.residuals
        left = {
            key: replace(r, jacobian=kept[key].jacobian) for key, r in single.fit.residuals.items()
        }
        beside = replace(start.fit, residuals=left, moved=single.fit.moved)
        least = max(settings.least_gain, settings.partner_share * mismatch)
        told = [
            s for s in screened.scores(stand_of(beside, trial.inner, trial.white)) if s.gain > least
        ]
        partner = next((c for s in told for c in steady if c.effects == (s.effect,)), None)
        if partner is not None and (single.effects[0], partner) not in found:
            found.append((single.effects[0], partner))
    return found


def without_needless(
    trial: Attempts, candidates: list[Candidate], sets: list[Candidate], tell: Say
) -> list[Candidate]:
    """Sets with one term fewer that leave nearly as little, fitted from where the larger one is.

    A fit of the smaller set from elsewhere may have ended in a hollow of its own, so that the
    larger one seems to be asked for.

    Parameters
    ----------
    trial : Attempts
        Recordings, model, noise levels.
    candidates : list of Candidate
        Every hypothesis that was fitted.
    sets : list of Candidate
        Those whose terms are taken out, one at a time.
    tell : callable
        Receives progress.

    Returns
    -------
    list of Candidate
        Those that leave less than the fits of the same names before, at most one for each.
    """
    share = trial.settings.search.further_share
    known: dict[frozenset[str], float] = {}
    for c in candidates:
        known[frozenset(c.names)] = min(c.misfit, known.get(frozenset(c.names), math.inf))
    found: dict[frozenset[str], Candidate] = {}
    for larger in (c for c in sets if len(c.names) > 1 and c.fit.events is None):
        for needless in larger.names:
            names = frozenset(larger.names) - {needless}
            if (1.0 - share) * known.get(names, math.inf) < larger.misfit:
                continue
            tell(f"trying {' + '.join(sorted(names))} from {' + '.join(sorted(larger.names))}")
            smaller = trial.without(larger, needless)
            if smaller is not None and smaller.misfit < known.get(names, math.inf):
                found[names], known[names] = smaller, smaller.misfit
    walls = trial.settings.fit.most_tolerances
    return [c for c in found.values() if c.is_wrong(walls)]


def _untouched(candidate: Candidate, start: Candidate, trial: Attempts) -> list[Block]:
    """Blocks in which a set leaves most of what was too much there, in recordings that were fitted
    or held out.
    """
    much = trial.settings.search.much_left
    stages = ((start.fitted, candidate.fitted), (start.held_out, candidate.held_out))
    return [
        b
        for b in trial.suspects
        if any(
            significant(now[b.name]) and now[b.name].ratio - 1.0 > much * (was[b.name].ratio - 1.0)
            for was, now in stages
        )
    ]


def _grown(trial: Attempts, screened: Screen, pairs: list[Candidate], tell: Say) -> list[Candidate]:
    """Sets of three effects and more: the pair that leaves least with one effect after the other,
    as long as held-out recordings are clearly predicted better.
    """
    settings = trial.settings.search
    lasting = [c for c in pairs if c.fit.events is None]
    best = min(lasting, key=left_everywhere, default=None)
    found: list[Candidate] = []
    while best is not None and len(best.effects) < settings.most_terms:
        stand = stand_of(best.fit, trial.inner, trial.white)
        ranked = by_effect(screened.scores(stand, without=best.effects)).values()
        least = max(settings.least_gain, settings.partner_share * stand.power_left)
        likely = _one_place_each([s[0] for s in ranked if s[0].gain > least])
        tried = []
        for score in likely[: settings.most_partners]:
            tell(f"trying {' + '.join([*best.effects, score.effect])}")
            candidate = _with_partner(trial, best, score)
            tried += [] if candidate is None else [candidate]
        further = min(tried, key=left_everywhere, default=None)
        if further is None or not _predicts_better(further, best, trial):
            break
        found.append(further)
        best = further
    return found


def _with_partner(trial: Attempts, candidate: Candidate, score: Score) -> Candidate | None:
    """The effects of a candidate fitted together with a further one, from where both stand."""
    begun = [trial.start_of(candidate.fit, effect) for effect in candidate.effects]
    return trial.fitted([*begun, score.start.scaled(score.size)], candidate.fit, trial.white)


def _predicts_better(further: Candidate, best: Candidate, trial: Attempts) -> bool:
    """Whether a larger set takes a telling share of what a smaller one leaves of held-out
    recordings, and more than the pieces of the recordings differ in it.
    """
    settings = trial.settings.search
    taken, left = [], 0.0
    for block in trial.suspects:
        before, after = (c.held_out[block.name].pieces for c in (best, further))
        taken += [n * (was - now) for (was, n), (now, _) in zip(before, after, strict=True)]
        left += sum(n * (was - 1.0) for was, n in before)
    if len(taken) < 2 or left <= 0.0:
        return False
    error = math.sqrt(len(taken)) * float(np.std(taken, ddof=1))
    gained = float(sum(taken))
    return gained > settings.further_errors * error and gained > settings.further_share * left


def settles(candidate: Candidate, trial: Attempts, start: Candidate) -> bool:
    """Whether a hypothesis leaves so little that no pair can be called for.

    What a single effect leaves may be no more than the difference between its equation and the
    truth.
    """
    evidence = trial.settings.evidence
    if explains(candidate, start, trial.compared, evidence):
        return True
    little = share_left(candidate, start, trial.compared, evidence) < evidence.form_share
    return little and not _untouched(candidate, start, trial)


def left_everywhere(candidate: Candidate) -> float:
    """Logarithm of what a hypothesis leaves of each block, on fitted and on held-out recordings:
    by it the forms of an effect are compared.
    """
    stages = (candidate.fitted, candidate.held_out)
    return sum(math.log(max(e.ratio, 1.0)) for stage in stages for e in stage.values())
