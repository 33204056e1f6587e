"""The first screen of a report: what all answers that are left share, how sure that is, what it is
on the bench, and why everything else lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from pamrs.effects import EFFECTS, NONE, PARAMETERS, UNLISTED, Hypothesis
from pamrs.findings import HEALTHY, BlockVerdict, EffectFound, EffectParameterFound, Findings
from pamrs.report import text as words
from pamrs.units import with_unit

LONGEST = 20
"""Words of a title at most."""
MOST_RIVALS = 7
"""Explanations that are ranked on the first screen."""
LEAST_TOLD = 0.05
"""Probability from which an explanation stands in the title."""
AS_MUCH = 0.03
"""Difference of two shares of a mismatch below which both explain as much."""


class Rival(NamedTuple):
    """One explanation: its name, probability in words and as a number, whether it is the answer,
    and why it stands where it does.
    """

    name: str
    told: str
    probability: float
    named: bool
    why: str


def _answer(block: BlockVerdict) -> list[Hypothesis]:
    """The hypotheses of a group that are left, the most probable first."""
    if len(block.ambiguity) > 1:
        return [Hypothesis.of(names) for names in block.ambiguity]
    return [
        Hypothesis.of([*block.effects, *block.wrong_parameters] or [block.verdict or "unlisted"])
    ]


def _answering(diagnosis: Findings) -> list[BlockVerdict]:
    """The groups of blocks in which something is or may be missing or wrong: those with a settled
    name first, then the located one.
    """
    found = [
        b
        for b in words.told_blocks(diagnosis)
        if len(b.ambiguity) > 1 or b.effects or b.wrong_parameters or b.verdict == "unlisted"
    ]
    if not found and diagnosis.verdict == "unlisted":
        found = words.told_blocks(diagnosis)

    def settled(block: BlockVerdict) -> bool:
        answer = _answer(block)
        return (
            len(answer) == 1
            and bool(answer[0].terms)
            and (_chance(diagnosis, block, answer[0]) >= diagnosis.settled)
        )

    return sorted(found, key=lambda b: (not settled(b), diagnosis.where.block not in b.blocks))


def title(diagnosis: Findings) -> str:
    """One sentence of at most 20 words that states what all answers that are left share.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    """
    if diagnosis.misread:
        names = [words.spoken_name(n) for own in diagnosis.misread for n in own.channels]
        first = diagnosis.misread[0]
        verb = "are" if len(names) > 1 else "is"
        told = f"{_listed(names, 2, 'and')} {verb} likely {first.likely}, not {first.said}"
        return f"{told[:1].upper()}{told[1:]}: no physics was judged"
    groups = _answering(diagnosis)
    if not groups:
        return _healthy(diagnosis)
    together = _together(diagnosis, groups)
    if together and len(together.split()) <= LONGEST:
        return together
    others = _listed([_place(diagnosis, b) for b in groups[1:]], 2, "and")
    ends = (f"; something else in the {others}", "")
    for end in ends if groups[1:] else ("",):
        for most in (3, 2, 1):
            told = _phrase(diagnosis, groups[0], most) + end
            if len(told.split()) <= LONGEST:
                return told
    return _phrase(diagnosis, groups[0], 0)


def headline(diagnosis: Findings) -> str:
    """The verdict in one sentence, however long: the title with all answers that are left, and
    before and behind it sensors and commands that are faulty, what the whole rig misses from its
    commands alone, and what was not judged.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    """
    first = [entry.text for entry in diagnosis.faulty]
    if diagnosis.misread:
        return ". ".join([*first, "; ".join(reading.text for reading in diagnosis.misread)])
    groups = _answering(diagnosis)
    together = _together(diagnosis, groups)
    phrases = ". ".join(_phrase(diagnosis, block, MOST_RIVALS) for block in groups)
    told = [together or phrases or title(diagnosis)]
    if groups and diagnosis.off:
        told.append(words.off_sentence(diagnosis))
    return ". ".join([*first, "; ".join([*told, *words.not_judged_words(diagnosis)])])


def _together(diagnosis: Findings, groups: Sequence[BlockVerdict]) -> str:
    """What several groups name, each with its place and how sure it is, where none leaves anything
    open: ``The model leaves out pressure lag in the arm (0.95) and in the chamber (0.93)``.
    """
    if len(groups) < 2 or diagnosis.off or any(len(_answer(b)) > 1 for b in groups):
        return ""
    places: dict[str, list[str]] = {}
    for block in groups:
        (answer,) = _answer(block)
        name = words.set_label(answer.words) if answer.terms else "an effect outside the catalogue"
        where = _with_chance(
            f"in the {_place(diagnosis, block)}", _chance(diagnosis, block, answer)
        )
        places.setdefault(name, []).append(where)
    named = [f"{name} {_listed(own, len(own), 'and')}" for name, own in places.items()]
    return f"The model leaves out {_listed(named, len(named), 'and')}"


def _chance(diagnosis: Findings, block: BlockVerdict, answer: Hypothesis) -> float:
    """Probability of an answer about a group of blocks, as the headline has it."""
    if len(block.ambiguity) < 2 and answer.terms:
        return words.chance_of_named(diagnosis, block)
    return words.chance_of(block.probabilities, answer.words)


def _place(diagnosis: Findings, block: BlockVerdict) -> str:
    """The block of a group with the mismatch, in words."""
    return words.spoken_name(words.located_block(diagnosis, block) or "rig")


def _healthy(diagnosis: Findings) -> str:
    """The title where no answer that is left has anything missing."""
    if diagnosis.off:
        channel, error = next(iter(diagnosis.off.items()))
        size = words.sized(error.after, error.unit)
        what = words.spoken_name(channel)
        model = words.with_article(words.model_name(diagnosis))
        return f"From its commands alone {model} of the whole rig misses {what} by {size}"
    place = words.judged_place(diagnosis) + words.beside_held(diagnosis)
    if diagnosis.verdict == "parameters":
        by = "values inside their tolerances explain the difference"
        return f"No physics is missing{place}: {by}"
    how = words.down_to(diagnosis)
    return f"Nothing is missing{place}: the model explains these recordings {how}"


def _listed(names: Sequence[str], most: int, last: str) -> str:
    """Some of several names: ``a, b or 3 more``."""
    told = list(names[:most])
    if len(names) > most:
        told.append(f"{len(names) - most} more")
    return words.listed(told, last)


def _phrase(diagnosis: Findings, block: BlockVerdict, most: int) -> str:
    """What the answers of a group that are left share, and at most so many of their names."""
    left = _answer(block)
    values = [term.is_value for h in left for term in h.terms]
    if len(left) == 1 and values and all(values):
        wrong = [w for w in diagnosis.wrong_parameters if w.name in left[0].words]
        off = _listed(list(map(words.sentence_of, wrong)), max(most, 1), "and")
        return f"The rig file is wrong: {off}"
    chances = {h: _chance(diagnosis, block, h) for h in left if h not in (NONE, PARAMETERS)}
    if left == [UNLISTED]:
        if not chances[UNLISTED] < diagnosis.settled:
            acts = f"Something acts in the {_place(diagnosis, block)}"
            explains = "that no effect of the catalogue explains"
            return _with_chance(f"{acts} {explains}", chances[UNLISTED])
        ranked = words.ranked_probabilities(block.probabilities, None)
        told_of = [(key, p) for key, p in ranked if key not in HEALTHY and p >= LEAST_TOLD]
        chances = {Hypothesis.parse(key): p for key, p in told_of}
    head = _head(diagnosis, block, left)
    told = [_with_chance(words.set_label(h.words), p) for h, p in chances.items()]
    return f"{head}: {_listed(told, most, 'or')}" if most and told else head


def _with_chance(text: str, chance: float) -> str:
    """Something with its probability behind it, where that is known."""
    return f"{text} ({words.format_probability(chance)})" if words.is_number(chance) else text


def _head(diagnosis: Findings, block: BlockVerdict, left: Sequence[Hypothesis]) -> str:
    """What the answers of a group that are left share, in words."""
    place = _place(diagnosis, block)
    if left[0] == NONE:
        return f"The model of the {place} may be complete; not ruled out"
    if left[0] == PARAMETERS:
        return f"Values may explain what the {place} misses; not ruled out"
    # what the whole rig still misses says nothing against names that are open anyway
    doubt = NONE in left or PARAMETERS in left or (bool(diagnosis.off) and len(left) == 1)
    doubt = doubt and left != [UNLISTED]
    values = [term.is_value for h in left for term in h.terms]
    if any(values):
        if all(values) and UNLISTED not in left:
            return f"The rig file {'may be' if doubt else 'is'} wrong about the {place}"
        return f"The {place} {'may differ' if doubt else 'differs'} from model and rig file"
    kinds = [{EFFECTS[t.id].shares for t in h.terms} for h in left if h.terms]
    shared = sorted(set.intersection(*kinds) - {""}) if kinds else []
    if shared and UNLISTED not in left:
        return f"The model of the {place} {'may leave' if doubt else 'leaves'} out {shared[0]}"
    return f"Something {'may act' if doubt else 'acts'} in the {place} that the model leaves out"


def _missing(block: BlockVerdict) -> float:
    """Probability that something is missing or wrong in a group of blocks."""
    healthy = (words.chance_of(block.probabilities, [key]) for key in ("none", "parameters"))
    return min(1.0, max(0.0, 1.0 - sum(p for p in healthy if words.is_number(p))))


def facts(diagnosis: Findings) -> list[tuple[str, str]]:
    """What the first screen says in numbers: the block with its own probability, the name with its,
    the size on the bench, and what the model misses with what was found.
    """
    if diagnosis.misread:
        return [
            (f"{m.likely}, not {m.said}", ", ".join(map(words.spoken_name, m.channels)))
            for m in diagnosis.misread
        ]
    found = []
    groups = _answering(diagnosis)
    if groups and groups[0].probabilities:
        block = groups[0]
        located = words.located_block(diagnosis, block) or "rig"
        at = f" in {words.blocks_label(block)}" if len(block.blocks) > 1 else ""
        what = f"something is missing{at}: probability {words.format_probability(_missing(block))}"
        found.append((words.spoken_name(located), what))
    for block in groups[:2]:
        answer = _answer(block)[0]
        at = f" in the {_place(diagnosis, block)}" if len(groups) > 1 else ""
        chance = words.format_probability(_chance(diagnosis, block, answer))
        found.append((words.hypothesis_label(str(answer)), f"probability {chance}{at}"))
    if not groups:
        answer_told, p = words.leading(diagnosis)
        found.append((answer_told, f"probability {words.format_probability(p)}"))
    named = diagnosis.effects if diagnosis.verdict == "effects" else []
    for effect in sorted(named, key=lambda e: bool(groups) and e.term not in groups[0].effects):
        told = bench_value(effect)[:1]
        found += [(value, f"{words.label(effect.term)}: {name}") for name, value in told]
    left = [m for b in diagnosis.judged for m in b.mismatch]
    left = [m for m in left if (m.held_out or m.fitted).after.more_than_noise]
    worst = max(left, key=lambda m: (m.held_out or m.fitted).after.noises, default=None)
    channel = worst.channel if worst else diagnosis.where.channel
    channel = channel or next(iter(diagnosis.fit.held_out or diagnosis.fit.channels), None)
    last = words.miss(diagnosis, channel, "after")
    if channel and last:
        model = words.with_article(words.model_name(diagnosis))
        what = f"{words.spoken_name(channel)} missed by {model} ({last.size})"
        found.append((f"{words.format_number(last.noises, 2)} × noise", what))
    return found


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
    if bench is None:
        unit, factor = words.display_unit(own.unit, abs(own.value))
    else:
        mixed = effect.parameters.get(bench.mixed_by)
        part = float(mixed.value) if mixed else 0.0
        unit, factor = bench.unit, bench.factor + (bench.mixed - bench.factor) * part
    value = words.format_number(own.value * factor, 2)
    bounds = words.span95(own)
    low, high = (words.format_number(v * factor, 2) for v in bounds or (own.value, own.value))
    return with_unit(f"{value} ({low} to {high})" if bounds else value, unit)


def to_do(diagnosis: Findings) -> list[str]:
    """What to do on the bench about each answer that is left, and what to record next."""
    found = []
    for block in _answering(diagnosis)[:2]:
        for term in dict.fromkeys(t for h in _answer(block) for t in h.terms):
            if term.is_value:
                found.append(f"Measure {words.spoken_name(str(term))} again.")
            elif EFFECTS[term.id].bench:
                found.append(EFFECTS[term.id].bench)
    return list(dict.fromkeys(found))[:2]


def rivals(diagnosis: Findings) -> list[Rival]:
    """The explanations of each mismatch in the order of the title, the most probable first, and why
    each stands there; behind those of the located one the effects that come closest by themselves.
    """
    groups = _answering(diagnosis) or words.told_probabilities(diagnosis)
    several = len(groups) > 1
    found = []
    for block in groups[:2]:
        at = f" in the {_place(diagnosis, block)}" if several else ""
        most = MOST_RIVALS // 2 if several else MOST_RIVALS
        found += [row._replace(name=row.name + at) for row in _ranked(diagnosis, block, most)]
    return found


def _ranked(diagnosis: Findings, block: BlockVerdict, most: int) -> list[Rival]:
    """At most so many explanations of what one group of blocks misses."""
    ranked = words.ranked_probabilities(block.probabilities, None)
    shown = [(key, p) for key, p in ranked if p >= 0.005]
    shown += [(key, p) for key, p in ranked if p < 0.005 and key in ("none", "parameters")]
    known = {key for key, _ in ranked}
    closest = sorted(
        (row for row in diagnosis.tested if row.left is not None and row.id not in known),
        key=lambda row: row.left or 0.0,
    )
    shown = shown[:most]
    if diagnosis.where.block in block.blocks or not diagnosis.where.block:
        shown += [(row.id, 0.0) for row in closest[: max(0, most - len(shown))]]
    return [
        Rival(
            words.hypothesis_label(key),
            words.format_probability(p),
            max(0.0, min(1.0, p)),
            words.is_named(block, key),
            _why(diagnosis, block, key),
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


def _why(diagnosis: Findings, block: BlockVerdict, key: str) -> str:
    """Why an explanation has the probability that it has."""
    hypothesis, worst = Hypothesis.parse(key), words.worst_mismatch(block)
    channel = diagnosis.where.channel
    if worst and diagnosis.where.block not in block.blocks:
        channel = worst.channel
    about = words.spoken_name(channel) if channel else ""
    stage = {NONE: "before", PARAMETERS: "refit"}.get(hypothesis, "")
    missed = words.miss(diagnosis, channel, stage) if stage else None
    if missed:
        how = "as it is, the model" if stage == "before" else "refitted inside them, the model"
        return f"{how} misses {about} by {missed}"
    if hypothesis == UNLISTED:
        return "a cause without a name is never ruled out"
    taken = _taken(diagnosis, hypothesis.words)
    if taken is None:
        return ""
    told = f"takes {words.format_share(max(0.0, taken))} of what the refit leaves"
    best = _taken(diagnosis, [*block.effects, *block.wrong_parameters])
    if words.is_named(block, key) or best is None:
        return told
    if set(hypothesis.words) > {*block.effects, *block.wrong_parameters}:
        return f"{told}: no more than without the addition" if taken < best + AS_MUCH else told
    return f"{told} as well, with rarer values or names" if taken > best - AS_MUCH else told
