"""The catalogue as text: the list of its effects, one effect in full, and what switches it on in a
rig file.
"""

from __future__ import annotations

import difflib
import textwrap
from typing import Final

from pamrs._checks import refused
from pamrs.effects import CATALOGUE, EffectInfo, EffectParameter, Form
from pamrs.errors import ParameterError
from pamrs.units import with_unit

__all__ = ["catalogue", "description", "entry", "overview", "range_of", "snippet", "where"]

_WIDTH: Final = 100
_PLURAL: Final = {"supply": "supplies"}
_ORDER: Final = ("supply", "valve", "line", "chamber", "muscle", "joint", "arm", "sensors")


def catalogue() -> dict[str, list[EffectInfo]]:
    """The effects of the catalogue by block, blocks and effects in the order of the chain.

    Raises
    ------
    ValueError
        If an effect is in a block that has no place in that order.
    """
    listed = CATALOGUE.values()
    for info in listed:
        if info.block not in _ORDER:
            raise ValueError(
                f"the effect {info.id} is in the block {info.block!r}; there are: "
                f"{', '.join(_ORDER)}"
            )
    return {
        block: [info for info in listed if info.block == block]
        for block in _ORDER
        if any(i.block == block for i in listed)
    }


def entry(effect: str) -> EffectInfo:
    """One effect of the catalogue.

    Parameters
    ----------
    effect : str
        Its id.

    Returns
    -------
    EffectInfo

    Raises
    ------
    ParameterError
        If there is no such effect; names those with a name like it.
    """
    listed = {info.id: info for infos in catalogue().values() for info in infos}
    if effect in listed:
        return listed[effect]
    word = effect.lower().replace("-", "_")
    near = (
        [name for name in listed if word and word in name]
        or difflib.get_close_matches(word, listed, n=3, cutoff=0.6)
        or [
            name
            for name in listed
            if difflib.get_close_matches(word, name.split("_"), n=1, cutoff=0.6)
        ]
    )
    hint = (
        f"did you mean {' or '.join(near)}?" if near else f"the catalogue has: {', '.join(listed)}"
    )
    raise ParameterError(f"effect {effect!r} is not in the catalogue; {hint}")


def where(info: EffectInfo) -> str:
    """Words for the place of an effect, and for choosing one block of several."""
    if not info.at:
        return info.everywhere
    return f"{info.everywhere}; with `at`, only the {info.at} of that name"


def range_of(parameter: EffectParameter) -> str:
    """Bounds of a parameter, where it is expected, and the value at which it does nothing."""
    text = f"{parameter.lower:g} to {parameter.upper:g}"
    if parameter.expected is not None:
        text += ", expected {:g} to {:g}".format(*parameter.expected)
    return text if parameter.neutral is None else f"{text}, off at {parameter.neutral:g}"


def snippet(effect: str, *, form: str = "", at: str = "") -> str:
    """The lines of a rig file that switch an effect on, with its usual values.

    Parameters
    ----------
    effect : str
        Its id.
    form : str, optional
        Name of one of its forms; by default the first.
    at : str, optional
        Name of the one block on which it acts; by default it acts on every block of its kind.

    Returns
    -------
    str
        TOML, without a line break at its end.

    Raises
    ------
    ParameterError
        If there is no such effect, or it has no such form, or acts at no block.
    """
    info = entry(effect)
    chosen = _form(info, form)
    if at and not info.at:
        raise refused("at", at, f"{effect} acts on the whole rig")
    width = max(len(p.name) for p in chosen.parameters)
    lines = ["[[effects]]", f'id = "{info.id}"']
    lines += [f'at = "{at}"'] if at else []
    lines += [f'form = "{chosen.name}"'] if chosen is not info.forms[0] else []
    lines.append("[effects.parameters]")
    lines += [
        f'{p.name:<{width}} = {{ value = {p.default:g}, unit = "{p.unit}" }}'
        for p in chosen.parameters
    ]
    return "\n".join(lines)


def _form(info: EffectInfo, name: str) -> Form:
    """One form of an effect, the first without a name."""
    try:
        return info.form(name)
    except KeyError:
        allowed = ", ".join(repr(form.name) for form in info.forms)
        raise refused("form", name, f"{info.id} has {allowed}") from None


def overview() -> str:
    """One line per effect: block, id, name."""
    rows = [(block, info.id, info.name) for block, infos in catalogue().items() for info in infos]
    left, middle = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [f"{'block':<{left}}  {'id':<{middle}}  name"]
    return "\n".join(
        [*lines, *(f"{block:<{left}}  {name:<{middle}}  {words}" for block, name, words in rows)]
    )


def description(effect: str) -> str:
    """One effect in full: equation, fingerprint, what it is confusable with, its forms with their
    parameters, lines of a rig file.

    Parameters
    ----------
    effect : str
        Its id.

    Returns
    -------
    str

    Raises
    ------
    ParameterError
        If there is no such effect.
    """
    info = entry(effect)
    facts = {
        "block": info.block,
        "acts on": where(info),
        "equation": info.equation,
        "fingerprint": info.fingerprint,
        "looks like": ", ".join(info.rivals),
        "told apart": info.separates,
        "reference": info.reference,
    }
    lines = [f"{info.id}: {info.name}", ""]
    for head, text in facts.items():
        lines += textwrap.wrap(
            text, _WIDTH, initial_indent=f"  {head:<13}", subsequent_indent=" " * 15
        )
    for form in info.forms:
        lines += ["", *_parameters(info, form)]
    for head, example in _examples(info).items():
        lines += ["", head, "", textwrap.indent(example, "  ")]
    return "\n".join(lines)


def _parameters(info: EffectInfo, form: Form) -> list[str]:
    """A table of the parameters of a form."""
    rows = [
        (p.name, with_unit(f"{p.default:g}", p.unit), range_of(p), p.meaning)
        for p in form.parameters
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    usual = " (the usual one)" if form is info.forms[0] else ""
    head = f"form {form.name}{usual}, " if len(info.forms) > 1 else ""
    lines = [] if form is info.forms[0] else [f"form {form.name}: {form.equation}", ""]
    lines += [f"{head}parameters: name, typical value, range, meaning", ""]
    for row in rows:
        cells = [*(f"{text:<{width}}" for text, width in zip(row, widths, strict=False)), row[3]]
        lines.append("  " + "  ".join(cells))
    return lines


def _examples(info: EffectInfo) -> dict[str, str]:
    """Lines of a rig file under what they are for: each form, and an effect at two blocks with
    values of its own.
    """
    found = {"in a rig file": snippet(info.id)}
    for form in info.forms[1:]:
        found[f"in a rig file, form {form.name}"] = snippet(info.id, form=form.name)
    hangs = "hanging" in info.forms[0].ports  # one alone can hang
    names = [f"{info.at}_{end}" for end in ("a", "b")[: 1 if hangs else 2]]
    if info.at:
        several = f"in a rig with several {_PLURAL.get(info.at, info.at + 's')}, by their names"
        found[several] = "\n\n".join(snippet(info.id, at=name) for name in names)
    return found
