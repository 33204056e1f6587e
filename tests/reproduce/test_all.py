"""Every chapter at once: what is kept and when, how it goes on, and the page of all statements."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from pamrs import cli, reproduce
from pamrs.comparison import judge
from pamrs.errors import ParameterError
from pamrs.reproduce import _store as store
from pamrs.reproduce.page import Picture, Section, page
from pamrs.reproduce.summary import counts, summary

DOCS = Path(__file__).parents[2] / "docs" / "reproduction"
ROWS = (
    judge("one", "a | b", "6.2", 1.0, 1.01, "bar", tolerance=0.1),
    judge("one", "c", "6.3", 1.0, 2.0, tolerance=0.1, note="because | of it"),
    judge("two", "d", "6.4", math.nan, math.inf, cannot_tell="no number", note="really"),
    judge("two", "e", "6.4", 1.0, 1.0, used=True),
    judge("two", "f", "6.5", 1.0, 2.0, apart="a trial"),
)
SECTION = Section(
    "Chapter 6: a title",
    ROWS,
    {"one": "the first group"},
    ["In short."],
    [("a.b", "1 m", "the reason")],
    [Picture("first", "one", "what it shows", b"\x89PNG 1"), Picture("second", "one", "", b"2")],
    [("nu", "error squared", "rad2 s")],
    {"two": "| a |\n|---|\n| 1 |"},
)


def same(a, b):
    """Whether two chapters are the same, numbers that are none included."""
    assert repr([row.to_dict() for row in a.rows]) == repr([row.to_dict() for row in b.rows])
    assert replace(a, rows=(), pictures=list(a.pictures)) == replace(
        b, rows=(), pictures=list(b.pictures)
    )


# ------------------------------------------------------------------------ what is kept


def test_kept_chapter_is_the_same(tmp_path):
    assert store.kept(tmp_path / "none", "key") is None
    store.keep(tmp_path / "made", "key", SECTION)
    same(store.kept(tmp_path / "made", "key"), SECTION)
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["key"]
    assert page([store.kept(tmp_path / "made", "key")], "x") == page([SECTION], "x")


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"title": "a"}', "null"])
def test_what_cannot_be_read_is_made_again(tmp_path, broken):
    store.keep(tmp_path, "key", SECTION)
    (tmp_path / "key" / "section.json").write_text(broken)
    assert store.kept(tmp_path, "key") is None
    store.keep(tmp_path, "key", SECTION)
    same(store.kept(tmp_path, "key"), SECTION)
    (tmp_path / "key" / "second.png").unlink()
    assert store.kept(tmp_path, "key") is None


def test_half_a_chapter_is_never_there(tmp_path):
    bad = replace(SECTION, chosen=[("a", "b", object())])
    with pytest.raises(TypeError):
        store.keep(tmp_path, "key", bad)
    assert list(tmp_path.iterdir()) == []
    assert json.loads("[]") == []


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of a few files in place of this one."""
    root = tmp_path / "pamrs"
    for name, text in {
        "__init__.py": "",
        "_core.abi3.so": "core",
        "rig/__init__.py": "",
        "rigs/shoulder.toml": "a = 1",
        "cli/reproduce.py": "",
        "__pycache__/x.pyc": "",
        "reproduce/__init__.py": "",
        "reproduce/page.py": "",
        "reproduce/_chapter6.py": "from pamrs.reproduce._own import x\n",
        "reproduce/_chapter6_figures.py": "from pamrs.reproduce import _drawing as d\n",
        "reproduce/_symbols.py": "",
        "reproduce/_own.py": "def f():\n    from pamrs.reproduce.joints import y\n",
        "reproduce/_drawing.py": "",
        "reproduce/joints.py": "import pamrs.reproduce._own\n",
        "reproduce/_chapter3.py": "",
    }.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    monkeypatch.setattr(store, "_ROOT", root)
    return root


def key(search=True):
    store._hashed.cache_clear()  # a file may change within a tick of the clock
    return store.digest("ch6", "_chapter6", search=search)


@pytest.mark.parametrize(
    ("file", "matters"),
    [
        ("_core.abi3.so", True),
        ("rig/__init__.py", True),
        ("rigs/shoulder.toml", True),
        ("reproduce/_chapter6.py", True),
        ("reproduce/_own.py", True),
        ("reproduce/joints.py", True),
        ("reproduce/_drawing.py", True),
        ("reproduce/_symbols.py", True),
        ("reproduce/_chapter3.py", False),
        ("reproduce/page.py", False),
        ("reproduce/__init__.py", False),
        ("cli/reproduce.py", False),
        ("__pycache__/x.pyc", False),
    ],
)
def test_chapter_depends_on_what_it_is_calculated_from(package, file, matters):
    before = key()
    assert key() == before
    with (package / file).open("a") as stream:
        stream.write("\n# changed\n")
    assert (key() != before) == matters


def test_chapter_depends_on_what_was_asked_for_and_on_packages(package, monkeypatch):
    assert key(search=True) != key(search=False)
    before = key()
    (package / "rig" / "new.py").write_text("")
    assert key() != before
    before = key()
    monkeypatch.setattr(store.metadata, "version", lambda name: "0.0")
    assert key() != before


def test_every_chapter_of_this_package_has_its_files():
    for name, module in reproduce._CHAPTERS.items():
        files = {path.name for path in store.inputs(module)}
        assert {f"{module}.py", f"{module}_figures.py", "_drawing.py", "shoulder.toml"} <= files
        assert any(path.startswith("_core") for path in files)
        assert len({f for f in files if f.startswith("_chapter") and "figures" in f}) == 1, name


# ------------------------------------------------------------------------- it goes on


def test_what_is_stopped_goes_on_and_a_second_call_does_nothing(tmp_path, monkeypatch):
    made, stop = [], ["ch4"]

    def section(name, **_):
        if name in stop:
            raise KeyboardInterrupt
        made.append(name)
        return replace(SECTION, title=name)

    monkeypatch.setattr(reproduce, "section", section)
    with pytest.raises(KeyboardInterrupt):
        reproduce.every(cache=tmp_path)
    assert made == ["ch2", "ch3"]
    stop.clear()
    found = reproduce.every(cache=tmp_path)
    assert made == ["ch2", "ch3", "ch4", "ch5", "ch6"]
    assert [one.title for one in found.values()] == made
    told = []
    again = reproduce.every(cache=tmp_path, progress=told.append)
    assert len(made) == 5
    assert list(again) == reproduce.names()
    assert all("nothing changed" in text for text in told)
    reproduce.every(cache=tmp_path, search=False)
    assert len(made) == 10


def test_code_that_changes_while_it_runs_is_not_kept(tmp_path, monkeypatch):
    keys = iter(range(100))
    monkeypatch.setattr(store, "digest", lambda *_, **__: str(next(keys)))
    monkeypatch.setattr(reproduce, "section", lambda name, **_: SECTION)
    told = []
    reproduce.every(cache=tmp_path, progress=told.append)
    assert list(tmp_path.glob("*")) == []
    assert sum("not kept" in text for text in told) == 5


# ---------------------------------------------------------------------------- the page


def test_summary_has_each_statement_that_counts():
    assert counts(SECTION) == {
        "agree": 2,
        "differs": 1,
        "cannot tell": 1,
        "used": 1,
        "apart": 1,
    }
    text = summary({"ch6": SECTION, "ch2": replace(SECTION, title="Two")}, "pamrs x")
    lines = text.splitlines()
    assert "Made by `pamrs x`; change the code, not this page." in lines
    assert "| [Chapter 6: a title](chapter6.md) | 2 | 1 | 1 | 1 | 1 |" in lines
    assert "| **all** | 4 | 2 | 2 | 2 | 2 |" in lines
    heads = [k for k, line in enumerate(lines) if line.startswith("| **the first group** |")]
    assert len(heads) == 2
    rows = lines[heads[0] + 1 :]
    assert rows[0].startswith("| a \\| b | 6.2 |")
    assert "[1](chapter6/first.png) [2](chapter6/second.png)" in rows[0]
    assert "| **differs** | because \\| of it |" in rows[1]
    assert rows[2] == "| **two** | | | | | | |"
    assert "(chapter2/" in lines[heads[1] + 1]
    assert "| none | inf |" not in text
    assert "agree (used)" in text
    assert "| f |" not in text
    assert "no number; really" in text


def test_summary_in_the_documentation_counts_the_tables_beside_it():
    import csv

    text = (DOCS / "README.md").read_text(encoding="utf-8")
    assert "Made by `pamrs reproduce all --output docs/reproduction`" in text
    total = [0] * 5
    for name in reproduce.names():
        chapter = name.replace("ch", "chapter")
        with (DOCS / chapter / "facts.csv").open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        counted = [row for row in rows if not row["apart"]]
        found = [
            sum(row["verdict"] == "agree" for row in counted),
            sum(row["verdict"] == "agree" and row["used"] == "yes" for row in counted),
            sum(row["verdict"] == "differs" for row in counted),
            sum(row["verdict"] == "cannot tell" for row in counted),
            len(rows) - len(counted),
        ]
        assert f"({chapter}.md) | {' | '.join(map(str, found))} |" in text
        total = [a + b for a, b in zip(total, found, strict=True)]
    assert f"| **all** | {' | '.join(map(str, total))} |" in text


# -------------------------------------------------------------------------- the command


def run(capsys, *words):
    code = cli.main(["reproduce", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_command_writes_pages_tables_and_pictures(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(
        reproduce, "section", lambda name, **_: replace(SECTION, title=f"Chapter {name}")
    )
    folder, cache = tmp_path / "out", tmp_path / "cache"
    code, out, err = run(capsys, "all", "--output", folder, "--cache", cache, "--no-search")
    assert code == 0
    assert "Chapter ch6: 2 agree (1 used to identify), 1 differ" in out
    assert "ch2: reproducing" in err
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert f"`pamrs reproduce all --output {folder} --no-search`" in text
    for name in reproduce.names():
        chapter = name.replace("ch", "chapter")
        own = (folder / f"{chapter}.md").read_text(encoding="utf-8")
        assert f"![what it shows]({chapter}/first.png)" in own
        assert (
            f"`pamrs reproduce {name} --output {folder / chapter} --page "
            f"{folder / f'{chapter}.md'} --no-search`"
        ) in own
        assert (folder / chapter / "first.png").read_bytes() == b"\x89PNG 1"
        assert (folder / chapter / "facts.csv").is_file()
    code, _, err = run(capsys, "all", "--output", folder, "--cache", cache, "--no-search")
    assert code == 0
    assert err.count("nothing changed") == 5


def test_command_that_is_stopped_says_that_it_goes_on(capsys, tmp_path, monkeypatch):
    def section(name, **_):
        if name == "ch3":
            raise KeyboardInterrupt
        return SECTION

    monkeypatch.setattr(reproduce, "section", section)
    words = ("all", "--output", tmp_path / "out", "--cache", tmp_path / "cache", "--no-search")
    code, out, err = run(capsys, *words)
    assert code != 0
    assert out == ""
    assert "stopped: what was finished is kept, the same command goes on" in err
    assert len(list((tmp_path / "cache").iterdir())) == 1
    assert list((tmp_path / "out").iterdir()) == []


def test_command_refuses_what_does_not_go_with_all(capsys, tmp_path):
    for words, said in (
        (("all", "ch3", "--output", tmp_path / "x"), "all goes alone"),
        (("all", "--output", tmp_path / "x", "--page", tmp_path / "p.md"), "--page = "),
        (("ch3", "--output", tmp_path / "x", "--cache", tmp_path), "--cache = "),
    ):
        code, _, err = run(capsys, *words)
        assert code == 2
        assert said in err
    assert not (tmp_path / "x").exists()
    with pytest.raises(ParameterError, match="chapter = 'all' is not reproduced"):
        reproduce.check("all")
