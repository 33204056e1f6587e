"""Tables of the reference, made from the package: commands, keys of rig files, channels, units,
settings, schemas. Each stands in a page between two marks, and the page around it has the words;
``make reference`` writes them anew.
"""

import dataclasses
import json
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


def _schemas():
    from pamrs.diagnosis.result import schema
    from pamrs.recordings import case_schema
    from pamrs.rig.json_schema import rig_schema

    return {"rig": rig_schema, "case": case_schema, "result": schema}


def _kind(entry, document):
    while "$ref" in entry:
        entry = document["$defs"][entry["$ref"].rpartition("/")[2]] | {
            key: value for key, value in entry.items() if key != "$ref"
        }
    ways = [_kind(way, document)[0] for way in entry.get("anyOf", entry.get("oneOf", ()))]
    if ways:
        return " or ".join(dict.fromkeys(filter(None, ways))), entry
    if "enum" in entry:
        return ", ".join(f"`{word}`" for word in entry["enum"]), entry
    if "const" in entry:
        return f"`{entry['const']}`", entry
    kind = entry.get("type", "")
    return " or ".join(kind) if isinstance(kind, list) else kind, entry


def schema_keys(which):
    """The keys of a file by its JSON schema, and of the tables inside it."""
    document = _schemas()[which]()
    seen = []

    def table_of(name, entry):
        lines, inner = [], []
        needed = entry.get("required", ())
        for key, value in entry.get("properties", {}).items():
            kind, whole = _kind(value, document)
            item = _kind(whole["items"], document)[1] if "items" in whole else whole
            told = [one for one in item.get("properties", {}).values() if "description" in one]
            if told and item["properties"] not in seen:
                seen.append(item["properties"])
                inner.append((f"{name}{key}", item))
            mark = "needed" if key in needed else ""
            lines.append((f"`{key}`", kind, mark, value.get("description", "")))
        yield from rows(["key", "kind", "", "what"], lines)
        for path, item in inner:
            yield f"### `{path}`\n"
            yield from table_of(f"{path}.", item)

    yield "### The whole file\n"
    yield from table_of("", document)


MADE = {
    "made-commands": commands,
    "made-rig-keys": rig_keys,
    "made-channels": channels,
    "made-units": units,
    "made-settings": settings,
    "made-case-keys": lambda: schema_keys("case"),
    "made-result-keys": lambda: schema_keys("result"),
}


def made_pages():
    """Every page of the reference by its file, the parts between its marks made anew."""
    for page in sorted(REFERENCE.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        for name, made in MADE.items():
            first, last = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
            if first in text:
                head, rest = text.split(first)
                table = "\n".join(made()).strip()
                text = f"{head}{first}\n{table}\n\n{last}{rest.split(last)[1]}"
        yield page, text


def write_schemas(app, error):
    """The JSON schemas as files, which a page offers; and a check that no page needs a server."""
    from sphinx.errors import ExtensionError

    if error is not None or app.builder.format != "html":
        return
    folder = Path(app.outdir) / "schema"
    folder.mkdir(exist_ok=True)
    for name, made in _schemas().items():
        (folder / f"{name}.schema.json").write_text(json.dumps(made(), ensure_ascii=False))
    for page in Path(app.outdir).rglob("*.html"):
        asked = re.findall(
            r"""<(?:script|img|link|iframe)[^>]+(?:src|href)="https?:[^"]*""",
            page.read_text(encoding="utf-8"),
        )
        if asked:
            raise ExtensionError(f"{page.name} asks another server: {asked[0]}")


def setup(app):
    """Called by Sphinx."""
    app.connect("build-finished", write_schemas)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    for file, whole in made_pages():
        file.write_text(whole, encoding="utf-8")
