"""Sets of names that the caller asks for: fitted from every start, and judged with the others."""

from __future__ import annotations

from pamrs.diagnosis.evidence import FittedHypothesis
from pamrs.diagnosis.fit import Start, concerns, starts_of
from pamrs.diagnosis.screen import STRONG_SIZES
from pamrs.diagnosis.search._sets import Search
from pamrs.effects import Hypothesis, Term


def fit_considered(search: Search) -> list[FittedHypothesis]:
    """Fit what of each hypothesis that the caller asks for acts in the blocks of a mismatch."""
    attempts, fitted = search.attempts, list[FittedHypothesis]()
    for hypothesis in attempts.fit_problem.considered:
        acting = [t for t in hypothesis.terms if any(concerns(t, b) for b in attempts.suspects)]
        # what may happen at times of its own is looked for after what lasts
        effects = sorted(
            (t for t in acting if t.is_effect),
            key=lambda t: (t.info.transient, not t.info.lasting),
        )
        wrong = tuple(t.id for t in acting if t.id in search.start.fit.moved)
        if not effects and not wrong:
            continue
        search.tell(f"trying {Hypothesis((*effects, *map(Term, wrong)))}, which was asked for")
        best = search.start if not wrong else attempts.fit_freed(wrong, search.start.fit)
        for effect in effects:
            best = None if best is None else _add_effect(search, best, effect)
        fitted += [] if best is None else [best]
    return fitted


def _add_effect(search: Search, base: FittedHypothesis, effect: Term) -> FittedHypothesis | None:
    """Add an effect to a set, from the start of each form that leaves least in a few steps."""
    info, attempts = effect.info, search.attempts
    if base.fit.events is not None:
        return None  # with events nothing else is fitted
    if not info.lasting:
        return attempts.fit_events(effect if info.own else Term(effect.id), base)
    starts = attempts.starts_of(base)
    short: dict[str, list[FittedHypothesis]] = {}
    for one in _possible_starts(search, base, effect):
        candidate = attempts.fit_shortly([*starts, one], base.fit, base.wrong)
        if candidate is not None:
            short.setdefault(one.form, []).append(candidate)
    near = (max(candidate, key=search.weight) for candidate in short.values())
    ended = [attempts.fit_together(attempts.starts_of(best), best.fit, best.wrong) for best in near]
    if info.transient:
        ended.append(attempts.fit_events(Term(effect.id), base))
    return max((c for c in ended if c is not None), key=search.weight, default=None)


def _possible_starts(search: Search, base: FittedHypothesis, effect: Term) -> list[Start]:
    """Starts of an effect next to a set: those of the screen, which knows resonances and places of
    contact, and those of the catalogue in several sizes.
    """
    _, ranked = search.rank(base)
    usual = starts_of(effect, sealed=search.attempts.nominal.model["valve"] is None)
    return [
        *(score.start.scaled(score.size) for score in ranked.get(effect, [])),
        *(one.scaled(s) for one in usual for s in ((1.0, *STRONG_SIZES) if one.sizes else (1.0,))),
    ]
