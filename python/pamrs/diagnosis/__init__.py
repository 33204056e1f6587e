"""Diagnosis: locate a mismatch between model and recordings, name the omitted physics or say that
it is not listed.

A rig is cut at every measured channel, so that each tank, chamber, joint and hanging load has a
residual of its own. The baseline is refitted inside its tolerances first; what then exceeds the
noise level is located by block and condition, and the effects of the catalogue compete with each
other and with "unlisted" on held-out recordings.

Public are `diagnose`, `missing_input`, `Diagnosis`, `DiagnosisSettings`, and these packages and
modules, each with its own list: `settings` (what a user may change), `result` (what is returned),
and the layers, lowest first: `prepare`, `fit`, `noise`, `missing`, `screen`, `evidence`, `search`,
`model`, `limits`, `next_experiment`, `laws`, `explain`.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from pamrs._progress import Steps
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.evidence import BlockGroup, odds_of_unseen
from pamrs.diagnosis.explain import assemble, data_used, misread_diagnosis
from pamrs.diagnosis.fit import Problem, Unfollowed, fits, free_baseline, with_offsets
from pamrs.diagnosis.laws import is_better, names_open, promising_laws, under
from pamrs.diagnosis.limits import Limits, limits_of
from pamrs.diagnosis.missing import missing_input_of, worst_block
from pamrs.diagnosis.model import Conclusion, conclude, refitted_rig
from pamrs.diagnosis.next_experiment import next_to_record
from pamrs.diagnosis.noise import noise_levels
from pamrs.diagnosis.prepare import (
    NOISE_STDS,
    Block,
    DiagnosableCase,
    Prepared,
    Unjudged,
    averaged_to_need,
    blocks_with_tanks,
    check_case,
    check_sense,
    left_out,
    notes_on_beginnings,
    notes_on_own_values,
    notes_on_slack,
    notes_on_tanks,
    prepare,
    tanks_without_gauge,
    unjudged_blocks,
    with_own_values,
    with_tanks,
    with_unjudged_starts,
)
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.search import examine, find_misread, reading_errors
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CATALOGUE, UNLISTED, Hypothesis, Term
from pamrs.errors import DiagnosisError, PamrsError, ParameterError, SimulationError, meant
from pamrs.findings import MOST_MISSED, Answer, MissingInput, NextExperiment, beyond
from pamrs.recordings import Case, is_table, load_case
from pamrs.report.words import listed
from pamrs.rig import OtherChoice, Rig, load_rig
from pamrs.simulation import core_rig, supplies_of

__all__ = ["Diagnosis", "DiagnosisSettings", "diagnose", "missing_input"]

# factor for effects on a joint whose geometry is marked unknown (decision 12)
_UNKNOWN_GEOMETRY_FACTOR = 0.4


#: Shares of a diagnosis at which its blocks begin to be judged, and are.
_JUDGED = (0.3, 0.95)


def _usable_share(block: Block, recordings: list[Prepared]) -> float:
    """Share of a block's rows that may be used, over all recordings."""
    rows = [
        p.usable(block.channel, block.drives, p.starts(block.window, block.drives))
        for p in recordings
    ]
    return float(sum(r.sum() for r in rows)) / sum(r.size for r in rows)


def _unknown_parameters(rig: Rig) -> list[str]:
    """Parameters of what moves that the rig file marks unknown and that no fit moves."""
    moving = ("muscle", "transmission", "joint", "arm", "link", "load")
    unknown = [name for name, parameter in rig.parameters.items() if not parameter.known]
    return [name for name in unknown if channel_of(name) in moving]


def _scaled_for_unknown_geometry(group: BlockGroup, factor: float) -> BlockGroup:
    """Scale down all names in a group of moving blocks; ``unlisted`` gets the rest."""
    if group.mismatch is None or not group.mismatch.mechanical:
        return group
    probabilities = {h: factor * p if h.terms else p for h, p in group.probabilities.items()}
    probabilities[UNLISTED] = probabilities.get(UNLISTED, 0.0) + 1.0 - sum(probabilities.values())
    return replace(group, probabilities=probabilities)


@contextmanager
def _in_range(name: str) -> Iterator[None]:
    """Raise DiagnosisError, naming the case, when a simulation fails."""
    try:
        yield
    except SimulationError as error:
        raise DiagnosisError(
            f"case {name!r}: the model, driven by the recordings, leaves the range in which it "
            f"holds ({error}); check the rig's geometry and the recordings' units and columns"
        ) from error


def _regulators_in_noise(problem: Problem, rig: Rig) -> dict[str, str]:
    """Regulators whose droop cannot be judged, and why, by block: only the difference of two
    measured pressures shows their flow, and that is mostly noise.

    That noise grows with the droop, so that a fit would take the droop towards zero to be rid of it
    (errors in variables).
    """
    tables = rig.tables("supply")
    drooping = [name for name in supplies_of(rig, "regulator") if tables[name]["droop"] > 0.0]
    regulated = [b for b in problem.blocks if b.kind == "supply" and block_of(b.name) in drooping]
    recordings = problem.recordings
    reasons = {}
    noise_level = (
        noise_levels(replace(problem, blocks=regulated), problem.core) if regulated else {}
    )
    for block in regulated:
        gains = [
            (noise_level[block.name, p.recording.name].sample / p.noise[block.channel]) ** 2 - 1.0
            for p in recordings
        ]
        shift = math.sqrt(
            sum(max(0.0, gain) * p.n for gain, p in zip(gains, recordings, strict=True))
        )
        if shift > NOISE_STDS:
            reasons[block.name] = (
                "only the difference of two measured pressures "
                f"tells the regulator's flow, and their noise would move its droop by {shift:.2g} "
                f"standard deviations; at most {NOISE_STDS:g} is allowed (a flow meter "
                "would settle it)"
            )
    return reasons


def diagnose(
    case: Case | Rig | str | os.PathLike[str],
    *,
    data: Any = None,
    rig: Rig | str | os.PathLike[str] | None = None,
    allow_outside: bool = False,
    settings: DiagnosisSettings | None = None,
    consider: Sequence[str] = (),
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find the physics that a rig's model leaves out.

    Parameters
    ----------
    case : Case or path-like
        A case, its folder, or a model file that an earlier diagnosis wrote and that says from which
        case. Effects that the rig holds already are part of the nominal model: their parameters are
        refitted with the others, and they are not named again. With `data`, the rig or its file.
    data : DataFrame, Dataset or dict of array_like, shape (n,), optional
        Channels of a recording of the rig, or a dict of several such tables by their names, as
        `Case.from_arrays` takes them (which also takes units, a sample time and what is held out).
    rig : Rig or path-like, optional
        A model to begin from instead of the case's own, for example one with the effects that
        an earlier diagnosis found.
    allow_outside : bool
        Whether rig file and recordings of a case folder may lie outside of it.
    settings : DiagnosisSettings, optional
        The numbers that the verdict rests on; those of the published trials by default.
    consider : sequence of str, optional
        Suspicions to be judged with what the search finds by itself: each the id of an effect or
        the dotted name of a parameter that may be wrong, or several joined by ``+``
        (``"base_flexibility+muscle.modulus_scale"``). What of each acts where a mismatch is gets
        fitted from every start that the search knows, and competes with what it finds by itself;
        ``considered`` of the result says what it leaves. A block that keeps no more than noise has
        nothing for it to explain.
    progress : callable, optional
        Called with a line of text now and then; its ``share`` (0 to 1) is how much is done, its
        ``left`` how long it will go on [s, or None], its ``whole`` the text with both. Without one
        a notebook shows it; ``logging.getLogger("pamrs")`` has it as INFO.

    Returns
    -------
    Diagnosis
        Verdict, location, named effects with probabilities, fit before and after, model with the
        effect.

    Raises
    ------
    DiagnosisError
        If the recordings are too short, lack the channels that any block needs, or cannot be of
        this rig (units, swapped columns, dead sensors); the message says what was found and what is
        allowed.
    CaseError
        If the folder is not a case, or `data` no recordings of one.
    RigError
        If the rig file is wrong.
    ValueError
        If ``consider`` has a name that is neither an effect that the rig can have nor a parameter
        with a tolerance.

    Examples
    --------
    >>> import pamrs
    >>> pamrs.diagnose("my_case").verdict  # doctest: +SKIP
    'effects'
    >>> pamrs.diagnose(pamrs.load_rig("rig.toml"), data=frame).verdict  # doctest: +SKIP
    'none'
    """
    began = time.perf_counter()
    say = Steps(progress, within=_JUDGED)
    say("reading the case", 0.0)
    stated = _case_of(case, data, rig, allow_outside=allow_outside)
    chosen = DiagnosisSettings() if settings is None else settings
    checked = check_case(stated, chosen)
    case = checked.case
    considered = _checked_suspicions(case.rig, consider)
    with _in_range(case.name):
        diagnosis, checked = _answer_without_unfollowed(checked, chosen, considered, say)
        if _is_shown_by_held_out_alone(stated, diagnosis):
            other = _answer_with_other_roles(stated, chosen, considered)
            diagnosis, checked = other or (diagnosis, checked)
    if not math.isfinite(sum(diagnosis.probabilities.values())):
        raise DiagnosisError("the probabilities are not finite: please report this case")
    say(f"{case.name}: done", 1.0)
    return replace(
        diagnosis,
        faulty=checked.faulty,
        inputs=dict(case.inputs),
        seconds=round(time.perf_counter() - began, 3),
    )


def _is_shown_by_held_out_alone(case: Case, diagnosis: Diagnosis) -> bool:
    """True where a block without a name misses more than noise in held-out recordings, and no more
    in the fitted ones, which have nothing to search by then.
    """
    missed = {m.block for m in diagnosis.answer.missed}
    return bool(case.fit and case.held_out) and any(
        m.held_out is not None
        and m.held_out.refit.more_than_noise
        and not m.fitted.refit.more_than_noise
        for group in diagnosis.judged
        if not (group.effects or group.wrong_parameters)
        for m in group.mismatch
        if m.block in missed
    )


def _answer_with_other_roles(
    case: Case, settings: DiagnosisSettings, considered: tuple[Hypothesis, ...]
) -> tuple[Diagnosis, DiagnosableCase] | None:
    """Diagnosis with all recordings fitted but the last of those that were, with the checked case;
    None where it fails, names nothing or misses more. That recording proves that a name does no
    harm where it does not act.
    """
    proof, held = case.fit[-1].name, listed([r.name for r in case.held_out])
    recordings = [
        replace(r, role="held_out" if r.name == proof else "fit") for r in case.recordings
    ]
    note = f"what {held}, held out, shows is not in the others: fitted with them, {proof} held out"
    with suppress(PamrsError):
        checked = check_case(replace(case, recordings=recordings), settings)
        found, checked = _answer_without_unfollowed(
            checked, settings, considered, Steps(None, within=_JUDGED)
        )
        if found.answer.named and not found.answer.missed:
            return replace(found, warnings=[note, *found.warnings]), checked
    return None


def _answer_without_unfollowed(
    checked: DiagnosableCase,
    settings: DiagnosisSettings,
    considered: tuple[Hypothesis, ...],
    say: Steps,
) -> tuple[Diagnosis, DiagnosableCase]:
    """Diagnose a case without recordings that its model cannot follow; return that case too."""
    try:
        return _diagnosis_of_checked_case(checked, settings, considered, say), checked
    except Unfollowed as error:
        unfollowed = error
    why = f"the model cannot follow it ({unfollowed})"
    case, notes = left_out(checked.case, {unfollowed.recording: why})
    if not notes:
        raise unfollowed
    rest = replace(checked, case=case, suspected=[*notes, *checked.suspected])
    return _answer_without_unfollowed(rest, settings, considered, say)


def _diagnosis_of_checked_case(
    checked: DiagnosableCase,
    settings: DiagnosisSettings,
    considered: tuple[Hypothesis, ...],
    say: Steps,
) -> Diagnosis:
    """Diagnosis of a case that passed the checks before any fit: as one of another unit where one
    explains what the model misses, else of its physics.
    """
    case = checked.case
    shortened, counts = averaged_to_need(case.recordings, checked.blocks, case.name, settings)
    case = replace(case, recordings=shortened)
    say(f"{case.name}: preparing {len(case.recordings)} recordings", _JUDGED[0] / 2)
    fit_problem, held_out_problem, unjudged, start_notes = _problems(case, settings, considered)
    part, moved = partial(fit_problem.losses.part, through=(PamrsError,)), list[str]()
    misread = part("the search for other units", lambda: find_misread(fit_problem, case.rig))
    if misread is not None:
        errors = {"fit": reading_errors(case.rig, fit_problem, misread), "held_out": {}}
        if held_out_problem is not fit_problem:
            errors["held_out"] = reading_errors(case.rig, held_out_problem, misread)
        diagnosis = misread_diagnosis(case, fit_problem, misread, unjudged, errors)
    else:
        shifted = part(
            "the search for offsets of commands",
            lambda: _with_offsets(fit_problem, held_out_problem, case.rig),
        )
        fit_problem, held_out_problem, moved = shifted or (fit_problem, held_out_problem, [])
        stated = _answered(case, fit_problem, held_out_problem, unjudged, say)
        what = "the look at other laws of the rig"
        best = fit_problem.losses.part(
            what, lambda: _under_best_law(considered, fit_problem, stated, say), stated
        )
        diagnosis = _completed(best)
        fit_problem, unjudged = stated.fit_problem, stated.unjudged
    # the first few are all that a terminal shows: first what may make the answer wrong
    # a unit that is found settles what was doubted under the one that was said
    doubts = checked.doubts if misread is None else []
    warnings = [
        *fit_problem.losses.sentences,
        *checked.suspected,
        *doubts,
        *start_notes,
        *checked.notes,
    ]
    warnings += [*diagnosis.warnings, *checked.masked, *moved]
    values_of = {
        p.recording.name: p.recording.parameters
        for p in (*fit_problem.recordings, *held_out_problem.recordings)
    }
    recordings = [
        replace(r, parameters=values_of.get(r.name, r.parameters)) for r in case.recordings
    ]
    data = data_used(recordings, counts, fit_problem.blocks, case.rig, fit_problem.core, unjudged)
    return replace(diagnosis, warnings=warnings, data=data)


def _case_of(case: Any, data: Any, rig: Any, *, allow_outside: bool) -> Case:
    """The case that the caller means, with the model to begin from."""
    recorded = _case_with_own_model(case, data, allow_outside=allow_outside)
    if rig is None:
        return recorded
    return recorded.with_rig(rig) if isinstance(rig, Rig) else recorded.with_rig(load_rig(rig), rig)


def _case_with_own_model(case: Any, data: Any, *, allow_outside: bool) -> Case:
    """The case that the caller means, with its own model."""
    if data is not None:
        model = case if isinstance(case, (Rig, Case)) else load_rig(case)
        several = isinstance(data, Mapping) and data and all(map(is_table, data.values()))
        return Case.from_arrays(model, data if several else {"data": data})  # type: ignore[arg-type]
    if isinstance(case, Rig):
        raise DiagnosisError(
            "case is a Rig, and data is missing: diagnose(rig, data=table), or a case or its folder"
        )
    return case if isinstance(case, Case) else load_case(case, allow_outside=allow_outside)


@dataclass(frozen=True, eq=False)
class _Answered:
    """Diagnosis without the next experiment and the missing input, and what these are made from.

    Attributes
    ----------
    case : Case
        Rig and recordings.
    fit_problem, held_out_problem : Problem
        The recordings with the blocks that were judged.
    unjudged : list of Unjudged
        The blocks that were not.
    conclusion : Conclusion
        Chosen hypotheses, final model, free runs.
    diagnosis : Diagnosis
        Verdict, names, errors.
    """

    case: Case
    fit_problem: Problem
    held_out_problem: Problem
    unjudged: list[Unjudged]
    conclusion: Conclusion
    diagnosis: Diagnosis


def _answered(
    case: Case,
    fit_problem: Problem,
    held_out_problem: Problem,
    unjudged: list[Unjudged],
    say: Callable[..., None],
) -> _Answered:
    """Answer once no wrong unit was found."""
    every = fit_problem.blocks
    motion = [b for b in fit_problem.blocks if b.mechanical]
    parts = [[b for b in fit_problem.blocks if not b.mechanical], motion]
    groups = examine(fit_problem, held_out_problem, case.rig, [part for part in parts if part], say)
    fit_problem, held_out_problem = _judged_only(fit_problem, held_out_problem, groups)
    missed = [b for group in groups if group.mismatch is not None for b in group.blocks]
    slack = fit_problem.losses.part(
        "the look at slack muscles",
        lambda: notes_on_slack(case.rig, missed, fit_problem.recordings),
        [],
    )
    unsettled = _unknown_parameters(case.rig) if motion else []
    if unsettled:
        groups = [_scaled_for_unknown_geometry(g, _UNKNOWN_GEOMETRY_FACTOR) for g in groups]
    say("putting the answer together", _JUDGED[1])
    judged_names, failed = {block.name for block in fit_problem.blocks}, "its judgement failed"
    unjudged = [
        *unjudged,
        *(Unjudged(b.name, b.covers, failed) for b in every if b.name not in judged_names),
    ]
    limits = fit_problem.losses.part(
        "the limits", lambda: _limits(case.rig, groups, fit_problem, held_out_problem)
    )
    if limits is not None:
        unseen = odds_of_unseen(limits.acting(), fit_problem.settings)
        groups = [replace(g, unseen=sum(unseen.get(b.name, 0.0) for b in g.blocks)) for g in groups]
    conclusion = conclude(case.rig, fit_problem, held_out_problem, groups)
    beyond_noise = {
        b.name: beyond(error.after, error.noise, conclusion.own_errors[b.channel])
        for b in fit_problem.blocks
        if (error := conclusion.table.get(b.channel))
    }
    shown = [] if limits is None else limits.acting(beyond_noise)
    diagnosis = assemble(case, fit_problem, held_out_problem, groups, conclusion, unjudged, shown)
    warnings = [*slack, *diagnosis.warnings]
    if unsettled:
        what = "length" if case.rig.model["load"] else "angle"
        warning = (
            f"{', '.join(unsettled)}: marked unknown, and no fit moves them; a wrong one bends the "
            f"{what} as an effect would, so the probability of an effect of muscles and what they "
            f"move is multiplied by {_UNKNOWN_GEOMETRY_FACTOR:g}"
        )
        warnings.insert(0, warning)
    diagnosis = replace(diagnosis, warnings=warnings)
    return _Answered(case, fit_problem, held_out_problem, unjudged, conclusion, diagnosis)


def _completed(answered: _Answered) -> Diagnosis:
    """Diagnosis with the next experiment and the missing input."""
    fit_problem, held_out_problem = answered.fit_problem, answered.held_out_problem
    diagnosis, conclusion = answered.diagnosis, answered.conclusion
    proposal = fit_problem.losses.part(
        "the next experiment",
        lambda: next_to_record(
            diagnosis,
            conclusion.ambiguity,
            conclusion.hypotheses(fit_problem),
            answered.case.rig,
            conclusion.judged,
            fit_problem,
            held_out_problem,
        ),
        NextExperiment(""),
    )
    missing = fit_problem.losses.part(
        "the missing input",
        lambda: _missing(diagnosis.answer, conclusion, fit_problem, held_out_problem),
    )
    where = diagnosis.where
    if missing is not None and missing.times:
        first = missing.times[0].recording
        spans = [[t.start, t.stop] for t in missing.times if t.recording == first]
        where = replace(where, recording=first, intervals=sorted(spans))
    return replace(diagnosis, where=where, missing_input=missing, next_experiment=proposal)


def _under_best_law(
    considered: tuple[Hypothesis, ...], fit_problem: Problem, stated: _Answered, say: Steps
) -> _Answered:
    """Answer under the best of other laws where the rig file's laws leave a mismatch."""
    case, answer = stated.case, stated.diagnosis
    # a law that needs more names than the one of the rig file is no better
    settings = replace(
        fit_problem.settings,
        most_terms=min(max(1, names_open(answer)), fit_problem.settings.most_terms),
    )

    def divided(rig: Rig) -> tuple[Problem, Problem, list[Unjudged]]:
        fitted, held_out, unjudged, _ = _problems(case.with_rig(rig), settings, considered)
        return *_with_offsets(fitted, held_out, rig)[:2], unjudged

    best = stated
    for choice, recordings in promising_laws(case.rig, fit_problem, answer, divided):

        def tell(line: str, _: float | None = None, choice: OtherChoice = choice) -> None:
            say(f"with {choice.name} = {choice.other}: {line}")

        with suppress(PamrsError):  # a rig that these recordings cannot be of
            other = _answered(case.with_rig(choice.rig), *recordings, tell)
            if is_better(other.diagnosis, best.diagnosis):
                found = replace(other.diagnosis, settings=answer.settings)
                best = replace(other, diagnosis=under(choice, found, answer))
    return best


def _missing(
    answer: Answer, conclusion: Conclusion, fit_problem: Problem, held_out_problem: Problem
) -> MissingInput | None:
    """Missing input of the answer's block; None where it is noise, or was not followed."""
    block = next((b for b in fit_problem.blocks if b.name == answer.block), None)
    if block is None:
        return None
    models = conclusion.models
    named = models.added and models.events is None and answer.verdict == "effects"
    missing = missing_input_of(
        block,
        core_rig(models.baseline),
        _by_role(fit_problem, held_out_problem),
        conclusion.noise_level,
        named=core_rig(models.final) if named else None,
        margin=fit_problem.settings.noise_margin,
    )
    followed = missing is not None and missing.share > 0.0 and missing.noises_after < MOST_MISSED
    # by so many points of each recording, which is all that a result keeps
    return missing.thinned(400) if missing is not None and followed else None


def _limits(
    nominal: Rig, groups: list[BlockGroup], fit_problem: Problem, held_out_problem: Problem
) -> Limits:
    """Sizes from which all recordings would have shown effects, and distinguished them, next to the
    values of the refits.
    """
    every, baseline = _all_recordings(fit_problem, held_out_problem), refitted_rig(nominal, groups)
    noise_level = {key: level for group in groups for key, level in group.noise_level.items()}
    return limits_of(every, baseline, free_baseline(every, baseline), noise_level)


def _all_recordings(fit_problem: Problem, held_out_problem: Problem) -> Problem:
    """All recordings, of every role."""
    return replace(
        fit_problem,
        recordings=[p for part in _by_role(fit_problem, held_out_problem).values() for p in part],
    )


def _by_role(fit_problem: Problem, held_out_problem: Problem) -> dict[str, list[Prepared]]:
    """Recordings by their role."""
    held_out = {} if held_out_problem is fit_problem else {"held_out": held_out_problem.recordings}
    return {"fit": fit_problem.recordings, **held_out}


def missing_input(
    case: Case | Rig | str | os.PathLike[str],
    recordings: Any = None,
    *,
    block: str | None = None,
    rig: Rig | str | os.PathLike[str] | None = None,
    allow_outside: bool = False,
    settings: DiagnosisSettings | None = None,
) -> MissingInput:
    """Find what the model of a block would need to follow the recordings, without a diagnosis.

    That is a torque at a joint [N m], a force at a load [N], a mass flow into a chamber or tank
    [kg/s]; of what else is measured (a force, a temperature, a line's inlet) the error of the
    reading. It is positive where it makes what the block predicts larger. Nothing is refitted: what
    values of the rig file are off by is in it too.

    Parameters
    ----------
    case, recordings, rig, allow_outside
        As `case`, `data`, `rig` and `allow_outside` of :func:`diagnose`.
    block : str, optional
        The block: ``arm``, ``arm.elbow``, ``load``, ``chamber.flexor``, ``supply``, ...; by default
        the one that its model misses by most noise levels.
    settings : DiagnosisSettings, optional
        How recordings are made ready and noise is estimated; the defaults of a diagnosis.

    Returns
    -------
    MissingInput
        ``sentence``, ``argument`` and, for each of ``recordings``, arrays (n,): ``time`` [s],
        ``value`` and ``std`` in ``unit``, ``arguments`` by name in ``units`` (SI); ``plot()``,
        ``to_dict()``.

    Raises
    ------
    ParameterError
        If there is no such block among those that the recordings surround.
    DiagnosisError
        If the recordings cannot be used, or the model follows none of them.
    CaseError, RigError
        As :func:`diagnose`.

    Notes
    -----
    Heights of a function that is linear between knots, found by Gauss-Newton window by window, with
    the prior of an Ornstein-Uhlenbeck process whose size is the likeliest one (Rasmussen &
    Williams, Gaussian Processes for Machine Learning, 2006, sections 2.2 and 5.4).

    Examples
    --------
    >>> import pamrs
    >>> pamrs.missing_input("my_case").sentence  # doctest: +SKIP
    '0.98 N m against the motion'
    """
    chosen = DiagnosisSettings() if settings is None else settings
    checked = check_case(_case_of(case, recordings, rig, allow_outside=allow_outside), chosen)
    name = checked.case.name
    shortened, _ = averaged_to_need(checked.case.recordings, checked.blocks, name, chosen)
    with _in_range(name):
        fit_problem, held_out_problem, _, _ = _problems(
            replace(checked.case, recordings=shortened), chosen, ()
        )
        fit_problem, held_out_problem, _ = _with_offsets(
            fit_problem, held_out_problem, checked.case.rig
        )
        roles = _by_role(fit_problem, held_out_problem)
        every = _all_recordings(fit_problem, held_out_problem)
        if block is not None:
            by_name = {b.name: b for b in fit_problem.blocks}
            if block not in by_name:
                suggestion = meant(str(block), by_name)
                raise ParameterError(f"block = {block!r} is not allowed; {suggestion}")
            every = replace(every, blocks=[by_name[block]])
        noise_level = noise_levels(every, every.core)
        worst = worst_block(every, noise_level)
        missing = missing_input_of(
            worst, every.core, roles, noise_level, margin=chosen.noise_margin
        )
    if missing is None:
        raise DiagnosisError(
            f"case {name!r}: block {worst.name}: with no input does the model follow a recording; "
            "check the rig's geometry and the recordings' units and columns"
        )
    return missing


def _judged_only(
    fit_problem: Problem, held_out_problem: Problem, groups: list[BlockGroup]
) -> tuple[Problem, Problem]:
    """Recordings without the blocks whose judgement failed, the others with windows as judged."""
    judged = {block.name: block for group in groups for block in group.blocks}
    if not judged:
        raise DiagnosisError("; ".join(fit_problem.losses.sentences))
    fitted = replace(
        fit_problem, blocks=[judged[b.name] for b in fit_problem.blocks if b.name in judged]
    )
    same, blocks = held_out_problem is fit_problem, fitted.blocks
    return fitted, fitted if same else replace(held_out_problem, blocks=blocks)


def _with_offsets(
    fit_problem: Problem, held_out_problem: Problem, rig: Rig
) -> tuple[Problem, Problem, list[str]]:
    """Recordings, fitted and held out, with commands at the times they acted, and notes on that."""
    shifted, notes = with_offsets(
        [fit_problem] if held_out_problem is fit_problem else [fit_problem, held_out_problem], rig
    )
    return shifted[0], shifted[-1], notes


def _checked_suspicions(rig: Rig, consider: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Hypotheses that the caller asks for, checked, each once."""
    if isinstance(consider, str):
        raise ValueError(
            f"consider = {consider!r} is not allowed: a list of such texts, [{consider!r}]"
        )
    free = [name for name, parameter in rig.parameters.items() if parameter.tol > 0.0]
    possible = [e for e in CATALOGUE if fits(rig, e)]
    nominal_effects = {entry["id"] for entry in rig.effects}
    sets = (tuple(Term.parse(word.strip()) for word in text.split("+")) for text in consider)
    hypotheses = list(map(Hypothesis, sets))
    for text, hypothesis in zip(consider, hypotheses, strict=True):
        if len(hypothesis.set) < len(hypothesis.terms):
            raise ValueError(f"consider: {text!r} is not allowed: it has a name twice")
    for term in (term for hypothesis in hypotheses for term in hypothesis.terms):
        if term.is_effect and term.id in nominal_effects:
            raise ValueError(
                f"consider: {str(term)!r} is not allowed: the model holds it already, and it is "
                "refitted"
            )
        known = free if term.is_value else possible
        if term.id not in known:
            raise ValueError(
                f"consider: {str(term)!r} is neither an effect that this rig can have nor one of "
                f"its parameters with a tolerance; {meant(str(term), known)}"
            )
        if term.at:
            try:
                rig.with_effect(term.id, at=term.at)
            except ParameterError as error:
                raise ValueError(f"consider: {str(term)!r} is not allowed: {error}") from error
    return tuple(dict.fromkeys(hypotheses))


def _problems(
    case: Case, settings: DiagnosisSettings, considered: tuple[Hypothesis, ...]
) -> tuple[Problem, Problem, list[Unjudged], list[str]]:
    """Problems of fitted and held-out recordings, unjudged blocks, notes on unmeasured starts."""
    rig = case.rig
    fitted = [prepare(r, rig, settings) for r in case.fit or case.recordings]
    held_out = [prepare(r, rig, settings) for r in case.held_out if case.fit]
    channels, least = case.channels, settings.least_block_share
    blocks, core = blocks_with_tanks(rig, channels), core_rig(rig)
    tanks = tanks_without_gauge(rig, channels)
    fitted, held_out = (
        [with_tanks(rig, core, p, tanks) for p in part] for part in (fitted, held_out)
    )
    fitted, held_out = (
        [with_own_values(blocks, rig, core, p, tanks) for p in part] for part in (fitted, held_out)
    )
    judged = {b.name for b in blocks}
    every_block = unjudged_blocks(rig, channels)
    without = [
        replace(block, why=f"{block.why}: its simulated pressure drives what it feeds")
        if any(gauge == dotted("supply_pressure", block_of(block.name)) for gauge in tanks)
        else block
        for block in every_block
        if block.name not in judged
    ]
    known = {n: p.tol for n, p in rig.parameters.items() if 0.0 < p.tol < math.inf}
    fitted, held_out = (
        [with_unjudged_starts(blocks, core, p, known) for p in part] for part in (fitted, held_out)
    )
    thin = {
        b.name: share
        for b in blocks
        if (share := min(_usable_share(b, part) for part in (fitted, held_out) if part)) < least
    }
    start_notes = notes_on_beginnings([b for b in blocks if b.name in thin], [*fitted, *held_out])
    every = blocks
    blocks = [b for b in blocks if b.name not in thin]
    if thin and not blocks:
        raise DiagnosisError(
            f"case {case.name!r}: too few samples are usable in every block ("
            + ", ".join(f"{name}: {100 * share:.0f} %" for name, share in thin.items())
            + f"); at least {100 * least:.0f} % are needed"
            + "".join(f"; {text}" for text in start_notes)
        )
    fit_problem = Problem(blocks, fitted, core, settings, considered=considered)
    drowned = _regulators_in_noise(fit_problem, rig)
    left_out = [b for b in every if b.name in thin or b.name in drowned]
    fit_problem = replace(fit_problem, blocks=[b for b in blocks if b.name not in drowned])
    if not fit_problem.blocks:
        text = "; ".join(f"block {name}: {reason}" for name, reason in drowned.items())
        raise DiagnosisError(f"case {case.name!r}: {text}")
    check_sense(fit_problem.blocks, [*fitted, *held_out], fit_problem.core, case.name)
    why = {
        name: f"only {100 * share:.0f} % of its samples are usable" for name, share in thin.items()
    } | drowned
    unjudged = [*without, *(Unjudged(b.name, b.covers, why[b.name]) for b in left_out)]
    held_out_problem = replace(fit_problem, recordings=held_out) if held_out else fit_problem
    start_notes += notes_on_beginnings(
        fit_problem.blocks, [*fit_problem.recordings, *held_out_problem.recordings]
    )
    start_notes += notes_on_tanks(rig, fit_problem.blocks, fit_problem.recordings)
    start_notes += notes_on_own_values([*fitted, *held_out])
    return fit_problem, held_out_problem, unjudged, start_notes
