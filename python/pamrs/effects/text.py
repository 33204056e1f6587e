"""The catalogue as text: the list of its effects, one effect in full, and what switches it on in a
rig file.
"""

from __future__ import annotations

import difflib
import textwrap
from collections.abc import Mapping
from typing import Final

from pamrs.effects import CATALOGUE, EffectInfo, EffectParameter
from pamrs.errors import ParameterError

__all__ = ["catalogue", "description", "entry", "overview", "range_of", "snippet", "where"]

_WIDTH: Final = 100
_ORDER: Final = ("supply", "valve", "line", "chamber", "muscle", "joint", "arm", "sensors")


def catalogue() -> dict[str, list[EffectInfo]]:
    """The effects of the catalogue by block, blocks and effects in the order of the chain."""
    listed = CATALOGUE.values()
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
    """Where an effect acts, and how one place of several is chosen."""
    if not info.at:
        return info.everywhere
    return f"{info.everywhere}; with `at`, only the {info.at} of that name"


def range_of(parameter: EffectParameter) -> str:
    """Bounds of a parameter, where it is expected, and the value at which it does nothing."""
    text = f"{parameter.lower:g} to {parameter.upper:g}"
    text += (
        "" if parameter.expected is None else ", expected {:g} to {:g}".format(*parameter.expected)
    )
    return text if parameter.neutral is None else f"{text}, off at {parameter.neutral:g}"


def snippet(effect: str, values: Mapping[str, float] | None = None) -> str:
    """The lines of a rig file that switch an effect on.

    Parameters
    ----------
    effect : str
        Its id.
    values : mapping of str to float, optional
        SI values; what is left out has the catalogue's default.

    Returns
    -------
    str
        TOML, without a line break at its end.

    Raises
    ------
    ParameterError
        If there is no such effect.
    """
    info, given = entry(effect), values or {}
    width = max(len(parameter.name) for parameter in info.parameters)
    lines = ["[[effects]]", f'id = "{info.id}"', "[effects.parameters]"]
    for p in info.parameters:
        lines.append(
            f'{p.name:<{width}} = {{ value = {given.get(p.name, p.default):g}, unit = "{p.unit}" }}'
        )
    return "\n".join(lines)


def overview() -> str:
    """One line per effect: block, id, name."""
    rows = [(block, info.id, info.name) for block, infos in catalogue().items() for info in infos]
    left, middle = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [f"{'block':<{left}}  {'id':<{middle}}  name"]
    return "\n".join(
        [*lines, *(f"{block:<{left}}  {name:<{middle}}  {words}" for block, name, words in rows)]
    )


def description(effect: str) -> str:
    """One effect in full: equation, fingerprint, what it is confusable with, parameters, lines of a
    rig file.

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
    rows = [
        (
            p.name,
            f"{p.default:g} {p.unit}" if p.unit != "1" else f"{p.default:g}",
            range_of(p),
            p.meaning,
        )
        for p in info.parameters
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines += ["", "parameters: name, typical value, range, meaning", ""]
    for row in rows:
        lines.append(
            "  "
            + "  ".join(
                [*(f"{text:<{width}}" for text, width in zip(row, widths, strict=False)), row[3]]
            )
        )
    return "\n".join([*lines, "", "in a rig file", "", textwrap.indent(snippet(effect), "  ")])
