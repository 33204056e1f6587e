"""The verdict of a diagnosis in a few paragraphs."""

from __future__ import annotations

from collections.abc import Sequence

from pamrs.channels import unit_of
from pamrs.findings import EffectFound, Findings, Part, WrongParameter
from pamrs.recordings import Case
from pamrs.report.sentences._answer import (
    healthy_sentence,
    name_chance,
    searched,
    unsettled_sentence,
    unsure_names,
)
from pamrs.report.sentences._entries import (
    kept_sentence,
    mended_sentence,
    missed_sentence,
    not_judged_words,
    sentence_of,
)
from pamrs.report.words import (
    capital,
    effect_name,
    format_probability,
    is_number,
    listed,
    place,
    sized_alike,
    spoken_name,
)
from pamrs.rig import Rig
from pamrs.rig.schema import qualified

_MENDED = 0.98  # share of a channel's error from which a wrong value is not said to mend it
_MOST_MOVED = 3  # values of the rig file that are named as moved


def unknown_volumes(rig: Rig) -> list[str]:
    """Dotted names of the chambers' volumes that the rig file marks unknown."""
    names = [f"{qualified('chamber', name)}.dead_volume" for name in rig.tables("chamber")]
    return [name for name in names if not rig.parameter(name).known]


def verdict(diagnosis: Findings, case: Case, forms: list[str], *, sought: bool) -> str:
    """The verdict in a few sentences: what each group of blocks lacks, what is still missed (first
    where nothing has a name), why that is not settled, and what was not judged.

    ``forms`` say what a mismatch without a name is a function of, if that was ``sought``.
    """
    answer = diagnosis.answer
    without = [p for p in answer.parts if p.group.verdict == "unlisted"]
    healthy = [p for p in answer.parts if not p.names and p not in without]
    unexplained = _without_name(diagnosis, without) if without else ""
    leads = answer.parts[:1] == without[:1]  # what has no name
    main = [
        "" if answer.parts or answer.missed else _healthy(diagnosis),
        unexplained if leads else "",
        _effects(diagnosis, case),
        _mistaken(diagnosis),
        *(
            f"The {place(p)} may lack nothing (probability {format_probability(p.probability)})."
            for p in healthy
        ),
        diagnosis.where.text if healthy and answer.parts[:1] == healthy[:1] else "",
    ]
    still = [f"{missed_sentence(diagnosis, len(answer.missed))}."] * bool(answer.missed)
    main = [*main, *still] if answer.named else [*still, *main]
    paragraphs = [
        _joined(*main, unsettled_sentence(diagnosis)),
        "" if leads else unexplained,
        _form(diagnosis, case, forms, sought=sought, nameless=bool(without)),
        *(f"{capital(words)}." for words in not_judged_words(diagnosis)),
    ]
    return "\n\n".join(filter(None, paragraphs))


def _joined(*sentences: str) -> str:
    return " ".join(filter(None, sentences))


def _healthy(diagnosis: Findings) -> str:
    """The verdict where nothing is missing, and the values that moved most."""
    text = f"{healthy_sentence(diagnosis)}."
    far = {n: p.moved_sigmas for n, p in diagnosis.parameters.items() if p.known}
    if diagnosis.answer.verdict == "none" or not far:
        return text
    most = sorted(far.items(), key=lambda item: -abs(item[1]))[:_MOST_MOVED]
    return f"{text} Moved most: {', '.join(f'{n} by {v:+.1f} tolerances' for n, v in most)}."


def _opening(diagnosis: Findings, named: Sequence[EffectFound | WrongParameter], claim: str) -> str:
    """A claim, no surer than it is: as what is most probable where it is not settled."""
    names = {own.term if isinstance(own, EffectFound) else own.name for own in named}
    unsure = diagnosis.answer.missed or names & unsure_names(diagnosis)
    return f"Most probable is that {claim}" if unsure else capital(claim)


def _effects(diagnosis: Findings, case: Case) -> str:
    """The effects that are named, where the mismatch is, and what is missed with them."""
    found = [e for e in diagnosis.effects if e.term in diagnosis.answer.named]
    if not found:
        return ""
    effects = [
        f"{effect_name(e)} ({e.id}, probability {name_chance(diagnosis, e.term)})" for e in found
    ]
    leads = diagnosis.answer.parts[0]
    by = "With it," if len(found) == 1 else "With them,"
    corrected = any(e.correction for e in found)
    volume = (
        "The chamber's volume is not known. The recording determines the time constant and "
        "the conductance per volume; the conductance itself holds only for the placeholder "
        "volume of the rig file."
    )
    return _joined(
        f"{_opening(diagnosis, found, 'the model leaves out')}: {listed(effects)}.",
        diagnosis.where.text if leads.group.effects else "",
        # with a correction, what the model misses with both is reported there
        "" if corrected else mended_sentence(diagnosis, by),
        volume if unknown_volumes(case.rig) else "",
    )


def _mistaken(diagnosis: Findings) -> str:
    """Sentences on the values of the rig file that are wrong, and what that does to the error."""
    found = diagnosis.wrong_parameters
    if not found:
        return ""
    sentences = []
    # the error is that of the model with everything that was found
    addition = " with all that was found" if len(diagnosis.answer.named) > 1 else ""
    for wrong in found:
        mended = {c: e for c, e in wrong.held_out.items() if e.after < _MENDED * e.refit}
        errors = [
            f"the {spoken_name(channel)} is then missed{addition} by "
            f"{' instead of '.join(sized_alike([e.after, e.refit], unit_of(channel)))}, "
            "which values inside the tolerances leave"
            for channel, e in (mended or wrong.held_out).items()
        ]
        sentences.append(
            f"{sentence_of(wrong)} (probability {name_chance(diagnosis, wrong.name)}, "
            f"{abs(wrong.moved_sigmas):.0f} tolerances away); on {diagnosis.proof} "
            f"{'; '.join(errors)}."
        )
    return f"{_opening(diagnosis, found, 'the rig file is wrong')}: " + " ".join(sentences)


def _without_name(diagnosis: Findings, without: Sequence[Part]) -> str:
    """Sentences on what stays without a name, and where."""
    if diagnosis.answer.named:
        kept = [u for u in diagnosis.unexplained if u.verdict == "unlisted"]
        said = [f"{capital(kept_sentence(u))}." for u in kept]
        names = " and ".join(name for p in without for name in p.group.blocks)
        said = said or [f"Nothing that was tried explains the residual in {names}."]
        return _joined("What stays unexplained.", *said)
    if not any(map(searched, without)):
        return diagnosis.where.text
    outside = without[0].probability
    sure = f" (probability of an effect outside it: {format_probability(outside)})"
    text = (
        "Physics is missing, and no effect of the catalogue explains the data well enough to be "
        f"named{sure if is_number(outside) else ''}. {diagnosis.where.text}"
    )
    tried = ", ".join(
        f"{e.id}{f' at {e.at}' * bool(e.at)} ({e.probability:.0%})" for e in diagnosis.effects
    )
    return text + (f" Closest: {tried}." if tried else "")


def _form(
    diagnosis: Findings, case: Case, forms: list[str], *, sought: bool, nameless: bool
) -> str:
    """Form of what has no name, and of what named equations lack, or the reason for none."""
    corrections = {e.correction for e in diagnosis.effects}
    lacking = [form for form in forms if form in corrections]
    rest = [form for form in forms if form not in corrections]
    none = ""
    if nameless and not rest and sought:
        none = "No form of it carries over to other recordings."
    elif nameless and not rest and case.rig.model["load"]:
        none = "No form of it was searched for: the simulator has none for a load yet."
    return _joined(
        "What the named equations lack, as a form, which the model contains." if lacking else "",
        *lacking,
        "What is missing, as a form without a name, which the model contains." if rest else "",
        *rest,
        mended_sentence(diagnosis, f"With {'this' if lacking else 'it'} in the model,")
        if forms
        else "",
        none,
    )
