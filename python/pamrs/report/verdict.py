"""The verdict of a diagnosis in a few sentences."""

from __future__ import annotations

from pamrs.channels import unit_of
from pamrs.findings import BlockVerdict, Findings
from pamrs.recordings import Case
from pamrs.report.text import (
    display_unit,
    down_to,
    effect_name,
    format_number,
    format_probability,
    is_number,
    is_open,
    judged_place,
    kept_sentence,
    leading,
    mended_sentence,
    name_chance,
    not_judged_words,
    off_sentence,
    open_chances,
    sentence_of,
    spoken_name,
    told_apart,
)
from pamrs.rig import Rig
from pamrs.rig.schema import qualified

_MENDED = 0.98  # share of a channel's error from which a wrong value is not said to mend it


def unknown_volumes(rig: Rig) -> list[str]:
    """Dotted names of the chambers' volumes that the rig file marks unknown."""
    names = [f"{qualified('chamber', name)}.dead_volume" for name in rig.tables("chamber")]
    return [name for name in names if not rig.parameter(name).known]


def verdict(diagnosis: Findings, case: Case, forms: list[str], *, sought: bool) -> str:
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


def _of_blocks(diagnosis: Findings, case: Case, forms: list[str], *, sought: bool) -> str:
    """The verdict of the blocks, in a few sentences."""
    kind = diagnosis.verdict
    missing = [b for b in diagnosis.judged if b.verdict == "unlisted"]
    if kind == "none":
        text = (
            f"These recordings show no missing physics{judged_place(diagnosis)}: the nominal model "
            f"predicts {_every(diagnosis)} {down_to(diagnosis)}."
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
            f"predicts {_every(diagnosis)} {down_to(diagnosis)}. Moved most: {moved}."
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
    """What the model misses then; empty where that is not known."""
    told = mended_sentence(diagnosis, by)
    return f" {told}, on {_proof(case)}." if told else ""


def _proof(case: Case) -> str:
    if case.held_out and case.fit:
        return "held-out recordings"
    return "the fitted recording (no other was given)"


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
    apart = told_apart(diagnosis.ambiguity, open_chances(diagnosis))
    return f" It is not settled: these recordings cannot tell {apart}."


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
