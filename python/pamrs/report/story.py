"""The first screen of a report: what all answers that are left share, how sure that is, what it is
on the bench, and why everything else lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from pamrs.effects import EFFECTS, NONE, PARAMETERS, UNLISTED, Hypothesis
from pamrs.findings import HEALTHY, EffectFound, EffectParameterFound, Findings, Missed, Part
from pamrs.report import text as words
from pamrs.units import with_unit

LONGEST = 24
"""Words of a title at most."""
MOST_RIVALS = 7
"""Explanations that are ranked on the first screen."""
LEAST_SHOWN = 0.05
"""Probability from which an explanation is in the title."""
AS_MUCH = 0.03
"""Difference of two shares of a mismatch below which both explain as much."""


class Rival(NamedTuple):
    """Explanation in a ranking: its name, probability in words and as a number, whether it is the
    answer, and the reason for its place.
    """

    name: str
    chance: str
    probability: float
    named: bool
    why: str


def title(diagnosis: Findings) -> str:
    """One sentence of at most 24 words that states what all answers that are left share.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    """
    if diagnosis.misread:
        names = [words.spoken_name(n) for own in diagnosis.misread for n in own.channels]
        first = diagnosis.misread[0]
        verb = "are" if len(names) > 1 else "is"
        sentence = f"{_listed(names, 2, 'and')} {verb} likely {first.likely}, not {first.said}"
        return f"{sentence[:1].upper()}{sentence[1:]}: no physics was judged"
    parts = diagnosis.answer.parts
    if diagnosis.answer.missed and not diagnosis.answer.named:
        return words.missed_sentence(diagnosis, 1)
    if diagnosis.answer.missed:
        parts = [part for part in parts if words.searched(part)]
    if not parts:
        wrong = [f"{law.name} is {law.other}, not {law.stated}" for law in diagnosis.laws]
        return f"The rig file is wrong: {wrong[0]}" if wrong else _healthy(diagnosis)
    together = _together(parts, doubt=bool(diagnosis.answer.missed))
    if together and len(together.split()) <= LONGEST:
        return together
    # a value may be wrong in several groups
    other = [
        part
        for part in parts[1:]
        if not (part.sure and part.group.wrong_parameters and part.names == parts[0].names)
    ]
    acts = "in" if all(part.sure for part in other) else "may act in"
    end = f"; something else {acts} the {_listed([*map(_place, other)], 2, 'and')}" * bool(other)
    end += "".join(f", with {law.name} = {law.other}" for law in diagnosis.laws[:1])
    every = (_phrase(diagnosis, parts[0], most) + end for most in (3, 2, 1))
    short = (sentence for sentence in every if len(sentence.split()) <= LONGEST)
    return next(short, _phrase(diagnosis, parts[0], 0) + end)


def headline(diagnosis: Findings) -> str:
    """The verdict in a few sentences: sensors and commands that are faulty, the title with all
    answers that are left, what the final model still misses (first where nothing has a name),
    groups that only fit to within the error of their model, and what was not judged.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    """
    first = [*(entry.text for entry in diagnosis.faulty), *map(words.law_sentence, diagnosis.laws)]
    if diagnosis.misread:
        return ". ".join([*first, "; ".join(reading.text for reading in diagnosis.misread)])
    parts, missed = diagnosis.answer.parts, words.missed_sentence(diagnosis)
    parts = [part for part in parts if not missed or words.searched(part)]
    each = (_phrase(diagnosis, p, MOST_RIVALS) + _missing_input(diagnosis, p) for p in parts)
    together = _together(parts, doubt=bool(missed))
    phrases = [together] if together else list(dict.fromkeys(each))
    still = [missed] * bool(missed)
    sentences = [*phrases, *still] if diagnosis.answer.named else [*still, *phrases]
    sentences = sentences or [title(diagnosis)]
    rest = [*words.within_error(diagnosis), *words.not_judged_words(diagnosis)]
    return ". ".join([*first, *sentences[:-1], "; ".join([sentences[-1], *rest])])


def _together(parts: Sequence[Part], *, doubt: bool) -> str:
    """Sentence on names of several groups, each with its place and probability, where none leaves
    anything open: ``The model leaves out pressure lag in the arm (0.95) and in the chamber
    (0.93)``.
    """
    if len(parts) < 2 or any(p.group.wrong_parameters or not p.sure for p in parts):
        return ""
    places: dict[str, list[str]] = {}
    for part in parts:
        names = list(part.names)
        name = words.set_label(names) if names else "an effect outside the catalogue"
        places.setdefault(name, []).append(_with_chance(f"in the {_place(part)}", part))
    named = [f"{name} {_listed(own, len(own), 'and')}" for name, own in places.items()]
    verb = "may leave" if doubt else "leaves"
    return f"The model {verb} out {_listed(named, len(named), 'and')}"


def _place(part: Part) -> str:
    """The block of a group with the mismatch, in words."""
    return words.spoken_name(part.block or "rig")


def _healthy(diagnosis: Findings) -> str:
    """The title where no answer that is left has anything missing."""
    place = words.judged_place(diagnosis) + words.held_words(diagnosis)
    how = words.down_to(diagnosis)
    if diagnosis.answer.verdict == "parameters":
        by = "values inside their tolerances explain the difference"
        return f"No physics is missing{place}: {by}" + f" {how}" * (how != words.DOWN_TO_NOISE)
    return f"Nothing is missing{place}: the model explains these recordings {how}"


def _listed(names: Sequence[str], most: int, last: str) -> str:
    """Some of several names in a row: ``a, b or 3 more``."""
    shown = list(names[:most])
    if len(names) > most:
        shown.append(f"{len(names) - most} more")
    return words.listed(shown, last)


def _phrase(diagnosis: Findings, part: Part, most: int) -> str:
    """Words on what the answers left of a group share, and at most so many of their names."""
    left = [Hypothesis.of(own) for own, _ in part.left]
    doubt = bool(diagnosis.answer.missed) or not part.sure
    values = [term.is_value for h in left for term in h.terms]
    if len(left) == 1 and values and all(values):
        wrong = [w for w in diagnosis.wrong_parameters if w.name in part.words]
        off = _listed(list(map(words.sentence_of, wrong)), max(most, 1), "and")
        return f"The rig file {'may be' if doubt else 'is'} wrong: {off}"
    if left == [UNLISTED] and part.sure:
        acts = f"Something acts in the {_place(part)} that no effect of the catalogue explains"
        return _with_chance(acts, part)
    chances = {h: p for h, (_, p) in zip(left, part.left, strict=True)}
    if len(left) == 1:  # rivals of which none is probable enough for a set
        ranked = words.ranked_probabilities(part.group.probabilities, None)
        chances |= {
            Hypothesis.parse(k): p for k, p in ranked if p >= LEAST_SHOWN and not part.names
        }
    named = [
        _with_chance(words.set_label(h.words), part if h == left[0] else chance)
        for h, chance in chances.items()
        if h not in (NONE, PARAMETERS)
    ]
    head = _head(_place(part), left, doubt=doubt)
    return f"{head}: {_listed(named, most, 'or')}" if most and named else head


def _missing_input(diagnosis: Findings, part: Part) -> str:
    """Words on the size of the input that is missing without a name, and what it depends on; empty
    where no single argument explains it.
    """
    own = diagnosis.missing_input
    if own is None or not own.argument or own.block != part.block or part.names:
        return ""
    return f"; it amounts to {own.sentence}"


def _with_chance(text: str, chance: Part | float) -> str:
    """Something with its probability behind it, where that is known."""
    known = chance.probability if isinstance(chance, Part) else chance
    shown = words.chance_words(chance) if isinstance(chance, Part) else ""
    return (
        f"{text} ({shown or words.format_probability(known)})" if words.is_number(known) else text
    )


def _head(place: str, left: Sequence[Hypothesis], *, doubt: bool) -> str:
    """Words on what the answers that are left of a group share."""
    if left[0] == NONE:
        return f"The model of the {place} may be complete; not ruled out"
    if left[0] == PARAMETERS:
        return f"Values may explain what the {place} misses; not ruled out"
    # what is still missed says nothing against names that are open anyway
    doubt = NONE in left or PARAMETERS in left or (doubt and len(left) == 1)
    values = [term.is_value for h in left for term in h.terms]
    if any(values):
        if all(values) and UNLISTED not in left:
            return f"The rig file {'may be' if doubt else 'is'} wrong about the {place}"
        return f"The {place} {'may differ' if doubt else 'differs'} from model and rig file"
    kinds = [{EFFECTS[t.id].shares for t in h.terms} for h in left if h.terms]
    shared = sorted(set.intersection(*kinds) - {""}) if kinds else []
    if shared and UNLISTED not in left:
        return f"The model of the {place} {'may leave' if doubt else 'leaves'} out {shared[0]}"
    acts = "may act" if doubt and left[0] != UNLISTED else "acts"
    return f"Something {acts} in the {place} that the model leaves out"


def facts(diagnosis: Findings) -> list[tuple[str, str]]:
    """Numbers of the first screen: the block with its own probability, the name with its, the size
    on the bench, and what the model misses with what was found.
    """
    if diagnosis.misread:
        return [
            (f"{m.likely}, not {m.said}", ", ".join(map(words.spoken_name, m.channels)))
            for m in diagnosis.misread
        ]
    answer, found = diagnosis.answer, list[tuple[str, str]]()
    still = [_still(own) for own in answer.missed[:1]]
    found += [] if answer.named else still
    parts = answer.parts[:2]
    for part in parts[:1] if parts and parts[0].group.probabilities else ():
        at = f" in {words.blocks_label(part.group)}" if len(part.group.blocks) > 1 else ""
        chance = words.format_probability(_missing(part))
        found.append((_place(part), f"something is missing or wrong{at}: probability {chance}"))
    for part in parts or ([] if answer.missed else answer.quiet):
        several = len(diagnosis.answer.parts or answer.quiet) > 1
        at = words.blocks_label(part.group) if part in answer.quiet else _place(part)
        label = words.answer_label(part.words)
        what = f"probability {words.chance_words(part)}" + f" in the {at}" * several
        found.append((label, what))
    named = [e for e in diagnosis.effects if e.term in answer.named]
    for effect in sorted(named, key=lambda e: bool(parts) and e.term not in parts[0].names):
        sizes = bench_value(effect)[:1]
        found += [(value, f"{words.label(effect.term)}: {name}") for name, value in sizes]
    channel = next((m.channel for p in parts for m in p.group.mismatch if m.block == p.block), None)
    channel = channel or diagnosis.where.channel or words.worst_channel(diagnosis)
    last = None if answer.missed else words.miss(diagnosis, channel, "after")
    if channel and last:
        model = words.with_article(answer.model)
        what = f"{words.spoken_name(channel)} missed by {model} ({last.size})"
        found.append((f"{words.format_number(last.noises, 2)} × noise", what))
    return found + (still if answer.named else [])


def _still(missed: Missed) -> tuple[str, str]:
    """A channel that the final model still misses: by how much, and where."""
    place = f"in the {words.spoken_name(missed.block)}" if missed.block else "in the whole rig"
    times = words.format_number(missed.noises, 2)
    what = f"{words.spoken_name(missed.channel)} still missed {place} ({times} × noise)"
    return words.sized(missed.size, missed.unit), what


def _missing(part: Part) -> float:
    """Probability that something is missing or wrong in a group of blocks."""
    chances = part.group.probabilities
    return min(1.0, max(0.0, 1.0 - sum(chances.get(key, 0.0) for key in HEALTHY)))


def bench_value(effect: EffectFound, *, own_units: bool = False) -> list[tuple[str, str]]:
    """The parameters of an effect that the recordings determine, as a bench has them: name, and
    value with its 95 % interval and unit (``5.2 (4.9 to 5.5) l/min at 3 bar``); with ``own_units``
    those alone that have a unit of their own there.
    """
    found, info = [], EFFECTS.get(effect.id)
    vague = words.undetermined(effect)
    for name, own in effect.parameters.items():
        if own_units and not (info and info.on_bench(name, effect.form)):
            continue
        if name not in vague and own.std:
            found.append((words.label(name), _on_bench(effect, name, own)))
    return found


def _on_bench(effect: EffectFound, name: str, own: EffectParameterFound) -> str:
    info = EFFECTS.get(effect.id)
    bench = info.on_bench(name, effect.form) if info else None
    mixed = effect.parameters.get(bench.mixed_by) if bench else None
    unit, factor = words.bench_unit(
        f"{effect.id}.{name}", own.unit, abs(own.value), effect.form, mixed.value if mixed else 0.0
    )
    value = words.format_number(own.value * factor, 2)
    bounds = words.span95(own)
    low, high = (words.format_number(v * factor, 2) for v in bounds or (own.value, own.value))
    return with_unit(f"{value} ({low} to {high})" if bounds else value, unit)


def to_do(diagnosis: Findings) -> list[str]:
    """Sentences on what to do on the bench about each answer that is left."""
    found = []
    for part in diagnosis.answer.parts[:2]:
        for term in dict.fromkeys(t for own, _ in part.left for t in Hypothesis.of(own).terms):
            if term.is_value:
                found.append(f"Measure {words.spoken_name(str(term))} again.")
            elif EFFECTS[term.id].bench:
                found.append(EFFECTS[term.id].bench)
    return list(dict.fromkeys(found))[: 1 if next_to_do(diagnosis) else 2]


def next_to_do(diagnosis: Findings) -> str:
    """The next experiment, whole; without one what else would settle the answer, empty where it is
    settled.
    """
    own = diagnosis.next_experiment
    if own.instruction:
        return f"Record next: {own.instruction}"
    return f"Next: {own.text}" if own.text and not diagnosis.answer.settled else ""


def rivals(diagnosis: Findings) -> list[Rival]:
    """Explanations of each mismatch in the order of the title, the most probable first, with the
    reason for each; after those of the located one the effects that come closest alone.
    """
    shown = words.bars(diagnosis)
    found = []
    for part, chances in shown[:2]:
        at = ""
        if part and len(shown) > 1:
            own = part in diagnosis.answer.quiet
            at = f" in the {words.blocks_label(part.group) if own else _place(part)}"
        most = MOST_RIVALS // 2 if len(shown) > 1 else MOST_RIVALS
        rows = _ranked(diagnosis, part, chances, most)
        found += [row._replace(name=row.name + at) for row in rows]
    return found


def _ranked(
    diagnosis: Findings, part: Part | None, chances: Mapping[str, float], most: int
) -> list[Rival]:
    """Explanations of what one group of blocks misses, at most so many."""
    ranked = words.ranked_probabilities(chances, None)
    shown = [(key, p) for key, p in ranked if p >= 0.005]
    shown += [(key, p) for key, p in ranked if p < 0.005 and key in ("none", "parameters")]
    known = {key for key, _ in ranked}
    closest = sorted(
        (row for row in diagnosis.tested if row.left is not None and row.id not in known),
        key=lambda row: row.left or 0.0,
    )
    shown = shown[:most]
    if part in diagnosis.answer.parts[:1]:
        shown += [(row.id, 0.0) for row in closest[: max(0, most - len(shown))]]
    return [
        Rival(
            words.hypothesis_label(key),
            words.format_probability(p),
            max(0.0, min(1.0, p)),
            words.is_named(part, key),
            _why(diagnosis, part, key),
        )
        for key, p in shown
    ]


def _taken(diagnosis: Findings, names: Iterable[str]) -> float | None:
    """Share of the mismatch, as a variance, that a set takes on held-out recordings, if it was
    fitted.
    """
    wanted = Hypothesis.of(list(names))
    alone = (
        1.0 - row.left
        for row in diagnosis.tested
        if [row.id] == list(names) and row.left is not None
    )
    fitted = (
        1.0 - (1.0 - own.gap_closed) ** 2
        for own in diagnosis.tried
        if Hypothesis.of([*own.effects, *own.wrong_parameters]) == wanted
        and words.is_number(own.gap_closed)
    )
    return next((float(v) for v in (*alone, *fitted) if words.is_number(v)), None)


def _why(diagnosis: Findings, part: Part | None, key: str) -> str:
    """Reason why an explanation has its probability."""
    hypothesis = Hypothesis.parse(key)
    if hypothesis == UNLISTED:
        return "a cause without a name is never ruled out"
    own = part.group.mismatch if part else ()
    channel = next((m.channel for m in own if part and m.block == part.block), None)
    channel = channel or diagnosis.where.channel
    stage = {NONE: "before", PARAMETERS: "refit"}.get(hypothesis, "")
    missed = words.miss(diagnosis, channel, stage) if stage else None
    if missed and channel:
        how = "as it is, the model" if stage == "before" else "refitted inside them, the model"
        return f"{how} misses {words.spoken_name(channel)} by {missed}"
    taken = _taken(diagnosis, hypothesis.words)
    if taken is None or part is None:
        return ""
    takes = f"takes {words.format_share(max(0.0, taken))} of what the refit leaves"
    best = _taken(diagnosis, part.names)
    if words.is_named(part, key) or best is None:
        return takes
    if set(hypothesis.words) > set(part.names):
        return f"{takes}: no more than without the addition" if taken < best + AS_MUCH else takes
    return f"{takes} as well, with rarer values or names" if taken > best - AS_MUCH else takes
