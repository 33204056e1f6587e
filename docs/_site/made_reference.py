"""Tables of the documents, made from the package: commands, keys of rig files, channels, units,
settings, files, checks of a case. Each stands in a page between two marks, and the page around it
has the words; ``make reference`` writes them anew.
"""

import dataclasses
import inspect
import itertools
import math
import re
from pathlib import Path

REFERENCE = Path(__file__).parents[1] / "reference"


def cell(text):
    """A text as a cell of a table; code stays as it is."""
    plain = " ".join(str(text).split()).replace("|", "\\|")
    parts = plain.split("`")
    parts[::2] = [part.replace("<", "&lt;") for part in parts[::2]]
    return "`".join(parts)


def rows(heads, lines):
    """A table in Markdown."""
    yield "| " + " | ".join(heads) + " |"
    yield "|" + "---|" * len(heads)
    for line in lines:
        yield "| " + " | ".join(cell(part) for part in line) + " |"
    yield ""


def number(value):
    """A bound or a default, as people write it."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def commands():
    """Every command: how it is called, what it does, its arguments and options."""
    import typer

    from pamrs.cli import app

    def told(command, name):
        context = command.context_class(command, info_name=name)
        if getattr(command, "commands", None):
            for word in sorted(command.commands):
                yield from told(command.commands[word], f"{name} {word}")
            return
        yield f"## `{name}`\n"
        usage = " ".join(command.collect_usage_pieces(context))
        yield f"```text\n{name} {usage}\n```\n"
        yield " ".join((command.help or "").split()) + "\n"
        records = [param.get_help_record(context) for param in command.params]
        lines = [(f"`{left.strip()}`", right) for left, right in filter(None, records)]
        if lines:
            yield from rows(["argument or option", "what"], lines)

    yield from told(typer.main.get_command(app), "pamrs")


def _default(key):
    if key.default is None:
        return "needed"
    if isinstance(key.default, tuple | list):
        return ", ".join(map(number, key.default)) or "none"
    return number(key.default)


def _bounds(key):
    if key.choices:
        return ", ".join(f"`{choice}`" for choice in key.choices)
    ends = [number(end) for end in (key.lower, key.upper) if math.isfinite(end)]
    return " to ".join(ends)


def rig_keys():
    """Every key of a rig file, by its block."""
    from pamrs.rig.schema import BLOCKS, LIMITS, PORTS

    for block in sorted({*BLOCKS, "limits"}, key=[*BLOCKS, "limits"].index):
        yield f"## `[{block}]`\n"
        keys = BLOCKS.get(block, LIMITS)
        lines = []
        for key in keys:
            only = f"{', '.join(key.only)} only" if key.only else ""
            words = "; ".join(filter(None, [key.note, only]))
            unit = key.unit if key.kind in ("scalar", "vector") else key.kind
            lines.append((f"`{'.'.join(key.where)}`", unit, _default(key), _bounds(key), words))
        for port in PORTS.get(block, ()):
            may = ", ".join([*(f"name of a {kind}" for kind in port.kinds), *port.words])
            lines.append((f"`{port.name}`", "name", "", may, f"where left out: {port.default}"))
        yield from rows(["key", "unit", "where left out", "allowed (SI)", "what"], lines)


def channels():
    """Every channel of recordings: unit, block, range."""
    from pamrs.channels import CHANNELS, laboratory_unit

    lines = []
    for name, one in CHANNELS.items():
        ends = [number(end) for end in (one.lower, one.upper) if math.isfinite(end)]
        read = laboratory_unit(name)[0]
        lines.append((f"`{name}`", one.unit, read, one.block, " to ".join(ends)))
    yield from rows(["channel", "SI", "in texts and pictures", "block", "allowed (SI)"], lines)


def units():
    """Dimensions and the names of their units that are known."""
    from pamrs.units import DIMENSIONS, spellings

    lines = []
    for dimension, unit in DIMENSIONS.items():
        known = ", ".join(f"`{word}`" for word in spellings(unit)) or "products of others"
        lines.append((dimension, f"`{unit}`", known))
    yield from rows(["dimension", "SI", "also"], lines)


def settings():
    """What a user may change of a diagnosis."""
    from pamrs import DiagnosisSettings

    lines = []
    for one in dataclasses.fields(DiagnosisSettings):
        default = "" if one.default is dataclasses.MISSING else number(one.default)
        unit, about = one.metadata.get("unit", ""), one.metadata.get("about", "")
        lines.append((f"`{one.name}`", default, unit, about, one.metadata.get("origin", "")))
    yield from rows(["setting", "default", "unit", "what", "origin"], lines)


def checks():
    """Every check of a case before any fit, in its order."""
    from pamrs.diagnosis.prepare import CHECKS

    lines = [
        (one.name, one.channels, one.question, one.action.value, "yes" * one.of_rig)
        for one in CHECKS
    ]
    heads = ["check", "looks at", "question", "where the answer is no", "asked by `import --rig`"]
    yield from rows(heads, lines)


def case_keys():
    """Every key of ``case.toml``, by its table."""
    from pamrs.recordings import CASE_KEYS

    for name, rules in CASE_KEYS.items():
        yield f"### {f'`{name}`' if name else 'The whole file'}\n"
        lines = [(f"`{key}`", rule.needed, rule.about) for key, rule in rules.items()]
        yield from rows(["key", "allowed", "what"], lines)


def described(cls):
    """Name and text of each attribute that a class documents."""
    section = (inspect.getdoc(cls) or "").partition("Attributes\n----------\n")[2]
    for names, text in re.findall(r"^(\w[\w, ]*) : .*\n((?:    .*(?:\n|$))+)", section, re.M):
        yield from ((name, text) for name in names.split(", "))


def result_keys():
    """Every key of ``result.json``, and of the tables inside it."""
    from pamrs import Diagnosis, findings

    def table_of(cls, seen):
        texts = {name: text for own in cls.__mro__ for name, text in described(own)}
        written = [field for field in dataclasses.fields(cls) if field.metadata.get("json", True)]
        lines = []
        for text, fields in itertools.groupby(written, key=lambda field: texts[field.name]):
            own = list(fields)
            keys = ", ".join(f"`{field.metadata.get('key', field.name)}`" for field in own)
            kinds = dict.fromkeys(field.type.replace("None", "null") for field in own)
            lines.append((keys, ", ".join(kinds), text))
        yield from rows(["key", "kind", "what"], lines)
        for name in re.findall(r"[A-Z]\w+", " ".join(field.type for field in written)):
            if hasattr(findings, name) and name not in seen:
                seen.add(name)
                yield f"### `{name}`\n"
                yield from table_of(getattr(findings, name), seen)

    yield "### The whole file\n"
    yield "`schema` and `version`, the pamrs that wrote it, and:\n"
    yield from table_of(Diagnosis, set())


MADE = {
    "made-commands": commands,
    "made-rig-keys": rig_keys,
    "made-channels": channels,
    "made-units": units,
    "made-settings": settings,
    "made-case-keys": case_keys,
    "made-checks": checks,
    "made-result-keys": result_keys,
}


def made_pages():
    """Every page of the reference, and the one on checks, by its file, the parts between its marks
    made anew.
    """
    for page in (*sorted(REFERENCE.glob("*.md")), REFERENCE.parent / "cases_checks.md"):
        text = page.read_text(encoding="utf-8")
        for name, made in MADE.items():
            first, last = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
            if first in text:
                head, rest = text.split(first)
                table = "\n".join(made()).strip()
                text = f"{head}{first}\n{table}\n\n{last}{rest.split(last)[1]}"
        yield page, text


def check_servers(app, error):
    """Ask that no page needs a server."""
    from sphinx.errors import ExtensionError

    if error is not None or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        asked = re.findall(
            r"""<(?:script|img|link|iframe)[^>]+(?:src|href)="https?:[^"]*""",
            page.read_text(encoding="utf-8"),
        )
        if asked:
            raise ExtensionError(f"{page.name} asks another server: {asked[0]}")


def setup(app):
    """Called by Sphinx."""
    app.connect("build-finished", check_servers)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    for file, whole in made_pages():
        file.write_text(whole, encoding="utf-8")
