"""One model from the judged groups of blocks, and its residuals at every stage."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from pamrs._arrays import Array
from pamrs.diagnosis.evidence import (
    BlockGroup,
    FittedHypothesis,
    Judged,
    case_ambiguity,
    case_probabilities,
    drop_undetermined,
    judge,
    put_aside,
    value_may_be_right,
    with_stated_std,
)
from pamrs.diagnosis.fit import (
    FINAL_STEP_SHARE,
    Events,
    Key,
    Problem,
    concerns,
    depends,
    fit,
    known_parameters,
    parts_of,
    residuals,
    start_of,
    with_entry,
    with_known,
    without_term,
)
from pamrs.diagnosis.model._budget import budget, owners_of_effects, owners_of_parameters
from pamrs.diagnosis.model._free_run import KnownValues, free_run
from pamrs.diagnosis.noise import NoiseLevel, inflation_of
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CATALOGUE, NONE, PARAMETERS, UNDECIDED, UNLISTED, Hypothesis, Term
from pamrs.errors import SimulationError
from pamrs.findings import (
    HEALTHY,
    MOST_MISSED,
    BudgetTerm,
    ChannelError,
    FreeRun,
    Trace,
    beyond,
    case_verdict,
)
from pamrs.rig import Rig

# [tolerances] of two groups about one sensor's zero that refits the vaguer (decision 22)
_ZERO_DIFFERENCE = 0.1
_SPOILED = 1.2  # error of a channel over that of the model before, from which it is reported


@dataclass(frozen=True, eq=False)
class Models:
    """Nominal, refitted and final rig, with the judged groups and fits that they come from.

    Attributes
    ----------
    judged : list of Judged
        The groups, what they name fitted together with what other groups know better.
    starts, chosen : list of FittedHypothesis
        The baseline of each group, and what goes into the final model, with standard deviations
        that hold for equations that are not quite the rig's.
    owners : dict of str to int
        Of each parameter the group whose value the final model has.
    nominal, baseline, final : Rig
        As the rig file has it, refitted inside its tolerances, and with what was found.
    verdict : str
        Of the case.
    """

    judged: list[Judged]
    starts: list[FittedHypothesis]
    chosen: list[FittedHypothesis]
    owners: dict[str, int]
    nominal: Rig
    baseline: Rig
    final: Rig
    verdict: str

    @property
    def added(self) -> bool:
        """True where the final model has effects that the nominal one does not hold."""
        return len(self.final.effects) > len(self.nominal.effects)

    @property
    def events(self) -> Events | None:
        """Events of single recordings in the final model; None without any."""
        happened = (c.fit.events for c in self.chosen if c.fit.events is not None)
        return next(happened, None) if self.added else None

    def residuals(self, problem: Problem) -> dict[str, dict[Key, Residual]]:
        """Residuals of some recordings at every stage."""
        return {
            "before": _run(problem, self.nominal, None),
            "refit": _run(problem, self.baseline, None),
            "after": _run(problem, self.final, self.events),
        }


@dataclass(frozen=True, eq=False)
class Conclusion:
    """Numbers that a diagnosis comes to: models, probabilities, residuals, errors, budget, free
    runs.

    Attributes
    ----------
    models : Models
        The rig at every stage, from the verdicts of the groups.
    probabilities : dict of Hypothesis to float
        Of the case.
    ambiguity : list of Hypothesis
        Those that are left open.
    noise_level : dict
        By block and recording.
    fit_residuals, held_out_residuals : dict of str to dict
        Residuals of the recordings to fit and of the held-out ones (the same where there are no
        others) by stage (``before``, ``refit``, ``after``), block and recording.
    errors : dict of str to dict
        Error of each channel at every stage, by the role of the recordings (``fit``, ``held_out``);
        nothing of held-out ones where there are none.
    budget : list of BudgetTerm
        What takes how much of each block's mismatch.
    runs : list of FreeRun or None
        Simulations of each recording from its commands alone, and a note on them.
    runs_note : str
        The note on the runs.
    curves : list of Trace
        Those of the recording that the nominal model misses most.
    own_errors : dict of str to float
        What the error that is taken for the model's own does to each channel, one standard
        deviation, SI.
    """

    models: Models
    probabilities: dict[Hypothesis, float]
    ambiguity: list[Hypothesis]
    noise_level: dict[Key, NoiseLevel]
    fit_residuals: dict[str, dict[Key, Residual]]
    held_out_residuals: dict[str, dict[Key, Residual]]
    errors: dict[str, dict[str, ChannelError]]
    budget: list[BudgetTerm]
    runs: list[FreeRun] | None
    runs_note: str
    curves: list[Trace]
    own_errors: dict[str, float]

    @property
    def judged(self) -> list[Judged]:
        """The groups with their verdicts."""
        return self.models.judged

    @property
    def table(self) -> dict[str, ChannelError]:
        """Errors that the answer is proven by: held-out ones where there are any."""
        return self.errors["held_out"] or self.errors["fit"]

    def hypotheses(self, problem: Problem) -> list[tuple[str, Rig, float]]:
        """The likely hypotheses that have a model: label, rig and probability."""
        return _models_of(self.judged, self.probabilities, self.models.nominal, problem)


def conclude(
    nominal: Rig, fit_problem: Problem, held_out_problem: Problem, groups: list[BlockGroup]
) -> Conclusion:
    """Merge what the groups of blocks found into one model, and compute what it leaves.

    Parameters
    ----------
    nominal : Rig
        The model of the rig file.
    fit_problem, held_out_problem : Problem
        Recordings to fit and held-out ones (the same object when there are no others).
    groups : list of BlockGroup
        Gas blocks and arm, examined.
    """
    noise_level = {k: v for g in groups for k, v in g.noise_level.items()}
    models, fit_residuals, held_out_residuals = _sound_models(
        nominal, fit_problem, held_out_problem, groups, noise_level
    )
    judged, part = models.judged, fit_problem.losses.part
    fit_table = _table(fit_problem, fit_residuals, noise_level)
    held_out_table = (
        {}
        if held_out_problem is fit_problem
        else _table(held_out_problem, held_out_residuals, noise_level)
    )
    budgeted = partial(budget, judged, held_out_problem, held_out_residuals, noise_level, nominal)
    known = _known(models)
    ending = models.final, models.events, known, noise_level
    running = partial(free_run, held_out_problem, held_out_residuals, nominal, *ending)
    nothing: tuple[list[FreeRun] | None, str, list[Trace]] = (None, "the free run failed", [])
    terms = part("the budget", lambda: budgeted(models.final, models.events), [])
    runs, note, curves = part("the free run", running, nothing)
    return Conclusion(
        models,
        case_probabilities(judged),
        case_ambiguity(judged),
        noise_level,
        fit_residuals,
        held_out_residuals,
        {"fit": fit_table, "held_out": held_out_table},
        terms,
        runs,
        note,
        curves,
        _own_errors(fit_problem, noise_level),
    )


def refitted_rig(nominal: Rig, groups: list[BlockGroup]) -> Rig:
    """The rig with the values that the refit of each group of blocks has."""
    return _merged_rig(nominal, [group.candidates[0] for group in groups])


def _own_errors(problem: Problem, noise_level: dict[Key, NoiseLevel]) -> dict[str, float]:
    """Standard deviation of each channel by the error that is taken for the model's own [SI]."""
    names = [p.recording.name for p in problem.recordings]
    return {
        b.channel: math.sqrt(sum(noise_level[b.name, n].error_variance for n in names) / len(names))
        for b in problem.blocks
    }


def _sound_models(
    nominal: Rig,
    fit_problem: Problem,
    held_out_problem: Problem,
    groups: list[BlockGroup],
    noise_level: dict[Key, NoiseLevel],
) -> tuple[Models, dict[str, dict[Key, Residual]], dict[str, dict[Key, Residual]]]:
    """Rig at every stage, after answers that its errors contradict are taken out; residuals of
    fitted and of held-out recordings.

    The name or form that leads a group is taken out, and the group judged again, where the model
    predicts a channel worse with it than without, its blocks worse than the rig file's model, or
    where a value called wrong is inside its tolerances. The answer that nothing is missing is taken
    out where the model misses far more than noise and its own error.
    """
    settings, errors = fit_problem.settings, _own_errors(fit_problem, noise_level)
    groups = [drop_undetermined(group, fit_problem) for group in groups]
    while True:
        judged = judge(groups, settings)
        models = _models(nominal, fit_problem, judged, case_verdict(j.verdict for j in judged))
        fit_residuals = models.residuals(fit_problem)
        held_out_residuals = (
            fit_residuals if held_out_problem is fit_problem else models.residuals(held_out_problem)
        )
        # where there are no others both are those of the fitted recordings
        table = _table(held_out_problem, held_out_residuals, noise_level)
        blamed = _blamed(models.judged, spoiled_channels(table)) | _needless(models, settings)
        blamed |= _worse_than_file(models.judged, table, settings.noise_margin - 1.0)
        missing = {k: _missed(j, table, errors) for k, j in enumerate(models.judged)}
        if not blamed and not any(missing.values()):
            return models, fit_residuals, held_out_residuals
        groups = [
            _without_addition(group, models.judged[k])
            if k in blamed
            else _with_mismatch(group, missing[k])
            for k, group in enumerate(groups)
        ]


def _needless(models: Models, settings: DiagnosisSettings) -> set[int]:
    """Groups, by number, that call a value wrong which is inside its tolerances after all."""
    return {
        k
        for k, judged in enumerate(models.judged)
        for name in judged.wrong
        if value_may_be_right(
            models.chosen[models.owners[name]].fit, name, settings.most_tolerances
        )
    }


def _without_addition(group: BlockGroup, judged: Judged) -> BlockGroup:
    """Group without what it adds to the model: the form of what has no name, or else its name."""
    if judged.form is not None:
        return replace(group, closure=None)
    return put_aside(group, judged.chosen.hypothesis)


def _worse_than_file(
    judged: list[Judged], table: dict[str, ChannelError], margin: float
) -> set[int]:
    """Groups, by number, whose names predict the blocks in which they act worse than the model of
    the rig file, by more than `margin` of the noise's variance.
    """
    worse = set()
    for k, one in enumerate(judged):
        acting = [b for b in one.group.blocks if any(concerns(t, b) for t in one.added)]
        errors = [table[b.channel] for b in acting]
        lost = [(e.after**2 - e.before**2) / e.noise**2 - margin for e in errors]
        if lost and sum(lost) > 0.0:
            worse.add(k)
    return worse


def _missed(
    judged: Judged, table: dict[str, ChannelError], own_errors: dict[str, float]
) -> list[Block]:
    """Blocks of a group of which nothing is said to be missing, though the refitted model misses
    far more than noise and its own error; the worst first.
    """
    if judged.verdict not in HEALTHY or judged.wrong:
        return []

    def more(block: Block) -> float:
        error = table[block.channel]
        size = min(error.refit, error.after)
        return beyond(size, error.noise, own_errors[block.channel])

    missed = [block for block in judged.group.blocks if more(block) > MOST_MISSED]
    return sorted(missed, key=more, reverse=True)


def _with_mismatch(group: BlockGroup, missed: list[Block]) -> BlockGroup:
    """Group changed to ``unlisted``, with the missed blocks as its suspects."""
    if not missed:
        return group
    chances = dict(group.probabilities)
    lost = chances.pop(UNDECIDED, 0.0)
    chances[UNLISTED] = chances.get(UNLISTED, 0.0) + lost
    return replace(group, probabilities=chances, mismatch=missed[0], suspects=missed)


def _blamed(judged: list[Judged], spoilt: Collection[str]) -> set[int]:
    """Groups that add to the model what spoils a channel: those that have the channel, else those
    whose additions act in its block.
    """
    added = {k: _additions(j) for k, j in enumerate(judged) if _additions(j)}
    blamed: set[int] = set()
    for channel in spoilt:
        having = {k for k in added if channel in {b.channel for b in judged[k].group.blocks}}
        blocks = [b for j in judged for b in j.group.blocks if b.channel == channel]
        acting = {k for k in added if any(concerns(term, b) for b in blocks for term in added[k])}
        blamed |= having or acting
    return blamed


def _additions(judged: Judged) -> tuple[Term, ...]:
    """Effects that a group adds to the model."""
    return judged.form.effects if judged.form is not None else judged.named


def _models(nominal: Rig, fit_problem: Problem, judged: list[Judged], verdict: str) -> Models:
    """The rig at every stage, from the verdicts of the groups."""
    refitted = _with_common_zeros(
        nominal, fit_problem, judged, [j.group.candidates[0] for j in judged]
    )
    baseline = _merged_rig(nominal, refitted)
    starts = _with_stated_stds(fit_problem, judged, refitted)
    if verdict not in ("effects", "unlisted") and not any(j.wrong for j in judged):
        final = nominal if verdict == "none" else baseline
        return Models(
            judged,
            starts,
            starts,
            owners_of_parameters(refitted),
            nominal,
            baseline,
            final,
            verdict,
        )
    # what is named, with a form of what has no name
    wanted = [
        j.form or (j.chosen if j.named or j.wrong else start)
        for j, start in zip(judged, refitted, strict=True)
    ]
    settled = _with_common_zeros(nominal, fit_problem, judged, wanted)
    chosen = _with_stated_stds(fit_problem, judged, settled)
    judged = [
        replace(j, chosen=c) if j.named or j.wrong else j
        for j, c in zip(judged, chosen, strict=True)
    ]
    final = _merged_rig(nominal, settled)
    owners = owners_of_parameters(settled)
    return Models(judged, starts, chosen, owners, nominal, baseline, final, verdict)


def _known(models: Models) -> KnownValues:
    """Values of the final model with a root of their covariance: fitted, else of the rig file."""
    of_file = {n: p for n, p in known_parameters(models.nominal).items() if p.tol > 0}
    names, values, parts = list[str](), list[float](), list[Array]()
    for k, candidate in enumerate(models.chosen):
        fitted_model = candidate.fit
        every = list(fitted_model.scales)
        names_here = [
            n for n in every if models.owners.get(n, k) == k and math.isfinite(fitted_model.std[n])
        ]
        at = [every.index(n) for n in names_here]
        fitted = np.sqrt(np.maximum(np.diag(fitted_model.covariance)[at], 1e-300))
        wide = np.array([fitted_model.std[n] for n in names_here]) / fitted
        size, axes = np.linalg.eigh(fitted_model.covariance[np.ix_(at, at)] * np.outer(wide, wide))
        parts.append(axes * np.sqrt(np.maximum(size, 0.0)))
        names += names_here
        values += [fitted_model.values[n] for n in names_here]
    rest = [n for n in of_file if n not in names and math.isfinite(of_file[n].tol)]
    parts.append(np.diag([of_file[n].tol for n in rest]))
    values += [of_file[n].value for n in rest]
    return KnownValues((*names, *rest), np.array(values), block_diag(*parts))


def _run(problem: Problem, rig: Rig, events: Events | None) -> dict[Key, Residual]:
    """Residuals of a model, with events of single recordings instead of its own such effect."""
    return residuals(
        problem, rig if events is None else without_term(rig, events.effect), (), events
    )


def _models_of(
    judged: list[Judged], probabilities: dict[Hypothesis, float], nominal: Rig, problem: Problem
) -> list[tuple[str, Rig, float]]:
    """The likely hypotheses that have a model, as fitted, with the form of what their names lack
    where it was fitted, the refitted baseline where nothing has a name; those of an effect with
    times of its own can predict no other recording.
    """
    likely, least = [], problem.settings.simulated_from
    healthy = {h.rest: p for h, p in probabilities.items() if h in (NONE, PARAMETERS)}

    def model(chosen: list[FittedHypothesis]) -> Rig:
        with_stds = _with_stated_stds(problem, judged, chosen)
        return with_std(
            _merged_rig(nominal, chosen), nominal, with_stds, owners_of_parameters(chosen)
        )

    likeliest = max(healthy, key=lambda rest: healthy[rest], default="")
    if sum(healthy.values()) >= least:
        chosen = [j.group.candidates[0] for j in judged]
        likely.append((likeliest, model(chosen), sum(healthy.values())))
    for hypothesis, p in probabilities.items():
        wanted = hypothesis.set
        if p < least or hypothesis.rest or not all(t.id in CATALOGUE or t.is_value for t in wanted):
            continue
        chosen = [_within(j.group, wanted) for j in judged]
        if any(c.fit.events is not None for c in chosen):
            continue
        if {term for c in chosen for term in c.terms} == wanted:
            corrected = [
                j.form or c if j.named and c is j.named_alone else c
                for j, c in zip(judged, chosen, strict=True)
            ]
            likely.append((str(hypothesis), model(corrected), p))
    return likely


def _within(group: BlockGroup, wanted: frozenset[Term]) -> FittedHypothesis:
    """The most probable hypothesis of a group that names nothing else than what is wanted; the
    baseline where there is none.
    """
    named = [c for c in group.candidates if c.terms and c.hypothesis.set <= wanted]
    return max(
        named, key=lambda c: group.probabilities.get(c.hypothesis, 0.0), default=group.candidates[0]
    )


def _with_common_zeros(
    nominal: Rig, problem: Problem, judged: list[Judged], chosen: list[FittedHypothesis]
) -> list[FittedHypothesis]:
    """Refit groups with sensors' zeros held that another group determines better and differently.

    A rig has one zero of a sensor; the other values of a fit hold with its own zero only.
    """
    owners = owners_of_parameters(chosen)
    settled_candidates = list(chosen)
    for k, candidate in enumerate(chosen):
        part = replace(problem, blocks=judged[k].group.blocks)
        # those that were held before too: a fit that frees one again is right with its own only
        common = {
            n: chosen[owner].fit
            for n, owner in owners.items()
            if owner != k and n.startswith("sensors.") and any(depends(b, n) for b in part.blocks)
        }
        own_values = candidate.fit.rig.parameters
        differ = any(
            abs(own_values[n].value - other.values[n])
            > _ZERO_DIFFERENCE * nominal.parameters[n].tol
            for n, other in common.items()
        )
        if differ and candidate.fit.events is None:
            effects = candidate.fit.effects
            free, fixed, forms = parts_of(start_of(candidate.fit, effect) for effect in effects)
            settled = {n: other.values[n] for n, other in common.items()}
            inflation = inflation_of(part, candidate.fit, judged[k].group.noise_level)
            with contextlib.suppress(SimulationError):  # it then stays as it was fitted
                again = fit(
                    part,
                    nominal,
                    effects,
                    free,
                    inflation,
                    fixed=fixed,
                    warm=candidate.fit,
                    share=FINAL_STEP_SHARE,
                    settled=settled,
                    freed=candidate.fit.freed,
                    forms=forms,
                )
                settled_candidates[k] = replace(candidate, fit=again)
    return settled_candidates


def _with_stated_stds(
    problem: Problem, judged: list[Judged], chosen: list[FittedHypothesis]
) -> list[FittedHypothesis]:
    """The fits of the groups with the standard deviations that are stated."""
    return [
        _with_form_std(j, with_stated_std(problem, j.group, c))
        for j, c in zip(judged, chosen, strict=True)
    ]


def _with_form_std(judged: Judged, candidate: FittedHypothesis) -> FittedHypothesis:
    """Names with a form of what they lack: standard deviations with how far it moved each value."""
    if judged.form is None or not judged.named or candidate.effects != judged.form.effects:
        return candidate
    fitted, alone = candidate.fit, judged.named_alone.fit.values
    std = {
        n: math.hypot(s, fitted.values[n] - alone.get(n, fitted.values[n]))
        for n, s in fitted.std.items()
    }
    return replace(candidate, fit=replace(fitted, std=std))


def _merged_rig(nominal: Rig, candidates: list[FittedHypothesis]) -> Rig:
    """One rig from the groups' fits; where two have a value of their own, that of the group that
    knows it best.
    """
    rig = nominal
    for _, entry in _added_effects(nominal, candidates):
        rig = with_entry(rig, entry)
    owners = owners_of_parameters(candidates).items()
    return with_known(rig, {name: candidates[k].fit.values[name] for name, k in owners})


def _added_effects(
    nominal: Rig, candidates: list[FittedHypothesis]
) -> Iterator[tuple[FittedHypothesis, dict[str, Any]]]:
    """Effects that the fits have and the nominal model has not, each from the fit that knows it
    best.
    """
    owners, nominal_effects = (
        owners_of_effects(candidates),
        {entry["id"] for entry in nominal.effects},
    )
    for k, candidate in enumerate(candidates):
        for entry in candidate.fit.rig.effects:
            if entry["id"] not in nominal_effects and owners.get(Term.of(entry), k) == k:
                yield candidate, entry


def with_std(
    rig: Rig, nominal: Rig, candidates: list[FittedHypothesis], owners: dict[str, int]
) -> Rig:
    """A model with the standard deviations of its effects; of one that the nominal model held, as
    the group has it that knows it best.
    """
    spread = {name: candidates[k].fit.std[name] for name, k in owners.items()}
    rig = with_known(rig, {}, {name: s for name, s in spread.items() if math.isfinite(s)})
    for candidate, entry in _added_effects(nominal, candidates):
        known = Term.of(entry).own(candidate.fit.std)
        rig = with_entry(rig, entry, {n: s for n, s in known.items() if math.isfinite(s)})
    return rig


def _table(
    problem: Problem, by_stage: dict[str, dict[Key, Residual]], noise_level: dict[Key, NoiseLevel]
) -> dict[str, ChannelError]:
    """Error of every channel at every stage."""
    out = {}
    for block in problem.blocks:
        keys = [(block.name, p.recording.name) for p in problem.recordings]
        weights = [max(1, int(by_stage["refit"][key].rows.sum())) for key in keys]
        squares = [[noise_level[key].sample ** 2 for key in keys]]
        for stage in ("before", "refit", "after"):
            left = [by_stage[stage][key] for key in keys]
            squares.append(
                [float(np.mean(r.value[r.rows] ** 2)) if r.rows.any() else 0.0 for r in left]
            )
        errors = [math.sqrt(float(np.average(one, weights=weights))) for one in squares]
        out[block.channel] = ChannelError(*errors)
    return out


def spoiled_channels(table: dict[str, ChannelError]) -> list[str]:
    """Channels that the model with what was added predicts worse than the one without it."""
    return [
        channel
        for channel, error in table.items()
        if error.after > _SPOILED * max(min(error.before, error.refit), error.noise)
    ]
