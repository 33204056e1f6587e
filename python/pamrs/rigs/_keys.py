"""Every key of a rig file in words, for the comments of a template."""

from __future__ import annotations

import math
from itertools import groupby

from pamrs.rig.schema import BLOCKS, PORTS, SINGLE_BLOCKS, Key, Port

_INTRODUCTION = """\
Every key that a rig file may have. Each number is { value, unit }, any unit \
of the right dimension; with tol (one standard
deviation of what you know) it may move in a diagnosis or a fit, with unknown = true it is sought, \
with error = "own" it is another one in each recording. \
Pressures are gauge.
A block that is left out is not there: only [gas] and [chamber] are needed.

A block that is the only one of its kind needs no name. Several have one each, of letters, digits, \
_ and -: [valve.flexor] and
[valve.extensor], whose parameters are called valve.flexor.half_range and so on. A port is the \
name of another block, in full as
"chamber.flexor" or "supply", or only "flexor" where that is clear. [transmission.flexor] is that \
of [muscle.flexor], in place of the
joint's own; [sensors.flexor] has the zeros of [chamber.flexor] and [joint.flexor], [sensors] \
those of all of them."""


def every_key() -> str:
    """Comments with all blocks, their keys with unit, bounds and default, and the effects."""
    lines = [f"# {line}".rstrip() for line in _INTRODUCTION.splitlines()]
    for block, keys in BLOCKS.items():
        lines += [
            "#",
            f"# [{block}]"
            + ("" if block in SINGLE_BLOCKS else f" or, for each of several, [{block}.NAME]"),
        ]
        lines += [f"#   {_port(port)}" for port in PORTS.get(block, ())]
        for group, members in groupby(
            keys, key=lambda key: key.where[0] if len(key.where) > 1 else ""
        ):
            if group:
                lines.append(f"# {group} = a table of:")
            lines += [f"#   {_line(key, inner=bool(group))}" for key in members]
    return "\n".join([*lines, "#", *_effects()]) + "\n"


def _port(port: Port) -> str:
    """The comment of a port: what it may name and what it is where it is left out."""
    named = [f"name of a {kind}" for kind in port.kinds] + [f'"{word}"' for word in port.words]
    return f"{port.name:<22} {' or '.join(named)}; default {port.default}"


def _line(key: Key, *, inner: bool) -> str:
    name = f"  {key.where[-1]}" if inner else key.where[-1]
    parts = [f"one of {', '.join(key.choices)}" if key.kind == "choice" else _numbers(key)]
    if key.default is None:
        parts.append("needed")
    elif key.default != "":
        parts.append(f"default {_plain(key.default)}")
    if key.only:
        parts.append(f"only with {', '.join(key.only)}")
    if key.needs:
        parts.append(f"only with {key.needs}")
    if key.note:
        parts.append(key.note)
    return f"{name:<22} {'; '.join(parts)}"


def _numbers(key: Key) -> str:
    what = {"vector": "list", "count": "whole number"}.get(key.kind, "number")
    unit = "" if key.unit == "1" else f" [{key.unit}]"
    bounds = ""
    if math.isfinite(key.lower) and math.isfinite(key.upper):
        bounds = f" from {key.lower:.4g} to {key.upper:.4g}"
    return f"{what}{unit}{bounds}"


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(f'{item:g}' for item in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _effects() -> list[str]:
    from pamrs.effects import EFFECTS

    lines = ["# [[effects]]                physics that the blocks leave out, as often as needed"]
    for name, info in EFFECTS.items():
        lines.append(f'# id = "{name}"')
        if info.at:
            lines.append(
                f"#   at                   name of the one {info.at} that it acts on; default "
                f"{info.everywhere}"
            )
        for form in info.forms:
            if form is not info.forms[0]:
                lines.append(f'#   form = "{form.name}"')
            for parameter in form.parameters:
                unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
                lines.append(
                    f"#   parameters.{parameter.name}: number{unit}, default {parameter.default:g}"
                )
    return lines
