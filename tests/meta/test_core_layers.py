"""What the modules of the Rust core may use: the order of ARCHITECTURE.md, no cycles."""

from __future__ import annotations

import graphlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "crates" / "pam-core" / "src"

#: From the bottom to the top; a module uses only what stands in lines above its own. Those in one
#: line do not know each other.
LAYERS = (
    ("dual", "error"),
    ("scalar", "room", "chebyshev", "keys"),
    ("braid", "clock"),
    ("muscle",),
    ("blocks",),
    ("effects",),
    ("description",),
    ("plant",),
    ("vector",),
    ("simulate",),
    ("lanes", "cut_chain"),
    ("batch",),
)

Module = tuple[str, ...]
Name = tuple[str, ...]


def plain(text: str) -> str:
    """Source without comments, texts and tests."""
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text)
    return re.sub(r"#\[cfg\(test\)\]\s*mod \w+(;|\s*\{.*\Z)", "", text, flags=re.S)


@cache
def sources() -> dict[Module, str]:
    """Each module with its source; files of tests are none."""
    found = {}
    for file in sorted(SOURCE.rglob("*.rs")):
        parts = file.relative_to(SOURCE).with_suffix("").parts
        module = parts[:-1] if parts[-1] in ("mod", "lib") else parts
        if parts[-1] != "tests":
            found[module] = plain(file.read_text(encoding="utf-8"))
    return found


def expanded(tree: str) -> Iterator[tuple[str, str]]:
    """Paths of a tree of uses, each with the name that it has where it is used."""
    head, brace, body = tree.strip().partition("{")
    if not brace:
        path, _, other = (part.strip() for part in head.partition(" as "))
        yield path, other or path.rpartition("::")[2]
        return
    depth, last = 0, 0
    body = body.rstrip()[:-1]
    for place, mark in enumerate(body + ","):
        depth += (mark == "{") - (mark == "}")
        if mark == "," and depth == 0:
            for path, name in expanded(body[last:place]) if body[last:place].strip() else ():
                yield ("", head)[bool(head)] + path, name
            last = place + 1


def absolute(module: Module, path: str) -> Name | None:
    """A path from the root of the crate, None where it leads elsewhere."""
    first, *rest = path.replace(" ", "").replace("\n", "").split("::")
    if first == "crate":
        return tuple(rest)
    if first not in ("self", "super"):
        return (*module, first, *rest) if (*module, first) in sources() else None
    own = list(module)
    parts = [first, *rest]
    while parts and parts[0] in ("self", "super"):
        own = own[:-1] if parts.pop(0) == "super" else own
    return (*own, *parts)


@cache
def exports(module: Module) -> dict[str, Name]:
    """What a module passes on under a name of its own."""
    uses = re.findall(r"\bpub(?:\([a-z]+\))? use ([^;]+);", sources()[module])
    pairs = [pair for use in uses for pair in expanded(use)]
    return {n: to for path, n in pairs if (to := absolute(module, path)) is not None}


def home(path: Name) -> Module:
    """The module in which something stands, whatever passes it on."""
    known = next(path[:n] for n in range(len(path), -1, -1) if path[:n] in sources())
    if len(known) == len(path):
        return known
    passed = exports(known).get(path[len(known)])
    return known if passed is None else home((*passed, *path[len(known) + 1 :]))


def used() -> set[tuple[Module, Module]]:
    """Which module uses something of which; the root only passes on."""
    found = set()
    for module, text in sources().items():
        uses = re.findall(r"\buse ([^;]+);", text)
        paths = [path for use in uses for path, _ in expanded(use)]
        rest = re.sub(r"\buse [^;]+;", "", text)
        paths += re.findall(r"\b(?:crate|super|self)(?:::\w+)+", rest)
        there = (absolute(module, path) for path in paths)
        found |= {(module, home(path)) for path in there if path is not None}
    return {(a, b) for a, b in found if a != b and a and b}


def test_every_module_has_its_place() -> None:
    tops = {module[0] for module in sources() if module}
    named = [name for layer in LAYERS for name in layer]
    assert sorted(named) == sorted(tops)


def test_no_module_uses_one_beside_or_above_it() -> None:
    height = {name: index for index, layer in enumerate(LAYERS) for name in layer}
    against = {
        ("::".join(a), "::".join(b))
        for a, b in used()
        if a[0] != b[0] and height[b[0]] >= height[a[0]]
    }
    assert not against, "uses that go upward"


def test_no_files_use_each_other() -> None:
    needs: dict[Module, set[Module]] = {}
    for module, other in used():
        needs.setdefault(module, set()).add(other)
    try:
        graphlib.TopologicalSorter(needs).prepare()
    except graphlib.CycleError as error:
        pytest.fail(f"a cycle of files: {' <- '.join('::'.join(m) for m in error.args[1])}")


def test_uses_are_read_as_the_compiler_does() -> None:
    names = [name for _, name in expanded("a::{b, c::{d as e, f}, g}")]
    paths = [path for path, _ in expanded("a::{b, c::{d as e, f}, g}")]
    assert (paths, names) == (["a::b", "a::c::d", "a::c::f", "a::g"], ["b", "e", "f", "g"])
    assert home(("Error",)) == ("error",)
    assert (("lanes", "flight"), ("simulate", "drive")) in used()
