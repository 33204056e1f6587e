"""The verdict of a diagnosis in a few sentences."""

from __future__ import annotations

from collections.abc import Sequence

from pamrs.channels import unit_of
from pamrs.findings import EffectFound, Findings, Part, WrongParameter
from pamrs.recordings import Case
from pamrs.report.text import (
    capital,
    display_unit,
    down_to,
    effect_name,
    format_number,
    format_probability,
    is_number,
    judged_place,
    kept_sentence,
    listed,
    mended_sentence,
    missed_sentence,
    name_chance,
    not_judged_words,
    searched,
    sentence_of,
    spoken_name,
    unsettled_sentence,
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
    answer, first = diagnosis.answer, diagnosis.answer.parts[:1]
    without = [p for p in answer.parts if p.group.verdict == "unlisted"]
    still = [f"{missed_sentence(diagnosis, len(answer.missed))}."] * bool(answer.missed)
    main = [] if first or answer.missed else [_healthy(diagnosis)]
    main += [_effects(diagnosis, case), _mistaken(diagnosis)]
    unexplained = _without_name(diagnosis, without) if without else ""
    if first and first == without[:1]:  # what has no name leads
        main, unexplained = [unexplained, *main], ""
    healthy = [p for p in answer.parts if not p.names and p not in without]
    main += [
        f"The {spoken_name(p.block or 'rig')} may lack nothing "
        f"(probability {format_probability(p.probability)})."
        for p in healthy
    ]
    main += [diagnosis.where.text] if first and first == healthy[:1] else []
    main = [*main, *still] if answer.named else [*still, *main]
    main.append(unsettled_sentence(diagnosis))
    form = _form(diagnosis, case, forms, sought=sought) if without or forms else ""
    ends = [f"{capital(words)}." for words in not_judged_words(diagnosis)]
    paragraphs = [" ".join(filter(None, main)), unexplained, form, *ends]
    return "\n\n".join(filter(None, paragraphs))


def _healthy(diagnosis: Findings) -> str:
    """The verdict where nothing is missing."""
    judged = "every block that was judged" if diagnosis.not_judged else "every block"
    shows = f"These recordings show no missing physics{judged_place(diagnosis)}"
    if diagnosis.answer.verdict == "none":
        return f"{shows}: the nominal model predicts {judged} {down_to(diagnosis)}."
    far = {n: p.moved_sigmas for n, p in diagnosis.parameters.items() if p.known}
    most = sorted(far.items(), key=lambda item: -abs(item[1]))[:_MOST_MOVED]
    moved = ", ".join(f"{n} by {size:+.1f} tolerances" for n, size in most)
    return (
        f"{shows}, but parameters differ from their nominal values. With values inside their "
        f"tolerances the model predicts {judged} {down_to(diagnosis)}."
        + (f" Moved most: {moved}." if moved else "")
    )


def _opening(diagnosis: Findings, named: Sequence[EffectFound | WrongParameter], claim: str) -> str:
    """A claim, no surer than it is: as what is most probable where it is not settled."""
    names = {own.term if isinstance(own, EffectFound) else own.name for own in named}
    sure = all(p.sure for p in diagnosis.answer.parts if names & {*p.names})
    settled = sure and not diagnosis.answer.missed
    return capital(claim) if settled else f"Most probable is that {claim}"


def _effects(diagnosis: Findings, case: Case) -> str:
    """The effects that are named, where the mismatch is, and what is missed with them."""
    found = [e for e in diagnosis.effects if e.term in diagnosis.answer.named]
    if not found:
        return ""
    effects = [
        f"{effect_name(e)} ({e.id}, probability {name_chance(diagnosis, e.term)})" for e in found
    ]
    text = f"{_opening(diagnosis, found, 'the model leaves out')}: {listed(effects)}."
    leads = diagnosis.answer.parts[0]
    if leads.group.effects:
        text += f" {diagnosis.where.text}"
    if not any(e.correction for e in found):  # else what the model misses with both is told there
        text += _closed(diagnosis, "With it," if len(found) == 1 else "With them,")
    if unknown_volumes(case.rig):
        text += (
            " The chamber's volume is not known. The recording determines the time constant and "
            "the conductance per volume; the conductance itself holds only for the placeholder "
            "volume of the rig file."
        )
    return text


def _closed(diagnosis: Findings, by: str) -> str:
    """Sentence on what the model misses then; empty where that is not known."""
    sentence = mended_sentence(diagnosis, by)
    return f" {sentence}, on {diagnosis.proof}." if sentence else ""


def _mistaken(diagnosis: Findings) -> str:
    """Sentences on the values of the rig file that are wrong, and what that does to the error."""
    found = diagnosis.wrong_parameters
    if not found:
        return ""
    sentences = []
    # the error is that of the model with everything that was found
    addition = " with all that was found" if len(diagnosis.answer.named) > 1 else ""
    for wrong in found:
        mended = {
            channel: e for channel, e in wrong.held_out.items() if e.after < _MENDED * e.refit
        }
        errors_of = mended or wrong.held_out
        errors = "; ".join(
            f"the {spoken_name(channel)} is then missed{addition} by "
            f"{_instead(e.after, e.refit, unit_of(channel))}, which values inside the tolerances "
            "leave"
            for channel, e in errors_of.items()
        )
        sentences.append(
            f"{sentence_of(wrong)} (probability {name_chance(diagnosis, wrong.name)}, "
            f"{abs(wrong.moved_sigmas):.0f} tolerances away); on {diagnosis.proof} {errors}."
        )
    return f"{_opening(diagnosis, found, 'the rig file is wrong')}: " + " ".join(sentences)


def _instead(value: float, before: float, unit: str) -> str:
    """One size instead of another, in one unit."""
    shown, factor = display_unit(unit, max(value, before))
    now, was = (format_number(v * factor, 3, unicode=False) for v in (value, before))
    return f"{now} {shown} instead of {was} {shown}".replace("°", "deg")


def _without_name(diagnosis: Findings, without: Sequence[Part]) -> str:
    """Sentences on what stays without a name, and where."""
    answer = diagnosis.answer
    if answer.named:
        kept = [u for u in diagnosis.unexplained if u.verdict == "unlisted"]
        said = [capital(kept_sentence(u)) + "." for u in kept]
        names = " and ".join(name for p in without for name in p.group.blocks)
        said = said or [f"Nothing that was tried explains the residual in {names}."]
        return "What stays unexplained. " + " ".join(said)
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


def _form(diagnosis: Findings, case: Case, forms: list[str], *, sought: bool) -> str:
    """What has no name, or what a named equation lacks, as a form, or why there is none."""
    if forms:
        corrected = any(e.correction for e in diagnosis.effects)
        what = "What the named equations lack" if corrected else "What is missing"
        return (
            f"{what}, as a form without a name, which the model contains. "
            + " ".join(forms)
            + _closed(diagnosis, f"With {'both' if corrected else 'it'} in the model,")
        )
    if sought:
        return "No form of it carries over to other recordings."
    if case.rig.model["load"]:
        return "No form of it was searched for: the simulator has none for a load yet."
    return ""
