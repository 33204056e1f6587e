"""Pages of the site: each is in its contents, none is long, and its code names what is public. The
site itself, and the tutorials in it, are made by ``make docs``.
"""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
#: Folders whose pages are made by a command, or are records of what was found.
RECORDS = ("effects", "reproduction", "proof", "decisions")
MOST_WORDS = 1500
MOST_LETTERS = 500  # of a paragraph
MADE = ("benchmarks", "convergence", "recruitment")  # pages that a command writes
PAGES = sorted(page for page in DOCS.rglob("*.md") if not page.name.startswith("_"))
WRITTEN = [page for page in PAGES if page.relative_to(DOCS).parts[0] not in RECORDS]
#: Pages whose programs need nothing but the package and take less than a second.
QUICK = (
    "explanation/gas",
    "from_mujoco_ros",
    "from_simulink",
    "how-to/export",
    "how-to/matlab_log",
    "how-to/other_jobs",
    "how-to/own_force_law",
    "how-to/two_muscles",
    "rigs/air",
)
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))


def name_of(page: Path) -> str:
    return page.relative_to(DOCS).with_suffix("").as_posix()


def cells(page: Path) -> list[str]:
    """Text of each cell of a tutorial, without what is said about its output."""
    found = re.findall(
        r"^```\{code-cell\} ipython3\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S
    )
    return [re.sub(r"^(:\w+: .*\n)+", "", text) for text in found]


def programs(page: Path) -> list[str]:
    """Python of a page: cells of a tutorial, else blocks."""
    if page in TUTORIALS:
        return [text for text in cells(page) if not text.startswith("%")]
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def listed(page: Path) -> set[str]:
    """Pages below a page: those that its contents name, and the folder of a README."""
    blocks = re.findall(
        r"^```\{toctree\}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S
    )
    below = {
        (page.parent / line).relative_to(DOCS).as_posix()
        for block in blocks
        for line in block.splitlines()
        if line and not line.startswith(":")
    }
    if page.stem == "README":
        below |= {name_of(other) for other in page.parent.glob("*.md") if other != page}
    return below


def test_every_page_is_in_the_contents() -> None:
    reached, waiting = set[str](), {"index"}
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting |= listed(DOCS / f"{name}.md") - reached
    assert reached == {name_of(page) for page in PAGES}


def words_of(page: Path) -> str:
    """Text of a page without the tables that are made from the package, and without code."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"^<!-- (made-\S+) -->$.*?^<!-- end of \1 -->$", "", text, flags=re.M | re.S)
    return re.sub(r"^ *```.*?^ *```$", "", text, flags=re.M | re.S)


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_pages_are_short(page: Path) -> None:
    assert len(words_of(page).split()) <= MOST_WORDS


def paragraphs(page: Path) -> list[str]:
    """Paragraphs and points of a page, each as one line; headings, tables and code are none."""
    parts = re.split(r"\n\s*\n|\n(?=\s*(?:[-*|]|\d+\.) )", words_of(page))
    lines = [" ".join(part.split()) for part in parts if not part.lstrip("\n").startswith("    ")]
    return [line for line in lines if not line.startswith(("|", "#"))]


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_paragraphs_are_short(page: Path) -> None:
    if name_of(page) not in MADE:
        assert [line for line in paragraphs(page) if len(line) > MOST_LETTERS] == []


def is_public(module: ModuleType, word: str) -> bool:
    """Whether a module offers a name: in its list, or made when asked for."""
    public = getattr(module, "__all__", None)
    return public is None or word in public or word not in vars(module)


def known(path: list[str], *, imported: bool = False) -> Any:
    """What a dotted name of the package is, nothing that begins with an underscore: as an import
    finds it, which loads what it names, or else as it is there after ``import pamrs`` alone.
    """
    thing: Any = importlib.import_module(path[0])
    for word in path[1:]:
        assert not word.startswith("_"), ".".join(path)
        if isinstance(thing, ModuleType):
            if imported and not hasattr(thing, word):
                importlib.import_module(f"{thing.__name__}.{word}")
            loaded = imported and isinstance(getattr(thing, word), ModuleType)
            assert loaded or is_public(thing, word), f"{'.'.join(path)}: {word} is not public"
        thing = getattr(thing, word)
    return thing


def dotted(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Name):
        return [node.id]
    inner = dotted(node.value) if isinstance(node, ast.Attribute) else []
    return [*inner, node.attr] if inner else []


def public_names(text: str, names: dict[str, list[str]]) -> int:
    """Check each name of the package in a program; `names` keeps what its imports bind."""
    count = 0
    tree = ast.parse(re.sub(r"^\s*[%!].*$", "", text, flags=re.M))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "pamrs":
                    known(alias.name.split("."), imported=True)
                    names[alias.asname or "pamrs"] = [alias.name if alias.asname else "pamrs"]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "pamrs":
            for alias in node.names:
                path = [*str(node.module).split("."), alias.name]
                known(path, imported=True)
                count += 1
                names[alias.asname or alias.name] = path
    for node in ast.walk(tree):
        path = dotted(node)
        if len(path) > 1 and path[0] in names:
            whole = [*names[path[0]], *path[1:]]
            if all(isinstance(known(whole[:k]), ModuleType | type) for k in range(1, len(whole))):
                known(whole)
                count += 1
    return count


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_programs_name_what_is_public(page: Path) -> None:
    names: dict[str, list[str]] = {"pamrs": ["pamrs"]}
    found = sum(public_names(text, names) for text in programs(page))
    assert found or not any("pamrs." in text for text in programs(page))


def spoken(page: Path) -> list[str]:
    """Names of the package in a page's text and in its lists of the reference."""
    text = re.sub(r"^```python\n.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    found = re.findall(r"`(pamrs(?:\.[A-Za-z]\w*)+)[`(]", text)
    return found + re.findall(r"^   (pamrs(?:\.\w+)+)$", text, re.M)


@pytest.mark.parametrize("page", [ROOT / "README.md", *WRITTEN], ids=lambda page: page.stem)
def test_names_in_texts_are_there_after_import_pamrs(page: Path) -> None:
    for name in spoken(page):
        known(name.split("."))


@pytest.mark.parametrize("name", QUICK)
def test_quick_programs_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    texts = programs(DOCS / f"{name}.md")
    assert texts
    for text in texts:
        exec(compile(text, f"{name}.md", "exec"), names)


@pytest.mark.parametrize(
    "text",
    [
        "pamrs.Muscles()",
        "from pamrs.fit import fit_mussel",
        "import pamrs.rig._muscle",
        "pamrs.fit.levels.found",
    ],
)
def test_a_name_that_is_not_public_is_found(text: str) -> None:
    with pytest.raises((AssertionError, AttributeError, ImportError)):
        public_names(text, {"pamrs": ["pamrs"]})
