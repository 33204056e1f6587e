"""Other laws of a rig file as hypotheses: gas, valve flow and muscle force, tried in the blocks
that miss.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from pamrs.diagnosis.fit import Problem, fit
from pamrs.diagnosis.noise import no_inflation
from pamrs.diagnosis.prepare import AS_LARGE, CLEARLY_LESS, Unjudged
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.search import refitted
from pamrs.effects import EFFECTS
from pamrs.errors import PamrsError
from pamrs.findings import BlockMismatch, ChannelError, FreeRun, OtherLaw, Trace
from pamrs.report.sentences import law_sentence
from pamrs.rig import OtherChoice, Rig, other_choices

Divided = tuple[Problem, Problem, list[Unjudged]]
"""Recordings to fit, held-out ones, and blocks that are not judged."""


def promising_laws(
    rig: Rig, problem: Problem, stated_diagnosis: Diagnosis, prepared: Callable[[Rig], Divided]
) -> Iterator[tuple[OtherChoice, Divided]]:
    """The other law of the gas, and of the muscle, whose baseline misses suspect blocks least, by
    clearly less than that of the rig file, with the recordings under it.

    Parameters
    ----------
    rig : Rig
        The rig file's model.
    problem : Problem
        Recordings to fit.
    stated_diagnosis : Diagnosis
        Their diagnosis under the laws of the rig file.
    prepared : callable
        The recordings under another rig.
    """
    suspects, found = {part.block for part in stated_diagnosis.answer.parts}, stated_diagnosis.rig
    for mechanical in (False, True):
        blocks = [b for b in problem.blocks if b.mechanical == mechanical]
        if not any(b.name in suspects for b in blocks):
            continue
        names = [b.name for b in blocks]
        best, least = None, math.inf
        for choice in other_choices(rig, ("muscle",) if mechanical else ("chamber", "valve")):
            if _is_an_effect(choice):
                continue
            try:
                divided = prepared(choice.rig)
                missed = _missed(choice.rig, divided[0], names, briefly=True)
            except PamrsError:
                continue  # a rig that these recordings cannot be of
            if missed < least:
                best, least = (choice, divided), missed
        if best is None:
            continue
        with suppress(PamrsError):  # only the one that is left is refitted to its end
            missed = _missed(best[0].rig, best[1][0], names)
            if missed < CLEARLY_LESS * _missed(rig, problem, names) and (
                _can_be_beaten(stated_diagnosis)
                or missed
                < AS_LARGE**2 * _missed(found if isinstance(found, Rig) else rig, problem, names)
            ):
                yield best


def _can_be_beaten(stated: Diagnosis) -> bool:
    """True where an answer under another law could leave clearly less than this one, or have fewer
    names and still one: else only a law that needs none is better.
    """
    before = _noises(stated.proven, [m.channel for m in _mismatches(stated)])
    return CLEARLY_LESS * before**2 > 1.0 or names_open(stated) > 1


def _is_an_effect(choice: OtherChoice) -> bool:
    """True where the other law is the equation of an effect, which has its name and rivals then."""
    kind = choice.name.partition(".")[0]
    own = (effect for effect in EFFECTS.values() if effect.block == kind)
    return any(form.name == choice.other for effect in own for form in effect.forms)


def _missed(rig: Rig, problem: Problem, names: Sequence[str], *, briefly: bool = False) -> float:
    """Sum of squares that some blocks leave, refitted inside their tolerances (to their end, or in
    the few evaluations of a first fit); infinite where one is not there.
    """
    blocks = [b for b in problem.blocks if b.name in names]
    if len(blocks) < len(names):
        return math.inf
    part, inflation = replace(problem, blocks=blocks), no_inflation(blocks)
    found = fit(part, rig, (), {}, inflation) if briefly else refitted(part, rig, inflation)
    return 2.0 * found.cost


def is_better(other: Diagnosis, stated: Diagnosis) -> bool:
    """True where an answer under another law leaves clearly less of the channels that the answer
    under the stated law misses, or no more of them with fewer names; with physics without a name it
    is no better, as any law that bends more takes some of that.
    """
    if other.answer.verdict == "unlisted":
        return False
    channels = [m.channel for m in _mismatches(stated)]
    now, before = (_noises(d.proven, channels) for d in (other, stated))
    return now**2 < CLEARLY_LESS * before**2 or (
        names_open(other) < names_open(stated) and now < AS_LARGE * before
    )


def names_open(diagnosis: Diagnosis) -> int:
    """Count of what an answer names; a block whose values lie where they hardly can is as much in
    question as one with a name.
    """
    return max(len(diagnosis.answer.named), len(diagnosis.answer.parts))


def _mismatches(diagnosis: Diagnosis) -> list[BlockMismatch]:
    """Mismatches of the groups of blocks in which something is or may be missing or wrong."""
    return [m for part in diagnosis.answer.parts for m in part.group.mismatch]


def _noises(errors: Mapping[str, ChannelError], channels: Sequence[str]) -> float:
    """Root mean square error of some channels under a final model [noise levels], at least 1."""
    sizes = [errors[c].after / errors[c].noise for c in channels if c in errors]
    return max(1.0, math.sqrt(math.fsum(x * x for x in sizes) / max(1, len(sizes))))


def under(choice: OtherChoice, other: Diagnosis, stated: Diagnosis) -> Diagnosis:
    """Diagnosis under another law that names this law; its errors ``before`` are those of the
    user's model, under the law of the rig file.
    """
    proven, before = other.proven, stated.proven
    both = [m for m in _mismatches(stated) if m.channel in proven and m.channel in before]
    most = max(both, key=lambda m: before[m.channel].refit / before[m.channel].noise)
    sizes = before[most.channel].refit, proven[most.channel].refit, proven[most.channel].noise
    law = OtherLaw(choice.name, choice.stated, choice.other, most.channel, most.unit, *sizes)
    fit = replace(
        other.fit,
        channels=_with_before(other.fit.channels, stated.fit.channels),
        held_out=_with_before(other.fit.held_out, stated.fit.held_out),
    )
    runs = None if other.free_run is None else _runs(other.free_run, stated.free_run or [])
    return replace(
        other,
        text=f"{law_sentence(law)}. With it: {other.text}",
        laws=[law],
        fit=fit,
        traces=_traces(other.traces, stated.traces),
        free_run=runs,
        free_traces=_traces(other.free_traces, stated.free_traces),
    )


def _with_before(
    errors: Mapping[str, ChannelError], stated: Mapping[str, ChannelError]
) -> dict[str, ChannelError]:
    """Errors whose first column is that of the user's model."""
    return {
        c: replace(error, before=stated[c].before) if c in stated else error
        for c, error in errors.items()
    }


def _traces(traces: Sequence[Trace], stated: Sequence[Trace]) -> list[Trace]:
    """Channels whose first simulation is that of the user's model."""
    shown = {(t.recording, t.channel, t.time.shape): t.before for t in stated}
    return [
        replace(t, before=shown.get((t.recording, t.channel, t.time.shape), t.before))
        for t in traces
    ]


def _runs(runs: Sequence[FreeRun], stated: Sequence[FreeRun]) -> list[FreeRun]:
    """Free runs whose first column is that of the user's model."""
    before = {(run.recording, c): e for run in stated for c, e in run.channels.items()}
    with_before = []
    for run in runs:
        channels = dict(run.channels)
        for c, error in run.channels.items():
            stated_error = before.get((run.recording, c), error)
            channels[c] = replace(
                error, before=stated_error.before, cut_before=stated_error.cut_before
            )
        with_before.append(replace(run, channels=channels))
    return with_before
