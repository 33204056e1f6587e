"""Words that nobody should have to learn: pages, messages, docstrings, comments, names and words of
effects are plain.
"""

import ast
import re
import tokenize
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

#: Private words of the diagnosis, and what says the same plainly.
PRIVATE = {
    r"beside": "with, next to, in addition to, compared with",
    r"told(?! (?:apart|from))": "reported, distinguished",
    r"stands?(?!(?:-ins?| still| for| upright| up)\b)": "is, is written, rests; bench",
    r"looks(?! (?:for|like|alike|at|the same)\b)": "comparisons",
    r"grant(?:s|ed)?": "allow",
    r"hollows?": "local minimum",
    r"(?:takes?|took|taken) up(?! to)": "absorb",
    r"in (?:the|its|their) place of": "instead of",
    r"pliable": "able to fit anything",
    r"the other one(?: of)?": "name it",
    r"quiet (?:group|block)s?": "group that leaves only noise",
    r"strained": "far outside its tolerance",
}
FOUND = re.compile(rf"\b(?:{'|'.join(PRIVATE)})\b", re.IGNORECASE)

#: The same in names, in which a group may be quiet by itself.
PRIVATE_NAME = re.compile(rf"{FOUND.pattern}|\bquiet\b", re.IGNORECASE)
#: Names with a private word that are published, or called as an option or a key of a file is.
PUBLISHED = {
    "cli/__init__.py: with_quiet",
    "cli/_shared.py: QUIET",
    "cli/_shared.py: quiet",
    "cli/_shared.py: with_quiet",
    "effects/_info.py: told_by",
    "findings/_answer.py: quiet",
    "fit/_friction.py: told",
}

#: Pages of the reproduction, whose tables stay as they are.
WRITTEN = "docs/reproduction/"


def private_words(text):
    """Each private word of a text, with what is around it."""
    plain = " ".join(text.split())
    return [plain[max(0, m.start() - 40) : m.end() + 30] for m in FOUND.finditer(plain)]


def pages():
    """Pages for users and readers."""
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        name = path.relative_to(ROOT).as_posix()
        if name not in ("CHANGELOG.md", "CONTRIBUTING.md") and not name.startswith(WRITTEN):
            yield name


def messages(path):
    """Line and text of the strings of a module that have several words: what it prints, raises or
    writes. Docstrings and strings that document a name are none, but those of commands are.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    parts = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr | ast.JoinedStr)
        for part in (node.values if isinstance(node, ast.JoinedStr) else [node.value])
        if isinstance(part, ast.Constant)
    }
    for node in ast.walk(tree):
        text = ""
        if isinstance(node, ast.JoinedStr):
            text = "".join(
                str(piece.value) if isinstance(piece, ast.Constant) else "{}"
                for piece in node.values
            )
        elif isinstance(node, ast.Constant) and id(node) not in parts:
            text = node.value if isinstance(node.value, str) else ""
        if len(text.split()) > 2:
            yield node.lineno, text
    for node in ast.walk(tree) if "cli" in path.parts else ():
        if isinstance(node, ast.FunctionDef) and node.decorator_list:
            yield node.lineno, ast.get_docstring(node) or ""


@pytest.mark.parametrize("name", list(pages()))
def test_pages_have_no_private_words(name):
    assert not private_words((ROOT / name).read_text(encoding="utf-8"))


def test_messages_have_no_private_words():
    package = ROOT / "python/pamrs"
    said = [
        (path.relative_to(package).as_posix(), line, text)
        for path in sorted(package.rglob("*.py"))
        for line, text in messages(path)
    ]
    assert len(said) > 1500
    assert not {
        f"{name}:{line}": words for name, line, text in said if (words := private_words(text))
    }


def docstrings():
    """Place and text of every docstring, and of every string that documents a name."""
    for path in sorted((ROOT / "python/pamrs").rglob("*.py")):
        for entry in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(entry, ast.Expr) and isinstance(entry.value, ast.Constant):
                yield f"{path.relative_to(ROOT)}:{entry.lineno}", str(entry.value.value)


def comments():
    """Name of every module, and its comments as one text."""
    for path in sorted((ROOT / "python/pamrs").rglob("*.py")):
        lines = iter(path.read_text(encoding="utf-8").splitlines(keepends=True))
        yield (
            path.relative_to(ROOT).as_posix(),
            " ".join(
                token.string.lstrip("#: ")
                for token in tokenize.generate_tokens(lines.__next__)
                if token.type == tokenize.COMMENT
            ),
        )


def test_docstrings_and_comments_have_no_private_words():
    documented = dict([*docstrings(), *comments()])
    assert len(documented) > 3000
    assert not {name: words for name, text in documented.items() if (words := private_words(text))}


def test_names_have_no_private_words():
    defined = {
        f"{path.relative_to(ROOT / 'python/pamrs').as_posix()}: {name}"
        for path in (ROOT / "python/pamrs").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if not isinstance(getattr(node, "ctx", None), ast.Load)
        for name in (getattr(node, key, "") for key in ("name", "asname", "arg", "id", "attr"))
    }
    assert {
        name for name in defined if PRIVATE_NAME.search(re.sub(r"_|(?<=[a-z])(?=[A-Z])", " ", name))
    } == PUBLISHED


#: Words with which no docstring opens: it says at once what a thing is or does.
INDIRECT = re.compile(r"(?:What|Whether|Where|How|Those|The same)\b")


def test_docstrings_open_with_what_a_thing_is_or_does():
    assert not [(name, text) for name, text in docstrings() if INDIRECT.match(text.strip())]


def test_words_of_effects_are_not_private():
    files = sorted((ROOT / "python/pamrs/effects/words").glob("*.toml"))
    assert len(files) > 30

    def texts(entry):
        values = list(entry.values()) if isinstance(entry, dict) else entry
        return sum(map(texts, values), []) if isinstance(values, list) else [str(entry)]

    assert not {
        path.name: words
        for path in files
        for text in texts(tomllib.loads(path.read_text(encoding="utf-8")))
        if (words := private_words(text))
    }


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("what is missing beside it is told, and stands in the warnings", 3),
        ("one more look is paid for by looks", 1),
        ("instead of the two, which stand for zero, none is told apart or told from noise", 0),
        ("the joint stands still and looks like a stand-in", 0),
    ],
)
def test_private_words_are_found_where_they_are(text, count):
    assert len(private_words(text)) == count
