"""Words of a result as people read them: names, numbers, sizes, shares and probabilities, each in a
handy unit. The sentences are in `pamrs.report.sentences`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeGuard, TypeVar

from pamrs.channels import unit_of
from pamrs.effects import EFFECTS, Hypothesis, Term
from pamrs.findings import (
    HEALTHY,
    YOURS,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    EffectFound,
    EffectParameterFound,
    Part,
)
from pamrs.rig.schema import BLOCKS
from pamrs.units import with_unit

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

TELLING = 0.25
"""Distance below nothing or above everything within which a share is written as a number."""
FARTHEST = 3.0
"""Largest end of a share's interval that is written as a number."""

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = str.maketrans({"−": "-", "–": "-", "±": "+-", "°": "deg", "×": "x"}) | {
    raised: plain for plain, raised in _SUPERSCRIPT.items()
}
"""Signs that a terminal may lack, and others in their places."""
_DISPLAY = {
    "Pa": (("bar", 1e-5, 1e4), ("mbar", 1e-2, 0.0)),
    "rad": (("°", 180.0 / math.pi, 0.0),),
    "m": (("m", 1.0, 1.0), ("mm", 1e3, 0.0)),
    "m2": (("m2", 1.0, 1e-2), ("mm2", 1e6, 0.0)),
    "m3": (("m3", 1.0, 1.0), ("l", 1e3, 1e-3), ("cm3", 1e6, 0.0)),
    "s": (("s", 1.0, 0.1), ("ms", 1e3, 0.0)),
}
_LABELS = {
    "none": "nothing missing",
    "parameters": "parameters in tolerance",
    "unlisted": "effect outside the catalogue",
    "dahl": "Dahl",
    **{effect.id: effect.label for effect in EFFECTS.values() if effect.label},
}
_TERMS = {
    "parameters": "parameters inside tolerance",
    "form": "a form without a name",
    "unexplained": "unexplained",
}
"""Terms of a budget that name no effect and no value, by their kind."""


def grouped(pairs: Iterable[tuple[_Key, _Value]]) -> dict[_Key, list[_Value]]:
    """Values by what they share, in the order in which it first comes."""
    found: dict[_Key, list[_Value]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def label(identifier: str) -> str:
    """Readable name of a hypothesis, effect, block or channel id; pairs are joined by ``+``, and an
    effect at one block of several has its name behind an ``@``.
    """

    def readable(word: str) -> str:
        term = Term.parse(word)
        return _LABELS.get(term.id, term.id.replace("_", " ")) + _at(term.at)

    return " + ".join(map(readable, Hypothesis.parse(identifier).words))


def _at(block: str) -> str:
    return f" at {block.replace('_', ' ')}" if block else ""


def set_label(identifiers: Sequence[str]) -> str:
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
    return "no physics is missing" if names[:1] and names[0] in HEALTHY else set_label(names)


def listed(names: Sequence[str], last: str = "and", most: int | None = None) -> str:
    """Names in a row: ``a, b and c``; of more than `most` the first: ``a, b and 3 more``."""
    shown = list(names[:most])
    if len(names) > len(shown):
        shown.append(f"{len(names) - len(shown)} more")
    return f" {last} ".join(part for part in (", ".join(shown[:-1]), *shown[-1:]) if part)


def capital(text: str) -> str:
    """A text that begins a sentence."""
    return text[:1].upper() + text[1:]


def with_article(model: str) -> str:
    """The name of a model in a sentence: ``the mended model``, ``your model``."""
    return model if model == YOURS else f"the {model}"


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
    kind, of, group = spoken_name(name).partition(" of ")
    return f"{kind} block{of}{group}"


def blocks_label(block: BlockVerdict) -> str:
    """The blocks of a group, in words: ``supply and chamber``."""
    return " and ".join(map(spoken_name, block.blocks))


def place(part: Part) -> str:
    """The block of a group with the mismatch, in words."""
    return spoken_name(part.block or "rig")


def term_label(term: BudgetTerm) -> str:
    """Name of a term of a budget, for tables and figures."""
    if term.kind in _TERMS:
        return _TERMS[term.kind]
    held = ", in the model already" if term.kind == "held" else ""
    form = f" ({label(term.form)})" if term.form else ""
    return hypothesis_label(str(Term(term.id, term.at))) + form + held


def effect_name(effect: EffectFound, *, form: bool = False) -> str:
    """Name of an effect, with the block at which it acts where the rig has several of its kind; on
    demand with its form where it is not the usual one.
    """
    shape = f", form: {label(effect.form)}" if form and effect.form else ""
    return (effect.name or label(effect.id)) + _at(effect.at) + shape


def plain(text: str) -> str:
    """A text with the signs that every terminal has: ``(1.2 +- 0.1)e-9``."""
    return text.replace(" × 10", "e").translate(_PLAIN)


def typeset(text: str) -> str:
    """Text of a terminal as a page has it: ``361.9 ± 1.2 cm³``."""
    raised = re.sub(r"\b(c?m?m)([23])\b", lambda m: m[1] + {"2": "²", "3": "³"}[m[2]], text)
    return raised.replace("+-", "±")


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


def _minus(body: str) -> str:
    return body.replace("-", "−")


def _power(exponent: int) -> str:
    """Power of ten behind a number of that exponent; empty where it is written without one."""
    return "" if -4 < exponent < 6 else f" × 10{str(exponent).translate(_SUPERSCRIPT)}"


def format_number(value: Any, digits: int = 3) -> str:
    """Write a number with `digits` significant figures; an en dash when it is not finite."""
    if not is_number(value):
        return "–"
    x = float(value)
    if x == 0.0:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    power = _power(exponent)
    decimals = digits - 1 - (0 if power else exponent)
    rounded = round(x / 10.0**exponent if power else x, decimals)
    return _minus(f"{rounded:.{max(0, decimals)}f}") + power


def format_uncertain(value: Any, std: Any) -> str:
    """Write ``value ± std``, rounded to two figures of the standard deviation."""
    if not is_number(value) or not is_number(std) or float(std) <= 0.0:
        return format_number(value, 4)
    exponent = math.floor(math.log10(max(abs(value), std)))
    power = _power(exponent)
    x, s = (float(v) / 10.0 ** (exponent if power else 0) for v in (value, std))
    decimals = min(12, max(0, 1 - math.floor(math.log10(s))))
    body = _minus(f"{x:.{decimals}f} ± {s:.{decimals}f}")
    return f"({body}){power}" if power else body


def format_probability(p: Any) -> str:
    """Write a probability with two decimals, never rounding to certainty."""
    if not is_number(p):
        return "–"
    if float(p) > 0.995:
        return "> 0.99"
    return "< 0.01" if float(p) < 0.005 else f"{float(p):.2f}"


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
    return "0" if text == "-0" else _minus(text)


def format_interval(interval: Sequence[float]) -> str:
    """An interval of shares in percent: ``11 to 41``."""
    return " to ".join(map(_percent, interval))


def is_telling(share: float) -> bool:
    """True where a share says something by itself."""
    return -TELLING <= share <= 1.0 + TELLING


def sized(value: float, unit: str) -> str:
    """A size with its unit, as a terminal has it: ``8.5 mbar``."""
    return sized_alike([value], unit, 2)[0]


def sized_alike(values: Sequence[float], unit: str, digits: int = 3) -> list[str]:
    """Several sizes, each with the unit that suits the largest, as a terminal has them."""
    texts, shown = in_one_unit(unit, values, digits)
    return [plain(with_unit(text, shown)) for text in texts]


def in_one_unit(unit: str, values: Sequence[Any], digits: int = 3) -> tuple[list[str], str]:
    """Several sizes in the unit that suits the largest, and that unit.

    Parameters
    ----------
    unit : str
        SI unit.
    values : sequence of float or None
        In SI.
    digits : int
        Significant figures.
    """
    largest = max((abs(v) for v in values if is_number(v)), default=math.nan)
    shown, factor = display_unit(unit, largest)
    return [format_number(v * factor if is_number(v) else v, digits) for v in values], shown


def error_cells(
    errors: Mapping[str, ChannelError],
) -> list[tuple[str, str, dict[str, str], ChannelError]]:
    """Each channel of a table of errors with the unit that they are shown in, their texts by the
    keys of the entry, and the entry.
    """
    rows = []
    for channel, entry in errors.items():
        cells, unit = in_one_unit(unit_of(channel), list(entry.values()))
        rows.append((channel, unit, dict(zip(entry, cells, strict=True)), entry))
    return rows


def span95(entry: EffectParameterFound) -> tuple[float, float] | None:
    """95 % interval of a parameter entry: its ``interval`` if given, else value ± 1.96 std."""
    every = [tuple(entry.interval or ())]
    if is_number(entry.value) and is_number(entry.std):
        every.append((entry.value - 1.96 * entry.std, entry.value + 1.96 * entry.std))
    known = (own for own in every if len(own) == 2 and all(map(is_number, own)))
    return next(((float(low), float(high)) for low, high in known), None)
