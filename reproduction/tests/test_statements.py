"""The tables of statements: each is said somewhere, with as many places as the code fills."""

import ast
import string
from pathlib import Path

import pytest

from reproduction import CHAPTERS
from reproduction.statements import Statements

ROOT = Path(__file__).parents[2] / "reproduction"


def said(chapter):
    """Ids of statements and how many places the code fills."""
    found = {}
    for path in (*ROOT.glob(f"{chapter}*.py"), ROOT / "joints.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            parts = []
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("say", "rows.say", "over"):
                parts = node.args
            elif isinstance(node, ast.Tuple) and path.stem == "chapter4_statements":
                parts = node.elts
            if parts and isinstance(parts[0], ast.Constant) and isinstance(parts[0].value, str):
                found[parts[0].value] = max(len(parts) - 2, 0)
    return found


def places(texts):
    """How many places the texts of a statement have."""
    names = [name for text in texts for _, name, _, _ in string.Formatter().parse(text)]
    return 1 + max((int(name) for name in names if name is not None), default=-1)


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_every_statement_of_a_table_is_said_and_its_places_are_filled(chapter):
    table, code = Statements(chapter), said(chapter)
    assert len(table.rows) > 25
    assert set(table.rows) <= set(code)
    for key, row in table.rows.items():
        assert places(value for value in row.values() if isinstance(value, str)) == code[key], key
        assert row["where"].strip(), key
        assert row["fact"].strip(), key


@pytest.mark.parametrize("chapter", CHAPTERS.values())
def test_groups_of_a_table_are_named(chapter):
    table = Statements(chapter)
    groups = {row["group"] for row in table.rows.values() if "group" in row}
    assert groups | {one["group"] for one in table.pictures} <= set(table.groups)
    names = [one["name"] for one in table.pictures]
    assert len(set(names)) == len(names) > 5
