"""Competing explanations of a located mismatch, fitted side by side and judged on held-out
recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

from threadpoolctl import threadpool_limits

from pamrs._progress import Line
from pamrs.diagnosis.evidence import (
    FORM_SHARE_ALIKE,
    SHARED_ODDS,
    BlockGroup,
    FittedHypothesis,
    Weighing,
    are_alike,
    explains,
    is_absent,
    is_unlikely,
    misses_only_held_out,
    possible_gain,
    price_of_wrong,
    prior_loss,
    probability_cap,
    same_recordings,
    share_left,
    significant,
    weigh,
    weigh_only_noise,
)
from pamrs.diagnosis.fit import (
    Fit,
    Key,
    Problem,
    Start,
    acts_in,
    concerns,
    fits,
    form_in,
    predicted_by_others,
    predicted_with_doubt,
    residuals,
    same_data_in,
    two_at_a_time,
)
from pamrs.diagnosis.noise import (
    LEAST_SIZE,
    Excess,
    NoiseLevel,
    bins_of,
    curve_errors_of,
    error_sizes,
    excess,
    no_inflation,
    noise_levels,
    with_sizes,
)
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.screen import Score, Screen, best_of_each_kind, by_effect, screen
from pamrs.diagnosis.search._attempts import Attempts
from pamrs.diagnosis.search._baseline import refitted, thorough, with_inflation
from pamrs.diagnosis.search._closure import find_closure
from pamrs.diagnosis.search._considered import fit_considered
from pamrs.diagnosis.search._sets import (
    LEAST_GAIN,
    MOST_PAIRED,
    MOST_STARTS,
    NEAR_PLACE,
    Search,
    combine,
    far_above_noise,
    log_misfit,
    with_freed_values,
)
from pamrs.diagnosis.search._wrong_parameters import free_suspects
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    CATALOGUE,
    EFFECTS,
    UNDECIDED,
    UNLISTED,
    Hypothesis,
    SameData,
    Term,
    effect_of,
)
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.simulation import core_rig

_FROM_PROBABILITY = 0.3  # probability of unlisted from which a form is looked for (decision 4)
# share of the mismatch that it may leave, held-out too: no form of anything carries less
_MOST_SHARE_LEFT = 0.8
# held-out variance over noise that is a mismatch the fitted hardly show (decision 20)
_HELD_OUT_RATIO = 2.0
# variance over that of the noise that the fitted recordings must have for that (decision 20)
_FITTED_HINT = 1.15
# multiple of noise's largest excess that may be a low noise level (decisions 20, 22)
_MARGINAL_MULTIPLE = 1.35
# excess variance over that of the noise up to which it may (decisions 20, 22)
_MARGINAL_EXCESS = 0.3
_LEAST_GAIN_SHARE = 0.08  # share of the largest gain from which an effect is fitted (decision 13)
# share of an effect's best gain from which another of its starts is fitted (decision 13)
_NEAR_START = 0.6
_NEAR_FORM = 0.3  # share of the best gain that fits another form: strong effects are not linear
_MOST_FORMS = 4  # forms of an effect that are fitted
_EFFECTS_WITH_STARTS = 3  # effects of which more than one start is fitted (decision 13)
_REFIT_SHARE = 0.3  # share of the work on some blocks that their refit is
_SCREEN_SHARE = 0.6  # share that it is up to the fits of what the screen found
# share of the error that was taken below which what a hypothesis leaves is clearly less
_CLEARLY_LESS = 0.5
_POLISH_FROM = 0.03  # probability from which a hypothesis is fitted to its end (decision 22)


Say = Callable[[str], None]


def examine(
    fit_problem: Problem,
    held_out_problem: Problem,
    nominal: Rig,
    parts: list[list[Block]],
    say: Say,
) -> list[BlockGroup]:
    """Refit the baseline of some blocks, locate what is left, and try every effect that acts there.

    Each part is examined by itself, all at the same time; then what one names is tried in the
    others where it acts there as well, from the values that it has: one effect may be easily found
    in one place and hardly in another. The blocks of a part are one group, unless no name explains
    all of them and one does explain a block in which alone it acts: then that block is a group of
    its own.

    Parameters
    ----------
    fit_problem, held_out_problem : Problem
        Recordings to fit and held-out ones (the same when there are no others).
    nominal : Rig
        Nominal model.
    parts : list of list of Block
        Blocks that share parameters, part by part.
    say : callable
        Receives progress.

    Returns
    -------
    list of BlockGroup
        Without the blocks of a part whose judgement failed, which the losses of `fit_problem` tell.
    """
    losses, through = fit_problem.losses, (SimulationError,)

    def tell_judged(blocks: Sequence[Block]) -> None:
        part = " and ".join(b.name for b in blocks)
        say(Line(f"{part}: judged", 1.0, part=part))

    def begin(blocks: list[Block]) -> Mismatch | OnlyNoise | None:
        what = f"the judgement of {' and '.join(b.name for b in blocks)}"
        work = partial(_begin_part, fit_problem, held_out_problem, nominal, blocks, say)
        part = losses.part(what, work, through=through)
        if part is None:
            tell_judged(blocks)
        return part

    def end(part: Mismatch | OnlyNoise | None) -> list[BlockGroup]:
        if part is None:
            return []
        others = [p for p in examined if isinstance(p, Mismatch) and p is not part]
        # where only noise is left nothing parts the names that are open elsewhere
        sure = others if isinstance(part, Mismatch) else [p for p in others if p.is_settled]
        blocks = part.refit.attempts.suspects if isinstance(part, Mismatch) else part.group.blocks
        starts = [s for p in sure for s in p.leading if any(acts_in(s.effect, b) for b in blocks)]
        names = " and ".join(b.name for b in part.refit.attempts.fit_problem.blocks)
        joined = losses.part(
            f"what other blocks name, tried in {names},",
            lambda: part.with_effects_of_others(starts) if starts else part,
            part,
            through=through,
        )
        what = f"the judgement of {names}"
        groups = losses.part(what, lambda: joined.groups(say), [], through=through)
        tell_judged(part.refit.attempts.fit_problem.blocks)
        return groups

    # two processors are kept busy by recordings and parts; threads of the linear algebra would only
    # wait for each other
    with threadpool_limits(1, user_api="blas"), ThreadPoolExecutor(len(parts)) as pool:
        try:
            examined = list(pool.map(begin, parts))
            return [group for groups in pool.map(end, examined) for group in groups]
        except BaseException:
            fit_problem.stopped.set()
            raise


def _begin_part(
    fit_problem: Problem, held_out_problem: Problem, nominal: Rig, blocks: list[Block], say: Say
) -> Mismatch | OnlyNoise:
    """Examine some blocks alone: a mismatch with its hypotheses, or a group that keeps noise."""
    fit_problem, held_out_problem = (
        replace(problem, blocks=blocks) for problem in (fit_problem, held_out_problem)
    )
    names = " and ".join(b.name for b in blocks)

    def tell(text: str) -> None:
        line = text if isinstance(text, Line) else Line(text)
        say(Line(f"{names}: {text}", line.share, part=names))

    tell(Line("refitting the baseline inside its tolerances", 0.0))
    refit = _refit(fit_problem, held_out_problem, nominal)
    fit_excess = refit.start.fit_excess
    if _is_marginal(refit) or not any(
        significant(fit_excess[b.name]) for b in refit.attempts.suspects
    ):
        what = "the search for effects inside the error of the model"
        smaller = fit_problem.losses.part(
            what, lambda: _refit_with_smaller_curve_error(refit, tell), None
        )
        if smaller is not None:
            return _fit_hypotheses(smaller, tell)
    if refit.held_out_alone and not any(
        significant(fit_excess[b.name]) for b in refit.attempts.suspects
    ):
        what = "the common fit of all recordings"
        common = fit_problem.losses.part(
            what, lambda: _fit_all_recordings(refit.attempts, refit.start)
        )
        if common is not None:
            tell("one baseline leaves noise in all recordings")
            return OnlyNoise(refit, _healthy_group(refit, common), tell)
    if refit.attempts.suspects:
        return _fit_hypotheses(refit, tell)
    return OnlyNoise(refit, refit.group([refit.start], {UNDECIDED: 1.0}, None), tell)


def _find_hidden_by_values(
    refit: _Refit, tell: Say, *, effects: bool
) -> dict[FittedHypothesis, float]:
    """Hypotheses of blocks whose baseline leaves only noise, but moves parameters for it, each with
    the logarithm of what it costs: values that the file may be wrong about and, if asked for,
    effects, which the values may have followed.
    """
    attempts, baseline = refit.attempts, refit.start.fit
    settings = attempts.settings
    if not effects:
        with_freed = free_suspects(attempts, baseline, baseline, tell, share=0.0)
        return {c: price_of_wrong(c, settings) for c in with_freed}
    state = _screen_mismatch(refit, tell)
    singles = [*_fit_singles(state.search), *_fit_events(state.search, state.per_recording)]
    not_absent = [c for c in singles if not is_absent(c, settings.most_tolerances)]
    near = state.search.heaviest_first(not_absent)[: settings.most_polished]
    polished = [attempts.polish(c) if c in near else c for c in not_absent]
    return {c: price_of_wrong(c, settings) for c in state.wrong_values} | {
        c: prior_loss(c, state.search.weighing) for c in polished
    }


@dataclass(frozen=True, eq=False)
class _Refit:
    """Refit of some blocks' parameters inside their tolerances, and what each block keeps.

    Attributes
    ----------
    attempts : Attempts
        Recordings, model, noise levels, and the blocks that keep an excess.
    white_fit : Fit
        The refit with white noise.
    inflation : dict of str to float
        Inflation by the autocorrelation that it leaves.
    nominal_excess : dict of str to Excess
        What the nominal model leaves of the recordings to fit, by block.
    start : FittedHypothesis
        The refitted baseline as a hypothesis.
    held_out_alone : list of Block
        Blocks whose excess the held-out recordings alone show.
    nominal_residuals : dict
        What the nominal model leaves of the recordings to fit.
    error : (dict, dict)
        Noise levels with the curve error as stated or usual, and how large it is in each block, as
        a share of that.
    """

    attempts: Attempts
    white_fit: Fit
    inflation: dict[str, float]
    nominal_excess: dict[str, Excess]
    start: FittedHypothesis
    held_out_alone: list[Block]
    nominal_residuals: dict[Key, Residual]
    error: tuple[dict[Key, NoiseLevel], dict[str, float]]

    def with_smaller_error(self, candidates: list[FittedHypothesis]) -> _Refit | None:
        """Refit with the smaller curve error that the likeliest hypothesis leaves, or None."""
        attempts, (usual, sizes) = self.attempts, self.error
        each = [(c, *error_sizes(attempts.fit_problem, c.fit.residuals, usual)) for c in candidates]
        _, sizes_left, _ = max(each, key=lambda one: one[2] - _price(one[0], attempts))
        if all(sizes_left[name] > _CLEARLY_LESS * size for name, size in sizes.items()):
            return None
        return self.with_error_sizes(
            {name: min(size, sizes_left[name]) for name, size in sizes.items()}
        )

    def with_error_sizes(self, sizes: dict[str, float]) -> _Refit | None:
        """Refit with other sizes of the curve error; None where these leave no mismatch."""
        attempts = self.attempts
        inputs = (
            attempts.fit_problem,
            attempts.held_out_problem,
            attempts.nominal,
            self.white_fit,
            self.nominal_residuals,
        )
        refit = _refit_with_error_sizes(*inputs, (self.error[0], sizes))
        return refit if refit.attempts.suspects else None

    def group(
        self,
        candidates: list[FittedHypothesis],
        probabilities: dict[Hypothesis, float],
        mismatch: Block | None,
    ) -> BlockGroup:
        """The blocks as a group, with hypotheses and their probabilities."""
        attempts = self.attempts
        blocks, fit_excess = attempts.fit_problem.blocks, candidates[0].fit_excess
        return BlockGroup(
            blocks,
            self.nominal_excess,
            fit_excess,
            candidates,
            probabilities,
            mismatch,
            attempts.noise_level,
            attempts.suspects,
        )


def _refit(fit_problem: Problem, held_out_problem: Problem, nominal: Rig) -> _Refit:
    """Fit parameters inside their tolerances, and find what each block keeps."""
    blocks, settings = fit_problem.blocks, fit_problem.settings
    nominal_residuals = residuals(fit_problem, nominal)
    white_fit = refitted(fit_problem, nominal, no_inflation(blocks))
    curve_errors = curve_errors_of(nominal, settings.usual_error)
    noise_level = noise_levels(fit_problem, core_rig(white_fit.rig, fit_problem.core), curve_errors)
    if held_out_problem.recordings is not fit_problem.recordings:
        noise_level |= noise_levels(
            held_out_problem, core_rig(white_fit.rig, held_out_problem.core), curve_errors
        )
    usual, sizes = noise_level, dict.fromkeys((b.name for b in blocks), 1.0)
    if not _error_is_given(nominal, settings):
        sizes, _ = error_sizes(fit_problem, white_fit.residuals, usual)
    return _refit_with_error_sizes(
        fit_problem,
        held_out_problem,
        nominal,
        white_fit,
        nominal_residuals,
        (usual, sizes),
    )


def _error_is_given(nominal: Rig, settings: DiagnosisSettings) -> bool:
    """True where the size of the curve error is stated: by the rig file, or as none."""
    return bool(nominal.model_error) or not settings.usual_error


def _refit_with_error_sizes(
    fit_problem: Problem,
    held_out_problem: Problem,
    nominal: Rig,
    white_fit: Fit,
    nominal_residuals: dict[Key, Residual],
    error: tuple[dict[Key, NoiseLevel], dict[str, float]],
) -> _Refit:
    """Refit with given sizes of the curve error: noise levels with it as stated or usual, and its
    size in each block as a share of that.
    """
    blocks, settings = fit_problem.blocks, fit_problem.settings
    noise_level = with_sizes(*error)
    nothing_held_out = held_out_problem.recordings is fit_problem.recordings
    baseline, inflation = with_inflation(fit_problem, nominal, white_fit, noise_level)

    def excess_by_block(
        problem: Problem, block_residuals: dict[Key, Residual]
    ) -> dict[str, Excess]:
        return {
            b.name: excess(b, problem.recordings, block_residuals, noise_level, settings)
            for b in blocks
        }

    nominal_excess, fit_excess = (
        excess_by_block(fit_problem, nominal_residuals),
        excess_by_block(fit_problem, baseline.residuals),
    )
    held_out_residuals = (
        predicted_by_others(fit_problem, baseline, inflation)
        if nothing_held_out
        else residuals(held_out_problem, baseline.rig)
    )
    held_out_excess = excess_by_block(held_out_problem, held_out_residuals)
    # what parameters could not be told from the fitted recordings shows in the others alone, and is
    # no mismatch

    def shown_by_held_out(excesses: dict[str, Excess]) -> list[Block]:
        return [
            b
            for b in blocks
            if significant(excesses[b.name], _HELD_OUT_RATIO)
            and fit_excess[b.name].ratio > _FITTED_HINT
            and not nothing_held_out
        ]

    held_out_alone = shown_by_held_out(held_out_excess)
    if misses_only_held_out(fit_excess, held_out_excess, nothing_held_out=nothing_held_out):
        held_out_residuals = predicted_with_doubt(held_out_problem, baseline)
        held_out_excess = excess_by_block(held_out_problem, held_out_residuals)
    alone_with_doubt = shown_by_held_out(held_out_excess)
    suspects = [b for b in blocks if significant(fit_excess[b.name]) or b in alone_with_doubt]
    attempts = Attempts(
        fit_problem, held_out_problem, nominal, noise_level, held_out_excess, suspects
    )
    likelihood = attempts.likelihood_of(baseline.residuals, held_out_residuals)
    start = FittedHypothesis((), baseline, held_out_excess, fit_excess, 0.0, likelihood=likelihood)
    return _Refit(
        attempts,
        white_fit,
        inflation,
        nominal_excess,
        start,
        held_out_alone,
        nominal_residuals,
        error,
    )


def _price(candidate: FittedHypothesis, attempts: Attempts) -> float:
    """Log odds that the parameters of a hypothesis cost: their moves, and for each the half
    logarithm of the number of bins (Schwarz), which it could have fitted by chance.
    """
    problem = attempts.fit_problem
    bins = sum(p.n / bins_of(p) for p in problem.recordings) * len(problem.blocks)
    names = {n for n in candidate.fit.values if effect_of(n)} | {*candidate.wrong}
    events = candidate.fit.events.values.values() if candidate.fit.events else ()
    count = len(names) + sum(map(len, events))
    moved = sum(v * v for n, v in candidate.fit.moved.items() if n not in names)
    terms = attempts.settings.further_price * len(candidate.terms)
    return 0.5 * (moved + count * math.log(bins)) + terms


def _healthy_group(refit: _Refit, common: FittedHypothesis) -> BlockGroup:
    """Group whose baseline, fitted to all recordings, leaves only noise in them."""
    attempts = refit.attempts
    # what the nominal model leaves in the held-out ones is what the parameters are moved for
    nominal_residuals = residuals(attempts.held_out_problem, attempts.nominal)
    largest_excess = {
        b.name: max(
            refit.nominal_excess[b.name],
            attempts.excess(b, attempts.held_out_problem, nominal_residuals),
            key=lambda e: e.ratio,
        )
        for b in attempts.fit_problem.blocks
    }
    return replace(
        refit.group([common], {UNDECIDED: 1.0}, None), nominal=largest_excess, suspects=[]
    )


def _acting_effects(attempts: Attempts) -> list[Term]:
    """Effects of the catalogue that the rig can have, that it does not hold already and that act
    where an excess is left: everywhere, and at each place that the blocks tell apart.
    """
    lacking = [
        e for e in CATALOGUE if e not in attempts.nominal_effects and fits(attempts.nominal, e)
    ]
    terms = [term for e in lacking for term in attempts.terms_of(e)]
    return [term for term in terms if any(acts_in(term, b) for b in attempts.suspects)]


def _refit_with_smaller_curve_error(refit: _Refit, tell: Say) -> _Refit | None:
    """Refit with a smaller curve error where that and an effect are more probable than the usual
    one and none; else None.
    """
    sizes = refit.error[1]
    given = _error_is_given(refit.attempts.nominal, refit.attempts.settings)
    if given or max(sizes.values()) <= LEAST_SIZE:
        return None
    least = refit.with_error_sizes(dict.fromkeys(sizes, LEAST_SIZE))
    if least is None:
        return None
    state = _screen_mismatch(least, tell)
    # a few steps show whether the error is smaller beside an effect, which is then fitted anew
    screened = state.search.screened
    starts = [
        start
        for scores in by_effect(screened.scores()).values()
        if _is_worth_fitting(screened, scores)
        for start in _scaled_starts(best_of_each_kind(scores))
    ]
    baseline = state.search.start.fit
    short_fits = two_at_a_time(lambda start: least.attempts.fit_shortly([start], baseline), starts)
    events = _fit_events(state.search, [*state.per_recording, *state.transient])
    singles = [*(c for c in short_fits if c is not None), *events, *state.wrong_values]
    return refit.with_smaller_error([refit.start, *singles])


@dataclass(frozen=True, eq=False)
class _SearchState:
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


def _fit_hypotheses(refit: _Refit, tell: Say) -> Mismatch:
    """Mismatch with every hypothesis that was tried for it, at one size of the curve error."""
    state = _screen_mismatch(refit, tell)
    candidates = _fit_candidates(
        state.search, state.wrong_values, state.per_recording, state.transient
    )
    candidates, weighed = _weigh_to_the_end(state.search, candidates)
    return Mismatch(refit, state.mismatch, state.search, candidates, weighed)


def _screen_mismatch(refit: _Refit, tell: Say) -> _SearchState:
    """Screen a mismatch, and fit values that may be wrong."""
    attempts, start = refit.attempts, refit.start
    suspects, now = attempts.suspects, start.fit_excess
    mismatch = max(
        suspects, key=lambda b: attempts.baseline_excess[b.name].ratio + now[b.name].ratio
    )
    size = f"{now[mismatch.name].systematic:.2g} noise levels"
    tell(Line(f"after the refit the residual of {mismatch.name} is {size}", _REFIT_SHARE))
    acting = _acting_effects(attempts)
    # events of free times would always mend a noise level that was estimated too low
    transient_everywhere = [e for e in acting if not e.at and e.info.transient and not e.info.own]
    transient = [] if _is_marginal(refit) else transient_everywhere
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
    weighing = Weighing(
        probability_cap(
            attempts.fit_problem,
            mismatch,
            now[mismatch.name].rms,
            alone=attempts.nothing_held_out and sealed,
        ),
        max(p.n * p.dt for p in attempts.fit_problem.recordings),
        attempts.settings,
    )
    search = Search(attempts, screened, start, weighing, tell)
    return _SearchState(search, mismatch, wrong_values, per_recording, transient)


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Excess that some blocks keep after the refit, with the hypotheses tried for it.

    Attributes
    ----------
    refit : _Refit
        The refit of their parameters.
    block : Block
        The one that keeps most.
    search : Search
        What hypotheses were found with, and are weighed by.
    candidates : list of FittedHypothesis
        The baseline first, then every hypothesis.
    weighed : dict of Hypothesis to float
        Their probabilities.
    """

    refit: _Refit
    block: Block
    search: Search
    candidates: list[FittedHypothesis]
    weighed: dict[Hypothesis, float]

    @property
    def is_settled(self) -> bool:
        """True where one hypothesis is so probable that no other is left open."""
        return max(self.weighed.values()) > self.refit.attempts.settings.settled

    @property
    def leading(self) -> list[Start]:
        """The lasting effects of the hypothesis that leads, as they were fitted; none where nothing
        is as probable as what has no name.
        """
        attempts, named = self.refit.attempts, [c for c in self.candidates if c.terms]
        best = max(named, key=lambda c: _probability(self.weighed, c), default=None)
        if best is None or _probability(self.weighed, best) <= self.weighed.get(UNLISTED, 0.0):
            return []
        lasting = best.fit.events is None
        return attempts.starts_of(best) if lasting else []

    def with_effects_of_others(self, starts: list[Start]) -> Mismatch:
        """Try the effects that other blocks name here too, alone and with what leads here."""
        attempts, start = self.refit.attempts, self.candidates[0]
        self.search.tell(
            f"trying {', '.join(str(s.effect) for s in starts)}, which other blocks have"
        )
        named = [c for c in self.candidates if c.effects and c.fit.events is None]
        best = max(named, key=lambda c: _probability(self.weighed, c), default=None)
        fitted: list[FittedHypothesis] = []
        for one in starts:
            alone = attempts.fit_effects([one], start.fit, attempts.no_inflation)
            if alone is None or not _is_visible(alone, one):
                continue  # a clock that is late by the same for all that a block sees
            fitted.append(alone)
            if best is not None and not one.effect.excluded_by(best.effects):
                both = attempts.fit_together([*attempts.starts_of(best), one], best.fit, best.wrong)
                fitted += [] if both is None else [both]
        candidates = _best_of_each([*self.candidates, *fitted])
        candidates, weighed = _weigh_to_the_end(self.search, candidates)
        return replace(self, candidates=candidates, weighed=weighed)

    def groups(self, say: Say) -> list[BlockGroup]:
        """The blocks as one group, or in parts where names explain parts of them."""
        refit, weighed = self.refit, self.weighed
        now = refit.start.fit_excess[self.block.name]
        part = refit.attempts.fit_problem.losses.part
        screened = self.search.screened
        # of the chi-square that is left noise has its part
        share = 1.0 - 1.0 / max(now.ratio, 1.0 + _MARGINAL_EXCESS)
        missing = screened.tangent.power_left * share
        group = replace(
            refit.group(self.candidates, weighed, self.block),
            predicted_gain={
                e: scores[0].gain / missing for e, scores in by_effect(screened.scores()).items()
            },
        )
        if _leading(weighed) == UNLISTED:
            what = "the division of the blocks by their names"
            parts = part(
                what, lambda: _split_by_names(group, refit.attempts, self.search.weighing), []
            )
            if parts:
                return parts
        what = "the search for a form of what is missing"
        return [part(what, lambda: _add_form(group, refit, say, self.search.tell), group)]


@dataclass(frozen=True, eq=False)
class OnlyNoise:
    """Blocks of which the refit leaves only noise.

    Attributes
    ----------
    refit : _Refit
        The refit of their parameters.
    group : BlockGroup
        The baseline.
    tell : callable
        Receives progress.
    shared : list of FittedHypothesis
        Effects that other blocks have, with the values that they have there.
    """

    refit: _Refit
    group: BlockGroup
    tell: Say
    shared: list[FittedHypothesis] = field(default_factory=list)

    def with_effects_of_others(self, starts: list[Start]) -> OnlyNoise:
        """Group after the effects that other blocks name were tried here: one is there where
        recordings and values are as probable with it, at the values that it has in the other
        blocks.
        """
        attempts = replace(self.refit.attempts, suspects=self.group.blocks)
        baseline = self.group.candidates[0]
        if baseline is not self.refit.start:
            return self  # one fit of all recordings: no hypothesis is compared with it
        consistent = []
        for start in starts:
            # fixed first: what the baseline hid it by has to let go of it
            known = replace(start, free={}, fixed=start.fixed | start.free)
            first = attempts.fit_effects([known], baseline.fit, attempts.no_inflation)
            both = first and attempts.fit_effects([start], first.fit, attempts.no_inflation)
            if both and _is_visible(both, start):
                joint = both.fit
                alike = (are_alike(joint.values[n], v, joint.std[n]) for n, v in start.free.items())
                consistent += [both] if all(alike) else []
        return replace(self, shared=_best_of_each(consistent))

    def groups(self, _: Say) -> list[BlockGroup]:
        """The blocks as one group, with values that the file may be wrong about, and with effects
        of its own where its values are an unlikely draw of their tolerances, whatever others have.
        """
        baseline, refit = self.group.candidates[0], self.refit
        if baseline is not refit.start:
            return [self.group]
        with_effects = all(is_unlikely(c.fit) for c in (baseline, *self.shared))
        whole = replace(refit, attempts=replace(refit.attempts, suspects=self.group.blocks))
        work = partial(_find_hidden_by_values, whole, self.tell, effects=with_effects)
        what = "the search for what moved values explain"
        prices = refit.attempts.fit_problem.losses.part(what, work, {})
        # what is there once is paid for once: the odds of both places are given for both
        prices |= dict.fromkeys(self.shared, math.log(SHARED_ODDS))
        return [weigh_only_noise(self.group, prices)]


def _leading(weighed: Mapping[Hypothesis, float]) -> Hypothesis:
    """The most probable hypothesis; of two that are as probable, the one without a name."""
    return max(weighed, key=lambda h: (weighed[h], not h.terms))


def _is_marginal(refit: _Refit) -> bool:
    """True where so little is left that the noise level may as well have been estimated too low."""
    excesses = (refit.start.fit_excess, refit.attempts.baseline_excess)
    return all(
        e.ratio - 1.0 < max(_MARGINAL_MULTIPLE * (e.limit - 1.0), _MARGINAL_EXCESS)
        for b in refit.attempts.suspects
        for e in (excess_by_block[b.name] for excess_by_block in excesses)
    )


def _best_of_each(candidates: list[FittedHypothesis]) -> list[FittedHypothesis]:
    """Candidate of each hypothesis that leaves least."""
    best: dict[Hypothesis, FittedHypothesis] = {}
    for candidate in sorted(candidates, key=log_misfit):
        best.setdefault(candidate.hypothesis, candidate)
    return [c for c in candidates if c is best[c.hypothesis]]


def _fit_candidates(
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
    singles = _fit_singles(search)
    part = attempts.fit_problem.losses.part
    what = "the effects that are the same data as others"
    singles = part(what, lambda: _add_same_data(search, singles), singles)
    singles += _fit_events(search, per_recording)
    # of a further effect of one parameter, which has to pay for itself
    least = attempts.settings.further_price + attempts.settings.parameter_price
    if transient and not any(
        possible_gain(c, attempts.compared) < least for c in (*singles, *wrong_values)
    ):
        search.tell(
            f"looking for what happens at times of its own ({', '.join(map(str, transient))})"
        )
        singles += _fit_events(search, transient)
        singles = _best_of_each(singles)
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
    return [start, *_best_of_each([*singles, *sets, *wrong_values, *considered])]


def _fit_events(search: Search, effects: list[Term]) -> list[FittedHypothesis]:
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
    return [*lasting[:1], *near[: max(MOST_PAIRED - 1, 0)]]


def _is_visible(candidate: FittedHypothesis, start: Start) -> bool:
    """True where recordings depend on any parameter of an effect that was fitted."""
    return any(math.isfinite(candidate.fit.std[name]) for name in start.free)


def _weigh_to_the_end(
    search: Search, candidates: list[FittedHypothesis]
) -> tuple[list[FittedHypothesis], dict[Hypothesis, float]]:
    """Hypotheses with their probabilities, those that are close fitted to the end first."""
    start, attempts, settings = candidates[0], search.attempts, search.attempts.settings

    def weights(sets: list[FittedHypothesis]) -> dict[Hypothesis, float]:
        return weigh(sets, attempts.compared, search.weighing)

    probabilities = weights(candidates)
    likely = [c for c in candidates[1:] if _probability(probabilities, c) > _POLISH_FROM]
    close = sorted(likely, key=lambda c: -_probability(probabilities, c))[: settings.most_polished]
    if len(close) > 1 or (close and not explains(close[0], start, attempts.compared)):
        search.tell("fitting to the end " + ", ".join(str(c.hypothesis) for c in close))
        polished = [attempts.polish(c) if c in close else c for c in candidates]
        # what came back inside its tolerances on the way to the end is not wrong
        candidates = [c for c in polished if c.is_wrong(settings.most_tolerances)]
        probabilities = weights(candidates)
    return candidates, probabilities


def _add_form(group: BlockGroup, refit: _Refit, say: Say, tell: Say) -> BlockGroup:
    """Add a form of what is missing to a group, where no name is likely and a form carries over."""
    attempts, start = refit.attempts, refit.start
    # what is missing in a chamber is missing in the temperature of its gas too
    suspects = [b for b in attempts.suspects if "chamber" not in b.beside] or attempts.suspects
    if group.probabilities[UNLISTED] < _FROM_PROBABILITY or len({b.kind for b in suspects}) < len(
        suspects
    ):
        return group  # of two chambers one form would have to serve both
    if any(b.closure is None for b in suspects):
        tell(
            "no form of what is missing is looked for, since that of a load, of a force, of a "
            "temperature or of a valve in front of a line is not in the simulator"
        )
        return group
    group = replace(group, sought=True)
    closure = find_closure(
        attempts.fit_problem,
        attempts.nominal,
        start.fit,
        refit.inflation,
        suspects,
        say,
        attempts.noise_level,
    )
    if closure is None:
        return group
    try:
        assessed = attempts.assess(closure.effects, closure)
    except SimulationError:
        return group
    # what does not carry over to recordings that were held out is no form of anything
    if share_left(assessed, start, suspects) > _MOST_SHARE_LEFT:
        return group
    return replace(group, closure=assessed)


def _split_by_names(group: BlockGroup, attempts: Attempts, weighing: Weighing) -> list[BlockGroup]:
    """A group in parts, where a name explains a block in which alone it acts; else nothing.

    A leak of the tank is seen in the tank's pressure, whatever the chamber behind the valve keeps
    without a name, or with one of its own. All parts have one fit, with everything that they name.
    """
    start = group.candidates[0]
    acting = {
        c: [b for b in group.suspects if any(concerns(term, b) for term in c.terms)]
        for c in group.candidates
        if c.terms
    }

    def weighed(blocks: list[Block]) -> dict[Hypothesis, float]:
        candidates = [c for c in acting if any(b in blocks for b in acting[c])]
        return weigh([start, *candidates], blocks, weighing)

    alone = {
        b.name: weighed([b])
        for b in group.suspects
        if any(acted_on == [b] for acted_on in acting.values())
    }
    named = [b for b in group.suspects if b.name in alone and _leading(alone[b.name]).terms]
    rest = [b for b in group.suspects if b not in named]
    if not named:
        return []
    best = [
        max(
            (c for c in acting if c.hypothesis in alone[b.name]),
            key=partial(_probability, alone[b.name]),
        )
        for b in named
    ]
    common = best[0].fit if len(best) == 1 else attempts.fit_united(best)
    if common is None:
        return []
    start = replace(start, fit=common)

    def part(
        blocks: list[Block], suspects: list[Block], probabilities: dict[Hypothesis, float]
    ) -> BlockGroup:
        return replace(
            group,
            blocks=blocks,
            candidates=[
                start,
                *(
                    replace(c, fit=common) if c in best else c
                    for c in acting
                    if c.hypothesis in probabilities
                ),
            ],
            probabilities=probabilities,
            mismatch=max(
                suspects,
                key=lambda b: start.held_out_excess[b.name].ratio + start.fit_excess[b.name].ratio,
            ),
            suspects=suspects,
            predicted_gain={
                e: p
                for e, p in group.predicted_gain.items()
                if any(acts_in(e, b) for b in suspects)
            },
        )

    parts = [part([b], [b], alone[b.name]) for b in named]
    others = [b for b in group.blocks if b not in named]
    if rest:
        return [*parts, part(others, rest, weighed(rest))]
    # blocks that kept nothing stay with the first part
    return [replace(parts[0], blocks=[*named[:1], *others]), *parts[1:]]


def _probability(weighed: dict[Hypothesis, float], candidate: FittedHypothesis) -> float:
    """Probability of a hypothesis."""
    return weighed.get(candidate.hypothesis, 0.0)


def _fit_all_recordings(attempts: Attempts, start: FittedHypothesis) -> FittedHypothesis | None:
    """One baseline inside its tolerances that leaves only noise in fitted and held-out recordings,
    taken together, if there is one.
    """
    fit_problem, held_out_problem = attempts.fit_problem, attempts.held_out_problem
    both = replace(fit_problem, recordings=[*fit_problem.recordings, *held_out_problem.recordings])
    try:
        common = thorough(both, attempts.nominal, attempts.no_inflation, start.fit)
    except SimulationError:
        return None
    fitted, held_out = (
        {b.name: attempts.excess(b, part, common.residuals) for b in fit_problem.blocks}
        for part in (fit_problem, held_out_problem)
    )
    if any(significant(e[b.name]) for b in fit_problem.blocks for e in (fitted, held_out)):
        return None
    return FittedHypothesis((), common, held_out, fitted, 0.0)


def _fit_singles(search: Search) -> list[FittedHypothesis]:
    """The effects that the screen finds worth it, fitted; the most telling first."""
    attempts, screened, baseline = search.attempts, search.screened, search.start.fit
    ranked = by_effect(screened.scores())
    gains = {effect: scores[0].gain for effect, scores in ranked.items()}
    most = max(gains.values(), default=0.0)
    least = max(LEAST_GAIN, _LEAST_GAIN_SHARE * most)
    worth = _by_family(
        [e for e, scores in ranked.items() if _is_worth_fitting(screened, scores, least)]
    )
    first = ", ".join(f"{e} {gain:.3g}" for e, gain in list(gains.items())[:8])
    search.tell(Line(f"screened: {first or 'no effect acts here'}", _SCREEN_SHARE))

    if screened.strong:
        chosen, near, short = _shortlist(search, worth, ranked)
    else:
        chosen, near, short = [], {}, {}
        for rank, places in enumerate(worth[: attempts.settings.most_singles]):
            leads = rank < _EFFECTS_WITH_STARTS
            close = [e for e in places if gains[e] >= NEAR_PLACE * gains[places[0]]]
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
        least = min((short[e][0].misfit for e in fitted_places), default=math.inf) / NEAR_PLACE
        for effect in sorted((e for e in fitted_places if short[e][0].misfit <= least), key=most)[
            ::-1
        ]:
            # of the leading effects every form may yet be the one that leaves least
            forms = {form_in(c.fit.rig, effect): c for c in reversed(short[effect])}
            best_forms = sorted(forms.values(), key=weight, reverse=True)
            count = _MOST_FORMS if leads else 1
            starts[effect] = [attempts.start_of(c.fit, effect) for c in best_forms[:count]]
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
    forms = [s for s in best if s.gain > _NEAR_FORM * scores[0].gain]
    forms = sorted(forms, key=lambda s: -s.gain)[:_MOST_FORMS]
    alike = [s for s in scores if s.start.kind == scores[0].start.kind]
    near = [s for s in alike if s.gain > _NEAR_START * scores[0].gain]
    return [*near[:MOST_STARTS], *(s for s in forms if s not in near)]


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
        if same is not None and same_recordings(shaped, effect, search.weighing.seconds):
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
    return _best_of_each([*all_shaped, *(c for c in others if c is not None)])


def _in_shape(search: Search, single: FittedHypothesis, same: SameData) -> FittedHypothesis:
    """An effect in the shape in which it is the same data as another one, where it explains as much
    in it.
    """
    attempts = search.attempts
    start = attempts.start_of(single.fit, single.effects[0])
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
