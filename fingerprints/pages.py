"""The pages of the catalogue: its index, and one page for each effect."""

from __future__ import annotations

from fingerprints.table import EXPERIMENTS
from pamrs.effects import EFFECTS, EffectInfo, Form
from pamrs.effects.text import catalogue, snippet, where

__all__ = ["COMMAND", "pages"]

COMMAND = "make effects"

INDEX = f"""\
# The physics that a model can leave out

Made by `{COMMAND}` from the table of the package (`pamrs.effects`); `pamrs effects` prints it, \
`pamrs effects ID` one entry.
Every page has the equation, the parameters, what is confused with the effect and what separates \
the two, the lines of a rig file, and
the fingerprint as the simulator draws it: the same experiment without the effect (orange) and \
with it (blue).
"""

PAGE = """\
# `{id}`: {name}

Made by `{command}`. Block: {block}. Acts on {where}. [All effects](README.md)

```text
{equation}
```

**Fingerprint**: {fingerprint}.

![{look}]({id}.png)

*{look}.* On the packaged rig `{rig}`: {experiment}. Orange without the effect, blue with \
it{values}.

## Confusable with

{rivals}

What separates them: {separates}.

## Parameters

{parameters}
{forms}
## In a rig file

```toml
{snippet}
```

In Python: `rig.with_effect("{id}", {given})`.

Reference: {reference}.
"""


def pages() -> dict[str, str]:
    """Every page by the name of its file."""
    listed = [info for infos in catalogue().values() for info in infos]
    return {"README.md": index(), **{f"{info.id}.md": page(info) for info in listed}}


def index() -> str:
    """The list of all effects by block."""
    lines = [INDEX]
    for block, infos in catalogue().items():
        rows = [
            [
                f"[`{i.id}`]({i.id}.md)",
                i.name,
                i.fingerprint,
                ", ".join(linked(rival) for rival in i.rivals),
            ]
            for i in infos
        ]
        lines += [
            f"## {block}",
            "",
            *table(["id", "effect", "fingerprint", "confusable with"], rows),
            "",
        ]
    return "\n".join(lines)


def page(info: EffectInfo) -> str:
    """The page of one effect."""
    shown = EXPERIMENTS[info.id]
    units = {parameter.name: parameter.unit for parameter in info.parameters}
    values = [
        f"`{name}` {value:g} {units[name]}".removesuffix(" 1")
        for name, value in shown.values.items()
    ]
    return PAGE.format(
        id=info.id,
        name=info.name,
        command=COMMAND,
        block=info.block,
        where=where(info),
        equation=info.equation,
        fingerprint=info.fingerprint,
        look=shown.look[0].upper() + shown.look[1:],
        rig=shown.rig,
        experiment=shown.words,
        values=f" ({', '.join(values)})" if values else "",
        rivals="\n".join(
            f"- {linked(rival)}{f': {EFFECTS[rival].name}' if rival in EFFECTS else ''}"
            for rival in info.rivals
        ),
        separates=info.separates,
        parameters=parameters(info.forms[0]),
        forms="".join(
            f"\n### Form `{form.name}`\n\n```text\n{form.equation}\n```\n\n{parameters(form)}\n"
            for form in info.forms[1:]
        ),
        snippet=snippet(info.id),
        given="{" + ", ".join(f'"{p.name}": {p.default:g}' for p in info.parameters) + "}",
        reference=info.reference,
    )


def parameters(form: Form) -> str:
    """A table of the parameters of a form."""
    rows = [
        [
            f"`{p.name}`",
            p.unit,
            f"{p.default:g}",
            f"{p.lower:g} to {p.upper:g}",
            "" if p.neutral is None else f"{p.neutral:g}",
            p.meaning
            if p.expected is None
            else "{}; expected {:g} to {:g}".format(p.meaning, *p.expected),
        ]
        for p in form.parameters
    ]
    return "\n".join(table(["parameter", "unit", "usual", "bounds", "off at", "meaning"], rows))


def linked(rival: str) -> str:
    """A rival, with a link where it has a page."""
    return f"[`{rival}`]({rival}.md)" if rival in EFFECTS else rival


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """A table of Markdown."""
    lines = [
        head,
        ["---"] * len(head),
        *([cell.replace("|", r"\|") for cell in row] for row in rows),
    ]
    return [f"| {' | '.join(line)} |" for line in lines]
