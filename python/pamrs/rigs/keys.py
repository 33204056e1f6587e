"""Every key of a rig file in words, for the comments of a template."""

from __future__ import annotations

import math
from itertools import groupby

from pamrs.rig_schema import BLOCKS, Key

__all__ = ["every_key"]

_INTRODUCTION = """\
Every key that a rig file may have. Each number is { value, unit }, any unit of the right dimension; with tol (one standard
deviation of what you know) it may move in a diagnosis or a fit, with unknown = true it is sought. Pressures are gauge.
A block that is left out is not there: only [gas] and [chamber] are needed."""


def every_key() -> str:
    """Comments with all blocks, their keys with unit, bounds and default, and the effects."""
    lines = [f"# {line}" for line in _INTRODUCTION.splitlines()]
    for block, keys in BLOCKS.items():
        lines += ["#", f"# [{block}]"]
        for group, members in groupby(keys, key=lambda key: key.where[0] if len(key.where) > 1 else ""):
            if group:
                lines.append(f"# {group} = a table of:")
            lines += [f"#   {_line(key, inner=bool(group))}" for key in members]
    return "\n".join([*lines, "#", *_effects()]) + "\n"


def _line(key: Key, *, inner: bool) -> str:
    name = f"  {key.where[-1]}" if inner else key.where[-1]
    parts = [f"one of {', '.join(key.choices)}" if key.kind == "choice" else _numbers(key)]
    if key.default is None:
        parts.append("needed")
    elif key.default != "":
        parts.append(f"default {_plain(key.default)}")
    if key.only:
        parts.append(f"only with {', '.join(key.only)}")
    return f"{name:<22} {'; '.join(parts)}"


def _numbers(key: Key) -> str:
    what = {"vector": "list", "count": "whole number"}.get(key.kind, "number")
    unit = "" if key.unit == "1" else f" [{key.unit}]"
    bounds = f" from {key.lower:.4g} to {key.upper:.4g}" if math.isfinite(key.lower) and math.isfinite(key.upper) else ""
    return f"{what}{unit}{bounds}"


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(f'{item:g}' for item in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _effects() -> list[str]:
    from pamrs.effects_table import EFFECTS

    lines = ["# [[effects]]                physics that the blocks leave out, as often as needed"]
    for name, info in EFFECTS.items():
        lines.append(f'# id = "{name}"')
        for parameter in info.parameters:
            unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
            lines.append(f"#   parameters.{parameter.name}: number{unit}, default {parameter.default:g}")
    return lines
