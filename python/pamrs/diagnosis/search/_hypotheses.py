"""Competing explanations of a located mismatch, fitted side by side and weighed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

from pamrs._progress import Line
from pamrs.diagnosis.evidence import (
    FORM_SHARE_ALIKE,
    FittedHypothesis,
    Prior,
    explains,
    is_absent,
    possible_gain,
    posterior,
    probability_cap,
    same_recordings,
)
from pamrs.diagnosis.fit import (
    Fit,
    Start,
    acts_in,
    fits,
    form_in,
    same_data_in,
    start_of,
    two_at_a_time,
)
from pamrs.diagnosis.noise import LEAST_SIZE
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.screen import Score, Screen, best_of_each_kind, by_effect, screen
from pamrs.diagnosis.search._attempts import BEAM, Attempts
from pamrs.diagnosis.search._baseline import Refit, error_is_given, is_marginal
from pamrs.diagnosis.search._considered import fit_considered
from pamrs.diagnosis.search._sets import (
    LEAST_GAIN,
    NEAR_BEST,
    Say,
    Search,
    combine,
    far_above_noise,
    log_misfit,
    with_freed_values,
)
from pamrs.diagnosis.search._wrong_parameters import LEAST_GAIN_SHARE, free_suspects
from pamrs.effects import CATALOGUE, EFFECTS, Hypothesis, SameData, Term

# share of an effect's best gain from which another of its starts is fitted (decision 13)
_NEAR_START = 0.6
_MOST_FORMS = 4  # forms of an effect that are fitted
_EFFECTS_WITH_STARTS = 3  # effects of which more than one start is fitted (decision 13)
_POLISH_FROM = 0.03  # probability from which a hypothesis is fitted to its end (decision 22)


def _acting_effects(attempts: Attempts) -> list[Term]:
    """Effects of the catalogue that the rig can have, that it does not hold already and that act
    where an excess is left: everywhere, and at each place that the blocks tell apart.
    """
    lacking = [
        e for e in CATALOGUE if e not in attempts.nominal_effects and fits(attempts.nominal, e)
    ]
    return [
        term
        for e in lacking
        for term in attempts.terms_of(e)
        if any(acts_in(term, b) for b in attempts.suspects)
    ]


def refit_with_smaller_curve_error(refit: Refit, tell: Say) -> Refit | None:
    """Refit with a smaller curve error where that and an effect are more probable than the usual
    one and none; else None.
    """
    sizes = refit.error[1]
    given = error_is_given(refit.attempts.nominal, refit.attempts.settings)
    if given or max(sizes.values()) <= LEAST_SIZE:
        return None
    least = refit.with_error_sizes(dict.fromkeys(sizes, LEAST_SIZE))
    if least is None:
        return None
    state = screen_mismatch(least, tell)
    # a few steps show whether the error is smaller with an effect, which is then fitted anew
    screened = state.search.screened
    starts = [
        start
        for scores in by_effect(screened.scores()).values()
        if _is_worth_fitting(screened, scores)
        for start in _scaled_starts(best_of_each_kind(scores))
    ]
    baseline = state.search.start.fit
    short_fits = two_at_a_time(lambda start: least.attempts.fit_shortly([start], baseline), starts)
    events = fit_events(state.search, [*state.per_recording, *state.transient])
    singles = [*(c for c in short_fits if c is not None), *events, *state.wrong_values]
    return refit.with_smaller_error([refit.start, *singles])


@dataclass(frozen=True, eq=False)
class SearchState:
    """Screened mismatch, from which hypotheses are fitted.

    Attributes
    ----------
    search : Search
        Screen and weights.
    mismatch : Block
        The block that keeps most.
    wrong_values : list of FittedHypothesis
        Values that may be wrong.
    per_recording, transient : list of Term
        Effects with sizes, and with times, of their own in each recording.
    """

    search: Search
    mismatch: Block
    wrong_values: list[FittedHypothesis]
    per_recording: list[Term]
    transient: list[Term]


def screen_mismatch(refit: Refit, tell: Say) -> SearchState:
    """Screen a mismatch, and fit values that may be wrong."""
    attempts, start = refit.attempts, refit.start
    suspects, now = attempts.suspects, start.fit_excess
    mismatch = max(
        suspects, key=lambda b: attempts.baseline_excess[b.name].ratio + now[b.name].ratio
    )
    size = f"{now[mismatch.name].systematic:.2g} noise levels"
    tell(Line(f"after the refit the residual of {mismatch.name} is {size}", share=0.3))
    acting = _acting_effects(attempts)
    # events of free times would always mend a noise level that was estimated too low
    transient_everywhere = [e for e in acting if not e.at and e.info.transient and not e.info.own]
    transient = [] if is_marginal(refit) else transient_everywhere
    # gauges do not drift together
    per_recording = [
        e for e in acting if e.info.own and (e.at or len(attempts.terms_of(e.id)) == 1)
    ]
    persistent = [e for e in acting if e.info.lasting]
    part = attempts.fit_problem.losses.part
    wrong_values = part(
        "the search for wrong values",
        lambda: free_suspects(attempts, start.fit, refit.white_fit, tell),
        [],
    )
    sealed = attempts.nominal.model["valve"] is None
    # by the noise of the sensors, whatever curve error there is
    strong = far_above_noise(attempts, start)
    screened = screen(
        attempts.fit_problem,
        start.fit,
        persistent,
        attempts.no_inflation,
        sealed=sealed,
        strong=strong,
    )
    prior = Prior(
        probability_cap(
            attempts.fit_problem,
            mismatch,
            now[mismatch.name].rms,
            alone=attempts.nothing_held_out and sealed,
        ),
        max(p.n * p.dt for p in attempts.fit_problem.recordings),
        attempts.settings,
    )
    search = Search(attempts, screened, start, prior, tell)
    return SearchState(search, mismatch, wrong_values, per_recording, transient)


def best_of_each(candidates: list[FittedHypothesis]) -> list[FittedHypothesis]:
    """Candidate of each hypothesis that leaves least."""
    best: dict[Hypothesis, FittedHypothesis] = {}
    for candidate in sorted(candidates, key=log_misfit):
        best.setdefault(candidate.hypothesis, candidate)
    return [c for c in candidates if c is best[c.hypothesis]]


def fit_candidates(
    search: Search,
    wrong_values: list[FittedHypothesis],
    per_recording: list[Term],
    transient: list[Term],
) -> list[FittedHypothesis]:
    """The baseline, single effects, pairs where no single one explains the mismatch, and values
    that are wrong. ``per_recording`` and ``transient`` are effects with sizes, and with times, of
    their own in each recording.
    """
    attempts, start, alone = search.attempts, search.start, search.weight
    singles = fit_singles(search)
    part = attempts.fit_problem.losses.part
    what = "the effects that are the same data as others"
    singles = part(what, lambda: _add_same_data(search, singles), singles)
    singles += fit_events(search, per_recording)
    # of a further effect of one parameter, which has to pay for itself
    least = attempts.settings.name_price + attempts.settings.parameter_price
    if transient and not any(
        possible_gain(c, attempts.compared) < least for c in (*singles, *wrong_values)
    ):
        search.tell(
            f"looking for what happens at times of its own ({', '.join(map(str, transient))})"
        )
        singles += fit_events(search, transient)
        singles = best_of_each(singles)
    # what leaves only noise calls for no pair
    if any(explains(c, start, attempts.compared) for c in (*singles, *wrong_values)):
        lasting = sorted((c for c in singles if c.fit.events is None), key=log_misfit)

        def more() -> list[FittedHypothesis]:
            near = _nearly_as_heavy(lasting, alone)
            return [s for c in near for s in with_freed_values(search, c)]
    else:
        more = partial(combine, search, singles, wrong_values, transient)
    sets = part("the search for sets of names", more, [])
    considered = part("what was asked for", lambda: fit_considered(search), [])
    return [start, *best_of_each([*singles, *sets, *wrong_values, *considered])]


def fit_events(search: Search, effects: list[Term]) -> list[FittedHypothesis]:
    """Effects with sizes or times of their own in each recording, each by itself."""
    candidates = (search.attempts.fit_events(effect, search.start) for effect in effects)
    return [c for c in candidates if c is not None]


def _nearly_as_heavy(
    lasting: list[FittedHypothesis], weight: Callable[[FittedHypothesis], float]
) -> list[FittedHypothesis]:
    """Best of the lasting effects, and its close runners-up by weight."""
    top = max(map(weight, lasting), default=0.0)
    near = [c for c in lasting[1:] if math.exp(weight(c) - top) > _POLISH_FROM]
    near.sort(key=weight, reverse=True)
    return [*lasting[:1], *near[: BEAM - 1]]


def is_visible(candidate: FittedHypothesis, start: Start) -> bool:
    """True where recordings depend on any parameter of an effect that was fitted."""
    return any(math.isfinite(candidate.fit.std[name]) for name in start.free)


def weigh_to_the_end(
    search: Search, candidates: list[FittedHypothesis]
) -> tuple[list[FittedHypothesis], dict[Hypothesis, float]]:
    """Hypotheses with their probabilities, those that are close fitted to the end first."""
    start, attempts, settings = candidates[0], search.attempts, search.attempts.settings

    def weights(sets: list[FittedHypothesis]) -> dict[Hypothesis, float]:
        return posterior(sets, attempts.compared, search.prior)

    probabilities = weights(candidates)
    likely = [c for c in candidates[1:] if probability_of(probabilities, c) > _POLISH_FROM]
    likely.sort(key=partial(probability_of, probabilities), reverse=True)
    close = likely[: settings.most_polished]
    if len(close) > 1 or (close and not explains(close[0], start, attempts.compared)):
        search.tell("fitting to the end " + ", ".join(str(c.hypothesis) for c in close))
        polished = [attempts.polish(c) if c in close else c for c in candidates]
        # what came back inside its tolerances on the way to the end is not wrong
        candidates = [c for c in polished if c.is_wrong(settings.most_tolerances)]
        probabilities = weights(candidates)
    return candidates, probabilities


def probability_of(weighed: dict[Hypothesis, float], candidate: FittedHypothesis) -> float:
    """Probability of a hypothesis."""
    return weighed.get(candidate.hypothesis, 0.0)


def fit_singles(search: Search) -> list[FittedHypothesis]:
    """The effects that the screen finds worth it, fitted; the most telling first."""
    attempts, screened, baseline = search.attempts, search.screened, search.start.fit
    ranked = by_effect(screened.scores())
    gains = {effect: scores[0].gain for effect, scores in ranked.items()}
    most = max(gains.values(), default=0.0)
    least = max(LEAST_GAIN, LEAST_GAIN_SHARE * most)
    worth = _by_family(
        [e for e, scores in ranked.items() if _is_worth_fitting(screened, scores, least)]
    )
    first = ", ".join(f"{e} {gain:.3g}" for e, gain in list(gains.items())[:8])
    search.tell(Line(f"screened: {first or 'no effect acts here'}", share=0.6))

    if screened.strong:
        chosen, near, short = _shortlist(search, worth, ranked)
    else:
        chosen, near, short = [], {}, {}
        for rank, places in enumerate(worth[: attempts.settings.most_singles]):
            leads = rank < _EFFECTS_WITH_STARTS
            close = [e for e in places if gains[e] >= NEAR_BEST * gains[places[0]]]
            # of the leading effects another place may yet be the one that leaves least
            for effect in close if leads else places[:1]:
                chosen.append(effect)
                near[effect] = _scaled_starts(
                    _near_starts(ranked[effect]) if leads else ranked[effect][:1]
                )
    singles = []
    for effect in chosen:
        from_starts = two_at_a_time(
            lambda start: _fit_effect(
                attempts, start, baseline, short.get((start.effect, start.form))
            ),
            near[effect],
        )
        fitted = [candidate for candidate in from_starts if candidate is not None]
        if fitted:
            singles.append(
                replace(_first_of_equal_forms(fitted, FORM_SHARE_ALIKE), gain=gains[effect])
            )
    return singles


def _fit_effect(
    attempts: Attempts, start: Start, baseline: Fit, short: FittedHypothesis | None
) -> FittedHypothesis | None:
    """Fit an effect from a start with the baseline; where a few steps to the same start had left
    less, from where these had moved the baseline too.
    """
    direct = attempts.fit_effects([start], baseline, attempts.no_inflation)
    if short is None or (direct is not None and direct.misfit <= short.misfit):
        return direct
    from_short = attempts.fit_effects([start], short.fit, attempts.no_inflation)
    both = [c for c in (direct, from_short) if c is not None]
    return min(both, key=lambda c: c.misfit, default=None)


def _is_worth_fitting(screened: Screen, scores: list[Score], least: float = LEAST_GAIN) -> bool:
    """True where an effect is worth a fit: of a strong mismatch each effect is."""
    return screened.strong or scores[0].gain > least


def _scaled_starts(scores: Iterable[Score]) -> list[Start]:
    """Starts, each in the size in which it takes most."""
    return [s.start.scaled(s.size) for s in scores]


def _shortlist(
    search: Search, worth: list[list[Term]], ranked: dict[Term, list[Score]]
) -> tuple[list[Term], dict[Term, list[Start]], dict[tuple[Term, str], FittedHypothesis]]:
    """Effects, of many (each a list of its places), that leave least after a few steps; starts to
    which the best of these steps led, and the candidates there, by effect and form.

    Signatures rank places and starts and rule no effect out: they are linear in what a strong
    effect is not. Each form of each effect gets a few steps from its best start at its best place;
    effects that came to nothing in every form are left, and those that then lead get a few steps
    from all their other starts.
    """
    attempts, weight, baseline = search.attempts, search.weight, search.start.fit
    settings = attempts.settings
    short: dict[Term, list[FittedHypothesis]] = {}

    def begin(starts: dict[Term, list[Start]]) -> None:
        tasks = [(e, start) for e, of_effect in starts.items() for start in of_effect]
        short_fits = two_at_a_time(lambda one: attempts.fit_shortly([one[1]], baseline), tasks)
        for effect in starts:
            of_effect = [c for (e, _), c in zip(tasks, short_fits, strict=True) if e == effect]
            known = [*short.get(effect, []), *(c for c in of_effect if c is not None)]
            short[effect] = sorted(known, key=weight, reverse=True)

    def most(effect: Term) -> float:
        return weight(short[effect][0]) if short.get(effect) else -math.inf

    best_of = {places[0]: best_of_each_kind(ranked[places[0]]) for places in worth}
    begin({effect: _scaled_starts(best) for effect, best in best_of.items()})
    walls = settings.most_tolerances
    absent = {
        e
        for e, of_effect in short.items()
        if of_effect and all(is_absent(c, walls) for c in of_effect)
    }
    present = [places for places in worth if places[0] not in absent]
    first = sorted(present, key=lambda places: -most(places[0]))[: settings.most_singles]
    begin(
        {p[0]: _scaled_starts(s for s in ranked[p[0]] if s not in best_of[p[0]]) for p in first}
        | {
            e: _scaled_starts(ranked[e])
            for places in first[:_EFFECTS_WITH_STARTS]
            for e in places[1:]
        }
    )
    first.sort(key=lambda places: -most(places[0]))
    best: list[Term] = []
    starts: dict[Term, list[Start]] = {}
    ends: dict[tuple[Term, str], FittedHypothesis] = {}
    for rank, places in enumerate(first):
        leads = rank < _EFFECTS_WITH_STARTS
        fitted_places = [e for e in places[: None if leads else 1] if most(e) > -math.inf]
        least = min((short[e][0].misfit for e in fitted_places), default=math.inf) / NEAR_BEST
        for effect in sorted((e for e in fitted_places if short[e][0].misfit <= least), key=most)[
            ::-1
        ]:
            # of the leading effects every form may yet be the one that leaves least
            forms = {form_in(c.fit.rig, effect): c for c in reversed(short[effect])}
            best_forms = sorted(forms.values(), key=weight, reverse=True)
            count = _MOST_FORMS if leads else 1
            starts[effect] = [start_of(c.fit, effect) for c in best_forms[:count]]
            ends |= {(effect, form_in(c.fit.rig, effect)): c for c in best_forms[:count]}
            best.append(effect)
    return best, starts, ends


def _by_family(terms: list[Term]) -> list[list[Term]]:
    """The places of each effect, in the order in which they come."""
    places: dict[str, list[Term]] = {}
    for term in terms:
        places.setdefault(term.id, []).append(term)
    return list(places.values())


def _first_of_equal_forms(fitted: list[FittedHypothesis], alike: float) -> FittedHypothesis:
    """Fit of an effect that leaves least; of forms that leave as little, the catalogue's first."""
    least = min(log_misfit(c) for c in fitted)
    near = [c for c in fitted if log_misfit(c) <= least + alike]
    (effect,) = near[0].effects
    order = ["", *(form.name for form in effect.info.forms[1:])]
    return min(near, key=lambda c: (order.index(form_in(c.fit.rig, effect)), log_misfit(c)))


def _near_starts(scores: list[Score]) -> list[Score]:
    """The starts of an effect that are fitted: the best of each form (and choice in it) that comes
    near, and further ones of the best.

    A signature is a ranking of forms and no more: that of a strong effect is linear in what is not.
    """
    best = best_of_each_kind(scores)
    forms = [s for s in best if s.gain > NEAR_BEST * scores[0].gain]
    forms = sorted(forms, key=lambda s: -s.gain)[:_MOST_FORMS]
    alike = [s for s in scores if s.start.kind == scores[0].start.kind]
    near = [s for s in alike if s.gain > _NEAR_START * scores[0].gain]
    return [*near[:BEAM], *(s for s in forms if s not in near)]


def _add_same_data(search: Search, singles: list[FittedHypothesis]) -> list[FittedHypothesis]:
    """Single effects, and for each that may leave the same data as another effect (a late clock and
    a dead time) that other one.
    """
    attempts, start, left_by = search.attempts, search.start, search.share_left
    single_of = {c.effects: c for c in singles}

    def wanted(effect: Term, shaped: FittedHypothesis) -> bool:
        """True where an effect was not fitted, or only in a form that leaves clearly more."""
        fitted = single_of.get((effect,))
        return fits(attempts.nominal, effect.id) and (
            fitted is None or left_by(fitted) > left_by(shaped) + FORM_SHARE_ALIKE
        )

    all_shaped: list[FittedHypothesis] = []
    others: list[FittedHypothesis | None] = []
    for single in singles:
        (effect,) = single.effects
        same = same_data_in(attempts.nominal, effect)
        shaped = single if same is None else _in_shape(search, single, same)
        all_shaped.append(shaped)
        if same is not None and same_recordings(shaped, effect, search.prior.seconds):
            others += (
                [_as_other(attempts, start, shaped, same)]
                if wanted(Term(same.effect), shaped)
                else []
            )
        twins = ((twin, same_data_in(attempts.nominal, twin)) for twin in map(Term, CATALOGUE))
        others += [
            _as_twin(attempts, start, shaped, twin, same)
            for twin, same in twins
            if same is not None and Term(same.effect) == effect and wanted(twin, shaped)
        ]
    return best_of_each([*all_shaped, *(c for c in others if c is not None)])


def _in_shape(search: Search, single: FittedHypothesis, same: SameData) -> FittedHypothesis:
    """An effect in the shape in which it is the same data as another one, where it explains as much
    in it.
    """
    attempts = search.attempts
    start = start_of(single.fit, single.effects[0])
    fixed = {f"{start.effect}.{name}": value for name, value in same.held}
    if all(start.fixed[name] == value for name, value in fixed.items()):
        return single
    alike = attempts.fit_effects(
        [replace(start, fixed=start.fixed | fixed)], search.start.fit, attempts.no_inflation
    )
    if alike is None:
        return single
    shaped, free = map(search.share_left, (alike, single))
    return single if shaped > free + FORM_SHARE_ALIKE else replace(alike, gain=single.gain)


def _as_other(
    attempts: Attempts, start: FittedHypothesis, single: FittedHypothesis, same: SameData
) -> FittedHypothesis | None:
    """The other effect, as large as this one, where the two leave the same recordings."""
    parameters = EFFECTS[same.effect].form(same.form).parameters
    usual = {f"{same.effect}.{p.name}": p.default for p in parameters}
    usual[f"{same.effect}.{same.parameter}"] = single.fit.values[f"{single.effects[0]}.{same.size}"]
    return attempts.fit_effects(
        [Start(Term(same.effect), usual, {}, (), False, same.form)],
        start.fit,
        attempts.no_inflation,
    )


def _as_twin(
    attempts: Attempts,
    start: FittedHypothesis,
    single: FittedHypothesis,
    twin: Term,
    same: SameData,
) -> FittedHypothesis | None:
    """The effect that leaves the same recordings as this one, where this one has a size."""
    size = single.fit.values.get(f"{same.effect}.{same.parameter}", 0.0)
    if size <= 0.0:
        return None
    free = {f"{twin}.{same.size}": size, f"{twin}.{same.without}": 0.0}
    fixed = {f"{twin}.{name}": value for name, value in same.held}
    return attempts.fit_effects(
        [Start(twin, free, fixed, (), False)], start.fit, attempts.no_inflation
    )
