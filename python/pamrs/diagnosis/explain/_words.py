"""Sentences on where the mismatch lies, and warnings for the reader."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pamrs.channels import channel_of, unit_of
from pamrs.diagnosis.evidence import FittedHypothesis, Judged, parameters_at_wall
from pamrs.diagnosis.explain._conditions import Picture
from pamrs.diagnosis.fit import Problem, concerns
from pamrs.diagnosis.model import spoiled_channels
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.search import FAR_TOLERANCES
from pamrs.effects import CATALOGUE, UNDECIDED, UNLISTED
from pamrs.findings import Answer, ChannelError, ParameterFound, Where
from pamrs.recordings import Case
from pamrs.report.sentences import miss_of, unknown_volumes
from pamrs.report.words import format_probability, sized_alike, spoken_block, spoken_name
from pamrs.rig.schema import split_name
from pamrs.units import in_words

# share of the ambient pressure within which a recording that begins at it may be absolute
_AMBIENT_SHARE = 0.01
# [Pa] gauge pressure that a channel never exceeds, below which its unit is questioned
_DOUBTED_PRESSURE = 1e4
# probability of no mismatch from which the text says that there may be none
_NO_MISMATCH_PROBABILITY = 0.1
# share of the excess over share of the time from which a condition is named
TELLING_CONDITION = 1.15


def where(
    answer: Answer,
    problem: Problem,
    judged: list[Judged],
    picture: Picture,
    errors: dict[str, dict[str, ChannelError]],
) -> Where:
    """Entry ``where`` of a result: block, channel, intervals, conditions and a sentence, which has
    the block's error of the table of ``errors`` that proves the answer.
    """
    groups, located = [j.group for j in judged], answer.block
    if located is None:
        text = (
            "After the refit, no block's residual is above the noise level, with the error that is "
            "taken for the model's own."
        )
        if answer.missed:
            text += " From its commands alone the whole rig misses more."
        return Where(text=text)
    block = next(b for b in problem.blocks if b.name == located)
    proof = errors["held_out"] or errors["fit"]
    missed = miss_of(proof[block.channel], block.channel, "refit")
    place = spoken_block(located)
    parts = "" if block.covers == located else f" ({block.covers})"
    chance = _missing_there(block, judged)
    sure = f", probability {format_probability(chance)}" if chance > 0.5 else ""
    text = (
        f"The mismatch lies in the {place}{parts}{sure}. With the measured signals of its "
        f"neighbours as inputs, the refitted model misses {spoken_name(block.channel)} by "
        f"{missed} on {'held-out' if errors['held_out'] else 'the fitted'} recordings."
    )
    group = next((g for g in groups if g.mismatch and g.mismatch.name == located), None)
    wrong = next((j.wrong for j in judged if block in j.group.blocks), ())
    if wrong and group is None:
        text = (
            f"The {place}{parts} fits down to the noise level, but only with parameters at "
            "the ends of their tolerances. With another value of the "
            f"{' and the '.join(map(spoken_name, wrong))} they return to their nominal values."
        )
    elif group is not None and group.probabilities.get(UNDECIDED, 0.0) > _NO_MISMATCH_PROBABILITY:
        text = (
            f"The residual of the {place}{parts} is barely above the noise level "
            f"(it misses {spoken_name(block.channel)} by {missed}). "
            "The noise level may have been estimated too low."
        )
    elif all(g.mismatch is None for g in groups):
        text = (
            f"Every block fits down to the noise level, but the {place} only with a "
            "parameter far outside its tolerance (see the warnings)."
        )
    telling = [c for c in picture.conditions if c.share > TELLING_CONDITION * c.time][:2]
    if telling:
        text += " The mismatch is largest under: " + "; ".join(c.text for c in telling) + "."
    return Where(
        block=located,
        channel=block.channel,
        probability=round(chance, 4),
        intervals=picture.intervals,
        conditions=picture.conditions[:6],
        text=text,
        recording=picture.recording,
    )


def _missing_there(block: Block, judged: list[Judged]) -> float:
    """Probability that something is missing in a block, or a value of the rig file wrong."""
    total = 0.0
    for found in (j for j in judged if block in j.group.blocks):
        suspected = block in found.group.suspects
        for hypothesis, chance in found.probabilities.items():
            named = any(concerns(term, block) for term in hypothesis.terms)
            total += chance * (named or (suspected and hypothesis == UNLISTED))
    return min(1.0, total)


def left_out(case: Case, judged: list[Judged]) -> list[str]:
    """Warnings of values that are exactly 0 in the rig file while a named effect has their law."""
    named = [effect for j in judged for effect in j.named]
    return [
        f"{name} is exactly 0 in the rig file and would do nearly what {effect} does: write what "
        "is known of it, a value and a tolerance (tol), and diagnose again"
        for effect in named
        for name, known in case.rig.parameters.items()
        for block, _, key in [split_name(name)]
        if known.value == known.tol == 0.0 and f"{block}.{key}" in effect.info.like_values
    ]


def warnings(
    case: Case,
    judged: list[Judged],
    parameters: Mapping[str, ParameterFound],
    no_held_out: bool,
) -> list[str]:
    """Warnings about the data and the fit."""
    out = []
    mistaken = any(j.wrong for j in judged)
    symptoms = {
        name: far
        for j in judged
        if not j.wrong
        for name, far in parameters_at_wall(j.group.candidates[0].fit).items()
    }
    for recording in case.recordings:
        for channel, values in recording.channels.items():
            if (
                channel_of(channel) not in ("muscle_pressure", "supply_pressure")
                or not recording.mask[channel].any()
            ):
                continue
            largest = float(np.nanmax(np.abs(values[recording.mask[channel]])))
            if largest < _DOUBTED_PRESSURE:
                out.append(
                    f"{recording.name}: {channel} never exceeds "
                    f"{in_words(recording.said.get(channel, ''), 'Pa', largest)} gauge, next to "
                    "nothing for a muscle or a tank: is the unit in its header the one its values "
                    "are in?"
                )
    for name, value in sorted(symptoms.items(), key=lambda kv: -abs(kv[1])):
        if name in parameters and not parameters[name].known:
            continue
        what = (
            "a symptom of another wrong value or of missing physics"
            if mistaken
            else "a symptom of missing physics"
        )
        out.append(
            f"the refit without effects moves {name} by {value:+.1f} tolerances: {what}, not a "
            "result"
        )
    if no_held_out:
        how = (
            "; names are judged by how the other recordings predict each"
            if len(case.recordings) > 1
            else ""
        )
        out.append(
            f"there is no held-out recording: the proof is on the fitted data and counts less{how}"
        )
    for name in unknown_volumes(case.rig):
        out.append(
            f"{name} is marked unknown: values that scale with it hold for the placeholder only"
        )
    # what was only masked comes last
    for recording in case.recordings:
        issues = [issue for issue in recording.issues if issue.kind != "log"]  # said with the data
        for issue in issues[:8]:
            when = f"{issue.start:g} to {issue.stop:g} s"
            out.append(f"{recording.name}: {issue.kind} in {issue.channel}, {when}: {issue.text}")
        if len(issues) > 8:
            out.append(f"{recording.name}: {len(issues) - 8} more issues of this kind")
    return out


def absolute(case: Case) -> list[str]:
    """Warnings of muscle pressures that begin at one atmosphere in every recording."""
    ambient = float(case.rig.model["gas"]["ambient_pressure"])
    firsts, units = dict[str, list[float]](), dict[str, str]()
    for recording in case.recordings:
        for channel, values in recording.channels.items():
            rows = recording.mask[channel]
            if channel_of(channel) == "muscle_pressure" and rows.any():
                units[channel] = recording.said.get(channel, "")
                firsts.setdefault(channel, []).append(float(values[rows][0]))
    return [
        f"{channel} begins at {in_words(units[channel], 'Pa', float(np.mean(first_values)))} in "
        "every recording, one atmosphere (gas.ambient_pressure = "
        f"{case.rig.units.said('gas.ambient_pressure', 'Pa', ambient, digits='.6g')}): are these "
        "absolute pressures? Gauge pressures are needed; what is found below may be no more than "
        "the difference"
        for channel, first_values in firsts.items()
        if all(abs(first - ambient) < _AMBIENT_SHARE * ambient for first in first_values)
    ]


def worse(table: dict[str, ChannelError]) -> list[str]:
    """Warnings of channels that the new model predicts worse than the nominal or refitted one."""
    out = []
    for channel in spoiled_channels(table):
        error = table[channel]
        better, which = min((error.before, "nominal"), (error.refit, "refitted"))
        now, was = sized_alike([error.after, better], unit_of(channel))
        out.append(
            f"the new model misses {spoken_name(channel)} by {now}, the {which} one by {was}: "
            "the values of this fit spoil the channel"
        )
    return out


def reservations(chosen: list[FittedHypothesis]) -> list[str]:
    """Warnings of parameters that a fit with a named effect moved far."""
    named = [c for c in chosen if any(effect.id in CATALOGUE for effect in c.effects)]
    moved = {n: v for c in named for n, v in c.fit.held_by_prior.items() if abs(v) > FAR_TOLERANCES}
    return [
        f"with the effect the fit moves {n} by {v:+.1f} tolerances: it may compensate for the "
        "effect's form"
        for n, v in moved.items()
    ]
