"""Words and numbers of a diagnosis: labels, number formats, the headline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeGuard

from pamrs.effects import EFFECTS
from pamrs.findings import (
    BlockVerdict,
    BudgetTerm,
    EffectFound,
    EffectParameterFound,
    Findings,
    Unexplained,
    WrongParameter,
)

__all__ = [
    "budget_sentence",
    "budgets",
    "display_unit",
    "effect_title",
    "format_number",
    "format_probability",
    "format_uncertain",
    "headline",
    "hypothesis_label",
    "is_named",
    "is_number",
    "kept_sentence",
    "label",
    "moved_parameters",
    "ranked_probabilities",
    "sentence_of",
    "set_label",
    "span95",
    "term_label",
]

_LABELS = {
    "none": "nothing missing",
    "parameters": "parameters in tolerance",
    "unlisted": "unlisted effect",
    **{effect.id: effect.label for effect in EFFECTS.values() if effect.label},
}

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DISPLAY = {
    "Pa": (("kPa", 1e-3, 1e3), ("Pa", 1.0, 0.0)),
    "rad": (("°", 180.0 / math.pi, 0.0),),
    "m": (("m", 1.0, 1.0), ("mm", 1e3, 0.0)),
    "m2": (("m2", 1.0, 1e-2), ("mm2", 1e6, 0.0)),
    "m3": (("m3", 1.0, 1.0), ("l", 1e3, 1e-3), ("cm3", 1e6, 0.0)),
    "s": (("s", 1.0, 0.1), ("ms", 1e3, 0.0)),
}


def label(identifier: str) -> str:
    """Readable name of a hypothesis, effect, block or channel id; pairs are joined by ``+``."""
    parts = [part.strip() for part in identifier.split("+")]
    return " + ".join(_LABELS.get(part, part.replace("_", " ")) for part in parts)


def set_label(identifiers: list[str]) -> str:
    """Readable name of a hypothesis: effects that act together, parameters that are wrong."""
    if not identifiers:
        return label("none")
    return " + ".join(
        f"wrong {label(i.replace('.', ' '))}" if "." in i else label(i) for i in identifiers
    )


def hypothesis_label(key: str) -> str:
    """Readable name of a hypothesis by its key, names joined by ``+``."""
    return set_label(key.split("+"))


def is_number(value: Any) -> TypeGuard[float]:
    """Whether `value` is a finite real number (NaN, infinities, None and text are not)."""
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


def span95(entry: EffectParameterFound) -> tuple[float, float] | None:
    """95 % interval of a parameter entry: its ``interval`` if given, else value ± 1.96 std."""
    interval = entry.interval
    if interval is not None and len(interval) == 2 and all(is_number(v) for v in interval):
        return float(interval[0]), float(interval[1])
    value, std = entry.value, entry.std
    if is_number(value) and is_number(std):
        return float(value) - 1.96 * float(std), float(value) + 1.96 * float(std)
    return None


def ranked_probabilities(diagnosis: Findings, count: int = 8) -> list[tuple[str, float]]:
    """Most probable hypotheses first, at most `count`; the rest is pooled under ``all others``."""
    known = [(k, float(v)) for k, v in diagnosis.probabilities.items() if is_number(v)]
    known.sort(key=lambda item: (-item[1], item[0]))
    if len(known) <= count:
        return known
    rest = known[count - 1 :]
    return [*known[: count - 1], (f"all others ({len(rest)})", sum(p for _, p in rest))]


def is_named(diagnosis: Findings, hypothesis: str) -> bool:
    """Whether `hypothesis` (an id, or ids joined by ``+``) is the one that the verdict names."""
    wrong = {w.name for w in diagnosis.wrong_parameters}
    effects = {e.id for e in diagnosis.effects} if diagnosis.verdict == "effects" else set()
    named = effects | wrong or {diagnosis.verdict}
    return set(hypothesis.replace(" ", "").split("+")) == named


def moved_parameters(diagnosis: Findings, least: float = 1.0) -> list[str]:
    """Names of identifiable parameters that moved by at least `least` tolerances, farthest
    first.
    """
    moved = [
        (abs(p.moved_sigmas), name)
        for name, p in diagnosis.parameters.items()
        if is_number(p.moved_sigmas) and p.identifiable is not False
    ]
    return [name for size, name in sorted(moved, reverse=True) if size >= least]


def sentence_of(wrong: WrongParameter) -> str:
    """What the rig file says of a parameter and what the recordings say:
    ``chamber dead volume is 360 +- 5 cm3, not 150 +- 23``.
    """
    unit, factor = display_unit(wrong.unit, abs(wrong.nominal))
    keys = ("value", "std", "nominal", "tolerance")
    values = {key: float(v) * factor if is_number(v := wrong[key]) else math.nan for key in keys}
    found = format_uncertain(values["value"], values["std"], unicode=False)
    stated = format_uncertain(values["nominal"], values["tolerance"], unicode=False)
    shown = "" if unit in ("", "1") else f" {unit}".replace("°", "deg")
    return f"{_spoken(wrong.name)} is {found}{shown}, not {stated}"


def kept_sentence(kept: Unexplained) -> str:
    """What is left in a block: ``the residual of the arm is 15 times the noise level (0.4 deg), and
    no listed effect explains it``.
    """
    unit, factor = display_unit(kept.unit, abs(kept.size))
    size = format_number(kept.size * factor, 2, unicode=False)
    why = (
        "no listed effect explains it"
        if kept.verdict == "unlisted"
        else "what is named does not explain it"
    )
    times = format_number(kept.noises, 2, unicode=False)
    return (
        f"the residual of the {_spoken(kept.block)} is {times} times the noise level ({size} "
        f"{unit}), and {why}"
    ).replace("°", "deg")


def _spoken(name: str) -> str:
    """A block or a parameter of the rig file by its dotted name, in words: ``chamber flexor``,
    ``chamber dead volume``.
    """
    return label(name.replace(".", " "))


def headline(diagnosis: Findings) -> str:
    """One sentence that states the verdict: what was found in each block, then what stays
    unexplained.
    """
    blocks = _blocks(diagnosis)
    named = [b for b in blocks if b.effects or b.wrong_parameters]
    doubtful = [b for b in blocks if b.verdict == "unlisted" and len(b.ambiguity) > 1]
    if not named and not doubtful:
        return _unnamed(diagnosis)
    found = [_found(diagnosis, block) for block in sorted(named, key=lambda b: not b.effects)]
    text = "; ".join(dict.fromkeys([*found, *(_found(diagnosis, block) for block in doubtful)]))
    open_ = {name for b in doubtful for name in b.blocks}
    kept = [
        kept_sentence(u)
        for u in diagnosis.unexplained
        if u.verdict == "unlisted" and u.block not in open_
    ]
    return "; ".join([text[:1].upper() + text[1:], *kept[:2]])


def _blocks(diagnosis: Findings) -> list[BlockVerdict]:
    """The groups of blocks with their names; one of the whole case where a result does not tell
    them apart.
    """
    if diagnosis.blocks:
        return diagnosis.blocks
    block = diagnosis.where.block
    return [
        BlockVerdict(
            blocks=[block] if block else [],
            verdict="",  # that of the case, which is told apart
            probabilities={},
            effects=[e.id for e in diagnosis.effects] if diagnosis.verdict == "effects" else [],
            wrong_parameters=[w.name for w in diagnosis.wrong_parameters],
            ambiguity=diagnosis.ambiguity,
        )
    ]


def _place(diagnosis: Findings, block: BlockVerdict) -> str:
    """Where a group has its mismatch, as the end of a sentence."""
    located = diagnosis.where.block
    if located not in block.blocks:
        # not the block that the answer is about first: the one of the group that misses most
        worst = max(block.mismatch, key=lambda m: m.fitted.refit.noises, default=None)
        located = worst.block if worst else next(iter(block.blocks), None)
    return f" in the {_spoken(located)}" if located else ""


def _found(diagnosis: Findings, block: BlockVerdict) -> str:
    """What was found in one group of blocks."""
    place = _place(diagnosis, block)
    if len(block.ambiguity) > 1:
        rivals = f"these recordings cannot tell {_from_each_other(block.ambiguity)}"
        healthy = any(s in (["none"], ["parameters"]) for s in block.ambiguity)
        if all(
            "." in name or name in ("none", "parameters") for s in block.ambiguity for name in s
        ):
            return f"the rig file {'may be' if healthy else 'is'} wrong: {rivals}"
        if healthy:
            return f"physics may be missing{place}: {rivals}"
        if any("." in name for s in block.ambiguity for name in s):
            return f"physics is missing{place}, or the rig file is wrong: {rivals}"
        return f"physics is missing{place}: {rivals}"
    told = {e.id: e for e in diagnosis.effects}
    if block.effects:
        names = " and ".join((told[e].name if e in told else "") or label(e) for e in block.effects)
        chances = [told[e].probability for e in block.effects if e in told]
        chance = min((p for p in chances if is_number(p)), default=math.nan)
        how_sure = f", probability {format_probability(chance)}" if math.isfinite(chance) else ""
        return f"the model leaves out: {names}{place}{how_sure}"
    wrong = {w.name: w for w in diagnosis.wrong_parameters}
    values = " and ".join(sentence_of(wrong[name]) for name in block.wrong_parameters)
    chance = min(wrong[name].probability for name in block.wrong_parameters)
    return f"the rig file is wrong: {values}, probability {format_probability(chance)}"


def _from_each_other(sets: list[list[str]]) -> str:
    """Hypotheses that are left: ``a from b``, ``a, b and c apart``."""
    told = [_answer(s) for s in sets]
    return (
        f"{told[0]} from {told[1]}"
        if len(told) == 2
        else f"{', '.join(told[:-1])} and {told[-1]} apart"
    )


def _answer(names: list[str]) -> str:
    """One of several hypotheses, in words."""
    if names == ["parameters"]:
        return "parameter values that are off"
    if names == ["unlisted"]:
        return "an effect outside the catalogue"
    if names == ["none"]:
        return "nothing missing"
    return " + ".join(f"a {set_label([name])}" if "." in name else label(name) for name in names)


def _unnamed(diagnosis: Findings) -> str:
    """The headline of a diagnosis without a name."""
    block = diagnosis.where.block
    place = f" in the {_spoken(block)}" if block else ""
    doubtful = [s for s in diagnosis.ambiguity if s not in (["none"], ["parameters"])]
    rivals = " or ".join(_answer(s) for s in doubtful)
    if diagnosis.verdict == "none" and doubtful:
        return (
            "The model explains these recordings down to the noise level, but they cannot rule out "
            f"{rivals}{place}"
        )
    if diagnosis.verdict == "none":
        return "Nothing is missing: the model explains these recordings down to the noise level"
    if diagnosis.verdict == "parameters" and doubtful:
        return (
            "Parameter values may explain the difference; these recordings cannot rule out "
            f"{rivals}{place}"
        )
    if diagnosis.verdict == "parameters":
        moved = [label(n.replace(".", " ")) for n in moved_parameters(diagnosis)[:3]]
        which = f": {', '.join(moved)}" if moved else ""
        return f"No physics is missing; parameter values explain the difference{which}"
    if len(doubtful) > 1:
        return (
            f"Physics is missing{place}: these recordings cannot tell {_from_each_other(doubtful)}"
        )
    kept = [kept_sentence(u) for u in diagnosis.unexplained if u.verdict == "unlisted"]
    return "; ".join([f"Physics outside the catalogue acts{place or ' on this rig'}", *kept[:2]])


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
    return set_label(term.id.split("+")) + form + held


def budgets(diagnosis: Findings) -> dict[str, list[BudgetTerm]]:
    """The terms of each block's budget, by its name."""
    found: dict[str, list[BudgetTerm]] = {}
    for term in diagnosis.budget:
        found.setdefault(term.block, []).append(term)
    return found


def effect_title(effect: EffectFound) -> str:
    """Name of an effect, with its form where it is not the usual one."""
    form = f", form: {label(effect.form)}" if effect.form else ""
    return (effect.name or label(effect.id)) + form


def budget_sentence(terms: Sequence[BudgetTerm]) -> str:
    """The budget of one block in words."""
    told = []
    for term in terms[:-1]:
        low, high = (100.0 * share for share in term.interval)
        told.append(f"{term_label(term)} {100 * term.share:.0f} % ({low:.0f} to {high:.0f})")
    last = terms[-1]
    unit, factor = display_unit(last.unit, abs(last.size))
    left = (
        f"{100 * last.share:.0f} % unexplained: {format_number(last.noises, 2)} noise levels, "
        f"{format_number(last.size * factor, 2)} {unit}"
        if last.noises > 0.0
        else "nothing unexplained beyond the noise"
    )
    return "; ".join([*told, left]) + "."
