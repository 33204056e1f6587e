"""The result of a diagnosis, from what was concluded: findings, traces, words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import (
    SAME_STDS,
    BlockGroup,
    FittedHypothesis,
    Judged,
    share_left,
    with_stated_std,
)
from pamrs.diagnosis.explain import _words as words
from pamrs.diagnosis.explain._block_entries import block_entries, not_judged, unexplained
from pamrs.diagnosis.explain._conditions import Picture, describe
from pamrs.diagnosis.explain._forms import form_sentence, forms_of
from pamrs.diagnosis.fit import (
    CHOSEN,
    Problem,
    concerns,
    depends,
    entry_of,
    events_of,
    form_in,
    in_tolerances,
    known_parameters,
)
from pamrs.diagnosis.model import (
    DETERMINED_SHARE,
    Conclusion,
    Models,
    notes_on_constants,
    owners_of_effects,
    owners_of_parameters,
    with_std,
)
from pamrs.diagnosis.prepare import Unjudged, notes_on_warm_starts
from pamrs.diagnosis.result import Diagnosis
from pamrs.effects import CATALOGUE, Hypothesis, Term, effect_of
from pamrs.findings import (
    HEALTHY,
    BlockResidual,
    ChannelError,
    Considered,
    EffectFound,
    EffectParameterFound,
    FitErrors,
    Limit,
    ParameterFound,
    StageError,
    Tested,
    Trace,
    Tried,
    WrongParameter,
)
from pamrs.recordings import Case
from pamrs.report.sentences import unknown_volumes
from pamrs.report.sentences import verdict as verdict_in_words
from pamrs.rig import Rig

# [noise levels] gap of refit to noise below which nothing is said of how much closes
_LEAST_GAP = 0.05


def assemble(
    case: Case,
    fit_problem: Problem,
    held_out_problem: Problem,
    groups: list[BlockGroup],
    conclusion: Conclusion,
    unjudged: Sequence[Unjudged] = (),
    limits: Sequence[Limit] = (),
) -> Diagnosis:
    """Build the diagnosis from the groups of blocks and what was concluded of them.

    Parameters
    ----------
    case : Case
        The case.
    fit_problem, held_out_problem : Problem
        Recordings to fit and held-out ones (the same object when there are no others).
    groups : list of BlockGroup
        Gas blocks and arm, examined.
    conclusion : Conclusion
        Model, errors, budget and free runs.
    unjudged : sequence of Unjudged
        Blocks of the rig that are not judged.
    limits : sequence of Limit
        Sizes from which the recordings would have shown effects.
    """
    nominal, models, judged = case.rig, conclusion.models, conclusion.judged
    verdict, noise_level, part = models.verdict, conclusion.noise_level, fit_problem.losses.part
    named = any(j.named or j.wrong for j in judged)
    known = models.chosen if named else models.starts
    owners = models.owners if named else owners_of_parameters(known)
    changed = models.added or any(j.wrong for j in judged)
    fit_residuals, errors = conclusion.fit_residuals, conclusion.errors
    held_out_residuals, table = conclusion.held_out_residuals, conclusion.table
    recorded = fit_problem, fit_residuals, held_out_problem, held_out_residuals
    blocks = block_entries(judged, *recorded, noise_level, conclusion.own_errors)
    forms = _forms(models, fit_problem)
    stages = [(fit_problem, fit_residuals)]
    if held_out_problem is not fit_problem:
        stages.insert(0, (held_out_problem, held_out_residuals))
    effects = _effects(judged, verdict, fit_problem, forms)
    constants = notes_on_constants(conclusion.runs or [], [effect.id for effect in effects])
    start_notes = notes_on_warm_starts(
        fit_problem.blocks,
        [*fit_problem.recordings, *held_out_problem.recordings],
        {**fit_residuals["after"], **held_out_residuals["after"]},
    )
    diagnosis = Diagnosis(
        case=case.name,
        verdict=verdict,
        effects=effects,
        ambiguity=[hypothesis.words for hypothesis in conclusion.ambiguity],
        probabilities={str(h): p for h, p in conclusion.probabilities.items()},
        parameters=_parameters(nominal, known, owners),
        fit=FitErrors(
            errors["fit"], errors["held_out"], _gap(table, _LEAST_GAP) if changed else None
        ),
        warnings=constants,
        rig=models.final
        if verdict == "none"
        else with_std(models.final, nominal, models.chosen, models.owners),
        traces=_traces(fit_problem, held_out_problem, fit_residuals, held_out_residuals),
        blocks=[*blocks, *map(not_judged, unjudged)],
        budget=conclusion.budget,
        unexplained=unexplained(
            judged, blocks, stages, noise_level, conclusion.budget, forms, nominal, errors
        ),
        wrong_parameters=_wrong_parameters(models, fit_problem, table),
        measured=list(case.channels),
        residuals=_block_table(groups),
        tried=_tried_sets(groups),
        considered=part("what was asked for", lambda: _considered(judged, fit_problem), []),
        tested=part("the list of what was tested", lambda: _tested(groups), []),
        free_run=conclusion.runs,
        free_run_note=conclusion.runs_note,
        free_traces=conclusion.curves,
        limits=list(limits),
        settings=fit_problem.settings,
    )
    notes = [
        *words.absolute(case),
        *words.left_out(case, judged),
        *(words.reservations(models.chosen) if any(j.named or j.wrong for j in judged) else []),
        *(words.worse(table) if models.added else []),
        *words.warnings(case, judged, diagnosis.parameters, held_out_problem is fit_problem),
    ]
    diagnosis = replace(diagnosis, warnings=[*constants, *notes, *start_notes])
    picture = _picture(diagnosis.answer.block, conclusion, fit_problem)
    where = words.where(diagnosis.answer, fit_problem, judged, picture, errors)
    return _with_text(replace(answered(diagnosis), where=where), case, judged, forms)


def answered(diagnosis: Diagnosis) -> Diagnosis:
    """Diagnosis with its answer's verdict; if much is missed, none of it counts as healthy."""
    answer, chances = diagnosis.answer, diagnosis.probabilities
    if answer.missed:  # that nothing is missing is no answer any more
        healthy = sum(chances.get(key, 0.0) for key in HEALTHY)
        chances = chances | dict.fromkeys(HEALTHY, 0.0)
        chances["unlisted"] = chances.get("unlisted", 0.0) + healthy
        chances = dict(sorted(chances.items(), key=lambda item: -item[1]))
    return replace(diagnosis, verdict=answer.verdict, probabilities=chances)


def _picture(located: str | None, conclusion: Conclusion, fitted: Problem) -> Picture:
    """Conditions and times at which the answer's block is off; empty without such a block."""
    if located is None:
        return Picture()
    block = next(b for b in fitted.blocks if b.name == located)
    nominal, residuals = conclusion.models.nominal, conclusion.fit_residuals["refit"]
    return fitted.losses.part(
        "the conditions of the mismatch",
        lambda: describe(block, fitted.recordings, nominal, residuals, conclusion.noise_level),
        Picture(),
    )


def _with_text(
    diagnosis: Diagnosis,
    case: Case,
    judged: list[Judged],
    forms: dict[str, str],
) -> Diagnosis:
    """Diagnosis with its verdict in words."""
    sought = any(j.group.sought for j in judged if j.verdict == "unlisted")
    sentences = list(dict.fromkeys(forms.values()))
    return replace(diagnosis, text=verdict_in_words(diagnosis, case, sentences, sought=sought))


def _forms(models: Models, fitted: Problem) -> dict[str, str]:
    """Sentences on the fitted form of a mismatch without a name, by block."""
    sentences: dict[str, str] = {}
    for judged, chosen in zip(models.judged, models.chosen, strict=True):
        if judged.form is not None:
            group = judged.group
            part = replace(fitted, blocks=group.blocks)
            forms = forms_of(chosen.fit, part, judged.named_alone.fit)
            text = "\n".join(map(form_sentence, forms))
            sentences |= dict.fromkeys((b.name for b in group.blocks), text)
    return sentences


def _tried_sets(groups: list[BlockGroup]) -> list[Tried]:
    """Every fitted set of effects, with what it leaves of each block's excess."""
    return [
        Tried(
            blocks=[b.name for b in group.blocks],
            effects=list(map(str, candidate.effects)),
            wrong_parameters=list(candidate.wrong),
            fitted={b: e.ratio for b, e in candidate.fit_excess.items()},
            held_out={b: e.ratio for b, e in candidate.held_out_excess.items()},
            gap_closed=candidate.gap_closed,
            fitted_values=candidate.fit.effect_values,
            std={
                n: s
                for n, s in candidate.fit.std.items()
                if n not in candidate.fit.moved and effect_of(n) is not None and math.isfinite(s)
            },
            prior=sum(v * v for v in candidate.fit.moved.values()),
            suspects=[b.name for b in group.suspects],
            gain=candidate.gain,
        )
        for group in groups
        for candidate in group.candidates
    ]


def _considered(judged: list[Judged], fitted: Problem) -> list[Considered]:
    """Probability and share left of each set that the caller asked for, by group of blocks with a
    mismatch in which a term of it acts; without blocks where there is no such group.
    """
    entries: list[Considered] = []
    for hypothesis in fitted.considered:
        before = len(entries)
        for group_judged in judged:
            group, blocks = group_judged.group, group_judged.group.suspects
            terms = tuple(t for t in hypothesis.terms if any(concerns(t, b) for b in blocks))
            if group.mismatch is None or not terms:
                continue
            acting = Hypothesis(terms)
            candidate = next((c for c in group.candidates if c.hypothesis == acting), None)
            share = None
            if candidate is not None:
                share = share_left(candidate, group.candidates[0], blocks)
            probability = group_judged.probabilities.get(acting, 0.0)
            entries.append(Considered(acting.words, [b.name for b in blocks], probability, share))
        if len(entries) == before:
            chance = max(group_judged.probabilities.get(hypothesis, 0.0) for group_judged in judged)
            entries.append(Considered(hypothesis.words, [], chance, None))
    return entries


def _tested(groups: list[BlockGroup]) -> list[Tested]:
    """Every persistent effect that acts where a mismatch is, its predicted gain and what it leaves
    alone, the best first.
    """
    entries = []
    for group in groups:
        for effect, predicted_gain in group.predicted_gain.items():
            singles = [c for c in group.candidates if c.effects == (effect,)]
            alone = [share_left(c, group.candidates[0], group.suspects) for c in singles]
            blocks = [b.name for b in group.suspects]
            entries.append(
                Tested(
                    str(effect),
                    blocks,
                    min(1.0, max(0.0, predicted_gain)),
                    min(alone, default=None),
                )
            )
    return sorted(
        entries, key=lambda a: (a.left is None, a.left if a.left is not None else -a.predicted_gain)
    )


def _gap(table: dict[str, ChannelError], least: float) -> float | None:
    """(refit - after)/(refit - noise), pooled over channels in units of their noise."""
    refit = sum(e.refit / e.noise for e in table.values())
    after = sum(e.after / e.noise for e in table.values())
    room = refit - len(table)
    return None if room < least else max(0.0, min(1.0, (refit - after) / room))


def _effects(
    judged: list[Judged], verdict: str, problem: Problem, forms: Mapping[str, str]
) -> list[EffectFound]:
    """The effects that are named, the most probable first; without a name those that come
    closest. Of named ones `forms` say what their equations lack, by block.
    """
    named: dict[Term, tuple[float, FittedHypothesis]] = {}
    corrections = {
        effect: forms.get(j.group.blocks[0].name, "")
        for j in judged
        for effect in j.named
        if j.form is not None
    }
    chosen = [j.chosen for j in judged]
    owners = owners_of_effects(chosen)
    in_set = problem.settings.in_set
    for j in judged:
        effects = dict.fromkeys(effect for c in j.group.candidates for effect in c.effects)
        listed = [effect for effect in effects if effect.id in CATALOGUE]
        for effect in j.named if verdict == "effects" else listed:
            p = j.probability(effect)
            if verdict == "effects":
                first = max(p, named[effect][0] if effect in named else 0.0)
                named[effect] = first, chosen[owners[effect]]
            elif p >= in_set:
                having = [c for c in j.group.candidates if effect in c.effects]
                chances = j.group.probabilities
                best = max(having, key=lambda c: (chances.get(c.hypothesis, 0.0), c.gap_closed))
                named[effect] = p, with_stated_std(problem, j.group, best)
    return [
        EffectFound(
            id=effect.id,
            name=effect.info.name,
            at=effect.at,
            form=form_in(candidate.fit.rig, effect),
            probability=p,
            parameters=_effect_parameters(effect, candidate),
            events=_events(effect, candidate),
            correction=corrections.get(effect, ""),
        )
        for effect, (p, candidate) in sorted(named.items(), key=lambda kv: -kv[1][0])
    ]


def _wrong_parameters(
    models: Models, problem: Problem, table: dict[str, ChannelError]
) -> list[WrongParameter]:
    """Parameters that the rig file is wrong about: its value, the one that the recordings ask for,
    and what the error becomes.
    """
    entries, judged = [], models.judged
    for name in dict.fromkeys(name for j in judged for name in j.wrong):
        naming = [j for j in judged if name in j.wrong]
        # of a zero that two groups have, the value is that of the group that knows it best
        fitted = models.chosen[models.owners[name]].fit
        known = known_parameters(models.nominal)[name]
        value, std = fitted.values[name], fitted.std[name]
        telling = [
            b
            for b in problem.blocks
            if depends(b, name) and any(b in j.group.blocks for j in naming)
        ]
        errors = {b.channel: table[b.channel] for b in telling}
        entries.append(
            WrongParameter(
                name=name,
                block=telling[-1].name if telling else None,
                nominal=known.value,
                tolerance=known.tol,
                value=value,
                std=std,
                interval=_interval(value, std, known.lower),
                unit=known.unit,
                moved_sigmas=in_tolerances(known, value),
                probability=max(j.probability(Term(name)) for j in naming),
                held_out={
                    channel: StageError(e.before, e.refit, e.after) for channel, e in errors.items()
                },
            )
        )
    return entries


def _events(effect: Term, candidate: FittedHypothesis) -> list[dict[str, Any]]:
    """Events of an effect in each recording, one entry for each event."""
    events = candidate.fit.events
    if events is None or events.effect != effect:
        return []
    entries = []
    rises = [p.name for p in effect.info.with_role("rise")]
    for recording, values in events.values.items():
        for parameters in events_of(effect, events.form):
            event = {p.repeats or p.name: values[p.name] for p in parameters if p.name in values}
            if event:
                entries.append(
                    {
                        "recording": recording,
                        **event,
                        **{n: values[n] for n in rises if n in values},
                    }
                )
    return entries


def _effect_parameters(
    effect: Term, candidate: FittedHypothesis
) -> dict[str, EffectParameterFound]:
    """Parameters of an effect, fitted or chosen."""
    rig = candidate.fit.rig
    unknown_volume = bool(unknown_volumes(rig))
    out: dict[str, EffectParameterFound] = {}
    for parameter in effect.info.form(form_in(rig, effect)).parameters:
        name = f"{effect}.{parameter.name}"
        if parameter.role in (*CHOSEN, "threshold"):
            chosen = entry_of(rig, effect)["parameters"][parameter.name]
            out[parameter.name] = EffectParameterFound(chosen, None, parameter.unit)
            continue
        if name not in candidate.fit.values:
            continue
        value, std = candidate.fit.values[name], candidate.fit.std[name]
        out[parameter.name] = _entry(
            value,
            std,
            parameter.unit,
            # a pure number does not change with a volume that nobody knows
            (parameter.unit == "1" or not unknown_volume) and std < max(abs(value), 1e-300),
            parameter.lower,
        )
    if (
        effect.info.block == "chamber"
        and rig.model["valve"] is None
        and "" in rig.tables("chamber")
    ):
        out |= _emptying(effect, candidate)
    return out


def _emptying(effect: Term, candidate: FittedHypothesis) -> dict[str, EffectParameterFound]:
    """Time constant [s] of a sealed chamber emptying by a conductance; conductance per volume."""
    gas, chamber = candidate.fit.rig.model["gas"], candidate.fit.rig.model["chamber"]
    out: dict[str, EffectParameterFound] = {}
    for parameter in effect.info.form(form_in(candidate.fit.rig, effect)).parameters:
        name = f"{effect}.{parameter.name}"
        if parameter.unit != "m3/(s Pa)" or candidate.fit.values.get(name, 0.0) <= 0:
            continue
        value, std = candidate.fit.values[name], candidate.fit.std[name]
        volume = chamber["dead_volume"]
        density = 1.185  # [kg/m3] of air in the reference state of ISO 6358
        rt = gas["gas_constant"] * gas["temperature"]
        tau = volume / (value * density * rt * chamber.get("alpha_out", 1.0))
        out["time_constant"] = _entry(tau, tau * std / value, "s", std < value)
        out["conductance_per_volume"] = _entry(
            value / volume, std / volume, "1/(s Pa)", std < value
        )
    return out


def _entry(
    value: float, std: float, unit: str, identifiable: bool, lower: float = 0.0
) -> EffectParameterFound:
    """A fitted parameter with its interval of 95 %; without one, where the recordings do not depend
    on it.
    """
    if not math.isfinite(std):
        return EffectParameterFound(value, None, unit, identifiable=False)
    return EffectParameterFound(value, std, unit, _interval(value, std, lower), identifiable)


def _interval(value: float, std: float, lower: float) -> list[float]:
    """Interval of 95 %, inside the lower bound."""
    return [max(lower, value - 1.96 * std), value + 1.96 * std]


def _parameters(
    nominal: Rig, candidates: list[FittedHypothesis], owners: dict[str, int]
) -> dict[str, ParameterFound]:
    """Parameters of the baseline, each from the group that determines it best."""
    out: dict[str, ParameterFound] = {}
    known = known_parameters(nominal)
    for name, k in owners.items():
        p, fitted = known[name], candidates[k].fit
        moved = abs(fitted.values[name] - p.value)
        out[name] = ParameterFound(
            nominal=p.value,
            value=fitted.values[name],
            std=fitted.std[name],
            unit=p.unit,
            moved_sigmas=in_tolerances(p, fitted.values[name]),
            identifiable=fitted.std[name] < max(DETERMINED_SHARE * p.tol, moved / SAME_STDS),
        )
    return out


def _block_table(groups: list[BlockGroup]) -> dict[str, BlockResidual]:
    """Residual of each block's refitted baseline."""
    out: dict[str, BlockResidual] = {}
    for group in groups:
        for block in group.blocks:
            excess = group.baseline[block.name]
            out[block.name] = BlockResidual(
                excess.rms, excess.noise, excess.systematic, excess.p_value, block.channel
            )
    return out


def _traces(
    fit_problem: Problem,
    held_out_problem: Problem,
    fit_residuals: dict[str, Any],
    held_out_residuals: dict[str, Any],
) -> list[Trace]:
    traces = []
    stock = (
        [(fit_problem, fit_residuals)]
        if held_out_problem is fit_problem
        else [(fit_problem, fit_residuals), (held_out_problem, held_out_residuals)]
    )
    for problem, residuals_by_stage in stock:
        for prepared in problem.recordings:
            for block in problem.blocks:
                stages = {
                    s: residuals_by_stage[s][block.name, prepared.recording.name]
                    for s in ("before", "refit", "after")
                }
                shown = {s: np.where(r.rows, r.prediction, np.nan) for s, r in stages.items()}
                recording = prepared.recording
                traces.append(
                    Trace(
                        recording.name,
                        recording.role,
                        block.channel,
                        unit_of(block.channel),
                        recording.time,
                        recording.channels[block.channel],
                        **shown,
                    )
                )
    return traces
