"""Sets of names that the caller asks for: fitted from every start, and judged with the others."""

from __future__ import annotations

from pamrs.diagnosis.evidence import Attempts, Candidate
from pamrs.diagnosis.fit import Start, depends, starts_of
from pamrs.diagnosis.screen import STRONG_SIZES, Screen, by_effect, stand_of
from pamrs.diagnosis.search._sets import Say, Weight
from pamrs.effects import id_of, info_of, is_effect

__all__ = ["considered"]


def considered(
    trial: Attempts, screened: Screen, start: Candidate, weight: Weight, tell: Say
) -> list[Candidate]:
    """What of the sets of names that the caller asks for acts in the blocks of a mismatch, each set
    fitted together.

    Parameters
    ----------
    trial : Attempts
        Recordings, model, noise levels; the names are those of its problem.
    screened : Screen
        Signatures of the effects.
    start : Candidate
        The refitted baseline.
    weight : callable
        What a hypothesis weighs.
    tell : callable
        Receives progress.
    """
    found = []
    for names in trial.inner.considered:
        acting = [n for n in names if any(depends(b, n) for b in trial.suspects)]
        # what may happen at times of its own is looked for beside what lasts
        effects = sorted(
            (n for n in acting if is_effect(n)),
            key=lambda n: (info_of(n).transient, not info_of(n).lasting),
        )
        wrong = tuple(n for n in acting if n in start.fit.moved)
        if not effects and not wrong:
            continue
        tell(f"trying {' + '.join([*effects, *wrong])}, which was asked for")
        own = _together(trial, screened, start, effects, wrong, weight)
        found += [] if own is None else [own]
    return found


def _together(
    trial: Attempts,
    screened: Screen,
    start: Candidate,
    effects: list[str],
    wrong: tuple[str, ...],
    weight: Weight,
) -> Candidate | None:
    """Effects and wrong values fitted together, the effects one after the other from the best of
    all their starts.
    """
    best = start if not wrong else trial.freed(wrong, start.fit)
    for effect in effects:
        if best is None:
            return None
        best = _added(trial, screened, best, effect, weight)
    return best


def _added(
    trial: Attempts, screened: Screen, beside: Candidate, effect: str, weight: Weight
) -> Candidate | None:
    """An effect beside a set, from the start of each of its forms that leaves least after a few
    steps.
    """
    info = info_of(effect)
    if beside.fit.events is not None:
        return None  # beside events nothing else is fitted
    if not info.lasting:
        return trial.transient(effect if info.own else id_of(effect), beside)
    begun = [trial.start_of(beside.fit, e) for e in beside.effects]
    short: dict[str, list[Candidate]] = {}
    for one in _starts(trial, screened, beside, effect):
        tried = trial.fitted_shortly([*begun, one], beside.fit, beside.wrong)
        if tried is not None:
            short.setdefault(one.form, []).append(tried)
    near = {form: max(tried, key=weight) for form, tried in short.items()}
    ended = [whole for best in near.values() if (whole := _ended(trial, best)) is not None]
    if info.transient:
        happened = trial.transient(id_of(effect), beside)
        ended += [] if happened is None else [happened]
    return max(ended, key=weight, default=None)


def _starts(trial: Attempts, screened: Screen, beside: Candidate, effect: str) -> list[Start]:
    """Where an effect may begin beside a set: those of the screen, which knows what resounds and
    where contacts are met, and those of the catalogue in several sizes.
    """
    stand = stand_of(beside.fit, trial.inner, trial.white)
    scores = by_effect(screened.scores(stand, without=beside.effects)).get(effect, [])
    usual = starts_of(effect, sealed=trial.nominal.model["valve"] is None)
    return [
        *(score.start.scaled(score.size) for score in scores),
        *(
            one.scaled(s)
            for one in usual
            for s in ((1.0, *STRONG_SIZES) if one.scalable else (1.0,))
        ),
    ]


def _ended(trial: Attempts, tried: Candidate) -> Candidate | None:
    """A set fitted to its end."""
    starts = [trial.start_of(tried.fit, e) for e in tried.effects]
    return trial.together(starts, tried.fit, tried.wrong)
