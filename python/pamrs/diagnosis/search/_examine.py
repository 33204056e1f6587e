"""Examination of some blocks: their refit, the search for what they keep, and the groups of blocks
that come of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

from threadpoolctl import threadpool_limits

from pamrs._progress import Line
from pamrs.diagnosis.evidence import (
    SHARED_ODDS,
    BlockGroup,
    FittedHypothesis,
    Prior,
    are_alike,
    is_absent,
    is_unlikely,
    loss_of_file,
    posterior,
    posterior_where_noise,
    share_left,
    significant,
)
from pamrs.diagnosis.fit import Problem, Start, acts_in, concerns
from pamrs.diagnosis.prepare import OFTEN_WINDOW, Block
from pamrs.diagnosis.screen import by_effect
from pamrs.diagnosis.search._attempts import Attempts
from pamrs.diagnosis.search._baseline import (
    MARGINAL_EXCESS,
    Refit,
    fit_all_recordings,
    healthy_group,
    is_marginal,
    refit_blocks,
)
from pamrs.diagnosis.search._hypotheses import (
    best_of_each,
    fit_candidates,
    fit_events,
    fit_singles,
    is_visible,
    probability_of,
    refit_with_smaller_curve_error,
    screen_mismatch,
    weigh_to_the_end,
)
from pamrs.diagnosis.search._sets import Say, Search
from pamrs.diagnosis.search._wrong_parameters import FURTHER_SHARE, free_suspects
from pamrs.effects import UNDECIDED, UNLISTED, Hypothesis
from pamrs.errors import SimulationError
from pamrs.findings import MOST_MISSED
from pamrs.rig import Rig

_FROM_PROBABILITY = 0.3  # probability of unlisted from which a form is looked for (decision 4)


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
        least = 0.0 if isinstance(part, Mismatch) else fit_problem.settings.settled
        sure = [p for p in others if max(p.weighed.values()) > least]
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
    """Examine some blocks alone: a mismatch with its hypotheses, or only noise."""
    fit_problem, held_out_problem = (
        replace(problem, blocks=blocks) for problem in (fit_problem, held_out_problem)
    )
    names = " and ".join(b.name for b in blocks)

    def tell(text: str) -> None:
        line = text if isinstance(text, Line) else Line(text)
        say(Line(f"{names}: {text}", line.share, part=names))

    tell(Line("refitting the baseline inside its tolerances", 0.0))
    refit = refit_blocks(fit_problem, held_out_problem, nominal)
    fit_excess = refit.start.fit_excess
    if is_marginal(refit) or not any(
        significant(fit_excess[b.name]) for b in refit.attempts.suspects
    ):
        what = "the search for effects inside the error of the model"
        smaller = fit_problem.losses.part(
            what, lambda: refit_with_smaller_curve_error(refit, tell), None
        )
        if smaller is not None:
            return _fit_hypotheses(smaller, tell)
    if refit.held_out_alone and not any(
        significant(fit_excess[b.name]) for b in refit.attempts.suspects
    ):
        what = "the common fit of all recordings"
        common = fit_problem.losses.part(
            what, lambda: fit_all_recordings(refit.attempts, refit.start)
        )
        if common is not None:
            tell("one baseline leaves noise in all recordings")
            return OnlyNoise(refit, healthy_group(refit, common), tell)
    if refit.attempts.suspects:
        found = _fit_hypotheses(refit, tell)
        return fit_problem.losses.part(
            "the search with more starts of the motion",
            partial(_begun_often, found, fit_problem, held_out_problem, nominal, tell),
            found,
        )
    return OnlyNoise(refit, refit.group([refit.start], {UNDECIDED: 1.0}, None), tell)


def _find_hidden_by_values(
    refit: Refit, tell: Say, *, effects: bool
) -> dict[FittedHypothesis, float]:
    """Hypotheses of blocks whose baseline leaves only noise, but moves parameters for it, each with
    the log odds that it loses before any data: values that the file may be wrong about and, if
    asked for, effects, which the values may have followed.
    """
    attempts, baseline = refit.attempts, refit.start.fit
    settings = attempts.settings
    if not effects:
        with_freed = free_suspects(attempts, baseline, baseline, tell, share=0.0)
        return {c: loss_of_file(c, settings) for c in with_freed}
    state = screen_mismatch(refit, tell)
    singles = [*fit_singles(state.search), *fit_events(state.search, state.per_recording)]
    not_absent = [c for c in singles if not is_absent(c, settings.most_tolerances)]
    near = state.search.heaviest_first(not_absent)[: settings.most_polished]
    polished = [attempts.polish(c) if c in near else c for c in not_absent]
    return {c: loss_of_file(c, settings) for c in state.wrong_values} | {
        c: state.search.prior.loss(c) for c in polished
    }


def _fit_hypotheses(refit: Refit, tell: Say) -> Mismatch:
    """Mismatch with every hypothesis that was tried for it, at one size of the curve error."""
    state = screen_mismatch(refit, tell)
    candidates = fit_candidates(
        state.search, state.wrong_values, state.per_recording, state.transient
    )
    candidates, weighed = weigh_to_the_end(state.search, candidates)
    return Mismatch(refit, state.mismatch, state.search, candidates, weighed)


def _begun_often(
    found: Mismatch, fit_problem: Problem, held_out_problem: Problem, nominal: Rig, tell: Say
) -> Mismatch:
    """Mismatch of a motion on windows that begin more often, where that gets a name and the usual
    windows give it none.

    What a model cannot follow, as an arm that sticks, grows inside a window until its sum of
    squares has minima everywhere; the shorter the window, the smoother (Ribeiro et al., On the
    smoothness of nonlinear system identification, Automatica 121, 2020).
    """
    begins = found.block.mechanical and any(b.window is not None for b in fit_problem.blocks)
    if not begins or _leading(found.weighed) != UNLISTED:
        return found
    tell(f"nothing named: trying windows of {OFTEN_WINDOW:g} s")
    blocks = [
        b if b.window is None else replace(b, window=OFTEN_WINDOW) for b in fit_problem.blocks
    ]
    often = refit_blocks(
        replace(fit_problem, blocks=blocks), replace(held_out_problem, blocks=blocks), nominal
    )
    if not often.attempts.suspects:
        return found
    again = _fit_hypotheses(often, tell)
    return again if _leading(again.weighed).terms else found


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Excess that some blocks keep after the refit, with the hypotheses tried for it.

    Attributes
    ----------
    refit : Refit
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

    refit: Refit
    block: Block
    search: Search
    candidates: list[FittedHypothesis]
    weighed: dict[Hypothesis, float]

    @property
    def leading(self) -> list[Start]:
        """The lasting effects of the hypothesis that leads, as they were fitted; none where nothing
        is as probable as what has no name.
        """
        attempts, named = self.refit.attempts, [c for c in self.candidates if c.terms]
        best = max(named, key=lambda c: probability_of(self.weighed, c), default=None)
        if best is None or probability_of(self.weighed, best) <= self.weighed.get(UNLISTED, 0.0):
            return []
        return attempts.starts_of(best) if best.fit.events is None else []

    def with_effects_of_others(self, starts: list[Start]) -> Mismatch:
        """Try the effects that other blocks name here too, alone and with what leads here."""
        attempts, start = self.refit.attempts, self.candidates[0]
        self.search.tell(
            f"trying {', '.join(str(s.effect) for s in starts)}, which other blocks have"
        )
        named = [c for c in self.candidates if c.effects and c.fit.events is None]
        best = max(named, key=lambda c: probability_of(self.weighed, c), default=None)
        fitted: list[FittedHypothesis] = []
        for one in starts:
            alone = attempts.fit_effects([one], start.fit, attempts.no_inflation)
            if alone is None or not is_visible(alone, one):
                continue  # a clock that is late by the same for all that a block sees
            fitted.append(alone)
            if best is not None and not one.effect.excluded_by(best.effects):
                both = attempts.fit_together([*attempts.starts_of(best), one], best.fit, best.wrong)
                fitted += [] if both is None else [both]
        candidates = best_of_each([*self.candidates, *fitted])
        candidates, weighed = weigh_to_the_end(self.search, candidates)
        return replace(self, candidates=candidates, weighed=weighed)

    def groups(self, say: Say) -> list[BlockGroup]:
        """The blocks as one group, or in parts where names explain parts of them."""
        refit, weighed = self.refit, self.weighed
        now = refit.start.fit_excess[self.block.name]
        part = refit.attempts.fit_problem.losses.part
        screened = self.search.screened
        # of the chi-square that is left noise has its part
        missing = screened.tangent.power_left * (1.0 - 1.0 / max(now.ratio, 1.0 + MARGINAL_EXCESS))
        group = replace(
            refit.group(self.candidates, weighed, self.block),
            predicted_gain={
                e: scores[0].gain / missing for e, scores in by_effect(screened.scores()).items()
            },
        )
        if _leading(weighed) == UNLISTED:
            what = "the division of the blocks by their names"
            parts = part(
                what, lambda: _split_by_names(group, refit.attempts, self.search.prior), []
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
    refit : Refit
        The refit of their parameters.
    group : BlockGroup
        The baseline.
    tell : callable
        Receives progress.
    shared : list of FittedHypothesis
        Effects that other blocks have, with the values that they have there.
    """

    refit: Refit
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
            if both and is_visible(both, start):
                joint = both.fit
                alike = (are_alike(joint.values[n], v, joint.std[n]) for n, v in start.free.items())
                consistent += [both] if all(alike) else []
        return replace(self, shared=best_of_each(consistent))

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
        losses = refit.attempts.fit_problem.losses.part(what, work, {})
        # what is there once is paid for once: the odds of both places are given for both
        losses |= dict.fromkeys(self.shared, math.log(SHARED_ODDS))
        return [posterior_where_noise(self.group, losses)]


def _leading(weighed: Mapping[Hypothesis, float]) -> Hypothesis:
    """The most probable hypothesis; of two that are as probable, the one without a name."""
    return max(weighed, key=lambda h: (weighed[h], not h.terms))


def _add_form(group: BlockGroup, refit: Refit, say: Say, tell: Say) -> BlockGroup:
    """Add a form of what is missing to a group, where that carries over: instead of a name
    where none is likely, else next to the names that lead, whose equations are not quite the rig's.
    """
    attempts, base = refit.attempts, refit.start
    # what is missing in a chamber is missing in the temperature of its gas too
    suspects = [b for b in attempts.suspects if b.kind != "temperature"] or attempts.suspects
    if len({b.kind for b in suspects}) < len(suspects):
        return group  # of two chambers one form would have to serve both
    leading, inflation = _leading(group.probabilities), refit.inflation
    corrects = bool(leading.terms) and group.probabilities[UNLISTED] < _FROM_PROBABILITY
    if corrects:
        base = next(c for c in group.candidates if c.hypothesis == leading)
        inflation = attempts.inflation_of(base.fit)
        left = base.held_out_excess
        suspects = [b for b in suspects if left[b.name].systematic > MOST_MISSED]
        if base.wrong or base.fit.events is not None or not suspects:
            return group
    elif group.probabilities[UNLISTED] < _FROM_PROBABILITY:
        return group
    if any(b.closure is None for b in suspects):
        tell(
            "no form of what is missing is looked for, since that of a load, of a force, of a "
            "temperature or of a valve in front of a line is not in the simulator"
        )
        return group
    group = replace(group, sought=not corrects)
    form = attempts.fit_form(base, inflation, suspects, say)
    # what does not carry over to recordings that were held out is no form of anything
    if form is None or share_left(form, base, suspects) > 1.0 - FURTHER_SHARE:
        return group
    if corrects:
        by_name, by_both = (share_left(c, refit.start, suspects) for c in (base, form))
        absent = is_absent(form, attempts.settings.most_tolerances)
        if absent or by_name - by_both > 1.0 - by_name:
            return group  # it would be the form that explains, and not the name
    return replace(group, closure=form)


def _split_by_names(group: BlockGroup, attempts: Attempts, prior: Prior) -> list[BlockGroup]:
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
        return posterior([start, *candidates], blocks, prior)

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
            key=partial(probability_of, alone[b.name]),
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
