"""Sets of several hypotheses: which effects, and which values that are wrong, are fitted
together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from pamrs.diagnosis.evidence import (
    FORM_SHARE_ALIKE,
    LEAST_TEMPERING,
    SAME_STDS,
    FittedHypothesis,
    Prior,
    log_weight,
    share_left,
    significant,
)
from pamrs.diagnosis.fit import Start, acts_in, start_of, two_at_a_time
from pamrs.diagnosis.noise import with_sizes
from pamrs.diagnosis.prepare import CLEARLY_LESS, Block
from pamrs.diagnosis.screen import Score, Screen, Tangent, best_of_each_kind, by_effect, tangent_of
from pamrs.diagnosis.search._attempts import BEAM, Attempts
from pamrs.diagnosis.search._wrong_parameters import FURTHER_SHARE, far_parameters
from pamrs.effects import Hypothesis, Term

# strong mismatch, ten times the noise: linear signatures tell no sizes (decision 13)
_STRONG_RATIO = 100.0
LEAST_GAIN = 12.0  # [chi-square] gain by the screen from which an effect is fitted (decision 13)
# share of the best gain that fits another place, which alike blocks half show (decision 103), or
# form, as strong effects are not linear
NEAR_BEST = 0.3
_PARTNER_SHARE = 0.01  # least predicted gain of a partner, as a share of the mismatch (decision 13)
# share left by the best persistent effect that asks for transient ones (decision 20)
_LEFT_FOR_TRANSIENT = 0.08


Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Search:
    """Recordings, screen, baseline and weights with which hypotheses for a mismatch are found.

    Attributes
    ----------
    attempts : Attempts
        Recordings, model, noise levels.
    screened : Screen
        Signatures of the effects.
    start : FittedHypothesis
        The refitted baseline.
    prior : Prior
        Their odds before any data.
    tell : callable
        Receives progress.
    """

    attempts: Attempts
    screened: Screen
    start: FittedHypothesis
    prior: Prior
    tell: Say

    def weight(self, candidate: FittedHypothesis) -> float:
        """Logarithm of what a hypothesis weighs against others."""
        # the tempering of `posterior` depends on the best hypothesis of all, which is not found
        # yet: by a fixed one the order of those that are known stays as it is when others come
        return log_weight(
            candidate, self.start, self.attempts.compared, self.prior, LEAST_TEMPERING
        )

    def share_left(self, candidate: FittedHypothesis) -> float:
        """Share of the mismatch that a hypothesis leaves."""
        return share_left(candidate, self.start, self.attempts.compared)

    def heaviest_first(self, candidates: Iterable[FittedHypothesis]) -> list[FittedHypothesis]:
        """Hypotheses in the order of their weight."""
        return sorted(candidates, key=self.weight, reverse=True)

    def rank(self, base: FittedHypothesis) -> tuple[Tangent, dict[Term, list[Score]]]:
        """The tangent space of a set, and the starts of each effect by what they would take of what
        the set leaves.
        """
        tangent = tangent_of(base.fit, self.attempts.fit_problem, self.attempts.no_inflation)
        return tangent, by_effect(self.screened.scores(tangent, without=base.effects))


def combine(
    search: Search,
    singles: list[FittedHypothesis],
    wrong_values: list[FittedHypothesis],
    transient: list[Term],
) -> list[FittedHypothesis]:
    """Sets of two hypotheses and more, where no single one settles the mismatch.

    The best of the single ones get a partner: another effect, or a value that is wrong. The best of
    these sets grows, one term after the other, as long as held-out recordings are clearly predicted
    better. No set has more terms than the settings allow.

    Parameters
    ----------
    search : Search
        What they are found with.
    singles, wrong_values : list of FittedHypothesis
        Single effects and values that are wrong, fitted by themselves.
    transient : list of Term
        Effects that happen at times of their own.
    """
    if search.attempts.settings.most_terms < 2:
        return []
    roots = search.heaviest_first(c for c in (*singles, *wrong_values) if c.fit.events is None)
    growing = _Growing(search, roots)
    sets = [s for root in roots[:BEAM] for s in growing.widen(root)]
    with_events = []
    for effect, partner in _event_partners(search, singles, transient):
        search.tell(f"looking for {effect} with {partner.effects[0]}")
        fitted = search.attempts.fit_events(effect, partner)
        with_events += [] if fitted is None else [fitted]
    return [*sets, *with_events, *growing.grow(sets)]


def with_freed_values(search: Search, single: FittedHypothesis) -> list[FittedHypothesis]:
    """Free the parameters that an effect moves far, one at a time, next to the effect."""
    fitted = []
    for name in far_parameters(search.attempts, single.fit):
        search.tell(f"trying {single.hypothesis} with another {name}")
        starts = search.attempts.starts_of(single)
        freed = search.attempts.fit_together(starts, single.fit, (name,))
        fitted += [] if freed is None else [freed]
    return fitted


@dataclass(frozen=True, eq=False)
class _Partner:
    """Effects and wrong parameters that a set may get as its next term.

    Attributes
    ----------
    starts : list of Start
        Where its effects begin.
    wrong : tuple of str
        Parameters that are wrong; two where one mistake makes two wrong.
    values : dict of str to float
        Where these begin, SI.
    """

    starts: list[Start]
    wrong: tuple[str, ...] = ()
    values: dict[str, float] = field(default_factory=dict)

    @property
    def terms(self) -> tuple[Term, ...]:
        """Effects and wrong parameters, as terms."""
        return (*(start.effect for start in self.starts), *map(Term, self.wrong))


@dataclass(frozen=True, eq=False)
class _Growing:
    """Sets of hypotheses that get one term after the other.

    Attributes
    ----------
    search : Search
        What they are found with.
    roots : list of FittedHypothesis
        Single effects and values that are wrong, fitted by themselves, those that weigh most first.
    tried_sets : set of Hypothesis
        Sets that were fitted.
    likely : list of _Partner
        What leaves least together with the single hypothesis that weighs most, which the others get
        too.
    """

    search: Search
    roots: list[FittedHypothesis]
    tried_sets: set[Hypothesis] = field(default_factory=set)
    likely: list[_Partner] = field(default_factory=list)

    def grow(self, sets: list[FittedHypothesis]) -> list[FittedHypothesis]:
        """Grow the best set by one term after the other."""
        weight = self.search.weight
        best = max(sets, key=weight, default=None)
        grown: list[FittedHypothesis] = []
        while best is not None and len(best.terms) < self.search.attempts.settings.most_terms:
            formed = self._in_best_forms(best, [*sets, *grown])
            grown += formed
            best = max(formed, key=weight)
            widened = self.widen(best)
            further = max(widened, key=weight, default=None)
            if further is None or not _predicts_better(further, best, self.search.attempts):
                break
            grown += widened
            best = further
        return grown

    def _in_best_forms(
        self, base: FittedHypothesis, others: list[FittedHypothesis]
    ) -> list[FittedHypothesis]:
        """A set with its effects in their best forms, and its rivals in the forms that it has then:
        which of them leaves least must not depend on whose forms were looked at.
        """
        attempts = self.search.attempts
        best = in_best_forms(self.search, base)
        before, after = ({e: start_of(c.fit, e).kind for e in base.effects} for c in (base, best))
        mended = {e for e in base.effects if before[e] != after[e]}
        rivals = self.search.heaviest_first(
            c for c in others if mended & set(c.effects) and c.fit.events is None
        )

        def formed(rival: FittedHypothesis) -> FittedHypothesis | None:
            starts = [start_of((best if e in mended else rival).fit, e) for e in rival.effects]
            return attempts.fit_together(starts, rival.fit, rival.wrong)

        reformed = two_at_a_time(formed, rivals[: attempts.settings.most_polished])
        return [best, *(c for c in reformed if c is not None)]

    def widen(self, base: FittedHypothesis) -> list[FittedHypothesis]:
        """A set with each of its likely partners, fitted from where both are."""
        starts = self.search.attempts.starts_of(base)
        partners = []
        for partner in self._partners(base, starts):
            if not self._was_tried(base, partner.terms):
                self.tried_sets.add(Hypothesis((*base.terms, *partner.terms)))
                self.search.tell(f"trying {Hypothesis((*base.terms, *partner.terms))}")
                partners.append(partner)

        def fitted(partner: _Partner) -> FittedHypothesis | None:
            warm = replace(base.fit, values=base.fit.values | partner.values)
            wrong = (*base.wrong, *partner.wrong)
            return self.search.attempts.fit_together([*starts, *partner.starts], warm, wrong)

        return [c for c in two_at_a_time(fitted, partners) if c is not None]

    def _was_tried(self, base: FittedHypothesis, terms: tuple[Term, ...]) -> bool:
        """True where a set was fitted with some further terms."""
        return Hypothesis((*base.terms, *terms)) in self.tried_sets

    def _partners(self, base: FittedHypothesis, starts: list[Start]) -> Iterator[_Partner]:
        """Partners of a set: effects whose signature is in what it leaves, terms that explain much
        alone, and parameters that it moves far.
        """
        if far_above_noise(self.search.attempts, base):
            alone = len(base.terms) == 1
            likely = (alone and self.likely) or self._shortlisted(base, starts)
            if alone:
                self.likely[:] = likely
            for partner in likely:
                if not any(term.excluded_by(base.effects) for term in partner.terms):
                    yield partner
        else:
            for scores in self._signatures(base):
                if not self._was_tried(base, (scores[0].effect,)):
                    yield self._begun_best(base, starts, scores)
        yield from self._telling(base)
        far = far_parameters(self.search.attempts, base.fit) if base.effects else []
        yield from (_Partner([], (name,)) for name in far if name not in base.wrong)

    def _shortlisted(self, base: FittedHypothesis, base_starts: list[Start]) -> list[_Partner]:
        """Partners of a set: effects, of all that act, that leave least with it after a few steps.

        Signatures are linear in what a strong mismatch is not: they rank the starts of a form.
        """
        _, ranked = self.search.rank(base)
        further = [
            score.start.scaled(score.size)
            for effect in _one_place_each(list(ranked))
            if not self._was_tried(base, (effect,))
            for score in best_of_each_kind(ranked[effect])
        ]
        best: dict[Term, _Partner] = {}
        for candidate, start in self._shortly(base, base_starts, further):
            begin = start_of(candidate.fit, start.effect)
            best.setdefault(start.effect, _Partner([begin]))
        return list(best.values())[:BEAM]

    def _shortly(
        self, base: FittedHypothesis, base_starts: list[Start], starts: list[Start]
    ) -> list[tuple[FittedHypothesis, Start]]:
        """A set with an effect more, fitted in a few steps from each of its starts, with the start;
        what weighs most comes first.
        """

        def begin(start: Start) -> FittedHypothesis | None:
            return self.search.attempts.fit_shortly([*base_starts, start], base.fit, base.wrong)

        short = zip(two_at_a_time(begin, starts), starts, strict=True)
        fitted = [(c, start) for c, start in short if c is not None]
        return sorted(fitted, key=lambda one: self.search.weight(one[0]), reverse=True)

    def _begun_best(
        self, base: FittedHypothesis, base_starts: list[Start], scores: list[Score]
    ) -> _Partner:
        """Partner of a set: an effect from the start that leaves least after a few steps."""
        starts = [s.start.scaled(s.size) for s in scores[:BEAM]]
        short = self._shortly(base, base_starts, starts if len(starts) > 1 else [])
        return _Partner([short[0][1] if short else starts[0]])

    def _signatures(self, base: FittedHypothesis) -> list[list[Score]]:
        """The effects that would take most of what a set leaves, each from all its starts."""
        attempts = self.search.attempts
        tangent, ranked = self.search.rank(base)
        alone = len(base.terms) == 1
        # what a term leaves is a mismatch of its own, however large what it takes is
        least = max(LEAST_GAIN, _PARTNER_SHARE * tangent.power_left)
        likely = [e for e, scores in ranked.items() if scores[0].gain > least]
        best = _one_place_each(likely)[:BEAM]
        # what is left in one block may be little next to what another one had: an effect of that
        # block alone is tested by itself
        for block in _blocks_untouched(base, self.search.start, attempts) if alone else []:
            in_block = [
                effect
                for effect, scores in ranked.items()
                if [b for b in attempts.suspects if acts_in(effect, b)] == [block]
                and scores[0].gain > LEAST_GAIN
            ]
            best += [effect for effect in in_block[:1] if effect not in best]
        return [ranked[effect] for effect in best]

    def _telling(self, base: FittedHypothesis) -> list[_Partner]:
        """Partners that take a large share of the mismatch alone (decision 103).

        The signature of a strong effect in the presence of another one is linear in what is not;
        where both were fitted, both are known.
        """
        telling = [
            c
            for c in self.roots
            if self.search.share_left(c) < 1.0 - FURTHER_SHARE
            and c.hypothesis.set.isdisjoint(base.terms)
            and (c.effects or base.effects)
            and not any(e.excluded_by(base.effects) for e in c.effects)
        ]
        return [
            _Partner(
                self.search.attempts.starts_of(c),
                c.wrong,
                {name: c.fit.values[name] for name in c.wrong},
            )
            for c in telling[:BEAM]
        ]


def _one_place_each(terms: list[Term]) -> list[Term]:
    """The first place of each effect, wherever it acts."""
    best: dict[str, Term] = {}
    for term in terms:
        best.setdefault(term.id, term)
    return list(best.values())


def _event_partners(
    search: Search, singles: list[FittedHypothesis], transient: list[Term]
) -> list[tuple[Term, FittedHypothesis]]:
    """Effects with times of their own, each with a persistent one that may have acted as well.

    That is the persistent effect that weighs most, if it leaves much; and, of those that were
    fitted, the one whose signature is in what the events leave.
    """
    attempts, screened, start = search.attempts, search.screened, search.start
    steady = [c for c in singles if c.fit.events is None]
    best = max(steady, key=search.weight, default=start)
    leaves_some = _LEFT_FOR_TRANSIENT < search.share_left(best) < CLEARLY_LESS
    pairs = [(e, best) for e in transient] if leaves_some else []
    mismatch = float(screened.tangent.rows @ screened.tangent.rows)
    for single in singles:
        if single.fit.events is None or search.share_left(single) > CLEARLY_LESS:
            continue
        # what the baseline can do is taken as without the events
        baseline_residuals = start.fit.residuals
        left_by_events = {
            key: replace(r, jacobian=baseline_residuals[key].jacobian)
            for key, r in single.fit.residuals.items()
        }
        known = replace(start.fit, residuals=left_by_events, moved=single.fit.moved)
        least = max(LEAST_GAIN, _PARTNER_SHARE * mismatch)
        shown = [
            s
            for s in screened.scores(tangent_of(known, attempts.fit_problem, attempts.no_inflation))
            if s.gain > least
        ]
        partner = next((c for s in shown for c in steady if c.effects == (s.effect,)), None)
        if partner is not None and (single.effects[0], partner) not in pairs:
            pairs.append((single.effects[0], partner))
    return pairs


def in_best_forms(search: Search, base: FittedHypothesis) -> FittedHypothesis:
    """Set with each of its effects in the form that leaves least together with the others.

    The form that an effect had alone is the one that did best for everything that was missing.

    Parameters
    ----------
    search : Search
        With the signatures from which other forms begin.
    base : FittedHypothesis
        A set of lasting effects and values that are wrong, fitted.

    Returns
    -------
    FittedHypothesis
        The set itself where it leaves noise, and where no other form leaves less.
    """
    if len(base.terms) < 2 or base.fit.events is not None:
        return base

    def leaves_more() -> bool:
        return any(significant(best.fit_excess[b.name]) for b in search.attempts.suspects)

    best = base
    ranked = by_effect(search.screened.scores()) if leaves_more() else {}
    for effect in base.effects:
        while leaves_more():
            other = _in_another_form(search, best, effect, ranked.get(effect, []))
            if other is None:
                break
            best = other
    return best


def _in_another_form(
    search: Search, base: FittedHypothesis, effect: Term, scores: list[Score]
) -> FittedHypothesis | None:
    """A set with one effect in another form, where one leaves clearly less."""
    attempts = search.attempts
    now = start_of(base.fit, effect)
    others = [
        score.start.scaled(score.size)
        for score in best_of_each_kind(scores)
        if score.start.form != now.form or not score.start.fixed.items() <= now.fixed.items()
    ]
    if not others:
        return None
    search.tell(f"trying other forms of {effect} in {base.hypothesis}")
    rest = [start_of(base.fit, e) for e in base.effects if e != effect]

    def begin(start: Start) -> FittedHypothesis | None:
        # parameters that both forms have go on from where they are
        free = {n: base.fit.values.get(n, value) for n, value in start.free.items()}
        starts = [*rest, replace(start, free=free)]
        return attempts.fit_shortly(starts, base.fit, base.wrong)

    short = [c for c in two_at_a_time(begin, others) if c is not None]
    best = min(short, key=lambda c: c.misfit, default=None)
    if best is None or best.misfit > base.misfit / NEAR_BEST:
        return None
    fitted = attempts.fit_together(attempts.starts_of(best), best.fit, base.wrong)
    if fitted is None or log_misfit(fitted) > log_misfit(base) - FORM_SHARE_ALIKE:
        return None
    return replace(fitted, gain=base.gain)


def _blocks_untouched(
    candidate: FittedHypothesis, start: FittedHypothesis, attempts: Attempts
) -> list[Block]:
    """Blocks in which a set leaves most of what was too much there, in recordings that were fitted
    or held out.
    """
    stages = (
        (start.fit_excess, candidate.fit_excess),
        (start.held_out_excess, candidate.held_out_excess),
    )
    return [
        b
        for b in attempts.suspects
        if any(
            significant(now[b.name])
            and now[b.name].ratio - 1.0 > CLEARLY_LESS * (was[b.name].ratio - 1.0)
            for was, now in stages
        )
    ]


def _predicts_better(further: FittedHypothesis, best: FittedHypothesis, attempts: Attempts) -> bool:
    """True where a larger set takes a large share of what a smaller one leaves of held-out
    recordings, and more than the pieces of the recordings differ in it.
    """
    taken, left_before = [], 0.0
    for block in attempts.suspects:
        before, after = (c.held_out_excess[block.name].pieces for c in (best, further))
        taken += [n * (was - now) for (was, n), (now, _) in zip(before, after, strict=True)]
        left_before += sum(n * (was - 1.0) for was, n in before)
    if len(taken) < 2 or left_before <= 0.0:
        return False
    error = math.sqrt(len(taken)) * float(np.std(taken, ddof=1))
    gained = float(sum(taken))
    return gained > SAME_STDS * error and gained > FURTHER_SHARE * left_before


def far_above_noise(attempts: Attempts, candidate: FittedHypothesis) -> bool:
    """True where so much more than noise is left that linear signatures say little."""
    fit_excess = candidate.fit_excess
    if any(level.curves is not None for level in attempts.noise_level.values()):
        none = dict.fromkeys((b.name for b in attempts.fit_problem.blocks), 0.0)
        bare = replace(attempts, noise_level=with_sizes(attempts.noise_level, none))
        fit_excess = {
            b.name: bare.excess(b, attempts.fit_problem, candidate.fit.residuals)
            for b in attempts.suspects
        }
    return any(
        max(excess_by_block[b.name].ratio, excess_by_block[b.name].systematic ** 2) > _STRONG_RATIO
        for b in attempts.suspects
        for excess_by_block in (fit_excess, candidate.held_out_excess)
    )


def log_misfit(candidate: FittedHypothesis) -> float:
    """Logarithm of what a hypothesis leaves of each block, on fitted and on held-out recordings:
    by it the forms of an effect are compared.
    """
    stages = (candidate.fit_excess, candidate.held_out_excess)
    return sum(math.log(max(e.ratio, 1.0)) for stage in stages for e in stage.values())
