"""Sentences on single entries of the findings: sizes, errors, values, budgets, data."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from pamrs.channels import unit_of
from pamrs.effects import EFFECTS, find_parameter
from pamrs.findings import (
    MENDED,
    MOST_MISSED,
    NOISE_LEVELS,
    YOURS,
    BlockMismatch,
    BudgetTerm,
    ChannelError,
    Considered,
    EffectFound,
    EffectParameterFound,
    Findings,
    FreeRunError,
    Limit,
    Missed,
    OtherLaw,
    PairExperiment,
    Unexplained,
    WrongParameter,
    explained,
    left_of,
)
from pamrs.report.words import (
    bench_unit,
    blocks_label,
    capital,
    display_unit,
    effect_name,
    format_interval,
    format_number,
    format_probability,
    format_share,
    format_uncertain,
    grouped,
    hypothesis_label,
    in_one_unit,
    is_number,
    is_telling,
    label,
    listed,
    plain,
    set_label,
    sized,
    span95,
    spoken_name,
    term_label,
    with_article,
)
from pamrs.rig import Units
from pamrs.units import from_si, with_unit

BUDGET_NOTE = (
    "Shares are of the variance that the nominal model leaves beyond the noise; all values are "
    "those of the final model. Parameters come first, the rest goes to the names, in proportion "
    "to the squares of what each changes in the prediction. A share below 0 % makes the "
    "prediction worse; others are then above 100 %."
)
"""Explanation of the shares of a budget."""
LEFT = {
    "noise": ("only noise is left", ", noise only", "fits to the noise"),
    "error": (
        "what is left is inside the usual error of the model",
        ", inside its usual error",
        "usual error: ",
    ),
    "more": ("", "", "misses "),
}
"""Rest of a block by its kind: as a sentence where it is nothing unexplained, as a note behind its
size, and in a picture."""
DOWN_TO_NOISE = "down to the noise level"
"""Words for a model that leaves only noise of its recordings."""

_INSTRUCTION = 40  # characters that two texts share at least before they begin with one instruction
_CLEARLY_WORSE = 1.1  # ratio of two errors that is no accident of the noise
_MOST_LOGS = 3  # recordings of which a summary says what was left out


def _by_reason(reasons: Iterable[tuple[str, str]], between: str) -> str:
    """Names with the reason for each: ``a, b (no sensor); c (not read)``."""
    return "; ".join(f"{between.join(own)} ({why})" for why, own in grouped(reasons).items())


def sentence_of(wrong: WrongParameter) -> str:
    """Sentence on a wrong value of the rig file: ``chamber dead volume is 360 +- 5 cm3, not 150 +-
    23``.
    """
    found, stated, (unit, _) = wrong_values(wrong)
    return plain(f"{spoken_name(wrong.name)} is {with_unit(found, unit)}, not {stated}")


def wrong_values(wrong: WrongParameter) -> tuple[str, str, tuple[str, float]]:
    """A wrong value and that of the rig file, each with its uncertainty; the unit of both, and the
    factor to it from SI.
    """
    unit, factor = display_unit(wrong.unit, abs(wrong.nominal))
    found, stated = (
        format_uncertain(*(v * factor if is_number(v) else math.nan for v in pair))
        for pair in ((wrong.value, wrong.std), (wrong.nominal, wrong.tolerance))
    )
    return found, stated, (unit, factor)


def considered_sentence(own: Considered) -> str:
    """Sentence on a set that was asked for: ``base flexibility: probability 92 %; it leaves 0.1 %
    of the mismatch of the arm``.
    """
    names, blocks = set_label(own.names), " and ".join(map(spoken_name, own.blocks))
    if not blocks:
        return f"{names}: only noise is left in the blocks where it acts"
    if own.left is None:
        return (
            f"{names}: it was not judged in the {blocks}: a parameter of it stays "
            "inside its tolerances, it happens with another event or a wrong value, or the model "
            "cannot be run with it"
        )
    return (
        f"{names}: probability {format_probability(own.probability)}; it leaves "
        f"{plain(format_number(100.0 * own.left, 2))} % of the mismatch of the {blocks}"
    )


def kept_sentence(kept: Unexplained) -> str:
    """Sentence on what is left in a block: ``the residual of the arm is 15 times the noise level
    (0.4 deg) on held-out recordings, and no name explains it``.
    """
    nameless = kept.verdict == "unlisted"
    why = "no name explains it" if nameless else "what is named does not explain it"
    times = plain(format_number(kept.noises, 2))
    on = {"held_out": " on held-out recordings", "fit": " on the fitted recordings"}
    return (
        f"the residual of the {spoken_name(kept.block)} is {times} times the noise level "
        f"({sized(kept.size, kept.unit)}){on.get(kept.role, '')}, and {why}"
    )


def forms_in_words(diagnosis: Findings) -> list[str]:
    """Forms of what has no name, and of what named equations lack, each once."""
    own = [entry.form for entry in diagnosis.unexplained]
    own += [effect.correction for effect in diagnosis.effects]
    return list(dict.fromkeys(filter(None, own)))


def kept_details(kept: Unexplained) -> str:
    """Sentence on what is left in a block, with its share of the budget and the conditions under
    which it is largest.
    """
    text = kept_sentence(kept)
    if is_number(kept.share) and kept.interval is not None and is_telling(kept.share):
        text += (
            f"; {format_share(kept.share)} of what the nominal model misses "
            f"({format_interval(kept.interval)})"
        )
    if kept.conditions:
        text += f"; largest under: {'; '.join(c.text for c in kept.conditions[:2])}"
    return text


def law_sentence(law: OtherLaw) -> str:
    """A law that the recordings follow instead of that of the rig file, in words."""
    before, after = (sized(size, law.unit) for size in (law.before, law.after))
    return (
        f"With {law.name} = {law.other}, not {law.stated} as in the rig file, the refitted model "
        f"misses {spoken_name(law.channel)} by {after} instead of {before}"
    )


def missed_place(own: Missed) -> str:
    """Words for the block that misses a channel, or the whole rig."""
    return f"in the {spoken_name(own.block)}" if own.block else "in the whole rig"


def missed_sentence(diagnosis: Findings, most: int | None = None) -> str:
    """Sentence on what the final model still misses; empty where noise and its error explain that.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    most : int, optional
        Channels that are named at most, then without their noise levels.
    """
    answer, by_channel = diagnosis.answer, dict[str, str]()
    for own in answer.missed:
        size = sized(own.size, own.unit)
        if most is None:
            whole = answer.model != YOURS and own.block is None and is_number(own.before)
            yours = f"; {YOURS}: {sized(own.before, own.unit)}" if whole else ""
            size += f" ({plain(format_number(own.noises, 2))} noise levels{yours})"
        sentence = f"{spoken_name(own.channel)} by {size} {missed_place(own)}"
        by_channel.setdefault(own.channel, sentence)
    if not by_channel:
        return ""
    what = "what else is missing" if answer.named else "what is missing"
    said = listed(list(by_channel.values())[:most])
    return capital(f"{with_article(answer.model)} still misses {said}; {what} was not found")


def worse_sentence(errors: Mapping[str, ChannelError]) -> str:
    """Channels that the refitted model misses by more than the model of the rig file; empty where
    there are none.
    """
    worse = [
        spoken_name(channel)
        for channel, error in errors.items()
        if is_number(error.before)
        and is_number(error.refit)
        and error.refit > _CLEARLY_WORSE * max(error.before, NOISE_LEVELS * error.noise)
    ]
    if not worse:
        return ""
    return (
        f"Values fitted to the other recordings make the {' and the '.join(worse)} worse here: "
        "values inside their tolerances do not explain the difference"
    )


class Miss(NamedTuple):
    """Root mean square error of a channel on the recordings of the proof, noise included.

    Attributes
    ----------
    noises : float
        In noise levels: 1 is what noise alone leaves.
    size : str
        With its unit.
    """

    noises: float
    size: str

    def __str__(self) -> str:
        return f"{plain(format_number(self.noises, 2))} noise levels ({self.size})"


def miss(diagnosis: Findings, channel: str | None, stage: str) -> Miss | None:
    """Error of a block's channel: the one size of a mismatch that text and page report.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    channel : str or None
        The channel.
    stage : str
        ``before`` (the model of the rig file), ``refit`` (values inside their tolerances) or
        ``after`` (with what was found).

    Returns
    -------
    Miss or None
        On held-out recordings, on the fitted ones where there are none; None where a result does
        not say.
    """
    errors = diagnosis.proven
    return None if channel not in errors else miss_of(errors[channel], channel, stage)


def miss_of(error: ChannelError, channel: str, stage: str) -> Miss | None:
    """Error of a channel by its entry in the table of errors; None where that is not known."""
    value = error[stage]
    if not is_number(value) or not is_number(error.noise) or not error.noise > 0.0:
        return None
    return Miss(value / error.noise, sized(value, unit_of(channel)))


def worst_channel(diagnosis: Findings) -> str | None:
    """The channel that the final model misses most, in noise levels."""
    found = {c: m.noises for c in diagnosis.proven if (m := miss(diagnosis, c, "after"))}
    return max(found, key=lambda channel: found[channel], default=None)


def mended_sentence(diagnosis: Findings, by: str) -> str:
    """Sentence on the errors, before and after, of blocks with a name or with a form without one.

    Parameters
    ----------
    diagnosis : Findings
    by : str
        What mends it, as the begin of the sentence: ``With it``.

    Returns
    -------
    str
        Empty where the errors are not known, and where nothing is mended.
    """
    answer, changes = diagnosis.answer, list[str]()
    mended = {m.block: m.channel for b in diagnosis.judged for m in b.mismatch}
    blocks = [p.block for p in answer.parts if p.names or answer.model == MENDED]
    own = [mended[block] for block in blocks if block in mended]
    for channel in own or [diagnosis.where.channel or ""]:
        before, after = (miss(diagnosis, channel, stage) for stage in ("refit", "after"))
        if before and after and after.noises < before.noises:
            changes.append(f"{spoken_name(channel)} by {after} instead of {before}")
    if not changes:
        return ""
    return f"{by} the model misses {' and '.join(changes)}, on {diagnosis.proof}."


def left_in(diagnosis: Findings, block: str, stage: str = "after") -> str:
    """Kind of what is left in a block with the final model, as :func:`pamrs.findings.left_of` has
    it; empty where a result does not say.
    """
    own = next((m for b in diagnosis.judged for m in b.mismatch if m.block == block), None)
    if own is None:
        return ""
    part = diagnosis.answer.part_of(block)
    healthy = part in diagnosis.answer.quiet
    left = left_of(own, diagnosis.proven.get(own.channel), stage, healthy=healthy)
    # what is said to be missing is no error of the model
    missing = left == "error" and part is not None and part.group.verdict == "unlisted"
    return "more" if missing else left


def _healthy_misses(diagnosis: Findings) -> Iterator[tuple[BlockMismatch, str, Miss]]:
    """Blocks of which nothing is missing, each with the kind of what is left in it and its error,
    where a result says both.
    """
    for own in (m for part in diagnosis.answer.quiet for m in part.group.mismatch):
        left, found = left_in(diagnosis, own.block), miss(diagnosis, own.channel, "after")
        if left and found:
            yield own, left, found


def _within(diagnosis: Findings, own: BlockMismatch, found: Miss) -> str:
    """Words for an error that is the usual one of a model."""
    most = explained(diagnosis.proven[own.channel].noise, own.model_error)
    sizes = f"{found.size} of up to {sized(most, own.unit)}"
    return f"to within its usual error ({spoken_name(own.channel)} {sizes})"


def within_error(diagnosis: Findings) -> list[str]:
    """Groups of which nothing is missing, though they miss much, inside the error of their model,
    where other groups lack something: ``the arm fits to within its usual error (joint angle 1.2 deg
    of up to 3.8 deg)``.
    """
    return [
        f"the {spoken_name(own.block)} fits {_within(diagnosis, own, found)}"
        for own, left, found in _healthy_misses(diagnosis)
        if diagnosis.answer.parts and left == "error" and found.noises > MOST_MISSED
    ]


def down_to(diagnosis: Findings) -> str:
    """Words on how closely a model without anything missing explains the recordings: ``down to the
    noise level``, or to within the error that is taken for its own where it misses more than noise.
    """
    missed = [entry for entry in _healthy_misses(diagnosis) if entry[1] != "noise"]
    if not missed:
        return DOWN_TO_NOISE
    own, left, found = max(missed, key=lambda entry: entry[2].noises)
    if left == "more":
        return f"to within {found} of {spoken_name(own.channel)}"
    return _within(diagnosis, own, found)


def not_judged_words(diagnosis: Findings) -> list[str]:
    """Blocks that were not judged, by their reasons: ``not judged: supply (supply_pressure is not
    in every recording)``.
    """
    blocks = [(block.reason, block.covers or blocks_label(block)) for block in diagnosis.not_judged]
    return [f"not judged: {_by_reason(blocks, ' and ')}"] if blocks else []


def limit_sizes(limit: Limit, units: Units | None = None) -> list[str]:
    """Typical size of an effect and those from which it is seen and told apart, in the units of a
    bench or those of a rig file; empty where there is none.
    """
    scaled = find_parameter(limit.size) if limit.size else None
    si, most = (scaled.unit, "up to " * scaled.restricts) if scaled else ("1", "")
    found = []
    for size, least in ((limit.typical, ""), (limit.seen_from, most), (limit.named_from, most)):
        if not is_number(size):
            found.append("")
        elif units is None:
            unit, factor = bench_unit(limit.size, si, size)
            found.append(with_unit(least + format_number(factor * size, 2), unit))
        else:
            unit = units.usual(si)
            found.append(with_unit(f"{least}{from_si(size, unit, si, difference=True):.2g}", unit))
    return found


def shown_stages(diagnosis: Findings) -> dict[str, str]:
    """The columns of a table of errors by their keys: the final model has one of its own where it
    is another one than those before.
    """
    first = {"noise": "noise", "before": YOURS, "refit": "refitted"}
    return first | ({"after": "mended"} if diagnosis.answer.model == MENDED else {})


def effect_heading(diagnosis: Findings, effect: EffectFound) -> str:
    """Name and form of an effect, marked where it only comes closest and is not named."""
    return closest_mark(diagnosis, effect) + effect_name(effect, form=True)


def closest_mark(diagnosis: Findings, effect: EffectFound) -> str:
    """Words before an effect that only comes closest; empty before one that is named."""
    return "" if effect.term in diagnosis.answer.named else "not named, but closest: "


def undetermined(effect: EffectFound) -> list[str]:
    """The parameters of an effect that the recordings do not determine."""
    return [
        name
        for name, own in effect.parameters.items()
        if own.identifiable is False or not is_number(own.value)
    ]


def undetermined_sentence(effect: EffectFound) -> str:
    """Sentence on the parameters of an effect that the recordings do not determine, if any."""
    names = ", ".join(map(label, undetermined(effect)))
    return f"these recordings do not determine {names}" if names else ""


def effect_values(
    effect: EffectFound, *, own_units: bool = False
) -> list[tuple[str, EffectParameterFound, str]]:
    """The parameters of an effect that the recordings determine: name, entry, and the value as a
    bench has it with its 95 % interval (``5.2 (4.9 to 5.5) l/min at 3 bar``), a choice in words;
    with ``own_units`` in those alone that parameters have there.
    """
    vague = undetermined(effect)
    return [
        (name, own, _on_bench(effect, name, own_units=own_units) or value_words(effect, name))
        for name, own in effect.parameters.items()
        if name not in vague
    ]


def _on_bench(effect: EffectFound, name: str, *, own_units: bool) -> str:
    """Value of a parameter with its interval in the unit of a bench; empty of a choice."""
    info, own = EFFECTS.get(effect.id), effect.parameters[name]
    bench = info.on_bench(name, effect.form) if info else None
    if not own.std or (own_units and not bench):
        return ""
    mixed = effect.parameters.get(bench.mixed_by) if bench else None
    unit, factor = bench_unit(
        f"{effect.id}.{name}", own.unit, abs(own.value), effect.form, mixed.value if mixed else 0.0
    )
    value, *bounds = (format_number(v * factor, 2) for v in (own.value, *(span95(own) or ())))
    return with_unit(f"{value} ({' to '.join(bounds)})" if bounds else value, unit)


def value_words(effect: EffectFound, name: str) -> str:
    """Words for the value of a choice, ``the gauge is at the valve``; a number in the unit that
    people read, empty where that is the SI unit.
    """
    info = EFFECTS.get(effect.id)
    form = info.form(effect.form) if info else None
    own = next((p for p in form.parameters if p.name == name), None) if form else None
    found = effect.parameters[name]
    if not is_number(found.value):
        return ""
    if own is None or own.role != "choice":
        unit, factor = display_unit(found.unit, found.value)
        return "" if unit == found.unit else f"{format_number(factor * found.value)} {unit}"
    meanings: dict[str, str] = dict(re.findall(r"(\d)(?: \([^)]*\))?: ([^,]+)", own.meaning))
    return meanings.get(f"{found.value:.0f}", "")


def budgets(diagnosis: Findings) -> dict[str, list[BudgetTerm]]:
    """The terms of each block's budget, by its name."""
    blocks = dict.fromkeys(term.block for term in diagnosis.budget)
    return {name: [t for t in diagnosis.budget if t.block == name] for name in blocks}


def budget_sentences(diagnosis: Findings) -> list[tuple[str, str]]:
    """Each block with a budget and that in words."""
    return [
        (block, budget_sentence(own, left_in(diagnosis, block)))
        for block, own in budgets(diagnosis).items()
    ]


def budget_lines(diagnosis: Findings) -> list[str]:
    """Sentences on what takes the mismatch of each block."""
    return [
        plain(f"Budget of the {spoken_name(block)}: {sentence}")
        for block, sentence in budget_sentences(diagnosis)
    ]


def budget_note(diagnosis: Findings) -> list[str]:
    """Explanation of the shares; none where parameters alone take all: nothing can be misread."""
    misread = any(
        term.kind != "parameters" or not 0.0 <= term.share <= 1.0
        for term in diagnosis.budget
        if term.kind != "unexplained"
    )
    return [f"({BUDGET_NOTE})"] * misread


def budget_sentence(terms: Sequence[BudgetTerm], left: str = "") -> str:
    """Sentence on the budget of one block; its rest is called what it is, where that is known
    (``noise``, ``error``, ``more``).
    """
    *before, (_, last) = reported_terms(terms)
    shares = [
        f"{name} {format_share(term.share)} ({format_interval(term.interval)})"
        for name, term in before
        if is_telling(term.share)
    ]
    share = f"{format_share(last.share)} unexplained"
    if not is_telling(last.share):
        share = "more is unexplained than with the nominal model"
    left = left or ("more" if last.noises > 0.0 else "noise")
    return "; ".join([*shares, LEFT[left][0] or share]) + "."


def reported_terms(terms: Sequence[BudgetTerm]) -> list[tuple[str, BudgetTerm]]:
    """Terms of a block's budget that are reported, each with its name: as they are, or together
    where one takes back what another one spoils, so that shares of single ones say nothing.
    """
    *before, last = terms
    if all(is_telling(term.share) for term in before):
        return [(term_label(term), term) for term in terms]
    low, high = last.interval  # of every draw all shares add up to 1
    whole = replace(
        before[-1],
        kind=next((t.kind for t in before if t.kind != "parameters"), "parameters"),
        share=1.0 - last.share,
        interval=[1.0 - high, 1.0 - low],
    )
    names = " and ".join(dict.fromkeys(map(term_label, before)))
    return [(f"{names} together" if len(before) > 1 else names, whole), (term_label(last), last)]


def pair_texts(diagnosis: Findings) -> list[tuple[PairExperiment, str, str]]:
    """Each two hypotheses that are left open, as a question, and what separates them; an
    instruction that was given before is not given again.
    """
    own = diagnosis.next_experiment
    before = {own.text: "The same experiment."}
    found = []
    for pair in (pair for pair in own.pairs if pair.text != own.text):
        shared, first = max(
            ((_shared(pair.text, text), short) for text, short in before.items()),
            key=lambda both: both[0],
        )
        shown = pair.text
        if shared:
            shown = f"{first} {capital(pair.text[shared:].lstrip(' .;:'))}".strip()
        between = " or ".join(map(hypothesis_label, pair.between))
        found.append((pair, f"{between}?", shown))
        before.setdefault(pair.text, f"The experiment for {between}.")
    return found


def leading_pairs(diagnosis: Findings) -> list[str]:
    """Questions between the leading hypothesis and others, with what separates them."""
    own = diagnosis.next_experiment
    return [
        f"{question} {text}"
        for pair, question, text in pair_texts(diagnosis)
        if own.text and own.pairs[0].between[0] in pair.between
    ]


def _shared(one: str, other: str) -> int:
    """Length of the instruction with which two texts begin: up to the end of a part of a sentence
    in both; 0 where it is too short to be one.
    """
    common = len(os.path.commonprefix([one, other]))
    ends = [
        n
        for n in range(_INSTRUCTION, common + 1)
        if all(not text[n:] or re.match(r"[.;](\s|$)", text[n:]) for text in (one, other))
    ]
    return max(ends, default=0)


def left_out_sentence(diagnosis: Findings) -> str:
    """Sentence on what of the recordings was left out, mended or masked, with its counts.

    Parameters
    ----------
    diagnosis : Findings
        What was found.

    Returns
    -------
    str
        Empty where all of them was used as it was written.
    """
    lines = []
    for own in diagnosis.data:
        masked = grouped((max(round(v * own.samples), 1), name) for name, v in own.masked.items())
        parts = [
            *own.read,
            *(f"{', '.join(n)}: {k} of {own.samples} samples masked" for k, n in masked.items()),
        ]
        if parts:
            lines.append(f"{own.recording}: {'; '.join(parts)}")
    if not lines:
        return ""
    more = len(lines) - _MOST_LOGS
    rest = f". The same of {more} more recordings" if more > 0 else ""
    return f"As read: {'. '.join(lines[:_MOST_LOGS])}{rest}"


def data_sentence(diagnosis: Findings) -> str:
    """Recordings, rates and channels that the answer rests on, and channels that were not used.

    Parameters
    ----------
    diagnosis : Findings
        What was found.

    Returns
    -------
    str
        Empty where the result does not say.
    """
    data = diagnosis.data
    if not data:
        return ""
    rates = dict.fromkeys(
        f"{1.0 / own.sample_time:.4g} Hz"
        + (
            f" (means of {own.averaged} samples recorded at "
            f"{own.averaged / own.sample_time:.4g} Hz)"
            if own.averaged > 1
            else ""
        )
        for own in data
    )
    seconds = sum(own.samples * own.sample_time for own in data)
    count = f"{len(data)} recording{'s' if len(data) > 1 else ''}"
    used = dict.fromkeys(name for own in data for name in own.used)
    text = f"Data: {count}, {seconds:.4g} s at {' and '.join(rates)}; used: {', '.join(used)}"
    text += "".join(
        f"; {own.recording} with {', '.join(f'{n} = {v:.4g}' for n, v in own.parameters.items())}"
        for own in data
        if own.parameters
    )
    unused = {name: why for own in data for name, why in own.unused.items()}
    reasons = _by_reason([(why, name) for name, why in unused.items()], ", ")
    return f"{text}; recorded but not used: {reasons}" if reasons else text


def free_run_sentences(diagnosis: Findings) -> list[str]:
    """The whole rig from its commands alone, a sentence for each of the first recordings."""
    texts, stages = [], 1 if diagnosis.answer.model == YOURS else 2
    for run in (diagnosis.free_run or [])[:2]:
        errors = []
        for channel, error in run.channels.items():
            sizes, unit = in_one_unit(error.unit, [error.before, error.after][:stages])
            errors.append(f"{channel} {' to '.join(sizes)} {unit}")
        texts.append(f"Whole rig from its commands alone, {run.recording}: {'; '.join(errors)}")
    return list(map(plain, texts))


def free_run_words(error: FreeRunError, factor: float, final: str) -> str:
    """Words behind the title of a curve on the errors of your model and of the final one."""
    before, after = (format_number(v * factor, 2) for v in (error.before, error.after))
    return f": missed by {before}, {final.split()[0]} {after}"


def refit_words(diagnosis: Findings, block: str, channel: str | None) -> tuple[str, str]:
    """Kind of what the refitted model leaves in a block, and how far that is from the noise."""
    left, missed = left_in(diagnosis, block, "refit"), miss(diagnosis, channel, "refit")
    times = format_number(missed.noises, 2) if missed else ""
    left = "noise" if times == "1.0" else left
    size = f"{LEFT[left][2]}{times} × noise" if times and left in LEFT else ""
    return left, LEFT["noise"][2] if left == "noise" else size
