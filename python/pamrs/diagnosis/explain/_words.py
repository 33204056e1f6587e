"""The diagnosis in words: where, what, how sure, what next."""

from __future__ import annotations

import numpy as np

from pamrs.channels import channel_of, unit_of
from pamrs.diagnosis.evidence import Candidate, Judged, symptoms_of
from pamrs.diagnosis.explain._conditions import Picture
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.model import spoiled
from pamrs.effects import CATALOGUE, id_of
from pamrs.findings import BlockVerdict, ChannelError, Findings, Where
from pamrs.recordings import Case
from pamrs.report.text import (
    display_unit,
    effect_name,
    format_number,
    format_probability,
    gap_sentence,
    is_number,
    is_open,
    judged_place,
    kept_sentence,
    leading,
    name_chance,
    not_judged_words,
    off_sentence,
    sentence_of,
    spoken_block,
    spoken_name,
    told_apart,
)
from pamrs.rig import Rig
from pamrs.rig.schema import qualified

__all__ = [
    "absolute",
    "reservations",
    "unknown_volumes",
    "verdict",
    "warnings",
    "where",
    "worse",
]

# [noise levels] error of a model with a name from which it is reported with a reservation
_MISSED_NOISES = 3.0
_MOVED_TOLERANCES = 2.0  # [tolerances] movement of a parameter beside an effect from which it is
_MENDED = 0.98  # share of a channel's error from which a wrong value is not said to mend it
# relative scatter of an effect's size between recordings that is reported, as in evidence
_SCATTER = 0.35
# share of the ambient pressure within which a recording that begins at it may be absolute
_AMBIENT_SHARE = 0.01
# [Pa] gauge pressure that a channel never exceeds, below which its unit is questioned
_LEAST_PRESSURE = 1e4
# probability of no mismatch from which the text says that there may be none
_NO_MISMATCH_PROBABILITY = 0.1
# share of the excess over share of the time from which a condition is told
TELLING_CONDITION = 1.15


def unknown_volumes(rig: Rig) -> list[str]:
    """Dotted names of the chambers' volumes that the rig file marks unknown."""
    names = [f"{qualified('chamber', name)}.dead_volume" for name in rig.tables("chamber")]
    return [name for name in names if not rig.parameter(name).known]


def where(located: str | None, problem: Problem, judged: list[Judged], picture: Picture) -> Where:
    """The ``where`` entry: block, channel, intervals, conditions and a sentence."""
    groups = [j.group for j in judged]
    if located is None:
        text = "After the refit, no block's residual is above the noise level."
        return Where(text=text)
    block = next(b for b in problem.blocks if b.name == located)
    found = next(g.baseline[located] for g in groups if located in g.baseline)
    place = spoken_block(located)
    parts = "" if block.covers == located else f" ({block.covers})"
    text = (
        f"The mismatch lies in the {place}{parts}. With the measured signals of its "
        f"neighbours as inputs, the refitted model misses {spoken_name(block.channel)}: what "
        f"exceeds the noise is {found.systematic:.2g} times the noise level on the fitted "
        "recordings."
    )
    group = next((g for g in groups if g.mismatch is not None and g.mismatch.name == located), None)
    wrong = next((j.wrong for j in judged if block in j.group.blocks), ())
    below_noise = group is not None and group.below_noise
    mistaken = bool(wrong) and (group is None or below_noise)
    if mistaken:
        text = (
            f"The {place}{parts} fits down to the noise level, but only with parameters at "
            "the ends of their tolerances. With another value of the "
            f"{' and the '.join(map(spoken_name, wrong))} they return to their nominal values."
        )
    elif group is not None and group.instead:
        moved = ", ".join(
            f"{n} by {group.candidates[0].fit.moved[n]:+.1f} tolerances" for n in group.instead
        )
        text = (
            f"No block's residual is above the noise level, but the refit of the "
            f"{place}{parts} had to move {moved}. An effect explains the same data without that."
        )
    elif below_noise:
        text = (
            f"No block's residual is above the noise level, but the residual of the "
            f"{place}{parts} contains the signature of an effect, in held-out recordings too."
        )
    elif group is not None and group.probabilities.get("", 0.0) > _NO_MISMATCH_PROBABILITY:
        text = (
            f"The residual of the {place}{parts} is barely above the noise level "
            f"({found.systematic:.2g} times it in {spoken_name(block.channel)}). "
            "The noise level may have been estimated too low."
        )
    elif all(g.mismatch is None for g in groups):
        text = (
            f"Every block fits down to the noise level, but the {place} only with a "
            "parameter far outside its tolerance (see the warnings)."
        )
    telling = (
        []
        if below_noise
        else [c for c in picture.conditions if c.share > TELLING_CONDITION * c.time][:2]
    )
    if telling:
        text += " It is largest under: " + "; ".join(c.text for c in telling) + "."
    if picture.intervals and not below_noise:
        text += f" The intervals are those of recording {picture.recording}."
    return Where(
        block=located,
        channel=block.channel,
        intervals=[] if below_noise else picture.intervals,
        conditions=[] if below_noise else picture.conditions[:6],
        text=text,
        recording=picture.recording,
    )


def verdict(
    diagnosis: Findings,
    case: Case,
    forms: list[str],
    *,
    sought: bool,
) -> str:
    """The verdict in a few sentences, behind what the whole rig misses from its commands alone, and
    what was not judged; ``forms`` say what a mismatch without a name is a function of, if that was
    ``sought``.
    """
    text = _of_blocks(diagnosis, case, forms, sought=sought)
    off = off_sentence(diagnosis)
    if off:
        text = (
            f"{_capital(off)}. The values of the rig, as far as they are known, do not explain "
            f"that: something is not as the model has it, and nothing is settled. {text}"
        )
    told = [_capital(words) + "." for words in not_judged_words(diagnosis)]
    return "\n\n".join([text, *told])


def _of_blocks(
    diagnosis: Findings,
    case: Case,
    forms: list[str],
    *,
    sought: bool,
) -> str:
    """The verdict of the blocks, in a few sentences."""
    kind = diagnosis.verdict
    missing = [b for b in diagnosis.judged if b.verdict == "unlisted"]
    if kind == "none":
        text = (
            f"These recordings show no missing physics{judged_place(diagnosis)}: the nominal model "
            f"predicts {_every(diagnosis)} down to the noise level."
        )
        return text + _unsettled(diagnosis)
    if kind == "parameters" and diagnosis.wrong_parameters:
        found = _mistaken(diagnosis, case)
        by = "With this value," if len(diagnosis.wrong_parameters) == 1 else "With these values,"
        return (
            found + _closed(diagnosis, by, case) + _beside(diagnosis, missing, forms, sought=sought)
        )
    if kind == "parameters":
        shifted = sorted(diagnosis.parameters.items(), key=lambda kv: -abs(kv[1].moved_sigmas))[:3]
        moved = ", ".join(f"{n} by {p.moved_sigmas:+.1f} tolerances" for n, p in shifted)
        return (
            f"These recordings show no missing physics{judged_place(diagnosis)}, but parameters "
            "differ from their nominal values. With values inside their tolerances the model "
            f"predicts {_every(diagnosis)} down to the noise level. Moved most: {moved}."
            + _unsettled(diagnosis)
        )
    place = diagnosis.where.text
    if kind == "unlisted":
        tried = ", ".join(
            f"{e.id}{f' at {e.at}' * bool(e.at)} ({e.probability:.0%})" for e in diagnosis.effects
        )
        text = (
            "Physics is missing, and no effect of the catalogue explains the data well enough to "
            f"be named{_outside(leading(diagnosis)[1])}. {place}"
            + (f" Closest: {tried}." if tried else "")
        )
        if not forms and not sought:
            return text + (
                " No form of it was searched for: the simulator has none for a load yet."
                if case.rig.model["load"]
                else ""
            )
        if not forms:
            return text + (
                " No form of it carries over to other recordings, so the model stays the "
                "refitted one."
            )
        closes = _closed(diagnosis, "With it in the model,", case)
        return text + "\n\nWhat is missing, as a form without a name. " + " ".join(forms) + closes
    names = " and ".join(
        f"{effect_name(e)} ({e.id}, probability {name_chance(diagnosis, e)})"
        for e in diagnosis.effects
    )
    text = f"{_opening(diagnosis, 'the model leaves out')}: {names}."
    if any(diagnosis.where.block in b.blocks for b in missing):  # it leads with the larger mismatch
        text = f"{place} No listed effect explains it. In addition: {text}"
    else:
        text += f" {place}"
    it = "it" if len(diagnosis.effects) == 1 else "them"
    text += _closed(diagnosis, f"With {it},", case)
    if diagnosis.wrong_parameters:
        text += " " + _mistaken(diagnosis, case)
    if unknown_volumes(case.rig):
        text += (
            " The chamber's volume is not known. The recording determines the time constant and "
            "the conductance per volume; the conductance itself holds only for the placeholder "
            "volume of the rig file."
        )
    return text + _beside(diagnosis, missing, forms, sought=sought)


def _every(diagnosis: Findings) -> str:
    """The blocks that the verdict is about."""
    return "every block that was judged" if diagnosis.not_judged else "every block"


def _opening(diagnosis: Findings, claim: str) -> str:
    """A claim, no surer than it is: as what is most probable where other answers are left."""
    return f"Most probable is that {claim}" if is_open(diagnosis) else _capital(claim)


def _outside(chance: float) -> str:
    """How probable it is that something else acts."""
    known = is_number(chance)
    return f" (probability of an effect outside it: {format_probability(chance)})" if known else ""


def _closed(diagnosis: Findings, by: str, case: Case) -> str:
    """How much of the gap closes; empty where that is not known."""
    told = gap_sentence(diagnosis, by)
    return f" {told}, on {_proof(case)}." if told else ""


def _proof(case: Case) -> str:
    return (
        "held-out recordings"
        if case.held_out and case.fit
        else "the fitted recording (no other was given)"
    )


def _mistaken(diagnosis: Findings, case: Case) -> str:
    """Which values of the rig file are wrong, and what that does to the error."""
    told = []
    # the error is that of the model with everything that was found
    several = len(diagnosis.wrong_parameters) > 1 or diagnosis.effects
    beside = " with all that was found" if several else ""
    for wrong in diagnosis.wrong_parameters:
        mended = {
            channel: e for channel, e in wrong.held_out.items() if e.after < _MENDED * e.refit
        }
        told_by = mended or wrong.held_out
        errors = "; ".join(
            f"the {spoken_name(channel)} is then missed{beside} by "
            f"{_instead(e.after, e.refit, unit_of(channel))}, which values inside the tolerances "
            "leave"
            for channel, e in told_by.items()
        )
        told.append(
            f"{sentence_of(wrong)} (probability {name_chance(diagnosis, wrong)}, "
            f"{abs(wrong.moved_sigmas):.0f} tolerances away); on {_proof(case)} {errors}."
        )
    return f"{_opening(diagnosis, 'the rig file is wrong')}: " + " ".join(told)


def _instead(value: float, before: float, unit: str) -> str:
    """One size instead of another, in one unit."""
    shown, factor = display_unit(unit, max(value, before))
    now, was = (format_number(v * factor, 3, unicode=False) for v in (value, before))
    return f"{now} {shown} instead of {was} {shown}".replace("°", "deg")


def _beside(
    diagnosis: Findings, missing: list[BlockVerdict], forms: list[str], *, sought: bool
) -> str:
    """What stays unexplained beside a name: sets that are left, and blocks with a mismatch without
    a name.
    """
    text = _unsettled(diagnosis)
    if not missing:
        return text
    kept = [u for u in diagnosis.unexplained if u.verdict == "unlisted"]
    blocks = " and ".join(name for b in missing for name in b.blocks)
    said = [_capital(kept_sentence(u)) + "." for u in kept] or [
        f"No listed effect explains the residual in {blocks}."
    ]
    text += "\n\nWhat stays unexplained. " + " ".join(said)
    if forms:
        text += " The model contains it as a form without a name: " + " ".join(forms)
    else:
        text += " No form of it " + (
            "carries over to other recordings." if sought else "was searched for."
        )
    return text


def _unsettled(diagnosis: Findings) -> str:
    """The sets that are left, as a sentence; empty where the answer is settled."""
    if len(diagnosis.ambiguity) < 2:
        return ""
    apart = told_apart(diagnosis.ambiguity, diagnosis.probabilities)
    return f" It is not settled: these recordings cannot tell {apart}."


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def warnings(case: Case, judged: list[Judged], no_held_out: bool) -> list[str]:
    """What a reader should know about the data and the fit."""
    out = []
    groups = [j.group for j in judged]
    mistaken = any(j.wrong for j in judged)
    symptoms = {n: v for j in judged if not j.wrong for n, v in symptoms_of(j.group).items()}
    for recording in case.recordings:
        for channel, values in recording.channels.items():
            if (
                channel_of(channel) not in ("muscle_pressure", "supply_pressure")
                or not recording.mask[channel].any()
            ):
                continue
            largest = float(np.nanmax(np.abs(values[recording.mask[channel]])))
            if largest < _LEAST_PRESSURE:
                out.append(
                    f"{recording.name}: {channel} never exceeds {largest:.3g} Pa gauge, next to "
                    "nothing for a muscle or a tank: is the unit in its header the one its values "
                    "are in?"
                )
    for name, value in sorted(symptoms.items(), key=lambda kv: -abs(kv[1])):
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
    for group in groups:
        best = group.best
        if best.effects and best.scatter > _SCATTER:
            out.append(
                f"the size of {best.key} scatters by {100 * best.scatter:.0f} % between recordings"
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
    """Muscle pressures that begin at one atmosphere in every recording: they may not be gauge."""
    ambient = float(case.rig.model["gas"]["ambient_pressure"])
    firsts: dict[str, list[float]] = {}
    for recording in case.recordings:
        for channel, values in recording.channels.items():
            rows = recording.mask[channel]
            if channel_of(channel) == "muscle_pressure" and rows.any():
                firsts.setdefault(channel, []).append(float(values[rows][0]))
    return [
        f"{channel} begins at {np.mean(begun):.4g} Pa in every recording, one atmosphere "
        f"(gas.ambient_pressure = {ambient:g} Pa): are these absolute pressures? Gauge pressures "
        "are needed; what is found below may be no more than the difference"
        for channel, begun in firsts.items()
        if all(abs(first - ambient) < _AMBIENT_SHARE * ambient for first in begun)
    ]


def worse(table: dict[str, ChannelError]) -> list[str]:
    """Channels that the model with what was added predicts worse than the nominal one did, or the
    refitted one.
    """
    out = []
    for channel in spoiled(table):
        error = table[channel]
        better, which = min((error.before, "nominal"), (error.refit, "refitted"))
        unit, factor = display_unit(unit_of(channel), error.after)
        now, was = (format_number(v * factor, 3, unicode=False) for v in (error.after, better))
        out.append(
            f"the new model misses {spoken_name(channel)} by {now} {unit}, the {which} "
            f"one by {was} {unit}: the values of this fit spoil the channel".replace("°", "deg")
        )
    return out


def reservations(
    judged: list[Judged],
    chosen: list[Candidate],
    table: dict[str, ChannelError],
) -> list[str]:
    """What a reader should know of a model with a name: what it still misses where it acts, and
    values that it had to move far.
    """
    out = []
    for j in judged:
        if not (j.named or j.wrong):
            continue
        for channel in dict.fromkeys(b.channel for b in j.group.blocks):
            error = table[channel]
            if error.after <= _MISSED_NOISES * error.noise:
                continue
            what = "the effect" if j.named else "the other value"
            times = error.after / error.noise
            why = "its equation is not the whole truth" if j.named else "something else acts"
            name = "" if j.ambiguity else "the name remains, but "
            out.append(
                f"with {what} the model still misses {spoken_name(channel)} by {times:.2g} "
                f"times the noise level: {name}{why}, and standard deviations do not include that"
            )
    named = [c for c in chosen if any(id_of(effect) in CATALOGUE for effect in c.effects)]
    moved = {
        n: v for c in named for n, v in c.fit.held_by_prior.items() if abs(v) > _MOVED_TOLERANCES
    }
    out += [
        (
            f"with the effect the fit moves {n} by {v:+.1f} tolerances: it may compensate for the "
            "effect's form"
        )
        for n, v in moved.items()
    ]
    return out
