"""Every chapter at once: what is kept and when, how it goes on, and the page of all statements."""

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

import reproduction
from reproduction import CHAPTERS, store
from reproduction.__main__ import main
from reproduction.comparison import KINDS, judge
from reproduction.page import Picture, Section, page
from reproduction.summary import counts, summary
from reproduction.tests.pages import DOCS, facts, page_of
from tests.tables import rows_of

ROWS = (
    judge("one", "a | b", "6.2", 1.0, 1.01, "bar", tolerance=0.1),
    judge("one", "c", "6.3", 1.0, 2.0, tolerance=0.1, reason="because | of it"),
    judge("two", "d", "6.4", math.nan, math.inf, cannot_tell="no number", note="really"),
    judge("two", "e", "6.4", 1.0, 1.0, basis="construction"),
    judge("two", "g", "6.4", 1.0, 2.0, relation="above", basis="sign"),
    judge("two", "h", "6.4", 1.0, 0.5, relation="above", basis="sign"),
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


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package and a reproduction of a few files in place of these."""
    for name in (
        "pamrs/_core.abi3.so",
        "pamrs/rig/__init__.py",
        "pamrs/rigs/shoulder.toml",
        "pamrs/cli/fit.py",
        "pamrs/__pycache__/x.pyc",
        "reproduction/page.py",
        "reproduction/chapter6.py",
        "reproduction/chapter6_figures.py",
        "reproduction/statements/symbols.toml",
        "reproduction/chapter3.py",
        "reproduction/statements/chapter6.toml",
        "reproduction/statements/chapter3.toml",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    monkeypatch.setattr(store, "_ROOTS", (tmp_path / "pamrs", tmp_path / "reproduction"))
    return tmp_path


@pytest.mark.parametrize(
    ("file", "matters"),
    rows_of(__file__, "chapter_depends_on_what_it_is_calculated_from"),
)
def test_chapter_depends_on_what_it_is_calculated_from(package, file, matters):
    before = store.digest("ch6", search=True)
    assert store.digest("ch6", search=True) == before
    (package / file).write_text("# changed")
    assert (store.digest("ch6", search=True) != before) == matters


def test_every_chapter_has_its_files():
    for name, module in CHAPTERS.items():
        files = {Path(part).name for part in store.inputs(name)}
        assert {f"{module}.py", "drawing.py", "shoulder.toml"} <= files
        assert any(part.startswith("_core") for part in files)
        assert "recruitment.py" in files
        assert all(part.startswith(module) for part in files if part.startswith("chapter"))


# ------------------------------------------------------------------------- it goes on


def test_what_is_stopped_goes_on_and_a_second_call_does_nothing(tmp_path, monkeypatch):
    made, stop, told = [], ["ch4"], []

    def section(name, **_):
        if name in stop:
            raise KeyboardInterrupt
        made.append(name)
        return replace(SECTION, title=name)

    def every(**more):
        return reproduction.every(list(CHAPTERS), tmp_path, progress=told.append, **more)

    monkeypatch.setattr(reproduction, "section", section)
    with pytest.raises(KeyboardInterrupt):
        every()
    assert made == ["ch2", "ch3"]
    stop.clear()
    found = every()
    assert made == ["ch2", "ch3", "ch4", "ch5", "ch6"]
    assert [one.title for one in found.values()] == made
    told.clear()
    assert list(every()) == made == list(CHAPTERS)
    assert len(told) == 5
    assert all("nothing changed" in text for text in told)
    every(search=False)
    assert len(made) == 10


def test_code_that_changes_while_it_runs_is_not_kept(tmp_path, monkeypatch):
    keys = iter(range(100))
    monkeypatch.setattr(store, "digest", lambda *_, **__: str(next(keys)))
    monkeypatch.setattr(reproduction, "section", lambda name, **_: SECTION)
    told = []
    reproduction.every(list(CHAPTERS), tmp_path, progress=told.append)
    assert list(tmp_path.glob("*")) == []
    assert sum("not kept" in text for text in told) == 5


# ---------------------------------------------------------------------------- the page


def test_summary_has_each_statement_that_counts():
    assert counts(SECTION) == {
        "agrees on its own": 1,
        "agrees by construction": 1,
        "agrees in sign only": 1,
        "differs": 2,
        "cannot tell": 1,
        "apart": 1,
    }
    text = summary({"ch6": SECTION, "ch2": replace(SECTION, title="Two")}, "pamrs x")
    lines = text.splitlines()
    assert "Made by `pamrs x`; change the code, not this page." in lines
    assert "| [Chapter 6: a title](chapter6.md) | 1 | 1 | 1 | 2 | 1 | 1 |" in lines
    assert "| **all** | 2 | 2 | 2 | 4 | 2 | 2 |" in lines
    assert any(line.startswith("**2 of 12 statements agree on their own**") for line in lines)
    heads = [k for k, line in enumerate(lines) if line.startswith("| **the first group** |")]
    assert len(heads) == 2
    rows = lines[heads[0] + 1 :]
    assert rows[0].startswith("| a \\| b | 6.2 |")
    assert "[1](chapter6/first.png) [2](chapter6/second.png)" in rows[0]
    assert "| **differs** | because \\| of it |" in rows[1]
    assert rows[2] == "| **two** | | | | | | |"
    assert "(chapter2/" in lines[heads[1] + 1]
    assert "| none | inf |" not in text
    assert "| agrees by construction | within" in text
    assert "| **differs** | reason not known |" in text
    assert "| f |" not in text
    assert "no number; really" in text


def test_summary_in_the_documentation_counts_the_tables_beside_it():
    text = (DOCS / "README.md").read_text(encoding="utf-8")
    assert "Made by `make reproduce`" in text
    total = [0] * (len(KINDS) + 1)
    for chapter in CHAPTERS.values():
        counted = [row for row in facts(chapter) if not row["apart"]]
        found = [sum(row["kind"] == kind for row in counted) for kind in KINDS]
        found.append(len(facts(chapter)) - len(counted))
        assert f"({chapter}.md) | {' | '.join(map(str, found))} |" in text
        total = [a + b for a, b in zip(total, found, strict=True)]
    assert f"| **all** | {' | '.join(map(str, total))} |" in text
    assert f"**{total[0]} of {sum(total[:-1])} statements agree on their own**" in text


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_what_is_only_above_another_never_agrees_on_its_own(chapter):
    compared = [
        row
        for row in facts(chapter)
        if not row["apart"]
        and row["relation"] != "equals"
        and (row["published"] == "0" or (row["published"] == "1" and not row["unit"]))
    ]
    assert [row["fact"] for row in compared if row["kind"] == KINDS[0]] == []


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_page_in_the_documentation_says_its_command_and_has_its_pictures(chapter):
    text = page_of(chapter)
    assert "`make reproduce`" in text.splitlines()[2]
    links = re.findall(r"\]\(([^)]+\.png)\)", text)
    assert len(links) >= 8
    assert all((DOCS / link).is_file() for link in links)


# -------------------------------------------------------------------------- the command


def test_command_writes_pages_tables_and_pictures(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(
        reproduction, "section", lambda name, **_: replace(SECTION, title=f"Chapter {name}")
    )
    folder, cache = tmp_path / "out", tmp_path / "cache"
    words = [str(folder), "--cache", str(cache)]
    main([*words, "--only", "ch6"])
    assert {path.name for path in folder.iterdir()} == {"chapter6", "chapter6.md"}
    main(words)
    out = capsys.readouterr().out
    assert "Chapter ch6: 1 agree on their own, 1 by construction, 1 in sign only, 2 differ" in out
    assert "ch2: reproducing" in out
    assert out.count("nothing changed") == 1
    assert "Made by `make reproduce`;" in (folder / "README.md").read_text(encoding="utf-8")
    for chapter in CHAPTERS.values():
        own = (folder / f"{chapter}.md").read_text(encoding="utf-8")
        assert f"![what it shows]({chapter}/first.png)" in own
        assert "Made by `make reproduce`;" in own
        assert (folder / chapter / "first.png").read_bytes() == b"\x89PNG 1"
        assert (folder / chapter / "facts.csv").is_file()
    main([*words, "--no-search"])
    assert "Made by `make reproduce without searches`" in (folder / "README.md").read_text()
