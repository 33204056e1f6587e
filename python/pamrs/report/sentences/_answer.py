"""Sentences on the answer: the title and the headline, what all answers that are left share, how
sure that is, what to do on the bench, and why everything else lost.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from pamrs.effects import EFFECTS, NONE, PARAMETERS, UNLISTED, Hypothesis, Term, effect_of
from pamrs.findings import HEALTHY, BlockVerdict, EffectFound, Findings, Part
from pamrs.report.sentences._entries import (
    DOWN_TO_NOISE,
    down_to,
    effect_values,
    law_sentence,
    miss,
    missed_place,
    missed_sentence,
    not_judged_words,
    sentence_of,
    within_error,
    worst_channel,
)
from pamrs.report.words import (
    answer_label,
    blocks_label,
    capital,
    format_number,
    format_probability,
    format_share,
    grouped,
    hypothesis_label,
    is_number,
    label,
    listed,
    place,
    set_label,
    sized,
    spoken_name,
    with_article,
)

LONGEST = 24
"""Words of a title at most."""
MOST_RIVALS = 7
"""Explanations that are ranked on the first screen."""
LEAST_SHOWN = 0.05
"""Probability from which an explanation is in the title."""
AS_MUCH = 0.03
"""Difference of two shares of a mismatch below which both explain as much."""

_BADGES = {
    "none": ("nothing missing", "nothing missing, but not settled"),
    "parameters": ("parameters inside their tolerances", "parameters or physics, not settled"),
    "effects": ("missing physics named", "missing physics, the name is not settled"),
    "unlisted": ("missing physics, no name", "missing physics, no name"),
    "units": ("", "a channel is in another unit"),
    "wrong": ("a value of the rig file is wrong", "a value of the rig file may be wrong"),
}
"""Verdicts in a few words, settled and not settled; ``wrong`` is ``parameters`` where a value is
named."""
_MORE = ("not settled: what is missing was not found", "not settled: more is missing")
"""Verdicts where the final model still misses too much: without a name, and with one."""
_HEALTHY_HEADS = {
    NONE: "The model of the {} may be complete; not ruled out",
    PARAMETERS: "Values may explain what the {} misses; not ruled out",
}
_HEADS = {
    "file": ("The rig file is wrong about the {}", "The rig file may be wrong about the {}"),
    "both": ("The {} differs from model and rig file", "The {} may differ from model and rig file"),
    "effects": ("The model of the {} leaves out {}", "The model of the {} may leave out {}"),
    "something": (
        "Something acts in the {} that the model leaves out",
        "Something may act in the {} that the model leaves out",
    ),
}
"""Words on what answers share, sure and in doubt: values of the rig file, values and effects,
effects of one kind, or nothing."""
_TOGETHER = ", alone or with others"


class Rival(NamedTuple):
    """Explanation in a ranking: its name, probability in words and as a number, whether it is the
    answer, and the reason for its place.
    """

    name: str
    chance: str
    probability: float
    named: bool
    why: str


def case_badge(diagnosis: Findings) -> str:
    """The answer in a few words."""
    answer = diagnosis.answer
    if answer.missed:
        return _MORE[bool(answer.named)]
    wrong = [*answer.named, *(law.name for law in diagnosis.laws)]
    return _badge(answer.verdict, wrong, settled=answer.settled)


def _badge(verdict: str, named: Sequence[str], *, settled: bool) -> str:
    """A verdict in a few words, no surer than it is."""
    return _BADGES["wrong" if named and verdict == "parameters" else verdict][not settled]


def group_verdict(diagnosis: Findings, block: BlockVerdict) -> tuple[str, str, str]:
    """The verdict of a group of blocks, what it names, and what leads with its probability."""
    part = diagnosis.answer.part_of(block.blocks[0])
    if part is None:
        return "", "", ""
    lacking = {m.block for m in diagnosis.answer.missed} & {*block.blocks}
    badge = _badge(block.verdict, part.names, settled=part.sure and not lacking)
    leading = f"{answer_label(part.words)}, {chance_words(part)}"
    return badge, set_label(part.names) if part.names else "–", leading


def title(diagnosis: Findings) -> str:
    """One sentence of at most 24 words that states what all answers that are left share.

    Parameters
    ----------
    diagnosis : Findings
        What was found.
    """
    if diagnosis.misread:
        names = [spoken_name(n) for own in diagnosis.misread for n in own.channels]
        first = diagnosis.misread[0]
        verb = "are" if len(names) > 1 else "is"
        sentence = f"{listed(names, most=2)} {verb} likely {first.likely}, not {first.said}"
        return f"{capital(sentence)}: no physics was judged"
    if diagnosis.answer.missed and not diagnosis.answer.named:
        return missed_sentence(diagnosis, 1)
    parts = _reported(diagnosis)
    if not parts:
        wrong = [f"{law.name} is {law.other}, not {law.stated}" for law in diagnosis.laws]
        return f"The rig file is wrong: {wrong[0]}" if wrong else healthy_sentence(diagnosis)
    together = _together(diagnosis, parts)
    if together and len(together.split()) <= LONGEST:
        return together
    # a value may be wrong in several groups
    other = [
        part
        for part in parts[1:]
        if not (part.sure and part.group.wrong_parameters and part.names == parts[0].names)
    ]
    nameless = [part.sure and part.words == ("unlisted",) for part in other]
    what = (
        ("an effect outside the catalogue" if all(nameless) else "something else")
        + ", in part outside the catalogue," * (any(nameless) and not all(nameless))
        + (" in" if all(part.sure for part in other) else " may act in")
    )
    end = f"; {what} the {listed([*map(place, other)], most=2)}" * bool(other)
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
    first = [*(entry.text for entry in diagnosis.faulty), *map(law_sentence, diagnosis.laws)]
    if diagnosis.misread:
        return ". ".join([*first, "; ".join(reading.text for reading in diagnosis.misread)])
    parts, missed = _reported(diagnosis), missed_sentence(diagnosis)
    each = (_phrase(diagnosis, p, MOST_RIVALS) + _missing_input(diagnosis, p) for p in parts)
    together = _together(diagnosis, parts)
    phrases = [together] if together else list(dict.fromkeys(each))
    still = [missed] * bool(missed)
    sentences = [*phrases, *still] if diagnosis.answer.named else [*still, *phrases]
    sentences = sentences or [title(diagnosis)]
    rest = [*within_error(diagnosis), *not_judged_words(diagnosis)]
    return ". ".join([*first, *sentences[:-1], "; ".join([sentences[-1], *rest])])


def _reported(diagnosis: Findings) -> list[Part]:
    """Groups of which something is said; where more is missed, those for which names were tried."""
    answer = diagnosis.answer
    return [part for part in answer.parts if not answer.missed or searched(part)]


def searched(part: Part) -> bool:
    """True where anything with a name was tried for what a group of blocks misses."""
    return any(key not in (*HEALTHY, "unlisted") for key in part.group.probabilities)


def _together(diagnosis: Findings, parts: Sequence[Part]) -> str:
    """Sentence on names of several groups, each with its place and probability, where none leaves
    anything open: ``The model leaves out pressure lag in the arm (0.95) and in the chamber
    (0.93)``.
    """
    if len(parts) < 2 or any(p.group.wrong_parameters or not p.sure for p in parts):
        return ""
    named = grouped(
        (
            set_label(part.names) if part.names else "an effect outside the catalogue",
            _with_chance(f"in the {place(part)}", part),
        )
        for part in parts
    )
    verb = "may leave" if diagnosis.answer.missed else "leaves"
    return f"The model {verb} out {listed([f'{n} {listed(own)}' for n, own in named.items()])}"


def healthy_sentence(diagnosis: Findings) -> str:
    """Sentence for a result where no answer that is left has anything missing: in the judged blocks
    where some were not, and in addition to the effects that the model had before.
    """
    judged = " and ".join(map(blocks_label, diagnosis.judged if diagnosis.not_judged else ()))
    ids = [term.id for term in diagnosis.budget if term.kind == "held"]
    ids += [effect.id for name in diagnosis.parameters if (effect := effect_of(name))]
    held = " and ".join(f"the {label(i)}" for i in dict.fromkeys(ids) if i in EFFECTS)
    where = f" in the {judged}" * bool(judged)
    where += f" in addition to {held} that the model holds" * bool(held)
    how, unseen = down_to(diagnosis), diagnosis.answer.why == "unseen"
    where += " that these recordings would show" * unseen
    if diagnosis.answer.verdict == "parameters":
        by = "values inside their tolerances explain the difference"
        return f"No physics is missing{where}: {by}" + f" {how}" * (how != DOWN_TO_NOISE)
    what = "them" if unseen else "these recordings"
    return f"Nothing is missing{where}: the model explains {what} {how}"


def _phrase(diagnosis: Findings, part: Part, most: int) -> str:
    """Words on what the answers left of a group share, and at most so many of their names."""
    left = [Hypothesis.of(own) for own, _ in part.left]
    doubt = bool(diagnosis.answer.missed) or not part.sure
    values = [term.is_value for h in left for term in h.terms]
    if len(left) == 1 and values and all(values):
        wrong = [w for w in diagnosis.wrong_parameters if w.name in part.words]
        off = listed(list(map(sentence_of, wrong)), most=max(most, 1))
        return f"The rig file {'may be' if doubt else 'is'} wrong: {off}"
    if left == [UNLISTED] and part.sure:
        acts = f"Something acts in the {place(part)} that no effect of the catalogue explains"
        return _with_chance(acts, part)
    chances = {h: p for h, (_, p) in zip(left, part.left, strict=True)}
    if len(left) == 1:  # rivals of which none is probable enough for a set
        ranked = ranked_probabilities(part.group.probabilities, None)
        chances |= {
            Hypothesis.parse(k): p for k, p in ranked if p >= LEAST_SHOWN and not part.names
        }
    named = [
        _with_chance(set_label(h.words), part if h == left[0] else chance)
        for h, chance in chances.items()
        if h not in (NONE, PARAMETERS)
    ]
    head = _head(place(part), left, doubt=doubt)
    return f"{head}: {listed(named, 'or', most)}" if most and named else head


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
    shown = chance_words(chance) if isinstance(chance, Part) else format_probability(chance)
    return f"{text} ({shown})" if is_number(known) else text


def _head(where: str, left: Sequence[Hypothesis], *, doubt: bool) -> str:
    """Words on what the answers that are left of a group share."""
    if left[0] in _HEALTHY_HEADS:
        return _HEALTHY_HEADS[left[0]].format(where)
    # what is still missed says nothing against names that are open anyway
    doubt = NONE in left or PARAMETERS in left or (doubt and len(left) == 1)
    values = [term.is_value for h in left for term in h.terms]
    kinds = [{EFFECTS[t.id].shares for t in h.terms if t.is_effect} for h in left if h.terms]
    shared = sorted(set.intersection(*kinds) - {""}) if kinds else []
    kind = "effects"
    if any(values):
        kind = "file" if all(values) and UNLISTED not in left else "both"
    elif not shared or UNLISTED in left:
        kind, doubt = "something", doubt and left[0] != UNLISTED
    return _HEADS[kind][doubt].format(where, *shared)


def chance_words(part: Part) -> str:
    """Probability of what leads a group: ``0.93``, or ``0.60, alone or with others`` of names that
    its sets have in common.
    """
    return format_probability(part.probability) + _TOGETHER * part.together


def name_chance(diagnosis: Findings, name: str) -> str:
    """Probability of one name, and that it counts sets with others where these make a
    difference: ``0.93, alone or with others``; where several groups of blocks name it, that of
    each: ``0.94 in the chamber, 0.92 in the arm``.
    """
    naming = [part for part in diagnosis.answer.parts if name in part.names]
    chances = [format_probability(part.with_name(name)) for part in naming]
    if len(naming) == 1:
        return chances[0] + _TOGETHER * (chances[0] != chance_words(naming[0]))
    return ", ".join(f"{p} in the {place(part)}" for p, part in zip(chances, naming, strict=True))


def unsure_names(diagnosis: Findings) -> set[str]:
    """Names of groups of blocks that are not settled."""
    answer = diagnosis.answer
    return {n for part in answer.parts for n in part.names if answer.missed or not part.sure}


def unsettled_sentence(diagnosis: Findings) -> str:
    """Sentence on why an answer is not settled; empty where it is."""
    answer = diagnosis.answer
    several = len(answer.parts) > 1
    missing = f"{with_article(answer.model)} misses more than noise and its error explain"
    reasons = [missing] * bool(answer.missed)
    reasons += [
        f"these recordings cannot tell {told_apart(part)}" + f" in the {place(part)}" * several
        for part in answer.parts
        if len(part.left) > 1
    ]
    reasons += [
        f"{set_label(part.words)} has {chance_words(part)}, and more than {diagnosis.settled} is "
        "needed"
        for part in answer.parts
        if len(part.left) == 1 and not part.sure
    ]
    reasons += [
        f"effects that these recordings would hardly show at their usual sizes have a probability "
        f"of {format_probability(1.0 - answer.probability)}{_listed_unseen(diagnosis)}"
    ] * (answer.why == "unseen")
    reasons += [
        f"what is missing in the {place(part)} has no name"
        for part in answer.parts
        if part.sure and part.words == ("unlisted",)
    ]
    return f"It is not settled: {'; '.join(reasons)}." if reasons else ""


def _listed_unseen(diagnosis: Findings) -> str:
    """Effects below their limits, in parentheses; empty where none is wholly below."""
    names = [label(own.effect) for own in diagnosis.limits if own.verdict == "not seen"]
    return f" ({listed(names, most=4)})" if names else ""


def explanation_label(part: Part | None, key: str) -> str:
    """Readable name of a hypothesis of a group of blocks: what has no name is not seen where
    nothing is missing.
    """
    if part is not None and key == UNLISTED.rest and part.group.unseen > 0.0:
        return "effect that is not seen here"
    return hypothesis_label(key)


def told_apart(part: Part) -> str:
    """Hypotheses that are left of a group, the one that leads first: ``a (0.80) from b (0.12)``,
    ``a (0.50), b (0.30) and c (0.20) apart``.
    """
    names = {name for words, _ in part.left for name in words}
    answers = [_answer([_spread(n, names) for n in own], chance) for own, chance in part.left]
    return " from ".join(answers) if len(answers) == 2 else f"{listed(answers)} apart"


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
    return _with_chance(text, chance)


def left_sentences(diagnosis: Findings) -> list[str]:
    """Answers that the recordings cannot separate, a sentence for each group of blocks."""
    several = (part.left for part in diagnosis.answer.parts if len(part.left) > 1)
    left = ["; ".join(answer_label(own) for own, _ in answers) + "." for answers in several]
    hidden = f"{answer_label([NONE.rest])}; effects below their limits{_listed_unseen(diagnosis)}."
    return [*left, *[hidden] * (diagnosis.answer.why == "unseen")]


def facts(diagnosis: Findings) -> list[tuple[str, str]]:
    """Numbers of the first screen: the block with its own probability, the name with its, the size
    on the bench, and what the model misses with what was found.
    """
    if diagnosis.misread:
        return [
            (f"{m.likely}, not {m.said}", ", ".join(map(spoken_name, m.channels)))
            for m in diagnosis.misread
        ]
    answer, parts = diagnosis.answer, diagnosis.answer.parts[:2]
    several = len(answer.parts or answer.quiet) > 1
    still = [
        (
            sized(own.size, own.unit),
            f"{spoken_name(own.channel)} still missed {missed_place(own)} "
            f"({format_number(own.noises, 2)} × noise)",
        )
        for own in answer.missed[:1]
    ]
    located = [
        (
            place(part),
            "something is missing or wrong"
            + f" in {blocks_label(part.group)}" * (len(part.group.blocks) > 1)
            + f": probability {format_probability(_missing(part))}",
        )
        for part in parts[:1]
        if part.group.probabilities
    ]
    leading = [
        (
            answer_label(part.words),
            f"probability {chance_words(part)}"
            + f" in the {_shown_place(diagnosis, part)}" * several,
        )
        for part in parts or ([] if answer.missed else answer.quiet)
    ]
    named = [e for e in diagnosis.effects if e.term in answer.named]
    named.sort(key=lambda e: bool(parts) and e.term not in parts[0].names)
    sizes = [size for effect in named for size in _bench_facts(effect)[:1]]
    channel = next(filter(None, map(_channel, parts)), None)
    channel = channel or diagnosis.where.channel or worst_channel(diagnosis)
    last = None if answer.missed else miss(diagnosis, channel, "after")
    if channel and last:
        what = f"{spoken_name(channel)} missed by {with_article(answer.model)} ({last.size})"
        sizes.append((f"{format_number(last.noises, 2)} × noise", what))
    found = [*located, *leading, *sizes]
    return [*found, *still] if answer.named else [*still, *found]


def _bench_facts(effect: EffectFound) -> list[tuple[str, str]]:
    """Sizes of an effect on the bench that have an interval, each with its name."""
    rows = effect_values(effect)
    return [(text, f"{label(effect.term)}: {label(name)}") for name, own, text in rows if own.std]


def _missing(part: Part) -> float:
    """Probability that something is missing or wrong in a group of blocks."""
    chances = part.group.probabilities
    return min(1.0, max(0.0, 1.0 - sum(chances.get(key, 0.0) for key in HEALTHY)))


def _channel(part: Part) -> str | None:
    """Channel of the block of a group that has the mismatch."""
    return next((m.channel for m in part.group.mismatch if m.block == part.block), None)


def _shown_place(diagnosis: Findings, part: Part) -> str:
    """Blocks of a group with nothing missing, the one with the mismatch of another."""
    return blocks_label(part.group) if part in diagnosis.answer.quiet else place(part)


def to_do(diagnosis: Findings) -> list[str]:
    """Sentences on what to do on the bench about each answer that is left."""
    found = []
    for part in diagnosis.answer.parts[:2]:
        for term in dict.fromkeys(t for own, _ in part.left for t in Hypothesis.of(own).terms):
            if term.is_value:
                found.append(f"Measure {spoken_name(str(term))} again.")
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


def is_named(part: Part | None, hypothesis: str) -> bool:
    """True where `hypothesis` (an id, or ids joined by ``+``) is the one that leads a group."""
    return part is not None and set(hypothesis.split("+")) == set(part.words)


def rivals(diagnosis: Findings) -> list[Rival]:
    """Explanations of each mismatch in the order of the title, the most probable first, with the
    reason for each; after those of the located one the effects that come closest alone.
    """
    shown = bars(diagnosis)
    several = len(shown) > 1
    found = []
    for part, chances in shown[:2]:
        at = f" in the {_shown_place(diagnosis, part)}" if part and several else ""
        rows = _ranked(diagnosis, part, chances, MOST_RIVALS // 2 if several else MOST_RIVALS)
        found += [row._replace(name=row.name + at) for row in rows]
    return found


def _ranked(
    diagnosis: Findings, part: Part | None, chances: Mapping[str, float], most: int
) -> list[Rival]:
    """Explanations of what one group of blocks misses, at most so many."""
    ranked = ranked_probabilities(chances, None)
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
            explanation_label(part, key),
            format_probability(p),
            max(0.0, min(1.0, p)),
            is_named(part, key),
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
        and is_number(own.gap_closed)
    )
    return next((float(v) for v in (*alone, *fitted) if is_number(v)), None)


def _why(diagnosis: Findings, part: Part | None, key: str) -> str:
    """Reason why an explanation has its probability."""
    hypothesis = Hypothesis.parse(key)
    if hypothesis == UNLISTED:
        if part is not None and part.group.unseen > 0.0:
            return "of some effects usual sizes leave less than noise and error here (limits)"
        return "a cause without a name is never ruled out"
    channel = (_channel(part) if part else None) or diagnosis.where.channel
    stage = {NONE: "before", PARAMETERS: "refit"}.get(hypothesis, "")
    missed = miss(diagnosis, channel, stage) if stage else None
    if missed and channel:
        how = "as it is, the model" if stage == "before" else "refitted inside them, the model"
        return f"{how} misses {spoken_name(channel)} by {missed}"
    taken = _taken(diagnosis, hypothesis.words)
    if taken is None or part is None:
        return ""
    takes = f"takes {format_share(max(0.0, taken))} of what the refit leaves"
    best = _taken(diagnosis, part.names)
    if is_named(part, key) or best is None:
        return takes
    if set(hypothesis.words) > set(part.names):
        return f"{takes}: no more than without the addition" if taken < best + AS_MUCH else takes
    return f"{takes} as well, with rarer values or names" if taken > best - AS_MUCH else takes
