"""Words and numbers of a diagnosis: labels, number formats, the headline."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeGuard

from pamrs.channels import unit_of
from pamrs.effects import EFFECTS, Hypothesis, Term, effect_of, find_parameter
from pamrs.findings import (
    HEALTHY,
    MENDED,
    MOST_MISSED,
    NOISE_LEVELS,
    YOURS,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    Considered,
    EffectFound,
    EffectParameterFound,
    Findings,
    Limit,
    OtherLaw,
    PairExperiment,
    Part,
    Unexplained,
    WrongParameter,
    left_of,
)
from pamrs.rig import Units
from pamrs.rig.schema import BLOCKS
from pamrs.units import from_si, with_unit

_LABELS = {
    "none": "nothing missing",
    "parameters": "parameters in tolerance",
    "unlisted": "effect outside the catalogue",
    "dahl": "Dahl",
    **{effect.id: effect.label for effect in EFFECTS.values() if effect.label},
}

TELLING = 0.25
"""Distance below nothing or above everything within which a share is written as a number."""

FARTHEST = 3.0
"""Largest end of a share's interval that is written as a number."""

BUDGET_NOTE = (
    "Shares are of the variance that the nominal model leaves beyond the noise; all values are "
    "those of the final model. Parameters come first, the rest goes to the names, in proportion "
    "to the squares of what each changes in the prediction. A share below 0 % makes the "
    "prediction worse; others are then above 100 %."
)
"""Explanation of the shares of a budget."""

_INSTRUCTION = 40
"""Characters that two texts share at least before they are said to begin with one instruction."""

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DISPLAY = {
    "Pa": (("bar", 1e-5, 1e4), ("mbar", 1e-2, 0.0)),
    "rad": (("°", 180.0 / math.pi, 0.0),),
    "m": (("m", 1.0, 1.0), ("mm", 1e3, 0.0)),
    "m2": (("m2", 1.0, 1e-2), ("mm2", 1e6, 0.0)),
    "m3": (("m3", 1.0, 1.0), ("l", 1e3, 1e-3), ("cm3", 1e6, 0.0)),
    "s": (("s", 1.0, 0.1), ("ms", 1e3, 0.0)),
}


def label(identifier: str) -> str:
    """Readable name of a hypothesis, effect, block or channel id; pairs are joined by ``+``, and an
    effect at one block of several has its name behind an ``@``.
    """

    def readable(word: str) -> str:
        term = Term.parse(word)
        at = f" at {term.at.replace('_', ' ')}" if term.at else ""
        return _LABELS.get(term.id, term.id.replace("_", " ")) + at

    return " + ".join(map(readable, Hypothesis.parse(identifier).words))


def set_label(identifiers: list[str]) -> str:
    """Readable name of a hypothesis: effects that act together, parameters that are wrong."""
    if not identifiers:
        return label("none")
    return " + ".join(
        f"wrong {spoken_name(i)}" if Term.parse(i).is_value else label(i) for i in identifiers
    )


def hypothesis_label(key: str) -> str:
    """Readable name of a hypothesis by its key, names joined by ``+``."""
    return set_label(Hypothesis.parse(key).words)


def answer_label(names: Sequence[str]) -> str:
    """Readable name of the answer that leads a group: none and parameters are one answer."""
    return "no physics is missing" if names[:1] and names[0] in HEALTHY else set_label([*names])


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: ``a, b and c``."""
    return f" {last} ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def is_number(value: Any) -> TypeGuard[float]:
    """True where `value` is a finite real number (NaN, infinities, None and text are not)."""
    try:
        return value is not None and math.isfinite(float(value))
    except (TypeError, ValueError):
        return False


def display_unit(unit: str, magnitude: float) -> tuple[str, float]:
    """Unit to show a quantity in, and the factor from SI.

    Parameters
    ----------
    unit : str
        SI unit.
    magnitude : float
        Typical absolute value in SI.

    Returns
    -------
    tuple of (str, float)
        Shown unit and multiplier; SI itself when there is no handier unit.
    """
    for name, factor, least in _DISPLAY.get(unit, ()):
        if not math.isfinite(magnitude) or abs(magnitude) >= least:
            return name, factor
    return unit, 1.0


def bench_unit(
    parameter: str, unit: str, magnitude: float, form: str = "", part: float = 0.0
) -> tuple[str, float]:
    """Unit in which a bench has a parameter of an effect, and the factor from SI.

    Parameters
    ----------
    parameter : str
        Dotted name.
    unit : str
        SI unit.
    magnitude : float
        Typical absolute value in SI.
    form : str, optional
        Form of the effect; its first one by default.
    part : float, optional
        Value of the parameter that mixes two units.
    """
    effect, name = parameter.rpartition(".")[::2]
    info = EFFECTS.get(Term.parse(effect).id)
    bench = info.on_bench(name, form) if info else None
    if bench is None:
        return display_unit(unit, magnitude)
    return bench.unit, bench.factor + (bench.mixed - bench.factor) * part


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


def shown_errors(
    errors: Mapping[str, ChannelError],
) -> Iterator[tuple[str, str, float, ChannelError]]:
    """Each channel with the unit that its errors are shown in, the factor from SI, and them."""
    for channel, entry in errors.items():
        sizes = [abs(v) for v in entry.values() if is_number(v)]
        yield channel, *display_unit(unit_of(channel), max(sizes, default=math.nan)), entry


def shown_stages(diagnosis: Findings) -> dict[str, str]:
    """The columns of a table of errors by their keys: the final model has one of its own where it
    is another one than those before.
    """
    first = {"noise": "noise", "before": YOURS, "refit": "refitted"}
    return first | ({"after": "mended"} if diagnosis.answer.model == MENDED else {})


def _power(exponent: int, unicode: bool) -> str:
    return f" × 10{str(exponent).translate(_SUPERSCRIPT)}" if unicode else f"e{exponent}"


def _minus(text: str, unicode: bool) -> str:
    return text.replace("-", "−") if unicode else text


def format_number(value: Any, digits: int = 3, *, unicode: bool = True) -> str:
    """Write a number with `digits` significant figures; an en dash when it is not finite."""
    if not is_number(value):
        return "–" if unicode else "-"
    x = float(value)
    if x == 0.0:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    if -4 < exponent < 6:
        rounded = round(x, digits - 1 - exponent)
        return _minus(f"{rounded:.{max(0, digits - 1 - exponent)}f}", unicode)
    return _minus(f"{x / 10.0**exponent:.{digits - 1}f}", unicode) + _power(exponent, unicode)


def format_uncertain(value: Any, std: Any, *, unicode: bool = True) -> str:
    """Write ``value ± std``, rounded to two figures of the standard deviation."""
    if not is_number(value) or not is_number(std) or float(std) <= 0.0:
        return format_number(value, 4, unicode=unicode)
    x, s = float(value), float(std)
    pm = " ± " if unicode else " +- "
    exponent = math.floor(math.log10(max(abs(x), s)))
    scale = 0 if -4 < exponent < 6 else exponent
    x, s = x / 10.0**scale, s / 10.0**scale
    decimals = min(12, max(0, 1 - math.floor(math.log10(s))))
    body = _minus(f"{x:.{decimals}f}", unicode) + pm + f"{s:.{decimals}f}"
    return body if scale == 0 else f"({body}){_power(scale, unicode)}"


def format_probability(p: Any) -> str:
    """Write a probability with two decimals, never rounding to certainty."""
    if not is_number(p):
        return "–"
    if float(p) > 0.995:
        return "> 0.99"
    return "< 0.01" if float(p) < 0.005 else f"{float(p):.2f}"


def undetermined(effect: EffectFound) -> list[str]:
    """The parameters of an effect that the recordings do not determine."""
    return [
        name
        for name, own in effect.parameters.items()
        if own.identifiable is False or not is_number(own.value)
    ]


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


def span95(entry: EffectParameterFound) -> tuple[float, float] | None:
    """95 % interval of a parameter entry: its ``interval`` if given, else value ± 1.96 std."""
    interval = entry.interval
    if interval is not None and len(interval) == 2 and all(is_number(v) for v in interval):
        return float(interval[0]), float(interval[1])
    value, std = entry.value, entry.std
    if is_number(value) and is_number(std):
        return float(value) - 1.96 * float(std), float(value) + 1.96 * float(std)
    return None


def ranked_probabilities(
    probabilities: Mapping[str, float], count: int | None = 8
) -> list[tuple[str, float]]:
    """Most probable hypotheses first, at most `count` (None for all); the rest is pooled under
    ``all others``.
    """
    known = [(k, float(v)) for k, v in probabilities.items() if is_number(v)]
    known.sort(key=lambda item: (-item[1], item[0]))
    if count is None or len(known) <= count:
        return known
    rest = known[count - 1 :]
    return [*known[: count - 1], (f"all others ({len(rest)})", sum(p for _, p in rest))]


def bars(diagnosis: Findings) -> list[tuple[Part | None, Mapping[str, float]]]:
    """The groups of blocks whose probabilities a reader needs, that of the headline first, and
    these: those of the whole case, without a group, where no group shows what is missing.
    """
    answer = diagnosis.answer
    if answer.parts or (answer.quiet and not answer.missed):
        return [(p, p.group.probabilities) for p in answer.parts or answer.quiet]
    return [(None, diagnosis.probabilities)]


def blocks_label(block: BlockVerdict) -> str:
    """The blocks of a group, in words: ``supply and chamber``."""
    return " and ".join(spoken_name(name) for name in block.blocks)


def is_named(part: Part | None, hypothesis: str) -> bool:
    """True where `hypothesis` (an id, or ids joined by ``+``) is the one that leads a group."""
    return part is not None and set(hypothesis.split("+")) == set(part.words)


def sentence_of(wrong: WrongParameter) -> str:
    """Sentence on a wrong value of the rig file: ``chamber dead volume is 360 +- 5 cm3, not 150 +-
    23``.
    """
    unit, factor = display_unit(wrong.unit, abs(wrong.nominal))
    keys = ("value", "std", "nominal", "tolerance")
    values = {key: float(v) * factor if is_number(v := wrong[key]) else math.nan for key in keys}
    found = format_uncertain(values["value"], values["std"], unicode=False)
    stated = format_uncertain(values["nominal"], values["tolerance"], unicode=False)
    shown = with_unit(found, unit.replace("°", "deg"))
    return f"{spoken_name(wrong.name)} is {shown}, not {stated}"


def considered_sentence(own: Considered) -> str:
    """Sentence on a set that was asked for: ``base flexibility: probability 92 %; it leaves 0.1 %
    of the mismatch of the arm``.
    """
    names = set_label(own.names)
    if not own.blocks:
        return f"{names}: only noise is left in the blocks where it acts"
    blocks = " and ".join(map(spoken_name, own.blocks))
    if own.left is None:
        return (
            f"{names}: it was not judged in the {blocks}: a parameter of it stays "
            "inside its tolerances, it happens with another event or a wrong value, or the model "
            "cannot be run with it"
        )
    return (
        f"{names}: probability {format_probability(own.probability)}; it leaves "
        f"{format_number(100.0 * own.left, 2, unicode=False)} % of the mismatch of the {blocks}"
    )


def kept_sentence(kept: Unexplained) -> str:
    """Sentence on what is left in a block: ``the residual of the arm is 15 times the noise level
    (0.4 deg) on held-out recordings, and no name explains it``.
    """
    why = "what is named does not explain it"
    if kept.verdict == "unlisted":
        why = "no name explains it"
    times = format_number(kept.noises, 2, unicode=False)
    on = {"held_out": " on held-out recordings", "fit": " on the fitted recordings"}
    return (
        f"the residual of the {spoken_name(kept.block)} is {times} times the noise level "
        f"({sized(kept.size, kept.unit)}){on.get(kept.role, '')}, and {why}"
    )


def kept_details(kept: Unexplained) -> str:
    """Sentence on what is left in a block, with its share of the budget and the conditions under
    which it is largest.
    """
    text = kept_sentence(kept)
    if is_number(kept.share) and kept.interval is not None and _tellable(kept.share):
        text += (
            f"; {format_share(kept.share)} of what the nominal model misses "
            f"({format_interval(kept.interval)})"
        )
    if kept.conditions:
        text += f"; largest under: {'; '.join(c.text for c in kept.conditions[:2])}"
    return text


def spoken_name(name: str) -> str:
    """A block, a channel or a parameter by its dotted name, in words.

    Parameters
    ----------
    name : str
        For example ``"chamber.flexor"``.

    Returns
    -------
    str
        What it is first, then of which block where several have one.

    Examples
    --------
    >>> spoken_name("chamber.dead_volume"), spoken_name("chamber.flexor.dead_volume")
    ('chamber dead volume', 'chamber dead volume of flexor')
    >>> spoken_name("sensors.flexor.pressure_zero"), spoken_name("muscle_pressure.flexor")
    ('pressure zero of flexor', 'muscle pressure of flexor')
    >>> spoken_name("sensors.pressure_zero"), spoken_name("chamber.flexor")
    ('pressure zero of the sensors', 'chamber of flexor')
    """
    kind, *rest = name.split(".")
    keys = {key.name for key in BLOCKS.get(kind, ())}
    own = rest.pop() if rest and (kind in EFFECTS or rest[-1] in keys or len(rest) > 1) else ""
    group = " ".join(rest)
    if kind == "sensors" and own:
        return f"{label(own)} of {label(group) if group else 'the sensors'}"
    what = " ".join(label(part) for part in (kind, own) if part)
    return f"{what} of {label(group)}" if group else what


def spoken_block(name: str) -> str:
    """A block of a diagnosis in words: ``chamber block``, ``chamber block of flexor``."""
    kind, _, group = name.partition(".")
    return f"{label(kind)} block of {label(group)}" if group else f"{label(kind)} block"


def pair_texts(diagnosis: Findings) -> list[tuple[PairExperiment, str]]:
    """Texts on what separates each two hypotheses that are left open; an instruction that was given
    before is not given again.
    """
    own = diagnosis.next_experiment
    before = {own.text: "The same experiment."}
    found = []
    for pair in own.pairs:
        if pair.text == own.text:
            continue
        shared = max((_shared(pair.text, text) for text in before), default=0)
        first = next(text for text in before if _shared(pair.text, text) == shared)
        shown = pair.text
        if shared:
            rest = pair.text[shared:].lstrip(" .;:")
            shown = f"{before[first]} {rest[:1].upper()}{rest[1:]}".strip()
        found.append((pair, shown))
        between = " or ".join(hypothesis_label(name) for name in pair.between)
        before.setdefault(pair.text, f"The experiment for {between}.")
    return found


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


def searched(part: Part) -> bool:
    """True where anything with a name was tried for what a group of blocks misses."""
    return any(key not in (*HEALTHY, "unlisted") for key in part.group.probabilities)


def law_sentence(law: OtherLaw) -> str:
    """A law that the recordings follow instead of that of the rig file, in words."""
    before, after = (sized(size, law.unit) for size in (law.before, law.after))
    return (
        f"With {law.name} = {law.other}, not {law.stated} as in the rig file, the refitted model "
        f"misses {spoken_name(law.channel)} by {after} instead of {before}"
    )


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
        times = f"{format_number(own.noises, 2, unicode=False)} noise levels"
        if answer.model != YOURS and own.block is None and is_number(own.before):
            times += f"; {YOURS}: {sized(own.before, own.unit)}"
        place = f"in the {spoken_name(own.block)}" if own.block else "in the whole rig"
        size = sized(own.size, own.unit) + (f" ({times})" if most is None else "")
        by_channel.setdefault(own.channel, f"{spoken_name(own.channel)} by {size} {place}")
    if not by_channel:
        return ""
    what = "what else is missing" if answer.named else "what is missing"
    said = listed(list(by_channel.values())[:most])
    return capital(f"{with_article(answer.model)} still misses {said}; {what} was not found")


def capital(text: str) -> str:
    """A text that begins a sentence."""
    return text[:1].upper() + text[1:]


def with_article(model: str) -> str:
    """The name of a model in a sentence: ``the mended model``, ``your model``."""
    return model if model == YOURS else f"the {model}"


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


def within_error(diagnosis: Findings) -> list[str]:
    """Groups of which nothing is missing, though they miss much, inside the error of their model,
    where other groups lack something: ``the arm fits to within its usual error (joint angle 1.2 deg
    of 1.9 deg)``.
    """
    sentences = []
    for part in diagnosis.answer.quiet if diagnosis.answer.parts else ():
        for own in part.group.mismatch:
            found = miss(diagnosis, own.channel, "after")
            if found and found.noises > MOST_MISSED and left_in(diagnosis, own.block) == "error":
                usual = (
                    f"{spoken_name(own.channel)} {found.size} of {sized(own.model_error, own.unit)}"
                )
                sentences.append(
                    f"the {spoken_name(own.block)} fits to within its usual error ({usual})"
                )
    return sentences


def not_judged_words(diagnosis: Findings) -> list[str]:
    """Blocks that were not judged, by their reasons: ``not judged: supply (supply_pressure is not
    in every recording)``.
    """
    reasons: dict[str, list[str]] = {}
    for block in diagnosis.not_judged:
        own = block.covers or blocks_label(block)
        reasons.setdefault(block.reason, []).append(own)
    texts = [f"{' and '.join(names)} ({why})" for why, names in reasons.items()]
    return [f"not judged: {'; '.join(texts)}"] if texts else []


def chance_words(part: Part) -> str:
    """Probability of what leads a group: ``0.93``, or ``0.60, alone or with others`` of names that
    its sets have in common.
    """
    return format_probability(part.probability) + ", alone or with others" * part.together


def name_chance(diagnosis: Findings, name: str) -> str:
    """Probability of one name, and that it counts sets with others where these make a
    difference: ``0.93, alone or with others``; where several groups of blocks name it, that of
    each: ``0.94 in the chamber, 0.92 in the arm``.
    """
    naming = [part for part in diagnosis.answer.parts if name in part.names]
    if len(naming) > 1:
        return ", ".join(
            f"{format_probability(p.with_name(name))} in the {spoken_name(p.block or 'rig')}"
            for p in naming
        )
    for part in naming:
        text = format_probability(part.with_name(name))
        return text if text == chance_words(part) else f"{text}, alone or with others"
    return ""


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
        return f"{format_number(self.noises, 2, unicode=False)} noise levels ({self.size})"


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


def worst_channel(diagnosis: Findings) -> str | None:
    """The channel that the final model misses most, in noise levels."""
    found = {c: m.noises for c in diagnosis.proven if (m := miss(diagnosis, c, "after"))}
    return max(found, key=lambda channel: found[channel], default=None)


def miss_of(error: ChannelError, channel: str, stage: str) -> Miss | None:
    """Error of a channel by its entry in the table of errors; None where that is not known."""
    value = error[stage]
    if not is_number(value) or not is_number(error.noise) or not error.noise > 0.0:
        return None
    return Miss(value / error.noise, sized(value, unit_of(channel)))


def sized(value: float, unit: str) -> str:
    """A size with its unit, as a terminal has it: ``8.5 mbar``."""
    shown, factor = display_unit(unit, abs(value))
    size = format_number(value * factor, 2, unicode=False)
    return with_unit(size, shown.replace("°", "deg"))


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
    return f"{by} the model misses {' and '.join(changes)}" if changes else ""


def unsettled_sentence(diagnosis: Findings) -> str:
    """Sentence on why an answer is not settled; empty where it is."""
    answer = diagnosis.answer
    open_ = [part for part in answer.parts if len(part.left) > 1]
    several = len(answer.parts) > 1
    reasons = []
    if answer.missed:
        reasons.append(f"{with_article(answer.model)} misses more than noise and its error explain")
    for part in open_:
        place = f" in the {spoken_name(part.block or 'rig')}" if several else ""
        reasons.append(f"these recordings cannot tell {told_apart(part)}{place}")
    for part in answer.parts:
        if part.sure and part.words == ("unlisted",):
            reasons.append(f"what is missing in the {spoken_name(part.block or 'rig')} has no name")
        elif part not in open_ and not part.sure:
            what = set_label(list(part.words))
            reasons.append(
                f"{what} has {chance_words(part)}, and more than {diagnosis.settled} is needed"
            )
    return f"It is not settled: {'; '.join(reasons)}." if reasons else ""


def told_apart(part: Part) -> str:
    """Hypotheses that are left of a group, the one that leads first: ``a (0.80) from b (0.12)``,
    ``a (0.50), b (0.30) and c (0.20) apart``.
    """
    names = {name for words, _ in part.left for name in words}
    answers = [_answer([_spread(n, names) for n in own], chance) for own, chance in part.left]
    if len(answers) == 2:
        return f"{answers[0]} from {answers[1]}"
    return f"{', '.join(answers[:-1])} and {answers[-1]} apart"


def _spread(name: str, others: Collection[str]) -> str:
    """Effect that acts everywhere, with words for that where it is also named at one block."""
    at_one = (term for other in others if (term := Term.parse(other)).at)
    apart = name in EFFECTS and any(term.id == name for term in at_one)
    return str(Term(name, EFFECTS[name].everywhere)) if apart else name


def _answer(names: list[str], chance: float = math.nan) -> str:
    """One of several hypotheses, in words, with its probability."""
    if len(names) == 1 and names[0] in (*HEALTHY, "unlisted"):
        text = f"an {label(names[0])}" if names[0] == "unlisted" else "no missing physics"
    else:
        text = " + ".join(
            f"a {set_label([name])}" if Term.parse(name).is_value else label(name) for name in names
        )
    return f"{text} ({format_probability(chance)})" if is_number(chance) else text


DOWN_TO_NOISE = "down to the noise level"
"""Words for a model that leaves only noise of its recordings."""


def down_to(diagnosis: Findings) -> str:
    """Words on how closely a model without anything missing explains the recordings: ``down to the
    noise level``, or to within the error that is taken for its own where it misses more than noise.
    """
    missed = [
        (found.noises, own, left, found)
        for part in diagnosis.answer.quiet
        for own in part.group.mismatch
        if (left := left_in(diagnosis, own.block)) not in ("", "noise")
        and (found := miss(diagnosis, own.channel, "after"))
    ]
    if not missed:
        return DOWN_TO_NOISE
    _, own, left, found = max(missed, key=lambda each: each[0])
    if left == "more":
        return f"to within {found} of {spoken_name(own.channel)}"
    usual = sized(own.model_error, own.unit)
    return f"to within its usual error ({spoken_name(own.channel)} {found.size} of {usual})"


def left_in(diagnosis: Findings, block: str, stage: str = "after") -> str:
    """Kind of what is left in a block with the final model, as :func:`pamrs.findings.left_of` has
    it; empty where a result does not say.
    """
    own = next((m for b in diagnosis.judged for m in b.mismatch if m.block == block), None)
    if own is None:
        return ""
    healthy = diagnosis.answer.part_of(block) in diagnosis.answer.quiet
    return left_of(own, diagnosis.proven.get(own.channel), stage, healthy=healthy)


def judged_place(diagnosis: Findings) -> str:
    """Words on the judged blocks, in which nothing is missing; empty where all were judged."""
    if not diagnosis.not_judged:
        return ""
    return f" in the {' and '.join(blocks_label(block) for block in diagnosis.judged)}"


def held_words(diagnosis: Findings) -> str:
    """The effects that the model had before: `` in addition to the leak that the model holds``."""
    ids = [term.id for term in diagnosis.budget if term.kind == "held"]
    ids += [effect.id for name in diagnosis.parameters if (effect := effect_of(name))]
    held = [f"the {label(i)}" for i in dict.fromkeys(ids) if i in EFFECTS]
    return f" in addition to {' and '.join(held)} that the model holds" if held else ""


def term_label(term: BudgetTerm) -> str:
    """Name of a term of a budget, for tables and figures."""
    fixed = {
        "parameters": "parameters inside tolerance",
        "form": "a form without a name",
        "unexplained": "unexplained",
    }
    if term.kind in fixed:
        return fixed[term.kind]
    held = ", in the model already" if term.kind == "held" else ""
    form = f" ({label(term.form)})" if term.form else ""
    return hypothesis_label(str(Term(term.id, term.at))) + form + held


def budgets(diagnosis: Findings) -> dict[str, list[BudgetTerm]]:
    """The terms of each block's budget, by its name."""
    found: dict[str, list[BudgetTerm]] = {}
    for term in diagnosis.budget:
        found.setdefault(term.block, []).append(term)
    return found


def effect_name(effect: EffectFound) -> str:
    """Name of an effect, with the block at which it acts where the rig has several of its kind."""
    at = f" at {effect.at.replace('_', ' ')}" if effect.at else ""
    return (effect.name or label(effect.id)) + at


def effect_title(effect: EffectFound) -> str:
    """Name of an effect, with its form where it is not the usual one."""
    form = f", form: {label(effect.form)}" if effect.form else ""
    return effect_name(effect) + form


def effect_heading(diagnosis: Findings, effect: EffectFound) -> str:
    """Name and form of an effect, marked where it only comes closest and is not named."""
    title = effect_title(effect)
    named = effect.term in diagnosis.answer.named
    return title if named else f"not named, but closest: {title}"


_LEFT = {
    "noise": "only noise is left",
    "error": "what is left is inside the usual error of the model",
}
"""Sentences on the rest of a block, where it is nothing unexplained."""


def budget_sentences(diagnosis: Findings) -> list[tuple[str, str]]:
    """Each block with a budget and that in words."""
    found = []
    for block, own in budgets(diagnosis).items():
        left, part = left_in(diagnosis, block), diagnosis.answer.part_of(block)
        # what is said to be missing is no error of the model
        missing = left == "error" and part is not None and part.group.verdict == "unlisted"
        found.append((block, budget_sentence(own, "more" if missing else left)))
    return found


def budget_sentence(terms: Sequence[BudgetTerm], left: str = "") -> str:
    """Sentence on the budget of one block; its rest is called what it is, where that is known
    (``noise``, ``error``, ``more``).
    """
    *before, (_, last) = reported_terms(terms)
    shares = [
        f"{name} {format_share(term.share)} ({format_interval(term.interval)})"
        for name, term in before
        if _tellable(term.share)
    ]
    share = f"{format_share(last.share)} unexplained"
    if not _tellable(last.share):
        share = "more is unexplained than with the nominal model"
    left = left or ("more" if last.noises > 0.0 else "noise")
    return "; ".join([*shares, _LEFT.get(left, share)]) + "."


def reported_terms(terms: Sequence[BudgetTerm]) -> list[tuple[str, BudgetTerm]]:
    """Terms of a block's budget that are reported, each with its name: as they are, or together
    where one takes back what another one spoils, so that shares of single ones say nothing.
    """
    *before, last = terms
    if all(_tellable(term.share) for term in before):
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


def _tellable(share: float) -> bool:
    """True where a share says something by itself."""
    return -TELLING <= share <= 1.0 + TELLING


def format_share(share: float) -> str:
    """A share of a budget in percent, a small one not as nothing."""
    if 0.0 < share < 0.005:
        return "under 1 %"
    return f"{_percent(share)} %"


def _percent(share: float) -> str:
    """Whole percent, without a sign of zero; far outside of all there is, that it is outside."""
    if abs(share) > FARTHEST:
        return f"below {_percent(-FARTHEST)}" if share < 0.0 else f"above {_percent(FARTHEST)}"
    text = f"{100.0 * share:.0f}"
    return "0" if text == "-0" else text.replace("-", "\u2212")


def format_interval(interval: Sequence[float]) -> str:
    """An interval of shares in percent: ``11 to 41``."""
    return " to ".join(_percent(share) for share in interval)


_CLEARLY_WORSE = 1.1  # ratio of two errors that is no accident of the noise
_MOST_LOGS = 3
"""Recordings of which a summary says what was left out."""


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
        counts: dict[int, list[str]] = {}
        for name, share in own.masked.items():
            counts.setdefault(max(round(share * own.samples), 1), []).append(name)
        parts = list(own.read)
        parts += [
            f"{', '.join(names)}: {count} of {own.samples} samples masked"
            for count, names in counts.items()
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
    if not unused:
        return text
    reasons: dict[str, list[str]] = {}
    for name, why in unused.items():
        reasons.setdefault(why, []).append(name)
    why_unused = "; ".join(f"{', '.join(names)} ({why})" for why, names in reasons.items())
    return f"{text}; recorded but not used: {why_unused}"
